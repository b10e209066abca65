"""Refuses a certificate that says more, or otherwise, than the checker reads: nothing in it is passed over.

In: a certificate as it was read from JSON. Out: nothing, or `RejectedError`. Its fields are those that there are and no others, each of
its very type (`true` and `1.0` are no `1`); every column is of a form, every form of the tree, and no multiplier is 0. So whatever is
changed in a certificate changes something that is checked.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, TypeAlias

from rcsc.proof.certify.table import RejectedError

FORMAT, VERSION = "rcsc-certificate", 3
_Check: TypeAlias = Callable[[Any], bool]
_WHOLE = frozenset({"format", "version", "program", "meaning", "tables"})
_TABLE = frozenset({"table", "assumptions", "columns", "forms", "tree", "stops"})
WITNESS = "witness"


def check_shape(certificate: Any, program: str) -> None:
    """Check fields, types and numbers.

    Args:
        certificate: As it was read from JSON.
        program: The name of the program that it must be of.

    Raises:
        RejectedError: A part is malformed; the message says where.
    """
    if not isinstance(certificate, Mapping) or certificate.get("format") != FORMAT:
        raise RejectedError("not a certificate")
    if type(certificate.get("version")) is not int or certificate["version"] != VERSION:
        raise RejectedError("not a certificate of this version")
    _fields(certificate, _WHOLE, frozenset(), "it")
    if certificate["program"] != program:
        raise RejectedError("it is of a program of another name")
    _owe(
        _text(certificate["meaning"])
        and _list_of(certificate["tables"], lambda entry: isinstance(entry, dict)),
        "it",
        "meaning or tables",
    )
    for entry in certificate["tables"]:
        _entry(entry)


def _entry(entry: Mapping[str, Any]) -> None:
    where = f"table `{str(entry.get('table'))[:60]}`"
    _fields(entry, _TABLE, frozenset({WITNESS}), where)
    for key in ("assumptions", "columns"):
        _owe(_list_of(entry[key], _text) and _distinct(entry[key]), where, key)
    _owe(_list_of(entry["stops"], _text) and _text(entry["table"]), where, "table or stops")
    columns, forms, tree = entry["columns"], entry["forms"], entry["tree"]
    of_column = _pairs(len(columns))
    _owe(_list_of(forms, lambda form: of_column(form) and bool(form)) and _distinct(forms), where, "forms")
    _owe(_list_of(tree, _node(len(forms), len(entry["assumptions"]))), where, "tree")
    if WITNESS in entry:
        values = isinstance(entry[WITNESS], dict) and list(entry[WITNESS].values())
        _owe(_list_of(values, lambda value: type(value) in {int, bool, float}), where, WITNESS)


def check_used(entry: Mapping[str, Any]) -> None:
    """Check that every column is in a form, and every form in the tree: an unused one could be anything.

    Raises:
        RejectedError: One is not.
    """
    used: set[int] = set()
    for kind, *rest in entry["tree"]:
        used |= {rest[0]} if kind == "s" else {at for at, _ in rest[0]} if kind == "e" else set()
        used |= set(rest[1] or ()) if kind == "b" else set()
    if used != set(range(len(entry["forms"]))):
        raise RejectedError("a form is nowhere in the tree")
    if {at for form in entry["forms"] for at, _ in form} != set(range(len(entry["columns"]))):
        raise RejectedError("a column is of no form")


def _node(forms: int, assumptions: int) -> _Check:
    """Return a check of a tree's node, over so many forms and assumptions."""
    multipliers = _pairs(forms)
    shapes: dict[str, tuple[_Check, ...]] = {
        "s": (_below(forms), _number), "e": (multipliers,), "a": (_below(assumptions),), "l": (lambda at: _number(at) and at >= -1,),
        "b": (lambda count: count is None or _number(count), lambda parts: parts is None or _list_of(parts, _below(forms))), "z": (),
    }  # fmt: skip

    def check(node: Any) -> bool:
        if not isinstance(node, list) or not node or not _text(node[0]) or node[0] not in shapes:
            return False
        parts = shapes[node[0]]
        return len(node) == len(parts) + 1 and all(
            right(part) for right, part in zip(parts, node[1:], strict=True)
        )

    return check


def _pairs(count: int) -> _Check:
    """Return a check of a list of pairs: numbers below a count, ascending, each with a nonzero number."""
    below = _below(count)

    def pair(value: Any) -> bool:
        return (
            isinstance(value, list)
            and len(value) == 2
            and below(value[0])
            and _number(value[1])
            and value[1] != 0
        )

    return lambda pairs: _list_of(pairs, pair) and all(a[0] < b[0] for a, b in pairwise(pairs))


def _below(count: int) -> _Check:
    return lambda value: _number(value) and 0 <= value < count


def _number(value: Any) -> bool:
    return type(value) is int


def _text(value: Any) -> bool:
    return type(value) is str


def _list_of(values: Any, right: _Check) -> bool:
    return isinstance(values, list) and all(map(right, values))


def _distinct(values: Sequence[Any]) -> bool:
    return len({repr(value) for value in values}) == len(values)


def _fields(table: Mapping[str, Any], needed: frozenset[str], may: frozenset[str], where: str) -> None:
    if lacking := sorted(needed - table.keys()):
        raise RejectedError(f"{where} lacks `{lacking[0]}`")
    if more := sorted(map(str, table.keys() - needed - may)):
        raise RejectedError(f"{where} has a field `{more[0][:60]}`, which no certificate has")


def _owe(good: bool, where: str, what: str) -> None:
    if not good:
        raise RejectedError(f"{where}: malformed {what}")
