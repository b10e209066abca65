"""A system as processes: one a level, one for each thing that stands outside.

`block` is shared memory that is cleared away, `memory` the buffers in it, `serve` runs one level or one thing outside, `supervisor` begins
them, watches their pulse and stops them.
"""
