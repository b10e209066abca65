"""Bits of words: fields, masks, `&`, `|` and shifts by constants, made of quotients and remainders by powers of two.

In: a typed whole number that is never negative. Out: arithmetic that every later stage knows. A *word* has the bits of the
greatest value of its type, numbered from 0, the least: `int 0 .. 65535` has 15 down to 0. Bits 5 and 4 of `w` are
`w / 16 mod 4`; `w & 0b11_0000` is those, times 16; `w | 0b1` is the other bits of `w`, and 1. A mask is a conjunction, one
test a bit, so that two masks of one word speak of the same things, however their bits are grouped. Later stages find fields
(`field_of`) and masks (`mask_of`) in such arithmetic again, whoever wrote it: proofs count over bits, C tests a mask at once.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as field_
from functools import reduce

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.operators import Typed, applied, kind_word
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.interpret import fold
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Among, Apply, Bool, Expr, Int, Literal, Read, ReadLocal, Scalar, Select, Value
from rcsc.lang.operator_table import Arithmetic, Op, is_comparison

MOST_BITS = 64
NARROWER = "head the column by a part, as `WORD[7..0]`, or write `x` for the other bits"


@dataclass(frozen=True, slots=True)
class Field:
    """Bits `high .. low` of a word."""

    word: Expr
    high: int
    low: int

    @property
    def whole(self) -> bool:
        """True where these are all bits of the word."""
        return self.low == 0 and self.high == bits_of(self.word) - 1


@dataclass(frozen=True, slots=True)
class Mask:
    """The condition that a word has `value` where `care` has ones."""

    word: Expr
    care: int
    value: int


def field_of(number: Expr) -> Field | None:
    """Return the field of a variable, element or local that the number is; None for any other number."""
    match number:
        case Read() | ReadLocal() | Select() if isinstance(number.type, Int) and number.type.low >= 0:
            return Field(number, bits_of(number) - 1, 0)
        case Apply(op=Op.DIV | Op.MOD as op, args=(inner, Literal(value=by))) if _is_power(inner, by):
            part, places = field_of(inner), int(by).bit_length() - 1
            if part is None or (op is Op.DIV and part.low + places > part.high):
                return None
            if op is Op.DIV:
                return Field(part.word, part.high, part.low + places)
            return Field(part.word, min(part.high, part.low + places - 1), part.low)
    return None


def mask_of(condition: Expr) -> Mask | None:
    """Return the mask that the condition states; None where it states none, or compares a word as a whole."""
    match condition:
        case Apply(op=Op.AND, args=(left, right)):
            return _both(mask_of(left), mask_of(right))
        case Apply(op=Op.NOT, args=(inner,)) if isinstance(inner, Apply):
            return _opposite(mask_of(inner))
        case Apply(op=Op.EQ | Op.NE as op, args=(inner, Literal(value=value, type=Bool()))) if isinstance(
            inner, Apply
        ):
            mask = mask_of(inner)
            return mask if bool(value) is (op is Op.EQ) else _opposite(mask)
        case Apply(op=Op.EQ | Op.NE as op, args=(number, Literal(value=value, type=Int()))):
            part = field_of(number)
            if part is None or part.whole or not 0 <= value < 2 << part.high - part.low:
                return None
            care = (2 << part.high - part.low) - 1
            mask = Mask(part.word, care << part.low, int(value) << part.low)
            return mask if op is Op.EQ else _opposite(mask)
    return None


def _both(left: Mask | None, right: Mask | None) -> Mask | None:
    """Return the mask of both; None where they are about two words, or contradict each other."""
    if left is None or right is None or left.word != right.word:
        return None
    if (left.value ^ right.value) & left.care & right.care:
        return None
    return Mask(left.word, left.care | right.care, left.value | right.value)


def _opposite(mask: Mask | None) -> Mask | None:
    """Return the mask that holds where this one does not; None where it has more than one bit."""
    if mask is None or mask.care.bit_count() != 1:
        return None
    return replace(mask, value=mask.value ^ mask.care)


WIDE = 16
"""Bits of a word above which it pays to know it by its bits."""


def bits_alone(conditions: Iterable[Expr], kinds: Mapping[str, Scalar]) -> dict[str, int]:
    """Return the wide words that the conditions read by fields, masks and comparisons alone, and their widths.

    Empty where no condition reads bits of any: integers serve as well then.
    """
    wide = {
        name: kind.high.bit_length()
        for name, kind in kinds.items()
        if isinstance(kind, Int) and kind.low >= 0 and kind.high.bit_length() > WIDE
    }
    uses, read = _Uses(), set[str]()
    for condition in conditions if wide else ():
        uses.see(condition)
        read.update(map(str, read_by(condition)))
    if uses.split.isdisjoint(wide):
        return {}
    other = uses.calculated | (uses.split | {name for pair in uses.pairs for name in pair}) - wide.keys()
    more = True
    while more:  # what is compared with a number is one
        met = {name for pair in uses.pairs if other & set(pair) for name in pair}
        more = not met <= other
        other |= met
    read -= other
    return {name: bits for name, bits in wide.items() if name in read}


@dataclass(slots=True)
class _Uses:
    """The uses of variables in conditions: words read in part, variables in arithmetic, and pairs that are compared."""

    split: set[str] = field_(default_factory=set)
    calculated: set[str] = field_(default_factory=set)
    pairs: list[tuple[str, str]] = field_(default_factory=list)

    def see(self, condition: Expr) -> None:
        """Note the uses in a condition."""
        match condition:
            case Apply(op=op, args=(left, right)) if is_comparison(op):
                names = [self._side(side) for side in (left, right)]
                if names[0] and names[1]:
                    self.pairs.append((names[0], names[1]))
                elif not isinstance(left, Literal) and not isinstance(right, Literal):
                    self.calculated.update(name for name in names if name)
            case Among(subject=subject):
                self._side(subject)
            case Apply(args=args):
                for arg in args:
                    if isinstance(arg.type, Bool):
                        self.see(arg)
                    else:
                        self.calculated.update(map(str, read_by(arg)))
            case _:
                self.calculated.update(map(str, read_by(condition)))

    def _side(self, side: Expr) -> str:
        """Return the variable whose bits a side of a comparison is; "" for any other side, whose variables count as calculated with."""
        part = field_of(side)
        if part is not None and isinstance(part.word, Read):
            if not isinstance(side, Read):
                self.split.add(str(part.word.name))
            return str(part.word.name)
        if isinstance(side.type, Bool):
            self.see(side)
        else:
            self.calculated.update(map(str, read_by(side)))
        return ""


def field(scope: Scope, word: Typed, ends: tuple[int | None, int | None], span: Span) -> Typed | None:
    """Type `word[high..low]`; None after an error, and where an end is None."""
    high, low = ends
    width = _width(scope, word, span)
    if width is None or high is None or low is None:
        return None
    if high < low:
        helps = f"write `[{low}..{high}]`: the greater number stands first"
        scope.report(Code.EMPTY_RANGE, f"the bits {high}..{low} are none", span, helps)
        return None
    if not (_has(scope, width, high, span) and _has(scope, width, low, span)):
        return None
    return Typed(_field(scope, word.expr, high, low, span))


def bit(scope: Scope, word: Typed, place: int | None, span: Span) -> Typed | None:
    """Type `word[3]`, the condition that the bit is set; None after an error, and where the place is None."""
    number = field(scope, word, (place, place), span)
    return None if number is None else Typed(_is(number.expr, 1, span))


def matches(scope: Scope, word: Typed, digits: str, span: Span) -> Typed | None:
    """Type the condition that the word has these bits, the greatest first; `x` is any. None after an error."""
    width = _width(scope, word, span)
    if width is None:
        return None
    if len(digits) != width:
        message = f"the mask has {len(digits)} bits, the word has {width}"
        scope.report(Code.OUT_OF_RANGE_CONSTANT, message, span, NARROWER)
        return None
    tests = [
        _is(_field(scope, word.expr, place, place, span), int(digit), span)
        for place, digit in enumerate(reversed(digits))
        if digit != "x"
    ]
    tests.reverse()
    if not tests:
        return Typed(Literal(value=True, type=Bool(), span=span))
    return Typed(reduce(lambda left, right: Apply(Op.AND, (left, right), Bool(), span), tests))


def bitwise(scope: Scope, op: str, operands: tuple[Typed | None, Typed | None], span: Span) -> Typed | None:
    """Type `&`, `|`, `<<` and `>>`; the right side of a shift and one side of the others is a constant. None after an error."""
    left, right = operands
    if left is None or right is None or any(_width(scope, side, span) is None for side in (left, right)):
        return None
    shift, known = op in ("<<", ">>"), fold(right.expr)
    if known is None and not shift:
        left, right, known = right, left, fold(left.expr)
    if known is None or (shift and known >= MOST_BITS):
        what = "a shift is by a constant from 0 to 63" if shift else f"one side of `{op}` is a constant"
        scope.report(Code.NOT_CONSTANT, what, span)
        return None
    number = int(known)
    if shift:
        return Typed(_by(scope, Op.MUL if op == "<<" else Op.DIV, left.expr, 1 << number, span), left.bare)
    kept = number if op == "&" else ~number
    parts = [
        _by(scope, Op.MUL, _field(scope, left.expr, high, low, span), 1 << low, span)
        for high, low in _runs(kept, bits_of(left.expr))
    ]
    if op == "|":
        parts.append(_number(number, span))
    return Typed(reduce(lambda one, two: _apply(scope, Op.ADD, one, two, span), parts or [_number(0, span)]))


def _runs(kept: int, width: int) -> Iterator[tuple[int, int]]:
    """Yield the greatest and the least place of each run of ones."""
    low = None
    for place in range(width + 1):
        one = place < width and kept >> place & 1 == 1
        if one and low is None:
            low = place
        elif not one and low is not None:
            yield place - 1, low
            low = None


def _width(scope: Scope, word: Typed, span: Span) -> int | None:
    """Return the number of bits; None (reported) where it is no word."""
    kind = word.expr.type
    if isinstance(kind, Int) and kind.low >= 0 and not kind.unit:
        return bits_of(word.expr)
    if not isinstance(kind, Int):
        shown = kind_word(kind)
        helps = ("write `and`, `or`",) if isinstance(kind, Bool) else ()
    else:
        shown, helps = "one that can be negative" if kind.low < 0 else "one with a unit", ()
    scope.report(Code.KIND, f"bits are of a whole number from 0 upwards, this is {shown}", span, *helps)
    return None


def bits_of(word: Expr) -> int:
    """Return the number of bits, by the greatest value of the type."""
    assert isinstance(word.type, Int)
    return max(word.type.high.bit_length(), 1)


def _has(scope: Scope, width: int, place: int, span: Span) -> bool:
    if 0 <= place < width:
        return True
    scope.report(Code.OUT_OF_RANGE_CONSTANT, f"there is no bit {place}, the word has {width - 1}..0", span)
    return False


def _field(scope: Scope, word: Expr, high: int, low: int, span: Span) -> Expr:
    """Return the bits as a number; of a field of a word, those of the word, so that one bit has one spelling."""
    match word:
        case Apply(op=Op.DIV, args=(inner, Literal(value=by))) if _is_power(inner, by):
            places = int(by).bit_length() - 1
            return _field(scope, inner, high + places, low + places, span)
        case Apply(op=Op.MOD, args=(inner, Literal(value=by))) if _is_power(inner, by):
            return _field(scope, inner, high, low, span)  # it has no more bits than the remainder
    upper = _by(scope, Op.DIV, word, 1 << low, span)
    return upper if high >= bits_of(word) - 1 else _by(scope, Op.MOD, upper, 1 << high - low + 1, span)


def cut(number: Expr, bits: int, low: int, most: int) -> Expr:
    """Return so many bits from `low` upwards of a number from 0 to `most`, as a number."""
    rest, top = 1 << bits, most >> low
    if low:
        number = Apply(Op.DIV, (number, Literal(1 << low, Int(1 << low, 1 << low))), Int(0, top))
    if top < rest:
        return number
    return Apply(Op.MOD, (number, Literal(rest, Int(rest, rest))), Int(0, rest - 1))


def _is_power(word: Expr, divisor: Value) -> bool:
    """Return whether a word is divided by 2, 4, 8 or a greater power of two."""
    return isinstance(word.type, Int) and word.type.low >= 0 and divisor > 1 and int(divisor).bit_count() == 1


def _is(number: Expr, value: int, span: Span) -> Expr:
    return Apply(Op.EQ, (number, _number(value, span)), Bool(), span)


def _by(scope: Scope, op: Arithmetic, left: Expr, value: int, span: Span) -> Expr:
    """Apply an operation with a constant; return the left side itself for a product with or quotient by 1."""
    return left if value == 1 and op is not Op.MOD else _apply(scope, op, left, _number(value, span), span)


def _apply(scope: Scope, op: Arithmetic, left: Expr, right: Expr, span: Span) -> Expr:
    made = applied(scope, op, (Typed(left), Typed(right)), (), span)
    return _number(0, span) if made is None else made.expr


def _number(value: int, span: Span) -> Literal:
    return Literal(value, Int(value, value), span)
