r"""What is wrong, as data, and how it is shown.

A *diagnostic* has a code that is never renumbered, a message that stands alone, a span in a source text, labels, help
that says how to mend it, and perhaps a witness. A *span* is a file and two offsets; only `source` makes lines and
columns of them. User errors are such values; exceptions are for bugs.

>>> from rcsc.base.diagnostics.codes import Code
>>> from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
>>> from rcsc.base.diagnostics.render import one_line
>>> from rcsc.base.diagnostics.source import Source, Span
>>> source = Source("grip.rcs", "input a : int\ninput b : nowhere\n")
>>> diagnostic = Diagnostic(Code.UNKNOWN_NAME, "there is no `nowhere`", Label(Span("grip.rcs", 24, 31)))
>>> one_line(diagnostic, {"grip.rcs": source})
'grip.rcs:2:11: error[RCS201]: there is no `nowhere`'

Nothing here is trusted for a verdict. What comes from a user's file is made safe for a terminal, a log or a page
before it is shown.

Modules, in the order the data flows: `source` (named texts and spans), `codes` (what each code means, with its
example), `coded` (errors that know their code), `diagnostic`, `report` (what a command found and what backs it),
`alike` (rows that are folded into one); then the forms of a report: `render` (text; `printable` makes user text
safe), `jsonform`, `services` (SARIF, GitHub).
"""
