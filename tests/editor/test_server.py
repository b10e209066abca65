"""The server in its own process, asked as an editor asks: what it answers is what the workspace knows, whatever a client sends."""

import json
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rcsc.base.diagnostics.jsonform import report_to_json
from rcsc.desk.editor.values import State
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.proof.solvers.options import Options
from tests.editor.client import PATIENCE_S, PUSHED, WHOLE, Client, RefusedError, applied

REPO = Path(__file__).parents[2]
GRIP = "examples/grip.rcs"
EVERYWHERE = {"start": {"line": 0, "character": 0}, "end": {"line": 10_000, "character": 0}}


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("served") / "tables"
    shutil.copytree(REPO / "tables", folder, ignore=shutil.ignore_patterns("*.md"))
    return folder


@pytest.fixture(scope="module")
def client(tables: Path) -> Iterator[Client]:
    """One server for the questions that leave it as it was."""
    asks = Client(tables, WHOLE, silent=True)
    yield asks
    assert asks.stop() == 0


def text_of(client: Client, name: str) -> str:
    return (client.folder / name).read_bytes().decode()


def place_of(text: str, word: str, after: str = "") -> tuple[int, int]:
    """The place of a word in a text, behind another."""
    at = text.index(word, text.index(after))
    return text.count("\n", 0, at), at - text.rfind("\n", 0, at) - 1


def test_findings_are_those_of_a_check_as_it_is_typed(client: Client) -> None:
    """Places too; the least input stands in the message."""
    text = text_of(client, GRIP)
    client.open(GRIP, text)
    for typed in (
        text,
        text.replace("20 .. 40", "0 .. 40"),
        text.replace("20 .. 40", "0 .. 50"),
        text.replace("|-", "-"),
        text,
    ):
        client.change(GRIP, typed)
        (client.folder / "saved.rcs").write_text(typed)
        report = check(Settings((str(client.folder / "saved.rcs"),), Options(), use_cache=False))
        told = json.loads(json.dumps(report_to_json(report, "check")))["diagnostics"]
        found = client.findings(GRIP)
        got = [
            (each["code"], each["range"]["start"]["line"] + 1)
            for each in found
            if not each["data"]["meanwhile"]
        ]
        assert got == [(each["code"], each["primary"]["place"]["start"]["line"]) for each in told]
        for each, one in zip(found, told, strict=False):
            assert each["message"].startswith(one["message"])
            for witness in one["witnesses"][:1]:
                assert all(f"{each['variable']} = {each['value']}" for each in witness["input"])
    (client.folder / "saved.rcs").unlink()


def test_a_repair_applied_takes_the_finding_away(client: Client) -> None:
    text = text_of(client, GRIP)
    document = client.open(GRIP, text)
    [finding] = client.findings(GRIP)
    asked = {"textDocument": document, "range": finding["range"], "context": {"diagnostics": [finding]}}
    [action] = client.ask("textDocument/codeAction", asked)
    assert action["isPreferred"]
    client.change(GRIP, applied(text, action["edit"]["changes"][document["uri"]]))
    assert client.findings(GRIP) == []
    lenses = client.ask("textDocument/codeLens", {"textDocument": document})
    assert lenses[0]["command"]["title"].startswith(State.PROVED)


def test_all_repairs_are_one_action(client: Client) -> None:
    name = "gallery/cia402/commands_published.rcs"
    text = text_of(client, name)
    document = client.open(name, text)
    before = [each for each in client.findings(name) if each["severity"] == 1]
    asked = {
        "textDocument": document,
        "range": EVERYWHERE,
        "context": {"diagnostics": [], "only": ["source.fixAll"]},
    }
    [action] = client.ask("textDocument/codeAction", asked)
    client.change(name, applied(text, action["edit"]["changes"][document["uri"]]))
    after = [each for each in client.findings(name) if each["severity"] == 1]
    assert len(after) < len(before)


def test_lens_status_and_command_say_the_same(client: Client) -> None:
    """Of a refuted table, one that trusts an assumption, a proved one, and one whose file is half written."""
    seen = set()
    cases = [(GRIP, ""), ("task/acquire.rcs", ""), ("task/pause.rcs", ""), ("task/pause.rcs", "input x : ")]
    for name, more in cases:
        document = client.open(name, text_of(client, name) + more)
        client.findings(name)
        status = client.run("rcsc.status", document["uri"])
        lenses = client.ask("textDocument/codeLens", {"textDocument": document})
        said = [lens["command"]["title"] for lens in lenses if lens["command"]["command"] == "rcsc.prove"]
        assert said == [table["text"] for table in status["tables"]]
        seen |= {table["state"] for table in status["tables"]}
    assert seen == {State.PROVED, State.TRUSTING, State.STALE, State.REFUTED}


def test_lenses_do_what_they_say(client: Client) -> None:
    document = client.open(GRIP, text_of(client, GRIP))
    lenses = client.ask("textDocument/codeLens", {"textDocument": document})
    assert [lens["command"]["command"] for lens in lenses] == ["rcsc.prove", "rcsc.graph", "rcsc.witness"]
    proved, graph, witness = (
        client.run(each["command"]["command"], *each["command"]["arguments"]) for each in lenses
    )
    assert "refuted" in proved["text"]
    assert "decided by counting, confirmed by Z3" in proved["text"]
    assert witness["text"].startswith("input: reported = done, width_mm = 0\n0 of 4 lines match")
    assert "under `width_mm` stands `20 .. 40`, and it is 0" in witness["text"]
    assert graph["text"]
    name = "task/acquire.rcs"
    uri = client.open(name, text_of(client, name))["uri"]
    assert client.run("rcsc.graph", uri, "acquire")["text"].startswith("<svg")
    assert "stateDiagram-v2" in client.run("rcsc.graph", uri, "acquire", "mermaid")["text"]


def test_hover_says_type_unit_range_writer_and_proof(client: Client) -> None:
    text = text_of(client, GRIP)
    client.open(GRIP, text)
    client.findings(GRIP)

    def hovered(word: str, after: str = "") -> str:
        line, character = place_of(text, word, after)
        answer = client.ask("textDocument/hover", client.at(GRIP, line, character))
        value: str = answer["contents"]["value"]
        return value

    end_s = time.monotonic() + PATIENCE_S
    while "being proved" in hovered("grip", "table"):  # on a busy machine the first look ends before
        assert time.monotonic() < end_s
        time.sleep(0.05)
    width = hovered("width_mm", "table")
    assert "input width_mm : int 0 .. 110 [mm] clamp" in width
    assert "from 0 to 110 mm" in width
    assert "How far the jaws are apart" in width
    assert "written by `count`" in hovered("parts")
    assert "table `grip` in `wait`, `held`" in hovered("order", "| procedures")
    assert "1 of 3 of enum status" in hovered("executing", "| wait")
    assert "**refuted**" in hovered("grip", "table")
    assert "6.31 %" in hovered("held", "| wait")
    assert "run by table `grip`" in hovered("count", "table")
    assert client.ask("textDocument/hover", client.at(GRIP, 0, 5)) is None


def test_names_lead_to_each_other_over_files(client: Client) -> None:
    name = "task/acquire.rcs"
    text = text_of(client, name)
    client.open(name, text)
    line, character = place_of(text, "cur_state", "| line")
    [declared] = client.ask("textDocument/definition", client.at(name, line, character))
    assert declared["uri"].endswith("task/common.rcs")
    asked = {**client.at(name, line, character), "context": {"includeDeclaration": True}}
    uses = client.ask("textDocument/references", asked)
    files = {use["uri"].rpartition("/")[2] for use in uses}
    assert {"common.rcs", "acquire.rcs", "move.rcs"} <= files
    [used] = client.ask("textDocument/definition", client.at(name, *place_of(text, "common", "use ")))
    assert used["uri"].endswith("task/common.rcs")
    marks = client.ask("textDocument/documentHighlight", client.at(name, line, character))
    assert len(marks) == sum(use["uri"].endswith("acquire.rcs") for use in uses)


def test_symbols_are_there_though_nothing_parses(client: Client) -> None:
    document = client.open(GRIP, text_of(client, GRIP).replace("output order : command", "output order : ("))
    symbols = client.ask("textDocument/documentSymbol", {"textDocument": document})
    [grip] = [each for each in symbols if each["name"] == "grip"]
    assert [each["name"] for each in grip["children"]] == ["wait", "held", "wrong", "missed"]
    assert {"width_mm", "count", "status"} <= {each["name"] for each in symbols}
    found = client.ask("workspace/symbol", {"query": "wdth"})
    assert "width_mm" in {each["name"] for each in found}
    client.open(GRIP, text_of(client, GRIP))


@pytest.mark.parametrize(
    ("row", "offered", "not_offered"),
    [
        ("| new | @", {"executing", "/= done", "DEFAULT"}, {"true", "hold"}),
        ("| new | done | @", {"<= 110", "0 .. 110"}, {"hold"}),
        ("| new | done | 3 || @", {"count"}, {"hold", "done"}),
        ("| new | done | 3 || | @", {"hold", "pause"}, {"executing", "/= hold"}),
        ("input x : @", {"status", "int", "bool"}, {"hold"}),
        ("@", {"table", "procedure", "input"}, {"done"}),
    ],
)
def test_completion_fits_its_place(
    client: Client, row: str, offered: set[str], not_offered: set[str]
) -> None:
    """In a text that is half written, as it is when one asks."""
    text = text_of(client, GRIP)
    client.open(GRIP, text)
    client.findings(GRIP)
    typed = text.replace("  | wrong", f"  {row}\n  | wrong") if row.startswith("|") else f"{text}{row}\n"
    line, character = place_of(typed, "@")
    client.change(GRIP, typed.replace("@", ""))
    found = client.ask("textDocument/completion", client.at(GRIP, line, character))["items"]
    labels = {each["label"] for each in found}
    assert offered <= labels
    assert not labels & not_offered


def test_colours_cover_every_name_once(client: Client) -> None:
    name = "emove/locate.rcs"
    text = text_of(client, name)
    document = client.open(name, text)
    numbers = client.ask("textDocument/semanticTokens/full", {"textDocument": document})["data"]
    legend = client.server["semanticTokensProvider"]["legend"]["tokenTypes"]
    lines, line, column, past = text.split("\n"), 0, 0, (0, 0)
    seen: dict[str, set[str]] = {}
    for at in range(0, len(numbers), 5):
        down, right, length, kind, _ = numbers[at : at + 5]
        line, column = line + down, right if down else column + right
        assert (line, column) >= past
        past = (line, column + length)
        seen.setdefault(legend[kind], set()).add(lines[line][column : column + length])
    assert {"looking", "done", "goto"} <= seen["enumMember"]
    assert {"nextstate", "no_place"} <= seen["function"]
    assert {"cur_state", "idle"} <= seen["variable"]
    assert "DEFAULT" in seen["keyword"]
    assert "4a" in seen["label"]


def test_formatting_is_that_of_fmt_and_touches_what_differs(client: Client) -> None:
    text = text_of(client, GRIP)
    ragged = text.replace("| held   | done      |", "|held|done|").replace("\n", "\r\n")
    document = client.open(GRIP, ragged)
    options = {"tabSize": 2, "insertSpaces": True}
    edits = client.ask("textDocument/formatting", {"textDocument": document, "options": options})
    assert applied(ragged, edits) == text.replace("\n", "\r\n")
    [edit] = edits
    assert edit["range"]["end"]["line"] - edit["range"]["start"]["line"] == 1
    client.change(GRIP, "table {")
    assert client.ask("textDocument/formatting", {"textDocument": document, "options": options}) == []
    client.change(GRIP, text)


def test_columns_align_while_typing(client: Client) -> None:
    text = text_of(client, GRIP).replace(
        "| held   | done      | 20 .. 40 |", "| held   | executing or so | 20 .. 40 |"
    )
    document = client.open(GRIP, text)
    line, character = place_of(text, "| 20 .. 40")
    asked = {
        **client.at(GRIP, line, character + 1),
        "ch": "|",
        "options": {"tabSize": 2, "insertSpaces": True},
    }
    after = applied(text, client.ask("textDocument/onTypeFormatting", asked))
    rows = [row for row in after.split("\n") if row.startswith("  |")]
    assert len({row.index("||") for row in rows}) == 1
    assert [row.split() for row in rows if "--" not in row] == [
        row.split() for row in text.split("\n") if row.startswith("  | ")
    ]
    assert document


def test_tab_goes_round_the_table_and_adds_a_line(client: Client) -> None:
    text = text_of(client, GRIP)
    document = client.open(GRIP, text)
    position = {"line": 20, "character": 4}
    seen = []
    for _ in range(6 * 5):
        moved = client.run("rcsc.nextCell", document["uri"], position)
        text = applied(text, moved["edits"])
        client.change(GRIP, text)
        position = moved["cursor"]
        seen.append(text.split("\n")[position["line"]][position["character"] :].split(" ")[0])
    assert seen[:6] == ["reported", "width_mm", "procedures", "order", "report", "wait"]
    assert seen[-1] == "new"
    assert text.count("| new ") == 1
    wider = client.run("rcsc.insertColumn", document["uri"], {"line": 22, "character": 15})
    rows = [row for row in applied(text, wider["edits"]).split("\n") if row.startswith("  |")]
    assert {row.count("|") for row in rows} == {9}
    assert client.run("rcsc.nextCell", document["uri"], {"line": 0, "character": 0}) is None


def test_shares_stand_at_the_ends_of_lines(client: Client) -> None:
    name = "gallery/tcas/tcas.rcs"
    text = text_of(client, name)
    document = client.open(name, text)
    client.findings(name)
    hints = client.ask("textDocument/inlayHint", {"textDocument": document, "range": EVERYWHERE})
    grip = client.open(GRIP, text_of(client, GRIP))
    hints += client.ask("textDocument/inlayHint", {"textDocument": grip, "range": EVERYWHERE})
    assert {"33.3 %", "6.31 %"} <= {hint["label"] for hint in hints}
    for hint in hints[-4:]:
        assert (
            text_of(client, GRIP)
            .split("\n")[hint["position"]["line"]][: hint["position"]["character"]]
            .endswith("|")
        )


# --- what a client may do ------------------------------------------------------------


def test_who_does_not_ask_is_told(tables: Path) -> None:
    """Findings of files that are used, too; and that they are gone, when a file is mended or closed."""
    client = Client(tables, PUSHED)
    told = "textDocument/publishDiagnostics"
    client.open(GRIP, text_of(client, GRIP))
    gap = client.heard_that(
        told, lambda each: any("closes the gap" in one["message"] for one in each["diagnostics"])
    )
    assert [each["code"] for each in gap["diagnostics"]] == ["RCS401"]
    client.heard_ever("rcsc/status", lambda each: each["tables"][0]["state"] == "refuted")
    client.change(GRIP, text_of(client, GRIP).replace("20 .. 40", "0 .. 40"))
    client.heard_that(told, lambda each: each["version"] == 2 and each["diagnostics"] == [])
    client.heard_that("rcsc/status", lambda each: each["tables"][0]["state"] == "proved")
    client.tell("textDocument/didClose", {"textDocument": {"uri": client.uri(GRIP)}})
    client.heard_that(told, lambda each: "version" not in each and each["diagnostics"] == [])
    assert client.stop() == 0


def test_only_the_last_of_many_keys_is_told(tables: Path) -> None:
    client = Client(tables, PUSHED)
    text = text_of(client, GRIP)
    client.open(GRIP, text)
    for number in range(30):
        client.change(GRIP, text + f"# {number}\n")
    client.change(GRIP, text.replace("20 .. 40", "0 .. 40"))
    client.heard_that(
        "textDocument/publishDiagnostics", lambda each: each["version"] == 32 and each["diagnostics"] == []
    )
    assert len(client.told["textDocument/publishDiagnostics"]) < 20
    client.stop()


def test_columns_count_what_the_client_counts(tables: Path) -> None:
    text = "# \U0001f916\nenum mode { off, on }   # é\U0001f916\ninput now : mode\ntable \U0001f916"
    for encodings, wanted in ((None, 8), (["utf-8"], 10), (["utf-32"], 7), (["utf-8", "utf-16"], 10)):
        capabilities: dict[str, Any] = {"textDocument": {"diagnostic": {}}}
        if encodings is not None:
            capabilities["general"] = {"positionEncodings": encodings}
        client = Client(tables, capabilities)
        client.open("robot.rcs", text)
        [finding] = [
            each for each in client.findings("robot.rcs") if each["code"] == "RCS103"
        ] or client.findings("robot.rcs")
        assert finding["range"]["end"] == {"line": 3, "character": wanted}
        client.stop()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_odd_texts_are_survived(client: Client, end: str) -> None:
    """Whatever a text holds, the next question is answered."""
    odd = [
        "", "\ufeff", "\x00", "|", "||", "table", "table t {", "table t {|", "|" * 3000, "\u2028\x0b\x0c",
        "\ud83e", "{" * 500, "use a\nuse a",
    ]  # fmt: skip
    odd += [
        "table t {\n" + "| a " * 400 + "||\n" + "|--" * 400 + "||\n}",
        "é" * 2000 + " := " + "(" * 200,
        '"' * 99,
        "#" * 99,
    ]
    for number, text in enumerate(odd):
        document = client.open("odd.rcs", text.replace("\n", end) + end + text)
        for method in ("documentSymbol", "semanticTokens/full", "codeLens"):
            client.ask(f"textDocument/{method}", {"textDocument": document})
        client.findings("odd.rcs")
        options = {"tabSize": 2, "insertSpaces": True}
        client.ask("textDocument/formatting", {"textDocument": document, "options": options})
        for place in ((0, 0), (0, 7), (1, 3), (99, 99)):
            for method in ("hover", "completion", "definition"):
                client.ask(f"textDocument/{method}", client.at("odd.rcs", *place))
            for command in ("nextCell", "previousCell", "addRow", "insertColumn"):
                client.run(f"rcsc.{command}", document["uri"], {"line": place[0], "character": place[1]})
        assert number < len(odd)


def test_files_come_and_go(client: Client, tables: Path) -> None:
    """New and unsaved, in no folder, gone from disk, not in UTF-8; each is a finding at most."""
    text = "input a : bool\ntable t {\n  | line | a    ||\n  |------|------||\n  | 1    | true ||\n}\n"
    for uri in ("untitled:Untitled-1", "file:///nowhere/at/all/x.rcs", "vscode-vfs://github/x.rcs"):
        client.open(uri, text)
        assert [each["code"] for each in client.findings(uri)] == ["RCS401"]
    (tables / "gone.rcs").write_text(text)
    document = client.open("gone.rcs", text)
    (tables / "gone.rcs").unlink()
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": document["uri"], "type": 3}]})
    assert [each["code"] for each in client.findings("gone.rcs")] == ["RCS401"]
    client.tell("textDocument/didClose", {"textDocument": document})
    (tables / "used.rcs").write_bytes(b"enum \xff { a }\n")
    client.open("user.rcs", "use used\ninput b : bool\n")
    report = client.ask("textDocument/diagnostic", {"textDocument": {"uri": client.uri("user.rcs")}})
    related = report.get("relatedDocuments") or {}
    told = [*report["items"], *(each for one in related.values() for each in one["items"])]
    assert any("UTF-8" in each["message"] for each in told)
    (tables / "used.rcs").write_text("enum mode { a }\n")
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": client.uri("used.rcs"), "type": 2}]})
    assert [each["code"] for each in client.findings("user.rcs") if each["severity"] == 1] == []
    (tables / "used.rcs").unlink()


@pytest.mark.parametrize(
    ("command", "args"),
    [
        ("rcsc.prove", ["file:///nowhere.rcs", "t"]), ("rcsc.graph", ["untitled:x", "t"]), ("rcsc.witness", ["file:///nowhere.rcs", "t"]),
        ("rcsc.status", ["file:///nowhere.rcs"]),
    ],
)  # fmt: skip
def test_commands_about_nothing_say_so(client: Client, command: str, args: list[str]) -> None:
    assert client.run(command, *args)


@pytest.mark.parametrize(
    ("method", "params"),
    [
        ("textDocument/nothing", {}),
        ("workspace/executeCommand", {"command": "rm", "arguments": ["-rf"]}),
        ("workspace/executeCommand", {"command": "rcsc.nextCell", "arguments": [1, 2, 3]}),
    ],
)
def test_wrong_requests_are_refused_and_no_more(client: Client, method: str, params: dict[str, Any]) -> None:
    with pytest.raises(RefusedError):
        client.ask(method, params)


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"textDocument": 3},
        None,
        [1],
        {"textDocument": {"uri": "x"}, "position": {"line": -1, "character": -1}},
    ],
)
def test_requests_of_no_form_change_nothing(client: Client, params: object) -> None:
    """The protocol's library may leave them unanswered."""
    client.send("textDocument/hover", params)
    client.tell("textDocument/didChange", params)
    assert client.ask("workspace/symbol", {"query": "nothing_is_called_so"}) == []
