"""Tables: columns, lines, tests and actions."""

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.model import (
    Action,
    AssumptionName,
    Column,
    Default,
    Line,
    LineName,
    Read,
    Statement,
    Table,
    TableName,
    Test,
    VariableName,
)
from rcsc.resolve.conditions import Tests
from rcsc.resolve.expressions import typed
from rcsc.resolve.scope import Body, Scope
from rcsc.resolve.statements import Statements
from rcsc.source import Sources, Span
from rcsc.syntax import tree


def table(scope: Scope, written: tree.TableDecl, sources: Sources) -> Table:
    """The table; what is wrong with it has been reported."""
    order = {name: at for at, name in enumerate(scope.leaves)}
    columns = tuple(_column(scope, heading) for heading in written.conditions)
    cells = _Cells(scope, written, sources[written.span.file].text, Tests(scope, order))
    lines: list[Line] = []
    default: Default | None = None
    names: dict[str, Span] = {}
    for row in written.rows:
        name_span = cells.span(row, 0)
        if row.name in names:
            scope.report(
                Code.DUPLICATE_LINE,
                f"two lines are called `{row.name}`",
                name_span,
                related=(Label(names[row.name], "the first"),),
            )
        names.setdefault(row.name, name_span)
        if not row.default:
            lines.append(Line(LineName(row.name), cells.tests(row), cells.actions(row), row.span, row.bounds))
        elif default is not None:
            scope.report(Code.SEVERAL_DEFAULTS, "a table has at most one DEFAULT line", name_span)
        else:
            default = Default(LineName(row.name), cells.actions(row), row.unreachable, row.span)
    read = {name for line in lines for test in line.tests if test is not None for name in test.variables}
    return Table(
        TableName(written.name.text),
        columns,
        tuple(lines),
        default,
        tuple(VariableName(name) for name in scope.leaves if name in read),
        tuple(AssumptionName(name.text) for name in written.assuming),
        " ".join(written.doc),
        written.name.span,
        written.span.file,
    )


def _column(scope: Scope, heading: tree.Heading) -> Column:
    if heading.subject is None:
        return Column("when", None, None, heading.span)
    before = len(scope.found)
    subject = typed(scope, Body(), heading.subject)
    mend(scope.found, before, heading.span)
    leaf = subject.expr.name if subject is not None and isinstance(subject.expr, Read) else None
    return Column("", None if subject is None else subject.expr, leaf, heading.span)


def mend(found: list[Diagnostic], before: int, cell: Span) -> None:
    """Moves what was reported inside a cell, where spans are relative, to the file."""
    from dataclasses import replace

    for at in range(before, len(found)):
        inner = found[at].primary.span
        if inner.file == "":
            there = tree.absolute(inner, cell.file, cell.start)
            found[at] = replace(found[at], primary=Label(there, found[at].primary.message))


class _Cells:
    """Reads the cells of one table's rows."""

    def __init__(self, scope: Scope, written: tree.TableDecl, text: str, tests: Tests) -> None:
        self.scope = scope
        self.written = written
        self.text = text
        self.known = tests
        self.broken: set[int] = set()
        self.made: dict[tuple[int, int], tuple[Action, ...]] = {}

    def span(self, row: tree.Row, cell: int) -> Span:
        """The span of a cell, counted from the line's name."""
        return Span(row.span.file, row.bounds[2 * cell], row.bounds[2 * cell + 1])

    def tests(self, row: tree.Row) -> tuple[Test | None, ...]:
        """One test a condition column."""
        known, headings = self.known, self.written.conditions
        result: list[Test | None] = []
        for column, written in enumerate(row.conditions):
            if written is None:
                result.append(None)
                continue
            key = (column, id(written))
            if key in known.known:
                result.append(known.known[key])
                continue
            span = self.span(row, column + 1)
            text = self.text[span.start : span.end]
            before = len(self.scope.found)
            result.append(known.test(column, headings[column], written, text, span))
            mend(self.scope.found, before, span)
        return tuple(result)

    def actions(self, row: tree.Row) -> tuple[Action, ...]:
        """The actions of all columns, left to right."""
        result: list[Action] = []
        for column, written in enumerate(row.actions):
            if not written:
                continue
            span = self.span(row, 1 + len(row.conditions) + column)
            before = len(self.scope.found)
            result.extend(self._actions(column, written, span))
            mend(self.scope.found, before, span)
        return tuple(result)

    def _actions(
        self, column: int, written: tuple[tree.Statement, ...] | tree.Comparison, span: Span
    ) -> tuple[Action, ...]:
        heading = self.written.actions[column]
        statements = Statements(self.scope)
        text = self.text[span.start : span.end]
        name = self.text[heading.span.start : heading.span.end]
        if isinstance(written, tree.Comparison):
            assert heading.subject is not None
            made = statements.assign(heading.subject, written.value, False, span)
            return tuple(Action(name, text, placed(one, span)) for one in made)
        pieces = [piece.strip() for piece in text.split(";")]
        result: list[Action] = []
        for at, one in enumerate(written):
            piece = pieces[at] if len(pieces) == len(written) else text
            result.extend(Action(name, piece, placed(made, span)) for made in statements.block((one,)))
        return tuple(result)


def placed(statement: Statement, cell: Span) -> Statement:
    """The statement with its span in the file."""
    from dataclasses import replace

    inner = statement.span
    if inner.file:
        return statement
    return replace(statement, span=tree.absolute(inner, cell.file, cell.start))
