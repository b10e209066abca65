"""Statements once more, of copies: what a level would see if it looked at the same inputs again, which leaves everything as it is.

In: flat statements. Out: the same over copies of the names that they write, made first. What is computed of reals keeps its value in a
cycle (`statements`), so that it is the same when it is looked at again.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from rcsc.compose.promela.cycle.statements import (
    Block,
    Check,
    Flat,
    Flattener,
    Forget,
    Fork,
    Match,
    Put,
    Tell,
    read,
)
from rcsc.lang.model import Among, Apply, Expr, Read, VariableName

COPIED = "again "
"""What the name of a copy begins with, after the level's."""


def again(flat: Flattener, block: Block) -> tuple[Block, Mapping[str, str]]:
    """The statements of copies, and the copy of each name that they write."""
    copies = {}
    prefix = flat.name("")
    for name in sorted(written(block)):
        kind, lazy = flat.kinds[name], name in flat.lazy
        copies[name] = str(flat.new(f"{COPIED}{name.removeprefix(prefix)}", kind, lazy=lazy).name)
    first = tuple(Put(copy, read(name, flat.kinds[name])) for name, copy in copies.items())
    return (*first, *_block(block, copies)), copies


def written(block: Iterable[Flat]) -> frozenset[str]:
    """Names that statements write or forget."""
    return frozenset(_written(block))


def _written(block: Iterable[Flat]) -> Iterator[str]:
    for one in block:
        match one:
            case Put(name=name):
                yield name
            case Forget(names=names):
                yield from names
            case Match(line=line, many=many):
                yield from (line, many)
            case Fork(arms=arms, otherwise=otherwise):
                for _, body in arms:
                    yield from _written(body)
                yield from _written(otherwise)
            case Check() | Tell():
                pass


def _block(block: Block, copies: Mapping[str, str]) -> Block:
    return tuple(_one(one, copies) for one in block)


def _one(one: Flat, copies: Mapping[str, str]) -> Flat:
    match one:
        case Put(name=name, value=value):
            return Put(copies[name], _of(value, copies))
        case Forget(names=names):
            return Forget(tuple(copies[name] for name in names))
        case Match(conditions=conditions, line=line, many=many):
            return Match(tuple(_of(when, copies) for when in conditions), copies[line], copies[many])
        case Fork(arms=arms, otherwise=otherwise):
            ways = tuple((_of(when, copies), _block(body, copies)) for when, body in arms)
            return Fork(ways, _block(otherwise, copies))
        case Check(holds=holds):
            return replace(one, holds=_of(holds, copies))
        case Tell():
            return one


def _of(expr: Expr, copies: Mapping[str, str]) -> Expr:
    match expr:
        case Read(name=name):
            return replace(expr, name=VariableName(copies.get(name, name)))
        case Apply(args=args):
            return replace(expr, args=tuple(_of(arg, copies) for arg in args))
        case Among(subject=subject):
            return replace(expr, subject=_of(subject, copies))
        case _:
            return expr
