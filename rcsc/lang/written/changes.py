"""Proposals as edits: the text that each makes, laid out as the file was.

In: a text and a proposal. Out: the text with it. Nothing is trusted of what comes out: who offers it checks it first (`workspace`).
"""

import re
from collections.abc import Sequence

from rcsc.base.diagnostics.diagnostic import Change, ChangeKind, Diagnostic, Proposal
from rcsc.base.diagnostics.source import Source
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.rows import Cell, stub_of
from rcsc.lang.written.tables import (
    RowText,
    WrittenPart,
    WrittenTable,
    cells_of,
    dashes,
    fresh_name,
    joined_cells,
    pieces,
    table_of,
    whole_line,
    written_cell,
)

_MEANT = re.compile(r"did you mean `([^`]+)`\?$")
Splice = tuple[int, int, str]
"""Start and end of a part of a text, and what replaces it."""


def with_proposal(source: Source, proposal: Proposal) -> str | None:
    """Return the text with a proposal's changes made; None where they do not fit it."""
    text = source.text
    for change in proposal.changes:
        table = table_of(text, proposal.table)
        splices = None if table is None else _splices(text, table, change)
        if splices is None:
            return None
        text = spliced(text, splices)
    return laid_out(source, text)


def with_spelling(source: Source, diagnostic: Diagnostic) -> tuple[str, str] | None:
    """Return the text with a name spelt as the finding's help proposes, and that name; None where it proposes none."""
    meant = next((found[1] for each in diagnostic.help if (found := _MEANT.search(each))), None)
    span = diagnostic.primary.span
    if meant is None or span.file != source.name or span.start == span.end:
        return None
    return laid_out(source, spliced(source.text, [(span.start, span.end, meant)])), meant


def laid_out(source: Source, text: str) -> str:
    """Return a changed text, laid out if the old text was."""
    end = "\r\n" if "\r\n" in source.text else "\n"
    if formatted(source) != source.text:
        return text
    return formatted(Source(source.name, text), end) or text


def formatted(source: Source, end: str = "") -> str | None:
    """Return a text as `rcsc fmt` lays it out, with its own line ends or those given; None where it does not parse."""
    end = end or ("\r\n" if "\r\n" in source.text else "\n")
    parsed = parse(source)
    if not isinstance(parsed, tree.File):
        return None
    text = format_file(parsed)
    return text if end == "\n" else text.replace("\n", end)


def spliced(text: str, splices: Sequence[Splice]) -> str:
    """Return the text with parts of it, from start to end, replaced."""
    for start, end, new in sorted(splices, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _splices(text: str, table: WrittenTable, change: Change) -> list[Splice] | None:
    if change.place is ChangeKind.LINE:
        if not all(part.lines for part in table.parts):
            return None
        at = max(len(part.lines) for part in table.parts)
        if not table.has_names:
            return new_line(text, table, at, change.texts[0], change.texts[1:])
        return new_line(text, table, at, fresh_name(table.line_names), change.texts)
    if change.place is ChangeKind.COLUMN:
        return _new_column(table, change.texts)
    if change.place is ChangeKind.HEADING:
        found = written_cell(table, -1, change.column)
        return None if found is None else over(text, found[1], change.texts[0], found[0])
    at, rows = _line(table, change.line)
    if not rows:
        return None
    match change.place:
        case ChangeKind.CELL if change.column < 0:
            every = [part.lines[at] for part in table.parts if at < len(part.lines)]
            firsts = (over(text, joined_cells(rows).conditions[0], change.texts[0], rows) for rows in every)
            return [splice for each in firsts for splice in each]
        case ChangeKind.CELL:
            found = written_cell(table, at, change.column)
            return None if found is None else over(text, found[1], change.texts[0], found[0])
        case ChangeKind.SAME:
            stub = joined_cells(rows).conditions[0]
            same = [cell.text for cell in stub_of(stub).same]
            word = f"{stub.text}, {change.texts[0]}" if same and stub.text.endswith(same[-1]) else ""
            return over(text, stub, word or f"{stub.text} same {', '.join(change.texts)}", rows)
        case ChangeKind.UNREACHABLE:
            return over(
                text, joined_cells(rows).conditions[int(table.has_names)], "DEFAULT unreachable", rows
            )
        case _:
            gone = [row for part in table.parts for row in part.lines[at]]
            return [(*whole_line(text, row), "") for row in gone]


def _line(table: WrittenTable, name: str) -> tuple[int, tuple[RowText, ...]]:
    """Return the position of a line, and its rows in the first part; no rows where there is no such line."""
    at = table.line_names.index(name) if name in table.line_names else -1
    return (0, ()) if at < 0 else (at, table.parts[0].lines[at])


def _new_column(table: WrittenTable, texts: Sequence[str]) -> list[Splice] | None:
    """Write a column after the last one: its heading, then its cell in each line, but for a DEFAULT row that has one cell for all."""
    part = table.parts[-1]
    firsts = {rows[0].start: text for rows, text in zip((part.heading, *part.lines), texts, strict=False)}
    splices: list[Splice] = []
    for row in table.rows_of(part):
        if dashes(row):
            past = len(row.partition("#")[0].rstrip())
            splices.append((row.start + past, row.start + past, "---|"))
            continue
        cells = cells_of(row)
        if table.once(cells):
            continue
        if not cells.actions:
            return None
        last = cells.actions[-1]
        bar = row.find("|", last.start + len(last.text) - row.start)
        if bar < 0:
            return None
        splices.append((row.start + bar + 1, row.start + bar + 1, f" {firsts.get(row.start, '')} |"))
    return splices


def over(text: str, cell: Cell, new: str, rows: Sequence[RowText]) -> list[Splice]:
    """Write a cell into the first of its rows, and leave out rows that have nothing else, a comment neither."""
    first, *more = pieces(cell)
    splices: list[Splice] = [(*first, new if first[0] != first[1] else f" {new} ")]
    for start, end in more:
        row = next(row for row in rows if row.start <= start < row.past)
        alone = not any(each.text for each in cells_of(row).all if each.start != start)
        splices.append((*whole_line(text, row), "") if alone and "#" not in row else (start, end, ""))
    return splices


def new_line(text: str, table: WrittenTable, at: int, stub: str, cells: Sequence[str]) -> list[Splice]:
    """Write a line before a position, in each part of the table.

    Args:
        text: Of the file.
        table: That gets the line.
        at: From 0; the number of lines for the last.
        stub: The line's name, and its marks: those are written in the first part.
        cells: Conditions of all parts first, then actions; those that are missing are empty.
    """
    headings = [joined_cells(part.heading) for part in table.parts]
    column, action = 0, sum(len(heading.conditions) - 1 for heading in headings)
    every = (*cells, *("",) * (action + sum(len(heading.actions) for heading in headings) - len(cells)))
    splices = []
    for part, heading in zip(table.parts, headings, strict=True):
        past, done = column + len(heading.conditions) - 1, action + len(heading.actions)
        row = row_text((stub, *every[column:past]), every[action:done])
        splices.append(_inserted(text, table, part, at, row))
        column, action, stub = past, done, stub_of(Cell(stub, "", 0)).name.text
    return splices


def _inserted(text: str, table: WrittenTable, part: WrittenPart, at: int, row: str) -> Splice:
    """Return the splice that writes a row before the line at a position of a part."""
    end = "\r\n" if "\r\n" in text else "\n"
    if at < len(part.lines):
        start, _ = whole_line(text, part.lines[at][0])
        return start, start, f"{text[start : part.lines[at][0].start]}{row}{end}"
    last = table.rows_of(part)[-1]
    indent = text[whole_line(text, last)[0] : last.start]
    heading = joined_cells(part.heading)
    dashed = row_text(["---"] * len(heading.conditions), ["---"] * len(heading.actions), "")
    more = "" if part.lines or dashes(last) else f"{end}{indent}{dashed}"
    return last.past, last.past, f"{more}{end}{indent}{row}"


def row_text(conditions: Sequence[str], actions: Sequence[str], blank: str = " ") -> str:
    """Return a row of cells, the first of which is the line's name."""
    left = "|".join(f"{blank}{cell}{blank}" for cell in conditions)
    right = "".join(f"{blank}{cell}{blank}|" for cell in actions)
    return f"|{left}||{right}"
