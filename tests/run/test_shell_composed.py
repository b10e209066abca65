"""`reload` looks up what was proved of the levels together: known bad tables stay out, unknown ones are said to be."""

import shutil
from pathlib import Path

import pytest

from rcsc.commands import run
from rcsc.diagnostics.codes import Code
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.emit import TARGETS
from rcsc.shell.commands import HELP
from rcsc.shell.reload import composed
from rcsc.solvers.options import Options
from tests.run.test_shell import alone, do, refused, state

SMALL = Path(__file__).parents[1] / "data" / "composed"
SLOWER = (
    "|| nextstate(d_state)      | pause       | done       |",
    "|| nextstate(d_state)      | pause       | executing  |",
)
HOPED = (
    "table work assuming in_step",
    "assume never_failed monitored : status_in /= failed\ntable work assuming in_step, never_failed",
)
FAILED = next(
    row for row in (SMALL / "upper.rcs").read_text("utf-8").splitlines(True) if row.startswith("  | 4 ")
)
PROVED = "level `upper` is proved together with its neighbours, as the files of {} stand"
UNKNOWN = "level `upper` is not known to be proved together with its neighbours: `rcsc prove {}` decides it"


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small system, compiled, and its lower level proved: half of every proof here. Only to be copied."""
    folder = tmp_path_factory.mktemp("compiled") / "small"
    shutil.copytree(SMALL, folder, ignore=shutil.ignore_patterns(".rcsc-cache"))
    paths = tuple(str(folder / f"{name}.rcs") for name in ("upper", "lower"))
    made = compile_(Settings(paths, Options()), folder / "generated", TARGETS, only_check=False)
    assert not made.report.failed
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


def edit(system: Path, name: str, *edits: tuple[str, str]) -> None:
    path = system.parent / f"{name}.rcs"
    text = path.read_text(encoding="utf-8")
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def prove(system: Path) -> int:
    return run(["prove", str(system), "--trace", "0"])


def test_reload_says_what_is_known_of_the_levels_together(system: Path) -> None:
    commands = alone(system, "python")
    edit(system, "upper", SLOWER)
    assert UNKNOWN.format(system) in do(commands, "diff upper")
    assert prove(system) == 0
    assert PROVED.format(system) in do(commands, "diff upper")
    said = do(commands, "reload upper")
    assert PROVED.format(system) in said
    assert said[-1].startswith("level `upper` runs its new tables from cycle 1 on")
    edit(system, "upper", SLOWER[::-1])
    assert UNKNOWN.format(system) in do(commands, "reload upper")


def test_reload_refuses_what_was_found_not_to_be_proved_whatever_is_said(system: Path) -> None:
    commands = alone(system, "python")
    edit(system, "upper", HOPED, (FAILED, ""))
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
    edit(system, "upper", HOPED, (FAILED, ""))
    error = refused(commands, "reload upper proved")  # nobody had looked at it
    assert error.code is Code.SHELL_NOT_COMPOSED
    assert "not proved: table `work`: assumption `never_failed`" in str(error)
    shutil.copy(SMALL / "upper.rcs", system.parent / "upper.rcs")
    edit(system, "upper", SLOWER)
    assert PROVED.format(system) in do(commands, "reload upper proved")
    assert "reload [LEVEL] proved" in HELP


def test_reload_proved_takes_nothing_that_stays_undecided(
    system: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands = alone(system, "python")
    edit(system, "upper", SLOWER)
    monkeypatch.setattr(composed, "_prove", lambda *_: None)  # as if the solver gave up: nothing is kept
    error = refused(commands, "reload upper proved")
    assert error.code is Code.SHELL_NOT_COMPOSED
    assert f": `rcsc prove {system}` decides it" in str(error)
    assert UNKNOWN.format(system) in do(commands, "reload upper")


def test_nothing_is_claimed_while_a_neighbour_runs_other_tables(system: Path) -> None:
    commands = alone(system, "python")
    edit(system, "upper", SLOWER)
    edit(system, "lower", ("table go {", "# Edited, and not taken.\ntable go {"))
    assert prove(system) == 0
    [said] = [one for one in do(commands, "diff upper") if "neighbours" in one]
    assert said.endswith(": level `lower` runs other tables than its file holds")
    error = refused(commands, "reload upper proved")
    assert str(error).endswith(": level `lower` runs other tables than its file holds")
    do(commands, "reload lower")
    assert PROVED.format(system) in do(commands, "reload upper")


def test_nothing_is_claimed_while_a_neighbour_was_compiled_of_other_tables(system: Path) -> None:
    edit(system, "lower", ("table go {", "state spare : bool\ntable go {"))
    commands = alone(system, "python")
    edit(system, "upper", SLOWER)
    assert prove(system) == 0
    [said] = [one for one in do(commands, "diff upper") if "neighbours" in one]
    assert said.endswith(": level `lower` runs other tables than its file holds")
    do(commands, "reload lower anyway")
    assert PROVED.format(system) in do(commands, "reload upper")


def test_a_neighbour_that_does_not_keep_what_is_assumed_is_named(system: Path) -> None:
    edit(
        system,
        "lower",
        ("report.ref_command_echo := command.input_command", "report.ref_command_echo := pause"),
    )
    paths = (str(system.parent / "lower.rcs"),)
    made = compile_(Settings(paths, Options()), system.parent / "generated", TARGETS, only_check=False)
    assert not made.report.failed
    commands = alone(system, "python")
    assert prove(system) == 1
    edit(system, "upper", SLOWER)
    assert prove(system) == 1
    [said] = [one for one in do(commands, "reload upper") if "neighbours" in one]
    assert "level `upper` assumes that what `lower` reports under the number of the last" in said
    edit(system, "lower", ("table go {", "# Another word.\ntable go {"))
    assert refused(commands, "reload lower").code is Code.SHELL_NOT_COMPOSED
