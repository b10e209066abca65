"""Watch a run in the cell: where parts end, how near joints come to their limits, what page and report show.

In: a run and its plant. Out: figures and pictures. It looks at the truth, and nobody who controls the cell looks at it.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING

from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Values
from rcsc.run.system import System
from rcsc_cell.cell.arm import margins_deg, solve
from rcsc_cell.cell.physical import Physical
from rcsc_cell.cell.plant import Latest, Plant
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import depth_mm
from rcsc_cell.database.pose import Vector, minus, pose_of
from rcsc_cell.pictures.report import CellPicture, Figure, Matched, Placement, ReportRow, Story
from rcsc_cell.pictures.solid import solid
from rcsc_cell.pictures.stick import Scene, pads, stick
from rcsc_cell.pictures.things import outline
from rcsc_cell.workstation.prepared import ScriptDraft
from rcsc_cell.workstation.station import RowResult

if TYPE_CHECKING:
    from rcsc_cell.live import Live

SERIES = {
    "hand height (mm)": "primitive.robot.plate[2]",
    "hand speed (mm/s)": "primitive.speed_mm_s",
    "finger opening (mm)": "gripper.hand.opening_mm",
    "finger force (N)": "gripper.hand.force_n",
}
"""What the report draws, by the name above the drawing."""
PUTS = ("release", "transfer", "clear")
"""Commands after which a part lies somewhere."""
FRAMES_APART, LONG_APART = 25, 80
"""Cycles between pictures of the filmstrip: at the least, and in the middle of a long row."""


@dataclass(slots=True)
class Timed:
    """Something outside the levels, and how long it took."""

    inner: Plant
    seconds: float = 0.0

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """One cycle."""
        begun = time.perf_counter()
        given = self.inner.step(tick, latest)
        self.seconds += time.perf_counter() - begun
        return given

    def state(self) -> dict[str, object]:
        """The plant's."""
        return self.inner.state()

    def restore(self, state: Mapping[str, object]) -> None:
        """The plant's."""
        self.inner.restore(state)


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
class Witness:
    """Watches every cycle of a run; in `System.watch`.

    Attributes:
        timed: The plant, timed.
        live: The page that follows; None where nobody looks.
        film: Whether pictures for a report are kept.
        margins_deg: The least so far.
    """

    run: ScriptDraft
    timed: Timed
    live: "Live | None" = None
    film: bool = False
    margins_deg: tuple[float, ...] = (360.0,) * 6
    seconds: float = 0.0
    frames: list[CellPicture] = field(default_factory=list)
    series: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    matched: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    _row: int = -1
    _drawn: int = -FRAMES_APART
    _told: int = -1

    @property
    def plant(self) -> Plant:
        """The plant."""
        return self.timed.inner

    def __call__(self, system: System, due: tuple[RunningLevel, ...]) -> None:
        """After each cycle."""
        begun = time.perf_counter()
        margins = margins_deg(self.plant.mechanism.joints())
        self.margins_deg = tuple(map(min, self.margins_deg, margins))
        for level in due:
            self.matched[level.name, level.table, level.line] += 1
        if self.film:
            self._film(system)
        if self.live is not None:
            self._show(self.live, system)
        self.seconds += time.perf_counter() - begun

    # --- pictures ---

    def _film(self, system: System) -> None:
        for shown, name in SERIES.items():
            value = _leaf(system, name)
            self.series.setdefault(shown, []).append(
                (system.tick * 0.001 * system.description.tick_ms, value)
            )
        at = self.run.station.at
        since = system.tick - self._drawn
        if since >= LONG_APART or (at != self._row and since >= FRAMES_APART):
            self._drawn, self._row = system.tick, at
            self.frames.append(CellPicture(system.tick, self._caption(), self.picture()))

    def _caption(self) -> str:
        at = min(self.run.station.at, len(self.run.station.rows) - 1)
        row = self.run.station.rows[at]
        return f"row {row.number}: {row.text}"

    def picture(self) -> str:
        """The cell as it looks, or the stick figure where there is no physics."""
        mechanism = self.plant.mechanism
        if isinstance(mechanism, Physical):
            return solid(mechanism.model, mechanism.data)
        return self.figure(self.run.system)

    def figure(self, system: System) -> str:
        """Return the stick figure from PRIMITIVE's values (section 10)."""
        level = system.level("primitive")
        numbers = tuple(float(level.values[at]) for at in level.sign.record("to_robot.plate"))
        pose = pose_of(numbers)
        joints = None if pose is None else solve(pose, self.plant.mechanism.joints())
        trail = () if pose is None else (pads(pose, self.run.database.hand.tool_mm),)
        scene = Scene(
            tuple(map(outline, self.run.database.stations.values())), trail, self.run.database.hand.tool_mm
        )
        return stick(numbers, self.plant.mechanism.hand()[0], joints, scene)

    def finish(self) -> None:
        """The page sees how the last row ended."""
        if self.live is not None:
            self._tell(self.live)

    def _tell(self, live: "Live") -> None:
        """Show what became of the rows; those to come are listed from the start."""
        station = self.run.station
        if self._told < 0:
            for row in station.rows:
                live.row(row.number, row.text, "")
        for result in station.results[max(0, self._told) :]:
            live.row(result.row.number, result.row.text, result.state)
        if self._told != len(station.results) and station.at < len(station.rows):
            row = station.rows[station.at]
            live.row(row.number, row.text, "running")
        self._told = len(station.results)

    def _show(self, live: "Live", system: System) -> None:
        self._tell(live)
        live.publish(system.tick, variables(system))
        if live.frame_due("stick"):
            live.frame("stick", self.figure(system))
        if live.frame_due("solid") and isinstance(self.plant.mechanism, Physical):
            live.frame("solid", self.picture())

    # --- what became of it ---

    def placed(self) -> tuple[PartPlace, ...]:
        """Every part that the script put somewhere and did not take again."""
        return placements(self.run.station.results, self.run.database, self.plant)

    def story(self, title: str, seconds: float) -> Story:
        """For the report."""
        station, system = self.run.station, self.run.system
        ticks, cycle_s = system.tick, 0.001 * system.description.tick_ms
        rows = [
            ReportRow(result.row.number, result.row.text, result.state, result.ticks, result.reason)
            for result in station.results
        ]
        return Story(
            title,
            rows,
            self.frames,
            self.series,
            [Matched(*line, self.matched[line]) for line in _lines(system, self.matched)],
            [
                Figure("cycles", float(ticks), ""),
                Figure("control time", ticks * cycle_s, "s"),
                Figure("computing", seconds, "s"),
                Figure("times as fast as the clock", ticks * cycle_s / max(seconds, 1e-9), ""),
                Figure("of it the plant", self.timed.seconds, "s"),
                Figure("of it pictures and figures", self.seconds, "s"),
            ],
            [
                Placement(
                    f"{placed.part} at {placed.place}",
                    _shown(placed.wanted_mm),
                    _shown(placed.actual_mm),
                    placed.error_mm,
                )
                for placed in self.placed()
            ],
            self.margins_deg,
            system.description.tick_ms,
        )


def variables(system: System) -> dict[str, float | str]:
    """Every leaf of every level by its whole name; words for what the tables have words for."""
    return {
        f"{level.name}.{leaf.name}": leaf.shown(value) if leaf.members else float(value)
        for level in system.levels
        for leaf, value in zip(level.sign.leaves, level.values, strict=False)
    }


def names(system: System) -> tuple[str, ...]:
    """The names of all these."""
    return tuple(f"{level.name}.{leaf.name}" for level in system.levels for leaf in level.sign.leaves)


def placements(results: list[RowResult], database: Database, plant: Plant) -> tuple[PartPlace, ...]:
    """Return where rows should have put parts, and the nearest part of the kind; the last row counts."""
    put: dict[str, tuple[str, int]] = {}
    held = ""
    for result in results:
        row = result.row
        if result.state != "done" or not row.robot:
            continue
        held = row.part if row.source else held
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
    """The middle of a part that stands upright at a location; None where it lies tilted."""
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


def _leaf(system: System, name: str) -> float:
    level_name, _, leaf_name = name.partition(".")
    level = system.level(level_name)
    at = next(at for at, leaf in enumerate(level.sign.leaves) if leaf.name == leaf_name)
    return float(level.values[at])


def _lines(system: System, matched: Counter[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    """All lines of all levels' tables, in their order; those that ran are among them."""
    every = [
        (level.name, table, line)
        for level in system.levels
        for table in (level.level.tables.values() or [level.level.table])
        for line in level.sign.tables.get(table, ())
    ]
    return list(dict.fromkeys(chain(every, matched)))


def _shown(at_mm: Vector) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in at_mm) + ")"
