"""Monitors of every scope, trigger and timing, against the formulas that FRET publishes, and traces judged by hand."""

import csv
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from rcsc.lang.interpret import holds
from rcsc.lang.model import Bool, Expr, Monitor, Read, VariableName
from rcsc.lang.over_time import Past, Requirement, Scope, Timing, Trigger, begun, monitored, stepped
from rcsc.lang.over_time.past import FALSE
from tests.over_time.formulas import endless
from tests.over_time.formulas.finite import parsed

DATA = Path(__file__).parents[1] / "data"
SCOPES = {
    "null": Scope.ALL, "in": Scope.WHILE, "notin": Scope.UNLESS, "before": Scope.BEFORE, "after": Scope.AFTER,
    "onlyIn": Scope.ONLY_WHILE, "onlyBefore": Scope.ONLY_BEFORE, "onlyAfter": Scope.ONLY_AFTER,
}  # fmt: skip
TRIGGERS = {"null": Trigger.FIRST, "regular": Trigger.WHEN, "holding": Trigger.WHENEVER}
TIMINGS = {
    "immediately": Timing.AT_ONCE, "next": Timing.NEXT, "always": Timing.ALWAYS, "never": Timing.NEVER,
    "eventually": Timing.EVENTUALLY, "null": Timing.EVENTUALLY, "finally": Timing.AT_LAST, "within": Timing.WITHIN,
    "for": Timing.FOR, "after": Timing.EXACTLY_AFTER, "until": Timing.UNTIL, "before": Timing.BEFORE,
}  # fmt: skip
TIMED = {"within", "for", "after"}
NAMES = ("m", "c", "s", "p")
LENGTHS = (1, 2, 3, 5, 9)
EACH = 16
"""Traces of each length."""


def rows(name: str) -> list[dict[str, str]]:
    lines = (DATA / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader((line for line in lines if not line.startswith("#")), delimiter="\t"))


TEMPLATES = {(row["scope"], row["condition"], row["timing"]): row["formula"] for row in rows("fret.tsv")}


def leaf(name: str) -> Expr:
    return Read(VariableName(name), Bool())


def made(scope: str, trigger: str, timing: str, cycles: int) -> tuple[Monitor, Expr]:
    m, c, s, p = map(leaf, NAMES)
    required = Requirement(TIMINGS[timing], p, TRIGGERS[trigger], c, SCOPES[scope], m, cycles=cycles, stop=s)
    return monitored(Past("r"), required)


def judged(monitor: Monitor, kept: Expr, trace: dict[str, list[bool]]) -> Iterator[bool]:
    """Yield after each cycle whether the requirement holds of the trace so far."""
    state, broken = begun(monitor), False
    for at in range(len(trace["p"])):
        state, good = stepped(monitor, kept, state, {}, {name: truths[at] for name, truths in trace.items()})
        broken = broken or not good
        yield not broken and not holds(monitor.owes, state)


def drawn(random: Random, length: int) -> dict[str, list[bool]]:
    """Draw a trace whose truths change now and then, or often."""
    trace = {}
    for name in NAMES:
        stays, now = random.choice((0.5, 0.75, 0.9)), random.random() < 0.5
        trace[name] = [now := now if random.random() < stays else not now for _ in range(length)]
    return trace


def as_bits(traces: list[dict[str, list[bool]]]) -> dict[str, list[int]]:
    """Return the truths of each cycle, a bit for each trace."""
    cycles = range(len(traces[0]["p"]))
    return {
        name: [sum(trace[name][at] << bit for bit, trace in enumerate(traces)) for at in cycles]
        for name in NAMES
    }


def test_all_templates_are_there() -> None:
    assert set(TEMPLATES) == {
        (scope, trigger, timing) for scope in SCOPES for trigger in TRIGGERS for timing in TIMINGS
    }


@pytest.mark.parametrize("scope", SCOPES)
def test_each_monitor_says_after_each_cycle_what_the_published_formula_says(scope: str) -> None:
    random, full = Random(scope), (1 << EACH) - 1  # noqa: S311  # the same traces each time
    differ = []
    for trigger in TRIGGERS:
        for timing in TIMINGS:
            for cycles in (1, 2, 3) if timing in TIMED else (0,):
                formula = parsed(TEMPLATES[scope, trigger, timing], cycles)
                monitor = made(scope, trigger, timing, cycles)
                for length in LENGTHS:
                    traces = [drawn(random, length) for _ in range(EACH)]
                    verdicts = formula(as_bits(traces), full)
                    found = [tuple(judged(*monitor, trace)) for trace in traces]
                    differ += [
                        (trigger, timing, cycles, trace)
                        for bit, trace in enumerate(traces)
                        if found[bit] != tuple(bool(truth >> bit & 1) for truth in verdicts)
                    ]
    assert not differ, (len(differ), differ[0])


ENDLESS = {
    (row["scope"], row["condition"], row["timing"]): row["formula"] for row in rows("fret_endless.tsv")
}


def judged_for_ever(monitor: Monitor, kept: Expr, trace: dict[str, list[bool]], back: int) -> bool:
    """Return whether the requirement holds of an endless trace, whose last cycle is followed by cycle `back`, from 0, again and again."""
    state, seen = begun(monitor), list[tuple[object, ...]]()
    at, good, waits = 0, True, list[bool]()
    while (now := (at, *state.values())) not in seen:
        seen.append(now)
        cycle = {name: truths[at] for name, truths in trace.items()}
        state, kept_here = stepped(monitor, kept, state, {}, cycle)
        good, at = good and kept_here, at + 1 if at + 1 < len(trace["p"]) else back
        waits.append(holds(monitor.waits, state))
    return good and not all(waits[seen.index(now) :])


@pytest.mark.parametrize("scope", SCOPES)
def test_each_monitor_says_of_an_endless_run_what_the_published_formula_says(scope: str) -> None:
    random = Random(scope)  # noqa: S311  # the same traces each time
    differ = []
    for (of, trigger, timing), text in ENDLESS.items():
        formula = endless.parsed(text)
        monitor = made(of, trigger, timing, 0)
        for _ in range(EACH if of == scope else 0):
            back = random.choice((0, 1, 2, 4))
            trace = drawn(random, back + random.choice((1, 2, 3, 4)))
            if judged_for_ever(*monitor, trace, back) != formula(trace, back)[0]:
                differ.append((trigger, timing, trace, back))
    assert not differ, (len(differ), differ[0])


@pytest.mark.parametrize("row", rows("fret_worked.tsv"), ids=lambda row: row["id"])
def test_traces_that_were_judged_by_hand(row: dict[str, str]) -> None:
    trace = {
        short: [truth == "1" for truth in row[name]]
        for short, name in zip(
            NAMES, ("scope_mode", "regular_condition", "stop_condition", "post_condition"), strict=True
        )
    }
    *_, last = judged(*made(row["scope"], row["condition"], row["timing"], int(row["n"])), trace)
    assert last is (row["expected"] == "1"), row["note"]


def test_only_these_owe_something_at_the_end_of_a_run() -> None:
    """Of all others each is broken in some cycle, or holds: what a proof of cycles can show."""
    owing = {key for key in TEMPLATES if made(*key, 2)[0].owes != FALSE}
    asks = {"eventually", "null", "finally"}
    assert owing == {
        (scope, trigger, timing)
        for scope, trigger, timing in TEMPLATES
        if timing in ({"always", "never", "finally"} if scope.startswith("only") else asks)
    }


# --- scopes between two conditions -----------------------------------------------------------


def intervals(mode: list[bool], end: list[bool], *, closed: bool) -> list[tuple[int, int]]:
    """Return the first and the last cycle of each interval from a mode to an end; those only that do end, where they are `closed`."""
    found: list[tuple[int, int]] = []
    first: int | None = None
    for at, (begins, ends) in enumerate(zip(mode, end, strict=True)):
        if ends and first is not None:
            found.append((first, at - 1))
            first = None
        if begins and not ends and first is None:
            first = at
    if first is not None and not closed:
        found.append((first, len(mode) - 1))
    return found


@pytest.mark.parametrize("scope", [Scope.BETWEEN, Scope.FROM])
@pytest.mark.parametrize("timing", TIMINGS)
def test_from_one_condition_to_another_is_as_while_it_is_so(scope: Scope, timing: str) -> None:
    """Each interval is judged as a run of its own would be, by the published formula of a requirement without a scope."""
    random = Random(timing)  # noqa: S311  # the same traces each time
    m, c, s, p = map(leaf, NAMES)
    for trigger, how in TRIGGERS.items():
        formula = parsed(TEMPLATES["null", trigger, timing], 2)
        required = Requirement(TIMINGS[timing], p, how, c, scope, m, cycles=2, stop=s, end=leaf("e"))
        monitor, kept = monitored(Past("r"), required)
        assert scope is Scope.FROM or monitor.owes == FALSE
        for length in LENGTHS * 12:
            trace = {**drawn(random, length), "e": drawn(random, length)["m"]}
            own = [
                {name: [int(truth) for truth in trace[name][first : last + 1]] for name in NAMES}
                for first, last in intervals(trace["m"], trace["e"], closed=scope is Scope.BETWEEN)
            ]
            *_, last = judged(monitor, kept, trace)
            assert last is all(formula(part, 1)[-1] for part in own), (trigger, trace)
