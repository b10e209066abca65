"""What is proved, found and shown of a few drawn levels, against all of their runs; and faults that are planted, which are noticed."""

from collections import Counter
from collections.abc import Callable
from unittest.mock import patch

import pytest

from rcsc.compose.exact.eventual import Waits
from rcsc.lang.model import Program
from rcsc.lang.resolve import compile_text
from rcsc.proof.symbolic import values
from tests.judge.__main__ import main
from tests.judge.drawn import drawn, made
from tests.judge.held import judged
from tests.judge.truth import Runs, truth
from tests.support.programs.systems import alone

SEEDS = (2, 8, 9, 14)
"""Levels that are quickly proved; of one lines and requirements are looked at in context, too."""


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_differs(seed: int) -> None:
    one = judged(seed)
    assert one.differences == ()
    assert one.counts["levels"] == one.counts["levels proved"] == 1


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(100, 300))
def test_nothing_differs_of_many_levels(seed: int) -> None:
    assert judged(seed).differences == ()


def test_nearly_every_level_is_a_program_and_every_part_is_drawn() -> None:
    parts = Counter(part for seed in range(200) for part in made(seed)[1])
    assert set(parts) == {
        "arithmetic", "array", "assumed", "clamped", "deferred", "division", "enumeration", "input", "property", "refused", "restart",
        "safe", "single", "timer",
    }  # fmt: skip
    assert min(parts.values()) > 3
    assert all(isinstance(compile_text(drawn(seed), "x"), Program) for seed in range(20))


def test_a_truth_is_of_every_run() -> None:
    """By hand: `n` goes round in four cycles, and waits for `a` where it is 2."""
    text = """\
input a : bool
state n : int 0 .. 3
requirement early : always n < 2
requirement late : whenever n = 2, eventually n = 3
requirement within : whenever n = 0, within 2 cycles, n = 2
requirement idle : when n > 3, at once a
table t {
  | line | n | a || n |
  |---|---|---||---|
  | 0 | 0 | || 1 |
  | 1 | 1 | || 2 |
  | 2 | 2 | true || 3 |
  | 3 | 2 | false || 2 |
  | 4 | 3 | || 0 |
}
level solo { period 10 [ms] table t }
"""
    true = truth(Runs.of(alone(text.replace("n > 3", "n > 2 and n < 1"))))
    assert true.least == {"early": 2}
    assert true.restarted == {}
    assert true.most == {"late": None}
    assert true.broken == {"early", "late"}
    assert true.asks == {"early", "late", "within"}


def forgetful(*_: object) -> values.Node:
    return values.TRUE


def never(*_: object) -> Waits:
    return Waits(0)


@pytest.mark.parametrize(
    ("place", "fault", "seed"),
    [
        ("rcsc.compose.contract.transition.kept", forgetful, 42),
        ("tests.judge.held.of_all_states", never, 14),
    ],
)
def test_faults_are_noticed(place: str, fault: Callable[..., object], seed: int) -> None:
    with patch(place, fault):
        assert main(["--count", "1", "--seed", str(seed), "--proofs", "1000"]) == 1
    assert main(["--count", "1", "--seed", str(seed), "--proofs", "1000"]) == 0


def test_a_campaign_goes_on_where_another_ended(capsys: pytest.CaptureFixture[str]) -> None:
    for seed, count in ((8, 1), (9, 2), (8, 3)):
        assert main(["--seed", str(seed), "--count", str(count), "--proofs", "100"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.endswith("  states")]
    first, second, both = (int(line.split()[0].replace(",", "")) for line in lines)
    assert first + second == both
