"""The levels proved together: a small system of two levels in full, broken in many ways, and the shipped levels."""

import json
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.predicates import point
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.variants import undeferred
from rcsc.compose.contract.walk import Walk
from rcsc.compose.counterexample.cycle_run import broken
from rcsc.compose.counterexample.finding import of_trace
from rcsc.compose.counterexample.trace import Trace
from rcsc.compose.invariant.cubes import Reached
from rcsc.compose.proof.assume_guarantee import agreements
from rcsc.compose.proof.level import LevelProof, Verdict, certificate, prove_level
from rcsc.compose.proof.system import NoProgramError, SystemProof, transition_systems, transition_systems_of
from rcsc.front.commands import run
from rcsc.lang.interpret import Fault, cycle, initial
from rcsc.lang.model import Kind, Real
from rcsc.proof.solvers.smtlib import cvc5_refutes
from rcsc.proof.symbolic import values
from rcsc.run.adopt import adopt
from rcsc.run.description import BadDescription, description
from rcsc.run.system import signatures
from tests.support.programs.systems import (
    LITTLE,
    SYSTEM,
    small_level,
    small_proof,
    small_proofs,
    small_system,
    small_text,
)
from tests.support.programs.texts import edit_file, without_row
from tests.support.proved import obligation_of, prove_system, shortest, time_line

REPO = Path(__file__).parents[2]
SHIPPED = REPO / "tables" / "system.toml"


@pytest.fixture(scope="module")
def small() -> SystemProof:
    return small_proofs()[1]


@pytest.fixture(scope="module")
def upper() -> tuple[TransitionSystem, LevelProof]:
    return small_proof("upper")


# --- what is right is proved ---------------------------------------------------------------


def test_everything_is_proved_of_two_levels_that_keep_to_the_protocol(small: SystemProof) -> None:
    assert small.proved
    assert [proof.open for proof in small.levels] == [(), ()]
    assert small.levels[0].verdict(Sort.ASSUMPTION, "work", "in_step") is Verdict.PROVED


def test_what_a_level_assumes_of_a_level_is_what_was_proved_of_it(small: SystemProof) -> None:
    inside = {
        (agreement.level, agreement.reason.split(":")[0])
        for agreement in small.agreements
        if not agreement.outside
    }
    assert inside == {("upper", "proved of `lower`"), ("lower", "proved of `upper`")}
    assert [agreement.level for agreement in small.agreements if agreement.outside] == [
        "upper"
    ]  # the station


def test_no_state_that_the_interpreter_reaches_breaks_the_invariant(
    upper: tuple[TransitionSystem, LevelProof],
) -> None:
    ts, proof = upper
    assert proof.clauses
    for seed in range(1000, 1012):  # other walks than those that the search began with
        walk = Walk(ts, Random(seed))  # noqa: S311  # repeatable on purpose
        for state in walk.states(80):
            here = Reached.of([point(ts, proof.predicates, state)])
            assert not any(here.shows(clause) for clause in proof.clauses)


def test_the_proof_is_the_same_each_time(upper: tuple[TransitionSystem, LevelProof]) -> None:
    ts, proof = upper
    again = prove_level(ts, LITTLE)
    assert again.clauses == proof.clauses


# --- certificates --------------------------------------------------------------------------


def test_another_solver_confirms_every_question(upper: tuple[TransitionSystem, LevelProof]) -> None:
    questions = certificate(*upper)
    kinds = {"first", "restart", "step", "goals", "lines", "ends"}
    assert {name.removeprefix("nothing refused ").split()[0] for name in questions} == kinds
    assert any(name.startswith("nothing refused ") for name in questions)
    assert [name for name, text in questions.items() if not cvc5_refutes(text)] == []


def test_another_solver_refuses_an_invariant_that_is_none(upper: tuple[TransitionSystem, LevelProof]) -> None:
    ts, proof = upper
    predicates = [predicate.name for predicate in proof.predicates]
    never = ((predicates.index("cur_state"), 2),)  # that the level is never under way
    false = LevelProof(proof.level, proof.verdicts, proof.predicates, (*proof.clauses, never), 0, 0, 0.0)
    assert not all(cvc5_refutes(text) for text in certificate(ts, false).values())


# --- what is wrong is found ----------------------------------------------------------------

HOLD = "} else if begun and lower.inc_command_echo = to_lower.inc_command {\n    new_command := false"
DROPPED = "} else {\n    new_command := false"
UPPER_FAULTS: dict[str, tuple[str, Sort, str, str]] = {
    "the new-command flag is not held": (small_text("upper", (HOLD, DROPPED)), Sort.ASSUMPTION, "work", "in_step"),
    "any echo will do": (
        small_text("upper", ("deferred until lower.inc_command_echo = to_lower.inc_command",
                             "deferred until lower.inc_command_echo > 0")),
        Sort.ASSUMPTION, "work", "in_step",
    ),
    "a line is missing": (without_row(small_text("upper"), "4"), Sort.NO_DEFAULT, "work", ""),
    "a state is written directly": (
        small_text("upper", ("next cur_state := value", "cur_state := value")), Sort.DEFERRED, "", "cur_state",
    ),
    "orders are not numbered": (
        small_text("upper", ("to_lower.input_command /= old_command", "false")), Sort.NUMBERED, "", "to_lower.input_command",
    ),
    "numbers are skipped": (
        small_text("upper", ("(to_lower.inc_command + 1) mod", "(to_lower.inc_command + 2) mod")), Sort.NEXT_NUMBER, "", "to_lower",
    ),
    "every cycle is a new command": (
        small_text("upper", ("if command.inc_command /= inc_command_seen {", "if begun {")), Sort.ONCE, "", "new_command",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", UPPER_FAULTS)
def test_a_fault_of_a_level_is_found_with_the_shortest_run_that_shows_it(fault: str, tmp_path: Path) -> None:
    upper, sort, table, name = UPPER_FAULTS[fault]
    ts = small_level(tmp_path, "upper", upper=upper)
    obligation = obligation_of(ts, sort, table, name)
    assert prove_level(ts, LITTLE).verdict(sort, table, name) is not Verdict.PROVED
    trace = shortest(ts, obligation)
    assert isinstance(trace, Trace)
    assert [broken(ts, obligation, step) for step in trace.steps] == [False] * (len(trace.steps) - 1) + [True]
    assert shortest(ts, obligation, most=len(trace.steps) - 1) is None


UNNUMBERED = (
    ("to_lower.input_command /= old_command", "to_lower.input_command /= old_command and begun"),
    ("module send reads ", "module send reads begun, "),
)


@pytest.mark.parametrize(
    ("level", "changes", "harmed"),
    [
        ("lower", [("ref_command_echo := command.input_command", "ref_command_echo := go")], "upper"),
        ("upper", UNNUMBERED, "lower"),
    ],
    ids=["a subordinate that echoes another command", "a superior that does not number"],
)
def test_who_breaks_what_a_neighbour_assumes_is_found(
    level: str, changes: Sequence[tuple[str, str]], harmed: str, tmp_path: Path
) -> None:
    found = prove_system(small_system(tmp_path, **{level: small_text(level, *changes)}), LITTLE)
    assert not found.proved
    agreed = [(one.level, one.holds) for one in found.agreements if not one.outside]
    assert agreed == [("upper", harmed != "upper"), ("lower", harmed != "lower")]


@pytest.mark.parametrize(
    ("level", "leaf"), [("upper", "to_lower.inc_command"), ("lower", "command.input_command")]
)
def test_levels_that_begin_with_different_orders_do_not_agree(
    small: SystemProof, level: str, leaf: str
) -> None:
    made = transition_systems(SYSTEM)
    proofs = {proof.level: proof for proof in small.levels}
    assert all(agreement.holds for agreement in agreements(made, proofs))
    program = made[level].program
    other = tuple(replace(v, initial=1) if v.name == leaf else v for v in program.variables)
    made[level] = made[level].of(replace(program, variables=other))
    assert [agreement.level for agreement in agreements(made, proofs) if not agreement.holds] == ["upper"]


# --- descriptions ---------------------------------------------------------------------------


def test_an_order_without_a_report_is_refused(tmp_path: Path) -> None:
    path = small_system(tmp_path)
    edit_file(path, ('"lower.report" = "upper.lower"\n', ""))
    with pytest.raises(BadDescription, match=r"`lower\.command` needs one buffer to `upper`"):
        transition_systems(path)


def test_a_level_without_tables_is_refused(tmp_path: Path) -> None:
    path = small_system(tmp_path)
    (tmp_path / "lower.rcs").unlink()
    with pytest.raises(NoProgramError, match="no program `lower`"):
        transition_systems(path)


def test_a_program_without_the_level_is_refused(tmp_path: Path) -> None:
    path = small_system(tmp_path)
    programs = {name: ts.program for name, ts in transition_systems(path).items()}
    programs["lower"] = replace(programs["lower"], levels=())
    with pytest.raises(NoProgramError, match="program `lower` has no level `lower`"):
        transition_systems_of(description(path), programs)


# --- the translation ------------------------------------------------------------------------


@pytest.mark.parametrize("level", ["task", "emove", "vision", "primitive", "gripper"])
def test_a_cycle_as_nodes_is_the_interpreter_s_cycle(level: str) -> None:
    ts = transition_systems(SHIPPED)[level]
    walk = Walk(ts, Random(7))  # noqa: S311  # repeatable on purpose
    compared = 0
    for at, state in enumerate(walk.states(240)):
        if at % 12:
            continue
        made = of_constants(ts, state)
        outcome = cycle(ts.program, ts.level, {k: v for k, v in state.items() if k in outcome_leaves(ts)})
        assert outcome.fault is Fault.OK
        for name, value in outcome.snapshot.items():
            node = made.after[name]
            if node.known and not isinstance(node.kind, Real):
                assert node.low == int(value), name
                compared += 1
    assert compared > 200


def of_constants(ts: TransitionSystem, state: dict[str, int | bool | float]) -> Cycle:
    """One cycle from a concrete state that takes the same inputs again."""
    nodes = {name: values.constant(kind, state[name]) for name, kind in ts.kinds.items()}
    taken = {str(v.name): nodes[v.name] for v in ts.program.variables if v.kind.value == "input"}
    return ts.cycle(nodes, taken=taken)


def outcome_leaves(ts: TransitionSystem) -> set[str]:
    return {str(v.name) for v in ts.program.variables}


@pytest.mark.parametrize("level", ["task", "emove", "vision", "primitive", "gripper"])
def test_a_restart_is_what_the_system_does(level: str) -> None:
    """With every input as it is initially, `adopt` starts a level with the values that the proof takes for a restart."""
    ts = transition_systems(SHIPPED)[level]
    sign = signatures(description(SHIPPED))[level]
    start = initial(ts.program)
    leaves = [leaf.name for leaf in sign.leaves]
    if set(leaves) != set(start):
        pytest.fail("`generated` is not of these tables: run `rcsc compile`")
    adopted = dict(zip(leaves, adopt(sign, tuple(start[leaf] for leaf in leaves)), strict=False))
    for name, node in ts.restarted().items():
        if node.known and name in adopted:
            assert node.low == int(adopted[name]) or isinstance(node.kind, Real), name
    free = {name for name, node in ts.restarted().items() if not node.known}
    inputs = {str(v.name) for v in ts.program.variables if v.kind is Kind.INPUT}
    numbers = {f"{below.order}.inc_command" for below in ts.links.below} | ({"to_camera.number"} & set(start))
    assert ts.links.above is not None
    echoes = {ts.links.above.echo, ts.links.above.echoed}  # what stands in its own buffer
    assert free == inputs | numbers | echoes | {"inc_command_seen"}
    assert all(adopted[name] == 1 for name in numbers)  # the one after the one that stands echoed


# --- the shipped levels -----------------------------------------------------------------------


def proved_in_its_environment(level: str) -> None:
    """Prove a shipped level, and have cvc5 confirm it."""
    ts = transition_systems(SHIPPED)[level]
    proof = prove_level(ts)
    assert proof.open == ()
    assert {verdict for obligation, verdict in proof.verdicts if obligation.sort is Sort.ASSUMPTION} <= {
        Verdict.PROVED
    }
    assert proof.context is not None
    assert (proof.context.unreached, proof.context.restless) == ((), False)
    assert proof.stands or level != "vision"  # EMOVE goes by what it saw
    again = {(one.table, one.line, one.leaves) for one in proof.context.repeated}
    assert again <= {("goto", "1", ("length_mm",)), ("gothru", "1", ("length_mm",))}
    assert {ending.table for ending in proof.endings if not ending.proved} == set()
    questions = certificate(ts, proof)
    # those about lines take cvc5 longest: `rcsc prove --certify` asks them
    lines = ("lines", "nothing refused lines")
    asked = {name: text for name, text in questions.items() if not name.startswith(lines)}
    assert [name for name, text in asked.items() if not cvc5_refutes(text, 120_000_000)] == []


def test_a_shipped_level_is_proved_in_its_environment() -> None:
    """The other four cost minutes: CI proves them by `python -m tests.compose.test_compose`, which without names proves all five."""
    proved_in_its_environment("gripper")


def test_without_deferral_the_published_argument_is_found_in_three_cycles() -> None:
    """Section 9: the next state is taken while the level below still reports the command before."""
    shipped = transition_systems(SHIPPED)["task"]
    ts = shipped.of(undeferred(shipped.program))
    obligation = obligation_of(ts, Sort.ASSUMPTION, "acquire", "acquire_in_step")
    trace = shortest(ts, obligation)
    assert trace is not None
    assert len(trace.steps) == 3
    assert trace.steps[-1].failed == ("acquire_in_step",)
    assert "assumption `acquire_in_step` fails" in "\n".join(
        time_line({"task": ts}, of_trace(ts, obligation, trace))
    )


def test_a_path_begins_where_the_robot_is() -> None:
    """`here` settles when PAUSE is echoed; a command that comes in that very cycle finds `origin` answered for the place before."""
    ts = transition_systems(SHIPPED)["emove"]
    assert shortest(ts, obligation_of(ts, Sort.ASSUMPTION, "move_to", "move_to_in_step"), most=5) is None


# --- the command line ----------------------------------------------------------------------


def test_rcsc_prove_says_how_each_assumption_stands(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prove", str(SYSTEM), "-j", "1"]) == 0
    said = capsys.readouterr().out
    assert "in_step                  proved" in said
    assert "lower assumes that while the number of `command` stays" in said


def test_rcsc_prove_shows_the_trace_of_what_fails(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prove", str(SYSTEM), "--level", "upper", "--without-deferral"]) == 1
    said = capsys.readouterr()
    assert "monitored: not proved of the levels together" in said.out
    assert "error[RCS751]: level `upper`, table `work`: refuted: assumption `in_step`" in said.err
    assert "broken in cycle 3" in said.err
    assert "work: 3" in said.err


def test_rcsc_prove_as_json_and_certificates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run(
            [
                "prove",
                str(SYSTEM),
                "--level",
                "lower",
                "--json",
                "--certificate",
                str(tmp_path),
            ]
        )
        == 0
    )
    said = json.loads(capsys.readouterr().out)
    assert said["proved"] is True
    assert [level["level"] for level in said["levels"]] == ["lower"]
    written = sorted(path.name for path in tmp_path.iterdir())
    assert {name.removeprefix("lower_") for name in written} >= {
        "first.smt2", "restart.smt2", "step_go.smt2", "step_pause.smt2",
        "goals_first.smt2", "goals_restart.smt2", "goals_echoes.smt2", "goals_one_line.smt2",
    }  # fmt: skip
    assert all(cvc5_refutes(path.read_text(encoding="utf-8")) for path in tmp_path.iterdir())


def test_rcsc_prove_certify_asks_cvc5(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ["prove", str(SYSTEM), "--level", "lower", "--certify"]
    assert run(asked) == 0
    said = re.search(r"level lower: cvc5 says the same of (\d+) of (\d+) questions", capsys.readouterr().out)
    assert said is not None
    assert said[1] == said[2]
    assert int(said[1]) > 10
    monkeypatch.setattr(
        "rcsc.front.commands.shared.proved.cvc5_refutes",
        lambda text, **_: "step" not in text and len(text) < 3000,
    )
    assert run(asked) == 3
    assert "error[RCS901]: level `lower`: cvc5 does not confirm" in capsys.readouterr().err


def test_rcsc_certify_covers_a_system(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["certify", str(SYSTEM)]) == 0
    assert "level upper: cvc5 says the same of" in capsys.readouterr().out
    assert run(["certify", str(SYSTEM), "--write", str(tmp_path / "a.json")]) == 2
    assert "rcsc prove --certificate" in capsys.readouterr().err


def test_rcsc_prove_refuses_a_level_that_there_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prove", str(SYSTEM), "--level", "middle"]) == 2
    assert "there is no level `middle`" in capsys.readouterr().err


if __name__ == "__main__":
    for each in sys.argv[1:] or ("task", "emove", "primitive", "vision", "gripper"):
        proved_in_its_environment(each)
