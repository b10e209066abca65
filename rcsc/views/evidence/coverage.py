"""Coverage of the generated C: vectors that take every branch and show every condition, as llvm-cov measures it."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import cast

from rcsc.base.host.tools import Absent, BuildFailed
from rcsc.code.emit.identifiers import names_in
from rcsc.code.testing.coverage.document import VectorSet, as_json, vectors_document
from rcsc.code.testing.coverage.goals import decides, decides_masked
from rcsc.code.testing.coverage.harness import vectors_c
from rcsc.code.testing.coverage.marks import Outcomes, marked, ways_of
from rcsc.code.testing.coverage.vector_set import defended, figure, further_figures, vector_set
from rcsc.code.testing.target_coverage import BOARD, counted_on_target
from rcsc.driver.trials import proofs
from rcsc.views.evidence.kind import ABSENT, Evidence, Kind, Missed, Shortfall, Subject, excused, versions_of
from rcsc.views.evidence.llvm import Measured, Tools, measured, tools
from rcsc.views.evidence.out_of_reach import Reasons, uncovered

GUARDED = "defensive"
"""Prefix of the places, and folder of the files, of C that trusts no state."""

NOT_PLAYED = "not played"
"""What the program that plays vectors says of those that ask a machine to round as it cannot."""


def collect(subject: Subject) -> Evidence:
    """Make vectors, measure their coverage with clang, and explain what cannot be covered; the same for `--defensive`."""
    llvm = tools()
    if isinstance(llvm, Absent):
        return Evidence((), missing=llvm.reason)
    options, guarded = subject.options, subject.defensive()
    document = vector_set(subject.plan, subject.files, options, proofs(options).solver, subject.progress)
    gained, refusing = _gained(document), defended(document, guarded.files)
    plain, whole = _of(llvm, subject, document, gained), _of(llvm, guarded, refusing, gained)
    there, text, wrong = tuple[str, ...](), dict[str, str](), list[Shortfall]()
    if plain.missed is not None:
        there, text, wrong = _on_target(subject, document, plain.files["vectors.c"])
    return Evidence(
        (*plain.figures, *there, *(f"{GUARDED}: {line}" for line in whole.figures)),
        {**plain.files, **text, **{f"{GUARDED}/{path}": text for path, text in whole.files.items()}},
        (
            *plain.shortfalls,
            *wrong,
            *(Shortfall(f"{GUARDED}, {each.where}", each.what) for each in whole.shortfalls),
        ),
        missed=plain.missed,
        accepted=plain.accepted,
    )


def _on_target(
    subject: Subject, document: VectorSet, vectors: str
) -> tuple[tuple[str, ...], dict[str, str], list[Shortfall]]:
    """Play the vectors in a build by a target's compiler: a figure, the counts as a file, and what went wrong."""
    source = document.symbols.source
    subject.progress(f"measuring {source} on an emulated target")
    counted = counted_on_target(subject.files, source, vectors)
    if isinstance(counted, Absent):
        return (f"not measured with a target's compiler: {counted.reason}",), {}, []
    if isinstance(counted, BuildFailed):
        return (), {}, [Shortfall(source, f"on the target: {counted.text}")]
    wrong = [Shortfall(source, f"on the target {counted.wrong} vectors are wrong")] if counted.wrong else []
    if counted.played + counted.left != len(document.kept):
        wrong.append(
            Shortfall(source, f"on the target {counted.played} of {len(document.kept)} vectors were played")
        )
    return (counted.words,), {"target.txt": counted.text}, wrong


def _of(llvm: Tools, subject: Subject, document: VectorSet, gained: int) -> Evidence:
    """Play the vectors of one text of the C, and report what they do not cover; `gained` is what masking adds to MC/DC."""
    plan = subject.plan
    vectors = vectors_c(document.program, document.symbols, document.kept)
    subject.progress(f"measuring the C of {document.program.name}")
    seen = measured(llvm, subject.files, document.symbols.source, vectors)
    if isinstance(seen, BuildFailed):
        return Evidence((), {"vectors.c": vectors}, (Shortfall(document.symbols.source, seen.text),))
    names = names_in(plan)
    reasons = Reasons(plan, names, marked(plan.program).decisions, document.unreached)
    missed = list(reasons.missed(seen))
    files = {
        "report.md": _report(llvm, document, seen, missed, gained),
        "coverage.txt": seen.text,
        "vectors.c": vectors,
        "vectors.json": as_json([vectors_document(document)]),
        "missed.json": json.dumps([asdict(each) for each in missed], indent=1) + "\n",
    }
    figures, shortfalls = _figures(llvm, document, seen, missed, gained), _shortfalls(document, seen, missed)
    return Evidence(
        figures,
        files,
        tuple(shortfalls),
        missed=tuple(missed),
        accepted=tuple(excused(document.symbols.source, missed)),
    )


def _kind_of(missed: Missed) -> str:
    """Return the count of `Measured.counts` that lacks it."""
    if missed.what == "statement":
        return "blocks of statements"
    return "MC/DC conditions" if missed.what.startswith("condition ") else "outcomes of branches"


def _figures(
    llvm: Tools, document: VectorSet, seen: Measured, missed: Sequence[Missed], gained: int
) -> tuple[str, ...]:
    lines = [figure(document).partition(": ")[2]]
    for words, (every, covered) in seen.counts.items():
        reasoned = sum(bool(each.reason) for each in missed if _kind_of(each) == words)
        reach = f", {reasoned} shown to be out of reach" if reasoned else ""
        left = every - covered - reasoned
        lines.append(f"{covered} of {every} {words}{reach}{f', {left} open' if left else ''}")
    said = seen.played.strip().splitlines() or ["nothing was said"]
    every, unique = seen.counts["MC/DC conditions"]
    lines.append(f"MC/DC is that of unique cause; by masking it is {unique + gained} of {every}")
    lines += further_figures(document)
    return (*lines, f"by llvm-cov {llvm.version}, while the C played the vectors: {said[-1]}")


def _gained(document: VectorSet) -> int:
    """Return how many conditions vectors show by masking and not by a unique cause.

    They are in decisions of the tables: the others of the C are chains of one operator, where the two are the same.
    """
    ways: dict[int, dict[tuple[Outcomes, bool], None]] = {}
    for hit in (hit for kept in document.kept for hit in kept.hits):
        match hit:
            case ("decision", int(at), outcomes, bool(truth)):
                ways.setdefault(at, {})[(cast(Outcomes, outcomes), truth)] = None
    gained = 0
    for at, decision in enumerate(marked(document.program).decisions):
        possible = [] if decision.form is None else ways_of(decision.form)
        for number in set(range(len(decision.conditions))) - decision.constant if possible else ():
            seen = ways.get(at, {})
            gained += not decides(seen, number) and decides_masked(seen, possible, number)
    return gained


def _shortfalls(document: VectorSet, seen: Measured, missed: Sequence[Missed]) -> list[Shortfall]:
    source = document.symbols.source
    failing = [line for line in seen.played.splitlines() if line.startswith("vector ")]
    found = [Shortfall(source, line) for line in failing]
    *_, last = ["", *seen.played.splitlines()]
    whole = f"{len(document.kept)} vectors, 0 wrong"
    if NOT_PLAYED in last:
        found.append(Shortfall(source, last))
    elif not failing and not (seen.passed and whole in last):
        found.append(Shortfall(source, "the program that plays the vectors stopped"))
    return found + uncovered(source, missed)


def _report(llvm: Tools, document: VectorSet, seen: Measured, missed: Sequence[Missed], gained: int) -> str:
    """Return a page: figures, then everything that is not covered, with its reason."""
    lines = [f"# Coverage of {document.symbols.source}", ""]
    lines += [f"- {line}" for line in _figures(llvm, document, seen, missed, gained)]
    lines += [
        "",
        "Every vector starts from a complete state, calls one function, and says what it must give by the meaning of the",
        "tables: `vectors.c` plays them with nothing but the generated C, on a host or on the target, and `vectors.json`",
        "has them for other tools. `coverage.txt` is the file with its counts, as llvm-cov prints it.",
        "",
        "Beside coverage, vectors notice slips: another constant, the next value on each side of a bound, another variable of the type, a",
        "statement left out. `vectors.json` lists under `unnoticed` what no vector was found to notice: most of it changes nothing.",
        "",
        "Vectors are made of the tables: they show that the C does what the tables say, and not that the tables say what is required.",
        "That is for tests of requirements, which are none of these: scripts of orders (`rcsc run`), episodes that properties watch",
        "(`rcsc campaign`, `rcsc test` of a system), and properties, which are proved of every run; `rcsc trace` keeps them apart.",
        "",
        f"MC/DC and the table below were measured in a build by clang {llvm.version} for this machine. gcc for a small processor counts",
        "lines and outcomes of branches in a build of its own, on an emulator (`target.txt`); before version 14 it does not count MC/DC.",
        "",
        "MC/DC is that of *unique cause* with short-circuit operators: two vectors part in one condition and in the decision, and agree",
        "in every other condition that both look at; llvm-cov counts it so. *Masking* MC/DC is weaker: other conditions may differ",
        "where they decide nothing (CAST-6). What no pair shows by unique cause is in the table below.",
        "",
        "## Not covered",
        "",
        "| line | function | what | why it is out of reach |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {each.line} | `{each.function}` | {each.what.replace('|', chr(92) + '|')} | {each.reason or '**not shown**'} |"
        for each in missed
    ]
    return "\n".join(lines) + "\n"


def _versions() -> dict[str, str]:
    llvm = tools()
    target = ([BOARD.compiler[0], "--version"], [BOARD.emulator[0], "--version"])
    if isinstance(llvm, Absent):
        return {"clang": ABSENT, **versions_of(*target)}
    return versions_of(*([tool, "--version"] for tool in (llvm.clang, llvm.profdata, llvm.cov)), *target)


KIND = Kind("vectors, and their coverage of statements, branches and MC/DC in the C", collect, _versions)
