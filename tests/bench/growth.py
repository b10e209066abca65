"""How the proof of the levels together grows: `python -m tests.bench.growth`.

Chains of n levels and m tables, in the shape of the shipped ones: every level has a PAUSE table and a table for each other command, each of
which orders two commands of the level below, one after the other; states are deferred, orders numbered, DEFAULT declared unreachable.
Printed: seconds and questions to the solvers, of a level and of the system, what is not proved (`open`), and the ratio to the row before.
Levels are proved one by one: the questions of a system are the sum of its levels' (`tests/compose/test_hierarchies.py`).

`--across N...`: requirements across chains of so many levels of three tables each. A PAUSE of the highest reaches the lowest after a tick a
level; and one that the lowest two keep, whatever stands above them. Processor time is drawn: where it doubles, a bar is longer by `BAR`.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import log2
from pathlib import Path
from unittest.mock import patch

from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.assume_guarantee import agreements
from rcsc.compose.proof.level import prove_level
from rcsc.compose.proof.system import transition_systems
from rcsc.compose.together.proof import Across, Question
from rcsc.compose.together.words import stated_across
from rcsc.proof.solvers.sat import Sat
from rcsc.proof.solvers.smt import Solver
from rcsc.run.description import description
from tests.small_hierarchies.made import BOTTOM, RIGHT, Hierarchy, Line, MadeLevel, MadeTable
from tests.small_hierarchies.text import written

DEEPER = tuple((20,) * levels for levels in (1, 2, 4, 7, 10))
"""Tables of each level, from the top down: the same for all, and more and more levels."""
WIDER = tuple((tables, 3) for tables in (10, 20, 40, 60))
"""More and more tables in the upper one of two levels."""
BROADER = tuple((tables, tables) for tables in (10, 20, 40, 60))
"""In both: with the commands of the upper level those that it orders."""
BAR = 6


@dataclass
class Asked:
    """Questions put to the solvers."""

    many: int = 0


@contextmanager
def asked() -> Iterator[Asked]:
    """Counts the questions that are asked meanwhile, of the SAT solver and of Z3."""
    found = Asked()
    holds, check = Sat.holds, Solver.check

    def counted_holds(self: Sat, *args: object) -> bool:
        found.many += 1
        return holds(self, *args)  # type: ignore[arg-type]  # handed on as it comes

    def counted_check(self: Solver, *args: object) -> object:
        found.many += 1
        return check(self, *args)  # type: ignore[arg-type]  # likewise

    with patch.object(Sat, "holds", counted_holds), patch.object(Solver, "check", counted_check):
        yield found


@dataclass(frozen=True)
class Cost:
    """What the proof of one level took."""

    level: str
    tables: int
    seconds: float
    questions: int
    open: int


def chain(tables: Sequence[int]) -> Hierarchy:
    """Levels with so many tables each, from the top down: PAUSE and at least one other."""
    made: list[MadeLevel] = []
    for at, many in reversed(list(enumerate(tables))):
        commands = ("pause", *(f"c{number}" for number in range(1, many)))
        made.insert(0, _upper(at, commands, made[0]) if made else _lowest(at, commands))
    return Hierarchy(tuple(made))


def _lowest(at: int, commands: tuple[str, ...]) -> MadeLevel:
    new, old = ("new_command", "true"), ("new_command", "false")
    going = (old, ("cur_state", "s1"))
    lines = (
        Line("1", (new,), ("state(s1)",), "", "executing"),
        Line("2", (*going, ("there", "false")), (), "", "executing"),
        Line("3", (*going, ("there", "true")), ("state(d_state)",), "", "done"),
        Line("4", (old, ("cur_state", "d_state")), (), "", "done"),
        Line("5", (old, ("cur_state", "f_state")), (), "", "failed"),
    )
    rest = MadeTable("rest", (Line("1", (("when", "true"),), ("state(d_state)",), "", "done"),))
    tables = (rest, *(MadeTable(f"{command}_table", lines) for command in commands[1:]))
    return MadeLevel(f"l{at}", "", commands, (), tables, tuple((name, RIGHT[name]) for name in BOTTOM))


def _upper(at: int, commands: tuple[str, ...], under: MadeLevel) -> MadeLevel:
    calm = Line("1", (("when", "true"),), ("begin", "nextstate(d_state)"), "pause", "done")
    tables = [MadeTable("rest", (calm,))]
    others = under.commands[1:]
    for number, command in enumerate(commands[1:]):
        plan = (others[number % len(others)], others[(number + 1) % len(others)])
        tables.append(_in_turn(f"{command}_table", plan))
    return MadeLevel(f"l{at}", under.name, commands, under.commands, tuple(tables), tuple(RIGHT.items()))


def _in_turn(name: str, plan: tuple[str, str]) -> MadeTable:
    """First the one order, then the other."""
    old = ("new_command", "false")
    lines = [Line("0", (("new_command", "true"),), ("begin", "nextstate(s1)"), plan[0], "executing")]
    for at, (order, call, then, said) in enumerate(
        ((plan[0], "nextstate(s2)", plan[1], "executing"), (plan[1], "nextstate(d_state)", "pause", "done")),
        1,
    ):
        here = (old, ("ref_command_in", order), ("cur_state", f"s{at}"))
        lines += [
            Line(f"{at}a", (*here, ("status_in", "executing")), (), "", "executing"),
            Line(f"{at}b", (*here, ("status_in", "failed")), ("nextstate(f_state)",), "pause", "failed"),
            Line(f"{at}c", (*here, ("status_in", "done")), (call,), then, said),
        ]
    lines.append(Line("8", (old, ("cur_state", "d_state")), (), "pause", "done"))
    lines.append(Line("9", (old, ("cur_state", "f_state")), (), "pause", "failed"))
    return MadeTable(name, tuple(lines), "DEFAULT unreachable")


def costs(made: Hierarchy, effort: Effort | None = None) -> list[Cost]:
    """What each level of a system took.

    Raises:
        AssertionError: The levels are proved, and do not agree: they would be other levels than they are meant to be.
    """
    with tempfile.TemporaryDirectory(prefix="rcsc-growth-") as folder:
        known = transition_systems(written(made, Path(folder)))
    found, proofs = [], {}
    for level in made.levels:
        begun = time.perf_counter()
        with asked() as questions:
            proofs[level.name] = prove_level(known[level.name], effort)
        seconds = time.perf_counter() - begun
        left = len(proofs[level.name].open)
        found.append(Cost(level.name, len(level.tables), seconds, questions.many, left))
    assert any(cost.open for cost in found) or all(agreement.holds for agreement in agreements(known, proofs))
    return found


def rows(sizes: Sequence[Sequence[int]]) -> Iterator[str]:
    yield (
        f"{'levels':>6} {'tables':>6} {'seconds':>8} {'questions':>9} {'s a level':>9} "
        f"{'of the dearest':>14} {'open':>5} {'tables x':>8} {'seconds x':>9} {'questions x':>11}"
    )
    last: tuple[int, float, int] | None = None
    for size in sizes:
        levels, tables = len(size), sum(size)
        found = costs(chain(size))
        seconds, questions = sum(cost.seconds for cost in found), sum(cost.questions for cost in found)
        ratio = ""
        if last is not None:
            ratio = f"{tables / last[0]:>8.2f} {seconds / last[1]:>9.2f} {questions / last[2]:>11.2f}"
        last = tables, seconds, questions
        dearest, left = max(cost.seconds for cost in found), sum(cost.open for cost in found)
        yield f"{levels:>6} {tables:>6} {seconds:>8.1f} {questions:>9} {seconds / levels:>9.2f} {dearest:>14.2f} {left:>5} {ratio}"


def across(levels: int) -> Iterator[tuple[str, Across, float]]:
    """Answer two requirements of a chain: one from end to end, one of the lowest two levels; yield each with its processor time.

    The levels are proved before, as `rcsc prove` does, and that is not counted.
    """
    with tempfile.TemporaryDirectory(prefix="rcsc-growth-") as folder:
        path = written(chain((3,) * levels), Path(folder))
        path.write_text('requirements = "all.rcs"\n' + path.read_text(encoding="utf-8"), encoding="utf-8")
        (path.parent / "all.rcs").write_text(
            "".join(
                f"requirement {name} : whenever l{upper}.command.input_command = pause for {levels - 1 - upper} cycles, "
                f"at once l{levels - 1}.command.input_command = pause\n"
                for name, upper in (("end_to_end", 0), ("lowest_two", levels - 2))
            ),
            encoding="utf-8",
        )
        known, system = transition_systems(path), description(path)
        stated = stated_across(system, {name: ts.program for name, ts in known.items()})
        assert stated is not None
        proofs = {name: prove_level(ts) for name, ts in known.items()}
        for one in stated[0].properties:
            begun = time.process_time()
            found = Question(known, system, stated[0], one, proofs).verdict()
            yield one.name, found, time.process_time() - begun


def main(arguments: list[str] | None = None) -> int:
    """Prints the tables, or one size level by level."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.growth", description=__doc__)
    parser.add_argument(
        "--tables", type=int, nargs="+", default=(), help="one size only: the tables of each level"
    )
    parser.add_argument(
        "--across", type=int, nargs="+", default=(), help="requirements across chains of so many levels"
    )
    given = parser.parse_args(arguments)
    for levels in given.across:
        for name, found, seconds in across(levels):
            verdict = "proved" if found.proved else "open"
            drawn = "#" * round(BAR * log2(1 + seconds))
            print(
                f"{levels:>6} levels  {name:12} {verdict} of {len(found.levels):>2}  {seconds:>6.1f} s {drawn}",
                flush=True,
            )
    if given.across:
        return 0
    if given.tables:
        for cost in costs(chain(given.tables)):
            print(
                f"{cost.level:6} {cost.tables:4} tables {cost.seconds:8.2f} s {cost.questions:7} questions",
                flush=True,
            )
        return 0
    for sizes in (DEEPER, WIDER, BROADER):
        for row in rows(sizes):
            print(row, flush=True)
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
