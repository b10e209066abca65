"""Cuts table rows into cells, and joins what goes on over several rows; which cells there are and where, not what they say.

In: rows and their offsets. Out: `Cells`, or what is wrong with them. A table has two means against width:

- a row whose first cell is empty goes on with the row above it, cell by cell (`joined`);
- a heading may come again: below it stand further columns of the same lines (`parts`).
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Generic, TypeVar, overload

from rcsc.base.diagnostics.source import Span
from rcsc.lang.operator_table import LOGIC

ACTION_WORDS = frozenset({"procedures", "command_out", "status_out"})
REQUIREMENTS = "req"
"""The heading of the column of requirements, which is neither a condition nor an action."""
SEPARATOR = re.compile(r"\|[\s|:-]*-[\s|:-]*$")
GOES_ON = re.compile(r"\|[ \t]*\|")
STUB = re.compile(r"(?P<name>\w+)(\s+(above|same)\s+\w+(\s*,\s*\w+)*)*$", re.ASCII)
"""The first cell of a line: its name, the lines above which it stands, and those that do the same."""
_MARK = re.compile(r"\s+(above|same)\s+(\w+(?:\s*,\s*\w+)*)", re.ASCII)
MARKS = "after a line's name may stand `above LINE, LINE`, or `above all`, and `same LINE`"
CALL = re.compile(r"(?!(?:abs|min|max|int|real|single|not)\b)[A-Za-z_][A-Za-z0-9_]*\s*\(|[^=]*:=")
"""Text that looks like a call or an assignment, and may stand where a value should."""
CALL_UNDER = "a call or an assignment stands under `procedures`, `command_out` or `status_out`"
IN_QUOTES = (
    'under `req` stand requirements in quotes: `"SR-12", "SR-13"`; a variable of that name is headed `(req)`'
)
ORDER = re.compile(r"(\w+)\s*\(")
"""The beginning of an order with fields."""
NAMED_FIELDS = "an order to a subordinate names its fields: `{}(FIELD := VALUE)`"
TO_WHOM = "an order says to whom: `SUBORDINATE := {}(FIELD := VALUE)`"
EMPTY_CELL = "an empty cell is `| |`, with a blank; `||` stands once in a row, between conditions and actions"
"""Help where cells of a row are missing, or stand on the wrong side."""
BITS = re.compile(r"(?=[01]*[xX])[01xX]+")
"""A mask of one group, which would be a name or a number elsewhere."""
ONE_GROUP = "bits of one group are written with `0b`: `0b{}`"
PARTED = "`|` parts cells: values and masks are listed with `,`, conditions joined by `or` under `when`, bits put together in a procedure"
NO_HEADING = (
    "each column has a heading: a variable or an expression, `when`, after `||` a variable or `procedures`"
)
COLUMNS = "each column of such a table is headed by a result, or by a condition where the table says `by` what; `NAME : ...` names it"
ONCE = "a DEFAULT row is for all that no cell takes: what it does stands once, after `||`"
ROW_NAMES = "a first column `line` names the rows: then any of their conditions may be left out"
NEW_PART = "a heading that begins another part of the table has a row `|---|` below it"
PIECES = (
    "a row with an empty first cell goes on with the cells of the row above it; a line has its name there"
)
SAME_LINES = "each part of a table has a row for each line, in the same order"
PLAIN = "how a line stands to others is said where it is named first; further parts of the table repeat its name alone"
NO_LAST_BAR = "this row does not end with `|`"
LAST_BAR = "write `|` after its last cell: a row that is cut short is none"
_Row = TypeVar("_Row", bound=str)
_Item = TypeVar("_Item")


@dataclass(frozen=True, slots=True)
class Cell:
    """A table cell.

    Attributes:
        text: The trimmed text, pieces joined.
        file: Name of the file.
        start: Offset in the file of the first character.
        further: Where each piece after the first begins: its offset in the text, and in the file.
    """

    text: str
    file: str
    start: int
    further: tuple[tuple[int, int], ...] = ()

    @property
    def span(self) -> Span:
        """The place of the first piece, which is all of most cells."""
        return self.at(0, len(self.text))

    @property
    def ends(self) -> tuple[int, int]:
        """Start and end of `span`, kept apart for speed: every cell is asked for them, and few have more than one piece.

        >>> Cell("on", "a.rcs", 40).ends, Cell("in {left, right}", "a.rcs", 40, ((10, 90),)).ends
        ((40, 42), (40, 49))
        """
        if not self.further:
            return self.start, self.start + len(self.text)
        span = self.span
        return span.start, span.end

    def at(self, start: int, end: int) -> Span:
        """Return the place in the file of characters of the text; only of those in the same piece as the first.

        >>> cell = Cell("in {left, right}", "a.rcs", 40, ((10, 90),))
        >>> cell.at(4, 8), cell.at(10, 15)
        (Span(file='a.rcs', start=44, end=48), Span(file='a.rcs', start=90, end=95))
        >>> cell.span
        Span(file='a.rcs', start=40, end=49)
        """
        begin, place, past = 0, self.start, len(self.text)
        if not self.further:
            return Span(self.file, place + start, place + max(start, min(end, past)))
        for offset, there in self.further:
            if offset > start:
                past = len(self.text[:offset].rstrip())
                break
            begin, place = offset, there
        return Span(self.file, place + start - begin, place + max(start, min(end, past)) - begin)

    def blank(self) -> "Cell":
        """Return the cell, without the `-` that may stand in an empty one."""
        return replace(self, text="") if self.text == "-" else self

    def part(self, start: int, end: int) -> "Cell":
        """Return some characters, as a cell.

        >>> Cell("halted above ready", "a.rcs", 40).part(13, 18)
        Cell(text='ready', file='a.rcs', start=53, further=())
        """
        further = tuple((offset - start, place) for offset, place in self.further if start < offset < end)
        return Cell(self.text[start:end], self.file, self.at(start, end).start, further)

    def with_piece(self, piece: "Cell") -> "Cell":
        """Return the cell with one piece more; a blank between, but after `_` and `.`.

        >>> Cell("new_", "", 3).with_piece(Cell("command", "", 30)).text
        'new_command'
        >>> Cell("begin;", "", 3).with_piece(Cell("nextstate(d_state)", "", 30)).text
        'begin; nextstate(d_state)'
        """
        before = self.text if self.text.endswith(("_", ".")) else f"{self.text} "
        return Cell(before + piece.text, self.file, self.start, (*self.further, (len(before), piece.start)))


@dataclass(frozen=True, slots=True)
class Stub:
    """The parts of a line's first cell: its name, the lines above which it stands, and those that do the same."""

    name: Cell
    above: tuple[Cell, ...] = ()
    same: tuple[Cell, ...] = ()


def stub_of(cell: Cell) -> Stub:
    """Take the first cell of a line apart; a cell that does not fit the pattern is all name.

    >>> stub = stub_of(Cell("halted above ready, idle same off", "a.rcs", 0))
    >>> stub.name.text, [(line.text, line.start) for line in stub.above], [line.text for line in stub.same]
    ('halted', [('ready', 13), ('idle', 20)], ['off'])
    """
    stub = STUB.match(cell.text)
    if stub is None:
        return Stub(cell)
    lines: dict[str, list[Cell]] = {"above": [], "same": []}
    for mark in _MARK.finditer(cell.text, stub.end("name")):
        words = re.compile(r"\w+").finditer(cell.text, *mark.span(2))
        lines[mark[1]] += [cell.part(*word.span()) for word in words]
    return Stub(cell.part(*stub.span("name")), tuple(lines["above"]), tuple(lines["same"]))


_JOINED = "|".join(sorted((*LOGIC, "when")))
_JOINTS = re.compile(rf"[\[({{]|[\])}}]|(?<![\w.@])(?:{_JOINED})(?!\w)|(?<!\w)\d\w*(?:{_JOINED})", re.ASCII)
"""Brackets, what joins conditions, and a number with such a word at its end, without a blank: `1or`."""


def conjuncts(text: str) -> list[tuple[int, int]]:
    """Return the place of each condition that `and` joins in a text; empty where it is no such list.

    >>> text = "a = 1 and (b or c)"
    >>> [text[start:end] for start, end in conjuncts(text)]
    ['a = 1', '(b or c)']
    >>> conjuncts("a and b or c"), conjuncts("a and b = 1or c"), conjuncts("a")
    ([], [], [])
    """
    depth, cuts = 0, [(0, 0)]
    for joint in _JOINTS.finditer(text):
        word = joint[0]
        if word in "[({":
            depth += 1
        elif word in "])}":
            depth -= 1
        elif depth == 0 and word != "and":
            return []
        elif depth == 0:
            cuts.append(joint.span())
    if len(cuts) == 1:
        return []
    ends = [start for start, _ in cuts[1:]] + [len(text)]
    return [
        (at + len(text[at:end]) - len(text[at:end].lstrip()), at + len(text[at:end].rstrip()))
        for (_, at), end in zip(cuts, ends, strict=True)
    ]


class _Made(Sequence[_Item], Generic[_Item]):
    """Values that are made on demand: most of a large table's never are."""

    __slots__ = ()

    def _at(self, at: int) -> _Item:
        """Make the value of a position, 0 or more and less than the length."""
        raise NotImplementedError

    @overload
    def __getitem__(self, at: int) -> _Item: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[_Item, ...]: ...

    def __getitem__(self, at: int | slice) -> _Item | tuple[_Item, ...]:
        return tuple(self)[at] if isinstance(at, slice) else self._at(range(len(self))[at])


@dataclass(frozen=True, slots=True)
class Side(_Made[Cell]):
    """The cells of one side of a single row, kept as they stand there.

    Attributes:
        body: The text, without the bars around it.
        file: Name of the file.
        start: Offset in the file of the text.

    >>> side = Side(" on | | in {left} ", "a.rcs", 40)
    >>> [cell.text for cell in side], side[2].span
    (['on', '', 'in {left}'], Span(file='a.rcs', start=47, end=56))
    """

    body: str
    file: str
    start: int

    @property
    def texts(self) -> list[str]:
        """The texts between the bars, with their blanks."""
        return self.body.split("|")

    def __len__(self) -> int:
        return self.body.count("|") + 1

    def __iter__(self) -> Iterator[Cell]:
        offset = self.start
        for piece in self.texts:
            yield self._cell(piece, offset)
            offset += len(piece) + 1

    def _at(self, at: int) -> Cell:
        *before, piece = self.body.split("|", at + 1)[: at + 1]
        return self._cell(piece, self.start + sum(map(len, before)) + at)

    def _cell(self, piece: str, offset: int) -> Cell:
        text = piece.strip()
        lead = len(piece) - len(piece.lstrip()) if text else 0
        return Cell(text, self.file, offset + lead)


@dataclass(frozen=True, slots=True)
class Cells:
    """A row: conditions before the `||` (the line's name first), actions after it."""

    conditions: Sequence[Cell]
    actions: Sequence[Cell]

    @property
    def all(self) -> tuple[Cell, ...]:
        """The cells of both sides."""
        return (*self.conditions, *self.actions)

    @property
    def last(self) -> Cell:
        """The last cell."""
        return (self.actions or self.conditions)[-1]


@dataclass(frozen=True, slots=True)
class LineCells(_Made[Cell]):
    """The cells of a line: its name, conditions and actions, without its requirements.

    Attributes:
        name: Its name alone, of what its first cell says.
        cells: All of its cells.
        traced: Which of those after `||` has the requirements; None where none has.

    >>> cells = Cells(Side(" x ", "", 1), Side(" a | SR-1 | b ", "", 6))
    >>> [cell.text for cell in LineCells(cells.conditions[0], cells, 1)], LineCells(cells.conditions[0], cells, 1)[2].text
    (['x', 'a', 'b'], 'b')
    """

    name: Cell
    cells: Cells
    traced: int | None = None

    def __len__(self) -> int:
        return len(self.cells.conditions) + len(self.cells.actions) - (self.traced is not None)

    def __iter__(self) -> Iterator[Cell]:
        yield self.name
        yield from self.cells.conditions[1:]
        yield from (cell for at, cell in enumerate(self.cells.actions) if at != self.traced)

    def _at(self, at: int) -> Cell:
        action = at - len(self.cells.conditions)
        if action < 0:
            return self.cells.conditions[at] if at else self.name
        return self.cells.actions[action + (self.traced is not None and action >= self.traced)]


@dataclass(frozen=True, slots=True)
class Bounds(_Made[int]):
    """Start and end of each cell's first piece, flattened.

    >>> list(Bounds(Side(" on | off ", "a.rcs", 40)))
    [41, 43, 46, 49]
    """

    cells: Sequence[Cell]

    def __len__(self) -> int:
        return 2 * len(self.cells)

    def __iter__(self) -> Iterator[int]:
        return chain.from_iterable(cell.ends for cell in self.cells)

    def _at(self, at: int) -> int:
        return self.cells[at // 2].ends[at % 2]


def is_separator(row: str) -> bool:
    """Return whether the row is only `|---|---|`."""
    return SEPARATOR.match(row) is not None


def parts(rows: Sequence[_Row]) -> list[list[list[_Row]]]:
    """Return the rows of each part of a table: first its heading's, then those of each line.

    A part begins with a heading, which is the first row, and later one whose first cell is that of the first, mostly `line`, with
    a separator below. A row that goes on with the one above stands with it.

    >>> parts(["| line | a ||", "|--|--||", "| x | 1 ||", "| | 2 ||", "| line || b |", "|--||--|", "| x || 3 |"])
    [[['| line | a ||'], ['| x | 1 ||', '| | 2 ||']], [['| line || b |'], ['| x || 3 |']]]
    """
    found: list[list[list[_Row]]] = [[]]
    whole = False
    for row in rows:
        if is_separator(row):
            last = found[-1]
            if len(last) > 1 and not whole and _first(last[-1][0]) == _first(found[0][0][0]):
                found.append([last.pop()])
            whole = True
        elif found[-1] and not whole and GOES_ON.match(row):
            found[-1][-1].append(row)
        else:
            found[-1].append([row])
            whole = False
    return found


def _first(row: str) -> str:
    """Return the text of a row's first cell.

    >>> _first("| line | a ||")
    'line'
    """
    return row[1:].partition("|")[0].strip()


def joined(cells: Cells, more: Cells, above: Cells) -> Cells | Cell:
    """Join a row with the row that goes on with it; or return the piece that has nothing in the row directly `above` it.

    All have as many cells.
    """
    for upper, piece in zip(above.all, more.all, strict=True):
        if piece.text and not upper.text:
            return piece
    whole = [
        cell.with_piece(piece) if piece.text else cell
        for cell, piece in zip(cells.all, more.all, strict=True)
    ]
    split = len(cells.conditions)
    return Cells(tuple(whole[:split]), tuple(whole[split:]))


def cut(row: str, start: int, file: str) -> Cells | str:
    """Return the cells of `row`, which begins at `start`; a message where `||` does not divide it once, or no bar ends it."""
    row = row.partition("#")[0].rstrip()
    left, bar, right = row.partition("||")
    if not bar:
        return "a row needs `||` between its conditions and its actions"
    if "||" in right:
        return f"a row has exactly one `||`, this one has {row.count('||')}"
    if not row.endswith("|"):
        return NO_LAST_BAR
    return Cells(
        _side(left[1:], start + 1, file), _side(right, start + len(left) + 2, file) if right.strip() else ()
    )


def _side(body: str, start: int, file: str) -> Side:
    """Return the cells of one side; a bar at the end closes the last."""
    return Side(body.removesuffix("|"), file, start)
