"""A matrix as a page, and the texts that its places lead to as another: without a script, dark where the reader's screen is, to be printed.

In: matrices. Out: HTML.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from itertools import groupby
from urllib.parse import quote

from rcsc.code.emit.plan import Origin, Sort
from rcsc.code.emit.rendering import Piece
from rcsc.views.pages.frame import palette
from rcsc.views.trace.matrix import Declared, Matrix, TracedLine
from rcsc.views.trace.requirements import Standing, standings
from rcsc.views.trace.tables_of import spots

_STYLE = """* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.2rem 1.5rem; max-width: 92rem; background: var(--paper); color: var(--ink);
  font: 14px/1.4 system-ui, sans-serif; }
h1 { font-size: 1.5rem; margin: 0 0 .3rem; }
h2 { font-size: 1.2rem; margin: 2rem 0 .4rem; border-bottom: 2px solid var(--edge); }
h3 { font-size: 1rem; margin: 1.2rem 0 .2rem; }
p { margin: .2rem 0 .5rem; color: var(--soft); max-width: 80rem; }
table { border-collapse: collapse; width: 100%; margin-bottom: .6rem; }
th, td { padding: .2rem .5rem; text-align: left; vertical-align: top; border-bottom: 1px solid var(--edge); overflow-wrap: anywhere; }
th { font-size: .8rem; color: var(--soft); background: var(--panel); }
td { font-size: .82rem; }
code { font: .95em ui-monospace, monospace; }
.soft { color: var(--soft); } .bad { color: var(--bad); font-weight: 600; }
.for { color: var(--accent); font-weight: 600; } a { color: inherit; }
.at { white-space: nowrap; }
.text { counter-reset: line; margin: 0; padding: .4rem 0; font: 12px/1.45 ui-monospace, monospace; overflow-x: auto; }
.text span { display: block; }
.text span::before { counter-increment: line; content: counter(line); display: inline-block; width: 4em; color: var(--soft); }
.text :target { background: var(--lit); color: var(--lit-ink); }
nav a { margin-right: 1rem; }
tr:target { outline: 2px solid var(--accent); }
@media print {
  body { padding: 0; max-width: none; font-size: 9pt; } h2 { break-before: page; }
  tr { break-inside: avoid; } thead { display: table-header-group; }
}
@page { size: A4 landscape; margin: 12mm; }
"""
_ABOUT = (
    "From requirements and lines of tables to generated code, tests and proofs, and back. Places of code are lines of a file, first "
    "and last. Vectors have the numbers of the file that <code>rcsc test --vectors</code> writes: those that show a condition of the line "
    "to decide it, and those that take the line. Vectors are made of the tables: they test that the code does what the tables say. That "
    "the tables say what is required is another matter: for a requirement of a property its verdict says so, of every run; tests of "
    "requirements are scripts of orders (<code>rcsc run</code>) and watched episodes (<code>rcsc campaign</code>), which are kept apart."
)
NONE, NOT_MADE = '<span class="soft">none</span>', '<span class="soft">not made</span>'
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def page(matrices: Sequence[Matrix], listed: Sequence[str]) -> str:
    """Return the page: requirements, then each program forward by lines and backward by code."""
    links = (f'<a href="#{escape(one.program)}">{escape(one.program)}</a>' for one in matrices)
    body = [
        "<h1>Traceability</h1>",
        f"<p>{_ABOUT}</p>",
        f"<nav>{''.join(links)}</nav>",
        *_requirements(standings(matrices), listed),
        *(part for one in matrices for part in _program(one)),
    ]
    return framed("Traceability", body)


TEXTS = "texts.html"
"""The page of texts, beside that of the matrix."""


def texts_page(matrices: Sequence[Matrix]) -> str:
    """Return the texts of tables and generated files, each line a place that the matrix leads to."""
    texts = {path: text for one in matrices for path, text in one.texts.items()}
    body = ["<h1>Texts</h1>", "<p>Tables, and the code that is made of them, as they were traced.</p>"]
    links = (f'<a href="#{escape(quote(path))}">{escape(path)}</a>' for path in texts)
    body.append(f"<nav>{''.join(links)}</nav>")
    for path, text in texts.items():
        lines = "".join(
            f'<span id="{escape(path)}:{at}">{escape(line) or " "}</span>'
            for at, line in enumerate(text.splitlines(), 1)
        )
        body += [f'<h2 id="{escape(path)}">{escape(path)}</h2>', f'<pre class="text">{lines}</pre>']
    return framed("Texts", body)


def _led(matrix: Matrix, path: str, line: int | str, shown: str) -> str:
    """Return what is shown of a place, as a link to its line where its text is there."""
    if path not in matrix.texts:
        return shown
    return f'<a href="{TEXTS}#{escape(quote(path))}:{line}">{shown}</a>'


def framed(title: str, body: Iterable[str]) -> str:
    """Return a page of these parts, which needs no script and no other file."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<meta name="color-scheme" content="light dark">\n'
        f'<link rel="icon" href="data:,">\n<title>{escape(title)}</title>\n<style>\n{palette()}{_STYLE}</style>\n</head>\n<body>\n'
        + "\n".join(body)
        + "\n</body>\n</html>\n"
    )


def tabled(headings: Mapping[str, int], rows: Iterable[str]) -> str:
    """Return a table; the width of each column in per cent."""
    columns = "".join(f'<col style="width: {width}%">' for width in headings.values())
    heads = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    return f"<table><colgroup>{columns}</colgroup><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def row(*cells: str, name: str = "") -> str:
    """Return a row of cells that are HTML; a name that others can point at."""
    mark = f' id="{escape(name)}"' if name else ""
    return f"<tr{mark}>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def listing(words: Iterable[str], style: str = "") -> str:
    """Return words one below the other, as a cell."""
    cell = "<br>".join(map(escape, words))
    return f'<span class="{style}">{cell}</span>' if style and cell else cell


def _requirements(known: Mapping[str, Sequence[Standing]], listed: Sequence[str]) -> Iterator[str]:
    yield "<h2>Requirements</h2>"
    names = dict.fromkeys((*listed, *known))
    if not names:
        yield "<p>No line and no declaration names one: a column <code>req</code> of a table does.</p>"
        return
    if listed:
        yield f"<p>{sum(name in known for name in listed)} of {len(listed)} in the list have a place.</p>"
    rows = []
    for name in names:
        note = ' <span class="bad">not in the list</span>' if listed and name not in listed else ""
        head = f'<span class="for">{escape(name)}</span>{note}'
        if name not in known:
            rows.append(row(head, '<span class="bad">nothing is for it</span>', NONE, NONE, NONE))
        for at, one in enumerate(known.get(name, ())):
            verdict = (
                f'<span class="bad">{_spoken(one.verdict)}</span>' if one.refuted else _spoken(one.verdict)
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


def _spoken(text: str) -> str:
    """Return a sentence whose names stand in backticks, with these set apart."""
    parts = escape(text).split("`")
    return "".join(f"<code>{part}</code>" if at % 2 else part for at, part in enumerate(parts))


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
        _spoken(one.states) or NONE,
        escape(", ".join(one.used)) or NONE,
        _spoken(one.proof) or NONE,
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
