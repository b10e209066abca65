"""What a studio is about: one system, and the concerns that answer for it.

In: what is to be opened. Out: the concerns, which may know each other.
"""

from collections.abc import Sequence

from rcsc.shell.opening import Opening
from rcsc.studio.hub import Concern, Hub
from rcsc.studio.runs.live import LANE, Live


def concerns(opening: Opening, hub: Hub) -> Sequence[Concern]:
    """Return everything that answers.

    Args:
        opening: The system.
        hub: What tells the pages, and does things in lanes.
    """
    live = Live(opening, hub.tell, lambda work, after_s: hub.do(LANE, work, after_s))
    return (live,)
