"""The report of a run, and of a log, in a real browser: the studio's time line, levels and curves, of the file alone."""

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.desk.studio.share.document import bundled, player
from rcsc.front.commands import run as rcsc
from rcsc.run.log.read import Log, read
from rcsc.views.pages.frame import hashed
from tests.page.test_looks import LOOK
from tests.studio.driven import HIGH, WIDE, Seat, dock

pytestmark = pytest.mark.needs("chromium")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Log]:
    """The report of a run, that of its log, and the log."""
    folder = tmp_path_factory.mktemp("reported")
    system, log = dock(folder / "dock"), folder / "run.mcap"
    assert (
        rcsc(["run", str(system), "--log", str(log), "--report", str(folder / "run.html")]) == 0
    )  # fmt: skip
    assert rcsc(["log", str(log), "--report", str(folder / "log.html"), "--system", str(system)]) == 0
    return folder / "run.html", folder / "log.html", read(log)


@pytest.fixture(scope="module")
def seat() -> Iterator[Seat]:
    with Seat(WIDE, HIGH) as one:
        yield one


def opened(seat: Seat, page: Path, *, dark: bool = False) -> None:
    seat.open(page.as_uri(), dark=dark)
    seat.wait("document.querySelector('#moment').dataset.tick")
    seat.wait("document.querySelectorAll('#curves canvas').length === 3")


@pytest.mark.parametrize("which", [0, 1])
def test_every_tick_is_as_the_log_has_it(which: int, made: tuple[Path, Path, Log], seat: Seat) -> None:
    run, logged, log = made
    opened(seat, logged if which else run)
    # until the line is drawn, what is pressed on it is not where the run's tick will be
    seat.wait(f"document.querySelector('#time [role=slider]').ariaValueMax === '{log.last}'")
    for tick in random.Random(which).sample(range(2, log.last), 8):  # noqa: S311  # the same each time
        seat.click_time(tick / log.last)
        # what was shown before stays until the page has drawn what is pointed at
        seat.wait(
            f"Math.abs(document.querySelector('#time [role=slider]').ariaValueNow - {tick}) <= 1"
            " && document.querySelector('#moment').dataset.tick === document.querySelector('#time [role=slider]').ariaValueNow"
        )
        now = seat.tick()
        for level in log.levels:
            values = level.track.latest(now)
            assert values is not None
            table, line = level.sign.table_of(level.level, values), level.sign.line_of(level.level, values)
            said = seat.reads(f"#moment [aria-label='Level {level.name}']")
            assert f"table {table}, line {line}\n" in said
            assert f"▶ {line}\n" in f"{said}\n"
        speed = log.level("drive").sign.index["speed_mm_s"]
        held = log.level("drive").track.latest(now)
        assert held is not None
        seat.until("#curves .legend", f"drive.speed_mm_s = {held[speed]}")
    assert seat.value("performance.getEntriesByType('resource').length") == 0
    assert seat.said == []


FROZEN = "window.held = []; window.drawn = requestAnimationFrame; window.requestAnimationFrame = (one) => held.push(one);"
"""Has nothing drawn until somebody lets it."""


def test_a_press_before_the_first_picture_leads_where_it_is(made: tuple[Path, Path, Log]) -> None:
    """The line is as long as the run as soon as that is known, not only once it is drawn."""
    with Seat(WIDE, HIGH) as one:
        one.begin_with(FROZEN)
        one.open(made[0].as_uri())
        one.wait("document.querySelector('#moment').dataset.tick")
        one.click_time(36 / made[2].last)
        one.value("(window.requestAnimationFrame = window.drawn, held.forEach((draw) => draw()))")
        one.wait("document.querySelector('#time [role=slider]').ariaValueNow")
        assert abs(one.tick() - 36) <= 1


def test_it_is_looked_at_by_keys_alone(made: tuple[Path, Path, Log], seat: Seat) -> None:
    opened(seat, made[0])
    last = made[2].last
    assert seat.tick() == last
    seat.press("[", "[", "]")
    seat.wait(f"document.querySelector('#moment').dataset.tick === '{last - 1}'")
    seat.press("{")
    seat.wait(f"Number(document.querySelector('#moment').dataset.tick) < {last - 1}")
    chosen = seat.tick()
    seat.go_to("▶")
    seat.press("enter")
    seat.until("#moment .bar", "Ran before")
    seat.go_to("Ran before")
    seat.press("enter")
    seat.wait(f"Number(document.querySelector('#moment').dataset.tick) < {chosen}")
    seat.go_to("", kind="SUMMARY")
    seat.press("enter")
    seat.wait("document.querySelector('#moment tbody')?.childElementCount > 5")
    assert seat.said == []


@pytest.mark.parametrize("dark", [False, True])
def test_it_can_be_read_in_both_themes(dark: bool, made: tuple[Path, Path, Log], seat: Seat) -> None:
    opened(seat, made[0], dark=dark)
    found = seat.settled(LOOK)
    assert [
        one for one in found if not one.startswith("sticks out downwards")
    ] == []  # a page is as long as it is


def test_a_curve_that_is_asked_for_is_drawn_and_nothing_is_kept(
    made: tuple[Path, Path, Log], seat: Seat
) -> None:
    opened(seat, made[0])
    seat.click("#curves input")
    seat.type("drive.travelled_mm over drive.lateral_mm")
    seat.wait("document.querySelectorAll('#curves canvas').length === 4")
    seat.type("drive.nothing")
    seat.until("#said", "there is no variable drive.nothing")
    opened(seat, made[0])  # as it was made


def test_its_one_script_is_named_by_its_hash(made: tuple[Path, Path, Log]) -> None:
    for page in made[:2]:
        text = page.read_text(encoding="utf-8").replace("&#39;", "'")
        assert f"script-src '{hashed(player())}'; base-uri 'none'" in text
        assert text.count("<script") == 2


def test_modules_keep_to_themselves_and_give_what_they_name(seat: Seat, tmp_path: Path) -> None:
    """Two modules may have the same names inside; comments give nothing."""
    a = "/*\nexport const no = 1;\n*/\nconst kept = 1;\nexport const one = kept;\nconst inner = 2;\nexport { inner as two };\n"
    b = 'import { one, two as second } from "../a.js";\nconst kept = 10;\nconst all = () => one + second + kept;\n'
    b += "export { all as default };\n"
    c = 'export { one } from "./a.js";\nimport sum from "./in/b.js";\nimport { one as again } from "./a.js";\n'
    c += "document.title = `${sum()} ${again}`;\n"
    parts = [("a.js", a), ("in/b.js", b), ("c.js", c)]
    page = tmp_path / "page.html"
    page.write_text(f"<!doctype html><title>none</title><script>{bundled(parts)}</script>", encoding="utf-8")
    seat.open(page.as_uri())
    seat.wait("document.title === '13 1'")
    assert seat.said == []
