"""Procedures, modules and extern procedures; owners; what calls what."""

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Label
from rcsc.model import (
    Call,
    Kind,
    Owner,
    Parameter,
    Procedure,
    ProcedureName,
    Statement,
    VariableName,
)
from rcsc.resolve.expressions import path_of
from rcsc.resolve.externs import extern
from rcsc.resolve.leaves import everything, expressions, read_by, written_by
from rcsc.resolve.scope import Body, Scope
from rcsc.resolve.statements import MOST_STATEMENTS, Statements, cost
from rcsc.resolve.types import scalar_of
from rcsc.source import Span
from rcsc.syntax import tree


def procedures(scope: Scope, written: list[tree.ProcedureDecl]) -> tuple[Procedure, ...]:
    """All procedures, with what they read and write, calls included."""
    bodies = {one.name.text: _body(scope, one) for one in written}
    order = _call_order(scope, bodies)
    known: dict[str, Procedure] = {}
    costs: dict[str, int] = {}
    by_name = {one.name.text: one for one in written}
    for name in order:
        known[name] = _procedure(scope, by_name[name], bodies[name], known)
        costs[name] = cost(bodies[name][1], costs)
        if costs[name] > MOST_STATEMENTS:
            scope.report(
                Code.LOOP_TOO_LONG,
                f"`{name}` runs more than {MOST_STATEMENTS} statements",
                by_name[name].name.span,
            )
    return tuple(known[one.name.text] for one in written if one.name.text in known)


def _body(scope: Scope, written: tree.ProcedureDecl) -> tuple[tuple[Parameter, ...], tuple[Statement, ...]]:
    body = Body()
    params = []
    for param in written.params:
        made = Parameter(body.fresh(param.name.text), scalar_of(scope, param.type), param.span)
        if param.name.text in body.visible:
            scope.report(Code.DUPLICATE_NAME, f"`{param.name.text}` is a parameter twice", param.name.span)
        body.visible[param.name.text] = made
        params.append(made)
    return tuple(params), Statements(scope, body).block(written.body)


def _call_order(
    scope: Scope, bodies: dict[str, tuple[tuple[Parameter, ...], tuple[Statement, ...]]]
) -> list[str]:
    """Callees before callers; a cycle is reported with its path and left out."""
    order: list[str] = []
    state: dict[str, int] = {}

    def visit(name: str, path: tuple[str, ...]) -> None:
        state[name] = 1
        for statement in everything(bodies[name][1]):
            if not isinstance(statement, Call):
                continue
            callee = statement.procedure
            if state.get(callee) == 1:
                cycle = " -> ".join((*path[path.index(callee) :], callee))
                scope.report(
                    Code.CALL_CYCLE, f"procedures call each other in a circle: {cycle}", statement.span
                )
            elif callee in bodies and callee not in state:
                visit(callee, (*path, callee))
        state[name] = 2
        order.append(name)

    for name in bodies:
        if name not in state:
            visit(name, (name,))
    return order


def _procedure(
    scope: Scope,
    written: tree.ProcedureDecl,
    body: tuple[tuple[Parameter, ...], tuple[Statement, ...]],
    known: dict[str, Procedure],
) -> Procedure:
    reads, writes = _touched(body[1], known)
    if written.kind != "procedure":
        declared_reads = _places(scope, written.reads, writing=False)
        declared_writes = _places(scope, written.writes, writing=True)
        if written.kind == "module":
            _check_declared(scope, body[1], known, declared_reads, declared_writes)
        reads, writes = declared_reads, declared_writes
    named = extern(scope, written) if written.kind == "extern" else None
    return Procedure(
        ProcedureName(written.name.text),
        body[0],
        body[1],
        tuple(sorted(reads)),
        tuple(sorted(writes)),
        named,
        " ".join(written.doc),
        written.name.span,
    )


def _touched(
    body: tuple[Statement, ...], known: dict[str, Procedure]
) -> tuple[set[VariableName], set[VariableName]]:
    reads: set[VariableName] = set()
    writes: set[VariableName] = set()
    for statement in everything(body):
        for expr in expressions(statement):
            reads.update(read_by(expr))
        writes.update(written_by(statement))
        if isinstance(statement, Call) and statement.procedure in known:
            reads.update(known[statement.procedure].reads)
            writes.update(known[statement.procedure].writes)
    return reads, writes


def _places(scope: Scope, written: tuple[tree.Expr, ...], writing: bool) -> set[VariableName]:
    """Leaves under the declared paths."""
    leaves: set[VariableName] = set()
    for one in written:
        path = path_of(scope, Body(), one)
        if path is None:
            continue
        root = path.names[0].partition(".")[0].partition("[")[0]
        if writing and scope.declared[root].kind is Kind.INPUT:
            scope.report(Code.NOT_WRITABLE, f"`{root}` is an input; only the world writes it", one.span)
        under = [name for name in scope.leaves if _below(name, path.names[0])]
        leaves.update(VariableName(name) for name in under)
    return leaves


def _below(leaf: str, path: str) -> bool:
    return leaf == path or leaf.startswith((f"{path}.", f"{path}["))


def _check_declared(
    scope: Scope,
    body: tuple[Statement, ...],
    known: dict[str, Procedure],
    reads: set[VariableName],
    writes: set[VariableName],
) -> None:
    """Reports each statement of a module that touches what the module does not name."""
    for statement in everything(body):
        seen = {name for expr in expressions(statement) for name in read_by(expr)}
        made = set(written_by(statement))
        if isinstance(statement, Call) and statement.procedure in known:
            seen |= set(known[statement.procedure].reads)
            made |= set(known[statement.procedure].writes)
        for verb, extra in (("reads", seen - reads), ("writes", made - writes)):
            for name in sorted(extra):
                scope.report(
                    Code.UNDECLARED_ACCESS,
                    f"the module {verb} `{name}`, which it does not name",
                    statement.span,
                    f"add `{name}` to its `{verb}`",
                )


def owners(scope: Scope, written: list[tree.OwnerDecl]) -> tuple[Owner, ...]:
    """The owners; members that are not procedures without parameters, or owners, are reported."""
    names = {one.name.text for one in written}
    for one in written:
        for member in one.members:
            if member.text not in names:
                _check_member(scope, member)
    return tuple(
        Owner(one.name.text, tuple(m.text for m in one.members), " ".join(one.doc), one.name.span)
        for one in written
    )


def _check_member(scope: Scope, member: tree.Name) -> None:
    procedure = scope.procedures.get(member.text)
    if procedure is None:
        scope.unknown("module or owner", member, list(scope.procedures))
    elif procedure.params:
        scope.report(
            Code.WRONG_ARGUMENTS, f"`{member.text}` takes arguments; an owner gives none", member.span
        )


def flattened(scope: Scope, names: tuple[tree.Name, ...], known: tuple[Owner, ...]) -> tuple[str, ...]:
    """The procedures that the named owners and procedures come to, in order."""
    by_name = {owner.name: owner for owner in known}

    def visit(name: str, span: Span, path: tuple[str, ...]) -> list[str]:
        if name in path:
            first = Label(by_name[name].span, "this owner")
            cycle = " -> ".join((*path[path.index(name) :], name))
            scope.report(
                Code.OWNER_CYCLE, f"owners contain each other in a circle: {cycle}", span, related=(first,)
            )
            return []
        if name not in by_name:
            return [name] if name in scope.procedures else []
        return [leaf for member in by_name[name].members for leaf in visit(member, span, (*path, name))]

    result: list[str] = []
    for name in names:
        if name.text not in by_name:
            _check_member(scope, name)
        result.extend(visit(name.text, name.span, ()))
    return tuple(result)
