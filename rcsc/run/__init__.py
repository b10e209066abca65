"""The robot control system at run time: generated executors, the buffers between them, and the cycle.

In: generated files and the description of the system, `system.toml`. Out: levels that run, one control *tick* at a
time. A *buffer* keeps the latest value that was published under its name; nobody waits for anybody. In a tick each
level that is due takes the latest values, runs one cycle, and publishes its outputs; a *feed* fills an input from the
database before that.

>>> from rcsc.run.buffers import CommonMemory
>>> buffers = CommonMemory()
>>> buffers.latest("task.to_emove") is None
True
>>> for number in (1, 2):
...     buffers.publish("task.to_emove", {"inc_command": number})
>>> buffers.latest("task.to_emove")
{'inc_command': 2}

The compiler is not needed here: a program is known by the symbol file beside its executor (`signature`); whom it serves and commands
is read in its tables, unless all buffers are written. C and Python
executors are behind one interface and leave the same bytes. Trusted: `system.toml`, the plant that it names, the generated folder and what
extern procedures do; logs and symbol files may come from anybody and are read within bounds. A tick copies each
level's state; it does not depend on the number of lines.

Source: Haynes et al. 1984, sections 8 and 9. Modules, in the order the data flows: `declared_plant` and `description`, `links` (declared
alike at both ends), `signature`, `executors` (no forced ones), `answers` (what externs give in a finding's run), `buffers`, `levels`,
`adopt` (starting again), `faults` (of plants), `system`, `unset` (which numbers nobody has set yet); rooms `orders` (scripts), `plant`
(what moves), `log`, `processes`, `link` (the C of a whole system), `episodes` and `campaign` (many of them).
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any


class _Room(ModuleType):
    """This room, which is a function as well: `rcsc.run("system.toml")` is that of `rcsc.front.api`."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Run a system, as `rcsc.front.api.run` says."""
        return import_module("rcsc.front.api").run(*args, **kwargs)


sys.modules[__name__].__class__ = _Room
