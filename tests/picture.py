"""The README's pictures: `python -m tests.picture` makes them, as SVG, from what the commands print and draw.

With `loop` it makes the film of the cell, with `studio` the studio's picture.

The studio's is what Chromium shows of it at 1280 x 800, as PNG: the paper's cell in space beside the table that runs.
"""

import contextlib
import io
import re
import sys
import tempfile
from functools import cache
from pathlib import Path

from click.testing import CliRunner
from rich.console import Console
from rich.terminal_theme import MONOKAI
from rich.text import Text

from rcsc.desk.shell.opening import Opening
from rcsc.front.commands import run
from rcsc.front.commands.group import commands
from tests.studio.driven import seated

REPO = Path(__file__).parents[1]
PICTURES = REPO / "tests" / "pictures"
CHECK = ("check", "--color", "always", "--no-cache", "tables/examples/grip.rcs")
RUN = ("run", "make_boxt", "--report", "boxt.html")
WIDTH = 132
FRAMES = (1, 23, 40)
"""Which pictures of the report's filmstrip are shown."""
CYCLES = 420
"""After which the studio is shown."""
FRAME_PX, CAPTION_PX = (360, 260), 26


@cache
def printed(command: tuple[str, ...], report: str = "boxt.html") -> tuple[str, str]:
    """What the command prints, without what differs from run to run, and the page that it writes, if it writes one."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(REPO):
        page = Path(folder, report)
        said = CliRunner().invoke(
            commands, [str(page) if word == report else word for word in command], color=True
        )
        text = said.output.replace(str(page), report)
        drawn = page.read_text(encoding="utf-8") if page.exists() else ""
    varying = r", [\d.]+ m?s\b(?! of)| in [\d.]+ s: \d+ times as fast as the clock| in [\d.]+ s(?=;)"
    return re.sub(varying, "", text), drawn


def masked(text: str) -> str:
    """The text without what hangs on the machine: physics gives the same bits only for one version on one architecture."""
    text = text.replace("&#160;", " ")
    text = re.sub(r"[\d.]+ (cycles|mm|s of|times|assumptions)", r"# \1", text)
    text = re.sub(r"kept [\d, ]+ degrees", "kept # degrees", text)
    return re.sub(r'textLength="[\d.]+"', "", text)


def finding() -> str:
    """What `rcsc check` says of a table with a gap."""
    console = Console(record=True, width=WIDTH, file=io.StringIO(), force_terminal=True, no_color=False)
    shown = " ".join(word for word in CHECK if word not in ("--color", "always", "--no-cache"))
    console.print(Text(f"$ rcsc {shown}", style="bold"))
    console.print(Text.from_ansi(printed(CHECK)[0]), no_wrap=True, crop=True)
    svg = console.export_svg(title="rcsc", theme=MONOKAI, unique_id="rcsc")
    svg = svg.replace(
        "<svg ", '<svg xml:space="preserve" ', 1
    )  # not every viewer keeps leading spaces without it
    return re.sub(r"@font-face \{.*?\}\s*", "", svg, flags=re.DOTALL)  # nothing is fetched to show it


def robot() -> str:
    """Three moments of the run, as its report draws them."""
    film = re.findall(
        r"<figure.*?(<svg.*?</svg>)\s*</a>\s*<figcaption>(.*?)</figcaption>", printed(RUN)[1], re.DOTALL
    )
    width, height = FRAME_PX
    parts = []
    for place, number in enumerate(FRAMES):
        svg, caption = film[number]
        caption = re.sub(r"<button[^>]*>(.*?)</button>", r"\1 ·", caption)  # of the page alone
        left = place * (width + 10)
        parts += [
            re.sub(
                r'width="\d+" height="\d+"', f'x="{left}" width="{width}" height="{height}"', svg, count=1
            ),
            f'<text x="{left}" y="{height + 18}" font-family="sans-serif" font-size="11" fill="#667">{caption}</text>',
        ]
    size = f"{len(FRAMES) * (width + 10) - 10} {height + CAPTION_PX}"
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}">', *parts, "</svg>", ""])


PICTURE_OF = {"first_minute.svg": finding, "make_boxt.svg": robot}


def studio(path: Path) -> None:
    """Write a picture of the studio: the cell after so many cycles of MAKE BOXT, and the table of its task with the line that ran."""
    opening = Opening(REPO / "tables" / "system.toml", plant="kinematic", script="make_boxt")
    with seated(opening, in_space=True) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("c")
        seat.write(f"run {CYCLES}")
        seat.press("enter", "escape")
        seat.until("#state", f"paused at cycle {CYCLES}")
        seat.click("#views button[data-view=cell]")
        now = seat.value("document.querySelector('#time [role=slider]').getAttribute('aria-valuetext')")
        seat.choose(".table-choice", f"{re.findall(r'; task (.+) .+?,', now)[0].partition(' ')[0]} (task/")
        seat.wait(
            f"document.querySelector('.sheet tr.now') && document.querySelector('.view-cell')?.dataset.tick === '{CYCLES}'"
            " && Number(document.querySelector('.view-cell')?.dataset.frames) > 1"
        )
        seat.value("document.querySelector('.sheet tr.now').scrollIntoView({ block: 'nearest' })")
        seat.settled("0")
        seat.screenshot(path)


def main() -> None:
    PICTURES.mkdir(exist_ok=True)
    if sys.argv[1:] == ["studio"]:
        studio(PICTURES / "studio.png")
        return
    if sys.argv[1:] == ["loop"]:
        film = ["--video", str(PICTURES / "loop.webp"), "--video-speed", "8.5"]
        run(["run", "make_boxt", "--system", str(REPO / "tables" / "system.toml"), "-q", *film])
        return
    for name, draw in PICTURE_OF.items():
        (PICTURES / name).write_text(draw(), encoding="utf-8")


if __name__ == "__main__":
    main()
