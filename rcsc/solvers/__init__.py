"""The solvers, each behind a small typed face and each imported here alone.

`smt` is Z3, with the `options` of a proof; `smtlib` is cvc5, which is asked in text and has no part in any proof; `sat` is PySAT, whose
answers are confirmed by Z3. A question has a budget of steps, the same on every machine; what is over it is undecided, never proved.
"""
