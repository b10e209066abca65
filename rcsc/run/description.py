"""The description of a system: its levels, the buffers between them, what the database fills, what stands outside; one TOML file.

In: `system.toml`. Out: a frozen `Description`. The names of buffers and of their destinations stand here, and the
rest is automatic (Haynes et al. 1984, section 9).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.described import (
    Anything,
    BadFile,
    Document,
    Either,
    Entries,
    FileName,
    Flag,
    KeyPath,
    Listing,
    Member,
    Number,
    Record,
    Text,
    Word,
    fits,
    nearest,
    read_document,
)
from rcsc.base.host.files.names import BadName, is_identifier, is_member, member, within
from rcsc.base.host.files.read import CheckedFields, Malformed
from rcsc.lang.project import (
    Instance,
    InstanceParameter,
    Loaded,
    Neighbours,
    again,
    neighbours,
    project_root,
)
from rcsc.run.declared_plant import PlantSpec, plants


class BadDescription(BadFile):
    """An error in a description, with its place."""


LONGEST_MS, MOST_LEVELS, MOST_WITHIN, MOST_LATE = 3_600_000, 10_000, 1_000_000, 20
WITHIN = 5000
"""Cycles without a fault in which every command from outside ends, where the description says nothing else."""
FEED = Record({"into": Member(), "query": Word(), "keys": Listing(Member())})
PARAMETER = Either((Flag(), Number(-1.7e308, 1.7e308), Word()))
LEVEL = Record(
    {"name": Word()},
    {"program": Word(), "tables": Word(), "parameters": Entries(PARAMETER), "feed": Listing(FEED)},
)
SYSTEM = Record(
    {
        "name": FileName(),
        "generated": Text(),
        "tick_ms": Number(1, LONGEST_MS, whole=True),
        "level": Listing(LEVEL, least=1),
    },
    {
        "buffers": Entries(Either((Member(), Listing(Member(), least=1)))),
        "data": Text(),
        "data_python": Text(),
        "displays": Entries(Listing(Member())),
        "late_ticks": Number(1, MOST_LATE, whole=True),
        "outside": Listing(Word()),
        "plant": Entries(Anything()),
        "requirements": Text(),
        "script": Text(),
        "campaign": Record({}, {"within": Number(1, MOST_WITHIN, whole=True)}),
    },
)
PARTIES = Record(
    {"level": SYSTEM.needed["level"]}, {key: SYSTEM.others[key] for key in ("buffers", "outside")}
)
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


Constant: TypeAlias = bool | int | float | str
"""A value of a declared constant; a text is a member's name."""


@dataclass(frozen=True, slots=True)
class LevelSpec:
    """One control level.

    Attributes:
        program: What is generated for it is called so.
        tables: Stem of the file that its tables are in, where the program is an instance of that file; else empty.
        parameters: Constants of an instance, with their values.
    """

    name: str
    program: str
    feeds: tuple[Feed, ...]
    tables: str = field(default="", repr=False)
    parameters: tuple[tuple[str, Constant], ...] = field(default=(), repr=False)

    @property
    def source(self) -> str:
        """The stem of the file that its tables are in."""
        return self.tables or self.program

    @property
    def key(self) -> str:
        """The key of the description that says so."""
        return (
            "tables"
            if self.tables not in {"", self.name}
            else "program"
            if self.program != self.name
            else "name"
        )


@dataclass(frozen=True, slots=True)
class Wire:
    """A buffer and one of its readers: whose output it is, and whose input; `level.variable` at both ends."""

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
        data_python: `MODULE:NAME` of who knows the data (`rcsc.views.pages.data`); empty for nobody.
        script: The orders that are given when nobody says which; None where the description names none.
        within: Cycles without a fault in which every command from outside is to end when the system is tested.
        requirements: The file that says what the levels have to do together; None where the description names none.
        late_ticks: How late buffers may be read where requirements are proved, beyond the tick that each takes; 0 where nothing is said.
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
    data_python: str = ""
    within: int = WITHIN
    requirements: Path | None = None
    late_ticks: int = 0

    def unfilled(self, inputs: Iterable[str]) -> tuple[str, ...]:
        """Return those of these inputs, `level.variable`, that no buffer and no feed fills: they keep their initial values."""
        filled = {wire.target for wire in self.wires}
        filled |= {f"{level.name}.{feed.into}" for level in self.levels for feed in level.feeds}
        return tuple(name for name in inputs if name not in filled)

    def untaken(self, outputs: Iterable[str]) -> tuple[str, ...]:
        """Return those of these outputs, `level.variable`, that no buffer takes; a `display` is for the page, where there are displays."""
        taken = {wire.source for wire in self.wires}
        taken |= {f"{level.name}.display" for level in self.levels if self.displays}
        return tuple(name for name in outputs if name not in taken)

    def taken_by(self, level: str) -> tuple[str, ...]:
        """Return the buffers that a level takes, in order."""
        return tuple(wire.source for wire in self.wires if wire.target.partition(".")[0] == level)

    def readers(self) -> dict[str, tuple[str, ...]]:
        """Return the inputs that each buffer fills, `level.variable`, by the buffer's name; buffers in the description's order."""
        return readers(self.wires)

    def place_of(self, wire: Wire) -> KeyPath:
        """Return where the description says that a buffer goes to a reader; where several read it, the reader's element of the list."""
        return "buffers", wire.source, self.readers()[wire.source].index(wire.target)

    def instance(self, spec: LevelSpec, file: str) -> Instance | None:
        """Return what a level's program is an instance of, with the places of the description; None where it is the file's own.

        Args:
            spec: The level.
            file: Where its tables are.
        """
        if not spec.tables:
            return None
        page, at = self.review(), self.levels.index(spec)
        parameters = tuple(
            InstanceParameter(name, value, page.span(("level", at, "parameters", name)))
            for name, value in spec.parameters
        )
        where = "parameters" if parameters else spec.key
        return Instance(file, spec.name, parameters, page.span(("level", at, where)))

    def load(self, path: Path, spec: LevelSpec, overlay: Mapping[str, str] | None = None) -> Loaded | None:
        """Read the files of a level's program; None where there is no root file.

        Args:
            path: Of this description, beside which they stand.
            spec: The level.
            overlay: Texts that stand for what is on disk, by real path.
        """
        file = next((place for place in places(path, spec.source) if place.is_file()), None)
        if file is None:
            return None
        loaded = again(str(file), self.instance(spec, str(file)), overlay)
        page = self.review()
        return (
            replace(loaded, sources={**loaded.sources, page.name: page.source}) if spec.parameters else loaded
        )

    def review(self) -> Document:
        """Return a fresh page for errors, with the places of this description."""
        if self.document is None:
            return Document(self.name, Source(self.name, ""), {}, Code.BAD_SYSTEM)
        return replace(self.document, faults=[])


def description(path: Path) -> Description:
    """Read a description; its paths are relative to its folder.

    Raises:
        BadDescription: It cannot be read, or has errors; all of them are reported at once.
    """
    document = read_document(path, Code.BAD_SYSTEM, BadDescription)
    document.check(SYSTEM)
    if document.holds(PARTIES):
        _check_tables(document)
        roots = {level["name"]: _root(path, level) for level in document.value["level"]}
        roles = {name: neighbours(root) for name, root in roots.items() if root is not None}
        wires = tuple(_Rows(document, roles).all())
        _check_parties(document, wires)
    else:
        wires = ()
    generated, data = (_place(path, document, key) for key in ("generated", "data"))
    script, requirements = (
        _place(path, document, key) if isinstance(document.value.get(key), str) else None
        for key in ("script", "requirements")
    )
    declared = plants(path, document)
    if document.faults:
        raise document.bad(BadDescription)
    whole = _described(path, document, generated, data, wires)
    return replace(whole, plants=declared, script=script, requirements=requirements)


def _root(path: Path, level: Mapping[str, Any]) -> Path | None:
    """Return the root file of a level's program; None where there is none, which is reported where it is read."""
    found = places(path, str(level.get("tables", level.get("program", level["name"]))))
    return next((file for file in found if file.is_file()), None)


def _place(path: Path, document: Document, key: str) -> Path:
    """Resolve a path of the description: into its project, or to the folder `generated` beside that."""
    try:
        return within(
            Path(project_root(str(path))), path.parent, document.value.get(key, NO_DATA), f"path `{key}`"
        )
    except BadName as error:
        document.wrong((key,), str(error))
        return path


def _described(
    path: Path, document: Document, generated: Path, data: Path, wires: tuple[Wire, ...]
) -> Description:
    content: dict[str, Any] = document.value
    return Description(
        content["name"],
        generated,
        data if data != path.resolve() else data.with_name(NO_DATA),  # older descriptions name themselves
        content["tick_ms"],
        tuple(level_of(CheckedFields(level)) for level in content["level"]),
        wires,
        {name: tuple(shown) for name, shown in content.get("displays", {}).items()},
        document,
        within=content.get("campaign", {}).get("within", WITHIN),
        late_ticks=content.get("late_ticks", 0),
        data_python=content.get("data_python", ""),
    )


def level_of(entry: CheckedFields) -> LevelSpec:
    """Read a level of a description, or of a log's copy of one.

    Raises:
        Malformed: The entry is no level, or has a bad name.
    """
    feeds = "feed" if "feed" in entry.value else "feeds"
    name = entry.name("name")
    program = entry.name("program", name)
    parameters = _constants(entry)
    tables = (
        entry.name("tables", program if parameters else "")
        if {"tables", "parameters"} & entry.value.keys()
        else ""
    )
    return LevelSpec(
        name,
        name if tables else program,
        tuple(
            Feed(feed.member("into"), feed.name("query"), feed.members("keys"))
            for feed in entry.each(feeds, MOST_LEVELS, ())
        ),
        tables,
        parameters,
    )


def _constants(entry: CheckedFields) -> tuple[tuple[str, Constant], ...]:
    """Read the constants of an instance, by name.

    Raises:
        Malformed: They are none.
    """
    given = entry.value.get("parameters", {})
    pairs = given.items() if isinstance(given, dict) else given
    if not isinstance(given, dict | list) or len(given) > MOST_LEVELS:
        raise Malformed("has `parameters` that are none")
    found: list[tuple[str, Constant]] = []
    for pair in pairs:
        name, value = pair if isinstance(pair, list | tuple) and len(pair) == 2 else ("", None)
        if (
            not is_identifier(name)
            or not isinstance(value, bool | int | float | str)
            or not fits(PARAMETER, value)
        ):
            raise Malformed("has `parameters` that are none")
        found.append((str(name), value))
    return tuple(found)


def wire_of(source: object, target: object) -> Wire:
    """Read a buffer between two variables, `level.variable` each.

    Raises:
        BadName: One of the two is no variable.
    """
    return Wire(member(source, "buffer"), member(target, "buffer's destination"))


NO_DATA = ".no-data"
"""Stands for the data of a system that has none: no such file is ever made."""


def needs_data(system: Description) -> None:
    """Refuse a system without a database.

    Raises:
        BadDescription: It names no database.
    """
    if system.database.name == NO_DATA:
        page = system.review()
        page.wrong(("data",), "the description names no `data`, of which the database would be made")
        raise page.bad(BadDescription)


def _check_tables(document: Document) -> None:
    """Check that a level says once where its tables are."""
    for at, level in enumerate(document.value["level"]):
        if "tables" in level and "program" in level:
            document.wrong(
                ("level", at, "program"),
                f"level `{level['name']}` has `tables`, and needs no `program`",
                "leave `program` out: what is generated for it has the level's name",
            )
        for name in level.get("parameters", {}):
            if not is_identifier(name):
                document.wrong(("level", at, "parameters", name), f"`{name}` is no constant's name")


def _check_parties(document: Document, wires: Sequence[Wire]) -> None:
    """Check that levels have names of their own, and buffers a level at an end and known parties."""
    content = document.value
    levels = [str(level["name"]) for level in content["level"]]
    for at, name in enumerate(levels):
        if name in levels[:at]:
            document.wrong(("level", at, "name"), f"there are two levels `{name}`")
    ends = list(_ends(wires))
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
    _check_readers(document, wires, levels)


def _check_readers(document: Document, wires: Sequence[Wire], levels: Sequence[str]) -> None:
    """Check that every input is filled once, and that a level reads a buffer once."""
    came: dict[str, str] = {}
    for path, wire in _placed(wires):
        if wire.target in came:
            same = came[wire.target] == wire.source
            message = f"`{wire.target}` is {'named' if same else 'filled'} twice"
            helps = (
                ("leave it out here",)
                if same
                else (f"`{came[wire.target]}` fills it, too: an input has one buffer",)
            )
            document.wrong(path, message, *helps)
        came.setdefault(wire.target, wire.source)
    for source, targets in readers(wires).items():
        for at, target in enumerate(targets):
            level = target.partition(".")[0]
            first = next(other for other in targets if other.partition(".")[0] == level)
            if level in levels and first != target:
                document.wrong(
                    ("buffers", source, at), f"level `{level}` would read `{source}` twice, in `{first}` and in `{target}`",
                    f"let its lines read `{first}` in both places",
                )  # fmt: skip


def readers(wires: Iterable[Wire]) -> dict[str, tuple[str, ...]]:
    """Return the inputs that each buffer fills, by the buffer's name."""
    found: dict[str, tuple[str, ...]] = {}
    for wire in wires:
        found[wire.source] = (*found.get(wire.source, ()), wire.target)
    return found


def _placed(wires: Iterable[Wire]) -> Iterator[tuple[KeyPath, Wire]]:
    """Yield each buffer and reader with its place: the element of a list, or the row."""
    counts: dict[str, int] = {}
    for wire in wires:
        at = counts[wire.source] = counts.get(wire.source, -1) + 1
        yield ("buffers", wire.source, at), wire


def _ends(wires: Iterable[Wire]) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield both ends of each buffer: its place, the end, the other end."""
    for path, wire in _placed(wires):
        yield path, wire.source, wire.target
        yield path, wire.target, wire.source


def _alike(party: str, levels: list[str], parties: list[str]) -> str:
    """Return the level, or the party named oftener, that is spelled nearest; empty where none is near."""
    oftener = [other for other in parties if parties.count(other) > parties.count(party)]
    swapped = [level for level in levels if sorted(level) == sorted(party)]
    near = [*swapped, *get_close_matches(party, [*levels, *oftener], n=1, cutoff=0.8)]
    return near[0] if near else ""


def places(path: Path, program: str) -> tuple[Path, Path]:
    """Return the paths where a level's program is looked for, in order."""
    return path.parent / program / f"{program}.rcs", path.parent / f"{program}.rcs"


def of_a_link(source: str, targets: Sequence[str], level: str, peer: str) -> tuple[str, str]:
    """Return what is wrong, and a help, where several would read what a level and its neighbour say to each other."""
    shown = ", ".join(f"`{target}`" for target in targets)
    return (
        f"`{source}` is one end of what `{level}` and `{peer}` say to each other, and would be read by several: {shown}",
        "orders and reports are echoed by the one reader that they are for: give the others an output of its own that they read",
    )


# --- buffers that nobody writes ---


@dataclass(slots=True)
class _Rows:
    """Makes the buffers that follow from whom levels serve and command, over which link.

        level a: `commands b : L`, level b: `serves a : L`      "a.to_b" = "b.a",       "b.to_a" = "a.from_b"
        level a: `serves fleet : L`, and no level is `fleet`    "fleet.order" = "a.fleet", "a.to_fleet" = "fleet.report"
        level a: `commands arm : L`, and no level is `arm`      "a.to_arm" = "arm.order",  "arm.report" = "a.from_arm"

    A row that is written stands: a party outside may have other names for its ends, and two levels may speak by way of one. Every buffer
    is held against the programs later, whoever named it (`system.check_fit`, `compose`).

    Attributes:
        document: The description's page, where what contradicts them is noted.
        roles: Of each level whose program is there.
    """

    document: Document
    roles: dict[str, Neighbours]
    rows: dict[str, str] = field(default_factory=dict)
    written: Mapping[str, tuple[str, ...]] = field(init=False)
    by_target: Mapping[str, str] = field(init=False)

    def __post_init__(self) -> None:
        """Read the rows of the description."""
        rows: dict[str, str | list[str]] = self.document.value.get("buffers", {})
        self.written = {
            source: (said,) if isinstance(said, str) else tuple(said) for source, said in rows.items()
        }
        self.by_target = {target: source for source, targets in self.written.items() for target in targets}

    def all(self) -> Iterator[Wire]:
        """Return the rows that follow, then those that are written."""
        levels = [str(level["name"]) for level in self.document.value["level"]]
        for at, level in enumerate(levels):
            roles = self.roles.get(level, Neighbours())
            for superior in roles.serves:
                if superior not in levels:
                    self._outside(at, (f"{superior}.order", f"{level}.{superior}"), levels)
                    self._outside(at, (f"{level}.to_{superior}", f"{superior}.report"), levels)
                elif level not in self.roles.get(superior, Neighbours()).commands:
                    self._one_sided(
                        at, f"`{level}` serves `{superior}`", superior, "commands", f"{level}.{superior}"
                    )
            for subordinate in roles.commands:
                if subordinate not in levels:
                    self._outside(at, (f"{level}.to_{subordinate}", f"{subordinate}.order"), levels)
                    self._outside(at, (f"{subordinate}.report", f"{level}.from_{subordinate}"), levels)
                else:
                    self._between(at, level, subordinate)
        self._check_read_once(levels)
        for source, target in self.rows.items():
            yield Wire(source, target)
        for source, targets in self.written.items():
            yield from (Wire(source, target) for target in targets if self.rows.get(source) != target)

    def _check_read_once(self, levels: Sequence[str]) -> None:
        """Note orders and reports that several would read."""
        link = {
            end: (level, peer)
            for level in levels
            for word in ("serves", "commands")
            for peer in getattr(self.roles.get(level, Neighbours()), word)
            for end in (f"{level}.to_{peer}", f"{level}.{peer if word == 'serves' else f'from_{peer}'}")
        }
        for source, targets in self.written.items():
            said = next((link[end] for end in (source, *targets) if end in link), None)
            if len(targets) > 1 and said is not None:
                self.document.wrong(("buffers", source, 1), *of_a_link(source, targets, *said))

    def _between(self, at: int, upper: str, lower: str) -> None:
        """Add the two rows between levels."""
        above, below = (
            self.roles[upper].commands[lower],
            self.roles.get(lower, Neighbours()).serves.get(upper),
        )
        if below is None:
            self._one_sided(at, f"`{upper}` commands `{lower}`", lower, "serves", f"{upper}.to_{lower}")
            return
        rows = (f"{upper}.to_{lower}", f"{lower}.{upper}"), (f"{lower}.to_{upper}", f"{upper}.from_{lower}")
        missing = [row for row in rows if self._wanted(*row)]
        if missing and above != below:
            self.document.wrong(
                ("level", at, "name"),
                f"`{upper}` commands `{lower}` over link `{above}`, and `{lower}` serves it over link `{below}`",
                "declare both over one link, or connect them in `[buffers]`",
            )
            return
        self.rows.update(missing)

    def _wanted(self, source: str, target: str) -> bool:
        """Tell whether a row between levels is still missing; note one that is half written, which contradicts the declarations."""
        if source not in self.written and target not in self.by_target:
            return True
        if (source in self.written) != (target in self.by_target):
            came, to = (
                (source, self.written[source][0])
                if source in self.written
                else (self.by_target[target], target)
            )
            self.document.wrong(
                ("buffers", came),
                f"`{came}` = `{to}` contradicts what the levels declare: `{source}` goes to `{target}`",
                "leave the row out: who serves and commands whom says enough",
            )
        return False

    def _one_sided(self, at: int, says: str, other: str, word: str, end: str) -> None:
        """Note that the other level lacks the declaration, where no row connects them either."""
        if end in self.written or end in self.by_target:
            return
        theirs = getattr(self.roles.get(other, Neighbours()), word)
        does = f"{word} {', '.join(f'`{name}`' for name in theirs)}" if theirs else f"{word} nobody"
        wanted = says.split("`")[1]
        if other not in self.roles:
            tried = " and ".join(
                f"`{place}`" for place in places(Path(self.document.name), self._tables(other))
            )
            self.document.wrong(
                ("level", at, "name"),
                f"{says}, and the tables of `{other}` are not there",
                f"looked for {tried}",
            )
            return
        self.document.wrong(
            ("level", at, "name"),
            f"{says}, and `{other}` {does}",
            f"write `{word} {wanted} : LINK` in the tables of `{other}`, or connect the two in `[buffers]`",
        )

    def _tables(self, name: str) -> str:
        """Return the stem of the file that a level's tables are in."""
        level = next(level for level in self.document.value["level"] if level["name"] == name)
        return str(level.get("tables", level.get("program", name)))

    def _outside(self, at: int, row: tuple[str, str], levels: list[str]) -> None:
        """Add a row to or from a party outside, unless the level's end is written."""
        source, target = row
        inner, outer = (source, target) if source.partition(".")[0] in levels else (target, source)
        if inner in self.written or inner in self.by_target:
            return
        party = outer.partition(".")[0]
        taken = {*self.written, *self.by_target, *self.rows, *self.rows.values()}
        known = self.document.value.get("outside")
        if known is not None and party not in known:
            self.document.wrong(
                ("outside",), f"`{party}`, with whom `{levels[at]}` exchanges orders and reports, is neither a level nor in `outside`",
                *nearest(party, [*levels, *known]),
            )  # fmt: skip
        elif outer in taken:
            self.document.wrong(
                ("level", at, "name"),
                f"`{outer}` would be an end of two buffers, one of them with `{inner}`",
                f"write what is at the other end of `{inner}` in `[buffers]`",
            )
        else:
            self.rows[source] = target
