"""Mutants of the emitted C: bits of the masks, constants, operators; each must be noticed or be equivalent.

In: a program, its emitted C, the sessions that its executors agreed on. Out: for each mutant who noticed it.
A number of a mask or of a class table is shown to the complete check of the matcher first. Any other mutant, and one that this check
calls equal, runs in a process of its own on all the sessions; one that leaves the same behind is decided by the check of the
matcher where it is in one, else by ESBMC, which proves it equal to the reference for all inputs (equivalent) or refutes it.
What neither decides is undecided: that is a figure, no fault of the C.
"""

import re
from array import array
from bisect import bisect_left
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from random import Random

from rcsc.base.host.children import scratch
from rcsc.base.host.files.read import MOST_OF_OURS, content
from rcsc.base.host.tools import Absent, c_compiler, run_command, write_c
from rcsc.code.testing.esbmc import EsbmcAnswer, prove_function, too_large
from rcsc.code.testing.executors.edges import relational_tests
from rcsc.code.testing.executors.externs import STAND_INS
from rcsc.code.testing.executors.native import COMPILE_S, Native
from rcsc.code.testing.executors.shim import shim_c
from rcsc.code.testing.executors.symbols import Symbols, text_of
from rcsc.code.testing.executors.targets import ComparedFunction, targets
from rcsc.code.testing.matcher import Checked, MatcherCheck
from rcsc.lang.model import Program, Snapshot

RUN_S = 20.0
SEED = 1984
FLAGS = ("-std=gnu11", "-O0", "-w", "-ffp-contract=off")

TOKEN = re.compile(
    r"""(?P<skip>/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|^\s*\#[^\n]*)
    |(?P<number>0[xX][0-9a-fA-F.]+(?:[pP][+-]?\d+)?[uUlLfF]*|\d[\d.]*(?:[eE][+-]?\d+)?[uUlLfF]*)
    |(?P<word>[A-Za-z_]\w*)
    |(?P<operator>->|<<=|>>=|<<|>>|<=|>=|==|!=|&&|\|\||\+\+|--|[-+*/%&|^]=|[-+*/%&|^<>!~=?:;,.(){}\[\]])""",
    re.VERBOSE | re.MULTILINE | re.DOTALL,
)
SWAPS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "*": "+", "/": "*", "%": "/",
    "&": "|", "|": "&", "^": "&", "&&": "||", "||": "&&", "<<": ">>", ">>": "<<", "&=": "|=", "|=": "&=",
}  # fmt: skip
WORD = re.compile(r"[A-Za-z_]\w*")
ELEMENT = re.compile(r"uint(\d+)_t")
FUNCTION = re.compile(r"^(?:static inline |static )?(?:\w+ )+\**(\w+)\([^;{}]*\)\n\{", re.MULTILINE)
BRANCHES = re.compile(
    r"^#if defined\(__GNUC__\)\n(?P<built_in>.*?)^#else\n(?P<portable>.*?)^#endif\n", re.DOTALL | re.MULTILINE
)
NOT_END = re.compile(r"[^\n]")
INTEGER = re.compile(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)$")


class Noticed(StrEnum):
    """Who noticed a mutant of the code."""

    COMPILER = "the compiler"
    TESTS = "the tests"
    ESBMC = "ESBMC"
    MATCHER = "the matcher check"
    EQUIVALENT = "equivalent"
    UNDECIDED = "undecided"
    MISSED = "missed by the matcher check"  # it calls equal what the tests tell apart


@dataclass(frozen=True, slots=True)
class CodeMutant:
    """The emitted C with one change.

    Attributes:
        change: `mask`, `constant` or `operator`.
        function: Name of the function that was changed.
        base: The C file as it is.
        start: Where the changed token begins.
    """

    change: str
    function: str
    base: str = field(repr=False)
    start: int = 0
    old: str = ""
    new: str = ""

    @property
    def where(self) -> str:
        """Line of the C file and the change, in words."""
        return f"line {self.base.count(chr(10), 0, self.start) + 1}: {self.old} -> {self.new}"

    @property
    def text(self) -> str:
        """The changed C file."""
        return f"{self.base[: self.start]}{self.new}{self.base[self.start + len(self.old) :]}"


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    start: int
    depth: int
    table_bits: int


def _tokens(text: str) -> list[_Token]:
    """The tokens of a C file, with their depth in braces; in initializer lists, the bits of an element."""
    tokens: list[_Token] = []
    depth, table_depth, before, bits = 0, 0, "", 0
    for match in TOKEN.finditer(text):
        kind, text_here = str(match.lastgroup), match.group()
        if kind == "skip":
            continue
        width = ELEMENT.fullmatch(text_here)
        bits = int(width[1]) if width else bits
        if text_here == "{":
            depth += 1
            table_depth += 1 if before == "=" or table_depth else 0
        tokens.append(_Token(kind, text_here, match.start(), depth, bits if table_depth else 0))
        if text_here == "}":
            depth -= 1
            table_depth -= 1 if table_depth else 0
        before = text_here
    return tokens


def variants(text: str) -> tuple[str, str]:
    """The C as a compiler with GNU C's extensions and built-ins sees it, and as any other does; all stands where it stood."""
    return _only("built_in", text), _only("portable", text)


def _only(kept: str, text: str) -> str:
    """The C with one part of each place where compilers differ, and blanks in the place of the rest."""

    def blanked(match: re.Match[str]) -> str:
        first, last = (at - match.start() for at in match.span(kept))
        return NOT_END.sub(" ", match[0][:first]) + match[kept] + NOT_END.sub(" ", match[0][last:])

    return BRANCHES.sub(blanked, text)


def _binary(tokens: Sequence[_Token], at: int) -> bool:
    """Whether the operator has a left operand, and is no pointer of a declaration."""
    before = tokens[at - 1]
    operand = before.kind in ("word", "number") or before.text in (")", "]")
    declared = before.kind == "word" and (
        before.text.endswith("_t") or before.text in ("const", "void", "double", "float")
    )
    return operand and not declared and before.text not in ("return", "case")


def _changes(token: _Token, lines: int) -> Iterator[tuple[str, str]]:
    """Kind and new text of each change of one token."""
    integer = INTEGER.match(token.text)
    if token.kind == "number" and integer:
        value, suffix = int(integer[1], 0), integer[2]
        if token.table_bits:
            bits = min(max(lines, value.bit_length()) if lines > 1 else 1, token.table_bits)
            yield from (("mask", f"{value ^ 1 << bit}{suffix}") for bit in range(bits))
        else:
            yield "constant", f"{value + 1}{suffix}"
            if value:
                yield "constant", f"{value - 1}{suffix}"
    elif token.text in SWAPS:
        yield "operator", SWAPS[token.text]


def first_callers(text: str, function: str, wanted: Collection[str]) -> list[str]:
    """The wanted functions that are met first on every way up from `function`, itself included; sorted."""
    heads = list(FUNCTION.finditer(text))
    ends = [head.start() for head in heads[1:]] + [len(text)]
    words = {h[1]: set(WORD.findall(text[h.end() : end])) for h, end in zip(heads, ends, strict=True)}
    met, seen, open_ = set(), {function}, [function]
    while open_:
        name = open_.pop()
        if name in wanted:
            met.add(name)
            continue
        above = [caller for caller, used in words.items() if name in used and caller not in seen]
        seen.update(above)
        open_ += above
    return sorted(met)


def code_mutants(text: str, lines: int) -> Iterator[CodeMutant]:
    """Every mutant of a C file's functions; of the portable bit scan too, in the C that has it.

    Args:
        text: The C file.
        lines: How many lines its largest table has: so many bits of each mask word are flipped; one of each
            entry of the portable bit scan that gives the position of a line, for nothing asks it for others.
    """
    built_in, portable = variants(text)
    yield from _mutants(built_in, lines, 0, len(text))
    for match in BRANCHES.finditer(text):
        for mutant in _mutants(portable, 1, *match.span("portable")):
            value = INTEGER.match(mutant.old)
            if mutant.change != "mask" or (value and int(value[1], 0) < lines):
                yield mutant


def _mutants(text: str, lines: int, first: int, last: int) -> Iterator[CodeMutant]:
    """Mutants of the tokens between two offsets."""
    tokens, heads = _tokens(text), list(FUNCTION.finditer(text))
    starts = [head.start() for head in heads]
    for at, token in enumerate(tokens):
        inside = first <= token.start < last and token.depth > 0
        if not inside or (token.text in SWAPS and not _binary(tokens, at)):
            continue
        before = bisect_left(starts, token.start)
        function = heads[before - 1][1] if before else ""
        for change, new in _changes(token, lines):
            yield CodeMutant(change, function, text, token.start, token.text, new)


@dataclass(slots=True)
class Judge:
    """Decides on mutants of one program's C; the shim is compiled once.

    Attributes:
        known: By table, inputs that match its lines.
        checks: By the number of its table, what is asked of a matcher.
        said: What the check of a matcher said of the mutant that is judged, likewise.
    """

    program: Program
    symbols: Symbols
    files: Mapping[str, str]
    place: Path
    compiler: str
    expected: bytes
    esbmc_s: float
    known: Mapping[str, Sequence[Snapshot]]
    checks: dict[int, MatcherCheck] = field(default_factory=dict)
    said: dict[int, Noticed] = field(default_factory=dict)

    def source(self) -> str:
        """Path of the emitted C among the files."""
        return next(path for path in self.files if Path(path).name == self.symbols.source)

    def expect(self, source: str) -> None:
        """Runs the C as it is, for what the mutants are compared with."""
        noticed = self.by_tests(source)
        if noticed is not Noticed.TESTS:
            raise RuntimeError("the emitted C does not run")  # `build` ran it before
        self.expected = content(self.place / "out.bin", MOST_OF_OURS)

    def judge(self, mutant: CodeMutant) -> Noticed:
        """Who notices the mutant."""
        self.said.clear()
        checked = self.by_check(mutant) if mutant.change == "mask" else Noticed.UNDECIDED
        if checked is Noticed.MATCHER:
            return checked
        noticed = self.by_tests(mutant.text)
        if noticed is not Noticed.UNDECIDED:
            missed = checked is Noticed.EQUIVALENT and noticed is Noticed.TESTS
            return Noticed.MISSED if missed else noticed
        return checked if checked is Noticed.EQUIVALENT else self.by_proof(mutant)

    def by_check(self, mutant: CodeMutant) -> Noticed:
        """What the check of the matcher says of the tables whose masks the changed function may look at."""
        files = {**self.files, self.source(): mutant.text}
        lines = {
            target.function: target for target in targets(self.program, self.symbols) if target.kind == "line"
        }
        asked = [lines[name] for name in first_callers(mutant.text, mutant.function, lines)]
        said = {self.checked(files, target) for target in asked} or {Noticed.UNDECIDED}
        return next(each for each in (Noticed.MATCHER, Noticed.UNDECIDED, Noticed.EQUIVALENT) if each in said)

    def checked(self, files: Mapping[str, str], target: ComparedFunction) -> Noticed:
        """What the check of one matcher says; undecided where a condition over several variables may hide a difference."""
        number, table = target.number, self.program.tables[target.number]
        if number not in self.checks:
            known = self.known.get(table.name, ())
            self.checks[number] = MatcherCheck(self.program, self.symbols, table, known)
        if number not in self.said:
            checked = self.checks[number].of(files)
            tried = isinstance(checked, Checked) and not checked.unmatched and not relational_tests(table)
            equal = Noticed.EQUIVALENT if tried else Noticed.UNDECIDED
            self.said[number] = Noticed.MATCHER if isinstance(checked, tuple) else equal
        return self.said[number]

    def by_tests(self, text: str) -> Noticed:
        """Whether the compiler or the tests notice another C file."""
        (self.place / self.symbols.source).write_text(text, "utf-8")
        command = [self.compiler, *FLAGS, "-o", "mutant", self.symbols.source, "shim.o", "extra.o"]
        if run_command(command, self.place, COMPILE_S).status != 0:
            return Noticed.COMPILER
        out = self.place / "out.bin"
        out.unlink(missing_ok=True)
        ran = run_command([str(self.place / "mutant"), "in.bin", "out.bin"], self.place, RUN_S)
        same = ran.status == 0 and content(out, MOST_OF_OURS) == self.expected
        return Noticed.UNDECIDED if same else Noticed.TESTS

    def by_proof(self, mutant: CodeMutant) -> Noticed:
        """Return what is proved of a mutant that the tests cannot tell from the original.

        The functions asked about are the first on every way up from the changed one that have a reference: where
        those are proved equal to it, their callers cannot tell.
        """
        files = {**self.files, self.source(): mutant.text}
        with_reference = {target.function: target for target in targets(self.program, self.symbols)}
        asked = first_callers(mutant.text, mutant.function, with_reference)
        # what no such function calls only others may tell
        noticed = Noticed.EQUIVALENT if asked else Noticed.UNDECIDED
        for target in (with_reference[name] for name in asked):
            answer = self.shown(files, target)
            if answer in (Noticed.MATCHER, Noticed.ESBMC):
                return answer
            noticed = Noticed.UNDECIDED if answer is Noticed.UNDECIDED else noticed
        return noticed

    def shown(self, files: Mapping[str, str], target: ComparedFunction) -> Noticed:
        """Return the verdict of the matcher's check on a changed function, else ESBMC's."""
        if target.kind == "line" and (said := self.checked(files, target)) is not Noticed.UNDECIDED:
            return said
        if not self.esbmc_s or too_large(self.program, target):
            return Noticed.UNDECIDED
        answer = prove_function(self.program, self.symbols, files, target, self.esbmc_s).answer
        return {EsbmcAnswer.PROVED: Noticed.EQUIVALENT, EsbmcAnswer.REFUTED: Noticed.ESBMC}.get(
            answer, Noticed.UNDECIDED
        )


def _rows(native: Native, sessions: Sequence[tuple[int, int, Sequence[Snapshot]]]) -> bytes:
    """The input file of the mutants: every session, for the function and for nobody else."""
    parts = []
    for which, mode, snapshots in sessions:
        parts += [array("q", [which, mode, len(snapshots)]), native.rows(snapshots)]
    return b"".join(part.tobytes() for part in parts)


def portable_agrees(
    native: Native, files: Mapping[str, str], sessions: Sequence[tuple[int, int, Sequence[Snapshot]]]
) -> bool:
    """Whether the C without compiler built-ins leaves the same behind; see `judge_code`."""
    with prepared(native, files, sessions, 0.0, {}) as judge:
        other = variants(text_of(native.symbols.source, files))[1]
        return judge is None or judge.by_tests(other) is Noticed.UNDECIDED


@contextmanager
def prepared(
    native: Native,
    files: Mapping[str, str],
    sessions: Sequence[tuple[int, int, Sequence[Snapshot]]],
    esbmc_s: float,
    known: Mapping[str, Sequence[Snapshot]],
) -> "Iterator[Judge | None]":
    """A judge with its files in place, which knows what the C as it is leaves behind."""
    compiler, program, symbols = c_compiler(), native.program, native.symbols
    if isinstance(compiler, Absent):
        yield None
        return
    with scratch("mutants") as place:
        write_c(files, place)
        (place / "shim.c").write_text(shim_c(program, symbols), "utf-8")
        (place / "extra.c").write_text(files.get(STAND_INS, ""), "utf-8")
        (place / "in.bin").write_bytes(_rows(native, sessions))
        for name in ("shim", "extra"):
            run_command([compiler, *FLAGS, "-c", "-o", f"{name}.o", f"{name}.c"], place, COMPILE_S)
        judge = Judge(program, symbols, files, place, compiler, b"", esbmc_s, known)
        judge.expect(text_of(symbols.source, files))
        yield judge


def judge_code(
    native: Native,
    files: Mapping[str, str],
    sessions: Sequence[tuple[int, int, Sequence[Snapshot]]],
    known: Mapping[str, Sequence[Snapshot]],
    most: int | None,
    esbmc_s: float = 60.0,
    progress: Callable[[str], None] = lambda _: None,
) -> list[tuple[CodeMutant, Noticed]]:
    """Judges mutants of the emitted C.

    Args:
        native: The program as it is, compiled.
        files: The emitted files, text by path.
        sessions: What is run: number of the function, mode (see `shim`), rows.
        known: By table, inputs that match its lines.
        most: How many mutants of the masks and class tables, and how many others; None for all.
        esbmc_s: Time limit of ESBMC for one function, in seconds; 0 leaves it out.
        progress: Told which mutant is judged.
    """
    lines = max((len(t.lines) for t in native.program.tables), default=1)
    every = list(code_mutants(text_of(native.symbols.source, files), lines))
    masks = [mutant for mutant in every if mutant.change == "mask"]
    others = [mutant for mutant in every if mutant.change != "mask"]
    random = Random(SEED)  # noqa: S311  # a repeatable sample
    mutants = [
        mutant
        for group in (masks, others)
        for mutant in (group if most is None else random.sample(group, min(most, len(group))))
    ]
    judged = []
    with prepared(native, files, sessions, esbmc_s, known) as judge:
        for number, mutant in enumerate(mutants if judge else (), 1):
            progress(f"mutant {number} of {len(mutants)} of the C of {native.program.name}")
            judged.append((mutant, judge.judge(mutant)))  # type: ignore[union-attr]  # there is one
    return judged
