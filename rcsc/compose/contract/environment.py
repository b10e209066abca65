"""What a level may take its environment to do: the contract of its buffers.

In: a system's description and its programs. Out: for each level its `Links`: who gives it orders, to whom it gives
orders, and which inputs the database fills. The names of the fields are those of section 9 of Haynes et al. (1984): an
order has `inc_command` and `input_command`, a report `inc_command_echo`, `ref_command_echo` and `status_report`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from rcsc.lang.model import Enum, Int, Kind, Level, OneTable, Program, Real, Scalar, Variable
from rcsc.run.description import BadDescription, Description

NUMBER, COMMAND = "inc_command", "input_command"
ECHO, ECHOED, STATUS = "inc_command_echo", "ref_command_echo", "status_report"


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A level, or something outside the system, with which orders and reports are exchanged.

    Attributes:
        name: Of the level, or of what stands outside.
        order: The record of this level that carries orders; `report`, the one that carries reports on them.
        outside: Whether it is no level of the system.
    """

    name: str
    order: str
    report: str
    outside: bool

    @property
    def number(self) -> str:
        """The leaf with the number of the order."""
        return f"{self.order}.{NUMBER}"

    @property
    def command(self) -> str:
        """The leaf with the command that is ordered."""
        return f"{self.order}.{COMMAND}"

    @property
    def echo(self) -> str:
        """The leaf with the number that is reported about."""
        return f"{self.report}.{ECHO}"

    @property
    def echoed(self) -> str:
        """The leaf with the command that is reported about."""
        return f"{self.report}.{ECHOED}"

    @property
    def status(self) -> str:
        """The leaf with what is reported of it."""
        return f"{self.report}.{STATUS}"


@dataclass(frozen=True, slots=True)
class Below(Neighbour):
    """A subordinate: `order` is an output of this level, `report` an input."""


@dataclass(frozen=True, slots=True)
class Above(Neighbour):
    """The superior: `order` is an input of this level, `report` an output.

    Attributes:
        numbered: Leaves of the order that are the same wherever the number is (not the number itself).
    """

    numbered: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Asked:
    """A question to the database: the same keys give the same answer."""

    into: str
    leaves: tuple[str, ...]
    keys: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Links:
    """The environment of one level.

    Attributes:
        free: Inputs that nothing is known of but their ranges.
        unread: Buffers that may be meant as orders and reports, and are not taken for such: which, and what is missing.
    """

    level: str
    above: Above | None
    below: tuple[Below, ...]
    asked: tuple[Asked, ...]
    free: tuple[str, ...]
    unread: tuple[str, ...] = ()


def leaves_under(program: Program, record: str) -> tuple[str, ...]:
    """List the leaves of a record, array or scalar variable, in declared order."""
    inside = (f"{record}.", f"{record}[")
    return tuple(str(v.name) for v in program.variables if v.name == record or v.name.startswith(inside))


def links(system: Description, level: str, program: Program) -> Links:
    """Find the environment of a level; every leaf of its order is taken to be numbered.

    Raises:
        BadDescription: An order has no report to answer it, a report no order, or one lacks a field; there are two superiors;
            or a question to the database has an answer of it as a key.
    """
    inputs = {_variable(w.target): _owner(w.source) for w in system.wires if _owner(w.target) == level}
    outputs = {_variable(w.source): _owner(w.target) for w in system.wires if _owner(w.source) == level}
    names = {str(v.name) for v in program.variables}
    levels = {spec.name for spec in system.levels}
    above: Above | None = None
    below: list[Below] = []
    used: set[str] = set()
    for record, owner in inputs.items():
        back = [made for made, to in outputs.items() if to == owner]
        if not _pairs(record, back, names):
            continue
        if f"{record}.{NUMBER}" in names:
            report = _one(back, names, ECHO, f"{level}.{record}", owner)
            order = leaves_under(program, record)
            if above is not None:
                raise BadDescription(f"`{level}` takes numbered orders in `{above.order}` and in `{record}`")
            numbered = tuple(leaf for leaf in order if leaf != f"{record}.{NUMBER}")
            _whole(level, program, record, report)
            above = Above(owner, record, report, owner not in levels, numbered)
            used |= {*order}
        elif f"{record}.{ECHO}" in names:
            order_record = _one(back, names, NUMBER, f"{level}.{record}", owner)
            _whole(level, program, order_record, record)
            below.append(Below(owner, order_record, record, owner not in levels))
            used |= {*leaves_under(program, record)}
    feeds = next((spec.feeds for spec in system.levels if spec.name == level), ())
    asked = tuple(Asked(feed.into, leaves_under(program, feed.into), feed.keys) for feed in feeds)
    answers = {leaf for one in asked for leaf in one.leaves}
    for one in asked:
        if late := sorted(answers & set(one.keys)):
            raise BadDescription(
                f"`{level}.{one.into}` is asked of the database by `{late[0]}`, which is an answer of the database itself: "
                "of the cycle before, so that the same question need not have the same answer"
            )
    used |= answers
    free = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT and v.name not in used)
    seen = [above.name] if above is not None else []
    unread = _unread(program, level, inputs, outputs, levels, {*seen, *(one.name for one in below)})
    if above is None and not isinstance(_level(program, level).tables, OneTable):
        unread = (*unread, f"no input has `{NUMBER}` and `{COMMAND}`, so that no order selects the table")
    return Links(level, above, tuple(below), asked, free, unread)


def _level(program: Program, name: str) -> Level:
    found = next((level for level in program.levels if level.name == name), None)
    if found is None:
        raise BadDescription(f"program `{program.name}` has no level `{name}`")
    return found


def _pairs(record: str, back: list[str], names: set[str]) -> bool:
    """Return whether the record and what goes back are an order and its report, with all their fields."""
    order, report = (NUMBER, COMMAND), (ECHO, ECHOED)
    for mine, other in ((order, report), (report, order)):
        if f"{record}.{mine[0]}" in names:
            ends = [record, *(one for one in back if f"{one}.{other[0]}" in names)]
            fields = [mine, *(other for _ in ends[1:])]
            return all(
                f"{end}.{part}" in names for end, parts in zip(ends, fields, strict=True) for part in parts
            )
    return False


def _unread(
    program: Program,
    level: str,
    inputs: Mapping[str, str],
    outputs: Mapping[str, str],
    levels: set[str],
    seen: set[str],
) -> tuple[str, ...]:
    """Describe what goes both ways between the level and a neighbour without being an order and its report.

    Looked at are neighbours that are levels, records of which some field is one of the protocol's, and, where the level has no
    superior, every neighbour that gives a record and takes one.
    """
    found = []
    for owner in dict.fromkeys((*inputs.values(), *outputs.values())):
        if owner in seen:
            continue
        ends = [record for wires in (inputs, outputs) for record, to in wires.items() if to == owner]
        fields = {
            leaf.rpartition(".")[2]
            for record in ends
            for leaf in leaves_under(program, record)
            if "." in leaf
        }
        both = all(
            any(to == owner and len(leaves_under(program, record)) > 1 for record, to in wires.items())
            for wires in (inputs, outputs)
        )
        if owner in levels or fields & {NUMBER, COMMAND, ECHO, ECHOED} or (both and not seen):
            missing = [part for part in (NUMBER, COMMAND, ECHO, ECHOED) if part not in fields]
            lacks = (
                f"has no {', '.join(f'`{part}`' for part in missing)}"
                if missing
                else "is not one order and one report"
            )
            said = ", ".join(f"`{record}`" for record in ends)
            found.append(f"what `{level}` and `{owner}` say to each other ({said}) {lacks}")
    return tuple(found)


def _whole(level: str, program: Program, order: str, report: str) -> None:
    """Check that a numbered order and the report on it have the other fields of the contract, and that these can be compared.

    Raises:
        BadDescription: One is missing, a number is none, or the report cannot repeat every command.
    """
    kinds = {str(variable.name): variable.type for variable in program.variables}
    needed = f"{order}.{COMMAND}", f"{report}.{ECHOED}", f"{report}.{STATUS}"
    missing = [f"`{level}.{name}`" for name in needed if name not in kinds]
    if missing:
        raise BadDescription(
            f"level `{level}`: `{order}` is numbered and `{report}` answers it, but there is no {', no '.join(missing)}"
        )
    for number in (f"{order}.{NUMBER}", f"{report}.{ECHO}"):
        if not isinstance(kinds[number], Int):
            raise BadDescription(f"level `{level}`: `{number}` counts orders, and is no whole number")
    commanded, repeated = kinds[f"{order}.{COMMAND}"], kinds[f"{report}.{ECHOED}"]
    alike = (
        commanded.members == repeated.members
        if isinstance(commanded, Enum) and isinstance(repeated, Enum)
        else (type(commanded) is type(repeated))
    )
    if not alike:
        raise BadDescription(
            f"level `{level}`: `{report}.{ECHOED}` repeats `{order}.{COMMAND}`, and is of another type"
        )


def check_ends(system: Description, programs: Mapping[str, Program]) -> None:
    """Check that both ends of each buffer have the same leaves, and that the taker admits every value that is given.

    Raises:
        BadDescription: They have not, or an input is filled twice, or something else than an input.
    """
    filled = [wire.target for wire in system.wires]
    filled += [f"{spec.name}.{feed.into}" for spec in system.levels for feed in spec.feeds]
    for end in filled:
        if filled.count(end) > 1:
            raise BadDescription(f"`{end}` is filled twice")
        if any(variable.kind is not Kind.INPUT for variable in _at_end(programs, end)):
            raise BadDescription(f"`{end}` is filled, and is no input")
    for wire in system.wires:
        given, taken = (
            {
                str(variable.name).removeprefix(_variable(end)): variable.type
                for variable in _at_end(programs, end)
            }
            for end in (wire.source, wire.target)
        )
        if not given or not taken:
            continue  # that end stands outside the levels
        if list(given) != list(taken):
            raise BadDescription(f"buffer `{wire.source}` = `{wire.target}`: the two ends have other fields")
        for part, kind in given.items():
            if not _admits(taken[part], kind):
                raise BadDescription(
                    f"buffer `{wire.source}` = `{wire.target}`: `{wire.target}{part}` does not admit all that is given"
                )


def _at_end(programs: Mapping[str, Program], end: str) -> tuple[Variable, ...]:
    """List the leaves of a buffer at one end; none where that end stands outside the levels."""
    if _owner(end) not in programs:
        return ()
    program = programs[_owner(end)]
    leaves = leaves_under(program, _variable(end))
    if not leaves:
        raise BadDescription(f"program `{program.name}` has no variable `{_variable(end)}` ({end})")
    return tuple(variable for variable in program.variables if variable.name in leaves)


def _admits(taken: Scalar, given: Scalar) -> bool:
    """Return whether every value of the given type means the same in the type that takes it."""
    if isinstance(taken, Enum) and isinstance(given, Enum):
        return taken.members == given.members
    if (isinstance(taken, Int) and isinstance(given, Int)) or (
        isinstance(taken, Real) and isinstance(given, Real)
    ):
        return taken.unit == given.unit and taken.low <= given.low and given.high <= taken.high
    return taken == given


def _one(back: list[str], names: set[str], field: str, where: str, owner: str) -> str:
    fitting = [record for record in back if f"{record}.{field}" in names]
    if len(fitting) != 1:
        raise BadDescription(
            f"`{where}` needs one buffer to `{owner}` with `{field}`, and has {len(fitting)}"
        )
    return fitting[0]


def _owner(end: str) -> str:
    return end.partition(".")[0]


def _variable(end: str) -> str:
    return end.partition(".")[2]
