"""Every view in both themes, at the least size: nothing is cut, sticks out, or is too faint to be read; and scrubbing shows what was."""

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.desk.shell.opening import Opening
from rcsc.front.commands import run as rcsc
from tests.studio.driven import HIGH, WIDE, Seat, dock, scrubbed, seated

pytestmark = pytest.mark.needs("chromium")
LOOK = Path(__file__).with_name("look.js").read_text(encoding="utf-8").partition("\n\n")[2]
"""What is wrong with how a page looks, a sentence each."""
VIEWS = ("run", "tables", "graph", "cell", "plots", "system")
DRAWER = ("values", "breaks", "script", "found", "console")
WRONG = {
    "text is cut": "<div style='width:50px;overflow:hidden;white-space:nowrap'>a long text that is cut here</div>",
    "text is cut: button": "<button style='width:30px;overflow:hidden;white-space:nowrap'>a long button</button>",
    "too faint": "<p style='color:#999'>faint</p>",
    "text is cut: input. «» so many words": "<input style='width:50px' placeholder='so many words'>",
    "too faint: input. «» faint": "<style>::placeholder { color: #bbb }</style><input placeholder='faint'>",
    "too faint: p. «dark": "<div style='background:#000'><p style='background:rgba(255,255,255,.2);color:#333'>dark on dark</p></div>",
    "back quotes": "<p>a name like `this`</p>",
    "sticks out sideways": "<div style='position:absolute;left:1200px;width:200px'>out of it</div>",
    "sticks out downwards": "<div style='position:absolute;top:900px'>below</div>",
}
RIGHT = (
    "<p>fine</p>", "<div style='width:50px;overflow:auto;white-space:nowrap'>a long text that is scrolled</div>",
    "<input style='width:200px' placeholder='few words'>", "<input value='1' style='width:50px' placeholder='so many words'>",
    "<p style='color:#767676'>just dark enough</p>",
    "<pre>what a command printed: `this`</pre>",
    "<p title='a long text' style='width:50px;overflow:hidden;white-space:nowrap;text-overflow:ellipsis'>a long text</p>",
)  # fmt: skip


@pytest.fixture(scope="module")
def seat(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Seat]:
    """The robot that docks, with graphs that it shows, at the end of its script."""
    system = dock(tmp_path_factory.mktemp("looks") / "dock")
    text = system.read_text(encoding="utf-8")
    shows = 'other = ["drive.waited", "drive.travelled_mm"]'
    system.write_text(text.replace("[displays]\n", f"[displays]\n{shows}\n"), encoding="utf-8")
    assert rcsc(["compile", str(system)]) == 0
    with seated(Opening(system, script="dock.csv")) as one:
        one.until("#state", "paused at cycle 0")
        one.press("space")
        one.until(".ended", "the script is at its end")
        yield one


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_view_can_be_read_in_both_themes(seat: Seat, theme: str) -> None:
    while seat.value("document.documentElement.dataset.theme") != theme:
        seat.click("#theme")
    for view in VIEWS:
        seat.click(f"#views button[data-view={view}]")
        seat.wait(f"document.querySelector('.view-{view}')?.childElementCount")
        assert seat.settled(LOOK) == [], f"{view}, {theme}"
    seat.click("#views button[data-view=tables]")
    for mode in ("Text", "Both", "Grid"):
        seat.click(seat.button(mode))
        seat.wait(f"'{mode}' === 'Grid' || document.querySelector('.cm-line [class^=word-]')")
        assert seat.settled(LOOK) == [], f"{mode}, {theme}"
    seat.click("#views button[data-view=run]")
    for tab in DRAWER:
        seat.click(f"#tab-{tab}")
        assert seat.settled(LOOK) == [], f"{tab}, {theme}"
    for key, dialog in (("?", "keys"), ("x", "sharing")):
        seat.press("escape", key)
        seat.wait(f"document.querySelector('#{dialog}').open")
        assert seat.settled(LOOK) == [], f"{dialog}, {theme}"
        seat.press("escape")
        seat.wait(f"!document.querySelector('#{dialog}').open")


def test_a_system_that_is_not_proved_can_be_read(tmp_path: Path) -> None:
    """What is found stands in place of the levels, in the head, and at the table."""
    system = dock(
        tmp_path / "dock", ("< 2500 || tick             | 400 ", "       || tick             | 400 ")
    )
    with seated(Opening(system)) as one:
        one.until("#state", "lines go and late of table goto both match some input")
        for view in VIEWS:
            one.click(f"#views button[data-view={view}]")
            one.wait(f"document.querySelector('.view-{view}')?.childElementCount")
            assert one.settled(LOOK) == [], view


def test_the_page_has_every_key_that_its_guide_names(seat: Seat) -> None:
    guide = (Path(__file__).parents[2] / "tables" / "guide" / "studio.md").read_text(encoding="utf-8")
    guide = re.sub(r"^```.*?^```", "", guide, flags=re.MULTILINE | re.DOTALL)
    seat.press("escape", "?")
    seat.wait("document.querySelector('#keys').open")
    listed = set(seat.value("[...document.querySelectorAll('#keys kbd')].map(({ innerText }) => innerText)"))
    seat.press("escape")
    named = {key for key in re.findall(r"`([^`\n]+)`", guide) if len(key) == 1} | {"space"}
    assert len(named) > 20
    assert named <= listed
    chords = {key.lower() for key in re.findall(r"`((?:Ctrl|Alt|Shift|F\d+)[^ `]*)`", guide)} - {"shift"}
    told = {each.rpartition(": ")[2] for each in listed}
    assert chords <= told, chords - told


def test_the_levels_have_the_room_of_an_empty_console(seat: Seat) -> None:
    seat.click("#views button[data-view=run]")
    seat.click("#tab-console")
    high = "document.querySelector('{}').clientHeight"
    assert seat.value(f"{high.format('.cards')} / {high.format('.view-run')}") > 0.6


def test_curves_are_those_that_the_system_shows_until_others_are_chosen(seat: Seat) -> None:
    seat.click("#views button[data-view=plots]")
    seat.wait("document.querySelectorAll('.graph .plot canvas').length === 2")
    seat.until(".graph:nth-child(2) .legend", "drive.travelled_mm")
    seat.choose("select[aria-label='Graphs that the system shows']", "way")
    seat.wait("document.querySelectorAll('.graph').length === 5")
    for left in (4, 3, 2, 1, 0):
        seat.click(".graph button[aria-label^=Remove]")
        seat.wait(f"document.querySelectorAll('.graph').length === {left}")
    seat.until(".view-plots .closed", "or choose what the system shows")
    below = "document.querySelector('.view-plots .closed').getBoundingClientRect().top"
    bars = "[...document.querySelectorAll('.view-plots .bar')].at(-1).getBoundingClientRect().bottom"
    assert seat.value(f"{below} - {bars}") < 30
    again(seat)
    seat.until(".view-plots .closed", "or choose what the system shows")
    assert seat.value("document.querySelectorAll('.graph').length") == 0


@pytest.mark.parametrize("first", VIEWS)
def test_each_view_opens_first_and_after_others(seat: Seat, first: str) -> None:
    """What a view hears as it is made was told long before, where it is not the first."""
    seat.click(f"#views button[data-view={first}]")
    again(seat)
    for view in (first, *VIEWS):
        seat.click(f"#views button[data-view={view}]")
        seat.wait(f"document.querySelector('.view-{view}')?.childElementCount")
        assert seat.settled(LOOK) == [], view
    assert seat.said == []


def again(seat: Seat) -> None:
    """Load the page anew, as who presses F5."""
    seat.reload()
    seat.wait("document.documentElement.dataset.ready === 'yes'")
    seat.until("#state", "cycle")


PRESSED = "[...document.querySelectorAll('button, summary, input[type=checkbox], [role=tab], td')].filter((one) => one.checkVisibility())"
KEYS = (
    *"[]{}mMnNfel0+-?xgrtc/jkuiops123456789", "left", "right", "up", "down", "home", "end", "pageup", "pagedown", "enter", "escape", "tab",
    "shift+tab", "f2", "delete", "space", "ctrl+z", "ctrl+y", "ctrl+s", "ctrl+enter", "shift+up", "shift+down",
)  # fmt: skip
WRITTEN = (
    "0", "-", "true", "idle | 1", "'", "\u202e", "x" * 300, "999999999999999999999", "task", "set", "halt",
    "\t\t", "é", "5 mm",
)  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_is_pressed_written_and_clicked_raises_nothing(seed: int, tmp_path: Path) -> None:
    """In any view, in any order, also while the tables are compiled: nothing is raised, and the page opens anew."""
    hand = random.Random(seed)  # noqa: S311  # the same each time
    with seated(Opening(dock(tmp_path / "dock"), script="dock.csv")) as one:
        for _ in range(250):
            match hand.randrange(6):
                case 0:
                    one.value(
                        f"document.querySelector('#views button[data-view={hand.choice(VIEWS)}]').click()"
                    )
                case 1:
                    one.write(hand.choice(WRITTEN))
                case 2 | 3:
                    one.press(hand.choice(KEYS))
                case 4:
                    one.mouse("mousePressed", x := hand.randrange(WIDE), y := hand.randrange(HIGH))
                    one.mouse("mouseMoved", x + hand.randrange(-90, 90), y + hand.randrange(-90, 90))
                    one.mouse("mouseReleased", x, y)
                case _:
                    one.value(f"{PRESSED}[Math.floor({hand.random()} * {PRESSED}.length)]?.click()")
        assert one.said == []
        one.reload()
        one.wait("document.documentElement.dataset.ready === 'yes'")
        one.wait("document.querySelector('#state').innerText")


def test_what_is_wrong_is_seen(tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    with Seat(WIDE, HIGH) as bare:
        for said, inside in [*WRONG.items(), *(("", inside) for inside in RIGHT)]:
            file.write_text(f"<!doctype html><body style='background:#fff'>{inside}", encoding="utf-8")
            bare.open(file.as_uri())
            found = bare.value(LOOK)
            assert [one for one in found if one.startswith(said)] == found, inside
            assert bool(found) is bool(said), inside


def test_a_style_that_the_policy_forbids_is_heard(tmp_path: Path) -> None:
    """Whether the page's text has it or a script sets it."""
    policy = (
        "<meta http-equiv=content-security-policy content=\"style-src 'self'; script-src 'unsafe-inline'\">"
    )
    file = tmp_path / "page.html"
    with Seat(WIDE, HIGH) as bare:
        for inside in (
            "<p style='color: red'>",
            "<script>document.body.setAttribute('style', 'color: red')</script>",
        ):
            file.write_text(f"<!doctype html>{policy}<body>{inside}", encoding="utf-8")
            bare.open(file.as_uri())
            assert ["Applying inline style" in said for said in bare.said] == [True], inside


def test_scrubbing_shows_the_last_tick_and_keeps_nothing(seat: Seat) -> None:
    seat.click("#views button[data-view=run]")
    seat.press("escape")
    places = random.Random(7)  # noqa: S311  # the same places each time
    for _ in scrubbed(seat, 30, places):
        pass
    before = seat.heap()
    shown = list(scrubbed(seat, 300, places, wait_every=10))
    assert len(shown) == 30  # each time what was wanted last
    assert len({tick for tick, _ in shown}) > 15
    assert seat.heap() - before < 2_000_000


def test_a_moment_is_shared_by_keys(seat: Seat) -> None:
    seat.value("""(() => {
      window.written = [];
      URL.createObjectURL = (blob) => { window.written.push(blob); return "data:,"; };
      HTMLAnchorElement.prototype.click = function () { window.written.push(this.download); };
    })()""")
    seat.press("x")
    seat.wait("document.querySelector('#sharing').open")
    seat.press("enter")
    seat.wait("window.written.length === 2")
    assert seat.value("window.written[1]").startswith("dock_tick_")
    assert "<!doctype html>" in seat.value("window.written[0].text()")
    seat.press("escape")


DISPLAYED = (
    ("enum stage { idle, moving, bad }\n", "enum stage { idle, moving, bad }\nenum shown { way, other }\n"),
    ("output report : drive_report\n", "output report : drive_report\noutput display : shown\n"),
    (
        "reads command, inc_command_seen, status_report writes report {\n",
        (
            "reads command, inc_command_seen, status_report, stage writes report, display {\n"
            "  display := other\n  if stage = moving { display := way }\n"
        ),
    ),
)
"""The drive says which set of curves is looked at: its way while it moves."""


def test_curves_follow_what_the_tables_choose_until_somebody_takes_one_away(tmp_path: Path) -> None:
    system = dock(tmp_path / "dock", *DISPLAYED)
    text = system.read_text(encoding="utf-8")
    shows = 'other = ["drive.waited", "drive.command.target_mm"]'
    system.write_text(text.replace("[displays]\n", f"[displays]\n{shows}\n"), encoding="utf-8")
    legends = "[...document.querySelectorAll('.graph .legend')].map(({ innerText }) => innerText.trim().split(/\\s/)[0]).join(' ')"
    with seated(Opening(system, script="dock.csv")) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("s")
        seat.until("#state", "paused at cycle 1")
        seat.click("#views button[data-view=plots]")
        seat.wait(f"{legends} === 'drive.waited drive.command.target_mm'")
        seat.press("escape", "1", "r")
        seat.write("drive.stage = moving")
        seat.press("enter")
        seat.until("#state", "paused at cycle")
        seat.click("#views button[data-view=plots]")
        seat.wait(f"{legends} === 'drive.travelled_mm drive.lateral_mm drive.speed_mm_s'")
        seat.click(".graph button[aria-label^=Remove]")
        seat.press("escape", "space")
        seat.until("#state", "paused at")
        seat.wait(f"{legends} === 'drive.lateral_mm drive.speed_mm_s'")


def test_what_moves_before_it_is_pressed_is_aimed_at_again(tmp_path: Path) -> None:
    """And what has come to its place does not feel the press; what is replaced while it is pressed is not clicked."""
    file = tmp_path / "page.html"
    file.write_text(
        "<!doctype html><body style='margin: 0'><div id=space></div><button id=one>one</button><br><button id=two>two</button>"
        "<script>window.felt = ''; const space = document.querySelector('#space');"
        "addEventListener('mousemove', () => { space.style.height = '21.5px'; }, { once: true });"
        "one.onclick = () => { felt += 'one '; }; two.onclick = () => { felt += 'two '; };"
        "</script>",
        encoding="utf-8",
    )
    with Seat(WIDE, HIGH) as bare:
        bare.open(file.as_uri())
        bare.click("#two")
        assert bare.value("felt") == "two "
        bare.value("one.onmousedown = () => one.replaceWith(document.createElement('hr')), 0")
        bare.click("#one")
        assert bare.value("felt") == "two "
