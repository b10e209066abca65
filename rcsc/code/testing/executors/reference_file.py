"""The reference C of a whole program: line scans, steps and cycles, as `rcsc.lang.interpret` has them.

In: a program and the symbols of its emitted C. Out: the text of one C file, to be included after the
emitted header. Functions: `ref_t<i>_line`, `ref_t<i>_step` (table i), `ref_l<i>_cycle` (level i),
`ref_t<i>_safe` (no stopping assumption of table i fails), `ref_ranges`, `ref_invariants`, `ref_init`.
"""

from collections.abc import Iterable, Iterator, Mapping

from rcsc.code.testing.executors.edges import relational_tests
from rcsc.code.testing.executors.reference import Writer, constant, outside_tests, refusal, settling
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.interpret import Fault
from rcsc.lang.meaning import checked
from rcsc.lang.model import (
    Kind,
    Level,
    OneTable,
    Program,
    Real,
    Statement,
    Table,
    TableChoice,
    TableName,
    Variable,
    pending,
)

PRELUDE = """
#if defined(__SIZEOF_INT128__)
typedef __int128 ref_wide;
#else
typedef int64_t ref_wide; /* programs that need more are not tested on this target */
#endif
#define REF_NONE (-1)
typedef struct {
  int32_t fault; int32_t fault_at; int32_t line; uint8_t failed[REF_ASSUMPTIONS];
} ref_trace_t;
static void ref_refused(ref_trace_t *r, int at) {
  if (at != 0) { r->fault = 4; r->fault_at = at - 1; }
}
static double ref_zero(double x) { return (x == 0.0) ? 0.0 : x; }
static float ref_zero_f(float x) { return (x == 0.0f) ? 0.0f : x; }
static int ref_sign(double x) {
  union { double d; uint64_t u; } bits; bits.d = x; return (int)(bits.u >> 63);
}
"""

EXTREMES = """
static {T} ref_min_{T}({T} a, {T} b) {{ return (b < a) ? b : a; }}
static {T} ref_max_{T}({T} a, {T} b) {{ return (b > a) ? b : a; }}
static {T} ref_abs_{T}({T} a) {{ return (a <= 0) ? (0 - a) : a; }}
"""


def inputs(program: Program) -> tuple[Variable, ...]:
    """The leaves that are admitted, in declared order."""
    return tuple(v for v in program.variables if v.kind is Kind.INPUT)


def _admit(writer: Writer) -> Iterator[str]:
    """Refuse the first reading outside its range, else clamp where declared."""
    program, symbols = writer.program, writer.symbols
    yield f"static int32_t ref_admit({symbols.struct} *s) {{"
    yield "(void)s;"
    for variable in inputs(program):
        leaf_type, refused = symbols.c_type(variable.name), str(symbols.fault_at(variable.name))
        yield from refusal(variable, writer.place(variable.name), leaf_type, refused)
    for variable in inputs(program):
        yield from settling(variable, writer.place(variable.name), symbols.c_type(variable.name))
    yield "return REF_NONE; }"


def _deferred(writer: Writer) -> Iterator[str]:
    """All `until` conditions on one snapshot, then the values at once."""
    program = writer.program
    deferred = [(v, v.deferred_until) for v in program.variables if v.deferred_until is not None]
    yield f"static void ref_deferred({writer.symbols.struct} *s) {{"
    yield "(void)s;"
    for i, (_, until) in enumerate(deferred):
        yield f"const int32_t due{i} = {writer.expr(until)};"
    for i, (variable, _) in enumerate(deferred):
        to, of = writer.place(variable.name), writer.place(pending(variable.name))
        yield f"if (due{i}) {{ {to} = {of}; }}"
    yield from (f"{writer.place(leaf)} = 0;" for leaf in program.line_leaves.values())
    yield "}"


def _safe_values(writer: Writer) -> Iterator[str]:
    """After a fault: outputs that have a safe value show it."""
    yield f"static void ref_safe({writer.symbols.struct} *s) {{ (void)s;"
    for variable in writer.program.variables:
        if variable.safe is not None:
            value = constant(variable.type, variable.safe)
            yield f"{writer.place(variable.name)} = ({writer.symbols.c_type(variable.name)}){value};"
    yield "}"


def line_function(writer: Writer, number: int, table: Table) -> Iterator[str]:
    """The line that matches: index, `len(lines)` for DEFAULT, -1 for none, -2 for several."""
    struct = writer.symbols.struct
    tests = {id(test): i for i, test in enumerate(table.distinct_tests)}
    for at, test in enumerate(relational_tests(table)):
        yield f"static int32_t ref_t{number}_test{at}(const {struct} *s) {{"
        yield f"return {writer.expr(test.condition)}; }}"
    yield f"static int32_t ref_t{number}_line(const {struct} *s) {{"
    yield "(void)s; int32_t found = -1; int32_t many = 0;"
    for i, test in enumerate(table.distinct_tests):
        yield f"const int32_t c{i} = {writer.expr(test.condition)};"
    for index, line in enumerate(table.lines):
        cells = sorted({tests[id(test)] for test in line.tests if test is not None})
        holds = " && ".join(f"c{i}" for i in cells) or "1"
        yield f"if ({holds}) {{ many += 1; found = {index}; }}"
    none = -1 if table.default is None else len(table.lines)
    yield f"return (many == 1) ? found : (many == 0) ? {none} : -2; }}"


def _actions(writer: Writer, number: int, table: Table) -> Iterator[str]:
    """What each line does; not 0 where an extern's results are refused (see `Writer.procedure`)."""
    yield f"static int ref_t{number}_act({writer.symbols.struct} *s, int32_t line) {{"
    yield "(void)s; switch (line) {"
    for index, (_, actions) in enumerate(all_lines(table)):
        yield f"case {index}: {{"
        yield from writer.statements(actions)
        yield "break; }"
    yield "default: break; } return 0; }"


def all_lines(table: Table) -> list[tuple[str, tuple[Statement, ...]]]:
    """Name and statements of every line, DEFAULT last."""
    return [(str(line.name), tuple(a.statement for a in line.actions)) for line in table.every_line]


def monitored(program: Program) -> tuple[str, ...]:
    """Names of the assumptions that the executors check, in order."""
    return tuple(str(program.assumptions[at].name) for at in checked(program))


def fault_named(program: Program, symbols: Symbols, fault: int, at: int) -> str:
    """The leaf that was refused, the assumption that ended the cycle, or the table before the last that had no line; else empty."""
    if fault in (Fault.NO_LINE, Fault.SEVERAL_LINES) and 0 <= at < len(program.tables):
        return str(program.tables[at].name)
    if fault in (Fault.ADMIT, Fault.EXTERN):
        return symbols.leaf_at(at)
    names = monitored(program)
    if fault == Fault.ASSUMPTION:
        return names[at] if 0 <= at < len(names) else f"assumption {at}"
    return ""


def _monitors(writer: Writer, number: int, table: Table) -> Iterator[str]:
    """Which of the table's assumptions fail that are checked; the first that stops the cycle is its fault."""
    yield f"static void ref_t{number}_monitors(const {writer.symbols.struct} *s, ref_trace_t *r) {{"
    yield "(void)s; (void)r;"
    names = monitored(writer.program)
    for assumption in writer.program.assumptions:
        stops = assumption.name in table.stops
        told = assumption.standing.checked and assumption.name in table.assumptions
        if stops or told:
            at = names.index(str(assumption.name))
            yield f"r->failed[{at}] = (uint8_t)!{writer.expr(assumption.condition)};"
            if stops:
                yield f"if (r->failed[{at}] && r->fault == 0) {{ r->fault = 5; r->fault_at = {at}; }}"
    yield "}"


def _safe(writer: Writer, number: int, table: Table) -> Iterator[str]:
    """Whether the table may be matched: its conditions are defined."""
    yield f"static int32_t ref_t{number}_safe(const {writer.symbols.struct} *s) {{"
    used = [invariant.condition for invariant in writer.program.invariants]
    used += [a.condition for a in writer.program.assumptions if a.name in table.stops]
    yield f"(void)s; return {' && '.join(writer.expr(expr) for expr in used) or '1'}; }}"


def _known(writer: Writer) -> Iterator[str]:
    """Whether every leaf lies in its range, and whether the invariants hold."""
    program, symbols = writer.program, writer.symbols
    yield f"static int32_t ref_ranges(const {symbols.struct} *s, int32_t with_inputs) {{"
    yield "(void)s; (void)with_inputs; int32_t good = 1;"
    for variable in program.variables:
        place = writer.place(variable.name)
        below, above = outside_tests(variable, place, symbols.c_type(variable.name))
        free = "with_inputs && " if variable.kind is Kind.INPUT else ""
        strange = f" || {place} != {place} || ({place} == 0.0 && ref_sign({place}))"
        tests = f"{below} || {above}{strange if isinstance(variable.type, Real) else ''}"
        yield f"if ({free}({tests})) {{ good = 0; }}"
    yield "return good; }"
    yield f"static int32_t ref_invariants(const {symbols.struct} *s) {{"
    kept = [writer.expr(invariant.condition) for invariant in program.invariants]
    yield f"(void)s; return {' && '.join(kept) or '1'}; }}"


def _body(writer: Writer, number: int, table: Table) -> Iterator[str]:
    """Monitor, match and act, as the middle of a step or of a cycle."""
    struct = writer.symbols.struct
    yield f"static void ref_t{number}_body({struct} *s, ref_trace_t *r) {{"
    yield f"ref_t{number}_monitors(s, r); if (r->fault != 0) {{ return; }}"
    yield f"const int32_t line = ref_t{number}_line(s);"
    yield "if (line == -1) { r->fault = 2; } else if (line == -2) { r->fault = 3; } else {"
    leaf = writer.program.line_leaves.get(table.name)
    if leaf is not None:
        yield f"{writer.place(leaf)} = ({writer.symbols.c_type(leaf)})(line + 1);"
    yield f"r->line = line; ref_refused(r, ref_t{number}_act(s, line)); }} }}"


FRESH = "ref_trace_t r = {0}; r.line = -1; r.fault_at = REF_NONE; const int32_t refused = ref_admit(s);"
REFUSED = (
    "if (refused != REF_NONE) { r.fault = 1; r.fault_at = refused; ref_safe(s); return r; } ref_deferred(s);"
)
ENDED = "if (r.fault != 0) { ref_safe(s); } return r;"


def _step(writer: Writer, number: int) -> Iterator[str]:
    """One step of a table."""
    yield f"static ref_trace_t ref_t{number}_step({writer.symbols.struct} *s) {{"
    yield f"{FRESH} {REFUSED} ref_t{number}_body(s, &r); {ENDED} }}"


def _runs(writer: Writer, names: Iterable[str]) -> Iterator[str]:
    """Procedures of a pre- or postprocess, in order."""
    for name in names:
        yield f"if (r.fault == 0) {{ ref_refused(&r, ref_p{writer.number(name)}(s)); }}"


def _chosen(writer: Writer, choice: TableChoice, run: Mapping[TableName, str]) -> Iterator[str]:
    """Run the table of a choice."""
    if isinstance(choice, OneTable):
        yield run[choice.table]
        return
    yield f"switch ((int64_t){writer.expr(choice.selector)}) {{"
    for value, name in choice.tables:
        yield f"case {constant(choice.selector.type, value)}: {run[name]} break;"
    yield "default: break; }"


def _cycle(writer: Writer, number: int, level: Level) -> Iterator[str]:
    """One cycle of a level."""
    positions = {table.name: i for i, table in enumerate(writer.program.tables)}
    yield f"static ref_trace_t ref_l{number}_cycle({writer.symbols.struct} *s) {{"
    yield f"{FRESH} {REFUSED}"
    yield from _runs(writer, level.preprocess)
    named = "if (r.fault == 2 || r.fault == 3) {{ r.fault_at = {at}; }}"
    stages = {
        name: f"ref_t{at}_body(s, &r); r.line = -1; {named.format(at=at)}" for name, at in positions.items()
    }
    for stage in level.stages:
        yield "if (r.fault == 0) {"
        yield from _chosen(writer, stage, stages)
        yield "}"
    yield "if (r.fault == 0) {"
    yield from _chosen(
        writer, level.tables, {name: f"ref_t{at}_body(s, &r);" for name, at in positions.items()}
    )
    yield "}"
    yield from _runs(writer, level.postprocess)
    yield f"{ENDED} }}"


def reference_c(program: Program, symbols: Symbols) -> str:
    """The whole reference as one C text; the emitted header is to be included before it."""
    writer = Writer(program, symbols)
    procedures = [list(writer.procedure(i, p)) for i, p in enumerate(program.procedures)]
    rest = [line for part in _rest(writer) for line in part]
    prototypes = [f"{lines[0].removesuffix(' {')};" for lines in procedures]
    count = max(1, len(monitored(program)))
    head = [f"#define REF_ASSUMPTIONS {count}", PRELUDE]
    head += [EXTREMES.format(T=name) for name in ("int32_t", "int64_t", "ref_wide", "double", "float")]
    bodies = [line for lines in procedures for line in lines]
    return "\n".join([*head, *prototypes, *writer.accessors(), *bodies, *rest]) + "\n"


def _initial(writer: Writer) -> Iterator[str]:
    """Every leaf's value before the first cycle."""
    yield f"static int32_t ref_init({writer.symbols.struct} *s) {{"
    for variable in writer.program.variables:
        value = constant(variable.type, variable.initial)
        yield f"{writer.place(variable.name)} = ({writer.symbols.c_type(variable.name)}){value};"
    yield "return 0; }"


def _rest(writer: Writer) -> Iterator[Iterable[str]]:
    yield list(_admit(writer))
    yield list(_deferred(writer))
    yield list(_safe_values(writer))
    yield list(_known(writer))
    yield list(_initial(writer))
    for number, table in enumerate(writer.program.tables):
        for part in (line_function, _actions, _monitors, _safe):
            yield list(part(writer, number, table))
        yield list(_body(writer, number, table))
        yield list(_step(writer, number))
    for number, level in enumerate(writer.program.levels):
        yield list(_cycle(writer, number, level))
