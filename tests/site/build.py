"""What the site is made of: the Markdown that is in git, where it stands; links to what is no page lead to a copy of it."""

import logging
import re
import shutil
import subprocess
from functools import partial
from pathlib import Path

from mkdocs.commands.build import build
from mkdocs.config import load_config
from mkdocs.exceptions import Abort

REPO = Path(__file__).parents[2]
CONFIG = Path(__file__).with_name("mkdocs.yml")
LEFT_OUT = (".github/", "tests/data/", "tests/golden/", "rcsc/front/")
"""Folders whose Markdown is no page: templates, kept outputs."""

LINK = re.compile(r"(?<!!)\[(?P<text>[^\]\n]*)\]\((?P<to>[^)\s#]+)(?P<anchor>#[^)\s]*)?\)")
PICTURE = re.compile(r"!\[[^\]]*\]\((?P<to>[^)\s]+)\)")
SHOWN = {".png", ".svg", ".webp", ".gif"}


def pages() -> tuple[str, ...]:
    """Return the paths of all pages, seen from the repository."""
    found = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        cwd=REPO, capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    return tuple(page for page in found if not page.startswith(LEFT_OUT) and (REPO / page).exists())


def staged(docs: Path, extra: dict[str, str] | None = None) -> None:
    """Lay out the pages in a folder, and beside them what they lead to and show.

    Args:
        docs: The folder.
        extra: Further pages, or other texts of some, by path.
    """
    texts = {page: (REPO / page).read_text(encoding="utf-8") for page in pages()} | (extra or {})
    for page, text in texts.items():
        target = docs / page
        target.parent.mkdir(parents=True, exist_ok=True)
        for picture in PICTURE.finditer(text):
            _copied(docs, (REPO / page).parent / picture["to"])
        led = partial(_led, docs, page, texts)
        target.write_text(LINK.sub(led, text), encoding="utf-8")


def _led(docs: Path, page: str, texts: dict[str, str], link: re.Match[str]) -> str:
    """A link of a page, as the site has it: to a page, to a copy of a file, or none to a folder without a page."""
    if "://" in link["to"]:
        return link[0]
    there = ((REPO / page).parent / link["to"]).resolve()
    if there.is_dir():
        inside = f"{there.relative_to(REPO)}/README.md"
        return (
            f"[{link['text']}]({link['to'].rstrip('/')}/README.md)"
            if inside in texts
            else f"`{link['text']}`"
        )
    if there.suffix == ".md" or not there.is_file():
        return link[0]  # one that leads nowhere is MkDocs's to tell
    _copied(docs, there)
    return f"[{link['text']}]({link['to']}{_suffix(there)})"


def _suffix(file: Path) -> str:
    """What a file's name gets so that a browser shows it, and does not save it."""
    return "" if file.suffix in SHOWN else ".txt"


def _copied(docs: Path, file: Path) -> None:
    file = file.resolve()
    target = docs / f"{file.relative_to(REPO)}{_suffix(file)}"
    target.parent.mkdir(parents=True, exist_ok=True)
    if file.is_file():
        shutil.copyfile(file, target)


class Told(logging.Handler):
    """Keeps what MkDocs warns of."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.faults: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.faults.append(record.getMessage())


def site(docs: Path, out: Path) -> list[str]:
    """Build the site of a staged folder.

    Args:
        docs: The folder, as `staged` lays it out.
        out: Where the site goes.

    Returns:
        What is wrong: links and anchors that lead nowhere, pages that the navigation names and that are not there.
    """
    told = Told()
    logger = logging.getLogger("mkdocs")
    logger.addHandler(told)
    try:
        config = load_config(config_file=str(CONFIG), docs_dir=str(docs), site_dir=str(out))
        build(config)
    except Abort as abort:
        told.faults.append(str(abort))
    finally:
        logger.removeHandler(told)
    return told.faults
