"""Files as they were in a revision, laid out apart; the checkout is not touched.

In: a revision of the repository that one stands in. Out: a folder with its tables and project files, under their own names.
Git is asked through its command line.
"""

import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from rcsc.base.host import children

_REGULAR, _LINK = ("100644", "100755"), "120000"


class NotComparedError(Exception):
    """A version cannot be had: why, and what would help."""

    def __init__(self, message: str, *helps: str) -> None:
        super().__init__(message)
        self.helps = helps


@dataclass(frozen=True, slots=True)
class Entry:
    """A file of a revision."""

    mode: str
    blob: str
    path: str


def lay_out(revision: str, folder: Path) -> str:
    """Write the revision's tables and project files below `folder`; return the working folder's path in the repository.

    Raises:
        NotComparedError: There is no git, no repository, or no such revision.
    """
    if revision.startswith("-"):
        raise NotComparedError(f"`{revision}` is no revision")
    here = _git("rev-parse", "--show-prefix").decode().strip()
    try:
        tree = (
            _git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{tree}}")
            .decode()
            .strip()
        )
    except NotComparedError as error:
        raise NotComparedError(
            f"there is no revision `{revision}` in this repository", "`git log --oneline` lists them"
        ) from error
    entries = [entry for entry in _entries(tree) if _is_wanted(entry.path)]
    for entry, content in zip(entries, _contents(entries), strict=True):
        target = folder / entry.path
        target.parent.mkdir(parents=True, exist_ok=True)
        if entry.mode == _LINK:
            _link(target, content.decode(errors="replace"), folder)
        else:
            target.write_bytes(content)
    return here


def _is_wanted(path: str) -> bool:
    plain = PurePosixPath(path)
    inside = not plain.is_absolute() and ".." not in plain.parts
    return inside and plain.suffix in {".rcs", ".toml"}  # projects and systems are TOML


def _link(target: Path, to: str, folder: Path) -> None:
    """Make a link, unless it leads out of the revision."""
    end = os.path.normpath(os.path.join(target.parent, to))
    if not os.path.isabs(to) and os.path.commonpath([end, folder]) == str(folder):
        target.symlink_to(to)


def _entries(tree: str) -> Iterator[Entry]:
    """Yield every file of the tree."""
    for line in _git("ls-tree", "-r", "-z", "--full-tree", tree).split(b"\0"):
        about, _, path = line.partition(b"\t")
        if path:
            mode, _, blob = about.decode().split()
            if mode in (*_REGULAR, _LINK):
                yield Entry(mode, blob, os.fsdecode(path))


def _contents(entries: Sequence[Entry]) -> Iterator[bytes]:
    """Yield the content of each, all asked at once."""
    if not entries:
        return
    given = _git("cat-file", "--batch", stdin="".join(f"{entry.blob}\n" for entry in entries).encode())
    at = 0
    for _ in entries:
        end = given.index(b"\n", at)
        size = int(given[at:end].split()[2])
        yield given[end + 1 : end + 1 + size]
        at = end + 1 + size + 1


def _git(*args: str, stdin: bytes = b"") -> bytes:
    """Return the output of git."""
    program = shutil.which("git")
    if program is None:
        raise NotComparedError("git is not installed", "give two files or folders instead of revisions")
    ran = children.run([program, *args], stdin=stdin)
    if ran.status != 0:
        why = ran.err.strip().splitlines()
        raise NotComparedError(why[0].removeprefix("fatal: ") if why else f"git {args[0]} failed")
    return ran.raw
