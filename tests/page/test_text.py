"""The text of a file in the studio: what could stand at a place, what is known of names, keys in tables, and what is typed by hands."""

import json
import random
import time
from pathlib import Path

import pytest

from rcsc.base.diagnostics.coded import Refused
from rcsc.desk.shell.opening import Opening
from tests.studio.driven import Seat, dock, seated
from tests.studio.tabled import Bench

OVERLAP = ("< 2500 || tick             | 400 ", "       || tick             | 400 ")
EDITOR = "document.querySelector('.text-view').editor"
DRIVE = "drive.rcs"


def at(text: str, wanted: str, nth: int = 0, into: int = 0) -> dict[str, int]:
    """Line and column of the nth place where something stands."""
    offset = -1
    for _ in range(nth + 1):
        offset = text.index(wanted, offset + 1)
    before = text[: offset + into]
    return {"line": before.count("\n"), "column": len(before) - before.rfind("\n") - 1}


# --- what the server says of places --------------------------------------------------------


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """The robot that docks, its drive opened."""
    made = Bench(dock(tmp_path / "dock"))
    made.open(DRIVE)
    return made


def test_places_are_answered_as_in_an_editor(bench: Bench) -> None:
    text = bench.doc(DRIVE)["text"]
    cell = at(text, "| moving |", into=2)
    offered = [each["label"] for each in bench.now("text.offers", DRIVE, **cell)]
    assert offered[:4] == ["idle", "moving", "bad", "/= idle"]
    assert "drive_order" not in offered
    told = bench.now("text.about", DRIVE, **cell)
    assert (told["start"], told["end"]) == (
        [cell["line"], cell["column"]],
        [cell["line"], cell["column"] + 6],
    )
    assert "moving   # 2 of 3 of enum stage" in told["text"]
    assert "**proved**" in bench.now("text.about", DRIVE, **at(text, "table goto", into=7))["text"]
    assert bench.now("text.about", DRIVE, line=1, column=0) is None
    declared = bench.now("text.declared", DRIVE, **cell)
    assert (declared["file"], declared["start"]) == (DRIVE, [2, 19])
    for name in ("drive_order", "words"):
        assert bench.now("text.declared", DRIVE, **at(text, name))["file"] == "words.rcs"


def test_colours_are_of_words_as_pages_count_them(tmp_path: Path) -> None:
    file = dock(tmp_path / "dock").parent / DRIVE
    file.write_text("# \U0001f916 é\n" + file.read_text().replace("go    |", "go    |", 1))
    bench = Bench(file.parent / "system.toml")
    lines = bench.open(DRIVE)["text"].split("\n")
    coloured = bench.now("text.colours", DRIVE)
    kinds = {}
    for place, column, length, kind in zip(*[iter(coloured["tokens"])] * 4, strict=True):
        units = lines[place].encode("utf-16-le")
        word = units[2 * column : 2 * (column + length)].decode("utf-16-le")
        kinds[word] = coloured["types"][kind]
    wanted = {
        "table": "keyword",
        "moving": "enumMember",
        "tick": "function",
        "400": "number",
        "# \U0001f916 é": "comment",
    }
    assert wanted.items() <= kinds.items()


def test_what_is_half_typed_is_answered_and_what_is_outdated_is_not(bench: Bench) -> None:
    cell = at(bench.doc(DRIVE)["text"], "| moving |", into=2)
    edit = {
        "start_line": cell["line"],
        "start_column": cell["column"],
        "end_line": cell["line"],
        "end_column": cell["column"] + 6,
    }
    version = bench.doc(DRIVE)["version"]
    bench.change("tables.edit", DRIVE, edits=[{**edit, "text": "m"}])
    after = {**cell, "column": cell["column"] + 1}
    assert [each["label"] for each in bench.now("text.offers", DRIVE, **after)][:3] == [
        "idle",
        "moving",
        "bad",
    ]
    for kind in ("text.offers", "text.about", "text.declared", "text.colours"):
        with pytest.raises(Refused, match="meanwhile"):
            bench.ask(kind, file=DRIVE, version=version, **after)
    for place in ({"line": 999_999, "column": 999_999}, {"line": 0, "column": 999_999}):
        for kind in ("text.offers", "text.about", "text.declared"):
            bench.now(kind, DRIVE, **place)  # past the end is the end, as editors have it
    with pytest.raises(Refused, match="no file"):
        bench.ask("text.offers", file="../out.rcs", version=1, line=0, column=0)


@pytest.mark.parametrize("key", ["next", "previous", "line", "column", "align"])
def test_a_key_in_a_table_is_one_step_that_is_undone(bench: Bench, key: str) -> None:
    before = bench.doc(DRIVE)["text"]
    done = bench.now("tables.key", DRIVE, key=key, **at(before, "| bad   |", into=2))
    after = bench.doc(DRIVE)["text"]
    changes = key in {"line", "column"}
    assert (after != before) is changes
    if key != "align":  # nothing was to be aligned
        place, column = done["cursor"]
        assert after.split("\n")[place][:column].rstrip().endswith("|")
    if changes:
        assert bench.change("tables.undo", DRIVE)["text"] == before
    assert bench.now("tables.key", DRIVE, key=key, line=0, column=0)["cursor"] is None
    with pytest.raises(Refused, match="no key is called"):
        bench.now("tables.key", DRIVE, key="../x", line=0, column=0)


def test_a_table_that_is_aligned_leaves_the_cursor_at_its_letter(bench: Bench) -> None:
    text = bench.doc(DRIVE)["text"]
    place = at(text, "| tick             |", into=6)
    edit = {
        "start_line": place["line"],
        "start_column": place["column"],
        "end_line": place["line"],
        "end_column": place["column"],
    }
    long = "; executing; executing; executing |"[:-2]
    text = bench.change("tables.edit", DRIVE, edits=[{**edit, "text": long}])["text"]
    for into in (2, 6, 6 + len(long), 30 + len(long), 60 + len(long)):
        cursor = at(text, "| tick", into=into)
        letter = text.split("\n")[cursor["line"]][cursor["column"] - 1]
        done = bench.now("tables.key", DRIVE, key="align", **cursor)
        after = bench.doc(DRIVE)["text"]
        place_, column = done["cursor"]
        assert after.split("\n")[place_][column - 1] in {letter, " "}, into
        assert letter == " " or after.split("\n")[place_][column - 1] == letter
        bench.change("tables.undo", DRIVE)


# --- in a browser ---------------------------------------------------------------------------


def sits(seat: Seat, table: str) -> None:
    """Open a table as text, once what is known of it is known."""
    seat.press("2")
    seat.choose(".table-choice", f"{table} ")
    seat.click(seat.button("Text"))
    seat.wait(
        f"{EDITOR}.text.includes('table {table}') && document.querySelector('.text-view').dataset.known === 'yes'"
    )


def goes(seat: Seat, wanted: str, nth: int = 0, into: int = 0, length: int = 0) -> None:
    """Put the cursor at a place, or select what stands there."""
    place = at(seat.value(f"{EDITOR}.text"), wanted, nth, into)
    line, column = place["line"], place["column"]
    seat.value(f"({EDITOR}.focus(), {EDITOR}.go([{line}, {column}], [{line}, {column + length}]))")


def line(seat: Seat, begins: str) -> str:
    return next(
        each for each in str(seat.value(f"{EDITOR}.text")).split("\n") if each.strip().startswith(begins)
    )


@pytest.mark.needs("chromium")
def test_a_finding_is_underlined_told_and_mended_in_the_text(tmp_path: Path) -> None:
    with seated(Opening(dock(tmp_path / "dock", OVERLAP), alone=True)) as seat:
        sits(seat, "goto")
        seat.value(f"{EDITOR}.go({json.dumps([at(seat.value(f'{EDITOR}.text'), '| late')['line'], 0])})")
        seat.wait("document.querySelector('.cm-found [title*=\"both match\"]')?.innerText === '✗'")
        seat.value(f"{EDITOR}.focus()")
        seat.press("f8")
        seat.wait("document.querySelector('.cm-tooltip .told, .cm-activeLine .cm-lintRange-error')")
        assert "| late" in seat.reads(".cm-activeLine")
        seat.press("ctrl+.")
        seat.until(".cm-panel-lint", "for instance command.target_mm = 1")
        seat.until(".cm-panel-lint .repair", "write <= 2499")
        assert "region: " in seat.reads(".cm-panel-lint")
        seat.go_to("write <= 2499")
        seat.press("enter")
        seat.until(".standing", "✓ proved")
        seat.wait("!document.querySelector('.cm-lintRange, .cm-found [title*=both]')")
        assert "| <= 2499 " in line(seat, "| go ")


@pytest.mark.needs("chromium")
def test_tables_are_typed_as_tables(tmp_path: Path) -> None:
    """Values by their type, cells by tab, columns aligned, lines and columns added, names asked about."""
    with seated(Opening(dock(tmp_path / "dock"), alone=True)) as seat:
        sits(seat, "goto")
        goes(seat, "| bad    |", into=2, length=3)
        seat.write("mo")
        seat.until(".cm-tooltip-autocomplete li[aria-selected]", "moving")
        time.sleep(0.2)  # an offer is not taken by a key that was meant for the text
        seat.press("enter")
        seat.wait(f"{EDITOR}.text.includes('| bad   | false       | moving')")
        seat.press("tab")
        seat.wait(
            "document.querySelector('.cm-activeLine').innerText.includes('| bad   | false       | moving |')"
        )
        seat.write("true")
        seat.wait(f"{EDITOR}.text.includes('| moving | true')")
        seat.press("shift+tab")
        row = line(seat, "| bad ")
        seat.wait(f"{EDITOR}.place[1] === {row.index('moving')}")
        seat.press("ctrl+alt+enter", "delete", "delete", "delete")
        seat.write("waits_long")
        seat.press("tab")
        seat.wait(f"{EDITOR}.text.includes('| start      | true')")
        before = seat.value(f"{EDITOR}.text")
        seat.press("ctrl+z")
        seat.wait(f"{EDITOR}.text !== {before!r}")
        goes(seat, "travelled_mm", nth=1)
        seat.press("f12")
        seat.wait(f"JSON.stringify({EDITOR}.place) === '[5,18]'")
        goes(seat, "drive_order")
        seat.press("f12")
        seat.wait(f"{EDITOR}.text.startsWith('unit') || {EDITOR}.text.includes('record drive_order')")
        seat.until(".cm-activeLine", "drive_order")


@pytest.mark.needs("chromium")
def test_what_is_typed_before_the_server_has_done_a_tab_goes_where_that_leads(tmp_path: Path) -> None:
    with seated(Opening(dock(tmp_path / "dock"), alone=True)) as seat:
        sits(seat, "goto")
        for at in range(4):
            goes(seat, "| bad    |" if at == 0 else f"| n{at - 1}", into=2, length=2)
            seat.press("ctrl+alt+enter", "delete", "delete", "delete")
            seat.write(f"n{at}")
            seat.press("tab")
            seat.write("false")
            seat.press("tab", "delete", "tab")
            seat.write("true")
            seat.press("tab", "shift+tab", "shift+tab", "left", "right")
            seat.write("idle")
            row = f"({EDITOR}.text.split('\\n').find((one) => one.trim().startsWith('| n{at} ')) ?? '')"
            seat.wait(
                f"{row}.split('|').slice(1, 5).map((one) => one.trim()).join() === 'n{at},false,idle,true'"
            )
        seat.press("tab")
        seat.write("false")
        seat.press("ctrl+s")  # all that was typed before is written
        seat.until("#said", "is written")
        saved = (tmp_path / "dock" / DRIVE).read_text()
        cells = saved[saved.index("| n3 ") :].split("|")[1:5]
        assert [cell.strip() for cell in cells] == ["n3", "false", "idle", "falsetrue"]


@pytest.mark.needs("chromium")
def test_outside_tables_tab_goes_on_and_escape_frees_the_keys(tmp_path: Path) -> None:
    with seated(Opening(dock(tmp_path / "dock"), alone=True)) as seat:
        sits(seat, "goto")
        seat.value(f"({EDITOR}.focus(), {EDITOR}.go([0, 0]))")
        seat.press("tab")
        seat.wait(f"!{EDITOR}.focused")
        seat.value(f"{EDITOR}.focus()")
        seat.press("ctrl+f")
        seat.wait("document.querySelector('.cm-search')")
        seat.press("escape")
        seat.wait(f"!document.querySelector('.cm-search') && {EDITOR}.focused")
        seat.press("escape")
        seat.wait(f"!{EDITOR}.focused")
        seat.press("1")
        seat.wait("document.querySelector('#views [data-view=run]').hasAttribute('data-shown')")


TYPED = ("|", " ", "a", "moving", "\n", "| x |", "#", "é", "\U0001f916", "  ", "true", "||", "{", "}")
PRESSED = (
    *"tab shift+tab enter escape ctrl+z ctrl+y left right up down home end delete".split(),
    *("ctrl+alt+enter", "ctrl+alt+i", "ctrl+space", "shift+down"),
)


@pytest.mark.needs("chromium")
@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_is_typed_the_page_and_the_file_say_the_same(tmp_path: Path, seed: int) -> None:
    """Faster than answers come, in tables and outside."""
    hand = random.Random(seed)  # noqa: S311  # the same each time
    system = dock(tmp_path / "dock")
    with seated(Opening(system, alone=True)) as seat:
        sits(seat, "goto")
        for turn in range(160):
            if turn % 20 == 0:
                lines = seat.value(f"{EDITOR}.text.split('\\n').length")
                seat.value(
                    f"({EDITOR}.focus(), {EDITOR}.go([{hand.randrange(lines)}, {hand.randrange(60)}]))"
                )
            if hand.random() < 0.5:
                seat.write(hand.choice(TYPED))
            else:
                seat.press(hand.choice(PRESSED))
        seat.value(f"{EDITOR}.focus()")
        seat.press("escape", "escape")
        shown = seat.settled(f"{EDITOR}.text")
        seat.press("ctrl+s")
        seat.until("#said", "is written")
        written = seat.settled(f"{EDITOR}.text")
        assert (system.parent / DRIVE).read_text(encoding="utf-8") == written
        assert "".join(written.split()) == "".join(shown.split()), "writing lays out, and no more"
