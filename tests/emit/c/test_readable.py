"""The C reads back to its table: names for numbers, short lines, what each case and each mask is of, and nothing around it."""

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.code.emit import emitted
from rcsc.code.emit.generated import write
from rcsc.code.emit.lower import lower, lower_by_force
from rcsc.code.emit.rendering import WIDTH, folded
from tests.support.programs.stages import verdict_of

GENERATED = Path(__file__).parents[3] / "generated/c"
SHIPPED = sorted(path.name for path in GENERATED.glob("*.[ch]"))
PROGRAMS = ("task", "emove", "primitive", "vision", "gripper", "approach")

MIXED = """enum mode { idle, moving, failed }
input told : mode
input level : int 0 .. 100 [mm]
input slope : int -20 .. 20
input distance : int 0 .. 5000000000
state now : mode
state count : int 0 .. 200
state twice : int -200 .. 300
state further : int 0 .. 5000000001
invariant small : count <= 200
procedure compute {
  twice := slope + count
  further := distance + 1
  for k in 0 .. 3 { if count < 200 { count := count + 1 } }
}
table run {
  | line  | told                | level        || now    | procedures |
  |-------|---------------------|--------------||--------|------------|
  | rests | idle                |              || idle   |            |
  | low   | moving              | < 50 [mm]    || moving | compute    |
  | high  | moving              | >= 50 [mm]   || failed |            |
  | fails | failed              |              || failed |            |
}
level axis {
  period 10 [ms]
  table run
}
"""


@pytest.fixture(scope="module")
def mixed() -> dict[str, str]:
    """The files of a program with members, ranges of several types, a loop and an invariant."""
    verdict = verdict_of(MIXED)
    assert verdict.proved is not None
    files = emitted(lower(verdict.proved))
    return {Path(name).suffix: text for name, text in files.items() if name.startswith("c/")}


def test_numbers_of_members_lines_faults_and_variables_have_names(mixed: dict[str, str]) -> None:
    source, header = mixed[".c"], mixed[".h"]
    assert "s->now = CASE__MODE_FAILED;" in source
    assert "s->fault = CASE__FAULT_NO_LINE;" in source
    assert "at = CASE__LEAF_LEVEL;" in source
    assert "at = CASE__INVARIANT_SMALL;" in source
    assert "case CASE__LINE_RUN_HIGH: /* case.rcs line high: told moving; level >= 50 [mm] */" in source
    for name in ("CASE__LEAF_LEVEL = 1", "CASE__INVARIANT_SMALL = 8", "CASE__LINE_RUN_HIGH = 2"):
        assert name in header


def test_arithmetic_is_done_in_the_smallest_type_that_holds_it(mixed: dict[str, str]) -> None:
    source = mixed[".c"]
    assert "s->twice = (int16_t)((int32_t)s->slope + (int32_t)s->count);" in source
    assert "s->further = s->distance + UINT64_C(1);" in source
    assert "s->count = (uint8_t)((uint32_t)s->count + 1u);" in source
    assert "if (s->count < 200u) {" in source  # no cast where a variable is compared
    assert "for (uint32_t v_k = 0u; v_k <= 3u; v_k = v_k + 1u) {" in source


def test_a_mask_says_of_which_class_it_is_and_which_lines_it_leaves(mixed: dict[str, str]) -> None:
    rows = re.findall(r"(0x\w+)u,? /\* (.*) \*/", mixed[".c"])
    assert ("0x06", "moving: lines low, high") in rows
    assert re.search(r"/\* case\.rcs: .*told", mixed[".c"])
    assert mixed[".c"].count("from the lowest bit, lines rests, low, high, fails;") == 1
    lines = ["rests", "low", "high", "fails"]
    for mask, told in rows:
        left = [line for at, line in enumerate(lines) if int(mask, 16) >> at & 1]
        few = f"line{'s' * (len(left) > 1)} {', '.join(left)}"
        assert told.endswith(": every line" if left == lines else f": {few}" if left else ": no line")


def test_masks_of_the_shipped_tables_are_what_is_said_of_them(repo: Path) -> None:
    files = [path.read_text("utf-8") for path in sorted((repo / "generated" / "c").glob("*.c"))]
    numbered = [
        part for text in files for part in text.split("/* Masks of ")[1:] if ": bit k is" in part[:120]
    ]
    runs = 0
    for mask, told in re.findall(r"(0x\w+)u,? /\* .*: lines? (\d[\d, to]*) \*/", "\n".join(numbered)):
        ends = [run.split(" to ") for run in told.split(", ")]
        bits = [at for run in ends for at in range(int(run[0]), int(run[-1]) + 1)]
        assert int(mask, 16) == sum(1 << at for at in bits), (mask, told)
        runs += " to " in told
    assert runs > 100


def test_what_needs_no_test_is_named_at_admission_and_check() -> None:
    text = (
        "record place { known : bool  at : array [3] of int 0 .. 255 }\ninput here : place\ninput sector : int 0 .. 99\n"
        "state seen : int 0 .. 65535\noutput o : bool\n"
        "table t {\n| line | here.known || o |\n|---|---||---|\n| yes | true || true |\n| no | false || false |\n}\n"
    )
    verdict = verdict_of(text)
    assert verdict.proved is not None
    (source,) = (text for name, text in emitted(lower(verdict.proved)).items() if name.endswith(".c"))
    told = re.findall(r"/\* Not tested, as no value of their types is refused: (.*)\. \*/", source)
    assert told == ["here.known, here.at[..]", "seen"]


WIDE = """input at : int 0 .. 199
output o : int 0 .. 3
table where {
  | line | at          || o |
  |------|-------------||---|
  | few  | < 3         || 0 |
  | some | 3 .. 149    || 1 |
  | many | >= 150      || 2 |
}
"""


def test_many_masks_are_told_in_runs() -> None:
    verdict = verdict_of(WIDE)
    assert verdict.proved is not None
    (text,) = (text for name, text in emitted(lower(verdict.proved)).items() if name.endswith(".c"))
    body = text[text.index("t0[200]") : text.index("} t = {") + 4000]
    told = re.findall(r"/\* (\d+ .. \d+: .*) \*/\n((?: +(?:0x\w+u,? ?)+\n)+)", body)
    assert [(words, rows.count("0x"), set(re.findall(r"0x\w+", rows))) for words, rows in told] == [
        ("0 .. 2: line few", 3, {"0x01u"}),
        ("3 .. 149: line some", 147, {"0x02u"}),
        ("150 .. 199: line many", 50, {"0x04u"}),
    ]


@pytest.mark.parametrize("name", SHIPPED)
def test_each_loop_says_how_often_it_runs(name: str) -> None:
    text = (GENERATED / name).read_text(encoding="utf-8")
    told = r"/\* (?:at most )?(?:n times|[1-9]\d* times|once) \*/"
    loops = re.findall(r"^ +(?:for|while) \(", text, re.MULTILINE)
    within = re.findall(rf"(?:for|while) \([^{{]*\{{ {told}\n", text)
    before = re.findall(rf"{told}\n +(?:for|while) \([^{{]*\{{\n", text)
    assert len(within) + len(before) == len(loops)


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_bound_is_how_often_the_loop_runs(program: str) -> None:
    text = (GENERATED / f"{program}.c").read_text(encoding="utf-8")
    counted = r"for \((?:uint32_t )?(\w+) = (\d+)u; \1 (<=?) (\d+)u; \1 = \1 \+ 1u\) \{ /\* (\w+)"
    for _, low, sign, high, told in re.findall(counted, text):
        runs = int(high) - int(low) + (sign == "<=")
        assert told == ("once" if runs == 1 else str(runs))


@pytest.mark.parametrize("name", SHIPPED)
def test_lines_are_short(name: str) -> None:
    text = (GENERATED / name).read_text(encoding="utf-8")
    assert max(map(len, text.splitlines())) <= WIDTH


@pytest.mark.parametrize("program", ["task", "gripper", "approach"])
def test_nothing_is_copied_and_only_the_compilers_library_is_called(program: str, tmp_path: Path) -> None:
    """A frame as large as the state would be a copy of it; what is called stands in the header."""
    flags = ("-std=c99", "-Os", "-fno-stack-protector", "-fstack-usage", f"-I{GENERATED}")
    sizes = f'#include "{program}.h"\nchar bytes[sizeof({program}_t)];\n'
    (tmp_path / "sizes.c").write_text(sizes, encoding="utf-8")
    source = GENERATED / f"{program}.c"
    for path in (tmp_path / "sizes.c", source):
        subprocess.run(["cc", *flags, "-c", path, "-o", f"{path.stem}.o"], cwd=tmp_path, check=True)
    symbols = subprocess.run(
        ["nm", "-S", "sizes.o"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    [size] = [int(line.split()[1], 16) for line in symbols.stdout.splitlines() if line.endswith(" bytes")]
    frames = [int(line.split("\t")[1]) for line in (tmp_path / f"{program}.su").read_text().splitlines()]
    assert max(frames) < size
    called = subprocess.run(
        ["nm", "-u", f"{program}.o"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    names = {line.split()[-1] for line in called.stdout.splitlines()}
    assert names <= {"memcpy", "memset", "_GLOBAL_OFFSET_TABLE_"}


NAMES = st.text("abcdefgh_", min_size=1, max_size=30)
EXPRESSIONS = st.recursive(
    NAMES,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["&&", "||", "+", "&", "<="]), inner).map(
            lambda parts: f"({' '.join(parts)})"
        ),
        st.tuples(NAMES, st.lists(inner, min_size=1, max_size=4)).map(
            lambda call: f"{call[0]}({', '.join(call[1])})"
        ),
        st.tuples(inner, inner, inner).map(lambda parts: f"({parts[0]} ? {parts[1]} : {parts[2]})"),
    ),
    max_leaves=40,
)


@given(EXPRESSIONS, st.integers(0, 6))
def test_a_broken_line_is_the_same_code(expression: str, indent: int) -> None:
    line = f"{'    ' * indent}value = {expression};"
    lines = list(folded(line))
    assert " ".join(" ".join(lines).split()) == line.strip()
    assert all(len(each) <= WIDTH for each in lines) or indent + line.count("(") > 4
    assert lines[0].startswith("    " * indent + "value")


@given(st.lists(st.text("abc", min_size=5, max_size=20), min_size=20, max_size=40).map(" ".join))
def test_a_long_comment_stands_before_its_code(words: str) -> None:
    lines = list(folded(f"    case 1: /* {words} */"))
    assert lines[-1] == "    case 1:"
    assert " ".join(" ".join(lines[:-1]).split()) == f"/* {words} */"
    assert max(map(len, lines)) <= WIDTH


def test_a_file_with_a_long_name_is_still_known_as_its_programs(tmp_path: Path) -> None:
    """The first line of a file says of which program it is; it is read before the file is overwritten."""
    verdict = verdict_of(MIXED)
    assert verdict.proved is not None
    short = verdict.proved.program
    for program in (short, replace(short, file=f"/{'a_long_folder/' * 12}case.rcs")):
        assert write(emitted(lower_by_force(program)), str(tmp_path)) == ()


def test_a_line_names_its_table_where_the_file_has_several() -> None:
    gripper, task = ((GENERATED / f"{name}.c").read_text(encoding="utf-8") for name in ("gripper", "task"))
    assert "/* gripper/gripper.rcs line 1 of grasp: new_command true */" in gripper
    assert (
        "/* Masks of gripper/gripper.rcs table grasp: from the lowest bit, lines 1, 2, 3, 4, 5, 6;" in gripper
    )
    assert re.search(r"/\* task/acquire\.rcs line 0: ", task)
