"""What compilers, analysers and sanitizers find in the generated C: nothing, or what is listed with its reason.

In: the emitted C of a program, as it is and with `--defensive`, in the compiler's and in the portable text. Out: every
finding with its place; of a kind that is meant, with the reason why it is.

Compilers: gcc with `-fanalyzer`, clang 19 with `-Weverything`. Analyser: clang-tidy 19. Sanitizers: gcc's and clang's for
addresses and undefined behaviour, clang's for unsigned and implicit conversions, on calls of every function with drawn
states and inputs, some of them outside their ranges.
"""

import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.base.host.files import csv_text
from rcsc.base.host.tools import ending, run_command, version_of, write_c
from rcsc.code.emit.code_tree import type_bounds
from rcsc.code.testing.executors.externs import externs, stand_in_head
from rcsc.code.testing.executors.symbols import Symbols, symbols_of
from rcsc.lang.model import Bool, Program, Real, Scalar, key_bounds
from rcsc.lang.model import Kind as Role
from rcsc.views.evidence.kind import Evidence, Kind, Shortfall, Subject, versions_of
from rcsc.views.pages.dossier_page import AcceptedPoint

TIMEOUT_S = 900.0
LOOK_S = 300.0
"""Seconds that a tool may take for one text; a run that takes longer is reported, and is no evidence."""
CALLS = 200_000
"""Number of calls that are drawn under each sanitizer."""
BOUND = ("--param", "analyzer-bb-explosion-factor=20", "-Wanalyzer-too-complex")
"""The limit of gcc's analyser: four times its own; where it stops there it says so, and that is a finding."""
WARNINGS = (
    "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wcast-qual", "-Wshadow",
    "-Wundef", "-Wstrict-prototypes", "-Wmissing-prototypes", "-Wvla", "-Wswitch-enum", "-Wnull-dereference",
)  # fmt: skip
CHECKS = (
    "-*", "cert-*", "bugprone-*", "clang-analyzer-*", "misc-*", "performance-*", "portability-*", "readability-*",
)  # fmt: skip
SANITIZERS: Mapping[str, tuple[str, ...]] = {
    "gcc": ("-fsanitize=address,undefined,float-divide-by-zero,float-cast-overflow",),
    "clang-19": ("-fsanitize=address,undefined,integer,implicit-conversion,float-divide-by-zero",),
}
PORTABLE: Mapping[str, tuple[str, ...]] = {"": (), ", portable": ("-U__GNUC__",)}
"""The two texts of the C: with a compiler's own bit counting and without. Gcc's headers need `__GNUC__`."""
EXPLAINED: Mapping[str, str] = {
    "-Wdeclaration-after-statement": "C99 allows it: a variable is declared where its value is known",
    "-Wfloat-equal": "reals are compared exactly because tables compare them exactly",
    "-Wpadded": "the state is ordered for its reader, and its padding is never read",
    "-Wunsafe-buffer-usage": "a rule for C++; every index is shown within its array by `runtime`",
    "-Wunused-macros": "a name for a user's own file",
    "bugprone-branch-clone": "two lines of a table, or two cases, that do the same stay two, each with its place",
    "bugprone-implicit-widening-of-multiplication-result": "an index; `runtime` shows that the product fits",
    "bugprone-easily-swappable-parameters": "the parameters of a procedure are those that the table declares",
    "clang-analyzer-deadcode.DeadStores": "a local is given a value where it is declared, so that none is ever unset",
    "misc-include-cleaner": "types come by the program's one header",
    "readability-function-cognitive-complexity": "a table's lines and a state's ranges are one function each, without nesting",
    "readability-identifier-length": "`s` is the state, `m` the set of lines, `a` and `b` operands, throughout",
    "readability-magic-numbers": "constants are those that stand in the table",
    "readability-uppercase-literal-suffix": "`u` is a small letter throughout; of 64 bits the suffix is `ULL`, as MISRA 7.3 asks of an `l`",
    "readability-math-missing-parentheses": "MISRA's precedence is kept by parentheses where it asks for them",
    "readability-non-const-parameter": "procedures take the state that they may write",
    "readability-avoid-nested-conditional-operator": "a choice of the table among more than two values",
    "unsigned-integer-overflow": "`m & (m - 1)` of no line, and the portable position of a bit, wrap as C defines it",
    "unsigned-shift-base": "the portable position of a bit multiplies and shifts as C defines it",
}
"""The reason why a kind of finding is meant so; findings of any other kind are shortfalls."""
PLANTED = """int planted(const int *at);
int planted(const int *at) { int here; if (at == 0) { here = *at; } return here; }
"""
TELLS: Mapping[str, str] = {
    "gcc": "-Wanalyzer-null-dereference",
    "clang-19": "-Wsometimes-uninitialized",
    "clang-tidy-19": "clang-analyzer-core.NullDereference",
}
"""The check that each tool must report in `PLANTED`: one that is silent there shows nothing elsewhere."""
SANITIZED = ("signed integer overflow", "AddressSanitizer")
"""Messages that a sanitizer must print about the planted faults in the program of drawn calls."""
LINE = re.compile(
    r"^(?:.*/)?(?P<file>[\w.]+):(?P<line>\d+)(?::\d+)?: (?:warning|error|runtime error): (?P<text>.*)$"
)
NAMED = re.compile(r"^(?P<what>.*?) \[(?P<check>[-\w.,+=]+)\]$")
DONE = re.compile(r"^\d+ calls$", re.MULTILINE)
"""The last line that the drawn calls print."""
WRAPS = ("unsigned integer overflow", "left shift of")


@dataclass(frozen=True, slots=True)
class Finding:
    """A tool's message about a place, and the check that gave it."""

    tool: str
    file: str
    line: int
    check: str
    text: str

    @property
    def reason(self) -> str:
        """The reason why the code is meant so; "" where nothing explains it."""
        return next(_reasons(self.check), "")


@dataclass(frozen=True, slots=True)
class Report:
    """One run of a tool on one text of the C."""

    tool: str
    findings: tuple[Finding, ...]
    failure: str = ""

    @property
    def meant(self) -> int:
        """The number of findings that a reason explains."""
        return sum(bool(finding.reason) for finding in self.findings)


TOOLS = ("gcc", "clang-19", "clang-tidy-19")


def collect(subject: Subject) -> Evidence:
    """Run every installed tool on every text of the C of a program."""

    def texts() -> Iterator[Text]:
        for title, each in (("", subject), ("defensive, ", subject.defensive())):
            symbols = symbols_of(subject.program, each.files)
            main = drawn(subject.program, symbols, defensive=each.plan.defensive)
            yield Text(title, each.files, symbols.source, main)

    return looked_at(texts(), subject.progress)


@dataclass(frozen=True, slots=True)
class Text:
    """A text of C to be analysed.

    Attributes:
        title: The prefix of its runs' names.
        files: The C and what it includes, text by path.
        source: Name of the file to analyse; the others are built where it is run.
        main: C that calls it; see `player`.
    """

    title: str
    files: Mapping[str, str]
    source: str
    main: str


def looked_at(texts: Iterable[Text], progress: Callable[[str], None]) -> Evidence:
    """Run every installed tool on each of some texts, and collect the findings."""
    here = {name for name in TOOLS if shutil.which(name)}
    if not here:
        return Evidence(
            (), missing=f"none of {', '.join(TOOLS)} is installed (Debian's packages of these names)"
        )
    reports = [*_deaf(here), *(report for text in texts for report in _reports(text, here, progress))]
    shortfalls = [*_shortfalls(reports)]
    absent = sorted(set(TOOLS) - here)
    shortfalls += [Shortfall(name, "not installed, so it was not asked") for name in absent]
    return Evidence(
        tuple(_figures(reports)), _kept(reports), tuple(shortfalls), accepted=tuple(_accepted(reports))
    )


def _reports(text: Text, here: set[str], progress: Callable[[str], None]) -> Iterator[Report]:
    with scratch("analysers") as place:
        sources = write_c(text.files, place)
        (place / "drawn.c").write_text(text.main, "utf-8")
        for name, command in _static(text.source):
            if command[0] in here:
                progress(f"{text.source}: {text.title}{name}")
                yield _asked(f"{text.title}{name}", command, place)
        for name, command in _sanitized(*sources):
            if command[0] in here:
                progress(f"{text.source}: {text.title}{name}")
                yield _ran(f"{text.title}{name}", command, place)


def _static(source: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the commands that analyse the text without running it."""
    compiled = ["-c", "-o", "text.o", source]
    yield "gcc -fanalyzer", ["gcc", "-std=c99", "-O2", "-fanalyzer", *BOUND, *WARNINGS, *compiled]
    for text, portable in PORTABLE.items():
        yield (
            f"clang -Weverything{text}",
            ["clang-19", "-std=c99", "-O1", "-Weverything", *portable, *compiled],
        )
    yield "clang-tidy", ["clang-tidy-19", "--quiet", f"--checks={','.join(CHECKS)}", source, "--", "-std=c99"]


def _sanitized(*sources: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the commands that build the drawn calls with sanitizers."""
    for compiler, flags in SANITIZERS.items():
        for text, portable in PORTABLE.items():
            if compiler == "clang-19" or not portable:
                built = ["-o", "drawn", *sources, "drawn.c"]
                yield (
                    f"sanitizers of {compiler}{text}",
                    [compiler, "-std=c99", "-O1", "-g", *flags, *portable, *built],
                )


def _deaf(here: set[str]) -> Iterator[Report]:
    """Let each tool look at planted faults; yield a report of each that does not find them."""
    for name, command in _static("planted.c"):
        if command[0] in here:
            with scratch("analysers") as place:
                write_c({"planted.c": PLANTED}, place)
                ran = run_command(command, place, TIMEOUT_S)
            told = {check for found in _findings(name, ran.out + ran.err) for check in found.check.split(",")}
            if TELLS[command[0]] not in told:
                yield Report(name, (), f"it tells nothing of a planted fault: {ending(ran, TIMEOUT_S)}")


def _asked(name: str, command: list[str], place: Path) -> Report:
    ran = run_command(command, place, LOOK_S)
    found = tuple(_findings(name, ran.out + ran.err))
    return Report(name, found, ending(ran, LOOK_S) if ran.status != 0 else "")


def _ran(name: str, command: list[str], place: Path) -> Report:
    """Build the drawn calls with a sanitizer and run them; before that, run the planted faults, which it must report."""
    program = place / "drawn"
    program.unlink(missing_ok=True)
    built = run_command(command, place, TIMEOUT_S)
    if built.status != 0 or not program.is_file():
        return Report(name, (), f"not built: {ending(built, TIMEOUT_S)}")
    planted = run_command([str(program), "planted"], place, TIMEOUT_S)
    if not all(word in planted.err for word in SANITIZED):
        return Report(name, (), f"it tells nothing of a planted fault: {ending(planted, TIMEOUT_S)}")
    ran = run_command([str(program)], place, TIMEOUT_S)
    found = tuple(_findings(name, ran.err))
    done = ran.status == 0 and DONE.search(ran.out) is not None
    stopped = ran.err.strip()[:400] if ran.status is not None else ""
    return Report(name, found, "" if done else f"stopped: {stopped or ending(ran, TIMEOUT_S)}")


def _findings(tool: str, text: str) -> Iterator[Finding]:
    """Yield the findings that a tool printed, each place and check once, without those in the drawn calls."""
    seen: set[tuple[str, int, str]] = set()
    for line in text.split("\n"):
        match = LINE.match(line)
        if match is None or match["file"] == "drawn.c":
            continue
        named = NAMED.match(match["text"])
        told, check = (named["what"], named["check"]) if named else (match["text"], "")
        if any(wrap in told for wrap in WRAPS):
            sign = "unsigned" if told.startswith("unsigned") else "signed"
            check = "unsigned-shift-base" if "left shift" in told else f"{sign}-integer-overflow"
        place = (match["file"], int(match["line"]), check)
        if place not in seen:
            seen.add(place)
            yield Finding(tool, *place, told)


# --- C that calls every function -------------------------------------------------------------


def calls(symbols: Symbols, *, defensive: bool) -> Iterator[str]:
    """Yield a call of every function; `any` makes a state, `admitted` one with inputs within their ranges."""
    check = f"{symbols.program}_check(&s)"
    yield f"any(); {symbols.init}(&s);"
    yield f"any(); (void){check};"
    for function in (*symbols.steps.values(), *symbols.cycles.values()):
        call = f"(void){function}(&s);"
        yield f"any(); {call}" if defensive else f"any(); if ({check} < 0) {{ {call} }}"
    for name, function in symbols.lines.items():
        many = f"int32_t at[1]; {symbols.batches[name]}(&s, at, 1u);"
        yield f"admitted(); if ({check} < 0) {{ (void){function}(&s); {many} }}"


def stand_ins(program: Program, symbols: Symbols, value: Callable[[str, Scalar, bool], str]) -> Iterator[str]:
    """Yield C functions in place of the user's, which give any value of their types.

    Args:
        program: The program.
        symbols: Of its C.
        value: An expression of a value of a C type and a kind: any within the kind's range, or any of the C type where asked.
    """
    for procedure in externs(program):
        head, given = stand_in_head(symbols, procedure)
        unread = " ".join(f"(void)a{at};" for at, _ in enumerate(given))
        written = " ".join(
            f"*r{at} = {value(symbols.c_type(name), program.variable(name).type, True)};"
            for at, name in enumerate(procedure.writes)
        )
        yield f"{head} {{ {unread} {written} }}"


def bounds(c_type: str, kind: Scalar, *, whole: bool) -> tuple[int, int]:
    """Return the bounds of a kind that is no real, or of its C type."""
    if isinstance(kind, Bool):
        return 0, 1
    if not whole and not isinstance(kind, Real):
        return key_bounds(kind)
    return type_bounds(c_type)


def drawn(program: Program, symbols: Symbols, *, defensive: bool) -> str:
    """Return C that calls every function with drawn states: within their ranges and at their ends, and some inputs outside."""
    lines = [f"static {symbols.struct} s;", *stand_ins(program, symbols, drawn_value)]
    for name, strange in (("any", True), ("admitted", False)):
        state = [*_state(program, symbols, strange=strange), *(_bytes() if strange and defensive else ())]
        lines += [f"static void {name}(void) {{", *state, "}"]
    bodies = [*calls(symbols, defensive=defensive)]
    cases = [f"        case {number}: {body} break;" for number, body in enumerate(bodies)]
    body = [f"        switch (next() % {len(bodies)}u) {{", *cases, "        default: break;", "        }"]
    return player(symbols.header, lines, body, CALLS)


def player(header: str, lines: Sequence[str], body: Sequence[str], calls: int) -> str:
    """Return C whose `main` does something drawn many times; given an argument, it makes the faults that must be reported.

    Args:
        header: The header that it includes.
        lines: The text before `main`; `next()` and `real(low, high)` draw.
        body: Statements of a loop over `n`.
        calls: The number of rounds.
    """
    return "\n".join([
        "#include <stdio.h>", "#include <string.h>", f'#include "{header}"',
        "static uint64_t drawn = UINT64_C(0x1984);", "static uint64_t next(void) {",
        "    drawn ^= drawn << 13; drawn ^= drawn >> 7; drawn ^= drawn << 17; /* Marsaglia's xorshift64 */",
        "    return drawn >> 11;", "}", "static double real(double low, double high) {", "    const uint64_t at = next() % 6u;",
        "    return (at == 0u) ? low : (at == 1u) ? high : low + ((high - low) * ((double)(next() % 1000001u) / 1e6));", "}",
        *lines, "static volatile int32_t room[4];", "int main(int argc, char **argv) {", "    (void)argv; (void)real;",
        "    if (argc > 1) { /* faults that must be told */", "        volatile int32_t most = INT32_MAX;",
        "        room[0] = most + argc;", "        ((volatile int32_t *)room)[argc + 2] = room[0];", "        return 0;", "    }",
        f"    for (uint32_t n = 0u; n < {calls}u; n = n + 1u) {{", *body, "    }",
        f'    (void)puts("{calls} calls");', "    return 0;", "}", "",
    ])  # fmt: skip


def _state(program: Program, symbols: Symbols, *, strange: bool) -> Iterator[str]:
    """Yield C that draws inputs, and now and then the whole state; one input in 256 is drawn from its whole type, if `strange`."""
    yield f"    if (next() % 8u == 0u) {{ {symbols.init}(&s);"
    states = [v for v in program.variables if v.kind is not Role.INPUT]
    yield "    if (next() % 2u == 0u) {"
    for variable in states:
        c_type = symbols.c_type(variable.name)
        yield f"    s.{symbols.path(variable.name)} = {drawn_value(c_type, variable.type, False)};"
    yield "    } }"
    for variable in program.variables:
        if variable.kind is Role.INPUT:
            place, c_type = symbols.path(variable.name), symbols.c_type(variable.name)
            yield f"    s.{place} = {drawn_value(c_type, variable.type, False)};"
            if strange:
                yield f"    if (next() % 256u == 0u) {{ s.{place} = {drawn_value(c_type, variable.type, True)}; }}"


def _bytes() -> Iterator[str]:
    """Yield C that now and then sets some byte to any value, where the C trusts no state."""
    yield "    if (next() % 16u == 0u) {"
    yield "        unsigned char *byte = (unsigned char *)&s;"
    yield "        byte[sizeof s.digest + (next() % (sizeof s - sizeof s.digest))] = (unsigned char)(next() & 255u);"
    yield "    }"


def drawn_value(c_type: str, kind: Scalar, whole: bool) -> str:
    """Return C for a drawn value of a kind, or of its whole C type; nearly half of the whole numbers are at an end."""
    if isinstance(kind, Real):
        low, high = ("-1e30", "1e30") if whole else (float(kind.low).hex(), float(kind.high).hex())
        return f"({c_type})real({low}, {high})"
    least, most = bounds(c_type, kind, whole=whole)
    if least == most:
        return f"({c_type}){_constant(least)}"
    span = most - least + 1
    drawn = "next()" if span >= 1 << 53 else f"(next() % UINT64_C({span}))"
    wrapped = (
        f"(int64_t)({_constant(least)} + (int64_t){drawn})" if least < 0 else f"(UINT64_C({least}) + {drawn})"
    )
    return f"(next() % 4u == 0u) ? ({c_type}){_constant(least)} : (next() % 4u == 0u) ? ({c_type}){_constant(most)} : ({c_type}){wrapped}"


def _constant(value: int) -> str:
    if value >= 0:
        return f"UINT64_C({value})"
    return f"INT64_C({value})" if value > -(1 << 63) else "INT64_MIN"


# --- what is told ----------------------------------------------------------------------------


def _figures(reports: list[Report]) -> Iterator[str]:
    for report in reports:
        open_ = len(report.findings) - report.meant
        rest = f"{open_} findings" + (f", and {report.meant} that are meant" if report.meant else "")
        yield f"{report.tool}: {report.failure or rest}"


def _kept(reports: list[Report]) -> dict[str, str]:
    rows = [
        (f.tool, f.file, f.line, f.check, f.text, f.reason) for report in reports for f in report.findings
    ]
    findings = csv_text([("tool", "file", "line", "check", "finding", "reason"), *rows])
    lines = ["# Analysers and sanitizers", "", "| Run | findings | meant |", "| --- | ---: | ---: |"]
    for report in reports:
        open_ = len(report.findings) - report.meant
        lines.append(f"| {report.tool} | {report.failure or open_} | {report.meant} |")
    lines += ["", "What is meant, by check; every place is in `findings.csv`:", ""]
    count = Counter(f.check for report in reports for f in report.findings if f.reason)
    lines += [
        f"- `{check}`, {number} places: {reason}."
        for check, number in sorted(count.items())
        for reason in _reasons(check)
    ]
    lines += ["", *_commands(), ""]
    return {"analysers.md": "\n".join(lines), "findings.csv": findings}


def _reasons(check: str) -> Iterator[str]:
    yield from (EXPLAINED[name] for name in check.split(",") if name in EXPLAINED)


def _accepted(reports: list[Report]) -> Iterator[AcceptedPoint]:
    """Yield what is meant; of the C that trusts no state, which is not kept, without a line that could be looked up."""
    for report in reports:
        for found in report.findings:
            where = f"{found.file}:{found.line}"
            place = f"{where} of the defensive C" if found.tool.startswith("defensive") else where
            if found.reason:
                yield AcceptedPoint(found.check, place, found.reason)


def _commands() -> Iterator[str]:
    """Yield the commands, and the versions of the tools."""
    yield "Commands:"
    yield ""
    for name, command in (*_static("FILE.c"), *_sanitized("FILE.c")):
        if shutil.which(command[0]):
            yield f"- {name} ({version_of(command[0], '--version')}): `{' '.join(command)}`"


def _shortfalls(reports: list[Report]) -> Iterator[Shortfall]:
    for report in reports:
        if report.failure:
            yield Shortfall(report.tool, report.failure)
        for finding in report.findings:
            if not finding.reason:
                yield Shortfall(
                    f"{finding.file}:{finding.line}", f"{finding.tool}: {finding.text} [{finding.check}]"
                )


KIND = Kind(
    "compilers, analysers and sanitizers find nothing in the C, or what is listed with its reason",
    collect,
    lambda: versions_of(*([tool, "--version"] for tool in TOOLS)),
)
