"""What is required *eventually* of a level: proved, with what it trusts; refuted, by a lasso that is shown, kept and run again."""

import json
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from types import SimpleNamespace

import pytest

from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import NEVER_REFUSED, NOT_FOR_EVER
from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import one_cycle
from rcsc.compose.counterexample.explain import Explanation, TraceSettings
from rcsc.compose.counterexample.lasso import Lasso, waiting_lasso, waiting_lasso_of
from rcsc.compose.counterexample.trace import TraceSearch
from rcsc.compose.exact.circuit import roots_of
from rcsc.compose.exact.shifted import numbers_above
from rcsc.compose.proof.assume_guarantee import of_level
from rcsc.compose.proof.eventually import Try, circuit_of, waiting, waits_of
from rcsc.compose.proof.level import LevelProof, Verdict, certificate, prove_level, proved_bound
from rcsc.compose.proof.system import keep, prove_transition_systems, recall, transition_systems
from rcsc.front.commands import run
from rcsc.front.commands.systems.explained import _no_run
from rcsc.lang.interpret import Fault, holds, initial
from rcsc.lang.model import Value, key_bounds, value_of_key
from rcsc.proof.solvers.smtlib import cvc5_refutes
from tests.support.programs.systems import (
    LITTLE,
    SYSTEM,
    alone,
    small_level,
    small_system,
    small_text,
    solo_system,
)

GIVEN = """\
input asked : int 0 .. 3
output given : bool
state want : bool
state waited : int 0 .. {most}
requirement answers : when asked > 1, eventually given
requirement kept : when want, eventually given
requirement rests : whenever want, eventually not want and asked = 0
table t {{
  | line | asked | want  | waited   || given | waited     | want  |
  |------|-------|-------|----------||-------|------------|-------|
  | wait |       | true  | < {most} || false | waited + 1 | true  |
  | give |       | true  | {most}   || true  | 0          | false |
  | idle | < 2   | false |          || false | 0          | false |
  | take | >= 2  | false |          || false | 0          | true  |
}}
level solo {{ period 40 [ms] table t }}
"""


@cache
def given(most: int) -> tuple[TransitionSystem, LevelProof]:
    """Return the level that gives after so many cycles, and its proof."""
    ts = alone(GIVEN.format(most=most))
    return ts, prove_level(ts, replace(LITTLE, looks=False))


def claim(name: str) -> tuple[Verdict, tuple[str, ...]]:
    """Return the claim about a requirement, and what it trusts."""
    made = dict(of_level(*given(2)))[Sort.REQUIREMENT, "", name]
    return made.verdict, made.trusts


def test_what_comes_is_proved_with_the_fairness_that_it_needs() -> None:
    """A refused input stands as it came: the level does not see that it was asked, so this needs more than that it comes some time."""
    _, proof = given(2)
    assert claim("kept") == (Verdict.PROVED, (f"`asked` of level `solo` is {NOT_FOR_EVER}",))
    assert claim("answers") == (Verdict.PROVED, (f"`asked` of level `solo` is {NEVER_REFUSED}",))
    assert claim("rests") == (Verdict.NOT_PROVED, ())
    assert {bound.name: bound.how.partition(",")[0] for bound in proof.bounds} == {
        "kept": "waits for 3 cycles at most",
        "answers": "waits for 3 cycles at most",
    }


def test_cycles_that_refuse_an_input_do_not_count() -> None:
    """In runs by the interpreter that refuse inputs now and then it waits longer, but not in more cycles that take them."""
    ts, proof = given(2)
    within = next(bound.within.most for bound in proof.bounds if bound.name == "kept" and not bound.admitting)
    random, monitor = Random(0), waiting(ts)["kept"].monitor  # noqa: S311  # the same runs each time
    assert monitor is not None
    waited, taken_since, most, most_taken = 0, 0, 0, 0
    now, found = dict(initial(ts.program)), None
    for _ in range(400):
        step = one_cycle(ts, now, {"asked": random.choice((0, 2, 3, 7, 7))}, (), found)
        now, found = dict(step.after), dict(step.left)
        waits = holds(monitor.waits, step.left)
        waited = waited + 1 if waits else 0
        taken_since = taken_since + (step.fault is Fault.OK) if waits else 0
        most, most_taken = max(most, waited), max(most_taken, taken_since)
    assert most_taken == within < most


def test_a_long_wait_is_proved_and_refuted_by_a_search_of_all_states() -> None:
    ts, proof = given(60)
    assert {bound.name: bound.within.most for bound in proof.bounds} == {"kept": 61, "answers": 61}
    lasso = waiting_lasso(ts, "rests", [TraceSearch(2)])
    assert isinstance(lasso, Lasso)
    assert (len(lasso.trace.steps), lasso.first) == (63, 2)


FILLS = """\
input step : int {least} .. 1000 clamp
input asked : bool
output given : bool
state want : bool
state total : int 0 .. 60000
requirement kept : when want, eventually given
module add reads step, total writes total {{ total := min(total + step, 60000) }}
module clear writes total {{ total := 0 }}
table t {{
  | line | asked | want  | total    || given | want  | procedures |
  |------|-------|-------|----------||-------|-------|------------|
  | wait |       | true  | < 60000  || false | true  | add        |
  | give |       | true  | >= 60000 || true  | false | clear      |
  | idle | false | false |          || false | false |            |
  | take | true  | false |          || false | true  |            |
}}
level solo {{ period 40 [ms] table t }}
"""


def test_a_number_that_only_rises_shows_that_it_comes() -> None:
    """Its states are too many to be listed, and no bound is small."""
    ts = alone(FILLS.format(least=1))
    proof = prove_level(ts, LITTLE)
    [bound] = proof.bounds
    assert proof.verdict(Sort.REQUIREMENT, "", "kept") is Verdict.PROVED
    assert bound.how == "waits for 1 cycle at most in which `total` does not rise"


def test_a_number_that_may_stand_shows_nothing() -> None:
    ts = alone(FILLS.format(least=0))
    assert prove_level(ts, LITTLE).bounds == ()
    lasso = waiting_lasso(ts, "kept", [TraceSearch(4)])
    assert isinstance(lasso, Lasso)
    assert [step.line for step in lasso.trace.steps[lasso.first - 1 :]] == ["wait"]


MEASURES = """\
input asked : bool
output given : bool
state want : bool
state y : int 0 .. 3
requirement kept : when want, eventually given
requirement read : when want, eventually y = 2
extern procedure measure reads want writes y python "m:f" c "m_f"
table t {
  | line | asked | want  || given | want  | procedures |
  |------|-------|-------||-------|-------|------------|
  | give |       | true  || true  | false | measure    |
  | idle | false | false || false | false |            |
  | take | true  | false || false | true  |            |
}
level solo { period 40 [ms] table t }
"""


def test_results_that_are_refused_now_and_then_put_it_off() -> None:
    """What an extern procedure gives is no input: nothing is listed, and its values may be any."""
    ts = alone(MEASURES)
    proof = prove_level(ts, replace(LITTLE, looks=False))
    claims = dict(of_level(ts, proof))
    made = claims[Sort.REQUIREMENT, "", "kept"]
    assert (made.verdict, made.trusts) == (
        Verdict.PROVED,
        (f"extern procedures of level `solo` are {NOT_FOR_EVER}",),
    )
    assert claims[Sort.REQUIREMENT, "", "read"].verdict is Verdict.NOT_PROVED
    assert isinstance(waiting_lasso(ts, "read", [TraceSearch(4)]), Lasso)


# --- beside others ------------------------------------------------------------------------------

ENDS = "\nrequirement ends : whenever report.status_report = executing, eventually {}\n"
AGAIN = "report.status_report /= executing or new_command"


def test_a_level_answers_if_its_subordinates_do(tmp_path: Path) -> None:
    """The claim rests on the termination of the level below."""
    upper = small_text("upper") + ENDS.format(AGAIN)
    systems = transition_systems(small_system(tmp_path, upper=upper))
    proof = prove_transition_systems(systems, LITTLE, 1, tuple(systems))
    level = next(level for level in proof.levels if level.level == "upper")
    [bound] = level.bounds
    assert bound.within.fair
    needs = dict(of_level(systems["upper"], level))[Sort.REQUIREMENT, "", "ends"].rests_on
    assert {name for name, _ in needs} == {"upper", "lower"}
    # the lower one waits for an input of its own, for ever: so this is not proved of the system
    assert not proof.of("upper", (Sort.REQUIREMENT, "", "ends")).proved


def test_a_lasso_gives_orders_or_has_answers(tmp_path: Path) -> None:
    """That a subordinate does not answer refutes nothing: what fails does not come to be done."""
    upper = small_text("upper") + ENDS.format("report.status_report = done or new_command")
    ts = small_level(tmp_path, "upper", upper=upper)
    quick = replace(LITTLE, looks=False)
    assert proved_bound(ts, waiting(ts)["ends"], Try(4, fair=True), quick).open
    lasso = waiting_lasso(ts, "ends", [TraceSearch(8, legal=True)])
    assert isinstance(lasso, Lasso)
    [step] = lasso.trace.steps[lasso.first - 1 :]
    assert step.after["lower.status_report"] != step.after["report.status_report"] == 2


REPLACED = """
requirement ends : whenever report.status_report = executing, eventually report.status_report = done or not there
"""
TAKES = (
    "new_command := command.inc_command /= inc_command_seen\n  inc_command_seen := command.inc_command",
    "new_command := command.inc_command {}\n  if command.inc_command {} {{ inc_command_seen := command.inc_command }}",
)


def taking(folder: Path, which: str) -> TransitionSystem:
    """Return the lower level that takes only some numbers of orders for new ones."""
    taken = TAKES[0], TAKES[1].format(which, which)
    return small_level(folder, "lower", lower=small_text("lower", taken) + REPLACED)


def test_new_orders_for_ever_are_a_lasso_whose_numbers_go_on(tmp_path: Path) -> None:
    """Only the next number is a new order: no state comes again before 65536 of them."""
    ts = taking(tmp_path, "= (inc_command_seen + 1) mod 65536")
    for search in (TraceSearch(4, legal=True), TraceSearch(4)):
        lasso = waiting_lasso(ts, "ends", [search])
        assert isinstance(lasso, Lasso)
        assert [step.taken["command.inc_command"] for step in lasso.trace.steps] == [1, 2]
        assert lasso.first == 2
        assert waiting_lasso_of(ts, "ends", lasso.trace.steps) == 2
    made = circuit_of(ts, waiting(ts)["ends"])
    assert made is not None
    found = waits_of(made).lasso  # by clauses, which need no such limit
    assert found is not None
    assert (found.first, len(found.run.given)) == (2, 2)


@pytest.mark.parametrize(
    "which",
    [
        "/= inc_command_seen and command.inc_command mod 2 = 1",
        "/= inc_command_seen and command.inc_command /= 3",
        "> inc_command_seen",
        "= (inc_command_seen * 2 + 1) mod 65536",
        "= (inc_command_seen + 1) mod 65535",
    ],
)
def test_numbers_that_are_told_apart_do_not_go_on(which: str, tmp_path: Path) -> None:
    assert ordered(taking(tmp_path, which)) == set()


READS = ("receive reads command,", "receive reads there, command,")
ODD = "odd := command.inc_command mod 2 = 1\n  new_command :="


@pytest.mark.parametrize(
    ("edits", "stated"),
    [
        (
            (
                READS,
                (
                    TAKES[0],
                    "if there { inc_command_seen := 0 } else { inc_command_seen := command.inc_command }",
                ),
            ),
            "",
        ),
        (
            (
                READS,
                (
                    TAKES[0],
                    "if there { inc_command_seen := command.inc_command } else { inc_command_seen := 0 }",
                ),
            ),
            "",
        ),
        ((), "property odd : command.inc_command mod 2 = 1 or there"),
        (
            (
                ("state new_command : bool", "state new_command : bool\nstate odd : bool"),
                ("writes new_command,", "writes odd, new_command,"),
                ("new_command :=", ODD),
            ),
            "property was_odd : was odd or there",
        ),
    ],
)
def test_numbers_that_are_told_apart_anywhere_do_not_go_on(
    edits: tuple[tuple[str, str], ...], stated: str, tmp_path: Path
) -> None:
    """By what they are set to, by what is asked of a cycle alone, or by what another state keeps of them."""
    text = small_text("lower", *edits) + f"\n{stated}\n"
    assert ordered(small_level(tmp_path, "lower", lower=text)) == set()


def ordered(ts: TransitionSystem) -> frozenset[str]:
    """Return the leaves whose numbers may go on, of all that its obligations depend on."""
    step = ts.cycle(ts.havoc())
    leaves, nodes = roots_of(step, obligations(ts, step))
    return numbers_above(ts, step, leaves, nodes)


@pytest.mark.parametrize("level", ["lower", "upper"])
def test_a_cycle_goes_likewise_where_numbers_are_later(level: str) -> None:
    """On the interpreter: from any state and inputs, with all numbers later by as much."""
    ts, random = transition_systems(SYSTEM)[level], Random(5)  # noqa: S311  # the same each time
    numbers = ordered(ts)
    assert numbers == {"command.inc_command", "inc_command_seen", "report.inc_command_echo"}
    for _ in range(200):
        before, other = ({leaf: any_of(ts, leaf, random) for leaf in ts.program.kinds} for _ in range(2))
        by = random.choice((1, 2, 65535, random.randrange(65536)))
        taken = {leaf: other[leaf] for leaf in ts.inputs}
        now = one_cycle(ts, before, taken)
        then = one_cycle(ts, moved(before, numbers, by), moved(taken, numbers, by))
        assert (now.fault, now.line) == (then.fault, then.line)
        assert moved(now.after, numbers, by) == then.after


def any_of(ts: TransitionSystem, leaf: str, random: Random) -> Value:
    low, high = key_bounds(ts.kinds[leaf])
    return value_of_key(ts.kinds[leaf], random.choice((low, high, random.randint(low, min(high, low + 3)))))


def moved(leaves: Mapping[str, Value], numbers: Collection[str], by: int) -> dict[str, Value]:
    """Return the leaves with the numbers later by as much."""
    return {leaf: (int(value) + by) % 65536 if leaf in numbers else value for leaf, value in leaves.items()}


# --- shown, kept, run again ------------------------------------------------------------------------


def test_a_lasso_is_shown_drawn_and_frozen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, found, cases = solo_system(tmp_path, GIVEN.format(most=2)), tmp_path / "found", tmp_path / "cases"
    assert run(["prove", str(path), "--log", str(found), "--freeze", str(cases), "--no-cache"]) == 1
    said = capsys.readouterr()
    assert "waits for 3 cycles at most, by search of all" in said.out
    assert (
        "waits for ever, cycles 2 to 5 again and again, as the interpreter, the Python and the C executors run it"
        in said.err
    )
    assert "! from here on cycles 2 to 5 again" in said.err
    assert "`rests` waits as it did before cycle 2" in said.err
    [case] = cases.iterdir()
    assert run(["prove", "--case", str(case)]) == 1
    text = path.with_name("solo.rcs").read_text(encoding="utf-8")
    path.with_name("solo.rcs").write_text(
        text.replace("not want and asked = 0", "not want"), encoding="utf-8"
    )
    assert run(["prove", "--case", str(case)]) == 0


def test_a_lasso_is_part_of_the_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = solo_system(tmp_path, GIVEN.format(most=2))
    assert run(["prove", str(path), "--json", "--no-cache"]) == 1
    [finding] = json.loads(capsys.readouterr().out)["findings"]
    assert (finding["name"], finding["lap"], len(finding["time_line"])) == ("rests", 2, 5)


def test_a_run_that_does_not_come_round_is_no_lasso() -> None:
    ts = alone(GIVEN.format(most=2))
    lasso = waiting_lasso(ts, "rests", [TraceSearch(6)])
    assert isinstance(lasso, Lasso)
    steps = lasso.trace.steps
    assert waiting_lasso_of(ts, "rests", steps) == lasso.first
    assert waiting_lasso_of(ts, "rests", steps[:-1]) is None
    assert waiting_lasso_of(ts, "kept", steps) is None


def test_bounds_are_kept_and_recalled(tmp_path: Path) -> None:
    (ts, proof), kept_in = given(2), Cache(tmp_path, b"0" * 32, "tool")
    keep(kept_in, ts, LITTLE, proof)
    kept = recall(kept_in, ts, LITTLE)
    assert kept is not None
    assert [(owed.key, verdict) for owed, verdict in kept.verdicts] == [
        (owed.key, verdict) for owed, verdict in proof.verdicts
    ]
    assert [(bound.name, bound.within, bound.admitting, bound.how) for bound in kept.bounds] == [
        (bound.name, bound.within, bound.admitting, bound.how) for bound in proof.bounds
    ]
    assert certificate(ts, kept).keys() == certificate(ts, proof).keys()


def test_a_bound_of_another_version_is_not_recalled(tmp_path: Path) -> None:
    """Then the level is proved anew: what waits for ever is never taken for proved."""
    (ts, proof), kept_in = given(2), Cache(tmp_path, b"0" * 32, "tool")
    renamed = tuple(replace(bound, name="answered") for bound in proof.bounds)
    keep(kept_in, ts, LITTLE, replace(proof, bounds=renamed))
    assert recall(kept_in, ts, LITTLE) is None
    keep(kept_in, ts, LITTLE, replace(proof, bounds=()))
    kept = recall(kept_in, ts, LITTLE)
    assert kept is not None
    assert kept.verdict(Sort.REQUIREMENT, "", "kept") is Verdict.NOT_PROVED


def test_cvc5_confirms_each_bound() -> None:
    scripts = certificate(*given(2))
    asked = {name: text for name, text in scripts.items() if name.startswith("requirement ")}
    assert {name.split()[1] for name in asked} == {"answers", "kept"}
    assert all(cvc5_refutes(text) for text in asked.values())


def test_an_export_says_what_it_leaves_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run(
            [
                "prove",
                str(solo_system(tmp_path, GIVEN.format(most=2))),
                "--export",
                "btor2",
                str(tmp_path / "to"),
            ]
        )
        == 0
    )
    assert "of `kept` only what a cycle breaks; not that it never waits for ever" in capsys.readouterr().out


def test_what_was_looked_at_is_told_of_what_is_open() -> None:
    ts, proof = given(2)
    said = {
        owed.name: _no_run(ts, Explanation("solo", owed), TraceSettings(SimpleNamespace(), 8))  # type: ignore[arg-type]  # not read
        for owed, _ in proof.verdicts
    }
    assert said["rests"].startswith(
        "no run of 8 cycles or fewer breaks it, or comes round while it waits: all of them"
    )
    assert said[""].startswith("no run of 8 cycles or fewer breaks it: all of them")


@pytest.mark.parametrize(
    ("within", "said"),
    [
        (Try(0), "never waits"),
        (Try(1), "waits for 1 cycle at most"),
        (Try(2, fair=True), "waits for 2 rounds of orders and answers at most"),
        (Try(0, rank="n"), "waits for no cycle in which `n` does not rise"),
        (Try(4, rank="n", rises=False), "waits for 4 cycles at most in which `n` does not fall"),
    ],
)
def test_a_bound_is_said_in_words(within: Try, said: str) -> None:
    assert within.shown == said
