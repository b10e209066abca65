"""Names in C as a compiler sees them that looks at the first 31 characters (ISO C99, 5.2.4.1; MISRA C:2012, 5.1, 5.2 and 5.4)."""

import re
import subprocess
from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.code.emit import emitted
from rcsc.code.emit.lower import lower_by_force
from rcsc.code.emit.scope import SIGNIFICANT, abbreviated, c_scope
from rcsc.front.commands import run
from rcsc.lang.model import Program
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from tests.support.programs.stages import program_of

NAME = re.compile(r"\b[A-Za-z_]\w*")
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


def machine_code(files: Mapping[str, str], folder: Path) -> bytes:
    """The code that the C files are compiled to."""
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(text)
    (source,) = (name for name in files if name.endswith(".c"))
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-O0", "-c", source, "-o", "out.o"]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    subprocess.run(["objcopy", "-O", "binary", "-j", ".text", "out.o", "out.bin"], cwd=folder, check=True)
    return (folder / "out.bin").read_bytes()


def seen(text: str) -> str:
    """C with no more of each name than a compiler need look at; names of headers are no names of C."""
    include = re.compile(r"^#include.*$", re.MULTILINE)
    kept = iter(include.findall(text))
    cut = NAME.sub(lambda name: name[0][:SIGNIFICANT], COMMENT.sub("", text))
    return include.sub(lambda _: next(kept), cut)


def differ_in_time(files: Mapping[str, str], folder: Path) -> None:
    c = {path.removeprefix("c/"): text for path, text in files.items() if path.endswith((".c", ".h"))}
    names = {name for text in c.values() for name in NAME.findall(COMMENT.sub("", text))}
    assert any(len(name) > 20 for name in names)
    cut = {path: seen(text) for path, text in c.items()}
    assert machine_code(cut, folder / "cut") == machine_code(c, folder / "whole")


def roots() -> list[str]:
    tables = Path(__file__).parents[3] / "tables"
    names = [
        path for path in tables.rglob("*.rcs") if re.search(r"^level ", path.read_text("utf-8"), re.MULTILINE)
    ]
    return [str(path.relative_to(tables)) for path in sorted(names) if "later" not in path.parts]


@pytest.mark.parametrize("root", roots())
def test_shipped_programs_and_the_gallery(root: str, repo: Path, tmp_path: Path) -> None:
    loaded = load([str(repo / "tables" / root)])
    program = resolve(loaded.roots[0], loaded)
    assert isinstance(program, Program), program
    differ_in_time(emitted(lower_by_force(program, str(repo / "tables")), ("c",)), tmp_path)


def test_the_shipped_system(repo: Path, tmp_path: Path) -> None:
    generated = repo / "generated/c"
    files = {path.name: path.read_text(encoding="utf-8") for path in generated.glob("*.h")}
    differ_in_time(files | {"nbs_robot.c": (generated / "nbs_robot.c").read_text(encoding="utf-8")}, tmp_path)


LONG = "which_is_a_very_long_name_that_only_its_end_tells_apart"
PROGRAM = """
enum ENUM_a { ENUM_a_one, ENUM_a_two }
enum ENUM_b { ENUM_b_one, ENUM_b_two }
record RECORD { RECORD_a : ENUM_a  RECORD_b : bool }
input INPUT_a : RECORD
input INPUT_b : RECORD
state STATE_a : int 0 .. 9
state STATE_b : int 0 .. 9 deferred until INPUT_a.RECORD_b
output OUTPUT_a : ENUM_b
output OUTPUT_b : ENUM_b
assume ASSUMPTION_a monitored : STATE_a < 9
assume ASSUMPTION_b monitored : STATE_a < 8
invariant INVARIANT_a : STATE_a >= 0
invariant INVARIANT_b : STATE_a <= 9
procedure PROCEDURE_a(PARAMETER_a : int 0 .. 9, PARAMETER_b : int 0 .. 9) {
  local LOCAL_a : int 0 .. 9 := PARAMETER_a
  local LOCAL_b : int 0 .. 9 := PARAMETER_b
  STATE_a := LOCAL_a
  next STATE_b := LOCAL_b
}
procedure PROCEDURE_b { STATE_a := 0 }
table TABLE_a assuming ASSUMPTION_a, ASSUMPTION_b {
  | line | INPUT_a.RECORD_b || procedures |
  | LINE_a | true  || PROCEDURE_a(1, 2) |
  | LINE_b | false || PROCEDURE_b |
}
table TABLE_b {
  | line | INPUT_b.RECORD_b || procedures |
  | LINE_a | true  || PROCEDURE_a(1, 2) |
  | LINE_b | false || PROCEDURE_b |
}
level LEVEL_a { period 10 [ms] table by INPUT_a.RECORD_a { ENUM_a_one : TABLE_a  ENUM_a_two : TABLE_b } }
level LEVEL_b { period 10 [ms] table TABLE_b }
"""


@pytest.mark.parametrize("file", ["case.rcs", f"{LONG}_of_a_file.rcs"])
def test_names_that_only_their_ends_tell_apart(file: str, tmp_path: Path) -> None:
    text = re.sub(r"\b([A-Z]+)(?=_[ab]\b|_[ab]_|\b)", lambda word: f"{word[1].lower()}_{LONG}", PROGRAM)
    files = emitted(lower_by_force(program_of(text, file)), ("c",))
    differ_in_time(files, tmp_path)


def test_levels_that_only_their_ends_tell_apart(dock: Path, tmp_path: Path) -> None:
    system = dock / "system.toml"
    text = system.read_text(encoding="utf-8")
    for level in ("supervisor", "drive"):
        text = text.replace(f'name = "{level}"', f'name = "{LONG}_{level}"\nprogram = "{level}"')
        text = text.replace(f'"{level}.', f'"{LONG}_{level}.')
        rcs = dock / f"{level}.rcs"
        rcs.write_text(
            rcs.read_text("utf-8").replace(f"level {level}", f"level {LONG}_{level}"), encoding="utf-8"
        )
    system.write_text(text, encoding="utf-8")
    assert run(["compile", "-q", str(system), "--out", str(dock / "generated")]) == 0
    generated = dock / "generated/c"
    files = {path.name: path.read_text(encoding="utf-8") for path in generated.glob("*.h")}
    differ_in_time(files | {"dock.c": (generated / "dock.c").read_text(encoding="utf-8")}, tmp_path / "seen")


WORDS = st.lists(
    st.sampled_from(["a", "to", "of", "part", "station", "aeiou", "TABLE", "x1", "4096", "ll", "__"]),
    min_size=1,
    max_size=14,
)


@given(st.lists(WORDS.map("_".join), min_size=1, max_size=40))
def test_a_group_s_names_differ_and_short_ones_stay(names: list[str]) -> None:
    given_names = c_scope().distinct(names)
    assert len({name[:SIGNIFICANT] for name in given_names}) == len(names)
    for name, spelled in zip(names, given_names, strict=True):
        if (
            len(name) <= SIGNIFICANT
            and names.count(name) == 1
            and not any(other != name and other[:SIGNIFICANT] == name for other in names)
        ):
            assert spelled == name or any(
                abbreviated(other, SIGNIFICANT) == name for other in names if other != name
            )


@pytest.mark.parametrize("words", ["a_b_c", "aeiou_aeiou", "x" * 60, "4096_" * 9, "_" * 40, "MOVE_TO"])
def test_what_is_made_short_is_short_and_a_name(words: str) -> None:
    for most in range(4, SIGNIFICANT + 1):
        made = abbreviated(f"t{words}", most)
        assert len(made) <= most
        assert made.isidentifier()
        assert made == abbreviated(f"t{words}", most)
