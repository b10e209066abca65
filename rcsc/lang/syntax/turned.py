"""Tables that are printed the other way round: the lines that they come to.

In: a `Turned` table. Out: the headings and lines of an ordinary one, which is all that later stages see. Each cell that says something is
a line: the conditions of its row and of its column, or its row's and its own, and one action. Its parts keep the places where they are
printed, and its name is made of those of its row and its column: `idle_stop`.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import STUB, Cell, stub_of

_TOKEN = re.compile(r"\w+|/=|<=|>=|:=|\.\.|<<|>>|[<>+*/&-]", re.ASCII)
_SAID = {
    "/=": "not", "<": "below", "<=": "up_to", ">": "above", ">=": "from", "..": "to", "<<": "left", ">>": "right", "+": "plus",
    "-": "minus", "*": "times", "/": "per", "&": "and", ":=": "", "in": "",
}  # fmt: skip
"""How a name says what is no word."""
NOBODY = "any"
"""The name of a row without conditions."""
NOTHING = "none"
"""The name of a column whose result is `-`: nothing is done."""
NAMELESS_DEFAULT = "default"
ALL = "all"
_NAMED = re.compile(r"(?P<stub>[^:(){}]*?)\s*:(?!=)\s*")
NAMES_APART = "give one of them another name: `NAME` under `line`, or `NAME : ...` in a heading"


def name_of(texts: Sequence[str]) -> str:
    """Return a name for cells, made of what they say.

    >>> name_of(["idle"]), name_of(["in {halt, reset}"]), name_of([">= 3", "not done"]), name_of([""])
    ('idle', 'halt_reset', 'from_3_not_done', 'any')
    """
    words = (word for text in texts for word in _TOKEN.findall(text))
    return "_".join(filter(None, (_SAID.get(word, word).strip("_") for word in words))) or NOBODY


def heading_of(cell: Cell, *, of: bool) -> tuple[Cell | None, Cell, bool]:
    """Take a column's heading apart: its name and marks if it is given one, what it says, and whether that stands after `when`.

    A condition may do so that is not `of` what the columns are by.

    >>> [part and part.text for part in heading_of(Cell("ready above all : when done", "", 0), of=True)[:2]]
    ['ready above all', 'done']
    >>> [part and part.text for part in heading_of(Cell("stop above all", "", 0), of=True)[:2]]
    ['stop above all', 'stop']
    """
    named = _NAMED.match(cell.text)
    found = stub_of(cell)
    stub: Cell | None = None
    said = cell
    if named is not None and STUB.match(named["stub"]):
        stub, said = cell.part(0, named.end("stub")), cell.part(named.end(), len(cell.text))
    elif found.above or found.same:
        stub, said = cell, found.name
    if of and said.text.startswith("when "):
        return stub, said.part(len(said.text) - len(said.text[5:].lstrip()), len(said.text)), True
    return stub, said, False


def crossed(
    turned: tree.Turned,
) -> tuple[tuple[tree.Heading, ...], tuple[tree.Heading, ...], tuple[tree.Row, ...]]:
    """Return the condition headings, action headings and lines of a turned table."""
    lines = list(_lines(turned))
    names = {line.name for _, _, line in lines}
    seen: set[int] = set()
    marked = []
    for row, across, line in lines:
        marks = {id(each): id(each) not in seen for each in (row, across)}
        seen |= marks.keys()
        above, same = (
            tuple(_others(turned, (row, across), names, word, marks)) for word in ("above", "same")
        )
        comments = row.comments if marks[id(row)] else ()
        marked.append(replace(line, above=above, same=same, comments=comments))
    blank = (None,) * len(_more(turned))
    last = [replace(row, conditions=(*row.conditions, *blank)) for row in turned.rows if row.default]
    conditions = (*turned.conditions, *_more(turned))
    return conditions, (turned.giving,), (*marked, *(_shaped(row, len(conditions)) for row in last))


def places(turned: tree.Turned) -> Iterator[tuple[int, int]]:
    """Yield row and column of each cell that is a line: of all that say something, but for *never*."""
    never = tree.Comparison("=", tree.BoolLiteral(False))
    for at, row in enumerate(turned.rows):
        for column in () if row.default else range(len(turned.across)):
            said = row.actions[column]
            if said and not (turned.by is None and said == never):
                yield at, column


def unsaid_places(turned: tree.Turned) -> Iterator[tuple[int, int]]:
    """Yield row and column of where lines may be missing: empty cells where cells are actions, then rows, whose column is -1."""
    rows = [(at, row) for at, row in enumerate(turned.rows) if not row.default]
    for at, row in rows if turned.by is not None else ():
        yield from ((at, column) for column in range(len(turned.across)) if not row.actions[column])
    yield from ((at, -1) for at, _ in rows)


def unsaid(turned: tree.Turned) -> Iterator[tree.Row]:
    """Yield, as lines that do nothing, where lines may be missing."""
    blank = (None,) * len(_more(turned))
    for at, column in unsaid_places(turned):
        row = turned.rows[at]
        if column < 0:
            yield replace(row, conditions=(*row.conditions, *blank), actions=())
        else:
            yield _cross(turned, row, column, turned.across[column])


def _more(turned: tree.Turned) -> tuple[tree.Heading, ...]:
    """Return the headings that stand for the columns, or for what their cells say."""
    whole = next((across.place for across in turned.across if across.whole), None)
    if turned.by is None:
        place = turned.giving.cell
        return (tree.Heading(None, "when", Cell("when", place.file, place.start)),)
    if whole is None:
        return (turned.by,)
    return (turned.by, tree.Heading(None, "when", Cell("when", whole.file, whole.start)))


def _shaped(row: tree.Row, conditions: int) -> tree.Row:
    """Return the DEFAULT row with a cell for each column."""
    first, *cells = row.cells
    missing = (Cell("", first.file, first.start),) * (1 + conditions - len(cells))
    return replace(row, cells=(first, *cells[:-1], *missing, cells[-1]))


def _lines(turned: tree.Turned) -> Iterator[tuple[tree.Row, tree.Across, tree.Row]]:
    """Yield the lines of a table without their marks, each with its row and its column."""
    for at, column in places(turned):
        row, across = turned.rows[at], turned.across[column]
        yield row, across, _cross(turned, row, column, across)


def _cross(turned: tree.Turned, row: tree.Row, column: int, across: tree.Across) -> tree.Row:
    said = row.actions[column]
    cells = row.cells[: 1 + len(row.conditions)]
    here = row.cells[1 + len(row.conditions) + column]
    name = f"{row.name}_{across.name}"
    if turned.by is None:
        assert isinstance(said, tree.Comparison)
        assert isinstance(across.said, tuple | tree.Comparison)
        test = None if said == tree.Comparison("=", tree.BoolLiteral(True)) else said
        conditions, actions = (*row.conditions, test), (across.said,)
        cells = (here, *cells[1:], here, across.cell)
    else:
        assert not isinstance(across.said, tuple)
        tests = (None, across.said) if across.whole else (across.said, None)
        conditions, actions = (*row.conditions, *tests[: len(_more(turned))]), (said,)
        cells = (here, *cells[1:], *(across.cell,) * len(_more(turned)), here)
    return replace(
        row, name=name, conditions=conditions, actions=actions, span=here.span, cells=cells, above=(), same=()
    )


def _others(
    turned: tree.Turned,
    marked: tuple[tree.Row, tree.Across],
    names: Collection[str],
    word: str,
    first: Mapping[int, bool],
) -> Iterator[tree.Name]:
    """Yield the lines that a line is said to stand above, or to do the same as.

    Its row names rows, and means the lines of the same column; its column names columns, and means those of the same row; both may
    name a line, or `all`. What is none of these stands with the first line alone, where it is reported.
    """
    row, across = marked
    rows = row, [each.name for each in turned.rows if not each.default], "{}_" + across.name
    columns = across, [each.name for each in turned.across], row.name + "_{}"
    each: tree.Row | tree.Across
    for each, kind, form in (rows, columns):
        for other in each.above if word == "above" else each.same:
            there = form.format(other.text)
            elsewhere = other.text != each.name and other.text in kind
            if elsewhere and there in names:
                yield tree.Name(there, other.span)
            elif other.text in names or other.text == ALL or (first[id(each)] and not elsewhere):
                yield other
