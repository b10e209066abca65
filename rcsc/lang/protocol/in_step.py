"""What each table leaves behind: which state goes with which orders, as an assumption that is found and not written.

Under the protocol a state and the command that it waits for are echoed together (Haynes et al. 1984, section 9). So, once a new command
is answered, a table sees only states and commands that its own lines have set together, and those with which a level begins. A table of
two lines, `1: new; next state approaching, order goto` and `2: goto done; next state at_rest, order stop`, sees (approaching, goto),
(at_rest, stop) and nothing else.

In: a table, the leaves that it is about, and the procedures that its lines call. Out: the condition, as text. It is a guess made of
constants that lines assign: `prove` shows that it holds, and the executors watch it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from operator import contains
from typing import TypeAlias

from rcsc.lang.interval_sets import holds
from rcsc.lang.model import (
    Assign,
    Box,
    Call,
    Case,
    Default,
    Enum,
    Expr,
    For,
    If,
    Line,
    Literal,
    Local,
    Procedure,
    ReadLocal,
    Statement,
    Table,
    ToElement,
    ToLeaf,
    ToLocal,
    Value,
    key_bounds,
)

MOST_PATHS, MOST_TUPLES = 512, 20_000
"""Ways through a line, and combinations of states and commands, beyond which nothing is guessed."""

Known: TypeAlias = Value | None
"""A constant; None for a value that is not known."""
State: TypeAlias = tuple[tuple[str, Known], ...]
"""The values assigned so far on a way through a line, by leaf or local."""
Way: TypeAlias = Mapping[str, Known]
"""The values that a way through a line assigns."""
Seen: TypeAlias = tuple[int, ...]
"""The members of the leaves that an assumption is about."""


@dataclass(frozen=True, slots=True)
class Watched:
    """A leaf whose state is tracked: a deferred variable, or the command that a subordinate last echoed.

    Attributes:
        leaf: The leaf that tables read.
        written: The leaf that lines assign: the pending one, or the command of the order.
        begins: Members with which a level begins, first or anew.
        resting: The flag under which a command is the one that rests; empty for a state.
    """

    leaf: str
    written: str
    type: Enum
    begins: frozenset[int]
    resting: str = ""


@dataclass(frozen=True, slots=True)
class Flags:
    """The flags of a new command, of its answer, and of an answer put off; empty where no orders are taken."""

    new: str
    answered: str
    settling: str


class TooManyPaths(Exception):  # noqa: N818  # what happened, not an error of ours
    """A line has more ways through it than the limit."""


def in_step(
    table: Table, watched: Sequence[Watched], flags: Flags, procedures: Mapping[str, Procedure]
) -> str | None:
    """Return the condition that the states and commands which the table reads go together; None where it excludes nothing.

    Source: the least set that holds what a level begins with and is closed under the lines of the table (Kildall 1973).
    """
    if not watched or prod(len(one.type.members) for one in watched) > MOST_TUPLES:
        return None
    paths = _Paths(
        procedures, {flags.settling} | {name for one in watched for name in (one.leaf, one.written)}
    )
    try:
        ways = [(_Line.of(line), paths.through(line)) for line in _lines(table)]
    except TooManyPaths:
        return None
    seen = set(product(*(sorted(one.begins) for one in watched)))
    for line, ends in ways:
        if flags.new and line.may(flags.new, 1) and line.may(flags.answered, 0):
            for way in ends:
                if not way.get(flags.settling):
                    seen.update(_answers(line, way, watched))
    follows = [
        (_seen_by(line, watched, flags), [[_set(one, way) for one in watched] for way in ends])
        for line, ends in ways
    ]
    new = seen
    while new:  # what a tuple leads to is looked for once
        after: set[Seen] = set()
        for members, leaves in follows:
            matching = [one for one in new if all(map(contains, members, one))]
            for parts in leaves:
                for one in matching:
                    after.update(product(*(part or (at,) for part, at in zip(parts, one, strict=True))))
        new = after - seen
        seen = seen | new
    read = [at for at, one in enumerate(watched) if one.leaf in map(str, table.variables)]
    told = {tuple(one[at] for at in read) for one in seen}
    if len(told) == prod(len(watched[at].type.members) for at in read):
        return None
    return _spelled(told, [watched[at] for at in read], flags)


def _lines(table: Table) -> Iterator[Line | Default]:
    yield from table.lines
    if table.default is not None and not table.default.unreachable:
        yield table.default


# --- what a line sees ---


@dataclass(frozen=True, slots=True)
class _Line:
    """The tests of a line on one leaf alone: the values of that leaf where the line matches, box by box."""

    alone: Mapping[str, Sequence[Box]]

    @classmethod
    def of(cls, line: Line | Default) -> "_Line":
        alone: dict[str, list[Box]] = {}
        for test in () if isinstance(line, Default) else line.tests:
            if test is not None and test.box is not None and len(test.variables) == 1:
                alone.setdefault(str(test.variables[0]), []).append(test.box)
        return cls(alone)

    def may(self, leaf: str, key: int) -> bool:
        """Return whether the line can match where a leaf has a value."""
        return all(holds(box, key) for box in self.alone.get(leaf, ()))


def _seen_by(line: _Line, watched: Sequence[Watched], flags: Flags) -> list[frozenset[int]]:
    """Return the members of each leaf with which a line can match when no command is new; empty where it cannot match then."""
    if flags.new and not line.may(flags.answered, 0):
        # what the answer left is pending still, whatever the line sees
        return [frozenset(range(len(one.type.members))) for one in watched]
    if not line.may(flags.new, 0):
        return [frozenset() for _ in watched]
    return [
        frozenset(
            at
            for at in range(len(one.type.members))
            if line.may(one.leaf, at) and (at == 0 or not _rests(line, one))
        )
        for one in watched
    ]


# --- what a line leaves ---


def _answers(line: _Line, way: Way, watched: Sequence[Watched]) -> Iterator[Seen]:
    """Yield the tuples that may follow a line that answers a new command: a leaf that it does not set may still become any member."""
    parts = (
        _set(one, way) or ((0,) if _rests(line, one) else range(len(one.type.members))) for one in watched
    )
    yield from product(*parts)


def _rests(line: _Line, one: Watched) -> bool:
    return bool(one.resting) and not line.may(one.resting, 0)


def _set(one: Watched, way: Way) -> Sequence[int]:
    """Return the members that a way through a line may set; empty where it leaves the leaf."""
    name = next((name for name in (one.written, one.leaf) if name in way), None)
    if name is None:
        return ()
    value = way[name]
    return range(len(one.type.members)) if value is None else (int(value),)


# --- ways through a line ---


class _Paths:
    """Runs lines with the constants in them, both ways at each choice."""

    def __init__(self, procedures: Mapping[str, Procedure], leaves: Iterable[str]) -> None:
        self._procedures, self._leaves = procedures, frozenset(leaves)

    def through(self, line: Line | Default) -> list[dict[str, Known]]:
        """Return the assignments of each way through a line.

        Raises:
            TooManyPaths: There are more than `MOST_PATHS`.
        """
        return [dict(state) for state in self._run([action.statement for action in line.actions], {()})]

    def _run(self, statements: Iterable[Statement], states: set[State]) -> set[State]:
        for statement in statements:
            states = {after for before in states for after in self._step(statement, before)}
            if len(states) > MOST_PATHS:
                raise TooManyPaths
        return states

    def _step(self, statement: Statement, state: State) -> set[State]:
        match statement:
            case Assign(ToLeaf(name), value):
                return {self._with(state, {str(name): _constant(value, state)})}
            case Assign(ToElement(leaves)):
                return {self._with(state, dict.fromkeys(map(str, leaves)))}
            case Assign(ToLocal(name), value) | Local(name, _, value):
                return {_local(state, {name: _constant(value, state)})}
            case If(_, then, orelse):
                return self._run(then, {state}) | self._run(orelse, {state})
            case Case():
                return self._case(statement, state)
            case For(name, low, high, body):
                states = {state}
                for at in range(low, high + 1):
                    states = self._run(body, {_local(one, {name: at}) for one in states})
                return states
            case Call(name, args):
                return self._called(self._procedures[name], [_constant(arg, state) for arg in args], state)
        raise AssertionError(statement)

    def _case(self, case: Case, state: State) -> set[State]:
        subject = _constant(case.subject, state)
        states: set[State] = set()
        for arm in case.arms:
            if subject is None or subject in arm.values:
                states |= self._run(arm.body, {state})
        listed = {value for arm in case.arms for value in arm.values}
        low, high = key_bounds(case.subject.type)
        if subject not in listed and len(listed) <= high - low:
            states |= self._run(case.orelse, {state})
        return states

    def _called(self, procedure: Procedure, args: Sequence[Known], state: State) -> set[State]:
        if procedure.extern is not None:
            return {self._with(state, dict.fromkeys(map(str, procedure.writes)))}
        inside = _local(_leaves(state), {p.name: arg for p, arg in zip(procedure.params, args, strict=True)})
        own = {name: value for name, value in state if name.startswith(LOCAL)}
        return {_joined(_leaves(after), own) for after in self._run(procedure.body, {inside})}

    def _with(self, state: State, assigned: Mapping[str, Known]) -> State:
        return _joined(state, {name: value for name, value in assigned.items() if name in self._leaves})


LOCAL = "%"
"""Begins the name of a local, which no leaf does."""


def _local(state: State, assigned: Mapping[str, Known]) -> State:
    return _joined(state, {f"{LOCAL}{name}": value for name, value in assigned.items()})


def _leaves(state: State) -> State:
    return tuple((name, value) for name, value in state if not name.startswith(LOCAL))


def _joined(state: State, assigned: Mapping[str, Known]) -> State:
    return tuple(sorted({**dict(state), **assigned}.items(), key=lambda pair: pair[0]))


def _constant(expr: Expr | None, state: State) -> Known:
    match expr:
        case Literal(value):
            return value
        case ReadLocal(name):
            return dict(state).get(f"{LOCAL}{name}")
    return None


# --- the condition, as text ---


def _spelled(seen: set[Seen], watched: Sequence[Watched], flags: Flags) -> str:
    """Spell a set of tuples as alternatives, merged from the last leaf to the first."""
    alternatives = [tuple(frozenset({at}) for at in one) for one in sorted(seen)]
    for column in reversed(range(len(watched))):
        merged: dict[tuple[frozenset[int], ...], frozenset[int]] = {}
        for one in alternatives:
            others = one[:column] + one[column + 1 :]
            merged[others] = merged.get(others, frozenset()) | one[column]
        alternatives = [(*others[:column], at, *others[column:]) for others, at in merged.items()]
    words = " or ".join(filter(None, (" and ".join(_among(one, at) for one, at in zip(watched, alternative, strict=True)
                                                   if len(at) < len(one.type.members)) for alternative in alternatives)))  # fmt: skip
    return f"not {flags.new} implies {words}" if flags.new else words


def _among(one: Watched, members: frozenset[int]) -> str:
    names = [one.type.members[at] for at in sorted(members)]
    return f"{one.leaf} = {names[0]}" if len(names) == 1 else f"{one.leaf} in {{{', '.join(names)}}}"
