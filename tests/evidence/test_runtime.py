"""What Frama-C's EVA shows of the generated C, and that it tells of a guard that is lost."""

from pathlib import Path

import pytest

from rcsc.evidence import runtime
from rcsc.evidence.kind import Evidence
from rcsc.evidence.runtime import line_of
from tests.evidence.subjects import EVERYTHING, subject_of

pytestmark = pytest.mark.needs("frama-c")


def classes(evidence: Evidence, verdict: str) -> set[str]:
    """The classes that have a place with this verdict."""
    rows = [line.split("|") for line in evidence.files["certificate.md"].split("\n") if line.startswith("| ")]
    column = runtime.VERDICTS.index(verdict) + 2
    return {row[1].split("`")[1] for row in rows if "`" in row[1] and int(row[column])}


def test_every_access_index_and_boolean_is_shown() -> None:
    evidence = runtime.collect(subject_of(EVERYTHING))
    assert not evidence.shortfalls
    assert {"mem_access", "index_bound", "bool_value", "is_nan_or_infinite"} <= classes(evidence, "shown")
    assert [figure.partition(": ")[0].partition(", ")[2] for figure in evidence.figures] == [
        "any bytes", "finite reals", "defensive, any bytes", "defensive, finite reals",
    ]  # fmt: skip


def test_a_division_that_a_line_guards_rests_on_the_proof_and_is_named() -> None:
    evidence = runtime.collect(subject_of(EVERYTHING))
    assert classes(evidence, "by the table's proof") == {"division_by_zero"}
    assert "probe_do_part): `(uint32_t)s_0->width ≢ 0`" in evidence.files["certificate.md"]


@pytest.mark.parametrize(
    ("kept", "lost", "told"),
    [
        ("s->at > 3u", "s->at > 4u", "indices"),
        ("s->wanted > PROBE_MODE_STOP", "s->wanted > 3u", "indices"),
        ("s->smooth <= 500.0", "s->smooth <= 1e308", "reals that are numbers"),
    ],
)  # fmt: skip
def test_a_lost_guard_is_told_with_its_place(kept: str, lost: str, told: str) -> None:
    evidence = runtime.collect(subject_of(EVERYTHING, (kept, lost)))
    assert any(told in short.what and short.where.startswith("probe.c:") for short in evidence.shortfalls)


def test_the_table_line_of_a_place_is_read_from_the_comment_above() -> None:
    text = (
        "{\n    /* a/t.rcs line 2a: x > 1 */\n    case 1:\n        f(s);\n}\n\nvoid g(void)\n{\n    h();\n}"
    )
    assert line_of(text, 4) == ", a/t.rcs line 2a"
    assert not line_of(text, 9)


def test_without_frama_c_nothing_is_shown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    runtime.version.cache_clear()
    evidence = runtime.collect(subject_of(EVERYTHING))
    runtime.version.cache_clear()
    assert "frama-c-base" in evidence.missing
    assert not evidence.files
