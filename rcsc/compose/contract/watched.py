"""Monitors of requirements beside a cycle, as ghosts of the proof; and what a condition is worth where inputs are refused.

In: a program, the leaves before and after a cycle. Out: the ghosts after it. A ghost is a state that the proof keeps and no executor has.
Each cycle is one of the run, a refused one, too. Before the first cycle, and where the level begins anew, monitors begin.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from rcsc.lang.leaves import parts, read_by
from rcsc.lang.meaning import spelled
from rcsc.lang.model import (
    COMPARISONS,
    WATCHED,
    Among,
    Apply,
    Bool,
    Expr,
    Literal,
    Monitor,
    Program,
    Property,
    Read,
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
    """

    untaken: Node = FALSE
    strange: frozenset[str] = frozenset()
    before: Node = FALSE
    looks_back: frozenset[str] = frozenset()
    taken: Mapping[str, Node] = field(default_factory=dict)
    suffix: str = ""


def judged(condition: Expr, leaves: Leaves, refusals: Refusals) -> Judged:
    """Return whether a condition is true of a cycle, and defined, also where it or the one before took nothing."""
    plain = _judged(condition, leaves)
    if refusals.untaken is FALSE and not refusals.strange:
        return plain
    if refusals.untaken is FALSE:
        clamped = frozenset(
            str(earlier(name)) for name in refusals.strange
        )  # at a restart nothing is clamped yet
        return _choice(refusals.before, opened(condition, clamped, leaves, refusals.suffix), plain)
    came, back = {**leaves, **refusals.taken}, refusals.looks_back
    untaken = _choice(
        refusals.before,
        opened(condition, refusals.strange | back, came, refusals.suffix),
        opened(condition, refusals.strange, came, refusals.suffix),
    )
    after_one = _choice(refusals.before, opened(condition, back, leaves, refusals.suffix), plain)
    return _choice(refusals.untaken, untaken, after_one)


def _choice(when: Node, first: Judged, second: Judged) -> Judged:
    if when is FALSE:
        return second
    return values.choice(when, first[0], second[0]), values.choice(when, first[1], second[1])


def opened(condition: Expr, names: frozenset[str], leaves: Leaves, suffix: str = "") -> Judged:
    """Return the condition, with each atomic part that reads one of the leaves true or false; not defined if one may not be."""
    unknown: dict[str, Node] = {}
    undefined = False

    def part(expr: Expr) -> Expr:
        nonlocal undefined
        if not names & set(map(str, read_by(expr))):
            return expr
        if isinstance(expr, Apply) and all(isinstance(one.type, Bool) for one in (expr, *expr.args)):
            return replace(expr, args=tuple(map(part, expr.args)))
        undefined = undefined or not all(map(_only_compares, parts(expr)))
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
    """Yield each requirement over time of a program, with its monitor."""
    for stated in program.properties:
        if stated.monitor is not None:
            yield stated, stated.monitor


def asking(program: Program, after: Leaves) -> Iterator[tuple[str, Node]]:
    """Yield the name of each requirement over time, and the condition that a cycle asked for its response."""
    for stated, monitor in monitors(program):
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
    was = {str(earlier(name)): node for name, node in before.items()}
    ghosts: Leaves = {}
    for _, monitor in monitors(program):
        run = Run({}, {}, {**after, **was})
        defined = TRUE
        now = {**after, **was}
        for name, truth in monitor.truths:
            holds, sound = judged(truth, now, refusals)
            now[str(name)] = run.state.leaves[str(name)] = values.both(sound, holds)
            defined = values.both(defined, sound)
        run.state.leaves[str(monitor.defined)] = defined
        run.execute(monitor.statements)
        ghosts |= {str(state.name): run.leaf(state.name) for state in monitor.states}
        if monitor.still and idle is not FALSE:
            waits = values.both(idle, run.evaluate(monitor.waits))
            ghosts |= {
                str(name): values.choice(waits, before[str(name)], run.leaf(name)) for name in monitor.still
            }
    return ghosts


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


def is_ghost(name: str) -> bool:
    """Return whether a name is of a state that the proof keeps and no executor has."""
    return name.startswith((GHOST, WATCHED))
