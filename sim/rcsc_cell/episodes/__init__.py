"""Episodes: one run of the cell with whatever is odd about it.

An `episode` is a value; `sampling` draws one by seed, `part_faults` names what is odd in it. `setting` makes
what a run needs, `operator` interrupts its script, `transport` harms its buffers, `loop` runs it and watches its properties. `witness`
watches a run for page and report, `processes` runs what stands outside in a process of its own.
"""
