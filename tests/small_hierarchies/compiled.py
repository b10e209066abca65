"""A level's cycle, and what its program states, as Python functions: enumeration runs hundreds of thousands of cycles.

In: a program and its level. Out: a `Compiled`, whose `run` does what `Role.run` does by the interpreter's parts, and tells which inputs
were read. It is held against these: a part of the cycles of every enumeration is run by both (`Role.confirmed`, `Role.same`). It shares the
meaning of operators with the interpreter (`operator_table`), as every stage does.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from rcsc.lang.interpret import ExternError, Fault, _admitted
from rcsc.lang.model import (
    BEFORE,
    Among,
    Apply,
    Assign,
    Call,
    Case,
    Default,
    Expr,
    For,
    If,
    Kind,
    Level,
    Line,
    Literal,
    Local,
    OneTable,
    Op,
    Procedure,
    Program,
    Read,
    ReadLocal,
    Real,
    Select,
    Single,
    Statement,
    Table,
    ToElement,
    ToLeaf,
    Value,
    key_bounds,
    pending,
)
from rcsc.lang.operator_table import single

State: TypeAlias = dict[str, Value]
Answers: TypeAlias = Callable[[Procedure, list[Value]], tuple[Value, ...]]
Stated: TypeAlias = Callable[[Mapping[str, Value], Mapping[str, Value]], bool]
Cycle: TypeAlias = Callable[[State, set[str], Answers], tuple[str, str, Fault, frozenset[str], State, bool]]
"""Changes the state in place and takes what it reads; gives the table, the line, the fault, the assumptions that fail, the state halfway,
and whether the cycle ended before its line was done, though one or none was to run."""

_INFIX = {
    Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=", Op.ADD: "+", Op.SUB: "-", Op.MUL: "*",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Compiled:
    """Functions of one program.

    Attributes:
        run: One cycle of the level, after which outputs do not show safe values yet.
        settle: Its first part: deferred states and preprocess; raises where an extern procedure is refused.
        in_range: Whether every leaf of a state is in range.
        stated: Each invariant's condition, then each property's, then each that neighbours owe each other: of the state after a cycle and
            of that before it.
    """

    run: Cycle
    settle: Callable[[State, set[str], Answers], None]
    in_range: Callable[[Mapping[str, Value]], bool]
    stated: tuple[Stated, ...]


def compiled(program: Program, level: Level, between: tuple[Expr, ...] = ()) -> Compiled:
    """The functions of a level; conditions `between` levels are stated last."""
    space = executed(program, Writer(program, level, between).written())
    many = len(program.invariants) + len(program.properties) + len(between)
    stated = tuple(space[f"stated_{at}"] for at in range(many))
    return Compiled(space["run"], space["settle"], space["in_range"], stated)


def executed(program: Program, lines: Iterable[str]) -> dict[str, Any]:
    """Execute what a `Writer` wrote of a program; return its functions, by name."""
    space: dict[str, Any] = {
        **{f"op_{op.name}": op.meaning for op in Op},
        **{f"extern_{at}": procedure for at, procedure in enumerate(program.procedures)},
        **{f"variable_{at}": variable for at, variable in enumerate(program.variables)},
        "admitted": _admitted, "ExternError": ExternError, "Fault": Fault, "at": _at, "rounded": _rounded,
    }  # fmt: skip
    exec(compile("\n".join(lines), f"<{program.name}>", "exec"), space)  # noqa: S102  # made here
    return space


def _at(leaves: Sequence[str], index: Value) -> str:
    at = int(index)
    if not 0 <= at < len(leaves):
        raise IndexError(at)
    return leaves[at]


def _rounded(value: Value) -> Value:
    return single(value) if isinstance(value, float) else value


@dataclass(slots=True)
class Writer:
    """Writes the functions; `s` is the state, `r` takes what is read, `x` answers for extern procedures, `b` is the state before.

    Attributes:
        states: Whether what is written next is of a state and the one before it, else of a cycle.
    """

    program: Program
    level: Level
    between: tuple[Expr, ...]
    inputs: frozenset[str] = field(init=False)
    _places: dict[str, int] = field(init=False)
    _procedures: dict[str, int] = field(init=False)
    states: bool = False

    def __post_init__(self) -> None:
        self.inputs = frozenset(str(v.name) for v in self.program.variables if v.kind is Kind.INPUT)
        self._places = {str(v.name): at for at, v in enumerate(self.program.variables)}
        self._procedures = {str(procedure.name): at for at, procedure in enumerate(self.program.procedures)}

    def written(self) -> Iterator[str]:
        """All of it, line by line."""
        for procedure in self.program.procedures:
            yield from self._procedure(procedure)
        yield from self._settle()
        for at, table in enumerate(self.program.tables):
            yield from self._table(at, table)
        yield from self._run()
        yield from self._in_range()
        self.states = True
        conditions = [invariant.condition for invariant in self.program.invariants]
        conditions += [stated.condition for stated in self.program.properties]
        conditions += self.between
        for at, condition in enumerate(conditions):
            yield f"def stated_{at}(s, b):"
            yield f"  return bool({self.of(condition)})"

    # --- expressions ---

    def of(self, expr: Expr) -> str:
        """Return the expression as Python."""
        match expr:
            case Literal(value=value):
                return repr(value)
            case Read(name=name):
                return self._read(str(name))
            case ReadLocal(name=name):
                return f"l_{name}"
            case Select(leaves=leaves, index=index):
                return self._selected([str(leaf) for leaf in leaves], index)
            case Among(subject=subject, values=values):
                return f"({self.of(subject)} in {tuple(values)!r})"
            case Apply(op=op, args=args):
                return self._applied(op, args)

    def _read(self, name: str) -> str:
        if self.states:
            return f"b[{name.removeprefix(BEFORE)!r}]" if name.startswith(BEFORE) else f"s[{name!r}]"
        return f"(r.add({name!r}) or s[{name!r}])" if name in self.inputs else f"s[{name!r}]"

    def _selected(self, leaves: list[str], index: Expr) -> str:
        every = "".join(f"lambda: {self._read(leaf)}, " for leaf in leaves)
        return f"at(({every}), {self.of(index)})()"

    def _applied(self, op: Op, args: tuple[Expr, ...]) -> str:
        parts = [self.of(arg) for arg in args]
        if op is Op.AND:
            return f"(bool({parts[0]}) and bool({parts[1]}))"
        if op is Op.OR:
            return f"(bool({parts[0]}) or bool({parts[1]}))"
        if op is Op.IMPLIES:
            return f"(not {parts[0]} or bool({parts[1]}))"
        if op is Op.XOR:
            return f"(bool({parts[0]}) is not bool({parts[1]}))"
        if isinstance(args[0].type, Real):
            parts = [f"float({part})" for part in parts]
        text = (
            f"({parts[0]} {_INFIX[op]} {parts[1]})" if op in _INFIX else f"op_{op.name}({', '.join(parts)})"
        )
        return f"rounded({text})" if isinstance(args[0].type, Single) else text

    def _kept(self, expr: Expr) -> str:
        """-0.0 is 0.0 wherever it is kept."""
        return f"({self.of(expr)} + 0.0)" if isinstance(expr.type, Real) else self.of(expr)

    # --- statements ---

    def _procedure(self, procedure: Procedure) -> Iterator[str]:
        at = self._procedures[str(procedure.name)]
        yield f"def p_{at}(s, r, x{''.join(f', l_{param.name}' for param in procedure.params)}):"
        if procedure.extern is None:
            yield from self._body(procedure.body, "  ")
            return
        args = [
            *(self._read(str(name)) for name in procedure.reads),
            *(f"l_{param.name}" for param in procedure.params),
        ]
        yield f"  given = x(extern_{at}, [{', '.join(args)}])"
        for place, name in enumerate(procedure.writes):
            yield f"  value = admitted(variable_{self._places[str(name)]}, given[{place}])"
            yield f"  if value is None: raise ExternError({str(name)!r})"
            yield f"  s[{str(name)!r}] = value"

    def _body(self, body: Sequence[Statement], indent: str) -> Iterator[str]:
        yield f"{indent}pass"
        for statement in body:
            yield from self._statement(statement, indent)

    def _statement(self, statement: Statement, indent: str) -> Iterator[str]:
        deeper = f"{indent}  "
        match statement:
            case Assign(place=place, value=value):
                yield f"{indent}value = {self._kept(value)}"
                yield f"{indent}{self._place(place)} = value"
            case Local(name=name, value=value):
                if value is not None:
                    yield f"{indent}l_{name} = {self._kept(value)}"
            case If(condition=condition, then=then, orelse=orelse):
                yield f"{indent}if {self.of(condition)}:"
                yield from self._body(then, deeper)
                yield f"{indent}else:"
                yield from self._body(orelse, deeper)
            case Case(subject=subject, arms=arms, orelse=orelse):
                given = f"c{len(indent)}"
                yield f"{indent}{given} = {self.of(subject)}"
                yield f"{indent}if False: pass"
                for arm in arms:
                    yield f"{indent}elif {given} in {tuple(arm.values)!r}:"
                    yield from self._body(arm.body, deeper)
                yield f"{indent}else:"
                yield from self._body(orelse, deeper)
            case For(name=name, low=low, high=high, body=inner):
                yield f"{indent}for l_{name} in range({low}, {high + 1}):"
                yield from self._body(inner, deeper)
            case Call(procedure=name, args=args):
                given = "".join(f", {self._kept(arg)}" for arg in args)
                yield f"{indent}p_{self._procedures[str(name)]}(s, r, x{given})"

    def _place(self, place: object) -> str:
        match place:
            case ToLeaf(name=name):
                return f"s[{str(name)!r}]"
            case ToElement(leaves=leaves, index=index):
                return f"s[at({tuple(map(str, leaves))!r}, {self.of(index)})]"
            case _:
                return f"l_{place.name}"  # type: ignore[attr-defined]  # the only other one

    # --- a cycle ---

    def _settle(self) -> Iterator[str]:
        yield "def settle(s, r, x):"
        yield "  pass"
        later = [(v, v.deferred_until) for v in self.program.variables if v.deferred_until is not None]
        for at, (_, until) in enumerate(later):
            yield f"  ready{at} = {self.of(until)}"
        for at, (v, _) in enumerate(later):
            yield f"  if ready{at}: s[{str(v.name)!r}] = s[{str(pending(v.name))!r}]"
        for name in self.level.preprocess:
            yield f"  p_{self._procedures[str(name)]}(s, r, x)"

    def _table(self, number: int, table: Table) -> Iterator[str]:
        yield f"def assumed_{number}(s, r):"
        yield "  failed = []"
        for assumption in self.program.assumptions:
            if assumption.name in table.assumptions:
                yield f"  if not {self.of(assumption.condition)}: failed.append({str(assumption.name)!r})"
        yield "  return frozenset(failed)"
        yield f"def matched_{number}(s, r):"
        yield "  found = []"
        for at, line in enumerate(table.lines):
            tests = [f"bool({self.of(test.condition)})" for test in line.tests if test is not None]
            yield f"  if {' and '.join(tests) or 'True'}: found.append({at})"
        yield "  return found"
        lines: list[Line | Default] = [*table.lines, *([] if table.default is None else [table.default])]
        for at, done in enumerate(lines):
            yield f"def line_{number}_{at}(s, r, x):"
            yield from self._body([action.statement for action in done.actions], "  ")
        names = "".join(f"({str(done.name)!r}, line_{number}_{at}), " for at, done in enumerate(lines))
        stops, default = frozenset(map(str, table.stops)), -1 if table.default is None else len(table.lines)
        yield f"table_{number} = ({str(table.name)!r}, assumed_{number}, {stops!r}, matched_{number}, ({names}), {default})"

    def _run(self) -> Iterator[str]:
        places = {table.name: at for at, table in enumerate(self.program.tables)}
        yield "def chosen(s, r):"
        if isinstance(self.level.tables, OneTable):
            yield f"  return table_{places[self.level.tables.table]}"
        else:
            by = "".join(f"{value!r}: table_{places[name]}, " for value, name in self.level.tables.tables)
            yield f"  return {{{by}}}[{self.of(self.level.tables.selector)}]"
        yield "def answer(s, r, x):"
        yield "  pass"
        for name in self.level.postprocess:
            yield f"  p_{self._procedures[str(name)]}(s, r, x)"
        yield _RUN

    def _in_range(self) -> Iterator[str]:
        yield "def in_range(s):"
        bounds = []
        for v in self.program.variables:
            low, high = (v.type.low, v.type.high) if isinstance(v.type, Real) else key_bounds(v.type)
            bounds.append(f"{low!r} <= s[{str(v.name)!r}] <= {high!r}")
        yield f"  return {' and '.join(bounds)}"


_RUN = """
def run(s, r, x):
  try:
    settle(s, r, x)
  except ExternError:
    return chosen(s, r)[0], "", Fault.EXTERN, frozenset(), dict(s), True
  middle = dict(s)
  name, assumed, stops, matched, lines, default = chosen(s, r)
  failed = assumed(s, r)
  if failed & stops:
    return name, "", Fault.ASSUMPTION, failed, middle, True
  found = matched(s, r)
  if len(found) > 1:
    return name, "", Fault.SEVERAL_LINES, failed, middle, False
  if not found and default < 0:
    return name, "", Fault.NO_LINE, failed, middle, False
  line, does = lines[found[0] if found else default]
  try:
    does(s, r, x)
  except ExternError:
    return name, line, Fault.EXTERN, failed, middle, True
  try:
    answer(s, r, x)
  except ExternError:
    return name, line, Fault.EXTERN, failed, middle, False
  return name, line, Fault.OK, failed, middle, False
"""
