"""Symbolic runs of statements.

In: statements and a state. Out: the state after them, and what they owe (`evaluation`). Every way through
`if` and `case` is followed once; states are merged after. Loops are unrolled, calls run in place.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self, assert_never

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.model import (
    Assign,
    Bool,
    Call,
    Case,
    Expr,
    For,
    If,
    Int,
    Local,
    OneTable,
    Place,
    Procedure,
    Program,
    Real,
    Scalar,
    Statement,
    Table,
    TableChoice,
    ToElement,
    ToLeaf,
    ToLocal,
    pending,
    spell,
)
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import Evaluation, ExternResults, State
from rcsc.proof.symbolic.values import FALSE, TRUE, Node


@dataclass(slots=True)
class Run(Evaluation):
    """One symbolic run."""

    @classmethod
    def of(cls, program: Program, start: dict[str, Node]) -> Self:
        """Return a run of a program from these leaves; those that it meets besides may have any value."""
        return cls({str(procedure.name): procedure for procedure in program.procedures}, program.kinds, start)

    def execute(self, body: Iterable[Statement]) -> None:
        """Runs statements; the state is changed."""
        for statement in body:
            if self.path is FALSE:
                return
            self.step()
            match statement:
                case Assign(place=place, value=value):
                    self._assign(place, value)
                case Local(name=name, type=kind, value=value):
                    self._declare(name, kind, value)
                case If(condition=condition, then=then, orelse=orelse):
                    self._branch(self.evaluate(condition), then, orelse)
                case Case():
                    self._case(statement)
                case For(name=name, low=low, high=high, body=inner):
                    for count in range(low, high + 1):
                        self.state.local[name] = values.constant(Int(low, high), count)
                        self.execute(inner)
                case Call(procedure=name, args=args):
                    self.call(self.procedures[name], [(arg.span, self.evaluate(arg)) for arg in args])
                case _:
                    assert_never(statement)

    def settle(self, program: Program) -> None:
        """Write each pending value whose condition holds, all conditions evaluated before (`lang.interpret.settle`)."""
        deferred = [
            (variable, variable.deferred_until)
            for variable in program.variables
            if variable.deferred_until is not None
        ]
        ready = [self.evaluate(until) for _, until in deferred]
        later = [self.leaf(pending(variable.name)) for variable, _ in deferred]
        for (variable, _), when, value in zip(deferred, ready, later, strict=True):
            self.write(variable.name, value, when)
        for leaf in program.line_leaves.values():
            self.write(leaf, values.constant(self.kinds[leaf], 0), TRUE)

    def chosen(self, choice: TableChoice) -> dict[str, Node]:
        """Return the condition under which each table of a choice runs, now that what selects it is computed."""
        if isinstance(choice, OneTable):
            return {str(choice.table): TRUE}
        selector = self.evaluate(choice.selector)
        conditions: dict[str, Node] = {}
        for value, name in choice.tables:
            here = values.equal(selector, values.constant(selector.kind, value))
            conditions[str(name)] = values.either(conditions.get(str(name), FALSE), here)
        return conditions

    def _stored(self, kind: Scalar, value: Node, what: str, span: Span) -> Node:
        """Return the value as kept in a place of this type."""
        if not isinstance(kind, Int | Real):
            return value
        ends = f"{spell(kind, kind.low)} .. {spell(kind, kind.high)}"
        message = f"the value can lie outside {ends}, the range of `{what}`"
        return self.owe_inside(Code.ASSIGNED_RANGE, value, (kind.low, kind.high), message, span)

    def _assign(self, place: Place, value: Expr) -> None:
        result = self.evaluate(value)
        match place:
            case ToElement(leaves=leaves, type=kind):
                what = leaves[0].rpartition("[")[0] or leaves[0]
                self._set_element(place, self._stored(kind, result, what, value.span))
            case ToLeaf(name=name, type=kind):
                self.write(name, self._stored(kind, result, name, value.span), TRUE)
            case ToLocal(name=name, type=kind):
                self.state.local[name] = self._stored(kind, result, name, value.span)
                self.state.assigned.pop(name, None)
            case _:
                assert_never(place)

    def write(self, leaf: str, value: Node, when: Node) -> None:
        """Writes a leaf, where `when` holds."""
        if when is not TRUE:
            value = values.choice(when, value, self.leaf(leaf))
        if self.ended is not FALSE:
            value = values.choice(self.ended, self.leaf(leaf), value)
        self.state.leaves[leaf] = value
        self.state.wrote[leaf] = values.either(self.state.wrote.get(leaf, FALSE), when)

    def _set_element(self, place: ToElement, value: Node) -> None:
        index = self.index(place.index, len(place.leaves))
        low, high = max(int(index.low), 0), min(int(index.high), len(place.leaves) - 1)
        self.step(max(high - low, 0))
        for at in range(low, high + 1):
            self.write(place.leaves[at], value, values.equal(index, values.constant(index.kind, at)))

    def _declare(self, name: str, kind: Scalar, value: Expr | None) -> None:
        self.state.local.pop(name, None)
        self.state.assigned[name] = FALSE
        if value is not None:
            self.state.local[name] = self._stored(kind, self.evaluate(value), name, value.span)
            del self.state.assigned[name]

    def _branch(self, condition: Node, then: tuple[Statement, ...], orelse: tuple[Statement, ...]) -> None:
        if condition.known:
            self.execute(then if condition.low else orelse)
            return
        before = self.state
        self.state = before.copy()
        with self.where(condition):
            self.execute(then)
        taken, self.state = self.state, before.copy()
        with self.where(condition, holds=False):
            self.execute(orelse)
        self.state = self._merged(condition, taken, self.state)

    def _case(self, statement: Case) -> None:
        """Run the arms, which are disjoint, so that their order does not matter."""
        subject = self.evaluate(statement.subject)
        self._arms(
            [(values.among(subject, arm.values), arm.body) for arm in statement.arms], statement.orelse
        )

    def run_choice(self, choice: TableChoice, tables: Mapping[str, Table]) -> None:
        """Run the table of a choice, of which one line matches."""
        arms: list[tuple[Node, list[Statement]]] = []
        for name, here in self.chosen(choice).items():
            table, none = tables[name], here
            for line in table.lines:
                match = values.both(here, values.all_of(map(self.evaluate, line.conditions)))
                arms.append((match, [action.statement for action in line.actions]))
                none = values.both(none, values.negation(match))
            if table.default is not None:
                arms.append((none, [action.statement for action in table.default.actions]))
        self._arms(arms, ())

    def _arms(
        self, conditions: Sequence[tuple[Node, Iterable[Statement]]], orelse: Iterable[Statement]
    ) -> None:
        """Run what stands under the one condition that holds, else `orelse`."""
        before, outer, facts = self.state, self.path, self.facts
        arms: list[tuple[Node, State]] = []
        left = TRUE
        for chosen, body in conditions:
            if chosen is not FALSE:
                self.state = before.copy()
                with self.where(chosen):
                    self.execute(body)
                arms.append((chosen, self.state))
            left = values.both(left, values.negation(chosen))
        self.state, self.path, self.facts = before.copy(), values.both(outer, left), dict(facts)
        values.learn(left, self.facts)
        self.execute(orelse)
        self.path, self.facts = outer, facts
        for chosen, state in reversed(arms):
            self.state = self._merged(chosen, state, self.state)

    def _merged(self, condition: Node, then: State, orelse: State) -> State:
        """Merge states: `then` where the condition holds, else `orelse`."""
        self.step(len(then.leaves) + len(orelse.leaves))
        self.state = State()

        def leaf(state: State, name: str) -> Node:
            return state.leaves[name] if name in state.leaves else self.leaf(name)

        leaves = {
            name: values.choice(condition, leaf(then, name), leaf(orelse, name))
            for name in {**then.leaves, **orelse.leaves}
        }
        local = {**orelse.local, **then.local}  # a local that only one of the two has is that one's
        for name in then.local.keys() & orelse.local.keys():
            local[name] = values.choice(condition, then.local[name], orelse.local[name])
        assigned = _joined(condition, then.assigned, orelse.assigned, TRUE)
        wrote = _joined(condition, then.wrote, orelse.wrote, FALSE)
        return State(leaves, local, assigned, wrote)

    # --- calls ---

    def call(self, procedure: Procedure, args: list[tuple[Span, Node]]) -> None:
        """Runs a procedure in place; an extern one gives any values in range."""
        given = {
            param.name: self._stored(param.type, value, param.name, span)
            for param, (span, value) in zip(procedure.params, args, strict=True)
        }
        if procedure.extern is not None:
            self._extern(procedure)
            return
        outer = self.state.local, self.state.assigned
        self.state.local, self.state.assigned = given, {}
        self.execute(procedure.body)
        self.state.local, self.state.assigned = outer

    def _extern(self, procedure: Procedure) -> None:
        """Admit its results in order; the cycle ends at the first that is refused."""
        path = values.both(self.path, values.negation(self.ended))
        given, refused = list[Node](), list[Node]()
        for name in procedure.writes:
            if self.stops is not None:
                self.stops(self, procedure.name)
            value = self.any_value(f"{name} from {procedure.name}", self.kinds[name])
            given.append(value)
            refused.append(self._refusal(f"{name} refused from {procedure.name}"))
            self.write(name, value, TRUE)
        self.answered.append(ExternResults(str(procedure.name), path, tuple(given), tuple(refused)))

    def _refusal(self, name: str) -> Node:
        """Return where the result is refused, if the run follows that; there the cycle ends."""
        if not self.refusals:
            return FALSE
        refused = self.any_value(name, Bool())
        self.ended = values.either(self.ended, values.both(self.path, refused))
        return refused


def _joined(
    condition: Node, then: dict[str, Node], orelse: dict[str, Node], otherwise: Node
) -> dict[str, Node]:
    return {
        name: values.choice(condition, then.get(name, otherwise), orelse.get(name, otherwise))
        for name in {**then, **orelse}
    }
