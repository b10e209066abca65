"""Episodes: runs of a whole system in which anything goes wrong that its declarations allow, with every property watching.

In: a description, compiled, and the sources of its levels. An *episode* is a value: orders to the levels that are ordered from outside,
and faults with the ticks in which they are at work. Nobody writes down what can go wrong; it follows from what is declared. A buffer
of `[buffers]` can lose, delay, double or repeat values; a level can start anew; a field from outside can hold a value of the edge of its
range, beside a threshold of a table, or one that the level must refuse; a plant can do what its fields of type `Fault` say:

>>> from rcsc.run.episodes.episode import BufferFault, Episode, OrderSpec, Restart
>>> order = OrderSpec("supervisor", "dock", wait=3)
>>> episode = Episode(orders=(order,), harms=(BufferFault("drive.report", "late", 20, 40, ticks=8),))
>>> Episode.from_json(episode.to_json()) == episode
True
>>> print(episode.script(), end="")
command,cycles
,3
dock,

Out: an `EpisodeOutcome`. In each cycle it is asked whether exactly one line matched, every assumption held, every order was taken once and
answered for good, every command ends in time once nothing goes wrong, and whether the `property` declarations of the tables and the
plant's own methods with the result `Property` hold. Only an older value that comes again breaks what the proofs rest on; what follows
from it is *excused*, with the fault that explains it, and so is what a false reading makes untrue of an assumption about it, and what comes
after an assumption over time was broken.

Where no plant is given, what comes from outside moves in its range, and whoever is ordered obeys (`subordinates`). What was proved of the
levels is watched as well (`proved`).

The same seed draws the same episode; the same episode has the same outcome, with the executors in C and those in Python; with `both` they
run side by side, and a difference is a finding. Trusted:
the plant, and the reference interpreter for what a property means. An episode proves nothing: that is `rcsc prove`. It costs some 0.1 ms a
cycle and level.

Modules, in the order the data flows: `episode` and `outcome` (values), `stand` (what a system declares), `operator` (who orders),
`subordinates` (who obeys, where there is no plant), `cycle` (what a property sees), `proved` (what was proved), `properties`, `across`
(requirements across levels), `harm` (buffers in which something goes wrong, and whose fault it is), `loop` (runs one), `sampling` (draws
one, by seed or for Hypothesis).
"""
