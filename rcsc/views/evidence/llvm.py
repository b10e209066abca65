"""What clang and llvm-cov measure of the emitted C while vectors are played.

In: the emitted files and a C file that plays vectors. Out: the outcomes of every branch, the MC/DC of every decision,
and the text that llvm-cov prints. Clang's runtime library is not needed: `profile.c` writes the profile.
"""

import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.base.host.children import Ran, scratch
from rcsc.base.host.files.read import Malformed, json_of
from rcsc.base.host.tools import Absent, BuildFailed, ending, run_command, write_c
from rcsc.code.testing.executors.symbols import text_of

VERSIONS = ("19", "20", "21", "22")
"""Of LLVM: from 18 on clang measures MC/DC; from 19 on of decisions of more than six conditions."""
COMPILE_S = 300.0
MEASURED = (
    "-fprofile-instr-generate",
    "-fcoverage-mapping",
    "-fcoverage-mcdc",
    "-fcoverage-compilation-dir=.",
)
PROFILE = Path(__file__).with_name("profile.c")


@dataclass(frozen=True, slots=True)
class Tools:
    """The tools, of one version of LLVM."""

    version: str
    clang: str
    profdata: str
    cov: str


@dataclass(frozen=True, slots=True)
class Point:
    """A condition of a branch.

    Attributes:
        function: The function that it stands in.
        line, column: Where it begins, from 1.
        text: The condition as it stands; up to the end of its line.
        true, false: How often it was true, and false.
    """

    function: str
    line: int
    column: int
    text: str
    true: int
    false: int


@dataclass(frozen=True, slots=True)
class Decision:
    """A decision of several conditions, and whether each was shown to decide on its own."""

    function: str
    line: int
    column: int
    shown: tuple[bool, ...]


@dataclass(frozen=True, slots=True)
class Region:
    """Statements that nothing parts, how they begin, and how often they ran."""

    function: str
    line: int
    text: str
    count: int


@dataclass(frozen=True, slots=True)
class Measured:
    """The measurements of one C file.

    Attributes:
        branches, decisions, regions: In the order of the file.
        text: The file as llvm-cov prints it, with counts.
        played: The output of the program that played the vectors.
        passed: Whether all of them gave the right result.
    """

    branches: tuple[Point, ...]
    decisions: tuple[Decision, ...]
    regions: tuple[Region, ...]
    text: str
    played: str
    passed: bool

    @property
    def counts(self) -> dict[str, tuple[int, int]]:
        """For statements, branches and MC/DC, in words: all, and those that were covered."""
        covered = {
            "blocks of statements": [region.count > 0 for region in self.regions],
            "outcomes of branches": [n > 0 for point in self.branches for n in (point.true, point.false)],
            "MC/DC conditions": [each for decision in self.decisions for each in decision.shown],
        }
        return {words: (len(each), sum(each)) for words, each in covered.items()}


def tools() -> Tools | Absent:
    """Return the newest tools whose formats this module knows."""
    for version in reversed(VERSIONS):
        found = [shutil.which(f"{tool}-{version}") for tool in ("clang", "llvm-profdata", "llvm-cov")]
        clang, profdata, cov = found
        if clang and profdata and cov:
            return Tools(version, clang, profdata, cov)
    return Absent(
        "clang, llvm-profdata and llvm-cov of LLVM 19 are not installed: apt install clang-19 llvm-19"
    )


def measured(llvm: Tools, files: Mapping[str, str], source: str, vectors: str) -> Measured | BuildFailed:
    """Build the emitted C with counters, play the vectors, and read the counts.

    Args:
        llvm: The tools.
        files: The emitted files, text by path.
        source: File name of the C that is measured; other C is built as it is.
        vectors: A C file that plays vectors of it.
    """
    profile = ["-instr-profile", "vectors.profdata", "play"]
    with scratch("coverage") as place:
        others = [name for name in write_c(files, place) if name != source]
        (place / "vectors.c").write_text(vectors, "utf-8")
        shutil.copyfile(PROFILE, place / "profile.c")
        measuring = ["-std=c99", "-O1", "-w", *MEASURED]
        play = "-std=gnu11 -O1 -w -o play measured.o profile.c vectors.c".split()
        said = list[Ran]()
        for command, made in (
            ([llvm.clang, *measuring, "-c", source, "-o", "measured.o"], "measured.o"),
            ([llvm.clang, *play, *others], "play"),
            ([str(place / "play")], "vectors.profraw"),
            ([llvm.profdata, "merge", "-o", "vectors.profdata", "vectors.profraw"], "vectors.profdata"),
            ([llvm.cov, "show", *profile, "--show-mcdc", "--show-branches=count"], ""),
            ([llvm.cov, "export", *profile], ""),
        ):
            said.append(run_command(command, place, COMPILE_S))
            wrong = (
                said[-1].status != 0 and made != "vectors.profraw"
            )  # vectors may be wrong, and are told then
            if wrong or not (place / made).exists():
                return BuildFailed(_stopped(Path(command[0]).name, said[-1]))
    played, shown, exported = said[2], said[4], said[5]
    try:
        data = json_of(exported.raw, plain=False)["data"][0]
        seen = _read(data, text_of(source, files), shown.out, played.out, played.status == 0)
    except (Malformed, LookupError, TypeError):
        return BuildFailed(
            f"what {Path(llvm.cov).name} exports cannot be read: {ending(exported, COMPILE_S)}"
        )
    return seen if seen.regions else BuildFailed(f"{Path(llvm.cov).name} counted nothing")


def _stopped(tool: str, ran: Ran) -> str:
    """Return the reason why a command failed: the first lines of its errors."""
    first = "\n".join(ran.err.strip().splitlines()[:6])
    return first or f"{tool} {ending(ran, COMPILE_S)}"


def _read(data: Mapping[str, Any], text: str, shown: str, played: str, passed: bool) -> Measured:
    """Read the export of llvm-cov (its format 2.0.1)."""
    lines = text.splitlines()
    branches, decisions, regions = list[Point](), list[Decision](), list[Region]()
    for function in data["functions"]:
        name = function["name"].rpartition(":")[2]
        branches += _branches(name, function["branches"], lines)
        decisions += (
            Decision(name, record[0], record[1], tuple(record[-1])) for record in function["mcdc_records"]
        )
        regions += (
            Region(name, r[0], lines[r[0] - 1][r[1] - 1 :], r[4]) for r in function["regions"] if r[7] == CODE
        )
    return Measured(
        tuple(sorted(branches, key=lambda b: (b.line, b.column))),
        tuple(sorted(decisions, key=lambda d: (d.line, d.column))),
        tuple(sorted(regions, key=lambda r: r.line)),
        shown,
        played,
        passed,
    )


CODE = 0
"""The kind of a region that is statements."""


def _branches(function: str, records: list[list[int]], lines: list[str]) -> Iterator[Point]:
    for line, column, last, end, true, false, *_ in records:
        text = lines[line - 1][column - 1 : end - 1 if last == line else None]
        yield Point(function, line, column, text, true, false)
