"""One table: exactly one line matches every input, or a least input at which that fails.

A *gap* is an input that no line matches, an *overlap* one that two lines match; a *dead* line matches none. A
*witness* is the least such input in declared order, and a *region* the largest box around it that was found. Where
every test looks at one leaf, lines are boxes, and two things decide exactly-one without a solver: the boxes are
disjoint in pairs, and their sizes add up to the size of the input space. Here 41 and 70 keys of 111:

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.solvers.options import Options
>>> from rcsc.proof.table.decide import prove_table
>>> program = compile_text('''
... input width_mm : int 0 .. 110 [mm]
... output order : bool
... table grip {
...   | line | width_mm || order |
...   |------|----------||-------|
...   | held | 0 .. 40  || true  |
...   | wide | > 40     || false |
... }''')
>>> verdict = prove_table(program, program.tables[0], Options())
>>> (verdict.findings, verdict.backing.method, verdict.backing.confirmed_by_z3)
((), 'boxes', True)

A word whose bits are looked at one by one is as many axes (`regions.word_bits`): masks are boxes of bits.

Tests across variables, and assumptions, take a tree of regions (`regions`), and Z3 for what is not linear. Trusted,
without `rcsc certify`: `boxes`, `relational`, `regions` and what they rest on; by default Z3 confirms
what it can within a budget, and a disagreement is a bug in rcsc. With `Options(solver="z3")` Z3 alone decides (`confirm`).

Two searches find a least witness. For boxes `regions.partition` counts, which tells the first slice with a gap without a
question; everywhere else a solver or a simplex is asked, and `rcsc.proof.solvers.search` bisects with few questions.

What it costs: pairs of lines and slices of keys for boxes, a budget in steps for the rest; what is over it is
undecided, and fails.

Modules, in the order the data flows: `program` (a whole program), `decide` (which way), `boxes`, `relational`,
`confirm` (Z3), `cover` (where a condition holds), `verdict` (findings as data), `certificate` (which `rcsc.proof.certify`
checks anew), `cells` (keys as cells), `repair` (proved before shown), `findings` (which to tell), `diagnose`,
`mending` (what is proposed, tried in the text).
"""
