"""A file that is open in the studio: its text, what can be undone, and what is on disk.

In: changes. Out: the text, whose lines end with a line feed here, whatever they end with on disk. What others write into the file
meanwhile is never overwritten unseen.
"""

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.files.read import MIB, Malformed, content
from rcsc.base.host.files.write import write_atomically
from rcsc.desk.editor.places import Edit, Lines
from rcsc.lang.written.changes import formatted

MOST_BYTES = 2 * MIB
"""Of a file that is opened."""
MOST_STEPS = 1_000
"""Steps that can be undone."""
MOST_KEPT = 8 * MOST_BYTES
"""Characters of steps that can be undone; the last one is always kept."""
TYPING_S = 1.5
"""Letters that are typed within so long of each other are undone together."""
BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True, slots=True)
class Step:
    """A change: the old text at an offset, and the new one."""

    start: int
    old: str
    new: str
    what: str

    def done(self, text: str) -> str:
        """Return the text with the change."""
        return text[: self.start] + self.new + text[self.start + len(self.old) :]

    def undone(self, text: str) -> str:
        """Return the text without the change."""
        return text[: self.start] + self.old + text[self.start + len(self.new) :]


def step(before: str, after: str, what: str) -> Step:
    """Return the change from one text to another: the smallest piece that differs.

    >>> step("one two three", "one 2 three", "type")
    Step(start=4, old='two', new='2', what='type')
    """
    start = _alike(before, after)
    most = min(len(before), len(after)) - start
    end = _alike(before[::-1][:most], after[::-1][:most])
    return Step(start, before[start : len(before) - end], after[start : len(after) - end], what)


def _alike(one: str, other: str) -> int:
    """Count the characters that two texts have in common at their beginning; by bisection, for texts are long and alike.

    >>> _alike("state_2", "state_3"), _alike("", "a")
    (6, 0)
    """
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if one[:middle] == other[:middle] else (low, middle - 1)
    return low


@dataclass(slots=True)
class Document:
    """An open file.

    Attributes:
        file: The absolute path.
        version: Counts every change.
        disk: What is on disk as far as is known here.
        saved: The text that this is.
    """

    file: str
    text: str
    disk: bytes
    saved: str
    end: str = "\n"
    version: int = 1
    _done: list[Step] = field(default_factory=list)
    _undone: list[Step] = field(default_factory=list)
    _typed_s: float = 0.0

    @classmethod
    def opened(cls, file: str) -> "Document":
        """Read a file.

        Raises:
            Refused: It cannot be read, or is no text.
        """
        disk = _read(file)
        text, end = _text(file, disk)
        return cls(file, text, disk, text, end)

    @property
    def dirty(self) -> bool:
        """True if the text differs from the one on disk."""
        return self.text != self.saved

    @property
    def undoes(self) -> str:
        """The name of the change that would be undone next; empty for none."""
        return self._done[-1].what if self._done else ""

    @property
    def redoes(self) -> str:
        """The name of the change that would be done again next; empty for none."""
        return self._undone[-1].what if self._undone else ""

    # --- changes ---

    def replace(self, text: str, what: str) -> bool:
        """Replace the text; return whether it changed."""
        if text == self.text:
            return False
        made, now = step(self.text, text, what), time.monotonic()
        last = self._done[-1] if self._done else None
        if last is not None and now - self._typed_s < TYPING_S and _joins(last, made):
            self._done[-1] = Step(last.start, last.old, last.new + made.new, what)
        else:
            self._done.append(made)
            del self._done[: _too_many(self._done)]
        self._typed_s = now if _typed(made) else 0.0
        self._undone.clear()
        self._set(text)
        return True

    def edited(self, edits: Sequence[Edit]) -> str:
        """Return the text with edits, whose areas are those of the present text.

        Raises:
            Refused: They overlap.
        """
        ordered = sorted(edits, key=lambda each: (each.area.start, each.area.end))
        if any(one.area.end > other.area.start for one, other in pairwise(ordered)):
            raise Refused(Code.STUDIO, "edits that are made together do not overlap")
        return plain(Lines(self.text).applied(edits))

    def undo(self) -> str:
        """Take back the last change; return its name.

        Raises:
            Refused: There is no change to take back.
        """
        if not self._done:
            raise Refused(Code.STUDIO, "nothing is left to undo")
        last = self._done.pop()
        self._undone.append(last)
        self._set(last.undone(self.text))
        return last.what

    def redo(self) -> str:
        """Make the change again that was taken back last; return its name.

        Raises:
            Refused: There is no change to make again.
        """
        if not self._undone:
            raise Refused(Code.STUDIO, "nothing was undone")
        last = self._undone.pop()
        self._done.append(last)
        self._set(last.done(self.text))
        return last.what

    def _set(self, text: str) -> None:
        self.text = text
        self.version += 1

    # --- the disk ---

    def _raw(self, text: str) -> bytes:
        return (BOM if self.disk.startswith(BOM) else b"") + text.replace("\n", self.end).encode()

    def bytes_of(self, text: str) -> int:
        """Return the size of the file with a text, in bytes.

        Raises:
            Refused: No file can hold it.
        """
        try:
            return len(self._raw(text))
        except UnicodeEncodeError as error:
            raise Refused(Code.STUDIO, "the text has half a character, which no file can hold") from error

    def on_disk(self) -> str:
        """Compare the file on disk: `same` as known here, `changed` by others, or `gone`."""
        try:
            return "same" if _read(self.file) == self.disk else "changed"
        except Refused:
            return "gone"

    def save(self, *, over: bool = False) -> bool:
        """Write the file, laid out as by `rcsc fmt`; return whether it was laid out, which a text that does not parse is not.

        Args:
            over: Whether what others wrote meanwhile may be lost.

        Raises:
            Refused: Others changed the file meanwhile, or it cannot be written.
        """
        if os.path.realpath(self.file) != self.file:  # it was none when it was opened, and may lead anywhere
            raise Refused(Code.STUDIO, f"{os.path.basename(self.file)} is a link now: nothing was written")
        disk = self.on_disk()
        if disk != "same" and not over:
            how = "was changed on disk since it was read" if disk == "changed" else "is no longer on disk"
            raise Refused(
                Code.STUDIO,
                f"{os.path.basename(self.file)} {how}: nothing was written",
                "take what is on disk (it can be undone), or write over it",
            )
        laid_out = formatted(Source(self.file, self.text), "\n")
        if laid_out is not None:
            self.replace(laid_out, "lay out")
        raw = self._raw(self.text)
        try:
            write_atomically(Path(self.file), raw)
        except OSError as error:
            raise Refused(
                Code.STUDIO, f"cannot write {os.path.basename(self.file)}: {error.strerror}"
            ) from error
        self.disk, self.saved = raw, self.text
        return laid_out is not None

    def keep(self, folder: Path) -> Path:
        """Write the text as it is into another folder; return its path there.

        Raises:
            OSError: It cannot be written.
        """
        path = folder / os.path.basename(self.file)
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(path, self._raw(self.text))
        return path

    def take_disk(self) -> bool:
        """Replace the text by that on disk, which can be undone; return whether it changed.

        Raises:
            Refused: It cannot be read.
        """
        self.disk = _read(self.file)
        self.saved, self.end = _text(self.file, self.disk)
        return self.replace(self.saved, "take what is on disk")


def plain(text: str) -> str:
    """Return a text with line feeds as its line ends."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _too_many(steps: Sequence[Step]) -> int:
    """Count the first steps that are to be forgotten."""
    kept, left = 0, MOST_KEPT
    for each in reversed(steps[-MOST_STEPS:]):
        left -= len(each.old) + len(each.new)
        if left < 0 and kept:
            break
        kept += 1
    return len(steps) - kept


def _typed(made: Step) -> bool:
    return not made.old and len(made.new) == 1 and made.new not in "\n|"


def _joins(last: Step, made: Step) -> bool:
    """Tell whether a letter was typed right after the last one."""
    return (
        _typed(made) and not last.old and made.start == last.start + len(last.new) and last.what == made.what
    )


def _read(file: str) -> bytes:
    if os.path.realpath(file) != file:
        raise Refused(Code.STUDIO, f"{os.path.basename(file)} is a link now, to another file")
    try:
        return content(Path(file), MOST_BYTES)
    except OSError as error:
        raise Refused(Code.STUDIO, f"cannot read {os.path.basename(file)}: {error.strerror}") from error
    except Malformed as error:
        raise Refused(Code.STUDIO, f"{os.path.basename(file)} {error}") from error


def _text(file: str, raw: bytes) -> tuple[str, str]:
    """Decode a file; return the text and its line end."""
    try:
        text = raw.removeprefix(BOM).decode()
    except UnicodeDecodeError as error:
        raise Refused(Code.STUDIO, f"{os.path.basename(file)} is no UTF-8 text") from error
    return plain(text), "\r\n" if "\r\n" in text else "\n"
