"""Cycles that an input ends are cycles of the proof; what needs that there are none says so."""

from pathlib import Path

import pytest

import rcsc
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.proof.system import SystemProof, transition_systems
from rcsc.front.commands import run
from tests.support.programs.systems import LITTLE, solo_system
from tests.support.proved import prove_system

SAFE_VALUE = """input x : int 0 .. 9
output o : int 0 .. 3 = 0 safe 3
assume no_three monitored : o /= 3
table t assuming no_three {
  | line | o   | x   || o |
  |------|-----|-----||---|
  | up   | 0   | 0   || 1 |
  | on   | 1   |     || 2 |
  | back | 2   |     || 0 |
  | stay | 0   | > 0 || 0 |
}
level solo { period 40 [ms] table t }
"""
GUARDED = """input guard : bool
input level : int 0 .. 100
output speed : int 0 .. 9
property only_guarded : speed > 0 implies guard
property bounded : speed <= 5
table t {
  | line | guard | level || speed |
  |------|-------|-------||-------|
  | go   | true  | < 50  || 5     |
  | high | true  | >= 50 || 0     |
  | no   | false |       || 0     |
}
level solo { period 40 [ms] table t }
"""


def trusts(whole: SystemProof, sort: Sort, table: str, name: str = "") -> tuple[str, ...]:
    found = whole.of("solo", (sort, table, name))
    assert found.proved
    return found.trusts


@pytest.mark.parametrize("more", ["", " clamp"])
def test_a_line_that_a_safe_value_takes_away_trusts_that_nothing_is_refused(
    more: str, tmp_path: Path
) -> None:
    path = solo_system(tmp_path, SAFE_VALUE.replace("0 .. 9", f"0 .. 9{more}"))
    whole = prove_system(path, LITTLE)
    words = () if more else ("`x` of level `solo` is never refused",)
    assert trusts(whole, Sort.SOME_LINE, "t") == words
    assert trusts(whole, Sort.ASSUMPTION, "t", "no_three") == words
    assert whole.admitting == words
    assert run(["prove", str(path), "--no-cache"]) == 0
    assert run(["prove", str(path), "--no-cache", "--strict"]) == (0 if more else 1)


@pytest.mark.parametrize(
    ("kind", "trusted"),
    [
        ("int 0 .. 2 clamp", True),
        ("int 0 .. 255 clamp", False),
        ("int -9 .. 65535 clamp", True),
        ("bool", False),
    ],
)
def test_a_property_that_looks_back_at_what_is_clamped_trusts_what_stands_at_a_restart(
    kind: str, trusted: bool, tmp_path: Path
) -> None:
    """Where the level begins anew its inputs stand as they came; the first cycle moves them to the edge."""
    text = f"""input x : {kind}
output o : bool
property back : was x in {{{"true, false" if kind == "bool" else kind.removeprefix("int ").removesuffix(" clamp")}}}
property here : x in {{{"true, false" if kind == "bool" else kind.removeprefix("int ").removesuffix(" clamp")}}}
property aside : o or not o
table t {{
  | line | o     || o     |
  |------|-------||-------|
  | on   | false || true  |
  | off  | true  || false |
}}
level solo {{ period 40 [ms] table t }}
"""
    path = solo_system(tmp_path, text)
    whole = prove_system(path, LITTLE)
    words = ("`x` of level `solo` is in range where it begins anew",) if trusted else ()
    assert trusts(whole, Sort.PROPERTY, "", "back") == words
    assert trusts(whole, Sort.PROPERTY, "", "here") == trusts(whole, Sort.PROPERTY, "", "aside") == ()
    assert run(["prove", str(path), "--no-cache"]) == 0
    assert run(["prove", str(path), "--no-cache", "--strict"]) == (1 if trusted else 0)


def test_a_property_about_an_input_trusts_that_no_other_is_refused(tmp_path: Path) -> None:
    """One that does not look at inputs trusts nothing: a refused cycle changes no output without a safe value."""
    path = solo_system(tmp_path, GUARDED)
    whole = prove_system(path, LITTLE)
    words = ("`level` of level `solo` is never refused",)
    assert trusts(whole, Sort.PROPERTY, "", "only_guarded") == words
    [claim] = [each for each in rcsc.prove(path, cycles=0).claims if each.name == "only_guarded"]
    assert (claim.proved, claim.trusts) == (True, words)
    assert trusts(whole, Sort.PROPERTY, "", "bounded") == ()
    assert trusts(whole, Sort.SOME_LINE, "t") == ()


def test_with_a_safe_value_the_property_holds_in_a_refused_cycle_too(tmp_path: Path) -> None:
    text = GUARDED.replace("speed : int 0 .. 9", "speed : int 0 .. 9 safe 0")
    whole = prove_system(solo_system(tmp_path, text), LITTLE)
    assert trusts(whole, Sort.PROPERTY, "", "only_guarded") == ()


def test_a_bool_is_never_refused(tmp_path: Path) -> None:
    text = GUARDED.replace("input level : int 0 .. 100", "input level : bool")
    text = text.replace("< 50 ", "false").replace(">= 50", "true ")
    path = solo_system(tmp_path, text)
    assert transition_systems(path)["solo"].refusable == ()
    assert prove_system(path, LITTLE).admitting == ()
