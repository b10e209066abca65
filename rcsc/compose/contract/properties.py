"""The program's own invariants and properties: as conditions on one cycle, as predicates, and evaluated on a run.

In: a program and a cycle. Out: nodes that must hold in every cycle; predicates for the search; and whether the interpreter finds them
true of a cycle that was run.

An *invariant* is a condition on state and outputs. It holds initially, after a restart, and after every cycle. A *property* is a
condition on a cycle and the one before (`model.Property`), with inputs as the cycle took them. It holds after every cycle; before the
first cycle, and the first after a restart, stand the values with which the level begins. It never spans a restart. An undefined
condition (a division by zero, an index out of range) does not hold.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping

from rcsc.compose.contract.environment import Links
from rcsc.compose.contract.predicates import (
    CLOSELY,
    Predicate,
    always_defined,
    cone,
    listed,
    looked_back_at,
    predicates,
)
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.watched import judged, monitors, true
from rcsc.lang.interpret import UNDEFINED, holds
from rcsc.lang.leaves import everything, expressions, parts, read_by, renamed
from rcsc.lang.meaning import spelled
from rcsc.lang.model import (
    BEFORE,
    COMPARISONS,
    WATCHED,
    Among,
    Apply,
    Assign,
    Bool,
    Enum,
    Expr,
    Int,
    Kind,
    Literal,
    Op,
    Program,
    Property,
    Read,
    Scalar,
    Value,
    VariableName,
    earlier,
)
from rcsc.lang.over_time.past import number
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node

MOST_AHEAD = 2
"""How far a counter of a monitor is looked at to be ahead of one of the level."""
MOST_COUNTED = 12
"""How far counters are, as predicates: each number up to so many, besides those that something compares."""

# --- as conditions on a cycle ----------------------------------------------------------------


def invariants(program: Program, cycle: Cycle) -> Iterator[tuple[str, Node]]:
    """Yield each invariant's name, and the condition that it holds before and after the cycle."""
    for invariant in program.invariants:
        yield (
            invariant.name,
            values.both(true(invariant.condition, cycle.before), true(invariant.condition, cycle.after)),
        )


def owed(links: Links, cycle: Cycle) -> Iterator[tuple[str, Node]]:
    """Yield each owed fact's name, and its condition before and after the cycle: it may be read as it stood before, too."""
    for fact in links.owes:
        yield fact.name, values.both(true(fact.condition, cycle.before), true(fact.condition, cycle.after))


def kept_within(program: Program, cycle: Cycle, names: Collection[str]) -> Node:
    """Return the condition that the invariants hold within the cycle, too, where operations are safe only under them."""
    return values.all_of(
        true(invariant.condition, leaves)
        for invariant in program.invariants
        if invariant.name in names
        for leaves in (cycle.settled, *cycle.seen, cycle.middle, cycle.acted)
    )


def properties(program: Program, cycle: Cycle) -> Iterator[tuple[Property, Node]]:
    """Yield each property and requirement over time, and its condition on the cycle and the one before."""
    leaves = {**cycle.after, **{str(earlier(name)): node for name, node in cycle.before.items()}}
    inputs = [str(v.name) for v in program.variables if v.kind is Kind.INPUT]
    for stated in program.properties:
        yield stated, values.both(*judged(stated.condition, leaves, cycle.refusals(inputs)))


# --- of a run --------------------------------------------------------------------------------


def invariant_kept(
    ts: TransitionSystem, name: str, before: Mapping[str, Value], after: Mapping[str, Value]
) -> bool:
    """Return whether the invariant holds before and after a cycle that was run.

    Raises:
        StopIteration: There is no such invariant.
    """
    condition = next(invariant.condition for invariant in ts.program.invariants if invariant.name == name)
    return all(_held(condition, state, ts.kinds) for state in (before, after))


def property_kept(
    ts: TransitionSystem, name: str, before: Mapping[str, Value], after: Mapping[str, Value]
) -> bool:
    """Return whether the property holds of a cycle that was run.

    Raises:
        StopIteration: There is no such property.
    """
    condition = next(stated.condition for stated in ts.program.properties if stated.name == name)
    kinds = {**ts.kinds, **{str(earlier(leaf)): kind for leaf, kind in ts.kinds.items()}}
    return _held(condition, {**after, **{str(earlier(leaf)): value for leaf, value in before.items()}}, kinds)


def _held(condition: Expr, state: Mapping[str, Value], kinds: Mapping[str, Scalar]) -> bool:
    """Return whether the interpreter finds the condition true; beyond 64 bits it is undefined."""
    try:
        if not holds(condition, state):
            return False
    except UNDEFINED:
        return False
    leaves = {str(name): values.constant(kinds[name], state[name]) for name in read_by(condition)}
    return bool(true(condition, leaves).low)


# --- as predicates -----------------------------------------------------------------------------


def every_predicate(
    ts: TransitionSystem, cycle: Cycle, obligations: Iterable[Node], closely: int = 0
) -> tuple[Predicate, ...]:
    """Choose the predicates of tables and procedures, those of invariants and properties, and of answers that stay.

    Those of a lower `closely` come first, in the same order, because clauses name predicates by position.
    """
    inside = cone(cycle, obligations)
    first = predicates(ts, inside)
    stated = (
        _stated_predicates(ts, inside, {predicate.name for predicate in first})
        if _stated_conditions(ts)
        else ()
    )
    there = {predicate.name for predicate in (*first, *stated)}
    answers = (one for one in _of_answers(ts, cycle, inside) if one.name not in there)
    chosen = (*first, *stated, *answers)
    if closely:
        there = {predicate.name for predicate in chosen}
        closer = predicates(ts, inside, closely)
        chosen = (*chosen, *(predicate for predicate in closer if predicate.name not in there))
    return (*chosen, *_side_by_side(ts, inside)) if closely == CLOSELY else chosen


def _side_by_side(ts: TransitionSystem, inside: frozenset[str]) -> Iterator[Predicate]:
    numbers = {below.number for below in ts.links.below}  # which go round
    others = [(name, kind) for name, kind in counters(ts.program) if name in inside and name not in numbers]
    yield from side_by_side(ts.program, others, inside)


def side_by_side(
    program: Program, others: Collection[tuple[VariableName, Int]], inside: frozenset[str]
) -> Iterator[Predicate]:
    """Make predicates of how far a counter of a monitor is from one of a level.

    They often go up together, in a cycle or the next: then one is never ahead of the other. Or one goes down from its greatest value as the
    other goes up: then both together stay below that.
    """
    for _, monitor in monitors(program):
        for state in monitor.states:
            if not isinstance(state.type, Int) or state.name not in inside:
                continue
            mine = Read(state.name, state.type)
            for name, kind in others:
                other, low, high = Read(name, kind), kind.low + state.type.low, kind.high + state.type.high
                both = Apply(Op.ADD, (mine, other), Int(low, high))
                for ahead in range(MOST_AHEAD + 1):
                    at_most = Apply(Op.ADD, (other, number(ahead)), Int(kind.low, kind.high + ahead))
                    yield _named(Apply(Op.LE, (mine, at_most), Bool()))
                for beyond in range(-1, MOST_AHEAD):
                    yield _named(Apply(Op.LE, (both, number(state.type.high + beyond)), Bool()))


def _named(condition: Expr) -> Predicate:
    return Predicate(spelled(condition), Bool(), condition=condition)


def counters(program: Program) -> Iterator[tuple[VariableName, Int]]:
    """List the states of a level that its statements count up or down."""
    counted = {v.name for v in program.variables if v.counts is not None}
    for procedure in program.procedures:
        for statement in everything(procedure.body):
            if isinstance(statement, Assign):
                counted |= {
                    part.args[0].name
                    for part in parts(statement.value)
                    if isinstance(part, Apply)
                    and part.op in (Op.ADD, Op.SUB)
                    and isinstance(part.args[0], Read)
                }
    yield from (
        (v.name, v.type)
        for v in program.variables
        if v.name in counted and isinstance(v.type, Int) and v.kind is not Kind.INPUT
    )


def _stated_conditions(ts: TransitionSystem) -> list[Expr]:
    program = ts.program
    return [
        *(invariant.condition for invariant in program.invariants),
        *(stated.condition for stated in program.stated),
        *_looked_at(program),
        *(fact.condition for fact in ts.links.owes),
    ]


def _looked_at(program: Program) -> Iterator[Expr]:
    """Yield what monitors look at of the level, what their statements decide, and how far their counters are, and small ones of the level.

    A counter of the level and one of a monitor often go up together; so each number of both is told apart.
    """
    counting: list[tuple[VariableName, Scalar]] = []
    for _, monitor in monitors(program):
        yield from (truth for _, truth in monitor.truths)
        for statement in everything(monitor.statements):
            yield from expressions(statement)
        counting += [(state.name, state.type) for state in monitor.states if isinstance(state.type, Int)]
    if counting:
        counting += [(v.name, v.type) for v in program.variables if v.kind is not Kind.INPUT]
    for name, kind in counting:
        if isinstance(kind, Int) and (name.startswith(WATCHED) or kind.high - kind.low <= MOST_COUNTED):
            for value in range(kind.low + 1, min(kind.high, kind.low + MOST_COUNTED) + 1):
                yield Apply(Op.GE, (Read(name, kind), Literal(value, Int(value, value, kind.unit))), Bool())


def _stated_predicates(
    ts: TransitionSystem, inside: frozenset[str], there: set[str]
) -> tuple[Predicate, ...]:
    """Make predicates of those parts of invariants and properties that can influence a later cycle."""
    by_name: dict[str, Predicate] = {}
    kept = looked_back_at(ts.program)
    for condition in _stated_conditions(ts):
        for part in parts(condition):
            if len({name.startswith(BEFORE) for name in read_by(part)}) > 1:
                continue  # it compares two cycles, which no single state shows
            alone = _of_one_cycle(part)
            kept_of = renamed(
                alone, lambda name: kept.get(name, name)
            )  # an input is no state, what keeps it is
            for predicate in _predicates_of(kept_of, ts.kinds):
                read = {predicate.leaf, *([predicate.other] if predicate.other else [])}
                if predicate.condition is not None:
                    read = set(map(str, read_by(predicate.condition)))
                if predicate.name not in there and read and read <= inside:
                    by_name.setdefault(predicate.name, predicate)
    return tuple(by_name.values())


def _of_answers(ts: TransitionSystem, cycle: Cycle, inside: frozenset[str]) -> Iterator[Predicate]:
    """Make predicates of the answers to the order taken last, for a level that writes the protocol by hand."""
    above = ts.links.above
    if above is None or ts.program.roles is not None or not isinstance(kind := ts.kinds[above.status], Enum):
        return
    told = {name for name in values.variables([cycle.after[above.status]]) if ts.kinds.get(name) == kind}
    for leaf in (above.status, *sorted(told - {above.status})):
        if leaf in inside:
            yield Predicate(leaf, kind)
    if {above.number, above.echo} <= inside:
        pair = sorted((above.number, above.echo))
        yield Predicate(pair[0], Bool(), pair[1])


def _of_one_cycle(part: Expr) -> Expr:
    """Drop `was` from an expression."""
    match part:
        case Read(name=name):
            return Read(VariableName(name.removeprefix(BEFORE)), part.type)
        case Apply(op=op, args=args):
            return Apply(op, tuple(map(_of_one_cycle, args)), part.type)
        case Among(subject=subject, values=members):
            return Among(_of_one_cycle(subject), members, part.type)
        case _:
            return part


def _predicates_of(part: Expr, kinds: Mapping[str, Scalar]) -> Iterator[Predicate]:
    """Make the predicates of an atomic part of an expression; none of a compound one."""
    match part:
        case Read(name=name) if listed(kinds[name]):
            yield Predicate(str(name), kinds[name])
        case Apply(op=Op.EQ | Op.NE, args=(Read(name=left), Read(name=right))) if left != right:
            yield Predicate(min(str(left), str(right)), Bool(), max(str(left), str(right)))
        case Apply(op=op) if op in COMPARISONS:
            yield from _condition(part, kinds)
        case Among():
            yield from _condition(part, kinds)
        case _:
            pass


def _condition(part: Expr, kinds: Mapping[str, Scalar]) -> Iterator[Predicate]:
    """Make a predicate of a comparison of numbers that is defined for every value."""
    if always_defined(part) and not all(listed(kinds[leaf]) for leaf in read_by(part)):
        yield Predicate(spelled(part), Bool(), condition=part)
