"""A system as processes: one a level, one for each thing that stands outside.

The paper ran its levels on several processors over common memory. Here each level is a process, the buffers are one
block of shared memory, and one process watches them all. A level's state and the buffers that it gives are committed
together: into a second slot, then by one word that names it. A writer that is killed in between leaves the old slot;
a reader that meets a writer sees by the slot's stamp and checksum that it has to try again:

    rcsc run make_boxt --processes

A diagnostic process reads all that is committed, before it is written over, and keeps the log of the run.

A level that dies is begun again from its last checkpoint, or anew: then what stands in its buffers is old, and it
gives PAUSE first. A level whose *pulse* stops is taken for hung and replaced. Nothing is left in shared memory or on
disk when the run ends, also after a kill: a keeper process sees to it.

>>> from rcsc.run.processes import memory
>>> memory.__doc__.splitlines()[0]
'Common memory of several processes: one block of shared memory for a whole system.'

Trusted: that a store of a machine word is seen whole. What it costs: a copy of each region in and out.

Processes run by the clock, and on a machine that is too busy for that they run slower, but not apart: none begins a
cycle while another is more than a period behind.

Modules, in the order the data flows: `block` is shared memory that is cleared away, `memory` the buffers in it,
`clocks` how far each process has come, `switches` the faults of plants that somebody switches, `serve` runs one level or one thing
outside, `diagnose` records them all, `attach` is for who looks at them and sets what they hold, `supervisor` begins them, watches their
pulse and stops them.
"""
