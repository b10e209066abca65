"""The emitted C matcher that works in windows is the table, for all inputs.

In: a program, its table, the parts of its matcher. Out: the C of a self-test, and a check of what it gives.

Why this is complete. The questions are a tree; each asks one leaf, so that what leads to a window is a product: for each leaf
some of its values. A line is at one place of a window at most; one that has none there is excluded by what leads there alone.
For each word that a group gives in a window, and each combination of classes that may come there, bit k is set where the cells of the group
admit the line at place k; where no line is, it is not set. So the joined word has a bit for each line that matches, as `cells` says of
masks of all lines. The tail is run for every window, with each single bit, none, and each pair.
"""

import ctypes
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import prod

from rcsc.code.testing.executors.edges import relational_tests
from rcsc.code.testing.executors.reference_file import reference_c
from rcsc.code.testing.executors.shim import WORDS, set_leaves_c
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.matchers.cells import Checker, Way
from rcsc.code.testing.matchers.matcher_c import rows_c, walk_c
from rcsc.code.testing.matchers.matcher_text import Component, Lookup
from rcsc.code.testing.matchers.window_text import Place, Question, WindowText
from rcsc.lang.model import Program, Table, Variable

WORD = 64

TAIL_TEST = """
uint64_t rcsc_tail_test(int32_t *order) {{
  uint64_t wrong = 0;
  for (uint32_t w = 0; w < {windows}u; w++) {{
    if (rcsc_tail(w, 0) != {none}) {{ wrong++; }}
    for (uint32_t a = 0; a < 64u; a++) {{
      order[w * 64u + a] = rcsc_tail(w, UINT64_C(1) << a);
      for (uint32_t b = a + 1u; b < 64u; b++) {{
        if (rcsc_tail(w, UINT64_C(1) << a | UINT64_C(1) << b) != -2) {{ wrong++; }}
      }}
    }}
  }}
  return wrong;
}}
"""


def questions_of(place: Place) -> Iterator[Question]:
    """Give every question, the first one first."""
    if isinstance(place, Question):
        yield place
        yield from questions_of(place.above)
        yield from questions_of(place.below)


def window_test_c(program: Program, symbols: Symbols, table: Table, parts: WindowText) -> str:
    """The whole self-test."""
    number_of = program.tables.index(table)
    text = [f'#include "{symbols.source}"', "#include <string.h>", reference_c(program, symbols), WORDS]
    text += [*set_leaves_c(program, symbols), parts.declaration]
    for number, (lookup, found) in enumerate(zip(parts.lookups, parts.found, strict=True)):
        text.append(
            f"void rcsc_words_{number}(uint64_t *out) {{ for (uint32_t w = 0; w < {parts.windows}u; w++)"
        )
        text.append(f"for (uint32_t at = 0; at < {lookup.entries}u; at++)")
        text.append(f"out[w * {lookup.entries}u + at] = {found}; }}")
        text += rows_c(program, symbols, f"rcsc_index_{number}", lookup.index)
        for at, part in enumerate(lookup.components):
            name = f"rcsc_class_{number}_{at}"
            text += (
                walk_c(program, symbols, name, part)
                if part.path
                else rows_c(program, symbols, name, part.text)
            )
    for at, question in enumerate(questions_of(parts.first)):
        text += walk_c(program, symbols, f"rcsc_asked_{at}", question.asked)
    for at, _ in enumerate(relational_tests(table)):
        text += rows_c(program, symbols, f"rcsc_test_{at}", f"ref_t{number_of}_test{at}(s)")
    text += rows_c(program, symbols, "rcsc_window", "w", parts.statements)
    text.append(f"static int32_t rcsc_tail(uint32_t w, uint64_t m) {{ {parts.tail} }}")
    none = -1 if table.default is None else len(table.lines)
    text.append(TAIL_TEST.format(windows=parts.windows, none=none))
    return "\n".join(text) + "\n"


Allowed = dict[str, list[bool]]
"""For leaves, by path, which of their keys come to a place; every key of a leaf that is not named."""


@dataclass(slots=True)
class WindowChecker(Checker):
    """Checks a matcher that works in windows."""

    parts: WindowText
    regions: list[list[Allowed]] = field(default_factory=list)
    order: list[list[int]] = field(default_factory=list)
    masks: list[int] = field(default_factory=list)
    keys_of: dict[str, list[int]] = field(default_factory=dict)
    cells_of: dict[str, list[int]] = field(default_factory=dict)

    def keys(self, leaf: Variable, part: Component) -> list[int]:
        """The keys of a leaf, the same wherever it is asked for."""
        path = self.symbols.path(leaf.name)
        if path not in self.keys_of:
            parts = [component for lookup in self.parts.lookups for component in lookup.components]
            parts += [question.asked for question in questions_of(self.parts.first)]
            named = [constant for one in parts if one.path == path for constant in one.constants]
            whole = replace(part, constants=tuple(dict.fromkeys(named)))
            self.keys_of[path] = Checker.keys(self, leaf, whole)
        return self.keys_of[path]

    def cells_at(self, leaf: Variable, keys: Sequence[int]) -> list[int]:
        """For each key of a leaf the lines whose cells admit it."""
        if leaf.name not in self.cells_of:
            self.cells_of[leaf.name] = Checker.cells_at(self, leaf, keys)
        return self.cells_of[leaf.name]

    def prepare(self, rows: "array[int]", count: int) -> None:
        """Find what leads to each window, and its lines."""
        self.regions = [[] for _ in range(self.parts.windows)]
        names = {
            id(question): f"rcsc_asked_{at}" for at, question in enumerate(questions_of(self.parts.first))
        }

        def walked(place: Place, allowed: Allowed) -> None:
            if isinstance(place, int):
                self.regions[place].append(allowed)
                return
            path = place.asked.path
            answers = [answer for answer, _ in self.unary(names[id(place)], place.asked, shared=True)]
            before = allowed.get(path, [True] * len(answers))
            for side, next_place in ((1, place.above), (0, place.below)):
                left = [had and answer == side for had, answer in zip(before, answers, strict=True)]
                walked(next_place, {**allowed, path: left})

        walked(self.parts.first, {})
        self.same_windows(rows, count)
        self.lines_of_windows()

    def same_windows(self, rows: "array[int]", count: int) -> None:
        """Compare the compiled questions with the tree that was read, on edges."""
        names = {
            id(question): f"rcsc_asked_{at}" for at, question in enumerate(questions_of(self.parts.first))
        }
        answers = {
            id(question): self.run(names[id(question)], count, self.column(question.asked, rows))
            for question in questions_of(self.parts.first)
        }
        for at, window in enumerate(self.run("rcsc_window", count, rows)):
            place = self.parts.first
            while isinstance(place, Question):
                place = place.above if answers[id(place)][at] else place.below
            if place != window:
                self.wrong.append(f"the questions lead to window {window} where {place} is right")
                return

    def lines_of_windows(self) -> None:
        """Read the order of every window from the tail; a line that is not there must be excluded by what leads there."""
        words = array("i", bytes(4 * WORD * self.parts.windows))
        self.library.rcsc_tail_test.restype = ctypes.c_uint64
        if wrong := self.library.rcsc_tail_test(ctypes.c_void_p(words.buffer_info()[0])):
            self.wrong.append(f"{wrong} masks lead to a wrong line")
        lines = len(self.table.lines)
        for window in range(self.parts.windows):
            order = list(words[WORD * window : WORD * (window + 1)])
            placed = [line for line in order if 0 <= line < lines]
            mask = sum(1 << line for line in set(placed))
            if len(placed) != len(set(placed)):
                self.wrong.append(f"a line has two places in window {window}")
            if any(self.possible(allowed) & ~mask for allowed in self.regions[window]):
                self.wrong.append(f"a line that may match is not in window {window}")
            self.order.append(order)
            self.masks.append(mask)

    def possible(self, allowed: Allowed) -> int:
        """The lines that what leads to a window does not exclude."""
        lines = self.everyone
        for path, keys in allowed.items():
            leaf = self.leaf(path)
            cells = self.cells_at(leaf, self.keys(leaf, Component("", path, (), 0)))
            some = 0
            for admitted in {cell for cell, allows in zip(cells, keys, strict=True) if allows}:
                some |= admitted
            lines &= some
        return lines

    def tail(self) -> int:
        """How many masks the tail was given."""
        return self.parts.windows * (1 + WORD + WORD * (WORD - 1) // 2)

    def lookup(self, number: int, lookup: Lookup, rows: "array[int]", count: int) -> None:
        """Compares the words of one group with the cells of its classes, window by window."""
        pairs = [
            self.unary(f"rcsc_class_{number}_{at}", part) if part.path else []
            for at, part in enumerate(lookup.components)
        ]
        truths = [
            [None] if part.path else self.truth(f"rcsc_class_{number}_{at}", rows, count)
            for at, part in enumerate(lookup.components)
        ]
        counts = [part.count for part in lookup.components]
        counts[0] = lookup.entries // max(1, prod(counts[1:]))
        words = array("Q", bytes(8 * lookup.entries * self.parts.windows))
        getattr(self.library, f"rcsc_words_{number}")(ctypes.c_void_p(words.buffer_info()[0]))
        for chosen in product(*truths):
            compared = self.compared(lookup, pairs, chosen, counts, words)
            if compared is not None:
                self.stated |= {way.test for way in chosen if way is not None}
                self.cells += compared
                break
        else:
            self.wrong.append(f"group {number} of the matcher gives a word that is not its cells")
        self.mixed(number, lookup, counts, rows, count)

    def compared(
        self,
        lookup: Lookup,
        pairs: Sequence[Sequence[tuple[int, int]]],
        truths: Sequence[Way | None],
        counts: Sequence[int],
        words: "array[int]",
    ) -> int | None:
        """How many cells are right; None if a word differs."""
        cells = 0
        for window, regions in enumerate(self.regions):
            given = words[window * lookup.entries : (window + 1) * lookup.entries]
            known: dict[int, int] = {}
            for allowed in regions:
                ways = [
                    way.lines if way is not None else _coming(pair, allowed.get(part.path))
                    for pair, part, way in zip(pairs, lookup.components, truths, strict=True)
                ]
                found = self.agreeing(window, given, counts, ways, known)
                if found is None:
                    return None
                cells += found * self.masks[window].bit_count()
        return cells

    def agreeing(
        self,
        window: int,
        given: "array[int]",
        counts: Sequence[int],
        ways: Sequence[Mapping[int, int]],
        known: dict[int, int],
    ) -> int | None:
        """How many words of a window were compared; None if one differs."""
        order, own, found = self.order[window], self.masks[window], 0
        for classes in product(*(way.items() for way in ways)):
            at, lines = 0, own
            for (number, admitted), count in zip(classes, counts, strict=True):
                if number >= count:
                    return None
                at, lines = at * count + number, lines & admitted
            if lines not in known:
                bits = (1 << bit for bit, line in enumerate(order) if line >= 0 and lines >> line & 1)
                known[lines] = sum(bits)
            if given[at] != known[lines]:
                return None
            found += 1
        return found


def _coming(pairs: Sequence[tuple[int, int]], allowed: Sequence[bool] | None) -> dict[int, int]:
    """For each class that comes to a place the lines that admit it."""
    if allowed is None:
        return dict(pairs)
    return dict(pair for pair, comes in zip(pairs, allowed, strict=True) if comes)
