"""The generated-code test suite of `rcsc test`.

In: a program and the code generated from it. Out: figures and diagnostics. The executors are compared with the
interpreter and with a second, independent C (the *reference*, a plain scan of the lines): line, fault, failed
assumptions and the whole state have to be the same. Inputs lean on edges: every constant that a leaf is compared
with, its neighbours, and the ends of its range. So a few keys see every boundary:

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.code.testing.executors.edges import leaf_edges
>>> program = compile_text('''
... input width_mm : int 0 .. 110 [mm]
... table grip {
...   | line | width_mm ||
...   |------|----------||
...   | low  | <= 40    ||
...   | high | > 40     ||
... }''')
>>> sorted(leaf_edges(program)["width_mm"])
[0, 1, 39, 40, 41, 42, 109, 110]

*Mutants* show that the tests bite: a slip of the hand in a table must be noticed by the prover or the tests, a
changed bit of the C by the matcher's check, the suite or ESBMC. Nothing here is imported by other commands, and no
solver, but for Z3 in `coverage` and ESBMC with `--deep`, in a process of its own.

Trusted: nothing for a verdict of `rcsc check`. What it costs: seconds a table by `--examples` and `--mutants`;
minutes with `--deep`.

Modules, in the order the data flows: `executors`, `inputs`, `coverage` (rooms: the last one makes vectors that
cover the whole C); `matcher` compares every mask with the table, `agree` compares the executors
and looks for inputs on which they differ, `boards` emulates processors, `cortex` runs the C on a Cortex-M3, `target_coverage` has its
compiler count what vectors reach, `esbmc` proves the C; `apart` runs edited code in a process of its own; `mutants` and
`code_mutants` try the suite itself; `figures` counts, `suite` is all of it on one screen.
"""
