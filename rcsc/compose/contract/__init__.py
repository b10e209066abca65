"""One level, its environment, and what it owes in one cycle.

`environment` finds which buffers link which levels, `given` says what extern procedures may give. A *transition system* (`transition`) is a
level's cycle as nodes, from any state. `obligations` are conditions on one cycle, `properties` those of the program itself;
`claims` says what each rests on. `predicates` are what an invariant may speak of, `walk` gives states to begin with; `variants` are
programs under other rules.
"""
