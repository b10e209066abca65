"""Looks for a case for each condition that the cases kept so far do not show, or shows that there is none.

In: what is open, and what answers questions about values. Out: cases, confirmed by the interpreter; and for what has
none the reason. Every function is followed once, for any state that `check` accepts and any admitted inputs; then each
way in which a decision can go is a formula over them.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from rcsc.code.testing.agree import NONE, SEVERAL
from rcsc.code.testing.coverage.case import Case, Entry, entries
from rcsc.code.testing.coverage.choose import Choice
from rcsc.code.testing.coverage.goals import Goal, Hit, decides, pairs
from rcsc.code.testing.coverage.marks import (
    MOST_WAYS,
    Compares,
    Condition,
    Decision,
    End,
    Marked,
    Meets,
    Outcomes,
    any_of,
    ways_of,
)
from rcsc.code.testing.executors.reference_file import monitored
from rcsc.code.testing.inputs.snapshot import Missing, conjunction
from rcsc.lang.interpret import Fault, initial
from rcsc.lang.model import (
    Apply,
    Bool,
    Call,
    Expr,
    Int,
    Level,
    Literal,
    OneTable,
    Op,
    Program,
    Table,
    TableChoice,
    Value,
    pending,
)
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import Node

Asks: TypeAlias = Callable[[Sequence[Node]], Mapping[str, Value] | Missing]
"""Gives values at which all conditions hold, or says that there are none, or that it does not know."""

Occurrence: TypeAlias = Mapping[int, tuple[Node, Node]]
"""By number of a condition: when it is looked at, and its truth."""

MOST_QUESTIONS = 40
"""Of one goal."""


@dataclass(frozen=True, slots=True)
class Unreached:
    """Something that no vector reaches.

    Attributes:
        where: The place, in words.
        what: The condition, in words.
        wanted: What is not shown of it: `true`, `false`, or `decides on its own`.
        shown: Whether it was shown that there is none.
        reason: Why, in words.
        key: What it is: `("decision", number of the decision, number of the condition, truth)`, or a `Hit`.
    """

    where: str
    what: str
    wanted: str
    shown: bool
    reason: str
    key: Hit


@dataclass(slots=True)
class Watched(Run):
    """A symbolic run of a marked program, which keeps what every decision met."""

    now: dict[Decision, dict[int, tuple[Node, Node]]] = field(default_factory=dict)
    met: dict[Decision, list[Occurrence]] = field(default_factory=dict)
    compared: dict[Meets, list[tuple[Node, Node, Node]]] = field(default_factory=dict)
    ends: dict[tuple[str, int], Node] = field(default_factory=dict)

    def evaluate(self, expr: Expr) -> Node:
        """Evaluate as `Run` does, recording each mark."""
        if not isinstance(expr, Apply):
            return Run.evaluate(self, expr)
        op: object = expr.op
        match op:
            case Condition(decision=decision, at=at):
                path = self.path
                value = self.evaluate(expr.args[0])
                self.now.setdefault(decision, {})[at] = (path, value)
                return value
            case End(decision=decision):
                value = self.evaluate(expr.args[0])
                self.met.setdefault(decision, []).append(self.now.pop(decision, {}))
                return value
            case Meets(op=comparison):
                one, other = (self.evaluate(arg) for arg in expr.args)
                self.compared.setdefault(op, []).append((self.path, one, other))
                return values.compare(comparison, one, other)
            case Compares(decision=decision, op=plain, test=test):
                given = [self.evaluate(arg) for arg in expr.args]
                sides = op.sides(given, values.constant(given[-1].kind, 0))
                compared = values.compare(test, *sides)  # type: ignore[arg-type]  # a comparison
                self.met.setdefault(decision, []).append({0: (self.path, compared)})
                return Run.evaluate(self, replace(expr, op=plain))
        return Run.evaluate(self, expr)


@dataclass(slots=True)
class Followed:
    """A function, for all that it may be given.

    Attributes:
        base: What holds whenever it is called.
        met: What each decision meets.
        compared: What each comparison of numbers compares, and when.
        ends: Where no line of a table matches, or several: by table and `NONE` or `SEVERAL`.
    """

    entry: Entry
    base: tuple[Node, ...]
    met: Mapping[Decision, Sequence[Occurrence]]
    compared: Mapping[Meets, Sequence[tuple[Node, Node, Node]]]
    ends: Mapping[tuple[str, int], Node]


def followed(program: Program, whole: Marked, entry: Entry) -> Followed | None:
    """Follow a function; None where it is too long."""
    run = Watched.of(whole.program, {})
    base: list[Node] = []
    try:
        if entry.kind == "check":
            _check(run, whole.program)
        else:
            for invariant in program.invariants:
                base.append(run.evaluate(invariant.condition))
                run.assume(base[-1])
            _call(run, whole.program, entry, base)
    except (TooLongError, RecursionError):
        return None
    return Followed(entry, tuple(base), run.met, run.compared, run.ends)


def _check(run: Watched, program: Program) -> None:
    """The invariants, each where those before it hold."""
    for invariant in program.invariants:
        run.path = values.both(run.path, run.evaluate(invariant.condition))


def _call(run: Watched, program: Program, entry: Entry, base: list[Node]) -> None:
    tables = {str(table.name): table for table in program.tables}
    if entry.kind == "line":
        table = tables[entry.name]
        base += [run.evaluate(a.condition) for a in program.assumptions if a.name in table.stops]
        run.met.clear()
        for test in {id(t): t for line in table.lines for t in line.tests if t is not None}.values():
            run.evaluate(test.condition)
        return
    run.settle(program)
    if entry.kind == "step":
        _table(run, program, OneTable(tables[entry.name].name), tables)
        return
    level = next(level for level in program.levels if level.name == entry.name)
    run.execute(Call(run.procedures[name].name) for name in level.preprocess)
    for choice in level.choices:
        _table(run, program, choice, tables)
    run.execute(Call(run.procedures[name].name) for name in level.postprocess)


def _table(run: Watched, program: Program, choice: TableChoice, tables: Mapping[str, Table]) -> None:
    """Check the assumptions of a choice's tables, and run one.

    A cycle that an assumption ends is followed all the same: what is possible is then shown of more.
    """
    names = set(monitored(program))
    for name, when in run.chosen(choice).items():
        with run.where(when):
            for assumption in program.assumptions:
                if assumption.name in tables[name].assumptions and str(assumption.name) in names:
                    run.evaluate(assumption.condition)
        matches = [
            values.all_of(run.evaluate(test.condition) for test in line.tests if test is not None)
            for line in tables[name].lines
        ]
        some, twice = values.FALSE, values.FALSE
        for match in matches:
            twice = values.either(twice, values.both(some, match))
            some = values.either(some, match)
        run.ends[(name, NONE)] = values.both(when, values.negation(some))
        run.ends[(name, SEVERAL)] = values.both(when, twice)
    run.run_choice(choice, tables)


@dataclass(slots=True)
class Director:
    """Looks for cases of one program.

    Attributes:
        functions: What was followed, by entry; None for what is too long.
        left: Questions that may still be asked about bounds of comparisons, which no coverage needs.
    """

    choice: Choice
    asks: Asks
    functions: dict[Entry, Followed | None] = field(default_factory=dict)
    left: int = 200

    def all(self) -> Iterator[Unreached]:
        """Look for everything that is open; what has no case."""
        for table in self.choice.program.tables:
            yield from self._of_table(table)
        for level in self.choice.program.levels:
            yield from self._of_level(level)
        for goal in list(self.choice.reached.open_goals()):
            if not self._has(goal) and (left := self.look(goal)) is not None:
                yield left
        for at, meets in enumerate(self.choice.reached.marked.meets):
            for apart in (0, -1, 1):
                self._meet(at, meets, apart)

    def _meet(self, at: int, meets: Meets, apart: int) -> None:
        """Look for a case in which a comparison is of equal numbers, or of some one apart; there need be none."""
        for entry in entries(self.choice.program):
            if ("meets", at, apart) in self.choice.reached.hits or self.left == 0:
                return
            function = None if entry.kind in ("init", "lines") else self._function(entry)
            met = () if function is None else function.compared.get(meets, ())
            possible = values.any_of(values.both(path, _apart(one, other, apart)) for path, one, other in met)
            if function is None or possible is values.FALSE:
                continue
            self.left -= 1
            state = self._state([*function.base, possible])
            if not isinstance(state, Missing):
                origin = f"solved for a bound of a comparison in {entry.kind} {entry.name}"
                self.choice.offer(Case(entry, state, origin=origin))

    def _of_table(self, table: Table) -> Iterator[Unreached]:
        """Lines that no step ran, and that no line matches, or several."""
        hits, where = self.choice.reached.hits, f"table {table.name}"
        matches = [
            conjunction([(test, True) for test in line.tests if test is not None]) for line in table.lines
        ]
        some = any_of(matches)
        for at, (line, match) in enumerate(zip(table.lines, matches, strict=True)):
            if ("ran", table.name, at) not in hits:
                yield from self._matched(
                    table, match, (f"{where} line {line.name}", "runs"), ("ran", table.name, at)
                )
        key = "ran", table.name, len(table.lines)
        if table.default is not None and key not in hits:
            yield from self._matched(table, _not(some), (f"{where} line {table.default.name}", "runs"), key)
        if table.default is None:
            yield from self._matched(
                table, _not(some), (where, "no line matches"), ("matched", table.name, NONE)
            )
        yield from self._matched(
            table, several(matches), (where, "several lines match"), ("matched", table.name, SEVERAL)
        )

    def _of_level(self, level: Level) -> Iterator[Unreached]:
        """Ends of a cycle for want of one line, of tables that can be without when they are run alone."""
        function = self._function(Entry("cycle", level.name))
        for name in map(str, level.table_names):
            table = self.choice.program.table(name)
            for which, what in ((NONE, "no line matches"), (SEVERAL, "several lines match")):
                if ("matched", name, which) not in self.choice.reached.hits or (
                    which == NONE and table.default
                ):
                    continue
                where, key = f"level {level.name}, table {name}", ("ended", level.name, name, which)
                if function is None:
                    yield Unreached(where, what, "true", shown=False, reason="the cycle is too long", key=key)
                elif (reason := self._ended(function, name, which)) is not None:
                    yield Unreached(where, what, "true", shown=reason == SHOWN, reason=reason, key=key)

    def _ended(self, function: Followed, table: str, which: int) -> str | None:
        """Why no case ends a cycle at a table; None where one does."""
        fault = Fault.NO_LINE if which == NONE else Fault.SEVERAL_LINES
        state = self._state([*function.base, function.ends[(table, which)]])
        if isinstance(state, Missing):
            return SHOWN if state is Missing.NONE else NO_ANSWER
        self.choice.offer(Case(function.entry, state, origin=f"solved for table {table} without one line"))
        ends = any(hit[:3] == ("fault", function.entry, int(fault)) for hit in self.choice.reached.hits)
        return None if ends else NOT_CONFIRMED

    def _matched(self, table: Table, wanted: Expr, words: tuple[str, str], key: Hit) -> Iterator[Unreached]:
        """Look for an input of a table for which a condition holds; why there is none."""
        where, what = words
        if key[0] == "matched" and set(table.assumptions) <= set(table.stops):
            yield Unreached(where, what, "true", shown=True, reason=PROVED, key=key)
            return
        program = self.choice.program
        run = Run.of(program, {})
        rests = [a.condition for a in program.assumptions if a.name in table.stops]
        given = [run.evaluate(each) for each in (*(i.condition for i in program.invariants), *rests)]
        state = self._state([*given, run.evaluate(wanted)])
        if state is Missing.NONE:
            yield Unreached(where, what, "true", shown=True, reason=SHOWN, key=key)
            return
        if not isinstance(state, Missing):
            deferred = [v.name for v in program.variables if v.deferred_until is not None]
            state |= {str(pending(name)): state[name] for name in deferred}
            for kind in ("line", "step"):
                case = Case(Entry(kind, str(table.name)), state, origin=f"solved for {where}: {what}")
                self.choice.offer(case)
        if key not in self.choice.reached.hits:
            why = NO_ANSWER if isinstance(state, Missing) else NOT_CONFIRMED
            yield Unreached(where, what, "true", shown=False, reason=why, key=key)

    def look(self, goal: Goal) -> Unreached | None:
        """Find a case for a goal, or say why there is none."""
        if goal.truth is None:
            return self._until(goal, self._partners, self._others)
        return self._until(goal, self._true_to)

    def _has(self, goal: Goal) -> bool:
        ways = self._known(goal.decision)
        if goal.truth is None:
            return decides(ways, goal.number)
        return any(outcomes[goal.number] is goal.truth for outcomes, _ in ways)

    def _known(self, decision: Decision) -> Mapping[tuple[Outcomes, bool], None]:
        return self.choice.reached.ways.get(self.choice.reached.number_of(decision), {})

    def _ways(self, decision: Decision) -> list[tuple[Outcomes, bool]]:
        return [((True,), True), ((False,), False)] if decision.form is None else ways_of(decision.form)

    def _true_to(self, goal: Goal) -> Iterator[tuple[Outcomes, bool]]:
        """Ways in which the condition has the truth that it is to have."""
        return (way for way in self._ways(goal.decision) if way[0][goal.number] is goal.truth)

    def _partners(self, goal: Goal) -> Iterator[tuple[Outcomes, bool]]:
        """Ways that show the condition together with one that was met."""
        known = self._known(goal.decision)
        return (
            w
            for w in self._ways(goal.decision)
            if w not in known and any(pairs(w, k, goal.number) for k in known)
        )

    def _others(self, goal: Goal) -> Iterator[tuple[Outcomes, bool]]:
        """Ways that were not met and look at the condition."""
        known = self._known(goal.decision)
        return (w for w in self._ways(goal.decision) if w not in known and w[0][goal.number] is not None)

    def _until(
        self, goal: Goal, *wanted: Callable[[Goal], Iterable[tuple[Outcomes, bool]]]
    ) -> Unreached | None:
        """Ask for wanted ways until the goal is reached, or none is left."""
        for ways in wanted:
            for _ in range(MOST_QUESTIONS):
                if self._has(goal):
                    return None
                answer = self._find(goal.decision, list(ways(goal)))
                if isinstance(answer, str):
                    return self._unreached(goal, shown=False, reason=answer)
                if not answer:
                    break
            else:
                return None if self._has(goal) else self._unreached(goal, shown=False, reason=MANY)
        if not self._has(goal) and len(self._ways(goal.decision)) >= MOST_WAYS:
            return self._unreached(goal, shown=False, reason=MANY)
        return None if self._has(goal) else self._unreached(goal, shown=True, reason=SHOWN)

    def _unreached(self, goal: Goal, *, shown: bool, reason: str) -> Unreached:
        key = "decision", self.choice.reached.number_of(goal.decision), goal.number, goal.truth
        return Unreached(str(goal.decision.place), goal.condition, goal.wanted, shown, reason, key)

    def _find(self, decision: Decision, ways: Sequence[tuple[Outcomes, bool]]) -> bool | str:
        """Find a case in which the decision goes one of these ways; False where there is none, or why that is not known."""
        unknown = ""
        for entry in entries(self.choice.program):
            if (
                not ways
                or entry.kind in ("init", "lines")
                or (entry.kind == "line") != (decision.place.kind == "test")
            ):
                continue
            function = self._function(entry)
            if function is None:
                unknown = f"{entry.kind} {entry.name} is too long to be followed"
                continue
            met = function.met.get(decision, ())
            possible = values.any_of(
                _goes(occurrence, outcomes) for occurrence in met for outcomes, _ in ways
            )
            if possible is values.FALSE:
                continue
            state = self._state([*function.base, possible])
            if state is Missing.UNKNOWN:
                unknown = NO_ANSWER
            elif not isinstance(state, Missing):
                before = len(self._known(decision))
                self.choice.offer(Case(entry, state, origin=f"solved for {decision.place}"))
                if len(self._known(decision)) > before:
                    return True
                unknown = NOT_CONFIRMED
        return unknown or False

    def _state(self, conditions: Sequence[Node]) -> dict[str, Value] | Missing:
        """Return a state with inputs in which all conditions hold; what they leave open is initial."""
        answer = self.asks(conditions)
        if isinstance(answer, Missing):
            return answer
        return {name: answer.get(name, value) for name, value in initial(self.choice.program).items()}

    def _function(self, entry: Entry) -> Followed | None:
        if entry not in self.functions:
            self.functions[entry] = followed(self.choice.program, self.choice.reached.marked, entry)
        return self.functions[entry]


def _apart(left: Node, right: Node, by: int) -> Node:
    """That the left number is so much greater than the right one; never of reals, but for equal ones."""
    if by == 0:
        return values.equal(left, right)
    if not isinstance(left.kind, Int) or not isinstance(right.kind, Int):
        return values.FALSE
    kind = Int(right.kind.low + by, right.kind.high + by)
    return values.equal(left, values.arithmetic(Op.ADD, (right, values.constant(Int(by, by), by)), kind))


MANY = "the decision can go too many ways"
NO_ANSWER, NOT_CONFIRMED = "the solver gave no answer", "the solver's input was not confirmed"
PROVED = "proved by `rcsc check`: exactly one line matches"
SHOWN = "shown impossible for every admitted input and every state that `check` accepts"


def _goes(occurrence: Occurrence, outcomes: Outcomes) -> Node:
    """That an occurrence goes this way."""
    parts = list[Node]()
    for at, truth in enumerate(outcomes):
        if truth is None:
            continue
        if at not in occurrence:
            return values.FALSE
        path, value = occurrence[at]
        parts += [path, value if truth else values.negation(value)]
    return values.all_of(parts)


def several(conditions: Sequence[Expr]) -> Expr:
    """That two of them hold."""
    before: Expr = Literal(value=False, type=Bool())
    twice = before
    for condition in conditions:
        twice = Apply(Op.OR, (twice, Apply(Op.AND, (before, condition), Bool())), Bool())
        before = Apply(Op.OR, (before, condition), Bool())
    return twice


def _not(condition: Expr) -> Expr:
    return Apply(Op.NOT, (condition,), Bool())
