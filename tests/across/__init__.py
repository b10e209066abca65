"""Requirements across levels. The judge runs the levels' own executors under `rcsc.run`, in every state and with all that may come.

Many drawn systems, and slips in them: `python -m tests.across`.
"""
