"""Tables as they stand in a text, whether it parses or not: rows, their parts and cells.

In: a text. Out: `WrittenTable`s. Which rows go together and where cells begin is what the parser takes
(`rcsc.lang.syntax.rows`); a row that the parser would refuse has the cells that its bars make.
"""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, count, pairwise, zip_longest

from rcsc.lang.leaves import free_name
from rcsc.lang.syntax.rows import Cell, Cells, cut, is_separator, parts, stub_of
from rcsc.lang.syntax.turned import NAMELESS_DEFAULT, name_of

_HEAD = re.compile(
    r"^[ \t]*(?P<table>table)[ \t]+(?P<name>[A-Za-z_]\w*)(?P<turned>\s+(?:by|giving)\s[^{}|]*?)?"
    r"(?:\s+assuming\s[\w\s,]*)?(?:\s*req\s*\"[^{}|\r\n]*)?\s*\{",
    re.MULTILINE | re.ASCII,
)
"""A level names its tables otherwise: without a brace, or `by` what."""
NEW_LINE = "new"
"""Name of a line that nobody has named."""
_ROW = re.compile(r"^[ \t]*(?P<row>\|[^\r\n]*)", re.MULTILINE)
_END = re.compile(r"^[ \t]*(?P<brace>\})|^[ \t]*(?:[A-Za-z_])", re.MULTILINE)


class RowText(str):
    """A row from its first bar to the end of its line, and where it begins."""

    start: int
    __slots__ = ("start",)

    @classmethod
    def at(cls, text: str, start: int) -> "RowText":
        """Return the row that begins there."""
        row = cls(text)
        row.start = start
        return row

    @property
    def past(self) -> int:
        """The offset after its last character."""
        return self.start + len(self)


@dataclass(frozen=True, slots=True)
class WrittenPart:
    """A part of a table: heading and lines, each as the rows that it takes."""

    heading: tuple[RowText, ...]
    lines: tuple[tuple[RowText, ...], ...]


@dataclass(frozen=True, slots=True)
class WrittenTable:
    """A table as it stands.

    Attributes:
        name: Its name; `named` is the offset of that.
        start: The offset of the word `table`.
        end: The offset after its brace, or where it ends without one.
        rows: All rows, in order.
        headed: The offset after its name, and after what it is `by` and `giving` where it is turned.
    """

    name: str
    named: int
    start: int
    end: int
    rows: tuple[RowText, ...]
    headed: int

    @property
    def turned(self) -> bool:
        """Whether it is printed the other way round."""
        return self.headed > self.named + len(self.name)

    def once(self, cells: Cells) -> bool:
        """Return whether a row is DEFAULT where that has one cell after `||`, for all columns."""
        return self.turned and any(cell.text.startswith("DEFAULT") for cell in cells.conditions[:2])

    @property
    def parts(self) -> tuple[WrittenPart, ...]:
        """The parts of the table, without rows of dashes."""
        found = parts(self.rows) if self.rows else []
        return tuple(
            WrittenPart(tuple(groups[0]), tuple(map(tuple, groups[1:]))) for groups in found if groups
        )

    @property
    def has_names(self) -> bool:
        """Whether the first column names the lines; else their names are made of what their conditions say."""
        return not self.turned or joined_cells(self.parts[0].heading).conditions[0].text == "line"

    @property
    def line_names(self) -> list[str]:
        """The names of its lines, in order."""
        if not self.parts:
            return []
        every = zip_longest(*(part.lines for part in self.parts), fillvalue=())
        return [self._line_name([joined_cells(rows) for rows in of_parts if rows]) for of_parts in every]

    def _line_name(self, cells: Sequence[Cells]) -> str:
        first = cells[0].conditions[0]
        if self.has_names:
            return stub_of(first).name.text
        if self.once(cells[0]):
            return NAMELESS_DEFAULT
        return name_of([first.text, *(cell.text for part in cells for cell in part.conditions[1:])])

    def rows_of(self, part: WrittenPart) -> tuple[RowText, ...]:
        """Return all rows of one of its parts, with those of dashes."""
        begin = part.heading[0].start
        past = min(
            (each.heading[0].start for each in self.parts if each.heading[0].start > begin), default=self.end
        )
        return tuple(row for row in self.rows if begin <= row.start < past)


def tables_of(text: str) -> Iterator[WrittenTable]:
    """Yield the tables of a text, in order."""
    past = 0
    for head in _HEAD.finditer(text):
        if head.start() < past:
            continue
        closing = _END.search(text, head.end())
        end = len(text) if closing is None else closing.start() if closing["brace"] is None else closing.end()
        rows = tuple(RowText.at(row["row"], row.start("row")) for row in _ROW.finditer(text, head.end(), end))
        past = end
        headed = head.end("turned" if head["turned"] else "name")
        yield WrittenTable(head["name"], head.start("name"), head.start("table"), end, rows, headed)


def table_of(text: str, name: str) -> WrittenTable | None:
    """Return the first table of this name; None where there is none."""
    return next((table for table in tables_of(text) if table.name == name), None)


def cells_of(row: RowText, file: str = "") -> Cells:
    """Return the cells of a row; all count as conditions where it has not exactly one `||`."""
    cells = cut(row, row.start, file)
    if isinstance(cells, Cells):
        return cells
    body = row.partition("#")[0].rstrip()
    offset, found = row.start + 1, []
    for piece in body[1:].removesuffix("|").split("|"):
        lead = len(piece) - len(piece.lstrip()) if piece.strip() else 0
        found.append(Cell(piece.strip(), file, offset + lead))
        offset += len(piece) + 1
    return Cells(tuple(found), ())


def joined_cells(rows: Sequence[RowText], file: str = "") -> Cells:
    """Return the cells of a line over the rows that it takes, without rows whose number of cells differs from the first."""
    whole = cells_of(rows[0], file)
    split = len(whole.conditions)
    every = list(whole.all)
    for row in rows[1:]:
        more = cells_of(row, file)
        if len(more.conditions) != split or len(more.all) != len(every):
            continue
        every = [
            cell if not piece.text else cell.with_piece(piece) if cell.text else piece
            for cell, piece in zip(every, more.all, strict=True)
        ]
    return Cells(tuple(every[:split]), tuple(every[split:]))


def written_cell(table: WrittenTable, line: int, column: int) -> tuple[tuple[RowText, ...], Cell] | None:
    """Return the rows of a line and one of its cells; None where the line ends before it, or is not in that part.

    Args:
        table: Its text.
        line: From 0; -1 is the heading.
        column: From 0; conditions of all parts are counted first, then actions.
    """
    headings = [joined_cells(part.heading) for part in table.parts]
    conditions = sum(len(heading.conditions) - 1 for heading in headings)
    action = column >= conditions
    at = column - conditions if action else column
    for part, heading in zip(table.parts, headings, strict=True):
        many = len(heading.actions) if action else len(heading.conditions) - 1
        if at >= many:
            at -= many
        elif line < len(part.lines):
            rows = part.heading if line < 0 else part.lines[line]
            cells = joined_cells(rows)
            own = cells.actions if action else cells.conditions[1:]
            return (rows, own[at]) if at < len(own) else None
        else:
            return None
    return None


def pieces(cell: Cell) -> list[tuple[int, int]]:
    """Return start and end of each piece of a cell; an empty cell has one piece, of no length.

    >>> pieces(Cell("in {left, right}", "a.rcs", 40, ((10, 90),)))
    [(40, 49), (90, 96)]
    """
    bounds = [(0, cell.start), *cell.further, (len(cell.text) + 1, 0)]
    found = []
    for (begin, start), (past, _) in pairwise(bounds):
        text = cell.text[begin:past].rstrip()
        found.append((start, start + len(text)))
    return found


def dashes(row: RowText) -> bool:
    """Return whether a row is only `|---|---|`."""
    return is_separator(row)


def whole_line(text: str, row: RowText) -> tuple[int, int]:
    """Return the offsets of the beginning of a row's line of text and of the next line."""
    start = text.rfind("\n", 0, row.start) + 1
    end = text.find("\n", row.past)
    return start, len(text) if end < 0 else end + 1


def fresh_name(names: Collection[str], above: str = "") -> str:
    """Return a name for a line that no other has: the next number or letter after that of the line above, else `new`.

    >>> fresh_name(["1", "2", "3"], "1"), fresh_name(["a"], "a"), fresh_name(["go", "new"], "go")
    ('4', 'b', 'new_2')
    """
    numbers = (str(number) for number in count(int(above) + 1)) if above.isdecimal() else iter(())
    single = len(above) == 1 and above.isascii() and above.isalpha()
    letters = (
        map(chr, range(ord(above) + 1, ord("Z" if above.isupper() else "z") + 1)) if single else iter(())
    )
    return next((name for name in chain(numbers, letters) if name not in names), free_name(NEW_LINE, names))
