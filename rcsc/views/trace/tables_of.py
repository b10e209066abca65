"""A matrix as CSV and as JSON, in both directions: from lines to code, tests and proofs, and from code to lines."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from rcsc import __version__
from rcsc.base.host.files import csv_text
from rcsc.base.host.files.plain import plain
from rcsc.code.emit.rendering import Piece
from rcsc.views.trace.matrix import Matrix, TracedLine
from rcsc.views.trace.requirements import standings

FORM = 3
"""Version of the JSON form; it rises when a member changes its meaning or goes away."""
FORWARD = (
    "program", "table", "line", "place", "requirements", "of the table", "conditions", "actions", "C runs", "C matches",
    "C calls", "Python runs", "Python matches", "Python calls", "vectors made", "vectors taken", "conditions shown",
    "not shown", "exactly one", "rests on", "findings", "properties",
)  # fmt: skip
BACKWARD = ("file", "first", "last", "name", "sort", "comes from", "place", "requirements")


def ranges(pieces: Iterable[Piece], ends: tuple[str, ...]) -> str:
    """Spell the places of pieces in files with these endings: `c/task.c:640-648`."""
    chosen = spots(piece for piece in pieces if piece.file.endswith(ends))
    return "; ".join(f"{file}:{first}-{last}" for file, runs in chosen for first, last in runs)


def spots(pieces: Iterable[Piece]) -> Iterator[tuple[str, list[tuple[int, int]]]]:
    """Give the lines of each file that pieces cover: first and last, those that touch or overlap joined."""
    by_file: dict[str, list[tuple[int, int]]] = {}
    for piece in sorted(pieces, key=lambda piece: (piece.file, piece.first)):
        runs = by_file.setdefault(piece.file, [])
        if runs and piece.first <= runs[-1][1] + 2:  # at most a blank line between
            runs[-1] = runs[-1][0], max(runs[-1][1], piece.last)
        else:
            runs.append((piece.first, piece.last))
    yield from by_file.items()


def lines_csv(matrices: Iterable[Matrix]) -> str:
    """Return one row for each line of each table."""
    rows: list[Sequence[object]] = [FORWARD]
    rows += [_forward(matrix, line) for matrix in matrices for line in matrix.lines]
    return csv_text(rows)


def _forward(matrix: Matrix, line: TracedLine) -> list[object]:
    code = matrix.code(line)
    proof, tests = matrix.tables.get(line.table), line.tests
    return [
        matrix.program, line.table, line.name, line.place, "; ".join(line.requirements), "; ".join(line.inherited),
        "; ".join(line.states), "; ".join(line.does),
        *(ranges(pieces, (".c",)) for _, pieces in code), *(ranges(pieces, (".py",)) for _, pieces in code),
        " ".join(map(str, tests.made)), " ".join(map(str, tests.taken)), f"{tests.shown} of {tests.conditions}",
        "; ".join(tests.unshown), f"{proof.verdict}: {proof.method}" if proof else "",
        "; ".join(f"{name}: {was}" for name, was in proof.rests) if proof else "",
        "; ".join(line.findings), "; ".join(f"{name}: {why}" for name, why in line.properties),
    ]  # fmt: skip


def code_csv(matrices: Iterable[Matrix]) -> str:
    """Return one row for each piece of each generated file; a file that several programs share once."""
    rows = dict.fromkeys(_backward(matrix, piece) for matrix in matrices for piece in matrix.pieces)
    return csv_text([BACKWARD, *rows])


def _backward(matrix: Matrix, piece: Piece) -> tuple[object, ...]:
    origin = piece.origin
    return (
        piece.file, piece.first, piece.last, piece.name, origin.sort.value, origin.words, matrix.place(origin),
        "; ".join(matrix.answers(origin)),
    )  # fmt: skip


def requirements_csv(matrices: Sequence[Matrix], wanted: Sequence[str]) -> str:
    """Return one row for each requirement and place; a listed one that nothing names stands alone."""
    known = standings(matrices)
    rows: list[Sequence[object]] = [("requirement", "place", "verdict", "tests", "coverage")]
    for name in dict.fromkeys((*wanted, *known)):
        rows += [(name, one.place, one.verdict, one.tests, one.coverage) for one in known.get(name, ())]
        rows += [] if name in known else [(name, "", "", "", "")]
    return csv_text(rows)


# --- JSON ------------------------------------------------------------------------------------


def to_json(matrices: Sequence[Matrix], wanted: Sequence[str], *, vectors: bool) -> dict[str, Any]:
    """Return all of it as a JSON value, which says whether vectors were made."""
    return {
        "form": FORM,
        "tool": {"name": "rcsc", "version": __version__},
        "command": "trace",
        "listed": list(wanted),
        "vectors": vectors,
        "requirements": {name: [plain(one) for one in where] for name, where in standings(matrices).items()},
        "programs": [_program(matrix) for matrix in matrices],
    }


def _program(matrix: Matrix) -> dict[str, Any]:
    return {
        "program": matrix.program,
        "source": matrix.source,
        "digest": matrix.digest,
        "files": dict(matrix.files),
        "tables": [
            {
                "table": name,
                "requirements": list(matrix.requirements.get(name, ())),
                "verdict": proof.verdict,
                "method": proof.method,
                "rests": dict(proof.rests),
            }
            for name, proof in matrix.tables.items()
        ],
        "lines": [dict(_line(matrix, line)) for line in matrix.lines],
        "declared": [plain(one) for one in matrix.declared],
        "code": [dict(_piece(matrix, piece)) for piece in matrix.pieces],
        "untraced": list(matrix.untraced),
    }


def _line(matrix: Matrix, line: TracedLine) -> Iterator[tuple[str, object]]:
    yield from (("table", line.table), ("line", line.name), ("place", line.place))
    yield "requirements", list(line.requirements)
    yield "requirements_of_table", list(line.inherited)
    yield "conditions", list(line.states)
    yield "actions", list(line.does)
    yield "procedures", list(line.procedures)
    yield "code", {word: [_where(piece) for piece in pieces] for word, pieces in matrix.code(line)}
    tests = line.tests
    yield (
        "vectors",
        {
            "made": list(tests.made),
            "taken": list(tests.taken),
            "conditions": tests.conditions,
            "shown": tests.shown,
            "not_shown": list(tests.unshown),
        },
    )
    yield "findings", list(line.findings)
    yield "properties", dict(line.properties)


def _where(piece: Piece) -> dict[str, object]:
    return {"file": piece.file, "first": piece.first, "last": piece.last, "name": piece.name}


def _piece(matrix: Matrix, piece: Piece) -> Iterator[tuple[str, object]]:
    yield from _where(piece).items()
    yield "sort", piece.origin.sort.value
    yield "of", piece.origin.name
    if piece.origin.line:
        yield "line", piece.origin.line
    if place := matrix.place(piece.origin):
        yield "place", place
    yield "requirements", list(matrix.answers(piece.origin))
