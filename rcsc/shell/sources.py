"""The sources of what runs, kept from before anybody edits them: what a running table says, when its file says something else.

In: a root file. Out: `Kept`, and the same files laid out elsewhere.
"""

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rcsc.children import scratch
from rcsc.project import PROJECT_FILE, project_root

# A line that uses a file; whether it is in order is for whoever reads the file.
_USE = re.compile(rb"^[ \t]*use[ \t]+([A-Za-z_]\w*(?:/[A-Za-z_]\w*)*)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Kept:
    """A root file and all that it uses.

    Attributes:
        root: The root file below the project's folder.
        texts: Contents by path below the project's folder; the project's own file, too.
    """

    root: str
    texts: Mapping[str, bytes]


def kept(source: Path) -> Kept:
    """The texts as they are now; what cannot be read is left out."""
    project = Path(project_root(str(source)))
    texts: dict[str, bytes] = {}
    waiting = [source]
    while waiting:
        file = waiting.pop()
        name = os.path.relpath(file, project)
        if name in texts:
            continue
        try:
            texts[name] = file.read_bytes()
        except OSError:
            continue
        for use in _USE.findall(texts[name]):
            waiting += [base / f"{use.decode()}.rcs" for base in (file.parent, project)]
    settings = project / PROJECT_FILE
    texts[PROJECT_FILE] = settings.read_bytes() if settings.is_file() else b""
    return Kept(os.path.relpath(source, project), texts)


@contextmanager
def laid_out(held: Kept) -> Iterator[Path]:
    """The root file among the others, in a folder that is gone afterwards."""
    with scratch("reload") as place:
        for name, text in held.texts.items():
            path = place / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
        yield place / held.root
