r"""Tables in the studio: a grid and a text of one file, what is proved of it, and its graph.

A file is opened once for all pages (`document`): its text, one history of changes, and what is on disk, which nobody overwrites unseen.
A change comes as an edit of the text or of cells (`cells`), names the version that its page has seen, and is told to all. After it the
text is looked at in another thread; what is known of an older text is never shown beside a newer one.

>>> from rcsc.desk.studio.tables.cells import with_cells
>>> text = "input a : bool\ntable t {\n| line | a ||\n|------|---||\n| 1 | true ||\n}\n"
>>> print(with_cells(text, "t", {(0, 0): "false"}).splitlines()[-2])
  | 1    | false ||

A cell is what was typed, or nothing is changed: after each change the table is read again from the text. What a grid shows of findings,
repairs and standings is the editor's answer (`rcsc.desk.editor`), which is that of `rcsc check`. Trusted: nothing here for a verdict.

Modules, in the order the data flows: `document`, `cells`; `shown` is what pages get; `desk` has the open files and looks at them;
`editing` and `proving` answer pages, `writing` helps who writes the text.
"""
