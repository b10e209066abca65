"""What the tables state, said to Spin: invariants and properties are found broken where they are, and only there.

Judged by the prover and by the interpreter. What the small instance cannot speak of is left out and listed.
"""

from pathlib import Path
from random import Random

import pytest

from rcsc.commands import run
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.search import Effort
from rcsc.compose.promela.assemble import Model, emit
from rcsc.compose.promela.instance import Breadth
from rcsc.compose.promela.trail import Run, run_of
from rcsc.compose.proof.level import Verdict, prove_level
from tests.compose.test_promela import (
    REPO,
    SHIPPED,
    WINDOW,
    Edit,
    added,
    changed,
    checked,
    levels_of,
    swap,
    without_line,
)

# --- what holds, and what does not ----------------------------------------------------------

HOLD = """
property echo_stays : was lower.inc_command_echo = was to_lower.inc_command implies lower.inc_command_echo = was lower.inc_command_echo
property next_number : to_lower.inc_command = was to_lower.inc_command or to_lower.inc_command = (was to_lower.inc_command + 1) mod 65536
property goes_to_work : to_lower.input_command = go and was to_lower.input_command = pause implies command.input_command = work
property stays_begun : begun and not new_command until new_command
"""


@pytest.mark.needs("spin")
@pytest.mark.parametrize(("levels", "split"), [(("upper",), False), (("upper", "lower"), True)])
def test_what_a_property_says_was_is_what_the_cycle_before_left(
    levels: tuple[str, ...], split: bool, tmp_path: Path
) -> None:
    """Also of what is taken from a level in the model, some time before it acts."""
    system = changed(tmp_path / "one", upper=added(HOLD))
    model = emit(system, levels, Breadth(numbers=4, split=split))
    assert sum(one.what == Sort.PROPERTY.value for one in model.aims) == HOLD.count("property")
    assert model.left_out == ()
    found = checked(model)
    assert found.exhaustive
    assert not found.failed
    edit = added("property echo_stands : lower.inc_command_echo = was lower.inc_command_echo")
    other = changed(tmp_path / "other", upper=edit)
    wrong = emit(other, levels, Breadth(numbers=4, split=split))
    said = run_of(wrong, other, checked(wrong).trail)
    assert (said.aim.what, said.aim.name) == (Sort.PROPERTY.value, "echo_stands")
    assert said.ran, said.reason


SHIPPED_FAULTS: dict[str, tuple[str, str, Edit, str]] = {
    "what failed is done": (
        "gripper", "gripper",
        swap("| 6    | false       | f_state   |        |               ||                              | hold        | fail       |",
             "| 6    | false       | f_state   |        |               ||                              | hold        | done       |"),
        "failed_stays",
    ),
    "the force is another": ("gripper", "gripper", without_line("to_hand.force_n :="), "keeps_its_force"),
    "PAUSE drives": (
        "gripper", "gripper",
        swap("| 1    | true || state(d_state) | hold        |", "| 1    | true || state(d_state) |             |"),
        "rests_when_told",
    ),
    "another flash": ("vision", "vision", swap("|| wait                     |              |", "|| wait | shoot(flood) |"), "one_flash"),
    "what was seen changes": (
        "vision", "vision",
        swap("| 6    | false       | d_state   |         |                |               ||                          |",
             "| 6    | false       | d_state   |         |                |               || found                    |"),
        "keeps_what_it_saw",
    ),
}  # fmt: skip


@pytest.mark.needs("spin")
@pytest.mark.parametrize("fault", SHIPPED_FAULTS)
def test_where_a_shipped_table_breaks_a_property_spin_finds_it_and_the_interpreter_does_it(
    fault: str, tmp_path: Path
) -> None:
    level, file, edit, name = SHIPPED_FAULTS[fault]
    system = changed(tmp_path, REPO / "tables", **{file: edit})
    model = emit(system, (level,), WINDOW)
    said = run_of(model, system, checked(model).trail)
    assert (said.aim.what, said.aim.name) == (Sort.PROPERTY.value, name)
    computed = (
        name == "keeps_its_force"
    )  # whether the force is met is computed of reals: the interpreter finds that it is not
    assert said.ran is not computed, said.reason


# --- it agrees with the prover --------------------------------------------------------------

SAID: dict[str, tuple[str, ...]] = {
    "command.input_command": ("pause", "go"),
    "there": ("true", "false"),
    "new_command": ("true", "false"),
    "cur_state": ("d_state", "f_state", "going"),
    "status_report": ("done", "executing", "failed"),
    "report.ref_command_echo": ("pause", "go"),
}
LASTING = ("new_command", "cur_state", "status_report", "report.ref_command_echo")


def some_condition(random: Random, leaves: tuple[str, ...], *, was: bool = False) -> str:
    atoms = [random.choice(leaves) for _ in range(random.randint(1, 3))]
    return random.choice((" and ", " or ", " or ")).join(
        f"{'was ' if was and random.random() < 0.4 else ''}{leaf} {random.choice(('=', '/='))} {random.choice(SAID[leaf])}"
        for leaf in atoms
    )


def some_property(random: Random) -> str:
    word = random.choice(("", "then", "until"))
    leaves = tuple(SAID)
    if not word:
        return some_condition(random, leaves, was=True)
    return f"{some_condition(random, leaves)} {word} {some_condition(random, leaves, was=word == 'then')}"


def every_broken(system: dict[str, TransitionSystem], level: str) -> dict[str, bool]:
    """The names of what is broken in the instance, each found with those found before left out; and whether the interpreter does it."""
    runs: list[Run] = []
    while True:
        model = emit(system, (level,), WINDOW, frozenset(one.aim for one in runs))
        found = checked(model)
        if not found.failed:
            assert found.exhaustive
            return {one.aim.name: one.ran for one in runs}
        runs.append(run_of(model, system, found.trail))


@pytest.mark.needs("spin")
@pytest.mark.parametrize("seed", [2, 6])
def test_of_statements_at_random_spin_finds_broken_what_is_not_proved_and_no_more(
    seed: int, tmp_path: Path
) -> None:
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    stated = [f"property p{at} : {some_property(random)}" for at in range(5)]
    stated += [f"invariant i{at} : {some_condition(random, LASTING)}" for at in range(2)]
    system = changed(tmp_path, lower=added("\n".join(stated)))
    proof = prove_level(system["lower"], Effort(walks=6, cycles=40))
    sorts = {Sort.PROPERTY, Sort.INVARIANT}
    not_proved = {
        obligation.name
        for obligation, verdict in proof.found
        if obligation.sort in sorts and verdict is not Verdict.PROVED
    }
    assert 0 < len(not_proved) < len(stated)
    assert every_broken(system, "lower") == dict.fromkeys(not_proved, True)


@pytest.mark.needs("spin")
def test_a_new_order_may_come_in_the_very_first_cycle(tmp_path: Path) -> None:
    """Behind a restart only the first cycle has a failed status before it that nothing in this run brought about."""
    edit = added("property never_at_once : was status_report = failed implies not new_command")
    system = changed(tmp_path, lower=edit)
    model = emit(system, ("lower",), WINDOW)
    said = run_of(model, system, checked(model).trail)
    assert (said.aim.name, said.cycles, said.ran) == ("never_at_once", 1, True)


@pytest.mark.needs("spin")
def test_what_is_asked_of_an_input_only_a_cycle_later_is_told_and_run(tmp_path: Path) -> None:
    """The line that takes a new command does not look at `there`: only the property does, when the cycle is over."""
    system = changed(tmp_path, lower=added("property p : there and new_command then new_command"))
    model = emit(system, ("lower",), WINDOW)
    said = run_of(model, system, checked(model).trail)
    assert (said.aim.name, said.ran) == ("p", True)
    assert "was there = true" in said.lines[-1]


# --- what is left out -----------------------------------------------------------------------

MORE = """
input level_mm : real 0.0 .. 10.0 [mm]
input which : int 0 .. 3
state kept_mm : real 0.0 .. 10.0 [mm]
state twice_mm : real 0.0 .. 20.0 [mm]
state marks : array[3] of int 0 .. 9
state again_mm : real 0.0 .. 20.0 [mm]

module measure reads level_mm, twice_mm writes kept_mm, twice_mm, again_mm {
  kept_mm := level_mm
  again_mm := twice_mm
  twice_mm := 2.0 * level_mm
}
"""
LEFT_OUT: dict[str, str] = {
    "twice_mm <= 4.0": "`twice_mm` is computed of reals",
    "was again_mm <= 4.0": "`was again_mm` is computed of reals",
    "kept_mm + 1.0 > 2.0": "it computes with reals",
    "inc_command_seen mod 2 = 0": "it divides",
    "inc_command_seen >= was inc_command_seen": "`inc_command_seen` goes round",
    "command.inc_command /= 5": "`command.inc_command` goes round",
    "there or report.inc_command_echo in {1, 2}": "`report.inc_command_echo` goes round",
    "inc_command_seen + 1 /= report.inc_command_echo": "`report.inc_command_echo` goes round",
    "marks[which] = 0": "its index may lie outside",
}
CHECKED = (
    "kept_mm = level_mm", "kept_mm <= 10.0 or was kept_mm = level_mm", "which >= 0 and which + was which >= 0",
    "inc_command_seen = command.inc_command",
    "inc_command_seen = was inc_command_seen or inc_command_seen = (was inc_command_seen + 1) mod 65536",
)  # fmt: skip


def measuring(folder: Path, *stated: str) -> Model:
    """The lower level, with reals, stating these."""
    text = "\n".join(f"property p{at} : {one}" for at, one in enumerate(stated))
    measured = swap("preprocess receive", "preprocess receive, measure")
    edit = added(f"{MORE}\n{text}")
    system = changed(folder, lower=lambda before: edit(measured(before)))
    return emit(system, ("lower",), WINDOW)


def test_what_the_instance_cannot_speak_of_is_left_out_and_listed(tmp_path: Path) -> None:
    model = measuring(tmp_path, *LEFT_OUT)
    assert [one.reason for one in model.left_out] == list(LEFT_OUT.values())
    assert not [one for one in model.aims if one.what == Sort.PROPERTY.value]
    assert (
        " * not checked: level `lower`: property: `p0`: `twice_mm` is computed of reals"
        in model.text.split("*/")[0]
    )


@pytest.mark.needs("spin")
def test_what_it_can_speak_of_is_checked_of_reals_and_numbers_too(tmp_path: Path) -> None:
    model = measuring(tmp_path / "right", *CHECKED)
    assert model.left_out == ()
    found = checked(model)
    assert found.exhaustive
    assert not found.failed


@pytest.mark.needs("spin")
@pytest.mark.parametrize("wrong", ["kept_mm = was kept_mm", "which = was which"])
def test_what_a_property_compares_has_two_values_to_differ_by(wrong: str, tmp_path: Path) -> None:
    assert checked(measuring(tmp_path, wrong)).failed


def test_counters_stay_short_where_a_property_says_that_they_do_not_grow() -> None:
    domains = emit(levels_of(SHIPPED), ("task",), WINDOW).domains
    assert domains["task:tbuffer_boxt"].high == domains["task:was tbuffer_boxt"].high == 1


@pytest.mark.needs("spin")
def test_rcsc_promela_lists_what_it_does_not_check_and_counts_what_it_does(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["promela", str(SHIPPED), "--levels", "primitive", "--seconds", "0.5"]) == 0
    said = capsys.readouterr().out
    assert (
        "  not checked: level `primitive`: property: `holds_at_rest`: `speed_mm_s` is computed of reals"
        in said
    )
    assert "    3  property\n" in said
    assert "    2  a PAUSE is passed on in the cycle that takes it\n" in said
