"""One root file and all that it uses, to a `Program`."""

from collections.abc import Iterator
from dataclasses import replace

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, sort_key
from rcsc.model import (
    Assumption,
    AssumptionName,
    Enum,
    Int,
    Invariant,
    Kind,
    Level,
    OneTable,
    Owner,
    Program,
    Standing,
    Table,
    TableByCommand,
    TableName,
    Value,
    key_bounds,
    value_of_key,
)
from rcsc.project import Loaded, load
from rcsc.resolve import procedures as calls
from rcsc.resolve import variables
from rcsc.resolve.expressions import boolean, typed
from rcsc.resolve.leaves import read_by
from rcsc.resolve.scope import Body, Scope
from rcsc.resolve.tables import table
from rcsc.resolve.types import constant
from rcsc.source import Sources
from rcsc.syntax import tree


def resolve(root: str, loaded: Loaded) -> Program | tuple[Diagnostic, ...]:
    """The program of the file `root`, or every diagnostic of it and of the files it uses, by position."""
    files = list(_closure(root, loaded, set()))
    wrong = tuple(d for d in loaded.found if d.primary.span.file in files)
    if wrong:
        return wrong
    declarations = [d for file in files for d in loaded.files[file].declarations]
    return _Resolver(root, loaded.sources).program(declarations, loaded.files[root])


def compile_text(text: str, file: str = "case.rcs") -> Program | tuple[Diagnostic, ...]:
    """The program of a text that uses no other file."""
    loaded = load(["-"], stdin=text, stdin_name=file)
    return loaded.found or resolve(loaded.roots[0], loaded)


def _closure(file: str, loaded: Loaded, seen: set[str]) -> Iterator[str]:
    """`file` and all that it uses, used ones first."""
    if file in seen:
        return
    seen.add(file)
    for used in loaded.uses.get(file, ()):
        yield from _closure(used, loaded, seen)
    yield file


class _Resolver:
    """Works through the declarations, kind by kind, so that their order in the text is free."""

    def __init__(self, root: str, sources: Sources) -> None:
        self.root = root
        self.sources = sources
        self.scope = Scope()

    def program(self, all_: list[tree.Declaration], root: tree.File) -> Program | tuple[Diagnostic, ...]:
        """The program, or what is wrong."""
        scope = self.scope
        enums = self._names(all_)
        written = [d for d in all_ if isinstance(d, tree.ProcedureDecl) and scope.claim(d.name, "call")]
        scope.procedures.update({d.name.text: d for d in written})
        procedures = calls.procedures(scope, written)
        owners = calls.owners(
            scope, [d for d in all_ if isinstance(d, tree.OwnerDecl) and scope.claim(d.name, "call")]
        )
        assumptions = self._assumptions(all_)
        invariants = self._invariants(all_)
        tables = self._tables(all_, {a.name for a in assumptions})
        levels = self._levels(all_, tables, owners)
        if scope.found:
            return tuple(sorted(set(scope.found), key=sort_key))
        own = tuple(TableName(d.name.text) for d in root.declarations if isinstance(d, tree.TableDecl))
        stem = self.root.rpartition("/")[2].removesuffix(".rcs")
        return Program(
            stem,
            self.root,
            enums,
            tuple(scope.records),
            tuple(scope.declared.values()),
            tuple(scope.leaves.values()),
            procedures,
            assumptions,
            invariants,
            tables,
            own,
            owners,
            levels,
        )

    def _names(self, all_: list[tree.Declaration]) -> tuple[Enum, ...]:
        """Units, enumerations, constants and types in text order; then variables."""
        scope = self.scope
        enums = []
        for one in all_:
            match one:
                case tree.UnitDecl(name):
                    scope.units.add(name.text)
                case tree.EnumDecl():
                    enums.append(variables.declare_enum(scope, one))
                case tree.ConstDecl():
                    variables.declare_constant(scope, one)
                case tree.TypeDecl():
                    variables.declare_type(scope, one)
                case tree.RecordDecl():
                    variables.declare_record(scope, one)
                case _:
                    pass
        declared = [d for d in all_ if isinstance(d, tree.VariableDecl)]
        for variable in declared:
            variables.declare_variable(scope, variable)
        for variable in declared:
            variables.settle_deferred(scope, variable)
        return tuple(enums)

    def _assumptions(self, all_: list[tree.Declaration]) -> tuple[Assumption, ...]:
        made = []
        for one in all_:
            if isinstance(one, tree.AssumeDecl) and self.scope.claim(one.name, "assumption"):
                condition = boolean(self.scope, Body(), one.condition)
                if condition is not None:
                    standing = Standing(one.state or "assumed")
                    name = AssumptionName(one.name.text)
                    made.append(Assumption(name, standing, condition, " ".join(one.doc), one.name.span))
        return tuple(made)

    def _invariants(self, all_: list[tree.Declaration]) -> tuple[Invariant, ...]:
        made = []
        for one in all_:
            if not (isinstance(one, tree.InvariantDecl) and self.scope.claim(one.name, "assumption")):
                continue
            condition = boolean(self.scope, Body(), one.condition)
            if condition is None:
                continue
            inputs = [n for n in read_by(condition) if self.scope.leaves[n].kind is Kind.INPUT]
            if inputs:
                self.scope.report(
                    Code.KIND,
                    f"an invariant is about state and outputs; `{inputs[0]}` is an input",
                    one.condition.span,
                    "an assumption can be about inputs",
                )
            made.append(Invariant(one.name.text, condition, " ".join(one.doc), one.name.span))
        return tuple(made)

    def _tables(self, all_: list[tree.Declaration], assumptions: set[AssumptionName]) -> tuple[Table, ...]:
        made = []
        for one in all_:
            if isinstance(one, tree.TableDecl) and self.scope.claim(one.name, "table"):
                for name in one.assuming:
                    if name.text not in assumptions:
                        self.scope.unknown("assumption", name, list(assumptions))
                bare = table(self.scope, one, self.sources)
                text = self.sources[one.span.file].text
                columns = tuple(
                    replace(column, heading=text[column.span.start : column.span.end])
                    for column in bare.columns
                )
                made.append(replace(bare, columns=columns))
        return tuple(made)

    # --- levels ---

    def _levels(
        self, all_: list[tree.Declaration], tables: tuple[Table, ...], owners: tuple[Owner, ...]
    ) -> tuple[Level, ...]:
        names = {t.name for t in tables}
        made = []
        for one in all_:
            if isinstance(one, tree.LevelDecl) and self.scope.claim(one.name, "table"):
                chosen = self._chosen(one, names)
                before = calls.flattened(self.scope, one.preprocess, owners)
                after = calls.flattened(self.scope, one.postprocess, owners)
                if chosen is not None:
                    doc = " ".join(one.doc)
                    made.append(
                        Level(one.name.text, self._period(one), before, chosen, after, doc, one.name.span)
                    )
        return tuple(made)

    def _period(self, written: tree.LevelDecl) -> int:
        """In ms; 40 where none is written."""
        value = constant(self.scope, written.period) if written.period is not None else None
        if value is None:
            return 40
        assert written.period is not None
        kind, unit = value.expr.type, value.unit()
        factor = {(): 1, (("ms", 1),): 1, (("s", 1),): 1000}.get(unit)
        period = int(value.literal().value)
        if not isinstance(kind, Int) or factor is None:
            self.scope.report(Code.UNIT, "a period is a whole number of `ms` or `s`", written.period.span)
            return 40
        if not 1 <= period * factor <= 3_600_000:
            self.scope.report(Code.OUT_OF_RANGE_CONSTANT, "a period is 1 ms to one hour", written.period.span)
            return 40
        return period * factor

    def _chosen(self, written: tree.LevelDecl, tables: set[TableName]) -> OneTable | TableByCommand | None:
        used = [written.table] if written.table else [d.table for d in written.dispatch]
        for name in used:
            if name.text not in tables:
                self.scope.unknown("table", name, list(tables))
                return None
        if written.table is not None:
            return OneTable(TableName(written.table.text))
        assert written.selector is not None
        selector = typed(self.scope, Body(), written.selector)
        if selector is None:
            return None
        pairs: dict[Value, TableName] = {}
        for one in written.dispatch:
            value = constant(self.scope, one.value, selector.expr.type)
            if value is None or not variables.fits(self.scope, selector.expr.type, value, one.value.span):
                continue
            found = value.literal().value
            if found in pairs:
                self.scope.report(Code.DUPLICATE_ARM, "this command has a table already", one.value.span)
            pairs.setdefault(found, TableName(one.table.text))
        low, high = key_bounds(selector.expr.type)
        missing = [
            k
            for k in range(low, min(high, low + 4096) + 1)
            if value_of_key(selector.expr.type, k) not in pairs
        ]
        if missing and not self.scope.found:
            from rcsc.model import spell

            words = spell(selector.expr.type, value_of_key(selector.expr.type, missing[0]))
            self.scope.report(Code.MISSING_TABLE, f"`{words}` has no table", written.selector.span)
        return TableByCommand(selector.expr, tuple(sorted(pairs.items())))
