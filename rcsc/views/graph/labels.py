"""Guards and effects: a table's cells as text on an edge, and back.

In: cells of the syntax tree. Out: one line of text, and the other way round. A guard is what a condition cell means with its
heading before it: `status_in = done and loc_of_obj /= vis_reqd`. An effect is the action cells, each in parentheses after its
heading: `procedures(begin, set_source) command_out(move_to_obj)`; commas, because Mermaid ends a statement at `;`.
"""

import re
from collections.abc import Iterator
from functools import lru_cache

from rcsc.base.diagnostics.source import Source
from rcsc.lang.model import Table
from rcsc.lang.operator_table import LOGIC, NEGATION, Op
from rcsc.lang.resolve.precedence import expanded
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.rows import ACTION_WORDS
from rcsc.lang.syntax.spell import spell_expr

_HEADING = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_.\[\]]*)\(")
_OPEN, _CLOSE = "([{", ")]}"


class WordsError(Exception):
    """A guard or an effect that is not in the language.

    Attributes:
        what: What is wrong, in words.
    """

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what


# --- guards ------------------------------------------------------------------------------


def written_of(file: tree.File, table: Table) -> tree.TableDecl:
    """Return the table as the file declares it, with what `above` and `same` add, each in cells of its own."""
    return next(
        expanded(declaration, table, apart=True)
        for declaration in file.declarations
        if isinstance(declaration, tree.TableDecl) and declaration.name.text == table.name
    )


def said_by(written: tree.TableDecl, row: tree.Row) -> dict[int, tree.Expr]:
    """Return the condition cells of a line, each with its heading, by column."""
    cells = enumerate(zip(written.conditions, row.conditions, strict=True))
    return {at: tree.term(heading, cell) for at, (heading, cell) in cells if cell is not None}


def common(every: list[list[tree.Expr]]) -> list[tree.Expr]:
    """Return the terms that all of several edges share."""
    return [term for term in every[0] if all(term in terms for terms in every)] if len(every) > 1 else []


def guard(terms: list[tree.Expr]) -> str:
    """Return the terms joined by `and`; "" without any."""
    return " and ".join(spell_expr(term, NEGATION) for term in terms)


def terms_of(text: str) -> list[tree.Expr]:
    """Return the terms of a guard; raise WordsError where it is no expression."""
    if not text.strip():
        return []
    [row] = _rows(f"table t {{\n| line | when ||\n| a | {text} ||\n}}\n", text)
    [written] = row.conditions
    if not isinstance(written, tree.Comparison):
        raise WordsError(f"`{text}` is no condition")
    return list(_conjuncts(written.value))


def _conjuncts(expr: tree.Expr) -> Iterator[tree.Expr]:
    if isinstance(expr, tree.Binary) and expr.op == "and":
        yield from _conjuncts(expr.left)
        yield from _conjuncts(expr.right)
    else:
        yield expr


def cell(expr: tree.Expr) -> tuple[tree.Expr, tree.Condition] | None:
    """Return the heading and the cell with the same meaning; None for a term that can stand only under `when`."""
    match expr:
        case tree.Binary(op, subject, value) if op in ("=", "/=", "<", "<=", ">", ">="):
            return (subject, tree.Comparison(op, value)) if not _constant(subject) else None
        case tree.InSet(subject, members):
            return subject, tree.OneOf(members, negated=expr.negated)
        case tree.InRange(subject, low, high):
            return subject, tree.Between(low, high, negated=expr.negated)
        case tree.Unary("not", (tree.Reference() | tree.FieldOf() | tree.IndexOf()) as subject):
            return subject, tree.Comparison("=", tree.BoolLiteral(value=False))
        case tree.Reference() | tree.FieldOf() | tree.IndexOf():
            return expr, tree.Comparison("=", tree.BoolLiteral(value=True))
        case _:
            return None


def _constant(expr: tree.Expr) -> bool:
    return isinstance(expr, tree.IntLiteral | tree.RealLiteral | tree.BoolLiteral)


# --- effects -----------------------------------------------------------------------------


def effect(headings: tuple[str, ...], cells: tuple[str, ...]) -> str:
    """Return action cells after their headings, without blank ones.

    Args:
        headings: As the table spells them.
        cells: One a heading: actions separated by `;`, or a value.
    """
    shown = zip(headings, cells, strict=True)
    return " ".join(f"{heading}({text.replace('; ', ', ')})" for heading, text in shown if text)


def effect_cells(text: str) -> list[tuple[str, str]]:
    """Return heading and cell of each part of an effect; raise WordsError where it has another form."""
    cells = []
    at = 0
    while text[at:].strip():
        match = _HEADING.match(text, at)
        if match is None:
            raise WordsError(f"`{text[at:].strip()}` is no `heading(actions)`")
        end = _closing(text, match.end() - 1)
        inside = text[match.end() : end].strip()
        heading = match.group(1)
        cells.append((heading, "; ".join(split(inside)) if heading in ACTION_WORDS else inside))
        at = end + 1
    return cells


def _closing(text: str, opening: int) -> int:
    depth = 0
    for at in range(opening, len(text)):
        depth += (text[at] in _OPEN) - (text[at] in _CLOSE)
        if depth == 0:
            return at
    raise WordsError(f"a bracket in `{text}` is not closed")


def split(text: str, mark: str = ",") -> list[str]:
    """Return the pieces between marks outside brackets."""
    pieces, depth, begun = [], 0, 0
    for at, letter in enumerate(text):
        depth += (letter in _OPEN) - (letter in _CLOSE)
        if depth == 0 and at >= begun and text.startswith(mark, at):
            pieces.append(text[begun:at])
            begun = at + len(mark)
    return [piece.strip() for piece in (*pieces, text[begun:]) if piece.strip()]


def check_actions(heading: str, text: str) -> None:
    """Raise WordsError where the cell cannot stand under the heading."""
    column, value = (heading, text) if heading in ACTION_WORDS else ("procedures", f"{heading} := {text}")
    _rows(f"table t {{\n| line | when || {column} |\n| a | true || {value} |\n}}\n", text)


@lru_cache(maxsize=4_096)  # the lines of a table have most of their cells in common
def _rows(table: str, text: str) -> tuple[tree.Row, ...]:
    """Return the one row of a table made around a text."""
    parsed = parse(Source("", table))
    if not isinstance(parsed, tree.File):
        raise WordsError(f"{parsed[0].message}, in `{text}`")
    [declared] = parsed.declarations if len(parsed.declarations) == 1 else (None,)
    if not isinstance(declared, tree.TableDecl) or len(declared.rows) != 1:
        raise WordsError(f"`{text}` is more than a cell of a table")
    return declared.rows


# --- for the eye ---

MOST_LETTERS = 34
"""Letters of a label's line."""


def plain(guard: str) -> str:
    """Return a guard for reading: `not a` for `a = false`, and commas."""
    short = re.sub(r"(?<![\w.\]])([\w.\[\]]+) = true(?![\w.])", r"\1", guard)
    short = re.sub(r"(?<![\w.\]])([\w.\[\]]+) = false(?![\w.])", r"not \1", short)
    return short if any(f" {op} " in short for op in LOGIC - {Op.AND}) else ", ".join(split(short, " and "))


def wrapped(text: str) -> Iterator[str]:
    """Yield the text in lines, broken after commas and before `and` or `or`."""
    line = ""
    for piece in re.split(r"(?<=, )|(?= (?:and|or) )", text):
        if line and len(line) + len(piece.rstrip()) > MOST_LETTERS:
            yield line.strip()
            line = ""
        line += piece
    if line.strip():
        yield line.strip()
