"""Which tables a state is of: its digest, and the size that the header holds the compiler to."""

import ctypes
import importlib.util
import re
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rcsc.code.emit import TARGETS
from rcsc.code.emit.c.layout import Digest, digest
from rcsc.code.emit.identifiers import names_of
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.proof.solvers.options import Options
from tests.support.programs.examples import EVERYTHING
from tests.support.programs.stages import drawn_program, emitted, program_of

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
    "a requirement": ("procedure stop {", 'procedure stop req "SR-1" {'),
    "a property": ("level drive", "property slow : speed < 3.0 [m/s]\nlevel drive"),
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
    "a check that no table relies on": ("level drive", "assume light monitored : load < 300\nlevel drive"),
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


@cache
def bare(text: str) -> tuple[int, str]:
    """The digest of a program, and its C without comments."""
    program = drawn_program(text)
    code = "\n".join(text for path, text in emitted(program).items() if path.endswith((".c", ".h")))
    code = re.sub(r"/\*.*?\*/", "", code, flags=re.DOTALL)
    return digest(program, names_of(program)).state, re.sub(r"DIGEST 0x\w+", "", code)


PIECES = [
    match.span() for match in re.finditer(r"\d+|<=?|>=?|\b(?:min|max|true|false|[abwk]|clamp)\b", EVERYTHING)
]


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)
@given(
    st.sampled_from(PIECES), st.sampled_from(["1", "3", "<", ">=", "a", "b", "k", "max", "true", "reject"])
)
def test_programs_of_other_code_have_other_digests(piece: tuple[int, int], put: str) -> None:
    changed = EVERYTHING[: piece[0]] + put + EVERYTHING[piece[1] :]
    digests, codes = zip(
        *(bare(text.replace("{real}", "single")) for text in (EVERYTHING, changed)), strict=True
    )
    assert len(set(digests)) >= len(set(codes))


CALLED_BY_A_LEVEL = """
input a : int 0 .. 9
state n : int 0 .. 9
state m : int 0 .. 9
extern procedure ask reads a writes n python "mine:ask" c "ask"
table t {
  | line | a       ||
  | any  | DEFAULT ||
}
level it { period 10 [ms] preprocess ask table t }
"""


@pytest.mark.parametrize(
    ("before", "after"), [("writes n", "writes m"), ("reads a", "reads n"), ('"ask"', '"tell"')]
)
def test_what_an_extern_procedure_is_given_and_gives_changes_it(before: str, after: str) -> None:
    changed = CALLED_BY_A_LEVEL.replace(before, after)
    assert changed != CALLED_BY_A_LEVEL
    assert digested(changed).meaning != digested(CALLED_BY_A_LEVEL).meaning


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
            strict = "-std=c99 -ffreestanding -fsyntax-only -Wall -Wextra -Wpedantic -Werror".split()
            words = [compiler, *flags, *strict, f"-I{repo / 'generated/c'}", "-x", "c", name]
            ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
            assert (ran.returncode == 0) is right, ran.stderr
