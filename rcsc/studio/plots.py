"""Curves of variables over a run, live or of a log.

In: questions of kind `plot.*`. Out: which variables there are, and each one's value wherever it changed. A number that nobody has set yet
is no value (`rcsc.run.unset`): the curve has a gap there.
"""

import math
from collections.abc import Collection, Iterator, Mapping

from rcsc.diagnostics.codes import Code
from rcsc.run.description import BadDescription, description
from rcsc.run.log.export import unset
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.signature import Value
from rcsc.shell.reload.refusal import Refused
from rcsc.studio.hub import Ask, Handler, Json
from rcsc.studio.runs.history import History
from rcsc.studio.runs.live import LANE
from rcsc.studio.runs.timeline import TimeLine

MOST_NAMES = 16
"""Variables of one question."""
MOST_POINTS = 60_000
"""Of one answer's curve; of a longer one the end is shown, and the answer says from where."""
LOOKED_AT = 20_000
"""Ticks from the first in which is looked for what nobody has set."""


class Plots:
    """Answers with curves; in the lane of the run."""

    name, lane = "plot", LANE

    def __init__(self, time: TimeLine) -> None:
        """Args: time: Which run everybody looks at."""
        self._time = time
        self._sets: tuple[object, int, dict[str, dict[int, list[int]]]] = (None, -1, {})

    @property
    def handlers(self) -> Mapping[str, Handler]:
        """By kind."""
        return {"plot.names": self._names, "plot.curves": self._curves}

    def greeting(self) -> Json:
        """Nothing that a page must know at once."""
        return {}

    def begin(self) -> None:
        """Nothing."""

    def close(self) -> None:
        """Let go of what was found."""
        self._sets = (None, -1, {})

    def _history(self) -> History:
        history = self._time.source.history
        if not history.logs:
            raise Refused(Code.STUDIO, f"no run is there: {self._time.live.why}")
        return history

    def _names(self, _: Ask) -> Json:
        """Every variable by its whole name, and those that the system's description shows, by set."""
        log = self._history().logs[-1]
        names = [
            {"name": f"{logged.name}.{leaf.name}", "unit": leaf.unit, "kind": leaf.kind}
            for logged in log.levels
            for leaf in logged.sign.leaves
        ]
        known = {each["name"] for each in names}
        return {"names": names, "displays": self._displays(known)}

    def _displays(self, known: Collection[str]) -> dict[str, list[str]]:
        """What the studio's system shows, as far as the run has it: a log may be of another system, and holds no displays."""
        try:
            sets = description(self._time.live.opening.path).displays
        except (BadDescription, OSError):
            return {}
        there = {name: [each for each in shown if each in known] for name, shown in sets.items()}
        return {name: shown for name, shown in there.items() if shown}

    def _curves(self, ask: Ask) -> Json:
        """Of each of some variables where it changed: `[tick, value]`, null for what nobody has set."""
        names = ask.body.members("names")
        if len(names) > MOST_NAMES:
            raise Refused(Code.STUDIO, f"more than {MOST_NAMES} curves")
        history = self._history()
        return {
            "era": history.era,
            "first": history.first,
            "last": history.last,
            "curves": [self._curve(history, name, ask) for name in names],
        }

    def _curve(self, history: History, name: str, ask: Ask) -> Json:
        level, _, variable = name.partition(".")
        logged = next((one for one in history.logs[-1].levels if one.name == level), None)
        if logged is None or variable not in logged.sign.index:
            raise Refused(Code.STUDIO, f"the run has no variable `{name}`")
        leaf = logged.sign.leaves[logged.sign.index[variable]]
        changes: list[list[object]] = []
        for log in history.logs:
            ask.check()
            changes += self._changes(history, log, level, variable)
        shown = changes[-MOST_POINTS:]
        return {
            "name": name,
            "unit": leaf.unit,
            "members": list(leaf.members) or (["false", "true"] if leaf.c_type == "bool" else []),
            "from": shown[0][0] if shown else history.first,
            "changes": shown,
        }

    def _changes(self, history: History, log: Log, level: str, variable: str) -> Iterator[list[object]]:
        """Yield a tick and a value wherever it is another, in one of the run's logs."""
        logged = next((one for one in log.levels if one.name == level), None)
        at = None if logged is None else logged.sign.index.get(variable)
        if logged is None or at is None:
            yield [log.first, None]
            return
        gap_until = self._unset(history, log, logged).get(at, ())
        last: object = _NOTHING
        for tick, values in logged.track:
            held = None if tick in gap_until else _number(values[at])
            if held != last or type(held) is not type(last):
                yield [tick, held]
                last = held

    def _unset(self, history: History, log: Log, logged: LoggedLevel) -> dict[int, range]:
        """By leaf the ticks at the run's beginning in which nobody has set it."""
        if log is not history.logs[0] or log.first != 0:
            return {}
        found: dict[int, range] = {}
        for tick, by_level in zip(range(1, LOOKED_AT), unset(log), strict=False):
            still = by_level.get(logged.name, frozenset())
            if not still:
                break
            found |= {at: range(tick + 1) for at in still}
        return found


_NOTHING = object()


def _number(value: Value) -> float | int | None:
    """A number that a curve can have; what is not finite is a gap."""
    if isinstance(value, bool):
        return int(value)
    return value if isinstance(value, int) or math.isfinite(value) else None
