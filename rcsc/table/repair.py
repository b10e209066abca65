"""Repairs worth proposing: each is proved before it is shown, or not shown.

In: a finding of a box table. Out: a sentence, or nothing.
"""

from dataclasses import dataclass

from rcsc.lang.interval_sets import complement, meet, size
from rcsc.lang.model import Box, Program, Scalar, Table, key_bounds
from rcsc.table import boxes, cells
from rcsc.table.regions.partition import BudgetError, Gaps
from rcsc.table.verdict import Gap, Overlap


def parting_cell(program: Program, table: Table, overlap: Overlap) -> str | None:
    """The smallest change of one cell that parts the two lines and leaves every input matched.

    Narrowing line A on variable v by what line B has there parts the two. What A loses is then matched by B, if on
    every other variable B has all that A has: that is checked exactly.
    """
    if not boxes.applies(table):
        return None
    best: _Change | None = None
    lines = boxes.lines_of(table)
    kinds: dict[str, Scalar] = {v.name: v.type for v in program.variables}
    for line, other in ((overlap.second, overlap.first), (overlap.first, overlap.second)):
        for name in table.variables:
            change = _narrowed(lines, kinds, table, line, other, name)
            if change is not None and (best is None or change.lost < best.lost):
                best = change
    if best is None:
        return None
    return f"in line `{table.lines[best.line].name}` write `{best.cell}` under `{best.name}`: proved to part the two lines"


@dataclass(frozen=True, slots=True)
class _Change:
    line: int
    name: str
    cell: str
    lost: int


def _narrowed(
    lines: list[dict[str, Box]], kinds: dict[str, Scalar], table: Table, line: int, other: int, name: str
) -> _Change | None:
    column = [c for c in table.columns if c.variable == name]
    if len(column) != 1:
        return None
    mine, theirs = lines[line], lines[other]
    whole = (key_bounds(kinds[name]),)
    for another in table.variables:
        everything = (key_bounds(kinds[another]),)
        if another != name and not _within(mine.get(another, everything), theirs.get(another, everything)):
            return None
    before = mine.get(name, whole)
    left = meet(before, complement(theirs.get(name, whole), *whole[0]))
    cell = cells.cell(kinds[name], left) if left else None
    if not cell or meet(left, theirs.get(name, whole)):
        return None
    return _Change(line, name, cell, size(before) - size(left))


def _within(inner: Box, outer: Box) -> bool:
    return meet(inner, outer) == inner


def closing_line(program: Program, table: Table, gap: Gap) -> str | None:
    """Propose a line for the gap's first region; it overlaps none, and counting tells if it closes the gap."""
    region = gap.regions[0]
    if region is None or not boxes.applies(table):
        return None
    kinds: dict[str, Scalar] = {v.name: v.type for v in program.variables}
    texts = []
    for column in table.columns:
        name = column.variable
        box = region.get(name) if name is not None else None
        cell = "" if box is None or name is None else cells.cell(kinds[name], box)
        if cell is None:
            return None
        texts.append(cell)
    if not set(region) <= {str(c.variable) for c in table.columns} & set(map(str, table.variables)):
        return None  # bounds of what only an assumption reads
    decided = boxes.TableBoxes.of(program, table)
    decided.lines.append(dict(region.items()))
    pairs = list(decided.overlaps())
    if any(len(decided.lines) - 1 in pair for pair in pairs):
        return None
    row = " | ".join(["new", *texts])
    try:
        closes = not Gaps.of(decided, disjoint=not pairs).missing()
    except BudgetError:
        closes = False
    what = "closes the gap" if closes else "closes this part of the gap"
    return f"a line `| {row} || ... |` {what} and overlaps no other: proved"
