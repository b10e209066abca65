"""Sets of keys in a table's own words: a cell that would say the same."""

from rcsc.lang.interval_sets import holds
from rcsc.lang.model import Bool, Box, Enum, Scalar, key_bounds, spell, value_of_key
from rcsc.table.verdict import Region

_MOST = 8


def cell(kind: Scalar, box: Box) -> str | None:
    """The cell that states `box`; "" where it is everything, None where no cell can."""
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
    """`name` and its keys as a condition, for people."""
    text = cell(kind, box)
    if text is None:
        parts = [cell(kind, (part,)) or "" for part in box[:_MOST]]
        return f"{name} " + " or ".join(parts) + (" or more" if len(box) > _MOST else "")
    if text.startswith(("/=", "<=", ">=", "in ")):
        return f"{name} {text}"
    return f"{name} in {text}" if " .. " in text else f"{name} = {text}"


def region(kinds: dict[str, Scalar], boxes: Region | None) -> tuple[str, ...]:
    """The region as conditions, one a variable that is not free."""
    return tuple(condition(name, kinds[name], box) for name, box in boxes.items()) if boxes else ()
