"""Keys in tables: aligning touches no cell, tab visits every cell, a new line and a new column leave the table a table."""

from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.source import Source
from rcsc.desk.editor import keys
from rcsc.desk.editor.places import Lines, Place, Units, difference
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.tree import File, TableDecl
from rcsc.lang.written.changes import spliced
from rcsc.lang.written.tables import cells_of, dashes, tables_of
from tests.editor.random_edits import edited

REPO = Path(__file__).parents[2]
FILES = [
    "examples/grip.rcs",
    "emove/locate.rcs",
    "gallery/tcas/tcas.rcs",
    "gallery/rfc9293/published.rcs",
]
CELL = st.text(st.sampled_from("ab é\U0001f916/=.,{}"), max_size=8)


def cells(text: str) -> list[list[list[str]]]:
    return [
        [[cell.text for cell in cells_of(row).all] for row in table.rows if not dashes(row)]
        for table in tables_of(text)
    ]


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_shipped_tables_are_aligned_already(file: str, end: str) -> None:
    text = (REPO / "tables" / file).read_text().replace("\n", end)
    for table in tables_of(text):
        assert keys.align(text, table.start) == []


@given(
    st.lists(st.lists(CELL, min_size=3, max_size=3), min_size=1, max_size=5),
    st.lists(
        st.sampled_from(["| x | y", "|", "| a | b || c", "||||", "| # |", "| a || b | c |"]), max_size=2
    ),
    st.booleans(),
)
def test_aligning_changes_blanks_alone(rows: list[list[str]], half: list[str], crlf: bool) -> None:
    """Of rows as wide as the heading; of the others nothing. Doing it twice changes nothing more."""
    lines = [
        "table t {",
        "| line | a || b |",
        "|--|-||-|",
        *(f"| {row[0]}| {row[1]} || {row[2]} |" for row in rows),
        *half,
        "}",
    ]
    text = ("\r\n" if crlf else "\n").join(lines)
    after = spliced(text, keys.align(text, 0))
    assert cells(after) == cells(text)
    assert "".join(after.split()).replace("-", "") == "".join(text.split()).replace("-", "")
    assert keys.align(after, 0) == []
    whole = [row for row in next(tables_of(after)).rows if str(row) not in half]
    bars = {tuple(at for at, letter in enumerate(row) if letter == "|") for row in whole}
    assert len(bars) == 1 or "|" in "".join("".join(row) for row in rows)


@pytest.mark.parametrize("file", FILES)
def test_tab_visits_every_cell_in_order(file: str) -> None:
    text = (REPO / "tables" / file).read_text()
    for table in list(tables_of(text))[:2]:
        wanted = [cell.text for row in table.rows if not dashes(row) for cell in cells_of(row).all]
        offset, seen = table.rows[0].start + 2, [cells_of(table.rows[0]).all[0].text]
        for _ in wanted[1:]:
            moved = keys.next_cell(text, offset)
            assert moved is not None
            assert moved.text == text
            offset = moved.offset
            row = next(row for row in table.rows if row.start <= offset <= row.past)
            at = [region.start <= offset <= region.end for region in keys.regions(row)].index(True)
            seen.append(cells_of(row).all[at].text)
        assert seen == wanted
        back = keys.previous_cell(text, offset)
        assert back is not None
        assert back.offset < offset


@pytest.mark.parametrize("file", FILES)
def test_a_new_line_is_a_line(file: str) -> None:
    """After any line, in tables of several parts too: the file parses, and has one line more, where it was asked for."""
    text = (REPO / "tables" / file).read_text()
    for number, table in enumerate(tables_of(text)):
        for at, line in enumerate(table.parts[0].lines):
            moved = keys.add_row(text, line[0].start + 3)
            assert moved is not None
            parsed = parse(Source(file, moved.text))
            assert isinstance(parsed, File), parsed[0].message
            rows = [each for each in parsed.declarations if isinstance(each, TableDecl)][number].rows
            assert len(rows) == len(table.parts[0].lines) + 1
            assert moved.text[moved.offset :].startswith(rows[at + 1].name)
            assert len({row.name for row in rows}) == len(rows)


@pytest.mark.parametrize("file", FILES)
def test_a_new_column_is_empty_and_where_it_was_asked_for(file: str) -> None:
    text = (REPO / "tables" / file).read_text()
    for number, table in enumerate(tables_of(text)):
        for region in keys.regions(table.rows[0]):
            moved = keys.insert_column(text, region.first)
            assert moved is not None
            after = list(tables_of(moved.text))[number]
            for old, new in zip(table.rows, after.rows, strict=True):
                if old in {
                    row
                    for row in table.rows
                    if row.start < (table.parts[1].heading[0].start if len(table.parts) > 1 else table.end)
                }:
                    assert len(cells_of(new).all) == len(cells_of(old).all) + 1
            added = next(one for one in keys.regions(after.rows[0]) if one.start <= moved.offset <= one.end)
            assert (added.length, added.action) == (0, region.action)


@given(st.text(st.sampled_from("|- abt{}\n\r#\U0001f916"), max_size=60), st.integers(0, 70))
def test_keys_survive_any_text(text: str, offset: int) -> None:
    text = f"table t {{\n{text}"
    for act in (keys.next_cell, keys.previous_cell, keys.add_row, keys.insert_column):
        moved = act(text, offset)
        assert moved is None or 0 <= moved.offset <= len(moved.text)
    spliced(text, keys.align(text, offset))


@pytest.mark.parametrize("seed", range(2))
def test_keys_survive_shipped_tables_that_somebody_edits(seed: int) -> None:
    """Rows above the first heading, parts that align to less than they were: most keys are pressed in such texts."""
    random = Random(seed)  # noqa: S311  # edits, no secrets
    for file in FILES:
        text = (REPO / "tables" / file).read_text()
        for _ in range(30):
            text = edited(text, random)
            bars = [at for at, letter in enumerate(text) if letter == "|"] or [0]
            for act in (keys.next_cell, keys.previous_cell, keys.add_row, keys.insert_column):
                moved = act(text, min(len(text), random.choice(bars) + random.randrange(3)))
                assert moved is None or 0 <= moved.offset <= len(moved.text)


def test_a_column_is_inserted_in_a_part_that_moves_up_as_those_above_it_are_aligned() -> None:
    text = """table t {
  | line             | a              ||
  |---|---||
  | x | 1 ||

  | line | b || c |
  |---|---||---|
  | x | 2 || 3 |
}
"""
    moved = keys.insert_column(text, text.index("2"))
    assert moved is not None
    line = moved.text[moved.text.rfind("\n", 0, moved.offset) + 1 :].splitlines()[0]
    assert line == "  | line | b |  || c |"
    assert keys.insert_column(text.replace("t {\n", "t {\n - | line | q ||\n"), text.index("line")) is None


@given(
    st.text(st.sampled_from("ab\n\r\x0b\u2028é\U0001f916"), max_size=40),
    st.text(st.sampled_from("ab\n\ré"), max_size=40),
)
def test_differences_are_edits_from_one_text_to_the_other(before: str, after: str) -> None:
    lines = Lines(before)
    assert lines.applied(difference("a", lines, after)) == after


@given(
    st.text(st.sampled_from("ab\n\r\u2028é\U0001f916"), max_size=30),
    st.integers(0, 30),
    st.sampled_from(Units),
)
def test_places_lead_back(text: str, offset: int, units: Units) -> None:
    """But within a line's end, which is one place."""
    lines = Lines(text)
    offset = min(offset, len(text))
    back = lines.offset(lines.place(offset, units), units)
    assert back == offset or text[back:offset].strip("\r\n") == ""
    assert lines.offset(Place(999, 0), units) == len(text)
