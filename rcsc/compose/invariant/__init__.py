"""Inductive invariants: found by property directed reachability (PDR), confirmed by Z3.

Definitions. A *cube* is a combination of values of predicates: `new_command = true and cur_state /= d_state`. A *clause* forbids a cube.
Clauses are an *invariant* if no first cycle (at first, or after a restart) ends in a forbidden cube, and every cycle that begins outside
all of them ends outside. *Frame* i is a set of clauses that hold after every run of at most i cycles.

Example. A level has the flags `busy` and `asked`, at first both false. A cycle leaves them, or sets both (input `go`), or resets both
(input `done`). To be shown: `busy` implies `asked` after every cycle. PDR asks for a cycle that breaks this, and gets one from the state
`busy, not asked`. That state is a cube. No first cycle ends in it, for first cycles end with both flags or none; no cycle from outside
leads into it. Without `asked = false` the cube would be `busy`, where a first cycle with `go` ends; without `busy = true` it would be
`not asked`, where one without `go` ends. So nothing can be left out. The clause is "never `busy` and not `asked`"; every cycle keeps it,
and the obligation follows from it. It is the invariant.

Trusted: `confirm`, which asks Z3 whether the clauses are an invariant, in terms (`symbolic.keyed`) that the search does not use. Not
trusted: `cubes`, `pdr`, `search`, and their SAT solver: a wrong result of theirs is not confirmed.

Cost: a question to an incremental SAT solver for each cube and each predicate in it. Predicates come in two rounds, the second only for
what the first leaves open. Confirmation is one question to Z3 for each table, and one for each way to begin.

Modules, in the order the data flows: `cubes`, `pdr`, `search` (which predicates, and from which known states), `confirm`.
"""
