"""What knows the cell's data: makes and checks its database, shows it, and draws a log with it. Named by `data_python` of the system."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from rcsc.base.host.cache import open_cache
from rcsc.base.host.children import scratch
from rcsc.run.description import Description
from rcsc.run.log.read import Log
from rcsc.run.signature import Signature
from rcsc_cell.cell.reach import checked
from rcsc_cell.database.ask import Listed, open_database, tables_of
from rcsc_cell.database.build import BadData
from rcsc_cell.database.build import build as build_database
from rcsc_cell.database.readable import lines_of
from rcsc_cell.pictures.scene import DrawnCell, cell
from rcsc_cell.workstation.prepared import database_of, database_path, limits_of, parts_of


class CellData:
    """As `rcsc.views.pages.data.Data`."""

    def build(
        self, system: Description, signs: Mapping[str, Signature], output: Path | None, *, writes: bool
    ) -> Path:
        """Build it in a scratch folder, have the arm go everywhere in it, and only then write it."""
        parts, limits = parts_of(signs), limits_of(system, signs)
        target = output or database_path(system)
        with scratch("db") as folder:
            tried = folder / "cell.sqlite"
            build_database(system.database, tried, parts, limits)
            checked(open_database(tried), open_cache(system.database.parent) if writes else None)
        if writes:
            build_database(system.database, target, parts, limits)
        return target

    def rows(
        self, system: Description, signs: Mapping[str, Signature], database: Path | None
    ) -> Mapping[str, int]:
        """How many rows each table has."""
        return {name: len(table.rows) for name, table in _held(system, signs, database).items()}

    def lines(
        self, system: Description, signs: Mapping[str, Signature], database: Path | None, table: str
    ) -> Iterator[str]:
        """Yield a table, with names and units."""
        return lines_of(_held(system, signs, database), table)

    def drawn(self, log: Log, system: Description, signs: Mapping[str, Signature]) -> DrawnCell:
        """The cell of a log.

        Raises:
            BadData: No level names parts, or the robot cannot be at its home.
        """
        try:
            return cell(log, system, database_of(system, signs))
        except (KeyError, StopIteration) as error:
            name = system.review().name
            raise BadData((f"`{name}` has no level `task` that names parts",)) from error


def _held(system: Description, signs: Mapping[str, Signature], database: Path | None) -> dict[str, Listed]:
    database_of(system, signs, database)
    return tables_of(database or database_path(system))


CELL = CellData()
