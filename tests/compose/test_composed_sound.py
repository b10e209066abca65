"""Levels of which something false was once proved: each is as small as shows it, and the interpreter is the judge."""

import json
import re
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.claims import (
    ACCEPTED,
    AGAIN,
    CONTRACT,
    ENDING,
    RUNS,
    SAFE,
    Claim,
    Key,
    Need,
    closed,
)
from rcsc.compose.contract.environment import Asked, links
from rcsc.compose.contract.obligations import Obligation, Sort, unstated
from rcsc.compose.contract.properties import invariant_kept, property_kept
from rcsc.compose.contract.transition import GHOST, TransitionSystem
from rcsc.compose.counterexample.cycle_run import one_cycle, ran_on
from rcsc.compose.counterexample.explain import TraceSettings, explain
from rcsc.compose.counterexample.finding import of_trace
from rcsc.compose.counterexample.frozen import BadCaseError, case_breaks, read_case
from rcsc.compose.counterexample.lasso import Lasso, lassos
from rcsc.compose.counterexample.trace import TraceSearch
from rcsc.compose.proof.assume_guarantee import admitted, agreements, of_level
from rcsc.compose.proof.context import Context, of_lines
from rcsc.compose.proof.level import LevelProof, Verdict, prove_level
from rcsc.compose.proof.system import NoProgramError, loaded_program, transition_systems
from rcsc.compose.proof.termination import Ending
from rcsc.front.commands import run
from rcsc.lang.interpret import Fault, initial
from rcsc.lang.model import Program, Value, VariableName
from rcsc.lang.restart import Stands
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.run.description import BadDescription, description
from tests.small_hierarchies.explored import adopted
from tests.small_hierarchies.level import Reading, Role
from tests.support.programs.systems import (
    LITTLE,
    SYSTEM,
    TICK,
    WAY,
    going,
    lower_level,
    proved_level,
    small_level,
    small_proofs,
    small_system,
    small_text,
    solo_system,
)
from tests.support.programs.texts import edit_file, edited, system, without_row
from tests.support.proved import prove_system, ran, shortest


def ending(proof: LevelProof, table: str) -> Ending:
    return next(end for end in proof.endings if end.table == table)


def lines_run(ts: TransitionSystem, cycles: int, **inputs: Value) -> list[tuple[str, str]]:
    """The table and the line of each cycle under one command."""
    start = initial(ts.program)
    taken = {name: start[name] for name in ("command.inc_command", "command.input_command", "there")}
    taken |= {name.replace("__", "."): value for name, value in inputs.items()}
    return [(step.table, step.line) for step in ran(ts, start, [taken] * cycles)]


# --- what extern procedures give -----------------------------------------------------------------


ASKING = lower_level(
    going("2", on="true"),
    going("3", on="false", does="state(d_state)", status="done"),
    declared="state tick : bool\nstate raw : bool",
    seen="on := raw /= tick\n  tick := raw",
    parts='extern procedure ask reads there writes raw python "no_such_module:ask" c "ask"',
    after="answer, ask",
)


def test_an_extern_procedure_may_give_something_else_in_the_next_cycle(tmp_path: Path) -> None:
    ts, proof = proved_level(tmp_path, "lower", lower=ASKING)
    start = initial(ts.program)
    taken: dict[str, Value] = {"command.inc_command": 1, "command.input_command": 1, "there": False}
    turns = [(taken, (("ask", (at % 2 == 0,)),)) for at in range(40)]  # another answer each time
    lines = [(step.table, step.line) for step in ran_on(ts, start, turns)]
    assert set(lines[1:]) == {("go", "2")}  # for ever, where it answers so
    assert not ending(proof, "go").proved


def nested(inner: str) -> str:
    """Return a lower level that counts to 9, and a module of its preprocess that calls another, which is declared so."""
    return lower_level(
        *WAY,
        declared="state c : int 0 .. 9",
        seen="inner",
        begin="c := 0",
        work="c := min(c + 1, 9)",
        parts=inner,
    )


IN_A_MODULE = "module inner reads c writes on { on := c >= 9 }"
IN_CODE = 'extern procedure inner reads there writes on python "no_such_module:ask" c "ask"'


WHOLE_OF_WHAT_OVERFLOWS = lower_level(
    *WAY,
    declared="input r : real 0.0 .. 1.0e300",
    seen="if r * r < 5.0 {\n    on := int(r * r) >= 3\n  } else {\n    on := true\n  }",
)


@pytest.mark.parametrize(("lower", "ends"), [(nested(IN_A_MODULE), True), (WHOLE_OF_WHAT_OVERFLOWS, False)])
def test_what_the_preprocess_may_do_is_followed(lower: str, ends: bool, tmp_path: Path) -> None:
    """Calls, and the whole part of what may be no number."""
    ts, proof = proved_level(tmp_path, "lower", lower=lower)
    assert proof.open == ()
    assert ending(proof, "go").proved == ends
    every = dict(of_level(ts, proof))[ENDING]  # what a level above rests on
    assert set(every.rests_on) == {("lower", (Sort.ENDS, table, "")) for table in ("go", "pause")}


def test_a_refusal_in_the_preprocess_passes_over_a_new_command(tmp_path: Path) -> None:
    """The flag is up when the module calls the procedure, and down in the cycle after the one that ended there."""
    ts, proof = proved_level(tmp_path, "lower", lower=nested(IN_CODE))
    assert [(obligation.sort, obligation.table) for obligation in proof.open] == [(Sort.ANSWERED, "go")]
    found = shortest(ts, proof.open[0], 3)
    assert found is not None
    assert (found.steps[-1].fault, found.steps[-1].line) == (Fault.EXTERN, "")


# --- what selects the table ----------------------------------------------------------------------


def by_turns() -> str:
    """Return a lower level whose table changes in each cycle, whatever the command, and that never is done."""
    turn = "  if which = pause {\n    which := go\n  } else {\n    which := pause\n  }\n"
    return small_text(
        "lower",
        ("state cur_state", "state which : lower_command\nstate cur_state"),
        ("module receive reads command,", "module receive reads command, which,"),
        ("writes new_command,", "writes new_command, which,"),
        ("inc_command_seen := command.inc_command\n", f"inc_command_seen := command.inc_command\n{turn}"),
        ("by command.input_command", "by which"),
    ).replace("| done      ", "| executing")


def test_tables_that_take_turns_under_one_command_are_named(tmp_path: Path) -> None:
    ts, proof = proved_level(tmp_path, "lower", lower=by_turns())
    lines = lines_run(ts, 40, command__inc_command=1)
    assert {table for table, _ in lines[:2]} == {"go", "pause"} == {table for table, _ in lines[-2:]}
    assert all(not ending(proof, table).proved for table in ("go", "pause"))


# --- restarts ------------------------------------------------------------------------------------


def test_a_restart_adopts_an_order_only_under_the_name_that_the_system_knows(tmp_path: Path) -> None:
    """`adopt` knows `command`: of another record the number is not counted as seen, and is taken up once more."""
    path = small_system(tmp_path, lower=re.sub(r"\bcommand\b", "orders", small_text("lower")))
    edit_file(path, ('"lower.command"', '"lower.orders"'))
    ts = transition_systems(path)["lower"]
    assert ts.links.above is not None
    assert ts.links.above.order == "orders"
    start = initial(ts.program) | {"orders.inc_command": 7}
    step = one_cycle(ts, start, {"orders.inc_command": 7})
    assert step.after["new_command"]
    assert prove_level(ts, LITTLE).verdict(Sort.ONCE, "", "new_command") is not Verdict.PROVED


@pytest.mark.parametrize(
    ("stands", "echo"),
    [(None, 4), (None, 65535), (4, 4), (5, 4), (9, 4), (0, 65535), (65535, 65535), (65535, 65000)],
)
def test_the_proof_knows_every_state_that_a_restart_makes(stands: int | None, echo: int) -> None:
    """The order that stands in the level's own buffer may not be echoed yet: the next number is the one after that."""
    ts = transition_systems(SYSTEM)["upper"]
    role = Role(ts.program, ts.level, ts.links)
    now = role.start | {"command.inc_command": 7, "lower.inc_command_echo": echo}
    made = adopted(role, now, {} if stands is None else {"to_lower.inc_command": stands})
    assert made["to_lower.inc_command"] == ((echo if stands is None else stands) + 1) % 65536
    keyed, known = Keyed(), ts.restarted()
    same = [
        keyed.term(values.equal(known[leaf], values.constant(ts.kinds[leaf], int(value))))
        for leaf, value in made.items()
    ]
    solver = Solver()
    solver.add(*keyed.ranges, *same)
    assert solver.check() is Answer.SATISFIABLE


# --- who is above whom ---------------------------------------------------------------------------


RANKED = """use words

input command : lower_order
input below : lower_report

output to_below : lower_order
output report : lower_report

module receive reads command, below writes report {
  report.inc_command_echo := command.inc_command
  report.ref_command_echo := command.input_command
  report.status_report := below.status_report
}

procedure stay {
}

table work {
  | line | when || procedures |
  |------|------||------------|
  | 1    | true || stay       |
}

level NAME {
  period 40 [ms]
  preprocess receive
  table work
}
"""
"""It is done when the level below is."""


@pytest.mark.parametrize("many", [1, 2, 3])
@pytest.mark.parametrize("ring", [True, False])
def test_levels_that_take_orders_in_a_ring_are_no_system(many: int, ring: bool, tmp_path: Path) -> None:
    """Each would be shown to end its commands given that the next one does, and all of them may wait for ever."""
    names = [f"level{at}" for at in range(many)]
    (tmp_path / "words.rcs").write_text(small_text("words"), encoding="utf-8")
    buffers: dict[str, str] = {}
    for name, below in zip(names, (*names[1:], names[0] if ring else "station"), strict=True):
        (tmp_path / f"{name}.rcs").write_text(RANKED.replace("NAME", name), encoding="utf-8")
        buffers |= {f"{name}.to_below": f"{below}.command", f"{below}.report": f"{name}.below"}
    path = tmp_path / "system.toml"
    path.write_text(system(names, buffers, outside='["station"]'), encoding="utf-8")
    if ring:
        with pytest.raises(BadDescription, match="no highest level: `level0` takes orders of"):
            transition_systems(path)
    else:
        assert list(transition_systems(path)) == names


# --- what is assumed of a report, where the level does not number its orders ----------------------


ABOUT = """property about : lower.inc_command_echo = was to_lower.inc_command implies lower.ref_command_echo = was to_lower.input_command

module receive"""
UNNUMBERED = small_text(
    "upper",
    ("module receive", ABOUT),
    (
        "    to_lower.inc_command := (to_lower.inc_command + 1) mod 65536\n",
        "    new_command := new_command\n",
    ),
    (
        "module send reads to_lower, old_command writes to_lower,",
        "module send reads to_lower, old_command, new_command writes to_lower, new_command,",
    ),
)
"""Another command under the same number; and what is then no longer so, however honest the level below is."""


SKIPPING = small_text("upper", ("(to_lower.inc_command + 1)", "(to_lower.inc_command + 65535)"))
"""Every other number: one may be echoed that is the one after the last."""


@pytest.mark.parametrize("outside", [True, False])
@pytest.mark.parametrize(
    ("upper", "sort", "name"),
    [
        (UNNUMBERED, Sort.NUMBERED, "to_lower.input_command"),
        (SKIPPING, Sort.NEXT_NUMBER, "to_lower"),
    ],
    ids=["unnumbered", "skipping"],
)
def test_what_a_level_assumes_of_a_report_rests_on_how_it_numbers_its_orders(
    upper: str, sort: Sort, name: str, outside: bool, tmp_path: Path
) -> None:
    """The neighbour keeps to the protocol as far as the level does, whether it is a level or not."""
    path = small_system(tmp_path, upper=upper)
    if outside:
        edit_file(path, ('[[level]]\nname = "lower"\n', ""))
    proof = prove_system(path, LITTLE)
    wrong = ("upper", (sort, "", name))
    assert wrong not in {need for need, one in proof.closed.items() if one.accepted}
    for key in (
        (CONTRACT, "", "lower"),
        RUNS,
        *(obligation.key for obligation, _ in proof.levels[0].verdicts),
    ):
        assert (sort, "", name) == key or wrong in proof.of("upper", key).lacks, key


def test_an_honest_report_is_not_about_an_order_whose_number_stays(tmp_path: Path) -> None:
    """What the property says is broken by a run in which the level below echoes what it took."""
    ts = small_level(tmp_path, "upper", upper=UNNUMBERED)
    start = initial(ts.program)
    order = {"command.inc_command": 1, "command.input_command": 1}
    first = one_cycle(ts, start, order)
    assert first.after["to_lower.input_command"] == 1
    second = one_cycle(ts, first.after, order)
    assert not property_kept(ts, "about", first.after, second.after)


def test_an_invariant_is_kept_by_a_cycle_before_and_after_which_it_holds(tmp_path: Path) -> None:
    known = "\ninvariant known : begun or not new_command\n"
    ts = small_level(tmp_path, "upper", upper=small_text("upper") + known)
    good, bad = ({"begun": False, "new_command": new} for new in (False, True))
    kept = [invariant_kept(ts, "known", before, after) for before in (good, bad) for after in (good, bad)]
    assert kept == [True, False, False, False]


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
    path = small_system(tmp_path, lower=small_text("lower", ("use words", "use others")))
    (tmp_path / "others.rcs").write_text(small_text("words", OTHER[other]), encoding="utf-8")
    with pytest.raises(BadDescription, match="lower"):
        transition_systems(path)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('"upper.report2" = "lower.command"', "`lower.command` is filled twice"),
        ('"station.more" = "lower.cur_state"', "no input"),
        ('"station.more" = "lower.comand"', "has no variable `comand`"),
    ],
)
def test_a_buffer_fills_one_input_and_no_other_does(more: str, words: str, tmp_path: Path) -> None:
    path = small_system(tmp_path)
    path.write_text(path.read_text(encoding="utf-8") + more + "\n", encoding="utf-8")
    with pytest.raises(BadDescription, match=words):
        transition_systems(path)


def test_a_level_has_one_superior(tmp_path: Path) -> None:
    """The report echoes the orders of one: what the other assumes would be proved of none."""
    lower = small_text(
        "lower",
        ("input there", "input second : lower_order\ninput there"),
        ("output report", "output other : lower_report\noutput report"),
    )
    path = small_system(tmp_path, lower=lower)
    more = '"station.second" = "lower.second"\n"lower.other" = "station.other"\n'
    path.write_text(path.read_text(encoding="utf-8") + more, encoding="utf-8")
    with pytest.raises(BadDescription, match="numbered orders in `command` and in `second`"):
        transition_systems(path)


@pytest.mark.parametrize(
    ("keys", "wrong"), [(["command"], False), (["first.at"], True), (["command", "second.at"], True)]
)
def test_no_answer_of_the_database_is_a_key_of_a_question(
    keys: list[str], wrong: bool, tmp_path: Path
) -> None:
    """A level asks with what the cycle before left there: the key that the cycle sees has another answer."""
    text = (
        "enum which { a, b }\nrecord answer { at : which }\ninput command : which\ninput first : answer\ninput second : answer\n"
        "state y : bool\ntable t {\n  | line | second.at || y |\n  |---|---||---|\n  | 1 | a || true |\n  | 2 | b || false |\n}\n"
        "level solo { period 40 [ms] table t }\n"
    )
    path = solo_system(tmp_path, text)
    feeds = f'feed = [{{ into = "first", query = "q", keys = ["command"] }}, {{ into = "second", query = "q", keys = {json.dumps(keys)} }}]'
    edit_file(path, ('[[level]]\nname = "solo"\n', f'[[level]]\nname = "solo"\n{feeds}\n'))
    if wrong:
        with pytest.raises(BadDescription, match="answer of the database itself"):
            transition_systems(path)
    else:
        assert [one.into for one in transition_systems(path)["solo"].links.asked] == ["first", "second"]


def test_the_same_question_to_the_database_has_the_same_answer(tmp_path: Path) -> None:
    """Once it was asked, as long as its key stays."""
    text = (
        "enum which { a, b }\ninput key : which\ninput found : which\nstate y : bool\n"
        "table t {\n  | line | found || y |\n  |---|---||---|\n  | 1 | a || true |\n  | 2 | b || false |\n}\n"
        "level solo { period 40 [ms] table t }\n"
    )
    ts = transition_systems(solo_system(tmp_path, text))["solo"]
    ts = replace(ts, links=replace(ts.links, asked=(Asked("found", ("found",), ("key",)),)))
    cycle, terms, solver = ts.cycle(ts.havoc()), Keyed(), Solver()
    asked, same = cycle.before[f"{GHOST}found"], cycle.before[f"{GHOST}found key"]
    other = values.negation(values.equal(cycle.before["found"], cycle.taken["found"]))
    again = values.equal(same, cycle.taken["key"])
    parts = [terms.term(part) for part in (cycle.contract, other, again, asked)]
    solver.add(*terms.ranges)
    assert solver.check(*map(solver.switch, parts)) is Answer.UNSATISFIABLE
    assert solver.check(*map(solver.switch, [*parts[:2], parts[3]])) is Answer.SATISFIABLE
    assert solver.check(*map(solver.switch, parts[:3])) is Answer.SATISFIABLE
    assert ts.initial()[f"{GHOST}found"] is not values.TRUE


def test_what_is_shown_only_as_if_nothing_were_refused_trusts_that(tmp_path: Path) -> None:
    ts = small_level(tmp_path, "lower")
    ts.refusable = ("there",)
    safe = Obligation(Sort.SAFE, "", "", values.TRUE)
    shown, open_ = (
        LevelProof("lower", ((safe, verdict),), (), (), 0, 0, 0.0, context=Context((), (), restless=False))
        for verdict in (Verdict.PROVED, Verdict.NOT_PROVED)
    )
    for proof, trusts in ((shown, ()), (replace(shown, parts=(open_, shown)), admitted(ts))):
        claims = dict(of_level(ts, proof))
        assert claims[SAFE].trusts == trusts
        assert claims[AGAIN, "", ""].verdict is Verdict.PROVED
    assert admitted(ts) == ("`there` of level `lower` is never refused",)


# --- how levels begin ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small() -> dict[str, LevelProof]:
    return {level.level: level for level in small_proofs()[1].levels}


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
    speeds = small_text(
        "words", ("input_command : lower_command\n", "input_command : lower_command\n  speed : int 0 .. 9\n")
    )
    compares = small_text(
        "upper",
        (
            "to_lower.input_command /= old_command",
            "to_lower.speed /= old_speed or to_lower.input_command /= old_command",
        ),
        (
            "reads to_lower, old_command writes to_lower, old_command",
            "reads to_lower, old_command, old_speed writes to_lower, old_command, old_speed",
        ),
        ("  old_command := to_lower", "  old_speed := to_lower.speed\n  old_command := to_lower"),
        ("state new_command", "state old_speed : int 0 .. 9\nstate new_command"),
    )
    made = transition_systems(small_system(tmp_path, words=speeds, upper=compares))
    assert made["lower"].links.above is not None
    assert "command.speed" in made["lower"].links.above.numbered
    program = made["upper"].program
    other = tuple(replace(v, initial=value) if v.name == leaf else v for v in program.variables)
    made["upper"] = made["upper"].of(replace(program, variables=other))
    of_it = [
        agreement
        for agreement in agreements(made, small)
        if agreement.level == "upper" and not agreement.outside
    ]
    assert [promise.holds for promise in of_it] == [agree]


# --- new commands --------------------------------------------------------------------------------


FALLS_TO_DEFAULT = edited(
    without_row(small_text("upper"), "0"),
    ("DEFAULT unreachable", "DEFAULT            "),
    (
        "|       |                |           |           || nextstate(f_state)      | pause       | fail       |",
        "|       |                |           |           || begin; nextstate(f_state) | pause     | fail       |",
    ),
)
"""No line takes a new command that comes while the lower level is not idle; DEFAULT begins, and fails."""


def test_default_passes_over_a_new_command_like_any_line_that_does_not_look(tmp_path: Path) -> None:
    ts = small_level(tmp_path, "upper", upper=FALLS_TO_DEFAULT)
    role = Role(ts.program, ts.level, ts.links)
    now = initial(ts.program) | {"command.inc_command": 1, "command.input_command": 1}
    now |= {"lower.status_report": 1}  # it executes its first order
    ran_ = role.run(Reading(now))
    assert (ran_.table, ran_.line, ran_.after["begun"]) == ("work", "7", True)
    again = one_cycle(ts, ran_.after, {})
    again = one_cycle(ts, again.after, {"lower.inc_command_echo": again.after["to_lower.inc_command"]})
    assert not again.after["new_command"]  # nobody answered it
    assert prove_level(ts, LITTLE).verdict(Sort.ANSWERED, "work", "new_command") is not Verdict.PROVED


# --- values that leave their range ---------------------------------------------------------------


def test_a_program_is_in_order_by_itself_before_anything_is_proved_of_the_levels(tmp_path: Path) -> None:
    """A counter that runs past its range, taken to stay in it, would end every command, and keep any property."""
    over = lower_level(*WAY, declared="state c : int 0 .. 9", begin="c := 0", work="c := c + 1")
    with pytest.raises(
        NoProgramError, match=r"the value can lie outside 0 \.\. 9, the range of `c`: see `rcsc check"
    ):
        small_level(tmp_path, "lower", lower=over)


# --- answers that do not stay --------------------------------------------------------------------


DONE_NOW_AND_THEN = lower_level(going("2", on="true"), going("3", on="false", status="done"), **TICK)
"""Done, and executing again, in turns: whoever looks now and then may never see the one."""


def test_an_answer_that_does_not_stay_is_none(tmp_path: Path) -> None:
    """A superior is taken to see an answer some time: it has to stay until it does."""
    ts, proof = proved_level(tmp_path, "lower", lower=DONE_NOW_AND_THEN)
    lines = lines_run(ts, 40, command__inc_command=1, command__input_command=1)
    assert {line for _, line in lines[2:]} == {"2", "3"}
    assert ending(proof, "go").endless == ("2",)
    found = lassos(ts, ("go",), TraceSearch(8, legal=True))["go"]
    assert isinstance(found, Lasso)
    assert [step.line for step in found.trace.steps[found.first - 1 :]] in (["2", "3"], ["3", "2"])


def test_a_pause_that_fails_is_not_answered(tmp_path: Path) -> None:
    """Whoever orders PAUSE waits until it is done (`ends.answered`)."""
    fails = small_text(
        "lower",
        ("table pause", "procedure failing {\n  status_report := failed\n}\n\ntable pause"),
        ("| 1    | true || state(d_state) | done       |", "| 1    | true || state(d_state) | failing    |"),
    )
    _, proof = proved_level(tmp_path / "fails", "lower", lower=fails)
    assert ending(proof, "pause").endless == ("1",)
    _, proof = proved_level(tmp_path / "done", "lower")
    assert ending(proof, "pause").proved


def test_what_goes_round_while_the_command_is_answered_does_no_harm(tmp_path: Path) -> None:
    """A flag that the line of the end toggles: its states go round, and *done* is reported all the time."""

    def flips(status: str) -> str:
        ends = going("2", does="state(d_state)", status="done")
        idle = f"4 | false | d_state | | || work | {status}"
        return lower_level(ends, declared="state flip : bool", work="flip := not flip", idle=idle)

    _, proof = proved_level(tmp_path / "done", "lower", lower=flips("done"))
    assert ending(proof, "go").proved
    _, proof = proved_level(tmp_path / "executing", "lower", lower=flips("executing"))
    assert ending(proof, "go").endless == ("4",)


# --- extern procedures that are refused ------------------------------------------------------------


def asks(result: str, states: str, where: str = "line") -> str:
    """A level that keeps two states equal in each cycle, between them an extern procedure that gives `result`."""
    first, last = (f"{part} one" if where == part else "" for part in ("preprocess", "postprocess"))
    line = "one" if where == "line" else ""
    return f"""{states}
input go : bool
state a : bool
state b : bool
extern procedure ext reads go writes {result} python "no_such_module:f" c "extf"
module one reads go writes a, b, {result} {{ a := go; ext; b := go }}
property together : a = b
property in_range : a or not a
table t {{
  | line | go    || procedures |
  |------|-------||------------|
  | yes  | true  || {line}     |
  | no   | false || {line}     |
}}
level solo {{ period 40 [ms] {first} table t {last} }}
"""


RESULTS = {
    "a number": ("h", "state h : int -3 .. 9"),
    "all of a byte": ("h", "state h : int 0 .. 255"),
    "a truth value": ("h", "state h : bool"),
    "a member": ("h", "enum part { none, box }\nstate h : part"),
    "a real": ("h", "state h : real -1.0 .. 1.0"),
    "the second of two": ("h, i", "state h : int 0 .. 9\nstate i : int 0 .. 9"),
}


@pytest.mark.parametrize("result", RESULTS)
def test_a_result_that_is_refused_ends_the_cycle_whatever_its_type(result: str, tmp_path: Path) -> None:
    path = solo_system(tmp_path, asks(*RESULTS[result]))
    made = transition_systems(path)
    proof = prove_system(path, LITTLE)
    stated = {
        obligation.name: verdict
        for obligation, verdict in proof.levels[0].verdicts
        if obligation.sort is Sort.PROPERTY
    }
    assert stated == {"together": Verdict.NOT_PROVED, "in_range": Verdict.PROVED}
    [explanation] = explain(made, proof, TraceSettings(description(path), 4))
    assert explanation.finding is not None
    assert not explanation.beside
    assert explanation.finding.broken.fault is Fault.EXTERN
    assert explanation.in_c is (
        result not in {"all of a byte", "a truth value"}
    )  # no C function can give more


@pytest.mark.parametrize("result", ["a number", "a truth value"])
def test_the_replay_that_is_named_beside_a_run_replays_it(
    result: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the executors that can run it: no C function gives a truth value that is none."""
    path = solo_system(tmp_path, asks(*RESULTS[result]))
    assert run(["prove", "--no-cache", "--log", str(tmp_path / "runs"), str(path)]) == 1
    [command, *_] = re.findall(r"log: rcsc (replay .*)", capsys.readouterr().err)
    assert ("--executor python" in command) is (result == "a truth value")
    assert run(command.split()) == 0


@pytest.mark.parametrize("where", ["preprocess", "line", "postprocess"])
def test_a_cycle_ends_where_the_result_is_refused(where: str, tmp_path: Path) -> None:
    """Wherever the procedure is called: and only there does what comes after it not run."""
    path = solo_system(tmp_path, asks(*RESULTS["a number"], where))
    ts = transition_systems(path)["solo"]
    found = shortest(ts, next(obligation for obligation in prove_level(ts, LITTLE).open), 3)
    assert found is not None
    last = found.steps[-1]
    assert (last.after["a"], last.after["b"], last.after["h"]) == (True, False, last.before["h"])
    assert last.line == ("" if where == "preprocess" else "yes")


def test_the_prover_calls_no_code_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not where it proves, nor where it looks for runs, nor where it runs them, freezes them and runs the case."""
    (tmp_path / "of_the_user.py").write_text("import os\nos._exit(0)\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    text = edited(asks(*RESULTS["a number"]), ("no_such_module", "of_the_user"))
    path = solo_system(tmp_path, text)
    found, kept = tmp_path / "found", tmp_path / "cases"
    assert run(["prove", str(path), "--log", str(found), "--freeze", str(kept), "--jobs", "2"]) == 1
    [log] = found.glob("*.mcap")
    assert run(["replay", str(log), "--generated", str(found / "generated")]) == 0
    [case] = kept.glob("*.json")
    assert run(["prove", "--case", str(case)]) == 1  # as it expects the property to be kept
    edit_file(path.with_name("solo.rcs"), ("a := go; ext;", "ext; a := go;"))
    assert run(["prove", "--case", str(case)]) == 0


def test_a_case_that_says_what_no_extern_procedure_gives_is_none(tmp_path: Path) -> None:
    path = solo_system(tmp_path, asks(*RESULTS["a number"]))
    kept = tmp_path / "cases"
    assert run(["prove", str(path), "--freeze", str(kept)]) == 1
    [case] = kept.glob("*.json")
    form = json.loads(case.read_text(encoding="utf-8"))
    for wrong in (["ext", []], ["one", [1]], ["ext", ["x"]], ["ext", [None]], "ext"):
        form["answers"][0]["solo"] = [wrong]
        case.write_text(json.dumps(form), encoding="utf-8")
        with pytest.raises(BadCaseError, match=r"extern procedure that gives|no frozen finding"):
            case_breaks(read_case(case))


ASKS = """state h : int 0 .. 9
extern procedure ask reads there writes h python "no_such_module:f" c "ask"

procedure state("""
STARTS_BY_ASKING = small_text(
    "lower", ("procedure state(", ASKS), ("|| state(going)   |", "|| ask; state(going) |")
)
"""The line that takes a new command asks first; where that is refused, the flag is down when the next cycle comes."""


def test_a_new_command_whose_line_is_cut_short_is_passed_over(tmp_path: Path) -> None:
    ts, proof = proved_level(tmp_path, "lower", lower=STARTS_BY_ASKING)
    assert proof.verdict(Sort.ANSWERED, "go", "new_command") is Verdict.NOT_PROVED
    obligation = next(owed for owed in proof.open if owed.sort is Sort.ANSWERED)
    found = shortest(ts, obligation, 3)
    assert found is not None
    assert found.steps[-1].fault is Fault.EXTERN
    finding = of_trace(ts, obligation, found)
    assert finding.ticks[-1]["lower"].line == "4"  # done, though it never began


@pytest.mark.parametrize("cell", ["", "in {true, false}", "new_command"])
def test_a_cell_that_lets_both_values_of_the_flag_pass_looks_for_no_command(
    cell: str, tmp_path: Path
) -> None:
    lower = small_text(
        "lower",
        ("| 1    | true        |           |", "| 1 | true | /= d_state |"),
        (
            "| 4    | false       | d_state   |       ||                | done       |",
            f"| 4 | {cell} | d_state | || | done |\n| 5 | false | f_state | || | done |",
        ),
    )
    _, proof = proved_level(tmp_path, "lower", lower=lower)
    assert proof.verdict(Sort.ANSWERED, "go", "new_command") is Verdict.NOT_PROVED


SHOWS_A_SAFE_VALUE = small_text(
    "lower",
    (
        "output report : lower_report",
        "output report : lower_report\noutput open : bool = false safe true\nproperty shut : not open",
    ),
)
"""A cycle that refuses an input leaves `open`; no cycle that takes its inputs does."""


def test_a_property_trusts_that_no_input_is_refused_where_an_output_has_a_safe_value(tmp_path: Path) -> None:
    safe = SHOWS_A_SAFE_VALUE.replace("input there", "input load : int 0 .. 2\ninput there")
    whole = prove_system(small_system(tmp_path, lower=safe), LITTLE)
    found = whole.of("lower", (Sort.PROPERTY, "", "shut"))
    assert found.proved
    kept = "`station` keeps to the protocol"
    assert found.trusts == ("`load` of level `lower` is never refused", kept)
    assert whole.of("lower", (Sort.SOME_LINE, "go", "")).trusts == (kept,)


STOPS = small_text(
    "lower",
    ("input there", "input load : int 0 .. 2\nassume loaded monitored : load /= 0\ninput there"),
    ("state cur_state", "state rate : int 0 .. 6\nstate cur_state"),
    ("procedure state(", "procedure slow { rate := 6 / load }\n\nprocedure state("),
    ("|| state(going)   |", "|| slow; state(going) |"),
    ("table go {", "table go assuming loaded {"),
)
"""Every line looks for a new command; each divides by an input, which is assumed not to be zero."""


def test_a_new_command_is_passed_over_where_a_stopping_assumption_fails(tmp_path: Path) -> None:
    """Whether or not there are extern procedures."""
    ts, proof = proved_level(tmp_path, "lower", lower=STOPS)
    obligation = next(owed for owed in proof.open if owed.sort is Sort.ANSWERED)
    found = shortest(ts, obligation, 3)
    assert found is not None
    assert (obligation.table, found.steps[-1].fault) == ("go", Fault.ASSUMPTION)


def test_an_echo_never_goes_back_so_that_nothing_is_trusted_of_the_cycle_after_a_restart(
    tmp_path: Path,
) -> None:
    """It may be refused, or stop: the report that the level then gives still echoes what it echoed."""
    path = small_system(tmp_path, lower=STOPS)
    whole = prove_system(path, LITTLE)
    echoes = whole.of("lower", (Sort.ECHOES, "", "report"))
    assert echoes.accepted
    assert echoes.trusts == ("`station` keeps to the protocol",)
    ts = transition_systems(path)["lower"]
    adopted = {
        leaf: ts.program.adopted[leaf] for leaf in ("report.inc_command_echo", "report.ref_command_echo")
    }
    assert set(adopted.values()) == {Stands()}
    others = {VariableName(leaf): how for leaf, how in ts.program.adopted.items() if leaf not in adopted}
    forgets = replace(ts.program, restart=tuple(others.items()))
    assert Sort.ECHOES in {owed.sort for owed in prove_level(ts.of(forgets), LITTLE).open}


@pytest.mark.parametrize(
    ("order", "adopted"), [("to_lower", "adopt to_lower.inc_command := 1\n"), ("told", "")]
)
def test_a_restart_gives_no_order_a_number_that_one_before_it_had(
    order: str, adopted: str, tmp_path: Path
) -> None:
    """As `adopt` would, or where the order is not called so that its number goes by its name: the level below takes it for that one."""
    path = small_system(tmp_path, upper=small_text("upper").replace("to_lower", order) + adopted)
    path.write_text(path.read_text(encoding="utf-8").replace("to_lower", order), encoding="utf-8")
    whole = prove_system(path, LITTLE)
    assert whole.of("upper", (Sort.NEXT_NUMBER, "", order)).verdict is Verdict.NOT_PROVED
    assert ("upper", (Sort.NEXT_NUMBER, "", order)) in whole.of("lower", RUNS).lacks
    systems = transition_systems(path)
    found = next(
        each
        for each in explain(systems, whole, TraceSettings(description(path), 3))
        if each.obligation.sort is Sort.NEXT_NUMBER
    )
    assert found.finding is not None
    assert found.finding.restarted
    assert found.notes == (
        f"after a restart `{order}.inc_command` may be the number of an earlier order: it does not count on from that",
    )


def test_a_level_that_begins_anew_says_failed_though_it_takes_nothing_yet(tmp_path: Path) -> None:
    """Its first cycles may be refused, or stop: the report says nothing else of the order that stands, and nothing is trusted of that."""
    path = small_system(tmp_path, lower=STOPS)
    found = prove_system(path, LITTLE).of("lower", (Sort.FAILED_STAYS, "", "report"))
    assert found.proved
    assert found.trusts == ("`station` keeps to the protocol",)
    ts = transition_systems(path)["lower"]
    others = ((leaf, how) for leaf, how in ts.program.adopted.items() if leaf != "report.status_report")
    forgets = replace(ts.program, restart=tuple((VariableName(leaf), how) for leaf, how in others))
    proof = prove_level(ts.of(forgets), LITTLE)
    assert Sort.FAILED_STAYS in {owed.sort for owed in proof.parts[0].open}


# --- what verdicts rest on -------------------------------------------------------------------------


FAILS = """enum st {{ a, f_state }}
input go : bool
state cur_state : st
state n : int 0 .. 9
invariant never_failed : cur_state /= f_state
assume small monitored : n <= 9 or go
property never_ten : n /= 10
procedure step {{ if cur_state = f_state {{ n := {step} }} }}
table t assuming small {{
  | line | go    || procedures |
  |------|-------||------------|
  | yes  | true  || step       |
  | no   | false || step       |
}}
level solo {{ period 40 [ms] table t }}
"""


@pytest.mark.parametrize(("step", "rests"), [("n + 1", True), ("min(n + 1, 9)", False)])
def test_what_is_safe_only_under_an_invariant_falls_with_it(step: str, rests: bool, tmp_path: Path) -> None:
    """A restart breaks the invariant: then the counter leaves its range, if only the invariant kept it there."""
    path = solo_system(tmp_path, FAILS.format(step=step))
    whole = prove_system(path, LITTLE)
    broken: Key = (Sort.INVARIANT, "", "never_failed")
    assert whole.of("solo", broken).verdict is Verdict.NOT_PROVED
    for key in [(Sort.ASSUMPTION, "t", "small"), (Sort.PROPERTY, "", "never_ten"), (Sort.ONE_LINE, "t", "")]:
        found = whole.of("solo", key)
        assert found.accepted
        assert found.proved is not rests
        assert found.lacks == ((("solo", broken),) if rests else ())


def test_what_a_restart_breaks_is_not_proved_anywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = solo_system(tmp_path, FAILS.format(step="n + 1"))
    assert run(["prove", str(path), "--trace", "0"]) == 1
    said = capsys.readouterr().out
    assert re.search(r"small +monitored: rests on invariant `never_failed`", said)
    assert re.search(r"never_ten +rests on invariant `never_failed`", said)
    assert run(["check", str(tmp_path / "solo.rcs")]) == 1
    assert "level `solo` is not proved" in (checked := capsys.readouterr().out)
    assert "error[RCS416]: the values after a restart do not satisfy invariant `never_failed`" in checked
    assert "kept by the levels together" not in checked


def within(text: str) -> str:
    """The preprocess breaks the invariant, and the postprocess mends it: in between the index is outside."""
    return f"""state at : int 0 .. 9
state list : array[4] of int 0 .. 9
input go : bool
invariant inside : at <= 3
module break_it reads go writes at {{ at := {text} }}
module mend_it writes at {{ at := 0 }}
procedure use {{ list[at] := 1 }}
table t {{
  | line | go    || procedures |
  |------|-------||------------|
  | yes  | true  || use        |
  | no   | false ||            |
}}
level solo {{ period 40 [ms] preprocess break_it table t postprocess mend_it }}
"""


@pytest.mark.parametrize(("text", "safe"), [("9", False), ("3", True)])
def test_an_invariant_that_is_broken_within_a_cycle_keeps_nothing_safe(
    text: str, safe: bool, tmp_path: Path
) -> None:
    whole = prove_system(solo_system(tmp_path, within(text)), LITTLE)
    assert whole.of("solo", (Sort.INVARIANT, "", "inside")).accepted
    assert whole.of("solo", SAFE).accepted is safe
    assert whole.of("solo", (Sort.ONE_LINE, "t", "")).proved is safe


def test_what_breaks_where_invariants_are_broken_within_a_cycle_is_shown_by_a_run(tmp_path: Path) -> None:
    text = edited(
        within("9"),
        ("table t {", "procedure hop { next later := 0 later := 1 }\ntable t {"),
        ("| false ||            |", "| false || hop        |"),
        ("input go", "state later : int 0 .. 1 deferred until go\ninput go"),
    )
    made = transition_systems(solo_system(tmp_path, text))["solo"]
    obligation = next(owed for owed in prove_level(made, LITTLE).open if owed.sort is Sort.DEFERRED)
    trace = shortest(made, obligation, 3)
    assert trace is not None
    assert [step.line for step in trace.steps] == ["no"]


@pytest.mark.parametrize("runs", [True, False])
def test_what_is_not_safe_within_a_cycle_is_shown_by_a_run_that_no_executor_does(
    runs: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where the run meets what is not defined, the interpreter cannot do it either: then that is said."""
    use_anyway = ("| no   | false ||            |", "| no   | false || use        |")
    text = within("9") if runs else edited(within("9"), use_anyway)
    path = solo_system(tmp_path, text)
    kept, found = tmp_path / "cases", tmp_path / "found"
    assert run(["prove", str(path), "--log", str(found), "--freeze", str(kept)]) == 1
    said = capsys.readouterr()
    assert "within a cycle: not proved" in said.out
    assert ("as the interpreter runs it; executors are to run nothing that is not safe" in said.err) is runs
    assert ("the run that shows it meets an operation that is not defined" in said.err) is not runs
    assert "cycles or fewer" not in said.err
    assert not list(found.glob("*.mcap"))
    cases = list(kept.glob("*.json"))
    assert len(cases) == runs
    for case in cases:
        assert case_breaks(read_case(case))
        path.with_name("solo.rcs").write_text(within("3"), encoding="utf-8")
        assert not case_breaks(read_case(case))


def test_what_a_line_breaks_and_the_postprocess_mends_is_shown_by_its_run(tmp_path: Path) -> None:
    """The table saw nothing wrong, and nothing is wrong after the cycle."""
    text = edited(
        within("0"),
        ("procedure use", "procedure away { at := 9 }\nprocedure use"),
        ("| false ||            |", "| false || away       |"),
    )
    made = transition_systems(solo_system(tmp_path, text))
    [safe] = [obligation for obligation in prove_level(made["solo"], LITTLE).open if obligation.key == SAFE]
    trace = shortest(made["solo"], safe, 3)
    assert trace is not None
    assert [step.line for step in trace.steps] == ["no"]


def test_a_fault_of_one_level_shows_in_the_verdicts_of_its_neighbours(tmp_path: Path) -> None:
    """Behind it nobody knows what the level orders."""
    gap = ("| 4    | false               |       | go ", "| 4    | false               | true  | go ")
    path = small_system(tmp_path, upper=without_row(small_text("upper", gap), "7"))
    whole = prove_system(path, LITTLE)
    lost = ("upper", (Sort.SOME_LINE, "work", ""))
    assert whole.closed[lost].verdict is Verdict.NOT_PROVED
    assert lost in whole.of("lower", (Sort.ECHOES, "", "report")).lacks
    assert not whole.whole


def drawn_claims(random: Random) -> dict[Need, Claim]:
    """Some claims that rest on others, and on some that nobody made."""
    needs: list[Need] = [("level", ("sort", "", str(at))) for at in range(7)]
    verdicts = [Verdict.PROVED] * 3 + [Verdict.TRUSTED, Verdict.NOT_PROVED, Verdict.UNDECIDED]
    return {
        need: Claim(
            random.choice(verdicts),
            tuple(random.sample(needs, random.choice((0, 1, 1, 2)))),
            (need[1][2],) if random.random() < 0.2 else (),
        )
        for need in needs[: random.randint(4, 7)]
    }


def reached_from(need: Need, made: dict[Need, Claim]) -> set[Need]:
    """What the claim rests on by any way, and itself."""
    reached, waiting = set[Need](), [need]
    while waiting:
        here = waiting.pop()
        if here not in reached:
            reached.add(here)
            waiting += made[here].rests_on if here in made else ()
    return reached


def test_claims_close_over_what_they_rest_on() -> None:
    """Against the meaning: proved is what reaches nothing that is not found, by any way through the claims."""
    random = Random(7)  # noqa: S311  # repeatable on purpose
    for _ in range(300):
        made = drawn_claims(random)
        for need, found in closed(made).items():
            reached = reached_from(need, made)
            bad = {other for other in reached if other not in made or made[other].verdict not in ACCEPTED}
            assert found.proved == (not bad)
            assert set(found.lacks) == bad - {need}
            assert set(found.trusts) == {
                text for other in reached if other in made for text in made[other].trusts
            }


# --- what the tables say of what comes from outside ------------------------------------------------


BELIEVES = """input x : bool
state y : bool
assume never assumed : {says}
property stays : not y
table t assuming never {{
  | line | x    || y    |
  |------|------||------|
  | 1    | true || true |
  | 2    | false||      |
}}
level solo {{ period 40 [ms] table t }}
"""


def test_what_is_assumed_of_an_input_is_used_and_named_in_every_verdict(tmp_path: Path) -> None:
    whole = prove_system(solo_system(tmp_path, BELIEVES.format(says="not x or y")), LITTLE)
    assert whole.of("solo", (Sort.ASSUMPTION, "t", "never")).verdict is Verdict.TRUSTED
    stays = whole.of("solo", (Sort.PROPERTY, "", "stays"))
    assert stays.proved
    assert stays.trusts == (
        "assumption `never` of level `solo`, as it is declared",
        "level `solo` can be as its tables declare in every state that it comes to",
    )
    assert whole.proved


IMPOSSIBLE = """input x : int 0 .. 4
state n : int 1 .. 4
{more}
assume odd assumed : x * 2 = n * 2 + {by}
invariant above : n > 1
property never : x = 9 - n
table t assuming odd {{
  | line | when ||
  |------|------||
  | 1    | true ||
}}
level solo {{ period 40 [ms] {before} table t }}
"""
SPOILT = "module spoil reads x, n writes n { n := min(n + x, 4) }"


@pytest.mark.parametrize(
    ("by", "more", "before", "possible"),
    [(2, "", "", True), (1, "", "", False), (1, SPOILT, "preprocess spoil", False)],
)
def test_nothing_is_proved_of_what_no_cycle_can_be(
    by: int, more: str, before: str, possible: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From a contradiction everything follows, even an invariant that is broken from the beginning."""
    path = solo_system(tmp_path, IMPOSSIBLE.format(by=by, more=more, before=before))
    whole = prove_system(path, LITTLE)
    odd = Sort.ASSUMPTION, "t", "odd"
    assert whole.of("solo", odd).verdict is (Verdict.TRUSTED if possible else Verdict.NOT_PROVED)
    assert not whole.of("solo", (Sort.INVARIANT, "", "above")).proved
    if not possible:
        assert ("solo", odd) in whole.of("solo", (Sort.PROPERTY, "", "never")).lacks
        assert run(["prove", str(path), "--no-cache"]) == 1
        assert "no first cycle can be as the tables declare" in capsys.readouterr().err


BY_TURNS = """enum which {{ rest, work, never }}
input command : which
input x : int 0 .. 4
state y : bool
{states}
assume odd assumed : {says}
property stays : not y
table idle {{
  | line | when || y |
  |------|------||---|
  | 1    | true ||   |
}}
table busy assuming odd {{
  | line | when || y    |
  |------|------||------|
  | 1    | true || true |
}}
level solo {{ period 40 [ms] table by command {{ rest : idle work : busy never : idle }} }}
"""


@pytest.mark.parametrize(
    ("says", "states", "verdict"),
    [
        ("x * 2 = 3", "", Verdict.NOT_PROVED),  # the table by itself is told, too
        ("x < 3 and on", "state on : bool", Verdict.NOT_PROVED),  # no state in which it can be
        ("x < 3 or on", "state on : bool", Verdict.TRUSTED),
    ],
)
def test_nothing_is_proved_of_a_table_that_cannot_run_as_it_declares(
    says: str, states: str, verdict: Verdict, tmp_path: Path
) -> None:
    """Other tables can, and every cycle that would run this one is left out as impossible."""
    whole = prove_system(solo_system(tmp_path, BY_TURNS.format(says=says, states=states)), LITTLE)
    assert whole.of("solo", (Sort.ASSUMPTION, "busy", "odd")).verdict is verdict
    assert not whole.of("solo", (Sort.PROPERTY, "", "stays")).proved


LATER = """input x : int 0 .. 4
state n : int 0 .. 9
assume room assumed : x + n <= 5
property few : n <= 6
procedure count { n := min(n + 1, 9) }
table t assuming room {
  | line | when || procedures |
  |------|------||------------|
  | 1    | true || count      |
}
level solo { period 40 [ms] table t }
"""


def test_what_cannot_be_as_declared_in_a_later_state_is_told_as_taken_for_granted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """After six cycles no input is: that the property holds says nothing of the seventh."""
    path = solo_system(tmp_path, LATER)
    ts = transition_systems(path)["solo"]
    now = initial(ts.program)
    for _ in range(7):
        now = dict(one_cycle(ts, now, {"x": 0}).after)
    assert not property_kept(ts, "few", now, now)
    assert run(["prove", str(path), "--no-cache"]) in {0, 1}
    said = capsys.readouterr().out.partition("taken for granted\n")[2]
    assert "level `solo` can be as its tables declare in every state that it comes to" in said


def test_what_is_assumed_of_state_alone_is_to_be_proved(tmp_path: Path) -> None:
    """The level itself decides it, so that nobody has to believe it: and it may be wrong."""
    path = solo_system(tmp_path, BELIEVES.format(says="not y"))
    made, whole = transition_systems(path), prove_system(path, LITTLE)
    assert whole.of("solo", (Sort.ASSUMPTION, "t", "never")).verdict is Verdict.NOT_PROVED
    explanation = [
        explained
        for explained in explain(made, whole, TraceSettings(description(path), 4))
        if explained.obligation.sort is Sort.ASSUMPTION
    ]
    assert [(explained.finding is not None, explained.beside) for explained in explanation] == [(True, ())]


@pytest.mark.parametrize("how", ["assumed", "monitored"])
def test_nothing_is_called_monitored_that_no_executor_checks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], how: str
) -> None:
    text = BELIEVES.format(says="not y").replace(" assumed ", f" {how} ")
    assert run(["prove", str(solo_system(tmp_path, text)), "--no-cache", "--jobs", "1"]) == 1
    said = next(line.split() for line in capsys.readouterr().out.splitlines() if " never " in line)
    assert said == ["t", "never", f"{how}:", "not", "proved", "of", "the", "levels", "together"]


# --- what is not recognised ------------------------------------------------------------------------


UNREAD = {
    "the flag": ("new_command", "fresh", "lower", {Sort.ONCE, Sort.ANSWERED}),
    "the number": ("inc_command(?=_echo|_seen|)", "serial", "lower", {Sort.PROTOCOL}),
    "the command": ("input_command", "wanted", "lower", {Sort.PROTOCOL}),
    "the echo": ("ref_command_echo", "answering", "lower", {Sort.PROTOCOL}),
}


@pytest.mark.parametrize("part", UNREAD)
def test_no_goal_is_left_out_because_of_a_name(part: str, tmp_path: Path) -> None:
    old, new, level, sorts = UNREAD[part]
    files = ("lower", "upper") if part == "the flag" else ("lower", "upper", "words")
    path = small_system(tmp_path, **{name: re.sub(rf"\b{old}", new, small_text(name)) for name in files})
    whole = prove_system(path, LITTLE)
    left = next(one for one in whole.levels if one.level == level).unstated
    assert {missing.sort for missing in left} >= sorts
    assert not whole.whole  # which is what `rcsc prove --strict` ends by


def test_a_flag_is_looked_for_in_every_cell(tmp_path: Path) -> None:
    """In an expression it is looked for as well as in a column of its own."""
    inside = ("| line | new_command |", "| line | not not new_command |")
    ts = small_level(tmp_path, "lower", lower=small_text("lower", inside))
    assert unstated(ts) == ()


# --- what is found of lines ------------------------------------------------------------------------


ONCE_ONLY = """input go : bool
state begun : bool
output o : bool
procedure begin { begun := true }
enum step { one, two, never }
state now : step
table t {
  | line  | begun | now      || procedures | o     |
  |-------|-------|----------||------------|-------|
  | first | false |          || begin      | true  |
  | later | true  | /= never ||            | false |
  | spare | true  | never    ||            | false |
}
level solo { period 40 [ms] table t }
"""


def test_a_line_that_only_the_first_cycle_runs_is_reached_and_a_state_that_nothing_enters_is_not(
    tmp_path: Path,
) -> None:
    whole = prove_system(solo_system(tmp_path, ONCE_ONLY), LITTLE)
    seen = whole.levels[0].context
    assert seen is not None
    assert (seen.unreached, seen.unsure) == ((("t", "spare"),), ())


def test_a_fourth_status_answers_nothing(tmp_path: Path) -> None:
    waits = small_text(
        "lower",
        ("| 4    | false       | d_state   |       ||                | done       |",
         "| 4    | false       | d_state   |       ||                | waits      |"),
        ("procedure done", "procedure waits {\n  status_report := waiting\n}\n\nprocedure done"),
    )  # fmt: skip
    words = small_text("words", ("done, executing, failed }", "done, executing, failed, waiting }"))
    _, proof = proved_level(tmp_path, "lower", lower=waits, words=words)
    assert "4" in ending(proof, "go").endless


def test_a_table_of_several_commands_is_one_goal(tmp_path: Path) -> None:
    """Or the verdict of one command would stand for that of the other."""
    words = small_text("words", ("{ pause, go }", "{ pause, go, run }"))
    lower = small_text("lower", ("    go : go\n", "    go : go\n    run : go\n"))
    _, proof = proved_level(tmp_path, "lower", words=words, lower=lower)
    keys = [obligation.key for obligation, _ in proof.verdicts]
    assert len(keys) == len(set(keys))


def program_at(path: Path, level: str) -> Program:
    system = description(path)
    return loaded_program(path, system, next(spec for spec in system.levels if spec.name == level))[0]


def test_a_neighbour_outside_need_not_speak_of_orders() -> None:
    """The gripper drives the hand and senses it; nothing of that is an order that was not recognised."""
    path = Path(__file__).parents[2] / "tables" / "system.toml"
    program = program_at(path, "gripper")
    found = links(description(path), "gripper", program)
    assert [variable.name for variable in program.variables if variable.name.startswith("to_hand.")]
    assert found.unread == ()


@pytest.mark.parametrize(
    ("renamed", "lacks"),
    [
        ("command.number", "has no `inc_command`"),
        ("command.head.inc_command", "is not one order and one report"),
    ],
)
def test_what_two_levels_say_to_each_other_is_named_where_it_is_no_order(
    tmp_path: Path, renamed: str, lacks: str
) -> None:
    path = small_system(tmp_path)
    program = program_at(path, "lower")
    variables = tuple(
        replace(variable, name=VariableName(renamed)) if variable.name == "command.inc_command" else variable
        for variable in program.variables
    )
    found = links(description(path), "lower", replace(program, variables=variables))
    assert found.unread[0] == f"what `lower` and `upper` say to each other (`command`, `report`) {lacks}"


def test_what_lines_write_is_what_all_their_actions_do(tmp_path: Path) -> None:
    assert of_lines(small_level(tmp_path, "upper")) == {
        "begun", "cur_state.next", "status_report", "to_lower.input_command",
    }  # fmt: skip
    directly = small_text(
        "upper",
        ("state new_command", "state tries : int 0 .. 9\nstate new_command"),
        ("|| begin; nextstate(going) | go ", "|| begin; tries := 1; nextstate(going) | go "),
    )
    assert "tries" in of_lines(small_level(tmp_path / "directly", "upper", upper=directly))


# --- what is shown -----------------------------------------------------------------------------------


def test_a_report_without_a_status_is_an_error_that_names_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    texts = {
        name: small_text(name).replace("status_report", "outcome") for name in ("upper", "lower", "words")
    }
    path = small_system(tmp_path, **texts)
    assert run(["prove", str(path)]) == 1
    assert "there is no `upper.report.status_report`" in capsys.readouterr().err


STOPPED = """input at : int 0 .. 3
input go : bool
state seen : array[2] of bool
state was_asked : bool
output hold : bool = false safe true
assume room monitored : at < 2
property answered : go implies was_asked
property moves : not hold
procedure mark {{ seen[at] := true }}
module ask reads go writes was_asked {{ was_asked := go }}
table t assuming room {{
  | line | go    || procedures | hold  |
  | yes  | true  || mark{calls} | false |
  | no   | false || {idle} | false |
}}
level solo {{ period 40 [ms] {before} table t {after} }}
"""


@pytest.mark.parametrize(
    ("calls", "idle", "before", "after", "broken"),
    [
        ("", "", "", "postprocess ask", {"answered", "moves"}),
        ("; ask", "ask", "", "", {"answered", "moves"}),
        ("", "", "preprocess ask", "", {"moves"}),
    ],
)
def test_a_cycle_that_a_stopping_assumption_ends_is_shown_as_it_ran(  # where it may be asked
    calls: str,
    idle: str,
    before: str,
    after: str,
    broken: set[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """No line, no postprocess, the safe value: by the interpreter and by both executors, and in words."""
    path = solo_system(tmp_path, STOPPED.format(calls=calls, idle=idle, before=before, after=after))
    whole = prove_system(path, LITTLE)
    stated = {"answered", "moves"}
    assert {name for name in stated if not whole.of("solo", (Sort.PROPERTY, "", name)).proved} == broken
    assert run(["prove", str(path), "--log", str(tmp_path / "found"), "--json"]) == 1
    explanation = {one["name"]: one for one in json.loads(capsys.readouterr().out)["findings"]}
    assert explanation.keys() == {*broken, "room"}
    for name, one in explanation.items():
        [row] = one["time_line"]
        assert one["reproduces"]
        assert (row["line"], row["takes"]["at"]) == ("none", "2")
        assert row["leaves"]["hold"] == "true"
        wrong = "" if name == "room" else f"; property `{name}` is broken"
        assert row["wrong"] == f"assumption `room` fails; the cycle ends there{wrong}"
