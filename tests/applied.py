"""Drawn wrong tables of a level: each cell and line that `rcsc prove` calls proved is written out, and inputs are tried.

`python -m tests.applied --count 1000 --seed 1` for a long run. The tables are those of `tests.wrong`; what the text with a
repair does is told by the interpreter alone.
"""

import argparse
import random
import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from rcsc.base.diagnostics.diagnostic import Change, ChangeKind, Proposal
from rcsc.code.testing.inputs.sampling import declarations, snapshot
from rcsc.compose.counterexample.applied import After, Text, Texts
from rcsc.compose.proof.system import NoProgramError, transition_systems
from rcsc.lang.interpret import UNDEFINED, matching_lines
from rcsc.lang.model import Program
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.mending import Outcome, names_of, written
from rcsc.proof.table.repair import PartingCell, Partings, new_line
from rcsc.proof.table.verdict import Gap, Overlap
from tests.support.programs.systems import solo_system
from tests.wrong import Rng, drawn

MOST_PAIRS, MOST_CELLS, INPUTS = 4, 2, 60
"""Of a table the pairs whose repairs are tried, of a pair the cells, and of a text the inputs."""
Both = tuple[set[str], set[str]]


def held(folder: Path, rng: Rng) -> Counter[Outcome]:
    """Draw a table and try its repairs; count what came of them.

    Raises:
        AssertionError: One is called proved, and some input is matched otherwise.
    """
    level = re.sub(r"^level .*$", "", drawn(rng), flags=re.MULTILINE)
    name = re.findall(r"^table (\w+)", level, re.MULTILINE)[-1]
    try:
        path = solo_system(folder, f"{level}\nlevel solo {{ period 40 [ms] table {name} }}\n")
        ts = transition_systems(path)["solo"]
    except NoProgramError:
        return Counter()
    text = Texts().of(ts, name)
    return Counter(
        after.outcome
        for after, change in (*_cells(text), *_rows(text))
        if after.outcome is not Outcome.HOLDS or _matched_as_told(text, change, rng)
    )


def _cells(text: Text) -> Iterator[tuple[After, PartingCell | Change]]:
    names = names_of(text.table)
    pairs = sorted(sorted(map(names.index, pair)) for pair in (text.before.pairs if text.before else ()))
    for first, second in pairs[:MOST_PAIRS]:
        every = Partings(text.ts.program, text.table).cells(Overlap(first, second, {}))
        for cell in islice(every, MOST_CELLS):
            yield text.parted(cell), cell


def _rows(text: Text) -> Iterator[tuple[After, PartingCell | Change]]:
    program = text.ts.program
    for gap in prove_table(program, text.table, Options(steps=200_000)).findings:
        row = new_line(program, text.table, gap) if isinstance(gap, Gap) else None
        if isinstance(gap, Gap) and row is not None:
            yield text.joined(row, gap.witnesses[0]), Change(ChangeKind.LINE, texts=row.cells)


def _matched_as_told(text: Text, what: PartingCell | Change, rng: Rng) -> bool:
    """Return whether both texts match inputs as is said of the change."""
    change = what.change(text.table) if isinstance(what, PartingCell) else what
    assert text.loaded is not None
    proposal = Proposal("", str(text.table.name), "", (change,))
    program = written(text.loaded.roots[0], text.loaded, text.table.span.file, proposal)
    assert isinstance(program, Program), change
    for before, after in islice(_matches(text, program, rng), INPUTS):
        assert len(after) <= max(1, len(before)), (change, before, after)
        if isinstance(what, PartingCell):
            line, other = (str(text.table.lines[at].name) for at in (what.line, what.other))
            assert not {line, other} <= after, (change, before, after)
            assert other in after or not {line, other} <= before, (change, before, after)
            assert after or not before or what.falls, (change, before)
    return True


def _matches(text: Text, program: Program, rng: Rng) -> Iterator[Both]:
    """Yield, of inputs, the lines that match each in the table as it is, and as it would be."""
    known = declarations(program)
    table = next(each for each in program.tables if each.name == text.table.name)
    for _ in range(INPUTS):
        seen = snapshot(known, table, rng)
        try:
            yield set(map(str, matching_lines(text.table, seen))), set(map(str, matching_lines(table, seen)))
        except (KeyError, *UNDEFINED):
            continue


def campaign(count: int, seed: str) -> tuple[Counter[Outcome], int]:
    """Draw tables until so many repairs are proved; return what came of all, and of how many tables."""
    came, number = Counter[Outcome](), 0
    while came[Outcome.HOLDS] < count:
        with tempfile.TemporaryDirectory(prefix="rcsc-applied-") as place:
            try:
                came += held(Path(place), random.Random(f"{seed} {number}"))
            except AssertionError as wrong:
                raise AssertionError(f"table {number}: {wrong}") from wrong
        number += 1
    return came, number


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=1000, help="repairs that are proved")
    arguments.add_argument("--seed", default="1")
    given = arguments.parse_args()
    came, tables = campaign(given.count, given.seed)
    told = ", ".join(f"{many} {outcome.name.lower()}" for outcome, many in came.items())
    print(f"{tables} tables: {told}; all that hold were written out, and hold")


if __name__ == "__main__":
    main()
