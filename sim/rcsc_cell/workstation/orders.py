"""The buffers of the vise and the machine, which no level has: their names, what they hold, and what it means.

Orders in them are numbered as those to a level are (`rcsc.run.orders.numbered`).
"""

from rcsc.run.signature import Values

VISE_ORDER = "workstation.vise"
"""number, right_open, left_open: how each jaw is to stand."""
VISE_REPORT = "vise.report"
"""echo, status, right_mm, left_mm: where each jaw stands, from where it touches a part; open is positive."""
MACHINE_ORDER = "workstation.machine"
"""number, operation: from 1 in the order of `rcsc_cell.workstation.script.MACHINE`; 0 is none."""
MACHINE_REPORT = "machine.report"
"""echo, status."""
BETWEEN = (VISE_ORDER, VISE_REPORT, MACHINE_ORDER, MACHINE_REPORT)
"""Buffers that have no level at either end."""

KINDS = {
    VISE_ORDER: tuple[int, bool, bool], VISE_REPORT: tuple[int, int, float, float],
    MACHINE_ORDER: tuple[int, int], MACHINE_REPORT: tuple[int, int],
}  # fmt: skip
"""What each of them holds."""

DONE, EXECUTING, FAILED = 0, 1, 2
"""`level_status` of tables/vocabulary.rcs: how it stands in every report, the robot's too."""
OPEN_MM = 19.0
"""An open jaw stands farther out than this."""
CLOSED_MM = 3.0
"""A closed jaw stands nearer than this: it has met the part, or its stop."""


def ajar(report: Values, *, right_open: bool, left_open: bool) -> str:
    """Return which jaw does not stand as it should, and its place; empty when both do."""
    for jaw, opened, at_mm in (("right", right_open, report[2]), ("left", left_open, report[3])):
        if not (at_mm > OPEN_MM if opened else at_mm < CLOSED_MM):
            return f"the {jaw} jaw did not {'open' if opened else 'close'}: it stands at {at_mm:.1f} mm"
    return ""
