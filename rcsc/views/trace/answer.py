"""One question to a matrix, in either direction, answered in lines of text.

In: what somebody points at: a place in a generated file or in the tables, a name in C, a requirement, a line of a table. Out: text;
nothing where nobody knows it.
"""

import re
from collections.abc import Iterable, Iterator, Sequence

from rcsc.code.emit.plan import Origin, Sort
from rcsc.code.emit.rendering import Piece
from rcsc.views.trace.matrix import Declared, Matrix, Tests, TracedLine
from rcsc.views.trace.requirements import places
from rcsc.views.trace.tables_of import ranges

_PLACE = re.compile(r"(?P<file>.+):(?P<line>\d+)$")


def answer(matrices: Sequence[Matrix], asked: str) -> Iterator[str]:
    """Say where it comes from and where it leads."""
    for matrix in matrices:
        yield from dict.fromkeys(_of_code(matrix, asked))
        for line in matrix.lines:
            words = (f"{line.table} line {line.name}", f"{line.table} {line.name}", line.place)
            if asked in words or asked in line.requirements:
                yield from _of_line(matrix, line)
        for one in matrix.declared:
            if asked in (one.name, f"{one.sort} {one.name}", one.place) or asked in one.requirements:
                yield from _of_declared(matrix, one)


def suggestions(matrices: Iterable[Matrix]) -> Iterator[str]:
    """Give the names that can be asked for."""
    for matrix in matrices:
        yield from (f"{line.table} line {line.name}" for line in matrix.lines)
        yield from (one.name for one in matrix.declared)
        yield from (piece.name for piece in matrix.pieces if piece.name)
        yield from places([matrix])


def _of_code(matrix: Matrix, asked: str) -> Iterator[str]:
    place = _PLACE.match(asked)
    for piece in _narrowest(matrix, place["file"], int(place["line"])) if place else ():
        yield from _of_piece(matrix, piece)
    for piece in matrix.pieces:
        if asked == piece.name:
            yield from _of_piece(matrix, piece)


def _narrowest(matrix: Matrix, file: str, line: int) -> Iterator[Piece]:
    """Yield the pieces around a line of a generated file of which there is none narrower."""
    around = [
        piece
        for piece in matrix.pieces
        if (piece.file == file or piece.file.endswith(f"/{file}")) and piece.first <= line <= piece.last
    ]
    least = min((piece.last - piece.first for piece in around), default=0)
    yield from (piece for piece in around if piece.last - piece.first == least)


def _of_piece(matrix: Matrix, piece: Piece) -> Iterator[str]:
    place = matrix.place(piece.origin)
    named = f" ({piece.name})" if piece.name else ""
    yield f"{piece.file}:{piece.first}-{piece.last}{named}: {piece.origin.words}{f', {place}' if place else ''}"
    if piece.origin.sort is Sort.PROCEDURE:
        used = next((one.used for one in matrix.declared if one.name == piece.origin.name), ())
        yield f"  run by {', '.join(used)}"
    if names := matrix.answers(piece.origin):
        yield f"  for {', '.join(names)}"


def _of_line(matrix: Matrix, line: TracedLine) -> Iterator[str]:
    yield f"{line.place}: {line.table} line {line.name}: {'; '.join(line.states)}"
    yield f"  for {', '.join(line.answers) or 'no requirement that it names'}"
    for word, pieces in matrix.code(line):
        code = [ranges(pieces, (end,)) for end in (".c", ".h", ".py")]
        yield f"  {word}: {'; '.join(where for where in code if where) or 'nothing'}"
    tests = line.tests
    shown = f"{tests.shown} of {tests.conditions} conditions shown to decide it"
    yield f"  vectors: {'not looked for' if tests == Tests() else shown}"
    for word, numbers in (("shown by", tests.made), ("taken by", tests.taken)):
        if numbers:
            yield f"    {word} {', '.join(map(str, numbers))}"
    if line.table in matrix.tables:
        proof = matrix.tables[line.table]
        yield f"  {proof.verdict}: {proof.method}"
    yield from (f"  {told}" for told in line.findings)
    yield from (f"  property {name}: {why}" for name, why in line.properties)


def _of_declared(matrix: Matrix, one: Declared) -> Iterator[str]:
    yield f"{one.place}: {one.sort} {one.name}{f': {one.states}' if one.states else ''}"
    if one.requirements:
        yield f"  for {', '.join(one.requirements)}"
    if one.sort in set(Sort):
        pieces = matrix.of(Origin(Sort(one.sort), one.name))
        yield f"  code: {ranges(pieces, ('.c', '.h', '.py')) or 'none of its own'}"
    if one.used:
        yield f"  used by {', '.join(one.used)}"
    if one.proof:
        yield f"  {one.proof}"
