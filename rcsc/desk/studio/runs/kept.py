"""What a kept run breaks: the finding that a proof wrote into its log, or that a campaign put beside it.

In: a log. Out: the finding in words, and the tick to look at first. A campaign's stands in `finding.json`, in the folder of its `log.mcap`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.base.host.files.read import json_of, text
from rcsc.desk.studio.hub import Json
from rcsc.run.log.finding import LoggedFinding
from rcsc.run.log.read import Log, UnreadableLog, finding_at_the_head

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
