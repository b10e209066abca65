"""The emitted C matcher is its table, for all inputs.

`matcher_text` reads mask tables and index expressions from the emitted C, `matcher` checks them a variable at a time, `matcher_c` makes
the self-test that runs them compiled.
"""
