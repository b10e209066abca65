"""Requirements across levels: what is said of them, held against all runs of small systems, and against the levels' executors.

Modules beside the tests: `drawn` (tiny systems), `truth` (every run of one, by cycles that are looked up), `held` (answers against that),
`slips` (mutants of systems, likewise), `systems` (systems of one shape, and their executors), `__main__`: many, `python -m tests.across`.
"""
