"""`above` and `same`: a line runs where it matches, none above it does, and no earlier one that does the same comes through."""

import re
from collections.abc import Iterator
from itertools import combinations, product
from pathlib import Path
from random import Random
from typing import TypeAlias

import pytest

from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.base.diagnostics.source import Source
from rcsc.front.commands import run
from rcsc.front.commands.tables.fmt import expand
from rcsc.lang.interpret import evaluate, matching_lines
from rcsc.lang.model import Bool, Enum, Int, Program, Value, key_bounds
from rcsc.lang.resolve import compile_text
from rcsc.lang.resolve.precedence import expanded
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.rows import MARKS
from rcsc.proof.table import relational
from rcsc.proof.table.regions.region import NoWitness, Question
from rcsc.proof.table.regions.splitting import FEWEST_NODES, MOST_PAST, NODES_OF_A_LINE
from tests.support.programs.stages import BOXES, codes, program_of, refused, reported, verdict_of
from tests.support.programs.texts import edited

HEAD = """
enum call { none, stop, hold }
set ends : call = {stop}
input called : call
input done : bool
input near : int 0 .. 3
input far : int 0 .. 3
state now : bool
"""
MACHINE = f"""{HEAD}
table unit {{
  | line                 | called | done | near - far | when           || now   |
  |----------------------|--------|------|------------|----------------||-------|
  | ended                |        | true |            |                || true  |
  | stop above all       | stop   |      |            |                || false |
  | hold above ended     | hold   |      |            |                || false |
  | wide above hold      |        | true | > 1        |                || false |
  | odd above ended, wide|        | true |            | near + far = 5 || true  |
  | rest                 | none   | false|            |                || now   |
}}
"""
CELLS = {
    "called": ["stop", "in {none, hold}", "/= none", "in ends"],
    "done": ["true", "false"],
    "near": ["<= 1", "2", "not in 1 .. 2", "far"],
    "near + far": ["> 2", "/= 3", "in {1, 5}"],
    "when": ["near < far", "done or near = 0", "not (called = hold)", "near in 1 .. 2 implies done"],
}


def snapshots(program: Program) -> Iterator[dict[str, Value]]:
    """Every input; states are as they begin."""
    read = [v for v in program.variables if v.name in program.tables[0].variables]
    free = {str(v.name): v.initial for v in program.variables}
    for keys in product(*(range(key_bounds(v.type)[0], key_bounds(v.type)[1] + 1) for v in read)):
        assert all(isinstance(v.type, Bool | Enum | Int) for v in read)
        given = {
            str(v.name): bool(key) if isinstance(v.type, Bool) else key
            for v, key in zip(read, keys, strict=True)
        }
        yield free | given


Drawn: TypeAlias = tuple[str, list[str], dict[str, set[str]], dict[str, set[str]]]
"""A table, the names of its lines, for each line those that stand above it, and those that do the same."""


def drawn(random: Random) -> Drawn:
    """Cells and marks by chance; no line of a class of those that do the same stands above another of it."""
    columns = random.sample(sorted(CELLS), random.randint(1, 3))
    names = [f"l{number}" for number in range(random.randint(2, 5))]
    order = random.sample(names, len(names))
    above = {
        name: {lower for lower in order[at + 1 :] if random.random() < 0.4} for at, name in enumerate(order)
    }
    whole = order[0] if random.random() < 0.3 else ""
    if whole:
        above[whole] = set(order[1:])
    closed = {name: set(lower) for name, lower in above.items()}
    for upper in reversed(order):
        closed[upper] |= {more for lower in above[upper] for more in closed[lower]}
    named: dict[str, list[str]] = {name: [] for name in names}
    same = {name: {name} for name in names}
    for one, other in combinations(names, 2):
        both = same[one] | same[other]
        if not any(closed[name] & both for name in both) and random.random() < 0.4:
            first, second = random.sample((one, other), 2)
            named[first].append(second)
            same |= dict.fromkeys(both, both)
    rows = []
    for name in names:
        cells = [random.choice(["", *CELLS[column]]) for column in columns]
        if not any(cells):
            cells[0] = CELLS[columns[0]][0]
        lower = "all" if name == whole else ", ".join(sorted(above[name]))
        marks = f"{' above ' * bool(lower)}{lower}{' same ' * bool(named[name])}{', '.join(named[name])}"
        rows.append(f"| {name}{marks} | {' | '.join(cells)} || now |")
    text = "\n".join(["table t {", f"| line | {' | '.join(columns)} || now |", *rows, "}"])
    return (
        HEAD + text,
        names,
        {name: {upper for upper in names if name in closed[upper]} for name in names},
        same,
    )


def running(
    names: list[str], raw: list[str], uppers: dict[str, set[str]], same: dict[str, set[str]]
) -> list[str]:
    """The lines that run, of those that match: what comes through, of those that do the same the first."""
    through = [name for name in names if name in raw and not uppers[name].intersection(raw)]
    return [name for at, name in enumerate(through) if not same[name].intersection(through[:at])]


@pytest.mark.parametrize("seed", range(60))
def test_the_first_runs_of_what_does_the_same_and_has_none_above_it(seed: int) -> None:
    text, names, uppers, same = drawn(Random(seed))  # noqa: S311 - a draw that repeats
    program = program_of(text)
    parsed = parse(Source("case.rcs", text))
    assert isinstance(parsed, tree.File)
    plain = program_of(
        format_file(tree.File(tuple(
            tree.TableDecl(d.name, d.assuming, d.conditions, d.actions, tuple(tree.Row(r.name, r.conditions, r.actions) for r in d.rows))
            if isinstance(d, tree.TableDecl) else d for d in parsed.declarations
        )))
    )  # fmt: skip
    text = format_file(tree.File(tuple(
        expanded(d, program.tables[0]) if isinstance(d, tree.TableDecl) else d for d in parsed.declarations
    )))  # fmt: skip
    shown = compile_text(text)
    if not isinstance(shown, Program):  # a line wholly below others
        assert set(codes(shown)) == {"RCS314"}
        shown = program
    for snapshot in snapshots(plain):
        raw = [str(name) for name in matching_lines(plain.tables[0], snapshot)]
        runs = running(names, raw, uppers, same)
        assert matching_lines(program.tables[0], snapshot) == runs
        assert matching_lines(shown.tables[0], snapshot) == runs
        assert bool(runs) == bool(raw)  # never a gap that was not there
        for meeting in program.tables[0].meetings:
            pair = {str(meeting.first), str(meeting.second)}
            met = pair.issubset(raw) and not (
                meeting.same and any(uppers[name].intersection(raw) for name in pair)
            )
            assert evaluate(meeting.where, snapshot) == met
    meetings = {
        frozenset((meeting.first, meeting.second)) for meeting in program.tables[0].meetings if meeting.same
    }
    assert meetings >= {
        frozenset(pair)
        for pair in combinations(names, 2)
        if pair[1] in same[pair[0]]
        and any(
            set(pair).issubset(matching_lines(plain.tables[0], snapshot)) for snapshot in snapshots(plain)
        )
    }


def test_what_it_comes_to_is_the_least_that_parts_the_lines_and_is_shown() -> None:
    program = program_of(MACHINE)
    lines = {line.name: (program.tables[0].added(line), line.below) for line in program.tables[0].lines}
    assert lines == {
        "ended": ("called not in {stop, hold} and near - far <= 1 and near + far /= 5", ("stop", "hold", "wide", "odd")),
        "stop": ("", ()),
        "hold": ("not (done = true and near - far > 1) and not (done = true and near + far = 5)", ("wide", "odd")),
        "wide": ("called /= stop and near + far /= 5", ("stop", "odd")),
        "odd": ("called /= stop", ("stop",)),
        "rest": ("", ()),
    }  # fmt: skip
    [note] = [found for found in reported(MACHINE) if found.code.value == "RCS424"]
    assert note.severity is Severity.NOTE
    assert "below `stop`, only where called /= stop: `odd`" in note.notes


def test_lines_that_give_way_alike_share_one_test() -> None:
    [table] = program_of(f"""{HEAD}
table t {{
  | line         | called | near || now |
  | a            | none   | 0    || now |
  | b            | hold   | 0    || now |
  | top above all|        | > 2  || now |
  | c above a    | none   | < 2  || now |
}}""").tables
    assert [line.below for line in table.lines] == [("c",), (), (), ()]  # `> 2` meets none of them
    [one, two] = (
        program_of(f"""{HEAD}
table t {{
  | line          | called | done || now |
  | a             | none   |      || now |
  | b             | hold   |      || now |
  | top above all |        | true || now |
}}""")
        .tables[0]
        .lines[:2]
    )
    assert one.tests[-1] is two.tests[-1] is not None


def test_lines_of_boxes_stay_boxes() -> None:
    chain = f"""{HEAD}
table t {{
  | line         | called | done | near || now   |
  | one above two | stop  |      |      || true  |
  | two above six |       | true |      || false |
  | six above ten |       |      | > 2  || true  |
  | ten           |       |      |      || now   |
}}"""
    verdict = verdict_of(chain)
    assert verdict.proved is not None
    assert verdict.tables[0].backing.method == "boxes"
    [table] = verdict.proved.program.tables
    assert table.added(table.lines[3]) == "called /= stop and done = false and near <= 2"
    assert [column.written for column in table.columns] == [True] * 3 + [False] * 3


def test_the_cells_of_a_line_keep_their_places() -> None:
    [table] = program_of(MACHINE).tables
    written = sum(column.written for column in table.columns)
    for line in table.lines:
        for column, test in enumerate(line.tests[:written]):
            span = line.cell_span(column)
            assert MACHINE[span.start : span.end] == ("" if test is None else test.text)
        assert {line.cell_span(-1)} == {line.cell_span(at) for at in range(written, len(line.tests))}
        span = line.cell_span(-1)
        assert MACHINE[span.start : span.end] == line.name


def test_all_is_every_line_but_those_above_or_above_all() -> None:
    [table] = program_of(f"""{HEAD}
table t {{
  | line             | called | done | near || now |
  | one above all    | stop   |      |      || now |
  | low              |        | true |      || now |
  | two above all    | hold   |      |      || now |
  | top above one    |        |      | 0    || now |
}}""").tables
    assert {line.name: set(line.below) for line in table.lines} == {
        "low": {"one", "two", "top"},
        "one": {"top"},
        "two": set(),
        "top": {"two"},
    }


NO_NAME = "a line needs a name of letters, digits and `_`"


@pytest.mark.parametrize(
    ("cell", "what", "helps"),
    [
        ("ended above stops", "no line of table `unit` is called `stops`", "did you mean `stop`?"),
        ("ended above ended", "line `ended` stands above itself", ""),
        ("ended above hold", "lines stand above each other in a circle: `ended` above `hold` above `ended`", "take one of these out"),
        ("ended above odd", "lines stand above each other in a circle: `ended` above `odd` above `ended`", "take one of these out"),
        ("ended same stops", "no line of table `unit` is called `stops`", "did you mean `stop`?"),
        ("ended same ended", "line `ended` is said to do the same as itself", ""),
        ("ended above rest same rest", "one of `ended` and `rest` stands above the other, and both are said to do the same", ""),
        ("ended above hold,", NO_NAME, MARKS),
        ("ended over hold", NO_NAME, MARKS),
    ],
)  # fmt: skip
def test_an_order_that_cannot_be_is_refused_at_its_place(cell: str, what: str, helps: str) -> None:
    text = edited(MACHINE, ("| ended                ", f"| {cell} "))
    found = refused(text)
    assert found[0].message == what
    assert found[0].help == ((helps,) if helps else ())
    span = found[0].primary.span
    assert text[span.start : span.end] in cell


@pytest.mark.parametrize(
    ("rows", "what"),
    [
        (["a above rest | stop", "rest | DEFAULT"], "`rest` is the DEFAULT line: every line stands above it"),
        (["a | stop", "rest above a | DEFAULT"], "the DEFAULT line `rest` runs where no other matches: it stands above none"),
        (["a same rest | stop", "rest | DEFAULT"], "the DEFAULT line `rest` runs where no other matches: it does the same as none"),
        (["a | ", "b same a | stop"], "line `a` matches every input: none that gives way to it could ever match"),
        (["a above all | stop", "all | hold"], "`all` means every other line, and there is a line of that name"),
        (["a above b | ", "b | stop"], "line `a` matches every input: none that gives way to it could ever match"),
    ],
)  # fmt: skip
def test_default_and_lines_that_match_everything_stand_above_none(rows: list[str], what: str) -> None:
    body = "\n".join(f"| {row} || now |" for row in rows)
    found = refused(f"{HEAD}\ntable t {{\n| line | called || now |\n{body}\n}}")
    assert [(finding.code.value, finding.message) for finding in found] == [("RCS217", what)]


def test_a_line_wholly_below_others_never_matches_and_says_why() -> None:
    text = f"""{HEAD}
table t {{
  | line          | called       | done || now |
  | a above low   | stop         |      || now |
  | b above low   | in {{none, hold}} |  || now |
  | low           |              | true || now |
}}"""
    [dead] = [finding for finding in reported(text) if finding.severity is Severity.ERROR]
    assert (dead.code.value, dead.message) == ("RCS403", "line `low` of table `t` can never match")
    assert dead.notes == ("wherever its cells hold one of these matches, which go before it: `a`, `b`",)
    whole = edited(
        text, ("| low           |              | true |", "| low           | stop         | true |")
    )
    assert "RCS403" in codes(reported(whole))


def test_what_is_not_ordered_still_overlaps() -> None:
    overlapping = edited(MACHINE, ("hold above ended", "hold            "))
    overlaps = [finding for finding in reported(overlapping) if finding.severity is Severity.ERROR]
    assert (
        [overlap.message for overlap in overlaps]
        == [
            "lines `ended` and `hold` of table `unit` both match some input",
            "lines `ended` and `wide` of table `unit` both match some input",  # `wide` stood above it through `hold`
        ]
    )


def test_a_gap_is_closed_by_a_line_of_the_written_columns() -> None:
    rest = "  | rest                 | none   | false|            |                || now   |\n"
    gap = edited(MACHINE, (rest, ""))
    [finding] = [finding for finding in reported(gap) if finding.severity is Severity.ERROR]
    row = finding.help[0].partition("`| ")[2].partition(" ||")[0]
    assert row.count("|") == 4
    closed = gap.replace("\n}\n", f"\n| {row} || now |\n}}\n")
    assert not [finding for finding in reported(closed) if finding.severity is Severity.ERROR]


def test_the_order_stands_in_the_first_part_alone() -> None:
    parted = f"""{HEAD}
table t {{
  | line        | called ||
  |-------------|--------||
  | a above b   | stop   ||
  | b           | /= none||
  | c           | none   ||

  | line || now   |
  |------||-------|
  | a    || true  |
  | b    || false |
  | c    ||       |
}}"""
    assert [line.below for line in program_of(parted).tables[0].lines] == [(), ("a",), ()]
    [found] = refused(edited(parted, ("| a    || true", "| a above b || true")))
    assert found.message == "`above` stands in a further part of the table"


def test_layout_keeps_it_and_parses_back() -> None:
    for width in (110, 40):
        parsed = parse(Source("", MACHINE))
        assert isinstance(parsed, tree.File)
        text = format_file(parsed, width)
        assert "odd above ended, wide" in text
        assert parse(Source("", text)) == parsed


def test_the_graph_holds_it_and_what_is_read_back_does_the_same(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "unit.rcs"
    path.write_text(MACHINE, encoding="utf-8")
    for form in ("dot", "scxml", "mermaid"):
        assert run(["graph", str(path), "--state", "now", "--form", form]) == 0
        shown = capfd.readouterr()
        assert "the table read back from the graph does the same: proved" in shown.err
        assert "called /= stop" in shown.out
    assert run(["graph", str(path), "--lines", "--form", "dot"]) == 0


def test_fmt_expanded_prints_a_table_that_does_the_same(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, other = tmp_path / "unit.rcs", tmp_path / "other.rcs"
    path.write_text(MACHINE, encoding="utf-8")
    assert run(["fmt", "--expanded", str(path)]) == 0
    other.write_text(capfd.readouterr().out, encoding="utf-8")
    assert path.read_text(encoding="utf-8") == MACHINE
    assert "above" not in other.read_text(encoding="utf-8")
    assert run(["diff", str(path), str(other)]) == 0
    assert "proved: nothing changed" in capfd.readouterr().out
    assert run(["fmt", "--expanded", "--check", str(path)]) == 2
    path.write_text("use nowhere\n", encoding="utf-8")
    assert run(["fmt", "--expanded", str(path)]) == 1
    assert expand((str(path),), None).texts == {}


def test_both_executors_do_it_and_their_code_says_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "unit.rcs"
    path.write_text(MACHINE, encoding="utf-8")
    assert run(["test", "--examples", "20", "--mutants", "0", "--no-cortex", str(path)]) == 0
    assert "interpreter = Python = C" in capfd.readouterr().out
    assert run(["compile", str(path), "--out", str(tmp_path / "out")]) == 0
    code = (tmp_path / "out" / "c" / "unit.c").read_text()
    assert re.search(r"unit\.rcs line wide: [^*]*no line above it: stop, odd", code)


def test_masks_that_part_lines_or_follow_are_not_said_again() -> None:
    [table] = program_of("""
input w : int 0 .. 65535
input done : bool
state n : bool
table t {
  | line        | w[7..0]   | w[15] | done || n     |
  | a           | x0xx 1xxx |       | true || true  |
  | b above all | x0xx xxxx |       | true || true  |
  | c           | x1xx 0000 | true  |      || false |
  | d above c   | x1xx 0xxx |       | true || false |
  | e above d   |           | false |      || false |
}""").tables
    added = {line.name: (table.added(line), line.below) for line in table.lines}
    assert added == {
        "a": ("not (w[7..0] = 0bx0xx_xxxx and done = true)", ("b",)),  # it says so twice: it never matches
        "b": ("", ()),
        "c": ("done = false", ("d",)),
        "d": ("w[15] = true", ("e",)),
        "e": ("not (w[7..0] = 0bx0xx_xxxx and done = true)", ("b",)),
    }


NAN = {
    "single(a) * 2e38 - single(a) * 2e38": (">= 0.0", "<= 1.0", "< 1.0", "> -1.0"),
    "x * 1e308 - y * 1e308": (">= 0.5", "< 2.0", "= 0.0", "/= 0.0", "in {0.0, 1.0}", "0.0 .. 1.0"),
    "x - y": ("<= 0.5", "> 1.0"),
    "a - b": ("<= 0", "> 1"),
}


@pytest.mark.parametrize("heading", NAN)
def test_what_a_line_gives_way_to_is_said_so_that_a_nan_changes_nothing(heading: str) -> None:
    """A comparison is turned only where neither side can be a NaN: for one, `a < b` and `a >= b` are both false."""
    for cell in NAN[heading]:
        text = f"""input a : int 0 .. 3
input b : int 0 .. 3
input x : real 0.0 .. 4.0
input y : real 0.0 .. 4.0
output o : int 0 .. 3
table t {{
  | line | {heading} || o |
  | up above low | {cell} || 1 |
  | low | || 2 |
}}
"""
        program = program_of(text)
        parsed = parse(Source("", text))
        assert isinstance(parsed, tree.File)
        other = program_of(format_file(tree.File(tuple(
            expanded(d, program.tables[0]) if isinstance(d, tree.TableDecl) else d for d in parsed.declarations
        ))))  # fmt: skip
        for a, b, x, y in product(range(4), range(4), (0.0, 1.0, 4.0), (0.0, 1.0, 4.0)):
            now: dict[str, Value] = {"a": a, "b": b, "x": x, "y": y, "o": 0}
            assert matching_lines(other.tables[0], now) == matching_lines(program.tables[0], now), (cell, now)


def test_a_long_chain_over_masks_comes_to_an_end_within_its_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Past its nodes the tree asks the solver about a few regions, and leaves the rest undecided: each node and question costs."""
    random, rows = Random(2), list[str]()  # noqa: S311 - a draw that repeats
    for at in range(15):
        mask = "".join(random.choice("xxxxxxxx01") for _ in range(32))
        rows.append(f"| n{at}{f' above n{at + 1}' if at < 14 else ''} | 0b{mask} || {at} |")
    text = "input w : int 0 .. 4294967295\noutput o : int 0 .. 99\ntable t {\n| line | w || o |\n"
    program = program_of(f"{text}{chr(10).join(rows)}\n| r | DEFAULT || 99 |\n}}\n")
    asked = list[Question]()

    def refuted(question: Question) -> NoWitness:
        asked.append(question)
        return NoWitness.NONE

    decision = relational._Decision(program, program.tables[0], BOXES)
    monkeypatch.setattr(decision, "oracle", refuted)
    search = decision.search(())
    nodes = FEWEST_NODES + 15 * NODES_OF_A_LINE
    assert nodes < len(search.nodes) <= nodes + 200
    assert 0 < len(asked) <= MOST_PAST
