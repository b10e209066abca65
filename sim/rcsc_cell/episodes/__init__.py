"""Episodes: one run of the cell with whatever is odd about it.

An *episode* is a value: parts and where they lie, the rows of a script, and what goes wrong (a fault switched on,
buffers that lose or delay, a level that starts again, somebody who gives another command, a push). It is drawn by a
seed, and the same seed gives the same episode and, run again, the same log:

>>> from rcsc_cell.episodes.sampling import draw
>>> draw(7) == draw(7), draw(7) == draw(8)
(True, False)

Small values are nominal, so that what fails shrinks to a nominal run with the one odd thing that matters. It runs as an
episode of any system does (`rcsc.run.episodes`): buffers are harmed, levels begin anew, every cycle is watched and faults
explain what they break as there. The cell's own are its parts, its faults with their values, its script of rows with
interlocks, and its properties.

Nothing here is trusted for a proof. What it costs: without physics a twentieth of what it costs with physics.

Modules, in the order the data flows: an `episode` is a value; `sampling` draws one by seed. `operator` interrupts its
script, `loop` puts what it needs around the levels and watches the cell's properties; `kind` names what is odd in it,
and has all that as campaigns take it.
`witness` watches a run for page and report, `stage` is the cell as
the plant of its system.
"""
