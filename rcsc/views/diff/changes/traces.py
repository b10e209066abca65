"""Which steps a level's state graph gained and lost, and the shortest traces to them.

In: versions. Out: `Traces`. A *state* is a value of a deferred variable that tables of the level test; a step leads from it
to a value that some line writes, for inputs under the table's assumptions and the invariants. Steps of one table are found
by Z3 until there are no more. Levels apart: what two levels can do together is not looked at.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from rcsc.lang.interpret import initial
from rcsc.lang.model import Default, Level, Line, Scalar, Table, key_bounds, pending
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import FALSE, Node
from rcsc.views.diff.changes.difference import Traces, Transition
from rcsc.views.diff.changes.tables import assumed
from rcsc.views.diff.changes.value_text import number
from rcsc.views.diff.changes.versions import Versions, run_by

MOST_STATES = 64
"""Values of a variable above which it is not taken for a state."""


@dataclass(frozen=True, slots=True)
class GraphStep:
    """One step: from a state to a state, by a line of a table."""

    table: str
    line: str
    before: str
    after: str


Steps = Mapping[GraphStep, Node]
"""Each step with the inputs at which it is taken."""


def traces(versions: Versions) -> Iterator[Traces]:
    """Every level that both versions have.

    Raises:
        UndecidedError, TooLongError, RecursionError: As `tables.table_part`.
    """
    later = {level.name: level for level in versions.after.levels}
    for level in versions.before.levels:
        if level.name in later:
            yield _level(versions, (level, later[level.name]))


def _level(versions: Versions, pair: tuple[Level, Level]) -> Traces:
    """One level: steps of tables that changed, compared."""
    before = versions.queries
    new: list[Transition] = []
    gone: list[Transition] = []
    programs = versions.before, versions.after
    tables = [run_by(program, level) for program, level in zip(programs, pair, strict=True)]
    differing = [
        name
        for name in dict.fromkeys((*tables[0], *tables[1]))
        if name not in tables[0]
        or name not in tables[1]
        or versions.digests[0].table(tables[0][name]) != versions.digests[1].table(tables[1][name])
    ]
    for state in _states(versions):
        steps = [
            {
                step: taken
                for name in differing
                if name in known and state in known[name].variables
                for step, taken in _steps(versions, side, known[name], state)
            }
            for side, known in enumerate(tables)
        ]
        first = [number(versions.types[state], initial(program)[state]) for program in programs]
        new += _only(versions, state, steps[1], steps[0], first[1])
        gone += _only(versions, state, steps[0], steps[1], first[0])
    return Traces(pair[0].name, tuple(new), tuple(gone), versions.queries - before)


def _states(versions: Versions) -> list[str]:
    """Deferred variables of both versions with few values."""
    both = [
        {str(v.name) for v in p.variables if v.deferred_until is not None}
        for p in (versions.before, versions.after)
    ]
    return [
        name for name in versions.leaves if all(name in side for side in both) and _few(versions.kinds[name])
    ]


def _few(kind: Scalar) -> bool:
    low, high = key_bounds(kind)
    return high - low < MOST_STATES


def _steps(versions: Versions, side: int, table: Table, state: str) -> Iterator[tuple[GraphStep, Node]]:
    """Every step of the table, each once, in order of its lines."""
    program = (versions.before, versions.after)[side]
    meaning = versions.meanings()[side]
    known = assumed(program, table, meaning)
    holds = meaning.lines(table)
    default = values.negation(values.any_of(holds))
    lines: list[tuple[Line | Default, Node]] = [*zip(table.lines, holds, strict=True)]
    lines += [] if table.default is None else [(table.default, default)]
    for line, when in lines:
        effect = meaning.effect([action.statement for action in line.actions], [known, when])
        for leaf in (str(pending(state)), state):
            wrote = values.all_of([known, when, effect.good, effect.wrote.get(leaf, FALSE)])
            wrote = versions.shared.canonical(wrote)
            if leaf in effect.leaves and not (wrote.known and not wrote.low):
                for before, after, taken in _reached(
                    versions, wrote, versions.shared.start[state], effect.leaves[leaf]
                ):
                    words = [number(versions.types[state], value) for value in (before, after)]
                    yield GraphStep(str(table.name), str(line.name), words[0], words[1]), taken


def _reached(versions: Versions, wrote: Node, state: Node, now: Node) -> Iterator[tuple[int, int, Node]]:
    """Pairs of state before and value written, each with the inputs at which that is so."""
    space = versions.space(wrote, state, now)
    steps = []
    solver = space.solver(wrote)
    while space.answered(solver):
        pair = [int(solver.value(values.term_of(node), node.kind)) for node in (state, now)]
        here = values.both(_is(state, pair[0]), _is(now, pair[1]))
        steps.append((pair[0], pair[1], here))
        solver.add(values.term_of(values.negation(here)))
    versions.queries += space.queries
    for before, after, here in sorted(steps, key=lambda step: step[:2]):
        yield before, after, versions.shared.canonical(values.both(wrote, here))


def _is(node: Node, value: int) -> Node:
    return values.equal(node, values.constant(node.kind, value))


def _only(versions: Versions, state: str, here: Steps, there: Steps, first: str) -> Iterator[Transition]:
    """Steps (from state, to state) that one version has and the other has by no line at all."""
    known = {(step.before, step.after) for step in there}
    by: dict[tuple[str, str], list[GraphStep]] = {}
    for step in here:
        if (step.before, step.after) not in known:
            by.setdefault((step.before, step.after), []).append(step)
    for (before, after), steps in by.items():
        lines = tuple(f"table `{step.table}`, line `{step.line}`" for step in steps)
        trace = _trace(here, first, before, steps[0])
        yield Transition(
            state, before, after, lines, trace, versions.spelled(versions.witness(here[steps[0]]))
        )


def _trace(steps: Iterable[GraphStep], first: str, last: str, then: GraphStep) -> tuple[tuple[str, str], ...]:
    """The shortest way from the first state to the step, by steps of its table: each state with the line that leads on."""
    edges: dict[str, list[GraphStep]] = {}
    for step in steps:
        if step.table == then.table:
            edges.setdefault(step.before, []).append(step)
    ways: dict[str, tuple[tuple[str, str], ...]] = {first: ()}
    waiting = deque([first])
    while waiting:
        at = waiting.popleft()
        if at == last:
            return (*ways[at], (then.before, then.line), (then.after, ""))
        for step in edges.get(at, ()):
            if step.after not in ways:
                ways[step.after] = (*ways[at], (at, step.line))
                waiting.append(step.after)
    return ()
