"""`reload` looks up what was proved of the levels together: known bad tables stay out, unknown ones are said to be."""

import shutil
from pathlib import Path

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.commands import HELP
from rcsc.desk.shell.reload import composed
from rcsc.front.commands import run
from tests.support.programs.stages import compile_beside
from tests.support.programs.systems import HOPED, ORDER_AFTER_ORDER, SMALL, small_system
from tests.support.programs.texts import edit_file
from tests.support.shells import alone, do, refused, state

SLOWER = ORDER_AFTER_ORDER[0]
PROVED = "level `upper` is proved together with its neighbours, as the files of {} stand"
UNKNOWN = "level `upper` is not known to be proved together with its neighbours: `rcsc prove {}` decides it"


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small system, compiled, and its lower level proved: half of every proof here. Only to be copied."""
    folder = tmp_path_factory.mktemp("compiled") / "small"
    small_system(folder)
    compile_beside(folder / "upper.rcs", folder / "lower.rcs")
    with pytest.MonkeyPatch.context() as set_:
        set_.delenv("RCSC_CACHE_DIR", raising=False)
        assert run(["prove", str(folder / "system.toml"), "--level", "lower", "--trace", "0"]) == 0
    return folder


@pytest.fixture
def system(compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The small system, compiled; its description."""
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    shutil.copytree(compiled, tmp_path, dirs_exist_ok=True)
    return tmp_path / "system.toml"


def prove(system: Path) -> int:
    return run(["prove", str(system), "--trace", "0"])


def test_reload_says_what_is_known_of_the_levels_together(system: Path) -> None:
    commands = alone(system, "python")
    edit_file(system.with_name("upper.rcs"), SLOWER)
    assert UNKNOWN.format(system) in do(commands, "diff upper")
    assert prove(system) == 0
    assert PROVED.format(system) in do(commands, "diff upper")
    said = do(commands, "reload upper")
    assert PROVED.format(system) in said
    assert said[-1].startswith("level `upper` runs its new tables from cycle 1 on")
    edit_file(system.with_name("upper.rcs"), SLOWER[::-1])
    assert UNKNOWN.format(system) in do(commands, "reload upper")


def test_reload_refuses_what_was_found_not_to_be_proved_whatever_is_said(system: Path) -> None:
    commands = alone(system, "python")
    system.with_name("upper.rcs").write_text(HOPED, encoding="utf-8")
    assert prove(system) == 1
    before = state(commands)
    for line in ("reload upper", "reload upper anyway", "diff upper", "reload upper proved"):
        error = refused(commands, line)
        assert error.code is Code.SHELL_NOT_COMPOSED
        assert str(error).startswith(
            "level `upper` keeps its tables: the new ones are not proved together with its neighbours\n"
            "not proved: table `work`: assumption `never_failed`"
        )
        assert error.helps == (
            f"`rcsc prove {system} --level upper` looks for the shortest run that shows it",
        )
    assert state(commands) == before
    do(commands, "step", "expect upper.line = 1")


def test_reload_proved_proves_the_levels_first(system: Path) -> None:
    commands = alone(system, "python")
    system.with_name("upper.rcs").write_text(HOPED, encoding="utf-8")
    error = refused(commands, "reload upper proved")  # nobody had looked at it
    assert error.code is Code.SHELL_NOT_COMPOSED
    assert "not proved: table `work`: assumption `never_failed`" in str(error)
    shutil.copy(SMALL / "upper.rcs", system.parent / "upper.rcs")
    edit_file(system.with_name("upper.rcs"), SLOWER)
    assert PROVED.format(system) in do(commands, "reload upper proved")
    assert "reload [LEVEL] proved" in HELP


def test_reload_proved_takes_nothing_that_stays_undecided(
    system: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands = alone(system, "python")
    edit_file(system.with_name("upper.rcs"), SLOWER)
    monkeypatch.setattr(
        composed, "prove_levels", lambda *_: None
    )  # as if the solver gave up: nothing is kept
    error = refused(commands, "reload upper proved")
    assert error.code is Code.SHELL_NOT_COMPOSED
    assert f": `rcsc prove {system}` decides it" in str(error)
    assert UNKNOWN.format(system) in do(commands, "reload upper")


def test_nothing_is_claimed_while_a_neighbour_runs_other_tables(system: Path) -> None:
    commands = alone(system, "python")
    edit_file(system.with_name("upper.rcs"), SLOWER)
    edit_file(system.with_name("lower.rcs"), ("table go {", "# Edited, and not taken.\ntable go {"))
    assert prove(system) == 0
    [said] = [line for line in do(commands, "diff upper") if "neighbours" in line]
    assert said.endswith(": level `lower` runs other tables than its file holds")
    error = refused(commands, "reload upper proved")
    assert str(error).endswith(": level `lower` runs other tables than its file holds")
    do(commands, "reload lower")
    assert PROVED.format(system) in do(commands, "reload upper")


def test_nothing_is_claimed_while_a_neighbour_was_compiled_of_other_tables(system: Path) -> None:
    edit_file(system.with_name("lower.rcs"), ("table go {", "state spare : bool\ntable go {"))
    commands = alone(system, "python")
    edit_file(system.with_name("upper.rcs"), SLOWER)
    assert prove(system) == 0
    [said] = [line for line in do(commands, "diff upper") if "neighbours" in line]
    assert said.endswith(": level `lower` runs other tables than its file holds")
    do(commands, "reload lower anyway")
    assert PROVED.format(system) in do(commands, "reload upper")


def test_a_neighbour_that_does_not_keep_what_is_assumed_is_named(system: Path) -> None:
    edit_file(
        system.with_name("lower.rcs"),
        ("report.ref_command_echo := command.input_command", "report.ref_command_echo := pause"),
    )
    compile_beside(system.with_name("lower.rcs"))
    commands = alone(system, "python")
    assert prove(system) == 1
    edit_file(system.with_name("upper.rcs"), SLOWER)
    assert prove(system) == 1
    [said] = [line for line in do(commands, "reload upper") if "neighbours" in line]
    assert "level `upper` assumes that what `lower` reports under the number of the last" in said
    edit_file(system.with_name("lower.rcs"), ("table go {", "# Another word.\ntable go {"))
    assert refused(commands, "reload lower").code is Code.SHELL_NOT_COMPOSED
