"""Tables: columns, lines, tests and actions, and the order in which a line's cells run."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.conditions import Tests
from rcsc.lang.expressions.operators import Typed
from rcsc.lang.expressions.placing import placed, placed_statement
from rcsc.lang.expressions.scope import INMODE, Body, Scope
from rcsc.lang.expressions.typed import Path, typed
from rcsc.lang.leaves import expressions, may_write, reads_of
from rcsc.lang.model import (
    Action,
    Assign,
    AssumptionName,
    Column,
    Default,
    Line,
    LineName,
    Printed,
    Procedure,
    Read,
    Statement,
    Table,
    TableName,
    Test,
    ToElement,
    ToLeaf,
    VariableName,
)
from rcsc.lang.resolve.declarations import requirements
from rcsc.lang.resolve.precedence import with_precedence
from rcsc.lang.resolve.statements import Statements
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import ACTION_WORDS, Bounds, Cell
from rcsc.lang.syntax.turned import places, unsaid, unsaid_places


def table(scope: Scope, written: tree.TableDecl) -> Table:
    """Resolve the table, and report what is wrong with it."""
    written = replace(written, rows=tuple(_in_its_mode(scope, written, row) for row in written.rows))
    subjects = tuple(_subject(scope, heading) for heading in written.conditions)
    columns = tuple(
        _column(heading, subject) for heading, subject in zip(written.conditions, subjects, strict=True)
    )
    headings = tuple(column.heading for column in columns)
    cells = _Cells(scope, written, Tests(scope, written.conditions, subjects, headings))
    lines: list[Line] = []
    default: Default | None = None
    names: dict[str, tree.Row] = {}
    for row in written.rows:
        name_span = row.cells[0].span
        if row.name in names:
            scope.report(
                Code.DUPLICATE_LINE,
                f"two lines are called `{row.name}`",
                name_span,
                related=(Label(names[row.name].cells[0].span, "the first"),),
            )
        names.setdefault(row.name, row)
        if not row.default:
            lines.append(
                Line(
                    LineName(row.name),
                    cells.tests(row),
                    cells.actions(row),
                    row.span,
                    Bounds(row.cells),
                    requirements=requirements(scope, row.requirements),
                )
            )
        elif default is not None:
            scope.report(Code.SEVERAL_DEFAULTS, "a table has at most one DEFAULT line", name_span)
        else:
            default = Default(
                LineName(row.name),
                cells.actions(row),
                row.unreachable,
                row.cells[1].span,
                requirements(scope, row.requirements),
            )
    unmatched = () if written.turned is None or default is not None else unsaid(written.turned)
    missing = [
        _in_its_mode(scope, written, row) for row in unmatched
    ]  # kept: tests are known by what they are
    empty = tuple(
        Line(LineName(row.name), cells.tests(row), (), row.span, Bounds(row.cells)) for row in missing
    )
    columns, resolved, meetings = with_precedence(scope, written, columns, tuple(lines))
    read = {name for line in resolved for test in line.stated for name in test.variables}
    return Table(
        TableName(written.name.text),
        columns,
        resolved,
        default,
        tuple(VariableName(name) for name in scope.leaves if name in read),
        tuple(AssumptionName(name.text) for name in written.assuming),
        " ".join(written.doc),
        written.name.span,
        written.span.file,
        meetings=meetings,
        requirements=requirements(scope, written.requirements),
        turned=None if written.turned is None else _printed(written.turned),
        unsaid=empty,
    )


def _printed(turned: tree.Turned) -> Printed:
    """Return how a turned table is printed."""
    return Printed(
        turned.giving.cell.text,
        "" if turned.by is None else turned.by.cell.text,
        turned.named,
        len(turned.conditions),
        tuple(row.name for row in turned.rows if not row.default),
        tuple(across.name for across in turned.across),
        tuple(across.place.text for across in turned.across),
        tuple(f"when {across.cell.text}" if across.whole else across.cell.text for across in turned.across),
        tuple(places(turned)),
        tuple(unsaid_places(turned)),
    )


def _in_its_mode(scope: Scope, written: tree.TableDecl, row: tree.Row) -> tree.Row:
    """Return a row with `inmode` written out, in conditions that stand by themselves: as what the row says in its first column.

    A variable, constant or member of that name goes before it.

    Source: Heitmeyer, Jeffords and Labaw, "Automated consistency checking of requirements specifications", ACM TOSEM 5(3), 1996:
    `@T(Inmode)` in a row of an event table is the event that the system enters the row's modes.
    """
    alone = [at for at, heading in enumerate(written.conditions) if heading.subject is None]
    said = {at for at in alone if at + 1 < len(row.cells) and INMODE in row.cells[at + 1].text}
    if not said:
        return row
    first, mode = written.conditions[0], row.conditions[0]
    taken = INMODE in scope.declared or INMODE in scope.constants or INMODE in scope.members
    if mode is None or first.subject is None or taken:
        return row
    told = tree.term(first, mode)
    conditions = tuple(
        _with_mode(condition, told) if at in said else condition
        for at, condition in enumerate(row.conditions)
    )
    return replace(row, conditions=conditions)


def _with_mode(node: Any, mode: tree.Expr) -> Any:
    """Return syntax with `mode` wherever it says `inmode`, and in its place; what does not say it is kept as the same object."""
    if isinstance(node, tree.Reference) and node.name.text == INMODE:
        return _standing_at(mode, node.span)
    return _with_parts(node, lambda part: _with_mode(part, mode))


def _standing_at(node: Any, span: Span) -> Any:
    """Return syntax of which every part stands at one place."""
    return span if isinstance(node, Span) else _with_parts(node, lambda part: _standing_at(part, span))


def _with_parts(node: Any, change: Callable[[Any], Any]) -> Any:
    """Return syntax with each of its parts changed."""
    if isinstance(node, tuple):
        parts = tuple(map(change, node))
        return node if all(new is old for new, old in zip(parts, node, strict=True)) else parts
    if not is_dataclass(node) or isinstance(node, type):
        return node
    every = ((each.name, getattr(node, each.name)) for each in fields(node))
    changed = {name: new for name, old in every if (new := change(old)) is not old}
    return replace(node, **changed) if changed else node


def _subject(scope: Scope, heading: tree.Heading) -> Typed | None:
    """Resolve the subject of a column; None under `when`, and after an error."""
    if heading.subject is None:
        return None
    scope.cell = heading.cell
    subject = typed(scope, Body(), heading.subject)
    scope.cell = None
    return None if subject is None else Typed(placed(subject.expr, heading.cell), subject.bare)


def _column(heading: tree.Heading, subject: Typed | None) -> Column:
    expr = None if subject is None else subject.expr
    leaf = expr.name if isinstance(expr, Read) else None
    return Column(" ".join(heading.cell.text.split()), expr, leaf, heading.cell.span)


class _Cells:
    """Reads the cells of one table's rows; each distinct cell once."""

    def __init__(self, scope: Scope, written: tree.TableDecl, tests: Tests) -> None:
        self.scope = scope
        self.known = tests
        self.headings = [heading.cell.text for heading in written.actions]
        self.places = [self._place(heading) for heading in written.actions]
        self.resolved: dict[tuple[int, int], list[tuple[str, Statement]]] = {}

    def _place(self, heading: tree.Heading) -> tuple[Path, Cell] | None:
        """Resolve the target of a column of values; None for actions, and after an error."""
        if heading.subject is None:
            return None
        self.scope.cell = heading.cell
        path = Statements(self.scope).place(heading.subject, False)
        self.scope.cell = None
        return None if path is None else (path, heading.cell)

    def _subordinate(self, column: int) -> str | None:
        """Return the subordinate to which a column holds orders; None for other columns."""
        target = self.places[column]
        place = None if target is None else target[0].names
        orders = self.scope.orders.items()
        return next((name for name, (told, _) in orders if place == (f"{told}.input_command",)), None)

    def tests(self, row: tree.Row) -> tuple[Test | None, ...]:
        """Return one test for each condition column."""
        known = self.known.known
        keys = list(enumerate(map(id, row.conditions)))
        for key in keys:
            if key not in known:
                column = key[0]
                written = row.conditions[column]
                known[key] = (
                    written if written is None else self.known.test(column, written, row.cells[column + 1])
                )
        return tuple([known[key] for key in keys])

    def actions(self, row: tree.Row) -> tuple[Action, ...]:
        """Return the actions of all columns, left to right."""
        result: list[Action] = []
        for column, written in enumerate(row.actions):
            if not written:
                continue
            cell = row.cells[1 + len(row.conditions) + column]
            key = (column, id(written))
            if key not in self.resolved:
                self.scope.cell = cell
                self.resolved[key] = self._actions(column, written, cell.text)
                self.scope.cell = None
            heading = self.headings[column]
            for text, statement in self.resolved[key]:
                result.append(Action(heading, text, placed_statement(statement, cell), column))
        return tuple(result)

    def _actions(
        self, column: int, written: tuple[tree.Statement, ...] | tree.Comparison, text: str
    ) -> list[tuple[str, Statement]]:
        statements = Statements(self.scope)
        if isinstance(written, tree.Comparison):
            target = self.places[column]
            if target is None:
                return []
            subordinate = self._subordinate(column)
            if isinstance(written.value, tree.Order) and subordinate is not None:
                return [(text, each) for each in statements.order(subordinate, written.value, written.span)]
            path, heading = target
            if path.index is not None:  # with its span in the file
                path = Path(path.names, path.type, placed(path.index, heading))
            return [(text, action) for action in statements.store(path, written.value, False, written.span)]
        pieces = [piece.strip() for piece in text.split(";")]
        actions: list[tuple[str, Statement]] = []
        for at, action in enumerate(written):
            piece = pieces[at] if len(pieces) == len(written) else text
            actions.extend((piece, statement) for statement in statements.block((action,)))
        return actions


# --- in sequence ---------------------------------------------------------------------
# The cells of a line run from left to right, and one that reads what an earlier one wrote is an error: a variable means the new value there
# where people mean the old. `mode | saved` with `circle | mode` would save the new mode. To let all cells read what stood before the line
# would part cells from the procedures that they call, which read what stands when they run, and would change what tables mean that are
# proved and in use. So neither is chosen in silence. Told is what stands in the cell: the value, the index, the arguments. Not told is what
# follows `;` in the same cell, nor what a called procedure reads: both say that one thing runs after another. A cell that writes a variable
# back as it is changes nothing.


def in_sequence(scope: Scope, tables: Iterable[Table], procedures: Iterable[Procedure]) -> None:
    """Report the cells that read a variable which an earlier cell of their line may have written."""
    known = {str(procedure.name): procedure for procedure in procedures}
    for table in tables:
        for line in table.every_line:
            _line_in_sequence(scope, line.actions, known)


def _line_in_sequence(scope: Scope, actions: tuple[Action, ...], procedures: Mapping[str, Procedure]) -> None:
    written: dict[VariableName, Action] = {}
    for action in actions:
        for name, span in _read(action.statement):
            by = written.get(name)
            if by is not None and by.column != action.column:
                later = may_write((action.statement,), procedures)
                crossed = any(each in later for each, _ in _read(by.statement))
                _report(scope, name, span, by, action, crossed)
                return
        if not _nothing(action.statement):
            written |= dict.fromkeys(may_write((action.statement,), procedures), action)


def _read(statement: Statement) -> list[tuple[VariableName, Span]]:
    """Return the leaves that the cell itself reads, with their places; not those that a called procedure reads."""
    return [
        (name, span) for expr in expressions(statement) for names, span in reads_of(expr) for name in names
    ]


def _nothing(statement: Statement) -> bool:
    """Return whether the statement writes a variable back unchanged."""
    match statement:
        case Assign(ToLeaf(name=name), Read(name=read)):
            return name == read
        case _:
            return False


def _report(scope: Scope, name: VariableName, span: Span, by: Action, action: Action, crossed: bool) -> None:
    message = f"`{action.text}` under `{action.heading}` reads `{name}`, which `{by.text}` under `{by.heading}` has written"
    if crossed:
        old = "to mean the values before the line, call a procedure that keeps one of them in a local"
    else:
        old = f"to mean the value before the line, let column `{action.heading}` stand left of column `{by.heading}`"
    both = [_spelled(by), _spelled(action)]
    if None in both:
        new = "to mean the new value, call a procedure that does both in this order"
    else:
        new = (
            f"to mean the new value, write both in one cell under `procedures`: `{'; '.join(map(str, both))}`"
        )
    written = Label(by.statement.span, "written here")
    scope.report(Code.READ_AFTER_WRITE, message, span, old, new, related=(written,))


def _spelled(action: Action) -> str | None:
    """Return the action as it is written among others in one cell; None for an order to a subordinate."""
    if action.heading in ACTION_WORDS:
        return action.text
    match action.statement:
        case Assign(ToLeaf(name=name)) if name == action.heading:
            return f"{action.heading} := {action.text}"
        case Assign(ToElement(leaves=leaves)) if leaves[0].startswith(action.heading.partition("[")[0]):
            return f"{action.heading} := {action.text}"
        case _:
            return None
