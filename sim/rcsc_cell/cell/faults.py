"""Faults of a cell, for every plant; none by default."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, fields

from rcsc_cell.cell.arm import Joints

WEAK = 0.05
"""What a weak motor has left of its force."""
USUAL: Mapping[str, float] = {"joint_stuck": 1.0, "late_ticks": 120.0, "shifted_mm": 30.0}
"""How strong a switch is that is no yes or no, where nobody says: a joint, later than what is waited for, and beside the part."""
GRADES: Mapping[str, tuple[float, float]] = {
    "joint_stuck": (1.0, 6.0), "late_ticks": (1.0, 100_000.0), "shifted_mm": (-500.0, 500.0),
}  # fmt: skip
"""The lowest and the highest strength of each of these."""


@dataclass(slots=True)
class Faults(Collection[str]):
    """Switches, set and cleared at any cycle; as a collection, their names.

    Attributes:
        robot_stuck: No joint moves.
        joint_stuck: Which joint does not move, from 1; 0 is none.
        robot_refuses: The controller refuses every pose.
        unreadable: A joint's reading is no number.
        hand_stuck: The fingers do not move.
        hand_weak: Their motor has a twentieth of its force.
        jammed: The fingers feel the whole force though they are where they are.
        slips: The pads have no friction to speak of.
        drops: The hand opens, whatever it is told.
        blind: The image processing matches nothing.
        dark: No picture comes.
        late_ticks: How much later than usual a picture comes.
        noisy: The sensor's noise is five times what it should be.
        shifted_mm: The image processing says that the part is so far aside.
        tilted: The second picture shows a surface that does not lie flat.
        vise_stuck: The jaws do not move.
        vise_weak: The right jaw stops 6 mm before it meets what it closes on.
        vise_mute: Nothing is said of vise and machine.
    """

    robot_stuck: bool = False
    joint_stuck: int = 0
    robot_refuses: bool = False
    unreadable: bool = False
    hand_stuck: bool = False
    hand_weak: bool = False
    jammed: bool = False
    slips: bool = False
    drops: bool = False
    blind: bool = False
    dark: bool = False
    late_ticks: int = 0
    noisy: bool = False
    shifted_mm: float = 0.0
    tilted: bool = False
    vise_stuck: bool = False
    vise_weak: bool = False
    vise_mute: bool = False

    def __iter__(self) -> Iterator[str]:
        return (switch.name for switch in fields(self))

    def __len__(self) -> int:
        return len(fields(self))

    def __contains__(self, name: object) -> bool:
        return name in tuple(self)

    def set(self, name: str, strength: float) -> None:
        """Set a switch: with 0 it is off, and one that is yes or no is on with anything else."""
        setattr(self, name, type(getattr(self, name))(strength))

    def reachable(self, before: Joints, goal: Joints) -> Joints:
        """Return the goal, with stuck joints at their last goal; both in radians."""
        return tuple(
            was if self.robot_stuck or self.joint_stuck == at else wanted
            for at, (was, wanted) in enumerate(zip(before, goal, strict=True), 1)
        )

    @property
    def motor(self) -> float:
        """The share of its force that the motor of the fingers has."""
        return WEAK if self.hand_weak else 1.0
