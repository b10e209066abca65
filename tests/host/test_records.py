"""Records against the standard library's dataclasses: the same declared both ways, and everything done to both."""

import copy
import dataclasses
import operator
import pickle
from collections.abc import Callable
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc import records
from rcsc.lang.model import Int, Literal

KINDS = st.fixed_dictionaries(
    {"hash": st.sampled_from([None, True, False])},
    optional={
        "default": st.integers(0, 2),
        "default_factory": st.just(list),
        "init": st.booleans(),
        "repr": st.booleans(),
        "compare": st.booleans(),
        "kw_only": st.booleans(),
    },
).filter(lambda kind: not {"default", "default_factory"} <= kind.keys())
VALUES = st.sampled_from([0, 0, 1, float("nan")])


def outcome(act: Callable[..., Any], *args: Any, **named: Any) -> Any:
    """What it gives, or the error that it raises, with its words."""
    try:
        return act(*args, **named)
    except (TypeError, AttributeError) as error:
        return type(error), str(error)


def declared(make: Any, kinds: dict[str, dict[str, Any]], frozen: bool, counts: bool) -> Any:
    """A class with these fields, and one derived from it that has one field more."""
    body = {name: dataclasses.field(**kind) for name, kind in kinds.items()}
    body["__annotations__"] = dict.fromkeys(kinds, object)
    own = {"__post_init__": lambda self: self.seen.append(self)} if counts else {}
    base = make(slots=True, frozen=frozen)(type("Drawn", (), {**body, **own, "seen": []}))
    return make(slots=True, frozen=frozen, kw_only=True)(
        type("Derived", (base,), {"__annotations__": {"last": int}, "last": 7})
    )


@settings(max_examples=200)
@given(st.data(), st.lists(KINDS, max_size=4), st.booleans(), st.booleans())
def test_a_record_does_what_a_dataclass_does(
    data: st.DataObject, kinds: list[dict[str, Any]], frozen: bool, counts: bool
) -> None:
    names = "abcd"[: len(kinds)]
    theirs, ours = (
        outcome(declared, make, dict(zip(names, kinds, strict=True)), frozen, counts)
        for make in (dataclasses.dataclass, records.dataclass)
    )
    if isinstance(theirs, tuple):
        return  # type checkers find what cannot be declared
    assert ours.__match_args__ == theirs.__match_args__
    pairs = []
    for _ in range(2):
        by_place = [
            name
            for name, kind in zip(names, kinds, strict=True)
            if kind.get("init", True) and not kind.get("kw_only")
        ]
        by_name = [
            name
            for name, kind in zip(names, kinds, strict=True)
            if kind.get("init", True) and kind.get("kw_only")
        ]
        args = [data.draw(VALUES) for _ in by_place]
        named = {name: data.draw(VALUES) for name in by_name}
        left_out = data.draw(st.sampled_from(["", "", "", *names]))
        named = {name: value for name, value in named.items() if name != left_out}
        args = args[:-1] if left_out in by_place else args
        named |= data.draw(st.sampled_from([{}, {}, {}, {"last": 5}, {"none": 1}]))
        made = [outcome(cls, *args, **named) for cls in (theirs, ours)]
        if any(isinstance(each, tuple) for each in made):
            assert made[0] == made[1]
            return
        pairs.append(made)
    for act in (
        repr, hash, dataclasses.astuple, lambda one: repr(dataclasses.replace(one, last=3)), lambda one: one == 3,
        lambda one: repr(copy.copy(one)), lambda one: hash(copy.deepcopy(one)), lambda one: len(type(one).seen), len,
        lambda one: bool(outcome(setattr, one, "none", 4)), lambda one: setattr(one, "last", 4), repr,
    ):  # fmt: skip
        their_answer, our_answer = (repr(outcome(act, one)) for one in pairs[0])
        assert our_answer == their_answer
    (their_one, one), (their_other, other) = pairs
    for same in (operator.eq, operator.ne):
        assert outcome(same, one, other) == outcome(same, their_one, their_other)
    assert (one == their_one) is False


def test_a_record_is_pickled_and_a_circle_is_shown() -> None:
    literal = Literal(3, Int(0, 5))
    assert pickle.loads(pickle.dumps(literal)) == literal  # noqa: S301  # our own

    @records.dataclass(slots=True)
    class Holder:
        held: object = None

    holder = Holder()
    holder.held = holder
    assert repr(holder).endswith("Holder(held=...)")


def test_a_method_is_compiled_once_and_only_when_called() -> None:
    @records.dataclass(frozen=True, slots=True)
    class Width:
        mm: int

    waiting = {name: getattr(Width, name) for name in ("__init__", "__repr__", "__eq__", "__hash__")}
    one = Width(30)
    compiled = Width.__init__
    assert compiled is not waiting["__init__"]
    assert Width(30) == one
    assert Width.__init__ is compiled
    assert [name for name in waiting if getattr(Width, name) is waiting[name]] == ["__repr__", "__hash__"]
