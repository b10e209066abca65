"""The levels' questions to the database, answered from memory: it is read once, before anything moves.

In: the SQLite file. Out: a `Database` whose answers are tuples in the order of the records that they fill.
"""

import sqlite3
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.database.build import BadData
from rcsc.system.signature import Values

NO_PLACE: Values = (False, False, False, 0, 0)
NO_ROUTE: Values = (False, 0, 0, 0, 0, 0, 0)
NO_PART: Values = (False, 0.0)
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
class Database:
    """Everything that the levels may ask."""

    locations: Mapping[str, int]
    objects: Mapping[str, int]
    sizes: Mapping[int, tuple[float, float, float]]
    stock: Mapping[int, int]
    parts: tuple[Part, ...]
    home: Values
    _places: Mapping[int, Values]
    _routes: Mapping[tuple[int, int], Values]
    _parts: Mapping[int, Values]
    _points: Mapping[int, Values]
    _fingers: Mapping[tuple[int, int], Values]

    def place(self, location: int) -> Values:
        """known, vision, buffer, vupos, safe."""
        return self._places.get(location, NO_PLACE)

    def route(self, location: int, sector: int) -> Values:
        """known, departure (first point, count), approach (first point, count), hover point, grasp point."""
        known = self._routes.get((location, sector))
        if known is None and (location, 1) not in self._routes:  # no pallet: it has no sectors
            known = self._routes.get((location, 0))
        return known or NO_ROUTE

    def part(self, number: int) -> Values:
        """known, expected range in mm."""
        return self._parts.get(number, NO_PART)

    def point(self, number: int) -> Values:
        """known, nine numbers in mm, speed in mm/s, acceleration in mm/s^2, breakpoint distance in mm."""
        return self._points.get(number, NO_POINT)

    def fingers(self, number: int, grasp: int) -> Values:
        """known, approach, departure and grip opening and tolerance in mm, force in N, speed in mm/s."""
        return self._fingers.get((number, grasp), NO_FINGERS)

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
    except (sqlite3.Error, KeyError, TypeError, IndexError) as error:
        raise BadData((f"`{path}` is no database of a cell: {error}",)) from error


def _read(held: sqlite3.Connection) -> Database:
    def rows(query: str) -> list[tuple[Any, ...]]:
        return list(held.execute(query))

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
        rows("select * from home")[0],
        {
            number: (True, bool(vision), bool(buffer), vupos or 0, safe or 0)
            for number, vision, buffer, vupos, safe in rows(
                "select number, vision, buffer, vupos, safe from locations"
            )
        },
        {(location, sector): (True, *rest) for location, sector, *rest in rows("select * from places")},
        {
            number: (True, expected)
            for number, expected in rows("select number, expected_range_mm from objects")
        },
        points,
        {(number, grasp): (True, *rest) for number, grasp, *rest in rows("select * from grasps")},
    )
