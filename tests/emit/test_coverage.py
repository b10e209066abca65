"""Vectors of the whole C: they pass on the C, notice what is planted in it, and say truly what nothing reaches."""

import csv
import io
import json
import platform
import re
import subprocess
from itertools import combinations, product
from pathlib import Path
from random import Random

import pytest

from rcsc.base.host.tools import c_compiler, write_c
from rcsc.code.emit import emitted as emitted_of
from rcsc.code.emit.lower import lower
from rcsc.code.emit.plan import Plan
from rcsc.code.testing.code_mutants import CodeMutant, code_mutants, variants
from rcsc.code.testing.coverage import directed
from rcsc.code.testing.coverage.case import MODES, Case, Entry, entries, expected
from rcsc.code.testing.coverage.choose import Choice, chosen, taken
from rcsc.code.testing.coverage.document import (
    VectorSet,
    as_json,
    sessions_csv,
    sessions_document,
    vectors_csv,
    vectors_document,
)
from rcsc.code.testing.coverage.goals import Reached, decides, decides_masked
from rcsc.code.testing.coverage.harness import vectors_c
from rcsc.code.testing.coverage.marks import Outcomes, marked, ways_of
from rcsc.code.testing.coverage.vector_set import vector_set, write_vectors
from rcsc.code.testing.executors.symbols import symbols_of
from rcsc.code.testing.inputs.snapshot import search_in
from rcsc.code.testing.inputs.vectors import vectors_of
from rcsc.driver.trials import proofs
from rcsc.front.commands import run
from rcsc.lang.model import Program, ProvedProgram, Value, seal_of_proof
from rcsc.proof.solvers.options import Options
from tests.evidence.subjects import EVERYTHING, subject_of
from tests.support.programs.examples import EXTERN, LASTING, STOPS
from tests.support.programs.stages import emitted, program_of, proved_of
from tests.support.programs.texts import edited

SMALL = """
enum mode { idle, run, stop }
input wanted : mode
input go : bool
input parts : int 0 .. 3
state held : int 0 .. 2
state warm : bool
output lamp : bool
invariant cold : held = 0 implies not warm

assume quiet monitored : go or parts < 3

procedure count {
  if held < 2 and (go or parts = 3) { held := held + 1; warm := true }
}
procedure glow { if warm and held = 0 { lamp := true } else { lamp := wanted in {run, stop} and go } }

table t assuming quiet {
  | line | wanted  || procedures  |
  | on   | = run   || count; glow |
  | off  | DEFAULT || glow        |
}
level l {
  period 10 [ms]
  table t
}
"""
"""Small enough that every state with every input is tried; `glow` has a condition that the invariant excludes."""


def plan_of(text: str) -> Plan:
    return lower(ProvedProgram(proved_of(text), seal_of_proof()))


def set_of(text: str, sessions: int = 30) -> VectorSet:
    plan = plan_of(text)
    return vector_set(plan, emitted_of(plan), Options(), None, lambda _: None, sessions)


def played(folder: Path, document: VectorSet, *edits: tuple[str, str]) -> tuple[int, str]:
    """Status and words of the program that plays the vectors on the C, which is edited first."""
    compiler = c_compiler()
    assert isinstance(compiler, str)
    for path, text in emitted(document.program).items():
        if path.endswith((".c", ".h")):
            own = Path(path).name == document.symbols.source
            (folder / Path(path).name).write_text(edited(text, *edits) if own else text, "utf-8")
    (folder / "vectors.c").write_text(vectors_c(document.program, document.symbols, document.kept), "utf-8")
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1"]
    files = ["vectors.c", document.symbols.source]
    subprocess.run([compiler, *strict, "-o", "play", *files], cwd=folder, check=True)
    ran = subprocess.run(["./play"], cwd=folder, capture_output=True, text=True, check=False)
    return ran.returncode, ran.stdout


@pytest.mark.parametrize("text", [SMALL, STOPS, LASTING, EXTERN])
def test_the_c_gives_what_every_vector_says(text: str, tmp_path: Path) -> None:
    document = set_of(text)
    status, told = played(tmp_path, document)
    assert (status, told) == (0, f"{len(document.kept)} vectors, 0 wrong\n")
    assert {kept.case.entry for kept in document.kept} == set(entries(document.program))


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("s->held < 2u", "s->held < 1u"),
        ("s->go || (s->parts == 3u)", "s->go || (s->parts != 9u)"),
        ("(s->parts > 3u)", "(s->parts > 9u)"),
        ("return s->go || (s->parts < 3u)", "return s->go || (s->parts < 4u)"),
        ("(s->held > 2u)", "(s->held > 3u)"),
        ("_COLD;", "_COLD - 1;"),
        ("s->held = 0u;", "s->held = 1u;"),
    ],
)
def test_a_slip_in_the_c_fails_a_vector(right: str, wrong: str, tmp_path: Path) -> None:
    status, told = played(tmp_path, set_of(SMALL), (right, wrong))
    assert status == 1
    assert "wrong" in told


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("_do_look_up(s, 3u)", "_do_look_up(s, 4u)"),
        ("parts_height(s->part,", "parts_height(0u,"),
        ("(int64_t)v_times,", "-(int64_t)v_times,"),
        ("w1 < -7", "w1 < -8"),
    ],
)
def test_what_an_extern_function_is_given_is_compared(right: str, wrong: str, tmp_path: Path) -> None:
    status, told = played(tmp_path, set_of(EXTERN), (right, wrong))
    assert status == 1
    assert "wrong" in told


STATEMENT = re.compile(r"^ +((?:s->\w|probe_)[^\n{}]*;)$", re.MULTILINE)
EQUAL = (
    "(b < a)", "(a >= least)", "(a <= most)", "s->width > 100u", "several ? (-2)", " t0[", " t1[", "+ 0.0", "_settle(s);", "_atleast_",
    "(m == 0x0u)", "/* proved", "assumptions_failed |",
)  # fmt: skip
"""Lines where a slip gives the same: of two that are equal either is the lesser; a table that is too long; nothing to settle."""
NO_PLACE = "int32_t at = -2;"
"""What is slipped to where a slip gives the same: any number below 0 is no place."""


def _line(text: str, at: int) -> str:
    return text[: text.find("\n", at)].rpartition("\n")[2]


def slips(text: str, count: int) -> list[tuple[str, str]]:
    """C with one slip, and the line that has it: changed masks, constants and operators, and lost statements."""
    random = Random(text)  # noqa: S311  # repeatable
    own = text.index("/* probe.rcs procedure")
    lost = (
        CodeMutant("statement", "", text, found.start(1), found[1], ";")
        for found in STATEMENT.finditer(text, own)
    )
    changed = [m for m in code_mutants(text, 2) if m.start > own and m.base == variants(text)[0]]
    every = [*random.sample(changed, count), *random.sample(list(lost), count)]
    every = [m for m in every if NO_PLACE not in _line(m.text, m.start)]
    lines = ((m.text, _line(m.base, m.start)) for m in every)
    return [(slipped, line) for slipped, line in lines if not any(word in line for word in EQUAL)]


def test_slips_of_every_kind_fail_a_vector(tmp_path: Path) -> None:
    """What passes is in lines that nothing leads to: a table of which several lines match, or none."""
    subject = subject_of(EVERYTHING)
    solver = proofs(subject.options).solver
    document = vector_set(subject.plan, subject.files, subject.options, solver, subject.progress)
    write_c(subject.files, tmp_path)
    (tmp_path / "vectors.c").write_text(vectors_c(document.program, document.symbols, document.kept), "utf-8")
    compiler = [str(c_compiler()), "-std=gnu11", "-w", "-O0"]
    subprocess.run([*compiler, "-c", "vectors.c"], cwd=tmp_path, check=True)
    passed = []
    for text, line in slips(subject.files["c/probe.c"], 20):
        (tmp_path / "slip.c").write_text(text, "utf-8")
        built = subprocess.run([*compiler, "-o", "play", "slip.c", "vectors.o"], cwd=tmp_path, check=False)
        ran = (
            built.returncode
            or subprocess.run(
                ["./play"], cwd=tmp_path, stdout=subprocess.DEVNULL, timeout=20, check=False
            ).returncode
        )
        passed += [] if ran else [line]
    never = subject.files["c/probe.c"].partition("    default:\n")[2].partition("break;")[0]
    assert [line for line in passed if line.strip() not in never] == []


WHOLE = (Entry("check"), Entry("step", "t"), Entry("cycle", "l"))


def every_case(program: Program) -> list[Case]:
    """Every state within its ranges with every admitted input, for `check` and each step and cycle."""
    kinds = {"wanted": range(3), "go": (False, True), "parts": range(4), "held": range(3)}
    kinds |= {"warm": (False, True), "lamp": (False, True)}
    states: list[dict[str, Value]] = [
        dict(zip(kinds, values, strict=True)) for values in product(*kinds.values())
    ]
    assert list(kinds) == [str(v.name) for v in program.variables]
    return [Case(entry, state) for entry in WHOLE for state in states]


def test_what_is_said_to_be_out_of_reach_is_and_all_else_is_reached() -> None:
    """Against all 432 cases: no decision can go a way that the vectors leave out, but for ways that show nothing more."""
    document = set_of(SMALL)
    program, plan = document.program, plan_of(SMALL)
    whole, kept = (Reached(program, plan, marked(program)) for _ in range(2))
    for case in every_case(program):
        right = expected(program, case)
        if right is not None:
            whole.keep(whole.of(case, right))
    for each in document.kept:
        kept.keep(each.hits)
    for at, decision in enumerate(whole.marked.decisions):
        for number, _ in enumerate(decision.conditions):
            able, done = whole.ways.get(at, {}), kept.ways.get(at, {})
            for truth in (True, False):
                possible = any(outcomes[number] is truth for outcomes, _ in able)
                assert possible is any(outcomes[number] is truth for outcomes, _ in done)
                assert possible is not any(
                    u.key == ("decision", at, number, truth) for u in document.unreached
                )
            if len(decision.conditions) > 1:
                possible = decides(able, number)
                assert possible is decides(done, number)
                assert possible is not any(
                    u.key == ("decision", at, number, None) for u in document.unreached
                )
    places = {(u.where, u.what) for u in document.unreached if u.key[0] == "decision"}
    assert places == {("procedure glow", "warm"), ("procedure glow", "held = 0")}  # neither decides
    assert all(unreached.shown for unreached in document.unreached)


def test_no_vector_can_be_spared() -> None:
    document = set_of(SMALL)
    for left_out in document.kept:
        rest = {hit for kept in document.kept if kept is not left_out for hit in kept.hits}
        assert not left_out.hits <= rest


def test_a_line_that_only_a_failing_assumption_leaves_without_an_answer_is_run() -> None:
    """Without DEFAULT the table rests on an assumption that only tells: where it fails, no line matches."""
    text = edited(SMALL, ("  | off  | DEFAULT || glow        |", "  | off  | = idle  || glow        |"))
    text = edited(text, ("go or parts < 3", "wanted /= stop"))
    document = set_of(text)
    ended = [kept for kept in document.kept if kept.expected.result == 2]
    assert {kept.case.entry.kind for kept in ended} == {"step", "cycle"}
    assert all(kept.case.before["wanted"] == 2 for kept in ended)
    keys = {unreached.key for unreached in document.unreached}
    assert ("matched", "t", -2) in keys
    assert ("matched", "t", -1) not in keys


def test_where_the_solver_may_do_nothing_it_is_said() -> None:
    plan = plan_of(SMALL)
    files = emitted_of(plan)
    document = vector_set(plan, files, Options(steps=1), None, lambda _: None, 1)
    assert any(not unreached.shown and "no answer" in unreached.reason for unreached in document.unreached)


def test_a_machine_that_rounds_otherwise_is_refused(tmp_path: Path) -> None:
    document = set_of(STOPS)
    odd = [kept for kept in document.kept if kept.case.mode]
    assert [kept.case.mode for kept in odd] == list(MODES)
    assert {kept.expected.result for kept in odd} == {7}
    if platform.machine() in ("x86_64", "aarch64"):  # others do not play these
        status, told = played(tmp_path, document, ("return exact;", "return true;"))
        assert (status, told.count("wrong result")) == (1, len(MODES))
    assert not any(kept.case.mode for kept in set_of(SMALL).kept)


def test_what_a_machine_cannot_be_made_to_play_is_no_pass(tmp_path: Path) -> None:
    document = set_of(STOPS)
    assert played(tmp_path, document) == (0, f"{len(document.kept)} vectors, 0 wrong\n")
    other = ["-std=gnu11", "-w", "-U__SSE2_MATH__", "-U__aarch64__", "-o", "other"]
    files = ["vectors.c", document.symbols.source]
    subprocess.run([str(c_compiler()), *other, *files], cwd=tmp_path, check=True)
    ran = subprocess.run(["./other"], cwd=tmp_path, capture_output=True, text=True, check=True)
    left = len(MODES)
    told = f"{len(document.kept) - left} vectors, 0 wrong, {left} not played: this machine does not round as they ask\n"
    assert ran.stdout == told


COUPLED = """
input a : bool
input b : bool
input c : bool
input d : bool
output o : bool
procedure p { if (a or b) and (c or d) { o := true } else { o := false } }
table t {
  | line | a       || procedures |
  | all  | DEFAULT || p          |
}
"""


def test_masking_shows_what_a_unique_cause_shows_and_more() -> None:
    [decision] = [d for d in marked(program_of(COUPLED)).decisions if len(d.conditions) == 4]
    assert decision.form is not None
    every = ways_of(decision.form)
    apart: dict[tuple[Outcomes, bool], None] = {
        ((True, None, True, None), True): None,
        ((False, True, False, False), False): None,
    }
    assert set(apart) < set(every)
    assert (decides(apart, 2), decides_masked(apart, every, 2)) == (False, True)
    assert not decides_masked(apart, every, 3)
    for pair in combinations(every, 2):
        ways = dict.fromkeys(pair)
        assert all(decides_masked(ways, every, at) for at in range(4) if decides(ways, at))


def test_the_ways_of_a_decision_are_those_of_short_circuits() -> None:
    whole = marked(program_of(SMALL))
    joint = next(d for d in whole.decisions if d.place.name == "count" and len(d.conditions) == 3)
    assert joint.conditions == ("held < 2", "go", "parts = 3")
    assert joint.form is not None
    assert set(ways_of(joint.form)) == {
        ((False, None, None), False),
        ((True, True, None), True),
        ((True, False, True), True),
        ((True, False, False), False),
    }
    implied = next(d for d in whole.decisions if d.place.kind == "invariant")
    assert implied.form is not None
    assert set(ways_of(implied.form)) == {
        ((False, None), True),
        ((True, False), True),
        ((True, True), False),
    }
    assert implied.negated == {0, 1}


def test_json_and_csv_say_the_same() -> None:
    document = set_of(SMALL)
    parsed = json.loads(as_json([vectors_document(document)]))
    rows = list(csv.DictReader(io.StringIO(vectors_csv(document))))
    assert len(rows) == len(parsed["vectors"]) == len(document.kept)
    for row, vector in zip(rows, parsed["vectors"], strict=True):
        assert row["function"] == vector["function"]
        assert int(row["result"]) == vector["expected"]["result"]
        before = vector["inputs"] | vector["state"]
        after = before | vector["expected"].get("changes", {})
        for name, value in before.items():
            assert row[name] == (str(value).lower() if isinstance(value, bool) else str(value))
        for name, value in after.items():
            assert row[f"after {name}"] == (str(value).lower() if isinstance(value, bool) else str(value))
    assert parsed["tables"][0]["vectors"]
    assert [each["what"] for each in parsed["unreached"]].count("held = 0") == 2


STAGES = (Path(__file__).parents[2] / "tables/gallery/lm_fsm/fsm.rcs").read_text("utf-8")


@pytest.mark.parametrize("text", [SMALL, STOPS, STAGES])
def test_every_vector_of_a_table_is_one_of_the_whole_c_and_what_takes_a_line_is_told(text: str) -> None:
    document = set_of(text)
    parsed = json.loads(as_json([vectors_document(document)]))
    numbered = {vector["number"]: vector for vector in parsed["vectors"]}
    for table in parsed["tables"]:
        for pair in table["vectors"]:
            vector = numbered[pair["number"]]
            assert (vector["kind"], vector["of"]) == ("line", table["table"])
            assert {**vector["inputs"], **vector["state"]} == pair["inputs"]
            wanted = {name: pair[name] for name in ("line", "column", "condition", "purpose")}
            assert wanted in vector["shows"]
            lines = [f"{table['table']} line {pair['expected']}"] if pair["expected"] else None
            assert vector.get("takes") == lines
    for vector in numbered.values():
        named = vector["expected"].get("line_name")
        assert named is None or vector["takes"] == [f"{vector['of']} line {named}"]
    if text == STAGES:
        all_lines_of_a_cycle_are_told(document)


def all_lines_of_a_cycle_are_told(document: VectorSet) -> None:
    """Of every table that ran, and not the last alone."""
    ran = [
        [table for table, _ in lines]
        for kept, lines in zip(document.kept, taken(document.program, document.kept), strict=True)
        if kept.case.entry.kind == "cycle" and kept.expected.line >= 0
    ]
    [level] = document.program.levels
    assert ran
    assert all(len(tables) == len(level.choices) > 1 for tables in ran)


def test_sessions_carry_their_state_from_cycle_to_cycle() -> None:
    document = set_of(LASTING)
    parsed = json.loads(as_json([sessions_document(document)]))
    rows = list(csv.DictReader(io.StringIO(sessions_csv(document))))
    assert len(rows) == sum(len(session["cycles"]) for session in parsed["sessions"]) > len(document.sessions)
    number = 0
    for session in parsed["sessions"]:
        state = session["start"]
        for cycle in session["cycles"]:
            state |= cycle["inputs"]
            assert {name: rows[number][name] for name in state} == {
                name: str(value).lower() if isinstance(value, bool) else str(value)
                for name, value in state.items()
            }
            state |= cycle["expected"]["changes"]
            number += 1


def test_drawing_is_the_same_every_time() -> None:
    program = program_of(SMALL)
    plan = plan_of(SMALL)

    def once() -> Choice:
        tables = [vectors_of(search_in(program), table) for table in program.tables]
        symbols = symbols_of(program, emitted(program))
        return chosen(search_in(program), plan, symbols, tables, 5, lambda _: None)

    first, second = once(), once()
    assert [kept.case.before for kept in first.kept] == [kept.case.before for kept in second.kept]


def test_the_command_writes_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.rcs").write_text(SMALL, encoding="utf-8")
    quick = ["test", "--examples", "5", "--mutants", "0", "--no-cortex", "a.rcs"]
    assert run([*quick, "--vectors", "v.c", "--sessions", "s.csv"]) == 0
    assert "vectors of the whole C" in capsys.readouterr().out
    assert "vectors_play" in Path("v.c").read_text(encoding="utf-8")
    assert Path("s.csv").read_text(encoding="utf-8").startswith("session,cycle,function,")


def test_a_file_that_holds_one_program_is_refused_for_two(tmp_path: Path) -> None:
    document = set_of(SMALL)
    for name in ("v.c", "v.csv"):
        [finding] = write_vectors([document, document], tmp_path / name, None)
        assert "vectors of one program, and there are 2" in finding.message
        assert not (tmp_path / name).exists()
    assert list(write_vectors([document, document], tmp_path / "v.json", None)) == []
    assert len(json.loads((tmp_path / "v.json").read_text("utf-8"))) == 2
    [finding] = write_vectors([document], None, tmp_path / "no" / "s.json")
    assert "cannot be written" in finding.message


def test_answers_of_extern_procedures_are_told_by_leaf() -> None:
    document = set_of(EXTERN)
    vectors = json.loads(as_json([vectors_document(document)]), parse_constant=pytest.fail)["vectors"]
    answers = [answer for vector in vectors for answer in vector.get("answers", ())]
    assert {tuple(answer["values"]) for answer in answers} == {("height", "kind", "pull")}
    given = [answer["values"]["pull"] for answer in answers]
    assert "nan" in given
    assert any(isinstance(value, float) and value > 1.0 for value in given)


def test_where_a_decision_can_go_too_many_ways_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(directed, "MOST_QUESTIONS", 0)
    document = set_of(SMALL, 1)
    left = [unreached for unreached in document.unreached if unreached.key[0] == "decision"]
    assert left
    assert {(unreached.shown, unreached.reason) for unreached in left} == {(False, directed.MANY)}
