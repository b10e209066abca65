"""Answers what is to be handed on: the concern `share`, for moments of runs, and `handed`, for findings.

In: questions about a tick in the lane of the run, about a finding in that of proofs. Out: the name of a file and its text; the page that
asked writes it where its user says.
"""

import itertools
import re
from typing import Any

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.studio.hub import LATER, Ask, Concern, Hub, Json
from rcsc.desk.studio.runs.live import LANE
from rcsc.desk.studio.runs.timeline import TimeLine
from rcsc.desk.studio.scene import Scene
from rcsc.desk.studio.share.document import of_film, of_finding
from rcsc.desk.studio.share.film import film
from rcsc.desk.studio.tables import shown
from rcsc.desk.studio.tables.desk import PROOF, Desk, seen

MOST_AROUND = 1000
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
