"""Which line can match in the cycle after which, in one version and not in the other.

In: two versions of a program. Out: `Follows`, one for each table that a level runs and for which it can have changed. Each version's
pairs are those of `relation.follow`: inputs are free under the table's assumptions, and arithmetic on doubles may say "can" too often,
in either version.
"""

from collections.abc import Iterable, Iterator

from rcsc.lang.digest import Digests
from rcsc.lang.model import Call, Level, Line, ProcedureName, Program, Statement, Table
from rcsc.proof.relation.follow import following
from rcsc.proof.relation.steps import UnansweredError
from rcsc.proof.solvers.options import Options
from rcsc.views.diff.changes.difference import Follows
from rcsc.views.diff.changes.versions import Versions, run_by

Pairs = frozenset[tuple[str, str]]


def follows(versions: Versions) -> Iterator[Follows]:
    """Every table that both versions have and a level runs, where its pairs may differ."""
    later = {level.name: level for level in versions.after.levels}
    for level in versions.before.levels:
        if level.name not in later:
            continue
        pair = level, later[level.name]
        around = _around(versions.digests[0], level) != _around(versions.digests[1], pair[1])
        tables = [run_by(side.program, version) for side, version in zip(versions.digests, pair, strict=True)]
        for name, table in tables[0].items():
            later_table = tables[1].get(name)
            if later_table is not None and (
                around or versions.digests[0].table(table) != versions.digests[1].table(later_table)
            ):
                yield _compared(versions, level.name, table, later_table)


def _around(digests: Digests, level: Level) -> object:
    """What a cycle does besides the table: a change of it may change the pairs of every table."""
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
    except UnansweredError:
        return Follows(level, name, decided=False)
    called = _renamed(old, new)
    before = frozenset((called.get(a, a), called.get(b, b)) for a, b in before)
    order = {line: at for at, line in enumerate(_names(new))}

    def sorted_(pairs: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
        return tuple(sorted(pairs, key=lambda pair: [(order.get(line, len(order)), line) for line in pair]))

    return Follows(level, name, sorted_(after - before), sorted_(before - after))


def _pairs(program: Program, table: Table, options: Options) -> Pairs:
    names = _names(table)
    return frozenset(
        (names[follow.line], names[follow.then]) for follow in following(program, table, options)
    )


def _names(table: Table) -> list[str]:
    default = [] if table.default is None else [str(table.default.name)]
    return [*(str(line.name) for line in table.lines), *default]


def _renamed(old: Table, new: Table) -> dict[str, str]:
    """New names of lines that are otherwise word for word as they were."""
    names = set(_names(old)), set(_names(new))
    fresh = {_body(line): str(line.name) for line in new.lines if str(line.name) not in names[0]}
    gone = [line for line in old.lines if str(line.name) not in names[1]]
    return {str(line.name): fresh[_body(line)] for line in gone if _body(line) in fresh}


def _body(line: Line) -> str:
    tests = [repr(test.condition) for test in line.tests if test is not None]
    return repr((tests, [repr(action.statement) for action in line.actions]))
