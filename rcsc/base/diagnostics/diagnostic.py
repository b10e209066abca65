"""`Diagnostic` and `Label`: what is wrong, as data; `render` turns it into text."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span


class Severity(StrEnum):
    """The severity of a diagnostic: only errors make `rcsc` exit with 1."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Label:
    """A place and a message about it."""

    span: Span
    message: str = ""


@dataclass(frozen=True, slots=True)
class MatchedLine:
    """A table line shown beside a witness: its name and its cells, one a variable."""

    name: str
    cells: tuple[str, ...]
    span: Span | None = None


class ChangeKind(StrEnum):
    """The part of a table that a change writes."""

    CELL = "cell"  # a condition of a line; of a table printed the other way round any cell of a row
    HEADING = "heading"  # of a column
    COLUMN = "column"  # a column more, after `||`
    SAME = "same"  # after the name of a line: that it does the same as others
    LINE = "line"  # a line more
    NO_LINE = "no line"  # a line less
    UNREACHABLE = "unreachable"  # DEFAULT, declared so


@dataclass(frozen=True, slots=True)
class Change:
    """One change of a table's text, by names, so that it is true wherever the table stands.

    Attributes:
        line: The line that is changed, or the row of a table printed the other way round; empty for a new one.
        column: Position of the cell among the conditions as written, and then those after `||`; -1 for a first cell that is no name.
        texts: Of a cell or heading its text, of a new line the text of each condition (and of each cell after `||`), of `same` the
            other lines, of a new column its heading and its cell in each row.
    """

    place: ChangeKind
    line: str = ""
    column: int = 0
    texts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Proposal:
    """A change that would mend a finding; `help`, or a note, describes it for people.

    Attributes:
        title: What to do, in the imperative.
        proved: The claim that is to be proved of it.
        changes: To be made together.
        told: The text of a note: two pieces around "proved" or "not proved", or one piece without that.
        whole: Whether it is to mend all that was found of this kind: every overlap of the table, not these two lines alone.
        certain: Whether it is proved: of the text that it makes (`table.mending`).
        sure: Whether it is offered only where it is proved.
    """

    title: str
    table: str
    proved: str
    changes: tuple[Change, ...]
    told: tuple[str, ...] = ()
    whole: bool = True
    certain: bool = False
    sure: bool = False

    def closing(self) -> "Proposal":
        """Return the proposal of a line for a part of a gap, once it is known to close all of it."""
        told = tuple(each.replace("closes this part of the gap", "closes the gap") for each in self.told)
        title = self.title.replace("for some of the inputs", "for all of the inputs")
        proved = self.proved.replace("closes this part of the gap", "closes the gap")
        return replace(self, title=title, proved=proved, told=told, whole=True)

    @property
    def said(self) -> str:
        """The text that announces the proposal and its proof; "" where a help describes it in general."""
        return ("proved" if self.certain else "not proved").join(self.told)


MOST_SHOWN = 3
"""Witnesses of one finding in a text."""


@dataclass(frozen=True, slots=True)
class Effects:
    """The effects of two overlapping lines where both match.

    Attributes:
        same: Whether both do the same for every such input; None where nobody could tell.
        differ_in: Differences for some such input: other effects of the actions, then variables in declared order.
    """

    same: bool | None
    differ_in: tuple[str, ...] = ()

    def __str__(self) -> str:
        if self.same is None:
            return "whether both do the same where both match could not be decided"
        return (
            "both do the same where both match"
            if self.same
            else f"they differ in: {', '.join(_with_ranges(self.differ_in))}"
        )


def _with_ranges(names: Sequence[str]) -> list[str]:
    """Return names of variables, with consecutive elements of an array as one name.

    >>> _with_ranges(["n", "at[0].x", "at[1].x", "at[2].x", "at[2].y", "at[4].y"])
    ['n', 'at[0 .. 2].x', 'at[2].y', 'at[4].y']
    """
    told: list[str] = []
    last: tuple[str, int, int, str] | None = None
    for name in names:
        parts = _ELEMENT.fullmatch(name)
        if parts is None:
            last = None
            told.append(name)
            continue
        before, at, after = parts[1], int(parts[2]), parts[3]
        follows = last is not None and (before, at - 1, after) == (last[0], last[2], last[3])
        first = last[1] if last is not None and follows else at
        last = (before, first, at, after)
        told[-1 if follows else len(told) :] = [name if first == at else f"{before}[{first} .. {at}]{after}"]
    return told


_ELEMENT = re.compile(r"(.*)\[(\d+)\]([^\[\]]*)")
"""A name that ends in an element of an array, or in a field of one: its last index is the one that counts."""


@dataclass(frozen=True, slots=True)
class WitnessColumn:
    """A witness as a column of the table, with the lines that match it.

    Attributes:
        table: Name of the table.
        variables: The variables, in declared order.
        values: The witness's value of each variable, in the table's words.
        lines: The lines that match the witness; none for a gap.
        region: The maximal region around the witness, one condition a variable in the
            table's words; variables left out are free (`any other`).
        inputs: The number of inputs in the region; None where nobody counted.
        effects: Of two lines that overlap and have no diagnostic of their own; None for any other, and where nobody looked.
    """

    table: str
    variables: tuple[str, ...]
    values: tuple[str, ...]
    lines: tuple[MatchedLine, ...] = ()
    region: tuple[str, ...] = ()
    inputs: int | None = None
    effects: Effects | None = None

    @property
    def said(self) -> str:
        """The input in words: `cmd = 1, width_mm = 41`."""
        values = zip(self.variables, self.values, strict=True)
        return ", ".join(f"{name} = {value}" for name, value in values)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One problem, stated once; rendering lives in `render`.

    The message stands alone, starts in lower case, quotes names in backticks, ends without
    a full stop and never says how to fix: `help` does.
    """

    code: Code
    message: str
    primary: Label
    related: tuple[Label, ...] = ()
    notes: tuple[str, ...] = ()
    help: tuple[str, ...] = ()
    witnesses: tuple[WitnessColumn, ...] = ()
    more: int = 0  # witnesses of the same cause that are not shown
    severity: Severity = Severity.ERROR
    effects: Effects | None = None  # of an overlap; `notes` say it, too
    only_listed: bool = False  # witnesses stand in the JSON form alone
    told_with: bool = False  # a note of another one tells it in a text
    proposals: tuple[Proposal, ...] = ()  # `help` says them, too

    @property
    def shown(self) -> tuple[WitnessColumn, ...]:
        """The witnesses that a text shows; the JSON form has all."""
        return () if self.only_listed else self.witnesses[:MOST_SHOWN]

    @property
    def left_out(self) -> str:
        """The text about witnesses that are not shown; "" where there are none."""
        left = () if self.only_listed else self.witnesses[MOST_SHOWN:]
        inputs = self.more + sum(witness.inputs or 1 for witness in left)
        words = f"{inputs} more input{'' if inputs == 1 else 's'}" if inputs else ""
        if not left:
            return words
        regions = f"{len(left)} more region{'' if len(left) == 1 else 's'}"
        return (
            f"{words}; --json lists {regions}" if self.more else f"{words} in {regions}, which --json lists"
        )


def sort_key(diagnostic: Diagnostic) -> tuple[str, int, int, str, str]:
    """Return a key that sorts by position first, so that output is stable."""
    span = diagnostic.primary.span
    return (span.file, span.start, span.end, diagnostic.code.value, diagnostic.message)
