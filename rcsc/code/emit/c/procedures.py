"""Procedures as functions of C; those of the user are called, and their results admitted."""

from collections.abc import Iterable, Iterator

from rcsc.code.emit.c.admission import admitted, refusal
from rcsc.code.emit.c.cprogram import CProgram, discarded, fault_name, touches_state
from rcsc.code.emit.c.ctext import c_type, local_type, locals_of, wide_type
from rcsc.code.emit.code_tree import (
    Branch,
    Code,
    Do,
    Function,
    Invoke,
    Let,
    Name,
    Prefix,
    Set,
    Stmt,
    read,
    when,
)
from rcsc.code.emit.identifiers import comment
from rcsc.code.emit.plan import Origin, Sort, stated
from rcsc.code.emit.translate import FAULT, FAULT_AT, STATE, local, local_word
from rcsc.lang import model
from rcsc.lang.interpret import Fault
from rcsc.lang.leaves import everything
from rcsc.lang.model import Enum, Procedure, Program


def procedure_function(c: CProgram, procedure: Procedure) -> Function:
    """Return the function of a procedure."""
    params = [f"{c.p}_t *s", *(f"{_held(c, p.type)} {local_word(p.name)}" for p in procedure.params)]
    head = f"void {c.p}_do_{c.names.procedures[procedure.name]}({', '.join(params)})"
    body = tuple(_extern_body(c, procedure) if procedure.extern else _body(c, procedure))
    unread = () if touches_state(body) else (discarded(STATE),)
    origin = Origin(Sort.PROCEDURE, procedure.name)
    return Function(comment(stated(procedure, c.plan.files)), head, (*body, *unread), origin=origin)


def _body(c: CProgram, procedure: Procedure) -> Iterator[Stmt]:
    kinds = dict(locals_of(procedure))
    yield from (Let(_held(c, kind), local_word(name), c.text.beginning(kind)) for name, kind in kinds.items())
    body = c.text.body(procedure.body, c.stated[procedure.name])
    used = {code.text for code in read(body) if isinstance(code, Name)}
    named = (local(name) for name in (*kinds, *(param.name for param in procedure.params)))
    yield from (
        discarded(variable) for variable in named if variable.text not in used
    )  # set, perhaps, and never read
    yield from body


def _held(c: CProgram, kind: model.Scalar) -> str:
    """Return the type of a parameter or a local; that of an enumeration by its name."""
    return c.names.types[kind.name] if isinstance(kind, Enum) else local_type(kind)


def _extern_body(c: CProgram, procedure: Procedure) -> Iterator[Stmt]:
    assert procedure.extern is not None
    variables = {v.name: v for v in c.program.variables}
    results = [(variables[name], Name(f"w{at}")) for at, name in enumerate(procedure.writes)]
    for variable, result in results:
        yield Let(c_type(variable.type), result.text, c.text.place(variable.name))
    given: list[Code] = [c.text.place(name) for name in procedure.reads]
    given += [
        c.text.converted(local(p.name), local_type(p.type), wide_type(p.type)) for p in procedure.params
    ]
    outs = (Prefix("&", result) for _, result in results)
    yield Do(Invoke(procedure.extern.c, (*given, *outs)))
    for variable, result in results:
        kept = (*admitted(c, variable, result), Set(c.text.place(variable.name), result))
        outside, at = refusal(c, variable, result), Name(c.names.leaves[variable.name])
        told = Set(FAULT, fault_name(c, Fault.EXTERN)), Set(FAULT_AT, at)
        body = kept if outside is None else (Branch(((outside, told),), kept),)
        yield from body if variable is results[0][0] else (when(c.text.faultless, *body),)


def failing(program: Program) -> frozenset[str]:
    """Return the procedures that call an extern procedure, directly or not."""
    failing = {str(p.name) for p in program.procedures if p.extern is not None}
    while True:
        more = {str(p.name) for p in program.procedures if failing.intersection(_called(p.body))} - failing
        if not more:
            return frozenset(failing)
        failing |= more


def callees_first(program: Program) -> list[Procedure]:
    """Return the procedures that lines and levels run, each after those that it calls; in declared order where that is free."""
    by_name = {p.name: p for p in program.procedures}
    lines = (line for table in program.tables for line in table.every_line)
    run = {name for level in program.levels for name in (*level.preprocess, *level.postprocess)}
    run |= set(_called(action.statement for line in lines for action in line.actions))
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
    """Return the procedures that statements call, in order."""
    return dict.fromkeys(call.procedure for call in everything(body) if isinstance(call, model.Call))
