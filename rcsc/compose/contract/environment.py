"""Who gives a level orders, who takes its orders, and through which buffers.

In: a system's description and its programs. Out: for each level its `Links`: who gives it orders, to whom it gives
orders, and which inputs the database fills. The names of the fields are those of section 9 of Haynes et al. (1984): an
order has `inc_command` and `input_command`, a report `inc_command_echo`, `ref_command_echo` and `status_report`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rcsc.lang.leaves import is_part
from rcsc.lang.model import (
    Enum,
    Expr,
    Int,
    Kind,
    Level,
    OneTable,
    Program,
    Real,
    Role,
    Roles,
    Scalar,
    Variable,
)
from rcsc.lang.restart import COMMAND, ECHO, ECHOED, NUMBER, STATUS
from rcsc.run.description import BadDescription, Description, of_a_link
from rcsc.run.orders.roles import Neighbour


@dataclass(frozen=True, slots=True)
class Below(Neighbour):
    """A subordinate: `order` is an output of this level, `report` an input.

    Attributes:
        late: The flag that it has not echoed in time; None where it is waited for without end.
        answers_in_time: Whether the flag says so, too, of an order that it has not answered in time.
        held: The command and the status that are held of its report; empty where the level holds them itself.
        streams: Leaves of the order that are declared to change without a new number; a level that writes the protocol by hand has none.
    """

    late: str | None = None
    held: tuple[str, ...] = ()
    answers_in_time: bool = False
    streams: tuple[str, ...] = ()


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
class Given:
    """A declared assumption about one buffer that another level writes: that level owes it (`facts`).

    Attributes:
        name: The assumption.
        record: The input that it is about; `writer`, the level that writes it.
        condition: The condition, over this level's leaves.
    """

    name: str
    record: str
    writer: str
    condition: Expr


@dataclass(frozen=True, slots=True)
class Owed:
    """An assumption of another level about an output of this one, which it reads.

    Attributes:
        name: `READER.ASSUMPTION`.
        condition: The condition, over this level's leaves.
    """

    name: str
    condition: Expr


@dataclass(frozen=True, slots=True)
class Links:
    """The environment of one level.

    Attributes:
        free: Inputs of which only the range is known.
        unread: Buffers that resemble orders and reports and are not recognised, each with what is missing.
        written: Each input that a level of the system writes, with that level and its output: nothing is taken for granted of them.
        given: The assumptions that this level declares about them, and their writers owe; `owes`, those that it owes itself.
    """

    level: str
    above: Above | None
    below: tuple[Below, ...]
    asked: tuple[Asked, ...]
    free: tuple[str, ...]
    unread: tuple[str, ...] = ()
    written: tuple[tuple[str, str, str], ...] = ()
    given: tuple[Given, ...] = ()
    owes: tuple[Owed, ...] = ()

    def written_as(self, leaf: str) -> tuple[str, str, str] | None:
        """Return the input that this leaf is part of, its writer and the writer's output; None where no level writes it."""
        return next((one for one in self.written if is_part(leaf, one[0])), None)


def leaves_under(program: Program, record: str) -> tuple[str, ...]:
    """List the leaves of a record, array or scalar variable, in declared order."""
    return tuple(str(v.name) for v in program.variables if is_part(v.name, record))


def links(system: Description, level: str, program: Program) -> Links:
    """Find the environment of a level; every leaf of its order counts as numbered.

    Raises:
        BadDescription: An order has no report, a report no order, or one lacks a field; there are two superiors; or a
            database answer is itself a key.
    """
    inputs = {_variable(w.target): _owner(w.source) for w in system.wires if _owner(w.target) == level}
    outputs = tuple(
        (_variable(w.source), _owner(w.target)) for w in system.wires if _owner(w.source) == level
    )
    names = {str(v.name) for v in program.variables}
    levels = {spec.name for spec in system.levels}
    written = tuple(
        (_variable(w.target), _owner(w.source), _variable(w.source))
        for w in system.wires
        if _owner(w.target) == level and _owner(w.source) in levels
    )
    if program.roles is not None:
        declared = _declared(system, level, program, program.roles, inputs, outputs, levels)
        return replace(declared, written=written)
    above: Above | None = None
    below: list[Below] = []
    used: set[str] = set()
    for record, owner in inputs.items():
        back = [output for output, to in outputs if to == owner]
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
    asked = _asked(system, level, program)
    used |= {leaf for one in asked for leaf in one.leaves}
    free = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT and v.name not in used)
    seen = [above.name] if above is not None else []
    unread = _unread(program, level, inputs, outputs, levels, {*seen, *(one.name for one in below)})
    if above is None and not isinstance(_level(program, level).tables, OneTable):
        unread = (*unread, f"no input has `{NUMBER}` and `{COMMAND}`, so that no order selects the table")
    return Links(level, above, tuple(below), asked, free, unread, written)


def _declared(
    system: Description,
    level: str,
    program: Program,
    roles: Roles,
    inputs: Mapping[str, str],
    outputs: Sequence[tuple[str, str]],
    levels: set[str],
) -> Links:
    """Return the environment of a level that declares whom it serves and commands.

    Raises:
        BadDescription: The two buffers of a role are not both connected, and with the same neighbour.
    """
    above: Above | None = None
    below = []
    used: set[str] = set()
    for role in (*([] if roles.superior is None else [roles.superior]), *roles.subordinates):
        taken, given = (role.order, role.report) if role is roles.superior else (role.report, role.order)
        owner = inputs.get(taken)
        goes = next((to for output, to in outputs if output == given), "nobody")
        if owner is None or goes != owner:
            raise BadDescription(
                f"`{level}.{taken}` and `{level}.{given}` are one end of what `{level}` and `{role.peer}` say to each other: "
                f"the first comes from `{owner or 'nobody'}`, the second goes to `{goes}`"
            )
        used |= {*leaves_under(program, taken)}
        if role is roles.superior:
            numbered = tuple(map(str, role.numbered))
            above = Above(
                owner,
                role.order,
                role.report,
                owner not in levels,
                numbered,
                done=role.done,
                failed=role.failed,
            )
        else:
            below.append(_subordinate(program, owner, role, owner not in levels))
    asked = _asked(system, level, program)
    used |= {leaf for one in asked for leaf in one.leaves}
    free = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT and v.name not in used)
    return Links(level, above, tuple(below), asked, free)


def _subordinate(program: Program, owner: str, role: Role, outside: bool) -> Below:  # as `Neighbour` has it
    late = None if role.late is None else str(role.late)
    held = f"{role.peer}.command", f"{role.peer}.status"
    fixed = {f"{role.order}.{NUMBER}", *role.numbered}
    streams = tuple(leaf for leaf in leaves_under(program, role.order) if leaf not in fixed)
    own = late, held, role.answers_in_time, streams
    return Below(owner, role.order, role.report, outside, *own, done=role.done, failed=role.failed)


def _asked(system: Description, level: str, program: Program) -> tuple[Asked, ...]:
    """Return the questions of a level to the database.

    Raises:
        BadDescription: A question has an answer of the database as a key.
    """
    feeds = next((spec.feeds for spec in system.levels if spec.name == level), ())
    asked = tuple(Asked(feed.into, leaves_under(program, feed.into), feed.keys) for feed in feeds)
    answers = {leaf for question in asked for leaf in question.leaves}
    for question in asked:
        if late := sorted(answers & set(question.keys)):
            raise BadDescription(
                f"`{level}.{question.into}` is asked of the database by `{late[0]}`, which is an answer of the database itself: "
                "of the cycle before, so that the same question need not have the same answer"
            )
    return asked


def _level(program: Program, name: str) -> Level:
    level = next((level for level in program.levels if level.name == name), None)
    if level is None:
        raise BadDescription(f"program `{program.name}` has no level `{name}`")
    return level


def _pairs(record: str, back: list[str], names: set[str]) -> bool:
    """Return whether the record and those that go back are a complete order and report."""
    order, report = (NUMBER, COMMAND), (ECHO, ECHOED)
    for mine, other in ((order, report), (report, order)):
        if f"{record}.{mine[0]}" in names:
            ends = [record, *(returned for returned in back if f"{returned}.{other[0]}" in names)]
            fields = [mine, *(other for _ in ends[1:])]
            return all(
                f"{end}.{part}" in names for end, parts in zip(ends, fields, strict=True) for part in parts
            )
    return False


def _unread(
    program: Program,
    level: str,
    inputs: Mapping[str, str],
    outputs: Sequence[tuple[str, str]],
    levels: set[str],
    seen: set[str],
) -> tuple[str, ...]:
    """Describe each two-way exchange with a neighbour that is not an order and its report.

    Covers neighbours that are levels, records with some field of the protocol, and, if no neighbour was recognised, each
    neighbour that gives a record and takes one.
    """
    descriptions = []
    ways = inputs.items(), outputs
    for owner in dict.fromkeys((*inputs.values(), *(to for _, to in outputs))):
        if owner in seen:
            continue
        ends = [record for wires in ways for record, to in wires if to == owner]
        fields = {
            leaf.rpartition(".")[2]
            for record in ends
            for leaf in leaves_under(program, record)
            if "." in leaf
        }
        both = all(
            any(to == owner and len(leaves_under(program, record)) > 1 for record, to in wires)
            for wires in ways
        )
        if owner in levels or fields & {NUMBER, COMMAND, ECHO, ECHOED} or (both and not seen):
            missing = [part for part in (NUMBER, COMMAND, ECHO, ECHOED) if part not in fields]
            lacks = (
                f"has no {', '.join(f'`{part}`' for part in missing)}"
                if missing
                else "is not one order and one report"
            )
            records = ", ".join(f"`{record}`" for record in ends)
            descriptions.append(f"what `{level}` and `{owner}` say to each other ({records}) {lacks}")
    return tuple(descriptions)


def _whole(level: str, program: Program, order: str, report: str) -> None:
    """Check that a numbered order and its report have the other fields of the contract, with comparable types.

    Raises:
        BadDescription: A field is missing, a number is not whole, or the two commands differ in type.
    """
    kinds = program.kinds
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
    """Check that both ends of each buffer have the same leaves, and that the reader admits every value written.

    Raises:
        BadDescription: They do not, an input is filled twice, or something other than an input is filled.
    """
    filled = [wire.target for wire in system.wires]
    filled += [f"{spec.name}.{feed.into}" for spec in system.levels for feed in spec.feeds]
    for end in filled:
        if filled.count(end) > 1:
            raise BadDescription(f"`{end}` is filled twice")
        if any(variable.kind is not Kind.INPUT for variable in _at_end(programs, end)):
            raise BadDescription(f"`{end}` is filled, and is no input")
    for source, targets in system.readers().items():
        parts = {
            str(one.name).rpartition(".")[2] for end in (source, *targets) for one in _at_end(programs, end)
        }
        if len(targets) > 1 and {NUMBER, ECHO} & parts:
            raise BadDescription(of_a_link(source, targets, _owner(source), _owner(targets[0]))[0])
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
    """List the leaves of a buffer at one end; none if that end is outside the levels."""
    if _owner(end) not in programs:
        return ()
    program = programs[_owner(end)]
    leaves = leaves_under(program, _variable(end))
    if not leaves:
        raise BadDescription(f"program `{program.name}` has no variable `{_variable(end)}` ({end})")
    return tuple(variable for variable in program.variables if variable.name in leaves)


def _admits(taken: Scalar, given: Scalar) -> bool:
    """Return whether each value of the given type has the same meaning in the taking type."""
    if isinstance(taken, Enum) and isinstance(given, Enum):
        return taken.members == given.members
    if isinstance(taken, Int | Real) and isinstance(given, Int | Real) and type(taken) is type(given):
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
