"""Monitors beside a cycle, as ghosts of the proof; what the environment keeps of them; what a condition is worth where inputs are refused.

In: a program, the leaves before and after a cycle. Out: the ghosts after it; whether the environment kept what is assumed of it over time,
and whether it can go on to do so. A ghost is a state that the proof keeps and no executor has.
Each cycle is one of the run, a refused one, too. Before the first cycle, and where the level begins anew, monitors begin.

Why assumptions over time may be assumed. That a cycle keeps them joins its contract: so what is proved is proved of every run up to a cycle
in which none is broken. That is worth something only if the environment can go on, whatever the level has done: else a run that comes to
an end would break nothing. So an assumption reads inputs from outside that no protocol governs, and of the level what the cycle before
left. Whether a cycle keeps it is then settled by state and inputs before the level runs, which can neither keep nor break it. And after
every cycle, and before the first, some inputs keep it with all others that share an input with it: an obligation like an invariant
(`Sort.KEPT`), so that every engine and every run knows it; before the first cycle a question without the contract. Every claim of the level
rests on that. By induction each such run goes on for ever; assumptions that share no input are kept independently. What tables assume of a
cycle is not looked at there: that a level can be as its tables declare in every state is taken for granted, and listed so.

A refused cycle is one of the run, because time outside goes on. A comparison of what stands there as it came, or of what stood so in the
cycle before, may be true or false: for a claim the worse counts, for an assumption whichever keeps it. So it excludes no refusal, and
whatever came can be read so. Where the level begins anew so does the monitor: of what came before a restart nothing is assumed. A condition
that is not defined for what a cycle takes breaks the assumption: such values are taken not to come.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import prod
from random import Random
from typing import TypeAlias

from rcsc.compose.contract.facts import values_near
from rcsc.lang.interpret import holds
from rcsc.lang.leaves import parts, read_by
from rcsc.lang.meaning import spelled
from rcsc.lang.model import (
    COMPARISONS,
    WATCHED,
    Among,
    Apply,
    Bool,
    Expr,
    Kind,
    Literal,
    Monitor,
    Program,
    Property,
    Read,
    Scalar,
    Value,
    VariableName,
    earlier,
)
from rcsc.lang.over_time.run import begun, stepped
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import FALSE, TRUE, Node

GHOST = "asked "
"""Prefix of ghosts, which the proof remembers and the level does not: that the database was asked, and for which keys."""
REFUSED = f"{GHOST}and an input was refused"
"""The ghost of properties that look back at inputs: before the cycle these stand as they came, admitted by none."""
Leaves = dict[str, Node]
Judged: TypeAlias = tuple[Node, Node]
"""A condition in a cycle: whether it is true, and whether it is defined."""


# --- what a condition is worth -----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Refusals:
    """The inputs of a cycle that stand as they came, admitted or not.

    The inputs of a refused cycle do (`Event.INPUT_REFUSED`). One from outside need not be in its range: whatever compares it then may be
    true or false. The cycle after it may find any inputs in the one before.

    Attributes:
        untaken: The condition that the cycle takes nothing; `taken`, its inputs then.
        strange: Inputs that such a cycle may leave outside their ranges; where none is refused, those that a restart may.
        before: The condition that the cycle before took nothing, or that the level begins anew.
        looks_back: The names of inputs of the cycle before.
        suffix: Of the names of truths that nobody knows: those of two cycles in one question differ.
        forgives: Whether what is not defined for such an input may be true, too: an assumption forbids no refusal.
    """

    untaken: Node = FALSE
    strange: frozenset[str] = frozenset()
    before: Node = FALSE
    looks_back: frozenset[str] = frozenset()
    taken: Mapping[str, Node] = field(default_factory=dict)
    suffix: str = ""
    forgives: bool = False


def judged(condition: Expr, leaves: Leaves, refusals: Refusals) -> Judged:
    """Return whether a condition is true of a cycle, and defined, also where it or the one before took nothing."""
    plain = _judged(condition, leaves)
    if refusals.untaken is FALSE and not refusals.strange:
        return plain

    def open_(names: frozenset[str], among: Leaves) -> Judged:
        return opened(condition, names, among, refusals.suffix, forgives=refusals.forgives)

    if refusals.untaken is FALSE:
        clamped = frozenset(
            str(earlier(name)) for name in refusals.strange
        )  # at a restart nothing is clamped yet
        return _choice(refusals.before, open_(clamped, leaves), plain)
    came, back = {**leaves, **refusals.taken}, refusals.looks_back
    untaken = _choice(refusals.before, open_(refusals.strange | back, came), open_(refusals.strange, came))
    return _choice(refusals.untaken, untaken, _choice(refusals.before, open_(back, leaves), plain))


def _choice(when: Node, first: Judged, second: Judged) -> Judged:
    if when is FALSE:
        return second
    return values.choice(when, first[0], second[0]), values.choice(when, first[1], second[1])


def opened(
    condition: Expr, names: frozenset[str], leaves: Leaves, suffix: str = "", *, forgives: bool = False
) -> Judged:
    """Return the condition, with each atomic part that reads one of the leaves true or false; not defined if one may not be.

    Where it `forgives`, such a part is true or false, too.
    """
    unknown: dict[str, Node] = {}
    undefined = False

    def part(expr: Expr) -> Expr:
        nonlocal undefined
        if not names & set(map(str, read_by(expr))):
            return expr
        if isinstance(expr, Apply) and all(isinstance(one.type, Bool) for one in (expr, *expr.args)):
            return replace(expr, args=tuple(map(part, expr.args)))
        undefined = undefined or not (forgives or all(map(_only_compares, parts(expr))))
        name = f"{REFUSED}{suffix}: {spelled(expr)}"
        unknown[name] = values.variable(name, Bool())
        return Read(VariableName(name), Bool())

    open_ = part(condition)
    return (FALSE, FALSE) if undefined else _judged(open_, {**leaves, **unknown})


def _only_compares(part: Expr) -> bool:
    """Return whether a part of an atomic condition is defined for any value whatever, in its range or not."""
    return isinstance(part, Read | Literal | Among) or (isinstance(part, Apply) and part.op in COMPARISONS)


def _judged(condition: Expr, leaves: Leaves) -> Judged:
    run = Run({}, {}, dict(leaves))
    truth = run.evaluate(condition)
    owed = run.obligations
    return truth, values.all_of(values.follows(one.path, one.good) for one in owed)


def true(condition: Expr, leaves: Leaves) -> Node:
    """Return the condition that an expression is defined and true."""
    return values.both(*_judged(condition, leaves)[::-1])


# --- ghosts as nodes ---------------------------------------------------------------------------


def monitors(program: Program) -> Iterator[tuple[Property, Monitor]]:
    """Yield each assumption and requirement over time of a program, with its monitor."""
    for stated in program.over_time:
        assert stated.monitor is not None
        yield stated, stated.monitor


def asking(program: Program, after: Leaves) -> Iterator[tuple[str, Node]]:
    """Yield the name of each requirement over time, and the condition that a cycle asked for its response."""
    for stated, monitor in monitors(program):
        if not stated.assumed:
            yield stated.name, true(monitor.asks, after)


def first_ghosts(program: Program) -> Leaves:
    """Return the states of all monitors before the first cycle."""
    return {
        str(state.name): values.constant(state.type, state.initial)
        for _, monitor in monitors(program)
        for state in monitor.states
    }


def ghosts_after(
    program: Program, before: Leaves, after: Leaves, refusals: Refusals, idle: Node = FALSE
) -> Leaves:
    """Return the states of all monitors after a cycle, of which these are the leaves and ghosts before and after.

    In a cycle that is `idle`, because something is refused, states that then stand still do so.
    """
    now = _before_and_after(before, after)
    ghosts: Leaves = {}
    for stated, monitor in monitors(program):
        own = _stepped(monitor, now, replace(refusals, forgives=True) if stated.assumed else refusals)
        ghosts |= own
        if monitor.still and idle is not FALSE:
            waits = values.both(idle, Run({}, {}, {**now, **own}).evaluate(monitor.waits))
            ghosts |= {
                str(name): values.choice(waits, before[str(name)], own[str(name)]) for name in monitor.still
            }
    return ghosts


def _before_and_after(before: Leaves, after: Leaves) -> Leaves:
    return {**after, **{str(earlier(name)): node for name, node in before.items()}}


def _stepped(monitor: Monitor, leaves: Leaves, refusals: Refusals) -> Leaves:
    """Return the states of a monitor after a cycle."""
    run = Run({}, {}, dict(leaves))
    defined = TRUE
    now = dict(leaves)
    for name, truth in monitor.truths:
        good, sound = judged(truth, now, refusals)
        now[str(name)] = run.state.leaves[str(name)] = values.both(sound, good)
        defined = values.both(defined, sound)
    run.state.leaves[str(monitor.defined)] = defined
    run.execute(monitor.statements)
    return {str(state.name): run.leaf(state.name) for state in monitor.states}


# --- what is assumed of the environment over time ----------------------------------------------


MOST_TRIED = 128
"""Inputs that are tried for assumptions over time that share some."""


def kept(program: Program, before: Leaves, after: Leaves) -> Node:
    """Return the condition that a cycle keeps all assumptions over time, of ghosts before and after it."""
    leaves = _before_and_after(before, after)
    return values.all_of(true(stated.condition, leaves) for stated in program.environment)


def can_be_kept(program: Program, left: Leaves) -> Iterator[tuple[str, Node]]:
    """Yield each assumption over time, and the condition that a cycle which finds these leaves and ghosts can keep it.

    Some inputs then keep it and all others that share an input with it, directly or not. Which inputs does not depend on what the level
    does in that cycle: an assumption reads nothing of that. Where not all values can be tried, the condition is stronger than needed.
    """
    kinds = _inputs(program)
    for together in _sharing(program.environment, kinds):
        told = _told(together, kinds)
        every = [_tried(kinds[VariableName(name)], near, left[name]) for name, near in told.items()]
        chosen = (dict(zip(told, each, strict=True)) for each in _combined(every))
        some = values.any_of(_kept_with(together, left, each) for each in chosen)
        yield from ((stated.name, some) for stated in together)


def kept_with(program: Program, name: str) -> list[Property]:
    """List the other assumptions over time that share an input with one, directly or not."""
    every = (together for together in _sharing(program.environment, _inputs(program)))
    own = next(together for together in every if any(stated.name == name for stated in together))
    return [stated for stated in own if stated.name != name]


def told_of(program: Program) -> dict[str, list[Value]]:
    """Return for each input that assumptions over time read values that they can tell apart from others by constants."""
    kinds = _inputs(program)
    every = (_told(together, kinds) for together in _sharing(program.environment, kinds))
    return {name: near for told in every for name, near in told.items()}


def _inputs(program: Program) -> dict[VariableName, Scalar]:
    return {v.name: v.type for v in program.variables if v.kind is Kind.INPUT}


def _told(together: Sequence[Property], kinds: Mapping[VariableName, Scalar]) -> dict[str, list[Value]]:
    """Return the inputs that these read, each with values near the constants that stand beside them."""
    conditions = [truth for stated in together for truth in stated.about]
    told = {part.value for one in conditions for part in parts(one) if isinstance(part, Literal)}
    read = sorted({name for one in conditions for name in read_by(one)} & kinds.keys())
    return {str(name): values_near(kinds[name], told) for name in read}


def _sharing(every: Sequence[Property], inputs: Collection[VariableName]) -> list[list[Property]]:
    """Put assumptions together that share an input, directly or not."""
    groups: list[tuple[list[Property], set[VariableName]]] = []
    for stated in every:
        reads = {name for one in stated.about for name in read_by(one)}.intersection(inputs)
        apart = [group for group in groups if reads.isdisjoint(group[1])]
        joined = [group for group in groups if not reads.isdisjoint(group[1])]
        members = [one for group in joined for one in group[0]]
        groups = [*apart, ([*members, stated], reads.union(*(group[1] for group in joined)))]
    return [members for members, _ in groups]


def _tried(kind: Scalar, near: Collection[Value], stays: Node) -> list[Node]:
    """List values of an input, and the one that it had."""
    constants = [values.constant(kind, value) for value in near]
    return constants if stays in constants else [stays, *constants]


def _combined(every: Sequence[Sequence[Node]]) -> Iterator[tuple[Node, ...]]:
    """Yield all combinations of one from each list; where they are too many, those of the same place and some others, always the same."""
    if prod(map(len, every)) <= MOST_TRIED:
        yield from product(*every)
        return
    random = Random(0)  # noqa: S311  # repeatable on purpose
    for at in range(max(map(len, every))):
        yield tuple(each[at % len(each)] for each in every)
    for _ in range(MOST_TRIED):
        yield tuple(map(random.choice, every))


def _kept_with(together: Sequence[Property], left: Leaves, chosen: Leaves) -> Node:
    """Return the condition that a cycle which takes these inputs keeps the assumptions."""
    leaves = _before_and_after(left, {**left, **chosen})
    good = []
    for stated in together:
        assert stated.monitor is not None
        after = _stepped(stated.monitor, leaves, Refusals())
        good.append(true(stated.condition, {**leaves, **after}))
    return values.all_of(good)


# --- ghosts of a run ---------------------------------------------------------------------------


def begin(program: Program) -> dict[str, Value]:
    """Return the states of all monitors before a run."""
    return {name: value for _, monitor in monitors(program) for name, value in begun(monitor).items()}


def step(
    program: Program, found: Mapping[str, Value], before: Mapping[str, Value], after: Mapping[str, Value]
) -> dict[str, Value]:
    """Return the states of all monitors after a cycle that was run, of which these are the leaves before and after; `found` before it."""
    left: dict[str, Value] = {}
    for stated, monitor in monitors(program):
        own = {str(state.name): found[state.name] for state in monitor.states}
        left |= stepped(monitor, stated.condition, own, before, after)[0]
    return left


def as_assumed(program: Program, found: Mapping[str, Value], left: Mapping[str, Value]) -> bool:
    """Return whether a cycle that was run kept all assumptions over time: the states of monitors before and after it."""
    states = {**left, **{str(earlier(VariableName(name))): value for name, value in found.items()}}
    return all(holds(stated.condition, states) for stated in program.environment)


def is_ghost(name: str) -> bool:
    """Return whether a name is of a state that the proof keeps and no executor has."""
    return name.startswith((GHOST, WATCHED))
