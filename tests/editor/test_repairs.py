"""A repair, applied, is a text of which a check that knows nothing of it says what the repair says."""

import re
from pathlib import Path

import pytest

from rcsc.base.diagnostics.diagnostic import Change, ChangeKind, Proposal
from rcsc.base.diagnostics.source import Source
from rcsc.desk.editor import Workspace
from rcsc.desk.editor.places import Lines
from rcsc.desk.editor.values import Finding, Repair
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.tree import File
from rcsc.lang.written.changes import with_proposal
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.findings.unread import TOLD

REPO = Path(__file__).parents[2]
PUBLISHED = [
    "examples/acquire_published.rcs", "gallery/cia402/commands_published.rcs", "gallery/tcas/published.rcs",
    "gallery/lm_fsm/published.rcs", "examples/grip.rcs", "gallery/ros2_lifecycle/published.rcs",
]  # fmt: skip
HEAD = (
    "enum mode { off, on, stuck }\ninput now : mode\ninput w : int 0 .. 9\ninput v : int 0 .. 9\n"
    "input door : bool\noutput out : int 0 .. 3\n"
)
WRONG = {
    "a gap": """
  | line | now    | w    || out |
  |------|--------|------||-----|
  | a    | off    | <= 4 || 1   |
  | b    | /= off |      || 2   |
""",
    "an overlap": """
  | line | now    | w    || out |
  |------|--------|------||-----|
  | a    | off    |      || 1   |
  | b    |        | >= 5 || 2   |
  | c    | /= off | <= 4 || 0   |
""",
    "an overlap of lines that do the same": """
  | line | w    || out |
  |------|------||-----|
  | a    | <= 5 || 1   |
  | b    | >= 5 || 1   |
""",
    "a dead line": """
  | line | w    | w    || out |
  |------|------|------||-----|
  | a    | <= 4 |      || 1   |
  | b    |      | >= 5 || 2   |
  | c    | <= 4 | >= 5 || 2   |
""",
    "a DEFAULT that is never reached": """
  | line | w       || out |
  |------|---------||-----|
  | a    | <= 4    || 1   |
  | b    | >= 5    || 2   |
  | c    | DEFAULT || 2   |
""",
    "a gap of a table in parts": """
  | line | now ||
  |------|-----||
  | a    | off ||
  | b    | on  ||

  | line | w || out |
  |------|---||-----|
  | a    |   || 1   |
  | b    |   || 2   |
""",
    "an overlap in a further part": """
  | line | door ||
  |------|------||
  | a    |      ||
  | b    |      ||

  | line | w    || out |
  |------|------||-----|
  | a    | <= 5 || 1   |
  | b    | >= 5 || 2   |
""",
    "an overlap in cells over several rows": """
  | line | now       | w    || out |
  |------|-----------|------||-----|
  | a    | in {off,  |      || 1   |
  |      | on}       |      ||     |
  | b    | in {on,   |      || 2   |
  |      | stuck}    |      ||     |
""",
    "a gap across variables": """
  | line | w - v || out |
  |------|-------||-----|
  | a    | <= 0  || 1   |
  | b    | >= 2  || 2   |
""",
    "an empty cell of a matrix": """by now giving out
  | line | w    || off | on | stuck |
  |------|------||-----|----|-------|
  | a    | <= 4 || 1   | 2  |       |
  | b    | >= 5 || 1   | 2  | 3     |
""",
    "columns of a matrix that overlap": """by now giving out
  | w    || off | in {on, off} | stuck |
  |------||-----|--------------|-------|
  | <= 4 || 1   | 2            | 3     |
  | >= 5 || 1   | 2            | 3     |
""",
    "a row that a matrix has not": """by now giving out
  | w      || off | on | stuck |
  |--------||-----|----|-------|
  | <= 4   || 1   | 2  | 3     |
  | 5 .. 7 || 1   | 2  | 3     |
""",
    "a column that a matrix has not": """by now giving out
  | line | w    || off |
  |------|------||-----|
  | a    | <= 4 || 1   |
  | b    | >= 5 || 1   |

  | line || on |
  |------||----|
  | a    || 2  |
  | b    || 2  |
""",
    "a column of a matrix that is a condition": """by w giving out
  | now    || <= 4 | >= 5 | open : when door |
  |--------||------|------|------------------|
  | off    || 1    |      | 3                |
  | on     || 1    | 2    |                  |
  | stuck  || 1    | 2    |                  |
  | DEFAULT || out                         |
""",
    "a row of results with a gap": """giving out
  | line | now    || 1      | 2     |
  |------|--------||--------|-------|
  | a    | off    || w < 3  | w > 5 |
  | b    | /= off || w <= 6 | w > 6 |
""",
    "results that overlap": """giving out
  | now    || 1      | 2          |
  |--------||--------|------------|
  | off    || w < 3  | w + v >= 3 |
  | /= off || w <= 6 | w > 6      |
""",
    "a row of results that is missing": """giving out
  | line | now || 1      | 2     |
  |------|-----||--------|-------|
  | a    | off || w <= 3 | w > 3 |
  | b    | on  || w <= 6 | w > 6 |
""",
    "a result that never comes about": """giving out
  | now    || 1                   | 2     | out    |
  |--------||---------------------|-------|--------|
  | off    || now = on and w <= v | w > 3 | w <= 3 |
  | /= off || true                |       |        |
""",
    "a name that is misspelt": """
  | line | now    || out |
  |------|--------||-----|
  | a    | of     || 1   |
  | b    | /= off || 2   |
""",
}


def text_of(rows: str) -> str:
    said, _, rest = rows.partition("\n")
    return f"{HEAD}\ntable t {said}{' ' if said else ''}{{\n{rest}}}\n"


def mended(workspace: Workspace, file: str, written: str) -> list[tuple[Finding, Repair, str]]:
    workspace.open(file, written)
    found = workspace.check(file).findings
    return [
        (finding, repair, Lines(written).applied(repair.edits))
        for finding in found
        for repair in workspace.repairs(finding)
    ]


def serious(file: Path, written: str) -> dict[str, int]:
    """The findings of a check that has nothing but the file, by code; not what nobody reads, which no repair is about."""
    file.write_text(written, encoding="utf-8", newline="")
    counts: dict[str, int] = {}
    for each in check(Settings((str(file),), Options(), use_cache=False)).diagnostics:
        if each.severity.value != "note" and each.code not in TOLD:
            counts[each.code.value] = counts.get(each.code.value, 0) + 1
    return counts


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("what", WRONG)
def test_a_repair_mends_what_it_says(what: str, end: str, tmp_path: Path) -> None:
    file = tmp_path / "wrong.rcs"
    written = (text_of(WRONG[what])).replace("\n", end)
    before = serious(file, written)
    assert before
    repairs = mended(Workspace(), str(file), written)
    assert repairs
    for finding, repair, after in repairs:
        now = serious(file, after)
        assert now.get(finding.code, 0) < before[finding.code] or finding.code == "RCS401"
        assert set(now) <= set(before)
        if repair.clears:
            assert not now
        assert after.count("\n") == after.count(end)
    assert any(repair.clears or not repair.certain for _, repair, _ in repairs)


@pytest.mark.parametrize("name", PUBLISHED)
def test_repairs_of_published_tables_mend_one_finding_each(name: str, tmp_path: Path) -> None:
    """Of tables as they are printed, with what they use; each is laid out as it was."""
    import shutil

    shutil.copytree(REPO / "tables", tmp_path / "tables", ignore=shutil.ignore_patterns("*.md"))
    file = tmp_path / "tables" / name
    written = file.read_text()
    before = serious(file, written)
    repairs = mended(Workspace(), str(file), written)
    assert repairs
    for finding, repair, after in repairs[:4]:
        now = serious(file, after)
        assert set(now) <= set(before), repair.title
        assert sum(now.values()) < sum(before.values()) or finding.code == "RCS401", repair.title
        parsed = parse(Source(name, after))
        assert isinstance(parsed, File)
        assert (format_file(parsed) == after) == (_laid_out(written))


def _laid_out(written: str) -> bool:
    parsed = parse(Source("", written))
    return isinstance(parsed, File) and format_file(parsed) == written


def test_a_repair_that_does_not_mend_is_not_offered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the text is that is made of a proposal: it is checked."""
    from rcsc.desk.editor import workspace as module

    written = text_of(WRONG["an overlap"])
    assert mended(Workspace(), "/nowhere/a.rcs", written)
    for wrong in (
        written,
        written.replace("| b |", "| bb |"),
        written.replace(">= 5", "<= 4"),
        written + "input w : bool\n",
    ):
        monkeypatch.setattr(module, "with_proposal", lambda _source, _proposal, text=wrong: text)
        assert mended(Workspace(), "/nowhere/a.rcs", written) == []


@pytest.mark.parametrize("what", WRONG)
def test_a_repair_is_of_the_text_as_it_is_not_of_an_older_one(what: str, tmp_path: Path) -> None:
    """A file that two use was checked for the first of them before it was typed into, and for the other since."""
    text = text_of(WRONG[what])
    for name in ("one", "other"):
        (tmp_path / f"{name}.rcs").write_text("use t\n")
    used, other = str(tmp_path / "t.rcs"), str(tmp_path / "other.rcs")
    offered = 0
    for line in re.findall(r"^  \| [^-\s|].*\n", text, re.MULTILINE)[1:]:
        known, new = Workspace(), Workspace()
        known.open(used, text)
        known.check(str(tmp_path / "one.rcs"))
        for workspace in (known, new):
            workspace.open(used, text.replace(line, f"  # a remark, that moves what is below\n{line}"))
        found, _ = (workspace.check(other).findings for workspace in (known, new))
        now = [(known.repairs(each), new.repairs(each)) for each in found]
        assert all(of_known == of_new for of_known, of_new in now)
        offered += sum(len(each) for each, _ in now)
    assert offered


def test_what_is_only_checked_says_nothing_that_was_to_be_proved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Past the budget of trials the finding goes with a repair; that its own words are so is not proved."""
    written = text_of(WRONG["an overlap of lines that do the same"])
    known = [repair for _, repair, _ in mended(Workspace(), str(tmp_path / "a.rcs"), written)]
    assert all(repair.certain and repair.proved for repair in known)
    monkeypatch.setattr("rcsc.proof.table.mending.MOST_TRIED", 0)
    checked = [repair for _, repair, _ in mended(Workspace(), str(tmp_path / "a.rcs"), written)]
    assert [repair.title for repair in checked] == [repair.title for repair in known]
    assert not any(repair.certain or repair.proved for repair in checked)


def test_a_comment_in_a_row_that_a_cell_leaves_stays() -> None:
    """The cell stood over two rows, of which the second holds nothing else but the comment."""
    written = text_of("""
  | line | w         || out |
  |------|-----------||-----|
  | a    | in {0, 1, ||  1  |
  |      | 2}        ||     | # two grips
  | b    | >= 3      ||  2  |
""")
    change = Change(ChangeKind.CELL, "a", 0, ("<= 2",))
    after = with_proposal(Source("a.rcs", written), Proposal("say it shorter", "t", "", (change,)))
    assert after is not None
    assert "# two grips" in after
    assert "2}" not in after
