"""Spin on a model: is a check ever broken, and by which run?

In: a `Model`. Out: a `Checked`. Spin makes a program of the model, the C compiler compiles it, and it looks through every state that can be
reached, or with `bitstate` through as many as it comes by. A small model is searched breadth first, and one that breaks a check is
searched again so: the run that is shown is short. Source: the manual pages of Spin and of the verifiers that it makes (`pan`), version 6.5.
"""

import re
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rcsc.compose.promela.assemble import BROKEN, RESTARTED, TAKEN, TOLD, Model
from rcsc.host.children import scratch
from rcsc.host.tools import Absent, c_compiler, run_command

MODEL = "model.pml"
LARGE, LONG_S = 1000, 10.0
"""Lines of the model and seconds of search from which on a faster verifier is worth what the compiler takes for it."""
ENOUGH_S = 600.0
"""For Spin and the compiler."""


class SpinError(Exception):
    """Spin or the compiler refuses what rcsc wrote, or the verifier stopped for no reason of the model's: a bug."""


@dataclass(frozen=True, slots=True)
class Search:
    """How far is looked.

    Attributes:
        seconds: Wall time of the search.
        memory_mb: Past it the search ends, not exhaustive.
        depth: Longest run, in statements.
        bitstate: Keep two bits a state instead of the state; reaches more, is never exhaustive.
    """

    seconds: float = 60.0
    memory_mb: int = 4096
    depth: int = 2_000_000
    bitstate: bool = False


@dataclass(frozen=True, slots=True)
class Checked:
    """What came of it.

    Attributes:
        exhaustive: Every state of the instance was looked at.
        failed: A run breaks a check, or in a model for progress goes on for ever.
        trail: Lines that the run prints which breaks a check; empty where none was found.
        states: Different ones; `seconds`, of the search alone.
    """

    exhaustive: bool
    failed: bool
    trail: tuple[str, ...]
    states: int
    transitions: int
    depth: int
    seconds: float = field(compare=False)
    bitstate: bool = False

    @property
    def broken(self) -> int | None:
        """The number of the check that is broken."""
        numbers = [int(line.split()[1]) for line in self.trail if line.startswith(f"{BROKEN} ")]
        return numbers[-1] if numbers else None


def tools() -> tuple[str, str] | Absent:
    """Spin and the C compiler."""
    spin, compiler = shutil.which("spin"), c_compiler()
    if spin is None:
        return Absent("Spin is not installed (Debian package spin)")
    return compiler if isinstance(compiler, Absent) else (spin, compiler)


def check(model: Model, search: Search | None = None) -> Checked | Absent:
    """Looks for a run that breaks a check; of a model for progress, one in which a command never ends.

    Raises:
        SpinError: Spin or the compiler refuses the model.
    """
    found = tools()
    if isinstance(found, Absent):
        return found
    search = search or Search()
    with scratch("spin") as place:
        (place / MODEL).write_text(model.text, encoding="utf-8")
        _run([found[0], "-a", MODEL], place)
        kind = ["-DNP"] if model.progress else ["-DSAFETY"]
        kind += ["-DBITSTATE"] if search.bitstate else ["-DCOLLAPSE"]
        small = model.text.count("\n") <= LARGE
        if small and not model.progress and not search.bitstate:
            return _searched(found[1], [*kind, "-DBFS"], [], place, search)
        checked = _searched(found[1], kind, ["-l"] if model.progress else [], place, search)
        if checked.failed and not model.progress:
            shorter = Search(min(search.seconds, 20.0), search.memory_mb, search.depth)
            again = _searched(found[1], ["-DSAFETY", "-DCOLLAPSE", "-DBFS"], [], place, shorter)
            if again.failed:
                return again
        return checked


def _searched(
    compiler: str, kind: Sequence[str], options: Sequence[str], place: Path, search: Search
) -> Checked:
    """One verifier, compiled and run."""
    flags = [*kind, "-DNOREDUCE", "-DVECTORSZ=8192", f"-DMEMLIM={search.memory_mb}"]
    lines = (place / MODEL).read_text(encoding="utf-8").count("\n")
    fast = "-O1" if lines > LARGE and search.seconds >= LONG_S else "-O0"
    _run([compiler, fast, "-w", *flags, "-o", "pan", "pan.c"], place)
    trail = place / f"{MODEL}.trail"
    trail.unlink(missing_ok=True)
    begun = time.perf_counter()
    table = "-w30" if "-DBITSTATE" in kind else "-w18"  # of states: grows by itself, but for one of bits
    verifier = ["./pan", f"-m{search.depth}", table, "-n", *options]
    command = ["timeout", "--signal=INT", f"{search.seconds}", *verifier]
    said = run_command(command, place, search.seconds + 60.0)
    seconds = time.perf_counter() - begun
    if "State-vector" not in said.out:
        raise SpinError((said.out + said.err)[-2000:])
    told: tuple[str, ...] = ()
    if re.search(r"^pan:\s*\d+: invalid end state", said.out, re.MULTILINE):
        raise SpinError("a level cannot go on")
    if trail.is_file():
        replay = run_command(["./pan", "-r", "-n"], place, ENOUGH_S)
        words = (TOLD, BROKEN, RESTARTED, TAKEN)
        told = tuple(
            line.strip() for line in replay.out.splitlines() if line.split()[:1] and line.split()[0] in words
        )
    stopped = "Search not completed" in said.out or "max search depth too small" in said.out
    return Checked(
        not stopped and "-DBITSTATE" not in kind, trail.is_file(), told, _number(r"(\d+) states, stored", said.out),
        _number(r"(\d+) transitions", said.out), _number(r"depth reached (\d+)", said.out), seconds, "-DBITSTATE" in kind,
    )  # fmt: skip


def _run(command: Sequence[str], place: Path) -> None:
    ran = run_command(command, place, ENOUGH_S)
    if ran.status != 0 or re.search(r"\berror:", ran.out, re.IGNORECASE):
        raise SpinError(f"{' '.join(command)}: {(ran.out + ran.err)[-2000:]}")


def _number(pattern: str, text: str) -> int:
    found = re.search(pattern, text)
    return int(found[1]) if found else 0
