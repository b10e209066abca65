"""Levels of which something false was once proved: each is as small as shows it, and the interpreter is the judge."""

from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

from rcsc.compose.agreed import agreements
from rcsc.compose.ends import Ending
from rcsc.compose.goals import Sort
from rcsc.compose.lap import Lap, laps
from rcsc.compose.level import LevelProof, Verdict, prove_level
from rcsc.compose.system import NoProgramError, prove_system, steppers
from rcsc.compose.trace import Search, one_cycle, ran
from rcsc.compose.transition import Stepper
from rcsc.interpret import initial
from rcsc.model import Value
from rcsc.system.description import BadDescription
from tests.hierarchies_level import Reading, Role
from tests.test_compose import LITTLE, SMALL, Edit, changed, swap
from tests.test_endings import WAY, go

_ASKED = count()


def ask(_there: bool) -> bool:
    """Another answer each time."""
    return bool(next(_ASKED) % 2)


def proved(folder: Path, edit: Edit) -> tuple[Stepper, LevelProof]:
    stepper = steppers(changed(folder, lower=edit))["lower"]
    return stepper, prove_level(stepper, LITTLE)


def ending(proof: LevelProof, table: str) -> Ending:
    return next(one for one in proof.endings if one.table == table)


def lines_run(stepper: Stepper, cycles: int, **inputs: Value) -> list[tuple[str, str]]:
    """The table and the line of each cycle under one command."""
    start = initial(stepper.program)
    taken = {name: start[name] for name in ("command.inc_command", "command.input_command", "there")}
    taken |= {name.replace("__", "."): value for name, value in inputs.items()}
    return [(step.table, step.line) for step in ran(stepper, start, [taken] * cycles)]


# --- what extern procedures give -----------------------------------------------------------------


TOGGLES = (
    "  | 2 | false | going | | true || | executing |\n"
    "  | 3 | false | going | | false || state(d_state) | done |\n"
)


def asking(text: str) -> str:
    states = "state tick : bool\nstate raw : bool"
    text = go(TOGGLES, states, "on := raw /= tick\n  tick := raw")(text)
    text = text.replace("module receive reads command,", "module receive reads command, raw,")
    said = f'extern procedure ask reads there writes raw python "{__name__}:ask" c "ask"\n\nmodule receive'
    return text.replace("module receive", said, 1).replace("preprocess receive", "preprocess ask, receive")


def test_an_extern_procedure_may_give_something_else_in_the_next_cycle(tmp_path: Path) -> None:
    stepper, proof = proved(tmp_path, asking)
    run = lines_run(stepper, 40, command__inc_command=1, command__input_command=1)
    assert run[2:] == [("go", "2")] * 38  # for ever, where it answers so
    assert not ending(proof, "go").proved


def nested(text: str) -> str:
    """A module of the preprocess that calls another."""
    text = go(WAY, "state c : int 0 .. 9", "on := c >= 9", "c := 0", "c := min(c + 1, 9)")(text)
    text = text.replace(
        "module receive", "module inner reads c writes on {\n  on := c >= 9\n}\n\nmodule receive"
    )
    return text.replace("  on := c >= 9\n}\n\nmodule answer", "  inner\n}\n\nmodule answer")


def nested_extern(text: str) -> str:
    said = f'extern procedure inner reads there writes on python "{__name__}:ask" c "ask"'
    return nested(text).replace("module inner reads c writes on {\n  on := c >= 9\n}", said)


def whole_of_what_overflows(text: str) -> str:
    seen = "if r * r < 5.0 {\n    on := int(r * r) >= 3\n  } else {\n    on := true\n  }"
    text = go(WAY, "state c : int 0 .. 9\ninput r : real 0.0 .. 1.0e300", seen)(text)
    return text.replace("module receive reads command,", "module receive reads command, r,")


@pytest.mark.parametrize(
    ("edit", "ends"), [(nested, True), (nested_extern, False), (whole_of_what_overflows, False)]
)
def test_what_the_preprocess_may_do_is_followed(edit: Edit, ends: bool, tmp_path: Path) -> None:
    """Calls, extern ones too, and the whole part of what may be no number."""
    _, proof = proved(tmp_path, edit)
    assert proof.open == ()
    assert ending(proof, "go").proved == ends


# --- what selects the table ----------------------------------------------------------------------


def by_turns(text: str) -> str:
    """The table changes in each cycle, whatever the command."""
    text = text.replace("state cur_state", "state which : lower_command\nstate cur_state")
    text = text.replace("module receive reads command,", "module receive reads command, which,")
    text = text.replace("writes new_command,", "writes new_command, which,")
    turn = "  if which = pause {\n    which := go\n  } else {\n    which := pause\n  }\n"
    text = text.replace(
        "inc_command_seen := command.inc_command\n", f"inc_command_seen := command.inc_command\n{turn}"
    )
    before, _, tables = text.partition("table go")
    tables = tables.replace("| done      ", "| executing")
    return f"{before}table go{tables}".replace("by command.input_command", "by which")


def test_tables_that_take_turns_under_one_command_are_named(tmp_path: Path) -> None:
    stepper, proof = proved(tmp_path, by_turns)
    run = lines_run(stepper, 40, command__inc_command=1)
    assert {table for table, _ in run[:2]} == {"go", "pause"} == {table for table, _ in run[-2:]}
    assert all(not ending(proof, table).proved for table in ("go", "pause"))


# --- restarts ------------------------------------------------------------------------------------


def test_a_restart_adopts_an_order_only_under_the_name_that_the_system_knows(tmp_path: Path) -> None:
    """`adopt` knows `command`: of another record the number is not counted as seen, and is taken up once more."""
    path = changed(tmp_path, lower=swap("command", "orders"), upper=lambda text: f"{text}\n")
    lower = tmp_path / "lower.rcs"
    text = lower.read_text(encoding="utf-8")
    for name in ("new_command", "inc_command", "input_command", "lower_command"):
        text = text.replace(name.replace("command", "orders"), name)
    lower.write_text(text.replace("ref_orders_echo", "ref_command_echo"), encoding="utf-8")
    path.write_text(
        path.read_text(encoding="utf-8").replace("lower.command", "lower.orders"), encoding="utf-8"
    )
    stepper = steppers(path)["lower"]
    assert stepper.links.above is not None
    assert stepper.links.above.order == "orders"
    start = initial(stepper.program) | {"orders.inc_command": 7}
    step = one_cycle(stepper, start, {"orders.inc_command": 7})
    assert step.after["new_command"]
    assert prove_level(stepper, LITTLE).verdict(Sort.ONCE, "", "new_command") is not Verdict.PROVED


# --- both ends of a buffer -----------------------------------------------------------------------


OTHER = {
    "fields in another order": ("  inc_command_echo : number\n  ref_command_echo : lower_command\n  status_report : level_status",
                                "  inc_command_echo : number\n  status_report : level_status\n  ref_command_echo : lower_command"),
    "members in another order": ("enum lower_command { pause, go }", "enum lower_command { go, pause }"),
    "a range that is wider": ("type number = int 0 .. 65535", "type number = int 0 .. 70000"),
}  # fmt: skip


@pytest.mark.parametrize("other", OTHER)
def test_both_ends_of_a_buffer_are_the_same(other: str, tmp_path: Path) -> None:
    """What the upper level takes for a command, or a status, is what the lower one gave for it."""
    old, new = OTHER[other]
    changed(tmp_path, lower=swap("use words", "use others"))
    words = (SMALL / "words.rcs").read_text(encoding="utf-8")
    assert old in words
    (tmp_path / "others.rcs").write_text(words.replace(old, new), encoding="utf-8")
    with pytest.raises(BadDescription, match="lower"):
        steppers(tmp_path / "system.toml")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('"upper.report2" = "lower.command"', "`lower.command` is filled twice"),
        ('"station.more" = "lower.cur_state"', "no input"),
        ('"station.more" = "lower.comand"', "has no variable `comand`"),
    ],
)
def test_a_buffer_fills_one_input_and_no_other_does(more: str, words: str, tmp_path: Path) -> None:
    path = changed(tmp_path, lower=swap("use words\n", "use words\n\n"))
    path.write_text(path.read_text(encoding="utf-8") + more + "\n", encoding="utf-8")
    with pytest.raises(BadDescription, match=words):
        steppers(path)


def test_a_level_has_one_superior(tmp_path: Path) -> None:
    """The report echoes the orders of one: what the other assumes would be proved of none."""
    edit = swap("input there", "input second : lower_order\ninput there")
    path = changed(
        tmp_path,
        lower=lambda text: edit(text).replace("output report", "output other : lower_report\noutput report"),
    )
    more = '"station.second" = "lower.second"\n"lower.other" = "station.other"\n'
    path.write_text(path.read_text(encoding="utf-8") + more, encoding="utf-8")
    with pytest.raises(BadDescription, match="numbered orders in `command` and in `second`"):
        steppers(path)


# --- how levels begin ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small() -> dict[str, LevelProof]:
    return {one.level: one for one in prove_system(SMALL / "system.toml", LITTLE).levels}


@pytest.mark.parametrize(
    ("leaf", "value", "agree"),
    [
        ("lower.inc_command_echo", 0, True),
        ("lower.inc_command_echo", 65535, True),  # of an order before the first
        ("lower.inc_command_echo", 1, False),  # it would answer the first order before anyone took it
        ("lower.inc_command_echo", 9, False),
        ("lower.ref_command_echo", 1, False),
        ("to_lower.speed", 1, False),  # the lower level takes another order under the same number
    ],
)
def test_levels_begin_with_what_each_assumes(
    leaf: str, value: int, agree: bool, small: dict[str, LevelProof], tmp_path: Path
) -> None:
    def speeds(text: str) -> str:
        return text.replace(
            "input_command : lower_command\n", "input_command : lower_command\n  speed : int 0 .. 9\n"
        )

    def compares(text: str) -> str:
        text = text.replace(
            "to_lower.input_command /= old_command",
            "to_lower.speed /= old_speed or to_lower.input_command /= old_command",
        )
        text = text.replace(
            "reads to_lower, old_command writes to_lower, old_command",
            "reads to_lower, old_command, old_speed writes to_lower, old_command, old_speed",
        )
        text = text.replace(
            "  old_command := to_lower", "  old_speed := to_lower.speed\n  old_command := to_lower"
        )
        return text.replace("state new_command", "state old_speed : int 0 .. 9\nstate new_command")

    made = steppers(changed(tmp_path, words=speeds, upper=compares))
    assert made["lower"].links.above is not None
    assert "command.speed" in made["lower"].links.above.numbered
    program = made["upper"].program
    other = tuple(replace(v, initial=value) if v.name == leaf else v for v in program.variables)
    made["upper"] = made["upper"].of(replace(program, variables=other))
    of_it = [one for one in agreements(made, small) if one.level == "upper" and not one.outside]
    assert [one.holds for one in of_it] == [agree]


# --- new commands --------------------------------------------------------------------------------


def falls_to_default(text: str) -> str:
    """No line takes a new command that comes while the lower level is not idle; DEFAULT begins, and fails."""
    lines = [line for line in text.split("\n") if not line.startswith("  | 0 ")]
    text = "\n".join(lines).replace("DEFAULT unreachable", "DEFAULT            ")
    return text.replace(
        "|| nextstate(f_state)      | pause       | fail       |\n}",
        "|| begin; nextstate(f_state) | pause | fail |\n}",
    )


def test_default_passes_over_a_new_command_like_any_line_that_does_not_look(tmp_path: Path) -> None:
    stepper = steppers(changed(tmp_path, upper=falls_to_default))["upper"]
    role = Role(stepper.program, stepper.level, stepper.links)
    now = initial(stepper.program) | {"command.inc_command": 1, "command.input_command": 1}
    now |= {"lower.status_report": 1}  # it executes its first order
    ran_ = role.run(Reading(now))
    assert (ran_.table, ran_.line, ran_.after["begun"]) == ("work", "7", True)
    again = one_cycle(stepper, ran_.after, {})
    again = one_cycle(stepper, again.after, {"lower.inc_command_echo": again.after["to_lower.inc_command"]})
    assert not again.after["new_command"]  # nobody answered it
    assert prove_level(stepper, LITTLE).verdict(Sort.ANSWERED, "work", "new_command") is not Verdict.PROVED


# --- values that leave their range ---------------------------------------------------------------


def test_a_program_is_in_order_by_itself_before_anything_is_proved_of_the_levels(tmp_path: Path) -> None:
    """A counter that runs past its range, taken to stay in it, would end every command, and keep any property."""
    over = go(WAY, "state c : int 0 .. 9", "on := false", "c := 0", "c := c + 1")
    with pytest.raises(
        NoProgramError, match=r"the value can lie outside 0 \.\. 9, the range of `c`: see `rcsc check"
    ):
        steppers(changed(tmp_path, lower=over))


# --- answers that do not stay --------------------------------------------------------------------


def done_now_and_then(text: str) -> str:
    """Done, and executing again, in turns: whoever looks now and then may never see the one."""
    lines = "  | 2 | false | going | | true || | executing |\n  | 3 | false | going | | false || | done |\n"
    return go(lines, "state tick : bool", "tick := not tick\n  on := tick")(text)


def test_an_answer_that_does_not_stay_is_none(tmp_path: Path) -> None:
    """A superior is taken to see an answer some time: it has to stay until it does."""
    stepper, proof = proved(tmp_path, done_now_and_then)
    run = lines_run(stepper, 40, command__inc_command=1, command__input_command=1)
    assert {line for _, line in run[2:]} == {"2", "3"}
    assert ending(proof, "go").endless == ("2",)
    found = laps(stepper, ("go",), Search(8, legal=True))["go"]
    assert isinstance(found, Lap)
    assert [step.line for step in found.trace.steps[found.first - 1 :]] in (["2", "3"], ["3", "2"])


def test_a_pause_that_fails_is_not_answered(tmp_path: Path) -> None:
    """Whoever orders PAUSE waits until it is done (`ends.answered`)."""

    def fails(text: str) -> str:
        before, _, after = text.partition("table pause")
        after = after.replace("| done      ", "| failing   ")
        made = "procedure failing {\n  status_report := failed\n}\n\n"
        return f"{before}{made}table pause{after}"

    _, proof = proved(tmp_path / "fails", fails)
    assert ending(proof, "pause").endless == ("1",)
    _, proof = proved(tmp_path / "done", lambda text: f"{text}\n")
    assert ending(proof, "pause").proved


def test_what_goes_round_while_the_command_is_answered_does_no_harm(tmp_path: Path) -> None:
    """A flag that the line of the end toggles: its states go round, and *done* is reported all the time."""

    def flips(status: str) -> Edit:
        lines = "  | 2 | false | going | | || state(d_state) | done |\n"
        edit = go(lines, "state flip : bool", work="flip := not flip")
        return lambda text: edit(text).replace(
            "/= going | | || | done |", f"/= going | | || work | {status} |"
        )

    _, proof = proved(tmp_path / "done", flips("done"))
    assert ending(proof, "go").proved
    _, proof = proved(tmp_path / "executing", flips("executing"))
    assert ending(proof, "go").endless == ("4",)
