"""rcsc: proves robot-control state tables and emits their executors.

A *table* has lines. In every cycle exactly one line must match the inputs, and its actions run. `rcsc` proves that
for every input in the declared ranges, or shows the least input for which it is false:

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.solvers.options import Options
>>> from rcsc.proof.table.program import prove_program
>>> program = compile_text('''
... input width_mm : int 0 .. 110 [mm]
... output order : bool
... table grip {
...   | line | width_mm || order |
...   |------|----------||-------|
...   | held | 20 .. 40 || true  |
...   | wide | > 40     || false |
... }''')
>>> [one.message for one in prove_program(program, Options()).findings]
['no line of table `grip` matches 20 of 111 (18 %) of the inputs']

The wings, each of which imports only from those before it:

- `base`: findings, and the machine with its files, processes and cache;
- `lang` makes a program of text and says what it means;
- `proof` proves one program, compares lines and tables, and checks a proof anew with code of its own;
- `code` writes C and Python of what is proved, and holds them against the tables;
- `run` runs them as a system, with logs, episodes in which something goes wrong, and campaigns of them;
- `compose` proves levels together, for any delay; `driver` is the pipeline on one screen;
- `views` show what changed, what leads where, and what a safety case asks; `desk` is where people work: editor, shell, studio;
- `front` has the doors: `commands` are what people type, `api` what Python calls: `rcsc.check`, `rcsc.prove` and so on are
  imported when they are first asked for.

Trusted: `lang` for what a text means, `emit` for the executors, and either `certify` or the prover (the README has
the list with lines). What it costs: tables whose tests look at one variable each are decided without a solver; the
rest is budgeted in steps of the solver, so that a verdict does not depend on the machine, and what is over the budget
is undecided and never proved.
"""

import importlib
from typing import Any

__version__ = "0.1.0"
__all__ = [
    "Claim",
    "CodedError",
    "Consequence",
    "Diagnostic",
    "LoadedSystem",
    "Position",
    "Proof",
    "Report",
    "Requirement",
    "RowOutcome",
    "Run",
    "Severity",
    "Span",
    "Unproved",
    "Verdict",
    "__version__",
    "check",
    "compile",
    "load_system",
    "prove",
    "run",
]


def __getattr__(name: str) -> Any:
    """A name of `rcsc.front.api`, imported now: so that `import rcsc` costs nothing. Their types stand in `__init__.pyi`."""
    if name not in __all__:
        raise AttributeError(f"module `rcsc` has no attribute `{name}`")
    if name == "run":  # a room of that name, which is called as a function
        return importlib.import_module("rcsc.run")
    globals()[name] = value = getattr(importlib.import_module("rcsc.front.api"), name)
    return value


def __dir__() -> list[str]:
    """What a reader may ask for."""
    return sorted(__all__)
