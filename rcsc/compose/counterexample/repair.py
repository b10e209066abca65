"""Suggests repairs of a table that a run breaks: a cell, a line, or the weakest condition under which exactly one line matches.

In: a transition system and a finding. Out: sentences in table words, each proved of the table as it stands; none if no small repair is
known.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from rcsc.compose.contract.obligations import Sort, pause_of
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import CycleRun, seen_by_table
from rcsc.compose.counterexample.finding import Finding
from rcsc.lang.interpret import matching_lines
from rcsc.lang.model import Box, Enum, Program, Scalar, Snapshot, Table, key_of
from rcsc.table import boxes, cells
from rcsc.table.regions.partition import BudgetError, Gaps
from rcsc.table.repair import closing_line, parting_cell
from rcsc.table.verdict import Gap, Overlap, Region

MOST_REGIONS = 3
"""Regions that a condition may exclude and still be small."""


def helps(ts: TransitionSystem, finding: Finding) -> tuple[str, ...]:
    """Suggest changes to the table that the last cycle ran."""
    step = finding.broken
    if finding.obligation.sort is Sort.PAUSES:
        return tuple(_pauses(ts, finding.obligation.name))
    if finding.obligation.sort not in {
        Sort.ASSUMPTION, Sort.SOME_LINE, Sort.ONE_LINE, Sort.NO_DEFAULT,
    }:  # fmt: skip
        return ()
    table = ts.table(step.table)
    if not boxes.applies(table):
        return tuple(_line(ts, replace(table, assumptions=()), step))
    return tuple(dict.fromkeys(_suggested(ts, table, step)))


def _pauses(ts: TransitionSystem, order: str) -> Iterator[str]:
    """Say which commands are taken for PAUSE, as the mistake may be their place."""
    below = next((one for one in ts.links.below if one.order == order), None)
    kind = None if below is None else ts.kinds[below.command]
    if below is not None and isinstance(kind, Enum):
        pause = pause_of(ts)
        yield (
            f"PAUSE is the first member of a command: `{pause}` of what `{ts.level.name}` takes, `{kind.members[0]}` of `{below.order}`; "
            "if another command rests, declare it first"
        )


def _line(ts: TransitionSystem, table: Table, step: CycleRun) -> Iterator[str]:
    """Suggest a line for a table with conditions across variables that no line of it matched."""
    seen = seen_by_table(ts, step)
    if seen is not None and not matching_lines(table, seen):
        row = closing_line(ts.program, table, Gap((seen,), (None,)))
        if row:
            yield row


def _suggested(ts: TransitionSystem, table: Table, step: CycleRun) -> Iterator[str]:
    seen = seen_by_table(ts, step)
    if seen is None:
        return
    matching = [at for at, line in enumerate(table.lines) if line.name in matching_lines(table, seen)]
    if len(matching) > 1:
        cell = parting_cell(ts.program, table, Overlap(matching[0], matching[1], {}))
        yield cell or f"lines {_names(table, matching)} both match {_while(ts.program, table, matching)}"
    elif not matching:
        region = around(ts.program, table, seen)
        yield f"no line matches while {_conditions(ts.program, region)}"
        if row := closing_line(ts.program, replace(table, assumptions=()), Gap((seen,), (region,))):
            yield row
    else:
        yield f"line `{table.lines[matching[0]].name}` matches all the same, and no other"
    if (weakest := weakest_condition(ts.program, table)) and step.failed:
        yield f"exactly one line matches under no more than this: {weakest}: proved"


def around(program: Program, table: Table, seen: Snapshot) -> Region:
    """Grow a maximal region, in which no line matches, around an input that none matches."""
    decided = boxes.TableBoxes.of(program, table)
    kinds = {str(v.name): v.type for v in program.variables}
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
    kinds: dict[str, Scalar] = {str(v.name): v.type for v in program.variables}
    return " and ".join(cells.region(kinds, region)) or "true"


def _while(program: Program, table: Table, matching: list[int]) -> str:
    region = boxes.TableBoxes.of(program, table).both(matching[0], matching[1]).region
    return f"while {_conditions(program, region or {})}"


def _names(table: Table, matching: list[int]) -> str:
    return " and ".join(f"`{table.lines[at].name}`" for at in matching)
