"""Who knows what the data of a system means, as the description names it: `data_python = "MODULE:NAME"`.

In: a description. Out: what makes its database, shows it, and draws a log with it. A system needs none of it to run: what its levels ask
of the data, the plant answers.
"""

import importlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Protocol, cast

from rcsc.pages.drawn import Cell
from rcsc.run.description import NO_DATA, BadDescription, Description
from rcsc.run.log.read import Log
from rcsc.run.signature import Signature


class Data(Protocol):
    """What knows the data of a kind of system; every method raises `CodedError` where the data is not in order."""

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
        """How many rows each table has."""
        ...

    def lines(
        self, system: Description, signs: Mapping[str, Signature], database: Path | None, table: str
    ) -> Iterator[str]:
        """Yield a table for people: its heading, then its rows."""
        ...

    def drawn(self, log: Log, system: Description, signs: Mapping[str, Signature]) -> Cell:
        """What stands outside the levels, drawn of a log."""
        ...


def known(system: Description) -> Data:
    """Return who knows the data of a system.

    Raises:
        BadDescription: There is no data, or nobody who knows it.
    """
    page = system.review()
    if system.database.name == NO_DATA:
        page.wrong(("data",), "the description names no `data`, of which the database would be made")
        raise page.bad(BadDescription)
    module, _, attribute = system.data_python.partition(":")
    if not module:
        page.wrong(
            ("data",),
            "the description does not say who knows its data",
            '`data_python = "MODULE:NAME"` names a Python object',
        )
        raise page.bad(BadDescription)
    try:
        return cast("Data", getattr(importlib.import_module(module), attribute))
    except ModuleNotFoundError as error:
        if error.name is not None and not module.startswith(error.name):
            raise  # a package of an extra, which says so itself
        wrong: Exception = error
    except (AttributeError, ValueError, TypeError) as error:
        wrong = error
    page.wrong(("data_python",), f"`{system.data_python}` cannot be imported: {wrong}", "write `MODULE:NAME`")
    raise page.bad(BadDescription) from wrong
