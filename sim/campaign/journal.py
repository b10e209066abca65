"""The journal of a campaign: JSON lines, a header and then one line an episode, so that a campaign killed at any moment goes on.

In: a file, perhaps of a campaign that was cut off. Out: the records it holds; new ones are added at its end. A last line that was torn
is dropped; anything else that is wrong is refused, and the file is left as it is.
"""

import fcntl
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from rcsc import __version__
from rcsc.files.read import json_of
from sim.campaign.rig import Rig, digest
from sim.episode import Finding

FORM = 1
"""Of the file; another is not read."""

_SHOWN = 16
"""Digits of a digest that are shown."""

_OTHERS = {
    "form": "is of another form",
    "rcsc": "was written by another version of rcsc",
    "seed": "is of another seed",
    "backend": "is of another plant",
    "executor": "is of other executors",
    "digest": "is of other tables, data or programs",
}


class BadJournal(Exception):  # noqa: N818  # what happened, not an error of ours
    """The file is not this campaign's journal; says why. It was not changed."""


@dataclass(frozen=True, slots=True)
class Record:
    """What became of one episode.

    Attributes:
        faults: Its fault classes; empty where it is nominal.
        end: As of an outcome, and `crash`, `hang` and `error:NAME`.
        ticks: Of control.
        lines: Those that ran, as bits; see `sim.campaign.rig.mask`.
        digest: Of every cycle's values.
    """

    index: int
    faults: tuple[str, ...]
    end: str
    ticks: int
    findings: tuple[Finding, ...]
    lines: int
    digest: str


def header(rig: Rig, seed: int) -> dict[str, Any]:
    """The first line: two campaigns with the same have the same episodes and outcomes.

    Raises:
        BadDescription: The system is not in order.
    """
    return {
        "form": FORM,
        "rcsc": __version__,
        "seed": seed,
        "backend": rig.backend,
        "executor": rig.executor,
        "digest": digest(rig.system),
    }


def journal_path(rig: Rig, seed: int, folder: Path) -> Path:
    """Where the journal is kept when nobody says: another one for other tables."""
    return folder / "campaign" / f"{seed}-{rig.backend}-{rig.executor}-{digest(rig.system)[:16]}.jsonl"


class Journal:
    """A journal that is open, and this process's alone.

    Attributes:
        records: What it holds, by the episode's number.
    """

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        """Opens or begins it.

        Raises:
            BadJournal: It is another campaign's, damaged, or being written.
            OSError: It cannot be read or written.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self.records: dict[int, Record] = {}
        self._file = open(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+b")  # noqa: SIM115  # closed by `close`
        try:
            _lock(self._file, path)
            self._take(head)
        except BaseException:
            self._file.close()
            raise

    def _take(self, head: dict[str, Any]) -> None:
        first = _line(head)
        content = self._file.read()
        whole = content[: content.rfind(b"\n") + 1]
        if not whole and not first.startswith(content):
            raise BadJournal(f"{self.path} is no journal")
        if whole:
            begun, *rest = whole.splitlines()
            _compare(self.path, begun, head)
            for number, line in enumerate(rest, 2):
                record = _read(self.path, number, line)
                self.records[record.index] = record
        self._file.truncate(len(whole))
        self._file.seek(len(whole))
        if not whole:
            self._file.write(first)
            self._file.flush()

    def add(self, records: Iterable[Record]) -> None:
        """Writes records; when it returns, a kill of this process loses none of them.

        Raises:
            OSError: They cannot be written.
        """
        new = list(records)
        self.records |= {one.index: one for one in new}
        self._file.write(b"".join(_line(_said(one)) for one in new))
        self._file.flush()

    def close(self) -> None:
        """Lets others have it."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()


def _lock(file: BinaryIO, path: Path) -> None:
    """The kernel lets go when the process ends, however it does."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise BadJournal(f"{path} is being written by another campaign") from error


def _compare(path: Path, line: bytes, head: dict[str, Any]) -> None:
    try:
        found = dict(json_of(line))
    except (ValueError, TypeError) as error:
        raise BadJournal(f"{path} is no journal") from error
    if not found.keys() >= {"form", "seed"}:
        raise BadJournal(f"{path} is no journal")
    for name, why in _OTHERS.items():
        if found.get(name) != head[name]:
            raise BadJournal(f"{path} {why}: {str(found.get(name))[:_SHOWN]}, not {str(head[name])[:_SHOWN]}")


def _line(said: dict[str, Any]) -> bytes:
    return json.dumps(said, separators=(",", ":")).encode() + b"\n"


def _said(one: Record) -> dict[str, Any]:
    return {
        "index": one.index,
        "faults": one.faults,
        "end": one.end,
        "ticks": one.ticks,
        "findings": [[found.property, found.tick, found.said] for found in one.findings],
        "lines": f"{one.lines:x}",
        "digest": one.digest,
    }


def _read(path: Path, number: int, line: bytes) -> Record:
    try:
        said = json_of(line)
        return Record(
            int(said["index"]),
            tuple(map(str, said["faults"])),
            str(said["end"]),
            int(said["ticks"]),
            tuple(Finding(str(name), int(tick), str(why)) for name, tick, why in said["findings"]),
            int(said["lines"], 16),
            str(said["digest"]),
        )
    except (ValueError, KeyError, TypeError) as error:
        raise BadJournal(f"{path}, line {number} is damaged") from error
