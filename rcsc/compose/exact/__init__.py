"""Exact engines for one level: what the search over predicates leaves open is decided on its bits, its states, or its numbers.

A level in its environment is one transition system (`contract.transition`). `circuit` has it as gates, every finite type exact; all engines
answer questions about that, or about the same nodes as integers:

| module | engine | answers |
|---|---|---|
| `explicit` | search of all states, many at once in the bits of words | the shortest run, of thousands of cycles; or all states |
| `bounded` | cycles one after the other as clauses (`unrolled`) | the shortest run |
| `eventual` | the same search, and the same cycles | for how long a requirement waits; the shortest run on which it does for ever |
| `spacer` | Spacer, on integers (`solvers.horn`) | conditions on states that no cycle leaves |

`portfolio` is their face for proofs: cheapest first, budgets in steps. What an engine finds is said as conditions on leaves (`said`),
which are predicates like all others: so Z3 confirms them on words, a certificate holds them, and people read them. `played` is the face
for runs: the interpreter repeats each before it is shown. So neither gates nor engines are trusted. `export` writes the circuit for model
checkers of others; `shifted` tells which numbers of orders may go on in a lasso.

A light that counts to 30 before it may go on: the search over predicates knows of no number but those that the table compares; here
`wait <= 30 and (now = red or wait = 0)` is found because the level has 31 states of the first kind and one of each other.
"""
