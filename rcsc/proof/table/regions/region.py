"""Regions of the input space, what is left of conditions in them, and the leaves of their tree.

In: clauses over one `Universe`. Out: values that `splitting` makes and `certificate` writes down. A
region is bounds on forms; a leaf of the tree says why exactly one line holds all over it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import TypeAlias

from rcsc.lang.interval_sets import meet
from rcsc.lang.model import Box, Snapshot
from rcsc.proof.table.regions.atoms import FALSE, Atom, Every, Formula, Some, every, some
from rcsc.proof.table.regions.ends import Cut
from rcsc.proof.table.regions.linear import Multipliers, Simplex

Bounds: TypeAlias = tuple[int, int]
Point: TypeAlias = dict[int, int]
"""A key for every column."""


@dataclass(frozen=True, slots=True)
class Split:
    """The next subtree has `form <= cut`, the one after it `form > cut`."""

    form: int
    cut: int


@dataclass(frozen=True, slots=True)
class Empty:
    """No rational point: the multipliers add the region's bounds up to a contradiction."""

    multipliers: Multipliers


@dataclass(frozen=True, slots=True)
class OutsideAssumption:
    """The assumption (its position in the table's list) is false all over the region."""

    assumption: int


@dataclass(frozen=True, slots=True)
class Only:
    """The line holds all over the region and no other can; -1 is DEFAULT, with at most one line."""

    line: int


@dataclass(frozen=True, slots=True)
class Counted:
    """The lines left are disjoint boxes.

    Attributes:
        count: How many keys of the forms they test the region has, all of them filled; None
            under DEFAULT, where they need not be.
        parts: For each pair of the lines, in order, the form that parts them; None for many.
    """

    count: int | None
    parts: tuple[int, ...] | None


@dataclass(frozen=True, slots=True)
class Rests:
    """A solver says that exactly one line holds all over the region."""


@dataclass(frozen=True, slots=True)
class Open:
    """Not proved: the region holds a finding, or is undecided."""


Node: TypeAlias = Split | Empty | OutsideAssumption | Only | Counted | Rests | Open


class NoWitness(Enum):
    """A solver's answer about a conjunction, where it gives no witness."""

    NONE = auto()
    UNKNOWN = auto()


Oracle: TypeAlias = Callable[["Question"], "Snapshot | NoWitness"]


@dataclass(frozen=True, slots=True)
class Question:
    """Is there an input in the region (bounds by form) at which not exactly one candidate holds?"""

    bounds: tuple[tuple[int, int, int], ...]
    candidates: tuple[int, ...]


@dataclass(slots=True)
class Search:
    """The results of a search.

    Attributes:
        nodes: The tree in preorder; a proof when there is no `Open`.
        overlaps: Each overlapping pair of lines with a point in both.
        gaps: Regions (bounds by form) that no line matches, each with a point of it.
        witnesses: Inputs a solver gave at which not exactly one line holds, not yet told apart.
        doubtful: The questions to which it gave them: other pairs may overlap in those regions, and there may be a gap, too.
        undecided: How many regions stayed undecided.
        used: Assumptions that some leaf rests on, by position.
    """

    nodes: list[Node] = field(default_factory=list)
    overlaps: dict[tuple[int, int], Point] = field(default_factory=dict)
    gaps: list[tuple[dict[int, Bounds], Point]] = field(default_factory=list)
    witnesses: list[Snapshot] = field(default_factory=list)
    doubtful: list[Question] = field(default_factory=list)
    undecided: int = 0
    used: set[int] = field(default_factory=set)

    @property
    def refuted(self) -> bool:
        """Whether there is a finding."""
        return bool(self.overlaps or self.witnesses or self.gaps)

    @property
    def proved(self) -> bool:
        """Whether exactly one line holds everywhere."""
        return not self.refuted and not self.undecided


@dataclass(frozen=True, slots=True)
class Candidate:
    """Conditions of a line (or assumption) that a region leaves open; it holds if there are none."""

    index: int
    boxes: Mapping[int, Box]
    rest: tuple[Formula, ...]

    @property
    def holds(self) -> bool:
        """Whether it holds all over the region."""
        return not self.boxes and not self.rest

    def within(self, form: int, low: int, high: int) -> "Candidate | None":
        """Restrict `form` to `low .. high`; None when it cannot hold then."""
        box = self.boxes.get(form)
        if box is None and not self.rest:
            return self
        boxes = self.boxes
        if box is not None:
            clipped = meet(box, ((low, high),))
            if not clipped:
                return None
            boxes = {**boxes, form: clipped}
            if clipped == ((low, high),):
                del boxes[form]
        rest = every(simplified(part, form, low, high) for part in self.rest)
        if rest == FALSE:
            return None
        return _merged(self.index, boxes, rest) if self.rest else Candidate(self.index, boxes, ())


def _merged(index: int, boxes: Mapping[int, Box], rest: Formula) -> Candidate | None:
    """Move atoms of the rest into the boxes; None where a box becomes empty."""
    merged, others = dict(boxes), []
    for part in rest.parts if isinstance(rest, Every) else (rest,):
        if isinstance(part, Atom):
            merged[part.form] = meet(merged[part.form], part.box) if part.form in merged else part.box
            if not merged[part.form]:
                return None
        else:
            others.append(part)
    return Candidate(index, merged, tuple(others))


def simplified(formula: Formula, form: int, low: int, high: int) -> Formula:
    """Return the formula simplified for `form` in `low .. high`."""
    match formula:
        case Atom(form=bounded, box=box):
            if bounded != form:
                return formula
            clipped = meet(box, ((low, high),))
            if not clipped:
                return FALSE
            return Every(()) if clipped == ((low, high),) else Atom(form, clipped)
        case Every(parts):
            return every(simplified(part, form, low, high) for part in parts)
        case Some(parts):
            return some(simplified(part, form, low, high) for part in parts)


def atoms(formula: Formula) -> Iterator[Atom]:
    """Yield every atom in the formula."""
    if isinstance(formula, Atom):
        yield formula
    else:
        for part in formula.parts:
            yield from atoms(part)


@dataclass(slots=True)
class Region:
    """A part of the input space that waits to be decided.

    Attributes:
        bounds: Bounds by form, where narrower than the form's range.
        plain: Lines that may hold somewhere in it and are intervals of forms, one bit each.
        cuts: Cuts at which intervals of these may end in it.
        lines: Other lines that may hold somewhere in it.
        open: Assumptions that are not known to hold all over it.
        simplex: The bounds of some ancestor; `stale` are the forms changed since.
        carve: A part of it that is to be cut out first, by form.
        rounds: Splits made to round a vertex.
        known: A leaf already found for it.
    """

    bounds: dict[int, Bounds]
    plain: int
    cuts: Sequence[Cut]
    lines: list[Candidate]
    open: list[Candidate]
    simplex: Simplex
    stale: tuple[int, ...] = ()
    carve: tuple[tuple[int, Bounds], ...] = ()
    rounds: int = 0
    known: Node | None = None

    @property
    def many(self) -> int:
        """The number of lines that may hold in it."""
        return self.plain.bit_count() + len(self.lines)
