"""A plan to files: names, expressions spelled, templates rendered."""

from rcsc.emit.c99 import emit_c
from rcsc.emit.python import emit_python

__all__ = ["emit_c", "emit_python"]
