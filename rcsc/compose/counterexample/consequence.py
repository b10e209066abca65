"""Consequences: what follows a finding, up to what the superior takes from it.

In: a transition system, and the run that breaks an obligation. Out: `Consequence`s, each with a run. Meanwhile the superior waits: it gives
no other command. All that it is told is the report, so runs are told apart by that: the command is *answered*, and how (the status and the
enumerated fields beside it, such as a reason); an answer is *changed*; the level *stops*, because no line or several match; or the run
*repeats*, unanswered. Of each a shortest run is shown, which breaks the obligation in the same cycle as the finding; if there is one that
also begins as the finding does, that one.

Trusted: only the interpreter, as everywhere in this room; a run that it does not do is left out.

Cost: one search for each finding, over at most `further` cycles after it, and at most `MOST` runs.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TypeAlias

from rcsc.compose.contract.environment import leaves_under
from rcsc.compose.contract.obligations import command_stays, obligations, pairs
from rcsc.compose.contract.transition import Cycle, Leaves, TransitionSystem
from rcsc.compose.counterexample.cycle_run import CycleRun, as_cycle, broken, ran_on
from rcsc.compose.counterexample.finding import Finding
from rcsc.compose.counterexample.lasso import comes_round, lasso_of
from rcsc.compose.counterexample.trace import TraceSearch, Unrolled, wrong_in
from rcsc.lang.interpret import UNDEFINED, initial
from rcsc.lang.model import Bool, Enum, Snapshot, Value, spell
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node

MOST = 6
"""Consequences of one finding that are shown."""


class How(StrEnum):
    """The kinds of consequences of a finding."""

    ANSWERED = "answered"
    STOPS = "stops"
    CHANGED = "changed"
    REPEATS = "repeats"


Report: TypeAlias = tuple[tuple[str, Value], ...]
"""What the superior takes of a report: leaves and their values, the status first."""


@dataclass(frozen=True, slots=True)
class Consequence:
    """One way in which a run goes on that breaks an obligation.

    Attributes:
        before: The report that the superior took before the last cycle; `report`, the one it takes after it.
        run: The run; its `after` counts the cycles since the obligation is broken.
        first: The cycle, from 1, before which all is as at the end; 0 unless the run repeats.
        shared: Whether it begins as the run that shows the finding.
        reports: The level whose report it is; empty if it is the level of the finding.
    """

    how: How
    before: Report
    report: Report
    run: Finding
    first: int = 0
    shared: bool = True
    reports: str = ""

    @property
    def level(self) -> str:
        """The level whose superior takes the report."""
        return self.reports or self.run.level

    @property
    def cycle(self) -> int:
        """The cycle in which it comes to that, from 1."""
        return len(self.run.ticks)

    @property
    def last(self) -> CycleRun:
        """The same cycle, as it ran."""
        return self.run.ticks[-1][self.level]


def consequences(
    ts: TransitionSystem, finding: Finding, search: TraceSearch, further: int
) -> tuple[Consequence, ...]:
    """Find consequences of a finding of one level that has a superior: first runs that begin as the finding, then the shortest.

    Args:
        ts: The level.
        finding: The run that breaks the obligation.
        search: How that run was searched for.
        further: The most cycles that are looked at after the one that breaks it.
    """
    if ts.links.above is None or len(finding.levels) > 1:
        return ()
    steps = [tick[finding.level] for tick in finding.ticks[: finding.broken_at]]
    report = reported(ts, steps[-1].after)
    if finding.lasso:
        return (Consequence(How.REPEATS, report, report, finding, finding.lasso),)
    if steps[-1].ends_the_run:
        return (Consequence(How.STOPS, report, report, finding),)
    followed = _Followed(ts, finding, steps, Unrolled(ts, replace(search, most=len(steps) + further)))
    with suppress(GaveUpError):  # what was shown until then is so
        followed.search(further)
    return tuple(sorted(followed.results, key=lambda result: (not result.shared, result.cycle)))


def reported(ts: TransitionSystem, leaves: Snapshot) -> Report:
    """Return the leaves of a report that tell answers apart, with their values."""
    return tuple((leaf, leaves[leaf]) for leaf in told_by(ts))


def told_by(ts: TransitionSystem) -> tuple[str, ...]:
    """List the leaves that tell answers apart: the status, and the truth values and members beside it."""
    above = ts.links.above
    assert above is not None
    others = [
        leaf
        for leaf in leaves_under(ts.program, above.report)
        if leaf not in {above.status, above.echo, above.echoed} and isinstance(ts.kinds[leaf], Bool | Enum)
    ]
    return (above.status, *others)


def answered(ts: TransitionSystem, cycle: Cycle, leaves: Leaves) -> Node:
    """Return the condition that the report in these leaves says *done* or *failed* of the command of the cycle."""
    above = ts.links.above
    assert above is not None
    kind = ts.kinds[above.status]
    members = kind.members if isinstance(kind, Enum) else ()
    answers = values.any_of(
        values.equal(leaves[above.status], values.constant(kind, members.index(word)))
        for word in (above.done, above.failed)
        if word in members
    )
    return values.both(values.equal(leaves[above.echo], cycle.taken[above.number]), answers)


@dataclass(slots=True)
class _Followed:
    """The search after one finding.

    Attributes:
        steps: The cycles up to the one that breaks the obligation.
        run: The same cycles, and those after them, as nodes.
        since: Of these the one that breaks the obligation, and all after it.
        results: The consequences so far.
    """

    ts: TransitionSystem
    finding: Finding
    steps: Sequence[CycleRun]
    run: Unrolled
    since: list[Cycle] = field(default_factory=list)
    results: list[Consequence] = field(default_factory=list)

    def search(self, further: int) -> None:
        """Look at one cycle more after the other, up to the one after that in which every run is answered.

        Raises:
            GaveUpError: The solver did not decide.
        """
        alike, waits = self._up_to_the_finding(), True
        for more in range(further + 1):
            if more:
                cycle = self.run.further()
                self.run.require(command_stays(self.ts, cycle))
                self.since.append(cycle)
            for how in How:
                self._each(how, alike)
            if not waits or len(self.results) == MOST:
                return
            told = values.any_of(answered(self.ts, cycle, cycle.after) for cycle in self.since)
            waits = self.run.reaches(values.negation(told))

    def _up_to_the_finding(self) -> Node:
        """Require that the last cycle breaks the obligation; return the condition that all begins as in the finding."""
        alike = []
        for step in self.steps:
            cycle = self.run.further()
            if not self.since:
                alike += self._same(cycle.before, step.before, cycle.before)
            alike += self._same(cycle.taken, step.taken, cycle.taken)
            self.since = [cycle]
        every = (*obligations(self.ts, cycle), *pairs(cycle))
        owed = next(owed for owed in every if owed.key == self.finding.obligation.key)
        self.run.require(wrong_in(owed, cycle))
        return values.all_of(alike)

    def _same(self, leaves: Leaves, wanted: Snapshot, names: Iterator[str] | Leaves) -> list[Node]:
        return [
            values.equal(leaves[name], values.constant(self.ts.kinds[name], wanted[name]))
            for name in names
            if name in wanted
        ]

    def _each(self, how: How, alike: Node) -> None:
        """Find one run after the other that comes to this in the last cycle, each with another report or other lines."""
        if how is How.REPEATS and any(result.how is How.REPEATS for result in self.results):
            return
        wanted = self._when(how, self.since)
        for result in self.results:
            if result.how is how:
                wanted = values.both(wanted, values.negation(self._alike(result, self.since[-1])))
        while len(self.results) < MOST:
            chosen = values.both(wanted, alike)
            if not self.run.reaches(chosen):
                if not self.run.reaches(wanted):
                    return
                chosen = wanted
            another = self._reproduced(how, chosen)
            if another is None:
                return
            self.results.append(another)
            wanted = values.both(wanted, values.negation(self._alike(another, self.since[-1])))

    # --- what is looked for ---

    def _when(self, how: How, since: Sequence[Cycle]) -> Node:
        """Return the condition that the last of these cycles comes to this."""
        last = since[-1]
        match how:
            case How.ANSWERED:
                now, before = (answered(self.ts, last, leaves) for leaves in (last.after, last.before))
                return values.all_of((last.goes_on, now, values.negation(before)))
            case How.STOPS:
                return values.negation(last.goes_on)
            case How.CHANGED:
                other = values.any_of(
                    values.negation(values.equal(last.before[leaf], last.after[leaf]))
                    for leaf in told_by(self.ts)
                )
                return values.all_of((last.goes_on, answered(self.ts, last, last.before), other))
            case How.REPEATS:
                table = self.steps[-1].table
                round_ = values.any_of(comes_round(self.ts, table, since[at:]) for at in range(len(since)))
                return values.both(round_, values.negation(answered(self.ts, last, last.after)))

    def _alike(self, result: Consequence, cycle: Cycle) -> Node:
        """Return the condition that this cycle comes to the same as the last one of a consequence."""
        if result.how is How.STOPS:
            at = next(at for at in cycle.every if at.table.name == result.last.table)
            lines = [match for line, match in at.lines if line.name in result.last.matched[:2]]
            return values.both(at.runs, values.all_of(lines) if lines else at.none)
        now = self._same(cycle.after, dict(result.report), dict(cycle.after))
        then = self._same(cycle.before, dict(result.before), dict(cycle.before))
        return values.all_of((*now, *(then if result.how is How.CHANGED else [])))

    # --- the run ---

    def _reproduced(self, how: How, wanted: Node) -> Consequence | None:
        """Run the simplest run that comes to this; None if the interpreter does not do so.

        Raises:
            GaveUpError: The solver did not decide.
        """
        start, given = self.run.inputs(wanted)
        try:
            steps = ran_on(self.ts, start, given)
            first = self._comes_to(how, steps) if len(steps) == len(given) else None
        except UNDEFINED:
            return None
        if first is None:
            return None
        run = replace(
            self.finding,
            ticks=tuple({self.finding.level: step} for step in steps),
            after=len(self.since) - 1,
        )
        before, report = (reported(self.ts, leaves) for leaves in (steps[-1].before, steps[-1].after))
        shared = tuple(self.steps) == steps[: len(self.steps)]
        return Consequence(how, before, report, run, first, shared)

    def _comes_to(self, how: How, steps: Sequence[CycleRun]) -> int | None:
        """Return the cycle from which the interpreter's run repeats, 0 for none; None if the run does not come to this."""
        if not broken(self.ts, self.finding.obligation, steps[len(self.steps) - 1]):
            return None
        match how:
            case How.STOPS:
                return 0 if steps[-1].ends_the_run else None
            case How.REPEATS:
                return lasso_of(self.ts, self.steps[-1].table, steps)
            case _:
                condition = self._when(
                    how, [as_cycle(self.ts, step) for step in steps[len(self.steps) - 1 :]]
                )
                return 0 if condition.known and condition.low else None


# --- for people ----------------------------------------------------------------------------


def told(ts: TransitionSystem, consequence: Consequence) -> str:
    """Spell in a sentence the report that the superior takes."""
    above = ts.links.above
    assert above is not None
    last, at = consequence.last, f"in cycle {consequence.cycle}"
    command = (
        f"`{spell(ts.kinds[above.command], last.taken[above.command])}` (number {last.taken[above.number]})"
    )
    now = spelled_report(ts, consequence.report)
    match consequence.how:
        case How.ANSWERED:
            return f"{at} `{above.name}` takes {now} as the answer to {command}"
        case How.CHANGED:
            then = spelled_report(ts, consequence.before)
            return f"{at} the answer to {command} changes: `{above.name}` took {then}, and now takes {now}"
        case How.REPEATS:
            cycles = f"cycles {consequence.first} to {consequence.cycle} can repeat for ever"
            return f"{cycles}: `{above.name}` takes {now}, and {command} is not answered"
        case How.STOPS:
            why = " and ".join(f"`{line}`" for line in last.matched)
            why = f"lines {why} both match" if why else "no line matches"
            echoed = f"`{spell(ts.kinds[above.echoed], last.after[above.echoed])}` (number {last.after[above.echo]})"
            return f"{at} {why} and the system stops; the last report to `{above.name}` is {now}, of {echoed}"


def spelled_report(ts: TransitionSystem, report: Report) -> str:
    """Spell the report that the superior takes: the status, and the other fields that differ from their initial values."""
    usual = initial(ts.program)
    (_, status), *others = spelled_leaves(ts, report)
    unusual = {leaf for leaf, value in report if value != usual[leaf]}
    beside = [f"`{leaf.rpartition('.')[2]} = {text}`" for leaf, text in others if leaf in unusual]
    return f"`{status}`" + (f" with {', '.join(beside)}" if beside else "")


def spelled_leaves(ts: TransitionSystem, report: Report) -> Iterator[tuple[str, str]]:
    """Spell each leaf that the superior takes."""
    for leaf, value in report:
        yield leaf, spell(ts.kinds[leaf], value)
