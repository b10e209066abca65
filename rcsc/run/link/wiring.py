"""Where in C the buffers of a system are: which member of which level's state is copied from and to which place.

In: a description that fits its programs, their plans and signatures. Out: `Linked`: levels, buffers with the type and the place
of each end, and what the database is asked.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from rcsc.base.host.files.read import CheckedFields, json_of
from rcsc.code.emit.c.ctext import declared
from rcsc.code.emit.c.layout import digest
from rcsc.code.emit.c.symbols import symbols
from rcsc.code.emit.identifiers import (
    Names,
    c_word,
    constant_word,
    file_word,
    names_in,
    parameter_word,
    plain_word,
)
from rcsc.code.emit.plan import Plan
from rcsc.code.emit.scope import NameScope, c_scope
from rcsc.lang.model import Array, Record, Type
from rcsc.run.description import Description, LevelSpec, Wire
from rcsc.run.links import check_links
from rcsc.run.signature import LevelSign, Signature, signature_of
from rcsc.run.system import check_fit

IN, OUT, BETWEEN, TICK = "in", "out", "between", "tick"
"""Members of the system's struct besides its levels."""
OWN = ("t", "in_t", "out_t", "between_t", "level_t", "init", "step", "restart", "resume")
"""Ends of the C names that every system has."""
DOES = ("take", "give", "restart", "resume")
"""What is done with one level, by a function of its own."""


@dataclass(frozen=True, slots=True)
class LevelProgram:
    """The program of a level with its names in C."""

    plan: Plan
    names: Names
    sign: Signature

    def path(self, at: int) -> str:
        """Return the member of the struct that is the leaf at a position."""
        return "".join(self.names.paths[self.sign.leaves[at].name])


@dataclass(frozen=True, slots=True)
class End:
    """One end of a buffer, in a level.

    Attributes:
        level: The level's name.
        variable: As the description names it.
        path: The member of the level's struct.
        kind: Its type.
    """

    level: str
    variable: str
    program: LevelProgram
    path: str
    kind: Type

    @property
    def run(self) -> range:
        """The positions of its leaves."""
        return self.program.sign.record(self.variable)

    def declared(self, name: str) -> str:
        """Return the declaration of a variable of its type."""
        return declared(self.program.names, name, self.kind, defensive=self.program.plan.defensive)

    def part(self, at: int) -> str:
        """Return the rest of a leaf's path after that of the end."""
        return self.program.path(at).removeprefix(self.path)


@dataclass(frozen=True, slots=True)
class Buffer:
    """A buffer and one of its readers.

    Attributes:
        wire: As the description says.
        source: The end in the level that fills it; None where it is filled from outside. `target` likewise.
        end: The end whose type the buffer has: its first reader's, if that is a level.
        side: Which member of the system's struct it stands in: `in`, `out` or `between`.
        party: Whom in there it belongs to; empty in `between`.
        name: What it is called there.
    """

    wire: Wire
    source: End | None
    target: End | None
    end: End
    side: str
    party: str
    name: str

    @property
    def place(self) -> str:
        """The member of the system's struct."""
        return ".".join(word for word in (self.side, self.party, self.name) if word)


@dataclass(frozen=True, slots=True)
class Question:
    """A query to the database in every cycle of a level.

    Attributes:
        function: The user's function, by its name in C.
        keys: What it is given.
        into: Where the answer goes.
    """

    function: str
    keys: tuple[End, ...]
    into: End

    @property
    def head(self) -> str:
        """The function's prototype."""
        keys = (key.declared(f"key_{at}") for at, key in enumerate(self.keys))
        answer = "answer" if isinstance(self.into.kind, Array) else "*answer"
        return f"void {self.function}({', '.join([*keys, self.into.declared(answer)])})"


@dataclass(frozen=True, slots=True)
class LinkedLevel:
    """A level.

    Attributes:
        member: What the system's struct calls it.
        constant: The constant that names it.
        ticks: The ticks of its period.
        takes: The buffers that it reads, in the description's order; `gives` those that it fills, each once.
    """

    name: str
    member: str
    constant: str
    program: LevelProgram
    level: LevelSign
    ticks: int
    takes: tuple[Buffer, ...]
    gives: tuple[Buffer, ...]
    questions: tuple[Question, ...]


@dataclass(frozen=True, slots=True)
class Linked:
    """A system, from the top down.

    Attributes:
        word: Prefix of all its C names, and stem of its files.
        source: The description's file, as generated files name it.
        buffers: Each place once, with its first reader.
    """

    word: str
    source: str
    tick_ms: int
    levels: tuple[LinkedLevel, ...]
    buffers: tuple[Buffer, ...]

    @property
    def programs(self) -> list[LevelProgram]:
        """Each program once, by name."""
        every = {level.program.names.program: level.program for level in self.levels}
        return [every[name] for name in sorted(every)]

    def parties(self, side: str) -> list[str]:
        """Return the outside parties for which a side of the struct has members, in the description's order."""
        return list(dict.fromkeys(buffer.party for buffer in self.buffers if buffer.side == side))


def system_word(name: str, programs: Iterable[str], prefix: str = "") -> str:
    """Return the word of a system in C, which none of its programs has.

    Args:
        name: The system's.
        programs: What the programs of its levels are called in C.
        prefix: What names of files, and in C, begin with.
    """
    word = file_word(plain_word(name), prefix)
    return f"{word}_system" if word.casefold() in {program.casefold() for program in programs} else word


def linked(system: Description, plans: Mapping[str, Plan], source: str) -> Linked:
    """Return the system with all its places in the struct.

    Args:
        system: The description.
        plans: The plan of each level's program, by the level's name.
        source: The description's file, as generated files name it.

    Raises:
        BadDescription: The description does not fit the programs.
    """
    programs = {name: _program(plan) for name, plan in plans.items()}
    check_links(system, {name: plan.program for name, plan in plans.items()})
    check_fit(system, {name: program.sign for name, program in programs.items()})
    prefix = next((plan.prefix for plan in plans.values()), "")
    word = system_word(system.name, (program.names.program for program in programs.values()), prefix)
    wiring = _Wiring(programs, word)
    buffers = tuple(wiring.buffer(wire) for wire in system.wires)
    members = c_scope({IN, OUT, BETWEEN, TICK}).all(
        ((spec.name, c_word(spec.name)) for spec in system.levels),
        lambda member: ((wiring.scope, f"{word}_{does}_{member}") for does in DOES),
    )
    constants = c_scope({constant_word(word, "level", "none"), constant_word(word, "tick", "ms")})
    levels = tuple(
        _level(
            spec,
            system.tick_ms,
            (members[spec.name], constants.fresh(constant_word(word, "level", spec.name))),
            buffers,
            wiring,
        )
        for spec in system.levels
    )
    return Linked(word, source, system.tick_ms, levels, _once(buffers))


def _once(buffers: Iterable[Buffer]) -> tuple[Buffer, ...]:
    """Return the first buffer at each place: what several read stands in one."""
    every: dict[str, Buffer] = {}
    for buffer in buffers:
        every.setdefault(buffer.place, buffer)
    return tuple(every.values())


def _program(plan: Plan) -> LevelProgram:
    names = names_in(plan)
    return LevelProgram(
        plan, names, signature_of(CheckedFields(json_of(symbols(plan, names, digest(plan.program, names)))))
    )


def _level(
    spec: LevelSpec, tick_ms: int, words: tuple[str, str], buffers: Sequence[Buffer], wiring: "_Wiring"
) -> LinkedLevel:
    program = wiring.programs[spec.name]
    level = program.sign.level_of(spec.name)
    return LinkedLevel(
        spec.name,
        *words,
        program,
        level,
        level.period_ms // tick_ms,
        tuple(buffer for buffer in buffers if buffer.target is not None and buffer.target.level == spec.name),
        _once(buffer for buffer in buffers if buffer.source is not None and buffer.source.level == spec.name),
        tuple(wiring.question(spec, at) for at, _ in enumerate(spec.feeds)),
    )


@dataclass(slots=True)
class _Wiring:
    """Finds places and names them.

    Attributes:
        word: The system's.
        members: Names taken in each struct of buffers.
        parties: What each party outside is called on each side.
        functions: The function of each question, by its name and its types.
        places: The buffers that levels read, by name, with the first reader.
    """

    programs: Mapping[str, LevelProgram]
    word: str
    members: dict[str, NameScope] = field(default_factory=dict)
    parties: dict[tuple[str, str], str] = field(default_factory=dict)
    functions: dict[tuple[str, ...], str] = field(default_factory=dict)
    places: dict[str, Buffer] = field(default_factory=dict)
    scope: NameScope = field(init=False)

    def __post_init__(self) -> None:
        self.scope = c_scope({f"{self.word}_{end}" for end in OWN})

    def buffer(self, wire: Wire) -> Buffer:
        """Return a buffer with its ends and its place, which all levels that read it share."""
        source, target = self._wired(wire.source), self._wired(wire.target)
        if target is not None:
            if wire.source in self.places:
                return replace(self.places[wire.source], wire=wire, target=target)
            self.places[wire.source] = self._placed(wire, source, target)
            return self.places[wire.source]
        return self._placed(wire, source, target)

    def _placed(self, wire: Wire, source: End | None, target: End | None) -> Buffer:
        end = target or source
        assert end is not None
        if source is not None and target is not None:
            return Buffer(wire, source, target, end, BETWEEN, "", self._member(BETWEEN, wire.source))
        side, outer = (IN, wire.source) if source is None else (OUT, wire.target)
        owner, _, variable = outer.partition(".")
        if (side, owner) not in self.parties:
            self.parties[side, owner] = self._member(side, owner)
        party = self.parties[side, owner]
        return Buffer(wire, source, target, end, side, party, self._member(f"{side} {party}", variable))

    def question(self, spec: LevelSpec, at: int) -> Question:
        """Return a query of a level; queries of one name and one form are one function."""
        feed = spec.feeds[at]
        keys = tuple(self._end(spec.name, key) for key in feed.keys)
        into = self._end(spec.name, feed.into)
        form = (feed.query, *(key.declared("") for key in keys), into.declared(""))
        if form not in self.functions:
            self.functions[form] = self.scope.fresh(f"{self.word}_{feed.query}")
        return Question(self.functions[form], keys, into)

    def _member(self, struct: str, text: str) -> str:
        return self.members.setdefault(struct, c_scope()).fresh(parameter_word(text))

    def _wired(self, text: str) -> End | None:
        """Return the end that a buffer names; None where it is no level's."""
        level, _, variable = text.partition(".")
        return self._end(level, variable) if level in self.programs else None

    def _end(self, level: str, variable: str) -> End:
        """Return a variable of a level, or a part of one, which must exist."""
        program = self.programs[level]
        names, meaning = program.names, program.plan.program
        if variable in names.paths:
            kind: Type = meaning.variable(variable).type
            return End(level, variable, program, "".join(names.paths[variable]), kind)
        root, *steps = re.findall(r"\w+|\[\d+\]", variable)
        path, kind = names.roots[root], next(root_.type for root_ in meaning.declared if root_.name == root)
        for step in steps:
            if isinstance(kind, Record):
                path = f"{path}.{names.members[kind.name][step]}"
                kind = next(part.type for part in kind.fields if part.name == step)
            else:
                assert isinstance(kind, Array)
                path, kind = f"{path}{step}", kind.element
        return End(level, variable, program, path, kind)
