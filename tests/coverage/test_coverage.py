"""Cores, slips and offers: against the interpreter on drawn levels, and on a counter of retries whose reset nothing speaks of."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from rcsc.compose.contract.claims import ACCEPTED, Verdict
from rcsc.compose.contract.environment import Given
from rcsc.compose.contract.obligations import obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.again import shown_again
from rcsc.compose.coverage.cores import Core, core, each_needed
from rcsc.compose.coverage.covered import Coverage, covered, stated
from rcsc.compose.coverage.offers import notices
from rcsc.compose.coverage.parts import How, Use, switched, uses_of
from rcsc.compose.coverage.questions import Questions
from rcsc.compose.coverage.slips import Fate, environments, judged, slips_of
from rcsc.compose.invariant.search import FoundInvariant
from rcsc.compose.proof.level import LevelProof, prove_level
from rcsc.compose.proof.system import read_systems, transition_systems
from rcsc.front.commands import run
from rcsc.lang.leaves import everything
from tests.coverage.drawn import broken_by_some_run, drawn, with_off
from tests.support.programs.systems import LITTLE, alone, solo_system

PROTOCOL = Path(__file__).parents[1] / "data" / "protocol"
ROBOT = """\
enum phase { still, moving, bad }
input go : bool
input blocked : bool
input there : bool
state now : phase
state tries : int 0 .. 2
output fast : bool
property third_fails : was (now = moving and tries = 2) and blocked and not there implies now = bad
property slow : now /= moving implies not fast
procedure begin(p : phase) {
  now := p
  tries := 0
}
procedure retry {
  tries := tries + 1
}
table t {
  | line  | now    | go    | there | blocked | tries || procedures    | fast  | now   |
  |-------|--------|-------|-------|---------|-------||---------------|-------|-------|
  | start | still  | true  |       |         |       || begin(moving) | true  |       |
  | idle  | still  | false |       |         |       ||               | false | still |
  | there | moving |       | true  |         |       ||               | false | still |
  | on    | moving |       | false | false   |       ||               | true  |       |
  | again | moving |       | false | true    | < 2   || retry         | true  |       |
  | third | moving |       | false | true    | 2     ||               | false | bad   |
  | bad   | bad    | false |       |         |       ||               | false |       |
  | reset | bad    | true  |       |         |       ||               | false | still |
}
level solo { period 10 [ms] table t }
"""
DEFERRED = """\
enum phase { still, moving, bad }
input go : bool
input blocked : bool
input there : bool
input echoed : bool
state now : phase deferred until echoed
state tries : int 0 .. 2 deferred until echoed
output failed : bool
property third_fails : now = moving and tries = 2 and blocked and not there implies failed
procedure phase(p : phase) {
  next now := p
}
procedure begin(p : phase) {
  next now := p
  next tries := 0
}
procedure retry {
  next tries := tries + 1
}
table t {
  | line  | now    | go    | there | blocked | tries || procedures    | failed |
  |-------|--------|-------|-------|---------|-------||---------------|--------|
  | start | still  | true  |       |         |       || begin(moving) | false  |
  | idle  | still  | false |       |         |       ||               | false  |
  | there | moving |       | true  |         |       || phase(still)  | false  |
  | on    | moving |       | false | false   |       ||               | false  |
  | again | moving |       | false | true    | < 2   || retry         | false  |
  | third | moving |       | false | true    | 2     || phase(bad)    | true   |
  | bad   | bad    | false |       |         |       ||               | true   |
  | reset | bad    | true  |       |         |       || phase(still)  | true   |
}
level solo { period 10 [ms] table t }
"""
"""The same, which takes what comes next where an order is echoed: as levels do that wait for others."""


@cache
def looked_at(text: str) -> tuple[TransitionSystem, Coverage]:
    """Prove a level, and look at what is stated of it; once for all tests of a process."""
    with TemporaryDirectory() as folder:
        systems, loaded = read_systems(solo_system(Path(folder), text))
        ts = systems["solo"]
        return ts, covered(ts, prove_level(ts, LITTLE), next(iter(loaded.values())))


def leaves(uses: tuple[Use, ...]) -> set[tuple[str, str]]:
    """Name uses by their line and what they write."""
    return {(use.line, leaf) for use in uses for leaf in use.part.leaves}


def found_cores(ts: TransitionSystem) -> list[Core]:
    """Return the core of each property that is proved."""
    proof = prove_level(ts, LITTLE)
    cores = []
    for place in environments(ts, proof):
        asked = Questions(place.ts, place.proof, How.FREE)
        cores += [core(asked, key) for key in stated(ts, proof) if key in place.keys]
    assert None not in cores
    return [one for one in cores if one is not None]


# --- cores -----------------------------------------------------------------------------------


def test_a_requirement_needs_what_it_follows_from_and_no_more() -> None:
    ts, found = looked_at(ROBOT)
    fails, slow = found.cores
    assert fails.minimal
    assert slow.minimal
    assert leaves(fails.uses) == {("third", "now")}
    assert leaves(slow.uses) == {
        ("start", "now"),
        *((line, "fast") for line in ("idle", "there", "third", "bad", "reset")),
    }
    assert ("start", "tries") in leaves(found.unneeded)
    assert leaves(found.unneeded) == leaves(uses_of(ts.program, ts.level)) - leaves(fails.uses) - leaves(
        slow.uses
    )


def shows_and_nothing_smaller_does(text: str) -> int:
    """Hold the cores of a level against every run; return how many members they have."""
    ts = alone(text)
    every, members = uses_of(ts.program, ts.level), 0
    for one in found_cores(ts):
        name, rest = one.key[2], [use for use in every if use not in one.uses]
        assert not broken_by_some_run(with_off(ts, How.FREE, rest), name)
        assert one.minimal
        for use in one.uses:
            members += 1
            assert broken_by_some_run(with_off(ts, How.FREE, [*rest, use]), name)
    return members


def test_whatever_the_rest_writes_a_core_shows_its_requirement_and_nothing_smaller_does() -> None:
    assert shows_and_nothing_smaller_does(drawn(7)) > 3


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(30))
def test_cores_of_many_drawn_levels_are_minimal(seed: int) -> None:
    shows_and_nothing_smaller_does(drawn(seed))


ASSUMING = """\
input x : int 0 .. 9
state n : int 0 .. 9
assume small assumed : x <= 3
assume even assumed : x /= 1
table t assuming small, even {
  | line | x || n |
  |------|---||---|
  | one  |   || x |
}
property low : n <= 3
property known : n <= 9
level solo { period 10 [ms] table t }
"""


def owed_by_another(text: str) -> TransitionSystem:
    """Return the level of a text whose assumptions another level owes."""
    ts = alone(text)
    given = tuple(Given(str(one.name), "x", "other", one.condition) for one in ts.program.assumptions)
    return replace(ts, links=replace(ts.links, written=(("x", "other", "y"),), given=given))


@pytest.mark.parametrize("ts", [alone(ASSUMING), owed_by_another(ASSUMING)], ids=["trusted", "owed"])
def test_an_assumption_is_needed_or_is_not(ts: TransitionSystem) -> None:
    low, known = found_cores(ts)
    assert (low.assumptions, leaves(low.uses), low.minimal) == (("small",), {("one", "n")}, True)
    assert (known.assumptions, known.uses, known.minimal) == ((), (), True)
    assert covered(ts, prove_level(ts, LITTLE)).assumptions == ("even",)


def test_where_fewer_might_do_nothing_is_called_minimal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rcsc.compose.coverage.cores.MOST_TRIED", 0)
    assert not any(one.minimal for one in found_cores(alone(ROBOT)))


def test_members_that_another_proof_does_without_are_left_out() -> None:
    """Two too many to begin with: they go, and of what stays a run shows that it is needed."""
    ts = alone(ROBOT)
    [place] = environments(ts, prove_level(ts, LITTLE))
    asked = Questions(place.ts, place.proof, How.FREE)
    key = ("property", "", "third_fails")
    wanted = {("third", "now"), ("start", "tries"), ("idle", "fast")}
    begun = [one for one in asked.members if isinstance(one, Use) and leaves((one,)) & wanted]
    members, minimal = each_needed(asked, key, frozenset(begun))
    assert minimal
    assert leaves(tuple(one for one in members if isinstance(one, Use))) == {("third", "now")}


def test_what_is_written_again_and_again_is_free_each_time() -> None:
    text = """\
input x : int 0 .. 3
state n : array[2] of int 0 .. 3
procedure set {
  for i in 0 .. 1 {
    n[i] := x
  }
}
table t {
  | line | x || procedures |
  |------|---||------------|
  | one  |   || set        |
}
property alike : n[0] = n[1]
level solo { period 10 [ms] table t }
"""
    ts = alone(text)
    [one] = found_cores(ts)
    assert leaves(one.uses) == {("one", "n[0]"), ("one", "n[1]")}
    assert one.minimal
    free = switched(ts.program, ts.level, How.FREE).program
    assert len(free.variables) - len(ts.program.variables) == 1 + 4  # two elements, each time either


def test_what_comes_with_the_protocol_is_no_requirement() -> None:
    ts = transition_systems(PROTOCOL / "system.toml")["supervisor"]
    every = tuple((owed, Verdict.PROVED) for owed in obligations(ts, ts.cycle(ts.havoc())))
    names = {key[2] for key in stated(ts, LevelProof(ts.level.name, every, (), (), 0, 0, 0.0))}
    assert names == {one.name for one in ts.program.properties if not one.standard}
    assert any(one.standard for one in ts.program.properties)


def test_what_the_protocol_makes_is_no_part_of_a_program() -> None:
    """Its procedures stand where the neighbour is declared; what a line orders is a part all the same."""
    ts = transition_systems(PROTOCOL / "system.toml")["supervisor"]
    made = {
        str(one.name)
        for one in ts.program.procedures
        if all(each.span == one.span for each in everything(one.body))
    }
    uses = uses_of(ts.program, ts.level)
    assert "take_orders" in made
    assert made.isdisjoint(use.part.procedure for use in uses)
    assert made.isdisjoint(use.line for use in uses if not use.table)
    assert any(leaf.endswith("input_command") for use in uses for leaf in use.part.leaves)


# --- slips -----------------------------------------------------------------------------------


def survives_if_no_run_breaks_anything(text: str) -> set[Fate]:
    """Hold the verdicts on all slips of a level against every run; return which there are."""
    ts = alone(text)
    proof = prove_level(ts, LITTLE)
    names = [key[2] for key in stated(ts, proof)]
    held = set(names) - broken_by_some_run(ts, *names)
    assert held == {
        owed.name for owed, verdict in proof.verdicts if verdict in ACCEPTED and owed.name in names
    }
    fates = set[Fate]()
    for one in judged(environments(ts, proof)):
        wrong = broken_by_some_run(with_off(ts, How.LEFT_OUT, one.slip.uses), *held)
        assert bool(wrong) is (one.fate is Fate.NOTICED)
        assert one.fate is not Fate.OPEN
        assert {key[2] for key in one.by} <= wrong
        fates.add(one.fate)
    return fates


def test_a_slip_survives_if_no_run_breaks_anything() -> None:
    assert {Fate.NOTICED, Fate.SURVIVES} <= survives_if_no_run_breaks_anything(drawn(17))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(30))
def test_slips_of_many_drawn_levels_survive_if_no_run_breaks_anything(seed: int) -> None:
    survives_if_no_run_breaks_anything(drawn(seed))


def test_a_reset_that_nothing_speaks_of_can_be_left_out() -> None:
    _, found = looked_at(ROBOT)
    fates = {
        (one.slip.uses[0].line, one.slip.uses[0].part.leaves[0]): one.fate
        for one in found.slips
        if not one.slip.whole_line
    }
    assert fates["start", "tries"] is Fate.SURVIVES
    assert fates["again", "tries"] is Fate.SURVIVES
    assert fates["third", "now"] is Fate.NOTICED
    assert fates["start", "now"] is Fate.NOTICED
    assert Fate.OPEN not in fates.values()


def test_what_writes_what_is_there_changes_nothing() -> None:
    """The second `lamp := true` finds it true in each cycle that is reached; an invariant says so."""
    text = """\
input go : bool
state on : bool
state lamp : bool
invariant together : lamp = on
property lit : on then lamp
table t {
  | line  | on    | go    || lamp  | on    |
  |-------|-------|-------||-------|-------|
  | rise  | false | true  || true  | true  |
  | rest  | false | false || false | false |
  | stays | true  |       || true  | true  |
}
level solo { period 10 [ms] table t }
"""
    ts = alone(text)
    every = list(judged(environments(ts, prove_level(ts, LITTLE))))
    whole = {one.slip.uses[0].line: one.fate for one in every if one.slip.whole_line}
    assert whole == {"rise": Fate.SURVIVES, "rest": Fate.CHANGES_NOTHING, "stays": Fate.CHANGES_NOTHING}
    cells = {
        (one.slip.uses[0].line, one.slip.uses[0].part.leaves[0]): one.fate
        for one in every
        if not one.slip.whole_line
    }
    assert cells["stays", "lamp"] is Fate.CHANGES_NOTHING


def test_a_slip_that_only_a_long_run_shows_is_noticed() -> None:
    """It comes to the twelfth cycle, later than short runs look; what is left of the invariant does not exclude it."""
    text = """\
input go : bool
state n : int 0 .. 12
state laps : int 0 .. 1
property wraps : was n = 12 implies n = 0
table t {
  | line  | n    || n     | laps     |
  |-------|------||-------|----------|
  | count | < 12 || n + 1 |          |
  | wrap  | 12   || 0     | 1 - laps |
}
level solo { period 10 [ms] table t }
"""
    ts = alone(text)
    fates = {
        one.slip.uses[0].part.leaves[0]: one.fate
        for one in judged(environments(ts, prove_level(ts, LITTLE)))
        if not one.slip.whole_line and one.slip.uses[0].line == "wrap"
    }
    assert fates == {"n": Fate.NOTICED, "laps": Fate.SURVIVES}


def test_what_a_search_says_counts_only_if_it_is_confirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    ts = alone(ROBOT.replace("implies now = bad", "implies now = still"))
    proof = prove_level(ts, LITTLE)
    asked = [("property", "", "third_fails")]
    assert [owed.name for owed in proof.open] == ["third_fails"]
    assert not shown_again(ts, proof, range(len(proof.clauses)), asked)
    assert shown_again(ts, proof, range(len(proof.clauses)), [("property", "", "slow")])
    monkeypatch.setattr("rcsc.compose.coverage.again.search", lambda *_: FoundInvariant())
    assert not shown_again(ts, proof, (), asked)


def test_an_invariant_is_no_requirement_and_notices_nevertheless() -> None:
    text = ROBOT.replace("property third_fails", "invariant low : tries <= 2\nproperty third_fails")
    ts = alone(text)
    assert [key[2] for key in stated(ts, prove_level(ts, LITTLE))] == ["third_fails", "slow"]


# --- offers ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "slip", "said"),
    [
        (ROBOT, "  tries := 0\n", "property begin_sets_tries : was now = still and go implies tries = 0"),
        (DEFERRED, "  next tries := 0\n", "property begin_sets_tries : @T(now = moving) implies tries = 0"),
    ],
    ids=["at once", "deferred"],
)
def test_what_is_offered_is_proved_and_refuted_once_the_slip_is_made(text: str, slip: str, said: str) -> None:
    _, found = looked_at(text)
    offers = {one.text for one in found.offers}
    assert said in offers
    for each in offers:
        ts = alone(f"{text}{each}\n")
        assert not prove_level(ts, LITTLE).open, each
    wrong = alone(f"{text.replace(slip, '')}{said}\n")
    assert [owed.name for owed in prove_level(wrong, LITTLE).open] == ["begin_sets_tries"]


def test_what_is_false_of_the_level_and_what_the_slip_keeps_is_not_offered() -> None:
    ts = alone(ROBOT)
    places = environments(ts, prove_level(ts, LITTLE))
    [reset] = [
        slip
        for slip in slips_of(uses_of(ts.program, ts.level))
        if slip.uses[0].part.leaves == ("tries",)
        and slip.uses[0].part.procedure == "begin"
        and not slip.whole_line
    ]
    said = (
        "was now = still implies tries = 0",
        "now = bad implies not fast",
        "was now = still and go implies tries = 0",
    )
    properties = [alone(f"{ROBOT}property said : {each}\n").program.properties[-1] for each in said]
    assert [notices(places, reset, one) for one in properties] == [False, False, True]


def test_the_manual_says_what_is_found() -> None:
    page = (Path(__file__).parents[2] / "grammar" / "requirements.md").read_text(encoding="utf-8")
    section = page.partition("## What no requirement speaks of")[2].partition("\n## ")[0]
    text = section.partition("```rcs\n")[2].partition("```")[0]
    _, found = looked_at(text.replace("level l ", "level solo "))
    [fails] = found.cores
    assert (leaves(fails.uses), fails.minimal) == ({("third", "now")}, True)
    assert "`third_fails` needs one assignment, `bad` in line `third`" in section
    said = {one.text: found.slips[one.slip] for one in found.offers}
    [offered] = [
        each for each in said if each.startswith("property begin_sets_tries") and f"`{each}`" in section
    ]
    assert said[offered].slip.uses[0].part.leaves == ("tries",)


# --- as it is told -----------------------------------------------------------------------------


def test_the_command_tells_it_and_keeps_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    system = solo_system(tmp_path, ROBOT)
    assert run(["prove", str(system), "--coverage"]) == 0
    printed = capsys.readouterr().out
    assert "property `third_fails` needs 1 assignment, no fewer" in printed
    assert "`tries := 0` of procedure `begin`, run by line `start` of `t`" in printed
    assert (
        "would be noticed by  property begin_sets_tries : was now = still and go implies tries = 0" in printed
    )
    assert run(["prove", str(system), "--coverage", "--json"]) == 0
    [level] = json.loads(capsys.readouterr().out)["levels"]
    told = level["coverage"]
    assert [one["name"] for one in told["needs"]] == ["third_fails", "slow"]
    assert all(one["minimal"] for one in told["needs"])
    assert {one["fate"] for one in told["slips"]} == {"survives", "noticed"}
    assert run(["prove", str(system), "--json"]) == 0
    assert "coverage" not in json.loads(capsys.readouterr().out)["levels"][0]


def test_the_matrix_shows_it_once_it_is_known(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    system = solo_system(tmp_path, ROBOT)
    asked = ["trace", str(system.with_name("solo.rcs")), "--no-vectors", "--find", "t again"]
    assert run(["prove", str(system)]) == 0
    assert run(asked) == 0
    assert "no requirement of the level speaks" not in capsys.readouterr().out
    assert run(["prove", str(system), "--coverage"]) == 0
    assert run(asked) == 0
    printed = capsys.readouterr().out
    assert "no requirement of the level speaks of what it writes to tries, fast" in printed
    assert "without all that it does, everything that is proved of the level still holds" in printed
    assert run([*asked[:-1], "slow"]) == 0
    assert "needs 6 assignments, no fewer" in capsys.readouterr().out


def test_of_a_level_without_requirements_one_line_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "".join(row for row in ROBOT.splitlines(keepends=True) if not row.startswith("property"))
    assert run(["prove", str(solo_system(tmp_path, text)), "--coverage"]) == 0
    told = capsys.readouterr().out.partition("coverage of level solo")[2]
    assert told.splitlines() == ["  no property and no requirement is stated of it: none speaks of any line"]


COMES = """\
input asks : bool
input tick : bool
output done : bool
state left : int 0 .. 3
assume alive assumed : never (not tick) for 30 [ms]
requirement comes : when asks, eventually done
module count reads tick, left, asks writes left, done {
  if left > 0 { if tick { left := left - 1 } } else if asks { left := 3 }
  done := left = 0
}
table t {
  | line | asks ||
  |------|------||
  | any  |      ||
}
level l { period 10 [ms] preprocess count table t }
"""


def test_what_has_to_come_eventually_needs_what_its_bound_needs() -> None:
    """Not nothing, as of a condition that no cycle breaks; and a slip that lets it wait for ever is noticed."""
    ts = alone(COMES)
    found = covered(ts, prove_level(ts, LITTLE))
    [one] = found.cores
    assert {use.part.leaves for use in one.uses} == {("left",), ("done",)}
    fates = {one.slip.uses[0].part.span.start: one.fate for one in found.slips}
    assert sorted(fates.values()) == [Fate.NOTICED, Fate.NOTICED, Fate.SURVIVES]
