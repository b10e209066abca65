"""What earlier proofs of the levels together say of the tables that were checked.

In: a report, and the cache. Out: the same report, in which an assumption that the levels keep is *proved*, with warnings where they were
found not to. No search is begun here. What a system is made of is kept with digests of its files (`outline`), so that while none of
them changes nothing is read but these and the verdicts.
"""

import functools
import os
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity, sort_key
from rcsc.base.diagnostics.report import (
    NOT_PROVED,
    InSystem,
    Report,
    SystemReport,
    TableReport,
    named,
    trusting,
)
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.cache import Cache, cache_of
from rcsc.base.host.files import read
from rcsc.compose.contract.claims import UNREACHED, Promise
from rcsc.compose.proof.standing import (
    ASSUMPTION,
    ONE_LINE,
    SOME_LINE,
    KnownSystem,
    KnownVerdict,
    LevelOutline,
)
from rcsc.driver.outline import known
from rcsc.lang.project import systems_above
from rcsc.run.description import BadDescription, description, places

DECLARED_PROVED = "proved"
"""The standing of what declared ranges and invariants ensure."""
_BY_MATCHING = {Code.GAP: SOME_LINE, Code.OVERLAP: ONE_LINE}
"""Findings about matching, and what is proved of a level that never meets one."""
MOST_OPEN = 5
"""Things that are shown of a level that is not proved; then how many more."""


def with_levels(report: Report, cache: Cache) -> Report:
    """Add to the report the kept verdicts on the systems that its tables belong to."""
    seen = _Seen(cache)
    tables = tuple(seen.table(table) for table in report.tables)
    diagnostics = {*map(seen.noted, report.diagnostics), *seen.warnings()}
    sources = {**seen.sources, **report.sources}
    systems = tuple(seen.systems.values())
    return Report(tuple(sorted(diagnostics, key=sort_key)), tables, sources, systems)


@dataclass(frozen=True, slots=True)
class _Place:
    """A level that runs a table.

    Attributes:
        default: The name of the table's DEFAULT line.
    """

    standing: KnownSystem
    level: LevelOutline
    table: str
    default: str

    def known(self, assumption: str) -> KnownVerdict:
        """Return the verdict on one of the table's assumptions here."""
        return self.standing.of_obligation(self.level.name, (ASSUMPTION, self.table, assumption))

    def rests(self, assumption: str) -> tuple[str, ...]:
        """Spell the claims that an assumption rests on and that are not proved."""
        return self.standing.lacking(self.level.name, (ASSUMPTION, self.table, assumption))

    def trusts(self, sort: str, name: str) -> tuple[str, ...]:
        """Spell the assumptions that a claim of a sort, about an assumption or a line of the table, trusts."""
        return self.standing.trusting(self.level.name, (sort, self.table, name))

    @property
    def unreached(self) -> tuple[str, ...]:
        """The table's lines that never run here."""
        return self.standing.unreached(self.level.name, self.table)


class _Seen:
    """Systems that were looked at for one report.

    Attributes:
        systems: The report on each.
        sources: Texts that the warnings point into.
        levels: Those that run a table of the report; by description as shown, and name.
        idle: Tables of the report whose DEFAULT never runs, each with the system's description.
    """

    def __init__(self, cache: Cache) -> None:
        self.cache = cache
        self.systems: dict[str, SystemReport] = {}
        self.sources: dict[str, Source] = {}
        self.levels: dict[tuple[str, str], tuple[KnownSystem, LevelOutline]] = {}
        self.idle: dict[tuple[str, str], str] = {}
        self._standings: dict[Path, KnownSystem | None] = {}
        self._roots = functools.cache(_roots)  # a system has many tables

    def table(self, table: TableReport) -> TableReport:
        """Return the table with the verdicts on it in the nearest system that runs it."""
        for system in systems_above(table.file):
            name = _shown(str(system), table.file)
            known_system = self._standing(system)
            if known_system is None:
                if _beside(self._roots(system), table.file):
                    self._say(name, None, wanted=bool(_open(table)))
                    return table
                continue
            if at := list(_places(known_system, table)):
                return self._placed(table, name, at)
        return table

    def _standing(self, system: Path) -> KnownSystem | None:
        """Return the kept verdicts on a system; None where no level was ever proved, or it is not in order."""
        if system not in self._standings:
            self._standings[system] = known(system, cache_of(system.parent, self.cache))
        return self._standings[system]

    def _placed(self, table: TableReport, system: str, at: list[_Place]) -> TableReport:
        """Return the table with the verdicts on it in all levels of a system that run it."""
        for place in at:
            self.levels.setdefault((system, place.level.name), (place.standing, place.level))
        states = {name: _worst({place.known(name) for place in at}) for name in _open(table)}
        by = {
            known: tuple(name for name, state in states.items() if state is known) for known in KnownVerdict
        }
        proved, conditional = by[KnownVerdict.PROVED], by[KnownVerdict.CONDITIONAL]
        broken = {KnownVerdict.REFUTED, KnownVerdict.NOT_PROVED}
        not_proved = tuple(name for name, state in states.items() if state in broken)
        unreached = tuple(line for line in at[0].unreached if all(line in place.unreached for place in at))
        if at[0].default in unreached:
            self.idle[table.file, table.table] = system
        known_system = at[0].standing
        self._say(system, known_system, wanted=bool(by[KnownVerdict.UNKNOWN]) and not known_system.broken)
        assumptions = tuple(
            (name, KnownVerdict.PROVED.value if name in proved else was) for name, was in table.assumptions
        )
        rests = tuple(
            dict.fromkeys(word for place in at for name in conditional for word in place.rests(name))
        )
        claims = [*((ASSUMPTION, name) for name in proved), *((UNREACHED, line) for line in unreached)]
        trusts = tuple(
            dict.fromkeys(word for place in at for claim in claims for word in place.trusts(*claim))
        )
        together = InSystem(system, proved, not_proved, unreached, conditional, rests, trusts)
        return replace(table, assumptions=assumptions, together=together)

    def _say(self, system: str, known_system: KnownSystem | None, *, wanted: bool) -> None:
        before = self.systems.get(system)
        wanted = wanted or (before is not None and before.wanted)
        whole = KnownVerdict.UNKNOWN if known_system is None else known_system.whole
        missing: tuple[str, ...] = ()
        if known_system is not None and whole in {KnownVerdict.PARTLY, KnownVerdict.CONDITIONAL}:
            levels = [level.name for level in known_system.outline.levels]
            missing = tuple(f"level `{name}`: {why}" for name in levels for why in known_system.missing(name))
        self.systems[system] = SystemReport(system, whole.value, wanted, missing)

    # --- findings ---

    def noted(self, diagnostic: Diagnostic) -> Diagnostic:
        """Return the finding with a note where its DEFAULT never runs here, or where its properties are proved."""
        if diagnostic.code is Code.PROPERTY_ELSEWHERE:
            return self._elsewhere(diagnostic)
        if diagnostic.code in _BY_MATCHING and diagnostic.witnesses:
            return self._never_comes(diagnostic)
        if diagnostic.code is not Code.DEFAULT_COVERS or not diagnostic.witnesses:
            return diagnostic
        system = self.idle.get((diagnostic.primary.span.file, diagnostic.witnesses[0].table))
        if system is None:
            return diagnostic
        note = f"none of them comes in {system}: proved of the levels together"
        return replace(diagnostic, notes=(*diagnostic.notes, note))

    def _never_comes(self, diagnostic: Diagnostic) -> Diagnostic:
        """Return the finding with the help to state an invariant, where the levels together are proved to keep such inputs away."""
        file = os.path.realpath(diagnostic.primary.span.file)
        table = str(diagnostic.witnesses[0].table)
        places_ = [
            (
                system,
                level.name,
                known_system.of_obligation(level.name, (_BY_MATCHING[diagnostic.code], table, "")),
            )
            for (system, _), (known_system, level) in self.levels.items()
            if any((outline.file, outline.name) == (file, table) for outline in level.tables)
        ]
        if _worst({state for *_, state in places_}) not in {KnownVerdict.PROVED, KnownVerdict.TRUSTED}:
            return diagnostic
        systems = ", ".join(dict.fromkeys(system for system, *_ in places_))
        note = f"none comes in {systems}: proved of the levels together; what this file says does not show it"
        helps = tuple(
            f"have the file say it: `rcsc prove {system} --level {level} --invariants` prints what keeps such inputs away "
            "as an `invariant`, which is then proved here, or refused"
            for system, level, _ in places_
        )
        return replace(diagnostic, notes=(*diagnostic.notes, note), help=(*diagnostic.help, *helps))

    def _elsewhere(self, diagnostic: Diagnostic) -> Diagnostic:
        """Return the finding with a note where its properties are proved, if each is in every level that states it."""
        file = os.path.realpath(diagnostic.primary.span.file)
        stated = [
            (system, known_system, level.name, key)
            for (system, _), (known_system, level) in self.levels.items()
            for key, at in level.properties
            if at == file
        ]
        state = _worst({known_system.of_obligation(level, key) for _, known_system, level, key in stated})
        systems = ", ".join(dict.fromkeys(system for system, *_ in stated))
        if state is KnownVerdict.PROVED:
            words = dict.fromkeys(
                word for _, known_system, level, key in stated for word in known_system.trusting(level, key)
            )
            note = f"proved of the levels together, {systems}{trusting(words)}"
        elif state is KnownVerdict.CONDITIONAL:
            words = dict.fromkeys(
                word for _, known_system, level, key in stated for word in known_system.lacking(level, key)
            )
            note = f"conditional in {systems}: rests on {named(words)}"
        else:
            return diagnostic
        return replace(diagnostic, notes=(*diagnostic.notes, note), help=())

    def warnings(self) -> Iterator[Diagnostic]:
        """Yield a warning for each level, of those that run the tables, that is not proved, or relies on a promise that is not."""
        for (system, _), (known_system, level) in self.levels.items():
            if known_system.of_level(level.name) is KnownVerdict.NOT_PROVED:
                yield self._not_proved(system, known_system, level)
            for promise in known_system.broken:
                if promise.level == level.name:
                    yield self._not_kept(system, level, promise)

    def _not_proved(self, system: str, known_system: KnownSystem, level: LevelOutline) -> Diagnostic:
        still = known_system.known[level.name].open
        more = [f"and {len(still) - MOST_OPEN} more"] if len(still) > MOST_OPEN else []
        return Diagnostic(
            Code.NOT_COMPOSED,
            f"level `{level.name}` is not proved together with its neighbours in {system}",
            self._label(system, level),
            notes=(*(f"not proved: {name}" for name in still[:MOST_OPEN]), *more),
            help=(f"`rcsc prove {system} --level {level.name}` looks for the shortest run that shows it",),
            severity=Severity.WARNING,
        )

    def _not_kept(self, system: str, level: LevelOutline, what: Promise) -> Diagnostic:
        message = f"level `{level.name}` assumes that {what.assumed}, which its neighbour in {system} is not proved to keep"
        helps = (f"`rcsc prove {system}` says of both what is proved",)
        label = self._label(system, level)
        return Diagnostic(Code.NOT_AGREED, message, label, help=helps, severity=Severity.WARNING)

    def _label(self, system: str, level: LevelOutline) -> Label:
        """Return a label at the level's name where it is declared."""
        file = _shown(level.file, system)
        self.sources.setdefault(file, Source(file, read.text(Path(level.file))))
        return Label(Span(file, level.start, level.end))


# --- which system a table belongs to ---------------------------------------------------------


def _beside(tried: Iterable[tuple[Path, Path]], file: str) -> bool:
    """Return whether a file is, or stands with, the root file of a level; `tried` are the two places of each."""
    real = Path(os.path.realpath(file))
    return any(real == beside or real.parent == inside.parent for inside, beside in tried)


def _roots(system: Path) -> list[tuple[Path, Path]]:
    """Return the two places where the root file of each level may stand; none where the system is not in order."""
    try:
        return [places(system, spec.source) for spec in description(system).levels]
    except BadDescription:
        return []


def _places(known_system: KnownSystem, table: TableReport) -> Iterator[_Place]:
    """Yield the levels of a system that run a table."""
    real = os.path.realpath(table.file)
    for level in known_system.outline.levels:
        for outline in level.tables:
            if (outline.file, outline.name) == (real, table.table):
                yield _Place(known_system, level, outline.name, outline.default)


def _worst(states: Collection[KnownVerdict]) -> KnownVerdict:
    """Return the worst state among several levels; unknown where none knows anything."""
    order = (
        KnownVerdict.REFUTED,
        KnownVerdict.NOT_PROVED,
        KnownVerdict.UNKNOWN,
        KnownVerdict.CONDITIONAL,
        KnownVerdict.TRUSTED,
        KnownVerdict.PROVED,
    )
    return next((state for state in order if state in states), KnownVerdict.UNKNOWN)


def _open(table: TableReport) -> list[str]:
    """Return the assumptions that the proof of the table rests on and has not shown."""
    return [name for name, was in table.assumptions if was not in (DECLARED_PROVED, NOT_PROVED)]


def _shown(path: str, like: str) -> str:
    """Return a path as the user who wrote `like` would write it."""
    return path if os.path.isabs(like) else os.path.relpath(path)
