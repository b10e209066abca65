"""`rcsc evidence` of the files that lie there, what its record says, and `--check`, which holds a dossier against a checkout.

The oracle is one edit at a time.
"""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest

import rcsc.front.commands.tables.evidence  # noqa: F401  # it reads the kinds there are, before a test has others
from rcsc.front.commands import run
from rcsc.views.evidence import collect as collecting
from rcsc.views.evidence.kind import Evidence, Kind, Subject
from tests.support.programs.texts import edit_file

TABLE = """input a : int 0 .. 9
state left : int 0 .. 9
procedure halve { left := left / 2 }
table t {
  | line | a    || procedures |
  |------|------||------------|
  | 1    | 0    ||            |
  | 2    | /= 0 || halve      |
}
level l { table t }
"""


def looked(subject: Subject) -> Evidence:
    """A kind that says what it was given."""
    return Evidence(("looked at",), {"seen.c": subject.files["c/a.c"]})


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A compiled project, in which the test stands, and one cheap kind of evidence."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "467596800")
    kind = Kind("looks", looked, lambda: {"eye": "Eye 2.0"})
    monkeypatch.setattr(collecting, "KINDS", {"misra": kind})
    (tmp_path / "a.rcs").write_text(TABLE)
    assert run(["compile", "-q", "a.rcs"]) == 0
    return tmp_path


def made(*options: str) -> int:
    """The status of making a dossier."""
    return run(["evidence", "-q", "--only", "misra", "--by", "Ada", *options, "a.rcs"])


def test_the_record_has_every_file_and_how_it_was_made(project: Path) -> None:
    assert made() == 0
    record = json.loads((project / "evidence/index.json").read_text())
    assert (record["date"], record["by"]) == ("1984-10-26T00:00:00Z", "Ada")
    assert record["tools"] == {"misra": {"eye": "Eye 2.0"}}
    assert record["options"]["solver"] == "auto"
    assert record["target"]["host"]
    [program] = record["programs"]
    named = {**program["tables"], **program["code"]}
    named |= {f"evidence/{path}": digest for path, digest in program["reports"].items()}
    assert set(named) >= {"a.rcs", "generated/c/a.c", "generated/c/a.h", "evidence/a/misra/seen.c"}
    for path, digest in {**named, "evidence/index.md": record["index"]}.items():
        assert hashlib.sha256((project / path).read_bytes()).hexdigest() == digest
    index = (project / "evidence/index.md").read_text()
    assert all(digest in index for path, digest in named.items() if path != "a.rcs")
    assert "Made 1984-10-26T00:00:00Z by Ada, with rcsc " in index


def test_who_runs_it_is_asked_of_the_environment(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for variable, name in (("LOGNAME", "grace"), ("RCSC_BY", "Grace Hopper")):
        monkeypatch.setenv(variable, name)
        assert run(["evidence", "-q", "--only", "misra", "a.rcs"]) == 0
        assert json.loads((project / "evidence/index.json").read_text())["by"] == name
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    assert made() == 2


def test_what_was_made_anew_is_kept_with_the_dossier(project: Path) -> None:
    edit_file(project / "generated/c/a.c", ("do not edit", "do edit"))
    assert made("--anew") == 0
    assert "do not edit" in (project / "evidence/a/code/c/a.c").read_text()
    assert run(["evidence", "-q", "--check", "evidence"]) == 0
    (project / "evidence/a/code/c/a.c").write_text("")
    assert run(["evidence", "-q", "--check", "evidence"]) == 1


CHANGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "C": (lambda at: edit_file(at / "generated/c/a.c", ("do not edit", "do edit")), "`generated/c/a.c` differs"),
    "a header": (lambda at: (at / "generated/c/a.h").unlink(), "`generated/c/a.h` is missing"),
    "a table": (lambda at: edit_file(at / "a.rcs", ("| 1 ", "| 0 ")), "`a.rcs` differs"),
    "more C": (lambda at: (at / "generated/c/more.c").write_text(""), "`generated/c/more.c` is new"),
    "a report": (lambda at: (at / "evidence/a/misra/seen.c").write_text(""), "`evidence/a/misra/seen.c` differs"),
    "more of a report": (lambda at: (at / "evidence/a/more.csv").write_text(""), "`evidence/a/more.csv` is new"),
    "the index": (lambda at: (at / "evidence/index.md").write_text(""), "`evidence/index.md` differs"),
}  # fmt: skip


def test_a_dossier_is_held_against_a_checkout(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "generated/c/other.c").write_text(
        ""
    )  # not of this program, and there when the dossier was made
    assert made() == 0
    kept = {path: path.read_bytes() for path in project.rglob("*") if path.is_file()}
    capsys.readouterr()
    assert run(["evidence", "--check", "evidence"]) == 0
    said = "".join(capsys.readouterr())
    assert " files are those of evidence, made 1984-10-26T00:00:00Z by Ada with rcsc " in said
    for edit, told in CHANGES.values():
        edit(project)
        assert run(["evidence", "--check", "evidence", "--format", "line"]) == 1
        [line] = [line for line in capsys.readouterr().out.splitlines() if "RCS609" in line]
        assert told in line
        for path in {path for path in project.rglob("*") if path.is_file()} - kept.keys():
            path.unlink()
        for path, content in kept.items():
            path.write_bytes(content)


def test_what_is_no_record_is_refused(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert made() == 0
    record = project / "evidence/index.json"
    text = record.read_text()
    for wrong in (
        "[]",
        "{}",
        text.replace('"a.rcs": "', '"/etc/hosts": "'),
        text.replace('"form": 1', '"form": 9'),
    ):
        record.write_text(wrong)
        capsys.readouterr()
        assert run(["evidence", "--check", "evidence"]) == 2
        assert "index.json" in capsys.readouterr().err


def test_evidence_is_of_the_c_that_lies_there(
    project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.undo()
    monkeypatch.chdir(project)
    edit_file(project / "generated/c/a.c", ("s->left >> 1u", "s->left / (s->left - s->left)"))
    capsys.readouterr()
    assert made() == 1
    assert "error[RCS501]: `generated/c/a.c` differs from the code of the tables" in capsys.readouterr().out
    places = (project / "evidence/a/misra/places.csv").read_text()
    assert "a.c" in places
    assert run(["evidence", "-q", "--check", "evidence"]) == 0
    record = json.loads((project / "evidence/index.json").read_text())
    assert record["tools"]["misra"]["cppcheck"].startswith("Cppcheck 2.")
