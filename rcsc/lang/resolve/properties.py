"""Properties: conditions on a cycle and the one before, whatever words they are written with.

In: a declaration. Out: a `Property`, whose one condition says all of it, or diagnostics:

- `P` is itself: it holds after every cycle;
- `P then Q` is `was P implies Q`: in linear temporal logic, always (P implies next Q);
- `P until Q` is `was (P and not Q) implies P or Q`: always (P implies (P weakly until Q)). That Q ever holds is not said; once P
  has begun to hold it ends no sooner than in the cycle in which Q holds. Source: *unless*, Chandy and Misra, *Parallel Program Design*
  (1988), chapter 3;
- `P upon Q` is `P implies was P or Q`: once P does not hold it begins no sooner than in the cycle in which Q holds.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rcsc.base.diagnostics.codes import Code
from rcsc.lang.expressions.scope import Body, Scope
from rcsc.lang.expressions.typed import boolean, without_before
from rcsc.lang.leaves import one_earlier, read_by
from rcsc.lang.model import Apply, Bool, Expr, Op, Property
from rcsc.lang.resolve.declarations import requirements
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr


def resolve_property(scope: Scope, written: tree.PropertyDecl) -> Property | None:
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
