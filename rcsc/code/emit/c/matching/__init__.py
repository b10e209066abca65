"""The C that finds the line of a table: classes of values, masks of lines, the bit that is left.

A table of masks has a word for each class of a leaf, or for each combination of classes of several leaves: a bit for each
line that the class does not exclude. The words that the inputs choose are joined by AND; the one bit left is the line.

| lines | shape |
|---|---|
| up to 64 | one word for all lines |
| more | as many words as it takes, one after another |

Neither takes anything from a proof: that two lines match, or none, is seen in the words themselves, in every cycle.

Modules, in the order the data flows: `classes` finds the place in a table, `masks` writes tables, and `lines` has the functions
that are called.
"""

from rcsc.code.emit.c.matching.lines import line_functions, match_function

__all__ = ["line_functions", "match_function"]
