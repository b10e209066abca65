"""Requirements across levels: a file that declares nothing but what a whole system has to do, over the variables of its levels.

In: the file, read; what each party of the system is called and has. Out: a `Program` without tables whose variables are those of all
parties, each under the name of its party, so that `lift.motor` is the field of a record; its properties and requirements over time are
resolved as those of a level are. One cycle of it is a tick of the system.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, sort_key
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.model import (
    Declared,
    Enum,
    Int,
    Kind,
    Program,
    Property,
    Real,
    Record,
    RecordField,
    Type,
    Variable,
    VariableName,
)
from rcsc.lang.project import Loaded
from rcsc.lang.resolve.declarations import Names
from rcsc.lang.resolve.program import closure
from rcsc.lang.resolve.properties import stated
from rcsc.lang.syntax import tree

STATES = (
    tree.Use,
    tree.UnitDecl,
    tree.ConstDecl,
    tree.SetDecl,
    tree.EnumDecl,
    tree.TypeDecl,
    tree.PropertyDecl,
    tree.RequirementDecl,
)
"""What the file itself may declare; the files that it uses may declare anything."""
NAMES = (tree.UnitDecl, tree.ConstDecl, tree.SetDecl, tree.EnumDecl, tree.TypeDecl, tree.RecordDecl)
"""What is taken over from the files that it uses."""


@dataclass(frozen=True, slots=True)
class Named:
    """A variable of a party.

    Attributes:
        leaves: Its scalar parts, each under its name in the party.
        given: Whether it comes from outside the levels.
    """

    name: str
    type: Type
    leaves: tuple[Variable, ...]
    doc: str = ""
    given: bool = False


Parties = Mapping[str, Sequence[Named]]
"""The variables of each level and of each party outside, by its name."""


def named(program: Program, declared: Declared, name: str = "", *, given: bool = False) -> Named:
    """Return a variable of a level, under its own name or another."""
    leaves = (v for v in program.variables if v.name in declared.leaves)
    renamed = (
        replace(v, name=VariableName((name or declared.name) + v.name.removeprefix(declared.name)))
        for v in leaves
    )
    return Named(name or declared.name, declared.type, tuple(renamed), declared.doc, given)


def part_of(program: Program, name: str) -> Declared | None:
    """Return the declared variable that a buffer's end names; None where it names a part of one, or nothing."""
    return next((each for each in program.declared if each.name == name), None)


def resolve_across(
    root: str, loaded: Loaded, parties: Parties, tick_ms: int
) -> Program | tuple[Diagnostic, ...]:
    """Resolve a file of requirements across levels; return every diagnostic of it and of the files that it uses, by position.

    Args:
        root: The file.
        loaded: It and all that it uses.
        parties: What its names mean.
        tick_ms: The length of a cycle of it, in ms.
    """
    files = closure(root, loaded)
    wrong = [d for d in loaded.diagnostics if d.primary.span.file in files]
    own = loaded.files[root].declarations if not wrong else ()
    used = [d for file in files if file != root for d in loaded.files[file].declarations] if not wrong else []
    scope = Scope(diagnostics=wrong, periods=(tick_ms,))
    scope.units |= _units(parties)
    for declaration in own:
        if not isinstance(declaration, STATES):
            _refused(scope, declaration, root)
    if scope.diagnostics:
        return _sorted(scope)
    words = [d for d in used if isinstance(d, NAMES)]
    enums = Names(scope, [*words, *(d for d in own if isinstance(d, NAMES))]).declare()
    _members(scope, parties)
    for party, variables in parties.items():
        _declare(scope, party, variables, Span(root, 0, 0))
    every = stated(scope, own)
    if scope.diagnostics:
        return _sorted(scope)
    return _program(scope, root, enums, every)


def stating_nothing(parties: Parties) -> Program:
    """Return the program of these parties that requires nothing of them."""
    scope = Scope(diagnostics=[], periods=())
    for party, variables in parties.items():
        _declare(scope, party, variables, Span("", 0, 0))
    return _program(scope, "", (), ())


def _program(scope: Scope, root: str, enums: tuple[Enum, ...], every: Sequence[Property]) -> Program:
    return Program(
        root.rpartition("/")[2].removesuffix(".rcs"),
        root,
        enums,
        tuple(scope.records),
        tuple(scope.declared.values()),
        tuple(scope.leaves.values()),
        (),
        (),
        (),
        (),
        (),
        (),
        (),
        tuple(one for one in every if not one.assumed),
        None,
        (),
        tuple(one for one in every if one.assumed),
    )


def _sorted(scope: Scope) -> tuple[Diagnostic, ...]:
    return tuple(sorted(set(scope.diagnostics), key=sort_key))


def _refused(scope: Scope, declaration: tree.Declaration, root: str) -> None:
    """Report a declaration that has no place in such a file."""
    name = getattr(declaration, "name", None)
    span = name.span if isinstance(name, tree.Name) else Span(root, 0, 0)
    message = (
        "a file of requirements across levels states requirements and properties, and assumptions over time"
    )
    helps = "declare this in the tables of a level; `LEVEL.VARIABLE` reads it here"
    scope.report(Code.NOT_ACROSS, message, span, helps)


def _units(parties: Parties) -> set[str]:
    """Return the names of the units that variables have: those of a level need no declaration here."""
    kinds = (leaf.type for each in parties.values() for variable in each for leaf in variable.leaves)
    return {name for kind in kinds if isinstance(kind, Int | Real) for name, _ in kind.unit}


def _members(scope: Scope, parties: Parties) -> None:
    """Make the members known of all enumerations that variables have."""
    kinds = [leaf.type for each in parties.values() for variable in each for leaf in variable.leaves]
    for kind in dict.fromkeys(kind for kind in kinds if isinstance(kind, Enum)):
        scope.types.setdefault(kind.name, kind)
        for member in kind.members:
            known = scope.members.setdefault(member, [])
            if kind not in known:
                known.append(kind)


def _declare(scope: Scope, party: str, variables: Iterable[Named], span: Span) -> None:
    """Declare what a party has, as a record of its name."""
    if not scope.claim(tree.Name(party, span), "value"):
        return
    fields, leaves = list[RecordField](), list[VariableName]()
    for variable in variables:
        fields.append(RecordField(variable.name, variable.type, variable.doc))
        for leaf in variable.leaves:
            name = VariableName(f"{party}.{leaf.name}")
            leaves.append(name)
            kind = Kind.INPUT if variable.given else Kind.STATE
            scope.leaves[name] = Variable(name, kind, leaf.type, leaf.initial, doc=leaf.doc, span=leaf.span)
    record = Record(party, tuple(fields))
    scope.declared[party] = Declared(party, Kind.STATE, record, tuple(leaves))
