"""From the data file to the database; every reference resolves and every pose is within reach, or nothing is made.

In: `cell.toml`, and the names of parts as the tables have them. Out: a SQLite file, or what is wrong.
"""

import hashlib
import sqlite3
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import cos, hypot, radians, sin
from pathlib import Path
from typing import Any

ARM_MM = 100.0
"""From the plate's centre to its two other points (section 7.1)."""
SCHEMA = """
create table meta (digest text not null);
create table objects (number integer primary key, name text unique not null, length_mm real not null, width_mm real not null,
  height_mm real not null, stock integer not null, expected_range_mm real not null);
create table grasps (object integer not null references objects, grasp integer not null, approach_mm real not null,
  departure_mm real not null, grip_mm real not null, tolerance_mm real not null, force_n real not null, speed_mm_s real not null,
  primary key (object, grasp));
create table locations (number integer primary key, name text unique not null, vision integer not null, buffer integer not null,
  vupos integer references locations, safe integer references locations);
create table trajectories (name text primary key, speed_mm_s real not null, accel_mm_s2 real not null, breakpoint_mm real not null);
create table points (number integer primary key, location integer not null references locations, sector integer not null,
  role text not null, x0 real, y0 real, z0 real, x1 real, y1 real, z1 real, x2 real, y2 real, z2 real,
  trajectory text not null references trajectories);
create table places (location integer not null references locations, sector integer not null, depart_first integer not null,
  depart_count integer not null, approach_first integer not null, approach_count integer not null, hover integer not null,
  grasp integer not null, primary key (location, sector));
create table home (x0 real, y0 real, z0 real, x1 real, y1 real, z1 real, x2 real, y2 real, z2 real);
create table parts (object integer not null references objects, x_mm real not null, y_mm real not null, z_mm real not null,
  yaw_deg real not null);
"""
Plate = tuple[float, ...]


class BadData(Exception):  # noqa: N818  # what happened, not an error of ours
    """The data says something that cannot be; `problems` has every such thing."""

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("; ".join(problems))
        self.problems = tuple(problems)


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the middle of the fingers' pads is, and how the hand is turned about the vertical."""

    x_mm: float
    y_mm: float
    z_mm: float
    yaw_deg: float

    def raised(self, by_mm: float, east: float = 0.0, north: float = 0.0) -> "Pose":
        """The pose above this one, and beside it."""
        return Pose(self.x_mm + east, self.y_mm + north, self.z_mm + by_mm, self.yaw_deg)

    def plate(self, tool_mm: float) -> Plate:
        """The nine numbers of the wrist plate (section 7.1): the centre, a point along the tool, a point along the fingers."""
        z, turn = self.z_mm + tool_mm, radians(self.yaw_deg)
        return (
            self.x_mm, self.y_mm, z,
            self.x_mm, self.y_mm, z - ARM_MM,
            self.x_mm + ARM_MM * cos(turn), self.y_mm + ARM_MM * sin(turn), z,
        )  # fmt: skip


def read_data(path: Path) -> dict[str, Any]:
    """The data file as it stands.

    Raises:
        BadData: It cannot be read.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadData((f"{path} cannot be read: {error.strerror}",)) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadData((f"{path} is not TOML: {error}",)) from error


def digest(data: Path, objects: Sequence[str]) -> str:
    """What a database must have been made of to be fresh."""
    hashed = hashlib.sha256(SCHEMA.encode() + "\0".join(objects).encode())
    hashed.update(data.read_bytes())
    return hashed.hexdigest()


def build(data: Path, database: Path, objects: Sequence[str]) -> None:
    """Makes the database anew.

    Args:
        data: The data file.
        database: The file to be written; it is replaced only when everything is right.
        objects: Names of parts in the tables, in their order.

    Raises:
        BadData: Something is wrong with the data; nothing is written.
        OSError: The file cannot be written.
    """
    said = read_data(data)
    try:
        rows = _Rows(said, objects)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BadData((f"{data}: {type(error).__name__}: {error}",)) from error
    if rows.problems:
        raise BadData(rows.problems)
    beside = database.with_name(f".{database.name}.new")
    beside.unlink(missing_ok=True)
    database.parent.mkdir(parents=True, exist_ok=True)
    made = sqlite3.connect(beside)
    try:
        made.executescript("pragma foreign_keys = on;" + SCHEMA)
        made.execute("begin")
        made.execute("pragma defer_foreign_keys = on")  # locations name one another
        for table, lines in rows.tables.items():
            for line in lines:
                made.execute(f"insert into {table} values ({', '.join('?' * len(line))})", line)  # noqa: S608  # our own table names
        made.execute("insert into meta values (?)", (digest(data, objects),))
        made.commit()
    except sqlite3.Error as error:
        raise BadData((f"{data}: {error}",)) from error
    finally:
        made.close()
    beside.replace(database)


class _Rows:
    """The rows of every table, and everything that is wrong with them."""

    def __init__(self, said: Mapping[str, Any], objects: Sequence[str]) -> None:
        self.said, self.objects = said, objects
        self.problems: list[str] = []
        self.numbers = {name: at for at, name in enumerate(said["location"], 1)}
        self.tool_mm = float(said["robot"]["tool_mm"])
        self.points: list[tuple[Any, ...]] = []
        self.tables: dict[str, list[tuple[Any, ...]]] = {
            "objects": list(self._objects()),
            "grasps": list(self._grasps()),
            "locations": list(self._locations()),
            "trajectories": [
                (name, one["speed_mm_s"], one["accel_mm_s2"], one["breakpoint_mm"])
                for name, one in said["trajectory"].items()
            ],
        }
        places = list(self._places())
        self.tables |= {"points": self.points, "places": places, "parts": list(self._parts())}
        self.tables["home"] = [_pose(said["robot"]["home"]).plate(self.tool_mm)]

    def wrong(self, where: str, what: str) -> None:
        """Notes a problem."""
        self.problems.append(f"{where}: {what}")

    def _object(self, name: str, where: str) -> int:
        if name in self.objects:
            return self.objects.index(name)
        self.wrong(where, f"no part is called `{name}` in the tables")
        return 0

    def _objects(self) -> Iterator[tuple[Any, ...]]:
        for name, one in self.said["object"].items():
            length, width, height = map(float, one["size_mm"])
            where = f"object `{name}`"
            if min(length, width, height) < 0:
                self.wrong(where, "a size is negative")
            stock = int(one.get("stock", 0))
            if not 0 <= stock <= 99:
                self.wrong(where, f"a stock of {stock} is not 0 .. 99")
            yield self._object(name, where), name, length, width, height, stock, self._range(height)

    def _range(self, height_mm: float) -> float:
        """From the camera, which sits at the wrist plate, to the top of a part that lies where vision looks."""
        for one in self.said["location"].values():
            if one.get("vision"):
                vupos = self.said["location"].get(one.get("vupos", ""), {}).get("at")
                surface = float(self.said["surface_mm"]) if "surface_mm" in self.said else 0.0
                return float(vupos["z"]) + self.tool_mm - surface - height_mm if vupos else 0.0
        return 0.0

    def _grasps(self) -> Iterator[tuple[Any, ...]]:
        for name, one in self.said["object"].items():
            for grasp, how in one.get("grasp", {}).items():
                where = f"object `{name}`, grasp {grasp}"
                row = [
                    float(how[key])
                    for key in (
                        "approach_mm",
                        "departure_mm",
                        "grip_mm",
                        "tolerance_mm",
                        "force_n",
                        "speed_mm_s",
                    )
                ]
                if not row[2] <= row[0] or not row[2] <= row[1]:
                    self.wrong(where, "the fingers do not open wider than the part")
                if not 0 <= int(grasp) <= 9:
                    self.wrong(where, "a grasp is numbered 0 .. 9")
                yield self._object(name, where), int(grasp), *row

    def _locations(self) -> Iterator[tuple[Any, ...]]:
        for name, one in self.said["location"].items():
            where = f"location `{name}`"
            linked = [self._named(one.get(key), f"{where}, {key}") for key in ("vupos", "safe")]
            if one.get("vision") and linked[0] is None:
                self.wrong(where, "vision needs a `vupos` to look from")
            yield (
                self.numbers[name],
                name,
                int(one.get("vision", False)),
                int(one.get("buffer", False)),
                *linked,
            )

    def _named(self, name: str | None, where: str) -> int | None:
        if name is None:
            return None
        if name not in self.numbers:
            self.wrong(where, f"no location is called `{name}`")
        return self.numbers.get(name)

    def _places(self) -> Iterator[tuple[Any, ...]]:
        for name, one in self.said["location"].items():
            at = _pose(one["at"])
            for sector, (east, north) in enumerate(one.get("sectors", [[0.0, 0.0]])):
                pose = at.raised(0.0, east, north)
                via = [pose.raised(float(height)) for height in one.get("via", ())]
                key = self.numbers[name], sector
                where = f"location `{name}`, sector {sector}"
                departs = [self._point(where, key, "departure", up, "fast") for up in reversed(via)]
                comes = [self._point(where, key, "approach", up, "fast") for up in via]
                comes.append(self._point(where, key, "arrival", pose, "fine" if via else "fast"))
                hover = self._point(where, key, "hover", pose.raised(100.0), "fast")
                grasp = self._point(where, key, "grasp", pose, "fine")
                yield *key, departs[0] if departs else 0, len(departs), comes[0], len(comes), hover, grasp

    def _point(self, where: str, key: tuple[int, int], role: str, pose: Pose, trajectory: str) -> int:
        plate, robot = pose.plate(self.tool_mm), self.said["robot"]
        far = hypot(plate[0], plate[1])
        if not robot["reach_mm"][0] <= far <= robot["reach_mm"][1]:
            self.wrong(where, f"the {role} is {far:.0f} mm from the base, out of reach")
        if not robot["height_mm"][0] <= plate[2] <= robot["height_mm"][1]:
            self.wrong(where, f"the {role} is {plate[2]:.0f} mm high, out of reach")
        if trajectory not in self.said["trajectory"]:
            self.wrong(where, f"no trajectory is called `{trajectory}`")
        number = len(self.points) + 1
        self.points.append((number, *key, role, *plate, trajectory))
        return number

    def _parts(self) -> Iterator[tuple[Any, ...]]:
        for one in self.said.get("part", ()):
            at = one["at"]
            yield self._object(one["object"], "a part"), at["x"], at["y"], at.get("z", 0.0), at["yaw"]


def _pose(at: Mapping[str, float]) -> Pose:
    return Pose(float(at["x"]), float(at["y"]), float(at["z"]), float(at["yaw"]))
