"""Requirements across levels: what is said of them, held against all runs of small systems (`judge`), and against the levels' executors.

Many systems: `python -m tests.across`.
"""
