"""What pages do to open files: the concern `tables`.

In: questions of kind `tables.*`. Out: answers; the file itself comes as an event to every page. Every change names the version of the text
that the page has seen, so that nobody changes what he has not seen.
"""

from collections.abc import Callable, Mapping, Sequence

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.read import CheckedFields
from rcsc.desk.editor import keys
from rcsc.desk.editor.places import Area, Edit, Lines, Place, Units
from rcsc.desk.studio.hub import Ask, Concern, Json
from rcsc.desk.studio.tables import cells
from rcsc.desk.studio.tables.desk import Desk, seen
from rcsc.desk.studio.tables.document import MOST_BYTES, Document, plain
from rcsc.lang.written.tables import table_of

LOOKED_S = 0.5
"""So often is looked whether others wrote into the files that are open."""
MOST_EDITS = 1_000
MOST_NEW = 200
"""Lines that a paste may add: each is read back from the text."""
MOST_LINES = 1_000_000
"""Lines and columns of a text that a page may name."""
KEYS: Mapping[str, tuple[keys.Act, str]] = {
    "next": (keys.next_cell, "go to the next cell"),
    "previous": (keys.previous_cell, "go to the cell before"),
    "line": (keys.add_row, "insert a line"),
    "column": (keys.insert_column, "insert a column"),
    "align": (keys.keep_aligned, "align the columns"),
}
"""What keys do in tables of a text, and what that is called where it is undone."""


class Tables(Concern):
    """Opens, changes and saves files; in the lane `tables`, which waits for no proof."""

    name, lane = "tables", "tables"

    def __init__(
        self,
        desk: Desk,
        part: Callable[[str], None],
        later: Callable[[Callable[[], None], float], None],
    ) -> None:
        """Take the open files.

        Args:
            desk: The open files.
            part: Has something said once the studio has ended.
            later: Has something done in this lane after so many seconds.
        """
        self._desk, self._part, self._later = desk, part, later

    def greeting(self) -> Json:
        """Return the files that have tables."""
        return {"files": self._desk.files()}

    def begin(self) -> None:
        """Watch the disk from now on, where another editor may write."""
        try:
            self._desk.look_at_disk()
        finally:
            self._later(self.begin, LOOKED_S)

    def close(self) -> None:
        """Keep the unsaved texts."""
        for said in self._desk.keep_unsaved():
            self._part(said)

    def _on_list(self, _: Ask) -> Json:
        return self._desk.files()

    def _on_open(self, ask: Ask) -> Json:
        """Open a file; one without changes here is read again if others changed it."""
        name = ask.body.text("file")
        found = self._desk.opened(name)
        disk = found.on_disk()
        if disk == "changed" and not found.dirty:
            self._desk.change(name, lambda each: each.take_disk())
            disk = "same"
        self._desk.look_again(name)
        return self._desk.show(name) | {"disk": disk}

    def _changed(self, ask: Ask, make: Callable[[Document], tuple[str, str]]) -> Json:
        """Replace a file's text by the one that `make` returns, with the name of the change."""

        def change(found: Document) -> object:
            text, what = make(found)
            if found.bytes_of(text) > MOST_BYTES:
                raise Refused(Code.STUDIO, f"a text of more than {MOST_BYTES} bytes")
            return found.replace(text, what)

        return self._done(ask, change)

    def _done(self, ask: Ask, change: Callable[[Document], object]) -> Json:
        """Do a change to the text that the page has seen, and to no other."""
        name, version = seen(ask)

        def of_that(found: Document) -> object:
            self._desk.at(name, version)
            return change(found)

        return self._desk.change(name, of_that)

    def _on_edit(self, ask: Ask) -> Json:
        """Make edits of the text, as they are typed."""
        given = list(ask.body.each("edits", MOST_EDITS))

        def make(found: Document) -> tuple[str, str]:
            lines = Lines(found.text)
            edits = [_edit_of(found.file, lines, each) for each in given]
            return found.edited(edits), "type"

        return self._changed(ask, make)

    def _on_cells(self, ask: Ask) -> Json:
        """Write cells, from a corner on: one, or a rectangle that was pasted; lines that are missing are added."""
        table = ask.body.text("table")
        line, column = ask.body.whole("line", -1, MOST_LINES), ask.body.whole("column", -1, MOST_LINES)
        rows = list(map(_row, ask.body.each("rows", cells.MOST_CELLS)))
        what = "write a cell" if len(rows) == 1 and len(rows[0]) == 1 else "paste"

        def make(found: Document) -> tuple[str, str]:
            many, _ = _lines_of(found.text, table)
            if line > many or line + len(rows) > many + MOST_NEW:
                raise Refused(Code.STUDIO, f"table `{table}` has {many} lines, and takes {MOST_NEW} at once")
            text = _longer(
                found.text, table, line + len(rows) + _over_default(found.text, table, line, column, rows)
            )
            changes = {
                (line + down, column + right): new
                for down, row in enumerate(rows)
                for right, new in enumerate(row)
                if new is not None
            }
            return cells.with_cells(text, table, changes), what

        return self._changed(ask, make)

    def _on_line(self, ask: Ask) -> Json:
        """Insert a line."""
        table, at = ask.body.text("table"), ask.body.whole("at", 0, MOST_LINES)
        return self._changed(ask, lambda found: (cells.with_line(found.text, table, at), "insert a line"))

    def _on_delete(self, ask: Ask) -> Json:
        """Delete lines, or a column."""
        table = ask.body.text("table")
        if "column" in ask.body.value:
            at = ask.body.whole("column", 0, MOST_LINES)
            return self._changed(
                ask, lambda found: (cells.without_column(found.text, table, at), "delete a column")
            )
        lines = [each.whole("line", 0, MOST_LINES) for each in ask.body.each("lines", cells.MOST_CELLS)]
        many = "delete a line" if len(lines) == 1 else f"delete {len(lines)} lines"
        return self._changed(ask, lambda found: (cells.without_lines(found.text, table, lines), many))

    def _on_column(self, ask: Ask) -> Json:
        """Insert a column."""
        table, at = ask.body.text("table"), ask.body.whole("at", 0, MOST_LINES)
        heading, action = ask.body.text("heading"), ask.body.flag("action")
        return self._changed(
            ask,
            lambda found: (
                cells.with_column(found.text, table, at, heading, action=action),
                "insert a column",
            ),
        )

    def _on_key(self, ask: Ask) -> Json:
        """Do what a key does in a table of the text; return the cursor, null where it is in none."""
        key = ask.body.text("key")
        at = Place(ask.body.whole("line", 0, MOST_LINES), ask.body.whole("column", 0, MOST_LINES))
        if key not in KEYS:
            raise Refused(Code.STUDIO, f"no key is called `{key}`")
        act, what = KEYS[key]
        cursor: list[int] | None = None

        def make(found: Document) -> tuple[str, str]:
            nonlocal cursor
            moved = act(found.text, Lines(found.text).offset(at, Units.UTF_16))
            if moved is None:
                return found.text, what
            after = Lines(moved.text).place(moved.offset, Units.UTF_16)
            cursor = [after.line, after.column]
            return moved.text, what

        return self._changed(ask, make) | {"cursor": cursor}

    def _on_undo(self, ask: Ask) -> Json:
        return self._done(ask, Document.undo)

    def _on_redo(self, ask: Ask) -> Json:
        return self._done(ask, Document.redo)

    def _on_save(self, ask: Ask) -> Json:
        """Write a file; report whether it was laid out."""
        over = ask.body.flag("over")
        return self._desk.change(ask.body.text("file"), lambda found: found.save(over=over))

    def _on_take(self, ask: Ask) -> Json:
        return self._done(ask, Document.take_disk)


def _row(fields: CheckedFields) -> list[str | None]:
    """Return a row of cells that a page sent, a `text` each; None, for one without, leaves a cell as it is."""
    sent = fields.each("cells", cells.MOST_CELLS)
    return [each.text("text") if "text" in each.value else None for each in sent]


def _edit_of(file: str, lines: Lines, given: CheckedFields) -> Edit:
    def place(key: str) -> Place:
        at = Place(given.whole(f"{key}_line", 0, MOST_LINES), given.whole(f"{key}_column", 0, MOST_LINES))
        return lines.place(lines.offset(at, Units.UTF_16))

    start, end = place("start"), place("end")
    if end < start:
        raise Refused(Code.STUDIO, "an edit begins before it ends")
    return Edit(Area(file, start, end), plain(given.text("text")))


def _longer(text: str, table: str, least: int) -> str:
    """Return the text with at least so many lines in its table; new ones come before a DEFAULT line, which is the last."""
    while True:
        many, default = _lines_of(text, table)
        if many >= least or many + default >= least + cells.MOST_CELLS:
            return text
        text = cells.with_line(text, table, many - default)


def _over_default(text: str, table: str, line: int, column: int, rows: Sequence[Sequence[str | None]]) -> int:
    """Return 1 where a paste begins above a DEFAULT line, brings none, and would write over it: its lines go before that one; else 0."""
    many, default = _lines_of(text, table)
    firsts = [row[-column] for row in rows if 0 <= -column < len(row)]
    over = default and line < many - 1 < line + len(rows) and len(firsts) > many - 1 - line
    return int(
        bool(over)
        and any(firsts)
        and not any(first is None or first.startswith("DEFAULT") for first in firsts)
    )


def _lines_of(text: str, table: str) -> tuple[int, int]:
    """Return the number of a table's lines, and 1 if the last is DEFAULT, else 0."""
    found = table_of(text, table)
    if found is None:
        raise Refused(Code.STUDIO, f"the text has no table `{table}`")
    sheet = cells.sheet_of(found)
    last: Sequence[str] = sheet.cells[-1] if sheet.cells else ()
    return len(sheet.stubs), int(bool(last) and last[0].startswith("DEFAULT"))
