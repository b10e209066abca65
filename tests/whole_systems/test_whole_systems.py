"""Whole systems, proved and run: a short run over every kind, and that a prover with an idea of its own of what may happen is found out."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.compose.contract import claims as of_claims
from rcsc.compose.contract.obligations import Sort
from rcsc.lang.interpret import Fault
from tests.small_hierarchies.level import EARLY
from tests.whole_systems import part as of_part
from tests.whole_systems.drawn import KINDS, drawn
from tests.whole_systems.held import (
    COMPARED,
    COMPARED_BESIDES,
    LEFT_OUT,
    LEFT_OUT_BESIDES,
    everything,
    forget,
    held,
    speaks_of,
)
from tests.whole_systems.part import Event

AGREED = (2, 4, 5, 10, 19, 29, 32, 38, 42, 48, 51, 57, 58)
"""Seeds that show every kind, and are quickly judged."""


@pytest.fixture(autouse=True)
def _nothing_known() -> Iterator[None]:
    forget()
    yield
    forget()


def test_what_is_proved_holds_in_runs_of_the_whole() -> None:
    counts: Counter[str] = Counter()
    found = {seed: held(drawn(seed), seed, counts, most=150) for seed in AGREED}
    assert {seed: apart for seed, apart in found.items() if apart} == {}
    assert counts["claims proved"] > 90
    assert counts["claims broken by some run"] > 30
    for event in Event:
        assert counts[f"event: {event.value[0]}"] > 0, event


def test_a_first_number_keeps_its_name_where_nothing_was_published() -> None:
    """A level that begins anew before its first report says the first number again, which by then has another name."""
    assert held(drawn(1_001_227), 1_001_227, Counter()) == []


def test_every_kind_is_drawn() -> None:
    systems = [drawn(seed) for seed in range(400)]
    kinds = Counter(kind for made in systems for kind in made.kinds)
    assert kinds.keys() == KINDS
    assert min(kinds.values()) > 3
    assert len({made.files for made in systems}) == len(systems)
    assert drawn(7) == drawn(7)
    assert 0.2 < sum(bool(made.slips) for made in systems) / len(systems) < 0.8


def test_every_sort_of_claim_is_compared_or_left_out_for_a_reason() -> None:
    """A sort that is added has to be drawn, held against runs, or excused here."""
    assert set(Sort) == set(COMPARED) | set(LEFT_OUT)
    assert not set(COMPARED) & set(LEFT_OUT)
    assert all(LEFT_OUT.values())
    others = {text for name, text in vars(of_claims).items() if name.isupper() and isinstance(text, str)}
    keys = {one[0] for one in vars(of_claims).values() if isinstance(one, tuple) and len(one) == 3}  # a key
    assert (others | keys) - {
        of_claims.DECLARED,
        of_claims.NEVER_REFUSED,
        of_claims.NOT_FOR_EVER,
        of_claims.IN_RANGE,
    } - set(map(str, Sort)) == COMPARED_BESIDES | LEFT_OUT_BESIDES.keys()


def test_every_fault_is_met_or_left_out_for_a_reason() -> None:
    assert {Fault.OK, Fault.ADMIT, Fault.NO_LINE, Fault.SEVERAL_LINES, *EARLY} == set(
        Fault
    ) - of_part.NEVER.keys()
    assert all(of_part.NEVER.values())
    assert all(of_part.LEFT_OUT.values())


def test_a_sort_that_nobody_compares_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.whole_systems.held.COMPARED", COMPARED - {Sort.ONE_LINE})
    found = held(drawn(10), 10, Counter(), most=5)
    assert [(what, claim) for what, _, claim, _ in found] == [
        ("a claim that nobody compares", str(Sort.ONE_LINE))
    ]


# --- what a prover might leave out ----------------------------------------------------------


ALONE = 'name = "w"\ngenerated = "g"\ntick_ms = 40\n[[level]]\nname = "a"\n[buffers]\n"pl.x" = "a.x"\n"pl.g" = "a.g"\n'
SHOWN = """input x : int 0 .. 2
input g : bool
output o : int 0 .. 3 = 0 safe 3
assume kept monitored : o /= 3
property guarded : o > 0 implies g or x = x
table t assuming kept {
  | line | o      | x || o |
  |------|--------|---||---|
  | up   | 0      | 0 || 1 |
  | on   | 1      |   || 2 |
  | back | 2      |   || 0 |
  | stay | 0      | > 0 || 0 |
}
level a { period 40 [ms] table t }
"""


def test_a_safe_value_that_a_refused_input_shows_is_seen_by_the_next_cycle(tmp_path: Path) -> None:
    found = everything({"system.toml": ALONE, "a.rcs": SHOWN}, tmp_path)
    assert found.whole
    assert {(key, rank) for _, key, rank in found.broken if key[0] in {Sort.SOME_LINE, Sort.ASSUMPTION}} == {
        ((Sort.SOME_LINE, "t", ""), Event.REFUSED.rank),
        ((Sort.ASSUMPTION, "t", "kept"), Event.REFUSED.rank),
        ((Sort.SOME_LINE, "t", ""), Event.EARLY_ANEW.rank),
        ((Sort.ASSUMPTION, "t", "kept"), Event.EARLY_ANEW.rank),
    }


def test_what_a_claim_trusts_is_left_out_and_nothing_else() -> None:
    assert speaks_of(()) == Event.EARLY_ANEW.rank
    assert speaks_of(("`op` keeps to the protocol",)) == Event.EARLY_ANEW.rank
    assert speaks_of((f"`x` of level `a` is {of_claims.NEVER_REFUSED}",)) == Event.ANEW.rank
    assert speaks_of((f"`x` of level `a` is {of_claims.NOT_FOR_EVER}",)) == Event.EARLY_ANEW.rank


def test_links_that_differ_are_drawn_with_both_declarations() -> None:
    differ = [made for made in map(drawn, range(400)) if made.differs]
    assert {made.differs for made in differ} == {"status", "restart", "reason", "stream"}
    for made in differ:
        assert sum("link k" in text for name, text in made.files if name != "words.rcs") > 1
