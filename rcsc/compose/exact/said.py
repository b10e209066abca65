"""Conditions that an engine has found, in the words of the language: so they are printed, confirmed and kept like others.

In: leaves with their types, and what is known of their keys. Out: expressions, and predicates of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from rcsc.code.testing.inputs.condition_text import words
from rcsc.compose.contract.predicates import Predicate
from rcsc.lang.expressions import intervals
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Enum,
    Expr,
    Int,
    Literal,
    Op,
    Read,
    Scalar,
    VariableName,
    key_bounds,
    value_of_key,
)
from rcsc.lang.operator_table import Arithmetic
from rcsc.lang.over_time.past import TRUE, either, negation
from rcsc.proof.solvers.horn import AtMost, Formula, Holds, Joined, Not, UnreadableError, Within

Leaf = tuple[str, Scalar]
Box = tuple[tuple[int, int], ...]
"""Of each leaf the least and the greatest key."""
FEW_BOXES, SHORTEST_ROW = 8, 4
"""So few boxes are said as they are; the states that are a row."""


@dataclass(frozen=True, slots=True)
class Found:
    """A condition that an engine has found, as it is kept.

    Attributes:
        leaves: The leaves that it is about, each a place of the formula.
    """

    leaves: tuple[str, ...]
    formula: Formula


def predicate(found: Found, kinds: Mapping[str, Scalar]) -> Predicate:
    """Return a condition as a predicate.

    Raises:
        UnreadableError: It adds what are no integers.
    """
    condition = of_formula(found.formula, [(leaf, kinds[leaf]) for leaf in found.leaves])
    return Predicate(_spelled(condition), Bool(), condition=condition)


def _spelled(condition: Expr) -> str:
    """Spell a condition, without parentheses around what the same word joins."""
    match condition:
        case Apply(op=Op.AND | Op.OR as op):
            return f" {op.value} ".join(
                f"({_spelled(part)})" if isinstance(part, Apply | Among) else _spelled(part)
                for part in _joined_by(op, condition)
            )
        case _:
            return words(condition)


def _joined_by(op: Op, condition: Expr) -> list[Expr]:
    if not (isinstance(condition, Apply) and condition.op is op):
        return [condition]
    return [part for arg in condition.args for part in _joined_by(op, arg)]


def _joined(op: Op, parts: Sequence[Expr]) -> Expr:
    """Join conditions, as evenly as possible: what evaluates them does so by recursion."""
    if not parts:
        return Literal(op is Op.AND, Bool())
    if len(parts) == 1:
        return parts[0]
    half = len(parts) // 2
    return Apply(op, (_joined(op, parts[:half]), _joined(op, parts[half:])), Bool())


def _read(leaf: Leaf) -> Expr:
    return Read(VariableName(leaf[0]), leaf[1])


def between(leaf: Leaf, low: int, high: int) -> Expr:
    """Return the condition that the key of a leaf lies between these."""
    kind, read = leaf[1], _read(leaf)
    least, greatest = key_bounds(kind)
    low, high = max(low, least), min(high, greatest)
    if low > high or (low, high) == (least, greatest):
        return Literal(low <= high, Bool())
    if isinstance(kind, Bool):
        return read if low else negation(read)
    if low == high:
        return Apply(Op.EQ, (read, Literal(value_of_key(kind, low), kind)), Bool())
    if isinstance(kind, Enum):
        return Among(read, tuple(range(low, high + 1)))
    ends = []
    if low > least:
        ends.append(Apply(Op.GE, (read, Literal(value_of_key(kind, low), kind)), Bool()))
    if high < greatest:
        ends.append(Apply(Op.LE, (read, Literal(value_of_key(kind, high), kind)), Bool()))
    return _joined(Op.AND, ends)


def of_formula(formula: Formula, leaves: Sequence[Leaf]) -> Expr:
    """Say a formula about these leaves.

    Raises:
        UnreadableError: It adds what are no integers.
    """
    match formula:
        case Holds(at):
            return _read(leaves[at])
        case Not(part):
            return negation(of_formula(part, leaves))
        case Joined(every, parts):
            return _joined(Op.AND if every else Op.OR, [of_formula(part, leaves) for part in parts])
        case Within(at, low, high):
            return between(leaves[at], low, high)
        case AtMost():
            return _linear(formula, leaves)


def _linear(formula: AtMost, leaves: Sequence[Leaf]) -> Expr:
    match formula.factors:
        case ():
            return Literal(formula.most == 0 if formula.equal else formula.most >= 0, Bool())
        case ((at, factor),):
            least, greatest = key_bounds(leaves[at][1])
            if formula.equal:
                whole, rest = divmod(formula.most, factor)
                return Literal(False, Bool()) if rest else between(leaves[at], whole, whole)
            # a quotient is rounded to where the comparison still holds
            if factor > 0:
                return between(leaves[at], least, formula.most // factor)
            return between(leaves[at], -(formula.most // -factor), greatest)
    for at, _ in formula.factors:
        if isinstance(leaves[at][1], Enum):
            return _member_by_member(formula, at, leaves)
        if not isinstance(leaves[at][1], Int):
            raise UnreadableError
    left = [(at, factor) for at, factor in formula.factors if factor > 0]
    right = [(at, -factor) for at, factor in formula.factors if factor < 0]
    over, under = (0, formula.most) if formula.most >= 0 else (-formula.most, 0)
    return Apply(
        Op.EQ if formula.equal else Op.LE, (_sum(left, over, leaves), _sum(right, under, leaves)), Bool()
    )


def _member_by_member(formula: AtMost, of: int, leaves: Sequence[Leaf]) -> Expr:
    """Say a sum to which the key of an enumeration adds: members are not added in the language, so each is looked at by itself."""
    low, high = key_bounds(leaves[of][1])
    factor = dict(formula.factors)[of]
    others = tuple((at, by) for at, by in formula.factors if at != of)
    return _joined(
        Op.AND,
        [
            either(negation(between(leaves[of], key, key)), rest)
            for key in range(low, high + 1)
            if (rest := _linear(AtMost(others, formula.most - factor * key, formula.equal), leaves)) != TRUE
        ],
    )


def _sum(factors: Sequence[tuple[int, int]], constant: int, leaves: Sequence[Leaf]) -> Expr:
    """Return the sum of leaves times positive factors, and of a constant."""
    parts = [
        _read(leaves[at]) if factor == 1 else _applied(Op.MUL, _number(factor), _read(leaves[at]))
        for at, factor in factors
    ]
    parts += [_number(constant)] if constant or not parts else []
    total = parts[0]
    for part in parts[1:]:
        total = _applied(Op.ADD, total, part)
    return total


def _number(value: int) -> Expr:
    return Literal(value, Int(value, value))


def _applied(op: Arithmetic, left: Expr, right: Expr) -> Expr:
    plain = tuple(Int(*key_bounds(side.type)) for side in (left, right))
    return Apply(op, (left, right), intervals.apply(op, plain, ()))


# --- of states ---------------------------------------------------------------------------


def of_states(states: Sequence[Sequence[int]], kinds: Sequence[Scalar]) -> Formula:
    """Say that the keys of leaves of these types are those of one of the states: in boxes, and where numbers go together, in rows."""
    whole, left = [key_bounds(kind) for kind in kinds], boxes(states)
    told: list[Formula] = []
    numbers = [at for at, kind in enumerate(kinds) if isinstance(kind, Int)]
    for pair in combinations(numbers, 2):
        if len(left) < FEW_BOXES:
            break
        left, found = rows(left, *pair)
        told += [Joined(True, (*_within(row.ends, whole), row.formula(pair))) for row in found]
    return Joined(False, (*told, *(Joined(True, _within(box, whole)) for box in left)))


def _within(box: Box, whole: Sequence[tuple[int, int]]) -> tuple[Formula, ...]:
    return tuple(Within(at, *ends) for at, ends in enumerate(box) if ends != whole[at])


@dataclass(frozen=True, slots=True)
class Row:
    """States in which two numbers go up together, or one up as the other goes down.

    Attributes:
        ends: The least box with all of them.
        rises: Whether they go up together.
    """

    ends: Box
    rises: bool

    def formula(self, pair: tuple[int, int]) -> Formula:
        """Say how the two go together."""
        first, second = pair
        sign = -1 if self.rises else 1
        sum_ = self.ends[first][0] + sign * (self.ends[second][0] if self.rises else self.ends[second][1])
        return AtMost(((first, 1), (second, sign)), sum_, equal=True)


def rows(found: Sequence[Box], first: int, second: int) -> tuple[list[Box], list[Row]]:
    """Return the boxes that are in no row of two numbers by these places, and the rows."""
    left, rows_ = list[Box](), list[Row]()
    points: dict[Box, list[Box]] = {}
    for box in found:
        if any(low < high for low, high in (box[first], box[second])):
            left.append(box)
            continue
        same = tuple(ends for at, ends in enumerate(box) if at not in (first, second))
        points.setdefault(same, []).append(box)
    for alike in points.values():
        others, rising = _runs(alike, first, second, 1)
        rest, falling = _runs(others, first, second, -1)
        rows_ += [_row(run, first, second, rises=True) for run in rising]
        rows_ += [_row(run, first, second, rises=False) for run in falling]
        left += rest
    return sorted(left), rows_


def _runs(alike: Sequence[Box], first: int, second: int, step: int) -> tuple[list[Box], list[list[Box]]]:
    """Split points: those in no row, and rows in which the second number makes this step as the first goes up by one."""
    runs: dict[tuple[int, int], list[Box]] = {}
    last: dict[int, tuple[int, int]] = {}
    for box in sorted(alike, key=lambda box: box[first]):
        at, row = box[first][0], box[second][0] - step * box[first][0]
        begun, before = last.get(row, (at, at))
        last[row] = (begun if at <= before + 1 else at), at
        runs.setdefault((row, last[row][0]), []).append(box)
    short = [box for run in runs.values() if len(run) < SHORTEST_ROW for box in run]
    return short, [run for run in runs.values() if len(run) >= SHORTEST_ROW]


def _row(run: Sequence[Box], first: int, second: int, *, rises: bool) -> Row:
    ends = list(run[0])
    for at in (first, second):
        keys = [box[at][0] for box in run]
        ends[at] = min(keys), max(keys)
    return Row(tuple(ends), rises)


def boxes(states: Sequence[Sequence[int]]) -> list[Box]:
    """Return few boxes that contain just these states: those that lie side by side are joined, place by place."""
    found: list[Box] = sorted({tuple((key, key) for key in state) for state in states})
    before = 0
    while len(found) != before:
        before = len(found)
        for place in range(len(found[0]) if found else 0):
            found = _side_by_side(found, place)
    return found


def _side_by_side(found: Sequence[Box], place: int) -> list[Box]:
    rows: dict[Box, list[tuple[int, int]]] = {}
    for box in found:
        rows.setdefault((*box[:place], *box[place + 1 :]), []).append(box[place])
    merged: list[Box] = []
    for others, ends in rows.items():
        for low, high in _merged(sorted(ends)):
            merged.append((*others[:place], (low, high), *others[place:]))
    return sorted(merged)


def _merged(ends: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    joined = [ends[0]]
    for low, high in ends[1:]:
        if low == joined[-1][1] + 1:
            joined[-1] = joined[-1][0], high
        else:
            joined.append((low, high))
    return joined
