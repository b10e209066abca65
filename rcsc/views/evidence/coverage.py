"""Coverage of the generated C: vectors that take every branch and show every condition, as llvm-cov measures it."""

import json
from collections.abc import Sequence
from dataclasses import asdict

from rcsc.base.host.tools import Absent, BuildFailed
from rcsc.code.emit.identifiers import names_in
from rcsc.code.testing.coverage.document import VectorSet, as_json, vectors_document
from rcsc.code.testing.coverage.harness import vectors_c
from rcsc.code.testing.coverage.marks import marked
from rcsc.code.testing.coverage.vector_set import defended, figure, vector_set
from rcsc.driver.trials import proofs
from rcsc.views.evidence.kind import ABSENT, Evidence, Kind, Shortfall, Subject, versions_of
from rcsc.views.evidence.llvm import Measured, Tools, measured, tools
from rcsc.views.evidence.out_of_reach import Missed, Reasons, uncovered

GUARDED = "defensive"
"""Prefix of the places, and folder of the files, of C that trusts no state."""


def collect(subject: Subject) -> Evidence:
    """Make vectors, measure their coverage with clang, and explain what cannot be covered; the same for `--defensive`."""
    llvm = tools()
    if isinstance(llvm, Absent):
        return Evidence((), missing=llvm.reason)
    options, guarded = subject.options, subject.defensive()
    document = vector_set(subject.plan, subject.files, options, proofs(options).solver, subject.progress)
    plain, whole = _of(llvm, subject, document), _of(llvm, guarded, defended(document, guarded.files))
    return Evidence(
        (*plain.figures, *(f"{GUARDED}: {line}" for line in whole.figures)),
        {**plain.files, **{f"{GUARDED}/{path}": text for path, text in whole.files.items()}},
        (*plain.shortfalls, *(Shortfall(f"{GUARDED}, {each.where}", each.what) for each in whole.shortfalls)),
    )


def _of(llvm: Tools, subject: Subject, document: VectorSet) -> Evidence:
    """Play the vectors of one text of the C, and report what they do not cover."""
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
        "report.md": _report(llvm, document, seen, missed),
        "coverage.txt": seen.text,
        "vectors.c": vectors,
        "vectors.json": as_json([vectors_document(document)]),
        "missed.json": json.dumps([asdict(each) for each in missed], indent=1) + "\n",
    }
    return Evidence(_figures(llvm, document, seen, missed), files, tuple(_shortfalls(document, seen, missed)))


def _kind_of(missed: Missed) -> str:
    """Return the count of `Measured.counts` that lacks it."""
    if missed.what == "statement":
        return "blocks of statements"
    return "MC/DC conditions" if missed.what.startswith("condition ") else "outcomes of branches"


def _figures(llvm: Tools, document: VectorSet, seen: Measured, missed: Sequence[Missed]) -> tuple[str, ...]:
    lines = [figure(document).partition(": ")[2]]
    for words, (every, covered) in seen.counts.items():
        reasoned = sum(bool(each.reason) for each in missed if _kind_of(each) == words)
        reach = f", {reasoned} shown to be out of reach" if reasoned else ""
        left = every - covered - reasoned
        lines.append(f"{covered} of {every} {words}{reach}{f', {left} open' if left else ''}")
    said = seen.played.strip().splitlines() or ["nothing was said"]
    return (*lines, f"by llvm-cov {llvm.version}, while the C played the vectors: {said[-1]}")


def _shortfalls(document: VectorSet, seen: Measured, missed: Sequence[Missed]) -> list[Shortfall]:
    source = document.symbols.source
    failing = [line for line in seen.played.splitlines() if line.startswith("vector ")]
    found = [Shortfall(source, line) for line in failing]
    whole = f"{len(document.kept)} vectors, 0 wrong"
    if not failing and not (seen.passed and whole in seen.played):
        found.append(Shortfall(source, "the program that plays the vectors stopped"))
    return found + uncovered(source, missed)


def _report(llvm: Tools, document: VectorSet, seen: Measured, missed: Sequence[Missed]) -> str:
    """Return a page: figures, then everything that is not covered, with its reason."""
    lines = [f"# Coverage of {document.symbols.source}", ""]
    lines += [f"- {line}" for line in _figures(llvm, document, seen, missed)]
    lines += [
        "",
        "Every vector starts from a complete state, calls one function, and says what it must give by the meaning of the",
        "tables: `vectors.c` plays them with nothing but the generated C, on a host or on the target, and `vectors.json`",
        "has them for other tools. `coverage.txt` is the file with its counts, as llvm-cov prints it.",
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
    if isinstance(llvm, Absent):
        return {"clang": ABSENT}
    return versions_of(*([tool, "--version"] for tool in (llvm.clang, llvm.profdata, llvm.cov)))


KIND = Kind("vectors, and their coverage of statements, branches and MC/DC in the C", collect, _versions)
