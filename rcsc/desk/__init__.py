"""Where people work: the editor, the shell, and the studio's page.

In: texts as they are typed, commands, what a page asks. Out: findings and proved repairs, levels that are stepped, one page with
tables, proof, run and cell.

>>> from rcsc.desk.editor.places import Area, Lines, Place, Units
>>> from rcsc.desk.editor.server.convert import Converter
>>> line = Area("/grip.rcs", Place(1, 4), Place(1, 8))
>>> Converter({}, Units.UTF_16).range(line).start.line
1

What is said here is what `rcsc check`, `rcsc prove` and `rcsc run` say: these rooms ask the same stages and show the same answers.
Nothing that a page sends is run or compiled but through the shell's commands and the prover.

Trusted: nothing here for a verdict. What it costs: an answer while one types, or it says that it is on its way.

Rooms, in the order in which they may use each other: `editor` answers about texts (`editor/server` speaks LSP), `shell` steps levels,
`studio` serves the page.
"""
