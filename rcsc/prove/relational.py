"""Tables with conditions across variables, or that rely on assumptions: a region tree, and Z3 for witnesses.

In: a table. Out: what is wrong with it, and the tree that shows it right. Leaves that linear arithmetic cannot settle are asked
of Z3, in one solver; *unknown* is a finding, never a proof.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from rcsc.interpret import evaluate, matching_lines
from rcsc.model import AssumptionName, Expr, Line, Program, Read, Select, Snapshot, Table, Value, value_of_key
from rcsc.prove import smt
from rcsc.prove.atoms import Universe, assumptions_of, lines_of
from rcsc.prove.certificate import must_cover, tree_certificate
from rcsc.prove.encode import Frame, declared, encode, least_witness
from rcsc.prove.options import Options
from rcsc.prove.regions import Answer as RegionAnswer
from rcsc.prove.regions import Question
from rcsc.prove.search import Tree
from rcsc.prove.smt import Answer, Solver, Term
from rcsc.prove.verdict import ContradictoryAssumptions, DeadLine, Found, Gap, Overlap, Undecided
from rcsc.questions import parts, question


@dataclass(frozen=True, slots=True)
class Decided:
    """What was found, the certificate of a table in order, and the assumptions that were needed."""

    found: tuple[Found, ...]
    certificate: Mapping[str, object] | None
    used: tuple[AssumptionName, ...]
    asked: int


class Asked:
    """One solver that knows the table's domain and assumptions, and each line as a literal."""

    def __init__(self, program: Program, table: Table, options: Options) -> None:
        self.program, self.table = program, table
        self.frame, domain = declared(program.variables)
        self.solver = Solver(options.timeout_ms, options.memory_mb)
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
        wanted = set(self.table.variables) | {
            name
            for a in self.program.assumptions
            if a.name in self.table.assumptions
            for name in _reads(a.condition)
        }
        variables = [v for v in self.program.variables if v.name in wanted]
        self.solver.push()
        self.solver.add(*terms)
        found = least_witness(self.solver, variables, self.frame)
        self.solver.pop()
        return found

    def holds(self, *terms: Term) -> Answer:
        """Whether the terms can hold together."""
        return self.solver.check(*terms)


def _reads(expr: Expr) -> list[str]:

    return [
        name
        for part in parts(expr)
        for name in (
            (part.name,) if isinstance(part, Read) else part.leaves if isinstance(part, Select) else ()
        )
    ]


def decide(program: Program, table: Table, options: Options) -> Decided:
    """Decides the table under its assumptions."""
    asked = Asked(program, table, options)
    if table.assumptions:
        possible = asked.holds()
        if possible is not Answer.SATISFIABLE:
            wrong: Found = (
                ContradictoryAssumptions()
                if possible is Answer.UNSATISFIABLE
                else Undecided("the assumptions")
            )
            return Decided((wrong,), None, (), asked.solver.queries)
    universe = Universe()
    lines = lines_of(universe, table)
    assumptions = assumptions_of(universe, program, table)
    search = Tree(
        universe, lines, assumptions, lambda q: _oracle(asked, universe, q), default=not must_cover(table)
    ).run()
    found = _findings(asked, search.overlaps.keys(), search.witnesses, bool(search.gaps))
    if search.undecided:
        found = (*found, Undecided(f"{search.undecided} regions of the input space"))
    if must_cover(table) is False:
        found = (*found, *_default(asked))
    found = (*found, *_dead(asked))
    used = tuple(table.assumptions[at] for at in sorted(search.used))
    certificate = (
        tree_certificate(program, table, universe, search.nodes, table.assumptions) if search.proved else None
    )
    return Decided(found, certificate, used, asked.solver.queries)


def _oracle(asked: Asked, universe: Universe, q: Question) -> Snapshot | RegionAnswer:
    """Z3's answer about a region, as the tree asks it."""
    bounds = {
        tuple((universe.columns[column].name, k) for column, k in universe.forms[form]): (low, high)
        for form, low, high in q.bounds
    }
    conditions = question(asked.program, asked.table, asked.table.assumptions, bounds, q.candidates)
    terms = [encode(condition, asked.frame) for condition in conditions]
    answer = asked.holds(*terms)
    if answer is Answer.UNSATISFIABLE:
        return RegionAnswer.NONE
    if answer is Answer.UNKNOWN:
        return RegionAnswer.UNKNOWN
    return _model(asked, asked.frame)


def _model(asked: Asked, frame: Frame) -> Snapshot:
    return {v.name: asked.solver.value(frame.leaves[v.name], v.type) for v in asked.program.variables}


def _findings(asked: Asked, pairs: object, witnesses: list[Snapshot], gap: bool) -> tuple[Found, ...]:
    """Overlaps with their least witnesses, and the gap."""
    assert isinstance(pairs, type({}.keys()))
    table = asked.table
    names = [line.name for line in table.lines]
    all_pairs: set[tuple[int, int]] = set(pairs)
    for seen in witnesses:
        matching = [names.index(name) for name in matching_lines(table, seen)]
        all_pairs.update((one, two) for at, one in enumerate(matching) for two in matching[at + 1 :])
        gap = gap or not matching
    found: list[Found] = []
    for first, second in sorted(all_pairs):
        witness = asked.witness(asked.line(first), asked.line(second))
        pair = f"lines `{names[first]}` and `{names[second]}`"
        found.append(Undecided(pair) if witness is None else Overlap(first, second, witness))
    if gap and must_cover(table):
        found.extend(_gap(asked))
    return tuple(found)


def _gap(asked: Asked) -> list[Found]:
    witness = asked.witness(asked.none())
    return [Undecided("the gap")] if witness is None else [Gap((witness,), (None,))]


def _default(asked: Asked) -> list[Found]:
    """What falls to a DEFAULT line, if anything does."""
    answer = asked.holds(asked.none())
    if answer is Answer.UNSATISFIABLE:
        return []
    return [Undecided("what falls to DEFAULT")] if answer is Answer.UNKNOWN else _gap(asked)


def _dead(asked: Asked) -> list[Found]:
    """Lines that no input matches."""
    found: list[Found] = []
    for at, line in enumerate(asked.table.lines):
        if _plainly_alive(asked, line):
            continue
        answer = asked.holds(asked.line(at))
        if answer is Answer.UNSATISFIABLE:
            found.append(DeadLine(at))
        elif answer is Answer.UNKNOWN:
            found.append(Undecided(f"whether line `{line.name}` can match"))
    return found


def _plainly_alive(asked: Asked, line: Line) -> bool:
    """Whether the least values that its boxes allow match it: no need to ask."""
    if asked.table.assumptions:
        return False
    values: dict[str, Value] = {v.name: v.initial for v in asked.program.variables}

    kinds = {v.name: v.type for v in asked.program.variables}
    for test in line.tests:
        if test is not None and test.box:
            values[test.variables[0]] = value_of_key(kinds[test.variables[0]], test.box[0][0])
    try:
        return all(test is None or bool(evaluate(test.condition, values)) for test in line.tests)
    except ArithmeticError:
        return False
