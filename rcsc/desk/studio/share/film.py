"""Ticks of a run, as the file that shows them holds them: what the studio's page would ask for, gathered.

In: a history, and what draws the cell. Out: which line every level ran; of each tick what every level took, ran and gave, told where it
changes; every variable, likewise; and pictures. It is made piece by piece, so that a system that runs meanwhile is held up for no longer
than a tick of it takes.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from rcsc.base.diagnostics.coded import CodedError
from rcsc.desk.studio.runs.history import History
from rcsc.desk.studio.runs.shown import Lines, Shown
from rcsc.desk.studio.share.document import played
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.views.pages.report import Story

MOST_PICTURES = 41
MOST_PICTURE_BYTES = 12 * 1024 * 1024
"""Of all pictures of a file; those that are further from the moment are left out."""
MOST_TICKS = 10_000
"""Ticks of a whole run that a file holds, the last of them: nearly seven minutes at 40 ms."""

Film = dict[str, Any]
Draw = Callable[[int], dict[str, Any]]
"""Draws a tick: `svg` and `caption`."""


def film(history: History, at: int, around: int, draw: Draw) -> Iterator[Film]:
    """Yield the film of a moment as far as it is made, after each tick and each picture; the last is whole.

    Args:
        history: Of the run.
        at: The moment.
        around: How many ticks before it and after it are shown.
        draw: Draws the cell.
    """
    first, last = max(history.first, at - around), min(history.last, at + around)
    whole = _begun(history, at, first, last)
    for _ in _gathered(whole, history):
        yield whole
    for _ in _pictured(whole, at, draw):
        yield whole


def whole_run(log: Log, shown: Sequence[str], pictures: Sequence[Film]) -> Film:
    """Return the film of a run that is over.

    Args:
        log: The run.
        shown: Variables that have a graph at first, each its own.
        pictures: Of ticks: `tick`, and `svg` with `caption` or `of`, which element of the page has it.
    """
    history = History([log])
    whole = _begun(history, history.last, max(history.first, history.last - MOST_TICKS), history.last)
    for _ in _gathered(whole, history):
        pass
    known = {f"{level}.{name}" for level, several in whole["variables"].items() for name in several}
    return whole | {
        "at": None,
        "shown": [name for name in shown if name in known],
        "pictures": list(pictures),
    }


def _begun(history: History, at: int, first: int, last: int) -> Film:
    levels = [
        {
            "name": level.name,
            "period_ms": level.level.period_ms,
            "tables": {name: list(level.sign.tables.get(name, ())) for name in level.level.every_table},
        }
        for level in history.ran_at(at).levels
    ]
    return {
        "at": at, "first": first, "last": last, "tick_ms": history.stood_at(at).tick_ms, "levels": levels,
        "tracks": Lines().within(history, first, last), "boxes": {}, "variables": _variables(history, last), "shown": [],
        "pictures": [], "why": "",
    }  # fmt: skip


def _variables(history: History, last: int) -> dict[str, dict[str, Film]]:
    """Return every variable by level and name, before any of its values."""
    logs = [log for log in history.logs if log.first <= last]
    every: dict[str, dict[str, Film]] = {}
    for log in logs:
        for logged in log.levels:
            for leaf in logged.sign.leaves:
                members = list(leaf.members) or (["false", "true"] if leaf.c_type == "bool" else [])
                every.setdefault(logged.name, {}).setdefault(
                    leaf.name, {"unit": leaf.unit, "members": members, "unset": [], "changes": []}
                )
    return every


def _gathered(whole: Film, history: History) -> Iterator[None]:
    """Add the changes of every tick."""
    shown = Shown()
    boxes: dict[str, Film] = {}
    values: dict[str, tuple[object, ...]] = {}
    for tick in range(whole["first"], whole["last"] + 1):
        for box in shown.moment(history, tick)["levels"]:
            name = box["level"]
            told = whole["boxes"].setdefault(name, [])
            if boxes.get(name) != box:
                told.append([tick, {key: value for key, value in box.items() if key != "now"}])
                boxes[name] = box
            now = history.values(name, tick)
            if values.get(name) != now:
                _told(whole["variables"][name], history.stood_at(tick).level(name), tick, now)
                values[name] = now
        yield
    yield from _gaps(whole, history)


def _told(variables: dict[str, Film], logged: LoggedLevel, tick: int, now: tuple[Any, ...]) -> None:
    for leaf, value in zip(logged.sign.leaves, now, strict=False):  # values go on with the trace
        changes = variables[leaf.name]["changes"]
        text = leaf.shown(value)
        if not changes or changes[-1][1] != text:
            changes.append([tick, text])


def _gaps(whole: Film, history: History) -> Iterator[None]:
    """Add the spans in which nobody had set a number."""
    yield from history.find_gaps()
    assert history.gaps is not None
    for level, variables in whole["variables"].items():
        for name, told in variables.items():
            told["unset"] = history.gaps.within(level, name, whole["last"])


def _pictured(whole: Film, at: int, draw: Draw) -> Iterator[None]:
    """Draw the moment, and others at even distances, the nearest first; give the reason where it cannot be drawn."""
    first, last = whole["first"], whole["last"]
    apart = max(1, -(-(last - first) // (MOST_PICTURES - 1)))
    ticks = sorted({at, *range(first, last + 1, apart)}, key=lambda tick: abs(tick - at))
    room = MOST_PICTURE_BYTES
    for tick in ticks:
        try:
            drawing = draw(tick)
        except CodedError as error:
            whole["why"] = whole["why"] or error.shown
            if (
                tick == at
            ):  # what cannot be drawn at all is not tried again; a plant's own picture is of now alone
                return
            continue
        room -= len(drawing["svg"])
        if room < 0:
            return
        whole["pictures"].append({"tick": tick, **drawing})
        yield


def with_ticks(story: Story, log: Log, drawn: Sequence[str]) -> Story:
    """Return a story with its run tick by tick.

    Args:
        story: Its pictures of the cell are shown at their ticks.
        log: The run.
        drawn: Variables that have a curve at first.
    """
    pictures = [
        {"tick": frame.tick, "of": f"frame-{at}", "caption": [frame.caption]}
        for at, frame in enumerate(story.frames, 1)
    ]
    film = whole_run(log, drawn, pictures)
    return replace(story, played=played(film), left_out=film["first"] - log.first)
