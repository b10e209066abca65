"""Relations between lines: which follows which, and whether two tables do the same.

A line *leads* from a value of the state variable to another where its actions can make it so; it can be *followed* by
a line that can match in the next cycle, whatever comes in then. Both are questions about one or two cycles as values
(`symbolic`), put to Z3:

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.relation.same import compare
>>> from rcsc.proof.solvers.options import Options
>>> def program(cell):
...     return compile_text(f'''
... input n : int 0 .. 9
... output big : bool
... table size {{
...   | line | n      || big   |
...   |------|--------||-------|
...   | low  | <= 4   || false |
...   | high | {cell} || true  |
... }}''')
>>> first, second = program("5 .. 9"), program("> 4")
>>> type(compare((first, first.tables[0]), (second, second.tables[0]), Options())).__name__
'Same'

Two tables are the *same* if for every input the same line outcome has the same effect on every leaf; else `Differs`
has the least input. Used by `graph` (round trips), `diff` and the shell's `reload`; no verdict of `rcsc check` rests
on it. Trusted for what those say: all of it, and Z3.

Modules: `steps` (which line leads from which state to which), `follow` (which line comes after which), `same`, `under`
(which lines can match where a condition holds).
"""
