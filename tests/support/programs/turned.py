"""Drawn tables that are printed the other way round, and each in ordinary lines, written without rcsc."""

from collections.abc import Callable, Sequence
from random import Random
from typing import NamedTuple

Cells = Callable[[Random], str]


class Both(NamedTuple):
    """A table as it is printed the other way round, and the same in lines: rows without what stands around them."""

    said: str
    turned: list[str]
    lines: list[str]


def drawn(
    columns: Sequence[tuple[str, Cells]],
    conditions: Sequence[str],
    giving: str,
    results: Sequence[str],
    rng: Random,
    *,
    named: bool = False,
) -> Both:
    """Draw a table over columns of conditions, each a heading and its cells, and conditions by themselves, with these results.

    Its rows have names, where they are `named`, else perhaps. Where the cells are conditions, or columns have them by themselves,
    the lines have a column `when`.
    """
    left = rng.sample(columns, min(len(columns), rng.randint(1, 2)))
    matrix = not conditions or rng.randrange(2) == 0
    by = rng.choice(columns) if matrix else None
    across = [_heading(by, conditions, results, rng) for _ in range(rng.randint(1, 4))]
    heads = [heading for heading, _ in left]
    own = [*heads, *([by[0]] if by else []), "when"]
    named = named or rng.randrange(3) > 0
    turned = [_row([*(["line"] if named else []), *heads], [f"c{at} : {text}" for at, (text, _) in enumerate(across)])]  # fmt: skip
    lines = [_row(["line", *own], [giving])]
    for number in range(rng.randint(1, 4)):
        tests = [cells(rng) if rng.randrange(4) or not named else "" for _, cells in left]
        name = f"n{number}"
        says = []
        for at, (text, test) in enumerate(across):
            cell, when, result = "", test, text
            if by is not None:
                cell = result = rng.choice(("", "-", *results, *results))
            elif rng.randrange(4):
                cell = when = rng.choice((*conditions, "true", "false"))
            says.append(cell)
            if cell not in ("", "-") and (by is not None or cell != "false"):
                whole = text.startswith("when ")
                middle = [] if by is None else ["" if whole else test]
                last = when if by is None or whole else ""
                lines.append(_row([f"{name}_c{at}", *tests, *middle, last], [result]))
        turned.append(_row([*([name] if named else []), *tests], says))
    if rng.randrange(2):
        default, result = rng.choice(("DEFAULT", "DEFAULT", "DEFAULT unreachable")), rng.choice(results)
        turned.append(_row([*(["rest"] if named else []), default, *("" for _ in left[1:])], [result]))
        lines.append(_row(["rest", default, *("" for _ in own[1:])], [result]))
    said = f"{f'by {by[0]} ' if by else ''}giving {giving}"
    return Both(said, turned, lines)


def _heading(
    by: tuple[str, Cells] | None, conditions: Sequence[str], results: Sequence[str], rng: Random
) -> tuple[str, str]:
    """Return a column's heading, and its condition; none where it is a result."""
    if by is None:
        return rng.choice(results), ""
    if conditions and by[0] != "when" and rng.randrange(4) == 0:
        test = rng.choice(conditions)
        return f"when {test}", test
    test = by[1](rng)
    return test, test


def _row(conditions: Sequence[str], actions: Sequence[str]) -> str:
    return f"  | {' | '.join(conditions)} || {' | '.join(actions)} |"
