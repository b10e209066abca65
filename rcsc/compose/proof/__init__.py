"""From invariants to what is proved of a level and of the whole system.

`level` proves one level; `context` says which lines are never reached, `ranking` which lines follow one another and what ends that,
`termination` that every command is answered. `assume_guarantee` matches what levels assume with what others are proved to keep,
`system` proves all levels; `kept` takes proofs from the cache, `standing` reads verdicts from it without a solver.
"""
