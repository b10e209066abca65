"""Parts of a level, run by themselves: a module or procedure, an owner, a table, or one of the level's three steps.

In: a level's program and its present values. Out: the values afterwards. Parts are run by the reference interpreter: the
executors have whole cycles only. A part outside a cycle may meet what the proofs exclude within one; that is refused,
and nothing has happened.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.typed_names import near
from rcsc.lang.interpret import (
    UNDEFINED,
    ExternError,
    ExternFailedError,
    admit,
    call,
    chosen_table,
    execute,
    failed_assumptions,
    matching_lines,
    settle,
)
from rcsc.lang.meaning import with_stops
from rcsc.lang.model import (
    AssumptionName,
    Enum,
    Level,
    Procedure,
    Program,
    Scalar,
    Table,
    Value,
    key_bounds,
    key_of,
    spell,
    value_of_text,
)
from rcsc.run.levels import RunningLevel
from rcsc.run.log.queries import known_name
from rcsc.run.signature import Values

STEPS = ("preprocess", "state_table", "postprocess")
"""The parts of a cycle, in order."""
_CALL = re.compile(r"(?P<name>(?:[\w.\-]|=>)+)\s*(?:\((?P<inside>.*)\)|(?P<after>[^()]*))$")


@dataclass(frozen=True, slots=True)
class PartRun:
    """What a part did.

    Attributes:
        values: All leaves and the trace.
        text: In words.
    """

    values: Values
    text: str


@dataclass(slots=True)
class _Part:
    """A part under way: the snapshot, and what the trace says."""

    program: Program
    level: Level
    now: dict[str, Value]
    trace: Values


def part_names(program: Program) -> Iterator[str]:
    """What can be run by name."""
    yield from STEPS
    yield from (owner.name for owner in program.owners)
    yield from (table.name for table in program.tables)
    yield from (procedure.name for procedure in program.procedures)


def call_of(text: str) -> tuple[str, tuple[str, ...]] | None:
    """A name and its arguments, as `nextstate(state_2)` or `nextstate state_2`; None where it is no call."""
    match = _CALL.match(text.strip())
    if match is None:
        return None
    inside = (match["inside"] or match["after"] or "").replace(",", " ").split()
    return match["name"], tuple(inside)


def run_part(running: RunningLevel, program: Program, name: str, args: Sequence[str]) -> PartRun:
    """Runs the part of that name on the level's present values.

    Raises:
        Refused: There is no such part, or it met what cannot be.
    """
    meant = known_name(name, part_names(program))
    if meant is None:
        raise Refused(
            Code.SHELL_NAME,
            f"level `{running.name}` has no module, procedure, owner or table `{name}`",
            *near(name, part_names(program)),
        )
    names = [leaf.name for leaf in running.sign.leaves]
    stops = {
        table: tuple(map(AssumptionName, assumptions)) for table, assumptions in running.sign.stops.items()
    }
    program = with_stops(program, stops)
    level = next(level for level in program.levels if level.name == running.name)
    part = _Part(program, level, dict(zip(names, running.values, strict=False)), running.values[len(names) :])
    try:
        text = _run(part, meant, args)
    except ExternError as error:
        raise Refused(
            Code.SHELL_PART, f"an extern procedure in `{meant}` gave no value for `{error}`"
        ) from error
    except ExternFailedError as error:
        raise Refused(
            Code.STATE_TABLE_ERROR, f"an extern procedure in `{meant}` failed: {error}: nothing was changed"
        ) from error
    except (*UNDEFINED, KeyError) as error:
        raise Refused(
            Code.SHELL_PART,
            f"`{meant}` divides by zero, leaves an array or takes the whole number of a NaN: nothing was changed",
        ) from error
    _within(part, running, meant)
    return PartRun((*(part.now[leaf] for leaf in names), *part.trace), text)


def _run(part: _Part, name: str, args: Sequence[str]) -> str:
    program = part.program
    procedure = next((procedure for procedure in program.procedures if procedure.name == name), None)
    if procedure is not None:
        call(program, name, _arguments(procedure, args), part.now)
        return f"procedure `{name}`"
    if args:
        raise Refused(Code.SHELL_COMMAND, f"`{name}` takes no arguments")
    owner = next((owner for owner in program.owners if owner.name == name), None)
    if owner is not None:
        return f"owner `{name}`: {', '.join(_in_order(part, _flat(program, owner.members)))}"
    table = next((table for table in program.tables if table.name == name), None)
    return _match(part, table) if table is not None else _step(part, name)


def _step(part: _Part, name: str) -> str:
    if name == "preprocess":
        admitted = admit(part.program, part.now)
        if isinstance(admitted, str):
            now = spell(part.program.variable(admitted).type, part.now[admitted])
            message = f"input `{admitted}` = {now} is refused: it lies outside its range"
            raise Refused(Code.STATE_TABLE_ERROR, message)
        part.now = admitted
        settle(part.program, part.now)
        return f"preprocess: {', '.join(_in_order(part, part.level.preprocess)) or 'nothing'}"
    if name == "postprocess":
        return f"postprocess: {', '.join(_in_order(part, part.level.postprocess)) or 'nothing'}"
    return "; ".join(
        _match(part, chosen_table(part.program, choice, part.now)) for choice in part.level.choices
    )


def _saw(part: _Part, table: Table) -> str:
    """What a table sees now, as a witness."""
    seen = (
        f"`{name}` = {spell(part.program.variable(name).type, part.now[name])}" for name in table.variables
    )
    return f"; it saw {', '.join(seen)}" if table.variables else ""


def _in_order(part: _Part, procedures: Sequence[str]) -> Sequence[str]:
    for procedure in procedures:
        call(part.program, procedure, [], part.now)
    return procedures


def _flat(program: Program, members: Sequence[str]) -> list[str]:
    """Return the procedures of an owner, and of the owners in it."""
    owners: Mapping[str, Sequence[str]] = {owner.name: owner.members for owner in program.owners}
    return [
        name
        for member in members
        for name in (_flat(program, owners[member]) if member in owners else [member])
    ]


def _match(part: _Part, table: Table) -> str:
    """Run the matching line; report assumptions that fail, and keep them in the trace."""
    failed = failed_assumptions(part.program, table, part.now)
    stopped = [name for name in failed if name in table.stops]
    if stopped:
        message = f"table `{table.name}`: assumption `{stopped[0]}` fails, on which the safety of its lines rests{_saw(part, table)}"
        raise Refused(Code.STATE_TABLE_ERROR, message)
    matching = matching_lines(table, part.now)
    warned = f"; assumptions that do not hold: {', '.join(failed)}" if failed else ""
    if len(matching) > 1:
        raise Refused(
            Code.STATE_TABLE_ERROR,
            f"table `{table.name}`: lines {', '.join(matching)} match{warned}{_saw(part, table)}",
        )
    if not matching and table.default is None:
        raise Refused(
            Code.STATE_TABLE_ERROR, f"table `{table.name}`: no line matches{warned}{_saw(part, table)}"
        )
    at = next((at for at, line in enumerate(table.lines) if line.name in matching), len(table.lines))
    line = table.lines[at] if matching else table.default
    assert line is not None  # it was looked at above
    kept = part.program.line_leaves.get(table.name)
    if kept is not None:
        part.now[kept] = at + 1
    execute(part.program, [action.statement for action in line.actions], part.now, {})
    # The line is kept in the trace as the level's own only where it is of the table that the level would run last.
    own = chosen_table(part.program, part.level.tables, part.now)
    part.trace = (at, 0, -1, part.trace[-1]) if table is own else part.trace
    done = "; ".join(
        text for _, text in dict.fromkeys((action.heading, action.text) for action in line.actions)
    )
    return f"table `{table.name}`, line {line.name}: {done or 'nothing'}{warned}"


def _arguments(procedure: Procedure, given: Sequence[str]) -> list[Value]:
    if len(given) != len(procedure.params):
        wanted = ", ".join(param.name for param in procedure.params) or "none"
        many = f"{len(procedure.params)} argument{'s' * (len(procedure.params) != 1)}"
        raise Refused(Code.SHELL_COMMAND, f"`{procedure.name}` takes {many}: {wanted}")
    return [
        _argument(param.name, param.type, text) for param, text in zip(procedure.params, given, strict=True)
    ]


def _argument(name: str, kind: Scalar, text: str) -> Value:
    """The value that a text means for a parameter."""
    members = kind.members if isinstance(kind, Enum) else ()
    value = value_of_text(kind, known_name(text, members) or text)
    if value is None:
        raise Refused(Code.SHELL_VALUE, f"`{text}` is no value of parameter `{name}`", *near(text, members))
    return value


def _within(part: _Part, running: RunningLevel, name: str) -> None:
    """Refuse a value out of its declared range: only whole cycles are proved to stay within it."""
    for leaf in part.program.variables:
        value = part.now[leaf.name]
        if value == running.value(leaf.name):
            continue
        low, high = key_bounds(leaf.type)
        if not low <= key_of(leaf.type, value) <= high:
            raise Refused(
                Code.SHELL_PART,
                f"`{name}` would set `{running.name}.{leaf.name}` to {spell(leaf.type, value)}, out of its range",
                "nothing was changed; within a cycle the proof excludes it",
            )
