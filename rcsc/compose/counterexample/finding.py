"""A finding: a run of one level or of several that breaks an obligation, as the interpreter did it; its time line.

In: traces. Out: `Finding`s; rows and lines of text, in the tables' words.
"""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from rcsc.compose.contract.obligations import BROKEN, Obligation, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import CycleRun, one_cycle, seen_by_table
from rcsc.compose.counterexample.trace import Trace
from rcsc.lang.interpret import Fault, initial
from rcsc.lang.model import Scalar, Value, key_bounds, key_of, spell
from rcsc.run.description import Description


@dataclass(frozen=True, slots=True)
class Finding:
    """A run that breaks an obligation.

    Attributes:
        level: The level that owes the obligation.
        obligation: The obligation.
        ticks: For each tick the cycle of each level that ran in it, from the top down.
        after: How many ticks follow the one in which it is broken, to show its consequence.
        restarted: Whether it begins where a restart does, and not with the initial values.
        legal: Whether the levels around keep to more than the contract (`TraceSearch.legal`).
        lasso: The cycle, from 1, before which all is as at the end, so that it may go on for ever; 0 if it is no lasso.
    """

    level: str
    obligation: Obligation
    ticks: tuple[Mapping[str, CycleRun], ...]
    after: int = 0
    restarted: bool = False
    legal: bool = True
    lasso: int = 0

    @property
    def broken_at(self) -> int:
        """The tick in which the obligation is broken, from 1."""
        return len(self.ticks) - self.after

    @property
    def broken(self) -> CycleRun:
        """The cycle that breaks it."""
        return self.ticks[self.broken_at - 1][self.level]

    @property
    def levels(self) -> tuple[str, ...]:
        """The levels in it, in the order in which they come."""
        return tuple(dict.fromkeys(name for tick in self.ticks for name in tick))

    def start(self, level: str) -> Mapping[str, Value]:
        """Return every leaf of a level before its first cycle."""
        return next(tick[level].before for tick in self.ticks if level in tick)


def supposed(system: Description, levels: Container[str], finding: Finding) -> dict[str, tuple[str, ...]]:
    """Return, by other level, the inputs for which a run of one level alone supposes new values.

    Nothing where levels ran together: then each gave what the others took.
    """
    if len(finding.levels) > 1:
        return {}
    start = finding.start(finding.level)
    moved = {
        name
        for tick in finding.ticks
        for name, value in tick[finding.level].taken.items()
        if value != start[name] or finding.restarted
    }
    given: dict[str, list[str]] = {}
    for wire in system.wires:
        owner, (reader, _, into) = wire.source.partition(".")[0], wire.target.partition(".")
        inside = (f"{into}.", f"{into}[")
        if (
            reader == finding.level
            and owner in levels
            and any(name == into or name.startswith(inside) for name in moved)
        ):
            given.setdefault(owner, []).append(into)
    return {owner: tuple(inputs) for owner, inputs in given.items()}


def of_trace(ts: TransitionSystem, obligation: Obligation, trace: Trace) -> Finding:
    """Make a finding of one level's trace, one cycle longer if a command is passed over, which shows only then."""
    steps = list(trace.steps)
    if obligation.sort is Sort.ANSWERED:
        last = steps[-1]
        steps.append(one_cycle(ts, last.after, last.taken, last.answers, last.left))
    ticks = tuple({ts.level.name: step} for step in steps)
    after = len(steps) - len(trace.steps)
    return Finding(ts.level.name, obligation, ticks, after, trace.restarted, trace.legal)


# --- for people ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TimeLineRow:
    """One cycle of one level, in the tables' words.

    Attributes:
        tick: From 1; 0 where the run begins with a restart, or otherwise than declared.
        line: The line that ran; all that matched if several did, `none` if none did; before the first `RESTART` or `BEGINS`.
        takes: The inputs that changed, and their values.
        leaves: The other leaves that the cycle changed.
        wrong: The fault or broken obligation in it; empty for none.
        before: Table and line of each that ran before in the cycle.
    """

    tick: int
    level: str
    table: str
    line: str
    takes: Mapping[str, str]
    leaves: Mapping[str, str]
    wrong: str
    before: tuple[tuple[str, str], ...] = ()

    @property
    def ran(self) -> tuple[str, ...]:
        """Return every table with its line, in order."""
        return tuple(f"{table}: {line}" for table, line in (*self.before, (self.table, self.line)))


@dataclass(frozen=True, slots=True)
class Tick:
    """The rows of one tick, for folding (`alike`)."""

    rows: tuple[TimeLineRow, ...]

    @property
    def number(self) -> int:
        """The tick, from 1."""
        return self.rows[0].tick

    @property
    def ran(self) -> tuple[tuple[str, tuple[str, ...]], ...] | None:
        """The lines of each level; None where something was taken, or went wrong."""
        if any(row.takes or row.wrong or not row.tick for row in self.rows):
            return None
        return tuple((row.level, row.ran) for row in self.rows)

    @property
    def moved(self) -> dict[str, str]:
        """What the levels changed, by level and leaf."""
        several = len(self.rows) > 1
        return {
            f"{row.level}.{name}" if several else name: said
            for row in self.rows
            for name, said in row.leaves.items()
        }


def by_tick(shown: Sequence[TimeLineRow]) -> list[Tick]:
    """Put together the rows of each tick."""
    return [Tick(tuple(of)) for _, of in groupby(shown, key=lambda row: row.tick)]


RESTART, BEGINS = "restart", "begins"

_FAULTS = {
    Fault.NO_LINE: "no line matches",
    Fault.SEVERAL_LINES: "several lines match",
    Fault.ADMIT: "an input is refused",
    Fault.EXTERN: "an extern procedure is refused",
    Fault.ASSUMPTION: "the cycle ends there",
}


def rows(systems: Mapping[str, TransitionSystem], finding: Finding) -> tuple[TimeLineRow, ...]:
    """Return the time line: a row for each cycle of each level."""
    said = dict(_said(finding))
    return tuple(
        _row(systems[name], tick, step, said.get(tick, "") if name == finding.level else "")
        for tick, steps in enumerate(finding.ticks, 1)
        for name, step in steps.items()
    )


def _said(finding: Finding) -> Iterator[tuple[int, str]]:
    """Yield what is said of ticks: where the obligation is broken, or where a lasso begins and ends."""
    sort, name, first, last = (
        finding.obligation.sort,
        finding.obligation.name,
        finding.lasso,
        finding.broken_at,
    )
    if not first:
        yield last, BROKEN.get(sort, "").format(name)
    elif sort is Sort.ENDS:
        yield last, f"all is as it was before cycle {first}: so it may go on for ever"
    else:
        begins, ends = f"from here on {round_of(finding)}", f"`{name}` waits as it did before cycle {first}"
        yield first, begins if first < last else f"{ends}; {begins}"
        if first < last:
            yield last, ends


def round_of(finding: Finding) -> str:
    """Spell which cycles of a lasso come again and again."""
    if finding.lasso == finding.broken_at:
        return f"cycle {finding.lasso} again and again"
    return f"cycles {finding.lasso} to {finding.broken_at} again and again"


def state_of(ts: TransitionSystem, finding: Finding) -> dict[str, str]:
    """Return the level's own values before the first cycle of a run: those that its line tests, and those that are not initial."""
    start, usual = finding.start(finding.level), initial(ts.program)
    step = finding.ticks[0][finding.level]
    line = next((line for line in ts.table(step.table).lines if line.name == step.line), None)
    tests = () if line is None else line.stated
    tested = {str(name) for test in tests for name in test.variables}
    return {
        name: spell(ts.kinds[name], start[name])
        for name, value in usual.items()
        if name not in step.taken and (name in tested or start[name] != value)
    }


def lap_of(ts: TransitionSystem, finding: Finding) -> list[str]:
    """Spell a lasso: of each of its cycles table and line, with the level's own values that the line tests; repetitions are left out."""
    laps = []
    for tick in finding.ticks[finding.lasso - 1 :]:
        if (step := tick.get(finding.level)) is None:
            continue  # of several levels it need not run in each tick
        seen = seen_by_table(ts, step)
        line = next((line for line in ts.table(step.table).lines if line.name == step.line), None)
        tested = dict.fromkeys(
            str(name)
            for test in (line.stated if line else ())
            for name in test.variables
            if name not in step.taken
        )
        state = ", ".join(
            f"`{name}` = {spell(ts.kinds[name], seen[name])}" for name in tested if seen is not None
        )
        laps.append(f"line `{step.line}`" + (f" at {state}" if state else ""))
    return list(dict.fromkeys(laps))


def beginnings(made: Mapping[str, TransitionSystem], finding: Finding) -> tuple[TimeLineRow, ...]:
    """Return a row for each level of a run that begins with a restart, or with other values than the initial ones."""
    first = {name: next(tick[name] for tick in finding.ticks if name in tick) for name in finding.levels}
    every = (_begun(made[name], step, restarted=finding.restarted) for name, step in first.items())
    return tuple(row for row in every if finding.restarted or row.takes or row.leaves)


def _begun(ts: TransitionSystem, step: CycleRun, *, restarted: bool) -> TimeLineRow:
    """Return the row before the first cycle: leaves that are not initial, and after a restart those that the first table reads."""
    usual = initial(ts.program)
    tested = {str(name) for name in ts.table(step.table).variables if restarted}
    begins = {
        name: spell(ts.kinds[name], step.before[name])
        for name, value in usual.items()
        if name in tested or step.before[name] != value
    }
    takes = {name: said for name, said in begins.items() if name in step.taken}
    leaves = {name: said for name, said in begins.items() if name not in step.taken}
    return TimeLineRow(0, ts.level.name, "", RESTART if restarted else BEGINS, takes, leaves, "")


def _row(ts: TransitionSystem, tick: int, step: CycleRun, said: str) -> TimeLineRow:
    """Return the row of one cycle, with only the leaves that change."""
    kinds = ts.kinds
    changed = {
        name: _spelled(kinds[name], value) for name, value in step.after.items() if step.before[name] != value
    }
    takes = {name: text for name, text in changed.items() if name in step.taken}
    takes |= dict(_answers(ts, step))
    told = {*step.taken, *map(str, ts.program.line_leaves.values())}
    leaves = {name: text for name, text in changed.items() if name not in told}
    failed = dict.fromkeys(
        name for part in (*(stage.failed for stage in step.stages), step.failed) for name in part
    )
    wrong = [f"assumption `{name}` fails" for name in failed]
    wrong += [_FAULTS[step.fault]] if step.fault in _FAULTS else []
    wrong += [said] if said else []
    line = " and ".join(step.matched) or "none"
    before = tuple((stage.table, stage.line) for stage in step.stages)
    return TimeLineRow(
        tick,
        ts.level.name,
        step.table,
        line,
        takes,
        leaves,
        "; ".join(wrong),
        before,
    )


def _spelled(kind: Scalar, value: Value) -> str:
    """Spell what came from outside: what is refused has no words of its type."""
    low, high = key_bounds(kind)
    inside = value == value and low <= key_of(kind, value) <= high  # noqa: PLR0124  # no NaN
    return spell(kind, value) if inside else f"{value}, refused"


def _answers(ts: TransitionSystem, step: CycleRun) -> Iterator[tuple[str, str]]:
    """Spell the results of extern procedures, call by call; refused values have no words of their type."""
    for procedure, given in step.answers:
        writes = next(declared.writes for declared in ts.program.procedures if declared.name == procedure)
        for leaf, value in zip(writes, given, strict=True):
            yield (
                f"{leaf} from {procedure}",
                _spelled(ts.kinds[leaf], value),
            )
