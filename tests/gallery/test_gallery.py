"""The gallery's pages say what rcsc says: every command, every line shown of its output, every figure; mended tables prove and run."""

import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.front.commands import run
from tests.gallery.page import ENTRIES, GALLERY, MENDED, PAGE, REPO, page, written
from tests.support.programs.stages import shipped

PAGES = (PAGE, *(entry / "README.md" for entry in ENTRIES))
TRIED = (
    "elevator/elevator.rcs",
    "etcs_modes/modes.rcs",
    "linuxcnc_homing/homing.rcs",
    "plcopen_safety/two_hand.rcs",
    "tcas/tcas.rcs",
)
"""Several tables in a cycle; many lines; arrays; times; conditions over several variables."""
SHOWN = re.compile(
    r"^```sh\n(?P<commands>.*?)^```\n(?:\n```text\n(?P<shown>.*?)^```\n)?", re.MULTILINE | re.DOTALL
)
Say = Callable[[str], tuple[int, str]]
pytestmark = pytest.mark.usefixtures("kept_proofs")


@pytest.fixture
def say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Say:
    """Runs a command of `rcsc` beside a copy of the gallery: its status, and what it prints with blanks as one."""
    shutil.copytree(
        GALLERY, tmp_path / "tables" / "gallery", ignore=shutil.ignore_patterns(".rcsc-cache", "generated")
    )
    shutil.copy(REPO / "tables" / "rcsc.toml", tmp_path / "tables")
    monkeypatch.chdir(tmp_path)

    def said(command: str) -> tuple[int, str]:
        name, *words = shlex.split(command, comments=True)
        assert name == "rcsc"
        capfd.readouterr()
        status = run(words)
        return status, plain("\n".join(capfd.readouterr()))

    return said


def plain(text: str) -> str:
    """The text with blanks, and rules of tables, as one blank."""
    return " ".join(text.replace("| |", "|").split())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.parent.name)
def test_a_page_shows_what_its_commands_print(page: Path, say: Say) -> None:
    parts = [part.groupdict() for part in SHOWN.finditer(page.read_text(encoding="utf-8"))]
    assert parts
    for part in parts:
        printed = ""
        for command in part["commands"].splitlines():
            ends = re.search(r"status (\d)", command)
            status, text = say(command)
            assert status == (int(ends[1]) if ends else 0), f"{command}\n{text[-2000:]}"
            printed += text
        for line in (part["shown"] or "").splitlines():
            assert plain(line) in printed, f"{part['commands']}does not show\n{line}"


def test_the_page_is_fresh() -> None:
    assert page() == PAGE.read_text(encoding="utf-8"), "python -m tests.gallery makes it anew"


def test_what_is_mended_proves(say: Say) -> None:
    status, printed = say(f"rcsc check {written(MENDED)}")
    assert status == 0, printed
    tables = sum(len(shipped(str(path), REPO).tables) for path in MENDED)
    assert f"{tables} tables: {tables} proved" in printed


def test_what_is_mended_does_the_same_in_python_and_c(say: Say) -> None:
    """Some, each with something else of the language; all by `python -m tests.gallery --mended`."""
    paths = [GALLERY / name for name in TRIED]
    status, printed = say(f"rcsc test --examples 1 --mutants 0 --no-cortex {written(paths)}")
    assert status == 0, printed
    assert printed.count("interpreter = Python = C") == len(TRIED)


def test_the_tables_are_laid_out(say: Say) -> None:
    assert say("rcsc fmt --check tables/gallery")[0] == 0
