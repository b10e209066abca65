"""Which line each level ran, over the ticks of a run: what a time line is drawn of.

In: a history. Out: by level every tick from which on it ran another line, so many ticks at a time that nobody waits long for them.
"""

from dataclasses import dataclass, field
from typing import Any

from rcsc.desk.studio.runs.history import History
from rcsc.run.log.read import LoggedLevel
from rcsc.run.signature import Signature, Values

MOST_CHANGES = 20_000
"""Changes of lines that one answer has, of all levels."""
MOST_RECORDS = 12_000
"""Cycles of levels that are looked at for one answer: a tenth of a second."""
MOST_KNOWN = 50_000

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
            if len(self.known) > MOST_KNOWN:
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
