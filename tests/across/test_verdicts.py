"""What a verdict on a requirement across levels trusts and rests on, what is kept of it, and when it is asked anew: in milliseconds."""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import cast
from unittest.mock import patch

import pytest

from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import RUNS, Closed, Verdict
from rcsc.compose.counterexample.cycle_run import CycleRun, StageRun
from rcsc.compose.exact.eventual import Waits
from rcsc.compose.proof.level import NotConfirmedError
from rcsc.compose.together.eventually import ANSWERS, COMES_TO_AN_END, bounds, waits_for
from rcsc.compose.together.kept import answered, recalled
from rcsc.compose.together.product import EVERY, LATE, Surroundings, Timing
from rcsc.compose.together.proof import NEVER_LATE, NO_RESTART, Across, Question
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Int
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.symbolic import values
from rcsc.run.description import Wire
from tests.across.judge.drawn import Drawn, drawn, written
from tests.across.judge.held import System

_LEVEL = """\
input x : bool
input y : int 0 .. 2
output o : bool safe false
table of_NAME {
  | line | x     || o     |
  |------|-------||-------|
  | on   | true  || false |
  | off  | false || true  |
}
level NAME { period 10 [ms] table of_NAME }
"""
_BOSS = """\
use words
commands hand : motions
enum stage { home, out }
input wish : bool
state at : stage restart home
output busy : bool safe false
table lead {
  | line | at   | wish  | hand.resting | hand.status || at   | hand  | busy  |
  |------|------|-------|--------------|-------------||------|-------|-------|
  | go   | home | true  | true         |             || out  | go    | true  |
  | wait | home | true  | false        |             || home | pause | false |
  | calm | home | false |              |             || home | pause | false |
  | busy | out  |       |              | executing   || out  |       | true  |
  | back | out  |       |              | done        || home | pause | false |
  | fail | out  |       |              | failed      || home | pause | false |
}
level boss { period 10 [ms] table lead }
"""
_TEXTS = {
    "rcsc.toml": 'name = "drawn"\n',
    "requirements.rcs": "assume calm assumed : never plant.y = 2\nproperty p : a.o or b.o or plant.y < 2\n"
    "property q : a.o\nproperty r : a.o /= a.x\n",
    **{f"{name}.rcs": _LEVEL.replace("NAME", name) for name in "ab"},
}
_WIRES = {"a.o": ["b.x"], "b.o": ["a.x"], "plant.y": ["a.y", "b.y"]}
_MADE = Drawn({"a": "a", "b": "b"}, _WIRES, 1, _TEXTS)


@pytest.fixture
def question(tmp_path: Path) -> Question:
    it = System.of(written(_MADE, tmp_path))
    return Question(it.systems, it.description, it.program, it.program.properties[0])


def _proved(question: Question, **rest: object) -> Across:
    found = Across(question.stated, proved=True, levels=("a", "b"), late=1, timing=Timing.LATE)
    return replace(found, **rest)  # type: ignore[arg-type]  # of each its own


def test_a_verdict_trusts_what_is_kinder_than_what_may_befall_the_levels(question: Question) -> None:
    def trusts(**rest: object) -> tuple[str, ...]:
        return _proved(question, **rest).trusts(question.systems)

    assert trusts() == ()
    assert trusts(assumed=("calm",)) == ("assumption `calm` across levels, as it is declared",)
    assert trusts(around=Surroundings(restarts=False)) == (NO_RESTART,)
    assert trusts(timing=Timing.SCHEDULED) == (NEVER_LATE,)
    assert trusts(fair=("it comes",)) == ("it comes",)
    refused = trusts(around=Surroundings(refuses=False))
    assert len(refused) == 2
    assert all("never refused" in said for said in refused)


def test_it_is_kinder_where_less_befalls_the_levels_than_may(question: Question) -> None:
    assert not _proved(question).kinder
    assert not _proved(question, late=0, timing=Timing.SCHEDULED).kinder
    assert all(_proved(question, around=around).kinder for around in EVERY[1:])
    assert _proved(question, timing=Timing.SCHEDULED).kinder
    assert not _proved(question, proved=False, timing=Timing.SCHEDULED).kinder


def test_it_rests_on_what_each_level_does_and_lacks_what_is_not_accepted(question: Question) -> None:
    found = _proved(question, fair=("it comes",))
    assert found.closed(question.systems, {}).lacks == (("a", RUNS), ("b", RUNS))
    claims = {
        ("a", RUNS): Closed(Verdict.PROVED, trusts=("something",)),
        ("b", RUNS): Closed(Verdict.PROVED, lacks=(("c", RUNS),)),
    }
    closed = found.closed(question.systems, claims)
    assert closed == Closed(Verdict.PROVED, (("c", RUNS),), ("it comes", "something"))
    assert replace(found, proved=False).closed(question.systems, claims).verdict is Verdict.NOT_PROVED


def test_a_run_breaks_it_in_its_last_tick_and_refutes_it_where_it_is_not_proved(question: Question) -> None:
    run: tuple[dict[str, CycleRun], ...] = ({}, {}, {})
    assert not _proved(question, run=run).refuted
    assert _proved(question, run=run, proved=False).refuted
    assert not _proved(question, proved=False).refuted


# --- what comes --------------------------------------------------------------------------------


def test_bounds_are_tried_where_something_speaks_for_them() -> None:
    assert bounds(Waits(3, complete=True)) == (3,)
    assert bounds(Waits(3, cycles=9, complete=False)) == (3, 6, 12)
    assert bounds(Waits(3, cycles=3, complete=False)) == ()


@pytest.mark.parametrize(
    ("most", "fair", "said"),
    [
        (0, False, "never waits"),
        (1, False, "waits for at most 1 calm tick"),
        (2, False, "waits for at most 2 calm ticks"),
        (1, True, "waits for at most 1 round of orders and answers"),
        (4, True, "waits for at most 4 rounds of orders and answers"),
    ],
)
def test_for_how_long_it_waits_is_said(most: int, fair: bool, said: str) -> None:
    assert waits_for(most, fair=fair) == said


# --- what is kept ------------------------------------------------------------------------------


class _Answering:
    """A question that counts how often it is asked."""

    asked = 0

    def __init__(self, question: Question, found: Across) -> None:
        self.question, self.found = question, found

    def __getattr__(self, name: str) -> object:
        return getattr(self.question, name)

    def answer(self) -> Across:
        self.asked += 1
        return self.found


_TICK = {
    "b": CycleRun(
        {"x": 1, "y": True, "z": 0.5}, "of_b", "", Fault.ADMIT, ("calm",), {"m": False}, {"m": True}, ("r0",),
        (("far", (1.0, 2)),), (StageRun("before", "r1"),), True, {"count": 1}, {"count": 2},
    )
}  # fmt: skip


def _full(question: Question, **rest: object) -> Across:
    """Return an answer of which nothing is as it is by default."""
    return _proved(
        question, levels=("b",), by="somehow", around=EVERY[3], run_late=({"b.x": 1},), looked=5, vacuous=True,
        assumed=("calm",), lasso=2, fair=("it comes",), stuck=True, run=(_TICK,), broken_in=EVERY[1], **rest,
    )  # fmt: skip


def test_a_proof_is_kept_with_all_that_is_said_of_it(question: Question, tmp_path: Path) -> None:
    cache = Cache(tmp_path / "kept", b"secret", "tool")
    asked = _Answering(question, _full(question))
    assert recalled(question, cache) is None
    assert answered(cast(Question, asked), cache) == asked.found
    kept = answered(cast(Question, asked), cache)
    assert asked.asked == 1
    assert kept == asked.found
    assert kept.run[0]["b"].fault is Fault.ADMIT


def test_what_is_not_proved_is_kept_with_its_run(question: Question, tmp_path: Path) -> None:
    cache = Cache(tmp_path / "kept", b"secret", "tool")
    asked = _Answering(question, replace(_full(question), proved=False))
    for _ in range(2):
        assert answered(cast(Question, asked), cache) == asked.found
    assert asked.asked == 1


def test_what_is_open_is_asked_again(question: Question, tmp_path: Path) -> None:
    cache = Cache(tmp_path / "kept", b"secret", "tool")
    asked = _Answering(question, replace(_full(question), proved=False, run=(), broken_in=None))
    for times in (1, 2):
        assert answered(cast(Question, asked), cache) == asked.found
        assert asked.asked == times
    assert answered(cast(Question, asked), None) == asked.found


def _with_program(old: str, new: str, folder: Path) -> Question:
    """Return the question of a system with another text."""
    folder.mkdir()
    texts = {name: text.replace(old, new) for name, text in _TEXTS.items()}
    it = System.of(written(replace(_MADE, texts=texts), folder))
    return Question(it.systems, it.description, it.program, it.program.properties[0])


@pytest.mark.parametrize(
    "other",
    [
        lambda question, _: replace(question, stated=question.program.properties[1]),
        lambda question, _: replace(question, system=replace(question.system, late_ticks=2)),
        lambda question, _: replace(question, system=replace(question.system, tick_ms=5)),
        lambda question, _: replace(question, program=replace(question.program, environment=())),
        lambda question, _: replace(
            question,
            system=replace(
                question.system,
                wires=tuple(
                    Wire(w.source.replace("a.o", "plant.o"), w.target) for w in question.system.wires
                ),
            ),
        ),
        lambda _, folder: _with_program("safe false", "safe true", folder / "b"),
        lambda _, folder: _with_program("period 10", "period 20", folder / "b"),
    ],
    ids=["requirement", "late", "tick", "assumption", "wire", "level", "period"],
)
def test_what_a_verdict_depends_on_has_it_asked_anew(
    other: Callable[[Question, Path], Question], question: Question, tmp_path: Path
) -> None:
    cache = Cache(tmp_path / "kept", b"secret", "tool")
    answered(cast(Question, _Answering(question, _full(question))), cache)
    assert recalled(question, cache) is not None
    assert recalled(other(question, tmp_path), cache) is None


def test_words_beside_a_requirement_do_not(question: Question, tmp_path: Path) -> None:
    cache = Cache(tmp_path / "kept", b"secret", "tool")
    answered(cast(Question, _Answering(question, _full(question))), cache)
    assert recalled(replace(question, stated=replace(question.stated, doc="Other words.")), cache) is not None


# --- what is assumed, and who is to answer -----------------------------------------------------


@pytest.mark.parametrize(
    ("assumed", "proved"),
    [(("2",), True), ((), False), (("0", "1", "2"), False)],
    ids=["it can be kept", "nothing", "nothing keeps it"],
)
def test_what_is_assumed_proves_something_where_it_can_be_kept(
    assumed: tuple[str, ...], proved: bool, tmp_path: Path
) -> None:
    never = "".join(f"assume no_{value} assumed : never plant.y = {value}\n" for value in assumed)
    texts = {**_TEXTS, "requirements.rcs": never + "property p : a.y < 2\n"}
    it = System.of(written(replace(_MADE, late=0, texts=texts), tmp_path))
    found = Question(it.systems, it.description, it.program, it.program.properties[0]).verdict(soon=True)
    assert (found.proved, found.stuck) == (proved, len(assumed) == 3)
    assert found.assumed == tuple(f"no_{value}" for value in assumed)


def test_what_waits_for_a_party_outside_is_counted_in_rounds_and_trusts_that_it_answers(
    tmp_path: Path,
) -> None:
    texts = {
        **_TEXTS,
        "words.rcs": drawn(0).texts["words.rcs"],
        "boss.rcs": _BOSS,
        "requirements.rcs": "requirement ends : when boss.busy, eventually not boss.busy\n",
    }
    it = System.of(written(Drawn({"boss": "boss"}, {"plant.wish": ["boss.wish"]}, 0, texts), tmp_path))
    found = Question(it.systems, it.description, it.program, it.program.properties[0]).verdict()
    assert found.proved
    assert found.fair == (COMES_TO_AN_END, ANSWERS.format("hand"))
    assert found.by == "waits for at most 1 round of orders and answers"


# --- what is not confirmed ---------------------------------------------------------------------


def _alone(question: Question) -> Question:
    """Return a question about what a level keeps, where nothing is assumed."""
    program = replace(question.program, environment=())
    return replace(question, program=program, stated=program.properties[2])


@pytest.mark.parametrize("error", [GaveUpError(), NotConfirmedError("it does not follow")])
@pytest.mark.parametrize("of", ["property", "assumption"])
def test_nothing_is_proved_that_z3_does_not_confirm(error: Exception, of: str, question: Question) -> None:
    if of == "property":
        question = _alone(question)
    with patch("rcsc.compose.together.proof.confirm_owed", side_effect=error):
        found = question.verdict(soon=True)
    assert not found.proved
    assert found.stuck is (of == "assumption")


def test_a_search_that_is_given_up_proves_nothing(question: Question) -> None:
    alone = _alone(question)
    assert alone.verdict(soon=True).proved
    with patch("rcsc.compose.together.proof.PDR.search", side_effect=GaveUpError):
        assert not alone.verdict(soon=True).proved


def test_no_reader_sees_what_is_older_than_it_has_seen(question: Question) -> None:
    late = replace(question, system=replace(question.system, late_ticks=2))
    ts = late.together(("a", "b"), Timing.LATE, EVERY[0])
    kind = Int(0, 2)
    for then, now in product(range(3), repeat=2):
        before = {f"{LATE} b.x": values.constant(kind, then)}
        allowed = ts._never_back(before, {"b.x": values.constant(kind, now)})
        assert (allowed is values.TRUE) == (now <= then + 1)


# --- which levels ------------------------------------------------------------------------------


def test_a_question_is_about_the_levels_that_it_names_and_those_that_write_to_them(
    question: Question,
) -> None:
    alone = replace(question, stated=question.program.properties[1])
    assert alone._named() == ("a",)
    assert alone.every == ("a", "b")
    assert [*alone._parts()] == [
        (Timing.ANY, ("a",)), (Timing.LATE, ("a",)), (Timing.LATE, ("a", "b")), (Timing.SCHEDULED, ("a",)),
        (Timing.SCHEDULED, ("a", "b")),
    ]  # fmt: skip
    assert question._named() == ("a", "b")
    wires = tuple(wire for wire in question.system.wires if wire.target != "a.x")
    cut = replace(alone, system=replace(question.system, wires=wires))
    assert cut.every == ("a",)
    assert [*cut._surroundings()] == [*EVERY]
    systems = {name: SimpleNamespace(refusing=lambda: SimpleNamespace(refuses=False)) for name in "ab"}
    admits = replace(cut, systems=systems)  # type: ignore[arg-type]  # all that is asked of them
    assert [*admits._surroundings()] == [EVERY[0], EVERY[2]]
