"""Inductive invariants: found by PDR, confirmed by Z3.

A *cube* is a combination of values of predicates (`cubes`). `pdr` finds clauses that every cycle keeps, `search` gives it predicates
until they suffice, `confirm` asks Z3, by other terms, whether the clauses are an invariant: the search is not trusted.
"""
