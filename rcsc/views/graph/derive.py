"""A table's graph, derived from what its lines mean: of its states, or of its lines.

In: a program and one of its tables, as written too. Out: a `StateGraph`, and notes on what the graph does not hold; or why there is
none. Which line leads from which state to which is answered by Z3 (`relation.steps`), and so is which line can match in the cycle after
which (`relation.follow`); the words on the edges are the table's own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.lang.leaves import may_write
from rcsc.lang.model import Action, Assign, Default, Enum, Kind, Line, Program, Table, Value, Variable, spell
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_condition, spell_expr
from rcsc.proof.relation.follow import Follow, following
from rcsc.proof.relation.steps import Step, Steps, is_few
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import UndecidedError
from rcsc.views.graph import labels
from rcsc.views.graph.formats.state_graph import ANY, LINES, Edge, StateGraph

MOST_DRAWN = 2 / 3
"""A line that can follow more than this share of the lines is drawn from every line."""


@dataclass(frozen=True, slots=True)
class Derived:
    """A table's graph.

    Attributes:
        everywhere: Terms of every edge that leaves a single state; they are left out of `shown`.
        lost: Parts of the table that the graph does not hold, in sentences; no proof rests on them.
    """

    graph: StateGraph
    everywhere: str = ""
    lost: tuple[str, ...] = ()


def derive(
    program: Program, table: Table, file: tree.File, options: Options, state: str = ""
) -> Derived | Diagnostic:
    """Derive the graph of a table.

    Args:
        program: The program that runs the table.
        table: One of its tables.
        file: The file that declares the table.
        options: Limits of the solver.
        state: The variable whose values are the states; "" for `cur_state`, else the only one that fits.
    """
    chosen = _state(program, table, state)
    if isinstance(chosen, Diagnostic):
        return chosen
    written = labels.written_of(file, table)
    try:
        with smt.together(options.drawn):
            return _Derivation(
                program, table, file, written, Steps(program, table, chosen, options)
            ).derived()
    except smt.troubles():
        return _undecided(table, f"the steps of table `{table.name}` are")


def _undecided(table: Table, what: str) -> Diagnostic:
    message = f"{what} not decided within the limits"
    return Diagnostic(Code.UNDECIDED, message, Label(table.span), help=("raise `--steps`",))


def _state(program: Program, table: Table, wanted: str) -> Variable | Diagnostic:
    """Return the variable whose values are the states."""
    fit = [
        v
        for v in program.variables
        if v.kind is Kind.STATE
        and not v.name.endswith(".next")
        and v.previous_of is None
        and v.counts is None
        and is_few(v.type)
    ]
    if wanted:
        candidates = [v for v in fit if v.name == wanted]
    else:
        candidates = [v for v in fit if v.name == "cur_state"] or [
            v for v in fit if isinstance(v.type, Enum) and v.name in table.variables
        ]
    if len(candidates) > 1:
        candidates = _moved(program, table, candidates) or candidates
    if len(candidates) == 1:
        return candidates[0]
    several = f"several variables could be the state of table `{table.name}`: " + ", ".join(
        f"`{v.name}`" for v in candidates
    )
    none = (
        f"`{wanted}` is no state variable of few values"
        if wanted
        else f"table `{table.name}` has no variable that could be its state"
    )
    helps = ("name one with `--state`: an enumeration, a boolean or a few integers",)
    return Diagnostic(Code.GRAPH_NO_STATE, several if candidates else none, Label(table.span), help=helps)


def _moved(program: Program, table: Table, candidates: list[Variable]) -> list[Variable]:
    """Return those that some line of the table may write: a variable that others write, such as a report, is no state of it."""
    procedures = {str(each.name): each for each in program.procedures}
    statements = [action.statement for line in table.every_line for action in line.actions]
    written = may_write(statements, procedures)
    return [v for v in candidates if v.name in written or f"{v.name}.next" in written]


@dataclass(slots=True)
class _Derivation:
    """One table's graph in the making."""

    program: Program
    table: Table
    file: tree.File
    written: tree.TableDecl
    steps: Steps
    lost: list[str] = field(default_factory=list)

    def derived(self) -> Derived:
        states = self.steps.states()
        steps = self.steps.steps(states)
        edges: list[Edge] = []
        for at, line in enumerate(self.table.every_line):
            edges += self._edges(at, line, [step for step in steps if step.line == at], states)
        common = self._common(edges)
        values = {self._spelled(value): value for value in states}
        edges = [self._eased(edge, common, values) for edge in edges]
        self._comments()
        used = tuple(
            name for name in map(self._spelled, states) if any(name in (e.source, e.target) for e in edges)
        )
        graph = StateGraph(
            self.table.name,
            self.steps.state.name,
            tuple(edges),
            self.steps.state.deferred_until is not None,
            self._spelled(self.steps.state.initial),
            tuple(
                name.text for name in self.written.assuming
            ),  # those that the protocol offers come by themselves
            tuple(
                declaration.path
                for declaration in self.file.declarations
                if isinstance(declaration, tree.Use)
            ),
            self._columns(),
            tuple(line.name for line in self.table.every_line),
            used,
        )
        return Derived(graph, labels.guard(common), tuple(self.lost))

    # --- words ---

    def _row(self, at: int) -> tree.Row:
        name = self.table.every_line[at].name
        return next(row for row in self.written.rows if row.name == name)

    def _spelled(self, value: Value) -> str:
        return spell(self.steps.state.type, value)

    def _is_state(self, heading: tree.Heading) -> bool:
        return heading.subject is not None and spell_expr(heading.subject) == self.steps.state.name

    def _columns(self) -> str:
        left = dict.fromkeys(_heading(condition) for condition in self.written.conditions)  # `when` once
        right = [_heading(action) for action in self.written.actions]
        return f"{' | '.join(left)} || {' | '.join(right)}".strip()

    def _terms(self, at: int, columns: tuple[int, ...] | None = None) -> list[tree.Expr]:
        """Return the cells of a line, the state's left out; of these columns only where they are given."""
        return [
            term
            for column, term in labels.said_by(self.written, self._row(at)).items()
            if not self._is_state(self.written.conditions[column]) and (columns is None or column in columns)
        ]

    # --- edges ---

    def _edges(self, at: int, line: Line | Default, steps: list[Step], states: list[Value]) -> list[Edge]:
        """Return the edges of one line; a single edge from ANY where it leads alike from every state."""
        default = "" if isinstance(line, Line) else f"DEFAULT{' unreachable' if line.unreachable else ''}"
        sources = list(dict.fromkeys(step.source for step in steps))
        goal = self._goal(line.actions)
        if goal is not None and goal in sources and sources != states:
            goal = None  # a loop says that nothing is written: here the action has to say it
        by = self._deciders(line.actions, goal)
        stays = goal is None and not by
        effect = self._effect(self._row(at), line.actions, goal)
        base = Edge(line.name, ANY, ANY, labels.guard(self._terms(at)), effect, default=default)
        if not steps:
            return self._unreached(base, goal, at)
        anywhere = sources == states and (stays or all(step.target == goal for step in steps))
        self._narrowed(at, [] if anywhere else sources)
        if anywhere:
            return [replace(base, target=ANY if goal is None else self._spelled(goal))]
        return [
            replace(
                base,
                source=self._spelled(step.source),
                target=self._spelled(step.target),
                decided="" if stays or step.target == goal else by,
            )
            for step in steps
        ]

    def _goal(self, actions: tuple[Action, ...]) -> Value | None:
        """Return the state to which one action goes, whatever the input, before any other can write it; None where none does."""
        writers = [action for action in actions if self.steps.writes(action)]
        goals = [self.steps.sets(action) for action in writers]
        return goals[0] if goals and all(goal is None for goal in goals[1:]) else None

    def _deciders(self, actions: tuple[Action, ...], goal: Value | None) -> str:
        """Return the actions that can write the state, without the one that the edge itself shows."""
        writers = [action for action in actions if self.steps.writes(action)]
        return ", ".join(action.text for action in (writers if goal is None else writers[1:]))

    def _unreached(self, base: Edge, goal: Value | None, at: int) -> list[Edge]:
        """Return an edge for a DEFAULT line that is never reached; note any other line as lost, without an edge."""
        if base.default:
            return [replace(base, target=ANY if goal is None else self._spelled(goal))]
        self.lost.append(
            f"line `{self.table.every_line[at].name}` matches nothing under the assumptions and has no edge"
        )
        return []

    def _narrowed(self, at: int, sources: list[Value]) -> None:
        """Note as lost that the states written are not those from which the edges come."""
        stated = [
            spell_condition(cell, whole=False)
            for heading, cell in zip(self.written.conditions, self._row(at).conditions, strict=True)
            if cell is not None and self._is_state(heading)
        ]
        names = [self._spelled(source) for source in sources]
        again = names[0] if len(names) == 1 else "in {" + ", ".join(names) + "}" if names else ""
        before = " and ".join(stated)
        if before != again and not self._row(at).default:
            written, then = (f"`{text}`" if text else "a blank" for text in (before, again))
            name = self.table.every_line[at].name
            self.lost.append(f"line `{name}`: {written} under `{self.steps.state.name}` comes back as {then}")

    def _effect(self, row: tree.Row, actions: tuple[Action, ...], goal: Value | None) -> str:
        """Return the action cells, without the one action that the edge itself shows."""
        left = list(actions)
        told = None if goal is None else next(action for action in actions if self.steps.writes(action))
        cells = []
        for cell in row.actions:
            written = (cell,) if isinstance(cell, tree.Comparison) else cell
            taken = [_taken(left) for _ in written]
            cells.append("; ".join(action.text for action in taken if action is not told))
        return labels.effect(tuple(map(_heading, self.written.actions)), tuple(cells))

    # --- what is shown ---

    def _common(self, edges: list[Edge]) -> list[tree.Expr]:
        """Return the terms shared by every edge that leaves a single state."""
        return labels.common([labels.terms_of(edge.guard) for edge in edges if edge.source != ANY])

    def _eased(self, edge: Edge, common: list[tree.Expr], values: Mapping[str, Value]) -> Edge:
        if edge.default:
            return edge
        at = next(at for at, line in enumerate(self.table.every_line) if line.name == edge.line)
        source = None if edge.source == ANY else values[edge.source]
        terms = self._terms(at, self.steps.needed(at, source))
        if source is not None:
            terms = [term for term in terms if term not in common]
        return replace(edge, shown=labels.guard(terms))

    def _comments(self) -> None:
        many = (
            len(self.written.doc)
            + len(self.written.comments)
            + sum(len(row.comments) for row in self.written.rows)
        )
        if many:
            self.lost.append(f"{many} lines of comment")


def _heading(heading: tree.Heading) -> str:
    return heading.word if heading.subject is None else spell_expr(heading.subject)


def _taken(left: list[Action]) -> Action:
    """Take the next action as written; the assignment of a whole record is several in the model."""
    first = left.pop(0)
    while left and isinstance(first.statement, Assign) and _of_one(first, left[0]):
        left.pop(0)
    return first


def _of_one(first: Action, other: Action) -> bool:
    a, b = first.statement, other.statement
    alike = other.heading == first.heading and other.text == first.text
    return alike and isinstance(a, Assign) and isinstance(b, Assign) and a.place != b.place


# --- which line follows which ---------------------------------------------------------------


def derive_lines(program: Program, table: Table, file: tree.File, options: Options) -> Derived | Diagnostic:
    """Derive the graph of a table's lines; the level that runs the table, if one does, is followed for a whole cycle.

    It is drawn in every form, but no table is made of it. An edge says what must hold for the second line to match, beside what follows
    from the first having matched. A line that can follow most others is drawn once, from every line, with those that it cannot follow.
    """
    try:
        with smt.together(options.drawn):
            follows = following(program, table, options)
    except UndecidedError:
        return _undecided(table, f"which lines of table `{table.name}` can follow which is")
    written = labels.written_of(file, table)
    rows = sorted(written.rows, key=lambda row: row.default)
    names = [row.name for row in rows]
    terms = [labels.said_by(written, row) for row in rows]
    live = sorted({follow.line for follow in follows})
    edges: list[Edge] = []
    many = [at for at in live if sum(follow.then == at for follow in follows) > MOST_DRAWN * len(live)]
    own = [follow for follow in follows if follow.then not in many]
    common = labels.common([list(terms[follow.then].values()) for follow in own])
    for at in live:
        before = [follow for follow in follows if follow.then == at]
        if at in many:
            edges.append(_from_any(names, at, before, terms[at], live))
        else:
            edges += [_edge(names, follow, terms[at], common) for follow in before]
    graph = StateGraph(
        table.name, LINES, tuple(edges), lines=tuple(names), states=tuple(names[at] for at in live)
    )
    return Derived(graph, labels.guard(common))


def _edge(names: list[str], follow: Follow, terms: dict[int, tree.Expr], common: list[tree.Expr]) -> Edge:
    shown = [terms[at] for at in follow.needed if terms[at] not in common]
    whole = labels.guard(list(terms.values()))
    return Edge("", names[follow.line], names[follow.then], whole, shown=labels.guard(shown))


def _from_any(
    names: list[str], at: int, before: list[Follow], terms: dict[int, tree.Expr], live: list[int]
) -> Edge:
    never = [names[line] for line in live if line not in {follow.line for follow in before}]
    whole = labels.guard(list(terms.values()))
    needed = {column for follow in before for column in follow.needed}
    shown = labels.guard([terms[column] for column in sorted(needed)])
    return Edge(
        "", ANY, names[at], whole, shown=shown, decided=f"never after {', '.join(never)}" if never else ""
    )
