"""Build the database from the data file, if every reference resolves and every pose is within reach.

In: `cell.toml`, and the names of parts as the tables have them. Out: a SQLite file, or what is wrong.
"""

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import Any, TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.described import (
    BadFile,
    Document,
    Either,
    Entries,
    Flag,
    KeyPath,
    Kind,
    Listing,
    Number,
    Record,
    Text,
    nearest,
    read_document,
)
from rcsc.base.host.files import written_whole
from rcsc.base.host.files.read import content
from rcsc_cell.database.pose import DOWN, Pose, Rotation, about_y, about_z, nine, product

SCHEMA = """
create table meta (digest text not null);
create table objects (number integer primary key, name text unique not null, length_mm size real not null, width_mm size real not null,
  height_mm size real not null, stock integer not null,
  expected_range_mm size real not null, grip_range_mm size real not null, lift_mm real not null,
  normal_x real not null, normal_y real not null, normal_z real not null);
create table grasps (object integer not null references objects, grasp integer not null, approach_mm size real not null,
  departure_mm size real not null, grip_mm size real not null, tolerance_mm size real not null,
  force_n force real not null, speed_mm_s room real not null,
  primary key (object, grasp));
create table locations (number integer primary key, name text unique not null, vision integer not null, buffer integer not null,
  vupos integer references locations, safe integer references locations);
create table trajectories (name text primary key not null, speed_mm_s room real not null,
  accel_mm_s2 rate real not null, decel_mm_s2 rate real not null, breakpoint_mm size real not null);
create table points (number integer primary key, location integer not null references locations, sector integer not null,
  role text not null,
  x0 real not null, y0 real not null, z0 real not null,
  x1 real not null, y1 real not null, z1 real not null,
  x2 real not null, y2 real not null, z2 real not null,
  trajectory text not null references trajectories);
create table stations (name text primary key not null, x_mm real not null, y_mm real not null, z_mm real not null, yaw_deg real not null,
  length_mm room real not null, width_mm room real not null, vise text, vblock text);
create table places (location integer not null references locations, sector integer not null, depart_first integer not null,
  depart_count integer not null, approach_first integer not null, approach_count integer not null, hover integer not null,
  grasp integer not null, view integer not null, primary key (location, sector));
create table departures (location integer not null references locations, sector integer not null,
  toward integer not null references locations, first integer not null, count integer not null,
  primary key (location, sector, toward));
create table approaches (location integer not null references locations, sector integer not null,
  origin integer not null references locations, first integer not null, count integer not null,
  primary key (location, sector, origin));
create table robot (
  x0 real not null, y0 real not null, z0 real not null,
  x1 real not null, y1 real not null, z1 real not null,
  x2 real not null, y2 real not null, z2 real not null,
  tool_mm size real not null, pad_mm size real not null,
  camera_x_mm real not null, camera_y_mm real not null, camera_z_mm real not null);
create table parts (object integer not null references objects, x_mm real not null, y_mm real not null, z_mm real not null,
  yaw_deg real not null);
"""
"""Each type's last word is SQLite's, all of it a key of `COLUMNS`."""
UP = (0.0, 0.0, 1.0)
"""The normal of a top that faces the camera."""
UNIT = 1e-3
"""A normal is as long as 1 within this."""
HOVER_MM = 100.0
"""How far above a part the robot turns its hand before it goes down."""
DEPTH_MM, CLEARANCE_MM = 12.0, 4.0
"""From the top of a part to the middle of the pads, if the pads then stay so far above what it lies on: vision errs by 2 mm."""


class BadData(BadFile):
    """Data with errors; `problems` lists all of them."""

    code = Code.BAD_DATA

    def __init__(
        self,
        problems: Sequence[str] = (),
        diagnostics: Sequence[Diagnostic] = (),
        sources: Mapping[str, Source] | None = None,
    ) -> None:
        self.problems = tuple(problems) or tuple(diagnostic.message for diagnostic in diagnostics)
        super().__init__("; ".join(problems), diagnostics, sources)

    @property
    def shown(self) -> str:
        """All problems, one a line."""
        return "\n".join(self.problems)


LENGTH, SIZE, ROOM = Number(-10_000, 10_000), Number(0, 10_000), Number(0.001, 10_000)
ANGLE, FORCE, RATE = Number(-360, 360), Number(0, 100_000), Number(0.001, 1_000_000)
POSE = Record({"x": LENGTH, "y": LENGTH, "z": LENGTH, "yaw": ANGLE}, {"tilt": ANGLE})
ON_STATION = Record({"x": LENGTH, "y": LENGTH, "yaw": ANGLE}, {"z": LENGTH})
MOTION: Mapping[str, Kind] = {
    "speed_mm_s": ROOM, "accel_mm_s2": RATE, "decel_mm_s2": RATE, "breakpoint_mm": SIZE,
}  # fmt: skip
GRASP: Mapping[str, Kind] = {
    "approach_mm": SIZE, "departure_mm": SIZE, "grip_mm": SIZE, "tolerance_mm": SIZE, "force_n": FORCE,
    "speed_mm_s": ROOM,
}  # fmt: skip
VISE: Mapping[str, Kind] = {
    "bed_mm": Listing(ROOM, 3, 3), "between_mm": ROOM, "open_mm": SIZE, "beyond_mm": SIZE, "left_n": FORCE,
    "right_n": FORCE,
}  # fmt: skip
VBLOCK: Mapping[str, Kind] = {"wall_mm": ROOM, "width_mm": ROOM, "bottom_mm": SIZE}
WAY = Listing(Either((LENGTH, Listing(LENGTH, 3, 3), Text())))
ROBOT = Record(
    {
        "reach_mm": Listing(SIZE, 2, 2),
        "height_mm": Listing(LENGTH, 2, 2),
        "home": POSE,
        "tool_mm": SIZE,
        "pad_mm": SIZE,
        "hold_mm": SIZE,
        "camera_mm": Listing(LENGTH, 3, 3),
    }
)
OBJECT = Record(
    {"size_mm": Listing(SIZE, 3, 3)},
    {
        "stock": Number(0, 99, whole=True),
        "normal": Listing(Number(-1, 1), 3, 3),
        "grasp": Entries(Record(GRASP)),
    },
)
STATION = Record(
    {"at": POSE, "size_mm": Listing(ROOM, 2, 2)}, {"vise": Record(VISE), "vblock": Record(VBLOCK)}
)
LOCATION = Record(
    {"at": POSE},
    {
        "station": Text(),
        "via": WAY,
        "approach": WAY,
        "departure": WAY,
        "vision": Flag(),
        "buffer": Flag(),
        "vupos": Text(),
        "safe": Text(),
        "sectors": Listing(Listing(LENGTH, 2, 2), least=1, most=10_000),
        "trajectory": Text(),
    },
)
PATH = Record({"from": Text(), "to": Text()}, {"departure": WAY, "approach": WAY})
CELL = Record(
    {
        "robot": ROBOT,
        "trajectory": Entries(Record(MOTION), least=1),
        "object": Entries(OBJECT, least=1),
        "location": Entries(LOCATION, least=1),
    },
    {
        "station": Entries(STATION),
        "path": Listing(PATH),
        "part": Listing(Record({"object": Text(), "at": ON_STATION}, {"station": Text()})),
    },
)
"""What a data file may say: lengths in mm, angles in degrees, forces in N, speeds in mm/s."""
COLUMNS: Mapping[str, Kind] = {
    "integer": Number(0, 1_000_000, whole=True), "real": Number(), "size real": Number(0, 1_000_000), "room real": ROOM,
    "force real": FORCE, "rate real": RATE, "text": Text(),
}  # fmt: skip
"""What a column of the database may hold, by its type."""


@dataclass(frozen=True, slots=True)
class Limit:
    """A leaf that an answer of the database fills, and the values that it can hold."""

    leaf: str
    low: float
    high: float


Limits: TypeAlias = Mapping[str, Sequence[Sequence[Limit | None]]]
"""By question: for each level that asks it, the limit of each value of the answer."""


@dataclass(frozen=True, slots=True)
class At:
    """The subject of an error, in words, and its place in the file."""

    words: str
    path: KeyPath

    def __str__(self) -> str:
        return self.words


@dataclass(frozen=True, slots=True)
class Location:
    """A place of the data, in the axes of a station or of the floor under the robot.

    Attributes:
        frame: The station's axes.
        hand: The pads' axes, seen from the base.
    """

    frame: Pose
    hand: Pose

    def moved(self, x_mm: float, y_mm: float, z_mm: float) -> "Location":
        """Return the location moved along the station's axes."""
        to = self.frame.point((x_mm, y_mm, z_mm))
        by = [a - b for a, b in zip(to, self.frame.at_mm, strict=True)]
        at = self.hand.at_mm
        return Location(self.frame, Pose(self.hand.turn, (at[0] + by[0], at[1] + by[1], at[2] + by[2])))

    def plate(self, tool_mm: float) -> Pose:
        """Return the wrist plate of a hand at the location."""
        return self.hand @ Pose(UPRIGHT, (0.0, 0.0, -tool_mm))


UPRIGHT: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
FLOOR = Pose(UPRIGHT, (0.0, 0.0, 0.0))


def read_data(path: Path) -> Document:
    """Read the data file; check nothing but single values and keys.

    Raises:
        BadData: It cannot be read, or holds what no data file may; all errors are reported.
    """
    document = read_document(path, Code.BAD_DATA, BadData)
    document.check(CELL)
    if document.faults:
        raise document.bad(BadData)
    return document


def digest(data: Path, objects: Sequence[str], limits: Limits) -> str:
    """Return the digest of a fresh database: of the data, the tables' names and limits, and this module."""
    hashed = hashlib.sha256(content(Path(__file__)) + "\0".join(objects).encode())
    hashed.update(repr(sorted(limits.items())).encode())
    hashed.update(content(data))
    return hashed.hexdigest()


def build(data: Path, database: Path, objects: Sequence[str], limits: Limits | None = None) -> None:
    """Build the database anew.

    Args:
        data: The data file.
        database: The file to be written; it is replaced only when everything is right.
        objects: Names of parts in the tables, in their order.
        limits: What the levels can hold of each answer.

    Raises:
        BadData: The data has errors; nothing is written.
        OSError: The file cannot be written.
    """
    rows = _Rows(read_data(data), objects, limits or {})
    if rows.document.faults:
        raise rows.document.bad(BadData)
    database.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(database) as beside:  # several processes may find it stale at once
        _fill(beside, rows, data, digest(data, objects, limits or {}))


def _fill(database: Path, rows: "_Rows", data: Path, made_of: str) -> None:
    connection = sqlite3.connect(database)
    try:
        connection.execute("pragma journal_mode = off")  # it is another's only when it is whole
        connection.executescript("pragma foreign_keys = on;" + SCHEMA)
        connection.execute("begin")
        connection.execute("pragma defer_foreign_keys = on")  # locations name one another
        for table, lines in rows.tables.items():
            for line in lines:
                connection.execute(f"insert into {table} values ({', '.join('?' * len(line))})", line)  # noqa: S608  # our own table names
        connection.execute("insert into meta values (?)", (made_of,))
        connection.commit()
    except sqlite3.Error as error:
        raise BadData((f"{data}: {error}; the database that was there is kept",)) from error
    finally:
        connection.close()


class _Rows:
    """The rows of every table, and all errors in them."""

    def __init__(self, document: Document, objects: Sequence[str], limits: Limits) -> None:
        toml = document.value
        self.document, self.toml, self.objects, self.limits = document, toml, objects, limits
        self._ranges()
        self.numbers = {name: at for at, name in enumerate(toml["location"], 1)}
        self.tool_mm = float(toml["robot"]["tool_mm"])
        self.points: list[tuple[Any, ...]] = []
        self.tables: dict[str, list[tuple[Any, ...]]] = {
            "objects": list(self._objects()),
            "grasps": list(self._grasps()),
            "locations": list(self._locations()),
            "stations": list(self._stations()),
            "trajectories": list(self._trajectories()),
        }
        places = list(self._places())
        self.ways: dict[str, dict[tuple[int, int, int], tuple[int, int]]] = {
            "departures": {},
            "approaches": {},
        }
        for number, path in enumerate(toml.get("path", ())):
            self._pair(number, path)
        for table, ways in self.ways.items():
            self.tables[table] = [(*key, *points) for key, points in ways.items()]
        self.tables |= {"points": self.points, "places": places, "parts": list(self._parts())}
        robot = toml["robot"]
        at = At("home", ("robot", "home"))
        home = self._place(robot["home"], None, at).plate(self.tool_mm)
        self._reached(home, at, "hand")
        camera = [float(value) for value in robot["camera_mm"]]
        self.tables["robot"] = [(*nine(home), self.tool_mm, float(robot["pad_mm"]), *camera)]

    def wrong(self, where: At, what: str, *helps: str) -> None:
        """Note a problem."""
        self.document.wrong(where.path, f"{where}: {what}", *helps)

    def _ranges(self) -> None:
        for key in ("reach_mm", "height_mm"):
            low, high = self.toml["robot"][key]
            if low > high:
                self.wrong(At("robot", ("robot", key)), f"`{key}` goes from {low:g} to {high:g}")

    def _within(self, question: str, values: Sequence[Any], where: At, keys: Sequence[str] = ()) -> None:
        """Note every value of an answer that a level cannot hold; None is checked elsewhere.

        Args:
            question: What is asked.
            values: The answer, without the first value, which says whether there is one.
            where: What the answer is of.
            keys: Of each value, from the last, in the file.
        """
        for limits in self.limits.get(question, ()):
            for at, (limit, value) in enumerate(zip(limits[1:], values, strict=False)):
                if limit is None or value is None or limit.low <= value <= limit.high:
                    continue
                key = keys[at - len(values)] if len(values) - at <= len(keys) else ""
                place = At(where.words, (*where.path, key)) if key else where
                holds = f"{limit.low:.12g} .. {limit.high:.12g}"
                self.wrong(place, f"`{limit.leaf}` would be {value:.12g}, and holds {holds}")

    # --- parts ---

    def _object(self, name: str, where: At) -> int:
        if name in self.objects:
            return self.objects.index(name)
        self.wrong(where, f"no part is called `{name}` in the tables", *nearest(name, self.objects))
        return 0

    def _objects(self) -> Iterator[tuple[Any, ...]]:
        camera_mm, pads_mm = self._view()
        for name, part in self.toml["object"].items():
            length, width, height = map(float, part["size_mm"])
            where = At(f"object `{name}`", ("object", name))
            stock = int(part.get("stock", 0))
            expected = max(0.0, camera_mm - height)
            depth = depth_mm(height, float(self.toml["robot"]["pad_mm"]))
            grip = max(0.0, camera_mm - pads_mm - depth)
            lift = height - depth - float(self.toml["robot"]["hold_mm"]) if height > 0 else 0.0
            normal = [float(value) for value in part.get("normal", UP)]
            if abs(hypot(*normal) - 1.0) > UNIT:
                self.wrong(
                    At(f"{where}, normal", (*where.path, "normal")), f"is {hypot(*normal):.4f} long, not 1"
                )
            answer = (expected, grip, lift, *normal)
            self._within("part", answer, where)
            yield self._object(name, where), name, length, width, height, stock, *answer

    def _view(self) -> tuple[float, float]:
        """Return the heights over the station of the camera where vision looks, and of the pads where they take the part."""
        for location in self.toml["location"].values():
            looks = self.toml["location"].get(location.get("vupos", ""))
            if location.get("vision") and looks is not None:
                camera_z = self.tool_mm - float(self.toml["robot"]["camera_mm"][2])
                return float(looks["at"]["z"]) + camera_z, float(location["at"]["z"])
        return 0.0, 0.0

    def _grasps(self) -> Iterator[tuple[Any, ...]]:
        for name, part in self.toml["object"].items():
            for grasp, how in part.get("grasp", {}).items():
                where = At(f"object `{name}`, grasp {grasp}", ("object", name, "grasp", grasp))
                row = [float(how[key]) for key in GRASP]
                self._within("fingers", row, where, tuple(GRASP))
                if not row[2] <= row[0] or not row[2] <= row[1]:
                    self.wrong(where, "the fingers do not open wider than the part")
                if grasp not in GRASPS:
                    self.wrong(where, "a grasp is numbered 0 .. 9")
                    continue
                yield self._object(name, where), int(grasp), *row

    def _parts(self) -> Iterator[tuple[Any, ...]]:
        for number, part in enumerate(self.toml.get("part", ())):
            where = At(f"part `{part['object']}`", ("part", number))
            frame, at = self._frame(part.get("station"), where), part["at"]
            x, y, z = frame.point((float(at["x"]), float(at["y"]), float(at.get("z", 0.0))))
            yield (
                self._object(part["object"], where),
                x,
                y,
                z,
                float(at["yaw"]) + self._yaw(part.get("station")),
            )

    # --- places ---

    def _locations(self) -> Iterator[tuple[Any, ...]]:
        for name, location in self.toml["location"].items():
            where = At(f"location `{name}`", ("location", name))
            links = ("vupos", "safe")
            linked = [
                self._named(location.get(key), At(f"{where}, {key}", (*where.path, key))) for key in links
            ]
            flags = bool(location.get("vision")), bool(location.get("buffer"))
            self._within("place", (*flags, *(to or 0 for to in linked)), where)
            if location.get("vision") and linked[0] is None:
                self.wrong(where, "vision needs a `vupos` to look from")
            yield (
                self.numbers[name],
                name,
                int(location.get("vision", False)),
                int(location.get("buffer", False)),
                *linked,
            )

    def _named(self, name: str | None, where: At) -> int | None:
        if name is None:
            return None
        if name not in self.numbers:
            self.wrong(where, f"no location is called `{name}`", *nearest(name, list(self.numbers)))
        return self.numbers.get(name)

    def _stations(self) -> Iterator[tuple[Any, ...]]:
        for name, station in self.toml.get("station", {}).items():
            at, (length, width) = station["at"], map(float, station["size_mm"])
            where = (float(at["x"]), float(at["y"]), float(at["z"]), float(at["yaw"]))
            vise = _floats(station["vise"], VISE) if "vise" in station else None
            vblock = _floats(station["vblock"], VBLOCK) if "vblock" in station else None
            yield name, *where, length, width, vise, vblock

    def _trajectories(self) -> Iterator[tuple[Any, ...]]:
        for name, trajectory in self.toml["trajectory"].items():
            row = [trajectory[key] for key in MOTION]
            where = At(f"trajectory `{name}`", ("trajectory", name))
            self._within("point", (*[None] * 9, *row), where, tuple(MOTION))
            yield name, *row

    def _frame(self, station: str | None, where: At) -> Pose:
        if station is None:
            return FLOOR
        if station not in self.toml.get("station", {}):
            names = list(self.toml.get("station", {}))
            self.wrong(where, f"no station is called `{station}`", *nearest(station, names))
            return FLOOR
        at = self.toml["station"][station]["at"]
        return Pose(about_z(float(at["yaw"])), (float(at["x"]), float(at["y"]), float(at["z"])))

    def _yaw(self, station: str | None) -> float:
        return (
            float(self.toml["station"][station]["at"]["yaw"])
            if station in self.toml.get("station", {})
            else 0.0
        )

    def _place(self, at: Mapping[str, float], station: str | None, where: At) -> Location:
        frame = self._frame(station, where)
        turn = product(about_z(float(at["yaw"])), product(DOWN, about_y(float(at.get("tilt", 0.0)))))
        return Location(frame, frame @ Pose(turn, (float(at["x"]), float(at["y"]), float(at["z"]))))

    def _places(self) -> Iterator[tuple[Any, ...]]:
        for name, location in self.toml["location"].items():
            for sector, place in self._sectors(name):
                yield self._row(name, location, sector, place)

    def _sectors(self, name: str) -> Iterator[tuple[int, Location]]:
        """Yield each sector of a location, which is sector 0 of itself where it is no pallet."""
        location = self.toml["location"][name]
        reference = self._place(
            location["at"], location.get("station"), At(f"location `{name}`", ("location", name))
        )
        for sector, (x_mm, y_mm) in enumerate(location.get("sectors", [[0.0, 0.0]])):
            yield sector, reference.moved(float(x_mm), float(y_mm), 0.0)

    def _pair(self, number: int, path: Mapping[str, Any]) -> None:
        """Note the departure and the approach that a path from one location to another has of its own."""
        where = At(f"path {number + 1}, from `{path['from']}` to `{path['to']}`", ("path", number))
        ends = [self._named(path[key], At(where.words, (*where.path, key))) for key in ("from", "to")]
        if None in ends:
            return
        if not {"departure", "approach"} & path.keys():
            self.wrong(where, "says neither `departure` nor `approach`")
        for key, table, (at, other) in (
            ("departure", "departures", ("from", "to")),
            ("approach", "approaches", ("to", "from")),
        ):
            for sector, place in self._sectors(path[at]) if key in path else ():
                line = self.numbers[path[at]], sector, self.numbers[path[other]]
                if line in self.ways[table]:
                    self.wrong(where, f"there is such a path with a `{key}` already")
                points = self._way(path[at], sector, place, key, path[key], where)
                self.ways[table][line] = points[0] if points else 0, len(points)
                self._within("path", (*self.ways[table][line],) * 2, where)

    def _way(
        self, name: str, sector: int, place: Location, role: str, steps: Sequence[Any], where: At
    ) -> list[int]:
        """Return the points of a departure from a location, or of an approach to it: that ends there."""
        location = self.toml["location"][name]
        key, through = (self.numbers[name], sector), location.get("trajectory", "fast")
        on_the_way = (self._through(place, step, where) for step in steps)
        points = [self._point(where, key, role, to, through) for to in on_the_way]
        if role == "approach":
            fine = "fine" if location.get("via") or location.get("approach") else "fast"
            points.append(self._point(where, key, "arrival", place, fine))
        return points

    def _row(self, name: str, location: Mapping[str, Any], sector: int, place: Location) -> tuple[Any, ...]:
        key = self.numbers[name], sector
        where = At(f"location `{name}`, sector {sector}", ("location", name))
        out = location.get("departure", location.get("via", ())[::-1])
        departs = self._way(name, sector, place, "departure", out, where)
        into = location.get("approach", location.get("via", ()))
        comes = self._way(name, sector, place, "approach", into, where)
        hover = self._point(where, key, "hover", place.moved(0.0, 0.0, HOVER_MM), "fast")
        grasp = self._point(where, key, "grasp", place, "fine")
        view = self._point(where, key, "view", self._viewpoint(place, location, where), "fast")
        ways = departs[0] if departs else 0, len(departs), comes[0], len(comes)
        self._within("path", ways, where)
        self._within("target", (hover, grasp, view), where)
        return *key, *ways, hover, grasp, view

    def _through(self, place: Location, step: str | float | list[float], where: At) -> Location:
        """Return a location on the way to a place: a height over it, an offset, or another location."""
        if isinstance(step, str):
            other = self.toml["location"].get(step)
            if other is None:
                self.wrong(where, f"no location is called `{step}`", *nearest(step, list(self.numbers)))
                return place
            return self._place(other["at"], other.get("station"), where)
        if isinstance(step, list):
            x_mm, y_mm, z_mm = map(float, step)
            return place.moved(x_mm, y_mm, z_mm)
        return place.moved(0.0, 0.0, float(step))

    def _viewpoint(self, place: Location, location: Mapping[str, Any], where: At) -> Location:
        """Return the location where the hand has its camera over the place: vision's second look is centred on the part."""
        looks = self.toml["location"].get(location.get("vupos", ""))
        if not location.get("vision") or looks is None:
            return place
        from_ = self._place(looks["at"], looks.get("station"), where)
        camera_x, camera_y, _ = map(float, self.toml["robot"]["camera_mm"])
        above = from_.hand.point((-camera_x, -camera_y, 0.0))
        return Location(from_.frame, Pose(from_.hand.turn, above))

    def _reached(self, plate: Pose, where: At, role: str) -> None:
        robot = self.toml["robot"]
        x_mm, y_mm, z_mm = plate.at_mm
        if not robot["reach_mm"][0] <= hypot(x_mm, y_mm) <= robot["reach_mm"][1]:
            self.wrong(where, f"the {role} is {hypot(x_mm, y_mm):.0f} mm from the base, out of reach")
        if not robot["height_mm"][0] <= z_mm <= robot["height_mm"][1]:
            self.wrong(where, f"the {role} is {z_mm:.0f} mm high, out of reach")

    def _point(self, where: At, key: tuple[int, int], role: str, place: Location, trajectory: str) -> int:
        plate = place.plate(self.tool_mm)
        self._reached(plate, where, role)
        motions = self.toml["trajectory"]
        if trajectory in motions:
            self._within("point", nine(plate), where)
        else:
            self.wrong(where, f"no trajectory is called `{trajectory}`", *nearest(trajectory, list(motions)))
        number = len(self.points) + 1
        self.points.append((number, *key, role, *nine(plate), trajectory))
        return number


def depth_mm(height_mm: float, pad_mm: float) -> float:
    """Return the distance from the top of a part to the middle of the pads that take it from above, in mm.

    Args:
        height_mm: Of the part.
        pad_mm: From the middle of the pads to their lower edge.
    """
    return min(DEPTH_MM, height_mm - pad_mm - CLEARANCE_MM)


GRASPS = frozenset("0123456789")


def _floats(fixture: Mapping[str, Any], keys: Iterable[str]) -> str:
    """Return the numbers of a fixture as JSON."""
    return json.dumps(
        {
            key: [float(x) for x in fixture[key]] if isinstance(fixture[key], list) else float(fixture[key])
            for key in keys
        }
    )
