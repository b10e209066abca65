"""Properties, and requirements and assumptions over time, as the text says them, to conditions of the model.

In: declarations. Out: a `Property` for each: a condition on a cycle and the one before; of what is over time with its monitor.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from rcsc.base.diagnostics.codes import Code
from rcsc.lang.expressions.previous import cycles_of
from rcsc.lang.expressions.scope import Body, Scope
from rcsc.lang.expressions.typed import boolean, without_before
from rcsc.lang.expressions.types import constant
from rcsc.lang.leaves import one_earlier, read_by
from rcsc.lang.model import BEFORE, Apply, Bool, Expr, Int, Kind, Op, Property, VariableName
from rcsc.lang.over_time import monitor, past, requirement
from rcsc.lang.resolve.declarations import requirements
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr, spell_required


def stated(scope: Scope, declarations: Iterable[tree.Declaration]) -> tuple[Property, ...]:
    """Resolve properties, requirements and assumptions over time, in order; those with an error are left out, and reported."""
    resolved: list[Property | None] = []
    for written in declarations:
        if isinstance(written, tree.PropertyDecl) and scope.claim(written.name, "assumption"):
            resolved.append(_property(scope, written))
        elif isinstance(written, tree.RequirementDecl) and scope.claim(written.name, "assumption"):
            resolved.append(_requirement(scope, written))
    return tuple(one for one in resolved if one is not None)


# --- properties ----------------------------------------------------------------------
# A property is a condition on a cycle and the one before, whatever words it is written with:
#
# - `P` is itself: it holds after every cycle;
# - `P then Q` is `was P implies Q`: in linear temporal logic, always (P implies next Q);
# - `P until Q` is `was (P and not Q) implies P or Q`: always (P implies (P weakly until Q)). That Q ever holds is not said; once P
#   has begun to hold it ends no sooner than in the cycle in which Q holds. Source: *unless*, Chandy and Misra, *Parallel Program Design*
#   (1988), chapter 3;
# - `P upon Q` is `P implies was P or Q`: once P does not hold it begins no sooner than in the cycle in which Q holds.


def _property(scope: Scope, written: tree.PropertyDecl) -> Property | None:
    """Resolve a property; None after an error."""
    text = spell_expr(written.condition)
    if written.other is None:
        condition = _condition(scope, written.condition, "")
    else:
        form = _FORMS[written.word]
        text += f" {written.word} {spell_expr(written.other)}"
        first = _condition(scope, written.condition, form.first_of_one_cycle)
        other = _condition(scope, written.other, form.other_of_one_cycle)
        condition = None if first is None or other is None else form.condition(first, other)
    if condition is None:
        return None
    return Property(
        written.name.text,
        condition,
        text,
        " ".join(written.doc),
        written.name.span,
        requirements=requirements(scope, written.requirements),
    )


def _condition(scope: Scope, written: tree.Expr, why_no_before: str) -> Expr | None:
    """Resolve a condition that is about some variable; None (reported) where it is about none."""
    scope.in_property = True
    with without_before(scope, why_no_before), _with_counters(scope):
        condition = boolean(scope, Body(), written)
    scope.in_property = False
    if condition is not None and next(read_by(condition), None) is None:
        message = "this is about no variable: it is always so, or never"
        scope.report(Code.NO_PROPERTY, message, written.span)
        return None
    return condition


@contextmanager
def _with_counters(scope: Scope) -> Iterator[None]:
    """Make the counters of `for` known by name, inside, as witnesses and logs name them."""
    counters = {declared.name: declared for declared in scope.kept if scope.leaves[declared.leaves[0]].counts}
    scope.declared |= counters
    try:
        yield
    finally:
        for name in counters:
            del scope.declared[name]


def _then(first: Expr, other: Expr) -> Expr:
    return _apply(Op.IMPLIES, one_earlier(first), other)


def _until(first: Expr, other: Expr) -> Expr:
    before = _apply(Op.AND, first, Apply(Op.NOT, (other,), Bool()))
    return _apply(Op.IMPLIES, one_earlier(before), _apply(Op.OR, first, other))


def _upon(first: Expr, other: Expr) -> Expr:
    return _apply(Op.IMPLIES, first, _apply(Op.OR, one_earlier(first), other))


@dataclass(frozen=True, slots=True)
class _Form:
    """A word between two conditions.

    Attributes:
        condition: The condition that the two make, on a cycle and the one before.
        first_of_one_cycle: Why `was` cannot stand in the first condition; empty where it can. Likewise `other_of_one_cycle`.
    """

    condition: Callable[[Expr, Expr], Expr]
    first_of_one_cycle: str
    other_of_one_cycle: str


_FORMS = {
    "then": _Form(
        _then, "the left side of `then` looks one cycle back itself, and cannot look back further", ""
    ),
    "until": _Form(
        _until, "the left side of `until` cannot look back", "the right side of `until` cannot look back"
    ),
    "upon": _Form(
        _upon, "the left side of `upon` cannot look back", "the right side of `upon` cannot look back"
    ),
}


def _apply(op: Op, left: Expr, right: Expr) -> Expr:
    return Apply(op, (left, right), Bool())


# --- requirements over time ----------------------------------------------------------


_AS_OTHERS = {
    "only after": requirement.Timing.UNTIL,
    "at least": requirement.Timing.AT_MOST,
    "on": requirement.Timing.FOR,
    "off": requirement.Timing.FOR,
}
"""Timings that others say: P `only after` Q is not P until Q; what begins `at least` so long `apart` begins at most once in that time;
`on for at least` T is, when P, P for a cycle less than T: the cycles in which it is on last that long."""


def _requirement(scope: Scope, written: tree.RequirementDecl) -> Property | None:
    """Resolve a requirement or an assumption over time; None after an error."""
    assumed = written.standing is not None
    scope.past = past.Past(written.name.text, found=_own(scope) if assumed else frozenset())
    required, remembered = _required(scope, written), scope.past
    scope.past = None
    if required is None or not _remembers(scope, written, required):
        return None
    if assumed:
        if not _is_of_outside(scope, written, remembered, required):
            return None
        required = _as_found(remembered, required)
    if required.timing is requirement.Timing.AT_LAST and required.scope in requirement.ENDLESS:
        _without_end(scope, written)
        return None
    watch, kept = monitor.monitored(remembered, required)
    if assumed and watch.owes != past.FALSE:
        message = f"an assumption needs a bound: what `{written.timing}` asks for may always still come"
        helps = "say until when: `within TIME,`, or `before CONDITION,`"
        scope.report(Code.NOT_OF_OUTSIDE, message, written.name.span, helps)
        return None
    name, doc, text = written.name, " ".join(written.doc), spell_required(written)
    named = requirements(scope, written.requirements)
    return Property(
        name.text, kept, text, doc, name.span, requirements=named, monitor=watch, monitored=written.monitored,
        assumed=assumed,
    )  # fmt: skip


# An assumption over time is of what comes from outside. That goes by what the level has shown so far, and by nothing else: so what the
# level keeps itself stands for its value as the cycle finds it, and whether a cycle is as assumed is told once its inputs are there.


def _own(scope: Scope) -> frozenset[VariableName]:
    """Return the leaves that the level writes."""
    return frozenset(leaf.name for leaf in scope.leaves.values() if leaf.kind is not Kind.INPUT)


def _as_found(remembered: past.Past, required: requirement.Requirement) -> requirement.Requirement:
    """Have all conditions of an assumption read what the level writes as the cycle finds it."""
    remembered.truths[:] = [(name, remembered.as_found(truth)) for name, truth in remembered.truths]
    found = remembered.as_found
    return replace(
        required,
        response=found(required.response),
        condition=found(required.condition),
        mode=found(required.mode),
        stop=found(required.stop),
        end=found(required.end),
    )


def _is_of_outside(
    scope: Scope, written: tree.RequirementDecl, remembered: past.Past, required: requirement.Requirement
) -> bool:
    """Return whether an assumption may be trusted, as far as its text tells; report why not."""
    if written.standing in {"monitored", "proved"}:
        message = f"an assumption over time is trusted: nothing shows that it is `{written.standing}`"
        helps = "`assumed`, or `assumed monitored`, which runs watch, too; what a level has to keep is a `requirement`"
        scope.report(Code.NOT_OF_OUTSIDE, message, written.name.span, helps)
        return False
    if not any(scope.leaves[name].kind is Kind.INPUT for name in _reads(remembered, required.response)):
        message = f"`{spell_expr(written.response)}` is about no input: nothing from outside can keep it"
        helps = "assume something of an input; what a level has to keep is a `requirement`"
        scope.report(Code.NOT_OF_OUTSIDE, message, written.response.span, helps)
        return False
    return True


def _reads(remembered: past.Past, condition: Expr) -> set[VariableName]:
    """Return the leaves that a condition reads, also by what it remembers."""
    truths, read, waiting = dict(remembered.truths), set[VariableName](), [condition]
    hidden = {state.name for state in remembered.states}
    seen = set[VariableName]()
    while waiting:
        for name in (VariableName(each.removeprefix(BEFORE)) for each in read_by(waiting.pop())):
            if name not in hidden:
                read.add(name)
            elif name in truths and name not in seen:
                seen.add(name)
                waiting.append(truths[name])
    return read


def _required(scope: Scope, written: tree.RequirementDecl) -> requirement.Requirement | None:
    """Resolve what a requirement says."""
    conditions = {"response": written.response, "mode": written.mode, "condition": written.condition, "stop": written.stop,
                  "end": written.end}  # fmt: skip
    resolved = {part: _condition(scope, one, "") for part, one in conditions.items() if one is not None}
    cycles = 0 if written.time is None else _cycles(scope, written.time)
    times = 1 if written.times is None else _times(scope, written.times)
    if cycles is None or times is None or None in resolved.values():
        return None
    said = {part: one for part, one in resolved.items() if one is not None}
    trigger = requirement.Trigger(written.trigger)
    if written.timing in {"off", "only after"}:
        said["response"] = past.negation(said["response"])
    if written.timing in {"on", "off"}:
        said["condition"], trigger, cycles = said["response"], requirement.Trigger.WHEN, cycles - 1
    timing = _AS_OTHERS.get(written.timing) or requirement.Timing(written.timing)
    scope_ = requirement.Scope(written.scope)
    return requirement.Requirement(timing, trigger=trigger, scope=scope_, cycles=cycles, times=times, **said)


def _times(scope: Scope, written: tree.Expr) -> int | None:
    """Return how often something may begin; None (reported) where it is no such number."""
    value = constant(scope, written)
    if value is None:
        return None
    times = value.literal().value
    if value.unit() or not isinstance(value.expr.type, Int) or not 1 <= times <= monitor.MOST_TIMES:
        message = f"`{spell_expr(written)}` is no number of times from 1 to {monitor.MOST_TIMES}"
        scope.report(Code.NO_CYCLES, message, written.span)
        return None
    return int(times)


def _cycles(scope: Scope, written: tree.Time) -> int | None:
    """Return a time in cycles, at least 1; None (reported) where it is none."""
    value = constant(scope, written.value)
    if value is None:
        return None
    return cycles_of(scope, written, value.literal().value, value.unit(), "the cycle that asks is `at once`")


def _remembers(scope: Scope, written: tree.RequirementDecl, required: requirement.Requirement) -> bool:
    """Return whether a monitor can remember what it has to; report where it would need a state for each cycle of a long time."""
    each = (
        required.scope.only
        and required.timing is requirement.Timing.EXACTLY_AFTER
        and required.trigger is not requirement.Trigger.FIRST
    )
    if not each or required.cycles <= monitor.MOST_REMEMBERED:
        return True
    assert written.time is not None
    message = f"`exactly after` under `{written.scope}` and `{written.trigger}` takes at most {monitor.MOST_REMEMBERED} cycles"
    scope.report(Code.NO_CYCLES, message, written.time.span)
    return False


def _without_end(scope: Scope, written: tree.RequirementDecl) -> None:
    """Report a requirement about the last cycle of intervals that have none: nothing breaks it."""
    what = f"`at last` in `{written.scope}`" if written.scope else "`at last` without a scope"
    message = f"{what} asks for nothing: its interval goes on to the end of the run, and a run need not end"
    helps = "say where it ends: `while CONDITION,`, `before CONDITION,` or `between CONDITION and CONDITION,`"
    scope.report(Code.NO_BOUND, message, written.name.span, helps)
