"""The front doors: the command line, and `import rcsc`.

In: what people type, or call. Out: a report as text and an exit status, or as values.

>>> from rcsc.front.commands.group import COMMANDS
>>> "check" in {name.rpartition(".")[2] for name in COMMANDS}
True

A door has options, one call, and a form in which the report is shown; what is decided is decided by the stages. The doors do not use
each other. Heavy packages are imported when a command has been named that needs them.

Trusted: that a status is that of the report.

Rooms: `commands`, one module for each command (`group` names them), and `api`, whose names are those of `import rcsc`.
"""
