"""The inputs on which the executors run.

Inputs are drawn by seed and lean on edges, or are looked for: an *MC/DC vector* is a pair of inputs that differ in
the outcome of one condition of a line and in whether the line matches, which shows that the condition matters. The
search takes the condition's sides apart and finds an input for each by the same region trees that decide a table,
without a solver.

`coverage` adds what the rest of the C needs, and writes all of it for other test benches.

>>> from rcsc.code.testing.inputs import vectors
>>> "MC/DC" in vectors.__doc__
True

Nothing here is trusted: an input that leads nowhere costs a test, and the report counts what has no vector.

Modules, in the order the data flows: `snapshot` finds an input in which conditions hold or fail, `vectors` makes
MC/DC vectors of them (`condition_text` words their conditions), `sampling` draws inputs by
seed.
"""
