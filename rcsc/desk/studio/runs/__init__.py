"""A run in the studio: a system that runs, or a log, and where on its time line everybody looks.

The system is a session of `rcsc shell`, and what the pages ask of it is what the shell does: nothing is done otherwise here than there.
What it did is kept as a log is (`history`), so that one way of showing serves a run and a file.

    ask("run.type", {"line": "step 5"})               the shell's command, and the shell's answer
    ask("time.moment", {"tick": 5})                   every level in that tick
    ask("time.why", {"tick": 5, "level": "task"})     each line of the tables that it tried, and what of it did not hold

>>> from rcsc.desk.studio.runs.history import History
>>> History().era
0

What it costs: a copy of each level's values a cycle, kept once where they come again. Nothing here is trusted for a verdict.

Modules, in the order the data flows: `live` is the session, `history` what it did, with what nobody had set; `logs` opens files, with
what each breaks; `shown` is a run as pages draw it, `watching` which requirements over time it breaks; `timeline` answers about any tick
of either.
"""
