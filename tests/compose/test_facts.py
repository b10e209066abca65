"""Facts about how inputs change from one cycle to the next: what `rcsc prove` shows from them, and only with them."""

import pytest

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.proof.level import Verdict, prove_level
from tests.support.programs.systems import LITTLE, alone
from tests.support.programs.texts import edited

THRESHOLDS = """
input y : int 0 .. 100
state level : int 0 .. 3
state skip : bool
assume slow assumed : abs(y - was y) <= 20
property shown : not skip
table t assuming slow {
  | line | level | y        || level | skip  |
  |------|-------|----------||-------|-------|
  | a    | 0     | < 20     || 0     | false |
  | b    | 0     | 20 .. 39 || 1     | false |
  | c    | 0     | >= 40    || 2     | true  |
  | d    | 1     | < 20     || 0     | false |
  | e    | 1     | 20 .. 39 || 1     | false |
  | f    | 1     | >= 40    || 2     | false |
  | g    | >= 2  | >= 40    || 2     | false |
  | h    | >= 2  | 20 .. 39 || 1     | false |
  | i    | >= 2  | < 20     || 0     | true  |
}
level l { table t }
"""
DRIFT = """
input y : int 0 .. 100
state ticks : int 0 .. 9
state start : int 0 .. 100
assume up assumed : y - was y <= 2
assume down assumed : y - was y >= -2
property shown : ticks < 9 implies abs(y - start) <= 2 * ticks + 2
table t assuming up, down {
  | line    | ticks || ticks     | start |
  |---------|-------||-----------|-------|
  | restart | 9     || 0         | y     |
  | counts  | < 9   || ticks + 1 | start |
}
level l { table t }
"""
BETWEEN = """
input y : int 0 .. 100
input z : int 0 .. 100
state apart : int -100 .. 100 = 0
assume slow_y assumed : abs(y - was y) <= 1
assume slow_z assumed : abs(z - was z) <= 1
property apart_is : apart = y - z
property shown : abs(apart - was apart) <= 2
table t assuming slow_y, slow_z {
  | line | when || apart |
  |------|------||-------|
  | all  | true || y - z |
}
level l { table t }
"""
BOUNDED = """
input y : int 0 .. 100
state moved : int -100 .. 100 = 0
assume slow assumed : abs(y - was y) <= 2
invariant shown : moved in -2 .. 2
table t assuming slow {
  | line | when || moved     |
  |------|------||-----------|
  | all  | true || y - was y |
}
level l { table t }
"""
ONE_INPUT = """
enum mode { off, low, high }
input a : bool
input m : mode
input n : int 0 .. 9
state both : bool
assume one assumed : count(@C(a), @C(m), @C(n)) <= 1
property shown : not both
table t assuming one {
  | line | when                                        || both  |
  |------|---------------------------------------------||-------|
  | two  | @C(a) and @C(m) or @C(m) and @C(n)          || true  |
  | rest | not (@C(a) and @C(m) or @C(m) and @C(n))    || false |
}
level l { table t }
"""
STEP = """
enum mode { off, low, high }
input asked : mode
state seen : mode
state jumped : bool
assume step assumed : was asked = off implies asked /= high
property kept : seen = asked
property shown : not jumped
table t assuming step {
  | line | seen   | asked   || seen | jumped |
  |------|--------|---------||------|--------|
  | jump | off    | high    || high | true   |
  | step | off    | /= high || asked | false |
  | any  | /= off |         || asked | false |
}
level l { table t }
"""
REAL = """
input y : real 0.0 .. 100.0
state jumps : int 0 .. 9
assume slow assumed : y - was y <= 0.5
property shown : jumps = 0
table t assuming slow {
  | line | y - was y || jumps             |
  |------|-----------||-------------------|
  | slow | <= 0.5    ||                   |
  | fast | > 0.5     || min(jumps + 1, 9) |
}
level l { table t }
"""
CASES = {
    "real": (REAL, ("<= 0.5\nproperty", "<= 0.6\nproperty")),
    "thresholds": (THRESHOLDS, ("<= 20", "<= 21")),
    "drift up": (DRIFT, ("y - was y <= 2", "y - was y <= 3")),
    "drift down": (DRIFT, (">= -2", ">= -3")),
    "between two": (BETWEEN, ("abs(z - was z) <= 1", "abs(z - was z) <= 2")),
    "bounded": (BOUNDED, ("<= 2", "<= 3")),
    "one input": (ONE_INPUT, ("count(@C(a), @C(m), @C(n)) <= 1", "count(@C(a), @C(m), @C(n)) <= 2")),
    "step": (STEP, ("asked /= high\n", "asked /= low\n")),
}


def verdict(text: str) -> Verdict:
    proof = prove_level(alone(text), LITTLE)
    assert all(
        verdict is Verdict.TRUSTED
        for obligation, verdict in proof.verdicts
        if obligation.sort is Sort.ASSUMPTION
    )
    [shown] = [verdict for obligation, verdict in proof.verdicts if obligation.name == "shown"]
    return shown


@pytest.mark.parametrize(("text", "weaker"), CASES.values(), ids=CASES)
def test_what_follows_from_a_fact_is_shown_and_nothing_more(text: str, weaker: tuple[str, str]) -> None:
    assert verdict(text) is Verdict.PROVED
    assert verdict(edited(text, weaker)) is Verdict.NOT_PROVED


def test_cells_that_may_be_undefined_are_no_predicates() -> None:
    text = edited(THRESHOLDS, ("| y        ||", "| 100 / (y + 1) ||"))
    assert verdict(text) is Verdict.NOT_PROVED
