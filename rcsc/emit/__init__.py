"""A proved program to files in C and Python.

`lower` makes a `plan`, which is in no language: classes, masks, their grouping. `identifiers` spells every name; `ctext` and `pytext`
spell expressions and statements, `c99` and `python` whole files by the templates of `rendering`, `symbols` the symbol file; `write`
writes them or says whether they are fresh.
"""

from rcsc.emit.c99 import emit_c
from rcsc.emit.python import emit_python

__all__ = ["emit_c", "emit_python"]
