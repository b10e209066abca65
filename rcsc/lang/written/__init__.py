r"""Tables as they stand in a text, parsed or not, and changes of them as changes of the text.

A proposal of a finding (`diagnostics.diagnostic.Proposal`) says by names what to write; here it becomes the text that it makes, laid out
as the file was. Nothing is trusted of what comes out: who calls a proposal proved has taken that text through the whole pipeline
(`rcsc.proof.table.mending`).

>>> from rcsc.base.diagnostics.diagnostic import Change, ChangeKind, Proposal
>>> from rcsc.base.diagnostics.source import Source
>>> from rcsc.lang.written.changes import with_proposal
>>> source = Source("a.rcs", "table t {\n| line | a ||\n| low | <= 2 ||\n}\n")
>>> print(with_proposal(source, Proposal("", "t", "", (Change(ChangeKind.CELL, "low", 0, ("<= 1",)),))).splitlines()[2])
| low | <= 1 ||

Modules: `tables` (rows, parts and cells), `changes`; `upgrade` (older forms rewritten), `starts` (start values written out).
"""
