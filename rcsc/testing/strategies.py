"""Hypothesis strategies derived from a program's declarations, leaning on edges.

In: a program. Out: strategies for snapshots and for sequences of cycles. This is the one module of the
suite that imports Hypothesis.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from rcsc.interpret import evaluate
from rcsc.model import (
    Expr,
    Kind,
    Line,
    Program,
    Snapshot,
    Table,
    Value,
    Variable,
    key_bounds,
    value_of_key,
)
from rcsc.resolve.leaves import read_by
from rcsc.testing.edges import companions, leaf_edges, outside
from rcsc.testing.reference_file import monitored
from rcsc.testing.sessions import Session

BROKEN = 0.2  # how often an assumption that is checked is aimed at, to break it
TRIES = 40  # values of what an assumption reads, of which the first that break it are taken
BETWEEN = 0.15  # how often a value may lie anywhere in its range
BESIDE = 0.4  # how often a value is taken from a leaf that it is compared with
MOST_DRAWN = 3  # leaves of a snapshot that are drawn one by one


@dataclass(slots=True)
class Declarations:
    """What the strategies know of a program.

    Strategies are made once: Hypothesis examines each at its first draw, which costs more than the draw.

    Attributes:
        program: The program.
        edges: For every leaf the keys at which something may turn.
        near: For every leaf those it is compared with.
        key: For every leaf the strategy of its keys.
        some: A few leaves that are drawn one by one.
        strange: For every input that can hold what lies outside its range, the strategy of such readings.
        few: A few of the strange inputs; None where there is none.
        checked: The conditions that the executors check, and the leaves that each reads.
    """

    program: Program
    edges: dict[str, tuple[int, ...]]
    near: dict[str, tuple[str, ...]]
    key: dict[str, SearchStrategy[int]] = field(init=False)
    some: SearchStrategy[list[Variable]] = field(init=False)
    strange: dict[str, SearchStrategy[Value]] = field(init=False)
    few: SearchStrategy[list[str]] | None = field(init=False)
    checked: list[tuple[Expr, list[Variable]]] = field(init=False)

    def __post_init__(self) -> None:
        variables, names = self.program.variables, set(monitored(self.program))
        self.key = {v.name: keys(v, self.edges[v.name]) for v in variables}
        self.some = st.lists(st.sampled_from(variables), max_size=MOST_DRAWN)
        self.strange = {
            v.name: st.sampled_from(beyond)
            for v in variables
            if v.kind is Kind.INPUT and (beyond := outside(v.type))
        }
        self.few = st.lists(st.sampled_from(list(self.strange)), max_size=2) if self.strange else None
        conditions = [a.condition for a in self.program.assumptions if a.name in names]
        self.checked = [(one, [v for v in variables if v.name in set(read_by(one))]) for one in conditions]


def declarations(program: Program) -> Declarations:
    """Edges of every leaf, and what it is compared with."""
    return Declarations(program, leaf_edges(program), companions(program))


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


def _break(known: Declarations, drawn: dict[str, int], random: Random) -> None:
    """Moves the drawn keys to where some assumption that is checked is false, if such a place is met."""
    if not known.checked:
        return
    condition, read = random.choice(known.checked)
    for _ in range(TRIES):
        tried = drawn | {str(v.name): random.choice(known.edges[v.name]) for v in read}
        values = {str(v.name): value_of_key(v.type, tried[v.name]) for v in read}
        try:
            if not evaluate(condition, values):
                drawn.update(tried)
                return
        except (ZeroDivisionError, IndexError, OverflowError):
            continue


def _scattered(known: Declarations, random: Random) -> dict[str, int]:
    """A key for every leaf: mostly edges, some values between them, some beside a leaf it is compared with."""
    found: dict[str, int] = {}
    for variable in known.program.variables:
        name, edges = str(variable.name), known.edges[variable.name]
        low, high = key_bounds(variable.type)
        found[name] = random.randint(low, high) if random.random() < BETWEEN else random.choice(edges)
        beside = [found[other] for other in known.near.get(name, ()) if other in found]
        if beside and random.random() < BESIDE:
            found[name] = min(high, max(low, random.choice(beside) + random.choice((-1, 0, 1))))
    if random.random() < BROKEN:
        _break(known, found, random)
    return found


def _draw_keys(draw: DrawFn, known: Declarations) -> dict[str, int]:
    """All leaves from one drawn seed, then a few drawn one by one: a draw for each leaf costs too much."""
    found = _scattered(known, Random(draw(st.binary(min_size=8, max_size=8))))  # noqa: S311  # drawn, so repeatable
    for variable in draw(known.some):
        found[variable.name] = draw(known.key[variable.name])
    return found


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
def _readings(draw: DrawFn, known: Declarations, whole: SearchStrategy[Snapshot], wild: bool) -> Snapshot:
    """A value for every input; where `wild`, some may lie outside the range, NaN and infinities too."""
    given = draw(whole)
    found: dict[str, Value] = {
        str(v.name): given[v.name] for v in known.program.variables if v.kind is Kind.INPUT
    }
    if wild and known.few is not None:
        for name in draw(known.few):
            found[name] = draw(known.strange[name])
    return found


def sessions(known: Declarations, table: Table | None = None, most: int = 8) -> SearchStrategy[Session]:
    """A start state and up to `most` cycles of changing inputs; a third of the sessions has wild inputs."""
    whole = snapshots(known, table)
    tame, wild = (
        st.lists(_readings(known, whole, wild), min_size=1, max_size=most).map(tuple)
        for wild in (False, True)
    )
    cycles = st.integers(0, 2).flatmap(lambda third: wild if third == 0 else tame)
    return st.builds(Session, whole, cycles)
