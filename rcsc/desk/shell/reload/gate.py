"""Judge whether a running level may take new tables: what they change, and whether the next cycle meets it.

In: the level as it runs and as it would be, both with what they mean, and the buffers. Out: `Judged`, or a refusal where the
proofs of the new tables do not speak of the present state.

The next cycle is run on both executors from the present state, with the inputs that the buffers hold, and both are put back.
Later cycles are covered by the difference (`rcsc.views.diff`), which is proved. A level with extern procedures is not tried out:
they may have effects.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.render import plain
from rcsc.lang.hidden import hidden
from rcsc.lang.interpret import (
    Fault,
    admit,
    call,
    chosen_table,
    holds,
    matching_lines,
    run_stage,
    settle,
)
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Enum, Expr, Kind, Level, Program, Table, Value, pending, spell
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import UndecidedError
from rcsc.run.buffers import Buffers
from rcsc.run.levels import RunningLevel
from rcsc.run.signature import FAULTS, Signature, Values
from rcsc.views.diff.changes.difference import Difference, ProgramDifference
from rcsc.views.diff.compare import compare
from rcsc.views.diff.present import Met, knows, within_reach
from rcsc.views.diff.rows import headline, rows

REACH_STEPS = 5_000_000
"""Budget for deciding whether some input leads to a change; out of budget means yes."""
MOST_LEAVES = 12
"""Leaves that are shown of a cycle."""


@dataclass(frozen=True, slots=True)
class Running:
    """A level and what its tables mean.

    Attributes:
        program: None where the sources of what runs are not known.
    """

    level: RunningLevel
    program: Program | None


@dataclass(frozen=True, slots=True)
class Judged:
    """What a reload would do.

    Attributes:
        notes: The difference, and which of it the present state can meet.
        doubts: Why the user must confirm it; empty where the next cycle does as before.
    """

    notes: tuple[str, ...]
    doubts: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Tried:
    """A level's next cycle.

    Attributes:
        taken: All leaves and the trace when the inputs have been taken.
        left: The same after the cycle; as taken where it was not run.
    """

    taken: Values
    left: Values


def judge(old: Running, new: RunningLevel, program: Program, buffers: Buffers) -> Judged:
    """Compare the new tables with the old, in general and in the present state.

    Args:
        old: What runs.
        new: What would run, in the same state.
        program: What its tables mean.
        buffers: As they stand.

    Raises:
        Refused: An assumption of the new tables does not hold, or they do not know a state.
    """
    quiet = not _extern(program)
    tried = _tried(new, buffers, run=quiet)
    if quiet:
        _proved(old, new, program, tried.taken)
    if old.program is None:
        return Judged((), ("the sources of what runs are not known, so that the two cannot be compared",))
    difference = compare(new.name, old.program, program, Options(), follow=True)
    met = _met(difference, new, program) if difference.changed else ()
    notes = (*_difference(difference), *_reach(difference, met))
    if difference.undecided:
        return Judged(notes, (f"the solver gave up on {', '.join(difference.undecided)}",))
    if not quiet or _extern(old.program):
        why = "the next cycle was not tried out, and assumptions not looked at: an extern procedure might do something"
        return Judged(notes, (why,) if met or not quiet else ())
    at = old.level.executor.check()
    if at >= 0:
        wrong = old.level.sign.unfit(at, old.level.values)
        return Judged(notes, (f"what runs was not tried out, as it cannot go on from this state: {wrong}",))
    left = _tried(old.level, buffers, run=True).left
    added = hidden(old.program) | hidden(program)
    return Judged(notes, tuple(_otherwise(met, old.level, new, (left, tried.left), added)))


# --- the next cycle --------------------------------------------------------------------


def _extern(program: Program) -> bool:
    return any(procedure.extern is not None for procedure in program.procedures)


def _tried(level: RunningLevel, buffers: Buffers, *, run: bool) -> _Tried:
    """The level's next cycle; the level is left as it was."""
    kept = level.values
    level.take(buffers)
    taken = level.executor.values()
    if run:
        level.run()
    left = level.values if run else taken
    level.put_back(kept)
    level.values = kept  # the trace too, which the executor does not take back
    return _Tried(taken, left)


def tables_tried(
    program: Program, level: str, began: Mapping[str, Value]
) -> Iterator[tuple[Table, Mapping[str, Value]]]:
    """Yield each table that a cycle tries, with the values that it sees.

    Source: `rcsc.lang.interpret.cycle`, up to where the last table looks.

    Args:
        program: The level's.
        level: Its name.
        began: All leaves: states and outputs as the cycle before left them, inputs as this one takes them.

    Raises:
        Refused: An input is refused, and no table is tried.
    """
    own = model_of(program, level)
    now = admit(program, began)
    if isinstance(now, str):
        raise Refused(Code.STUDIO, f"no table was tried: input `{now}` was refused")
    settle(program, now)
    for procedure in own.preprocess:
        call(program, procedure, [], now)
    for choice in own.choices:
        table = chosen_table(program, choice, now)
        yield table, dict(now)
        if choice is not own.choices[-1] and run_stage(program, table, now) is not Fault.OK:
            return


def model_of(program: Program, name: str) -> Level:
    """The level as its program has it."""
    return next(level for level in program.levels if level.name == name)


def _otherwise(
    met: Sequence[Met],
    old: RunningLevel,
    new: RunningLevel,
    left: tuple[Values, Values],
    added: Collection[str],
) -> Iterator[str]:
    """Yield what the next cycle would leave otherwise; nothing where both leave the same.

    States that the compiler adds, `added`, are compared by nobody: they may be fed with something else.
    """
    old_words, new_words = (
        _words(level.sign, values) for level, values in zip((old, new), left, strict=True)
    )
    both = (name for name in old_words if name in new_words and name not in added)
    differing = [name for name in both if old_words[name] != new_words[name]]
    faults = [
        FAULTS[int(values[len(level.sign.leaves) + 1])]
        for level, values in zip((old, new), left, strict=True)
    ]
    if not differing and faults[0] == faults[1]:
        return
    if not met:
        raise RuntimeError(
            f"level {new.name}: nothing is said to differ in the next cycle, but {differing} do"
        )
    before, after = (_ran(level, values) for level, values in zip((old, new), left, strict=True))
    yield f"in the present state the next cycle would do otherwise: {before} before, {after} now"
    for name in differing[:MOST_LEAVES]:
        yield f"  {name}: {old_words[name]} -> {new_words[name]}"
    if len(differing) > MOST_LEAVES:
        yield f"  and {len(differing) - MOST_LEAVES} more"


def _words(sign: Signature, values: Values) -> dict[str, str]:
    return {leaf.name: leaf.shown(value) for leaf, value in zip(sign.leaves, values, strict=False)}


def _ran(level: RunningLevel, values: Values) -> str:
    """`table position, line 4`, after those that ran before it in the cycle; the fault where it met one."""
    sign = level.sign
    table = sign.table_of(level.level, values)
    at, fault = int(values[len(sign.leaves)]), int(values[len(sign.leaves) + 1])
    lines = sign.tables.get(table, ())
    before = "".join(
        f"table `{name}`, line `{line}`; " for name, line in sign.lines_before(level.level, values)
    )
    last = FAULTS[fault] if fault else f"line `{lines[at]}`" if 0 <= at < len(lines) else "no line"
    return f"{before}table `{table}`, {last}"


# --- the difference --------------------------------------------------------------------


def _difference(difference: ProgramDifference) -> Iterator[str]:
    """Render the difference as `rcsc diff` does."""
    whole = Difference("what runs", "what is there now", (difference,))
    yield from plain(rows(whole, quiet=True)).splitlines()
    yield headline(whole)


def _met(difference: ProgramDifference, new: RunningLevel, program: Program) -> tuple[Met, ...]:
    now = {leaf.name: value for leaf, value in zip(new.sign.leaves, new.values, strict=False)}
    return within_reach(difference, program, model_of(program, new.name), now, Options(steps=REACH_STEPS))


def _reach(difference: ProgramDifference, met: Sequence[Met]) -> Iterator[str]:
    """Say which changes the next cycle can meet with some inputs."""
    if difference.undecided or not difference.changed:
        return
    if met:
        yield f"within reach of the present state, with some inputs: {'; '.join(_met_parts(met))}"
    else:
        yield "out of reach of the present state: whatever the inputs, the next cycle does as before"


def _met_parts(met: Sequence[Met]) -> list[str]:
    """Each part once, with what matched before and matches now."""
    parts: dict[str, None] = {}
    for reachable in met:
        name = (
            f"{reachable.part.what} {reachable.part.name}"
            if "`" in reachable.part.name
            else f"{reachable.part.what} `{reachable.part.name}`"
        )
        if reachable.change is None:
            parts[f"{name}, {', '.join(reachable.part.notes)}"] = None
        elif reachable.part.what == "table":
            lines = dict.fromkeys((reachable.change.before, reachable.change.after))
            parts[f"{name}, {' -> '.join(lines)}"] = None
        else:
            parts[name] = None
    return list(parts)


# --- what the proofs of the new tables speak of ---------------------------------------


def _proved(old: Running, new: RunningLevel, program: Program, taken: Values) -> None:
    """Refuse a next cycle that the proof of its table does not cover; nothing is looked at where an input is refused first."""
    began = {leaf.name: value for leaf, value in zip(new.sign.leaves, taken, strict=False)}
    try:
        *_, looked = tables_tried(program, new.name, began)
    except Refused:
        return
    _in_proof(new, program, *looked)
    _known(old, new, program, *looked)


def _in_proof(level: RunningLevel, program: Program, table: Table, now: Mapping[str, Value]) -> None:
    """Refuse where the next cycle's table assumes what does not hold."""
    for assumption in program.assumptions:
        if assumption.name in table.assumptions and not holds(assumption.condition, now):
            raise Refused(
                Code.SHELL_RELOAD,
                f"level `{level.name}` keeps its tables: assumption `{assumption.name}` of table `{table.name}` does not hold of the "
                f"present state: {witness(program, assumption.condition, now)}",
                "the table was proved for other states: let the level come to one of those, or set what the assumption speaks of",
            )


def witness(program: Program, condition: Expr, now: Mapping[str, Value]) -> str:
    """The leaves that a condition reads, as they are."""
    names = dict.fromkeys(read_by(condition))
    return ", ".join(f"{name} = {spell(program.variable(name).type, now[name])}" for name in names)


def _known(old: Running, new: RunningLevel, program: Program, table: Table, now: Mapping[str, Value]) -> None:
    """Refuse a present or pending state that the old table had a line for and the new one has not."""
    for variable in program.variables:
        if (
            variable.kind is not Kind.STATE
            or not isinstance(variable.type, Enum)
            or variable.name not in table.variables
        ):
            continue
        told = [] if matching_lines(table, now) else [("is", now[variable.name])]
        if variable.deferred_until is not None and now[pending(variable.name)] != now[variable.name]:
            told.append(("is to be", now[pending(variable.name)]))
        for word, value in told:
            state = spell(variable.type, value)
            if not _has_line(program, table.name, variable.name, state) and (
                old.program is None or _has_line(old.program, table.name, variable.name, state)
            ):
                raise Refused(
                    Code.SHELL_RELOAD,
                    f"level `{new.name}` keeps its tables: `{variable.name}` {word} {state}, for which table `{table.name}` "
                    "has no line",
                    f"add a line for {state}, or let the level leave it first",
                )


def _has_line(program: Program, name: str, leaf: str, state: str) -> bool:
    """Return whether the table of that name is known to have a line for a state."""
    table = next((table for table in program.tables if table.name == name), None)
    kinds = {str(variable.name): variable.type for variable in program.variables}
    kind = kinds.get(leaf)
    if table is None or not isinstance(kind, Enum) or state not in kind.members:
        return False
    try:
        return knows(program, table, leaf, kind.members.index(state), Options())
    except UndecidedError:
        return False
