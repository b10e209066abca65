"""Requirements that lines and declarations name: told where they change, without any change of meaning."""

import re

from rcsc.base.diagnostics.render import plain
from rcsc.code.emit import emitted
from rcsc.code.emit.lower import lower_by_force
from rcsc.lang.meaning import digest
from rcsc.proof.solvers.options import Options
from rcsc.views.diff.changes.difference import Difference, ProgramDifference
from rcsc.views.diff.compare import compare
from rcsc.views.diff.jsonform import to_json
from rcsc.views.diff.rows import markdown, rows
from tests.support.programs.stages import program_of

TEXT = """input ready : bool
output go : bool
assume a monitored : ready or not ready
invariant i : go in {true, false}
property p req "SR-9" : go then go or not go
procedure q(a : bool) { go := a }
table start assuming a {
  | line | ready   || procedures | req            |
  | yes  | true    || q(true)    | "SR-1", "SR-2" |
  | no   | DEFAULT || q(false)   |                |
}
"""
EDITS = (
    ('"SR-1", "SR-2" |', '"SR-2", "SR-3" |'),
    ("q(false)   |                |", 'q(false)   | "*/ #error" |'.replace("#", "")),
    ("assuming a {", 'assuming a req "T" {'),
    ("monitored :", 'monitored req "A" :'),
    ("invariant i :", 'invariant i req "I" :'),
    (' req "SR-9"', ""),
    ("q(a : bool) {", 'q(a : bool) req "Q" {'),
)


def edited(*edits: tuple[str, str]) -> str:
    text = TEXT
    for before, after in edits:
        assert before in text
        text = text.replace(before, after)
    return text


def difference() -> ProgramDifference:
    return compare("case", program_of(TEXT), program_of(edited(*EDITS)), Options())


def test_every_place_that_names_others_is_told_and_no_meaning_changes() -> None:
    found = difference()
    assert not found.changed
    assert set(found.requirements) == {
        "table `start`: new T",
        "table `start`, line yes: new SR-3; gone SR-1",
        "table `start`, line no: new */ error",
        "procedure `q`: new Q",
        "assumption `a`: new A",
        "invariant `i`: new I",
        "property `p`: gone SR-9",
    }
    assert digest(program_of(TEXT)) == digest(program_of(edited(*EDITS)))


def test_each_form_of_output_tells_them() -> None:
    whole = Difference("a", "b", (difference(),))
    assert "requirements of table `start`, line yes: new SR-3; gone SR-1" in plain(rows(whole))
    assert "requirements of table `start`, line yes: new SR-3; gone SR-1" in markdown(whole).replace("\\", "")
    assert len(to_json(whole)["programs"][0]["requirements"]) == len(EDITS)
    assert not to_json(whole)["changed"]


def test_generated_code_names_them_and_nothing_in_a_name_ends_a_comment() -> None:
    files = emitted(lower_by_force(program_of(edited(*EDITS))))
    [c] = [text for path, text in files.items() if path.endswith(".c")]
    [python] = [text for path, text in files.items() if path.startswith("python/") and "def " in text]
    for text in (c, python):
        assert "line yes [SR-2, SR-3]" in text
        assert "line no [* / error]" in text
        assert "procedure q [Q]" in text
        assert re.search(r"runs the line\b.*\. \[T\]", text)
    plain_c = [
        text for path, text in emitted(lower_by_force(program_of(TEXT))).items() if path.endswith(".c")
    ]
    assert _code(c) == _code(plain_c[0])


def _code(text: str) -> str:
    """The text of C without its comments and blanks."""
    return (
        "".join(piece.partition("*/")[2] for piece in ("*/" + text).split("/*"))
        .replace("\n", "")
        .replace(" ", "")
    )
