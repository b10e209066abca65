"""What Frama-C's EVA shows of the generated C, and that it tells of a guard that is lost."""

import re
from pathlib import Path

import pytest

from rcsc.emit.c.helpers import HELD
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


RELATIONS = """
const most = 9223372036854775807
input left : int 0 .. 2000
input kept : int 1 .. 20
input part : int 0 .. 500
input turn : int -3 .. 3
input load : real 0.0 .. 500.0
input huge : int 0 .. most
input huger : int 0 .. 18446744073709551615
state share : int 0 .. 1000
state at : int 0 .. 3
state slack : real 0.0 .. 20.0
state whole : int 0 .. 500
state ring : array[4] of int -40 .. 40
state sum : int 0 .. 90
state long : int 0 .. most
output go : bool safe false
output seen : bool safe false

procedure relate(room : int 1 .. 2000) {
  local more : int 0 .. 500 := left - kept
  share := 900 * more / part + room / room
  ring[at + 1] := 40 / turn
  slack := load - 480.0
  whole := int(slack)
  long := huge - 5
  seen := huger - 1 > 5
}

procedure loop {
  sum := 0
  for k in 0 .. 3 {
    local here : int -40 .. 40 := ring[k]
    if here > 0 and sum < 50 { sum := sum + here }
  }
  if not (at = 0 or ring[at - 1] = 7) { at := at - 1 }
  if at /= 3 { at := at + 1 } else { at := 0 }
}

table t {
  | line | left - kept | left - kept - part | at  | turn | load    | huge - 5 | huger   || procedures          | go    |
  | 1    | > 0         | <= 0              | < 3 | /= 0 | > 480.0 | >= 0     | <= most || relate(left - kept) | true  |
  | 2    | DEFAULT     |                   |     |      |         |          |         || loop                | false |
}

level l {
  period 10 [ms]
  table t
}
"""
"""Operations that are safe by what a line, or two variables together, say; and, in the other line, by what stands around them."""


def test_what_a_line_or_two_variables_show_is_said_in_the_c_and_seen() -> None:
    subject = subject_of(RELATIONS)
    c = subject.files["c/probe.c"]
    for helper in (
        "atleast_u32",
        "atmost_u32",
        "within_i32",
        "nonzero_i32",
        "atleast_f64",
        "atleast_i64",
        "atmost_u64",
    ):
        assert f" probe_{helper}(" in c, helper
    evidence = runtime.collect(subject)
    assert not evidence.shortfalls, evidence.shortfalls
    relational = {"division_by_zero", "index_bound", "unsigned_downcast", "signed_downcast"}
    assert relational <= classes(evidence, "shown")
    assert "unsigned_downcast" in classes(evidence, "shown for finite reals")  # the whole part of a real


def test_what_stands_around_an_operation_needs_no_word() -> None:
    text = RELATIONS.replace("relate(left - kept) | true ", "loop | true ")
    before, _, after = text.partition("procedure relate")
    c = subject_of(before + after[after.index("procedure loop") :]).files["c/probe.c"]
    assert not [helper for helper in HELD if f"probe_{helper}_" in c]


def test_every_word_that_is_lost_is_told() -> None:
    c = subject_of(RELATIONS).files["c/probe.c"]
    held = re.findall(rf"(probe_(?:{'|'.join(HELD)})_\w+\(.*\)\n{{\n    return) (.*);", c)
    evidence = runtime.collect(
        subject_of(RELATIONS, *((f"{head} {value};", f"{head} a;") for head, value in held))
    )
    told = {shortfall.what.split(": ")[1] for shortfall in evidence.shortfalls}
    assert told >= {
        "indices",
        "divisions and remainders",
        "conversions to an unsigned type",
        "conversions to a signed type",
    }


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
