"""A digest of all that a part of a program means, so that what did not change is known without a solver.

In: a program, or one of its parts. Out: text; equal texts mean the same. Positions, doc lines, comments and the words of a
cell are left out; names of lines are not, since logs and executors show them.
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from rcsc.lang.leaves import called_by, closure, everything, expressions, read_by, written_by
from rcsc.lang.meaning import checked
from rcsc.lang.model import (
    Action,
    Assumption,
    Call,
    Expr,
    Procedure,
    Program,
    Statement,
    Table,
    Test,
    Variable,
)


@dataclass(slots=True)
class Digests:
    """Digests of one program's parts."""

    program: Program
    procedures: dict[str, Procedure] = field(init=False)
    variables: dict[str, Variable] = field(init=False)
    assumptions: dict[str, Assumption] = field(init=False)

    def __post_init__(self) -> None:
        self.procedures = {str(procedure.name): procedure for procedure in self.program.procedures}
        self.variables = {str(variable.name): variable for variable in self.program.variables}
        self.assumptions = {str(assumption.name): assumption for assumption in self.program.assumptions}

    def table(self, table: Table) -> str:
        """Digest a table: its lines, what they run, its assumptions and invariants, and the types of what it touches."""
        hashed = hashlib.sha256(b"table\n")
        known: dict[int, str] = {}
        lines: list[tuple[object, ...]] = [
            (line.name, [_stated(test, known) for test in line.stated], _statements(line.actions))
            for line in table.lines
        ]
        if table.default is not None:
            lines.append((table.default.name, table.default.unreachable, _statements(table.default.actions)))
        for line in lines:
            hashed.update(repr(line).encode())
        conditions = [self.assumptions[name].condition for name in table.assumptions]
        stated = [
            (name, self.assumptions[name].standing, repr(self.assumptions[name].condition))
            for name in table.assumptions
        ]
        kept = [(invariant.name, repr(invariant.condition)) for invariant in self.program.invariants]
        hashed.update(repr((stated, kept)).encode())
        body = [action.statement for line in table.every_line for action in line.actions]
        conditions += [test.condition for test in table.distinct_tests]
        conditions += [invariant.condition for invariant in self.program.invariants]
        hashed.update(self._rest(body, conditions).encode())
        return hashed.hexdigest()

    def whole(self) -> str:
        """Digest all that a cycle does with a state: variables, tables, procedures, levels, and each assumption that it checks.

        Whatever the program's files are called.

        Returns:
            64 hexadecimal digits.
        """
        program = self.program
        variables = [
            (v.name, v.kind, v.type, v.initial, v.admit, v.deferred_until, v.safe) for v in program.variables
        ]
        procedures = [(p.name, p.params, p.body, p.extern, p.reads, p.writes) for p in program.procedures]
        watched = [
            (program.assumptions[at].name, program.assumptions[at].condition) for at in checked(program)
        ]
        invariants = [(invariant.name, invariant.condition) for invariant in program.invariants]
        levels = [
            (level.name, level.period_ms, level.preprocess, level.choices, level.postprocess)
            for level in program.levels
        ]
        tables = [(table.name, self.table(table), table.stops) for table in program.tables]
        return hashlib.sha256(
            repr((variables, procedures, watched, invariants, levels, tables)).encode()
        ).hexdigest()

    def body(self, body: Iterable[Statement]) -> str:
        """Digest statements and all they call."""
        statements = list(body)
        return repr([repr(statement) for statement in statements]) + self._rest(statements, ())

    def procedure(self, name: str) -> str:
        """Digest a procedure and all it calls."""
        procedure = self.procedures[name]
        return repr(procedure.params) + self.body([Call(procedure.name)])

    def touched(self, body: Iterable[Statement], conditions: Iterable[Expr]) -> set[str]:
        """Leaves that statements, all that they call, and conditions read or write."""
        called = self._called(body)
        leaves = {str(leaf) for condition in conditions for leaf in read_by(condition)}
        for part in (body, *(procedure.body for procedure in called)):
            for statement in everything(part):
                leaves.update(written_by(statement))
                leaves.update(leaf for expr in expressions(statement) for leaf in read_by(expr))
        for procedure in called:
            leaves.update((*procedure.reads, *procedure.writes))
        return leaves

    def _called(self, body: Iterable[Statement]) -> list[Procedure]:
        """Return the procedures that run when the statements do, by name."""
        return [self.procedures[name] for name in sorted(closure(called_by(body), self.procedures))]

    def _rest(self, body: list[Statement], conditions: Iterable[Expr]) -> str:
        """Procedures as they are defined, and variables as they are declared."""
        defined = [repr(replace(procedure, doc="")) for procedure in self._called(body)]
        leaves = sorted(self.touched(body, conditions))
        declared = [(name, repr(self.variables[name].type), self.variables[name].kind) for name in leaves]
        return repr((defined, declared))


def _stated(test: Test, known: dict[int, str]) -> str:
    if id(test) not in known:
        known[id(test)] = repr(test.condition)
    return known[id(test)]


def _statements(actions: Iterable[Action]) -> list[str]:
    return [repr(action.statement) for action in actions]
