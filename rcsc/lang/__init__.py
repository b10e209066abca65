"""The language: what a program is, and what it means.

A *program* is typed, flattened into leaves, and resolved (`model`). A *leaf* is a variable without parts:
a record's field, an array's element. A *key* numbers the values of a leaf in their order, and a *box* is a set of
keys as intervals. A *test* is one cell of a table as a condition. `interpret` is the one meaning of all this; the
provers and both executors are held against it.

>>> from rcsc.lang.interpret import matching_lines
>>> from rcsc.lang.resolve import compile_text
>>> program = compile_text('''
... input width_mm : int 0 .. 110 [mm]
... output order : bool
... table grip {
...   | line | width_mm || order |
...   |------|----------||-------|
...   | held | 20 .. 40 || true  |
...   | wide | > 40     || false |
... }''')
>>> [grip] = program.tables
>>> [matching_lines(grip, {"width_mm": width}) for width in (10, 30, 50)]
[[], ['held'], ['wide']]
>>> grip.lines[0].tests[0].box
((20, 40),)

Trusted: `syntax`, `expressions`, `resolve`, `leaves` and `model` for what a text means as a program, `interpret` and
`operator_table` for what it does. The rest is checked by what uses it. Everything here is linear in the text, but for constants, which are
folded, and arrays, whose elements count.

Modules, in the order the data flows: `operator_table` (each operator: its word, how tightly it binds, its meaning),
`syntax` (text to tree), `project` (which files belong together), `expressions`
and `resolve` (tree to `model`); of a model: `leaves` (what is read and written), `interpret`, `interval_sets`
(boxes), `meaning` and `digest` (names and digests of what a proof depends on), `questions` (a region's question as
conditions), `over_time` (requirements over time as monitors), `reserved` (words of C and Python), `restart` (what a level adopts that
starts anew), `hidden` (states that the compiler adds, of two programs). Between `expressions`
and `resolve` stands `protocol` (what a program gets that declares whom it serves and commands).
"""
