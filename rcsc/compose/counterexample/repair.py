"""Suggests repairs of a table that a run breaks: a cell, a line, or the weakest condition under which exactly one line matches.

In: a transition system and a finding. Out: sentences in table words, each with whether it is proved of the text that it makes (`applied`);
none if no small repair is known, or the text with it is worse. A cell that parts two lines is also tried: on the table of that text runs
are searched in which another line runs than before and the answer to a command changes, or DEFAULT runs, and runs that break an obligation
that was proved. What is found of each stands beside it, and those that break less come first. Nothing found is no proof: the runs are
bounded.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum

from rcsc.compose.contract.obligations import Obligation, Sort, obligations, pause_of
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.counterexample.applied import After, Texts
from rcsc.compose.counterexample.consequence import answered, reported, spelled_report, told_by
from rcsc.compose.counterexample.cycle_run import CycleRun, ran_on, seen_by_table
from rcsc.compose.counterexample.finding import Finding
from rcsc.compose.counterexample.trace import Trace, TraceSearch, Unrolled, traces
from rcsc.lang.interpret import UNDEFINED, matching_lines
from rcsc.lang.model import Box, Enum, Program, Snapshot, Table, key_of, spell
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node
from rcsc.proof.table import boxes, cells
from rcsc.proof.table.mending import Outcome
from rcsc.proof.table.regions.partition import BudgetError, Gaps
from rcsc.proof.table.repair import NewLine, PartingCell, Partings, left_by, new_line
from rcsc.proof.table.verdict import Gap, Overlap, Region

MOST_REGIONS = 3
"""Regions that a condition may exclude and still be small."""
MOST_FINDINGS, MOST_TRIED, MOST_SHOWN = 10, 2, 3
"""Findings of a table whose repairs are tried; cells of each line that are; repairs of a finding that are shown."""
TRIED_CYCLES = 4
"""Cycles of the runs in which repairs are tried."""


def helps(ts: TransitionSystem, finding: Finding, texts: Texts | None = None) -> tuple[str, ...]:
    """Suggest changes to the table that the last cycle ran, each tried in its text."""
    step = finding.broken
    if finding.obligation.sort is Sort.PAUSES:
        return tuple(_pauses(ts, finding.obligation.name))
    if finding.obligation.sort not in {
        Sort.ASSUMPTION, Sort.SOME_LINE, Sort.ONE_LINE, Sort.NO_DEFAULT,
    }:  # fmt: skip
        return ()
    if finding.obligation.table not in {"", step.table}:
        return ()  # a table that others followed: the last one is not to be mended
    table = ts.table(step.table)
    suggested = (_suggested if boxes.applies(table) else _line)(ts, table, step, texts or Texts())
    return tuple(dict.fromkeys(suggested))


def _pauses(ts: TransitionSystem, order: str) -> Iterator[str]:
    """Yield which commands are taken for PAUSE, as their place may be the mistake."""
    below = next((one for one in ts.links.below if one.order == order), None)
    kind = None if below is None else ts.kinds[below.command]
    if below is not None and isinstance(kind, Enum):
        pause = pause_of(ts)
        yield (
            f"PAUSE is the first member of a command: `{pause}` of what `{ts.level.name}` takes, `{kind.members[0]}` of `{below.order}`; "
            "if another command rests, declare it first"
        )


def _line(ts: TransitionSystem, table: Table, step: CycleRun, texts: Texts) -> Iterator[str]:
    """Suggest a line for a table with conditions across variables that no line of it matched."""
    seen = seen_by_table(ts, step)
    if seen is not None and not matching_lines(table, seen):
        yield from _row(ts, table, Gap((seen,), (None,)), texts)


def _row(ts: TransitionSystem, table: Table, gap: Gap, texts: Texts) -> Iterator[str]:
    """Suggest a line for the input of a gap, tried in the text."""
    row = new_line(ts.program, replace(table, assumptions=()), gap)
    if isinstance(row, NewLine):
        after = texts.of(ts, str(table.name)).joined(row, gap.witnesses[0])
        if after.outcome is not Outcome.FAILS:
            yield after.told((f"{row.told}: ", ""))


def _suggested(ts: TransitionSystem, table: Table, step: CycleRun, texts: Texts) -> Iterator[str]:
    seen = seen_by_table(ts, step)
    if seen is None:
        return
    matching = [at for at, line in enumerate(table.lines) if line.name in matching_lines(table, seen)]
    if len(matching) > 1:
        every = Partings(ts.program, table).cells(Overlap(matching[0], matching[1], {}))
        best = _told(ts, table, [cell for cell in every if not cell.falls], texts)
        yield best or f"lines {_names(table, matching)} both match {_while(ts.program, table, matching)}"
    elif not matching:
        region = around(ts.program, table, seen)
        yield f"no line matches while {_conditions(ts.program, region)}"
        yield from _row(ts, table, Gap((seen,), (region,)), texts)
    else:
        yield f"line `{table.lines[matching[0]].name}` matches all the same, and no other"
    if (weakest := weakest_condition(ts.program, table)) and step.failed:
        outcome = texts.of(ts, str(table.name)).under(weakest)
        if outcome is not Outcome.FAILS:
            yield After(outcome).told((f"exactly one line matches under no more than this: {weakest}: ", ""))


def _told(ts: TransitionSystem, table: Table, cells_: Sequence[PartingCell], texts: Texts) -> str:
    """Spell the first cell that is proved in the text, else the first whose proof stays open; "" where all fail."""
    text, open_ = texts.of(ts, str(table.name)), ""
    for cell in cells_[: 2 * MOST_TRIED]:
        after = text.parted(cell)
        if after.outcome is Outcome.HOLDS:
            return after.told(cell.told(table))
        if after.outcome is Outcome.OPEN:
            open_ = open_ or after.told(cell.told(table))
    return open_


# --- repairs that are tried --------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Tried:
    """Effects in runs of cells that part lines, besides the parting.

    Attributes:
        breaks: The broken obligations and other harm, in words.
        rank: The less, the better: obligations broken and answers revoked; reasons changed and inputs that fall to DEFAULT; keys lost.
    """

    breaks: tuple[str, ...]
    rank: tuple[int, int, int]

    def outcome(self, most: int) -> str:
        """Say what the cells break in runs of up to `most` cycles."""
        return (
            f"but {'; '.join(self.breaks)}"
            if self.breaks
            else f"no run of {most} cycles shows that it breaks more"
        )


@dataclass(frozen=True, slots=True)
class Repairs:
    """Repairs that part the lines of one table that both match in some run.

    Attributes:
        helps: For each finding its repairs in words, the best first.
        together: The effect of the best of all findings together, in words; empty for fewer than two.
    """

    helps: tuple[tuple[str, ...], ...]
    together: str = ""


def repairs(
    ts: TransitionSystem,
    findings: Sequence[Finding],
    kept: Sequence[Obligation],
    most: int,
    texts: Texts | None = None,
) -> Repairs:
    """Try cells that part the two lines of each finding of one table, alone and together.

    Args:
        ts: The level.
        findings: Runs in which two lines of the table match.
        kept: Obligations that are proved, and should stay so.
        most: The most cycles of a run.
        texts: The tables' texts, as far as they were read; None for nothing yet.
    """
    texts, shown, best = texts or Texts(), list[tuple[str, ...]](), list[PartingCell]()
    trials = _Trials(ts, ts.table(findings[0].broken.table), kept, most, texts)
    for finding in findings:
        every = trials.ranked(finding) if len(shown) < MOST_FINDINGS else []
        if not every:
            shown.append(helps(ts, finding, texts))
            continue
        worth = every[: 1 if not every[0].breaks else MOST_SHOWN]
        shown.append(tuple(one.said for one in worth))
        best.append(every[0].cell)
    return Repairs(tuple(shown), trials.together(best))


@dataclass(frozen=True, slots=True)
class _Trial:
    """One cell, the help that proposes it, and the obligations it breaks."""

    cell: PartingCell
    said: str
    breaks: tuple[str, ...]
    rank: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Trials:
    """Cells of one table, each tried in its text.

    Attributes:
        kept: Obligations that are proved, and should stay so.
        most: The most cycles of a run.
    """

    ts: TransitionSystem
    table: Table
    kept: Sequence[Obligation]
    most: int
    texts: Texts

    def ranked(self, finding: Finding) -> list[_Trial]:
        """Try cells that part a finding's lines, until one is proved and breaks nothing; return those that do not fail, the best first."""
        text, so_far = self.texts.of(self.ts, str(self.table.name)), list[_Trial]()
        for cell in self._parting(finding):
            after = text.parted(cell)
            if after.outcome is Outcome.FAILS:
                continue
            trial = self._tried(cell, after)
            so_far.append(trial)
            if after.outcome is Outcome.HOLDS and not trial.breaks:
                break
        return sorted(so_far, key=lambda trial: trial.rank)

    def _parting(self, finding: Finding) -> tuple[PartingCell, ...]:
        """Return the smallest cells that part the lines of a finding: of each line one or two."""
        places = [at for at, line in enumerate(self.table.lines) if line.name in finding.obligation.lines]
        if len(places) != 2:
            return ()
        every = Partings(self.ts.program, self.table).cells(Overlap(places[0], places[1], {}))
        tries = [cell for line in places for cell in [one for one in every if one.line == line][:MOST_TRIED]]
        return tuple(cell for cell in every if cell in tries)

    def _tried(self, cell: PartingCell, after: After) -> _Trial:
        """Try a cell in runs; where it cannot be run, tell only whether it is proved."""
        said, unproved = after.told(cell.told(self.table)), int(after.outcome is not Outcome.HOLDS)
        if after.ts is None:
            return _Trial(cell, said, (), (unproved, 1, 0, cell.lost))
        trial = tried(after.ts, self.table, (cell,), self.kept, self.most)
        return _Trial(cell, f"{said}; {trial.outcome(self.most)}", trial.breaks, (unproved, *trial.rank))

    def together(self, best: Sequence[PartingCell]) -> str:
        """Spell the effect of the best cells of all findings together; "" for fewer than two, and where no text states them."""
        if len(best) < 2:
            return ""
        after = self.texts.of(self.ts, str(self.table.name)).together(best)
        begins = f"the first help of each of these {len(best)} findings, all together: "
        if after is None:
            left = left_by(self.ts.program, self.table, best)
            return f"{begins}{left}" if left else ""
        said = after.told((begins, " that no two lines match any more"))
        if after.pairs:
            said = f"{begins}lines {' and '.join(f'`{name}`' for name in after.pairs[0])} still both match some input"
        if after.ts is None:
            return said
        trial = tried(after.ts, self.table, best, self.kept, self.most)
        return f"{said}; {trial.outcome(self.most)}"


def tried(
    new: TransitionSystem,
    table: Table,
    changed: Sequence[PartingCell],
    kept: Sequence[Obligation],
    most: int,
) -> Tried:
    """Search runs in which changed cells of a table do harm; `new` is the level as its text with them is read."""
    search = TraceSearch(most, legal=True)
    harms = _Harms(new, table, new.table(table.name), tuple(changed), Unrolled(new, search)).search(most)
    owed = {obligation.key for obligation in obligations(new, new.cycle(new.havoc()))}
    still = [
        obligation for obligation in kept if obligation.key in owed
    ]  # what no line can break is not owed
    broken = traces(new, still, search)
    words = [
        f"in cycle {len(trace.steps)} this is no longer so: {obligation.shown}"
        for obligation in still
        if isinstance(trace := broken.get(obligation.key), Trace)
    ]
    grave = len(words) + (Harm.REVOKED in harms)
    slight = len(harms) - (Harm.REVOKED in harms)
    return Tried((*words, *harms.values()), (grave, slight, sum(cell.lost for cell in changed)))


class Harm(StrEnum):
    """Harm that another line does in place of the one that ran, besides broken obligations."""

    REVOKED = "revoked"
    REASON = "reason"
    DEFAULT = "default"


@dataclass(slots=True)
class _Harms:
    """The runs of a level whose table has changed cells.

    Attributes:
        table: The table as it was; `after`, as it would be.
        changed: The cells.
    """

    ts: TransitionSystem
    table: Table
    after: Table
    changed: tuple[PartingCell, ...]
    run: Unrolled
    harms: dict[Harm, str] = field(default_factory=dict)

    def search(self, most: int) -> dict[Harm, str]:
        """Find the shortest run to each harm; return them in words."""
        with suppress(GaveUpError):
            for _ in range(most):
                cycle = self.run.further()
                for harm in Harm:
                    if harm not in self.harms:
                        self._look(harm, cycle)
        return {harm: self.harms[harm] for harm in Harm if harm in self.harms}

    def _look(self, harm: Harm, cycle: Cycle) -> None:
        wanted = values.both(self._moved(cycle), self._does(harm, cycle))
        if not self.run.reaches(wanted):
            return
        start, given = self.run.inputs(wanted)
        try:
            steps = ran_on(self.ts, start, given)
        except UNDEFINED:
            return
        if len(steps) == len(given) and (words := self._words(harm, steps)):
            self.harms[harm] = words

    def _moved(self, cycle: Cycle) -> Node:
        """Return the condition that a line matched before, and does not with its changed cell."""
        at = next(at for at in cycle.every if at.table.name == self.table.name)
        before = self.ts.matches(cycle, self.table, {})
        lost = (
            values.both(before[cell.line], values.negation(at.matches[cell.line])) for cell in self.changed
        )
        return values.all_of((at.runs, cycle.goes_on, values.any_of(lost)))

    def _does(self, harm: Harm, cycle: Cycle) -> Node:
        if harm is Harm.DEFAULT:
            at = next(at for at in cycle.every if at.table.name == self.table.name)
            return at.none if at.table.default is not None else values.FALSE
        if self.ts.links.above is None:
            return values.FALSE
        status, *others = (values.equal(cycle.before[leaf], cycle.after[leaf]) for leaf in told_by(self.ts))
        if harm is Harm.REVOKED:
            return values.both(answered(self.ts, cycle, cycle.before), values.negation(status))
        reason = values.both(status, values.negation(values.all_of(others)))
        return values.both(answered(self.ts, cycle, cycle.before), reason)

    def _words(self, harm: Harm, steps: Sequence[CycleRun]) -> str:
        """Describe the last cycle; "" if the interpreter does not confirm the harm."""
        last, at = steps[-1], len(steps)
        if harm is Harm.DEFAULT:
            default = self.after.default
            seen = seen_by_table(self.ts, last)
            if default is None or last.line != default.name or seen is None:
                return ""
            read = (f"{name} = {spell(self.ts.kinds[name], seen[name])}" for name in self._narrowing())
            return f"in cycle {at} DEFAULT runs, where {', '.join(read)}"
        before, report = (reported(self.ts, leaves) for leaves in (last.before, last.after))
        if before == report:
            return ""
        then, now = (spelled_report(self.ts, each) for each in (before, report))
        return f"in cycle {at} line `{last.line}` changes the answer to a command from {then} to {now}"

    def _narrowing(self) -> tuple[str, ...]:
        """List the leaves that the lines whose cells are changed look at."""
        lines = [self.after.lines[at] for cell in self.changed for at in (cell.line, cell.other)]
        read = {str(name) for line in lines for test in line.stated for name in test.variables}
        return tuple(str(name) for name in self.table.variables if name in read)


def around(program: Program, table: Table, seen: Snapshot) -> Region:
    """Grow a maximal region, in which no line matches, around an input that none matches."""
    decided = boxes.TableBoxes.of(program, table)
    kinds = program.kinds
    cell = {name: (key_of(kinds[name], seen[name]),) * 2 for name in decided.names}
    region = Gaps.of(decided, disjoint=True).grown(cell, ())
    return decided.narrowed(region)


def weakest_condition(program: Program, table: Table) -> str:
    """Return the condition of exactly the inputs that one line matches; empty if it is not small."""
    decided = boxes.TableBoxes.of(program, table)
    regions: list[Region] = []
    for first, second in decided.overlaps():
        regions.append(decided.both(first, second).region or {})
        if len(regions) > MOST_REGIONS:
            return ""
    search = Gaps.of(decided, disjoint=not regions)
    gaps: list[Mapping[str, Box]] = []
    try:
        while (cell := search.least(gaps)) is not None:
            gaps.append(search.grown(cell, gaps))
            if len(regions) + len(gaps) > MOST_REGIONS:
                return ""
    except BudgetError:
        return ""
    every = [*regions, *(decided.narrowed(gap) for gap in gaps)]
    return " and ".join(f"not ({_conditions(program, region)})" for region in every)


def _conditions(program: Program, region: Region) -> str:
    return " and ".join(cells.region(program.kinds, region)) or "true"


def _while(program: Program, table: Table, matching: list[int]) -> str:
    region = boxes.TableBoxes.of(program, table).both(matching[0], matching[1]).region
    return f"while {_conditions(program, region or {})}"


def _names(table: Table, matching: list[int]) -> str:
    return " and ".join(f"`{table.lines[at].name}`" for at in matching)
