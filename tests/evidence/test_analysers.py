"""What compilers, analysers and sanitizers say of the generated C, and that they tell of what is planted."""

from pathlib import Path

import pytest

from rcsc.views.evidence import analysers
from tests.evidence.subjects import EVERYTHING, subject_of


@pytest.mark.needs("clang-19", "clang-tidy-19")
def test_nothing_is_found_but_what_is_meant(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analysers, "CALLS", 20_000)
    evidence = analysers.collect(subject_of(EVERYTHING))
    assert not evidence.shortfalls
    assert len(evidence.figures) == 14
    assert not [line for line in evidence.files["findings.csv"].split("\n")[1:-1] if line.endswith(",")]


PLANTED = (
    ("s->kept[s->at] =", "s->kept[s->at + 1u] =", "sanitizers of gcc"),
    ("s->both.left = (uint8_t)", "s->both.left = ", "implicit-int-conversion"),
)


@pytest.mark.needs("clang-19", "clang-tidy-19")
def test_what_is_planted_is_told_with_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analysers, "CALLS", 20_000)
    edits = [(written, planted) for written, planted, _ in PLANTED]
    shortfalls = analysers.collect(subject_of(EVERYTHING, *edits)).shortfalls
    for _, _, told in PLANTED:
        assert any(
            told in f"{short.where}: {short.what}" and "probe.c:" in f"{short.where}{short.what}"
            for short in shortfalls
        )


def test_without_the_tools_nothing_is_shown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "clang-tidy-19" in analysers.collect(subject_of(EVERYTHING)).missing
