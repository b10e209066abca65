"""What eventually comes: proofs and lassos, against every state of small levels drawn at random."""

from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
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
from rcsc.lang.model import Apply, Bool, Enum, Expr, Literal, Op, Property, Read, Value, VariableName, earlier
from rcsc.lang.over_time import Past, Requirement, Timing, Trigger, monitored
from rcsc.lang.over_time.past import both, either, negation
from tests.compose.test_hierarchies import roles
from tests.small_hierarchies.endless import edges, endless
from tests.small_hierarchies.explored import TooManyError, explored
from tests.small_hierarchies.more import furnished
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
        assert all(proved_bound(ts, stated, within, QUICK).open for within in every), said
        return "for ever"
    assert proved_bound(ts, stated, Try(true.most), QUICK).open == (), said
    if not true.most:
        return "at once"
    assert proved_bound(ts, stated, Try(true.most - 1), QUICK).open, said
    return "later"


def test_nothing_less_than_the_least_bound_is_proved() -> None:
    kinds = [bounds(seed) for seed in range(20)]
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


# --- beside subordinates ------------------------------------------------------------------------


def answering(ts: TransitionSystem) -> TransitionSystem:
    """Return the level with the requirement that its command, while it stays, is eventually answered."""
    above = ts.links.above
    assert above is not None

    def read(leaf: str) -> Expr:
        return Read(VariableName(leaf), ts.kinds[leaf])

    def says(member: str) -> Expr:
        kind = ts.kinds[above.status]
        assert isinstance(kind, Enum)
        return Apply(Op.EQ, (read(above.status), Literal(kind.members.index(member), kind)), Bool())

    before = Read(earlier(VariableName(above.echo)), ts.kinds[above.echo])
    same = Apply(Op.EQ, (read(above.echo), before), Bool())
    rests = Apply(Op.EQ, (read(above.command), Literal(0, ts.kinds[above.command])), Bool())
    ended = either(says(above.done), both(says(above.failed), negation(rests)))
    waits = both(same, negation(ended))
    monitor, kept = monitored(
        Past("w"), Requirement(Timing.EVENTUALLY, negation(waits), Trigger.WHENEVER, waits)
    )
    stated = Property("w", kept, "", monitor=monitor)
    return ts.of(replace(ts.program, properties=(*ts.program.properties, stated)))


def beside(seed: int, folder: Path) -> list[str]:
    """Compare what is proved of levels with subordinates, which answer, with an enumeration; return what it was."""
    found = []
    for role in roles(furnished(seed), folder).values():
        if role.links.above is None or not role.links.below:
            continue
        seen = set[tuple[Value, ...]]()
        explored(role, seen=seen)
        waits = [edge for edge in edges(role, seen) if edge.unanswered]
        for_ever = any(endless(waits, table, ()) for table in {edge.table for edge in waits})
        ts = answering(TransitionSystem(role.program, role.level, role.links))
        stated = waiting(ts)["w"]
        every = list(eventually.tries(ts, stated))
        proved = [within for within in every if not proved_bound(ts, stated, within, QUICK).open]
        lasso = waiting_lasso(ts, "w", (TraceSearch(6, legal=True),))
        assert not (for_ever and proved), (seed, role.level.name, proved)
        assert not (isinstance(lasso, Lasso) and proved), (seed, role.level.name, proved)
        found += ["proved" if proved else "for ever" if for_ever else "open"]
    return found


def test_of_levels_whose_subordinates_answer_nothing_false_is_proved(tmp_path: Path) -> None:
    assert beside(20_005, tmp_path) == ["proved"]


@pytest.mark.thorough
def test_what_goes_on_for_ever_beside_subordinates_is_not_proved(tmp_path: Path) -> None:
    assert beside(20_007, tmp_path) == ["proved", "for ever"]


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(20_000, 20_060))
def test_of_many_levels_whose_subordinates_answer_nothing_false_is_proved(seed: int, tmp_path: Path) -> None:
    with suppress(TooManyError):
        beside(seed, tmp_path)
