"""Control levels: a period, what runs before and after, the table of each command, and the order of several tables.

Several tables of one cycle run in the order of what they read and write: one that reads what another writes comes after it. So
each reads values of this cycle, and the order in which they are written means nothing.

>>> from rcsc.lang.resolve import compile_text
>>> program = compile_text('''
... input hot : bool
... state alarm : bool
... output horn : bool
... table sound {
...   | line | alarm || horn  |
...   | on   | true  || true  |
...   | off  | false || false |
... }
... table watch {
...   | line | hot   || alarm |
...   | up   | true  || true  |
...   | stay | false ||       |
... }
... level guard { table sound table watch }''')
>>> program.levels[0].table_names
('watch', 'sound')
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.previous import fresh
from rcsc.lang.expressions.scope import Body, Scope, spell_number
from rcsc.lang.expressions.typed import typed
from rcsc.lang.expressions.types import constant
from rcsc.lang.leaves import free_name, read_by, shortest_circle
from rcsc.lang.model import (
    Assumption,
    Declared,
    Enum,
    Int,
    Kind,
    Level,
    OneTable,
    Procedure,
    Read,
    Scalar,
    Table,
    TableByCommand,
    TableChoice,
    TableName,
    Value,
    Variable,
    VariableName,
    key_bounds,
    spell,
    value_of_key,
)
from rcsc.lang.resolve.declarations import fits
from rcsc.lang.resolve.procedures import Owners, touched
from rcsc.lang.syntax import tree

USUAL_PERIOD = 40
LONGEST_PERIOD = 3_600_000


@dataclass(frozen=True, slots=True)
class Declarations:
    """The parts that levels run: tables, assumptions and procedures by name, and owners."""

    tables: Mapping[TableName, Table]
    assumptions: Mapping[str, Assumption]
    procedures: Mapping[str, Procedure]
    owners: Owners


def level(scope: Scope, written: tree.LevelDecl, known: Declarations) -> Level | None:
    """Return the level; None after an error in its tables."""
    before, after = known.owners.laid_out(written.preprocess), known.owners.laid_out(written.postprocess)
    period = _period(scope, written)
    chosen = [_chosen(scope, clause, set(known.tables)) for clause in written.tables]
    clauses = [choice for choice in chosen if choice is not None]
    if len(clauses) < len(written.tables) or not _each_once(scope, written):
        return None
    for clause, choice in zip(written.tables, clauses, strict=True):
        if isinstance(choice, TableByCommand):
            assert clause.selector is not None
            runs = [known.tables[name] for name in choice.names]
            _stays(scope, choice, clause.selector.span, _written(runs, after, known.procedures))
    ordered = _in_order(scope, written, clauses, known)
    if ordered is None:
        return None
    *stages, last = ordered
    doc = " ".join(written.doc)
    return Level(written.name.text, period, before, last, after, doc, written.name.span, tuple(stages))


def periods(scope: Scope, levels: Iterable[tree.LevelDecl]) -> tuple[tuple[int, ...], frozenset[str]]:
    """Return the periods of levels in ms, each once, ascending; and the names of the tables that they run."""
    every = list(levels)
    named = (name for written in every for name in _named(written))
    return tuple(sorted({_period(scope, written) for written in every})), frozenset(named)


def _named(written: tree.LevelDecl) -> Iterator[str]:
    for clause in written.tables:
        if clause.table is not None:
            yield clause.table.text
        yield from (dispatch.table.text for dispatch in clause.dispatch)


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


def _chosen(scope: Scope, written: tree.TableClause, tables: set[TableName]) -> TableChoice | None:
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
        for line in table.every_line:
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
    """Return whether every value of the selector has a table; report the least value without one, and the number of others."""
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


# --- several tables of one cycle --------------------------------------------------------


def _each_once(scope: Scope, written: tree.LevelDecl) -> bool:
    """Return whether no table stands in two clauses; report the second place."""
    first: dict[str, tuple[int, Span]] = {}
    sound = True
    for at, clause in enumerate(written.tables):
        names = [dispatch.table for dispatch in clause.dispatch] if clause.table is None else [clause.table]
        for name in names:
            place, span = first.setdefault(name.text, (at, name.span))
            if place != at:
                message = f"table `{name.text}` would run twice in a cycle of level `{written.name.text}`"
                scope.report(Code.DUPLICATE_NAME, message, name.span, related=(Label(span, "here first"),))
                sound = False
    return sound


@dataclass(frozen=True, slots=True)
class _Touched:
    """The leaves that one clause of a level touches: each with the first table that reads it, or with the one that writes it."""

    reads: Mapping[str, str]
    writes: Mapping[str, str]


def _in_order(
    scope: Scope, written: tree.LevelDecl, clauses: Sequence[TableChoice], known: Declarations
) -> list[TableChoice] | None:
    """Order the clauses so that each follows those that write what it reads; else single tables as declared, then choices.

    None after an error: two that write one leaf, or that wait for each other.
    """
    if len(clauses) == 1:
        return list(clauses)
    place = {name: at for at, name in enumerate(known.tables)}
    left = sorted(
        clauses,
        key=lambda choice: (isinstance(choice, TableByCommand), min(place[name] for name in choice.names)),
    )
    touched = [_touched(choice, known) for choice in left]
    sound = _one_writer(scope, written, touched)
    waits = {
        at: {
            other: min(shared)
            for other, writer in enumerate(touched)
            if other != at and (shared := writer.writes.keys() & reader.reads.keys())
        }
        for at, reader in enumerate(touched)
    }
    ordered: list[int] = []
    while len(ordered) < len(left):
        ready = (at for at in waits if at not in ordered and not waits[at].keys() - ordered)
        following = next(ready, None)
        if following is None:
            _circle(scope, written, touched, {at: waits[at] for at in waits if at not in ordered})
            return None
        ordered.append(following)
    return [left[at] for at in ordered] if sound else None


def _touched(choice: TableChoice, known: Declarations) -> _Touched:
    """Return the leaves that a clause reads (in its selector, tests, actions and assumptions) and those that it writes."""
    reads: dict[str, str] = {}
    writes: dict[str, str] = {}
    if isinstance(choice, TableByCommand):
        reads |= dict.fromkeys(map(str, read_by(choice.selector)), str(choice.names[0]))
    for name in choice.names:
        table = known.tables[name]
        actions = [action.statement for line in table.every_line for action in line.actions]
        read, write = touched(actions, known.procedures)
        told = [known.assumptions[own].condition for own in table.assumptions if own in known.assumptions]
        every = {*table.variables, *read, *(leaf for condition in told for leaf in read_by(condition))}
        reads |= {str(leaf): str(name) for leaf in sorted(every) if leaf not in reads}
        writes |= {str(leaf): str(name) for leaf in sorted(write) if leaf not in writes}
    return _Touched(reads, writes)


def _one_writer(scope: Scope, written: tree.LevelDecl, touched: Sequence[_Touched]) -> bool:
    """Return whether no two clauses write one leaf; report the first shared leaf of each pair of tables."""
    known: dict[tuple[str, str], str] = {}
    writers: dict[str, str] = {}
    for part in touched:
        for leaf, table in part.writes.items():
            other = writers.setdefault(leaf, table)
            if other != table:
                known.setdefault((other, table), leaf)
    for (other, table), leaf in known.items():
        scope.report(
            Code.TWO_TABLES_WRITE,
            f"tables `{other}` and `{table}` both write `{leaf}` in one cycle of level `{written.name.text}`",
            written.name.span,
            "let one table write it, or choose between the two: `table by SELECTOR { ... }`",
        )
    return not known


def _circle(
    scope: Scope, written: tree.LevelDecl, touched: Sequence[_Touched], waits: Mapping[int, Mapping[int, str]]
) -> None:
    """Report the shortest cycle of clauses that wait for each other; each clause given waits for another of them."""
    circle = shortest_circle({at: [other for other in waits[at] if other in waits] for at in waits})
    words = []
    for reader, writer in pairwise(circle):
        leaf = waits[reader][writer]
        words.append(
            f"`{touched[reader].reads[leaf]}` reads `{leaf}`, which `{touched[writer].writes[leaf]}` writes"
        )
    scope.report(
        Code.TABLE_CYCLE,
        f"the tables of level `{written.name.text}` wait for each other: {'; '.join(words)}",
        written.name.span,
        f"one of them reads what the cycle before left: `was {leaf}`",
    )


def lines_kept(scope: Scope, levels: Iterable[Level], tables: Iterable[Table], file: str) -> tuple[Enum, ...]:
    """Declare, for each table that runs before another, the state that holds its line of this cycle; return the types of these states.

    Only properties can name it: it is made after all else is resolved.
    """
    staged = {name for level in levels for name in level.staged}
    return tuple(_line_kept(scope, table, file) for table in tables if table.name in staged)


def _members(lines: Sequence[str]) -> Iterator[str]:
    """Yield a member for "none of the lines", and one for each line: its name, or `line_1` where that is a number."""
    taken = set(lines)

    def free(word: str) -> str:
        name = free_name(word, taken)
        taken.add(name)
        return name

    yield free("none")
    yield from (free(f"line_{line}") if line[0].isdigit() else line for line in lines)


def _line_kept(scope: Scope, table: Table, file: str) -> Enum:
    none, *lines = _members([str(line.name) for line in table.every_line])
    name = fresh(scope, f"line_of_{table.name}")
    kind = Enum(name, (none, *lines), file)
    leaf, doc = (
        VariableName(name),
        f"the line of table {table.name} in this cycle; {none} where it did not run",
    )
    scope.leaves[leaf] = Variable(leaf, Kind.STATE, kind, 0, doc=doc, span=table.span, line_of=table.name)
    scope.kept.append(Declared(name, Kind.STATE, kind, (leaf,), doc, table.span))
    scope.declared[name] = scope.kept[-1]
    scope.types[name] = kind
    for member in kind.members:
        scope.members.setdefault(member, []).append(kind)
    return kind
