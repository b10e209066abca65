"""The protocol between levels, made of what a program declares: links, whom it serves and whom it commands.

Haynes et al. (1984), sections 8.3 and 9, say that pre- and postprocess are the same in every control level: number, echo, flag of
a new command, what is held until an echo. So nobody writes them by hand.

Definitions. A *link* is what a superior and a subordinate say to each other: commands, statuses, further fields of the order and the
report. A field of an order is *numbered* unless it is a *stream*: where a numbered field changes, the order takes the next number. A
subordinate's report is *held*: what it says of an older order is not looked at, and all reports are taken together once every last
order is echoed. A stream is looked at as it comes. An order that is not echoed in time, or not answered, is *late*: it counts as
failed, and what is said of it from then on is no answer; but to rest is never too late.

    serves fleet : fleet_link               what fleet orders is `fleet`, what is reported to it `to_fleet`
    commands drive : drive_link             what is ordered of it is `to_drive`, what it said of the last order `drive`
    drive := goto(target_mm := 500)         the command and the fields that are named; the others are kept (`resolve.statements`)

In: the declarations of a root. Out: the same with records, buffers, state and two modules in the place of the protocol's; what each
table may assume. All of it is text of the language, parsed as the rest is: interpreter, proof and executors know nothing of it.

Trusted: `written`, for what a program is. `in_step` is not: what it guesses is proved. Cost: linear in the fields of the links; of
`in_step`, states times commands.

Modules, in the order the data flows: `roles` (who is whose superior, checked), `written` (the text of what is made), `expand`,
`in_step` (which state goes with which orders). Beside them `environment`: what can happen to a level, and what each event leaves, for
all rooms that let it happen.
"""

from rcsc.lang.protocol.expand import condition, expanded
from rcsc.lang.protocol.in_step import Flags, Watched, in_step
from rcsc.lang.protocol.roles import Parties, Party, declared

__all__ = ["Flags", "Parties", "Party", "Watched", "condition", "declared", "expanded", "in_step"]
