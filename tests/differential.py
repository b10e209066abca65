"""Whole cycles of drawn programs: an evaluator of its own, the interpreter, the Python and the C executor agree.

`python -m tests.differential --count 100000 --seed 1` for a long run; `tests/emit/test_fuzz.py` makes a short one in the suite.

A program is drawn as pairs of a text and a function: what stands in the table's language, and what it means, written down here a
second time from the manual, without anything of rcsc's. Programs are safe by construction, so that they need no proof: values are
pulled into their ranges, divisors are not zero, indices are taken modulo the length. Tables may have gaps and overlaps, stand several
in a cycle, and have lines above others, or that do the same; conditions look back (`was`, events, `for`), and at bits and named sets;
locals have the names of constants, sets and members. The C of many programs is one shared library. tcc compiles most of them, in a
fiftieth of the time that gcc takes.
"""

import argparse
import ctypes
import gc
import json
import math
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType
from typing import Any

from rcsc.code.emit import emitted
from rcsc.code.emit.lower import lower
from rcsc.lang.interpret import cycle, initial
from rcsc.lang.model import AssumptionName, Program, ProvedProgram, seal_of_proof
from rcsc.lang.resolve import compile_text

I64, U64 = 2**63 - 1, 2**64 - 1
BATCH = 50
CYCLES = 10
LONGEST_CPU_S = 20.0
"""Of the cycles of one program, which take some hundredths."""
FLAGS = ("-std=c99", "-w", "-fPIC", "-shared")
ROUND = 50
BUILDS: Mapping[int, tuple[str, ...]] = {
    0: ("cc", "-O0"),
    17: ("gcc", "-O2", "-march=native"),
    34: ("clang", "-O2", "-march=native"),
}
"""Compilers and their options, by the number of a batch in each round of `ROUND`."""
TINY = ("tcc",)
"""The compiler of the other batches; where it stands alone with a difference, the first of `BUILDS` judges."""

Value = bool | int | float
State = dict[str, Any]
Locals = dict[str, Value]
Meaning = Callable[[State, Locals], Any]
Doing = Callable[[State, Locals], None]


REALS, IN_C = ("real", "single"), ("double", "float")


def to_single(value: int | float) -> float:
    """The nearest number of 24 binary digits, ties to even: a double by the machine, a whole number by its digits."""
    if isinstance(value, float):
        return ctypes.c_float(value).value
    size = max(abs(value).bit_length() - 24, 0)
    digits, rest = divmod(abs(value), 2**size)
    digits += 2 * rest > 2**size or (2 * rest == 2**size and digits % 2 == 1)
    return math.copysign(float(digits * 2**size), value)


PAST, LASTED = "@past", "@held"
"""Keys of a state beside its leaves: the leaves after the cycle before, and for how many cycles each condition has held."""


def kept_line(table: str) -> str:
    """The key of the line that a table which others follow ran in this cycle: 0 for none, else one more than its position."""
    return f"@line {table}"


ROUNDED: dict[str, Callable[[float], float]] = {"real": float, "single": to_single}
"""What becomes of the exact result, or the double nearest to it, of an operation of this sort."""


@dataclass(frozen=True)
class Kind:
    """A scalar type: `bool`, `enum`, `int`, `real` or `single`, its text, its bounds (of an enumeration: of the index)."""

    sort: str
    text: str
    low: float = 0
    high: float = 1
    members: tuple[str, ...] = ()

    def zero(self) -> Value:
        """What it starts with where nothing is said: 0, or what is nearest to it."""
        if self.sort == "bool":
            return False
        nearest = self.low if self.low > 0 else min(self.high, 0)
        return float(nearest) if self.sort in REALS else int(nearest)

    def literal(self, value: Value) -> str:
        if self.sort == "bool":
            return "true" if value else "false"
        if self.sort == "enum":
            return f"{self.text}.{self.members[int(value)]}"
        text = repr(float(value)) if self.sort in REALS else str(int(value))
        if self.sort == "single":  # what is computed of numbers written is a double until it meets a single
            return f"single({text})"
        return f"({text})" if text.startswith("-") else text


BOOL = Kind("bool", "bool")


@dataclass(frozen=True)
class Expr:
    """An expression: its text, what it gives, and bounds of it (integers)."""

    kind: Kind
    text: str
    of: Meaning
    low: int = 0
    high: int = 0


@dataclass(frozen=True)
class Leaf:
    """A scalar variable; `many` are the elements that a computed index chooses from, where it is one of them."""

    name: str
    kind: Kind


@dataclass(frozen=True)
class Elements:
    """Leaves that differ in one index: `before[i]after`."""

    before: str
    after: str
    length: int
    kind: Kind


@dataclass(frozen=True)
class NamedSet:
    """A declared set: whether a value is of it, some that are, and whether masks are among its members: of words of eight bits."""

    name: str
    kind: Kind
    has: Callable[[Any], bool]
    some: tuple[Value, ...]
    masks: bool = False


@dataclass(frozen=True)
class Declared:
    """A variable: `input`, `state` or `output`, clamped or not, its initial and safe values (scalars), the condition of its deferral."""

    name: str
    word: str
    leaves: tuple[Leaf, ...]
    clamp: bool = False
    start: Value | None = None
    until: Expr | None = None
    safe: Value | None = None


@dataclass(frozen=True)
class Line:
    """A line: its conditions and what it does; which lines, by position, run in its place where both match."""

    when: tuple[Expr, ...]
    does: tuple[Doing, ...]
    upper: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Table:
    """A table: its lines; the actions of DEFAULT, where there is one; the assumptions that it names."""

    name: str
    lines: tuple[Line, ...]
    default: tuple[Doing, ...] | None
    assuming: tuple[str, ...]
    stops: tuple[str, ...]


Stage = tuple[Leaf | None, tuple[int, ...]]
"""What a level runs at one place of its cycle: one table, or the one that an input chooses; by position."""


@dataclass
class Drawn:
    """A drawn program and its meaning."""

    text: list[str] = field(default_factory=list)
    declared: list[Declared] = field(default_factory=list)
    elements: list[tuple[str, Elements]] = field(default_factory=list)
    procedures: list[tuple[str, tuple[Kind, ...], Callable[[State, list[Value]], None]]] = field(
        default_factory=list
    )
    assumptions: list[tuple[str, Expr]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    before: list[int] = field(default_factory=list)
    after: list[int] = field(default_factory=list)
    stages: list["Stage"] = field(default_factory=list)
    constants: list[tuple[str, Kind, Value]] = field(default_factory=list)
    sets: list[NamedSet] = field(default_factory=list)
    lasting: list[Expr] = field(default_factory=list)

    @property
    def staged(self) -> list[str]:
        """Tables that others follow."""
        return [self.tables[number].name for _, numbers in self.stages[:-1] for number in numbers]

    def leaves(self, *words: str) -> list[Leaf]:
        """The leaves of variables of these words; of all without one."""
        return [leaf for one in self.declared if not words or one.word in words for leaf in one.leaves]


# --- what operators mean -----------------------------------------------------------------------


def quotient(a: int, b: int) -> int:
    """Toward zero."""
    return abs(a) // abs(b) * (1 if (a >= 0) == (b >= 0) else -1)


def remainder(a: int, b: int) -> int:
    """With the sign of the dividend."""
    return abs(a) % abs(b) * (1 if a >= 0 else -1)


def least(a: Any, b: Any) -> Any:
    """The second where it is less."""
    return b if b < a else a  # noqa: FURB136  # it is what is meant


def most(a: Any, b: Any) -> Any:
    """The second where it is greater."""
    return b if b > a else a  # noqa: FURB136


def kept(value: Value) -> Value:
    """What is stored: 0.0 for -0.0."""
    return 0.0 if isinstance(value, float) and value == 0.0 else value


def fits(*bounds: tuple[float, float]) -> bool:
    """Whether one type of 64 bits holds everything in these bounds."""
    low, high = min(a for a, _ in bounds), max(b for _, b in bounds)
    return (low >= -I64 - 1 and high <= I64) or (low >= 0 and high <= U64)


COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "=": lambda a, b: a == b,
    "/=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}


COMPUTE: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
}
JOIN: dict[str, Callable[[bool, bool], bool]] = {
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "implies": lambda a, b: b or not a,
    "xor": lambda a, b: (a and not b) or (b and not a),
}


class Maker:
    """Draws one program.

    Args:
        rng: Where all choices come from.
        words: Gives the names, each another; without it they are a letter and a number.
        members: How many members an enumeration may have.
    """

    def __init__(
        self,
        rng: random.Random,
        words: Callable[[], str] | None = None,
        members: Sequence[int] = (1, 2, 3, 4, 5),
    ) -> None:
        self.rng = rng
        self.words = words
        self.members = members
        self.made = Drawn()
        self.locals: list[tuple[str, Kind, bool]] = []
        self.number = 0
        self.back = False  # whether `was`, events and `for` may stand here
        self.hidden: frozenset[str] = frozenset()  # variables that may not be read here
        self.targets: frozenset[str] | None = None  # those that alone may be written here
        self.callable: list[int] | None = None  # procedures that alone may be called here
        self.bodies: dict[str, str] = {}

    def name(self, head: str) -> str:
        self.number += 1
        return self.words() if self.words else f"{head}{self.number}"

    def local_name(self, head: str) -> str:
        """A name of a local: its own, or that of a constant, a set or a member, which it hides."""
        others = [*(one[0] for one in self.made.constants * 3), *(one.name for one in self.made.sets)]
        others += [member for enum in self.enums for member in enum.members]
        free = [name for name in others if all(name != one for one, _, _ in self.locals)]
        return self.rng.choice(free) if free and self.rng.randrange(4) == 0 else self.name(head)

    def visible(self, name: str) -> bool:
        """Whether no local hides a constant or a set of this name."""
        return all(name != one for one, _, _ in self.locals)

    def speaks(self, text: str) -> bool:
        """Whether a text is about a variable."""
        return not {one.name for one in self.made.declared}.isdisjoint(WORDS.findall(text))

    def readable(self, *words: str) -> list[Leaf]:
        """Leaves that may be read here."""
        return [leaf for leaf in self.made.leaves(*words) if root(leaf.name) not in self.hidden]

    def writable(self) -> list[Leaf]:
        """Leaves that may be written here."""
        leaves = self.made.leaves("state", "output")
        return (
            leaves if self.targets is None else [leaf for leaf in leaves if root(leaf.name) in self.targets]
        )

    # --- types ---

    def kind(self) -> Kind:
        """A scalar type that leans on ends."""
        rng = self.rng
        sort = rng.choice(("bool", "enum", "int", "int", "int", "real", "real", "single"))
        if sort == "bool":
            return BOOL
        if sort == "enum":
            return rng.choice(self.enums)
        if sort == "int":
            ends = ((0, 9), (-5, 95), (7, 7), (0, 255), (0, 255), (0, 256), (-128, 127), (-129, 0), (-70000, 3), (0, 2**32),
                    (-I64 - 1, I64), (0, U64), (I64 - 3, I64 + 3), (-I64 - 1, -I64 + 5), (U64 - 4, U64), (-3, -1))  # fmt: skip
            low, high = rng.choice(ends) if rng.randrange(3) else (rng.randint(-9, 3), rng.randint(3, 99))
            return Kind("int", f"int {low} .. {high}", low, high)
        reals = (
            (-1.5, 2.5), (0.0, 1.0), (0.0, 1e308), (-1e308, 1e308), (1e-310, 3.0), (-4.0, -0.25), (0.0, 0.0),
            (-1e-320, 1e-320),
        )  # fmt: skip
        a, b = rng.choice(reals)
        if sort == "single":
            a, b = (
                to_single(math.copysign(min(abs(x), 1e38), x) if abs(x) > 1e-300 else x * 1e276)
                for x in (a, b)
            )
        return Kind(sort, f"{sort} {a!r} .. {b!r}", a, b)

    def value(self, kind: Kind) -> Value:
        """A value of a type, an end of it more often than not."""
        rng = self.rng
        if kind.sort == "bool":
            return rng.random() < 0.5
        if kind.sort in REALS:
            known = (0.0, 1.0, -1.0, 0.1, 0.3, 5e-324, 1e300, 1e-44, 1e30)
            inside = [x for x in map(ROUNDED[kind.sort], known) if kind.low <= x <= kind.high]
            middle = kind.low / 2 + kind.high / 2
            value = rng.choice((kind.low, kind.high, middle, rng.uniform(middle / 2, middle), *inside))
            return ROUNDED[kind.sort](float(value))
        low, high = int(kind.low), int(kind.high)
        return rng.choice((low, high, min(low + 1, high), max(high - 1, low), rng.randint(low, high)))

    def declare(self, word: str) -> None:
        """A variable: a scalar, an array, a record, an array of records."""
        rng, name = self.rng, self.name("v")
        shape = rng.randrange(8)
        if shape > 2 or word == "output":
            kind = self.kind()
            start = self.value(kind) if rng.randrange(2) else None
            clamp = word == "input" and kind.sort not in {"bool", "enum"} and rng.randrange(2) == 0
            text = f"{word} {name} : {kind.text}" + ("" if start is None else f" = {kind.literal(start)}")
            safe = self.value(kind) if word == "output" and rng.randrange(3) == 0 else None
            text += "" if safe is None else f" safe {kind.literal(safe)}"
            self.made.text.append(text + (" clamp" if clamp else ""))
            self.made.declared.append(Declared(name, word, (Leaf(name, kind),), clamp, start, safe=safe))
            return
        kind, length = self.kind(), rng.randint(1, 4)
        if shape == 0:
            self.made.text.append(f"{word} {name} : array[{length}] of {kind.text}")
            self._elements(word, name, "", length, kind)
            return
        record, other = self.name("r"), self.kind()
        a, b = self.name("f"), self.name("f")
        if shape == 1:
            self.made.text.append(
                f"record {record} {{ {a} : {kind.text}  {b} : array[{length}] of {other.text} }}"
            )
            self.made.text.append(f"{word} {name} : {record}")
            leaves = (Leaf(f"{name}.{a}", kind), *(Leaf(f"{name}.{b}[{at}]", other) for at in range(length)))
            self.made.elements.append((word, Elements(f"{name}.{b}", "", length, other)))
        else:
            outer = self.name("r")
            self.made.text.append(f"record {record} {{ {a} : {kind.text}  {b} : {other.text} }}")
            self.made.text.append(f"record {outer} {{ {b} : {record} }}")
            self.made.text.append(f"{word} {name} : array[{length}] of {outer}")
            pairs = ((f"{name}[{at}].{b}.{a}", f"{name}[{at}].{b}.{b}") for at in range(length))
            leaves = tuple(leaf for one, two in pairs for leaf in (Leaf(one, kind), Leaf(two, other)))
            for part, inner in ((a, kind), (b, other)):
                self.made.elements.append((word, Elements(name, f".{b}.{part}", length, inner)))
        self.made.declared.append(Declared(name, word, leaves))

    def _elements(self, word: str, before: str, after: str, length: int, kind: Kind) -> None:
        leaves = tuple(Leaf(f"{before}[{at}]{after}", kind) for at in range(length))
        self.made.declared.append(Declared(before, word, leaves))
        self.made.elements.append((word, Elements(before, after, length, kind)))

    # --- expressions ---

    def literal(self, kind: Kind) -> Expr:
        """A constant, by its name now and then."""
        named = [
            (name, value)
            for name, one, value in self.made.constants
            if alike(one, kind) and kind.sort != "single" and self.visible(name)
        ]
        if named and self.rng.randrange(3) == 0:
            name, value = self.rng.choice(named)
            if kind.sort in {"bool", "enum"} or kind.low <= value <= kind.high:
                ends = (int(value), int(value)) if kind.sort == "int" else (0, 0)
                return Expr(kind, name, lambda s, v: value, *ends)
        value = self.value(kind)
        ends = (int(value), int(value)) if kind.sort == "int" else (0, 0)
        return Expr(kind, kind.literal(value), lambda s, v: value, *ends)

    def read(self, kind: Kind) -> Expr:
        """A variable, an element or a local of a sort; a constant where there is none."""
        same = [leaf for leaf in self.readable() if alike(leaf.kind, kind)]
        chosen = [(name, one) for name, one, _ in self.locals if alike(one, kind)]
        several = [
            one
            for _, one in self.made.elements
            if alike(one.kind, kind) and root(one.before) not in self.hidden
        ]
        way = self.rng.randrange(6)
        if self.back and (same or several) and self.rng.randrange(8) == 0:
            return self.earlier(same, several)
        if way < 2 and chosen:
            name, one = self.rng.choice(chosen)
            return Expr(one, name, lambda s, v: v[name], *ends_of(one))
        if way == 2 and several:
            return self.element(self.rng.choice(several))
        if way < 5 and same:
            leaf = self.rng.choice(same)
            return Expr(leaf.kind, leaf.name, lambda s, v: s[leaf.name], *ends_of(leaf.kind))
        return self.literal(kind)

    def earlier(self, same: Sequence[Leaf], several: Sequence[Elements]) -> Expr:
        """A leaf or an element as the cycle before left it."""
        self.back = False
        if several and (not same or self.rng.randrange(2)):
            now = self.element(self.rng.choice(several))
        else:
            leaf = self.rng.choice(same)
            now = Expr(leaf.kind, leaf.name, lambda s, v: s[leaf.name], *ends_of(leaf.kind))
        self.back = True
        return Expr(now.kind, f"(was {now.text})", lambda s, v: now.of(s[PAST], v), now.low, now.high)

    def event(self) -> Expr:
        """`was` of a condition, an event, or a condition that has held for a time."""
        rng, way = self.rng, self.rng.randrange(5)
        self.back, locals_ = False, self.locals
        if way == 4:
            self.locals = []
        now = self.about(self.truth(1))
        when = self.about(self.truth(1)) if rng.randrange(3) == 0 else None
        value = self.about(self.read(self.kind()), now)
        self.back, self.locals = True, locals_
        if way == 0:
            return Expr(BOOL, f"(was ({now.text}))", lambda s, v: now.of(s[PAST], v))
        if way == 4:
            return self.lasts(now)
        word = ("@T", "@F", "@C")[way - 1]
        happens: dict[str, Meaning] = {
            "@T": lambda s, v: now.of(s, v) and not now.of(s[PAST], v),
            "@F": lambda s, v: now.of(s[PAST], v) and not now.of(s, v),
            "@C": lambda s, v: value.of(s, v) != value.of(s[PAST], v),
        }
        of, text = happens[word], f"{word}({(value if word == '@C' else now).text})"
        if when is None:
            return Expr(BOOL, text, lambda s, v: bool(of(s, v)))
        return Expr(BOOL, f"({text} when ({when.text}))", lambda s, v: bool(of(s, v) and when.of(s[PAST], v)))

    def about(self, one: Expr, other: Expr | None = None) -> Expr:
        """The expression where it is about a variable, else another that is."""
        if self.speaks(one.text):
            return one
        if other is not None:
            return other
        leaf = self.rng.choice(self.readable())
        a = self.value(leaf.kind)
        return Expr(BOOL, f"({leaf.name} = {leaf.kind.literal(a)})", lambda s, v: s[leaf.name] == a)

    def lasts(self, now: Expr) -> Expr:
        """A condition that holds, and held after each of so many cycles."""
        number, cycles = len(self.made.lasting), self.rng.choice((1, 1, 2, 3))
        self.made.lasting.append(now)
        return Expr(
            BOOL,
            f"(({now.text}) for {10 * cycles} [ms])",
            lambda s, v: bool(now.of(s, {})) and s[LASTED][number] >= cycles,
        )

    def of_set(self, depth: int) -> Expr:
        """Whether a value is of a named set, or of one in braces with more."""
        rng = self.rng
        one = rng.choice(self.made.sets)
        subject = self.integer(depth) if one.kind.sort == "int" and rng.randrange(2) else self.read(one.kind)
        subject = self.byte() if one.masks else subject
        if one.kind.sort == "int" and not fits((subject.low, subject.high), (one.kind.low, one.kind.high)):
            return self.read(BOOL)
        turned = rng.randrange(3) == 0
        word = "not in" if turned else "in"
        if not self.visible(one.name) or rng.randrange(2):
            return Expr(
                BOOL,
                f"({subject.text} {word} {one.name})",
                lambda s, v: one.has(subject.of(s, v)) is not turned,
            )
        more = self.value(one.kind)
        text = f"({subject.text} {word} {{{one.name}, {one.kind.literal(more)}}})"
        return Expr(
            BOOL,
            text,
            lambda s, v: (one.has(subject.of(s, v)) or subject.of(s, v) == more) is not turned,
        )

    def element(self, one: Elements) -> Expr:
        """An element by a computed index."""
        index = self.index(one.length)
        text = f"{one.before}[{index.text}]{one.after}"
        return Expr(
            one.kind, text, lambda s, v: s[f"{one.before}[{index.of(s, v)}]{one.after}"], *ends_of(one.kind)
        )

    def index(self, length: int) -> Expr:
        """An index of an array of this length."""
        given = self.integer(1)
        if given.low > -I64 - 1 and fits((-abs(given.low), given.high), (0, abs(given.low))):
            return Expr(
                given.kind,
                f"(abs({given.text}) mod {length})",
                lambda s, v: abs(given.of(s, v)) % length,
                0,
                length - 1,
            )
        at = self.rng.randrange(length)
        return Expr(given.kind, str(at), lambda s, v: at, at, at)

    def of_kind(self, kind: Kind, depth: int) -> Expr:
        """An expression whose values lie in the range of the type."""
        if kind.sort == "bool":
            return self.truth(depth)
        if kind.sort == "enum":
            return self.read(kind)
        return self.pulled(kind, self.integer(depth) if kind.sort == "int" else self.real(depth, kind.sort))

    def pulled(self, kind: Kind, one: Expr) -> Expr:
        """A number pulled into the range of a type; a value that is no number becomes an end."""
        low, high = kind.literal(kind.low), kind.literal(kind.high)
        if kind.sort == "int" and not fits((one.low, one.high), (kind.low, kind.high)):
            return self.literal(kind)
        if kind.sort == "int" and kind.low <= one.low and one.high <= kind.high and self.rng.randrange(2):
            return one
        return Expr(kind, f"min({high}, max({low}, {one.text}))",
                    lambda s, v: least(kind.high, most(kind.low, one.of(s, v))), *ends_of(kind))  # fmt: skip

    def integer(self, depth: int) -> Expr:
        """An integer expression that stays within 64 bits."""
        rng = self.rng
        if depth <= 0 or rng.randrange(4) == 0:
            return self.read(Kind("int", "", -3, 9))
        way = rng.randrange(9)
        if way == 1:
            return self.counted(depth - 1)
        if way == 2:
            return self.bits()
        if way == 0:
            one = self.real(depth - 1, rng.choice(REALS))
            return Expr(one.kind, f"int(min(900.0, max(-900.0, {one.text})))",
                        lambda s, v: math.trunc(least(900.0, most(-900.0, one.of(s, v)))), -900, 900)  # fmt: skip
        a, b = self.integer(depth - 1), self.integer(depth - 1)
        found = self._computed(
            rng.choice(("+", "-", "*", "/", "/", "mod", "mod", "mod", "min", "max", "abs", "neg")), a, b
        )
        return found or a

    def byte(self) -> Expr:
        """A number of eight bits, the first of which is set: it has as many whatever its bounds."""
        rest = self.index(128)
        return Expr(
            rest.kind,
            f"({rest.text} + 128)",
            lambda s, v: rest.of(s, v) + 128,
            rest.low + 128,
            rest.high + 128,
        )

    def bits(self) -> Expr:
        """Some bits of a byte, as a number."""
        byte, kind = self.byte(), Kind("int", "", 0, 255)
        high = self.rng.randrange(8)
        low, mask = self.rng.randrange(high + 1), self.rng.randrange(256)
        if byte.low == byte.high:
            return byte
        if self.rng.randrange(2):
            field = (2 << high - low) - 1
            return Expr(
                kind, f"{byte.text}[{high}..{low}]", lambda s, v: byte.of(s, v) >> low & field, 0, field
            )
        return Expr(
            kind,
            f"({byte.text} & {mask:#b} >> {low})",
            lambda s, v: (byte.of(s, v) & mask) >> low,
            0,
            mask >> low,
        )

    def masked(self) -> Expr:
        """Whether a byte fits a mask, or has a bit set."""
        byte, digits = self.byte(), [self.rng.choice("01xx") for _ in range(8)]
        place = self.rng.randrange(8)
        if byte.low == byte.high:
            return Expr(BOOL, f"({byte.text} = 0)", lambda s, v: byte.of(s, v) == 0)
        if "x" not in digits:
            return Expr(BOOL, f"{byte.text}[{place}]", lambda s, v: bool(byte.of(s, v) >> place & 1))
        mask = "".join(digits)
        return Expr(BOOL, f"({byte.text} = 0b{mask})", lambda s, v: fits_mask(mask, byte.of(s, v)))

    def counted(self, depth: int) -> Expr:
        """How many of some conditions hold, or one condition as a number."""
        parts = [self.truth(depth) for _ in range(self.rng.choice((1, 2, 3, 5)))]
        word = "int" if len(parts) == 1 else "count"
        return Expr(Kind("int", "", 0, len(parts)), f"{word}({', '.join(part.text for part in parts)})",
                    lambda s, v: sum(1 if part.of(s, v) else 0 for part in parts), 0, len(parts))  # fmt: skip

    def _computed(self, op: str, a: Expr, b: Expr) -> Expr | None:
        """The operator applied; None where something might leave 64 bits."""
        corners = [(x, y) for x in (a.low, a.high) for y in (b.low, b.high)]
        if op in ("+", "-", "*"):
            compute = COMPUTE[op]
            ends = [compute(x, y) for x, y in corners]
            text, of = f"({a.text} {op} {b.text})", lambda s, v: compute(a.of(s, v), b.of(s, v))
        elif op in ("/", "mod"):
            c = self.rng.choice((1, 2, 3, 7, 1000, -1, -4))
            work, ends = quotient, [quotient(a.low, c), quotient(a.high, c), 0]
            if not fits((a.low, a.high), (min(ends), max(ends))):
                return None  # for `mod`, too: the machine divides first
            if op == "mod":
                work, ends = remainder, [-abs(c) if a.low < 0 else 0, abs(c)]
            b = Expr(a.kind, "", a.of, c, c)
            text, of = f"({a.text} {op} {f'({c})' if c < 0 else c})", lambda s, v: work(a.of(s, v), c)
        elif op in ("min", "max"):
            choose = least if op == "min" else most
            ends = [min(a.low, b.low), max(a.high, b.high)]
            text, of = f"{op}({a.text}, {b.text})", lambda s, v: choose(a.of(s, v), b.of(s, v))
        else:
            b, ends = a, [-a.low, -a.high, abs(a.low), abs(a.high)]
            text = f"abs({a.text})" if op == "abs" else f"(-{a.text})"
            of = (lambda s, v: abs(a.of(s, v))) if op == "abs" else (lambda s, v: -a.of(s, v))
        low, high = min(ends), max(ends)
        if not fits((a.low, a.high), (b.low, b.high), (low, high)):
            return None
        return Expr(a.kind, text, of, low, high)

    def real(self, depth: int, sort: str = "real") -> Expr:
        """A real expression, or one of singles; it may become infinite, or no number."""
        rng, rounded = self.rng, ROUNDED[sort]
        wanted = Kind(sort, "", -1e3, 1e3)
        if depth <= 0 or rng.randrange(4) == 0:
            return self.read(wanted)
        op = rng.choice(("+", "-", "*", "*", "/", "min", "max", "abs", "neg", "converted"))
        if op == "converted":
            other = REALS[1 - REALS.index(sort)]
            n = self.integer(depth - 1) if rng.randrange(3) else self.real(depth - 1, other)
            return Expr(wanted, f"{sort}({n.text})", lambda s, v: rounded(n.of(s, v)))
        a, b = self.real(depth - 1, sort), self.real(depth - 1, sort)
        if op == "/":
            c = rounded(
                rng.choice((3.0, -0.1, 1e-300, 1e300) if sort == "real" else (3.0, -0.1, 1e-30, 1e30))
            )
            return Expr(wanted, f"({a.text} / ({c!r}))", lambda s, v: rounded(a.of(s, v) / c))
        if op in ("min", "max"):
            choose = least if op == "min" else most
            return Expr(wanted, f"{op}({a.text}, {b.text})", lambda s, v: choose(a.of(s, v), b.of(s, v)))
        if op in ("abs", "neg"):
            return Expr(wanted, f"abs({a.text})" if op == "abs" else f"(-{a.text})",
                        lambda s, v: math.fabs(a.of(s, v)) if op == "abs" else -a.of(s, v))  # fmt: skip
        work = COMPUTE[op]
        return Expr(wanted, f"({a.text} {op} {b.text})", lambda s, v: rounded(work(a.of(s, v), b.of(s, v))))

    def truth(self, depth: int) -> Expr:
        rng = self.rng
        way = rng.randrange(8) if depth > 0 else rng.randrange(3)
        if self.back and depth > 0 and rng.randrange(7) == 0:
            return self.event()
        if way == 0:
            return self.read(BOOL)
        if way == 3 and rng.randrange(2):
            return self.masked()
        if way < 4:
            return self.compared(depth - 1)
        if way == 4:
            one = self.truth(depth - 1)
            return Expr(BOOL, f"(not {one.text})", lambda s, v: not one.of(s, v))
        a, b = self.truth(depth - 1), self.truth(depth - 1)
        word = rng.choice(tuple(JOIN))
        join = JOIN[word]
        return Expr(BOOL, f"({a.text} {word} {b.text})", lambda s, v: bool(join(a.of(s, v), b.of(s, v))))

    def compared(self, depth: int) -> Expr:
        """A comparison, a set or a range."""
        rng = self.rng
        if self.made.sets and rng.randrange(3 if self.locals else 5) == 0:
            return self.of_set(depth)
        sort = rng.choice(("int", "int", "real", "single", "enum", "bool"))
        if sort == "enum":
            kind = rng.choice(self.enums)
            one = self.read(kind)
            values = sorted({int(self.value(kind)) for _ in range(2)})
            text = f"({one.text} in {{{', '.join(kind.literal(x) for x in values)}}})"
            return Expr(BOOL, text, lambda s, v: one.of(s, v) in values)
        word = rng.choice(tuple(COMPARE) if sort != "bool" else ("=", "/="))
        make: dict[str, Callable[[int], Expr]] = {
            "int": self.integer, "real": self.real, "single": partial(self.real, sort="single"), "bool": self.truth,
        }  # fmt: skip
        a, b = make[sort](depth), make[sort](depth)
        if sort == "int" and not fits((a.low, a.high), (b.low, b.high)):
            return self.read(BOOL)
        if sort == "int" and rng.randrange(4) == 0:
            low, high = sorted(
                (int(self.value(Kind("int", "", -9, 99))), int(self.value(Kind("int", "", 0, 300))))
            )
            if fits((a.low, a.high), (low, high)):
                return Expr(
                    BOOL,
                    f"({a.text} in {f'({low})' if low < 0 else low} .. {high})",
                    lambda s, v: low <= a.of(s, v) <= high,
                )
        return Expr(BOOL, f"({a.text} {word} {b.text})", lambda s, v: COMPARE[word](a.of(s, v), b.of(s, v)))

    # --- statements ---

    def block(self, depth: int, count: int) -> tuple[str, Doing]:
        inner = len(self.locals)
        pairs = [self.statement(depth) for _ in range(self.rng.randint(1, count))]
        del self.locals[inner:]
        doings = [one for _, one in pairs]

        def run(s: State, v: Locals) -> None:
            for doing in doings:
                doing(s, v)

        return " ".join(text for text, _ in pairs), run

    def statement(self, depth: int) -> tuple[str, Doing]:
        rng = self.rng
        way = rng.randrange(10) if depth > 0 else rng.randrange(4)
        if way < 3:
            return self.assign()
        if way == 3:
            return self.local()
        if way == 4 and self.calls():
            return self.call(self.rng.choice(self.calls()))
        if way < 7:
            asked, (a, first), (b, second) = self.truth(2), self.block(depth - 1, 2), self.block(depth - 1, 2)

            def either(s: State, v: Locals) -> None:
                (first if asked.of(s, v) else second)(s, v)

            return f"if {asked.text} {{ {a} }} else {{ {b} }}", either
        return self.case(depth) if way == 7 else self.loop(depth)

    def assign(self) -> tuple[str, Doing]:
        """An assignment to a leaf, an element or a local."""
        rng = self.rng
        several = [
            one
            for word, one in self.made.elements
            if word == "state" and (self.targets is None or root(one.before) in self.targets)
        ]
        local = [(name, kind) for name, kind, may in self.locals if may]
        if several and rng.randrange(3) == 0:
            one = rng.choice(several)
            index, value = self.index(one.length), self.of_kind(one.kind, 2)

            def put(s: State, v: Locals) -> None:
                found = kept(value.of(s, v))
                s[f"{one.before}[{index.of(s, v)}]{one.after}"] = found

            return f"{one.before}[{index.text}]{one.after} := {value.text}", put
        if local and rng.randrange(3) == 0:
            name, kind = rng.choice(local)
            given = self.of_kind(kind, 2)
            return f"{name} := {given.text}", lambda s, v: v.__setitem__(name, kept(given.of(s, v)))
        leaf = rng.choice(self.writable())
        wanted = self.of_kind(leaf.kind, 3)
        late = any(one.until is not None and one.name == leaf.name for one in self.made.declared)
        where = f"{leaf.name}.next" if late else leaf.name
        text = f"{'next ' if late else ''}{leaf.name} := {wanted.text}"
        return text, lambda s, v: s.__setitem__(where, kept(wanted.of(s, v)))

    def local(self) -> tuple[str, Doing]:
        name, kind = self.local_name("k"), self.kind()
        value = self.of_kind(kind, 2)
        self.locals.append((name, kind, True))
        return f"local {name} : {kind.text} := {value.text}", lambda s, v: v.__setitem__(
            name, kept(value.of(s, v))
        )

    def case(self, depth: int) -> tuple[str, Doing]:
        """A choice by an enumeration or a small integer."""
        kind = self.rng.choice(self.enums)
        subject = self.read(kind)
        values = list(range(len(kind.members)))
        self.rng.shuffle(values)
        values = values[: self.rng.randint(1, 3)]
        arms = [self.block(depth - 1, 2) for _ in values]
        text, orelse = self.block(depth - 1, 2)
        chosen = {value: body for value, (_, body) in zip(values, arms, strict=True)}
        parts = " ".join(f"{kind.literal(x)} {{ {arm} }}" for x, (arm, _) in zip(values, arms, strict=True))

        def run(s: State, v: Locals) -> None:
            chosen.get(int(subject.of(s, v)), orelse)(s, v)

        whole = len(values) == len(kind.members)
        return f"case {subject.text} {{ {parts} {'' if whole else f'else {{ {text} }}'} }}", run

    def loop(self, depth: int) -> tuple[str, Doing]:
        """A loop, at an end of 64 bits now and then."""
        low = self.rng.choice((0, 0, 1, -2, I64 - 1, U64 - 1, -I64 - 1))
        high = low + self.rng.randint(-1, 2)
        high = max(min(high, U64 if low >= 0 else I64), -I64 - 1)
        name = self.local_name("i")
        self.locals.append((name, Kind("int", "", low, max(high, low)), False))
        text, body = self.block(depth - 1, 2)
        self.locals.pop()

        def run(s: State, v: Locals) -> None:
            for at in range(low, high + 1):
                v[name] = at
                body(s, v)

        return f"for {name} in {low} .. {high} {{ {text} }}", run

    def calls(self) -> list[int]:
        """Procedures that may be called here."""
        return [*range(len(self.made.procedures))] if self.callable is None else self.callable

    def call(self, number: int) -> tuple[str, Doing]:
        """A call of a procedure that is already there."""
        name, kinds, body = self.made.procedures[number]
        args = [self.of_kind(kind, 2) for kind in kinds]
        text = f"{name}({', '.join(arg.text for arg in args)})" if args else name
        return text, lambda s, v: body(s, [kept(arg.of(s, v)) for arg in args])

    def procedure(self) -> None:
        name, kinds = self.name("p"), tuple(self.kind() for _ in range(self.rng.randrange(3)))
        params: list[str] = []
        for kind in kinds:
            params.append(self.local_name("a"))
            self.locals.append((params[-1], kind, False))
        self.back = self.rng.randrange(2) == 0
        text, body = self.block(self.rng.randrange(3), 3)
        self.locals, self.back = [], False
        said = ", ".join(f"{param} : {kind.text}" for param, kind in zip(params, kinds, strict=True))
        self.made.text.append(f"procedure {name}{f'({said})' if params else ''} {{ {text} }}")
        self.bodies[name] = text
        if self.callable is not None:
            self.callable = [*self.callable, len(self.made.procedures)]
        self.made.procedures.append(
            (name, kinds, lambda s, given: body(s, dict(zip(params, given, strict=True))))
        )

    # --- tables ---

    def cell(self, leaf: Leaf) -> tuple[str, Expr | None]:
        """A condition cell over a leaf, now or with an event; blank now and then, and where nothing would satisfy it."""
        text, now = self.plain_cell(leaf)
        if not self.back or self.rng.randrange(4):
            return text, now
        text, event = self.event_cell(leaf, text, now)
        return ("", None) if self.possible(event) is None else (text, event)

    def event_cell(self, leaf: Leaf, text: str, now: Expr | None) -> tuple[str, Expr]:
        """An event of a leaf, or that it does not happen: of its truth, of what a cell says of it, or of its value."""
        name, truth = leaf.name, leaf.kind.sort == "bool"
        happens: Meaning = lambda s, v: s[name] != s[PAST][name]  # noqa: E731 - the first of two
        word = self.rng.choice(("@T", "@F", "@C")) if truth or now is not None else "@C"
        holds: Meaning = (lambda s, v: s[name]) if truth or now is None else now.of
        if word != "@C":
            to = word == "@T"
            happens = lambda s, v: holds(s, v) is to and holds(s[PAST], v) is not to  # noqa: E731
        of = "" if truth or word == "@C" else f"({text})"
        if self.rng.randrange(4) == 0:
            when = self.about_now()
            return f"{word}{of} when {when.text}", Expr(
                BOOL, "", lambda s, v: happens(s, v) and when.of(s[PAST], v)
            )
        turned = self.rng.randrange(3) == 0
        return f"{'not ' if turned else ''}{word}{of}", Expr(
            BOOL, "", lambda s, v: bool(happens(s, v)) is not turned
        )

    def in_mode(self, first: tuple[str, Expr | None], when: Expr | None) -> Expr | None:
        """The condition of a row, or one about `inmode`: what its first cell says, where that is of one cycle."""
        text, mode = first
        rng = random.Random(f"{text} {len(self.made.text)}")  # the other draws of a seed stay what they were
        if mode is None or "@" in text or not self.back or rng.randrange(3):
            return when
        of = mode.of
        word, holds = rng.choice(
            (
                ("@T(inmode)", lambda s, v: of(s, v) and not of(s[PAST], v)),
                ("not @F(inmode)", lambda s, v: of(s, v) or not of(s[PAST], v)),
                ("was inmode", lambda s, v: of(s[PAST], v)),
                ("inmode", of),
            )
        )
        if when is None:
            return self.possible(Expr(BOOL, word, lambda s, v: bool(holds(s, v)))) or when
        both = Expr(BOOL, f"{word} or ({when.text})", lambda s, v: bool(holds(s, v) or when.of(s, v)))
        return self.possible(both) or when

    def about_now(self) -> Expr:
        """A condition of one cycle, about a variable."""
        self.back = False
        now = self.about(self.truth(1))
        self.back = True
        return Expr(BOOL, f"({now.text})", now.of)

    def plain_cell(self, leaf: Leaf) -> tuple[str, Expr | None]:
        """A condition cell over a leaf; blank now and then, and where no value would satisfy it."""
        rng, kind = self.rng, leaf.kind
        if rng.randrange(3) == 0:
            return "", None
        a, b = self.value(kind), self.value(kind)
        named = self.set_cell(leaf)
        if named is not None:
            return named
        if (kind.sort, kind.low, kind.high) == ("int", 0, 255) and rng.randrange(2):
            return self.mask_cell(leaf)
        if kind.sort in ("bool", "enum"):
            return kind.literal(a), Expr(BOOL, "", lambda s, v: s[leaf.name] == a)
        if rng.randrange(3) == 0:
            low, high = sorted((a, b))
            return f"{kind.literal(low)} .. {kind.literal(high)}", Expr(
                BOOL, "", lambda s, v: low <= s[leaf.name] <= high
            )
        word = rng.choice(tuple(COMPARE))
        if not any(COMPARE[word](x, a) for x in (kind.low, kind.high, a)):
            return "", None
        return f"{word} {kind.literal(a)}", Expr(BOOL, "", lambda s, v: COMPARE[word](s[leaf.name], a))

    def set_cell(self, leaf: Leaf) -> tuple[str, Expr | None] | None:
        """`in NAME`, or `not in NAME`, where some value of the leaf satisfies it; None where no set is of its type."""
        rng, kind = self.rng, leaf.kind
        fitting = [
            one
            for one in self.made.sets
            if alike(one.kind, kind)
            and fits_kind(one.kind, kind)
            and (not one.masks or (kind.low, kind.high) == (0, 255))
        ]
        if not fitting or rng.randrange(3):
            return None
        one, turned = rng.choice(fitting), rng.randrange(3) == 0
        near = [x for x in (*one.some, kind.low, kind.high) if kind.low <= x <= kind.high]
        if not any(one.has(x) is not turned for x in near):
            return None
        word = "not in" if turned else "in"
        return f"{word} {one.name}", Expr(BOOL, "", lambda s, v: one.has(s[leaf.name]) is not turned)

    def mask_cell(self, leaf: Leaf) -> tuple[str, Expr | None]:
        """Masks under a word of eight bits, in groups."""
        masks = [
            "".join(self.rng.choice("01x") for _ in range(7)) + "x" for _ in range(self.rng.randint(1, 2))
        ]
        if len(masks) == 2 and masks[0] == masks[1]:
            del masks[1]
        return ", ".join(f"{mask[:4]} {mask[4:]}" for mask in masks), Expr(
            BOOL, "", lambda s, v: any(fits_mask(mask, s[leaf.name]) for mask in masks)
        )

    def possible(self, condition: Expr | None) -> Expr | None:
        """The condition, where some drawn state satisfies it."""
        for _ in range(12 if condition else 0):
            state, past = (
                {leaf.name: self.value(leaf.kind) for leaf in self.made.leaves()} for _ in range(2)
            )
            held = [self.rng.randrange(4) for _ in self.made.lasting]
            if condition and condition.of({**state, PAST: past, LASTED: held}, {}):
                return condition
        return None

    def table(self) -> None:
        """A table: lines by a few leaves, and by whole conditions."""
        rng, made, name = self.rng, self.made, self.name("t")
        self.back = rng.randrange(2) == 0
        leaves = self.readable()
        columns = rng.sample(leaves, min(rng.randint(1, 3), len(leaves)))
        outputs = rng.sample(self.shown, rng.randint(0, len(self.shown)))
        heads = [*(leaf.name for leaf in columns), "when"]
        rows = [
            f"| line | {' | '.join(heads)} || procedures {''.join(f'| {leaf.name} ' for leaf in outputs)}|"
        ]
        lines, half = [], self.truth(2)
        count = rng.randint(1, 4)
        names = (
            [str(n) for n in range(1, count + 1)]
            if rng.randrange(5) == 0
            else [self.name("l") for _ in range(count)]
        )
        marks, upper, same = self.ordered(names)
        done: list[tuple[str, tuple[Doing, ...]]] = []
        for number in range(count):
            cells = [self.cell(leaf) for leaf in columns]
            way = rng.randrange(4)  # two lines that part, more often than not
            when = self.in_mode(cells[0], self.possible((half, negated(half), self.truth(1), None)[way]))
            done.append(done[same[number]] if number in same else self.actions(outputs))
            texts, does = done[-1]
            rows.append(
                f"| {names[number]}{marks[number]} | {' | '.join(text for text, _ in cells)} | {when.text if when else ''} || {texts} |"
            )
            whole = (*(one for _, one in cells if one), *([when] if when else []))
            lines.append(Line(whole, does, frozenset(upper[number])))
        default = None
        if rng.randrange(3):
            texts, default = self.actions(outputs)
            rows.append(f"| {self.name('rest')} | DEFAULT | {'| ' * (len(heads) - 2)}|| {texts} |")
        self.back = False
        assuming = tuple(name for name, _ in made.assumptions if rng.randrange(2))
        stops = tuple(name for name in assuming if rng.randrange(3) == 0)
        relies = f"assuming {', '.join(assuming)} " if assuming else ""
        made.text.append(f"table {name} {relies}{{")
        made.text += [*rows, "}"]
        self.bodies[f"table {name}"] = "\n".join(rows)
        made.tables.append(Table(name, tuple(lines), default, assuming, stops))

    def turned(self) -> None:
        """A table that is printed the other way round: a matrix, or one with a column for each result; its lines row by row."""
        rng, made, name = self.rng, self.made, self.name("t")
        self.back = rng.randrange(2) == 0
        leaves = self.readable()
        columns = rng.sample(leaves, min(rng.randint(1, 2), len(leaves)))
        by = rng.choice(leaves) if rng.randrange(2) else None
        given = rng.choice([None, *self.shown])
        across = [self.column(by, given) for _ in range(rng.randint(1, 3))]
        names = [self.name("c") for _ in across]
        heads = [f"{one} : {text}" for one, (text, _, _) in zip(names, across, strict=True)]
        rows = [f"| line | {' | '.join(leaf.name for leaf in columns)} || {' | '.join(heads)} |"]
        lines: list[Line] = []
        for _ in range(rng.randint(1, 3)):
            left = [self.cell(leaf) for leaf in columns]
            texts = []
            for _, test, does in across:
                if by is None:
                    when = self.in_mode(left[0], self.possible((self.truth(1), None)[rng.randrange(2)]))
                    says, tests, do = when.text if when else rng.choice(("", "-", "false")), (when,), does
                else:
                    says, do = self.result(given)
                    tests = (test,)
                texts.append(says)
                if says not in ("", "-", "false") or (by is not None and says == "false"):
                    whole = tuple(one for one in (*(one for _, one in left), *tests) if one is not None)
                    lines.append(Line(whole, do, frozenset()))
            rows.append(
                f"| {self.name('l')} | {' | '.join(text for text, _ in left)} || {' | '.join(texts)} |"
            )
        default = None
        if not lines or rng.randrange(3):
            text, default = self.result(given)
            rows.append(f"| {self.name('rest')} | DEFAULT {'| ' * (len(columns) - 1)}|| {text} |")
        self.back = False
        said = "procedures" if given is None else given.name
        made.text += [f"table {name} {f'by {by.name} ' if by else ''}giving {said} {{", *rows, "}"]
        self.bodies[f"table {name}"] = "\n".join([said, *([by.name] if by else []), *rows])
        made.tables.append(Table(name, tuple(lines), default, (), ()))

    def column(self, by: Leaf | None, given: Leaf | None) -> tuple[str, Expr | None, tuple[Doing, ...]]:
        """The heading of a column: a result, or a condition of what the columns are by, or after `when` any."""
        if by is None:
            text, does = self.result(given)
            return text or "-", None, does
        text, test = self.cell(by)
        if text and self.rng.randrange(3):
            return text, test, ()
        test = self.truth(1)
        return f"when {test.text}", test, ()

    def result(self, given: Leaf | None) -> tuple[str, tuple[Doing, ...]]:
        """What a line does: a call, or the value of an output."""
        if given is None:
            return self.actions(())
        value = self.of_kind(given.kind, 1)
        return value.text, (self._put(given.name, value),)

    def ordered(self, names: Sequence[str]) -> tuple[list[str], list[set[int]], dict[int, int]]:
        """What stands after the names of lines; the lines above each; of lines that do the same as an earlier one, which that is."""
        rng, count = self.rng, len(names)
        marks, upper = [""] * count, [set[int]() for _ in names]
        way = rng.randrange(4)
        if way == 0:  # only a line of a higher rank stands above another
            ranked = rng.sample(range(count), count)
            for at, low in enumerate(ranked[1:], 1):
                for high in ranked[:at]:
                    if rng.randrange(3) == 0:
                        upper[low].add(high)
            for line in range(count):
                below = [names[low] for low in range(count) if line in upper[low]]
                marks[line] = f" above {', '.join(below)}" if below else ""
            whole = ranked[0]
            if rng.randrange(3) == 0:
                marks[whole] = " above all"
                for low in ranked[1:]:
                    upper[low].add(whole)
            for low in ranked:  # those above what stands above it
                upper[low] |= {high for middle in upper[low] for high in upper[middle]}
            return marks, upper, {}
        same: dict[int, int] = {}
        if way == 1:
            first = {line: line for line in range(count)}
            for line in range(1, count):
                if rng.randrange(2):
                    other = rng.randrange(line)
                    same[line] = other
                    first[line] = first[other]
                    marks[line] = f" same {names[other]}"
            for line in range(count):
                upper[line] = {other for other in range(line) if first[other] == first[line]}
        return marks, upper, same

    def actions(self, outputs: Sequence[Leaf]) -> tuple[str, tuple[Doing, ...]]:
        """The action cells of a line."""
        text, does = "", list[Doing]()
        if self.calls() and self.rng.randrange(4):
            text, run = self.call(self.rng.choice(self.calls()))
            does.append(run)
        given = {leaf.name: self.of_kind(leaf.kind, 2) for leaf in outputs if self.rng.randrange(3)}
        does += [self._put(name, value) for name, value in given.items()]
        if self.reads_written(bool(text), given):  # what a cell reads no cell before it has written
            one = "; ".join(
                [*([text] if text else []), *(f"{name} := {e.text}" for name, e in given.items())]
            )
            return " | ".join([one, *("" for _ in outputs)]), tuple(does)
        values = (given[leaf.name].text if leaf.name in given else "" for leaf in outputs)
        return " | ".join([text, *values]), tuple(does)

    def reads_written(self, called: bool, given: Mapping[str, Expr]) -> bool:
        """Whether a value may read what was written before it: by a call anything, by a value its leaf."""
        names = {one.name for one in self.made.declared if one.word != "input"} if called else set[str]()
        for name, value in given.items():
            if names & set(re.findall(r"\w+", value.text)):
                return True
            names.add(re.split(r"[.\[]", name)[0])
        return False

    @staticmethod
    def _put(name: str, given: Expr) -> Doing:
        return lambda s, v: s.__setitem__(name, kept(given.of(s, v)))

    # --- the whole ---

    def draw(self) -> Drawn:
        rng, made = self.rng, self.made
        sizes = [(self.name("e"), rng.choice(self.members)) for _ in range(2)]
        self.enums = tuple(
            Kind("enum", name, 0, size - 1, tuple(self.name("m") for _ in range(size)))
            for name, size in sizes
        )
        made.text += [f"enum {enum.text} {{ {', '.join(enum.members)} }}" for enum in self.enums]
        for _ in range(rng.randrange(3)):
            self.constant()
        for _ in range(rng.randrange(3)):
            self.named_set()
        for word, count in (("input", 3), ("state", 3), ("output", 1)):
            for _ in range(rng.randint(1, count)):
                self.declare(word)
        if rng.randrange(2):
            self.deferred()
        for _ in range(rng.randrange(3)):
            self.back = rng.randrange(3) == 0
            condition, name = self.truth(2), self.name("h")
            self.back = False
            made.text.append(f"assume {name} monitored : {condition.text}")
            made.assumptions.append((name, condition))
        if rng.randrange(3) == 0:
            self.staged()
            return made
        for _ in range(rng.randint(1, 3)):
            self.procedure()
        self.shown = self.only_lines(rng.randint(1, 2))
        for _ in range(rng.choice((1, 1, 2))):
            # Not from `rng`: the other draws of a seed stay what they were.
            (self.table if random.Random(f"{made.text}").randrange(3) else self.turned)()
        self.level()
        return made

    def constant(self) -> None:
        kind, name = self.kind(), self.name("c")
        if kind.sort == "single":
            return
        value = self.value(kind)
        self.made.text.append(f"const {name} = {kind.literal(value)}")
        own = replace(kind, low=value, high=value) if kind.sort in {"int", "real"} else kind
        self.made.constants.append((name, own, value))

    def named_set(self) -> None:
        """A named set of values, ranges, masks, and what another set has."""
        rng, kind, name = self.rng, self.kind(), self.name("set")
        if kind.sort == "bool":
            return
        texts, tests, some = list[str](), list[Callable[[Any], bool]](), list[Value]()
        for _ in range(rng.randint(1, 3)):
            one, other = sorted((self.value(kind), self.value(kind)))
            way = rng.randrange(4)
            inner = [each for each in self.made.sets if fits_kind(each.kind, kind) and alike(each.kind, kind)]
            if way == 0 and kind.sort != "enum":
                texts.append(f"{kind.literal(one)} .. {kind.literal(other)}")
                tests.append(partial(between, one, other))
                some += [one, other]
            elif way == 1 and inner:
                its = rng.choice(inner)
                texts.append(its.name)
                tests.append(its.has)
                some += its.some
            elif way == 2 and (kind.sort, kind.low, kind.high) == ("int", 0, 255):
                mask = "".join(rng.choice("01x") for _ in range(7)) + "x"
                texts.append(f"0b{mask}")
                tests.append(partial(fits_mask, mask))
                some.append(int(mask.replace("x", "0"), 2))
            else:
                member = self.literal(kind)
                value = member.of({}, {})
                texts.append(member.text)
                tests.append(partial(is_same, value))
                some.append(value)
        self.made.text.append(f"set {name} : {kind.text} = {{{', '.join(texts)}}}")
        masks = any(text.startswith("0b") for text in texts) or any(
            each.masks for each in self.made.sets if each.name in texts
        )
        self.made.sets.append(
            NamedSet(name, kind, lambda x: any(test(x) for test in tests), tuple(some), masks)
        )

    def only_lines(self, count: int) -> list[Leaf]:
        """Outputs that only lines write."""
        leaves = []
        for _ in range(count):
            kind, name = self.kind(), self.name("o")
            safe = self.value(kind) if self.rng.randrange(3) == 0 else None
            self.made.text.append(
                f"output {name} : {kind.text}" + ("" if safe is None else f" safe {kind.literal(safe)}")
            )
            leaves.append(Leaf(name, kind))
            self.made.declared.append(Declared(name, "output", (leaves[-1],), safe=safe))
        return leaves

    def staged(self) -> None:
        """Several tables in one cycle: each writes variables of its own, and reads these and those of some before it."""
        rng, made = self.rng, self.made
        common = frozenset(one.name for one in made.declared if one.word != "input")
        self.targets, self.callable = common, []
        for _ in range(rng.randint(0, 2)):
            self.procedure()
        around = self.callable
        groups = [self.group() for _ in range(rng.randint(2, 3))]
        numbers: list[tuple[int, ...]] = []
        by = [leaf for leaf in made.leaves("input") if leaf.kind.sort == "enum" and leaf.name.isidentifier()]
        selector = rng.choice(by) if by and rng.randrange(2) else None
        for at, group in enumerate(groups):
            self.hidden = frozenset(leaf.name for later in groups[at + 1 :] for leaf in later)
            self.targets, self.callable = frozenset(leaf.name for leaf in group), []
            for _ in range(rng.randint(0, 1)):
                self.procedure()
            self.shown = group
            first = len(made.tables)
            choice = selector is not None and at == len(groups) - 1
            for _ in range(2 if choice else 1):
                self.table()
            numbers.append(tuple(range(first, len(made.tables))))
        self.hidden, self.targets, self.callable = frozenset(), None, None
        made.stages = self.in_order(groups, numbers, selector)
        self.level(around)

    def group(self) -> list[Leaf]:
        """Variables that one table of several writes."""
        leaves = self.only_lines(self.rng.randint(1, 2))
        if self.rng.randrange(2):
            kind, name = self.kind(), self.name("g")
            self.made.text.append(f"state {name} : {kind.text}")
            leaves.append(Leaf(name, kind))
            self.made.declared.append(Declared(name, "state", (leaves[-1],)))
        return leaves

    def in_order(
        self, groups: Sequence[Sequence[Leaf]], numbers: Sequence[tuple[int, ...]], selector: Leaf | None
    ) -> list[Stage]:
        """The order in which they run: after what they read; else single tables as they are declared, and then a choice."""
        reads = [
            {
                word
                for number in group
                for word in self.read_by(f"table {self.made.tables[number].name}", set())
            }
            for group in numbers
        ]
        waits = [
            {
                other
                for other in range(len(groups))
                if other != at and reads[at] & {leaf.name for leaf in groups[other]}
            }
            for at in range(len(groups))
        ]
        stages: list[Stage] = []
        left = list(range(len(groups)))
        while left:
            ready = [at for at in left if waits[at].isdisjoint(left)]
            at = min(ready, key=lambda at: (len(numbers[at]) > 1, numbers[at]))
            left.remove(at)
            if len(numbers[at]) == 1:
                stages.append((None, numbers[at]))
            else:
                assert selector is not None
                chosen = tuple(self.rng.choice(numbers[at]) for _ in selector.kind.members)
                stages.append((selector, chosen))
        return stages

    def read_by(self, name: str, met: set[str]) -> set[str]:
        """Words in a table, and in the procedures that it calls, but where only the cycle before is meant."""
        words = set(WORDS.findall(now_only(self.bodies[name])))
        for callee in words & self.bodies.keys() - met:
            met.add(callee)
            words |= self.read_by(callee, met)
        return words

    def deferred(self) -> None:
        """A variable that takes its next value when a condition holds."""
        kind, name = self.kind(), self.name("d")
        start, until = self.value(kind), self.truth(2)
        self.made.text.append(
            f"state {name} : {kind.text} = {kind.literal(start)} deferred until {until.text}"
        )
        self.made.declared.append(Declared(name, "state", (Leaf(name, kind),), start=start, until=until))

    def level(self, around: Sequence[int] | None = None) -> None:
        """The level: what runs before and after, and which tables."""
        made, rng = self.made, self.rng
        may = range(len(made.procedures)) if around is None else around
        plain = [at for at in may if not made.procedures[at][1]]
        made.before = [at for at in plain if rng.randrange(3) == 0]
        made.after = [at for at in plain if rng.randrange(3) == 0]
        by = [leaf for leaf in made.leaves("input") if leaf.kind.sort == "enum" and leaf.name.isidentifier()]
        if not made.stages and by and rng.randrange(2):
            leaf = rng.choice(by)
            made.stages = [(leaf, tuple(rng.randrange(len(made.tables)) for _ in leaf.kind.members))]
        made.stages = made.stages or [(None, (0,))]
        chosen = [self.choice(stage) for stage in made.stages]
        rng.shuffle(chosen)
        said = [made.procedures[at][0] for at in made.before], [made.procedures[at][0] for at in made.after]
        before, after = (
            f"{word} {', '.join(names)} " if names else ""
            for word, names in zip(("preprocess", "postprocess"), said, strict=True)
        )
        made.text.append(
            f"level {self.name('level')} {{ period 10 [ms] {before}{'  '.join(chosen)} {after}}}"
        )

    def choice(self, stage: Stage) -> str:
        """One table, or a choice, as a level lists it."""
        leaf, numbers = stage
        if leaf is None:
            return f"table {self.made.tables[numbers[0]].name}"
        pairs = zip(leaf.kind.members, numbers, strict=True)
        return (
            f"table by {leaf.name} {{ {'  '.join(f'{m} : {self.made.tables[n].name}' for m, n in pairs)} }}"
        )


WORDS = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_EARLIER = re.compile(r"\bwas |\bwhen \(")


def root(leaf: str) -> str:
    """The variable that a leaf is of."""
    return leaf.partition(".")[0].partition("[")[0]


def now_only(text: str) -> str:
    """The text without what is said of the cycle before: behind `was`, and behind the `when` of an event."""
    while found := _EARLIER.search(text):
        start = found.end() - (found[0] == "when (")
        end, depth = start, 0
        while end < len(text) and (
            depth or end == start or text[end] in ".[" or text[end].isalnum() or text[end] == "_"
        ):
            depth += (text[end] in "([") - (text[end] in ")]")
            end += 1
        text = text[: found.start()] + " " + text[end:]
    return text


def fits_mask(mask: str, value: Any) -> bool:
    """Whether a number has the digits of the mask."""
    return all(digit in ("x", bit) for digit, bit in zip(mask, f"{int(value):0{len(mask)}b}", strict=True))


def between(low: Any, high: Any, value: Any) -> bool:
    """Whether it lies in a range with both ends."""
    return bool(low <= value <= high)


def is_same(one: Any, value: Any) -> bool:
    return bool(one == value)


def fits_kind(inner: Kind, outer: Kind) -> bool:
    """Whether all values of the one are of the other."""
    return outer.low <= inner.low and inner.high <= outer.high


def alike(one: Kind, other: Kind) -> bool:
    """Whether values of one may stand where the other is wanted; ranges aside."""
    return one.sort == other.sort and (one.sort != "enum" or one.text == other.text)


def ends_of(kind: Kind) -> tuple[int, int]:
    """Bounds of an integer type; nothing of interest of others."""
    return (int(kind.low), int(kind.high)) if kind.sort == "int" else (0, 0)


def negated(one: Expr) -> Expr:
    return Expr(BOOL, f"(not {one.text})", lambda s, v: not one.of(s, v))


# --- what a cycle does -------------------------------------------------------------------------


@dataclass(frozen=True)
class Seen:
    """What a cycle left: fault, what it is about, the line, failed assumptions, and every leaf."""

    fault: int
    about: str
    line: int
    failed: tuple[str, ...]
    values: tuple[object, ...]


def bits(value: Value) -> object:
    """A value by which -0.0, NaN and the rest are told apart."""
    return struct.pack("<d", value) if isinstance(value, float) else int(value)


def order(drawn: Drawn) -> list[tuple[str, Kind]]:
    """Leaves with the pending ones, in declared order; then the lines that are kept."""
    found = []
    for one in drawn.declared:
        for leaf in one.leaves:
            found.append((leaf.name, leaf.kind))
            if one.until is not None:
                found.append((f"{leaf.name}.next", leaf.kind))
    return found + [(kept_line(table), Kind("int", "")) for table in sorted(set(drawn.staged))]


def begun(drawn: Drawn) -> State:
    """The state before the first cycle."""
    state: State = {}
    for one in drawn.declared:
        for leaf in one.leaves:
            begins = one.safe if one.start is None else one.start
            state[leaf.name] = kept(leaf.kind.zero() if begins is None else begins)
            if one.until is not None:
                state[f"{leaf.name}.next"] = state[leaf.name]
    state |= {kept_line(table): 0 for table in drawn.staged}
    return {**state, PAST: dict(state), LASTED: [0 for _ in drawn.lasting]}


def admitted(one: Declared, leaf: Leaf, value: Value) -> Value | None:
    """The value that the level sees; None where it is refused."""
    if isinstance(value, float) and math.isnan(value):
        return None
    if leaf.kind.low <= value <= leaf.kind.high:
        return kept(value)
    if not one.clamp:
        return None
    return kept(leaf.kind.low if value < leaf.kind.low else leaf.kind.high)


def evaluated(drawn: Drawn, state: State) -> tuple[Seen, State]:
    """One cycle by this evaluator: steps 1 to 8 of the manual, and what a fault leaves."""
    told, now = _cycle(drawn, state)
    fault, about, line, failed = told
    if fault:
        now |= {one.name: kept(one.safe) for one in drawn.declared if one.safe is not None}
    else:
        now[LASTED] = [now[LASTED][at] + 1 if one.of(now, {}) else 0 for at, one in enumerate(drawn.lasting)]
        now[PAST] = {name: value for name, value in now.items() if name not in {PAST, LASTED}}
    return seen(drawn, fault, about, line, failed, now), now


def _cycle(drawn: Drawn, state: State) -> tuple[tuple[int, str, int, tuple[str, ...]], State]:
    """Steps 1 to 7: the fault, what it is about, the line, failed assumptions; and the state."""
    now = dict(state)
    for one in drawn.declared:
        if one.word == "input":
            for leaf in one.leaves:
                value = admitted(one, leaf, state[leaf.name])
                if value is None:
                    return (1, leaf.name, -1, ()), dict(state)
                now[leaf.name] = value
    ready = [one.name for one in drawn.declared if one.until is not None and one.until.of(now, {})]
    now |= {name: now[f"{name}.next"] for name in ready}
    now |= {kept_line(table): 0 for table in drawn.staged}
    for at in drawn.before:
        drawn.procedures[at][2](now, [])
    failed: tuple[str, ...] = ()
    at = -1
    for place, (selector, numbers) in enumerate(drawn.stages):
        table = drawn.tables[numbers[0 if selector is None else int(now[selector.name])]]
        last = place == len(drawn.stages) - 1
        fault, about, at, here = matched(drawn, table, now)
        failed = tuple(name for name, _ in drawn.assumptions if name in {*failed, *here})
        if fault:
            return (fault, about if last or fault == 5 else table.name, -1, failed), now
        if not last:
            now[kept_line(table.name)] = at + 1
        for does in table.lines[at].does if at < len(table.lines) else table.default or ():
            does(now, {})
    for number in drawn.after:
        drawn.procedures[number][2](now, [])
    return (0, "", at, failed), now


def matched(drawn: Drawn, table: Table, now: State) -> tuple[int, str, int, tuple[str, ...]]:
    """The fault of a table at its place, what it is about, the line that matches, and the assumptions that fail."""
    failed = tuple(
        name for name, condition in drawn.assumptions if name in table.assuming and not condition.of(now, {})
    )
    stopped = [name for name in failed if name in table.stops]
    if stopped:
        return 5, stopped[0], -1, failed
    raw = {at for at, line in enumerate(table.lines) if all(cell.of(now, {}) for cell in line.when)}
    runs = [at for at in sorted(raw) if raw.isdisjoint(table.lines[at].upper)]
    if len(runs) > 1 or (not runs and table.default is None):
        return 3 if runs else 2, "", -1, failed
    return 0, "", runs[0] if runs else len(table.lines), failed


def seen(drawn: Drawn, fault: int, about: str, line: int, failed: tuple[str, ...], state: State) -> Seen:
    """The state after a cycle, in the form in which all are compared."""
    return Seen(fault, about, line, failed, tuple(bits(state[name]) for name, _ in order(drawn)))


# --- the others --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Built:
    """A drawn program as rcsc has it: model, symbols, emitted text."""

    drawn: Drawn
    program: Program
    symbols: Mapping[str, Any]
    files: Mapping[str, str]


def modelled(drawn: Drawn, name: str) -> Program | tuple[str, ...]:
    """The program in rcsc's model; the codes of what was refused."""
    program = compile_text("\n".join(drawn.text) + "\n", f"{name}.rcs")
    if not isinstance(program, Program):
        return tuple(d.code.value for d in program)
    stops = {table.name: tuple(map(AssumptionName, table.stops)) for table in drawn.tables}
    tables = tuple(replace(table, stops=stops.get(table.name, ())) for table in program.tables)
    return replace(program, tables=tables)


def built(drawn: Drawn, name: str) -> Built | tuple[str, ...]:
    """The program emitted; the codes of what was refused."""
    program = modelled(drawn, name)
    if not isinstance(program, Program):
        return program
    plan = lower(ProvedProgram(program, seal_of_proof()))
    files = emitted(plan)
    [symbols] = [json.loads(text) for path, text in files.items() if path.endswith(".json")]
    return Built(drawn, program, symbols, files)


def interpreted(drawn: Drawn, program: Program, state: State) -> tuple[Seen, State]:
    did = cycle(program, program.levels[0], state)
    now = dict(did.snapshot)
    shown = {**now, **lines_of(program, now)}
    return seen(drawn, int(did.fault), did.fault_at, did.line_index, did.failed_assumptions, shown), now


def lines_of(program: Program, state: Mapping[Any, Value]) -> State:
    """The lines that tables ran which others follow, by this evaluator's keys."""
    return {kept_line(table): state[leaf] for table, leaf in program.line_leaves.items()}


class InPython:
    def __init__(self, one: Built) -> None:
        self.one = one
        [text] = [text for path, text in one.files.items() if path.endswith(".py")]
        module = ModuleType("drawn")
        exec(compile(text, "drawn.py", "exec"), module.__dict__)  # noqa: S102  # it is what is tested
        self.state = module.State()
        self.cycle = module.__dict__[
            one.symbols["levels"][0]["cycle"].removeprefix(f"{one.symbols['program']}_")
        ]
        self.names = {leaf["name"]: leaf["attribute"] for leaf in one.symbols["leaves"]}

    def run(self, inputs: State) -> Seen:
        for name, value in inputs.items():
            setattr(self.state, self.names[name], value)
        fault = self.cycle(self.state)
        state = {name: getattr(self.state, attribute) for name, attribute in self.names.items()}
        return traced(
            self.one, fault, self.state.fault_at, self.state.line, self.state.assumptions_failed, state
        )


def traced(one: Built, fault: int, at: int, line: int, failed: int, state: State) -> Seen:
    """The trace of an executor in names."""
    checked = one.symbols["monitored"]
    about = one.symbols["leaves"][at]["name"] if fault == 1 else checked[at] if fault == 5 else ""
    if fault in (2, 3) and at >= 0:
        about = str([*one.program.line_leaves][at])
    names = tuple(name for bit, name in enumerate(checked) if failed >> bit & 1)
    return seen(one.drawn, fault, about, line, names, {**state, **lines_of(one.program, state)})


def driver_c(one: Built) -> Iterator[str]:
    """C that takes inputs as words and gives trace and leaves as words."""
    p, inputs = one.symbols["program"], [leaf for leaf in one.symbols["leaves"] if leaf["kind"] == "input"]
    yield f"static {p}_t {p}_state; void {p}_reset(void) {{ {p}_init(&{p}_state); }}"
    yield f"void {p}_go(const int64_t *in, int64_t *out) {{ {p}_t *s = &{p}_state; double x;"
    for at, leaf in enumerate(inputs):
        real = leaf["c_type"] in IN_C
        yield (
            f"memcpy(&x, &in[{at}], 8); s->{leaf['path']} = ({leaf['c_type']})x;"
            if real
            else f"s->{leaf['path']} = ({leaf['c_type']})in[{at}];"
        )
    yield f"out[0] = {one.symbols['levels'][0]['cycle']}(s); out[1] = s->fault_at; out[2] = s->line;"
    yield "out[3] = (int64_t)s->assumptions_failed;"
    for at, leaf in enumerate(one.symbols["leaves"], 4):
        real = leaf["c_type"] in IN_C
        yield (
            f"x = s->{leaf['path']} ; memcpy(&out[{at}], &x, 8);"
            if real
            else f"out[{at}] = (int64_t)s->{leaf['path']};"
        )
    yield "}"


def library(programs: Sequence[Built], folder: Path, *flags: str, cc: str = "cc") -> ctypes.CDLL:
    """The C of several programs and their drivers in one shared library."""
    texts = ["#include <stdint.h>\n#include <stdbool.h>\n#include <string.h>\n"]
    for program in programs:
        for path, text in program.files.items():
            if path.endswith(".h"):
                (folder / Path(path).name).write_text(text)
        texts += [text for path, text in program.files.items() if path.endswith(".c")]
        texts += driver_c(program)
    (folder / "all.c").write_text("\n".join(texts))
    subprocess.run([cc, *FLAGS, *flags, "all.c", "-o", "all.so"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "all.so"))


class InC:
    def __init__(self, one: Built, made: ctypes.CDLL) -> None:
        self.one, p = one, one.symbols["program"]
        getattr(made, f"{p}_reset")()
        self.go = getattr(made, f"{p}_go")
        self.inputs = [leaf["name"] for leaf in one.symbols["leaves"] if leaf["kind"] == "input"]

    def run(self, inputs: State) -> Seen:
        given = array("q", [word(inputs[name]) for name in self.inputs] or [0])
        found = array("q", bytes(8 * (4 + len(self.one.symbols["leaves"]))))
        self.go(*(ctypes.c_void_p(one.buffer_info()[0]) for one in (given, found)))
        state: State = {}
        for value, leaf in zip(found[4:], self.one.symbols["leaves"], strict=True):
            state[leaf["name"]] = struct.unpack("<d", struct.pack("<q", value))[0] if leaf["c_type"] in IN_C else (
                value & U64 if leaf["c_type"] == "uint64_t" else value)  # fmt: skip
        fault, at, line, failed = found[:4]
        return traced(self.one, fault, at, line, failed, state)


def word(value: Value) -> int:
    """A value as a signed word."""
    if isinstance(value, float):
        found: int = struct.unpack("<q", struct.pack("<d", value))[0]
        return found
    return int(value) - 2**64 if int(value) > I64 else int(value)


HELD = {"uint8_t": (0, 255), "int8_t": (-128, 127), "uint16_t": (0, 65535), "int16_t": (-32768, 32767), "uint32_t": (0, 2**32 - 1),
        "int32_t": (-(2**31), 2**31 - 1), "uint64_t": (0, U64), "int64_t": (-I64 - 1, I64)}  # fmt: skip


def readings(drawn: Drawn, held: Mapping[str, tuple[int, int]], rng: random.Random) -> State:
    """A value for every input: in its range more often than not, else between what is given of a leaf that is no real."""
    maker, given = Maker(rng), dict[str, Value]()
    for leaf in drawn.leaves("input"):
        value = maker.value(leaf.kind)
        if rng.randrange(12) == 0 and leaf.kind.sort != "bool":
            if leaf.kind.sort in REALS:
                low, high = leaf.kind.low, leaf.kind.high
                below = math.nextafter(low, -math.inf)
                if leaf.kind.sort == "single":  # or one a little farther below
                    below = to_single(low - abs(low) * 2.0**-23 - 2.0**-149)
                value = rng.choice((math.nan, math.inf, -math.inf, -0.0, high * 2, below))
            else:
                least_held, most_held = held[leaf.name]
                near = max(least_held, int(leaf.kind.low) - 1), min(most_held, int(leaf.kind.high) + 1)
                value = rng.choice((least_held, most_held, *near))
        given[leaf.name] = value
    return given


# --- campaigns ---------------------------------------------------------------------------------


def compare(one: Built, made: ctypes.CDLL, rng: random.Random, count: Counter[str]) -> None:
    """Some cycles of one program; AssertionError where two of the four differ."""
    state, state_of_model = begun(one.drawn), dict(initial(one.program))
    python, in_c = InPython(one), InC(one, made)
    held = {leaf["name"]: HELD.get(leaf["c_type"], (0, 0)) for leaf in one.symbols["leaves"]}
    inputs: State = {}
    for number in range(CYCLES):
        if not number or rng.randrange(3):
            inputs = readings(one.drawn, held, rng)
        right, state = evaluated(one.drawn, {**state, **inputs})
        other, state_of_model = interpreted(one.drawn, one.program, {**state_of_model, **inputs})
        for who, found in (("interpreter", other), ("Python", python.run(inputs)), ("C", in_c.run(inputs))):
            assert found == right, difference(one, who, number, inputs, found, right)
        count[f"fault {right.fault}"] += 1
        count["assumption failed"] += bool(right.failed)


def difference(one: Built, who: str, number: int, inputs: State, found: Seen, right: Seen) -> str:
    """What differs, with the program."""
    leaves = [
        (name, a, b)
        for (name, _), a, b in zip(order(one.drawn), found.values, right.values, strict=True)
        if a != b
    ]
    trace = [(a, b) for a, b in ((replace(found, values=()), replace(right, values=())),) if a != b]
    return f"{who}, cycle {number}: {trace} {leaves}\ninputs {inputs}\n" + "\n".join(one.drawn.text)


def build_of(batch: int) -> Sequence[str]:
    """The compiler of a batch, with its options; `cc -O0` where the chosen one is not installed."""
    chosen = BUILDS.get(batch % ROUND, TINY)
    return chosen if shutil.which(chosen[0]) else BUILDS[0]


def compared(begin: int, end: int, seed: int, told: Counter[str]) -> Iterator[str]:
    """Draws the programs `begin` to `end` - 1 and compares them; one text for each that is not the same to all."""
    batch = {}
    for number in range(begin, end):
        one = built(Maker(random.Random(f"{seed} {number}")).draw(), f"p{number}")
        if isinstance(one, Built):
            batch[number] = one
            told["programs"] += 1
        else:
            told[f"refused {' '.join(sorted(set(one)))}"] += 1
    build = build_of(begin // BATCH)
    told[f"compiled by {build[0]}"] += len(batch)
    for number, differs in differing(batch, seed, build, told):
        if build == TINY and not [*differing({number: batch[number]}, seed, BUILDS[0], Counter())]:
            told["tcc is wrong"] += 1  # it gets some conditions with constants wrong
        else:
            yield f"program {number} of seed {seed}, C by {' '.join(build)}: {differs}"


def differing(
    batch: Mapping[int, Built], seed: int, build: Sequence[str], told: Counter[str]
) -> Iterator[tuple[int, str]]:
    """The programs on which two of the four differ where this compiler makes the C, and how."""
    cc, *flags = build
    with tempfile.TemporaryDirectory(prefix="rcsc-differential-") as place:
        made = library([*batch.values()], Path(place), *flags, cc=cc)
        left = [*batch.items()]
        while left:
            judged = [*_in_child(left, made, seed)]
            for (number, _), (bug, counted) in zip(left, judged, strict=False):
                told.update(counted)
                if bug:
                    yield number, bug
            left = left[len(judged) :]


def _in_child(
    left: Sequence[tuple[int, Built]], made: ctypes.CDLL, seed: int
) -> Iterator[tuple[str, Counter[str]]]:
    """What is wrong with each of some programs, empty if nothing, up to the first that does not end.

    A compiler can make a loop without end of what has one. Nothing in this process can end it, so the cycles run in another.
    """
    fork = get_context("fork")
    here, there = fork.Pipe(duplex=False)
    child = fork.Process(target=_judge, args=(left, made, seed, there))
    child.start()
    there.close()
    answers = 0
    with here:
        while True:
            try:
                yield here.recv()
            except EOFError:
                break
            answers += 1
    child.join()
    if answers < len(left):
        yield (
            f"ended by signal {-(child.exitcode or 0)}, within {LONGEST_CPU_S} s of processor time",
            Counter(),
        )


def _judge(left: Sequence[tuple[int, Built]], made: ctypes.CDLL, seed: int, answers: Connection) -> None:
    """Compares each of some programs, and says so; ended by SIGVTALRM where one takes too long."""
    for number, one in left:
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_CPU_S)
        told: Counter[str] = Counter()
        bug = ""
        try:
            compare(one, made, random.Random(f"{seed} {number} inputs"), told)
        except Exception as raised:  # noqa: BLE001  # an executor may raise anything, which is a difference
            bug = f"{type(raised).__name__}: {raised}"
        answers.send((bug, told))


def campaign(count: int, seed: int) -> Counter[str]:
    """Draws `count` programs and compares them; how many cycles ended how, and how many texts were refused.

    Raises:
        AssertionError: A program is not the same to all.
    """
    told: Counter[str] = Counter()
    for begin in range(0, count, BATCH):
        for differs in compared(begin, min(begin + BATCH, count), seed, told):
            raise AssertionError(differs)
    return told


def main() -> int:
    """Runs a long comparison with a line of progress now and then; status 1 where any program differs."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=10_000)
    arguments.add_argument("--first", type=int, default=0, help="the number of the first program")
    arguments.add_argument("--seed", type=int, default=1)
    given = arguments.parse_args()
    gc.freeze()
    gc.set_threshold(200_000)  # what is drawn has few cycles: a fifth of the time went into looking for them
    told: Counter[str] = Counter()
    last = given.first + given.count
    for begin in range(given.first, last, BATCH):
        end = min(begin + BATCH, last)
        for differs in compared(begin, end, given.seed, told):
            told["different"] += 1
            print(differs, flush=True)
        if (end - given.first) % (BATCH * 20) == 0 or end == last:
            print(f"{end - given.first} of {given.count} drawn, {told['different']} different", flush=True)
    for name, number in sorted(told.items()):
        print(f"{name:24} {number:9}")
    return int(told["different"] > 0)


if __name__ == "__main__":
    sys.exit(main())
