"""What is assumed over time of what comes from outside: against every run of drawn levels that keeps it, and where it cannot be trusted."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from unittest.mock import patch

import pytest

from rcsc.base.diagnostics.source import Source
from rcsc.compose.contract import transition, watched
from rcsc.compose.contract.claims import RUNS
from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.walk import Walk
from rcsc.compose.contract.watched import Leaves, Refusals, can_be_kept
from rcsc.compose.counterexample.lasso import Lasso, lassos
from rcsc.compose.counterexample.trace import NotReproducedError, Trace, TraceSearch, trace_of, traces
from rcsc.compose.exact import circuit as circuits
from rcsc.compose.exact import explicit, spacer
from rcsc.compose.exact.bounded import looked
from rcsc.compose.exact.circuit import circuit
from rcsc.compose.exact.played import every_run
from rcsc.compose.exact.spacer import Lemmas, related
from rcsc.compose.proof.assume_guarantee import of_level
from rcsc.compose.proof.level import LevelProof, Verdict, certificate, prove_level
from rcsc.front.commands import run as rcsc
from rcsc.lang.model import Program
from rcsc.lang.over_time import Watch
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.proof.solvers.smt import Answer
from rcsc.proof.symbolic import values
from tests.over_time.environments import Truth, drawn, truth
from tests.support.programs.stages import program_of, refused
from tests.support.programs.systems import LITTLE, alone, small_level, small_system, small_text, solo_system

# --- what is written ---------------------------------------------------------------------------

CALLED_SO = """\
input on : bool
input next : bool
input at : bool
input always : bool
input off : int 0 .. 5
state before : int 0 .. 3
"""
ONE_CYCLE = (
    "on implies next", "next and not at", "always or on", "off > 3 or before = 0", "on for 20 [ms]", "next", "off - 1 > 2",
    "next not in { true }", "before = 2", "at xor on", "not always",
)  # fmt: skip
OVER_TIME = (
    "next at", "always (on or at)", "before on, always at", "on for at least 3 cycles, at", "at least 20 [ms] apart, next", "at once on",
    "at most 2 times in 5 cycles, on", "while on, never at", "when before = 2, within 3 cycles, not on", "only after on, (next)",
    "never not on", "until on, at", "for 2 cycles, at", "exactly after 2 cycles, at", "between on and at, eventually next",
    "always was at", "only while on, next at", "whenever\n  on, at once at",
)  # fmt: skip


@pytest.mark.parametrize("head", ["", " assumed", " assumed monitored", ' assumed req "R-1"'])
def test_an_assumption_is_over_time_where_a_timing_stands_and_of_a_cycle_where_a_variable_is_called_so(
    head: str,
) -> None:
    for says in (*ONE_CYCLE, *OVER_TIME):
        text = f"{CALLED_SO}assume it{head} : {says}\n"
        parsed = parse(Source("case.rcs", text))
        assert isinstance(parsed, tree.File), says
        declared = parsed.declarations[-1]
        assert isinstance(declared, tree.RequirementDecl) == (says in OVER_TIME), says
        again = parse(Source("case.rcs", format_file(parsed)))
        assert isinstance(again, tree.File)
        assert format_file(again) == format_file(parsed)
        assert f"assume it{head} : " in format_file(parsed)


LEVEL = """\
input asks : bool
input rolls : bool
input turns : int 0 .. 100
output speed : int 0 .. 100
{}
table t {{
  | line | asks  | rolls || speed |
  |------|-------|-------||-------|
  | go   | true  |       || 10    |
  | stop | false | true  || 0     |
  | rest | false | false || 0     |
}}
level l {{ period 10 [ms] table t }}
"""


@pytest.mark.parametrize(
    ("says", "code", "message"),
    [
        (": always speed = 0", "RCS324", "`speed = 0` is about no input: nothing from outside can keep it"),
        (": when asks, within 3 cycles, once speed > 0", "RCS324", "`once speed > 0` is about no input: nothing from outside can keep it"),
        ("monitored : always asks", "RCS324", "an assumption over time is trusted: nothing shows that it is `monitored`"),
        ("proved : always asks", "RCS324", "an assumption over time is trusted: nothing shows that it is `proved`"),
        (": when asks, eventually rolls", "RCS324", "an assumption needs a bound: what `eventually` asks for may always still come"),
        (": whenever was speed = 0, at once rolls", "RCS315", "`was` goes back one cycle, not two"),
    ],
)  # fmt: skip
def test_what_is_no_assumption_over_time_is_told(says: str, code: str, message: str) -> None:
    [found] = refused(LEVEL.format(f"assume it {says}"))
    assert (found.code, found.message) == (code, message)


def test_no_table_names_it() -> None:
    text = LEVEL.format("assume it : always rolls").replace("table t {", "table t assuming it {")
    [found] = refused(text)
    assert (found.code, found.message) == (
        "RCS324",
        "assumption `it` is over time: it is of the whole level, and no table names it",
    )


def test_it_is_no_claim_and_stands_where_assumptions_do() -> None:
    program = program_of(
        LEVEL.format("assume it assumed monitored : always rolls\nrequirement r : always asks")
    )
    assert [one.name for one in program.environment] == ["it"]
    assert [one.name for one in program.properties] == ["r"]
    assert program.environment[0].word == "assumption"
    assert program.environment[0].monitored


def test_what_the_level_writes_is_what_the_cycle_before_left() -> None:
    """Whether a cycle is as assumed does not depend on what the level does in it."""
    [stated] = program_of(LEVEL.format("assume it : whenever speed = 0, at once not rolls")).environment
    watch = Watch(stated)
    moves, stands = ({"speed": speed, "rolls": True} for speed in (10, 0))
    assert watch.keeps(moves, stands)
    assert not watch.keeps(stands, moves)


def test_a_condition_may_look_back_further_at_what_the_level_writes() -> None:
    said = "assume it : whenever was (speed = 0) and speed = 0, at once not rolls"
    [stated] = program_of(LEVEL.format(said)).environment
    watch = Watch(stated)
    moves, stands = ({"speed": speed, "rolls": True} for speed in (10, 0))
    assert [watch.keeps(*pair) for pair in ((moves, stands), (stands, stands), (stands, moves))] == [
        True,
        True,
        False,
    ]


# --- what is proved ----------------------------------------------------------------------------

SEEDS = (3, 4, 12, 17, 20, 39)
"""Drawn levels: of some an assumption cannot always be kept."""


@cache
def judged(seed: int) -> tuple[TransitionSystem, Truth]:
    ts = alone(drawn(seed))
    return ts, truth(ts)


def required(ts: TransitionSystem) -> list[Obligation]:
    return [owed for owed in obligations(ts, ts.cycle(ts.havoc())) if owed.sort is Sort.REQUIREMENT]


def agrees(ts: TransitionSystem, true: Truth) -> None:
    """Hold the search of all states and bounded search against the judge, from the first cycle and after a restart."""
    wanted = required(ts)
    made = circuit(ts, tuple(ts.firsts().values()), ts.cycle(ts.havoc()), wanted)
    every = {key[2]: len(run.given) for key, run in explicit.explored(made).runs.items()}
    assert every == {**true.restarted, **true.least}
    short = {key[2]: len(run.given) for key, run in looked(made, 4).runs.items()}
    least = {**true.restarted, **true.least}
    for name in set(true.restarted) & set(true.least):
        least[name] = min(true.restarted[name], true.least[name])
    assert short == {name: cycles for name, cycles in least.items() if cycles <= 4}


def spacer_agrees(ts: TransitionSystem, true: Truth) -> None:
    step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    for owed in required(ts):
        answer, _ = related(ts, firsts, step, owed, Lemmas(), 4_000_000)
        breaks = owed.name in true.least or owed.name in true.restarted
        assert answer in {Answer.UNKNOWN, Answer.SATISFIABLE if breaks else Answer.UNSATISFIABLE}


def proof_agrees(ts: TransitionSystem, true: Truth) -> None:
    proof = prove_level(ts, LITTLE)
    good = {owed.name for owed, verdict in proof.verdicts if verdict is Verdict.PROVED}
    names = {stated.name for stated in ts.program.properties}
    assert good & names == names.difference(true.least, true.restarted)
    assert {one.name for one in ts.program.environment} <= good or true.ends
    assert not (true.ends and {one.name for one in ts.program.environment} <= good)


def runs_agree(ts: TransitionSystem, true: Truth) -> None:
    found = traces(ts, required(ts), TraceSearch(4))
    lengths = {key[2]: len(trace.steps) for key, trace in found.items() if isinstance(trace, Trace)}
    assert lengths == {name: cycles for name, cycles in true.least.items() if cycles <= 4}


@pytest.mark.parametrize("engine", [agrees, spacer_agrees, proof_agrees, runs_agree])
@pytest.mark.parametrize("seed", SEEDS)
def test_each_engine_says_what_is_true_of_the_runs_that_are_as_assumed(
    seed: int, engine: Callable[[TransitionSystem, Truth], None]
) -> None:
    engine(*judged(seed))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(20, 220))
def test_each_engine_says_so_of_many_levels(seed: int) -> None:
    for engine in (agrees, spacer_agrees, proof_agrees, runs_agree):
        engine(*judged(seed))


def test_the_drawn_levels_are_worth_it() -> None:
    every = [judged(seed) for seed in SEEDS]
    assert any(true.ends for _, true in every)
    assert any(not true.ends for _, true in every)
    assert max(max(true.least.values(), default=0) for _, true in every) > 2
    assert max(true.states for _, true in every) > 30
    free = [truth(ts.of(replace(ts.program, environment=()))) for ts, _ in every]
    assert sum(len(one.least) > len(true.least) for one, (_, true) in zip(free, every, strict=True)) > 1


def test_a_run_that_breaks_what_is_assumed_is_not_believed() -> None:
    """Whatever an engine finds is held against the interpreter, and against the assumptions."""
    ts = alone(LEVEL.format("assume a : never rolls\nrequirement r : never rolls"))
    free = ts.of(replace(ts.program, environment=()))
    [owed] = [one for one in obligations(free, free.cycle(free.havoc())) if one.sort is Sort.REQUIREMENT]
    every = every_run(free, tuple(free.firsts().values()), [owed])
    assert every is not None
    run = every.runs[owed.key]
    assert isinstance(trace_of(free, owed, run), Trace)
    assert isinstance(trace_of(ts, owed, run), NotReproducedError)


# --- faults that are planted -------------------------------------------------------------------


def unused(*_: object) -> values.Node:
    """Take every cycle for one that is as assumed."""
    return values.TRUE


def a_cycle_late(
    program: Program, before: Leaves, after: Leaves, refusals: Refusals, idle: values.Node
) -> Leaves:
    """Judge assumptions on the inputs of the cycle before."""
    inputs = {str(v.name) for v in program.variables if v.kind.value == "input"}
    late = {**after, **{name: before[name] for name in inputs}}
    ghosts = watched.ghosts_after(program, before, after, refusals, idle)
    return ghosts | watched.ghosts_after(replace(program, properties=()), before, late, refusals, idle)


def noticed(engine: Callable[[TransitionSystem, Truth], None]) -> bool:
    for seed in SEEDS:
        _, true = judged(seed)
        try:
            engine(alone(drawn(seed)), true)
        except AssertionError:
            return True
    return False


@pytest.mark.parametrize("engine", [agrees, spacer_agrees, runs_agree])
def test_an_assumption_that_nothing_uses_is_noticed(
    engine: Callable[[TransitionSystem, Truth], None],
) -> None:
    with patch.object(transition, "kept", unused):
        assert noticed(engine)


@pytest.mark.parametrize("engine", [agrees, spacer_agrees, runs_agree])
def test_an_assumption_that_is_judged_a_cycle_late_is_noticed(
    engine: Callable[[TransitionSystem, Truth], None],
) -> None:
    with patch.object(transition, "ghosts_after", a_cycle_late):
        assert noticed(engine)


def test_an_engine_that_goes_by_no_contract_is_noticed() -> None:
    frame, rule = circuits._frame, spacer._rule

    def free(cycle: Cycle) -> Cycle:
        return replace(cycle, contract=values.TRUE)

    def any_frame(gates: object, cycle: Cycle, *rest: object) -> object:
        return frame(gates, free(cycle), *rest)  # type: ignore[arg-type]  # as they came

    def any_rule(keyed: object, cycle: Cycle, *rest: object) -> object:
        return rule(keyed, free(cycle), *rest)  # type: ignore[arg-type]  # as they came

    with patch.object(circuits, "_frame", any_frame):
        assert noticed(agrees)
    with patch.object(spacer, "_rule", any_rule):
        assert noticed(spacer_agrees)


# --- what can always be kept -------------------------------------------------------------------


def verdicts(text: str) -> tuple[TransitionSystem, LevelProof, dict[str, Verdict]]:
    ts = alone(text)
    proof = prove_level(ts, LITTLE)
    wanted = (Sort.KEPT, Sort.REQUIREMENT)
    return ts, proof, {owed.name: verdict for owed, verdict in proof.verdicts if owed.sort in wanted}


def test_a_requirement_is_proved_trusting_what_is_assumed() -> None:
    said = (
        "assume stops : whenever speed = 0 for 20 [ms], at once not rolls\n"
        "requirement r : whenever speed = 0 for 30 [ms], at once not rolls"
    )
    ts, proof, found = verdicts(LEVEL.format(said))
    assert found == {"stops": Verdict.PROVED, "r": Verdict.PROVED}
    claim = dict(of_level(ts, proof))[RUNS]
    assert "assumption `stops` of level `l`, as it is declared" in claim.trusts
    assert ("l", (Sort.KEPT, "", "stops")) in claim.rests_on
    without = verdicts(LEVEL.format(said.splitlines()[1]))[2]
    assert without == {"r": Verdict.NOT_PROVED}
    assert {"kept at first", "kept at restart", "goals kept"} <= set(certificate(ts, proof))


@pytest.mark.parametrize(
    "says",
    [
        "always not rolls\nassume b : when speed = 0, within 2 cycles, rolls",
        "always not (rolls and asks)\nassume b : when speed > 0, next rolls\nassume c : whenever speed > 0, at once asks",
        "when speed > 0, within 2 cycles, rolls and not rolls",
        "always turns > was turns",
        "whenever speed > 0, at once turns > 100 - speed and turns < speed",
        "never turns < 50\nassume b : always turns < 50",
        "always speed < 10 or rolls and not rolls",
        "when speed = 10, exactly after 2 cycles, rolls",
    ],
)
def test_an_assumption_that_comes_to_an_end_proves_nothing(says: str) -> None:
    """What an assumption forbids, the level does: nothing is proved of it, and a run shows where it comes to."""
    text = LEVEL.format(f"assume a : {says}\nrequirement r : always speed < 5 or rolls")
    ts, proof, found = verdicts(text)
    assert Verdict.PROVED not in {found[one.name] for one in ts.program.environment} & {found["a"]}
    claims = dict(of_level(ts, proof))
    assert any(
        claims[need[1]].verdict is not Verdict.PROVED for need in claims[RUNS].rests_on if need[1] in claims
    )
    wanted = [owed for owed in obligations(ts, ts.cycle(ts.havoc())) if owed.sort is Sort.KEPT]
    first = all(can.known and not can.low for _, can in can_be_kept(ts.program, ts.initial()))
    assert first or traces(ts, wanted, TraceSearch(6))


@pytest.mark.parametrize(
    "says",
    [
        "always turns >= was turns",
        "always turns = was turns",
        "whenever speed > 0, at once turns > speed",
        "always rolls implies turns = 37",
        "always turns - speed in 3 .. 100 or turns = 3",
        "always speed = 0 or speed = 10 or rolls and not rolls",
    ],
)
def test_what_some_inputs_always_keep_is_trusted(says: str) -> None:
    """Also where that rests on what states are reached: `speed` is only ever 0 or 10."""
    ts, _, found = verdicts(LEVEL.format(f"assume a : {says}"))
    assert found == {"a": Verdict.PROVED}
    assert all(ts.program.over_time)


def test_at_its_first_cycle_nothing_keeps_it() -> None:
    ts, proof, found = verdicts(
        LEVEL.format("assume a : always rolls and speed > 0\nrequirement r : always asks")
    )
    assert found["a"] is Verdict.NOT_PROVED
    assert dict(of_level(ts, proof))[(str(Sort.KEPT), "", "a")].verdict is Verdict.NOT_PROVED
    with patch("rcsc.compose.proof.level._kept_at_first", lambda *_: {}):
        assert verdicts(LEVEL.format("assume a : always rolls and speed > 0"))[2]["a"] is Verdict.PROVED


# --- refused inputs ----------------------------------------------------------------------------


def holds_where_refused(seed: int) -> int:
    """Hold what is proved against all runs, also those in which numbers are refused; return how much needs that none is."""
    ts = alone(drawn(seed))
    proof, true = prove_level(ts, LITTLE), truth(ts, refused=True)
    proved = {owed.key for owed, verdict in proof.verdicts if verdict is Verdict.PROVED}
    free = {key[2] for key in proved if key[0] is Sort.REQUIREMENT and not proof.needs_admission(key)}
    assert free.isdisjoint({*true.least, *true.restarted})
    kept = all((Sort.KEPT, "", one.name) in proved for one in ts.program.environment)
    assert not (kept and true.ends)
    return len(proved & {(Sort.REQUIREMENT, "", f"r{at}") for at in range(3)}) - len(free)


def test_nothing_false_is_proved_where_inputs_are_refused() -> None:
    assert holds_where_refused(39) == 1


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(100, 160))
def test_nothing_false_is_proved_of_many_levels_where_inputs_are_refused(seed: int) -> None:
    holds_where_refused(seed)


GAUGE = """\
input asks : bool
input level_mm : int 0 .. 100
output toggles : bool
{}
table t {{
  | line | toggles || toggles |
  |------|---------||---------|
  | up   | false   || true    |
  | down | true    || false   |
}}
level l {{ period 10 [ms] table t }}
"""


@pytest.mark.parametrize(
    "says",
    [
        "always level_mm + 1 > 20",
        "always 100 / (level_mm + 1) >= 0",
        "at least 3 cycles apart, level_mm > 50",
    ],
)
def test_an_assumption_forbids_no_refusal(says: str) -> None:
    """In a refused cycle nothing toggles: so it needs that none is, whatever is assumed of values that come."""
    ts = alone(GAUGE.format(f"assume a : {says}\nrequirement r : never was toggles and toggles"))
    proof = prove_level(ts, LITTLE)
    assert proof.verdict(Sort.REQUIREMENT, "", "r") is Verdict.PROVED
    assert proof.verdict(Sort.KEPT, "", "a") is Verdict.PROVED
    assert proof.needs_admission((Sort.REQUIREMENT, "", "r"))


RISES = """\
input asks : bool
input level_mm : int 0 .. 100
state last : int 0 .. 100
state begun : bool
assume slow : always level_mm <= was level_mm + 2
requirement r : whenever was begun, at once last <= was last + 2
table t {
  | line | when || last     | begun |
  |------|------||----------|-------|
  | any  | true || level_mm | true  |
}
level l { period 10 [ms] table t }
"""


def test_what_came_in_a_refused_cycle_is_what_was() -> None:
    """What rises by no more than 2 in a cycle may have risen by more since the last cycle that took it."""
    ts = alone(RISES)
    proof = prove_level(ts, LITTLE)
    assert proof.verdict(Sort.KEPT, "", "slow") is Verdict.PROVED
    assert proof.verdict(Sort.REQUIREMENT, "", "r") is Verdict.PROVED
    assert proof.needs_admission((Sort.REQUIREMENT, "", "r"))
    for some, many in ((ts, 0), (ts.refusing(), 1)):
        made = circuit(some, tuple(some.firsts().values()), some.cycle(some.havoc()), required(some))
        assert len(looked(made, 4).runs) == many


def test_time_goes_on_in_refused_cycles() -> None:
    """What comes at least 3 cycles apart may do so in 2 that are taken; a proof without refusals says that it is trusted."""
    said = "state due : int 0 .. 3\nassume rare : at least 3 cycles apart, asks\nrequirement r : at least 3 cycles apart, asks"
    ts = alone(GAUGE.format(said))
    proof = prove_level(ts, LITTLE)
    assert proof.verdict(Sort.REQUIREMENT, "", "r") is Verdict.PROVED


# --- what else goes by it ----------------------------------------------------------------------


def test_walks_keep_what_is_assumed() -> None:
    ts = alone(LEVEL.format("assume a : always not rolls and turns >= was turns"))
    states = [state for seed in range(4) for state in Walk(ts, Random(seed)).states(30)]  # noqa: S311  # the same walks each time
    assert len(states) > 20
    assert not any(state["rolls"] for state in states)


ARRIVES = "assume arrives : {}\n\nmodule receive"
SOON = "whenever cur_state = going, within 8 cycles, there"


@pytest.mark.parametrize(
    ("says", "ends"), [(SOON, True), ("when cur_state = going, within 8 cycles, there", False)]
)
def test_a_command_ends_by_what_is_assumed(says: str, ends: bool, tmp_path: Path) -> None:
    """What answers the first time that it is asked need not answer again."""
    ts = small_level(tmp_path, "lower", lower=small_text("lower", ("module receive", ARRIVES.format(says))))
    proof = prove_level(ts, LITTLE)
    assert {ending.table for ending in proof.endings if ending.proved} == {"pause", *(["go"] if ends else [])}
    rounds = lassos(ts, ["go"], TraceSearch(6))
    assert all(isinstance(found, Lasso) for found in rounds.values())
    assert set(rounds) == (set() if ends else {"go"})


# --- commands ----------------------------------------------------------------------------------

STOPS = """\
assume stops{} : whenever speed = 0 for 40 [ms], at once not rolls
requirement still : whenever speed = 0 for 80 [ms], at once not rolls"""


def test_a_proof_names_what_it_trusts_and_an_end_is_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = LEVEL.format(STOPS.format("")).replace("level l { period 10", "level solo { period 40")
    path = solo_system(tmp_path, text)
    assert rcsc(["prove", str(path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "requirement still proved, trusting assumption `stops` of level `solo`" in said
    assert "assumptions over time: 1, 1 of them can always be kept" in said
    more = text.replace(
        "assume stops", "assume starts : when speed = 0, within 2 cycles, rolls\nassume stops"
    )
    (tmp_path / "solo.rcs").write_text(more, encoding="utf-8")
    assert rcsc(["prove", str(path)]) == 1
    out, err = capsys.readouterr()
    assert (
        "rests on that assumption `starts` can always be kept; that assumption `stops` can always be kept"
        in out
    )
    assert "error[RCS761]: level `solo`: refuted: assumption `stops` can always be kept" in err
    assert "and `starts`, which is about the same inputs: when speed = 0, within 2 cycles, rolls" in " ".join(
        err.split()
    )
    assert re.search(
        r"no inputs were found that keep assumption `stops` in the\s.*cycle after it|no inputs were found",
        err,
    )


def test_it_reads_nothing_that_a_level_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    upper = small_text("upper") + "\nassume slow : at least 3 cycles apart, lower.status_report = done\n"
    path = small_system(tmp_path, upper=upper)
    assert rcsc(["prove", str(path)]) == 1
    said = capsys.readouterr().err
    assert (
        "error[RCS324]: assumption `slow` of level `upper` is about `lower.status_report`, which is what level `lower` writes"
        in said
    )
