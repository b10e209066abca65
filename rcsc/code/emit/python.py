"""A plan to Python: one module, standard library only."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from math import prod
from typing import assert_never

from rcsc.code.emit.c.layout import digest
from rcsc.code.emit.code_tree import (
    IN_PYTHON,
    Body,
    Branch,
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
    Line,
    MemberPath,
    Name,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
    read,
    when,
)
from rcsc.code.emit.decision import Cut, Decision, End, decision
from rcsc.code.emit.identifiers import DIGEST, FAILED_BITS, comment, names_in
from rcsc.code.emit.plan import (
    WORD,
    Coded,
    Cuts,
    Direct,
    Group,
    Index,
    Matcher,
    Origin,
    Plan,
    PlanTable,
    Probe,
    Sort,
    Truth,
    answering,
    first_value,
    grouped,
    stated,
    table_position,
)
from rcsc.code.emit.rendering import Rendered, render
from rcsc.code.emit.translate import (
    FAULT,
    FAULT_AT,
    FAULTED,
    FAULTLESS,
    LINE,
    STATE,
    PyText,
    constant,
    local,
    local_word,
)
from rcsc.lang import model
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Bool, Procedure, Real, Single, Variable, key_bounds, pending

MOST_DECIDED = 2048
"""Up to so many lines are parted by nested ifs, which read only what they ask for."""
MOST_ENDS = 4
"""Up to so many ends for each line: where there would be more, the masks of all leaves are joined."""
MOST_KEYS = 8192
"""Up to so many combinations of classes the line of each is looked up at once."""
MOST_GROUPED = 512
"""Up to so many combinations of classes leaves share a tuple of masks."""


def rendered_python(plan: Plan) -> dict[str, Rendered]:
    """Return the Python module of the plan, by its path below the generated folder, with where its lines come from."""
    maker = _Maker(plan)
    file = f"python/{maker.names.program}.py"
    return {file: render("module.py.jinja", maker.view(), file)}


class _Maker:
    """Builds the view of one plan."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.program = plan.program
        self.names = names_in(plan)
        self.text = PyText(self.names)
        self.origin = Origin(Sort.PROGRAM, plan.program.name)
        self.constants: list[tuple[str, tuple[str, ...]]] = []
        self.tables: list[Origin] = []
        """Of each constant the table that it is made for."""
        self.lines: list[tuple[str, tuple[str, ...], Origin]] = []
        externs = [p.extern.python for p in self.program.procedures if p.extern is not None]
        self.modules = {
            module: self.names.module.fresh(f"_{module.replace('.', '_')}")
            for module in dict.fromkeys(extern.partition(":")[0] for extern in externs)
        }

    def view(self) -> dict[str, object]:
        """Return the values that the template lays out."""
        functions = [self._procedure(p) for p in self.program.procedures]
        functions += [self._check(), self._admit(), self._settle(), *self._safe(), *self._begin()]
        for table in self.plan.tables:
            functions += self._table(table)
        functions += [self._level(level) for level in self.program.levels]
        attributes = [
            (self.names.attributes[v.name], IN_PYTHON.code(constant(v.type, v.initial)), comment(v.doc))
            for v in self.program.variables
        ]
        return {
            "plan": self.plan,
            "source": comment(self.plan.source),
            "enums": [
                (self.names.classes[e.name], self.names.class_members[e.name], Origin(Sort.TYPE, e.name))
                for e in self.program.enums
            ],
            "attributes": attributes,
            "failed": self.names.failed,
            "digest": digest(self.program, self.names).state,
            "foreign": len(self.program.variables) + len(self.program.invariants),
            "imports": self.modules.items(),
            "constants": [(*made, of) for made, of in zip(self.constants, self.tables, strict=True)],
            "whole": self.origin,
            "functions": functions,
            "lines": self.lines,
            "singles": any(
                isinstance(node, Invoke) and node.function == "_single" for node in read(tuple(functions))
            ),
        }

    def _constant(self, wanted: str, rows: tuple[str, ...]) -> Name:
        """Add a tuple to the module; return its name."""
        name = self.names.module.fresh(wanted)
        self.constants.append((name, rows))
        return Name(name)

    def _on_state(self, doc: str, name: str, *body: Stmt, origin: Origin | None = None) -> Function:
        """A function of the state; of all of the program where no other origin is given."""
        return Function(doc, f"{name}(s)", body, origin=origin or self.origin)

    # --- procedures ---

    def _procedure(self, procedure: Procedure) -> Function:
        params = ", ".join(["s", *(local_word(p.name) for p in procedure.params)])
        body = self._extern(procedure) if procedure.extern is not None else self.text.block(procedure.body)
        head = f"_do_{self.names.procedures[procedure.name]}({params})"
        origin = Origin(Sort.PROCEDURE, procedure.name)
        return Function(comment(stated(procedure, self.plan.files)), head, tuple(body), origin=origin)

    def _extern(self, procedure: Procedure) -> Iterator[Stmt]:
        assert procedure.extern is not None
        variables = {v.name: (at, v) for at, v in enumerate(self.program.variables)}
        results = [variables[name] for name in procedure.writes]
        module, _, function = procedure.extern.python.partition(":")
        args: list[Code] = [self.text.place(name) for name in procedure.reads]
        args += [local(p.name) for p in procedure.params]
        call, given = Invoke(f"{self.modules[module]}.{function}", tuple(args)), Name("given")
        if not results:
            yield Do(call)
            return
        yield Set(given, call)
        yield when(Prefix("not ", Invoke("isinstance", (given, Name("tuple")))), Set(given, Items((given,))))
        several = infix("!=", Invoke("len", (given,)), Constant(len(results)))
        yield when(several, _refused(results[0][0]))
        for number, (at, variable) in enumerate(results):
            value = Name(f"w{number}")
            yield Set(value, _typed(variable.type, Element(given, Constant(number))))
            yield from _admitted(variable, value, _refused(at))
            yield Set(self.text.place(variable.name), value)

    # --- admission ---

    def _trace(self, *more: Stmt) -> Body:
        """Return statements that set the trace of a cycle that has run no line."""
        failed = (Set(MemberPath((word,)), Constant(0)) for word in self.names.failed)
        return (Set(LINE, Constant(-1)), *more, *failed)

    def _admit(self) -> Function:
        """Return the function that admits inputs: it looks at every one before it changes any."""
        inputs = [(at, v) for at, v in enumerate(self.program.variables) if v.kind is model.Kind.INPUT]
        values = [Name(f"i{number}") for number, _ in enumerate(inputs)]
        body: list[Stmt] = []
        for value, (at, variable) in zip(values, inputs, strict=True):
            body.append(Set(value, _typed(variable.type, self.text.place(variable.name))))
            body += _admitted(variable, value, Leave(Invoke("_refused", (STATE, Constant(at)))))
        stores = (Set(self.text.place(v.name), value) for value, (_, v) in zip(values, inputs, strict=True))
        trace = self._trace(Set(FAULT_AT, Constant(-1)))
        return self._on_state(
            "Admits every input; the fault.", "_admit", *trace, *body, *stores, Leave(Constant(0))
        )

    def _check(self) -> Function:
        """Return the function that checks the state, as in C."""
        body = [when(infix("!=", MemberPath((DIGEST,)), Name("DIGEST")), Leave(Name("FOREIGN")))]
        for at, variable in enumerate(self.program.variables):
            if variable.kind is not model.Kind.INPUT or isinstance(variable.type, Bool):
                place = self.text.place(variable.name)
                types = Name("(int, float)" if isinstance(variable.type, Real) else "int")
                fits = infix("and", Invoke("isinstance", (place, types)), _within(variable.type, place))
                if isinstance(variable.type, Single):
                    fits = infix("and", fits, infix("==", Invoke("_single", (place,)), place))
                body.append(when(Prefix("not ", fits), Leave(Constant(at))))
        for at, invariant in enumerate(self.program.invariants, len(self.program.variables)):
            body.append(when(Prefix("not ", self.text.expr(invariant.condition)), Leave(Constant(at))))
        doc = (
            "Whether the state may be gone on from: -1; FOREIGN where other tables made it; else the position of the first variable "
            "outside its range or, counted after the variables, of the first invariant that does not hold."
        )
        return self._on_state(doc, "check", *body, Leave(Constant(-1)))

    def _begin(self) -> Iterator[Function]:
        if self.plan.defensive:
            at = Name("at")
            yield self._on_state(
                "Checks the state, then admits every input; the fault.",
                "_begin",
                Set(at, Invoke("check", (STATE,))),
                when(infix("<", at, Constant(0)), Leave(Invoke("_admit", (STATE,)))),
                *self._trace(Set(FAULT_AT, at)),
                Leave(Constant(Fault.STATE)),
            )

    def _settle(self) -> Function:
        deferred = [(v, v.deferred_until) for v in self.program.variables if v.deferred_until is not None]
        lets = (Set(Name(f"ready{at}"), self.text.expr(until)) for at, (_, until) in enumerate(deferred))
        sets = (
            when(Name(f"ready{at}"), Set(self.text.place(v.name), self.text.place(pending(v.name))))
            for at, (v, _) in enumerate(deferred)
        )
        none = (Set(self.text.place(leaf), Constant(0)) for leaf in self.program.line_leaves.values())
        return self._on_state(
            "Deferred variables take their next values, all at once.", "_settle", *lets, *sets, *none
        )

    def _safe(self) -> Iterator[Function]:
        pairs = [
            (variable, variable.safe) for variable in self.program.variables if variable.safe is not None
        ]
        if pairs:
            shown = (
                Set(self.text.place(variable.name), constant(variable.type, safe)) for variable, safe in pairs
            )
            yield self._on_state("After a fault: outputs that have a safe value show it.", "_safe", *shown)

    def _cycle(self, doc: str, name: str, origin: Origin, *body: Stmt) -> Function:
        """The frame of every step and cycle."""
        begin = Invoke("_begin" if self.plan.defensive else "_admit", (STATE,))
        shown = any(variable.safe is not None for variable in self.program.variables)
        safe = (when(FAULTED, _run("_safe")),) if shown else ()
        run = Frame(("try:",), (_run("_settle"), *body))
        refused = Frame(("except _Refused as refused:",), (_faulted(Fault.EXTERN, Name("refused.position")),))
        all_ = Set(FAULT, begin), when(FAULTLESS, run, refused), *safe, Leave(FAULT)
        return self._on_state(doc, name, *all_, origin=origin)

    # --- tables ---

    def _table(self, table: PlanTable) -> Iterator[Function]:
        name = self.names.tables[table.table.name]
        upper = f"_{name.upper()}"
        actions = self.names.module.fresh(f"{upper}_ACTIONS")
        doc = f"The line of table {table.table.name} that matches admitted inputs{table.where}: its position; -1 none, -2 several."
        matched = tuple(self._match(table, upper))
        self.tables += [table.origin] * (len(self.constants) - len(self.tables))
        yield self._on_state(doc, f"{name}_line", *matched, origin=table.origin)
        many = Leave(Name(f"[{name}_line(s) for s in states]"))
        same = f"The same for many inputs, table {table.table.name}."
        yield Function(same, f"{name}_lines(states)", (many,), origin=table.origin)
        doc = f"Matches table {table.table.name} and runs the line.{comment(answering(table.table.requirements))}"
        yield self._on_state(doc, f"_run_{name}", *self._run(table, name, actions), origin=table.origin)
        acts = tuple(self.names.module.fresh(f"_{name}_{number}") for number, _ in enumerate(table.lines))
        for act, line in zip(acts, table.lines, strict=True):
            body = self.text.block([action.statement for action in line.actions])
            origin = Origin(Sort.LINE, table.table.name, line.name)
            yield self._on_state(comment(line.place), act, *body, origin=origin)
        self.lines.append((actions, acts, table.origin))
        lines = self.names.module.fresh(f"{name.upper()}_LINES")
        self.lines.append((lines, tuple(f'"{line.name}"' for line in table.lines), table.origin))
        doc = f"One step of table {table.table.name}: admits, settles, matches, acts; the fault, 0 for none."
        yield self._cycle(doc, f"{name}_step", table.origin, _run(f"_run_{name}"))

    def _match(self, table: PlanTable, upper: str) -> Iterator[Stmt]:
        matcher = table.matcher
        probes = [probe for group in matcher.groups for probe in group]
        everyone = (1 << matcher.lines) - 1
        if matcher.lines <= MOST_DECIDED:
            decided = decision([probe.masks for probe in probes], everyone, MOST_ENDS * (matcher.lines + 1))
            if decided is not None:
                yield from self._decided(decided, matcher, probes)
                return
        yield from self._joined(matcher, probes, upper)

    def _decided(self, decided: Decision, matcher: Matcher, probes: Sequence[Probe]) -> Iterator[Stmt]:
        """Yield an `if` for each cut; each end returns its one line, or tells that none or several hold there."""
        match decided:
            case End(lines=0):
                yield Leave(Constant(matcher.lines if matcher.default else -1))
            case End(lines=lines):
                yield Leave(Constant(lines.bit_length() - 1 if lines.bit_count() == 1 else -2))
            case Cut(below=below, above=above):
                one, other = (tuple(self._decided(side, matcher, probes)) for side in (above, below))
                yield Branch(((self._reaches(probes[decided.probe].index, decided.first), one),), other)

    def _reaches(self, index: Index, number: int) -> Code:
        """Return the condition that the class is at least `number`."""
        match index:
            case Truth(condition=condition):
                return self.text.expr(condition)
            case Direct(leaf=leaf, type=Bool()):
                return self.text.place(leaf)
            case Direct(leaf=leaf) | Coded(leaf=leaf):
                return infix(">=", self.text.place(leaf), Constant(int(first_value(index, number))))
            case Cuts(leaf=leaf, type=kind):
                return infix(">=", self.text.place(leaf), constant(kind, first_value(index, number)))
            case _:
                assert_never(index)

    def _joined(self, matcher: Matcher, probes: Sequence[Probe], upper: str) -> Iterator[Stmt]:
        """Yield code that joins the masks of all leaves and returns the line."""
        tail = f"{matcher.lines}, {matcher.default}"
        names = {
            id(probe): self._constant(f"{upper}_{at}", tuple(f"{mask:#x}," for mask in probe.masks))
            for at, probe in enumerate(probes)
        }
        groups = grouped(probes, MOST_KEYS)
        if len(groups) == 1:
            lookup = self._constant(f"{upper}_LINE", (f"*_lines_of({_joined(groups[0], names)}, {tail}),",))
            yield Leave(Element(lookup, self._index(groups[0], f"{upper}_K0")))
            return
        ands: list[Code] = []
        for at, group in enumerate(grouped(probes, MOST_GROUPED)):
            where = names[id(group[0])]
            if len(group) > 1:
                where = self._constant(f"{upper}_G{at}", (f"*{_joined(group, names)},",))
            ands.append(Element(where, self._index(group, f"{upper}_K{at}")))
        masks = Infix("&", tuple(ands)) if ands else Constant((1 << matcher.lines) - 1)
        if matcher.lines <= WORD:  # small masks are found fastest in a dictionary, large ones by their length
            lookup = self._constant(f"{upper}_ONE", (f"_one_of({tail}),",))
            yield Frame(("try:",), (Leave(Element(Element(lookup, Constant(0)), masks)),))
            yield Frame(("except KeyError:",), (Leave(Constant(-2)),))
            return
        yield Set(Name("m"), masks)
        yield Leave(Name(f"m.bit_length() - 1 if m and not m & (m - 1) else _line_of(m, {tail})"))

    def _index(self, group: Group, name: str) -> Code:
        """Return the joint index of the classes: a sum, each class times its stride."""
        stride = prod(len(probe.masks) for probe in group)
        index: Code | None = None
        for number, probe in enumerate(group):
            stride //= len(probe.masks)
            index = self._class(probe.index, f"{name}_{number}", stride, index)
        assert index is not None
        return index

    def _class(self, index: Index, name: str, stride: int, before: Code | None) -> Code:
        """Return the class of one leaf times the stride, added to the code before it."""
        match index:
            case Direct(leaf=leaf, low=low) if stride == 1:
                return _less(_plus(before, self.text.place(leaf)), low)
            case Direct(leaf=leaf, low=low):
                leaf_class = _less(self.text.place(leaf), low)
            case Truth(condition=condition):
                leaf_class = Round(self.text.expr(condition))
            case Coded(leaf=leaf, low=low):
                runs = [(at * stride, len(list(same))) for at, same in groupby(index.classes)]
                rows = tuple(f"*({at},) * {length}," for at, length in runs)
                return _plus(before, Element(self._constant(name, rows), _less(self.text.place(leaf), low)))
            case Cuts(leaf=leaf, cuts=cuts):
                leaf_class = Invoke("_bisect", (Name(repr(cuts)), self.text.place(leaf)))
            case _:
                assert_never(index)
        return _plus(before, infix("*", leaf_class, Constant(stride)) if stride > 1 else leaf_class)

    def _run(self, table: PlanTable, name: str, actions: str) -> Iterator[Stmt]:
        for place in table.monitored:
            assumption = self.program.assumptions[self.plan.monitored[place]]
            word, bit = divmod(place, FAILED_BITS)
            test = Prefix("not ", self.text.expr(assumption.condition))
            mark = Frame((MemberPath((self.names.failed[word],)), f" |= 1 << {bit}"))
            ended = when(FAULTLESS, _faulted(Fault.ASSUMPTION, Constant(place)))
            stop = (ended,) if place in table.stops else ()
            yield Frame(("if ", test, f":  # {comment(assumption.name)}"), (mark, *stop))
        if table.stops:
            yield when(FAULTED, Line("return"))
        line = Name("line")
        none = infix("==", line, Constant(-1))
        fault = Choice(none, Constant(Fault.NO_LINE), Constant(Fault.SEVERAL_LINES))
        yield Set(line, Invoke(f"{name}_line", (STATE,)))
        yield when(infix("<", line, Constant(0)), Set(FAULT, fault), Line("return"))
        yield Set(LINE, line)
        leaf = self.program.line_leaves.get(table.table.name)
        if leaf is not None:
            yield Set(self.text.place(leaf), infix("+", line, Constant(1)))
        yield _run(f"{actions}[line]")

    # --- levels ---

    def _level(self, level: model.Level) -> Function:
        before = (Do(self.text.call(name)) for name in level.preprocess)
        after = [Do(self.text.call(name)) for name in level.postprocess]
        doc = f"One cycle of level {level.name}, every {level.period_ms} ms; the fault, 0 for none."
        last = _run(self._chosen(level.tables))
        rest: Body = (last, when(FAULTLESS, *after)) if after else (last,)
        for stage in reversed(level.stages):
            rest = (*self._stage(stage), when(FAULTLESS, *rest))
        name, origin = f"{self.names.levels[level.name]}_cycle", Origin(Sort.LEVEL, level.name)
        return self._cycle(doc, name, origin, *before, *rest)

    def _chosen(self, choice: model.TableChoice) -> str:
        """Spell the function of the table that a choice runs."""
        if isinstance(choice, model.OneTable):
            return f"_run_{self.names.tables[choice.table]}"
        selector = choice.selector
        pairs = [(constant(selector.type, v), self.names.tables[t]) for v, t in choice.tables]
        rows = ", ".join(f"{IN_PYTHON.code(value)}: _run_{stem}" for value, stem in pairs)
        return f"{{{rows}}}[{IN_PYTHON.code(self.text.expr(selector))}]"

    def _stage(self, choice: model.TableChoice) -> Iterator[Stmt]:
        """Yield code for a table that others follow, as in C: the line is the last table's; a fault for want of a line names this one."""
        yield Frame(("try:",), (_run(self._chosen(choice)),))
        yield Frame(("finally:",), (Set(LINE, Constant(-1)),))
        unmatched = infix("<=", Constant(Fault.NO_LINE), FAULT, Constant(Fault.SEVERAL_LINES))
        at: Code = Constant(table_position(self.program, choice.names[0]))
        if isinstance(choice, model.TableByCommand):
            pairs = [
                f"{IN_PYTHON.code(constant(choice.selector.type, v))}: {table_position(self.program, t)}"
                for v, t in choice.tables
            ]
            at = Name(f"{{{', '.join(pairs)}}}[{IN_PYTHON.code(self.text.expr(choice.selector))}]")
        yield when(unmatched, Set(FAULT_AT, at))


def _run(name: str) -> Do:
    return Do(Invoke(name, (STATE,)))


def _faulted(fault: Fault, at: Code) -> Frame:
    return Frame((FAULT, ", ", FAULT_AT, " = ", Constant(fault), ", ", at))


def _refused(position: int) -> Leave:
    return Leave(Invoke("_Refused", (Constant(position),)), "raise")


def _admitted(variable: Variable, place: Code, refuse: Stmt) -> Iterator[Stmt]:
    """Yield statements that clamp the place, or refuse; a NaN satisfies no comparison."""
    kind = variable.type
    low, high = _ends(kind)
    if variable.admit is model.Admit.CLAMP:
        ends = ((infix("<", place, low), low), (infix(">", place, high), high))
        yield Branch(tuple((test, (Set(place, end),)) for test, end in ends))
    yield when(Prefix("not ", _within(kind, place)), refuse)
    if isinstance(kind, Real):
        yield Set(place, infix("+", place, constant(kind, 0)))


def _ends(kind: model.Scalar) -> tuple[Constant, Constant]:
    """Return the ends of a range; those of a truth are 0 and 1."""
    if isinstance(kind, Real):
        return constant(kind, kind.low), constant(kind, kind.high)
    low, high = key_bounds(kind)
    return Constant(low), Constant(high)


def _within(kind: model.Scalar, place: Code) -> Code:
    low, high = _ends(kind)
    return infix("<=", low, place, high)


def _less(place: Code, low: int) -> Code:
    """Return the place less `low`."""
    return place if low == 0 else infix("-" if low > 0 else "+", place, Constant(abs(low)))


def _plus(before: Code | None, more: Code) -> Code:
    return more if before is None else infix("+", before, more)


def _joined(group: Group, names: dict[int, Name]) -> str:
    """Spell the joined masks of a group, computed when the module is imported."""
    return f"_joined({', '.join(names[id(probe)].text for probe in group)})"


def _typed(kind: model.Scalar, value: Code) -> Code:
    """Return code that converts the value to its kind, or to a NaN, which no range holds."""
    if isinstance(kind, Single):
        return Invoke("_single", (Invoke("_real", (value,)),))
    return Invoke("_real" if isinstance(kind, Real) else "_whole", (value,))
