"""Whether a graph's table does what another table does: proved, or refuted by an input.

In: a file that declares a table, and the table to stand in its place. Out: the program with it, and the verdict.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, WitnessColumn
from rcsc.base.diagnostics.source import Source, Span
from rcsc.lang.model import AssumptionName, Program, Table, spell
from rcsc.lang.project import Loaded
from rcsc.lang.resolve import resolve
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.proof.relation.same import Comparison, Differs, NotDecided, Same, compare
from rcsc.proof.solvers.options import Options
from rcsc.views.graph.to_table import Tabled

MOST_NAMED = 3
"""Variables named of those that differ."""


@dataclass(frozen=True, slots=True)
class Against:
    """The verdict on a table in place of another.

    Attributes:
        diagnostics: The differences; empty where it is proved to be the same.
        questions: The number of questions put to Z3.
        sources: Texts that `diagnostics` point into.
        where: The assumptions under which it is: both may do something else where one fails.
    """

    diagnostics: tuple[Diagnostic, ...]
    questions: int = 0
    sources: Mapping[str, Source] | None = None
    where: tuple[AssumptionName, ...] = ()

    def __str__(self) -> str:
        """Say what was proved; there are no differences."""
        names = ", ".join(f"`{name}`" for name in self.where)
        holds = f" where {names} {'holds' if len(self.where) == 1 else 'hold'}" if names else ""
        return f"{holds}: proved, {self.questions} questions"


def in_place(file: tree.File, table: tree.TableDecl) -> str:
    """Return the file's text with the table in place of the one of its name, or at its end; comments above a table stay."""
    kept: list[tree.Declaration] = []
    there = False
    for declaration in file.declarations:
        if isinstance(declaration, tree.TableDecl) and declaration.name.text == table.name.text:
            there = True
            kept.append(replace(table, comments=declaration.comments, doc=declaration.doc))
        else:
            kept.append(declaration)
    declarations = tuple(kept) if there else (*kept, table)
    return format_file(replace(file, declarations=declarations))


def against(
    loaded: Loaded, root: str, program: Program, table: Table, new: Tabled, options: Options
) -> Against:
    """Prove or refute that the graph's table does what the present one does, from the same state.

    Args:
        loaded: Has the files of the program.
        root: The root file of the program.
        program: The program of `root`.
        table: The present table.
        new: The table to stand in its place, and where the graph begins.
        options: Limits of the solver.
    """
    name = f"{table.file} (from the graph)"
    text = in_place(loaded.files[table.file], new.table)
    parsed = parse(Source(table.file, text))
    if not isinstance(parsed, tree.File):
        return Against(parsed, sources={table.file: Source(table.file, text)})
    sources = {**loaded.sources, table.file: Source(table.file, text)}
    changed = replace(loaded, files={**loaded.files, table.file: parsed}, sources=sources)
    resolved = resolve(root, changed)
    if not isinstance(resolved, Program):
        shown = tuple(_renamed(diagnostic, table.file, name) for diagnostic in resolved)
        return Against(shown, sources={**loaded.sources, name: Source(name, text)})
    other = resolved.table(table.name)
    where, verdict = _compared(program, table, (resolved, other), options)
    if isinstance(verdict, Same) and set(other.assumptions) != set(table.assumptions):
        return Against((_assuming(table, other),))
    begins = _begins(program, table, new)
    if isinstance(verdict, Same) and begins is not None:
        return Against((begins,))
    questions = verdict.questions if isinstance(verdict, Same) else 0
    return Against(_findings(verdict, program, table), questions, loaded.sources, where)


def _compared(
    program: Program, table: Table, other: tuple[Program, Table], options: Options
) -> tuple[tuple[AssumptionName, ...], Comparison]:
    """Compare the tables for every input that invariants admit, and if they differ there for those that the assumptions admit, too."""
    bare = replace(table, assumptions=())
    tables = tuple(bare if each.name == table.name else each for each in program.tables)
    verdict = compare((replace(program, tables=tables), bare), other, options)
    if isinstance(verdict, Same) or not table.assumptions:
        return (), verdict
    return table.assumptions, compare((program, table), other, options)


def _renamed(diagnostic: Diagnostic, file: str, name: str) -> Diagnostic:
    def moved(label: Label) -> Label:
        span = label.span
        return Label(Span(name, span.start, span.end), label.message) if span.file == file else label

    return replace(
        diagnostic, primary=moved(diagnostic.primary), related=tuple(map(moved, diagnostic.related))
    )


def _assuming(table: Table, other: Table) -> Diagnostic:
    message = f"the graph's table `{table.name}` does not rest on the same assumptions"
    names = [", ".join(f"`{name}`" for name in side.assumptions) or "none" for side in (table, other)]
    return Diagnostic(
        Code.GRAPH_DIFFERS,
        message,
        Label(table.span),
        notes=(f"the table: {names[0]}; the graph: {names[1]}",),
    )


def _begins(program: Program, table: Table, new: Tabled) -> Diagnostic | None:
    """Return a diagnostic where the graph begins in another state."""
    name, initial = new.begins
    state = next((variable for variable in program.variables if variable.name == name), None)
    if not initial or state is None or spell(state.type, state.initial) == initial:
        return None
    message = f"the graph begins in `{initial}`, table `{table.name}` in `{spell(state.type, state.initial)}`"
    return Diagnostic(Code.GRAPH_DIFFERS, message, Label(table.span))


def _findings(verdict: Comparison, program: Program, table: Table) -> tuple[Diagnostic, ...]:
    match verdict:
        case Same():
            return ()
        case NotDecided():
            message = f"whether the graph says table `{table.name}` is not decided within the limits"
            return (Diagnostic(Code.UNDECIDED, message, Label(table.span), help=("raise `--steps`",)),)
        case Differs(witness=witness, first=first, second=second, changed=changed):
            shown = [
                (v, value)
                for v, value in witness
                if any(v.name == variable.name for variable in program.variables)
            ]
            column = WitnessColumn(
                table.name, tuple(v.name for v, _ in shown), tuple(spell(v.type, value) for v, value in shown)
            )
            what = f"the table comes to {_outcome(first)}, the graph to {_outcome(second)}"
            more = f" and {len(changed) - MOST_NAMED} more" if len(changed) > MOST_NAMED else ""
            names = ", ".join(name if " " in name else f"`{name}`" for name in changed[:MOST_NAMED])
            after = f"afterwards these differ: {names}{more}"
            message = f"the graph does not say table `{table.name}`: {what} for some input"
            notes = (after,) if changed else ()
            return (
                Diagnostic(Code.GRAPH_DIFFERS, message, Label(table.span), notes=notes, witnesses=(column,)),
            )


def _outcome(name: str) -> str:
    return name if " " in name else f"line `{name}`"
