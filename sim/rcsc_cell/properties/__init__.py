"""What is to hold in every cycle of every run, each with the place in the paper that asks for it (issue text; Haynes et al. 1984).

`cycle` says what a property sees; `protocol` has those about levels and buffers, `truth` those that compare reports with the cell as it is,
`failing` those about failures, `limits` those about robot and hand.
"""

from rcsc_cell.properties.cycle import Made
from rcsc_cell.properties.failing import RightReason, StillAfterFail
from rcsc_cell.properties.limits import ForceWithin, JointsWithin, OnlyAllowedContact
from rcsc_cell.properties.protocol import (
    AnsweredOnce,
    AssumptionsHold,
    EndsInBound,
    NoStateTableError,
    ReplaysExactly,
)
from rcsc_cell.properties.truth import CountsTrue, DoneTrue

PROPERTIES: tuple[Made, ...] = (
    NoStateTableError,
    AssumptionsHold,
    EndsInBound,
    AnsweredOnce,
    ReplaysExactly,
    DoneTrue,
    CountsTrue,
    RightReason,
    StillAfterFail,
    OnlyAllowedContact,
    ForceWithin,
    JointsWithin,
)
"""All of them."""
