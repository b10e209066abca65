r"""Names in texts: where each is declared and used, what it is, what could be written, and how one is renamed.

In: files as parsed, and the program where it resolves. Out: occurrences, texts for people, edits. Each kind of name has a space
of its own, as in the language: an enumeration's member and a procedure may be called alike. Locals and parameters belong to their
procedure, lines to their table. Which of several equal fields of records is meant is not worked out: going to it shows all,
renaming it is refused.

>>> from rcsc.base.diagnostics.source import Source
>>> from rcsc.desk.editor.names.index import occurrences
>>> from rcsc.lang.syntax.parse import parse
>>> file = parse(Source("a.rcs", "enum mode { off, on }\ninput now : mode = off\n"))
>>> [(each.text, each.space.value) for each in occurrences(file) if each.declares]
[('mode', 'type'), ('off', 'member'), ('on', 'member'), ('now', 'value')]

Modules: `index` (occurrences), `find` (the one at a place, its declarations and uses), `about` (what is known of it, for people), `rename`,
`complete` (what could stand at a place), `tokens` (what each word is, for colours).
"""
