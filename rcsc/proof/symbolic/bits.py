"""Nodes of a symbolic run as clauses of propositional logic: the search is done on bits, the confirmation on integers.

In: nodes (`symbolic.values`). Out: literals and clauses, for a SAT solver. What is exact and what is not is said in
`keyed`, with which this agrees: booleans, members and integers exact, reals by their keys, the rest any value within its bounds,
the same for what is built alike.
Numbers are two's complement, lowest bit first, as wide as their bounds need; gates after Tseitin ("On the complexity of
derivation in propositional calculus", 1968), each made once. Values that are only copied and compared for equality get as
many bits as tell them apart (Pnueli, Rodeh, Shtrichman and Siegel, "Deciding equality formulas by small domains
instantiations", 1999), and their ranges are forgotten where they have as many values.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

from rcsc.lang.model import Bool, Enum, Real, Scalar, key_bounds, key_of
from rcsc.lang.operator_table import COMPARISONS, Arithmetic, Conversion, Op, Ordering
from rcsc.proof.symbolic.values import Alike, Node, Shape, parts_first, takes_bits, wraps_once

Literal = int
"""A variable, counted from 1, or its opposite, negative."""
Word = tuple[Literal, ...]
TRUE, FALSE = 1, -1
WIDEST = 66


def known_both(a: Literal, b: Literal) -> Literal | None:
    """Return the literal of *a and b* where it takes no gate."""
    if a in (b, TRUE) or b == FALSE:
        return b
    if b == TRUE or a == FALSE:
        return a
    return FALSE if a == -b else None


@dataclass(slots=True)
class Bits:
    """Makes literals and words; one of these for all the nodes of one question.

    Attributes:
        clauses: What is to be asserted; whoever hands them on empties it.
        count: Variables made.
    """

    clauses: list[list[Literal]] = field(default_factory=lambda: [[TRUE]])
    count: int = 1
    _few: "Mapping[Node, Few]" = field(default_factory=dict)
    _words: dict[Node, Word] = field(default_factory=dict)
    _named: dict[str, Word] = field(default_factory=dict)
    _gates: dict[tuple[str, Literal, Literal], Literal] = field(default_factory=dict)
    _open: dict[int, Word] = field(default_factory=dict)
    _alike: Alike = field(default_factory=Alike)

    @classmethod
    def of(cls, nodes: Sequence[Node]) -> Self:
        """Make one for these nodes alone."""
        return cls(_few=few(nodes))

    def fresh(self) -> Literal:
        """Return a new variable."""
        self.count += 1
        return self.count

    def word(self, node: Node) -> Word:
        """Return the bits of a node: one for a truth value."""
        for part in parts_first(node, known=self._words):
            self._words[part] = self._word_of(part)
        return self._words[node]

    def literal(self, node: Node) -> Literal:
        """Return the literal of a truth value."""
        return self.word(node)[0]

    def met(self, node: Node) -> bool:
        """Return whether anything that was asked for contains the node."""
        return node in self._words

    def equals(self, word: Word, kind: Scalar, key: int) -> Literal:
        """State that a word of the kind has this key."""
        if isinstance(kind, Bool):
            return word[0] if key else -word[0]
        return self._equal(word, constant(key))

    def both(self, a: Literal, b: Literal) -> Literal:
        """Return the literal of *a and b*."""
        if (known := known_both(a, b)) is not None:
            return known
        key = ("and", min(a, b), max(a, b))
        if key not in self._gates:
            self._gates[key] = self._conjunction(*key[1:])
        return self._gates[key]

    def _conjunction(self, a: Literal, b: Literal) -> Literal:
        """Make the gate of *a and b*."""
        gate = self.fresh()
        self.clauses += [[-gate, a], [-gate, b], [gate, -a, -b]]
        return gate

    def all_of(self, literals: Iterable[Literal]) -> Literal:
        """Return the literal of all of them together."""
        conjunction = TRUE
        for literal in literals:
            conjunction = self.both(conjunction, literal)
        return conjunction

    def _same(self, a: Literal, b: Literal) -> Literal:
        if a in (TRUE, FALSE) or b in (TRUE, FALSE):
            known, other = (a, b) if a in (TRUE, FALSE) else (b, a)
            return other if known == TRUE else -other
        if a in (b, -b):
            return TRUE if a == b else FALSE
        sign = (a < 0) != (b < 0)
        a, b = sorted((abs(a), abs(b)))
        key = ("same", a, b)
        if key not in self._gates:
            gate = self._gates[key] = self.fresh()
            self.clauses += [[-gate, -a, b], [-gate, a, -b], [gate, a, b], [gate, -a, -b]]
        return -self._gates[key] if sign else self._gates[key]

    def _mux(self, when: Literal, then: Literal, orelse: Literal) -> Literal:
        if when == TRUE or then == orelse:
            return then
        if when == FALSE:
            return orelse
        if then in (TRUE, FALSE) or orelse in (TRUE, FALSE) or then == -orelse:
            return -self.both(-self.both(when, then), -self.both(-when, orelse))
        if when < 0:
            when, then, orelse = -when, orelse, then
        key = (f"mux {when}", then, orelse)
        if key not in self._gates:
            gate = self._gates[key] = self.fresh()
            self.clauses += [
                [-when, -then, gate],
                [-when, then, -gate],
                [when, -orelse, gate],
                [when, orelse, -gate],
            ]
            self.clauses += [[-then, -orelse, gate], [then, orelse, -gate]]
        return self._gates[key]

    # --- words ---

    def _equal(self, a: Word, b: Word) -> Literal:
        return self.all_of(self._same(x, y) for x, y in _aligned(a, b))

    def _below(self, a: Word, b: Word) -> Literal:
        pairs = list(_aligned(a, b))
        less = FALSE
        for x, y in pairs[:-1]:
            less = self._mux(self._same(x, y), less, y)
        x, y = pairs[-1]  # of the sign, the greater is the less
        return self._mux(self._same(x, y), less, x)

    def _sum(self, a: Word, b: Word, carry: Literal) -> Word:
        bits = []
        for x, y in _aligned((*a, a[-1]), (*b, b[-1])):
            half = -self._same(x, y)
            bits.append(-self._same(half, carry))
            carry = self._mux(half, carry, x)
        return tuple(bits)

    def _choice(self, when: Literal, then: Word, orelse: Word) -> Word:
        return tuple(self._mux(when, x, y) for x, y in _aligned(then, orelse))

    def _difference(self, a: Word, b: Word) -> Word:
        return self._sum(a, tuple(-x for x in b), TRUE)

    def _opposite(self, a: Word) -> Word:
        return self._difference((FALSE,), a)

    def _product(self, a: Word, factor: int) -> Word:
        product: Word = (FALSE,)
        for at in range(abs(factor).bit_length()):
            if abs(factor) >> at & 1:
                product = self._sum(product, (*(FALSE,) * at, *a), FALSE)
        return self._opposite(product) if factor < 0 else product

    # --- nodes ---

    def _word_of(self, node: Node) -> Word:
        parts = [self._words[part] for part in node.args]
        if node in self._few and node.op not in (Shape.CHOICE, Shape.NARROWED):
            return self._one_of_few(node, self._few[node])
        match node.op:
            case Shape.CONSTANT:
                return _constant(node.kind, node.low)
            case Shape.VARIABLE:
                return self._variable(node.name, node.kind)
            case Shape.CHOICE:
                return self._choice(parts[0][0], parts[1], parts[2])
            case Shape.NARROWED:
                return parts[0]
            case Op.NOT:
                return (-parts[0][0],)
            case Op.AND:
                return (self.all_of(part[0] for part in parts),)
            case _ if not all(arg.ordered for arg in node.args):
                return self._any(node)
            case Op.EQ | Op.LT | Op.LE as op:
                return (self._compared(op, node, parts),)
            case op:
                return self._number(op, node, parts)

    def _one_of_few(self, node: Node, shared: "Few") -> Word:
        if node.op is Shape.CONSTANT:
            return tuple(
                TRUE if shared.constants[node.low] >> at & 1 else FALSE for at in range(shared.width)
            )
        if node.op is not Shape.VARIABLE:
            return tuple(self.fresh() for _ in range(shared.width))
        if node.name not in self._named:
            self._named[node.name] = tuple(self.fresh() for _ in range(shared.width))
        return self._named[node.name]

    def _variable(self, name: str, kind: Scalar) -> Word:
        if name not in self._named:
            self._named[name] = (self.fresh(),) if isinstance(kind, Bool) else self._within(*key_bounds(kind))
        return self._named[name]

    def _within(self, low: int, high: int) -> Word:
        """Return a word of any value from `low` to `high`."""
        signed = low < 0
        width = max(low.bit_length(), (-low - 1).bit_length() if signed else 0, high.bit_length())
        word = tuple(self.fresh() for _ in range(width)) + ((self.fresh(),) if signed else (FALSE,))
        self.clauses.append([-self._below(word, constant(low))])
        self.clauses.append([-self._below(constant(high), word)])
        return word

    def _compared(self, op: Ordering, node: Node, parts: list[Word]) -> Literal:
        if isinstance(node.args[0].kind, Bool):
            parts = [(*part, FALSE) for part in parts]
        match op:
            case Op.EQ:
                return self._equal(*parts)
            case Op.LT:
                return self._below(*parts)
            case Op.LE:
                return -self._below(parts[1], parts[0])

    def _number(self, op: Arithmetic | Conversion, node: Node, parts: list[Word]) -> Word:
        a, b, left, right = parts[0], parts[-1], node.args[0], node.args[-1]
        match op:
            case Op.NEG:
                return self._opposite(a)
            case Op.ABS:
                return self._choice(a[-1], self._opposite(a), a)
            case Op.MIN:
                return self._choice(-self._below(b, a), a, b)
            case Op.MAX:
                return self._choice(self._below(b, a), a, b)
            case _ if isinstance(left.kind, Real) or isinstance(node.kind, Real):
                return self._any(node)
            case Op.ADD:
                return self._sum(a, b, FALSE)
            case Op.SUB:
                return self._difference(a, b)
            case Op.MUL if left.known or right.known:
                return self._product(b, int(left.low)) if left.known else self._product(a, int(right.low))
            case _ if wraps_once(node):
                return self._choice(self._below(a, b), a, self._difference(a, b))
            case Op.DIV if takes_bits(node):
                return a[int(right.low).bit_length() - 1 :] or (FALSE,)
            case _ if takes_bits(node):
                return (*a[: int(right.low).bit_length() - 1], FALSE)
            case _:
                return self._any(node)

    def _any(self, node: Node) -> Word:
        """Return any value within the bounds of the node; the same for nodes built alike."""
        number = self._alike.number(node)
        if number not in self._open:
            self._open[number] = self._anything(node)
        return self._open[number]

    def _anything(self, node: Node) -> Word:
        if isinstance(node.kind, Bool):
            return (self.fresh(),)
        if not (math.isfinite(node.low) and math.isfinite(node.high)):
            return tuple(self.fresh() for _ in range(WIDEST))
        return self._within(key_of(node.kind, node.low), key_of(node.kind, node.high))


def constant(key: int) -> Word:
    """Return a number as a word."""
    return tuple(TRUE if key >> at & 1 else FALSE for at in range(key.bit_length() + 1))


def _constant(kind: Scalar, value: int | float) -> Word:
    if isinstance(kind, Bool):
        return (TRUE if value else FALSE,)
    return constant(key_of(kind, value))


def _aligned(a: Word, b: Word) -> Iterable[tuple[Literal, Literal]]:
    """Bit by bit, the shorter one with its sign repeated."""
    width = max(len(a), len(b))
    return zip((*a, *(a[-1],) * (width - len(a))), (*b, *(b[-1],) * (width - len(b))), strict=True)


def key_of_bits(word: Sequence[bool]) -> int:
    """Return the number that a word stands for."""
    size = sum(1 << at for at, bit in enumerate(word[:-1]) if bit)
    return size - (1 << (len(word) - 1)) if word[-1] else size


# --- values that are only copied and compared ---


@dataclass(frozen=True, slots=True)
class Few:
    """What the nodes of one class share: bits that tell all its values apart, and numbers for its constants."""

    width: int
    constants: Mapping[int | float, int]


def few(nodes: Sequence[Node]) -> dict[Node, Few]:
    """Return the numbers in these nodes that are only copied and compared for equality, each with its class."""
    every = [node for node in parts_first(*nodes) if not isinstance(node.kind, Bool | Enum)]
    classes = _Classes()
    calculated = _joined(parts_first(*nodes), classes)
    spoilt = {classes.of(node) for node in calculated}
    members: dict[Node, list[Node]] = {}
    for node in every:
        if classes.of(node) not in spoilt:
            members.setdefault(classes.of(node), []).append(node)
    encodings: dict[Node, Few] = {}
    for member in members.values():
        values = dict.fromkeys(node.low for node in member if node.op is Shape.CONSTANT)
        names = {node.name for node in member if node.op is Shape.VARIABLE}
        others = sum(not isinstance(node.op, Shape) for node in member)
        wanted = len(values) + len(names) + others
        if any(node.op is Shape.VARIABLE and _room(node) < wanted for node in member):
            continue  # its range tells more than that values differ: it is one of 0, 1 and 2, and not a fourth
        width = max(1, (wanted - 1).bit_length())
        shared = Few(width, {value: at for at, value in enumerate(values)})
        encodings |= dict.fromkeys(member, shared)
    return encodings


def _room(node: Node) -> int:
    """Return how many values a variable has."""
    low, high = key_bounds(node.kind)
    return high - low + 1


@dataclass(slots=True)
class _Classes:
    """Disjoint sets of nodes."""

    _up: dict[Node, Node] = field(default_factory=dict)

    def of(self, node: Node) -> Node:
        """Return the one that stands for its set."""
        while (up := self._up.get(node, node)) is not node:
            self._up[node] = self._up.get(up, up)
            node = up
        return node

    def join(self, left: Node, right: Node) -> None:
        self._up[self.of(left)] = self.of(right)


def _joined(nodes: Iterable[Node], classes: _Classes) -> set[Node]:
    """Joins what is copied or compared; returns what is calculated with, or ordered."""
    calculated: set[Node] = set()
    named: dict[str, Node] = {}
    for node in nodes:
        match node.op:
            case Shape.CHOICE:
                classes.join(node, node.args[1])
                classes.join(node, node.args[2])
            case Shape.NARROWED:
                classes.join(node, node.args[0])
            case Shape.VARIABLE:
                classes.join(node, named.setdefault(node.name, node))
            case Op.EQ if all(arg.ordered for arg in node.args):
                classes.join(*node.args)
            case Shape.CONSTANT | Op.NOT | Op.AND:
                pass
            case _:
                calculated |= _calculated(node)
    return calculated


def _calculated(node: Node) -> set[Node]:
    """Return the node and its parts, where its value depends on theirs here (see `Bits._number`)."""
    real = isinstance(node.args[0].kind, Real) or isinstance(node.kind, Real)
    if real and node.op not in (*COMPARISONS, Op.NEG, Op.ABS, Op.MIN, Op.MAX):
        return set()
    return {node, *node.args}
