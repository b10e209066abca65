"""Z3 asked about one table: to confirm what masks, counting and region trees have answered, or to decide it alone.

In: a table, and what was found of it. Out: whether Z3 agrees, by two questions. Or in: a table. Out: all that is wrong with it by
Z3's answers alone (`decide`), with the least inputs that it gives. Each such input is tried by the interpreter before it counts, so
that nothing is shown which is not so; that there is none rests on Z3. *Unknown* is a finding, never a proof.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from enum import Enum, auto
from functools import cached_property, partial
from itertools import combinations, islice

from rcsc.lang.interpret import UNDEFINED, holds
from rcsc.lang.leaves import operands, read_by
from rcsc.lang.model import (
    Apply,
    AssumptionName,
    Bool,
    Expr,
    Program,
    Real,
    Snapshot,
    Standing,
    Table,
    Test,
    Value,
    Variable,
    key_bounds,
    key_of,
)
from rcsc.lang.operator_table import CALCULATIONS
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.solvers.search import halved
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic.encode import declared, encode, least_witness
from rcsc.proof.table.certificate import must_cover
from rcsc.proof.table.regions.partition import MOST_PAIRS
from rcsc.proof.table.verdict import (
    ContradictoryAssumptions,
    DeadLine,
    Decided,
    Gap,
    Overlap,
    SolversDisagree,
    TableFinding,
    Undecided,
    refutes,
)


def shown(program: Program, table: Table) -> list[Variable]:
    """Return the variables of a witness, in declared order: those that the table or its assumptions read."""
    assumed = (assumption.condition for assumption in program.assumed(table))
    wanted = set(table.variables).union(*map(read_by, assumed))
    return [variable for variable in program.variables if variable.name in wanted]


def named(table: Table, lines: Sequence[int]) -> str:
    """Return the names of lines, for messages: ``lines `a`, `b` ``."""
    names = ", ".join(f"`{table.lines[at].name}`" for at in lines)
    return f"line{'s' if len(lines) > 1 else ''} {names}"


def calculated(condition: Expr) -> Iterator[Expr]:
    """Yield what a condition calculates of doubles and singles, each whole."""
    waiting = [condition]
    while waiting:
        expr = waiting.pop()
        if isinstance(expr, Apply) and isinstance(expr.type, Real) and expr.op in CALCULATIONS:
            yield expr
        else:
            waiting += operands(expr)


class TableSolver:
    """One solver that knows the table's domain and assumptions, and each line as a literal."""

    def __init__(self, program: Program, table: Table, options: Options) -> None:
        self.program, self.table = program, table
        # What nothing here reads has some value in its range, whatever the others have.
        assumed = [assumption.condition for assumption in program.assumed(table)]
        tests = [test.condition for test in table.distinct_tests]
        self.frame, domain = declared(shown(program, table), [*tests, *assumed])
        self.solver = Solver(options.limits)
        self.solver.add(*domain, *(encode(condition, self.frame) for condition in assumed))
        self._lines: dict[int, Term] = {}
        self._tests: dict[int, Term] = {}

    def line(self, at: int) -> Term:
        """Return the term that a line matches."""
        if at not in self._lines:
            self._lines[at] = smt.all_of(
                [self._test(test.condition, id(test)) for test in self.table.lines[at].stated]
            )
        return self._lines[at]

    def _test(self, condition: Expr, key: int) -> Term:
        if key not in self._tests:
            # Z3 makes bits of a calculation for each question anew, a tenth of a second each, unless it stands for itself. It does so
            # from the first test on that has it: what is asked before need not find values for it.
            for number in calculated(condition):
                if number not in self.frame.named:
                    self.frame.named[number] = self.solver.named(encode(number, self.frame))
            self._tests[key] = encode(condition, self.frame)
        return self._tests[key]

    def none(self) -> Term:
        """Return the term that no line matches."""
        return smt.negation(smt.any_of([self.line(at) for at in range(len(self.table.lines))]))

    def witness(
        self, *terms: Term, spare: smt.Budget | None = None, known: Snapshot | None = None
    ) -> Snapshot | None:
        """Return the least input for which the terms hold; None where the solver gives up.

        `spare`, if given, is the budget for finding the least one once some input is known, as `known` is from the beginning.
        """
        self.solver.push()
        self.solver.add(*terms)
        witness = least_witness(self.solver, shown(self.program, self.table), self.frame, spare, known)
        self.solver.pop()
        return witness

    def model(self) -> dict[str, Value]:
        """Return the input of the last answer: the values of the variables that the table and its assumptions read."""
        leaves = self.frame.leaves
        asked = (v for v in self.program.variables if v.name in leaves)
        return {str(v.name): self.solver.value(leaves[v.name], v.type) for v in asked}

    def holds(self, *terms: Term) -> Answer:
        """Ask whether the terms can hold together."""
        return self.solver.check(*terms)


_SMALL = 60_000
"""Lines times cells of a table up to which each question may take `_STEPS`; of a larger one a step takes longer."""
_STEPS = 20_000_000
"""Budget of each question that is asked only because it should be cheap."""
_OF_A_LARGE_TABLE = 2_000_000
"""Budget of all that is asked of a larger table, and of putting it into Z3's words: about two seconds."""
_OF_A_CELL = 100
"""What it costs to put a cell into Z3's words, in its steps."""


class Agreement(Enum):
    """Z3's answer about the verdict."""

    AGREES = auto()
    DISAGREES = auto()
    NOT_ASKED = auto()
    UNKNOWN = auto()


def _steps_of_all(table: Table, options: Options) -> int:
    """Return the budget of all questions that confirm a verdict; 0 where none is to be asked."""
    if options.solver != "auto":
        return sys.maxsize if options.solver == "both" else 0
    cells = sum(len(line.stated) for line in table.lines)
    if cells * len(table.lines) <= _SMALL:
        return sys.maxsize
    return 0 if options.brief else max(0, _OF_A_LARGE_TABLE - _OF_A_CELL * cells)


def confirm(
    program: Program, table: Table, findings: tuple[TableFinding, ...], options: Options
) -> Agreement:
    """Compare the findings with Z3's answers to two questions: do two lines overlap, and is there a gap?"""
    steps_of_all = _steps_of_all(table, options)
    if not steps_of_all or any(isinstance(finding, Undecided) for finding in findings):
        return Agreement.NOT_ASKED
    if smt.gives_up(
        "whether Z3 agrees"
    ):  # before anything is put into its words, which takes longer than to ask
        return Agreement.UNKNOWN
    if options.solver == "auto":
        steps = WRONG_STEPS // 3 if refutes(table, findings) else _STEPS
        options = replace(options, steps=min(options.steps, steps))
    with smt.together(steps_of_all):
        return _compared(TableSolver(program, table, options), findings)


def _compared(asked: TableSolver, findings: tuple[TableFinding, ...]) -> Agreement:
    gaps = [finding for finding in findings if isinstance(finding, Gap)]
    gap = (
        _some_gap(asked, gaps) if must_cover(asked.table) or gaps else None
    )  # while the solver knows no line
    if gap is Answer.UNKNOWN:
        return Agreement.UNKNOWN
    overlap = asked.holds(smt.any_of([smt.all_of(pair) for pair in _with_earlier(asked)]))
    answers = (
        (overlap, any(isinstance(finding, Overlap) for finding in findings)),
        (gap, bool(gaps)),
    )
    if any(answer is Answer.UNKNOWN for answer, _ in answers):
        return Agreement.UNKNOWN
    agrees = all(answer is None or (answer is Answer.SATISFIABLE) == wrong for answer, wrong in answers)
    return Agreement.AGREES if agrees else Agreement.DISAGREES


def _some_gap(asked: TableSolver, gaps: Sequence[Gap]) -> Answer:
    """Ask whether no line matches some input. Gaps already found are tried first: with their values put in, that costs little."""
    for witness in (gap.witnesses[0] for gap in gaps if gap.witnesses):
        named = [v for v in shown(asked.program, asked.table) if v.name in witness]
        point = [(asked.frame.leaves[v.name], smt.literal(v.type, witness[v.name])) for v in named]
        here = [smt.equal(leaf, value, v.type) for v, (leaf, value) in zip(named, point, strict=True)]
        answer = asked.holds(smt.at_point(asked.none(), point), *here)
        if answer is not Answer.UNSATISFIABLE:  # what is not decided there, is not among all inputs either
            return answer
    return asked.holds(asked.none())


def _with_earlier(asked: TableSolver) -> list[tuple[Term, Term]]:
    """Name, for each line, that some line before it matches, and that it matches itself: two lines overlap where both hold of one."""
    pairs = []
    seen = smt.truth(False)
    for at in range(len(asked.table.lines)):
        bit = smt.variable(f"line!{at}", Bool())
        before = seen
        seen = smt.variable(f"seen!{at}", Bool())
        asked.solver.add(smt.equal(bit, asked.line(at), Bool()))
        asked.solver.add(smt.equal(seen, smt.any_of([before, bit]), Bool()))
        pairs.append((before, bit))
    return pairs


# --- Z3 alone ------------------------------------------------------------------------


class _UnrealError(Exception):
    """Z3 gave an input at which the interpreter does not see what Z3 says."""


def decide(program: Program, table: Table, options: Options) -> Decided:
    """Decide the table by Z3's answers alone; what it does not answer within its steps is left open."""
    try:
        return _Alone(program, table, options).decided()
    except _UnrealError:
        return Decided((SolversDisagree("the interpreter does not see what it says of an input"),), ())


class _Alone:
    """One table being decided by Z3 alone.

    Attributes:
        spare: The budget for the least inputs, once some are known; where it ends, those that are known are shown.
        matched: Lines that an input was seen to match.
    """

    def __init__(self, program: Program, table: Table, options: Options) -> None:
        self.program, self.table, self.options = program, table, options
        self.asked = TableSolver(program, table, options)
        self.spare = smt.Budget(options.steps)
        self.matched: set[int] = set()

    def decided(self) -> Decided:
        """Ask whether the assumptions can hold, for a gap, overlaps and dead lines, and what the proof needs."""
        if self.table.assumptions:
            possible = self.asked.holds()
            if possible is Answer.UNSATISFIABLE:
                return Decided((ContradictoryAssumptions(),), ())
            if possible is Answer.UNKNOWN:
                return Decided((Undecided("the assumptions"),), ())
            self.tried()
        gap = self.gap()  # while the solver knows no line
        overlaps = self.overlaps()
        findings = (*overlaps, *gap, *self.dead())
        right = not overlaps and not (gap and must_cover(self.table))
        return Decided(findings, self.needed() if right else self.table.assumptions)

    def gap(self) -> list[TableFinding]:
        """Return the gap at the least input that no line matches, if there is one; also where DEFAULT takes it."""
        none = self.asked.none()
        answer = self.asked.holds(none)
        if answer is Answer.SATISFIABLE:
            return [Gap((self.least(self.asked.model(), none),), (None,))]
        return [] if answer is Answer.UNSATISFIABLE else [Undecided("what no line matches")]

    @cached_property
    def pairs(self) -> list[tuple[Term, Term]]:
        """What `_with_earlier` names."""
        return _with_earlier(self.asked)

    def overlaps(self) -> list[TableFinding]:
        """Return every overlapping pair with its least input; line by line where the question about all is not answered."""
        known: dict[tuple[int, int], Snapshot] = {}
        open_ = list(halved(range(len(self.table.lines)), partial(self.met, known)))
        found: list[TableFinding] = [
            Overlap(*pair, self.least(known[pair], *(self.pairs[at][1] for at in pair), lines=pair))
            for pair in sorted(known)
        ]
        return [*found, Undecided(f"whether {named(self.table, open_)} overlap")] if open_ else found

    def met(self, known: dict[tuple[int, int], Snapshot], lines: Sequence[int]) -> bool:
        """Enter each pair of these lines with earlier ones, and an input that both match; return whether Z3 told of all."""
        while len(known) < MOST_PAIRS:
            answer = self.asked.holds(smt.any_of([self.more(known, at) for at in lines]))
            if answer is not Answer.SATISFIABLE:
                return answer is Answer.UNSATISFIABLE
            snapshot = self.asked.model()
            pairs = islice(combinations(sorted(self.tried(snapshot)), 2), MOST_PAIRS)
            new = {pair: snapshot for pair in pairs if pair not in known}
            if not new:
                raise _UnrealError
            known |= new
        return True

    def more(self, known: dict[tuple[int, int], Snapshot], at: int) -> Term:
        """State that a line matches together with an earlier one, and that no known pair shows it."""
        before, bit = self.pairs[at]
        earlier = [other for other in range(at) if (other, at) not in known]
        if len(earlier) < at:
            before = smt.any_of([self.pairs[other][1] for other in earlier])
        return smt.all_of([before, bit])

    def dead(self) -> list[TableFinding]:
        """Return the lines that no input matches, and whether only an assumption excludes them."""
        found: list[TableFinding] = []
        doubtful: list[int] = []
        for at in range(len(self.table.lines)):
            if at in self.matched:
                continue
            answer = self.asked.holds(self.pairs[at][1])
            if answer is Answer.SATISFIABLE:
                self.tried(lines=(at,))
                continue
            without = Answer.UNKNOWN if answer is Answer.UNKNOWN else self.matches_without(at)
            if without is Answer.UNKNOWN:
                doubtful.append(at)
            else:
                found.append(DeadLine(at, assuming=without is Answer.SATISFIABLE))
        return [*found, Undecided(f"whether {named(self.table, doubtful)} can match")] if doubtful else found

    def matches_without(self, at: int) -> Answer:
        """Return whether a line matches somewhere without the assumptions that are not proved."""
        if self.sure is None:
            return Answer.UNSATISFIABLE
        answer = self.sure.asked.holds(self.sure.asked.line(at))
        if answer is Answer.SATISFIABLE:
            self.sure.tried(lines=(at,))
        return answer

    @cached_property
    def sure(self) -> "_Alone | None":
        """The table under what is proved of its assumptions; None where that is all."""
        proved = {each.name for each in self.program.assumptions if each.standing is Standing.PROVED}
        names = tuple(name for name in self.table.assumptions if name in proved)
        return None if names == self.table.assumptions else self._under(names)

    def needed(self) -> tuple[AssumptionName, ...]:
        """Return the assumptions that the proof needs: dropped one by one as long as Z3 still proves the table, in few steps."""
        kept = self.table.assumptions
        if not kept:
            return ()
        with smt.together(self.options.steps):
            if self._under(()).right():
                return ()
            for name in kept:
                fewer = tuple(other for other in kept if other != name)
                if self._under(fewer).right():
                    kept = fewer
        return kept

    def right(self) -> bool:
        """Return whether Z3 says that exactly one line matches every input, or at most one where there is a DEFAULT."""
        covered = not must_cover(self.table) or self.asked.holds(self.asked.none()) is Answer.UNSATISFIABLE
        return covered and (
            self.asked.holds(smt.any_of([smt.all_of(pair) for pair in self.pairs])) is Answer.UNSATISFIABLE
        )

    def _under(self, names: tuple[AssumptionName, ...]) -> "_Alone":
        return _Alone(self.program, replace(self.table, assumptions=names), self.options)

    # --- inputs that Z3 gives ----------------------------------------------------------

    def least(self, known: Snapshot, *terms: Term, lines: tuple[int, ...] = ()) -> Snapshot:
        """Return the least input for which the terms hold, tried; `lines` match it, or none where none is named."""
        witness = known
        if not self.options.bare and not smt.gives_up("the least input"):
            witness = self.asked.witness(*terms, spare=self.spare, known=known) or known
        every = lines or range(len(self.table.lines))
        if not self._admits(witness) or any(self._matches(at, witness) != bool(lines) for at in every):
            raise _UnrealError
        return witness

    def tried(self, snapshot: Snapshot | None = None, lines: Sequence[int] = ()) -> set[int]:
        """Return the lines that match an input, the one of Z3's last answer where none is given.

        Raises:
            _UnrealError: It is no input of the table's, or one of `lines` does not match it.
        """
        there = self.asked.model() if snapshot is None else snapshot
        if not self._admits(there):
            raise _UnrealError
        found = {at for at in range(len(self.table.lines)) if self._matches(at, there)}
        if not found.issuperset(lines):
            raise _UnrealError
        self.matched |= found
        return found

    def _admits(self, snapshot: Snapshot) -> bool:
        """Return whether the values are in their ranges, and the assumptions hold."""
        for variable in shown(self.program, self.table):
            low, high = key_bounds(variable.type)
            if not low <= key_of(variable.type, snapshot[variable.name]) <= high:
                return False
        return all(_is_so(each.condition, snapshot) for each in self.program.assumed(self.table))

    def _matches(self, at: int, snapshot: Snapshot) -> bool:
        return all(test is None or _is_so(test, snapshot) for test in self.table.lines[at].tests)


def _is_so(condition: Expr | Test, snapshot: Snapshot) -> bool:
    try:
        return holds(condition, snapshot)
    except UNDEFINED:
        return False
