"""ESBMC proves the C equal to the tables, admission and procedures included; what it gives no answer to is named.

In: the emitted C of a program. Out: for each of its functions how much of it is proved equal, for all inputs and all
states within their ranges, to a reference that is written from the tables in another way (`rcsc.code.testing.esbmc`). A step
is asked about part by part, a cycle case by case. A part that has no answer within its time is named, and is no fault.
"""

from collections import Counter
from collections.abc import Iterator

from rcsc.base.host.tools import ESBMC_PACKAGE, ESBMC_VERSION, Absent, esbmc
from rcsc.code.testing.esbmc import MOST_LINES, EsbmcAnswer, EsbmcVerdict, prove_function, too_large
from rcsc.code.testing.executors.symbols import symbols_of
from rcsc.code.testing.executors.targets import targets
from rcsc.views.evidence.kind import ABSENT, Evidence, Kind, Shortfall, Subject, versions_of

QUESTION_S = 20.0
"""Time limit of ESBMC for one question, in seconds."""


def collect(subject: Subject) -> Evidence:
    """Ask ESBMC about every function of a program."""
    found = esbmc()
    if isinstance(found, Absent):
        return Evidence((), missing=found.reason)
    verdicts = tuple(_verdicts(subject))
    count = Counter(verdict.answer for verdict in verdicts)
    figure = (
        f"ESBMC: {count[EsbmcAnswer.PROVED]} of {len(verdicts)} functions proved equal to the tables, whole"
    )
    unknown = [verdict.function for verdict in verdicts if verdict.answer is not EsbmcAnswer.PROVED]
    named = (f"not, or in part: {', '.join(unknown)}",) if unknown else ()
    page = {"model-check.md": "\n".join(_page(verdicts))}
    return Evidence((figure, *named), page, tuple(_shortfalls(verdicts)))


def _verdicts(subject: Subject) -> Iterator[EsbmcVerdict]:
    symbols = symbols_of(subject.program, subject.files)
    for target in targets(subject.program, symbols):
        subject.progress(f"{target.function}: ESBMC")
        if too_large(subject.program, target):
            reason = (
                f"a table of more than {MOST_LINES} lines; its masks are checked one by one by `rcsc test`"
            )
            yield EsbmcVerdict(target.function, EsbmcAnswer.TOO_LARGE, 0, 0.0, reason)
        else:
            yield prove_function(subject.program, symbols, subject.files, target, QUESTION_S)


def _page(verdicts: tuple[EsbmcVerdict, ...]) -> Iterator[str]:
    yield from ("# The C as the tables say it, proved by ESBMC", "")
    yield f"ESBMC 8.4.0 ({ESBMC_PACKAGE} {ESBMC_VERSION}), at most {QUESTION_S:.0f} s a question. Proved of a function: for all"
    yield "inputs and all states within their ranges and invariants it gives the fault, the line and the state that the"
    yield "reference gives, and no index, division, shift or signed sum goes wrong. A step covers admission, deferral, the"
    yield "line and its procedures; a cycle also what runs before and after."
    yield from ("", "| Function | answer | properties | not covered |", "| --- | --- | ---: | --- |")
    for verdict in verdicts:
        detail = verdict.detail.replace("|", "/")
        yield f"| `{verdict.function}` | {verdict.answer} | {verdict.properties} | {detail} |"
    yield ""


def _shortfalls(verdicts: tuple[EsbmcVerdict, ...]) -> Iterator[Shortfall]:
    for verdict in verdicts:
        if verdict.answer not in (EsbmcAnswer.PROVED, EsbmcAnswer.TOO_LARGE):
            yield Shortfall(verdict.function, f"{verdict.answer}: {verdict.detail}")


def _versions() -> dict[str, str]:
    found = esbmc()
    return {"esbmc": ABSENT} if isinstance(found, Absent) else versions_of([found, "--version"])


KIND = Kind(
    "ESBMC: the C equals the tables, with admission and procedures (minutes a program)", collect, _versions
)
