"""`import rcsc`: what it gives is what the commands say, as values; it costs nothing until it is used; the guide's examples run."""

import ast
import doctest
import json
import re
import shutil
import subprocess
import sys
from dataclasses import FrozenInstanceError
from pathlib import Path
from typing import Literal

import pytest

import rcsc
from rcsc.front.commands import run as command
from rcsc.run.log.export import rows
from rcsc.run.log.read import read
from tests.support.programs.systems import SYSTEM, small_system, small_text
from tests.support.programs.texts import edit_file

REPO = Path(__file__).parents[2]
LAST_ECHO = REPO / "tables" / "examples" / "later" / "last_echo.toml"
GUIDE = REPO / "tables" / "guide" / "python.md"


def test_the_examples_of_the_guide_do_what_it_shows(dock: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All in one session, in the folder in which `dock` lies."""
    monkeypatch.chdir(dock.parent)
    text = GUIDE.read_text(encoding="utf-8")
    examples = "\n".join(re.findall(r"^```pycon\n(.*?)^```", text, re.DOTALL | re.MULTILINE))
    parsed = doctest.DocTestParser().get_doctest(examples, {}, "guide", str(GUIDE), 0)
    assert len(parsed.examples) >= 10
    outcome = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE).run(parsed)
    assert outcome.failed == 0


def test_importing_rcsc_imports_nothing_else() -> None:
    script = (
        "import sys; before = set(sys.modules); import rcsc; dir(rcsc)\n"
        "print(sorted(set(sys.modules) - before))\n"
        "rcsc.Severity; print(sorted({'mujoco', 'rcsc_cell', 'hypothesis', 'mcap'} & set(sys.modules)))"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    first, second = map(ast.literal_eval, ran.stdout.splitlines())
    roots = {name.partition(".")[0] for name in first}
    assert [name for name in first if name.startswith("rcsc")] == ["rcsc"]
    assert not roots - {"rcsc"} - set(sys.stdlib_module_names)
    assert second == []


def test_types_names_and_what_is_there_are_the_same() -> None:
    stub = ast.parse((REPO / "rcsc" / "__init__.pyi").read_text(encoding="utf-8"))
    typed = {alias.asname for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    import rcsc.front.api

    assert typed | {"__version__"} == set(rcsc.__all__) == {*rcsc.front.api.__all__, "__version__"}
    assert dir(rcsc) == sorted(rcsc.__all__)
    for name in rcsc.__all__:
        assert getattr(rcsc, name).__doc__
    with pytest.raises(AttributeError, match="chekc"):
        rcsc.chekc  # type: ignore[attr-defined]  # noqa: B018  # as a user might write


# --- tables --------------------------------------------------------------------------------

GAP = "input a : bool\ntable t {\n  | line | a    ||\n  |------|------||\n  | 1    | true ||\n}\n"


def test_a_report_has_spans_and_witnesses_and_does_not_change(tmp_path: Path) -> None:
    (tmp_path / "a.rcs").write_text(GAP)
    report = rcsc.check(tmp_path, cache=False)
    [found] = report.diagnostics
    span = found.primary.span
    source = report.sources[span.file]
    assert (found.code.value, found.severity, report.failed) == ("RCS401", rcsc.Severity.ERROR, True)
    assert (source.slice(span), source.position(span.start)) == ("t", rcsc.Position(2, 7))
    assert found.witnesses[0].values == ("false",)
    assert [(table.table, table.verdict) for table in report.tables] == [("t", rcsc.Verdict.REFUTED)]
    with pytest.raises(FrozenInstanceError):
        found.message = ""  # type: ignore[misc]


def test_executors_are_written_only_if_everything_is_proved(tmp_path: Path) -> None:
    (tmp_path / "a.rcs").write_text(GAP)
    out = tmp_path / "out"
    assert rcsc.compile(tmp_path / "a.rcs", out=out).failed
    assert not out.exists()
    edit_file(tmp_path / "a.rcs", ("| true ||", "|      ||"))
    assert not rcsc.compile(tmp_path / "a.rcs", out=out, targets=["python"]).failed
    assert [path.name for path in out.iterdir()] == ["python"]
    assert rcsc.compile(tmp_path / "a.rcs", out=out, write=False).failed  # the C is not there
    with pytest.raises(ValueError, match="rust"):
        rcsc.compile(tmp_path / "a.rcs", targets=["rust"])


@pytest.mark.parametrize("function", [rcsc.check, rcsc.compile])
def test_a_path_that_is_not_there_is_raised(function: object, tmp_path: Path) -> None:
    assert callable(function)
    with pytest.raises(FileNotFoundError, match=r"nothing\.rcs"):
        function(tmp_path / "nothing.rcs")


# --- levels together -----------------------------------------------------------------------


@pytest.mark.usefixtures("kept_proofs")
def test_a_proof_says_what_the_command_says(capsys: pytest.CaptureFixture[str]) -> None:
    """Of a system that is right and of one that is not: claims, findings, runs."""
    for system, status in ((SYSTEM, 0), (LAST_ECHO, 1)):
        assert command(["prove", "--json", "--trace", "4", str(system)]) == status
        form = json.loads(capsys.readouterr().out)
        proof = rcsc.prove(system, cycles=4)
        assert (proof.proved, proof.whole) == (form["proved"], form["whole"])
        claims = [(level["level"], goal) for level in form["levels"] for goal in level["goals"]]
        assert [(one.level, one.what, one.table, one.name, one.verdict) for one in proof.claims] == [
            (level, goal["what"], goal["table"], goal["name"], goal["verdict"]) for level, goal in claims
        ]
        assert [one.trusts for one in proof.claims] == [tuple(goal["trusts"]) for _, goal in claims]
        shown = [finding for finding in form["findings"] if finding["reproduces"]]
        runs = [found for found in proof.unproved if found.run]
        assert [[row.line for row in found.run] for found in runs] == [
            [row["line"] for row in finding["time_line"]] for finding in shown
        ]
        assert [found.helps for found in runs] == [tuple(finding["helps"]) for finding in shown]
        assert [[(then.how, then.what) for then in found.follows] for found in runs] == [
            [(then["how"], then["what"]) for then in finding["follows"]] for finding in shown
        ]
        assert any(not found.warning for found in runs) == (status == 1)


def test_one_level_without_runs(tmp_path: Path) -> None:
    proof = rcsc.prove(LAST_ECHO, levels=["upper"], cycles=0, cache=False)
    assert {claim.level for claim in proof.claims} == {"upper"}
    assert not any(found.run for found in proof.unproved)
    with pytest.raises(KeyError, match="nobody"):
        rcsc.prove(LAST_ECHO, levels=["nobody"])
    wrong = small_system(tmp_path, upper=small_text("upper", ("table work assuming", "tabel work assuming")))
    with pytest.raises(rcsc.CodedError):
        rcsc.prove(wrong)


# --- a system that runs --------------------------------------------------------------------


def test_both_executors_do_the_same_and_orders_are_numbered(dock: Path) -> None:
    done = []
    kinds: tuple[Literal["c", "python"], ...] = ("c", "python")
    for executor in kinds:
        system = rcsc.load_system(dock / "system.toml", executor=executor, prove=False)
        assert system.report() is None
        seen = []
        for command_ in ("dock", "undock"):
            system.order(command_)
            system.step()
            assert system.report() is None, "the report is of the order before"
            while not (report := system.report() or {}) or report["status_report"] == "executing":
                system.step()
                seen.append((system.tick, system.lines, system.value("drive.speed_mm_s")))
            assert (report["ref_command_echo"], report["status_report"]) == (command_, "done")
        assert report["inc_command_echo"] == 2
        assert system.seconds == pytest.approx(system.tick * 0.04)
        done.append(seen)
    assert done[0] == done[1]
    assert len(done[0]) > 50


def test_what_cannot_be_ordered_or_read_is_raised(dock: Path) -> None:
    system = rcsc.load_system(dock / "system.toml", executor="python", prove=False)
    for args, error in (
        (("dance", {}), ValueError),
        (("dock", {"far": 3}), KeyError),
        (("dock", {"level": "drive"}), KeyError),
    ):
        command_, more = args
        with pytest.raises(error):
            system.order(command_, **more)
    for name in ("drive.nothing", "nobody.speed_mm_s", "drive.command"):
        with pytest.raises(KeyError):
            system.value(name)
    assert (system.levels, system.tick, system.over) == (("supervisor", "drive"), 0, False)
    assert type(system.plant).__name__ == "Base"
    assert system.value("supervisor.now") == "rest"


def test_nothing_runs_that_is_not_proved(dock: Path) -> None:
    shutil.rmtree(dock / "generated")
    edit_file(
        dock / "drive.rcs",
        (
            (
                "  | bad   | false       | bad    |        |                      |        |"
                "|                  | 0          | fail       |\n"
                "}\n\n## Creeps"
            ),
            "}\n\n## Creeps",
        ),
    )
    with pytest.raises(rcsc.CodedError, match="no line of table `goto` matches"):
        rcsc.load_system(dock / "system.toml")
    assert not (dock / "generated").exists()


def test_another_plant_than_there_is_is_raised(dock: Path) -> None:
    with pytest.raises(rcsc.CodedError, match="no plant `other`"):
        rcsc.load_system(dock / "system.toml", plant="other", prove=False)


def test_a_run_is_that_of_the_command(dock: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Row by row, with both executors; it can be cut short, and go without a script."""
    system = dock / "system.toml"
    logs = [dock / f"{name}.mcap" for name in ("c", "python", "command")]
    ended = rcsc.run(system, log=logs[0], prove=False)
    assert ended == rcsc.run(system, executor="python", log=logs[1], prove=False)
    assert command(["run", "--no-compile", str(system), "--log", str(logs[2])]) == 0
    shown = re.findall(r"^ +(\d+)  (\S+) +(done) +(\d+) cycles$", capsys.readouterr().out, re.MULTILINE)
    assert [(str(row.number), row.text, row.state, str(row.ticks)) for row in ended.rows] == shown
    assert len(shown) == 3
    assert ended.done
    states = [list(rows(read(log))) for log in logs]
    assert states[0] == states[1] == states[2]
    assert len(states[0]) == ended.ticks
    cut = rcsc.run(system, cycles=10, prove=False)
    assert (cut.rows, cut.done, cut.ticks, cut.seconds) == ((), False, 10, 0.4)
    (dock / "other.csv").write_text("command,wrong\ndock,3\n")
    with pytest.raises(rcsc.CodedError, match="no order has a field `wrong`"):
        rcsc.run(system, script=dock / "other.csv", prove=False)


def test_a_row_that_fails_ends_the_run_with_its_reason(dock: Path) -> None:
    (dock / "blind.py").write_text(
        "from base import Base\nclass Blind(Base):\n    beacon: bool = False\n    travelled: float = 0.0\n",
        encoding="utf-8",
    )
    ended = rcsc.run(dock / "system.toml", plant=str(dock / "blind.py") + ":Blind", prove=False)
    assert not ended.done
    assert [(row.text, row.state) for row in ended.rows] == [("dock", "failed")]
    assert "no_beacon" in ended.rows[0].reason


def test_the_room_and_the_function_have_one_name() -> None:
    """Whichever is imported first."""
    for first in ("rcsc.run.system", "rcsc.front.api", "rcsc"):
        script = f"import {first}, rcsc; f = rcsc.run; import rcsc.run.system; assert f is rcsc.run and callable(f); rcsc.run.system.System"
        subprocess.run([sys.executable, "-c", script], check=True)
