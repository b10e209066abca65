"""Slips in the generated C that the vectors must notice: `python -m tests.slips`.

In: the emitted C of a proved program, and its vectors. Out: for each slip whether a vector notices it; for one that none notices, whether
it is equivalent, and by what. The operators (`drawn`) are those of a hand that writes C, and others than `rcsc test --deep` has
(`rcsc/code/testing/code_mutants.py`): constants a little off, variables of one type swapped, statements lost, doubled or in another
order, bounds replaced, arms of a choice dropped. `text` reads the C, `played` compiles all slips of a program at once, each chosen
by a number when it runs, and judges what lives.
"""
