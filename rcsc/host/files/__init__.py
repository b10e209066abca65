"""Files: written whole or not at all, and read within bounds.

A log, a symbol file, a description, a journal, a graph or a cache entry may come from anybody. `read` bounds its size and its nesting
before it is parsed, and hands out each value as the kind that it must have; `names` says what may become the name of a file or of a thing
in C. No other module parses text from outside, and none writes a file by itself; `tests/host/test_outside.py` holds every module against
that.
"""

from rcsc.host.files.write import csv_text, write_atomically, written_whole

__all__ = ["csv_text", "write_atomically", "written_whole"]
