"""`rcsc test` of a system: the C of the whole beside the Python system, and what is said where they differ."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.code.emit import TARGETS
from rcsc.driver import compile as compiling
from rcsc.driver import settings, trials
from rcsc.driver.compile import generated_of, tables_in
from rcsc.driver.pipeline import proved
from rcsc.front.commands import run
from rcsc.proof.solvers.options import Options
from rcsc.run.link import Linked, emit_system
from tests.link.test_compile_system import BUFFERS, written
from tests.support.programs.texts import edit_file, edited


def beside_python(path: Path) -> tuple[list[tuple[Code, str]], str]:
    """What is reported of a system's C, and the figure."""
    given = (str(path),)
    project = proved(settings.Settings(tables_in(given, (path,)), Options()))
    diagnostics, figure = trials._beside(
        path,
        generated_of(project, (path,), TARGETS, defensive=False),
        settings.TestEffort(60),
        settings.silent,
    )
    return [(found.code, found.message) for found in diagnostics], figure


def test_a_system_is_run_as_a_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written(tmp_path, {"a": 20, "b": 10}, BUFFERS)
    assert run(["test", "--examples", "6", "--mutants", "0", "--no-cortex", str(tmp_path)]) == 0
    told = "".join(capsys.readouterr())
    assert "table t: 2 of 2 lines reached" in told
    assert "system whole: C and Python the same in 30 ticks: " in told
    assert not (tmp_path / "generated").exists()


def test_the_c_that_lies_there_is_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An edit of the system's C that divides by zero ends the process that runs it, and not the command."""
    path = written(tmp_path, {"a": 20, "b": 10}, BUFFERS)
    assert run(["compile", "-q", str(path)]) == 0
    edit_file(tmp_path / "generated/c/whole.c", ("s->out.who.y = s->a.y;\n}", "s->out.who.y = 1 / (s->a.y - s->a.y);\n}"))  # fmt: skip
    assert run(["test", "-q", "--examples", "6", "--mutants", "0", "--no-cortex", str(path)]) == 1
    told = "".join(capsys.readouterr())
    assert "whole.c` differs from the code of the tables" in told
    assert "the process ended by SIGFPE, while running whole in C and in Python" in told


def misspelt(*edits: tuple[str, str]) -> Callable[[Linked], dict[str, str]]:
    """The emitter with a mistake."""

    def emit(system: Linked) -> dict[str, str]:
        files = emit_system(system)
        return files | {"c/whole.c": edited(files["c/whole.c"], *edits)}

    return emit


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (("s->out.who.y = s->a.y;\n}", "}"), "`buffer a.y [0]` is"),
        (("% UINT64_C(2)) == UINT64_C(0)", "% UINT64_C(2)) != UINT64_C(0)"), "`a.line` is"),
        (("faulted = WHOLE_LEVEL_B;", "faulted = WHOLE_LEVEL_A;"), "`a` faulted in C, `b` in Python"),
        (("    return at;\n}\n\n/* Level b goes on", "    return 0;\n}\n\n/* Level b goes on"), "a restart of `b` is refused in C"),
    ],
)  # fmt: skip
def test_what_differs_is_told(
    edit: tuple[str, str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, {"a": 20, "b": 10}, BUFFERS)
    monkeypatch.setattr(compiling, "emit_system", misspelt(edit))
    [(code, message)], _ = beside_python(path)
    assert code is Code.EXECUTORS_DISAGREE
    assert message.startswith("the C of system `whole` and the Python system differ: tick ")
    assert said in message


def test_what_cannot_be_run_alone_is_a_figure(tmp_path: Path) -> None:
    path = written(tmp_path, {"a": 20, "b": 10}, BUFFERS)
    edit_file(tmp_path / "b.rcs", ("procedure p { y := x }", 'extern procedure p reads x writes y python "m:p" c "p_of_mine"'))  # fmt: skip
    assert beside_python(path) == ([], "system whole: not run as a whole: its levels call extern procedures")
    edit_file(
        path, ('name = "a"\n', 'name = "a"\n[[level.feed]]\ninto = "given"\nquery = "q"\nkeys = ["x"]\n')
    )
    edit_file(path, ('"b.y" = "a.x"\n', ""))
    assert beside_python(path) == ([], "system whole: not run as a whole: its levels ask a database")


def test_without_a_compiler_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, {"a": 20}, {"a.y": "a.x"})
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert beside_python(path) == ([(Code.NO_C_COMPILER, "there is no C compiler here")], "")
