"""Executors of a proved program, and how they are held against its tables.

In: a proved program. Out: C and Python that do in each cycle what the tables say, and what `rcsc test` says of them.

>>> from rcsc.code.emit import TARGETS
>>> sorted(TARGETS)
['c', 'python']

The emitters know nothing of the prover: they take the program, and no claim about it. The tests take the text that was written, as
who compiles it does, and compare it with the one meaning of the tables (`lang/interpret.py`).

Trusted: `emit`, for what runs. What it costs: writing is linear in the tables; tests are budgeted.

Rooms, in the order in which they may use each other: `emit` lowers a program to a plan in no language and spells it; `testing` runs
executors on edges of every input, compares the masks of the C for every value, and measures what the vectors cover.
"""
