"""What procedures owe, and its discharge: nothing overflows, divides by zero, or leaves a range.

In: a program. Out: each obligation that does not hold, as a diagnostic with its cause and the least input that shows
it. Each is looked at in every line that calls the procedure, under the line's own tests:

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.solvers.options import Options
>>> from rcsc.proof.table.program import prove_program
>>> program = compile_text('''
... input take : bool
... state parts : int 0 .. 9
... procedure count { parts := parts + 1 }
... table grip {
...   | line | take  || procedures |
...   |------|-------||------------|
...   | more | true  || count      |
...   | rest | false ||            |
... }''')
>>> [finding.message for finding in prove_program(program, Options()).findings]
['the value can lie outside 0 .. 9, the range of `parts`']

First without the table's assumptions; where that fails, with the fewest that suffice, and the executors then stop a
cycle in which one of those fails. Trusted, without `rcsc certify`: all of it, and Z3.

What it costs: one question for all obligations of a program where all hold; else halves, until those that fail are
found. Obligations that bounds settle cost none.

Modules, in the order the data flows: `obligations` lists what a program owes, `discharge` puts it to Z3 and
gathers by cause what is not shown; `invariants` shows that invariants hold at first and that assumptions can hold
together, also those of tables that run in one cycle; `meetings` that lines which are said to do the same do.
"""
