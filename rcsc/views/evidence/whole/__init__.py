"""Evidence of the C that links a whole system: `NAME.c` beside the C of its levels.

In: a linked system and all files that `rcsc compile` writes of it. Out: for each kind of evidence what it shows of that C, or why
it does not look at it; the index says both. The levels' own C has its evidence program by program.

>>> from rcsc.views.evidence.kinds import KINDS
>>> from rcsc.views.evidence.whole.kinds import LOOKS, PASSES
>>> sorted([*LOOKS, *PASSES]) == sorted(KINDS)
True

The C is played by drawn sessions: outside gives any values, mostly in their ranges; the user's functions answer anything; levels
start again and go on from copies, some of them spoilt. What a step must give is compared by `rcsc test`, beside the Python system.

Trusted: as everywhere in `rcsc.views.evidence`, the tools. What it costs: a minute a system.

Modules, in the order the data flows: `drawn` (C that plays the sessions), `kinds` (what each kind shows of the system).
"""
