"""Exactly one line, decided by a tree of regions: splits, and leaves that each say why.

In: a table's lines and assumptions as clauses over one `Universe`. Out: a `Search`: the tree in
preorder, overlapping pairs and a gap with points, and how much nobody could decide. A region is
split on the bound that leaves fewest candidate lines, until an assumption is false in it, no
rational point is in it, its lines are boxes that can be counted, or one line holds all over it.
Linear arithmetic is asked only where no line or several are left, or where a split leaves a
line on both sides; a solver only where a term is not linear or rounding to integers does not end.

`linear` says what is empty, `rcsc.proof.table.regions.partition` counts boxes.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import combinations
from math import prod
from typing import NamedTuple, TypeAlias

from rcsc.lang.interval_sets import meet
from rcsc.proof.solvers import smt
from rcsc.proof.table.regions import points
from rcsc.proof.table.regions.atoms import Clauses, Universe
from rcsc.proof.table.regions.ends import Cut, Ends
from rcsc.proof.table.regions.linear import Multipliers, Simplex
from rcsc.proof.table.regions.partition import Boxes, Cell, Gaps, bits_of, common, parting
from rcsc.proof.table.regions.region import (
    Bounds,
    Candidate,
    Counted,
    Empty,
    Node,
    NoWitness,
    Only,
    Open,
    Oracle,
    OutsideAssumption,
    Point,
    Question,
    Region,
    Rests,
    Search,
    Split,
    atoms,
)

_ROUNDS = 200
"""Splits in a row, made to round one vertex to integers, before a solver is asked."""
FEWEST_NODES, NODES_OF_A_LINE, MOST_NODES = 2_000, 100, 60_000
"""Nodes of a tree, by lines: what a text may cost grows with the text. The shipped tables take 400 at most; a chain of `above` over
masks can take any number."""
STEPS_OF_A_NODE = 500
"""What a node costs, in steps of Z3: both take some tenths of a millisecond."""
MOST_PAST = 64
"""Regions past that which the solver is asked about."""
_PATIENCE = 3
"""Regions left undecided by the solver, after which it is asked no more: each may cost its full time."""


Score: TypeAlias = tuple[int, int, int, int]
"""How many lines a cut leaves on one side only, how many on the lesser side; the form and the cut, less of each being better."""
NOWHERE: Score = (-1, -1, 0, 0)


class Survey(NamedTuple):
    """A region's best cut and the lines that hold all over it, found before it is split.

    Attributes:
        best: The best cut of the lines that are intervals.
        holding: The lines that hold all over it.
    """

    best: Score
    holding: list[int]


class Tree:
    """One search; `run` builds the tree."""

    def __init__(
        self,
        universe: Universe,
        lines: Sequence[Clauses],
        assumptions: Sequence[Clauses],
        oracle: Oracle,
        *,
        default: bool,
        budget: int | None = None,
        first_only: bool = False,
    ) -> None:
        """Prepare the root.

        Args:
            universe: The columns and forms that the clauses speak of.
            lines: The lines, in order.
            assumptions: The assumptions that may be used, in order.
            oracle: Asked about regions with terms that are not linear, and past the budget.
            default: Whether inputs that no line matches are allowed (a reachable DEFAULT).
            budget: How many nodes at most before the rest is left to the oracle; by the number of lines, where none is given.
            first_only: Stop at the first finding.
        """
        self.universe = universe
        self.default = default
        self.oracle = oracle
        by_lines = min(MOST_NODES, FEWEST_NODES + NODES_OF_A_LINE * len(lines))
        self.budget = by_lines if budget is None else budget
        self.first_only = first_only
        self.search = Search()
        self.past = 0
        self._singles = frozenset(universe.single)
        self._lines = lines
        possible = [(i, c) for i, c in enumerate(lines) if not c.impossible]
        plain = {i: c for i, c in possible if not c.rest and all(len(box) == 1 for _, box in c.boxes)}
        odd = [Candidate(i, dict(c.boxes), c.rest) for i, c in possible if i not in plain]
        self._ends = Ends({i: [(form, box[0]) for form, box in c.boxes] for i, c in plain.items()})
        given = [Candidate(i, dict(c.boxes), c.rest) for i, c in enumerate(assumptions)]
        cuts = [cut for cut in self._ends.cuts if universe.low[cut.form] <= cut.at < universe.high[cut.form]]
        self.root = Region({}, self._ends.everyone, cuts, odd, [c for c in given if not c.holds], Simplex())
        self.root.carve = tuple(
            (form, box[0]) for c in given for form, box in c.boxes.items() if len(box) == 1
        )
        for i, clause in enumerate(assumptions):
            if clause.impossible and self.root.known is None:
                self.root.known = OutsideAssumption(i)

    def run(self) -> Search:
        """Decide every region, in preorder; findings stand even where the rest is given up."""
        stack = [self.root]
        while stack:
            if smt.gives_up("how the lines share the inputs") or smt.charge(STEPS_OF_A_NODE):
                self.search.undecided += 1
                break
            region = stack.pop()
            node, children = self._decide(region)
            self.search.nodes.append(node)
            stack.extend(reversed(children))
            if self.first_only and self.search.refuted:
                break
        return self.search

    def _decide(self, region: Region) -> tuple[Node, list[Region]]:
        """Return a leaf, or a split and its two regions."""
        if region.known is not None:
            if isinstance(region.known, OutsideAssumption):
                self.search.used.add(region.known.assumption)
            return region.known, []
        many = region.many
        if self.default and many <= 1:
            return Only(-1), []
        survey = self._survey(region)
        if many == 1 and len(survey.holding) == 1:
            return Only(survey.holding[0]), []
        if len(self.search.nodes) > self.budget:
            return self._past(region), []
        fresh = [pair for pair in combinations(survey.holding, 2) if pair not in self.search.overlaps]
        if fresh or not many:
            return self._probe(region, survey, fresh)
        if len(survey.holding) > 1 and self._all_known(region):
            return Open(), []
        return self._narrow(region, survey)

    # --- findings ----------------------------------------------------------------------

    def _all_known(self, region: Region) -> bool:
        """Return whether no further split could find another pair (two lines hold, so there is no gap)."""
        others = self._numbers(region)
        return all(pair in self.search.overlaps for pair in combinations(others, 2))

    def _probe(
        self, region: Region, survey: Survey, pairs: list[tuple[int, int]]
    ) -> tuple[Node, list[Region]]:
        """Find a point of a region that is wrong at every point; where there is none yet, prove it empty, split it, or ask the solver."""
        multipliers = self._refute(region)
        if multipliers is not None:
            return Empty(multipliers), []
        if region.open:
            return self._split(region, *self._best(region, region.open, NOWHERE))
        if self._is_opaque(region):
            return self._ask(region), []
        point = self._point(region)
        if point is None:
            if region.rounds >= _ROUNDS:
                return self._ask(region), []
            form = self._fractional(region)
            return self._split(region, form, int(region.simplex.value(form) // 1), region.rounds + 1)
        self.search.overlaps.update(dict.fromkeys(pairs, point))
        if not region.many:
            self.search.gaps.append((region.bounds, point))
        settled = region.many == len(survey.holding)
        return (Open(), []) if settled else self._narrow(region, survey)

    def _past(self, region: Region) -> Node:
        """Leave a region past the budget to the solver while such regions are few; the rest stays undecided."""
        self.past += 1
        if self.past <= MOST_PAST:
            return self._ask(region)
        self.search.undecided += 1
        return Open()

    def _ask(self, region: Region) -> Node:
        """Ask the solver about the region; after enough regions without an answer none is asked."""
        if self.search.undecided >= _PATIENCE:
            self.search.undecided += 1
            return Open()
        bounds = tuple((form, low, high) for form, (low, high) in sorted(region.bounds.items()))
        lines = tuple(self._numbers(region))
        asked = Question(bounds, lines)
        answer = self.oracle(asked)
        if answer is NoWitness.NONE:
            self.search.used.update(assumption.index for assumption in self.root.open)
            return Rests()
        if isinstance(answer, NoWitness):
            self.search.undecided += 1
        else:
            self.search.witnesses.append(answer)
            self.search.doubtful.append(asked)
        return Open()

    def _is_opaque(self, region: Region) -> bool:
        """Return whether a bound speaks of a term that is not a leaf."""
        columns, forms = self.universe.columns, self.universe.forms
        return any(columns[column].opaque for form in region.bounds for column, _ in forms[form])

    def _fractional(self, region: Region) -> int:
        """Return a column (as a form) to which the vertex gives no integer; there must be one."""
        values = ((form, region.simplex.value(form)) for form in self._known(region).values())
        return next(form for form, value in values if value.denominator != 1)

    def _known(self, region: Region) -> dict[int, int]:
        """Return the columns that the region's simplex knows, with their forms."""
        singles = enumerate(self.universe.single)
        return {column: form for column, form in singles if region.simplex.knows(form)}

    def _point(self, region: Region) -> Point | None:
        """Return the vertex, or a point of integers near it, with the least value for every column left open.

        Return None where no point of integers is found.
        """
        vertex = {column: region.simplex.value(form) for column, form in self._known(region).items()}
        at: Mapping[int, int] | None = {column: int(value) for column, value in vertex.items()}
        if any(value.denominator != 1 for value in vertex.values()):
            at = points.projected(self.universe, region.bounds, at or {})
        if at is None:
            return None
        least = {column: self._range(region, form)[0] for column, form in enumerate(self.universe.single)}
        return {**least, **at}

    # --- splits ------------------------------------------------------------------------

    def _numbers(self, region: Region) -> list[int]:
        """Return the lines that may hold somewhere in a region."""
        return sorted([*bits_of(region.plain), *(line.index for line in region.lines)])

    def _candidates(self, region: Region) -> list[Candidate]:
        """Return the region's lines, each with the conditions that the region leaves open."""
        plain = []
        for number in bits_of(region.plain):
            boxes = {form: meet(box, (self._range(region, form),)) for form, box in self._lines[number].boxes}
            open_ = {form: box for form, box in boxes.items() if box != (self._range(region, form),)}
            plain.append(Candidate(number, open_, ()))
        return sorted([*plain, *region.lines], key=lambda line: line.index)

    def _survey(self, region: Region) -> Survey:
        """Find the cut that best parts the lines that are intervals, and the lines that hold; drop cuts that part none."""
        plain, opened, kept, best = region.plain, 0, list[Cut](), NOWHERE
        for cut in region.cuts:
            here = cut[2] & plain
            if here:
                kept.append(cut)
                opened |= here
                parted = (cut[5] & plain).bit_count()
                if parted >= best[0]:
                    lesser = min((cut[3] & plain).bit_count(), (cut[4] & plain).bit_count())
                    best = max(best, (parted, lesser, -cut[0], -cut[1]))
        region.cuts = kept
        holding = [*bits_of(plain & ~opened), *(line.index for line in region.lines if line.holds)]
        return Survey(best, sorted(holding))

    def _narrow(self, region: Region, survey: Survey) -> tuple[Node, list[Region]]:
        """Count the lines' boxes where only boxes are left, else split."""
        if region.carve:
            return self._carve(region, survey)
        if all(cut.form in self._singles for cut in region.cuts) and all(
            not line.rest and self._singles.issuperset(line.boxes) for line in region.lines
        ):
            lines = [self._dropped(region, line) for line in region.lines]
            if lines != region.lines:
                region.lines = lines
                return self._decide(region)
            boxes = [line.boxes for line in self._candidates(region)]
            extents = {form: self._range(region, form) for box in boxes for form in box}
            wrong = _defect(Boxes(extents, boxes), cover=not self.default)
            if wrong is None:
                sizes = (high - low + 1 for low, high in extents.values())
                return Counted(None if self.default else prod(sizes), parting(boxes)), []
            region.carve = tuple((form, bounds) for form, bounds in wrong.items() if bounds != extents[form])
            if region.carve:
                return self._carve(region, survey)
        return self._split(region, *self._best(region, region.lines, survey.best))

    def _carve(self, region: Region, survey: Survey) -> tuple[Node, list[Region]]:
        """Split once toward the part that is to be cut out."""
        (form, (low, high)), *later = region.carve
        least, greatest = self._range(region, form)
        if (low <= least and high >= greatest) or high < least or low > greatest:
            region.carve = tuple(later)
            return self._narrow(region, survey)
        at_low = low > least
        node, children = self._split(region, form, low - 1 if at_low else high)
        if children:
            children[at_low].carve = region.carve
        return node, children

    def _best(self, region: Region, candidates: Sequence[Candidate], best: Score) -> tuple[int, int]:
        """Return the form and cut that leave fewest lines on both sides together.

        Args:
            region: Where.
            candidates: Lines or assumptions that are not intervals, or that are not counted in `best`.
            best: The best cut of the lines that are intervals.
        """
        lows: dict[int, list[int]] = {}
        highs: dict[int, list[int]] = {}
        cuts: dict[int, set[int]] = {}
        for candidate in candidates:
            for form, box in candidate.boxes.items():
                lows.setdefault(form, []).append(box[0][0])
                highs.setdefault(form, []).append(box[-1][1])
                if len(box) > 1:
                    cuts.setdefault(form, set()).update(high for _, high in box)
            for part in candidate.rest:
                for atom in atoms(part):
                    edges = (cut for low, high in atom.box for cut in (low - 1, high))
                    cuts.setdefault(atom.form, set()).update(edges)
        plain = region.plain if best != NOWHERE else 0
        for cut in region.cuts if plain and cuts.keys() | lows.keys() else ():
            if cut.form in lows:
                cuts.setdefault(cut.form, set()).add(cut.at)
        for form in lows.keys() | cuts.keys():
            starts, ends = sorted(lows.get(form, ())), sorted(highs.get(form, ()))
            least, greatest = self._range(region, form)
            for at in {low - 1 for low in starts}.union(ends, cuts.get(form, ())):
                if least <= at < greatest:
                    below, above = self._ends.beyond(form, at)
                    left = bisect_right(ends, at) + (plain & below).bit_count()
                    right = len(starts) - bisect_right(starts, at) + (plain & above).bit_count()
                    best = max(best, (left + right, min(left, right), -form, -at))
        return -best[2], -best[3]

    def _split(self, region: Region, form: int, cut: int, rounds: int = 0) -> tuple[Node, list[Region]]:
        """Split at `form <= cut`; a side that linear arithmetic finds empty is a leaf at once."""
        least, greatest = self._range(region, form)
        if not least <= cut < greatest:
            return self._without_full_boxes(region)
        below, above = self._ends.beyond(form, cut)
        sides = [
            self._side(region, form, (least, cut), above),
            self._side(region, form, (cut + 1, greatest), below),
        ]
        for side in sides:
            side.rounds = rounds
        if sum(side.many for side in sides) > region.many and self._has_arithmetic(region, form):
            multipliers = self._refute(region)
            if multipliers is not None:
                return Empty(multipliers), []
            for side in sides:
                if side.known is None:
                    multipliers = self._refute(side)
                    side.known = None if multipliers is None else Empty(multipliers)
        return Split(form, cut), sides

    def _without_full_boxes(self, region: Region) -> tuple[Node, list[Region]]:
        """Decide the region once boxes that are all of its range are dropped: no bound could part them.

        Such a box arises where a disjunction joins to everything (`x < y or x >= y`).
        """
        before = [*region.lines, *region.open]
        region.lines = [self._dropped(region, line) for line in region.lines]
        region.open = [
            kept for kept in (self._dropped(region, candidate) for candidate in region.open) if not kept.holds
        ]
        if [*region.lines, *region.open] == before:
            return self._ask(region), []
        return self._decide(region)

    def _dropped(self, region: Region, candidate: Candidate) -> Candidate:
        boxes = {
            form: box
            for form, box in candidate.boxes.items()
            if meet(box, (whole := self._range(region, form),)) != (whole,)
        }
        return (
            candidate
            if len(boxes) == len(candidate.boxes)
            else Candidate(candidate.index, boxes, candidate.rest)
        )

    def _side(self, region: Region, form: int, bounds: Bounds, apart: int) -> Region:
        """Return one side of a split, without the lines that lie on the other side."""
        low, high = bounds
        lines = [kept for line in region.lines if (kept := line.within(form, low, high)) is not None]
        cuts = [cut for cut in region.cuts if cut[0] != form or low <= cut[1] < high]
        stale = (*region.stale, form)
        narrowed = {**region.bounds, form: bounds}
        side = Region(narrowed, region.plain & ~apart, cuts, lines, [], region.simplex, stale)
        for assumption in region.open:
            kept = assumption.within(form, low, high)
            if kept is None:
                side.known = side.known or OutsideAssumption(assumption.index)
            elif not kept.holds:
                side.open.append(kept)
        return side

    def _range(self, region: Region, form: int) -> Bounds:
        known = region.bounds.get(form)
        return (self.universe.low[form], self.universe.high[form]) if known is None else known

    # --- linear arithmetic -------------------------------------------------------------

    def _has_arithmetic(self, region: Region, form: int) -> bool:
        """Return whether a bound on a form of several columns plays a part."""
        forms = self.universe.forms
        return len(forms[form]) > 1 or any(len(forms[bound]) > 1 for bound in region.bounds)

    def _refute(self, region: Region) -> Multipliers | None:
        """Return multipliers that show the region to be empty; else None, with its simplex at a vertex."""
        if not region.stale:
            return None
        simplex, changed = region.simplex.copy(), False
        for form in dict.fromkeys(region.stale):
            if simplex.knows(form):
                simplex.restrict(form, *self._range(region, form))
                changed = True
            elif len(self.universe.forms[form]) > 1:
                self._enter(simplex, region, form)
                changed = True
        multipliers = simplex.refute() if changed else None
        if multipliers is None:
            region.simplex, region.stale = simplex, ()
        return multipliers

    def _enter(self, simplex: Simplex, region: Region, form: int) -> None:
        """Add a form, and the columns it is made of."""
        terms = [(self.universe.single[column], k) for column, k in self.universe.forms[form]]
        for single, _ in terms:
            if not simplex.knows(single):
                simplex.add_column(single, *self._range(region, single))
        simplex.add_form(form, terms, *self._range(region, form))


def _defect(boxes: Boxes[int], *, cover: bool) -> Cell[int] | None:
    """Return a cell in which two lines hold, or (with `cover`) none; None where there is no such cell."""
    pair = next(boxes.overlaps(), None)
    if pair is None:
        return Gaps.of(boxes, disjoint=True).least(()) if cover else None
    both = common(boxes.lines[pair[0]], boxes.lines[pair[1]])
    assert both is not None  # they overlap
    return {form: both[form][0] if form in both else extent for form, extent in boxes.extents.items()}
