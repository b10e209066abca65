"""What a property sees: the system after a cycle, the cell as it is in truth, and the command under way.

In: a running system and its plant. Out: a `CycleState`, which `rcsc_cell.episodes.loop` changes in every tick. Truth (where parts are,
what touches what) is for those who judge a run alone; nothing of it reaches a level.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

from rcsc.run.episodes.cycle import Cycle
from rcsc.run.signature import Value
from rcsc_cell.cell.arm import Joints
from rcsc_cell.cell.mujoco_model import Body
from rcsc_cell.cell.plant import Plant
from rcsc_cell.database.ask import Database
from rcsc_cell.database.pose import Pose

COUNTED: Mapping[str, str] = {
    "tbox": "tbuffer_boxt",
    "bbox": "bbuffer_boxb",
    "flag": "fbuffer_flag",
    "hous": "hbuffer_hous",
}
"""Where TASK counts what lies on the buffer (Fig. 9)."""
LETS_GO = frozenset({"drops", "slips"})
"""Faults that take a part out of the fingers."""
TAKES = frozenset({"acquire", "move", "transfer"})
"""Commands that may take a part."""
APART_MM = 10.0
"""Fingers that are nearer hold nothing: a part that closed ones (`close_grip`, 5 mm) press on touches both pads, too."""


@dataclass(frozen=True, slots=True)
class Command:
    """An order that the workstation gave to TASK.

    Attributes:
        name: Of the command.
        obj: A name of the tables; `null_obj` for none.
        source: A location's number, 0 for none; `dest` and `end_at` likewise.
        tick: When it was given.
        held: What TASK believed to hold then.
        here: Where TASK believed the robot to be then.
    """

    number: int
    name: str
    obj: str
    grasp: int
    source: int
    dest: int
    end_at: int
    sector: int
    tick: int
    held: str
    here: int


@dataclass(slots=True, kw_only=True)
class CycleState(Cycle):
    """The state after a cycle, with the cell as it is.

    Attributes:
        bodies: Of the parts, as they were at first.
        command: What TASK was last ordered; None before the first order.
        ended: `done` or `failed` in the cycle in which TASK first says so of this command.
        active: Fault classes at work.
        last: When a fault class was last at work.
        harmed: Buffers that something happens to in this cycle.
    """

    database: Database
    plant: Plant
    bodies: tuple[Body, ...]
    command: Command | None = None
    ended: str = ""
    active: frozenset[str] = frozenset()
    last: dict[str, int] = field(default_factory=dict)
    harmed: frozenset[str] = frozenset()
    joints: Joints = ()
    opening_mm: float = 0.0
    force_n: float = 0.0
    parts: tuple[Pose, ...] = ()
    touching: frozenset[tuple[str, str]] = frozenset()
    held: tuple[int, ...] = ()

    def look(self) -> None:
        """Read the cell's truth."""
        mechanism = self.plant.mechanism
        self.joints, self.parts, self.touching = mechanism.joints(), mechanism.parts(), mechanism.touching()
        self.opening_mm, self.force_n = mechanism.hand()
        self.held = _held(self.touching) if self.opening_mm >= APART_MM else ()

    def shown(self, level: str, leaf: str) -> str:
        """Return a leaf in the words of the tables."""
        return self.levels[level].shown(leaf)

    def value(self, level: str, leaf: str) -> Value:
        """Return a leaf."""
        return self.levels[level].value(leaf)

    def was_active(self, names: frozenset[str], since_tick: int) -> bool:
        """Whether one of these fault classes was at work since then."""
        return any(name in self.last and self.last[name] >= since_tick for name in names)

    @property
    def counts(self) -> dict[str, int]:
        """Return what TASK counts on the buffer, by object."""
        return {name: int(self.value("task", leaf)) for name, leaf in COUNTED.items()}

    def objects(self) -> tuple[str, ...]:
        """Return the kind of each part: the database's object of the nearest size, as nothing else tells parts apart."""
        sizes = {
            name: self.database.sizes[number]
            for name, number in self.database.objects.items()
            if name in COUNTED
        }
        return tuple(
            min(
                sizes,
                key=lambda name: sum(abs(a - b) for a, b in zip(sizes[name], body.size_mm, strict=True)),
            )
            for body in self.bodies
        )


def _held(touching: frozenset[tuple[str, str]]) -> tuple[int, ...]:
    """Return parts that both pads touch."""
    left = {other for pad, other in touching if pad == "pad_left"}
    right = {other for pad, other in touching if pad == "pad_right"}
    return tuple(sorted(int(name[4:]) for name in left & right if name.startswith("part")))


class Property(Protocol):
    """Something that is to hold in every cycle.

    Attributes:
        name: For findings and summaries.
        place: Where the paper asks for it.
    """

    name: ClassVar[str]
    place: ClassVar[str]

    def __init__(self, cycle: CycleState) -> None: ...

    def watch(self, cycle: CycleState) -> str | None:
        """Return the violation in this cycle; None where it holds."""
        ...


PropertyClass = type[Property]
"""A property is made for one run, from the state before its first cycle."""
