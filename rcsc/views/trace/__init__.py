"""Traceability: from a requirement to lines of tables, to generated code, tests and proofs, and back from each line of code.

In: proved programs, their emitted files, test vectors and verdicts. Out: a matrix of each program, as data, as a page, as CSV and
JSON, and findings: code that comes from nothing, requirements without a place, a kept matrix of another version.

The emitter says where each line of C and Python comes from (`emit.rendered`, `link.rendered_system`). Every line of C that is not blank,
and every line of Python, lies in a piece with an origin, or is a finding.

>>> from rcsc.code.emit.plan import Origin, Sort
>>> Origin(Sort.LINE, "acquire", "3").words
'acquire line 3'

Trusted: what the templates and the emitter say of their lines. Whether the code of a line does what the line says is no question here:
`rcsc test` answers it. What it costs: a proof of the tables, and the search for vectors, which `--no-vectors` leaves out.

Modules: `matrix` (all of one program), `across` (requirements across levels, by the lines that reach them),
`requirements` (their standing; against a list), `tables_of` (CSV and JSON), `kept` (a kept matrix against this one), `page`
(HTML), `story` (one requirement, for a page of its own), `answer` (one question), `collect` (all of it, for the command, with what is
proved), `names` (the data dictionary).
"""
