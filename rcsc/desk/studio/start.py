"""Where one begins: the tables that are here, those that were opened before, new projects, and what is found in published tables.

In: questions of kind `start.*`. Out: what may be opened, and what the studio is about next: `Next`, with which it is served anew at the
same address. Nothing that is listed here is parsed, proved or run.
"""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.resources.abc import Traversable
from pathlib import Path

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.read import MIB, CheckedFields, Malformed, json_of, plain, text
from rcsc.base.host.trust import state_folder
from rcsc.code.testing.figures import counted
from rcsc.desk.shell.opening import Opening
from rcsc.desk.studio.hub import Ask, Concern, Hub, Json

MOST_RECENT = 8
MOST_FOUND = 60
DEEPEST = 4
MOST_LOOKED_AT = 20_000
"""Folders and files that are looked at for tables."""
_ASIDE = {"venv", "node_modules", "__pycache__", "generated"}
_ROW = re.compile(r"\| `([^`:]+)(?::(\w+))?` \| ([^|]+) \| [^|]* \| ([^|]+) \|")
"""Of the last section of an entry's page: file, table, source, and the finding that matters."""
GOODBYE_S = 0.1
"""An answer is on its way before the studio ends that gave it."""


@dataclass(frozen=True, slots=True)
class Next:
    """What a studio is to be about.

    Attributes:
        opening: The system, or where its description would be.
        first: The file, or the folder, whose tables are shown first; None for the system's.
        agreed: Whether its code may run in this session: rcsc has just written it.
        copy: Whether it is a copy of published tables: it is not remembered, and its levels are
            proved together at once, for what is found in them.
    """

    opening: Opening
    first: Path | None = None
    agreed: bool = False
    copy: bool = False


@dataclass(frozen=True, slots=True)
class Starts:
    """What a page may choose from.

    Attributes:
        here: The folder that the studio was started in.
        templates: By name, what a project may begin with.
        gallery: The folders of published tables, by the names of their entries.
        mean: Finds what a path means; raises `CodedError` where it is nothing that can be opened.
        make: Makes a project, of a template or of an entry of the gallery, in a folder; raises `CodedError` where it cannot.
        scratch: A folder for copies of published tables; it is gone when the studio has ended.
    """

    here: Path
    templates: Mapping[str, str]
    gallery: Mapping[str, Traversable]
    mean: Callable[[Path], Next]
    make: Callable[[Path, str], None]
    scratch: Callable[[], Path]


class Start(Concern):
    """Lists what may be opened, and opens it.

    Attributes:
        chosen: What the studio is to be about next; None where it ends for good.
    """

    name, lane = "start", "start"

    def __init__(self, starts: Starts, opened: str, number: int, hub: Hub, end: Callable[[], None]) -> None:
        """Args: starts: To choose from; opened: What is open; number: How many were before; hub: Of the studio; end: Ends it."""
        self._starts, self._opened, self._number, self._hub, self._end = starts, opened, number, hub, end
        self.chosen: Next | None = None

    def greeting(self) -> Json:
        """Return what is open, and its number: a page of another has to be loaded anew."""
        return {"opened": self._opened, "number": self._number}

    def _on_list(self, ask: Ask) -> Json:
        """Return everything that may be opened or made."""
        recent = [
            {
                "path": path,
                "name": "/".join(Path(path).parts[-2:]),  # of many the last part is system.toml
                "kind": "system" if path.endswith(".toml") else "tables",
            }
            for path in recently()
            if Path(path).exists()
        ]
        return {
            "here": str(self._starts.here),
            "recent": recent,
            "found": list(_found(self._starts.here, ask)),
            "templates": [{"name": name, "text": said} for name, said in self._starts.templates.items()],
            "gallery": [_entry(each) for each in self._starts.gallery.values()],
        }

    def _on_open(self, ask: Ask) -> Json:
        """Open a path: a system, a file of tables, or a folder of either."""
        return self._choose(
            self._starts.mean(self._starts.here / Path(plain(ask.body.text("path"))).expanduser())
        )

    def _on_make(self, ask: Ask) -> Json:
        """Make a project of a template, and open it."""
        kind = ask.body.one_of("template", tuple(self._starts.templates))
        named = plain(ask.body.text("folder").strip())
        if not named:
            raise Refused(Code.STUDIO, "the new project needs a folder", "name one that is not there yet")
        folder = self._starts.here / Path(named).expanduser()
        self._starts.make(folder, kind)
        return self._choose(replace(self._starts.mean(folder), agreed=True))

    def _on_look(self, ask: Ask) -> Json:
        """Open a file of an entry of the gallery, or a system of it whose levels are then proved together; of a copy."""
        entry = ask.body.one_of("entry", tuple(self._starts.gallery))
        file = ask.body.one_of("file", _to_open(self._starts.gallery[entry]))
        folder = self._starts.scratch() / entry
        if not folder.exists():
            self._starts.make(folder, entry)
        meant = self._starts.mean(folder / file)
        return self._choose(replace(meant, agreed=True, copy=True))

    def _choose(self, chosen: Next) -> Json:
        self.chosen = chosen
        self._hub.do(self.lane, self._end, GOODBYE_S)
        return {}


# --- what was opened before ---


def _kept() -> Path:
    return state_folder() / "opened.json"


def recently() -> list[str]:
    """Return the paths that were opened last, the latest first; none where nothing readable was kept."""
    try:
        kept = CheckedFields(json_of(text(_kept(), MIB), plain=False)).value["opened"]
        return [path for path in kept if isinstance(path, str)][:MOST_RECENT]
    except (OSError, Malformed, KeyError, TypeError):
        return []


def remember(path: Path) -> None:
    """Keep a path as the one that was opened last; where that cannot be kept, do without."""
    real = str(path.resolve())
    paths = [real, *(one for one in recently() if one != real)][:MOST_RECENT]
    try:
        _kept().parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_atomically(_kept(), json.dumps({"opened": paths}, indent=1).encode() + b"\n", 0o600)
    except OSError:
        return


# --- what is here ---


def _found(here: Path, ask: Ask) -> Iterator[Json]:
    """Yield the systems below a folder, and the folders with tables, the nearest first."""
    waiting, looked_at, told = [(here, 0)], 0, 0
    while waiting and told < MOST_FOUND and looked_at < MOST_LOOKED_AT:
        ask.check()
        folder, depth = waiting.pop(0)
        try:
            inside = sorted(folder.iterdir())
        except OSError:
            continue
        looked_at += len(inside)
        waiting += [
            (one, depth + 1)
            for one in inside
            if depth < DEEPEST and one.name not in _ASIDE and not one.name.startswith(".") and one.is_dir()
        ]
        tables = [one for one in inside if one.suffix == ".rcs"]
        systems = [one for one in inside if _is_system(one)]
        for one in systems or ([folder] if tables else []):
            name = str(one.relative_to(here))
            kind = "system" if one.suffix == ".toml" else "tables"
            files = counted(len(tables), "file") if kind == "tables" else ""
            yield {"path": str(one), "name": name, "kind": kind, "files": files}
            told += 1


def _is_system(path: Path) -> bool:
    """Tell whether a file describes a system, by its text."""
    if path.suffix != ".toml":
        return False
    try:
        return re.search(r"^\[\[level\]\]", text(path, MIB), re.MULTILINE) is not None
    except (OSError, Malformed):
        return False


# --- published tables ---


def _to_open(entry: Traversable) -> tuple[str, ...]:
    """Return the files of an entry that can be opened: tables, then systems."""
    names = sorted(each.name for each in entry.iterdir() if each.name.endswith((".rcs", ".toml")))
    return tuple(sorted(names, key=lambda name: name.endswith(".toml")))


def _entry(entry: Traversable) -> Json:
    """Return what an entry's page says of its tables, and which systems it has."""
    page = (entry / "README.md").read_text(encoding="utf-8")
    title = page.partition("\n")[0].lstrip("# ")
    rows = [
        {"file": file, "source": source.strip(), "finding": finding.strip()}
        for file, _, source, finding in _ROW.findall(page)
    ]
    systems = [name for name in _to_open(entry) if name.endswith(".toml")]
    return {"name": entry.name, "title": title, "rows": rows, "systems": systems}
