"""Symbolic execution: expressions and statements as a graph of values.

A *node* is a value with bounds, made of variables and constants (`values`). `evaluation` gives the node of an expression, and what
evaluating it owes; `execution` follows statements through every branch; `effect` is what actions do as a whole. Nodes become solver terms
in three theories: `encode` (exact integers and doubles), `keyed` (bounded integers, for whole cycles), `measured` (sums of reals);
and clauses in `bits`. `trial` looks for counterexamples by running the interpreter where doubles make a solver slow.
"""
