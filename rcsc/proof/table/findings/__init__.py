"""Findings of a table made ready to tell: which witness is shown, and which findings are told together.

In: what was found, with least witnesses. Out: the same, so that the finding that matters is not the twentieth, and its input one that can
happen. Two overlaps are *alike* where the same cells bring their lines together, cells of columns in which just one of the two says
something. PackML's published table has three groups of such overlaps for its 20:

    called = abort, done = true: `ClearedToAborting` with each of nine lines that end a state's work
    called = stop, done = true: `RunningToStopping` with seven of them
    called = hold, done = true: four pairs

Trusted: nothing. They choose among true findings, and propose what is then tried; each finding is in the JSON form, with a witness that the
interpreter can run.
Cost: a question to Z3 a finding that is shown, and only where the program declares facts that the table does not assume.

Modules: `told` (which witness is shown, and what is told together), `printed` (what mends a table printed the other way round, as it is
printed), `unread` (what is declared and nobody reads, or may not mean what was meant).
"""
