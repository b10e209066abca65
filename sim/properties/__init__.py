"""What is to hold in every cycle of every run, each with the place in the paper that asks for it (issue text; Haynes et al. 1984).

`cycle` says what a property sees; `protocol` has those about levels and buffers, `truth` those that compare reports with the cell as it is,
`failing` those about failures, `limits` those about robot and hand.
"""

from sim.properties.cycle import Made
from sim.properties.failing import RightReason, StillAfterFail
from sim.properties.limits import ForceWithin, JointsWithin, OnlyAllowedContact
from sim.properties.protocol import (
    AnsweredOnce,
    AssumptionsHold,
    EndsInBound,
    NoStateTableError,
    ReplaysExactly,
)
from sim.properties.truth import CountsTrue, DoneTrue

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
