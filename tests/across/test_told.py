"""Requirements across levels as they are told: summed up, traced to lines and back, listed as they stand, and as a page."""

import json
import re
from html import unescape
from pathlib import Path

import pytest

import rcsc as api
from rcsc.base.host.cache import Cache, open_cache
from rcsc.driver.requirements import KnownRequirement, known_requirements, read
from rcsc.front.commands import run
from rcsc.views.trace.across import parts_of
from tests.across.test_across import _BOSS, Rcsc, _written
from tests.across.test_across import rcsc as rcsc  # noqa: PLC0414  # the fixture

# --- summed up, and by Python ----------------------------------------------------------------------------

AT_ONCE = "requirement at_once : whenever boss.go_left, at once left.runs\n"
_NEVER_BOTH = "requirement never_both : always not (left.runs and right.runs)\n"
VACUOUS = "requirement both : when boss.go_left and boss.go_right, within 1 cycles, left.runs\n"


@pytest.mark.parametrize(
    ("requirements", "said", "status"),
    [
        (_NEVER_BOTH, "proved in part: 1 requirement across levels, 6 claims; but 4 claims not looked at", 0),
        (
            _NEVER_BOTH + AT_ONCE,
            "not proved: 1 of 2 requirements across levels; also 4 claims not looked at",
            1,
        ),
        (
            _NEVER_BOTH + VACUOUS,
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
    path = _written(tmp_path, _NEVER_BOTH + AT_ONCE)
    assert run(["prove", str(path), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    proof = api.prove(path)
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
    assert api.prove(path, levels=["left"]).requirements == ()


# --- traced, and listed ----------------------------------------------------------------------------------

_BOTH = 'requirement never_both req "SR-1" : always not (left.runs and right.runs)\n'
_SOON = 'requirement soon req "SR-2" : when boss.wish = l and not right.runs, within 2 cycles, left.runs\n'
_CALM = "assume calm assumed : never panel.wish = nobody\n"
_ONE = "property one : not (boss.go_left and boss.go_right)\n"


def _cache(path: Path) -> Cache:
    cache = open_cache(path.parent)
    assert cache is not None
    return cache


def _known(path: Path) -> dict[str, KnownRequirement]:
    cache = _cache(path)
    return {one.stated.name: one for one in known_requirements(read(path, cache), cache)}


def test_a_requirement_leads_to_the_lines_whose_writes_reach_it_through_buffers(tmp_path: Path) -> None:
    its = read(_written(tmp_path, _BOTH + _ONE + "property wish : boss.wish /= l or panel.wish = l\n"), None)
    assert its.across is not None
    both, one, wish = (parts_of(its, stated) for stated in its.across[0].stated)
    assert [part.words for part in both if part.direct] == [
        "left: move_left line on",
        "left: move_left line off",
        "right: move_right line on",
        "right: move_right line off",
    ]
    assert {part.words for part in both if not part.direct} == {
        f"boss: choose line {line}" for line in ("none", "l", "not_l", "r", "not_r")
    }
    assert both[0].how == "changes left.runs"
    assert both[-1].how == "what it writes to go_left, go_right reaches it"
    assert one[0].how == "changes boss.go_left, boss.go_right"
    assert {part.level for part in wish} == {"boss"}
    assert {part.how for part in wish} == {"tests boss.wish"}


def test_each_stands_as_it_was_answered_and_is_unknown_once_a_table_that_reaches_it_changes(
    tmp_path: Path, rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    path = _written(tmp_path, _BOTH + _SOON + _ONE)
    assert {one.state for one in _known(path).values()} == {"unknown"}
    assert rcsc("prove", path)[0] == 1
    known = _known(path)
    assert {name: one.state for name, one in known.items()} == {
        "never_both": "proved",
        "soon": "refuted",
        "one": "proved",
    }
    assert known["never_both"].words == "proved as scheduled, of `boss`, `left`, `right`"
    assert (known["never_both"].timing, known["one"].timing, known["soon"].tick) == ("scheduled", "any", 5)
    assert known["soon"].place.endswith("all.rcs:2")
    right = tmp_path / "right.rcs"
    right.write_text(right.read_text().replace("| off  | false || false |", "| off  | false || true |"))
    assert _known(path)["never_both"].state == "unknown"
    (tmp_path / "all.rcs").write_text(_BOTH + _CALM)
    assert {name: one.state for name, one in _known(path).items()} == {
        "never_both": "unknown",
        "calm": "assumed",
    }


def test_trace_answers_in_both_directions_and_finds_what_is_refuted(
    tmp_path: Path, rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    path = _written(tmp_path, _BOTH + _SOON)
    rcsc("prove", path)
    status, out, _ = rcsc("trace", path, "--no-vectors", "--find", "SR-1", "--find", "move_left on")
    assert status == 0
    assert "requirement never_both: always not (left.runs and right.runs)\n  for SR-1" in out
    assert "used by left: move_left line on, " in out
    assert "boss: choose line l, which reaches it" in out
    assert "proved as scheduled, of `boss`, `left`, `right`" in out
    assert "property never_both across levels: changes left.runs" in out
    status, out, _ = rcsc("trace", path, "--no-vectors", "--out", tmp_path / "trace")
    assert status == 1
    assert "requirement `SR-2` is refuted: requirement soon is refuted in tick 5, as scheduled" in out
    document = json.loads((tmp_path / "trace" / "trace.json").read_text())
    assert [one["place"] for one in document["requirements"]["SR-1"]] == ["requirement never_both"]
    lines = (tmp_path / "trace" / "lines.csv").read_text()
    assert "never_both across levels: changes left.runs" in lines
    assert "SR-1" in (tmp_path / "trace" / "trace.html").read_text()


# --- as a page -------------------------------------------------------------------------------------------

_OBEYS = 'requirement obeys req "SR-3" : when boss.go_left, within 1 cycles, left.runs or not boss.go_left\n'
_SOON_PLAIN = "requirement soon : when boss.wish = l and not right.runs, within 2 cycles, left.runs\n"
_BACK = "property never_both : not (left.runs and right.runs)\n"
_LEVEL = "requirement never_both_go : never (go_left and go_right)\nrequirement sometimes : when go_left, next not go_left\n"


def _page(rcsc: Rcsc, path: Path, name: str) -> tuple[int, str, str]:
    page = path.parent / "page.html"
    status, out, _ = rcsc("prove", path, "--show", name, "--report", page)
    html = page.read_text() if page.is_file() else ""
    return (
        status,
        out,
        " ".join(unescape(re.sub("<style>.*?</style>|<[^>]+>", " ", html, flags=re.DOTALL)).split()),
    )


def test_a_proved_requirement_has_its_timing_what_it_rests_on_lines_and_a_run_that_asks(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    calm = "assume calm assumed : never panel.wish = r\n"
    status, out, text = _page(rcsc, _written(tmp_path, _OBEYS + calm), "obeys")
    assert status == 0
    assert "requirement `obeys` across levels: proved as scheduled, of `boss`, `left`" in out
    for said in (
        "Requirement obeys across levels when boss.go_left, within 1 cycles,",
        "for SR-3",
        "proved : proved as scheduled, of boss , left",
        "Where buffers come later, or levels run when they like, nothing is promised.",
        "level boss : each cycle of it goes on, and what it takes is as it assumes proved",
        "assumption calm across levels, as it is declared",
        "on go true runs := true changes left.runs",
        "A run that asks for its response",
        "cycle 1: it asks",
    ):
        assert said in text, (said, text)
    assert "broken" not in text


def test_a_refuted_requirement_has_the_run_that_breaks_it_and_the_cycles_of_its_lines(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    status, _, text = _page(rcsc, _written(tmp_path, _SOON_PLAIN), "soon")
    assert status == 1
    for said in (
        "refuted : refuted in tick 5, as scheduled",
        "A run that breaks it The shortest that was found: broken in cycle 5.",
        "not_l wish l , right_runs true go_left := false , go_right := false tests boss.wish 3",
        "cycle 5: broken here",
        "requirement soon is broken",
    ):
        assert said in text, (said, text)


def test_what_is_about_every_cycle_needs_no_run_and_one_of_a_level_has_a_page_too(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    boss = _BOSS.replace("table choose {", f"{_LEVEL}table choose {{")
    path = _written(tmp_path, _BACK, files={"boss.rcs": boss})
    assert "It is about every cycle: any run is one of it." in _page(rcsc, path, "never_both")[2]
    status, out, text = _page(rcsc, path, "boss.never_both_go")
    assert (status, "requirement `never_both_go` of level `boss`: proved in every environment" in out) == (
        0,
        True,
    )
    assert (
        "l wish l , right_runs false go_left := true , go_right := false changes boss.go_left, boss.go_right"
        in text
    )
    status, _, text = _page(rcsc, path, "sometimes")
    assert (status, "A run that breaks it" in text, "cycle 2: broken here" in text) == (1, True, True)


def test_a_run_that_waits_for_ever_and_buffers_that_are_late_are_told_as_that(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    soon = "requirement some_time : when boss.go_left, eventually right.runs\n"
    path = _written(tmp_path, soon)
    status, _, text = _page(rcsc, path, "some_time")
    assert (status, "it waits for ever, and the cycles from" in text) == (1, True)
    (tmp_path / "all.rcs").write_text(_OBEYS.replace("within 1", "within 2"))
    path.write_text(path.read_text().replace("tick_ms = 10", "tick_ms = 10\nlate_ticks = 1"))
    text = _page(rcsc, path, "obeys")[2]
    assert "with buffers at most 1 tick late" in text
    assert "As scheduled, and each reader may see a buffer so many ticks later" in text


def test_the_same_requirement_gives_the_same_page_which_loads_nothing(tmp_path: Path, rcsc: Rcsc) -> None:
    path = _written(tmp_path, _SOON_PLAIN)
    _page(rcsc, path, "soon")
    first = (tmp_path / "page.html").read_text()
    _page(rcsc, path, "soon")
    assert (tmp_path / "page.html").read_text() == first
    assert "default-src 'none'" in first
    assert not re.findall(r"<script|https?://", first)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--report", "page.html"), "`--show NAME` says which"),
        (("--show", "other", "--report", "page.html"), "has a requirement `other`"),
        (("--show", "soon", "--show", "soon", "--report", "page.html"), "`--show NAME` says which"),
    ],
)
def test_a_page_is_of_one_requirement_that_is_there(
    tmp_path: Path, rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    status, _, err = rcsc("prove", _written(tmp_path, _SOON_PLAIN), *options)
    assert status == 2
    assert said in " ".join(err.split())
    assert not (tmp_path / "page.html").exists()
