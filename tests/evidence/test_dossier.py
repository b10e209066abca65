"""`rcsc evidence` of the files that lie there, what its record says, and `--check`, which holds a dossier against a checkout.

The oracle is one edit at a time.
"""

import hashlib
import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

import rcsc.front.commands.tables.evidence  # noqa: F401  # it reads the kinds there are, before a test has others
from rcsc.front.commands import run
from rcsc.views.evidence import collect as collecting
from rcsc.views.evidence.kind import Evidence, Kind, Shortfall, Subject
from rcsc.views.pages.dossier_page import AcceptedPoint
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
    accepted = (
        AcceptedPoint("10.4", "a.c:3", "it is <meant>"),
        AcceptedPoint("10.4", "gone.c:3", "it is <meant>"),
    )
    return Evidence(("looked at",), {"seen.c": subject.files["c/a.c"]}, accepted=accepted)


def answered(evidence: Evidence, _: Subject) -> Evidence:
    return evidence


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
    pages = {f"evidence/{path}": digest for path, digest in record["pages"].items()}
    assert set(pages) == {"evidence/index.html", "evidence/texts.html"}
    for path, digest in {**named, **pages}.items():
        assert hashlib.sha256((project / path).read_bytes()).hexdigest() == digest
    index = (project / "evidence/index.html").read_text()
    assert all(digest in index for path, digest in named.items() if path != "a.rcs")
    assert "Made 1984-10-26T00:00:00Z by Ada, with rcsc " in index


def test_the_index_is_a_page_whose_places_lead_somewhere(project: Path) -> None:
    """What is accepted stands with its reason; a place that no text has is no link; nothing in a reason is markup."""
    assert made() == 0
    index, texts = ((project / "evidence" / name).read_text() for name in ("index.html", "texts.html"))
    assert "<td>10.4</td><td>it is &lt;meant&gt;</td>" in index
    assert 'href="texts.html#generated/c/a.c:3">a.c:3</a>, gone.c:3</td>' in index
    places = set(re.findall(r'href="texts\.html#([^"]+)"', index))
    assert {"a.rcs:1", "generated/c/a.c:3", "generated/c/a.h:1"} <= places
    assert all(f'id="{place}"' in texts for place in places)
    files = re.findall(r'href="(a/[^"]+)"', index)
    assert files
    assert all((project / "evidence" / file).is_file() for file in files)
    assert "<script" not in index


def test_what_a_kind_lacks_or_cannot_show_stands_in_the_index(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lacks = Evidence((), shortfalls=(Shortfall("a.c:2", "nobody looked"),))
    for evidence, told in (
        (lacks, "lacks 1 point"),
        (Evidence((), missing="no eye"), "shows nothing: no eye"),
    ):
        kind = Kind("looks", partial(answered, evidence))
        monkeypatch.setattr(collecting, "KINDS", {"misra": kind})
        assert made() == 1
        assert told in (project / "evidence/index.html").read_text()


def test_what_an_earlier_dossier_had_and_this_one_has_not_is_removed(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only what it wrote, as it wrote it: a user's own file, one that was changed, and what a record names elsewhere stay."""
    names = ("old.txt", "changed.txt")
    files = {"misra": Kind("looks", lambda _: Evidence((), dict.fromkeys(names, "seen")))}
    monkeypatch.setattr(collecting, "KINDS", files)
    assert made() == 0
    folder = project / "evidence/a/misra"
    (folder / "changed.txt").write_text("mine")
    (folder / "own.txt").write_text("mine")
    record = project / "evidence/index.json"
    document = json.loads(record.read_text())
    document["programs"][0]["reports"]["../a.rcs"] = hashlib.sha256(
        (project / "a.rcs").read_bytes()
    ).hexdigest()
    record.write_text(json.dumps(document))
    monkeypatch.setattr(collecting, "KINDS", {"misra": Kind("looks", looked)})
    assert made() == 0
    assert sorted(path.name for path in folder.iterdir()) == ["changed.txt", "own.txt", "seen.c"]
    assert (project / "a.rcs").is_file()


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
    "the index": (lambda at: (at / "evidence/index.html").write_text(""), "`evidence/index.html` differs"),
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
        text.replace('"form": 2', '"form": 9'),
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
