"""The names of one program and what is wrong with their use; shared by the parts of `resolve`."""

from collections.abc import Callable
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.units import written_in
from rcsc.lang.leaves import free_name
from rcsc.lang.model import (
    Declared,
    Enum,
    Expr,
    Literal,
    Local,
    Parameter,
    Record,
    Scalar,
    Type,
    Unit,
    Value,
    Variable,
    VariableName,
    unit_text,
)
from rcsc.lang.over_time.past import Past
from rcsc.lang.restart import COMMAND, ECHO, NUMBER, SEEN, STATUS
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import BITS, CALL_UNDER, ONE_GROUP, Cell

MOST_LEAVES = 10_000
INMODE = "inmode"
"""What a row of a table says in its first column, in a condition of the row that stands by itself."""
BASE_UNITS = frozenset("m mm s ms N kg deg rad Hz A V lb".split())


_SHARED = {
    "table": "tables and levels",
    "call": "procedures and owners",
    "value": "constants, sets, inputs, states and outputs",
    "assumption": "assumptions, invariants, properties and requirements",
}
"""Whose names are of one space."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A named constant, and whether it takes any unit (it was written without one)."""

    literal: Literal
    bare: bool


SetMember: TypeAlias = Constant | tuple[Constant, Constant] | tree.Mask
"""A value of a declared set, the two ends of a range of it, or a mask."""


@dataclass(frozen=True, slots=True)
class Held:
    """A condition that must hold for a time, and the state that counts the cycles for which it has held."""

    condition: Expr
    counter: VariableName
    limit: int


@dataclass(slots=True)
class Scope:
    """Everything declared so far, by name, and the diagnostics so far.

    Attributes:
        places: Where each name was declared, by `SPACE NAME`.
        sets: The members of each set; `set_names` has those, too, that are not resolved yet.
        signatures: The types of each procedure's parameters.
        places_of: The place of each leaf in declared order; made when it is asked for.
        doubles: The first spelling of each double of the text, and where it stands.
        singles: The same of each single.
        demand: Resolves a constant (`value`) or `type` asked for before its turn; False after an error.
        variables: Names of variables, declared or not yet.
        cell: The table cell that is being resolved.
        depth: How deep the expression that is being resolved nests.
        copied: Statements that copies of records and arrays came to so far.
        orders: Of each subordinate that is commanded, the output with its orders, and the flag that the same order comes once more.
        commands: Of each subordinate that is commanded, its commands.
        links: Names of links.
        numbers: Leaves that only the protocol writes: numbers, echoes, and what a subordinate said.
        previous: The hidden state of each leaf that something looks back at.
        kept: Those states as declared, which no text can name.
        held: The counters of conditions that have to hold for a time, by what the condition says.
        limits: The least limit of each of these counters, by the same key, as far as it is known.
        periods: The periods of the program's levels in ms, each once; None before they are known.
        untimed: Why `for` cannot stand in the table that is being resolved; empty where it can.
        in_property: Whether a property is being resolved, which has both cycles before it and needs no hidden state.
        past: The states of the requirement over time that is being resolved, whose conditions may look back anywhere; None elsewhere.
        no_before: Why `was` cannot stand in the expression that is being resolved; empty where it can.
        least_first: Whether what has no initial value starts with the least of its type, as in files from before 0 was it.
    """

    diagnostics: list[Diagnostic] = field(default_factory=list)
    places: dict[str, Span] = field(default_factory=dict)
    units: set[str] = field(default_factory=lambda: set(BASE_UNITS))
    constants: dict[str, Constant] = field(default_factory=dict)
    sets: dict[str, tuple[SetMember, ...]] = field(default_factory=dict)
    set_names: set[str] = field(default_factory=set)
    types: dict[str, Type] = field(default_factory=dict)
    members: dict[str, list[Enum]] = field(default_factory=dict)
    declared: dict[str, Declared] = field(default_factory=dict)
    leaves: dict[str, Variable] = field(default_factory=dict)
    places_of: dict[str, int] = field(default_factory=dict)
    deferred: set[str] = field(default_factory=set)
    procedures: dict[str, tree.ProcedureDecl] = field(default_factory=dict)
    signatures: dict[str, tuple[Scalar, ...]] = field(default_factory=dict)
    doubles: dict[float, tuple[str, Span]] = field(default_factory=dict)
    singles: dict[float, tuple[str, Span]] = field(default_factory=dict)
    records: list[Record] = field(default_factory=list)
    elements: dict[tuple[str, int], tuple[str, ...]] = field(default_factory=dict)
    demand: Callable[[str, tree.Name], bool] = lambda _space, _name: True
    variables: set[str] = field(default_factory=set)
    cell: Cell | None = None
    depth: int = 0
    copied: int = 0
    orders: dict[str, tuple[str, str]] = field(default_factory=dict)
    commands: dict[str, tuple[str, ...]] = field(default_factory=dict)
    links: tuple[str, ...] = ()
    numbers: frozenset[str] = frozenset()
    previous: dict[VariableName, VariableName] = field(default_factory=dict)
    kept: list[Declared] = field(default_factory=list)
    held: dict[str, Held] = field(default_factory=dict)
    limits: dict[str, int] = field(default_factory=dict)
    periods: tuple[int, ...] | None = None
    untimed: str = ""
    in_property: bool = False
    past: Past | None = None
    no_before: str = ""
    least_first: bool = False

    def report(
        self, code: Code, message: str, span: Span, *helps: str, related: tuple[Label, ...] = ()
    ) -> None:
        """Add an error; one found in a cell gets its place in the file."""
        self.diagnostics.append(Diagnostic(code, message, Label(self.at(span)), related=related, help=helps))

    def at(self, span: Span) -> Span:
        """Return the span in the file: nodes inside a table cell count from the start of the cell."""
        if span.file or self.cell is None:
            return span
        return tree.absolute(span, self.cell)

    def order(self, leaf: str) -> int:
        """Return the place of a leaf in declared order."""
        if len(self.places_of) != len(self.leaves):
            self.places_of = {name: at for at, name in enumerate(self.leaves)}
        return self.places_of[leaf]

    def names(self, base: str, length: int) -> tuple[str, ...]:
        """Return the names of the elements of an array; cached, as every use by index needs them all."""
        names = self.elements.get((base, length))
        if names is None:
            names = tuple(f"{base}[{at}]" for at in range(length))
            self.elements[base, length] = names
        return names

    def claim(self, name: tree.Name, space: str) -> bool:
        """Take `name` in a name space; report and refuse one that is taken."""
        key = f"{space} {name.text}"
        if key in self.places:
            first = Label(self.places[key], "first declared here")
            among = f": no two have the same among {_SHARED[space]}" if space in _SHARED else ""
            help_ = f"give one of them another name{among}"
            self.report(
                Code.DUPLICATE_NAME, f"`{name.text}` is declared twice", name.span, help_, related=(first,)
            )
            return False
        self.places[key] = name.span
        return True

    def unknown(self, kind: str, name: tree.Name, known: list[str], span: Span | None = None) -> None:
        """Report a name that nothing declares, with the nearest one that exists."""
        near = (
            [_FIELDS[name.text]]
            if _FIELDS.get(name.text) in known
            else get_close_matches(name.text, known, n=1)
        )
        helps = (f"did you mean `{near[0]}`?",) if near else ()
        made = self._made_by(kind, name.text, near=bool(near))
        helps = (made,) if made else helps
        if self.cell is not None and BITS.fullmatch(name.text):
            helps = (*helps, ONE_GROUP.format(name.text))
        if name.text == INMODE:
            where = "below `when`, or in a cell of a table `giving` results"
            helps = (f"`{INMODE}` stands {where}: it is what the row says in its first column",)
        if name.text in self.procedures:
            helps = (f"`{name.text}` is a procedure and has no value: {CALL_UNDER}",)
        self.report(Code.UNKNOWN_NAME, f"no {kind} is called `{name.text}`", span or name.span, *helps)

    def _made_by(self, kind: str, name: str, *, near: bool) -> str:
        """Return a help text: the declaration of the protocol that would make the name, or its owner; "" where there is none."""
        word, _, peer = name.partition("_")
        owners = [subordinate for subordinate, commands in self.commands.items() if name in commands]
        if kind == "procedure":
            if owners:
                return f"an order says to whom: `{owners[0]} := {name}(FIELD := VALUE)`"
            return "`commands SUBORDINATE : LINK` makes it" if name == "settle" and not self.commands else ""
        if kind == "link" and not near:
            return (
                f"links are {', '.join(f'`{link}`' for link in self.links)}"
                if self.links
                else "declare it: `link NAME { ... }`"
            )
        if not kind.startswith("variable") or not self.links:
            return ""
        if name in _HELD and self.commands:
            return f"write `{next(iter(self.commands))}.{name}`"
        if name in _SERVING:
            return "`serves SUPERIOR : LINK` makes it"
        peers = [other.removeprefix(f"{word}_") for other in self.declared if other.startswith(f"{word}_")]
        if word in {"to", "from", "last"} and peer and not get_close_matches(peer, peers, n=1):
            served = f", or `serves {peer} : LINK`," if word == "to" else ""
            return f"`commands {peer} : LINK`{served} makes it"
        if not near and (name in self.links or (kind == "variable" and self.cell is not None)):
            return f"if it is a subordinate: `commands {name} : LINK` declares it"
        return ""

    def unit(self, written: tree.Unit | None, number: int | None = None) -> Unit:
        """Return the unit in normal form; () for none. `number`: what it stands behind, for messages."""
        if written is None:
            return ()
        powers: dict[str, int] = {}
        for factor in written.factors:
            if factor.name.text not in self.units:
                name = factor.name.text
                alone = len(written.factors) == 1 and factor.power == 1
                instead = written_in(name, self.units, number if alone else None)
                declares = f"declare it: `unit {name}`"
                helps = (f"{instead}; or {declares}, which nothing converts",) if instead else (declares,)
                self.report(Code.UNIT, f"`{name}` is not a unit", factor.name.span, *helps)
            powers[factor.name.text] = powers.get(factor.name.text, 0) + factor.power
        return normal(powers)

    def unsure(self, *units: Unit) -> bool:
        """Return whether one of the units has a name that is none, which was reported: what follows from it is not."""
        return any(name not in self.units for unit in units for name, _ in unit)


_FIELDS = {
    "command": COMMAND,
    "number": NUMBER,
    "status": STATUS,
    "echo": ECHO,
}
"""Fields that the protocol makes, by what one would call them."""
_HELD = frozenset({"resting", "late", "status"})
"""Fields of a subordinate's state besides its report's fields."""
_SERVING = frozenset({"new_command", "answered", SEEN})
"""State that a level keeps about its superior's order."""


def spell_number(value: Value) -> str:
    """Return the number for a message; a very long one by its size."""
    if isinstance(value, int) and abs(value) >= 10**40:
        return f"{'-' * (value < 0)}(a number of {value.bit_length()} bits)"
    return repr(value)


def normal(powers: dict[str, int]) -> Unit:
    """Return the unit with these powers: sorted, without zero powers."""
    return tuple(sorted((name, power) for name, power in powers.items() if power))


def spell_unit(unit: Unit) -> str:
    """Return the unit as text, as `mm/s`; `1` for none."""
    return unit_text(unit) or "1"


@dataclass(slots=True)
class Body:
    """The parameters and locals of one procedure; names made unique within it."""

    visible: dict[str, Parameter | Local] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)

    def fresh(self, name: str) -> str:
        """Return the name, or the first numbered one that no other local has, and take it."""
        unique = free_name(name, self.taken)
        self.taken.add(unique)
        return unique
