"""The description of a system: its levels, the buffers between them, what the database fills, what stands outside; one TOML file.

In: `system.toml`. Out: a frozen `Description`. The names of buffers and of their destinations stand here, and the
rest is automatic (Haynes et al. 1984, section 9).
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.source import Source
from rcsc.host.described import (
    Anything,
    BadFile,
    Document,
    Entries,
    FileName,
    KeyPath,
    Listing,
    Member,
    Number,
    Record,
    Text,
    Word,
    nearest,
    read_document,
)
from rcsc.host.files.names import BadName, is_member, member, within
from rcsc.host.files.read import CheckedFields
from rcsc.lang.project import project_root
from rcsc.run.declared_plant import PlantSpec, plants


class BadDescription(BadFile):
    """The description says something that cannot be; tells where and what."""


LONGEST_MS, MOST_LEVELS, MOST_WITHIN = 3_600_000, 10_000, 1_000_000
WITHIN = 5000
"""Cycles without a fault in which every command from outside ends, where the description says nothing else."""
FEED = Record({"into": Member(), "query": Word(), "keys": Listing(Member())})
LEVEL = Record({"name": Word()}, {"program": Word(), "feed": Listing(FEED)})
SYSTEM = Record(
    {
        "name": FileName(),
        "generated": Text(),
        "tick_ms": Number(1, LONGEST_MS, whole=True),
        "level": Listing(LEVEL, least=1),
        "buffers": Entries(Member()),
    },
    {
        "data": Text(),
        "displays": Entries(Listing(Member())),
        "outside": Listing(Word()),
        "plant": Entries(Anything()),
        "script": Text(),
        "campaign": Record({}, {"within": Number(1, MOST_WITHIN, whole=True)}),
    },
)
PARTIES = Record({key: SYSTEM.needed[key] for key in ("level", "buffers")}, {"outside": Listing(Word())})
"""What a description may say; `outside` are the parties of its buffers that are no levels."""


@dataclass(frozen=True, slots=True)
class Feed:
    """Inputs that the database fills before each cycle.

    Attributes:
        into: The record that is filled.
        query: What the database is asked.
        keys: Leaves whose values are asked for.
    """

    into: str
    query: str
    keys: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LevelSpec:
    """One control level."""

    name: str
    program: str
    feeds: tuple[Feed, ...]


@dataclass(frozen=True, slots=True)
class Wire:
    """A buffer: whose output it is, and whose input; `level.variable` at both ends."""

    source: str
    target: str


@dataclass(frozen=True, slots=True)
class Description:
    """A whole system; levels from the top down.

    Attributes:
        database: The data of the cell; there is no such file where the system asks no database.
        displays: Sets of variables to look at, by the name that a level's `display` gives them.
        document: The file, for the places of what is wrong with it.
        plants: What may stand outside the levels; the first does when nobody says which.
        script: The orders that are given when nobody says which; None where the description names none.
        within: Cycles without a fault in which every command from outside is to end when the system is tested.
    """

    name: str
    generated: Path
    database: Path
    tick_ms: int
    levels: tuple[LevelSpec, ...]
    wires: tuple[Wire, ...]
    displays: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    document: Document | None = field(default=None, compare=False, repr=False)
    plants: tuple[PlantSpec, ...] = ()
    script: Path | None = None
    within: int = WITHIN

    def unfilled(self, inputs: Iterable[str]) -> tuple[str, ...]:
        """Which of these inputs, `level.variable`, no buffer and no feed fills: they stay as they are at first."""
        filled = {wire.target for wire in self.wires}
        filled |= {f"{level.name}.{feed.into}" for level in self.levels for feed in level.feeds}
        return tuple(name for name in inputs if name not in filled)

    def untaken(self, outputs: Iterable[str]) -> tuple[str, ...]:
        """Which of these outputs, `level.variable`, no buffer takes; by `display` a page goes where there are displays."""
        taken = {wire.source for wire in self.wires}
        taken |= {f"{level.name}.display" for level in self.levels if self.displays}
        return tuple(name for name in outputs if name not in taken)

    def review(self) -> Document:
        """A fresh page for faults, with the places of this description."""
        if self.document is None:
            return Document(self.name, Source(self.name, ""), {}, Code.BAD_SYSTEM)
        return replace(self.document, faults=[])


def description(path: Path) -> Description:
    """Read a description; its paths are seen from where it stands.

    Raises:
        BadDescription: It cannot be read, or something in it cannot be; all that is wrong is told at once.
    """
    document = read_document(path, Code.BAD_SYSTEM, BadDescription)
    document.check(SYSTEM)
    if document.holds(PARTIES):
        _check_parties(document)
    generated, data = (_place(path, document, key) for key in ("generated", "data"))
    script = _place(path, document, "script") if isinstance(document.value.get("script"), str) else None
    declared = plants(path, document)
    if document.faults:
        raise document.bad(BadDescription)
    return replace(_described(path, document, generated, data), plants=declared, script=script)


def _place(path: Path, document: Document, key: str) -> Path:
    """Where a path of the description leads: into its project, or to the folder `generated` beside that."""
    try:
        return within(
            Path(project_root(str(path))), path.parent, document.value.get(key, NO_DATA), f"path `{key}`"
        )
    except BadName as error:
        document.wrong((key,), str(error))
        return path


def _described(path: Path, document: Document, generated: Path, data: Path) -> Description:
    content: dict[str, Any] = document.value
    return Description(
        content["name"],
        generated,
        data if data != path.resolve() else data.with_name(NO_DATA),  # older descriptions name themselves
        content["tick_ms"],
        tuple(level_of(CheckedFields(level)) for level in content["level"]),
        tuple(Wire(a, b) for a, b in content["buffers"].items()),
        {name: tuple(shown) for name, shown in content.get("displays", {}).items()},
        document,
        within=content.get("campaign", {}).get("within", WITHIN),
    )


def level_of(entry: CheckedFields) -> LevelSpec:
    """Return a level of a description, or of a log's copy of one.

    Raises:
        Malformed: It is none, or a name in it is none.
    """
    feeds = "feed" if "feed" in entry.value else "feeds"
    return LevelSpec(
        entry.name("name"),
        entry.name("program", entry.name("name")),
        tuple(
            Feed(feed.member("into"), feed.name("query"), feed.members("keys"))
            for feed in entry.each(feeds, MOST_LEVELS, ())
        ),
    )


def wire_of(source: object, target: object) -> Wire:
    """Return a buffer between two variables, `level.variable` each.

    Raises:
        BadName: One of them is none.
    """
    return Wire(member(source, "buffer"), member(target, "buffer's destination"))


NO_DATA = ".no-data"
"""Stands for the data of a system that has none: no such file is ever made."""


def _check_parties(document: Document) -> None:
    """Check that levels have names of their own, and buffers a level at an end and known parties."""
    content = document.value
    levels = [str(level["name"]) for level in content["level"]]
    for at, name in enumerate(levels):
        if name in levels[:at]:
            document.wrong(("level", at, "name"), f"there are two levels `{name}`")
    ends = list(_ends(content["buffers"]))
    for path, end, _ in ends:
        party, dot, variable = end.partition(".")
        if not (party and dot and variable) or not is_member(end):
            document.wrong(path, f"`{end}` is no buffer's end", "write `party.variable`")
    parties = [end.partition(".")[0] for _, end, _ in ends]
    outside = content.get("outside")
    for path, end, other in ends:
        party, theirs = end.partition(".")[0], other.partition(".")[0]
        if party in levels:
            continue
        if outside is not None:
            known = [*levels, *outside]
            if party not in outside:
                document.wrong(path, f"`{party}` is neither a level nor in `outside`", *nearest(party, known))
        elif alike := _alike(party, levels, parties):
            document.wrong(
                path, f"`{party}` is no level, and is spelled almost as `{alike}`",
                f'did you mean `{alike}`? Else name those that are no levels: `outside = ["{party}"]`',
            )  # fmt: skip
        elif theirs not in levels:
            document.wrong(path, f"neither end of `{end}` and `{other}` is a level", *nearest(party, levels))
    targets = [target for _, target, _ in ends[1::2]]
    for (path, target, _), at in zip(ends[1::2], range(len(targets)), strict=True):
        if target in targets[:at]:
            document.wrong(path, f"`{target}` is filled twice")


def _ends(buffers: Mapping[str, str]) -> Iterator[tuple[KeyPath, str, str]]:
    """Both ends of each buffer: where it stands, the end, the other end."""
    for source, target in buffers.items():
        yield ("buffers", source), source, target
        yield ("buffers", source), target, source


def _alike(party: str, levels: list[str], parties: list[str]) -> str:
    """Return the level, or the party named oftener, that is spelled nearest; empty where none is near."""
    oftener = [other for other in parties if parties.count(other) > parties.count(party)]
    swapped = [level for level in levels if sorted(level) == sorted(party)]
    near = [*swapped, *get_close_matches(party, [*levels, *oftener], n=1, cutoff=0.8)]
    return near[0] if near else ""


def places(path: Path, program: str) -> tuple[Path, Path]:
    """Return where the program of a level is looked for, in order."""
    return path.parent / program / f"{program}.rcs", path.parent / f"{program}.rcs"
