"""What the contract leaves open of a level: proved of it with its neighbours, as they run, and of nothing that they do not keep."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.counterexample.rerun import make
from rcsc.compose.proof.system import SystemProof, prove_transition_systems, read_systems
from rcsc.compose.together.left_open import with_those_together
from rcsc.driver.watched import claims_of
from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.episodes.episode import BufferFault, Episode
from rcsc.run.episodes.loop import Loop
from rcsc.run.episodes.proved.watch import ProvedHolds
from rcsc.run.episodes.stand import stand
from tests.across.judge.held import System
from tests.across.judge.systems import Drawn, drawn, written
from tests.across.judge.truth import Befalls, Runs, TooManyError, truth

_UP = """\
input go : bool
output a : bool safe false
output b : bool safe false
table t_up {
  | line | go    || a     | b     |
  |------|-------||-------|-------|
  | on   | true  || true  | false |
  | off  | false || false | true  |
}
level up { period 20 [ms] table t_up }
"""
_LOW = """\
input a : bool
input b : bool
output x : bool safe false
## The level above never sets both.
assume not_both monitored : not (a and b)
table t_low assuming not_both {
  | line | a     | b     || x     |
  |------|-------|-------||-------|
  | a    | true  |       || true  |
  | b    |       | true  || false |
  | none | false | false ||       |
}
level low { period 20 [ms] table t_low }
"""
_SYSTEM = """\
name = "plain"
generated = "generated"
tick_ms = 20
[[level]]
name = "up"
[[level]]
name = "low"
[buffers]
"w.go" = "up.go"
"up.a" = "low.a"
"up.b" = "low.b"
"low.x" = "w.x"
"""


def _proved(folder: Path, files: Mapping[str, str] = {}) -> tuple[SystemProof, SystemProof]:
    """Return what is proved of the levels alone, and together."""
    texts = {"rcsc.toml": 'name = "plain"\n', "up.rcs": _UP, "low.rcs": _LOW, "system.toml": _SYSTEM, **files}
    for name, text in texts.items():
        (folder / name).write_text(text)
    systems, _ = read_systems(folder / "system.toml")
    whole = prove_transition_systems(systems, None, 1, tuple(systems))
    return whole, with_those_together(systems, description(folder / "system.toml"), whole)


def test_what_a_level_gives_in_one_cycle_is_known_to_who_reads_it_as_scheduled(tmp_path: Path) -> None:
    alone, together = _proved(tmp_path)
    assert not alone.proved
    assert together.proved
    claim = together.of("low", (Sort.ASSUMPTION, "t_low", "not_both"))
    assert claim.proved
    assert claim.trusts == ("level `low` takes what others give as scheduled",)


_BOTH = _UP.replace("| true  | false |\n", "| true  | true  |\n")
_BEGINS = _LOW.replace("input a : bool", "input a : bool = true").replace(
    "input b : bool", "input b : bool = true"
)
_SPLIT = _SYSTEM.replace('"up.b" = "low.b"', '"w.b" = "low.b"')


@pytest.mark.parametrize(
    "files",
    [
        {"up.rcs": _BOTH},
        {"low.rcs": _BEGINS},
        {"system.toml": _SPLIT},
    ],
    ids=["it sets both", "empty buffers hold both", "one comes from outside"],
)
def test_what_is_not_kept_stays_open(tmp_path: Path, files: Mapping[str, str]) -> None:
    assert not _proved(tmp_path, files)[1].proved


def test_two_buffers_that_may_be_late_are_of_two_cycles(tmp_path: Path) -> None:
    late = _SYSTEM.replace("tick_ms = 20\n", "tick_ms = 20\nlate_ticks = 1\n")
    claim = _proved(tmp_path, {"system.toml": late})[1].of("low", (Sort.ONE_LINE, "t_low", ""))
    assert claim.trusts == ("level `low` takes what others give as scheduled",)


def test_one_buffer_is_of_one_cycle_however_late(tmp_path: Path) -> None:
    record = "record pair { a : bool b : bool }\n"
    up = record + _UP.replace("output a : bool safe false\noutput b : bool safe false", "output o : pair")
    up = up.replace("|| a     | b     |", "|| o.a   | o.b   |")
    low = record + _LOW.replace("input a : bool\ninput b : bool", "input o : pair")
    low = low.replace("(a and b)", "(o.a and o.b)").replace("| a     | b     |", "| o.a   | o.b   |")
    system = _SYSTEM.replace("tick_ms = 20\n", "tick_ms = 20\nlate_ticks = 2\n")
    system = system.replace('"up.a" = "low.a"\n"up.b" = "low.b"', '"up.o" = "low.o"')
    claim = _proved(tmp_path, {"system.toml": system, "up.rcs": up, "low.rcs": low})[1].of(
        "low", (Sort.ONE_LINE, "t_low", "")
    )
    assert claim.proved
    assert claim.trusts == ("level `low` takes what others give at most `2` ticks late",)


def test_prove_tells_what_trusts_a_schedule_and_strict_counts_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    _proved(tmp_path)
    path = str(tmp_path / "system.toml")
    capfd.readouterr()
    assert run(["prove", path, "--no-cache"]) == 0
    assert (
        "not_both                 proved, trusting level `low` takes what others give as scheduled"
        in capfd.readouterr().out
    )
    assert run(["prove", path, "--no-cache", "--strict"]) == 1
    assert "2 claims trusting a schedule" in capfd.readouterr().out
    run(["prove", path, "--no-cache", "--json"])
    goals = json.loads(capfd.readouterr().out)["levels"][1]["goals"]
    assert {"level `low` takes what others give as scheduled"} == {
        t for goal in goals for t in goal["trusts"]
    }


# --- drawn systems -----------------------------------------------------------------------------

FEW, MOST = 2, 64


def _with_properties(made: Drawn, seed: int) -> Drawn:
    """State properties of the first level's input and state, and the same across levels."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    files, across = dict(made.files), list[str]()
    name = made.levels[0]
    for at in range(5):
        atoms = [
            random.choice(("x", "not x", "o", "not o", *(f"n = {n}" for n in range(3)))) for _ in range(3)
        ]
        said = random.choice(("{0} or {1} or {2}", "{0} implies {1}", "not ({0} and {1} and {2})")).format(
            *atoms
        )
        if "x" not in said:
            continue
        files[f"{name}.rcs"] += f"\nproperty p{at} : {said}\n"
        across.append(f"property p{at} : {_prefixed(said, name)}")
    files["requirements.rcs"] = "\n".join(across) + "\n"
    return replace(made, files=files)


def _prefixed(said: str, name: str) -> str:
    words = said.replace("(", "( ").replace(")", " )").split()
    return " ".join(f"{name}.{word}" if word in {"x", "o", "n"} else word for word in words)


def judged(seed: int, folder: Path, late: int = 0) -> list[str]:
    """Judge what is proved of a drawn system together; return the verdicts."""
    path = written(_with_properties(drawn(seed, late), seed), folder)
    systems, _ = read_systems(path)
    alone = prove_transition_systems(systems, None, 1, tuple(systems))
    whole = with_those_together(systems, description(path), alone)
    it, verdicts = System.of(path), list[str]()
    for stated in it.program.properties:
        key = (Sort.PROPERTY, "", stated.name)
        claim, first = whole.of("a", key), next(iter(whole.levels))
        if not claim.proved:
            verdicts.append("open")
            continue
        admits = any("never refused" in trust for trust in claim.trusts)
        lates = late > 0 and not any("as scheduled" in trust for trust in claim.trusts)
        befalls = Befalls(refuses=not admits, late=late if lates else 0)
        try:
            true = truth(Runs(it.systems, it.description, it.program, stated, befalls, it.cycles))
        except TooManyError:
            verdicts.append("too many runs")
            continue
        assert not true.least, (seed, stated.text, claim.trusts, true.least)
        verdicts.append("together" if key in {one.key for one in first.together} else "alone")
    return verdicts


@pytest.mark.parametrize("seed", range(FEW))
def test_drawn_levels_keep_as_they_run_what_is_proved_of_them_together(seed: int, tmp_path: Path) -> None:
    judged(seed, tmp_path)


@pytest.mark.thorough
def test_many_drawn_levels_keep_as_they_run_what_is_proved_of_them_together(tmp_path: Path) -> None:
    verdicts = list[str]()
    for seed in range(2000, 2000 + MOST):
        folder = tmp_path / str(seed)
        folder.mkdir()
        verdicts += judged(seed, folder, late=seed % 2)
    assert {"together", "alone", "open"} <= set(verdicts)


def test_the_page_of_a_requirement_rests_on_what_levels_show_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named = _SYSTEM.replace("tick_ms", 'requirements = "all.rcs"\ntick_ms')
    _proved(tmp_path, {"system.toml": named, "all.rcs": "requirement never : always not (low.a and low.b)\n"})
    page = str(tmp_path / "page.html")
    assert run(["prove", str(tmp_path / "system.toml"), "--show", "never", "--report", page]) == 0
    out = capsys.readouterr().out
    assert "proved as scheduled" in out
    assert "rests on" not in out


_TOGGLES = """\
class W:
    go: bool = False
    x: bool = False

    def step(self, seconds: float) -> None:
        self.go = not self.go
"""


def test_episodes_watch_what_levels_show_together_until_a_buffer_is_late(tmp_path: Path) -> None:
    _proved(tmp_path, {"system.toml": _SYSTEM + '[plant]\npython = "w.py"\n', "w.py": _TOGGLES})
    path = tmp_path / "system.toml"
    systems, _ = read_systems(path)
    make((ts.program for ts in systems.values()), tmp_path / "generated", altered=False)
    claims, at = claims_of(path, None), stand(path)
    assert ("low", "ASSUMPTION", "not_both") in [(one.level, one.kind, one.name) for one in claims.every]
    assert not ProvedHolds(claims, at).unwatched
    late = BufferFault("up.a", "late", 0, 9, ticks=1)
    assert not Loop(Episode(ticks=12, executor="python"), at, claims).finish().findings
    [found] = Loop(Episode(harms=(late,), ticks=12, executor="python"), stand(path), claims).finish().findings
    assert found.property == "no state-table error"
    assert "level `low` takes what others give as scheduled (cycle 1)" in found.message
