"""The README's picture: what `rcsc check` says of two examples, as SVG: `python -m tests.picture` writes it."""

import contextlib
import io
import re
from pathlib import Path

from click.testing import CliRunner
from rich.console import Console
from rich.terminal_theme import MONOKAI
from rich.text import Text

from rcsc.commands.group import commands

REPO = Path(__file__).parents[1]
PICTURE = REPO / "tests" / "pictures" / "first_minute.svg"
COMMANDS = (
    ("check", "--color", "always", "--no-cache", "tables/examples/grip.rcs"),
    ("run", "make_boxt"),
)
WIDTH = 132


def said(command: tuple[str, ...]) -> str:
    """What the command prints, without what differs from run to run."""
    out = CliRunner().invoke(commands, list(command), color=True).output
    return re.sub(
        r", [\d.]+ m?s\b(?! of)| in [\d.]+ s: \d+ times as fast as the clock| in [\d.]+ s(?=;)", "", out
    )


def masked(text: str) -> str:
    """The text without what hangs on the machine: physics gives the same bits only for one version on one architecture."""
    text = text.replace("&#160;", " ")
    text = re.sub(r"[\d.]+ (cycles|mm|s of|times|assumptions)", r"# \1", text)
    text = re.sub(r"kept [\d, ]+ degrees", "kept # degrees", text)
    return re.sub(r'textLength="[\d.]+"', "", text)


def drawn() -> str:
    """The picture."""
    console = Console(record=True, width=WIDTH, file=io.StringIO(), force_terminal=True)
    for command in COMMANDS:
        shown = " ".join(word for word in command if word not in ("--color", "always", "--no-cache", "-q"))
        console.print(Text(f"$ rcsc {shown}", style="bold"))
        console.print(Text.from_ansi(said(command)), no_wrap=True, crop=True)
    svg = console.export_svg(title="rcsc", theme=MONOKAI, unique_id="rcsc")
    svg = svg.replace(
        "<svg ", '<svg xml:space="preserve" ', 1
    )  # not every viewer keeps leading spaces without it
    return re.sub(r"@font-face \{.*?\}\s*", "", svg, flags=re.DOTALL)  # nothing is fetched to show it


def main() -> None:
    """Writes the picture."""
    PICTURE.parent.mkdir(exist_ok=True)
    with contextlib.chdir(REPO):
        PICTURE.write_text(drawn(), encoding="utf-8")


if __name__ == "__main__":
    main()
