"""The studio's tables: a grid and a text of one file, whose findings are those of the command line; and what is never lost or made up."""

import asyncio
import json
import random
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.read import Malformed
from rcsc.desk.editor.places import Lines, difference
from rcsc.desk.shell.opening import Opening
from rcsc.desk.studio.tables import cells
from rcsc.desk.studio.tables.document import MOST_BYTES
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.front.commands.group import commands
from rcsc.lang.interpret import holds, matching_lines
from rcsc.lang.model import Program, key_bounds, value_of_key
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.lang.written.tables import tables_of
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.findings.unread import TOLD
from rcsc.views.graph.derive import Derived, derive
from tests.studio.served import page, serving
from tests.studio.tabled import Bench, rows

REPO = Path(__file__).parents[2]
SMALL = ["examples/grip.rcs", "gallery/tcas/tcas.rcs", "gallery/cia402/drive.rcs", "gallery/safety_injection/published.rcs",
         "gallery/railway_interlocking/interlocking.rcs", "task/pause.rcs", "gallery/ros2_lifecycle/lifecycle.rcs"]  # fmt: skip
TABLE = """enum mode {{ off, on, stuck }}
input now : mode
input w : int 0 .. 9
output out : int 0 .. 3

table t {{
  | line | now    | w    || out |
  |------|--------|------||-----|
  | a    | off    | {low} || 1   |
  | b    | /= off |      || 2   |
}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "t.rcs").write_text(TABLE.format(low="    "))
    return tmp_path


@pytest.fixture
def bench(folder: Path) -> Bench:
    return Bench(folder / "system.toml")


@pytest.fixture
def shipped(tmp_path: Path) -> Path:
    shutil.copytree(REPO / "tables", tmp_path / "tables")
    return tmp_path / "tables"


def state(doc: Any, at: int = 0) -> str:
    return str(doc["tables"][at]["standing"]["state"])


def matrix(doc: Any, table: str) -> tuple[list[str], list[list[str]]]:
    """A table as the page shows it."""
    shown = next(each for each in doc["tables"] if each["name"] == table)
    return [each["heading"] for each in shown["columns"]], [
        [row["stub"], *row["cells"]] for row in shown["rows"]
    ]


# --- the grid, the text, and the command line ------------------------------------------------


def drawn_change(doc: Any, draw: random.Random) -> tuple[str, dict[str, Any]]:
    """A change that somebody makes in a grid: cells, pasted rectangles, lines, columns."""
    table = draw.choice(doc["tables"])
    many, wide = len(table["rows"]), len(table["columns"])
    conditions = sum(each["kind"] == "condition" for each in table["columns"])
    texts = [cell for row in table["rows"] for cell in row["cells"]]
    line, column = draw.randrange(max(1, many)), draw.randrange(wide)
    match draw.randrange(12):
        case 0:
            return "tables.line", {"table": table["name"], "at": draw.randrange(many + 1)}
        case 1 if many > 1:
            return "tables.delete", {"table": table["name"], "lines": [{"line": line}]}
        case 2:
            heading = draw.choice(["when", table["columns"][column]["heading"]])
            return "tables.column", {
                "table": table["name"],
                "at": draw.randrange(conditions + 1),
                "heading": heading,
            }
        case 3 if wide > 2:
            return "tables.delete", {"table": table["name"], "column": column}
        case 4:
            size = draw.randrange(1, 4), min(wide - column, draw.randrange(1, 4))
            block = [[draw.choice(texts) for _ in range(size[1])] for _ in range(size[0])]
            return "tables.cells", {
                "table": table["name"],
                "line": line,
                "column": column,
                "rows": rows(*block),
            }
        case 5:
            return "tables.cells", {
                "table": table["name"],
                "line": line,
                "column": -1,
                "rows": rows([draw.choice(["x", "9", "new_1"])]),
            }
        case _:
            text = draw.choice([*texts, "", "true", "false", "in {", "/= 3", "0 .. 2", "nobody", "DEFAULT"])
            return "tables.cells", {
                "table": table["name"],
                "line": line,
                "column": column,
                "rows": rows([text]),
            }


def found_by_check(file: Path) -> list[tuple[str, str, int]]:
    report = check(Settings((str(file),), Options(), use_cache=False))
    lines = {name: Lines(source.text) for name, source in report.sources.items()}
    spans = [(each, each.primary.span) for each in report.diagnostics if each.code not in TOLD]
    return sorted(
        (each.code.value, each.message, lines[span.file].place(span.start).line) for each, span in spans
    )


def test_random_edits_of_a_grid_are_edits_of_the_text_and_get_the_verdict_of_a_check(shipped: Path) -> None:
    """More of them: `python -m tests.studio.test_tables 1000`."""
    edited_at_random(shipped, 40)


def edited_at_random(shipped: Path, count: int) -> None:
    draw = random.Random(count)  # noqa: S311  # a test draws the same again
    grid, text = Bench(shipped / "system.toml"), Bench(shipped / "system.toml")
    done = right = 0
    while done < count:
        file = draw.choice(SMALL)
        doc, other = grid.open(file), text.open(file)
        original = doc["text"]
        for _ in range(draw.randrange(1, 7)):
            kind, body = drawn_change(doc, draw)
            try:
                doc = grid.change(kind, file, **body)
            except Refused:
                assert grid.doc(file) == doc
                continue
            edits = difference("", Lines(other["text"]), doc["text"])
            sent = [
                {"start_line": each.area.start.line, "start_column": each.area.start.column, "end_line": each.area.end.line,
                 "end_column": each.area.end.column, "text": each.text}
                for each in edits
            ]  # fmt: skip
            other = text.change("tables.edit", file, edits=sent)
            assert other["text"] == doc["text"]
            assert (other["findings"], other["tables"]) == (doc["findings"], doc["tables"])
            (shipped / file).write_text(doc["text"])
            seen = sorted(
                (each["code"], each["message"], each["area"][0][0])
                for each in doc["findings"]
                if not each["meanwhile"] and each["area"]
            )
            assert seen == found_by_check(shipped / file), doc["text"]
            wrong = any(each["severity"] == "error" for each in doc["findings"])
            assert not (
                wrong
                and all(state(doc, at).startswith(("proved", "rests")) for at in range(len(doc["tables"])))
            )
            right += not wrong
            (shipped / file).write_text(original)
            done += 1
        while grid.told[f"tables.file/{file}"]["undo"]:
            grid.now("tables.undo", file)
        while text.told[f"tables.file/{file}"]["undo"]:
            text.now("tables.undo", file)
        assert grid.doc(file)["text"] == original
    assert 0 < right < count


def test_a_cell_says_what_was_typed(bench: Bench) -> None:
    bench.open("t.rcs")
    doc = bench.change("tables.cells", "t.rcs", table="t", line=0, column=1, rows=rows(["<= 4"]))
    assert matrix(doc, "t")[1][0] == ["a", "off", "<= 4", "1"]
    assert "  | a    | off    | <= 4 || 1   |\n" in doc["text"]
    assert state(doc) == "refuted"
    [finding] = [each for each in doc["findings"] if each["code"] == "RCS401"]
    [witness] = finding["witnesses"]
    assert witness["columns"] == ["off", "5"]
    assert witness["regions"] == ["now = off", "w >= 5"]
    assert {name: each["failed"] for name, each in witness["rows"].items()} == {"a": [1], "b": [0]}
    assert doc["tables"][0]["rows"][0]["share"] == {"text": "16.7 %", "of": "5 of 30 inputs"}


@pytest.mark.parametrize("typed", ["a | b", "# no", "1 || 2", "\x00", "\u202e", "é" * 5000])
def test_what_no_cell_can_hold_is_refused_and_changes_nothing(typed: str, bench: Bench) -> None:
    before = bench.open("t.rcs")
    with pytest.raises(Refused):
        bench.change("tables.cells", "t.rcs", table="t", line=0, column=1, rows=rows([typed]))
    assert bench.doc("t.rcs") == before


@pytest.mark.parametrize("half", ["in {", "<=", "nobody", "(", ".. 3", '"'])
def test_half_written_cells_are_kept_and_never_called_proved(half: str, bench: Bench) -> None:
    bench.open("t.rcs")
    doc = bench.change("tables.cells", "t.rcs", table="t", line=0, column=1, rows=rows([half]))
    assert matrix(doc, "t")[1][0][2] == half
    assert state(doc) in ("has errors", "stale")
    assert doc["findings"]
    doc = bench.change("tables.cells", "t.rcs", table="t", line=0, column=1, rows=rows([""]))
    assert state(doc) == "proved"
    assert matrix(doc, "t") == (["now", "w", "out"], [["a", "off", "", "1"], ["b", "/= off", "", "2"]])


def test_a_pasted_rectangle_adds_the_lines_that_it_needs(bench: Bench) -> None:
    bench.open("t.rcs")
    block = [["off", "<= 4", "1"], ["off", ">= 5", "3"], ["on", "", "2"], ["stuck", "", "2"]]
    doc = bench.change("tables.cells", "t.rcs", table="t", line=0, column=0, rows=rows(*block))
    assert [row[1:] for row in matrix(doc, "t")[1]] == block
    assert state(doc) == "proved"
    assert doc["undo"] == "paste"
    assert len(matrix((bench.now("tables.undo", "t.rcs"), bench.doc("t.rcs"))[1], "t")[1]) == 2
    with pytest.raises(Refused):
        bench.change("tables.cells", "t.rcs", table="t", line=0, column=1, rows=rows(["1", "2", "3"]))


DEFAULT = TABLE.replace(
    "  | b    | /= off |      || 2   |",
    "  | b    | on     |      || 2   |\n  | rest | DEFAULT |     || 3   |",
)


@pytest.mark.parametrize(
    ("line", "column", "block", "firsts"),
    [
        (1, 0, [["on", "1"], ["stuck", "2"], ["off", "3"]], ["off", "on", "stuck", "off", "DEFAULT"]),
        (1, 0, [["on", "1"], ["stuck", "2"]], ["off", "on", "stuck", "DEFAULT"]),
        (1, -1, [["b", "on"], ["c", "stuck"]], ["off", "on", "stuck", "DEFAULT"]),
        (0, 0, [["off", ""], ["on", ""], ["stuck", ""], ["DEFAULT", ""]], ["off", "on", "stuck", "DEFAULT"]),
        (1, 2, [["1"], ["2"]], ["off", "on", "DEFAULT"]),
        (1, 0, [["", ""], ["", ""]], ["off", "", ""]),
        (2, 0, [["stuck"]], ["off", "on", "stuck"]),
    ],
)
def test_a_paste_that_begins_above_default_goes_before_it(
    line: int, column: int, block: list[list[str]], firsts: list[str], folder: Path, bench: Bench
) -> None:
    (folder / "t.rcs").write_text(DEFAULT.format(low="    "))
    bench.open("t.rcs")
    doc = bench.change("tables.cells", "t.rcs", table="t", line=line, column=column, rows=rows(*block))
    assert [row[1] for row in matrix(doc, "t")[1]] == firsts


def test_lines_go_before_default_and_follow_new_names(shipped: Path) -> None:
    bench = Bench(shipped / "system.toml")
    doc = bench.open("gallery/etcs_modes/code.rcs")
    names = [row["name"] for row in doc["tables"][0]["rows"]]
    named = next(
        row
        for row in doc["tables"][0]["rows"]
        if " above " in row["stub"] and " above all" not in row["stub"]
    )
    goal = named["stub"].split(" above ")[1].split(",")[0]
    at = names.index(goal)
    stub = doc["tables"][0]["rows"][at]["stub"].replace(goal, "another_name", 1)
    after = bench.change(
        "tables.cells", "gallery/etcs_modes/code.rcs", table="modes", line=at, column=-1, rows=rows([stub])
    )
    assert next(row for row in after["tables"][0]["rows"] if row["name"] == named["name"])["stub"] == named[
        "stub"
    ].replace(goal, "another_name")
    assert (state(after), len(after["findings"])) == (state(doc), len(doc["findings"]))


# --- one history, and the disk ---------------------------------------------------------------


def test_typing_is_undone_by_words_and_everything_can_be_undone(bench: Bench) -> None:
    doc = bench.open("t.rcs")
    begun = doc["text"]
    for at, letter in enumerate("# on"):
        edit = {"start_line": 0, "start_column": at, "end_line": 0, "end_column": at, "text": letter}
        doc = bench.change("tables.edit", "t.rcs", edits=[edit])
    assert doc["text"] == "# on" + begun
    bench.change("tables.line", "t.rcs", table="t", at=1)
    bench.change("tables.column", "t.rcs", table="t", at=1, heading="w", action=False)
    texts = [bench.doc("t.rcs")["text"]]
    while bench.doc("t.rcs")["undo"]:
        bench.now("tables.undo", "t.rcs")
        texts.append(bench.doc("t.rcs")["text"])
    assert len(texts) <= 6
    assert texts[-1] == begun
    assert not bench.doc("t.rcs")["dirty"]
    for text in texts[-2::-1]:
        bench.now("tables.redo", "t.rcs")
        assert bench.doc("t.rcs")["text"] == text
    with pytest.raises(Refused):
        bench.now("tables.redo", "t.rcs")


@pytest.mark.parametrize(("end", "mark"), [("\n", b""), ("\r\n", b""), ("\r\n", b"\xef\xbb\xbf")])
def test_a_file_is_written_as_fmt_would(end: str, mark: bytes, folder: Path) -> None:
    file = folder / "t.rcs"
    file.write_bytes(mark + TABLE.format(low="<=     4").replace("\n", end).encode())
    bench = Bench(folder / "system.toml")
    bench.open("t.rcs")
    doc = bench.change(
        "tables.edit",
        "t.rcs",
        edits=[{"start_line": 1, "start_column": 0, "end_line": 1, "end_column": 0, "text": "\n\n\n# é\n"}],
    )
    assert bench.ask("tables.save", file="t.rcs")["made"]
    raw = file.read_bytes()
    assert raw.startswith(mark)
    assert raw.count(b"\n") == raw.count(end.encode())
    ran = CliRunner().invoke(commands, ["fmt", "--check", str(file)])
    assert ran.exit_code == 0, ran.output
    assert not bench.doc("t.rcs")["dirty"]
    bench.now("tables.undo", "t.rcs")
    assert bench.doc("t.rcs")["text"] == doc["text"]


def test_what_others_wrote_is_not_overwritten_unseen(folder: Path, bench: Bench) -> None:
    file = folder / "t.rcs"
    bench.open("t.rcs")
    doc = bench.change("tables.line", "t.rcs", table="t", at=2)
    file.write_text(TABLE.format(low="<= 4"))
    with pytest.raises(Refused, match="changed on disk"):
        bench.ask("tables.save", file="t.rcs")
    assert file.read_text() == TABLE.format(low="<= 4")
    bench.now("tables.take", "t.rcs")
    assert bench.doc("t.rcs")["text"] == TABLE.format(low="<= 4")
    bench.now("tables.undo", "t.rcs")
    assert bench.doc("t.rcs")["text"] == doc["text"]
    file.write_text("# others again\n")
    bench.ask("tables.save", file="t.rcs", over=True)
    assert file.read_text() == bench.doc("t.rcs")["text"]
    file.unlink()
    with pytest.raises(Refused, match="no longer on disk"):
        bench.ask("tables.save", file="t.rcs")
    assert not file.exists()


def test_a_file_without_changes_follows_the_disk(folder: Path, bench: Bench) -> None:
    bench.open("t.rcs")
    (folder / "t.rcs").write_text(TABLE.format(low="<= 4"))
    doc = bench.open("t.rcs")
    assert (state(doc), doc["dirty"]) == ("refuted", False)
    bench.change("tables.line", "t.rcs", table="t", at=2)
    (folder / "t.rcs").write_text("# others\n")
    assert bench.ask("tables.open", file="t.rcs")["disk"] == "changed"
    assert "table t" in bench.doc("t.rcs")["text"]


@pytest.mark.parametrize(
    "name",
    [
        "../t.rcs",
        "/etc/passwd",
        "none.rcs",
        "linked.rcs",
        "t.toml",
        "",
        ".",
        "latin.rcs",
        "big.rcs",
        "\0.rcs",
    ],
)
def test_only_texts_of_the_project_are_opened(
    name: str, folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    outside = tmp_path_factory.mktemp("outside") / "secret.rcs"
    outside.write_text("# secret\n")
    (folder / "linked.rcs").symlink_to(outside)
    (folder / "t.toml").touch()
    (folder / "latin.rcs").write_bytes(b"# \xe9\n")
    (folder / "big.rcs").write_bytes(b"#" * (MOST_BYTES + 1))
    bench = Bench(folder / "system.toml")
    with pytest.raises(Refused):
        bench.ask("tables.open", file=name)
    assert not bench.told


def test_a_change_of_a_used_file_is_seen_by_its_users(folder: Path) -> None:
    (folder / "words.rcs").write_text("enum mode { off, on, stuck }\n")
    (folder / "t.rcs").write_text("use words\n" + TABLE.format(low="    ").partition("\n")[2])
    bench = Bench(folder / "system.toml")
    assert state(bench.open("t.rcs")) == "proved"
    (folder / "words.rcs").write_text("enum mode { off, on, stuck }\n# kept\n")
    bench.open("words.rcs")
    bench.change(
        "tables.edit",
        "words.rcs",
        edits=[{"start_line": 0, "start_column": 12, "end_line": 0, "end_column": 15, "text": "of"}],
    )
    assert state(bench.doc("t.rcs")) != "proved"


# --- the prover -----------------------------------------------------------------------------


def test_the_published_acquire_is_mended_by_its_repairs_alone(shipped: Path) -> None:
    file = "examples/acquire_published.rcs"
    bench = Bench(shipped / "system.toml")
    doc = bench.open(file)
    assert len([each for each in doc["findings"] if each["code"] == "RCS402"]) == 5
    for left in range(4, -1, -1):
        finding = next(each for each in doc["findings"] if each["mendable"])
        [repair] = bench.ask("proof.repairs", file=file, version=doc["version"], finding=finding["id"])
        doc = bench.change("proof.repair", file, finding=finding["id"], repair=repair["id"])
        assert len([each for each in doc["findings"] if each["code"] == "RCS402"]) == left
        assert doc["undo"] == repair["title"]
    assert state(doc) in ("proved", "proved, trusting")
    bench.ask("tables.save", file=file)
    assert not [
        each for each in found_by_check(shipped / file) if each[0].startswith("RCS40") and each[0] != "RCS407"
    ]


@pytest.mark.parametrize(
    "file",
    [
        "examples/acquire_published.rcs",
        *(f"gallery/{name}/published.rcs" for name in ("lm_fsm", "packml", "elevator")),
    ],
)
def test_an_input_that_shows_a_finding_is_run(file: str, shipped: Path) -> None:
    """The interpreter finds the lines that the prover named; a gap and an overlap are what the robot would end with."""
    bench = Bench(shipped / "system.toml")
    doc = bench.open(file)
    ran = 0
    for finding in doc["findings"]:
        for at, witness in enumerate(finding["witnesses"] if finding["code"] in {"RCS401", "RCS402"} else ()):
            told = bench.now("proof.run", file, finding=finding["id"], input=at)
            matching = [line.split("`")[1] for line in told["lines"] if "` matches, and would set: " in line]
            assert matching == witness["lines"]
            assert len(matching) != 1
            assert told["comes"].startswith(
                f"{len(matching)} of {len(told['lines'])} lines match: a STATE-TABLE error"
            )
            ran += 1
    assert ran
    with pytest.raises(Refused, match="no such input"):
        bench.now("proof.run", file, finding=0, input=99)


EXTERNAL = """input now : bool
input w : int 0 .. 9
output out : int 0 .. 3
extern procedure theirs writes out
  python "somebody:does" c "does"
procedure small { out := min(w, 3) }
table t {
  | line | now  | w   || procedures |
  |------|------|-----||------------|
  | a    |      | < 5 || theirs     |
  | b    | true |     || small      |
}
"""


def test_what_is_run_at_an_input_calls_nobody_s_program(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    called: list[str] = []
    monkeypatch.setattr("rcsc.lang.interpret.importlib.import_module", called.append)
    (folder / "t.rcs").write_text(EXTERNAL)
    bench = Bench(folder / "system.toml")
    finding = next(each for each in bench.open("t.rcs")["findings"] if each["code"] == "RCS402")
    a, b = bench.now("proof.run", "t.rcs", finding=finding["id"], input=0)["lines"]
    assert a.startswith("line `a` matches")
    assert a.endswith("`theirs` is an extern procedure, and is not called")
    assert b.startswith("line `b` matches, and would set: ")
    assert not called


def test_a_repair_of_another_text_is_refused(shipped: Path) -> None:
    file = "examples/acquire_published.rcs"
    bench = Bench(shipped / "system.toml")
    doc = bench.open(file)
    finding = next(each for each in doc["findings"] if each["mendable"])
    bench.ask("proof.repairs", file=file, version=doc["version"], finding=finding["id"])
    bench.change("tables.line", file, table="acquire", at=0)
    changed = bench.doc(file)
    with pytest.raises(Refused, match="meanwhile"):
        bench.ask("proof.repair", file=file, version=doc["version"], finding=finding["id"], repair=0)
    assert bench.doc(file)["text"] == changed["text"]


def every_input(program: Program) -> list[dict[str, Any]]:
    points: list[dict[str, Any]] = [{}]
    for variable in program.variables:
        low, high = key_bounds(variable.type)
        values = [value_of_key(variable.type, key) for key in range(low, high + 1)]
        points = [{**point, variable.name: value} for point in points for value in values]
    return points


@pytest.mark.parametrize(
    "condition",
    [
        "now = off",
        "w >= 8 and now /= on",
        "w + w = 7",
        "not now = off or w = 2",
        "true",
        "false",
        "w / 3 = 2",
    ],
)
def test_a_filter_shows_the_lines_that_match_where_the_condition_holds(condition: str, folder: Path) -> None:
    text = (
        TABLE.format(low="<= 4").replace("  | b ", "  | c    | off    | >= 7 || 3   |\n  | b ")
        + f"assume held : {condition}\n"
    )
    (folder / "t.rcs").write_text(text)
    program = resolve(str(folder / "t.rcs"), load([str(folder / "t.rcs")]))
    assert isinstance(program, Program)
    [held], [table] = program.assumptions, program.tables
    inputs = every_input(program)
    inside = {
        str(name) for point in inputs if holds(held.condition, point) for name in matching_lines(table, point)
    }
    outside = {
        str(name)
        for point in inputs
        if not holds(held.condition, point)
        for name in matching_lines(table, point)
    }
    bench = Bench(folder / "system.toml")
    doc = bench.open("t.rcs")
    told = bench.ask("proof.filter", file="t.rcs", version=doc["version"], table="t", condition=condition)
    assert (set(told["can"]), set(told["every"]), told["unknown"]) == (inside, inside - outside, ())


def test_a_filter_that_nobody_can_answer_hides_nothing(folder: Path) -> None:
    (folder / "t.rcs").write_text(TABLE.format(low="    "))
    bench = Bench(folder / "system.toml")
    bench.desk.workspace.options = Options(steps=1)
    doc = bench.open("t.rcs")
    told = bench.ask(
        "proof.filter", file="t.rcs", version=doc["version"], table="t", condition="w * w * w = w * w + 5"
    )
    assert set(told["can"]) | set(told["unknown"]) == {"a", "b"}


@pytest.mark.parametrize(
    "condition",
    [
        "",
        "now",
        "nobody = 3",
        "now = off\nassume b : false",
        "true table x {",
        "x" * 5000,
        "now = off #",
        "w := 3",
        "now = off || w",
    ],
)
def test_what_is_no_condition_filters_nothing(condition: str, bench: Bench) -> None:
    doc = bench.open("t.rcs")
    with pytest.raises(Refused):
        bench.ask("proof.filter", file="t.rcs", version=doc["version"], table="t", condition=condition)


@pytest.mark.parametrize(
    "file", ["task/acquire.rcs", "gallery/cia402/drive.rcs", "gallery/rfc9293/tcp.rcs", "emove/locate.rcs"]
)
def test_a_drawn_arrow_is_a_line_that_leads_there(file: str, shipped: Path) -> None:
    draw = random.Random(file)  # noqa: S311
    bench = Bench(shipped / "system.toml")
    doc = bench.open(file)
    table = doc["tables"][0]["name"]
    states = bench.ask("graph.show", file=file, version=doc["version"], table=table)["states"]
    for _ in range(2):
        source, target = draw.sample(states, 2)
        made = bench.ask(
            "graph.draw", file=file, version=doc["version"], table=table, source=source, target=target
        )
        doc = bench.doc(file)
        (shipped / file).write_text(doc["text"])
        loaded = load([str(shipped / file)])
        program = resolve(str(shipped / file), loaded)
        assert isinstance(program, Program)
        [meant] = [each for each in program.tables if each.name == table]
        derived = derive(program, meant, loaded.files[str(shipped / file)], Options())
        assert isinstance(derived, Derived)
        assert {(e.source, e.target) for e in derived.graph.edges if e.line == made["line"]} == {
            (source, target)
        }
        assert any(
            made["line"] in each["lines"] for each in doc["findings"]
        )  # it overlaps what was complete before
        rows_ = doc["tables"][0]["rows"]
        assert rows_[made["at"]]["name"] == made["line"]
        assert not any(row["default"] for row in rows_[: made["at"]])


def test_a_graph_is_of_the_text_as_it_is_or_none(shipped: Path) -> None:
    file = "task/acquire.rcs"
    bench = Bench(shipped / "system.toml")
    doc = bench.open(file)
    told = bench.ask("graph.show", file=file, version=doc["version"], table="acquire")
    assert json.loads(json.dumps(told))["composites"] == ["+state_2"]
    shut = bench.ask(
        "graph.show",
        file=file,
        version=doc["version"],
        table="acquire",
        shut=[{"name": "+state_2"}, {"name": "none"}],
    )
    assert len(shut["boxes"]) < len(told["boxes"])
    after = bench.change("tables.cells", file, table="acquire", line=5, column=4, rows=rows(["in {"]))
    with pytest.raises(Refused, match="the text has errors"):
        bench.ask("graph.show", file=file, version=after["version"], table="acquire")
    with pytest.raises(Refused, match="meanwhile"):
        bench.ask("graph.show", file=file, version=doc["version"], table="acquire")
    assert bench.open("examples/grip.rcs")
    with pytest.raises(Refused) as refused:
        bench.ask("graph.show", file="examples/grip.rcs", version=1, table="grip")
    assert refused.value.code is Code.GRAPH_NO_STATE


# --- pages -----------------------------------------------------------------------------------


def test_bad_messages_are_refused_and_change_nothing(bench: Bench) -> None:
    doc = bench.open("t.rcs")
    draw = random.Random(4)  # noqa: S311
    odd: list[Any] = [
        None,
        -1,
        2**60,
        "",
        "t",
        "t.rcs",
        [],
        {},
        [[]],
        [{}],
        [{"line": 99}],
        [{"cells": [{"text": 3}]}],
        True,
        1.5,
    ]
    kinds = ["edit", "cells", "line", "delete", "column", "undo", "redo"]
    for _ in range(600):
        kind = f"tables.{draw.choice(kinds)}"
        body = {"file": "t.rcs", "version": doc["version"], "table": "t"} if draw.random() < 0.8 else {}
        names = ["file", "version", "table", "line", "column", "at", "rows", "edits", "lines", "heading"]
        body |= {draw.choice(names): draw.choice(odd) for _ in range(3)}
        try:
            bench.ask(kind, **body)
        except (Refused, Malformed):
            assert bench.doc("t.rcs")["text"] == doc["text"]
        else:
            doc = bench.doc("t.rcs")
            bench.now("tables.undo", "t.rcs") if doc["undo"] else None
            doc = bench.doc("t.rcs")


def test_two_pages_see_the_same(shipped: Path) -> None:
    file = "gallery/cia402/drive.rcs"

    async def talk() -> None:
        with serving(Opening(shipped / "system.toml", alone=True)) as server:
            async with page(server) as one, page(server) as two:
                listed = await one.ask("tables.list")
                assert listed[0]["levels"] == ["task"]
                assert file in {each["file"] for each in listed}
                first = await one.ask("tables.open", file=file)
                await one.ask("tables.line", file=file, version=first["version"], table="drive", at=0)
                version = first["version"] + 1
                seen = [
                    await each.heard(f"tables.file/{file}", version=version, known=True)
                    for each in (one, two)
                ]
                assert seen[0] == seen[1]
                assert state(seen[0]) == "refuted"
                with pytest.raises(Exception, match="meanwhile"):
                    await two.ask("tables.line", file=file, version=first["version"], table="drive", at=0)
                await two.ask("tables.undo", file=file, version=version)
                after = await one.heard(f"tables.file/{file}", version=version + 1, known=True)
                assert after["text"] == first["text"]

    asyncio.run(talk())


# --- cells of any table -----------------------------------------------------------------------


def test_every_shipped_table_takes_every_change() -> None:
    """Comments stay, other tables stay, and a column that is inserted can be deleted again."""
    draw = random.Random(7)  # noqa: S311
    for path in sorted((REPO / "tables").rglob("*.rcs")):
        text = path.read_text()
        for table in (each for each in tables_of(text) if each.parts):
            sheet = cells.sheet_of(table)
            at = draw.randrange(sheet.conditions + 1)
            wider = cells.with_column(text, table.name, at, "when", action=False)
            assert wider.count("#") == text.count("#")
            assert (
                cells.sheet_of(cells._table(cells.without_column(wider, table.name, at), table.name)) == sheet
            )
            line = draw.randrange(len(sheet.stubs) + 1)
            longer = cells.with_line(text, table.name, line)
            assert (
                cells.sheet_of(cells._table(cells.without_lines(longer, table.name, [line]), table.name))
                == sheet
            )


if __name__ == "__main__":
    import sys
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        shutil.copytree(REPO / "tables", Path(place, "tables"))
        edited_at_random(Path(place, "tables"), int(sys.argv[1]))
