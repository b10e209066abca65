"""Symbolic execution: expressions and statements as a graph of values.

A *node* is a value made of variables and constants, with bounds that enclose it. Nodes share what they have in
common, and what bounds decide is decided at once, without a solver:

>>> from rcsc.lang.model import Int, Op
>>> from rcsc.proof.symbolic import values
>>> width = values.variable("width_mm", Int(0, 110, ()))
>>> more = values.arithmetic(Op.ADD, (width, values.constant(width.kind, 5)), Int(0, 200, ()))
>>> (more.low, more.high)
(5, 115)
>>> values.compare(Op.LE, more, values.constant(width.kind, 200)) is values.TRUE
True

An *obligation* is what evaluating something owes on its path: no overflow, no division by zero, no index outside. A
*run* follows statements through every branch and joins the branches by choices, so that its graph grows with the
statements and not with the paths.

Nodes become solver terms in three theories: `encode` (exact integers and doubles as IEEE 754 has them; for one table
and its procedures), `keyed` (values as bounded integers, for whole cycles of levels) and `measured` (sums of reals,
for how far something goes); and clauses in `bits`, for a search whose result is confirmed on integers. `trial` looks
for counterexamples by running the interpreter where doubles make a solver slow.

Trusted, without `rcsc certify`: everything but `opened`, `bits` and `trial`, whose results others confirm. A run that is longer
than `MOST_STEPS` is not followed, and the program is then not proved.

Modules, in the order the data flows: `values`, `evaluation`, `execution`, then `opened`, `encode`, `keyed`, `measured`,
`bits`, `trial`, `remembered` (answers to questions asked before).
"""
