"""What each kind of evidence shows of the C of a whole system, or why it does not look at it.

In: a linked system and its files. Out: evidence, as of a program.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from rcsc.base.host.files import csv_text
from rcsc.base.host.tools import Absent, BuildFailed
from rcsc.code.testing.coverage.case import outside_of
from rcsc.driver.settings import silent
from rcsc.lang.model import Bool
from rcsc.run.adopt import Copied, Numbered, adoption
from rcsc.run.link import Linked
from rcsc.views.evidence import analysers
from rcsc.views.evidence.kind import Evidence, Shortfall
from rcsc.views.evidence.llvm import Measured, Point, measured, tools
from rcsc.views.evidence.misra import compliance
from rcsc.views.evidence.out_of_reach import Missed
from rcsc.views.evidence.whole.drawn import drawn_system

STEPS = 40_000
"""Steps of the drawn sessions: twice what reaches the last branch of the paper's system."""


@dataclass(frozen=True, slots=True)
class Whole:
    """A system whose tables are proved.

    Attributes:
        files: The files that `rcsc compile` writes of it and of its levels, text by path.
        progress: Called with each step.
    """

    system: Linked
    files: Mapping[str, str]
    progress: Callable[[str], None] = silent

    @property
    def source(self) -> str:
        """Name of the system's C file."""
        return f"{self.system.word}.c"


def collect(whole: Whole, kind: str) -> Evidence:
    """Make evidence of one kind; where the kind does not look at such C, give the reason."""
    if kind in LOOKS:
        return LOOKS[kind](whole)
    return Evidence((f"{whole.source} is not looked at: {PASSES[kind]}",))


def _coverage(whole: Whole) -> Evidence:
    """Measure what the drawn sessions reach of the C, as clang counts it, and list what they do not."""
    llvm = tools()
    if isinstance(llvm, Absent):
        return Evidence((), missing=llvm.reason)
    whole.progress(f"measuring {whole.source}")
    main = drawn_system(whole.system, STEPS)
    seen = measured(llvm, whole.files, whole.source, main)
    if isinstance(seen, BuildFailed):
        return Evidence((), {"drawn.c": main}, (Shortfall(whole.source, seen.text),))
    missed = [*_missed(whole, seen)]
    reasoned = sum(bool(each.reason) for each in missed)
    figures = (
        *(f"{covered} of {every} {words}" for words, (every, covered) in seen.counts.items()),
        f"{len(missed)} not covered, {reasoned} of them shown to be out of reach",
        f"by llvm-cov {llvm.version}, in {STEPS} drawn steps; what a step must give is compared by `rcsc test`",
    )
    short = [Shortfall(whole.source, "the drawn sessions stopped")] if not seen.passed else []
    short += [
        Shortfall(f"{whole.source}:{each.line}", f"{each.function}: not covered: {each.what}")
        for each in missed
        if not each.reason
    ]
    rows = [("line", "function", "what", "reason")]
    rows += [(str(each.line), each.function, each.what, each.reason) for each in missed]
    files = {"drawn.c": main, "coverage.txt": seen.text, "missed.csv": csv_text(rows)}
    return Evidence(figures, files, tuple(short))


def _missed(whole: Whole, seen: Measured) -> Iterator[Missed]:
    """Yield everything that was not covered, with the reason where one is known."""
    for point in seen.branches:
        for word, count in (("true", point.true), ("false", point.false)):
            if not count:
                reason = _fresh(whole, point) if (point.text, word) == ("at < 0", "false") else ""
                yield Missed(point.function, point.line, f"`{point.text}` {word}", reason)
    for decision in seen.decisions:
        for at, shown in enumerate(decision.shown, 1):
            if not shown:
                what = f"condition {at} of {len(decision.shown)} decides on its own"
                yield Missed(decision.function, decision.line, what, "")
    yield from (Missed(r.function, r.line, "statement", "") for r in seen.regions if not r.count)


def _fresh(whole: Whole, point: Point) -> str:
    """Return the reason why `check` refuses no level that starts anew; "" where none is known."""
    for level in whole.system.levels:
        if point.function == f"{whole.system.word}_restart_{level.member}":
            program, leaves = level.program.plan.program, level.program.sign.leaves
            given = (
                start.at for start in adoption(level.program.sign) if isinstance(start, Copied | Numbered)
            )
            narrow = (
                at
                for at in given
                if not isinstance(program.variables[at].type, Bool)
                and outside_of(program.variables[at], leaves[at].c_type)
            )
            return "" if program.invariants or any(True for _ in narrow) else FRESH
    return ""


FRESH = "a level that starts anew has its initial state; what else it is given may be any value of its type, and no invariant is to be kept"


def _analysers(whole: Whole) -> Evidence:
    main = drawn_system(whole.system, analysers.CALLS // 4)
    return analysers.looked_at([analysers.Text("", whole.files, whole.source, main)], whole.progress)


LOOKS: Mapping[str, Callable[[Whole], Evidence]] = MappingProxyType(
    {
        "coverage": _coverage,
        "analysers": _analysers,
        "misra": lambda whole: compliance.evidence_of(whole.files),
    }
)
PASSES: Mapping[str, str] = MappingProxyType(
    {
        "runtime": "it copies members of structs and counts; the sanitizers of `analysers` watch its drawn sessions",
        "model-check": "ESBMC is asked about tables; `rcsc test` compares the C of a system with the Python system",
        "resources": "it has no loop and calls each level once; add its levels' figures",
    }
)
"""Kinds that do not look at the C of a system, and why not."""
