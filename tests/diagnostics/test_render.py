"""Diagnostics shown: text, one line, JSON, SARIF, GitHub; hostile text stays text."""

import json
import re
import unicodedata
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, MatchedLine, Severity, WitnessColumn
from rcsc.base.diagnostics.jsonform import report_to_json
from rcsc.base.diagnostics.printable import clip, escape, width
from rcsc.base.diagnostics.render import full, one_line, paint, plain
from rcsc.base.diagnostics.report import InSystem, Report, SystemReport, TableReport, Verdict
from rcsc.base.diagnostics.services import annotation, fingerprint, sarif, uri
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files.plain import plain as as_plain
from rcsc.base.host.files.plain import read

HERE = Path(__file__).parents[1]
TEXT = """\
input cmd : int 0 .. 3
input hand : status
table grip {
  | line | cmd | hand || go    |
  | 1    | 1   |      || true  |
  | 2    |     | done || false |
}
"""
FILE = "grip.rcs"
SOURCES = {FILE: Source(FILE, TEXT)}


def span(text: str, file: str = FILE) -> Span:
    start = TEXT.index(text)
    return Span(file, start, start + len(text))


def overlap() -> Diagnostic:
    first = MatchedLine("1", ("1", ""), span("1    | 1"))
    second = MatchedLine("2", ("", "done"), span("2    |  "))
    witness = WitnessColumn(
        "grip", ("cmd", "hand"), ("1", "done"), (first, second), ("cmd = 1", "hand = done")
    )
    return Diagnostic(
        Code.OVERLAP,
        "lines `1` and `2` of `grip` match the same input",
        Label(span("1    | 1"), "this line"),
        (Label(span("2    |  "), "and this one"),),
        ("it is so in 1 of 12 inputs",),
        ("write `/= done` in line `1` under `hand`",),
        (witness,),
        2,
    )


def test_the_full_form_shows_the_witness_beside_the_lines_that_match() -> None:
    assert (
        plain(full(overlap(), SOURCES))
        == """\
error[RCS402]: lines `1` and `2` of `grip` match the same input
 --> grip.rcs:5:5
  |
5 |   | 1    | 1   |      || true  |
  |     ^^^^^^^^ this line
6 |   | 2    |     | done || false |
  |     -------- and this one
  |
  | | input | witness | line 1 | line 2 |
  | |-------|---------|--------|--------|
  | | cmd   | 1       | 1      |        |
  | | hand  | done    |        | done   |
  |
  = region: cmd = 1, hand = done
  = more: and 2 more inputs
  = note: it is so in 1 of 12 inputs
  = help: write `/= done` in line `1` under `hand`
"""
    )


def test_a_gap_shows_the_witness_alone_and_what_is_free() -> None:
    witness = WitnessColumn("grip", ("cmd", "hand"), ("0", "failed"), (), ("hand = failed",))
    gap = Diagnostic(Code.GAP, "no line matches", Label(span("grip")), witnesses=(witness,))
    shown = plain(full(gap, SOURCES))
    assert "| | hand  | failed  |\n" in shown
    assert "= region: hand = failed, any other\n" in shown


def test_places_in_other_files_and_gaps_between_lines_are_marked() -> None:
    other = Source("types.rcs", "enum status { done }\n")
    far = Label(Span("types.rcs", 5, 11), "declared here")
    found = Diagnostic(Code.KIND, "no", Label(span("cmd")), (Label(span("grip"), "in this"), far))
    shown = plain(full(found, {**SOURCES, "types.rcs": other}))
    assert "...\n3 | table grip {\n  |       ---- in this\n" in shown
    assert " ::: types.rcs:1:6\n" in shown
    assert "1 | enum status { done }\n  |      ------ declared here\n" in shown


def test_one_line_form() -> None:
    expected = "grip.rcs:5:5: error[RCS402]: lines `1` and `2` of `grip` match the same input"
    assert one_line(overlap(), SOURCES) == expected


def test_colour_adds_nothing_but_colour() -> None:
    rows = full(overlap(), SOURCES)
    painted = paint(rows)
    assert "\x1b[" in painted
    assert re.sub(r"\x1b\[[0-9;]*m", "", painted) == plain(rows)


@pytest.mark.parametrize("hostile", ["\x1b[2J", "\u202e", "\u2066", "\r", "\x00", "\u200b", "\x9b31m"])
def test_nothing_that_does_not_print_reaches_the_terminal(hostile: str) -> None:
    text = f"input a{hostile}b : bool # {hostile}\n"
    witness = WitnessColumn(
        f"t{hostile}", (f"v{hostile}",), (hostile,), (MatchedLine(hostile, (hostile,)),), (hostile,)
    )
    found = Diagnostic(
        Code.SYNTAX,
        f"m{hostile}",
        Label(Span(f"f{hostile}", 6, 9), hostile),
        (),
        (hostile,),
        (hostile,),
        (witness,),
    )
    sources = {f"f{hostile}": Source(f"f{hostile}", text)}
    for shown in (plain(full(found, sources)), one_line(found, sources)):
        assert all(char.isprintable() or char == "\n" for char in shown)
        assert f"\\u{{{ord(hostile[0]):x}}}" in shown


def test_marks_stand_under_wide_and_combining_characters() -> None:
    text = "# 状態e\u0301\tx here"
    at = text.index("here")
    shown = plain(full(Diagnostic(Code.SYNTAX, "m", Label(Span("f", at, at + 4))), {"f": Source("f", text)}))
    line, marks = shown.splitlines()[3:5]
    assert width(line[: line.index("here")]) == marks.index("^")


def test_a_long_line_is_clipped_around_its_label() -> None:
    text = "x" * 5_000 + "BAD" + "y" * 5_000
    shown = plain(
        full(Diagnostic(Code.SYNTAX, "m", Label(Span("f", 5_000, 5_003))), {"f": Source("f", text)}, 80)
    )
    line, marks = shown.splitlines()[3:5]
    assert line.index("BAD") == marks.index("^^^")
    assert len(line) <= 84


@given(st.text(max_size=60), st.integers(0, 70), st.integers(0, 70))
def test_escape_and_clip_keep_within_bounds(text: str, start: int, cells: int) -> None:
    safe = escape(text)
    assert safe.isprintable()
    assert width(clip(safe, start, cells)) <= cells + sum(unicodedata.combining(c) > 0 for c in safe)


@given(st.text(max_size=80), st.integers(0, 90), st.integers(0, 90), st.text(max_size=10))
def test_any_span_of_any_text_renders(text: str, start: int, length: int, message: str) -> None:
    label = Label(Span("f", min(start, len(text)), min(start, len(text)) + length), message)
    found = Diagnostic(Code.SYNTAX, message, label, (label,), (message,), (message,))
    sources = {"f": Source("f", text)}
    shown = plain(full(found, sources))
    assert all(char.isprintable() or char == "\n" for char in shown)
    assert annotation(found, sources).count("\n") == 0


SENTENCES = st.lists(st.text("ab`é状", min_size=1, max_size=9), min_size=1, max_size=40).map(" ".join)


@given(SENTENCES, SENTENCES, st.sampled_from([40, 80, 120]))
def test_sentences_are_broken_between_words_and_lose_none(message: str, help_: str, columns: int) -> None:
    found = Diagnostic(Code.SYNTAX, message, Label(Span("f", 0, 1)), help=(help_,))
    rows = full(found, {"f": Source("f", "x" * 200)}, columns, broken=True)
    lines = plain(rows).splitlines()
    assert all(width(line) <= columns for line in lines)
    at = next(at for at, line in enumerate(lines) if line.startswith(" --> "))
    told = (lines[:at], lines[next(at for at, line in enumerate(lines) if line.startswith("  = help")) :])
    for said, shown in zip((message, help_), told, strict=True):
        assert " ".join(shown).split()[-len(said.split()) :] == said.split()
    assert (
        plain(full(found, {}, columns)).count("\n") == 3
    )  # as long as they are, where nothing asks for a width


def test_a_word_that_is_too_long_stands_alone() -> None:
    long = "a" * 60
    found = Diagnostic(Code.SYNTAX, f"one {long} two", Label(Span("f", 0, 1)))
    assert plain(full(found, {}, 40, broken=True)).splitlines()[:3] == [
        "error[RCS101]: one",
        f"{' ' * 15}{long}",
        f"{' ' * 15}two",
    ]


# --- JSON ----------------------------------------------------------------------------

REPORT = Report(
    (overlap(), replace(overlap(), severity=Severity.NOTE, witnesses=(), more=0)),
    (
        TableReport(
            "grip",
            FILE,
            Verdict.REFUTED,
            2,
            "boxes",
            True,
            (("f", "proved"), ("g", "monitored")),
            1.5,
            False,
            InSystem("system.toml", ("f",), ("g",), ("4", "9")),
        ),
    ),
    SOURCES,
    (SystemReport("system.toml", "not proved"),),
)


def schema(name: str) -> Any:
    return json.loads((HERE / name).read_text(encoding="utf-8"))


def test_json_is_of_the_published_form() -> None:
    published = schema("../rcsc/base/diagnostics/schema/report.schema.json")
    jsonschema.Draft202012Validator.check_schema(published)
    form = json.loads(json.dumps(report_to_json(REPORT, "check")))
    jsonschema.validate(form, published, jsonschema.Draft202012Validator)
    assert form["ok"] is False
    assert form["diagnostics"][0]["primary"]["place"]["start"] == {
        "offset": TEXT.index("1    | 1"),
        "line": 5,
        "column": 5,
    }
    del form["tables"][0]["method"]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(form, published, jsonschema.Draft202012Validator)


def test_a_diagnostic_comes_back_as_it_was_kept() -> None:
    assert read(Diagnostic, json.loads(json.dumps(as_plain(overlap())))) == overlap()


# --- SARIF ---------------------------------------------------------------------------


def test_sarif_is_valid_against_the_standards_schema() -> None:
    official = schema("data/sarif-schema-2.1.0.json")
    nowhere = Diagnostic(Code.NO_TABLES, "nothing here", Label(Span("", 0, 0)))
    form = json.loads(json.dumps(sarif(replace(REPORT, diagnostics=(*REPORT.diagnostics, nowhere)))))
    validator = jsonschema.validators.validator_for(official)(official)
    assert [error.message for error in validator.iter_errors(form)] == []
    [run] = form["runs"]
    assert [run["tool"]["driver"]["rules"][one["ruleIndex"]]["id"] for one in run["results"]] == [
        one["ruleId"] for one in run["results"]
    ]
    assert run["results"][0]["locations"][0]["physicalLocation"]["region"]["startLine"] == 5
    form["runs"][0]["results"][0]["level"] = "fatal"
    assert list(validator.iter_errors(form))


def test_a_fingerprint_stays_when_lines_are_added_above() -> None:
    moved = replace(overlap(), primary=Label(Span(FILE, 200, 208), "this line"))
    assert fingerprint(moved) == fingerprint(overlap())
    assert fingerprint(replace(overlap(), message="lines `1` and `3`")) != fingerprint(overlap())


def test_uris_are_references() -> None:
    assert uri("a b/ü#.rcs") == "a%20b/%C3%BC%23.rcs"
    assert uri("/x/a b.rcs") == "file:///x/a%20b.rcs"


# --- GitHub --------------------------------------------------------------------------


def test_an_annotation_is_one_escaped_command() -> None:
    found = replace(overlap(), message="100% of\nit", help=("a::b,c",))
    source = {FILE: SOURCES[FILE]}
    shown = annotation(found, source)
    assert shown.startswith(
        "::error file=grip.rcs,line=5,endLine=5,col=5,endColumn=13,title=RCS402::100%25 of\\u{a}it%0A"
    )
    assert "%0Ahelp: a::b,c" in shown
    odd = replace(found, primary=Label(Span("a,b:c.rcs", 0, 0)))
    assert "file=a%2Cb%3Ac.rcs," in annotation(odd, source)
    note = replace(overlap(), severity=Severity.NOTE)
    assert annotation(note, source).startswith("::notice ")


def test_a_note_shows_its_regions_alone() -> None:
    shown = plain(full(replace(overlap(), severity=Severity.NOTE), SOURCES))
    assert "witness" not in shown
    assert "= region: cmd = 1, hand = done\n" in shown
