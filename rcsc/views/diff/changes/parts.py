"""Two versions of what is no table: procedures, what a level runs around its table, conditions with a name, periods.

In: versions. Out: `ComparedPart`s.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from enum import StrEnum
from functools import partial
from itertools import product
from typing import Any

from rcsc.lang.hidden import hidden, keeps
from rcsc.lang.interpret import call
from rcsc.lang.leaves import read_by
from rcsc.lang.meaning import digest
from rcsc.lang.model import (
    BEFORE,
    Assumption,
    Call,
    Enum,
    Expr,
    Int,
    Invariant,
    Level,
    OneTable,
    Procedure,
    ProcedureName,
    Program,
    Property,
    Real,
    Scalar,
    Statement,
    Value,
)
from rcsc.proof.relation.effect import Effect, Meaning
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import FALSE, TRUE, Node
from rcsc.views.diff.changes.contrast import changes, contrast
from rcsc.views.diff.changes.difference import Basis, Change, ComparedPart, PartSort
from rcsc.views.diff.changes.value_text import number
from rcsc.views.diff.changes.versions import Doing, Runner, Versions, runner


def procedures(versions: Versions) -> Iterator[ComparedPart]:
    """Yield every procedure that both versions have, called with the same arguments.

    Raises:
        UndecidedError, TooLongError, RecursionError: As `tables.table_part`.
    """
    later = versions.digests[1].procedures
    made = keeps(versions.before)  # it keeps what something looks back at, which is compared where it does
    for name, procedure in versions.digests[0].procedures.items():
        if name in later and not made(name):
            yield _procedure(versions, procedure, later[name])


def _procedure(versions: Versions, old: Procedure, new: Procedure) -> ComparedPart:
    name, (first, second) = str(old.name), versions.digests
    if first.procedure(name) == second.procedure(name):
        return ComparedPart("procedure", name, basis=Basis.DIGEST)
    calls: list[Statement] = [Call(ProcedureName(name))]
    if apart := _apart(versions, first.touched(calls, ()) | second.touched(calls, ())):
        return ComparedPart("procedure", name, apart)
    if [(p.name, _kind(p.type)) for p in old.params] != [(p.name, _kind(p.type)) for p in new.params]:
        return ComparedPart("procedure", name, ("its parameters changed",))
    args = [
        values.variable(
            p.name if p.name not in versions.kinds else f"argument {p.name}", _narrower(p.type, q.type)
        )
        for p, q in zip(old.params, new.params, strict=True)
    ]
    runner = partial(_call, name, [node.name for node in args])
    effects = [meaning.procedure(name, args) for meaning in versions.meanings()]
    return _effects(versions, "procedure", name, (effects[0], effects[1]), (runner, runner))


def _apart(versions: Versions, leaves: set[str]) -> tuple[str, ...]:
    """Return a note where what speaks of these leaves cannot be compared."""
    return tuple(
        f"cannot be compared: `{leaf}` changed its kind"
        for leaf in sorted(versions.aligned.apart & leaves)[:1]
    )


def _kind(kind: Scalar) -> object:
    """Return the type without its bounds."""
    return (type(kind), kind.unit) if isinstance(kind, Int | Real) else kind


def _narrower(first: Scalar, second: Scalar) -> Scalar:
    """Return the values of both types, one kind."""
    match first, second:
        case Int(), Int():
            return Int(max(first.low, second.low), min(first.high, second.high), first.unit)
        case Real(), Real():
            return replace(first, low=max(first.low, second.low), high=min(first.high, second.high))
        case _:
            return first


def _call(name: str, args: list[str], program: Program, now: dict[str, Value]) -> None:
    call(program, name, [now.pop(arg) if arg.startswith("argument ") else now[arg] for arg in args], now)


def _effects(
    versions: Versions, what: str, name: str, pair: tuple[Effect, Effect], runners: tuple[Runner, Runner]
) -> ComparedPart:
    """Return where two effects differ, all inputs free."""
    before = versions.tally.queries
    old, new = (Doing(effect, run, {}) for effect, run in zip(pair, runners, strict=True))
    contrasted = contrast(versions, TRUE, (old, new))
    changed = (
        changes(versions, PartSort.EFFECT, (name, name), TRUE, TRUE, contrasted) if contrasted.differ else []
    )
    return ComparedPart(what, name, (), tuple(changed), (), Basis.SOLVER, versions.tally.queries - before)


# --- levels ----------------------------------------------------------------------------------


def levels(versions: Versions) -> Iterator[ComparedPart]:
    """Yield every level that both versions have: period, which table runs when, and what runs before and after it.

    Raises:
        UndecidedError, TooLongError, RecursionError: As `tables.table_part`.
    """
    later = {level.name: level for level in versions.after.levels}
    for old in versions.before.levels:
        new = later.get(old.name)
        if new is None:
            yield ComparedPart("level", old.name, ("gone",))
            continue
        yield ComparedPart("level", old.name, tuple(_level(old, new)), basis=Basis.DIGEST)
        yield _sequence(versions, "preprocess", old.name, (old.preprocess, new.preprocess))
        yield _sequence(versions, "postprocess", old.name, (old.postprocess, new.postprocess))
    known = {level.name for level in versions.before.levels}
    yield from (ComparedPart("level", name, ("new",)) for name in later if name not in known)


def _level(old: Level, new: Level) -> Iterator[str]:
    """Return the changes of the level itself."""
    if old.period_ms != new.period_ms:
        yield f"period: {old.period_ms} ms, now {new.period_ms} ms"
    first, second = _chosen(old), _chosen(new)
    for at in dict.fromkeys((*first, *second)):
        if first.get(at) != second.get(at):
            yield f"table for {at or 'every cycle'}: {first.get(at, 'none')}, now {second.get(at, 'none')}"
    if _selector(old) != _selector(new):
        yield "which command chooses the table"
    if old.stages != new.stages:
        yield f"tables that run before it: {_stages(old)}, now {_stages(new)}"


def _stages(level: Level) -> str:
    """Return the work before the last table, in order."""
    return ", ".join(" or ".join(f"`{name}`" for name in stage.names) for stage in level.stages) or "none"


def _chosen(level: Level) -> Mapping[str, str]:
    if isinstance(level.tables, OneTable):
        return {"": f"`{level.tables.table}`"}
    kind = level.tables.selector.type
    return {number(kind, value): f"`{table}`" for value, table in level.tables.tables}


def _selector(level: Level) -> Expr | None:
    return None if isinstance(level.tables, OneTable) else level.tables.selector


def _sequence(
    versions: Versions, what: str, level: str, names: tuple[tuple[str, ...], tuple[str, ...]]
) -> ComparedPart:
    """Return the work before a level's table, or after it, as one run."""
    made = keeps(versions.before), keeps(versions.after)
    bodies: list[list[Statement]] = [
        [Call(ProcedureName(name)) for name in part if not own(name)]
        for part, own in zip(names, made, strict=True)
    ]
    first, second = versions.digests
    if first.body(bodies[0]) == second.body(bodies[1]):
        return ComparedPart(what, level, basis=Basis.DIGEST)
    if apart := _apart(versions, first.touched(bodies[0], ()) | second.touched(bodies[1], ())):
        return ComparedPart(what, level, apart)
    before, after = (m.effect(body) for m, body in zip(versions.meanings(), bodies, strict=True))
    return _effects(versions, what, level, (before, after), (runner(bodies[0]), runner(bodies[1])))


# --- what no comparison has looked at -----------------------------------------------------------

_COMPARED: Mapping[str, tuple[str, Mapping[str, object]]] = {
    "enums": ("enumeration", {}),
    "records": ("record", {}),
    "declared": ("variable", {}),
    "variables": ("variable", {"deferred_until": None}),
    "procedures": ("procedure", {"body": (), "reads": (), "writes": ()}),
    "assumptions": ("assumption", {"condition": None, "standing": None}),
    "invariants": ("invariant", {"condition": None}),
    "properties": ("property", {"condition": None, "monitor": None, "monitored": None}),
    "tables": (
        "table",
        {"columns": (), "lines": (), "default": None, "variables": (), "assumptions": (), "meetings": ()},
    ),  # what meetings come to is in the lines
    "owners": ("owner", {}),
    "levels": ("level", {"preprocess": (), "postprocess": ()}),
}
"""What the members of a program's field are called, and which of their fields a comparison of their own looks at."""
_UNSEEN = {"name", "file", "own_tables", "instance"}
"""Fields of a program that mean nothing to it: where it stands, and which file declares what."""
_UNNAMED = {"roles", "restart"}
"""Fields whose parts have no name of their own; they are compared by themselves."""
_WORDS = {"doc": "", "text": "", "box": None}
"""Fields that say again, for people or for the prover, what others say."""


def unreported(versions: Versions, reported: Iterable[str]) -> Iterator[ComparedPart]:
    """Yield every difference that a walk over all fields shows and that is neither reported yet nor compared.

    Procedures that only one version has are left out: what they do shows where they are called.

    Args:
        versions: The two programs.
        reported: What declarations and parts have reported: `table t`.
    """
    known = set(reported)
    before, after = versions.before, versions.after
    added = hidden(before), hidden(after)  # what they hold shows where it is looked at
    roots = [
        {declared.name for declared in p.declared if set(declared.leaves) <= own}
        for p, own in zip((before, after), added, strict=True)
    ]
    for field in fields(Program):
        if field.name in _UNSEEN or field.name in _UNNAMED:
            continue
        what, compared = _COMPARED.get(field.name, (field.name, {}))
        old, new = (
            {str(m.name): m for m in getattr(p, field.name) if m.name not in own and m.name not in root}
            for p, own, root in zip((before, after), added, roots, strict=True)
        )
        for name in dict.fromkeys((*old, *new)):
            key = f"{what} `{name.removesuffix('.next')}"
            if any(told.startswith((f"{key}`", f"{key}.", f"{key}[")) for told in known):
                continue  # itself, or a part of it
            if name not in old or name not in new:
                if what != "procedure":
                    yield ComparedPart(what, name, ("new" if name not in old else "gone",))
            elif _rest_of(old[name], compared) != _rest_of(new[name], compared):
                yield ComparedPart(what, name, ("declared otherwise",))
        if [name for name in old if name in new] != [name for name in new if name in old]:
            yield ComparedPart("order", field.name, ("declared in another order",))
    if before.roles != after.roles:
        yield ComparedPart("roles", before.name, ("declared otherwise",))
    yield from _restarts(before, after)


def _restarts(before: Program, after: Program) -> Iterator[ComparedPart]:
    """Yield every variable of both versions that a restart finds otherwise."""
    old, new = dict(before.restart or ()), dict(after.restart or ())
    shared = {variable.name for variable in before.variables} & {
        variable.name for variable in after.variables
    }
    for name in dict.fromkeys((*old, *new)):
        if name in shared and old.get(name) != new.get(name):
            yield ComparedPart("restart", name, ("declared otherwise",))


def _rest_of(member: Any, compared: Mapping[str, object]) -> str:
    """Return a digest of a member without what is compared; an enumeration stands for itself."""
    left_out = {*compared, *_WORDS}
    kept = (getattr(member, f.name) for f in fields(member) if f.compare and f.name not in left_out)
    return digest(tuple(_bare(value, whole=isinstance(member, Enum)) for value in kept))


def _bare(value: Any, *, whole: bool = False) -> Any:
    """Return the value without words; a type by its name, since its members are compared by themselves."""
    if isinstance(value, tuple):
        return tuple(_bare(part) for part in value)
    if isinstance(value, Enum) and not whole:
        return ("enum", value.name)
    if isinstance(value, StrEnum) or not is_dataclass(value):
        return value
    parts = ((f.name, _WORDS.get(f.name, getattr(value, f.name))) for f in fields(value) if f.compare)
    return (type(value).__name__, *((name, _bare(part)) for name, part in parts))


# --- conditions --------------------------------------------------------------------------------


def conditions(versions: Versions) -> Iterator[ComparedPart]:
    """Assumptions, invariants, properties, and when deferred values are taken.

    Raises:
        UndecidedError: As `tables.table_part`.
    """
    before, after = versions.before, versions.after
    for what, old, new in (
        ("assumption", _named(before.assumptions), _named(after.assumptions)),
        ("invariant", _named(before.invariants), _named(after.invariants)),
        ("deferred value", _deferred(before), _deferred(after)),
    ):
        for name in dict.fromkeys((*old, *new)):
            if name not in new or name not in old:
                if what != "deferred value":  # the declaration says so
                    yield ComparedPart(what, name, ("gone" if name not in new else "new",))
            else:
                yield _condition(versions, what, name, (old[name], new[name]))
    yield from _properties(versions)
    standing = {str(known.name): known.standing for known in before.assumptions}
    for assumption in after.assumptions:
        was = standing.get(str(assumption.name), assumption.standing)
        if was is not assumption.standing:
            note = f"{was.value}, now {assumption.standing.value}"
            yield ComparedPart("standing of assumption", str(assumption.name), (note,))


def _properties(versions: Versions) -> Iterator[ComparedPart]:
    """Yield each property, requirement and assumption over time, with its text where it is new, gone or changed."""
    old, new = ({p.name: p for p in version.stated} for version in (versions.before, versions.after))
    for name in dict.fromkeys((*old, *new)):
        if name not in new or name not in old:
            only = old[name] if name in old else new[name]
            yield ComparedPart(only.word, name, (f"{'gone' if name in old else 'new'}: {_words(only)}",))
            continue
        pair = old[name], new[name]
        if any(one.monitor is not None or one.monitored for one in pair):
            yield _over_time(*pair)
            continue
        part = _condition(versions, "property", name, (old[name].condition, new[name].condition))
        notes = (f"{_words(old[name])} -> {_words(new[name])}",) if part.changes else part.notes
        yield replace(part, notes=notes)


def _over_time(old: Property, new: Property) -> ComparedPart:
    """Compare two requirements or assumptions over time by what their monitors do."""
    apart = []
    if (old.condition, old.monitor) != (new.condition, new.monitor):
        apart.append(f"{_words(old)} -> {_words(new)}")
    if old.word != new.word:
        apart.append(f"{old.word}, now {new.word}")
    if old.monitored is not new.monitored:
        apart.append("monitored, now not" if old.monitored else "now monitored")
    return ComparedPart(new.word, new.name, tuple(apart), basis=Basis.DIGEST)


def _words(stated: Property) -> str:
    """Return a property's text, in one line."""
    return " ".join(stated.text.split())


def _named(conditions: Iterable[Assumption | Invariant]) -> dict[str, Expr]:
    return {str(condition.name): condition.condition for condition in conditions}


def _deferred(program: Program) -> dict[str, Expr]:
    return {str(v.name): v.deferred_until for v in program.variables if v.deferred_until is not None}


def _condition(versions: Versions, what: str, name: str, pair: tuple[Expr, Expr]) -> ComparedPart:
    """Return where a condition was true and is not now, and the other way."""
    if repr(pair[0]) == repr(pair[1]):
        return ComparedPart(what, name, basis=Basis.DIGEST)
    read = {leaf.removeprefix(BEFORE) for condition in pair for leaf in read_by(condition)}
    if apart := _apart(versions, read):
        return ComparedPart(what, name, apart)
    before = versions.tally.queries
    old, new = (
        _worth(meaning, condition, undefined="false" if what == "property" else "undefined")
        for meaning, condition in zip(versions.meanings(), pair, strict=True)
    )
    changed: list[Change] = []
    for first, second in product(old, new):
        if first != second:
            region = versions.shared.canonical(values.both(old[first], new[second]))
            changed += changes(versions, PartSort.CONDITION, (first, second), region)
    return ComparedPart(what, name, (), tuple(changed), (), Basis.SOLVER, versions.tally.queries - before)


def _worth(meaning: Meaning, condition: Expr, undefined: str) -> dict[str, Node]:
    """Return where the condition is true, false and, called as given, undefined."""
    holds = meaning.condition(condition)
    good = values.all_of(values.negation(bad) for bad in meaning.bad)
    regions = {"true": values.both(good, holds), "false": values.both(good, values.negation(holds))}
    return regions | {undefined: values.either(regions.get(undefined, FALSE), values.negation(good))}
