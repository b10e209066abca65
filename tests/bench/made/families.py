"""Tables by seed, right by construction, as source text; each also with one overlap or one gap planted.

`box`: random recursive cuts of the input space over bools, enumerations and integer ranges. `linear`: recursive cuts by
planes `a*x + b*y <= c` over integers, atoms respelt. `cells`: the cells between planes.
"""

import math
import random
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from rcsc.lang.model import Int, Read, VariableName
from rcsc.proof.table.regions.atoms import Universe
from rcsc.proof.table.regions.points import within
from rcsc.proof.table.regions.region import NoWitness

Fault = Literal["ok", "overlap", "gap"]


@dataclass(frozen=True, slots=True)
class Axis:
    """A variable: its declaration and the greatest of its keys, which begin at 0."""

    name: str
    kind: str
    most: int


def axes(variables: int, rng: random.Random) -> list[Axis]:
    """A mix of bools, enumerations of 3 to 12 members, and integers."""
    made = []
    for at in range(variables):
        kind = ("bool", "enum", "int")[at % 3]
        made.append(Axis(f"x{at}", kind, {"bool": 1, "enum": rng.randint(2, 11), "int": 1000}[kind]))
    return made


def _declared(axis: Axis) -> str:
    if axis.kind == "bool":
        return f"input {axis.name} : bool\n"
    if axis.kind == "int":
        return f"input {axis.name} : int 0 .. {axis.most}\n"
    members = ", ".join(f"{axis.name}_{at}" for at in range(axis.most + 1))
    return f"enum e_{axis.name} {{ {members} }}\ninput {axis.name} : e_{axis.name}\n"


def _cell(axis: Axis, low: int, high: int) -> str:
    if (low, high) == (0, axis.most):
        return ""
    if axis.kind == "bool":
        return "true" if low else "false"
    if axis.kind == "int":
        return str(low) if low == high else f"{low} .. {high}"
    members = [f"{axis.name}_{at}" for at in range(low, high + 1)]
    return members[0] if len(members) == 1 else "in {" + ", ".join(members) + "}"


Region = dict[int, tuple[int, int]]


def _regions(over: list[Axis], lines: int, rng: random.Random) -> list[Region]:
    """The space cut into `lines` boxes: always the box with fewest cuts so far, along a random variable."""
    waiting: list[Region] = [{}]
    at = 0
    while len(waiting) < lines and at < len(waiting):
        region = waiting[at]
        free = [i for i, axis in enumerate(over) if (w := region.get(i, (0, axis.most)))[0] < w[1]]
        if not free:
            at += 1
            continue
        axis = rng.choice(free)
        low, high = region.get(axis, (0, over[axis].most))
        cut = rng.randint(low, high - 1)
        del waiting[at]
        waiting += [{**region, axis: (low, cut)}, {**region, axis: (cut + 1, high)}]
    rng.shuffle(waiting)
    return waiting


def box(lines: int, variables: int, seed: int, fault: Fault = "ok", widened: int = 0) -> str:
    """A table of boxes; so many of its lines leave a cell blank that was not, which makes them overlap others."""
    rng = random.Random(seed)
    over = axes(variables, rng)
    regions = _regions(over, lines, rng)
    for at in rng.sample(range(lines), widened):
        regions[at].pop(rng.choice(sorted(regions[at])))
    if fault == "gap":
        del regions[rng.randrange(len(regions))]
    if fault == "overlap":
        regions.append(dict(rng.choice(regions)))
    rows = [
        f"| {at} | "
        + " | ".join(_cell(axis, *region.get(i, (0, axis.most))) for i, axis in enumerate(over))
        + " ||"
        for at, region in enumerate(regions)
    ]
    head = "| line | " + " | ".join(axis.name for axis in over) + " ||"
    return "".join(map(_declared, over)) + "table t {\n" + "\n".join([head, *rows]) + "\n}\n"


Point = tuple[int, ...]


def linear(lines: int, variables: int, seed: int, fault: Fault = "ok", widened: int = 0) -> str:
    """A table whose lines are the leaves of a tree of planes, each condition spelled in one of several ways.

    Every leaf keeps some points of its own, and planes go between them, so that no leaf is empty. So many
    lines leave out one of their conditions, which makes them overlap others.
    """
    rng = random.Random(seed)
    names = [f"x{at}" for at in range(variables)]
    points = [tuple(rng.randint(-1000, 1000) for _ in names) for _ in range(16 * lines)]
    leaves: list[tuple[list[str], list[Point]]] = [([], points)]
    while len(leaves) < lines:
        said, inside = leaves.pop(0)
        one, two = rng.sample(range(variables), 2)
        a, b = rng.randint(1, 5), rng.randint(-5, 5) or 1
        values = sorted(a * point[one] + b * point[two] for point in inside)
        c = values[len(values) // 2 - 1]
        below = [point for point in inside if a * point[one] + b * point[two] <= c]
        above = [point for point in inside if a * point[one] + b * point[two] > c]
        if not above:
            leaves.append((said, inside))
            continue
        factor = rng.choice((1, 1, 2, 3))
        first = f"{factor * a} * {names[one]} + {factor * b} * {names[two]} <= {factor * c}"
        second = f"{a} * {names[one]} > {c} - {b} * {names[two]}"
        leaves += [([*said, first], below), ([*said, second], above)]
    rng.shuffle(leaves)
    for at in rng.sample(range(lines), widened):
        leaves[at][0].pop(rng.randrange(len(leaves[at][0])))
    conditions = [" and ".join(said) or "true" for said, _ in leaves]
    if fault == "gap":
        hole = leaves[0][1][0]
        conditions[0] += (
            " and not (" + " and ".join(f"{n} = {v}" for n, v in zip(names, hole, strict=True)) + ")"
        )
    if fault == "overlap":
        conditions.append(conditions[0])
    rows = [f"| {at} | {condition} ||" for at, condition in enumerate(conditions)]
    declared = "".join(f"input {name} : int -1000 .. 1000\n" for name in names)
    return declared + "table t {\n| line | when ||\n" + "\n".join(rows) + "\n}\n"


def cells(planes: int, variables: int, seed: int, fault: Fault = "ok") -> str:
    """A table with a line for each cell into which planes (at most 50) divide the space; it names those that bound the cell.

    Cells that hold no integers are none. No plane divides all of them well, and a line is silent about most: harder than `linear`.
    """
    rng = random.Random(seed)
    names = [f"x{at}" for at in range(variables)]
    universe = Universe()
    columns = [universe.column(Read(VariableName(name), Int(-1000, 1000))) for name in names]
    sides: dict[int, tuple[tuple[int, int], tuple[int, int]]] = {}
    while len(sides) < planes:
        one, two = sorted(rng.sample(columns, 2))
        first, second = rng.randint(1, 9), rng.choice((-1, 1)) * rng.randint(1, 9)
        divisor = math.gcd(first, second)
        form = universe.form(((one, first // divisor), (two, second // divisor)))
        cut = sum(k * rng.randint(-700, 700) for _, k in universe.forms[form])
        sides.setdefault(form, ((universe.low[form], cut), (cut + 1, universe.high[form])))

    def has_points(bounds: Mapping[int, tuple[int, int]]) -> bool:
        return not isinstance(within(universe, bounds, {}), NoWitness)

    found: list[dict[int, tuple[int, int]]] = [{}]
    for form, both in sides.items():
        found = [wider for bounds in found for side in both if has_points(wider := {**bounds, form: side})]
    for bounds in found:
        for form in list(bounds):
            [other] = {*sides[form]} - {bounds[form]}
            if not has_points({**bounds, form: other}):
                del bounds[form]
    if fault == "gap":
        del found[rng.randrange(len(found))]
    if fault == "overlap":
        found.append(dict(rng.choice(found)))
    rng.shuffle(found)
    rows = []
    for number, bounds in enumerate(found):
        said = []
        for form, (low, high) in bounds.items():
            total = " + ".join(f"{k} * {names[column]}" for column, k in universe.forms[form])
            said.append(f"{total} <= {high}" if low == universe.low[form] else f"{total} >= {low}")
        rows.append(f"| {number} | {' and '.join(said) or 'true'} ||")
    declared = "".join(f"input {name} : int -1000 .. 1000\n" for name in names)
    return declared + "table t {\n| line | when ||\n" + "\n".join(rows) + "\n}\n"
