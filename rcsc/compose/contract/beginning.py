"""Initial values to search runs from, as a user writes them: `tbuffer_boxt = 0, task.cur_state = state_3`.

In: transition systems and a text. Out: for each level the leaves that begin otherwise than declared. They only say where runs are searched
from: what is proved is proved of every run from the declared initial values, and no verdict depends on them.
"""

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import TypeAlias

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.lang.interpret import initial, unfit
from rcsc.lang.model import Bool, Enum, Int, Real, Scalar, Value, pending, spell, value_of_text

Starts: TypeAlias = Mapping[str, Mapping[str, Value]]
"""For each level the values with which leaves begin."""


class BadStartError(CodedError):
    """The text names a leaf that no level has, or values with which no run can begin."""

    code = Code.BAD_START

    def __init__(self, message: str, *helps: str) -> None:
        super().__init__(message)
        self.helps = helps


def starts(systems: Mapping[str, TransitionSystem], text: str) -> dict[str, dict[str, Value]]:
    """Read `leaf = value, level.leaf = value, ...`; a deferred leaf gets the same pending value, unless that is named, too.

    Raises:
        BadStartError: The text is malformed, or names no leaf, no value of the leaf, or values that an invariant excludes.
    """
    by_level: dict[str, dict[str, Value]] = {}
    for part in filter(None, map(str.strip, text.split(","))):
        name, equals, value = (word.strip() for word in part.partition("="))
        if not (name and equals and value):
            raise BadStartError(
                f"`{part}` does not say which value a variable has", "write `variable = value`"
            )
        level, leaf = _leaf(systems, name)
        by_level.setdefault(level, {})
        if leaf in by_level[level]:
            raise BadStartError(f"`{name}` is given twice")
        by_level[level][leaf] = _value(leaf, systems[level].kinds[leaf], value)
    return {level: _whole(systems[level], given) for level, given in by_level.items()}


def _leaf(systems: Mapping[str, TransitionSystem], name: str) -> tuple[str, str]:
    """Return the level and the leaf that a name means; the level's name may stand before the leaf's."""
    everywhere = {(level, leaf) for level, ts in systems.items() for leaf in initial(ts.program)}
    meant = sorted({(level, leaf) for level, leaf in everywhere if name in {leaf, f"{level}.{leaf}"}})
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise BadStartError(
            f"`{name}` is a variable of several levels",
            f"write {' or '.join(f'`{level}.{leaf}`' for level, leaf in meant)}",
        )
    known = sorted({word for level, leaf in everywhere for word in (leaf, f"{level}.{leaf}")})
    near = [word for word in known if word.startswith((f"{name}.", f"{name}["))][:3]
    raise BadStartError(f"no level has a variable `{name}`", *_suggested(name, known, near))


def _suggested(name: str, known: list[str], parts: list[str]) -> Iterator[str]:
    if parts:
        yield f"it is a record or an array; name a part: {', '.join(f'`{part}`' for part in parts)}"
    else:
        yield from (f"did you mean `{word}`?" for word in get_close_matches(name, known, n=1, cutoff=0.6))


def _value(leaf: str, kind: Scalar, text: str) -> Value:
    value = value_of_text(kind, text)
    if value is None:
        raise BadStartError(f"`{leaf}` cannot be `{text}`", *_values(kind, text))
    return value


def _values(kind: Scalar, text: str) -> Iterator[str]:
    """Yield hints that tell the values of a leaf, a similar member first."""
    match kind:
        case Enum(members=members):
            yield from (f"did you mean `{word}`?" for word in get_close_matches(text, members, n=1))
            yield f"it is one of {', '.join(members)}"
        case Bool():
            yield "it is true or false"
        case Int() | Real():
            yield f"it is a number from {spell(kind, kind.low)} to {spell(kind, kind.high)}"


def _whole(ts: TransitionSystem, given: Mapping[str, Value]) -> dict[str, Value]:
    """Add the pending values of deferred leaves.

    Raises:
        BadStartError: An invariant excludes the values.
    """
    deferred = {
        str(pending(v.name)): given[str(v.name)]
        for v in ts.program.variables
        if v.deferred_until is not None and str(v.name) in given
    }
    whole = {**deferred, **given}
    declared, broken = initial(ts.program), unfit(ts.program, {**initial(ts.program), **whole})
    if broken and not unfit(ts.program, declared):
        raise BadStartError(
            f"no run of level `{ts.level.name}` begins so: invariant `{broken}` does not hold"
        )
    return whole
