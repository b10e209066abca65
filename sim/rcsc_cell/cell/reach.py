"""Check that the arm can reach every point of the database, and follow the straight lines between successive ones.

In: a database. Out: what is wrong, by point; nothing where all is well.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from rcsc.base.host.cache import Cache
from rcsc_cell.cell.arm import Joints, solve
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import BadData
from rcsc_cell.database.pose import pose_of

STEP_MM = 10.0
"""Lines are looked at so often."""
JUMP_RAD = 0.35
"""A joint that would turn farther from one step to the next is turning over."""
HOME: Joints = (0.6, 1.03, -3.23, 0.0, -0.94, 0.26)
"""An elbow up, a hand down: from where the home pose is looked for."""
RULES = ("arm.py", "reach.py")
"""The modules that say where the arm can be."""


def home(database: Database) -> Joints | None:
    """Return the joints at the home pose; None where the arm cannot be there."""
    plate = pose_of([float(value) for value in database.home])
    return None if plate is None else solve(plate, HOME)


def unreachable(database: Database) -> tuple[str, ...]:
    """Return the points that the arm cannot take, and the paths on which it would have to turn over."""
    start = home(database)
    if start is None:
        return ("the robot cannot be at its home",)
    return tuple(_problems(database, start))


@dataclass(frozen=True, slots=True)
class Passed:
    """A cache entry: the arm can go everywhere in a database."""


def checked(database: Database, cache: Cache | None = None) -> None:
    """Check that the arm can go everywhere in the database, before anything moves.

    Args:
        database: The cell.
        cache: Where it is kept which databases have passed; the arm need not go anywhere in one of them. None for nowhere.

    Raises:
        BadData: There is a place that it cannot reach.
    """

    def passed() -> Passed:
        if problems := unreachable(database):
            raise BadData(problems)
        return Passed()

    if cache is None:
        passed()
    else:
        cache.memo(Passed, [_digest(database)], passed)


def _digest(database: Database) -> str:
    """Return the digest of the database and of the rules of reach, which a cache does not count as its tool."""
    hashed = hashlib.sha256(repr(database).encode())
    for rules in RULES:
        hashed.update(Path(__file__).with_name(rules).read_bytes())
    return hashed.hexdigest()


def _problems(database: Database, start: Joints) -> Iterator[str]:
    names = {number: name for name, number in database.locations.items()}
    stops: dict[str, list[tuple[float, ...]]] = {}
    for location, sector, row in database.routes():
        _, leaves, many, comes, more, hover, grasp, view = (int(value) for value in row)
        where = f"location `{names[location]}`" + (f", sector {sector}" if sector else "")
        approach = [_plate(database, comes + at) for at in range(more)]
        departure = [_plate(database, leaves + at) for at in range(many)]
        stops[where] = [approach[0], *departure[-1:]]
        for what, path in (
            ("approach and departure", [*approach, *departure]),
            ("hover and grasp", [_plate(database, view), _plate(database, hover), _plate(database, grasp)]),
        ):
            if not _passes(path, start):
                yield f"{where}: the arm cannot go along its {what}"
    for a, first in stops.items():
        for b, second in stops.items():
            if a != b and not _passes([first[-1], second[0]], start):
                yield f"the arm cannot go from {a} to {b}"
    for pair in database.pairs():
        if not _passes(_whole(database, pair), start):
            yield f"the arm cannot go along the path from `{names[pair[0]]}` to `{names[pair[2]]}`"


def _whole(database: Database, pair: tuple[int, int, int, int]) -> list[tuple[float, ...]]:
    """Return the plate at every point of a path of two places, from where the robot stands at the first."""
    _, _, _, comes, more, *_ = database.route(*pair[:2])
    _, leaves, many, first, count = database.path(*pair)
    points = [int(comes) + int(more) - 1]
    points += [int(leaves) + at for at in range(int(many))]
    return [_plate(database, point) for point in (*points, *range(int(first), int(first) + int(count)))]


def _plate(database: Database, point: int) -> tuple[float, ...]:
    return tuple(float(value) for value in database.point(point)[1:10])


def _passes(path: Sequence[tuple[float, ...]], start: Joints) -> bool:
    """Tell whether the arm follows the lines without turning over."""
    joints = _at(path[0], start)
    for a, b in pairwise(path):
        far = max(abs(x - y) for x, y in zip(a, b, strict=True))
        steps = max(1, round(far / STEP_MM))
        for at in range(1, steps + 1):
            if joints is None:
                return False
            share = at / steps
            after = _at([x + (y - x) * share for x, y in zip(a, b, strict=True)], joints)
            if after is None or max(abs(x - y) for x, y in zip(joints, after, strict=True)) > JUMP_RAD:
                return False
            joints = after
    return joints is not None


def _at(numbers: Sequence[float], near: Joints) -> Joints | None:
    plate = pose_of(numbers)
    return None if plate is None else solve(plate, near)
