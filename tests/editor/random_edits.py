"""Edits shipped tables at random, as people do and worse, and compares the editor's findings after each with those of `rcsc check`.

`python -m tests.editor.random_edits --count 200 --seed 1`; the suite makes a short run. The text is typed into an open file, over a disk
that has it as it was; then it is saved elsewhere for a check that knows nothing of what was typed before.
"""

import argparse
import json
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.jsonform import report_to_json
from rcsc.base.diagnostics.report import Report
from rcsc.desk.editor import Workspace
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.findings.unread import TOLD

TABLES = Path(__file__).parents[2] / "tables"
PIECES = (
    "|", "||", "{", "}", "(", ")", "#", "\n", "\r\n", " ", "\t", "true", "false", "DEFAULT",
    "table t {", "in {", "..", "/=", "0", "999", "-1",
    "and", "not", "above all", "same", "é", "\u202e", "\x00",
    "\ufeff", "\U0001f916", "level", "use nothing", "input x : bool", ":=", "was", '"',
)  # fmt: skip
MOST_TYPED = 6
"""Edits that are made on top of each other before a file is closed again."""


@dataclass(frozen=True, slots=True)
class Compared:
    """What an editor and a check found of one text; both as JSON."""

    file: Path
    text: str
    editor: list[object]
    command: list[object]


def edited(text: str, random_: random.Random) -> str:
    """The text with one edit: a key, a piece, rows moved or doubled, a cell changed, a part cut out."""
    rows = [at for at, line in enumerate(text.split("\n")) if line.lstrip().startswith("|")]
    at = random_.randrange(len(text) + 1)
    lines = text.split("\n")
    match random_.randrange(16):
        case 0:
            return text[:at] + text[at + 1 :]
        case 1:
            return text[:at] + random_.choice(PIECES) + text[at:]
        case 2:
            return text[:at] + text[min(len(text), at + random_.randrange(1, 60)) :]
        case 3 if rows:
            lines.insert(random_.choice(rows), lines[random_.choice(rows)])
        case 4 if rows:
            del lines[random_.choice(rows)]
        case 5 | 6 | 7 | 8 | 9 | 10 | 11 | 12 | 13 | 14 if rows:
            row = random_.choice(rows)
            cells = lines[row].split("|")
            other = lines[random_.choice(rows)].split("|")
            where = random_.randrange(len(cells))
            cells[where] = random_.choice(
                [*[other[where % len(other)]] * 6, "", " - ", f" {random_.choice(PIECES)} "]
            )
            lines[row] = "|".join(cells)
        case _:
            words = text.split()
            return text.replace(random_.choice(words), random_.choice(words), 1) if words else text
    return "\n".join(lines)


def compared(count: int, seed: int, files: Sequence[str]) -> Iterator[Compared]:
    """Yield what both say of each of so many edited texts."""
    random_ = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        tables = Path(folder, "tables")
        shutil.copytree(TABLES, tables, ignore=shutil.ignore_patterns("*.md"))
        workspace = Workspace()
        while count:
            file = tables / random_.choice(files)
            shipped = text = file.read_bytes().decode()
            for _ in range(min(count, random_.randrange(1, MOST_TYPED + 1))):
                text = edited(text, random_)
                workspace.open(str(file), text)
                workspace.glance(str(file))  # as the server does; it may leave nothing wrong behind
                told = workspace.check(str(file))
                asked = workspace.checked(str(file))
                seen = Report(asked.diagnostics, (), asked.reading.loaded.sources)
                assert len(told.findings) == len(asked.diagnostics) + len(asked.meanwhile)
                yield Compared(file.relative_to(folder), text, _found(seen), _checked(file, text, shipped))
                count -= 1
            workspace.close(str(file))


def _checked(file: Path, text: str, shipped: str) -> list[object]:
    """What a check says that reads the text from disk."""
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        return _found(check(Settings((str(file),), Options(), use_cache=False)))
    finally:
        file.write_bytes(shipped.encode())


def _found(report: Report) -> list[object]:
    kept = tuple(each for each in report.diagnostics if each.code not in TOLD)
    found: list[object] = json.loads(
        json.dumps(report_to_json(replace(report, diagnostics=kept), "check")["diagnostics"])
    )
    return found


def main() -> int:
    """Return 1 where the two differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    files = sorted(str(path.relative_to(TABLES)) for path in TABLES.rglob("*.rcs"))
    begun, different, right = time.monotonic(), 0, 0
    for each in compared(args.count, args.seed, files):
        right += not each.command
        if each.editor != each.command:
            different += 1
            sys.stdout.write(
                f"{each.file}\n{json.dumps(each.editor)[:600]}\n{json.dumps(each.command)[:600]}\n"
            )
            Path(tempfile.gettempdir(), f"edit-{different}.rcs").write_text(each.text, encoding="utf-8")
    took = time.monotonic() - begun
    sys.stdout.write(
        f"{args.count} edits, {right} of them without findings, {different} different, {took:.0f} s\n"
    )
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
