"""An episode: one run of the cell with everything that is odd about it, as a value; and what became of it.

In: parts, a script, what goes wrong and when. Out: rows, findings, lines of tables, a digest. An episode travels as JSON, and gives
the same outcome in every process and with both kinds of executors.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import chain
from pathlib import Path
from typing import ClassVar, get_args

from rcsc.base.host.files.names import shown
from rcsc.base.host.files.read import rows_of
from rcsc.run.episodes.episode import FAULTS as OF_ANY_SYSTEM
from rcsc.run.episodes.episode import BufferFault, Harm, Restart, SavedEpisode, Switch, window_told
from rcsc.run.episodes.episode import Episode as EpisodeOfAnySystem
from rcsc.run.system import Kind
from rcsc_cell.cell.faults import Faults
from rcsc_cell.cell.ready import Backend
from rcsc_cell.workstation.script import COLUMNS

SYSTEM = Path(__file__).parents[3] / "tables" / "system.toml"

FAULTS: Mapping[str, str] = {
    **{switch.name: "a switch of rcsc_cell.cell.faults" for switch in fields(Faults)},
    **{name: OF_ANY_SYSTEM[name] for name in (*get_args(Harm), "restarted")},
    "pushed": "parts: somebody pushes one that lies there; without physics only",
    "missing part": "parts: what the script asks for is nowhere",
    "wrong part": "parts: another lies where it should be",
    "two parts": "parts: two of a kind lie there",
    "odd size": "parts: a size that the database does not have",
    "odd weight": "parts: a density or a friction that is not usual",
    "changed command": "the script: another command comes before the last one has ended",
}
"""Fault classes, and how each is injected."""


REACH: Mapping[str, tuple[float, float]] = {
    "step_s": (0.0002, 0.04), "tick": (0, 1_000_000), "first_tick": (0, 1_000_000), "last_tick": (-1, 2_000_000),
    "part": (0, 1000), "value": (-1e6, 1e6), "x_mm": (-1e4, 1e4), "y_mm": (-1e4, 1e4), "yaw_deg": (-1e4, 1e4),
    "size_mm": (0.1, 1000.0), "density_kg_m3": (1.0, 1e5), "friction": (0.0, 100.0),
}  # fmt: skip
"""Between what each number of an episode lies; what is drawn lies well within."""


@dataclass(frozen=True, slots=True)
class PartSpec:
    """A part that lies on a station at first.

    Attributes:
        object: What it is in truth; a name of the database.
        station: On which it lies; its place there is seen from the station.
        size_mm: Length, width and height; empty for the database's.
        friction: Against everything but the pads.
    """

    object: str
    station: str = "buffer"
    x_mm: float = 0.0
    y_mm: float = 0.0
    yaw_deg: float = 0.0
    size_mm: tuple[float, ...] = ()
    density_kg_m3: float = 2700.0
    friction: float = 0.4

    def told(self) -> str:
        """Return it in words, with what is not usual of it."""
        size = f", {' x '.join(f'{side:g}' for side in self.size_mm)} mm large" if self.size_mm else ""
        weight = "" if self.density_kg_m3 == 2700.0 else f", of {self.density_kg_m3:g} kg/m3"
        slides = "" if self.friction == 0.4 else f", with friction {self.friction:g}"
        return (
            f"`{self.object}` lies on `{self.station}` at x = {self.x_mm:g} mm, y = {self.y_mm:g} mm, "
            f"turned by {self.yaw_deg:g} degrees{size}{weight}{slides}"
        )


@dataclass(frozen=True, slots=True)
class SwitchTo(Switch):
    """A switch of `rcsc_cell.cell.faults.Faults` is set to a value in these ticks."""

    value: float = 1.0

    def told(self) -> str:
        """Return it in words."""
        graded = "" if isinstance(getattr(Faults(), self.fault), bool) else f" = {self.value:g}"
        return f"{window_told(self)}: the cell's fault `{self.fault}`{graded}"


@dataclass(frozen=True, slots=True)
class Interruption:
    """From this tick on TASK has another command, whatever is under way; no interlock checks it."""

    tick: int
    row: str


@dataclass(frozen=True, slots=True)
class Push:
    """Somebody pushes a part that lies there, by its number in `parts`; seen from the base."""

    tick: int
    part: int
    x_mm: float
    y_mm: float


@dataclass(frozen=True, slots=True)
class Episode(SavedEpisode):
    """One run.

    Attributes:
        rows: Of the script, each a line of CSV as in tables/scripts.
        step_s: Of physics.
    """

    LISTS: ClassVar[tuple[str, ...]] = (
        "interruptions", "pushes", "rows", "faults", "transport", "restarts", "parts",
    )  # fmt: skip
    PLAINER: ClassVar[tuple[str, ...]] = ("backend",)

    backend: Backend = "kinematic"
    executor: Kind = "c"
    seed: int = 0
    parts: tuple[PartSpec, ...] = ()
    rows: tuple[str, ...] = ()
    faults: tuple[SwitchTo, ...] = ()
    transport: tuple[BufferFault, ...] = ()
    restarts: tuple[Restart, ...] = ()
    interruptions: tuple[Interruption, ...] = ()
    step_s: float = 0.002
    pushes: tuple[Push, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what no episode can be.

        Raises:
            ValueError: An unknown backend or fault; a number out of reach; a push with physics; what no system's episode can be.
        """
        self.in_any_system()
        known = {switch.name for switch in fields(Faults)}
        for word, words in (
            (self.backend, get_args(Backend)),
            *((fault.fault, known) for fault in self.faults),
        ):
            if word not in words:
                raise ValueError(f"{shown(word)} is none of {', '.join(sorted(words))}")
        for what, number in self._numbers():
            low, high = REACH[what]
            if not low <= number <= high:
                raise ValueError(f"`{what}` is {number:g}, and lies between {low:g} and {high:g}")
        if any(len(part.size_mm) not in (0, 3) for part in self.parts):
            raise ValueError("a size is a length, a width and a height")
        if self.pushes and self.backend != "kinematic":
            raise ValueError("with physics nothing but a force moves a part")

    def in_any_system(self) -> EpisodeOfAnySystem:
        """Return the part of it that any system's episode could have."""
        return EpisodeOfAnySystem(
            executor=self.executor, seed=self.seed, harms=self.transport, restarts=self.restarts
        )

    def _numbers(self) -> Iterator[tuple[str, float]]:
        """Yield every number in it, by the name of its field."""
        yield "step_s", self.step_s
        for element in chain.from_iterable(getattr(self, name) for name in self.LISTS):
            for name in REACH:
                value = getattr(element, name, ())
                yield from ((name, number) for number in (value if isinstance(value, tuple) else (value,)))

    def told(self) -> tuple[str, ...]:
        """Return the episode in words, a line for each thing in it."""
        steps = f"by contact physics, in steps of {1000 * self.step_s:g} ms"
        return (
            f"the cell moves {steps if self.backend == 'mujoco' else 'by kinematics alone'}; seed {self.seed}",
            *(f"part {number}: {part.told()}" for number, part in enumerate(self.parts)),
            *(f"row {number}: `{_row_told(row)}`" for number, row in enumerate(self.rows, 1)),
            *self.in_any_system().told(),
            *(fault.told() for fault in self.faults),
            *(
                f"tick {one.tick}: `task` is ordered `{_row_told(one.row)}`, whatever is under way"
                for one in self.interruptions
            ),
            *(
                f"before tick {push.tick}: part {push.part} is pushed by x = {push.x_mm:g} mm, y = {push.y_mm:g} mm"
                for push in self.pushes
            ),
        )

    def script(self) -> str:
        """Return its rows as a script."""
        return script(self.rows)


def _row_told(row: str) -> str:
    """Return a row of a script as a report has it, without its commas."""
    return " ".join(cell for told in rows_of(script((row,)), COLUMNS) for cell in told.values() if cell)


def script(rows: Sequence[str]) -> str:
    """Return the rows as the text of a script, for `rcsc run`."""
    return "\n".join((",".join(COLUMNS), *rows)) + "\n"
