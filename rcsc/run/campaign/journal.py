"""The journal of a campaign: JSON lines, a header and then one line an episode, from which a killed campaign goes on.

In: a file, perhaps of a campaign that was cut off. Out: the records it holds; new ones are added at its end. A last line that was torn
is dropped; anything else that is wrong is refused, and the file is left as it is.
"""

import fcntl
import json
import os
import re
import stat
from collections.abc import Iterable
from dataclasses import asdict, astuple, dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self

from rcsc import __version__
from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.plain import read
from rcsc.base.host.files.read import json_of
from rcsc.run.campaign.rig import Rig, digest
from rcsc.run.episodes.outcome import EpisodeFinding

FORM = 1
"""Of the file; another is not read."""

MOST_BYTES = 256 * 1024 * 1024
MOST_DIGITS = 100_000
"""Of the lines that ran: a bit each."""
_PLANT_CHARACTERS = 40
"""Of a plant, in the name of a file."""
_SHOWN = 16
"""Digits of a digest that are shown."""

_OTHERS = {
    "form": "is of another form",
    "rcsc": "was written by another version of rcsc",
    "seed": "is of another seed",
    "plant": "is of another plant",
    "executor": "is of other executors",
    "digest": "is of other tables, data or programs",
}


class BadJournal(CodedError):  # noqa: N818  # what happened, not an error of ours
    """The file is not this campaign's journal; says why. It was not changed."""

    code = Code.BAD_JOURNAL
    helps = ("name another file with --journal",)


@dataclass(frozen=True, slots=True)
class EpisodeRecord:
    """What became of one episode.

    Attributes:
        faults: Its fault classes; empty where it is nominal.
        end: As of an outcome, and `crash`, `hang` and `error:NAME`.
        ticks: Of control.
        lines: Those that ran, as bits; see `rcsc.run.campaign.rig.mask`.
        digest: Of every cycle's values.
    """

    index: int
    faults: tuple[str, ...]
    end: str
    ticks: int
    findings: tuple[EpisodeFinding, ...]
    lines: int
    digest: str


def header(rig: Rig[Any], seed: int) -> dict[str, Any]:
    """Return the first line: campaigns with the same one have the same outcomes.

    Raises:
        BadDescription: The system is not in order.
    """
    return {
        "form": FORM,
        "rcsc": __version__,
        "seed": seed,
        "plant": rig.plant,
        "executor": rig.executor,
        "digest": digest(rig),
    }


def journal_path(rig: Rig[Any], seed: int, folder: Path) -> Path:
    """Return the default path of the journal, which depends on the tables."""
    plant = re.sub("[^A-Za-z0-9_]+", "_", rig.plant)[-_PLANT_CHARACTERS:] or "first"
    return folder / "campaign" / f"{seed}-{plant}-{rig.executor}-{digest(rig)[:16]}.jsonl"


class Journal:
    """A journal that is open, and this process's alone.

    Attributes:
        records: What it holds, by the episode's number.
    """

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        """Open the journal, or begin it.

        Raises:
            BadJournal: It is another campaign's, damaged, or being written.
            OSError: It cannot be read or written.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self.records: dict[int, EpisodeRecord] = {}
        self._file = _opened(path)
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
            begun, *rest = whole[:-1].split(b"\n")
            _compare(self.path, begun, head)
            for number, line in enumerate(rest, 2):
                record = _read(self.path, number, line)
                self.records[record.index] = record
        self._file.truncate(len(whole))
        self._file.seek(len(whole))
        if not whole:
            self._file.write(first)
            self._file.flush()

    def add(self, records: Iterable[EpisodeRecord]) -> None:
        """Write records; when it returns, a kill of this process loses none of them.

        Raises:
            OSError: They cannot be written.
        """
        new = list(records)
        self.records |= {episode_record.index: episode_record for episode_record in new}
        self._file.write(b"".join(_line(_entry(episode_record)) for episode_record in new))
        self._file.flush()

    def close(self) -> None:
        """Close the journal, which others may write from then on."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _opened(path: Path) -> BinaryIO:
    """Return the file, open for reading and writing; it is made where there is none."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NONBLOCK, 0o666)
    kind = os.fstat(handle)
    if not stat.S_ISREG(kind.st_mode) or kind.st_size > MOST_BYTES:
        os.close(handle)
        raise BadJournal(f"{path} is no journal: no regular file, or larger than {MOST_BYTES} bytes")
    return open(handle, "r+b")


def _lock(file: BinaryIO, path: Path) -> None:
    """The kernel lets go when the process ends, however it does."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise BadJournal(f"{path} is being written by another campaign") from error


def _compare(path: Path, line: bytes, head: dict[str, Any]) -> None:
    try:
        kept = read(dict[str, str | int], json_of(line))
    except ValueError as error:
        raise BadJournal(f"{path} is no journal") from error
    if not kept.keys() >= {"form", "seed"}:
        raise BadJournal(f"{path} is no journal")
    for name, why in _OTHERS.items():
        if kept.get(name) != head[name]:
            raise BadJournal(f"{path} {why}: {str(kept.get(name))[:_SHOWN]}, not {str(head[name])[:_SHOWN]}")


def _line(entry: dict[str, Any]) -> bytes:
    return json.dumps(entry, separators=(",", ":")).encode() + b"\n"


def _entry(record: EpisodeRecord) -> dict[str, Any]:
    findings = [list(astuple(finding)) for finding in record.findings]
    return asdict(record) | {"findings": findings, "lines": f"{record.lines:x}"}


@dataclass(frozen=True, slots=True)
class _Line:
    """Return a record as its line's JSON."""

    index: int
    faults: list[str]
    end: str
    ticks: int
    findings: list[tuple[str, int, str]]
    lines: str
    digest: str


def _read(path: Path, number: int, line: bytes) -> EpisodeRecord:
    try:
        entry: _Line = read(_Line, json_of(line))
        findings = tuple(EpisodeFinding(*finding) for finding in entry.findings)
        if (
            min(entry.index, entry.ticks, *(finding.tick for finding in findings), 0) < 0
            or len(entry.lines) > MOST_DIGITS
        ):
            raise ValueError  # noqa: TRY301  # told below
        lines = int(entry.lines, 16)
        return EpisodeRecord(
            entry.index, tuple(entry.faults), entry.end, entry.ticks, findings, lines, entry.digest
        )
    except ValueError as error:
        raise BadJournal(f"{path}, line {number} is damaged") from error
