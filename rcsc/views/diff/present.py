"""What of a difference a level meets that stands in some state: for whoever is about to take the new tables.

In: a difference, the new version and a state. Out: what of the difference the next cycle can come to from there, and whether the
new tables know a state at all.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from rcsc.lang.model import (
    Box,
    Call,
    Enum,
    Kind,
    Level,
    ProcedureName,
    Program,
    Snapshot,
    Table,
    Value,
    value_of_key,
)
from rcsc.proof.relation.effect import Meaning, Shared
from rcsc.proof.relation.follow import loosened
from rcsc.proof.relation.questions import stated
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import Node
from rcsc.views.diff.changes.difference import Change, ComparedPart, ProgramDifference
from rcsc.views.diff.changes.tables import assumed

_ELSEWHERE = frozenset(
    {"procedure", "assumption", "invariant", "property", "requirement", "standing of assumption"}
)
"""Parts that do nothing by themselves: what a changed procedure does is seen in the tables that call it."""


@dataclass(frozen=True, slots=True)
class Met:
    """What of a difference can be met.

    Attributes:
        change: None where what changed of the part is no region.
    """

    part: ComparedPart
    change: Change | None


def within_reach(
    difference: ProgramDifference, after: Program, level: Level, now: Snapshot, options: Options
) -> tuple[Met, ...]:
    """Return the part of a difference that the level's next cycle can come to if it begins in this state; inputs are free.

    Deferred values and `preprocess` are followed as the later version has them. In doubt it is said to come to it: a region
    that its boxes do not say exactly counts as met, and so does what runs after the table; arithmetic on doubles is taken
    to give any value within its bounds.

    Args:
        difference: The difference.
        after: The version to be taken.
        level: The level, of that version.
        now: Values of all leaves, in the numbers of that version; those of inputs are not looked at.
        options: Limits of the solver.
    """
    own = level.table_names
    declared = tuple(_declared(difference))
    parts = [
        part
        for part in difference.parts
        if part.what not in _ELSEWHERE and (part.what != "table" or part.name in own)
    ]
    if not any(part.changed for part in parts):
        return declared
    cycle: _Cycle | None
    given_up: tuple[type[BaseException], ...] = (TooLongError, RecursionError, *smt.troubles())
    try:
        cycle = _Cycle(difference, after, level, now, options)
    except given_up:
        cycle = None
    return (*declared, *(met for part in parts for met in _met(part, cycle)))


def _declared(difference: ProgramDifference) -> Iterator[Met]:
    """Declarations that say what a cycle does: what is admitted of an input, and whether a value is deferred."""
    for declaration in difference.declarations:
        if declaration.before and declaration.after:
            admits = declaration.before.startswith("input ") or declaration.after.startswith("input ")
            defers = declaration.before.endswith(" deferred") != declaration.after.endswith(" deferred")
            if admits or defers:
                yield Met(
                    ComparedPart(
                        "declaration of", declaration.what, (f"{declaration.before} -> {declaration.after}",)
                    ),
                    None,
                )


def _met(part: ComparedPart, cycle: "_Cycle | None") -> Iterator[Met]:
    """Return the cases of a part that are met; all of it where the cycle cannot be followed."""
    if part.notes:
        yield Met(part, None)
    for change in part.changes:
        if cycle is None or part.what == "postprocess" or cycle.reached(part, change):
            yield Met(part, change)


class _Cycle:
    """The beginning of a cycle, from one state with any inputs: what leaves are when each part looks at them."""

    def __init__(
        self, difference: ProgramDifference, program: Program, level: Level, now: Snapshot, options: Options
    ) -> None:
        self.difference, self.level, self.options = difference, level, options
        self.numbers = count(1)
        self.kinds = program.kinds
        self.program = program
        start = {
            str(v.name): values.variable(v.name, v.type)
            if v.kind is Kind.INPUT
            else values.constant(v.type, now[v.name])
            for v in program.variables
        }
        run = Run.of(program, start)
        self.inputs = self._leaves(run)
        run.settle(program)
        self.settled = self._leaves(run)
        run.execute(Call(ProcedureName(name)) for name in level.preprocess)
        tables = {str(table.name): table for table in program.tables}
        self.seen: dict[str, dict[str, Node]] = {}
        self.chosen: dict[str, Node] = {}
        for choice in level.choices:
            self.chosen |= run.chosen(choice)
            self.seen |= dict.fromkeys(choice.names, self._leaves(run))
            if choice is not level.tables:
                run.run_choice(choice, tables)

    def _leaves(self, run: Run) -> dict[str, Node]:
        return {name: run.leaf(name) for name in self.kinds}

    def reached(self, part: ComparedPart, change: Change) -> bool:
        """Return whether some inputs lead into the region; in doubt they do."""
        if not change.where.exact:
            return True
        leaves = self.inputs if part.what == "deferred value" else self.settled
        if part.what == "table":
            leaves = self.seen.get(part.name, leaves)
        inside = values.any_of(
            values.all_of(self._in(leaves[name], name, box[name]) for name in box if name in leaves)
            for box in change.where.boxes
        )
        whole = values.both(
            inside, self.chosen.get(part.name, values.TRUE) if part.what == "table" else values.TRUE
        )
        if whole.known:
            return bool(whole.low)
        given_up: tuple[type[BaseException], ...] = (RecursionError, *smt.troubles())
        try:
            bounds = list(loosened([whole], self.numbers))  # before there are terms
            solver = stated([whole], self.options)
            solver.add(*bounds)
            return solver.possible()
        except given_up:
            return True

    def _in(self, node: Node, name: str, box: Box) -> Node:
        """Return the condition that a leaf lies in part of a region, which may number members of an enumeration otherwise."""
        kind, own = self.difference.kinds.get(name, self.kinds[name]), self.kinds[name]
        if isinstance(kind, Enum) and isinstance(own, Enum):
            members = [kind.members[key] for low, high in box for key in range(low, high + 1)]
            return values.among(
                node, [own.members.index(member) for member in members if member in own.members]
            )
        return values.any_of(
            values.inside(node, value_of_key(kind, low), value_of_key(kind, high)) for low, high in box
        )


def knows(program: Program, table: Table, leaf: str, value: Value, options: Options) -> bool:
    """Return whether the table has a line, DEFAULT left out, for some input under its assumptions in which the leaf has this value.

    Raises:
        UndecidedError: The solver gave up.
    """
    shared = Shared(program.kinds, program)
    meaning = Meaning(program, shared)
    here = values.equal(shared.start[leaf], values.constant(shared.kinds[leaf], value))
    whole = [assumed(table, meaning), here, values.any_of(meaning.lines(table))]
    return stated(whole, options).possible()
