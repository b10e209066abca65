"""Who is whose superior, as a program declares it: checked before anything is made of it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.literals import number_of
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.restart import COMMAND, ECHO, ECHOED, NUMBER, STATUS
from rcsc.lang.syntax import tree

MOST_DEPTH, MOST_LENGTH = 16, 1024
"""How deep types nest, and how long arrays are, that an order is numbered by."""


@dataclass(frozen=True, slots=True)
class Party:
    """A neighbour, and the link to it.

    Attributes:
        without: Standard properties that are not asked.
        within: Cycles after which an order that is not echoed has failed; None where it is waited for without end.
        late: The reason that is then given; None where there is none.
        again: Whether some line gives it the same order once more.
        answered: Cycles after which an order that is not answered has failed; `unanswered`, the reason. None likewise.
        failed: The place of *failed* among the members of the status.
        numbered: Scalars of the order that change with its number only.
        none: The member of the reason that says that there is none; None where the report has no reason.
    """

    peer: tree.Name
    link: tree.LinkDecl
    failed: int
    numbered: tuple[str, ...]
    none: str | None
    without: tuple[str, ...] = ()
    within: tree.Expr | None = None
    late: str | None = None
    answered: tree.Expr | None = None
    unanswered: str | None = None
    again: bool = False

    @property
    def name(self) -> str:
        """The level's name for the neighbour, and for the variable that holds the neighbour's orders or reports."""
        return self.peer.text

    @property
    def told(self) -> str:
        """The output to the neighbour."""
        return f"to_{self.name}"

    @property
    def raw(self) -> str:
        """The input with a subordinate's report, as it comes."""
        return f"from_{self.name}"

    @property
    def last(self) -> str:
        """The order to a subordinate that was numbered last."""
        return f"last_{self.name}"

    @property
    def bounded(self) -> bool:
        """True where an order fails that is not echoed, or not answered, in time."""
        return self.within is not None or self.answered is not None

    @property
    def once_more(self) -> str:
        """The flag that the same order is given once more."""
        return f"{self.name}_again"

    @property
    def held(self) -> tuple[tree.LinkField, ...]:
        """Fields of the report that are held until every last order is echoed."""
        return tuple(part for part in self.link.report if part.word != "stream")

    @property
    def reason(self) -> str | None:
        """The field of the report that says why a command failed."""
        return next((part.name.text for part in self.link.report if part.word == "reason"), None)


@dataclass(frozen=True, slots=True)
class Parties:
    """The neighbours that the levels of a program serve and command.

    Attributes:
        superior: None where they take no numbered orders.
        members: Of each enumeration.
    """

    superior: Party | None
    subordinates: tuple[Party, ...]
    members: Mapping[str, tuple[str, ...]]

    def __bool__(self) -> bool:
        return self.superior is not None or bool(self.subordinates)

    @property
    def numbers(self) -> frozenset[str]:
        """The leaves that only the protocol writes: numbers of orders, echoes, and the held reports of subordinates."""
        held = (f"{party.name}.{part}" for party in self.subordinates for part in _HELD)
        above = () if self.superior is None else (ECHO, ECHOED)
        own = (f"{self.superior.told}.{part}" for part in above if self.superior is not None)
        return frozenset((*own, *held, *(f"{party.told}.{NUMBER}" for party in self.subordinates)))

    def named(self, name: str) -> Party | None:
        """Return the subordinate of that name; None if there is none."""
        return next((party for party in self.subordinates if party.name == name), None)


def declared(scope: Scope, declarations: Sequence[tree.Declaration]) -> Parties:
    """Return the neighbours that are declared; report what is wrong with them."""
    types = _Types(declarations)
    written = [d for d in declarations if isinstance(d, tree.LinkDecl) and scope.claim(d.name, "link")]
    links = {link.name.text: link for link in written if _sound(scope, link, types)}
    served = [d for d in declarations if isinstance(d, tree.ServesDecl)]
    for more in served[1:]:
        helps = "another one orders a level of its own, or through the one superior"
        scope.report(Code.DUPLICATE_NAME, "a level serves one superior", more.span, helps)
    commanded = [d for d in declarations if isinstance(d, tree.CommandsDecl)]
    for peer in [d.peer for d in served[:1]] + [d.peer for d in commanded]:
        scope.claim(peer, "neighbour")
    superior = _superior(scope, served[0], links, types) if served else None
    again = {name for declaration in declarations for name in _ordered_again(declaration)}
    below = (_subordinate(scope, d, links, types, again=d.peer.text in again) for d in commanded)
    return Parties(superior, tuple(party for party in below if party is not None), types.members)


def _ordered_again(declaration: tree.Declaration) -> Iterator[str]:
    """Yield the subordinates to which a declaration gives the same order once more."""
    if isinstance(declaration, tree.TableDecl):
        for at, heading in enumerate(declaration.actions):
            if isinstance(heading.subject, tree.Reference) and any(
                isinstance(cell := row.actions[at], tree.Comparison)
                and isinstance(cell.value, tree.Order)
                and cell.value.again
                for row in declaration.rows
            ):
                yield heading.subject.name.text
    for statement in tree.statements(declaration):
        match statement:
            case tree.Assign(tree.Reference(name), tree.Order(again=True)):
                yield name.text


class _Types:
    """The declarations of the types that links use.

    Attributes:
        members: Of each enumeration.
    """

    def __init__(self, declarations: Sequence[tree.Declaration]) -> None:
        self.members = {
            d.name.text: tuple(m.text for m in d.members)
            for d in declarations
            if isinstance(d, tree.EnumDecl)
        }
        self._named = {d.name.text: d for d in declarations if isinstance(d, tree.TypeDecl | tree.RecordDecl)}
        self._constants = {d.name.text: d.value for d in declarations if isinstance(d, tree.ConstDecl)}

    def scalars(self, path: str, kind: tree.TypeExpr, depth: int = 0) -> Iterator[str]:
        """Yield the scalars of a field; an invalid type counts as one scalar, and is reported elsewhere."""
        named = self._named.get(kind.name.text) if isinstance(kind, tree.NamedType) else None
        length = self._length(kind.length) if isinstance(kind, tree.ArrayType) else None
        if depth > MOST_DEPTH:
            yield path
        elif isinstance(named, tree.RecordDecl):
            for part in named.fields:
                yield from self.scalars(f"{path}.{part.name.text}", part.type, depth + 1)
        elif isinstance(named, tree.TypeDecl):
            yield from self.scalars(path, named.type, depth + 1)
        elif isinstance(kind, tree.ArrayType) and length is not None:
            for at in range(length):
                yield from self.scalars(f"{path}[{at}]", kind.element, depth + 1)
        else:
            yield path

    def _length(self, written: tree.Expr) -> int | None:
        length = self.number(written)
        return length if length is not None and length <= MOST_LENGTH else None

    def number(self, written: tree.Expr) -> int | None:
        """Return the value of a number, or of a constant that is one; None for any other expression."""
        if isinstance(written, tree.Reference):
            written = self._constants.get(written.name.text, written)
        return number_of(written.text) if isinstance(written, tree.IntLiteral) else None

    def unit(self, written: tree.Expr) -> bool:
        """Return whether a number, or a constant that is one, has a unit."""
        if isinstance(written, tree.Reference):
            written = self._constants.get(written.name.text, written)
        return isinstance(written, tree.IntLiteral | tree.RealLiteral) and written.unit is not None

    def none(self, link: tree.LinkDecl) -> str | None:
        """Return the first member of the link's reason; None where it has no reason."""
        kind = next((part.type for part in link.report if part.word == "reason"), None)
        return self.members[kind.name.text][0] if isinstance(kind, tree.NamedType) else None


def _superior(
    scope: Scope, served: tree.ServesDecl, links: Mapping[str, tree.LinkDecl], types: "_Types"
) -> Party | None:
    link = _link(scope, served.link, links)
    if link is None:
        return None
    for name in served.without:
        if name.text not in STANDARD:
            scope.unknown("standard property", name, list(STANDARD))
    return _party(served.peer, link, types, without=tuple(name.text for name in served.without))


def _subordinate(
    scope: Scope,
    given: tree.CommandsDecl,
    links: Mapping[str, tree.LinkDecl],
    types: "_Types",
    *,
    again: bool,
) -> Party | None:
    link = _link(scope, given.link, links)
    if link is None:
        return None
    late, unanswered = (None if reason is None else reason.text for reason in (given.late, given.unanswered))
    bounds = {"within": given.within, "late": late, "answered": given.answered, "unanswered": unanswered}
    party = _party(given.peer, link, types, again=again, **bounds)
    _bounds(scope, given, types)
    for reason in filter(None, (given.late, given.unanswered)):
        if party.reason is None:
            scope.report(Code.KIND, f"the report of link `{link.name.text}` has no `reason`", reason.span)
        elif reason.text == types.none(link):
            message = f"`{reason.text}` says that there is no reason: what is late has failed"
            scope.report(Code.KIND, message, reason.span, "name another member of the reason")
        else:
            _known_reason(scope, link, reason, types.members)
    return party


def _bounds(scope: Scope, given: tree.CommandsDecl, types: "_Types") -> None:
    """Report times in which nothing can be echoed or answered; other expressions are checked where they are used."""
    echo, answer = (
        None if bound is None else types.number(bound) for bound in (given.within, given.answered)
    )
    for bound in (given.within, given.answered):
        if bound is not None and types.unit(bound):
            helps = "write how many cycles: at a period of 40 [ms], 25 cycles are a second"
            scope.report(
                Code.UNIT, "`within` counts the level's cycles, which have no unit", bound.span, helps
            )
    for bound, cycles, what in ((given.within, echo, "an echo"), (given.answered, answer, "an answer")):
        if bound is not None and cycles == 0:
            scope.report(Code.KIND, f"{what} takes at least one cycle", bound.span)
    if given.answered is not None and echo and answer and answer <= echo:
        scope.report(
            Code.KIND,
            f"an order is to be answered within {answer} cycles, and echoed within {echo}",
            given.answered.span,
            "both are counted from the order, and the echo comes first: give the answer more time",
        )


def _known_reason(
    scope: Scope, link: tree.LinkDecl, late: tree.Name, members: Mapping[str, tuple[str, ...]]
) -> None:
    kind = next(part.type for part in link.report if part.word == "reason")
    known = members.get(kind.name.text, ()) if isinstance(kind, tree.NamedType) else ()
    if late.text not in known:
        scope.unknown("reason", late, list(known))


def _link(scope: Scope, name: tree.Name, links: Mapping[str, tree.LinkDecl]) -> tree.LinkDecl | None:
    if (
        name.text not in links and f"link {name.text}" not in scope.places
    ):  # else what is wrong with it is reported
        scope.unknown("link", name, list(links))
    return links.get(name.text)


def _party(peer: tree.Name, link: tree.LinkDecl, types: "_Types", **more: Any) -> Party:
    failed = types.members[link.status.text].index(link.failed.text)
    parts = (part for part in link.order if part.word != "stream")
    scalars = (scalar for part in parts for scalar in types.scalars(part.name.text, part.type))
    return Party(peer, link, failed, (COMMAND, *scalars), types.none(link), **more)


def _sound(scope: Scope, link: tree.LinkDecl, types: "_Types") -> bool:
    """Return whether a link names members of its types, the resting ones first: a buffer that nobody has written must mean rest."""
    before, members = len(scope.diagnostics), types.members
    for kind, named, first in (
        (link.command, (link.rest,), "the command that rests"),
        (link.status, (link.done, link.failed, link.executing), "the status of what is done"),
    ):
        if kind.text not in members:
            scope.unknown("enumeration", kind, list(members))
            continue
        known = members[kind.text]
        for member in named:
            if member.text not in known:
                scope.unknown(f"member of `{kind.text}`", member, list(known))
        if named[0].text in known[1:]:
            scope.report(
                Code.KIND,
                f"`{named[0].text}` is {first}, and not the first member of `{kind.text}`",
                named[0].span,
                "put it first: a buffer into which nobody has written shows the first member",
            )
    said: set[str] = set()
    for member in (link.done, link.failed, link.executing):
        if member.text in said:
            message = f"`{member.text}` cannot mean two things: done, failed and executing are three members"
            scope.report(Code.KIND, message, member.span)
        said.add(member.text)
    for message, span in _misplaced(link, members):
        scope.report(Code.KIND, message, span)
    return len(scope.diagnostics) == before


def _misplaced(link: tree.LinkDecl, enums: Mapping[str, tuple[str, ...]]) -> Iterator[tuple[str, Span]]:
    """Yield a message for each field that the protocol makes itself, and for each invalid reason."""
    own = {NUMBER, COMMAND}, {ECHO, ECHOED, STATUS, *_HELD}
    for parts, made in zip((link.order, link.report), own, strict=True):
        for part in parts:
            if part.name.text in made:
                yield f"the protocol makes `{part.name.text}` itself", part.name.span
            if part.word == "reason" and parts is link.order:
                yield "a reason is a field of the report", part.name.span
            elif part.word == "reason" and not (
                isinstance(part.type, tree.NamedType) and part.type.name.text in enums
            ):
                yield (
                    "a reason needs an enumeration, whose first member means that there is none",
                    part.name.span,
                )
            if part.restart is not None and parts is link.order:
                yield "what an order has after a restart is the protocol's", part.name.span
            if part.safe is not None and (part.word == "reason" or (parts is link.order and not part.word)):
                yield (
                    f"`{part.name.text}` keeps to its command's number, so that a fault leaves it as it is",
                    part.name.span,
                )
    for more in [part for part in link.report if part.word == "reason"][1:]:
        yield "a report has one reason", more.name.span


_HELD = ("command", "status", "resting", "late")

STANDARD = ("done_stays", "failed_stays", "done_without_reason", "rests_when_told")
"""Properties that come with the protocol."""
