"""What each kind of evidence shows of the C of a whole system, or why it does not look at it.

In: a linked system and all files that `rcsc compile` writes of it. Out: evidence, as of a program; the levels' own C has its
evidence program by program.

The C is played by drawn sessions, for sanitizers and for counting what was reached: outside gives any values, mostly in their ranges;
the user's functions answer anything of their types; levels start again and go on from copies, some of them spoilt. What a step must
give is compared by `rcsc test`, beside the Python system.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from rcsc.base.host.files import csv_text
from rcsc.base.host.tools import Absent, BuildFailed
from rcsc.code.testing.coverage.case import outside_of
from rcsc.driver.settings import silent
from rcsc.lang.model import Array, Bool
from rcsc.lang.restart import After, SameAs
from rcsc.run.link import Linked
from rcsc.run.link.wiring import End, LinkedLevel, Question
from rcsc.views.evidence import analysers
from rcsc.views.evidence.kind import Evidence, Missed, Shortfall, excused
from rcsc.views.evidence.llvm import Measured, Point, measured, tools
from rcsc.views.evidence.misra import compliance
from rcsc.views.evidence.out_of_reach import uncovered

STEPS = 40_000
"""Steps of the drawn sessions: twice what reaches the last branch of the paper's system."""


@dataclass(frozen=True, slots=True)
class Whole:
    """A system whose tables are proved.

    Attributes:
        files: The files that `rcsc compile` writes of it and of its levels, text by path.
        progress: Called with each step.
        missed: What was not covered of the C, where that was measured before.
    """

    system: Linked
    files: Mapping[str, str]
    progress: Callable[[str], None] = silent
    missed: tuple[Missed, ...] | None = None

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
    short += uncovered(whole.source, missed)
    rows = [("line", "function", "what", "reason")]
    rows += [(str(each.line), each.function, each.what, each.reason) for each in missed]
    files = {"drawn.c": main, "coverage.txt": seen.text, "missed.csv": csv_text(rows)}
    accepted = tuple(excused(whole.source, missed))
    return Evidence(figures, files, tuple(short), missed=tuple(missed), accepted=accepted)


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
            adopted = level.program.sign.restart.items()
            given = (at for at, adopts in adopted if isinstance(adopts, SameAs | After))
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
        "misra": lambda whole: compliance.evidence_of(whole.files, whole.missed),
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


# --- drawn sessions --------------------------------------------------------------------------

SESSION = 400
"""Steps after which the system begins anew."""


def drawn_system(system: Linked, calls: int) -> str:
    """Return the file.

    Args:
        system: The system.
        calls: The number of steps.
    """
    p = system.word
    lines = [f"static {p}_t s, copy;"]
    for question in {
        question.function: question for level in system.levels for question in level.questions
    }.values():
        lines += _answer(question)
    lines += ["static void outside(void) {"]
    for buffer in system.buffers:
        if buffer.source is None and buffer.target is not None:
            lines += ["    if (next() % 2u == 0u) {"]
            lines += (f"        {each}" for each in _values(buffer.target, f"s.{buffer.place}"))
            lines += ["    }"]
    lines += [
        "}",
        "static void fail(void) { /* memory that fails: what one level gives another is anything */",
    ]
    for buffer in system.buffers:
        if buffer.source is not None and buffer.target is not None:
            lines += ["    if (next() % 16u == 0u) {"]
            lines += (f"        {each}" for each in _values(buffer.target, f"s.{buffer.place}"))
            lines += ["    }"]
    lines += ["}", "static void spoil(uint64_t level) {", "    switch (level) {"]
    lines += (f"    case {at}: {_spoilt(level)} break;" for at, level in enumerate(system.levels, 1))
    lines += ["    default: break;", "    }", "}"]
    level = f"({p}_level_t)(next() % {len(system.levels) + 2}u)"
    body = [
        f"        if (n % {SESSION}u == 0u) {{ {p}_init(&s); copy = s; }}",
        "        outside();",
        "        if (next() % 16u == 0u) { fail(); }",
        f"        if (next() % 8u == 0u) {{ (void){p}_restart(&s, {level}); }}",
        "        if (next() % 8u == 0u) {",
        f"            const {p}_level_t level = {level};",
        "            if (next() % 4u == 0u) { spoil(level); }",
        f"            (void){p}_resume(&s, level, &copy);",
        "        }",
        "        if (next() % 16u == 0u) { copy = s; }",
        f"        (void){p}_step(&s);",
    ]
    return analysers.player(f"{p}.h", lines, body, calls)


def _values(end: End, place: str) -> Iterator[str]:
    """Yield statements that draw each leaf of a place; one in sixteen from its whole type."""
    for at in end.run:
        leaf, kind = end.program.sign.leaves[at], end.program.plan.program.variables[at].type
        inside, any_ = (analysers.drawn_value(leaf.c_type, kind, whole) for whole in (False, True))
        yield f"{place}{end.part(at)} = (next() % 16u == 0u) ? ({any_}) : ({inside});"


def _answer(question: Question) -> Iterator[str]:
    """Yield a function in place of the user's, which the system asks."""
    yield f"{question.head} {{"
    yield from (f"    (void)key_{at};" for at, _ in enumerate(question.keys))
    place = "answer" if isinstance(question.into.kind, Array) else "(*answer)"
    yield from (f"    {each}" for each in _values(question.into, place))
    yield "}"


def _spoilt(level: LinkedLevel) -> str:
    """Return a statement that spoils the copy's state of a level, so that nothing can go on from it."""
    return f"copy.{level.member}.digest ^= 1u;"
