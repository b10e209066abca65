"""A plan to Python: one module, standard library only."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from math import prod

from rcsc.emit.identifiers import FAILED_BITS, comment, names_of
from rcsc.emit.plan import WORD, Coded, Cuts, Direct, Group, Index, Plan, PlanTable, Truth, grouped
from rcsc.emit.pytext import PyText, constant
from rcsc.emit.rendering import render
from rcsc.lang.interpret import Fault
from rcsc.lang.model import (
    Admit,
    Bool,
    Int,
    Kind,
    Level,
    OneTable,
    Procedure,
    Real,
    Scalar,
    Variable,
    key_bounds,
    pending,
)

MOST_KEYS = 8192
"""Up to so many combinations of classes the line of each is looked up at once."""
MOST_GROUPED = 512
"""Up to so many combinations of classes leaves share a tuple of masks."""


@dataclass(frozen=True, slots=True)
class PyEnum:
    """An enumeration's class."""

    name: str
    members: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class PyFunction:
    """A function: its name, parameters, doc and lines."""

    name: str
    params: str
    doc: str
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class PyFile:
    """What the template lays out."""

    source: str
    mark: str
    enums: tuple[PyEnum, ...]
    attributes: tuple[tuple[str, str, str], ...]  # name, initial value, doc
    failed: tuple[str, ...]
    checked: tuple[str, ...]
    imports: tuple[tuple[str, str], ...]  # module, its name here
    constants: tuple[tuple[str, tuple[str, ...]], ...]
    functions: tuple[PyFunction, ...]
    lines: tuple[tuple[str, tuple[str, ...]], ...]  # name of a tuple, what stands in it


def emit_python(plan: Plan) -> dict[str, str]:
    """The Python module of the plan, by path below the generated folder."""
    maker = _Maker(plan)
    return {f"python/{maker.names.program}.py": render("module.py.jinja", maker.file())}


class _Maker:
    """Builds the view of one plan."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.program = plan.program
        self.names = names_of(plan.program)
        self.text = PyText(self.names)
        self.constants: list[tuple[str, tuple[str, ...]]] = []
        self.lines: list[tuple[str, tuple[str, ...]]] = []
        self.modules = {
            module: self.names.module.fresh(f"_{module.replace('.', '_')}") for module in self._modules()
        }

    def file(self) -> PyFile:
        """The whole view."""
        functions = [self._procedure(p) for p in self.program.procedures]
        functions += [self._check(), self._admit(), self._settle(), *self._safe()]
        functions += [self._begin()] if self.plan.defensive else []
        for table in self.plan.tables:
            functions += self._table(table)
        functions += [self._level(level) for level in self.program.levels]
        attributes = tuple(
            (self.names.attributes[v.name], constant(v.type, v.initial), comment(v.doc))
            for v in self.program.variables
        )
        enums = tuple(
            PyEnum(self.names.classes[e.name], self.names.class_members[e.name]) for e in self.program.enums
        )
        source = comment(self.plan.source)
        return PyFile(
            source,
            self.plan.mark,
            enums,
            attributes,
            self.names.failed,
            self.plan.checked,
            tuple(self.modules.items()),
            tuple(self.constants),
            tuple(functions),
            tuple(self.lines),
        )

    def _modules(self) -> Iterator[str]:
        externs = [p.extern.python for p in self.program.procedures if p.extern is not None]
        yield from dict.fromkeys(one.partition(":")[0] for one in externs)

    def _constant(self, wanted: str, rows: tuple[str, ...]) -> str:
        """A tuple of the module; its name."""
        name = self.names.module.fresh(wanted)
        self.constants.append((name, rows))
        return name

    # --- procedures ---

    def _procedure(self, procedure: Procedure) -> PyFunction:
        params = ", ".join(["s", *(f"v_{p.name}" for p in procedure.params)])
        lines = (
            list(self._extern(procedure))
            if procedure.extern is not None
            else list(self.text.block(procedure.body, 1))
        )
        name = f"_do_{self.names.procedures[procedure.name]}"
        return PyFunction(
            name, params, comment(procedure.doc) or f"Procedure {procedure.name}.", tuple(lines)
        )

    def _extern(self, procedure: Procedure) -> Iterator[str]:
        assert procedure.extern is not None
        variables = {v.name: v for v in self.program.variables}
        positions = {v.name: at for at, v in enumerate(self.program.variables)}
        module, _, function = procedure.extern.python.partition(":")
        given = [self.text.place(name) for name in procedure.reads] + [
            f"v_{p.name}" for p in procedure.params
        ]
        kept = "given = " if procedure.writes else ""
        yield f"    {kept}{self.modules[module]}.{function}({', '.join(given)})"
        if procedure.writes:
            yield "    if not isinstance(given, tuple):"
            yield "        given = (given,)"
            yield f"    if len(given) != {len(procedure.writes)}:"
            yield f"        raise _Refused({positions[procedure.writes[0]]})"
        for at, name in enumerate(procedure.writes):
            yield f"    w{at} = {_typed(variables[name].type, f'given[{at}]')}"
            yield from self._admitted(variables[name], f"w{at}", f"raise _Refused({positions[name]})", 1)
            yield f"    {self.text.place(name)} = w{at}"

    # --- admission ---

    def _admitted(self, variable: Variable, place: str, refuse: str, indent: int) -> Iterator[str]:
        pad, kind = "    " * indent, variable.type
        low, high = (kind.low, kind.high) if isinstance(kind, Int | Real) else key_bounds(kind)
        ends = [repr(low), repr(high)]
        if variable.admit is Admit.CLAMP:
            yield f"{pad}if {place} < {ends[0]}:"
            yield f"{pad}    {place} = {ends[0]}"
            yield f"{pad}elif {place} > {ends[1]}:"
            yield f"{pad}    {place} = {ends[1]}"
        yield f"{pad}if not {ends[0]} <= {place} <= {ends[1]}:"
        yield f"{pad}    {refuse}"
        if isinstance(kind, Real):
            yield f"{pad}{place} = {place} + 0.0"

    def _admit(self) -> PyFunction:
        """Looks at every input before it changes any."""
        lines = [
            "    s.line = -1",
            "    s.fault_at = -1",
            *(f"    s.{word} = 0" for word in self.names.failed),
        ]
        inputs = [(at, v) for at, v in enumerate(self.program.variables) if v.kind is Kind.INPUT]
        stores = []
        for number, (at, variable) in enumerate(inputs):
            value = f"i{number}"
            lines.append(f"    {value} = {_typed(variable.type, self.text.place(variable.name))}")
            lines += self._admitted(variable, value, f"return _refused(s, {at})", 1)
            stores.append(f"    {self.text.place(variable.name)} = {value}")
        return PyFunction("_admit", "s", "Admits every input; the fault.", (*lines, *stores, "    return 0"))

    def _check(self) -> PyFunction:
        """As in C."""
        lines = []
        for at, one in enumerate(self.program.variables):
            kind, place = one.type, self.text.place(one.name)
            low, high = (kind.low, kind.high) if isinstance(kind, Int | Real) else key_bounds(kind)
            types = "(int, float)" if isinstance(kind, Real) else "int"
            if one.kind is not Kind.INPUT or isinstance(kind, Bool):
                lines.append(f"    if not (isinstance({place}, {types}) and {low!r} <= {place} <= {high!r}):")
                lines.append(f"        return {at}")
        for at, invariant in enumerate(self.program.invariants, len(self.program.variables)):
            lines += [f"    if not {self.text.expr(invariant.condition)}:", f"        return {at}"]
        doc = (
            "Whether the state may be gone on from: -1, or the position of the first variable outside its range, or, counted after "
            "the variables, of the first invariant that does not hold."
        )
        return PyFunction("check", "s", doc, (*lines, "    return -1"))

    def _begin(self) -> PyFunction:
        lines = (
            "    at = check(s)",
            "    if at < 0:",
            "        return _admit(s)",
            "    s.line = -1",
            "    s.fault_at = at",
            *(f"    s.{word} = 0" for word in self.names.failed),
            f"    return {int(Fault.STATE)}",
        )
        return PyFunction("_begin", "s", "Checks the state, then admits every input; the fault.", lines)

    @property
    def _first(self) -> str:
        """What every step and cycle begins with."""
        return f"    s.fault = {'_begin' if self.plan.defensive else '_admit'}(s)"

    def _settle(self) -> PyFunction:
        deferred = [v for v in self.program.variables if v.deferred_until is not None]
        lines = []
        for at, one in enumerate(deferred):
            assert one.deferred_until is not None
            lines.append(f"    ready{at} = {self.text.expr(one.deferred_until)}")
        for at, one in enumerate(deferred):
            lines.append(f"    if ready{at}:")
            lines.append(f"        {self.text.place(one.name)} = {self.text.place(pending(one.name))}")
        doc = "Deferred variables take their next values, all at once."
        return PyFunction("_settle", "s", doc, tuple(lines) or ("    pass",))

    @property
    def _shown(self) -> list[Variable]:
        """Outputs with a safe value."""
        return [one for one in self.program.variables if one.safe is not None]

    def _safe(self) -> Iterator[PyFunction]:
        if self._shown:
            lines = tuple(
                f"    {self.text.place(one.name)} = {constant(one.type, one.safe)}"
                for one in self._shown
                if one.safe is not None
            )
            doc = "After a fault: outputs that have a safe value show it."
            yield PyFunction("_safe", "s", doc, lines)

    def _end(self) -> list[str]:
        """The last lines of a step or a cycle."""
        safe = ["    if s.fault != 0:", "        _safe(s)"] if self._shown else []
        return [*safe, "    return s.fault"]

    # --- tables ---

    def _table(self, table: PlanTable) -> Iterator[PyFunction]:
        name = self.names.tables[table.table.name]
        upper = f"_{name.upper()}"
        actions = self.names.module.fresh(f"{upper}_ACTIONS")
        doc = f"The line of table {table.table.name} that matches admitted inputs{table.where}: its position; -1 none, -2 several."
        yield PyFunction(f"{name}_line", "s", doc, tuple(self._match(table, upper)))
        doc = f"The same for many inputs, table {table.table.name}."
        yield PyFunction(f"{name}_lines", "states", doc, (f"    return [{name}_line(s) for s in states]",))
        yield PyFunction(
            f"_run_{name}",
            "s",
            f"Matches table {table.table.name} and runs the line.",
            tuple(self._run(table, name, actions)),
        )
        acts = tuple(self.names.module.fresh(f"_{name}_{number}") for number, _ in enumerate(table.lines))
        for act, line in zip(acts, table.lines, strict=True):
            body = tuple(action.statement for action in line.actions)
            yield PyFunction(act, "s", comment(line.source), tuple(self.text.block(body, 1)))
        self.lines.append((actions, acts))
        lines = self.names.module.fresh(f"{name.upper()}_LINES")
        self.lines.append((lines, tuple(f'"{line.name}"' for line in table.lines)))
        step = (
            self._first,
            "    if s.fault == 0:",
            "        try:",
            "            _settle(s)",
            f"            _run_{name}(s)",
            "        except _Refused as refused:",
            "            s.fault, s.fault_at = 4, refused.position",
            *self._end(),
        )
        doc = f"One step of table {table.table.name}: admits, settles, matches, acts; the fault, 0 for none."
        yield PyFunction(f"{name}_step", "s", doc, step)

    def _match(self, table: PlanTable, upper: str) -> Iterator[str]:
        matcher = table.matcher
        tail = f"{matcher.lines}, {matcher.default}"
        everything = (1 << matcher.lines) - 1
        probes = [probe for group in matcher.groups for probe in group]
        names = {
            id(probe): self._constant(f"{upper}_{at}", tuple(f"{mask:#x}," for mask in probe.masks))
            for at, probe in enumerate(probes)
        }
        groups = grouped(probes, MOST_KEYS)
        if len(groups) == 1:
            found = self._constant(f"{upper}_LINE", (f"*_lines_of({_joined(groups[0], names)}, {tail}),",))
            yield f"    return {found}[{self._index(groups[0], f'{upper}_K0')}]"
            return
        ands = []
        for at, group in enumerate(grouped(probes, MOST_GROUPED)):
            where = names[id(group[0])]
            if len(group) > 1:
                where = self._constant(f"{upper}_G{at}", (f"*{_joined(group, names)},",))
            ands.append(f"{where}[{self._index(group, f'{upper}_K{at}')}]")
        m = " & ".join(ands) or str(everything)
        if matcher.lines <= WORD:  # small masks are found fastest in a dictionary, large ones by their length
            found = self._constant(f"{upper}_ONE", (f"_one_of({tail}),",))
            yield "    try:"
            yield f"        return {found}[0][{m}]"
            yield "    except KeyError:"
            yield "        return -2"
            return
        yield f"    m = {m}"
        yield f"    return m.bit_length() - 1 if m and not m & (m - 1) else _line_of(m, {tail})"

    def _index(self, group: Group, name: str) -> str:
        """The place of the classes together: a sum, each class times how many places it moves."""
        stride = prod(len(probe.masks) for probe in group)
        terms = []
        for number, probe in enumerate(group):
            stride //= len(probe.masks)
            terms.append(self._class(probe.index, f"{name}_{number}", stride))
        return " + ".join(terms)

    def _class(self, index: Index, name: str, stride: int) -> str:
        times = f" * {stride}" if stride > 1 else ""
        match index:
            case Direct(leaf=leaf, low=low):
                place = _less(self.text.place(leaf), low)
                return f"({place}){times}" if times and low else place + times
            case Truth(condition=condition):
                return f"({self.text.expr(condition)}){times}"
            case Coded(leaf=leaf, low=low):
                runs = [(at * stride, len(list(same))) for at, same in groupby(index.classes)]
                rows = tuple(f"*({at},) * {length}," for at, length in runs)
                return f"{self._constant(name, rows)}[{_less(self.text.place(leaf), low)}]"
            case Cuts(leaf=leaf, cuts=cuts):
                return f"_bisect({tuple(cuts)!r}, {self.text.place(leaf)}){times}"

    def _run(self, table: PlanTable, name: str, actions: str) -> Iterator[str]:
        for place in table.monitored:
            assumption = self.program.assumptions[self.plan.monitored[place]]
            yield f"    if not {self.text.expr(assumption.condition)}:  # {comment(assumption.name)}"
            word, bit = divmod(place, FAILED_BITS)
            yield f"        s.{self.names.failed[word]} |= 1 << {bit}"
            if place in table.stops:
                yield "        if s.fault == 0:"
                yield f"            s.fault, s.fault_at = {int(Fault.ASSUMPTION)}, {place}"
        if table.stops:
            yield "    if s.fault != 0:"
            yield "        return"
        yield f"    line = {name}_line(s)"
        yield "    if line < 0:"
        yield "        s.fault = 2 if line == -1 else 3"
        yield "        return"
        yield "    s.line = line"
        yield f"    {actions}[line](s)"

    # --- levels ---

    def _level(self, level: Level) -> PyFunction:
        lines = [self._first, "    if s.fault == 0:", "        try:", "            _settle(s)"]
        lines += [f"            {self.text.call(name)}" for name in level.preprocess]
        if isinstance(level.tables, OneTable):
            lines.append(f"            _run_{self.names.tables[level.tables.table]}(s)")
        else:
            kind = level.tables.selector.type
            pairs = [f"{constant(kind, v)}: _run_{self.names.tables[t]}" for v, t in level.tables.tables]
            lines.append(f"            {{{', '.join(pairs)}}}[{self.text.expr(level.tables.selector)}](s)")
        if level.postprocess:
            lines.append("            if s.fault == 0:")
            lines += [f"                {self.text.call(name)}" for name in level.postprocess]
        lines += ["        except _Refused as refused:", "            s.fault, s.fault_at = 4, refused.position",
                  *self._end()]  # fmt: skip
        doc = f"One cycle of level {level.name}, every {level.period_ms} ms; the fault, 0 for none."
        return PyFunction(f"{self.names.levels[level.name]}_cycle", "s", doc, tuple(lines))


def _less(place: str, low: int) -> str:
    """The place less `low`."""
    return place if low == 0 else f"{place} - {low}" if low > 0 else f"{place} + {-low}"


def _joined(group: Group, names: dict[int, str]) -> str:
    """The masks of a group, made when the module is imported."""
    return f"_joined({', '.join(names[id(probe)] for probe in group)})"


def _typed(kind: Scalar, value: str) -> str:
    """What gives the value as one of its kind, and a NaN, which no range holds, where it is none."""
    return f"{'_real' if isinstance(kind, Real) else '_whole'}({value})"
