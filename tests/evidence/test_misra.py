"""The compliance table of MISRA C:2012: every guideline has its row, and a reason holds at its place alone."""

import csv
import io
import re
from pathlib import Path

import pytest

from rcsc.views.evidence.kind import Missed
from rcsc.views.evidence.misra.compliance import (
    KIND,
    Compliance,
    Summary,
    explained,
    main,
    own_findings,
    summary,
)
from rcsc.views.evidence.misra.cppcheck import BASIC_TYPE, ENUMERATOR, HELD, Checked, Finding, check
from rcsc.views.evidence.misra.guidelines import RULES, Category, guidelines
from tests.evidence.subjects import EVERYTHING, subject_of

REPO = Path(__file__).parents[2]
PLANTED = """
int32_t planted(int32_t a)
{
    int32_t b;
    if (a = 1) {
        goto end;
    }
end:
    return b;
}
"""


@pytest.fixture(scope="module")
def files() -> dict[str, str]:
    """The emitted files of the program."""
    return dict(subject_of(EVERYTHING).files)


def test_every_guideline_has_a_row_and_each_deviation_its_place() -> None:
    evidence = KIND.collect(subject_of(EVERYTHING))
    assert not evidence.missing
    assert evidence.shortfalls == ()
    rows = list(csv.DictReader(io.StringIO(evidence.files["compliance.csv"])))
    assert [row["guideline"] for row in rows] == [one.number for one in guidelines()]
    kept = {row["guideline"]: row["compliance"] for row in rows}
    assert kept["1.2"] == kept["8.7"] == kept["Dir 4.6"] == "deviation"
    assert kept["17.3"] == kept["5.1"] == kept["14.4"] == kept["Dir 4.10"] == "compliant"
    assert kept["Dir 4.1"] == kept["Dir 1.1"] == "not checked"
    assert kept["22.1"] == "not applicable"
    assert kept["2.1"] == "not checked"
    assert kept["12.5"] == "compliant"
    assert all(row["reasons"] for row in rows if row["compliance"] == "deviation")
    assert all(row["checked by"] for row in rows)
    assert not any(row["compliance"] == "deviation" for row in rows if row["category"] == "mandatory")
    places = list(csv.DictReader(io.StringIO(evidence.files["places.csv"])))
    assert sum(int(row["places"] or 0) for row in rows) == len(places)
    assert "misra-c2012-17.3:probe.c:" in evidence.files["suppressions.txt"]
    assert "\nmisra-c2012-17.3\n" not in evidence.files["suppressions.txt"]


def test_what_coverage_shows_out_of_reach_is_a_deviation_and_what_it_does_not_explain_a_violation(
    files: dict[str, str],
) -> None:
    """Neither 2.1 nor 14.3 is called compliant while the coverage of the same C says what nothing reaches."""
    missed = [
        Missed("probe_run_t", 3, "statement", "proved"),
        Missed("probe_run_t", 3, "`case (-1)` true", "proved"),
        Missed("probe_do_keep", 4, "`s->go` true", "shown"),
        Missed("probe_do_keep", 4, "condition 1 of 2 decides on its own", "shown"),
    ]
    by_number = {one.number: one for one in guidelines()}
    alone, whole, all_of_it = summary(files), summary(files, missed), summary(files, ())
    told = [each.of(by_number["2.1"])[0] for each in (alone, whole, all_of_it)]
    assert told == [Compliance.NOT_CHECKED, Compliance.DEVIATION, Compliance.COMPLIANT]
    assert "which was not made" in alone.of(by_number["14.3"])[1]
    assert alone.of(by_number["14.3"])[0] is not Compliance.COMPLIANT
    own = [
        (place.guideline, place.finding.file, place.finding.line)
        for place in whole.places[len(alone.places) :]
    ]
    assert own == [("2.1", "probe.c", 3), ("2.1", "probe.c", 3), ("14.3", "probe.c", 4)]
    assert whole.unexplained == ()
    [open_] = summary(files, [Missed("probe_run_t", 3, "statement", "")]).unexplained
    assert open_.guideline == "2.1"


def test_extensions_and_sizes_are_searched_for_in_the_text() -> None:
    text = (
        "#pragma GCC optimize(1)\n#pragma STDC FP_CONTRACT OFF\nx = y + 0.0;\nsizeof(a_t) + sizeof(array);\n"
    )
    found = [(one.line, one.rule) for one in own_findings({"c/a.c": text})]
    assert found == [(1, "1.2"), (3, "2.2"), (4, "12.5")]


def test_a_table_of_more_than_32_lines_complies() -> None:
    rows = "".join(f"  | l{at} | {at} || {at} |\n" for at in range(41))
    text = f"input n : int 0 .. 40\noutput o : int 0 .. 40\ntable t {{\n  | line | n || o |\n{rows}}}\n"
    subject = subject_of(text)
    assert "uint64_t m" in subject.files["c/probe.c"]
    assert KIND.collect(subject).shortfalls == ()


def test_what_is_planted_is_a_violation_although_its_rule_may_deviate_elsewhere(
    files: dict[str, str],
) -> None:
    made = summary({**files, "c/probe.c": files["c/probe.c"] + PLANTED})
    first = files["c/probe.c"].count("\n")
    found = {place.guideline for place in made.unexplained}
    assert all(place.finding.line > first for place in made.unexplained)
    assert {"13.4", "14.4", "15.1", "8.4"} <= found
    assert all(place.what and "rule-texts" not in place.what for place in made.places)
    assert made.checked.rules.keys() == RULES.keys()
    by_number = {one.number: one for one in guidelines()}
    assert made.of(by_number["13.4"])[0] is Compliance.VIOLATION


def test_a_reason_holds_where_the_line_says_what_it_needs(files: dict[str, str]) -> None:
    lines = files["c/probe.c"].splitlines()
    builtin = next(at for at, line in enumerate(lines, 1) if "__builtin_ctz" in line)
    step = next(at for at, line in enumerate(lines, 1) if line.startswith("int32_t probe_t_step("))
    assert explained(Finding("probe.c", builtin, "misra-c2012-17.3", ""), files) is not None
    assert explained(Finding("probe.c", builtin + 1, "misra-c2012-17.3", ""), files) is None
    assert explained(Finding("probe.c", step, "misra-c2012-8.7", ""), files) is not None
    hidden = {
        **files,
        "c/probe.c": files["c/probe.c"].replace("int32_t probe_t_step(", "int32_t probe_t_stop("),
    }
    assert explained(Finding("probe.c", step, "misra-c2012-8.7", ""), hidden) is None
    assert explained(Finding("probe.c", 10_000, "misra-c2012-8.7", ""), files) is None


def test_a_name_that_looks_like_a_number_is_told_from_one() -> None:
    text = {"c/a.c": "s->decel = false;\nx = 1ul;\ns->decel = 0xfull;\n"}
    found = [explained(Finding("a.c", at, "misra-c2012-7.3", ""), text) is None for at in (1, 2, 3)]
    assert found == [False, True, True]


def test_no_reason_is_good_enough_for_a_mandatory_guideline(files: dict[str, str]) -> None:
    builtin = 1 + next(
        at for at, line in enumerate(files["c/probe.c"].splitlines()) if "__builtin_ctz" in line
    )
    place = Finding("probe.c", builtin, "misra-c2012-17.3", "")
    known = explained(place, files)
    assert known is not None
    assert known.guideline == "1.2"
    mandatory = [one.number for one in guidelines() if one.category is Category.MANDATORY]
    assert "17.3" in mandatory
    assert known.guideline not in mandatory


def test_basic_types_and_compared_enumerators_are_searched_for_in_code_alone() -> None:
    text = "enum {\n    A_ONE = 1\n};\n/* int == A_ONE */\nint x;\nbool f(void) { return y == A_ONE; }\nuint8_t z = B_TWO;\n"
    found = [(one.line, one.check) for one in own_findings({"c/a.c": text})]
    assert found == [(5, BASIC_TYPE), (6, ENUMERATOR)]


def test_functions_that_change_no_proved_value_are_deviations_and_calls_of_them_are_not() -> None:
    text = "static inline int32_t a_within_i32(int32_t a, int32_t least, int32_t most)\n{\n    x = a_within_i32(y, 0, 3);\n"
    [found] = own_findings({"c/a.c": text})
    known = explained(found, {"c/a.c": text})
    assert known is not None
    assert (found.line, found.check, known.guideline) == (1, HELD, "2.2")


EXAMPLES = {
    "cortex_m": ("main.c", "startup.c"),
    "freertos": ("main.c", "shim/FreeRTOS.h", "shim/queue.h", "shim/task.h"),
}
BASIC = re.compile(r"int main\((?:void)?\)|\bconst char \*text\)|^    double force_n;$|\bprintf\(")
"""What the language and the libraries have named so, and the tables' reals."""
SUPPRESSED = re.compile(r"/\* cppcheck-suppress(?:-begin|-end)? (\S+).*?\*/")


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_integration_examples_say_at_each_place_where_they_deviate(example: str) -> None:
    """All of a PC's stand-in for FreeRTOS is left out but what the example includes: on a target its own sources stand there."""
    folder = REPO / "tables/examples/integration" / example
    own = {Path(name).name: (folder / name).read_text("utf-8") for name in EXAMPLES[example]}
    headers = {path.name: path.read_text("utf-8") for path in (REPO / "generated/c").glob("*.h")}
    sources = [name for name in own if name.endswith(".c")]
    checked = check({**headers, **own}, "--inline-suppr")
    assert not checked.failure
    assert [one for one in checked.findings if one.file in sources] == []
    basic = [
        (one.file, one.line) for one in own_findings(own) if one.check == BASIC_TYPE and one.file in sources
    ]
    lines = [(file, own[file].splitlines()[line - 1]) for file, line in basic]
    assert [each for each in lines if not BASIC.search(each[1])] == []
    bare = check({**headers, **own})
    for name in sources:
        said = set(SUPPRESSED.findall(own[name]))
        assert said == {one.check for one in bare.findings if one.file == name}


def test_a_failure_of_the_checker_is_no_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = Summary(Checked("cppcheck", {}, (), "it crashed"), (), plain=True)
    monkeypatch.setattr("rcsc.views.evidence.misra.compliance.summary", lambda _: broken)
    assert main(str(REPO / "generated" / "c")) == 1
    assert check({}).rules["17.3"]
