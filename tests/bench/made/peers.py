"""Other ways to decide a table: the same question to the same tables, each answer in its own words.

Every peer takes a program and one of its tables (no DEFAULT, no assumptions) and returns whether it is exactly-one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from math import prod
from typing import Any

from rcsc.lang.model import Apply, Box, Expr, Line, Literal, Op, Program, Read, Table, key_bounds

Decide = Callable[[Program, Table], bool]


@dataclass(frozen=True, slots=True)
class Peer:
    """A way to decide, and whether it takes conditions across variables."""

    name: str
    relational: bool
    decide: Decide


# --- masks and volume, no solver -----------------------------------------------------


def line_boxes(program: Program, line: Line) -> dict[str, Box]:
    """The keys that each tested leaf may have for `line` to match."""
    boxes: dict[str, Box] = {}
    for test in line.tests:
        if test is None:
            continue
        assert test.box is not None, "a condition across variables"
        name = test.variables[0]
        boxes[name] = meet(boxes[name], test.box) if name in boxes else test.box
    return boxes


def meet(one: Box, two: Box) -> Box:
    """What both sets of intervals contain."""
    both = ((max(a, c), min(b, d)) for a, b in one for c, d in two)
    return tuple(sorted((low, high) for low, high in both if low <= high))


def python_bitset(program: Program, table: Table) -> bool:
    """The reference of boxes: for each condition the lines that it can meet as one number, joined line by line; then the volumes.

    Each variable is cut at the ends of its conditions into keys that are alike: at 4 and 7 for `>= 4` and `< 7`.
    """
    boxes = [line_boxes(program, line) for line in table.lines]
    everyone = (1 << len(boxes)) - 1
    near: dict[tuple[str, Box], int] = {}
    for name in table.variables:
        stated: dict[Box, int] = {}
        for number, line in enumerate(boxes):
            if name in line:
                stated[line[name]] = stated.get(line[name], 0) | 1 << number
        idle = everyone & ~sum(stated.values())
        starts = sorted({end for box in stated for low, high in box for end in (low, high + 1)})
        place = {start: at for at, start in enumerate(starts)}
        cells = [idle] * len(place)
        within = {
            box: [at for low, high in box for at in range(place[low], place[high + 1])] for box in stated
        }
        for box, inside in within.items():
            for at in inside:
                cells[at] |= stated[box]
        for box, inside in within.items():
            for at in inside:
                near[name, box] = near.get((name, box), idle) | cells[at]
    for number, line in enumerate(boxes):
        others = everyone ^ 1 << number
        for axis, keys in line.items():
            others &= near[axis, keys]
        if others:
            return False
    return sum(_volume(program, table, box) for box in boxes) == _volume(program, table, {})


def _volume(program: Program, table: Table, box: dict[str, Box]) -> int:
    leaves = {variable.name: variable for variable in program.variables}
    return prod(
        sum(high - low + 1 for low, high in box.get(name, (key_bounds(leaves[name].type),)))
        for name in table.variables
    )


# --- Z3, as most people would first ask it -------------------------------------------

_ARITHMETIC: dict[Op, Callable[[Any, Any], Any]] = {
    Op.ADD: lambda a, b: a + b,
    Op.SUB: lambda a, b: a - b,
    Op.MUL: lambda a, b: a * b,
    Op.EQ: lambda a, b: a == b,
    Op.NE: lambda a, b: a != b,
    Op.LT: lambda a, b: a < b,
    Op.LE: lambda a, b: a <= b,
    Op.GT: lambda a, b: a > b,
    Op.GE: lambda a, b: a >= b,
}


def _z3_expr(expr: Expr, numbers: dict[str, Any]) -> Any:
    import z3

    match expr:
        case Literal(value=value):
            return z3.BoolVal(value) if isinstance(value, bool) else z3.IntVal(int(value))
        case Read(name=name):
            return numbers[name]
        case Apply(op=op, args=args):
            terms = [_z3_expr(arg, numbers) for arg in args]
            if op is Op.AND:
                return z3.And(*terms)
            if op is Op.OR:
                return z3.Or(*terms)
            if op is Op.NOT:
                return z3.Not(terms[0])
            if op is Op.NEG:
                return -terms[0]
            return _ARITHMETIC[op](*terms)
        case _:
            raise TypeError(f"not in the benchmark's tables: {expr}")


def _z3_lines(program: Program, table: Table) -> tuple[list[Any], list[Any]]:
    """Each line as a formula over integers, and the domain."""
    import z3

    leaves = {str(variable.name): variable for variable in program.variables}
    numbers: dict[str, Any] = {name: z3.Int(name) for name in table.variables}
    domain = []
    for name, number in numbers.items():
        low, high = key_bounds(leaves[name].type)
        domain += [number >= low, number <= high]
    tests: dict[int, Any] = {}
    lines = []
    for line in table.lines:
        terms = []
        for test in line.tests:
            if test is None:
                continue
            if id(test) not in tests:
                if test.box is None:
                    tests[id(test)] = _z3_expr(test.condition, numbers)
                else:
                    number = numbers[test.variables[0]]
                    tests[id(test)] = z3.Or([z3.And(number >= low, number <= high) for low, high in test.box])
            terms.append(tests[id(test)])
        lines.append(z3.And(terms))
    return lines, domain


def z3_all_pairs(program: Program, table: Table) -> bool:
    """One query a pair of lines and one for the gap, in one solver."""
    import z3

    lines, domain = _z3_lines(program, table)
    solver = z3.Solver()
    solver.add(domain)
    for one, two in combinations(lines, 2):
        solver.push()
        solver.add(one, two)
        answer = solver.check()
        solver.pop()
        if answer != z3.unsat:
            return False
    solver.add(z3.Not(z3.Or(lines)))
    return bool(solver.check() == z3.unsat)


def z3_two_queries(program: Program, table: Table) -> bool:
    """The gap, and `at least two lines` as one pseudo-boolean query."""
    import z3

    lines, domain = _z3_lines(program, table)
    solver = z3.Solver()
    solver.add(domain)
    solver.push()
    solver.add(z3.Not(z3.Or(lines)))
    covered = solver.check() == z3.unsat
    solver.pop()
    solver.add(z3.AtLeast(*lines, 2))
    return bool(covered and solver.check() == z3.unsat)


PEERS = (
    Peer("Python, masks", False, python_bitset),
    Peer("Z3, all pairs", True, z3_all_pairs),
    Peer("Z3, two queries", True, z3_two_queries),
)
