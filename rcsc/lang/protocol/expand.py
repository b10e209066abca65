"""Puts what the protocol makes in the place of what declares it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from itertools import chain
from typing import Any, TypeVar

from rcsc.base.diagnostics.source import Source, Span
from rcsc.lang.protocol import written
from rcsc.lang.protocol.roles import Parties
from rcsc.lang.restart import COMMAND
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.parse import parse

T = TypeVar("T")


def expanded(parties: Parties, declarations: list[tree.Declaration]) -> list[tree.Declaration]:
    """Return the declarations with records, buffers, state and modules in the place of links and roles.

    What is made stands where it was declared: an error in it shows that place.
    """
    whole: list[tree.Declaration] = []
    for declaration in declarations:
        whole += _expanded(parties, declaration)
    if parties:
        whole += _parsed(_made(parties, whole), _place(parties))
    return whole


def _expanded(parties: Parties, declaration: tree.Declaration) -> Sequence[tree.Declaration]:
    match declaration:
        case tree.LinkDecl():
            return _parsed(written.records(declaration), declaration.span)
        case tree.ServesDecl(peer):
            above = parties.superior
            return _parsed(written.superior(above), declaration.span) if above and above.peer is peer else ()
        case tree.CommandsDecl(peer):
            party = next((party for party in parties.subordinates if party.peer is peer), None)
            return () if party is None else _parsed(written.subordinate(party), declaration.span)
        case tree.VariableDecl(deferred=True):
            until = condition(written.all_echoed(parties), declaration.span)
            return (replace(declaration, deferred=False, deferred_until=until),)
        case tree.LevelDecl() if parties:
            return (_wrapped(declaration),)
        case tree.TableDecl():
            return (replace(declaration, actions=tuple(_heading(parties, h) for h in declaration.actions)),)
        case _:
            return (declaration,)


def _place(parties: Parties) -> Span:
    return parties.superior.peer.span if parties.superior is not None else parties.subordinates[0].peer.span


def _made(parties: Parties, whole: Sequence[tree.Declaration]) -> Iterator[str]:
    """Yield the text of state, modules, procedures and properties that belong to no one neighbour."""
    own = {d.name.text for d in whole if isinstance(d, tree.ProcedureDecl)}
    called = set(_calls(whole)) - own
    if parties.subordinates:
        yield written.ECHOED
    yield from written.taken(parties)
    yield from written.given(parties)
    if parties.subordinates and "settle" not in own:
        yield from written.settle(parties)
    yield from _members(parties, called)
    claims = (tree.AssumeDecl, tree.InvariantDecl, tree.PropertyDecl, tree.RequirementDecl)
    yield from written.properties(parties, {d.name.text for d in whole if isinstance(d, claims)})


def _members(parties: Parties, called: set[str]) -> Iterator[str]:
    """Yield the procedures that are called and not declared: a status to report, or a command of one subordinate."""
    above = parties.superior
    for name in sorted(called):
        ordered = [
            party for party in parties.subordinates if name in parties.members[party.link.command.text]
        ]
        if above is not None and name in parties.members[above.link.status.text]:
            yield written.status_is(above, name)
        elif len(ordered) == 1:
            yield written.order_is(ordered[0], name)


def _calls(declarations: Iterable[tree.Declaration]) -> Iterator[str]:
    """Yield the names of procedures that are called without arguments, in any order."""
    for statement in chain.from_iterable(map(tree.statements, declarations)):
        if isinstance(statement, tree.Call) and not statement.args:
            yield statement.name.text


def _heading(parties: Parties, heading: tree.Heading) -> tree.Heading:
    """Replace a subordinate's name as a heading by the place of its commands, which its column holds."""
    match heading.subject:
        case tree.Reference(name) if (party := parties.named(name.text)) is not None:
            place = tree.FieldOf(
                tree.Reference(replace(name, text=party.told), heading.subject.span),
                replace(name, text=COMMAND),
                heading.subject.span,
            )
            return replace(heading, subject=place)
    return heading


def _wrapped(level: tree.LevelDecl) -> tree.LevelDecl:
    """Return the level with the protocol before and after its own modules."""
    first, last = (tree.Name(word, level.name.span) for word in (written.BEFORE, written.AFTER))
    return replace(level, preprocess=(first, *level.preprocess), postprocess=(*level.postprocess, last))


def condition(text: str, span: Span) -> tree.Expr:
    """Parse a condition; its nodes get the span given."""
    declared = _parsed([f"invariant made : {text}"], span)[0]
    assert isinstance(declared, tree.InvariantDecl)
    return declared.condition


def _parsed(lines: Iterable[str], span: Span) -> Sequence[tree.Declaration]:
    """Return the declarations of a text, all of which stand at the given place."""
    return _parsed_at("\n".join(lines), span)


@lru_cache(maxsize=256)  # an editor asks for the same after each key
def _parsed_at(text: str, span: Span) -> Sequence[tree.Declaration]:
    file = parse(Source("protocol", text))
    assert isinstance(file, tree.File), f"the protocol's own text is wrong: {text}"
    return tuple(_placed(declaration, span) for declaration in file.declarations)


def _placed(node: T, span: Span) -> T:
    """Return the same node at another place, with all its parts."""
    changed: dict[str, Any] = {}
    for part in fields(node):  # type: ignore[arg-type]  # a node of the tree
        value = getattr(node, part.name)
        if isinstance(value, Span):
            changed[part.name] = span
        elif isinstance(value, tuple):
            changed[part.name] = tuple(_placed(v, span) if is_dataclass(v) else v for v in value)
        elif is_dataclass(value):
            changed[part.name] = _placed(value, span)
    return replace(node, **changed)  # type: ignore[type-var]
