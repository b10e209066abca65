"""Finds runs of a level, its subordinate and their buffers in which an order is lost or misreported.

In: two transition systems and the link between them. Out: the shortest run in which what one assumes of the other is broken. It is searched
for if a level is not proved to number its orders, or not to answer them: a run of one level shows that, a run of both shows what is
lost.

In each tick one of the levels runs, or both. Each sees what the other left in the buffer before this tick. So a level that does not run
for a while sees values late, misses some, and sees others again. All else keeps to the level's contract.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from rcsc.compose.contract.beginning import Starts
from rcsc.compose.contract.environment import Below, leaves_under
from rcsc.compose.contract.obligations import Obligation, Sort
from rcsc.compose.contract.transition import Cycle, Leaves, TransitionSystem
from rcsc.compose.counterexample.consequence import MOST, Consequence, How, answered, reported
from rcsc.compose.counterexample.cycle_run import CycleRun, as_cycle, broken, one_cycle
from rcsc.compose.counterexample.finding import Finding
from rcsc.compose.counterexample.simplest import Bounded, Simplest
from rcsc.compose.counterexample.trace import NotReproducedError, TraceSearch, in_order
from rcsc.lang.interpret import initial
from rcsc.lang.model import Bool, Value
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node


@dataclass(slots=True)
class _Side:
    """One of the two levels.

    Attributes:
        takes: Each leaf that comes from the other level, and its name there.
        begins: Leaves that begin with other values than the initial ones.
        now: Its leaves after the last tick.
        taken: For each tick the inputs that it takes if it runs.
        runs: For each tick whether it runs; `cycles`, its cycle if it does.
    """

    name: str
    ts: TransitionSystem
    takes: Mapping[str, str]
    begins: Mapping[str, Value]
    now: Leaves = field(init=False)
    taken: list[Leaves] = field(default_factory=list)
    runs: list[Node] = field(default_factory=list)
    cycles: list[Cycle] = field(default_factory=list)

    def __post_init__(self) -> None:
        begun = {leaf: values.constant(self.ts.kinds[leaf], value) for leaf, value in self.begins.items()}
        self.now = self.ts.initial() | begun

    @property
    def inputs(self) -> list[str]:
        """Inputs that do not come from the other level."""
        return [name for name in self.ts.inputs if name not in self.takes]


def followed_together(
    upper: TransitionSystem,
    lower: TransitionSystem,
    below: Below,
    search: TraceSearch,
    begins: Starts = MappingProxyType({}),
    further: int = 0,
) -> tuple[Finding | NotReproducedError | None, tuple[Consequence, ...]]:
    """Find the shortest run of both levels in which one breaks an assumption of the other; None if none is found.

    That is: the lower level takes another order under the number that it took last, or a report misstates the last order of the upper
    one, within `search.most` ticks. `begins` has, for each level, the leaves that begin with other values than the initial ones. Also
    find the shortest runs, up to `further` ticks longer, after which the superior of the upper level takes an answer to its command.
    """
    pair = _Together(upper, lower, below, begins)
    finding: Finding | NotReproducedError | None = None
    with suppress(GaveUpError):
        for tick in range(1, search.most + 1):
            for obligation in pair.further(tick):
                if (finding := pair.reproduced(obligation)) is not None:
                    follows = (
                        pair.answers(finding, obligation, further) if isinstance(finding, Finding) else ()
                    )
                    return finding, tuple(follows)
    return finding, ()


@dataclass(slots=True)
class _Together:
    """Both levels, tick by tick."""

    upper: TransitionSystem
    lower: TransitionSystem
    below: Below
    begins: Starts
    sides: tuple[_Side, _Side] = field(init=False)
    buffers: Leaves = field(init=False)
    _run: Bounded = field(default_factory=Bounded)

    def __post_init__(self) -> None:
        above = self.lower.links.above
        assert above is not None
        reports = _renamed(self.upper, self.below.report, above.report)
        orders = _renamed(self.lower, above.order, self.below.order)
        others = tuple(below for below in self.upper.links.below if below != self.below)
        self.sides = (
            self._side(_with(self.upper, below=others), reports),
            self._side(_with(self.lower, above=None), orders),
        )
        self.buffers = {
            leaf: side.now[leaf] for side in self.sides for leaf in side.takes
        }  # nothing is published yet: each keeps its initial values

    def _side(self, ts: TransitionSystem, takes: Mapping[str, str]) -> _Side:
        return _Side(ts.level.name, ts, takes, self.begins.get(ts.level.name, {}))

    def further(self, tick: int) -> tuple[Obligation, Obligation]:
        """Add a tick; return the two obligations in it."""
        before = [side.now for side in self.sides]
        for side in self.sides:
            side.runs.append(values.variable(f"{side.name} runs {tick}", Bool()))
        self._run.add(values.any_of(side.runs[-1] for side in self.sides))
        seen = dict(self.buffers)
        for side in self.sides:
            self._cycle(side, seen, tick)
        return self._obligations(before)

    def _cycle(self, side: _Side, seen: Leaves, tick: int) -> None:
        """Add one cycle of a level, if it runs."""
        kinds = side.ts.kinds
        taken = {leaf: values.variable(f"{side.name} {leaf} {tick}", kinds[leaf]) for leaf in side.inputs}
        taken |= {leaf: seen[leaf] for leaf in side.takes}
        cycle = side.ts.cycle(side.now, f" of {side.name} {tick}", taken=taken)
        runs = side.runs[-1]
        kept = values.all_of((cycle.goes_on, cycle.contract, in_order(side.ts, side.now, taken)))
        self._run.add(values.follows(runs, kept))
        side.taken.append(taken)
        side.cycles.append(cycle)
        for other in self.sides:
            for leaf, source in other.takes.items():
                if other is not side:
                    self.buffers[leaf] = values.choice(runs, cycle.after[source], self.buffers[leaf])
        side.now = {name: values.choice(runs, cycle.after[name], node) for name, node in side.now.items()}

    def _obligations(self, before: list[Leaves]) -> tuple[Obligation, Obligation]:
        upper, lower = self.sides
        above = self.lower.links.above
        assert above is not None
        number, taken = above.number, lower.taken[-1]
        fields = dict.fromkeys((above.command, *above.numbered))
        same = values.all_of(values.equal(before[1][leaf], taken[leaf]) for leaf in fields)
        same_order = values.follows(
            values.both(lower.runs[-1], values.equal(before[1][number], taken[number])), same
        )
        of_its_order = values.follows(
            upper.runs[-1], TransitionSystem.echo(self.below, before[0], upper.taken[-1])
        )
        return (
            Obligation(Sort.SAME_ORDER, "", above.order, same_order),
            Obligation(Sort.OF_ITS_ORDER, "", self.below.report, of_its_order),
        )

    # --- the run ---

    def reproduced(self, obligation: Obligation) -> Finding | NotReproducedError | None:
        """Run the simplest run that breaks the obligation in the last tick; None if there is none.

        Raises:
            GaveUpError: The solver did not decide.
        """
        wrong = self._run.literal(values.negation(obligation.holds))
        if not self._run.holds([wrong]):
            return None
        ticks = tuple(self._ran(Simplest(self._run, [wrong])))
        ts = self.upper if obligation.sort is Sort.OF_ITS_ORDER else self.lower
        level = ts.level.name
        if level not in ticks[-1] or not broken(ts, obligation, ticks[-1][level]):
            return NotReproducedError(obligation.shown, guessed=self._run.guessed)
        return Finding(level, replace(obligation, holds=values.FALSE), ticks)

    def answers(self, finding: Finding, obligation: Obligation, further: int) -> list[Consequence]:
        """Find how the upper level answers the command that stands when the obligation is broken, each answer once."""
        results: list[Consequence] = []
        if self.upper.links.above is None or not further:
            return results
        self._run.add(values.negation(obligation.holds))
        with suppress(GaveUpError):
            for more in range(further + 1):
                if more:
                    before = self.sides[0].now
                    self.further(len(finding.ticks) + more)
                    self._run.add(self._command_stays(before))
                self._answered(finding, results)
        return results

    def _command_stays(self, before: Leaves) -> Node:
        """Return the condition that the upper level, if it runs, takes the same command as before."""
        above, side = self.upper.links.above, self.sides[0]
        assert above is not None
        return values.follows(side.runs[-1], values.equal(before[above.number], side.taken[-1][above.number]))

    def _answered(self, finding: Finding, results: list[Consequence]) -> None:
        """Add each answer that the upper level can give in the last tick."""
        side = self.sides[0]
        cycle = side.cycles[-1]
        late = values.negation(answered(side.ts, cycle, cycle.before))
        wanted = values.all_of((side.runs[-1], answered(side.ts, cycle, cycle.after), late))
        while True:
            for result in results:
                alike = (
                    values.equal(cycle.after[leaf], values.constant(side.ts.kinds[leaf], value))
                    for leaf, value in result.report
                )
                wanted = values.both(wanted, values.negation(values.all_of(alike)))
            literal = self._run.literal(wanted)
            if len(results) == MOST or not self._run.holds([literal]):
                return
            result_ = self._answer(finding, tuple(self._ran(Simplest(self._run, [literal]))))
            if result_ is None:
                return
            results.append(result_)

    def _answer(self, finding: Finding, ticks: tuple[dict[str, CycleRun], ...]) -> Consequence | None:
        """Return the consequence of a run; None if the interpreter does not answer, or does not break the obligation."""
        name, at = self.sides[0].name, finding.broken_at - 1
        ts = self.upper if finding.level == name else self.lower
        step = ticks[-1].get(name)
        if len(ticks) != len(self.sides[0].runs) or step is None or finding.level not in ticks[at]:
            return None
        answers = answered(self.upper, now := as_cycle(self.upper, step), now.after)
        if not (answers.known and answers.low and broken(ts, finding.obligation, ticks[at][finding.level])):
            return None
        before, report = (reported(self.upper, leaves) for leaves in (step.before, step.after))
        run = replace(finding, ticks=ticks, after=len(ticks) - finding.broken_at)
        shared = ticks[: at + 1] == finding.ticks[: at + 1]
        return Consequence(How.ANSWERED, before, report, run, shared=shared, reports=name)

    def _ran(self, settled: Simplest) -> Iterator[dict[str, CycleRun]]:
        now = {side.name: {**initial(side.ts.program), **side.begins} for side in self.sides}
        held = {leaf: now[side.name][leaf] for side in self.sides for leaf in side.takes}
        found: dict[str, Mapping[str, Value]] = {}
        runs = [
            settled.settle([side.runs[at] for side in self.sides], [True, True])
            for at in range(len(self.sides[0].runs))
        ]
        for at, which in enumerate(runs):
            seen, steps = dict(held), dict[str, CycleRun]()
            for side, running in zip(self.sides, which, strict=True):
                free = settled.settle(
                    [side.taken[at][leaf] for leaf in side.inputs],
                    [now[side.name][leaf] for leaf in side.inputs],
                )
                if running:
                    taken = dict(zip(side.inputs, free, strict=True)) | {
                        leaf: seen[leaf] for leaf in side.takes
                    }
                    answers = settled.answers(side.ts.program, side.cycles[at])
                    steps[side.name] = one_cycle(
                        side.ts, now[side.name], taken, answers, found.get(side.name)
                    )
                    found[side.name] = steps[side.name].left
                    now[side.name] = dict(steps[side.name].after)
                    self._publish(side, now[side.name], held)
            yield steps
            if any(step.ends_the_run for step in steps.values()):
                return

    def _publish(self, side: _Side, after: Mapping[str, Value], held: dict[str, Value]) -> None:
        for other in self.sides:
            if other is not side:
                held |= {leaf: after[source] for leaf, source in other.takes.items()}


def exchange(
    systems: Mapping[str, TransitionSystem], levels: Sequence[str]
) -> dict[str, dict[str, tuple[str, str]]]:
    """Map each level's inputs that come from another of the levels to that level and their names there."""
    sources: dict[str, dict[str, tuple[str, str]]] = {name: {} for name in levels}
    for name in levels:
        for below in systems[name].links.below:
            if below.name in sources and (above := systems[below.name].links.above) is not None:
                reports = _renamed(systems[name], below.report, above.report)
                orders = _renamed(systems[below.name], above.order, below.order)
                sources[name] |= {leaf: (below.name, source) for leaf, source in reports.items()}
                sources[below.name] |= {leaf: (name, source) for leaf, source in orders.items()}
    return sources


def _renamed(ts: TransitionSystem, record: str, other: str) -> dict[str, str]:
    """Map the leaves of a record to their names at the other end of the buffer."""
    return {leaf: other + leaf.removeprefix(record) for leaf in leaves_under(ts.program, record)}


def _with(ts: TransitionSystem, **links: object) -> TransitionSystem:
    """Return the level with these links: a neighbour that is present is not assumed."""
    return TransitionSystem(ts.program, ts.level, replace(ts.links, **links))  # type: ignore[arg-type]  # fields of Links
