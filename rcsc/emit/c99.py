"""A plan to C99: `<program>.h`, `<program>.c`, the symbol file, CMake and pkg-config files."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from rcsc.emit.ctext import CText, c_type, constant, integer, locals_of, type_bounds, wide_type
from rcsc.emit.identifiers import FAILED_BITS, Scope, comment, guard, names_of, parameter_word
from rcsc.emit.plan import WORD, Coded, Cuts, Direct, Group, Index, Matcher, Plan, PlanTable, Truth, joined
from rcsc.emit.rendering import render
from rcsc.emit.symbols import symbols, unit_text
from rcsc.lang.interpret import Fault
from rcsc.lang.leaves import everything
from rcsc.lang.model import (
    Admit,
    Array,
    Bool,
    Call,
    Enum,
    Int,
    Kind,
    Level,
    OneTable,
    Procedure,
    ProcedureName,
    Program,
    Real,
    Record,
    Scalar,
    Statement,
    Type,
    Value,
    Variable,
    key_bounds,
    pending,
    spell,
)


@dataclass(frozen=True, slots=True)
class Field:
    """A member of a struct: its declaration and its doc."""

    declaration: str
    doc: str


@dataclass(frozen=True, slots=True)
class Struct:
    """A record's struct."""

    name: str
    fields: tuple[Field, ...]


@dataclass(frozen=True, slots=True)
class Function:
    """A function: what is said of it, its head, its lines."""

    doc: str
    head: str
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CFile:
    """What the templates lay out."""

    program: str
    guard: str
    source: str
    mark: str
    defensive: bool
    enums: tuple[Struct, ...]
    structs: tuple[Struct, ...]
    fields: tuple[Field, ...]
    failed: tuple[str, ...]
    reals: bool
    bits: frozenset[int]
    checked: tuple[str, ...]
    externs: tuple[str, ...]
    helpers: tuple[Function, ...]
    privates: tuple[Function, ...]
    publics: tuple[Function, ...]
    lines: tuple[tuple[str, tuple[str, ...]], ...]


def emit_c(plan: Plan) -> dict[str, str]:
    """The C files of the plan, by path below the generated folder."""
    maker = _Maker(plan)
    made = maker.file()
    name = made.program
    return {
        f"c/{name}.h": render("header.h.jinja", made),
        f"c/{name}.c": render("source.c.jinja", made),
        f"c/{maker.names.file}.json": symbols(plan, maker.names),
        f"c/{name}.cmake": render("target.cmake.jinja", made),
        f"c/{name}.pc": render("package.pc.jinja", made),
    }


def outward(plan: Plan) -> Iterator[tuple[str, str]]:
    """Give each name in C that others than the program's own file see, and what it is.

    Two programs that are linked, or whose headers are included together, may share a name only where both declare it, and alike: an extern
    procedure.
    """
    maker = _Maker(plan)
    names, p = maker.names, maker.names.program
    own = [guard(p), *(f"{p}_{end}" for end in ("t", "init", "check"))]
    own += [f"{p}_{stem}_{end}" for stem in names.tables.values() for end in ("line", "lines", "step")]
    own += [f"{p}_{stem}_cycle" for stem in names.levels.values()]
    own += [f"{p}_{stem}_t" for stem in (*names.records.values(), *names.enums.values())]
    own += [member for members in names.constants.values() for member in members]
    yield from ((name, f"a name of program `{plan.program.name}`") for name in own)
    for one, types in maker.declared():
        yield one, f"a function of yours of {', '.join(types) or 'nothing'}"


def helper(program: str, name: str) -> Function:
    """A function of one operator or conversion, by its name in `CText.helpers`; what it means is `interpret.OPERATORS`'s."""
    types = {"f64": "double"} | {
        f"{sign}{bits}": f"{'u' if sign == 'u' else ''}int{bits}_t"
        for sign in "iu"
        for bits in (8, 16, 32, 64)
    }
    if "_of_" in name:
        target, source = (types[short] for short in name.split("_of_"))
        head = f"{target} {program}_{name}({source} a)"
        return Function("A value that was proved to fit.", head, (f"    return ({target})a;",))
    op, short = name.split("_")
    kind = types[short]
    if op == "abs":
        bodies = {
            "double": "    return (a <= 0.0) ? (0.0 - a) : a;",  # of -0.0 too
            "int64_t": "    return (a < INT64_C(0)) ? (-a) : a;",
            "uint64_t": "    return a;",
        }
        return Function("The absolute value.", f"{kind} {program}_{name}({kind} a)", (bodies[kind],))
    sign, word = ("<", "lesser") if op == "min" else (">", "greater")
    head = f"{kind} {program}_{name}({kind} a, {kind} b)"
    return Function(
        f"The {word} of two; the first where it is no number.", head, (f"    return (b {sign} a) ? b : a;",)
    )


class _Maker:
    """Builds the view of one plan."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.program = plan.program
        self.names = names_of(plan.program)
        parameters = {str(one.name): tuple(p.type for p in one.params) for one in plan.program.procedures}
        self.text = CText(self.names, _failing(plan.program), parameters)
        self.p = self.names.program
        self.cuts: list[Function] = []
        self.bits: set[int] = set()

    def file(self) -> CFile:
        """The whole view."""
        procedures = tuple(self._procedure(one) for one in _callees_first(self.program))
        tables = [function for table in self.plan.tables for function in self._table(table)]
        levels = [self._level(level) for level in self.program.levels]
        check = self._check()
        shared = [self._settle(), *self._safe(), *self._actions()]
        shared.insert(0, self._admit())  # the last to be spelled: it asks what the others compute with
        shared += [self._begin()] if self.plan.defensive else []
        publics = [self._init(), check, *tables, *self._steps(), *levels]
        return CFile(
            self.p,
            guard(self.p),
            comment(self.plan.source),
            self.plan.mark,
            self.plan.defensive,
            tuple(self._enum(enum) for enum in self.program.enums),
            tuple(self._record(record) for record in self.program.records),
            tuple(self._fields()),
            self.names.failed,
            self._reals(),
            frozenset(self.bits),
            self.plan.checked,
            tuple(self._externs()),
            tuple(self._helpers()),
            (*procedures, *shared),
            tuple(publics),
            tuple(
                (self.names.tables[t.table.name], tuple(line.name for line in t.lines))
                for t in self.plan.tables
            ),
        )

    # --- declarations ---

    def _enum(self, enum: Enum) -> Struct:
        pairs = zip(self.names.constants[enum.name], enum.members, strict=True)
        fields = tuple(Field(f"{name} = {at}", comment(member)) for at, (name, member) in enumerate(pairs))
        return Struct(f"{self.p}_{self.names.enums[enum.name]}_t", fields)

    def _record(self, record: Record) -> Struct:
        names = self.names.members[record.name]
        fields = tuple(Field(self._declare(names[f.name], f.type), comment(f.doc)) for f in record.fields)
        return Struct(f"{self.p}_{self.names.records[record.name]}_t", fields)

    def _declare(self, name: str, kind: Type) -> str:
        """A declaration: the type of the innermost elements, the name, the lengths from the outermost in."""
        lengths = ""
        while isinstance(kind, Array):
            lengths += f"[{kind.length}]"
            kind = kind.element
        base = f"{self.p}_{self.names.records[kind.name]}_t" if isinstance(kind, Record) else c_type(kind)
        return f"{base} {name}{lengths}"

    def _fields(self) -> Iterator[Field]:
        variables = {v.name: v for v in self.program.variables}
        for one in self.program.declared:
            root = self.names.roots[one.name]
            words = [one.kind.value, _range(one.type), _safe_said(variables[one.leaves[0]]), comment(one.doc)]
            yield Field(self._declare(root, one.type), "; ".join(word for word in words if word))
            later = pending(one.name)
            if later in variables:
                doc = f"state; the deferred next value of {root}"
                yield Field(f"{c_type(variables[later].type)} {self.names.paths[later]}", doc)

    def declared(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Each function of the user's, and the types of its parameters; a pointer's ends in a star."""
        for one in self.program.procedures:
            if one.extern is not None:
                yield one.extern.c, tuple(kind.replace(" ", "") for kind, _ in self._parameters(one))

    def _externs(self) -> Iterator[str]:
        declared = (
            f"extern void {one.extern.c}({', '.join(map(''.join, self._parameters(one))) or 'void'});"
            for one in self.program.procedures
            if one.extern is not None
        )
        yield from dict.fromkeys(declared)

    def _parameters(self, extern: Procedure) -> Iterator[tuple[str, str]]:
        """Types, up to the name, and names."""
        kinds = {v.name: v.type for v in self.program.variables}
        word = Scope().fresh
        yield from ((f"{c_type(kinds[name])} ", word(parameter_word(name))) for name in extern.reads)
        yield from ((f"{wide_type(one.type)} ", word(parameter_word(one.name))) for one in extern.params)
        yield from (
            (f"{c_type(kinds[name])} *", word(f"{parameter_word(name)}_out")) for name in extern.writes
        )

    # --- helpers ---

    def _helpers(self) -> Iterator[Function]:
        yield from (helper(self.p, name) for name in sorted(self.text.helpers))
        yield from self.cuts

    # --- procedures ---

    def _procedure(self, procedure: Procedure) -> Function:
        params = [f"{self.p}_t *s", *(f"{wide_type(p.type)} v_{p.name}" for p in procedure.params)]
        head = f"void {self.p}_do_{self.names.procedures[procedure.name]}({', '.join(params)})"
        lines = list(self._extern_body(procedure)) if procedure.extern else list(self._body(procedure))
        return Function(comment(procedure.doc) or f"Procedure {procedure.name}.", head, tuple(lines))

    def _body(self, procedure: Procedure) -> Iterator[str]:
        for name, kind in dict(locals_of(procedure)).items():
            yield f"    {wide_type(kind)} v_{name} = {constant(kind, 0)};"
        body = list(self.text.block(procedure.body, 1))
        text = "\n".join(body)
        for name in (*dict(locals_of(procedure)), *(param.name for param in procedure.params)):
            if not re.search(rf"\bv_{name}\b(?! = )", text):  # set, perhaps, and never read
                yield f"    (void)v_{name};"
        yield from body
        if not re.search(r"\bs\b", text):
            yield "    (void)s;"

    def _extern_body(self, procedure: Procedure) -> Iterator[str]:
        assert procedure.extern is not None
        variables = {v.name: v for v in self.program.variables}
        for at, name in enumerate(procedure.writes):
            yield f"    {c_type(variables[name].type)} w{at} = {self.text.place(name)};"
        given = [self.text.place(name) for name in procedure.reads] + [
            f"v_{p.name}" for p in procedure.params
        ]
        outs = [f"&w{at}" for at, _ in enumerate(procedure.writes)]
        yield f"    {procedure.extern.c}({', '.join([*given, *outs])});"
        for at, name in enumerate(procedure.writes):
            yield "    if (s->fault == 0) {"
            yield from self._admitted(variables[name], f"w{at}", self._position(name), "4", 2)
            yield "    }"
            yield "    if (s->fault == 0) {"
            yield f"        {self.text.place(name)} = w{at};"
            yield "    }"

    def _position(self, name: str) -> int:
        return next(at for at, v in enumerate(self.program.variables) if v.name == name)

    # --- admission ---

    def _admitted(
        self, variable: Variable, place: str, position: int, fault: str, indent: int
    ) -> Iterator[str]:
        """Lines that clamp `place`, or record the fault; a NaN satisfies no comparison."""
        pad, kind = "    " * indent, variable.type
        if isinstance(kind, Bool):
            return
        if isinstance(kind, Real):
            low, high = constant(kind, kind.low), constant(kind, kind.high)
            if variable.admit is Admit.CLAMP:
                yield from self._clamped_double(place, low, high, pad)
            yield f"{pad}if (!(({place} >= {low}) && ({place} <= {high}))) {{"
            yield from self._refuse(position, fault, indent + 1)
            yield f"{pad}}} else {{"
            yield f"{pad}    {place} = {place} + 0.0;"
            yield f"{pad}}}"
            return
        outside = _outside(kind, place)
        if variable.admit is Admit.CLAMP:
            for test, end in outside:
                yield f"{pad}if ({test}) {{"
                yield f"{pad}    {place} = ({c_type(kind)}){end};"
                yield f"{pad}}}"
        elif outside:
            yield f"{pad}if ({' || '.join(f'({test})' for test, _ in outside)}) {{"
            yield from self._refuse(position, fault, indent + 1)
            yield f"{pad}}}"

    @staticmethod
    def _clamped_double(place: str, low: str, high: str, pad: str) -> Iterator[str]:
        yield f"{pad}if ({place} < {low}) {{"
        yield f"{pad}    {place} = {low};"
        yield f"{pad}}} else if ({place} > {high}) {{"
        yield f"{pad}    {place} = {high};"
        yield f"{pad}}} else {{"
        yield f"{pad}    /* in range, or not a number */"
        yield f"{pad}}}"

    @staticmethod
    def _refuse(position: int, fault: str, indent: int) -> Iterator[str]:
        pad = "    " * indent
        yield f"{pad}if (s->fault == 0) {{"
        yield f"{pad}    s->fault = {fault};"
        yield f"{pad}    s->fault_at = {position};"
        yield f"{pad}}}"

    def _reals(self) -> bool:
        """Whether anything is a real in what has been spelled."""
        return self.text.reals or any(isinstance(one.type, Real) for one in self.program.variables)

    def _admit(self) -> Function:
        """Admits into a copy, so that a refused cycle changes nothing."""
        lines = [f"    {self.p}_t before = *s;", "    s->line = -1;", "    s->fault = 0;", "    s->fault_at = -1;",
                 *(f"    s->{word} = 0;" for word in self.names.failed)]  # fmt: skip
        if self._reals():
            lines += [
                f"    if (!{self.p}_exact()) {{",
                f"        s->fault = {int(Fault.ARITHMETIC)};",
                "    }",
            ]
        body = [
            line
            for at, variable in enumerate(self.program.variables)
            if variable.kind is Kind.INPUT
            for line in self._admitted(variable, self.text.place(variable.name), at, "1", 1)
        ]
        lines += body
        lines += ["    if (s->fault != 0) {", "        before.line = -1;", "        before.fault = s->fault;",
                  "        before.fault_at = s->fault_at;", *(f"        before.{word} = 0;" for word in self.names.failed),
                  "        *s = before;", "    }"]  # fmt: skip
        return Function("Admits every input; a refused one leaves everything else as it was.",
                        f"void {self.p}_admit({self.p}_t *s)", tuple(lines))  # fmt: skip

    def _check(self) -> Function:
        """All states and outputs, and the representation of every bool; then the invariants, which are about these."""
        variables = [(at, self._unfit(one)) for at, one in enumerate(self.program.variables)]
        tests = [(at, test) for at, test in variables if test]
        for at, one in enumerate(self.program.invariants, len(variables)):
            tests.append((at, f"!({self.text.expr(one.condition)})"))
        lines = ["    int32_t at = -1;"] if tests else ["    const int32_t at = -1;", "    (void)s;"]
        for at, test in tests:
            lines += [f"    if ((at < 0) && ({test})) {{", f"        at = {at};", "    }"]
        doc = (
            "Whether the state may be gone on from: -1, or the position of the first variable outside its range, or, counted after "
            "the variables, of the first invariant that does not hold. Call it on every state that comes from outside."
        )
        return Function(doc, f"int32_t {self.p}_check(const {self.p}_t *s)", (*lines, "    return at;"))

    def _unfit(self, variable: Variable) -> str:
        """That the place holds no value of the type; inputs are admitted by every cycle."""
        kind, place = variable.type, self.text.place(variable.name)
        if isinstance(kind, Bool):  # read as a byte: as a bool, another than 0 and 1 means nothing
            return f"(*(const uint8_t *)&{place}) > 1u"
        if variable.kind is Kind.INPUT:
            return ""
        if isinstance(kind, Real):
            low, high = constant(kind, kind.low), constant(kind, kind.high)
            return f"!(({place} >= {low}) && ({place} <= {high}))"
        return " || ".join(f"({test})" for test, _ in _outside(kind, place))

    def _begin(self) -> Function:
        lines = [
            f"    const int32_t at = {self.p}_check(s);",
            "    if (at < 0) {",
            f"        {self.p}_admit(s);",
            "    } else {",
            "        s->line = -1;",
            f"        s->fault = {int(Fault.STATE)};",
            "        s->fault_at = at;",
            *(f"        s->{word} = 0;" for word in self.names.failed),
            "    }",
        ]
        return Function("Checks the state, then admits every input.", f"void {self.p}_begin({self.p}_t *s)",
                        tuple(lines))  # fmt: skip

    @property
    def _first(self) -> str:
        """What every step and cycle begins with."""
        return f"    {self.p}_{'begin' if self.plan.defensive else 'admit'}(s);"

    def _settle(self) -> Function:
        deferred = [v for v in self.program.variables if v.deferred_until is not None]
        lines = []
        for at, one in enumerate(deferred):
            assert one.deferred_until is not None
            lines.append(f"    const bool ready{at} = {self.text.expr(one.deferred_until)};")
        for at, one in enumerate(deferred):
            lines.append(f"    if (ready{at}) {{")
            lines.append(f"        {self.text.place(one.name)} = {self.text.place(pending(one.name))};")
            lines.append("    }")
        return Function("Deferred variables take their next values, all at once.", f"void {self.p}_settle({self.p}_t *s)",
                        tuple(lines) or ("    (void)s;",))  # fmt: skip

    @property
    def _shown(self) -> list[Variable]:
        """Outputs with a safe value."""
        return [one for one in self.program.variables if one.safe is not None]

    def _safe(self) -> Iterator[Function]:
        if self._shown:
            lines = tuple(self._assigned(one, one.safe) for one in self._shown if one.safe is not None)
            doc = "After a fault: outputs that have a safe value show it."
            yield Function(doc, f"void {self.p}_safe({self.p}_t *s)", lines)

    def _end(self) -> list[str]:
        """The last lines of a step or a cycle."""
        safe = ["    if (s->fault != 0) {", f"        {self.p}_safe(s);", "    }"] if self._shown else []
        return [*safe, "    return s->fault;"]

    def _assigned(self, variable: Variable, value: Value) -> str:
        cast = "" if isinstance(variable.type, Bool | Real) else f"({c_type(variable.type)})"
        return f"    {self.text.place(variable.name)} = {cast}{constant(variable.type, value)};"

    # --- tables ---

    def _table(self, table: PlanTable) -> Iterator[Function]:
        name = self.names.tables[table.table.name]
        head = f"int32_t {self.p}_{name}_line(const {self.p}_t *s)"
        doc = f"The line of table {table.table.name} that matches admitted inputs{table.where}: its position; -1 none, -2 several."
        body = list(self._match(table, name))
        unread = [] if any(re.search(r"\bs\b", line) for line in body) else ["    (void)s;"]
        yield Function(doc, head, (*unread, *body))
        lines = (
            "    uint32_t i;",
            "    for (i = 0u; i < n; i = i + 1u) {",
            f"        out[i] = {self.p}_{name}_line(&in[i]);",
            "    }",
        )
        doc = f"The same for n inputs at once, table {table.table.name}."
        yield Function(
            doc, f"void {self.p}_{name}_lines(const {self.p}_t *in, int32_t *out, uint32_t n)", lines
        )

    def _match(self, table: PlanTable, name: str) -> Iterator[str]:
        matcher = table.matcher
        if matcher.groups:
            yield "    /* The masks: bit k of an entry is set where line k does not exclude that class. */"
            yield from self._masks(matcher)
        indices = [self._index(group, f"{name}_{at}") for at, group in enumerate(matcher.groups)]
        if matcher.words <= 1:
            yield from self._one_word(matcher, indices)
        else:
            yield from self._many_words(matcher, indices)

    @staticmethod
    def _masks(matcher: Matcher) -> Iterator[str]:
        """All tables of masks as one object: one address to load."""
        bits = _width(matcher.lines) if matcher.words <= 1 else WORD
        words = "" if matcher.words <= 1 else f"[{matcher.words}]"
        masks = [joined(group) for group in matcher.groups]
        yield "    static const struct {"
        for at, entries in enumerate(masks):
            yield f"        uint{bits}_t t{at}[{len(entries)}]{words};"
        yield "    } t = {"
        for entries in masks:
            yield "        {"
            if matcher.words <= 1:
                yield from _wrapped([_word(mask, bits) for mask in entries], "            ")
            else:
                for mask in entries:
                    parts = [_word(mask >> (WORD * w) & (2**WORD - 1), 64) for w in range(matcher.words)]
                    yield f"            {{ {', '.join(parts)} }},"
            yield "        },"
        yield "    };"

    def _index(self, group: Group, name: str) -> str:
        text = ""
        for number, probe in enumerate(group):
            one = self._class(probe.index, f"{name}_{number}")
            text = one if not text else f"((({text}) * {probe.index.count}u) + {one})"
        return text

    def _class(self, index: Index, name: str) -> str:
        match index:
            case Direct(leaf=leaf, type=kind, low=low):
                place = self.text.place(leaf)
                if isinstance(kind, Bool):
                    return f"({place} ? 1u : 0u)"
                if low == 0:
                    return place
                return self.text.converted(f"({_less(kind, place, low)})", wide_type(kind), "uint32_t")
            case Truth(condition=condition):
                return f"({self.text.expr(condition)} ? 1u : 0u)"
            case Coded(leaf=leaf, type=kind, low=low):
                function = self.names.c.fresh(f"{self.p}_class_{name}")
                self.cuts.append(self._codes(index, function))
                place = self.text.place(leaf)
                if low == 0:
                    return f"{function}((int64_t){place})"
                above = self.text.converted(f"({_less(kind, place, low)})", wide_type(kind), "int64_t")
                return f"{function}{above}" if above.startswith("(") else f"{function}({above})"
            case Cuts():
                return self._cut(index, name)

    def _cut(self, index: Cuts, name: str) -> str:
        """How many cuts are at most the value: a sum of comparisons, or a search of fixed length."""
        kind, place = index.type, self.text.place(index.leaf)
        wide = c_type(kind) if isinstance(kind, Real) else wide_type(kind)
        value = place if isinstance(kind, Real) else f"({wide}){place}"
        if not index.cuts:
            return "0u"
        if len(index.cuts) <= 6:
            tests = [f"(({value} >= {constant(kind, cut)}) ? 1u : 0u)" for cut in index.cuts]
            return "(" + " + ".join(tests) + ")"
        function = self.names.c.fresh(f"{self.p}_class_{name}")
        self.cuts.append(self._search(index, function, wide))
        return f"{function}({value})"

    def _codes(self, index: Coded, function: str) -> Function:
        width = 8 if index.count <= 256 else 16
        lines = [
            f"    static const uint{width}_t classes[{len(index.classes)}] = {{",
            *_wrapped([f"{one}u" for one in index.classes]),
            "    };",
            "    return classes[value];",
        ]
        return Function("The class of the value.", f"uint32_t {function}(int64_t value)", tuple(lines))

    def _search(self, index: Cuts, function: str, wide: str) -> Function:
        count = len(index.cuts)
        size = 1 << (count.bit_length())
        shown = [constant(index.type, cut) for cut in index.cuts]
        lines = [
            f"    static const {wide} cuts[{count}] = {{",
            *_wrapped(shown),
            "    };",
            "    uint32_t at = 0u;",
        ]
        step = size >> 1
        while step:
            lines.append(
                f"    at = at + ((((at + {step}u) <= {count}u) && (value >= cuts[(at + {step - 1}u) % {count}u])) ? {step}u : 0u);"
            )
            step >>= 1
        lines.append("    return at;")
        return Function(
            "How many cuts are at most the value.",
            f"uint32_t {function}({wide} value)",
            tuple(lines),
        )

    def _one_word(self, matcher: Matcher, indices: list[str]) -> Iterator[str]:
        bits = max(_width(matcher.lines), 32)
        self.bits.add(bits)
        every = f"({2**matcher.lines - 1:#x}{'ull' if bits == 64 else 'u'})"
        loads = [f"(uint{bits}_t)t.t{at}[{index}]" for at, index in enumerate(indices)]
        yield f"    const uint{bits}_t m = {' & '.join(loads) if loads else every};"
        yield f"    const bool several = (m & (m - {_word(1, bits)})) != {_word(0, bits)};"
        short = matcher.lines < bits
        if not indices:
            yield "    (void)s;"
        if short:
            yield f"    int32_t line = {self.p}_bit{bits}(m | {_word(1 << matcher.lines, bits)});"
        else:
            yield f"    int32_t line = (m == {_word(0, bits)}) ? {matcher.lines} : {self.p}_bit{bits}(m);"
        if not matcher.default:
            yield f"    line = (m == {_word(0, bits)}) ? (-1) : line;"
        yield "    line = several ? (-2) : line;"
        yield "    return line;"

    def _many_words(self, matcher: Matcher, indices: list[str]) -> Iterator[str]:
        for at, index in enumerate(indices):
            yield f"    const uint64_t * const r{at} = t.t{at}[{index}];"
        self.bits.add(WORD)
        yield "    uint64_t several = 0u;"
        yield "    uint64_t seen = 0u;"
        yield "    int32_t line = 0;"
        yield "    int32_t none;"
        yield "    uint32_t w;"
        yield f"    for (w = 0u; w < {matcher.words}u; w = w + 1u) {{"
        ands = " & ".join(f"r{at}[w]" for at in range(len(indices)))
        yield f"        const uint64_t m = {ands};"
        yield "        const uint64_t some = (m != 0u) ? UINT64_C(1) : UINT64_C(0);"
        yield "        several = several | (m & (m - UINT64_C(1))) | (some & seen);"
        yield "        seen = seen | some;"
        yield f"        line = (m != 0u) ? ((int32_t)w * 64 + {self.p}_bit64(m)) : line;"
        yield "    }"
        yield f"    none = {matcher.lines if matcher.default else '(-1)'};"
        yield "    line = (seen == 0u) ? none : line;"
        yield "    line = (several != 0u) ? (-2) : line;"
        yield "    return line;"

    def _actions(self) -> Iterator[Function]:
        """One function a table: a match that runs the line's actions."""
        for table in self.plan.tables:
            name = self.names.tables[table.table.name]
            yield Function(
                f"Matches table {table.table.name} and runs the line.",
                f"void {self.p}_run_{name}({self.p}_t *s)",
                tuple(self._run(table, name)),
            )

    def _run(self, table: PlanTable, name: str) -> Iterator[str]:
        for place in table.monitored:
            assumption = self.program.assumptions[self.plan.monitored[place]]
            yield f"    /* {comment(assumption.name)} */"
            yield f"    if (!({self.text.expr(assumption.condition)})) {{"
            yield f"        {self._mark_failed(place)}"
            if place in table.stops:
                yield "        if (s->fault == 0) {"
                yield f"            s->fault = {int(Fault.ASSUMPTION)};"
                yield f"            s->fault_at = {place};"
                yield "        }"
            yield "    }"
        if not table.stops:
            yield from self._matched(table, name)
            return
        yield "    if (s->fault == 0) {"
        yield from (f"    {line}" for line in self._matched(table, name))
        yield "    }"

    def _matched(self, table: PlanTable, name: str) -> Iterator[str]:
        """Finds the line and runs its actions."""
        yield f"    s->line = {self.p}_{name}_line(s);"
        yield "    switch (s->line) {"
        for number, line in enumerate(table.lines):
            yield f"    case {number}: /* {comment(line.source)} */"
            yield from self.text.block(tuple(action.statement for action in line.actions), 2)
            yield "        break;"
        yield "    case (-1):"
        yield "        s->fault = 2;"
        yield "        break;"
        yield "    default:"
        yield "        s->line = -1;"
        yield "        s->fault = 3;"
        yield "        break;"
        yield "    }"

    def _mark_failed(self, place: int) -> str:
        word, bit = divmod(place, FAILED_BITS)
        failed = f"s->{self.names.failed[word]}"
        return f"{failed} = {failed} | (UINT64_C(1) << {bit}u);"

    # --- steps and cycles ---

    def _steps(self) -> Iterator[Function]:
        for table in self.plan.tables:
            name = self.names.tables[table.table.name]
            lines = (
                self._first,
                "    if (s->fault == 0) {",
                f"        {self.p}_settle(s);",
                f"        {self.p}_run_{name}(s);",
                "    }",
                *self._end(),
            )
            doc = f"One step of table {table.table.name}: admits, settles, matches, acts; returns the fault, 0 for none."
            yield Function(doc, f"int32_t {self.p}_{name}_step({self.p}_t *s)", lines)

    def _level(self, level: Level) -> Function:
        lines = [self._first, "    if (s->fault == 0) {", f"        {self.p}_settle(s);"]
        for name in level.preprocess:
            lines += self._guarded(self.text.call(name))
        chosen = self._chosen(level)
        lines += ["        if (s->fault == 0) {", *chosen, "        }"]
        for name in level.postprocess:
            lines += self._guarded(self.text.call(name))
        lines += ["    }", *self._end()]
        doc = f"One cycle of level {level.name}, every {level.period_ms} ms: returns the fault, 0 for none."
        return Function(
            doc, f"int32_t {self.p}_{self.names.levels[level.name]}_cycle({self.p}_t *s)", tuple(lines)
        )

    @staticmethod
    def _guarded(call: str) -> list[str]:
        return ["        if (s->fault == 0) {", f"            {call}", "        }"]

    def _chosen(self, level: Level) -> list[str]:
        pad = "            "
        if isinstance(level.tables, OneTable):
            return [f"{pad}{self.p}_run_{self.names.tables[level.tables.table]}(s);"]
        kind = level.tables.selector.type
        lines = [f"{pad}const {wide_type(kind)} chosen = {self.text.expr(level.tables.selector)};"]
        word = "if"
        for value, table in level.tables.tables:
            lines.append(f"{pad}{word} (chosen == {constant(kind, value)}) {{")
            lines.append(f"{pad}    {self.p}_run_{self.names.tables[table]}(s);")
            word = "} else if"
        return [
            *lines,
            f"{pad}}} else {{",
            f"{pad}    s->fault = 2; /* no table for it: proved impossible */",
            f"{pad}}}",
        ]

    def _init(self) -> Function:
        lines = [
            "    s->line = -1;",
            "    s->fault = 0;",
            "    s->fault_at = -1;",
            *(f"    s->{word} = 0;" for word in self.names.failed),
        ]
        lines += [self._assigned(variable, variable.initial) for variable in self.program.variables]
        return Function("Every variable's initial value.", f"void {self.p}_init({self.p}_t *s)", tuple(lines))


# --- small things --------------------------------------------------------------------


def _safe_said(variable: Variable) -> str:
    return "" if variable.safe is None else f"safe {spell(variable.type, variable.safe)}"


def _failing(program: Program) -> frozenset[str]:
    """Procedures that call an extern one, directly or not."""
    failing = {str(p.name) for p in program.procedures if p.extern is not None}
    while True:
        more = {
            str(p.name)
            for p in program.procedures
            if any(isinstance(one, Call) and one.procedure in failing for one in everything(p.body))
        } - failing
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
        run = {name for one in reached for name in _called(by_name[ProcedureName(one)].body)}
    for procedure in program.procedures:
        if procedure.name in reached:
            visit(procedure)
    return list(order.values())


def _called(body: Iterable[Statement]) -> dict[ProcedureName, None]:
    """The procedures that statements call, in order."""
    return dict.fromkeys(one.procedure for one in everything(body) if isinstance(one, Call))


def _width(lines: int) -> int:
    return next(bits for bits in (8, 16, 32, 64) if lines < bits or bits == 64)


def _word(value: int, bits: int) -> str:
    return f"{value:#x}{'ull' if bits == 64 else 'u'}"


def _wrapped(words: list[str], pad: str = "        ", width: int = 96) -> list[str]:
    lines, now = [], pad
    for word in words:
        if len(now) + len(word) > width:
            lines.append(now.rstrip())
            now = pad
        now += word + ", "
    return [*lines, now.rstrip().rstrip(",")]


def _less(kind: Scalar, place: str, low: int) -> str:
    """How far a value is above the least of its type, in the type that its values are computed in."""
    wide = wide_type(kind)
    return f"({wide}){place} - {f'UINT64_C({low})' if wide == 'uint64_t' else integer(low)}"


def _outside(kind: Int | Enum, place: str) -> list[tuple[str, str]]:
    """For each end of the range that the C type passes: the test that a value is beyond it, and the end.

    What is compared is anything that the C type holds: a `uint64_t` is not made an `int64_t`, whatever its range.
    """
    low, high = key_bounds(kind)
    held = c_type(kind)
    least, greatest = type_bounds(held)
    whole = held == "uint64_t"
    wide = place if whole else f"({wide_type(kind)}){place}"
    ends = ((least < low, "<", low), (greatest > high, ">", high))
    shown = [(op, f"UINT64_C({end})" if whole else constant(kind, end)) for passed, op, end in ends if passed]
    return [(f"{wide} {op} {end}", end) for op, end in shown]


def _range(kind: Type) -> str:
    match kind:
        case Int(low, high, unit) | Real(low, high, unit):
            units = unit_text(unit)
            return f"{low} .. {high}" + (f" {units}" if units else "")
        case Enum(name=name):
            return name
        case _:
            return ""
