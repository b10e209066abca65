"""State graphs, both ways: what is drawn is what the tables do, and what is read back is proved to do the same."""

import itertools
import random
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.source import Source
from rcsc.front.commands import run as rcsc
from rcsc.front.commands.group import commands
from rcsc.front.commands.shared.graphs import WrongError, found_tables
from rcsc.lang.interpret import cycle, holds, initial, run_table
from rcsc.lang.model import Enum, Program, Snapshot, Table, Value, key_bounds, value_of_key
from rcsc.lang.project import load
from rcsc.proof.relation.effect import Meaning, Shared
from rcsc.proof.relation.follow import following
from rcsc.proof.relation.questions import Independent
from rcsc.proof.relation.same import Differs, Same, compare
from rcsc.proof.relation.steps import Steps
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.views.graph.derive import Derived, derive, derive_lines
from rcsc.views.graph.drawing import svg
from rcsc.views.graph.find import FoundTable, NotFound, tables
from rcsc.views.graph.formats.choice import FORMS, form_of
from rcsc.views.graph.formats.reading import UnreadableError, diagnosed
from rcsc.views.graph.formats.state_graph import ANY, StateGraph
from rcsc.views.graph.labels import plain
from rcsc.views.graph.round_trip import Against, against, in_place
from rcsc.views.graph.to_table import tabled
from tests.support.programs.stages import program_of
from tests.support.programs.texts import edit_file, edited

ROOT = Path(__file__).parents[2]
OPTIONS = Options()
EVERY_FORM = sorted(FORMS)


@pytest.fixture(scope="module")
def shipped() -> dict[str, FoundTable]:
    """Every table of the system, by program and name."""
    found = tables(str(ROOT / "tables"))
    assert not isinstance(found, NotFound)
    return {
        f"{entry.program.name}.{entry.table.name}": entry
        for entry in found
        if not {"examples", "gallery"} & set(Path(entry.table.file).parts)
    }


KEPT: dict[tuple[int, str], tuple[FoundTable, Derived]] = {}
"""Graphs already derived, by the identity of what was found, which is kept too."""


def graph_of(entry: FoundTable, state: str = "") -> Derived:
    if (id(entry), state) not in KEPT:
        made = derive(entry.program, entry.table, entry.loaded.files[entry.table.file], OPTIONS, state)
        assert isinstance(made, Derived), made
        KEPT[id(entry), state] = entry, made
    return KEPT[id(entry), state][1]


def said(entry: FoundTable, text: str, form: str) -> Against:
    """The verdict on the table that the graph's text says."""
    table = tabled(FORMS[form].read(text))
    return against(entry.loaded, entry.root, entry.program, entry.table, table, OPTIONS)


def questions_from_now(monkeypatch: pytest.MonkeyPatch) -> list[Solver]:
    """Return a list to which each question adds the solver that it is put to."""
    asked: list[Solver] = []
    check = Solver.check

    def noted(solver: Solver, *terms: Term) -> Answer:
        asked.append(solver)
        return check(solver, *terms)

    monkeypatch.setattr(Solver, "check", noted)
    return asked


def test_the_states_are_asked_for_once_however_many_edges_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forty states, and lines that leave each of them: 200 edges, for each of which 40 questions were asked."""
    members = ", ".join(f"m{at}" for at in range(40))
    rows = "".join(f"| n{at} | {at} | not in {{m{at}}} || m{at} |\n" for at in range(5))
    declared = f"enum e {{ {members} }}\ninput a : int 0 .. 5\nstate s : e\n"
    text = f"{declared}table t {{\n| line | a | s || s |\n{rows}| rest | DEFAULT | || s |\n}}\n"
    asked = questions_from_now(monkeypatch)
    drawn = graph_of(found_in(text, tmp_path), "s").graph
    assert len(drawn.edges) > 190
    assert len(asked) < 40 + 6 * 40 * 2 + 2 * len(drawn.edges)


def test_what_does_not_look_at_the_state_is_asked_for_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forty states, and lines of which most cells look at other variables."""
    members = ", ".join(f"m{at}" for at in range(40))
    declared = f"enum e {{ {members} }}\ninput a : int 0 .. 9\ninput b : int 0 .. 9\nstate s : e\n"
    rows = "| n0 | > 3 | > 4 | < 8 | not in {m0} || 1 |\n| n1 | > 3 | < 3 | > 1 | /= m3 || 2 |\n"
    text = f"{declared}output o : int 0 .. 2\ntable t {{\n| line | a | b | b | s || o |\n{rows}}}\n"
    entry = found_in(text, tmp_path)
    steps = Steps(entry.program, entry.table, entry.program.variable("s"), OPTIONS)
    states = steps.states()
    asked = questions_from_now(monkeypatch)
    needed = {steps.needed(line, state) for line in (0, 1) for state in states[4:]}
    assert needed == {(0, 1, 2)}
    assert len(asked) <= 36 * 4 + 8  # of a state its own cell alone, and each other cell once


@pytest.mark.parametrize("form", [*EVERY_FORM, "svg"])
def test_a_table_whose_lines_match_nothing_has_an_empty_graph_and_is_told_so(
    tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "case.rcs"
    rows = "| n0 | > 3 | < 3 || m0 |\n| n1 | 1 | 2 || m1 |\n"
    file.write_text(
        f"enum e {{ m0, m1 }}\ninput a : int 0 .. 5\nstate s : e\ntable t {{\n| line | a | a || s |\n{rows}}}\n"
    )
    assert rcsc(["graph", f"{file}:t", "--state", "s", "--form", form]) == 0
    told = capsys.readouterr().err
    assert told.count("matches nothing") == (0 if form == "svg" else 2)
    assert ("no table is read back from an empty graph" in told) == (form != "svg")


def of_name(file: str, name: str) -> list[FoundTable]:
    made = tables(f"{file}:{name}" if name else file)
    assert not isinstance(made, NotFound), made
    return made


def found_in(text: str, tmp_path: Path, name: str = "") -> FoundTable:
    file = tmp_path / "case.rcs"
    file.write_text(text, encoding="utf-8")
    return of_name(str(file), name)[0]


# --- the shipped tables --------------------------------------------------------------------


def test_every_table_of_the_system_comes_back_from_every_form_and_is_proved_the_same(
    shipped: dict[str, FoundTable],
) -> None:
    assert len(shipped) == 24
    for name, entry in shipped.items():
        made = graph_of(entry)
        texts = {tabled(FORMS[form].read(FORMS[form].write(made.graph))).text() for form in EVERY_FORM}
        assert len(texts) == 1, name  # the forms hold the same, so that one proof is enough
        verdict = said(entry, FORMS["dot"].write(made.graph), "dot")
        assert verdict.diagnostics == (), name


def test_a_name_of_several_tables_means_that_of_the_system_here(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    several = tables("acquire")
    assert isinstance(several, NotFound)
    assert "`tables/task/acquire.rcs:acquire`" in several.diagnostics[0].help[0]
    [meant] = found_tables("acquire")
    assert Path(meant.table.file) == Path("tables/task/acquire.rcs")
    said = capsys.readouterr().err
    assert said.startswith("note: `acquire` is `tables/task/acquire.rcs:acquire`;")
    assert said.count(".rcs:acquire`") == len(meant.others) + 1 > 2
    for alone in ("tables/task/acquire.rcs:acquire", "goto"):
        assert found_tables(alone)
        assert not capsys.readouterr().err
    monkeypatch.setattr(
        "rcsc.front.commands.shared.systems.PLACES", ("tables/examples/later/last_echo.toml",)
    )
    with pytest.raises(WrongError):
        found_tables("acquire")  # of a system that has no such table


def test_the_graph_of_acquire_is_fig_10(shipped: dict[str, FoundTable]) -> None:
    made = graph_of(shipped["task.acquire"])
    assert [(edge.line, edge.source, edge.target) for edge in made.graph.edges] == [
        ("0", ANY, ANY),
        ("1", ANY, "state_4"),
        ("2", ANY, "f_state"),
        ("3", ANY, "f_state"),
        ("4", ANY, "state_2"),
        ("5", "state_4", "f_state"),
        ("5", "state_4", "state_5"),
        ("6", "state_2", "state_3"),
        ("7", "state_3", "f_state"),
        ("7", "state_3", "state_5"),
        ("8", "state_5", "d_state"),
        ("9", "d_state", "d_state"),
        ("10", "state_2", "f_state"),
        ("11", "state_4", "f_state"),
        ("12", "state_3", "f_state"),
        ("13", "state_5", "f_state"),
        ("14", "f_state", "f_state"),
        *(("15", state, state) for state in ("state_2", "state_3", "state_4", "state_5")),
        ("16", ANY, "f_state"),
    ]
    by_procedure = {(edge.line, edge.target): edge.decided for edge in made.graph.edges if edge.decided}
    ends = [
        (line, state) for line in "57" for state in ("f_state", "state_5")
    ]  # the first where the buffer is empty
    assert by_procedure == dict.fromkeys(ends, "pickup(state_5)")
    assert made.everywhere == "new_command = false"
    shown = {edge.line: edge.shown for edge in made.graph.edges}
    assert shown["5"] == "emove.status = done"  # the command echoed follows from the state
    assert shown["9"] == ""
    assert any("line `10`: `/= f_state`" in one for one in made.lost)


def test_the_published_acquire_leaves_its_state_past_the_deferral() -> None:
    one = tables(str(ROOT / "tables/examples/acquire_published.rcs"))
    assert not isinstance(one, NotFound)
    edges = {(edge.line, edge.source, edge.target, edge.decided) for edge in graph_of(one[0]).graph.edges}
    assert (
        "5",
        "state_4",
        "f_state",
        "pickup",
    ) in edges  # `cur_state` is written at once, while state_5 is pending
    assert ("5", "state_4", "state_5", "") in edges


BREAKS = [
    (
        "a guard",
        "emove.command = locate and emove.status = done",
        "emove.command = locate and emove.status = failed",
    ),
    ("an effect", "command_out(locate)", "command_out(move_to)"),
    ("a procedure", "procedures(vupos_setup)", "procedures(set_source)"),
    ("a state", "state_5", "state_8"),
]


@pytest.mark.parametrize(
    ("old", "new"), [(old, new) for _, old, new in BREAKS], ids=[what for what, *_ in BREAKS]
)
def test_a_broken_graph_is_refuted_by_an_input(shipped: dict[str, FoundTable], old: str, new: str) -> None:
    entry = shipped["task.acquire"]
    text = FORMS["mermaid"].write(graph_of(entry).graph)
    assert old in text
    [found] = said(entry, text.replace(old, new), "mermaid").diagnostics
    assert found.code is Code.GRAPH_DIFFERS
    assert found.witnesses[0].variables


def test_a_dropped_edge_is_refuted(shipped: dict[str, FoundTable]) -> None:
    entry = shipped["primitive.goto"]
    lines = FORMS["mermaid"].write(graph_of(entry).graph).splitlines(keepends=True)
    at = next(at for at, line in enumerate(lines) if "robot.status = done and there = true" in line)
    [found] = said(entry, "".join(lines[:at] + lines[at + 1 :]), "mermaid").diagnostics
    assert found.code is Code.GRAPH_DIFFERS
    assert "line `6`, the graph to line `10`" in found.message  # DEFAULT takes it


@pytest.fixture(scope="module")
def assuming(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of ACQUIRE with an assumption of its own, besides those that come with the protocol."""
    folder = tmp_path_factory.mktemp("assuming")
    for name in ("rcsc.toml", "vocabulary.rcs"):
        shutil.copy(ROOT / "tables" / name, folder / name)
    shutil.copytree(ROOT / "tables/task", folder / "task")
    path = folder / "task/acquire.rcs"
    states = "cur_state in {d_state, f_state, state_2, state_3, state_4, state_5}"
    head = "\n## ACQUIRE (OBJ [at A]), level TASK.\ntable acquire {"
    own = f"\nassume acquire_states monitored : not new_command implies {states}\n"
    edit_file(path, (head, own + head.replace(" {", " assuming acquire_states {")))
    return str(path)


def test_a_table_that_rests_on_other_assumptions_is_not_the_same(assuming: str) -> None:
    [entry] = of_name(assuming, "acquire")
    assert set(entry.table.assumptions) == {"acquire_states", "acquire_in_step", "acquire_resting"}
    text = FORMS["mermaid"].write(graph_of(entry).graph)
    assert said(entry, text, "mermaid").diagnostics == ()
    [found] = said(entry, edited(text, ("assuming: acquire_states", "assuming:")), "mermaid").diagnostics
    assert (found.code, "acquire_states" in found.notes[0]) == (Code.GRAPH_DIFFERS, True)


WRITES = """
enum mode { rest, work }
input x : int 0 .. 9
state cur_state : mode
state n : int 0 .. 9
output o : int 0 .. 9
extern procedure ask writes n python "m:ask" c "m_ask"
extern procedure tell reads o python "m:tell" c "m_tell"
table m {
  | line | cur_state | x    || procedures     | o |
  |------|-----------|------||----------------|---|
  | low  | rest      | < 5  || ask; tell      | 1 |
  | high | rest      | >= 5 || cur_state := work; ask | 2 |
  | back | work      |      || cur_state := rest; tell | 3 |
}
"""

OTHERWISE = [
    ("a call that writes nothing left out", "procedures(ask, tell)", "procedures(ask)"),
    ("two calls exchanged", "procedures(ask, tell)", "procedures(tell, ask)"),
    ("a call with another value", "procedures(tell) o(3)", "procedures(o := 5, tell) o(3)"),
    ("a condition that is not defined everywhere", "x < 5", "x < 5 and 10 / x >= 0"),
    ("an action that is not defined everywhere", "o(1)", "o(1 + 0 / x)"),
    ("an action that leaves its range before another", "o(1)", "o(x + 9)"),
    ("another first state", "[*] --> rest", "[*] --> work"),
]


@pytest.mark.parametrize(
    ("old", "new"), [(old, new) for _, old, new in OTHERWISE], ids=[what for what, *_ in OTHERWISE]
)
def test_what_is_not_seen_in_the_variables_afterwards_is_a_difference_too(
    tmp_path: Path, old: str, new: str
) -> None:
    entry = found_in(WRITES, tmp_path)
    text = FORMS["mermaid"].write(graph_of(entry).graph)
    assert old in text
    assert said(entry, text, "mermaid").diagnostics == ()
    [found] = said(entry, edited(text, (old, new)), "mermaid").diagnostics
    assert found.code is Code.GRAPH_DIFFERS


# --- steps against the interpreter -----------------------------------------------------------

DOOR = """
enum place { shut, opening, open, stuck }
input button : bool
input seen : int 0 .. 3
input echo : bool
state at : place = shut deferred until echo
state tries : int 0 .. 2
output motor : int 0 .. 2
procedure go(to : place) { next at := to }
procedure try_again {
  if tries < 2 { tries := tries + 1 } else { next at := stuck; motor := 0 }
}
procedure rest { tries := 0 }
assume seen_open assumed : at = open implies seen > 0
table door assuming seen_open {
  | line | at      | button | seen   || procedures        | motor |
  |------|---------|--------|--------||-------------------|-------|
  | 1    | shut    | true   |        || go(opening)       | 1     |
  | 2    | shut    | false  |        ||                   |       |
  | 3    | opening |        | 3      || rest; go(open)    |       |
  | 4    | opening |        | < 3    || go(opening); try_again |  |
  | 5    | open    |        |        || go(open)          | 0     |
  | 6    | stuck   | true   | 0 .. 1 || next at := shut   |       |
  | 7    | DEFAULT |        |        ||                   |       |
}
level door_level { period 40 [ms] table door }
"""


def inputs(program: Program, fixed: Snapshot | None = None) -> Iterator[dict[str, Value]]:
    """Every input, those of `fixed` as they are."""
    kinds = [
        (str(v.name), range(key_bounds(v.type)[0], key_bounds(v.type)[1] + 1), v.type)
        for v in program.variables
    ]
    free = [one for one in kinds if fixed is None or one[0] not in fixed]
    for keys in itertools.product(*(keys for _, keys, _ in free)):
        values = {name: value_of_key(kind, key) for (name, _, kind), key in zip(free, keys, strict=True)}
        yield {**(fixed or {}), **values}


def admitted(program: Program, table: Table, now: Snapshot) -> bool:
    return all(holds(a.condition, now) for a in program.assumptions if a.name in table.assumptions)


def test_steps_are_those_that_the_interpreter_takes(tmp_path: Path) -> None:
    entry = found_in(DOOR, tmp_path)
    program, table = entry.program, entry.table
    expected = set()
    for now in inputs(program, {"echo": 0, "motor": 0}):
        if now["at"] == now["at.next"] and admitted(program, table, now):
            after = run_table(program, table, now)
            expected.add((after.line_index, now["at"], after.snapshot["at.next"]))
    steps = Steps(program, table, program.variable("at"), OPTIONS)
    assert {(step.line, step.source, step.target) for step in steps.steps(steps.states())} == expected
    assert len(expected) == 8


def test_lines_follow_each_other_as_the_interpreter_runs_them(tmp_path: Path) -> None:
    entry = found_in(DOOR, tmp_path)
    program, table = entry.program, entry.table
    [level] = program.levels
    expected = set()
    for now in inputs(program, {"echo": 1, "motor": 0}):
        if now["at"] != now["at.next"] or not admitted(program, table, now):
            continue
        first = cycle(program, level, now)
        for taken in inputs(
            program, {str(v.name): first.snapshot[v.name] for v in program.variables if v.kind != "input"}
        ):
            settled = dict(taken, at=taken["at.next"]) if taken["echo"] else taken
            if admitted(program, table, settled):
                expected.add((first.line_index, cycle(program, level, taken).line_index))
    assert {(pair.line, pair.then) for pair in following(program, table, OPTIONS)} == expected
    assert len(expected) > 12


def test_what_an_edge_need_not_show_follows_from_the_state(tmp_path: Path) -> None:
    entry = found_in(
        edited(DOOR, ("| 5    | open    |        |        |", "| 5    | open    |        | > 0    |")),
        tmp_path,
    )
    edges = {edge.line: edge for edge in graph_of(entry, "at").graph.edges}
    assert (edges["5"].guard, edges["5"].shown) == ("seen > 0", "")  # the assumption says it
    assert edges["3"].shown == "seen = 3"


DIVIDED = (
    "a", "not a", "b", "a or c", "b implies d", "not c", "d xor a", "n > 2", "n + m = 4", "m < n", "n /= 3", "a and n > 1", "m mod 2 = 1",
    "c and m > 2 and b", "n < 3 or m > 1",
)  # fmt: skip
DIVIDED_TEXT = (
    "".join(f"input {name} : bool\n" for name in "abcd")
    + "input n : int 0 .. 3\ninput m : int 0 .. 3\noutput o : int 0 .. 1\ntable t {\n| line | when || o |\n"
    + "".join(f"| l{at} | {condition} || 0 |\n" for at, condition in enumerate(DIVIDED))
    + "}\n"
)


@given(
    st.lists(st.sampled_from(range(len(DIVIDED))), max_size=3),
    st.lists(st.sampled_from(range(len(DIVIDED))), max_size=4),
)
def test_conditions_hold_together_just_if_those_of_each_part_do(known: list[int], asked: list[int]) -> None:
    program = program_of(DIVIDED_TEXT)
    meaning = Meaning(program, Shared(program.kinds))
    nodes = meaning.lines(program.tables[0])
    tests = [test for line in program.tables[0].lines for test in line.tests if test is not None]
    here = [now for now in inputs(program, {"o": 0}) if all(holds(tests[at], now) for at in (*known, *asked))]
    questions = Independent([nodes[at] for at in known], OPTIONS)
    chosen = [nodes[at] for at in asked]
    for _ in range(2):  # the second time from what is kept
        assert questions.possible(*chosen) == bool(here)
        n, m = meaning.shared.start["n"], meaning.shared.start["m"]
        found = list(questions.pairs(chosen, n, m))
        assert len(found) == len(set(found))
        assert set(found) == {(now["n"], now["m"]) for now in here}


def test_masks_of_many_bits_come_to_a_graph(tmp_path: Path) -> None:
    """As numbers these words cost more steps than there are."""
    members = ", ".join(f"m{at}" for at in range(40))
    masks = (
        "1xxx1x1xxx00xxxx0xxx01x0100xx0x0x1x00x11xxxxx1x0xxxx0x10xx10xx1x",
        "00x10xxxxxx1xxx01x00x1xxxxxxx0xx01x01x1xx1xxxxx1x01101x0xxx001xx",
    )
    rows = f"| n0 above n1 | 0b{masks[0]} | not in {{m3}} || 1 |\n| n1 | /= 0b{masks[1]} | || 2 |\n| rest | DEFAULT | || 0 |\n"
    for most in (2**64 - 1, 2**64 - 2**40):
        declared = f"enum e {{ {members} }}\ninput d : int 0 .. {most}\nstate s : e\noutput o : int 0 .. 2\n"
        entry = found_in(f"{declared}table t {{\n| line | d | s || o |\n{rows}}}\n", tmp_path)
        with smt.together(3_000_000):
            steps = Steps(entry.program, entry.table, entry.program.variable("s"), OPTIONS)
            found = steps.steps(steps.states())
        assert len(found) == 39 + 40 + 40


# --- the comparison --------------------------------------------------------------------------

SMALL = """
enum mode {{ a, b, c }}
input x : int 0 .. 3
input m : mode
input flag : bool
state n : int 0 .. 3
output y : int 0 .. 3
procedure count {{ n := min(n + 1, 3) }}
procedure twice {{ count; count }}
table t {{
  | line | x | m | flag || procedures | y |
{rows}}}
"""
CELLS = (["", "0", "< 2", ">= 2", "in {1, 3}", "/= 3"], ["", "a", "/= a", "in {b, c}"], ["", "true", "false"])
DOES = (["", "count", "twice", "count; count", "n := min(n + 2, 3)"], ["", "x", "0", "3"])


def small(rows: Sequence[tuple[str, ...]]) -> Program:
    text = "".join(
        f"  | {at} | {' | '.join(row[:3])} || {' | '.join(row[3:])} |\n" for at, row in enumerate(rows)
    )
    return program_of(SMALL.format(rows=text))


def done(program: Program, now: Snapshot) -> object:
    """What matters of an outcome: the fault, or the values afterwards."""
    after = run_table(program, program.tables[0], now)
    return int(after.fault) or tuple(sorted(after.snapshot.items()))


def test_tables_compare_as_all_their_inputs_do() -> None:
    choose = random.Random(1)  # noqa: S311  # by seed
    verdicts = set()
    for _ in range(40):
        rows = [tuple(choose.choice(side) for side in (*CELLS, *DOES)) for _ in range(choose.randint(1, 3))]
        changed = [list(row) for row in rows]
        column = choose.randrange(5)
        changed[choose.randrange(len(rows))][column] = choose.choice((*CELLS, *DOES)[column])
        one, two = small(rows), small([tuple(row) for row in changed])
        verdict = compare((one, one.tables[0]), (two, two.tables[0]), OPTIONS)
        differing = [now for now in inputs(one, {"y": 0}) if done(one, now) != done(two, now)]
        assert isinstance(verdict, Differs if differing else Same), (rows, changed)
        if isinstance(verdict, Differs):
            witness = {**initial(one), **{str(v.name): value for v, value in verdict.witness}}
            assert done(one, witness) != done(two, witness)
            after = [run_table(both, both.tables[0], witness).snapshot for both in (one, two)]
            assert all(after[0][name] != after[1][name] for name in verdict.changed)
        verdicts.add((type(verdict), rows == [tuple(row) for row in changed]))
    assert {(Same, False), (Differs, False)} <= verdicts  # not only tables that are the same text


def test_actions_that_come_to_the_same_are_the_same_and_faults_are_compared() -> None:
    rows = [("< 2", "", "", "twice", "x"), (">= 2", "a", "", "", ""), (">= 2", "/= a", "", "", "")]
    one = small(rows)
    for other, same in (
        ([("< 2", "", "", "count; count", "x"), (">= 2", "", "", "", "")], True),
        ([("< 2", "", "", "count", "x"), (">= 2", "", "", "", "")], False),
        ([("< 2", "", "", "twice", "x"), (">= 2", "a", "", "", "")], False),  # nothing matches now
        ([*rows, ("3", "c", "true", "", "")], False),  # two match now
    ):
        two = small(other)
        verdict = compare((one, one.tables[0]), (two, two.tables[0]), OPTIONS)
        assert isinstance(verdict, Same) is same, other
    assert isinstance(verdict, Differs)
    assert verdict.second == "several lines"
    assert {v.name: value for v, value in verdict.witness} == {"x": 3, "m": 2, "flag": True}


# --- what graphs hold ------------------------------------------------------------------------

CRANE = """
enum place { low, high }
input width_mm : int 0 .. 110 [mm]
input wanted_mm : int 0 .. 110 [mm]
input force : real 0.0 .. 9.0
state at : place deferred until width_mm > 0 [mm]
state counts : array[2] of int 0 .. 9
output speed : int 0 .. 20
output stop : bool
procedure count(which : int 0 .. 1, by : int 0 .. 2) { counts[which] := min(counts[which] + by, 9) }
table crane {
  | line | at   | width_mm - wanted_mm | when                    | force  || counts[1] | procedures                   | stop  | speed      |
  |------|------|----------------------|-------------------------|--------||-----------|------------------------------|-------|------------|
  | up   | low  | -20 [mm] .. 20 [mm]  | wanted_mm > 3 [mm] or force < 0.5 | || 0 | count(0, 2); next at := high | false | 10 / 2 + 1 |
  | wait | low  | -20 [mm] .. 20 [mm]  | not (wanted_mm > 3 [mm] or force < 0.5) | || | count(1, 1) | true | |
  | off  | low  | > 20 [mm]            |                         |        ||           |                              | true  | 0          |
  | thin | low  | < -20 [mm]           |                         |        ||           | next at := low               | true  | 0          |
  | down | high |                      |                         | >= 2.5 ||           | count(0, 1); next at := low  | false |            |
  | stay | high |                      |                         | < 2.5  ||           | count(0, 1)                  |       |            |
}
"""


@pytest.mark.parametrize("form", EVERY_FORM)
def test_units_arrays_values_and_whole_conditions_come_back(tmp_path: Path, form: str) -> None:
    entry = found_in(CRANE, tmp_path)
    made = graph_of(entry)
    edges = {edge.line: edge for edge in made.graph.edges}
    assert (edges["up"].target, edges["up"].decided) == ("high", "")
    assert "count(0, 2)" in edges["up"].effect
    assert "next at" not in edges["up"].effect
    assert (
        "next at := low" in edges["thin"].effect
    )  # it cancels what is pending: a loop alone would not say so
    assert edges["thin"].decided == "next at := low"
    verdict = said(entry, FORMS[form].write(made.graph), form)
    assert verdict.diagnostics == ()
    assert FORMS[form].read(FORMS[form].write(made.graph)).columns == made.graph.columns


@pytest.mark.parametrize("actions", ["try_again; go(open)", "go(open); try_again", "go(open); go(stuck)"])
def test_what_writes_the_state_last_decides(tmp_path: Path, actions: str) -> None:
    entry = found_in(edited(DOOR, ("rest; go(open)  ", actions)), tmp_path)
    verdict = said(entry, FORMS["dot"].write(graph_of(entry).graph), "dot")
    assert verdict.diagnostics == ()
    goals = {(edge.target, edge.decided) for edge in graph_of(entry).graph.edges if edge.line == "3"}
    assert (
        goals
        == {
            "try_again; go(open)": {("open", "try_again, go(open)")},
            "go(open); try_again": {("open", ""), ("stuck", "try_again")},
            "go(open); go(stuck)": {("stuck", "go(open), go(stuck)")},
        }[actions]
    )


def test_lines_that_match_nothing_are_told(tmp_path: Path) -> None:
    text = edited(
        DOOR, ("  | 6 ", "  | x    | open    |        | 0      ||                   |       |\n  | 6 ")
    )
    made = graph_of(
        found_in(
            edited(text, ("| 5    | open    |        |        |", "| 5    | open    |        | > 0    |")),
            tmp_path,
        ),
        "at",
    )
    assert "line `x` matches nothing under the assumptions and has no edge" in made.lost


def test_a_state_is_chosen_or_asked_for(tmp_path: Path) -> None:
    entry = found_in(DOOR, tmp_path)
    assert graph_of(entry).graph.state == "at"
    assert {edge.source for edge in graph_of(entry, "tries").graph.edges} <= {ANY, "0", "1", "2"}
    file = entry.loaded.files[entry.table.file]
    for name in ("motor", "seen", "nothing", "at.next"):
        refused = derive(entry.program, entry.table, file, OPTIONS, name)
        assert isinstance(refused, Diagnostic)
        assert refused.code is Code.GRAPH_NO_STATE


@pytest.mark.parametrize(
    ("name", "state"), [("dock", "now"), ("undock", "now"), ("goto", "stage"), ("align", "stage")]
)
def test_of_several_the_state_is_what_the_lines_write(name: str, state: str) -> None:
    """What a level below reports is an enumeration that is tested and kept, too, and no state of the table."""
    files = (Path(__file__).parents[1] / "data" / "dock").glob("*.rcs")
    found = [each for file in files if not isinstance(all_ := tables(str(file)), NotFound) for each in all_]
    entry = next(each for each in found if each.table.name == name)
    assert graph_of(entry).graph.state == state


def test_a_solver_without_time_draws_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from rcsc.proof.solvers.smt import Answer, Solver

    entry = found_in(DOOR, tmp_path)
    table = tabled(graph_of(entry).graph)
    monkeypatch.setattr(Solver, "check", lambda *_: Answer.UNKNOWN)
    file = entry.loaded.files[entry.table.file]
    for made in (
        derive(entry.program, entry.table, file, OPTIONS),
        derive_lines(entry.program, entry.table, file, OPTIONS),
    ):
        assert isinstance(made, Diagnostic)
        assert made.code is Code.UNDECIDED
    [found] = against(entry.loaded, entry.root, entry.program, entry.table, table, OPTIONS).diagnostics
    assert found.code is Code.UNDECIDED


# --- graphs drawn by hand ----------------------------------------------------------------------

HAND = {
    "mermaid": """---
title: a door
---
stateDiagram-v2
  %% table: door
  %% state: at
  direction LR
  [*] --> shut
  shut --> opening : 1 [button] motor(1)
  shut --> shut : 2 [not button]
  opening --> open : [seen = 3] procedures(rest)
  opening --> opening : [seen < 3]
  open --> open
  stuck --> stuck
""",
    "dot": """// a door
digraph door {
  state = at; rankdir=LR
  node [shape=circle]
  shut -> opening [line=1, when="button", does="motor(1)"]
  shut -> shut [line=2 when="not button"];
  subgraph { opening -> open [when="seen = 3", does="procedures(" + "rest)"]; }
  opening:e -> opening [when="seen < 3"]
# again
  open -> open; stuck -> stuck /* nothing */
}
""",
    "scxml": """<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:r="urn:rcsc:graph" version="1.0" name="door" r:state="at">
  <!-- <transition> -->
  <state id="shut">
    <transition cond="button" target="opening" r:line="1" r:does="motor(1)"/>
    <transition cond="not button" r:line="2"/>
  </state>
  <state id="opening">
    <transition cond="seen = 3" target="open" r:does="procedures(rest)"/>
    <transition cond="seen &lt; 3"/>
  </state>
  <state id="open"><transition target="open"/></state>
  <state id="stuck"><transition target="stuck"/></state>
</scxml>
""",
}


@pytest.mark.parametrize("form", EVERY_FORM)
def test_a_graph_drawn_by_hand_is_a_table(form: str) -> None:
    made = tabled(FORMS[form_of(HAND[form])].read(HAND[form]))
    assert (
        made.text()
        == """table door {
  | line | at      | button | seen || procedures            | motor |
  |------|---------|--------|------||-----------------------|-------|
  | 1    | shut    | true   |      || next at := opening    | 1     |
  | 2    | shut    | false  |      ||                       |       |
  | 3    | opening |        | 3    || next at := open; rest |       |
  | 4    | opening |        | < 3  ||                       |       |
  | 5    | open    |        |      ||                       |       |
  | 6    | stuck   |        |      ||                       |       |
}
"""
    )
    assert made.notes[0] == "an edge from `opening` has no line: it is line `3` now"


def test_edges_of_one_name_that_say_different_things_are_lines_of_their_own() -> None:
    text = HAND["mermaid"].replace(
        "shut --> shut : 2 [not button]",
        "shut --> stuck : 1 [not button]\n  opening --> stuck : 1 [button] motor(1)",
    )
    made = tabled(FORMS["mermaid"].read(text))
    assert [row.name for row in made.table.rows][:3] == ["1a", "1b", "1c"]
    assert "the edges of line `1` do not say one thing: there is a line `1c`" in made.notes


def test_arrows_from_one_line_s_states_are_one_row() -> None:
    text = "stateDiagram-v2\n%% table: t\na --> c : 1 [x]\nb --> c : 1 [x]\nc --> c : 2 DEFAULT\n"
    made = tabled(FORMS["mermaid"].read(text))
    assert "| 1    | in {a, b} | true ||" in made.text()
    assert "| 2    | DEFAULT   |      ||" in made.text()


def test_a_term_under_no_column_or_said_twice_goes_to_when() -> None:
    text = 'digraph t { columns="x | s || y"; state=s; a -> b [when="x > 1 and x < 5 and (p or q) and 3 < z", does="y(1)"]; }'
    made = tabled(FORMS["dot"].read(text)).text()
    assert "| x   | s | when                         ||" in made
    assert "x < 5 and (p or q) and 3 < z" in made


BAD = [
    ("dot", "graph g { a -- b }", 1, "`digraph`"),
    ("dot", 'digraph t {\n a -> b [when="x = "]\n}', 2, "found the end of the text"),
    ("dot", 'digraph t {\n a -> b [does="go(1"]\n}', 2, "not closed"),
    ("dot", "digraph t {\n a -> b\n", 3, "the text ends"),
    ("dot", "digraph t {\n a -> b [x\n}", 3, "expected a name"),
    ("dot", "digraph t {\n a -> é€! b }", 2, "`!` is not DOT"),
    ("dot", "digraph t { }", 1, "no edge"),
    ("dot", 'digraph t {\n a -> "*" }', 2, "draw a loop"),
    ("dot", 'digraph "a b" { a -> b }', 1, "no name of the language"),
    ("dot", "digraph { a -> b }", 1, "which `table`"),
    ("dot", "digraph t {\n a -> b [line=1, decided=p]; a -> c [line=1]; a -> d [line=1] }", 2, "several states"),
    ("mermaid", "stateDiagram-v2\n%% table: t\na --> [*]\n", 3, "no end"),
    ("mermaid", "stateDiagram-v2\n%% table: t\na --> b : 1 [x[0] = 1\n", 3, "not closed"),
    ("mermaid", "stateDiagram-v2\n%% table: t\nstate a {\n", 3, "is not read"),
    ("mermaid", "%% table: t\na --> b\n", 2, "stateDiagram-v2"),
    ("mermaid", "%% table: t\n", 1, "stateDiagram-v2"),
    ("mermaid", "stateDiagram-v2\n%% table: t\na --> b : 1 [x] && y\n", 3, "heading(actions)"),
    ("mermaid", "stateDiagram-v2\n%% table: t\na --> b : 1 [x] | y | z\n", 3, "heading(actions)"),
    ("mermaid", "stateDiagram-v2\n%% table: t\na --> b : 1 [x | y]\n", 3, ""),
    ("mermaid", "stateDiagram-v2\n%% table: t\na --> b : 1 [DEFAULT]\n", 3, "no condition"),
    ("scxml", "<scxml", 1, "not XML"),
    ("scxml", "<a/>", 1, "`scxml`"),
    ("scxml", '<!DOCTYPE a [<!ENTITY b "c">]>\n<a/>', 1, "document type"),
    ("scxml", HAND["scxml"].replace('cond="seen = 3"', 'cond="seen ="'), 8, "found the end"),
    ("scxml", HAND["scxml"].replace("</state>\n</scxml>", '<state id="x"/></state>\n</scxml>'), 1, "states of its own"),
]  # fmt: skip


@pytest.mark.parametrize(("form", "text", "line", "what"), BAD)
def test_what_is_no_graph_is_refused_at_its_place(form: str, text: str, line: int, what: str) -> None:
    with pytest.raises(UnreadableError) as caught:
        tabled(FORMS[form].read(text))
    source = Source("g", text)
    found = diagnosed(caught.value, source)
    assert what in found.message
    assert source.position(found.primary.span.start).line == line


@pytest.mark.parametrize("form", EVERY_FORM)
def test_no_damaged_graph_is_a_bug(shipped: dict[str, FoundTable], form: str) -> None:
    choose = random.Random(form)  # noqa: S311  # by seed
    text = FORMS[form].write(graph_of(shipped["vision.flood_flash"]).graph)
    for _ in range(150):
        begin = choose.randrange(len(text))
        end = begin + choose.randint(0, 12)
        broken = (
            text[:begin]
            + choose.choice(["", '"', "[", "]", "}", "(", "->", "<", "\n", "\\", "|", "#", "in {"])
            + text[end:]
        )
        try:
            tabled(FORMS[form].read(broken))
        except UnreadableError as error:
            assert error.what  # noqa: PT017  # it may as well be read


def test_a_table_takes_the_place_of_its_namesake_or_stands_behind_the_others(
    shipped: dict[str, FoundTable],
) -> None:
    entry = shipped["vision.flood_flash"]
    file = entry.loaded.files[entry.table.file]
    made = tabled(graph_of(entry).graph).table
    before, after = (
        re.findall(r"^table (\w+)", text, re.MULTILINE)
        for text in (entry.loaded.sources[entry.table.file].text, in_place(file, made))
    )
    assert before == after
    assert "## FLOOD-FLASH (OBJ, EXPECTED RANGE)" in in_place(file, made)
    other = tabled(FORMS["mermaid"].read(HAND["mermaid"])).table
    assert in_place(file, other).rstrip().endswith("}")
    assert in_place(file, other).index("table door") > in_place(file, other).index("level vision")


# --- drawings --------------------------------------------------------------------------------


def test_the_drawing_shows_every_state_and_every_line_once_an_arrow(shipped: dict[str, FoundTable]) -> None:
    made = graph_of(shipped["task.acquire"])
    text = svg(made.graph, made.everywhere)
    root = ET.fromstring(text)  # noqa: S314  # made here
    words = [element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {*made.graph.states, "any state", "acquire"} <= set(words)
    numbers = [
        element.text
        for element in root.iter("{http://www.w3.org/2000/svg}text")
        if element.get("class") == "number"
    ]
    assert set(numbers) == {edge.line for edge in made.graph.edges if edge.line != "16"}
    assert "line 16 is DEFAULT, never reached; it would lead to f_state" in words
    assert "emove.status = executing" in words
    assert text == svg(made.graph, made.everywhere)


def test_default_is_drawn_where_it_can_be_reached_and_a_choice_is_dashed(tmp_path: Path) -> None:
    entry = found_in(DOOR, tmp_path)
    root = ET.fromstring(svg(graph_of(entry).graph))  # noqa: S314  # made here
    words = [element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert "DEFAULT" in words  # in stuck, without the button or with `seen` past 1
    assert words.count("try_again says so") == 2  # to opening again, or to stuck
    dashed = [element for element in root.iter() if element.get("class") == "arrow dashed"]
    assert len(dashed) == 2, "to its label and on to `opening`; what stays stands in its state"


@pytest.mark.parametrize(
    ("guard", "shown"),
    [
        ("new_command = true and idle = false", "new_command, not idle"),
        ("goal.known = true and x = 1", "goal.known, x = 1"),
        ("a = false or b = true", "not a or b"),
        ("not (x = 1 and y = 2) and z = 3 and w in {1, 2}", "not (x = 1 and y = 2), z = 3, w in {1, 2}"),
        ("x + y = true_enough", "x + y = true_enough"),
    ],
)
def test_guards_are_short_for_the_eye(guard: str, shown: str) -> None:
    assert plain(guard) == shown


def test_the_graph_of_lines_is_drawn_and_makes_no_table(shipped: dict[str, FoundTable]) -> None:
    entry = shipped["vision.flood_flash"]
    made = derive_lines(entry.program, entry.table, entry.loaded.files[entry.table.file], OPTIONS)
    assert isinstance(made, Derived)
    after = {(edge.source, edge.target) for edge in made.graph.edges}
    assert {(ANY, "1"), ("2", "3"), ("4", "6"), ("3", "7")} <= after
    assert not {("1", "6"), ("3", "6"), ("4", "7"), ("6", "2")} & after
    assert "<svg" in svg(made.graph, made.everywhere)
    for form in FORMS.values():
        with pytest.raises(UnreadableError, match="graph of lines"):
            tabled(form.read(form.write(made.graph)))


# --- the commands --------------------------------------------------------------------------------


def run(*args: str, stdin: str = "") -> tuple[int, str, str]:
    """Exit status, standard output and standard error."""
    done = CliRunner().invoke(commands, list(args), input=stdin, standalone_mode=False)
    assert done.exception is None, done.exception
    return done.return_value or 0, done.stdout, done.stderr


ACQUIRE = str(ROOT / "tables/task/acquire.rcs")


def test_what_is_the_same_under_assumptions_alone_is_said_to_be_so(tmp_path: Path) -> None:
    """A line of what should not happen has no edge: where it does happen, the table of the graph has no line for it."""
    file, graph = tmp_path / "x.rcs", tmp_path / "x.dot"
    file.write_text(
        "enum st { idle, run }\ninput go : bool\ninput x : int 0 .. 9\nstate s : st\noutput o : bool\n"
        "assume small monitored : x <= 8\ntable t assuming small {\n| line | s | go | x || s | o |\n"
        "| a | idle | true | || run | true |\n| i | idle | false | || | false |\n"
        "| e above b | run | | 9 || idle | true |\n| b | run | | || | false |\n}\n"
    )
    status, _, said = run("graph", str(file), "-o", str(graph))
    assert (status, said.splitlines()) == (0, [
        "note[RCS774]: t: not in the graph: line `e` matches nothing under the assumptions and has no edge",
        "t: the table read back from the graph does the same where `small` holds: proved, 7 questions",
    ])  # fmt: skip
    status, _, said = run("table", str(graph), "--against", str(file))
    assert (status, said.splitlines()[-1]) == (
        0,
        f"t: does the same as {file}:t where `small` holds: proved, 7 questions",
    )


@pytest.mark.parametrize("form", EVERY_FORM)
def test_graph_and_table_are_each_other_s_way_back(form: str, assuming: str, tmp_path: Path) -> None:
    status, text, notes = run("graph", assuming, "--form", form)
    assert status == 0
    under = "`acquire_states`, `acquire_in_step`, `acquire_resting`"
    assert f"acquire: the table read back from the graph does the same where {under} hold: proved" in notes
    assert "note[RCS774]: acquire: not in the graph: line `10`" in notes
    status, made, proved = run("table", "-", "--against", assuming, stdin=text)
    assert (status, "does the same as" in proved) == (0, True)
    assert made.startswith("use task/common\n\ntable acquire assuming acquire_states {")
    status, refuted, _ = run(
        "table",
        "-",
        "--against",
        assuming,
        stdin=text.replace("emove.status = failed", "emove.status /= done"),
    )
    assert (status, "error[RCS773]" in refuted, "the graph to several lines" in refuted) == (1, True, True)
    status, whole, _ = run("table", "-", "--in", assuming, stdin=text)
    assert (status, "assume acquire_states monitored" in whole) == (0, True)
    place = tmp_path / "new.rcs"
    place.write_text(whole, encoding="utf-8")
    assert (
        load([str(place)]).diagnostics[0].code is Code.FILE_NOT_FOUND
    )  # only `task/common` is not beside it


@pytest.mark.parametrize(
    ("asked", "other"),
    [
        ("(a or b) for 200 [ms]", "a for 200 [ms]"),
        ("(a or b) for 200 [ms]", "(a and b) for 200 [ms]"),
        ("(a or b) for 200 [ms]", "a"),
        ("was r.b", "was r_b"),
        ("@T(r.b)", "@T(r_b)"),
    ],
)
def test_a_graph_that_looks_back_at_something_else_does_not_the_same(
    asked: str, other: str, tmp_path: Path
) -> None:
    text = (
        "enum m { off, on }\nrecord part { b : bool }\ninput r : part\ninput r_b : bool\ninput a : bool\ninput b : bool\nstate s : m\n"
        f"table t {{\n| line | s | a | when || s |\n| p | off | true | {asked} || on |\n| r | on | false | || off |\n"
        "| q | DEFAULT | | || |\n}\nlevel l { period 100 [ms] table t }\n"
    )
    path = tmp_path / "t.rcs"
    path.write_text(text, encoding="utf-8")
    status, drawn, _ = run("graph", str(path), "--form", "dot")
    assert (status, asked in drawn) == (0, True)
    status, _, said = run("table", "-", "--against", str(path), stdin=drawn)
    assert (status, "does the same as" in said) == (0, True)
    status, refuted, _ = run("table", "-", "--against", str(path), stdin=drawn.replace(asked, other))
    assert (status, "error[RCS773]" in refuted) == (1, True)


def test_a_folder_of_tables_is_drawn_into_a_folder(tmp_path: Path) -> None:
    (tmp_path / "door.rcs").write_text(DOOR, encoding="utf-8")
    (tmp_path / "plain.rcs").write_text(
        "input a : bool\ntable p {\n| line | a ||\n| 1 | ||\n}\n", encoding="utf-8"
    )
    status, _, notes = run("graph", str(tmp_path), "-o", str(tmp_path / "out"))
    assert (status, "note[RCS771]: table `p`" in notes) == (0, True)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["door_door.svg"]
    status, _, _ = run("graph", f"{tmp_path}/door.rcs:door", "-o", str(tmp_path / "door.gv"))
    assert status == 0
    assert form_of((tmp_path / "door.gv").read_text(encoding="utf-8")) == "dot"


@pytest.mark.parametrize(
    ("args", "code"),
    [
        (("graph", "no_such_table"), "RCS201"),
        (("graph", f"{ACQUIRE}:nothing"), "RCS201"),
        (("graph", ACQUIRE, "--state", "idle2"), "RCS771"),
        (("table", ACQUIRE), "RCS772"),
    ],
)
def test_what_cannot_be_done_has_a_code(args: tuple[str, ...], code: str) -> None:
    status, out, _ = run(*args)
    assert (status, f"error[{code}]" in out) == (1, True), out


def test_a_drawing_needs_a_layout_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda *_, **__: None)
    status, out, _ = run("graph", ACQUIRE)
    assert (status, "error[RCS705]: `graphviz-pure` is not installed" in out) == (1, True)


def test_states_are_members_in_declared_order(shipped: dict[str, FoundTable]) -> None:
    graph: StateGraph = graph_of(shipped["emove.locate"]).graph
    kind = shipped["emove.locate"].program.variable("cur_state").type
    assert isinstance(kind, Enum)
    assert [name for name in kind.members if name in graph.states] == list(graph.states)
