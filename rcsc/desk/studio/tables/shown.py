"""Open files, their tables and what is wrong with them, as pages draw them.

In: a document and what is known of it. Out: JSON. Columns count as pages count letters: units of UTF-16.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from rcsc.desk.editor.grid import grids
from rcsc.desk.editor.names.about import share_text
from rcsc.desk.editor.places import Area, Lines, Units
from rcsc.desk.editor.values import BEING_PROVED, Answer, Finding, Grid, GridRow, Repair, Witness
from rcsc.desk.studio.tables.document import Document
from rcsc.lang.interpret import evaluate, holds
from rcsc.lang.model import Program, Snapshot, Table, spell, value_of_text
from rcsc.views.graph.chart import Sheet, SheetBox

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class TextFindings:
    """What was found out about a text.

    Attributes:
        version: Of the document that has it.
        program: What it resolves to, or what is left of it.
        seconds: How long it took.
        files: The real paths of all that was read for it.
    """

    version: int
    answer: Answer
    program: Program | None
    seconds: float
    files: frozenset[str]


def document(name: str, open_file: Document, known: TextFindings | None) -> Json:
    """Return an open file: its text, its tables, and what is known of them; of a text that nobody has looked at what stands there alone."""
    lines = Lines(open_file.text)
    sure = known is not None and known.version == open_file.version
    shown: Json = {
        "file": name,
        "version": open_file.version,
        "text": open_file.text,
        "dirty": open_file.dirty,
        "undo": open_file.undoes,
        "redo": open_file.redoes,
        "known": sure,
    }
    if known is None or not sure:
        tables = grids(open_file.file, lines, None, lambda _: BEING_PROVED)
        return shown | {"tables": [_table(each) for each in tables], "findings": [], "whole": None}
    answer = known.answer
    return shown | {
        "tables": [_table(each) for each in answer.tables],
        "findings": [
            _finding(open_file.file, lines, at, each, known) for at, each in enumerate(answer.findings)
        ],
        "whole": answer.whole,
        "ms": round(known.seconds * 1000, 1),
    }


def _table(grid: Grid) -> Json:
    return {
        "name": grid.name,
        "first": grid.first,
        "line": grid.area.start.line,
        "standing": {"state": grid.standing.state.value, "why": grid.standing.why},
        "columns": [
            {"heading": each.heading, "kind": each.kind, "type": each.type, "unit": each.unit}
            for each in grid.columns
        ],
        "rows": [_row(each) for each in grid.rows],
    }


def _row(row: GridRow) -> Json:
    return {
        "name": row.name,
        "stub": row.stub.text,
        "cells": [cell.text for cell in row.cells],
        "lines": row.lines,
        "default": row.default,
        "share": None if row.share is None else _share(*row.share),
        "line": row.area.start.line,
        "past": row.area.end.line,
    }


def _share(count: int, whole: int) -> Json:
    """Return a share in words; more inputs than a number of JavaScript tells apart are counted to the last one."""
    return {"text": share_text(count, whole), "of": f"{count:,} of {_inputs(whole)}"}


def _inputs(count: int) -> str:
    return "1 input" if count == 1 else f"{count:,} inputs"


def _place(area: Area, lines: Lines) -> list[list[int]]:
    places = (lines.shifted(place, Units.UTF_16) for place in (area.start, area.end))
    return [[place.line, place.column] for place in places]


def _finding(file: str, lines: Lines, number: int, found: Finding, known: TextFindings) -> Json:
    here = found.area.file == file
    table = next((each for each in known.answer.tables if each.name == found.table), None) if here else None
    line, column = _cell(table, found.area) if table is not None else (None, None)
    concerned = {name.name for witness in found.witnesses for name in witness.lines} | (
        {line} if line else set()
    )
    return {
        "id": number,
        "code": found.code,
        "severity": found.severity,
        "message": found.message,
        "notes": found.notes,
        "help": found.help,
        "file": "" if here else found.area.file,
        "area": _place(found.area, lines) if here else None,
        "table": found.table if here else "",
        "line": line,
        "column": column,
        "lines": sorted(concerned),
        "meanwhile": found.meanwhile,
        "mendable": found.mendable,
        "more": found.more,
        "witnesses": [_witness(each, known.program, table) for each in found.witnesses],
    }


def _cell(table: Grid, area: Area) -> tuple[str | None, int | None]:
    """Return the line and the column in which a finding begins; -1 is the column of names."""
    for row in table.rows:
        for at, cell in enumerate((row.stub, *row.cells), start=-1):
            if any(piece.start <= area.start < piece.end for piece in cell.areas):
                whole = at < 0 and area.end > cell.areas[-1].end
                return row.name, None if whole else at
        if row.area.start <= area.start <= row.area.end:
            return row.name, None
    return None, None


def _witness(witness: Witness, program: Program | None, table: Grid | None) -> Json:
    shown: Json = {
        "values": witness.values,
        "lines": [line.name for line in witness.lines],
        "region": witness.region,
        "inputs": None if witness.inputs is None else _inputs(witness.inputs),
        "columns": [],
        "regions": [],
        "rows": {},
    }
    meant = (
        next((each for each in program.tables if each.name == witness.table), None)
        if program is not None
        else None
    )
    if program is None or meant is None or table is None or table.name != witness.table:
        return shown
    snapshot = _snapshot(program, witness)
    headings = [each.heading for each in table.columns if each.kind == "condition"]
    begins = int(table.first != "line")  # the first column of conditions stands in that of names
    asked = range(begins, begins + len(headings))
    rows = dict(_rows(meant, snapshot))
    return shown | {
        "columns": [_tried(partial(_value, meant, at, snapshot)) or "" for at in asked],
        "regions": [
            next((each for each in witness.region if each.startswith(f"{one} ")), "") for one in headings
        ],
        "rows": {row.name: _of_row([rows[name] for name in row.lines]) for row in table.rows}
        if meant.turned
        else rows,
    }


def _of_row(lines: Sequence[Json]) -> Json:
    """Return what is said of a row of a turned table: that one of its lines matches, or that none does."""
    holds_ = [line["holds"] for line in lines]
    return {"holds": True if True in holds_ else None if None in holds_ else False, "failed": []}


def _snapshot(program: Program, witness: Witness) -> Snapshot:
    kinds = {str(each.name): each.type for each in program.variables}
    read = {name: value_of_text(kinds[name], text) for name, text in witness.values if name in kinds}
    return {name: value for name, value in read.items() if value is not None}


def _value(table: Table, column: int, snapshot: Snapshot) -> str:
    """Return the witness's value under a heading."""
    subject = table.columns[column].subject
    return "" if subject is None else spell(subject.type, evaluate(subject, snapshot))


def _rows(table: Table, snapshot: Snapshot) -> Iterator[tuple[str, Json]]:
    """Yield for each line whether the witness matches it, and the columns that keep it from it; None where that cannot be told."""
    matched = list[bool | None]()
    for line in table.lines:
        tests = [None if test is None else _tried(partial(holds, test, snapshot)) for test in line.tests]
        stated = [each for test, each in zip(line.tests, tests, strict=True) if test is not None]
        holds_all = False if False in stated else None if None in stated else True
        matched.append(holds_all)
        failed = [at for at, each in enumerate(tests) if each is False and table.columns[at].written]
        yield str(line.name), {"holds": holds_all, "failed": failed}
    if table.default is not None:
        none = False if True in matched else None if None in matched else True
        yield str(table.default.name), {"holds": none, "failed": []}


def _tried(ask: Callable[[], Any]) -> Any:
    """Return an answer; None where the witness lacks a value for it."""
    try:
        return ask()
    except (KeyError, ArithmeticError, IndexError, ValueError):
        return None


def repair(number: int, offered: Repair) -> Json:
    """Return a repair, as a button with its effect and its proof."""
    return {
        "id": number,
        "title": offered.title,
        "proved": offered.proved,
        "clears": offered.clears,
        "certain": offered.certain,
    }


# --- graphs ------------------------------------------------------------------------------


def sheet(placed: Sheet) -> Json:
    """Return a placed graph."""
    return {
        "width": placed.width_px,
        "height": placed.height_px,
        "boxes": [_box(each) for each in placed.boxes],
        "frames": [
            _box(frame) | {"heading": _box(heading)}
            for frame, heading in zip(placed.frames, placed.headings, strict=True)
        ],
        "arrows": [
            {
                "source": each.source,
                "target": each.target,
                "dashed": each.dashed,
                "curves": each.curves,
                "tip": each.tip,
                "label": None if each.label is None else _box(each.label),
            }
            for each in placed.arrows
        ],
    }


def _box(box: SheetBox) -> Json:
    return {
        "name": box.name,
        "kind": box.kind,
        "states": box.states,
        "corner": box.corner,
        "size": (box.width_px, box.height_px),
        "rows": [asdict(row) | {"badge_px": row.badge_px, "height_px": row.height_px} for row in box.rows],
    }
