"""Curves of variables over a run, live or of a log.

In: questions of kind `plot.*`. Out: which variables there are, and each one's value wherever it changed. A number that nobody has set yet
is no value (`rcsc.run.unset`): the curve has a gap there.
"""

import math
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence

from rcsc.diagnostics.codes import Code
from rcsc.run.description import BadDescription, description
from rcsc.run.log.read import Log
from rcsc.run.signature import Value
from rcsc.shell.reload.refusal import Refused
from rcsc.studio.hub import Ask, Handler, Json
from rcsc.studio.runs.gaps import Gaps, gaps_of
from rcsc.studio.runs.history import History
from rcsc.studio.runs.live import LANE
from rcsc.studio.runs.timeline import TimeLine

MOST_NAMES = 16
"""Variables of one question."""
MOST_POINTS = 60_000
"""Of one answer's curve; of a longer one the end is shown, and the answer says from where."""


class Plots:
    """Answers with curves; in the lane of the run."""

    name, lane = "plot", LANE

    def __init__(self, time: TimeLine) -> None:
        """Args: time: Which run everybody looks at."""
        self._time = time

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
        """Nothing is held."""

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
        spans = list(self._gaps(history, ask).spans(level, variable))
        changes: list[list[object]] = []
        for log in history.logs:
            ask.check()
            changes += _changes(log, level, variable, spans)
        shown = changes[-MOST_POINTS:]
        return {
            "name": name,
            "unit": leaf.unit,
            "members": list(leaf.members) or (["false", "true"] if leaf.c_type == "bool" else []),
            "from": shown[0][0] if shown else history.first,
            "changes": shown,
        }

    def _gaps(self, history: History, ask: Ask) -> Gaps:
        """What nobody has set; of a log it is found once."""
        if history.gaps is None:
            log = history.logs[0]
            history.gaps = gaps_of(
                log,
                lambda tick: ask.progress(
                    "looking for what nobody set", tick - log.first, log.last - log.first
                ),
            )
        return history.gaps


def _changes(
    log: Log, level: str, variable: str, spans: Sequence[tuple[int, bool]]
) -> Iterator[list[object]]:
    """Yield a tick and a value wherever it is another, in one of a run's logs; none where nobody has set it."""
    logged = next((one for one in log.levels if one.name == level), None)
    at = None if logged is None else logged.sign.index.get(variable)
    if logged is None or at is None:
        yield [log.first, None]
        return
    coming, gap = deque(spans), False
    last: object = _NOTHING
    for tick, values in logged.track:
        while coming and coming[0][0] <= tick:
            gap = coming.popleft()[1]
        held = None if gap else _number(values[at])
        if held != last or type(held) is not type(last):
            yield [tick, held]
            last = held


_NOTHING = object()


def _number(value: Value) -> float | int | None:
    """A number that a curve can have; what is not finite is a gap."""
    if isinstance(value, bool):
        return int(value)
    return value if isinstance(value, int) or math.isfinite(value) else None
