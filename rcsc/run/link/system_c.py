"""A linked system to C99: header, source, CMake and pkg-config files."""

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias, assert_never

from rcsc.code.emit.c.ctext import c_type
from rcsc.code.emit.c.declarations import range_text
from rcsc.code.emit.code_tree import (
    Body,
    Cast,
    Code,
    Constant,
    Do,
    Frame,
    Function,
    Invoke,
    Leave,
    Let,
    Line,
    Name,
    Prefix,
    Set,
    Stmt,
    infix,
    repeated,
    times,
    type_bounds,
    when,
)
from rcsc.code.emit.identifiers import TRACE, comment, constant_word, guard
from rcsc.code.emit.plan import Origin, Sort
from rcsc.code.emit.rendering import Rendered, render
from rcsc.code.emit.translate import constant
from rcsc.lang.model import Admit, Array, Bool, Enum, Real, Record, Scalar, Type, Value
from rcsc.lang.restart import NUMBERS, Adopted, After, Fixed, SameAs, Stands
from rcsc.run.link.wiring import BETWEEN, IN, OUT, OWN, TICK, Buffer, End, LevelProgram, Linked, LinkedLevel
from rcsc.run.signature import REALS

Fields: TypeAlias = list[tuple[str, str]]
"""Members of a struct, or constants: the declaration of each, and its doc."""
AT, DONE, NO_SUCH = Name("at"), Constant(-1), Constant(-2)
TICKS, FIRST = Name(f"s->{TICK}"), Constant(0, "uint64_t")


def emit_system(system: Linked) -> dict[str, str]:
    """Return the files of a system, by path below the generated folder."""
    return {file: made.text for file, made in rendered_system(system).items()}


def rendered_system(system: Linked) -> dict[str, Rendered]:
    """Return the files, and where their lines come from: from the system's description, but for what is for the compiler."""
    maker = _Maker(system)
    view = maker.view()
    forms = {
        "h": "system.h.jinja",
        "c": "system.c.jinja",
        "cmake": "system.cmake.jinja",
        "pc": "system.pc.jinja",
    }
    return {
        file: render(form, view, file) for end, form in forms.items() for file in (f"c/{system.word}.{end}",)
    }


def outward(system: Linked) -> Iterator[tuple[str, str]]:
    """Yield each name in C that is visible outside the system's own source, and its kind."""
    maker = _Maker(system)
    names = [f"{system.word}.h", guard(system.word), *(f"{system.word}_{end}" for end in OWN)]
    names += [name for _, name, _ in maker.structs()]
    names += [constant.partition(" ")[0] for constant, _ in maker.constants()]
    names += [question.function for level in system.levels for question in level.questions]
    yield from ((name, "a name of the system") for name in dict.fromkeys(names))


class _Maker:
    """Builds the view of one system."""

    def __init__(self, system: Linked) -> None:
        self.system = system
        self.word = system.word
        self.origin = Origin(Sort.SYSTEM, system.word)

    def view(self) -> dict[str, object]:
        """Return the view that the templates lay out."""
        levels = self.system.levels
        programs = [program.names.program for program in self.system.programs]
        return {
            "source": comment(self.system.source),
            "word": self.word,
            "origin": self.origin,
            "guard": guard(self.word),
            "includes": [f"{program}.h" for program in programs],
            "tick": f"{constant_word(self.word, 'tick', 'ms')} = {self.system.tick_ms}",
            "level_type": "uint8_t" if len(levels) < 256 else "uint16_t",
            "constants": self.constants(),
            "structs": list(self.structs()),
            "questions": list(self._questions()),
            "privates": [function for level in levels for function in self._level(level)],
            "publics": [self._init(), self._step(), self._restart(), self._resume()],
            "programs": programs,
            "sources": [f"{word}.c" for word in (self.word, *programs)],
            "reals": any(_has_reals(program) for program in self.system.programs),
        }

    # --- declarations ---

    def constants(self) -> Fields:
        """Return the constants of the levels: their numbers, from 1."""
        every = [(f"{constant_word(self.word, 'level', 'none')} = 0", "")]
        for at, level in enumerate(self.system.levels, start=1):
            every.append(
                (f"{level.constant} = {at}", f"{comment(level.name)}, every {level.level.period_ms} ms")
            )
        return every

    def structs(self) -> Iterator[tuple[str, str, Fields]]:
        """Yield the doc of each struct, its name, its members."""
        sides = (
            (IN, "from", "What stands outside gives: fill it before each step. Until then it is what the levels begin with."),
            (OUT, "to", "What stands outside is given: as the last step left it."),
        )  # fmt: skip
        members: Fields = []
        for side, word, doc in sides:
            parties: Fields = []
            for party in self.system.parties(side):
                name = f"{self.word}_{word}_{party}_t"
                yield f"Buffers {word} {party}.", name, self._members(side, party)
                parties.append((f"{name} {party}", ""))
            if parties:
                yield doc, f"{self.word}_{side}_t", parties
                members.append((f"{self.word}_{side}_t {side}", ""))
        if between := self._members(BETWEEN, ""):
            yield "What levels give each other.", f"{self.word}_{BETWEEN}_t", between
            members.append((f"{self.word}_{BETWEEN}_t {BETWEEN}", ""))
        for level in self.system.levels:
            members.append(
                (f"{level.program.names.program}_t {level.member}", f"level {comment(level.name)}")
            )
        members.append((f"uint64_t {TICK}", "steps done"))
        doc = "The whole system in one block: copying it is copying everything that a step depends on."
        yield doc, f"{self.word}_t", members

    def _questions(self) -> Iterator[tuple[str, str, str]]:
        """What each function of the user's fills, its name, and its prototype."""
        every = [(level, question) for level in self.system.levels for question in level.questions]
        for name, head in dict.fromkeys((question.function, question.head) for _, question in every):
            fills = (
                f"{level.name}.{question.into.variable} of {', '.join(key.variable for key in question.keys)}"
                for level, question in every
                if question.head == head
            )
            yield comment("; ".join(fills)), name, head

    def _members(self, side: str, party: str) -> Fields:
        buffers = (b for b in self.system.buffers if (b.side, b.party) == (side, party))
        return [(buffer.end.declared(buffer.name), _doc(buffer, self._readers(buffer))) for buffer in buffers]

    def _readers(self, buffer: Buffer) -> list[Buffer]:
        """Return a place with each of its readers."""
        takes = (taken for level in self.system.levels for taken in level.takes)
        return [taken for taken in takes if taken.place == buffer.place] or [buffer]

    # --- functions ---

    def _function(
        self, doc: str, name: str, body: Iterable[Stmt], gives: str = "void", more: str = ""
    ) -> Function:
        head = f"{gives} {self.word}_{name}({self.word}_t *s{more})"
        return Function(doc, head, tuple(body), origin=self.origin)

    def _own(self, name: str, level: LinkedLevel) -> Do:
        return Do(Invoke(f"{self.word}_{name}_{level.member}", (Name("s"),)))

    def _level(self, level: LinkedLevel) -> Iterator[Function]:
        """Yield the functions of one level."""
        if level.takes or level.questions:
            yield self._function(
                f"Level {level.name} takes its inputs.", f"take_{level.member}", self._taken(level)
            )
        if level.gives:
            body = (
                statement
                for buffer in level.gives
                if buffer.source is not None
                for statement in _copied(
                    f"s->{buffer.place}",
                    buffer.end,
                    f"s->{level.member}.{buffer.source.path}",
                    buffer.source,
                )
            )
            yield self._function(f"Level {level.name} gives its outputs.", f"give_{level.member}", body)
        doc = f"Level {level.name} loses what it was doing: its inputs are as the buffers hold them, its orders rest."
        yield self._function(doc, f"restart_{level.member}", self._anew(level), "int32_t")
        doc = f"Level {level.name} goes on from a state."
        yield self._function(
            doc,
            f"resume_{level.member}",
            self._kept(level),
            "int32_t",
            f", const {level.program.names.program}_t *from",
        )

    def _taken(self, level: LinkedLevel) -> Iterator[Stmt]:
        """Yield copies of its buffers, then the queries that they determine: all keys are read before the first answer comes."""
        for buffer in level.takes:
            if buffer.target is not None:
                yield from _copied(
                    f"s->{level.member}.{buffer.target.path}",
                    buffer.target,
                    f"s->{buffer.place}",
                    buffer.end,
                )
        for at, question in enumerate(level.questions):
            for number, key in enumerate(question.keys):
                yield Let(
                    f"const {key.declared('').strip()}",
                    f"k{at}_{number}",
                    Name(f"s->{level.member}.{key.path}"),
                )
        for at, question in enumerate(level.questions):
            keys = (Name(f"k{at}_{number}") for number, _ in enumerate(question.keys))
            into = Name(f"s->{level.member}.{question.into.path}")
            answer = into if isinstance(question.into.kind, Array) else Prefix("&", into)
            yield Do(Invoke(question.function, (*keys, answer)))

    def _anew(self, level: LinkedLevel) -> Iterator[Stmt]:
        """Yield what `rcsc.run.adopt.restart` does without a checkpoint."""
        state, program = f"s->{level.member}", level.program.names.program
        starts = level.program.sign.restart
        yield Let(f"{program}_t", "now", Name(state))
        yield Let("int32_t", "at", DONE)
        numbered = [at for at, adopts in starts.items() if isinstance(adopts, After)]
        if numbered:
            yield Let("uint64_t", "number")
        yield Do(Invoke(f"{program}_init", (Name(f"&{state}"),)))
        for word in (*TRACE, *level.program.names.failed):
            yield Set(Name(f"{state}.{word}"), Name(f"now.{word}"))
        if level.takes or level.questions:
            yield self._own("take", level)
        yield Set(Name("now"), Name(state))
        for at, adopts in starts.items():
            yield from self._started(level, at, adopts)
        check = Set(AT, Invoke(f"{program}_check", (Name("&now"),)))
        narrow = any(_greatest(level, at) < NUMBERS - 1 for at in numbered)
        yield when(infix("<", AT, Constant(0)), check) if narrow else check
        yield when(infix("<", AT, Constant(0)), Set(Name(state), Name("now")))
        yield Leave(AT)

    def _started(self, level: LinkedLevel, at: int, adopts: Adopted) -> Iterator[Stmt]:
        program = level.program
        leaf, index = program.sign.leaves[at], program.sign.index
        place = Name(f"now.{program.path(at)}")
        match adopts:
            case Fixed(value):
                yield Set(place, _constant(program, program.plan.program.variables[at].type, value))
            case SameAs(source):
                given = Name(f"now.{program.path(index[source])}")
                same = program.sign.leaves[index[source]].c_type == leaf.c_type
                yield Set(place, given if same else Cast(leaf.c_type, given))
            case After(echo):
                number = Name("number")
                yield Set(number, Cast("uint64_t", Name(f"now.{program.path(index[echo])}")))
                if standing := _standing(level, at):
                    yield when(infix("!=", TICKS, FIRST), Set(number, Cast("uint64_t", Name(standing))))
                next_, many = Constant(1, "uint64_t"), Constant(NUMBERS, "uint64_t")
                yield Set(number, infix("%", infix("+", number, next_), many))
                if (greatest := _greatest(level, at)) < NUMBERS - 1:
                    yield when(infix(">", number, Constant(greatest, "uint64_t")), Set(AT, Constant(at)))
                yield Set(place, Cast(leaf.c_type, number))
            case Stands():
                if standing := _standing(level, at):
                    yield when(infix("!=", TICKS, FIRST), Set(place, Name(standing)))
            case _:
                assert_never(adopts)

    def _kept(self, level: LinkedLevel) -> Iterator[Stmt]:
        """Yield what `rcsc.run.adopt.restart` does with a checkpoint: only leaves are restored, not the trace."""
        state, program = f"s->{level.member}", level.program.names.program
        yield Let("const int32_t", "at", Invoke(f"{program}_check", (Name("from"),)))
        now = Let(f"{program}_t", "now", Name("*from"))
        trace = (
            Set(Name(f"now.{word}"), Name(f"{state}.{word}"))
            for word in (*TRACE, *level.program.names.failed)
        )
        yield when(infix("<", AT, Constant(0)), now, *trace, Set(Name(state), Name("now")))
        yield Leave(AT)

    def _init(self) -> Function:
        body: list[Stmt] = [
            Do(Invoke(f"{level.program.names.program}_init", (Name(f"&s->{level.member}"),)))
            for level in self.system.levels
        ]
        members = {level.name: level.member for level in self.system.levels}
        for buffer in self.system.buffers:
            end = buffer.end
            body += _copied(f"s->{buffer.place}", end, f"s->{members[end.level]}.{end.path}", end)
        doc = "Every level's initial state; each buffer holds what its reader begins with."
        return self._function(doc, "init", (*body, Set(TICKS, FIRST)))

    def _step(self) -> Function:
        levels, faulted = self.system.levels, Name("faulted")
        none = Name(constant_word(self.word, "level", "none"))
        body: list[Stmt] = [Let(f"{self.word}_level_t", "faulted", none)]
        for level in levels:
            if level.ticks > 1:
                rest = infix("%", TICKS, Constant(level.ticks, "uint64_t"))
                body.append(Let("const bool", f"due_{level.member}", infix("==", rest, FIRST)))
        for level in levels:
            if level.takes or level.questions:
                body += _due(level, self._own("take", level))
        for level in levels:
            cycle = Invoke(level.level.cycle, (Name(f"&s->{level.member}"),))
            told = Set(faulted, Name(level.constant))
            first = told if level is levels[0] else when(infix("==", faulted, none), told)
            body += _due(level, when(infix("!=", cycle, Constant(0)), first))
        for level in levels:
            if level.gives:
                body += _due(level, self._own("give", level))
        body += [Set(TICKS, infix("+", TICKS, Constant(1, "uint64_t"))), Leave(faulted)]
        doc = (
            f"One step, every {self.system.tick_ms} ms: the levels that are due take their inputs as the step before left them, run from "
            "the top down, and give their outputs. Returns the first that faulted, whose `fault` says why; the others have run."
        )
        return self._function(doc, "step", body, f"{self.word}_level_t")

    def _restart(self) -> Function:
        doc = (
            "Between two steps, a level starts again with everything lost: the order that it has counts as seen and failed, and the levels "
            "below it are told to rest. Returns -1, or what its check says of the state that it would start with; then it is as at first. "
            "-2: there is no such level."
        )
        each = (
            (level, Invoke(f"{self.word}_restart_{level.member}", (Name("s"),)))
            for level in self.system.levels
        )
        return self._function(doc, "restart", _chosen(each), "int32_t", f", {self.word}_level_t level")

    def _resume(self) -> Function:
        doc = (
            "Between two steps, a level goes on from the state that it has in a copy of the system. "
            "Returns -1, or what its check says of that state; then it has kept its own. -2: there is no such level."
        )
        each = (
            (level, Invoke(f"{self.word}_resume_{level.member}", (Name("s"), Name(f"&from->{level.member}"))))
            for level in self.system.levels
        )
        more = f", {self.word}_level_t level, const {self.word}_t *from"
        return self._function(doc, "resume", _chosen(each), "int32_t", more)


# --- small things --------------------------------------------------------------------


def _has_reals(program: LevelProgram) -> bool:
    return any(leaf.c_type in REALS for leaf in program.sign.leaves)


def _doc(buffer: Buffer, readers: Sequence[Buffer]) -> str:
    """Return the comment of a buffer: all ends, the range, and the treatment of a reading beyond it."""
    targets = ", ".join(taken.wire.target for taken in readers)
    words = [f"{buffer.wire.source} = {targets}", range_text(buffer.end.kind)]
    if buffer.side == IN and isinstance(buffer.end.kind, Scalar) and range_text(buffer.end.kind):
        words += dict.fromkeys(_beyond(taken.target) for taken in readers if taken.target is not None)
    return "; ".join(word for word in words if word)


def _beyond(end: End) -> str:
    """Return what a reader does with a reading beyond its range."""
    clamped = end.program.plan.program.variable(end.variable).admit is Admit.CLAMP
    return "pulled to the range" if clamped else "refused beyond it"


def _due(level: LinkedLevel, *body: Stmt) -> Body:
    """Return statements guarded so that they run only in the cycles of a level."""
    return (when(Name(f"due_{level.member}"), *body),) if level.ticks > 1 else body


def _chosen(each: Iterable[tuple[LinkedLevel, Code]]) -> Iterator[Stmt]:
    """Yield the statements that choose one of several calls, by the level."""
    yield Let("int32_t", "at")
    yield Frame(("switch (level) {",))
    for level, call in each:
        yield Frame((f"case {level.constant}:",), (Set(AT, call), Line("break;")))
    yield Frame(("default:",), (Set(AT, NO_SUCH), Line("break;")))
    yield Line("}")
    yield Leave(AT)


def _constant(program: LevelProgram, kind: Scalar, value: Value) -> Code:
    if isinstance(kind, Enum):
        return Name(program.names.constants[kind.name][int(value)])
    return constant(kind, value) if isinstance(kind, Bool | Real) else Constant(value, c_type(kind))


def _greatest(level: LinkedLevel, at: int) -> int:
    """Return the greatest number that the type of a leaf in C holds."""
    return type_bounds(level.program.sign.leaves[at].c_type)[1]


def _standing(level: LinkedLevel, at: int) -> str:
    """Return the member of the system's struct through which others read an output; empty where nobody does."""
    place = ""
    for buffer in level.gives:
        if buffer.source is not None and at in buffer.source.run:
            end = buffer.end
            place = f"s->{buffer.place}{end.part(end.run[at - buffer.source.run[0]])}"
    return place


Placed: TypeAlias = tuple[str, Type, LevelProgram]
"""A place, its type, and the program whose names its parts have."""


def _copied(to: str, to_end: End, of: str, of_end: End) -> Body:
    """Return the statements that copy a value to another place: at once where both have one type of C, else part by part."""
    return tuple(_parts((to, to_end.kind, to_end.program), (of, of_end.kind, of_end.program), 0))


def _parts(target: Placed, source: Placed, depth: int) -> Iterator[Stmt]:
    (to, to_kind, to_program), (of, of_kind, of_program) = target, source
    match to_kind, of_kind:
        case Array(length, to_element), Array(element=of_element):
            count = f"i{depth}"
            ends = (f"{to}[{count}]", to_element, to_program), (f"{of}[{count}]", of_element, of_program)
            yield Frame(
                ("{",), (Let("uint32_t", count), _counted(count, length, *_parts(*ends, depth + 1))), "}"
            )
        case Record(), Record() if (
            to_program.names.types[to_kind.name] != of_program.names.types[of_kind.name]
        ):
            to_names, of_names = (
                to_program.names.members[to_kind.name],
                of_program.names.members[of_kind.name],
            )
            for to_part, of_part in zip(to_kind.fields, of_kind.fields, strict=True):
                yield from _parts(
                    (f"{to}.{to_names[to_part.name]}", to_part.type, to_program),
                    (f"{of}.{of_names[of_part.name]}", of_part.type, of_program),
                    depth,
                )
        case _:
            yield Set(Name(to), Name(of))


def _counted(count: str, end: int, *body: Stmt) -> Stmt:
    """Return a loop from 0 up to the end, exclusive."""
    name, zero, step = Name(count), Constant(0, "uint32_t"), Constant(1, "uint32_t")
    goes = infix("<", name, Constant(end, "uint32_t"))
    return repeated(Set(name, zero), goes, Set(name, infix("+", name, step)), *body, bound=times(end))
