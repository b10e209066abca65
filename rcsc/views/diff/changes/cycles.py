"""Two versions over two cycles: which steps a level's state graph gained and lost, and which line can newly follow which.

In: versions. Out: `Traces`, with the shortest traces to the steps, and `Follows`. A *state* is a value of a deferred variable that
tables of the level test; a step leads from it to a value that some line writes, for inputs under the table's assumptions and the
invariants. Steps of one table are found by Z3 until there are no more. Levels apart: what two levels can do together is not looked at.

Which line follows which is asked of each version by itself (`relation.follow`): inputs are free under the table's assumptions, and
arithmetic on doubles may say "can" too often, in either version.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from rcsc.lang.digest import Digests
from rcsc.lang.interpret import initial
from rcsc.lang.model import Call, Level, Line, ProcedureName, Program, Statement, Table, pending
from rcsc.proof.relation.follow import following
from rcsc.proof.relation.questions import Independent, pair_is
from rcsc.proof.relation.steps import is_few
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import UndecidedError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import FALSE, Node
from rcsc.views.diff.changes.difference import Follows, Traces, Transition
from rcsc.views.diff.changes.tables import assumed
from rcsc.views.diff.changes.value_text import number
from rcsc.views.diff.changes.versions import Versions, run_by


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
    """Yield every level that both versions have.

    Raises:
        UndecidedError, TooLongError, RecursionError: As `tables.table_part`.
    """
    yield from (_level(versions, pair) for pair in _in_both(versions))


def _in_both(versions: Versions) -> list[tuple[Level, Level]]:
    """Return the levels that both versions have."""
    later = {level.name: level for level in versions.after.levels}
    return [(level, later[level.name]) for level in versions.before.levels if level.name in later]


def _level(versions: Versions, pair: tuple[Level, Level]) -> Traces:
    """Compare the steps of one level's changed tables."""
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
    return Traces(pair[0].name, tuple(new), tuple(gone))


def _states(versions: Versions) -> list[str]:
    """Deferred variables of both versions with few values."""
    both = [
        {str(v.name) for v in p.variables if v.deferred_until is not None}
        for p in (versions.before, versions.after)
    ]
    return [
        name
        for name in versions.leaves
        if all(name in side for side in both) and is_few(versions.kinds[name])
    ]


def _steps(versions: Versions, side: int, table: Table, state: str) -> Iterator[tuple[GraphStep, Node]]:
    """Yield every step of the table, each once, in order of its lines."""
    meaning = versions.meanings()[side]
    known = assumed(table, meaning)
    for line, when in zip(table.every_line, meaning.every_line(table), strict=True):
        effect = meaning.effect([action.statement for action in line.actions], [known, when])
        for leaf in (str(pending(state)), state):
            wrote = values.all_of([known, when, effect.good, effect.wrote.get(leaf, FALSE)])
            wrote = versions.shared.canonical(wrote)
            if leaf in effect.leaves and not (wrote.known and not wrote.low):
                nodes = versions.shared.start[state], effect.leaves[leaf]
                for ends in sorted(Independent([wrote], versions.options).pairs((), *nodes)):
                    words = [number(versions.types[state], value) for value in ends]
                    taken = versions.shared.canonical(values.both(wrote, pair_is(nodes, ends)))
                    yield GraphStep(str(table.name), str(line.name), words[0], words[1]), taken


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
    """Return the shortest way from the first state to the step, by steps of its table: each state with the line that leads on."""
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


# --- which line follows which ---


def follows(versions: Versions) -> Iterator[Follows]:
    """Yield every table that both versions have and a level runs, where its pairs may differ."""
    for pair in _in_both(versions):
        around = _around(versions.digests[0], pair[0]) != _around(versions.digests[1], pair[1])
        tables = [run_by(side.program, version) for side, version in zip(versions.digests, pair, strict=True)]
        for name, table in tables[0].items():
            later_table = tables[1].get(name)
            if later_table is not None and (
                around or versions.digests[0].table(table) != versions.digests[1].table(later_table)
            ):
                yield _compared(versions, pair[0].name, table, later_table)


def _around(digests: Digests, level: Level) -> object:
    """Return the work of a cycle besides the table: a change of it may change the pairs of every table."""
    bodies: list[list[Statement]] = [
        [Call(ProcedureName(name)) for name in part] for part in (level.preprocess, level.postprocess)
    ]
    deferred = [
        (v.name, repr(v.deferred_until)) for v in digests.program.variables if v.deferred_until is not None
    ]
    tables = (
        [digests.table(table) for table in run_by(digests.program, level).values()] if level.stages else []
    )
    return [digests.body(body) for body in bodies], deferred, tables


def _compared(versions: Versions, level: str, old: Table, new: Table) -> Follows:
    name = str(new.name)
    try:
        before = _pairs(versions.before, old, versions.options)
        after = _pairs(versions.after, new, versions.options)
    except UndecidedError:
        return Follows(level, name, decided=False)
    called = _renamed(old, new)
    before = frozenset((called.get(a, a), called.get(b, b)) for a, b in before)
    order = {line: at for at, line in enumerate(_names(new))}

    def sorted_(pairs: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
        return tuple(sorted(pairs, key=lambda pair: [(order.get(line, len(order)), line) for line in pair]))

    return Follows(level, name, sorted_(after - before), sorted_(before - after))


def _pairs(program: Program, table: Table, options: Options) -> frozenset[tuple[str, str]]:
    names = _names(table)
    return frozenset(
        (names[follow.line], names[follow.then]) for follow in following(program, table, options)
    )


def _names(table: Table) -> list[str]:
    return [str(line.name) for line in table.every_line]


def _renamed(old: Table, new: Table) -> dict[str, str]:
    """New names of lines that are otherwise word for word as they were."""
    names = set(_names(old)), set(_names(new))
    fresh = {_body(line): str(line.name) for line in new.lines if str(line.name) not in names[0]}
    gone = [line for line in old.lines if str(line.name) not in names[1]]
    return {str(line.name): fresh[_body(line)] for line in gone if _body(line) in fresh}


def _body(line: Line) -> str:
    tests = [repr(test.condition) for test in line.tests if test is not None]
    return repr((tests, [repr(action.statement) for action in line.actions]))
