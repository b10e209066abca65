"""Start values written out: of what starts otherwise now than in the version in which it was written.

In: files, and their programs as they were read before, when what had no initial value started with the least of its type. Out: the
files with `= VALUE` after the type of each variable, field of a record and field of a link that starts otherwise now: numbers that
can be negative or have no 0, and outputs whose safe value is not the least.

Which version a file was written for stands nowhere in it. A project whose `rcsc.toml` says `starts_at_zero = true` was written, or
written out, since then, and is left as it is.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import TypeVar

from rcsc.lang.model import (
    Bool,
    Enum,
    Int,
    Program,
    Real,
    Scalar,
    Single,
    Type,
    Value,
    key_bounds,
    spell,
    start,
    value_of_key,
)
from rcsc.lang.operator_table import single
from rcsc.lang.project import Loaded, project_root, starts_at_zero
from rcsc.lang.resolve import closure, resolve
from rcsc.lang.resolve.declarations import element
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr

FieldT = TypeVar("FieldT", bound=tree.FieldDecl)


def written_out(
    loaded: Loaded, names: Sequence[str], programs: Mapping[str, Program]
) -> tuple[dict[str, tree.File], list[str]]:
    """Return the files of `names` that change, and messages about the values written.

    Each number is spelled as the program spells it already, since no text may have two numbers that are one double.
    """
    files: dict[str, tree.File] = {}
    words: list[str] = []
    users = {name: root for root in programs for name in closure(root, loaded)}
    for name in names:
        if starts_at_zero(project_root(name)):
            continue
        files_used = [loaded.files[used] for used in closure(users[name], loaded)]
        work = _File(programs[users[name]], _texts(files_used))
        before = loaded.files[name]
        after = replace(before, declarations=tuple(map(work.declaration, before.declarations)))
        if work.words:
            files[name] = after
            words += [f"{name}: {each}" for each in work.words]
    return files, words


def started_otherwise(loaded: Loaded, programs: Mapping[str, Program]) -> Iterator[str]:
    """Yield messages about variables that still start otherwise than in `programs`: they stand in files that were not to be changed."""
    told: dict[str, None] = {}
    for root, before in programs.items():
        after = resolve(root, loaded)
        if not isinstance(after, Program):
            told |= dict.fromkeys(f"{each.primary.span.file}: {each.message}" for each in after)
            continue
        now = {variable.name: variable.initial for variable in after.variables}
        for variable in before.variables:
            if now.get(variable.name, variable.initial) != variable.initial:
                kind, first = variable.type, variable.initial
                words = f"`{variable.name}` starts at {spell(kind, now[variable.name])}, and not at {spell(kind, first)} as before"
                told[f"{variable.span.file}: {words}"] = None
    yield from told


@dataclass(slots=True)
class _File:
    """One file, resolved in a program that uses it."""

    program: Program
    texts: Mapping[tuple[bool, float], str]
    words: list[str] = field(default_factory=list)

    def declaration(self, written: tree.Declaration) -> tree.Declaration:
        """Return the declaration with the values written out."""
        match written:
            case tree.VariableDecl(initial=None):
                name = written.name.text
                kind = next(
                    (declared.type for declared in self.program.declared if declared.name == name), None
                )
                safe = next((leaf.safe for leaf in self.program.variables if leaf.name == name), None)
                return replace(written, initial=self._first(name, kind, safe))
            case tree.RecordDecl(name, fields):
                return replace(written, fields=self._fields(name.text, name.text, fields))
            case tree.LinkDecl(name):
                order, report = (
                    self._fields(name.text, f"{name.text}_{word}", fields)
                    for word, fields in (("order", written.order), ("report", written.report))
                )
                return replace(written, order=order, report=report)
            case _:
                return written

    def _fields(self, owner: str, record: str, fields: Sequence[FieldT]) -> tuple[FieldT, ...]:
        known = next((kind for kind in self.program.records if kind.name == record), None)
        kinds = {} if known is None else {part.name: part.type for part in known.fields}
        return tuple(
            part
            if part.initial is not None
            else replace(part, initial=self._first(f"{owner}.{part.name.text}", kinds.get(part.name.text)))
            for part in fields
        )

    def _first(self, place: str, kind: Type | None, safe: Value | None = None) -> tree.Expr | None:
        """Return the initial value to write; None where the variable starts as it did."""
        scalar = None if kind is None else element(kind)
        if not isinstance(scalar, Bool | Enum | Int | Real):
            return None
        least = value_of_key(scalar, key_bounds(scalar)[0])
        said = safe is not None or not isinstance(scalar, Int | Real) or scalar.low <= 0 <= scalar.high
        if said and (start(scalar) if safe is None else safe) == least:
            return None
        value = _spelled(scalar, least, self.texts)
        self.words.append(f"`{place}` says `= {spell_expr(value)}`, with which it started")
        return value


def _texts(files: Iterable[tree.File]) -> dict[tuple[bool, float], str]:
    """Return the spelling of numbers with a point in the files, by whether they become singles and by value; bounds of singles first."""
    written = [(literal, bound) for file in files for literal, bound in _literals(file, False)]
    texts: dict[tuple[bool, float], str] = {}
    for literal, _ in sorted(written, key=lambda each: not each[1]):
        value = float(literal.text.replace("_", ""))
        texts.setdefault((False, value), literal.text)
        texts.setdefault((True, single(value)), literal.text)
    return texts


def _literals(part: object, bound: bool) -> Iterator[tuple[tree.RealLiteral, bool]]:
    """Yield each number with a point, and whether it bounds a single."""
    if isinstance(part, tree.RealLiteral):
        yield part, bound
    elif isinstance(part, tuple):
        for each in part:
            yield from _literals(each, bound)
    elif is_dataclass(part):
        for inner in fields(part):
            yield from _literals(getattr(part, inner.name), bound or isinstance(part, tree.SingleType))


def _spelled(kind: Scalar, value: Value, texts: Mapping[tuple[bool, float], str]) -> tree.Expr:
    match kind:
        case Bool():
            return tree.BoolLiteral(bool(value))
        case Enum():
            return tree.Reference(tree.Name(spell(kind, value)))
        case Int() | Real():
            text = spell(kind, abs(value))
            if isinstance(kind, Real):
                text = texts.get((isinstance(kind, Single), abs(value)), text)
            number = tree.IntLiteral(text) if isinstance(kind, Int) else tree.RealLiteral(text)
            return tree.Unary("-", number) if value < 0 else number
