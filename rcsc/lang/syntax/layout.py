"""Tables as rows of text: aligned, and no wider than a limit where that can be.

In: a table. Out: its rows. What fits on one row a line is written so. What does not has three means, in this order:

1. headings and cells go on in rows below (`new_` above `command`), as many as the fewest further rows need;
2. the columns are parted, those of conditions from those of actions, then each side where it has to be;
3. a column that is too wide even alone stands as it is.

The layout follows from the tree and the limit alone, so laying out twice changes nothing. Widths are chosen greedily: the
column that gives a character for the fewest further rows gives it, until the row fits. Each step looks at every row once.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.lang.operator_table import LOGIC
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import ACTION_WORDS, REQUIREMENTS
from rcsc.lang.syntax.spell import spell_across, spell_action, spell_condition, spell_heading, spell_names

WIDTH = 110
_INDENT = 2
_IN_NAMES = re.compile(r"(?<=[A-Za-z0-9]_)(?=[A-Za-z])|(?<=[A-Za-z0-9_\])]\.)(?=[A-Za-z_])")
"""Where a name in a heading may be broken: after `_` and `.`, so that no blank comes in."""
_QUOTED = re.compile(r'"[^"]*"(?:, )?')
_BLANK = re.compile(r"(?<=[^_.]) ")
_OPERATORS = frozenset("= /= < <= > >= + - * / mod .. :=".split())
_BEFORE = _OPERATORS | LOGIC | frozenset("in not was when for next".split())
"""Words that stay with what follows them. What follows an operator, or is one, stays with what is before it, too."""


@dataclass(slots=True)
class _Column:
    """A column: its heading, its cells and its width.

    Attributes:
        atoms: The pieces into which each distinct text can be broken.
        least: The least width that the column can have.
        rows: By width, the number of rows that each text needs, as far as it was asked.
        next: By width, the next smaller one at which more texts break, as far as it was asked.
    """

    texts: list[str]
    is_condition: bool
    atoms: list[list[str]] = field(init=False)
    width: int = field(init=False)
    least: int = field(init=False)
    rows: dict[int, list[int]] = field(init=False, default_factory=dict)
    next: dict[int, int] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        known: dict[str, list[str]] = {}
        self.atoms = [_atoms(self.texts[0], heading=True)]
        for text in self.texts[1:]:
            if text not in known:
                known[text] = _atoms(text, heading=False)
            self.atoms.append(known[text])
        self.width = max(map(len, self.texts))
        self.least = max((len(atom.strip()) for atoms in self.atoms for atom in atoms), default=0)

    def pieces(self, width: int) -> list[list[str]]:
        """Return the texts, each broken into pieces no wider than `width` where possible; a heading fills its last pieces first."""
        known: dict[int, list[str]] = {id(self.atoms[0]): _filled_last(self.atoms[0], width)}
        for atoms in self.atoms:
            if id(atoms) not in known:
                known[id(atoms)] = _filled(atoms, width)
        return [known[id(atoms)] for atoms in self.atoms]

    def heights(self, width: int) -> list[int]:
        """Return the number of rows that each text needs."""
        if width not in self.rows:
            self.rows[width] = list(map(len, self.pieces(width)))
        return self.rows[width]

    def narrower(self) -> int | None:
        """Return the next smaller width, at which more texts break; None where there is none.

        What is filled up to one less than the present width is filled just so up to its own longest piece.
        """
        if self.width <= self.least:
            return None
        if self.width not in self.next:
            broken = self.pieces(self.width - 1)
            widest = max(len(piece) for pieces in broken for piece in pieces)
            self.rows[widest], self.next[self.width] = list(map(len, broken)), widest
        return self.next[self.width]


def _atoms(text: str, *, heading: bool) -> list[str]:
    """Return the parts between which a text can be broken, each with the blank after it, if any.

    >>> _atoms("path_length - path_at", heading=True)
    ['path_', 'length ', '- path_', 'at']
    >>> _atoms("begin; set_source; nextstate(state_4)", heading=False)
    ['begin; ', 'set_source; ', 'nextstate(state_4)']
    >>> _atoms("/= vis_reqd or width - wanted > 2 [mm]", heading=False)
    ['/= vis_reqd ', 'or width - wanted > 2 [mm]']
    >>> _atoms("move(target_mm := far_mm, speed := 3)", heading=False)
    ['move(target_mm := ', 'far_mm, ', 'speed := 3)']
    >>> _atoms('"SR-12", "the door"', heading=False)
    ['"SR-12", ', '"the door"']
    """
    if text.startswith('"'):  # requirements, each whole
        return _QUOTED.findall(text)
    atoms: list[str] = []
    words = _BLANK.split(text)
    for at, word in enumerate(words):
        pieces = _IN_NAMES.split(word) if heading else [word]
        in_order = at > 1 and words[at - 1] == ":=" and "(" in words[at - 2]
        if atoms and not in_order and _stays(words[at - 1], word, heading=heading):
            atoms[-1] += f" {pieces.pop(0)}"
        elif atoms:
            atoms[-1] += " "
        atoms += pieces
    return atoms


def _stays(before: str, word: str, *, heading: bool) -> bool:
    """Return whether a word stays on the row of the word before it."""
    if (
        before in _BEFORE or word.startswith("[") or ":" in (before, word)
    ):  # `NAME : -`: a row of `: -` would be dashes
        return True
    return not heading and word in _OPERATORS


def _filled(atoms: Sequence[str], width: int) -> list[str]:
    """Fill pieces from the first, each as long as fits."""
    pieces: list[str] = [""]
    for atom in atoms:
        if pieces[-1] and len(pieces[-1]) + len(atom.rstrip()) > width:
            pieces[-1] = pieces[-1].rstrip()
            pieces.append("")
        pieces[-1] += atom
    return pieces


def _filled_last(atoms: Sequence[str], width: int) -> list[str]:
    """Fill pieces from the last, each as long as fits."""
    pieces = [""]
    for atom in reversed(atoms):
        if pieces[0] and len(f"{atom}{pieces[0]}".rstrip()) > width:
            pieces.insert(0, "")
        pieces[0] = f"{atom}{pieces[0]}"
    return [piece.rstrip() for piece in pieces]


def table_rows(table: tree.TableDecl, width: int) -> Iterator[tuple[tree.Row | None, str]]:
    """Yield the rows of a table, each with the line whose comments stand above it, if any."""
    turned = table.turned
    rows = table.rows if turned is None else turned.rows
    columns = _columns(table) if turned is None else _turned_columns(turned, table)
    if turned is None or turned.named:
        names, again = ["line", *(row.stub for row in rows)], ["line", *(row.name for row in rows)]
    else:
        names = again = columns.pop(0).texts
    stub = max(map(len, names))
    once = {} if turned is None else {at: row for at, row in enumerate(rows, 1) if row.default}
    for number, part in enumerate(_parts(columns, width - _INDENT, stub, whole=turned is not None)):
        if number:
            yield None, ""
        yield from _part(again if number else names, stub, part, () if number else rows, once)


def _columns(table: tree.TableDecl) -> list[_Column]:
    left = [[spell_heading(heading, {"when"})] for heading in table.conditions]
    right = [[spell_heading(heading, {*ACTION_WORDS, REQUIREMENTS})] for heading in table.actions]
    for row in table.rows:
        for texts, text in zip(left, _conditions(row, table.conditions), strict=True):
            texts.append(text)
        for texts, cell in zip(right, row.actions, strict=True):
            texts.append(spell_action(cell))
    return _as_columns(left, right, table.rows if table.traced else None)


def _turned_columns(turned: tree.Turned, table: tree.TableDecl) -> list[_Column]:
    """Return the columns of a turned table; what its DEFAULT row does stands in none."""
    left = [
        [spell_heading(heading, {"when", *(() if turned.named else ("line",))})]
        for heading in turned.conditions
    ]
    right = [[spell_across(across, turned)] for across in turned.across]
    for row in turned.rows:
        for texts, text in zip(left, _conditions(row, turned.conditions), strict=True):
            texts.append(text)
        for at, texts in enumerate(right):
            cell = () if row.default else row.actions[at]
            if turned.by is None and isinstance(cell, tree.Comparison):
                texts.append(spell_condition(cell, True))
            else:
                texts.append(spell_action(cell))
    return _as_columns(left, right, turned.rows if table.traced else None)


def _as_columns(
    left: list[list[str]], right: list[list[str]], traced: Sequence[tree.Row] | None
) -> list[_Column]:
    """Return columns, with one of requirements where lines are traced."""
    if traced is not None:
        right.append([REQUIREMENTS, *(spell_names(row.requirements) for row in traced)])
    return [_Column(texts, at < len(left)) for at, texts in enumerate((*left, *right))]


def _conditions(row: tree.Row, headings: Sequence[tree.Heading]) -> list[str]:
    if row.default:
        return [
            "DEFAULT unreachable" if row.unreachable else "DEFAULT",
            *([""] * (len(headings) - 1)),
        ]
    return [
        "" if cell is None else spell_condition(cell, heading.subject is None)
        for cell, heading in zip(row.conditions, headings, strict=True)
    ]


# --- widths --------------------------------------------------------------------------


def _total(widths: Sequence[int], stub: int) -> int:
    """Return the length of a row: each column has a bar and two blanks, and there is one bar more in `||`."""
    return 2 + sum(width + 3 for width in (stub, *widths))


def _length(columns: Sequence[_Column], stub: int) -> int:
    return _total([column.width for column in columns], stub)


def _parts(columns: list[_Column], width: int, stub: int, *, whole: bool) -> list[list[_Column]]:
    """Divide the columns into parts, and set their widths; conditions and actions together where the table is a `whole`, as a matrix is."""
    if _length(columns, stub) <= width:
        return [columns]
    parted = list(_side(columns, width, stub)) if whole else _parted(columns, width, stub)
    natural = [column.width for column in columns]
    if _total([column.least for column in columns], stub) > width:
        for part in parted:
            _fit(part, width, stub)
        return parted
    _fit(columns, width, stub)
    needed, narrow = _rows_of([columns]), [column.width for column in columns]
    _widen(columns, natural)
    for part in parted:
        _fit(part, width, stub)
    if needed <= _rows_of(parted):
        _widen(columns, narrow)
        return [columns]
    return parted


def _parted(columns: list[_Column], width: int, stub: int) -> list[list[_Column]]:
    """Divide the columns: conditions from actions, unless the last conditions leave room for the first actions."""
    conditions = list(_side([column for column in columns if column.is_condition], width, stub))
    actions = list(_side([column for column in columns if not column.is_condition], width, stub))
    if len(conditions) > 1 and actions:
        both = [*conditions[-1], *actions[0]]
        if _total([column.least for column in both], stub) <= width:
            return [*conditions[:-1], both, *actions[1:]]
    return [*conditions, *actions]


def _widen(columns: Sequence[_Column], widths: Sequence[int]) -> None:
    for column, width in zip(columns, widths, strict=True):
        column.width = width


def _side(columns: list[_Column], width: int, stub: int) -> Iterator[list[_Column]]:
    """Yield the columns of one side, in as few parts as possible: each takes what fits when all is broken."""
    part: list[_Column] = []
    for column in columns:
        least = [each.least for each in (*part, column)]
        if part and _total(least, stub) > width:
            yield part
            part = []
        part.append(column)
    if part:
        yield part


def _fit(columns: Sequence[_Column], width: int, stub: int) -> None:
    """Make columns narrower until the row fits, or nothing can be broken any more."""
    heights = _heights(columns)
    while _length(columns, stub) > width:
        offers = []
        for at, column in enumerate(columns):
            narrower = column.narrower()
            if narrower is not None:
                needs = column.heights(narrower)
                more = sum(max(0, need - have) for need, have in zip(needs, heights, strict=True))
                saved = column.width - narrower
                offers.append((more / saved, -saved, at, narrower))
        if not offers:
            return
        _, _, at, columns[at].width = min(offers)
        heights = _heights(columns)


def _heights(columns: Sequence[_Column]) -> list[int]:
    """Return the number of rows that the heading and each line need."""
    return [max(of) for of in zip(*(column.heights(column.width) for column in columns), strict=True)]


def _rows_of(parts: Sequence[Sequence[_Column]]) -> int:
    """Return the number of rows of all parts, separators included."""
    return sum(1 + sum(_heights(part)) for part in parts)


# --- text ----------------------------------------------------------------------------


def _part(
    names: Sequence[str],
    stub: int,
    columns: Sequence[_Column],
    rows: Sequence[tree.Row],
    once: Mapping[int, tree.Row],
) -> Iterator[tuple[tree.Row | None, str]]:
    """Yield the rows of a part; those that stand `once` have one cell after `||`, and none in further parts, which have no `rows`."""
    texts = [column.pieces(column.width) for column in columns]
    for number, name in enumerate(names):
        pieces = [broken[number] for broken in texts]
        above = rows[number - 1] if rows and number else None
        if number in once:
            found = _default_row(name, stub, once[number], pieces, columns) if rows else ()
            yield from ((None if at else above, text) for at, text in enumerate(found))
            continue
        for at in range(max(map(len, pieces), default=1)):
            shown = [piece[at] if at < len(piece) else "" for piece in pieces]
            yield above if not at else None, _row(name if not at else "", stub, shown, columns)
        if not number:
            dashes = ["-" * column.width for column in columns]
            yield None, _row("-" * stub, stub, dashes, columns).replace(" ", "-")


def _default_row(
    name: str, stub: int, row: tree.Row, pieces: Sequence[Sequence[str]], columns: Sequence[_Column]
) -> Iterator[str]:
    """Yield the rows of the DEFAULT row of a turned table: what it does, over all columns, and its requirements."""
    tests = [column for column in columns if column.is_condition]
    wide = [column.width for column in columns if not column.is_condition and column.texts[0] != REQUIREMENTS]
    says = [spell_action(row.actions[0]).ljust(sum(wide) + 3 * (len(wide) - 1))]
    if row.requirements:
        traced = next((column.width for column in columns if column.texts[0] == REQUIREMENTS), 0)
        says.append(spell_names(row.requirements).ljust(traced))
    for at in range(max((len(piece) for piece in pieces[: len(tests)]), default=1)):
        shown = [piece[at] if at < len(piece) else "" for piece in pieces[: len(tests)]]
        yield f"{_row('' if at else name, stub, shown, tests)} {' | '.join(says)} |"
        says = [" " * len(text) for text in says]


def _row(name: str, stub: int, texts: Sequence[str], columns: Sequence[_Column]) -> str:
    padded = [(column, text.ljust(column.width)) for column, text in zip(columns, texts, strict=True)]
    left = " | ".join([name.ljust(stub), *(text for column, text in padded if column.is_condition)])
    right = " | ".join(text for column, text in padded if not column.is_condition)
    return f"| {left} ||" + (f" {right} |" if right else "")
