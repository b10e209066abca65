"""The grid and the graph in a real browser, by keys: cells, rectangles, lines, undo, the text of the same file, a filter, an arrow."""

import asyncio
import json
import random
import shutil
from pathlib import Path
from typing import Any

import pytest
from aiohttp import web

from rcsc.desk.shell.opening import Opening
from rcsc.desk.studio.hub import PROVER
from rcsc.desk.studio.server import Server
from rcsc.front.commands import run as rcsc
from tests.studio.driven import HIGH, WIDE, Seat, dock, seated
from tests.studio.served import page, serving

pytestmark = pytest.mark.needs("chromium")
REPO = Path(__file__).parents[2]
EDITOR = "document.querySelector('.text-view').editor"
HERE = "`${document.activeElement.dataset.line},${document.activeElement.dataset.column}`"


def cell(line: int, column: int) -> str:
    return f'document.querySelector(\'.sheet [data-line="{line}"][data-column="{column}"]\')'


def says(seat: Seat, line: int, column: int, text: str) -> None:
    """Wait until a cell says something, and the table was looked at."""
    seat.wait(
        f"{cell(line, column)}?.dataset.text === {text!r} && !document.querySelector('.standing.stale, .sheet .waits')"
    )


def lines(seat: Seat) -> int:
    return int(
        seat.value(
            "[...document.querySelectorAll('.sheet tr[data-row]')].filter((row) => !row.hidden).length"
        )
    )


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    shutil.copytree(REPO / "tables" / "gallery" / "cia402", tmp_path / "gallery" / "cia402")
    (tmp_path / "rcsc.toml").touch()
    return tmp_path


def test_the_grid_and_the_graph_by_keys(drive: Path) -> None:
    before = (drive / "gallery" / "cia402" / "drive.rcs").read_text()
    with seated(Opening(drive / "system.toml", alone=True)) as seat:
        seat.click(seat.button("Tables"))
        seat.wait("document.querySelector('.table-choice')?.options.length")
        seat.choose(".table-choice", "drive ")
        seat.until(".standing", "✓ proved")
        many = lines(seat)
        seat.click("(" + cell(1, 0) + ")")
        _cells(seat)
        _rectangle(seat)
        _line(seat, many)
        _text(seat)
        seat.value("document.querySelector('.filter').focus()")
        seat.write("now = fault")
        seat.press("enter")
        seat.until(".filter-form span", "lines can match")
        assert 0 < lines(seat) < many
        seat.press("escape")
        seat.wait(
            f"[...document.querySelectorAll('.sheet tr[data-row]')].filter((row) => !row.hidden).length === {many}"
        )
        _arrow(seat)
        seat.click(seat.button("Tables"))
        seat.until(".standing", "✓ proved")
    assert (drive / "gallery" / "cia402" / "drive.rcs").read_text() == before


def _cells(seat: Seat) -> None:
    """Move, write, leave, undo."""
    begun = seat.value(cell(2, 1) + ".dataset.text")
    seat.press("down", "right")
    assert seat.value(HERE) == "2,1"
    seat.press("f2")
    seat.write("nonsense")
    seat.press("escape")
    says(seat, 2, 1, begun)
    seat.press("home", "right", "right", "enter")
    seat.value("document.activeElement.select()")
    seat.write("nobody")
    seat.press("tab")
    says(seat, 2, 1, "nobody")
    assert seat.value(HERE) == "2,2"
    assert seat.reads(".standing").startswith("✗ failed")
    assert "nobody" in seat.reads("tr.finding")
    seat.press("ctrl+z")
    says(seat, 2, 1, begun)
    seat.until(".standing", "✓ proved")


def _rectangle(seat: Seat) -> None:
    """Copy two lines, paste them over two others, and undo it in one step."""
    texts = [[seat.value(cell(line, column) + ".dataset.text") for column in (0, 1)] for line in (1, 2, 3, 4)]
    seat.click("(" + cell(1, 0) + ")")
    seat.press("shift+down", "shift+right")
    copied = seat.value(
        "(() => { const given = new DataTransfer(); document.activeElement.dispatchEvent("
        "new ClipboardEvent('copy', { clipboardData: given, bubbles: true, cancelable: true })); return given.getData('text/plain'); })()"
    )
    assert copied == "\n".join("\t".join(row) for row in texts[:2])
    seat.click("(" + cell(3, 0) + ")")
    seat.value(
        f"(() => {{ const given = new DataTransfer(); given.setData('text/plain', {copied!r}); document.activeElement.dispatchEvent("
        "new ClipboardEvent('paste', { clipboardData: given, bubbles: true, cancelable: true })); })()"
    )
    says(seat, 3, 0, texts[0][0])
    says(seat, 4, 1, texts[1][1])
    seat.press("ctrl+z")
    says(seat, 4, 1, texts[3][1])
    says(seat, 3, 0, texts[2][0])


def _line(seat: Seat, many: int) -> None:
    """Insert a line and delete it."""
    seat.press("alt+enter")
    seat.wait(
        f"document.querySelectorAll('.sheet tr[data-row]').length === {many + 1} && !document.querySelector('.standing.stale')"
    )
    assert seat.value(HERE) == "4,0"
    seat.press("ctrl+delete")
    seat.wait(
        f"document.querySelectorAll('.sheet tr[data-row]').length === {many} && !document.querySelector('.standing.stale')"
    )


def _text(seat: Seat) -> None:
    """What is typed into the text stands in the grid, and is undone there."""
    was = seat.value(cell(0, 0) + ".dataset.text")
    seat.click(seat.button("Both"))
    seat.value(
        f"(() => {{ const lines = {EDITOR}.text.split('\\n'), line = lines.findIndex((text) => text.includes('|--')) + 1; "
        f"{EDITOR}.focus(); {EDITOR}.go([line, lines[line].indexOf('|', 4) + 2]); }})()"
    )
    seat.write("not")
    seat.wait(f"{cell(0, 0)}.dataset.text !== {was!r} && !document.querySelector('.standing.stale')")
    assert seat.value(cell(0, 0) + ".dataset.text").startswith("not")
    seat.press("ctrl+z")
    says(seat, 0, 0, was)
    seat.click(seat.button("Grid"))
    seat.until(".standing", "✓ proved")


def _arrow(seat: Seat) -> None:
    """Draw an arrow from a state to the one that Tab comes to, and take it back."""
    seat.click(seat.button("Graph"))
    seat.wait(
        "document.querySelector('.graph-place [data-state]') && !document.querySelector('.graph-place.stale')"
    )
    seat.value("document.querySelector('.graph-place [data-state=fault]').focus()")
    seat.press("a")
    assert "An arrow from fault" in seat.reads(".graph-whole")
    seat.value("document.querySelector('.graph-place [data-state=operation_enabled]').focus()")
    seat.press("enter")
    seat.until("#said", "leads from fault to operation_enabled")
    seat.until(".graph-whole", "failed: ")  # the proof answers where the arrow was drawn
    assert seat.reads(".graph-proof") == "✗ failed"
    seat.value("document.querySelector('.graph-place [data-state=fault]').focus()")
    seat.press("ctrl+z")
    seat.until("#said", "undone: draw an arrow from fault to operation_enabled")


def test_keys_that_are_quicker_than_answers_undo_one_step_each(drive: Path) -> None:
    """The second and the third are about the text that those before them leave, and none is refused."""
    with seated(Opening(drive / "system.toml", alone=True)) as seat:
        seat.click(seat.button("Tables"))
        seat.wait("document.querySelector('.table-choice')?.options.length")
        seat.choose(".table-choice", "drive ")
        seat.until(".standing", "✓ proved")
        many = lines(seat)
        seat.click("(" + cell(1, 0) + ")")
        for more in range(1, 5):
            seat.press("alt+enter")
            seat.wait(
                f"document.querySelectorAll('.sheet tr[data-row]').length === {many + more} "
                f"&& document.activeElement.dataset.line === '{1 + more}'"
            )
        seat.value(
            "(() => { for (let at = 0; at < 4; at += 1) document.activeElement.dispatchEvent("
            "new KeyboardEvent('keydown', { key: 'z', ctrlKey: true, bubbles: true, cancelable: true })); })()"
        )
        seat.wait(f"document.querySelectorAll('.sheet tr[data-row]').length === {many}")
        seat.until(".standing", "✓ proved")
        assert "Not done" not in seat.reads("#said")


def test_a_file_that_others_write_while_it_is_changed_here_is_told_as_the_page_is_looked_at(
    drive: Path,
) -> None:
    """Before anybody tries to save it; nothing of either is lost."""
    file = drive / "gallery" / "cia402" / "drive.rcs"
    with seated(Opening(drive / "system.toml", alone=True)) as seat:
        seat.click(seat.button("Tables"))
        seat.wait("document.querySelector('.table-choice')?.options.length")
        seat.choose(".table-choice", "drive ")
        seat.until(".standing", "✓ proved")
        many = lines(seat)
        seat.click("(" + cell(1, 0) + ")")
        seat.press("alt+enter")
        seat.wait(f"document.querySelectorAll('.sheet tr[data-row]').length === {many + 1}")
        others = "# theirs\n" + file.read_text()
        file.write_text(others)
        assert not seat.reads(".conflict")
        seat.value("dispatchEvent(new Event('focus'))")
        seat.until(".conflict", "was changed on disk, and here")
        assert (lines(seat), file.read_text()) == (many + 1, others)
        seat.value(f"void (window.take = {seat.button('Take what is on disk')})")
        seat.click("(" + cell(1, 0) + ")")
        seat.press("alt+enter")
        seat.wait(f"document.querySelectorAll('.sheet tr[data-row]').length === {many + 2}")
        assert seat.value("take.isConnected"), (
            "a button that is replaced while it is pressed is never clicked"
        )
        seat.click(seat.button("Take what is on disk"))
        seat.wait(f"document.querySelectorAll('.sheet tr[data-row]').length === {many}")
        seat.wait("!document.querySelector('.conflict').innerText")
        file.unlink()
        seat.value("dispatchEvent(new Event('focus'))")
        seat.until(".conflict", "is no longer on disk")
        seat.click(seat.button("Write over it"))
        seat.wait("!document.querySelector('.conflict').innerText")
    assert file.read_text() == others


def test_what_breaks_in_the_page_is_told_and_keeps_no_view_from_its_events(drive: Path) -> None:
    with seated(Opening(drive / "system.toml", alone=True)) as seat:
        for number, how in enumerate(
            ("setTimeout(() => { throw new Error('ouch 0'); })", "void Promise.reject(new Error('ouch 1'))")
        ):
            seat.value(f"{how}, 0")
            seat.until("#said", f"a bug in this page: ouch {number}")
        heard = seat.value(
            "import('./bus.js').then(({ Bus }) => { const bus = new Bus(), heard = []; "
            "bus.on('x', () => { throw new Error('ouch 3'); }); bus.on('x', (said) => heard.push(said)); "
            "bus.tell('x', 7); return heard; })"
        )
        assert heard == [7]
        seat.until("#said", "a bug in this page: ouch 3")
        seat.said.clear()


LIT = """JSON.stringify([document.querySelector('.table-choice').selectedOptions[0].text.split(" ").at(-1),
  [...document.querySelectorAll('.sheet tr.now')].map(({ dataset }) => dataset.name),
  [...new Set([...document.querySelectorAll('.graph-place .row.now')].map(({ dataset }) => dataset.line))],
  document.querySelector('.graph-words').innerText.split(" · ")[0]])"""
"""The table of the grid, its lit lines, the lit lines of the graph, and what that says of its state."""


def test_grid_and_graph_follow_a_level_through_its_tables(tmp_path: Path) -> None:
    log, said = tmp_path / "boxt.mcap", tmp_path / "boxt.json"
    assert rcsc(["run", "make_boxt", "--plant", "kinematic", "--log", str(log)]) == 0
    assert rcsc(["log", str(log), "--json", str(said)]) == 0
    cycles = {each["tick"]: each["levels"] for each in json.loads(said.read_text())["cycles"]}
    places = random.Random(20)  # noqa: S311  # the same places each time
    seen = set()
    with seated(Opening(REPO / "tables" / "system.toml", alone=True), logs=(log,)) as seat:
        seat.until(".ended", log.name)
        seat.press("2", "o", "3")
        seat.wait("document.querySelector('.table-choice')?.options.length")
        seat.wait("document.querySelector('.graph-place svg')")
        seat.choose(".table-choice", "acquire ")
        seat.until(".standing", "acquire_resting is monitored")  # and beside the graph it is read to its end
        assert seat.value(
            "((one) => one.scrollWidth <= one.clientWidth)(document.querySelector('.view-tables .standing'))"
        )
        for level in ("task", "primitive"):
            seat.choose(".table-choice", f"▶ {level} ")
            for _ in range(8):
                of = cycles[_somewhere(seat, places)][level]
                where = f"{level} is in {of['cur_state']}, line {of['line']}"
                wanted = json.dumps([of["table"], [of["line"]], [of["line"]], where], separators=(",", ":"))
                seat.wait(f"({LIT}) === {json.dumps(wanted)}")
                seen.add((level, of["table"]))
        assert len(seen) > 3, "few tables were met: the test shows little"
        seat.click("(" + cell(0, 0) + ")")
        seat.press("f2")  # who edits a table stays at it
        stays = "document.querySelector('.table-choice').value"
        seat.wait(f"{stays}.endsWith(' {of['table']}')")
        for _ in range(8):
            _somewhere(seat, places)
        assert seat.settled(stays).endswith(f".rcs {of['table']}")
        seat.press("escape", "escape", "w")
        seat.wait(f"{stays} === ' primitive'")


def _somewhere(seat: Seat, places: random.Random) -> int:
    """Click somewhere into the time line; the tick."""
    before = seat.tick()
    seat.click_time(places.uniform(0.05, 0.95))
    seat.wait(f"Number(document.querySelector('#time [role=slider]').ariaValueNow) !== {before}")
    return seat.tick()


@pytest.mark.parametrize("late", ["timeline.js", "run.js"])
def test_what_is_told_before_a_view_is_there_is_not_taken_back(tmp_path: Path, late: str) -> None:
    """A log that was opened as the page was loaded was not shown: what the page was greeted with came again after it."""
    system, log = dock(tmp_path / "dock"), tmp_path / "dock" / "kept.mcap"
    assert (
        rcsc(["run", str(system), "--cycles", "20", "--log", str(log), "--quiet"]) == 1
    )  # it does not come to its end
    with serving(Opening(system, alone=True)) as server, Seat(WIDE, HIGH) as seat:
        seat.hold_back(f"*/{late}")
        seat.open(server.address)
        seat.until("#state", "paused at cycle 0")
        asyncio.run(_opens(server, log))
        seat.let_go()
        seat.wait("document.documentElement.dataset.ready === 'yes'")
        seat.until(".ended", log.name)
        seat.wait("document.querySelector('#time [role=slider]').ariaValueMax === '20'")


async def _opens(server: Server, log: Path) -> None:
    async with page(server) as other:
        await other.ask("log.open", name=log.name)


def test_a_text_that_is_written_as_it_is_typed_is_written_whole(drive: Path) -> None:
    """The second letter waits for the answer to the first, and the file for both."""
    with seated(Opening(drive / "system.toml", alone=True)) as seat:
        seat.press("2")
        seat.choose(".table-choice", "drive ")
        seat.click(seat.button("Text"))
        seat.wait(f"{EDITOR}.text.includes('table drive')")
        seat.value(
            f"(() => {{ {EDITOR}.focus(); {EDITOR}.go([0, 0]);"
            "for (const each of ['# one', ' two\\n']) document.execCommand('insertText', false, each);"
            "const save = { key: 's', ctrlKey: true, bubbles: true, cancelable: true };"
            "document.activeElement.dispatchEvent(new KeyboardEvent('keydown', save)); })()"
        )
        seat.until("#said", "is written")
        assert (
            (drive / "gallery" / "cia402" / "drive.rcs").read_text(encoding="utf-8").startswith("# one two\n")
        )


def test_what_is_typed_without_a_connection_is_kept_and_sent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cut before a key, and between a key and its answer; nothing typed is lost, none comes twice."""
    sockets: list[web.WebSocketResponse] = []
    drive = dock(tmp_path / "dock").parent / "drive.rcs"

    class Socket(web.WebSocketResponse):
        async def prepare(self, request: web.BaseRequest) -> Any:
            sockets.append(self)
            return await super().prepare(request)

    monkeypatch.setattr("rcsc.desk.studio.server.web.WebSocketResponse", Socket)
    with serving(Opening(drive.parent / "system.toml")) as server, Seat(WIDE, HIGH) as seat:
        loop = server._loop
        assert loop is not None

        def cut() -> None:
            asyncio.run_coroutine_threadsafe(sockets[-1].close(), loop)
            seat.until("#state", "no connection")

        seat.enter(server.address)
        seat.until("#state", "paused at cycle 0")
        seat.press("2")
        seat.choose(".table-choice", "goto ")
        seat.click(seat.button("Text"))
        seat.wait(f"{EDITOR}.text.includes('table goto')")
        seat.value(f"({EDITOR}.focus(), {EDITOR}.go([0, 0]))")
        seat.write("# one")
        with monkeypatch.context() as patch:
            patch.setattr("rcsc.desk.studio.server.MOST_PAGES", 0)
            cut()
            seat.write(" two")
            seat.until("#said", "what is typed stays here")
            assert str(seat.value(f"{EDITOR}.text")).startswith("# one two")
        seat.until("#state", "paused at cycle 0")
        seat.write(" three")
        with PROVER:  # edits are taken, and their answers wait
            seat.write(" four")
            with monkeypatch.context() as patch:
                patch.setattr("rcsc.desk.studio.server.MOST_PAGES", 0)
                cut()
                seat.write(" five")
        seat.until("#state", "paused at cycle 0")
        seat.write("\n")
        seat.press("ctrl+s")
        seat.until("#said", "is written")
        assert drive.read_text(encoding="utf-8").startswith("# one two three four five\n")
        assert str(seat.value(f"{EDITOR}.text")).startswith("# one two three four five\n")
        seat.said.clear()


def _paste(seat: Seat, text: str) -> None:
    seat.value(
        f"(() => {{ const given = new DataTransfer(); given.setData('text/plain', {json.dumps(text)});"
        " document.activeElement.dispatchEvent(new ClipboardEvent('paste', "
        "{ clipboardData: given, bubbles: true, cancelable: true })); })()"
    )


def _texts(seat: Seat) -> list[list[str]]:
    """The cells of every line, also of those that a filter hides."""
    rows = "[...document.querySelectorAll('.sheet tr[data-row]')]"
    found: list[list[str]] = seat.value(
        f"{rows}.map((row) => [...row.querySelectorAll('[data-column]')].map((one) => one.dataset.text))"
    )
    return found


WIDTHS = """input w : int 0 .. 9
input on : bool
output out : int 0 .. 9
table t {
  | line | w    | when            || out |
  |------|------|-----------------||-----|
  | a    | 0    |                 || 0   |
  | b    | 1    |                 || 0   |
  | c    | 2    | on              || 0   |
  | d    | 2    | not on          || 0   |
  | e    | > 2  |                 || 0   |
}
"""


def test_what_a_spreadsheet_copied_comes_whole_and_as_often_as_there_is_room(tmp_path: Path) -> None:
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "t.rcs").write_text(WIDTHS)
    with seated(Opening(tmp_path / "system.toml", alone=True)) as seat:
        seat.press("2")
        seat.choose(".table-choice", "t ")
        seat.until(".standing", "✓ proved")
        begun = _texts(seat)
        seat.click("(" + cell(2, 1) + ")")
        _paste(seat, '"on\r\nand w < 9"\t7\r\n"not\ton"\t8\r\n')  # cells with a line end, and with a tab
        says(seat, 3, 2, "8")
        assert [row[2:] for row in _texts(seat)[2:4]] == [["on and w < 9", "7"], ["not on", "8"]]
        chosen = "[...document.querySelectorAll('.sheet .in-range')].map((one) => one.dataset.text)"
        seat.wait(f"{chosen}.length === 4")  # what was pasted is selected
        seat.press("escape", "ctrl+z")
        says(seat, 2, 1, "on")
        seat.click("(" + cell(0, 2) + ")")
        seat.press("shift+down", "shift+down", "shift+down")
        _paste(seat, "3\n4")
        says(seat, 3, 2, "4")
        assert [row[3] for row in _texts(seat)] == ["3", "4", "3", "4", "0"]
        seat.press("escape", "ctrl+z")
        says(seat, 3, 2, "0")
        assert _texts(seat) == begun


def test_lines_that_a_filter_hides_are_neither_emptied_nor_pasted_over(tmp_path: Path) -> None:
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "t.rcs").write_text(WIDTHS + WIDTHS[WIDTHS.index("table") :].replace("table t", "table u"))
    with seated(Opening(tmp_path / "system.toml", alone=True)) as seat:
        seat.press("2")
        seat.choose(".table-choice", "t ")
        seat.until(".standing", "✓ proved")

        def filtered(condition: str) -> None:
            seat.value("((one) => { one.focus(); one.value = ''; })(document.querySelector('.filter'))")
            seat.write(condition)
            seat.press("enter")

        filtered("w = 0 or w > 2")
        seat.wait("document.querySelectorAll('.sheet tr[data-row][hidden]').length === 3")
        seat.click("(" + cell(0, 2) + ")")
        _paste(seat, "5\n6")
        says(seat, 4, 2, "6")
        assert [row[3] for row in _texts(seat)] == ["5", "0", "0", "0", "6"]
        seat.click("(" + cell(0, 2) + ")")
        seat.press("shift+down", "delete")
        says(seat, 4, 2, "")
        assert [row[3] for row in _texts(seat)] == ["", "0", "0", "0", ""]
        seat.press("alt+enter")
        seat.wait(f"({HERE}) === '5,0' && document.querySelectorAll('.sheet tr[data-row]').length === 6")
        filtered("w = = 0")
        seat.until("#said", "is no condition")
        assert lines(seat) == 6, "what is no condition hides nothing"
        filtered("w = 0")
        seat.until(".filter-form span", "of 6 lines can match")
        seat.choose(".table-choice", "u ")
        seat.wait("document.querySelector('.sheet').ariaLabel === 'Table u'")
        assert seat.value("document.querySelector('.filter').value") == ""
        assert lines(seat) == 5


def test_a_large_graph_begins_where_the_table_does_and_is_drawn_near_far_and_aside(tmp_path: Path) -> None:
    """By keys, the wheel and the mouse: what is looked at stays where it is."""
    (tmp_path / "rcsc.toml").touch()
    names = [f"s{at}" for at in range(24)]
    rows = [
        f"| g{at} | {name} | true || s{(at + 5) % 24} |\n| w{at} | {name} | false || |\n"
        for at, name in enumerate(names)
    ]
    (tmp_path / "t.rcs").write_text(
        f"enum place {{ {', '.join(names)} }}\ninput go : bool\nstate now : place = s11\n"
        f"table t {{\n| line | now | go || now |\n|-|-|-||-|\n{''.join(rows)}}}\n"
    )
    middle = (
        "(({ left, top, width, height }) => [left + width / 2, top + height / 2])"
        "(document.querySelector('.graph-place [data-state=s11]').getBoundingClientRect())"
    )
    with seated(Opening(tmp_path / "system.toml", alone=True)) as seat:
        seat.press("3")
        seat.wait("document.querySelector('.graph-place [data-state=s11]')")
        view = seat.value(
            "(({ left, top, right, bottom }) => [left, top, right, bottom])(document.querySelector('.graph-place').getBoundingClientRect())"
        )

        def seen() -> list[float]:
            x, y = seat.value(middle)
            assert view[0] < x < view[2]
            assert view[1] < y < view[3]
            return [x, y]

        seen()
        seat.value("document.querySelector('.graph-place [data-state=s11]').focus()")
        at = seen()
        for _ in range(4):
            seat.press("+")
        assert seen()[1] == pytest.approx(at[1], abs=3)  # it is not yet wider than the view
        at = seen()
        seat.value(
            f"(([clientX, clientY]) => {{ for (let n = 0; n < 3; n += 1) document.querySelector('.graph-place').dispatchEvent("
            f"new WheelEvent('wheel', {{ ctrlKey: true, deltaY: -100, clientX, clientY, cancelable: true }})); }})({middle})"
        )
        assert seen() == pytest.approx(at, abs=3)
        left, top = view[0] + 5, view[1] + 90
        assert not seat.value(f"document.elementFromPoint({left}, {top}).closest('[data-focus]')")
        seat.mouse("mousePressed", left, top)
        seat.mouse("mouseMoved", left, top - 60)
        seat.mouse("mouseReleased", left, top - 60, 0)
        assert seen() == pytest.approx([at[0], at[1] - 60], abs=3)
        seat.press("f")
        place = "document.querySelector('.graph-place')"
        assert seat.value(
            f"{place}.scrollWidth <= {place}.clientWidth && {place}.scrollHeight <= {place}.clientHeight"
        )
