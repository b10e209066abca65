"""Syntax tree to model: every name found, every expression typed, every cell a test.

In: the files of one root. Out: a `Program`, or every diagnostic of its names, kinds, units and ranges.
"""

from rcsc.lang.resolve.program import compile_text, resolve

__all__ = ["compile_text", "resolve"]
