"""What is not shown, gathered by cause, as diagnostics.

In: failures and where they arose. Out: one diagnostic a place and kind, with at most three witnesses.
"""

from dataclasses import dataclass, field

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, WitnessColumn
from rcsc.base.diagnostics.source import Span
from rcsc.lang.model import spell
from rcsc.proof.procedures.discharge import Discharge, Failure

MOST_WITNESSES = 3

_PATIENCE = ("give each query more steps with `--steps`, or narrow the declared ranges",)
_HELP: dict[Code, tuple[str, ...]] = {
    Code.OVERFLOW: ("narrow the declared ranges, or guard the operation with `if`",),
    Code.DIVISION_BY_ZERO: ("guard the division with `if`, or exclude zero from the divisor's range",),
    Code.INDEX: ("guard the access with `if`, or narrow the index's range",),
    Code.ASSIGNED_RANGE: (
        "guard the assignment with `if`, use `min` or `max`, or widen the variable's range",
    ),
    Code.USE_BEFORE_ASSIGNMENT: ("give the local a first value where it is declared",),
    Code.TWO_WRITERS: (
        "let one action of the line write it: a procedure that does both in the order that is meant",
    ),
    Code.ASSUMPTION_NOT_PROVED: ("declare it `assumed` or `monitored`",),
    Code.INVARIANT_BROKEN: ("mend what runs there, or strengthen the invariant if that state cannot occur",),
}


@dataclass(slots=True)
class Cause:
    """One place and what can go wrong there, in every context where it can; reported at `there`, if set."""

    failures: list[Failure] = field(default_factory=list)
    where: list[tuple[str, str]] = field(default_factory=list)  # note, table
    there: Span | None = None


def diagnostic(code: Code, span: Span, message: str, cause: Cause) -> Diagnostic:
    """Return one cause as a diagnostic."""
    span = cause.there or span
    failing = [
        (failure, place)
        for failure, place in zip(cause.failures, cause.where, strict=True)
        if failure.outcome is Discharge.FAILS
    ]
    if not failing:
        undecided = f"could not be decided whether this holds: {message}"
        return Diagnostic(Code.UNDECIDED, undecided, Label(span), help=_PATIENCE)
    columns = tuple(
        WitnessColumn(
            table,
            tuple(variable.name for variable, _ in failure.witness),
            tuple(spell(variable.type, value) for variable, value in failure.witness),
        )
        for failure, (_, table) in failing[:MOST_WITNESSES]
        if failure.witness
    )
    notes = tuple(dict.fromkeys(where for _, (where, _) in failing if where))[:MOST_WITNESSES]
    more = max(0, len(failing) - MOST_WITNESSES)
    return Diagnostic(code, message, Label(span), (), notes, _HELP.get(code, ()), columns, more)
