"""Milliseconds of processor time from a key to the findings, in process: `python -m tests.bench.editor`.

For each shipped file with a table: keys in cells spread over the table, each of which changes what the table means, first looked at as the
server does (a glance); beside it a check of the same text that knows nothing. A glance that is not final is counted: what it leaves open is
proved after it. `typing` is a key in a comment, which changes nothing.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from rcsc.editor import Workspace
from rcsc.editor.written import cells_of, dashes, tables_of

TABLES = Path(__file__).parents[2] / "tables"
KEYS = 8
AIM_MS = 100.0


def keys(text: str) -> Iterator[str]:
    """Yield the text with one condition blank, or with that of another line: cells far from each other."""
    cells = [
        (table, row, cell)
        for table in tables_of(text)
        for row in table.rows
        if not dashes(row) and row not in table.parts[0].heading
        for cell in cells_of(row).conditions[1:]
        if cell.text
    ]
    for at in range(0, len(cells), max(1, len(cells) // KEYS)):
        cell = cells[at][2]
        yield text[: cell.start] + " " * len(cell.text) + text[cell.start + len(cell.text) :]


def timed(file: str, workspace: Workspace) -> tuple[float, bool]:
    """Milliseconds of a glance, and whether it is final."""
    begun = time.thread_time()
    answer = workspace.glance(file)
    return 1000 * (time.thread_time() - begun), answer.final


def main() -> None:
    """Print a row a file, the slowest first."""
    rows = []
    for path in sorted(TABLES.rglob("*.rcs")):
        file, text = str(path), path.read_text()
        if not list(tables_of(text)):
            continue
        workspace = Workspace()
        first, _ = timed(file, workspace)
        workspace.open(file, f"{text}# typing\n")
        typing, _ = timed(file, workspace)
        taken = []
        for typed in keys(text):
            workspace.open(file, typed)
            taken.append(timed(file, workspace))
        slow = [took for took, _ in taken]
        later = sum(not final for _, final in taken)
        rows.append((max(slow), median(slow), typing, first, len(slow), later, str(path.relative_to(TABLES))))
    sys.stdout.write(f"{'ms: slowest':>12}{'median':>8}{'typing':>8}{'first':>8}{'keys':>6}{'later':>6}\n")
    for worst, middle, typing, first, count, later, name in sorted(rows, reverse=True):
        sys.stdout.write(f"{worst:12.1f}{middle:8.1f}{typing:8.1f}{first:8.1f}{count:6}{later:6}  {name}\n")
    within = sum(row[0] <= AIM_MS for row in rows)
    every = median(row[1] for row in rows)
    sys.stdout.write(
        f"{within} of {len(rows)} files answer every key within {AIM_MS:.0f} ms; median of all {every:.1f} ms\n"
    )


if __name__ == "__main__":
    main()
