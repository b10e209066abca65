"""All that is known of one requirement as a page: `rcsc prove --show NAME --report PAGE`."""

import re
from html import unescape
from pathlib import Path

import pytest

from tests.across.test_across import _BOSS, Rcsc, _written
from tests.across.test_across import rcsc as rcsc  # noqa: PLC0414  # the fixture

_OBEYS = 'requirement obeys req "SR-3" : when boss.go_left, within 1 cycles, left.runs or not boss.go_left\n'
_SOON = "requirement soon : when boss.wish = l and not right.runs, within 2 cycles, left.runs\n"
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
    status, _, text = _page(rcsc, _written(tmp_path, _SOON), "soon")
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
    path = _written(tmp_path, _SOON)
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
    status, _, err = rcsc("prove", _written(tmp_path, _SOON), *options)
    assert status == 2
    assert said in " ".join(err.split())
    assert not (tmp_path / "page.html").exists()
