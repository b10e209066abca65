"""From invariants to what is proved of a level, and of the whole system.

Definitions. A *level proof* is the invariant of a level with a verdict for each obligation. A line is *unreached* if no reachable cycle
runs it. A command *ends* if it is answered, *done* or *failed*, and stays so, assuming that subordinates answer theirs. A *phase* is the
part of the state that tells how far a command has come; a *ranking* is a number of the level that rises with a line and falls with none
that follows it. A requirement *waits* for what is to come eventually, and a *bound* is for how long at most. A *promise* is what a level
assumes of a neighbour.

Example. `upper` orders `lower` and waits for its echo. `upper` is proved to number its orders one after the other, `lower` to echo the
order that it took. Each is a promise of one that the other assumes; both begin with the same order; so both are proved of the system,
by the induction in `compose.__doc__`. If `lower` is not proved to echo, its own verdicts stand, and those of `upper` are shown with what
they rest on.

Trusted: the arguments in `compose.__doc__`, in `termination` and in `eventually`; that questions are put as they say (`level`, `context`,
`ranking`, `termination`, `eventually`, `assume_guarantee`); Z3, or cvc5 with `--certify`, which answers the same questions from their text.

Cost: linear in the number of levels, which are proved one by one; termination asks about three cycles of a table in a row.
A proof is kept under a digest of all that it depends on, and only read the next time. After a change the clauses of the last search are
the first that the next one tries.

Modules, in the order the data flows: `stuck` (lines that are never reached, states that nothing leaves), `context` (lines), `staying` (the
cycles of one table), `ranking` (what stops), `termination` (commands), `eventually` (bounds to try), `candidates` (clauses of the last
search), `level` (all of one level), `assume_guarantee` (promises, claims), `standing` (what the cache has of a system), `system`, `notices`
(warnings of what `context` found).
"""
