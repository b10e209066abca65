"""The levels once more, in another language and for another engine: a Promela model for Spin, made of the same program.

What `compose` proves rests on one translation (`transition`, `symbolic.execution`) and on its solvers. Here procedures, deferred states,
tables and modules are translated again, by other code, into what Spin's verifier runs state by state; assumptions, obligations, the
contract, and what the programs state are said again. It is a check of both by each other, **not a proof**: a *small instance* is looked
through, in which numbers go round after few, counters are short, the outside says few things, and reals are a few values (`instance`;
every reduction stands in the model's header). What is broken there is shown in the tables' words, and the reference interpreter is run on
it (`trail`).
That nothing is broken says that no fault shows in the instance, as far as it was looked through, which is also said.

A level stands alone in its environment by the contract, or with its subordinates, each with its real tables: then what the contract says
of them is not assumed but checked, which is `compose.__doc__`'s argument tried out. Steps are interleaved in every order: that is
any delay, repetition and skipping.

Modules, in the order the data flows: `cycle` (a cycle as one list of statements, and what is checked of it), `instance` (few values),
`liveness` (which values matter, and where), `lazy_copy` (choices delayed to their single use), `spell`, `assemble` (the whole model),
`selection` (which models a system is checked by); then `spin` runs it and `trail` says what came of it.
"""
