"""One cycle of a level in its environment, as nodes: derived from the model that the executors are emitted from.

In: a program, its level, the links. Out: `Cycle`s. A cycle takes the inputs, settles deferred values, runs preprocess, the
selected table and postprocess, exactly as `interpret.cycle` does; what the environment may do is a condition on what is taken.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

from rcsc.compose.contract.environment import Below, Links
from rcsc.compose.contract.facts import believed, outside_values
from rcsc.compose.contract.watched import GHOST as GHOST  # noqa: PLC0414  # of a cycle's ghosts, too
from rcsc.compose.contract.watched import REFUSED as REFUSED  # noqa: PLC0414  # as above
from rcsc.compose.contract.watched import Leaves as Leaves  # noqa: PLC0414  # as above
from rcsc.compose.contract.watched import Refusals, first_ghosts, ghosts_after, kept, monitors
from rcsc.lang.interpret import chosen_table
from rcsc.lang.leaves import spoken_of
from rcsc.lang.model import (  # fmt: skip
    Action,
    Admit,
    Assumption,
    Bool,
    Call,
    Default,
    Int,
    Kind,
    Level,
    Line,
    Op,
    Procedure,
    Program,
    Scalar,
    Snapshot,
    Table,
    TableChoice,
    Value,
    Variable,
    earlier,
)
from rcsc.lang.protocol.environment import EARLY as EARLY  # noqa: PLC0414  # of a cycle as nodes, too
from rcsc.lang.protocol.environment import refusable, unadmitted
from rcsc.lang.restart import NUMBERS, After, Fixed, SameAs, Stands
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import ExternResults, State
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import FALSE, TRUE, Node

_REFUSED = "an input is refused:"
"""Of a cycle: whether the environment ends it by an input. Its variables are no leaves: a leaf has no colon."""


@dataclass(frozen=True, slots=True)
class TableAt:
    """A table in one cycle.

    Attributes:
        chosen: The condition that it runs; `selected`, that it would run if the cycle did not end before.
        matches: The condition of each line, in order.
        assumptions: The condition of each assumption, by name.
    """

    table: Table
    chosen: Node
    matches: tuple[Node, ...]
    assumptions: Mapping[str, Node]
    selected: Node

    @property
    def lines(self) -> list[tuple[Line | Default, Node]]:
        """Each line with its condition, DEFAULT last."""
        lines: list[tuple[Line | Default, Node]] = list(zip(self.table.lines, self.matches, strict=True))
        return lines if self.table.default is None else [*lines, (self.table.default, self.none)]

    @property
    def none(self) -> Node:
        """The condition that no line matches."""
        return values.all_of(map(values.negation, self.matches))

    @property
    def one_line(self) -> Node:
        """The condition that one line, or DEFAULT, runs."""
        some = values.TRUE if self.table.default is not None else values.negation(self.none)
        return values.both(some, values.negation(self.several()))

    @property
    def runs(self) -> Node:
        """The condition that it is matched: it is chosen, and none of its stopping assumptions fails."""
        return values.all_of((self.chosen, *(self.assumptions[name] for name in self.table.stops)))

    @property
    def stopped(self) -> Node:
        """The condition that it is chosen, and a stopping assumption fails."""
        return values.both(self.chosen, values.negation(self.runs)) if self.table.stops else FALSE

    def several(self) -> Node:
        """Return the condition that at least two lines match."""
        return values.several(self.matches)


@dataclass(frozen=True, slots=True)
class Cycle:
    """One cycle as nodes.

    Attributes:
        before: Every leaf and ghost as the last cycle left it; inputs as last taken.
        taken: The inputs of this cycle.
        contract: The condition on the environment, assumptions over time included; `undeclared`, without those that tables declare.
        middle: Every leaf as the table sees it.
        tables: Each table that may run last; `stages`, each that may run before it, and `every`, all.
        seen: Every leaf as the tables of each stage see it, in order.
        after: Every leaf and ghost after the cycle.
        refused: The condition that the cycle ends early, by a refused input or result, or a failed stopping assumption;
            `unmatched`, before the table is matched; `interrupted`, before its line is done.
        untaken: The condition that an input is refused: then nothing is taken, and inputs before the next cycle are as last taken.
        strange: Inputs that such a cycle may leave outside their ranges; where none is refused, those that a restart may.
        calls: Calls of extern procedures, in the order in which they can be made.
        settled: Every leaf before the preprocess, and `acted`, before the postprocess.
        anew: Whether it is the first after a restart.
    """

    before: Leaves
    taken: Leaves
    contract: Node
    middle: Leaves
    tables: tuple[TableAt, ...]
    after: Leaves
    refused: Node = FALSE
    unmatched: Node = FALSE
    interrupted: Node = FALSE
    calls: tuple[ExternResults, ...] = ()
    settled: Leaves = field(default_factory=dict)
    acted: Leaves = field(default_factory=dict)
    undeclared: Node = TRUE
    stages: tuple[TableAt, ...] = ()
    seen: tuple[Leaves, ...] = ()
    untaken: Node = FALSE
    strange: frozenset[str] = frozenset()
    anew: bool = False

    @property
    def every(self) -> tuple[TableAt, ...]:
        """Each table that may run, in order."""
        return (*self.stages, *self.tables)

    @property
    def prepared(self) -> Leaves:
        """Every leaf after the preprocess, before any table ran."""
        return (*self.seen, self.middle)[0]

    @property
    def idle(self) -> Node:
        """The condition that an input or a result is refused: that may happen as often as the environment likes, but not for ever."""
        stopped = values.any_of(at.stopped for at in self.every)
        return values.either(self.untaken, values.both(self.refused, values.negation(stopped)))

    @property
    def cases(self) -> tuple[Node, ...]:
        """Conditions of which one holds: for each table that it runs, and that none does."""
        none = (self.unmatched,) if self.unmatched is not FALSE else ()
        return (*(at.chosen for at in self.tables), *none)

    @property
    def goes_on(self) -> Node:
        """The condition that a matched table runs one line or DEFAULT: the cycle ends in no fault that the proofs exclude."""
        return values.all_of(values.follows(at.runs, at.one_line) for at in self.every)

    def refusals(self, inputs: Iterable[str], suffix: str = "") -> Refusals:
        """Return what is known of inputs that stand as they came, in this cycle or the one before."""
        looks_back = frozenset(str(earlier(name)) for name in inputs)
        before = self.before.get(REFUSED, FALSE)
        return Refusals(self.untaken, self.strange, before, looks_back, self.taken, suffix)


class _Begun(NamedTuple):
    """A cycle up to the table that runs last: parts of `Cycle`, and the condition that those before it matched one line each."""

    run: Run
    settled: Leaves
    stages: tuple[TableAt, ...]
    seen: tuple[Leaves, ...]
    middle: Leaves
    matched: Node


def _matches(run: Run, line: Line) -> Node:
    return values.all_of(map(run.evaluate, line.conditions))


@dataclass(frozen=True, slots=True)
class Safety:
    """The reason why cycles as nodes agree with the executors: every operation is defined, and every value in range.

    Attributes:
        invariants: The program's invariants under which that was shown; empty if it is so in any state.
        within: Whether they must be shown within a cycle, too, because some procedure alone can break one.
    """

    invariants: tuple[str, ...] = ()
    within: bool = False


@dataclass(slots=True)
class TransitionSystem:
    """One level as a transition system: makes its cycles as nodes.

    Attributes:
        kinds: The type of each leaf and ghost, by name.
        inputs: The leaves that each cycle takes, in declared order.
        trusted: Declared assumptions about inputs from outside: part of the contract.
        refusable: The inputs that may be refused, in declared order: an input that a level writes never is.
        clamped: The inputs that properties look back at and cycles move to the edge: where the level begins anew, none has done so yet.
        refuses: Whether cycles that an input ends are cycles, too, and inputs stand as they came where the level begins anew; else nothing
            is refused or stands outside its range, which is then to be trusted.
        only: The requirements that alone are owed, by name; None where all is.
    """

    program: Program
    level: Level
    links: Links
    safety: Safety = Safety()
    refuses: bool = False
    only: tuple[str, ...] | None = None
    procedures: dict[str, Procedure] = field(init=False)
    kinds: dict[str, Scalar] = field(init=False)
    inputs: tuple[str, ...] = field(init=False)
    trusted: frozenset[str] = field(init=False, default=frozenset())
    refusable: tuple[str, ...] = field(init=False, default=())
    clamped: tuple[str, ...] = field(init=False, default=())

    def __post_init__(self) -> None:
        """Derive types, inputs and trusted assumptions from the program."""
        self.procedures = {procedure.name: procedure for procedure in self.program.procedures}
        self.kinds = self.program.kinds
        self.inputs = tuple(str(v.name) for v in self.program.variables if v.kind is Kind.INPUT)
        for asked in self.links.asked:
            self.kinds[f"{GHOST}{asked.into}"] = Bool()
            for key in asked.keys:
                self.kinds[f"{GHOST}{asked.into} {key}"] = self.kinds[key]
        looked_at = self._looked_back_at()
        if looked_at:
            self.kinds[REFUSED] = Bool()
        for _, monitor in monitors(self.program):
            self.kinds |= {str(state.name): state.type for state in monitor.states}
        outside = list(self._of_outside())
        self.refusable = tuple(str(v.name) for v in outside if refusable(v))
        past = (v for v in outside if v.admit is Admit.CLAMP and unadmitted(v))
        self.clamped = tuple(str(v.name) for v in past if v.name in looked_at)
        self.trusted = self._of_the_environment()

    def _looked_back_at(self) -> frozenset[str]:
        """Find the inputs that a property or an assumption looks back at, which a refused cycle left as they came."""
        read = {str(name) for stated in self.program.stated for name in spoken_of(stated)}
        return frozenset(leaf for leaf in self.inputs if str(earlier(leaf)) in read)

    def _of_outside(self) -> Iterator[Variable]:
        """Yield the inputs that no level writes: the operator, the plant, the database, or nobody."""
        for variable in self.program.variables:
            if variable.kind is Kind.INPUT and self.links.written_as(variable.name) is None:
                yield variable

    def refusing(self) -> "TransitionSystem":
        """Return the same level in an environment in which inputs may be refused, and stand outside their ranges where it begins anew."""
        return replace(self, refuses=bool(self.refusable or self.clamped))

    def admitting(self) -> "TransitionSystem":
        """Return the same level in an environment in which no input is ever refused, nor stands outside its range."""
        return replace(self, refuses=False) if self.refuses else self

    def _of_the_environment(self) -> frozenset[str]:
        """Find the *assumed* assumptions about inputs from outside; others are proved, here or at the level that writes their leaves."""
        given = {fact.name for fact in self.links.given}
        wanted = [one for one in believed(self.program, self.level) if one.name not in given]
        if not wanted:
            return frozenset()
        cycle = self.cycle(self.havoc())
        # What tables before the last compute of inputs is the level's own: it is owed, not taken for granted.
        known = Run(self.procedures, self.kinds, dict(cycle.prepared))
        trusted, mixed = set[str](), list[tuple[Assumption, set[str]]]()
        for assumption in wanted:
            read = values.variables([known.evaluate(assumption.condition)]).keys() - cycle.before.keys()
            leaves = {leaf for leaf, node in cycle.taken.items() if read & values.variables([node]).keys()}
            outside = {leaf for leaf in leaves if self.links.written_as(leaf) is None}
            if read and outside == leaves:
                trusted.add(str(assumption.name))
            elif read and outside:
                mixed.append((assumption, outside))
        kept: dict[str, Value] = {}
        # together: facts that could each be kept from outside may say something of what a level writes
        for assumption, outside in mixed:
            chosen = self._kept_by(assumption, outside, kept, trusted)
            if chosen is not None:
                kept |= chosen
                trusted.add(str(assumption.name))
        return frozenset(trusted)

    def _kept_by(
        self,
        assumption: Assumption,
        outside: Collection[str],
        kept: Mapping[str, Value],
        trusted: Collection[str],
    ) -> dict[str, Value] | None:
        """Find values of these inputs that make an assumption true wherever it stands, whatever the levels write.

        Args:
            assumption: It reads values that levels write, too.
            outside: The inputs that come from outside.
            kept: Values that some have already.
            trusted: Names of assumptions that have to be true with it.
        """
        kinds = {leaf: self.kinds[leaf] for leaf in self.inputs if leaf in outside}
        free = {leaf: values.variable(f"{leaf} taken", self.kinds[leaf]) for leaf in self.inputs}
        given = {f"{leaf} taken" for leaf in (*kinds, *kept)}
        about = [
            key
            for key, node in self._assumed(free).items()
            if key[1] == assumption.name
            or (key[1] in trusted and not given.isdisjoint(values.variables([node])))
        ]
        for chosen in outside_values(assumption.condition, kinds):
            both = {**kept, **chosen}
            if any(both[leaf] != value for leaf, value in kept.items()):
                continue
            taken = {leaf: values.constant(self.kinds[leaf], value) for leaf, value in both.items()}
            said = self._assumed(free | taken)
            if all(said[key].known and said[key].low for key in about):
                return chosen
        return None

    def _assumed(self, taken: Leaves) -> dict[tuple[int, str], Node]:
        """Return the assumptions of each table that may run, by the table's place and their names, for these inputs."""
        every = self.cycle(self.havoc(), taken=taken).every
        return {
            (place, str(name)): node
            for place, at in enumerate(every)
            for name, node in at.assumptions.items()
        }

    def havoc(self) -> Leaves:
        """Return an arbitrary state: the start of a step of induction."""
        return {name: values.variable(name, kind) for name, kind in self.kinds.items()}

    def initial(self) -> Leaves:
        """Return the state before the first cycle."""
        start = {str(v.name): values.constant(v.type, v.initial) for v in self.program.variables}
        return {
            **{name: values.constant(kind, 0) for name, kind in self.kinds.items() if name.startswith(GHOST)},
            **first_ghosts(self.program),
            **start,
        }

    def restarted(self) -> Leaves:
        """Return the states before the first cycle after a restart, as `run.adopt` makes them, whatever stood in the buffers.

        A state that lacks the member, or has a number of another type, keeps its initial value, as there. An order has a number that
        no report can echo yet: the one after the order in the buffer, which may be late, or after the echo if there is none. A report
        echoes what it echoed.
        """

        def any_value(leaf: str) -> Node:
            return values.variable(f"{leaf} before restart", self.kinds[leaf])

        inputs = {name: any_value(name) for name in sorted(self.inputs)}
        return self.begun_anew(inputs, any_value, unlike_echo)

    def begun_anew(
        self, inputs: Leaves, stood: Callable[[str], Node], following: Callable[[Node, Node], Node]
    ) -> Leaves:
        """Return the states before the first cycle after a restart.

        Args:
            inputs: What it finds in its buffers.
            stood: A leaf as it stood in its own buffers; whether a cycle was refused before, which nobody knows.
            following: The number of an order, of the one that stood and of the echo.
        """
        start = self.initial()
        if self.refuses and REFUSED in self.kinds:  # nothing was admitted yet of what it begins with
            start[REFUSED] = stood(REFUSED)
        start |= inputs
        for leaf, adopted in self.program.adopted.items():
            match adopted:
                case Fixed(value):
                    start[leaf] = values.constant(self.kinds[leaf], value)
                case SameAs(other):
                    start[leaf] = start[other]
                case Stands():
                    start[leaf] = stood(leaf)
                case After(echo):
                    start[leaf] = following(stood(leaf), start[echo])
        return start

    def firsts(self) -> dict[str, Cycle]:
        """Return the cycles with which a level can begin, by name."""
        return {
            "first": self.cycle(self.initial(), " at first"),
            "restart": self.cycle(self.restarted(), " at restart", anew=True),
        }

    def of(self, program: Program) -> "TransitionSystem":
        """Return the same level with another program of the same leaves."""
        level = next(level for level in program.levels if level.name == self.level.name)
        return replace(self, program=program, level=level)

    def table(self, name: str) -> Table:
        """Return a table of the program.

        Raises:
            StopIteration: It has none of this name.
        """
        return self.program.table(name)

    def table_of(self, snapshot: Snapshot) -> str:
        """Return the table that ran last, from the leaves after its cycle; its selector is steady (`UNSTEADY_SELECTOR`)."""
        return str(chosen_table(self.program, self.level.tables, snapshot).name)

    def lines_before(self, snapshot: Snapshot) -> tuple[tuple[str, str], ...]:
        """Return table and line of each that ran before the last, from the leaves after the cycle."""
        held = ((name, int(snapshot[leaf])) for name, leaf in self.program.line_leaves.items())
        numbers = {name: number for name, number in held if number}
        order = [name for name in self.level.staged if name in numbers]
        return tuple((str(name), str(self.table(name).every_line[numbers[name] - 1].name)) for name in order)

    def cycle(
        self, before: Leaves, suffix: str = " taken", taken: Leaves | None = None, *, anew: bool = False
    ) -> Cycle:
        """Run one cycle symbolically from `before`; inputs default to fresh variables, named with the suffix.

        Results of extern procedures are named with it, too: cycles in one query need different suffixes. `anew`: `before` is the
        state after a restart, in which inputs are what stood in the buffers: as other levels owe them, or as they are initially, which
        is owed, too.
        """
        cycle = self._admitted(before, suffix, taken, anew=anew)
        if self.refuses and self.refusable:
            cycle = self._or_refused(cycle, values.variable(f"{_REFUSED}{suffix}", Bool()))
        refusals = cycle.refusals(self.inputs, suffix)
        watched = ghosts_after(self.program, before, cycle.after, refusals, cycle.idle)
        if not watched:
            return cycle
        cycle = replace(cycle, after={**cycle.after, **watched})
        if not self.program.environment:
            return cycle
        as_assumed = kept(self.program, before, cycle.after)
        contract, undeclared = (values.both(one, as_assumed) for one in (cycle.contract, cycle.undeclared))
        return replace(cycle, contract=contract, undeclared=undeclared)

    def _or_refused(self, cycle: Cycle, untaken: Node) -> Cycle:
        """Return the cycle with the case that an input is refused: then it takes nothing (`Event.INPUT_REFUSED`).

        The leaves that tables would have seen stay: no table is chosen.
        """
        taken = values.negation(untaken)

        def instead(leaves: Leaves, otherwise: Leaves) -> Leaves:
            return {
                name: node if node is otherwise[name] else values.choice(untaken, otherwise[name], node)
                for name, node in leaves.items()
            }

        def tables(every: tuple[TableAt, ...]) -> tuple[TableAt, ...]:
            return tuple(replace(at, chosen=values.both(at.chosen, taken)) for at in every)

        contract, undeclared = cycle.contract, cycle.undeclared
        if self.trusted:  # what is declared of a table holds where it runs
            contract = values.either(values.both(untaken, undeclared), contract)
        after = instead(cycle.after, {**cycle.before, **self._safe(cycle.before)})
        if REFUSED in self.kinds:
            after[REFUSED] = untaken
        return replace(
            cycle,
            contract=contract,
            tables=tables(cycle.tables),
            after=after,
            refused=values.either(untaken, cycle.refused),
            unmatched=values.either(untaken, cycle.unmatched),
            interrupted=values.either(untaken, cycle.interrupted),
            stages=tables(cycle.stages),
            untaken=untaken,
            strange=frozenset(str(v.name) for v in self._of_outside() if unadmitted(v)),
        )

    def _safe(self, leaves: Leaves) -> Leaves:
        """Return the outputs that show another value after a fault, with that value."""
        shown = (
            (str(v.name), values.constant(v.type, v.safe))
            for v in self.program.variables
            if v.safe is not None
        )
        return {name: node for name, node in shown if name in leaves}

    def _admitted(self, before: Leaves, suffix: str, taken: Leaves | None, *, anew: bool) -> Cycle:
        """Return a cycle in which no input is refused."""
        if taken is None:
            taken = {name: values.variable(f"{name}{suffix}", self.kinds[name]) for name in self.inputs}
        run, settled, stages, seen, middle, matched = self._begun(before, taken, suffix)
        ghosts, answers = self._database(before, taken)
        standing = self._given(before) if anew else TRUE
        known = self._protocol(before, taken), answers, standing, self._given(taken)
        contract = undeclared = values.all_of(known)
        unmatched = values.either(run.ended, values.negation(matched))
        tables = self._run(run, self.level.tables, matched)
        contract = values.both(contract, self._trusted((*stages, *tables)))
        acted, interrupted = {**before, **run.state.leaves}, run.ended
        run.execute(Call(self.procedures[name].name) for name in self.level.postprocess)
        after = {**before, **run.state.leaves, **ghosts}
        for name, shown in self._safe(after).items():
            after[name] = values.choice(run.ended, shown, after[name])
        if REFUSED in self.kinds:
            after[REFUSED] = FALSE
        calls = tuple(run.answered)
        return Cycle(
            before, taken, contract, middle, tables, after,
            run.ended, unmatched, interrupted, calls, settled, acted, undeclared, stages, seen,
            strange=frozenset(self.clamped if self.refuses else ()), anew=anew,
        )  # fmt: skip

    def middle(self, before: Leaves, suffix: str, taken: Leaves) -> Leaves:
        """Return every leaf as the table that runs last sees it, in the cycle that takes these inputs (`Cycle.middle`)."""
        return self._begun(before, taken, suffix).middle

    def _begun(self, before: Leaves, taken: Leaves, suffix: str) -> _Begun:
        """Run a cycle up to the table that runs last."""
        run = Run(self.procedures, self.kinds, dict(before), suffix=suffix, refusals=True)
        run.state.leaves.update(taken)
        run.settle(self.program)
        settled = {**before, **run.state.leaves}
        run.execute(Call(self.procedures[name].name) for name in self.level.preprocess)
        stages, seen, matched = list[TableAt](), list[Leaves](), TRUE
        for choice in self.level.stages:
            seen.append({**before, **run.state.leaves})
            here = self._run(run, choice, matched)
            stages += here
            matched = values.both(matched, values.all_of(values.follows(at.runs, at.one_line) for at in here))
        return _Begun(run, settled, tuple(stages), tuple(seen), {**before, **run.state.leaves}, matched)

    def tables(self, choice: TableChoice, seen: Leaves, *, matched: bool) -> tuple[TableAt, ...]:
        """Match each table of a choice on these leaves; none runs if the cycle does not come to it, `matched`."""
        run = Run(self.procedures, self.kinds, dict(seen), ended=values.truth(not matched))
        return tuple(self._tables(run, choice))

    # --- the environment ---

    def _given(self, taken: Leaves) -> Node:
        """Return the condition that other levels write what they owe."""
        run = Run({}, {}, dict(taken))
        return values.all_of(run.evaluate(fact.condition) for fact in self.links.given)

    def _trusted(self, tables: tuple[TableAt, ...]) -> Node:
        """Return the condition that declared assumptions hold whenever a table runs."""
        return values.all_of(
            values.follows(at.chosen, condition)
            for at in tables
            for name, condition in at.assumptions.items()
            if name in self.trusted
        )

    def _protocol(self, before: Leaves, taken: Leaves) -> Node:
        """Return the contract of orders and reports, whatever the delay (`compose.__doc__`)."""
        kept = TRUE
        if (above := self.links.above) is not None:
            same = values.all_of(values.equal(before[leaf], taken[leaf]) for leaf in above.numbered)
            again = values.equal(before[above.number], taken[above.number])
            kept = values.both(kept, values.follows(again, same))
        for below in self.links.below:
            kept = values.both(kept, self.echo(below, before, taken))
        return kept

    @staticmethod
    def echo(below: Below, before: Leaves, taken: Leaves) -> Node:
        """Return the contract of a report: an echo of the last number repeats its command, and stays; the next is not echoed."""
        sent, last, echo = before[below.number], before[below.echo], taken[below.echo]
        it = values.equal(taken[below.echoed], before[below.command])
        now = values.equal(echo, sent)
        stays = values.follows(values.equal(last, sent), now)
        return values.all_of(
            (values.follows(now, it), stays, values.negation(values.equal(echo, successor(sent))))
        )

    def _database(self, before: Leaves, taken: Leaves) -> tuple[Leaves, Node]:
        """Return the ghosts after the cycle, and the condition that the same question has the same answer."""
        ghosts: Leaves = {}
        kept = TRUE
        for asked in self.links.asked:
            again = before[f"{GHOST}{asked.into}"]
            for key in asked.keys:
                name = f"{GHOST}{asked.into} {key}"
                ghosts[name] = taken.get(key, before[key])
                again = values.both(again, values.equal(before[name], ghosts[name]))
            same = values.all_of(values.equal(before[leaf], taken[leaf]) for leaf in asked.leaves)
            kept = values.both(kept, values.follows(again, same))
            ghosts[f"{GHOST}{asked.into}"] = TRUE
        return ghosts, kept

    # --- the level ---

    def _run(self, run: Run, choice: TableChoice, matched: Node) -> tuple[TableAt, ...]:
        """Run the chosen table, at its place in the cycle, if those before it `matched` one line each."""
        tables = tuple(self._tables(run, choice, matched))
        run.ended = values.either(run.ended, values.any_of(at.stopped for at in tables))
        self._lines(run, tables)
        return tables

    def _tables(self, run: Run, choice: TableChoice, matched: Node = TRUE) -> Iterable[TableAt]:
        goes_on = values.both(matched, values.negation(run.ended))
        for name, selected in run.chosen(choice).items():
            table = self.table(name)
            assumptions = {
                str(assumption.name): run.evaluate(assumption.condition)
                for assumption in self.program.assumptions
                if assumption.name in table.assumptions
            }
            matches = tuple(map(partial(_matches, run), table.lines))
            yield TableAt(table, values.both(selected, goes_on), matches, assumptions, selected)

    def matches(self, cycle: Cycle, table: Table, instead: Leaves) -> tuple[Node, ...]:
        """Return the condition of each line of a table, with these leaves in place of the cycle's own."""
        stages = (at for at, stage in enumerate(self.level.stages) if table.name in stage.names)
        place = next(stages, None)
        seen = cycle.middle if place is None else cycle.seen[place]
        run = Run(self.procedures, self.kinds, {**seen, **instead})
        return tuple(map(partial(_matches, run), table.lines))

    def _lines(self, run: Run, tables: tuple[TableAt, ...]) -> None:
        """Run the first matching line of the chosen table, and keep it where other tables follow."""
        middle = run.state
        ways: list[tuple[Node, State]] = []
        kept = self.program.line_leaves
        for at in tables:
            left = at.runs
            for number, (line, match) in enumerate(at.lines, 1):
                when, state = _way(run, middle, values.both(left, match), line.actions)
                if (leaf := kept.get(at.table.name)) is not None:
                    state.leaves[leaf] = values.constant(self.kinds[leaf], number)
                ways.append((when, state))
                left = values.both(left, values.negation(match))
        names = {name for _, state in ways for name in state.leaves}
        leaves = {}
        for name in sorted(names):
            node = run.start[name] if name not in middle.leaves else middle.leaves[name]
            base = node
            for when, state in reversed(ways):
                node = values.choice(when, state.leaves.get(name, base), node)
            leaves[name] = node
        run.state = State({**middle.leaves, **leaves})


def _way(run: Run, middle: State, when: Node, actions: tuple[Action, ...]) -> tuple[Node, State]:
    """Run the actions of one line symbolically; return its condition and the state after them."""
    run.state = State(dict(middle.leaves))
    with run.where(when):
        for action in actions:
            run.state = State(dict(run.state.leaves))
            run.execute((action.statement,))
    return when, run.state


def unlike_echo(late: Node, echo: Node) -> Node:
    """Return a number that no report can echo yet: the one that stood, which may be late, or the one after the echo."""
    return values.choice(values.equal(late, echo), successor(echo), late)


def successor(number: Node) -> Node:
    """Return the next number of 16 bits."""
    step, modulus = values.constant(number.kind, 1), values.constant(Int(0, NUMBERS), NUMBERS)
    following = values.arithmetic(Op.ADD, (number, step), Int(0, NUMBERS))
    return values.arithmetic(Op.MOD, (following, modulus), number.kind)
