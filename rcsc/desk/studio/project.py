"""What a studio is about: one system, and the concerns that answer for it.

In: what is to be opened. Out: the concerns, which may know each other.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rcsc.base.host.trust import Agreement
from rcsc.desk.shell.opening import Opening
from rcsc.desk.shell.session import Session
from rcsc.desk.studio.build import Build
from rcsc.desk.studio.hub import Concern, Hub
from rcsc.desk.studio.plots import Plots
from rcsc.desk.studio.required import Required
from rcsc.desk.studio.runs.live import LANE, WATCHED, Live, Pace
from rcsc.desk.studio.runs.logs import Logs
from rcsc.desk.studio.runs.timeline import TimeLine
from rcsc.desk.studio.scene import Drawer, Scene
from rcsc.desk.studio.share.sharing import Films, Findings, Moments
from rcsc.desk.studio.tables.desk import Desk
from rcsc.desk.studio.tables.editing import Tables
from rcsc.desk.studio.tables.proving import Graphs, Proof
from rcsc.desk.studio.tables.writing import Writing


def concerns(  # noqa: PLR0913  # all that a studio is made of
    opening: Opening,
    hub: Hub,
    agreement: Agreement,
    logs: Sequence[Path] = (),
    pace: Pace = WATCHED,
    drawer: Drawer | None = None,
    first: Path | None = None,
    *,
    proves: bool = False,
) -> Sequence[Concern]:
    """Return all concerns of a studio.

    Args:
        opening: The system.
        hub: What tells the pages, and does things in lanes.
        agreement: Whether the code of its folder may run.
        logs: That the user names; the first is shown at once.
        pace: How the system runs at first.
        drawer: Draws a tick of the cell, where somebody can.
        first: The file, or the folder, whose tables are shown first; else those of the system.
        proves: Whether the levels are proved together at once.
    """
    live = Live(opening, hub.tell, lambda work, after_s: hub.do(LANE, work, after_s), pace)
    time = TimeLine(live, hub.tell)
    folders = tuple(dict.fromkeys((Path.cwd(), opening.path.resolve().parent)))
    kept = Logs(folders, tuple(logs), lambda *shown: hub.do(LANE, lambda: time.show(*shown)))
    build = Build(opening.path, hub, live, agreement, proves=proves)
    live.prove_first = build.prove_first
    desk = Desk(opening.path, hub.tell, hub.do, first)

    def sees(session: Session) -> None:
        """Let `reload` refuse a file on disk while a page shows another text of it."""
        session.plant = replace(session.plant, unwritten=desk.unwritten)

    live.opened.append(sees)
    cell = Scene(time, hub.tell, drawer)
    return (
        live,
        time,
        kept,
        build,
        Tables(desk, hub.part, lambda work, after_s: hub.do(Tables.lane, work, after_s)),
        Proof(desk),
        Graphs(desk),
        Writing(desk),
        cell,
        Plots(time, hub),
        Moments(hub, time, cell),
        Films(hub, time, cell),
        Findings(desk),
        Required(opening.path, kept),
    )
