"""What a cycle does: settles, checks assumptions, runs the line that matches, and what goes before and after."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from rcsc.code.emit.c.admission import trace
from rcsc.code.emit.c.cprogram import (
    NONE,
    CProgram,
    assigned,
    discarded,
    fault_name,
    on_state,
    run_on_state,
    touches_state,
)
from rcsc.code.emit.c.ctext import c_type, local_type
from rcsc.code.emit.code_tree import (
    Body,
    Branch,
    Cast,
    Choice,
    Constant,
    Do,
    Frame,
    Function,
    Infix,
    Invoke,
    Leave,
    Let,
    Line,
    MemberPath,
    Name,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
    when,
)
from rcsc.code.emit.identifiers import DIGEST, FAILED_BITS, comment, failed_type
from rcsc.code.emit.plan import Origin, PlanTable, Sort, answering
from rcsc.code.emit.ranges import at_line
from rcsc.code.emit.rendering import END, mark
from rcsc.code.emit.translate import FAULT, FAULT_AT, LINE, STATE
from rcsc.lang import model
from rcsc.lang.interpret import Fault
from rcsc.lang.model import pending

MOST_TOLD = 1024
"""Lines up to which the C says of each when it runs; past them, only where it stands: nobody reads so many of them twice."""


def settle_function(c: CProgram) -> Function:
    """Return the function that moves deferred values in."""
    deferred = [(v, v.deferred_until) for v in c.program.variables if v.deferred_until is not None]
    ready = [Name(f"ready{at}") for at, _ in enumerate(deferred)]
    pairs = list(zip(ready, deferred, strict=True))
    lets = (Let("const bool", flag.text, c.text.expr(until)) for flag, (_, until) in pairs)
    sets = (when(flag, Set(c.text.place(v.name), c.text.place(pending(v.name)))) for flag, (v, _) in pairs)
    doc = "Deferred variables take their next values, all at once."
    none = [assigned(c, c.program.variable(leaf), 0) for leaf in c.program.line_leaves.values()]
    unread = () if deferred or none else (discarded(STATE),)
    return on_state(c, doc, "settle", *lets, *sets, *none, *unread)


def safe_functions(c: CProgram) -> Iterator[Function]:
    """Yield the function that shows safe outputs, where any is declared."""
    shown = [
        assigned(c, variable, variable.safe) for variable in c.program.variables if variable.safe is not None
    ]
    if shown:
        yield on_state(c, "After a fault: outputs that have a safe value show it.", "safe", *shown)


def action_functions(c: CProgram) -> Iterator[Function]:
    """Yield one function a table: it matches and runs the line's actions."""
    for table in c.plan.tables:
        name = c.names.tables[table.table.name]
        told = [stmt for place in table.monitored for stmt in _told(c, place, table.stops)]
        matched = _matched(c, table, name)
        run = (when(c.text.faultless, *matched),) if table.stops else matched
        answers = comment(answering(table.table.requirements))
        doc = f"Matches table {table.table.name} and runs the line; returns the fault, 0 for none.{answers}"
        yield on_state(c, doc, f"run_{name}", *told, *run, Leave(FAULT), gives="int32_t", origin=table.origin)


def assumption_functions(c: CProgram) -> Iterator[Function]:
    """Yield one function for each assumption that is checked."""
    told = {place for table in c.plan.tables for place in table.monitored}
    for place in sorted(told):
        name, assumption = c.names.holding[place], c.program.assumptions[c.plan.monitored[place]]
        file = c.plan.files.get(assumption.span.file, "")
        words = f"{file} assumption {assumption.name}{answering(assumption.requirements)}".lstrip()
        doc = comment(f"{words}: {assumption.doc}" if assumption.doc else words)
        body: Body = (Leave(c.text.expr(assumption.condition)),)
        unread = () if touches_state(body) else (discarded(STATE),)
        head, origin = f"bool {name}(const {c.p}_t *s)", Origin(Sort.ASSUMPTION, assumption.name)
        yield Function(doc, head, (*unread, *body), inline=True, origin=origin)


def _told(c: CProgram, place: int, stops: tuple[int, ...]) -> Body:
    """Return code that marks an assumption that fails; the first that stops and fails ends the cycle."""
    word, bit = divmod(place, FAILED_BITS)
    failed = MemberPath((c.names.failed[word],))
    shift = Constant(bit, "uint32_t") if word else Cast("uint32_t", Name(c.names.assumptions[place]))
    kind = failed_type(len(c.plan.monitored))
    one = Cast(kind, Constant(1, kind))  # the essential type of a bare 1 has eight bits
    mark = Set(failed, infix("|", failed, infix("<<", one, shift)))
    name = Name(c.names.assumptions[place])
    end = Set(FAULT, fault_name(c, Fault.ASSUMPTION)), Set(FAULT_AT, name)
    ended = () if place not in stops else end if place == stops[0] else (when(c.text.faultless, *end),)
    test = Prefix("!", Invoke(c.names.holding[place], (STATE,)))
    return (when(test, mark, *ended),)


def _matched(c: CProgram, table: PlanTable, name: str) -> Body:
    """Return code that finds the line and runs its actions."""
    cases: list[Stmt] = []
    named = zip(c.names.lines[table.table.name], table.lines, table.table.every_line, strict=True)
    for number, (line_name, line, row) in enumerate(named, 1):
        actions = [action.statement for action in line.actions]
        body = c.text.body(actions, at_line(table.table, row, c.program))
        head = (
            f"case {line_name}: /* {comment(line.told if len(table.lines) <= MOST_TOLD else line.place)} */",
        )
        origin = Origin(Sort.LINE, table.table.name, line.name)
        case = Frame(head, (*_kept(c, table, number), *body, Line("break;")))
        cases += [Line(mark(f"case {line_name}", origin)), case, Line(END)]
    none, several = (Set(FAULT, fault_name(c, fault)) for fault in (Fault.NO_LINE, Fault.SEVERAL_LINES))
    unmatched = Frame(("case ", Round(NONE), ":"), (none, Line("break;")))
    return (
        Set(LINE, Invoke(f"{c.p}_match_{name}", (STATE,))),
        Frame(("switch (", LINE, ") {")),
        *cases,
        *(() if table.matcher.default else (unmatched,)),
        Frame(("default:",), (Set(LINE, NONE), several, Line("break;"))),
        Line("}"),
    )


def _kept(c: CProgram, table: PlanTable, line: int) -> Body:
    """Return code that keeps the line of a table that others follow in a cycle."""
    leaf = c.program.line_leaves.get(table.table.name)
    return () if leaf is None else (assigned(c, c.program.variable(leaf), line),)


def _begin(c: CProgram) -> Do:
    return run_on_state(c, "begin" if c.plan.defensive else "admit")


def _cycle(c: CProgram, doc: str, name: str, origin: Origin, *body: Stmt) -> Function:
    """The frame of every cycle, and of a step where outputs have safe values."""
    safe = (when(c.text.faulted, run_on_state(c, "safe")),) if _shows_safe(c) else ()
    run = when(c.text.faultless, *body)
    return on_state(c, doc, name, _begin(c), run, *safe, Leave(FAULT), gives="int32_t", origin=origin)


def _shows_safe(c: CProgram) -> bool:
    return any(variable.safe is not None for variable in c.program.variables)


def step_functions(c: CProgram) -> Iterator[Function]:
    """Yield the step of each table."""
    for table in c.plan.tables:
        name = c.names.tables[table.table.name]
        doc = f"One step of table {table.table.name}: admits, settles, matches, acts; returns the fault, 0 for none."
        if _shows_safe(c):
            yield _cycle(c, doc, f"{name}_step", table.origin, _table_run(c, table.table.name))
        else:  # nothing is left to do after the line: compilers jump there, and do not come back
            last = Choice(c.text.faultless, Invoke(f"{c.p}_run_{name}", (STATE,)), FAULT)
            body = _begin(c), Leave(last)
            yield on_state(c, doc, f"{name}_step", *body, gives="int32_t", origin=table.origin)


def cycle_function(c: CProgram, level: model.Level) -> Function:
    """Return the cycle of a level."""
    before = (_called(c, name) for name in level.preprocess)
    stages = (
        (True, tuple(_chosen(c, stage, partial(_stage, c), f"chosen_{at}")))
        for at, stage in enumerate(level.stages, 1)
    )
    after = (_called(c, name) for name in level.postprocess)
    doc = f"One cycle of level {level.name}, every {level.period_ms} ms: returns the fault, 0 for none.{_order(c, level)}"
    name = f"{c.names.levels[level.name]}_cycle"
    last = True, tuple(_chosen(c, level.tables, lambda table: (_table_run(c, table),), "chosen"))
    origin = Origin(Sort.LEVEL, level.name)
    return _cycle(c, doc, name, origin, *_while_faultless(c, (*before, *stages, last, *after)))


def _called(c: CProgram, procedure: str) -> tuple[bool, Body]:
    """Call a procedure; and whether a fault may stand after it."""
    return procedure in c.text.failing, (Do(c.text.call(procedure)),)


def _while_faultless(c: CProgram, parts: Sequence[tuple[bool, Body]]) -> Iterator[Stmt]:
    """Yield statements in order; after each that may fail the rest runs only if no fault stands."""
    together: list[Stmt] = []
    asked = False
    for number, (fails, body) in enumerate(parts, 1):
        together += body
        if fails or number == len(parts):
            yield from (when(c.text.faultless, *together),) if asked else together
            together, asked = [], True


def _order(c: CProgram, level: model.Level) -> str:
    """Describe the order of several tables, and how a fault tells one before the last."""
    if not level.stages:
        return ""
    places = (f"{name} ({c.names.places[name]})" for name in level.staged)
    order = ", ".join((*places, " or ".join(level.tables.names)))
    return (
        f" Its tables run in this order: {order}; where one before the last has no line, or several, `fault_at` is the constant "
        "given here."
    )


def _table_run(c: CProgram, table: str) -> Do:
    """Run a table in a cycle, which reads the fault from the state."""
    return Do(Cast("void", Invoke(f"{c.p}_run_{c.names.tables[table]}", (STATE,))))


def _stage(c: CProgram, table: str) -> Body:
    """Return code for a table that others follow: the trace's line is the last table's; a fault for want of a line names this one."""
    unmatched = Infix(
        "||", tuple(infix("==", FAULT, fault_name(c, end)) for end in (Fault.NO_LINE, Fault.SEVERAL_LINES))
    )
    named = when(unmatched, Set(FAULT_AT, Name(c.names.places[table])))
    return _table_run(c, table), Set(LINE, NONE), named


def _chosen(c: CProgram, choice: model.TableChoice, run: Callable[[str], Body], name: str) -> Iterator[Stmt]:
    """Yield code that runs the table of a choice and keeps the choice's value in a variable of that name."""
    if isinstance(choice, model.OneTable):
        yield from run(choice.table)
        return
    kind, given = choice.selector.type, c.text.whole(choice.selector)
    chosen = Name(name)
    yield Let(f"const {c_type(kind) if isinstance(given, MemberPath) else local_type(kind)}", name, given)
    arms = ((infix("==", chosen, c.text.constant(kind, value)), run(name)) for value, name in choice.tables)
    yield Branch(
        tuple(arms),
        (Frame((FAULT, " = ", fault_name(c, Fault.NO_LINE), "; /* no table for it: proved impossible */")),),
    )


def init_function(c: CProgram) -> Function:
    """Return the function that makes the initial state."""
    values = (assigned(c, variable, variable.initial) for variable in c.program.variables)
    digest = Set(MemberPath((DIGEST,)), Name(c.names.digest))
    begun = trace(c, fault_name(c, Fault.OK), NONE)
    return on_state(c, "Every variable's initial value.", "init", digest, *begun, *values)
