"""A graph to the table that says the same.

In: a `StateGraph`, derived or drawn by hand. Out: the table as a syntax tree and as text in the one layout, and notes on what had to be
named or split; or what is wrong with the guards and effects. A line is what edges of one name, guard and effect say together: the states
from which they come, and the state to which they lead.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from rcsc.base.diagnostics.source import Source
from rcsc.lang.operator_table import NEGATION
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.rows import ACTION_WORDS
from rcsc.lang.syntax.spell import spell_condition, spell_expr
from rcsc.views.graph import labels
from rcsc.views.graph.formats.reading import UnreadableError
from rcsc.views.graph.formats.state_graph import ANY, LINES, Edge, StateGraph, free

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*$")
_WHEN = "when"


@dataclass(frozen=True, slots=True)
class Tabled:
    """A table made of a graph.

    Attributes:
        table: As a declaration.
        uses: As the graph names them.
        notes: Lines that had to be named or split, in sentences.
        begins: The state variable, and its value before the first cycle; empty where the graph does not say it.
    """

    table: tree.TableDecl
    uses: tuple[tree.Use, ...]
    notes: tuple[str, ...]
    begins: tuple[str, str] = ("", "")

    def text(self) -> str:
        """Return the table, and the files it uses, in the one layout."""
        return format_file(tree.File((*self.uses, self.table)))


def tabled(graph: StateGraph) -> Tabled:
    """Return the table of a graph; raise UnreadableError, at its edge, where a guard or an effect is not in the language."""
    if graph.state == LINES:
        raise UnreadableError("this is a graph of lines: only a graph of states says a table")
    for name in (graph.table, *graph.assuming):
        if not _NAME.match(name):
            raise UnreadableError(f"`{name}` is no name of the language")
    notes: list[str] = []
    lines = _named(list(_lines(graph)), graph, notes)
    columns = _Columns.of(graph)
    rows = [columns.row(line) for line in lines]
    text = columns.text(graph, rows)
    parsed = parse(Source("", text))
    if not isinstance(parsed, tree.File):
        raise UnreadableError(f"the table that the graph says is not in the language: {parsed[0].message}")
    [table] = (declaration for declaration in parsed.declarations if isinstance(declaration, tree.TableDecl))
    uses = tuple(tree.Use(path) for path in graph.uses)
    return Tabled(table, uses, tuple(notes), (graph.state, graph.initial))


# --- lines -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Line:
    """A row of the table.

    Attributes:
        sources: The states in which it matches; empty for all.
        target: The state that it goes to by itself; ANY where it stays, or where its actions say it.
    """

    name: str
    edge: Edge
    sources: tuple[str, ...]
    target: str


def _lines(graph: StateGraph) -> Iterator[_Line]:
    """Yield the lines, in the order in which they are drawn."""
    groups: dict[object, list[Edge]] = {}
    for number, edge in enumerate(graph.edges):
        key = (edge.line, edge.guard, edge.effect, edge.default) if edge.line else number
        groups.setdefault(key, []).append(edge)
    for edges in groups.values():
        by_target: dict[str, list[Edge]] = {}
        for edge in edges:
            if not edge.decided:
                stays = edge.target in (ANY, edge.source)
                by_target.setdefault(ANY if stays else edge.target, []).append(edge)
        shown = [
            edge for edge in edges if edge.decided
        ]  # they say where the line matches, and not where it goes
        if shown and len(by_target) > 1:
            what = f"line `{shown[0].line}` has an edge that is `decided`, and edges to several states"
            raise UnreadableError(what, shown[0].offset)
        for target, own in (by_target or {ANY: []}).items():
            sources = tuple(dict.fromkeys(edge.source for edge in (*own, *shown)))
            everywhere = ANY in sources or edges[0].default
            yield _Line(edges[0].line, (own or shown)[0], () if everywhere else sources, target)


def _named(lines: list[_Line], graph: StateGraph, notes: list[str]) -> list[_Line]:
    """Return the lines, each with a name of its own, in the order that the graph gives."""
    taken = {line.name for line in lines if line.name}
    named = []
    for number, line in enumerate(lines):
        twins = [at for at, other in enumerate(lines) if other.name == line.name]
        name = line.name
        if not name:
            name = free(str(number + 1), taken)
            notes.append(f"an edge from `{line.edge.source}` has no line: it is line `{name}` now")
        elif len(twins) > 1:
            name = free(f"{name}{_letter(twins.index(number))}", taken)
            notes.append(f"the edges of line `{line.name}` do not say one thing: there is a line `{name}`")
        taken.add(name)
        named.append(_Line(name, line.edge, line.sources, line.target))
    order = {name: at for at, name in enumerate(graph.lines)}
    originals = [line.name for line in lines]
    ranked = sorted(
        range(len(named)),
        key=lambda at: (bool(named[at].edge.default), order.get(originals[at], len(order)), at),
    )
    return [named[at] for at in ranked]


def _letter(number: int) -> str:
    return chr(ord("a") + number) if number < 26 else f"_{number}"


# --- columns -----------------------------------------------------------------------------


@dataclass(slots=True)
class _Columns:
    """The table's columns; one that the graph does not name comes after those that it does.

    Attributes:
        fixed: Whether the graph names its columns: then a term under none of them goes to `when`.
    """

    graph: StateGraph
    fixed: bool
    conditions: list[str] = field(default_factory=list)
    actions: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, graph: StateGraph) -> "_Columns":
        left, _, right = graph.columns.partition("||")
        conditions, actions = (
            [heading.strip() for heading in side.split("|") if heading.strip()] for side in (left, right)
        )
        return cls(graph, bool(graph.columns), conditions, actions)

    def row(self, line: _Line) -> tuple[_Line, dict[str, str], dict[str, str]]:
        """Return the cells of a line by heading."""
        try:
            conditions: dict[str, str] = {}
            for expr in [*self._state(line), *labels.terms_of(line.edge.guard)]:
                self._condition(expr, conditions)
            actions: dict[str, str] = {}
            for heading, text in [*self._goes(line), *labels.effect_cells(line.edge.effect)]:
                labels.check_actions(heading, text)
                if heading not in self.actions:  # going there comes first: what procedures decide comes after
                    self.actions.insert(0 if heading == "procedures" else len(self.actions), heading)
                before = actions.get(heading)
                actions[heading] = f"{before}; {text}" if before else text
        except labels.WordsError as error:
            raise UnreadableError(f"line `{line.name}`: {error.what}", line.edge.offset) from error
        return line, conditions, actions

    def _state(self, line: _Line) -> list[tree.Expr]:
        if not line.sources:
            return []
        subject = f"{self.graph.state} "
        many = len(line.sources) > 1
        return labels.terms_of(
            subject + (f"in {{{', '.join(line.sources)}}}" if many else f"= {line.sources[0]}")
        )

    def _goes(self, line: _Line) -> list[tuple[str, str]]:
        if line.target == ANY:
            return []
        return [
            ("procedures", f"{'next ' if self.graph.deferred else ''}{self.graph.state} := {line.target}")
        ]

    def _condition(self, expr: tree.Expr, cells: dict[str, str]) -> None:
        """Put a term under its heading, or under `when` where that is taken."""
        parted = labels.cell(expr)
        if parted is not None:
            heading = spell_expr(parted[0])
            known = heading in self.conditions or not self.fixed or heading == self.graph.state
            if known and heading not in cells:
                if heading not in self.conditions:
                    self.conditions.append(heading)
                cells[heading] = spell_condition(parted[1], whole=False)
                return
        if _WHEN not in self.conditions:
            self.conditions.append(_WHEN)
        text = spell_expr(expr, NEGATION)
        cells[_WHEN] = f"{cells[_WHEN]} and {text}" if _WHEN in cells else text

    def text(self, graph: StateGraph, rows: list[tuple[_Line, dict[str, str], dict[str, str]]]) -> str:
        """Return the table as text, in no layout."""
        conditions = self.conditions or [_WHEN]
        ranked = [word for word in self.actions if word in ACTION_WORDS and not self.fixed]
        actions = sorted(ranked, key=("procedures", "command_out", "status_out").index)
        actions += [word for word in self.actions if word not in actions]
        assuming = f" assuming {', '.join(graph.assuming)}" if graph.assuming else ""
        lines = [f"table {graph.table}{assuming} {{", _row(["line", *conditions], actions)]
        for line, tested, done in rows:
            cells = [tested.get(condition, "") for condition in conditions]
            if line.edge.default:
                cells[0] = line.edge.default
            elif not tested and conditions == [_WHEN]:
                cells[0] = "true"
            lines.append(_row([line.name, *cells], [done.get(action, "") for action in actions]))
        return "\n".join([*lines, "}", ""])


def _row(left: list[str], right: list[str]) -> str:
    return f"| {' | '.join(left)} || {' | '.join(right)} |" if right else f"| {' | '.join(left)} ||"
