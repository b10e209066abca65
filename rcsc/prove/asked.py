"""Z3 asked about one table: its domain and assumptions asserted, its lines as terms.

In: a table. Out: answers and least witnesses. What linear arithmetic settles is not asked here.
"""

from rcsc.model import Expr, Program, Snapshot, Table, Variable
from rcsc.prove import smt
from rcsc.prove.encode import declared, encode, least_witness
from rcsc.prove.options import Options
from rcsc.prove.smt import Answer, Solver, Term
from rcsc.resolve.leaves import read_by


def shown(program: Program, table: Table) -> list[Variable]:
    """The variables of a witness, in declared order: what the table or its assumptions read."""
    assumed = (a.condition for a in program.assumptions if a.name in table.assumptions)
    wanted = set(table.variables).union(*map(read_by, assumed))
    return [variable for variable in program.variables if variable.name in wanted]


class Asked:
    """One solver that knows the table's domain and assumptions, and each line as a literal."""

    def __init__(self, program: Program, table: Table, options: Options) -> None:
        self.program, self.table = program, table
        self.frame, domain = declared(program.variables)
        self.solver = Solver(options.limits)
        self.solver.add(*domain)
        wanted = set(table.assumptions)
        self.solver.add(*[encode(a.condition, self.frame) for a in program.assumptions if a.name in wanted])
        self._lines: dict[int, Term] = {}
        self._tests: dict[int, Term] = {}

    def line(self, at: int) -> Term:
        """That a line matches."""
        if at not in self._lines:
            self._lines[at] = smt.all_of(
                [self._test(test.condition, id(test)) for test in self.table.lines[at].tests if test]
            )
        return self._lines[at]

    def _test(self, condition: Expr, key: int) -> Term:
        if key not in self._tests:
            self._tests[key] = encode(condition, self.frame)
        return self._tests[key]

    def none(self) -> Term:
        """That no line matches."""
        return smt.negation(smt.any_of([self.line(at) for at in range(len(self.table.lines))]))

    def witness(self, *terms: Term) -> Snapshot | None:
        """The least input for which the terms hold; None where the solver gives up."""
        self.solver.push()
        self.solver.add(*terms)
        found = least_witness(self.solver, shown(self.program, self.table), self.frame)
        self.solver.pop()
        return found

    def holds(self, *terms: Term) -> Answer:
        """Whether the terms can hold together."""
        return self.solver.check(*terms)
