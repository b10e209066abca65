r"""What an editor asks of tables while they are typed: findings, repairs, standings and tables as data, without any editor's protocol.

A `Workspace` holds texts that are open over the files on disk. Of a file it answers what `rcsc check` would say of these
texts; of a text that is half written also what is found in the rest, with what is broken left out (`recovery`), marked
*meanwhile*. Nothing that is found so is ever called proved: a table of a text that is not in order is *stale*, or has errors.

>>> workspace = Workspace()
>>> workspace.open("/a.rcs", "input a : bool\ntable t {\n| line | a ||\n|------|---||\n| 1 | true ||\n}\n")
>>> answer = workspace.check("/a.rcs")
>>> [(finding.code, str(finding.area.start)) for finding in answer.findings]
[('RCS401', '2:7')]
>>> [str(table.standing) for table in answer.tables]
['refuted: no line of table `t` matches 1 of 2 (50 %) of the inputs']
>>> [repair.title for repair in workspace.repairs(answer.findings[0])]
['add a line to table `t` for all of the inputs that no line matches']

A repair is a change of the text that was made and checked before it is offered: the finding is gone, and no other has come.

Only what changed is proved again: an editor asks after each key. Verdicts are kept by what a table means (`memo`), so that
lines typed above it, comments and other tables cost nothing. Trusted: what `rcsc check` trusts, and that equal values of
`rcsc.lang.model` mean the same.

Modules, in the order the data flows: `places` (lines and columns), `values` (what is answered, with the four states of a table),
`memo`, `recovery`, `grid` (a table as data), `workspace`, `keys` (what keys do in tables), `lenses` (what actions do); then the rooms
`names` and `server`.
"""

from rcsc.desk.editor.workspace import Workspace

__all__ = ["Workspace"]
