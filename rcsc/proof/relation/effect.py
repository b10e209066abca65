"""What actions do, as values: the state after them, what it rests on, and which extern procedures are called.

In: statements of one program, and leaves that another program's run may share. Out: an `Effect`; two of them are the
same where `same_effect` holds. Text plays no part: only what is written matters, and where a run goes wrong.

Nodes that are built alike become one (`Shared`), so that most of what two versions share folds without
a solver.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain

from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.words import bits_alone
from rcsc.lang.leaves import every_expression
from rcsc.lang.model import Expr, Procedure, Program, Scalar, Statement, Table
from rcsc.proof.solvers import smt
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import Obligation
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import CONSTANT, FALSE, NARROWED, TRUE, Node

RUN, CALLS = "whether the actions come to their end", "which extern procedures are called, or with what"
"""What two runs can do otherwise besides leaving a variable different."""


@dataclass(frozen=True, slots=True, eq=False)
class ExternCall:
    """A call of an extern procedure: the cycle may end there, so that what was written before is seen.

    Attributes:
        spelled: Name, number of arguments and implementation, and the leaves that it reads and writes.
        path: When the call is reached.
        given: What it is called with.
        before: The leaves written so far.
    """

    spelled: str
    path: Node
    given: tuple[Node, ...]
    before: Mapping[str, Node]


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """What a run does.

    Attributes:
        leaves: The value after the run of every leaf that it may write.
        wrote: For each of them, when it is written.
        owed: What must hold so that nothing goes wrong: no overflow, no index outside its array, no value out of
            its range. What is owed twice is there once.
        calls: Calls of extern procedures, in order.
    """

    leaves: Mapping[str, Node]
    wrote: Mapping[str, Node]
    owed: tuple[Node, ...]
    calls: tuple[ExternCall, ...]

    @property
    def good(self) -> Node:
        """State that nothing goes wrong."""
        return values.all_of(self.owed)


def words_of(kinds: Mapping[str, Scalar], *programs: Program) -> dict[str, int]:
    """Return the words of which these programs look at bits alone, and their widths: as bits, masks are many times quicker."""
    return bits_alone(chain.from_iterable(map(every_expression, programs)), kinds)


class Shared:
    """Hash-consed nodes, and the leaves that all runs begin with.

    Args:
        kinds: The type of each of these leaves.
        programs: Those of which conditions are asked; words of which they look at bits alone are bits (`words_of`).

    Attributes:
        start: Each leaf as a value.
    """

    def __init__(self, kinds: Mapping[str, Scalar], *programs: Program) -> None:
        self.kinds = kinds
        self._known: dict[tuple[object, ...], Node] = {}
        self._of: dict[Node, Node] = {}
        self._bare: dict[tuple[object, ...], int] = {}
        self._number: dict[Node, int] = {}
        self.start = {name: self.canonical(values.variable(name, kind)) for name, kind in kinds.items()}
        for name, bits in words_of(kinds, *programs).items():
            self.start[name].term = smt.word(name, bits)

    def canonical(self, node: Node) -> Node:
        """Return the node that stands for all built alike."""
        for part in values.parts_first(node):
            if part not in self._of:
                args = tuple(self._of[arg] for arg in part.args)
                key = (part.op, tuple(map(id, args)), part.kind, part.low, part.high, part.name)
                known = self._known.get(key)
                if known is None:
                    same = all(new is old for new, old in zip(args, part.args, strict=True))
                    known = part if same else Node(part.op, args, part.kind, part.low, part.high, part.name)
                    self._known[key] = known
                    self._of[known] = known
                self._of[part] = known
        return self._of[node]

    def equal(self, left: Node, right: Node) -> Node:
        """Equate two values; true where they are built alike, whatever is known of their bounds.

        A kept value is no NaN: that is an obligation.
        """
        return TRUE if self._built(left) == self._built(right) else values.equal(left, right)

    def _built(self, node: Node) -> int:
        """Return a number for how a value is built."""
        for part in values.parts_first(node):
            if part not in self._number:
                args = tuple(self._number[arg] for arg in part.args)
                if part.op == NARROWED:
                    self._number[part] = args[0]
                    continue
                worth = part.low if part.op == CONSTANT else 0
                key = (part.op, args, type(part.kind), part.name, worth)
                self._number[part] = self._bare.setdefault(key, len(self._bare))
        return self._number[node]


@dataclass(slots=True)
class _Followed(Run):
    """A run that notes its calls of extern procedures."""

    calls: list[ExternCall] = field(default_factory=list)

    def call(self, procedure: Procedure, args: list[tuple[Span, Node]]) -> None:
        """Run a call; the results of the n-th extern call have the same names in every run."""
        if procedure.extern is not None:
            given = (*(self.leaf(name) for name in procedure.reads), *(value for _, value in args))
            spelled = f"{procedure.name} {len(args)} {procedure.extern} {procedure.reads} {procedure.writes}"
            self.calls.append(ExternCall(spelled, self.path, given, dict(self.state.leaves)))
        Run.call(self, procedure, args)

    def any_value(self, name: str, kind: Scalar) -> Node:
        """Return a value of which nothing is known, named by its place among the extern calls, or in the run."""
        self.fresh.append(values.variable(f"{name} ({max(1, len(self.calls))})", kind))
        return self.fresh[-1]


@dataclass(slots=True)
class Meaning:
    """Conditions and actions of one program as values over shared leaves.

    Attributes:
        bad: Where a condition that was asked for cannot be evaluated.
    """

    program: Program
    shared: Shared
    bad: list[Node] = field(default_factory=list)
    _procedures: dict[str, Procedure] = field(init=False)

    def __post_init__(self) -> None:
        self._procedures = {str(procedure.name): procedure for procedure in self.program.procedures}

    def _run(self) -> _Followed:
        return _Followed(self._procedures, self.shared.kinds, self.shared.start)

    def condition(self, expr: Expr) -> Node:
        """Evaluate a condition; add to `bad` where it is undefined."""
        run = self._run()
        value = run.evaluate(expr)
        self.bad += [
            self.shared.canonical(values.negation(_paid(obligation))) for obligation in run.obligations
        ]
        return self.shared.canonical(value)

    def lines(self, table: Table) -> list[Node]:
        """Return where each line matches, looking at no other; each test is asked once."""
        known = {id(test): self.condition(test.condition) for test in table.distinct_tests}
        return [values.all_of(known[id(test)] for test in line.stated) for line in table.lines]

    def every_line(self, table: Table) -> list[Node]:
        """Return where each line matches, looking at no other, and where DEFAULT does if the table has one."""
        lines = self.lines(table)
        return lines if table.default is None else [*lines, values.negation(values.any_of(lines))]

    def assumed(self, table: Table) -> list[Node]:
        """Return where each assumption holds that the table's proof may use."""
        return [self.condition(assumption.condition) for assumption in self.program.assumed(table)]

    def effect(self, body: Iterable[Statement], given: Iterable[Node] = ()) -> Effect:
        """Follow the statements where all of `given` holds.

        Raises:
            TooLongError, RecursionError: It has more steps than are followed.
        """
        run = self._run()
        for node in given:
            run.assume(node)
        run.execute(body)
        return self._effect_of(run)

    def procedure(self, name: str, args: Iterable[Node]) -> Effect:
        """Follow a procedure with these arguments.

        Raises:
            TooLongError, RecursionError: As `effect`.
        """
        run = self._run()
        procedure = self._procedures[name]
        run.call(procedure, [(procedure.span, arg) for arg in args])
        return self._effect_of(run)

    def _effect_of(self, run: _Followed) -> Effect:
        canonical = self.shared.canonical
        calls = tuple(
            ExternCall(
                call.spelled,
                canonical(call.path),
                tuple(map(canonical, call.given)),
                {name: canonical(node) for name, node in call.before.items()},
            )
            for call in run.calls
        )
        return Effect(
            {name: canonical(node) for name, node in run.state.leaves.items()},
            {name: canonical(node) for name, node in run.state.wrote.items()},
            tuple(dict.fromkeys(canonical(_paid(owed)) for owed in run.obligations)),
            calls,
        )


def _paid(owed: Obligation) -> Node:
    return values.follows(owed.path, owed.good)


def value_after(effect: Effect, leaf: str, shared: Shared) -> Node:
    """Return the leaf's value after the run."""
    return effect.leaves.get(leaf, shared.start[leaf])


def goes_wrong_otherwise(left: Effect, right: Effect, shared: Shared) -> Node:
    """Return where just one run comes to its end; what both owe plays no part."""
    first = values.all_of(node for node in left.owed if node not in right.owed)
    second = values.all_of(node for node in right.owed if node not in left.owed)
    if first is second:
        return FALSE
    both = values.all_of(node for node in left.owed if node in right.owed)
    return shared.canonical(values.both(both, values.negation(values.equal(first, second))))


def same_calls(left: Effect, right: Effect, leaves: Collection[str], shared: Shared) -> Node:
    """Return where both call the same extern procedures, at the same points, in the same states, with the same values.

    A result that is refused ends the cycle, so that what was written before the call is seen.
    """
    if [call.spelled for call in left.calls] != [call.spelled for call in right.calls]:
        return values.all_of(values.negation(call.path) for call in (*left.calls, *right.calls))
    conditions = []
    for first, second in zip(left.calls, right.calls, strict=True):
        seen = [leaf for leaf in leaves if leaf in first.before or leaf in second.before]
        pairs = [
            *zip(first.given, second.given, strict=True),
            *(
                (first.before.get(leaf, shared.start[leaf]), second.before.get(leaf, shared.start[leaf]))
                for leaf in seen
            ),
        ]
        both = values.both(first.path, second.path)
        neither = values.negation(values.either(first.path, second.path))
        conditions.append(
            values.either(values.both(both, values.all_of(shared.equal(a, b) for a, b in pairs)), neither)
        )
    return values.all_of(conditions)


def differences(
    left: Effect, right: Effect, leaves: Iterable[str], shared: Shared
) -> Iterator[tuple[str, Node]]:
    """Yield what two runs can do otherwise (`RUN`, `CALLS`, then leaves by name, in the order of `leaves`), and where they do."""
    written = [name for name in leaves if name in left.leaves or name in right.leaves]
    good = values.both(left.good, right.good)
    yield RUN, goes_wrong_otherwise(left, right, shared)
    yield CALLS, values.both(good, values.negation(same_calls(left, right, written, shared)))
    for name in written:
        same = shared.equal(value_after(left, name, shared), value_after(right, name, shared))
        if same is not values.TRUE:
            yield name, values.both(good, values.negation(same))
