"""Requirements across levels: what the levels of a system do together, tick by tick.

Levels are proved alone, each in an environment that may do whatever the contract allows (`compose.proof`). That shows what each owes. *The
lift never moves while the drive does* is owed by no level: it is a sentence about several, and about how they are connected. Here they
become one transition system, of as few levels as the proof needs, and the engines for a level answer it.

| module | |
|---|---|
| `words` | what the names in a file of requirements mean |
| `product` | levels together as one transition system, under one of three timings |
| `features` | the predicates that invariants may speak of |
| `eventually` | what comes at no time that is said: bounds, and runs on which it never comes |
| `proof` | proofs, from few levels to many; what they rest on |
| `plain` | what a level keeps of outputs without a protocol, found for who reads them, under any timing |
| `left_open` | what the contract leaves open of a level, asked of it together with those that write to it |
| `played` | runs of the whole system, as the interpreter does them |
| `kept` | verdicts that an earlier run found |
| `needed` | what a proof needs of the levels |
| `said` | verdicts in words |
| `repeated` | all of a system; such a run on the executors, and kept as a log |

Example: a boss lets one of two hands run, both tell it so a tick later. `always not (left.runs and right.runs)` is proved of the three as
they are scheduled, and of no two of them. With its two wires crossed, `when boss.go_left, within 1 cycles, left.runs` is refuted in tick 3.

What it costs: a proof what its levels cost together; AMR's *never lift while driving*, of 300 bits of state, some 3 seconds;
a sentence about the paper's cell, of five levels, 4 to 35.

Trusted are `product`, and what a level's proof trusts; not the search: Z3 confirms each invariant, and the interpreter each run.
"""
