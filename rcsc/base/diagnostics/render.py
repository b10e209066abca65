"""Diagnostics as text: the full form with the source and the witness, and the one-line form.

In: diagnostics and the sources they point into. Out: lines of styled pieces, or plain text; colour is
added by `paint`, the only importer of rich, and only when it is wanted.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby

from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity, WitnessColumn
from rcsc.base.diagnostics.printable import clip, escape, pad, width
from rcsc.base.diagnostics.source import Source, Sources

WIDEST_LINE = 110
"""Cells shown of a source line where the terminal's width is not known: as wide as `rcsc fmt` makes tables."""


class Style(StrEnum):
    """The role of a piece of text; `paint` gives it a colour."""

    PLAIN = ""
    STRONG = "bold"
    GUTTER = "bold blue"
    ERROR = "bold red"
    WARNING = "bold yellow"
    NOTE = "bold cyan"
    RELATED = "bold blue"
    HELP = "bold green"
    WITNESS = "bold magenta"


OF_SEVERITY = {Severity.ERROR: Style.ERROR, Severity.WARNING: Style.WARNING, Severity.NOTE: Style.NOTE}


@dataclass(frozen=True, slots=True)
class TextPiece:
    """A run of text in one style."""

    text: str
    style: Style = Style.PLAIN


Row = tuple[TextPiece, ...]


def full(
    diagnostic: Diagnostic, sources: Sources, columns: int = WIDEST_LINE, *, broken: bool = False
) -> tuple[Row, ...]:
    """Return the diagnostic with its source, witnesses, notes and help.

    Excerpts are at most about `columns` wide, and so are sentences that are to be `broken` between words.
    """
    rows: list[Row] = []
    for row, hang in _full(diagnostic, sources, columns):
        rows += wrapped(row, columns, hang) if broken and hang else [row]
    return tuple(rows)


def wrapped(row: Row, columns: int, hang: int) -> Iterator[Row]:
    r"""Yield a row broken between words so that none is wider than `columns`, but for longer words; all after the first begin at `hang`.

    >>> row = (TextPiece("help", Style.HELP), TextPiece(": write `:=` instead"))
    >>> [plain([part]) for part in wrapped(row, 16, 6)]
    ['help: write `:=`\n', '      instead\n']
    """
    text = "".join(piece.text for piece in row)
    start, shift = 0, 0
    while True:
        end = _line_end(text, start, columns - shift, 0 if start else min(hang, len(text)))
        yield (*((TextPiece(" " * shift),) if shift else ()), *_cut(row, start, end))
        rest = text[end:].lstrip(" \n")
        if not rest:
            return
        start, shift = len(text) - len(rest), min(hang, columns // 2)


def _line_end(text: str, start: int, room: int, past: int) -> int:
    """Return where a line from `start` ends: at a newline, before the word that no longer fits, or after the first if that is too long."""
    stop = text.find("\n", start)
    stop = len(text) if stop < 0 else stop
    if width(text[start:stop]) <= room:
        return stop
    end = -1
    for at in range(start + past, stop):
        if text[at] == " " and (end < 0 or width(text[start:at]) <= room):
            end = at
    return stop if end < 0 else end


def _cut(row: Row, start: int, end: int) -> Row:
    """Return the pieces of a row from one character to another."""
    pieces, at = [], 0
    for piece in row:
        part = piece.text[max(0, start - at) : max(0, end - at)]
        pieces += [TextPiece(part, piece.style)] if part else []
        at += len(piece.text)
    return tuple(pieces)


def _full(diagnostic: Diagnostic, sources: Sources, columns: int) -> Iterator[tuple[Row, int]]:
    """Yield the rows, each with the cell at which it goes on where it is broken; 0 for one that is not."""
    style = OF_SEVERITY[diagnostic.severity]
    head = f"{diagnostic.severity.value}[{diagnostic.code.value}]"
    yield (TextPiece(head, style), TextPiece(f": {escape(diagnostic.message)}", Style.STRONG)), len(head) + 2
    labels = (diagnostic.primary, *diagnostic.related)
    gutter = max(len(str(_line_number(label, sources))) for label in labels)
    yield from ((row, 0) for row in _snippets(diagnostic, sources, gutter, columns, style))
    for witness in diagnostic.shown:
        if diagnostic.severity is not Severity.NOTE or not witness.region:
            yield from ((row, 0) for row in _witness(witness, gutter))
        if witness.region:
            yield _attached(gutter, "region", region(witness), Style.WITNESS), gutter + 11
    if diagnostic.left_out:
        yield _attached(gutter, "more", f"and {diagnostic.left_out}", Style.NOTE), gutter + 9
    for note in diagnostic.notes:
        yield _attached(gutter, "note", note, Style.NOTE), gutter + 9
    for text in diagnostic.help:
        yield _attached(gutter, "help", text, Style.HELP), gutter + 9


def one_line(diagnostic: Diagnostic, sources: Sources) -> str:
    """Return `file:line:column: error[RCS401]: message`, for grep and editors."""
    place = _place(diagnostic.primary, sources)
    message = escape(diagnostic.message)
    return f"{place}: {diagnostic.severity.value}[{diagnostic.code.value}]: {message}"


def with_witness(diagnostic: Diagnostic, sources: Sources) -> str:
    """Return the one line, and below it each witness that a text shows: its values, its region, and the number of others."""
    lines = [one_line(diagnostic, sources)]
    for witness in diagnostic.shown:
        lines.append(f"  witness: {escape(witness.said)}")
        if witness.region:
            lines.append(f"  region: {escape(region(witness))}")
    if diagnostic.left_out:
        lines.append(f"  and {diagnostic.left_out}")
    return "\n".join(lines)


def plain(rows: Iterable[Row]) -> str:
    """Return the rows' text alone, each row ended by a newline."""
    return "".join("".join(piece.text for piece in row).rstrip() + "\n" for row in rows)


def paint(rows: Iterable[Row]) -> str:
    """Return the rows with ANSI colours, each ended by a newline."""
    from rich.console import Console
    from rich.text import Text

    console = Console(
        force_terminal=True, color_system="standard", no_color=False, width=100_000, highlight=False
    )  # whether to paint was decided before, also against NO_COLOR
    with console.capture() as captured:
        for row in rows:
            text = Text(no_wrap=True, end="\n")
            for piece in row:
                text.append(piece.text, piece.style.value or None)
            text.rstrip()
            console.print(text, soft_wrap=True)
    return captured.get()


# --- places in the source ------------------------------------------------------------


def _line_number(label: Label, sources: Sources) -> int:
    source = sources.get(label.span.file)
    return source.position(label.span.start).line if source else 1


def _place(label: Label, sources: Sources) -> str:
    source, name = sources.get(label.span.file), escape(label.span.file)
    if source is None:
        return name or "rcsc"
    position = source.position(label.span.start)
    return f"{name}:{position.line}:{position.column}"


def _snippets(
    diagnostic: Diagnostic, sources: Sources, gutter: int, columns: int, style: Style
) -> Iterator[Row]:
    """Yield the excerpt of the primary place's file, then one of each other file with a label."""
    primary = diagnostic.primary
    here = [label for label in diagnostic.related if label.span.file == primary.span.file]
    others = [label for label in diagnostic.related if label.span.file != primary.span.file]
    groups: list[tuple[Label, tuple[Label, ...]]] = [(primary, (primary, *here))]
    for _, same in groupby(sorted(others, key=lambda label: label.span), key=lambda label: label.span.file):
        group = tuple(same)
        groups.append((group[0], group))
    for index, (first, labels) in enumerate(groups):
        arrow = "-->" if index == 0 else ":::"
        yield (TextPiece(f"{' ' * gutter}{arrow} ", Style.GUTTER), TextPiece(_place(first, sources)))
        source = sources.get(first.span.file)
        if source is not None and (source.text or any(label.message for label in labels)):
            marked = [(label, style if label is primary else Style.RELATED) for label in labels]
            yield from _snippet(source, marked, gutter, columns)


def _snippet(source: Source, marked: list[tuple[Label, Style]], gutter: int, columns: int) -> Iterator[Row]:
    """Yield the lines that the labels point into, each followed by its marks."""
    edge = TextPiece(f"{' ' * gutter} | ", Style.GUTTER)
    yield (TextPiece(f"{' ' * gutter} |", Style.GUTTER),)
    numbered = sorted(
        ((source.position(label.span.start).line, label, style) for label, style in marked),
        key=lambda item: (item[0], item[1].span),
    )
    before = 0
    for number, group in groupby(numbered, key=lambda item: item[0]):
        if before and number > before + 1:
            yield (TextPiece("...", Style.GUTTER),)
        before = number
        text, room = escape(source.line(number)), max(20, columns - gutter - 4)
        for shift, labels in _windows(source, number, [(label, style) for _, label, style in group], room):
            shown = clip(text, shift, room) + ("…" if width(text) > shift + room else "")
            yield (TextPiece(f"{number:>{gutter}} | ", Style.GUTTER), TextPiece(shown))
            for label, style in labels:
                yield (edge, *_marks(source, number, label, style, shift, room))


def _windows(
    source: Source, number: int, labels: list[tuple[Label, Style]], room: int
) -> Iterator[tuple[int, list[tuple[Label, Style]]]]:
    """Yield the start of each excerpt of a line, and the labels in it: one where all fit, else as many as show each label."""
    long = width(escape(source.line(number)))
    left = sorted(labels, key=lambda item: item[0].span)
    while left:
        start = _cells_of(source, number, left[0][0])[0]
        shift = 0 if long <= room else max(0, min(start - room // 4, long - room))
        inside = [label for label in left if sum(_cells_of(source, number, label[0])) <= shift + room]
        shown = inside or left[:1]
        yield shift, shown
        left = [label for label in left if label not in shown]


def _cells_of(source: Source, number: int, label: Label) -> tuple[int, int]:
    """Return the first cell and the number of cells that `label` covers on line `number`."""
    line = source.line(number)
    start = source.position(label.span.start).column - 1
    end = max(start, min(len(line), start + label.span.end - label.span.start))
    return width(escape(line[:start])), max(1, width(escape(line[start:end])))


def _marks(
    source: Source, number: int, label: Label, style: Style, shift: int, room: int
) -> tuple[TextPiece, ...]:
    first, count = _cells_of(source, number, label)
    char = "-" if style is Style.RELATED else "^"
    at = max(0, first - shift)
    count = max(1, min(count, room - at))
    message = f" {escape(label.message)}" if label.message else ""
    return (TextPiece(" " * at), TextPiece(char * count + message, style))


# --- what is attached ----------------------------------------------------------------


def _attached(gutter: int, word: str, text: str, style: Style) -> Row:
    """Return a row below a finding; line ends of its text are kept, and the lines after them are indented."""
    hanging = f"\n{' ' * (gutter + len(word) + 5)}".join(escape(line) for line in text.splitlines())
    return (
        TextPiece(f"{' ' * gutter} = ", Style.GUTTER),
        TextPiece(word, style),
        TextPiece(f": {hanging}"),
    )


def _witness(witness: WitnessColumn, gutter: int) -> Iterator[Row]:
    """Yield a small table, one row for each variable, with the witness beside the lines that match it."""
    heads = ("input", "witness", *(f"line {line.name}" for line in witness.lines))
    columns = [heads] + [
        (name, value, *(line.cells[row] if row < len(line.cells) else "" for line in witness.lines))
        for row, (name, value) in enumerate(zip(witness.variables, witness.values, strict=True))
    ]
    cells = [tuple(escape(cell) for cell in row) for row in columns]
    widths = [max(width(row[column]) for row in cells) for column in range(len(heads))]
    edge = TextPiece(f"{' ' * gutter} | ", Style.GUTTER)
    yield (TextPiece(f"{' ' * gutter} |", Style.GUTTER),)
    yield (edge, TextPiece(_joined(cells[0], widths), Style.STRONG))
    yield (edge, TextPiece("|" + "|".join("-" * (cells_ + 2) for cells_ in widths) + "|"))
    for row in cells[1:]:
        yield (
            edge,
            TextPiece(f"| {pad(row[0], widths[0])} | "),
            TextPiece(pad(row[1], widths[1]), Style.WITNESS),
            TextPiece(" " + _joined(row[2:], widths[2:]) if row[2:] else " |"),
        )
    yield (TextPiece(f"{' ' * gutter} |", Style.GUTTER),)


def region(witness: WitnessColumn) -> str:
    """Return the maximal region around the witness, in the table's words."""
    free = len(witness.variables) > len(witness.region)
    return ", ".join((*witness.region, "any other") if free else witness.region)


def _joined(cells: Iterable[str], widths: Iterable[int]) -> str:
    return "| " + " | ".join(pad(cell, cells_) for cell, cells_ in zip(cells, widths, strict=True)) + " |"
