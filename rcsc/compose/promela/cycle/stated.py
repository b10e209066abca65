"""What the program itself states, its invariants and properties, as statements around the cycle.

In: a level, flat, and the groups of names of the whole model. Out: `Stated`. An invariant is looked at before the cycle, with what the
level begins with, and after it; a property after it, where `was x` is what `x` was when the cycle began, before anything was
taken. Only leaves of which a property says `was` are remembered.

A small instance has only a few values of reals, and what is computed of them is any of these; its numbers go round after few. A statement
whose truth would hang on that is left out, with the reason: found broken there, it might well hold.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import NUMBERS
from rcsc.compose.promela.cycle.aims import Aim, Aims
from rcsc.compose.promela.cycle.flows import EQUALITIES, Group
from rcsc.compose.promela.cycle.statements import Block, Flat, Flattener, Fork, Put
from rcsc.lang.leaves import read_by
from rcsc.lang.model import (
    BEFORE,
    Among,
    Apply,
    Bool,
    Expr,
    Int,
    Invariant,
    Literal,
    Op,
    Property,
    Read,
    ReadLocal,
    Real,
    Select,
)

LOGIC = frozenset({Op.AND, Op.OR, Op.NOT, Op.IMPLIES})
NAMED = Read | Select
STEPS = frozenset({1, NUMBERS - 1})
"""From a number to the next, and to the one before."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A statement that the instance cannot speak of, and why."""

    aim: Aim
    reason: str

    @property
    def shown(self) -> str:
        """In one line."""
        return f"{self.aim.shown}: {self.reason}"


@dataclass(frozen=True, slots=True)
class Stated:
    """What is put around a cycle.

    Attributes:
        earlier: Before anything is taken: what `was` speaks of.
        before: Before the cycle; `behind`, at its end.
    """

    earlier: Block = ()
    before: Block = ()
    behind: Block = ()
    left_out: tuple[LeftOut, ...] = ()


@dataclass(slots=True)
class Stating:
    """Makes it.

    Attributes:
        groups: Of all names of the model, without what is stated.
        numbers: Command numbers, by the contract.
        computed: Names whose values are computed of reals.
    """

    flat: Flattener
    aims: Aims
    groups: Mapping[str, Group]
    numbers: frozenset[str]
    computed: frozenset[str]
    _left_out: list[LeftOut] = field(default_factory=list)

    def stated(self) -> Stated:
        """All that the program states."""
        invariants = tuple(self._fit(Sort.INVARIANT, self.flat.program.invariants))
        properties = tuple(self._fit(Sort.PROPERTY, self.flat.program.properties))
        earlier = tuple(self._earlier(condition for _, condition in properties))
        before = tuple(self._checks(invariants))
        return Stated(
            earlier, before, (*before, *self._checks(properties)), tuple(self._left_out)
        )  # an invariant is one check, looked at twice

    def _fit(
        self, sort: Sort, statements: Sequence[Invariant] | Sequence[Property]
    ) -> Iterator[tuple[Aim, Expr]]:
        for one in statements:
            aim = Aim(self.flat.level, sort.value, "", str(one.name))
            reason = next(self._unfit(one.condition), None)
            if reason is not None:
                self._left_out.append(LeftOut(aim, reason))
            else:
                yield aim, one.condition

    def _earlier(self, conditions: Iterator[Expr]) -> Iterator[Flat]:
        names = {name for condition in conditions for name in read_by(condition) if name.startswith(BEFORE)}
        for name in sorted(names):
            leaf = name.removeprefix(BEFORE)
            now = self.flat.leaf(leaf)
            before = self.flat.new(name, now.type, self.flat.starts[self.flat.name(leaf)])
            yield Put(str(before.name), now)

    def _checks(self, statements: Sequence[tuple[Aim, Expr]]) -> Iterator[Flat]:
        for aim, condition in statements:
            first, holds = self.flat.condition(condition, "stated")
            yield from first
            yield self.aims.check(aim, holds, apart=True)

    # --- what the instance can speak of ---

    def _unfit(self, expr: Expr) -> Iterator[str]:
        """Why not; nothing where it can."""
        match expr:
            case Apply(op=op, type=kind) if isinstance(kind, Real) or op is Op.TO_INT:
                yield "it computes with reals"
            case Apply(op=Op.DIV | Op.MOD):
                yield "it divides"
            case Apply(op=op, args=(one, other)) if op in EQUALITIES and self._next(one, other):
                pass
            case Apply(op=op, args=args):
                if op not in LOGIC and not (op in EQUALITIES and all(isinstance(one, NAMED) for one in args)):
                    yield from self._numbers_in(args)
                for one in args:
                    yield from self._unfit(one)
            case Among(subject=subject):
                yield from self._numbers_in((subject,))
                yield from self._unfit(subject)
            case Select(leaves=leaves, index=index):
                if not _inside(index, len(leaves)):
                    yield "its index may lie outside"
                yield from (why for leaf in leaves for why in self._unfit(Read(leaf, expr.type)))
                yield from self._unfit(index)
            case Read(name=name):
                if self._now(name) in self.computed:
                    yield f"`{name}` is computed of reals"
            case Literal() | ReadLocal():
                pass

    def _next(self, one: Expr, other: Expr) -> bool:
        """Whether the second is the number next to, or before, one that goes round as the first does."""
        match one, other:
            case Read(), Apply(
                op=Op.MOD,
                args=(
                    Apply(op=Op.ADD, args=(Read(name=name), Literal(value=step))),
                    Literal(value=many),
                ),
            ):
                return self._goes_round(name) and many == NUMBERS and step in STEPS
            case _:
                return False

    def _numbers_in(self, args: Sequence[Expr]) -> Iterator[str]:
        """Of numbers that go round can only be asked whether they are the same, or the next."""
        for one in args:
            names = one.leaves if isinstance(one, Select) else (one.name,) if isinstance(one, Read) else ()
            yield from (f"`{name}` goes round" for name in names if self._goes_round(name))

    def _goes_round(self, name: str) -> bool:
        group = self.groups.get(self._now(name))
        return group is not None and group.goes_round(self.numbers)

    def _now(self, name: str) -> str:
        """The leaf, whichever cycle is meant."""
        return self.flat.name(name.removeprefix(BEFORE))


def _inside(index: Expr, size: int) -> bool:
    return isinstance(index.type, Int) and index.type.low >= 0 and index.type.high < size


def computed(flat: Flattener, block: Block) -> frozenset[str]:
    """Names whose values may come, by whatever way, of arithmetic on reals; not truth values, which are any in the instance."""
    found = frozenset(flat.guessed)
    while True:
        wider = found | {
            name
            for name, value in _puts(block)
            if not found.isdisjoint(read_by(value)) and not isinstance(flat.kinds[name], Bool)
        }
        if wider == found:
            return found
        found = wider


def _puts(block: Block) -> Iterator[tuple[str, Expr]]:
    for one in block:
        match one:
            case Put(name=name, value=value):
                yield name, value
            case Fork(arms=arms, otherwise=otherwise):
                for _, body in arms:
                    yield from _puts(body)
                yield from _puts(otherwise)
            case _:
                pass
