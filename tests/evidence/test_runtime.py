"""What Frama-C's EVA shows of the generated C, and that it tells of a guard that is lost."""

import re
from pathlib import Path

import pytest

from rcsc.code.emit.c.helpers import HELD
from rcsc.views.evidence import runtime
from rcsc.views.evidence.kind import Evidence
from rcsc.views.evidence.runtime import line_of
from tests.evidence.subjects import EVERYTHING, subject_of
from tests.support.programs.examples import RELATED, WIDE

pytestmark = pytest.mark.needs("frama-c")


def classes(evidence: Evidence, verdict: str) -> set[str]:
    """The classes that have a place with this verdict."""
    rows = [line.split("|") for line in evidence.files["certificate.md"].split("\n") if line.startswith("| ")]
    column = runtime.VERDICTS.index(verdict) + 2
    return {row[1].split("`")[1] for row in rows if "`" in row[1] and int(row[column])}


def test_every_access_index_and_boolean_is_shown() -> None:
    evidence = runtime.collect(subject_of(EVERYTHING))
    assert not evidence.shortfalls
    assert {"mem_access", "index_bound", "is_nan_or_infinite"} <= classes(evidence, "shown")
    assert [figure.partition(": ")[0].partition(", ")[2] for figure in evidence.figures] == [
        "any bytes", "finite reals", "defensive, any bytes", "defensive, finite reals",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "helpers"),
    [
        (RELATED, "atleast_u32 atmost_u32 within_i32 quotient_i32 atleast_f64 atleast_i64 atmost_u64"),
        (WIDE, "atleast_f64 within_i64 within_f64 within_f32"),
    ],
)
def test_what_a_line_or_two_variables_show_is_said_in_the_c_and_seen(text: str, helpers: str) -> None:
    subject = subject_of(text)
    c = subject.files["c/probe.c"]
    assert [helper for helper in helpers.split() if f" probe_{helper}(" not in c] == []
    evidence = runtime.collect(subject)
    assert evidence.shortfalls == ()
    assert {"division_by_zero", "unsigned_downcast"} <= classes(evidence, "shown")
    assert "is_nan_or_infinite" in classes(evidence, "shown for finite reals")  # the whole part of a real


def test_what_stands_around_an_operation_needs_no_word() -> None:
    text = RELATED.replace("relate(left - kept) | true ", "loop | true ")
    before, _, after = text.partition("procedure relate")
    c = subject_of(before + after[after.index("procedure loop") :]).files["c/probe.c"]
    assert not [helper for helper in HELD if f"probe_{helper}_" in c]


def test_every_word_that_is_lost_is_told() -> None:
    c = subject_of(RELATED).files["c/probe.c"]
    held = re.findall(rf"(probe_(?:{'|'.join(HELD)})_\w+\(.*\)\n{{\n    return) (.*);", c)
    evidence = runtime.collect(
        subject_of(RELATED, *((f"{head} {value};", f"{head} a;") for head, value in held))
    )
    told = {shortfall.what.split(": ")[1] for shortfall in evidence.shortfalls}
    assert told >= {
        "indices",
        "divisions and remainders",
        "conversions to an unsigned type",
        "conversions to a signed type",
    }


@pytest.mark.parametrize(
    ("text", "edits", "told"),
    [
        (EVERYTHING, [("s->at > 3u", "s->at > 4u"), ("s->smooth <= 500.0", "s->smooth <= 1e308")],
         ["indices", "reals that are numbers"]),
        (EVERYTHING, [("s->wanted > PROBE_MODE_STOP", "s->wanted > 3u")], ["indices"]),
        (RELATED, [("(*(const uint8_t *)&s->flags[2]) > 1u", "false")], ["booleans"]),
    ],
)  # fmt: skip
def test_a_lost_guard_is_told_with_its_place(
    text: str, edits: list[tuple[str, str]], told: list[str]
) -> None:
    found = runtime.collect(subject_of(text, *edits)).shortfalls
    for word in told:
        assert any(word in short.what and short.where.startswith("probe.c:") for short in found)


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
