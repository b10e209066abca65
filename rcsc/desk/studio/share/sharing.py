"""Answers what is to be handed on: the concern `share`, for moments of runs, `filmed`, for the whole run, and `handed`, for findings.

In: questions about a tick in the lane of the run, about a finding in that of proofs, about a film in one of its own, for it takes long.
Out: the name of a file and its text, or its bytes; the page that asked writes it where its user says.
"""

import base64
import itertools
import re
from array import array
from bisect import bisect_right
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from typing import Any

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.studio.hub import LATER, Ask, Concern, Hub, Json
from rcsc.desk.studio.runs.live import LANE
from rcsc.desk.studio.runs.shown import Changes, Lines
from rcsc.desk.studio.runs.timeline import TimeLine
from rcsc.desk.studio.scene import Poses, Scene
from rcsc.desk.studio.share.document import of_film, of_finding
from rcsc.desk.studio.share.film import film
from rcsc.desk.studio.tables import shown
from rcsc.desk.studio.tables.desk import PROOF, Desk, seen
from rcsc.run.plant.space import Space

MOST_AROUND = 1000
FORMS = {"mp4": "video/mp4", "webp": "image/webp", "gif": "image/gif"}
"""Of films: what browsers call them."""
FASTEST = 100
"""Times as fast as the clock that a film goes."""
_ODD = re.compile(r"[^A-Za-z0-9_]+")


class Moments(Concern):
    """Hands on moments of the run that everybody looks at."""

    name, lane = "share", LANE

    def __init__(self, hub: Hub, time: TimeLine, cell: Scene) -> None:
        """Args: hub: Does things in lanes; time: The run; cell: What stands outside."""
        self._hub, self._time, self._cell = hub, time, cell

    def _on_moment(self, ask: Ask) -> Json:
        """Gather ticks one after another, the lane free for others in between."""
        history = self._time.history()
        era = history.era
        tick = ask.body.whole("tick", history.first, history.last)
        around = ask.body.whole("around", 0, MOST_AROUND)
        title = self._time.source.name or str(history.logs[0].facts["name"])
        pieces = film(history, tick, around, lambda at: self._cell.drawing(at, projected=False))

        def piece() -> Json:
            if self._time.source.history is not history or history.era != era:
                raise Refused(Code.STUDIO, "the run that was shared is another one by now", "share it again")
            so_far = next(pieces, None)
            if so_far is None:
                return {"name": f"{_plain(title)}_tick_{tick}.html", "text": of_film(title, whole)}
            whole.update(so_far)
            ask.progress("gathering ticks and pictures", next(count))
            self._hub.do(LANE, lambda: ask.done(piece))
            return LATER

        whole, count = dict[str, Any](), itertools.count(1)
        return piece()


class Films(Concern):
    """Films the run so far, in a lane of its own."""

    name, lane = "filmed", "film"

    def __init__(self, hub: Hub, time: TimeLine, cell: Scene) -> None:
        """Args: hub: Does things in lanes; time: The run; cell: What stands outside."""
        self._hub, self._time, self._cell = hub, time, cell

    def _on_run(self, ask: Ask) -> Json:
        """Take what is kept of the run, in its lane; then photograph it here."""
        form, speed = ask.body.one_of("form", tuple(FORMS)), ask.body.whole("speed", 1, FASTEST)
        view = ask.body.one_of("view", ("corner", "front", "left", "above"))

        def take() -> Json:
            history = self._time.history()
            space, poses = self._cell.kept()
            first, last = max(history.first, poses.ticks[0]), history.last
            lines, tick_ms = Lines().within(history, first, last), history.stood_at(last).tick_ms
            name = _plain(self._time.source.name or str(history.logs[0].facts["name"]))
            kept = _Kept(first, last, tick_ms, space, poses, lines)
            self._hub.do(self.lane, lambda: ask.done(lambda: made(f"{name}.{form}", kept)))
            return LATER

        def made(name: str, kept: _Kept) -> Json:
            film = _photographed(ask, kept, f".{form}", speed, view)
            return {"name": name, "type": FORMS[form], "base64": base64.b64encode(film).decode()}

        self._hub.do(LANE, lambda: ask.done(take))
        return LATER


@dataclass(frozen=True, slots=True)
class _Kept:
    """What is kept of a run, from a tick to another.

    Attributes:
        lines: By level, from which tick on it ran which.
    """

    first: int
    last: int
    tick_ms: int
    space: Space
    poses: Poses
    lines: Changes


def _photographed(ask: Ask, kept: _Kept, form: str, speed: int, view: str) -> bytes:
    """Return the film of what is kept.

    Raises:
        Refused: A package is not installed, or nothing draws here.
        CancelledError: Nobody waits for it.
    """
    try:
        from rcsc.run.plant.models.camera import NoPictureError
        from rcsc.views.pages.video import Filming, filmed
    except ModuleNotFoundError as error:
        missing = f"`{error.name}` is not installed"
        raise Refused(Code.EXTRA_MISSING, missing, "pip install 'rcsc[video]'") from error
    filming = Filming(speed)
    for tick in range(kept.first, kept.last + 1):
        filming.take(tick, kept.tick_ms, partial(_posed, kept.poses, tick), _ran(kept.lines, tick))
    many = len(filming.frames)
    try:
        return filmed(form, filming.frames, kept.space, view, lambda at: ask.progress("pictures", at, many))
    except NoPictureError as error:
        raise Refused(Code.NO_FILM, f"no film: {error}") from error


def _posed(poses: Poses, tick: int) -> "array[float]":
    return array("f", poses.at(tick) or b"")


def _ran(lines: Changes, tick: int) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return of each level the table and the line that it stands at after a tick."""
    places = {name: bisect_right(changes, tick, key=itemgetter(0)) - 1 for name, changes in lines.items()}
    return [
        (name, [(lines[name][at][1], lines[name][at][2])] if at >= 0 else []) for name, at in places.items()
    ]


class Findings(Concern):
    """Hands on findings of the files that are open."""

    name, lane = "handed", PROOF

    def __init__(self, desk: Desk) -> None:
        """Args: desk: The open files."""
        self._desk = desk

    def _on_finding(self, ask: Ask) -> Json:
        name, version = seen(ask)
        number = ask.body.whole("finding", 0, 1_000_000)
        known = self._desk.known(name, version)
        offered = self._desk.repairs(name, version, number)
        whole = shown.document(name, self._desk.at(name, version), known)
        finding = whole["findings"][number]
        table = next((each for each in whole["tables"] if each["name"] == finding["table"]), None)
        repairs = [shown.repair(at, each) for at, each in enumerate(offered)]
        title = f"{name}{', table ' + finding['table'] if finding['table'] else ''}"
        file = _plain(f"{finding['table'] or name}_{finding['code']}_{finding['line'] or ''}")
        return {"name": f"{file}.html", "text": of_finding(title, table, finding, repairs)}


def _plain(title: str) -> str:
    return _ODD.sub("_", title).strip("_") or "run"
