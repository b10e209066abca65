"""Who knows what the data of a system means, as the description names it (`data_python = "MODULE:NAME"`), and draws a log with it.

In: a description. Out: what makes its database, shows it, and draws a log with it. A system needs none of it to run: what its levels ask
of the data, the plant answers.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Protocol, cast

from rcsc.run.description import BadDescription, Description, needs_data
from rcsc.run.log.read import Log
from rcsc.run.plant.load import installed
from rcsc.run.signature import Signature


class Drawing(Protocol):
    """A picture of a tick."""

    @property
    def svg(self) -> str:
        """The picture as an SVG document."""
        ...

    @property
    def caption(self) -> tuple[str, ...]:
        """Notes on it, a sentence each."""
        ...


class DrawnCell(Protocol):
    """The world outside the levels of a log."""

    @property
    def data(self) -> str:
        """The name of the file with the places of things."""
        ...

    def drawn(self, tick: int, *, projected: bool = False) -> Drawing:
        """Draw a tick: in perspective alone, or in three projections with it."""
        ...


class Data(Protocol):
    """A user's object that knows the data of a kind of system; every method raises `CodedError` where the data is not in order."""

    def build(
        self, system: Description, signs: Mapping[str, Signature], output: Path | None, *, writes: bool
    ) -> Path:
        """Make the database, at its usual place where none is named; check it, and return its path.

        Args:
            system: Whose data.
            signs: Of its levels.
            output: Where it goes.
            writes: Whether it is made; else it is only checked.
        """
        ...

    def rows(
        self, system: Description, signs: Mapping[str, Signature], database: Path | None
    ) -> Mapping[str, int]:
        """Return the number of rows of each table."""
        ...

    def lines(
        self, system: Description, signs: Mapping[str, Signature], database: Path | None, table: str
    ) -> Iterator[str]:
        """Yield a table for people: its heading, then its rows."""
        ...

    def drawn(self, log: Log, system: Description, signs: Mapping[str, Signature]) -> DrawnCell:
        """Return the world outside the levels, to be drawn from a log."""
        ...


def known(system: Description) -> Data:
    """Return the object that knows the data of a system.

    Raises:
        BadDescription: There is no data, or nobody who knows it.
    """
    needs_data(system)
    page = system.review()
    if not system.data_python:
        page.wrong(
            ("data",),
            "the description does not say who knows its data",
            '`data_python = "MODULE:NAME"` names a Python object',
        )
        raise page.bad(BadDescription)
    found = installed(page, ("data_python",), system.data_python, "write `MODULE:NAME`", BadDescription)
    return cast("Data", found)
