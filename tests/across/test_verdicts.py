"""One word of a whole system: what `rcsc prove` sums up counts its requirements across levels, too."""

import json
from pathlib import Path

import pytest

import rcsc
from rcsc.front.commands import run
from tests.across.test_across import _written

AT_ONCE = "requirement at_once : whenever boss.go_left, at once left.runs\n"
BOTH = "requirement never_both : always not (left.runs and right.runs)\n"
VACUOUS = "requirement both : when boss.go_left and boss.go_right, within 1 cycles, left.runs\n"


@pytest.mark.parametrize(
    ("requirements", "said", "status"),
    [
        (BOTH, "proved in part: 1 requirement across levels, 6 claims; but 4 claims not looked at", 0),
        (BOTH + AT_ONCE, "not proved: 1 of 2 requirements across levels; also 4 claims not looked at", 1),
        (
            BOTH + VACUOUS,
            "6 claims; but 1 requirement across levels that never asks, 4 claims not looked at",
            0,
        ),
    ],
)
def test_the_verdict_of_a_system_counts_its_requirements(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], requirements: str, said: str, status: int
) -> None:
    path = str(_written(tmp_path, requirements))
    assert (run(["prove", path]), run(["prove", path, "--strict"])) == (status, 1)
    assert said in capsys.readouterr().out
    assert run(["prove", path, "--json"]) == status
    told = json.loads(capsys.readouterr().out)
    assert (told["proved"], told["whole"]) == (not status, False)
    assert (told["counts"]["across"], told["counts"]["across_open"]) == (
        requirements.count("requirement"),
        status,
    )


def test_python_is_told_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _written(tmp_path, BOTH + AT_ONCE)
    assert run(["prove", str(path), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    proof = rcsc.prove(path)
    assert (proof.proved, proof.whole) == (False, False)
    assert [(one.name, one.says, one.verdict, one.vacuous) for one in proof.requirements] == [
        (one["name"], one["says"], one["verdict"], one["vacuous"]) for one in told["requirements"]
    ]
    never_both, at_once = proof.requirements
    assert (never_both.proved, never_both.words) == (True, "proved as scheduled, of `boss`, `left`, `right`")
    assert (
        [row.level for row in at_once.run]
        == [row["level"] for row in told["requirements"][1]["time_line"]]
        != []
    )
    assert rcsc.prove(path, levels=["left"]).requirements == ()
