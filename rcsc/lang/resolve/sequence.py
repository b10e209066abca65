"""The cells of a line run from left to right, and one that reads what an earlier one wrote is an error.

In: resolved tables and procedures. Out: a report for each cell in which a variable means the new value where people mean the old.

`mode | saved` with `circle | mode` would save the new mode. To let all cells read what stood before the line would part cells from
the procedures that they call, which read what stands when they run, and would change what tables mean that are proved and in use. So
neither is chosen in silence. Told is what stands in the cell: the value, the index, the arguments. Not told is what follows `;` in
the same cell, nor what a called procedure reads: both say that one thing runs after another. A cell that writes a variable back as it is
changes nothing.
"""

from collections.abc import Iterable, Mapping

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.leaves import expressions, may_write, reads_of
from rcsc.lang.model import (
    Action,
    Assign,
    Procedure,
    Read,
    Statement,
    Table,
    ToElement,
    ToLeaf,
    VariableName,
)
from rcsc.lang.syntax.rows import ACTION_WORDS


def in_sequence(scope: Scope, tables: Iterable[Table], procedures: Iterable[Procedure]) -> None:
    """Report the cells that read a variable which an earlier cell of their line may have written."""
    known = {str(procedure.name): procedure for procedure in procedures}
    for table in tables:
        for line in table.every_line:
            _line(scope, line.actions, known)


def _line(scope: Scope, actions: tuple[Action, ...], procedures: Mapping[str, Procedure]) -> None:
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
