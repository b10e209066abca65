"""What is told of texts that are right but for a word or an order: where, what, and what to write.

Somebody writes as in another language, or puts something right in a wrong place; a cell reads what an earlier cell of its line wrote; a
variable starts with what nobody wrote.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.lang.interpret import initial, run_table
from rcsc.lang.model import Program
from rcsc.lang.resolve import compile_text
from rcsc.lang.syntax.expected import (
    ASSIGNS,
    ELSEWHERE,
    PARTS_CALLS,
    STATES,
    operator_meant,
    word_meant,
)
from rcsc.lang.syntax.rows import LAST_BAR, NO_LAST_BAR
from tests.support.programs.stages import program_of, refused, reported
from tests.support.programs.texts import table

# --- as in another language, or in a wrong place ---

WHEN = "a whole condition stands in a column headed `when`"
HEAD = """enum stage { idle, moving }
input now : stage
input far : int 0 .. 9
input ready : bool
output speed : int 0 .. 9
output go : bool
procedure fail(why : int 0 .. 9) { speed := why }
"""


def shown(text: str) -> tuple[Diagnostic, str]:
    """The only thing that is reported of a text, and the text that it points at."""
    [found] = refused(text)
    span = found.primary.span
    return found, text[span.start : span.end]


@pytest.mark.parametrize(("operator", "ours"), ELSEWHERE.items())
def test_an_operator_of_another_language_is_named_with_ours(operator: str, ours: str) -> None:
    alone = operator in {"!", "~"}
    condition = f"{operator} ready" if alone else f"far {operator} 3"
    found, at = shown(f"{HEAD}invariant one : {condition}\n")
    assert (found.message, at, found.help) == (
        f"there is no operator `{operator}`",
        operator,
        (f"write `{ours}`",),
    )


@pytest.mark.parametrize(
    ("heading", "cell"),
    [("far", "== 3"), ("far", "!= 3"), ("when", "ready && far > 3"), ("when", "!ready")],
)
def test_in_a_cell_too(heading: str, cell: str) -> None:
    found, at = shown(HEAD + table("t", f"line | {heading} || go", f"a | {cell} || true"))
    assert at in cell
    assert found.help == (f"write `{ELSEWHERE[at]}`",)


@given(st.text("=!<>&|-%~ ab", max_size=12), st.integers(0, 11))
def test_the_operator_meant_covers_the_place_and_is_the_longest_there(text: str, at: int) -> None:
    covering = {
        operator
        for operator in ELSEWHERE
        for begin in range(len(text))
        if text.startswith(operator, begin) and begin <= at < begin + len(operator)
    }
    meant = operator_meant(text, at)
    assert (meant is None) == (not covering)
    if meant is not None:
        begin, operator = meant
        assert text.startswith(operator, begin)
        assert begin <= at < begin + len(operator)
        assert len(operator) == max(map(len, covering))


@pytest.mark.parametrize(
    ("text", "at", "meant"),
    [
        ("Table t {\n| line | far || go |\n| a | || true |\n}\n", "Table", "table"),
        ("tabel t {\n| line | far || go |\n| a | || true |\n}\n", "tabel", "table"),
        ("STATE x : bool\n", "STATE", "state"),
        ("imput x : bool\n", "imput", "input"),
        ("input x : int 0 .. 9 Clamp\n", "Clamp", "clamp"),
        ("level l { Period 40 [ms] table t }\n", "Period", "period"),
        ("Quokka x : bool\n", "Quokka", ""),
        ("input column column : bool\n", "column", ""),
    ],
)
def test_a_word_in_the_wrong_case_or_misspelled_is_named(text: str, at: str, meant: str) -> None:
    found, place = shown(HEAD + text)
    assert place == at
    assert found.help == ((f"did you mean `{meant}`?",) if meant else ())


@pytest.mark.parametrize(
    ("text", "at", "help_"),
    [
        ("procedure p { speed = 3 }", "=", ASSIGNS),
        ("procedure p { next now = idle }", "=", ASSIGNS),
        ("procedure p { local n : int 0 .. 5 = 3 }", "=", ASSIGNS),
        (table("t", "line | ready || procedures", "a | true || speed = 3"), "=", ASSIGNS),
        ("const c := 3", ":=", STATES),
        ("procedure p { speed := 3, go := true }", ",", PARTS_CALLS),
        (table("t", "line | ready || procedures", "a | true || fail(1), fail(2)"), ",", PARTS_CALLS),
        (table("t", "line | ready || procedures", "a | true || go := true, fail(2)"), ",", PARTS_CALLS),
    ],
)
def test_a_sign_written_for_another_is_told_with_the_right_one(text: str, at: str, help_: str) -> None:
    found, there = shown(HEAD + text)
    assert (there, found.help) == (at, (help_,))


ROWS = "| line | ready || speed | go |\n|------|-------||-------|----|\n"


@pytest.mark.parametrize(
    "row", ["| a | true || 3 | true", "| a | true || 3 | true  # said aside |", "| a || 3"]
)
def test_a_row_without_its_last_bar_is_refused_at_its_end(row: str) -> None:
    found, at = shown(f"{HEAD}table t {{\n{ROWS}{row}\n}}\n")
    assert (found.code, found.message, found.help) == (Code.RAGGED_ROW, NO_LAST_BAR, (LAST_BAR,))
    said = row.partition("#")[0].rstrip()
    assert (at, found.primary.span.end) == (said[-1], len(f"{HEAD}table t {{\n{ROWS}{said}"))


def test_a_row_that_ends_before_the_last_column_names_the_next() -> None:
    found, _ = shown(f"{HEAD}table t {{\n{ROWS}| a | true || 3 |\n}}\n")
    assert found.message == "this row has 1 cells of actions, the heading 2"
    assert found.help[-1] == "nothing stands below `go`: a row ends with `|` after its last cell, be it empty"


# --- units ---

GAPS = "input gap : int 0 .. 110 [mm]\ninput held : int 0 .. 60 [s]\noutput go : bool\n"


@pytest.mark.parametrize(
    ("text", "unit", "help_"),
    [
        ("assume a : gap < 2 [cm]", "cm", "write it in `mm`: `2 [cm]` is `20 [mm]`"),
        ("const far = 50 [cm]\nassume a : gap < far", "cm", "write it in `mm`: `50 [cm]` is `500 [mm]`"),
        ("const far = 2 [km]\n", "km", "write it in `m`: `2 [km]` is `2000 [m]`"),
        ("const slow = 2 [min]\nassume a : held < slow", "min", "write it in `s`: `2 [min]` is `120 [s]`"),
        ("state w : int 0 .. 11 [cm]\nprocedure p { w := gap }", "cm", "write it in `mm`: 1 cm is 10 mm"),
        (
            table("t", "line | gap || go", "a | > 3 [cm] || true"),
            "cm",
            "write it in `mm`: `3 [cm]` is `30 [mm]`",
        ),
    ],
)
def test_a_unit_that_is_none_is_told_once_with_how_to_write_it(text: str, unit: str, help_: str) -> None:
    found, at = shown(GAPS + text)
    assert (found.message, at) == (f"`{unit}` is not a unit", unit)
    assert found.help == (f"{help_}; or declare it: `unit {unit}`, which nothing converts",)


def test_a_unit_that_is_like_none_is_declared() -> None:
    found, _ = shown(f"{GAPS}const far = 5 [furlong]")
    assert found.help == ("declare it: `unit furlong`",)


@pytest.mark.parametrize(
    ("limit", "help_"),
    [
        ("2 [m]", ("units are never converted: write one side in the other, 1 m is 1000 mm",)),
        ("2 [s]", ()),
    ],
)
def test_two_units_of_one_quantity_say_what_one_is_in_the_other(limit: str, help_: tuple[str, ...]) -> None:
    found, _ = shown(f"{GAPS}assume a : gap < {limit}")
    assert found.help == help_


# --- names ---


def test_a_name_is_no_word_of_the_language() -> None:
    assert word_meant("tablet", {"TABLE", "NAME"}) == "table"
    assert not word_meant("quite", {"TABLE", "NAME"})
    assert not word_meant("{", {"LBRACE", "TABLE"})


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("| a | true || 3 || 1 | true |", "a row has exactly one `||`, this one has 2"),
        ("| a |||| 1 | true |", "a row has exactly one `||`, this one has 2"),
        ("| a | true | 3 | 1 | true |", "a row needs `||` between its conditions and its actions"),
        ("| a || 3 | true | 1 |", "this row has 0 cells of conditions, the heading 2"),
    ],
)
def test_two_bars_are_no_empty_cell(row: str, said: str) -> None:
    found, _ = shown(f"{HEAD}table t {{\n| line | ready | far || speed | go |\n{row}\n}}\n")
    if "conditions, the heading" in said:
        assert "cells of conditions" in found.message or "cell of conditions" in found.message
    else:
        assert found.message == said
    [help_] = found.help
    assert "an empty cell is `| |`" in help_


@pytest.mark.parametrize(
    ("heading", "cell", "message", "help_"),
    [
        ("now", "far > 3", "column `now` is `stage`, this cell is an expression, which is bool", WHEN),
        ("far", "idle", "column `far` is int, this cell is `idle`, which is `stage`", None),
        ("abs(far)", "ready", "column `abs(far)` is int, this cell is `ready`, which is bool", WHEN),
        ("far", "> 2.5", "column `far` is int, this cell is `2.5`, which is real", "convert with `real(n)` or `int(x)`"),
    ],
)  # fmt: skip
def test_a_cell_of_another_kind_than_its_column_says_both(
    heading: str, cell: str, message: str, help_: str | None
) -> None:
    found, at = shown(HEAD + table("t", f"line | {heading} || go", f"a | {cell} || true"))
    assert (found.code.value, found.message, at) == ("RCS301", message, cell)
    assert found.help == (() if help_ is None else (help_,))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("moving", "`speed` is int, this is `moving`, which is `stage`"),
        ("ready", "`speed` is int, this is `ready`, which is bool"),
        ("far > 3", "`speed` is int, this is an expression, which is bool"),
    ],
)
def test_a_value_of_another_kind_than_its_variable_says_both(value: str, message: str) -> None:
    for text in (
        table("t", "line | far || speed", f"a | || {value}"),
        f"procedure p {{ speed := {value} }}\n",
    ):
        found, at = shown(HEAD + text)
        assert (found.message, at) == (message, value)


@pytest.mark.parametrize("cell", ["fail", "fail(3)", "speed := 3"])
def test_an_action_in_a_column_of_values_is_told_where_it_stands(cell: str) -> None:
    found, _ = shown(HEAD + table("t", "line | far || speed", f"a | || {cell}"))
    [help_] = found.help
    assert help_.endswith("stands under `procedures`, `command_out` or `status_out`")


@pytest.mark.parametrize(("condition", "sides"), [
    ("far = idle", "the left side is `far`, which is int; the right side is `idle`, which is `stage`"),
    ("now = true", "the left side is `now`, which is `stage`; the right side is `true`, which is bool"),
    ("far + 1 > 2.5", "the left side is an expression, which is int; the right side is `2.5`, which is real"),
])  # fmt: skip
def test_a_comparison_says_which_side_is_what(condition: str, sides: str) -> None:
    found, _ = shown(f"{HEAD}assume one : {condition}\n")
    assert found.message == sides


@pytest.mark.parametrize(
    ("member", "help_"),
    [
        ("moving", "hides the type of that name: write `moving` alone, or call the variable otherwise"),
        ("movin", "hides the type of that name: call the variable otherwise"),
    ],
)
def test_a_variable_that_hides_its_type_is_told(member: str, help_: str) -> None:
    text = f"enum stage {{ idle, moving }}\nstate stage : stage\ninvariant i : stage = stage.{member}\n"
    (found,) = refused(text)
    assert found.message == "`stage` has no fields"
    assert [each.endswith(help_) for each in found.help] == [True]
    program_of(text.replace(f"stage.{member}", "moving"))
    program_of(
        text.replace(f"stage.{member}", "stage.moving")
        .replace("state stage", "state now")
        .replace(": stage =", ": now =")
    )


# --- a cell that reads what an earlier cell wrote: two spellings that mean what they say ---

SEQUENCE = """
enum order { rest, reach }
enum status { done, executing, failed }
link below {
  command : order rest rest
  status : status done done failed failed executing executing
  order { far : int 0 .. 9 }
}
commands arm : below
record pair { a : int 0 .. 9  b : int 0 .. 9 }
input i : int 0 .. 2
state n : int 0 .. 9
state m : int 0 .. 9
state p : pair
state q : pair
state xs : array[3] of int 0 .. 9
state x : int 0 .. 9 deferred until true
output o : int 0 .. 9
procedure put(v : int 0 .. 9) { m := v }
procedure bump { n := min(n + 1, 9) }
procedure deeper { bump }
procedure copy { m := n }
"""


def in_order(headings: str, cells: str) -> str:
    """A program with one line."""
    dashes = "|".join("-" for _ in headings.split("|"))
    return f"{SEQUENCE}table t {{\n| line | when || {headings} |\n|-|-||{dashes}|\n| only | true || {cells} |\n}}\n"


TOLD = {
    "a value": ("n | m", "i | n", "n"),
    "part of a value": ("n | m", "i | max(n, 3)", "n"),
    "an argument": ("n | procedures", "i | put(n)", "n"),
    "an assignment": ("n | procedures", "i | m := n", "n"),
    "what a call wrote": ("procedures | m", "bump | n", "n"),
    "what a call of a call wrote": ("procedures | m", "deeper | n", "n"),
    "an index": ("n | m", "i | xs[n mod 3]", "n"),
    "the place": ("n | procedures", "i | xs[n mod 3] := 1", "n"),
    "an element": ("procedures | m", "xs[i] := 1 | xs[2]", "xs[2]"),
    "some element": ("procedures | m", "xs[1] := 1 | xs[i]", "xs[1]"),
    "a member": ("p.a | m", "i | p.a", "p.a"),
    "a record": ("p.b | q", "i | p", "p.b"),
    "an output": ("o | m", "i | o", "o"),
    "an order": ("n | arm", "i | reach(far := n)", "n"),
    "over a cell between": ("n | o | m", "i | 3 | n", "n"),
    "status": ("status_out | command_out", "n := i | put(n)", "n"),
}


@pytest.mark.parametrize("case", TOLD)
def test_a_cell_that_reads_what_an_earlier_one_wrote_is_told(case: str) -> None:
    headings, cells, name = TOLD[case]
    text = in_order(headings, cells)
    found = refused(text)
    assert [each.code for each in found] == [Code.READ_AFTER_WRITE], found
    assert f"reads `{name}`" in found[0].message
    where = found[0].primary.span
    assert text[where.start : where.end].strip() in cells
    assert found[0].related[0].span.start < where.start


FINE = {
    "before it is written": ("m | n", "n | i"),
    "in one cell": ("procedures", "n := i; m := n"),
    "by a procedure": ("n | procedures", "i | copy"),
    "another element": ("procedures | m", "xs[1] := 1 | xs[2]"),
    "another member": ("p.a | m", "i | p.b"),
    "its own": ("n", "min(n + 1, 9)"),
    "what is next": ("procedures | m", "next x := i | x"),
    "as it is": ("n | m", "n | n"),
    "written anew in the cell": ("n | procedures", "i | n := 1; m := n"),
}


@pytest.mark.parametrize("case", FINE)
def test_what_says_its_order_is_fine(case: str) -> None:
    program_of(in_order(*FINE[case]))


def after(headings: str, cells: str) -> tuple[int, int]:
    """What `n` and `m` are after the line, `n` was 5."""
    program = program_of(in_order(headings, cells))
    then = run_table(program, program.tables[0], {**initial(program), "n": 5}).snapshot
    return int(then["n"]), int(then["m"])


def test_both_spellings_of_the_help_mean_what_they_say() -> None:
    old, new = refused(in_order("n | m", "2 | n"))[0].help
    assert old == "to mean the value before the line, let column `m` stand left of column `n`"
    assert new == "to mean the new value, write both in one cell under `procedures`: `n := 2; m := n`"
    assert after("m | n", "n | 2") == (2, 5)
    assert after("procedures", "n := 2; m := n") == (2, 2)


def test_what_is_exchanged_needs_a_local() -> None:
    assert "keeps one of them in a local" in refused(in_order("n | m", "m | n"))[0].help[0]
    assert "a procedure that does both" in refused(in_order("n | arm", "2 | reach(far := n)"))[0].help[1]


# --- with what a variable starts: what is written, its safe value, 0, or what is nearest to 0 ---

TEXT = """
enum light { red, green }
type offset = real -2.0 .. 5.0
record tool { on : bool safe true  n : int 0 .. 9 safe 3  m : int 0 .. 9 = 1 safe 5 }
record pair { a : int -9 .. 9  b : int 3 .. 9 = 4  c : array[2] of int -9 .. 9 = -1  d : offset }
input seen : int -5 .. 5
input of_pair : pair
output speed : int -400 .. 400 safe 7
output own : int -400 .. 400 = 2 safe 7
output shown : light safe green
output lamp : bool safe true
output tools : array[1] of tool
input of_tool : tool
state n : int -9 .. 9 restart 3
state x : offset
state s : single -2.5 .. 1.5
state cells : array[2] of int 2 .. 9 = 5
state pairs : array[1] of pair
state later : int -9 .. 9 deferred until true
property moves : n >= was n
"""
STARTS = {
    "seen": 0,
    "of_pair.a": 0,
    "of_pair.b": 4,
    "of_pair.c[0]": -1,
    "of_pair.c[1]": -1,
    "of_pair.d": 0.0,
    "speed": 7,
    "own": 2,
    "shown": 1,
    "lamp": True,
    "tools[0].on": True,
    "tools[0].n": 3,
    "tools[0].m": 1,
    "of_tool.on": False,
    "of_tool.n": 0,
    "of_tool.m": 1,
    "n": 0,
    "x": 0.0,
    "s": 0.0,
    "cells[0]": 5,
    "cells[1]": 5,
    "pairs[0].a": 0,
    "pairs[0].b": 4,
    "pairs[0].c[0]": -1,
    "pairs[0].c[1]": -1,
    "pairs[0].d": 0.0,
    "later": 0,
    "later.next": 0,
}


def test_what_starts_with_what() -> None:
    program = compile_text(TEXT)
    assert isinstance(program, Program), program
    assert {str(name): value for name, value in initial(program).items()} == STARTS
    unset = {str(v.name).partition(".")[0].partition("[")[0] for v in program.variables if not v.given}
    assert unset == {"seen", "of_pair", "of_tool", "n", "x", "s", "pairs", "later"}
    meant = {str(v.name) for v in program.variables if v.given}
    assert "pairs[0].b" in meant
    assert "of_pair.b" in meant


@pytest.mark.parametrize(
    ("text", "message", "help_"),
    [
        (
            "state n : int 1 .. 9",
            "`n` has no declared start value: 0 is not in 1 .. 9, so it starts with 1",
            "its type, such as `= 1`",
        ),
        ("input n : int -9 .. -2 [mm] clamp", "0 is not in -9 .. -2, so it starts with -2", "such as `= -2`"),
        ("output x : single 0.5 .. 1.5", "0 is not in 0.5 .. 1.5, so it starts with 0.5", "such as `= 0.5`"),
        (
            "state a : array[300] of int 1 .. 2",
            "`a[0]` has no declared start value: 0 is not in 1 .. 2",
            "after its type, such",
        ),
        (
            "record r { f : array[2] of real -2.0 .. -1.0 } state a : array[2] of r",
            "`a[0].f[0]` has no declared start value: 0 is not in -2.0 .. -1.0",
            "after the type of field `f`, such as `= -1.0`",
        ),
    ],
)
def test_where_nothing_says_it_a_warning_does(text: str, message: str, help_: str) -> None:
    found = [each for each in reported(text) if each.code is Code.NO_START]
    assert [each.severity for each in found] == [Severity.WARNING]
    assert message in found[0].message
    assert help_ in found[0].help[0]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("record r { f : int 1 .. 3 = 4 }", Code.OUT_OF_RANGE_CONSTANT),
        ("record r { f : int 1 .. 3 = true }", Code.KIND),
        ("record r { f : int 1 .. 3 safe 4 }", Code.OUT_OF_RANGE_CONSTANT),
        ("record r { f : array[2] of bool safe true }", Code.KIND),
        ("record q { f : bool } record r { f : q = true }", Code.KIND),
        ("record q { f : bool } state r : q = true", Code.KIND),
        ("state n : int 0 .. 9 record r { f : int 1 .. 3 = n }", Code.NOT_CONSTANT),
    ],
)
def test_a_start_is_a_value_of_the_type(text: str, code: Code) -> None:
    found = compile_text(text)
    assert isinstance(found, tuple)
    assert [each.code for each in found] == [code]
