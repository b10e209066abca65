"""Relations between lines: whether two do the same, where one leads, and which follows which.

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

Two runs do the *same* if they come to their end alike, call the same extern procedures in the same states with the same
values, and leave every leaf the same; two tables do if that holds of the outcomes that they have for an input. Else
there is a least input for which it does not. Every room that compares asks here: `procedures` (lines that are said to
do the same), `table` (what overlapping lines leave different), `graph` (round trips), `diff` and the shell's `reload`.

Trusted for what those say: all of it, and Z3. Of the verdicts of `rcsc check` only *same* between two lines rests on it.

Modules: `effect` (what actions do), `questions` (put to Z3), `alike` (two lines), `same` (two tables), `steps` (which line
leads from which state to which), `follow` (which line comes after which), `under` (which lines can match where a
condition holds).
"""
