"""Z3 asked what masks, counting and region trees have answered; two queries a table.

In: a table and what was found. Out: whether Z3 agrees.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from enum import Enum, auto

from rcsc.lang.leaves import operands, read_by
from rcsc.lang.model import Apply, Expr, Program, Real, Snapshot, Table, Variable
from rcsc.lang.operator_table import CALCULATIONS
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic.encode import declared, encode, least_witness
from rcsc.proof.table.certificate import must_cover
from rcsc.proof.table.verdict import Gap, Overlap, TableFinding, Undecided, refutes


def shown(program: Program, table: Table) -> list[Variable]:
    """Return the variables of a witness, in declared order: those that the table or its assumptions read."""
    assumed = (assumption.condition for assumption in program.assumed(table))
    wanted = set(table.variables).union(*map(read_by, assumed))
    return [variable for variable in program.variables if variable.name in wanted]


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
                [self._test(test.condition, id(test)) for test in self.table.lines[at].tests if test]
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

    def witness(self, *terms: Term, spare: smt.Budget | None = None) -> Snapshot | None:
        """Return the least input for which the terms hold; None where the solver gives up.

        `spare`, if given, is the budget for finding the least one once some input is known.
        """
        self.solver.push()
        self.solver.add(*terms)
        witness = least_witness(self.solver, shown(self.program, self.table), self.frame, spare)
        self.solver.pop()
        return witness

    def holds(self, *terms: Term) -> Answer:
        """Ask whether the terms can hold together."""
        return self.solver.check(*terms)


_COSTLY = 60_000
"""Lines times columns above which Z3 takes more than about a second (`tests/bench`)."""
_STEPS = 20_000_000
"""Budget of each question that is asked only because it should be cheap."""


class Agreement(Enum):
    """Z3's answer about the verdict."""

    AGREES = auto()
    DISAGREES = auto()
    NOT_ASKED = auto()
    UNKNOWN = auto()


def worth_asking(table: Table, options: Options) -> bool:
    """Return whether to ask Z3: by the option, else by the estimated cost."""
    if options.solver == "both":
        return True
    cells = sum(1 for line in table.lines for test in line.tests if test is not None)
    return options.solver == "auto" and cells * len(table.lines) <= _COSTLY


def confirm(
    program: Program, table: Table, findings: tuple[TableFinding, ...], options: Options
) -> Agreement:
    """Compare the findings with Z3's answers to two questions: do two lines overlap, and is there a gap?"""
    if not worth_asking(table, options) or any(isinstance(finding, Undecided) for finding in findings):
        return Agreement.NOT_ASKED
    if smt.gives_up(
        "whether Z3 agrees"
    ):  # before anything is put into its words, which takes longer than to ask
        return Agreement.UNKNOWN
    if options.solver == "auto":
        steps = WRONG_STEPS // 3 if refutes(table, findings) else _STEPS
        options = replace(options, steps=min(options.steps, steps))
    asked = TableSolver(program, table, options)
    gaps = [finding for finding in findings if isinstance(finding, Gap)]
    gap = _some_gap(asked, gaps) if must_cover(table) or gaps else None  # while the solver knows no line
    if gap is Answer.UNKNOWN:
        return Agreement.UNKNOWN
    overlap = _some_overlap(asked)
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


def _some_overlap(asked: TableSolver) -> Answer:
    """Ask whether two lines can match at once, by asking of each line together with all before it."""
    terms = []
    seen = smt.truth(False)
    from rcsc.lang.model import Bool

    for at in range(len(asked.table.lines)):
        bit = smt.variable(f"line!{at}", Bool())
        before = seen
        seen = smt.variable(f"seen!{at}", Bool())
        asked.solver.add(smt.equal(bit, asked.line(at), Bool()))
        asked.solver.add(smt.equal(seen, smt.any_of([before, bit]), Bool()))
        terms.append(smt.all_of([before, bit]))
    return asked.holds(smt.any_of(terms))
