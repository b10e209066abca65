"""Hypothesis strategies derived from a program's declarations, leaning on edges.

In: a program. Out: strategies for snapshots and for sequences of cycles. This is the one module of the
suite that imports Hypothesis.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from rcsc.model import Kind, Line, Program, Snapshot, Table, Value, Variable, key_bounds, value_of_key
from rcsc.testing.edges import companions, leaf_edges, outside
from rcsc.testing.sessions import Session

BESIDE = 0.4  # how often a value is taken from a leaf that it is compared with
DRAWN = 48  # leaves drawn one by one; the others of a larger program follow from one drawn seed


@dataclass(slots=True)
class Declarations:
    """What the strategies know of a program."""

    program: Program
    edges: dict[str, tuple[int, ...]]
    near: dict[str, tuple[str, ...]]
    first: tuple[str, ...]

    def order(self) -> list[Variable]:
        """Leaves with the test variables first, so that they are drawn one by one."""
        return sorted(self.program.variables, key=lambda v: v.name not in self.first)


def declarations(program: Program) -> Declarations:
    """Edges of every leaf, and which leaves tables test."""
    first = tuple(str(name) for table in program.tables for name in table.variables)
    return Declarations(program, leaf_edges(program), companions(program), first)


def keys(variable: Variable, edges: Sequence[int]) -> SearchStrategy[int]:
    """A key of the leaf: mostly an edge, sometimes any value of its range."""
    low, high = key_bounds(variable.type)
    if high - low <= len(edges):
        return st.integers(low, high)
    return st.one_of(st.sampled_from(edges), st.sampled_from(edges), st.integers(low, high))


def _aim(known: Declarations, line: Line, drawn: dict[str, int], random: Random) -> None:
    """Moves the drawn keys into the boxes of a line's tests."""
    for test in line.tests:
        if test is not None and test.box:
            name = str(test.variables[0])
            if not any(low <= drawn[name] <= high for low, high in test.box):
                low, high = random.choice(test.box)
                inside = [key for key in known.edges[name] if low <= key <= high]
                drawn[name] = random.choice(inside or [low, high])


def _draw_keys(draw: DrawFn, known: Declarations) -> dict[str, int]:
    drawn: dict[str, int] = {}
    random = Random(draw(st.integers(0, 2**32 - 1)))  # noqa: S311  # drawn, so that it can be replayed
    for number, variable in enumerate(known.order()):
        edges, name = known.edges[variable.name], str(variable.name)
        drawn[name] = draw(keys(variable, edges)) if number < DRAWN else random.choice(edges)
        low, high = key_bounds(variable.type)
        beside = [drawn[other] for other in known.near.get(name, ()) if other in drawn]
        if beside and random.random() < BESIDE:  # equal to a leaf it is compared with, or next to it
            drawn[name] = min(high, max(low, random.choice(beside) + random.choice((-1, 0, 1))))
    return drawn


@st.composite
def snapshots(draw: DrawFn, known: Declarations, table: Table | None = None) -> Snapshot:
    """A value for every leaf, in its range; for a table often one that a chosen line's boxes allow."""
    drawn = _draw_keys(draw, known)
    if table is not None and table.lines:
        at = draw(st.integers(-1, len(table.lines) - 1))
        if at >= 0:
            _aim(known, table.lines[at], drawn, Random(at))  # noqa: S311  # repeatable on purpose
    return {str(v.name): value_of_key(v.type, drawn[v.name]) for v in known.program.variables}


@st.composite
def readings(draw: DrawFn, known: Declarations, table: Table | None, wild: bool) -> Snapshot:
    """A value for every input; where `wild`, some may lie outside the range, NaN and infinities too."""
    whole = draw(snapshots(known, table))
    found: dict[str, Value] = {
        str(v.name): whole[v.name] for v in known.program.variables if v.kind is Kind.INPUT
    }
    strange = [v for v in known.program.variables if v.kind is Kind.INPUT and outside(v.type)]
    if wild and strange:
        for variable in draw(st.lists(st.sampled_from(strange), max_size=2)):
            found[variable.name] = draw(st.sampled_from(outside(variable.type)))
    return found


@st.composite
def sessions(draw: DrawFn, known: Declarations, table: Table | None = None, most: int = 8) -> Session:
    """A start state and up to `most` cycles of changing inputs; a third of the sessions has wild inputs."""
    start = draw(snapshots(known, table))
    wild = draw(st.integers(0, 2)) == 0
    cycles = draw(st.lists(readings(known, table, wild), min_size=1, max_size=most))
    return Session(start, tuple(cycles))
