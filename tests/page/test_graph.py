"""Ways about a large graph, in a real browser: a small picture of the whole, and a search for states and lines."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.desk.shell.opening import Opening
from tests.studio.driven import Seat, seated

pytestmark = pytest.mark.needs("chromium")
FIND = ".view-graph input[type=search]"
FOUND = "document.querySelector('.graph-place .found')"
PLACE = "document.querySelector('.graph-place')"
SCROLLED = f"[{PLACE}.scrollLeft, {PLACE}.scrollTop].map(Math.round)"
MAP = "document.querySelector('.minimap')"


def machine(folder: Path, many: int) -> Opening:
    """A table of so many states, each with a line that stays and one that leads five on."""
    (folder / "rcsc.toml").touch()
    names = [f"state{at}" for at in range(many)]
    rows = [
        f"| go{at} | {name} | true || state{(at + 5) % many} |\n| wait{at} | {name} | false || |\n"
        for at, name in enumerate(names)
    ]
    (folder / "t.rcs").write_text(
        f"enum place {{ {', '.join(names)} }}\ninput go : bool\nstate now : place = state0\n"
        f"table t {{\n| line | now | go || now |\n|-|-|-||-|\n{''.join(rows)}}}\n"
    )
    return Opening(folder / "system.toml", alone=True)


@pytest.fixture
def seat(tmp_path: Path) -> Iterator[Seat]:
    """The graph of a table that is larger than any screen."""
    with seated(machine(tmp_path, 24)) as one:
        one.press("3")
        one.wait("document.querySelector('.graph-place [data-state=state11]')")
        yield one


def seen(seat: Seat) -> bool:
    """Whether what was found stands in the view."""
    return bool(
        seat.value(
            f"(() => {{ const one = {FOUND}.getBoundingClientRect(), view = {PLACE}.getBoundingClientRect();"
            " return one.left >= view.left && one.right <= view.right && one.top >= view.top && one.bottom <= view.bottom; })()"
        )
    )


def test_a_state_or_a_line_is_found_marked_and_shown(seat: Seat) -> None:
    seat.click(FIND)
    seat.write("state1")
    seat.until(".graph-whole", "1 of ")
    assert seat.value(f"{FOUND}.dataset.state").startswith("state1")
    assert seen(seat)
    first = seat.value(f"{FOUND}.dataset.focus")
    seat.press("enter")
    seat.until(".graph-whole", "2 of ")
    assert seat.value(f"{FOUND}.dataset.focus") != first
    assert seen(seat)
    seat.press("shift+enter")
    seat.until(".graph-whole", "1 of ")
    assert seat.value(f"{FOUND}.dataset.focus") == first
    seat.press("escape")
    seat.wait(f"!{FOUND}")
    seat.press("/")
    seat.write("go17")
    seat.until(".graph-whole", "1 of ")
    assert seat.value(f"{FOUND}.dataset.line") == "go17"
    assert seen(seat)
    seat.write("nowhere")
    seat.until(".graph-whole", "no state or line of this graph has go17nowhere")


def test_the_small_picture_leads_to_any_place_of_the_whole(seat: Seat) -> None:
    seat.wait(f"{MAP}.checkVisibility()")
    left, top, width, height = seat.value(
        f"(({{ left, top, width, height }}) => [left, top, width, height])({MAP}.getBoundingClientRect())"
    )
    seat.mouse("mouseMoved", left + 3, top + 3, 0)
    seat.mouse("mousePressed", left + 3, top + 3)
    seat.wait(f"JSON.stringify({SCROLLED}) === '[0,0]'")
    seat.mouse("mouseMoved", left + width - 3, top + height - 3)
    seat.wait(f"{PLACE}.scrollTop > {PLACE}.scrollHeight / 2 - {PLACE}.clientHeight")
    seat.mouse("mouseReleased", left + width - 3, top + height - 3)
    drawn = f"{MAP}.toDataURL()"
    before = seat.settled(drawn)
    seat.value(f"{PLACE}.scrollTo(0, 0)")
    seat.wait(f"{drawn} !== '{before}'")  # the view is drawn where it is
    seat.click(seat.button("Fit"))
    seat.wait(f"!{MAP}.checkVisibility()")


def test_a_graph_that_is_seen_whole_needs_no_small_picture(tmp_path: Path) -> None:
    with seated(machine(tmp_path, 6)) as seat:
        seat.press("3")
        seat.wait("document.querySelector('.graph-place [data-state=state5]')")
        seat.click(seat.button("Fit"))
        seat.wait(f"!{MAP}.checkVisibility()")


STATE = "document.querySelector('.graph-place [data-state=state0] > rect')"
AT = f"(({{ x, y }}) => [x, y].map((one) => Math.round(one.baseVal.value)))({STATE})"
TOUCHES = """(() => {
  const box = document.querySelector('.graph-place [data-state=state0] > rect').getBBox();
  const near = (one, low, far) => one >= low - 2 && one <= low + far + 2;
  const ends = [...document.querySelectorAll('.graph-place .arrow')].flatMap((arrow) => {
    const tip = arrow.querySelector('.tip').getAttribute('d').match(/L ([\\d.-]+) ([\\d.-]+) Z/);
    return [arrow.querySelector('.line').getPointAtLength(0), { x: Number(tip[1]), y: Number(tip[2]) }];
  });
  return ends.filter(({ x, y }) => near(x, box.x, box.width) && near(y, box.y, box.height)).length;
})()"""
"""Arrows' ends at the border of the state."""


def test_a_state_is_moved_with_its_arrows_and_stays_there(seat: Seat) -> None:
    """By mouse and by keys, also when the page is loaded anew; and is put back."""
    before, ends = seat.value(AT), seat.value(TOUCHES)
    assert ends >= 3, "the beginning's arrow, one that comes and one that goes"
    assert not seat.value(
        "[...document.querySelectorAll('.view-graph button')].some((one) => one.checkVisibility() && one.innerText === 'Put back')"
    )
    x, y = seat.value(f"((one) => [one.x + one.width / 2, one.y + 6])({STATE}.getBoundingClientRect())")
    scale = seat.value(f"{STATE}.getBoundingClientRect().width / {STATE}.getBBox().width")
    seat.mouse("mousePressed", x, y, held="shift")
    for at in (20, 45, 70):
        seat.mouse("mouseMoved", x + at * scale, y + at * scale, held="shift")
    seat.mouse("mouseReleased", x + 70 * scale, y + 70 * scale, held="shift")
    moved = seat.value(AT)
    assert all(abs(now - was - 70) <= 2 for now, was in zip(moved, before, strict=True)), (before, moved)
    assert seat.value(TOUCHES) == ends, "its arrows came with it"
    seat.value(f"{STATE}.parentNode.focus()")
    seat.press("shift+right", "shift+right", "shift+up")
    by_keys = seat.value(AT)
    assert [now - was for now, was in zip(by_keys, moved, strict=True)] == [24, -12]
    seat.reload()
    seat.wait("document.documentElement?.dataset.ready === 'yes'")
    seat.press("3")
    seat.wait(f"{STATE} && {AT}.join() === '{by_keys[0]},{by_keys[1]}'")
    assert seat.value(TOUCHES) == ends
    seat.click(seat.button("Put back"))
    assert seat.value(AT) == before
    assert not seat.said


def test_no_line_is_drawn_by_who_moves_a_state_onto_another(seat: Seat) -> None:
    other = "document.querySelector('.graph-place [data-state=state5] > rect')"
    lines = seat.value("document.querySelectorAll('.graph-place .row[data-line]').length")
    (x, y), (a, b) = (
        seat.value(f"((one) => [one.x + one.width / 2, one.y + 6])({one}.getBoundingClientRect())")
        for one in (STATE, other)
    )
    seat.mouse("mousePressed", x, y, held="shift")
    seat.mouse("mouseMoved", a, b, held="shift")
    seat.mouse("mouseReleased", a, b, held="shift")
    assert seat.settled("document.querySelectorAll('.graph-place .row[data-line]').length") == lines
