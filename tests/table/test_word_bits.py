"""Tables of masks and fields of words against every value: shares, least witnesses, regions, repairs, certificates, C."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.code.emit import emitted
from rcsc.code.emit.lower import lower
from rcsc.lang.interpret import matching_lines
from rcsc.lang.interval_sets import holds
from rcsc.lang.model import Program, key_of
from rcsc.proof.certify import check_certificate
from rcsc.proof.solvers.options import Options
from rcsc.proof.table import boxes
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.program import prove_program
from rcsc.proof.table.regions.word_bits import Part, words_of
from rcsc.proof.table.repair import Partings, new_line, with_cells
from rcsc.proof.table.verdict import DeadLine, Gap, Overlap, Region
from tests.support.programs.stages import program_of

ALONE = Options(solver="boxes")
HEAD = "input w : int 0 .. 63\ninput b : bool\n"
DIGITS = st.text("01xxx", min_size=4, max_size=4)
CELLS = {
    "w": st.one_of(
        st.just(""),
        st.builds("0bxx_{}".format, DIGITS),
        st.builds("0b{}_xx".format, DIGITS),
        st.sampled_from(["5", "63", "= 0", "0b01_xx01, 0b10_xx01"]),
    ),
    "w[4..1]": st.one_of(
        st.just(""),
        st.sampled_from(["< 5", "3 .. 9", "in {1, 4, 15}", "not in {2, 3}"]),
        st.builds("0b{}".format, DIGITS),
    ),
    "w[5]": st.sampled_from(["", "", "true", "false"]),
    "b": st.sampled_from(["", "", "true", "false"]),
}
COLUMNS = tuple(CELLS)


@st.composite
def tables(draw: st.DrawFn) -> Program:
    """A table of up to five lines, sometimes with a DEFAULT line."""
    rows = [[f"l{at}", *(draw(CELLS[name]) for name in COLUMNS)] for at in range(draw(st.integers(1, 5)))]
    if draw(st.booleans()):
        rows.append(["d", "DEFAULT", *[""] * (len(COLUMNS) - 1)])
    lines = "\n".join("| " + " | ".join(row) + " ||" for row in rows)
    return program_of(f"{HEAD}table t {{\n| line | {' | '.join(COLUMNS)} ||\n{lines}\n}}\n")


def matched(program: Program) -> dict[tuple[int, bool], list[str]]:
    """The lines that match, for every input."""
    [table] = program.tables
    return {(w, b): list(matching_lines(table, {"w": w, "b": b})) for w in range(64) for b in (False, True)}


def inside(region: Region, point: tuple[int, bool]) -> bool:
    """Whether an input lies in a region of leaves and parts of words."""
    for name, box in region.items():
        part = Part.named(name)
        key = int(point[1]) if part is None else point[0] >> part.low & part.kind.high
        if part is None and name == "w":
            key = point[0]
        if not holds(box, key):
            return False
    return True


@given(tables())
def test_what_is_found_is_what_every_value_shows(program: Program) -> None:
    [table] = program.tables
    names = [line.name for line in table.lines]
    every = {point: [name for name in lines if name in names] for point, lines in matched(program).items()}
    words = words_of(program, table)
    if words is None or not set(table.variables) <= {"w", "b"}:
        return
    verdict = prove_table(program, table, ALONE)
    inputs = [
        point
        for point in every
        if ("w" in table.variables or not point[0]) and ("b" in table.variables or not point[1])
    ]
    gaps = [point for point in inputs if not every[point]]
    gap = next((finding for finding in verdict.findings if isinstance(finding, Gap)), None)
    assert bool(gaps) == (gap is not None)
    if gap is not None:
        assert (gap.witnesses[0].get("w", 0), bool(gap.witnesses[0].get("b", False))) == least(program, gaps)
        if gap.count is not None:
            assert gap.count == (len(gaps), len(inputs))
            if gap.patterns is not None:
                assert gap.patterns[0] * len(inputs) == gap.patterns[1] * len(gaps)
        for region, witness in zip(gap.regions, gap.witnesses, strict=True):
            assert region is not None
            assert inside(region, (int(witness.get("w", 0)), bool(witness.get("b", False))))
            assert not any(every[point] for point in inputs if inside(region, point))
    for finding in verdict.findings:
        if isinstance(finding, Overlap):
            pair = {names[finding.first], names[finding.second]}
            both = [point for point in inputs if pair <= set(every[point])]
            assert (finding.witness.get("w", 0), bool(finding.witness.get("b", False))) == least(
                program, both
            )
            assert [point for point in inputs if inside(finding.region or {}, point)] == both
    overlapping = {
        frozenset((names[f.first], names[f.second])) for f in verdict.findings if isinstance(f, Overlap)
    }
    assert overlapping == {
        frozenset((x, y)) for lines in every.values() for x in lines for y in lines if x != y
    }
    dead = {names[f.line] for f in verdict.findings if isinstance(f, DeadLine)}
    assert dead == set(names) - {name for lines in every.values() for name in lines}


def least(program: Program, points: list[tuple[int, bool]]) -> tuple[int, bool]:
    """The least input in declared order."""
    kinds = {str(v.name): v.type for v in program.variables}
    return min(points, key=lambda point: (key_of(kinds["w"], point[0]), point[1]))


@given(tables())
def test_what_is_proposed_repairs(program: Program) -> None:
    [table] = program.tables
    if words_of(program, table) is None:
        return
    verdict = prove_table(program, table, ALONE)
    before = matched(program)
    for finding in verdict.findings:
        if isinstance(finding, Gap) and table.default is None:
            line = new_line(program, table, finding)
            row = None if line is None else re.search(r"`\| (.*?) \|\| \.\.\. \|`", line.told)
            if row is not None:
                after = matched(program_of(with_row(program, row[1])))
                assert sum(map(bool, after.values())) > sum(map(bool, before.values()))
                assert all(len(after[point]) == len(lines) for point, lines in before.items() if lines)
        if isinstance(finding, Overlap):
            for cell in Partings(program, table).cells(finding)[:3]:
                changed = with_cells(program, table, (cell,))
                assert changed is not None
                pair = {table.lines[finding.first].name, table.lines[finding.second].name}
                for w in range(64):
                    for b in (False, True):
                        now = set(matching_lines(changed, {"w": w, "b": b}))
                        assert not pair <= now
                        assert now or not before[w, b] or cell.falls


def with_row(program: Program, row: str) -> str:
    """The text of the table with a row more."""
    [table] = program.tables
    cells = [" | ".join(test.text if test else "" for test in line.tests) for line in table.lines]
    rows = [*(f"l{at} | {cell}" for at, cell in enumerate(cells)), row]
    return (
        f"{HEAD}table t {{\n| line | {' | '.join(COLUMNS)} ||\n"
        + "".join(f"| {each} ||\n" for each in rows)
        + "}\n"
    )


STATUS = """
input statusword : int 0 .. 65535
output shown : int 0 .. 9
table status {
  | line  | statusword[7..0]     || shown |
  |-------|----------------------||-------|
  | off   | x0xx 0000, x1xx 0000 || 0     |
  | ready | x01x 0001            || 1     |
  | on    | x01x 0011, x01x 0111 || 2     |
  | stop  | x00x 0111            || 3     |
  | react | x0xx 1xx1            || 4     |
  | fault | x0xx 1xx0            || 5     |
  | none  | DEFAULT              || 9     |
}
"""


def test_a_right_table_of_masks_is_proved_certified_and_compiled_to_masks() -> None:
    program = program_of(STATUS)
    verdict = prove_program(program, Options())
    assert verdict.proved is not None
    assert verdict.tables[0].backing.method == "boxes"
    assert verdict.certificate is not None
    assert not check_certificate(program, verdict.certificate)
    text = "".join(emitted(lower(verdict.proved), ("c",)).values())
    assert "((s->statusword & 0x6fu) == 0x21u)" in text
    assert not re.search(r"statusword [/%]", text)


def test_words_that_are_no_power_of_two_are_not_split() -> None:
    program = program_of(STATUS.replace("65535", "65000"))
    assert words_of(program, program.tables[0]) is None
    assert not boxes.applies(program.tables[0])


@pytest.mark.parametrize(
    ("cell", "kept"),
    [
        ("statusword[15] and statusword[3..0] < 3", ["15", "3..0"]),
        ("statusword[11..4] = 7 or statusword[9] and statusword[5]", ["11..4"]),
        ("statusword[5] = statusword[6]", ["6..5"]),
    ],
)
def test_bits_that_are_looked_at_together_stay_together(cell: str, kept: list[str]) -> None:
    text = f"input statusword : int 0 .. 65535\ntable t {{\n| line | when ||\n| a | {cell} ||\n| d | DEFAULT ||\n}}"
    program = program_of(text)
    words = words_of(program, program.tables[0])
    assert words is not None
    names = [part.name.removeprefix("statusword[").removesuffix("]") for part in words["statusword"]]
    for ends in kept:
        assert (ends if ".." in ends else f"{ends}..{ends}") in names
    verdict = prove_table(program, program.tables[0], ALONE)
    [gap] = verdict.findings
    assert isinstance(gap, Gap)
    rest = sum(not matching_lines(program.tables[0], {"statusword": w}) for w in range(65536))
    assert gap.count == (rest, 65536)
