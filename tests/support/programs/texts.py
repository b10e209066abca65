"""Parts of texts: a table from its rows, a level, a system's description, and a text with edits that are sure to be made."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from random import Random

from rcsc.base.diagnostics.source import Source
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse


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


def one_row_a_line(path: Path) -> str:
    """Return the text of a file with each line of its tables on one row, so that a row may be edited."""
    file = parse(Source(path.name, path.read_text(encoding="utf-8")))
    assert isinstance(file, tree.File), file
    return format_file(file, 10_000)


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


def parted_and_broken(text: str, random: Random) -> str:
    r"""Return the text of one table, of one row a line, in parts and with cells broken at blanks, both drawn.

    >>> print(parted_and_broken("table t {\n| line | a ||\n|---|---||\n| x | 1 ||\n}", Random(1)))
    table t {
    | line | a ||
    |-|-||
    | x | 1 ||
    }
    """
    lines = text.splitlines()
    first = next(at for at, line in enumerate(lines) if line.lstrip().startswith("| line"))
    rows = [line for line in lines[first:] if _is_row(line)]
    split = [_cut(row) for row in rows]
    wide = [(side, at) for side in (0, 1) for at in range(side == 0, len(split[0][side]))]
    parts: list[list[tuple[int, int]]] = [[]]
    for place in wide:
        if parts[-1] and (parts[-1][-1][0] > place[0] or random.random() < 0.3):
            parts.append([])
        parts[-1].append(place)
    names = [
        [[left[0].split()[0], *left[1:]], right] for left, right in split
    ]  # in further parts without `above`
    shown = [_part_rows(names if at else split, part, random) for at, part in enumerate(parts)]
    head, *below = shown[0]
    result = [*lines[:first], *head]
    bodies = iter(below)
    for line in lines[first + 1 :]:
        if _is_row(line):
            result += next(bodies)
        elif not line.lstrip().startswith("|") and line != "}":
            result.append(line)
    return "\n".join([*result, *(row for part in shown[1:] for rows in part for row in rows), "}"])


def _is_row(line: str) -> bool:
    return line.lstrip().startswith("|") and bool(line.strip(" |-"))


def _cut(row: str) -> list[list[str]]:
    """The texts of the cells on both sides."""
    left, right = row.strip().removeprefix("|").split("||")
    actions = right.removesuffix("|").split("|") if right else []
    return [[cell.strip() for cell in side] for side in (left.split("|"), actions)]


def _part_rows(split: list[list[list[str]]], part: list[tuple[int, int]], random: Random) -> list[list[str]]:
    """The rows of the heading, with the separator, and of each line."""
    shown = []
    for number, row in enumerate(split):
        pieces = [_broken(row[side][at], random) for side, at in part]
        rows = []
        for at in range(max(map(len, pieces))):
            texts = [piece[at] if at < len(piece) else "" for piece in pieces]
            sides = [
                [text for text, (where, _) in zip(texts, part, strict=True) if where == side]
                for side in (0, 1)
            ]
            left = " | ".join(["" if at else row[0][0], *sides[0]])
            rows.append(f"| {left} ||" + (f" {' | '.join(sides[1])} |" if sides[1] else ""))
        if not number:
            rows.append("|-" * (1 + sum(side == 0 for side, _ in part)) + "||")
        shown.append(rows)
    return shown


def _broken(text: str, random: Random) -> list[str]:
    """A cell's text at some of its blanks: not after `_` or `.`, where none would come back, nor so that only a dash stands alone."""
    pieces: list[str] = []
    for word in text.split(" "):
        dash = not word.strip("-:") or (pieces and not pieces[-1].strip("-: "))
        if pieces and (dash or pieces[-1].endswith(("_", ".")) or random.random() < 0.6):
            pieces[-1] += f" {word}"
        else:
            pieces.append(word)
    return pieces
