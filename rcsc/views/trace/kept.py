"""A kept matrix held against the one of this version: the whole of it, member by member.

In: two documents of `tables_of.to_json`, one of them from a file. Out: findings, each with the first places that differ.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files.names import shown
from rcsc.base.host.files.read import Malformed, json_of, text
from rcsc.views.trace.tables_of import FORM

MOST_SHOWN = 10
"""Places that differ, named in one finding."""
_NAMED = ("table", "line", "sort", "name", "of", "file", "first", "last")
"""Members by which the entries of a list are told apart."""
_GENERATED = ("files", "code", "untraced")
"""Members of a program that are other places where its generated code is another."""


def kept(path: Path) -> dict[str, Any]:
    """Read a kept matrix.

    Raises:
        OSError: It cannot be read.
        Malformed: It is none.
    """
    document = json_of(text(path))
    if not isinstance(document, dict):
        raise Malformed("it is no matrix of `rcsc trace`")
    programs = document.get("programs")
    if not isinstance(programs, list) or not all(isinstance(one, dict) for one in programs):
        raise Malformed("it is no matrix of `rcsc trace`")
    if document.get("form") != FORM:
        raise Malformed(f"it is a matrix of another form than {FORM}: `rcsc trace` makes it anew")
    return document


def names_of(document: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Return the list of requirements that a kept matrix was made with."""
    names = [] if document is None else document.get("listed")
    return tuple(map(str, names)) if isinstance(names, list) else ()


def against(was: Mapping[str, Any], now: Mapping[str, Any], path: Path) -> Iterator[Diagnostic]:
    """Yield what a kept matrix says otherwise than the one of this version.

    Args:
        was: The kept one.
        now: That of this version, in the same form.
        path: Where the kept one is from.
    """
    before = {str(one.get("program")): one for one in was["programs"]}
    after = {one["program"]: one for one in now["programs"]}
    if len(before) != len(was["programs"]):
        yield _old(path, "has a program twice")
    for name in sorted(before.keys() - after.keys()):
        yield _old(path, f"has a program {shown(name)} that is not here")
    for name, one in after.items():
        if name not in before:
            yield _old(path, f"has no program `{name}`")
        else:
            yield from _program(name, before[name], one, path)
    rest = (
        {name: member for name, member in one.items() if name not in ("programs", "tool")}
        for one in (was, now)
    )
    if told := [*_differences("", *rest)]:
        yield _old(path, "says something else of all programs together", *_first(told))


def _program(name: str, was: Mapping[str, Any], now: Mapping[str, Any], path: Path) -> Iterator[Diagnostic]:
    if was.get("digest") != now["digest"]:
        yield _old(path, f"is of a program `{name}` with another meaning")
        return
    files = was.get("files")
    other = [] if files == now["files"] else [*_changed(files, now["files"])] or ["files"]
    if other:
        yield _old(path, f"is of other code of `{name}`", *other)
        was, now = _without_code(was), _without_code(now)
    if told := [*_differences("", was, now)]:
        yield _old(path, f"says something else of `{name}`", *_first(told))


def _changed(was: Any, now: Mapping[str, str]) -> Iterator[str]:
    before = was if isinstance(was, dict) else {}
    yield from (
        shown(name).strip("`") for name in sorted({*before, *now}) if before.get(name) != now.get(name)
    )


def _without_code(program: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is said of a program without places in its generated code."""
    left = {name: member for name, member in program.items() if name not in _GENERATED}
    lines = left.get("lines")
    if isinstance(lines, list) and all(isinstance(line, dict) for line in lines):
        left["lines"] = [{name: member for name, member in line.items() if name != "code"} for line in lines]
    return left


def _differences(where: str, was: Any, now: Any) -> Iterator[str]:
    """Yield each least part that differs, with its place."""
    if isinstance(was, list) and isinstance(now, list):
        was, now = _by_name(was), _by_name(now)
    if isinstance(was, dict) and isinstance(now, dict):
        for name in dict.fromkeys((*now, *was)):
            place = f"{where} {name}".strip()
            if name not in was:
                yield f"{shown(place)} is missing"
            elif name not in now:
                yield f"{shown(place)} is of another version"
            else:
                yield from _differences(place, was[name], now[name])
    elif type(was) is not type(now) or was != now:
        yield f"{shown(where)} is {shown(str(was))}, and {shown(str(now))} in this version"


def _by_name(entries: list[Any]) -> dict[str, Any]:
    """Return the entries of a list by what names them, and by themselves where nothing does; the second of a name has a number."""
    found: dict[str, Any] = {}
    for entry in entries:
        names = (
            [str(entry[key]) for key in _NAMED if key in entry] if isinstance(entry, dict) else [str(entry)]
        )
        name = free = " ".join(names) or (str(entry.get("place")) if isinstance(entry, dict) else "")
        again = 1
        while free in found:
            again += 1
            free = f"{name} ({again})"
        found[free] = entry
    return found


def _first(told: list[str]) -> tuple[str, ...]:
    more = [f"and {len(told) - MOST_SHOWN} more"] if len(told) > MOST_SHOWN else []
    return (*told[:MOST_SHOWN], *more)


def _old(path: Path, what: str, *notes: str) -> Diagnostic:
    helps = ("`rcsc trace` makes it anew",)
    return Diagnostic(
        Code.MATRIX_OLD, f"`{path}` {what}", Label(Span(str(path), 0, 0)), notes=notes, help=helps
    )
