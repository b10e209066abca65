"""Files written whole or not at all."""

import csv
import gzip
import io
import os
import re
import secrets
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

UNPROVED = "NOT PROVED: made by force to run a finding; no cell runs it"
"""What every file says that is emitted of a program that is not proved."""


def write_atomically(path: Path, content: bytes, mode: int = 0o666, *, durable: bool = True) -> None:
    """Write a file so that a reader, or a kill at any time, sees all of it or the one before.

    Args:
        path: The place; a symbolic link is followed.
        content: All of it.
        mode: Permissions of a new file, before the user's mask; a file that is there keeps its own.
        durable: Whether it reaches the disk before it replaces what was there.

    Raises:
        OSError: It could not be written; nothing is left behind, and what was there before is kept.
    """
    with written_whole(path, mode, durable=durable) as beside:
        beside.write_bytes(content)


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Return rows as CSV in which no text is a formula: what begins as one has an apostrophe before it, as spreadsheets show it."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue()


_FORMULA = re.compile(r"\s*[=+\-@\uff1d\uff0b\uff0d\uff20]|[\t\r\n]")
"""How a text begins that a spreadsheet would reckon; the last four are the same signs, full width."""


def _cell(value: object) -> object:
    if not isinstance(value, str):
        return value
    plain = value.replace("\r\n", "\n").replace("\r", "\n")  # an end of line that is quoted everywhere
    return f"'{plain}" if _FORMULA.match(value) else plain


@contextmanager
def written_whole(path: Path, mode: int = 0o666, *, durable: bool = True) -> Iterator[Path]:
    """Give the place of an empty file beside `path`; it takes the name of `path` when the block ends well.

    A device or a pipe is not replaced: its own place is given.

    Args:
        path: The place; a symbolic link is followed.
        mode: Permissions of a new file, before the user's mask; a file that is there keeps its own.
        durable: Whether it reaches the disk before it replaces what was there.

    Raises:
        OSError: It could not be written; nothing is left behind, and what was there before is kept.
    """
    target = path.resolve()
    if target.exists() and not target.is_file():
        yield target
        return
    beside = target.with_name(
        f".{target.name[:100]}.{os.getpid()}.{secrets.token_hex(4)}{target.suffix[:20]}"
    )
    try:
        os.close(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
        yield beside
        if target.exists():
            beside.chmod(target.stat().st_mode)
        if durable:
            _to_disk(beside)
        beside.replace(target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def _to_disk(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def compressed(content: bytes) -> bytes:
    """Return bytes as gzip writes them, without a time: the same for the same. Nothing here reads such."""
    return gzip.compress(content, mtime=0)
