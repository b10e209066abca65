"""Fuzzes the whole pipeline with garbage and with mutated tables: only coded errors, no hang, bounded memory.

`python -m tests.fuzz --runs 100000 --seed 1` for a long run; `tests/test_fuzz.py` makes a short one in the suite.
"""

import argparse
import random
import re
import resource
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rcsc.diagnostics.diagnostic import Diagnostic
from rcsc.emit.c99 import emit_c
from rcsc.emit.python import emit_python
from rcsc.lower import lower
from rcsc.model import Program
from rcsc.prove.options import Options
from rcsc.prove.program import prove_program
from rcsc.resolve import compile_text

REPO = Path(__file__).parents[1]
SLOWEST_S = 30.0
MEMORY_MB = 2048
OPTIONS = Options(steps=1_000_000, solver="boxes")

WORDS = (
    "table level state input output enum record array of int real bool .. | || := ( ) { } [ ] in and or not implies "
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
    for name, emitted in (*emit_python(plan).items(), *emit_c(plan).items()):
        if name.endswith(".py"):
            compile(emitted, name, "exec")
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


def main() -> None:
    """A long run, by command."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--runs", type=int, default=10_000)
    arguments.add_argument("--seed", type=int, default=1)
    given = arguments.parse_args()
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
