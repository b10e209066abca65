"""What is told of programs that are wrong, to the letter: messages, places, notes, help, and the least witnesses."""

from typing import Any

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.render import full, plain
from rcsc.base.diagnostics.source import Source
from rcsc.lang.model import Backing
from rcsc.proof.procedures.discharge import Asker, Discharge
from rcsc.proof.procedures.invariants import properties_elsewhere
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.table import program as proving
from rcsc.proof.table import relational
from rcsc.proof.table.confirm import Agreement, confirm
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.program import prove_program
from rcsc.proof.table.regions import splitting
from rcsc.proof.table.regions.splitting import Tree
from rcsc.proof.table.verdict import Overlap, TableVerdict, Undecided
from tests.support.programs.stages import program_of, reported

FAULTY = """\
input a : int 0 .. 9
input b : int -5 .. 5
input wide : int 0 .. 18446744073709551615
input low : int -9223372036854775808 .. 9223372036854775807
input yes : bool
input x : real 0.0 .. 500.0
state n : int 0 .. 9
state m : int -100 .. 100
state s : int -9223372036854775808 .. 9223372036854775807
state r : real 0.0 .. 500.0
state xs : array[4] of int 0 .. 9
state late : int 0 .. 9 deferred until yes
output out : int 0 .. 9
output shown : int 0 .. 9 = 0 safe 9
invariant small : n <= 5 and shown <= 5
invariant apart : late <= 8 and n + late <= 12
invariant begins : r > 1.0
assume zero assumed : n > 0
assume never proved : m /= 50
property kept : n <= 9
property other : n >= 0
procedure over { s := low + 1 }
procedure under { s := low / b }
procedure rest { s := low mod b }
procedure of_wide { if wide - 1 > low { m := 0 } }
procedure whole { m := int(x * 1.0e18) }
procedure index { xs[a] := a + 1 }
procedure read { m := xs[a + b] }
procedure real_ { r := x * 2.0 }
procedure use { local k : int 0 .. 9 if yes { k := 1 } m := k }
procedure unset { local j : int 0 .. 9 m := j }
procedure first { n := a }
procedure twice(k : int 0 .. 3) { n := k * 4 }
procedure local_ { local k : int 0 .. 3 := a }
procedure both(k : int 0 .. 9) { out := k }
extern procedure seen writes late python "m:seen" c "seen"
procedure begin { n := a }
procedure end { shown := a }
procedure finish { shown := 9 - n }
table t {
  | line | yes   | a / b || out | procedures          |
  | one  | true  | > 0   || 1   | both(a); twice(a)   |
  | two  | false |       ||     | first               |
  | d    | DEFAULT |     ||     | both(1); both(a)    |
}
level l {
  period 40 [ms]
  preprocess begin, seen
  table t
  postprocess end, finish
}
"""
TOLD = """\
RCS417 error `late`: taking the deferred values can break invariant `apart`
    help: mend what runs there, or strengthen the invariant if that state cannot occur
    : yes = true, n = 0, r = 1.0000000000000002, late = 0, late.next = 9, shown = 0
RCS417 error `shown`: showing the safe values after a fault can break invariant `small`
    help: mend what runs there, or strengthen the invariant if that state cannot occur
    : n = 0, r = 1.0000000000000002, late = 0, shown = 0
RCS416 error `begins`: the initial values do not satisfy invariant `begins`
RCS419 warning `zero`: assumption `zero` does not hold of the initial values
    help: give a variable another initial value, or weaken the assumption
RCS406 error `never`: assumption `never` does not follow from the declared ranges and the invariants
    help: declare it `assumed` or `monitored`
    : n = 0, m = 50, r = 1.0000000000000002, late = 0, shown = 0
RCS420 note `kept`: properties `kept`, `other` are not proved here
    help: `rcsc prove` proves what a level does in its environment, cycle after cycle
RCS410 error `low + 1`: the sum can leave 64 bits
    help: narrow the declared ranges, or guard the operation with `if`
    : low = 9223372036854775807
RCS410 error `low / b`: the quotient can leave 64 bits
    help: narrow the declared ranges, or guard the operation with `if`
    : b = -1, low = -9223372036854775808
RCS411 error `b`: the divisor can be zero
    help: guard the division with `if`, or exclude zero from the divisor's range
    : b = 0, low = -9223372036854775808
RCS410 error `low mod b`: the quotient can leave 64 bits
    help: narrow the declared ranges, or guard the operation with `if`
    : b = -1, low = -9223372036854775808
RCS411 error `b`: the divisor can be zero
    help: guard the division with `if`, or exclude zero from the divisor's range
    : b = 0, low = -9223372036854775808
RCS410 error `wide`: this value can lie outside the 64 bits in which it is used
    help: narrow the declared ranges, or guard the operation with `if`
    : wide = 9223372036854775808
RCS410 error `int(x * 1.0e18)`: the whole number can leave 64 bits
    help: narrow the declared ranges, or guard the operation with `if`
    : x = 18.446744073709553
RCS413 error `int(x * 1.0e18)`: the value can lie outside -100 .. 100, the range of `m`
    help: guard the assignment with `if`, use `min` or `max`, or widen the variable's range
    : x = 1.01e-16
RCS412 error `a`: the index can lie outside 0 .. 3
    help: guard the access with `if`, or narrow the index's range
    : a = 4
RCS413 error `a + 1`: the value can lie outside 0 .. 9, the range of `xs`
    help: guard the assignment with `if`, use `min` or `max`, or widen the variable's range
    : a = 9
RCS412 error `a + b`: the index can lie outside 0 .. 3
    help: guard the access with `if`, or narrow the index's range
    : a = 0, b = -5
RCS413 error `x * 2.0`: the value can lie outside 0.0 .. 500.0, the range of `r`
    help: guard the assignment with `if`, use `min` or `max`, or widen the variable's range
    : x = 250.00000000000003
RCS414 error `k`: `k` can be read before it is assigned
    help: give the local a first value where it is declared
    : yes = false
RCS414 error `j`: `j` can be read before it is assigned
    help: give the local a first value where it is declared
RCS413 error `a`: the value can lie outside 0 .. 3, the range of `k`
    help: guard the assignment with `if`, use `min` or `max`, or widen the variable's range
    : a = 4
RCS411 error `b`: the divisor can be zero
    in a condition of table `t`
    help: guard the division with `if`, or exclude zero from the divisor's range
    t: b = 0, n = 0, r = 1.0000000000000002, late = 0, shown = 0
RCS415 error `both(a)`: `1` and `both(a)` can write different values to `out`
    in line `one` of table `t`
    help: let one action of the line write it: a procedure that does both in the order that is meant
    t: a = 2, b = 1, yes = true, n = 0, r = 1.0000000000000002, late = 0, shown = 0
RCS417 error `two`: line `two` of table `t` can break invariant `apart`
    in line `two` of table `t`
    help: mend what runs there, or strengthen the invariant if that state cannot occur
    t: a = 5, yes = false, n = 0, r = 1.0000000000000002, late = 8, shown = 0
RCS417 error `two`: line `two` of table `t` can break invariant `small`
    in line `two` of table `t`
    help: mend what runs there, or strengthen the invariant if that state cannot occur
    t: a = 6, yes = false, n = 0, r = 1.0000000000000002, late = 0, shown = 0
RCS415 error `both(a)`: `both(1)` and `both(a)` can write different values to `out`
    in line `d` of table `t`
    help: let one action of the line write it: a procedure that does both in the order that is meant
    t: a = 0, b = -5, yes = true, n = 0, r = 1.0000000000000002, late = 0, shown = 0
RCS417 error `l`: what runs in `postprocess` of level `l` can break invariant `small`
    in `postprocess` of level `l`
    help: mend what runs there, or strengthen the invariant if that state cannot occur
    : n = 0, r = 1.0000000000000002, late = 0, shown = 0
RCS417 error `l`: what runs in `preprocess` of level `l`, where `seen` fails, can break invariant `apart`
    in `preprocess` of level `l`
    help: mend what runs there, or strengthen the invariant if that state cannot occur
    : a = 5, n = 0, r = 1.0000000000000002, late = 8, shown = 0, late from seen!1 = 0
    : a = 0, n = 0, r = 1.0000000000000002, late = 0, shown = 0, late from seen!1 = 9
RCS417 error `l`: what runs in `preprocess` of level `l`, where `seen` fails, can break invariant `small`
    in `preprocess` of level `l`
    help: mend what runs there, or strengthen the invariant if that state cannot occur
    : a = 6, n = 0, r = 1.0000000000000002, late = 0, shown = 0, late from seen!1 = 0
"""


def told(text: str, found: Diagnostic) -> list[str]:
    """A finding as lines: the place as it is written, what is noted and what may help, and each witness with its table."""
    span = found.primary.span
    witnesses = [
        f"{one.table}: {', '.join(f'{name} = {value}' for name, value in zip(one.variables, one.values, strict=True))}"
        for one in found.witnesses
    ]
    first = f"{found.code.value} {found.severity.value} `{text[span.start : span.end]}`: {found.message}"
    return [
        first,
        *(f"    {line}" for line in (*found.notes, *(f"help: {one}" for one in found.help), *witnesses)),
    ]


def test_every_kind_of_fault_is_told_word_for_word() -> None:
    found = prove_program(program_of(FAULTY), Options(solver="boxes")).findings
    assert [line for finding in found for line in told(FAULTY, finding)] == TOLD.splitlines()


# --- what nobody could tell ---------------------------------------------------------------

PRODUCTS = """
input a : int 0 .. 1000000
input b : int 0 .. 1000000
input c : int 0 .. 1000000
{assume}table t {assuming} {{
  | line | when                               ||
  | one  | a * b * c /= 999999999989 or a < 9 ||
  | two  | a * b * c = 999999999989 and a > 9 ||
{more}}}
"""


def verdict(more: str, assume: str) -> TableVerdict:
    text = PRODUCTS.format(more=more, assume=assume, assuming="assuming it" if assume else "")
    [found] = prove_program(program_of(text), Options(steps=1)).tables
    return found


@pytest.mark.parametrize(
    ("more", "assume", "words"),
    [
        ("", "", ["whether line `two` can match", "1 region of the input space"]),
        ("| d | DEFAULT ||\n", "", ["what no line matches", "whether line `two` can match"]),
        ("", "assume it assumed : a * b > 7 and a * b < 11\n", ["its assumptions"]),
    ],
)
def test_what_is_undecided_is_told_word_for_word(more: str, assume: str, words: list[str]) -> None:
    found = verdict(more, assume)
    assert [undecided.what for undecided in found.findings if isinstance(undecided, Undecided)] == words


def test_assumptions_that_nobody_could_tell_of_are_told_word_for_word() -> None:
    text = PRODUCTS.format(
        more="", assume="assume it assumed : a * b > 7 and a * b < 11\n", assuming="assuming it"
    )
    program = program_of(text)
    assert prove_table(program, program.tables[0], Options(steps=1)).findings == (
        Undecided("the assumptions"),
    )


def test_what_z3_does_not_confirm_is_told_word_for_word() -> None:
    text = "input a : bool\ntable t {\n| line | a ||\n| x | true ||\n| y | false ||\n}\n"
    [found] = prove_program(program_of(text), Options(solver="both", steps=1)).tables
    assert found.findings == (Undecided("Z3 gave no answer within its limits"),)
    assert not found.backing.confirmed_by_z3


def test_boxes_alone_are_asked_where_it_is_wanted() -> None:
    text = "input a : bool\ntable t {\n| line | a ||\n| x | true ||\n| y | false ||\n}\n"
    program = program_of(text)
    found = prove_table(program, program.tables[0], Options(solver="boxes"))
    assert (found.findings, found.backing) == ((), Backing("boxes", confirmed_by_z3=False))


def test_z3_sees_two_lines_meet_wherever_they_stand() -> None:
    """Here the last two do: were none found, it would object."""
    text = "input a : int 0 .. 9\ntable t {\n| line | a ||\n| x | < 3 ||\n| y | 3 .. 6 ||\n| z | >= 6 ||\n}\n"
    program = program_of(text)
    table, options = program.tables[0], Options(solver="both")
    assert confirm(program, table, (), options) is Agreement.DISAGREES
    found = prove_table(program, table, options)
    assert [type(one) for one in found.findings] == [Overlap]
    assert found.backing.confirmed_by_z3


def test_a_table_with_a_condition_that_is_not_defined_is_left_open_at_no_cost() -> None:
    text = "input a : int 0 .. 9\ntable t {\n| line | 9 / a ||\n| x | > 2 ||\n| y | <= 2 ||\n}\n"
    [found] = prove_program(program_of(text), Options()).tables
    assert found.findings == (Undecided("a condition is not defined for every input"),)
    assert (found.backing.method, found.backing.confirmed_by_z3, found.seconds) == ("none", False, 0.0)


def test_one_property_is_told_as_one() -> None:
    program = program_of("state n : int 0 .. 9\nproperty kept : n <= 9\n")
    [told_] = properties_elsewhere(program)
    assert told_.message == "property `kept` is not proved here"


def test_what_ends_a_proof_is_told_word_for_word(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        message = "no room"
        raise MemoryError(message)

    monkeypatch.setattr(proving, "prove_table", full)
    text = "input a : bool\ntable t {\n| line | a ||\n| x | true ||\n| y | false ||\n}\n"
    [found] = prove_program(program_of(text), Options()).tables
    assert found.findings == (Undecided("MemoryError: no room"),)
    with smt.until(lambda: True):
        [found] = prove_program(program_of(text), Options()).tables
    assert found.findings == (Undecided("nobody waits for the answer"),)


def test_what_the_clock_cut_short_is_told_word_for_word(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = iter(range(100))
    monkeypatch.setattr(smt, "cut_short", lambda: next(ended))
    text = "input a : bool\ntable t {\n| line | a ||\n| x | true ||\n| y | false ||\n}\n"
    [found] = prove_program(program_of(text), Options()).tables
    assert found.findings == (Undecided("a question to the solver took more processor time than it may"),)
    assert found.certificate is None


@pytest.mark.parametrize("many", [19, 20, 21])
def test_the_first_twenty_overlaps_are_told_with_their_regions(many: int) -> None:
    """Of tables with conditions across variables; lines `x - y < 1` and so on all match where y is large."""
    lines = "".join(f"| l{at} | x + y = {at} ||\n| m{at} | x + y = {at} ||\n" for at in range(many))
    text = f"input x : int 0 .. 50\ninput y : int 0 .. 50\ntable t {{\n| line | when ||\n{lines}| d | DEFAULT ||\n}}\n"
    [found] = prove_program(program_of(text), Options(solver="boxes")).tables
    regions = [overlap.region is not None for overlap in found.findings if isinstance(overlap, Overlap)]
    assert regions == [True] * min(many, 20) + [False] * max(0, many - 20)


def test_a_tree_has_a_budget_of_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    budgets: list[int] = []

    def tree(*given: Any, **more: Any) -> Tree:
        made = Tree(*given, **more)
        budgets.append(made.budget)
        return made

    monkeypatch.setattr(relational, "Tree", tree)
    text = "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n| a | x < y ||\n| b | x >= y ||\n}\n"
    assert prove_program(program_of(text), Options()).proved is not None
    assert budgets == [splitting.FEWEST_NODES + 2 * splitting.NODES_OF_A_LINE]


def test_what_the_solver_does_not_answer_is_left_open() -> None:
    program = program_of(
        "input a : int 0 .. 1000000\ninput b : int 0 .. 1000000\nstate s : int 0 .. 9\n"
        "procedure p { if a > 2 and b > 2 and a * b = 999999999989 { s := a mod 100 } }\n"
    )
    run = Run({}, {v.name: v.type for v in program.variables}, {})
    run.execute(program.procedures[0].body)
    asker = Asker(Options(steps=1), {})
    left = asker.unshown(run.obligations, list, lambda _: True)
    assert [(one.outcome, one.witness) for one in left] == [(Discharge.OPEN, ())] * len(run.obligations)
    assert left
    assert not asker.all_hold(run.obligations, list)


def test_a_line_that_breaks_an_invariant_where_its_extern_fails_is_told_so() -> None:
    text = (
        "input a : int 0 .. 9\nstate n : int 0 .. 9\nstate late : int 0 .. 9\ninvariant few : n <= 5\n"
        'extern procedure seen writes late python "m:seen" c "seen"\n'
        "procedure over { n := 9 }\nprocedure back { n := 0 }\n"
        "table t {\n| line | a || procedures |\n| one | < 5 || over; seen; back |\n| two | >= 5 || |\n}\n"
    )
    found = prove_program(program_of(text), Options(solver="boxes")).findings
    said = "line `one` of table `t`, where `seen` fails, can break invariant `few`"
    assert [finding.message for finding in found] == [said]


def test_z3_finds_the_overlap_of_two_lines_of_which_a_third_is_apart() -> None:
    text = "input a : int 0 .. 9\ntable t {\n| line | a ||\n| x | < 5 ||\n| y | 4 .. 7 ||\n| z | > 7 ||\n}\n"
    [found] = prove_program(program_of(text), Options(solver="both")).tables
    assert [type(one) for one in found.findings] == [Overlap]
    assert found.backing.confirmed_by_z3


MANY = """\
enum st { a, b, c, d, e, f, g, h }
input s : st
input x : int 0 .. 100
input y : bool
table t {
  | line | s         | x      | y     ||
  |------|-----------|--------|-------||
  | l1   | a         | < 50   | true  ||
  | l2   | b         | < 50   |       ||
  | l3   | c         | > 10   | false ||
  | l5   | e         |        | true  ||
  | l6   | g         |        | true  ||
  | l7   | h         | 4 .. 9 |       ||
}
"""


def test_every_region_of_a_gap_is_told_and_how_they_lie_over_an_enumeration() -> None:
    [gap] = reported(MANY, Options())
    assert gap.message == "no line of table `t` matches 1,162 of 1,616 (71.9 %) of the inputs"
    assert gap.more == 0
    assert sum(witness.inputs or 0 for witness in gap.witnesses) == 1162, (
        "the regions are the gap, and part it"
    )
    [note] = gap.notes
    assert note.startswith("by `s`: `d` all, `f` all, `h` 94.1 %, ")
    text = plain(full(gap, {"case.rcs": Source("case.rcs", MANY)}))
    assert text.count("region:") == 3
    assert "and 551 more inputs in 4 more regions, which --json lists" in text


def test_what_falls_to_default_is_told_by_its_first_regions() -> None:
    """It is no mistake, and every table with a DEFAULT has it."""
    text = MANY.replace("  | l7   | h ", "  | rest | DEFAULT | | ||\n  | l7   | h ")
    [falls] = reported(text, Options())
    assert (falls.code, len(falls.witnesses), falls.notes) == (Code.DEFAULT_COVERS, 3, ())
    assert falls.more == 1162 - sum(witness.inputs or 0 for witness in falls.witnesses)


def test_every_pair_of_lines_that_overlap_is_listed() -> None:
    rows = "".join(f"  | l{at} | >= {at} ||\n" for at in range(12))
    text = f"input x : int 0 .. 100\ntable t {{\n  | line | x ||\n{rows}}}\n"
    every = reported(text, Options())
    [last] = [each for each in every if each.only_listed]
    shown = [each for each in every if not each.only_listed]
    assert len(shown) == 20
    assert last.message == "and 46 more pairs of lines of table `t` overlap"
    pairs = {tuple(line.name for line in each.witnesses[0].lines) for each in shown}
    pairs |= {tuple(line.name for line in witness.lines) for witness in last.witnesses}
    assert len(pairs) == 12 * 11 // 2
    assert last.notes[0].startswith("which lines overlap with the most others: `l0` with 11, ")
    assert "witness" not in plain(full(last, {"case.rcs": Source("case.rcs", text)})).replace(
        "its witness", ""
    )


@pytest.mark.parametrize(
    ("assumed", "region"),
    [
        ("x + y <= 12 and x >= 2", ("x in 2 .. 6", "y in 6 .. 10")),
        ("x = y", ("x >= 6", "y >= 6")),
        ("x + y <= 30", ("y >= 6",)),
    ],
)
def test_a_region_ends_at_values_that_the_assumptions_allow(assumed: str, region: tuple[str, ...]) -> None:
    text = f"input x : int 0 .. 20\ninput y : int 0 .. 20\nassume a monitored : {assumed}\n"
    text += "table t assuming a {\n  | line | y    ||\n  | low  | <= 5 ||\n}\n"
    [gap] = [each for each in reported(text, Options()) if each.code is Code.GAP]
    assert gap.witnesses[0].region == region
