"""What every stage stands on: findings as values, and the machine.

A stage that finds something wrong returns a *finding* with a code, the place in the text and help, or raises an error that knows its
code. What the machine gives (files, processes, tools, a cache) comes through one room, within bounds.

>>> from rcsc.base.diagnostics.codes import Code
>>> from rcsc.base.diagnostics.source import Source
>>> Source("grip.rcs", "table grip {").text
'table grip {'
>>> Code.SYNTAX.value
'RCS101'

Nothing here knows the language, and everything else may use it. Trusted: `host`'s cache, for the verdicts that it gives back.

Rooms, in the order in which they may use each other: `diagnostics` says what is wrong as text, lines, JSON and SARIF; `host` reads
within bounds, writes whole files, begins processes and keeps what earlier runs proved.
"""
