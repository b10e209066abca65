"""Frama-C's EVA shows that no operation of the generated C can go wrong while it runs, for any state and any inputs.

In: the emitted C of a program. Out: for each access, index, division, shift, conversion and sum that C leaves
undefined, or that loses something, where it stands and what EVA says of it.

Every function that the header declares is called on a state of which nothing is known: `check` and `init` on any
bytes; a cycle, or a step of a table, where `check` accepts it, with any inputs; a matcher with admitted inputs.
With `--defensive` a cycle is called on any bytes, without `check`. The RTE plugin writes down what must hold; EVA
proves it by abstract interpretation, which errs on one side only. EVA keeps a range for each variable, and no relation
between two: where a line's conditions, or two variables together, keep a value where it was proved to be, the C says so
(`emit.ranges`). The options are the same for every program: states are kept apart in the functions that are one chain of
comparisons or that call one (`-eva-slevel-function`). That a boolean which is read is 0 or 1 EVA shows by itself, as it does not
follow RTE's words for it where an index is computed; it then writes down only what it does not show.

A second run takes the reals that come from outside as any finite ones and shows that no operation gives an infinity
or a NaN. EVA 25 does not follow that a comparison with NaN is false: that admission refuses one is shown by tests and by
`model-check`, not here. In the first run a NaN is a value like others; what the first run does not show because of one, and
the second does, is counted apart. The second run takes `volatile` out of the
self-test of the machine's arithmetic, which EVA would take for a sensor: its reals are constants.
"""

import re
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.base.host.files import csv_text, read
from rcsc.base.host.tools import ending, run_command, write_c
from rcsc.code.testing.executors.symbols import Symbols, symbols_of
from rcsc.lang.model import I64_MAX, Program, Real, Scalar
from rcsc.lang.model import Kind as Role
from rcsc.views.evidence.analysers import bounds, calls, stand_ins
from rcsc.views.evidence.kind import ABSENT, Evidence, Kind, Shortfall, Subject

PACKAGE = "frama-c-base"
STATES = 1000
"""Number of states that EVA keeps apart in a chain of comparisons: more than a program has variables."""
TIMEOUT_S = 1800.0
MEMORY_MB = 6000
GREATEST = {"double": "0x1.fffffffffffffp+1023", "float": "0x1.fffffep+127"}
OPTIONS = (
    "-machdep", "gcc_x86_64", "-rte", "-warn-signed-downcast", "-warn-unsigned-downcast", "-warn-special-float",
)  # fmt: skip
NUMBER = "is_nan_or_infinite"
"""The class of what must be a number: in the first run where its whole part is taken, in the second after every operation."""
WORDS: Mapping[str, str] = {
    "mem_access": "accesses to memory",
    "index_bound": "indices",
    "division_by_zero": "divisions and remainders",
    "shift": "shifts",
    "signed_overflow": "signed results within their type",
    "signed_downcast": "conversions to a signed type",
    "unsigned_downcast": "conversions to an unsigned type",
    "float_to_int": "conversions of a real to a whole number",
    NUMBER: "reals that are numbers",
    "bool_value": "booleans that are 0 or 1",
    "initialization": "reads of what was written",
    "precondition of __builtin_ctz": "arguments of __builtin_ctz that are not zero",
}
"""The classes of EVA's alarms as text."""
PROVED = frozenset({"Valid", "Considered valid"})
DEAD = "Dead"
FINITE = "Valid for finite reals"
"""The status of a place that one run does not show and the other does: it rests on a real, such as the whole part of one."""
VERDICTS = ("shown", "shown for finite reals", "not shown", "never reached")


@dataclass(frozen=True, slots=True)
class Property:
    """A property that must hold at one place of the C, and EVA's answer.

    Attributes:
        kind: The class of the alarm, as Frama-C names it.
        status: `Valid`, `Dead` (the place is never reached) or what was not shown.
        text: In ACSL.
    """

    file: str
    line: int
    function: str
    kind: str
    status: str
    text: str

    @property
    def place(self) -> tuple[str, int, str, str]:
        """The place and the text of the property, whatever a run shows of it."""
        return self.file, self.line, self.kind, self.text

    @property
    def verdict(self) -> str:
        """The verdict: a column of the certificate."""
        if self.status in PROVED:
            return "shown"
        if self.status == FINITE:
            return "shown for finite reals"
        return "never reached" if self.status == DEAD else "not shown"


@dataclass(frozen=True, slots=True)
class Analysis:
    """One run of EVA: its name, its command, the C by file, what was shown, or why there is no answer."""

    name: str
    command: tuple[str, ...]
    sources: Mapping[str, str]
    properties: tuple[Property, ...]
    failure: str = ""


@cache
def version() -> str | None:
    """Return Frama-C's version; None where it is not installed."""
    program = shutil.which("frama-c")
    return None if program is None else run_command([program, "-version"], Path(), 60.0).out.strip()


def collect(subject: Subject) -> Evidence:
    """Analyse the C of a program, and the C that trusts no state."""
    if version() is None:
        return Evidence((), missing=f"Frama-C is not installed (Debian's package {PACKAGE})")
    runs = [
        *_analyses(subject, "", defensive=False),
        *_analyses(subject.defensive(), "defensive, ", defensive=True),
    ]
    return Evidence(tuple(_figures(runs)), _kept(subject, runs), tuple(_shortfalls(runs)))


def _analyses(subject: Subject, title: str, *, defensive: bool) -> tuple[Analysis, ...]:
    """Run EVA on one text: for any bytes and, of a program with reals, for finite ones."""
    whole = _analysis(subject, f"{title}any bytes", defensive=defensive, finite=False)
    if not any(isinstance(variable.type, Real) for variable in subject.program.variables):
        return (whole,)
    finite = _analysis(subject, f"{title}finite reals", defensive=defensive, finite=True)
    shown = {place.place for place in finite.properties if place.status in PROVED}
    open_ = {place.place for place in finite.properties if place.verdict == "not shown"}
    if not any(
        kind == NUMBER for _, _, kind, _ in open_
    ):  # then what EVA adds where it is in doubt is not asked there
        asked = (place for place in whole.properties if place.kind in (NUMBER, "float_to_int"))
        shown |= {place.place for place in asked} - open_
    places = tuple(
        replace(place, status=FINITE) if place.verdict == "not shown" and place.place in shown else place
        for place in whole.properties
    )
    return replace(whole, properties=places), finite


def _analysis(subject: Subject, name: str, *, defensive: bool, finite: bool) -> Analysis:
    files = subject.files
    symbols = symbols_of(subject.program, files)
    sources = {Path(path).name: text for path, text in files.items()}
    text = harness(subject.program, symbols, defensive=defensive, finite=finite)
    shown = tuple(_command(symbols, Path(), finite=finite, defensive=defensive))
    subject.progress(f"{symbols.source}: EVA, {name}")
    with scratch("eva") as place:
        write_c(files, place)
        (place / "harness.c").write_text(text, "utf-8")
        command = _command(symbols, place, finite=finite, defensive=defensive)
        ran = run_command(command, place, TIMEOUT_S, MEMORY_MB)
        table = place / "properties.csv"
        if ran.status != 0 or not table.is_file():
            return Analysis(name, shown, sources, (), ending(ran, TIMEOUT_S))
        found = tuple(_properties(read.text(table)))
        return Analysis(name, shown, sources, found, "" if found else "its report names no place")


def _command(symbols: Symbols, place: Path, *, finite: bool, defensive: bool) -> list[str]:
    """Return the command; files by whole paths, since Frama-C takes its folder from the shell's `PWD`."""
    p = symbols.program
    apart = ["main", f"{p}_check", f"{p}_admit", *([f"{p}_begin"] if defensive else [])]
    apart += [*symbols.steps.values(), *symbols.cycles.values()]
    return [
        "frama-c", *OPTIONS, *(("non-finite", "-cpp-extra-args=-Dvolatile=") if finite else ("none",)), str(place / "harness.c"),
        str(place / symbols.source), "-no-warn-invalid-bool",
        "-then", "-warn-invalid-bool", "-eva", "-eva-slevel-function", ",".join(f"{name}:{STATES}" for name in apart),
        "-eva-split-return", "full", "-then", "-report-csv", str(place / "properties.csv"),
    ]  # fmt: skip


def harness(program: Program, symbols: Symbols, *, defensive: bool, finite: bool) -> str:
    """Return the C that calls every function of the header on states of which nothing is known."""
    lines = ['#include "__fc_builtin.h"', f'#include "{symbols.header}"', f"static {symbols.struct} s;"]
    lines += stand_ins(program, symbols, _any)
    lines += ["static void any(void) {", "    Frama_C_make_unknown((char *)&s, sizeof s);"]
    if finite:
        reals = [v for v in program.variables if isinstance(v.type, Real)]
        lines += [
            f"    s.{symbols.path(v.name)} = {_any(symbols.c_type(v.name), v.type, True)};" for v in reals
        ]
    inputs = [v for v in program.variables if v.kind is Role.INPUT]
    lines += ["}", "static void admitted(void) {", "    any();"]
    lines += [
        f"    s.{symbols.path(v.name)} = {_any(symbols.c_type(v.name), v.type, False)};" for v in inputs
    ]
    lines += ["}", "int main(void) {", "    switch (Frama_C_interval(0, 9999)) {"]
    for number, body in enumerate(calls(symbols, defensive=defensive)):
        lines += [f"    case {number}: {body} break;"]
    return "\n".join([*lines, "    default: break;", "    }", "    return 0;", "}", ""])


def _any(c_type: str, kind: Scalar, whole: bool) -> str:
    """Return any value of a kind, or of its whole C type, as an expression of EVA's."""
    if isinstance(kind, Real):
        most = GREATEST[c_type]
        low, high = (f"-{most}", most) if whole else (float(kind.low).hex(), float(kind.high).hex())
        return f"({c_type})Frama_C_double_interval({low}, {high})"
    least, greatest = bounds(c_type, kind, whole=whole)
    if greatest > I64_MAX:
        return f"({c_type})Frama_C_unsigned_long_long_interval({least}ULL, {greatest}ULL)"
    lowest = f"{least}LL" if least > -I64_MAX else f"(-{I64_MAX}LL - 1LL)"
    return f"({c_type})Frama_C_long_long_interval({lowest}, {greatest}LL)"


def _properties(text: str) -> Iterator[Property]:
    """Yield the properties of the emitted C in Frama-C's report, without those of the harness and of its library."""
    heading, *rows = (line.split("\t") for line in text.splitlines() or [""])
    for row in (dict(zip(heading, cells, strict=False)) for cells in rows):
        kind = row["property kind"]
        if row["file"] != "harness.c" and kind in WORDS:
            yield Property(
                row["file"], int(row["line"]), row["function"], kind, row["status"], row["property"]
            )


def _figures(runs: list[Analysis]) -> Iterator[str]:
    for run in runs:
        count = Counter(place.verdict for place in run.properties)
        reached = sum(count.values()) - count["never reached"]
        rest = "".join(f", {count[verdict]} {verdict}" for verdict in VERDICTS[1:] if count[verdict])
        failure = f"; {run.failure}" if run.failure else ""
        yield f"Frama-C {version()}, {run.name}: {count['shown']} of {reached} places shown safe{rest}{failure}"


def _kept(subject: Subject, runs: list[Analysis]) -> dict[str, str]:
    symbols = symbols_of(subject.program, subject.files)
    rows = [
        (run.name, p.file, p.line, p.function, p.kind, p.status, p.text)
        for run in runs
        for p in run.properties
    ]
    heading = ("run", "file", "line", "function", "class", "status", "property")
    return {
        "certificate.md": _certificate(symbols, runs),
        "properties.csv": csv_text([heading, *rows]),
        "harness.c": harness(subject.program, symbols, defensive=False, finite=False),
    }


def _certificate(symbols: Symbols, runs: list[Analysis]) -> str:
    lines = [f"# {symbols.source}: no operation goes wrong while it runs", ""]
    lines += [f"Frama-C {version()}, plugins RTE and EVA.", ""]
    lines += [
        "Every function of the header, on a state of which nothing is known: a cycle or a step where `check` accepts"
    ]
    lines += [
        "it, with any inputs; a matcher with admitted inputs; with `--defensive` a cycle on any bytes. Every place of"
    ]
    lines += ["each is in `properties.csv`; `harness.c` is what EVA was given beside the C.", ""]
    for run in runs:
        lines += [f"## {run.name}", "", f"    {' '.join(run.command)}", ""]
        lines += [*_rows(run), ""]
    return "\n".join(lines)


def _rows(run: Analysis) -> Iterator[str]:
    yield f"| What | {' | '.join(VERDICTS)} |"
    yield f"| --- |{' ---: |' * len(VERDICTS)}"
    for kind, words in WORDS.items():
        count = Counter(place.verdict for place in run.properties if place.kind == kind)
        if count:
            yield f"| {words} (`{kind}`) | {' | '.join(str(count[verdict]) for verdict in VERDICTS)} |"


def _where(place: Property, text: Mapping[str, str]) -> str:
    return f"{place.file}:{place.line} ({place.function}{line_of(text.get(place.file, ''), place.line)})"


def _shortfalls(runs: list[Analysis]) -> Iterator[Shortfall]:
    for run in runs:
        if run.failure:
            yield Shortfall(run.name, run.failure)
        for place in run.properties:
            if place.verdict == "not shown":
                yield Shortfall(_where(place, run.sources), f"{run.name}: {WORDS[place.kind]}: {place.text}")


HEAD = re.compile(r"/\* (?P<line>\S+\.rcs line [^:*]+)")


def line_of(text: str, number: int) -> str:
    """Return the table line that a line of C belongs to, from the comment above it; "" where there is none."""
    for line in reversed(text.split("\n")[:number]):
        if line == "}":
            return ""
        if head := HEAD.search(line):
            return f", {head['line']}"
    return ""


KIND = Kind(
    "Frama-C's EVA: every index, division, conversion and access of the C is safe",
    collect,
    lambda: {"frama-c": version() or ABSENT},
)
