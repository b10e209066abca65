"""The solvers, each behind a small typed face and each imported here alone.

A *question* is whether asserted terms hold together for some values. Its answer is that they do, that they do not, or
*unknown*; unknown is never taken for a proof. A question has a budget of steps, the solver's own, which are the same
on every machine:

>>> from rcsc.lang.model import Int
>>> from rcsc.proof.solvers import smt
>>> width = smt.variable("width_mm", Int(0, 110, ()))
>>> solver = smt.Solver()
>>> solver.add(smt.negation(smt.at_most(width, smt.literal(Int(0, 110, ()), 40), Int(0, 110, ()))))
>>> solver.check(smt.equal(width, smt.literal(Int(0, 110, ()), 30), Int(0, 110, ())))
<Answer.UNSATISFIABLE: 2>

Trusted: Z3, wherever a verdict says that Z3 settled it. cvc5 is asked in text and has no part in any proof; it
answers what `rcsc certify` and `--certify` put to it anew. What PySAT says is only ever a hint, which Z3 confirms.
The processor's time is a backstop: what it ends is undecided, and is not kept for the next run.

Modules: `options` (how a proof is made), `search` (bisection that asks little), `smt` (Z3), `horn` (its Spacer), `smtlib` (cvc5),
`sat` (PySAT).
"""
