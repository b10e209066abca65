"""Two versions of a program over one set of variables.

In: two programs. Out: `Aligned`: the leaves that both have, each with the values that both versions can hold, and what
changed of the declarations. Members of an enumeration are the same where their names are: where the two versions number them
differently, both are numbered anew. States that the compiler adds are the same where they are fed with the same (`rcsc.lang.hidden`).
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from rcsc.lang.hidden import hidden, matched
from rcsc.lang.model import (
    Among,
    Arm,
    Case,
    Enum,
    Int,
    Kind,
    Literal,
    Program,
    Real,
    Scalar,
    TableByCommand,
    Test,
    Value,
    Variable,
    spell,
    unit_text,
)


@dataclass(frozen=True, slots=True)
class Declaration:
    """What changed of a declaration.

    Attributes:
        what: `variable x`, `enumeration status`.
        before: Empty where it is new; likewise `after` where it is gone.
    """

    what: str
    before: str
    after: str


@dataclass(frozen=True, slots=True)
class Aligned:
    """Two versions that can be compared.

    Attributes:
        before, after: The programs, members of enumerations numbered alike.
        leaves: The leaves that both have, with the values that both can hold, in declared order.
        apart: Leaves of one name but of kinds that cannot be compared.
        changes: Of declarations.
    """

    before: Program
    after: Program
    leaves: Mapping[str, Scalar]
    apart: frozenset[str]
    changes: tuple[Declaration, ...]


def aligned(before: Program, after: Program) -> Aligned:
    """Return the two versions over the values that they share."""
    changes = tuple(_declarations(before, after))
    numbering = _numbering(before, after)
    old, new = (
        _Rewriter(numbering).program(program) if numbering else program for program in (before, after)
    )
    old, new = matched(old, new)
    later = {str(variable.name): variable.type for variable in new.variables}
    leaves: dict[str, Scalar] = {}
    apart = set()
    for variable in old.variables:
        if variable.name in later:
            kind = _both(variable.type, later[variable.name], numbering)
            if kind is None:
                apart.add(str(variable.name))
            else:
                leaves[str(variable.name)] = kind
    return Aligned(old, new, leaves, frozenset(apart), changes)


def _both(first: Scalar, second: Scalar, shared: "Mapping[Enum, _Members]") -> Scalar | None:
    """Return the values of both types; None where they are of different kinds, or have none in common."""
    match first, second:
        case Int(unit=unit), Int(unit=other) if unit == other:
            low, high = max(first.low, second.low), min(first.high, second.high)
            return Int(low, high, unit) if low <= high else None
        case Real(unit=unit), Real(unit=other) if unit == other and type(first) is type(second):
            least, greatest = max(first.low, second.low), min(first.high, second.high)
            return replace(first, low=least, high=greatest) if least <= greatest else None
        case Enum(), Enum():
            known = {members.whole: members.common for members in shared.values()}
            if first == second:
                return Enum(first.name, known[first]) if first in known else first
            return first if first.members == second.members else None
        case _:
            return first if type(first) is type(second) and not isinstance(first, Int | Real | Enum) else None


# --- enumerations ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Members:
    """A version's enumeration numbered anew.

    Attributes:
        whole: The members of both versions: those in common first.
        common: Those in common.
        to: The new number of each member.
    """

    whole: Enum
    common: tuple[str, ...]
    to: tuple[int, ...]


def _numbering(before: Program, after: Program) -> dict[Enum, _Members]:
    """For each enumeration that both declare with other members, how it is numbered anew; by its old form."""
    later = {enum.name: enum for enum in after.enums}
    numbering = {}
    for old in before.enums:
        new = later.get(old.name)
        if new is None or new.members == old.members:
            continue
        common = tuple(name for name in old.members if name in new.members)
        if not common:
            continue
        rest = [name for name in (*old.members, *new.members) if name not in common]
        whole = Enum(old.name, (*common, *dict.fromkeys(rest)))
        for version in (old, new):
            numbering[version] = _Members(whole, common, tuple(map(whole.members.index, version.members)))
    return numbering


class _Rewriter:
    """One program being rewritten; tests that lines share stay shared."""

    def __init__(self, members: Mapping[Enum, _Members]) -> None:
        self.members = members
        self.tests: dict[int, Test] = {}

    def program(self, program: Program) -> Program:
        """Rewritten, apart from its declarations as written."""
        return replace(
            program,
            variables=self.any(program.variables),
            procedures=self.any(program.procedures),
            assumptions=self.any(program.assumptions),
            invariants=self.any(program.invariants),
            properties=self.any(program.properties),
            environment=self.any(program.environment),
            tables=self.any(program.tables),
            levels=self.any(program.levels),
        )

    def any(self, value: Any) -> Any:
        """Return any part of the model."""
        if isinstance(value, Enum):
            return self.members[value].whole if value in self.members else value
        if isinstance(value, tuple):
            return tuple(self.any(part) for part in value)
        if not is_dataclass(value) or isinstance(value, type):
            return value
        return self._test(value) if isinstance(value, Test) else self._changed(value)

    def _test(self, test: Test) -> Test:
        known = self.tests.get(id(test))
        if known is None:  # its box counts members as they were; the condition says the same
            known = self.tests[id(test)] = replace(test, condition=self.any(test.condition), box=None)
        return known

    def _changed(self, value: Any) -> Any:
        parts = {field.name: self.any(getattr(value, field.name)) for field in fields(value) if field.init}
        match value:
            case Literal(type=kind) if isinstance(kind, Enum):
                parts["value"] = self._number(kind, value.value)
            case Among(subject=subject):
                parts["values"] = self._numbers(subject.type, value.values)
            case Variable(type=kind):
                parts["initial"] = self._number(kind, value.initial)
                if value.safe is not None:
                    parts["safe"] = self._number(kind, value.safe)
            case Case(subject=subject):
                parts["arms"] = tuple(
                    Arm(self._numbers(subject.type, arm.values), self.any(arm.body), arm.span)
                    for arm in value.arms
                )
            case TableByCommand(selector=selector):
                parts["tables"] = tuple((self._number(selector.type, at), name) for at, name in value.tables)
        return type(value)(**parts)

    def _number(self, kind: Scalar, value: Value) -> Value:
        if isinstance(kind, Enum) and kind in self.members:
            return self.members[kind].to[int(value)]
        return value

    def _numbers(self, kind: Scalar, numbers: Iterable[Value]) -> tuple[Value, ...]:
        return tuple(self._number(kind, value) for value in numbers)


# --- declarations --------------------------------------------------------------------------


def _declarations(before: Program, after: Program) -> Iterable[Declaration]:
    """Enumerations and variables that are new, gone, or declared otherwise."""
    added = hidden(before), hidden(after)  # they follow from what asks for them, and from levels and tables
    enums = [
        {enum.name: ", ".join(enum.members) for enum in program.enums if enum.name not in own}
        for program, own in zip((before, after), added, strict=True)
    ]
    yield from _changed(
        "enumeration",
        *({n: members for n, members in enum.items() if all(n in e for e in enums)} for enum in enums),
    )
    yield from _changed(  # the leaf of a deferred value is declared with its variable
        "variable",
        *(
            {
                str(v.name): _declared(v)
                for v in p.variables
                if not v.name.endswith(".next") and v.name not in own
            }
            for p, own in zip((before, after), added, strict=True)
        ),
    )


def _changed(what: str, before: Mapping[str, str], after: Mapping[str, str]) -> Iterator[Declaration]:
    for name in dict.fromkeys((*before, *after)):
        if before.get(name, "") != after.get(name, ""):
            yield Declaration(f"{what} `{name}`", before.get(name, ""), after.get(name, ""))


def _declared(variable: Variable) -> str:
    """Return the declaration in the language's words, without its deferred value."""
    unit = variable.type.unit if isinstance(variable.type, Int | Real) else ()
    stated = f" [{unit_text(unit)}]" if unit else ""
    first = spell(variable.type, variable.initial)
    admit = f" {variable.admit.value}" if variable.kind is Kind.INPUT else ""
    deferred = " deferred" if variable.deferred_until is not None else ""
    admit += "" if variable.safe is None else f" safe {spell(variable.type, variable.safe)}"
    return f"{variable.kind.value} : {kind_said(variable.type)}{stated} = {first}{admit}{deferred}"


def kind_said(kind: Scalar) -> str:
    """Return the type in the language's words."""
    match kind:
        case Enum(name=name):
            return name
        case Int() | Real():
            return f"{type(kind).__name__.lower()} {spell(kind, kind.low)} .. {spell(kind, kind.high)}"
        case _:
            return "bool"
