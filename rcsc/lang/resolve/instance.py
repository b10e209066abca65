"""An instance of a program: a root file's declarations with another name of its level and other values of its constants.

In: an instance, and the declarations of its files as they stand. Out: its `Program`, resolved anew as a whole, so that nothing that is
known of the declared values is taken for it; or diagnostics, each at the place where the instance is asked for.

Only a constant that is written as one value can be set, by a value of the same sort, which takes its unit. What is computed from it
follows. A record of a file that other programs use keeps its types: one name would mean two things where they meet.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from math import isfinite
from typing import TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.model import Program, Record
from rcsc.lang.project import Instance, InstanceParameter
from rcsc.lang.syntax import tree

Resolved: TypeAlias = Program | tuple[Diagnostic, ...]
Meant: TypeAlias = Callable[[list[tree.Declaration]], Resolved]
"""What declarations mean."""


def instance_of(
    instance: Instance, declarations: Sequence[tree.Declaration], root: tree.File, meant: Meant
) -> Resolved:
    """Return the program of an instance, or every diagnostic.

    Args:
        instance: Which.
        declarations: Those of the root file and of all that it uses.
        root: The root file.
        meant: Resolves declarations.
    """
    wrong = (
        *_unnamed(instance, root),
        *(found for one in instance.parameters for found in _unfit(one, instance, declarations)),
    )
    if wrong:
        return wrong
    made = _Made(instance, declarations, root, meant)
    program = made.program(instance.parameters)
    if not isinstance(program, Program):
        return made.blamed(program)
    if instance.parameters and (shared := tuple(made.shared(program))):
        return shared
    return replace(program, name=instance.name, instance=instance)


# --- what is asked for ---


def _unnamed(instance: Instance, root: tree.File) -> Iterator[Diagnostic]:
    """Yield the fault of a file without the one level that takes the instance's name."""
    if _level(instance, root) is None:
        levels = _levels(root)
        what = (
            f"declares levels {', '.join(f'`{name}`' for name in levels)}" if levels else "declares no level"
        )
        helps = ("name the level as one of them, or give each a file",) if levels else ()
        yield _wrong(f"`{instance.file}` {what}: none becomes level `{instance.name}`", instance.span, *helps)


def _levels(root: tree.File) -> list[str]:
    return [each.name.text for each in root.declarations if isinstance(each, tree.LevelDecl)]


def _level(instance: Instance, root: tree.File) -> str | None:
    """Return the level of the file that is the instance's: of that name, or the only one, or the one that has the file's name."""
    levels, stem = _levels(root), instance.file.rpartition("/")[2].removesuffix(".rcs")
    if instance.name in levels:
        return instance.name
    return levels[0] if len(levels) == 1 else stem if stem in levels else None


def _unfit(
    one: InstanceParameter, instance: Instance, declarations: Sequence[tree.Declaration]
) -> Iterator[Diagnostic]:
    """Yield the fault of a parameter that no constant can take."""
    constants = {each.name.text: each.value for each in declarations if isinstance(each, tree.ConstDecl)}
    if one.name not in constants:
        near = get_close_matches(one.name, constants, n=1, cutoff=0.6)
        helps = tuple(f"did you mean `{name}`?" for name in near)
        message = f"the tables of level `{instance.name}` declare no constant `{one.name}`"
        yield _wrong(message, one.span, *helps)
        return
    value = _value(constants[one.name], one, _members(declarations))
    if isinstance(value, str):
        helps = () if value else ("set the constants that it is computed from",)
        message = f"constant `{one.name}` {f'is {value}, not {_shown(one.value)}' if value else 'is not written as one value'}"
        yield _wrong(message, one.span, *helps)


def _wrong(message: str, span: Span, *helps: str) -> Diagnostic:
    return Diagnostic(Code.BAD_SYSTEM, message, Label(span), help=helps)


def _shown(value: object) -> str:
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"


# --- values ---

Members: TypeAlias = Mapping[str, tuple[frozenset[str], ...]]
"""The members of each enumeration that has a member."""


def _members(declarations: Iterable[tree.Declaration]) -> Members:
    found: dict[str, tuple[frozenset[str], ...]] = {}
    for each in declarations:
        if isinstance(each, tree.EnumDecl):
            names = frozenset(member.text for member in each.members)
            found.update({name: (*found.get(name, ()), names) for name in names})
    return found


def _value(written: tree.Expr, one: InstanceParameter, members: Members) -> tree.Expr | str:
    """Return the value of a parameter as a constant would have it in the text; else what the constant is, or "" for a computed one."""
    value, span = one.value, one.span
    plain = written.operand if isinstance(written, tree.Unary) and written.op == "-" else written
    match plain:
        case tree.BoolLiteral() if plain is written:
            return tree.BoolLiteral(value, span) if isinstance(value, bool) else "true or false"
        case tree.IntLiteral(unit=unit):
            if isinstance(value, bool) or not isinstance(value, int):
                return "a whole number"
            return _signed(tree.IntLiteral(str(abs(value)), unit, span), value)
        case tree.RealLiteral(unit=unit):
            if isinstance(value, bool | str) or not isfinite(value):
                return "a real number"
            return _signed(tree.RealLiteral(repr(abs(float(value))), unit, span), float(value))
        case tree.Reference(name) if plain is written and name.text in members:
            return _member(value, span, members[name.text], None)
        case tree.FieldOf(tree.Reference() as base, name) if plain is written and name.text in members:
            return _member(value, span, members[name.text], base)
        case _:
            return ""


def _signed(literal: tree.IntLiteral | tree.RealLiteral, value: float) -> tree.Expr:
    return tree.Unary("-", literal, literal.span) if value < 0 else literal


def _member(
    value: object, span: Span, of: Sequence[frozenset[str]], base: tree.Reference | None
) -> tree.Expr | str:
    """Return the name of a member of the same enumeration."""
    if not isinstance(value, str) or not any(value in names for names in of):
        return f"one of {', '.join(sorted({name for names in of for name in names}))}"
    name = tree.Name(value, span)
    return tree.Reference(name, span) if base is None else tree.FieldOf(base, name, span)


# --- the program ---


class _Made:
    """Resolves an instance with some of its parameters, to find those that something follows from."""

    def __init__(
        self, instance: Instance, declarations: Sequence[tree.Declaration], root: tree.File, meant: Meant
    ) -> None:
        self.instance, self.root, self._all, self._meant = instance, root, declarations, meant
        self._members = _members(declarations)

    def program(self, parameters: Iterable[InstanceParameter]) -> Resolved:
        """Return the program with some of the parameters, the level renamed."""
        return self._meant(list(self._set({one.name: one for one in parameters})))

    def _set(self, parameters: Mapping[str, InstanceParameter]) -> Iterator[tree.Declaration]:
        level = _level(self.instance, self.root)
        for each in self._all:
            match each:
                case tree.ConstDecl(name, value) if name.text in parameters:
                    given = _value(value, parameters[name.text], self._members)
                    assert not isinstance(given, str)  # each was held against its constant
                    yield replace(each, value=given)
                case tree.LevelDecl(name) if name.text == level and any(
                    each is one for one in self.root.declarations
                ):
                    yield replace(each, name=replace(name, text=self.instance.name))
                case _:
                    yield each

    def blamed(self, wrong: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
        """Return findings that the declared values do not have at the place of the parameter that brings them; others as they are."""
        plain = self._meant(list(self._all))
        known = () if isinstance(plain, Program) else plain
        return tuple(found if found in known else self._blamed(found) for found in wrong)

    def _blamed(self, found: Diagnostic) -> Diagnostic:
        place = self._guilty(
            lambda made: not isinstance(made, Program) and any(one.code is found.code for one in made)
        )
        message, there = f"level `{self.instance.name}`: {found.message}", found.primary.span
        here = () if there.file == place.file else (Label(there, "it is here"),)
        return replace(found, message=message, primary=Label(place), related=(*here, *found.related))

    def _guilty(self, does: Callable[[Resolved], bool]) -> Span:
        """Return the place of the one parameter that alone does it; of the whole instance where there is no such."""
        alone = (one.span for one in self.instance.parameters if does(self.program((one,))))
        only = self.instance.parameters[0].span if len(self.instance.parameters) == 1 else None
        return next(alone, only or self.instance.span)

    def shared(self, program: Program) -> Iterator[Diagnostic]:
        """Yield records of used files whose types the parameters change."""
        plain = self.program(())
        if not isinstance(plain, Program):
            return
        for name, record in _shared(program, self.instance.file).items():
            before = _shared(plain, self.instance.file).get(name)
            if record != before:
                yield _wrong(
                    f"level `{self.instance.name}` would have another record `{name}` than other programs with that record",
                    self._guilty(partial(self._has_other, name, before)),
                    "let its fields have ranges that no level sets, and hold them against the parameter in the tables",
                )

    def _has_other(self, name: str, before: Record | None, made: Resolved) -> bool:
        return isinstance(made, Program) and _shared(made, self.instance.file).get(name) != before


def _shared(program: Program, root: str) -> dict[str, Record]:
    """Return the records that files declare that other programs may use, too."""
    return {record.name: record for record in program.records if record.file != root}


def noted(found: Diagnostic, instance: Instance) -> Diagnostic:
    """Return a finding of an instance that says with which values."""
    return replace(found, notes=(*found.notes, f"with {instance.shown}")) if instance.parameters else found
