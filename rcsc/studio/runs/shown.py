"""A moment of a run, as pages draw it.

In: a history and a tick. Out: JSON: of every level its table and line, what it was ordered and reported, what it ordered and saw.
"""

from dataclasses import asdict
from typing import Any

from rcsc.run.log.states import line_of
from rcsc.run.log.ticks import LevelTick, other_ends, tick_of
from rcsc.run.signature import Signature, Values
from rcsc.studio.runs.history import History


def moment(history: History, tick: int) -> dict[str, Any]:
    """Return a tick; a level that had no cycle in it stands at the line of its last."""
    log = history.ran_at(tick)
    shown = tick_of(log, tick, other_ends(log.system().wires))
    levels = []
    for box, logged in zip(shown.boxes, log.levels, strict=True):
        values = logged.track.latest(tick) or ()
        said = _box(box)
        if not box.ran:
            line = line_of(logged.sign, logged.level, values)
            said |= {"table": logged.sign.table_of(logged.level, values), "lines": [line] if line else []}
        levels.append(said | {"now": _named(logged.sign, values)})
    return {"tick": tick, "levels": levels}


def _named(sign: Signature, values: Values) -> dict[str, str]:
    """The member that each state variable of an enumeration has after the cycle, for who draws states."""
    return {
        leaf.name: leaf.members[int(value)]
        for leaf, value in zip(sign.leaves, values, strict=False)  # values go on with the trace
        if leaf.kind == "state" and 0 <= int(value) < len(leaf.members)
    }


def _box(box: LevelTick) -> dict[str, Any]:
    """The same as plain values, with what two numbers say of each other."""
    said = asdict(box)
    said["above"] = [
        {"order": order and asdict(order), "report": report and {**asdict(report), "matches": report.matches}}
        for order, report in box.above
    ]
    said["below"] = [
        {"report": report and {**asdict(report), "matches": report.matches}, "order": order and asdict(order)}
        for report, order in box.below
    ]
    return said
