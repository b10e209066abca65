"""Text to tree and back: round trips, errors with a place, nothing that makes the parser raise."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import lark
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Source, Span
from rcsc.lang.digest import Digests
from rcsc.lang.syntax import layout, tree
from rcsc.lang.syntax import parse as parsing
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import MOST_ERRORS, ParseNode, parse
from rcsc.lang.syntax.rows import PIECES, Side
from rcsc.lang.syntax.saved import saved
from rcsc.lang.syntax.spell import spell_expr
from rcsc.proof.solvers.options import Options
from tests.bench.made import families
from tests.support.programs.arbitrary import expressions, files, tables
from tests.support.programs.stages import program_of, reported, shipped
from tests.support.programs.texts import parted_and_broken

REPO = Path(__file__).parents[2]
SHIPPED = sorted((REPO / "tables").rglob("*.rcs"))


def errors(text: str) -> list[tuple[str, int]]:
    """Codes and lines of the diagnostics of a text."""
    source = Source("case.rcs", text)
    parsed = parse(source)
    assert not isinstance(parsed, tree.File)
    return [(d.code.value, source.position(d.primary.span.start).line) for d in parsed]


@settings(max_examples=120)
@given(files())
def test_formatted_trees_parse_to_themselves(file: tree.File) -> None:
    for width in (110, 1, 10_000):
        text = format_file(file, width)
        assert parse(Source("case.rcs", text)) == file, text
        assert format_file(file, width) == text


@settings(max_examples=120)
@given(
    st.lists(
        st.lists(st.integers(0, 99_999), min_size=1, max_size=30).map(
            lambda row: "in {" + ", ".join(map(str, row)) + "}"
        )
    )
)
def test_a_column_knows_its_rows_at_each_width_that_it_takes(texts: list[str]) -> None:
    """They are counted together with the width, once; widths between are as the next smaller."""
    column = layout._Column(["the_heading_of_it - another", *texts], is_condition=True)
    widths = [column.width]
    while (narrower := column.narrower()) is not None:
        column.width = narrower
        widths.append(narrower)
    assert column.width == column.least
    for width, above in zip(widths[1:], widths, strict=False):
        for between in {width, (width + above) // 2, above - 1}:
            assert [len(pieces) for pieces in column.pieces(between)] == column.heights(width)


def test_a_long_cell_is_filled_once_a_width(monkeypatch: pytest.MonkeyPatch) -> None:
    members = [f"m{number}" for number in range(400)]
    counted: list[int] = []
    filled = layout._filled

    def counting(atoms: list[str], width: int) -> list[str]:
        counted.append(width)
        return filled(atoms, width)

    monkeypatch.setattr(layout, "_filled", counting)
    rows = "".join(f"| n{at} | in {{{', '.join(members[at:])}}} | {at} || {at} |\n" for at in range(4))
    parsed = parse(Source("case.rcs", f"table t {{\n| line | a | b || o |\n{rows}}}\n"))
    assert isinstance(parsed, tree.File)
    assert max(map(len, format_file(parsed).splitlines())) <= layout.WIDTH
    assert len(counted) < 4 * len(set(counted)) + 100, "each of four texts, once a width"


@settings(max_examples=120)
@given(tables(), st.randoms(use_true_random=False))
def test_a_table_says_the_same_however_it_is_laid_out(table: tree.TableDecl, random: Random) -> None:
    """Parted anywhere, each cell broken at any blank: what people write, not what `rcsc fmt` would."""
    file = tree.File((table,))
    text = parted_and_broken(format_file(file, 10_000), random)
    parsed = parse(Source("case.rcs", text))
    assert isinstance(parsed, tree.File), (text, parsed)
    [again] = parsed.declarations
    assert isinstance(again, tree.TableDecl)
    assert sorted(c for row in again.rows for c in row.comments) == sorted(
        c for row in table.rows for c in row.comments
    )
    assert again == table, text


@settings(max_examples=200)
@given(expressions())
def test_expressions_keep_their_shape_without_needless_parentheses(expr: tree.Expr) -> None:
    text = spell_expr(expr)
    parsed = parse(Source("case.rcs", f"invariant i : {text}"))
    assert isinstance(parsed, tree.File), text
    [invariant] = parsed.declarations
    assert isinstance(invariant, tree.InvariantDecl)
    assert invariant.condition == expr, text


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_tables_are_formatted_and_keep_their_comments(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    parsed = parse(Source(path.name, text))
    assert isinstance(parsed, tree.File)
    assert format_file(parsed) == text


WIDE = """
enum place { left, middle, right }
input new_command : bool
input reported : place
state counted : int 0 .. 9
output told : place
procedure count { counted := min(counted + 1, 9) }
table t {
  | line | new_    | reported   || # headings
  |      | command |            ||
  |------|---------|------------||
  # the first
  | a    | true    |            || # at its end
  | b    | false   | in {left,  ||
  # inside
  |      |         | middle,    ||
  |      |         | rihgt}     ||

  | line || procedures | told  |
  |------||------------|-------|
  # its actions
  | a    || count;     | left  |
  |      || cuont      |       |
  | b    ||            | rigth |
}
"""


def test_a_finding_points_at_the_piece_and_no_comment_is_lost() -> None:
    diagnostics = reported(WIDE, Options())
    places = [WIDE[d.primary.span.start : d.primary.span.end] for d in diagnostics]
    assert sorted(places) == ["cuont", "rigth", "rihgt"]
    parsed = parse(Source("case.rcs", WIDE))
    assert isinstance(parsed, tree.File)
    table = parsed.declarations[-1]
    assert isinstance(table, tree.TableDecl)
    assert [row.comments for row in table.rows] == [
        ("headings", "the first", "at its end", "its actions"),
        ("inside",),
    ]
    assert {text for row in table.rows for text in row.comments} == {
        line.strip(" #") for text in format_file(parsed).splitlines() if "#" in text for line in [text]
    }


@pytest.mark.parametrize("width", [1, 60, 10_000])
@pytest.mark.parametrize("name", ["task/acquire", "emove/move_to_obj", "examples/approach"])
def test_the_program_is_the_same_in_every_layout(name: str, width: int, tmp_path: Path) -> None:
    """Headings, cells and actions are quoted in the same words, too."""
    copied = tmp_path / "tables"
    shutil.copytree(REPO / "tables", copied)
    path = copied / f"{name}.rcs"
    before = shipped(f"{name}.rcs", copied)
    parsed = parse(Source("case.rcs", path.read_text(encoding="utf-8")))
    assert isinstance(parsed, tree.File)
    path.write_text(format_file(parsed, width), encoding="utf-8")
    after = shipped(f"{name}.rcs", copied)
    assert after == before
    assert Digests(after).table(after.tables[0]) == Digests(before).table(before.tables[0])


def test_a_table_is_made_narrow_where_it_is_wider_than_the_limit() -> None:
    """Stacked headings first, then parts; a cell is broken at `,`, `;` and before `and`, never inside a comparison."""
    text = "table t {\n  | line | a_long_name | other ||\n  |------|-------------|-------||\n  | x | (a > 1 and b < 2) | in {c, d} ||\n}\n"
    parsed = parse(Source("case.rcs", text))
    assert isinstance(parsed, tree.File)
    assert format_file(parsed, 40).splitlines()[1:-1] == [
        "  | line | a_long_name | other     ||",
        "  |------|-------------|-----------||",
        "  | x    | (a > 1      | in {c, d} ||",
        "  |      | and b < 2)  |           ||",
    ]
    assert format_file(parsed, 26).splitlines()[1:-1] == [
        "  | line | a_long_name ||",
        "  |------|-------------||",
        "  | x    | (a > 1      ||",
        "  |      | and b < 2)  ||",
        "",
        "  | line | other     ||",
        "  |------|-----------||",
        "  | x    | in {c, d} ||",
    ]


def test_comments_go_with_what_they_stand_by() -> None:
    text = """# the file
use a # same line
## doc of x
# about x
input x : bool
procedure p {
  # before
  y := x # behind
  if x { # inside
    z := 1
  }
}
# the end
"""
    parsed = parse(Source("case.rcs", text))
    assert isinstance(parsed, tree.File)
    use, variable, procedure = parsed.declarations
    assert isinstance(use, tree.Use)
    assert use.comments == ("the file", "same line")
    assert isinstance(variable, tree.VariableDecl)
    assert variable.doc == ("doc of x",)
    assert variable.comments == ("about x",)
    assert isinstance(procedure, tree.ProcedureDecl)
    assert [statement.comments for statement in procedure.body] == [("before", "behind"), ("inside",)]
    assert parsed.trailing == ("the end",)


@pytest.mark.parametrize(
    ("written", "kept"),
    [
        ("a or (b xor (c and d))", "a or b xor c and d"),
        ("((a xor b) xor c) implies d", "a xor b xor c implies d"),
        ("a xor (b xor c)", "a xor (b xor c)"),
        ("(a or b) xor not (c = d)", "(a or b) xor not c = d"),
        ("(a xor b) and (a implies b)", "(a xor b) and (a implies b)"),
    ],
)
def test_how_tightly_truth_functions_bind(written: str, kept: str) -> None:
    """Without parentheses where none are needed the expression is still the same."""
    found = [parse(Source("case.rcs", f"const c = {text}\n")) for text in (written, kept)]
    values = [file.declarations[0].value for file in found if isinstance(file, tree.File)]  # type: ignore[union-attr]
    assert values[0] == values[1]
    assert spell_expr(values[0]) == kept


def test_cell_spans_point_into_the_file() -> None:
    text = "input x : int 0 .. 9\ntable t {\n  | line | x   ||\n  | a    | <= 4 ||\n}\n"
    parsed = parse(Source("case.rcs", text))
    assert isinstance(parsed, tree.File)
    table = parsed.declarations[1]
    assert isinstance(table, tree.TableDecl)
    [row] = table.rows
    assert text[row.cells[1].span.start : row.cells[1].span.end] == "<= 4"
    assert tree.absolute(Span("", 3, 4), row.cells[1]) == Span(
        "case.rcs", text.index("4 ||"), text.index("4 ||") + 1
    )


def test_a_range_in_a_cell_may_be_written_as_in_an_expression() -> None:
    text = "table t {{\n  | line | x | when ||\n  | a    | {} | x in 2 .. 5 ||\n}}\n"
    files_ = [parse(Source("case.rcs", text.format(cell))) for cell in ("in 2 .. 5", "2 .. 5")]
    with_in, plain = (format_file(file) for file in files_ if isinstance(file, tree.File))
    assert with_in == plain
    assert "| 2 .. 5 | x in 2 .. 5 ||" in plain


@pytest.mark.parametrize(
    ("cell", "kept"),
    [
        ("xx1x xxxx, 0000 0000", "xx1x xxxx, 0000 0000"),
        ("0b10x0_0000, 0bxxxx1111, 8 .. 9", "10x0 0000, 0bxxxx1111, 8 .. 9"),
        ("0100 0000 for 2 [s]", "0100 0000 for 2 [s]"),
        ("not in {0b0xxx_xxxx, 0b0101_0000}", "not in {0b0xxx_xxxx, 0b0101_0000}"),
        ("in {0b0101_0000, 3}", "in {0b0101_0000, 3}"),
    ],
)
def test_bits_in_groups_stay_bits_in_lists(cell: str, kept: str) -> None:
    """With `0b` those without an `x` would be a number."""
    parsed = parse(Source("case.rcs", f"table t {{\n  | line | w ||\n  | a    | {cell} ||\n}}\n"))
    assert isinstance(parsed, tree.File)
    assert f"| a    | {kept} ||" in format_file(parsed)
    for width in (110, 30, 1):
        assert parse(Source("case.rcs", format_file(parsed, width))) == parsed


CASES = [
    ("input x : = 3", [("RCS101", 1)]),
    ("enum a {", [("RCS101", 1)]),
    ("table t {\n | line | x ||\n | a | 1 | 2 ||\n}", [("RCS102", 3)]),
    ("table t {\n | line | x |\n}", [("RCS102", 2)]),
    ("table t {\n | line | x || || y |\n}", [("RCS102", 2)]),
    ("table t {\n | line | x || |\n | a | 1 || |\n}", [("RCS101", 2)]),  # no heading
    ("table t {\n | line | x | ||\n | a | 1 | ||\n}", [("RCS101", 2)]),
    ("table t {\n | line | x || y | |\n | a | 1 || 2 | go |\n}", [("RCS101", 2)]),
    ("table t {\n | line | x | y ||\n | a | DEFAULT | 3 ||\n}", [("RCS108", 3)]),
    ("table t {\n | line | x ||\n | a | < ||\n | b | = = ||\n}", [("RCS101", 3), ("RCS101", 4)]),
    ("table t {\n | name | x ||\n}", [("RCS101", 2)]),
    ("table t {\n | line | x_ | y ||\n | | z ||\n |--|--|--||\n}", [("RCS102", 3)]),
    ("table t {\n | line | x | y ||\n | | z | ||\n | | a | b ||\n}", [("RCS116", 4)]),
    ("table t {\n | line | x_ ||\n |--|--||\n | | y ||\n}", [("RCS101", 4)]),
    ("table t {\n | line | x || a |\n | p | 1 || b |\n | | | | c |\n}", [("RCS102", 4)]),
    ("table t {\n | line | x || a |\n | p | 1 || |\n | | || c |\n}", [("RCS116", 4)]),
    ("table t {\n | line | x | y ||\n | p | 1 | ||\n | | | ||\n}", [("RCS116", 4)]),
    ("table t {\n | line | x ||\n | p | 1 ||\n | line | y ||\n |--|--||\n | q | 1 ||\n}", [("RCS116", 6)]),
    ("table t {\n | line | x ||\n | p | 1 ||\n | line | y ||\n |--|--||\n}", [("RCS116", 4)]),
    (
        "table t {\n | line | x ||\n | p | 1 ||\n | line || y |\n | p || 1 |\n}",
        [("RCS102", 4), ("RCS102", 5)],
    ),
    (
        "table t {\n | line | x ||\n | p | in {1, ||\n | | 2} ||\n | q | in {1, ||\n | | , 2} ||\n}",
        [("RCS101", 6)],
    ),
    (
        "table t {\n | line | x ||\n | p | 1 ||\n | line | y ||\n |--|--||\n | p | DEFAULT ||\n}",
        [("RCS113", 6)],
    ),
    ("input \u0430 : bool", [("RCS109", 1)]),
    ("input x : bool\0", [("RCS106", 1)]),
    *(
        (f"input x : bool\n{where.replace('@', char)}", [("RCS114", 2)])
        for char in "\x1b\x7f\x85\u061c\u200f\u202e\u2066"
        for where in ("# @", "##@ x", "@input y : bool", 'use "a@.rcs"')
    ),
    ("# fine\ninput " + "a" * 1001 + " : bool", [("RCS115", 2)]),
    ('extern procedure p python "a', [("RCS101", 1)]),
    ("invariant i : " + "(" * 200 + "a" + ")" * 200, [("RCS103", 1)]),
    ("invariant i : " + "not " * 5000 + "a", [("RCS103", 1)]),
    ("invariant i : " + "-" * 5000 + "a", [("RCS103", 1)]),
    ("invariant i : " + "a implies " * 5000 + "a", [("RCS103", 1)]),
    ("procedure p { " + "if a { " * 500 + "} " * 500 + "}", [("RCS103", 1)]),
    ("procedure p { if a {} " + "else if a {} " * 5000 + "}", [("RCS103", 1)]),
    ("input x : = 3\n\ninput y : bool\n\nowner 3 {}\n", [("RCS101", 1), ("RCS101", 5)]),
]


@pytest.mark.parametrize(("text", "expected"), CASES, ids=lambda value: repr(value)[:40])
def test_syntax_errors_have_a_code_and_a_line(text: str, expected: list[tuple[str, int]]) -> None:
    assert errors(text) == expected


def test_a_line_whose_name_was_forgotten_is_no_longer_line() -> None:
    """Where its cells could go on with those above, it is said what an empty first cell means."""
    parsed = parse(Source("case.rcs", "table t {\n | line | x ||\n | a | 1 ||\n | | 2 ||\n}"))
    assert not isinstance(parsed, tree.File)
    [finding] = parsed
    assert finding.message == "expected an operator, `,`, `..`, `not` or the end, found `2`"
    assert PIECES in finding.help


def test_expectations_are_words_and_few() -> None:
    parsed = parse(Source("case.rcs", "procedure p { if }"))
    assert not isinstance(parsed, tree.File)
    assert parsed[0].message == "expected an expression, found `}`"


def test_at_most_twenty_errors_are_reported() -> None:
    assert len(errors("input x : =\n" * 100)) <= MOST_ERRORS


@pytest.mark.parametrize("ending", ["\r\n", "\n"])
def test_line_ends_of_both_kinds(ending: str) -> None:
    text = "input x : bool\ntable t {\n | line | x ||\n | a | true ||\n | b | false ||\n}\n".replace(
        "\n", ending
    )
    assert isinstance(parse(Source("case.rcs", text)), tree.File)


GARBAGE = st.text(
    alphabet=st.sampled_from('|{}()[]=<>/.:;,+-*#"\n\r\t ab19_\u00e9\0') | st.characters(), max_size=200
)


@settings(max_examples=200)
@given(GARBAGE)
def test_garbage_is_a_tree_or_diagnostics_inside_the_text(text: str) -> None:
    parsed = parse(Source("case.rcs", text))
    if isinstance(parsed, tree.File):
        return
    assert parsed
    for diagnostic in parsed:
        assert 0 <= diagnostic.primary.span.start <= diagnostic.primary.span.end <= len(text)
        assert diagnostic.code is not Code.INTERNAL


@pytest.mark.parametrize(
    "text",
    [
        "input a : int 0 .. 9\nassume x : " + " + ".join(["a"] * 5000) + " > 3\n",
        "type t = " + "array [2] of " * 3000 + "bool\n",
        "state a : int 0 .. 9\nprocedure p {\n" + "if a = 1 { a := 1 } else " * 2000 + "{ a := 2 }\n}\n",
        "state a : bool\ntable t {\n| line | a ||\n|--|--||\n| x | " + "not " * 3000 + "a ||\n}\n",
        "record r { a : bool }\nstate a : r\ninvariant t : a" + ".a" * 3000 + "\n",
        "state a : bool\ninvariant t : " + "(" * 3000 + "a" + ")" * 3000 + "\n",
        "state a : bool\ninvariant t : " + "a implies " * 101 + "a\n",
    ],
    ids=["sum", "array", "else if", "cell", "field", "brackets", "implies"],
)
def test_what_nests_too_deep_is_refused(text: str) -> None:
    assert [code for code, _ in errors(text)] == ["RCS103"]


def test_what_is_long_or_wide_but_not_deep_is_taken() -> None:
    wide = "| x | " + " " * 200 + "a ||"
    calls = "\n".join(["  f(-1)"] * 300)
    text = (
        "state a : bool\n"
        f"table t {{\n| line | when ||\n|--|{'-' * 300}||\n{wide}\n}}\n"
        "extern procedure f(x : int -5 .. 5)\n"
        f"procedure p {{\n{calls}\n}}\n"
        "invariant i : " + "a implies " * 99 + "a\n"
    )
    assert isinstance(parse(Source("case.rcs", text)), tree.File)


@pytest.mark.parametrize("said", ["DEFAULT", "DEFAULT unreachable", " DEFAULT  unreachable "])
@pytest.mark.parametrize("column", [1, 2])
def test_default_in_another_column_is_an_error(said: str, column: int) -> None:
    """Also where a value is called so: only the first column makes a DEFAULT line."""
    cells = ["", "", ""]
    cells[column] = said
    head = "enum e { DEFAULT, other }\ninput x : e\ninput y : bool\ntable t {\n  | line | x | x | when ||\n"
    text = f"{head}  | a | {' | '.join(cells)} ||\n}}\n"
    assert errors(text) == [("RCS113", 6)]
    assert not isinstance(parse(Source("case.rcs", text)), tree.File)
    assert errors(
        f"{head}  | a | DEFAULT | {said if column == 1 else ''} | {said if column == 2 else ''} ||\n}}\n"
    ) == [("RCS108", 6)]


def test_values_and_variables_called_like_words_stay_what_they_are() -> None:
    text = (
        "enum e { DEFAULT, other }\ninput when : bool\ninput DEFAULT : bool\ninput x : e\noutput procedures : bool\n\n"
        "table t {\n  | line | (when) | x           | when      || (procedures) |\n"
        "  |------|--------|-------------|-----------||--------------|\n"
        "  | a    |        | = DEFAULT   | (DEFAULT) || DEFAULT      |\n"
        "  | b    | true   | in {DEFAULT}| not DEFAULT || when       |\n}\n"
    )
    parsed = parse(Source("case.rcs", text))
    assert isinstance(parsed, tree.File)
    formatted = format_file(parsed)
    assert parse(Source("case.rcs", formatted)) == parsed
    [table] = [declaration for declaration in parsed.declarations if isinstance(declaration, tree.TableDecl)]
    assert not any(row.default for row in table.rows)
    assert [heading.word for heading in (*table.conditions, *table.actions)] == ["", "", "when", ""]


def plain(found: Any) -> object:
    """A tree of Lark's as plain data: names, texts and places."""
    if isinstance(found, lark.Token):
        return found.type, str(found), found.start_pos, found.end_pos
    place = (-1, -1) if found.meta.empty else (found.meta.start_pos, found.meta.end_pos)
    return str(found.data), place, [plain(child) for child in found.children]


def outcome(parser: lark.Lark, text: str, start: str) -> tuple[Any, ...]:
    """The tree, or where the parser stops and what it would have taken there."""
    try:
        return ("a tree", plain(parser.parse(text, start=start)))
    except lark.UnexpectedToken as error:
        return error.pos_in_stream, error.token.type, sorted(error.accepts or error.expected)
    except lark.UnexpectedCharacters as error:
        return error.pos_in_stream, sorted(error.allowed or ())


def asked_of_the_parser(texts: list[str]) -> set[tuple[str, str]]:
    """What reading right texts has Lark parse, with its start rule: declarations, headings, and each piece of a cell."""
    asked: set[tuple[str, str]] = set()
    parsed = parsing._parsed

    def noted(text: str, start: str) -> ParseNode:
        asked.add((text, start))
        return parsed(text, start)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(parsing, "_parsed", noted)
        parsing._meant.cache_clear()
        for text in texts:
            assert isinstance(parse.__wrapped__(Source("case.rcs", text)), tree.File)
    parsing._meant.cache_clear()
    return asked


def test_the_saved_parser_is_the_one_that_lark_makes() -> None:
    """Of shipped files, the manual's texts and each of their cells, of turned tables and events, too; of pieces, and texts with a slip."""
    made, kept = parsing.made(), parsing._parser()
    starts, rng = made.options.start, Random(20261122)  # noqa: S311  # texts to try
    texts = [path.read_text(encoding="utf-8") for path in SHIPPED]
    manual = (REPO / "grammar" / "manual.md").read_text(encoding="utf-8")
    shown = re.findall(r"^```rcs\n(.*?)^```", manual, re.DOTALL | re.MULTILINE)
    cells = asked_of_the_parser([*texts, *(text for text in shown if "# error" not in text)])
    asked = sorted(cells)
    assert {start for _, start in asked} == set(starts)
    assert [text for text, start in asked if start == "cell" and text.startswith("@T")]
    for _ in range(400):
        text = rng.choice(texts)
        at = rng.randrange(len(text))
        asked += [(text[at : at + rng.randrange(60)], start) for start in starts]
        slip = rng.choice(
            ("", "|", "(", ")", "safe ", "in ", "..", "\u00e9", "@", "#", "\n", "int", "1.5", "\0")
        )
        asked.append((text[max(0, at - 300) : at] + slip + text[at + rng.randrange(5) : at + 300], "file"))
    right = 0
    for text, start in asked:
        found = outcome(kept, text, start)
        assert found == outcome(made, text, start), (start, text)
        assert found[0] == "a tree" or (text, start) not in cells
        right += found[0] == "a tree"
    assert len(cells) + 100 < right < len(asked) - 500


def test_the_kept_parser_is_of_the_grammar() -> None:
    kept = (REPO / "grammar" / "rcs.parser.json").read_text(encoding="utf-8")
    assert kept == saved(parsing.made(), parsing._digest()), "make it anew: python -m rcsc.lang.syntax.parse"


LARK_COUNTED = """
import lark
from rcsc.base.diagnostics.source import Source
from rcsc.lang.syntax import parse as module
made, whole = [], lark.Lark.__init__
lark.Lark.__init__ = lambda *args, **options: made.append(args) or whole(*args, **options)
{before}
tree = module.parse(Source("a.rcs", {text!r}))
print(len(made), type(tree).__name__)
"""
RIGHT = "input a : bool\ntable t {\n| line | a ||\n|---|---||\n| 1 | - ||\n}\n"


@pytest.mark.parametrize(
    ("text", "before", "printed"),
    [
        (RIGHT, "", "0 File"),
        ("input a : : bool\n", "", "0 tuple"),
        (RIGHT, "module._grammar_text = lambda of=module._grammar_text(): of + '\\n'", "1 File"),
    ],
    ids=["a right text", "a wrong one", "the parser of another grammar is not taken for this one's"],
)
def test_lark_makes_a_parser_only_of_another_grammar(text: str, before: str, printed: str) -> None:
    program = LARK_COUNTED.format(text=text, before=before)
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == printed


def spans(node: object) -> object:
    """Every span of a tree, in its order."""
    if isinstance(node, Span):
        return node
    if isinstance(node, tuple):
        return tuple(map(spans, node))
    slots = getattr(type(node), "__dataclass_fields__", ())
    return tuple(spans(getattr(node, name)) for name in slots)


@pytest.mark.parametrize(
    "text",
    [
        "assume a : (when(again))\n",
        "assume a : when and b\n",
        "invariant a : when(again)\n",
        "property a : b for (-n + 5)\n",
        "property a : b for (-3) cycles\n",
        "property a : once (when.a)\n",
        "property a : once whenever\n",
        "property a : once not always and once (for.a)\n",
    ],
)
def test_words_of_requirements_are_names_where_they_stand_as_one(text: str) -> None:
    """Parentheses stand where the words, or a sign after `for`, would be read otherwise, and nowhere else."""
    parsed = parse(Source("a.rcs", text))
    assert isinstance(parsed, tree.File), text
    assert format_file(parsed) == text


@settings(max_examples=150, deadline=None)
@given(st.lists(expressions(), min_size=2, max_size=5, unique_by=spell_expr), st.booleans())
def test_conditions_joined_by_and_are_what_the_whole_cell_says(parts: list[tree.Expr], again: bool) -> None:
    cell = " and ".join(spell_expr(part) for part in parts)
    first = "| 0 | " + " and ".join(spell_expr(part) for part in reversed(parts)) + " ||\n" if again else ""
    text = f"table t {{\n| line | when ||\n|---|---||\n{first}| 1 | {cell} ||\n}}\n"
    parsed = parse(Source("a.rcs", text))
    whole = parse(Source("b.rcs", f"invariant a : {cell}\n"))
    if not isinstance(parsed, tree.File) or not isinstance(whole, tree.File):
        assert type(parsed) is type(whole)
        return
    [table], [claimed] = parsed.declarations, whole.declarations
    assert isinstance(table, tree.TableDecl)
    assert isinstance(claimed, tree.InvariantDecl)
    [condition] = table.rows[-1].conditions
    assert isinstance(condition, tree.Comparison)
    assert condition.value == claimed.condition
    begin = len("invariant a : ")
    written = [list(flat(spans(part))) for part in joined(condition.value, len(condition.places) or 1)]
    alone = [list(flat(spans(part))) for part in joined(claimed.condition, len(condition.places) or 1)]
    for (start, _), here, there in zip(condition.places or [(0, 0)], written, alone, strict=True):
        moved = [(begin + start + span.start, begin + start + span.end) for span in here]
        assert moved == [(span.start, span.end) if span.file else (begin + start,) * 2 for span in there]


PARTS = [
    "a", "(a or b)", "x = 1", "y = 1.5", "w = 0bx1", "0x1F = w", "x in {1, 2}", "f[1]", "a for 2 [s]",
    "a.and_", "or_1 = 1",
]  # fmt: skip
JOINTS = [
    f"{before}{word}{after}"
    for word in ("and", "and", "or", "xor", "implies")
    for before in ("", " ")
    for after in ("", " ")
]


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(JOINTS), st.sampled_from(PARTS)), min_size=2, max_size=4))
def test_a_cell_says_what_an_assumption_of_the_same_words_does(pieces: list[tuple[str, str]]) -> None:
    cell = "b" + "".join(f"{joint}{part}" for joint, part in pieces)
    table = parse(Source("a.rcs", f"table t {{\n| line | when ||\n|---|---||\n| 1 | {cell} ||\n}}\n"))
    assumed = parse(Source("b.rcs", f"assume a : {cell}\n"))
    assert isinstance(table, tree.File) == isinstance(assumed, tree.File)
    if isinstance(table, tree.File) and isinstance(assumed, tree.File):
        [declared], [claim] = table.declarations, assumed.declarations
        assert isinstance(declared, tree.TableDecl)
        assert isinstance(claim, tree.AssumeDecl)
        [condition] = declared.rows[0].conditions
        assert isinstance(condition, tree.Comparison)
        assert condition.value == claim.condition


def joined(condition: tree.Expr, many: int) -> list[tree.Expr]:
    """So many conditions that `and` joins."""
    if many == 1:
        return [condition]
    assert isinstance(condition, tree.Binary)
    return [*joined(condition.left, many - 1), condition.right]


def flat(places: object) -> Iterator[Span]:
    if isinstance(places, Span):
        yield places
    elif isinstance(places, tuple):
        for place in places:
            yield from flat(place)


def test_each_condition_is_parsed_once_though_many_lines_join_it(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    parsed = parsing._parsed

    def counted(text: str, start: str) -> ParseNode:
        asked.append(text)
        return parsed(text, start)

    monkeypatch.setattr(parsing, "_parsed", counted)
    text = families.linear(64, 6, 3)
    assert isinstance(parse(Source("counted.rcs", text)), tree.File)
    cells = [row.split("|")[2].strip() for row in text.splitlines() if re.match(r"\| \d", row)]
    pieces = [piece for cell in cells for piece in cell.split(" and ")]
    assert len(pieces) > 3 * len(set(pieces))
    assert sorted(piece for piece in asked if piece in set(pieces)) == sorted(set(pieces))
    assert not [cell for cell in asked if cell in set(cells) - set(pieces)]


EDGES = [
    "", " ", "-", " - ", "\u00a0", "1", " 1 ", "> 1", "in {1, 2}", "DEFAULT", "DEFAULT unreachable",
    "= DEFAULT", "0x", ">", "a)",
]  # fmt: skip


@settings(max_examples=300)
@given(
    st.lists(st.lists(st.sampled_from(EDGES), min_size=3, max_size=3), min_size=1, max_size=5),
    st.sampled_from(["a | b | when", "a | when | b", "when | when | a"]),
    st.sampled_from(["", " x |", " x | req |", " req | x |"]),
)
def test_a_row_read_at_once_is_the_row_read_cell_by_cell(
    rows: list[list[str]], heading: str, actions: str
) -> None:
    """What texts are known is of no account: trees, places and what is wrong, in the same order."""
    does = {"": "", " x |": " 1 |", " x | req |": ' 2 | "SR-1" |', " req | x |": ' "SR-1" | - |'}[actions]
    lines = "".join(f"| l{at} |{'|'.join(cells)}||{does}\n" for at, cells in enumerate(rows))
    text = f"table t {{\n| line | {heading} ||{actions}\n|---|---|---|---||---|\n{lines}}}\n"
    read = parse.__wrapped__(Source("case.rcs", text))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(parsing._Rows, "_at_once", lambda *_: None)
        slowly = parse.__wrapped__(Source("case.rcs", text))
    assert read == slowly
    if isinstance(read, tree.File) and isinstance(slowly, tree.File):
        assert places_of(read) == places_of(slowly)


def places_of(file: tree.File) -> list[list[Any]]:
    """The cells of all rows."""
    return [
        list(row.cells)
        for table in file.declarations
        if isinstance(table, tree.TableDecl)
        for row in table.rows
    ]


@given(st.lists(st.sampled_from([*EDGES, "  two words  "]), min_size=1, max_size=6), st.integers(0, 9))
def test_the_cells_of_a_side_are_where_they_are_said_to_be(texts: list[str], start: int) -> None:
    text = "#" * start + "|".join(texts)
    side = Side(text[start:], "case.rcs", start)
    cells = list(side)
    assert [cell.text for cell in cells] == [piece.strip() for piece in texts]
    assert [side[at] for at in range(len(side))] == [side[at - len(side)] for at in range(len(side))] == cells
    assert [text[cell.span.start : cell.span.end] for cell in cells] == [cell.text for cell in cells]
    assert side[1:] == tuple(cells)[1:]
    for beyond in (len(side), -len(side) - 1):
        with pytest.raises(IndexError):
            side[beyond]


def test_cells_are_made_for_distinct_texts_not_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted, since time and memory to read a large table are in proportion."""
    made = 0
    plain = Side._cell

    def counted(side: Side, piece: str, offset: int) -> Any:
        nonlocal made
        made += 1
        return plain(side, piece, offset)

    monkeypatch.setattr(Side, "_cell", counted)
    lines, columns = 512, 20
    text = families.box(lines, columns, 3)
    assert len(program_of(text).tables[0].lines) == lines
    rows = [row.strip("|").split("|")[1:] for row in text.splitlines() if re.match(r"\| \d", row)]
    distinct = {(at, cell) for row in rows for at, cell in enumerate(row)}
    assert len(distinct) + 4 * lines < lines * columns / 2
    assert made < 2 * len(distinct) + 4 * lines
