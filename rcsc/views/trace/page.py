"""A matrix as a page, whose places lead to the page of texts.

In: matrices. Out: HTML.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from html import escape
from itertools import groupby

from rcsc.code.emit.plan import Origin, Sort
from rcsc.code.emit.rendering import Piece
from rcsc.views.pages.documents import framed, led, listing, row, tabled
from rcsc.views.pages.frame import quoted
from rcsc.views.trace.matrix import Declared, Matrix, TracedLine
from rcsc.views.trace.requirements import Standing, standings, stated
from rcsc.views.trace.tables_of import spots

_ABOUT = (
    "From requirements and lines of tables to generated code, tests and proofs, and back. Places of code are lines of a file, first "
    "and last. Vectors have the numbers of the file that <code>rcsc test --vectors</code> writes: those that show a condition of the line "
    "to decide it, and those that take the line. Vectors are made of the tables: they test that the code does what the tables say. That "
    "the tables say what is required is another matter: for a requirement of a property its verdict says so, of every run; tests of "
    "requirements are scripts of orders (<code>rcsc run</code>) and watched episodes (<code>rcsc campaign</code>), which are kept apart."
)
NONE, NOT_MADE = '<span class="soft">none</span>', '<span class="soft">not made</span>'


def page(matrices: Sequence[Matrix], listed: Sequence[str]) -> str:
    """Return the page: requirements, then each program forward by lines and backward by code."""
    links = (f'<a href="#{escape(one.program)}">{escape(one.program)}</a>' for one in matrices)
    body = [
        "<h1>Traceability</h1>",
        f"<p>{_ABOUT}</p>",
        f"<nav>{''.join(links)}</nav>",
        *_requirements(standings(matrices), listed, stated(matrices)),
        *(part for one in matrices for part in _program(one)),
    ]
    return framed("Traceability", body)


def _led(matrix: Matrix, path: str, line: int | str, shown: str) -> str:
    """Return what is shown of a place, as a link to its line where its text is there."""
    if path not in matrix.texts:
        return shown
    return led(path, line, shown)


def _requirements(
    known: Mapping[str, Sequence[Standing]], listed: Sequence[str], own: Collection[str]
) -> Iterator[str]:
    yield "<h2>Requirements</h2>"
    names = dict.fromkeys((*listed, *known))
    if not names:
        yield "<p>None is declared, and no line names one: a column <code>req</code> of a table does.</p>"
        return
    if listed:
        yield f"<p>{sum(name in known for name in listed)} of {len(listed)} in the list have a place.</p>"
    rows = []
    for name in names:
        note = (
            ' <span class="bad">not in the list</span>'
            if listed and name not in listed and name not in own
            else ""
        )
        head = f'<span class="for">{escape(name)}</span>{note}'
        if name not in known:
            rows.append(row(head, '<span class="bad">nothing is for it</span>', NONE, NONE, NONE))
        for at, one in enumerate(known.get(name, ())):
            verdict = (
                f'<span class="bad">{quoted(one.verdict)}</span>'
                if one.refuted or one.open
                else quoted(one.verdict)
            )
            tests, shown = escape(one.tests) or NOT_MADE, escape(one.coverage) or NOT_MADE
            rows.append(
                row(
                    f'<span class="soft">{escape(name)}</span>' if at else head,
                    escape(one.place),
                    verdict,
                    tests,
                    shown,
                )
            )
    yield tabled({"requirement": 18, "named by": 26, "verdict": 34, "tests": 9, "coverage": 13}, rows)


def _program(matrix: Matrix) -> Iterator[str]:
    yield f'<h2 id="{escape(matrix.program)}">{escape(matrix.program)}</h2>'
    yield f"<p>Of <code>{escape(matrix.source)}</code>, meaning <code>{matrix.digest[:16]}</code>. {_untraced(matrix)}</p>"
    for name, proof in matrix.tables.items():
        own = [line for line in matrix.lines if line.table == name]
        rests = ", ".join(f"{one} ({was})" for one, was in proof.rests)
        known = f"{proof.verdict}: {proof.method}{f'; rests on {rests}' if rests else ''}"
        matched = [("matched in", matrix.of(Origin(Sort.TABLE, name)))]
        code = "; ".join(_where(matrix, matched, ends) for ends in ((".c",), (".py",)))
        names = listing([", ".join(matrix.requirements.get(name, ()))], "for")
        yield f"<h3>Table {escape(name)} {names}</h3>"
        yield f"<p>{escape(known)}.<br>{code}.</p>"
        yield tabled(
            {"line": 10, "for": 7, "when": 22, "does": 15, "C": 13, "Python": 12, "vectors": 10, "shown": 11},
            (_line(matrix, line) for line in own),
        )
    if matrix.declared:
        yield "<h3>Procedures, assumptions, invariants and properties</h3>"
        widths = {"what": 16, "for": 10, "states": 30, "used by": 26, "known": 18}
        yield tabled(widths, (_declared(matrix, one) for one in matrix.declared))
    yield from _code(matrix)


def _untraced(matrix: Matrix) -> str:
    if not matrix.untraced:
        return "Every line of its generated code comes from the tables, or is named below as infrastructure with its reason."
    some = escape(", ".join(matrix.untraced[:20]))
    return (
        f'<span class="bad">{len(matrix.untraced)} lines of generated code come from nothing: {some}</span>'
    )


def _line(matrix: Matrix, line: TracedLine) -> str:
    code = [(word, pieces) for word, pieces in matrix.code(line) if word != "matches"]
    tests = line.tests
    spoken = ", ".join(name for name, _ in line.properties)
    proved = [*line.findings, *([f"properties: {spoken}"] if spoken else [])]
    shown = f"{tests.shown} of {tests.conditions}" if tests.conditions else ""
    return row(
        f'<b>{escape(line.name)}</b><br><span class="soft">{_place(matrix, line.place, short=True)}</span>',
        listing(line.requirements, "for") or NONE,
        (listing([*line.states]) or NONE)
        + (f'<br><span class="soft">{listing(proved)}</span>' if proved else ""),
        listing(line.does) or NONE,
        _where(matrix, code, (".c",)) or NONE,
        _where(matrix, code, (".py",)) or NONE,
        _numbered("show", tests.made) + _numbered("take", tests.taken) or NOT_MADE,
        (shown or NOT_MADE)
        + (f'<br><span class="soft">{listing(tests.unshown)}</span>' if tests.unshown else ""),
        name=f"{matrix.program}-{line.table}-{line.name}",
    )


def _place(matrix: Matrix, place: str, *, short: bool = False) -> str:
    """Return a place that breaks between folders, file and number, never in one of them, and leads to its line; short: without folders."""
    file, colon, number = place.rpartition(":")
    file, number = (file, number) if colon and number.isdigit() else (place, "")
    *folders, name = file.split("/")
    last = f"{name}:" if number else name
    pieces = (*(f"{folder}/" for folder in folders if not short), last, number)
    return _led(matrix, file, number or 1, "<wbr>".join(_unbroken(piece) for piece in pieces if piece))


def _unbroken(words: str) -> str:
    """Return a name or numbers that stay on one line: a column grows with its longest."""
    return f'<span class="at">{escape(words)}</span>'


def _numbered(word: str, numbers: Sequence[int]) -> str:
    """Return numbers of vectors, neighbours joined: `3-5, 9`."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    words = (_unbroken(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0])) for run in runs)
    return f'<div><span class="soft">{word}</span> {", ".join(words)}</div>' if runs else ""


def _where(matrix: Matrix, code: Iterable[tuple[str, tuple[Piece, ...]]], ends: tuple[str, ...]) -> str:
    """Return the places of a line's code, the words before them soft; what only numbers it is left out."""
    rows = []
    for word, pieces in code:
        for file, runs in spots(piece for piece in pieces if piece.file.endswith(ends)):
            lines = ", ".join(_led(matrix, file, first, _unbroken(f"{first}-{last}")) for first, last in runs)
            name = _unbroken(f"{file.rpartition('/')[2]}:")
            rows.append(f'<span class="soft">{word}</span> {name} {lines}')
    return "<br>".join(rows)


def _declared(matrix: Matrix, one: Declared) -> str:
    return row(
        f'<b>{escape(one.name)}</b><br><span class="soft">{escape(one.sort)}, {_place(matrix, one.place)}</span>',
        listing(one.requirements, "for") or NONE,
        quoted(one.states) or NONE,
        escape(", ".join(one.used)) or NONE,
        quoted(one.proof) or NONE,
    )


def _code(matrix: Matrix) -> Iterator[str]:
    """Yield each generated file back to the tables, neighbours of one origin joined."""
    yield "<h3>Generated code, back to the tables</h3>"
    widths = {"lines": 9, "called": 27, "comes from": 34, "where": 18, "for": 12}
    for file, pieces in groupby(
        sorted(matrix.pieces, key=lambda piece: piece.file), key=lambda piece: piece.file
    ):
        ordered = sorted(pieces, key=lambda piece: (piece.first, -piece.last))
        yield f"<p><code>{escape(file)}</code>, SHA-256 <code>{matrix.files.get(file, '')[:16]}</code></p>"
        joined = (list(same) for _, same in groupby(ordered, key=lambda piece: piece.origin))
        yield tabled(widths, (_piece(matrix, same) for same in joined))


def _piece(matrix: Matrix, same: list[Piece]) -> str:
    origin = same[0].origin
    names = list(dict.fromkeys(piece.name for piece in same if piece.name))
    named = ", ".join(names) if len(names) < 4 else f"{names[0]}, {names[1]} and {len(names) - 2} more"
    words = escape(origin.words)
    return row(
        _led(
            matrix,
            same[0].file,
            same[0].first,
            _unbroken(f"{same[0].first}-{max(piece.last for piece in same)}"),
        ),
        f"<code>{escape(named)}</code>" if named else NONE,
        f'<span class="soft">infrastructure: {words}</span>' if origin.sort is Sort.INFRASTRUCTURE else words,
        _place(matrix, matrix.place(origin)) or NONE,
        listing(matrix.answers(origin), "for") or NONE,
    )
