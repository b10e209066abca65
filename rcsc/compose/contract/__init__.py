"""What a level may assume of its environment, and what it owes.

Definitions. A *leaf* is a scalar part of a variable, such as `command.inc_command`. A *neighbour* is a level, or something outside the
system, that gives this level orders or takes orders from it. A *transition system* turns one *cycle* of a level into nodes over the leaves
before and after it, from one state or from any (*havoc*). The *contract* is the condition on what the environment gives in a cycle. An
*obligation* is a condition that every reachable cycle has to fulfil; its *sort* says what it is about. A *claim* is an obligation, or the
contract, with its verdict and the claims that it rests on. A *predicate* is a truth value or a member of a state: an invariant is made of
predicates.

Example. A level takes orders in `command` and has the state `new_command`. In a cycle that takes the same number as the cycle before, the
numbered fields of the order are the same, too, by the contract; obligation `ONCE` is that `new_command` does not rise in it. If the
level raises the flag only where the command differs from the last one, the obligation follows from the contract. If it raises the flag
whenever the command is `go`, a state with `go` and without the flag breaks it, unless an invariant excludes that state.

Trusted: `environment`, `facts`, `watched`, `transition`, `properties`, `obligations`, `claims`. Not trusted: `predicates` and `walk` only
guide the search, `given` and `variants` only make runs.

Cost: a cycle is built by one pass over the level's statements; nodes are shared, and nothing is enumerated. There are a few obligations
for each table, order, deferred state and statement of the program; pairs of lines come only into runs.

Modules, in the order the data flows: `environment` (which buffers link which levels), `facts` (what is declared of
them), `watched` (monitors of requirements beside a cycle), `transition` (a cycle as nodes), `given` and `walk`
(extern procedures, random runs), `predicates`, `properties` (invariants and properties that the program states), `obligations`, `claims`
(with what they take for granted);
`variants` are programs under other rules, `beginning` other values to search runs from.
"""
