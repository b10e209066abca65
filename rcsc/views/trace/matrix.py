"""The matrix of one program: for each line of its tables the code, the tests, the proofs and the requirements, as data.

In: a proved program, its plan, its emitted files, what was proved and which vectors there are. Out: a `Matrix`, in plain values.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.base.diagnostics.source import Source, Span
from rcsc.code.emit import rendered
from rcsc.code.emit.plan import Origin, Plan, PlanLine, PlanTable, Sort
from rcsc.code.emit.rendering import Piece, Rendered
from rcsc.code.testing.coverage.choose import TakenLine, taken
from rcsc.code.testing.coverage.document import VectorSet
from rcsc.code.testing.inputs.condition_text import words
from rcsc.lang.leaves import everything, spoken_of, written_by
from rcsc.lang.meaning import digest
from rcsc.lang.model import (
    BEFORE,
    Assumption,
    Call,
    Invariant,
    Level,
    Line,
    Procedure,
    ProcedureName,
    Program,
    Property,
    Standing,
    Statement,
)
from rcsc.run.link import Linked, rendered_system

OWES_NOTHING = "proved: it owes nothing"
KEPT = "proved: every cycle keeps it"
REFUTED = "refuted: `rcsc prove` shows the shortest run against it"
OPEN = "open: neither proved nor refuted, `rcsc prove` says which runs were looked at"
NOT_HERE = "not proved here: `rcsc prove` proves it of the levels together"


@dataclass(frozen=True, slots=True)
class TableProof:
    """What is proved of a table.

    Attributes:
        verdict: `proved`, as the check of the table says it.
        method: How exactly-one was decided, and whether Z3 agreed.
        rests: Assumptions and invariants that it rests on, each with its standing.
    """

    verdict: str
    method: str
    rests: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Tests:
    """The vectors of a line, by the numbers that they have in the file of `rcsc test --vectors`.

    Attributes:
        made: They show that the line is reached, or one half of what shows a condition to decide it.
        taken: Those whose call takes the line: it matches, or it runs in a step or a cycle.
        conditions: How many conditions the line states, and `shown` how many a pair of vectors shows to decide it.
        unshown: Conditions without such a pair, each with the reason.
    """

    made: tuple[int, ...] = ()
    taken: tuple[int, ...] = ()
    conditions: int = 0
    shown: int = 0
    unshown: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class TracedLine:
    """A line of a table, forward.

    Attributes:
        place: File and line of its row.
        requirements: Its own; `inherited` are those of its table.
        states: Its conditions, heading by heading.
        does: Its actions in the table's words.
        procedures: What it runs, calls included, in the order of calls.
        properties: Each that speaks of what the line changes or tests, with why.
        findings: What the check of the table says of the line.
    """

    table: str
    name: str
    place: str
    requirements: tuple[str, ...]
    inherited: tuple[str, ...]
    states: tuple[str, ...]
    does: tuple[str, ...]
    procedures: tuple[str, ...]
    properties: tuple[tuple[str, str], ...]
    findings: tuple[str, ...] = ()
    tests: Tests = Tests()

    @property
    def answers(self) -> tuple[str, ...]:
        """Requirements of the line and of its table."""
        return tuple(dict.fromkeys((*self.requirements, *self.inherited)))


@dataclass(frozen=True, slots=True)
class Declared:
    """A procedure, an assumption, an invariant or a property.

    Attributes:
        states: What it is, in words.
        used: Lines and levels that run a procedure; tables that rely on an assumption or an invariant.
        proof: What is known of it.
    """

    sort: str
    name: str
    place: str
    requirements: tuple[str, ...]
    states: str = ""
    used: tuple[str, ...] = ()
    proof: str = ""


@dataclass(frozen=True, slots=True)
class Matrix:
    """All of one program.

    Attributes:
        source: Its root file.
        digest: Of its meaning, which no layout and no requirement changes.
        files: SHA-256 of each generated file, by its path below the generated folder.
        tables: What is proved of each.
        requirements: Of tables.
        places: File and line of tables, variables, types and levels, by sort and name.
        pieces: Of all generated files, in order.
        untraced: Lines of generated files that come from nothing, as `file:line`.
        texts: Of generated files and of tables, by the paths that places have.
    """

    program: str
    source: str
    digest: str
    files: Mapping[str, str]
    tables: Mapping[str, TableProof]
    lines: tuple[TracedLine, ...]
    declared: tuple[Declared, ...]
    requirements: Mapping[str, tuple[str, ...]]
    pieces: tuple[Piece, ...]
    untraced: tuple[str, ...]
    places: Mapping[tuple[str, str], str] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)

    def answers(self, origin: Origin) -> tuple[str, ...]:
        """Give the requirements that code of an origin answers: its own, and those of all that runs it."""
        if origin.sort is Sort.LINE:
            return next(
                one.answers for one in self.lines if (one.table, one.name) == (origin.name, origin.line)
            )
        names = list(self.requirements.get(origin.name, ())) if origin.sort is Sort.TABLE else []
        for line in self.lines:
            runs = origin.sort is Sort.PROCEDURE and origin.name in line.procedures
            if runs or (origin.sort is Sort.TABLE and origin.name == line.table):
                names += line.answers
        own = (
            one.requirements for one in self.declared if (one.sort, one.name) == (origin.sort, origin.name)
        )
        return tuple(dict.fromkeys((*(name for each in own for name in each), *names)))

    def place(self, origin: Origin) -> str:
        """Give file and line of an origin in the tables; empty where it has none."""
        places = {(one.table, one.name): one.place for one in self.lines}
        places |= {(str(one.sort), one.name): one.place for one in self.declared}
        key = (origin.name, origin.line) if origin.sort is Sort.LINE else (str(origin.sort), origin.name)
        return places.get(key, self.places.get(key, ""))

    def of(self, *origins: Origin) -> tuple[Piece, ...]:
        """Give the pieces with one of these origins."""
        return tuple(piece for piece in self.pieces if piece.origin in origins)

    def code(self, line: TracedLine) -> tuple[tuple[str, tuple[Piece, ...]], ...]:
        """Give the code of a line: what runs for it alone, what matches it, what it calls."""
        own = self.of(Origin(Sort.LINE, line.table, line.name))
        table = self.of(Origin(Sort.TABLE, line.table))
        called = self.of(*(Origin(Sort.PROCEDURE, name) for name in line.procedures))
        return ("runs", own), ("matches", table), ("calls", called)


@dataclass(frozen=True, slots=True)
class ProgramFacts:
    """What others found out of a program.

    Attributes:
        tables: What is proved of each table.
        findings: Of the check, with their places.
        vectors: Of the whole C; None where they were not asked for.
        properties: What is proved of each property.
        sources: Texts of the tables, for the numbers of lines.
        across: By table and line, the requirements across levels that it has a part in, each with how.
    """

    tables: Mapping[str, TableProof]
    findings: tuple[tuple[Span, str], ...] = ()
    vectors: VectorSet | None = None
    properties: Mapping[str, str] = field(default_factory=dict)
    sources: Mapping[str, Source] = field(default_factory=dict)
    across: Mapping[tuple[str, str], Sequence[tuple[str, str]]] = field(default_factory=dict)


def matrix(plan: Plan, known: ProgramFacts) -> Matrix:
    """Build the matrix of a program from its plan and what is known of it."""
    files = rendered(plan)
    code, pieces = _code(files, ".c", ".h", ".py")
    build = _Build(plan, known)
    lines, places = tuple(build.lines()), dict(build.places())
    return Matrix(
        plan.program.name,
        plan.source,
        digest(plan.program),
        _hashed(files),
        known.tables,
        lines,
        tuple(build.declared()),
        {str(table.table.name): table.table.requirements for table in plan.tables},
        pieces,
        tuple(untraced(code, pieces)),
        places,
        code | _tables_of((*(line.place for line in lines), *places.values()), known.sources),
    )


def _tables_of(places: Iterable[str], sources: Mapping[str, Source]) -> dict[str, str]:
    """Return the texts of the files that places stand in, by their paths."""
    files = dict.fromkeys(place.rpartition(":")[0] or place for place in places)
    return {file: sources[file].text for file in files if file in sources}


def of_system(system: Linked, source: str) -> Matrix:
    """Build the matrix of the C of a whole system, all of which comes from its description."""
    name, files = system.word, rendered_system(system)
    code, pieces = _code(files, ".c", ".h")
    hashed = _hashed(files)
    return Matrix(name, source, digest(*sorted(hashed.values())), hashed, {}, (), (), {}, pieces, tuple(untraced(code, pieces)),
        {(Sort.SYSTEM, name): source}, code)  # fmt: skip


def _hashed(files: Mapping[str, Rendered]) -> dict[str, str]:
    return {path: hashlib.sha256(made.text.encode()).hexdigest() for path, made in files.items()}


def _code(files: Mapping[str, Rendered], *ends: str) -> tuple[dict[str, str], tuple[Piece, ...]]:
    """Return the texts of the files with these endings, and the pieces of all of them."""
    code = {path: made for path, made in files.items() if path.endswith(ends)}
    pieces = tuple(piece for made in code.values() for piece in made.pieces)
    return {path: made.text for path, made in code.items()}, pieces


def untraced(code: Mapping[str, str], pieces: Iterable[Piece]) -> Iterator[str]:
    """Give the lines of files that are in no piece, blank ones left out."""
    inside: dict[str, set[int]] = {}
    for piece in pieces:
        inside.setdefault(piece.file, set()).update(range(piece.first, piece.last + 1))
    for path, text in code.items():
        for at, line in enumerate(text.splitlines(), 1):
            if line.strip() and at not in inside.get(path, ()):
                yield f"{path}:{at}"


class _Build:
    """Reads one program for its matrix."""

    def __init__(self, plan: Plan, known: ProgramFacts) -> None:
        self.plan, self.known = plan, known
        self.taking = {} if known.vectors is None else dict(_taking(known.vectors))
        self.program: Program = plan.program
        self.procedures: dict[str, Procedure] = {str(one.name): one for one in self.program.procedures}
        self.spoken = {
            one.name: {leaf.removeprefix(BEFORE) for leaf in spoken_of(one)}
            for one in self.program.properties
        }

    # --- lines ---

    def lines(self) -> Iterator[TracedLine]:
        """Yield every line of every table."""
        for table in self.plan.tables:
            for line, row in zip(table.lines, table.table.every_line, strict=True):
                tests = row.tests if isinstance(row, Line) else ()
                tested = {str(leaf) for test in tests if test is not None for leaf in test.variables}
                yield self._line(table, line, row.span, tested)

    def _line(self, table: PlanTable, line: PlanLine, span: Span, tested: set[str]) -> TracedLine:
        body = [action.statement for action in line.actions]
        return TracedLine(
            str(table.table.name),
            str(line.name),
            self.place(span),
            line.requirements,
            table.table.requirements,
            line.conditions,
            tuple(dict.fromkeys(f"{action.heading}: {action.text}" for action in line.actions)),
            tuple(self.called(body)),
            (
                *self._properties(set(self.written(body)), tested),
                *self.known.across.get((str(table.table.name), str(line.name)), ()),
            ),
            tuple(told for at, told in self.known.findings if _inside(at, span)),
            self._tests(table, line),
        )

    def _properties(self, written: set[str], tested: set[str]) -> Iterator[tuple[str, str]]:
        for name, leaves in self.spoken.items():
            changed, seen = sorted(leaves & written), sorted(leaves & tested - written)
            why = [
                f"{word} {', '.join(found)}"
                for word, found in (("changes", changed), ("tests", seen))
                if found
            ]
            if why:
                yield name, "; ".join(why)

    def _tests(self, table: PlanTable, line: PlanLine) -> Tests:
        document = self.known.vectors
        if document is None:
            return Tests()
        table_name, name = str(table.table.name), str(line.name)
        vectors = next(each for each in document.tables if each.table == table_name)
        own = {at for at, vector in enumerate(vectors.vectors, 1) if vector.line == name}
        made = (
            number
            for number, kept in enumerate(document.kept, 1)
            if kept.case.entry.name == table_name and own.intersection(kept.case.shows)
        )
        unshown = [one for one in vectors.unshown if one.line == name]
        shown = {(one.column, one.condition) for one in vectors.vectors if one.line == name and one.condition}
        lacking = [one for one in unshown if one.condition]
        return Tests(
            tuple(made),
            tuple(self.taking.get((table_name, name), ())),
            len(shown) + len(lacking),
            len(shown),
            tuple(f"{one.column} {one.condition}: {one.reason}".strip() for one in unshown),
        )

    # --- procedures and conditions ---

    def declared(self) -> Iterator[Declared]:
        """Yield every procedure that something runs, every assumption, invariant and property."""
        for procedure in self.program.procedures:
            if runs := tuple(self._users(str(procedure.name))):
                yield self._named("procedure", procedure, procedure.doc, runs, OWES_NOTHING)
        for assumption in self.program.assumptions:
            relying = (
                f"table {one.name}" for one in self.program.tables if assumption.name in one.assumptions
            )
            states = assumption.doc or words(assumption.condition)
            yield self._named("assumption", assumption, states, relying, assumption.standing.value)
        for stated in self.program.environment:
            standing = Standing.WATCHED if stated.monitored else Standing.ASSUMED
            yield self._named(stated.word, stated, stated.text, (), f"{standing.value}, over time")
        for invariant in self.program.invariants:
            states = invariant.doc or words(invariant.condition)
            yield self._named("invariant", invariant, states, (), KEPT)
        for stated in self.program.properties:
            proof = self.known.properties.get(stated.name, NOT_HERE)
            changing = (line for line, body in self._bodies() if self._changes(body, stated))
            yield self._named(stated.word, stated, stated.text, changing, proof)

    def _named(
        self,
        sort: str,
        one: Procedure | Assumption | Invariant | Property,
        states: str,
        used: Iterable[str],
        proof: str = "",
    ) -> Declared:
        return Declared(
            sort, str(one.name), self.place(one.span), one.requirements, states, tuple(used), proof
        )

    def _bodies(self) -> Iterator[tuple[str, list[Statement]]]:
        """Yield each line in words, with what it does."""
        for table in self.plan.tables:
            for line in table.lines:
                yield f"{table.table.name} line {line.name}", [action.statement for action in line.actions]

    def _users(self, procedure: str) -> Iterator[str]:
        yield from (line for line, body in self._bodies() if procedure in self.called(body))
        for level in self.program.levels:
            if procedure in self.called(_calls(level)):
                yield f"level {level.name}"

    def _changes(self, body: list[Statement], stated: Property) -> bool:
        """Return whether statements may change a variable of the property."""
        return bool(self.spoken[stated.name] & set(self.written(body)))

    def called(self, body: Iterable[Statement]) -> dict[str, None]:
        """Return the procedures that statements run, calls of calls included."""
        names: dict[str, None] = {}
        waiting = [str(call.procedure) for call in everything(body) if isinstance(call, Call)]
        while waiting:
            name = waiting.pop(0)
            if name not in names:
                names[name] = None
                inner = everything(self.procedures[name].body)
                waiting += [str(call.procedure) for call in inner if isinstance(call, Call)]
        return names

    def written(self, body: list[Statement]) -> Iterator[str]:
        """Yield the leaves that statements may write, calls included; a deferred one by its own name."""
        for statement in everything(body):
            leaves = (
                self.procedures[str(statement.procedure)].writes
                if isinstance(statement, Call)
                else written_by(statement)
            )
            yield from (leaf.removesuffix(".next") for leaf in leaves)

    def places(self) -> Iterator[tuple[tuple[str, str], str]]:
        """Yield where tables, variables, levels and the program itself are declared."""
        yield from (((Sort.TABLE, str(one.name)), self.place(one.span)) for one in self.program.tables)
        yield from (((Sort.VARIABLE, one.name), self.place(one.span)) for one in self.program.declared)
        yield from (((Sort.LEVEL, one.name), self.place(one.span)) for one in self.program.levels)
        yield from (((Sort.TYPE, one.name), one.file) for one in self.program.types)
        yield (Sort.PROGRAM, self.program.name), self.program.file

    def place(self, span: Span) -> str:
        """File and line of a span."""
        source = self.known.sources.get(span.file)
        return f"{span.file}:{source.position(span.start).line}" if source is not None else span.file


def _taking(document: VectorSet) -> Mapping[TakenLine, list[int]]:
    """Return the numbers of the vectors that take each line."""
    numbers: dict[TakenLine, list[int]] = {}
    for number, lines in enumerate(taken(document.program, document.kept), 1):
        for line in dict.fromkeys(lines):
            numbers.setdefault(line, []).append(number)
    return numbers


def _calls(level: Level) -> list[Statement]:
    return [Call(ProcedureName(str(name))) for name in (*level.preprocess, *level.postprocess)]


def _inside(at: Span, span: Span) -> bool:
    return at.file == span.file and span.start <= at.start <= span.end
