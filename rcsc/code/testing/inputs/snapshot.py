"""Finds a snapshot in which given conditions hold or fail, or shows that there is none.

In: conditions, each with the truth wanted. Out: a snapshot, `NONE` (shown impossible) or `UNKNOWN`.
Conditions on one leaf are solved exactly by intervals; for the rest, values are tried that lean on
edges, and what is still open is asked of a solver that the caller passes in.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum as PlainEnum
from itertools import islice, product
from math import prod
from random import Random
from typing import TypeAlias

from rcsc.code.testing.executors.edges import companions, leaf_edges, reads
from rcsc.lang.interpret import holds
from rcsc.lang.interval_sets import compared, complement, meet
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Box,
    Expr,
    Literal,
    Program,
    Read,
    Snapshot,
    Test,
    Value,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import MIRRORED, Op, is_comparison, is_logic


class Missing(PlainEnum):
    """Why there is no snapshot."""

    NONE = "none"  # shown: no value satisfies the conditions
    UNKNOWN = "unknown"  # not found, not shown


Solver: TypeAlias = Callable[[Program, Expr], "Snapshot | Missing"]
"""Asks for a snapshot of the program, in its ranges, that satisfies an expression."""

Wanted: TypeAlias = tuple[Test | Expr, bool]

FULL = 64  # a leaf with at most so many keys is tried in full
TRIES = 4000
BESIDE = 0.5  # how often a guess is taken from a leaf that it is compared with


def expr_of(condition: Test | Expr) -> Expr:
    """The expression of a test, or the expression itself."""
    return condition.condition if isinstance(condition, Test) else condition


def conjunction(wanted: Sequence[Wanted]) -> Expr:
    """All conditions with the truth wanted, as one expression."""
    whole: Expr = Literal(True, Bool())
    for condition, truth in wanted:
        expr = expr_of(condition)
        part = expr if truth else Apply(Op.NOT, (expr,), Bool())
        whole = Apply(Op.AND, (whole, part), Bool())
    return whole


def box_of(condition: Test | Expr) -> tuple[str, Box] | None:
    """The leaf and its keys where the condition reads one leaf only, compared with constants."""
    if isinstance(condition, Test):
        return None if condition.box is None else (condition.variables[0], condition.box)
    match condition:
        case Read(name=name, type=Bool()):
            return name, ((1, 1),)
        case Among(subject=Read(name=name, type=kind), values=values):
            keys = sorted({key_of(kind, value) for value in values})
            return name, meet(tuple((key, key) for key in keys), (key_bounds(kind),))
        case Apply(op=op, args=(Read(name=name, type=kind), Literal(value=value))) if is_comparison(op):
            return name, compared(op, key_of(kind, value), *key_bounds(kind))
        case Apply(op=op, args=(Literal(value=value), Read(name=name, type=kind))) if is_comparison(op):
            return name, compared(MIRRORED[op], key_of(kind, value), *key_bounds(kind))
        case _:
            return None


def related_leaves(expr: Expr) -> set[str]:
    """The leaves that `expr` does not only compare with constants."""
    if box_of(expr) is not None or isinstance(expr, Literal):
        return set()
    if isinstance(expr, Apply) and (is_logic(expr.op) or expr.op is Op.NOT):
        return {name for arg in expr.args for name in related_leaves(arg)}
    return reads(expr)


@dataclass(slots=True)
class InputSearch:
    """Searches over one program; remembers its edges."""

    program: Program
    solver: Solver | None
    variables: Mapping[str, Variable]
    edges: Mapping[str, tuple[int, ...]]
    near: Mapping[str, tuple[str, ...]]

    def find(self, wanted: Sequence[Wanted], prefer: Snapshot | None = None) -> Snapshot | Missing:
        """A snapshot with the wanted truths, as near to `prefer` as is cheap."""
        boxes: dict[str, Box] = {}
        rest: list[Wanted] = []
        for condition, truth in wanted:
            boxed = box_of(condition)
            if boxed is None:
                rest.append((condition, truth))
                continue
            name, box = boxed
            kind = self.variables[name].type
            allowed = box if truth else complement(box, *key_bounds(kind))
            boxes[name] = meet(boxes.get(name, (key_bounds(kind),)), allowed)
            if not boxes[name]:
                return Missing.NONE
        base = self._settle(boxes, prefer)
        if not rest or self._agrees(rest, base):
            return base
        return self._relational(boxes, rest, base, wanted)

    def _settle(self, boxes: Mapping[str, Box], prefer: Snapshot | None) -> dict[str, Value]:
        snapshot = {name: v.initial for name, v in self.variables.items()} if prefer is None else dict(prefer)
        for name, box in boxes.items():
            kind = self.variables[name].type
            key = key_of(kind, snapshot[name])
            if not any(low <= key <= high for low, high in box):
                snapshot[name] = value_of_key(
                    kind, min((e for ends in box for e in ends), key=lambda e: abs(e - key))
                )
        return snapshot

    def _agrees(self, rest: Sequence[Wanted], snapshot: Snapshot) -> bool:
        return all(holds(expr_of(condition), snapshot) is truth for condition, truth in rest)

    def _choices(self, name: str, boxes: Mapping[str, Box], alone: bool) -> tuple[list[int], bool]:
        """Keys to try for a leaf, and whether they stand for all of its keys.

        They do where they are all of them, and where the leaf is only compared with constants (`alone`):
        every interval between two constants has an end or a neighbour of one among the edges.
        """
        low, high = key_bounds(self.variables[name].type)
        full = high - low < FULL
        keys = range(low, high + 1) if full else self.edges[name]
        box = boxes.get(name, ((low, high),))
        return [key for key in keys if any(a <= key <= b for a, b in box)] or [box[0][0]], full or alone

    def _relational(
        self, boxes: Mapping[str, Box], rest: Sequence[Wanted], base: Snapshot, wanted: Sequence[Wanted]
    ) -> Snapshot | Missing:
        names = sorted({name for condition, _ in rest for name in reads(expr_of(condition))})
        related = {n for condition, _ in rest for n in related_leaves(expr_of(condition))}
        choices = {name: self._choices(name, boxes, name not in related) for name in names}
        every = prod(len(keys) for keys, _ in choices.values())
        tried = (
            product(*(keys for keys, _ in choices.values()))
            if every <= TRIES
            else self._guesses(choices, boxes)
        )
        for keys in islice(tried, TRIES):
            snapshot = dict(base) | {
                name: value_of_key(self.variables[name].type, key)
                for name, key in zip(names, keys, strict=True)
            }
            if self._agrees(rest, snapshot):
                return snapshot
        if every <= TRIES and all(full for _, full in choices.values()):
            return Missing.NONE
        if self.solver is None:
            return Missing.UNKNOWN
        return self.solver(self.program, conjunction(wanted))

    def _guesses(
        self, choices: Mapping[str, tuple[list[int], bool]], boxes: Mapping[str, Box]
    ) -> Iterator[tuple[int, ...]]:
        random = Random(len(choices))  # noqa: S311  # a repeatable search, nothing secret
        names = list(choices)
        while True:
            drawn = {name: random.choice(choices[name][0]) for name in names}
            for name in names:
                if self.near.get(name) and random.random() < BESIDE:
                    other = random.choice(self.near[name])
                    key = drawn.get(other, drawn[name]) + random.choice((-1, 0, 0, 1))
                    low, high = key_bounds(self.variables[name].type)
                    box = boxes.get(name, ((low, high),))
                    drawn[name] = key if any(a <= key <= b for a, b in box) else drawn[name]
            yield tuple(drawn[name] for name in names)


def search_in(program: Program, solver: Solver | None = None) -> InputSearch:
    """A search over the program's leaves."""
    variables = {str(variable.name): variable for variable in program.variables}
    return InputSearch(program, solver, variables, leaf_edges(program), companions(program))
