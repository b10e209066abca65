"""Roles as the proof and a restart need them: of leaves, when these are known."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from rcsc.base.diagnostics.codes import Code
from rcsc.lang.expressions.previous import adopted_before
from rcsc.lang.expressions.scope import Body, Scope
from rcsc.lang.expressions.typed import boolean, typed
from rcsc.lang.leaves import is_part
from rcsc.lang.model import (
    Assumption,
    AssumptionName,
    Bool,
    Enum,
    Int,
    Kind,
    Link,
    LinkPart,
    Procedure,
    Read,
    Role,
    Roles,
    Scalar,
    Single,
    Standing,
    Table,
    Variable,
    VariableName,
    pending,
    spell,
    unit_text,
)
from rcsc.lang.protocol import Flags, Parties, Party, Watched, condition, in_step
from rcsc.lang.resolve.declarations import value_given
from rcsc.lang.restart import (
    COMMAND,
    ECHOES,
    NUMBER,
    NUMBERED,
    SEEN,
    STATUS,
    Adopted,
    After,
    Fixed,
    SameAs,
    Stands,
    by_names,
)
from rcsc.lang.syntax import tree


def roles_of(scope: Scope, parties: Parties) -> Roles | None:
    """Return the neighbours that the levels serve and command; None where none is declared."""
    if not parties:
        return None
    above = parties.superior
    superior = None if above is None else _role(above, above.name, above.told, scope)
    return Roles(
        superior, tuple(_role(party, party.told, party.raw, scope) for party in parties.subordinates)
    )


def _link(link: tree.LinkDecl, order: str, report: str, scope: Scope) -> Link:
    """Return the link field by field, in words that two files have in common: types by their values, not their names."""
    command, status = (scope.leaves[leaf].type for leaf in (f"{order}.{COMMAND}", f"{report}.{STATUS}"))
    parts = [
        LinkPart("the commands", _kind(command), link.command.span),
        LinkPart("the command that rests", link.rest.text, link.rest.span),
        LinkPart("the statuses", _kind(status), link.status.span),
        LinkPart("done", link.done.text, link.done.span),
        LinkPart("failed", link.failed.text, link.failed.span),
        LinkPart("executing", link.executing.text, link.executing.span),
        *_fields("order", link.order, order, scope),
        *_fields("report", link.report, report, scope),
    ]
    return Link(link.name.text, link.name.span, tuple(parts))


def _fields(what: str, fields: Sequence[tree.LinkField], record: str, scope: Scope) -> Iterator[LinkPart]:
    names = ", ".join(part.name.text for part in fields)
    if fields:
        span = fields[0].name.span.to(fields[-1].name.span)
        yield LinkPart(f"the fields of the {what}", names, span)
    for part in fields:
        field = f"{record}.{part.name.text}"
        leaves = {
            name.removeprefix(field): leaf for name, leaf in scope.leaves.items() if is_part(name, field)
        }
        kinds = "; ".join(f"{name.lstrip('.')} {_kind(leaf.type)}".lstrip() for name, leaf in leaves.items())
        says = [*([part.word] if part.word else []), kinds]
        only = next(iter(leaves.values()), None)
        if part.restart is not None and only is not None:
            value = value_given(scope, part.restart, only.type, "restart")
            says.append("" if value is None else f"restart {spell(only.type, value)}")
        yield LinkPart(f"`{part.name.text}` of the {what}", " ".join(says), part.name.span)


def _kind(kind: Scalar) -> str:
    """Spell a type by its values."""
    match kind:
        case Bool():
            return "bool"
        case Enum(members=members):
            return f"{{{', '.join(members)}}}"
        case _:
            word = "int" if isinstance(kind, Int) else "single" if isinstance(kind, Single) else "real"
            ends = f"{word} {spell(kind, kind.low)} .. {spell(kind, kind.high)}"
            return f"{ends} [{unit_text(kind.unit)}]" if kind.unit else ends


def _role(party: Party, order: str, report: str, scope: Scope) -> Role:
    records = [f"{order}.{part}" for part in party.numbered]
    numbered = tuple(
        leaf for leaf in map(VariableName, scope.leaves) if any(is_part(leaf, r) for r in records)
    )
    late = VariableName(f"{party.name}.late") if party.bounded else None
    reason = VariableName(f"{report}.{party.reason}") if party.reason is not None else None
    link = party.link
    words = link.rest.text, link.done.text, link.failed.text
    in_time = party.answered is not None
    said = _link(link, order, report, scope)
    return Role(party.name, order, report, numbered, *words, reason, late, answers_in_time=in_time, link=said)


def restart_of(
    scope: Scope, parties: Parties, declarations: Sequence[tree.Declaration]
) -> tuple[tuple[VariableName, Adopted], ...] | None:
    """Return what leaves adopt; None where neither protocol nor `restart` nor `adopt` declares it, so that names decide.

    Without roles, the other leaves go by their names all the same: a level that numbers its orders by hand does so after a
    restart, too.
    """
    declared: dict[str, Adopted] = {
        name: Fixed(leaf.restart) for name, leaf in scope.leaves.items() if leaf.restart is not None
    }
    for written in declarations:
        if isinstance(written, tree.AdoptDecl):
            declared |= _declared(scope, written)
    parts = {name: leaf.part for name, leaf in scope.leaves.items()}
    adopted = (dict(_protocol(scope, parties)) if parties else by_names(parts)) | declared
    before = adopted_before(scope, adopted)
    if not parties and not declared and not before:
        return None
    return tuple((VariableName(leaf), value) for leaf, value in (adopted | before).items())


def _declared(scope: Scope, written: tree.AdoptDecl) -> dict[str, Adopted]:
    """Return what `adopt` declares for one leaf; empty after an error."""
    place = _leaf(scope, written.place)
    if place is None:
        return {}
    if place.kind is Kind.INPUT:
        scope.report(Code.KIND, f"`{place.name}` is an input, and adopts nothing", written.place.span)
        return {}
    if not written.after:
        value = value_given(scope, written.value, place.type, "restart")
        return {} if value is None else {str(place.name): Fixed(value)}
    echo = _leaf(scope, written.value)
    if echo is None:
        return {}
    if not isinstance(place.type, Int) or echo.type != place.type or echo.kind is not Kind.INPUT:
        scope.report(Code.KIND, "a number is counted on from an input of its own type", written.value.span)
        return {}
    if (place.type.low, place.type.high) != NUMBERED:
        message = f"`{place.name}` is no `int {NUMBERED[0]} .. {NUMBERED[1]}`: the number after the last of these is the first"
        scope.report(Code.KIND, message, written.place.span)
        return {}
    return {str(place.name): After(str(echo.name))}


def _leaf(scope: Scope, place: tree.Expr) -> Variable | None:
    """Return the leaf that a place names; None (reported) where it names none."""
    written = typed(scope, Body(), place)
    if written is None:
        return None
    if not isinstance(written.expr, Read):
        scope.report(
            Code.KIND, "a level adopts a scalar: a variable, or one field or element of it", place.span
        )
        return None
    return scope.leaves[written.expr.name]


def _protocol(scope: Scope, parties: Parties) -> Iterator[tuple[str, Adopted]]:
    """Yield what a level adopts by protocol: the order in its buffer counts as seen, and has failed; each level below is to rest."""
    above = parties.superior
    if above is not None:
        yield SEEN, SameAs(f"{above.name}.{NUMBER}")
        yield f"{above.told}.{STATUS}", Fixed(above.failed)
        yield from ((f"{above.told}.{echo}", Stands()) for echo in ECHOES)
        for part in above.link.report:
            leaf = scope.leaves.get(f"{above.told}.{part.name.text}")
            value = None if leaf is None else value_given(scope, part.restart, leaf.type, "restart")
            if value is not None:
                yield f"{above.told}.{part.name.text}", Fixed(value)
    for party in parties.subordinates:
        yield f"{party.told}.input_command", Fixed(0)
        yield f"{party.told}.inc_command", After(f"{party.raw}.inc_command_echo")


# --- what each table may rest on ---


def offered(
    scope: Scope,
    parties: Parties,
    deferred: Sequence[str],
    tables: Sequence[Table],
    procedures: Sequence[Procedure],
) -> tuple[tuple[Assumption, ...], tuple[Table, ...]]:
    """Return the assumptions of the protocol that tables can rest on, and the tables with them.

    They are monitored, and `prove` proves them: a state goes with the order that it waits for, and what rests says so.
    """
    if not parties:
        return (), tuple(tables)
    bodies = {str(procedure.name): procedure for procedure in procedures}
    watched = tuple(_watched(scope, parties, deferred))
    flags = (
        Flags("new_command", "answered", "settling") if parties.superior is not None else Flags("", "", "")
    )
    assumptions: list[Assumption] = []
    resting: list[Table] = []
    for table in tables:
        texts = {"in_step": in_step(table, watched, flags, bodies), "resting": _resting(parties, table)}
        own = []
        for word, text in texts.items():
            name = f"{table.name}_{word}"
            if text is None or f"assumption {name}" in scope.places:
                continue
            whole = boolean(scope, Body(), condition(text, table.span))
            if whole is not None:
                own.append(
                    Assumption(AssumptionName(name), Standing.MONITORED, whole, _SAID[word], table.span)
                )
        assumptions += own
        resting.append(replace(table, assumptions=(*table.assumptions, *(one.name for one in own))))
    return tuple(assumptions), tuple(resting)


_SAID = {
    "in_step": "Found from what the lines order, and proved: a state goes with the orders that it waits for (section 9).",
    "resting": "What rests says so.",
}


def _watched(scope: Scope, parties: Parties, deferred: Sequence[str]) -> Iterator[Watched]:
    for name in deferred:
        leaf = scope.leaves.get(name)
        if leaf is not None and isinstance(leaf.type, Enum):
            begins = {int(leaf.initial), int(leaf.initial if leaf.restart is None else leaf.restart)}
            yield Watched(name, str(pending(name)), leaf.type, frozenset(begins))
    for party in parties.subordinates:
        leaf = scope.leaves.get(f"{party.name}.command")
        if leaf is not None and isinstance(leaf.type, Enum):
            order = f"{party.told}.input_command"
            yield Watched(str(leaf.name), order, leaf.type, frozenset({0}), f"{party.name}.resting")


def _resting(parties: Parties, table: Table) -> str | None:
    """Return the condition on the other leaves of each subordinate whose `resting` the table reads, as text; None for none."""
    read = set(map(str, table.variables))
    parts = []
    for party in parties.subordinates:
        said = {f"{party.name}.command": party.link.rest.text, f"{party.name}.status": party.link.done.text}
        if f"{party.name}.resting" in read and (
            named := [f"{leaf} = {word}" for leaf, word in said.items() if leaf in read]
        ):
            parts.append(f"({party.name}.resting implies {' and '.join(named)})")
    return " and ".join(parts) or None
