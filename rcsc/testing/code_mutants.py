"""Mutants of the emitted C: bits of the masks, constants, operators; each must be noticed or be equivalent.

In: a program, its emitted C, the sessions that its executors agreed on. Out: for each mutant who noticed it.
A mutant runs in a process of its own on all the sessions; one that leaves the same behind is given to ESBMC,
which proves it equal to the reference for all inputs (equivalent) or refutes it.
"""

import re
from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from random import Random

from rcsc.children import scratch
from rcsc.model import Program, Snapshot
from rcsc.testing.esbmc import Said, prove_function
from rcsc.testing.externs import STAND_INS
from rcsc.testing.native import COMPILE_S, Native
from rcsc.testing.shim import shim_c
from rcsc.testing.symbols import Symbols
from rcsc.testing.targets import Target, targets
from rcsc.testing.tools import Absent, c_compiler, run_command, write_c

RUN_S = 20.0
FLAGS = ("-std=gnu11", "-O0", "-w", "-ffp-contract=off")

TOKEN = re.compile(
    r"""(?P<skip>/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|^\s*\#[^\n]*)
    |(?P<number>0[xX][0-9a-fA-F.]+(?:[pP][+-]?\d+)?[uUlL]*|\d[\d.]*(?:[eE][+-]?\d+)?[uUlL]*)
    |(?P<word>[A-Za-z_]\w*)
    |(?P<operator>->|<<=|>>=|<<|>>|<=|>=|==|!=|&&|\|\||\+\+|--|[-+*/%&|^]=|[-+*/%&|^<>!~=?:;,.(){}\[\]])""",
    re.VERBOSE | re.MULTILINE | re.DOTALL,
)
SWAPS = {
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "+": "-",
    "-": "+",
    "*": "+",
    "/": "*",
    "%": "/",
    "&": "|",
    "|": "&",
    "^": "&",
    "&&": "||",
    "||": "&&",
    "<<": ">>",
    ">>": "<<",
    "&=": "|=",
    "|=": "&=",
}
WORD = re.compile(r"[A-Za-z_]\w*")
ELEMENT = re.compile(r"uint(\d+)_t")
FUNCTION = re.compile(r"^(?:static inline |static )?(?:\w+ )+\**(\w+)\([^;{}]*\)\n\{", re.MULTILINE)
BRANCHES = re.compile(
    r"^#if defined\(__GNUC__\)\n(?P<one>.*?)^#else\n(?P<other>.*?)^#endif\n", re.DOTALL | re.MULTILINE
)
INTEGER = re.compile(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)$")


class Noticed(StrEnum):
    """Who noticed a mutant of the code."""

    COMPILER = "the compiler"
    TESTS = "the tests"
    ESBMC = "ESBMC"
    MATCHER = "the matcher check"
    EQUIVALENT = "equivalent"
    SURVIVED = "survived"


@dataclass(frozen=True, slots=True)
class CodeMutant:
    """The emitted C with one change.

    Attributes:
        change: `mask`, `constant` or `operator`.
        where: Line of the C file and the change, in words.
        function: Name of the function that was changed.
    """

    change: str
    where: str
    function: str
    text: str


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    start: int
    depth: int
    table_bits: int


def _tokens(text: str) -> list[_Token]:
    """The tokens of a C file, with their depth in braces; in initializer lists, the bits of an element."""
    found: list[_Token] = []
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
        found.append(_Token(kind, text_here, match.start(), depth, bits if table_depth else 0))
        if text_here == "}":
            depth -= 1
            table_depth -= 1 if table_depth else 0
        before = text_here
    return found


def variants(text: str) -> tuple[str, str]:
    """The C as a compiler with bit-scan built-ins sees it, and as any other does; lines keep their numbers."""
    found = BRANCHES.search(text)
    if found is None:
        return text, text
    blank = {part: "\n" * found[part].count("\n") for part in ("one", "other")}
    built_in = f"\n{found['one']}\n{blank['other']}\n"
    portable = f"\n{blank['one']}\n{found['other']}\n"
    begin, end = text[: found.start()], text[found.end() :]
    return f"{begin}{built_in}{end}", f"{begin}{portable}{end}"


def _binary(tokens: Sequence[_Token], at: int) -> bool:
    """Whether the operator has a left operand, and is no pointer of a declaration."""
    before = tokens[at - 1]
    operand = before.kind in ("word", "number") or before.text in (")", "]")
    declared = before.kind == "word" and (
        before.text.endswith("_t") or before.text in ("const", "void", "double")
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
            entry of the portable bit scan.
    """
    built_in, portable = variants(text)
    yield from _mutants(built_in, lines, 0, len(built_in))
    found = BRANCHES.search(text)
    if found is not None:
        shift = found.start() + 1 + found["one"].count("\n") + 1
        yield from _mutants(portable, 1, shift, shift + len(found["other"]))


def _mutants(text: str, lines: int, first: int, last: int) -> Iterator[CodeMutant]:
    """Mutants of the tokens between two offsets."""
    tokens, functions = _tokens(text), list(FUNCTION.finditer(text))
    for at, token in enumerate(tokens):
        inside = first <= token.start < last and token.depth > 0
        if not inside or (token.text in SWAPS and not _binary(tokens, at)):
            continue
        function = next((f[1] for f in reversed(functions) if f.start() < token.start), "")
        for change, new in _changes(token, lines):
            row = text.count("\n", 0, token.start) + 1
            mutated = f"{text[: token.start]}{new}{text[token.start + len(token.text) :]}"
            yield CodeMutant(change, f"line {row}: {token.text} -> {new}", function, mutated)


@dataclass(slots=True)
class Judge:
    """Decides on mutants of one program's C; the shim is compiled once."""

    program: Program
    symbols: Symbols
    files: Mapping[str, str]
    place: Path
    compiler: str
    expected: bytes
    esbmc_s: float

    def source(self) -> str:
        """Path of the emitted C among the files."""
        return next(path for path in self.files if Path(path).name == self.symbols.source)

    def expect(self, source: str) -> None:
        """Runs the C as it is, for what the mutants are compared with."""
        noticed = self.judge(CodeMutant("none", "nowhere", "", source), prove=False)
        if noticed is not Noticed.TESTS:
            raise RuntimeError("the emitted C does not run")  # `build` ran it before
        self.expected = (self.place / "out.bin").read_bytes()

    def judge(self, mutant: CodeMutant, *, prove: bool = True) -> Noticed:
        """Who notices the mutant."""
        (self.place / self.symbols.source).write_text(mutant.text, "utf-8")
        command = [self.compiler, *FLAGS, "-o", "mutant", self.symbols.source, "shim.o", "extra.o"]
        if run_command(command, self.place, COMPILE_S).status != 0:
            return Noticed.COMPILER
        out = self.place / "out.bin"
        out.unlink(missing_ok=True)
        ran = run_command([str(self.place / "mutant"), "in.bin", "out.bin"], self.place, RUN_S)
        if ran.status != 0 or out.read_bytes() != self.expected:
            return Noticed.TESTS
        return self.by_proof(mutant) if prove else Noticed.SURVIVED

    def by_proof(self, mutant: CodeMutant) -> Noticed:
        """What ESBMC says of a mutant that left the same behind.

        The functions asked about are the first on every way up from the changed one that have a reference: where
        those are proved equal to it, their callers cannot tell.
        """
        files = {**self.files, self.source(): mutant.text}
        with_reference = {target.function: target for target in targets(self.program, self.symbols)}
        asked = first_callers(mutant.text, mutant.function, with_reference)
        found = Noticed.EQUIVALENT
        for target in (with_reference[name] for name in asked):
            said = self.proved(files, target)
            if said is Said.REFUTED:
                return Noticed.ESBMC
            found = found if said is Said.PROVED else Noticed.SURVIVED
        return found

    def proved(self, files: Mapping[str, str], target: Target) -> Said:
        """ESBMC on one function."""
        return prove_function(self.program, self.symbols, files, target, self.esbmc_s).said


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
    source = next(text for path, text in files.items() if Path(path).name == native.symbols.source)
    with prepared(native, files, sessions, 0.0) as judge:
        mutant = CodeMutant("none", "nowhere", "", variants(source)[1])
        return judge is None or judge.judge(mutant, prove=False) is Noticed.SURVIVED


@contextmanager
def prepared(
    native: Native,
    files: Mapping[str, str],
    sessions: Sequence[tuple[int, int, Sequence[Snapshot]]],
    esbmc_s: float,
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
        judge = Judge(program, symbols, files, place, compiler, b"", esbmc_s)
        judge.expect(next(text for path, text in files.items() if Path(path).name == symbols.source))
        yield judge


def judge_code(
    native: Native,
    files: Mapping[str, str],
    sessions: Sequence[tuple[int, int, Sequence[Snapshot]]],
    sample: int | None,
    seed: int = 1984,
    esbmc_s: float = 60.0,
) -> list[tuple[CodeMutant, Noticed]]:
    """Judges mutants of the emitted C.

    Args:
        native: The program as it is, compiled.
        files: The emitted files, text by path.
        sessions: What is run: number of the function, mode (see `shim`), rows.
        sample: How many mutants; None for all.
        seed: Of the sample.
        esbmc_s: Time limit of ESBMC for one function, in seconds.
    """
    source = next(text for path, text in files.items() if Path(path).name == native.symbols.source)
    mutants = list(code_mutants(source, max((len(t.lines) for t in native.program.tables), default=1)))
    if sample is not None and len(mutants) > sample:
        mutants = Random(seed).sample(mutants, sample)  # noqa: S311  # a repeatable sample
    with prepared(native, files, sessions, esbmc_s) as judge:
        return [] if judge is None else [(mutant, judge.judge(mutant)) for mutant in mutants]
