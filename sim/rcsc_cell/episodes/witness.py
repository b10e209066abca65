"""Watch a run in the cell: where parts end, how near joints come to their limits, what page and report show.

In: a run and its plant. Out: figures and pictures. It looks at the truth, and nobody who controls the cell looks at it.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

from rcsc.run.orders.operator import RowResult
from rcsc.run.plant.models.solid import solid
from rcsc.run.signature import Values
from rcsc.run.system import System
from rcsc.views.pages.report import Figure, Placement, Story
from rcsc.views.pages.witness import RunWitness
from rcsc_cell.cell.arm import margins_deg, solve
from rcsc_cell.cell.physical import Physical
from rcsc_cell.cell.plant import Latest, Plant
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import depth_mm
from rcsc_cell.database.pose import Vector, minus, pose_of
from rcsc_cell.pictures.room import outline
from rcsc_cell.pictures.stick import Scene, pads, stick
from rcsc_cell.workstation.interlocks import PUTS
from rcsc_cell.workstation.script import ScriptRow
from rcsc_cell.workstation.station import Workstation

DRAWN = (
    "primitive.from_robot.plate[2]",
    "primitive.speed_mm_s",
    "gripper.hand.opening_mm",
    "gripper.hand.force_n",
)
"""Curves of the report: height and speed of the hand, opening and force of its fingers."""


@dataclass(slots=True)
class Timed(Plant):
    """A plant that knows how long its cycles took."""

    seconds: float = field(default=0.0, kw_only=True)

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """Run one cycle."""
        begun = time.perf_counter()
        given = Plant.step(self, tick, latest)
        self.seconds += time.perf_counter() - begun
        return given


def timed(plant: Plant) -> Timed:
    """Return the plant, timed from now on."""
    return Timed(*(getattr(plant, name.name) for name in fields(Plant)))


@dataclass(frozen=True, slots=True)
class PartPlace:
    """Where a part should lie, and where it lies: its middle, in mm."""

    part: str
    place: str
    wanted_mm: Vector
    actual_mm: Vector

    @property
    def error_mm(self) -> float:
        """How far apart they are."""
        x, y, z = minus(self.actual_mm, self.wanted_mm)
        return float((x * x + y * y + z * z) ** 0.5)


@dataclass(slots=True)
class Witness(RunWitness):
    """Watches every cycle of a run in the cell; in `System.watch`.

    Attributes:
        plant: It is timed.
        database: The cell's.
        margins_deg: The least so far.
    """

    plant: Timed = field(kw_only=True)
    database: Database = field(kw_only=True)
    drawn: Sequence[str] = DRAWN
    margins_deg: tuple[float, ...] = (360.0,) * 6

    def __post_init__(self) -> None:
        """Name the pictures; a solid one is drawn where there is physics."""
        mechanism = self.plant.mechanism
        pictures = {"stick": lambda: self.figure(self.run.system)}
        if isinstance(mechanism, Physical):
            pictures["solid"] = lambda: solid(mechanism.model, mechanism.data)
        self.pictures = pictures

    def look(self) -> None:
        """Keep the least distances of the joints from their limits."""
        margins = margins_deg(self.plant.mechanism.joints())
        self.margins_deg = tuple(map(min, self.margins_deg, margins))

    def figure(self, system: System) -> str:
        """Return the stick figure from PRIMITIVE's values (section 10)."""
        level = system.level("primitive")
        numbers = tuple(float(level.values[at]) for at in level.sign.record("to_robot.plate"))
        pose = pose_of(numbers)
        joints = None if pose is None else solve(pose, self.plant.mechanism.joints())
        tool_mm = self.database.hand.tool_mm
        trail = () if pose is None else (pads(pose, tool_mm),)
        scene = Scene(tuple(map(outline, self.database.stations.values())), trail, tool_mm)
        return stick(numbers, self.plant.mechanism.hand()[0], joints, scene)

    # --- what became of it ---

    def placed(self) -> tuple[PartPlace, ...]:
        """Return every part that the script put somewhere and did not take again."""
        operator = self.run.operator
        return (
            placements(operator.results, self.database, self.plant)
            if isinstance(operator, Workstation)
            else ()
        )

    def story(self, title: str, seconds: float) -> Story:
        """For the report."""
        story = RunWitness.story(self, title, seconds)
        return replace(
            story,
            timing=[*story.timing[:-1], Figure("of it the plant", self.plant.seconds, "s"), story.timing[-1]],
            placements=[
                Placement(
                    f"{placed.part} at {placed.place}",
                    _shown(placed.wanted_mm),
                    _shown(placed.actual_mm),
                    placed.error_mm,
                )
                for placed in self.placed()
            ],
            margins_deg=self.margins_deg,
        )

    def closing(self) -> Iterator[str]:
        """Where parts lie, and how near the joints came to their limits."""
        for placed in self.placed():
            yield f"{placed.part} at {placed.place}: {placed.error_mm:.2f} mm from where it should lie"
        margins = ", ".join(f"{margin:.0f}" for margin in self.margins_deg)
        yield f"joints kept {margins} degrees from their limits"


def placements(
    results: Sequence[RowResult[ScriptRow]], database: Database, plant: Plant
) -> tuple[PartPlace, ...]:
    """Return where rows should have put parts, and the nearest part of the kind; the last row counts."""
    put: dict[str, tuple[str, int]] = {}
    held = ""
    for result in results:
        row = result.row
        if result.state != "done" or not row.robot:
            continue
        held = row.part if row.source or row.robot == "acquire" else held
        put = {place: what for place, what in put.items() if place != row.source}
        if row.robot in PUTS and row.dest and held:
            put[row.dest] = (held, row.sector)
    return tuple(
        placement
        for place, (part, sector) in put.items()
        for placement in _nearest(place, part, sector, database, plant)
    )


def _nearest(place: str, part: str, sector: int, database: Database, plant: Plant) -> list[PartPlace]:
    number = database.objects[part]
    upright = _upright(place, sector, number, database)
    there = [
        pose.at_mm
        for kind, pose in zip(plant.objects, plant.mechanism.parts(), strict=True)
        if kind == number
    ]
    if upright is None or not there:
        return []
    closest: Callable[[Vector], float] = lambda at: PartPlace(part, place, upright, at).error_mm  # noqa: E731  # a key
    return [PartPlace(part, f"{place}({sector})" if sector else place, upright, min(there, key=closest))]


def _upright(place: str, sector: int, number: int, database: Database) -> Vector | None:
    """Return the middle of a part that stands upright at a location; None where it lies tilted."""
    plate = database.plate(database.locations[place], sector)
    if plate is None or plate.axis(2)[2] > -0.999:
        return None
    at = plate.point((0.0, 0.0, database.hand.tool_mm))
    height = database.sizes[number][2]
    lowest = at[2] + depth_mm(height, database.hand.pad_mm) - height
    return (at[0], at[1], _surface(database, at, lowest) + height / 2)


def _surface(database: Database, at: Vector, lowest_mm: float) -> float:
    """Return what a part with its lowest point so high rests on: the vise's bed, or the station's top."""
    station = database.station_below(at)
    if station is None:
        return lowest_mm
    return station.frame.at_mm[2] + (float(station.vise["bed_mm"][2]) if station.vise else 0.0)


def _shown(at_mm: Vector) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in at_mm) + ")"
