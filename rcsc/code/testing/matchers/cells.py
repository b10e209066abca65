"""Compares what a compiled matcher looks up with the cells of the table: classes of leaves, truths of conditions, masks.

In: the parts of a matcher and its compiled self-test. Out: how many cells were compared, and what differs.
"""

import ctypes
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import prod
from random import Random

from rcsc.code.testing.executors.edges import companions, leaf_edges, may_be_matched, relational_tests
from rcsc.code.testing.executors.native import to_word
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.matchers.matcher_text import (
    EVERY_KEY,
    Component,
    Lookup,
    MatcherText,
)
from rcsc.lang.interval_sets import meet
from rcsc.lang.model import (
    Box,
    Program,
    Real,
    Scalar,
    Single,
    Table,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import single

ROWS = 400


@dataclass(frozen=True, slots=True)
class Checked:
    """What was compared.

    Attributes:
        cells: Bits of the tables' entries.
        classes: Values of leaves whose class was found.
        truths: Conditions over several variables, compared on edges.
        masks: Masks given to the tail.
        tables: The numbers that were compared; they tell what another number would change.
    """

    cells: int
    classes: int
    truths: int
    masks: int
    tables: "tuple[Compared, ...]" = field(default=(), repr=False)


@dataclass(frozen=True, slots=True)
class Compared:
    """One mask table of the C that equals its cells, with all that decides so.

    Attributes:
        everyone: A mask with every line.
        width: Words a mask.
        entries: The masks.
        counts: How many classes each component of the index has.
        ways: For each component the lines that each of its classes stands for.
        classes: For each component that reads a leaf: its class and the lines that admit it, key by key.
    """

    everyone: int
    width: int
    entries: Sequence[int]
    counts: Sequence[int]
    ways: Sequence[Mapping[int, int]]
    classes: Sequence[Sequence[tuple[int, int]]]

    @property
    def words(self) -> list[int]:
        """The masks word by word, as C lays them out."""
        shifts = range(0, 64 * self.width, 64)
        return [entry >> shift & 0xFFFF_FFFF_FFFF_FFFF for entry in self.entries for shift in shifts]

    def with_word(self, at: int, value: int) -> bool:
        """Whether the table would still be equal with another value of word `at`, counted as C lays them out."""
        entry, shift = at // self.width, 64 * (at % self.width)
        changed = list(self.entries)
        changed[entry] = changed[entry] & ~(0xFFFF_FFFF_FFFF_FFFF << shift) | value << shift
        return agrees(changed, self.counts, self.ways, self.everyone) is not None

    def with_class(self, component: int, at: int, value: int) -> bool:
        """Whether the table would still be equal if key number `at` of the component's leaf had another class."""
        changed = list(self.classes[component])
        changed[at] = (value, changed[at][1])
        lines = lines_of(changed)
        ways = [*self.ways[:component], lines or {}, *self.ways[component + 1 :]]
        return lines is not None and agrees(self.entries, self.counts, ways, self.everyone) is not None


def lines_of(classes: Sequence[tuple[int, int]]) -> dict[int, int] | None:
    """For each class the lines that admit it; None if one class is of values that different lines admit."""
    expected: dict[int, int] = {}
    if any(expected.setdefault(at, cells) != cells for at, cells in classes):
        return None
    return expected


def agrees(
    entries: Sequence[int], counts: Sequence[int], ways: Sequence[Mapping[int, int]], everyone: int
) -> int | None:
    """Compares every entry that some input finds with the AND of its classes' cells.

    Returns:
        How many entries were compared; None if an entry differs, or lies outside the table.
    """
    compared = 0
    for classes in product(*(expected.items() for expected in ways)):
        at, cells = 0, everyone
        for (number, lines), count in zip(classes, counts, strict=True):
            if number >= count:
                return None
            at, cells = at * count + number, cells & lines
        if entries[at] != cells:
            return None
        compared += 1
    return compared


def _written_key(kind: Scalar, text: str) -> int:
    """The key of a number as C spells it."""
    if not isinstance(kind, Real):
        return int(text)
    return key_of(kind, single(float(text)) if isinstance(kind, Single) else float(text))


@dataclass(frozen=True, slots=True)
class Way:
    """What one component may stand for: a leaf (test -1), or a test; and the lines that admit each class."""

    test: int
    lines: Mapping[int, int] = field(hash=False)


@dataclass(slots=True)
class Checker:
    """Checks a matcher that joins masks of all lines.

    Attributes:
        parts: Of its text; `library` of the compiled self-test.
        wrong: What differs, in words.
        stated: Conditions over several variables that some look-up stands for.
        truths: Of each of them what it gives on edges.
    """

    program: Program
    symbols: Symbols
    table: Table
    parts: MatcherText
    library: ctypes.CDLL
    wrong: list[str] = field(default_factory=list)
    classes: int = 0
    cells: int = 0
    stated: set[int] = field(default_factory=set)
    truths: dict[int, list[int]] = field(default_factory=dict)
    tables: list[Compared] = field(default_factory=list)

    @property
    def everyone(self) -> int:
        """A mask with every line."""
        return (1 << len(self.table.lines)) - 1

    def leaf(self, path: str) -> Variable:
        """The leaf at a place of the struct."""
        return next(v for v in self.program.variables if self.symbols.path(v.name) == path)

    def run(self, function: str, count: int, given: "array[int]") -> "array[int]":
        """Calls a function of the self-test that maps rows of words to classes."""
        classes = array("I", bytes(4 * count))
        pointers = [ctypes.c_void_p(words.buffer_info()[0]) for words in (given, classes)]
        getattr(self.library, function)(ctypes.c_int64(count), *pointers)
        return classes

    def boxes(self, leaf: Variable) -> Iterator[tuple[int, Box]]:
        """For each line that states the leaf, its bit and the keys it admits."""
        for at, line in enumerate(self.table.lines):
            stated = [t.box for t in line.tests if t and t.box is not None and t.variables[0] == leaf.name]
            if stated:
                box = stated[0]
                for other in stated[1:]:
                    box = meet(box, other)
                yield 1 << at, box

    def cells_at(self, leaf: Variable, keys: Sequence[int]) -> list[int]:
        """For each key (ascending) the lines whose cells for the leaf admit it."""
        on: dict[int, int] = {}
        off: dict[int, int] = {}
        now = self.everyone
        for bit, box in self.boxes(leaf):
            now &= ~bit
            for low, high in box:
                on[low] = on.get(low, 0) | bit
                off[high + 1] = off.get(high + 1, 0) | bit
        turns = sorted(on.keys() | off.keys())
        cells, place = [], 0
        for key in keys:
            while place < len(turns) and turns[place] <= key:
                now = now & ~off.get(turns[place], 0) | on.get(turns[place], 0)
                place += 1
            cells.append(now)
        return cells

    def keys(self, leaf: Variable, part: Component) -> list[int]:
        """The keys at which the class is found; see the module."""
        low, high = key_bounds(leaf.type)
        if high - low < EVERY_KEY and not isinstance(leaf.type, Real):
            return list(range(low, high + 1))
        named = {end for _, box in self.boxes(leaf) for ends in box for end in ends}
        for text in part.constants:
            number = _written_key(leaf.type, text)
            named |= {number, -number}
        near = {key + step for key in named for step in (-1, 0, 1)} | {low, high}
        return sorted(key for key in near if low <= key <= high)

    def unary(self, name: str, part: Component) -> list[tuple[int, int]]:
        """For each key of a leaf its class and the lines that admit it."""
        leaf = self.leaf(part.path)
        keys = self.keys(leaf, part)
        words = array("q", [to_word(leaf.type, value_of_key(leaf.type, key)) for key in keys])
        classes = self.run(name, len(keys), words)
        self.classes += len(keys)
        pairs = list(zip(classes, self.cells_at(leaf, keys), strict=True))
        expected: dict[int, int] = {}
        for key, (at, cells) in zip(keys, pairs, strict=True):
            if expected.setdefault(at, cells) != cells:
                value = value_of_key(leaf.type, key)
                self.wrong.append(f"`{leaf.name}` = {value} shares its class with a value of other lines")
        return pairs

    def truth(self, name: str, rows: "array[int]", count: int) -> "list[Way]":
        """For each truth of a condition the lines that admit it; once for each test that agrees."""
        seen = list(self.run(name, count, rows))
        agreeing = [at for at, truths in self.truths.items() if truths == seen]
        if not agreeing:
            self.wrong.append(f"the condition of `{name}` is none of the table's tests")
        tests = relational_tests(self.table)
        agreeing.sort(key=lambda at: at in self.stated)
        return [Way(at, {1: self.everyone, 0: self.everyone & ~self.stating(tests[at])}) for at in agreeing]

    def stating(self, test: object) -> int:
        """The lines that state a test."""
        same = [any(t is not None and t == test for t in line.tests) for line in self.table.lines]
        return sum(1 << at for at, states in enumerate(same) if states)

    def entries(self, number: int, lookup: Lookup) -> list[int]:
        """A table's entries, as the compiled C has them."""
        words = array("Q", bytes(8 * lookup.entries * lookup.words))
        getattr(self.library, f"rcsc_masks_{number}")(ctypes.c_void_p(words.buffer_info()[0]))
        width = lookup.words
        return [
            sum(word << (64 * at) for at, word in enumerate(words[start : start + width]))
            for start in range(0, len(words), width)
        ]

    def lookup(self, number: int, lookup: Lookup, rows: "array[int]", count: int) -> None:
        """Compares one table with the cells of its classes."""
        ways: list[list[Way]] = []
        classes: list[list[tuple[int, int]]] = []
        for at, part in enumerate(lookup.components):
            name = f"rcsc_class_{number}_{at}"
            classes.append(self.unary(name, part) if part.path else [])
            ways.append([Way(-1, dict(classes[-1]))] if part.path else self.truth(name, rows, count))
        counts = [part.count for part in lookup.components]
        counts[0] = lookup.entries // max(1, prod(counts[1:]))
        entries = self.entries(number, lookup)
        for chosen in product(*ways):
            lines = [way.lines for way in chosen]
            compared = agrees(entries, counts, lines, self.everyone)
            if compared is not None:
                self.stated |= {way.test for way in chosen}
                self.cells += compared * len(self.table.lines)
                self.tables.append(Compared(self.everyone, lookup.words, entries, counts, lines, classes))
                break
        else:
            self.wrong.append(f"table t{number} of the matcher has an entry that is not its cells")
        self.mixed(number, lookup, counts, rows, count)

    def mixed(
        self, number: int, lookup: Lookup, counts: Sequence[int], rows: "array[int]", count: int
    ) -> None:
        """Compares the whole index with its components, on edges."""
        whole = self.run(f"rcsc_index_{number}", count, rows)
        parts = [
            self.run(f"rcsc_class_{number}_{at}", count, rows)
            if not part.path
            else self.run(f"rcsc_class_{number}_{at}", count, self.column(part, rows))
            for at, part in enumerate(lookup.components)
        ]
        for at, index in enumerate(whole):
            right = 0
            for classes, radix in zip(parts, counts, strict=True):
                right = right * radix + classes[at]
            if index != right:
                self.wrong.append(f"the index of table t{number} is not its classes in mixed radix")
                return

    def column(self, part: Component, rows: "array[int]") -> "array[int]":
        """One leaf's words from rows of complete states."""
        names = [self.symbols.path(v.name) for v in self.program.variables]
        return rows[names.index(part.path) :: len(names)]

    def tail(self) -> int:
        """Runs the tail; returns how many masks it was given."""
        wrong = ctypes.c_uint64()
        self.library.rcsc_tail_test.restype = ctypes.c_uint64
        tried: int = self.library.rcsc_tail_test(ctypes.byref(wrong))
        if wrong.value:
            self.wrong.append(f"{wrong.value} masks lead to a wrong line")
        return tried

    def all(self) -> Checked:
        """Everything."""
        rows, count = edge_rows(self.program, self.table, ROWS)
        tests = relational_tests(self.table)
        self.truths = {at: list(self.run(f"rcsc_test_{at}", count, rows)) for at, _ in enumerate(tests)}
        for number, lookup in enumerate(self.parts.lookups):
            self.lookup(number, lookup, rows, count)
        self.everything_stated()
        return Checked(self.cells, self.classes, len(tests), self.tail(), tuple(self.tables))

    def everything_stated(self) -> None:
        """Whether each leaf and each test that lines state has its place in some look-up."""
        used = {part.path for lookup in self.parts.lookups for part in lookup.components}
        for name in self.table.variables:
            leaf = self.program.variable(name)
            states = any(box != (key_bounds(leaf.type),) for _, box in self.boxes(leaf))
            if states and self.symbols.path(name) not in used:
                self.wrong.append(f"no table of the matcher looks at `{name}`")
        for at, test in enumerate(relational_tests(self.table)):
            if at not in self.stated:
                self.wrong.append(f"no table of the matcher looks at `{test.text}`")


def edge_rows(program: Program, table: Table, count: int) -> tuple["array[int]", int]:
    """Complete states on edges, as words; half of the leaves beside what they are compared with.

    Those in which the table's conditions may be undefined are left out.
    """
    random = Random(1984)  # noqa: S311  # repeatable
    edges, near = leaf_edges(program), companions(program)
    rows, kept = array("q"), 0
    for _ in range(count):
        keys = {str(v.name): random.choice(edges[v.name]) for v in program.variables}
        for variable in program.variables:
            others = near.get(variable.name, ())
            if others and random.getrandbits(1):
                low, high = key_bounds(variable.type)
                beside = keys[random.choice(others)] + random.choice((-1, 0, 1))
                keys[variable.name] = min(high, max(low, beside))
        state = {str(v.name): value_of_key(v.type, keys[v.name]) for v in program.variables}
        if may_be_matched(program, table, state):
            kept += 1
            rows.extend(to_word(v.type, state[v.name]) for v in program.variables)
    return rows, kept
