"""Curves of variables over a run, live or of a log.

In: questions of kind `plot.*`. Out: which variables there are, and each one's value wherever it changed. A number that nobody has set yet
is no value (`rcsc.run.unset`): the curve has a gap there.
"""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.studio.hub import LATER, Ask, Concern, Hub, Json
from rcsc.desk.studio.runs.history import History
from rcsc.desk.studio.runs.live import LANE
from rcsc.desk.studio.runs.timeline import TimeLine
from rcsc.run.description import BadDescription, description
from rcsc.run.log.read import Track
from rcsc.run.signature import Value

MOST_NAMES = 16
"""Variables of one question."""
MOST_POINTS = 60_000
"""Of one answer's curve; of a longer one the end is shown, and the answer says from where."""
A_PIECE = 5_000
"""Records that are looked at before the lane is free for others: some hundredths of a second."""


@dataclass(slots=True)
class _Traced:
    """A variable in one log, as far as it was read: `changes` are ticks and values; `Gaps` tells which of them nobody has set."""

    track: Track
    at: int
    changes: list[tuple[int, float | int | None]] = field(default_factory=list)
    done: int = 0

    def follow(self, most: int) -> bool:
        """Read so many records more; return whether the end is reached."""
        unpack, packed = self.track.layout.unpack, self.track.packed
        to = min(len(packed), self.done + most)
        for place in range(self.done, to):
            if place and packed[place] is packed[place - 1]:
                continue  # the same state again
            value = _number(unpack(packed[place])[self.at])
            if not self.changes or _other(value, self.changes[-1][1]):
                self.changes.append((self.track.ticks[place], value))
        self.done = to
        return to == len(packed)

    def with_gaps(self, spans: Sequence[tuple[int, bool]]) -> list[list[Any]]:
        """Return the changes, with gaps where nobody has set the variable.

        Args:
            spans: From which tick on nobody has set it, or somebody has, in order (`Gaps.spans`).
        """
        first, end = self.track.ticks[0], self.track.ticks[-1]
        gap = next((is_gap for tick, is_gap in reversed(spans) if tick <= first), False)
        known, turns = dict(self.changes), dict(spans)
        held: float | int | None = None
        told: list[list[Any]] = []
        for tick in sorted({*known, *(tick for tick in turns if first < tick <= end)}):
            held, gap = known.get(tick, held), turns.get(tick, gap)
            value = None if gap else held
            if not told or _other(value, told[-1][1]):
                told.append([tick, value])
        return told


class Plots(Concern):
    """Answers with curves; in the lane of the run."""

    name, lane = "plot", LANE

    def __init__(self, time: TimeLine, hub: Hub) -> None:
        """Args: time: Which run everybody looks at; hub: Does things in lanes."""
        self._time, self._hub = time, hub
        self._known: dict[tuple[int, int], _Traced] = {}
        self._finding: Iterator[None] = iter(())
        self._of: tuple[object, int] = (None, -1)

    def close(self) -> None:
        """Forget the curves found so far."""
        self._known, self._finding = {}, iter(())

    def _on_names(self, _: Ask) -> Json:
        """Every variable by its whole name, and those that the system's description shows, by set."""
        log = self._time.history().logs[-1]
        names = [
            {"name": f"{logged.name}.{leaf.name}", "unit": leaf.unit, "kind": leaf.kind}
            for logged in log.levels
            for leaf in logged.sign.leaves
        ]
        known = {each["name"] for each in names}
        return {"names": names, "displays": self._displays(known)}

    def _displays(self, known: Collection[str]) -> dict[str, list[str]]:
        """Return the displays of the studio's system, as far as the run has them: a log may be of another system, and holds none."""
        try:
            sets = description(self._time.live.opening.path).displays
        except (BadDescription, OSError):
            return {}
        there = {name: [each for each in shown if each in known] for name, shown in sets.items()}
        return {name: shown for name, shown in there.items() if shown}

    def _on_curves(self, ask: Ask) -> Json:
        """Return the changes of some variables: `[tick, value]`, null where nobody has set one; a long run is read in pieces."""
        names = ask.body.members("names")
        if len(names) > MOST_NAMES:
            raise Refused(Code.STUDIO, f"more than {MOST_NAMES} curves")
        history = self._time.history()
        if (history, history.era) != self._of:
            self._known, self._finding, self._of = {}, history.find_gaps(), (history, history.era)
        wanted = [self._traced(history, name) for name in names]

        def piece() -> Json:
            if (self._time.source.history, self._time.source.history.era) != (history, self._of[1]):
                return self._on_curves(ask)  # it is another run by now
            behind = [
                one
                for traced in wanted
                for one in traced
                if isinstance(one, _Traced) and not one.follow(A_PIECE)
            ]
            next(self._finding, None)
            if history.gaps is None or behind:
                done = min((one.done for one in behind), default=history.last)
                ask.progress("reading the run", done, history.last - history.first)
                self._hub.do(LANE, lambda: ask.done(piece))
                return LATER
            return self._answer(history, names, wanted)

        return piece()

    def _answer(self, history: History, names: Sequence[str], wanted: list[list[_Traced | int]]) -> Json:
        curves = [self._curve(history, name, traced) for name, traced in zip(names, wanted, strict=True)]
        return {"era": history.era, "first": history.first, "last": history.last, "curves": curves}

    def _traced(self, history: History, name: str) -> list[_Traced | int]:
        """Return a variable's curve in each log of the run, or the first tick of a log that lacks the variable."""
        level, _, variable = name.partition(".")
        found = list[_Traced | int]()
        for log in history.logs:
            logged = next((one for one in log.levels if one.name == level), None)
            at = None if logged is None else logged.sign.index.get(variable)
            if logged is None or at is None:
                found.append(log.first)
            else:
                found.append(self._known.setdefault((id(logged.track), at), _Traced(logged.track, at)))
        if not found or isinstance(found[-1], int):
            raise Refused(Code.STUDIO, f"the run has no variable `{name}`")
        return found

    def _curve(self, history: History, name: str, traced: list[_Traced | int]) -> Json:
        level, _, variable = name.partition(".")
        logged = history.logs[-1].level(level)
        leaf = logged.sign.leaves[logged.sign.index[variable]]
        assert history.gaps is not None
        spans = list(history.gaps.spans(level, variable))
        changes = [
            change
            for one in traced
            for change in ([[one, None]] if isinstance(one, int) else one.with_gaps(spans))
        ]
        shown = changes[-MOST_POINTS:]
        return {
            "name": name,
            "unit": leaf.unit,
            "members": list(leaf.members) or (["false", "true"] if leaf.c_type == "bool" else []),
            "from": shown[0][0] if shown else history.first,
            "changes": shown,
        }


def _number(value: Value) -> float | int | None:
    """Return the number that a curve shows; None, a gap, for one that is not finite."""
    if isinstance(value, bool):
        return int(value)
    return value if isinstance(value, int) or math.isfinite(value) else None


def _other(value: float | int | None, before: float | int | None) -> bool:
    return value != before or type(value) is not type(before)
