"""Keep the sources of what runs, from before anybody edits them.

In: a root file. Out: `KeptSources`, and the same files laid out elsewhere.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.lang.project import PROJECT_FILE, load, project_root


@dataclass(frozen=True, slots=True)
class KeptSources:
    """A root file and all that it uses.

    Attributes:
        root: The root file below the project's folder.
        texts: Contents by path below the project's folder; the project's own file, too.
    """

    root: str
    texts: Mapping[str, bytes]


def kept(source: Path) -> KeptSources:
    """The texts as they are now, of exactly the files that a check reads; what cannot be read is left out."""
    project = os.path.abspath(project_root(str(source)))
    texts = {_below(name, project): file.text.encode() for name, file in load([str(source)]).sources.items()}
    return KeptSources(_below(str(source), project), {PROJECT_FILE: b"", **texts})


def _below(file: str, project: str) -> str:
    """Return the path below the project's folder, by names or else by links; the whole path of a file elsewhere."""
    whole = os.path.abspath(file)
    folder, name = os.path.split(whole)
    for path, above in (
        (whole, project),
        (os.path.join(os.path.realpath(folder), name), os.path.realpath(project)),
    ):
        if os.path.commonpath((path, above)) == above:
            return os.path.relpath(path, above)
    return whole


@contextmanager
def laid_out(held: KeptSources) -> Iterator[Path]:
    """Write the files to a temporary folder, and give the root file there."""
    with scratch("reload") as place:
        for name, text in held.texts.items():
            if os.path.isabs(name):
                continue
            path = place / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
        yield place / held.root
