"""The levels' questions to the database, answered from memory: it is read once, before anything moves.

In: the SQLite file. Out: a `Database` whose answers are tuples in the order of the records that they fill.
"""

import sqlite3
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.database.build import BadData
from rcsc.database.pose import Pose, Vector, about_z, pose_of
from rcsc.files.read import json_of
from rcsc.system.signature import Values

NO_PLACE: Values = (False, False, False, 0, 0)
NO_ROUTE: Values = (False, 0, 0, 0, 0, 0, 0, 0)
NO_PART: Values = (False, 0.0, 0.0, 0.0)
NO_POINT: Values = (False, *(0.0,) * 9, 1.0, 10.0, 0.0)
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
        """Whether it stands below a point of the base's axes, however high that is."""
        x, y, _ = self.frame.inside(at_mm)
        return abs(x) <= self.size_mm[0] / 2 and abs(y) <= self.size_mm[1] / 2


@dataclass(frozen=True, slots=True)
class Hand:
    """What is at the robot's wrist.

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
    """Everything that the levels may ask."""

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

    def place(self, location: int) -> Values:
        """known, vision, buffer, vupos, safe."""
        return self._places.get(location, NO_PLACE)

    def route(self, location: int, sector: int) -> Values:
        """known, departure (first point, count), approach (first point, count), points to hover, to grasp and to look from."""
        known = self._routes.get((location, sector))
        if known is None and (location, 1) not in self._routes:  # no pallet: it has no sectors
            known = self._routes.get((location, 0))
        return known or NO_ROUTE

    def part(self, number: int) -> Values:
        """known, ranges in mm from the camera to its top as it lies, and at which its top is where the pads take it; lift in mm.

        The lift: how much higher than at the locations of the data the pads hold it.
        """
        return self._parts.get(number, NO_PART)

    def point(self, number: int) -> Values:
        """known, nine numbers in mm, speed in mm/s, acceleration in mm/s^2, breakpoint distance in mm."""
        return self._points.get(number, NO_POINT)

    def fingers(self, number: int, grasp: int) -> Values:
        """known, approach, departure and grip opening and tolerance in mm, force in N, speed in mm/s."""
        return self._fingers.get((number, grasp), NO_FINGERS)

    def plate(self, location: int, sector: int) -> Pose | None:
        """The wrist plate, in mm, at the last point of the way to a location; None where there is no such way."""
        known, _, _, comes, many, *_ = self.route(location, sector)
        if not known or not many:
            return None
        return pose_of([float(value) for value in self.point(int(comes) + int(many) - 1)[1:10]])

    def pads(self, location: int, sector: int) -> Vector | None:
        """The middle of the pads, in mm, when the robot is there; None likewise."""
        plate = self.plate(location, sector)
        return None if plate is None else plate.point((0.0, 0.0, self.hand.tool_mm))

    def station_below(self, at_mm: Vector) -> Station | None:
        """The station that stands below a point; None over the floor."""
        return next((one for one in self.stations.values() if one.below(at_mm)), None)

    def routes(self) -> tuple[tuple[int, int, Values], ...]:
        """Every route with its location and sector."""
        return tuple((location, sector, row) for (location, sector), row in self._routes.items())

    @property
    def queries(self) -> dict[str, Callable[..., Values]]:
        """The questions by name, for the levels' feeds."""
        return {
            "place": self.place,
            "route": self.route,
            "part": self.part,
            "point": self.point,
            "fingers": self.fingers,
        }


def fresh(path: Path, expected: str) -> bool:
    """Whether the file is a database made of what `expected` is the digest of."""
    try:
        held = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
        try:
            return list(held.execute("select digest from meta")) == [(expected,)]
        finally:
            held.close()
    except sqlite3.Error:
        return False


def open_database(path: Path) -> Database:
    """Reads a database whole.

    Raises:
        BadData: It is not there, or is no database of the cell's.
    """
    if not path.is_file():
        raise BadData((f"there is no database `{path}`: run `rcsc db build`",))
    try:
        held = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
        try:
            return _read(held)
        finally:
            held.close()
    except (sqlite3.Error, KeyError, TypeError, ValueError, IndexError) as error:
        raise BadData((f"`{path}` is no database of a cell: {error}",)) from error


def _read(held: sqlite3.Connection) -> Database:
    def rows(query: str) -> list[tuple[Any, ...]]:
        return list(held.execute(query))

    robot = rows("select * from robot")[0]
    motion = {name: tuple(row) for name, *row in rows("select * from trajectories")}
    points = {
        number: (True, *plate, *motion[trajectory])
        for number, *plate, trajectory in rows(
            "select number, x0, y0, z0, x1, y1, z1, x2, y2, z2, trajectory from points"
        )
    }
    return Database(
        {name: number for number, name in rows("select number, name from locations")},
        {name: number for number, name in rows("select number, name from objects")},
        {
            number: (a, b, c)
            for number, a, b, c in rows("select number, length_mm, width_mm, height_mm from objects")
        },
        dict(rows("select number, stock from objects")),
        tuple(Part(*row) for row in rows("select * from parts")),
        tuple(robot[:9]),
        Hand(robot[9], robot[10], (robot[11], robot[12], robot[13])),
        {name: _station(name, rest) for name, *rest in rows("select * from stations")},
        {
            number: (True, bool(vision), bool(buffer), vupos or 0, safe or 0)
            for number, vision, buffer, vupos, safe in rows(
                "select number, vision, buffer, vupos, safe from locations"
            )
        },
        {(location, sector): (True, *rest) for location, sector, *rest in rows("select * from places")},
        {
            number: (True, *ranges)
            for number, *ranges in rows(
                "select number, expected_range_mm, grip_range_mm, lift_mm from objects"
            )
        },
        points,
        {(number, grasp): (True, *rest) for number, grasp, *rest in rows("select * from grasps")},
    )


def _station(name: str, row: Sequence[Any]) -> Station:
    x, y, z, yaw, length, width, vise, vblock = row
    frame = Pose(about_z(yaw), (x, y, z))
    return Station(name, frame, yaw, (length, width), json_of(vise or "{}"), json_of(vblock or "{}"))
