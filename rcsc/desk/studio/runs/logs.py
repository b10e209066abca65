"""Logs that pages may open: those of the system's folder and of the one that the studio was started in.

In: questions of kind `log.*`. Out: which logs there are, and one of them as the run that everybody looks at. A page names a log of that
list, and nothing else is read. Reading has a lane of its own, for it takes seconds. With a log goes what it is kept for: the finding that
a proof wrote into it, or that a campaign put beside it, as `finding.json` in the folder of its `log.mcap`.
"""

import contextlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.read import json_of, text
from rcsc.desk.studio.hub import Ask, Concern, Json
from rcsc.run.log.finding import LoggedFinding
from rcsc.run.log.read import Log, UnreadableLog, finding_at_the_head, read

LANE = "log"
MOST_LOGS = 200
DEEPEST = 5
MOST_LOOKED_AT = 20_000
"""Files and folders that are looked at for logs."""
_ASIDE = {".git", ".venv", "venv", "node_modules", "__pycache__"}
LOG, BESIDE = "log.mcap", "finding.json"
MOST_CHARACTERS = 2_000
"""Of a finding, as a page shows it."""


@dataclass(frozen=True, slots=True)
class KeptFinding:
    """A finding about a run: the obligation or property that it breaks.

    Attributes:
        level: Whose obligation it is; empty where it is the whole system's.
        table: What it is about; empty for the whole level.
        text: The obligation, or the property and what was seen of it.
        tick: In which it is broken.
        wrong: Tick, level and what went wrong there.
    """

    level: str
    table: str
    text: str
    tick: int
    wrong: tuple[tuple[int, str, str], ...] = ()

    def shown(self) -> Json:
        """Return the finding in the form for pages."""
        wrong = [{"tick": tick, "level": level, "text": told} for tick, level, told in self.wrong]
        return {
            "level": self.level, "table": self.table, "text": self.text[:MOST_CHARACTERS], "tick": self.tick, "wrong": wrong,
        }  # fmt: skip


def finding_in(path: Path, log: Log) -> KeptFinding | None:
    """Return the finding for which a log is kept; None for none, or where it is of no tick of the log."""
    found = _proved(log.finding) if log.finding is not None else _beside(path)
    return found if found is not None and log.first <= found.tick <= log.last else None


def glance(path: Path) -> str:
    """Return the text of a log's finding, from its beginning alone; empty where it has none."""
    try:
        proved = finding_at_the_head(path)
    except UnreadableLog:
        return ""
    found = _beside(path) if proved is None else _proved(proved)
    return "" if found is None else found.text[:MOST_CHARACTERS]


def _proved(finding: LoggedFinding) -> KeptFinding:
    wrong = tuple((tick, level, told.wrong) for (tick, level), told in finding.cycles.items() if told.wrong)
    return KeptFinding(finding.level, finding.table, finding.obligation, finding.broken_at, wrong)


def _beside(path: Path) -> KeptFinding | None:
    """Return the finding of a campaign; None where there is none, or no file that a campaign wrote."""
    if path.name != LOG:
        return None
    try:
        facts: Any = json_of(text(path.with_name(BESIDE)))
        name, said, tick = (facts[key] for key in ("property", "said", "tick"))
    except (OSError, ValueError, TypeError, KeyError):
        return None
    if not (isinstance(name, str) and isinstance(said, str) and type(tick) is int):
        return None
    return KeptFinding("", "", f"`{name}` does not hold: {said}", tick)


class Logs(Concern):
    """The logs that may be opened."""

    name, lane = "log", LANE

    def __init__(
        self,
        folders: tuple[Path, ...],
        given: tuple[Path, ...],
        show: Callable[[str, Log, KeptFinding | None], None],
    ) -> None:
        """Args: folders: Where logs are looked for; given: Logs that the user named; show: Takes one that was read, and what it breaks."""
        self._folders, self._given, self._show = folders, given, show

    def begin(self) -> None:
        """Show the first log that the user named, if any."""
        for path in self._given[:1]:
            self._open_at(self._called(path), path)

    def _on_list(self, ask: Ask) -> Json:
        """Return the latest logs, each with its finding."""
        told = []
        for name, path in self.newest():
            ask.check()
            with contextlib.suppress(OSError):  # it went meanwhile
                stat = path.stat()
                told.append(
                    {
                        "name": name,
                        "bytes": stat.st_size,
                        "changed_s": stat.st_mtime,
                        "finding": glance(path),
                    }
                )
        return told

    def newest(self) -> list[tuple[str, Path]]:
        """Return the latest logs by name, the newest first; from any lane."""
        found = []
        for name, path in self._found().items():
            with contextlib.suppress(OSError):  # it went meanwhile
                found.append((path.stat().st_mtime, name, path))
        found.sort(key=lambda one: -one[0])
        return [(name, path) for _, name, path in found[:MOST_LOGS]]

    def _on_open(self, ask: Ask) -> Json:
        name = ask.body.text("name")
        path = self._found().get(name)
        if path is None:
            raise Refused(Code.STUDIO, f"there is no log `{name}`")
        ask.progress(f"reading {name}")
        self._open_at(name, path, ask.check)
        return {"name": name}

    def _open_at(self, name: str, path: Path, check: Callable[[], None] = lambda: None) -> None:
        log = _read(path)
        check()
        self._show(name, log, finding_in(path, log))

    def _found(self) -> dict[str, Path]:
        """Return every log by its name: its path in the first of the folders that has it, or as the user gave it."""
        found: dict[str, Path] = {}
        for path in self._given:
            found[self._called(path)] = path
        for folder in self._folders:
            for path in _logs(folder):
                found.setdefault(self._called(path), path)
        return found

    def _called(self, path: Path) -> str:
        whole = path.resolve()
        within = next((folder for folder in self._folders if whole.is_relative_to(folder)), None)
        return str(path if within is None else whole.relative_to(within))


def _read(path: Path) -> Log:
    """Read a log.

    Raises:
        Refused: The file is no log.
    """
    try:
        return read(path)
    except UnreadableLog as error:
        raise Refused(Code.LOG_UNREADABLE, str(error)) from error


def _logs(top: Path) -> Iterator[Path]:
    waiting, left = [(top, 0)], MOST_LOOKED_AT
    while waiting and left > 0:
        folder, deep = waiting.pop()
        try:
            entries = list(os.scandir(folder))
        except OSError:
            continue
        left -= len(entries)
        for entry in entries:
            if entry.is_dir(follow_symlinks=False) and deep < DEEPEST and entry.name not in _ASIDE:
                waiting.append((Path(entry.path), deep + 1))
            elif (
                entry.name.endswith(".mcap")
                and not entry.name.startswith(".")
                and entry.is_file(follow_symlinks=False)
            ):
                yield Path(entry.path)
