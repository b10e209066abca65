"""The emitted C matcher is its table, for all inputs.

A matcher looks up one mask a variable and joins them by AND. So it is its table for all inputs if each variable's
lookup alone is right: for each of its values the mask has exactly the bits of the lines whose tests of that variable
hold. That is a check for every value of every variable, and not for every combination: three variables of a thousand
values take three thousand lookups, not 10^9.

The masks are read from the emitted C itself, not from the plan that it was made of, and looked up once more by a
compiled self-test, so that the compiler is in it, too. A group of variables that share a table is checked for each
combination of the group.

>>> from rcsc.code.testing.matchers import matcher
>>> matcher.__doc__.splitlines()[0]
'The emitted C matcher is the table, for all inputs: a complete check a variable at a time, for any size.'

Trusted for this: that the emitted function does join the masks by AND, which the reader insists on by the form of the
text. What it costs: the sizes of the variables, in all.

Modules, in the order the data flows: `matcher_text` reads mask tables and index expressions from the emitted C; `matcher_c` makes the
self-test that runs them compiled, `cells` compares what it gives a variable at a time, and `matcher` puts them together.
"""
