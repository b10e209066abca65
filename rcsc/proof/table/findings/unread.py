"""What a program declares that nobody reads, or that may not mean what its author meant: warnings, by position.

In: a program, and the texts that it was made of. Out: a warning for each state and input of the root file of which nothing reads any part,
for each constant that nothing uses, and for each member of an enumeration that nothing gives or asks for; and for each variable of the
whole program without a declared start value.

Of what nobody reads only the root file is judged, and only where it has a table or a level: what a vocabulary declares is for whoever uses
it. Outputs are for whoever takes them, with the members that they may have; members of an input, of a link or of what an extern procedure
gives come from outside. What the protocol makes is its own. In doubt something is read.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.source import Span
from rcsc.lang.leaves import every_statement, expressions, read_by, root_of, written_by
from rcsc.lang.model import (
    BEFORE,
    Array,
    Declared,
    Enum,
    Expr,
    Int,
    Kind,
    Program,
    Real,
    Record,
    Type,
    Variable,
    spell,
)
from rcsc.lang.protocol.environment import refusable
from rcsc.lang.restart import ECHO, NUMBER, After, SameAs
from rcsc.lang.syntax import tree

TOLD = frozenset({Code.UNREAD, Code.UNUSED_CONSTANT, Code.UNUSED_MEMBER, Code.STAYS_AFTER_FAULT})
"""The codes of these warnings: `rcsc check` tells them, and no editor, while a text is being written."""


def unread(program: Program, files: Mapping[str, tree.File]) -> Iterator[Diagnostic]:
    """Yield a warning for each name that nothing uses; none for a file that only declares words.

    Args:
        program: It may have findings of its own.
        files: Those of the program.
    """
    if not program.own_tables and not any(level.span.file == program.file for level in program.levels):
        return
    yield from _staying(program)
    written = [d for file in files.values() for d in file.declarations]
    own = files[program.file].declarations
    yield from _variables(program, {d.name.text for d in own if isinstance(d, tree.VariableDecl)})
    mentioned = _Mentioned()
    mentioned.add(written)
    for const in own:
        if isinstance(const, tree.ConstDecl) and const.name.text not in mentioned.names:
            yield _warning(
                Code.UNUSED_CONSTANT, f"nothing uses constant `{const.name.text}`", const.name.span
            )
    outside = _from_outside(program) | _linked(written)
    for enum in own:
        if isinstance(enum, tree.EnumDecl) and enum.name.text not in outside:
            yield from _members(enum, mentioned)


def _warning(code: Code, message: str, span: Span, *helps: str) -> Diagnostic:
    return Diagnostic(code, message, Label(span), help=helps, severity=Severity.WARNING)


# --- outputs after a fault ---


def _staying(program: Program) -> Iterator[Diagnostic]:
    """Yield a warning for each output without a safe value, but for orders and reports, of a level that can refuse a reading."""
    if not any(level.span.file == program.file for level in program.levels):
        return
    leaves = {variable.name: variable for variable in program.variables}
    declared = [one for one in program.declared if not any(map(_numbered, one.leaves))]
    inputs = (leaves[name] for one in declared if one.kind is Kind.INPUT for name in one.leaves)
    refused = next((leaf.name for leaf in inputs if refusable(leaf)), None)
    if refused is None:
        return
    for output in declared:
        if output.kind is not Kind.OUTPUT or any(leaves[name].safe is not None for name in output.leaves):
            continue
        yield _warning(
            Code.STAYS_AFTER_FAULT,
            f"output `{output.name}` stays as it was while a reading of `{refused}` is refused",
            output.span,
            "write what it is to show then, such as `safe false` after its type, or after that of a field of its record",
        )


def _numbered(leaf: str) -> bool:
    """Return whether a leaf is the number, or its echo, of an order or a report."""
    return leaf.endswith((f".{NUMBER}", f".{ECHO}"))


# --- variables without a start ---


def declared_badly(program: Program) -> Iterator[Diagnostic]:
    """Yield a warning for each number without a start value, declared or 0, wherever it is declared."""
    leaves = {variable.name: variable for variable in program.variables}
    for declared in program.declared:
        unsaid = next((leaf for name in declared.leaves if _starts_unsaid(leaf := leaves[name])), None)
        if unsaid is not None:
            yield _no_start(unsaid)


def _starts_unsaid(leaf: Variable) -> bool:
    kind = leaf.type
    hidden = leaf.previous_of is not None or leaf.line_of is not None
    return not leaf.given and not hidden and isinstance(kind, Int | Real) and not kind.low <= 0 <= kind.high


def _no_start(leaf: Variable) -> Diagnostic:
    kind = leaf.type
    assert isinstance(kind, Int | Real)
    value = spell(kind, leaf.initial)
    ends = f"{spell(kind, kind.low)} .. {spell(kind, kind.high)}"
    message = f"`{leaf.name}` has no declared start value: 0 is not in {ends}, so it starts with {value}"
    part = leaf.name.rpartition(".")[2].partition("[")[0] if "." in leaf.name else ""
    where = f"the type of field `{part}`" if part else "its type"
    return _warning(
        Code.NO_START, message, leaf.span, f"write what is meant after {where}, such as `= {value}`"
    )


# --- states and inputs ---


def _variables(program: Program, own: set[str]) -> Iterator[Diagnostic]:
    assigned = set(_assigned(program))
    reads = {*map(root_of, _read(program)), *(name for name, by in assigned if by != name)}
    kept = {name for name, by in assigned if by == name}
    for declared in program.declared:
        if declared.name in own and declared.name not in reads and declared.kind is not Kind.OUTPUT:
            yield _unread(declared, to_itself=declared.name in kept)


def _unread(declared: Declared, *, to_itself: bool) -> Diagnostic:
    message = f"nothing reads {declared.kind.value} `{declared.name}`"
    if to_itself:
        message += " but assignments to itself"
    helps = () if declared.kind is Kind.INPUT else ("what is only to be shown is an `output`",)
    return _warning(Code.UNREAD, message, declared.span, *helps)


def _read(program: Program) -> Iterator[str]:
    """Yield the leaves that something reads, but for the values of assignments."""
    for condition in _conditions(program):
        yield from (leaf.removeprefix(BEFORE) for leaf in read_by(condition))
    for procedure in program.procedures:
        if procedure.extern is not None:
            yield from procedure.reads
    for adopted in program.adopted.values():
        if isinstance(adopted, SameAs | After):
            yield adopted.leaf
    yield from (str(variable.previous_of) for variable in program.variables)


def _conditions(program: Program) -> Iterator[Expr]:
    for stated in (program.assumptions, program.invariants):
        yield from (each.condition for each in stated)
    yield from (condition for each in program.stated for condition in each.about)
    for variable in program.variables:
        yield from (each for each in (variable.deferred_until, variable.counts) if each is not None)
    for level in program.levels:
        yield from level.selectors
    for table in program.tables:
        yield from (column.subject for column in table.columns if column.subject is not None)
        yield from (test.condition for test in table.distinct_tests)
        yield from (meeting.where for meeting in table.meetings)
    for statement in every_statement(program):
        if not written_by(statement):
            yield from expressions(statement)


def _assigned(program: Program) -> Iterator[tuple[str, str]]:
    """Yield each variable that an assignment reads, with the variable assigned to."""
    for statement in every_statement(program):
        for place in written_by(statement)[:1]:
            for expr in expressions(statement):
                yield from ((root_of(leaf), root_of(place)) for leaf in read_by(expr))


# --- constants and members ---


class _Mentioned:
    """Names that a text mentions, but for those that it declares there."""

    def __init__(self) -> None:
        self.names: set[str] = set()
        self.seen: set[int] = set()

    def add(self, nodes: Iterable[object]) -> None:
        """Add all names mentioned in these nodes; lines share their cells, so that each node is entered once."""
        waiting = list(nodes)
        while waiting:
            node = waiting.pop()
            if isinstance(node, tuple):
                waiting += node
            elif isinstance(node, tree.Name):
                self.names.add(node.text)
            elif is_dataclass(node) and not isinstance(node, type) and id(node) not in self.seen:
                self.seen.add(id(node))
                waiting += (getattr(node, each.name) for each in fields(node) if _says(node, each.name))


_DECLARES = (tree.Documented, tree.Local, tree.For, tree.Parameter)
_ASIDE = frozenset(("span", "cell", "cells", "places", "above", "same", "requirements", "doc", "comments"))


def _says(node: object, part: str) -> bool:
    """Return whether names in this part of a node are mentioned, not declared."""
    if part in _ASIDE or (part == "name" and isinstance(node, _DECLARES)):
        return False
    return not (part == "members" and isinstance(node, tree.EnumDecl))


def _members(enum: tree.EnumDecl, mentioned: _Mentioned) -> Iterator[Diagnostic]:
    """Yield a warning for each unused member of an enumeration. The first is exempt: its variables start with it."""
    for member in enum.members[1:]:
        if member.text not in mentioned.names:
            message = f"nothing gives or asks for member `{member.text}` of `{enum.name.text}`"
            yield _warning(Code.UNUSED_MEMBER, message, member.span)


def _from_outside(program: Program) -> set[str]:
    """Return the enumerations whose members may come from outside: of inputs and outputs, extern results, and adopted values."""
    outside = [d.type for d in program.declared if d.kind is not Kind.STATE]
    given = {str(leaf) for each in program.procedures if each.extern is not None for leaf in each.writes}
    given |= program.adopted.keys()
    outside += [variable.type for variable in program.variables if variable.name in given]
    return {name for kind in outside for name in _enums(kind)}


def _enums(kind: Type) -> Iterator[str]:
    match kind:
        case Enum(name=name):
            yield name
        case Array(element=element):
            yield from _enums(element)
        case Record(fields=parts):
            for part in parts:
                yield from _enums(part.type)
        case _:
            return


def _linked(written: Iterable[tree.Declaration]) -> set[str]:
    """Return the names of types in links, and of those that these are made of."""
    links, types = _Mentioned(), list[tree.TypeDecl | tree.RecordDecl]()
    for each in written:
        if isinstance(each, tree.LinkDecl):
            links.add((each,))
        elif isinstance(each, tree.TypeDecl | tree.RecordDecl):
            types.append(each)
    while made := [each for each in types if each.name.text in links.names and id(each) not in links.seen]:
        links.add(made)
    return links.names
