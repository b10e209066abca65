"""Mutants of the emitted C: bits of the masks, constants, operators; each must be noticed or be equivalent.

In: a program, its emitted C, the sessions that its executors agreed on. Out: for each mutant who noticed it.
A number of a mask or of a class table is decided by the complete check of the matcher, without a run:
the mutant is noticed, or no input can tell. Any other mutant runs in a process of its own on all the sessions; one that
leaves the same behind is decided by the check of the matcher where it is in one, else by ESBMC, which proves it
equal to the reference for all inputs (equivalent) or refutes it. What neither decides is undecided: that is a
figure, no fault of the C.
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
from rcsc.code.testing.executors.externs import STAND_INS
from rcsc.code.testing.executors.native import COMPILE_S, Native
from rcsc.code.testing.executors.shim import shim_c
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.executors.targets import ComparedFunction, targets
from rcsc.code.testing.matchers.matcher import Checked, Compared, check_matcher
from rcsc.code.testing.matchers.matcher_text import matcher_text, numbers
from rcsc.lang.model import Program, Snapshot

RUN_S = 20.0
MOST_MASKS = 5000
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


@dataclass(frozen=True, slots=True)
class Decider:
    """The numbers of all masks and class tables, and what the complete check says of others in their place."""

    source: str = field(default="", repr=False)
    places: Mapping[int, tuple[Compared, int, int]] = field(default_factory=dict)
    """By offset in the source: the table, the component (-1 for its masks) and the position."""

    def knows(self, mutant: CodeMutant) -> bool:
        """Whether the mutant is a changed mask or class."""
        return mutant.change == "mask" and mutant.start in self.places and mutant.base == self.source

    def decides(self, mutant: CodeMutant) -> Noticed | None:
        """Who notices a changed mask or class; None where the mutant is something else."""
        value = INTEGER.match(mutant.new)
        if value is None or not self.knows(mutant):
            return None
        compared, component, at = self.places[mutant.start]
        number = int(value[1], 0)
        masks = component < 0
        same = compared.with_word(at, number) if masks else compared.with_class(component, at, number)
        return Noticed.EQUIVALENT if same else Noticed.MATCHER


def decider(
    program: Program, symbols: Symbols, files: Mapping[str, str], checked: Mapping[str, Checked]
) -> Decider:
    """What the complete check of the tables in `checked` knows, by place in the C file.

    A number whose value is not the one that the check read from the compiled C is left out.
    """
    source = variants(source_of(symbols, files))[0]
    places: dict[int, tuple[Compared, int, int]] = {}
    for table in program.tables:
        if table.name not in checked or not checked[table.name].tables:
            continue
        tables, function = checked[table.name].tables, symbols.lines[table.name]
        for initializer in numbers(source, function, matcher_text(source, function, symbols.struct)):
            compared, component = tables[initializer.lookup], initializer.component
            read = compared.words if component < 0 else [at for at, _ in compared.classes[component]]
            if list(initializer.values) == read:
                entries = ((compared, component, at) for at, _ in enumerate(read))
                places.update(zip(initializer.offsets, entries, strict=True))
    return Decider(source, places)


def source_of(symbols: Symbols, files: Mapping[str, str]) -> str:
    """The emitted C file."""
    return next(text for path, text in files.items() if Path(path).name == symbols.source)


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
    decider: Decider

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
        decided = self.decider.decides(mutant)
        if decided is Noticed.MATCHER:
            return decided
        noticed = self.by_tests(mutant.text)
        if noticed is not Noticed.UNDECIDED:
            return Noticed.MISSED if decided and noticed is Noticed.TESTS else noticed
        return decided or self.by_proof(mutant)

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
        if target.kind == "line":
            table = self.program.tables[target.number]
            checked = check_matcher(self.program, self.symbols, files, table)
            if isinstance(checked, tuple):
                return Noticed.MATCHER
            if isinstance(checked, Checked) and not checked.truths:
                return Noticed.EQUIVALENT  # complete without the truths of conditions
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
    with prepared(native, files, sessions, 0.0, Decider()) as judge:
        other = variants(source_of(native.symbols, files))[1]
        return judge is None or judge.by_tests(other) is Noticed.UNDECIDED


@contextmanager
def prepared(
    native: Native,
    files: Mapping[str, str],
    sessions: Sequence[tuple[int, int, Sequence[Snapshot]]],
    esbmc_s: float,
    decides: Decider,
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
        judge = Judge(program, symbols, files, place, compiler, b"", esbmc_s, decides)
        judge.expect(source_of(symbols, files))
        yield judge


def judge_masks(
    symbols: Symbols, files: Mapping[str, str], lines: int, decides: Decider
) -> list[tuple[CodeMutant, Noticed]]:
    """Judges mutants of the masks and class tables, by the complete check alone; by sample where there are many.

    Args:
        symbols: Names in the emitted C.
        files: The emitted files, text by path.
        lines: How many lines the largest table has.
        decides: The check.
    """
    every = [m for m in code_mutants(source_of(symbols, files), lines) if decides.knows(m)]
    if len(every) > MOST_MASKS:
        every = Random(SEED).sample(every, MOST_MASKS)  # noqa: S311  # a repeatable sample
    return [(mutant, decides.decides(mutant) or Noticed.UNDECIDED) for mutant in every]


@dataclass(frozen=True, slots=True)
class Sample:
    """Which mutants are run.

    Attributes:
        others: How many of those that the check of the masks does not know; None for all.
        equal: Those that the check calls equivalent; as many of them are run to see whether that is so.
    """

    others: int | None
    equal: tuple[CodeMutant, ...] = ()

    def of(self, every: Sequence[CodeMutant], decides: Decider) -> list[CodeMutant]:
        """The mutants to run."""
        others = [mutant for mutant in every if not decides.knows(mutant)]
        if self.others is None:
            return [*others, *self.equal]
        random = Random(SEED)  # noqa: S311  # a repeatable sample
        return [
            code_mutant
            for group in (others, self.equal)
            for code_mutant in random.sample(group, min(self.others, len(group)))
        ]


def judge_code(
    native: Native,
    files: Mapping[str, str],
    sessions: Sequence[tuple[int, int, Sequence[Snapshot]]],
    decides: Decider,
    sample: Sample,
    esbmc_s: float = 60.0,
    progress: Callable[[str], None] = lambda _: None,
) -> list[tuple[CodeMutant, Noticed]]:
    """Judges mutants of the emitted C.

    Args:
        native: The program as it is, compiled.
        files: The emitted files, text by path.
        sessions: What is run: number of the function, mode (see `shim`), rows.
        decides: The check of the masks and class tables.
        sample: Which mutants.
        esbmc_s: Time limit of ESBMC for one function, in seconds; 0 leaves it out.
        progress: Told which mutant is judged.
    """
    lines = max((len(t.lines) for t in native.program.tables), default=1)
    mutants = sample.of(list(code_mutants(source_of(native.symbols, files), lines)), decides)
    judged = []
    with prepared(native, files, sessions, esbmc_s, decides) as judge:
        for number, mutant in enumerate(mutants if judge else (), 1):
            progress(f"mutant {number} of {len(mutants)} of the C of {native.program.name}")
            judged.append((mutant, judge.judge(mutant)))  # type: ignore[union-attr]  # there is one
    return judged
