"""Counterexamples by trial, where doubles make Z3 slow: edges and a fixed pseudo-random sample.

In: conditions. Out: values for which all hold, or nothing, which proves nothing. The same conditions give the same values.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice
from random import Random
from typing import Self

from rcsc.lang.expressions.conditions import box_of
from rcsc.lang.expressions.words import mask_of
from rcsc.lang.interpret import UNDEFINED, holds, operated
from rcsc.lang.interval_sets import meet
from rcsc.lang.leaves import conjuncts, read_by
from rcsc.lang.model import (
    Apply,
    Bool,
    Box,
    Expr,
    Op,
    Read,
    Real,
    Scalar,
    Single,
    Test,
    Value,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import part_way, single
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.search import lowest
from rcsc.proof.symbolic.values import Node, Shape, parts_first
from rcsc.proof.symbolic.values import variable as variable_of

SAMPLES, FEW = 400, 32
MOST_NODES = 1_500
"""Larger questions go to Z3 at once."""
EVALUATIONS = 100_000
"""Nodes of all points together at which `met` looks: about a tenth of a second."""
_NODES_OF_A_STEP = 1
"""Nodes at a point that cost a step of Z3: each takes a microsecond or two."""

Point = dict[str, Value]


def witness(conditions: Sequence[Node], variables: Sequence[Node]) -> Point | None:
    """Find a point at which all conditions hold, and lower each variable; None where no trial succeeds."""
    order = list(parts_first(*conditions))
    if len(order) > MOST_NODES:
        return None
    best: Point | None = None
    for point in _tried(variables, SAMPLES, {}):
        if smt.gives_up("what trial finds"):
            break
        if _all_hold(order, conditions, point) and (best is None or _less(point, best, variables)):
            best = point
    return None if best is None else _lowered(order, conditions, variables, best)


def aimed(conditions: Sequence[Expr], variables: Sequence[Variable]) -> Point | None:
    """Find a point at which all conditions hold among a few that are as each asks, variable by variable; None where none is found."""
    aims, random = [Aim.at(condition, variables) for condition in conditions], Random(0)  # noqa: S311  # a sample, not a secret
    every = [ready(condition) for condition in conditions]
    kinds = {str(variable.name): variable.type for variable in variables}
    for point in islice(points(variables), FEW):
        there = towards(point, aims, kinds, random)
        with suppress(*UNDEFINED):
            if all(holds_there(there) for holds_there in every):
                return there
    return None


def points(variables: Sequence[Variable]) -> Iterator[Point]:
    """Yield values of these variables to try: ends first, then edges and others; always the same."""
    random = Random(0)  # noqa: S311  # a sample, not a secret
    nodes = [variable_of(str(variable.name), variable.type) for variable in variables]
    for number in range(SAMPLES):
        yield {node.name: _pick(node, number, random) for node in nodes}


@dataclass(frozen=True, slots=True)
class Aim:
    """What values must be like for a condition, as far as it speaks of one variable at a time.

    Attributes:
        boxes: Variables, and the keys that each may have.
        masks: Of each word its name, the bits that are looked at and their values.
    """

    boxes: tuple[tuple[str, Box], ...]
    masks: tuple[tuple[str, int, int], ...]

    @classmethod
    def of(cls, test: Test) -> Self:
        """Return the aim of a test; of one across variables there is none."""
        if test.box:
            return cls(((str(test.variables[0]), test.box),), ())
        return cls((), tuple(_masks(conjuncts(test.condition))))

    @classmethod
    def at(cls, condition: Expr, variables: Sequence[Variable]) -> Self:
        """Return the aim of a condition: that of all parts that must hold."""
        known = {variable.name: variable for variable in variables}
        boxes: dict[str, Box] = {}
        masks: list[tuple[str, int, int]] = []
        for part in conjuncts(condition):
            found = list(_masks([part]))
            read = tuple(dict.fromkeys(read_by(part)))
            box = box_of(part, known[read[0]]) if not found and len(read) == 1 and read[0] in known else None
            masks += found
            if box:
                name = str(read[0])
                boxes[name] = (meet(boxes[name], box) or box) if name in boxes else box
        return cls(tuple(boxes.items()), tuple(masks))


def _masks(conditions: Iterable[Expr]) -> Iterator[tuple[str, int, int]]:
    for mask in filter(None, map(mask_of, conditions)):
        if isinstance(mask.word, Read):
            yield str(mask.word.name), mask.care, mask.value


def towards(point: Point, aims: Iterable[Aim], kinds: Mapping[str, Scalar], random: Random) -> Point:
    """Return the point, changed so that each aim is met by itself, where it can be, boxes first; the last that changes a variable wins.

    A mask comes after: it leaves bits free, so that what was chosen for a range mostly stays in it.
    """
    moved = dict(point)
    for aim in sorted(aims, key=lambda aim: not aim.boxes):
        for name, box in aim.boxes:
            first, last = random.choice(box)
            moved[name] = value_of_key(kinds[name], random.choice((first, last, random.randint(first, last))))
        for word, care, value in aim.masks:
            masked, (low, high) = int(moved[word]) & ~care | value, key_bounds(kinds[word])
            if low <= masked <= high:  # of `int 0 .. 60000` not all bits are free
                moved[word] = masked
    return moved


Ready = Callable[[Mapping[str, Value]], bool]


def ready(condition: Expr) -> Ready:
    """Return the condition, to be tried at many points: a mask of a word is one comparison there, and no walk over its bits.

    It raises where the interpreter does.
    """
    mask = mask_of(condition)
    if mask is not None and isinstance(mask.word, Read):
        name, care, value = mask.word.name, mask.care, mask.value
        return lambda point: int(point[name]) & care == value
    match condition:
        case Apply(op=Op.NOT, args=(inner,)):
            opposite = ready(inner)
            return lambda point: not opposite(point)
        case Apply(op=Op.AND, args=(left, right)):
            first, second = ready(left), ready(right)
            return lambda point: first(point) and second(point)
        case Apply(op=Op.OR, args=(left, right)):
            first, second = ready(left), ready(right)
            return lambda point: first(point) or second(point)
    return partial(holds, condition)


def holds_at(condition: Node, point: Mapping[str, Value]) -> bool:
    """Return whether a condition holds at a point that has a value for each of its variables; not where it is undefined."""
    return _all_hold(list(parts_first(condition)), [condition], point)


def value_at(node: Node, point: Mapping[str, Value]) -> Value | None:
    """Return the value of a node at a point that has one for each of its variables; None where it is undefined."""
    return _known(list(parts_first(node)), point)[node]


def met(conditions: Sequence[Node], goals: Sequence[Node], near: Mapping[str, Value]) -> dict[Node, Point]:
    """Find goals that hold at some point at which all conditions hold, each with such a point; what is not found may hold at another.

    Args:
        conditions: As of `witness`.
        goals: Each is looked for by itself.
        near: Values of some variables; the others are tried first with these, then all are.
    """
    order = list(parts_first(*conditions, *goals))
    variables = [node for node in order if node.op == Shape.VARIABLE]
    found = dict[Node, Point]()
    for point in _tried(variables, min(SAMPLES, EVALUATIONS // max(1, len(order))), near):
        if len(found) == len(goals) or smt.gives_up("what trial finds"):
            break
        if smt.charge(len(order) // _NODES_OF_A_STEP):
            break
        known = _known(order, point)
        if all(known[condition] for condition in conditions):
            found = {goal: point for goal in goals if known[goal]} | found
    return found


def _tried(variables: Sequence[Node], tries: int, near: Mapping[str, Value]) -> Iterator[Point]:
    """Yield so many points, each once: the first half with the values of `near`, then with any."""
    random, seen = Random(0), set[tuple[Value, ...]]()  # noqa: S311  # a sample, not a secret
    for number in range(tries):
        kept = near if number < tries // 2 else {}
        point = {
            each.name: kept[each.name] if each.name in kept else _pick(each, number, random)
            for each in variables
        }
        values = tuple(point.values())
        if values not in seen:
            seen.add(values)
            yield point


def _pick(variable: Node, number: int, random: Random) -> Value:
    low, high = key_bounds(variable.kind)
    ends = [low, high]
    if number < len(ends):
        return value_of_key(variable.kind, ends[number])
    ones = [key_of(variable.kind, one) for one in (1.0, -1.0) if isinstance(variable.kind, Real)]
    near = [key for key in (-1, 0, 1, *ones) if low <= key <= high]
    kind = random.randrange(4)
    if kind == 0:
        return value_of_key(variable.kind, random.choice([*ends, *near]))
    if kind == 1 and isinstance(variable.kind, Real):
        value = part_way(variable.kind.low, variable.kind.high, random.random()) + 0.0
        return single(value) if isinstance(variable.kind, Single) else value
    return value_of_key(variable.kind, random.randint(low, high))


def _less(left: Point, right: Point, variables: Sequence[Node]) -> bool:
    names = [variable.name for variable in variables]
    return [left[name] for name in names] < [right[name] for name in names]


def _lowered(
    order: Sequence[Node], conditions: Sequence[Node], variables: Sequence[Node], point: Point
) -> Point:
    """Lower each variable in turn by bisection; the others stay."""

    def up_to(variable: Node, _low: int, limit: int) -> int | None:
        nonlocal point
        trial = {**point, variable.name: value_of_key(variable.kind, limit)}
        if not _all_hold(order, conditions, trial):
            return None
        point = trial
        return limit

    for variable in variables:
        kind = variable.kind
        lowest(key_bounds(kind)[0], key_of(kind, point[variable.name]), partial(up_to, variable))
    return point


def _all_hold(order: Sequence[Node], conditions: Sequence[Node], point: Mapping[str, Value]) -> bool:
    known = _known(order, point)
    return all(known[condition] for condition in conditions)


def _known(order: Sequence[Node], point: Mapping[str, Value]) -> dict[Node, Value | None]:
    known: dict[Node, Value | None] = {}
    for node in order:
        known[node] = _value(node, [known[part] for part in node.args], point)
    return known


def _value(node: Node, parts: list[Value | None], point: Mapping[str, Value]) -> Value | None:
    """Return the node's value; None where it is not defined."""
    match node.op:
        case Shape.CONSTANT:
            return bool(node.low) if isinstance(node.kind, Bool) else node.low
        case Shape.VARIABLE:
            return point[node.name]
        case Shape.NARROWED:
            return parts[0]
        case Shape.CHOICE:
            return None if parts[0] is None else parts[1] if parts[0] else parts[2]
        case Op.AND:
            return False if False in parts else None if None in parts else True
        case op:
            return (
                None
                if None in parts
                else _computed(op, node.args[0].kind, [part for part in parts if part is not None])
            )


def _computed(op: Op, kind: Scalar, parts: list[Value]) -> Value | None:
    try:
        return operated(op, kind, *parts)
    except (ArithmeticError, ValueError):
        return None
