"""Control levels: a period, what runs before and after, and the table of each command."""

from collections.abc import Iterable, Mapping

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Label
from rcsc.diagnostics.source import Span
from rcsc.lang.expressions.scope import Body, Scope, spell_number
from rcsc.lang.expressions.typed import typed
from rcsc.lang.expressions.types import constant
from rcsc.lang.model import (
    Default,
    Int,
    Level,
    Line,
    OneTable,
    Procedure,
    Read,
    Scalar,
    Table,
    TableByCommand,
    TableName,
    Value,
    key_bounds,
    spell,
    value_of_key,
)
from rcsc.lang.resolve.owners import Owners
from rcsc.lang.resolve.procedures import touched
from rcsc.lang.resolve.variables import fits
from rcsc.lang.syntax import tree

USUAL_PERIOD = 40
LONGEST_PERIOD = 3_600_000


def level(
    scope: Scope,
    written: tree.LevelDecl,
    tables: Mapping[TableName, Table],
    owners: Owners,
    procedures: Mapping[str, Procedure],
) -> Level | None:
    """The level; None after an error in its tables."""
    before, after = owners.laid_out(written.preprocess), owners.laid_out(written.postprocess)
    period, chosen = _period(scope, written), _chosen(scope, written, set(tables))
    if chosen is None:
        return None
    if isinstance(chosen, TableByCommand):
        assert written.selector is not None
        runs = [tables[name] for name in dict.fromkeys(name for _, name in chosen.tables)]
        _stays(scope, chosen, written.selector.span, _written(runs, after, procedures))
    return Level(written.name.text, period, before, chosen, after, " ".join(written.doc), written.name.span)


def _period(scope: Scope, written: tree.LevelDecl) -> int:
    """Return the period in ms.

    Source: Haynes et al. 1984, section 2: the sample period was 40 ms; taken where none is written.
    """
    value = None if written.period is None else constant(scope, written.period)
    if written.period is None or value is None:
        return USUAL_PERIOD
    factor = {(): 1, (("ms", 1),): 1, (("s", 1),): 1000}.get(value.unit())
    if not isinstance(value.expr.type, Int) or factor is None:
        scope.report(Code.UNIT, "a period is a whole number of `ms` or `s`", written.period.span)
        return USUAL_PERIOD
    period = int(value.literal().value) * factor
    if not 1 <= period <= LONGEST_PERIOD:
        message = f"a period is 1 ms to one hour, not {spell_number(period)} ms"
        scope.report(Code.OUT_OF_RANGE_CONSTANT, message, written.period.span)
        return USUAL_PERIOD
    return period


def _chosen(
    scope: Scope, written: tree.LevelDecl, tables: set[TableName]
) -> OneTable | TableByCommand | None:
    if written.table is not None:
        known = _table(scope, written.table, tables)
        return OneTable(TableName(written.table.text)) if known else None
    assert written.selector is not None
    selector = typed(scope, Body(), written.selector)
    if selector is None:
        return None
    pairs: dict[Value, TableName] = {}
    places: dict[Value, Span] = {}
    sound = True
    for dispatch in written.dispatch:
        sound = _table(scope, dispatch.table, tables) and sound
        value = constant(scope, dispatch.value, selector.expr.type)
        if value is None or not fits(scope, selector.expr.type, value, dispatch.value.span):
            sound = False
            continue
        command = value.literal().value
        if command in pairs:
            first = Label(places[command], "here")
            scope.report(
                Code.DUPLICATE_ARM, "this command has a table already", dispatch.value.span, related=(first,)
            )
        places.setdefault(command, dispatch.value.span)
        pairs.setdefault(command, TableName(dispatch.table.text))
    if not sound or not _complete(scope, selector.expr.type, pairs, written.selector.span):
        return None
    return TableByCommand(selector.expr, tuple(sorted(pairs.items())))


def _stays(scope: Scope, chosen: TableByCommand, span: Span, written: Mapping[str, str]) -> None:
    """Report a selector that a cycle may change after choosing by it: nothing would show which table ran."""
    if not isinstance(chosen.selector, Read):
        scope.report(Code.UNSTEADY_SELECTOR, "an element that is chosen by its index chooses the table", span)
        return
    name = str(chosen.selector.name)
    who = "its safe value" if scope.leaves[chosen.selector.name].safe is not None else written.get(name)
    if who is not None:
        scope.report(
            Code.UNSTEADY_SELECTOR,
            f"`{name}` chooses the table, and {who} may change it after that",
            span,
            "let the preprocess alone write it, or give it its next value with `next`",
        )


def _written(
    tables: Iterable[Table], after: Iterable[str], procedures: Mapping[str, Procedure]
) -> dict[str, str]:
    """Map each leaf that tables or the postprocess may write to one writer."""
    writers: dict[str, str] = {}
    for table in tables:
        lines: list[Line | Default] = [*table.lines, *([] if table.default is None else [table.default])]
        for line in lines:
            _, writes = touched([action.statement for action in line.actions], procedures)
            writers |= dict.fromkeys(map(str, writes), f"line `{line.name}` of table `{table.name}`")
    for name in after:
        if name in procedures:
            writers |= dict.fromkeys(map(str, procedures[name].writes), f"`{name}` in the postprocess")
    return writers


def _table(scope: Scope, name: tree.Name, tables: set[TableName]) -> bool:
    if name.text in tables:
        return True
    scope.unknown("table", name, [str(table) for table in tables])
    return False


def _complete(scope: Scope, kind: Scalar, pairs: dict[Value, TableName], span: Span) -> bool:
    """Whether every value of the selector has a table; the least ones without are reported."""
    low, high = key_bounds(kind)
    if len(pairs) == high - low + 1:
        return True
    first = range(low, min(high, low + len(pairs)) + 1)
    missing = next(key for key in first if value_of_key(kind, key) not in pairs)
    words = spell(kind, value_of_key(kind, missing))
    count = high - low - len(pairs)
    more = f" and {spell_number(count)} more have" if count else " has"
    scope.report(Code.MISSING_TABLE, f"`{words}`{more} no table", span, f"add `{words} : TABLE`")
    return False
