"""Small levels drawn at random, and every state that each reaches on the interpreter: what is true of their properties.

In: a seed. Out: a text; of a level its `Truth`. The judge runs `interpret.cycle` on every input in every state, and shares nothing with
the engines.
"""

from dataclasses import dataclass, field
from itertools import product
from random import Random

from rcsc.compose.contract.obligations import ObligationKey, Sort, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import broken, one_cycle
from rcsc.lang.interpret import initial
from rcsc.lang.model import Value, key_bounds, value_of_key

_LEVEL = """\
enum mode {{ one, two, three }}
input a : int 0 .. 3
input b : bool
state n : int -4 .. 4
state k : int 0 .. 9
state m : mode
state seen : bool
module count reads a, b, n, k, m, seen writes n, k, seen {{
  if {when} {{ n := ({n}) mod 5 }} else {{ n := min(max({n2}, -4), 4) }}
  if {then} {{ k := abs({k}) mod 10 }}
  seen := {seen}
}}
table t {{
  | line | m     | b     | {on} || m     |
  |------|-------|-------|------||-------|
{lines}
}}
property first : {first}
property second : {second}
level solo {{ period 10 [ms] preprocess count table t }}
"""
_LINEAR = (
    "n + a",
    "a - n",
    "k - a",
    "abs(n) + a",
    "n + a - 3",
    "max(n, a) - 1",
    "k + 1",
    "k + a",
    "2 * k + a",
    "2 * n - k",
    "min(k, a) + 1",
)
_OTHER = (
    "n * a + 1",
    "n * k - a",
    "k * a + 1",
    "k / (a + 1) + a",
    "7 / (a - 5) + n",
    "k mod (a + 1) + n",
    "a - k mod (a + 2)",
    "(n + k) / 3 + a",
)
_TRUTHS = (
    "b",
    "seen",
    "not b",
    "n > 0",
    "k >= 5",
    "n = k",
    "m = one",
    "m in {two, three}",
    "a = 3",
    "k < 2 * n",
    "n + k >= 6",
)
_STATED = (
    "n <= k + 4", "n + k /= 12", "n * 3 <= k + 10", "k /= 8 or n < 3", "k /= 9 or m /= two",
    "not (n = -4 and k = 0)", "k /= 9", "not (seen and n = 4)", "n >= -3", "m = two implies k > 0", "was k <= k + 3", "k - n <= 11",
    "m = three implies was (m /= one)", "n = 0 implies k < 9", "not (m = two and n = 3 and k = 4)", "seen or was seen or k < 8",
)  # fmt: skip


def drawn(seed: int, *, linear: bool = False) -> str:
    """Draw a level; `linear`, without products, quotients and remainders of variables."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    numbers = _LINEAR if linear else (*_LINEAR, *_OTHER)
    on = random.choice(("seen", "n > 0", "k >= 5"))
    lines = []
    for number, member in enumerate(("one", "two", "three")):
        cell = random.choice(("true", "false"))
        targets = random.sample(("one", "two", "three"), 2)
        if random.random() < 0.5:
            lines += [f"  | {number}a | {member} | {cell} | | | {targets[0]} |".replace("| | |", "| || ")]
            other = "false" if cell == "true" else "true"
            lines += [f"  | {number}b | {member} | {other} | || {targets[1]} |"]
        else:
            lines += [f"  | {number}a | {member} | | true || {targets[0]} |"]
            lines += [f"  | {number}b | {member} | | false || {targets[1]} |"]
    return _LEVEL.format(
        when=random.choice(_TRUTHS),
        then=random.choice(_TRUTHS),
        n=random.choice(numbers),
        n2=random.choice(numbers),
        k=random.choice(numbers),
        seen=random.choice(_TRUTHS),
        on=on,
        lines="\n".join(lines),
        first=random.choice(_STATED),
        second=random.choice(_STATED),
    )


@dataclass
class Truth:
    """What is true of a level.

    Attributes:
        least: The cycles of the shortest run that breaks each property, from the initial values; `restarted`, those that only runs from a
            restart break, likewise.
        states: Every state.
    """

    least: dict[ObligationKey, int] = field(default_factory=dict)
    restarted: dict[ObligationKey, int] = field(default_factory=dict)
    states: set[tuple[Value, ...]] = field(default_factory=set)


def truth(ts: TransitionSystem) -> Truth:
    """Run every input in every state that is reached."""
    every = product(*(_values(ts, leaf) for leaf in ts.inputs))
    inputs = [dict(zip(ts.inputs, values, strict=True)) for values in every]
    start = dict(initial(ts.program))
    stated = [one for one in obligations(ts, ts.cycle(ts.havoc())) if one.sort is Sort.PROPERTY]
    found, seen = Truth(), set[tuple[Value, ...]]()
    begun = [
        start | taken for taken in inputs
    ]  # a restart finds any values in its inputs, and adopts nothing else here
    for least, first in ((found.least, [start]), (found.restarted, begun)):
        wave, depth = first, 0
        while wave:
            depth += 1
            following: list[dict[str, Value]] = []
            for before, taken in product(wave, inputs):
                step = one_cycle(ts, before, taken)
                assert not step.ends_the_run
                for owed in stated:
                    if owed.key not in found.least and owed.key not in least and broken(ts, owed, step):
                        least[owed.key] = depth
                key = tuple(step.after.values())
                if key not in seen:
                    seen.add(key)
                    following.append(dict(step.after))
            wave = following
    found.states = seen
    return found


def _values(ts: TransitionSystem, leaf: str) -> list[Value]:
    low, high = key_bounds(ts.kinds[leaf])
    return [value_of_key(ts.kinds[leaf], key) for key in range(low, high + 1)]
