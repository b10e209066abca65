"""All open files, and what is known of them: the one place that all pages and both lanes share.

In: changes, from the lane `tables`. Out: an event `tables.file/NAME` for every change, and one more when the text was looked at, in the
lane `proof`. A text that changes while it is looked at is given up, and the new one looked at.
"""

import contextlib
import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.cache import FOLDER
from rcsc.base.host.files.read import Malformed, beginning
from rcsc.desk.editor.memo import OutdatedError
from rcsc.desk.editor.values import Answer, Repair
from rcsc.desk.editor.workspace import Checked, Workspace
from rcsc.desk.studio.hub import PROVER, Ask
from rcsc.desk.studio.tables.document import Document
from rcsc.desk.studio.tables.shown import Json, TextFindings, document
from rcsc.lang.project import listed, load, project_root
from rcsc.lang.written.tables import tables_of
from rcsc.run.description import BadDescription, description, places

OUTDATED = 0
"""The version of what is known of a file whose text is the same, but not that of one that it uses."""
Mark: TypeAlias = tuple[int, int, int] | None
PROOF = "proof"
"""The lane in which texts are looked at."""
MOST_FILES = 2_000
MOST_OPEN = 64
"""Files that are open at once."""
CHANGED = "the text was changed meanwhile: nothing was done"
UNSAVED = "unsaved"
"""The folder, beside what else is kept, for texts that nobody had saved when the studio ended."""
MOST_LISTED_BYTES = 300_000
"""Of a file whose tables are listed before it is opened."""


def seen(ask: Ask) -> tuple[str, int]:
    """Return the file that a question is about, and the version of its text that the page has seen."""
    return ask.body.text("file"), ask.body.whole("version", 1, 2**53)


class Desk:
    """Files of one project.

    Attributes:
        workspace: Of the lane `proof` alone.
    """

    def __init__(
        self,
        system: Path,
        tell: Callable[[str, Json], None],
        do: Callable[[str, Callable[[], None]], None],
        first: Path | None = None,
    ) -> None:
        """Take what there is, and look at nothing yet.

        Args:
            system: The description; where there is none, the files are those around where it would be.
            tell: As `Hub.tell`.
            do: Has something done in a lane.
            first: The file, or the folder, that stands before the system's.
        """
        self.system = system.resolve()
        self.root = os.path.realpath(project_root(str(self.system)))
        self.workspace = Workspace()
        self._first = None if first is None else first.resolve()
        self._tell, self._do = tell, do
        self._lock = threading.RLock()
        self._open: dict[str, Document] = {}
        self._known: dict[str, TextFindings] = {}
        self._offered: dict[tuple[str, int, int], tuple[Repair, ...]] = {}
        self._marks: dict[str, Mark] = {}
        self._looked: dict[str, Mark] = {}
        self._closed: dict[str, int] = {}  # the last version of each: a number never stands for two texts

    # --- what there is ---

    def files(self) -> list[Json]:
        """Return every file with tables, their names, and the levels that run them; the file asked for comes first, then the system's."""
        levels = self._levels()
        found: list[dict[str, Any]] = []
        for path in listed([self.root])[:MOST_FILES]:
            names = [each.name for each in tables_of(_glance(path))]
            if names:
                name = self._name(path)
                found.append({"file": name, "tables": names, "levels": levels.get(name, [])})
        order = list(dict.fromkeys(level for each in levels.values() for level in each))
        for each in found:
            each["first"] = self._asked(each["file"])
        return sorted(
            found,
            key=lambda each: (
                not each["first"], min(map(order.index, each["levels"]), default=len(order)), each["file"],
            ),
        )  # fmt: skip

    def _asked(self, name: str) -> bool:
        return self._first is not None and Path(self.root, name).is_relative_to(self._first)

    def _levels(self) -> dict[str, list[str]]:
        """Return, by file, the levels whose program has it, from the top down."""
        found: dict[str, list[str]] = {}
        try:
            specs = description(self.system).levels
        except (BadDescription, OSError):
            return found
        for spec in specs:
            root = next((each for each in places(self.system, spec.source) if each.is_file()), None)
            for file in () if root is None else load([str(root)]).files:
                found.setdefault(self._name(file), []).append(spec.name)
        return found

    def _name(self, path: str) -> str:
        return os.path.relpath(os.path.realpath(path), self.root).replace(os.sep, "/")

    # --- files ---

    def opened(self, name: str) -> Document:
        """Return a file's document; open the file where it is not open.

        Raises:
            Refused: The project has no such file, or it cannot be read.
        """
        with self._lock:
            if name not in self._open:
                path = self._path(name)
                if len(self._open) >= MOST_OPEN:
                    self._forget()
                self._open[name] = Document.opened(path)
                self._open[name].version += self._closed.get(name, 0)
                self._look_soon(name)
            return self._open[name]

    def _path(self, name: str) -> str:
        """Return the path of a file with its one name here: under two names it would have two texts.

        Raises:
            Refused: The project has no such file.
        """
        path = os.path.join(self.root, *name.split("/"))
        odd = "\0" in name or not name.endswith(".rcs")
        if odd or name.startswith("../") or self._name(path) != name or not os.path.isfile(path):
            raise Refused(Code.STUDIO, f"the project has no file `{name}`")
        return os.path.realpath(path)

    def _forget(self) -> None:
        """Close a file without unsaved changes.

        Raises:
            Refused: Every open file has unsaved changes.
        """
        idle = next((name for name, each in self._open.items() if not each.dirty), None)
        if idle is None:
            raise Refused(Code.STUDIO, f"{MOST_OPEN} files are open and not saved", "save some of them")
        gone = self._open.pop(idle)
        self._closed[idle] = gone.version
        self._known.pop(idle, None)
        self._do(PROOF, lambda: self._let_go(idle, gone.file))

    def _let_go(self, name: str, file: str) -> None:
        """Forget the text of a closed file, in the lane `proof`, unless it is open again."""
        with self._lock:
            if name not in self._open:
                self.workspace.close(file)

    def texts(self) -> dict[str, str]:
        """Return the text of every open file, by its path."""
        with self._lock:
            return {each.file: each.text for each in self._open.values()}

    def named(self, path: str) -> str:
        """Return the name of a file of the project by its path.

        Raises:
            Refused: The file is outside the project.
        """
        name = self._name(path)
        if name.startswith("../"):
            raise Refused(Code.STUDIO, f"`{os.path.basename(path)}` is no file of this project")
        return name

    def at(self, name: str, version: int) -> Document:
        """Return an open file whose text is the one that a page has seen.

        Raises:
            Refused: The text has changed.
        """
        found = self.opened(name)
        if found.version != version:
            raise Refused(Code.STUDIO, CHANGED, "look at it, and do it again")
        return found

    def change(self, name: str, make: Callable[[Document], object]) -> Json:
        """Change an open file, tell every page, and queue a check; return the answer for the page that asked.

        Raises:
            Refused: As `make` does; nothing was changed then.
        """
        with self._lock:
            found = self.opened(name)
            before = found.version
            try:
                made = make(found)
            finally:
                if found.version != before:
                    self._outdate(name)
                    self._look_soon(name)
                self.show(name)
            return {"version": found.version, "made": made}

    def show(self, name: str) -> Json:
        """Tell every page of an open file; return the message."""
        with self._lock:
            shown = document(name, self._open[name], self._known.get(name))
        self._tell(f"tables.file/{name}", shown)
        return shown

    def look_at_disk(self) -> None:
        """Take others' writes into open files without changes here, and check again the tables that use what was written.

        A file is looked at once it is as it was the last time: an editor may write it piece by piece.
        """
        with self._lock:
            known = {
                name: self._known[name].files if name in self._known else frozenset() for name in self._open
            }
            using = {name: {each.file, *known[name]} for name, each in self._open.items()}
        marks = {file: _mark(file) for files in using.values() for file in files}
        rested = {
            file for file, mark in marks.items() if self._marks.get(file) == mark != self._looked.get(file)
        }
        self._looked = {file: marks[file] if file in rested else self._looked.get(file) for file in marks}
        self._marks = marks
        for name, files in using.items():
            if files & rested:
                with contextlib.suppress(Refused):  # who looks at it is told
                    self._take_written(name)

    def _take_written(self, name: str) -> None:
        found = self.opened(name)
        if not found.dirty and found.on_disk() == "changed":
            self.change(name, lambda each: each.take_disk())
        self.look_again(name)

    # --- what is known ---

    def _outdate(self, name: str) -> None:
        """Discard the results of open files that use a file whose text has changed."""
        changed = self._open[name].file
        for each, known in list(self._known.items()):
            if each != name and each in self._open and changed in known.files:
                self._known[each] = replace(known, version=OUTDATED)
                self.show(each)

    def look_again(self, name: str) -> None:
        """Check a file again if others wrote into files that it uses, and that are not open."""
        self._do(PROOF, lambda: self._look_if_outdated(name))

    def _look_if_outdated(self, name: str) -> None:
        with self._lock:
            known, found = self._known.get(name), self._open.get(name)
        if known is None or found is None or self.workspace.answered(os.path.normpath(found.file)):
            return
        with self._lock:
            self._known[name] = replace(known, version=OUTDATED)
            self.show(name)
        self._look_at(name)

    def _look_soon(self, name: str) -> None:
        self._do(PROOF, lambda: self._look(name))

    def _look(self, name: str) -> None:
        """Check a file as it is now, in the lane `proof`; also open files that use it."""
        self._look_at(name)
        with self._lock:
            outdated = [each for each in self._open if each in self._known and not self._sure(each)]
        for each in outdated:
            self._look_at(each)

    def _sure(self, name: str) -> bool:
        """Tell whether the cached results of an open file match its current text."""
        known = self._known.get(name)
        return known is not None and known.version == self._open[name].version

    def _look_at(self, name: str) -> None:
        with self._lock:
            found = self._open.get(name)
            if found is None or self._sure(name):
                return
            texts = {each.file: (each.version, each.text) for each in self._open.values()}
        version, file = found.version, found.file
        began = time.perf_counter()
        try:
            with PROVER:
                for path, (_, text) in texts.items():
                    self.workspace.open(path, text)
                answer = self.workspace.check(file, lambda: found.version == version)
                nearest = self.workspace.reading(os.path.normpath(file)).nearest
        except OutdatedError:
            return  # what changed it has the new text looked at
        except Exception as error:  # noqa: BLE001  # it is told, and the next text is looked at all the same
            answer, nearest = self.workspace.given_up(file, error), None
        files = frozenset(map(os.path.realpath, answer.texts))
        with self._lock:
            now = {each.file: each.version for each in self._open.values() if each.file in files}
            same = all(path in texts and texts[path][0] == each for path, each in now.items())
            self._offered = {key: each for key, each in self._offered.items() if key[0] != name}
            if name in self._open:
                seconds = time.perf_counter() - began
                self._known[name] = TextFindings(
                    version if same else OUTDATED, answer, nearest, seconds, files
                )
                self.show(name)

    def known(self, name: str, version: int) -> TextFindings:
        """What is known of the text that a page has seen; looks at it first, where nobody has. In the lane `proof`.

        Raises:
            Refused: The text has changed.
        """
        self.at(name, version)
        self._look_if_outdated(name)
        self._look_at(name)
        return self.still_known(name, version)

    def answered(self, name: str) -> Answer | None:
        """Return the answer to the present text of an open file; None while nobody has checked it."""
        with self._lock:
            known = self._known.get(name) if name in self._open else None
            return known.answer if known is not None and self._sure(name) else None

    def still_known(self, name: str, version: int) -> TextFindings:
        """What is known of the text that a page has seen, and of all that it uses as that is now.

        Raises:
            Refused: A text has changed.
        """
        with self._lock:
            self.at(name, version)
            known = self._known.get(name)
            if known is None or not self._sure(name):
                raise Refused(Code.STUDIO, "a text was changed meanwhile: nothing was done")
            return known

    def checked(self, name: str, version: int) -> Checked:
        """Return the checked text that a page has seen, in the lane `proof`.

        Raises:
            Refused: The text has changed.
        """
        self.known(name, version)
        with PROVER:
            self.workspace.memo.go_on = lambda: True
            return self.workspace.checked(os.path.normpath(self.opened(name).file))

    def repairs(self, name: str, version: int, finding: int) -> tuple[Repair, ...]:
        """Return the repairs of a finding, made and checked once; in the lane `proof`.

        Raises:
            Refused: There is no such finding, or the text is another one by now.
        """
        known = self.known(name, version)
        if not 0 <= finding < len(known.answer.findings):
            raise Refused(Code.STUDIO, "there is no such finding any more")
        key = (name, version, finding)
        if key not in self._offered:
            found = self.opened(name)
            try:
                with PROVER:
                    self.workspace.memo.go_on = lambda: found.version == version
                    offered = self.workspace.repairs(known.answer.findings[finding])
            except OutdatedError as error:
                raise Refused(Code.STUDIO, CHANGED) from error
            with self._lock:
                self._offered[key] = offered
            return offered
        return self._offered[key]

    def keep_unsaved(self) -> list[str]:
        """Save every unsaved text in a file that replaces no other; return a sentence each about the text and its file."""
        folder = Path(self.root, FOLDER, UNSAVED, f"{time.strftime('%Y-%m-%d_%H-%M-%S')}_{os.getpid()}")
        said = []
        for name, each in self.others():
            if not each.dirty:
                continue
            try:
                kept = each.keep(folder.joinpath(*name.split("/")[:-1]))
            except OSError as error:
                said.append(f"{name} was not saved, and could not be kept: {error.strerror}")
            else:
                said.append(f"{name} was not saved: its text is kept in {kept}")
        return said

    def unwritten(self) -> frozenset[str]:
        """Return the real paths of texts that are changed here and not saved."""
        return frozenset(os.path.realpath(each.file) for _, each in self.others() if each.dirty)

    def others(self) -> Iterator[tuple[str, Document]]:
        """Yield every open file."""
        with self._lock:
            yield from list(self._open.items())


def _mark(file: str) -> Mark:
    """Return a mark that changes when somebody writes the file; None where there is no file."""
    try:
        stat = Path(file).stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size, stat.st_ino


def _glance(path: str) -> str:
    """Return the beginning of a file; empty where it cannot be read."""
    try:
        return beginning(Path(path), MOST_LISTED_BYTES).decode(errors="replace")
    except (OSError, Malformed):
        return ""
