"""A run, as pages draw it: a moment of it, and which line each level ran when.

In: a history. Out: JSON: of every level at a tick its table and line, what it was ordered and reported, what it ordered and saw; by level
every tick from which on it ran another line, so many ticks at a time that nobody waits long for them.
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


# --- lines over time ---

MOST_CHANGES = 20_000
"""Changes of lines that one answer has, of all levels."""
MOST_RECORDS = 12_000
"""Cycles of levels that are looked at for one answer: a tenth of a second."""
MOST_STATES = 50_000
"""States of levels of which the line is kept."""

Stand = tuple[str, str, str]
"""Table, line and fault of a level."""
Changes = dict[str, list[list[Any]]]
"""By level: a tick, and what stands from then on."""


@dataclass(slots=True)
class Lines:
    """The line that each state of a level stands for, found once a state.

    Attributes:
        known: By signature and state; the signature is kept, so that its number stays its own.
    """

    known: dict[tuple[int, bytes], tuple[Signature, Stand]] = field(default_factory=dict)

    def of(self, logged: LoggedLevel, content: bytes) -> Stand:
        """Return table, line and fault of a record."""
        key = id(logged.sign), content
        if key not in self.known:
            if len(self.known) > MOST_STATES:
                self.known.clear()
            self.known[key] = logged.sign, _stand(logged, logged.track.layout.unpack(content))
        return self.known[key][1]

    def changes(self, history: History, since: int) -> tuple[Changes, int]:
        """Return, by level, each tick after one with the line that ran from then on, and the tick up to which that is known.

        Args:
            history: Of the run.
            since: Up to which tick it is known already; -1 for none.
        """
        levels: Changes = {}
        ticks = max(1, MOST_RECORDS // len(history.logs[-1].levels))
        to = min(history.last, max(since, history.first) + ticks)
        for log in history.logs:
            for logged in log.levels:
                changes = levels.setdefault(logged.name, [])
                self._add(logged, since, to, changes)
                if len(changes) > MOST_CHANGES:
                    to = min(to, changes[MOST_CHANGES][0])
        return {name: [one for one in changes if one[0] <= to] for name, changes in levels.items()}, to

    def within(self, history: History, first: int, last: int) -> Changes:
        """Return, by level, the line at a tick, and every change after it up to another."""
        levels: Changes = {}
        for logged in history.ran_at(first).levels:
            place = logged.track.place(first)
            stand = self.of(logged, logged.track.packed[place]) if place >= 1 else ("", "", "")
            levels[logged.name] = [[first, *stand]]
        for log in history.logs:
            for logged in log.levels:
                self._add(logged, first, last, levels.setdefault(logged.name, []))
        return levels

    def _add(self, logged: LoggedLevel, since: int, to: int, changes: list[list[Any]]) -> None:
        """Append each change of a level's line after a tick; the first record is its initial state, and no cycle."""
        track = logged.track
        place = track.place(since)
        last = changes[-1][1:] if changes else None
        if place >= 1:
            last = [*self.of(logged, track.packed[place])]
        elif last is None and place < 0:
            last = ["", "", ""]
            changes.append([track.ticks[0], *last])
        for at in range(max(1, place + 1), track.place(to) + 1):
            stand = [*self.of(logged, track.packed[at])]
            if stand != last:
                changes.append([track.ticks[at], *stand])
                last = stand


def _stand(logged: LoggedLevel, values: Values) -> Stand:
    fault = logged.sign.fault_word(values)
    return (
        logged.sign.table_of(logged.level, values),
        logged.sign.line_of(logged.level, values),
        "" if fault == "none" else logged.sign.fault_text(values),
    )
