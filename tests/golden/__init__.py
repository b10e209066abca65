"""What every command says and writes of the shipped tables, the gallery, the dock and the templates, kept to be compared.

`python -m tests.golden` runs all and shows what differs, with status 1; `--write` keeps what is said now, `--only WORD` runs those whose
name has the word, `--list` names them. It takes some minutes, and is no part of `pytest`: `tests/golden/test_golden.py` runs a few.

In: `subjects.py`, the folders and the commands on each. Out: `kept/SUBJECT/COMMAND.txt`: the status, what is printed, and of each file
that is written its size and digest, MAKE BOXT's log included. Figures of time are left out; of a long text a digest stands for the rest.
"""
