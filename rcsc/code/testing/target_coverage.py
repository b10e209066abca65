"""What the compiler of a small processor counts of the emitted C while vectors are played on its emulator.

In: the emitted files, and a C file that plays vectors. Out: how many lines and branches were reached, as gcov counts them, and how many
vectors were played. gcc keeps its counters in the image (`-fprofile-info-section`), which prints them; no file system is needed.
Statements and branches are counted so; MC/DC is counted by gcc from version 14 on, and by clang on the host.

Source: GCC 12, "Profiling and Test Coverage in Freestanding Environments" (Gcov, 10.6).
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.base.host.files.read import Malformed, json_of
from rcsc.base.host.tools import Absent, BuildFailed, run_command
from rcsc.code.testing.boards import BOARDS, COMPILE_S, HARNESS, run_image

BOARD = next(board for board in BOARDS if board.name == "Cortex-M3")
COUNTED = ("-O0", "--coverage", "-fprofile-info-section")
MAIN = """
#include <gcov.h>
#define VECTORS_NO_MAIN
#define vectors played /* the image has vectors of interrupts */
#include "vectors.c"
extern const struct gcov_info *const __gcov_info_start[];
extern const struct gcov_info *const __gcov_info_end[];
void abort(void);
void abort(void) { fault(); for (;;) { } }
size_t strlen(const char *text);
size_t strlen(const char *text) { size_t n = 0u; while (text[n] != 0) { n++; } return n; }
static void named(const char *name, void *with) { (void)name; (void)with; say("gcda "); }
static void dumped(const void *data, unsigned n, void *with)
{
    static const char digits[] = "0123456789abcdef";
    const uint8_t *bytes = data;
    (void)with;
    for (unsigned i = 0u; i < n; i++) {
        char two[3] = {digits[bytes[i] >> 4], digits[bytes[i] & 15u], 0};
        say(two);
    }
}
static void *allocated(unsigned n, void *with)
{
    static uint64_t memory[4096];
    static unsigned used;
    (void)with;
    used += (n + 7u) / 8u;
    return (used > 4096u) ? (void *)0 : &memory[used - ((n + 7u) / 8u)];
}
int main(void)
{
    uint32_t wrong = 0u, left = 0u;
    for (uint32_t n = 0u; n < vectors_count(); n++) {
        const int32_t result = vectors_play(n);
        wrong += (result > 0) ? 1u : 0u;
        left += (result < 0) ? 1u : 0u;
    }
    say("rcsc "); say_number(vectors_count() - left); say(" "); say_number(wrong); say(" "); say_number(left); say("\\n");
    for (const struct gcov_info *const *info = __gcov_info_start; info != __gcov_info_end; info++) {
        __gcov_info_to_gcda(*info, named, dumped, allocated, (void *)0);
        say("\\n");
    }
    return 0;
}
"""
SAID = re.compile(r"rcsc (\d+) (\d+) (\d+)")
DUMPED = re.compile(r"gcda ([0-9a-f]+)")


@dataclass(frozen=True, slots=True)
class TargetCounts:
    """What was counted.

    Attributes:
        compiler: Its name and version, as it prints them.
        played, wrong, left: Vectors that were played, those of them that failed, and those that this machine cannot be made to play.
        lines, branches: All, and those that were reached.
        text: The file with its counts, as gcov prints it.
    """

    compiler: str
    played: int
    wrong: int
    left: int
    lines: tuple[int, int]
    branches: tuple[int, int]
    text: str

    @property
    def words(self) -> str:
        """The figures as a sentence."""
        lines, branches = (f"{reached} of {every}" for every, reached in (self.lines, self.branches))
        left = f", {self.left} not played: it does not round as they ask" if self.left else ""
        played = f"{self.played} vectors, {self.wrong} wrong{left}"
        return f"on an emulated {BOARD.name}: {lines} lines, {branches} outcomes of branches; {played}; by {self.compiler}"


def counted_on_target(
    files: Mapping[str, str], source: str, vectors: str
) -> TargetCounts | Absent | BuildFailed:
    """Build the emitted C with the target's own counters, play the vectors on its emulator, and read the counts.

    Args:
        files: The emitted files, text by path.
        source: File name of the C that is measured.
        vectors: A C file that plays vectors of it.
    """
    if absent := BOARD.absent():
        return Absent(f"not installed: {absent}")
    with scratch("target") as place:
        (place / "vectors.c").write_text(vectors, "utf-8")
        said = run_image(BOARD, place, files, HARNESS + MAIN, counted={source: COUNTED})
        if isinstance(said, BuildFailed):
            return said
        counts, dump = SAID.search(said), DUMPED.search(said)
        if counts is None or dump is None:
            return BuildFailed(f"the target gave no counts: {said.strip()[:400]}")
        stem = Path(source).stem
        (place / f"{stem}.gcda").write_bytes(bytes.fromhex(dump[1]))
        gcov = [f"{BOARD.tools}gcov", "--branch-probabilities", "--branch-counts", "--stdout", f"{stem}.gcda"]
        read, shown = (run_command([*gcov, *more], place, COMPILE_S) for more in (("--json-format",), ()))
        try:
            [file] = [each for each in json_of(read.raw, plain=False)["files"] if each["file"] == source]
            lines = [line["count"] > 0 for line in file["lines"]]
            branches = [branch["count"] > 0 for line in file["lines"] for branch in line["branches"]]
        except (Malformed, LookupError, TypeError, ValueError):
            return BuildFailed(f"what {gcov[0]} prints cannot be read: {(read.out + read.err).strip()[:400]}")
        played, wrong, left = map(int, counts.groups())
        every = (len(lines), sum(lines)), (len(branches), sum(branches))
        return TargetCounts(BOARD.version, played, wrong, left, *every, shown.out)
