"""One program proved: its procedures, its tables, its lines; and a checker that shares nothing with the prover.

In: a resolved `Program` (`lang`). Out: a proved program, or the least input at which exactly-one fails.

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.solvers.options import Options
>>> from rcsc.proof.table.program import prove_program
>>> program = compile_text('''
... input n : int 0 .. 9
... output big : bool
... table size {
...   | line | n   || big  |
...   |------|-----||------|
...   | high | > 4 || true |
... }''')
>>> [str(one.code.value) for one in prove_program(program, Options()).findings]
['RCS401']

Trusted: Z3 and the rooms before `table`, or `certify` in their place, for what it checks. Budgets are in steps: a verdict does not
depend on the machine.

Rooms, in the order in which they may use each other: `solvers` asks Z3, cvc5 and PySAT; `symbolic` makes terms of expressions and
statements; `relation` says whether two do the same, which line leads where and which follows which; `procedures` proves what procedures
owe; `table` proves exactly-one; `certify` checks a certificate anew.
"""
