"""`rcsc check`: every table proved, and what is known of the levels together; an unchanged project is recognised without being parsed."""

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.report import Report
from rcsc.base.host.cache import Cache, open_cache
from rcsc.base.host.files.read import Malformed, content
from rcsc.driver.settings import Settings
from rcsc.driver.unchanged import recall, remember
from rcsc.lang.project import is_published, project_root, systems_above, used_elsewhere

_UNREAD = frozenset((Code.UNREAD, Code.UNUSED_CONSTANT, Code.UNUSED_MEMBER))
_WORD = re.compile(r"\w+")


def check(settings: Settings) -> Report:
    """Prove every table; for those that a system's levels run, tell what the proof of the levels together shows."""
    found = _together(settings)
    files = dict.fromkeys(each.primary.span.file for each in found.diagnostics)
    return replace(found, published=tuple(filter(is_published, files)))


def _together(settings: Settings) -> Report:
    cache = _cache(settings)
    report = _staying_outside(_unread_elsewhere(_checked(settings, cache)))
    if cache is None or not any(systems_above(table.file) for table in report.tables):
        return report
    from rcsc.driver.together import with_levels  # keep lazy: most files belong to no system

    return with_levels(report, cache)


def _checked(settings: Settings, cache: Cache | None) -> Report:
    """Prove every table by itself; an unchanged project is recognised without being parsed."""
    whole = None if settings.stdin is not None else cache
    known = recall(whole, settings.paths, settings.options) if whole else None
    if known is not None:
        return known
    from rcsc.driver.pipeline import (
        proved,  # keep lazy: parser and provers, which nobody needs where nothing has changed
    )

    project = proved(settings, cache)
    report = project.report(tuple(project.unread()))
    if whole is not None:
        remember(whole, settings.paths, settings.options, project.loaded, report)
    return report


def _unread_elsewhere(report: Report) -> Report:
    """Return the report without warnings about names that the project's other files, or its systems, may read."""
    told = {each.primary.span.file for each in report.diagnostics if each.code in _UNREAD}
    shared = {file for file in told if used_elsewhere(file)}
    named = {file: _words(_descriptions(file)) for file in told - shared}

    def kept(each: Diagnostic) -> bool:
        span = each.primary.span
        return each.code not in _UNREAD or (
            span.file in named and report.sources[span.file].slice(span) not in named[span.file]
        )

    return replace(report, diagnostics=tuple(filter(kept, report.diagnostics))) if told else report


def _staying_outside(report: Report) -> Report:
    """Return the report without warnings of outputs after a fault that no system leads to somebody outside its levels."""
    told = {each.primary.span.file for each in report.diagnostics if each.code is Code.STAYS_AFTER_FAULT}
    led = {file: {name for system in systems_above(file) for name in _outside(system)} for file in told}

    def kept(each: Diagnostic) -> bool:
        span = each.primary.span
        return (
            each.code is not Code.STAYS_AFTER_FAULT or report.sources[span.file].slice(span) in led[span.file]
        )

    return replace(report, diagnostics=tuple(filter(kept, report.diagnostics))) if told else report


def _outside(system: Path) -> Iterator[str]:
    """Yield the outputs that a system leads to somebody outside its levels; none where it is not in order."""
    from rcsc.run.description import BadDescription, description  # keep lazy: few files have such a warning

    with suppress(BadDescription):
        said = description(system)
        levels = {level.name for level in said.levels}
        for wire in said.wires:
            if wire.target.partition(".")[0] not in levels:
                yield wire.source.partition(".")[2]


def _descriptions(file: str) -> Iterator[Path]:
    """Yield files that may describe a system with this file: TOML beside it and above, as far as its project goes."""
    here, top = Path(os.path.dirname(file) or ".").resolve(), Path(project_root(file)).resolve()
    for folder in (here, *here.parents):
        yield from sorted(folder.glob("*.toml"))
        if folder == top:
            break
    yield from systems_above(file)


def _words(files: Iterable[Path]) -> set[str]:
    """Collect all words of the files."""
    words: set[str] = set()
    for file in files:
        with suppress(OSError, Malformed):  # it is none then that anybody runs
            words |= set(_WORD.findall(content(file).decode("utf-8", "replace")))
    return words


def _cache(settings: Settings) -> Cache | None:
    if not settings.use_cache:
        return None
    first = settings.paths[0]
    inside = os.path.join(first, "-") if os.path.isdir(first) else first
    return open_cache(Path(project_root(inside)))
