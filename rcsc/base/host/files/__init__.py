"""Files: written whole or not at all, and read within bounds.

A log, a symbol file, a description, a journal, a graph or a cache entry may come from anybody. `read` bounds its size
and its nesting before it is parsed, and hands out each value as the kind that it must have; `names` says what may
become the name of a file or of a thing in C. No other module reads a file or the standard input, parses text from
outside, or writes a file by itself; `tests/host/test_outside.py` checks every module for that.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from rcsc.base.host.files.read import Malformed, json_of
>>> with TemporaryDirectory() as folder:
...     path = Path(folder, "a.json")
...     write_atomically(path, b'{"levels": ["task"]}')
...     json_of(path.read_text())
{'levels': ['task']}
>>> try:
...     json_of("[" * 9_999 + "]" * 9_999)
... except Malformed:
...     print("refused")
refused

A file is written beside its place, flushed to disk and moved there, so that a kill or a full disk leaves the old one.
Trusted: the operating system for that move. What it costs: one pass over the text before it is parsed.

Modules: `read`, `names`, `write`; `plain` makes plain data of frozen values and reads them back by their declared
types.
"""

from rcsc.base.host.files.write import csv_text, write_atomically, written_whole

__all__ = ["csv_text", "write_atomically", "written_whole"]
