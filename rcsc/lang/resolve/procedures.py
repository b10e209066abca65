"""Procedures, modules and extern procedures; owners; what calls what."""

import keyword
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.scope import Body, Scope
from rcsc.lang.expressions.typed import path_of
from rcsc.lang.expressions.types import scalar_of
from rcsc.lang.leaves import everything, expressions, is_part, read_by, reads_of, root_of, written_by
from rcsc.lang.model import (
    Call,
    Extern,
    Kind,
    Owner,
    Parameter,
    Procedure,
    ProcedureName,
    Scalar,
    Statement,
    VariableName,
    pending,
)
from rcsc.lang.protocol.written import AFTER, BEFORE
from rcsc.lang.reserved import C_COMPOSED, C_KEYWORDS, C_MACROS
from rcsc.lang.resolve.declarations import requirements
from rcsc.lang.resolve.statements import MOST_STATEMENTS, Statements, cost
from rcsc.lang.syntax import tree

MOST_CALLS = 100
MOST_MEMBERS = 10_000
_PYTHON = re.compile(r"[a-z_]\w*(\.[a-z_]\w*)*:[a-z_]\w*", re.ASCII | re.IGNORECASE)
_C = re.compile(r"[a-z]\w{0,62}", re.ASCII | re.IGNORECASE)
_C_WORDS = C_KEYWORDS | C_MACROS | C_COMPOSED

_Body: TypeAlias = tuple[tuple[Parameter, ...], tuple[Statement, ...]]


def procedures(scope: Scope, written: list[tree.ProcedureDecl]) -> tuple[Procedure, ...]:
    """Resolve all procedures, with the leaves that they read and write, calls included."""
    for procedure in written:
        scope.signatures[procedure.name.text] = tuple(_signature(scope, procedure.params))
    bodies = {procedure.name.text: _body(scope, procedure) for procedure in written}
    order = _call_order(scope, bodies)
    known: dict[str, Procedure] = {}
    costs: dict[str, int] = {}
    by_name = {procedure.name.text: procedure for procedure in written}
    for name in order:
        known[name] = _procedure(scope, by_name[name], bodies[name], known)
        costs[name] = cost(bodies[name][1], costs)
        if costs[name] > MOST_STATEMENTS:
            scope.report(
                Code.LOOP_TOO_LONG,
                f"`{name}` runs more than {MOST_STATEMENTS} statements",
                by_name[name].name.span,
            )
    return tuple(known[procedure.name.text] for procedure in written if procedure.name.text in known)


def _signature(scope: Scope, params: tuple[tree.Parameter, ...]) -> Iterator[Scalar]:
    """Yield the types of parameters; none may name a parameter before it."""
    before = Body()
    for param in params:
        kind = scalar_of(scope, param.type, before)
        before.visible[param.name.text] = Parameter(param.name.text, kind, param.span)
        yield kind


def _body(scope: Scope, written: tree.ProcedureDecl) -> _Body:
    body = Body()
    params = []
    for param, kind in zip(written.params, scope.signatures[written.name.text], strict=True):
        parameter = Parameter(body.fresh(param.name.text), kind, param.span)
        if param.name.text in body.visible:
            scope.report(Code.DUPLICATE_NAME, f"`{param.name.text}` is a parameter twice", param.name.span)
        body.visible[param.name.text] = parameter
        params.append(parameter)
    is_protocol = written.name.text in {BEFORE, AFTER} and bool(scope.numbers)
    return tuple(params), Statements(scope, body, is_protocol=is_protocol).block(written.body)


def _call_order(scope: Scope, bodies: dict[str, _Body]) -> list[str]:
    """Return callees before callers; report a cycle with its path, and calls that nest too deep."""
    calls = {name: [s for s in everything(body[1]) if isinstance(s, Call)] for name, body in bodies.items()}
    deep: dict[str, int] = {}
    for name in bodies:
        if name not in deep:
            _visit(scope, name, calls, deep)
    return list(deep)


def _visit(scope: Scope, start: str, calls: dict[str, list[Call]], deep: dict[str, int]) -> None:
    """Visit all that `start` calls; enter in `deep`, callees first, how deep the calls of each nest."""
    path: dict[str, Iterator[Call]] = {start: iter(calls[start])}
    while path:
        name = next(reversed(path))
        call = next(path[name], None)
        if call is None:
            del path[name]
            deep[name] = 1 + max((deep.get(nested.procedure, 0) for nested in calls[name]), default=0)
            continue
        callee = call.procedure
        if callee in path:
            names = list(path)
            cycle = " -> ".join((*names[names.index(callee) :], callee))
            message = f"procedures call each other in a circle: {cycle}"
            scope.report(
                Code.CALL_CYCLE, message, call.span, "a procedure cannot be called again before it ends"
            )
        elif callee not in deep:
            path[callee] = iter(calls[callee])
        elif deep[callee] == MOST_CALLS:
            scope.report(Code.TOO_DEEP, f"calls nest more than {MOST_CALLS} deep here", call.span)


def _procedure(
    scope: Scope,
    written: tree.ProcedureDecl,
    body: _Body,
    known: dict[str, Procedure],
) -> Procedure:
    reads, writes = touched(body[1], known)
    if written.kind != "procedure":
        before = {hidden: name for name, hidden in scope.previous.items() if hidden in reads}
        declared_reads = _places(scope, written.reads, writing=False)
        declared_writes = _places(scope, written.writes, writing=True)
        if written.kind == "module":
            declared_reads |= {hidden for hidden, of in before.items() if of in declared_reads}
            declared_reads |= {held.counter for held in scope.held.values()} & reads
            _check_declared(scope, body[1], known, declared_reads, declared_writes)
        reads, writes = declared_reads, declared_writes
    named = _extern(scope, written) if written.kind == "extern" else None
    return Procedure(
        ProcedureName(written.name.text),
        body[0],
        body[1],
        tuple(sorted(reads, key=scope.order)),
        tuple(sorted(writes, key=scope.order)),
        named,
        " ".join(written.doc),
        written.name.span,
        requirements(scope, written.requirements),
    )


def touched(
    body: Iterable[Statement], known: Mapping[str, Procedure]
) -> tuple[set[VariableName], set[VariableName]]:
    """Return the leaves that statements may read, and those that they may write, calls included."""
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
    """Return the leaves under the declared paths."""
    leaves: set[VariableName] = set()
    for place in written:
        path = path_of(scope, Body(), place)
        if path is None:
            continue
        root = root_of(path.names[0])
        if writing and scope.declared[root].kind is Kind.INPUT:
            scope.report(Code.NOT_WRITABLE, f"`{root}` is an input; only the world writes it", place.span)
        if path.index is not None:
            scope.report(Code.NOT_CONSTANT, "the index of a declared path is a constant", place.span)
        own = scope.declared[root].leaves
        every = (*own, *(pending(name) for name in own if name in scope.deferred))
        leaves.update(name for name in every if is_part(name, path.names[0]))
    return leaves


def _check_declared(
    scope: Scope,
    body: tuple[Statement, ...],
    known: dict[str, Procedure],
    reads: set[VariableName],
    writes: set[VariableName],
) -> None:
    """Report each place where a module touches a leaf that it does not declare."""
    for statement in everything(body):
        for expr in expressions(statement):
            for names, span in reads_of(expr):
                _undeclared(scope, "reads", set(names) - reads, span)
        _undeclared(scope, "writes", set(written_by(statement)) - writes, statement.span)
        if isinstance(statement, Call) and statement.procedure in known:
            callee = known[statement.procedure]
            _undeclared(scope, "reads", set(callee.reads) - reads, statement.span)
            _undeclared(scope, "writes", set(callee.writes) - writes, statement.span)


def _undeclared(scope: Scope, verb: str, extra: set[VariableName], span: Span) -> None:
    """Report each variable once: by its leaf where only one is touched."""
    leaves: dict[str, list[VariableName]] = {}
    of = {hidden: name for name, hidden in scope.previous.items()}
    for name in sorted({of.get(name, name) for name in extra}, key=scope.order):
        leaves.setdefault(root_of(name), []).append(name)
    for root, names in leaves.items():
        shown = root if len(names) > 1 else names[0].removesuffix(".next")
        message = f"the module {verb} `{shown}`, which it does not name"
        scope.report(Code.UNDECLARED_ACCESS, message, span, f"add `{shown}` to its `{verb}`")


def _extern(scope: Scope, written: tree.ProcedureDecl) -> Extern:
    """Return the names of the user's functions for an extern procedure; report each that does not fit.

    Source: ISO C99, 6.4.1 (keywords) and 5.2.4.1 (63 significant characters of an internal name).
    """
    python, c = written.python, written.c
    if not _PYTHON.fullmatch(python) or any(map(keyword.iskeyword, re.split("[.:]", python))):
        message = f"`{python}` does not name a Python function"
        scope.report(Code.EXTERN_NAME, message, written.name.span, "write `package.module:function`")
    if not _C.fullmatch(c) or c in _C_WORDS:
        message = f"`{c}` does not name a C function"
        scope.report(
            Code.EXTERN_NAME,
            message,
            written.name.span,
            "write a C identifier of at most 63 characters that no library keeps",
        )
    return Extern(python, c)


class Owners:
    """The owners of a program.

    Attributes:
        runs: The procedures that each owner comes to, in order; owners inside it laid out.
    """

    def __init__(self, scope: Scope, written: list[tree.OwnerDecl]) -> None:
        self.scope = scope
        self.written = {owner.name.text: owner for owner in written}
        self.runs: dict[str, tuple[str, ...]] = {}
        for name in self.written:
            if name not in self.runs:
                self._lay_out(name)

    def all(self) -> tuple[Owner, ...]:
        """Return the owners as declared."""
        return tuple(
            Owner(name, tuple(m.text for m in owner.members), " ".join(owner.doc), owner.name.span)
            for name, owner in self.written.items()
        )

    def laid_out(self, names: tuple[tree.Name, ...]) -> tuple[str, ...]:
        """Return the procedures of the named owners and procedures, in order."""
        return tuple(procedure for name in names for procedure in self._runs_of(name))

    def _runs_of(self, member: tree.Name) -> tuple[str, ...]:
        """Return the procedures that a member runs; report one that is no owner and no procedure without parameters."""
        if member.text in self.runs:
            return self.runs[member.text]
        procedure = self.scope.procedures.get(member.text)
        if procedure is None:
            known = [*self.scope.procedures, *self.written]
            self.scope.unknown("module, procedure or owner", member, known)
            return ()
        if procedure.params:
            message = f"`{member.text}` takes arguments, and none are given here"
            self.scope.report(Code.WRONG_ARGUMENTS, message, member.span)
            return ()
        return (member.text,)

    def _lay_out(self, start: str) -> None:
        """Fill `runs` for `start` and all owners inside it; report a circle with its path."""
        path = {start: iter(self.written[start].members)}
        while path:
            name = next(reversed(path))
            member = next(path[name], None)
            if member is None:
                del path[name]
                self._finish(self.written[name])
            elif member.text in path:
                names = list(path)
                cycle = " -> ".join((*names[names.index(member.text) :], member.text))
                first = Label(self.written[member.text].name.span, "this owner")
                message = f"owners contain each other in a circle: {cycle}"
                self.scope.report(Code.OWNER_CYCLE, message, member.span, related=(first,))
                self.runs[member.text] = ()
            elif member.text in self.written and member.text not in self.runs:
                path[member.text] = iter(self.written[member.text].members)

    def _finish(self, owner: tree.OwnerDecl) -> None:
        runs: list[str] = []
        for member in owner.members:
            runs.extend(self._runs_of(member))
            if len(runs) > MOST_MEMBERS:
                message = f"`{owner.name.text}` runs more than {MOST_MEMBERS} procedures"
                self.scope.report(Code.LOOP_TOO_LONG, message, member.span)
                runs.clear()
                break
        self.runs[owner.name.text] = tuple(runs)
