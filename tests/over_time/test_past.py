"""What conditions remember, and what is counted, against the definitions of past-time logic on drawn traces, cycle by cycle."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from random import Random
from typing import Any

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.lang.over_time import Watch
from tests.support.programs.stages import program_of, refused

PROGRAM = """\
input a : bool
input b : bool
input n : int 0 .. 3
output o : bool
{}
table t {{
  | line | a     || o     |
  |------|-------||-------|
  | yes  | true  || true  |
  | no   | false || false |
}}
level l {{ period 10 [ms] table t }}
"""
BEGINS = {"a": False, "b": False, "n": 0}
Trace = Sequence[Mapping[str, Any]]


def watched(says: str) -> Watch:
    [stated] = program_of(PROGRAM.format(f"requirement r : {says}")).properties
    return Watch(stated)


def kept(watch: Watch, trace: Trace) -> list[bool]:
    """Return of each cycle whether it keeps the requirement."""
    return [watch.keeps(before, after) for before, after in pairwise([BEGINS, *trace])]


def drawn(random: Random, length: int) -> Trace:
    """Draw a trace whose values change now and then, or often."""
    now, trace = dict(BEGINS), []
    stays = {name: random.choice((0.4, 0.7, 0.9)) for name in now}
    for _ in range(length):
        new = {"a": random.random() < 0.5, "b": random.random() < 0.5, "n": random.randint(0, 3)}
        now = {name: value if random.random() < stays[name] else new[name] for name, value in now.items()}
        trace.append(now)
    return trace


# --- conditions that remember ----------------------------------------------------------------

Formula = tuple[Any, ...]


def formula(random: Random, depth: int) -> Formula:
    """Draw a condition."""
    if depth == 0 or random.random() < 0.15:
        return random.choice((("a",), ("b",), ("big",), ("rises",)))
    word = random.choice(("not", "once", "was", "for", "and", "or", "since"))
    if word in {"and", "or", "since"}:
        return word, formula(random, depth - 1), formula(random, depth - 1)
    more = (random.randint(1, 3),) if word == "for" else ()
    return word, formula(random, depth - 1), *more


def text(of: Formula) -> str:
    match of:
        case ("big",):
            return "n > 1"
        case ("rises",):
            return "n > was n"
        case (name,):
            return str(name)
        case ("for", inner, cycles):
            return f"({text(inner)}) for {f'{cycles}0 [ms]' if cycles % 2 else f'{cycles} cycles'}"
        case (word, inner):
            return f"{word} ({text(inner)})"
        case (word, left, right):
            return f"({text(left)}) {word} ({text(right)})"
    raise AssertionError(of)


def looks_back(of: Formula) -> bool:
    """Return whether it says `was` of the cycle itself: under `once` and the like it is remembered, not looked at."""
    match of:
        case ("rises",) | ("was", _):
            return True
        case ("not", inner):
            return looks_back(inner)
        case ("for", *_):
            return True
        case ("once", *_) | ("since", *_):
            return False
        case (_, *parts):
            return any(map(looks_back, parts))
    return False


def true(of: Formula, trace: Trace, at: int) -> bool:
    """Return whether it is true in a cycle; in cycle -1 nothing has been, and all is as the level begins."""
    now = trace[at] if at >= 0 else BEGINS
    match of:
        case ("big",):
            return bool(now["n"] > 1)
        case ("rises",):
            return at >= 0 and bool(now["n"] > (trace[at - 1] if at else BEGINS)["n"])
        case ("a" | "b",):
            return bool(now[of[0]])
        case ("not", inner):
            return not true(inner, trace, at)
        case ("and", left, right):
            return true(left, trace, at) and true(right, trace, at)
        case ("or", left, right):
            return true(left, trace, at) or true(right, trace, at)
        case ("once", inner):
            return any(true(inner, trace, then) for then in range(at + 1))
        case ("since", left, right):
            begun = (then for then in range(at + 1) if true(right, trace, then))
            return any(all(true(left, trace, later) for later in range(then + 1, at + 1)) for then in begun)
        case ("for", inner, cycles):
            return at >= cycles and all(true(inner, trace, then) for then in range(at - cycles, at + 1))
        case ("was", inner):
            return at >= 0 and (at > 0 or not looks_back(inner)) and true(inner, trace, at - 1)
    raise AssertionError(of)


@pytest.mark.parametrize("seed", range(40))
def test_what_a_condition_remembers_is_what_past_time_logic_says(seed: int) -> None:
    random = Random(seed)  # noqa: S311  # the same each time
    says = formula(random, 4)
    while says[0] in {"a", "b", "big"}:
        says = formula(random, 4)
    watch = watched(f"always {text(says)}")
    for length in (1, 2, 3, 5, 8, 13):
        trace = drawn(random, length)
        watch.begin()
        wanted = [true(says, trace, at) for at in range(length)]
        assert kept(watch, trace) == wanted, (text(says), trace)


def test_each_part_of_a_requirement_may_remember() -> None:
    """By hand: `b since a` begins to hold in cycles 2 and 7, `a` has held twice in a row before cycle 4 alone."""
    watch = watched("while once a, when b since a, within 1 cycles, was (a and was a)")
    trace = [{"a": at in {2, 3, 7}, "b": at in {1, 3, 4, 8}, "n": 0} for at in range(11)]
    assert [at for at, good in enumerate(kept(watch, trace)) if not good] == [3, 8]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("property p : once a", "`once` stands in requirements and assumptions over time"),
        ("assume p : a since b", "`since` stands in requirements and assumptions over time"),
        ("requirement p : always n > was (was n)", "`was` goes back one cycle, not two"),
        ("requirement p : always a for once b", None),
    ],
)
def test_what_cannot_be_remembered_is_told(text: str, message: str | None) -> None:
    [found] = refused(PROGRAM.format(text))
    assert message in {None, found.message}
    assert message is None or found.code is Code.NO_CYCLE_BEFORE


# --- what is counted -------------------------------------------------------------------------


def rises(trace: Trace, name: str) -> list[int]:
    """Return the cycles in which it begins to hold, the first, too."""
    return [at for at, now in enumerate(trace) if now[name] and (at == 0 or not trace[at - 1][name])]


def broken_at(watch: Watch, trace: Trace) -> int | None:
    """Return the first cycle that breaks the requirement."""
    watch.begin()
    return next((at for at, good in enumerate(kept(watch, trace)) if not good), None)


@pytest.mark.parametrize(("times", "cycles"), [(1, 1), (1, 2), (1, 4), (2, 3), (2, 6), (3, 9)])
def test_at_most_so_many_begin_in_a_time(times: int, cycles: int) -> None:
    random = Random(cycles)  # noqa: S311  # the same each time
    watch = watched(f"at most {times} times in {cycles} cycles, a")
    broken = 0
    for _ in range(120):
        trace = drawn(random, 16)
        begun = rises(trace, "a")
        late = [last for first, last in zip(begun, begun[times:], strict=False) if last - first < cycles]
        assert broken_at(watch, trace) == (late[0] if late else None), trace
        broken += bool(late)
    assert (broken > 0) is (cycles > 2 * times)


@pytest.mark.parametrize("cycles", [1, 2, 3, 5])
def test_beginnings_are_apart(cycles: int) -> None:
    random = Random(cycles)  # noqa: S311  # the same each time
    watch = watched(f"at least {cycles} cycles apart, a")
    for _ in range(60):
        trace = drawn(random, 12)
        begun = rises(trace, "a")
        near = [last for first, last in pairwise(begun) if last - first < cycles]
        assert broken_at(watch, trace) == (near[0] if near else None), trace


@pytest.mark.parametrize("cycles", [1, 2, 4])
@pytest.mark.parametrize("on", [True, False])
def test_what_is_on_or_off_stays_so_for_a_time(cycles: int, on: bool) -> None:  # a parameter of a test
    """The cycles from that in which it is on, up to that in which it is no more, are so many; a run's end ends no such row."""
    random = Random(cycles)  # noqa: S311  # the same each time
    watch = watched(f"{'on' if on else 'off'} for at least {cycles} cycles, a")
    for _ in range(60):
        trace = drawn(random, 12)
        changes = [0, *(at for at in range(1, 12) if trace[at]["a"] != trace[at - 1]["a"])]
        short = [
            last for first, last in pairwise(changes) if trace[first]["a"] is on and last - first < cycles
        ]
        assert broken_at(watch, trace) == (short[0] if short else None), trace


@pytest.mark.parametrize(
    ("asks", "asked", "given", "broken"),
    [
        ("whenever a, ", {1, 2}, {5}, 5),
        ("whenever a, ", {1, 2}, {4}, 4),
        ("whenever a, ", {1, 2}, {3, 4, 5}, None),
        ("whenever a, ", {1, 2}, {6}, None),
        ("", set(), {3}, 3),
        ("", set(), {2, 3}, None),
    ],
)
def test_each_cycle_that_asks_is_remembered(
    asks: str, asked: set[int], given: set[int], broken: int | None
) -> None:
    """By hand, outside of the scope: what is asked for does not come first when two cycles are over, of any cycle that asks."""
    watch = watched(f"only while n > 1, {asks}exactly after 2 cycles, b")
    trace = [{"a": at in asked, "b": at in given, "n": 0} for at in range(8)]
    assert broken_at(watch, trace) == broken


@pytest.mark.parametrize("scope", ["", "while b, ", "after b, "])
def test_what_comes_only_after_something_else(scope: str) -> None:
    random = Random(scope)  # noqa: S311  # the same each time
    watch = watched(f"{scope}only after n > 1, a")
    for _ in range(80):
        trace = drawn(random, 10)
        assert broken_at(watch, trace) == next(_early(scope, trace), None), trace


def _early(scope: str, trace: Trace) -> Iterator[int]:
    """Yield the cycles of an interval in which `a` holds, and `n > 1` has not held there."""
    seen, was_b, over = False, False, False
    for at, now in enumerate(trace):
        over = over or (was_b and not now["b"])
        inside = {"": True, "while b, ": now["b"], "after b, ": over}[scope]
        seen = inside and (seen or now["n"] > 1)
        if inside and now["a"] and not seen:
            yield at
        was_b = was_b or now["b"]


@pytest.mark.parametrize(
    ("says", "code"),
    [
        ("at most 0 times in 3 cycles, a", "RCS317"),
        ("at most 17 times in 3 cycles, a", "RCS317"),
        ("at most 2 times in 3 [mm], a", "RCS302"),
        ("only while a, at most 2 times in 3 cycles, b", "RCS101"),
        ("when a, at least 2 cycles apart, b", "RCS101"),
    ],
)
def test_what_is_not_counted_is_told(says: str, code: str) -> None:
    [found] = refused(PROGRAM.format(f"requirement r : {says}"))
    assert found.code == code
