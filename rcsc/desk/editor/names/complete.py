"""What could be written at a place: values under a heading by its type, names elsewhere by what stands before.

In: the names of the files, and the tables of the text as written. Out: offers, the likely ones first. A half-written row has columns, too.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.desk.editor.grid import type_text
from rcsc.desk.editor.names.find import Names
from rcsc.desk.editor.names.index import Space
from rcsc.desk.editor.names.tokens import KEYWORDS
from rcsc.desk.editor.places import Lines
from rcsc.desk.editor.values import Grid, GridColumn
from rcsc.lang.expressions.scope import INMODE
from rcsc.lang.model import Bool, Enum, Int, Program, Real, Record, Type, spell, unit_text
from rcsc.lang.syntax import tree
from rcsc.lang.written.tables import RowText, cells_of, tables_of

MOST = 400
"""Offers at once; who types on gets fewer."""
DECLARATIONS = (
    "use", "unit", "const", "set", "enum", "type", "record", "input", "state", "output", "assume", "invariant", "property",
    "requirement", "procedure", "module", "extern", "owner", "table", "link", "serves", "commands", "adopt", "level",
)  # fmt: skip
TYPES = ("bool", "int", "real", "single", "array")
_FIELD = re.compile(r"([A-Za-z_][\w.\[\]]*)\.\w*$", re.ASCII)
_TYPE = re.compile(
    r"^\s*(?:(?:input|state|output|type|set|local|stream|reason)\s+)?\w+\s*[:=]\s*(?:array\s*\[[^]]*\]\s*of\s+)?\w*$",
    re.ASCII,
)
_FUNCTIONS = ("abs", "min", "max", "count", "int", "real", "single")


@dataclass(frozen=True, slots=True)
class Offer:
    """A completion.

    Attributes:
        kind: `member`, `variable`, `constant`, `procedure`, `type`, `field`, `table`, `claim`, `keyword`, `value`, `file`, `line`, `unit`.
        detail: Its type or what it belongs to.
    """

    label: str
    kind: str
    detail: str = ""
    doc: str = ""


def offers(names: Names, grids: Mapping[str, Grid], file: str, offset: int) -> tuple[Offer, ...]:
    """Return the completions at an offset.

    Args:
        names: The files.
        grids: The tables of this file, by name.
        file: The file.
        offset: Where.
    """
    text = names.sources[file].text
    begin = max(text.rfind("\n", 0, offset), text.rfind("\r", 0, offset)) + 1
    before = text[begin:offset]
    if "#" in before:
        return ()
    complete = _Complete(names, grids, file)
    found = complete.in_table(text, offset) if before.lstrip().startswith("|") else complete.outside(before)
    return tuple(dict.fromkeys(found))[:MOST]


@dataclass(slots=True)
class _Complete:
    names: Names
    grids: Mapping[str, Grid]
    file: str

    @property
    def program(self) -> Program | None:
        """The program, as far as it is known."""
        return self.names.program

    # --- in tables ---

    def in_table(self, text: str, offset: int) -> Iterator[Offer]:
        """Yield the completions in a cell."""
        table = next((each for each in tables_of(text) if each.start <= offset <= each.end), None)
        row = (
            None
            if table is None
            else next((each for each in table.rows if each.start <= offset <= each.past), None)
        )
        if table is None or row is None:
            return
        at = row[: offset - row.start].count("|") - 1  # `||` counts twice
        after = "||" in row[: offset - row.start]
        at -= after
        grid = self.grids.get(table.name)
        columns = () if grid is None else grid.columns
        heads = [part.heading for part in table.parts]
        if any(row in head for head in heads):
            yield from self.expression() if table.turned and after else self.heading(after)
            return
        part = next((part for part in table.parts if any(row in line for line in part.lines)), None)
        if part is None:
            return
        if at == 0:
            yield from (Offer(word, "keyword") for word in ("above", "same", "all"))
            yield from (
                Offer(line.name, "line", f"of table {table.name}") for line in (grid.rows if grid else ())
            )
            return
        if field := _FIELD.search(row[: offset - row.start]):
            yield from self.fields(field[1])
            return
        column = self.column(columns, part.heading, at)
        yield from self.cell(column, after, first=at == 1)

    def column(self, columns: Sequence[GridColumn], heading: Sequence[RowText], at: int) -> GridColumn | None:
        """Return the column of a cell, by the place of its heading."""
        cells = cells_of(heading[0]).all
        if at >= len(cells):
            return None
        place = Lines(self.names.sources[self.file].text).place(cells[at].start)
        return next((each for each in columns if each.areas[0].start == place), None)

    def heading(self, after: bool) -> Iterator[Offer]:
        """Yield the completions of a heading."""
        words = ("procedures", "command_out", "status_out", "req") if after else ("when",)
        yield from (Offer(word, "keyword") for word in words)
        for declared in self.program.declared if self.program else ():
            if after and declared.kind.value == "input":
                continue
            yield Offer(declared.name, "variable", _typed(declared.type), declared.doc)

    def cell(self, column: GridColumn | None, after: bool, *, first: bool) -> Iterator[Offer]:
        """Yield the completions under a heading."""
        if column is not None and column.kind == "procedures":
            yield from self.procedures()
            return
        if column is not None and column.heading in {"command_out", "status_out"}:
            yield from self.orders()
            return
        kind = None if column is None else self.kind(column)
        if kind is not None:
            yield from _values(kind, negated=not after)
        if not after:
            yield Offer("in {", "keyword", "one of several")
            if first:
                yield from (Offer(word, "keyword") for word in ("DEFAULT", "DEFAULT unreachable"))
        yield from self.variables(kind)
        if kind is None:
            yield Offer(INMODE, "keyword", "what the row says in its first column")
            yield from self.members()

    def kind(self, column: GridColumn) -> Type | None:
        """Return the type under a heading."""
        if self.program is None:
            return None
        leaf = next((each.type for each in self.program.variables if each.name == column.heading), None)
        if leaf is not None:
            return leaf
        return next((each.type for each in self.program.declared if each.name == column.heading), None)

    # --- elsewhere ---

    def outside(self, before: str) -> Iterator[Offer]:
        """Yield the completions after the beginning of a line."""
        if field := _FIELD.search(before):
            yield from self.fields(field[1])
        elif not before.strip() or re.fullmatch(r"\s*\w+", before):
            yield from (Offer(word, "keyword") for word in DECLARATIONS)
            yield from self.inner()
        elif re.match(r"\s*use\s", before):
            yield from self.files()
        elif "[" in before.rpartition("]")[2]:
            yield from (Offer(name, "unit") for name in self.declared(Space.UNIT))
            yield from self.expression()
        elif re.search(r"\bassuming\b[^{]*$", before):
            yield from (Offer(name, "claim") for name in self.declared(Space.CLAIM))
        elif re.match(r"\s*(preprocess|postprocess|owner)\b", before):
            yield from self.procedures()
        elif re.match(r"\s*table\s+\w*$", before):
            yield from (Offer(name, "table") for name in self.declared(Space.TABLE))
        elif re.match(r"\s*(serves|commands)\s+\w+\s*:", before):
            yield from (Offer(name, "type", "link") for name in self.declared(Space.LINK))
        elif _TYPE.match(before) and ":=" not in before:
            yield from (Offer(word, "type") for word in TYPES)
            yield from (Offer(name, "type") for name in self.declared(Space.TYPE))
        else:
            yield from self.expression()

    def inner(self) -> Iterator[Offer]:
        """Yield the words that begin a line inside braces."""
        yield from (
            Offer(word, "keyword")
            for word in ("if", "case", "for", "local", "next", "else", "period", "preprocess", "postprocess")
        )
        yield from self.procedures()
        yield from self.variables(None)

    def expression(self) -> Iterator[Offer]:
        """Yield the completions in an expression."""
        yield from self.variables(None)
        yield from self.members()
        yield from (Offer(word, "procedure", "function") for word in _FUNCTIONS)
        yield from (
            Offer(word, "keyword")
            for word in sorted(KEYWORDS & {"and", "or", "not", "implies", "in", "was", "true", "false"})
        )

    def fields(self, base: str) -> Iterator[Offer]:
        """Yield the parts of the expression before a dot."""
        kind: Type | None = None
        for declared in self.program.declared if self.program else ():
            if declared.name == base.partition(".")[0].partition("[")[0]:
                kind = declared.type
        for part in base.split(".")[1:]:
            inner = kind.fields if isinstance(kind, Record) else ()
            kind = next((each.type for each in inner if each.name == part), None)
        if isinstance(kind, Record):
            yield from (Offer(each.name, "field", _typed(each.type), each.doc) for each in kind.fields)
        for enum in self.program.enums if self.program else ():
            if enum.name == base:
                yield from (Offer(member, "member", enum.name) for member in enum.members)

    def files(self) -> Iterator[Offer]:
        """Yield the files that could be used."""
        folder = os.path.dirname(self.file)
        for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else ():
            if name.endswith(".rcs") and name != os.path.basename(self.file):
                yield Offer(name.removesuffix(".rcs"), "file")

    def procedures(self) -> Iterator[Offer]:
        """Yield procedures and owners."""
        for each in self.names.every():
            if each.declares and each.space is Space.CALL:
                params = (
                    [param.name.text for param in each.node.params]
                    if isinstance(each.node, tree.ProcedureDecl)
                    else []
                )
                doc = " ".join(getattr(each.node, "doc", ()))
                yield Offer(each.text, "procedure", f"({', '.join(params)})" if params else "", doc)
        for made in self.program.procedures if self.program else ():
            yield Offer(str(made.name), "procedure", "", made.doc)

    def orders(self) -> Iterator[Offer]:
        """Yield commands, statuses and neighbours of the links."""
        types = {
            name.text
            for file in self.names.files.values()
            for link in file.declarations
            if isinstance(link, tree.LinkDecl)
            for name in (link.command, link.status)
        }
        for enum in self.program.enums if self.program else ():
            if enum.name in types:
                yield from (Offer(member, "member", enum.name) for member in enum.members)
        yield from (Offer(f"{name} := ", "variable", "to whom") for name in self.declared(Space.PEER))

    def variables(self, kind: Type | None) -> Iterator[Offer]:
        """Yield variables and constants, those of the type alone where one is known."""
        for declared in self.program.declared if self.program else ():
            alike = kind is None or isinstance(declared.type, Record) or type(declared.type) is type(kind)
            if alike and (
                not isinstance(kind, Enum) or declared.type == kind or isinstance(declared.type, Record)
            ):
                yield Offer(declared.name, "variable", _typed(declared.type), declared.doc)
        for each in self.names.every():
            if (
                each.declares
                and each.space is Space.VALUE
                and isinstance(each.node, tree.ConstDecl | tree.SetDecl)
            ):
                yield Offer(each.text, "constant")

    def members(self) -> Iterator[Offer]:
        """Yield the members of all enumerations, those of other levels' variables too."""
        program = self.program
        leaves = (each.type for each in program.variables if isinstance(each.type, Enum)) if program else ()
        for enum in dict.fromkeys((*program.enums, *leaves)) if program else ():
            yield from (Offer(member, "member", enum.name) for member in enum.members)

    def declared(self, space: Space) -> list[str]:
        """Return the names declared in a space."""
        return list(
            dict.fromkeys(each.text for each in self.names.every() if each.declares and each.space is space)
        )


def _values(kind: Type, *, negated: bool) -> Iterator[Offer]:
    """Yield the values of a type, as a cell has them."""
    match kind:
        case Bool():
            yield from (Offer(word, "value", "bool") for word in ("true", "false"))
        case Enum(name, members):
            yield from (Offer(member, "member", name) for member in members)
            if negated:
                yield from (Offer(f"/= {member}", "member", f"any other {name}") for member in members)
        case Int() | Real():
            low, high = spell(kind, kind.low), spell(kind, kind.high)
            yield from (Offer(word, "value", _typed(kind)) for word in dict.fromkeys((low, high)))
            if negated:
                words = (f"{low} .. {high}", f"<= {high}", f">= {low}", "/= ")
                yield from (Offer(word, "value", _typed(kind)) for word in words)
        case _:
            pass


def _typed(kind: Type) -> str:
    unit = unit_text(getattr(kind, "unit", ()))
    return f"{type_text(kind)} [{unit}]" if unit else type_text(kind)
