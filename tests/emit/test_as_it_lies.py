"""`rcsc test` of the files that lie in `generated/`: what was edited there is found, and what an edit may do ends nothing else.

The oracle is the edit: each does one known thing to one file of a project that passes without it.
"""

import contextlib
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.code.emit import emitted
from rcsc.code.testing.apart import Ended, apart
from rcsc.driver import compile as driver
from rcsc.driver.settings import silent
from rcsc.front.commands import run
from tests.support.programs.texts import edit_file

TABLE = """input ask : int 0 .. 9
state left : int 0 .. 9
procedure spend {
  if left > 0 { left := left - 1 } else { left := 9 }
}
table t {
  | line | ask  || procedures |
  |------|------||------------|
  | rest | 0    ||            |
  | work | /= 0 || spend      |
}
level l {
  table t
}
"""
SYSTEM = """name = "whole"
generated = "generated"
tick_ms = 40
[[level]]
name = "l"
program = "a"
[buffers]
"""
Edit = Callable[[Path], None]


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compiled")
    (folder / "a.rcs").write_text(TABLE)
    with contextlib.chdir(folder):
        assert run(["compile", "-q", "a.rcs"]) == 0
    return folder


@pytest.fixture
def project(compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A compiled project, in which the test stands."""
    shutil.copytree(compiled, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcome(capsys: pytest.CaptureFixture[str], *options: str) -> tuple[int, str]:
    """The status and the text of a short `rcsc test`."""
    capsys.readouterr()
    status = run(["test", "--examples", "4", "--mutants", "0", "--no-cortex", *options, "a.rcs"])
    return status, "".join(capsys.readouterr())


@pytest.mark.usefixtures("project")
def test_fresh_files_are_tested_and_named(capsys: pytest.CaptureFixture[str]) -> None:
    status, text = outcome(capsys)
    assert status == 0
    assert "tested: generated/python and generated/c" in text
    status, text = outcome(capsys, "--anew")
    assert status == 0
    assert "tested: what the tables give now" in text


def of_c(old: str, new: str) -> Edit:
    return lambda at: edit_file(at / "generated/c/a.c", (old, new))


def of_python(old: str, new: str) -> Edit:
    return lambda at: edit_file(at / "generated/python/a.py", (old, new))


EDITS = {
    "a comment alone": (of_c("/* a.rcs procedure spend */", "/* spend */"), {"RCS501"}, "differs from"),
    "another value in C": (of_c("s->left - 1)", "s->left - 0)"), {"RCS501", "RCS601"}, "the C executor's"),
    "another value in Python": (of_python("s.left - 1", "s.left - 0"), {"RCS501", "RCS601"}, "the Python executor's"),
    "a division by zero": (of_c("(int32_t)s->left - 1", "1 / (s->left - s->left)"), {"RCS501", "RCS601"}, "SIGFPE"),
    "C that does not compile": (of_c("(int32_t)s->left - 1", "s->gone"), {"RCS501", "RCS601"}, "does not compile"),
    "Python that ends": (of_python("class State:", "raise SystemExit(0)\nclass State:"), {"RCS501", "RCS601"}, "exit status 0"),
    "Python without a class": (of_python("class State:", "class Other:"), {"RCS501", "RCS601"}, "Error: "),
    "no C": (lambda at: (at / "generated/c/a.c").unlink(), {"RCS501"}, "not tested: c/a.c cannot be read"),
    "no text": (lambda at: (at / "generated/python/a.py").write_bytes(b"\xff"), {"RCS501"}, "not UTF-8"),
}  # fmt: skip


@pytest.mark.parametrize(("edit", "codes", "words"), EDITS.values(), ids=EDITS)
def test_an_edit_is_found(
    project: Path, capsys: pytest.CaptureFixture[str], edit: Edit, codes: set[str], words: str
) -> None:
    edit(project)
    status, text = outcome(capsys)
    assert status == 1
    assert set(re.findall(r"error\[(\w+)\]", text)) == codes
    assert words in text


def test_an_edit_elsewhere_is_not_looked_at(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Files of another program in `generated/` are not this project's; a folder that is named is."""
    (project / "generated").rename(project / "other")
    (project / "b.rcs").write_text(TABLE)
    assert run(["compile", "-q", "b.rcs"]) == 0
    edit_file(project / "other/c/a.c", ("s->left - 1)", "s->left - 0)"))
    status, text = outcome(capsys)
    assert status == 0
    assert "tested: what the tables give now" in text
    status, text = outcome(capsys, "--generated", "other")
    assert status == 1
    assert "the C executor's" in text
    assert "tested: other/python and other/c" in text


def test_an_edit_under_a_system_is_found(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The trials of the whole are handed over to a process of their own, too."""
    (project / "rcsc.toml").write_text("")
    (project / "system.toml").write_text(SYSTEM)
    assert run(["compile", "-q", "--out", "generated", "."]) == 0
    edit_file(project / "generated/c/a.c", ("(int32_t)s->left - 1", "1 / (s->left - s->left)"))
    capsys.readouterr()
    assert run(["test", "--examples", "1", "--mutants", "0", "--no-cortex", "."]) == 1
    text = "".join(capsys.readouterr())
    assert set(re.findall(r"error\[(\w+)\]", text)) == {"RCS501", "RCS601"}
    assert "system whole: 1 episodes without a plant" in text


@pytest.mark.usefixtures("project")
def test_defensive_files_are_as_good(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compile", "-q", "--defensive", "a.rcs"]) == 0
    status, text = outcome(capsys)
    assert status == 0
    assert "tested: generated/python and generated/c (defensive)" in text


def endless(doing: Callable[[str], None]) -> None:
    """A trial without an end."""
    doing("waiting")
    time.sleep(1000)


def test_a_trial_without_an_end_is_ended() -> None:
    assert apart(endless, progress=silent, silent_s=1) == Ended("no end in 1 s of waiting")


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        ("a.py", "class State:", "1 = 1\n\n\nclass State:", "error[RCS902]: the generated `python/a.py` cannot be imported: SyntaxError"),
        ("a.py", "class State:", "missing()\n\n\nclass State:", "cannot be imported: NameError: name 'missing' is not defined"),
        ("a.c", "#include", "int 1;\n#include", "error[RCS603]: the generated C does not compile"),
    ],
)  # fmt: skip
def test_what_cannot_be_imported_or_compiled_is_not_written(
    project: Path,
    file: str,
    old: str,
    new: str,
    told: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """An emitter that errs; the user's module, which is not there, is none of its business."""
    made, look = emitted, 'extern procedure look writes left python "x.y:f" c "f"'
    monkeypatch.setattr(
        driver,
        "emitted",
        lambda *asked: {
            path: text.replace(old, new, 1) if path.endswith(file) else text
            for path, text in made(*asked).items()
        },
    )
    edit_file(project / "a.rcs", ("level l", f"{look}\nlevel l"))
    before = (project / "generated/python/a.py").read_text()
    assert run(["compile", "a.rcs"]) != 0
    assert told in "".join(capsys.readouterr())
    assert (project / "generated/python/a.py").read_text() == before
    monkeypatch.undo()
    monkeypatch.chdir(project)
    assert run(["compile", "-q", "a.rcs"]) == 0
    assert "import x.y as" in (project / "generated/python/a.py").read_text()
