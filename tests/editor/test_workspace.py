"""What an editor is answered is what `rcsc check` says of the same text, and more of a text that is half written."""

import shutil
from pathlib import Path

import pytest

from rcsc.base.diagnostics.report import TableReport, Verdict
from rcsc.desk.editor import Workspace
from rcsc.desk.editor.memo import OutdatedError
from rcsc.desk.editor.values import Answer, State, standing
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.lang.written.tables import cells_of, tables_of
from rcsc.proof.solvers.options import Options
from tests.editor.random_edits import compared

REPO = Path(__file__).parents[2]
SMALL = ["examples/grip.rcs", "examples/later/lower.rcs", "gallery/tcas/tcas.rcs", "gallery/cia402/drive.rcs", "vocabulary.rcs",
         "gallery/safety_injection/published.rcs", "gallery/railway_interlocking/interlocking.rcs", "task/pause.rcs"]  # fmt: skip
TWO = """enum mode {{ off, on }}
input now : mode
input width : int 0 .. 9 [mm]
{more}

table first {{
  | line | now | width ||
  |------|-----|-------||
  | a    | off |       ||
  | b    | {b} |       ||
}}

table second {{
  | line | width  ||
  |------|--------||
  | low  | <= {low} ||
  | high | >= 5   ||
}}
"""


def text(b: str = "on", low: str = "4", more: str = "") -> str:
    return TWO.format(b=b, low=low, more=more)


def asked(workspace: Workspace, written: str, file: str = "/nowhere/two.rcs") -> Answer:
    workspace.open(file, written)
    return workspace.check(file)


def states(answer: Answer) -> dict[str, State]:
    return {table.name: table.standing.state for table in answer.tables}


def test_random_edits_get_the_answers_of_a_check() -> None:
    """A long run: `python -m tests.editor.random_edits --count 1000`."""
    right = 0
    for each in compared(60, 1, SMALL):
        assert each.editor == each.command, each.text
        right += "RCS1" not in str(each.command)
    assert right >= 10


def test_only_what_changed_is_proved_again() -> None:
    workspace = Workspace()
    asked(workspace, text())
    assert workspace.memo.made == 2
    for written in (text(more="# words"), text(more="\n\n"), "# above\n" + text()):
        asked(workspace, written)
        assert workspace.memo.made == 2
    failed = asked(workspace, text(low="3"))
    assert workspace.memo.made == 3
    moved = asked(workspace, "# above\n" + text(low="3"))
    assert workspace.memo.made == 3
    [before], [after] = failed.findings, moved.findings
    assert (after.message, after.area.start.line) == (before.message, before.area.start.line + 1)
    asked(workspace, text())
    assert workspace.memo.made == 3
    asked(workspace, text(more="input other : bool"))
    assert workspace.memo.made == 5


def test_the_rest_of_a_half_written_file_is_checked() -> None:
    """The first table does not parse; in the second is a gap."""
    workspace = Workspace()
    assert states(asked(workspace, text(low="4"))) == {"first": State.PROVED, "second": State.PROVED}
    answer = asked(workspace, text(b="in {", low="3"))
    assert not answer.whole
    assert [(each.table, each.meanwhile) for each in answer.findings] == [("first", False), ("second", True)]
    assert states(answer) == {"first": State.ERRORS, "second": State.ERRORS}
    assert [len(each.witnesses) for each in answer.findings] == [0, 1]
    answer = asked(workspace, text(b="in {", low="4"))
    assert states(answer) == {"first": State.ERRORS, "second": State.STALE}


LEVEL = """
state held : bool
level only {{
  period 40 [ms]
  table by now {{
    off : {off}
    on : second
  }}
}}
"""


@pytest.mark.parametrize(
    ("b", "low", "off", "first"),
    [
        ("o", "3", "first", "first"),  # a name that is half typed
        ("in {", "3", "first", "first"),  # a cell that does not parse
        ("on | on", "3", "first", "first"),  # a row of other cells
        ("o", "4", "first", "first"),  # of a table that is harmed nothing more is told: it would have a gap
        ("on", "3", "fi", ""),  # a level that runs what is not there
    ],
)
def test_what_is_half_typed_takes_no_more_than_its_place(b: str, low: str, off: str, first: str) -> None:
    """The other table is checked, and the level that runs both of them stands."""
    workspace = Workspace()
    answer = asked(workspace, text(b=b, low=low, more="") + LEVEL.format(off=off))
    told = {(first, False), ("second", True)} if low == "3" else {(first, False)}
    assert {(each.table, each.meanwhile) for each in answer.findings} == told
    assert State.PROVED not in states(answer).values()
    nearest = workspace.reading("/nowhere/two.rcs").nearest
    assert nearest is not None
    assert [table.name for table in nearest.tables] == ["first", "second"]
    assert [level.name for level in nearest.levels] == (["only"] if off == "first" else [])


def test_in_every_shipped_file_a_half_typed_name_leaves_the_rest() -> None:
    """One in each of two lines of a table of each file: everything that the file declares is there still."""
    count = lost = 0
    for file in sorted((REPO / "tables").rglob("*.rcs")):
        path, written, workspace = str(file), file.read_text(encoding="utf-8"), Workspace()
        whole = workspace.reading(path).program
        for table in () if whole is None else list(tables_of(written))[:1]:
            rows = [row for line in table.parts[0].lines[:2] for row in line[:1]]
            for cell in [cell for row in rows for cell in cells_of(row).conditions[1:] if cell.text][:2]:
                workspace.open(path, f"{written[: cell.start]}zz{written[cell.start + len(cell.text) :]}")
                reading = workspace.reading(path)
                if reading.program is not None:
                    continue  # the cell stood alone
                count += 1
                assert whole is not None
                named = {
                    (kind, each.name)
                    for kind in ("tables", "levels", "variables", "procedures")
                    for each in getattr(whole, kind)
                }
                left = {
                    (kind, each.name)
                    for kind in ("tables", "levels", "variables", "procedures")
                    for each in (() if reading.nearest is None else getattr(reading.nearest, kind))
                }
                lost += named != left
    assert count > 80
    assert lost <= 3, "those with a condition over several rows, of which one is gone"


@pytest.mark.parametrize(
    "more", ["input x : ", "enum colour { red, ", "procedure p {\n  x :=", "input y : nothing"]
)
def test_no_finding_comes_of_what_was_left_out(more: str) -> None:
    """What the broken declaration would have declared is missing; who uses it is left alone."""
    uses = text(more=more) + "table third {\n| line | x ||\n|---|---||\n| a | true ||\n| b | red ||\n}\n"
    answer = asked(Workspace(), uses)
    assert [each for each in answer.findings if each.meanwhile] == []
    assert State.PROVED not in states(answer).values()


def test_a_broken_file_that_is_used_leaves_the_rest(tmp_path: Path) -> None:
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "words.rcs").write_text("enum mode { off, on }\ninput wrong : nowhere\n")
    user = str(tmp_path / "two.rcs")
    written = "use words\n" + text(low="3").replace("enum mode { off, on }\n", "")
    answer = asked(Workspace(), written, user)
    found = [(Path(each.area.file).name, each.code[:4], each.meanwhile) for each in answer.findings]
    assert found == [("two.rcs", "RCS4", True), ("words.rcs", "RCS2", False)]
    assert states(answer) == {"first": State.STALE, "second": State.ERRORS}


def test_open_texts_stand_for_files(tmp_path: Path) -> None:
    """Unsaved, new, deleted and closed ones; what a folder holds, too."""
    user, words = str(tmp_path / "a.rcs"), str(tmp_path / "words.rcs")
    workspace = Workspace()
    workspace.open(user, "use words\n" + text().replace("enum mode { off, on }\n", ""))
    assert [each.code for each in workspace.check(user).findings] == ["RCS205"]
    workspace.open(words, "enum mode { off, on }\n")
    assert workspace.check(user).findings == ()
    workspace.close(words)
    Path(words).write_text("enum mode { off, on, broken }\n")
    assert states(workspace.check(user))["first"] is State.REFUTED
    Path(words).unlink()
    assert not workspace.check(user).whole
    Path(words).write_bytes(b"\xff\xfe")
    assert "RCS1" in {each.code[:4] for each in workspace.check(user).findings}


def test_texts_that_only_an_editor_has_are_in_their_folder(tmp_path: Path) -> None:
    from rcsc.lang.project import load

    new = str(tmp_path / "new.rcs")
    (tmp_path / "old.rcs").write_text(text())
    loaded = load([str(tmp_path)], overlay={new: text()})
    assert [Path(file).name for file in loaded.given] == ["new.rcs", "old.rcs"]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_areas_are_where_the_text_is(end: str) -> None:
    """Each cell's area holds its text, whatever lines end with."""
    from rcsc.desk.editor.places import Lines

    written = (REPO / "tables/emove/locate.rcs").read_text().replace("\n", end)
    workspace = Workspace()
    answer = asked(workspace, written, str(REPO / "tables/emove/locate.rcs"))
    lines = Lines(written)
    [table] = answer.tables
    assert (len(table.rows), len(table.columns)) == (17, 11)
    for row in table.rows:
        for cell in (row.stub, *row.cells):
            at = [written[lines.offset(area.start) : lines.offset(area.end)] for area in cell.areas]
            assert " ".join(at) == cell.text
    assert {column.kind for column in table.columns} == {"condition", "output", "procedures"}
    assert {column.heading: column.type for column in table.columns}["vision.status"] == "level_status"


def test_shares_of_lines_add_up() -> None:
    answer = asked(Workspace(), text())
    shares = {row.name: row.share for table in answer.tables for row in table.rows}
    assert shares == {"a": (1, 2), "b": (1, 2), "low": (5, 10), "high": (5, 10)}
    assert answer.tables[0].columns[1].unit == "mm"


def test_nobody_is_answered_too_late() -> None:
    workspace = Workspace()
    workspace.open("/nowhere/two.rcs", text())
    with pytest.raises(OutdatedError):
        workspace.check("/nowhere/two.rcs", lambda: False)
    assert states(workspace.check("/nowhere/two.rcs")) == {"first": State.PROVED, "second": State.PROVED}


def test_standings_of_shipped_tables_are_their_verdicts(tmp_path: Path) -> None:
    """A table is called proved only where a check proves it from nothing that is assumed."""
    shutil.copytree(REPO / "tables", tmp_path / "tables")
    seen = set()
    for name in (
        "task/acquire.rcs",
        "task/pause.rcs",
        "examples/acquire_published.rcs",
        "gallery/ros2_lifecycle/rcl.rcs",
    ):
        file = str(tmp_path / "tables" / name)
        reports = {each.table: each for each in check(Settings((file,), Options(), use_cache=False)).tables}
        for table in Workspace().check(file).tables:
            report = reports[table.name]
            rests = [was for _, was in report.assumptions if was != "proved"]
            proved = State.TRUSTING if rests else State.PROVED
            wanted = proved if report.verdict is Verdict.PROVED else State(report.verdict.value)
            assert table.standing.state is wanted
            seen.add(wanted)
    assert seen == {State.REFUTED, State.TRUSTING, State.PROVED}


@pytest.mark.parametrize("verdict", [each for each in Verdict if each is not Verdict.PROVED])
def test_what_is_not_proved_is_not_called_so(verdict: Verdict) -> None:
    told = standing(TableReport("t", "a.rcs", verdict, 1), ())
    assert told.state is not State.PROVED
    assert told.why


def test_an_error_in_a_table_fails_it_whatever_its_verdict() -> None:
    assert standing(TableReport("t", "a.rcs", Verdict.PROVED, 1), ("it may overflow",)).state is State.ERRORS
