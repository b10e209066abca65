"""Draws small systems with requirements across their levels, and knows all of their runs.

`drawn` (tiny systems), `truth` (every run of one, by cycles that are looked up), `held` (answers against that), `slips` (mutants of
systems, likewise), `systems` (systems of one shape, and their executors).
"""
