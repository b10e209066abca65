"""Tables of boxes against brute force: overlaps, gaps, least witnesses, regions, counts, and repairs that repair."""

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations, pairwise, permutations, product
from random import Random
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.lang.interpret import fold, matching_lines
from rcsc.lang.interval_sets import holds, joined, meet
from rcsc.lang.model import Box, Program, Scalar, key_bounds, key_of, real_key, value_of_key
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.search import furthest, halved
from rcsc.proof.table import boxes
from rcsc.proof.table import confirm as confirming
from rcsc.proof.table.confirm import Agreement, confirm
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.diagnose import diagnostics
from rcsc.proof.table.program import prove_program
from rcsc.proof.table.regions import holes, partition
from rcsc.proof.table.regions.ends import Ends
from rcsc.proof.table.repair import Partings, new_line
from rcsc.proof.table.verdict import ContradictoryAssumptions, DeadLine, Gap, Overlap, Region, Undecided
from tests.bench.made import families
from tests.support.programs.stages import BOXES, drawn_program, program_of, reported
from tests.support.programs.texts import table as table_text
from tests.support.steps import counted

HEAD = """enum colour { red, green, blue }
input a : bool
input c : colour
input n : int -1 .. 3
"""
CELLS = {
    "a": st.sampled_from(["", "", "true", "false"]),
    "c": st.sampled_from(["", "red", "/= red", "in {red, blue}", "green", "blue"]),
    "n": st.sampled_from(["", "0", "/= 1", "< 0", "<= 2", "> 1", ">= 3", "0 .. 2", "in {-1, 1, 3}"]),
}
Point = tuple[int, ...]
Matched = dict[Point, tuple[int, ...]]


@st.composite
def texts(draw: st.DrawFn, columns: str = "acn") -> str:
    """A table of up to six lines, sometimes with a DEFAULT line."""
    rows = [[f"l{at}", *(draw(CELLS[name]) for name in columns)] for at in range(draw(st.integers(1, 6)))]
    if draw(st.booleans()):
        default = draw(st.sampled_from(["DEFAULT", "DEFAULT unreachable"]))
        rows.append(["d", default, *[""] * (len(columns) - 1)])
    return written(rows, columns)


def written(rows: list[list[str]], columns: str = "acn") -> str:
    lines = "\n".join("| " + " | ".join(row) + " ||" for row in rows)
    return f"{HEAD}table t {{\n| line | {' | '.join(columns)} ||\n{lines}\n}}\n"


def matched(program: Program) -> Matched:
    """Every input in declared order, as keys, with the lines that match it."""
    keys = [range(key_bounds(v.type)[0], key_bounds(v.type)[1] + 1) for v in program.variables]
    found = {}
    for point in product(*keys):
        values = {str(v.name): value_of_key(v.type, k) for v, k in zip(program.variables, point, strict=True)}
        names = set(matching_lines(program.tables[0], values))
        found[point] = tuple(at for at, line in enumerate(program.tables[0].lines) if line.name in names)
    return found


def point_of(program: Program, witness: Any) -> Point:
    """A witness as keys; variables that the table does not test are at their least."""
    return tuple(
        key_of(v.type, witness[v.name]) if v.name in witness else key_bounds(v.type)[0]
        for v in program.variables
    )


def inside(program: Program, region: Region) -> set[Point]:
    axes = [
        [key for low, high in region.get(str(v.name), (key_bounds(v.type),)) for key in range(low, high + 1)]
        for v in program.variables
    ]
    return set(product(*axes))


def overlaps_are_right(program: Program, right: Matched, overlaps: dict[tuple[int, int], Overlap]) -> None:
    """Every pair of lines that match together is told, with its least input and all its inputs."""
    pairs = {pair for lines in right.values() for pair in combinations(lines, 2)}
    assert overlaps.keys() == pairs
    for pair, overlap in overlaps.items():
        both = [point for point, lines in right.items() if set(pair) <= set(lines)]
        assert point_of(program, overlap.witness) == min(both)
        assert overlap.region is not None
        assert inside(program, overlap.region) == set(both)  # two boxes meet in a box: it is maximal


def gaps_are_right(program: Program, right: Matched, gaps: list[Gap]) -> None:
    """Where no line matches there is a gap: its witnesses are the least, its regions maximal, its count exact."""
    bare = [point for point, lines in right.items() if not lines]
    assert bool(gaps) == bool(bare)
    for gap in gaps:
        assert point_of(program, gap.witnesses[0]) == bare[0]
        assert gap.count is None or gap.count[0] * len(right) == gap.count[1] * len(bare)
        covered: set[Point] = set()
        for witness, region in zip(gap.witnesses, gap.regions, strict=True):
            assert region is not None
            points = inside(program, region)
            assert points <= set(bare)
            at = point_of(program, witness)
            assert at in points
            assert at == min(set(bare) - covered)
            maximal(program, region, set(bare) - covered)
            covered |= points


@given(st.sampled_from(["acn", "acnn"]).flatmap(texts), st.booleans())
def test_findings_are_those_of_brute_force(text: str, counted: bool) -> None:
    """Where `n` has two columns a line may be dead, which must hide no other; counted, too, where holes are too many."""
    program = program_of(text)
    table, right = program.tables[0], matched(program)
    assert boxes.applies(table)
    with pytest.MonkeyPatch.context() as patched:
        if counted:
            patched.setattr(holes, "MOST_LOOKED_AT", 0)
        found = prove_table(program, table, Options()).findings
    overlaps_are_right(program, right, {(f.first, f.second): f for f in found if isinstance(f, Overlap)})
    gaps_are_right(program, right, [f for f in found if isinstance(f, Gap)])
    dead = {f.line for f in found if isinstance(f, DeadLine)}
    assert dead == {at for at in range(len(table.lines)) if not any(at in lines for lines in right.values())}


@pytest.mark.parametrize(
    ("lines", "variables", "widened", "fault"),
    [
        (2000, 24, 1, "ok"),
        (2000, 24, 3, "gap"),
        (256, 20, 1, "ok"),
        (1024, 20, 1, "ok"),
        (1024, 20, 5, "gap"),
        (2000, 24, 100, "gap"),
    ],
)
def test_gaps_are_found_beside_overlaps_in_large_tables(
    lines: int, variables: int, widened: int, fault: families.Fault
) -> None:
    program = program_of(families.box(lines, variables, lines, fault, widened))
    table = boxes.TableBoxes.of(program, program.tables[0])
    assert next(table.overlaps(), None) is not None
    gap = table.gap(disjoint=False)  # within its budget
    assert (gap is not None) == (fault == "gap")
    if gap is not None:
        assert not matching_lines(program.tables[0], gap.witnesses[0])
        assert gap.count is not None


SPACE = {"a": (0, 5), "b": (-2, 3), "c": (0, 1)}
BOXED = st.fixed_dictionaries(
    {},
    optional={
        name: st.sets(st.integers(low, high)).map(lambda keys: joined((key, key) for key in keys))
        for name, (low, high) in SPACE.items()
    },
)


def test_of_a_gap_that_nobody_reads_one_region_is_looked_for() -> None:
    """Whether a repair mends is a question of whether there is one; its count is exact all the same."""
    program = program_of(
        HEAD + table_text("t", "line | n | c ||", "a | 0 | red ||", "b | 2 | blue ||", "c | -1 | /= green ||")
    )
    told, bare = (
        prove_table(program, program.tables[0], Options(bare=bare, solver="boxes")).findings
        for bare in (False, True)
    )
    [every], [one] = ([each for each in found if isinstance(each, Gap)] for found in (told, bare))
    assert len(every.witnesses) > 2
    assert one.witnesses == every.witnesses[:1]
    assert one.count == every.count


@given(st.lists(BOXED, max_size=6), st.lists(BOXED, max_size=3))
def test_holes_are_all_that_no_box_fills_each_place_in_one(
    lines: list[dict[str, Box]], regions: list[dict[str, Box]]
) -> None:
    """Also once regions are taken out of them, whether these meet lines and one another or not."""
    found = holes.holes_between(SPACE, lines)
    for region in [None, *regions]:
        assert found is not None
        if region is not None:
            found = list(holes.without(found, region, SPACE))
            lines = [*lines, region]
        for point in product(*(range(low, high + 1) for low, high in SPACE.values())):
            at = dict(zip(SPACE, point, strict=True))
            filled = any(all(holds(box, at[name]) for name, box in line.items()) for line in lines)
            over = [hole for hole in found if all(a <= at[name] <= b for name, (a, b) in hole.items())]
            assert len(over) == (not filled)


@given(st.lists(BOXED, max_size=8))
def test_each_pair_of_disjoint_lines_is_parted_by_the_first_axis_that_does(
    lines: list[dict[str, Box]],
) -> None:
    apart: list[dict[str, Box]] = []
    for line in lines:
        if all(line.values()) and all(partition.common(line, other) is None for other in apart):
            apart.append(line)
    assert partition.parting(apart) == tuple(
        next(name for name, box in one.items() if name in other and not meet(box, other[name]))
        for one, other in combinations(apart, 2)
    )


@pytest.mark.parametrize(("widened", "looks"), [(0, 20_000), (40, 60_000), (100, 150_000), (300, 900_000)])
def test_what_crossing_lines_leave_open_is_found_by_few_looks(
    monkeypatch: pytest.MonkeyPatch, widened: int, looks: int
) -> None:
    """About as many for each of the 1000 lines as the tree of cuts is deep; more, the more of them cross."""
    monkeypatch.setattr(holes, "MOST_LOOKED_AT", looks)
    table = program_of(families.box(1000, 24, 7, "gap", widened))
    decided = boxes.TableBoxes.of(table, table.tables[0])
    assert holes.holes_between(decided.extents, decided.lines) is not None


def test_masks_say_which_lines_are_near(monkeypatch: pytest.MonkeyPatch) -> None:
    """Regions are grown and slices searched without looking at one line after the other: that would take ten times as many looks."""
    program = program_of(families.box(250, 24, 0, "gap", 8))
    looks = 0

    def counted(look: Callable[..., Any]) -> Callable[..., Any]:
        def one_more(*keys: Any) -> Any:
            nonlocal looks
            looks += 1
            return look(*keys)

        return one_more

    for name in ("holds", "meet"):
        monkeypatch.setattr(partition, name, counted(getattr(partition, name)))
    found = prove_table(program, program.tables[0], BOXES).findings
    assert any(isinstance(wrong, Gap) for wrong in found)
    assert any(isinstance(wrong, Overlap) for wrong in found)
    assert looks < 160 * 250


@pytest.mark.parametrize(("widened", "exact"), [(10, True), (40, False)])
def test_a_search_for_gaps_is_undecided_past_its_budget_where_it_may_look_in_vain(
    monkeypatch: pytest.MonkeyPatch, widened: int, exact: bool
) -> None:
    program = program_of(families.box(40, 9, 1, "gap", widened))
    monkeypatch.setattr(holes, "MOST_LOOKED_AT", 0)
    monkeypatch.setattr(partition, "BUDGET", 30)
    found = prove_table(program, program.tables[0], BOXES).findings
    assert any(isinstance(wrong, Gap) for wrong in found) is exact
    assert any(isinstance(wrong, Undecided) for wrong in found) is not exact


def test_a_report_of_very_many_overlaps_ends() -> None:
    rows = [[f"l{at}", "", "", ""] for at in range(300)]
    program = program_of(written(rows))
    found = prove_table(program, program.tables[0], BOXES)
    assert len(found.findings) == partition.MOST_PAIRS
    assert "at least" in diagnostics(program, found, Options())[-1].message


def maximal(program: Program, region: Region, bare: set[Point]) -> None:
    """No variable of a region can have a neighbouring key too."""
    for variable in program.variables:
        name, (least, most) = str(variable.name), key_bounds(variable.type)
        for low, high in region.get(name, ()):
            for more in (low - 1, high + 1):
                if least <= more <= most and not any(a <= more <= b for a, b in region[name]):
                    wider = {**region, name: (*region[name], (more, more))}
                    assert not inside(program, wider) <= bare


@given(texts())
def test_a_repair_that_is_shown_repairs(text: str) -> None:
    program = program_of(text)
    table, right = program.tables[0], matched(program)
    for found in prove_table(program, table, Options()).findings:
        if isinstance(found, Overlap) and (cell := Partings(program, table).best(found)):
            said = re.fullmatch(r"in line `(l\d)` write `(.*)` under `(.)`", cell.write(table))
            assert said is not None, cell
            after = matched(program_of(changed(text, said[1], said[3], said[2])))
            assert not any({found.first, found.second} <= set(lines) for lines in after.values())
            assert not any(right[p] and not lines for p, lines in after.items()), "it opened a gap"
            assert all(set(lines) <= set(right[p]) for p, lines in after.items()), "it made an overlap"
        if isinstance(found, Gap) and (line := new_line(program, table, found)):
            row = re.search(r"`(\|.*\|\|) \.\.\. \|`", line.told)
            assert row is not None, line
            after = matched(program_of(with_row(text, row[1])))
            new = [p for p in right if len(after[p]) > len(right[p])]
            assert new, "it closed nothing"
            assert not any(right[p] for p in new), "it made an overlap"


ACROSS = {
    "n": st.sampled_from(["", "0", "< m", ">= m", "/= m", "<= 2", "0 .. m"]),
    "n - m": st.sampled_from(["", "0", "> 1", "<= 0", "/= 2", "-1 .. 1"]),
    "when": st.sampled_from(["", "a or n > m", "a implies n = m", "n * m > 1"]),
    "a": st.sampled_from(["", "true", "false"]),
}
"""Cells of columns across variables: `n * m` is for a solver, and no part of a row that is proposed."""


@given(
    st.lists(st.tuples(*ACROSS.values()), min_size=1, max_size=4),
    st.sampled_from(["", "a", "n < m", "n + m > 1 or a"]),
)
def test_a_line_across_variables_that_is_shown_closes_what_it_says(
    rows: list[tuple[str, ...]], assumed: str
) -> None:
    """Over every input that the assumption allows: it meets no line, fills something, and fills all where it says so."""
    head = "input a : bool\ninput n : int -1 .. 3\ninput m : int 0 .. 3\n"
    head += f"assume so assumed : {assumed}\n" if assumed else ""
    texts = [f"l{at} | {' | '.join(row)} ||" for at, row in enumerate(rows)]
    heading = f"line | {' | '.join(ACROSS)} ||"
    assuming = "so" if assumed else ""
    program = drawn_program(head + table_text("t", heading, *texts, assuming=assuming), "RCS301", "RCS306")
    verdict = prove_table(program, program.tables[0], Options())
    gaps = [finding for finding in verdict.findings if isinstance(finding, Gap)]
    if not gaps or (line := new_line(program, program.tables[0], gaps[0])) is None:
        return
    row = re.search(r"`\| (.*\|\|) \.\.\. \|`", line.told)
    assert row is not None, line
    mended = program_of(head + table_text("t", heading, *texts, row[1], assuming=assuming))
    filled = False
    for a, n, m in product((False, True), range(-1, 4), range(4)):
        at = {"a": a, "n": n, "m": m}
        if any(not fold(one.condition, at) for one in mended.assumptions):
            continue
        lines = matching_lines(mended.tables[0], at)
        assert not ("new" in lines and len(lines) > 1), (at, line)
        assert lines or not line.closes, (at, line)
        filled |= "new" in lines
    assert filled


def test_a_table_with_as_many_pairs_as_nobody_looks_at_gets_no_line(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "input n : int 0 .. 9\ninput m : int 0 .. 9\n" + table_text("t", "line | n ||", "low | < m ||")
    program = program_of(text)
    [gap] = prove_table(program, program.tables[0], Options()).findings
    assert isinstance(gap, Gap)
    line = new_line(program, program.tables[0], gap)
    assert line is not None
    assert line.told == "a line `| new | >= m || ... |` closes the gap and overlaps no other"
    monkeypatch.setattr("rcsc.proof.table.repair.MOST_ASKED", 0)
    assert new_line(program, program.tables[0], gap) is None


def changed(text: str, line: str, column: str, cell: str) -> str:
    """The text with one cell replaced."""
    rows = []
    for row in text.splitlines():
        cells = row.split("|")
        if len(cells) > 2 and cells[1].strip() == line:
            cells[2 + "acn".index(column)] = f" {cell} "
        rows.append("|".join(cells))
    return "\n".join(rows) + "\n"


def with_row(text: str, row: str) -> str:
    """The text with a row more, before its DEFAULT line."""
    lines = text.splitlines()
    at = next((at for at, line in enumerate(lines) if "DEFAULT" in line), len(lines) - 1)
    return "\n".join([*lines[:at], row, *lines[at:]]) + "\n"


@given(st.integers(-(2**64), 2**64), st.integers(0, 2**70), st.data())
def test_furthest_is_the_last_that_fits_and_asks_little(start: int, length: int, data: st.DataObject) -> None:
    end = start + length
    last = data.draw(st.one_of(st.sampled_from([start, end]), st.integers(start, end)))
    asked: list[int] = []

    def fits(at: int) -> bool:
        asked.append(at)
        return at <= last

    assert furthest(start, end, fits) == last
    assert all(start < at <= end for at in asked)
    assert len(asked) <= (1 if last == end else 2 + length.bit_length())


@given(st.integers(0, 40), st.sets(st.integers(0, 39), max_size=3))
def test_halved_yields_what_stands_out_and_asks_little(count: int, odd: set[int]) -> None:
    asked: list[range] = []

    def settled(items: Sequence[int]) -> bool:
        asked.append(range(items[0], items[-1] + 1))
        return not odd.intersection(items)

    standing_out = [at for at in range(count) if at in odd]
    assert list(halved(range(count), settled)) == standing_out
    assert len(asked) <= min(1, count) + 2 * len(standing_out) * count.bit_length()


@given(st.sets(st.integers(0, 12)))
def test_joined_is_what_was_apart_and_no_neighbours(keys: set[int]) -> None:
    found = joined((key, key) for key in sorted(keys))
    assert {at for low, high in found for at in range(low, high + 1)} == keys
    assert all(one[1] + 1 < two[0] for one, two in pairwise(found))


# --- what Z3 says of a verdict ---


PARTED = {
    "right": ("<= 1", "> 1"),
    "gap": ("<= 0", "> 1"),
    "overlap": ("<= 1", "> 0"),
    "gap and overlap": ("<= 1", "in {1, 3}"),
}
ANSWERED = {
    name: program_of(written([["x", "", "", low], ["y", "", "", high]]))
    for name, (low, high) in PARTED.items()
}


@pytest.mark.parametrize("solver", ["auto", "both"])
@pytest.mark.parametrize(("asked", "claimed"), list(product(PARTED, PARTED)))
def test_z3_disagrees_with_every_verdict_that_is_of_another_kind(
    asked: str, claimed: str, solver: Literal["auto", "both"]
) -> None:
    other, program = ANSWERED[claimed], ANSWERED[asked]
    found = prove_table(other, other.tables[0], BOXES).findings
    agreed = confirm(program, program.tables[0], found, Options(solver=solver))
    assert agreed is (Agreement.AGREES if asked == claimed else Agreement.DISAGREES)


@pytest.mark.parametrize(("asked", "claimed"), list(permutations(PARTED, 2)))
def test_a_verdict_that_z3_disagrees_with_is_told_as_a_fault_of_rcsc(
    monkeypatch: pytest.MonkeyPatch, asked: str, claimed: str
) -> None:
    other, program = ANSWERED[claimed], ANSWERED[asked]
    claim = prove_table(other, other.tables[0], BOXES).findings
    monkeypatch.setattr("rcsc.proof.table.decide._by_boxes", lambda *_: claim)
    monkeypatch.setattr("rcsc.proof.table.decide.box_certificate", lambda *_: {})
    verdict = prove_program(program, Options())
    assert verdict.proved is None
    assert not verdict.tables[0].backing.confirmed_by_z3
    assert Code.SOLVERS_DISAGREE in {finding.code for finding in verdict.findings}


def test_z3_need_not_say_whether_default_runs_where_no_gap_is_told() -> None:
    program = program_of(written([["x", "", "", "<= 0"], ["y", "", "", "> 1"], ["d", "DEFAULT", "", ""]]))
    assert confirm(program, program.tables[0], (), Options()) is Agreement.AGREES


@pytest.mark.parametrize(
    ("low", "rest", "kept"),
    [("<= 1", "", True), ("<= 0", "", False), ("<= 0", "| d | DEFAULT | | ||\n", True)],
)
def test_what_z3_alone_decides_has_a_certificate_where_nothing_is_wrong(
    low: str, rest: str, kept: bool
) -> None:
    program = program_of(written([["x", "", "", low], ["y", "", "", "> 1"]]).replace("\n}", f"\n{rest}}}"))
    verdict = prove_table(program, program.tables[0], Options(solver="z3"))
    assert (verdict.certificate is not None) == kept


STATED = 2 * confirming._OF_A_CELL
"""What it costs to put the two conditions of these tables into Z3's words."""


@pytest.mark.parametrize(("options", "small", "budget", "agreed"), [
    (Options(solver="boxes"), 4, STATED, Agreement.NOT_ASKED), (Options(solver="z3"), 4, STATED, Agreement.NOT_ASKED),
    (Options(), 4, 0, Agreement.AGREES), (Options(), 3, STATED + 10_000, Agreement.AGREES),
    (Options(), 3, STATED + 1, Agreement.UNKNOWN), (Options(), 3, STATED, Agreement.NOT_ASKED),
    (Options(brief=True), 3, STATED + 10_000, Agreement.NOT_ASKED), (Options(brief=True), 4, 0, Agreement.AGREES),
    (Options(solver="both"), 3, 0, Agreement.AGREES),
])  # fmt: skip
def test_z3_is_asked_as_the_options_say(
    monkeypatch: pytest.MonkeyPatch, options: Options, small: int, budget: int, agreed: Agreement
) -> None:
    """Of a table of more than so many lines times cells (here two times two), within a budget of steps."""
    program = ANSWERED["right"]
    monkeypatch.setattr(confirming, "_SMALL", small)
    monkeypatch.setattr(confirming, "_OF_A_LARGE_TABLE", budget)
    assert confirm(program, program.tables[0], (), options) is agreed
    verdict = prove_table(program, program.tables[0], options)
    assert (verdict.findings, verdict.backing.confirmed_by_z3) == ((), agreed is Agreement.AGREES)
    undecided = confirm(program, program.tables[0], (Undecided("too large"),), options)
    assert undecided is Agreement.NOT_ASKED


def test_z3_out_of_steps_confirms_nothing() -> None:
    program = ANSWERED["gap"]
    options = Options(solver="both", steps=1)
    assert confirm(program, program.tables[0], (), options) is Agreement.UNKNOWN
    assert not prove_table(program, program.tables[0], options).backing.confirmed_by_z3


ALLOWED = [
    ("n > 0", True), ("n > 0 and n < 1", False), ("a and n = 3", True), ("a = (not a)", False), ("n + n = 1", False), ("n * 2 = 6", True),
    ("c = colour.red and c in {colour.green, colour.blue}", False), ("n < 0 implies n > 5", True), ("real(n) > 3.0", False),
]  # fmt: skip


@pytest.mark.parametrize("column", ["n", "n + n"])
@pytest.mark.parametrize(("claim", "possible"), ALLOWED)
def test_a_table_is_not_decided_under_what_cannot_hold(column: str, claim: str, possible: bool) -> None:
    text = f"assume it assumed : {claim}\ntable t assuming it {{\n| line | {column} | n ||\n| x | <= 1 | ||\n| y | > 1 | ||\n}}\n"
    program = program_of(HEAD + text)
    options = BOXES
    [whole] = prove_program(program, options).tables
    assert any(isinstance(wrong, ContradictoryAssumptions) for wrong in whole.findings) is not possible
    assert not any(isinstance(wrong, Gap | Overlap | Undecided) for wrong in whole.findings)
    if "n" in re.findall(r"\w+", claim):  # what the table reads: found where it is decided
        alone = prove_table(program, program.tables[0], options).findings
        assert any(isinstance(wrong, ContradictoryAssumptions) for wrong in alone) is not possible


@pytest.mark.parametrize("many", [False, True])
def test_without_the_crossing_lines_no_two_overlap(monkeypatch: pytest.MonkeyPatch, many: bool) -> None:
    if many:
        monkeypatch.setattr(partition, "MOST_PAIRS", 0)
    for chosen in product((False, True), repeat=10):  # every graph of five lines
        pairs = [pair for pair, meet in zip(combinations(range(5), 2), chosen, strict=True) if meet]
        met: dict[int, int] = {}
        for first, second in pairs:
            met[first] = met.get(first, 0) | 1 << second
        near, crossing = partition._crossing(met)
        assert all(first in crossing or second in crossing for first, second in pairs)
        if not (many and pairs):
            wanted = {at: {a + b - at for a, b in pairs if at in (a, b)} for at in range(5)}
            assert {at: set(partition.bits_of(mask)) for at, mask in near.items()} == {
                at: others for at, others in wanted.items() if others
            }


def test_a_gap_is_found_where_overlaps_are_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a part that is searched in vain: what was learnt there is of those lines alone."""
    monkeypatch.setattr(partition.Counting, "_count", lambda *_: False)
    monkeypatch.setattr(holes, "MOST_LOOKED_AT", 0)
    rows = ("false | 0 .. 2", "false | 1 .. 3", "true | 0 .. 1", "true | 1 .. 2")
    lines = "".join(f"| l{at} | {row} ||\n" for at, row in enumerate(rows))
    program = program_of(f"input a : bool\ninput b : int 0 .. 3\ntable t {{\n| line | a | b ||\n{lines}}}\n")
    [found] = prove_program(program, Options(solver="boxes")).tables
    [gap] = [one for one in found.findings if isinstance(one, Gap)]
    assert gap.witnesses == ({"a": True, "b": 3},)


INTERVALS = st.lists(
    st.tuples(st.integers(0, 9), st.integers(0, 9)).map(lambda ends: (min(ends), max(ends))), max_size=3
)


@given(INTERVALS.map(joined), INTERVALS.map(joined))
def test_what_meets_is_what_both_have(one: Box, other: Box) -> None:
    both = {key for key in range(-1, 11) if holds(one, key) and holds(other, key)}
    found = meet(one, other)
    assert both == {key for low, high in found for key in range(low, high + 1)}
    assert list(found) == sorted(found)


def test_boxes_of_many_intervals_meet_in_few_steps() -> None:
    """Each with each took 3 s of a check of fourteen lines of masks over a byte."""
    many: Box = tuple((at, at) for at in range(0, 2_000, 2))
    with counted(30_000):
        assert meet(many, many) == many


def test_what_lines_fill_together_is_counted_once_however_many_meet() -> None:
    """Of five lines of two axes drawn 300 times; the count is exact."""
    draw, extent = Random(7), (0, 4)  # noqa: S311 - the same lines in every run
    for _ in range(300):
        spans = [[sorted((draw.randint(0, 4), draw.randint(0, 4))) for _ in "xy"] for _ in range(5)]
        lines: list[Mapping[str, Box]] = [
            {name: ((low, high),) for name, (low, high) in zip("xy", line, strict=True)} for line in spans
        ]
        table = partition.Boxes({"x": extent, "y": extent}, lines)
        counting = partition.Counting(table, dict(table.meeting()))
        filled = sum(
            any(all(low <= key <= high for key, (low, high) in zip(at, line, strict=True)) for line in spans)
            for at in product(range(5), repeat=2)
        )
        assert counting.exact
        assert sum(piece.sign * piece.sizes[0] for piece in counting.pieces) == filled, spans


def test_a_dead_line_meets_none_and_hides_no_other() -> None:
    axes = {"x": (0, 9), "y": (0, 9)}
    lines: list[Mapping[str, Box]] = [{"x": ()}, {"x": ((0, 4),)}, {"y": ((3, 9),)}]
    assert list(partition.Boxes(axes, lines).overlaps()) == [(1, 2)]


def test_the_region_of_an_overlap_names_no_variable_that_may_be_anything() -> None:
    text = HEAD + table_text("t", "line | n | a ||", "l | -1 .. 3 | true ||", "m | -1 .. 3 | true ||")
    program = program_of(text)
    findings = prove_table(program, program.tables[0], BOXES).findings
    [found] = [each for each in findings if isinstance(each, Overlap)]
    assert found.region == {"a": ((1, 1),)}


@given(st.lists(INTERVALS.map(tuple), min_size=1, max_size=4), INTERVALS)
def test_slices_say_which_lines_hold_and_meet(stated: list[Box], asked: list[tuple[int, int]]) -> None:
    """Whatever intervals a box is written in."""
    by_box: dict[Box, int] = {}
    for at, box in enumerate(stated):
        by_box[box] = by_box.get(box, 0) | 1 << at
    axis = partition.Sliced.of((0, 9), by_box, 1 << len(stated))
    lines = [*stated, ((0, 9),)]
    for (low, high), mask in zip(axis.cuts, axis.masks, strict=True):
        for key in range(low, high + 1):
            assert mask == sum(1 << at for at, box in enumerate(lines) if holds(box, key))
    near = axis.meeting(tuple(asked))
    met = sum(1 << at for at, box in enumerate(lines) if meet(box, tuple(asked)))
    assert near & met == met
    for (low, high), holding in axis.runs(near):
        assert holding == axis.meeting(((low, high),)) & near


def test_z3_is_told_only_of_what_a_table_and_its_assumptions_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted: of a level with many tables each reads few of the variables, and Z3 was told of all for each."""
    told: list[str] = []
    plain = smt.variable

    def counted(name: str, kind: Scalar) -> smt.Term:
        told.append(name)
        return plain(name, kind)

    monkeypatch.setattr(smt, "variable", counted)
    declared = "".join(f"input v{at} : int 0 .. 9\n" for at in range(40))
    program = program_of(
        f"{declared}assume near monitored : v2 <= v3\n"
        "table t assuming near {\n| line | v1 | when ||\n|---|---|---||\n"
        "| low | < 5 | v2 <= v3 ||\n| high | >= 5 | ||\n}\n"
    )
    assert confirm(program, program.tables[0], (), Options(solver="both")) is Agreement.AGREES
    assert sorted(name for name in told if "!" not in name) == ["v1", "v2", "v3"]


TOUCHING = {
    "real 0.0 .. 100.0": ("12.5", "50.0"),
    "real -1.7976931348623157e308 .. 1.7976931348623157e308": ("-1.0", "1.0"),
    "single -3.4028234663852886e38 .. 3.4028234663852886e38": ("0.5", "1.5"),
    "int -9223372036854775808 .. 9223372036854775807": ("-9000000000000000000", "9000000000000000000"),
    "int 0 .. 18446744073709551615": ("1", "18446744073709551614"),
}


@pytest.mark.parametrize("kind", TOUCHING)
def test_ranges_that_touch_over_the_widest_types_are_told_in_few_steps(kind: str) -> None:
    """Two overlaps have helps of one cell, and what these do together walks no range of keys."""
    low, high = TOUCHING[kind]
    with counted(400_000):
        found = reported(
            f"input x : {kind}\ninput y : {kind}\noutput o : bool\ntable t {{\n  | line | x | y || o |\n"
            f"  | a | <= {low} | || true |\n  | b | {low} .. {high} | || false |\n  | c | >= {high} | /= {low} || true |\n}}\n"
        )
    overlaps = [each for each in found if each.code is Code.OVERLAP]
    assert len(overlaps) == 2
    assert any("together: proved that no two lines match any more" in note for note in overlaps[-1].notes)


def test_keys_are_shown_as_values_of_their_types() -> None:
    program = program_of(
        "input n : int 1 .. 9\ninput p : bool\ninput r : real -1.0 .. 1.0\nenum e { a, b, c }\ninput m : e\n"
        "table t {\n| line | n | p | r | m ||\n| one | < 5 | true | < 0.5 | in {b, c} ||\n}\n"
    )
    table = boxes.TableBoxes.of(program, program.tables[0])
    assert table.witness({}) == {"n": 1, "p": False, "r": -1.0, "m": 0}
    shown = table.witness({"n": 3, "p": 1, "r": real_key(0.5), "m": 2})
    assert shown == {"n": 3, "p": True, "r": 0.5, "m": 2}
    assert [type(value) for value in shown.values()] == [int, bool, float, int]


def test_a_search_goes_on_only_where_lines_do_not_fill_a_slice() -> None:
    """Of ten slices of `a` one is not filled, though a line that does not look at `a` is in all of them."""
    lines: list[Mapping[str, Box]] = [
        {"b": ((0, 4),)},
        {"a": ((0, 8),), "b": ((5, 9),)},
        {"a": ((9, 9),), "b": ((5, 8),)},
    ]
    gaps = partition.Gaps.of(partition.Boxes({"a": (0, 9), "b": (0, 9)}, lines), disjoint=True)
    [(bounds, _)] = gaps._short(0, 7, gaps._axes(())["a"], gaps.pieces)
    assert bounds == (9, 9)
    assert gaps.least(()) == {"a": (9, 9), "b": (9, 9)}


def test_what_is_not_defined_at_an_input_that_z3_gives_does_not_hold_there() -> None:
    program = program_of(
        "input a : int 0 .. 9\ntable t {\n| line | 9 / a ||\n| x | > 2 ||\n| y | <= 2 ||\n}\n"
    )
    [test] = program.tables[0].lines[0].stated
    assert [confirming._is_so(test, {"a": a}) for a in (0, 1, 9)] == [False, True, False]


def test_z3_is_asked_of_a_gap_at_the_input_that_is_known() -> None:
    """To find one takes it more steps than it gets."""
    program = program_of(
        "input a : int 0 .. 1000000\ninput b : int 0 .. 1000000\ninput c : int 0 .. 1000000\n"
        "table t {\n| line | when ||\n| one | a * b * c /= 999923001838986077 ||\n}\n"
    )
    gap = Gap(({"a": 999983, "b": 999979, "c": 999961},), (None,))
    asked = program, program.tables[0], (gap,), Options(solver="both", steps=20_000)
    assert confirm(*asked) is Agreement.AGREES


def test_the_cut_is_the_one_that_leaves_most_on_its_lesser_side() -> None:
    ends = Ends({at: [(0, (2 * at, 2 * at + 1))] for at in range(4)})
    best, kept = holes._best(holes._Part({}, ends.everyone, ends.cuts))
    assert best is not None
    assert (best.at, [cut.at for cut in kept]) == (3, [-1, 1, 3, 5, 7])


def test_of_a_word_the_patterns_of_the_bits_that_lines_read_are_counted() -> None:
    program = program_of(
        "input w : int 0 .. 255\ntable t {\n| line | w ||\n| a | 0bxxxxxx1x ||\n| b | 0bxxxxxx00 ||\n}\n"
    )
    [gap] = prove_table(program, program.tables[0], BOXES).findings
    assert isinstance(gap, Gap)
    assert (gap.witnesses, gap.count, gap.patterns) == (({"w": 1},), (64, 256), (1, 4))
