"""Cases that are tried first, without a solver: what every program has, what tables say, and what is drawn.

In: a program, the plan and the symbols of its C, and MC/DC vectors of its tables. Out: cases, the cheapest kind
first; most lead nowhere new and are dropped (`choose`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from random import Random

from rcsc.code.emit.plan import Coded, Cuts, Direct, Group, Plan, Truth
from rcsc.code.testing.coverage.case import (
    MODES,
    Answer,
    Case,
    Entry,
    Expected,
    ends_of,
    outside_of,
    ran,
    refused_at,
    runs,
)
from rcsc.code.testing.coverage.goals import Hit, bits_of
from rcsc.code.testing.executors.externs import results
from rcsc.code.testing.executors.reference_file import inputs
from rcsc.code.testing.executors.sessions import Stimuli
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.inputs.sampling import declarations, sessions
from rcsc.code.testing.inputs.snapshot import InputSearch, Missing
from rcsc.code.testing.inputs.vectors import Vector, Vectors
from rcsc.lang.interpret import Answers, initial
from rcsc.lang.model import (
    Apply,
    Bool,
    Expr,
    Kind,
    Literal,
    Op,
    Procedure,
    Program,
    Read,
    Real,
    Snapshot,
    Table,
    Value,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)

MOST_ENTRIES = 256
"""Of one table of masks, that are tried beside each line; `rcsc test` compares all that there are."""


@dataclass(frozen=True, slots=True, eq=False)
class Session:
    """Cycles of one step or level, one after the other.

    Attributes:
        cases: One a cycle; the state of each is what the one before left, with new inputs.
        expected: What each must give.
    """

    entry: Entry
    cases: tuple[Case, ...]
    expected: tuple[Expected, ...]


def always(program: Program, symbols: Symbols, *, reals: bool) -> Iterator[Case]:
    """What every program has: `init`, `check` on each bad state, and each input refused beyond each end of its range.

    Args:
        program: The program.
        symbols: Of its C.
        reals: Whether the C looks how the machine computes reals.
    """
    start = initial(program)
    yield Case(Entry("init"), start, origin="initial state")
    yield Case(Entry("check"), start, origin="initial state")
    yield Case(Entry("check"), start, origin="a state of other tables", foreign=True)
    yield from _at_ends(program)
    for variable in program.variables:
        for end, value in outside_of(variable, symbols.c_type(variable.name)).items():
            if variable.kind is not Kind.INPUT or isinstance(variable.type, Bool):
                words = f"{variable.name} {end} its range"
                yield Case(Entry("check"), {**start, variable.name: value}, origin=words)
    cycles = runs(program)
    unsafe = _unsafe(program)
    yield from _all_beyond(program, symbols)
    for mode in MODES if reals else ():
        yield Case(cycles[-1], unsafe, origin=f"a machine that rounds {mode}", mode=mode)
    for variable in (v for v in inputs(program) if not isinstance(v.type, Bool)):
        for end, value in outside_of(variable, symbols.c_type(variable.name)).items():
            for entry in cycles:
                yield Case(entry, {**unsafe, variable.name: value}, origin=f"{variable.name} {end} its range")


def _all_beyond(program: Program, symbols: Symbols) -> Iterator[Case]:
    """All that can be beyond its range is, at once: the first is told."""
    outside = {
        v.name: next(iter(outside_of(v, symbols.c_type(v.name)).values()), None) for v in program.variables
    }
    given = {str(v.name) for v in inputs(program)}
    states = {str(name): value for name, value in outside.items() if value is not None and name not in given}
    start = initial(program)
    yield Case(Entry("check"), {**start, **states}, origin="every variable beyond its range")
    readings: Snapshot = {
        str(v.name): value
        for v in inputs(program)
        if not isinstance(v.type, Bool) and (value := outside[v.name]) is not None
    }
    yield from (
        Case(entry, {**start, **readings}, origin="every input beyond its range")
        for entry in runs(program)[-1:]
    )


def _at_ends(program: Program) -> Iterator[Case]:
    """Every variable at an end of its range, which is let pass; and reals of -0.0."""
    start = initial(program)
    cycles = runs(program)
    given_leaves = inputs(program)
    for at, which in enumerate(("least", "greatest")):
        ends: Snapshot = {str(v.name): ends_of(v.type)[at] for v in program.variables}
        yield Case(Entry("check"), ends, origin=f"every variable {which}")
        given: Snapshot = {**start, **{str(v.name): ends[v.name] for v in given_leaves}}
        yield from (Case(entry, given, origin=f"every input {which}") for entry in cycles)
    reals = [(str(v.name), v.type) for v in given_leaves if isinstance(v.type, Real)]
    zeros = {name: -0.0 for name, kind in reals if kind.low <= 0 <= kind.high}
    for entry in cycles[:1] if zeros else ():
        yield Case(entry, {**start, **zeros}, origin="inputs of -0.0, which is taken as 0.0")


def _unsafe(program: Program) -> Snapshot:
    """The initial state, its outputs other than after a fault, where that is a state to go on from."""
    start = initial(program)
    shown = {
        str(v.name): next((end for end in ends_of(v.type) if end != v.safe), v.safe)
        for v in program.variables
        if v.safe is not None
    }
    other = {**start, **shown}
    return other if refused_at(program, other) < 0 else start


def untrusted(program: Program, refused: Sequence[Case]) -> Iterator[Case]:
    """For C that trusts no state: cycles on states that `check` refuses, and truths that are bytes above 1.

    Args:
        program: The program.
        refused: Cases of `check` that it refuses; each is given to some cycle, and each cycle some of them.
    """
    start = _unsafe(program)
    cycles = runs(program)
    for at in range(max(len(refused), len(cycles))):
        case = refused[at % len(refused)]
        yield replace(case, entry=cycles[at % len(cycles)])
    for variable in inputs(program):
        if isinstance(variable.type, Bool):
            before = {**start, variable.name: 2}
            yield from (Case(entry, before, origin=f"{variable.name} above its range") for entry in cycles)


def of_tables(search: InputSearch, plan: Plan, tables: Sequence[Vectors]) -> Iterator[Case]:
    """The tables' own vectors, and each class of each leaf."""
    for planned, vectors in zip(plan.tables, tables, strict=True):
        table = planned.table
        for kind in ("line", "lines", "step"):
            for at, vector in _distinct(vectors.vectors):
                words = f"line {vector.line}: {vector.condition} {vector.purpose}" if vector.condition else ""
                origin = words or f"line {vector.line} reached"
                shows = at if kind == "line" else ()
                yield Case(Entry(kind, str(table.name)), vector.snapshot, origin=origin, shows=shows)
        for leaf, classes in _classes(planned.matcher.groups):
            for value in classes:
                given = search.find(
                    [(_equals(search.program.variable(leaf), value), True), *_given(search.program, table)]
                )
                if not isinstance(given, Missing):
                    yield Case(Entry("line", str(table.name)), given, origin=f"{leaf} looked up")


def of_masks(plan: Plan, tables: Sequence[Vectors]) -> Iterator[tuple[Case, Sequence[Hit]]]:
    """Every entry of every mask, beside each line: its own vector with other values of what the entry is looked up by.

    Gives each with the bits that it shows, so that who has them already need not play it.
    """
    for planned, vectors in zip(plan.tables, tables, strict=True):
        name = str(planned.table.name)
        reached = {v.line: v.snapshot for v in vectors.vectors if v.purpose == "reach"}
        for group in planned.matcher.groups:
            leaves = {
                str(probe.index.leaf): probe.index for probe in group if not isinstance(probe.index, Truth)
            }
            ways = list(islice(product(*map(_values, leaves.values())), MOST_ENTRIES))
            for snapshot, way in product(reached.values(), ways):
                before = {**snapshot, **dict(zip(leaves, way, strict=True))}
                bits = [("bit", name, *bit) for bit in bits_of(planned.matcher, before)]
                words = ", ".join(f"{leaf} {value}" for leaf, value in zip(leaves, way, strict=True))
                yield Case(Entry("line", name), before, origin=f"mask of {words}"), bits


def of_truths(search: InputSearch, plan: Plan) -> Iterator[Case]:
    """Every entry of masks that are looked up by conditions, by itself and where the rest of each line holds."""
    for planned in plan.tables:
        table = planned.table
        rests: list[list[tuple[Expr, bool]]] = [[]]
        rests += [
            [(t.condition, True) for t in line.tests if t is not None and t.box is not None]
            for line in table.lines
        ]
        for group in planned.matcher.groups:
            truths = [probe.index.condition for probe in group if isinstance(probe.index, Truth)]
            ways = product((False, True), repeat=len(truths)) if truths else ()
            impossible = set[tuple[bool, ...]]()
            for way, rest in islice(product(ways, rests), MOST_ENTRIES):
                if way in impossible:
                    continue
                wanted = [*zip(truths, way, strict=True), *rest, *_given(search.program, table)]
                given = search.find(wanted)
                if given is Missing.NONE and not rest:
                    impossible.add(way)
                elif not isinstance(given, Missing):
                    yield Case(Entry("line", str(table.name)), given, origin="mask of conditions")


def _values(index: Direct | Cuts | Coded) -> list[Value]:
    """A value of each entry of a table that is looked up, or on each side of each comparison."""
    match index:
        case Cuts(type=kind, cuts=cuts):
            low, _ = key_bounds(kind)
            keys = sorted({low, *(key_of(kind, cut) - by for cut in cuts for by in (0, 1))})
            return [value_of_key(kind, key) for key in keys]
        case Direct(type=kind, low=low, count=count):
            return [value_of_key(kind, key) for key in range(low, low + count)]
        case Coded(type=kind, low=low, classes=classes):
            return [value_of_key(kind, low + at) for at, _ in enumerate(classes)]


def _distinct(vectors: Sequence[Vector]) -> Iterator[tuple[tuple[int, ...], Vector]]:
    """The first vector of each snapshot, with the positions of all that have it."""
    positions: dict[tuple[tuple[str, Value], ...], list[int]] = {}
    for at, vector in enumerate(vectors, 1):
        positions.setdefault(tuple(vector.snapshot.items()), []).append(at)
    for same in positions.values():
        yield tuple(same), vectors[same[0] - 1]


def _classes(groups: Sequence[Group]) -> Iterator[tuple[str, tuple[Value, ...]]]:
    """A value of each class of each leaf that the C finds by comparing."""
    for probe in (probe for group in groups for probe in group):
        match probe.index:
            case Direct(leaf=leaf, type=Bool()):
                yield leaf, (False, True)
            case Cuts(leaf=leaf, type=kind, cuts=cuts):
                low, _ = key_bounds(kind)
                yield leaf, (value_of_key(kind, low), *cuts)


def _given(program: Program, table: Table) -> list[tuple[Expr, bool]]:
    """What must hold that a table may be matched."""
    stops = [a.condition for a in program.assumptions if a.name in table.stops]
    return [(condition, True) for condition in (*stops, *(i.condition for i in program.invariants))]


def _equals(variable: Variable, value: Value) -> Expr:
    read = Read(variable.name, variable.type)
    if isinstance(variable.type, Bool):
        return read if value else Apply(Op.NOT, (read,), Bool())
    return Apply(Op.EQ, (read, Literal(value, variable.type)), Bool())


def refusals(program: Program, symbols: Symbols, case: Case) -> Iterator[Case]:
    """The same case, but each result of an extern procedure beyond each end of its range, and in it as far as it goes."""
    procedures = {str(procedure.name): procedure for procedure in program.procedures}
    for number, answer in enumerate(case.answers):
        names = procedures[answer.procedure].writes
        admitted = [program.variable(name).initial for name in names]
        for at, name in enumerate(names):
            for end, value in outside_of(program.variable(name), symbols.c_type(name)).items():
                if isinstance(program.variable(name).type, Bool):
                    continue
                changed = Answer(answer.procedure, (*admitted[:at], value, *admitted[at + 1 :]))
                origin = f"{name} from {answer.procedure} {end} its range"
                yield replace(
                    case,
                    answers=(*case.answers[:number], changed, *case.answers[number + 1 :]),
                    origin=origin,
                )


def drawn(program: Program, entry: Entry, examples: int, most: int) -> Iterator[Session]:
    """Sessions of a step or a cycle that are drawn by a seed, leaning on edges.

    Args:
        program: A program.
        entry: A step or a cycle.
        examples: How many.
        most: Cycles of the longest.
    """
    known, random = declarations(program), Random(f"{entry.kind} {entry.name}")  # noqa: S311  # repeatable
    levels = {level.name: level for level in program.levels}

    def aim() -> Table:
        name = entry.name if entry.kind == "step" else random.choice(levels[entry.name].table_names)
        return program.table(name)

    drawn = sessions(known, aim, most, random, examples, lambda start: refused_at(program, start) < 0)
    yield from (played(program, entry, stimuli, random) for stimuli in drawn)


def played(program: Program, entry: Entry, stimuli: Stimuli, random: Random) -> Session:
    """A session as cases, up to a cycle that is undefined."""
    cases, shown = list[Case](), list[Expected]()
    state: Snapshot = stimuli.start
    for number, readings in enumerate(stimuli.readings, 1):
        before = {**state, **readings}
        given: list[Answer] = []
        bare = Case(entry, before, origin=f"drawn, cycle {number}")
        right = ran(program, bare, _answering(program, random, given))
        if right is None or right.after is None:
            break
        cases.append(replace(bare, answers=tuple(given)))
        shown.append(right)
        state = right.after
    return Session(entry, tuple(cases), tuple(shown))


def _answering(program: Program, random: Random, given: list[Answer]) -> Answers:
    """Return what answers extern procedures by chance, and keeps what it answered.

    An answer is an edge of each leaf that is written, or a reading outside its range.
    """

    def answer(procedure: Procedure, _args: list[Value]) -> tuple[Value, ...]:
        leaves = (program.variable(name) for name in procedure.writes)
        values = tuple(random.choice(results(program, leaf)) for leaf in leaves)
        given.append(Answer(str(procedure.name), values))
        return values

    return answer
