"""A moment of a run, as pages draw it.

In: a history and a tick. Out: JSON: of every level its table and line, what it was ordered and reported, what it ordered and saw.
"""

from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from rcsc.desk.studio.runs.history import History
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.log.ticks import LevelTick, Reported, level_tick, other_ends
from rcsc.run.signature import Signature, Values

MOST_KNOWN = 20_000
"""Cycles of levels that are kept as they were shown."""


def moment(history: History, tick: int) -> dict[str, Any]:
    """Return a tick; a level that had no cycle in it stands at the line of its last."""
    return Shown().moment(history, tick)


@dataclass(slots=True)
class Shown:
    """Moments of a run; a cycle that comes again, from the same state to the same, is computed once.

    Attributes:
        known: By log, level, and the states before and after the cycle; the log is kept, so that its number stays its own.
    """

    known: dict[tuple[int, str, bytes, bytes], tuple[Log, dict[str, Any]]] = field(default_factory=dict)
    _log: Log | None = None
    _wires: dict[str, str] = field(default_factory=dict)

    def moment(self, history: History, tick: int) -> dict[str, Any]:
        """Return a tick, as `moment` does."""
        log = history.ran_at(tick)
        if self._log is not log:
            self._log, self._wires = log, other_ends(log.system().wires)
        return {"tick": tick, "levels": [self._level(log, logged, tick) for logged in log.levels]}

    def _level(self, log: Log, logged: LoggedLevel, tick: int) -> dict[str, Any]:
        track = logged.track
        at = track.place(tick)
        alone = (
            at < 1 or track.ticks[at] != tick or log.finding is not None or logged.restarted(at) is not None
        )
        if alone:
            return _said(level_tick(log, logged, tick, self._wires), logged, tick)
        key = id(log), logged.name, track.packed[at - 1], track.packed[at]
        if key not in self.known:
            if len(self.known) >= MOST_KNOWN:
                self.known.clear()
            self.known[key] = log, _said(level_tick(log, logged, tick, self._wires), logged, tick)
        return self.known[key][1]


def _said(box: LevelTick, logged: LoggedLevel, tick: int) -> dict[str, Any]:
    values = logged.track.latest(tick) or ()
    said: dict[str, Any] = _plain(box)
    if not box.ran:
        line = logged.sign.line_of(logged.level, values)
        said |= {"table": logged.sign.table_of(logged.level, values), "lines": [line] if line else []}
    said["above"] = [{"order": order, "report": report} for order, report in said["above"]]
    said["below"] = [{"report": report, "order": order} for report, order in said["below"]]
    return said | {"now": _named(logged.sign, values)}


def _named(sign: Signature, values: Values) -> dict[str, str]:
    """Return the member that each state variable of an enumeration has after the cycle, for drawings of states."""
    return {
        leaf.name: leaf.members[int(value)]
        for leaf, value in zip(sign.leaves, values, strict=False)  # values go on with the trace
        if leaf.kind == "state" and 0 <= int(value) < len(leaf.members)
    }


def _plain(part: Any) -> Any:
    """Return the same as plain values, with the comparison of a report's two numbers."""
    if isinstance(part, tuple):
        return [_plain(one) for one in part]
    if not is_dataclass(part):
        return part
    said = {each.name: _plain(getattr(part, each.name)) for each in fields(part)}
    return said | {"matches": part.matches} if isinstance(part, Reported) else said
