"""The emitted C matcher is its table: a check a group of variables at a time, for any size.

In: a program, its emitted C, one of its tables. Out: how many cells were compared, or an input on which the C gives another line.

Why this is complete, where each condition looks at one variable. The matcher looks up one mask for each group of leaves and joins
them by AND; bit k stands for line k, and the line follows from the joined mask. From an input that matches line k alone, let the
leaves of one group take every combination of their classes, and the other leaves stay. Then bit k of each other mask is set, so that
the C gives line k exactly where bit k of this group's mask is set and no other line matches. So each bit of each mask decides an
answer, and every answer is compared with that of a second C, which reads the table line by line. It takes a run for each line and
each value, and not for each combination of all values: three leaves of a thousand values and ten lines take thirty thousand runs,
not 10^9.

Each leaf also takes its values one by one: all of them where they are few, else the ends of its range and every bound of the table's
own cells, with both neighbours; between those as many constants as there are bounds cannot make another turn.

The compiled function is asked, as it is; nothing reads its text or the masks that it was made of. Trusted for this: that it joins
one look-up a group, the groups being those of the plan. Conditions over several variables hold or not as the values that are
asked for have it, so that a table that has some is compared as far as inputs tell: the rest is ESBMC's part.
What it costs: lines times the sizes of the variables, in all.
"""

from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice
from math import prod
from random import Random

from rcsc.base.host.children import scratch
from rcsc.base.host.files.read import MOST_OF_OURS, content
from rcsc.base.host.tools import Absent, c_compiler, run_command, write_c
from rcsc.code.emit.lower import lower_by_force
from rcsc.code.emit.plan import Coded, Cuts, Direct, Group, Truth, first_value
from rcsc.code.testing.executors.edges import companions, leaf_edges, may_be_matched, relational_tests
from rcsc.code.testing.executors.native import COMPILE_S, FLAGS, of_word, to_word
from rcsc.code.testing.executors.reference_file import reference_c
from rcsc.code.testing.executors.shim import WORDS, set_leaves_c
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.interpret import holds, matching_lines
from rcsc.lang.interval_sets import boxes_of
from rcsc.lang.model import (
    Line,
    Program,
    Real,
    Snapshot,
    Table,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)

RUN_S = 300.0
EVERY_KEY = 4096
"""Keys of a leaf up to which it takes every one."""
MOST_DRAWN = 400
"""Inputs drawn for a line until one matches it."""
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
  static int64_t row[{leaves} + 2];
  FILE *in = fopen(argv[1], "rb"), *to = fopen(argv[2], "wb");
  if (argc != 3 || !in || !to || fseek(in, 0, SEEK_END)) {{ return 2; }}
  const size_t size = (size_t)ftell(in); int64_t *all = malloc(size); rewind(in);
  if (!all || fread(all, 1, size, in) != size) {{ return 3; }}
  const int64_t *rows = all + 1, *sets = rows + all[0] * {leaves};
  for (int64_t start = 0; start < all[0]; start++) {{
    for (const int64_t *p = sets; p < all + size / sizeof *all;) {{
      const int64_t axes = *p, *leaf = p + 1, *length = leaf + axes, *values = length + axes;
      memcpy(row, rows + start * {leaves}, {leaves} * sizeof *row);
      if (differs(row, axes, leaf, length, values)) {{ return fwrite(row, sizeof row, 1, to) != 1 || fclose(to); }}
      for (p = values; length < values; length++) {{ p += *length; }}
    }}
  }}
  return 0;
}}
"""


@dataclass(frozen=True, slots=True)
class Checked:
    """What was compared.

    Attributes:
        cells: Bits of masks, a line and a combination of classes each.
        truths: Conditions over several variables, which hold or not as the inputs have it.
        unmatched: Lines that no input was found for; their bits are not compared.
    """

    cells: int
    truths: int
    unmatched: tuple[str, ...]


def _probe_c(program: Program, symbols: Symbols, table: Table) -> str:
    """C that asks both functions for the line of many inputs; see `MatcherCheck.axes` for what it reads."""
    number = program.tables.index(table)
    probe = PROBE.format(
        struct=symbols.struct,
        leaves=len(program.variables),
        function=symbols.lines[table.name],
        reference=f"ref_t{number}_line",
        defined=f"ref_t{number}_safe(&s)" if relational_tests(table) else "1",
    )
    head = [f"#include <{name}.h>" for name in ("stdio", "stdlib", "string")]
    head += [f'#include "{symbols.header}"', reference_c(program, symbols), WORDS]
    return "\n".join([*head, *set_leaves_c(program, symbols), probe])


@dataclass(slots=True)
class MatcherCheck:
    """What is asked of the matcher of one table, found once for all files that it is asked of.

    Attributes:
        program: The program.
        symbols: Names in its emitted C.
        table: One of its tables.
        known: Inputs that match lines of it; more are drawn.
    """

    program: Program
    symbols: Symbols
    table: Table
    known: Sequence[Snapshot] = ()
    edges: dict[str, tuple[int, ...]] = field(init=False)
    near: dict[str, tuple[str, ...]] = field(init=False)
    _asked: bytes = field(init=False)
    _told: Checked = field(init=False)

    def __post_init__(self) -> None:
        """Finds inputs of each line, and what is asked from there."""
        self.edges, self.near = leaf_edges(self.program), companions(self.program)
        lines, plan = self.table.lines, lower_by_force(self.program)
        starts = [self.starts(at, line) for at, line in enumerate(lines)]
        groups = next(one for one in plan.tables if one.table.name == self.table.name).matcher.groups
        asked = array("q", [sum(map(len, starts))])
        for words in (*chain(*starts), *(axes for group in groups for axes in self.axes(group))):
            asked += words
        self._asked = asked.tobytes()
        cells = sum(prod(len(probe.masks) for probe in group) for group in groups)
        unmatched = tuple(str(line.name) for line, some in zip(lines, starts, strict=True) if not some)
        truths = len(relational_tests(self.table))
        self._told = Checked(cells * (len(lines) - len(unmatched)), truths, unmatched)

    def of(self, files: Mapping[str, str]) -> Checked | tuple[str, ...] | Absent:
        """Compares the matcher in these files, text by path, with the table."""
        compiler = c_compiler()
        if isinstance(compiler, Absent):
            return compiler
        with scratch("matcher") as place:
            others = write_c(files, place)
            (place / "probe.c").write_text(_probe_c(self.program, self.symbols, self.table), "utf-8")
            (place / "in.bin").write_bytes(self._asked)
            compiled = run_command([compiler, *FLAGS, "-o", "probe", "probe.c", *others], place, COMPILE_S)
            if compiled.status != 0:
                return ("the probe does not compile", *compiled.err.strip().splitlines())
            ran = run_command([str(place / "probe"), "in.bin", "out.bin"], place, RUN_S)
            if ran.status != 0:
                return ("the C stops on some input, or does not end",)
            differing = array("q", content(place / "out.bin", MOST_OF_OURS))
        return (self.told(differing),) if differing else self._told

    def told(self, row: Sequence[int]) -> str:
        """An input on which the C gives another line than the table, in words."""
        *words, got, right = row
        values = {
            leaf.name: of_word(leaf.type, word, self.symbols.c_type(leaf.name) == "uint64_t")
            for leaf, word in zip(self.program.variables, words, strict=True)
        }
        where = ", ".join(f"{name} = {values[name]}" for name in self.table.variables)
        return f"at {where} the C gives line {got}, the table {right}"

    # --- where a line is gone on from ---

    def starts(self, at: int, line: Line) -> list["array[int]"]:
        """Inputs that match this line alone, as words."""
        most = STARTS if relational_tests(self.table) else 1
        random = Random(at)  # noqa: S311  # repeatable
        drawn = (self.drawn(line, random, calm=number % 2 == 0) for number in range(MOST_DRAWN))
        alone = (one for one in chain(self.known, drawn) if self.matches_alone(line, one))
        return [
            array("q", [to_word(v.type, one[v.name]) for v in self.program.variables])
            for one in islice(alone, most)
        ]

    def matches_alone(self, line: Line, snapshot: Snapshot) -> bool:
        """Whether the line matches, and no other; false where that is not defined."""
        return (
            may_be_matched(self.program, self.table, snapshot)
            and all(test is None or holds(test, snapshot) for test in line.tests)
            and matching_lines(self.table, snapshot) == [line.name]
        )

    def drawn(self, line: Line, random: Random, *, calm: bool) -> Snapshot:
        """A state inside the line's cells of one variable each.

        Where it is calm, the others keep their initial values; else they are on edges, half of them beside what they are
        compared with.
        """
        boxes = boxes_of(line.tests)
        keys: dict[str, int] = {}
        for variable in self.program.variables:
            if calm and variable.name not in boxes:
                keys[variable.name] = key_of(variable.type, variable.initial)
                continue
            box = boxes.get(variable.name, (key_bounds(variable.type),))
            edges = [key for key in self.edges[variable.name] if any(a <= key <= b for a, b in box)]
            near = [keys[name] for name in self.near.get(variable.name, ()) if name in keys]
            key = random.choice(edges) if edges else random.choice(box or (key_bounds(variable.type),))[0]
            if near and random.getrandbits(1):
                beside = random.choice(near) + random.choice((-1, 0, 1))
                key = beside if any(a <= beside <= b for a, b in box) else key
            keys[variable.name] = key
        return {v.name: value_of_key(v.type, keys[v.name]) for v in self.program.variables}

    # --- what is asked from there ---

    def axes(self, group: Group) -> Iterator["array[int]"]:
        """The leaves of a group with the first keys of their classes, and each of them with all of its keys.

        As words: how many leaves, their positions, how many values each takes, the values.
        """
        indices = [probe.index for probe in group if not isinstance(probe.index, Truth)]
        yield self.taking([(self.program.variable(index.leaf), _firsts(index)) for index in indices])
        for index in indices:
            leaf = self.program.variable(index.leaf)
            yield self.taking([(leaf, self.keys(leaf))])

    def taking(self, keys_of: Sequence[tuple[Variable, list[int]]]) -> "array[int]":
        """These leaves with these keys, as words."""
        leaves = (self.program.variables.index(leaf) for leaf, _ in keys_of)
        lengths = (len(keys) for _, keys in keys_of)
        values = (to_word(leaf.type, value_of_key(leaf.type, key)) for leaf, keys in keys_of for key in keys)
        return array("q", [len(keys_of), *leaves, *lengths, *values])

    def keys(self, leaf: Variable) -> list[int]:
        """The keys that a leaf takes one by one; see the module."""
        low, high = key_bounds(leaf.type)
        if high - low < EVERY_KEY and not isinstance(leaf.type, Real):
            return list(range(low, high + 1))
        boxes = (boxes_of(line.tests).get(leaf.name, ()) for line in self.table.lines)
        ends = {end for box in boxes for ends in box for end in ends}
        near = {end + step for end in ends for step in (-1, 0, 1)} | {low, high}
        return sorted(key for key in near if low <= key <= high)


def _firsts(index: Direct | Coded | Cuts) -> list[int]:
    """The first key of each class of a leaf."""
    later = (key_of(index.type, first_value(index, number)) for number in range(1, index.count))
    return [key_bounds(index.type)[0], *later]
