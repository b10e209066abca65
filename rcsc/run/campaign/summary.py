"""The summary of a campaign: outcomes by fault, findings by property, lines reached.

In: records and the tables' lines. Out: a `Summary`, as text and for JSON. It depends on the records alone, not on their order;
the caller adds times.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rcsc.run.campaign.journal import EpisodeRecord
from rcsc.run.campaign.rig import LineName
from rcsc.run.episodes.proved.claims import AcrossClaim, Claim, Claims, Unwatched
from rcsc.run.episodes.proved.watch import ProvedHolds
from rcsc.run.episodes.stand import Stand

NOMINAL = "nominal"
_FIRST = ("done", "failed", "refused")
_DIGITS = 16
"""Of a proof's digest, as it is shown."""
_KINDS = {
    "SOME_LINE": "some line matches",
    "ONE_LINE": "no two match",
    "NO_DEFAULT": "DEFAULT unreachable",
    "UNREACHED": "lines never reached",
    "ASSUMPTION": "assumptions",
    "INVARIANT": "invariants",
    "OWED": "facts owed",
    "GIVEN": "facts of other levels",
    "STANDS": "answers stand",
    "PROPERTY": "properties",
    "REQUIREMENT": "requirements over time",
    "KEPT": "assumptions that can be kept",
    "ENDS": "commands end",
    "CONTRACT": "agreements",
    "SAFE": "values in range",
    "AGAIN": "lines that match again",
    "DEFERRED": "deferred states",
    "ECHOES": "echoes",
    "NUMBERED": "numbered fields",
    "NEXT_NUMBER": "numbers",
    "WAITS": "waits for the echo",
    "PAUSES": "PAUSE passed on",
    "ONCE": "taken up once",
    "ANSWERED": "no command passed over",
    "DONE_STAYS": "done stays",
    "FAILED_STAYS": "failed stays",
}
"""What a kind of claim is called where its claims are counted."""
_AS_SCHEDULED = "what is proved as scheduled is not asked for once a buffer between levels was late, lost a value or repeated one"
_WIDEST_SHOWN = 12
"""Lines of a table that are named where they were never reached."""


@dataclass(frozen=True, slots=True)
class Broken:
    """A property that did not hold, in how many episodes, and in which first."""

    property: str
    episodes: int
    first: int
    said: str


@dataclass(frozen=True, slots=True)
class LinesReached:
    """Which lines of a table ran in some episode."""

    level: str
    table: str
    reached: tuple[str, ...]
    never: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Summary:
    """A campaign in numbers.

    Attributes:
        by_fault: How often each outcome came, by fault class; an episode of two faults counts under both.
        ends: How often each outcome came, with its reason.
        reached: Lines reached and lines there are, by table.
    """

    episodes: int
    cycles: int
    with_findings: int
    by_fault: Mapping[str, Mapping[str, int]]
    ends: Mapping[str, int]
    broken: tuple[Broken, ...]
    reached: tuple[LinesReached, ...]


def summary(records: Iterable[EpisodeRecord], lines: Sequence[LineName], faults: Sequence[str]) -> Summary:
    """Sum up records.

    Args:
        records: In any order.
        lines: Of all tables, as `rcsc.run.campaign.rig.known_lines` has them.
        faults: Fault classes, in the order in which they are to be shown.
    """
    sorted_ = sorted(records, key=lambda record: record.index)
    counts: dict[str, Counter[str]] = {}
    ran = 0
    for record in sorted_:
        ran |= record.lines
        for fault in record.faults or (NOMINAL,):
            counts.setdefault(fault, Counter())[record.end.partition(":")[0]] += 1
    ordered = [fault for fault in (NOMINAL, *faults) if fault in counts]
    return Summary(
        len(sorted_),
        sum(record.ticks for record in sorted_),
        sum(bool(record.findings) for record in sorted_),
        {fault: dict(sorted(counts[fault].items())) for fault in ordered},
        dict(sorted(Counter(record.end for record in sorted_).items())),
        _broken(sorted_),
        _reached(ran, lines),
    )


def _broken(records: Iterable[EpisodeRecord]) -> tuple[Broken, ...]:
    episodes: Counter[str] = Counter()
    first: dict[str, tuple[int, str]] = {}
    for record in records:
        episodes.update({finding.property for finding in record.findings})
        for finding in record.findings:
            first.setdefault(finding.property, (record.index, finding.message))
    every = (Broken(name, count, *first[name]) for name, count in episodes.items())
    return tuple(sorted(every, key=lambda broken: (-broken.episodes, broken.property)))


def _reached(ran: int, lines: Sequence[LineName]) -> tuple[LinesReached, ...]:
    tables: dict[tuple[str, str], tuple[list[str], list[str]]] = {}
    for at, (level, table, line) in enumerate(lines):
        did, did_not = tables.setdefault((level, table), ([], []))
        (did if ran >> at & 1 else did_not).append(line)
    return tuple(
        LinesReached(level, table, tuple(did), tuple(not_)) for (level, table), (did, not_) in tables.items()
    )


def as_text(summed: Summary) -> str:
    """Return it as text."""
    parts = [_outcomes(summed), _coverage(summed.reached)]
    if summed.broken:
        parts.insert(1, _properties(summed.broken))
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


@dataclass(frozen=True, slots=True)
class Watched:
    """What was proved of a system, and how much of it episodes watch.

    Attributes:
        watched: Claims that are, by level; `unwatched`, those that cannot be, each with why, `proofs` which proofs they are from.
        why: Why there are none; empty where there are.
        across: Those across levels.
    """

    watched: Mapping[str, tuple[Claim, ...]]
    unwatched: tuple[Unwatched, ...]
    proofs: Mapping[str, str]
    why: str = ""
    across: tuple[AcrossClaim, ...] = ()


def watched(claims: Claims, its: Stand) -> Watched:
    """Find which claims episodes on a stand watch."""
    if not claims.levels:
        return Watched({}, (), {}, claims.why)
    holds = ProvedHolds(claims, its)
    by_level = {
        level.name: tuple(claim for claim in holds.watched if claim.level == level.name)
        for level in claims.levels
    }
    proofs = {level.name: level.proof for level in claims.levels}
    return Watched(by_level, tuple(holds.unwatched), proofs, claims.why, tuple(holds.together.values()))


def watched_text(of: Watched) -> list[str]:
    """Say which claims were watched, from which proof, and which could not be."""
    if of.why:
        return [f"no claim of a proof is watched: {of.why}"]
    many = sum(map(len, of.watched.values())) + len(of.across)
    lines = [f"{many} of {many + len(of.unwatched)} claims that `rcsc prove` calls proved are watched"]
    for level, claims in of.watched.items():
        kinds = Counter(_KINDS.get(claim.kind, claim.kind) for claim in claims)
        named = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        lines.append(f"  level {level}, proof {of.proofs[level][:_DIGITS]}: {named or 'none'}")
    for words in dict.fromkeys(claim.words for claim in of.across):
        names = ", ".join(f"`{claim.name}`" for claim in of.across if claim.words == words)
        lines.append(f"  across levels, {words}: {names}")
    if any(claim.scheduled for claim in of.across):
        lines.append(f"  {_AS_SCHEDULED}")
    lines += [f"  not watched: {level_claim(claim)}: {why}" for claim, why in of.unwatched]
    return lines


def level_claim(claim: Claim) -> str:
    """Spell a claim with its level."""
    return f"level `{claim.level}`: {claim.words}"


def watched_json(of: Watched) -> dict[str, Any]:
    """Return the same as JSON values."""
    return {
        "watched": {level: [claim.words for claim in claims] for level, claims in of.watched.items()},
        "proofs": dict(of.proofs),
        "not_watched": [
            {"level": claim.level, "claim": claim.words, "why": why} for claim, why in of.unwatched
        ],
        "why_none": of.why,
        "across": [asdict(claim) for claim in of.across],
    }


def as_json(summed: Summary) -> dict[str, Any]:
    """Return it as JSON values."""
    return {
        "episodes": summed.episodes,
        "cycles": summed.cycles,
        "episodes_with_findings": summed.with_findings,
        "outcomes_by_fault": summed.by_fault,
        "outcomes": summed.ends,
        "findings": [asdict(broken) for broken in summed.broken],
        "lines": [asdict(table) for table in summed.reached],
    }


def _outcomes(summed: Summary) -> list[str]:
    seen = {end for counts in summed.by_fault.values() for end in counts}
    columns = [column for column in _FIRST if column in seen] + sorted(seen - set(_FIRST))
    widths = [max(len(column), 6) for column in columns]
    head = "  ".join(f"{column:>{wide}}" for column, wide in zip(columns, widths, strict=True))
    longest = max([len("fault"), *map(len, summed.by_fault)])
    lines = [f"{'fault':{longest}}  {head}".rstrip()]
    for fault, counts in summed.by_fault.items():
        cells = (
            f"{counts.get(column, 0) or '-':>{wide}}" for column, wide in zip(columns, widths, strict=True)
        )
        lines.append(f"{fault:{longest}}  {'  '.join(cells)}")
    return lines


def _properties(properties: Iterable[Broken]) -> list[str]:
    listed = list(properties)
    longest = max(len(broken.property) for broken in listed)
    head = f"{'property that did not hold':{longest}}  episodes  first"
    longest = max(longest, len("property that did not hold"))
    return [
        head,
        *(
            f"{broken.property:{longest}}  {broken.episodes:8}  {broken.first}: {broken.said}"
            for broken in listed
        ),
    ]


def _coverage(reached: Iterable[LinesReached]) -> list[str]:
    lines = []
    by_level: dict[str, list[LinesReached]] = {}
    for table in reached:
        by_level.setdefault(table.level, []).append(table)
    for level, tables in by_level.items():
        ran, all_ = (
            sum(len(table.reached) for table in tables),
            sum(len(table.reached) + len(table.never) for table in tables),
        )
        lines.append(f"level {level}: {ran} of {all_} lines reached")
        lines += [f"  {table.table} never: {_named(table.never)}" for table in tables if table.never]
    return lines


def _named(never: Sequence[str]) -> str:
    more = len(never) - _WIDEST_SHOWN
    return ", ".join(never[:_WIDEST_SHOWN]) + (f" and {more} more" if more > 0 else "")
