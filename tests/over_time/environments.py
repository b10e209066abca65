"""Small levels drawn with assumptions over time, and every run of them that keeps these, on the interpreter.

In: a seed. Out: a text; of a level its `Truth`. The judge steps the interpreter and the monitors on every input in every state that is
reached, takes the cycles away in which an assumption is broken, and shares nothing with the engines.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from random import Random

from rcsc.compose.contract.transition import TransitionSystem
from rcsc.lang.interpret import Fault, cycle, initial
from rcsc.lang.model import Int, Program, Value, key_bounds, value_of_key
from rcsc.lang.over_time import begun, stepped

_LEVEL = """\
input asked : bool
input near : bool
input many : int 0 .. 2
output moves : bool
state n : int 0 .. 3
{said}
table t {{
  | line  | asked | near  | n   || moves | n     |
  |-------|-------|-------|-----||-------|-------|
  | more  | true  |       | < 3 || true  | n + 1 |
  | full  | true  |       | 3   || true  | {full} |
  | rest  | false | true  |     || false | 0     |
  | stays | false | false |     || {stay} | n     |
}}
level l {{ period 10 [ms] table t }}
"""
_ASSUMED = (
    "at least 3 cycles apart, asked", "at most 2 times in 5 cycles, asked", "on for at least 2 cycles, asked",
    "when moves, within 2 cycles, near", "whenever n = 2, at once not asked", "when near, for 2 cycles, not asked",
    "while moves, always not near", "unless moves, never asked and near", "only after near, asked", "whenever was asked, at once not asked",
    "whenever asked, at once near", "when n = 3, next near", "whenever asked for 10 [ms], at once near", "always many <= n",
    "whenever moves, at once many >= was many", "after asked, always many > 0", "between moves and near, never asked and many = 2",
    "from asked until near, within 2 cycles, near", "when moves, exactly after 1 cycles, near", "always not near since asked or asked",
    "when once near, until asked, many = 1", "when n = 1, before moves, near", "always n < 3 or near",
    "always n < 2 or not (asked or near)",
    "whenever moves and n = 3, at once asked", "whenever was moves, at once near",
)  # fmt: skip
_REQUIRED = (
    "always n < 3", "always n < 2", "never moves and n = 3", "whenever moves, at once asked", "at least 3 cycles apart, moves",
    "when moves, within 2 cycles, not moves", "when moves, within 3 cycles, near", "on for at least 2 cycles, moves",
    "only after near, moves", "never moves and many = 2", "whenever many = 2, at once n > 0", "when n = 1, for 1 cycles, n = 1",
    "whenever was moves, at once not moves", "when moves, next near or moves",
)  # fmt: skip


def drawn(seed: int) -> str:
    """Draw a level with one or two assumptions, and three requirements."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    assumed = random.sample(_ASSUMED, random.choice((1, 1, 2)))
    required = random.sample(_REQUIRED, 3)
    said = [f"assume a{at} assumed : {says}" for at, says in enumerate(assumed)]
    said += [f"requirement r{at} : {says}" for at, says in enumerate(required)]
    return _LEVEL.format(
        said="\n".join(said), full=random.choice(("3", "0", "2")), stay=random.choice(("moves", "false"))
    )


@dataclass
class Truth:
    """What is true of a level as long as its environment is as assumed.

    Attributes:
        least: The cycles of the shortest run that breaks each requirement, from the initial values; `restarted`, from a restart.
        ends: Whether some run comes to where no inputs keep the assumptions.
        states: How many there are.
    """

    least: dict[str, int] = field(default_factory=dict)
    restarted: dict[str, int] = field(default_factory=dict)
    ends: bool = False
    states: int = 0


State = tuple[dict[str, Value], dict[str, dict[str, Value]]]
"""The leaves, and the states of each monitor."""


def truth(ts: TransitionSystem, *, refused: bool = False) -> Truth:
    """Run every input in every state that is reached; where inputs may be `refused`, also numbers just outside their range."""
    inputs = list(_every_input(ts, int(refused)))
    start = dict(initial(ts.program))
    found, seen = Truth(), set[object]()
    for least, begins in ((found.least, [start]), (found.restarted, [start | taken for taken in inputs])):
        wave: list[State] = [(one, _begun(ts.program)) for one in begins]
        depth = 0
        while wave:
            depth += 1
            following: list[State] = []
            for before in wave:
                after = list(_followed(ts, before, inputs))
                found.ends = found.ends or not after
                for (leaves, monitors), broken in after:
                    for name in broken:
                        least.setdefault(name, depth)
                    key = (*leaves.values(), *(tuple(one.values()) for one in monitors.values()))
                    if key not in seen:
                        seen.add(key)
                        following.append((leaves, monitors))
            wave = following
        seen = set() if least is found.least else seen
    found.states = len(seen)
    return found


def _begun(program: Program) -> dict[str, dict[str, Value]]:
    return {one.name: begun(one.monitor) for one in program.over_time if one.monitor is not None}


def _followed(
    ts: TransitionSystem, before: State, inputs: list[dict[str, Value]]
) -> Iterator[tuple[State, list[str]]]:
    """Yield what each cycle that keeps all assumptions leaves, and the requirements that it breaks."""
    leaves, monitors = before
    for taken in inputs:
        outcome = cycle(ts.program, ts.level, {**leaves, **taken})
        assert outcome.fault in {Fault.OK, Fault.ADMIT}
        left, broken = dict[str, dict[str, Value]](), list[str]()
        for one in ts.program.over_time:
            assert one.monitor is not None
            left[one.name], kept = stepped(
                one.monitor, one.condition, monitors[one.name], leaves, outcome.snapshot
            )
            broken += [] if kept else [one.name]
        if not any(one.name in broken for one in ts.program.environment):
            yield (dict(outcome.snapshot), left), broken


def _every_input(ts: TransitionSystem, outside: int) -> Iterator[dict[str, Value]]:
    every = product(*(_values(ts, leaf, outside) for leaf in ts.inputs))
    yield from (dict(zip(ts.inputs, chosen, strict=True)) for chosen in every)


def _values(ts: TransitionSystem, leaf: str, outside: int) -> list[Value]:
    kind = ts.kinds[leaf]
    low, high = key_bounds(kind)
    more = outside if isinstance(kind, Int) else 0
    return [value_of_key(kind, key) for key in range(low - more, high + 1 + more)]
