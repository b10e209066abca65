"""Compiles the emitted C with the shim and runs it on rows of values.

In: a program, its symbols, the folder of its emitted C. Out: traces and complete states, as the C leaves
them. Two builds: a shared object that is called through ctypes, and a program under AddressSanitizer and
UndefinedBehaviorSanitizer that reads the same rows from a file, in a process of its own.
"""

import ctypes
import struct
from array import array
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from rcsc.base.host.children import scratch
from rcsc.base.host.files.read import MOST_OF_OURS, content
from rcsc.base.host.tools import Absent, BuildFailed, c_compiler, run_command, write_c
from rcsc.code.testing.executors.reference_file import monitored
from rcsc.code.testing.executors.shim import TRACE_WORDS, shim_c, words
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import Bool, Program, Real, Scalar, Snapshot, Value

FLAGS = ("-std=gnu11", "-O1", "-w", "-ffp-contract=off")
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O0")
"""Not optimized: so nothing is removed that the sanitizers might see, and it is compiled in half the time."""
COMPILE_S = 300.0


@dataclass(frozen=True, slots=True)
class NativeRun:
    """The result of one run, and the state after it.

    Attributes:
        result: What the function gave: a line index, or a fault code.
        failed: Numbers of the assumptions that are checked and failed.
    """

    result: int
    fault: int
    fault_at: int
    line: int
    failed: tuple[int, ...]
    snapshot: dict[str, Value] = field(hash=False)


def to_word(kind: Scalar, value: Value) -> int:
    """Return a value as the signed 64-bit word that the shim takes."""
    if isinstance(kind, Real):
        word: int = struct.unpack("<q", struct.pack("<d", float(value)))[0]
        return word
    number = int(value) & 0xFFFF_FFFF_FFFF_FFFF
    return number - (1 << 64) if number >> 63 else number


def of_word(kind: Scalar, word: int, unsigned: bool) -> Value:
    """Return the value that a word stands for."""
    if isinstance(kind, Real):
        value: float = struct.unpack("<d", struct.pack("<q", word))[0]
        return value
    if isinstance(kind, Bool):
        return bool(word) if word in (0, 1) else word
    return word & 0xFFFF_FFFF_FFFF_FFFF if unsigned else word


@dataclass(slots=True)
class Native:
    """A compiled program; a context manager, since its files are temporary."""

    program: Program
    symbols: Symbols
    folder: ExitStack
    library: ctypes.CDLL
    checked: Path | None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.folder.close()

    def rows(self, snapshots: Sequence[Snapshot]) -> "array[int]":
        """Return the snapshots as words, row after row."""
        packed = array("q")
        for snapshot in snapshots:
            packed.extend(to_word(v.type, snapshot[v.name]) for v in self.program.variables)
        return packed

    def run(self, which: int, mode: int, snapshots: Sequence[Snapshot]) -> list[NativeRun]:
        """Runs a session of function `which` in the shared object; see `shim`."""
        given, width = self.rows(snapshots), words(self.program)
        output = array("q", bytes(8 * width * len(snapshots)))
        pointer = ctypes.POINTER(ctypes.c_int64)
        address = [ctypes.cast(a.buffer_info()[0], pointer) for a in (given, output)]
        self.library.rcsc_session(which, mode, ctypes.c_int64(len(snapshots)), *address)
        return self.results(output)

    def results(self, output: "array[int]") -> list[NativeRun]:
        """Return rows of words as results."""
        width, count = words(self.program), len(monitored(self.program))
        leaves = [
            (str(v.name), v.type, self.symbols.c_type(v.name) == "uint64_t") for v in self.program.variables
        ]
        return [_result(leaves, count, output[at : at + width]) for at in range(0, len(output), width)]

    def run_checked(
        self, sessions: Sequence[tuple[int, int, Sequence[Snapshot]]]
    ) -> list[list[NativeRun]] | BuildFailed | Absent:
        """The same sessions in the sanitized program; any finding of the sanitizers stops it."""
        if self.checked is None:
            return Absent("the C compiler has no address and undefined behaviour sanitizers")
        place = self.checked.parent
        with (place / "in.bin").open("wb") as file:
            for which, mode, snapshots in sessions:
                array("q", [which, mode, len(snapshots)]).tofile(file)
                self.rows(snapshots).tofile(file)
        ran = run_command([str(self.checked), "in.bin", "out.bin"], place, COMPILE_S)
        if ran.status != 0:
            return BuildFailed("\n".join(ran.err.strip().splitlines()[:6]) or f"exit status {ran.status}")
        output = array("q")
        output.frombytes(content(place / "out.bin", MOST_OF_OURS))
        return self._parted(output, [len(snapshots) for _, _, snapshots in sessions])

    def _parted(self, output: "array[int]", lengths: Sequence[int]) -> list[list[NativeRun]]:
        parts, results = [], self.results(output)
        at = 0
        for length in lengths:
            parts.append(results[at : at + length])
            at += length
        return parts


def _result(leaves: Sequence[tuple[str, Scalar, bool]], count: int, row: Sequence[int]) -> NativeRun:
    """Return a row as a result; `leaves` has the name and type of each leaf, and whether C holds it in 64 bits without a sign."""
    failed = tuple(at for at in range(count) if row[TRACE_WORDS + at])
    given = zip(leaves, row[TRACE_WORDS + count :], strict=True)
    snapshot = {name: of_word(kind, word, unsigned) for (name, kind, unsigned), word in given}
    return NativeRun(row[0], row[1], row[2], row[3], failed, snapshot)


def build(
    program: Program, symbols: Symbols, sources: Mapping[str, str], checked: bool = True
) -> Native | BuildFailed | Absent:
    """Compiles the emitted C with the shim.

    Args:
        program: The program.
        symbols: Names in its emitted C.
        sources: The emitted files, text by path.
        checked: Whether to make the sanitized program too.
    """
    compiler = c_compiler()
    if isinstance(compiler, Absent):
        return compiler
    folder = ExitStack()
    place = folder.enter_context(scratch("test"))
    (place / "shim.c").write_text(shim_c(program, symbols), "utf-8")
    files = ["shim.c", *write_c(sources, place)]
    ran = run_command([compiler, *FLAGS, "-shared", "-fPIC", "-o", "shim.so", *files], place, COMPILE_S)
    if ran.status != 0:
        folder.close()
        return BuildFailed("\n".join(ran.err.strip().splitlines()[:6]) or "the C compiler ran out of time")
    if checked:
        ran = run_command([compiler, *FLAGS, *SANITIZED, "-o", "checked", *files], place, COMPILE_S)
    program_path = place / "checked" if checked and ran.status == 0 else None
    library = ctypes.CDLL(str(place / "shim.so"))
    library.rcsc_session.restype = None
    return Native(program, symbols, folder, library, program_path)
