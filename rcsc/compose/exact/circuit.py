"""A level as a circuit of single bits: the exact transition system that every engine of this room answers questions about.

In: a transition system and its obligations. Out: a `Circuit`. It has the leaves in the cone of the obligations as latches, each the bits
of a leaf's key (`model.key_of`), an input for each bit that the environment gives, and three frames: the first cycle, the first after a
restart, and any later one. A frame tells whether its environment keeps to the contract (every range included), whether the cycle goes on,
whether each obligation holds, and each latch after it. A run is a first frame and later ones, as long as each is `valid` and `goes_on`.

What is exact: truth values, members of enumerations, integers with all their arithmetic, order and equality of reals. Arithmetic of reals
is left open, as in `keyed`: any value within its bounds; which operations those are is told by name. Whatever the executors do is a
run of the circuit; where nothing is open, the other way round, too.

Gates are conjunctions of two literals, each made once (Kuehlmann, Paruthi, Krohm and Ganai, "Robust boolean reasoning for equivalence
checking and functional property verification", 2002).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from rcsc.compose.contract.obligations import Obligation, ObligationKey, Sort, obligations, pairs
from rcsc.compose.contract.predicates import cone
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.lang.model import Bool, Real, Scalar, key_bounds, key_of
from rcsc.lang.operator_table import Arithmetic, Conversion, Op
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.bits import FALSE, TRUE, Bits, Literal, Word
from rcsc.proof.symbolic.values import Node, Shape, parts_first, takes_bits, wraps_once

FEW = 64
"""A variable with at most so many values has all of them as points."""
EARLY = frozenset({Sort.ASSUMPTION, Sort.ONE_LINE, Sort.SOME_LINE, Sort.NO_DEFAULT})
"""Obligations that a cycle can break that then ends in a fault."""
Gate: TypeAlias = tuple[Literal, Literal]
"""Two literals, both of which hold."""


@dataclass(slots=True)
class Gates(Bits):
    """Makes literals of conjunctions alone, and integer arithmetic exact.

    Attributes:
        ands: The gate of each variable that is one, in the order in which they were made: parts first.
        opened: The operations that were left open.
    """

    ands: dict[Literal, Gate] = field(default_factory=dict)
    opened: dict[str, None] = field(default_factory=dict)

    @property
    def named(self) -> Mapping[str, Word]:
        """The bits of each variable by its name, of those that were read."""
        return self._named

    def taken_constraint(self) -> Literal:
        """Return the condition that every variable made since the last call is in its range."""
        units = [clause[0] for clause in self.clauses if clause != [TRUE]]
        self.clauses.clear()
        return self.all_of(units)

    def _conjunction(self, a: Literal, b: Literal) -> Literal:
        gate = self.fresh()
        self.ands[gate] = (a, b)
        return gate

    def _same(self, a: Literal, b: Literal) -> Literal:
        if a in (TRUE, FALSE) or b in (TRUE, FALSE):
            known, other = (a, b) if a in (TRUE, FALSE) else (b, a)
            return other if known == TRUE else -other
        if a in (b, -b):
            return TRUE if a == b else FALSE
        return self.both(-self.both(a, -b), -self.both(-a, b))

    def _mux(self, when: Literal, then: Literal, orelse: Literal) -> Literal:
        if when == TRUE or then == orelse:
            return then
        if when == FALSE:
            return orelse
        return -self.both(-self.both(when, then), -self.both(-when, orelse))

    def _number(self, op: Arithmetic | Conversion, node: Node, parts: list[Word]) -> Word:
        """Return arithmetic; of integers also products, quotients and remainders of two variables."""
        left, right = node.args[0], node.args[-1]
        if any(isinstance(kind, Real) for kind in (left.kind, node.kind)):
            return super(Gates, self)._number(op, node, parts)
        if op is Op.MUL and not (left.known or right.known):
            return self._times(*parts)
        if op in (Op.DIV, Op.MOD) and not (wraps_once(node) or takes_bits(node)):
            return self._divided(*parts)[op is Op.MOD]
        return super(Gates, self)._number(op, node, parts)

    def _times(self, a: Word, b: Word) -> Word:
        """Return the product: a shifted sum for each bit of *b*, of which that of the sign is taken off."""
        product: Word = (FALSE,)
        for at, bit in enumerate(b[:-1]):
            product = self._sum(product, (*(FALSE,) * at, *(self.both(bit, x) for x in a)), FALSE)
        negative = (*(FALSE,) * (len(b) - 1), *(self.both(b[-1], x) for x in a))
        return self._difference(product, negative)

    def _divided(self, a: Word, b: Word) -> tuple[Word, Word]:
        """Return quotient and remainder, rounded toward zero, by restoring division; of a division by zero, which is never done, any."""
        size, by = (self._choice(word[-1], self._opposite(word), word) for word in (a, b))
        rest: Word = (FALSE,)
        quotient: list[Literal] = []
        for bit in reversed(size):
            rest = (bit, *rest)
            fits = -self._below(rest, by)
            rest = self._choice(fits, self._difference(rest, by), rest)[: len(by) + 1]
            quotient.insert(0, fits)
        result = (*quotient, FALSE)
        return (
            self._choice(-self._same(a[-1], b[-1]), self._opposite(result), result),
            self._choice(a[-1], self._opposite(rest), rest),
        )

    def _any(self, node: Node) -> Word:
        """Return any value within the bounds of the node, and note its operation."""
        kinds = ", ".join(dict.fromkeys(type(arg.kind).__name__.lower() for arg in node.args))
        self.opened.setdefault(f"`{node.op}` of {kinds}")
        return super(Gates, self)._any(node)


@dataclass(frozen=True, slots=True)
class Given:
    """A variable that the environment gives.

    Attributes:
        word: Its bits.
        points: Keys such that every value does as one of these does; empty if its values are told apart in other ways than by constants.
    """

    word: Word
    points: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Frame:
    """One cycle of a circuit.

    Attributes:
        cycle: The cycle that it stands for.
        valid: The literal that the environment keeps to the contract, and every variable to its range.
        goes_on: That the cycle ends in no fault that the proofs exclude.
        holds: Of each obligation, that it holds.
        after: Each latch after the cycle.
    """

    cycle: Cycle = field(repr=False, compare=False)
    valid: Literal
    goes_on: Literal
    holds: tuple[Literal, ...]
    after: tuple[Literal, ...]

    @property
    def outputs(self) -> tuple[Literal, ...]:
        """Every literal that a run reads."""
        return self.valid, self.goes_on, *self.holds, *self.after


@dataclass(frozen=True, slots=True)
class Circuit:
    """A level as gates.

    Attributes:
        wanted: The obligations, by key.
        leaves: The leaves in the cone, in declared order; `kinds`, their types, and `words`, their bits before a later cycle.
        latches: The variables of these bits.
        firsts: The first cycle, and the first after a restart; `step`, any later one.
        ands: The gates, parts first.
        count: Variables in all; those that are neither gates nor latches are inputs.
        given: The variables that the environment gives, by name.
        opened: The operations that were left open.
        numbers: Leaves of which it does not matter if all are later by as much (`shifted`), if that was asked.
    """

    wanted: tuple[ObligationKey, ...]
    leaves: tuple[str, ...]
    kinds: tuple[Scalar, ...]
    words: tuple[Word, ...]
    latches: tuple[Literal, ...]
    firsts: tuple[Frame, ...]
    step: Frame
    ands: Mapping[Literal, Gate] = field(repr=False)
    count: int
    given: Mapping[str, Given] = field(repr=False)
    opened: tuple[str, ...] = ()
    numbers: frozenset[str] = frozenset()

    def needed(self, literals: Iterable[Literal]) -> frozenset[Literal]:
        """Return the variables on which these literals depend, gates included."""
        seen: set[Literal] = set()
        waiting = [abs(literal) for literal in literals]
        while waiting:
            variable = waiting.pop()
            if variable not in seen and variable != TRUE:
                seen.add(variable)
                waiting += map(abs, self.ands.get(variable, ()))
        return frozenset(seen)

    def inputs(self, needed: Iterable[Literal]) -> list[Literal]:
        """Return those of the variables that the environment gives, in order."""
        latches = frozenset(self.latches)
        return sorted(one for one in needed if one not in self.ands and one not in latches)

    def key(self, at: int, bits: Mapping[Literal, bool]) -> int:
        """Return the key of a leaf, by position, of the values of latches."""
        return key_of_word(self.kinds[at], self.words[at], bits)


def key_of_word(kind: Scalar, word: Word, bits: Mapping[Literal, bool]) -> int:
    """Return the key that a word has where variables have these values; one that has none is false."""
    read = [bits.get(abs(literal), abs(literal) == TRUE) == (literal > 0) for literal in word]
    if isinstance(kind, Bool):
        return int(read[0])
    size = sum(1 << at for at, bit in enumerate(read[:-1]) if bit)
    return size - (1 << (len(read) - 1)) if read[-1] else size


def circuit(
    ts: TransitionSystem,
    firsts: Sequence[Cycle],
    step: Cycle,
    wanted: Sequence[Obligation],
) -> Circuit:
    """Make the circuit of a level for some of its obligations.

    Args:
        ts: The level.
        firsts: The cycles with which it begins, of which no leaf before them is arbitrary.
        step: A cycle from any state.
        wanted: The obligations, of `step`.
    """
    keys, in_pairs = tuple(owed.key for owed in wanted), any(owed.lines for owed in wanted)
    leaves, read = roots_of(step, wanted)
    gates = Gates()
    words = tuple(gates.word(step.before[name]) for name in leaves)
    later = _frame(gates, step, leaves, words, [owed.holds for owed in wanted])
    begun = []
    for first in firsts:
        owed = {one.key: one.holds for one in (*obligations(ts, first), *(pairs(first) if in_pairs else ()))}
        holds = [owed[key] for key in keys]
        begun.append(_frame(gates, first, leaves, words, holds))
        read += [first.contract, first.goes_on, *holds, *(first.after[name] for name in leaves)]
    return Circuit(
        keys,
        leaves,
        tuple(step.before[name].kind for name in leaves),
        words,
        tuple(abs(bit) for word in words for bit in word if abs(bit) != TRUE),
        tuple(begun),
        later,
        gates.ands,
        gates.count,
        dict(_given(gates, read, frozenset(leaves))),
        tuple(gates.opened),
    )


def _frame(
    gates: Gates, cycle: Cycle, leaves: Sequence[str], words: Sequence[Word], holds: Sequence[Node]
) -> Frame:
    """Make one cycle; the bits of each leaf after it stand where its latches do."""
    contract, goes_on = gates.literal(cycle.contract), gates.literal(cycle.goes_on)
    kept = tuple(map(gates.literal, holds))
    after: list[Literal] = []
    for name, word in zip(leaves, words, strict=True):
        end = gates.word(cycle.after[name])
        wide = (
            *end,
            *(end[-1],) * (len(word) - len(end)),
        )  # what is wider repeats its sign: it is in the range of the leaf
        after += [bit for latch, bit in zip(word, wide, strict=False) if abs(latch) != TRUE]
    return Frame(cycle, gates.both(contract, gates.taken_constraint()), goes_on, kept, tuple(after))


def _given(gates: Gates, read: Sequence[Node], leaves: frozenset[str]) -> Iterator[tuple[str, Given]]:
    """Yield each variable that is no leaf, with the points that tell its values apart."""
    points = points_of(read)
    for name, word in gates.named.items():
        if name not in leaves:
            yield name, Given(word, points[name])


def points_of(read: Sequence[Node]) -> dict[str, tuple[int, ...]]:
    """Return for each variable keys such that every value does as one of these does; none where they are too many."""
    compared: dict[str, set[int]] = {}
    otherwise = {root.name for root in map(values.root, read) if root.op is Shape.VARIABLE}
    kinds: dict[str, Scalar] = {}
    for node in parts_first(*read):
        if node.op is Shape.VARIABLE:
            kinds[node.name] = node.kind
        for at, arg in enumerate(node.args):
            variable = values.root(arg)
            if variable.op is not Shape.VARIABLE or node.op is Shape.NARROWED:
                continue
            other = node.args[1 - at] if len(node.args) == 2 else node  # of a comparison
            if node.op in (Op.EQ, Op.LT, Op.LE) and other.known and arg.ordered:
                compared.setdefault(variable.name, set()).add(key_of(variable.kind, other.low))
            else:
                otherwise.add(variable.name)
    return {
        name: _points(kind, compared.get(name, set()), among=name not in otherwise)
        for name, kind in kinds.items()
    }


def _points(kind: Scalar, compared: set[int], *, among: bool) -> tuple[int, ...]:
    low, high = key_bounds(kind)
    if among or isinstance(kind, Bool):
        # between two constants, and beyond the last, one value stands for all
        points = {0, 1} if isinstance(kind, Bool) else {low, *compared, *(key + 1 for key in compared)}
        return tuple(sorted(key for key in points if low <= key <= high))
    return tuple(range(low, high + 1)) if high - low < FEW else ()


def roots_of(step: Cycle, wanted: Sequence[Obligation]) -> tuple[tuple[str, ...], list[Node]]:
    """Return the leaves in the cone of obligations, in declared order, and all that a circuit of a later cycle reads."""
    roots = [step.contract, step.goes_on, *(owed.holds for owed in wanted)]
    inside = cone(step, roots)
    leaves = tuple(name for name in step.before if name in inside)
    return leaves, [*roots, *(step.after[name] for name in leaves)]
