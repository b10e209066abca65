"""Answer the levels' queries from memory: the database is read once, before anything moves.

In: the SQLite file. Out: a `Database` whose answers are tuples in the order of the records that they fill.
"""

import functools
import itertools
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.printable import escape
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.described import Document, Kind, Record, fits
from rcsc.base.host.files.names import shown
from rcsc.base.host.files.read import MOST_BYTES, Malformed, json_of, opened, plain
from rcsc.run.signature import Values
from rcsc_cell.database.build import COLUMNS, SCHEMA, VBLOCK, VISE, BadData
from rcsc_cell.database.pose import Pose, Vector, about_z, pose_of

NO_PLACE: Values = (False, False, False, 0, 0)
NO_ROUTE: Values = (False, 0, 0, 0, 0, 0, 0, 0)
NO_PART: Values = (False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NO_POINT: Values = (False, *(0.0,) * 9, 1.0, 10.0, 10.0, 0.0)
NO_FINGERS: Values = (False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Part:
    """A part that lies somewhere when a simulated run begins."""

    object: int
    x_mm: float
    y_mm: float
    z_mm: float
    yaw_deg: float


@dataclass(frozen=True, slots=True)
class Station:
    """A table that things stand on, and its fixture: a vise, a V-block, or nothing.

    Attributes:
        frame: Its axes: the middle of its top, x away from the robot.
        size_mm: Along x and y.
        vise: The vise's numbers by name; empty where there is none.
        vblock: The V-block's.
    """

    name: str
    frame: Pose
    yaw_deg: float
    size_mm: tuple[float, float]
    vise: Mapping[str, Any]
    vblock: Mapping[str, Any]

    def below(self, at_mm: Vector) -> bool:
        """Tell whether it stands below a point of the base's axes, however high that is."""
        x, y, _ = self.frame.inside(at_mm)
        return abs(x) <= self.size_mm[0] / 2 and abs(y) <= self.size_mm[1] / 2


@dataclass(frozen=True, slots=True)
class Hand:
    """The hand at the robot's wrist.

    Attributes:
        tool_mm: From the wrist plate to the middle of the pads.
        pad_mm: From there to the pads' lower edge.
        camera_mm: Where the camera is, as the plate sees it.
    """

    tool_mm: float
    pad_mm: float
    camera_mm: Vector


@dataclass(frozen=True, slots=True)
class Database:
    """All queries of the levels, and their answers."""

    locations: Mapping[str, int]
    objects: Mapping[str, int]
    sizes: Mapping[int, tuple[float, float, float]]
    stock: Mapping[int, int]
    parts: tuple[Part, ...]
    home: Values
    hand: Hand
    stations: Mapping[str, Station]
    _places: Mapping[int, Values]
    _routes: Mapping[tuple[int, int], Values]
    _parts: Mapping[int, Values]
    _points: Mapping[int, Values]
    _fingers: Mapping[tuple[int, int], Values]
    _departures: Mapping[tuple[int, int, int], tuple[int, int]]
    _approaches: Mapping[tuple[int, int, int], tuple[int, int]]

    def place(self, location: int) -> Values:
        """Return a place: known, vision, buffer, vupos, safe."""
        return self._places.get(location, NO_PLACE)

    def route(self, location: int, sector: int) -> Values:
        """Return a route: known, departure and approach (first point, count each), points to hover, to grasp and to look from."""
        known = self._routes.get((location, sector))
        if known is None and not self._is_pallet(location):  # it has no sectors
            known = self._routes.get((location, 0))
        return known or NO_ROUTE

    def target(self, location: int, sector: int) -> Values:
        """Return a target: known, points to hover, to grasp and to look from."""
        known, *_, hover, grasp, view = self.route(location, sector)
        return known, hover, grasp, view

    def path(self, here: int, here_sector: int, location: int, sector: int) -> Values:
        """Return the way from one location to another: known, departure (first point, count), approach (first point, count).

        Those of the pair, else the departure of the one and the approach of the other. A robot that is there already stays, but for
        a location where vision says where a part is: there it may stand beside it.
        """
        known, *_ = there = self.route(location, sector)
        leaves = (
            self._pair(self._departures, (here, here_sector, location)) or self.route(here, here_sector)[1:3]
        )
        comes = self._pair(self._approaches, (location, sector, here)) or there[3:5]
        if (
            known
            and here == location
            and (here_sector == sector or not self._is_pallet(here))
            and not self.place(here)[1]
        ):
            first, count = comes
            leaves, comes = (0, 0), (first + count - 1, 1)
        return known, *leaves, *comes

    def _pair(
        self, ways: Mapping[tuple[int, int, int], tuple[int, int]], key: tuple[int, int, int]
    ) -> tuple[int, int] | None:
        at, sector, other = key
        return ways.get((at, sector if self._is_pallet(at) else 0, other))

    def _is_pallet(self, location: int) -> bool:
        return (location, 1) in self._routes

    def part(self, number: int) -> Values:
        """Return a part: known, ranges in mm from the camera to its top, as it lies and when the pads can take it; lift in mm; normal.

        The lift: how much higher than at the locations of the data the pads hold it. The normal: of its top, in the camera's axes.
        """
        return self._parts.get(number, NO_PART)

    def point(self, number: int) -> Values:
        """Return a point: known, nine numbers in mm, speed in mm/s, acceleration and deceleration in mm/s^2, breakpoint distance in mm."""
        return self._points.get(number, NO_POINT)

    def fingers(self, number: int, grasp: int) -> Values:
        """Return a grasp: known, approach, departure and grip opening and tolerance in mm, force in N, speed in mm/s."""
        return self._fingers.get((number, grasp), NO_FINGERS)

    def plate(self, location: int, sector: int) -> Pose | None:
        """Return the wrist plate, in mm, at the last point of the way to a location; None where there is no such way."""
        known, _, _, comes, many, *_ = self.route(location, sector)
        if not known or not many:
            return None
        return pose_of([float(value) for value in self.point(int(comes) + int(many) - 1)[1:10]])

    def pads(self, location: int, sector: int) -> Vector | None:
        """Return the middle of the pads, in mm, when the robot is at a location; None where there is no way to it."""
        plate = self.plate(location, sector)
        return None if plate is None else plate.point((0.0, 0.0, self.hand.tool_mm))

    def station_below(self, at_mm: Vector) -> Station | None:
        """Return the station that stands below a point; None over the floor."""
        return next((station for station in self.stations.values() if station.below(at_mm)), None)

    def routes(self) -> tuple[tuple[int, int, Values], ...]:
        """Return every route with its location and sector."""
        return tuple((location, sector, row) for (location, sector), row in self._routes.items())

    def pairs(self) -> tuple[tuple[int, int, int, int], ...]:
        """Return every two places with a path of their own: location and sector of each."""
        return tuple(
            (*here, *there)
            for here in self._routes
            for there in self._routes
            if (*here, there[0]) in self._departures or (*there, here[0]) in self._approaches
        )

    @property
    def queries(self) -> dict[str, Callable[..., Values]]:
        """The queries by name, for the levels' feeds."""
        return {
            "place": self.place,
            "target": self.target,
            "path": self.path,
            "part": self.part,
            "point": self.point,
            "fingers": self.fingers,
        }


# --- the file ---

MOST_ROWS = 1_000_000
MOST_STEPS, STEPS_APART = 500, 1_000_000
"""Of SQLite's own machine, in units of the second: a file that is made to can keep it busy for ever."""


@dataclass(frozen=True, slots=True)
class Listed:
    """A table of the file: its rows, in the order of its columns."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


def tables_of(path: Path) -> dict[str, Listed]:
    """Read every table of a database whole; check each value by its column.

    A file may come from anybody. Only the tables of `SCHEMA`, as they stand there, are looked at: a view, a trigger or a column
    that is computed would be a program of the file's own.

    Raises:
        BadData: It is not there, or is no database of a cell.
    """
    try:
        opened(path).close()
        if path.stat().st_size > MOST_BYTES:
            raise Malformed(f"has more than {MOST_BYTES} bytes")
        held = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
        try:
            return _listed(held)
        finally:
            held.close()
    except FileNotFoundError as error:
        raise BadData((f"there is no database {shown(str(path))}: run `rcsc db build`",)) from error
    except OSError as error:
        raise BadData((f"{shown(str(path))} cannot be read: {error.strerror}",)) from error
    except (sqlite3.Error, ValueError, MemoryError) as error:
        raise BadData((f"{shown(str(path))} is no database of a cell: {escape(str(error))}",)) from error


def _listed(held: sqlite3.Connection) -> dict[str, Listed]:
    turns = itertools.count(1)
    held.set_progress_handler(lambda: next(turns) > MOST_STEPS, STEPS_APART)
    if sorted(held.execute(_MASTER)) != _schema()[0]:
        raise Malformed("it has other tables, or something beside them: run `rcsc db build`")
    tables, left = {}, MOST_ROWS
    for name, columns in _schema()[1].items():
        rows = tuple(itertools.islice(held.execute(f"select * from {name}"), left + 1))  # noqa: S608  # of our schema
        left -= len(rows)
        if left < 0:
            raise Malformed(f"it has more than {MOST_ROWS} rows")
        for row in rows:
            for column, value in zip(columns, row, strict=True):
                column.check(name, value)
        tables[name] = Listed(tuple(column.name for column in columns), rows)
    if held.execute("pragma foreign_key_check").fetchone() is not None:
        raise Malformed("it names what it does not hold")
    return tables


_MASTER = "select type, name, tbl_name, coalesce(sql, '') from sqlite_master"


@dataclass(frozen=True, slots=True)
class _Column:
    name: str
    kind: str
    needed: bool

    def check(self, table: str, value: object) -> None:
        """Raises: Malformed: The value is not of the column; SQLite itself takes any."""
        if value is None and not self.needed:
            return
        if not fits(COLUMNS[self.kind], value) or (isinstance(value, str) and plain(value) != value):
            what = shown(value if isinstance(value, str) else repr(value)[:40])
            raise Malformed(f"`{table}.{self.name}` is {what}, and must be {COLUMNS[self.kind].shown}")


@functools.cache
def _schema() -> tuple[list[Any], Mapping[str, tuple[_Column, ...]]]:
    """Return the rows of the table of tables, and the columns of each."""
    held = sqlite3.connect(":memory:")
    try:
        held.executescript(SCHEMA)
        tables = [name for (name,) in held.execute("select name from sqlite_master where type = 'table'")]
        columns = {
            name: tuple(
                _Column(column, kind.lower(), bool(needed or key))
                for _, column, kind, needed, _, key in held.execute(f"pragma table_info({name})")
            )
            for name in tables
        }
        return sorted(held.execute(_MASTER)), columns
    finally:
        held.close()


def fresh(path: Path, expected: str) -> bool:
    """Tell whether the file is a database with the digest `expected`."""
    try:
        return tables_of(path)["meta"].rows == ((expected,),)
    except BadData:
        return False


def open_database(path: Path) -> Database:
    """Read a database whole.

    Raises:
        BadData: It is not there, or is no database of a cell.
    """
    held = tables_of(path)
    try:
        return _read({name: listed.rows for name, listed in held.items()})
    except (KeyError, IndexError, Malformed) as error:
        raise BadData((f"{shown(str(path))} is no database of a cell: {escape(str(error))}",)) from error


def _read(held: Mapping[str, tuple[tuple[Any, ...], ...]]) -> Database:
    robot = held["robot"][0]
    _check_ways(held)
    motion = {name: tuple(row) for name, *row in held["trajectories"]}
    return Database(
        locations={name: number for number, name, *_ in held["locations"]},
        objects={name: number for number, name, *_ in held["objects"]},
        sizes={number: (a, b, c) for number, _, a, b, c, *_ in held["objects"]},
        stock={number: stock for number, _, _, _, _, stock, *_ in held["objects"]},
        parts=tuple(Part(*row) for row in held["parts"]),
        home=tuple(robot[:9]),
        hand=Hand(robot[9], robot[10], (robot[11], robot[12], robot[13])),
        stations={name: _station(name, rest) for name, *rest in held["stations"]},
        _places={
            number: (True, bool(vision), bool(buffer), vupos or 0, safe or 0)
            for number, _, vision, buffer, vupos, safe in held["locations"]
        },
        _routes={(location, sector): (True, *rest) for location, sector, *rest in held["places"]},
        _parts={number: (True, *ranges) for number, _, _, _, _, _, *ranges in held["objects"]},
        _points={
            number: (True, *plate, *motion[trajectory])
            for number, _, _, _, *plate, trajectory in held["points"]
        },
        _fingers={(number, grasp): (True, *rest) for number, grasp, *rest in held["grasps"]},
        _departures={
            (at, sector, other): (first, count) for at, sector, other, first, count in held["departures"]
        },
        _approaches={
            (at, sector, other): (first, count) for at, sector, other, first, count in held["approaches"]
        },
    )


def _check_ways(held: Mapping[str, tuple[tuple[Any, ...], ...]]) -> None:
    """Raises: Malformed: A place's way has points that are not there; the schema cannot say it."""
    points = {number for number, *_ in held["points"]}
    for *_, leaves, many, comes, more, hover, grasp, view in held["places"]:
        ways = [leaves, leaves + many - 1] * (many > 0) + [comes, comes + more - 1, hover, grasp, view]
        if more == 0 or max(many, more) > len(points) or not points.issuperset(ways):
            raise Malformed("a place of it has a way without its points")
    for table, least in (("departures", 0), ("approaches", 1)):
        for *_, first, count in held[table]:
            if not least <= count <= len(points) or (
                count and not points.issuperset((first, first + count - 1))
            ):
                raise Malformed("a path of it has a way without its points")


def _station(name: str, row: Sequence[Any]) -> Station:
    x, y, z, yaw, length, width, vise, vblock = row
    frame = Pose(about_z(yaw), (x, y, z))
    return Station(name, frame, yaw, (length, width), _fixture(vise, VISE), _fixture(vblock, VBLOCK))


def _fixture(text: str | None, kind: Mapping[str, Kind]) -> Mapping[str, Any]:
    """Return the numbers of a fixture, checked as the data file's are.

    Raises:
        Malformed: The numbers are not those of its kind.
    """
    if text is None:
        return {}
    page = Document("", Source("", ""), json_of(text), Code.BAD_DATA)
    page.check(Record(kind))
    if page.faults:
        raise Malformed(f"of a fixture {page.faults[0].message}")
    return page.value
