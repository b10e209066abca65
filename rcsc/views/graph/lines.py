"""The graph of lines: which line can match in the cycle after which.

In: a program and one of its tables. Out: a `StateGraph` whose nodes are lines: it is drawn in every form, but no table is made of it. An
edge says what must hold for the second line to match, beside what follows from the first having matched. A line that can follow most
others is drawn once, from every line, with the lines that it cannot follow.
"""

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.lang.model import Program, Table
from rcsc.lang.syntax import tree
from rcsc.proof.relation.follow import Follow, following
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import UndecidedError
from rcsc.views.graph import labels
from rcsc.views.graph.derive import Derived
from rcsc.views.graph.formats.state_graph import ANY, LINES, Edge, StateGraph

_MOST = 2 / 3
"""A line that can follow more than this share of the lines is drawn from every line."""


def derive_lines(program: Program, table: Table, file: tree.File, options: Options) -> Derived | Diagnostic:
    """Derive the graph of a table's lines; the level that runs the table, if one does, is followed for a whole cycle."""
    try:
        with smt.together(options.drawn):
            follows = following(program, table, options)
    except UndecidedError:
        message = f"which lines of table `{table.name}` can follow which is not decided within the limits"
        return Diagnostic(Code.UNDECIDED, message, Label(table.span), help=("raise `--steps`",))
    written = labels.written_of(file, table)
    rows = sorted(written.rows, key=lambda row: row.default)
    names = [row.name for row in rows]
    terms = [labels.said_by(written, row) for row in rows]
    live = sorted({follow.line for follow in follows})
    edges: list[Edge] = []
    many = [at for at in live if sum(follow.then == at for follow in follows) > _MOST * len(live)]
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
