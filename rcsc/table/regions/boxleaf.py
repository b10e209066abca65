"""Whether lines that are boxes part each other and fill a region: masks and counting.

In: one box a form for each line, and the region's extent of each form. Out: nothing, or a part
of the region where it is not so.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import prod

from rcsc.lang.model import Box

MANY = 64
"""Above so many lines a certificate leaves the parting form of each pair to the checker."""

Cell = dict[int, tuple[int, int]]


def defect(lines: Sequence[Mapping[int, Box]], extents: Cell, *, cover: bool) -> Cell | None:
    """A cell in which two lines hold, or (with `cover`) none; None where there is none."""
    pair = first_overlap(lines)
    if pair is not None:
        left, right = lines[pair[0]], lines[pair[1]]
        cell = {}
        for form, extent in extents.items():
            boxes = left.get(form, (extent,)), right.get(form, (extent,))
            cell[form] = next(
                (max(a, c), min(b, d)) for a, b in boxes[0] for c, d in boxes[1] if a <= d and c <= b
            )
        return cell
    return short_cell(lines, extents) if cover else None


def first_overlap(lines: Sequence[Mapping[int, Box]]) -> tuple[int, int] | None:
    """The first line that meets a later one, with that line."""
    everyone = (1 << len(lines)) - 1
    masks: dict[int, dict[Box, int]] = {}
    for i, boxes in enumerate(lines):
        for form, box in boxes.items():
            by_box = masks.setdefault(form, {})
            by_box[box] = by_box.get(box, 0) | 1 << i
    meets: dict[tuple[int, Box], int] = {}
    for i, boxes in enumerate(lines):
        others = everyone ^ (1 << (i + 1)) - 1
        for form, box in boxes.items():
            if not others:
                break
            if (form, box) not in meets:
                meets[form, box] = _meeting(box, masks[form], everyone)
            others &= meets[form, box]
        if others:
            return i, (others & -others).bit_length() - 1
    return None


def parting(lines: Sequence[Mapping[int, Box]]) -> tuple[int, ...] | None:
    """For each pair of disjoint lines, first with second and on, a form that parts them.

    None where there are more than `MANY` lines: then a checker looks for it.
    """
    if len(lines) > MANY:
        return None
    return tuple(
        next(form for form, box in left.items() if form in right and not _touch(box, right[form]))
        for left, right in combinations(lines, 2)
    )


def _touch(left: Box, right: Box) -> bool:
    return any(a <= d and c <= b for a, b in left for c, d in right)


def _meeting(box: Box, by_box: Mapping[Box, int], everyone: int) -> int:
    """The lines that `box` can meet; a line without a box on the form meets all."""
    found = everyone
    for other, mask in by_box.items():
        if not _touch(box, other):
            found &= ~mask
    return found


def size_of(box: Box) -> int:
    """How many keys the box has."""
    return sum(high - low + 1 for low, high in box)


def short_cell(lines: Sequence[Mapping[int, Box]], extents: Cell) -> Cell | None:
    """For disjoint lines: a cell that they do not fill; None when they fill everything.

    Forms are fixed one at a time to a slice that is short of lines.
    """
    left: list[Mapping[int, Box]] = list(lines)
    forms = list(extents)
    if _filled(left, forms, extents) == prod(high - low + 1 for low, high in extents.values()):
        return None
    cell: Cell = {}
    for at, form in enumerate(forms):
        later = forms[at + 1 :]
        whole = prod(extents[other][1] - extents[other][0] + 1 for other in later)
        for low, high in _slices(left, form, extents[form]):
            inside = [
                line
                for line in left
                if form not in line or any(a <= low and high <= b for a, b in line[form])
            ]
            if _filled(inside, later, extents) != whole:
                cell[form], left = (low, high), inside
                break
    return cell


def _filled(lines: Sequence[Mapping[int, Box]], forms: Sequence[int], extents: Cell) -> int:
    full = {form: extents[form][1] - extents[form][0] + 1 for form in forms}
    return sum(prod(size_of(line[form]) if form in line else full[form] for form in forms) for line in lines)


def _slices(lines: Sequence[Mapping[int, Box]], form: int, extent: tuple[int, int]) -> list[tuple[int, int]]:
    """The extent, cut wherever some line's box on the form begins or ends."""
    starts = {extent[0]}
    for line in lines:
        for low, high in line.get(form, ()):
            starts.update((low, high + 1))
    ordered = sorted(start for start in starts if start <= extent[1])
    return list(zip(ordered, [*(start - 1 for start in ordered[1:]), extent[1]], strict=True))
