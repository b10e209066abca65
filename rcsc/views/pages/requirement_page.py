"""One requirement as a page to be handed on: what it says, its verdict and what that rests on, the lines it speaks of, and a run.

In: what is known of the requirement, in words, and the log of a run that breaks it, or that asks for its response. Out: one HTML file that
needs nothing else; the same text for the same requirement, tables and run.
"""

from dataclasses import dataclass, replace
from pathlib import Path

from rcsc import __version__
from rcsc.base.host.files import write_atomically
from rcsc.run.log.finding import LoggedFinding
from rcsc.run.log.read import Log
from rcsc.views.pages.finding_page import SIGNS, film_of
from rcsc.views.pages.frame import PAGES


@dataclass(frozen=True, slots=True)
class SpokenLine:
    """A line that has a part in the requirement.

    Attributes:
        when: Its conditions, `does` its actions, in the table's words.
        how: Which part: `changes left.runs`.
        direct: Whether it changes or tests what the requirement names; else what it writes reaches that.
        ran: In which cycles of the run it ran.
    """

    line: str
    when: tuple[str, ...]
    does: tuple[str, ...]
    how: str
    direct: bool
    ran: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class SpokenTable:
    """A table with lines that have a part in the requirement; `others`, how many of its lines have none."""

    level: str
    table: str
    place: str
    lines: tuple[SpokenLine, ...]
    others: int


@dataclass(frozen=True, slots=True)
class RequirementStory:
    """A requirement with all that is known of it.

    Attributes:
        whose: `of level `l``, or `across levels`.
        state: The verdict in one word; `verdict`, in words.
        timing: What the timing means, a sentence; empty where there is none to speak of.
        rests: What it rests on, claim by claim, each with its verdict.
        trusts: What is trusted, besides rcsc itself.
        facts: What it is about: a name, what that is, and a digest.
        asks: Whether the run asks for the response; else it breaks the requirement.
        without: Why no run is shown; empty where one is.
        waits: The first cycle of those that come again and again, where the run waits for ever; else 0.
    """

    word: str
    name: str
    whose: str
    says: str
    doc: str
    place: str
    answers: tuple[str, ...]
    state: str
    verdict: str
    timing: str
    rests: tuple[tuple[str, str], ...]
    trusts: tuple[str, ...]
    tables: tuple[SpokenTable, ...]
    facts: tuple[tuple[str, str, str], ...]
    asks: bool = False
    without: str = ""
    waits: int = 0


def requirement_page(story: RequirementStory, log: Log | None) -> str:
    """Return the page; the log keeps a finding."""
    finding = None if log is None else log.finding
    film = []
    if log is not None and finding is not None:
        shown = asking(finding) if story.asks else finding
        film = film_of(replace(log, finding=shown), shown, asks=story.asks)
        story = replace(story, tables=tuple(_with_run(table, log) for table in story.tables))
    return PAGES.get_template("requirement.html.jinja").render(
        its=story,
        ticks=film,
        broken_at=0 if finding is None else finding.broken_at,
        sign=SIGNS,
        version=__version__,
    )


def write_requirement(path: Path, story: RequirementStory, log: Log | None) -> None:
    """Write the page. Raises OSError: The file could not be written."""
    write_atomically(path, requirement_page(story, log).encode())


def asking(finding: LoggedFinding) -> LoggedFinding:
    """Return a finding whose run breaks nothing: it asks where it would be broken that nothing ever asks."""
    return replace(finding, cycles={at: replace(one, wrong="") for at, one in finding.cycles.items()})


def _with_run(table: SpokenTable, log: Log) -> SpokenTable:
    """Return a table with the cycles of a run in which each line ran."""
    level = next((level for level in log.levels if level.name == table.level), None)
    ran = dict[str, list[int]]()
    for tick, values in list(level.track)[1:] if level is not None else ():
        for name, line in level.sign.lines_of(level.level, values) if level is not None else ():
            if name == table.table:
                ran.setdefault(line, []).append(tick)
    lines = tuple(replace(one, ran=tuple(ran.get(one.line, ()))) for one in table.lines)
    return replace(table, lines=lines)
