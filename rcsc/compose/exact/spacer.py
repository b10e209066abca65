"""Invariants about how numbers relate, such as one counter that is never ahead of another, by Spacer on integers (`solvers.horn`).

In: the cycles of a level, an obligation, and what is known. Out: conditions on its leaves, to be confirmed. Truth values are such, and
members of enumerations and reals are integers, by their keys; what is open in `keyed` is open here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from rcsc.compose.contract.obligations import Obligation, obligations
from rcsc.compose.contract.predicates import cone
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.exact.said import Found
from rcsc.lang.model import Enum, Scalar
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.horn import Horn, UnreadableError
from rcsc.proof.solvers.smt import Answer, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import KEY, Keyed
from rcsc.proof.symbolic.values import Node


class _Whole(Keyed):
    """Makes terms in which members of enumerations are integers: Spacer finds what they are compared with."""

    def fresh(self, name: str, kind: Scalar) -> Term:
        """Return a constant."""
        return smt.variable(name, KEY) if isinstance(kind, Enum) else super().fresh(name, kind)

    def literal(self, kind: Scalar, value: int | float) -> Term:
        """Return a constant value."""
        return smt.literal(KEY, int(value)) if isinstance(kind, Enum) else super().literal(kind, value)


@dataclass(frozen=True, slots=True)
class Lemmas:
    """What is known of a later cycle.

    Attributes:
        before: Conditions that hold before it; those about other leaves are left out.
        within: Conditions of the whole cycle. Leaves outside the cone in them may then have any values.
    """

    before: tuple[Node, ...] = ()
    within: tuple[Node, ...] = ()


def related(
    ts: TransitionSystem,
    firsts: Sequence[Cycle],
    step: Cycle,
    owed: Obligation,
    lemmas: Lemmas,
    steps: int,
) -> tuple[Answer, tuple[Found, ...]]:
    """Return whether a run breaks the obligation, as far as Spacer tells; if none does, conditions that show it."""
    roots = [step.contract, step.goes_on, owed.holds]
    inside = cone(step, roots)
    leaves = [name for name in step.before if name in inside]
    if not leaves:
        return Answer.UNKNOWN, ()
    known = [one for one in lemmas.before if values.variables([one]).keys() <= inside]
    known += [one for one in lemmas.within if values.variables([one]).keys() & inside]
    keyed = _Whole()
    horn = Horn([keyed.term(step.before[name]) for name in leaves], steps)
    every = [keyed]
    for first in firsts:
        holds = next(one.holds for one in obligations(ts, first) if one.key == owed.key)
        every.append(_Whole())
        horn.begins(*_rule(every[-1], first, leaves, holds, []))
    horn.follows(*_rule(keyed, step, leaves, owed.holds, known))
    try:
        answer, formulas = horn.asked()
        if answer is Answer.SATISFIABLE and any(one.guessed for one in every):
            return Answer.UNKNOWN, ()  # what is open may do what no run does
        return answer, tuple(Found(tuple(leaves), formula) for formula in formulas)
    except UnreadableError:
        return Answer.UNKNOWN, ()


def _rule(
    keyed: Keyed, cycle: Cycle, leaves: Sequence[str], holds: Node, known: Sequence[Node]
) -> tuple[list[Term], list[Term], Term, Term]:
    """Return the state after the cycle, its conditions, that it goes on, and that it breaks the obligation."""
    ends = [keyed.term(cycle.after[name]) for name in leaves]
    given = [keyed.term(node) for node in (cycle.contract, *known)]
    goes_on, bad = keyed.term(cycle.goes_on), keyed.term(values.negation(holds))
    return ends, [*keyed.ranges, *given], goes_on, bad
