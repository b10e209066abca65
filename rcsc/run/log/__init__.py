"""Logs of runs: written as they happen, read, replayed, exported and plotted.

In: a `System` that runs. Out: an MCAP file with the whole state of every level in every cycle, and what is made of
it. A log says enough of itself to be read without the tables: each channel has its layout and its program's
signature. It depends on the run alone, so that two runs that did the same are equal as files.

A *chain* of digests goes over every byte, and a *seal* ends it. A log that a kill cut off is read as far as its chain
holds; one that was changed is read up to the change and called so. The chain has no key, so it shows damage and not
who made the log. A chain made anew does not hide that a level lacks a cycle of its period, or that a log says of its levels what their
tables, whose digest it bears, are not. *Replay* takes each recorded state, runs one cycle with the recorded inputs, and compares every leaf
bit for bit; with other tables it says what they would have done.

    rcsc run make_boxt --plant kinematic --log boxt.mcap
    rcsc replay boxt.mcap --find 'task.cur_state = state_3'

>>> from rcsc.run.log.records import Seal
>>> [one.name for one in Seal]
['WHOLE', 'CUT', 'CHANGED', 'NONE']

Nothing in a log is trusted, compiled or run. What it costs: the bytes of the state a cycle, a second of the run at
most after a kill. Needs the extra `log`.

Modules, in the order the data flows: `schema` (what a log says of itself), `records` (the chain), `recorder`; `read`,
`states` (a state in words), `ticks` (a run, tick by tick), `finding` (what a finding's log adds), `queries` (conditions,
as people type them), `across` (requirements across levels, watched), `required` (requirements over time, watched), `replay`, `export`
(tables and pictures).
"""
