"""Mutants of the emitted C: bits of the masks, constants, operators; each must be noticed or be equivalent.

In: a program, its emitted C, the sessions that its executors agreed on. Out: for each mutant who noticed it.
A mutant runs in a process of its own on all the sessions; one that leaves the same behind is given to ESBMC,
which proves it equal to the reference for all inputs (equivalent) or refutes it.
"""

import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from rcsc.model import Program, Snapshot
from rcsc.testing.esbmc import Said, prove_function
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
    """

    change: str
    where: str
    text: str


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    start: int
    depth: int
    in_table: bool


def _tokens(text: str) -> list[_Token]:
    """The tokens of a C file, with their depth in braces and whether they stand in an initializer list."""
    found: list[_Token] = []
    depth, table_depth, before = 0, 0, ""
    for match in TOKEN.finditer(text):
        kind, text_here = str(match.lastgroup), match.group()
        if kind == "skip":
            continue
        if text_here == "{":
            depth += 1
            table_depth += 1 if before == "=" or table_depth else 0
        found.append(_Token(kind, text_here, match.start(), depth, table_depth > 0))
        if text_here == "}":
            depth -= 1
            table_depth -= 1 if table_depth else 0
        before = text_here
    return found


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
        if token.in_table:
            bits = min(max(lines, value.bit_length()), 64 if "L" in suffix.upper() else 32)
            yield from (("mask", f"{value ^ 1 << bit}{suffix}") for bit in range(bits))
        else:
            yield "constant", f"{value + 1}{suffix}"
            if value:
                yield "constant", f"{value - 1}{suffix}"
    elif token.text in SWAPS:
        yield "operator", SWAPS[token.text]


def code_mutants(text: str, lines: int) -> Iterator[CodeMutant]:
    """Every mutant of a C file's functions.

    Args:
        text: The C file.
        lines: How many lines its largest table has: so many bits of each mask word are flipped.
    """
    tokens = _tokens(text)
    for at, token in enumerate(tokens):
        if token.depth == 0 or (token.text in SWAPS and not _binary(tokens, at)):
            continue
        for change, new in _changes(token, lines):
            row = text.count("\n", 0, token.start) + 1
            mutated = f"{text[: token.start]}{new}{text[token.start + len(token.text) :]}"
            yield CodeMutant(change, f"line {row}: {token.text} -> {new}", mutated)


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
        noticed = self.judge(CodeMutant("none", "nowhere", source), prove=False)
        if noticed is not Noticed.TESTS:
            raise RuntimeError("the emitted C does not run")  # `build` ran it before
        self.expected = (self.place / "out.bin").read_bytes()

    def judge(self, mutant: CodeMutant, *, prove: bool = True) -> Noticed:
        """Who notices the mutant."""
        (self.place / self.symbols.source).write_text(mutant.text, "utf-8")
        command = [self.compiler, *FLAGS, "-o", "mutant", self.symbols.source, "shim.o"]
        if run_command(command, self.place, COMPILE_S).status != 0:
            return Noticed.COMPILER
        out = self.place / "out.bin"
        out.unlink(missing_ok=True)
        ran = run_command([str(self.place / "mutant"), "in.bin", "out.bin"], self.place, RUN_S)
        if ran.status != 0 or out.read_bytes() != self.expected:
            return Noticed.TESTS
        return self.by_proof(mutant) if prove else Noticed.SURVIVED

    def by_proof(self, mutant: CodeMutant) -> Noticed:
        """What ESBMC says of a mutant that left the same behind."""
        files = {**self.files, self.source(): mutant.text}
        said = [self.proved(files, target) for target in targets(self.program, self.symbols)]
        if Said.REFUTED in said:
            return Noticed.ESBMC
        return Noticed.EQUIVALENT if all(one is Said.PROVED for one in said) else Noticed.SURVIVED

    def proved(self, files: Mapping[str, str], target: Target) -> Said:
        """ESBMC on one function."""
        return prove_function(self.program, self.symbols, files, target, self.esbmc_s).said


def _rows(native: Native, sessions: Sequence[tuple[int, bool, Sequence[Snapshot]]]) -> bytes:
    """The input file of the mutants: every session, for the function and for nobody else."""
    parts = []
    for which, whole, snapshots in sessions:
        parts += [array("q", [which, int(whole), len(snapshots)]), native.rows(snapshots)]
    return b"".join(part.tobytes() for part in parts)


def judge_code(
    native: Native,
    files: Mapping[str, str],
    sessions: Sequence[tuple[int, bool, Sequence[Snapshot]]],
    sample: int | None,
    seed: int = 1984,
    esbmc_s: float = 60.0,
) -> list[tuple[CodeMutant, Noticed]]:
    """Judges mutants of the emitted C.

    Args:
        native: The program as it is, compiled.
        files: The emitted files, text by path.
        sessions: What is run: number of the function, whether each row sets every leaf, rows.
        sample: How many mutants; None for all.
        seed: Of the sample.
        esbmc_s: Time limit of ESBMC for one function, in seconds.
    """
    compiler, program, symbols = c_compiler(), native.program, native.symbols
    source = next(text for path, text in files.items() if Path(path).name == symbols.source)
    mutants = list(code_mutants(source, max((len(t.lines) for t in program.tables), default=1)))
    if sample is not None and len(mutants) > sample:
        mutants = Random(seed).sample(mutants, sample)  # noqa: S311  # a repeatable sample
    if isinstance(compiler, Absent):
        return []
    with TemporaryDirectory(prefix="rcsc-mutants-") as scratch:
        place = Path(scratch)
        write_c(files, place)
        (place / "shim.c").write_text(shim_c(program, symbols), "utf-8")
        (place / "in.bin").write_bytes(_rows(native, sessions))
        run_command([compiler, *FLAGS, "-c", "-o", "shim.o", "shim.c"], place, COMPILE_S)
        judge = Judge(program, symbols, files, place, compiler, b"", esbmc_s)
        judge.expect(source)
        return [(mutant, judge.judge(mutant)) for mutant in mutants]
