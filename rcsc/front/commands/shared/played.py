"""A run that is over, tick by tick in a page: the studio's time line, levels and curves."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcsc.run.log.read import Log  # of an extra
    from rcsc.views.pages.report import Story


def with_ticks(story: "Story", log: "Log", drawn: Sequence[str]) -> "Story":
    """Return a story with its run tick by tick.

    Args:
        story: Its pictures of the cell are shown at their ticks.
        log: The run.
        drawn: Variables that have a curve at first.
    """
    from rcsc.desk.studio.share.document import played  # what most commands have no use for
    from rcsc.desk.studio.share.film import whole_run

    pictures = [
        {"tick": frame.tick, "of": f"frame-{at}", "caption": [frame.caption]}
        for at, frame in enumerate(story.frames, 1)
    ]
    film = whole_run(log, drawn, pictures)
    return replace(story, played=played(film), left_out=film["first"] - log.first)
