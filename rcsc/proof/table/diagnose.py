"""What was found of a table, as diagnostics."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import (
    Change,
    ChangeKind,
    Diagnostic,
    Effects,
    Label,
    Proposal,
    Severity,
    WitnessColumn,
    sort_key,
)
from rcsc.lang.interval_sets import size
from rcsc.lang.model import (
    Box,
    Enum,
    Line,
    Program,
    Scalar,
    Table,
    key_bounds,
)
from rcsc.proof.procedures.meetings import witness_column
from rcsc.proof.relation.alike import alike
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.table import cells as words
from rcsc.proof.table.certificate import must_cover
from rcsc.proof.table.findings import printed
from rcsc.proof.table.findings.told import grouped, likely, names_of
from rcsc.proof.table.regions import partition
from rcsc.proof.table.repair import NewLine, PartingCell, Partings, changes_of, left_by, new_line
from rcsc.proof.table.verdict import (
    ContradictoryAssumptions,
    DeadLine,
    Gap,
    Overlap,
    Region,
    SolversDisagree,
    TableVerdict,
    Undecided,
    Witness,
)

MOST_PAIRS = 20
"""Overlapping pairs shown of one table; then how many more."""
MOST_COMPARED = 200
"""Overlapping pairs of one table of which it is told whether the two lines do the same."""
COMPARED_STEPS = 200_000
"""Steps of Z3 a question whether two such lines leave a variable different: a tenth of a second or some; published tables need 20,000."""
FAR = 80
"""Characters between a line's name and a cell of it from which on an excerpt points at both."""
MOST_NAMED = 5
"""Lines that are named because they overlap with the most others."""
MANY = 3
"""Regions of a gap from which on it is said, too, how they lie over an enumeration."""


def diagnostics(
    program: Program, verdict: TableVerdict, options: Options, unproved: Collection[str] = ()
) -> list[Diagnostic]:
    """Turn a verdict's findings into diagnostics; `unproved` names the invariants and assumptions whose proof failed."""
    table = verdict.table
    few = min(WRONG_STEPS, options.together)
    with smt.together(few, of_all=True):
        verdict = replace(verdict, findings=tuple(likely(program, table, verdict.findings, options)))
    overlaps = [overlap for overlap in verdict.findings if isinstance(overlap, Overlap)]
    partings = Partings(program, table)
    with smt.together(few, of_all=True):
        shown = [_overlap(program, partings, overlap, options) for overlap in overlaps[:MOST_PAIRS]]
        effects = [_effects(program, table, each, options) for each in overlaps[MOST_PAIRS:MOST_COMPARED]]
    shown = grouped(table, overlaps, shown)
    if shown and not options.brief and (together := _together(partings, overlaps[:MOST_PAIRS])):
        last = max(
            (at for at, each in enumerate(shown) if not each.told_with), key=lambda at: sort_key(shown[at])
        )
        shown[last] = replace(
            shown[last],
            notes=(*shown[last].notes, together.said),
            proposals=(*shown[last].proposals, *((together,) if together.changes else ())),
        )
    if len(overlaps) > MOST_PAIRS:
        least = "at least " if len(overlaps) == partition.MOST_PAIRS else ""
        message = (
            f"and {least}{len(overlaps) - MOST_PAIRS} more pairs of lines of table `{table.name}` overlap"
        )
        others = tuple(
            replace(
                _column(program, table, each.witness, (each.first, each.second), each.region),
                effects=compared,
            )
            for each, compared in zip_longest(overlaps[MOST_PAIRS:], effects)
        )
        notes = (_most_overlapping(table, overlaps), "--json lists every pair with its witness")
        shown.append(
            Diagnostic(
                Code.OVERLAP, message, Label(table.span), notes=notes, witnesses=others, only_listed=True
            )
        )
    with smt.together(few, of_all=True):
        rest = list(_others(program, verdict, options, unproved))
    return shown + rest + _lower(table)


def _others(
    program: Program, verdict: TableVerdict, options: Options, unproved: Collection[str]
) -> Iterator[Diagnostic]:
    table = verdict.table
    for finding in verdict.findings:
        match finding:
            case Gap():
                yield _gap(program, table, finding, options)
            case DeadLine(line, assuming):
                yield _dead(table, line, assuming, _under(table, unproved))
            case ContradictoryAssumptions():
                message = f"the assumptions of table `{table.name}` contradict each other, an invariant or the declared ranges"
                yield Diagnostic(Code.CONTRADICTORY_ASSUMPTIONS, message, Label(table.span))
            case Undecided(what):
                helps = (
                    "mend what is wrong first: then this is asked with more steps"
                    if verdict.refuted
                    else "give each query more steps with `--steps`, or simplify the conditions",
                )
                message = f"table `{table.name}` could not be decided: {what}"
                beside = Severity.NOTE if verdict.refuted else Severity.ERROR  # an error is told already
                yield Diagnostic(Code.UNDECIDED, message, Label(table.span), help=helps, severity=beside)
            case SolversDisagree(what):
                message = f"Z3 disagrees about table `{table.name}`: {what}; this is a bug in rcsc"
                yield Diagnostic(Code.SOLVERS_DISAGREE, message, Label(table.span))
            case Overlap():
                pass
    if table.default is None or table.default.unreachable or verdict.undecided:
        return
    if not any(isinstance(finding, Gap | ContradictoryAssumptions) for finding in verdict.findings):
        message = f"the DEFAULT line of table `{table.name}` is never reached"
        helps = ("declare it: `DEFAULT unreachable`; that is then proved",)
        label = Label(table.default.span)
        title = f"declare the DEFAULT line of table `{table.name}` unreachable"
        change = Change(ChangeKind.UNREACHABLE, str(table.default.name))
        yield Diagnostic(
            Code.DEFAULT_DEAD,
            message,
            label,
            notes=_under(table, unproved),
            help=helps,
            severity=Severity.WARNING,
            proposals=(Proposal(title, str(table.name), "no input falls to it", (change,), helps),),
        )


def _lower(table: Table) -> list[Diagnostic]:
    """Spell out the tests that `above` and `same` come to, line by line."""
    lower = [line for line in table.lines if line.below or line.same]
    if not lower:
        return []
    alike: dict[tuple[tuple[str, ...], tuple[str, ...], str], list[str]] = {}
    for line in lower:
        alike.setdefault((line.below, line.same, table.added(line)), []).append(line.name)
    notes = [
        f"{_before(uppers, same)}, only where {text}: {names_of(names)}"
        for (uppers, same, text), names in list(alike.items())[:MOST_NAMED]
    ]
    if len(alike) > MOST_NAMED:
        notes.append(f"and others: `rcsc fmt --expanded {table.file}` prints the table with what they add")
    many = (
        f"{len(lower)} lines of table `{table.name}` give"
        if len(lower) > 1
        else f"1 line of table `{table.name}` gives"
    )
    return [
        Diagnostic(
            Code.GIVES_WAY,
            f"{many} way to others",
            Label(table.span),
            notes=tuple(notes),
            severity=Severity.NOTE,
        )
    ]


def _before(uppers: Collection[str], same: Collection[str]) -> str:
    said = (("below", uppers), ("the same as", same))
    return ", ".join(f"{word} {names_of(names)}" for word, names in said if names)


def _dead(table: Table, line: int, assuming: bool, under: tuple[str, ...]) -> Diagnostic:
    label = Label(table.lines[line].cell_span(-1))
    name = f"line `{table.lines[line].name}` of table `{table.name}`"
    if not assuming:
        gone = "empty its cell" if table.turned else "delete the line"
        helps = (f"{gone}, or correct its conditions",)
        uppers = (*table.lines[line].below, *table.lines[line].same)
        notes = (
            (f"wherever its cells hold one of these matches, which go before it: {names_of(uppers)}",)
            if uppers
            else ()
        )
        without = Change(ChangeKind.NO_LINE, str(table.lines[line].name))
        without = printed.emptied(table, line) if table.turned else without
        title = f"empty the cell of {name}" if table.turned else f"delete {name}"
        proposal = Proposal(title, str(table.name), "no input matches it", (without,))
        message = f"{name} can never match"
        return Diagnostic(Code.DEAD_LINE, message, label, notes=notes, help=helps, proposals=(proposal,))
    message = f"{name} matches only where an assumption fails"
    return Diagnostic(Code.DEAD_LINE, message, label, notes=under, severity=Severity.WARNING)


def _under(table: Table, unproved: Collection[str]) -> tuple[str, ...]:
    """Name the assumptions that a dead line or a dead DEFAULT may rest on."""
    names = ", ".join(f"`{name}`{' (not proved)' if name in unproved else ''}" for name in table.assumptions)
    return (f"under {names}",) if names else ()


# --- overlaps ------------------------------------------------------------------------


def _overlap(program: Program, partings: Partings, overlap: Overlap, options: Options) -> Diagnostic:
    table = partings.table
    first, second = table.lines[overlap.first], table.lines[overlap.second]
    column = _column(program, table, overlap.witness, (overlap.first, overlap.second), overlap.region)
    repairs = () if options.brief else partings.offered(overlap)
    repair = next(iter(repairs), None)
    effects = _effects(program, table, overlap, options)
    proposals = () if options.brief else _proposals(table, overlap, repairs, effects)
    return Diagnostic(
        Code.OVERLAP,
        f"lines `{first.name}` and `{second.name}` of table `{table.name}` both match some input",
        Label(second.cell_span(-1), "this line"),
        related=(
            Label(first.cell_span(-1), "and this one"),
            *_far(table, (first, second), repair),
        ),
        notes=() if effects is None else (str(effects),),
        help=tuple(proposal.said for proposal in proposals),
        witnesses=(column,),
        effects=effects,
        proposals=proposals,
    )


def _proposals(
    table: Table, overlap: Overlap, repairs: Sequence[PartingCell], effects: Effects | None
) -> tuple[Proposal, ...]:
    """Propose repairs of an overlap: cells that part the lines, or the declaration that they do the same."""
    first, second = table.lines[overlap.first], table.lines[overlap.second]
    proposals = []
    for repair in repairs:
        proved = f"it parts the two lines, and line `{table.lines[repair.other].name}` takes what `{table.lines[repair.line].name}` loses"
        changes = (repair.change(table),)
        title, told = repair.write(table), repair.told(table)
        sure = table.turned is not None or not repair.box
        proposals.append(Proposal(title, str(table.name), proved, changes, told, whole=False, sure=sure))
    if effects is not None and effects.same:
        change: Change | None = Change(ChangeKind.SAME, str(second.name), texts=(str(first.name),))
        title = f"say that line `{second.name}` does the same as `{first.name}`"
        keep = f"or keep both, and say that they do the same: `{second.name} same {first.name}`"
        if table.turned:
            change = printed.same_as(table, overlap.second, overlap.first)
            keep = f"or keep both, and say {printed.where(change)}that they do the same"
        proved = "both do the same wherever both match"
        if change is not None:
            proposals.append(Proposal(title, str(table.name), proved, (change,), (keep,), whole=False))
    return tuple(proposals)


def _far(table: Table, lines: Sequence[Line], repair: PartingCell | None) -> tuple[Label, ...]:
    """Return a label for the cell that the help changes, where it stands far from the names of both lines."""
    if repair is None:
        return ()
    cell = table.lines[repair.line].cell_span(repair.column)
    near = any(0 <= cell.start - line.cell_span(-1).start < FAR for line in lines)
    return () if near else (Label(cell, "the cell of the help"),)


def _effects(program: Program, table: Table, overlap: Overlap, options: Options) -> Effects | None:
    """Compare the effects of two overlapping lines; None where that is left for later."""
    if options.brief:
        smt.leave_open("whether two lines do the same")
        return None
    few = replace(options, steps=min(options.steps, COMPARED_STEPS))
    return alike(program, table, (overlap.first, overlap.second), few, near=overlap.witness)


def _most_overlapping(table: Table, overlaps: Sequence[Overlap]) -> str:
    """Name the lines that overlap with the most others: mending these mends the most."""
    counts = Counter(line for overlap in overlaps for line in (overlap.first, overlap.second))
    most = [
        f"`{table.lines[at].name}` with {many}"
        for at, many in sorted(counts.items(), key=lambda item: (-item[1], item[0]))[:MOST_NAMED]
    ]
    return f"which lines overlap with the most others: {', '.join(most)}"


def _together(partings: Partings, overlaps: Sequence[Overlap]) -> Proposal | None:
    """Propose the repairs of several overlaps together, or tell the errors they would leave; None for fewer than two."""
    program, table = partings.program, partings.table
    first = [next(iter(partings.cells(overlap)), None) for overlap in overlaps]
    chosen = [cell for cell in first if cell is not None and not cell.falls]
    if len(chosen) < 2:
        return None
    title = f"the helps of these {len(chosen)} overlaps together"
    left = left_by(program, table, chosen)
    if left:
        return Proposal(title, str(table.name), "", (), (f"{title}: {left}",))
    changes = changes_of(program, table, chosen)
    if not changes:
        return None
    proved = "no two lines match any more"
    return Proposal(title, str(table.name), proved, changes, (f"{title}: ", f" that {proved}"))


# --- gaps ----------------------------------------------------------------------------


def _gap(program: Program, table: Table, gap: Gap, options: Options) -> Diagnostic:
    columns = tuple(
        replace(_column(program, table, witness, (), region), inputs=inputs)
        for witness, region, inputs in zip(gap.witnesses, gap.regions, _inputs(program, gap), strict=True)
    )
    part = ("how many inputs no line matches was not counted: what the region has is a part of them",)
    uncounted = gap.count is None and gap.regions[0] is not None
    notes = (*_patterns(gap), *_by_member(program, gap), *(part if uncounted else ()))
    allowed = " that the assumptions allow" if gap.sizes else ""
    share = f"{_share(*gap.count)} of the inputs{allowed}" if gap.count else "some inputs"
    if must_cover(table) and table.default is None:
        proposal = None if options.brief else _filling(program, table, gap)
        if options.brief:
            smt.leave_open("a line for a gap")
        message = f"no line of table `{table.name}` matches {share}"
        return Diagnostic(
            Code.GAP,
            message,
            Label(table.span),
            related=tuple(_unsaid(table, gap)),
            notes=notes,
            help=() if proposal is None else (proposal.said,),
            witnesses=columns,
            more=_more(program, gap),
            proposals=() if proposal is None else (proposal,),
        )
    assert table.default is not None
    label = Label(table.default.span)
    if table.default.unreachable:
        message = f"the DEFAULT line of table `{table.name}` is declared unreachable, but {share} fall to it"
        return Diagnostic(
            Code.DEFAULT_REACHED, message, label, notes=notes, witnesses=columns, more=_more(program, gap)
        )
    message = f"{share} fall to the DEFAULT line of table `{table.name}`"
    return Diagnostic(
        Code.DEFAULT_COVERS,
        message,
        label,
        notes=_patterns(gap),
        witnesses=columns,
        more=_more(program, gap),
        severity=Severity.NOTE,
    )


def _unsaid(table: Table, gap: Gap) -> Iterator[Label]:
    """Yield the empty cell of a turned table, or its row, into which each input shown falls."""
    known: set[int] = set()
    for number, witness in enumerate(gap.witnesses):
        here = next((line.cell_span(-1) for line in table.unsaid if printed.meets(line, witness)), None)
        if here is not None and here.start not in known:
            known.add(here.start)
            yield Label(
                here, f"{'this input' if len(gap.witnesses) == 1 else f'input {number + 1}'} falls here"
            )


def _filling(program: Program, table: Table, gap: Gap) -> Proposal | None:
    """Propose what closes a gap, or the part of it around its first input."""
    if table.turned:
        return printed.filling(program, table, gap)
    row = new_line(program, table, gap)
    return None if row is None else _adding(table, row)


def _adding(table: Table, row: NewLine) -> Proposal:
    """Propose a line for a gap; its actions are left to be written."""
    which = "all" if row.closes else "some"
    title = f"add a line to table `{table.name}` for {which} of the inputs that no line matches"
    proved = "it closes the gap" if row.closes else "it closes this part of the gap"
    change = Change(ChangeKind.LINE, texts=row.cells)
    proved += " and overlaps no other line"
    return Proposal(title, str(table.name), proved, (change,), (f"{row.told}: ", ""), row.closes)


def _patterns(gap: Gap) -> tuple[str, ...]:
    """Say how many patterns of the bits that lines look at a gap has."""
    if gap.patterns is None:
        return ()
    return (f"{gap.patterns[0]:,} of {gap.patterns[1]:,} patterns of the bits that lines look at",)


def _more(program: Program, gap: Gap) -> int:
    """Count the gap's inputs outside the regions shown; 0 where they were not counted."""
    if gap.count is None:
        return 0
    return max(0, gap.count[0] - sum(inputs or 1 for inputs in _inputs(program, gap)))


def _inputs(program: Program, gap: Gap) -> list[int | None]:
    """Count the inputs of each region; None where there is none."""
    if gap.sizes:
        return list(gap.sizes)
    kinds: dict[str, Scalar] = program.kinds
    return [
        None if region is None else words.inputs(kinds, region, witness)
        for witness, region in zip(gap.witnesses, gap.regions, strict=True)
    ]


def _box(kinds: Mapping[str, Scalar], region: Region, name: str) -> Box:
    return region.get(name, (key_bounds(kinds[name]),))


def _by_member(program: Program, gap: Gap) -> tuple[str, ...]:
    """Say how a gap of several regions lies over the members of the enumeration that parts it best."""
    counts = _inputs(program, gap)
    if len(counts) < MANY or gap.count is None or _more(program, gap):
        return ()
    kinds: dict[str, Scalar] = program.kinds
    names = [name for name in gap.witnesses[0] if isinstance(kinds[name], Enum)]
    tables = {name: _shares(kinds, name, gap, counts) for name in names}
    if not tables:
        return ()
    best = max(names, key=lambda name: (sum(not inputs for inputs in tables[name]), max(tables[name])))
    kind = kinds[best]
    assert isinstance(kind, Enum)
    whole = gap.count[1] // len(kind.members)
    parts = sorted(zip(tables[best], kind.members, strict=True), key=lambda part: -part[0])
    said = [f"`{member}` {_of(inputs, whole)}" for inputs, member in parts if inputs]
    return (f"by `{best}`: {', '.join(said)}",)


def _shares(kinds: Mapping[str, Scalar], name: str, gap: Gap, counts: Sequence[int | None]) -> list[int]:
    """Count the inputs of a gap for each member of an enumeration; the regions are disjoint."""
    low, high = key_bounds(kinds[name])
    totals = [0] * (high - low + 1)
    for region, inputs in zip(gap.regions, counts, strict=True):
        box = _box(kinds, region or {}, name)
        for key in range(low, high + 1):
            if any(first <= key <= last for first, last in box):
                totals[key - low] += (inputs or 0) // size(box)
    return totals


def _of(inputs: int, whole: int) -> str:
    return "all" if inputs == whole else f"{100 * inputs / whole:.3g} %"


def _share(count: int, total: int) -> str:
    percent = 100 * count / total
    shown = f"{percent:.3g} %" if percent >= 0.001 else "less than 0.001 %"
    return f"{count:,} of {total:,} ({shown})"


# --- witnesses -----------------------------------------------------------------------


def _column(
    program: Program, table: Table, witness: Witness, lines: tuple[int, ...], region: Region | None
) -> WitnessColumn:
    matched = tuple(table.lines[at] for at in lines)
    return replace(
        witness_column(program, table, witness, matched, added=True),
        region=words.region(program.kinds, region),
    )
