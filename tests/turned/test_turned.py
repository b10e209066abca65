"""Tables printed the other way round: what they mean, where findings point, and that they stay as they are printed."""

from random import Random

import pytest
from hypothesis import given, settings

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.source import Source
from rcsc.code.testing.inputs.sampling import declarations, snapshot
from rcsc.desk.editor.grid import grids
from rcsc.desk.editor.names.index import Space, occurrences
from rcsc.desk.editor.places import Lines
from rcsc.desk.editor.values import Standing, State
from rcsc.desk.studio.tables import cells
from rcsc.lang.interpret import matching_lines
from rcsc.lang.model import Program, Snapshot
from rcsc.lang.resolve import compile_text
from rcsc.lang.resolve.precedence import expanded
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.lang.written.tables import tables_of
from tests.support.programs.arbitrary import turned_tables
from tests.support.programs.stages import program_of, reported
from tests.support.programs.turned import Both, drawn

DECLARED = """
enum mode { idle, run, stop }
enum order { none, go, halt }
input asked : order
input done : bool
input level : int 0 .. 9
state now : mode
output shown : int 0 .. 9
"""
MATRIX = (
    DECLARED
    + """
table t by asked giving now {
  | now         || go  | halt above all | ended : when done |
  |-------------||-----|----------------|-------------------|
  | idle        || run |                |                   |
  # after the work
  | run         ||     | stop           | idle              |
  | in {stop}   || run | -              |                   |
  | DEFAULT     || now |
}
"""
)
RESULTS = (
    DECLARED
    + """
table t giving shown {
  | line    | now     || 1        | 2                     | level |
  |---------|---------||----------|-----------------------|-------|
  | resting | idle    || not done | @T(done)              | false |
  | busy    | /= idle || level>3  | level <= 3            |       |
  | rest    | DEFAULT || shown    |
}
"""
)
COLUMNS = (
    ("now", lambda rng: rng.choice(("idle", "/= run", "in {idle, stop}", "@C", "@T(run)", "not @F(stop)"))),
    ("level", lambda rng: rng.choice(("3", "> 3", "<= 5", "2 .. 4", "@T(> 3) when done", "not in {1, 2}"))),
    ("done", lambda rng: rng.choice(("true", "false", "@T", "not @F", "@F when level > 2"))),
    ("was level", lambda rng: rng.choice(("0", "> 4"))),
)
CONDITIONS = (
    "level > 3",
    "done",
    "not was done",
    "@T(done) when level < 5",
    "not @F(done)",
    "level = was level",
)


def tree_of(text: str) -> tree.File:
    """The tree of a text that is in order."""
    found = parse(Source("case.rcs", text))
    assert isinstance(found, tree.File), found
    return found


def both(rng: Random) -> Both:
    """A drawn table about the mode or what is shown, in both forms."""
    giving, results = rng.choice((("now", ("idle", "run", "now")), ("shown", ("1", "2", "level"))))
    return drawn(COLUMNS, CONDITIONS, giving, results, rng)


def test_a_turned_table_means_its_lines() -> None:
    compared = 0
    for seed in range(60):
        rng = Random(seed)  # noqa: S311
        one = both(rng)
        turned = compile_text("\n".join([DECLARED, f"table t {one.said} {{", *one.turned, "}", ""]))
        if not isinstance(turned, Program):  # two rows say the same, and have no names
            assert {each.code.value for each in turned} == {"RCS207"}, turned
            continue
        plain = program_of("\n".join([DECLARED, "table t {", *one.lines, "}", ""]))
        [mine], [theirs] = turned.tables, plain.tables
        assert [line.actions for line in mine.every_line] == [line.actions for line in theirs.every_line]
        known, names = declarations(plain), [line.name for line in theirs.lines]
        own = [line.name for line in mine.lines]
        for _ in range(30):
            at = snapshot(known, theirs, rng)
            matched = [own.index(name) for name in matching_lines(mine, at)]
            assert matched == [names.index(name) for name in matching_lines(theirs, at)], one
            compared += 1
    assert compared > 500


@settings(max_examples=15)
@given(turned_tables())
def test_a_turned_table_stays_as_it_is_printed(table: tree.TableDecl) -> None:
    file = tree.File((table,))
    for width in (110, 1, 10_000):
        text = format_file(file, width)
        assert tree_of(text) == file, text
        assert format_file(file, width) == text


def test_a_turned_table_is_laid_out_over_columns() -> None:
    text = format_file(tree_of(MATRIX))
    assert "  | DEFAULT   || now                                      |\n" in text
    assert "  # after the work\n  | run       ||     | stop           | idle" in text
    assert tree_of(text) == tree_of(MATRIX)
    for ending in ("\r\n", "\n\t"):
        assert tree_of(MATRIX.replace("\n", ending)) == tree_of(MATRIX)


def test_lines_have_names_of_their_row_and_column() -> None:
    names = [str(line.name) for line in program_of(MATRIX).tables[0].every_line]
    assert names == ["idle_go", "run_halt", "run_ended", "stop_go", "default"]
    names = [str(line.name) for line in program_of(RESULTS).tables[0].every_line]
    assert names == ["resting_1", "resting_2", "busy_1", "busy_2", "rest"]


def test_in_lines_it_is_the_same_table() -> None:
    for text in (MATRIX, RESULTS):
        meant, file = program_of(text), tree_of(text)
        lines = [
            expanded(each, meant.tables[0]) if isinstance(each, tree.TableDecl) else each
            for each in file.declarations
        ]
        plain = program_of(format_file(tree.File(tuple(lines))))
        assert [line.name for line in plain.tables[0].lines] == [line.name for line in meant.tables[0].lines]
        rng, known = Random(3), declarations(meant)  # noqa: S311
        for _ in range(200):
            at = snapshot(known, meant.tables[0], rng)
            assert matching_lines(plain.tables[0], at) == matching_lines(meant.tables[0], at)


@pytest.mark.parametrize(
    ("text", "old", "new", "code", "at"),
    [
        (MATRIX, "-     ", "walk", "RCS201", "walk"),
        (MATRIX, "| idle              |", "| 3                 |", "RCS301", "3"),
        (MATRIX, "halt above", "holt above", "RCS201", "holt"),
        (MATRIX, "above all", "above ender", "RCS201", "ender"),
        (MATRIX, "| go ", "| halt", "RCS207", "halt above all"),
        (MATRIX, "| go ", "|    ", "RCS101", ""),
        (MATRIX, "in {stop}  ", "run        ", "RCS207", "run"),
        (MATRIX, "in {stop}  ", "-          ", "RCS101", "-"),
        (MATRIX, "| DEFAULT     || now |", "| DEFAULT || now | run |", "RCS108", "run"),
        (MATRIX, "-              |     ", "-              |  |  ", "RCS102", "| in {stop}   || run | -              |  |                |"),
        (RESULTS, "resting |", "resting above rest |", "RCS217", "rest"),
        (RESULTS, "busy   ", "busy above busy", "RCS201", "busy"),
        (RESULTS, "level>3", "level>", "RCS101", ""),
        (RESULTS, "level>3", "levl>3", "RCS201", "levl"),
        (RESULTS, "not done", "1 + 1   ", "RCS301", "1 + 1"),
        (RESULTS, "| 2 ", "| x ", "RCS201", "x"),
        (RESULTS, "@T(done)", "DEFAULT", "RCS113", "DEFAULT"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_shown_where_it_is_printed(
    text: str, old: str, new: str, code: str, at: str
) -> None:
    assert text.count(old) == 1
    changed = text.replace(old, new)
    found = compile_text(changed)
    assert not isinstance(found, Program)
    span = found[0].primary.span
    assert (found[0].code.value, changed[span.start : span.end]) == (code, at), found


def shown(text: str, code: str) -> list[str]:
    """What stands at the places of the findings of a code, those related, too."""
    report = reported(text)
    labels = [label for each in report if each.code.value == code for label in (each.primary, *each.related)]
    return [text[label.span.start : label.span.end] for label in labels]


def test_findings_of_the_proof_stand_in_cells() -> None:
    gap = MATRIX.replace("| DEFAULT     || now |", "")
    assert shown(gap, "RCS401") == ["t", "idle", "run"]
    assert shown(MATRIX.replace("halt above all", "halt"), "RCS402") == ["idle", "stop", "done"]
    assert shown(MATRIX.replace("run         ||     |", "in {stop,run}|| idle |"), "RCS402")[-3:] == [
        "run",
        "idle",
        "in {stop,run}",
    ]
    assert shown(RESULTS.replace("level <= 3", "level < 2 and level > 5"), "RCS314") == [
        "level < 2 and level > 5"
    ]
    assert shown(RESULTS.replace("| level |", "| level + 5 |"), "RCS401") == []
    known = RESULTS.replace("not done", "done for 2 [s]").replace("| rest    | DEFAULT || shown    |\n", "")
    assert [each.code.value for each in reported(known)] == ["RCS317"]


def test_names_are_found_once_each_where_they_are_printed() -> None:
    for text in (MATRIX, RESULTS):
        found = list(occurrences(tree_of(text)))
        places = [each.span.start for each in found]
        assert len(places) == len(set(places))
        for each in found:
            assert text[each.span.start : each.span.end] == each.text
        lines = [each.text for each in found if each.space is Space.LINE and each.declares]
        assert lines == (["resting", "busy", "rest"] if text is RESULTS else ["ended"])


def test_the_grid_shows_and_edits_it_as_it_is_printed() -> None:
    text = format_file(tree_of(MATRIX))
    [grid] = grids("case.rcs", Lines(text), program_of(text), lambda _: Standing(State.PROVED, ""))
    assert (grid.first, [column.heading for column in grid.columns]) == (
        "now",
        ["go", "halt above all", "ended : when done"],
    )
    assert [(row.stub.text, row.name, row.lines) for row in grid.rows] == [
        ("idle", "idle", ("idle_go",)),
        ("run", "run", ("run_halt", "run_ended")),
        ("in {stop}", "stop", ("stop_go",)),
        ("DEFAULT", "default", ("default",)),
    ]
    changed = cells.with_cells(text, "t", {(1, 0): "idle", (3, 0): "idle"})
    assert [str(line.name) for line in program_of(changed).tables[0].lines][:2] == ["idle_go", "run_go"]
    assert "  | DEFAULT   || idle " in changed
    with pytest.raises(Refused):
        cells.with_cells(text, "t", {(3, 1): "idle"})


@pytest.mark.parametrize("width", [110, 60])
def test_columns_and_rows_come_and_go_in_the_grid(width: int) -> None:
    for written in (MATRIX, RESULTS):
        text = format_file(tree_of(written), width)
        [table] = tables_of(text)
        sheet = cells.sheet_of(table)
        assert sheet.cells[-1][-4 if written is RESULTS else 0].startswith(("DEFAULT", "now"))
        for at in range(sheet.conditions, len(sheet.headings) + 1):
            wider = cells.with_column(text, "t", at, "when level > 7", action=True)
            back = cells.without_column(wider, "t", at)
            [again] = tables_of(back)
            assert cells.sheet_of(again) == sheet
        for at in range(len(sheet.stubs)):
            longer = cells.with_line(text, "t", at)
            [again] = tables_of(cells.without_lines(longer, "t", [at]))
            assert cells.sheet_of(again) == sheet


INMODE = (
    DECLARED
    + """
table t giving shown {
  | now         || 1                                 | 2                               |
  |-------------||-----------------------------------|---------------------------------|
  | idle        || @T(inmode)                        | @F(done) and not @T(inmode)     |
  | in {run,stop} || @T(inmode) when done              | was inmode and not done         |
  | DEFAULT     || shown                                                               |
}
table u by asked giving level_ {
  | line | now     || none | entered : when @T(inmode) and asked /= none |
  |------|---------||------|---------------------------------------------|
  | a    | idle    || 1    | 2                                           |
  | b    | /= idle || 3    | 4                                           |
  | rest | DEFAULT || 0    |
}
table v {
  | line        | now  | when                     || shown |
  |-------------|------|--------------------------||-------|
  | new above all | run  | @T(inmode) and level > 2 || 1     |
  | on          | run  | inmode                   || 2     |
  | other       | /= run | @T( inmode )           || 3     |
  | rest        | DEFAULT |                       || 4     |
}
output level_ : int 0 .. 9
"""
)


def in_modes(at: Snapshot) -> tuple[set[str], set[str], set[str]]:
    """The lines of the tables of `INMODE` that match, by hand."""
    now, before, done, was_done = (at[name] for name in ("now", "was_now", "done", "was_done"))
    entered, level, asked = now != before, int(at["level"]), at["asked"]
    idle, run, was_idle, was_run = now == 0, now == 1, before == 0, before == 1
    by_result = {
        "idle_1": idle and entered,
        "idle_2": idle and bool(was_done) and not done and not entered,
        "run_stop_1": not idle and was_idle and bool(was_done),
        "run_stop_2": not idle and not was_idle and not done,
    }
    by_command = {
        "a_none": idle and asked == 0,
        "a_entered": idle and not was_idle and asked != 0,
        "b_none": not idle and asked == 0,
        "b_entered": not idle and was_idle and asked != 0,
    }
    first = run and not was_run and level > 2
    in_lines = {"new": first, "on": run and not first, "other": not run and was_run}
    rests = ("default", by_result), ("rest", by_command), ("rest", in_lines)
    told = [{name for name, so in lines.items() if so} or {rest} for rest, lines in rests]
    return told[0], told[1], told[2]


def test_inmode_is_what_the_row_says_in_its_first_column() -> None:
    program = program_of(INMODE)
    known, rng = declarations(program), Random(5)  # noqa: S311
    seen = set[tuple[str, ...]]()
    for _ in range(2000):
        at = {name: value for table in program.tables for name, value in snapshot(known, table, rng).items()}
        for table, wanted in zip(program.tables, in_modes(at), strict=True):
            assert set(map(str, matching_lines(table, at))) == wanted - {"default", "rest"}, (table.name, at)
            seen.add((str(table.name), *sorted(wanted)))
    assert len(seen) == 14


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("| idle        || @T(inmode)   ", "| @C          || @T(inmode)   ", "RCS315"),
        ("| on          | run ", "| on          |     ", "RCS201"),
        ("| 1     |\n  | on", "| inmode|\n  | on", "RCS201"),
    ],
)
def test_inmode_of_a_row_that_says_nothing_is_told(old: str, new: str, code: str) -> None:
    assert INMODE.count(old) == 1
    found = compile_text(INMODE.replace(old, new))
    assert not isinstance(found, Program)
    assert found[0].code.value == code, found


def test_a_variable_called_inmode_is_that_variable() -> None:
    text = "input inmode : bool\nenum e { x, y }\nstate m : e\noutput o : bool\n"
    rows = "| x || inmode | not inmode |\n| y || @T(inmode) | not @T(inmode) |"
    [table] = program_of(
        f"{text}table t giving o {{\n| m || true | false |\n|---||---|---|\n{rows}\n}}\n"
    ).tables
    assert "inmode" in {str(name) for name in table.variables}


WAS = """
input x : int 0 .. 9
state was_deep : int 0 .. 9
output lamp : bool
table t giving lamp {
  | x      || true         | false        |
  |--------||--------------|--------------|
  | 0 .. 5 || was_deep < 3 | was_deep > 6 |
  | > 5    || true         | false        |
}
"""


def test_a_help_says_a_state_as_it_is_called() -> None:
    """Though its name begins as those of the states that hold the values of the cycle before."""
    [help_] = [each for finding in reported(WAS) if finding.code.value == "RCS401" for each in finding.help]
    assert help_.startswith(
        "`was_deep in 3 .. 6` in row `0_to_5` under `lamp`, or another result, closes the gap"
    )
    assert help_.endswith(": proved")
