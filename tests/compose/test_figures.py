"""What is stated of levels and asked about them, exactly: goals, what is missing for a goal, predicates, claims in words, questions."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest

from rcsc.compose.contract.claims import (
    CONTRACT,
    ENDING,
    RUNS,
    SAFE,
    STANDS,
    Claim,
    Key,
    Promise,
    Verdict,
    spelled,
)
from rcsc.compose.contract.environment import Above, links
from rcsc.compose.contract.obligations import Sort, Unstated, obligations, pairs, unstated
from rcsc.compose.contract.properties import every_predicate
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.invariant.confirm import Confirmation
from rcsc.compose.proof.assume_guarantee import _of_ending, of_level, promises
from rcsc.compose.proof.level import LevelProof, _of_possible, certificate
from rcsc.compose.proof.termination import Ending, Flow
from rcsc.lang.leaves import parts
from rcsc.lang.meaning import spelled as spelled_expression
from rcsc.lang.model import Bool, Int, OneTable, TableName, VariableName
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.run.description import BadDescription, Description, Wire, description
from tests.support.programs.systems import (
    SYSTEM,
    alone,
    going,
    lower_level,
    proved_level,
    small_level,
    small_text,
)


def any_cycle(ts: TransitionSystem) -> Cycle:
    return ts.cycle(ts.havoc())


@pytest.fixture(scope="module")
def upper(tmp_path_factory: pytest.TempPathFactory) -> TransitionSystem:
    return small_level(tmp_path_factory.mktemp("small"), "upper")


@pytest.fixture(scope="module")
def lower(tmp_path_factory: pytest.TempPathFactory) -> tuple[TransitionSystem, LevelProof]:
    return proved_level(tmp_path_factory.mktemp("small"), "lower")


# --- goals --------------------------------------------------------------------------------

GOALS = """\
SOME_LINE, table `rest`: some line matches
ONE_LINE, table `rest`: no two lines match
ASSUMPTION, table `work`: assumption `in_step`
NO_DEFAULT, table `work`: DEFAULT is not reached
ONE_LINE, table `work`: no two lines match
ECHOES, table ``: the report echoes the command that it answers: `report`
DONE_STAYS, table ``: done stays done: `report`
FAILED_STAYS, table ``: failed stays failed: `report`
NUMBERED, table ``: the order changes only with its number: `to_lower.input_command`
NEXT_NUMBER, table ``: numbers are used one after the other: `to_lower`
WAITS, table ``: no other command replaces an order before its echo, but for a new command: `to_lower`
PAUSES, table ``: a PAUSE is passed on in the cycle that takes it: `to_lower`
ONCE, table ``: a command number is taken up once: `new_command`
DEFERRED, table ``: no state is written directly while another is pending: `cur_state`
"""


def test_the_goals_of_a_level_are_stated_word_for_word(upper: TransitionSystem) -> None:
    found = [
        f"{obligation.sort.name}, table `{obligation.table}`: {obligation.shown}"
        for obligation in obligations(upper, any_cycle(upper))
    ]
    assert found == GOALS.splitlines()
    assert all(
        type(part) is str
        for obligation in obligations(upper, any_cycle(upper))
        for part in obligation.key[1:]
    )
    assert unstated(upper) == ()


def test_pairs_of_lines_that_may_meet_are_stated_and_no_others(tmp_path: Path) -> None:
    ts = small_level(tmp_path, "lower", lower=lower_level(going("2", there="false"), going("3")))
    cycle = any_cycle(ts)
    at = next(at for at in cycle.tables if at.table.name == "go")
    [pair] = pairs(cycle)
    assert pair.key == (Sort.ONE_LINE, "go", "2 and 3")
    assert (pair.lines, pair.shown) == (("2", "3"), "lines `2` and `3` do not both match")
    matches = {str(line.name): match for line, match in at.lines}
    whole = values.follows(at.runs, values.negation(values.both(matches["2"], matches["3"])))
    keyed, solver = Keyed(), Solver()
    term = keyed.term(values.negation(values.equal(pair.holds, whole)))
    solver.add(*keyed.ranges, term)
    assert solver.check() is Answer.UNSATISFIABLE


def without(sorts: tuple[Sort, ...], missing: str, table: str = "") -> tuple[Unstated, ...]:
    return tuple(Unstated(sort, table, missing) for sort in sorts)


def test_what_is_missing_for_a_goal_is_told_word_for_word(
    upper: TransitionSystem, lower: tuple[TransitionSystem, LevelProof], tmp_path: Path
) -> None:
    no_superior = replace(upper, links=replace(upper.links, above=None))
    assert unstated(no_superior) == without((Sort.WAITS, Sort.PAUSES, Sort.ENDS), "the level takes no orders")
    assert unstated(replace(lower[0], links=replace(lower[0].links, above=None))) == ()
    ts = replace(upper, level=replace(upper.level, tables=OneTable(TableName("work"))))
    assert unstated(ts) == without((Sort.PAUSES,), "the level has one table for all commands")
    unread = replace(upper, links=replace(upper.links, unread=("this", "that")))
    assert [(missing.sort, missing.table, missing.missing) for missing in unstated(unread)] == [
        (Sort.PROTOCOL, "", "this"),
        (Sort.PROTOCOL, "", "that"),
    ]
    text = small_text("lower").replace("new_command", "fresh")
    renamed = small_level(tmp_path / "renamed", "lower", lower=text)
    assert unstated(renamed) == without((Sort.ONCE, Sort.ANSWERED), "there is no state `new_command : bool`")
    blind = small_text(
        "lower", ("| line | new_command | cur_state |", "| line | inc_command_seen | cur_state |")
    )
    blind = blind.replace("| true        |           |", "| 0 | |").replace("| false       |", "| > 0 |")
    looks = small_level(tmp_path / "blind", "lower", lower=blind)
    [left] = unstated(looks)
    assert left == Unstated(Sort.ANSWERED, "go", "no line looks at `new_command`")
    assert left.shown == "table `go`: no new command is passed over: no line looks at `new_command`"


# --- claims in words ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "level", "there", "words"),
    [
        (("invariant", "", "low"), "a", True, "invariant `low`"),
        (("invariant", "", "low"), "b", True, "level `a`: invariant `low`"),
        (("assumption", "t", "near"), "b", True, "level `a`: table `t`: assumption `near`"),
        (("invariant", "", "low"), "a", False, "invariant `low`, not looked at"),
        ((CONTRACT, "", "order"), "a", True, "what it takes in `order` is as it assumes"),
        (RUNS, "a", False, "the level was not looked at"),
        (SAFE, "a", False, "every operation is defined and in range within a cycle"),
        (ENDING, "b", False, "level `a`: that its commands end was not looked at"),
    ],
)
def test_a_claim_is_spelled_word_for_word(key: Key, level: str, there: bool, words: str) -> None:
    assert spelled(("a", key), level, [("a", key)] if there else []) == words
    assert spelled(("a", key), level) == words.removesuffix(", not looked at")


RUNNING = """\
the level runs as its tables say, : proved
    rests on every operation is defined and in range,,; the contract,,command; some line matches,pause,; no two lines match,pause,; \
some line matches,go,; no two lines match,go,
every operation is defined and in range, : proved
    rests on nothing
"""
RESTING = """\
some line matches, pause: proved
no two lines match, pause: proved
some line matches, go: proved
no two lines match, go: proved
the report echoes the command that it answers, : proved
done stays done, : proved
failed stays failed, : proved
a command number is taken up once, : proved
does nothing when it matches again, : proved
the command ends, pause: proved
the command ends, go: not proved
"""


def test_claims_of_a_level_rest_on_these_and_no_others(lower: tuple[TransitionSystem, LevelProof]) -> None:
    found = []
    for (sort, table, _), claim in of_level(*lower):
        on = "; ".join(",".join(map(str, key)) for level, key in claim.rests_on if level == "lower")
        rests = "" if claim.rests_on == (("lower", RUNS),) else f"    rests on {on or 'nothing'}"
        found += [f"{sort}, {table}: {claim.verdict}", rests][: 1 + bool(rests)]
        assert claim.trusts == ()
    ends = ["every command ends, : proved", "    rests on the command ends,pause,; the command ends,go,"]
    ends += ["the command that rests ends, : proved", "    rests on the command ends,pause,"]
    stands = [
        "its report stands once it has answered, : proved",
        "    rests on the level runs as its tables say,,; the report echoes the command that it answers,,report",
    ]
    assert found == [*RUNNING.splitlines(), *RESTING.splitlines(), *stands, *ends]


def test_what_levels_assume_of_each_other_is_told_word_for_word(
    upper: TransitionSystem, lower: tuple[TransitionSystem, LevelProof]
) -> None:
    numbered: tuple[Key, ...] = (
        (Sort.NUMBERED, "", "to_lower.input_command"),
        (Sort.NEXT_NUMBER, "", "to_lower"),
    )
    kept = tuple(("upper", key) for key in numbered)
    orders = "while the number of `command` stays, so do `command.input_command`"
    reports = "what `lower` reports under the number of the last order is about that order"
    from_outside = Promise("upper", "command", orders, "`station` stands outside the levels", outside=True)
    echoed = f"proved of `lower`: {Sort.ECHOES.value}; both begin with the same order"
    echoes = (("lower", (Sort.ECHOES.value, "", "report")),)
    from_below = Promise("upper", "lower", reports, echoed, echoes, kept)
    from_above = Promise("lower", "command", orders, f"proved of `upper`: {Sort.NUMBERED.value}", kept)
    assert list(promises({"upper": upper, "lower": lower[0]})) == [from_outside, from_below, from_above]
    [below] = upper.links.below
    left = replace(upper, links=replace(upper.links, below=(replace(below, outside=True),)))
    own = Promise("upper", "lower", reports, "`lower` stands outside the levels", own=kept, outside=True)
    assert list(promises({"upper": left})) == [from_outside, own]
    assert own.claim == (
        ("upper", (CONTRACT, "", "lower")),
        Claim(Verdict.PROVED, kept, ("`lower` keeps to the protocol",)),
    )


def test_an_ending_rests_on_those_of_levels_below_and_trusts_those_that_are_none(
    upper: TransitionSystem,
) -> None:
    inside = _of_ending(upper, Ending("work", 0, still=("command",), settled=("lower",)), admitting=False)
    still = "the values in `command` of level `upper` stand still meanwhile"
    refused = "`command.input_command` of level `upper` is not refused for ever"
    needs = ("upper", RUNS), ("lower", ENDING), ("lower", STANDS)
    assert inside == Claim(Verdict.PROVED, needs, (still, refused))
    [below] = upper.links.below
    left = replace(upper, links=replace(upper.links, below=(replace(below, outside=True),)))
    answers = "`lower` answers every order that is not replaced, and stays so"
    assert _of_ending(left, Ending("work", 0), admitting=False) == Claim(
        Verdict.PROVED, (("upper", RUNS),), (answers, refused)
    )


# --- buffers ------------------------------------------------------------------------------


def wired(*wires: tuple[str, str]) -> Description:
    """The small system with other buffers."""
    return replace(description(SYSTEM), wires=tuple(Wire(*one) for one in wires))


WIRES = (("upper.to_lower", "lower.command"), ("lower.report", "upper.lower"))


def test_a_buffer_may_end_within_a_record(lower: tuple[TransitionSystem, LevelProof]) -> None:
    program = lower[0].program
    inside = tuple(
        replace(one, name=VariableName(f"taken.{one.name}")) if one.name.startswith("command.") else one
        for one in program.variables
    )
    system = wired(("upper.to_lower", "lower.taken.command"), WIRES[1])
    found = links(system, "lower", replace(program, variables=inside))
    assert found.above == Above(
        "upper", "taken.command", "report", outside=False, numbered=("taken.command.input_command",)
    )
    assert (found.below, found.free, found.unread) == ((), ("there",), ())


@pytest.mark.parametrize(
    ("level", "wires", "words"),
    [
        (
            "lower",
            WIRES[:1],
            "`lower.command` needs one buffer to `upper` with `inc_command_echo`, and has 0",
        ),
        ("upper", WIRES[1:], "`upper.lower` needs one buffer to `lower` with `inc_command`, and has 0"),
    ],
)
def test_what_is_wrong_with_buffers_is_told_word_for_word(
    level: str,
    wires: tuple[tuple[str, str], ...],
    words: str,
    upper: TransitionSystem,
    lower: tuple[TransitionSystem, LevelProof],
) -> None:
    program = {"upper": upper, "lower": lower[0]}[level].program
    with pytest.raises(BadDescription) as told:
        links(wired(*wires), level, program)
    assert str(told.value) == words


@pytest.mark.parametrize(
    ("answers", "verdict"),
    [
        ({Answer.SATISFIABLE}, Verdict.TRUSTED),
        ({Answer.SATISFIABLE, Answer.UNKNOWN}, Verdict.UNDECIDED),
        ({Answer.UNKNOWN, Answer.UNSATISFIABLE, Answer.SATISFIABLE}, Verdict.NOT_PROVED),
    ],
)
def test_what_is_declared_is_trusted_only_where_every_sort_of_cycle_is_possible(
    answers: set[Answer], verdict: Verdict
) -> None:
    assert _of_possible(answers) is verdict


def test_every_neighbour_that_is_not_understood_is_named(upper: TransitionSystem) -> None:
    """Also where one that is understood comes before it."""
    program = upper.program
    renamed = {"lower.inc_command_echo": "lower.echo", "to_lower.inc_command": "to_lower.number"}
    variables = tuple(
        replace(leaf, name=VariableName(renamed.get(leaf.name, leaf.name))) for leaf in program.variables
    )
    found = links(description(SYSTEM), "upper", replace(program, variables=variables))
    assert found.above is not None
    assert found.below == ()
    said = "what `upper` and `lower` say to each other (`lower`, `to_lower`) has no `inc_command`, `inc_command_echo`"
    assert found.unread == (said,)


# --- from table to table ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("then", "round_"),
    [
        ("which := go", set()),
        ("which := pause", set()),
        ("if which = pause { which := go } else { which := pause }", {0, 1}),
    ],
)
def test_tables_go_round_only_where_each_may_follow_the_other(
    then: str, round_: set[int], tmp_path: Path
) -> None:
    """What selects them is a state: it only goes on, stays, or comes back."""
    text = small_text(
        "lower",
        ("state cur_state", "state which : lower_command\nstate cur_state"),
        ("module receive reads command,", "module receive reads command, which,"),
        ("writes new_command,", "writes new_command, which,"),
        ("inc_command_seen := command.inc_command\n", f"inc_command_seen := command.inc_command\n  {then}\n"),
        ("by command.input_command", "by which"),
    )
    ts = small_level(tmp_path, "lower", lower=text)
    cycle = any_cycle(ts)
    flow = Flow(ts, Confirmation((), (), cycle, cycle.cases, Keyed(), Limits()), [])
    assert flow._looping_tables() == round_


# --- what has a name of its own -----------------------------------------------------------


def test_what_stood_in_a_buffer_before_a_restart_is_of_that_buffer_alone(upper: TransitionSystem) -> None:
    """Each of several subordinates may have had another order: what is read of one says nothing of another."""
    start = upper.restarted()
    late = [set(values.variables([start[leaf]])) for leaf in start]
    numbers = values.variables([start["to_lower.inc_command"]])
    assert set(numbers) == {"to_lower.inc_command before restart", "lower.inc_command_echo before restart"}
    alike = {"command.inc_command", "inc_command_seen"}, {"lower.inc_command_echo", "to_lower.inc_command"}
    for (one, here), (two, there) in combinations(zip(start, late, strict=True), 2):
        assert not here & there or {one, two} in alike


ASK = 'extern procedure ask reads there writes raw python "no_such_module:ask" c "ask"'


def test_what_an_extern_procedure_gives_in_one_cycle_is_not_what_it_gives_in_another(tmp_path: Path) -> None:
    text = lower_level(
        going("2", on="true"),
        going("3", on="false", does="state(d_state)", status="done"),
        declared="state raw : bool",
        seen="on := raw",
        parts=ASK,
        after="answer, ask",
    )
    ts = small_level(tmp_path, "lower", lower=text)
    cycle = any_cycle(ts)
    asked = Confirmation((), (), cycle, cycle.cases, Keyed(), Limits())
    flow = Flow(ts, asked, [])
    turns = flow._turns(1, (), ())
    given = [values.variables([turn.after["raw"]]) for turn in turns]
    mine = [{name for name in one if name.startswith("raw from ask")} for one in given]
    assert [len(one) for one in mine] == [1, 2, 3]  # one that is refused leaves what was given before


# --- predicates ---------------------------------------------------------------------------

STATED = """input i : int 0 .. 9
state a : int 0 .. 9
state c : int 0 .. 9
state f : bool
state e : bool
invariant sums : a + c < 12
invariant alike : a = c or e /= f
property few : a in {1, 2} implies was f
property later : was a <= c
property parts : a / (c + 1) < 5
property before : not (was a + was c > 3) or was c in {4, 5} or f
procedure p { a := i  c := i }
table t {
  | line | when || procedures |
  | one  | f    || p          |
  | two  | not f ||           |
}
level l { period 40 [ms] table t }
"""


NUMBERS = (Int(0, 9), Int(0, 18), Int(12, 12), Int(3, 3))
"""The types of variables, sums and constants in it."""


def test_predicates_of_what_is_stated_are_these_and_no_others() -> None:
    ts = alone(STATED)
    cycle = any_cycle(ts)
    found = every_predicate(ts, cycle, [obligation.holds for obligation in obligations(ts, cycle)])
    assert [(predicate.leaf, predicate.other) for predicate in found] == [
        ("f", ""), ("e", ""), ("(< (+ a c) int:12)", ""), ("a", "c"), ("e", "f"), ("(in a 1 2)", ""),
        ("(> (+ a c) int:3)", ""), ("(in c 4 5)", ""),
    ]  # fmt: skip
    conditions = [predicate.condition for predicate in found if predicate.condition is not None]
    assert [spelled_expression(expr) for expr in conditions] == [
        predicate.leaf for predicate in found if predicate.leaf[0] == "("
    ]
    assert {part.type for expr in conditions for part in parts(expr)} == {Bool(), *NUMBERS}
    assert all(predicate.kind == Bool() for predicate in found)


def test_a_predicate_may_speak_of_all_that_matters() -> None:
    ts = alone(
        "state a : int 0 .. 9\nstate c : int 0 .. 9\ninvariant sums : a + c < 12\n"
        "table t {\n| line | when ||\n| one | true ||\n}\nlevel l {\n  period 40 [ms]\n  table t\n}\n"
    )
    cycle = any_cycle(ts)
    found = every_predicate(ts, cycle, [obligation.holds for obligation in obligations(ts, cycle)])
    assert [predicate.leaf for predicate in found] == ["(< (+ a c) int:12)"]


# --- questions of a certificate -----------------------------------------------------------


def test_the_questions_of_a_certificate_are_named_and_are_about_values_in_range(
    lower: tuple[TransitionSystem, LevelProof],
) -> None:
    asked = certificate(*lower)
    assert [name for name in asked if not name.startswith(("lines", "ends"))] == [
        "first", "restart", "step pause", "step go", "goals first", "goals restart",
        "goals some_line", "goals one_line", "goals echoes", "goals done_stays", "goals failed_stays", "goals once", "stands 1",
    ]  # fmt: skip
    for text in asked.values():
        for line in text.splitlines():
            if line.startswith("(declare-fun |command.inc_command") or "inc_command_seen ()" in line:
                name = line.removeprefix("(declare-fun ").partition(" () ")[0]
                assert f"(and (<= 0 {name}) (>= 65535 {name}))" in text
