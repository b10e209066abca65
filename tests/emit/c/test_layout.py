"""Which tables a state is of: its digest, and the size that the header holds the compiler to."""

import ctypes
import importlib.util
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.emit import TARGETS
from rcsc.emit.c.layout import Digest, digest
from rcsc.emit.identifiers import names_of
from rcsc.solvers.options import Options
from tests.support.programs.stages import program_of

BELT = """enum mode { idle, moving }
input go : bool
input load : int 0 .. 300
state now : mode = idle
state again : mode = idle
output speed : real 0.0 .. 2.5 [m/s]
invariant still: now = idle implies speed = 0.0
procedure stop { speed := 0.0 }
table belt {
  | line | go    | load    || procedures | now    |
  |------|-------|---------||------------|--------|
  | run  | true  | <= 250  ||            | moving |
  | full | true  | > 250   || stop       | idle   |
  | halt | false |         || stop       | idle   |
}
level drive { period 10 [ms] table belt }
"""
SAME = {
    "a comment": ("  | run  |", "  # runs\n  | run  |"),
    "a doc line": ("input go ", "## Starts the belt.\ninput go "),
    "an empty line": ("level drive", "\n\nlevel drive"),
    "wider columns": ("| > 250   ||", "|   > 250 ||"),
}
OTHER = {
    "a cell": ("<= 250  |", "<= 240  |"),
    "an action": ("||            | moving |", "||            | idle   |"),
    "a range": ("0 .. 300", "0 .. 310"),
    "an initial value": ("again : mode = idle", "again : mode = moving"),
    "a procedure": ("speed := 0.0 }", "speed := 0.0  again := idle }"),
    "the order of variables": (
        "input go : bool\ninput load : int 0 .. 300",
        "input load : int 0 .. 300\ninput go : bool",
    ),
    "the order of members": ("idle, moving", "moving, idle"),
    "the name of a variable": ("again", "before"),
    "the period": ("10 [ms]", "20 [ms]"),
    "an invariant": ("speed = 0.0\n", "speed <= 0.0\n"),
}


def edited(change: tuple[str, str]) -> str:
    before, after = change
    assert before in BELT
    text = BELT.replace(before, after)
    return text.replace("| > 250 ", "| > 240 ") if after.startswith("<= 240") else text


def digested(text: str, file: str = "belt.rcs") -> Digest:
    program = program_of(text)
    program = replace(program, file=file, name=file.removesuffix(".rcs"))
    return digest(program, names_of(program))


@pytest.mark.parametrize("change", SAME)
def test_words_change_no_digest(change: str) -> None:
    assert digested(edited(SAME[change])) == digested(BELT)
    assert digested(BELT, "renamed.rcs") == digested(BELT)


@pytest.mark.parametrize("change", OTHER)
def test_what_means_something_changes_it(change: str) -> None:
    assert digested(edited(OTHER[change])).state != digested(BELT).state


def test_the_layout_is_told_apart_from_the_meaning() -> None:
    cell, order = digested(edited(OTHER["a cell"])), digested(edited(OTHER["the order of variables"]))
    assert cell.layout == digested(BELT).layout
    assert order.layout != digested(BELT).layout


@pytest.fixture(scope="module")
def belts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two versions of one program, compiled: their generated folders are `old` and `new`."""
    folder = tmp_path_factory.mktemp("belts")
    for name, text in (("old", BELT), ("new", edited(OTHER["a cell"]))):
        (folder / name).mkdir()
        (folder / name / "belt.rcs").write_text(text, encoding="utf-8")
        settings = Settings((str(folder / name / "belt.rcs"),), Options())
        made = compile_(settings, folder / name / "generated", TARGETS, only_check=False)
        assert not made.report.failed, made.report.diagnostics
    return folder


def test_a_state_of_an_older_table_is_refused_in_c(belts: Path) -> None:
    libraries = []
    for name in ("old", "new"):
        here = belts / name / "generated/c"
        command = ["cc", "-std=c99", "-shared", "-fPIC", "belt.c", "-o", "belt.so"]
        subprocess.run(command, cwd=here, check=True)
        libraries.append(ctypes.CDLL(str(here / "belt.so")))
    old, new = libraries
    foreign = int(
        re.findall(r"BELT_CHECK_FOREIGN = (\d+)", (belts / "new/generated/c/belt.h").read_text())[0]
    )
    state = ctypes.create_string_buffer(256)
    old.belt_init(state)
    assert (old.belt_check(state), new.belt_check(state)) == (-1, foreign)
    new.belt_init(state)
    assert (old.belt_check(state), new.belt_check(state)) == (foreign, -1)
    assert new.belt_check(ctypes.create_string_buffer(256)) == foreign  # memory that nobody wrote


def test_a_state_of_an_older_table_is_refused_in_python(belts: Path) -> None:
    modules = []
    for name in ("old", "new"):
        spec = importlib.util.spec_from_file_location(
            f"belt_{name}", belts / name / "generated/python/belt.py"
        )
        assert spec is not None
        assert spec.loader is not None
        modules.append(module := importlib.util.module_from_spec(spec))
        spec.loader.exec_module(module)
        header = (belts / name / "generated/c/belt.h").read_text()
        assert f"BELT_DIGEST {module.DIGEST:#010x}u" in header
        assert re.search(rf"BELT_CHECK_FOREIGN = {module.FOREIGN}\b", header)
    old, new = modules
    state = new.State()
    assert new.check(state) == -1
    state.copy_in(old.State().copy_out())
    assert new.check(state) == new.FOREIGN
    assert new.drive_cycle(new.State()) == 0


FLAGS = {
    "host": ("cc",),
    "i386": ("cc", "-m32"),
    "aligned to 2": ("cc", "-fpack-struct=2"),
    "packed": ("cc", "-fpack-struct=1"),
}


@pytest.mark.parametrize(
    "command",
    [
        *(pytest.param(command, id=name) for name, command in FLAGS.items()),
        pytest.param(
            ("arm-none-eabi-gcc", "-mcpu=cortex-m0plus"),
            marks=pytest.mark.needs("arm-none-eabi-gcc"),
            id="arm",
        ),
    ],
)
def test_the_size_is_what_the_header_says(command: tuple[str, ...], repo: Path, tmp_path: Path) -> None:
    """A state of any other size does not compile."""
    compiler, *flags = command
    headers = sorted(
        path for path in (repo / "generated/c").glob("*.h") if "_layout_holds" in path.read_text()
    )
    assert len(headers) == 6
    for header in headers:
        text = header.read_text()
        (tmp_path / header.name).write_text(text)
        wrong = re.sub(
            r"\(sizeof\((\w+)\) == (\d+)u\)", lambda m: f"(sizeof({m[1]}) == {int(m[2]) + 4096}u)", text
        )
        (tmp_path / f"wrong_{header.name}").write_text(wrong)
        for name, right in ((header.name, True), (f"wrong_{header.name}", False)):
            strict = [
                "-std=c99",
                "-ffreestanding",
                "-fsyntax-only",
                "-Wall",
                "-Wextra",
                "-Wpedantic",
                "-Werror",
            ]
            words = [compiler, *flags, *strict, f"-I{repo / 'generated/c'}", "-x", "c", name]
            ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
            assert (ran.returncode == 0) is right, ran.stderr
