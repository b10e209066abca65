"""What is said where somebody writes as in another language, or puts something right in a wrong place: where, what, and what to write."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.lang.syntax.expected import ELSEWHERE, operator_meant, word_meant
from tests.support.programs.stages import program_of, refused
from tests.support.programs.texts import table

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
