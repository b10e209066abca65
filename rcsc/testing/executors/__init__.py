"""What the suite runs: the emitted executors and the reference, after one interface.

`symbols` reads what the emitted code calls things, `targets` lists what is tested, `edges` gives the values at which something can
change. A *session* is a run of cycles (`sessions`); `equality` says when two values are the same. `native` builds the C with a `shim`,
`python` runs the Python, `reference` and `reference_file` write the program in plain C; `externs` stand in for extern procedures.
"""
