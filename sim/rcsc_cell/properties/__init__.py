"""What is to hold in every cycle of every run, each with the place in the paper that asks for it.

A *property* sees the system after each cycle, the cell as it is in truth, and the command under way; it tells what is
not as it should be, once. So a level that reports *done* is held against where the part really lies, which the level
itself cannot see.

What is about levels alone is watched as in any system (`rcsc.run.episodes.properties`); these need a cell: that DONE is true,
that counts of the buffer are those of the parts, that FAIL gives the right reason and nothing moves after it, that fingers
close with no more than the force asked for, and that joints stay within limits and do not jump.

>>> from rcsc_cell.properties import PROPERTIES
>>> len(PROPERTIES) == len({made.__name__ for made in PROPERTIES})
True

Nothing here is trusted for a proof. What it costs: a look at the state, a property and cycle.

Modules, in the order the data flows: `cycle` says what a property sees; `truth` has those that compare reports with the
cell as it is, `failing` those about failures, `limits` those about robot and hand.
"""

from rcsc_cell.properties.cycle import PropertyClass
from rcsc_cell.properties.failing import RightReason, StillAfterFail
from rcsc_cell.properties.limits import ForceWithin, JointsWithin, OnlyAllowedContact
from rcsc_cell.properties.truth import CountsTrue, DoneTrue

PROPERTIES: tuple[PropertyClass, ...] = (
    DoneTrue,
    CountsTrue,
    RightReason,
    StillAfterFail,
    OnlyAllowedContact,
    ForceWithin,
    JointsWithin,
)
"""All of the cell's own."""
