"""Parts of texts: a table from its rows, a level, a system's description, and a text with edits that are sure to be made."""

from collections.abc import Iterable, Mapping
from pathlib import Path


def edited(text: str, *edits: tuple[str, str]) -> str:
    """Return the text with each edit, of what it is and what it becomes, made in turn.

    Each must find exactly one place: an edit that misses, or makes two, is a mistake of the test.
    """
    for old, new in edits:
        assert text.count(old) == 1, f"{text.count(old)} places to edit: {old}"
        text = text.replace(old, new)
    return text


def without_row(text: str, name: str) -> str:
    """Return the text without the row of a table that has this name, of which there must be one."""
    [row] = [line for line in text.splitlines(keepends=True) if line.strip().startswith(f"| {name} ")]
    return text.replace(row, "")


def edit_file(path: Path, *edits: tuple[str, str]) -> None:
    """Make the edits in a file, as `edited` does."""
    path.write_text(edited(path.read_text(encoding="utf-8"), *edits), encoding="utf-8")


def table(name: str, *rows: str, assuming: str = "") -> str:
    """Return a table's declaration; rows are without their outer bars, the heading is the first.

    A row that ends in `||` has no columns of actions; one that ends in `|| ` has one, which is empty there.

    >>> print(table("t", "line | a || b", "low | < 5 || true", assuming="calm"))
    table t assuming calm {
    | line | a || b |
    | low | < 5 || true |
    }
    """
    head = f"table {name} assuming {assuming}" if assuming else f"table {name}"
    lines = "".join(f"| {row}\n" if row.endswith("||") else f"| {row} |\n" for row in rows)
    return f"{head} {{\n{lines}}}\n"


def level(name: str, table_name: str = "t", before: str = "", after: str = "") -> str:
    """Return the declaration of a level that runs one table every 40 ms, between these procedures."""
    first, last = before and f"preprocess {before} ", after and f"postprocess {after} "
    return f"level {name} {{ period 40 [ms] {first}table {table_name} {last}}}\n"


def system(
    levels: Iterable[str], buffers: Mapping[str, str] | None = None, name: str = "small", **more: str
) -> str:
    """Return the description of a system whose levels are programs of the same names.

    `buffers` gives the variable that each output fills; `more` are keys of the head, in TOML.
    """
    head = {"name": f'"{name}"', "generated": '"generated"', "data": '"cell.toml"', "tick_ms": "40"} | more
    keys = "".join(f"{key} = {value}\n" for key, value in head.items())
    each = "".join(f'[[level]]\nname = "{level_name}"\n' for level_name in levels)
    wires = "".join(f'"{end}" = "{other}"\n' for end, other in (buffers or {}).items())
    return f"{keys}{each}[buffers]\n{wires}"
