r"""The language server: what `desk.editor` answers, in the protocol that editors speak (LSP 3.17, by pygls); the only room that knows it.

In: messages on standard input. Out: messages on standard output. Texts are taken whole, and cut into lines as the protocol says, so
that no editor's idea of a line is needed; columns count what the client asked for.

Findings come as they are typed: after each change what is open is checked again, the changed file first, once the keys rest for a
moment. A check that is outdated is given up between two tables. Who asks for findings (pull) gets them so; others are sent them
(push). After each check `rcsc/status` says the standing of every table, the same that lenses and hovers say.

One thread proves, another reads and answers what needs no proof, so that a long proof delays neither hover nor completion. Whatever a
handler raises is the answer to that one request.

>>> from rcsc.desk.editor.places import Area, Lines, Place, Units
>>> from rcsc.desk.editor.server.convert import Converter
>>> asked = Converter({"/a.rcs": Lines("# \U0001f916 x\n")}, Units.UTF_16).range(Area("/a.rcs", Place(0, 4), Place(0, 5)))
>>> asked.start.character, asked.end.character
(5, 6)

Modules: `convert` (places, findings and edits in the protocol's types), `session` (what is open, and when it is checked),
`features` (what is asked about names and layout), `findings` (findings, repairs, lenses and shares), `serve` (the server put
together).
"""
