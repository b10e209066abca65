"""What is told of names that nothing declares: once of each, and where a file of the project or another level has it.

In: a file that is no program, and what was found wrong with it. Out: the same, or less. That a `use` would make a name known is tried: the
file is resolved once more with that line at its end, where it moves nothing, and what is gone then followed from its absence.
"""

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.base.host.files.read import Malformed, text
from rcsc.lang.model import Program
from rcsc.lang.project import Loaded, load, systems_above, usable
from rcsc.lang.resolve import closure, resolve
from rcsc.lang.syntax import tree
from rcsc.run.description import BadDescription, Description, LevelSpec, description, places

_CALLED = re.compile(r"is called `(\w+)`$")
_OF = re.compile(r"(\w+)\.$")
_TRIED = 5
"""Files that are tried for a `use`."""
_NAMED = 8
"""Names, and lines, that a note lists; others are counted."""
Key = tuple[str, str, str, int]
_Claim = tree.PropertyDecl | tree.RequirementDecl | tree.InvariantDecl


def told(root: str, loaded: Loaded, found: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Return what is wrong with a file that no program is, with each name that nothing declares told once."""
    left, more = list(found), list[Diagnostic]()
    if root not in loaded.instances:
        for file in dict.fromkeys(each.primary.span.file for each in left if _name(each)):
            one, left = _without_use(root, file, loaded, left)
            more += one
        left = _of_levels(root, loaded, left)
    return tuple(sorted((*more, *_once(left, loaded)), key=sort_key))


def _name(each: Diagnostic) -> str:
    """Return the name that a diagnostic misses; "" for any other diagnostic."""
    called = _CALLED.search(each.message) if each.code is Code.UNKNOWN_NAME else None
    return called[1] if called else ""


# --- a file of the project ---


def _without_use(
    root: str, file: str, loaded: Loaded, found: list[Diagnostic]
) -> tuple[list[Diagnostic], list[Diagnostic]]:
    """Return what is told of a `use` that a file lacks, none where none is known, and what of the findings is left then."""
    missing = {name for each in found if each.primary.span.file == file and (name := _name(each))}
    source = loaded.sources.get(file)
    if source is None or not missing or not os.path.isfile(file):
        return [], found
    here = {os.path.realpath(each) for each in closure(root, loaded)}
    for path, declared in _candidates(file, missing, here):
        overlay = {os.path.realpath(file): f"{source.text}\nuse {path}\n"}
        now = load([root], overlay=overlay)
        program = resolve(now.roots[0], now)
        wrong = () if isinstance(program, Program) else program
        keys = set(map(_key, wrong))
        gone = [each for each in found if _key(each) not in keys]
        clash = any(each.code in (Code.DUPLICATE_NAME, Code.FILE_CYCLE) for each in wrong)
        if any(_name(each) in declared for each in gone) and not clash and not now.diagnostics:
            return [_use_lacks(path, declared, gone)], [each for each in found if _key(each) in keys]
    return [], found


def _key(each: Diagnostic) -> Key:
    span = each.primary.span
    return each.code.value, each.message, os.path.realpath(span.file), span.start


def _candidates(file: str, missing: set[str], here: set[str]) -> list[tuple[str, set[str]]]:
    """Return what `use` may name that declares some of the names, those with most of them first; no level, and nothing in use already."""
    asked = [re.compile(rf"\b{name}\b") for name in missing]
    found: list[tuple[int, str, set[str]]] = []
    for path, other in usable(file).items():
        if os.path.realpath(other) in here or not any(name.search(_text(other)) for name in asked):
            continue
        parts = load([other])
        if not any(isinstance(each, tree.LevelDecl) for each in _declarations(parts)):
            declared = set(_declared(_declarations(parts)))
            found.append((-len(missing & declared), path, declared))
    return [(path, declared) for many, path, declared in sorted(found, key=lambda one: one[:2]) if many][
        :_TRIED
    ]


def _text(file: str) -> str:
    try:
        return text(Path(file))
    except (OSError, Malformed):
        return ""


def _declarations(loaded: Loaded) -> Iterator[tree.Declaration]:
    for file in loaded.files.values():
        yield from file.declarations


def _declared(declarations: Iterable[tree.Declaration]) -> Iterator[str]:
    """Yield the names of declarations, and of members."""
    for each in declarations:
        name = getattr(each, "name", None)
        if isinstance(name, tree.Name):
            yield name.text
        if isinstance(each, tree.EnumDecl):
            yield from (member.text for member in each.members)


def _use_lacks(path: str, declared: set[str], gone: list[Diagnostic]) -> Diagnostic:
    names = dict.fromkeys(name for each in gone if (name := _name(each)))
    first = next(each for each in gone if _name(each) in declared)
    others = [f"`{name}`" for name in names if name != _name(first)]
    places = f"{len(gone)} place{'' if len(gone) == 1 else 's'}"
    also = (f"so it is with {_listed(others)}, in {places} together",) if others else ()
    also = also or ((f"it is missing in {places}",) if len(gone) > 1 else ())
    return Diagnostic(
        Code.UNKNOWN_NAME,
        f"`{_name(first)}` is declared in `{path}.rcs`, which this file does not use",
        Label(first.primary.span),
        notes=also,
        help=(f"add `use {path}`: write that line above the first declaration",),
    )


def _listed(texts: Sequence[str]) -> str:
    """Return several as one text; past a number of them they are counted."""
    shown = list(texts[:_NAMED])
    if len(texts) > len(shown):
        shown.append(f"{len(texts) - len(shown)} more")
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


# --- another level ---


def _of_levels(root: str, loaded: Loaded, found: list[Diagnostic]) -> list[Diagnostic]:
    """Return the findings; of a claim about a variable of another level one, which says where such a claim stands."""
    claims = [
        each
        for each in (loaded.files[root].declarations if root in loaded.files else ())
        if isinstance(each, _Claim)
    ]
    spans = [(each.name.span.start, _end_of(each, loaded, root)) for each in claims]
    inside: dict[int, list[Diagnostic]] = {}
    for each in found:
        at = each.primary.span
        for number, (start, end) in enumerate(spans):
            if _name(each) and at.file == root and start <= at.start < end:
                inside.setdefault(number, []).append(each)
    for group in inside.values():
        elsewhere = _elsewhere(root, loaded, group)
        if elsewhere is not None:
            found = [elsewhere, *(each for each in found if each not in group)]
    return found


def _end_of(claim: _Claim, loaded: Loaded, root: str) -> int:
    """Return where the declaration after a claim begins, or the text ends."""
    starts = [
        name.span.start
        for each in loaded.files[root].declarations
        if isinstance(name := getattr(each, "name", None), tree.Name)
    ]
    begin = claim.name.span.start
    return min((start for start in starts if start > begin), default=len(loaded.sources[root].text))


def _elsewhere(root: str, loaded: Loaded, group: list[Diagnostic]) -> Diagnostic | None:
    """Return what is told of names of a claim that another level of the file's system has; None where none has."""
    for system, said in _systems(root):
        levels = _variables(said, system, root)
        for each in group:
            before = _OF.search(loaded.sources[root].text[: each.primary.span.start])
            asked = [before[1]] if before and before[1] in levels else levels if before is None else []
            level = next((level for level in asked if _name(each) in levels[level]), None)
            if level is not None:
                return _belongs(each, level, system, said)
    return None


def _systems(root: str) -> Iterator[tuple[Path, Description]]:
    """Yield the systems above a file that run it as a level."""
    for path in systems_above(root):
        with suppress(BadDescription):
            said = description(path)
            if any(_is(root, path, spec) for spec in said.levels):
                yield path, said


def _is(root: str, system: Path, spec: LevelSpec) -> bool:
    """Return whether a level's tables are in a file."""
    return os.path.realpath(root) in {os.path.realpath(place) for place in places(system, spec.source)}


def _variables(said: Description, system: Path, root: str) -> Mapping[str, set[str]]:
    """Return the variables of each other level, by its name; none of one that is not in order."""
    found: dict[str, set[str]] = {}
    for spec in said.levels:
        loaded = None if _is(root, system, spec) else said.load(system, spec)
        program = resolve(loaded.roots[0], loaded) if loaded is not None else ()
        found[spec.name] = {each.name for each in program.declared} if isinstance(program, Program) else set()
    return found


def _belongs(each: Diagnostic, level: str, system: Path, said: Description) -> Diagnostic:
    if said.requirements is None:
        where = f'stands in a file that `{system.name}` names: `requirements = "requirements.rcs"`'
    else:
        where = f"stands in `{said.requirements.name}`, which `{system.name}` names"
    name = _name(each)
    return replace(
        each,
        message=f"`{name}` is a variable of level `{level}`, and what a level's file claims is of that level alone",
        help=(
            f"what levels do together {where}; there write `{level}.{name}`, and each variable with its level",
        ),
    )


# --- once ---


def _once(found: Iterable[Diagnostic], loaded: Loaded) -> Iterator[Diagnostic]:
    """Yield the findings; one of a name that is missed in several places of a file says in which lines."""
    same: dict[tuple[str, str], list[Diagnostic]] = {}
    rest: list[Diagnostic] = []
    for each in found:
        if _name(each):
            same.setdefault((each.primary.span.file, each.message), []).append(each)
        else:
            rest.append(each)
    yield from rest
    for (file, _), group in same.items():
        first, *others = sorted(group, key=sort_key)
        source = loaded.sources.get(file)
        lines = sorted({source.position(each.primary.span.start).line for each in others}) if source else []
        yield replace(first, notes=(*first.notes, *_also(lines))) if others else first


def _also(lines: Sequence[int]) -> Iterator[str]:
    if lines:
        yield f"missed in line{'' if len(lines) == 1 else 's'} {_listed([str(line) for line in lines])}, too"
