"""What is known of a table, as one of four states in words: the one place that decides it, so that no two views disagree.

In: what a check says of the table, and the errors that stand in its text. Out: a `Standing`.

- *proved*: exactly one line matches every input in the declared ranges, whatever else happens.
- *rests on an assumption*: the same, as long as something holds that is not proved.
- *failed*: an error stands in the table, or it was looked at and not proved.
- *stale*: nobody has looked at it as it is now: the program that it belongs to is not in order, or is still being proved.
"""

from collections.abc import Sequence

from rcsc.base.diagnostics.report import NOT_PROVED, TableReport, Verdict, named
from rcsc.desk.editor.values import Standing, State
from rcsc.lang.model import Standing as Declared

BEING_PROVED = Standing(State.STALE, "it is being proved as it is now")
GIVEN_UP = Standing(State.FAILED, "a bug in rcsc: nothing is proved of it as it is now")
NEVER_LOOKED_AT = Standing(State.STALE, "the program that it belongs to is not in order")


def standing(report: TableReport | None, errors: Sequence[str], broken: str = "") -> Standing:
    """Return the state of a table.

    Args:
        report: What a check of the text as it is now says of the table; None where it does not come to that.
        errors: Messages of the errors that stand in the table.
        broken: The first error elsewhere, which keeps the table from being looked at.
    """
    if errors:
        more = f", and {len(errors) - 1} more" if len(errors) > 1 else ""
        return Standing(State.FAILED, f"{errors[0]}{more}")
    if report is None:
        return Standing(State.STALE, broken) if broken else NEVER_LOOKED_AT
    if report.verdict is Verdict.UNDECIDED:
        return Standing(State.FAILED, "it could not be decided")
    if report.verdict is Verdict.REFUTED:
        return Standing(State.FAILED, "not exactly one line matches every input")
    claimed = [f"`{name}` is {was}" for name, was in report.assumptions if was != Declared.PROVED.value]
    if report.verdict is Verdict.CONDITIONAL and not any(was == NOT_PROVED for _, was in report.assumptions):
        claimed.append("what is wrong elsewhere does not happen")
    if claimed:
        return Standing(State.ASSUMED, named(claimed))
    also = ", confirmed by Z3" if report.confirmed_by_z3 else ""
    return Standing(State.PROVED, f"exactly one line matches every input{also}")
