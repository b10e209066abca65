"""A plan to C99: `<program>.h`, `<program>.c`, the symbol file, CMake and pkg-config files."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import product
from typing import TypeAlias, assert_never

from rcsc.emit.c.ctext import (
    SHORT,
    CText,
    c_type,
    declared,
    local_type,
    locals_of,
    wide_type,
    word_type,
)
from rcsc.emit.c.symbols import symbols, unit_text
from rcsc.emit.code_tree import (
    IN_C,
    Body,
    Branch,
    Cast,
    Choice,
    Code,
    Constant,
    Do,
    Element,
    Frame,
    Function,
    Infix,
    Invoke,
    Items,
    Leave,
    Let,
    Line,
    Name,
    Place,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
    read,
    repeated,
    type_bounds,
    when,
)
from rcsc.emit.identifiers import (
    FAILED_BITS,
    NameScope,
    comment,
    guard,
    names_of,
    parameter_word,
    types_guard,
    types_header,
)
from rcsc.emit.plan import (
    WORD,
    Coded,
    Cuts,
    Direct,
    Group,
    Index,
    Matcher,
    Plan,
    PlanTable,
    Truth,
    joined,
    table_position,
)
from rcsc.emit.rendering import render
from rcsc.emit.translate import FAULT, FAULT_AT, LINE, STATE, constant, local
from rcsc.lang import model
from rcsc.lang.interpret import Fault
from rcsc.lang.leaves import everything
from rcsc.lang.model import (
    Bool,
    Enum,
    Int,
    Procedure,
    Program,
    Real,
    Variable,
    key_bounds,
    pending,
    spell,
    value_of_key,
)

MOST_CHAINED = 60
"""Tests in a chain of `else if`."""
MOST_TOLD = 32
"""Masks in a table up to which each stands in a line of its own, with its class."""
MOST_NAMED = 72
"""Characters up to which the lines that a mask leaves are named."""
NONE, SEVERAL = Constant(-1), Constant(-2)
ONE, NOTHING = Constant(1, "uint64_t"), Constant(0, "uint64_t")
AT, FOUND, M = Name("at"), Name("line"), Name("m")


Fields: TypeAlias = tuple[tuple[str, str], ...]
"""Members of a struct, or constants of an enumeration: the declaration of each, and its doc."""
FAULT_DOCS = (
    "",
    "an input was refused: `fault_at` is its position",
    "no line matched, which was proved impossible",
    "several lines matched, which was proved impossible",
    "a result of a function of yours was refused: `fault_at` is the position of its variable",
    "an assumption failed that the table's safety rests on: `fault_at` is its position",
    "of `rcsc compile --defensive`: the state was refused; `fault_at` is what `check` says of it",
    "this machine, or its compiler, computes reals otherwise",
)


def emit_c(plan: Plan) -> dict[str, str]:
    """The C files of the plan, by path below the generated folder."""
    maker = _Maker(plan)
    view, name = maker.view(), maker.p
    return {
        **maker.types(),
        f"c/{name}.h": render("header.h.jinja", view),
        f"c/{name}.c": render("source.c.jinja", view),
        f"c/{maker.names.file}.json": symbols(plan, maker.names),
        f"c/{name}.cmake": render("target.cmake.jinja", view),
        f"c/{name}.pc": render("package.pc.jinja", view),
    }


def outward(plan: Plan) -> Iterator[tuple[str, str]]:
    """Give each name in C that others than the program's own file see, and what it is.

    Two programs that are linked, or whose headers are included together, may share only the name of an extern procedure that both
    declare alike.
    """
    maker = _Maker(plan)
    names, p = maker.names, maker.names.program
    own = [f"{p}.h", guard(p), *(f"{p}_{end}" for end in ("t", "init", "check"))]
    own += [f"{p}_{stem}_{end}" for stem in names.tables.values() for end in ("line", "lines", "step")]
    own += [f"{p}_{stem}_cycle" for stem in names.levels.values()]
    own += [name for lines in names.lines.values() for name in lines]
    own += [
        *names.assumptions,
        *names.faults,
        *names.leaves.values(),
        *names.invariants,
        *names.places.values(),
    ]
    yield from ((name, f"a name of program `{plan.program.name}`") for name in own)
    for unit, shared in maker.shared().items():
        yield from ((name, f"a name of the types of `{unit}`") for name in shared)
    for extern, types in maker.declared():
        yield extern, f"a function of yours of {', '.join(types) or 'nothing'}"


def helper(program: str, name: str) -> Function:
    """A function of one operator or conversion, by its name in `Invoke.helper`; what it means is `interpret.OPERATORS`'s."""
    a, b = Name("a"), Name("b")
    if "_of_" in name:
        target, source = (SHORT[short] for short in name.split("_of_"))
        head = f"{target} {program}_{name}({source} a)"
        return Function("A value that was proved to fit.", head, (Leave(Cast(target, a)),))
    op, short = name.split("_")
    kind = SHORT[short]
    if op == "number":
        zero, positive = Constant(0, kind), Name("positive")
        body = (
            Let("const bool", positive.text, infix(">", a, zero)),
            Leave(infix("||", positive, infix("<=", a, zero))),
        )
        doc = "Whether it is a number: what is none satisfies no comparison."
        return Function(doc, f"bool {program}_{name}({kind} a)", body)
    if op == "abs":
        zero, absolute = Constant(0, kind), None
        if kind == "double":
            absolute = Choice(infix("<=", a, zero), infix("-", zero, a), a)  # of -0.0 too
        elif not kind.startswith("u"):
            absolute = Choice(infix("<", a, zero), Prefix("-", a), a)
        return Function("The absolute value.", f"{kind} {program}_{name}({kind} a)", (Leave(absolute or a),))
    sign, word = ("<", "lesser") if op == "min" else (">", "greater")
    return Function(
        f"The {word} of two; the first where it is no number.",
        f"{kind} {program}_{name}({kind} a, {kind} b)",
        (Leave(Choice(infix(sign, b, a), b, a)),),
    )


class _Maker:
    """Builds the view of one plan."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.program = plan.program
        self.names = names_of(plan.program, plan.places)
        parameters = {
            str(procedure.name): tuple(p.type for p in procedure.params)
            for procedure in plan.program.procedures
        }
        self.text = CText(self.names, parameters, _failing(plan.program))
        self.p = self.names.program
        self.cuts: list[Function] = []

    def view(self) -> dict[str, object]:
        """What the templates lay out."""
        procedures = [self._procedure(procedure) for procedure in _callees_first(self.program)]
        tables = [function for table in self.plan.tables for function in self._table(table)]
        levels = [self._level(level) for level in self.program.levels]
        shared = [self._settle(), *self._safe(), *self._assumptions(), *self._actions()]
        publics = (self._init(), self._check(), *tables, *self._steps(), *levels)
        code = tuple(read((*procedures, *shared, *publics, *self.cuts)))
        kinds = {c_type(variable.type) for variable in self.program.variables}
        reals = "double" in kinds.union(getattr(node, "type", "") for node in code)
        admit = self._admit(reals)
        calls = (node for node in (*code, *read(admit)) if isinstance(node, Invoke))
        used = {call.helper for call in calls if call.helper}
        bits = {name for name in used if name.startswith("bit")}
        return {
            "plan": self.plan,
            "program": self.p,
            "guard": guard(self.p),
            "source": comment(self.plan.source),
            "includes": sorted({types_header(unit) for unit in self.names.units.values()}),
            "positions": list(self._positions()),
            "fields": list(self._fields()),
            "failed": self.names.failed,
            "faults": self.names.faults,
            "reals": reals,
            "bits": bits,
            "externs": list(self._externs()),
            "helpers": [*(helper(self.p, name) for name in sorted(used - bits)), *self.cuts],
            "privates": [*procedures, admit, *shared, *self._begin()],
            "publics": publics,
        }

    # --- declarations ---

    def types(self) -> dict[str, str]:
        """A header for each file that declares types: all programs that use it share them."""
        headers = {}
        for unit in dict.fromkeys(self.names.units.values()):
            files = [file for file, word in self.names.units.items() if word == unit]
            enums = [enum for enum in self.program.enums if enum.file in files]
            records = [record for record in self.program.records if record.file in files]
            needed = {self.names.units[part.file] for record in records for part in self._parts(record)}
            view = {
                "source": comment(self._source(files[0])),
                "mark": self.plan.mark,
                "guard": types_guard(unit),
                "includes": sorted(types_header(other) for other in needed - {unit}),
                "enums": [self._enum(enum) for enum in enums],
                "structs": [self._record(record) for record in records],
            }
            headers[f"c/{types_header(unit)}"] = render("types.h.jinja", view)
        return headers

    def _source(self, file: str) -> str:
        """A file that declares types, as the first line of its header names it."""
        own = file in {"", self.program.file}
        return self.plan.source if own else f"{self.plan.places.get(file, file)}.rcs"

    def shared(self) -> dict[str, list[str]]:
        """Names that the header of each unit declares."""
        names = {unit: [types_header(unit), types_guard(unit)] for unit in self.names.units.values()}
        for kind in self.program.types:
            names[self.names.units[kind.file]].append(self.names.types[kind.name])
        for enum in self.program.enums:
            names[self.names.units[enum.file]] += self.names.constants[enum.name]
        return names

    def _parts(self, record: model.Record) -> Iterator[Enum | model.Record]:
        """The declared types of a record's own fields."""
        for part in record.fields:
            kind = part.type
            while isinstance(kind, model.Array):
                kind = kind.element
            if isinstance(kind, Enum | model.Record):
                yield kind

    def _enum(self, enum: Enum) -> tuple[str, str, str, Fields]:
        return (
            self.names.types[enum.name],
            c_type(enum),
            comment(enum.name),
            self._numbered(self.names.constants[enum.name], enum.members),
        )

    def _numbered(self, names: Iterable[str], docs: Iterable[str]) -> Fields:
        """Constants from 0 on."""
        pairs = zip(names, docs, strict=True)
        return tuple((f"{name} = {at}", comment(doc)) for at, (name, doc) in enumerate(pairs))

    def _record(self, record: model.Record) -> tuple[str, Fields]:
        names = self.names.members[record.name]
        docs = (
            "; ".join(word for word in (range_text(f.type), comment(f.doc)) if word) for f in record.fields
        )
        fields = tuple(
            (declared(self.names, names[f.name], f.type), doc)
            for f, doc in zip(record.fields, docs, strict=True)
        )
        return self.names.types[record.name], fields

    def _positions(self) -> Iterator[tuple[str, Fields]]:
        """Constants for what the trace tells by its position, each kind with what is said of it."""
        for table in self.plan.tables:
            names = self.names.lines[table.table.name]
            docs = (  # where the constant does not say it
                "" if name.endswith(f"_{line.name.upper()}") else line.name
                for name, line in zip(names, table.lines, strict=True)
            )
            doc = f"`line`, where table {table.table.name} ran; -1 for none"
            yield comment(doc), self._numbered(names, docs)
        if self.names.assumptions:
            doc = "Bits of `assumptions_failed`, from the lowest, and `fault_at` where an assumption failed"
            yield doc, self._numbered(self.names.assumptions, self.plan.checked)
        positions = (
            f"{name} = {at}" for at, name in enumerate((*self.names.leaves.values(), *self.names.invariants))
        )
        doc = "`fault_at` where an input or a result was refused, and what `check` gives: variables, then invariants"
        yield doc, tuple((position, "") for position in positions)
        if self.names.places:
            doc = "`fault_at` where a table that others follow in a cycle has no line, or several"
            numbered = (
                (name, table_position(self.program, table)) for table, name in self.names.places.items()
            )
            yield doc, tuple((f"{name} = {number}", "") for name, number in numbered)
        yield "`fault`, and what a cycle returns", self._numbered(self.names.faults, FAULT_DOCS)

    def _fields(self) -> Iterator[tuple[str, str]]:
        variables = {v.name: v for v in self.program.variables}
        position = {v.name: at for at, v in enumerate(self.program.variables)}
        for variable in self.program.declared:
            root = self.names.roots[variable.name]
            first, last = position[variable.leaves[0]], position[variable.leaves[-1]]
            where = f"{first}" if first == last else f"{first} to {last}"
            words = [
                f"{where}: {variable.kind.value}",
                range_text(variable.type),
                _safe_text(variables[variable.leaves[0]]),
                comment(variable.doc),
            ]
            yield declared(self.names, root, variable.type), "; ".join(word for word in words if word)
            later = pending(variable.name)
            if later in variables:
                doc = f"{position[later]}: state; the deferred next value of {root}"
                yield declared(self.names, "".join(self.names.paths[later]), variables[later].type), doc

    def declared(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Each user function, and the types of its parameters; a pointer's ends in a star."""
        for procedure in self.program.procedures:
            if procedure.extern is not None:
                yield (
                    procedure.extern.c,
                    tuple(kind.replace(" ", "") for kind, _ in self._parameters(procedure)),
                )

    def _externs(self) -> Iterator[str]:
        declared = (
            f"extern void {procedure.extern.c}({', '.join(map(''.join, self._parameters(procedure))) or 'void'});"
            for procedure in self.program.procedures
            if procedure.extern is not None
        )
        yield from dict.fromkeys(declared)

    def _parameters(self, extern: Procedure) -> Iterator[tuple[str, str]]:
        """Types, up to the name, and names."""
        kinds = {v.name: v.type for v in self.program.variables}
        word = NameScope().fresh
        yield from ((f"{c_type(kinds[name])} ", word(parameter_word(name))) for name in extern.reads)
        yield from (
            (f"{wide_type(param.type)} ", word(parameter_word(param.name))) for param in extern.params
        )
        yield from (
            (f"{c_type(kinds[name])} *", word(f"{parameter_word(name)}_out")) for name in extern.writes
        )

    # --- procedures ---

    def _on_state(self, doc: str, name: str, *body: Stmt, gives: str = "void") -> Function:
        """A function of the state."""
        return Function(doc, f"{gives} {self.p}_{name}({self.p}_t *s)", body)

    def _procedure(self, procedure: Procedure) -> Function:
        params = [f"{self.p}_t *s", *(f"{self._held(p.type)} v_{p.name}" for p in procedure.params)]
        head = f"void {self.p}_do_{self.names.procedures[procedure.name]}({', '.join(params)})"
        body = self._extern_body(procedure) if procedure.extern else self._body(procedure)
        return Function(comment(procedure.doc) or f"Procedure {procedure.name}.", head, tuple(body))

    def _body(self, procedure: Procedure) -> Iterator[Stmt]:
        kinds = dict(locals_of(procedure))
        yield from (
            Let(self._held(kind), f"v_{name}", self.text.constant(kind, 0, local_type(kind)))
            for name, kind in kinds.items()
        )
        body = self.text.block(procedure.body)
        used = {code.text for code in read(body) if isinstance(code, Name)}
        named = (local(name) for name in (*kinds, *(param.name for param in procedure.params)))
        yield from (
            _unused(variable) for variable in named if variable.text not in used
        )  # set, perhaps, and never read
        yield from body
        if not _of_state(body):
            yield _unused(STATE)

    def _held(self, kind: model.Scalar) -> str:
        """The type of a parameter or a local; that of an enumeration by its name."""
        return self.names.types[kind.name] if isinstance(kind, Enum) else local_type(kind)

    def _extern_body(self, procedure: Procedure) -> Iterator[Stmt]:
        assert procedure.extern is not None
        variables = {v.name: v for v in self.program.variables}
        results = [(variables[name], Name(f"w{at}")) for at, name in enumerate(procedure.writes)]
        for variable, result in results:
            yield Let(c_type(variable.type), result.text, self.text.place(variable.name))
        given: list[Code] = [self.text.place(name) for name in procedure.reads]
        given += [
            self.text.converted(local(p.name), local_type(p.type), wide_type(p.type))
            for p in procedure.params
        ]
        outs = (Prefix("&", result) for _, result in results)
        yield Do(Invoke(procedure.extern.c, (*given, *outs)))
        for variable, result in results:
            kept = (*self._taken(variable, result), Set(self.text.place(variable.name), result))
            refused, at = self._refused(variable, result), Name(self.names.leaves[variable.name])
            told = Set(FAULT, self._fault(Fault.EXTERN)), Set(FAULT_AT, at)
            body = kept if refused is None else (Branch(((refused, told),), kept),)
            yield from body if variable is results[0][0] else (when(self.text.faultless, *body),)

    # --- admission ---

    def _trace(self, fault: Code, at: Code) -> Body:
        """The trace of a cycle that has run no line."""
        told = {"line": NONE, "fault": fault, "fault_at": at} | dict.fromkeys(self.names.failed, Constant(0))
        return tuple(Set(Place((name,)), value) for name, value in told.items())

    def _admit(self, reals: bool) -> Function:
        """Refuses first, then admits: a refused cycle changes nothing but its trace."""
        inputs = [v for v in self.program.variables if v.kind is model.Kind.INPUT]
        tests = [(Name(self.names.leaves[v.name]), self._refused(v, self.text.place(v.name))) for v in inputs]
        asked = [(leaf, test) for leaf, test in tests if test is not None]
        taken = tuple(s for v in inputs for s in self._taken(v, self.text.place(v.name)))
        told = Set(FAULT, self._fault(Fault.ADMIT)), Set(FAULT_AT, AT)
        body: Body = taken
        if asked:
            branch = Branch(((infix(">=", AT, Constant(0)), told),), taken or None)
            body = (Let("int32_t", "at", NONE), *_first(asked), branch)
        if reals:
            inexact = Prefix("!", Invoke(f"{self.p}_exact"))
            body = (Branch(((inexact, (Set(FAULT, self._fault(Fault.ARITHMETIC)),)),), body or None),)
        return self._on_state(
            "Admits every input; a refused one leaves everything else as it was.",
            "admit",
            *self._trace(self._fault(Fault.OK), NONE),
            *body,
        )

    def _refused(self, variable: Variable, place: Code) -> Code | None:
        """A condition that a value is refused; None where none can be. A NaN satisfies no comparison."""
        kind, clamped = variable.type, variable.admit is model.Admit.CLAMP
        if isinstance(kind, Real):
            if not clamped:
                return self._beyond(kind, place)
            name = "number_f64"
            return Prefix("!", Invoke(f"{self.p}_{name}", (place,), "bool", helper=name))
        if isinstance(kind, Bool) or clamped:
            return None
        outside = [test for test, _ in self._outside(kind, place)]
        return infix("||", *outside) if outside else None

    def _taken(self, variable: Variable, place: Code) -> Iterator[Stmt]:
        """What admission makes of a value that is not refused: clamped, and no -0.0."""
        kind, clamped = variable.type, variable.admit is model.Admit.CLAMP
        if isinstance(kind, Real):
            if clamped:
                low, high = (self.text.constant(kind, end) for end in (kind.low, kind.high))
                yield when(infix("<", place, low), Set(place, low))
                yield when(infix(">", place, high), Set(place, high))
            yield Set(place, infix("+", place, constant(kind, 0)))
        elif clamped and not isinstance(kind, Bool):
            yield from (when(test, Set(place, end)) for test, end in self._outside(kind, place))

    def _beyond(self, kind: Real, place: Code) -> Code:
        """A condition that a real is outside its range, or no number."""
        low, high = (self.text.constant(kind, end) for end in (kind.low, kind.high))
        return Prefix("!", infix("&&", infix(">=", place, low), infix("<=", place, high)))

    def _outside(self, kind: Int | Enum, place: Code) -> list[tuple[Code, Code]]:
        """For each end of the range that the C type passes: the test that a value is beyond it, and the end."""
        low, high = key_bounds(kind)
        least, greatest = type_bounds(c_type(kind))
        ends = ((least < low, "<", low), (greatest > high, ">", high))
        shown = ((op, self.text.constant(kind, end)) for passed, op, end in ends if passed)
        return [(infix(op, place, end), end) for op, end in shown]

    def _fault(self, fault: Fault) -> Name:
        return Name(self.names.faults[fault])

    def _check(self) -> Function:
        """Checks all states and outputs, and the representation of every bool; then the invariants over them."""
        tests = [(Name(self.names.leaves[v.name]), self._unfit(v)) for v in self.program.variables]
        tests += [
            (Name(name), Prefix("!", self.text.expr(invariant.condition)))
            for name, invariant in zip(self.names.invariants, self.program.invariants, strict=True)
        ]
        asked = [(at, test) for at, test in tests if test is not None]
        doc = (
            "Whether the state may be gone on from: -1, or the position of the first variable outside its range, or, counted after "
            "the variables, of the first invariant that does not hold. Call it on every state that comes from outside."
        )
        body = (
            Let("int32_t" if asked else "const int32_t", "at", NONE),
            *(() if asked else (_unused(STATE),)),
            *_first(asked),
            Leave(AT),
        )
        return Function(doc, f"int32_t {self.p}_check(const {self.p}_t *s)", body)

    def _unfit(self, variable: Variable) -> Code | None:
        """A condition that the place holds no value of its type; None where its C type or admission rules that out."""
        kind, place = variable.type, self.text.place(variable.name)
        if isinstance(kind, Bool):  # read as a byte: as a bool, another than 0 and 1 means nothing
            byte = Prefix("*", Cast("const uint8_t *", Prefix("&", place)))
            return infix(">", byte, Constant(1, "uint32_t"))
        if variable.kind is model.Kind.INPUT:
            return None
        if isinstance(kind, Real):
            return self._beyond(kind, place)
        outside = [test for test, _ in self._outside(kind, place)]
        return infix("||", *outside) if outside else None

    def _begin(self) -> Iterator[Function]:
        if self.plan.defensive:
            yield self._on_state(
                "Checks the state, then admits every input.",
                "begin",
                Let("const int32_t", "at", Invoke(f"{self.p}_check", (STATE,))),
                Branch(
                    ((infix("<", AT, Constant(0)), (self._run_on_state("admit"),)),),
                    self._trace(self._fault(Fault.STATE), AT),
                ),
            )

    def _run_on_state(self, name: str) -> Do:
        return Do(Invoke(f"{self.p}_{name}", (STATE,)))

    def _settle(self) -> Function:
        deferred = [(v, v.deferred_until) for v in self.program.variables if v.deferred_until is not None]
        ready = [Name(f"ready{at}") for at, _ in enumerate(deferred)]
        pairs = list(zip(ready, deferred, strict=True))
        lets = (Let("const bool", flag.text, self.text.expr(until)) for flag, (_, until) in pairs)
        sets = (
            when(flag, Set(self.text.place(v.name), self.text.place(pending(v.name))))
            for flag, (v, _) in pairs
        )
        doc = "Deferred variables take their next values, all at once."
        none = [self._assigned(self.program.variable(leaf), 0) for leaf in self.program.line_leaves.values()]
        unused = () if deferred or none else (_unused(STATE),)
        return self._on_state(doc, "settle", *lets, *sets, *none, *unused)

    def _safe(self) -> Iterator[Function]:
        shown = [
            self._assigned(variable, variable.safe)
            for variable in self.program.variables
            if variable.safe is not None
        ]
        if shown:
            yield self._on_state("After a fault: outputs that have a safe value show it.", "safe", *shown)

    def _assigned(self, variable: Variable, value: model.Value) -> Set:
        return Set(self.text.place(variable.name), self.text.constant(variable.type, value))

    # --- tables ---

    def _table(self, table: PlanTable) -> Iterator[Function]:
        name = self.names.tables[table.table.name]
        doc = f"The line of table {table.table.name} that matches admitted inputs{table.where}: its position; -1 none, -2 several."
        body = tuple(self._match(table, name))
        unread = () if _of_state(body) else (_unused(STATE),)
        yield Function(doc, f"int32_t {self.p}_{name}_line(const {self.p}_t *s)", (*unread, *body))
        i, n = Name("i"), Name("n")
        line = Invoke(f"{self.p}_{name}_line", (Prefix("&", Element(Name("in"), i)),))
        each = _counted(i, n, Set(Element(Name("out"), i), line))
        head = f"void {self.p}_{name}_lines(const {self.p}_t *in, int32_t *out, uint32_t n)"
        doc = f"The same for n inputs at once, table {table.table.name}."
        yield Function(doc, head, (Let("uint32_t", "i"), each))

    def _match(self, table: PlanTable, name: str) -> Iterator[Stmt]:
        matcher = table.matcher
        if matcher.groups:
            yield Line("/* The masks: bit k of an entry is set where line k does not exclude that class. */")
            yield from _masks(matcher, [line.name for line in table.lines])
        indices = [self._index(group, f"{name}_{at}") for at, group in enumerate(matcher.groups)]
        masks = [Element(Name(f"t.t{at}"), index) for at, index in enumerate(indices)]
        yield from (self._one_word if matcher.words <= 1 else self._many_words)(matcher, masks)

    def _index(self, group: Group, name: str) -> Code:
        index: Code | None = None
        for number, probe in enumerate(group):
            leaf_class = self._class(probe.index, f"{name}_{number}")
            moved = index and Round(infix("*", Round(index), Constant(probe.index.count, "uint32_t")))
            index = Round(infix("+", moved, leaf_class)) if moved else leaf_class
        assert index is not None
        return index

    def _class(self, index: Index, name: str) -> Code:
        match index:
            case Direct(leaf=leaf, type=Bool()):
                return Round(_bit(self.text.place(leaf)))
            case Direct(leaf=leaf, low=0):
                return self.text.place(leaf)
            case Direct(leaf=leaf, type=kind, low=low):
                return self._above(kind, self.text.place(leaf), low)
            case Truth(condition=condition):
                return Round(_bit(self.text.expr(condition)))
            case Coded(leaf=leaf, type=kind, low=low):
                above = self._above(kind, self.text.place(leaf), low)
                return self._classify(name, "The class of the value.", above, "uint32_t", _codes(index))
            case Cuts(leaf=leaf, type=kind, cuts=cuts):
                held, place = c_type(kind), self.text.place(leaf)
                if not cuts:
                    return Constant(0, "uint32_t")
                if len(cuts) <= 6:
                    tests = (_bit(infix(">=", place, self.text.constant(kind, cut))) for cut in cuts)
                    return Round(Infix("+", tuple(tests)))
                return self._classify(
                    name, "How many cuts are at most the value.", place, held, tuple(_search(index, held))
                )
            case _:
                assert_never(index)

    def _above(self, kind: model.Scalar, place: Place, low: int) -> Code:
        """How far a value is above the least that has a class."""
        if low == 0:
            return place
        word, sign = word_type(*key_bounds(kind)), "+" if low < 0 else "-"
        return self.text.converted(
            Round(infix(sign, Cast(word, place), Constant(abs(low), word))), word, "uint32_t"
        )

    def _classify(self, name: str, doc: str, value: Code, kind: str, body: Body) -> Code:
        """A call of a function of its own, which finds the class of a value."""
        function = self.names.c.fresh(f"{self.p}_class_{name}")
        self.cuts.append(Function(doc, f"uint32_t {function}({kind} value)", body))
        return Invoke(function, (value.inner if isinstance(value, Round) else value,))

    def _lowest(self, bits: int, mask: Code) -> Code:
        return Invoke(f"{self.p}_bit{bits}", (mask,), helper=f"bit{bits}")

    def _one_word(self, matcher: Matcher, masks: list[Element]) -> Iterator[Stmt]:
        bits = max(_width(matcher.lines), 32)
        word, none = f"uint{bits}_t", infix("==", M, _word(0, bits))
        every = Round(Name(f"{2**matcher.lines - 1:#x}{'ull' if bits == 64 else 'u'}"))
        yield Let(
            f"const {word}", "m", Infix("&", tuple(Cast(word, mask) for mask in masks)) if masks else every
        )
        several = infix("!=", infix("&", M, infix("-", M, _word(1, bits))), _word(0, bits))
        yield Let("const bool", "several", several)
        if not masks:
            yield _unused(STATE)
        first = self._lowest(bits, M)
        if matcher.lines < bits:
            first = self._lowest(bits, infix("|", M, _word(1 << matcher.lines, bits)))
        else:
            first = Choice(none, Constant(matcher.lines), first)
        yield Let("int32_t", "line", first)
        if not matcher.default:
            yield Set(FOUND, Choice(none, Round(NONE), FOUND))
        yield Set(FOUND, Choice(Name("several"), Round(SEVERAL), FOUND))
        yield Leave(FOUND)

    def _many_words(self, matcher: Matcher, masks: list[Element]) -> Iterator[Stmt]:
        rows = [Name(f"r{at}") for at, _ in enumerate(masks)]
        for row, mask in zip(rows, masks, strict=True):
            yield Let("const uint64_t * const", row.text, mask)
        zero, several, seen, some, w = Constant(0, "uint32_t"), *map(Name, ("several", "seen", "some", "w"))
        yield from (Let("uint64_t", "several", zero), Let("uint64_t", "seen", zero))
        yield from (Let("int32_t", "line", Constant(0)), Let("int32_t", "none"), Let("uint32_t", "w"))
        nonzero = infix("!=", M, zero)
        at = infix("+", infix("*", Cast("int32_t", w), Constant(WORD)), self._lowest(WORD, M))
        body = (
            Let("const uint64_t", "m", Infix("&", tuple(Element(row, w) for row in rows))),
            Let("const uint64_t", "some", Choice(nonzero, ONE, NOTHING)),
            Set(several, infix("|", several, infix("&", M, infix("-", M, ONE)), infix("&", some, seen))),
            Set(seen, infix("|", seen, some)),
            Set(FOUND, Choice(nonzero, at, FOUND)),
        )
        yield _counted(w, Constant(matcher.words, "uint32_t"), *body)
        yield Set(Name("none"), Constant(matcher.lines) if matcher.default else Round(NONE))
        yield Set(FOUND, Choice(infix("==", seen, zero), Name("none"), FOUND))
        yield Set(FOUND, Choice(infix("!=", several, zero), Round(SEVERAL), FOUND))
        yield Leave(FOUND)

    def _actions(self) -> Iterator[Function]:
        """One function a table: a match that runs the line's actions."""
        for table in self.plan.tables:
            name = self.names.tables[table.table.name]
            told = [
                stmt for place in table.monitored for stmt in self._told(place, stops=place in table.stops)
            ]
            matched = self._matched(table, name)
            run = (when(self.text.faultless, *matched),) if table.stops else matched
            doc = f"Matches table {table.table.name} and runs the line."
            yield self._on_state(doc, f"run_{name}", *told, *run)

    def _assumptions(self) -> Iterator[Function]:
        """One function for each assumption that is checked."""
        told = {place for table in self.plan.tables for place in table.monitored}
        for place in sorted(told):
            name, assumption = self.names.holding[place], self.program.assumptions[self.plan.monitored[place]]
            words = comment(assumption.doc)
            doc = f"Assumption {assumption.name}{f': {words}' if words else ' holds.'}"
            body: Body = (Leave(self.text.expr(assumption.condition)),)
            unread = () if _of_state(body) else (_unused(STATE),)
            yield Function(doc, f"bool {name}(const {self.p}_t *s)", (*unread, *body))

    def _told(self, place: int, *, stops: bool) -> Body:
        """Marks an assumption that fails; one that stops ends the cycle."""
        word, bit = divmod(place, FAILED_BITS)
        failed = Place((self.names.failed[word],))
        shift = Constant(bit, "uint32_t") if word else Cast("uint32_t", Name(self.names.assumptions[place]))
        mark = Set(failed, infix("|", failed, infix("<<", ONE, shift)))
        name = Name(self.names.assumptions[place])
        end = Set(FAULT, self._fault(Fault.ASSUMPTION)), Set(FAULT_AT, name)
        ended = (when(self.text.faultless, *end),) if stops else ()
        test = Prefix("!", Invoke(self.names.holding[place], (STATE,)))
        return (when(test, mark, *ended),)

    def _matched(self, table: PlanTable, name: str) -> Body:
        """Finds the line and runs its actions."""
        cases: list[Stmt] = []
        named = zip(self.names.lines[table.table.name], table.lines, strict=True)
        for number, (line_name, line) in enumerate(named, 1):
            body = self.text.block([action.statement for action in line.actions])
            head = (f"case {line_name}: /* {comment(line.told)} */",)
            cases.append(Frame(head, (*self._kept(table, number), *body, Line("break;"))))
        none, several = (Set(FAULT, self._fault(fault)) for fault in (Fault.NO_LINE, Fault.SEVERAL_LINES))
        return (
            Set(LINE, Invoke(f"{self.p}_{name}_line", (STATE,))),
            Frame(("switch (", LINE, ") {")),
            *cases,
            Frame(("case ", Round(NONE), ":"), (none, Line("break;"))),
            Frame(("default:",), (Set(LINE, NONE), several, Line("break;"))),
            Line("}"),
        )

    def _kept(self, table: PlanTable, line: int) -> Body:
        """Keeps the line of a table that others follow in a cycle."""
        leaf = self.program.line_leaves.get(table.table.name)
        return () if leaf is None else (self._assigned(self.program.variable(leaf), line),)

    # --- steps and cycles ---

    def _cycle(self, doc: str, name: str, *body: Stmt) -> Function:
        """The frame of every step and cycle."""
        begin = self._run_on_state("begin" if self.plan.defensive else "admit")
        shown = any(variable.safe is not None for variable in self.program.variables)
        safe = (when(self.text.faulted, self._run_on_state("safe")),) if shown else ()
        run = when(self.text.faultless, self._run_on_state("settle"), *body)
        return self._on_state(doc, name, begin, run, *safe, Leave(FAULT), gives="int32_t")

    def _steps(self) -> Iterator[Function]:
        for table in self.plan.tables:
            name = self.names.tables[table.table.name]
            doc = f"One step of table {table.table.name}: admits, settles, matches, acts; returns the fault, 0 for none."
            yield self._cycle(doc, f"{name}_step", self._run_on_state(f"run_{name}"))

    def _level(self, level: model.Level) -> Function:
        before = (when(self.text.faultless, Do(self.text.call(name))) for name in level.preprocess)
        stages = (when(self.text.faultless, *self._chosen(stage, self._stage)) for stage in level.stages)
        after = (when(self.text.faultless, Do(self.text.call(name))) for name in level.postprocess)
        doc = f"One cycle of level {level.name}, every {level.period_ms} ms: returns the fault, 0 for none.{self._order(level)}"
        name = f"{self.names.levels[level.name]}_cycle"
        last = when(self.text.faultless, *self._chosen(level.tables, lambda table: (self._table_run(table),)))
        return self._cycle(doc, name, *before, *stages, last, *after)

    def _order(self, level: model.Level) -> str:
        """The order of several tables, and how a fault tells one before the last."""
        if not level.stages:
            return ""
        places = (f"{name} ({self.names.places[name]})" for name in level.staged)
        order = ", ".join((*places, " or ".join(level.tables.names)))
        return (
            f" Its tables run in this order: {order}; where one before the last has no line, or several, `fault_at` is the constant "
            "given here."
        )

    def _table_run(self, table: str) -> Do:
        return self._run_on_state(f"run_{self.names.tables[table]}")

    def _stage(self, table: str) -> Body:
        """Runs a table that others follow: the trace's line is the last one's, a fault for want of a line names the table."""
        unmatched = Infix(
            "||",
            tuple(infix("==", FAULT, self._fault(end)) for end in (Fault.NO_LINE, Fault.SEVERAL_LINES)),
        )
        named = when(unmatched, Set(FAULT_AT, Name(self.names.places[table])))
        return self._table_run(table), Set(LINE, NONE), named

    def _chosen(self, choice: model.TableChoice, run: Callable[[str], Body]) -> Iterator[Stmt]:
        """Runs the table of a choice."""
        if isinstance(choice, model.OneTable):
            yield from run(choice.table)
            return
        kind, given = choice.selector.type, self.text.whole(choice.selector)
        chosen = Name("chosen")
        yield Let(f"const {c_type(kind) if isinstance(given, Place) else local_type(kind)}", "chosen", given)
        arms = (
            (infix("==", chosen, self.text.constant(kind, value)), run(name)) for value, name in choice.tables
        )
        yield Branch(
            tuple(arms),
            (
                Frame(
                    (FAULT, " = ", self._fault(Fault.NO_LINE), "; /* no table for it: proved impossible */")
                ),
            ),
        )

    def _init(self) -> Function:
        values = (self._assigned(variable, variable.initial) for variable in self.program.variables)
        return self._on_state(
            "Every variable's initial value.", "init", *self._trace(self._fault(Fault.OK), NONE), *values
        )


# --- small things --------------------------------------------------------------------


def _first(asked: Sequence[tuple[Code, Code]]) -> Iterator[Stmt]:
    """Leaves in `at` the position of the first test that holds; a chain of `else if` is no longer than compilers nest."""
    for begin in range(0, len(asked), MOST_CHAINED):
        arms = tuple((test, (Set(AT, leaf),)) for leaf, test in asked[begin : begin + MOST_CHAINED])
        chain = Branch(arms, (Line("/* none of these */"),))
        yield when(infix("<", AT, Constant(0)), chain) if begin else chain


def _counted(count: Name, end: Code, *body: Stmt) -> Frame:
    """A loop from 0 up to the end, exclusive."""
    zero, one = Constant(0, "uint32_t"), Constant(1, "uint32_t")
    return repeated(Set(count, zero), infix("<", count, end), Set(count, infix("+", count, one)), *body)


def _unused(name: Name) -> Do:
    return Do(Cast("void", name))


def _of_state(body: Body) -> bool:
    """Whether it reads or writes the state."""
    return any(isinstance(code, Place) or code == STATE for code in read(body))


def _bit(condition: Code) -> Code:
    return Choice(condition, Constant(1, "uint32_t"), Constant(0, "uint32_t"))


def _word(value: int, bits: int) -> Name:
    """A mask, as wide as 32 bits or 64."""
    return Name(f"{value:#x}{'ull' if bits == 64 else 'u'}")


def _width(lines: int) -> int:
    return next(bits for bits in (8, 16, 32, 64) if lines < bits or bits == 64)


def _masks(matcher: Matcher, lines: Sequence[str]) -> Iterator[Stmt]:
    """All tables of masks as one object: one address to load."""
    bits = _width(matcher.lines) if matcher.words <= 1 else WORD
    words = "" if matcher.words <= 1 else f"[{matcher.words}]"
    masks = [joined(group) for group in matcher.groups]
    masks = [joined(group) for group in matcher.groups]
    members = (Line(f"uint{bits}_t t{at}[{len(entries)}]{words};") for at, entries in enumerate(masks))
    yield Frame(("static const struct {",), tuple(members))
    rows = (
        Frame(
            (f"{{ /* {_leaves(group)} */",),
            tuple(_rows(entries, matcher.words, bits, _told(group, entries, lines))),
            "},",
        )
        for group, entries in zip(matcher.groups, masks, strict=True)
    )
    yield Frame(("} t = {",), tuple(rows), "};")


def _leaves(group: Group) -> str:
    """What the classes of a group are of, in words."""
    return comment(
        " by ".join(
            probe.index.text if isinstance(probe.index, Truth) else probe.index.leaf for probe in group
        )
    )


def _rows(entries: tuple[int, ...], words: int, bits: int, told: Sequence[str]) -> Iterator[Line]:
    """Masks, or the words of each, from the lowest; each in a line with what is told of it, if anything is."""
    if words <= 1 and not told:
        yield from _wrapped([_word(mask, bits) for mask in entries], 84)
        return
    ends = [f" /* {comment(text)} */" for text in told] or [""] * len(entries)
    for at, (mask, end) in enumerate(zip(entries, ends, strict=True), 1):
        parts = Items(tuple(_word(mask >> (WORD * w) & (2**WORD - 1), WORD) for w in range(words)))
        code = IN_C.code(parts if words > 1 else _word(mask, bits))
        yield Line(f"{code}{',' if words > 1 or at < len(entries) else ''}{end}")


def _told(group: Group, entries: Sequence[int], lines: Sequence[str]) -> list[str]:
    """Of each mask its class and the lines that it leaves, by name, where that is short; nothing of many masks."""
    if len(entries) > MOST_TOLD:
        return []
    left = ([line for at, line in enumerate(lines) if mask >> at & 1] for mask in entries)
    named = (
        "every line" if len(some) == len(lines) else f"lines {', '.join(some)}" if some else "no line"
        for some in left
    )
    return [
        f"{words}: {names}" if len(names) <= MOST_NAMED else words
        for words, names in zip(_classes(group), named, strict=True)
    ]


def _classes(group: Group) -> list[str]:
    """The words of each combination of classes, the last leaf's fastest."""
    return [", ".join(words) for words in product(*(_class_words(probe.index) for probe in group))]


def _class_words(index: Index) -> list[str]:
    """The values of each class."""
    match index:
        case Truth():
            return ["false", "true"]
        case Direct(type=kind, low=low, count=count):
            return [spell(kind, value_of_key(kind, key)) for key in range(low, low + count)]
        case Cuts(type=kind, cuts=cuts):
            spelled = [spell(kind, cut) for cut in cuts]
            return [f"below {spelled[0]}", *(f"{cut} and above" for cut in spelled)] if cuts else ["any"]
        case Coded(low=low, classes=classes):
            starts = [low + classes.index(number) for number in range(index.count)]
            return [f"{spell(index.type, start)} and above" for start in starts]
        case _:
            assert_never(index)


def _wrapped(values: Iterable[Code], width: int = 88) -> Iterator[Line]:
    """Values of an initialiser, as many in a line as it takes."""
    text = ""
    for word in map(IN_C.code, values):
        if text and len(text) + len(word) > width:
            yield Line(text.rstrip())
            text = ""
        text += f"{word}, "
    yield Line(text.removesuffix(", "))


def _codes(index: Coded) -> Body:
    """The class of `value`, looked up."""
    head = f"static const uint{8 if index.count <= 256 else 16}_t classes[{len(index.classes)}] = {{"
    rows = tuple(_wrapped(Constant(number, "uint32_t") for number in index.classes))
    return Frame((head,), rows, "};"), Leave(Element(Name("classes"), Name("value")))


def _search(index: Cuts, wide: str) -> Iterator[Stmt]:
    """How many cuts are at most `value`, in a number of steps that depends on nothing."""
    count, cuts = Constant(len(index.cuts), "uint32_t"), Name("cuts")
    rows = tuple(_wrapped(Constant(cut, wide) for cut in index.cuts))
    yield Frame((f"static const {wide} cuts[{len(index.cuts)}] = {{",), rows, "};")
    yield Let("uint32_t", "at", Constant(0, "uint32_t"))
    step = 1 << len(index.cuts).bit_length() - 1
    while step:
        ahead, last = (infix("+", AT, Constant(by, "uint32_t")) for by in (step, step - 1))
        reached = infix(">=", Name("value"), Element(cuts, infix("%", last, count)))
        taken = infix("&&", infix("<=", ahead, count), reached)
        yield Set(AT, infix("+", AT, Choice(taken, Constant(step, "uint32_t"), Constant(0, "uint32_t"))))
        step >>= 1
    yield Leave(AT)


def range_text(kind: model.Type) -> str:
    """The range of a number, with its unit; empty for what has none."""
    match kind:
        case Int(low, high, unit) | Real(low, high, unit):
            units = unit_text(unit)
            return f"{low} .. {high}" + (f" {units}" if units else "")
        case model.Array(element=element):
            return range_text(element)
        case _:
            return ""


def _safe_text(variable: Variable) -> str:
    return "" if variable.safe is None else f"safe {spell(variable.type, variable.safe)}"


def _failing(program: Program) -> frozenset[str]:
    """Procedures that call an extern procedure, directly or not."""
    failing = {str(p.name) for p in program.procedures if p.extern is not None}
    while True:
        more = {str(p.name) for p in program.procedures if failing.intersection(_called(p.body))} - failing
        if not more:
            return frozenset(failing)
        failing |= more


def _callees_first(program: Program) -> list[Procedure]:
    """The procedures that lines and levels run, each after those that it calls; in declared order where it is free."""
    by_name = {p.name: p for p in program.procedures}
    rows = [line.actions for table in program.tables for line in table.lines]
    rows += [table.default.actions for table in program.tables if table.default is not None]
    run = {name for level in program.levels for name in (*level.preprocess, *level.postprocess)}
    run |= set(_called([action.statement for actions in rows for action in actions]))
    order: dict[str, Procedure] = {}

    def visit(procedure: Procedure) -> None:
        if procedure.name in order:
            return
        for name in _called(procedure.body):
            visit(by_name[name])
        order[procedure.name] = procedure

    reached = set[str]()
    while run - reached:
        reached |= run
        run = {name for caller in reached for name in _called(by_name[model.ProcedureName(caller)].body)}
    for procedure in program.procedures:
        if procedure.name in reached:
            visit(procedure)
    return list(order.values())


def _called(body: Iterable[model.Statement]) -> dict[model.ProcedureName, None]:
    """The procedures that statements call, in order."""
    return dict.fromkeys(call.procedure for call in everything(body) if isinstance(call, model.Call))
