"""A whole check remembered, so that an unchanged project is not even parsed again.

In: the paths and options of a check. Out: its report, if everything that it looked at is as it was: every
file by content, and every place where a file would have been found first is still empty.
"""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.report import Report, TableReport
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.cache import Cache
from rcsc.base.host.files.read import Malformed, content
from rcsc.lang.project import MOST_BYTES, Loaded, listed, places
from rcsc.proof.solvers.options import Options

_PASSING = {Code.UNDECIDED, Code.FILE_NOT_FOUND, Code.FILE_CYCLE, Code.UNKNOWN_NAME}
"""Findings that may go away though no file that was read changes; as do all of 1xx and 9xx."""


@dataclass(frozen=True, slots=True)
class _Checked:
    """The result of a check.

    Attributes:
        roots: The files that were given.
        looked_at: The digest of every place that was looked at (`digests`).
    """

    roots: tuple[str, ...]
    looked_at: dict[str, str]
    diagnostics: tuple[Diagnostic, ...]
    tables: tuple[TableReport, ...]


def recall(cache: Cache, paths: tuple[str, ...], options: Options) -> Report | None:
    """Return the report of the same check, if nothing that it depends on has changed."""
    kept = cache.load(_Checked, *_key(paths, options))
    if kept is None or kept.roots != tuple(listed(paths)):
        return None
    texts = as_before(kept.looked_at)
    if texts is None:
        return None
    named = {name for name in texts if name.endswith(".rcs")} if kept.diagnostics else set()
    sources = {name: Source(name, texts[name].decode("utf-8-sig")) for name in sorted(named)}
    return Report(kept.diagnostics, tuple(replace(table, cached=True) for table in kept.tables), sources)


def remember(cache: Cache, paths: tuple[str, ...], options: Options, loaded: Loaded, report: Report) -> None:
    """Keep the report, unless it may change though no file does."""
    if any(
        diagnostic.code in _PASSING or diagnostic.code.value[3] in "19" for diagnostic in report.diagnostics
    ):
        return
    looked_at = digests(loaded)
    if looked_at is None:
        return
    checked = _Checked(tuple(loaded.given), looked_at, report.diagnostics, report.tables)
    cache.store(checked, *_key(paths, options))


def digests(loaded: Loaded) -> dict[str, str] | None:
    """Return the digest of every place looked at, empty ones too; None where a file has changed since it was read."""
    seen = {name: _seen(name) for name in places(loaded)}
    for name, source in loaded.sources.items():
        if (seen[name][1] or b"").decode("utf-8-sig", "replace") != source.text:
            return None  # changed while it was checked
    return {name: digest for name, (digest, _) in seen.items()}


def as_before(looked_at: Mapping[str, str]) -> dict[str, bytes] | None:
    """Return the contents of the files, if every place still has its digest."""
    texts: dict[str, bytes] = {}
    for name, digest in looked_at.items():
        now, text = _seen(name)
        if now != digest:
            return None
        if text is not None:
            texts[name] = text
    return texts


def digest_at(name: str) -> str:
    """Return the present digest of a place."""
    return _seen(name)[0]


def _key(paths: tuple[str, ...], options: Options) -> tuple[str, ...]:
    stated = asdict(options)
    stated.pop("jobs", None)  # how many at once changes nothing
    return (os.getcwd(), *paths, "--", *(f"{name}={value}" for name, value in stated.items()))


def _seen(name: str) -> tuple[str, bytes | None]:
    """Return a place's digest and text: of a file and where it really is, of something that is no file, or of nothing.

    A `use` goes to the first place where anything stands, be it a folder or a link to nowhere: these are told from an empty place.
    """
    if not os.path.lexists(name):
        return "absent", None
    try:
        text = content(Path(name), MOST_BYTES)
    except (OSError, Malformed):
        return "no file that can be read", None
    real = os.path.realpath(name)
    elsewhere = "" if real == os.path.abspath(name) else f" at {real}"
    return hashlib.sha256(text).hexdigest() + elsewhere, text
