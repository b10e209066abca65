"""A proved program to files in each target's language.

A *plan* is the shape of the executors in no language. Each leaf that a table tests has *classes*: values that no line
tells apart. A *mask* has one bit a line; each class of each leaf has one. C joins one mask a leaf by AND, and
the one bit left is the line, so that it costs the same whatever the input. Python asks by nested ifs for what parts the
lines, which reads fewer leaves, and knows at each end which lines are left. That exactly one is left is proved,
and still told in every cycle: masks and ifs are made of the table alone, and take nothing from its proof.

>>> from rcsc.code.emit.lower import lower
>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.solvers.options import Options
>>> from rcsc.proof.table.program import prove_program
>>> program = compile_text('''
... input wide : bool
... output order : bool
... table grip {
...   | line | wide  || order |
...   |------|-------||-------|
...   | held | false || true  |
...   | over | true  || false |
... }''')
>>> plan = lower(prove_program(program, Options()).proved)
>>> [probe.masks for group in plan.tables[0].matcher.groups for probe in group]
[(1, 2)]

Nothing is emitted that was not proved: `lower` takes what only the prover makes. The same program gives the same
bytes on every machine: no time, version or absolute path is in them. Trusted: all of it, for what the executors do;
`rcsc test` compares them with the interpreter, and with `--deep` has the C proved.

Modules, in the order the data flows: `lower` makes a `plan`; `decision` parts its lines by cuts; `identifiers` spells
every name, free in its `scope`; `code_tree` is a small tree of code, which C and Python share, and its spelling in
each; `translate` makes it of expressions and statements, the room `c` and `python` of whole files, by the templates
of `rendering`, which keeps where each line of them comes from (`rendered`); `ranges` says what an analyser sees that
keeps ranges alone: where that is too little, the C says what was proved. `generated` writes the files
or says whether they are fresh. `TARGETS` names the languages: a new one is a module and its line here.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from rcsc.code.emit.c.c99 import outward, rendered_c
from rcsc.code.emit.plan import Plan
from rcsc.code.emit.python import rendered_python
from rcsc.code.emit.rendering import Rendered


@dataclass(frozen=True, slots=True)
class Target:
    """A language that executors are written in.

    Attributes:
        title: Its name in messages.
        rendered: Returns the files of a plan, by path below the generated folder, each with where its lines come from.
        outward: Yields each name that programs linked together share, with a description.
    """

    title: str
    rendered: Callable[[Plan], dict[str, Rendered]]
    outward: Callable[[Plan], Iterable[tuple[str, str]]] = lambda _: ()


TARGETS: Mapping[str, Target] = MappingProxyType(
    {"python": Target("Python", rendered_python), "c": Target("C", rendered_c, outward)}
)
"""By the name that `--target` takes."""


def emitted(plan: Plan, targets: Collection[str] = TARGETS.keys()) -> dict[str, str]:
    """Return the files of a plan in these languages, by path below the generated folder."""
    return {file: made.text for file, made in rendered(plan, targets).items()}


def rendered(plan: Plan, targets: Collection[str] = TARGETS.keys()) -> dict[str, Rendered]:
    """Return the same files, each with where its lines come from; nothing for what is no code."""
    made = (target.rendered(plan) for name, target in TARGETS.items() if name in targets)
    return {file: text for files in made for file, text in files.items()}
