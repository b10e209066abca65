"""Z3's Spacer behind a small typed face: an invariant of a system of integers and truth values, found from its rules alone.

In: terms of `smt` that say how a system begins, goes on, and what is bad. Out: a `Formula` about its state that no step leaves, that
excludes all that is bad; or that something bad is reached; or nothing. Nobody has to believe it: whoever asks has the formula confirmed.

Source: Komuravelli, Gurfinkel and Chaki, "SMT-based model checking for recursive programs", 2014.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, TypeAlias

from rcsc.proof.solvers.smt import Answer, Term


@dataclass(frozen=True, slots=True)
class Holds:
    """The truth value at this place of the state."""

    at: int


@dataclass(frozen=True, slots=True)
class AtMost:
    """A sum of numbers of the state, each by its place and times a factor, is at most so much; `equal`: is so much."""

    factors: tuple[tuple[int, int], ...]
    most: int
    equal: bool = False


@dataclass(frozen=True, slots=True)
class Within:
    """The number at this place lies between two others, both included."""

    at: int
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class Not:
    """The opposite."""

    part: "Formula"


@dataclass(frozen=True, slots=True)
class Joined:
    """Every part, or some part."""

    every: bool
    parts: "tuple[Formula, ...]"


Formula: TypeAlias = Holds | AtMost | Within | Not | Joined


class UnreadableError(Exception):
    """The formula says something that has no words here, such as a product."""


@cache
def _z3() -> Any:
    import z3

    return z3


@dataclass(slots=True)
class Horn:
    """The rules of one system.

    Attributes:
        state: A constant for each part of the state.
        steps: The budget, in Z3's own steps; used by `asked`.
    """

    state: Sequence[Term]
    steps: int
    _asked: Any = field(init=False)
    _reached: Any = field(init=False)
    _bad: Any = field(init=False)
    _known: dict[int, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        z3 = _z3()
        self._asked = z3.Fixedpoint()
        self._asked.set(engine="spacer", rlimit=self.steps)
        sorts = [part.sort() for part in _any(self.state)]
        self._reached = z3.Function("reached", *sorts, z3.BoolSort())
        self._bad = z3.Function("bad", z3.BoolSort())
        for relation in (self._reached, self._bad):
            self._asked.register_relation(relation)

    def begins(self, ends: Sequence[Term], given: Sequence[Term], goes_on: Term, bad: Term) -> None:
        """State a way to begin: where these conditions hold, it ends in that state if it goes on."""
        self._rules([], ends, given, goes_on, bad)

    def follows(self, ends: Sequence[Term], given: Sequence[Term], goes_on: Term, bad: Term) -> None:
        """State a step from any state that is reached."""
        self._rules([self._reached(*self.state)], ends, given, goes_on, bad)

    def _rules(
        self, start: list[Any], ends: Sequence[Term], given: Sequence[Term], goes_on: Term, bad: Term
    ) -> None:
        for constant in _constants([*_any(self.state), *_any(ends), *_any(given), goes_on, bad]):
            if constant.get_id() not in self._known:
                self._known[constant.get_id()] = constant
                self._asked.declare_var(constant)
        self._asked.rule(self._reached(*ends), [*start, *given, goes_on])
        self._asked.rule(self._bad(), [*start, *given, bad])

    def asked(self) -> tuple[Answer, tuple[Formula, ...]]:
        """Return whether something bad is reached; if not, formulas that together show it.

        Raises:
            UnreadableError: They say something that has no words here.
        """
        z3 = _z3()
        before = self._count()
        try:
            answer = self._asked.query(self._bad())
        except z3.Z3Exception as error:
            if self._count() - before < self.steps // 2 and "cancel" in str(error):
                raise KeyboardInterrupt from error  # Z3 takes Ctrl-C for itself
            return Answer.UNKNOWN, ()
        if answer == z3.unsat:
            shown = _read(self._asked.get_cover_delta(-1, self._reached))
            return Answer.UNSATISFIABLE, _conjuncts(shown)
        return (Answer.SATISFIABLE if answer == z3.sat else Answer.UNKNOWN), ()

    def _count(self) -> int:
        """Return the steps that Z3 has counted so far."""
        return next((int(value) for name, value in self._asked.statistics() if name == "rlimit count"), 0)


def _any(terms: Sequence[Term]) -> Sequence[Any]:
    return terms


def _constants(terms: Iterable[Any]) -> list[Any]:
    """List the constants in terms."""
    z3, waiting, seen, found = _z3(), list(terms), set[int](), []
    while waiting:
        term = waiting.pop()
        if term.get_id() not in seen:
            seen.add(term.get_id())
            if z3.is_const(term) and term.decl().kind() == z3.Z3_OP_UNINTERPRETED:
                found.append(term)
            waiting += term.children()
    return found


# --- what it says ------------------------------------------------------------------------


def _read(term: Any) -> Formula:
    """Read a formula over the places of the state."""
    z3 = _z3()
    if z3.is_var(term):
        return Holds(z3.get_var_index(term))
    kind, parts = term.decl().kind(), term.children()
    if kind in (z3.Z3_OP_TRUE, z3.Z3_OP_FALSE):
        return Joined(kind == z3.Z3_OP_TRUE, ())
    if kind == z3.Z3_OP_NOT:
        return Not(_read(parts[0]))
    if kind in (z3.Z3_OP_AND, z3.Z3_OP_OR):
        return Joined(kind == z3.Z3_OP_AND, tuple(map(_read, parts)))
    if kind == z3.Z3_OP_IMPLIES:
        return Joined(False, (Not(_read(parts[0])), _read(parts[1])))
    if kind == z3.Z3_OP_ITE:
        when, then, orelse = map(_read, parts)
        return Joined(True, (Joined(False, (Not(when), then)), Joined(False, (when, orelse))))
    if kind == z3.Z3_OP_EQ and z3.is_bool(parts[0]):
        left, right = map(_read, parts)
        return Joined(True, (Joined(False, (Not(left), right)), Joined(False, (left, Not(right)))))
    return _compared(kind, *parts)


def _conjuncts(formula: Formula) -> tuple[Formula, ...]:
    if isinstance(formula, Joined) and formula.every:
        return tuple(each for part in formula.parts for each in _conjuncts(part))
    return (formula,)


def _compared(kind: int, left: Any, right: Any) -> Formula:
    """Read a comparison of two sums."""
    z3 = _z3()
    factors, constant = _sum(left)
    others, other = _sum(right)
    every = {at: factors.get(at, 0) - others.get(at, 0) for at in sorted({*factors, *others})}
    over = tuple((at, factor) for at, factor in every.items() if factor)
    under = tuple((at, -factor) for at, factor in over)
    most = other - constant
    comparisons: dict[int, Callable[[], Formula]] = {
        z3.Z3_OP_LE: lambda: AtMost(over, most),
        z3.Z3_OP_LT: lambda: AtMost(over, most - 1),
        z3.Z3_OP_GE: lambda: AtMost(under, -most),
        z3.Z3_OP_GT: lambda: AtMost(under, -most - 1),
        z3.Z3_OP_EQ: lambda: AtMost(over, most, equal=True),
    }
    if kind not in comparisons:
        raise UnreadableError
    return comparisons[kind]()


def _sum(term: Any) -> tuple[Mapping[int, int], int]:
    """Read a sum: factors by place, and a constant."""
    z3 = _z3()
    if z3.is_int_value(term):
        return {}, term.as_long()
    if z3.is_var(term):
        return {z3.get_var_index(term): 1}, 0
    kind, parts = term.decl().kind(), term.children()
    signs = {z3.Z3_OP_ADD: (1, 1), z3.Z3_OP_SUB: (1, -1), z3.Z3_OP_UMINUS: (-1, -1)}
    if kind == z3.Z3_OP_MUL and len(parts) == 2 and z3.is_int_value(parts[0]):
        factors, constant = _sum(parts[1])
        times = parts[0].as_long()
        return {at: factor * times for at, factor in factors.items()}, constant * times
    if kind not in signs:
        raise UnreadableError
    total: dict[int, int] = {}
    whole = 0
    for place, part in enumerate(parts):
        sign = signs[kind][place > 0]
        factors, constant = _sum(part)
        whole += sign * constant
        for at, factor in factors.items():
            total[at] = total.get(at, 0) + sign * factor
    return total, whole
