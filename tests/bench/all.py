"""What a user waits for, in one table: `python -m tests.bench.all`; ten minutes on two processors.

Each row has its cost here, and in the same run that of something known beside it: an empty Python, Z3 on the same table, a scan
of all lines. Ratios hold on other machines too, seconds do not. Seconds are of the processor, so that a busy machine prints
much the same; those of a command are of its whole process and all that it started. `-` is no answer within the limit of a row.
"""

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rcsc.code.emit import emitted
from rcsc.code.emit.lower import lower
from rcsc.lang.model import ProvedProgram, seal_of_proof
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.decide import prove_table
from tests.bench import executors, loop
from tests.bench.made import families
from tests.bench.made.families import Fault
from tests.bench.made.peers import PEERS, python_bitset
from tests.bench.proofs import compiled, limited

REPO = Path(__file__).parents[2]
RCSC = (str(Path(sys.executable).with_name("rcsc")),)
LIMIT_S = 60.0
EPISODES = 100
ROUNDS = 3
REPEATED = 100


@dataclass(frozen=True, slots=True)
class Cost:
    """A row.

    Attributes:
        what: What was done.
        here: What it costs here, in words.
        beside: What else was measured in the same run, in words.
        times: How much of the latter the former is; None where there is nothing beside it.
    """

    what: str
    here: str
    beside: str = ""
    times: float | None = None

    def __str__(self) -> str:
        ratio = "" if self.times is None else f"{self.times:8.2f} x"
        return f"{self.what:48}{self.here:>34}{ratio:>12}  {self.beside}"


def seconds(*command: str, folder: Path = REPO, ends: tuple[int, ...] = (0,)) -> float:
    """Seconds of the processor that a process and its children take.

    Raises:
        AssertionError: It ends otherwise than it should.
    """
    before = os.times()
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    after = os.times()
    assert ended.returncode in ends, f"{command}: {ended.returncode}\n{ended.stderr[-2000:]}"
    return after.children_user + after.children_system - before.children_user - before.children_system


def killed(*command: str, folder: Path, after_s: float) -> None:
    """Start a process that the kernel kills, without a word to it, once it has had so many seconds of the processor.

    Raises:
        AssertionError: It ends before.
    """
    limit = max(1, round(after_s))
    ended = subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)),
    )
    assert ended.returncode == -signal.SIGKILL, f"{command}: {ended.returncode}"


def least(work: Callable[[], float]) -> float:
    """The least of some: the others waited for somebody else."""
    return min(work() for _ in range(ROUNDS))


# --- whole processes ---


def commands(folder: Path) -> Iterator[Cost]:
    """What one types: `check`, `prove`, `test`, `campaign`, on a copy of the shipped tables."""
    shutil.copytree(REPO / "tables", folder / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
    shutil.copytree(REPO / "generated", folder / "generated")

    def rcsc(*words: str, ends: tuple[int, ...] = (0,)) -> float:
        return seconds(*RCSC, *words, folder=folder, ends=ends)

    empty = least(lambda: seconds(sys.executable, "-c", ""))
    solver = least(lambda: seconds(sys.executable, "-c", "import z3"))
    yield Cost("an empty Python; importing Z3", f"{empty:.3f} s; {solver:.3f} s")
    levels = [f"tables/{name}" for name in ("task", "emove", "primitive", "vision", "gripper")]
    for what, paths in (("a small file", ["tables/gripper"]), ("24 shipped tables", levels)):
        cold = least(lambda paths=paths: rcsc("check", "--no-cache", *paths))  # type: ignore[misc]
        rcsc("check", *paths)
        warm = least(lambda paths=paths: rcsc("check", *paths))  # type: ignore[misc]
        for how, spent in (("cold", cold), ("warm", warm)):
            yield Cost(f"rcsc check, {what}, {how}", f"{spent:.3f} s", "an empty Python", spent / empty)
    yield from proofs_of_levels(folder, rcsc, empty)
    yield Cost("rcsc test of one level", f"{rcsc('test', '--no-cache', 'tables/gripper'):.1f} s")
    rcsc("campaign", "--episodes", "1", "--plant", "kinematic")
    begun = least(lambda: rcsc("campaign", "--episodes", "1", "--plant", "kinematic"))
    played = rcsc("campaign", "--episodes", str(EPISODES + 1), "--plant", "kinematic")
    yield Cost("rcsc campaign, kinematic, all included", f"{EPISODES / played:.1f} episodes a CPU second")
    alone = f"{EPISODES / (played - begun):.1f} episodes a CPU second"
    yield Cost("rcsc campaign, kinematic, the episodes alone", alone, f"to begin and end takes {begun:.1f} s")


def proofs_of_levels(folder: Path, rcsc: Callable[..., float], empty: float) -> Iterator[Cost]:
    """The shipped system's levels together: cold, nothing changed, one cell changed, killed half-way and run again."""
    beside = "an empty Python"
    cold = rcsc("prove", "tables/system.toml")
    yield Cost("rcsc prove, the shipped system, cold", f"{cold:.1f} s", beside, cold / empty)
    warm = least(lambda: rcsc("prove", "tables/system.toml"))
    yield Cost("rcsc prove, nothing changed", f"{warm:.2f} s", beside, warm / empty)
    table = folder / "tables" / "task" / "move.rcs"
    text = table.read_text("utf-8")
    changed = re.sub(r"nextstate\((state_\d)\)", "nextstate(f_state)", text, count=1)
    assert changed != text
    table.write_text(changed, "utf-8")
    spent = rcsc("prove", "tables/system.toml", ends=(0, 1))
    table.write_text(text, "utf-8")
    yield Cost("rcsc prove, one cell changed", f"{spent:.1f} s", "cold", spent / cold)
    again = folder / "again"
    shutil.copytree(REPO / "tables", again / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
    prove = (*RCSC, "prove", "--jobs", "1", "tables/system.toml")
    killed(*prove, folder=again, after_s=cold / 2)
    rest = seconds(*prove, folder=again)
    yield Cost("rcsc prove, killed half-way, run again", f"{rest:.1f} s", "cold", rest / cold)


# --- proofs ---


def parts(family: str, lines: int, variables: int, fault: Fault, widened: int = 0) -> str:
    """Seconds to read a made table, to resolve it, and to prove it or find what is wrong."""
    shape = {"widened": widened} if widened else {}
    text = getattr(families, family)(lines, variables, lines + variables, fault, **shape)
    load(["-"], "")
    small = compiled(families.linear(4, 2, 1))  # so that nothing is imported while it is timed
    prove_table(small, small.tables[0], Options(solver="boxes"))
    begun = time.process_time()
    loaded = load(["-"], text)
    read = time.process_time()
    program = resolve(loaded.roots[0], loaded)
    assert not isinstance(program, tuple)
    resolved = time.process_time()
    verdict = prove_table(program, program.tables[0], Options(solver="boxes"))
    proved = time.process_time()
    assert bool(verdict.findings) == (fault != "ok" or widened > 0)
    return f"{read - begun:.3f} / {resolved - read:.3f} / {proved - resolved:.4f} s"


def by_z3(family: str, lines: int, variables: int) -> str:
    """Seconds that Z3 takes for the same two questions of a table in order."""
    program = compiled(getattr(families, family)(lines, variables, lines + variables))
    [peer] = [peer for peer in PEERS if peer.name == "Z3, two queries"]
    begun = time.process_time()
    assert peer.decide(program, program.tables[0])
    return f"{time.process_time() - begun:.3f}"


PROOFS: tuple[tuple[str, int, int, Fault, int, bool], ...] = (
    ("box", 16, 7, "ok", 0, True),
    ("box", 64, 7, "ok", 0, True),
    ("box", 256, 20, "ok", 0, True),
    ("box", 16384, 50, "ok", 0, False),
    ("box", 2000, 24, "gap", 40, False),
    ("box", 2000, 24, "gap", 100, False),
    ("linear", 40, 4, "ok", 0, True),
    ("linear", 256, 6, "ok", 0, True),
    ("linear", 1024, 6, "ok", 0, True),
    ("cells", 8, 2, "ok", 0, True),
    ("cells", 30, 2, "ok", 0, True),
    ("linear", 1024, 6, "overlap", 0, False),
    ("linear", 1024, 6, "ok", 3, False),
)


def proofs() -> Iterator[Cost]:
    """Made tables: read, resolved, proved, beside Z3's two queries."""
    for family, lines, variables, fault, widened, beside in PROOFS:
        faults = {"ok": "", "gap": ", a gap", "overlap": ", an overlap"}[fault]
        wide = f", {widened} widened" if widened else ""
        what = f"{family} {lines} x {variables}{faults}{wide}: read / resolve / prove"
        ours = limited(LIMIT_S, parts, family, lines, variables, fault, widened)
        theirs = limited(LIMIT_S, by_z3, family, lines, variables) if beside else ""
        known = "/" in ours and theirs not in {"", "-", "failed"}
        ratio = float(ours.rpartition("/ ")[2].removesuffix(" s")) / float(theirs) if known else None
        yield Cost(what, ours, f"Z3: {theirs} s" if theirs else "", ratio)


def small_proofs() -> Iterator[Cost]:
    """Small tables of boxes, proved with a certificate, beside the least that decides them: masks and volumes."""

    def milliseconds(work: Callable[[], object]) -> float:
        def once() -> float:
            begun = time.perf_counter()
            work()
            return time.perf_counter() - begun

        return 1e3 * min(once() for _ in range(REPEATED))

    for lines, variables in ((16, 7), (64, 7), (256, 20)):
        program = compiled(families.box(lines, variables, lines + variables))
        [table] = program.tables
        ours = milliseconds(partial(prove_table, program, table, Options(solver="boxes")))
        theirs = milliseconds(partial(python_bitset, program, table))
        what = f"box {lines} x {variables}: prove, again and again"
        yield Cost(what, f"{ours:.2f} ms", f"masks alone: {theirs:.2f} ms", ours / theirs)


# --- executors ---


def matches() -> Iterator[Cost]:
    """The matchers in C, beside a scan."""
    for label, program in executors.programs():
        one = executors.measured(label, program)
        yield Cost(f"C match, {label}", f"{one.ours:.0f} instructions", "a scan", one.ours / one.scan)


def size(lines: int, variables: int) -> Cost:
    """Bytes of the C of a large table, and what the compiler needs for it."""
    program = compiled(families.box(lines, variables, lines + variables))
    plan = lower(ProvedProgram(program, seal_of_proof()))  # right by construction; `proofs` proves it
    files = emitted(plan, ("c",))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, text in files.items():
            (folder / Path(name).name).write_text(text)
        [source] = folder.glob("*.c")
        spent = seconds(shutil.which("cc") or "cc", "-std=c99", "-O2", "-c", source.name, folder=folder)
        objects = source.with_suffix(".o").stat().st_size
        megabytes = f"{source.stat().st_size / 1e6:.1f} / {objects / 1e6:.1f} MB, {spent:.1f} s"
    return Cost(f"C of {lines} x {variables}: source / object, compiler", megabytes)


def cell(folder: Path) -> Cost:
    """MAKE BOXT by contact physics."""
    one = loop.best("mujoco", "c", folder / "run.mcap")
    here = f"{one.control / one.whole:.0f} times real time"
    return Cost("MAKE BOXT by contact physics", here, f"of it the plant: {one.plant / one.whole:.0%}")


def main() -> None:
    """Prints the table, row by row as each is measured."""
    with tempfile.TemporaryDirectory() as scratch:
        for row in commands(Path(scratch)):
            print(row, flush=True)
        for rows in (
            proofs(),
            small_proofs(),
            matches(),
            iter([size(4096, 50)]),
            iter([cell(Path(scratch))]),
        ):
            for row in rows:
                print(row, flush=True)


if __name__ == "__main__":
    main()
