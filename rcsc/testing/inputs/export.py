"""Test vectors as JSON and CSV, for users who test their own build.

In: vectors. Out: text. Values are in the table's words (members by name); doubles in Python's shortest form
that reads back to the same double.
"""

import json
from collections.abc import Sequence

from rcsc.host.files import csv_text
from rcsc.lang.model import Program, Real, Snapshot, Value
from rcsc.testing.executors.sessions import spelled
from rcsc.testing.inputs.vectors import Vectors

COLUMNS = ("table", "line", "column", "condition", "purpose", "expected")


def _plain(program: Program, name: str, value: Value) -> object:
    kind = program.variable(name).type
    if isinstance(value, bool):
        return value
    return (
        float(value)
        if isinstance(kind, Real)
        else spelled(program, name, value)
        if _named(program, name)
        else value
    )


def _named(program: Program, name: str) -> bool:
    return hasattr(program.variable(name).type, "members")


def _values(program: Program, snapshot: Snapshot) -> dict[str, object]:
    return {str(v.name): _plain(program, v.name, snapshot[v.name]) for v in program.variables}


def vectors_json(program: Program, parts: Sequence[Vectors]) -> str:
    """The vectors and what has none, as JSON."""
    document = {
        "program": program.name,
        "tables": [
            {
                "table": part.table,
                "conditions": part.conditions,
                "shown": part.shown,
                "vectors": [
                    {name: getattr(vector, name) for name in COLUMNS[1:]}
                    | {"inputs": _values(program, vector.snapshot)}
                    for vector in part.vectors
                ],
                "unshown": [
                    {name: getattr(unshown, name) for name in ("line", "column", "condition", "reason")}
                    for unshown in part.unshown
                ],
            }
            for part in parts
        ],
    }
    return json.dumps(document, indent=1) + "\n"


def vectors_csv(program: Program, parts: Sequence[Vectors]) -> str:
    """The vectors as CSV: one row a vector, one column a leaf."""
    rows: list[list[object]] = [[*COLUMNS, *(v.name for v in program.variables)]]
    for part in parts:
        for vector in part.vectors:
            values = _values(program, vector.snapshot).values()
            words = [str(value).lower() if isinstance(value, bool) else value for value in values]
            rows.append([*(getattr(vector, name) for name in COLUMNS), *words])
    return csv_text(rows)
