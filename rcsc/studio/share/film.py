"""The ticks around a moment of a run, as the file that shows them holds them.

In: a history, and what draws the cell. Out: of each tick what every level took, ran and gave; its values, told where they change; and
pictures. It is made piece by piece, so that a system that runs meanwhile is held up for no longer than a tick of it takes.
"""

from collections.abc import Callable, Iterator
from typing import Any

from rcsc.diagnostics.coded import CodedError
from rcsc.run.log.read import LoggedLevel
from rcsc.shell.reload.refusal import Refused
from rcsc.studio.runs.history import History
from rcsc.studio.runs.shown import moment

MOST_PICTURES = 41
MOST_PICTURE_BYTES = 12 * 1024 * 1024
"""Of all pictures of a file; those that are further from the moment are left out."""

Draw = Callable[[int], dict[str, Any]]
"""Draws a tick: `svg` and `caption`."""


def film(history: History, at: int, around: int, draw: Draw) -> Iterator[dict[str, Any]]:
    """Yield what is there so far, after each tick and each picture; the last is whole.

    Args:
        history: Of the run.
        at: The moment.
        around: How many ticks before it and after it are shown.
        draw: Draws the cell.
    """
    first, last = max(history.first, at - around), min(history.last, at + around)
    whole: dict[str, Any] = {
        "at": at, "first": first, "last": last, "tick_ms": history.stood_at(at).tick_ms, "ticks": [], "pictures": [], "why": "",
    }  # fmt: skip
    before: dict[str, dict[str, str]] = {}
    for tick in range(first, last + 1):
        shown = moment(history, tick)
        for level in shown["levels"]:
            now = _values(history, history.stood_at(tick).level(level["level"]), tick)
            held = before.get(level["level"], {})
            level["values"] = {name: text for name, text in now.items() if held.get(name) != text}
            before[level["level"]] = now
        whole["ticks"].append(shown)
        yield whole
    yield from _pictured(whole, at, first, last, draw)


def _values(history: History, logged: LoggedLevel, tick: int) -> dict[str, str]:
    values = history.values(logged.name, tick)
    return {leaf.name: leaf.shown(values[at]) for at, leaf in enumerate(logged.sign.leaves)}


def _pictured(whole: dict[str, Any], at: int, first: int, last: int, draw: Draw) -> Iterator[dict[str, Any]]:
    """Draw the moment, and others at even distances, the nearest first; say why where it cannot be drawn."""
    apart = max(1, -(-(last - first) // (MOST_PICTURES - 1)))
    ticks = sorted({at, *range(first, last + 1, apart)}, key=lambda tick: abs(tick - at))
    room = MOST_PICTURE_BYTES
    for tick in ticks:
        try:
            drawing = draw(tick)
        except (CodedError, Refused) as error:
            whole["why"] = whole["why"] or getattr(error, "shown", str(error))
            if (
                tick == at
            ):  # a plant's own picture is of now alone; what cannot be drawn at all is not tried again
                return
            continue
        room -= len(drawing["svg"])
        if room < 0:
            return
        whole["pictures"].append({"tick": tick, **drawing})
        yield whole
