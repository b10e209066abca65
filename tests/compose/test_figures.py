"""What is stated of levels and asked about them, exactly: goals, what is missing for a goal, predicates, claims in words, questions."""

from dataclasses import replace
from itertools import combinations, product
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
    Trust,
    Verdict,
    spelled,
    trust_of,
)
from rcsc.compose.contract.claims import RESTING as RESTS
from rcsc.compose.contract.environment import Above, _admits, links
from rcsc.compose.contract.obligations import (
    Obligation,
    Sort,
    Unstated,
    command_stays,
    obligations,
    pairs,
    unstated,
)
from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.properties import every_predicate, properties
from rcsc.compose.contract.transition import REFUSED, Cycle, TransitionSystem
from rcsc.compose.contract.watched import Refusals, judged, opened
from rcsc.compose.invariant.confirm import Confirmation
from rcsc.compose.invariant.pdr import Clause
from rcsc.compose.invariant.search import Effort, FoundInvariant
from rcsc.compose.proof import assume_guarantee, termination
from rcsc.compose.proof import level as level_proof
from rcsc.compose.proof import system as system_proof
from rcsc.compose.proof.assume_guarantee import _of_ending, _said, of_level, promises
from rcsc.compose.proof.context import Context, lines_write, never_run
from rcsc.compose.proof.level import (
    LevelProof,
    ProvedTogether,
    _of_possible,
    certificate,
    prove_again,
    prove_level,
)
from rcsc.compose.proof.termination import Ending, Flow, answered
from rcsc.compose.proof.termination import from_outside as outside_inputs
from rcsc.lang.leaves import parts
from rcsc.lang.meaning import spelled as spelled_expression
from rcsc.lang.model import Bool, Enum, Int, Kind, OneTable, TableName, VariableName, earlier
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.proof.symbolic.trial import value_at
from rcsc.run.description import BadDescription, Description, Wire, description
from tests.support.programs.systems import (
    LITTLE,
    SYSTEM,
    TICK,
    TURNS,
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


def test_each_answer_that_a_status_can_give_stays(upper: TransitionSystem) -> None:
    above = upper.links.above
    assert above is not None
    found = []
    for done, failed in (("done", "failed"), ("none", "failed"), ("done", "none"), ("none", "none")):
        ts = replace(upper, links=replace(upper.links, above=replace(above, done=done, failed=failed)))
        sorts = [one.sort for one in obligations(ts, any_cycle(ts))]
        found.append([sort in sorts for sort in (Sort.DONE_STAYS, Sort.FAILED_STAYS)])
    assert found == [[True, True], [False, True], [True, False], [False, False]]


def test_a_new_command_may_be_passed_over_where_a_stopping_assumption_fails(upper: TransitionSystem) -> None:
    tables = tuple(replace(table, stops=table.assumptions) for table in upper.program.tables)
    stopping = replace(upper, program=replace(upper.program, tables=tables))
    found = [
        [(one.sort, one.table) for one in obligations(ts, any_cycle(ts)) if one.sort is Sort.ANSWERED]
        for ts in (upper, stopping)
    ]
    assert found == [[], [(Sort.ANSWERED, "work")]]


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


def test_what_a_proof_says_of_a_level_rests_on_these_and_no_others(upper: TransitionSystem) -> None:
    """What is proved of several levels together rests on each of them, and on nothing else of this one."""
    goals = obligations(upper, any_cycle(upper))
    [echoes, late, *_] = [one.key for one in goals if one.sort in (Sort.ECHOES, Sort.WAITS)]
    proof = LevelProof(
        "upper",
        tuple((one, Verdict.PROVED) for one in goals),
        (),
        (),
        walked=0,
        learnt=0,
        seconds=0.0,
        endings=(Ending("work", 1), Ending("rest", 0)),
        stands=True,
        together=(ProvedTogether(late, ("upper", "lower"), ("each in its time",)),),
    )
    ends = {name: (Sort.ENDS, name, "") for name in ("work", "rest")}
    told = {key: (claim.rests_on, claim.trusts) for key, claim in of_level(upper, proof)}
    runs = ("upper", RUNS)
    assert told[late] == ((runs, ("lower", RUNS)), ("each in its time",))
    assert told[echoes] == ((runs,), ())
    assert told[STANDS] == ((runs, ("upper", echoes)), ())
    assert told[ENDING] == (tuple(("upper", key) for key in ends.values()), ())
    assert told[RESTS] == ((("upper", ends["rest"]),), ())
    assert told.keys() == {one.key for one in goals} | {*ends.values(), RUNS, SAFE, STANDS, ENDING, RESTS}


def test_a_record_with_several_inputs_is_named_once(upper: TransitionSystem) -> None:
    assert _said(upper, ["a.x", "a.y", "b.x", "c"], "here") == "`a`, `b.x`, `c` of level `upper` are here"
    assert _said(upper, ["a.x"], "here") == "`a.x` of level `upper` is here"
    assert _said(upper, [], "here") == ""


def test_what_needs_that_no_input_is_refused_trusts_that(
    lower: tuple[TransitionSystem, LevelProof], monkeypatch: pytest.MonkeyPatch
) -> None:
    ts, proof = lower
    words = "no input is refused"
    monkeypatch.setattr(assume_guarantee, "admitted", lambda _: (words,))
    unproved = tuple((obligation, Verdict.NOT_PROVED) for obligation, _ in proof.verdicts)
    refusing = replace(proof, verdicts=unproved, context=None, endings=(), stands=False)
    resting = {RUNS, SAFE, ENDING, RESTS}
    for parts_, trusted in (((refusing, proof), True), ((proof, proof), False), ((), False)):
        claimed = [each for each in of_level(ts, replace(proof, parts=parts_)) if each[0] not in resting]
        assert len(claimed) > len(proof.verdicts)
        assert [key for key, claim in claimed if (words in claim.trusts) is not trusted] == []


def test_a_kept_proof_is_of_one_level_and_of_one_effort(upper: TransitionSystem, tmp_path: Path) -> None:
    lower = small_level(tmp_path, "lower")
    efforts = (
        LITTLE,
        replace(LITTLE, walks=7),
        replace(LITTLE, looks=False),
        replace(LITTLE, limits=Limits(1)),
    )
    keys = [system_proof._key(ts, effort) for ts in (upper, lower) for effort in efforts]
    assert len(set(keys)) == len(keys)
    assert system_proof._key(upper, replace(LITTLE)) == keys[0]


def test_clauses_are_an_invariant_only_where_no_cycle_breaks_them() -> None:
    """Every set of one clause or two over two truth values, asked of Z3 and gone through."""
    ts = alone(
        "input x : bool\nstate a : bool\nstate b : bool\nmodule step reads x, a, b writes a, b { b := a and x  a := not b }\n"
        "table t {\n| line | x ||\n| any | ||\n}\nlevel solo { period 40 [ms] preprocess step table t }\n"
    )
    cycle, first = any_cycle(ts), ts.firsts()["first"]
    predicates = tuple(Predicate(leaf, Bool()) for leaf in "ab")
    asked = Confirmation(predicates, (first,), cycle, cycle.cases, Keyed(), Limits())
    literals = [(at, value) for at in (0, 1) for value in (0, 1, ~0)]
    cubes = [
        *((one,) for one in literals),
        *(pair for pair in combinations(literals, 2) if pair[0][0] != pair[1][0]),
    ]

    def inside(state: tuple[bool, bool], cube: Clause) -> bool:
        return all((state[at] == value) if value >= 0 else (state[at] != ~value) for at, value in cube)

    states = [(a, b) for a in (False, True) for b in (False, True)]
    after = {(a, b, x): (not (a and x), a and x) for a, b in states for x in (False, True)}
    for clauses in [*((one,) for one in cubes), *combinations(cubes, 2)]:
        kept = [state for state in states if not any(inside(state, cube) for cube in clauses)]
        ends = {after[a, b, x] for a, b in kept for x in (False, True)}
        breaks = any(inside(end, cube) for end in ends for cube in clauses)
        said = {asked.step_question(clauses, case).check() for case in cycle.cases}
        assert (Answer.SATISFIABLE in said) == breaks, clauses
        begins = any(inside((True, False), cube) for cube in clauses)
        assert (asked.first_question(clauses, first).check() is Answer.SATISFIABLE) == begins, clauses


def test_what_is_proved_only_where_nothing_is_refused_is_told_from_the_rest() -> None:
    """Of two proofs, the first with refusals: what that one does not show trusts that there are none."""
    owed = [Obligation(sort, "", "", values.TRUE) for sort in (Sort.SAFE, Sort.ECHOES)]
    ends, late = Ending("work", 1), Ending("rest", 0)

    def part(verdicts: tuple[Verdict, Verdict], **rest: object) -> LevelProof:
        pairs_ = tuple(zip(owed, verdicts, strict=True))
        return replace(LevelProof("l", pairs_, (), (), 0, 0, 0.0), **rest)  # type: ignore[arg-type]  # of its own names

    both = Verdict.PROVED, Verdict.PROVED
    refusing = part((Verdict.PROVED, Verdict.NOT_PROVED), endings=(ends,))
    other = part(both, endings=(ends, late), stands=True, context=Context((), (), restless=False))
    proof = replace(other, parts=(refusing, other))
    assert [proof.needs_admission(one.key) for one in owed] == [False, True]
    assert [proof.ends_admitting(one) for one in (ends, late)] == [False, True]
    assert (proof.stands_admitting, proof.looked_admitting) == (True, True)
    alike = replace(other, parts=(other, other))
    for whole in (other, alike):
        assert not any(whole.needs_admission(one.key) for one in owed)
        assert not any(whole.ends_admitting(one) for one in (ends, late))
        assert (whole.stands_admitting, whole.looked_admitting) == (False, False)


@pytest.mark.parametrize("effort", [None, LITTLE])
def test_a_level_is_proved_with_the_effort_that_is_given(
    effort: Effort | None, upper: TransitionSystem, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def noted(_: TransitionSystem, given: Effort, __: object) -> LevelProof:
        asked.append(given)
        return LevelProof("upper", (), (), (), 0, 0, 0.0)

    monkeypatch.setattr(level_proof, "_in_each_cycle", noted)
    assert prove_level(upper, effort).level == "upper"
    assert asked == [effort or Effort()]


def test_a_level_is_proved_again_with_the_clauses_that_it_has() -> None:
    """Without a walk: what a clause speaks of and what it says is known."""
    ts = alone(
        "input a : bool\nstate n : int 0 .. 9\nstate m : int 0 .. 9\n"
        "module count reads a, n, m writes n, m { if a and n < 9 { n := n + 1  m := min(m + 1, 9) } }\n"
        "table t {\n| line | a ||\n| any | ||\n}\nproperty alike : n = m\nproperty far : n < 9 or m = 9\n"
        "level solo { period 40 [ms] preprocess count table t }\n"
    )
    proof = prove_level(ts, Effort(walks=2, cycles=20))
    again = prove_again(ts, proof, Effort(walks=0, cycles=0, looks=False))
    assert (proof.open, again.open, again.walked) == ((), (), 0)
    names = [FoundInvariant(each.predicates, each.clauses).named for each in (proof, again)]
    assert names[0] == names[1] != ()


def test_a_leaf_that_is_written_before_and_after_the_lines_is_an_effect_of_theirs() -> None:
    ts = alone(
        "input a : int 0 .. 9\nstate n : int 0 .. 9\nstate m : int 0 .. 9\nstate k : int 0 .. 9\n"
        "procedure early { n := a  m := a }\nprocedure late { n := 1 }\n"
        "table t {\n| line | when || k |\n| one | true || 1 |\n}\n"
        "level l {\n  period 40 [ms]\n  preprocess early\n  table t\n  postprocess late\n}\n"
    )
    assert lines_write(ts) == ["n", "k"]


def test_another_program_brings_its_own_level(upper: TransitionSystem) -> None:
    short = replace(upper.level, preprocess=())
    other = upper.of(replace(upper.program, levels=(short,)))
    assert (other.level, other.program.levels) == (short, (short,))


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
    deaf = replace(lower[0], links=replace(lower[0].links, above=None))
    unnumbered = Promise("upper", "lower", reports, "`lower` takes no numbered orders", begins=False)
    assert list(promises({"upper": upper, "lower": deaf})) == [from_outside, unnumbered]
    assert outside_inputs(upper) == {"command"}
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


def test_every_trust_is_told_from_the_others() -> None:
    for trust in Trust:
        words = trust.value.replace("LEVEL", "some_level").replace("NAME", "record.field")
        words = words.replace("INPUTS", "`x`, `y.z`").replace("ARE", "are")
        kind, level, name = trust_of(words)
        assert kind == trust.name
        assert (level, name) == (
            "some_level" * ("LEVEL" in trust.value),
            "record.field" * ("NAME" in trust.value),
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


def test_single_values_that_go_both_ways_are_no_order_and_its_report(
    lower: tuple[TransitionSystem, LevelProof],
) -> None:
    program = lower[0].program
    said = replace(program.variable(VariableName("there")), name=VariableName("said"), kind=Kind.OUTPUT)
    system = wired(("station.there", "lower.there"), ("lower.said", "station.said"))
    found = links(system, "lower", replace(program, variables=(*program.variables, said)))
    assert found.unread == (
        "no input has `inc_command` and `input_command`, so that no order selects the table",
    )


def test_what_comes_from_a_level_and_is_no_order_is_named(lower: tuple[TransitionSystem, LevelProof]) -> None:
    found = links(wired(("upper.idle", "lower.there")), "lower", lower[0].program)
    missing = "`inc_command`, `input_command`, `inc_command_echo`, `ref_command_echo`"
    assert found.unread[0] == f"what `lower` and `upper` say to each other (`there`) has no {missing}"


def test_a_member_is_taken_from_the_same_enumeration_alone() -> None:
    colours, others, number = Enum("c", ("a", "b")), Enum("d", ("a", "b")), Int(0, 1)
    assert [_admits(colours, given) for given in (colours, others, Enum("c", ("b", "a")), number, Bool())] == [
        True, True, False, False, False,
    ]  # fmt: skip
    assert [_admits(number, given) for given in (number, Int(0, 2), Int(1, 1), colours)] == [
        True, False, True, False,
    ]  # fmt: skip


@pytest.mark.parametrize("outside", [False, True])
def test_who_is_no_level_stands_outside(outside: bool, upper: TransitionSystem) -> None:
    system = description(SYSTEM)
    levels = tuple(level for level in system.levels if not outside or level.name != "lower")
    found = links(replace(system, levels=levels), "upper", upper.program)
    assert [below.outside for below in found.below] == [outside]


def test_each_level_is_proved_with_the_effort_that_is_asked_for(
    upper: TransitionSystem, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(system_proof, "_proved", lambda *args: args)
    found: list[object] = list(system_proof._each({"a": upper, "b": upper}, LITTLE, 1, ("a", "b"), None))
    assert found == [("a", (upper, LITTLE, None)), ("b", (upper, LITTLE, None))]


def test_each_table_is_matched_on_what_it_sees_at_its_place() -> None:
    ts = alone(
        "state n : int 0 .. 9\nstate m : int 0 .. 9\n"
        "table t {\n| line | n || n |\n| one | < 5 || 7 |\n| two | >= 5 || 1 |\n}\n"
        "table u {\n| line | n || m |\n| one | < 5 || n |\n| two | >= 5 || 1 |\n}\n"
        "level l {\n  period 40 [ms]\n  table t\n  table u\n}\n"
    )
    kept = ts.program.line_leaves[TableName("t")]
    assert [ts.lines_before({kept: at}) for at in range(3)] == [(), (("t", "one"),), (("t", "two"),)]
    cycle = any_cycle(ts)
    same = [
        values.equal(one, two)
        for at in cycle.every
        for one, two in zip(at.matches, ts.matches(cycle, at.table, {}), strict=True)
    ]
    keyed, solver = Keyed(), Solver()
    term = keyed.term(values.negation(values.all_of(same)))
    solver.add(*keyed.ranges, term)
    assert len(same) == 4
    assert solver.check() is Answer.UNSATISFIABLE


# --- cycles that end early ----------------------------------------------------------------


def test_a_cycle_in_which_an_input_is_refused_takes_nothing_and_runs_nothing(
    upper: TransitionSystem,
) -> None:
    cycle = any_cycle(upper.refusing())
    early = [cycle.refused, cycle.unmatched, cycle.interrupted]
    still = [
        values.equal(cycle.before[leaf], cycle.after[leaf]) for leaf in ("cur_state", "to_lower.inc_command")
    ]
    idle = [values.negation(at.chosen) for at in cycle.every]
    keyed, solver = Keyed(), Solver()
    term = keyed.term(values.both(cycle.untaken, values.negation(values.all_of([*early, *still, *idle]))))
    solver.add(*keyed.ranges, term)
    assert solver.check() is Answer.UNSATISFIABLE
    assert cycle.untaken is not values.FALSE


def test_each_part_of_a_property_that_reads_a_refused_input_is_true_or_false() -> None:
    ts = alone(
        "input a : int 0 .. 9\nstate n : int 0 .. 9\nproperty low : not (a < 3 and n > a) implies n < 9\n"
        "table t {\n| line | when ||\n| one | true ||\n}\nlevel l {\n  period 40 [ms]\n  table t\n}\n"
    )
    [stated] = ts.program.properties
    node, _ = opened(stated.condition, frozenset({"a"}), ts.havoc())
    assert set(values.variables([node])) == {f"{REFUSED}: (< a int:3)", f"{REFUSED}: (> n a)", "n"}


@pytest.mark.parametrize("says", ["x > was x", "was x > 1", "x > 1"])
@pytest.mark.parametrize("at_restarts", [True, False])
def test_a_property_of_a_refused_cycle_is_what_it_is_but_where_it_reads_what_was_refused(
    says: str, at_restarts: bool
) -> None:
    """There it may be true or false: of an input that a restart does not clamp, or of any that is refused, then and in the cycle after."""
    ts = alone(
        f"input x : int 0 .. 2\nproperty p : {says}\ntable t {{\n| line | x ||\n| any | ||\n}}\nlevel solo {{ period 40 [ms] table t }}\n"
    )
    now, was, back = "x", str(earlier(VariableName("x"))), values.variable("back", Bool())
    leaves = {now: values.variable(now, Int(0, 2)), was: values.variable(was, Int(0, 2))}
    untaken = values.FALSE if at_restarts else values.variable("untaken", Bool())
    taken = {} if at_restarts else {now: values.variable("came", Int(0, 2))}
    looks = frozenset() if at_restarts else frozenset({was})
    refusals = Refusals(untaken, frozenset({now}), back, looks, taken)
    truth, defined = judged(ts.program.properties[0].condition, leaves, refusals)
    assert defined is values.TRUE
    names = values.variables([truth])
    unknown = [name for name in names if name not in {now, was, "came", "back", "untaken"}]
    assert len(unknown) == (says != "x > 1" or not at_restarts)
    for here, before, came, *flags in product(range(3), range(3), range(3), *[(False, True)] * 3):
        after, refused, other = flags
        if at_restarts and refused:
            continue
        point = {
            now: here,
            was: before,
            "came": came,
            "back": after,
            "untaken": refused,
            **dict.fromkeys(unknown, other),
        }
        reads_now, reads_was = says.startswith("x"), "was" in says
        open_ = (refused and reads_now) or (after and reads_was)
        plain = {"x > was x": here > before, "was x > 1": before > 1, "x > 1": here > 1}[says]
        assert bool(value_at(truth, point)) == (other if open_ else plain), point


def test_a_part_that_may_be_undefined_of_what_was_refused_is_not_kept_but_where_that_is_forgiven() -> None:
    ts = alone(
        "input a : int 1 .. 9\nstate n : int 0 .. 9\nproperty low : 10 / a > n\n"
        "table t {\n| line | when ||\n| one | true ||\n}\nlevel l {\n  period 40 [ms]\n  table t\n}\n"
    )
    condition, leaves = ts.program.properties[0].condition, ts.havoc()
    assert opened(condition, frozenset({"a"}), leaves) == (values.FALSE, values.FALSE)
    truth, defined = opened(condition, frozenset({"a"}), leaves, " here", forgives=True)
    [unknown] = values.variables([truth])
    assert unknown.startswith(f"{REFUSED} here: ")
    assert defined is values.TRUE
    for forgives in (True, False):
        refusals = Refusals(values.TRUE, frozenset({"a"}), suffix=" here", forgives=forgives)
        truth, defined = judged(condition, leaves, refusals)
        assert (list(values.variables([truth])), defined is values.TRUE) == ([unknown] * forgives, forgives)


def test_what_a_property_looks_back_at_is_any_value_after_a_refused_input() -> None:
    ts = alone(
        "input a : int 0 .. 9\nstate n : int 0 .. 9\nproperty back : was a < 5 or n < 9\n"
        "table t {\n| line | when ||\n| one | true ||\n}\nlevel l {\n  period 40 [ms]\n  table t\n}\n"
    ).refusing()
    [(_, node)] = properties(ts.program, any_cycle(ts))
    assert f"{REFUSED}: (< {earlier('a')} int:5)" in values.variables([node])


# --- from table to table ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("then", "round_"),
    [
        ("which := go", set()),
        ("which := pause", set()),
        ("which := which", set()),
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


def test_a_subordinate_that_has_to_stand_has_answered_and_gets_no_order(upper: TransitionSystem) -> None:
    cycle = any_cycle(upper)
    flow = Flow(upper, Confirmation((), (), cycle, cycle.cases, Keyed(), Limits()), [])
    for settled, may_order in (((), Answer.SATISFIABLE), (("lower",), Answer.UNSATISFIABLE)):
        turn = flow._turn(cycle, 1, settled)
        for wrong in (turn.ordered["lower"], values.negation(turn.answered)):
            keyed, solver = Keyed(), Solver()
            term = keyed.term(values.both(turn.stays, wrong))
            solver.add(*keyed.ranges, term)
            assert solver.check() is may_order


def test_an_order_that_is_late_counts_as_answered_but_for_one_to_rest(upper: TransitionSystem) -> None:
    """Only of a subordinate that is to answer in time."""
    cycle, [below] = any_cycle(upper), upper.links.below
    in_time = replace(below, late="idle", answers_in_time=True)
    rests = values.equal(cycle.before[below.command], values.constant(upper.kinds[below.command], 0))
    late = cycle.middle["idle"]
    plain, timed = answered(upper, cycle, below), answered(upper, cycle, in_time)
    meant = values.either(plain, values.both(late, values.negation(rests)))
    keyed, solver = Keyed(), Solver()
    term = keyed.term(values.negation(values.equal(timed, meant)))
    solver.add(*keyed.ranges, term)
    assert solver.check() is Answer.UNSATISFIABLE
    assert answered(upper, cycle, replace(in_time, answers_in_time=False)).op == plain.op
    assert timed.op != plain.op


def test_a_flag_that_turns_while_a_command_waits_is_no_phase(tmp_path: Path) -> None:
    text = lower_level(
        going("2", on="false", does="work"),
        going("3", on="true", does="state(d_state)", status="done"),
        declared="state flip : bool",
        work="flip := not flip",
    )
    ts = small_level(tmp_path, "lower", lower=text)
    cycle = any_cycle(ts)
    flow = Flow(ts, Confirmation((), (), cycle, cycle.cases, Keyed(), Limits()), [])
    assert [str(at.table.name) for at in flow.tables] == ["pause", "go"]
    assert "flip" in flow._pending_and_flags()
    assert "flip" in flow._phases(0).leaves
    assert "flip" not in flow._phases(1).leaves


def test_each_step_of_a_loop_is_to_be_excluded_where_the_table_goes_on_with_its_command(
    tmp_path: Path,
) -> None:
    ts = small_level(tmp_path, "lower", lower=lower_level(*TURNS, **TICK))
    cycle = any_cycle(ts)
    flow = Flow(ts, Confirmation((), (), cycle, cycle.cases, Keyed(), Limits()), [])
    [step, back] = flow._phases(1).waiting
    assert (step, back) == (((0,), (1,)), ((1,), (0,)))
    assert list(flow._loops_in_words(1)) == [
        "`new_command` = false; `new_command` = true (lines `1`, `2`, `3`)"
    ]
    fresh = (cycle.before["new_command"], cycle.after["new_command"])
    goes_on = (cycle.tables[1].chosen, command_stays(ts, cycle))
    for condition, truths in zip(flow.no_loop_steps(), (fresh, fresh[::-1]), strict=True):
        taken = [values.negation(truths[0]), truths[1], *goes_on]
        keyed, solver = Keyed(), Solver()
        solver.add(keyed.term(values.negation(condition)))
        told = [keyed.term(values.negation(each)) for each in taken]
        solver.add(*keyed.ranges)
        assert solver.check() is Answer.SATISFIABLE
        assert {solver.check(each) for each in told} == {Answer.UNSATISFIABLE}


@pytest.mark.parametrize("waits", [True, False])
def test_a_loop_is_waited_on_only_where_the_command_may_be_unanswered(
    waits: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ts = small_level(tmp_path, "lower", lower=lower_level(*TURNS, **TICK))
    cycle = any_cycle(ts)
    flow = Flow(ts, Confirmation((), (), cycle, cycle.cases, Keyed(), Limits()), [])
    monkeypatch.setattr(termination, "unanswered", lambda *_: values.truth(waits))
    assert flow._phases(1).loops == (({(0,), (1,)}, waits),)
    assert flow._phases(1).changes == (None if waits else 0)


@pytest.mark.parametrize("most", [1, 2, 400])
def test_changes_of_phase_of_a_weaker_invariant_are_asked_about_again(
    lower: tuple[TransitionSystem, LevelProof], monkeypatch: pytest.MonkeyPatch, most: int
) -> None:
    """However many of them were listed: the same are found as where none was."""
    ts, proof = lower
    cycle = any_cycle(ts)
    asked = Confirmation(proof.predicates, (), cycle, cycle.cases, Keyed(), Limits())
    weak = Flow(ts, asked, [])
    with monkeypatch.context() as few:
        few.setattr(termination, "MOST_STEPS", most)
        known = [weak._phases(number) for number in range(len(weak.tables))]
    anew, again = Flow(ts, asked, proof.clauses), Flow(ts, asked, proof.clauses, weak)
    found = [anew._phases(number) for number in range(len(known))]
    assert [again._phases(number) for number in range(len(known))] == found
    assert found != known


def test_of_lines_that_ran_it_is_not_asked_whether_they_never_do(upper: TransitionSystem) -> None:
    cycle = any_cycle(upper)
    asked = Confirmation((), (), cycle, cycle.cases, Keyed(), Limits())
    lines = [(str(at.table.name), str(line.name)) for at in cycle.every for line, _ in at.lines]
    assert len(never_run(asked, (), lines[1:])) == 1
    assert never_run(asked, (), lines) == []


def test_members_are_of_one_sort_wherever_they_stand() -> None:
    keyed, kind = Keyed(), Enum("c", ("a", "b", "c"))
    sorts = {str(term.sort()) for term in (keyed.variable("m", kind), keyed.literal(kind, 1))}  # type: ignore[attr-defined]  # a Z3 term
    assert len(sorts) == 1


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
    others = [name for name in asked if name.startswith(("lines", "ends"))]
    assert {"lines 1", "ends pause 1", "ends go 1"}.issubset(others)
    assert not any(name.endswith(" 0") for name in others)
    assert "lines and endings as before" not in asked
    assert [name for name in asked if name not in others] == [
        "first", "restart", "step pause", "step go", "goals first", "goals restart",
        "goals some_line", "goals one_line", "goals echoes", "goals done_stays", "goals failed_stays", "goals once", "stands 1",
    ]  # fmt: skip
    for text in asked.values():
        for line in text.splitlines():
            if line.startswith("(declare-fun |command.inc_command") or "inc_command_seen ()" in line:
                name = line.removeprefix("(declare-fun ").partition(" () ")[0]
                assert f"(and (<= 0 {name}) (>= 65535 {name}))" in text


def test_a_cycle_that_runs_no_table_is_a_step_of_its_own() -> None:
    """Here, where an input is refused."""
    ts = alone(
        "input a : int 0 .. 9\nstate n : int 0 .. 9\ninvariant few : n < 5\n"
        "table t {\n| line | a || n |\n| one | < 5 || 1 |\n| two | >= 5 || 2 |\n}\n"
        "level l {\n  period 40 [ms]\n  table t\n}\n"
    )
    asked = certificate(ts, prove_level(ts, LITTLE))
    assert [name for name in asked if not name.startswith("goals")] == [
        "first", "restart", "step t", "step of no table", "lines 1",
    ]  # fmt: skip
