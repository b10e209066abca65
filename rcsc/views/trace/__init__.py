r"""Traceability: from a requirement to lines of tables, to generated code, tests and proofs, and back from each line of code.

In: proved programs, their emitted files, test vectors and verdicts. Out: a matrix of each program, as data, as a page, as CSV and
JSON, and findings: code that comes from nothing, requirements without a place, a kept matrix of another version.

The code is read back from its text, as a reviewer reads it, by names alone: no map that the emitter made of itself is believed. Every
line of C and of Python that is not blank lies in a piece with an origin, or is a finding.

>>> from rcsc.views.trace.chunks import chunks
>>> [chunk.function for chunk in chunks("/* Why. */\nvoid f(void)\n{\n}\n")]
['f']

Trusted: the names, that is `emit.identifiers`. Whether the code of a line does what the line says is no question here: `rcsc test`
answers it. What it costs: a proof of the tables, and the search for vectors, which `--no-vectors` leaves out.

Modules: `origin` (what a piece comes from), `chunks` (C at file scope), `c_code` and `python_code` (files to pieces), `matrix` (all of
one program), `proofs` (verdicts, and properties as far as they are known), `requirements` (against a list), `tables_of` (CSV and JSON),
`page` (HTML), `answer` (one question), `collect` (all of it, for the command).
"""
