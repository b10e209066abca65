"""Small levels drawn at random, and what is true of them with some assignments off: every input in every state, by the interpreter.

One line runs in a cycle and each of its assignments once. So all inputs that stand for what an assignment writes may have one value a type.
"""

from collections.abc import Collection, Iterator
from itertools import product
from random import Random

from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import broken, one_cycle
from rcsc.compose.coverage.parts import How, Use, of_program
from rcsc.compose.coverage.questions import with_program
from rcsc.lang.interpret import initial
from rcsc.lang.model import Value, key_bounds, value_of_key

_LEVEL = """\
input p : bool
input q : bool
state a : int 0 .. 2
state b : bool
procedure both(x : int 0 .. 2) {{
  a := x
  b := {value}
}}
table t {{
  | line | a   | p     | q     || a    | b    | procedures |
  |------|-----|-------|-------||------|------|------------|
{lines}
}}
{stated}
level solo {{ period 10 [ms] table t }}
"""
_A = ("0", "1", "2", "a", "min(a + 1, 2)", "max(a - 1, 0)", "2 - a", "")
_B = ("true", "false", "b", "not b", "not p", "p", "")
_STATED = (
    "a = 2 implies b", "not (a = 1 and b)", "was a = 0 implies a < 2", "a < 2", "b implies a > 0", "a <= was a + 1", "p implies a /= 1",
    "was b implies b or a = 0", "a = was a or p", "not b", "was (a = 1) implies a /= 0", "a = 0 or b",
)  # fmt: skip


def drawn(seed: int) -> str:
    """Draw a level of one table, of which exactly one line matches, with three properties."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    rows = []
    for value in range(3):
        column = random.choice("pq")
        for truth in ("true", "false"):
            cells = {"p": "", "q": "", column: truth}
            called = random.random() < 0.25
            does = (
                ("", "", f"both({random.randint(0, 2)})")
                if called
                else (random.choice(_A), random.choice(_B), "")
            )
            rows.append(
                f"  | {value}{truth[0]} | {value} | {cells['p']} | {cells['q']} || {' | '.join(does)} |"
            )
    stated = "\n".join(f"property s{n} : {text}" for n, text in enumerate(random.sample(_STATED, 3)))
    return _LEVEL.format(value=random.choice(("true", "false")), lines="\n".join(rows), stated=stated)


def with_off(ts: TransitionSystem, how: How, off: Collection[Use]) -> TransitionSystem:
    """Return the level in which these uses do not do what is written."""
    return with_program(ts, of_program(ts.program, ts.level, how, off), ts)


def broken_by_some_run(ts: TransitionSystem, *names: str) -> set[str]:
    """Return those of these properties that some run breaks: every input in every state, from the initial values and after a restart."""
    owed = [
        one
        for one in obligations(ts, ts.cycle(ts.havoc()))
        if one.sort is Sort.PROPERTY and one.name in names
    ]
    inputs = list(_inputs(ts))
    start = dict(initial(ts.program))
    wave, seen, found = [start | taken for taken in inputs], set[tuple[Value, ...]](), set[str]()
    while wave and len(found) < len(owed):
        before = wave.pop()
        for taken in inputs:
            step = one_cycle(ts, before, taken)
            assert not step.ends_the_run
            found |= {one.name for one in owed if one.name not in found and broken(ts, one, step)}
            key = tuple(value for leaf, value in step.after.items() if not leaf.startswith("anything"))
            if key not in seen:
                seen.add(key)
                wave.append(dict(step.after))
    return found


def _inputs(ts: TransitionSystem) -> Iterator[dict[str, Value]]:
    """Yield what the environment gives: each input by itself, but for those that stand for what is written."""
    kinds = {leaf: ts.kinds[leaf] for leaf in ts.inputs}
    groups: dict[object, list[str]] = {}
    for leaf, kind in kinds.items():
        groups.setdefault(kind if leaf.startswith("anything") else leaf, []).append(leaf)
    choices = []
    for leaves in groups.values():
        kind = kinds[leaves[0]]
        low, high = key_bounds(kind)
        choices.append([dict.fromkeys(leaves, value_of_key(kind, key)) for key in range(low, high + 1)])
    for chosen in product(*choices):
        yield {leaf: value for part in chosen for leaf, value in part.items()}
