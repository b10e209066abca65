"""Tables: columns, lines, tests and actions."""

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.lang.expressions.conditions import Tests
from rcsc.lang.expressions.operators import Typed
from rcsc.lang.expressions.placing import placed, placed_statement
from rcsc.lang.expressions.scope import Body, Scope
from rcsc.lang.expressions.typed import Path, typed
from rcsc.lang.model import (
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
from rcsc.lang.resolve.declarations import requirements
from rcsc.lang.resolve.precedence import with_precedence
from rcsc.lang.resolve.statements import Statements
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import Bounds, Cell


def table(scope: Scope, written: tree.TableDecl) -> Table:
    """Resolve the table, and report what is wrong with it."""
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
    columns, resolved, meetings = with_precedence(scope, written, columns, tuple(lines))
    read = {name for line in resolved for test in line.tests if test is not None for name in test.variables}
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
    )


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
            path = replaced(target[0], target[1])
            return [(text, action) for action in statements.store(path, written.value, False, written.span)]
        pieces = [piece.strip() for piece in text.split(";")]
        actions: list[tuple[str, Statement]] = []
        for at, action in enumerate(written):
            piece = pieces[at] if len(pieces) == len(written) else text
            actions.extend((piece, statement) for statement in statements.block((action,)))
        return actions


def replaced(path: Path, heading: Cell) -> Path:
    """Return the path with the spans of its index in the file."""
    return path if path.index is None else Path(path.names, path.type, placed(path.index, heading))
