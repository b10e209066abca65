"""Emitted Python back to the tables: which lines of a module come from which line of a table.

In: a plan, for its names, and the text of the module, which Python's own parser reads. Out: pieces.
"""

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rcsc.code.emit.identifiers import comment, names_in
from rcsc.code.emit.plan import Origin, Plan, Sort, infrastructure
from rcsc.code.emit.rendering import Piece

_IMPORTS = "the standard library"
_SAID = "says what the file is"
_HELPERS = {
    "_div": "divides toward zero, as the tables mean it",
    "_mod": "the remainder, with the sign of the dividend",
    "_min": "the lesser of two; the first where it is no number",
    "_max": "the greater of two; the first where it is no number",
    "_whole": "reads a whole number from outside",
    "_real": "reads a real number from outside",
    "_exactly": "reads a value of one type from outside",
    "_refused": "keeps which value was refused",
    "_line_of": "finds the line in a mask",
    "_one_of": "finds the line in a mask of few lines",
    "_joined": "joins masks",
    "_lines_of": "finds the line of each mask",
}
"""What functions of the module are for that are not made of a table and say nothing of themselves."""


@dataclass(frozen=True, slots=True)
class _Names:
    """Origins by the names that Python gives.

    Attributes:
        said: Lines by the table's stem and what their function says of itself: lines of two tables of one file may say the same.
        stems: Tables by the beginning of their names, the longest first.
    """

    named: Mapping[str, Origin]
    said: Mapping[tuple[str, str], Origin]
    stems: Mapping[str, Origin]


def _names(plan: Plan) -> _Names:
    names, program = names_in(plan), plan.program
    whole = Origin(Sort.PROGRAM, program.name)
    named = {"State": whole, **dict.fromkeys(("check", "_admit", "_settle", "_safe", "_begin"), whole)}
    named |= {f"_do_{stem}": Origin(Sort.PROCEDURE, name) for name, stem in names.procedures.items()}
    named |= {f"{stem}_cycle": Origin(Sort.LEVEL, name) for name, stem in names.levels.items()}
    named |= {word: Origin(Sort.TYPE, name) for name, word in names.classes.items()}
    for name, stem in names.tables.items():
        forms = ("{x}_line", "{x}_lines", "_run_{x}", "{x}_step")
        named |= {form.format(x=stem): Origin(Sort.TABLE, name) for form in forms}
    lines = {
        (names.tables[table.table.name], comment(line.place)): Origin(Sort.LINE, table.table.name, line.name)
        for table in plan.tables
        for line in table.lines
    }
    stems = sorted(names.tables.items(), key=lambda item: -len(item[1]))
    return _Names(named, lines, {stem: Origin(Sort.TABLE, name) for name, stem in stems})


def python_pieces(plan: Plan, file: str, text: str) -> Iterator[Piece]:
    """Give the pieces of a module; lines that are in none are traced to nothing."""
    names, above = _names(plan), 1
    body = ast.parse(text).body
    for node, below in zip(body, [*body[1:], None], strict=True):
        origin, name = _origin(names, node)
        if origin is None and name and (said := _said(below)):
            origin = infrastructure(said)
        last = node.end_lineno or node.lineno
        if origin is not None:
            yield Piece(file, above, last, name, origin)
        above = last + 1


def _said(node: ast.stmt | None) -> str:
    """The words of a string that stands alone below a constant."""
    if (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    ):
        return node.value.value
    return ""


def _origin(names: _Names, node: ast.stmt) -> tuple[Origin | None, str]:
    match node:
        case ast.Import() | ast.ImportFrom():
            return infrastructure(_IMPORTS), ""
        case ast.Expr():
            return infrastructure(_SAID), ""
        case ast.ClassDef(name=name) | ast.FunctionDef(name=name):
            return _defined(names, node, name), name
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
            return _constant(names, name), name
    return None, ""


def _defined(names: _Names, node: ast.ClassDef | ast.FunctionDef, name: str) -> Origin | None:
    said = ast.get_docstring(node) or ""
    if name in names.named:
        return names.named[name]
    for stem in names.stems:
        if name.startswith(f"_{stem}_") and (stem, said) in names.said:
            return names.said[stem, said]
    reason = said or _HELPERS.get(name, "")
    return infrastructure(reason) if reason and name.startswith("_") else None


def _constant(names: _Names, name: str) -> Origin | None:
    bare = name.lstrip("_")
    return next((origin for stem, origin in names.stems.items() if bare.startswith(f"{stem.upper()}_")), None)
