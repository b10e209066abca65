"""What a verdict on a table claims: the worst of all programs that it is in, and what it rests on."""

import json
from itertools import permutations
from pathlib import Path

import pytest

from rcsc.diagnostics.jsonform import report_to_json
from rcsc.diagnostics.report import NOT_PROVED, Report, TableReport, Verdict, merged, resting
from rcsc.diagnostics.sarif import sarif
from rcsc.driver import check
from rcsc.driver.work import Settings
from rcsc.prove.options import Options

HERE = {
    "lib": "state a : int 0 .. 9\ninput g : bool\ntable t {\n  | line | a ||\n  | l | <= 4 ||\n  | h | 5 .. 8 ||\n}\n",
    "plain": "use lib\ntable ta {\n  | line | g ||\n  | l | true ||\n  | h | false ||\n}\n",
    "sure": "use lib\ninvariant small : a <= 8\ntable tb {\n  | line | g ||\n  | l | true ||\n  | h | false ||\n}\n",
}


def checked(folder: Path, *, cache: bool = False) -> Report:
    return check(Settings((str(folder),), Options(), use_cache=cache))


def verdicts(report: Report) -> dict[str, Verdict]:
    return {table.table: table.verdict for table in report.tables}


@pytest.mark.parametrize("names", list(permutations(["a", "b"])))
@pytest.mark.parametrize("cache", [False, True])
def test_the_worst_verdict_counts_in_every_order(tmp_path: Path, names: tuple[str, str], cache: bool) -> None:
    """One program proves the table under its invariant, the other refutes it."""
    (tmp_path / "rcsc.toml").touch()
    for name, part in zip(("lib", *names), ("lib", "plain", "sure"), strict=True):
        (tmp_path / f"{name}.rcs").write_text(HERE[part])
    for _ in range(1 + cache):
        report = checked(tmp_path, cache=cache)
        assert verdicts(report) == {"t": Verdict.REFUTED, "ta": Verdict.PROVED, "tb": Verdict.PROVED}
        shown = [report_to_json(report, "check")["tables"], sarif(report)["runs"][0]["properties"]["tables"]]
        for tables in shown:
            assert json.loads(json.dumps({one["table"]: one["verdict"] for one in tables}))["t"] == "refuted"


def test_merging_keeps_the_worst_and_all_that_is_rested_on() -> None:
    def one(verdict: Verdict, *assumptions: tuple[str, str]) -> TableReport:
        return TableReport("t", "f", verdict, 1, assumptions=assumptions)

    for several in permutations(one(verdict) for verdict in Verdict):
        assert [table.verdict for table in merged(several)] == [Verdict.REFUTED]
    both = merged(
        [one(Verdict.PROVED, ("a", "assumed")), one(Verdict.PROVED, ("a", "assumed"), ("b", "proved"))]
    )
    assert both == (one(Verdict.PROVED, ("a", "assumed"), ("b", "proved")),)
    assert resting(both[0], {"b"}).verdict is Verdict.CONDITIONAL
    assert resting(both[0], {"c"}).verdict is Verdict.PROVED
    assert resting(one(Verdict.REFUTED, ("b", "proved")), {"b"}).verdict is Verdict.REFUTED


INVARIANT = """
state n : int 0 .. 9 = 1
input a : int 0 .. 9
output o : int 0 .. 9
invariant small : n <= 8
{assumption}
table rests {head} {{
  | line | {subject} || o |
  | l | {low} || 1 |
  | h | {high} || 2 |
}}
table moves {{
  | line | a || n |
  | x | <= 4 || {value} |
  | y | > 4 || 2 |
}}
"""
PLAIN = {"assumption": "", "head": "", "subject": "n", "low": "<= 4", "high": "5 .. 8", "value": "3"}


@pytest.mark.parametrize(
    "rests",
    [
        {},
        {"subject": "when", "low": "a / (9 - n) > 2", "high": "not (a / (9 - n) > 2)"},
        {"assumption": "assume low proved : n < 9", "head": "assuming low", "subject": "n"},
    ],
    ids=["covered by it", "defined by it", "an assumption that follows from it"],
)
@pytest.mark.parametrize("cache", [False, True])
def test_what_rests_on_a_broken_invariant_is_not_proved(
    tmp_path: Path, rests: dict[str, str], cache: bool
) -> None:
    (tmp_path / "rcsc.toml").touch()
    file = tmp_path / "p.rcs"
    file.write_text(INVARIANT.format(**PLAIN | rests))
    report = checked(tmp_path, cache=cache)
    assert not report.failed
    assert verdicts(report) == {"rests": Verdict.PROVED, "moves": Verdict.PROVED}
    assert "proved" in dict(report.tables[0].assumptions).values()
    for value in ("9", "a * 3"):  # breaks it; can leave its range, so that nothing is known of it
        file.write_text(INVARIANT.format(**PLAIN | rests | {"value": value}))
        for _ in range(1 + cache):
            broken = checked(tmp_path, cache=cache)
            assert broken.failed
            assert verdicts(broken) == {"rests": Verdict.CONDITIONAL, "moves": Verdict.PROVED}
            assert NOT_PROVED in dict(broken.tables[0].assumptions).values()


def test_an_assumption_that_does_not_follow_is_not_proved(tmp_path: Path) -> None:
    wrong = {"assumption": "assume low proved : n < 8", "head": "assuming low", "high": "5 .. 7"}
    (tmp_path / "p.rcs").write_text(INVARIANT.format(**PLAIN | wrong))
    assert verdicts(checked(tmp_path))["rests"] is Verdict.CONDITIONAL
