"""Snapshots and sequences of cycles drawn from a program's declarations, leaning on edges.

In: a program, and a generator of random numbers: the same seed gives the same. Out: snapshots and sessions.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from random import Random

from rcsc.code.testing.executors.edges import companions, leaf_edges, outside
from rcsc.code.testing.executors.reference_file import inputs, monitored
from rcsc.code.testing.executors.sessions import Stimuli
from rcsc.lang.interpret import evaluate
from rcsc.lang.interval_sets import holds
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Expr, Line, Program, Snapshot, Table, Value, Variable, key_bounds, value_of_key

BROKEN = 0.2  # how often an assumption that is checked is aimed at, to break it
TRIES = 40  # values of what an assumption reads, of which the first that break it are taken
BETWEEN = 0.15  # how often a value may lie anywhere in its range
BESIDE = 0.4  # how often a value is taken from a leaf that it is compared with
WILD = 1 / 3  # how often readings of a session may lie outside their ranges
STEADY = 0.3  # how often a cycle reads what the cycle before it read, but for some inputs
MOST_CHANGED = 3  # inputs that change in a steady cycle
DRAWN_FOR_ONE = 10  # sessions that are drawn for each that begins where a cycle may, at most
STRANGE = (0, 0, 1, 2)  # how many inputs of a cycle lie outside their ranges


@dataclass(frozen=True, slots=True)
class Declarations:
    """What is known of a program before anything is drawn.

    Attributes:
        program: The program.
        edges: For every leaf the keys at which something may turn.
        near: For every leaf, the leaves that it is compared with.
        inputs: The names of its inputs.
        strange: For every input that can hold them, readings outside its range.
        checked: The conditions that the executors check, and the leaves that each reads.
    """

    program: Program
    edges: dict[str, tuple[int, ...]]
    near: dict[str, tuple[str, ...]]
    inputs: tuple[str, ...]
    strange: dict[str, tuple[Value, ...]]
    checked: tuple[tuple[Expr, tuple[Variable, ...]], ...]


def declarations(program: Program) -> Declarations:
    """Edges of every leaf, what it is compared with, and what its type holds beyond its range."""
    admitted, names = inputs(program), set(monitored(program))
    return Declarations(
        program,
        leaf_edges(program),
        companions(program),
        tuple(str(v.name) for v in admitted),
        {str(v.name): beyond for v in admitted if (beyond := outside(v.type))},
        tuple(
            (a.condition, tuple(v for v in program.variables if v.name in set(read_by(a.condition))))
            for a in program.assumptions
            if a.name in names
        ),
    )


def _aim(known: Declarations, line: Line, drawn: dict[str, int], random: Random) -> None:
    """Moves the drawn keys into the boxes of a line's tests."""
    for test in line.tests:
        if test is not None and test.box:
            name = str(test.variables[0])
            if not holds(test.box, drawn[name]):
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
    keys: dict[str, int] = {}
    for variable in known.program.variables:
        name, edges = str(variable.name), known.edges[variable.name]
        low, high = key_bounds(variable.type)
        keys[name] = random.randint(low, high) if random.random() < BETWEEN else random.choice(edges)
        beside = [keys[other] for other in known.near.get(name, ()) if other in keys]
        if beside and random.random() < BESIDE:
            keys[name] = min(high, max(low, random.choice(beside) + random.choice((-1, 0, 1))))
    if random.random() < BROKEN:
        _break(known, keys, random)
    return keys


def snapshot(known: Declarations, table: Table | None, random: Random) -> Snapshot:
    """A value for every leaf, in its range; for a table often one that a chosen line's boxes allow."""
    drawn = _scattered(known, random)
    if table is not None:
        at = random.randint(-1, len(table.lines) - 1)
        if at >= 0:
            _aim(known, table.lines[at], drawn, random)
    return {str(v.name): value_of_key(v.type, drawn[v.name]) for v in known.program.variables}


def _readings(
    known: Declarations, table: Table | None, random: Random, before: Snapshot, wild: bool
) -> Snapshot:
    """A value for every input; where `wild`, some may lie outside their ranges, NaN and infinities too."""
    drawn = snapshot(known, table, random)
    steady = bool(before) and random.random() < STEADY
    changed = random.choices(known.inputs, k=random.randint(0, MOST_CHANGED)) if steady else known.inputs
    readings: dict[str, Value] = {**before, **{name: drawn[name] for name in changed}}
    if wild and known.strange:
        for name in random.choices(list(known.strange), k=random.choice(STRANGE)):
            readings[name] = random.choice(known.strange[name])
    return readings


def session(known: Declarations, table: Table | None, most: int, random: Random) -> Stimuli:
    """A start state and one to `most` cycles of inputs that change; a third of the sessions has wild inputs."""
    start = snapshot(known, table, random)
    wild = random.random() < WILD
    cycles: list[Snapshot] = []
    for _ in range(random.randint(1, most)):
        cycles.append(_readings(known, table, random, cycles[-1] if cycles else {}, wild))
    return Stimuli(start, tuple(cycles))


def sessions(
    known: Declarations,
    aim: Callable[[], Table | None],
    most: int,
    random: Random,
    examples: int,
    begins: Callable[[Snapshot], bool],
) -> Iterator[Stimuli]:
    """Yield sessions that begin where a cycle may.

    Args:
        known: Of the program.
        aim: Gives the table whose lines the next session aims at.
        most: Cycles of the longest.
        random: Draws them.
        examples: How many; fewer where too few of those drawn begin so.
        begins: Whether a cycle may begin in a state.
    """
    drawn = (session(known, aim(), most, random) for _ in range(DRAWN_FOR_ONE * examples))
    yield from islice((stimuli for stimuli in drawn if begins(stimuli.start)), examples)
