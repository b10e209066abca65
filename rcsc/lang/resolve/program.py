"""One root file and all that it uses, to a `Program`."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, sort_key
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.memory import uncollected
from rcsc.lang.expressions.previous import keeping, with_keeping
from rcsc.lang.expressions.scope import Body, Scope
from rcsc.lang.expressions.typed import boolean, without_before
from rcsc.lang.leaves import read_by
from rcsc.lang.model import (
    Assumption,
    AssumptionName,
    Invariant,
    Kind,
    Level,
    Program,
    Standing,
    Table,
    TableName,
)
from rcsc.lang.project import Loaded, load
from rcsc.lang.protocol import declared, expanded
from rcsc.lang.resolve import procedures as calls
from rcsc.lang.resolve.declarations import Names, requirements
from rcsc.lang.resolve.instance import instance_of
from rcsc.lang.resolve.levels import Declarations, level, lines_kept, periods
from rcsc.lang.resolve.properties import stated
from rcsc.lang.resolve.roles import offered, restart_of, roles_of
from rcsc.lang.resolve.tables import in_sequence, table
from rcsc.lang.syntax import tree


def resolve(root: str, loaded: Loaded, *, least_first: bool = False) -> Program | tuple[Diagnostic, ...]:
    """Return the program of the file `root`, or every diagnostic of it and of the files it uses, by position.

    With `least_first` a variable without an initial value starts with the least of its type, as in older files.
    """
    file, instance = loaded.file_of(root), loaded.instances.get(root)
    files = closure(root, loaded)
    wrong = tuple(d for d in loaded.diagnostics if d.primary.span.file in files)
    if wrong:
        return wrong
    declarations = [d for each in files for d in loaded.files[each].declarations]
    meant = partial(_meant, file, loaded.files[file], least_first=least_first)
    return (
        meant(declarations)
        if instance is None
        else instance_of(instance, declarations, loaded.files[file], meant)
    )


def _meant(
    file: str, root: tree.File, declarations: list[tree.Declaration], *, least_first: bool
) -> Program | tuple[Diagnostic, ...]:
    """Return the program of these declarations, or its diagnostics."""
    limits: dict[str, int] = {}
    with uncollected():
        while True:
            resolver = _Resolver(file, limits, least_first)
            program = resolver.program(declarations, root)
            limits = resolver.scope.limits
            if all(held.limit == limits[key] for key, held in resolver.scope.held.items()):
                return program
            # a condition has to hold for several times, and not the longest came first: count as far from the beginning


def compile_text(text: str, file: str = "case.rcs") -> Program | tuple[Diagnostic, ...]:
    """Return the program of a text that uses no other file."""
    loaded = load(["-"], stdin=text, stdin_name=file)
    return loaded.diagnostics or resolve(loaded.roots[0], loaded)


def closure(root: str, loaded: Loaded) -> list[str]:
    """Return the file of a root and all that it uses, used ones first."""
    root = loaded.file_of(root)
    order: dict[str, None] = {}
    path = {root: iter(loaded.uses.get(root, ()))}
    while path:
        file = next(reversed(path))
        used = next(path[file], None)
        if used is None:
            del path[file]
            order[file] = None
        elif used not in path and used not in order:
            path[used] = iter(loaded.uses.get(used, ()))
    return list(order)


class _Resolver:
    """Works through the declarations, kind by kind, so that their order in the text is free."""

    def __init__(self, root: str, limits: Mapping[str, int], least_first: bool) -> None:
        self.root = root
        self.scope = Scope(limits=dict(limits), least_first=least_first)

    def program(self, all_: list[tree.Declaration], root: tree.File) -> Program | tuple[Diagnostic, ...]:
        """Return the program, or its diagnostics."""
        scope = self.scope
        scope.links = tuple(d.name.text for d in all_ if isinstance(d, tree.LinkDecl))
        parties = declared(scope, all_)
        scope.orders = {party.name: (party.told, party.once_more) for party in parties.subordinates}
        scope.commands = {
            party.name: parties.members[party.link.command.text] for party in parties.subordinates
        }
        scope.numbers = parties.numbers
        if scope.diagnostics:  # what would be made of it would only repeat this
            return tuple(sorted(set(scope.diagnostics), key=sort_key))
        deferred = [d.name.text for d in all_ if isinstance(d, tree.VariableDecl) and d.deferred]
        claimed = {d.name.text for d in all_ if isinstance(d, tree.PropertyDecl | tree.RequirementDecl)}
        all_ = expanded(parties, all_)
        enums = Names(scope, all_).declare()
        scope.periods, run = periods(scope, [d for d in all_ if isinstance(d, tree.LevelDecl)])
        written = [d for d in all_ if isinstance(d, tree.ProcedureDecl) and scope.claim(d.name, "call")]
        scope.procedures.update({d.name.text: d for d in written})
        procedures = calls.procedures(scope, written)
        owners = calls.Owners(
            scope, [d for d in all_ if isinstance(d, tree.OwnerDecl) and scope.claim(d.name, "call")]
        )
        assumptions = self._assumptions(all_)
        invariants = self._invariants(all_)
        tables = self._tables(all_, {a.name for a in assumptions}, run)
        if not scope.diagnostics:
            in_sequence(scope, tables, procedures)
            more, tables = offered(scope, parties, deferred, tables, procedures)
            assumptions += more
        levels = self._levels(
            all_,
            Declarations(
                {table.name: table for table in tables},
                {str(assumption.name): assumption for assumption in assumptions},
                {str(procedure.name): procedure for procedure in procedures},
                owners,
            ),
        )
        lines = lines_kept(scope, levels, tables, self.root)
        every = stated(scope, all_)
        environment = tuple(each for each in every if each.assumed)
        properties = tuple(
            replace(each, standard=each.name not in claimed) for each in every if not each.assumed
        )
        keep = keeping(scope, {*scope.procedures, *owners.written}, Span(self.root, 0, 0))
        if keep is not None:
            procedures += (keep,)
            levels, tables = with_keeping(keep, levels, tables)
        restart = restart_of(scope, parties, all_)
        if scope.diagnostics:
            return tuple(sorted(set(scope.diagnostics), key=sort_key))
        own = tuple(TableName(d.name.text) for d in root.declarations if isinstance(d, tree.TableDecl))
        stem = self.root.rpartition("/")[2].removesuffix(".rcs")
        return Program(
            stem,
            self.root,
            (*enums, *lines),
            tuple(scope.records),
            (*(every for every in scope.declared.values() if every not in scope.kept), *scope.kept),
            tuple(scope.leaves.values()),
            procedures,
            assumptions,
            invariants,
            tables,
            own,
            owners.all(),
            levels,
            properties,
            roles_of(scope, parties),
            restart,
            environment,
        )

    def _assumptions(self, all_: list[tree.Declaration]) -> tuple[Assumption, ...]:
        assumptions = []
        for assume in all_:
            if isinstance(assume, tree.AssumeDecl) and self.scope.claim(assume.name, "assumption"):
                condition = boolean(self.scope, Body(), assume.condition)
                if condition is not None:
                    standing = Standing(assume.state or "assumed")
                    name = AssumptionName(assume.name.text)
                    doc, named = " ".join(assume.doc), requirements(self.scope, assume.requirements)
                    assumptions.append(Assumption(name, standing, condition, doc, assume.name.span, named))
        return tuple(assumptions)

    def _invariants(self, all_: list[tree.Declaration]) -> tuple[Invariant, ...]:
        invariants = []
        for invariant in all_:
            if not (
                isinstance(invariant, tree.InvariantDecl) and self.scope.claim(invariant.name, "assumption")
            ):
                continue
            with without_before(
                self.scope, "`was` is of two cycles, an invariant of one: write it as a property"
            ):
                condition = boolean(self.scope, Body(), invariant.condition)
            if condition is None:
                continue
            inputs = [n for n in read_by(condition) if self.scope.leaves[n].kind is Kind.INPUT]
            if inputs:
                self.scope.report(
                    Code.KIND,
                    f"an invariant is about state and outputs; `{inputs[0]}` is an input",
                    invariant.condition.span,
                    "an assumption can be about inputs",
                )
            name, doc = invariant.name, " ".join(invariant.doc)
            named = requirements(self.scope, invariant.requirements)
            invariants.append(Invariant(name.text, condition, doc, name.span, named))
        return tuple(invariants)

    def _levels(self, all_: list[tree.Declaration], known: Declarations) -> tuple[Level, ...]:
        written = [d for d in all_ if isinstance(d, tree.LevelDecl) and self.scope.claim(d.name, "table")]
        levels = (level(self.scope, declaration, known) for declaration in written)
        return tuple(resolved for resolved in levels if resolved is not None)

    def _tables(
        self, all_: list[tree.Declaration], assumptions: set[AssumptionName], run: Collection[str]
    ) -> tuple[Table, ...]:
        tables = []
        over_time = {
            d.name.text for d in all_ if isinstance(d, tree.RequirementDecl) and d.standing is not None
        }
        for declaration in all_:
            if isinstance(declaration, tree.TableDecl) and self.scope.claim(declaration.name, "table"):
                for relied in declaration.assuming:
                    if relied.text in over_time:
                        message = f"assumption `{relied.text}` is over time: it is of the whole level, and no table names it"
                        self.scope.report(Code.NOT_OF_OUTSIDE, message, relied.span, "leave it out")
                    elif relied.text not in assumptions:
                        self.scope.unknown("assumption", relied, list(assumptions))
                name = declaration.name.text
                missing = f"no level runs table `{name}`, so that nothing counts its cycles"
                self.scope.untimed = "" if name in run else missing
                tables.append(table(self.scope, declaration))
        self.scope.untimed = ""
        return tuple(tables)
