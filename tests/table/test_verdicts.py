"""What a verdict on a table claims: the worst of all programs that it is in, and what it rests on."""

import json
from dataclasses import replace
from itertools import combinations, permutations, product
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.base.diagnostics.jsonform import report_to_json
from rcsc.base.diagnostics.report import NOT_PROVED, Report, TableReport, Verdict, merged, resting
from rcsc.base.diagnostics.services import sarif
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.lang.interpret import holds, matching_lines
from rcsc.lang.model import Program, Real, Value
from rcsc.lang.resolve import compile_text
from rcsc.proof.certify import certify
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import STEPS, Options, SolverChoice
from rcsc.proof.solvers.smt import Answer
from rcsc.proof.solvers.smtlib import cvc5_says
from rcsc.proof.table.confirm import TableSolver
from rcsc.proof.table.program import prove_program
from rcsc.proof.table.verdict import (
    ContradictoryAssumptions,
    DeadLine,
    Gap,
    Overlap,
    SolversDisagree,
    TableVerdict,
    Undecided,
)
from tests.support.programs.stages import drawn_program, program_of, reported, shipped, verdict_of
from tests.support.programs.texts import table
from tests.wrong import drawn

REPO = Path(__file__).parents[2]
HERE = {
    "lib": "state a : int 0 .. 9\ninput g : bool\ntable t {\n  | line | a ||\n  | l | <= 4 ||\n  | h | 5 .. 8 ||\n}\n",
    "plain": "use lib\ntable ta {\n  | line | g ||\n  | l | true ||\n  | h | false ||\n}\n",
    "sure": "use lib\ninvariant small : a <= 8\ntable tb {\n  | line | g ||\n  | l | true ||\n  | h | false ||\n}\n",
}


def checked(folder: Path, *, cache: bool = False) -> Report:
    return check(Settings((str(folder),), Options(), use_cache=cache))


def verdicts(report: Report) -> dict[str, Verdict]:
    return {table.table: table.verdict for table in report.tables}


@pytest.mark.parametrize("names", list(permutations(["a", "b"])))
@pytest.mark.parametrize("cache", [False, True])
def test_the_worst_verdict_counts_in_every_order(tmp_path: Path, names: tuple[str, str], cache: bool) -> None:
    """One program proves the table under its invariant, the other refutes it."""
    (tmp_path / "rcsc.toml").touch()
    for name, part in zip(("lib", *names), ("lib", "plain", "sure"), strict=True):
        (tmp_path / f"{name}.rcs").write_text(HERE[part])
    for _ in range(1 + cache):
        report = checked(tmp_path, cache=cache)
        assert verdicts(report) == {"t": Verdict.REFUTED, "ta": Verdict.PROVED, "tb": Verdict.PROVED}
        shown = [report_to_json(report, "check")["tables"], sarif(report)["runs"][0]["properties"]["tables"]]
        for tables in shown:
            assert (
                json.loads(json.dumps({table["table"]: table["verdict"] for table in tables}))["t"]
                == "refuted"
            )


def test_merging_keeps_the_worst_and_all_that_is_rested_on() -> None:
    def one(verdict: Verdict, *assumptions: tuple[str, str]) -> TableReport:
        return TableReport("t", "f", verdict, 1, assumptions=assumptions)

    for several in permutations(one(verdict) for verdict in Verdict):
        assert [table.verdict for table in merged(several)] == [Verdict.REFUTED]
    both = merged(
        [one(Verdict.PROVED, ("a", "assumed")), one(Verdict.PROVED, ("a", "assumed"), ("b", "proved"))]
    )
    assert both == (one(Verdict.PROVED, ("a", "assumed"), ("b", "proved")),)
    assert resting(both[0], {"b"}).verdict is Verdict.CONDITIONAL
    assert resting(both[0], {"c"}).verdict is Verdict.PROVED
    assert resting(one(Verdict.REFUTED, ("b", "proved")), {"b"}).verdict is Verdict.REFUTED


INVARIANT = """
state n : int 0 .. 9 = 1
input a : int 0 .. 9
output o : int 0 .. 9
invariant small : n <= 8
{assumption}
table rests {head} {{
  | line | {subject} || o |
  | l | {low} || 1 |
  | h | {high} || 2 |
}}
table moves {{
  | line | a || n |
  | x | <= 4 || {value} |
  | y | > 4 || 2 |
}}
"""
PLAIN = {"assumption": "", "head": "", "subject": "n", "low": "<= 4", "high": "5 .. 8", "value": "3"}


@pytest.mark.parametrize(
    "rests",
    [
        {},
        {"subject": "when", "low": "a / (9 - n) > 2", "high": "not (a / (9 - n) > 2)"},
        {"assumption": "assume low proved : n < 9", "head": "assuming low", "subject": "n"},
    ],
    ids=["covered by it", "defined by it", "an assumption that follows from it"],
)
@pytest.mark.parametrize("cache", [False, True])
def test_what_rests_on_a_broken_invariant_is_not_proved(
    tmp_path: Path, rests: dict[str, str], cache: bool
) -> None:
    (tmp_path / "rcsc.toml").touch()
    file = tmp_path / "p.rcs"
    file.write_text(INVARIANT.format(**PLAIN | rests))
    report = checked(tmp_path, cache=cache)
    assert not report.failed
    assert verdicts(report) == {"rests": Verdict.PROVED, "moves": Verdict.PROVED}
    assert "proved" in dict(report.tables[0].assumptions).values()
    for value in ("9", "a * 3"):  # breaks it; can leave its range, so that nothing is known of it
        file.write_text(INVARIANT.format(**PLAIN | rests | {"value": value}))
        for _ in range(1 + cache):
            broken = checked(tmp_path, cache=cache)
            assert broken.failed
            assert verdicts(broken) == {"rests": Verdict.CONDITIONAL, "moves": Verdict.CONDITIONAL}
            assert NOT_PROVED in dict(broken.tables[0].assumptions).values()


def test_an_assumption_that_does_not_follow_is_not_proved(tmp_path: Path) -> None:
    wrong = {"assumption": "assume low proved : n < 8", "head": "assuming low", "high": "5 .. 7"}
    (tmp_path / "p.rcs").write_text(INVARIANT.format(**PLAIN | wrong))
    assert verdicts(checked(tmp_path))["rests"] is Verdict.CONDITIONAL


# --- boxes, regions and Z3 treat assumptions alike -------------------------------------------

RANGES: dict[str, tuple[Value, ...]] = {"p": (False, True), "x": (0, 1, 2), "y": (0, 1, 2, 3)}
CELLS = {
    "p": ("", "true", "false"),
    "x": ("", "0", "< 2", "/= 1", ">= 1", "2"),
    "y": ("", "0 .. 1", "> 1", "/= 2", "in {0, 3}", "x"),
    "when": ("", "", "", "x * y > 1", "not (x * y > 1)", "(x + y) mod 2 = 0", "x * x < y"),
}
ASSUMED = (
    "p", "not p", "x < 2", "y /= 0", "x = y", "x < y", "p implies x = 0", "x + y <= 3", "y > 3 - x",
    "p or y > 1",
)  # fmt: skip


@st.composite
def tables(draw: st.DrawFn) -> str:
    """A small table; its lines often split one column, so that it is often right but for what is assumed."""
    count = draw(st.integers(1, 3))
    rows = [tuple(draw(st.sampled_from(cells)) for cells in CELLS.values()) for _ in range(count)]
    if draw(st.booleans()):
        rows = [("true", *row[1:]) if at == 0 else ("false", "", "", "") for at, row in enumerate(rows[:2])]
    default = draw(
        st.sampled_from(["", "  | d | DEFAULT | | | ||\n", "  | d | DEFAULT unreachable | | | ||\n"])
    )
    assumed = draw(st.lists(st.sampled_from(ASSUMED), max_size=2, unique=True))
    standing = draw(st.sampled_from(["assumed", "monitored"]))
    names = [f"a{at}" for at in range(len(assumed))]
    head = "".join(f"assume {name} {standing} : {text}\n" for name, text in zip(names, assumed, strict=True))
    lines = "".join(f"  | l{at} | {' | '.join(row)} ||\n" for at, row in enumerate(rows))
    assuming = f"assuming {', '.join(names)} " if names else ""
    return (
        "input p : bool\ninput x : int 0 .. 2\ninput y : int 0 .. 3\n"
        f"{head}table t {assuming}{{\n  | line | p | x | y | when ||\n{lines}{default}}}\n"
    )


def brute(program: Program) -> set[object]:
    """What is wrong with the table under its assumptions, by trying every input."""
    [table] = program.tables
    every = [dict(zip(RANGES, values, strict=True)) for values in product(*RANGES.values())]
    inputs = [one for one in every if all(holds(a.condition, one) for a in program.assumptions)]
    if not inputs:
        return {"contradiction"}
    matched = [matching_lines(table, point) for point in inputs]
    found: set[object] = {pair for names in matched for pair in combinations(names, 2)}
    found |= {line.name for line in table.lines if all(line.name not in names for names in matched)}
    return found | ({"gap"} if [] in matched else set())


def least(program: Program) -> dict[object, dict[str, Value]]:
    """The least input, in declared order, of each overlap and of the gap, by trying every input."""
    [table] = program.tables
    found: dict[object, dict[str, Value]] = {}
    for values in product(*RANGES.values()):
        here = dict(zip(RANGES, values, strict=True))
        if all(holds(a.condition, here) for a in program.assumptions):
            matched = matching_lines(table, here)
            for wrong in (*combinations(matched, 2), *(() if matched else ("gap",))):
                found.setdefault(wrong, here)
    return found


def told(program: Program, options: Options) -> tuple[set[object], list[object], set[tuple[Code, str]]]:
    """The same from a verdict: with the witnesses of gaps, and what is said of it."""
    verdict = prove_program(program, options)
    [table] = verdict.tables
    names = [line.name for line in table.table.lines]
    found: set[object] = set()
    for wrong in table.findings:
        match wrong:
            case Overlap(first, second):
                found.add((names[first], names[second]))
            case DeadLine(line):
                found.add(names[line])
            case Gap():
                found.add("gap")
            case ContradictoryAssumptions():
                found.add("contradiction")
            case _:
                found.add(wrong)
    gaps: list[object] = [gap.witnesses[0] for gap in table.findings if isinstance(gap, Gap)]
    for witness in gaps:
        assert isinstance(witness, dict)
        snapshot = {name: values[0] for name, values in RANGES.items()} | witness
        assert matching_lines(program.tables[0], snapshot) == []
    return found, gaps, {(finding.code, finding.message) for finding in verdict.findings}


@given(tables())
@settings(max_examples=60, deadline=None)
def test_every_way_of_deciding_finds_what_trying_all_inputs_finds(text: str) -> None:
    program = drawn_program(text)  # a cell that nothing satisfies is an error of its own
    by_boxes, auto, both = (told(program, Options(solver=how)) for how in ("boxes", "auto", "both"))
    assert by_boxes == auto == both
    assert by_boxes[0] == brute(program)
    default = program.tables[0].default
    dead = default is not None and not default.unreachable and not {"gap", "contradiction"} & by_boxes[0]
    assert any(code is Code.DEFAULT_DEAD for code, _ in by_boxes[2]) == dead
    alone = told(program, ALONE)
    assert alone[0] == by_boxes[0]
    assert {code for code, _ in alone[2]} == {code for code, _ in by_boxes[2]}


ALONE = Options(solver="z3")


@given(tables())
@settings(max_examples=25, deadline=None)
def test_z3_alone_gives_the_least_inputs_and_rests_on_no_more_than_it_needs(text: str) -> None:
    program = drawn_program(text)
    verdict = prove_program(program, ALONE)
    [alone] = verdict.tables
    assert alone.backing.method == "z3"
    names = [line.name for line in alone.table.lines]
    wanted = least(program)
    for wrong in alone.findings:
        if isinstance(wrong, Overlap):
            assert wrong.witness.items() <= wanted[names[wrong.first], names[wrong.second]].items()
        elif isinstance(wrong, Gap):
            [witness] = wrong.witnesses
            assert witness.items() <= wanted["gap"].items()
    used = tuple(name for name, _ in alone.backing.assumptions)
    by_boxes = prove_program(program, Options(solver="boxes")).tables[0]
    assert set(used) <= {name for name, _ in by_boxes.backing.assumptions}
    if verdict.proved is not None:
        [table] = program.tables
        fewer = replace(program, assumptions=tuple(a for a in program.assumptions if a.name in used))
        default = table.default is not None and not table.default.unreachable
        assert not {
            each for each in brute(fewer) if isinstance(each, tuple) or (each == "gap" and not default)
        }
        assert verdict.certificate is not None
        assert not certify(program, verdict.certificate).problems


@pytest.mark.parametrize("seed", range(16))
def test_z3_alone_says_of_any_table_what_the_others_say(seed: int) -> None:
    """Of numbers of 64 bits, doubles, singles, words, enumerations, arrays, sets, `above` and `same`, under assumptions or not."""
    program = compile_text(drawn(Random(f"alone {seed}"), small=True))  # noqa: S311  # a sample, not a secret
    if isinstance(program, Program):
        assert_alike(program, 100_000)


CORPUS = (
    "tables/examples/acquire_published.rcs",
    "tables/examples/grip.rcs",
    "tables/task/acquire.rcs",
    "tables/emove/move_to.rcs",
    "tables/gripper/gripper.rcs",
    "tables/gallery/cia402",
    "tables/gallery/tcas",
    "tables/gallery/safety_injection",
)


@pytest.mark.parametrize("path", CORPUS)
def test_z3_alone_says_of_shipped_tables_what_the_others_say(path: str) -> None:
    files = sorted((REPO / path).glob("*.rcs")) if (REPO / path).is_dir() else [REPO / path]
    programs = [shipped(str(file.relative_to(REPO)), REPO) for file in files]
    assert any(program.tables for program in programs)
    for program in programs:
        assert_alike(program)


def assert_alike(program: Program, steps: int = STEPS) -> None:
    """Assert that boxes, both and Z3 alone find the same, as far as each decides."""
    ways = {
        how: prove_program(program, Options(solver=how, steps=steps)).tables
        for how in ("boxes", "both", "z3")
    }
    for one, both, alone in zip(*ways.values(), strict=True):
        names = [line.name for line in one.table.lines]
        if one.undecided or both.undecided or alone.undecided:
            assert {verdict.refuted for verdict in (one, both, alone) if not verdict.undecided} != {
                True,
                False,
            }
            for verdict in (one, alone):
                assert verdict.certificate is None or not verdict.undecided
            continue
        kinds, rest = map(list, zip(*(_said(verdict) for verdict in (one, both, alone)), strict=True))
        assert kinds[0] == kinds[1] == kinds[2], names
        slow = any(isinstance(variable.type, Real) for variable in program.variables)
        if one.backing.method in {"boxes", "tree"} and not slow:
            assert rest[0] == rest[1], names
            assert one.backing.assumptions == alone.backing.assumptions
            # A tree over differences of wide numbers (`not @C`) stops at an input that is not the least; Z3 alone goes on.
            order = [str(variable.name) for variable in program.variables]
            for what, found in rest[2].items():
                if one.backing.method == "boxes" or not isinstance(found, dict):
                    assert found == rest[0][what], names
                else:
                    least, other = (
                        [each[name] for name in order if name in each] for each in (found, rest[0][what])
                    )
                    assert least <= other, names


def _said(verdict: TableVerdict) -> tuple[set[object], dict[object, object]]:
    """What is wrong, and what is said of it: the least input, or that a line is dead under assumptions alone."""
    found: dict[object, object] = {}
    for each in verdict.findings:
        match each:
            case Overlap(first, second, witness):
                found["overlap", first, second] = dict(witness)
            case DeadLine(line, assuming):
                found["dead", line] = assuming
            case Gap(witnesses):
                read = verdict.table.variables
                found["gap"] = {name: value for name, value in witnesses[0].items() if name in read}
            case _:
                found[each] = None
    return set(found), found


@pytest.mark.parametrize("text", [
    table("t", "line | a ||", "l | <= 4 ||", "m | > 4 ||"),
    table("t", "line | a ||", "l | <= 4 ||", "m | > 4 ||", "d | DEFAULT ||"),
    table("t", "line | a ||", "l | <= 4 ||", "m | >= 4 ||", "n | > 9 ||"),
    table("t", "line | a ||", "l | < 4 ||", "m | > 4 ||", assuming="low"),
], ids=["right", "default", "overlap", "assuming"])  # fmt: skip
def test_what_z3_alone_does_not_answer_is_undecided(text: str) -> None:
    verdict = verdict_of(f"input a : int 0 .. 12\nassume low : a /= 4\n{text}", Options(solver="z3", steps=1))
    [alone] = verdict.tables
    assert {type(each) for each in alone.findings} == {Undecided}
    assert verdict.proved is None
    assert alone.certificate is None
    assert {each.code for each in verdict.findings if each.severity is Severity.ERROR} == {Code.UNDECIDED}


WRONG = "input a : int 0 .. 9\n" + table("t", "line | a ||", "l | <= 4 ||", "m | 4 .. 6 ||", "n | > 7 ||")


@pytest.mark.parametrize("elsewhere", [0, 4, 7, 10], ids=["a line", "an overlap", "a gap", "out of range"])
def test_an_input_of_z3_that_is_none_is_never_shown(monkeypatch: pytest.MonkeyPatch, elsewhere: int) -> None:
    """The interpreter tries it first; as Z3 gives it the wrong input each time, something it says is not so."""
    monkeypatch.setattr("rcsc.proof.solvers.smt.Solver.value", lambda *_: elsewhere)
    verdict = verdict_of(WRONG, ALONE)
    assert [each.code for each in verdict.findings] == [Code.SOLVERS_DISAGREE]
    assert verdict.tables[0].findings == (
        SolversDisagree("the interpreter does not see what it says of an input"),
    )


def test_the_checker_counts_what_z3_alone_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    """Boxes it counts; of another table it is left the whole question, or, of one with many lines, a tree."""
    head = "input x : int 0 .. 9\ninput y : int 0 .. 9\n"
    boxes = head + table("t", "line | x | y ||", "l | <= 4 | ||", "m | > 4 | < 3 ||", "n | > 4 | >= 3 ||")
    far = head.replace("9", "99999")
    across = far + table(
        "t",
        "line | when ||",
        "l | x + y < 7 ||",
        "m | x + y >= 7 and x < y ||",
        "n | x + y >= 7 and x >= y ||",
    )
    for most, text, left in ((64, boxes, 0), (64, across, 1), (1, across, 0)):
        monkeypatch.setattr("rcsc.proof.table.relational.MOST_CANDIDATES", most)
        program = program_of(text)
        verdict = prove_program(program, ALONE)
        assert verdict.certificate is not None
        outcome = certify(program, verdict.certificate)
        assert (outcome.problems, len(outcome.unchecked)) == ((), left)
        for each in outcome.unchecked:
            assert cvc5_says(each.question) in {"unsat", ""}  # without cvc5 there is no answer


@pytest.mark.parametrize("solver", ["boxes", "auto", "both", "z3"])
def test_what_an_assumption_kills_is_told(solver: SolverChoice) -> None:
    """Boxes prove both tables without the assumption, under which a line, and DEFAULT, are dead."""
    head = "input v : bool\nassume up assumed : v\n"
    for last, code in (("m | false ||", Code.DEAD_LINE), ("d | DEFAULT ||", Code.DEFAULT_DEAD)):
        text = head + table("t", "line | v ||", "l | true ||", last, assuming="up")
        [found] = verdict_of(text, Options(solver=solver)).findings
        assert found.code is code
        assert found.notes == ("under `up`",)
        assert found.severity is Severity.WARNING  # where the assumption fails it may match


@pytest.mark.parametrize("solver", ["boxes", "auto", "both", "z3"])
def test_a_line_that_an_invariant_kills_is_a_mistake(solver: SolverChoice) -> None:
    head = "state v : bool = true\ninput w : bool\ninvariant up : v\nassume w_up assumed : w\n"
    text = head + table("t", "line | v ||", "l | true ||", "m | false ||", assuming="w_up")
    found = verdict_of(text, Options(solver=solver)).findings
    assert [(finding.code, finding.severity) for finding in found] == [(Code.DEAD_LINE, Severity.ERROR)]


def test_a_gap_between_related_lines_is_told_with_the_region_around_its_least_point() -> None:
    head = "input x : int 0 .. 9\ninput y : int 0 .. 9\n"
    text = head + table("t", "line | when ||", "l | x < y ||", "m | x > y + 1 ||")
    [gap] = [one for one in verdict_of(text, Options()).tables[0].findings if isinstance(one, Gap)]
    assert gap.witnesses == ({"x": 0, "y": 0},)
    assert gap.regions[0] is not None


def test_the_zeros_of_both_signs_are_one_value_to_the_solver() -> None:
    text = "input r : real -1.0 .. 1.0\n" + table("t", "line | r * 0.0 ||", "l | = 0.0 ||")
    assert verdict_of(text, Options()).tables[0].findings == ()


def test_what_an_unproved_invariant_kills_says_so() -> None:
    head = "state n : int 0 .. 9 = 1\ninput v : bool\ninvariant small : n <= 4\n"
    text = head + table("t", "line | n || n", "l | <= 4 || 9", "d | DEFAULT || 1")
    notes = {finding.code: finding.notes for finding in verdict_of(text, Options()).findings}
    assert notes[Code.DEFAULT_DEAD] == ("under `small` (not proved)",)


PRODUCTS: list[tuple[str, str, set[type]]] = [
    ("r * s > 1.0", "r * s >= 1.0", {Overlap, Gap}),
    ("r * s > 1.0", "r * s < 1.0", {Gap}),
    ("r * s > 1.0", "r * s <= 1.0", set()),
    ("r * s >= 1.0", "not (r * s > 1.0)", {Overlap}),
    ("r * s >= 0.0", "r * s < 0.0", {DeadLine}),
]


@pytest.mark.parametrize("assumed", ["", "assuming low "])
@pytest.mark.parametrize("steps", [1, 300_000])
@pytest.mark.parametrize(("one", "two", "wrong"), PRODUCTS)
def test_what_inputs_show_of_products_of_doubles_is_told_though_z3_gives_up(
    one: str, two: str, wrong: set[type], steps: int, assumed: str
) -> None:
    program = program_of(
        "input r : real 0.0 .. 2.0\ninput s : real 0.0 .. 2.0\nassume low assumed : r <= 1.5\n"
        f"table t {assumed}{{\n| line | when ||\n| a | {one} ||\n| b | {two} ||\n}}\n"
    )
    [table] = prove_program(program, Options(solver="boxes", steps=steps)).tables
    kinds = {type(found) for found in table.findings}
    assert kinds - {Undecided} <= wrong
    assert wrong & {Overlap, Gap} <= kinds
    assert wrong <= kinds or Undecided in kinds
    for found in table.findings:
        if isinstance(found, Overlap | Gap):
            witness = found.witness if isinstance(found, Overlap) else found.witnesses[0]
            assert not assumed or holds(program.assumptions[0].condition, witness)
            assert len(matching_lines(program.tables[0], witness)) == (2 if isinstance(found, Overlap) else 0)


def test_tables_of_one_cycle_that_assume_what_cannot_hold_together_are_told() -> None:
    """Each is proved under its own; of what a stage before writes nothing follows, nor of tables of which one or the other runs."""

    def text(low: str, high: str, level: str) -> str:
        return f"""input n : int 0 .. 9
state m : int 0 .. 9
output a : bool
output b : bool
assume low : {low}
assume high : {high}
table first assuming low {{
  | line | n    || a    | m |
  | x    | <= 2 || true | 7 |
}}
table second assuming high {{
  | line | n    || b    |
  | y    | >= 7 || true |
  | z    | < 7  || true |
}}
level l {{ period 40 [ms] {level} }}
"""

    both = "table first table second"
    found = reported(text("n <= 2", "n >= 7", both))
    told = [each for each in found if each.code is Code.CONTRADICTORY_ASSUMPTIONS]
    assert [each.message for each in told] == [
        "tables `first` and `second` of level `l` run in one cycle, and assume what cannot hold together"
    ]
    assert [label.message for label in told[0].related] == ["assumed", "assumed"]
    declared = program_of(text("n <= 2", "n >= 7", both)).assumptions
    assert [label.span for label in told[0].related] == [each.span for each in declared]
    for low, high in (("n <= 2", "n <= 1"), ("n <= 2", "m >= 7")):
        assert Code.CONTRADICTORY_ASSUMPTIONS not in [each.code for each in reported(text(low, high, both))]
    alone = reported(text("n < 1 and n > 2", "n >= 7", both))
    assert len([each for each in alone if each.code is Code.CONTRADICTORY_ASSUMPTIONS]) == 1


CALCULATES = """
input a : real -100.0 .. 100.0
input c : real 0.0 .. 1.0
input n : int 0 .. 9
table t {
  | line | a * 1e308 - c * 1e308 | when ||
  | x | <= 0.0 | single(n) * 2e38 - single(n) * 2e38 >= 0.0 ||
  | y | in {0.5, -1.0} | a * 1e308 > 0.5 ||
  | z | > 0.0 | not (single(n) * 2e38 - single(n) * 2e38 >= 0.0) ||
}
"""


def test_what_is_calculated_of_doubles_is_stated_to_the_solver_once() -> None:
    """Of each question Z3 makes bits of it anew; by a name it is what the interpreter says, NaN and infinities too."""
    program = program_of(CALCULATES)
    [tested] = program.tables
    solver = TableSolver(program, tested, Options())
    leaves = {str(v.name): (v, solver.frame.leaves[str(v.name)]) for v in program.variables}
    for a, c, n in product((-100.0, -0.0, 1e-308), (0.0, 1.0), (0, 9)):
        now: dict[str, Value] = {"a": a, "c": c, "n": n}
        here = [smt.equal(term, smt.literal(v.type, now[name]), v.type) for name, (v, term) in leaves.items()]
        matching = set(matching_lines(tested, now))
        for at, line in enumerate(tested.lines):
            told = solver.holds(*here, solver.line(at))
            assert (told is Answer.SATISFIABLE) == (line.name in matching), (now, line.name)
    assert len(solver.frame.named) == 3
