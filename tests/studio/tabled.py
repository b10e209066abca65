"""A desk without a server: questions answered at once, and texts looked at where the test says so."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcsc.base.host.files.read import CheckedFields
from rcsc.desk.studio.hub import Ask
from rcsc.desk.studio.tables.desk import Desk
from rcsc.desk.studio.tables.editing import Tables
from rcsc.desk.studio.tables.proving import Graphs, Proof
from rcsc.desk.studio.tables.writing import Writing

if TYPE_CHECKING:
    from collections.abc import Callable


class Bench:
    """The concerns of tables for a folder.

    Attributes:
        told: The latest event of each kind.
    """

    def __init__(self, system: Path) -> None:
        self.told: dict[str, Any] = {}
        self._waiting: list[Callable[[], None]] = []
        self.desk = Desk(system, self.told.__setitem__, lambda _, work: self._waiting.append(work))
        self._handlers = {
            **Tables(self.desk, lambda _: None, lambda *_: None).handlers,
            **Proof(self.desk).handlers,
            **Graphs(self.desk).handlers,
            **Writing(self.desk).handlers,
        }

    def ask(self, kind: str, **body: Any) -> Any:
        """An answer; Refused or Malformed where it is refused."""
        return self._handlers[kind](Ask(CheckedFields(body, kind), lambda _: None, lambda _: None))

    def look(self) -> None:
        """Do what waits in the lane of proofs."""
        while self._waiting:
            self._waiting.pop(0)()

    def open(self, file: str) -> Any:
        """A file, looked at."""
        self.ask("tables.open", file=file)
        return self.doc(file)

    def doc(self, file: str) -> Any:
        """A file as every page has it, looked at."""
        self.look()
        return self.told[f"tables.file/{file}"]

    def now(self, kind: str, file: str, **body: Any) -> Any:
        """An answer about a file as it is."""
        return self.ask(kind, file=file, version=self.told[f"tables.file/{file}"]["version"], **body)

    def change(self, kind: str, file: str, **body: Any) -> Any:
        """Change a file as it is; how it is then."""
        self.now(kind, file, **body)
        return self.doc(file)


def rows(*cells: list[str]) -> list[dict[str, Any]]:
    """Cells as a page sends them."""
    return [{"cells": [{"text": text} for text in row]} for row in cells]
