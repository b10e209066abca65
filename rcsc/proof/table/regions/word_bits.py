"""Tables that look at bits of words, as boxes: a word is split into parts, each an axis of its own.

In: a table, some of whose tests are made of fields and masks of a word. Out: for each such word its parts, from the greatest
bits down, and every test as a box of parts. For `x0xx 1010` and `x1xx xxxx` a byte has eight parts of one bit; bits that a
condition looks at together, as in a list of masks or `word[3..0] < 5`, stay together. Every value of the word is one
choice of a value for each part, and the order of values is the order of such choices: so what is counted of parts, and the
least of them, is what it is of words. A word whose range is not that of all its bits has no parts.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from rcsc.lang.expressions.conditions import box_of
from rcsc.lang.expressions.words import Field, Mask, cut, field_of, mask_of
from rcsc.lang.interval_sets import joined, meet
from rcsc.lang.leaves import conjuncts, operands, rebuilt
from rcsc.lang.leaves import parts as every_part
from rcsc.lang.model import (
    Apply,
    Box,
    Expr,
    Int,
    Kind,
    Literal,
    Op,
    Program,
    Read,
    Scalar,
    Select,
    Table,
    Test,
    Variable,
    VariableName,
    key_bounds,
)

MOST_TOGETHER = 12
"""Bits of one part: what a condition says of them is tried for each value."""


@dataclass(frozen=True, slots=True)
class Part:
    """Bits `high .. low` of a leaf."""

    leaf: str
    high: int
    low: int

    @property
    def name(self) -> str:
        """The name as a field is written; a single bit has both ends, too, as no array element has."""
        return f"{self.leaf}[{self.high}..{self.low}]"

    @property
    def bits(self) -> int:
        """The number of bits."""
        return self.high - self.low + 1

    @property
    def kind(self) -> Int:
        """The type of the bits as a number."""
        return Int(0, (1 << self.bits) - 1)

    @property
    def ones(self) -> int:
        """The mask with ones at these bits and nowhere else."""
        return ((1 << self.bits) - 1) << self.low

    def of(self, leaf: Variable) -> Expr:
        """Return the bits as a number, computed from the whole word."""
        number: Expr = Read(leaf.name, leaf.type)
        return cut(number, self.bits, self.low, key_bounds(leaf.type)[1])

    @classmethod
    def named(cls, name: str) -> "Part | None":
        """Return the part with this name; None for a leaf."""
        leaf, bracket, ends = name.rpartition("[")
        high, dots, low = ends.removesuffix("]").partition("..")
        return cls(leaf, int(high), int(low)) if bracket and dots else None


Words = Mapping[str, tuple[Part, ...]]
"""For each word that is split its parts, the greatest bits first."""


def kind_of(kinds: Mapping[str, Scalar], name: str) -> Scalar:
    """Return the kind of a leaf or of a part."""
    part = None if name in kinds else Part.named(name)
    return kinds[name] if part is None else part.kind


def words_of(program: Program, table: Table) -> Words | None:
    """Return the words that the table's tests take apart; None where some test is no box of leaves or parts."""
    kinds: dict[str, Scalar] = program.kinds
    tests = table.distinct_tests
    looked_at: dict[str, list[Test]] = {}
    for test in tests:
        looked_at.setdefault(str(test.variables[0]), []).append(test)
    words = {leaf: _parts(leaf, kinds[leaf], of_leaf) for leaf, of_leaf in looked_at.items()}
    split = {leaf: parts for leaf, parts in words.items() if len(parts) > 1}
    for test in tests:
        parts = split.get(str(test.variables[0]))
        if parts is not None and boxes_of(test, parts) is None:
            if any(other.box is None for other in looked_at[str(test.variables[0])]):
                return None
            del split[str(test.variables[0])]
    whole = (test for test in tests if str(test.variables[0]) not in split)
    return split if all(test.box is not None for test in whole) else None


def boxes_of(test: Test, parts: Sequence[Part]) -> dict[str, Box] | None:
    """Return the test of a split word as boxes of its parts; None where it is none."""
    boxes: dict[str, Box] = {}
    for condition in conjuncts(test.condition):
        mask = _mask(condition)
        named = _of_mask(mask, parts) if mask is not None else _of_condition(condition, parts)
        if named is None:
            return None
        for name, box in named.items():
            boxes[name] = meet(boxes[name], box) if name in boxes else box
    return boxes


def mask_text(parts: Sequence[Part], region: Mapping[str, Box], high: int, low: int) -> str | None:
    """Spell the region as a mask of bits `high .. low`; None where no mask says it."""
    digits = ["x"] * (high + 1)
    for part in parts:
        box = region.get(part.name)
        cube = None if box is None else _cube(box, part.bits)
        if box is not None and cube is None:
            return None
        care, value = cube or (0, 0)
        for place in range(part.bits):
            if care >> place & 1:
                if not low <= part.low + place <= high:
                    return None
                digits[part.low + place] = str(value >> place & 1)
    return "".join(reversed(digits[low:]))


def _cube(box: Box, bits: int) -> tuple[int, int] | None:
    """Return the bits on which all keys agree, and their values; None where further keys match these, too."""
    keys = [key for first, last in box for key in range(first, last + 1)]
    alike = (1 << bits) - 1
    for key in keys:
        alike &= ~(key ^ keys[0])
    return (alike, keys[0] & alike) if len(keys) == 1 << bits - alike.bit_count() else None


# --- how a word is split ---------------------------------------------------------------


def _parts(leaf: str, kind: Scalar, tests: Sequence[Test]) -> tuple[Part, ...]:
    """Return the parts into which tests split a word; none where the tests are not about its bits."""
    if not isinstance(kind, Int) or kind.low != 0 or kind.unit or (kind.high + 1).bit_count() != 1:
        return ()
    width = max(kind.high.bit_length(), 1)
    together = []
    for test in tests:
        if len(test.variables) != 1 or any(isinstance(part, Select) for part in every_part(test.condition)):
            return ()
        for condition in conjuncts(test.condition):
            if _mask(condition) is None:
                fields = list(_fields(condition))
                if not fields:
                    return ()
                together.append((max(part.high for part in fields), min(part.low for part in fields)))
    cuts = [at for at in range(width + 1) if not any(low < at <= high for high, low in together)]
    parts = tuple(Part(leaf, high - 1, low) for low, high in pairwise(cuts))[::-1]
    return parts if all(part.bits <= MOST_TOGETHER for part in parts) else ()


def _mask(condition: Expr) -> Mask | None:
    """Return the mask that a condition states, also for a word compared as a whole; None for any other."""
    match condition:
        case Apply(op=Op.EQ, args=(Read(type=Int()) as word, Literal(value=value))):
            part = field_of(word)
            return None if part is None else Mask(word, (2 << part.high) - 1, int(value))
    return mask_of(condition)


def _fields(condition: Expr) -> Iterator[Field]:
    part = field_of(condition)
    if part is not None:
        yield part
    else:
        for inner in operands(condition):
            yield from _fields(inner)


def _of_mask(mask: Mask, parts: Sequence[Part]) -> dict[str, Box]:
    """Return the mask as boxes of the parts that it looks at."""
    boxes = {}
    for part in parts:
        care = (mask.care & part.ones) >> part.low
        if care:
            value = (mask.value & part.ones) >> part.low
            keys = (key for key in range(1 << part.bits) if key & care == value)
            boxes[part.name] = joined((key, key) for key in keys)
    return boxes


def _of_condition(condition: Expr, parts: Sequence[Part]) -> dict[str, Box] | None:
    """Return a condition on one part as the box of that part; None where it is none."""
    fields = list(_fields(condition))
    [part] = [part for part in parts if part.low <= fields[0].low <= part.high]
    axis = Variable(VariableName(part.name), Kind.INPUT, part.kind, 0)
    box = box_of(_within(condition, part), axis)
    return None if box is None else {part.name: box}


def _within(condition: Expr, part: Part) -> Expr:
    """Return the condition with the part in place of its word."""
    field = field_of(condition)
    if field is None:
        return rebuilt(condition, lambda operand: _within(operand, part))
    number: Expr = Read(VariableName(part.name), part.kind)
    return cut(number, field.high - field.low + 1, field.low - part.low, part.kind.high)
