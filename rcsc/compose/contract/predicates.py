"""What the invariants may speak of: predicates of a state, truth values or members of an enumeration of any size.

In: one cycle from any state, and the nodes that are to be proved. Out: the `Predicate`s in their cone. Nothing here names a table or
a state; all of it is read from the model:

- truth values and enumerations that conditions of tables, assumptions or the contract read, and flags;
- whether two leaves are equal that the level itself compares: an order and the last one, a number and the one seen;
- whether what a cycle looks back at is the value that it was, and what cells and properties say of it;
- whether a number is in a class of values that a cell of a table distinguishes;
- whether a condition has held for a time;
- whether a test variable still is what its module would compute now: a module that reads only inputs gives the same result
  while they stay, so that a line that matches again does the same again.
"""

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from rcsc.code.testing.inputs.condition_text import words
from rcsc.compose.contract.transition import GHOST, Cycle, Leaves, TransitionSystem
from rcsc.lang.interpret import call, holds
from rcsc.lang.leaves import everything, expressions, parts, read_by, renamed
from rcsc.lang.meaning import spelled
from rcsc.lang.model import (  # fmt: skip
    COMPARISONS,
    Apply,
    Bool,
    Call,
    Enum,
    Expr,
    If,
    Int,
    Kind,
    Literal,
    Op,
    Procedure,
    Program,
    Read,
    Scalar,
    Select,
    Value,
    VariableName,
    key_of,
    pending,
    spell,
)
from rcsc.lang.operator_table import is_division
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import Node

CLOSELY = 2
"""The highest `closely`: each step retries what is not proved with more predicates."""


@dataclass(frozen=True, slots=True)
class Predicate:
    """A leaf's truth value or member; or whether the leaf equals another leaf, or the value that a module computes for it.

    Attributes:
        parts: Whether it partitions the states.
        procedures: Those that the module may call.
    """

    leaf: str
    kind: Scalar
    other: str = ""
    module: Procedure | None = field(default=None, repr=False)
    condition: Expr | None = field(default=None, repr=False)
    parts: bool = False
    procedures: Mapping[str, Procedure] = field(default_factory=dict, repr=False, compare=False)

    @property
    def name(self) -> str:
        """Its name in the tables' words."""
        if self.condition is not None:
            return f"({self.leaf})"
        if self.module is not None:
            return f"({self.leaf} is as `{self.module.name}` computes it)"
        return f"({self.leaf} = {self.other})" if self.other else self.leaf

    def says(self, value: int) -> str:
        """Return in the language's words that it has a value."""
        if self.condition is None:
            return f"{self.name} = {self.shown(value)}"
        return f"{'' if value else 'not '}({words(self.condition)})"

    def of(self, leaves: Container[str]) -> bool:
        """Return whether it speaks of these leaves alone, in words that the language has."""
        if self.condition is not None:
            return all(str(name) in leaves for name in read_by(self.condition))
        return self.module is None and self.leaf in leaves and (not self.other or self.other in leaves)

    @property
    def size(self) -> int:
        """The number of its values."""
        return len(self.kind.members) if isinstance(self.kind, Enum) else 2

    def node(self, leaves: Leaves) -> Node:
        """Return its value in a state."""
        if self.condition is not None:
            return Run({}, {}, dict(leaves)).evaluate(self.condition)
        if self.module is not None:
            kinds = {name: node.kind for name, node in leaves.items()}
            run = Run(self.procedures, kinds, dict(leaves))
            run.execute((Call(self.module.name),))
            return values.equal(leaves[self.leaf], run.leaf(self.leaf))
        return values.equal(leaves[self.leaf], leaves[self.other]) if self.other else leaves[self.leaf]

    def shown(self, value: int) -> str:
        """Return a value in the tables' words."""
        return spell(self.kind, value)


def cone(cycle: Cycle, obligations: Iterable[Node]) -> frozenset[str]:
    """Find the leaves whose values before a cycle can influence the nodes, in this cycle or a later one."""
    owed = list(obligations)
    reads = values.each_reads([*owed, *cycle.after.values()])
    of_leaf = dict(zip(cycle.after, reads[len(owed) :], strict=True))
    leaves: set[str] = set()
    waiting = frozenset[str]().union(*reads[: len(owed)])
    while new := (waiting & cycle.before.keys()) - leaves:
        leaves |= new
        waiting = frozenset[str]().union(*(of_leaf[name] for name in new))
    return frozenset(leaves)


def predicates(ts: TransitionSystem, inside: frozenset[str], closely: int = 0) -> tuple[Predicate, ...]:
    """Choose the predicates in the cone of the obligations, in declared order.

    Args:
        ts: The level.
        inside: The cone.
        closely: From 1 on, those on which procedures branch come after the others.
    """
    program, kinds = ts.program, ts.kinds
    read = _read(ts)
    computed = {leaf: module for leaf, module in _computed(ts) if leaf in read}
    chosen = [
        name
        for name, kind in kinds.items()
        if listed(kind) and (name in computed or (name in inside and (name in read or _flag(program, name))))
    ]
    parting = {
        *_selector(ts),
        *(name for name in chosen if _flag(program, name) and name not in computed),
    }
    selected = [Predicate(name, kinds[name], parts=name in parting) for name in chosen]
    pairs = sorted({*compared(program), *_questions(ts), *_kept(program)})
    selected += [
        Predicate(leaf, Bool(), other) for leaf, other in pairs if {leaf, other} <= inside and leaf in kinds
    ]
    selected += [
        Predicate(leaf, Bool(), module=module, procedures=ts.procedures) for leaf, module in computed.items()
    ]
    selected += _cells(ts, {*inside, *computed})
    selected += _durations(ts, inside)
    if closely:
        selected += _branches(ts, inside, {predicate.leaf for predicate in selected})
        selected += _cells_looked_back_at(ts, inside)
    return tuple(selected)


def _kept(program: Program) -> Iterator[tuple[str, str]]:
    """Pair each kept copy of an earlier value with its leaf: after every cycle but a fault they are equal."""
    yield from ((str(v.name), str(v.previous_of)) for v in program.variables if v.previous_of is not None)


def point(ts: TransitionSystem, chosen: tuple[Predicate, ...], state: Mapping[str, Value]) -> tuple[int, ...]:
    """Evaluate the predicates in a state that was reached; modules are run by the interpreter."""
    again: dict[str, dict[str, Value]] = {}
    coordinates = []
    for predicate in chosen:
        if predicate.condition is not None:
            coordinates.append(int(holds(predicate.condition, state)))
        elif predicate.module is not None:
            if predicate.module.name not in again:
                again[predicate.module.name] = dict(state)
                call(ts.program, predicate.module.name, [], again[predicate.module.name])
            coordinates.append(int(state[predicate.leaf] == again[predicate.module.name][predicate.leaf]))
        elif predicate.other:
            coordinates.append(int(state[predicate.leaf] == state[predicate.other]))
        else:
            coordinates.append(key_of(predicate.kind, state[predicate.leaf]))
    return tuple(coordinates)


def listed(kind: Scalar) -> bool:
    """Return whether a type has few enough values to list: truth values, members."""
    return isinstance(kind, Bool | Enum)


def _flag(program: Program, name: str) -> bool:
    """Return whether the name is a truth value that the level itself keeps."""
    return any(
        v.name == name and isinstance(v.type, Bool) and v.kind is Kind.STATE for v in program.variables
    )


def _read(ts: TransitionSystem) -> set[str]:
    """Collect the leaves that decide which line runs or that the contract is about, and their pending values."""
    program, level = ts.program, ts.level
    conditions = [assumption.condition for assumption in program.assumptions]
    conditions += _tested(program)
    conditions += level.selectors
    leaves = {str(name) for condition in conditions for name in read_by(condition)}
    leaves |= {leaf for below in ts.links.below for leaf in (below.command, *below.held)}
    leaves |= {f"{GHOST}{asked.into}" for asked in ts.links.asked}
    return leaves | {
        str(pending(v.name)) for v in program.variables if v.deferred_until is not None and v.name in leaves
    }


def _tested(program: Program) -> Iterator[Expr]:
    """List the conditions of all lines."""
    for table in program.tables:
        for line in table.lines:
            yield from line.conditions


def _in_procedures(program: Program) -> Iterator[Expr]:
    """List what the statements of all procedures calculate."""
    for procedure in program.procedures:
        for statement in everything(procedure.body):
            yield from expressions(statement)


def _computed(ts: TransitionSystem) -> Iterator[tuple[str, Procedure]]:
    """Find the leaves that a preprocess module computes from inputs, flags and its own leaves."""
    variables = {str(v.name): v for v in ts.program.variables}
    for name in ts.level.preprocess:
        module = ts.procedures[name]
        own = set(map(str, module.writes))
        run = Run(ts.procedures, ts.kinds, ts.havoc())
        run.execute((Call(module.name),))
        if run.fresh:
            continue  # its result is not a function of the state
        for leaf in map(str, module.writes):
            used = values.variables([run.leaf(leaf)])
            if all(
                source in own or variables[source].kind is Kind.INPUT or _flag(ts.program, source)
                for source in used
            ):
                yield leaf, module


def _cells(ts: TransitionSystem, inside: Container[str]) -> Iterator[Predicate]:
    """Make predicates of cells that compare numbers."""
    kinds, seen = ts.kinds, set()
    for table in ts.program.tables:
        for at, column in enumerate(table.columns):
            for test in (line.tests[at] for line in table.lines):
                if test is None or all(listed(kinds[leaf]) for leaf in test.variables):
                    continue
                name = spelled(test.condition)
                if name not in seen and all(leaf in inside for leaf in test.variables):
                    seen.add(name)
                    yield Predicate(f"{column.heading} {test.text}", Bool(), condition=test.condition)


def _durations(ts: TransitionSystem, inside: Container[str]) -> Iterator[Predicate]:
    """Make predicates of whether conditions have held for the times that tables and procedures ask for."""
    program, seen = ts.program, set()
    counters = {v.name for v in program.variables if v.counts is not None}
    for condition in (*_tested(program), *_in_procedures(program)) if counters else ():
        for part in parts(condition):
            match part:
                case Apply(op=Op.GE, args=(Read(name=leaf), Literal())) if (
                    leaf in counters and leaf in inside
                ):
                    name = spelled(part)
                    if name not in seen:
                        seen.add(name)
                        yield Predicate(name, Bool(), condition=part)


def _cells_looked_back_at(ts: TransitionSystem, inside: Container[str]) -> Iterator[Predicate]:
    """Make predicates of cells about the inputs of the cycle before, where a fact about their change carries them on."""
    kept, seen = looked_back_at(ts.program), set()
    for table in ts.program.tables:
        for condition in (condition for line in table.lines for condition in line.conditions):
            before = renamed(condition, lambda name: kept.get(name, name))
            name, leaves = spelled(before), set(map(str, read_by(before)))
            if before == condition or name in seen or not all(leaf in inside for leaf in leaves):
                continue
            seen.add(name)
            if always_defined(before) and not all(listed(ts.kinds[leaf]) for leaf in leaves):
                yield Predicate(name, Bool(), condition=before)


def always_defined(condition: Expr) -> bool:
    """Return whether no value of its leaves makes the condition undefined, as far as its operators say."""
    return not any(isinstance(part, Select) or _may_fail(part) for part in parts(condition))


def _may_fail(part: Expr) -> bool:
    match part:
        case Apply(op=op, args=args) if is_division(op):
            divisor = args[1]
            return not (isinstance(part.type, Int) and isinstance(divisor, Literal) and divisor.value)
        case Apply(op=Op.TO_INT, args=(operand,)):
            return not isinstance(operand.type, Bool)
    return False


def looked_back_at(program: Program) -> dict[VariableName, VariableName]:
    """Map each input that something looks back at to the state that keeps its earlier value."""
    inputs = {v.name for v in program.variables if v.kind is Kind.INPUT}
    return {v.previous_of: v.name for v in program.variables if v.previous_of in inputs}


def _branches(ts: TransitionSystem, inside: Container[str], there: Container[str]) -> Iterator[Predicate]:
    """Make predicates of the conditions in procedures: truth values, members, numbers compared with constants."""
    kinds, seen = ts.kinds, set()
    for condition in _decisions(ts.program):
        for name in dict.fromkeys(map(str, read_by(condition))):
            if name in inside and listed(kinds[name]) and name not in there and name not in seen:
                seen.add(name)
                yield Predicate(name, kinds[name])
        for part in parts(condition):
            match part:
                case Apply(op=op, args=(Read(name=leaf), Literal())) if op in COMPARISONS:
                    name = spelled(part)
                    if name not in seen and leaf in inside and not listed(kinds[leaf]):
                        seen.add(name)
                        yield Predicate(name, Bool(), condition=part)


def _decisions(program: Program) -> Iterator[Expr]:
    """List the conditions of two-way choices."""
    for procedure in program.procedures:
        for statement in everything(procedure.body):
            if isinstance(statement, If):
                yield statement.condition


def compared(program: Program) -> Iterator[tuple[str, str]]:
    """Find pairs of leaves that a procedure or a deferral compares for equality."""
    conditions = (v.deferred_until for v in program.variables if v.deferred_until is not None)
    for condition in (*conditions, *_in_procedures(program)):
        for part in parts(condition):
            match part:
                case Apply(op=Op.EQ | Op.NE, args=(Read(name=left), Read(name=right))) if left != right:
                    yield min(str(left), str(right)), max(str(left), str(right))
                case _:
                    pass


def _questions(ts: TransitionSystem) -> Iterator[tuple[str, str]]:
    """Pair each key of a database question as last asked with the key as it is now."""
    for asked in ts.links.asked:
        for key in asked.keys:
            yield f"{GHOST}{asked.into} {key}", key


def _selector(ts: TransitionSystem) -> Iterator[str]:
    """List the leaves that select a table."""
    for selector in ts.level.selectors:
        yield from map(str, read_by(selector))
