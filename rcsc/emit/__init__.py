"""A proved program to files in C and Python.

A *plan* is the shape of the executors in no language. Each leaf that a table tests has *classes*: values that no line
tells apart. A *mask* has one bit a line; each class of each leaf has one. Matching joins one mask a leaf by AND, and
the one bit left is the line, so that it costs the same whatever the input. That exactly one bit is left is proved,
and still checked in every cycle.

>>> from rcsc.emit.lower import lower
>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.solvers.options import Options
>>> from rcsc.table.program import prove_program
>>> program = compile_text('''
... input wide : bool
... output order : bool
... table grip {
...   | line | wide  || order |
...   |------|-------||-------|
...   | held | false || true  |
...   | over | true  || false |
... }''')
>>> plan = lower(prove_program(program, Options()).proved)
>>> [probe.masks for group in plan.tables[0].matcher.groups for probe in group]
[(1, 2)]

Nothing is emitted that was not proved: `lower` takes what only the prover makes. The same program gives the same
bytes on every machine: no time, version or absolute path is in them. Trusted: all of it, for what the executors do;
`rcsc test` holds them against the interpreter, and with `--deep` has the C proved.

Modules, in the order the data flows: `lower` makes a `plan`; `identifiers` spells every name; `ctext` and `pytext`
spell expressions and statements, `c99` and `python` whole files by the templates of `rendering`, `symbols` the symbol
file; `write` writes them or says whether they are fresh.
"""

from rcsc.emit.c99 import emit_c
from rcsc.emit.python import emit_python

__all__ = ["emit_c", "emit_python"]
