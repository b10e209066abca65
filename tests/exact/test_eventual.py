"""What eventually comes: proofs and lassos, against every state of small levels drawn at random."""

from dataclasses import dataclass
from itertools import product
from random import Random
from typing import TypeAlias
from unittest.mock import patch

import pytest

from rcsc.compose.contract.obligations import ObligationKey, Sort, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.watched import begin
from rcsc.compose.counterexample.cycle_run import broken, one_cycle
from rcsc.compose.counterexample.lasso import Lasso, waiting_lasso
from rcsc.compose.counterexample.trace import TraceSearch
from rcsc.compose.exact.eventual import of_short_runs
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof import eventually
from rcsc.compose.proof.eventually import Try, waiting
from rcsc.compose.proof.level import Verdict, prove_level, proved_bound
from rcsc.lang.interpret import holds, initial
from rcsc.lang.model import Value
from tests.support.programs.systems import alone

LEVEL = """\
input a : bool
input b : bool
state n : int 0 .. 4
state s : bool
requirement wanted : {wanted}
table t {{
  | line | n | a | b || n | s |
  |------|---|---|---||---|---|
{lines}
}}
level solo {{ period 10 [ms] table t }}
"""
CONDITIONS = ("a", "b", "s", "not a", "n = 1", "n = 3", "n >= 2", "s and a", "n = 0 or b", "was s", "once a")
RESPONSES = (
    "n = 3",
    "n = 4 and s",
    "n /= 2",
    "n in {1, 4}",
    "s",
    "a implies n = 3",
    "n = 0 or b",
    "was n = 3",
)
SCOPES = ("", "while {}, ", "unless {}, ", "before {}, ", "after {}, ", "only while {}, ", "only before {}, ", "only after {}, ",
          "from {} until {}, ")  # fmt: skip
TRIGGERS = ("", "when {}, ", "whenever {}, ", "when {}, ", "whenever {}, ")


def drawn(seed: int) -> str:
    """Draw a level of a few states, most of which go round by themselves, and what is wanted of it."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    lines = []
    for n in range(5):
        column = random.choice(("a", "b", "", "", "", ""))
        for cell in ("true", "false") if column else ("",):
            a, b = (cell if name == column else "" for name in "ab")
            to = random.choice(((n + 1) % 5,) * 4 + (n, random.randrange(5)))
            lines.append(
                f"  | {n}{cell} | {n} | {a} | {b} || {to} | {random.choice(('true', 'false', 'a', 'b', 's'))} |"
            )
    scope, trigger = random.choice((*SCOPES, "", "", "")), random.choice(TRIGGERS)
    always = scope.startswith("only") or random.random() < 0.1
    text = scope + trigger + ("always {}" if always else "eventually {}")
    chosen = random.choices(CONDITIONS, k=text.count("{}") - 1)
    return LEVEL.format(wanted=text.format(*chosen, random.choice(RESPONSES)), lines="\n".join(lines))


State: TypeAlias = tuple[Value, ...]
"""Of every leaf, and of the monitor."""


@dataclass
class Truth:
    """Whether some cycle breaks what is wanted, and some run waits for it for ever; else for how many cycles in a row one waits at most."""

    broken: bool
    for_ever: bool
    most: int


def truth(ts: TransitionSystem) -> Truth:
    """Run every input in every state that is reached, and walk along the cycles that wait."""
    every = [
        dict(zip(ts.inputs, taken, strict=True)) for taken in product((False, True), repeat=len(ts.inputs))
    ]
    [stated] = ts.program.properties
    assert stated.monitor is not None
    [owed] = [one for one in obligations(ts, ts.cycle(ts.havoc())) if one.sort is Sort.REQUIREMENT]
    begun = begin(ts.program)
    starts = [(dict(initial(ts.program)) | taken, begun) for taken in ({}, *every)]
    onward: dict[State, set[State]] = {}
    is_broken, seen = False, set[State]()
    left = starts
    while left:
        before, found = left.pop()
        source = (*before.values(), *found.values())
        for taken in every:
            step = one_cycle(ts, before, taken, (), found)
            target = (*step.after.values(), *step.left.values())
            is_broken = is_broken or broken(ts, owed, step)
            if holds(stated.monitor.waits, step.left):
                onward.setdefault(source, set()).add(target)
            if target not in seen:
                seen.add(target)
                left.append((dict(step.after), dict(step.left)))
    lengths = _longest(onward)
    most = max((lengths or {}).values(), default=0)
    return Truth(is_broken, lengths is None, most)


def _longest(onward: dict[State, set[State]]) -> dict[State, int] | None:
    """Return the length of the longest way from each state; None where one comes round."""
    lengths: dict[State, int] = {}
    doing: set[tuple[Value, ...]] = set()

    def measured(state: State) -> int | None:
        if state in doing:
            return None
        if state not in lengths:
            doing.add(state)
            every = [measured(to) for to in sorted(onward.get(state, ()))]
            if None in every:
                return None
            lengths[state] = max((1 + (length or 0) for length in every), default=0)
            doing.discard(state)
        return lengths[state]

    for state in sorted(onward):
        if measured(state) is None:
            return None
    return lengths


def wanted_of(ts: TransitionSystem) -> ObligationKey:
    return Sort.REQUIREMENT, "", ts.program.properties[0].name


def check(seed: int) -> str:
    """Compare proof and lasso of a drawn level with the truth; return what it was."""
    ts = alone(drawn(seed))
    true = truth(ts)
    proof = prove_level(ts, Effort(walks=2, cycles=20, looks=False))
    verdict = proof.verdict(*wanted_of(ts))
    said = seed, ts.program.properties[0].text, true
    assert (verdict is Verdict.PROVED) == (not true.broken and not true.for_ever), said
    if not waiting(ts):
        return "safe"
    found = waiting_lasso(ts, "wanted", (TraceSearch(6), TraceSearch(6, restarted=True)))
    assert isinstance(found, Lasso) == true.for_ever, said
    if verdict is Verdict.PROVED:
        [bound] = proof.bounds
        assert bound.within.most == true.most, said
        return "proved"
    return "for ever" if isinstance(found, Lasso) else "broken"


def test_what_eventually_comes_is_proved_and_what_never_does_is_shown() -> None:
    kinds = [check(seed) for seed in range(14)]
    assert {"proved", "for ever", "broken"} <= set(kinds)


QUICK = Effort(walks=1, cycles=10, looks=False)


def bounds(seed: int) -> str:
    """Try bounds that are too small, and states that only seem to move one way, of a drawn level; return what it was."""
    ts = alone(drawn(seed))
    if not waiting(ts):
        return "safe"
    true, stated, said = truth(ts), waiting(ts)["wanted"], (seed, ts.program.properties[0].text)
    if true.broken:
        return "broken"
    if true.for_ever:
        every = [Try(3), *(Try(1, rank="n", rises=rises) for rises in (True, False))]
        assert not any(proved_bound(ts, stated, within, QUICK) for within in every), said
        return "for ever"
    assert proved_bound(ts, stated, Try(true.most), QUICK) is not None, said
    if not true.most:
        return "at once"
    assert proved_bound(ts, stated, Try(true.most - 1), QUICK) is None, said
    return "later"


def test_nothing_less_than_the_least_bound_is_proved() -> None:
    kinds = [bounds(seed) for seed in range(30, 55)]
    assert {"for ever", "at once", "later"} <= set(kinds)


def unlisted(seed: int) -> str:
    """Compare what is found where states are not listed with the truth; return what it was."""
    ts = alone(drawn(seed))
    if not waiting(ts):
        return "safe"
    true, said = truth(ts), (seed, ts.program.properties[0].text)
    with patch.object(eventually, "of_all_states", lambda _: None):
        proof = prove_level(ts, Effort(walks=2, cycles=20, looks=False))
        made = eventually.circuit_of(ts, waiting(ts)["wanted"])
        assert made is not None
        short = of_short_runs(made)
    assert (short.lasso is not None) == true.for_ever, said  # the levels are so small that short runs are all
    assert true.for_ever or short.most == true.most, said
    if proof.verdict(*wanted_of(ts)) is not Verdict.PROVED:
        return "open"
    assert not true.broken, said
    assert not true.for_ever, said
    [bound] = proof.bounds
    return "by a rank" if bound.within.rank else "by a bound"


def test_where_states_are_not_listed_bounds_are_tried() -> None:
    kinds = [unlisted(seed) for seed in range(10)]
    assert {"open", "by a bound"} <= set(kinds)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(200))
def test_of_many_levels_nothing_less_than_the_least_bound_is_proved(seed: int) -> None:
    bounds(seed)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(10, 300))
def test_of_many_levels_that_are_not_listed_nothing_false_is_proved(seed: int) -> None:
    unlisted(seed)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(14, 500))
def test_of_many_levels_what_eventually_comes_is_proved(seed: int) -> None:
    check(seed)
