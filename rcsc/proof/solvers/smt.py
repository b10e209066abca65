"""Z3 behind a small typed face; its only importer, and only when a question is asked.

In: terms built by the functions here. Out: `Answer`s. A time-out, exhausted memory, an exception and
`unknown` are all `UNKNOWN`: nobody can take them for a proof.
"""

import signal
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum, auto
from fractions import Fraction
from functools import cache
from typing import Any, NewType

from rcsc.lang.model import Bool, Real, Scalar, Single, Value
from rcsc.proof.solvers.options import Limits

Term = NewType("Term", object)
"""A Z3 expression; only this module looks inside."""


class Answer(Enum):
    """The solver's answer about the formulas together."""

    SATISFIABLE = auto()
    UNSATISFIABLE = auto()
    UNKNOWN = auto()


@cache
def _z3() -> Any:
    import z3

    if _threads.is_set():
        _count_with_care()
    return z3


_threads = threading.Event()


def for_threads() -> None:
    """Make it safe for any thread of this process to release terms while another one asks.

    Python collects cycles in whatever thread happens to run, and Z3, unless told, is not safe against that: the question that another
    thread asks meanwhile is answered wrongly, or the process ends. Threads still ask one after the other.
    """
    if not _threads.is_set():
        _threads.set()
        if "z3" in sys.modules:
            _count_with_care()


def _count_with_care() -> None:
    z3 = sys.modules["z3"]
    z3.Z3_enable_concurrent_dec_ref(z3.main_ctx().ref())


_cut: list[int] = []
"""Processor time, in seconds, of each question of this process that the backstop ended."""


def cut_short() -> int:
    """Count this process's questions that the clock ended: no verdict that saw one is kept."""
    return len(_cut)


_open: list[str] = []
"""Why there was none, of each question of this process without an answer."""


def unanswered() -> int:
    """Count this process's questions without an answer; while the count stays, a larger budget changes nothing."""
    return len(_open)


def leave_open(why: str) -> None:
    """Count a question that is left to be asked later."""
    _open.append(why)


@dataclass(
    slots=True, eq=False
)  # each is itself: of two that are as far spent, one inside the other, either ends by itself
class Budget:
    """The most that all questions asked inside `together` may cost.

    Attributes:
        left: Steps; with none left nothing more is asked, and every answer is `UNKNOWN`.
        of_all: Whether it bounds what is done outside Z3, too, where that is charged.
    """

    left: int
    of_all: bool = False

    @property
    def spent(self) -> bool:
        """Whether no steps are left."""
        return self.left <= 0


@dataclass(slots=True, eq=False, kw_only=True)
class _Until(Budget):
    """A budget that ends with an event instead of steps, for a caller that shows partial results, or gives up."""

    over: Callable[[], bool]

    @property
    def spent(self) -> bool:
        """Whether the event has happened."""
        return self.over()


class _Thread(threading.local):
    """The budgets of a thread: a question that one thread gives up is not given up by another."""

    def __init__(self) -> None:
        self.budgets: list[Budget] = []


_own = _Thread()
WATCH_S = 0.008
"""A question that nobody waits for any more is broken off within so long, and what Z3 takes to hear of it."""
_asking: dict[int, bool] = {}
"""Threads whose question Z3 is at, and whether it was broken off."""
_breaking = threading.Lock()
"""Held by who looks whether a question is under way, until he has broken it off; so nothing is broken off that has begun since."""


@contextmanager
def until(over: Callable[[], bool], *, breaks_off: bool = False) -> Iterator[None]:
    """Ask nothing more inside once an event has happened; every answer is then `UNKNOWN`.

    Args:
        over: Tells whether it has happened.
        breaks_off: Whether the question under way is broken off, too; `over` is then asked in another thread as well.
    """
    ending, left = _Until(sys.maxsize, over=over), threading.Event()
    watcher = (
        threading.Thread(target=_watch, args=(over, left, threading.get_ident()), daemon=True)
        if breaks_off
        else None
    )
    _own.budgets.append(ending)
    if watcher is not None:
        watcher.start()
    try:
        yield
    finally:
        left.set()
        if watcher is not None:
            watcher.join()  # whoever asks next is not broken off
        _own.budgets.remove(ending)


def _watch(over: Callable[[], bool], left: threading.Event, asker: int) -> None:
    while not left.wait(WATCH_S):
        if over():
            with _breaking:
                if asker in _asking:
                    _asking[asker] = True
                    _z3().main_ctx().interrupt()


def _absorb() -> None:
    """Ask a trivial question until Z3 answers it: until it has noticed an interrupt, what is stated may be lost."""
    z3, answer = _z3(), None
    while answer != z3.sat:
        solver = z3.Solver()
        solver.add(z3.Bool("absorbed"))
        answer = solver.check()


@contextmanager
def together(steps: int, *, of_all: bool = False) -> Iterator[Budget]:
    """Bound the steps of all questions, of all solvers, asked inside; with `of_all` also the work charged outside Z3."""
    budget = Budget(steps, of_all)
    with within(budget):
        yield budget


@contextmanager
def within(budget: Budget) -> Iterator[None]:
    """Bound all questions asked inside by the rest of a budget; the parts of one work share a budget in this way."""
    _own.budgets.append(budget)
    try:
        yield
    finally:
        _own.budgets.remove(budget)


def charge(steps: int) -> bool:
    """Charge work done outside Z3, in its steps, to the budgets that bound both; return whether one is spent."""
    charged = [budget for budget in _own.budgets if budget.of_all]
    for budget in charged:
        budget.left -= steps
    return any(budget.spent for budget in charged)


def spent() -> bool:
    """Return whether a budget is spent, so that no question need be made."""
    return any(budget.spent for budget in _own.budgets)


def gives_up(what: str) -> bool:
    """Return whether an event (`until`) ends long work outside Z3; what is then not looked for counts as left open.

    Args:
        what: The thing that would be looked for.
    """
    if any(isinstance(budget, _Until) and budget.spent for budget in _own.budgets):
        leave_open(what)
        return True
    return False


class UndecidedError(Exception):
    """Z3 gave no answer within its limits, where one is needed."""


def troubles() -> tuple[type[BaseException], ...]:
    """Return the errors after which nothing is proved: no answer where one is needed, errors of Z3, exhausted memory."""
    loaded = sys.modules.get("z3")
    return (UndecidedError, MemoryError, *(() if loaded is None else (loaded.Z3Exception,)))


def _float_sort(kind: Real) -> Any:
    return _z3().Float32() if isinstance(kind, Single) else _z3().Float64()


def variable(name: str, kind: Scalar) -> Term:
    """Return a fresh constant: Bool, IEEE double or single, or a mathematical integer (also for enumerations)."""
    z3 = _z3()
    if isinstance(kind, Bool):
        return Term(z3.Bool(name))
    return Term(z3.FP(name, _float_sort(kind)) if isinstance(kind, Real) else z3.Int(name))


def word(name: str, bits: int) -> Term:
    """Return a fresh constant for a whole number as its bits; for masks that is hundreds of times quicker than an integer.

    In other arithmetic it becomes the integer of these bits, which takes longer: `expressions.words.bits_alone`.
    """
    return Term(_z3().BitVec(name, bits))


def literal(kind: Scalar, value: Value) -> Term:
    """Return a constant of the kind."""
    z3 = _z3()
    if isinstance(kind, Bool):
        return Term(z3.BoolVal(bool(value)))
    return Term(
        z3.FPVal(float(value), _float_sort(kind)) if isinstance(kind, Real) else z3.IntVal(int(value))
    )


def member(name: str) -> Term:
    """Return a fresh constant for a member of an enumeration, as its index in 16 bits: quicker than an integer."""
    return Term(_z3().BitVec(name, 16))


def member_literal(index: int) -> Term:
    """Return a member as a constant; indices are far below the sign bit, so that bits are ordered as they are."""
    return Term(_z3().BitVecVal(index, 16))


def number(name: str) -> Term:
    """Return a fresh constant for a real number of unlimited precision."""
    return Term(_z3().Real(name))


def fraction(value: float) -> Term:
    """Return a finite double as an exact real number."""
    return Term(_z3().RealVal(str(Fraction(value))))


def as_number(term: Term) -> Term:
    """Convert an integer to a real number."""
    return Term(_z3().ToReal(_whole(term)))


def truth(value: bool) -> Term:
    """Return the constant true or false."""
    return Term(_z3().BoolVal(value))


def negation(term: Term) -> Term:
    """Return the negation of the term."""
    z3, one = _z3(), _ast(term)
    ctx = z3.main_ctx()
    return Term(z3.BoolRef(z3.Z3_mk_not(ctx.ref(), one), ctx))


def all_of(terms: Sequence[Term]) -> Term:
    """Return the conjunction; true when there are no terms."""
    return _joined("Z3_mk_and", terms) if terms else truth(True)  # other solvers do not read `and` of nothing


def any_of(terms: Sequence[Term]) -> Term:
    """Return the disjunction; false when there are no terms."""
    return _joined("Z3_mk_or", terms) if terms else truth(False)


def _ast(term: Term) -> Any:
    whole: Any = term
    return whole.as_ast()


def _joined(by: str, terms: Sequence[Term]) -> Term:
    """Return conditions joined; `z3.And` and `z3.Or` convert each of them first, which takes most of their time."""
    z3 = _z3()
    ctx = z3.main_ctx()
    every = (z3.Ast * len(terms))(*map(_ast, terms))
    return Term(z3.BoolRef(getattr(z3, by)(ctx.ref(), len(terms), every), ctx))


def _whole(term: Term) -> Any:
    z3: Any = _z3()
    return z3.BV2Int(term) if z3.is_bv(term) else term


def _alike(left: Term, right: Term) -> tuple[Any, Any]:
    """Return two whole numbers as terms of one sort: bits where both are, or one is a constant of no more bits; else integers."""
    z3: Any = _z3()
    one: Any = left
    other: Any = right
    if z3.is_bv(one) and z3.is_bv(other):
        wider = max(one.size(), other.size())
        return z3.ZeroExt(wider - one.size(), one), z3.ZeroExt(wider - other.size(), other)
    if z3.is_bv(one) and z3.is_int_value(other) and 0 <= other.as_long() < 1 << one.size():
        return one, z3.BitVecVal(other.as_long(), one.size())
    if z3.is_bv(other) and z3.is_int_value(one) and 0 <= one.as_long() < 1 << other.size():
        return z3.BitVecVal(one.as_long(), other.size()), other
    return _whole(left), _whole(right)


def at_point(term: Term, point: Sequence[tuple[Term, Term]]) -> Term:
    """Put values in for constants, each given with a literal of its kind, and simplify; mostly that leaves true or false."""
    z3: Any = _z3()
    return Term(z3.simplify(z3.substitute(term, *(_alike(leaf, value) for leaf, value in point))))


def implication(left: Term, right: Term) -> Term:
    """Return the term that `left` implies `right`."""
    return Term(_z3().Implies(left, right))


def choice(condition: Term, then: Term, orelse: Term) -> Term:
    """Return `then` where the condition holds, else `orelse`."""
    if then is orelse:
        return then
    z3, (one, other) = _z3(), _alike(then, orelse)
    if type(one) not in (z3.BoolRef, z3.ArithRef, z3.BitVecRef):  # a literal, or a float
        return Term(z3.If(condition, one, other))
    ctx = z3.main_ctx()
    return Term(type(one)(z3.Z3_mk_ite(ctx.ref(), _ast(condition), one.as_ast(), other.as_ast()), ctx))


def equal(left: Term, right: Term, kind: Scalar) -> Term:
    """Return the term that two values of the kind are equal; 0.0 equals -0.0."""
    if isinstance(kind, Real):
        return Term(_z3().fpEQ(left, right))
    a, b = _alike(left, right)
    return Term(a == b)


def at_most(left: Term, right: Term, kind: Scalar) -> Term:
    """Return the term `left <= right`; false comes before true."""
    z3: Any = _z3()
    if isinstance(kind, Bool):
        return Term(z3.Implies(left, right))
    if isinstance(kind, Real):
        return Term(z3.fpLEQ(left, right))
    a, b = _alike(left, right)
    return Term(z3.ULE(a, b) if z3.is_bv(a) else a <= b)


def below(left: Term, right: Term, kind: Scalar) -> Term:
    """Return the term `left < right`; false comes before true."""
    z3: Any = _z3()
    if isinstance(kind, Bool):
        return Term(z3.And(z3.Not(left), right))
    if isinstance(kind, Real):
        return Term(z3.fpLT(left, right))
    a, b = _alike(left, right)
    return Term(z3.ULT(a, b) if z3.is_bv(a) else a < b)


def integer_operation(op: str, left: Term, right: Term) -> Term:
    """Return `left op right` of mathematical integers, or of reals for `+ - *`; `/` rounds toward zero, `mod` goes with it."""
    z3: Any = _z3()
    if op in ("/", "mod") and z3.is_bv(left) and z3.is_int_value(right):
        by: Any = right
        if by.as_long() > 0:
            return part(op, left, by.as_long())
    a, b = _whole(left), _whole(right)
    if op in ("+", "-", "*"):
        return Term({"+": a + b, "-": a - b, "*": a * b}[op])
    size = z3.If(a >= 0, a, -a) / z3.If(b >= 0, b, -b)
    quotient = z3.If((a >= 0) == (b > 0), size, -size)
    return Term(quotient if op == "/" else a - quotient * b)


def part(op: str, left: Term, right: int) -> Term:
    """Return `/` or `mod` of a nonnegative integer by a positive one; of the bits of a word, by a power of two, that takes few terms."""
    z3: Any = _z3()
    a: Any = left
    places = right.bit_length() - 1
    if not z3.is_bv(a) or right != 1 << places:
        return Term(_whole(left) / right if op == "/" else _whole(left) % right)
    if places >= a.size():
        return Term(z3.IntVal(0)) if op == "/" else left
    if op == "/":
        return Term(z3.Extract(a.size() - 1, places, a))
    return Term(z3.Extract(places - 1, 0, a) if places else z3.IntVal(0))


def masked(word: Term, care: int, value: int) -> Term | None:
    """Return the term that the word's bits in `care` are those of `value`; None for a word that is an integer."""
    z3: Any = _z3()
    a: Any = word
    return Term(a & care == value) if z3.is_bv(a) else None


def quotient(left: Term, right: float) -> Term:
    """Return a real number divided by a nonzero constant."""
    a: Any = left
    return Term(a / _z3().RealVal(str(Fraction(right))))


def float_operation(op: str, left: Term, right: Term) -> Term:
    """Return `+ - * /` of doubles, or of singles, rounded to nearest even."""
    z3: Any = _z3()
    operation = {"+": z3.fpAdd, "-": z3.fpSub, "*": z3.fpMul, "/": z3.fpDiv}[op]
    return Term(operation(z3.RNE(), left, right))


def minus(term: Term, kind: Scalar) -> Term:
    """Return the negative of a number."""
    return Term(_z3().fpNeg(term) if isinstance(kind, Real) else -_whole(term))


def absolute(term: Term, kind: Scalar) -> Term:
    """Return the absolute value of a number."""
    z3: Any = _z3()
    if isinstance(kind, Real):
        return Term(z3.fpAbs(term))
    a = _whole(term)
    return Term(z3.If(a < 0, -a, a))


def to_float(term: Term, kind: Scalar, target: Real) -> Term:
    """Convert an integer, a double or a single to the nearest double or single, as `target` is."""
    z3: Any = _z3()
    if isinstance(kind, Real):
        return Term(z3.fpFPToFP(z3.RNE(), term, _float_sort(target)))
    return Term(z3.fpRealToFP(z3.RNE(), z3.ToReal(_whole(term)), _float_sort(target)))


def to_integer(term: Term) -> Term:
    """Convert a finite double or single to an integer, without its fraction."""
    z3: Any = _z3()
    return Term(z3.ToInt(z3.fpToReal(z3.fpRoundToIntegral(z3.RTZ(), term))))


class Solver:
    """One incremental solver.

    What Z3 has of a question that was broken off, by its steps, the clock or a user, is not fit for the next: a process that went on
    with it has ended by a null pointer in Z3 (5.4), and to drop assertions from it can take Z3 for ever. So it is dropped, and what
    was asserted is stated to a new one.

    Args:
        limits: Of each question.
        remembers: Whether `refuted` is kept.
        counted_alone: Whether Z3 leaves out the cuts of integers by Hermite normal forms: it does not count what they take, which
            was 40 s where two versions of a table with masks of 64 bits were compared.
        at_once: Whether Z3 searches from the first question on as it does with assumptions, and does not transform what is asserted before:
            a cycle that keeps an invariant follows mostly by propagation, and took ten times as many steps.

    Attributes:
        queries: How often it was asked.
        refuted: If it remembers: for each unsatisfiable answer, the assertions that are not permanent.
        names: How many constants stand for terms.
    """

    def __init__(
        self,
        limits: Limits = Limits(),
        *,
        remembers: bool = False,
        counted_alone: bool = False,
        at_once: bool = False,
    ) -> None:
        _z3().set_param("memory_max_size", limits.memory_mb)
        self._steps = self._given = limits.steps
        self._cpu_s = self._patience_s = limits.cpu_s
        self._seed = 0
        self._counted_alone = counted_alone
        self._at_once = at_once
        self._incremental = False
        self._asserted: list[list[Term]] = [[]]
        self._begin()
        self.queries = 0
        self.refuted: list[Term] = []
        self._remembers = remembers
        self._model: Any = None
        self.names = 0

    def _begin(self, assuming: tuple[Term, ...] = ()) -> None:
        """Make a solver of Z3, and state to it all that is asserted; `assuming` is what the next question assumes."""
        z3 = _z3()
        self._solver: Any = z3.SimpleSolver() if self._at_once else z3.Solver()
        self._broken = False
        self._solver.set("rlimit", self._given)
        # Past so much time a question ends; on a busy machine that is more than the time that it gets.
        self._solver.set("timeout", max(1, round(1000 * self._patience_s)))
        self._solver.set("random_seed", self._seed)
        if self._counted_alone:
            self._solver.set("arith.enable_hnf", False)
        permanent, *pushed = self._asserted
        self._assert(permanent)
        if self._incremental and not assuming:  # until then Z3 asks another solver than it did before
            self._solver.push()
            self._solver.pop()
        for terms in pushed:
            self._solver.push()
            self._assert(terms)

    def _assert(self, terms: Iterable[Term]) -> None:
        """State the terms to Z3; its own `add` converts each first."""
        z3 = _z3()
        ctx = z3.main_ctx().ref()
        for term in terms:
            z3.Z3_solver_assert(ctx, self._solver.solver, _ast(term))

    def _mend(self, assuming: tuple[Term, ...] = ()) -> None:
        """Begin anew after a question that was broken off."""
        if self._broken:
            self._begin(assuming)

    def begins_anew(self, steps: int, seed: int) -> None:
        """Bound each later question to so many steps, and seed the search anew."""
        self._steps, self._seed = steps, seed
        self._solver.set("random_seed", seed)

    def named(self, term: Term) -> Term:
        """Return a constant that equals the term: quicker to read from a model, and to ask about. Call outside `push`."""
        defined: Any = term
        self.names += 1
        constant: Any = _z3().Const(f"named!{self.names}", defined.sort())
        self.add(Term(constant == term))
        return Term(constant)

    def switch(self, term: Term) -> Term:
        """Return a constant that, assumed in `check`, makes the term hold; what is learnt meanwhile outlives the question."""
        asked: Any = term
        if _z3().is_const(asked):
            return term
        self.names += 1
        constant = Term(_z3().Bool(f"switch!{self.names}"))
        self.add(implication(constant, term))
        return constant

    def add(self, *terms: Term) -> None:
        """Assert the terms."""
        self._asserted[-1] += terms
        if not self._broken:
            self._assert(terms)

    def push(self) -> None:
        """Remember what is asserted now, for `pop`."""
        self._asserted.append([])
        self._incremental = True
        if not self._broken:
            self._solver.push()

    def pop(self) -> None:
        """Drop what was asserted since the last `push`."""
        self._asserted.pop()
        if not self._broken:
            self._solver.pop()

    def check(self, *assuming: Term) -> Answer:
        """Ask whether all that is asserted can hold together with these terms."""
        self._model = None
        if spent():
            _open.append("spent")
            return Answer.UNKNOWN
        z3 = _z3()
        self.queries += 1
        self._mend(assuming)
        self._incremental |= bool(assuming)
        self._give(min([self._steps, *(budget.left for budget in _own.budgets)]))
        try:
            answer, why = self._answer(assuming)
        except (z3.Z3Exception, MemoryError) as error:
            answer, why = z3.unknown, str(error)
        if "interrupted" in why and not spent():  # Z3 takes Ctrl-C for itself
            raise KeyboardInterrupt
        if answer == z3.unsat and self._remembers:
            pushed = [term for terms in self._asserted[1:] for term in terms]
            self.refuted.append(all_of([*pushed, *assuming]))
        if answer == z3.sat:
            return Answer.SATISFIABLE
        if answer != z3.unsat:
            _open.append(why)
        return Answer.UNSATISFIABLE if answer == z3.unsat else Answer.UNKNOWN

    def core(self, *assuming: Term) -> tuple[Term, ...]:
        """Return those of the terms assumed in the last question, constants or negated ones, that suffice for its unsatisfiable answer."""
        used = {one.get_id() for one in self._solver.unsat_core()}
        every: tuple[Any, ...] = assuming
        return tuple(Term(one) for one in every if one.get_id() in used)

    def possible(self, *assuming: Term) -> bool:
        """Return whether all asserted terms, and these, hold together for some values.

        Raises:
            UndecidedError: Z3 gave no answer.
        """
        answer = self.check(*assuming)
        if answer is Answer.UNKNOWN:
            raise UndecidedError
        return answer is Answer.SATISFIABLE

    def _answer(self, assuming: tuple[Term, ...]) -> tuple[Any, str]:
        """Return Z3's answer, and why there is none; ask again where other processes took the time that it was given."""
        z3 = _z3()
        while True:
            counted = self._count()
            used_s, passed_s = time.thread_time(), time.monotonic()
            answer, broken_off = self._asked(assuming)
            signal.siginterrupt(signal.SIGINT, True)  # Z3 leaves it so that Ctrl-C ends no wait for a worker
            if broken_off:
                return z3.unknown, "interrupted"  # whatever Z3 says by then
            if answer != z3.unknown:
                self._charge(counted)
                return answer, ""
            used_s, passed_s = time.thread_time() - used_s, time.monotonic() - passed_s
            why = str(self._solver.reason_unknown())
            if passed_s < 0.9 * self._patience_s or "interrupted" in why:
                self._charge(counted)
                return answer, why
            if used_s >= 0.9 * self._cpu_s:
                _cut.append(round(used_s))
                return answer, why
            self._patience_s *= 4
            self._begin(assuming)

    def _asked(self, assuming: tuple[Term, ...]) -> tuple[Any, bool]:
        """Return Z3's answer, and whether it was broken off."""
        asker, broken_off, answer = threading.get_ident(), False, None
        with _breaking:
            _asking[asker] = False
        try:
            answer = self._solver.check(*assuming)
        finally:
            with _breaking:
                broken_off = _asking.pop(asker)
            if broken_off:
                _absorb()
            self._broken = broken_off or answer not in (_z3().sat, _z3().unsat)
        return answer, broken_off

    def _give(self, steps: int) -> None:
        """Make Z3 end each later question after so many steps."""
        if steps != self._given:
            self._given = steps
            self._solver.set("rlimit", steps)

    def _count(self) -> int:
        """Return the steps that Z3 has counted so far; 0 where no budget needs them."""
        if _own.budgets:
            counts = self._solver.statistics()
            for at in range(len(counts) - 1, -1, -1):  # it is one of the last, and each takes several calls
                name, value = counts[at]
                if name == "rlimit count":
                    return int(value)
        return 0

    def _charge(self, before: int) -> None:
        """Charge a question's steps to all budgets; not those of an attempt that only the clock ended."""
        used = self._count() - before
        for budget in _own.budgets:
            budget.left -= used

    def script(self) -> str:
        """Spell all that is asserted as an SMT-LIB 2 script that ends in `(check-sat)`."""
        stated = _z3().Solver()  # one that searches at once has rewritten it
        stated.add(*(term for terms in self._asserted for term in terms))
        return f"(set-logic ALL)\n{stated.to_smt2()}"

    def refutations(self) -> str:
        """Return a script that is unsatisfiable just if all unsatisfiable answers, at least one, were right; call outside `push`."""
        self.push()
        self.add(any_of(self.refuted))
        script = self.script()
        self.pop()
        return script

    def value(self, term: Term, kind: Scalar) -> Value:
        """Return the value of a constant in the model of the last satisfiable answer."""
        z3 = _z3()
        if self._model is None:
            self._model = self._solver.model()
        if isinstance(kind, Real):
            evaluated = self._model.eval(term, model_completion=True)
            bits = z3.simplify(z3.fpToIEEEBV(evaluated)).as_long()
            sizes = ("<f", "<I") if isinstance(kind, Single) else ("<d", "<Q")
            number: float = struct.unpack(sizes[0], struct.pack(sizes[1], bits))[0]
            return number + 0.0
        ctx, found = z3.main_ctx().ref(), (z3.Ast * 1)()  # as `eval` does, of which thousands are asked
        z3.Z3_model_eval(ctx, self._model.model, _ast(term), True, found)
        if isinstance(kind, Bool):
            return bool(z3.Z3_get_bool_value(ctx, found[0]) == z3.Z3_L_TRUE)
        return int(z3.Z3_get_numeral_string(ctx, found[0]))
