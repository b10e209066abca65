"""Where the boxes of lines end, as masks: which lines a cut puts on one of its sides.

In: lines as boxes over forms. Out: for each form and each cut at which some box ends, the lines that lie at or below the cut and those
above it, one bit a line. Of lines 0 with `f <= 4` and 1 with `f > 4` the cut 4 puts line 0 below and line 1 above. How well
a cut parts the lines that are left in a region is then told by two intersections, whatever the number of lines.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping
from operator import or_
from typing import NamedTuple, TypeAlias


class Cut(NamedTuple):
    """A cut `form <= at`.

    Attributes:
        form: Its form.
        at: Where it is cut.
        here: Lines whose box ends there, or begins right after it.
        below: Lines whose box ends there or before.
        above: Lines whose box begins after it.
        apart: Both of these.
    """

    form: int
    at: int
    here: int
    below: int
    above: int
    apart: int


Span: TypeAlias = tuple[int, int]


class Ends:
    """The cuts of lines whose boxes are intervals.

    Attributes:
        cuts: Of every form, in the order in which forms were met.
        everyone: All these lines.
    """

    def __init__(self, lines: Mapping[int, Iterable[tuple[int, Span]]]) -> None:
        """Sort the ends of the intervals of these lines, by their numbers."""
        self.everyone = 0
        begins: dict[int, dict[int, int]] = {}
        ends: dict[int, dict[int, int]] = {}
        for number, spans in lines.items():
            bit = 1 << number
            self.everyone |= bit
            for form, (low, high) in spans:
                if form not in begins:
                    begins[form], ends[form] = {}, {}
                of_form = begins[form]
                of_form[low - 1] = of_form.get(low - 1, 0) | bit
                of_form = ends[form]
                of_form[high] = of_form.get(high, 0) | bit
        by_form = {form: _cuts(form, begins[form], ends[form]) for form in begins}
        self.cuts = [cut for cuts in by_form.values() for cut in cuts]
        self._by_form = {form: ([cut.at for cut in cuts], cuts) for form, cuts in by_form.items()}

    def beyond(self, form: int, at: int) -> tuple[int, int]:
        """Return the lines that lie below a cut of a form, and those above it; the cut need not be at an end."""
        if form not in self._by_form:
            return 0, 0
        places, cuts = self._by_form[form]
        under, over = bisect_right(places, at) - 1, bisect_left(places, at)
        return cuts[under].below if under >= 0 else 0, cuts[over].above if over < len(cuts) else 0


def _cuts(form: int, begins: Mapping[int, int], ends: Mapping[int, int]) -> list[Cut]:
    places = sorted({*begins, *ends})
    below, above = list[int](), list[int]()
    under = over = 0
    for at in places:
        under |= ends.get(at, 0)
        below.append(under)
    for at in reversed(places):
        over |= begins.get(at, 0)
        above.append(over)
    here = [begins.get(at, 0) | ends.get(at, 0) for at in places]
    apart = list(map(or_, below, reversed(above)))
    return list(map(Cut, [form] * len(places), places, here, below, reversed(above), apart))
