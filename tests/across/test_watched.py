"""Requirements across levels are watched in runs: in a log, as they run, in processes, in episodes of campaigns."""

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest

from rcsc.compose.counterexample.rerun import make
from rcsc.compose.proof.system import read_systems
from rcsc.driver.watched import claims_of
from rcsc.lang.over_time.run import Watch
from rcsc.run.campaign.choose import ANY
from rcsc.run.campaign.rig import Rig, digest
from rcsc.run.campaign.summary import watched, watched_text
from rcsc.run.episodes.across import ACROSS as WHERE
from rcsc.run.episodes.episode import BufferFault, Episode, Reading, Restart
from rcsc.run.episodes.loop import Loop
from rcsc.run.episodes.outcome import EpisodeOutcome
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc.run.episodes.stand import stand
from rcsc.run.levels import StateTableError
from rcsc.run.log.across import AcrossTrack, AcrossWatch
from rcsc.run.log.read import read
from rcsc.run.log.recorder import Recorder
from rcsc.run.log.required import ACROSS, broken_in
from rcsc.run.signature import Values
from tests.across.judge.systems import Running, drawn
from tests.across.judge.systems import written as written_drawn
from tests.across.test_across import _BOSS, _COUNTS, Rcsc, _written
from tests.across.test_across import rcsc as rcsc  # noqa: PLC0414  # the fixture

_PANEL = """\
class Panel:
    wish: str = "nobody"
    tick: int = 0

    def step(self, seconds: float) -> None:
        self.tick += 1
        self.wish = WISHES[self.tick % len(WISHES)]
"""
_OBEYS = "requirement obeys : when boss.go_left, within 1 cycles, left.runs or not boss.go_left\n"
_HEEDS = "requirement heeds monitored : whenever panel.wish = l, at once boss.go_left or boss.right_runs\n"
_CALM = "assume calm assumed monitored : whenever panel.wish = r, at once not was (panel.wish = l)\n"


def _with_plant(path: Path, *wishes: str) -> Path:
    """Give a system a plant that wishes these one after the other, again and again."""
    (path.parent / "panel.py").write_text(f"WISHES = {wishes}\n\n\n{_PANEL}")
    path.write_text(path.read_text() + '[plant]\npython = "panel.py"\n')
    return path


def _ran(rcsc: Rcsc, path: Path, *options: str) -> tuple[int, str]:
    status, out, err = rcsc("run", path, "--cycles", "30", "--executor", "python", *options)
    return status, out + err


# --- `rcsc run`, `rcsc replay --find` ------------------------------------------------------------


def test_a_run_tells_the_tick_that_breaks_a_requirement_and_replay_finds_it_in_both_executors(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    """The plant wishes r in tick 3 and l from tick 4 on: `left` runs while `right` does not yet say that it stands."""
    held = "requirement held monitored : always not (left.runs and boss.wish = nobody)\n"
    path = _with_plant(_written(tmp_path, held + _OBEYS), "nobody", "l", "l", "nobody", "nobody")
    status, text = _ran(rcsc, path)
    assert status == 1
    assert re.findall(r"cycle (\d+): requirement `(\w+)` across levels is broken: (.*)", text) == [
        ("4", "held", "`left.runs` = true, `boss.wish` = nobody")
    ]
    assert "watched: 1 requirement, 1 broken" in text
    log = tmp_path / ".rcsc-cache" / "two.mcap"
    for executor in ("c", "python"):
        assert rcsc("run", path, "--cycles", "30", "--executor", executor, "-q")[0] == 1
        for other in ("c", "python"):
            status, out, _ = rcsc("replay", log, "--system", path, "--executor", other, "--find", "not held")
            assert (status, out.partition(",")[0]) == (0, "cycle 4")
    status, out, _ = rcsc("replay", log, "--system", path, "--executor", "python", "--find", "not obeys")
    assert (status, "holds in no cycle" in out) == (1, True)


def test_what_is_not_monitored_or_is_kept_is_not_told(tmp_path: Path, rcsc: Rcsc) -> None:
    held = "requirement held : always not (left.runs and boss.wish = nobody)\n"
    path = _with_plant(_written(tmp_path, held + _OBEYS.replace("obeys", "obeys monitored")), "nobody", "l")
    status, text = _ran(rcsc, path)
    assert (status, "across levels" in text) == (0, False)
    assert "watched: 1 requirement, none broken" in text


def test_what_a_party_gives_is_what_the_levels_of_that_tick_take(tmp_path: Path, rcsc: Rcsc) -> None:
    """`heeds` compares the buffer with what `boss` makes of it in the same tick: one tick beside it would break it."""
    path = _with_plant(_written(tmp_path, _HEEDS), "nobody", "l", "l", "nobody", "r")
    assert _ran(rcsc, path)[0] == 0
    later = _HEEDS.replace("at once", "next").replace("heeds", "later")
    (tmp_path / "all.rcs").write_text(later)
    assert _ran(rcsc, path)[0] == 1


def test_a_plant_that_breaks_what_is_assumed_is_told_as_that_with_the_tick(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    path = _with_plant(_written(tmp_path, _CALM), "nobody", "nobody", "l", "r")
    status, text = _ran(rcsc, path)
    assert status == 1
    assert (
        "cycle 4: assumption `calm` across levels is broken by what stands outside: `panel.wish` = r" in text
    )
    assert "what is proved trusting it says nothing of this cycle, nor of any later one" in text
    assert re.search(r"watched: .*1 assumption, 1 broken", text)
    log = tmp_path / ".rcsc-cache" / "two.mcap"
    status, out, _ = rcsc("replay", log, "--system", path, "--executor", "python", "--find", "not calm")
    assert out.startswith("cycle 4,")


def test_processes_in_step_break_it_in_the_same_tick_and_free_ones_say_what_is_promised(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    held = "requirement held monitored : always not (left.runs and boss.wish = nobody)\n"
    path = _with_plant(_written(tmp_path, held), "nobody", "l", "l", "nobody", "nobody")
    told = [
        _ran(rcsc, path, *options)[1]
        for options in ((), ("--processes", "--in-step", "--rate", "20"), ("--processes", "--rate", "20"))
    ]
    found = [re.findall(r"cycle (\d+): requirement `held`", text) for text in told]
    assert found[0] == found[1] == ["4"]
    assert found[2]
    assert ["each level ran when it liked" in text for text in told] == [False, False, True]


def test_a_file_of_requirements_that_is_not_in_order_is_told_before_anything_moves(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    path = _written(tmp_path, "requirement p monitored : always lft.runs\n")
    status, text = _ran(rcsc, path)
    assert status == 1
    assert "is not in order: see `rcsc check" in text
    assert "cycles" not in text


def test_a_name_that_is_a_member_too_is_the_member_where_one_is_compared(tmp_path: Path, rcsc: Rcsc) -> None:
    path = _with_plant(_written(tmp_path, "requirement l : always not boss.go_left\n"), "nobody", "l")
    assert _ran(rcsc, path)[0] == 0
    log = tmp_path / ".rcsc-cache" / "two.mcap"
    for text, tick in (("boss.wish = l", "cycle 2,"), ("not l", "cycle 2,"), ("boss.wish = l and l", "`")):
        _, out, _ = rcsc("replay", log, "--system", path, "--executor", "python", "--find", text)
        assert out.startswith(tick)


# --- as it is defined ----------------------------------------------------------------------------


class _Outside:
    """What stands outside a drawn system: gives each level a value for the next tick; now and then one that is refused."""

    def __init__(self, inputs: Mapping[str, tuple[Any, ...]], random: Random) -> None:
        self.inputs, self.random, self.given = inputs, random, dict[str, Any]()

    def step(self, _: int, __: object) -> Mapping[str, Values]:
        self.given = {name: self.random.choice(every) for name, every in self.inputs.items()}
        return {f"plant.y_{name}": (value,) for name, value in self.given.items()}


@pytest.mark.parametrize("seed", range(8))
def test_a_watch_reads_what_the_judge_of_the_proof_reads(seed: int, tmp_path: Path) -> None:
    """Live and in the log, with restarts in any tick, refused inputs, and levels of longer periods."""
    running = Running(written_drawn(drawn(seed), tmp_path))
    system, program, random = running.system, running.program, Random(seed)  # noqa: S311  # repeatable on purpose
    outside = _Outside(running.inputs, random)
    object.__setattr__(system, "outside", (outside,))
    signs = {level.name: level.sign for level in system.levels}
    live = AcrossWatch.of(program.stated, running.described, signs)
    judge = {stated.name: Watch(stated) for stated in program.stated}
    took, held = {name: running.inputs_of(name) for name in signs}, dict.fromkeys(signs, 0)
    stood = {name: (level.value("n"), level.value("o")) for name in signs for level in (system.level(name),)}
    expected, seen = list[tuple[int, str]](), list[tuple[int, str]]()
    for level in system.levels:
        live.stand(level.name, level.values)
    with Recorder(system, tmp_path / "log.mcap") as recorder:
        system.watch.append(recorder)
        for tick in range(60):
            before = _seen(stood, took, held)
            for name in signs:
                if random.random() < 0.1:
                    system.restart(name)
            buffers = {name: system.buffers.latest(name) for name in live.buffers}
            held |= {name: _typed(value, held[name]) for name, value in outside.given.items()}
            with suppress(StateTableError):
                system.step()
            ran = [level for level in system.levels if tick * 10 % level.level.period_ms == 0]
            for level in ran:
                stood[level.name] = level.value("n"), level.value("o")
                if not level.fault:
                    took[level.name] = running.inputs_of(level.name)
            after = _seen(stood, took, held)
            expected += [(tick + 1, name) for name, watch in judge.items() if not watch.keeps(before, after)]
            seen += [
                (tick + 1, one.name)
                for one, _ in live.tick({each.name: each.values for each in ran}, buffers)
            ]
    assert seen == expected
    logged = broken_in(read(tmp_path / "log.mcap"), {ACROSS: program.stated})
    assert [(one.tick, one.name) for one in logged] == expected


def _typed(value: Any, last: Any) -> Any:
    return last if value == 3 else value  # 3 is refused


def _seen(stood: Mapping[str, Any], took: Mapping[str, Any], held: Mapping[str, Any]) -> dict[str, Any]:
    return {
        f"{name}.{leaf}": value
        for name, (n, o) in stood.items()
        for leaf, value in {"n": n, "o": o, "x": took[name][0], "y": took[name][1]}.items()
    } | {f"plant.y_{name}": value for name, value in held.items()}


def test_a_log_that_goes_on_is_looked_at_once(tmp_path: Path, rcsc: Rcsc) -> None:
    path = _with_plant(_written(tmp_path, "property runs : left.runs\n"), "nobody")
    _ran(rcsc, path)
    log = read(tmp_path / ".rcsc-cache" / "two.mcap")
    track = AcrossTrack.of(log, stand(path).across)
    assert [tick for tick, _, _ in track.further(log)] == list(range(1, 31))
    assert not list(track.further(log))


# --- episodes ------------------------------------------------------------------------------------


def _compiled(path: Path) -> Path:
    systems, _ = read_systems(path)
    make((ts.program for ts in systems.values()), path.parent / "generated", altered=False)
    return path


def _played(path: Path, episode: Episode, claims: Claims = NOTHING) -> EpisodeOutcome:
    return Loop(replace(episode, executor="python"), stand(path), claims).finish()


def _names(outcome: EpisodeOutcome) -> list[str]:
    return sorted(one.property for one in outcome.findings)


_WISHES = tuple("nobody l l l nobody nobody r r nobody nobody".split())


def test_a_late_buffer_excuses_what_is_proved_as_scheduled_and_nothing_that_is_proved_under_any_timing(
    tmp_path: Path,
) -> None:
    """`one` is proved under any timing of what it says here, and broken on purpose: the claim is forged."""
    one = "property one : not (boss.go_left and left.runs)\n"
    path = _with_plant(_compiled(_written(tmp_path, _OBEYS + one)), *_WISHES)
    late = Episode(harms=(BufferFault("boss.go_left", "late", 0, 20, ticks=2),), ticks=30)
    claims = claims_of(path, None)
    assert [(claim.name, claim.scheduled) for claim in claims.across] == [("obeys", True)]
    for given, known in (
        (claims, "it is proved as scheduled only"),
        (NOTHING, "it is not proved under any timing"),
    ):
        outcome = _played(path, late, given)
        excused = {one.property: one.because for one in outcome.excused}
        assert _names(outcome) == []
        assert excused[f"{WHERE}: obeys"] == f"ticks 0 .. 20: buffer `boss.go_left` is late, and {known}"
    forged = replace(claims, across=(replace(claims.across[0], scheduled=False),))
    assert _names(_played(path, late, forged)) == [
        f"{WHERE}: obeys",
        "proved: requirement `obeys` across levels",
    ]
    on_time = _played(path, Episode(ticks=30), claims)
    assert _names(on_time) == [f"{WHERE}: one"]


def test_a_buffer_from_outside_that_is_late_excuses_nothing(tmp_path: Path) -> None:
    held = "requirement held : always not (left.runs and boss.wish = nobody)\n"
    path = _with_plant(_compiled(_written(tmp_path, held)), *_WISHES)
    late = Episode(harms=(BufferFault("panel.wish", "late", 0, 20, ticks=2),), ticks=30)
    assert _names(_played(path, late)) == [f"{WHERE}: held"]


def test_what_only_a_restart_breaks_is_found_and_is_no_mistake_of_the_proof(tmp_path: Path) -> None:
    never = "property never_back : left.n >= was left.n\n"
    path = _with_plant(_compiled(_written(tmp_path, never, files={"left.rcs": _COUNTS})), *_WISHES)
    claims = claims_of(path, None)
    assert _names(_played(path, Episode(ticks=30), claims)) == []
    outcome = _played(path, Episode(restarts=(Restart(8, "left"),), ticks=30), claims)
    assert _names(outcome) == [f"{WHERE}: never_back"]
    assert "it is proved trusting that no level begins anew" in outcome.findings[0].message


def test_a_level_that_does_not_run_in_the_tick_of_its_restart_is_as_it_was_until_it_does(
    tmp_path: Path,
) -> None:
    never = "property never_back : left.n >= was left.n\n"
    slow = _COUNTS.replace("period 10", "period 20")
    path = _with_plant(_compiled(_written(tmp_path, never, files={"left.rcs": slow})), *_WISHES)
    outcome = _played(path, Episode(restarts=(Restart(9, "left"),), ticks=30))
    assert [(one.property, one.tick) for one in outcome.findings] == [(f"{WHERE}: never_back", 11)]


def test_what_a_party_gives_stands_in_ticks_in_which_nobody_takes_it(tmp_path: Path) -> None:
    """`boss` runs in every other tick, and takes what the plant gave in those alone."""
    slow = _BOSS.replace("period 10", "period 20")
    stated = "property never_l : panel.wish /= l\nproperty never_takes_l : boss.wish /= l\n"
    path = _with_plant(_compiled(_written(tmp_path, stated, files={"boss.rcs": slow})), "nobody", "l")
    outcome = _played(path, Episode(ticks=30))
    assert [(one.property, one.tick) for one in outcome.findings] == [(f"{WHERE}: never_l", 2)]


def test_after_the_plant_broke_what_is_assumed_nothing_across_levels_is_asked_for(tmp_path: Path) -> None:
    calm = "assume calm assumed : never panel.wish = r\n"
    never = "requirement never_right : never right.runs\n"
    path = _with_plant(_compiled(_written(tmp_path, calm + never)), *_WISHES)
    claims = claims_of(path, None)
    assert [claim.name for claim in claims.across] == ["never_right"]
    outcome = _played(path, Episode(ticks=30), claims)
    assert _names(outcome) == [f"{WHERE}: assumption calm"]
    assert [(one.property, one.because) for one in outcome.excused] == [
        (f"{WHERE}: never_right", "assumption `calm` across levels was broken in cycle 7")
    ]


def test_a_reading_that_the_episode_holds_breaks_no_assumption_of_the_plant(tmp_path: Path) -> None:
    calm = "assume calm assumed : never panel.wish = r\n"
    path = _with_plant(_compiled(_written(tmp_path, calm)), "nobody", "l")
    held = Episode(readings=(Reading("panel.wish", "r", 3, 5),), ticks=30)
    outcome = _played(path, held)
    assert _names(outcome) == []
    assert [one.property for one in outcome.excused] == [f"{WHERE}: assumption calm"]
    path.write_text(path.read_text().partition("[plant]")[0])
    assert _names(_played(path, held)) == []


def test_what_an_episode_has_refused_is_no_value_of_a_party(tmp_path: Path) -> None:
    """A value that `boss` refuses is not taken, and what was there before stands for it."""
    in_range = "property in_range : panel.wish in {nobody, l, r}\nproperty same : panel.wish = boss.wish\n"
    path = _with_plant(_compiled(_written(tmp_path, in_range)), "nobody", "l")
    outcome = _played(path, Episode(readings=(Reading("panel.wish", 7, 3, 5, refused=True),), ticks=30))
    assert _names(outcome) == []


# --- campaigns -----------------------------------------------------------------------------------


_DRAWN = ("--seed", 1, "--executor", "python", "--workers", 1)


def test_a_campaign_says_what_it_watches_and_where_that_is_not_asked_for(tmp_path: Path) -> None:
    both = "property one : not (boss.go_left and boss.go_right)\n"
    path = _compiled(_written(tmp_path, _OBEYS + both))
    text = watched_text(watched(claims_of(path, None), stand(path)))
    assert text[0].startswith("11 of 11 claims")
    assert text[-3:] == [
        "  across levels, as scheduled: `obeys`",
        "  across levels, under any timing: `one`",
        "  what is proved as scheduled is not asked for once a buffer between levels was late, lost a value or repeated one",
    ]


@pytest.mark.thorough
def test_a_campaign_watches_what_is_stated_across_levels_and_keeps_what_breaks_it(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    held = "requirement held : always not (left.runs and boss.wish = nobody)\n"
    path, saved = _with_plant(_written(tmp_path, held + _OBEYS), *_WISHES), tmp_path / "found"
    status, out, err = rcsc("campaign", path, *_DRAWN, "--episodes", 2, "--save", saved)
    assert status == 1
    assert "`across levels: held` does not hold" in err
    assert "obeys" not in err
    assert "across levels, as scheduled: `obeys`" in out
    assert "what is proved as scheduled is not asked for once a buffer between levels was late" in out
    kept = next(saved.iterdir())
    assert rcsc("campaign", path, "--again", kept, "--no-compile", "--no-claims")[0] == 1
    (tmp_path / "all.rcs").write_text(_OBEYS)
    assert rcsc("campaign", path, "--again", kept, "--no-compile", "--no-claims")[0] == 0


@pytest.mark.thorough
def test_a_campaign_makes_the_episode_small(tmp_path: Path, rcsc: Rcsc) -> None:
    """Where no plant is, readings alone make `left` run: one wish is left of all that was drawn."""
    held = "requirement held : always not (left.runs and boss.wish = nobody)\n"
    path = _written(tmp_path, held)
    status, _, err = rcsc("campaign", path, *_DRAWN, "--episodes", 6, "--save", tmp_path / "found")
    assert status == 1
    assert re.findall(r"= note: (.*)", err.partition("episode")[2].partition("error")[0])[0].startswith(
        "tick"
    )
    assert err.partition("= help")[0].count("= note:") <= 2


def test_a_campaign_depends_on_what_is_stated_across_levels(tmp_path: Path) -> None:
    path = _compiled(_written(tmp_path, _OBEYS))
    rig = Rig(ANY, path, executor="python")
    first = digest(rig)
    (tmp_path / "all.rcs").write_text(_OBEYS.replace("1 cycles", "2 cycles"))
    digest.cache_clear()
    assert digest(rig) != first
