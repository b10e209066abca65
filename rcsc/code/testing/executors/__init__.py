"""What the suite runs: the emitted executors and the reference, through one interface.

A *session* is a run of cycles: inputs, states put in, steps of single tables. Its outcome is a record a
cycle, in words that all executors share: two executors agree when their records are equal. Values are
equal when their bits are, and any NaN equals any NaN:

>>> from rcsc.code.testing.executors.sessions import same_value
>>> (same_value(0.0, -0.0), same_value(float("nan"), float("nan")), same_value(1, 1))
(False, True, True)

The *reference* is plain C, written from the conditions of the table by a scan of its lines and not from the plan: a
second translation, on purpose. Extern procedures are stand-ins, the same in C and Python; nothing of the user's is
imported, linked or called.

Trusted: nothing for a verdict. The emitted C is built once by its content and runs rows of values in bulk, so that a
thousand cycles cost about one process.

Modules, in the order the data flows: `symbols` reads what the emitted code calls things, `targets` lists what is
tested, `edges` gives the values at which something can change; `sessions` are what is run and seen.
`native` builds the C with a `shim`, `python` runs the Python, `reference` and `reference_file` write the program in
plain C; `externs` stand in for extern procedures.
"""
