"""Trees of regions: exactly-one for conditions across variables, by exact arithmetic.

An *atom* is `form in intervals`, where a form is a sum of leaves with rational factors, or a leaf that is not linear
and stands for itself. A *region* is a part of the input space with what is left of the conditions in it. A tree
splits the space until each leaf says why it needs no more: no point is left (`linear`, an exact simplex), one line
holds throughout and the others nowhere, or the lines left are boxes that part each other and fill the region
(`partition`, which decides tables of boxes, too).

For `distance_mm - tolerance_mm <= 0` beside `> 0` one split on the form `distance_mm - tolerance_mm` leaves two
regions with one line each:

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.solvers.options import Options
>>> from rcsc.proof.table.decide import prove_table
>>> program = compile_text('''
... input distance_mm : int 0 .. 2000
... input tolerance_mm : int 1 .. 20
... table near {
...   | line | distance_mm - tolerance_mm ||
...   |------|----------------------------||
...   | in   | <= 0                       ||
...   | out  | > 0                        ||
... }''')
>>> verdict = prove_table(program, program.tables[0], Options())
>>> (verdict.findings, verdict.backing.method)
((), 'tree')

The tree is the certificate: `rcsc.proof.certify` walks it again with arithmetic of its own. Trusted without that: all of
this room. What it costs: splits, which are counted and bounded; a least point within bounds takes a few dozen pivots, one of a
disjunction is bisected.

Modules, in the order the data flows: `atoms`, `ends` (which lines a cut parts), `linear`, `holes` (of boxes that overlap), `partition`,
`word_bits` (words as boxes of their bits), `region`, `points` (within bounds), `splitting`, `least`, `enclosing` (bounds of terms that are
not linear), `counting` (how many inputs).
"""
