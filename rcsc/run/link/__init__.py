"""The C of a whole system: its levels, the buffers between them, and a `step()` that does what `rcsc.run.system` does.

In: a description, and for each level the plan of its program and its signature. Out: `c/NAME.h`, `c/NAME.c`, `c/NAME.cmake`
and `c/NAME.pc`. The levels' own C stays as it is; what is made here is one struct with the state of every level, what stands
outside (`in` and `out`, named as `[buffers]` names them), and what levels give each other (`between`).

A step is that of `System.step`: all levels that are due take what the step before left, then all run from the top down, then
all give. Each buffer has one reader, and all are read before the first level runs, so that one copy of each is enough.

>>> from rcsc.run.link import system_word
>>> system_word("dock", ["supervisor", "drive"]), system_word("gripper", ["gripper"])
('dock', 'gripper_system')

Trusted: all of it, for what the system's C does; `rcsc test` runs it beside the Python system, with restarts and refused
inputs, and compares every leaf of every cycle. What starts a level anew is asked of `rcsc.run.adopt`, as the Python system
does. Modules: `wiring` finds the places in C that a description speaks of; `system_c` spells the files; `drawn_script` draws what happens
to a system, and `beside` has its C and the Python system do it, tick by tick.
"""

from rcsc.run.link.beside import Beside, run_beside
from rcsc.run.link.drawn_script import drawing, script
from rcsc.run.link.system_c import emit_system, outward, rendered_system
from rcsc.run.link.wiring import Linked, linked, system_word

__all__ = [
    "Beside",
    "Linked",
    "drawing",
    "emit_system",
    "linked",
    "outward",
    "rendered_system",
    "run_beside",
    "script",
    "system_word",
]
