"""One requirement with all that is known of it, for its page: verdict, what it rests on, the lines that have a part in it.

In: a system, read, and its proof; an answer across levels. Out: a `RequirementStory`.
"""

import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from rcsc.base.host.files.read import MOST_OF_OURS, content
from rcsc.compose.contract.claims import ACCEPTED, RUNS, Closed, spelled
from rcsc.compose.proof.system import SystemProof
from rcsc.compose.together.product import Timing
from rcsc.compose.together.proof import Across
from rcsc.driver.requirements import Read, of_answer, place
from rcsc.lang.meaning import digest
from rcsc.lang.model import Line, Property, Table
from rcsc.views.pages.requirement_page import RequirementStory, SpokenLine, SpokenTable
from rcsc.views.trace.across import Part, parts_of

_ANY = (
    "Under any timing: each level runs when it likes, and takes of the others whatever its contract allows, late, twice or never. So it "
    "holds of every schedule, of processes and of networks."
)
_TICKS = "the ticks that `rcsc run` and the C of the system make: a buffer takes one tick, a level runs in each of its periods"
_SCHEDULED = (
    f"As scheduled: {_TICKS}. Where buffers come later, or levels run when they like, nothing is promised."
)
_LATE = (
    f"As scheduled, and each reader may see a buffer so many ticks later, now more, now less: {_TICKS}. Where buffers come later than "
    "that, or levels run when they like, nothing is promised."
)
_RUN = f"The run is one of the system as it is scheduled: {_TICKS}."
_RUN_LATE = f"The run is one of the system as it is scheduled, with buffers that are seen late: {_TICKS}."
_PROMISED = {Timing.ANY: _ANY, Timing.LATE: _LATE, Timing.SCHEDULED: _SCHEDULED}
_RESTARTS = "Any level may begin anew at any moment, and inputs from outside may be refused, but for what is trusted below."


def across_story(its: Read, whole: SystemProof, found: Across) -> RequirementStory:
    """Return the story of a requirement across levels that was answered."""
    assert its.across is not None
    known = of_answer(found, its.systems, whole.closed, place(its.across[1], found.stated.span))
    closed = found.closed(its.systems, whole.closed)
    rests = [
        (f"level `{name}`: each cycle of it goes on, and what it takes is as it assumes", (name, RUNS))
        for name in found.levels
    ]
    timing = (_RUN_LATE if any(found.run_late) else _RUN) if found.refuted else ""
    if found.proved:
        timing = f"{_PROMISED[found.timing]} {_RESTARTS}"
    return replace(
        _story(its, found.stated, "", closed),
        place=known.place,
        state=known.state,
        verdict=known.words,
        timing=timing,
        waits=found.lasso if found.refuted else 0,
        rests=tuple((words, _verdict(whole, whole.of(*need))) for words, need in rests),
    )


def level_story(
    its: Read, whole: SystemProof, level: str, stated: Property, *, refuted: bool
) -> RequirementStory:
    """Return the story of a requirement of one level; `refuted`, whether a run breaks it."""
    closed = whole.of(level, (stated.word, "", stated.name))
    state = (
        "proved" if closed.proved else "conditional" if closed.accepted else "refuted" if refuted else "open"
    )
    words = {
        "proved": "proved in every environment that the contract of the level allows",
        "conditional": "proved, given what it rests on",
        "refuted": "a run of the level, in an environment that its contract allows, breaks it",
        "open": "open: no run was found that breaks it",
    }[state]
    return replace(
        _story(its, stated, level, closed),
        state=state,
        verdict=words,
        timing=f"{_ANY} {_RESTARTS}" if closed.accepted else "",
        rests=tuple((spelled(need, level, whole.closed), "not proved") for need in closed.lacks),
    )


def _verdict(whole: SystemProof, closed: Closed) -> str:
    if closed.proved:
        return "proved"
    lacks = "; ".join(spelled(need, "", whole.closed) for need in closed.lacks)
    if closed.verdict in ACCEPTED:
        return f"rests on {lacks}"
    return "not proved"


def _story(its: Read, stated: Property, level: str, closed: Closed) -> RequirementStory:
    where = place(its.programs[level][1], stated.span) if level else ""
    return RequirementStory(
        stated.word,
        stated.name,
        f"of level `{level}`" if level else "across levels",
        stated.text,
        stated.doc,
        where,
        stated.requirements,
        "",
        "",
        "",
        (),
        closed.trusts,
        tuple(_tables(its, parts_of(its, stated, level))),
        tuple(_facts(its, level)),
    )


def _tables(its: Read, parts: Sequence[Part]) -> Iterator[SpokenTable]:
    for level, (program, loaded) in its.programs.items():
        for table in program.tables:
            own = {part.line: part for part in parts if (part.level, part.table) == (level, str(table.name))}
            if own:
                lines = tuple(
                    _line(table, line.name, own) for line in table.every_line if str(line.name) in own
                )
                others = len(table.every_line) - len(lines)
                yield SpokenTable(level, str(table.name), place(loaded, table.span), lines, others)


def _line(table: Table, name: str, own: dict[str, Part]) -> SpokenLine:
    line = next(line for line in table.every_line if line.name == name)
    when = ["no other line matches"]
    if isinstance(line, Line):
        cells = zip(table.columns, line.tests, strict=True)
        when = [_cell(column.heading, test.text) for column, test in cells if test is not None]
    does = dict.fromkeys(_does(action.heading, action.text) for action in line.actions)
    part = own[str(name)]
    return SpokenLine(str(name), tuple(when), tuple(does), part.how, part.direct)


def _cell(heading: str, text: str) -> str:
    return text if heading == "when" else f"{heading} {text}"


def _does(heading: str, text: str) -> str:
    return text if heading == "procedures" else f"{heading} := {text}"


def _facts(its: Read, level: str) -> Iterator[tuple[str, str, str]]:
    """Yield what the verdict is about: the description, the file of requirements, and each level's program by its meaning."""
    document = its.described.review().name
    yield (
        "system",
        f"{its.described.name}, {its.described.tick_ms} ms a tick",
        _of_file(Path(document)),
    )
    if its.across is not None and not level:
        file = Path(its.across[0].file)
        yield "requirements across levels", os.path.relpath(file), _of_file(file)
    for name, (program, _) in its.programs.items():
        yield f"level {name}", f"{os.path.relpath(program.file)}, meaning", digest(program)


def _of_file(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(content(path, MOST_OF_OURS)).hexdigest() if path.is_file() else ""
