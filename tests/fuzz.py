"""Fuzzes the whole pipeline with garbage and with mutated tables: only coded errors, no hang, bounded memory.

`python -m tests.fuzz --runs 100000 --seed 1` for a long run; `tests/emit/test_fuzz.py` makes a short one in the suite. With
`--names` programs of adversarial names, types and docs are emitted, compiled by gcc and clang under the strict flags, imported and run: C,
Python, interpreter and the evaluator of `tests.differential` agree; and so are the manual's programs that declare links.
"""

import argparse
import random
import re
import resource
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.code.emit import emitted
from rcsc.code.emit.lower import lower
from rcsc.lang import reserved
from rcsc.lang.model import Program, ProvedProgram, seal_of_proof
from rcsc.lang.resolve import compile_text
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from tests import differential

REPO = Path(__file__).parents[1]
SLOWEST_S = 30.0
MEMORY_MB = 2048
OPTIONS = Options(steps=1_000_000, solver="boxes")

WORDS = (
    "table level state input output enum record array of int real bool .. | || := ( ) { } [ ] in and or xor not implies "
    '= /= <= >= < > + - * / mod 0 1 -1 18446744073709551616 1e400 0.1 "x" # ## \x00 \r ; , : when DEFAULT '
    "unreachable next case else for if local true false abs min max é \u202e \u0430 use extern python"
).split(" ")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one text came to: `proved` with code emitted, or the codes of its diagnostics."""

    codes: tuple[str, ...]
    seconds: float


def run(text: str) -> Outcome:
    """The whole pipeline on one text; any exception is a bug in rcsc and passes through."""
    begun = time.monotonic()
    program = compile_text(text)
    if not isinstance(program, Program):
        return Outcome(_codes(program, text), time.monotonic() - begun)
    verdict = prove_program(program, OPTIONS)
    if verdict.proved is None:
        return Outcome(_codes(verdict.findings, text), time.monotonic() - begun)
    plan = lower(verdict.proved)
    for name, code in emitted(plan).items():
        if name.endswith(".py"):
            compile(code, name, "exec")
    return Outcome(("proved",), time.monotonic() - begun)


def _codes(found: Sequence[Diagnostic], text: str) -> tuple[str, ...]:
    """The codes; AssertionError where there is none or a span lies outside the text."""
    assert found, "refused without a diagnostic"
    for diagnostic in found:
        span = diagnostic.primary.span
        assert 0 <= span.start <= span.end <= len(text) + 1, f"{diagnostic.code} points outside the text"
        assert not diagnostic.code.value.startswith("RCS9"), diagnostic.message
    return tuple(d.code.value for d in found)


def _alone(path: Path, root: Path) -> str:
    """The text with what it uses in the place where it says so."""

    def text_of(found: re.Match[str]) -> str:
        return _alone(root / f"{found[1]}.rcs", root)

    return re.sub(r"^use ([\w/]+)$", text_of, path.read_text(encoding="utf-8"), flags=re.MULTILINE)


def seeds() -> tuple[str, ...]:
    """Texts to mutate: the shipped tables (made to stand alone) and the manual's examples."""
    root = REPO / "tables"
    tables = [_alone(path, root) for path in sorted(root.rglob("*.rcs"))]
    manual = (REPO / "grammar/manual.md").read_text(encoding="utf-8").split("```")
    examples = [part.removeprefix("rcs\n") for part in manual if part.startswith("rcs\n")]
    return tuple(tables + examples * 3)


def mutate(text: str, rng: random.Random) -> str:
    """One to four edits: cut, copy, swap, insert a word, change a character or a number."""
    for _ in range(rng.randint(1, 4)):
        start, end = sorted((rng.randrange(len(text) + 1), rng.randrange(len(text) + 1)))
        end = min(end, start + rng.choice((1, 3, 20, 200)))
        kind = rng.randrange(6)
        if kind == 0:
            text = text[:start] + text[end:]
        elif kind == 1:
            text = text[:start] + text[start:end] * rng.choice((2, 2, 2, 50)) + text[end:]
        elif kind == 2:
            text = text[:start] + " " + rng.choice(WORDS) + " " + text[start:]
        elif kind == 3:
            text = text[:start] + chr(rng.choice((0, 9, 10, 13, 34, 124, 127, 0x202E, 0xFEFF))) + text[end:]
        elif kind == 4:
            rows = text.split("\n")
            one, two = rng.randrange(len(rows)), rng.randrange(len(rows))
            rows[one], rows[two] = rows[two], rows[one]
            text = "\n".join(rows)
        else:
            text = text.replace(str(rng.randrange(10)), rng.choice(("0", "-1", "9" * 25, "3.5")), 1)
    return text


def texts(runs: int, seed: int) -> Iterator[str]:
    """`runs` texts: nine mutated tables for one of garbage."""
    rng = random.Random(seed)
    known = seeds()
    for _ in range(runs):
        if rng.randrange(10) == 0:
            yield " ".join(rng.choice(WORDS) for _ in range(rng.randint(0, 200)))
        else:
            yield mutate(rng.choice(known), rng)


def campaign(runs: int, seed: int) -> tuple[Counter[str], float]:
    """Runs them all; how many texts showed each code, and the slowest in seconds."""
    count: Counter[str] = Counter()
    slowest = 0.0
    for number, text in enumerate(texts(runs, seed)):
        try:
            outcome = run(text)
        except Exception as bug:
            raise AssertionError(f"run {number} of seed {seed}: {text!r}") from bug
        assert outcome.seconds < SLOWEST_S, f"run {number} of seed {seed} took {outcome.seconds:.1f} s"
        count.update(set(outcome.codes))
        slowest = max(slowest, outcome.seconds)
    return count, slowest


# --- names, types and docs ---

STRICT = (
    "-std=c99", "-O1", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Wshadow", "-Wtrigraphs", "-Werror",
)  # fmt: skip
OURS = frozenset(
    """input state output table level procedure module owner extern enum record type unit const use assume invariant property
    was then reads writes python c bool int real true false and or xor not implies in mod abs min max if else case for next
    local call array of period preprocess postprocess by reject clamp deferred until assumed monitored proved assuming when
    line procedures DEFAULT unreachable rest command_out status_out above same all set safe restart count single until upon then again
    property link serves commands adopt""".split()
)
"""Words of the language, and headings."""
KEPT = sorted(
    (
        reserved.C_KEYWORDS | reserved.C_MACROS | reserved.C_COMPOSED | reserved.C_HEADERS | reserved.PYTHON_KEYWORDS
        | reserved.PYTHON_BUILTINS | reserved.PYTHON_MEMBERS | reserved.PYTHON_MODULES
    ) - OURS
)  # fmt: skip
ODD = """s v_x x X x_ _x __x __slots__ __init__ _value_ _missing_ State IntEnum copy_in copy_out fault fault_at assumptions_failed ready0
    i0 w0 given subject chosen more_i INT_MAX EOF E2BIG A I B0 None_ mro self m t t0 do run exact bit32 admit settle init class_x_0 K0_0
    G0 O0 l1 Il _Bool _Generic __LINE__ _ __ e1 x1e5 f u8 L R lines step cycle name value""".split()  # fmt: skip
MADE = (
    "was_{}", "held_{}", "line_of_{}", "to_{}", "last_{}", "none_{}", "line_{}", "keep_previous", "none",
    "was_v", "line_of_t",
)  # fmt: skip
"""What the compiler calls the states, procedures and members that it adds."""
ENDINGS = "_ _2 _line _lines _step _cycle _next _t _0 _1 _LINES _ACTIONS _out __ _K0_0".split()
DOCS = (
    "*/ int evil(void); /*",
    "ends in \\",
    "??/ ??' ???/",
    "%s %n",
    '"""',
    "''' \\u0041 \\x",
    "coding: latin-1",
    "// /* {{ 7 }} {% x %} {# #}",
    "${HOME} #[[ ]]",
    "\u05d0\u0627\u0301 \u0430",
    "x" * 3000,
    "cppcheck-suppress all",
    "#define x",
)


def hostile_words(rng: random.Random) -> Callable[[], str]:
    """Names, each another: words that something keeps, and what becomes like another name by a prefix, an ending or a case."""
    given: list[str] = []

    def word() -> str:
        while True:
            name = rng.choice(rng.choice((KEPT, ODD)))
            if given and rng.randrange(2):
                near = rng.choice(given[-12:])
                ways = (
                    near + rng.choice(ENDINGS),
                    near.upper(),
                    near.capitalize(),
                    f"x{near}",
                    f"run_{near}",
                    f"do_{near}",
                    f"_{near}",
                    *(made.format(near) for made in MADE),
                )
                name = rng.choice(ways)
            if name.isidentifier() and name.isascii() and name not in OURS and name not in given:
                given.append(name)
                return name

    return word


def documented(text: Sequence[str], rng: random.Random) -> list[str]:
    """The lines, declarations among them with a doc now and then."""
    heads = ("input ", "state ", "output ", "procedure ", "table ", "level ", "assume ", "record ", "enum ")
    found = []
    for line in text:
        if line.startswith(heads) and rng.randrange(2):
            found.append(f"## {rng.choice(DOCS)}")
        found.append(line)
    return found


def named(number: int, seed: int, taken: set[str]) -> differential.Built | tuple[str, ...]:
    """A drawn program with adversarial names, emitted; the codes where it was refused."""
    rng = random.Random(f"{seed} {number} names")
    sizes = (1, 1, 2, 3, 5, 200) if rng.randrange(8) == 0 else (1, 1, 2, 3)
    drawn = differential.Maker(rng, hostile_words(rng), sizes).draw()
    drawn.text = documented(drawn.text, rng)
    own = rng.choice([one for one in (*KEPT, *ODD) if len(one) < 60 and one.lower() not in taken])
    taken.add(own.lower())
    return differential.built(drawn, own)


OF_LINKS = OURS | frozenset(
    """silent within cycles report reason deferred status command done failed executing resting late settle pause to from last ms s
    period answered""".split()
)
"""Words of the language where levels are linked, and what the protocol makes."""
MADE_BY_LINKS = (
    "done", "failed", "to_a", "last_a", "a_late", "new_command", "answered", "inc_command", "settle", "value",
    "order", "x",
)  # fmt: skip
WORD = re.compile(r"\b[a-z_][a-z_0-9]*\b")


def linked(number: int, seed: int) -> str:
    """A program of the manual that declares links, with some names (of links, members, levels, lines) that are adversarial."""
    rng = random.Random(f"{seed} {number} links")
    manual = (REPO / "grammar/manual.md").read_text(encoding="utf-8").split("```")
    texts = [part.removeprefix("rcs\n") for part in manual if part.startswith("rcs\n") and "serves" in part]
    text = rng.choice([each for each in texts if "# error" not in each])
    names = sorted({*WORD.findall(re.sub(r"#.*", "", text))} - OF_LINKS)
    word = hostile_words(rng)
    new = {
        name: rng.choice(MADE_BY_LINKS) if rng.randrange(5) == 0 else word()
        for name in rng.sample(names, min(len(names), rng.randint(1, 8)))
    }
    return WORD.sub(lambda found: new.get(found[0], found[0]), text)


def links_campaign(runs: int, seed: int, compilers: Sequence[str]) -> Counter[str]:
    """Emits, compiles, imports and runs programs with links of adversarial names; how many were refused with which code."""
    told: Counter[str] = Counter()
    for number in range(runs):
        text = linked(number, seed)
        try:
            program = compile_text(text, "linked.rcs")
            if not isinstance(program, Program):
                told.update(f"links refused {code}" for code in set(_codes(program, text)))
                continue
            plan = lower(ProvedProgram(program, seal_of_proof()))
            files = emitted(plan)
            with tempfile.TemporaryDirectory(prefix="rcsc-links-") as place:
                for cc in compilers:
                    compiled(files, Path(place), cc)
            module = ModuleType("linked")
            [python] = [source for path, source in files.items() if path.endswith(".py")]
            exec(compile(python, "linked.py", "exec"), module.__dict__)  # noqa: S102  # it is what is tested
            state = module.State()
            for cycle in [name for name in vars(module) if name.endswith("_cycle")]:
                getattr(module, cycle)(state)
        except Exception as bug:
            raise AssertionError(f"links {number} of seed {seed}: {bug}\n{text}") from bug
        told["programs with links"] += 1
    return told


def compiled(files: Mapping[str, str], folder: Path, cc: str) -> None:
    """Compiles the C without a warning; AssertionError where there is one."""
    for path, text in files.items():
        (folder / Path(path).name).write_text(text, encoding="utf-8")
    sources = [Path(path).name for path in files if path.endswith(".c")]
    command = [cc, *STRICT, "-c", *sources, "-o", "strict.o"]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, "\n".join(ran.stderr.splitlines()[:12])


def strictly(built: differential.Built, folder: Path, cc: str) -> None:
    """Compiles the C of one program without a warning."""
    try:
        compiled(built.files, folder, cc)
    except AssertionError as bug:
        raise AssertionError("\n".join([str(bug), *built.drawn.text])) from bug


def names_campaign(runs: int, seed: int, compilers: Sequence[str]) -> Counter[str]:
    """Emits, compiles, imports and runs programs of adversarial names; how many cycles ended how."""
    told: Counter[str] = Counter()
    for begin in range(0, runs, differential.BATCH):
        taken: set[str] = set()
        batch = {
            number: named(number, seed, taken)
            for number in range(begin, min(begin + differential.BATCH, runs))
        }
        whole = {number: built for number, built in batch.items() if isinstance(built, differential.Built)}
        told.update(
            f"refused {' '.join(sorted(set(one)))}" for one in batch.values() if isinstance(one, tuple)
        )
        with tempfile.TemporaryDirectory(prefix="rcsc-names-") as place:
            for number, one in whole.items():
                try:
                    for cc in compilers:
                        strictly(one, Path(place), cc)
                except AssertionError as bug:
                    raise AssertionError(f"program {number} of seed {seed}: {bug}") from bug
            made = differential.library(list(whole.values()), Path(place), "-O0")
            for number, one in whole.items():
                try:
                    differential.compare(one, made, random.Random(f"{seed} {number} inputs"), told)
                except Exception as bug:
                    raise AssertionError(f"program {number} of seed {seed}: {bug}") from bug
                told["programs"] += 1
    return told


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--runs", type=int, default=10_000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument(
        "--names", action="store_true", help="adversarial names, types and docs, compiled and run"
    )
    given = arguments.parse_args()
    if given.names:
        compilers = [cc for cc in ("gcc", "clang") if shutil.which(cc)]
        told = names_campaign(given.runs, given.seed, compilers)
        told += links_campaign(given.runs // 4, given.seed, compilers)
        for name, number in sorted(told.items()):
            print(f"{name:24} {number:9}")
        return
    count, slowest = campaign(given.runs, given.seed)
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    assert peak_mb < MEMORY_MB, f"{peak_mb} MB"
    print(
        f"{given.runs} texts, seed {given.seed}: no uncoded failure; slowest {slowest:.2f} s; peak {peak_mb} MB"
    )
    for code, number in count.most_common():
        print(f"  {code:8} {number:7}")


if __name__ == "__main__":
    main()
