"""Invariants and properties that a program states: read, laid out, proved of a level in its environment, refuted by the shortest run."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from random import Random

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.cache import open_cache
from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.predicates import CLOSELY, Predicate
from rcsc.compose.contract.properties import every_predicate, property_kept
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.walk import Walk
from rcsc.compose.counterexample.cycle_run import broken
from rcsc.compose.counterexample.finding import of_trace
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces
from rcsc.compose.invariant.search import Effort, read
from rcsc.compose.proof.level import LevelProof, Verdict, certificate, prove_level
from rcsc.compose.proof.system import keep, recall, transition_systems
from rcsc.front.commands import run
from rcsc.lang.interpret import Fault, cycle, initial
from rcsc.lang.model import Enum, Kind, Value, key_bounds, value_of_key
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smtlib import cvc5_refutes
from rcsc.proof.table.program import prove_program
from tests.support.programs.stages import emitted, program_of, refused
from tests.support.programs.systems import alone, small_level, small_text
from tests.support.programs.texts import edit_file, edited, one_row_a_line
from tests.support.proved import ran, shortest, time_line

REPO = Path(__file__).parents[2]
SHIPPED = REPO / "tables" / "system.toml"
LITTLE = Effort(walks=6, cycles=40)


def stated(ts: TransitionSystem) -> dict[str, Obligation]:
    every = obligations(ts, ts.cycle(ts.havoc()))
    return {
        obligation.name: obligation
        for obligation in every
        if obligation.sort in {Sort.INVARIANT, Sort.PROPERTY}
    }


def verdicts(proof: LevelProof) -> dict[str, bool]:
    return {
        obligation.name: verdict is Verdict.PROVED
        for obligation, verdict in proof.verdicts
        if obligation.sort in {Sort.INVARIANT, Sort.PROPERTY}
    }


# --- as text -------------------------------------------------------------------------------

WORDS = """\
enum e { a, b }

input x : e
input then : bool

state until : bool
state upon : bool
state property : int 0 .. 9

## Doc.
property plain : was x = a implies property = was property + 1 and was (property = 2 or until)
# why
property two : property = 3 then property = -was property - was (-property)
property three : until until not then
property four : upon upon not until
"""


def test_properties_are_laid_out_and_their_words_are_still_names() -> None:
    ragged = re.sub(r"(?<=\w) (?=[:=])", "   ", WORDS).replace(" then property", "\n   then\n property")
    assert ragged != WORDS
    laid_out = edited(WORDS, ("\n# why", "\n\n# why"))
    for text in (ragged, laid_out):
        parsed = parse(Source("case.rcs", text))
        assert isinstance(parsed, tree.File)
        assert format_file(parsed) == laid_out
    assert [claim.text for claim in program_of(WORDS).properties] == [
        "was x = a implies property = was property + 1 and was (property = 2 or until)",
        "property = 3 then property = -was property - was (-property)",
        "until until not then",
        "upon upon not until",
    ]
    assert program_of(WORDS).properties[0].doc == "Doc."


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("property", [("RCS101", "")]),
        ("property p :", [("RCS101", "")]),
        ("property p : n = 1 then", [("RCS101", "")]),
        ("property p : n = 1 while n = 2", [("RCS101", "while")]),
        ("property p : n = 1 then n = 2 then n = 3", [("RCS101", "then")]),
        ("property p : was was n = 1", [("RCS101", "n")]),
        ("property p : m = 1", [("RCS201", "m")]),
        ("property p : n = 1 until m = 1", [("RCS201", "m")]),
        ("property p : n", [("RCS301", "n")]),
        ("property p : n = 1 then n", [("RCS301", "n")]),
        ("property p : n = was go", [("RCS301", "n = was go")]),
        ("property p : was long = 3 [mm]", [("RCS302", "was long = 3 [mm]")]),
        ("property p : was 4 < 5", [("RCS316", "was 4 < 5")]),
        ("property p : true then n = 1", [("RCS316", "true")]),
        ("property p : n = 1 until 2 > 3", [("RCS316", "2 > 3")]),
        ("property p : was (n = was n)", [("RCS315", "was n")]),
        ("property p : was n = 1 then n = 2", [("RCS315", "was n")]),
        ("property p : was n = 1 until n = 2", [("RCS315", "was n")]),
        ("property p : n = 1 until was go", [("RCS315", "was go")]),
        ("property p : was n = 1 upon n = 2", [("RCS315", "was n")]),
        ("property p : n = 1 upon was go", [("RCS315", "was go")]),
        ("invariant p : n = was n", [("RCS315", "was n")]),
        ("state k : int 0 .. was n", [("RCS315", "was n")]),
        ("property p : go\nproperty p : n = 1", [("RCS202", "p")]),
        ("property p : go\nassume p : go", [("RCS202", "p")]),
    ],
)
def test_what_is_wrong_is_said_where_it_stands(text: str, found: list[tuple[str, str]]) -> None:
    before = "state n : int 0 .. 9\nstate go : bool\nstate long : int 0 .. 9 [m]\n"
    whole = before + text
    said = refused(whole)
    places = [
        (finding.code.value, whole[finding.primary.span.start : finding.primary.span.end].strip())
        for finding in said
    ]
    assert places == found


def test_an_error_in_a_property_does_not_hide_the_next_declaration() -> None:
    said = refused("property p : (\nproperty q : n = 1\nproperty r :: go\n")
    assert [(finding.code.value, finding.primary.span.start) for finding in said] == [
        ("RCS101", 24),
        ("RCS101", 46),
    ]


# --- what a table proved alone says of them ---------------------------------------------------

GRIP = """
enum order { rest, grasp }
input wanted : order
input touching : bool
state grasps : int 0 .. 9
output hand : order
output done : bool
procedure count { if hand = rest and grasps < 9 { grasps := grasps + 1 } }
procedure judge { done := hand = grasp and touching }
table close {
  | line  | wanted || procedures   | hand  |
  |-------|--------||--------------|-------|
  | close | grasp  || judge; count | grasp |
  | open  | rest   || judge        | rest  |
}
level grip { period 40 [ms] table close }
"""
FALSE = "property never_done : not done\nproperty always_open : hand = rest\n"


def test_check_proves_no_property_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "grip.rcs"
    path.write_text(GRIP + FALSE, encoding="utf-8")
    (tmp_path / "rcsc.toml").write_text("", encoding="utf-8")
    for _ in range(2):  # the second time from the cache
        assert run(["check", str(path), "--json"]) == 0
        [said] = json.loads(capsys.readouterr().out)["diagnostics"]
        assert (said["code"], said["severity"]) == ("RCS420", "note")
        assert said["message"] == "properties `never_done`, `always_open` are not proved here"
    path.write_text(GRIP, encoding="utf-8")
    assert run(["check", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["diagnostics"] == []


def test_a_cached_proof_says_so_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a comment more the file is read again; nothing that was proved is proved again."""
    monkeypatch.setenv("RCSC_CACHE_DIR", str(tmp_path / "cache"))
    path = tmp_path / "grip.rcs"
    path.write_text(GRIP + FALSE, encoding="utf-8")
    assert run(["check", str(path), "--json"]) == 0
    before = json.loads(capsys.readouterr().out)
    path.write_text(GRIP + FALSE + "# a comment\n", encoding="utf-8")
    monkeypatch.setattr(
        "rcsc.proof.table.program.prove_program", lambda *_args, **_more: pytest.fail("proved again")
    )
    assert run(["check", str(path), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert [one["cached"] for one in (*before["tables"], *again["tables"])] == [False, True]
    assert [one["message"] for one in again["diagnostics"]] == [
        one["message"] for one in before["diagnostics"]
    ]
    assert len(again["diagnostics"]) == 1


def test_nothing_is_generated_for_a_property() -> None:
    with_it, without = program_of(GRIP + FALSE), program_of(GRIP)
    assert with_it != without
    assert emitted(with_it) == emitted(without)
    found = prove_program(with_it, Options(solver="boxes")).findings
    assert [(finding.code, finding.severity) for finding in found] == [
        (Code.PROPERTY_ELSEWHERE, Severity.NOTE)
    ]


# --- what each means --------------------------------------------------------------------------

PAIR = """
state p : bool
state q : bool
input i : bool
table t {
  | line | when ||
  | a    | true ||
}
level l { period 40 [ms] table t }
"""
Meaning = Callable[[bool, bool, bool, bool], bool]
MEANINGS: dict[str, Meaning] = {
    "p or q": lambda _p, _q, p, q: p or q,
    "p then q": lambda p, _q, _p2, q2: q2 if p else True,
    "p until q": lambda p, q, p2, q2: p2 or q2 or not p or q,
    "p upon q": lambda p, _q, p2, q2: p or q2 or not p2,
    "was p": lambda p, _q, _p2, _q2: p,
    "was (p and not q) implies q": lambda p, q, _p2, q2: q2 if p and not q else True,
    "p and not q then p": lambda p, q, p2, _q2: p2 if p and not q else True,
    "p then was q or q": lambda p, q, _p2, q2: q or q2 if p else True,
    "was p = q": lambda p, _q, _p2, q2: p == q2,
    "not was p and p implies was q": lambda p, q, p2, _q2: q if p2 and not p else True,
}


@pytest.mark.parametrize("text", MEANINGS)
def test_a_property_means_what_the_manual_says_of_every_two_cycles(text: str) -> None:
    ts = alone(f"{PAIR}property it : {text}\n")
    for p, q, p2, q2 in product((False, True), repeat=4):
        before, after = {"p": p, "q": q, "i": False}, {"p": p2, "q": q2, "i": True}
        assert property_kept(ts, "it", before, after) is MEANINGS[text](p, q, p2, q2)


def test_was_goes_into_sets_and_arrays_with_their_index() -> None:
    kept = "state kept : array[2] of int 0 .. 9\nstate n : int 0 .. 1\n"
    ts = alone(f"{kept}{PAIR}property whole : was kept[n] = 7\nproperty among : was (kept[n] in {{2, 7}})\n")
    before, after = {"kept[0]": 1, "kept[1]": 7, "n": 1}, {"kept[0]": 5, "kept[1]": 5, "n": 0}
    for name in ("whole", "among"):
        assert property_kept(ts, name, before, after)
        assert not property_kept(ts, name, after, before)
        assert not property_kept(ts, name, {**before, "n": 0}, {**before, "n": 1})


def test_inputs_are_those_that_the_cycle_took() -> None:
    text = (
        "input i : bool\nstate s : bool\ntable t {\n | line | i || s |\n | y | true || true |\n | n | false || false |\n}\n"
        "level l { period 40 [ms] table t }\n"
        "property now : s = i\nproperty late : s = was i\nproperty behind : was s = was i\n"
    )
    ts = alone(text)
    assert verdicts(prove_level(ts, LITTLE)) == {"now": True, "late": False, "behind": False}
    late = shortest(ts, stated(ts)["late"])
    assert late is not None
    assert [step.taken for step in late.steps] == [{"i": True}]
    # before the first cycle after a restart inputs are as they stand in the buffers, and `s` as at first
    assert shortest(ts, stated(ts)["behind"]) is None
    [restarted] = traces(ts, [stated(ts)["behind"]], TraceSearch(most=2, restarted=True)).values()
    assert isinstance(restarted, Trace)
    assert (restarted.restarted, len(restarted.steps), restarted.steps[0].before["i"]) == (True, 1, True)


def test_a_table_may_have_its_default_line_alone() -> None:
    text = (
        "input x : int 0 .. 3\nstate y : int 0 .. 3\n"
        "table t {\n | line | x || y |\n | rest | DEFAULT || x |\n}\n"
        "level l { period 40 [ms] table t }\nproperty same : y = x\nproperty late : was y = x\n"
    )
    assert verdicts(prove_level(alone(text), LITTLE)) == {"same": True, "late": False}


COUNTING = """
state n : int 0 .. 3 = 3
state kept : array[3] of int 0 .. 1
state big : int 0 .. 9223372036854775807
procedure count { n := (n + 1) mod 4 big := 9223372036854775807 }
table t {
  | line | when || procedures |
  | a    | true || count      |
}
level l { period 40 [ms] table t }
"""
UNDEFINED: dict[str, int | None] = {  # after the cycles `n` is 0, 1, 2, 3, 0, and so on
    "9 / n >= 1": 1,
    "9 / n >= 3": 1,
    "9 mod was n >= 0": 2,
    "kept[n] = 0": 4,
    "kept[was n] = 0": 1,
    "was kept[n] = 0": 1,
    "big * 3 >= 0": 1,
    "was big * 3 >= 0": 2,
    "n /= 0 implies 9 / n >= 1": None,
    "n < 3 implies kept[n] < 2": None,
    "n + n < 6 implies kept[n] < 2": None,
    "was n = 0 or 9 mod was n < 3": None,
}


@pytest.mark.parametrize("text", UNDEFINED)
def test_what_is_not_defined_does_not_hold(text: str) -> None:
    ts = alone(f"{COUNTING}property it : {text}\n")
    least = UNDEFINED[text]
    assert verdicts(prove_level(ts, LITTLE)) == {"it": least is None}
    trace = shortest(ts, stated(ts)["it"])
    assert (None if trace is None else len(trace.steps)) == least


# --- against enumeration ----------------------------------------------------------------------

LEAVES = {
    "wanted": ("rest", "grasp"),
    "touching": ("true", "false"),
    "hand": ("rest", "grasp"),
    "done": ("true", "false"),
}
MANY = 40
"""Properties of one program."""


def some_condition(random: Random, *, was: bool) -> str:
    """A small condition; with `was` where it may stand."""
    atoms = []
    for _ in range(random.randint(1, 3)):
        past = "was " if was and random.random() < 0.4 else ""
        leaf = random.choice((*LEAVES, "grasps"))
        said = (
            f"{random.choice(('<', '=', '>='))} {random.randint(0, 3)}"
            if leaf == "grasps"
            else f"= {random.choice(LEAVES[leaf])}"
        )
        atoms.append(f"{past}{leaf} {said}")
    return random.choice((" and ", " or ", " implies ")).join(atoms)


def some_property(random: Random) -> str:
    match word := random.choice(("", "then", "until", "upon")):
        case "then":
            return f"{some_condition(random, was=False)} then {some_condition(random, was=True)}"
        case "until" | "upon":
            return f"{some_condition(random, was=False)} {word} {some_condition(random, was=False)}"
        case _:
            return some_condition(random, was=True)


def enumerated(ts: TransitionSystem, starts: list[dict[str, Value]]) -> dict[str, int]:
    """Of each property that breaks in some run from these states, in how many cycles it can."""
    program = ts.program
    inputs = [v for v in program.variables if v.kind is Kind.INPUT]
    offers = [
        dict(zip((str(v.name) for v in inputs), values, strict=True))
        for values in product(
            *(
                [value_of_key(v.type, key) for key in range(key_bounds(v.type)[0], key_bounds(v.type)[1] + 1)]
                for v in inputs
            )
        )
    ]
    found: dict[str, int] = {}
    seen: set[tuple[Value, ...]] = set()
    depth, wave = 1, starts
    while wave:
        following = []
        for before in wave:
            for taken in offers:
                outcome = cycle(program, ts.level, {**before, **taken})
                assert outcome.fault is Fault.OK
                for claim in program.properties:
                    if claim.name not in found and not property_kept(
                        ts, claim.name, before, outcome.snapshot
                    ):
                        found[claim.name] = depth
                if (key := tuple(outcome.snapshot.values())) not in seen:
                    seen.add(key)
                    following.append(outcome.snapshot)
        depth, wave = depth + 1, following
    return found


@pytest.mark.parametrize("seed", range(3))
def test_proofs_and_traces_are_what_enumeration_says(seed: int) -> None:
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    text = edited(GRIP, ("grasps < 9", "grasps < 3"), ("0 .. 9", "0 .. 3"))
    written = [f"property p{at} : {some_property(random)}\n" for at in range(MANY)]
    ts = alone(text + "".join(written))
    start = dict(initial(ts.program))
    least = enumerated(ts, [start])
    anew = [
        {**start, "wanted": wanted, "touching": touching}
        for wanted, touching in product((0, 1), (False, True))
    ]
    true = {f"p{at}" for at in range(MANY)} - least.keys() - enumerated(ts, anew).keys()
    assert 5 < len(true) < MANY - 5
    proof = prove_level(ts, LITTLE)
    assert {name for name, proved in verdicts(proof).items() if proved} == true
    found = traces(ts, list(stated(ts).values()), TraceSearch(most=8))
    assert {
        name: len(trace.steps) for (_, _, name), trace in found.items() if isinstance(trace, Trace)
    } == least


# --- a level in its environment -----------------------------------------------------------------


def with_properties(folder: Path, level: str, text: str) -> TransitionSystem:
    """A level of the small system, with more in its program."""
    return small_level(folder, level, **{level: small_text(level) + text})


KEPT = {
    "sent": "old_command = to_lower.input_command",
    "under_way": "begun until new_command",
    "numbered": "to_lower.input_command = was to_lower.input_command or to_lower.inc_command = (was to_lower.inc_command + 1) mod 65536",
    "answers_at_rest": "report.status_report /= executing implies to_lower.input_command = pause",
    "done_stays": "status_report = done and command.input_command = work until new_command",
    "one_go": "was to_lower.input_command = go and to_lower.input_command = go implies to_lower.inc_command = was to_lower.inc_command",
    "waits": "cur_state = going and not new_command then cur_state /= d_state or was status_report = done",
}
BROKEN = {  # with the least number of cycles
    "never_goes": ("to_lower.input_command = pause", 1),
    "goes_on": ("to_lower.input_command = go then to_lower.input_command = go", 2),
    "goes_until_done": ("to_lower.input_command = go until status_report = failed", 2),
    "done_for_good": ("status_report = done until begun and new_command and cur_state = going", 1),
    "never_fails": ("status_report /= failed", 2),
}


@pytest.fixture(scope="module")
def upper(tmp_path_factory: pytest.TempPathFactory) -> TransitionSystem:
    every = {**KEPT, **{name: text for name, (text, _) in BROKEN.items()}}
    text = "".join(f"property {name} : {said}\n" for name, said in every.items())
    return with_properties(tmp_path_factory.mktemp("stated"), "upper", text)


@pytest.fixture(scope="module")
def proof(upper: TransitionSystem) -> LevelProof:
    return prove_level(upper, LITTLE)


def test_what_is_true_of_a_level_for_any_delay_is_proved_and_nothing_else(proof: LevelProof) -> None:
    assert verdicts(proof) == {**dict.fromkeys(KEPT, True), **dict.fromkeys(BROKEN, False)}
    assert {obligation.name for obligation in proof.open} == BROKEN.keys()  # all else is proved as before


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_false_is_shown_by_the_shortest_run(upper: TransitionSystem, name: str) -> None:
    obligation, least = stated(upper)[name], BROKEN[name][1]
    trace = shortest(upper, obligation)
    assert isinstance(trace, Trace)
    assert [broken(upper, obligation, step) for step in trace.steps] == [False] * (least - 1) + [True]
    last = time_line({"upper": upper}, of_trace(upper, obligation, trace))
    assert any(f"property `{name}` is broken" in line for line in last)
    assert shortest(upper, obligation, most=least - 1) is None


def test_another_solver_confirms_the_certificate(upper: TransitionSystem, proof: LevelProof) -> None:
    questions = certificate(upper, proof)
    assert [name for name, text in questions.items() if not cvc5_refutes(text)] == []


def test_a_kept_proof_comes_back_with_the_features_it_was_made_with(
    upper: TransitionSystem, proof: LevelProof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RCSC_CACHE_DIR", str(tmp_path))
    cache = open_cache(tmp_path)
    assert cache is not None
    keep(cache, upper, LITTLE, proof)
    again = recall(cache, upper, LITTLE)
    assert again is not None
    assert (again.predicates, again.clauses, verdicts(again)) == (
        proof.predicates,
        proof.clauses,
        verdicts(proof),
    )
    other = upper.of(replace(upper.program, properties=upper.program.properties[1:]))
    assert recall(cache, other, LITTLE) is None


def test_features_that_come_later_come_last(upper: TransitionSystem) -> None:
    """Clauses name predicates by their position."""
    for ts in (
        upper,
        alone(f"{GRIP}property p : was done implies was touching or grasps = was grasps\n"),
    ):
        few, more = (chosen(ts, closely) for closely in (0, CLOSELY))
        assert few == more[: len(few)]
        assert len({predicate.name for predicate in more}) == len(more)
    assert len(more) > len(few) > 1  # what a procedure decides by, behind what the property speaks of
    without = upper.of(replace(upper.program, properties=()))
    assert "old_command" in {predicate.name for predicate in chosen(upper)} - {
        predicate.name for predicate in chosen(without)
    }


def chosen(ts: TransitionSystem, closely: int = 0) -> tuple[Predicate, ...]:
    start = ts.cycle(ts.havoc())
    return every_predicate(ts, start, read(start, obligations(ts, start)), closely)


# --- invariants ---------------------------------------------------------------------------------


def test_an_invariant_that_a_restart_breaks_is_told_by_check_and_shown(tmp_path: Path) -> None:
    """No order that the lower level takes fails; but it begins anew with a failure, as `run.adopt` says, and says so from then on."""
    ts = with_properties(
        tmp_path,
        "lower",
        "invariant never_fails : status_report /= failed\ninvariant under_way : cur_state /= f_state implies status_report /= failed\n",
    )
    assert [
        finding.message
        for finding in prove_program(ts.program, Options()).findings
        if finding.severity is Severity.ERROR
    ] == [
        "line `f` of table `go` can break invariant `never_fails`",
        "the values after a restart do not satisfy invariant `never_fails`",
    ]
    assert verdicts(prove_level(ts, LITTLE)) == {"never_fails": False, "under_way": True}
    obligation = stated(ts)["never_fails"]
    assert shortest(ts, obligation) is None
    [trace] = traces(ts, [obligation], TraceSearch(most=2, restarted=True)).values()
    assert isinstance(trace, Trace)
    assert (len(trace.steps), trace.restarted) == (1, True)
    assert "invariant `never_fails` does not hold" in "\n".join(
        time_line({"lower": ts}, of_trace(ts, obligation, trace))
    )


# --- the command ----------------------------------------------------------------------------------


def test_prove_shows_what_breaks_as_the_executors_ran_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with_properties(
        tmp_path, "upper", "property goes_on : to_lower.input_command = go then to_lower.input_command = go\n"
    )
    system, cases = str(tmp_path / "system.toml"), tmp_path / "cases"
    (tmp_path / "rcsc.toml").write_text('name = "small"\n', encoding="utf-8")  # whose cases are its own
    asked = ["prove", system, "--level", "upper", "--no-cache", "--trace", "3", "--freeze", str(cases)]
    assert run(asked) == 1
    said = capsys.readouterr()
    assert re.search(r"property +goes_on +not proved", said.out)
    assert "refuted: property `goes_on`" in said.err
    assert "it says: to_lower.input_command = go then to_lower.input_command = go" in said.err
    alone = (
        "broken in cycle 2 of level `upper` alone, as the interpreter, the Python and the C executors run it"
    )
    assert alone in said.err
    assert "supposed, and not shown of the system: `lower` gives such `lower`" in said.err
    [case] = cases.iterdir()
    assert run(["prove", "--case", str(case)]) == 1
    edit_file(tmp_path / "upper.rcs", ("go then to", "go then was to"))
    assert run(["prove", "--case", str(case)]) == 0
    edit_file(tmp_path / "upper.rcs", ("property goes_on", "property other"))
    assert run(["prove", "--case", str(case)]) == 1
    assert "has no goal `property `goes_on``" in capsys.readouterr().err


# --- the shipped levels ---------------------------------------------------------------------------


def test_no_walk_of_the_shipped_levels_breaks_what_they_state() -> None:
    made = transition_systems(SHIPPED)
    for level in ("task", "emove", "primitive"):
        ts = made[level]
        names = [claim.name for claim in ts.program.properties]
        assert len(names) >= 4
        spoken: set[Value] = set()
        for seed in (40, 41):
            walk = Walk(ts, Random(seed))  # noqa: S311  # repeatable on purpose
            before: dict[str, Value] = dict(initial(ts.program))
            for after in walk.states(60):
                assert [name for name in names if not property_kept(ts, name, before, after)] == []
                assert ts.links.above is not None
                spoken.add(after[f"{ts.links.above.report}.status_report"])
                before = after
        assert len(spoken) == 3  # the walks saw it done, executing and failed


# --- a finding of the shipped tables -------------------------------------------------------


def test_a_grasp_that_failed_is_not_done_after_all() -> None:
    """IMMED-GRASP: the hand, done, measures too wide a part, and then, before PAUSE is echoed, another width that would fit."""
    ts = transition_systems(REPO / "tables" / "system.toml")["primitive"]
    start = initial(ts.program)
    taken = {str(v.name): start[str(v.name)] for v in ts.program.variables if v.kind is Kind.INPUT}

    def member(leaf: str, name: str) -> int:
        kind = ts.kinds[leaf]
        assert isinstance(kind, Enum)
        return kind.members.index(name)

    command = {
        "emove.inc_command": 1, "emove.input_command": member("emove.input_command", "immed_grasp"),
        "fingers.known": True, "fingers.grip_mm": 20.0, "fingers.tolerance_mm": 5.0, "from_gripper.opening_mm": 30.0,
    }  # fmt: skip
    grasped = {
        "from_gripper.inc_command_echo": 1, "from_gripper.ref_command_echo": member("from_gripper.ref_command_echo", "grasp"),
        "from_gripper.status_report": member("from_gripper.status_report", "done"),
    }  # fmt: skip
    paused = {
        "from_gripper.inc_command_echo": 2, "from_gripper.ref_command_echo": member("from_gripper.ref_command_echo", "pause"),
    }  # fmt: skip
    inputs = []
    for new in (command, grasped, {"from_gripper.opening_mm": 24.0}, paused, {}):
        taken = {**taken, **new}
        inputs.append(taken)
    status = "to_emove.status_report"
    said = [step.after[status] for step in ran(ts, start, inputs)]
    assert said == [member(status, one) for one in ("executing", "failed", "failed", "failed", "failed")]


# --- the shipped properties have teeth -------------------------------------------------------

FAULTS: dict[str, tuple[str, str, str, str]] = {
    # level, property, what stands in its table, with single blanks, and what would break it
    "what failed is done": (
        "gripper", "failed_stays",
        "| 6 | false | f_state | | || | hold | failed |", "| 6 | false | f_state | | || | hold | done |",
    ),
    "the force is another": ("gripper", "keeps_its_force", "to_hand.force_n :=", "//"),
    "PAUSE drives": (
        "gripper", "rests_when_told",
        "| 1 | true || state(d_state) | hold |", "| 1 | true || state(d_state) | |",
    ),
    "another flash": ("vision", "one_flash", "|| wait | |", "|| wait | shoot(flood) |"),
    "what was seen changes": (
        "vision", "keeps_what_it_saw",
        "| 6 | false | d_state | | | || |", "| 6 | false | d_state | | | || found |",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_where_a_shipped_table_breaks_a_property_it_is_not_proved(fault: str, tmp_path: Path) -> None:
    level, name, old, new = FAULTS[fault]
    shutil.copytree(
        SHIPPED.parent, tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".rcsc-cache")
    )
    path = next(tmp_path.rglob(f"{level}.rcs"))
    text = re.sub(" +", " ", one_row_a_line(path))  # whatever the widths of the columns
    lines = [line for line in text.split("\n") if new != "//" or not line.strip().startswith(old)]
    path.write_text("\n".join(lines).replace(old, new), encoding="utf-8")
    assert path.read_text(encoding="utf-8") != text
    proof = prove_level(transition_systems(tmp_path / "system.toml")[level], replace(LITTLE, looks=False))
    assert proof.verdict(Sort.PROPERTY, "", name) is Verdict.NOT_PROVED
    assert any(
        verdict is Verdict.PROVED
        for obligation, verdict in proof.verdicts
        if obligation.sort is Sort.PROPERTY
    )
