"""Writes generated files, or says whether they are fresh.

Every file is written whole beside its place and then renamed onto it: after a kill each is the old one or the new one.
"""

from collections.abc import Mapping
from pathlib import Path

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.diagnostics.source import Span
from rcsc.host.files import write_atomically


def write(files: Mapping[str, str], folder: str) -> tuple[Diagnostic, ...]:
    """Write the files under `folder`; what could not be written. Unchanged files are left alone."""
    for name, text in sorted(files.items()):
        path = Path(folder) / name
        try:
            if path.is_file() and path.read_bytes() == text.encode():
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, text.encode())
        except OSError as error:
            message = f"`{path}` cannot be written: {error.strerror}"
            return (Diagnostic(Code.NOT_WRITTEN, message, Label(Span(str(path), 0, 0))),)
    return ()


def stale(files: Mapping[str, str], folder: str) -> tuple[Diagnostic, ...]:
    """Files under `folder` that are missing or differ."""
    found = []
    for name, text in sorted(files.items()):
        path = Path(folder) / name
        try:
            fresh = path.read_bytes() == text.encode()
            message = f"`{path}` is not what the tables say"
        except OSError:
            fresh, message = False, f"`{path}` is missing"
        if not fresh:
            helps = ("run `rcsc compile`",)
            found.append(Diagnostic(Code.STALE, message, Label(Span(str(path), 0, 0)), help=helps))
    return tuple(found)
