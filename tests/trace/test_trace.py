"""`rcsc trace`: every line of generated code comes from somewhere, both ways agree, and what does not fit is told."""

import copy
import csv
import io
import json
import re
import shutil
from collections.abc import Callable
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from rcsc.code.emit import emitted, rendering
from rcsc.code.emit.lower import lower
from rcsc.code.emit.plan import Plan, Sort
from rcsc.driver.compile import planned
from rcsc.driver.pipeline import proved
from rcsc.driver.settings import Settings
from rcsc.front.commands import run
from rcsc.lang.model import ProvedProgram, seal_of_proof
from rcsc.proof.solvers.options import Options
from rcsc.views.trace import collect
from rcsc.views.trace.matrix import REFUTED, ProgramFacts, matrix
from rcsc.views.trace.page import page
from tests.support.browser import Browser
from tests.support.programs.examples import EVERYTHING
from tests.support.programs.stages import program_of
from tests.support.programs.texts import edit_file, edited

REPO = Path(__file__).parents[2]
Edit = Callable[[Any], object]
DOOR = """\
input door_shut : bool
input button : bool
input count : int 0 .. 1000000
output press : bool safe false
assume door_seen assumed monitored req "SR-3" : door_shut or not button
invariant steady req "SR-9" : press in {true, false}
property opened req "SR-12", "<script>alert(1)</script>" : press implies door_shut
procedure hold req "SR-4" { quiet }
procedure quiet { press := false }
table press_once assuming door_seen req "SR-1" {
  | line | door_shut | button | count ||  procedures | press | req              |
  | go   | true      | true   |       ||             | true  | "SR-12", "SR-13" |
  | wait | true      | false  | > 7   ||  hold       |       | "SR-4"           |
  | more | true      | false  | <= 7  ||  hold       |       |                  |
  | open | DEFAULT   |        |       ||  hold       |       | "SR-12"          |
}
"""


@pytest.fixture
def door(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the program, and nothing kept from elsewhere."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    path = tmp_path / "door.rcs"
    path.write_text(DOOR, encoding="utf-8")
    return path


def plans(*paths: str) -> list[Plan]:
    project = proved(Settings(paths, Options(solver="boxes")))
    assert not project.report().failed
    return [planned(program) for _, program in project.executable]


SHIPPED = [
    f"tables/{name}" for name in ("task", "emove", "primitive", "vision", "gripper", "examples/approach.rcs")
]


@pytest.mark.parametrize("path", SHIPPED)
def test_all_shipped_code_is_traced_and_each_case_is_of_the_line_that_its_comment_names(path: str) -> None:
    for plan in plans(str(REPO / path)):
        files = emitted(plan)
        one = matrix(plan, ProgramFacts({}))
        assert one.untraced == ()
        texts = {name: text.splitlines() for name, text in files.items()}
        lines = {(line.table, line.name) for line in one.lines}
        seen = set()
        for piece in (piece for piece in one.pieces if piece.name.startswith("case ")):
            said = " ".join(" ".join(texts[piece.file][piece.first - 1 : piece.last]).split())
            assert re.search(rf"\.rcs line {re.escape(piece.origin.line)}\b", said), (piece, said)
            assert said.endswith("break;") or "break; }" in said
            seen.add((piece.origin.name, piece.origin.line))
        assert seen == lines
        python = {
            (p.origin.name, p.origin.line)
            for p in one.pieces
            if p.file.endswith(".py") and p.origin.sort is Sort.LINE
        }
        assert python == lines


@pytest.mark.parametrize("real", ["real", "single"])
def test_code_for_all_of_the_language_is_traced(real: str) -> None:
    program = program_of(EVERYTHING.replace("{real}", real))
    plan = lower(ProvedProgram(program, seal_of_proof()))
    one = matrix(plan, ProgramFacts({}))
    assert one.untraced == ()
    assert {piece.origin.sort for piece in one.pieces} >= {*Sort} - {Sort.SYSTEM}


def test_code_that_nothing_in_the_tables_stands_for_is_told(
    door: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A template says of each of its lines where it comes from, or the line is told."""
    [plan] = plans(str(door))
    templates = rendering.environment()
    assert templates.loader is not None
    given = templates.loader.get_source

    def planted(*asked: Any) -> Any:
        text, *more = given(*asked)
        for before, other in (("publics", "int other;"), ("functions", "other = 1")):
            loop = f"{{% for function in {before} %}}"
            text = text.replace(loop, f"{other}\n\n{loop}")
        return (text, *more)

    monkeypatch.setattr(templates, "cache", None)
    monkeypatch.setattr(templates.loader, "get_source", planted)
    files = emitted(plan)
    left = [where.rpartition(":") for where in matrix(plan, ProgramFacts({})).untraced]
    told = {(name, files[name].splitlines()[int(at) - 1]) for name, _, at in left}
    assert told == {("c/door.h", "int other;"), ("c/door.c", "int other;"), ("python/door.py", "other = 1")}


def test_the_matrix_leads_from_a_requirement_to_code_tests_and_proof_and_back(door: Path) -> None:
    assert run(["trace", str(door), "-q"]) == 0
    document = json.loads(Path("trace/trace.json").read_text(encoding="utf-8"))
    standing = {one["place"]: one for one in document["requirements"]["SR-12"]}
    assert list(standing) == ["press_once line go", "press_once line open", "property opened"]
    go_stands = standing["press_once line go"]
    assert go_stands["verdict"].startswith("proved: exactly one of 3 lines matches")
    assert standing["property opened"]["verdict"].startswith("not proved here")
    [program] = document["programs"]
    [table] = program["tables"]
    assert table["verdict"] == "proved"
    lines = {line["line"]: line for line in program["lines"]}
    assert list(lines) == ["go", "wait", "more", "open"]
    go, wait = lines["go"], lines["wait"]
    assert (go["requirements"], go["requirements_of_table"]) == (["SR-12", "SR-13"], ["SR-1"])
    assert go["place"].endswith("door.rcs:12")
    taken = len(go["vectors"]["taken"])
    assert go_stands["tests"] == f"{taken} {'vector' if taken == 1 else 'vectors'} of the tables"
    assert go_stands["coverage"] == f"{go['vectors']['shown']} of {go['vectors']['conditions']} conditions"
    assert go["properties"] == {"opened": "changes press; tests door_shut"}
    assert wait["procedures"] == ["hold", "quiet"]
    assert wait["vectors"]["conditions"] == wait["vectors"]["shown"] + len(wait["vectors"]["not_shown"]) == 3
    assert wait["vectors"]["made"]
    assert wait["vectors"]["taken"]
    [runs] = [piece for piece in go["code"]["runs"] if piece["file"] == "c/door.c"]
    back = [
        piece for piece in program["code"] if (piece["file"], piece["first"]) == ("c/door.c", runs["first"])
    ]
    assert [(piece["sort"], piece["line"], piece["requirements"]) for piece in back] == [
        ("line", "go", ["SR-12", "SR-13", "SR-1"])
    ]
    quiet = {piece["name"]: piece for piece in program["code"] if piece["of"] == "quiet"}
    assert quiet["door_do_quiet"]["requirements"] == ["SR-4", "SR-1", "SR-12"]
    assert not program["untraced"]


def test_a_vector_has_one_number_in_the_matrix_and_in_the_file_of_vectors(door: Path) -> None:
    assert run(["trace", str(door), "-q"]) == 0
    quick = ["test", "-q", "--examples", "1", "--mutants", "0", "--no-cortex", str(door)]
    assert run([*quick, "--vectors", "vectors.json"]) == 0
    vectors = json.loads(Path("vectors.json").read_text(encoding="utf-8"))
    numbered = {vector["number"]: vector for vector in vectors["vectors"]}
    [program] = json.loads(Path("trace/trace.json").read_text(encoding="utf-8"))["programs"]
    for line in program["lines"]:
        name = f"press_once line {line['line']}"
        taking = [number for number, vector in numbered.items() if name in vector.get("takes", ())]
        shows = [
            number
            for number, vector in numbered.items()
            if line["line"] in {each["line"] for each in vector.get("shows", ())}
        ]
        assert line["vectors"]["taken"] == taking
        assert line["vectors"]["made"] == shows
        assert taking
        assert shows
    assert all(numbered[one["number"]]["kind"] == "line" for one in vectors["tables"][0]["vectors"])


def test_tables_and_page_say_the_same_and_nothing_in_a_name_is_markup(door: Path) -> None:
    run(["trace", str(door), "-q", "--no-vectors"])
    forward = list(csv.DictReader(io.StringIO(Path("trace/lines.csv").read_text(encoding="utf-8"))))
    backward = list(csv.DictReader(io.StringIO(Path("trace/code.csv").read_text(encoding="utf-8"))))
    assert [row["line"] for row in forward] == ["go", "wait", "more", "open"]
    [case] = [row for row in backward if row["name"] == "case DOOR_LINE_PRESS_ONCE_GO"]
    assert f"c/door.c:{case['first']}-{case['last']}" == forward[0]["C runs"]
    assert case["requirements"] == "SR-12; SR-13; SR-1"
    html = Path("trace/trace.html").read_text(encoding="utf-8")
    assert "<script" not in html
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
    assert f"{case['first']}-{case['last']}" in html
    assert '<span class="at">door.rcs:</span><wbr><span class="at">12</span>' in html
    assert page((), ()).startswith("<!doctype html>")
    assert "<td></td>" not in html, "what there is nothing of says so"


def test_every_place_leads_to_its_line(door: Path) -> None:
    assert run(["compile", "-q", str(door), "--out", "generated"]) == 0
    run(["trace", str(door), "-q", "--no-vectors", "--anew"])
    html, texts = (Path(f"trace/{name}.html").read_text(encoding="utf-8") for name in ("trace", "texts"))
    led = {unquote(place) for place in re.findall(r'href="texts.html#([^"]*)"', html)}
    lines = dict(re.findall(r'<span id="([^"]+:\d+)">(.*?)</span>', texts))
    assert led <= set(lines)
    assert len(led) > 20
    first = next(
        row for row in csv.DictReader(io.StringIO(Path("trace/code.csv").read_text(encoding="utf-8")))
    )
    assert f"{first['file']}:{first['first']}" in led
    assert (
        unescape(lines["c/door.c:1"])
        == Path("generated/c/door.c").read_text(encoding="utf-8").splitlines()[0]
    )


@pytest.mark.needs("chromium")
def test_names_of_files_stay_whole_and_in_their_column(door: Path) -> None:
    long = door.parent / "folder_of_doors" / f"door_{'with_a_long_name_' * 3}.rcs"
    long.parent.mkdir()
    door.rename(long)
    assert run(["trace", str(long), "-q", "--no-vectors"]) == 0
    with Browser() as browser:
        browser.open(Path("trace/trace.html").resolve().as_uri())
        cells = "[...document.querySelectorAll('td')]"
        parts = "[...cell.querySelectorAll('.at')].filter(part => /name_[.]/.test(part.innerText))"
        named = "(cell.innerText.match(/name_[.](rcs|c|py)/g) || []).length"
        assert browser.value(f"{cells}.filter(cell => {named}).length") > 20
        assert browser.value(f"{cells}.every(cell => {parts}.length === {named})")
        whole = "part.getClientRects().length === 1"
        inside = "part.getBoundingClientRect().right <= cell.getBoundingClientRect().right"
        assert browser.value(f"{cells}.every(cell => {parts}.every(part => {whole} && {inside}))")


def test_one_question_is_answered_in_both_directions(door: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = emitted(plans(str(door))[0])["c/door.c"].splitlines()
    at = 1 + next(n for n, line in enumerate(text) if "case DOOR_LINE_PRESS_ONCE_WAIT" in line)
    ask = ["trace", str(door), "--no-vectors", "--find"]
    assert run([*ask, f"door.c:{at}"]) == 0
    told = capsys.readouterr().out
    assert "press_once line wait, " in told
    assert "for SR-4, SR-1" in told
    assert not Path("trace").exists()
    assert run([*ask, "SR-4"]) == 0
    told = capsys.readouterr().out
    assert "vectors: not looked for" in told
    assert "press_once line wait" in told
    assert "procedure hold" in told
    assert "press_once line go" not in told
    assert run([*ask, "door_do_quiet"]) == 0
    assert (
        "run by press_once line wait, press_once line more, press_once line open" in capsys.readouterr().out
    )
    assert run([*ask, "door_do_quite"]) == 2
    assert "did you mean `door_do_quiet`" in capsys.readouterr().err


def test_a_list_of_requirements_must_fit(door: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["SR-1", "SR-3", "SR-4", "SR-9", "SR-12", "SR-13", "<script>alert(1)</script>"]
    listed = door.parent / "names.txt"
    check = ["trace", str(door), "--no-vectors", "-q", "--format", "line", "--requirements", str(listed)]
    listed.write_text("# all\n" + "\n".join(names) + "\n\n", encoding="utf-8")
    assert run(check) == 0
    listed.write_text("\n".join([*names[1:], "SR-21"]) + "\n", encoding="utf-8")
    assert run(check) == 1
    told = capsys.readouterr().out
    assert "nothing in the tables is for requirement `SR-21`" in told
    assert "requirement `SR-1` is not in the list" in told
    door.write_text(edited(DOOR, (' req "SR-1" {', " {")), encoding="utf-8")
    listed.write_text("\n".join(names[1:]) + "\n", encoding="utf-8")
    assert run(check) == 0
    assert "1 of 4 lines of program `door` name no requirement" in capsys.readouterr().out
    listed.write_bytes(b"\xff\xfe\x00")
    assert run(check) == 2


def test_a_kept_matrix_of_another_version_is_recognised(
    door: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(["trace", str(door), "-q", "--no-vectors"])
    check = ["trace", str(door), "-q", "--format", "line", "--against", "trace/trace.json"]
    assert run(check) == 0
    capsys.readouterr()
    door.write_text(edited(DOOR, ('| "SR-4" ', '| "SR-5" ')), encoding="utf-8")
    assert run(check) == 1
    assert "is of other code of `door`" in capsys.readouterr().out
    door.write_text(edited(DOOR, ("press := false", "press := button and not button")), encoding="utf-8")
    assert run(check) == 1
    assert "with another meaning" in capsys.readouterr().out
    Path("trace/trace.json").write_text("[]", encoding="utf-8")
    assert run(check) == 2


def gutted(document: Any) -> list[tuple[str, str]]:
    """Yield each way in which a matrix lost or got something, as its text, and what is told of it."""
    edits: list[tuple[Edit, str]] = [
        (lambda one: one["lines"].pop(1), "`lines press_once wait` is missing"),
        (lambda one: one["lines"][0].pop("vectors"), "`lines press_once go vectors` is missing"),
        (
            lambda one: one["lines"][0]["requirements"].clear(),
            "`lines press_once go requirements SR-12` is missing",
        ),
        (
            lambda one: one["tables"][0].update(verdict="refuted"),
            "`tables press_once verdict` is `refuted`, and `proved` in this version",
        ),
        (lambda one: one["declared"].pop(), "`declared property opened` is missing"),
        (lambda one: one["code"].pop(), "`code "),
        (lambda one: one["files"].clear(), "is of other code of `door`"),
        (lambda one: one.update(program="gate"), "has a program `gate` that is not here"),
    ]
    texts = []
    for edit, told in edits:
        changed = copy.deepcopy(document)
        edit(changed["programs"][0])
        texts.append((json.dumps(changed), told))
    changed = copy.deepcopy(document)
    del changed["requirements"]["SR-12"]
    return [*texts, (json.dumps(changed), "`requirements SR-12` is missing")]


def test_a_kept_matrix_is_compared_whole(door: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(["trace", str(door), "-q", "--no-vectors"])
    kept = Path("trace/trace.json")
    check = ["trace", str(door), "-q", "--against", str(kept)]
    document = json.loads(kept.read_text(encoding="utf-8"))
    for text, told in gutted(document):
        kept.write_text(text, encoding="utf-8")
        capsys.readouterr()
        assert run(check) == 1, told
        assert told in " ".join(capsys.readouterr().out.split())
    kept.write_text(json.dumps(document | {"form": 2}), encoding="utf-8")
    assert run(check) == 2
    kept.write_text(json.dumps(document), encoding="utf-8")
    assert run(check) == 0
    door.write_text(edited(DOOR, ('opened req "SR-12"', 'opened req "SR-11"')), encoding="utf-8")
    capsys.readouterr()
    assert run(check) == 1
    assert "`declared property opened requirements SR-11` is missing" in capsys.readouterr().out


def test_code_that_lies_there_and_is_another_is_told(door: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compile", "-q", str(door)]) == 0
    trace = ["trace", str(door), "-q", "--no-vectors"]
    assert run(trace) == 0
    edit_file(Path("generated/c/door.c"), ("do not edit", "do edit"))
    capsys.readouterr()
    for options in ((), ("--against", "trace/trace.json")):
        assert run([*trace, *options]) == 1
        assert "error[RCS501]: `generated/c/door.c` differs" in capsys.readouterr().out
    assert run([*trace, "--anew"]) == 0


def test_a_requirement_has_a_standing(
    door: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What `rcsc prove` refuted is told of the requirement that its property names; code without a requirement is named."""
    names = ["SR-1", "SR-3", "SR-4", "SR-9", "SR-12", "SR-13", "<script>alert(1)</script>"]
    listed = door.parent / "names.txt"
    listed.write_text("\n".join(names) + "\n", encoding="utf-8")
    check = ["trace", str(door), "--no-vectors", "--requirements", str(listed)]
    assert run(check) == 0
    said = capsys.readouterr().out
    assert "7 of 7 requirements have a place: 4 proved, 0 refuted, 3 assumed, open or not proved here" in said
    assert "parts of the code of `door` carry no requirement" in said
    assert "c/door.h: " in said
    monkeypatch.setattr(collect, "property_proofs", lambda *_: {"opened": f"{REFUTED}, system.toml"})
    assert run(check) == 1
    said = capsys.readouterr().out
    assert "requirement `SR-12` is refuted: property opened is refuted: `rcsc prove` shows" in " ".join(
        said.split()
    )
    assert "7 of 7 requirements have a place: 4 proved, 2 refuted, 1 assumed, open or not proved here" in said
    rows = list(csv.DictReader(io.StringIO(Path("trace/requirements.csv").read_text(encoding="utf-8"))))
    [stands] = [row for row in rows if row["place"] == "property opened" and row["requirement"] == "SR-12"]
    assert stands["verdict"] == f"{REFUTED}, system.toml"
    assert '<span class="bad">refuted: ' in Path("trace/trace.html").read_text(encoding="utf-8")


def test_a_declared_requirement_has_a_standing_under_its_own_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """No list has to have it; what a run breaks is told, and is no longer only *not proved here*."""
    monkeypatch.chdir(tmp_path)
    assert run(["new", ".", "--template", "level"]) == 0
    gripper = Path("gripper.rcs")
    text = gripper.read_text(encoding="utf-8")
    gripper.write_text(f"{text}\nrequirement hand : never command_to_hand = close\n", encoding="utf-8")
    Path("system.toml").write_text(
        'name = "hand"\ngenerated = "generated"\ntick_ms = 40\n\n[[level]]\nname = "gripper"\nprogram = "gripper"\n',
        encoding="utf-8",
    )
    trace = ["trace", "gripper.rcs", "--no-vectors"]
    assert run(trace) == 0
    assert "7 lines, 7 with a requirement" in capsys.readouterr().out
    assert '<span class="for">hand</span>' in Path("trace/trace.html").read_text(encoding="utf-8")
    assert run(["prove", "system.toml"]) == 1
    capsys.readouterr()
    Path("names.txt").write_text("", encoding="utf-8")
    for options in ([], ["--requirements", "names.txt"]):
        assert run([*trace, *options]) == 1
        said = " ".join(capsys.readouterr().out.split())
        assert "requirement `hand` is refuted: requirement hand is refuted: `rcsc prove` shows" in said
        assert "not in the list" not in said


def test_rows_of_scripts_test_requirements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Told apart from the vectors, which are made of the tables; of a script of another kind there is nothing to tell."""
    folder = tmp_path / "dock"
    shutil.copytree(REPO / "tests/data/dock", folder, ignore=shutil.ignore_patterns("generated"))
    monkeypatch.chdir(tmp_path)
    edit_file(
        folder / "dock.csv", ("command\ndock\nstop\nundock", 'command,req\ndock,R-1\nstop,\nundock,"R-1 R-2"')
    )
    (folder / "scripts").mkdir()
    (folder / "scripts/slow.toml").write_text('[[row]]\ncommand = "dock"\nwithin = 900\nreq = "R-2"\n')
    (folder / "scripts/other.csv").write_text("a,a\n1,2\n")
    assert run(["trace", "-q", "--no-vectors", "dock"]) == 0
    rows = list(csv.reader(Path("trace/requirements.csv").read_text("utf-8").splitlines()))
    assert [row for row in rows if row[0].startswith("R-")] == [
        ["R-1", "row of script dock.csv 1", "", "`dock`, made by `rcsc run`", ""],
        ["R-1", "row of script dock.csv 3", "", "`undock`, made by `rcsc run`", ""],
        ["R-2", "row of script dock.csv 3", "", "`undock`, made by `rcsc run`", ""],
        ["R-2", "row of script slow.toml 1", "", "`dock within=900`, made by `rcsc run`", ""],
    ]
    programs = json.loads(Path("trace/trace.json").read_text("utf-8"))["programs"]
    places = [one["place"] for matrix in programs for one in matrix["declared"] if "script" in one["sort"]]
    assert places == ["dock/dock.csv:2", "dock/dock.csv:4", "dock/scripts/slow.toml"]
    edit_file(folder / "dock.csv", ("command,req", "command,command"))
    assert run(["trace", "-q", "--no-vectors", "dock"]) == 1
