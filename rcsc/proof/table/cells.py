"""Sets of keys in a table's own words: a cell that would say the same."""

from collections.abc import Iterable, Iterator, Mapping
from math import prod

from rcsc.lang.expressions.words import field_of, mask_of
from rcsc.lang.interval_sets import holds, size
from rcsc.lang.meaning import spelled
from rcsc.lang.model import Bool, Box, Column, Enum, Scalar, key_bounds, spell, value_of_key
from rcsc.proof.table.regions.word_bits import Part, kind_of, mask_text
from rcsc.proof.table.verdict import Region

_MOST = 8


def cell(kind: Scalar, box: Box) -> str | None:
    """Spell the cell that states `box`: "" for the whole range, None where no cell can say it."""
    low, high = key_bounds(kind)
    if box == ((low, high),):
        return ""
    words = [
        spell(kind, value_of_key(kind, key))
        for first, last in box
        for key in range(first, min(last, first + 64) + 1)
    ]
    if isinstance(kind, Bool | Enum):
        outside = [key for key in range(low, high + 1) if not holds(box, key)]
        if len(words) == 1:
            return words[0]
        if len(outside) == 1:
            return f"/= {spell(kind, value_of_key(kind, outside[0]))}"
        return "in {" + ", ".join(words) + "}"
    if len(box) == 1:
        first, last = box[0]
        ends = spell(kind, value_of_key(kind, first)), spell(kind, value_of_key(kind, last))
        if first == last:
            return ends[0]
        if first == low:
            return f"<= {ends[1]}"
        return f">= {ends[0]}" if last == high else f"{ends[0]} .. {ends[1]}"
    if len(box) == 2 and box[0][0] == low and box[1][1] == high and box[0][1] + 2 == box[1][0]:
        return f"/= {spell(kind, value_of_key(kind, box[0][1] + 1))}"
    if all(first == last for first, last in box) and len(box) <= _MOST:
        return "in {" + ", ".join(words) + "}"
    return None


def condition(name: str, kind: Scalar, box: Box) -> str:
    """Spell `name` and its keys as a condition for people."""
    text = cell(kind, box)
    if text is None:
        parts = [cell(kind, (part,)) or "" for part in box[:_MOST]]
        return f"{name} " + " or ".join(parts) + (" or more" if len(box) > _MOST else "")
    if text.startswith(("/=", "<=", ">=", "in ")):
        return f"{name} {text}"
    return f"{name} in {text}" if " .. " in text else f"{name} = {text}"


def region(kinds: Mapping[str, Scalar], boxes: Region | None) -> tuple[str, ...]:
    """Spell a region as conditions, one for each variable that it bounds; a word is shown by its mask."""
    return tuple(_conditions(kinds, boxes)) if boxes else ()


def _conditions(kinds: Mapping[str, Scalar], boxes: Region) -> Iterator[str]:
    words = _by_word(kinds, boxes)
    for name, box in boxes.items():
        part = None if name in kinds else Part.named(name)
        if part is None:
            yield condition(name, kinds[name], box)
        elif part == words[part.leaf][0]:
            high = key_bounds(kinds[part.leaf])[1].bit_length() - 1
            digits = mask_text(words[part.leaf], boxes, high, 0)
            if digits is not None:
                yield f"{part.leaf} = {mask(digits)}"
            else:
                yield from (condition(p.name, p.kind, boxes[p.name]) for p in words[part.leaf])


def _by_word(kinds: Mapping[str, Scalar], names: Iterable[str]) -> dict[str, list[Part]]:
    """Group the parts among the names by their leaves."""
    words: dict[str, list[Part]] = {}
    for name in names:
        part = None if name in kinds else Part.named(name)
        if part is not None:
            words.setdefault(part.leaf, []).append(part)
    return words


def mask(digits: str) -> str:
    """Write the binary digits of a mask or a number in groups of four."""
    groups = [digits[max(0, end - 4) : end] for end in range(len(digits), 0, -4)]
    return f"0b{'_'.join(reversed(groups))}"


def inputs(kinds: Mapping[str, Scalar], boxes: Region, names: Iterable[str]) -> int:
    """Count the inputs of a region over these variables."""
    whole = prod(size((key_bounds(kinds[name]),)) for name in names)
    for name, box in boxes.items():
        low, high = key_bounds(kind_of(kinds, name))
        whole = whole * size(box) // (high - low + 1)
    return whole


def cell_under(
    column: Column, kinds: Mapping[str, Scalar], boxes: Region
) -> tuple[str, frozenset[str]] | None:
    """Return the cell that states a region's bounds on a column's bits or variable, and the names that it covers.

    Return None where no cell says it. Bits that another column has, too, are said in each.
    """
    if column.variable in boxes:
        text = cell(kinds[str(column.variable)], boxes[str(column.variable)])
        return None if text is None else (text, frozenset({str(column.variable)}))
    places = _places(column)
    parts = [part for part in (Part.named(name) for name in boxes if name not in kinds) if part is not None]
    mine = [part for part in parts if places is not None and part.leaf == places.leaf]
    inside = [
        part for part in mine if places is not None and places.low <= part.low <= part.high <= places.high
    ]
    if places is None or not inside:
        return "", frozenset()
    digits = mask_text(inside, boxes, places.high, places.low)
    if digits is None:
        return None
    names = frozenset(part.name for part in inside)
    if column.subject is not None and isinstance(column.subject.type, Bool):
        return ("true" if digits == "1" else "false"), names
    return mask(digits), names


def _places(column: Column) -> Part | None:
    """Return the bits that a heading shows; None for any other heading."""
    if column.subject is None:
        return None
    field = field_of(column.subject)
    if field is not None:
        return Part(spelled(field.word), field.high, field.low)
    bit = mask_of(column.subject)
    if bit is None or bit.care != bit.value or bit.care.bit_count() != 1:
        return None
    return Part(spelled(bit.word), bit.care.bit_length() - 1, bit.care.bit_length() - 1)
