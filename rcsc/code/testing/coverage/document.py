"""Vectors and sessions as JSON and CSV, for users who test their own build: nothing of rcsc is needed to use them.

In: vectors. Out: text. Values are in the words of the tables (members by name, truths, numbers); a value that no member
has is a number, and a real that is no number is `nan`, `inf` or `-inf`, as text. Reals have the shortest form that reads
back to the same double.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rcsc.base.host.files import csv_text
from rcsc.code.testing.coverage.candidates import Session
from rcsc.code.testing.coverage.case import Case, Expected, function_of
from rcsc.code.testing.coverage.choose import Kept, TakenLine, taken
from rcsc.code.testing.coverage.directed import Unreached
from rcsc.code.testing.coverage.matters import Unnoticed
from rcsc.code.testing.executors.reference_file import all_lines
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.inputs.vectors import Vectors
from rcsc.lang.interpret import Fault, initial
from rcsc.lang.model import Bool, Enum, Kind, Program, Real, Snapshot, Value

FORMAT = 2
"""Of the documents; a reader refuses a greater one."""
TABLE_COLUMNS = ("line", "column", "condition", "purpose", "expected")


@dataclass(frozen=True, slots=True, eq=False)
class VectorSet:
    """All vectors of one program.

    Attributes:
        tables: MC/DC of each table's own conditions, in pairs.
        kept: Vectors of the whole C.
        unreached: What none of them reaches.
        sessions: What was drawn on the way.
        ways: How much else could stand somewhere in the procedures (`matters`).
        unnoticed: What of that none of them notices: it changes nothing, or was not found to.
    """

    program: Program
    symbols: Symbols
    tables: tuple[Vectors, ...]
    kept: tuple[Kept, ...]
    unreached: tuple[Unreached, ...]
    sessions: tuple[Session, ...]
    ways: int = 0
    unnoticed: tuple[Unnoticed, ...] = ()


def plain(program: Program, name: str, value: Value) -> object:
    """A value as a document has it."""
    kind = program.variable(name).type
    if isinstance(kind, Real):
        return float(value) if math.isfinite(value) else str(float(value))
    if isinstance(kind, Bool):
        return bool(value) if value in (0, 1) else int(value)
    if isinstance(kind, Enum) and 0 <= value < len(kind.members):
        return kind.members[int(value)]
    return int(value)


def _values(program: Program, snapshot: Snapshot) -> dict[str, object]:
    return {str(v.name): plain(program, v.name, snapshot[v.name]) for v in program.variables}


def _changes(program: Program, before: Snapshot, after: Snapshot) -> dict[str, object]:
    old, new = _values(program, before), _values(program, after)
    return {name: value for name, value in new.items() if value != old[name]}


def _line(program: Program, case: Case, right: Expected) -> str:
    """The line that runs or matches, by name; empty for none."""
    at = right.result if case.entry.kind in ("line", "lines") else right.line
    if at < 0 or case.entry.kind not in ("line", "lines", "step"):
        return ""
    return all_lines(program.table(case.entry.name))[at][0]


def expected_of(program: Program, case: Case, right: Expected) -> dict[str, object]:
    """What must come out, as a document has it."""
    trace: dict[str, object] = {}
    if case.entry.kind in ("step", "cycle"):
        trace = {
            "fault": Fault(right.result).name.lower(),
            "fault_at": right.fault_at,
            "line": right.line,
            "assumptions_failed": list(right.failed),
        }
    after = {} if right.after is None else {"changes": _changes(program, case.before, right.after)}
    named = {"line_name": name} if (name := _line(program, case, right)) else {}
    return {"result": right.result, **trace, **named, **after}


def _answers(program: Program, case: Case) -> list[dict[str, Any]]:
    """What extern procedures give, in the order of their calls."""
    writes = {str(procedure.name): procedure.writes for procedure in program.procedures}
    return [
        {
            "procedure": answer.procedure,
            "values": {
                str(name): plain(program, name, value)
                for name, value in zip(writes[answer.procedure], answer.values, strict=True)
            },
        }
        for answer in case.answers
    ]


def _case(document: VectorSet, case: Case, right: Expected, lines: Sequence[TakenLine]) -> dict[str, object]:
    program = document.program
    values = _values(program, case.before)
    inputs = {str(v.name) for v in program.variables if v.kind is Kind.INPUT}
    answers = _answers(program, case)
    return {
        "function": function_of(document.symbols, case.entry),
        "kind": case.entry.kind,
        "of": case.entry.name,
        "origin": case.origin,
        **({"foreign": True} if case.foreign else {}),
        **({"mode": case.mode} if case.mode else {}),
        **({"shows": shown} if (shown := list(_shows(document, case))) else {}),
        **({"takes": [f"{table} line {line}" for table, line in lines]} if lines else {}),
        "inputs": {name: value for name, value in values.items() if name in inputs},
        "state": {name: value for name, value in values.items() if name not in inputs},
        **({"answers": answers} if answers else {}),
        "expected": expected_of(program, case, right),
    }


def _shows(document: VectorSet, case: Case) -> Iterator[dict[str, str]]:
    """What a case shows of its table's conditions."""
    vectors = next((part.vectors for part in document.tables if part.table == case.entry.name), ())
    for at in case.shows:
        yield {name: getattr(vectors[at - 1], name) for name in ("line", "column", "condition", "purpose")}


def vectors_document(document: VectorSet) -> dict[str, object]:
    """The vectors of one program, what none of them reaches, and the pairs of its tables."""
    program = document.program
    return {
        "program": program.name,
        "format": FORMAT,
        "initial": _values(program, initial(program)),
        "vectors": [
            {"number": number, **_case(document, kept.case, kept.expected, lines)}
            for number, (kept, lines) in enumerate(
                zip(document.kept, taken(program, document.kept), strict=True), 1
            )
        ],
        "unreached": [
            {name: getattr(each, name) for name in ("where", "what", "wanted", "shown", "reason")}
            for each in document.unreached
        ],
        "unnoticed": [
            {"where": str(each.where), "what": each.what, "instead": each.instead}
            for each in document.unnoticed
        ],
        "tables": [_table(document, part) for part in document.tables],
    }


def _table(document: VectorSet, part: Vectors) -> dict[str, object]:
    numbers = {
        at: number
        for number, kept in enumerate(document.kept, 1)
        if kept.case.entry.name == part.table
        for at in kept.case.shows
    }
    return {
        "table": part.table,
        "conditions": part.conditions,
        "shown": part.shown,
        "vectors": [
            {"number": numbers.get(at)}
            | {name: getattr(vector, name) for name in TABLE_COLUMNS}
            | {"inputs": _values(document.program, vector.snapshot)}
            for at, vector in enumerate(part.vectors, 1)
        ],
        "unshown": [
            {name: getattr(unshown, name) for name in ("line", "column", "condition", "reason")}
            for unshown in part.unshown
        ],
    }


def sessions_document(document: VectorSet) -> dict[str, object]:
    """The drawn sessions of one program: a start, and for each cycle the inputs that change and what must come out."""
    return {
        "program": document.program.name,
        "format": FORMAT,
        "initial": _values(document.program, initial(document.program)),
        "sessions": [_session(document, session) for session in document.sessions],
    }


def _session(document: VectorSet, session: Session) -> dict[str, object]:
    program = document.program
    cycles = []
    state: Snapshot = session.cases[0].before if session.cases else {}
    for case, right in zip(session.cases, session.expected, strict=True):
        answers = _answers(program, case)
        cycles.append(
            {
                "inputs": _changes(program, state, case.before),
                **({"answers": answers} if answers else {}),
                "expected": expected_of(program, case, right),
            }
        )
        state = right.after or case.before
    return {
        "function": function_of(document.symbols, session.entry),
        "start": _values(program, session.cases[0].before) if session.cases else {},
        "cycles": cycles,
    }


def as_json(documents: Sequence[Mapping[str, object]]) -> str:
    """One document, or a list of several."""
    return json.dumps(documents[0] if len(documents) == 1 else list(documents), indent=1) + "\n"


CSV_COLUMNS = ("function", "origin", "result", "fault", "fault_at", "line", "assumptions_failed")


def vectors_csv(document: VectorSet) -> str:
    """The vectors as a table: a row each, a column for each leaf before, and after as `after LEAF`."""
    rows = (([number], kept.case, kept.expected) for number, kept in enumerate(document.kept, 1))
    return _csv(document, ("vector",), rows)


def sessions_csv(document: VectorSet) -> str:
    """The sessions as a table: a row for each cycle."""
    rows = (
        ([number, cycle], case, right)
        for number, session in enumerate(document.sessions, 1)
        for cycle, (case, right) in enumerate(zip(session.cases, session.expected, strict=True), 1)
    )
    return _csv(document, ("session", "cycle"), rows)


def _csv(
    document: VectorSet, numbers: tuple[str, ...], rows: Iterable[tuple[list[int], Case, Expected]]
) -> str:
    program = document.program
    names = [str(v.name) for v in program.variables]
    lines: list[list[object]] = [
        [*numbers, *CSV_COLUMNS, "foreign", "mode", "answers", *names, *(f"after {name}" for name in names)]
    ]
    for number, case, right in rows:
        told = expected_of(program, case, right)
        given = [value for answer in _answers(program, case) for value in answer["values"].values()]
        answers = " ".join(str(_word(value)) for value in given)
        lines.append(
            [
                *number,
                function_of(document.symbols, case.entry),
                case.origin,
                right.result,
                told.get("fault", ""),
                right.fault_at,
                right.line,
                " ".join(right.failed),
                int(case.foreign),
                case.mode,
                answers,
                *map(_word, _values(program, case.before).values()),
                *map(_word, _values(program, right.after or case.before).values()),
            ]
        )
    return csv_text(lines)


def _word(value: object) -> object:
    return str(value).lower() if isinstance(value, bool) else value
