"""Milliseconds from a key to what is found of it, as the language server answers: `python -m tests.bench.editor`.

For each shipped file with a table: cells spread over its conditions are made blank, one at a time, each of the file as it is shipped. It is
timed by the clock from the change to the first answer. `later` counts first answers that leave something open: its proof is under way when
the next key comes. `typing` is a key in a comment, which changes no meaning.
"""

import asyncio
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from rcsc.desk.editor.server.serve import at_rest
from rcsc.desk.editor.server.session import Session
from rcsc.desk.editor.values import Answer
from rcsc.lang.written.tables import cells_of, dashes, tables_of

TABLES = Path(__file__).parents[2] / "tables"
KEYS = 8
PAUSE_S = 0.3
"""Between two keys."""
AIM_MS = 100.0


def keys(text: str) -> Iterator[str]:
    """Yield the text with one condition blank: at least `KEYS` cells, where it has so many, far from each other."""
    cells = [
        cell
        for table in tables_of(text)
        for row in table.rows
        if not dashes(row) and row not in table.parts[0].heading
        for cell in cells_of(row).conditions[1:]
        if cell.text
    ]
    for at in range(0, len(cells), max(1, len(cells) // KEYS)):
        cell = cells[at]
        yield text[: cell.start] + " " * len(cell.text) + text[cell.start + len(cell.text) :]


class Typist:
    """Types into one file, and waits for what is found."""

    def __init__(self, path: Path) -> None:
        self.uri, self.session = path.as_uri(), Session(self._hear, rests=at_rest)
        self._version, self._heard = 0, asyncio.Queue[Answer]()

    async def _hear(self, answer: Answer) -> None:
        self._heard.put_nowait(answer)

    async def type(self, text: str) -> tuple[float, bool]:
        """Milliseconds to the first answer, and whether it is final."""
        begun, self._version = time.perf_counter(), self._version + 1
        self.session.open(self.uri, text, self._version)
        answer = await self._heard.get()
        took = time.perf_counter() - begun
        await asyncio.sleep(PAUSE_S)
        while not self._heard.empty():
            self._heard.get_nowait()
        return 1000 * took, answer.final


async def typed(path: Path) -> tuple[float, ...]:
    """Slowest and median of the answers; that of a comment; how many keys, and how many answers left something open."""
    text, typist = path.read_text(), Typist(path)  # noqa: ASYNC240  # nobody else waits here
    await typist.type(text)
    typing, _ = await typist.type(f"{text}# typing\n")
    taken = [await typist.type(each) for each in keys(text)]
    typist.session.close(typist.uri)
    await typist.type(text)
    took = [each for each, _ in taken]
    return max(took), median(took), typing, len(taken), sum(not final for _, final in taken)


def main() -> None:
    """Print a row a file, the slowest first."""
    named = {
        path: asyncio.run(typed(path))
        for path in sorted(TABLES.rglob("*.rcs"))
        if [*tables_of(path.read_text())]
    }
    sys.stdout.write(f"{'ms: slowest':>12}{'median':>8}{'typing':>8}{'keys':>6}{'later':>6}\n")
    for path, row in sorted(named.items(), key=lambda each: -each[1][0]):
        worst, middle, typing, count, later = row
        sys.stdout.write(
            f"{worst:12.1f}{middle:8.1f}{typing:8.1f}{count:6.0f}{later:6.0f}  {path.relative_to(TABLES)}\n"
        )
    within = sum(row[0] <= AIM_MS for row in named.values())
    every = median(row[1] for row in named.values())
    sys.stdout.write(
        f"{within} of {len(named)} files answer every key within {AIM_MS:.0f} ms; median of all {every:.1f} ms\n"
    )


if __name__ == "__main__":
    main()
