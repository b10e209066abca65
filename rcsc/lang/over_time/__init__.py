"""Requirements and assumptions over time, each as a deterministic monitor.

A *requirement* has a *scope* (in which cycles it applies), a *trigger* (which of these ask for something), a *timing* (when it has to
come) and a *response* (what has to hold). The scope cuts a run into *intervals*, each judged by itself. A *monitor* looks at each cycle
once, keeps a few truth values and bounded counters, and tells in which cycle the requirement is broken. So what is said of time is a
condition on one cycle and these states, and whoever proves a property, or watches one, does it as ever. One thing no cycle breaks: that
something comes *eventually*. Of that a monitor tells in which cycles it waits; in every cycle from some cycle on it is never to do so.

>>> from rcsc.lang.model import Bool, Read, VariableName
>>> from rcsc.lang.over_time import Past, Requirement, Timing, Trigger, begun, monitored, stepped
>>> asked, given = (Read(VariableName(name), Bool()) for name in ("asked", "given"))
>>> monitor, kept = monitored(Past("answered"), Requirement(Timing.WITHIN, given, Trigger.WHEN, asked, cycles=2))
>>> state = begun(monitor)
>>> for cycle in ({"asked": True, "given": False}, {"asked": False, "given": False}, {"asked": False, "given": False}):
...     state, good = stepped(monitor, kept, state, {}, cycle)
...     print(good)
True
True
False

Words, scopes and timings: Giannakopoulou, Pressburger, Mavridou and Schumann, *Automated formalization of structured natural language
requirements*, Information and Software Technology 137 (2021). Each monitor is held against the formulas that FRET publishes.

An assumption over time is the same of what comes from outside. It reads what the level writes as the cycle before left it
(`Past.as_found`): so the inputs of a cycle tell whether it is kept.

Trusted: all of it, for what a requirement means. Cost: a monitor has at most six states besides the truths that it looks at, but for
*exactly after* in an `only` scope, which has one for each cycle of its time.

Modules, in the order the data flows: `past` (what conditions remember), `requirement` (what is said), `monitor` (its states and
statements), `run` (a monitor over a run).
"""

from rcsc.lang.over_time.monitor import Rank, bounded, monitored
from rcsc.lang.over_time.past import Past
from rcsc.lang.over_time.requirement import Requirement, Scope, Timing, Trigger
from rcsc.lang.over_time.run import Watch, begun, stepped

__all__ = [
    "Past",
    "Rank",
    "Requirement",
    "Scope",
    "Timing",
    "Trigger",
    "Watch",
    "begun",
    "bounded",
    "monitored",
    "stepped",
]
