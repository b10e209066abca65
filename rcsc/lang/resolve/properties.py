"""Properties: conditions on a cycle and the one before, whatever words they are written with.

In: a declaration. Out: a `Property`, whose one condition says all of it, or diagnostics:

- `P` is itself: it holds after every cycle;
- `P then Q` is `was P implies Q`: in linear temporal logic, always (P implies next Q);
- `P until Q` is `was (P and not Q) implies P or Q`: always (P implies (P weakly until Q)). That Q ever holds is not said; once P
  has begun to hold it ends no sooner than in the cycle in which Q holds. Source: *unless*, Chandy and Misra, *Parallel Program Design*
  (1988), chapter 3.
"""

from rcsc.diagnostics.codes import Code
from rcsc.lang.expressions.scope import Body, Scope
from rcsc.lang.expressions.typed import boolean, without_before
from rcsc.lang.leaves import one_earlier, read_by
from rcsc.lang.model import Apply, Bool, Expr, Op, Property
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr


def made_property(scope: Scope, one: tree.PropertyDecl) -> Property | None:
    """The property; None after an error."""
    first = _condition(scope, one.condition, _BEFORE_WORD[one.word])
    other = None if one.other is None else _condition(scope, one.other, _BEHIND_WORD[one.word])
    if first is None or (one.other is not None and other is None):
        return None
    text = spell_expr(one.condition)
    if one.other is not None and other is not None:
        text += f" {one.word} {spell_expr(one.other)}"
        first = _then(first, other) if one.word == "then" else _until(first, other)
    return Property(one.name.text, first, text, " ".join(one.doc), one.name.span)


_BEFORE_WORD = {
    "": "",
    "then": "what stands before `then` is of the cycle before as it is",
    "until": "what stands before `until` is of one cycle",
}
"""Why `was` cannot stand in the first condition, by the word after it."""
_BEHIND_WORD = {"then": "", "until": "what stands behind `until` is of one cycle"}


def _condition(scope: Scope, written: tree.Expr, why_no_before: str) -> Expr | None:
    """A condition that speaks of something."""
    with without_before(scope, why_no_before):
        condition = boolean(scope, Body(), written)
    if condition is not None and next(read_by(condition), None) is None:
        message = "this is about no variable: it is always so, or never"
        scope.report(Code.NO_PROPERTY, message, written.span)
        return None
    return condition


def _then(first: Expr, other: Expr) -> Expr:
    return _apply(Op.IMPLIES, one_earlier(first), other)


def _until(first: Expr, other: Expr) -> Expr:
    before = _apply(Op.AND, first, Apply(Op.NOT, (other,), Bool()))
    return _apply(Op.IMPLIES, one_earlier(before), _apply(Op.OR, first, other))


def _apply(op: Op, one: Expr, two: Expr) -> Expr:
    return Apply(op, (one, two), Bool())
