"""What the requirements of a level speak of: assignments that no proof needs, and slips that nothing notices.

Definitions. A *use* is a written assignment where it is run, by a line or by a procedure of every cycle. A *core* of a requirement are
uses and assumptions from which it follows: whatever the other uses write, it holds. It is *minimal* if it does not follow without any one
of its members. A *slip* leaves out an assignment or all that a line does; it *survives* if all that was proved of the level still holds.

Example. A counter of retries, `tries := 0` where a drive begins and `tries := tries + 1` where it tries again, and one requirement: with
two tries, the next block fails. Its core is the line that fails. Nothing speaks of the two assignments, and a program without the reset
passes: so a property that would notice is offered, `was now = still and go implies tries = 0`, proved of the level, refuted of the slip.

Two measures, because neither is the other: a core tells what a proof needs, where *not needed* means that anything may be written; a
slip keeps what was there before, which often is as good.

Trusted: that questions are put as they say (`parts`, `questions`), and Z3; a run counts only if the interpreter repeats it. What neither
shows is said to be open.

Cost: a question for each clause that is needed, one or two for each member of a core and for each slip, which share solvers; a search for
an invariant for few slips. Some tens of seconds for a level of a hundred lines. Asked for, never by default.

Modules, in the order the data flows: `parts` (uses, and programs with switches), `questions` (what follows while they are off), `tried`
(runs while they are off), `again` (an invariant of a changed level), `cores`, `slips`, `offers` (properties that would notice), `covered`
(all of one level), `kept` (what an earlier run found).
"""
