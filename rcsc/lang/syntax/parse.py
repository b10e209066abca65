"""Text to tree; the only importer of Lark.

In: a `Source`. Out: a `tree.File`, or every syntax error that was found. No text makes it raise.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, TypeAlias, cast

import lark

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files import write_atomically
from rcsc.lang.syntax import screen, tree
from rcsc.lang.syntax.build import Build
from rcsc.lang.syntax.comments import Comments, words
from rcsc.lang.syntax.expected import (
    ELSEWHERE,
    PARTS_CALLS,
    expected,
    missing_word,
    operator_meant,
    word_meant,
)
from rcsc.lang.syntax.rows import (
    ACTION_WORDS,
    BITS,
    CALL,
    CALL_UNDER,
    COLUMNS,
    EMPTY_CELL,
    IN_QUOTES,
    LAST_BAR,
    MARKS,
    NAMED_FIELDS,
    NEW_PART,
    NO_HEADING,
    NO_LAST_BAR,
    ONCE,
    ONE_GROUP,
    ORDER,
    PARTED,
    PIECES,
    PLAIN,
    REQUIREMENTS,
    ROW_NAMES,
    SAME_LINES,
    STUB,
    TO_WHOM,
    Cell,
    Cells,
    LineCells,
    Side,
    Stub,
    conjuncts,
    cut,
    joined,
    parts,
    stub_of,
)
from rcsc.lang.syntax.saved import loadable, saved
from rcsc.lang.syntax.turned import NAMELESS_DEFAULT, NAMES_APART, NOTHING, crossed, heading_of, name_of

MOST_ERRORS = 20
MOST_CONJUNCTS = 100
"""In one cell, up to which each is parsed by itself: all of them nest less deep than a condition may."""


_SAVED = "rcs.parser.json"
"""Lark's parser of the grammar; `python -m rcsc.lang.syntax.parse` makes it anew after a change of the grammar."""
ParseNode: TypeAlias = lark.Tree[lark.Token]
ParseLeaf: TypeAlias = lark.Token


def _grammar_folder() -> Path:
    """Return the folder of the grammar: inside the wheel's package, or beside it."""
    packaged = Path(__file__).parents[2] / "_data" / "grammar"
    return packaged if packaged.is_dir() else Path(__file__).parents[3] / "grammar"


@cache
def _grammar_text() -> str:
    return (_grammar_folder() / "rcs.lark").read_text(encoding="utf-8")


@cache
def _parser() -> lark.Lark:
    """Return the parser that is kept beside the grammar; if it is of an older grammar, have Lark make it."""
    kept = _grammar_folder() / _SAVED
    it = loadable(kept.read_text(encoding="utf-8"), _digest()) if kept.is_file() else None
    return made() if it is None else lark.Lark.load(it)


def ready() -> None:
    """Prepare the parser, which takes longer than to parse a hundred correct texts."""
    _parser()


def made() -> lark.Lark:
    """Return the LALR parser of the grammar, made by Lark."""
    starts = ["file", "cell", "when", "heading", "requirements", "actions"]
    return lark.Lark(_grammar_text(), parser="lalr", start=starts, propagate_positions=True)


def _digest() -> str:
    return hashlib.sha256(_grammar_text().encode()).hexdigest()


def _parsed(text: str, start: str) -> ParseNode:
    """Return the parse tree of a text by one of the start rules.

    Raises:
        lark.UnexpectedInput: The text has no tree.
    """
    return _parser().parse(text, start=start)


@lru_cache(maxsize=128)  # one run reads a file for each root that uses it, and a shell at each reload
def parse(source: Source) -> tree.File | tuple[Diagnostic, ...]:
    """Return the tree of `source`, or what is wrong with its text.

    After an error parsing goes on with the next declaration, so that one run reports several.
    """
    refused = screen.refuse(source)
    if refused:
        return refused
    pieces = _Pieces(source)
    diagnostics = pieces.parse()
    diagnostics += [screen.too_deep(source, *place) for node in pieces.nodes if (place := _deep_in(node))]
    if diagnostics:
        return tuple(diagnostics[:MOST_ERRORS])
    comments = Comments(source)
    build = Build(source.name, comments, _Rows(source, comments, diagnostics))
    declarations = tuple(build.declaration(node) for node in pieces.nodes)
    if diagnostics:
        return tuple(diagnostics[:MOST_ERRORS])
    return tree.File(declarations, tuple(words(text) for text in comments.rest()), source.name)


def _begin(leaf: ParseLeaf) -> int:
    assert leaf.start_pos is not None  # as it was read from a text
    return leaf.start_pos


def _deep_in(root: ParseNode) -> tuple[int, int] | None:
    """Return start and end of the first node that lies too deep; where there is none, later stages may recurse at each depth."""
    waiting = [(root, 0)]
    while waiting:
        node, depth = waiting.pop()
        if depth > screen.DEEPEST:
            return node.meta.start_pos, node.meta.start_pos + 1
        deeper = depth + (node.data not in ("block", "arm"))
        waiting.extend((child, deeper) for child in reversed(node.children) if isinstance(child, lark.Tree))
    return None


@dataclass(slots=True)
class _Pieces:
    """The declarations of one text, parsed together or, after an error, from keyword to keyword."""

    source: Source
    nodes: list[ParseNode] = field(default_factory=list)

    def parse(self) -> list[Diagnostic]:
        """Fill `nodes`; return the syntax errors."""
        text, offset = self.source.text, 0
        diagnostics: list[Diagnostic] = []
        while len(diagnostics) < MOST_ERRORS:
            blank = screen.blank_before(text, offset)
            try:
                self.nodes.extend(cast("list[ParseNode]", _parsed(blank, "file").children))
                return diagnostics
            except lark.UnexpectedInput as error:
                diagnostics.append(_syntax_error(error, self.source.name, 0, len(text), text))
                offset = screen.next_declaration(text, diagnostics[-1].primary.span.start, offset)
            if offset >= len(text):
                break
        return diagnostics


def _syntax_error(error: lark.UnexpectedInput, file: str, start: int, end: int, text: str) -> Diagnostic:
    """Describe the word found and the words expected; the parsed text begins at `start` of the file."""
    at = cast("int | None", error.pos_in_stream) or 0
    position, word = start + at, ""
    wanted: set[str] = set()
    if isinstance(error, lark.UnexpectedToken):
        wanted = set(cast("set[str] | None", error.accepts) or error.expected)
        if error.token.type == "$END":
            position = end
        else:
            position, word = start + (error.token.start_pos or 0), str(error.token)
    elif isinstance(error, lark.UnexpectedCharacters):
        wanted = set(error.allowed or ())
        word = text[at] if at < len(text) else ""
    meant = operator_meant(text, position - start) if word else None
    if meant is not None:
        begin, operator = meant
        there = Span(file, start + begin, start + begin + len(operator))
        return _error(
            Code.SYNTAX, f"there is no operator `{operator}`", there, f"write `{ELSEWHERE[operator]}`"
        )
    if word and not word.isascii():
        message = f"`{word}` is not allowed here: names are made of ASCII letters, digits and `_`"
        return _error(Code.NON_ASCII_NAME, message, Span(file, position, position + len(word)))
    seen = f"`{screen.shortened(word)}`" if word else "the end of the text"
    near = word_meant(word, wanted)
    helps = f"did you mean `{near}`?" if near else missing_word(word, wanted)
    return _error(
        Code.SYNTAX,
        f"expected {expected(wanted)}, found {seen}",
        Span(file, position, position + len(word)),
        *([helps] if helps else []),
    )


def _end_of(row: str, there: Span) -> Span:
    """Return the place of the last character of a row, before what is said aside of it."""
    end = there.start + len(row.partition("#")[0].rstrip())
    return Span(there.file, end - 1, end)


def _left_out(above: Cell) -> tuple[str, ...]:
    """Return a help that names what stands above the first cell that a row has not; none where that is empty."""
    shown = screen.shortened(above.text)
    return (
        (f"nothing stands below `{shown}`: a row ends with `|` after its last cell, be it empty",)
        if shown
        else ()
    )


def _error(code: Code, message: str, span: Span, *helps: str) -> Diagnostic:
    return Diagnostic(code, message, Label(span), help=helps)


def _says_default(cell: Cell) -> bool:
    return cell.text.startswith("DEFAULT") and cell.text.split() in (["DEFAULT"], ["DEFAULT", "unreachable"])


def _once(cells: Cells, *, named: bool) -> bool:
    """Return whether a row of a turned table is DEFAULT, whose cell after `||` is for all columns."""
    return len(cells.conditions) > named and _says_default(cells.conditions[named])


@dataclass(frozen=True, slots=True)
class _Line:
    """A line of a table: its first row, from start to end, its cells of one part or of all, and its comments."""

    start: int
    end: int
    cells: Cells
    comments: tuple[str, ...]


def _over(pieces: Sequence[_Line]) -> _Line:
    """Join the parts of a line into one line."""
    first, *more = pieces
    conditions = [cell for line in more for cell in line.cells.conditions[1:]]
    cells = Cells(
        (*first.cells.conditions, *conditions), tuple(cell for line in pieces for cell in line.cells.actions)
    )
    return _Line(
        first.start, first.end, cells, tuple(comment for line in pieces for comment in line.comments)
    )


_NO_COMMENTS = Comments(Source("", ""))
"""The comments of a cell, which has none."""


@lru_cache(maxsize=8192)  # an editor reads a text at every key, and of its cells the key has changed one
def _meant(text: str, start: str) -> Any:
    """Return the meaning of a cell's text by one of the start rules; None where it nests too deep.

    Raises:
        lark.UnexpectedInput: The text has no meaning.
    """
    node = _parsed(text, start)
    return None if _deep_in(node) else Build("", _NO_COMMENTS, None).cell(node)


@dataclass(slots=True)
class _Rows:
    """Parses the rows of a table; each distinct cell text once.

    Attributes:
        memory: The parsed cells, by start rule and text.
        meant: The sound condition cells, by their text with its blanks: those under `when`, and others.
    """

    source: Source
    comments: Comments
    diagnostics: list[Diagnostic]
    memory: dict[tuple[str, str], Any] = field(default_factory=dict)
    meant: Mapping[bool, dict[str, tree.Condition | None]] = field(
        default_factory=lambda: {True: {}, False: {}}
    )

    def table(
        self, rows: list[ParseLeaf]
    ) -> tuple[tuple[tree.Heading, ...], tuple[tree.Heading, ...], tuple[tree.Row, ...], bool]:
        """Return condition headings, action headings and lines of a table, and whether it has a column of requirements."""
        read = [self._part(groups[0], groups[1:]) for groups in parts(rows)]
        heads = [part[0] for part in read if part is not None]
        if len(heads) < len(read):
            return (), (), (), False
        conditions = tuple(self._heading(cell, "when") for head in heads for cell in head.conditions[1:])
        headings = [cell for head in heads for cell in head.actions]
        traced = self._traced(headings)
        actions = tuple(self._heading(cell, "") for at, cell in enumerate(headings) if at != traced)
        lines = self._across([part[1] for part in read if part is not None], heads)
        named = tuple(self._row(line, conditions, actions, traced) for line in lines)
        return conditions, actions, named, traced is not None

    def turned(
        self, rows: list[ParseLeaf], by: tuple[int, int] | None, giving: tuple[int, int]
    ) -> tuple[
        tuple[tree.Heading, ...], tuple[tree.Heading, ...], tuple[tree.Row, ...], bool, tree.Turned | None
    ]:
        """Return the same of a table that is turned, and how it is printed; nothing after an error."""
        sound = len(self.diagnostics)
        subject = None if by is None else self._heading(self._between(*by), "when")
        given = self._heading(self._between(*giving), "")
        read = [self._part(groups[0], groups[1:], turned=True) for groups in parts(rows)]
        heads = [part[0] for part in read if part is not None]
        named = bool(heads) and heads[0].conditions[0].text == "line"
        if len(heads) == len(read) and len(self.diagnostics) == sound:
            lines = self._across_parts([part[1] for part in read if part is not None], heads, named=named)
            cells = [cell for at, head in enumerate(heads) for cell in head.conditions[named or at > 0 :]]
            conditions = tuple(self._heading(cell, "when") for cell in cells)
            headings = [cell for head in heads for cell in head.actions]
            traced = self._traced(headings)
            columns = [cell for at, cell in enumerate(headings) if at != traced]
            across = tuple(self._column(cell, subject, given) for cell in columns)
            if not across:
                self._report(Code.SYNTAX, "this table has no column after `||`", heads[0].last, COLUMNS)
            shape = tree.Turned(subject, given, named, conditions, across, ())
            shape = replace(shape, rows=tuple(self._turned_row(line, shape, traced) for line in lines))
            if len(self.diagnostics) == sound:
                crossing = crossed(shape)
                self._report_twice([(each.name, each.place, "columns") for each in across])
                self._report_twice([(each.name, each.cells[0], "rows") for each in shape.rows])
                if len(self.diagnostics) == sound:
                    self._report_twice([(each.name, each.cells[0], "cells") for each in crossing[2]])
                return *crossing, traced is not None, shape
        return (), (), (), False, None

    def _between(self, start: int, end: int) -> Cell:
        """Return what stands between two places, as the cell of a heading."""
        text = self.source.text[start:end]
        return Cell(text.strip(), self.source.name, start + len(text) - len(text.lstrip()))

    def _across_parts(self, read: list[list[_Line]], heads: list[Cells], *, named: bool) -> list[_Line]:
        """Return the rows of a turned table, each with its cells of all parts; DEFAULT stands in the first alone."""
        first, *more = read
        once = [_once(line.cells, named=named) for line in first]
        others = [line for line, alone in zip(first, once, strict=True) if not alone]
        for line, alone in zip(first[:-1], once, strict=False):
            if alone:
                self._report(
                    Code.DEFAULT_ELSEWHERE, "DEFAULT is the last row", line.cells.conditions[0], ONCE
                )
        whole = iter(self._across([others, *more], heads))
        return (
            []
            if self.diagnostics
            else [line if alone else next(whole) for line, alone in zip(first, once, strict=True)]
        )

    def _column(self, cell: Cell, subject: tree.Heading | None, given: tree.Heading) -> tree.Across:
        """Return a column of a turned table, of its heading."""
        stub, said, whole = heading_of(cell, of=subject is not None and subject.subject is not None)
        marks = Stub(Cell("", "", 0)) if stub is None else stub_of(stub)
        what: tree.Condition | tuple[tree.Statement, ...] = ()
        if subject is None and said.text:
            what = self._action(said.blank(), given)
        elif subject is None or not said.blank().text:
            self._report(Code.SYNTAX, "this column has no heading", cell, COLUMNS)
        elif _says_default(said):
            self._report(Code.DEFAULT_ELSEWHERE, "no column is DEFAULT", said, ONCE)
        else:
            heading = tree.Heading(None, "when", cell) if whole else subject
            what = self._condition(said, heading) or ()
        name = marks.name.text or (NOTHING if said.text == "-" else name_of([said.text]))
        above, same = (
            tuple(tree.Name(each.text, each.span) for each in of) for of in (marks.above, marks.same)
        )
        return tree.Across(name, what, stub is not None, whole, above, same, said, cell)

    def _turned_row(self, line: _Line, shape: tree.Turned, traced: int | None) -> tree.Row:
        cells = line.cells
        tests = [cell.blank() for cell in cells.conditions[shape.named :]]
        default = self._default(tests)
        stub = stub_of(cells.conditions[0].blank()) if shape.named else Stub(cells.conditions[0])
        name = NAMELESS_DEFAULT if default is not None else name_of([cell.text for cell in tests])
        name = stub.name.text if shape.named else name
        if default is None:
            required = cells.actions[traced] if traced is not None else None
            does = [cell.blank() for at, cell in enumerate(cells.actions) if at != traced]
            actions = tuple(
                self._action(cell, shape.giving) if shape.by is not None else self._says(cell)
                for cell in does
            )
        else:
            said = [cell for each in cells.actions if (cell := each.blank()).text]
            required = next((cell for cell in said if cell.text.startswith('"')), None)
            does = [cell for cell in said if cell is not required]
            for cell in does[1:]:
                self._report(
                    Code.DEFAULT_WITH_CONDITIONS, "a DEFAULT row has one cell after `||`", cell, ONCE
                )
            does = does[:1] or [Cell("", self.source.name, line.end)]
            tests += [Cell("", self.source.name, line.end)] * (len(shape.conditions) - len(tests))
            actions = (self._action(does[0], shape.giving),)
        return tree.Row(
            name,
            tuple(
                None if default is not None else self._condition(cell, heading)
                for cell, heading in zip(tests, shape.conditions, strict=True)
            ),
            actions,
            default is not None,
            default is not None and default.text.endswith("unreachable"),
            Span(self.source.name, line.start, line.end),
            (stub.name, *tests, *does),
            line.comments,
            tuple(tree.Name(lower.text, lower.span) for lower in stub.above),
            tuple(tree.Name(other.text, other.span) for other in stub.same),
            () if required is None else self._requirements(required.blank()),
        )

    def _says(self, cell: Cell) -> tree.Comparison | tuple[tree.Statement, ...]:
        """Return the condition in a cell below a result."""
        if _says_default(cell):
            self._report(Code.DEFAULT_ELSEWHERE, "this cell is a condition", cell, ONCE)
        return cast("tree.Comparison | None", self._condition(cell, tree.Heading(None, "when", cell))) or ()

    def _report_twice(self, named: Sequence[tuple[str, Cell, str]]) -> None:
        """Report names that two rows, columns or cells of a turned table have."""
        first: dict[str, Cell] = {}
        for name, cell, kind in named:
            if name in first:
                label = Label(first[name].span, "the first")
                wrong = _error(Code.DUPLICATE_LINE, f"two {kind} are called `{name}`", cell.span, NAMES_APART)
                self.diagnostics.append(replace(wrong, related=(label,)))
            first.setdefault(name, cell)

    def _traced(self, headings: Sequence[Cell]) -> int | None:
        """Return the position of the column of requirements among those after `||`."""
        traced = [at for at, cell in enumerate(headings) if cell.text == REQUIREMENTS]
        for at in traced[1:]:
            self._report(Code.SYNTAX, "a table has at most one column `req`", headings[at], IN_QUOTES)
        return traced[0] if traced else None

    def _part(
        self, head: list[ParseLeaf], groups: list[list[ParseLeaf]], *, turned: bool = False
    ) -> tuple[Cells, list[_Line]] | None:
        """Return the heading of a part, and its lines; a table that is turned may begin with another heading than `line`."""
        cells = self._whole(head)
        if cells is None:
            return None
        named = cells.conditions[0].text == "line"
        if not named and not turned:
            self._report(Code.SYNTAX, "the first heading of a table is `line`", cells.conditions[0])
        lines = [
            line
            for rows in groups
            if (line := self._line(rows, cells, turned=turned, named=named or not turned)) is not None
        ]
        return cells, lines

    def _line(self, rows: list[ParseLeaf], head: Cells, *, turned: bool, named: bool) -> _Line | None:
        cells = self._whole(rows)
        once = turned and cells is not None and _once(cells, named=named)
        if cells is None or not self._even(
            rows[0], cells, replace(head, actions=cells.actions) if once else head, "the heading"
        ):
            return None
        stub = cells.conditions[0]
        if not named and not stub.blank().text:
            self._report(Code.SYNTAX, "this row begins without a condition", stub, ROW_NAMES)
        if named and not STUB.match(stub.text):
            helps = (MARKS,) if " " in stub.text else ()
            self._report(Code.SYNTAX, "a line needs a name of letters, digits and `_`", stub, *helps)
        comments = tuple(words(text) for row in rows for text in self.comments.take(_begin(row)))
        return _Line(_begin(rows[0]), cells.last.ends[1], cells, comments)

    def _whole(self, rows: list[ParseLeaf]) -> Cells | None:
        """Return a row, joined with the rows that go on with it."""
        cells = above = self._cut(rows[0])
        for row in rows[1:]:
            more = self._cut(row)
            if cells is None or above is None or more is None:
                return None
            if not self._even(row, more, above, "the row above, with which it goes on,"):
                return None
            if not any(cell.text for cell in more.all):
                there = Span(self.source.name, _begin(row), _begin(row) + len(row.rstrip()))
                self.diagnostics.append(_error(Code.GOES_ON, "this row has nothing in it", there, PIECES))
                return None
            whole = joined(cells, more, above)
            if isinstance(whole, Cell):
                self._report(
                    Code.GOES_ON,
                    f"`{screen.shortened(whole.text)}` goes on with an empty cell",
                    whole,
                    PIECES,
                )
                return None
            cells, above = whole, more
        return cells

    def _across(self, read: list[list[_Line]], heads: list[Cells]) -> list[_Line]:
        """Return the lines, each with its cells of all parts; none where a part names other lines."""
        first = read[0]
        if len(read) == 1:
            return first
        names = [stub_of(line.cells.conditions[0]).name.text for line in first]
        for head, part in zip(heads[1:], read[1:], strict=True):
            given = [stub_of(line.cells.conditions[0]).name.text for line in part]
            for cell in (line.cells.conditions[0] for line in part):
                stub = stub_of(cell)
                if stub.above or stub.same:
                    word = "above" if stub.above else "same"
                    self._report(Code.GOES_ON, f"`{word}` stands in a further part of the table", cell, PLAIN)
            if given != names and not self.diagnostics:
                at = next(
                    (at for at, pair in enumerate(zip(given, names, strict=False)) if pair[0] != pair[1]),
                    None,
                )
                if at is None:
                    message = f"this part of the table has {len(given)} lines, the first has {len(names)}"
                    self._report(Code.GOES_ON, message, head.conditions[0], SAME_LINES)
                else:
                    message = (
                        f"this part of the table has the line `{given[at]}` where the first has `{names[at]}`"
                    )
                    self._report(Code.GOES_ON, message, part[at].cells.conditions[0], SAME_LINES)
            if given != names:
                return []
        return [_over(pieces) for pieces in zip(*read, strict=True)]

    def _cut(self, row: ParseLeaf) -> Cells | None:
        start = _begin(row)
        cells = cut(str(row), start, self.source.name)
        if isinstance(cells, str):
            whole = Span(self.source.name, start, start + len(row.rstrip()))
            open_end = cells == NO_LAST_BAR
            there = _end_of(str(row), whole) if open_end else whole
            self.diagnostics.append(
                _error(Code.RAGGED_ROW, cells, there, LAST_BAR if open_end else EMPTY_CELL)
            )
            return None
        return cells

    def _heading(self, cell: Cell, whole: str) -> tree.Heading:
        if cell.text in ({whole} if whole else ACTION_WORDS):
            return tree.Heading(None, cell.text, cell)
        parsed = self._parse("heading", cell, "" if cell.text else NO_HEADING)
        subject = tree.Reference(tree.Name(cell.text)) if parsed is None else parsed
        return tree.Heading(subject, "", cell)

    def _row(
        self,
        line: _Line,
        conditions: tuple[tree.Heading, ...],
        actions: tuple[tree.Heading, ...],
        traced: int | None,
    ) -> tree.Row:
        stub = stub_of(line.cells.conditions[0].blank())
        parsed = self._at_once(line.cells.conditions, conditions)
        default = None
        if parsed is None:
            tests = [cell.blank() for cell in line.cells.conditions[1:]]
            default = self._default(tests)
            parsed = tuple(
                None if default is not None else self._condition(cell, heading)
                for cell, heading in zip(tests, conditions, strict=True)
            )
        does = [cell for at, cell in enumerate(line.cells.actions) if at != traced]
        return tree.Row(
            stub.name.text,
            parsed,
            tuple(
                self._action(cell.blank(), heading)
                for cell, heading in zip(does, actions, strict=False)  # a second `req` is reported
            ),
            default is not None,
            default is not None and default.text.endswith("unreachable"),
            Span(self.source.name, line.start, line.end),
            LineCells(stub.name, line.cells, traced),
            line.comments,
            tuple(tree.Name(lower.text, lower.span) for lower in stub.above),
            tuple(tree.Name(other.text, other.span) for other in stub.same),
            () if traced is None else self._requirements(line.cells.actions[traced].blank()),
        )

    def _default(self, tests: Sequence[Cell]) -> Cell | None:
        """Return the cell that makes a line the DEFAULT line, else None; report what stands wrongly with it."""
        default = tests[0] if tests and _says_default(tests[0]) else None
        for cell in tests[1:]:
            if default is not None and cell.text:
                self._report(Code.DEFAULT_WITH_CONDITIONS, "a DEFAULT line has no conditions", cell)
            elif _says_default(cell):
                what = "DEFAULT stands in the first column of conditions, or nowhere"
                helps = "write `= DEFAULT` for a value of that name, `(DEFAULT)` under `when`"
                self._report(Code.DEFAULT_ELSEWHERE, what, cell, helps)
        return default

    def _at_once(
        self, cells: Sequence[Cell], headings: Sequence[tree.Heading]
    ) -> tuple[tree.Condition | None, ...] | None:
        """Return the conditions of a single row; make a cell only where its text is new.

        None where a cell says DEFAULT, or goes on in another row.
        """
        if not isinstance(cells, Side):
            return None
        texts = cells.texts[1:]
        meant = [self.meant[heading.subject is None] for heading in headings]
        try:
            return tuple([known[text] for known, text in zip(meant, texts, strict=True)])
        except KeyError:
            new = {at: cells[at + 1].blank() for at, text in enumerate(texts) if text not in meant[at]}
        if any(map(_says_default, new.values())):
            return None
        found = {at: self._condition(cell, headings[at]) for at, cell in new.items()}
        for at, cell in new.items():
            if found[at] is not None or not cell.text:  # else it was reported, as it is in each row
                meant[at][texts[at]] = found[at]
        return tuple(found[at] if at in found else meant[at][text] for at, text in enumerate(texts))

    def _requirements(self, cell: Cell) -> tuple[tree.Name, ...]:
        names = self._parse("requirements", cell, IN_QUOTES) if cell.text else None
        return tuple(replace(name, span=tree.absolute(name.span, cell)) for name in names or ())

    def _even(self, row: ParseLeaf, cells: Cells, other: Cells, called: str) -> bool:
        """Return whether a row has as many cells as another that it stands below; report it where not."""
        for side, got, want in (
            ("conditions", cells.conditions, other.conditions),
            ("actions", cells.actions, other.actions),
        ):
            if len(got) != len(want):
                start = _begin(row)
                begins = NEW_PART if cells.conditions[0].text == "line" else EMPTY_CELL
                cut_short = side == "actions" and len(got) < len(want)
                more = (PARTED,) if len(got) > len(want) else _left_out(want[len(got)]) if cut_short else ()
                self.diagnostics.append(
                    _error(
                        Code.RAGGED_ROW,
                        f"this row has {len(got)} cells of {side}, {called} {len(want)}",
                        Span(self.source.name, start, start + len(row.rstrip())),
                        begins,
                        *more,
                    )
                )
                return False
        return True

    def _condition(self, cell: Cell, heading: tree.Heading) -> tree.Condition | None:
        if not cell.text or _says_default(cell):  # which is reported
            return None
        if heading.subject is None:
            joined = self._conjunction(cell)
            if joined is not None:
                return joined
            whole = self._parse("when", cell)
            return None if whole is None else tree.Comparison("=", whole, Span("", 0, len(cell.text)))
        helps = ONE_GROUP.format(cell.text) if BITS.fullmatch(cell.text) else ""
        return cast("tree.Condition | None", self._parse("cell", cell, helps))

    def _conjunction(self, cell: Cell) -> tree.Comparison | None:
        """Return the conditions that `and` joins in a cell; each distinct one is parsed once.

        None where the cell is no such list, goes on in another row, or is wrong: then it is parsed whole.
        """
        if cell.further:
            return None
        if ("ands", cell.text) in self.memory:
            return cast("tree.Comparison", self.memory["ands", cell.text])
        places = conjuncts(cell.text)
        if not 0 < len(places) <= MOST_CONJUNCTS:
            return None
        whole: tree.Expr | None = None
        for start, end in places:
            part = self._conjunct(cell.text[start:end])
            if part is None:
                return None
            span = Span("", places[0][0], end)
            whole = part if whole is None else tree.Binary("and", whole, part, span)
        assert whole is not None
        joined = tree.Comparison("=", whole, Span("", 0, len(cell.text)), tuple(places))
        self.memory["ands", cell.text] = joined
        return joined

    def _conjunct(self, text: str) -> tree.Expr | None:
        if ("and", text) not in self.memory:
            try:
                node = _parsed(text, "when")
            except lark.UnexpectedInput:
                return None
            if _deep_in(node):
                return None
            self.memory["and", text] = Build("", _NO_COMMENTS, None).cell(node)
        return cast("tree.Expr", self.memory["and", text])

    def _action(self, cell: Cell, heading: tree.Heading) -> tuple[tree.Statement, ...] | tree.Comparison:
        if not cell.text:
            return ()
        if heading.subject is None:
            order = ORDER.search(cell.text) if ":=" in cell.text else None
            helps = TO_WHOM.format(order[1]) if order is not None else ""
            return cast("tuple[tree.Statement, ...]", self._parse("actions", cell, helps) or ())
        helps = CALL_UNDER if CALL.match(cell.text) else ""
        if helps and (order := ORDER.match(cell.text)) is not None:
            helps = f"{NAMED_FIELDS.format(order[1])}; {helps}"
        value = self._parse("when", cell, helps)
        return () if value is None else tree.Comparison("=", value, Span("", 0, len(cell.text)))

    def _parse(self, start: str, cell: Cell, helps: str = "") -> Any:
        """Return the parsed cell, from memory where the text is known; None after an error, which then has the help `helps`."""
        if (start, cell.text) in self.memory:
            return self.memory[start, cell.text]
        try:
            parsed = _meant(cell.text, start)
        except lark.UnexpectedInput as error:
            wrong = _syntax_error(error, "", 0, len(cell.text), cell.text)
            wrong = replace(wrong, primary=Label(tree.absolute(wrong.primary.span, cell)))
            if cell.further:
                wrong = replace(wrong, help=(*wrong.help, PIECES))
            kept = not helps or PARTS_CALLS in wrong.help
            self.diagnostics.append(wrong if kept else replace(wrong, help=(helps,)))
            return None
        if parsed is None:
            self.diagnostics.append(screen.too_deep(self.source, cell.span.start, cell.span.end))
            return None
        self.memory[start, cell.text] = parsed
        return parsed

    def _report(self, code: Code, message: str, cell: Cell, *helps: str) -> None:
        self.diagnostics.append(_error(code, message, cell.span, *helps))


if __name__ == "__main__":
    write_atomically(_grammar_folder() / _SAVED, saved(made(), _digest()).encode())
