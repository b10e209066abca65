"""What a new user meets in the first minutes: keys quicker than the machine, panes that are never empty, what is broken is seen."""

import random
import re
import shutil
from pathlib import Path

import pytest

from rcsc.desk.shell.opening import Opening
from rcsc.front.commands import run as rcsc
from tests.studio.driven import Seat, dock, seated

pytestmark = pytest.mark.needs("chromium")
EXAMPLES = Path(__file__).parents[2] / "tables" / "examples"
PANES = "[...document.querySelectorAll('.pane')].map((pane) => [pane.hidden, [...pane.children].map(({ dataset }) => dataset.view)])"
CELLS = "[...document.querySelectorAll('.sheet td[data-column=\"{}\"]')].map((cell) => cell.innerText.trim())"
SLOW = """window.WebSocket = class extends EventTarget {
  static OPEN = 1;
  readyState = 1;
  constructor() {
    super();
    setTimeout(() => {
      this.dispatchEvent(new Event("open"));
      const said = { event: "build.state", body: { doing: "", asks: "", system: true } };
      this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify(said) }));
    });
  }
  send() {}
};"""
"""A studio that has said that there is a system, and not yet what it does."""


@pytest.fixture
def docks(tmp_path: Path) -> Path:
    """The robot that docks, proved and compiled."""
    system = dock(tmp_path / "dock")
    assert rcsc(["compile", str(system)]) == 0
    return system


@pytest.mark.parametrize("seed", range(3))
def test_no_pane_that_is_seen_is_ever_empty_and_no_view_is_in_two(docks: Path, seed: int) -> None:
    """Whatever is pressed of what shows views, and however quickly."""
    draw = random.Random(seed)  # noqa: S311  # a test, no secret
    with seated(Opening(docks)) as seat:
        for _ in range(6):
            seat.press(*draw.choices(["\\", "o", "1", "2", "3", "4", "5", "6"], k=12))
            seat.wait("document.querySelectorAll('.view').length")
            seat.value("new Promise((done) => setTimeout(done, 300))")
            panes = seat.value(PANES)
            assert all(len(views) == 1 for hidden, views in panes if not hidden), panes
            every = [view for _, views in panes for view in views]
            assert len(every) == len(set(every)), panes
        assert not seat.said


def test_what_is_typed_down_a_column_quicker_than_answers_is_all_written(docks: Path) -> None:
    """As one types into a spreadsheet: a value, Enter, the next value."""
    with seated(Opening(docks)) as seat:
        seat.press("2")
        seat.wait("document.querySelector('.sheet td')")
        seat.click('.sheet td[data-line="1"][data-column="4"]')
        before = seat.value(CELLS.format(4))
        for value in ("1", "22", "3", "4"):
            seat.press(*value, "enter")
        wanted = [before[0], "1", "22", "3", "4", *before[5:]]
        seat.wait(f"JSON.stringify({CELLS.format(4)}) === JSON.stringify({wanted!r})")
        seat.press("ctrl+z", "ctrl+z", "ctrl+z", "ctrl+z")
        seat.wait(f"JSON.stringify({CELLS.format(4)}) === JSON.stringify({before!r})")
        assert "Not done" not in seat.reads("#said")


def test_space_runs_and_pauses_from_a_cell_of_the_grid_too(docks: Path) -> None:
    with seated(Opening(docks)) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("2")
        seat.choose(".table-choice", "dock ")  # and not the table that runs, which may be another in a moment
        seat.wait("document.querySelectorAll('.sheet td[data-line]').length > 10")
        seat.click('.sheet td[data-line="1"][data-column="0"]')
        before = seat.reads(".sheet tbody")
        seat.press("space")
        seat.until("#state", "runs at cycle")
        seat.press("space")
        seat.until("#state", "paused at cycle")
        assert not seat.value("document.querySelector('.cell-input')")
        assert seat.reads(".sheet tbody") == before


def test_what_is_pressed_while_the_tables_are_proved_is_done_after(tmp_path: Path) -> None:
    system = dock(tmp_path / "dock")
    with seated(Opening(system)) as seat:
        seat.press("s")
        seat.until("#said", "as soon as the tables are proved")
        seat.until("#state", "paused at cycle 1")


def test_what_is_pressed_twice_while_the_tables_are_proved_is_given_up(tmp_path: Path) -> None:
    system = dock(tmp_path / "dock")
    with seated(Opening(system)) as seat:
        seat.press("s", "s")
        seat.until("#said", "given up")
        seat.until("#state", "paused at cycle 0")


def test_what_is_pressed_before_a_table_is_found_wrong_runs_nothing_later(tmp_path: Path) -> None:
    """It was meant of the tables as they were."""
    system = dock(
        tmp_path / "dock", ("< 2500 || tick             | 400 ", "       || tick             | 400 ")
    )
    with seated(Opening(system)) as seat:
        seat.press("s")
        seat.until("#state", "lines go and late of table goto both match some input")
        shutil.copy(Path(__file__).parents[1] / "data" / "dock" / "drive.rcs", system.parent / "drive.rcs")
        seat.click(seat.button("Prove, compile and open again"))
        seat.until("#state", "paused at cycle 0")


def test_the_first_picture_claims_nothing_of_a_system_that_it_does_not_know_yet(docks: Path) -> None:
    with seated(Opening(docks)) as seat:
        seat.begin_with(SLOW)
        seat.reload()
        seat.wait("document.documentElement.dataset.ready === 'yes'")
        seat.until(".view-run .closed", "Connecting")
        assert "not connected" not in seat.reads("#panes")
        assert "No system runs" not in seat.reads("#panes")


def test_no_field_names_variables_that_the_system_does_not_have(docks: Path) -> None:
    with seated(Opening(docks)) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("s", "b")
        seat.until("#state", "paused at cycle 1")
        seat.press("escape", "s")
        seat.until("#state", "paused at cycle 2")
        for view in "123456":
            seat.press("escape", view)
        seat.press("1")
        shown = seat.value(
            "[...document.querySelectorAll('input')].map(({ placeholder, title }) => `${placeholder} ${title}`).join(' ')"
        )
        assert "task" not in shown
        assert re.search(r"supervisor\.\w+ = \w+, or a line, as supervisor\.\w+\.\w+", shown)


def test_what_was_broken_by_hand_is_seen_from_every_view_and_at_its_level(docks: Path) -> None:
    with seated(Opening(docks)) as seat:
        seat.until("#state", "paused at cycle 0")
        assert seat.value("document.querySelector('#broken').hidden")
        _do(seat, "freeze supervisor.to_drive")
        seat.until("#broken", "supervisor.to_drive → drive.command is broken")
        seat.until("[aria-label='Level supervisor']", "what is written to it is lost")
        seat.until("[aria-label='Level drive']", "nothing new comes from it")
        seat.press("escape", "3")
        assert seat.value("document.querySelector('#broken').checkVisibility()")
        seat.click("#broken")
        seat.until(".drawer", "broken: what is written to it is lost")
        _do(seat, "fault wheel_slips on")
        seat.until("#broken", "2 things are broken")
        _do(seat, "thaw supervisor.to_drive", "fault wheel_slips off")
        seat.wait("document.querySelector('#broken').hidden")


def _do(seat: Seat, *lines: str) -> None:
    seat.press("escape", "1", "c")
    for line in lines:
        seat.wait("document.activeElement.getAttribute('aria-label') === 'A command of the shell'")
        seat.type(line)


def test_a_tick_of_one_millisecond_is_told_from_the_next(tmp_path: Path) -> None:
    system = dock(tmp_path / "dock")
    for path in (system, *system.parent.glob("*.rcs")):
        text = path.read_text(encoding="utf-8")
        path.write_text(
            text.replace("period 40 [ms]", "period 1 [ms]").replace("tick_ms = 40", "tick_ms = 1"),
            encoding="utf-8",
        )
    with seated(Opening(system)) as seat:
        seat.press("s")
        seat.until("#state", "paused at cycle 1, 0.001 s")
        seat.until(".readout", "tick 1 of 1, 0.001 s")


def test_no_curve_is_drawn_of_a_run_that_has_not_begun(docks: Path) -> None:
    with seated(Opening(docks)) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("5")
        seat.wait("document.querySelector('.graph')")
        seat.until(".graph", "No cycle yet")
        assert not seat.value("document.querySelector('.uplot')")
        seat.press("s")
        seat.wait("document.querySelector('.uplot')")
        seat.wait("!document.querySelector('.graphs').innerText.includes('No cycle yet')")


# --- the first time ---


def test_who_comes_first_sees_the_robot_beside_the_table_that_runs_and_is_told_what_it_is(
    docks: Path,
) -> None:
    with seated(Opening(docks), first_time=True, in_space=True) as seat:
        seat.until("#about", "dock is controlled by 2 levels: supervisor and drive.")
        seat.wait(f'JSON.stringify({PANES}) === \'[[false,["cell"]],[false,["tables"]]]\'')
        seat.until(".table-choice option:checked", "supervisor runs")
        seat.click(seat.button("Run the demo"))
        seat.wait("document.querySelector('.sheet tr.now')")
        seat.wait("document.querySelector('#about').hidden")
        seat.reload()
        seat.until("#state", "cycle")
        assert seat.value("document.querySelector('#about').hidden"), "it is told once"


def test_of_tables_alone_nothing_is_offered_that_runs(tmp_path: Path) -> None:
    grip = tmp_path / "grip.rcs"
    shutil.copy(EXAMPLES / "grip.rcs", grip)
    shutil.copy(EXAMPLES.parent / "vocabulary.rcs", tmp_path)
    with seated(Opening(tmp_path / "system.toml", alone=True), first_time=True) as seat:
        seat.until("#about", "exactly one must match, whatever comes in")
        seat.until(".standing", "refuted")
        shown = "[...document.querySelectorAll('#views button')].filter((one) => one.checkVisibility()).map(({ dataset }) => dataset.view)"
        assert seat.value(shown) == ["tables", "graph"]
        assert seat.value(PANES)[1][0], "one view has all the room"
        assert not seat.value("document.querySelector('#time').checkVisibility()")
        assert "null" not in seat.reads("#about")


def test_the_bar_of_verdicts_leads_to_each_finding_at_its_table(tmp_path: Path) -> None:
    system = dock(
        tmp_path / "dock", ("< 2500 || tick             | 400 ", "       || tick             | 400 ")
    )
    with seated(Opening(system)) as seat:
        seat.until("#verdict summary", "✗ not proved: ")
        seat.click("#verdict summary")
        seat.until("#verdict li", "lines go and late of table goto both match some input drive.rcs:")
        seat.click(seat.button("Go to it", "#verdict"))
        seat.wait("document.querySelector('.table-choice').value.endsWith(' goto')")
        seat.wait("document.activeElement.closest('tr.finding')")
        assert not seat.value("document.querySelector('#verdict details').open")


def test_the_bar_of_verdicts_says_of_what_is_proved_and_what_nobody_asked(docks: Path) -> None:
    with seated(Opening(docks)) as seat:
        seat.until(
            "#verdict summary",
            "tables proved: whatever comes in, exactly one line matches; 2 trusting assumptions",
        )
        seat.until("#verdict summary", "requirements not asked")
        seat.click("#verdict summary")
        seat.until("#verdict li", "Nobody has asked yet whether")
        seat.click(seat.button("Prove the levels together", "#verdict"))
        seat.until("#said", "the levels are proved together")
        seat.until("#verdict summary", "requirements proved")


def test_how_wide_panes_are_is_dragged_moved_by_keys_and_kept(docks: Path) -> None:
    wide = "document.querySelector('.pane').clientWidth"
    with seated(Opening(docks)) as seat:
        before = seat.value(wide)
        seat.value("document.querySelector('.between').focus()")
        seat.press("right", "right", "right")
        assert seat.value(wide) > before + 50
        now = seat.value(wide)
        seat.reload()
        seat.wait(f"Math.abs({wide} - {now}) < 3")


def test_the_system_is_a_picture_in_which_a_buffer_is_told_broken_and_mended(docks: Path) -> None:
    """Every level, everybody outside and every buffer stands there; by keys as by the mouse."""
    with seated(Opening(docks)) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("6", "s", "s")
        seat.until(".system", "supervisor")
        names = seat.value("[...document.querySelectorAll('.system .name')].map((one) => one.textContent)")
        assert sorted(names) == ["base", "drive", "fleet", "supervisor"]
        wire = "[aria-label='Buffer supervisor.to_drive to drive.command']"
        assert seat.value("document.querySelectorAll('.wire').length") == 10
        seat.value(f'document.querySelector("{wire}").focus()')
        seat.press("enter")
        seat.until(".told-wire", "supervisor.to_drive → drive.command")
        seat.click(seat.button("Break it"))
        seat.wait(f'document.querySelector("{wire}.broken")')
        seat.until("#broken", "supervisor.to_drive → drive.command is broken")
        seat.click(seat.button("Mend it"))
        seat.wait(f'!document.querySelector("{wire}.broken")')
        assert "NaN" not in seat.value("document.querySelector('.system svg').outerHTML")


def test_the_bar_of_verdicts_says_under_which_timing_something_is_proved(tmp_path: Path) -> None:
    """What holds as scheduled alone is not called proved for every run."""
    cart = tmp_path / "cart"
    assert rcsc(["new", str(cart), "--template", "system"]) == 0
    assert rcsc(["prove", str(cart)]) == 0
    with seated(Opening(cart / "system.toml")) as seat:
        seat.until("#verdict summary", "requirements proved")
        said = seat.value(
            "[...document.querySelectorAll('#verdict li')].map(({ textContent }) => textContent)"
        )
        [scheduled] = [line for line in said if "Proved as scheduled, for no other timing: " in line]
        assert {"pause_stands", "done_stands"} <= set(re.findall(r"\w+", scheduled))
        assert not [line for line in said if "every run" in line and "pause_stands" in line]
        seat.press("q")
        seat.until("[data-name=pause_stands] td", "proved as scheduled")
        assert not seat.said


def test_the_bar_of_verdicts_asks_of_no_assumption_whether_it_is_proved(tmp_path: Path) -> None:
    """It is taken for granted, and told so."""
    assumed = "assume presses_long assumed : on for at least 2 cycles, bumper\n\nlevel drive {"
    system = dock(tmp_path / "dock", ("level drive {", assumed))
    with seated(Opening(system)) as seat:
        seat.until("#verdict summary", "trusting 1 assumption about what stands outside")
        asked = re.search(r"(\d+) requirements not asked", seat.reads("#verdict summary"))
        assert asked
        seat.click("#verdict summary")
        seat.until("#verdict li", "Taken for granted of what stands outside: presses_long")
        unasked = seat.value(
            "[...document.querySelectorAll('#verdict li')].find((one) => one.innerText.includes('Nobody')).querySelectorAll('code').length"
        )
        assert unasked == int(asked[1])
        assert "presses_long holds" not in seat.reads("#verdict ul")


def test_what_stands_in_the_cell_has_its_name_above_it_where_it_is_seen(docks: Path) -> None:
    plates = "[...document.querySelectorAll('.plate')].filter((one) => !one.hidden)"
    apart = (
        f"(() => {{ const boxes = {plates}.map((one) => one.getBoundingClientRect());"
        "return boxes.every((one, at) => boxes.slice(at + 1).every((other) =>"
        " one.right <= other.left || other.right <= one.left || one.bottom <= other.top || other.bottom <= one.top)); })()"
    )
    with seated(Opening(docks), in_space=True) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("4")
        seat.wait(f"{plates}.length > 0")
        shown = set(seat.settled(f"{plates}.map(({{ textContent }}) => textContent)"))
        assert shown
        assert shown <= {"left guide", "right guide"}
        assert seat.value(apart)
        seat.click(".view-cell label input[type=checkbox]")
        seat.wait(f"{plates}.length === 0")
