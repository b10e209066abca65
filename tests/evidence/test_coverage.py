"""What clang measures while the vectors are played, and the reasons for what it does not see covered."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.base.host.tools import Absent
from rcsc.code.testing.coverage.directed import Director
from rcsc.code.testing.coverage.harness import vectors_c
from rcsc.code.testing.coverage.vector_set import vector_set
from rcsc.code.testing.target_coverage import BOARD, TargetCounts, counted_on_target
from rcsc.front.commands import run
from rcsc.views.evidence import coverage, llvm
from rcsc.views.evidence.kind import Subject
from tests.evidence.subjects import EVERYTHING, subject_of
from tests.support.programs.examples import EXTERN, LASTING, RELATED, STOPS

pytestmark = pytest.mark.needs("clang-19", "llvm-cov-19")


def edited_c(subject: Subject, right: str, wrong: str) -> Subject:
    files = {path: text.replace(right, wrong) for path, text in subject.files.items()}
    assert files != subject.files
    return replace(subject, files=files)


GALLERY = Path(__file__).parents[2] / "tables" / "gallery"
STAGED = [(GALLERY / name).read_text("utf-8") for name in ("plcopen_safety/guard.rcs", "lm_fsm/fsm.rcs")]
"""Tables that others follow, inputs that nothing can refuse, and invariants."""


@pytest.mark.parametrize("text", [EVERYTHING, EXTERN, LASTING, STOPS, RELATED, *STAGED])
def test_all_is_covered_or_out_of_reach(text: str) -> None:
    evidence = coverage.collect(subject_of(text))
    assert not evidence.missing
    assert evidence.shortfalls == ()
    assert "open" not in "".join(evidence.figures)
    there = not BOARD.absent()
    assert sum(" 0 wrong" in figure for figure in evidence.figures) == 2 + there
    assert ("target.txt" in evidence.files) is there
    assert sum("run a whole cycle" in figure for figure in evidence.figures) == 2
    for folder in ("", "defensive/"):
        missed = json.loads(evidence.files[f"{folder}missed.json"])
        assert all(each["reason"] for each in missed)
        assert "Branch (" in evidence.files[f"{folder}coverage.txt"]


@pytest.mark.needs("arm-none-eabi-gcc", "qemu-system-arm")
def test_the_targets_own_compiler_counts_what_vectors_reach_there() -> None:
    subject = subject_of(EVERYTHING)
    document = vector_set(subject.plan, subject.files, subject.options, None, subject.progress, 20)
    vectors = vectors_c(document.program, document.symbols, document.kept)
    counts = counted_on_target(subject.files, document.symbols.source, vectors)
    assert isinstance(counts, TargetCounts), counts
    odd = sum(bool(kept.case.mode) for kept in document.kept)
    assert (counts.played, counts.wrong, counts.left) == (len(document.kept) - odd, 0, odd)
    assert odd > 0
    assert f"{odd} not played" in counts.words
    assert 0.8 < counts.lines[1] / counts.lines[0] <= 1.0
    assert counts.branches[1] > 50
    few = vectors_c(document.program, document.symbols, document.kept[:3])
    less = counted_on_target(subject.files, document.symbols.source, few)
    assert isinstance(less, TargetCounts), less
    assert less.lines[0] == counts.lines[0]
    assert less.lines[1] < counts.lines[1]


def test_a_branch_that_no_vector_takes_is_a_shortfall() -> None:
    """A test that the language does not have is planted in the C: nothing explains it."""
    planted = "if (s->at > 3u) { s->at = 0u; }\n    s->both.right = s->go;"
    evidence = coverage.collect(edited_c(subject_of(EVERYTHING), "s->both.right = s->go;", planted))
    told = [each.what for each in evidence.shortfalls]
    assert any("`s->at > 3u` true" in what for what in told)


def test_a_wrong_result_is_a_shortfall() -> None:
    evidence = coverage.collect(edited_c(subject_of(EVERYTHING), "% 4u", "% 2u"))
    assert any(each.what.startswith("vector ") for each in evidence.shortfalls)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("const int32_t at = probe_check(s);", "const int32_t at = -1;"),
        ("s->go > 1u", "s->go > 2u"),
        ("s->both.right > 1u", "s->both.right > 2u"),
        ("s->fault = PROBE_FAULT_STATE;", "s->fault = PROBE_FAULT_ADMIT;"),
        ("s->fault_at = at;\n        s->assumptions", "s->fault_at = -1;\n        s->assumptions"),
    ],
)
def test_a_state_that_defensive_c_takes_is_a_shortfall(
    right: str, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    subject = subject_of(EVERYTHING)
    guarded = edited_c(subject.defensive(), right, wrong)
    monkeypatch.setattr(Subject, "defensive", lambda _: guarded)
    told = coverage.collect(subject).shortfalls
    assert any(each.where == "defensive, probe.c" and each.what.startswith("vector ") for each in told)
    assert all(each.where.startswith("defensive, ") for each in told)


def test_without_a_proof_nothing_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Director, "all", lambda _: iter(()))
    evidence = coverage.collect(subject_of(EVERYTHING))
    assert any("several" in each.what for each in evidence.shortfalls)


def test_c_that_does_not_compile_is_a_shortfall() -> None:
    evidence = coverage.collect(
        edited_c(subject_of(EVERYTHING), "int32_t probe_check(", "int32_t probe_chuck(")
    )
    assert [each.where for each in evidence.shortfalls] == ["probe.c"]
    assert "error" in evidence.shortfalls[0].what


def test_tools_that_are_not_there_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    absent = llvm.tools()
    assert isinstance(absent, Absent)
    assert coverage.collect(subject_of(EVERYTHING)).missing == absent.reason
    assert "apt install clang-19 llvm-19" in absent.reason


def test_the_command_shows_it_of_a_shipped_table(
    repo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`rcsc evidence --only coverage tables/gripper` does it for a level: a quarter of a minute."""
    path = str(repo / "tables/examples/approach.rcs")
    assert run(["evidence", "--only", "coverage", "--out", str(tmp_path), path]) == 0
    told = capsys.readouterr().out
    assert "15 of 16 MC/DC conditions, 1 shown to be out of reach" in told
    assert "MC/DC is that of unique cause; by masking it is 15 of 16" in told
    folder = tmp_path / "approach" / "coverage"
    there = set() if BOARD.absent() else {"target.txt"}
    assert {path.name for path in folder.iterdir()} == there | {
        "report.md", "coverage.txt", "vectors.c", "vectors.json", "missed.json", "defensive",
    }  # fmt: skip
    assert "**not shown**" not in (folder / "report.md").read_text("utf-8")
