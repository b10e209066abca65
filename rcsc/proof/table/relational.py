"""Tables with conditions across variables, or that rely on assumptions: a region tree, exact arithmetic, Z3.

In: a table. Out: what is wrong with it, with least witnesses and the regions around them, and the certificate
of a table in order. Linear arithmetic settles what it can; terms that are not linear are asked of Z3, in
one solver that is made when first needed; *unknown* is a finding, never a proof.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations, islice, product
from math import prod
from random import Random

from rcsc.lang.interpret import UNDEFINED, fold
from rcsc.lang.interval_sets import holds as within
from rcsc.lang.leaves import parts
from rcsc.lang.model import (
    Expr,
    Program,
    Read,
    Snapshot,
    Standing,
    Table,
    Test,
    Value,
    key_of,
    value_of_key,
)
from rcsc.lang.questions import located
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.solvers.search import furthest
from rcsc.proof.solvers.smt import Answer, Term
from rcsc.proof.symbolic import trial
from rcsc.proof.symbolic.encode import encode
from rcsc.proof.table.certificate import must_cover, tree_certificate
from rcsc.proof.table.confirm import TableSolver, named, shown
from rcsc.proof.table.regions import counting
from rcsc.proof.table.regions.atoms import Formula, Universe, assumptions_of, clauses, lines_of, some
from rcsc.proof.table.regions.enclosing import enclosed
from rcsc.proof.table.regions.least import find, inside, least, meeting, negated, never, whole, widest
from rcsc.proof.table.regions.region import Bounds, NoWitness, Only, Point, Question, Rests, Search
from rcsc.proof.table.regions.splitting import Tree
from rcsc.proof.table.verdict import (
    ContradictoryAssumptions,
    DeadLine,
    Decided,
    Gap,
    Overlap,
    Region,
    TableFinding,
    Undecided,
    settles,
)

MOST_CANDIDATES = 64
"""Lines in one question to the solver: it states every pair of them."""
_MOST_GROWN = 20
"""Findings of one table that are given the region around them."""
_MOST_LINES_GROWN = 64
"""Lines of a table above which no region is grown around a gap."""
_MOST_DOUBTFUL = 200
"""Pairs of lines of one region that the solver is asked for once it has found something wrong there."""
_MOST_OPAQUE = 12
"""Terms that are not linear, in a table whose regions are grown by their bounds, which are made anew for each box."""
_MOST_FORMS = 32
"""Forms of a table whose DEFAULT is told what falls to it by linear arithmetic."""
_MOST_COVERING = 100
"""Nodes in which it is looked for what falls to the DEFAULT of a table of fewer lines, before the solver is asked."""
_MOST_GAPS = 64
"""Regions of a gap among which linear arithmetic looks for the least input."""
_MOST_LINES_TRIED = 200
"""Lines of a table above which no inputs are tried by the interpreter."""
_AIMED, _MOST_PAIRS_AIMED = 8, 200
"""Inputs that are tried for each line, and pairs of lines for which one is."""
_FEWEST_POINTS = 40
"""Inputs that are tried whatever a table's conditions cost, beside those that are aimed."""
_STEPS_OF_A_SAMPLE = 10
"""What it costs to have the interpreter look whether a line matches, in steps of Z3."""
_MOST_INPUTS = 20_000
"""Inputs of a table up to which all are tried, to count those that no line matches."""
_STEPS_OF_A_TRIAL = 2
"""What it costs to try one line at one of them."""
_STEPS_OF_A_QUESTION = 4_000
"""What it costs to put a question about a region into Z3's words."""
_NODES_OF_A_LINE = 500
"""Nodes in which an input is looked for that a line matches, before the solver is asked."""
_OF_A_LINE = 10
"""Whether a line can match may take this part of a question's steps: about a second over doubles, of which Z3 may take all and not know."""
_MOST_REPROVED = 2_000
"""Nodes of a tree above which it is not tried whether an assumption can be spared."""


class _OverError(Exception):
    """The growing of a region was given up, as nobody waits for it (`smt.gives_up`)."""


@dataclass(frozen=True, slots=True)
class _Found:
    """A finding, with how to grow the region around its input. Growing takes longest, and is done last."""

    finding: TableFinding
    grow: Callable[[], tuple[Region | None, Snapshot]] | None = None

    def grown(self) -> TableFinding:
        """Return the finding with its region, and its input the least of that."""
        finding = self.finding
        if self.grow is None or not isinstance(finding, Overlap | Gap):
            return finding
        region, witness = self.grow()
        if isinstance(finding, Overlap):
            return replace(finding, witness=witness, region=region)
        return replace(finding, witnesses=(witness,), regions=(region,))


@dataclass(frozen=True, slots=True)
class _Wrong:
    """What is wrong of an input: the same in three forms.

    Attributes:
        unless: Formulas one of which holds wherever it is not so.
        so: Whether it is so where these lines match.
        term: The same as `unless`, for Z3.
        error: Whether it is one; what falls to DEFAULT is not, and Z3 is not asked about it.
    """

    unless: tuple[Formula, ...]
    so: Callable[[frozenset[int]], bool]
    term: Callable[[TableSolver], Term]
    error: bool = True


def decide(program: Program, table: Table, options: Options) -> Decided:
    """Decide the table under its assumptions, at first with few steps: these show most errors of a table that has some.

    Only where they show none, and leave something open, it is decided anew, with all steps.
    """
    soon = _Decision(program, table, options, few=True).decided()
    return soon if settles(table, soon.findings) else _Decision(program, table, options).decided()


def certificate_alone(program: Program, table: Table, options: Options) -> Mapping[str, object] | None:
    """Return a tree of regions that proves the table without assumptions; None where none was found."""
    decision = _Decision(program, table, options)
    search = decision.search((), alone=True)
    if not search.proved:
        search = decision.search(())
    return tree_certificate(table, decision.universe, search.nodes, ()) if search.proved else None


def under_assumptions(
    program: Program, table: Table, options: Options, settled: tuple[TableFinding, ...]
) -> tuple[TableFinding, ...]:
    """Find, under the assumptions of a table that is right without them, dead lines and the gap that DEFAULT takes.

    Args:
        program: Where the assumptions are declared.
        table: It has no overlap, and no gap but inputs that fall to its DEFAULT line, for any input.
        options: Limits.
        settled: That gap, where there is one.
    """
    soon = _Decision(program, table, options, few=True).under_assumptions(settled)
    return soon if settles(table, soon) else _Decision(program, table, options).under_assumptions(settled)


class _Decision:
    """One table being decided.

    Attributes:
        universe: Columns and forms of the lines and assumptions; every variable of a witness is a column.
        clauses, assumed: The lines, and the assumptions as formulas.
        few: Whether an answer is wanted soon, or an error is known, so that the verdict stands.
        spare: The budget then left for the least inputs, the regions around them and more of the same kind.
        rest: The budget then left for gaps and dead lines; a question without an answer is told as undecided.
    """

    def __init__(self, program: Program, table: Table, options: Options, *, few: bool = False) -> None:
        self.program, self.table, self.options = program, table, options
        self.universe = Universe()
        self.variables = shown(program, table)
        self.columns = [self.universe.column(Read(v.name, v.type)) for v in self.variables]
        self.clauses = lines_of(self.universe, table)
        self.assumptions = assumptions_of(self.universe, program, table)
        self.assumed = [whole(assumption) for assumption in self.assumptions]
        self._asked: TableSolver | None = None
        self._tried: tuple[tuple[Snapshot, frozenset[int]], ...] | None = None
        self.spare = smt.Budget(WRONG_STEPS, of_all=True)
        self.rest = smt.Budget(WRONG_STEPS // 2)
        self.few = few
        self.models: list[tuple[Snapshot, frozenset[int]]] = []

    @property
    def tried(self) -> tuple[tuple[Snapshot, frozenset[int]], ...]:
        """Sample inputs that the assumptions allow, with the lines that match each; none where the budget is spent.

        They are tried before Z3, which is slow on doubles and bits.
        """
        if self._tried is None:
            lines = self.table.lines
            samples = trial.SAMPLES + _AIMED * len(lines) + min(_MOST_PAIRS_AIMED, len(lines) ** 2)
            cost = samples * max(1, len(lines)) * _STEPS_OF_A_SAMPLE
            every = self.samples() if len(lines) <= _MOST_LINES_TRIED and not smt.charge(cost) else ()
            self._tried = tuple(
                (each, matching) for each in every if (matching := self.allowed(each)) is not None
            )
        return self._tried

    def samples(self) -> Iterator[Snapshot]:
        """Yield inputs, then some that lines, and pairs of them, are likely to match: few others match a mask of a word."""
        random = Random(0)  # noqa: S311  # a sample, not a secret
        points = list(trial.points(self.program.variables))
        nodes = sum(1 for line in self.table.lines for each in line.conditions for _ in parts(each))
        yield from points[: max(_FEWEST_POINTS, trial.EVALUATIONS // max(1, nodes))]
        kinds = self.program.kinds
        aims = {id(test): trial.Aim.of(test) for test in self.table.distinct_tests}
        tests = [[aims[id(test)] for test in line.stated] for line in self.table.lines]
        for one in tests * _AIMED:
            yield trial.towards(random.choice(points), one, kinds, random)
        for one, other in islice(combinations(tests, 2), _MOST_PAIRS_AIMED):
            yield trial.towards(random.choice(points), [*one, *other], kinds, random)

    def allowed(self, snapshot: Snapshot) -> frozenset[int] | None:
        """Return the lines that match; None where an assumption does not hold, or a condition of a line is not defined."""
        if not all(fold(each.condition, snapshot) for each in self.program.assumed(self.table)):
            return None
        try:
            return frozenset(self.matching(snapshot))
        except UNDEFINED:
            return None

    @cached_property
    def ready(self) -> dict[int, trial.Ready]:
        """The tests of the lines, prepared for trials."""
        return {id(test): trial.ready(test.condition) for test in self.table.distinct_tests}

    @cached_property
    def refuted_by_trial(self) -> bool:
        """Whether some sample input is matched by two lines, or by none where one must."""
        fewest = 1 if must_cover(self.table) else 0
        return any(not fewest <= len(found) <= 1 for _, found in self.tried)

    def tried_by(self, *lines: int) -> list[Snapshot]:
        """Return the sample inputs that all these lines match; given no line, those that none matches."""
        return [
            snapshot for snapshot, found in self.tried if (found.issuperset(lines) if lines else not found)
        ]

    @property
    def asked(self) -> TableSolver:
        """The table's Z3 solver, made when first asked."""
        if self._asked is None:
            self._asked = TableSolver(self.program, self.table, self.options)
        return self._asked

    @property
    def by_solver(self) -> bool:
        """Whether Z3 was asked."""
        return self._asked is not None and self._asked.solver.queries > 0

    def decided(self) -> Decided:
        """Decide and certify the table."""
        wrong = self.contradiction()
        if wrong:
            return Decided(wrong, (), by_solver=self.by_solver)
        kept = tuple(range(len(self.assumptions)))
        search = self.search(kept)
        if search.proved:
            kept, search = self.spared(search)
        self.few |= bool(search.overlaps) or (must_cover(self.table) and bool(search.gaps))
        found = self.overlaps(search)
        dead = self.dead(search)  # which may be wrong; what DEFAULT takes is not, and is looked for after it
        found += self.gap(search)
        with smt.within(self.spare):
            grown = [each.grown() for each in found]
        shared = (self.with_share(each, search) if isinstance(each, Gap) else each for each in grown)
        findings: tuple[TableFinding, ...] = (*shared, *dead)
        if search.undecided:
            many = "1 region" if search.undecided == 1 else f"{search.undecided} regions"
            findings = (*findings, Undecided(f"{many} of the input space"))
        names = tuple(self.table.assumptions[at] for at in kept)
        certificate = (
            tree_certificate(self.table, self.universe, search.nodes, names) if search.proved else None
        )
        used = names if search.proved else self.table.assumptions
        return Decided(findings, used, certificate, self.by_solver)

    def under_assumptions(self, settled: tuple[TableFinding, ...]) -> tuple[TableFinding, ...]:
        """Return dead lines, and a gap that DEFAULT takes, under the assumptions."""
        wrong = self.contradiction()
        if wrong:
            return wrong
        gaps = [finding for gap in settled if isinstance(gap, Gap) for finding in self.narrowed_gap(gap)]
        return (*self.dead(), *gaps)

    def contradiction(self) -> tuple[TableFinding, ...]:
        """Return the finding that the assumptions contradict each other, or that this is undecided; else nothing."""
        if not self.table.assumptions:
            return ()
        possible = self.satisfiable()
        if possible is Answer.SATISFIABLE:
            return ()
        return (
            ContradictoryAssumptions() if possible is Answer.UNSATISFIABLE else Undecided("the assumptions"),
        )

    def narrowed_gap(self, gap: Gap) -> list[TableFinding]:
        """Return the gap under the assumptions: at one of its witnesses that they allow, else one that the solver finds."""
        singles = self.universe.single
        columns = {str(v.name): (v, column) for v, column in zip(self.variables, self.columns, strict=True)}
        for witness in gap.witnesses:
            here = [(*columns[name], value) for name, value in witness.items() if name in columns]
            keys = [(singles[column], key_of(v.type, value)) for v, column, value in here]
            pinned = [self.universe.atom(form, ((key, key),)) for form, key in keys]
            point = least(self.universe, [*pinned, *self.assumed], self.columns)
            if not isinstance(point, NoWitness):
                return [Gap((self.snapshot(point),), (None,))]
        return [each.finding for each in self.gap(Search())]

    def search(
        self, kept: Sequence[int], budget: int | None = None, *, alone: bool = False, covering: bool = False
    ) -> Search:
        """Search under some of the assumptions.

        Args:
            kept: Their positions.
            budget: How many nodes at most; by the number of lines, where none is given.
            alone: Without the solver, to the first finding.
            covering: Without the solver, as if there were no DEFAULT: to find the inputs that it takes.
        """
        return Tree(
            self.universe,
            self.clauses,
            [self.assumptions[at] for at in kept],
            (lambda _: NoWitness.UNKNOWN) if alone or covering else self.oracle,
            default=not must_cover(self.table) and not covering,
            budget=budget,
            first_only=alone,
        ).run()

    def spared(self, search: Search) -> tuple[tuple[int, ...], Search]:
        """Drop assumptions one by one; return those that the proof needs, and its tree.

        Where a solver or a large tree was needed, every assumption that some leaf rests on is kept.
        """
        everything = tuple(range(len(self.assumptions)))
        if Rests() in search.nodes or len(search.nodes) > _MOST_REPROVED:
            return everything, search
        kept = everything
        for at in everything:
            fewer = tuple(other for other in kept if other != at)
            again = self.search(fewer, 2 * _MOST_REPROVED, alone=True)
            if again.proved:
                kept, search = fewer, again
        return kept, search

    def oracle(self, asked: Question) -> Snapshot | NoWitness:
        """Answer the tree's question about a region: by the samples, else by Z3."""
        if len(asked.candidates) > MOST_CANDIDATES or smt.spent() or (self.few and self.rest.spent):
            return NoWitness.UNKNOWN
        fewest = 1 if must_cover(self.table) else 0
        self.few = self.few or self.refuted_by_trial
        if self.few:
            self.rest.left -= _STEPS_OF_A_QUESTION
        region = located(self.spelled(asked))
        for snapshot, found in self.tried:
            if not fewest <= len(found.intersection(asked.candidates)) <= 1 and all(
                fold(condition, snapshot) for condition in region
            ):
                self.few = True
                return snapshot
        z3 = self.asked
        answer = self.holds(
            *(encode(condition, z3.frame) for condition in region), self.fault(asked.candidates)
        )
        if answer is Answer.SATISFIABLE:
            self.few = True
            return z3.model()
        return NoWitness.NONE if answer is Answer.UNSATISFIABLE else NoWitness.UNKNOWN

    def fault(self, candidates: Sequence[int]) -> Term:
        """Return the term that two of the candidates match, or none does (where no DEFAULT may be reached)."""
        lines = list(map(self.asked.line, candidates))
        wrong = [smt.all_of(pair) for pair in combinations(lines, 2)]
        if must_cover(self.table):
            wrong.append(smt.negation(smt.any_of(lines)))
        return smt.any_of(wrong)

    def holds(self, *terms: Term) -> Answer:
        """Ask Z3 whether the terms can hold; once something is wrong, only within the rest of the budget."""
        with smt.within(self.rest) if self.few else nullcontext():
            return self.asked.holds(*terms)

    def spelled(self, asked: Question) -> list[tuple[list[tuple[Expr, int]], int, int]]:
        """Return the bounds of a region, their forms as sums of terms."""
        columns, forms = self.universe.columns, self.universe.forms
        return [
            ([(columns[column].term, k) for column, k in forms[form]], low, high)
            for form, low, high in asked.bounds
        ]

    # --- findings ----------------------------------------------------------------------

    def satisfiable(self) -> Answer:
        """Return whether the assumptions can hold together."""
        point = find(self.universe, self.assumed)
        if point is NoWitness.UNKNOWN:
            given_up = smt.gives_up("whether the assumptions can hold together")
            return Answer.UNKNOWN if given_up else self.asked.holds()
        return Answer.UNSATISFIABLE if isinstance(point, NoWitness) else Answer.SATISFIABLE

    def overlaps(self, search: Search) -> list[_Found]:
        """Return every overlapping pair with its least witness."""
        pairs = set(search.overlaps)
        for seen in search.witnesses:
            pairs.update(combinations(self.seen(seen), 2))
        if search.undecided:  # in regions of which Z3 was perhaps not asked
            for _, found_there in self.tried:
                pairs.update(combinations(sorted(found_there), 2))
            self.few |= bool(pairs)
        with (
            smt.within(self.spare),
            smt.together(WRONG_STEPS // 4),
        ):  # one hard question leaves some for the least inputs
            for asked in search.doubtful:
                pairs.update(self.others(asked, pairs))
        found: list[_Found] = []
        if self.options.brief and len(pairs) > 1:
            smt.leave_open("where else two lines meet")
        for first, second in sorted(pairs):
            grown = len(found) < (1 if self.options.brief else _MOST_GROWN)
            found.append(self.overlap(first, second, search.overlaps.get((first, second)), grown=grown))
        return found

    def others(self, asked: Question, known: AbstractSet[tuple[int, int]]) -> set[tuple[int, int]]:
        """Return further pairs that overlap in a region, so that the findings do not depend on which input the solver gave of it."""
        if smt.gives_up("which other lines overlap"):
            return set()
        z3 = self.asked
        region = [encode(condition, z3.frame) for condition in located(self.spelled(asked))]
        lines = combinations(asked.candidates, 2)
        left = {pair: smt.all_of(list(map(z3.line, pair))) for pair in lines if pair not in known}
        found: set[tuple[int, int]] = set()
        while left and len(found) < _MOST_DOUBTFUL and not smt.spent():
            if z3.holds(*region, smt.any_of(list(left.values()))) is not Answer.SATISFIABLE:
                break
            new = left.keys() & set(combinations(self.seen(z3.model()), 2))
            if not new:
                break
            found |= new
            left = {pair: term for pair, term in left.items() if pair not in new}
        return found

    def covered(self, search: Search) -> bool:
        """Return whether the solver refutes that, where the tree did not look, some input is matched by no line."""
        if smt.gives_up("what no line matches"):
            return False
        few = len(self.clauses) <= _MOST_LINES_GROWN and not self.plain
        if not must_cover(self.table) and (search.undecided or few):
            return not self.tried_by() and self.holds(self.asked.none()) is Answer.UNSATISFIABLE
        return all(self.missed(asked) is Answer.UNSATISFIABLE for asked in search.doubtful)

    def missed(self, asked: Question) -> Answer:
        """Ask the solver for an input in a region that no line matches."""
        z3 = self.asked
        region = [encode(condition, z3.frame) for condition in located(self.spelled(asked))]
        return self.holds(*region, smt.negation(smt.any_of(list(map(z3.line, asked.candidates)))))

    def matching(self, snapshot: Snapshot) -> list[int]:
        """Return the positions of the lines that match; each test is evaluated at most once.

        Raises:
            UNDEFINED: A condition that is looked at is not defined.
        """
        known: dict[int, bool] = {}

        def so(test: Test) -> bool:
            if id(test) not in known:
                known[id(test)] = self.ready[id(test)](snapshot)
            return known[id(test)]

        return [
            at
            for at, line in enumerate(self.table.lines)
            if all(test is None or so(test) for test in line.tests)
        ]

    def seen(self, snapshot: Snapshot) -> list[int]:
        """Keep an input that the solver gave; return positions of the lines that match."""
        found = self.matching(snapshot)
        self.models.append((snapshot, frozenset(found)))
        return found

    def overlap(self, first: int, second: int, known: Point | None, *, grown: bool) -> _Found:
        """Return the overlap of two lines at its least input; at the known input where nobody waits for the least."""
        if known is not None and (self.options.bare or smt.gives_up("the least input")):
            return _Found(Overlap(first, second, self.snapshot(known)))
        both = [self.line(first), self.line(second)]
        with smt.within(self.spare):
            point = least(self.universe, [*both, *self.assumed], self.columns)
        if isinstance(point, NoWitness):
            models = [each for each, found in self.models if found.issuperset((first, second))]
            seen = [
                *self.tried_by(first, second),
                *models,
                *([] if known is None else [self.snapshot(known)]),
            ]
            witness = self.witness(seen, lambda z3: (z3.line(first), z3.line(second)))
            if witness is None:
                names = f"lines `{self.table.lines[first].name}` and `{self.table.lines[second].name}`"
                return _Found(Undecided(names))
        else:
            witness = self.snapshot(point)
        wrong = _Wrong(
            (some(negated(self.universe, line) for line in both),),
            frozenset((first, second)).issubset,
            lambda z3: smt.negation(smt.all_of([z3.line(first), z3.line(second)])),
        )
        grown = grown and not self.options.bare and (self.grows or not isinstance(point, NoWitness))
        grow = partial(self.around, witness, wrong) if grown else None
        return _Found(Overlap(first, second, witness), grow)

    def gap(self, search: Search) -> list[_Found]:
        """Return the gap at the least input that no line matches, if there is one; also where DEFAULT takes it."""
        tried = self._tried is not None and bool(self.tried_by())  # in a region that was given up, perhaps
        if must_cover(self.table) and not (search.gaps or search.witnesses or tried):
            return []
        many = len(self.clauses) > _MOST_LINES_GROWN
        if not must_cover(self.table) and (many or self.plain):
            search = self.covering
        grow = None if many or self.options.bare else partial(self.around, wrong=self.unmatched)
        seen = [snapshot for snapshot in search.witnesses if not self.matching(snapshot)]
        covered = self.covered(search)
        if search.gaps and covered and not seen and len(search.gaps) <= _MOST_GAPS:
            with smt.within(self.spare):
                points = [
                    least(self.universe, inside(self.universe, part), self.columns) for part, _ in search.gaps
                ]
            settled = [point for point in points if not isinstance(point, NoWitness)]
            if len(settled) == len(points):
                point = min(settled, key=lambda candidate: [candidate[column] for column in self.columns])
                witness: Snapshot | None = self.snapshot(point)
                return [self.gap_at(witness, grow)]
        seen += self.tried_by()
        if covered and not search.gaps and not seen:
            return []
        seen += [self.snapshot(point) for _, point in search.gaps]
        witness = self.witness(seen, lambda z3: (z3.none(),))
        return [self.gap_at(witness, grow if self.grows else None)]

    @staticmethod
    def gap_at(
        witness: Snapshot | None, grow: "Callable[[Snapshot], tuple[Region | None, Snapshot]] | None"
    ) -> _Found:
        """Return the gap at an input, to be grown; undecided where there is none."""
        if witness is None:
            return _Found(Undecided("what no line matches"))
        return _Found(Gap((witness,), (None,)), None if grow is None else partial(grow, witness))

    @property
    def unmatched(self) -> _Wrong:
        """The wrong of a gap: that no line matches."""
        every_line = range(len(self.clauses))
        return _Wrong(
            tuple(map(whole, self.clauses)),
            lambda found: not found,
            lambda z3: smt.any_of([z3.line(at) for at in every_line]),
            error=must_cover(self.table),
        )

    @property
    def grows(self) -> bool:
        """Whether regions are grown by bounds of what is not linear: of some terms, not of the bits of wide words."""
        return len(self.universe.opaque) <= _MOST_OPAQUE

    @cached_property
    def plain(self) -> bool:
        """Whether all is linear, and over few forms: not the bits of wide words."""
        return not self.universe.opaque and len(self.universe.forms) <= _MOST_FORMS

    @cached_property
    def covering(self) -> Search:
        """The search as if there were no DEFAULT."""
        few = len(self.clauses) <= _MOST_LINES_GROWN
        return self.search(range(len(self.assumptions)), _MOST_COVERING if few else None, covering=True)

    def dead(self, search: Search | None = None) -> list[TableFinding]:
        """Find the lines that no input matches, and whether only an assumption excludes them.

        Where a tree is given, points are looked for in its order: regions beside each other have points beside each other.
        """
        seen = () if search is None else (node.line for node in search.nodes if isinstance(node, Only))
        order = dict.fromkeys([*(at for at in seen if at >= 0), *range(len(self.clauses))])
        open_: list[tuple[int, NoWitness]] = []
        near: Point = {}
        for at in order:
            if smt.gives_up("which lines never match"):
                break
            point = self.meeting(at, near)
            if isinstance(point, NoWitness):
                open_.append((at, point))
            else:
                near = point
        dead = {at: self.excluded_only(at) for at, point in open_ if point is not NoWitness.UNKNOWN}
        self.few |= not all(dead.values())
        doubtful: list[int] = []
        for at in sorted(at for at, _ in open_ if at not in dead):
            answer = Answer.SATISFIABLE if self.tried_by(at) else self.matches(at)
            if answer is Answer.UNSATISFIABLE:
                dead[at] = self.excluded_only(at)
                self.few |= not dead[at]
            elif answer is Answer.UNKNOWN:
                doubtful.append(at)
        findings: list[TableFinding] = [DeadLine(at, dead[at]) for at in sorted(dead)]
        doubt = Undecided(f"whether {named(self.table, doubtful)} can match")
        return [*findings, doubt] if doubtful else findings

    def matches(self, at: int) -> Answer:
        """Ask Z3 whether a line can match, with a part of a question's steps: of doubles it may take all without an answer."""
        with smt.together(self.options.steps // _OF_A_LINE):
            return self.holds(self.asked.line(at))

    def meeting(self, at: int, near: Point) -> Point | NoWitness:
        """Find an input that a line matches under the assumptions, first near another."""
        if self.assumed:
            return find(self.universe, [self.line(at), *self.assumed], _NODES_OF_A_LINE)
        return meeting(self.universe, self.clauses[at], near, _NODES_OF_A_LINE)

    def excluded_only(self, at: int) -> bool:
        """Return whether a line is dead only because of an assumption that is not proved, as far as anybody can tell."""
        if len(self.sure) == len(self.assumed):
            return False
        point = find(self.universe, [self.line(at), *self.sure])
        if point is not NoWitness.UNKNOWN:
            return point is not NoWitness.NONE
        with (
            smt.together(self.options.steps // _OF_A_LINE),
            smt.within(self.rest) if self.few else nullcontext(),
        ):
            return self.surely.holds(self.surely.line(at)) is not Answer.UNSATISFIABLE

    @cached_property
    def surely(self) -> TableSolver:
        """The table's Z3 solver that knows what is proved of the assumptions alone."""
        proved = {each.name for each in self.program.assumptions if each.standing is Standing.PROVED}
        names = tuple(name for name in self.table.assumptions if name in proved)
        return TableSolver(self.program, replace(self.table, assumptions=names), self.options)

    @property
    def sure(self) -> list[Formula]:
        """The assumptions that are proved."""
        standing = {assumption.name: assumption.standing for assumption in self.program.assumptions}
        names = zip(self.table.assumptions, self.assumed, strict=True)
        return [formula for name, formula in names if standing[name] is Standing.PROVED]

    def line(self, at: int) -> Formula:
        """Return a line as a formula."""
        return whole(self.clauses[at])

    def witness(
        self, seen: Sequence[Snapshot], terms: Callable[[TableSolver], tuple[Term, ...]]
    ) -> Snapshot | None:
        """Return the least input for which the terms hold; where Z3 gives up, the least one known."""
        known = bool(seen) and self.options.bare
        witness = None if known or smt.gives_up("the least input") else self._least(seen, terms)
        if witness is None and seen:
            best = min(seen, key=lambda snapshot: [key_of(v.type, snapshot[v.name]) for v in self.variables])
            witness = {v.name: best[v.name] for v in self.variables}
        return witness

    def _least(
        self, seen: Sequence[Snapshot], terms: Callable[[TableSolver], tuple[Term, ...]]
    ) -> Snapshot | None:
        if not seen:
            with smt.within(self.rest) if self.few else nullcontext():
                return self.asked.witness(*terms(self.asked), spare=self.spare)
        with smt.within(self.spare):
            return None if smt.spent() else self.asked.witness(*terms(self.asked))

    # --- shares ------------------------------------------------------------------------

    def with_share(self, gap: Gap, search: Search) -> Gap:
        """Return a gap with the number of inputs that it has, and of how many that the assumptions allow, where these were counted."""
        what = "how many inputs no line matches"
        if self.options.brief and not self.options.bare:  # a repair that is tried may leave no more inputs
            smt.leave_open(what)
            return gap
        if smt.gives_up(what):
            return gap
        many = len(self.clauses) > _MOST_LINES_GROWN
        plain = must_cover(self.table) or many or self.plain
        count = self.counted(search if must_cover(self.table) else self.covering) if plain else None
        count = count or self.counted_by_trial()
        if count is None or not self.assumed:
            return replace(gap, count=count)
        sizes = (None if region is None else self.allowed_in(region) for region in gap.regions)
        return replace(gap, count=count, sizes=tuple(sizes))

    def counted(self, search: Search) -> tuple[int, int] | None:
        """Count the inputs of regions that linear arithmetic settled; None where others are open."""
        if search.undecided or search.witnesses or search.doubtful or not search.gaps:
            return None
        missing = self.sum_of(search)
        total = None if missing is None else self.allowed_in({})
        return None if missing is None or total is None else (missing, total)

    def sum_of(self, search: Search) -> int | None:
        """Count the inputs of the regions that a search found; None where one cannot be counted."""
        counts = [counting.inputs(self.universe, bounds, self.columns) for bounds, _ in search.gaps]
        return None if None in counts else sum(count or 0 for count in counts)

    def allowed_in(self, region: Region) -> int | None:
        """Count the inputs of a region that the assumptions allow; None where that was not found out."""
        pairs = zip(self.variables, self.columns, strict=True)
        singles = self.universe.single
        box = [self.universe.atom(singles[column], region[v.name]) for v, column in pairs if v.name in region]
        search = Tree(
            self.universe, (), [*self.assumptions, clauses(box)], lambda _: NoWitness.UNKNOWN, default=False
        ).run()
        if search.undecided:
            return self.trial_in(region)
        return self.sum_of(search)

    def trial_in(self, region: Region) -> int | None:
        """Count the same by trying every input of the table; None where these are too many."""
        if self.every_input is None:
            return None
        kinds = self.program.kinds
        return sum(
            all(within(box, key_of(kinds[name], snapshot[name])) for name, box in region.items())
            for snapshot, _ in self.every_input
        )

    def counted_by_trial(self) -> tuple[int, int] | None:
        """Count the inputs that no line matches by trying every input; None where these are too many."""
        every_input = self.every_input
        return None if every_input is None else (sum(not found for _, found in every_input), len(every_input))

    @cached_property
    def every_input(self) -> tuple[tuple[Snapshot, frozenset[int]], ...] | None:
        """Each input that the assumptions allow, with the lines that match it; None where there are too many, or a line is not defined."""
        extents = [self._extent(column) for column in self.columns]
        many = prod(high - low + 1 for low, high in extents)
        if many > _MOST_INPUTS or smt.charge(many * max(1, len(self.clauses)) * _STEPS_OF_A_TRIAL):
            return None
        points = product(*(range(low, high + 1) for low, high in extents))
        snapshots = (self.snapshot(dict(zip(self.columns, point, strict=True))) for point in points)
        assumed = [trial.ready(each.condition) for each in self.program.assumed(self.table)]
        try:
            return tuple(
                (snapshot, frozenset(self.matching(snapshot)))
                for snapshot in snapshots
                if all(so(snapshot) for so in assumed)
            )
        except UNDEFINED:
            return None

    # --- witnesses ---------------------------------------------------------------------

    def snapshot(self, point: Point) -> dict[str, Value]:
        """Return the point's values of the variables that are shown."""
        pairs = zip(self.variables, self.columns, strict=True)
        return {v.name: value_of_key(v.type, point[column]) for v, column in pairs}

    def around(self, witness: Snapshot, wrong: _Wrong) -> tuple[Region | None, Snapshot]:
        """Return the widest box found around an input in which, under the assumptions, it is wrong throughout, and the least input of it.

        Its ends are values that the assumptions allow: where they allow nothing, nothing holds. None where it was given up.
        """
        pairs = zip(self.variables, self.columns, strict=True)
        point = {column: key_of(v.type, witness[v.name]) for v, column in pairs}

        def holds(box: Mapping[int, Bounds]) -> bool:
            if all(self.excluded(box, formula) for formula in wrong.unless):
                return True
            return wrong.error and self.grows and bool(self.universe.opaque) and self.refuted(box, wrong)

        try:
            box = widest(self.universe, point, self.columns, holds)
            if self.assumed:
                box = self._possible(box, point)
        except _OverError:
            return None, witness
        region: Region = {
            str(v.name): (bounds,)
            for v, column in zip(self.variables, self.columns, strict=True)
            if (bounds := box[column]) != self._extent(column)
        }
        corner = witness if self.assumed else self.snapshot({column: low for column, (low, _) in box.items()})
        return region, corner

    def refuted(self, box: Mapping[int, Bounds], wrong: _Wrong) -> bool:
        """Return whether Z3 says, within its budget, that it is wrong all over a box; the corners are tried before it is asked."""
        for end in (0, 1):
            found = self.allowed(self.snapshot({column: bounds[end] for column, bounds in box.items()}))
            if found is not None and not wrong.so(found):
                return False
        if smt.gives_up("the region around an input"):
            raise _OverError
        if smt.spent():
            return False
        z3 = self.asked
        bounds = tuple((self.universe.single[column], *ends) for column, ends in box.items())
        region = [encode(condition, z3.frame) for condition in located(self.spelled(Question(bounds, ())))]
        return z3.holds(*region, wrong.term(z3)) is Answer.UNSATISFIABLE

    def excluded(self, box: Mapping[int, Bounds], formula: Formula) -> bool:
        """Return whether, under the assumptions, a formula holds nowhere in a box; the ends of its forms are tried first."""
        box = enclosed(self.universe, box) if self.universe.opaque and self.grows else box
        told = never(self.universe, box, formula)
        if told is None or (not told and self.assumed):
            return self.empty(box, formula)
        return told

    def empty(self, box: Mapping[int, Bounds], *formulas: Formula) -> bool:
        """Return whether no point of a box meets the assumptions and the formulas.

        Raises:
            _OverError: It is given up.
        """
        if smt.gives_up("the region around an input"):
            raise _OverError
        atoms = [self.universe.atom(self.universe.single[c], (bounds,)) for c, bounds in box.items()]
        return find(self.universe, [*atoms, *self.assumed, *formulas]) is NoWitness.NONE

    def _possible(self, box: Mapping[int, Bounds], point: Point) -> dict[int, Bounds]:
        """Trim from the box's ends the values with which no input in it meets the assumptions; the point meets them."""
        narrow = dict(box)

        def meets(column: int, low: int, high: int) -> bool:
            return not self.empty({**narrow, column: (low, high)})

        for column, (low, high) in box.items():
            at = point[column]
            top = furthest(at, high, lambda end, c=column, h=high: meets(c, end, h))  # type: ignore[misc]  # bound early
            bottom = -furthest(-at, -low, lambda end, c=column, b=low: meets(c, b, -end))  # type: ignore[misc]  # as above
            narrow[column] = (bottom, top)
        return narrow

    def _extent(self, column: int) -> Bounds:
        bounds = self.universe.columns[column]
        return bounds.low, bounds.high
