"""The emitted C matcher is its table: every bit of its masks, and the line that it finds for every value of each variable.

In: a program, its emitted C, one of its tables, inputs that match its lines. Out: how many cells were compared, or where the C differs.

The matcher looks up one mask for each group of leaves and conditions, and joins them by AND; bit k stands for line k, and the line
follows from the joined mask. It is compared in two parts.

The masks: `mask_probe` copies them out of the emitted file, and each is compared with the one that the table gives: for each
combination of classes of the leaves and truths of the conditions, also those that no input has, the lines that do not exclude it.

The classes: the compiled function is asked, as it is. From an input that matches line k alone, let the leaves of one group take every
combination of their classes, and the other leaves stay. Then bit k of each other mask is set, so that the C gives line k exactly
where bit k of this group's mask is set and no other line matches. Every answer is compared with that of a second C, which reads the
table line by line. It takes a run for each line and each value, and not for each combination of all values: three leaves of a
thousand values and ten lines take thirty thousand runs, not 10^9.

Each leaf also takes its values one by one: all of them where they are few, else the ends of its range and every bound of the table's
own cells, with both neighbours; between those as many constants as there are bounds cannot make another turn.

Trusted for this: that the C joins one look-up a group, the groups being those of the plan. Whether the C finds the truth of a
condition over several variables is not asked for all inputs: that is a matter of expressions, which agreement and ESBMC compare.
What it costs: lines times the sizes of the variables, in all.
"""

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice

from rcsc.base.host.children import scratch
from rcsc.base.host.files.read import MOST_OF_OURS, content
from rcsc.base.host.tools import Absent, c_compiler, run_command, write_c
from rcsc.code.emit.c.matching import classes_of, leaves_of, mask_probe
from rcsc.code.emit.lower import lower_by_force
from rcsc.code.emit.plan import (
    WORD,
    Coded,
    Cuts,
    Direct,
    Group,
    Index,
    Plan,
    PlanTable,
    Probe,
    Truth,
    first_value,
    joined,
)
from rcsc.code.testing.executors.edges import may_be_matched, relational_tests
from rcsc.code.testing.executors.native import COMPILE_S, FLAGS, of_word, to_word
from rcsc.code.testing.executors.reference_file import reference_c
from rcsc.code.testing.executors.shim import WORDS, set_leaves_c
from rcsc.code.testing.executors.symbols import Symbols, text_of
from rcsc.lang.interpret import matching_lines
from rcsc.lang.interval_sets import boxes_of
from rcsc.lang.interval_sets import holds as contains
from rcsc.lang.model import Program, Real, Snapshot, Table, Variable, key_bounds, key_of, value_of_key

RUN_S = 300.0
EVERY_KEY = 4096
"""Keys of a leaf up to which it takes every one."""
MOST_TOLD = 3
"""Wrong masks that are told."""
STARTS = 8
"""Inputs of a line that are gone on from, where a condition over several variables may hold or not in each."""
PROBE = """
static int differs(int64_t *row, int64_t axes, const int64_t *leaf, const int64_t *length, const int64_t *values) {{
  int64_t total = 1; static {struct} s;
  for (int64_t a = 0; a < axes; a++) {{ total *= length[a]; }}
  for (int64_t n = 0; n < total; n++) {{
    int64_t rest = n; const int64_t *of = values;
    for (int64_t a = 0; a < axes; a++) {{
      row[leaf[a]] = of[rest % length[a]]; rest /= length[a]; of += length[a];
    }}
    set_leaves(&s, row, 1);
    if ({defined} && {function}(&s) != {reference}(&s)) {{
      row[{leaves}] = {function}(&s); row[{leaves} + 1] = {reference}(&s); return 1;
    }}
  }}
  return 0;
}}
int main(int argc, char **argv) {{
  static int64_t row[{leaves} + 2]; static uint64_t masks[{words} + 1];
  FILE *in = fopen(argv[1], "rb"), *to = fopen(argv[2], "wb");
  if (argc != 3 || !in || !to || fseek(in, 0, SEEK_END)) {{ return 2; }}
  const size_t size = (size_t)ftell(in); int64_t *all = malloc(size); rewind(in);
  if (!all || fread(all, 1, size, in) != size) {{ return 3; }}
  probe_masks(masks);
  if (fwrite(masks, sizeof *masks, {words}, to) != {words}) {{ return 4; }}
  const int64_t *rows = all + 1, *sets = rows + all[0] * {leaves};
  for (int64_t start = 0; start < all[0]; start++) {{
    for (const int64_t *p = sets; p < all + size / sizeof *all;) {{
      const int64_t axes = *p, *leaf = p + 1, *length = leaf + axes, *values = length + axes;
      memcpy(row, rows + start * {leaves}, {leaves} * sizeof *row);
      if (differs(row, axes, leaf, length, values)) {{ return fwrite(row, sizeof row, 1, to) != 1 || fclose(to); }}
      for (p = values; length < values; length++) {{ p += *length; }}
    }}
  }}
  return fclose(to) != 0;
}}
"""


@dataclass(frozen=True, slots=True)
class Checked:
    """The extent of a comparison that found no difference.

    Attributes:
        cells: Bits of masks, a line and a combination of classes each.
        unmatched: Lines that no input is known of: the classes that they alone look at are not tried.
    """

    cells: int
    unmatched: tuple[str, ...]


@dataclass(slots=True)
class MatcherCheck:
    """Compares the matcher of one table with it, in any number of files.

    Attributes:
        program: The program.
        symbols: Names in its emitted C.
        table: One of its tables.
        known: Inputs that match lines of it.
    """

    program: Program
    symbols: Symbols
    table: Table
    known: Sequence[Snapshot]
    plan: Plan = field(init=False)
    planned: PlanTable = field(init=False)
    _asked: bytes = field(init=False)
    _masks: tuple[tuple[Group, tuple[int, ...]], ...] = field(init=False)
    _told: Checked = field(init=False)

    def __post_init__(self) -> None:
        """Find inputs of each line, what is asked from there, and the masks that the table gives."""
        self.plan = lower_by_force(self.program)
        self.planned = next(one for one in self.plan.tables if one.table.name == self.table.name)
        groups, starts = self.planned.matcher.groups, self.starts()
        asked = array("q", [sum(map(len, starts.values()))])
        for words in (*chain(*starts.values()), *(axes for group in groups for axes in self.axes(group))):
            asked += words
        self._asked = asked.tobytes()
        self._masks = tuple((group, self.masks(group)) for group in groups)
        cells = sum(len(masks) for _, masks in self._masks) * len(self.table.lines)
        self._told = Checked(cells, tuple(name for name, some in starts.items() if not some))

    def of(self, files: Mapping[str, str]) -> Checked | tuple[str, ...] | Absent:
        """Compare the matcher in these files, text by path, with the table; return its differences in words."""
        compiler = c_compiler()
        if isinstance(compiler, Absent):
            return compiler
        with scratch("matcher") as place:
            others = write_c(files, place)
            (place / "probe.c").write_text(self.probe_c(text_of(self.symbols.source, files)), "utf-8")
            (place / "in.bin").write_bytes(self._asked)
            compiled = run_command([compiler, *FLAGS, "-o", "probe", "probe.c", *others], place, COMPILE_S)
            if compiled.status != 0:
                return ("the probe does not compile", *compiled.err.strip().splitlines())
            ran = run_command([str(place / "probe"), "in.bin", "out.bin"], place, RUN_S)
            if ran.status != 0:
                return ("the C stops on some input, or does not end",)
            found = content(place / "out.bin", MOST_OF_OURS)
        masks, differing = array("Q", found[: 8 * self.words]), array("q", found[8 * self.words :])
        differences = [*islice(self.wrong(masks), MOST_TOLD), *([self.told(differing)] if differing else [])]
        return tuple(differences) or self._told

    @property
    def words(self) -> int:
        """The number of words of all masks of the table."""
        return sum(len(masks) for _, masks in self._masks) * self.planned.matcher.words

    def probe_c(self, source: str) -> str:
        """Return C that copies the masks of an emitted file and asks both functions for the line of many inputs; see `axes`."""
        number = self.program.tables.index(self.table)
        probe = PROBE.format(
            struct=self.symbols.struct,
            leaves=len(self.program.variables),
            words=self.words,
            function=self.symbols.lines[self.table.name],
            reference=f"ref_t{number}_line",
            defined=f"ref_t{number}_safe(&s)" if relational_tests(self.table) else "1",
        )
        head = [f"#include <{name}.h>" for name in ("stdio", "stdlib", "string")]
        head += [f'#include "{self.symbols.header}"', "#define RCSC_CONST_SECTION"]
        head += [reference_c(self.program, self.symbols), WORDS, *set_leaves_c(self.program, self.symbols)]
        return "\n".join([*head, mask_probe(self.plan, self.planned, source), probe])

    # --- masks ---

    def masks(self, group: Group) -> tuple[int, ...]:
        """Return the masks of a group that the table gives, by class."""
        return joined(tuple(Probe(probe.index, self.left(probe.index)) for probe in group))

    def left(self, index: Index) -> tuple[int, ...]:
        """Return for each class of a leaf, or each truth of a condition, the lines that do not exclude it."""
        lines = self.table.lines
        if isinstance(index, Truth):
            free = [
                all(t is None or t.condition is not index.condition for t in line.tests) for line in lines
            ]
            return _mask(free), _mask(True for _ in lines)
        boxes = [boxes_of(line.tests).get(index.leaf) for line in lines]
        return tuple(_mask(box is None or contains(box, key) for box in boxes) for key in _firsts(index))

    def wrong(self, words: Iterable[int]) -> Iterator[str]:
        """Yield each mask of the C that is not the table's, in words."""
        words, size = iter(words), self.planned.matcher.words
        for group, masks in self._masks:
            for at, mask in enumerate(masks):
                found = sum(next(words) << WORD * place for place in range(size))
                if found != mask:
                    yield f"for {leaves_of(group)}: {classes_of(group)[at]} the C has the mask {found:#x}, the table {mask:#x}"

    # --- lines ---

    def told(self, row: Sequence[int]) -> str:
        """Return an input on which the C gives another line than the table, in words."""
        *words, got, right = row
        values = {
            leaf.name: of_word(leaf.type, word, self.symbols.c_type(leaf.name) == "uint64_t")
            for leaf, word in zip(self.program.variables, words, strict=True)
        }
        where = ", ".join(f"{name} = {values[name]}" for name in self.table.variables)
        return f"at {where} the C gives line {got}, the table {right}"

    def starts(self) -> dict[str, list["array[int]"]]:
        """Return for each line the inputs that match it alone, as words; not more than are asked about."""
        most = STARTS if relational_tests(self.table) else 1
        starts: dict[str, list[array[int]]] = {str(line.name): [] for line in self.table.lines}
        for one in self.known:
            names = matching_lines(self.table, one) if may_be_matched(self.program, self.table, one) else []
            if len(names) == 1 and len(starts[names[0]]) < most:
                words = (to_word(v.type, one[v.name]) for v in self.program.variables)
                starts[names[0]].append(array("q", words))
        return starts

    def axes(self, group: Group) -> Iterator["array[int]"]:
        """Yield the leaves of a group with the first keys of their classes, and each of them with all of its keys.

        As words: how many leaves, their positions, how many values each takes, the values.
        """
        indices = [probe.index for probe in group if not isinstance(probe.index, Truth)]
        yield self.taking([(self.program.variable(index.leaf), _firsts(index)) for index in indices])
        for index in indices:
            leaf = self.program.variable(index.leaf)
            yield self.taking([(leaf, self.keys(leaf))])

    def taking(self, keys_of: Sequence[tuple[Variable, list[int]]]) -> "array[int]":
        """Return these leaves with these keys, as words."""
        leaves = (self.program.variables.index(leaf) for leaf, _ in keys_of)
        lengths = (len(keys) for _, keys in keys_of)
        values = (to_word(leaf.type, value_of_key(leaf.type, key)) for leaf, keys in keys_of for key in keys)
        return array("q", [len(keys_of), *leaves, *lengths, *values])

    def keys(self, leaf: Variable) -> list[int]:
        """Return the keys that a leaf takes one by one; see the module."""
        low, high = key_bounds(leaf.type)
        if high - low < EVERY_KEY and not isinstance(leaf.type, Real):
            return list(range(low, high + 1))
        boxes = (boxes_of(line.tests).get(leaf.name, ()) for line in self.table.lines)
        ends = {end for box in boxes for ends in box for end in ends}
        near = {end + step for end in ends for step in (-1, 0, 1)} | {low, high}
        return sorted(key for key in near if low <= key <= high)


def _mask(bits: Iterable[bool]) -> int:
    return sum(1 << at for at, bit in enumerate(bits) if bit)


def _firsts(index: Direct | Coded | Cuts) -> list[int]:
    """Return the first key of each class of a leaf."""
    later = (key_of(index.type, first_value(index, number)) for number in range(1, index.count))
    return [key_bounds(index.type)[0], *later]
