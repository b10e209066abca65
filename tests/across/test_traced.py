"""Requirements across levels are traced: to the lines that have a part in them and to their verdict, and back; and listed as they stand."""

import json
from pathlib import Path

import pytest

from rcsc.base.host.cache import Cache, open_cache
from rcsc.driver.requirements import KnownRequirement, known_requirements, read
from rcsc.views.trace.across import parts_of
from tests.across.test_across import Rcsc, _written
from tests.across.test_across import rcsc as rcsc  # noqa: PLC0414  # the fixture

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
