"""What of the statements matters: the names that some check depends on, and where their values are needed.

In: the steps of all machines of a model, each of which may follow each. Out: the steps without what no check depends on, and the names
whose values are needed between steps; every other is cleared at the end of its step, so that states differ only where it matters.
Strong liveness (a name is needed if something needed, a condition of something needed, or a check is computed from it), by
iteration to the least fixed point.
"""

from collections.abc import Iterable, Iterator, Sequence

from rcsc.compose.promela.cycle.statements import YES, Block, Check, Flat, Forget, Fork, Match, Put, Tell
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Expr

Names = frozenset[str]
NOTHING: Names = frozenset()


def needed(steps: Sequence[Block], also: Iterable[Expr] = ()) -> tuple[tuple[Block, ...], Names]:
    """The steps without what does not matter, and what is needed between them; `also` is looked at there."""
    between: Names = NOTHING.union(*(_read(one) for one in also))
    while True:
        befores = [_block(step, between)[1] for step in steps]
        wider = between.union(*befores)
        if wider == between:
            return tuple(_block(step, between)[0] for step in steps), between
        between = wider


def mentioned(block: Iterable[Flat]) -> Iterator[str]:
    """Every name that statements read or write, with repetition."""
    for one in block:
        match one:
            case Put(name=name, value=value):
                yield name
                yield from _read(value)
            case Forget(names=names):
                yield from names
            case Check(holds=holds):
                yield from _read(holds)
            case Tell(table=table, line=line):
                yield from (table, line)
            case Match(conditions=conditions, line=line, many=many):
                yield from (line, many)
                for when in conditions:
                    yield from _read(when)
            case Fork(arms=arms, otherwise=otherwise):
                for when, body in arms:
                    yield from _read(when)
                    yield from mentioned(body)
                yield from mentioned(otherwise)


def _read(expr: Expr) -> Names:
    return frozenset(map(str, read_by(expr)))


def _block(block: Block, after: Names) -> tuple[Block, Names]:
    kept: list[Flat] = []
    for one in reversed(block):
        left, after = _one(one, after)
        kept += left
    return tuple(reversed(kept)), after


def _one(one: Flat, after: Names) -> tuple[Block, Names]:
    match one:
        case Put(name=name, value=value):
            return ((one,), (after - {name}) | _read(value)) if name in after else ((), after)
        case Forget(names=names):
            left = tuple(name for name in names if name in after)
            return ((Forget(left),), after - frozenset(left)) if left else ((), after)
        case Check(holds=holds):
            return ((one,), after | _read(holds)) if holds != YES else ((), after)
        case Match(conditions=conditions, line=line, many=many):
            if not {line, many} & after:
                return (), after
            return (one,), (after - {line, many}).union(*map(_read, conditions))
        case Tell(table=table, line=line):
            return (one,), after | {table, line}
        case Fork():
            return _fork(one, after)


def _fork(fork: Fork, after: Names) -> tuple[Block, Names]:
    arms = [(when, *_block(body, after)) for when, body in fork.arms]
    otherwise, before = _block(fork.otherwise, after)
    if not otherwise and not any(body for _, body, _ in arms):
        return (), after
    while arms and arms[-1][1] == otherwise:
        arms.pop()
    if not arms:
        return otherwise, before
    before = before.union(*(one for _, _, one in arms), *(_read(when) for when, _, _ in arms))
    return (Fork(tuple((when, body) for when, body, _ in arms), otherwise),), before
