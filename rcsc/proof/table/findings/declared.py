"""Declarations that may not mean what their author meant: warnings, by position, of a whole program.

In: a program. Out: a warning for each variable of which nothing says with what it starts.
"""

from collections.abc import Iterator

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.lang.model import Int, Program, Real, Variable, spell


def declared_badly(program: Program) -> Iterator[Diagnostic]:
    """Yield a warning for each declared variable of which nothing says with what it starts."""
    leaves = {variable.name: variable for variable in program.variables}
    for declared in program.declared:
        unsaid = next((leaf for name in declared.leaves if _starts_unsaid(leaf := leaves[name])), None)
        if unsaid is not None:
            yield _no_start(unsaid)


def _starts_unsaid(leaf: Variable) -> bool:
    kind = leaf.type
    hidden = leaf.previous_of is not None or leaf.line_of is not None
    return not leaf.given and not hidden and isinstance(kind, Int | Real) and not kind.low <= 0 <= kind.high


def _no_start(leaf: Variable) -> Diagnostic:
    kind = leaf.type
    assert isinstance(kind, Int | Real)
    value = spell(kind, leaf.initial)
    ends = f"{spell(kind, kind.low)} .. {spell(kind, kind.high)}"
    message = f"nothing says with what `{leaf.name}` starts: 0 is not in {ends}, so that it is {value}"
    part = leaf.name.rpartition(".")[2].partition("[")[0] if "." in leaf.name else ""
    where = f"the type of field `{part}`" if part else "its type"
    help_ = f"write what is meant after {where}, such as `= {value}`"
    return Diagnostic(Code.NO_START, message, Label(leaf.span), help=(help_,), severity=Severity.WARNING)
