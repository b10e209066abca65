"""Requirements across levels, traced: to the lines whose writes reach what they name, through whatever buffers, and back.

In: a system, read. Out: for each requirement the lines that have a part in it, each with how. It follows who writes what from which values:
what other lines write does not reach what it names.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from rcsc.driver.requirements import KnownRequirement, Read
from rcsc.lang.leaves import everything, expressions, read_by, written_by
from rcsc.lang.model import Call, Line, Program, Property, Statement, Table
from rcsc.run.log.across import reads
from rcsc.views.trace.matrix import Declared

MOST_NAMED = 12
"""Lines of the levels around that are named where a requirement is shown."""


@dataclass(frozen=True, slots=True)
class Part:
    """A line that has a part in a requirement.

    Attributes:
        how: In words: `changes left.runs`.
        direct: Whether it changes or tests what the requirement names; else what it writes reaches that.
    """

    level: str
    table: str
    line: str
    how: str
    direct: bool

    @property
    def words(self) -> str:
        """Its level, table and line."""
        return f"{self.level}: {self.table} line {self.line}"


@dataclass(frozen=True, slots=True)
class _Flow:
    """What a line, or a module that a level calls, writes, and from what."""

    table: str
    line: str
    tests: frozenset[str]
    reads: frozenset[str]
    writes: frozenset[str]


def parts_of(its: Read, stated: Property, of: str = "") -> tuple[Part, ...]:
    """Return every line that has a part in a requirement across levels, or of one: those that change or test what it names first."""
    flows = {level: tuple(_flows(program, level)) for level, (program, _) in its.programs.items()}
    named = {level: _named(its, level, stated) for level in flows}
    if of:
        named = {level: set(reads(stated)) if level == of else set[str]() for level in flows}
    inside = _reached(its, flows, named)
    found = [
        Part(level, flow.table, flow.line, how, direct)
        for level, each in flows.items()
        for flow in each
        if flow.line
        for how, direct in _how(level, flow, named[level], inside[level])
    ]
    return tuple(sorted(found, key=lambda part: not part.direct))


def _named(its: Read, level: str, stated: Property) -> set[str]:
    """Return the leaves of a level that a requirement names, those too that are the end of a buffer which it names."""
    ends = {level: ""}
    for wire in its.described.wires:
        for end, other in ((wire.source, wire.target), (wire.target, wire.source)):
            if other.partition(".")[0] == level and end.partition(".")[0] not in its.programs:
                ends[end] = other.partition(".")[2]
    found = set()
    for name in reads(stated):
        for end, own in ends.items():
            if name.startswith(f"{end}.") or name == end:
                found.add(f"{own}{name.removeprefix(end)}".removeprefix("."))
    return found


def _reached(
    its: Read, flows: Mapping[str, Iterable[_Flow]], named: Mapping[str, set[str]]
) -> dict[str, set[str]]:
    """Return the leaves of each level on which these depend."""
    inside = {level: set(leaves) for level, leaves in named.items()}
    size = -1
    while size < (size := sum(map(len, inside.values()))):
        for level, each in flows.items():
            for flow in each:
                if flow.writes & inside[level]:
                    inside[level] |= flow.tests | flow.reads
        for wire in its.described.wires:
            (writer, _, output), (reader, _, taken) = wire.source.partition("."), wire.target.partition(".")
            for leaf in inside.get(reader, set()) if writer in inside else ():
                if leaf == taken or leaf.startswith(f"{taken}."):
                    inside[writer].add(f"{output}{leaf.removeprefix(taken)}")
    return inside


def _how(level: str, flow: _Flow, named: set[str], inside: set[str]) -> Iterator[tuple[str, bool]]:
    changed, seen = sorted(flow.writes & named), sorted(flow.tests & named - flow.writes)
    words = [
        f"{word} {', '.join(f'{level}.{leaf}' for leaf in found)}"
        for word, found in (("changes", changed), ("tests", seen))
        if found
    ]
    if words:
        yield "; ".join(words), True
    elif reaching := sorted(flow.writes & inside):
        yield f"what it writes to {', '.join(reaching)} reaches it", False


def _flows(program: Program, name: str) -> Iterator[_Flow]:
    level = next(level for level in program.levels if level.name == name)
    chooses = frozenset(str(leaf) for selector in level.selectors for leaf in read_by(selector))
    for table in program.tables:
        if table.name in level.table_names:
            yield from _of_table(program, table, chooses)
    modules = {str(module) for module in (*level.preprocess, *level.postprocess)}
    for procedure in program.procedures:
        if str(procedure.name) in modules:
            yield _Flow(
                "", "", frozenset(), *map(frozenset, (_words(procedure.reads), _words(procedure.writes)))
            )


def _of_table(program: Program, table: Table, chooses: frozenset[str]) -> Iterator[_Flow]:
    every = frozenset(str(leaf) for line in table.lines for each in line.conditions for leaf in read_by(each))
    for line in table.every_line:
        tests = every
        if isinstance(line, Line):
            tests = frozenset(str(leaf) for each in line.conditions for leaf in read_by(each))
        read, written = _of_body(program, [action.statement for action in line.actions])
        yield _Flow(str(table.name), str(line.name), tests, frozenset({*read, *chooses}), frozenset(written))


def _of_body(program: Program, body: Iterable[Statement]) -> tuple[set[str], set[str]]:
    """Return what statements may read and write, calls included; a deferred leaf by its own name."""
    procedures = {one.name: one for one in program.procedures}
    read, written = set[str](), set[str]()
    for statement in everything(body):
        read |= {str(leaf) for expr in expressions(statement) for leaf in read_by(expr)}
        if isinstance(statement, Call):
            called = procedures[statement.procedure]
            read |= set(_words(called.reads))
            written |= set(_words(called.writes))
        else:
            written |= set(_words(written_by(statement)))
    return read, written


def _words(leaves: Iterable[str]) -> Iterator[str]:
    return (str(leaf).removesuffix(".next") for leaf in leaves)


# --- for matrices ------------------------------------------------------------------------------


def declared_across(its: Read, known: Iterable[KnownRequirement]) -> Iterator[Declared]:
    """Yield what is stated across levels, as the system's matrix has it: with the lines that change it, and its verdict."""
    for one in known:
        if one.level:
            continue
        parts = parts_of(its, one.stated)
        used = [part.words for part in parts if part.direct]
        around = [part.words for part in parts if not part.direct]
        more = (
            [f"and {len(around) - MOST_NAMED} more lines that reach it"] if len(around) > MOST_NAMED else []
        )
        yield Declared(
            one.stated.word,
            one.stated.name,
            one.place,
            one.stated.requirements,
            one.stated.text,
            (*used, *(f"{words}, which reaches it" for words in around[:MOST_NAMED]), *more),
            one.words,
        )


def of_lines(its: Read, program: str) -> dict[tuple[str, str], list[tuple[str, str]]]:
    """Return for each table and line of a program the requirements across levels that it has a part in, each with how."""
    found: dict[tuple[str, str], list[tuple[str, str]]] = {}
    levels = {level for level, (its_program, _) in its.programs.items() if its_program.name == program}
    for stated in () if its.across is None else its.across[0].stated:
        for part in parts_of(its, stated):
            if part.level in levels:
                known = found.setdefault((part.table, part.line), [])
                entry = f"{stated.name} across levels", part.how
                known += [] if entry in known else [entry]
    return found
