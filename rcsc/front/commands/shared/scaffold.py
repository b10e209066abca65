"""Projects as they begin: of a template, of the paper's system, or of somebody's published tables.

A template is a folder of files in `templates`: `dot_NAME` becomes `.NAME`, and `ROBOT_NAME` in a text the project's name.
"""

import os
import re
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files import write_atomically

NAME = "ROBOT_NAME"
NBS = "nbs"
"""The paper's system, which is no template: one reads and runs it."""
TEMPLATES = {
    "level": "One level: a table of seven lines, to check, prove and compile.",
    "system": "Two levels with a plant of Python and a script; tests, hooks and CI.",
    "mujoco": "A rover that docks at its charger by contact, in MuJoCo.",
    NBS: "The paper's system, the robot of 1984, with its cell: to read and run.",
}
"""What a project may begin with, in a sentence each."""
CACHES = {".rcsc-cache", "__pycache__", "generated"}
BEGUN = re.compile(r"\..+|(README|LICEN[CS]E|COPYING)(\..+)?", re.IGNORECASE)
"""What a repository may have before there is a project in it; what a template has, too, stays as it is."""
GUIDE = ".md"
"""The guides beside the paper's tables speak of the repository."""
GALLERY = "gallery"
"""Other people's tables, which are no part of the paper's system."""
_SETTINGS = b"""# Tables that somebody published, as they were printed: what is found in them is told apart.
published = ["*published.rcs"]
starts_at_zero = true
"""


def _shipped_tables() -> Traversable:
    """Return the folder of the tables that come with rcsc."""
    packaged = files("rcsc") / "_data" / "tables"
    beside: Traversable = Path(__file__).parents[4] / "tables"
    return packaged if packaged.is_dir() else beside


def gallery() -> dict[str, Traversable]:
    """Return the folders of the gallery's entries by their names, sorted."""
    entries = (entry for entry in (_shipped_tables() / GALLERY).iterdir() if entry.is_dir())
    return {entry.name: entry for entry in sorted(entries, key=lambda entry: entry.name)}


def make(folder: Path, kind: str) -> tuple[list[str], list[str]] | Diagnostic:
    """Make a project in a folder; return the files written and those that were there, or the reason why there are none.

    Args:
        folder: New, or empty but for what a fresh repository has.
        kind: Of `TEMPLATES`, or an entry of the gallery.
    """
    name = re.sub(r"\W", "_", folder.resolve().name, flags=re.ASCII) or "robot"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        others = sorted(entry.name for entry in folder.iterdir() if not BEGUN.fullmatch(entry.name))
        if others:
            return _refused(folder, f"the folder is not empty, it has `{others[0]}`")
        written: list[str] = []
        kept: list[str] = []
        for file, content in _files(kind):
            path = folder / file
            if os.path.lexists(path):
                kept.append(file)
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, content.replace(NAME.encode(), name.encode()))
            written.append(file)
    except OSError as error:
        return _refused(folder, error.strerror or type(error).__name__)
    return written, kept


def _files(kind: str) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a project by their paths in it, in order."""
    tables = _shipped_tables()
    if kind not in TEMPLATES:
        yield "rcsc.toml", _SETTINGS
        here = re.compile(
            rb"(tables/)?%b/%b/" % (GALLERY.encode(), kind.encode())
        )  # as they are named from the repository
        for file, content in _below(tables / GALLERY / kind):
            yield file, here.sub(b"", content)
        return
    yield from _below(files("rcsc") / "front" / "commands" / "templates" / kind)
    if kind == NBS:
        for file, content in _below(tables):
            if not file.endswith(GUIDE) and not file.startswith(f"{GALLERY}/"):
                yield f"tables/{file}", content


def _below(folder: Traversable) -> Iterator[tuple[str, bytes]]:
    for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
        name = re.sub("^dot_", ".", entry.name)
        if entry.name in CACHES:
            continue
        if entry.is_dir():
            yield from ((f"{name}/{inner}", content) for inner, content in _below(entry))
        else:
            yield name, entry.read_bytes()


def _refused(folder: Path, why: str) -> Diagnostic:
    message = f"cannot make a project in `{folder}`: {why}"
    return Diagnostic(Code.NOT_WRITTEN, message, Label(Span(str(folder), 0, 0)))
