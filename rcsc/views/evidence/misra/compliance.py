"""The guideline compliance summary of a program's C, after MISRA Compliance:2020, made from what the checkers say.

In: emitted files. Out: for each guideline its category, its compliance, how it was checked, and each deviation with its place and
reason. What nobody checks is said so. A violation that no reason explains is a shortfall.
"""

import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from rcsc.base.host.files import csv_text, read
from rcsc.views.evidence.kind import ABSENT, Evidence, Kind, Shortfall
from rcsc.views.evidence.misra.cppcheck import (
    MISSING,
    OWN,
    UNGUARDED,
    Checked,
    Finding,
    check,
    engine,
    installed,
)
from rcsc.views.evidence.misra.deviations import Deviation, explained, own_findings
from rcsc.views.evidence.misra.guidelines import RULES, Category, Guideline, guidelines

ELSEWHERE: Mapping[str, str] = {
    "Dir 2.1": "`rcsc evidence --only analysers` compiles it with every warning", "1.1": "`rcsc evidence --only analysers`",
    "Dir 3.1": "`rcsc trace` leads from each line of code to a line or declaration of a table, and to its requirements",
    "Dir 4.1": "`rcsc evidence --only runtime` shows each operation defined",
    "Dir 4.14": "`rcsc evidence --only runtime`: what the user gives is admitted or refused before it is used",
}  # fmt: skip
"""Guidelines that are not looked at here, and what looks at them."""
SEARCHED: Mapping[str, str] = {
    "Dir 4.6": "a search of the text for basic types", "Dir 4.10": "a search of the headers for their guards",
}  # fmt: skip
"""Guidelines that are looked at here, beside cppcheck."""
_GUARD = re.compile(r"^#ifndef (\w+)\n#define \1$", re.MULTILINE)
_ONLY = ("stdbool.h", "stdint.h")
"""The only headers of the standard library that the C includes."""
UNUSED: Mapping[str, str] = {
    "Dir 4.3": "it has no assembly", "Dir 4.9": "it has no function-like macro", "Dir 4.12": "it allocates nothing",
    **dict.fromkeys(("Dir 4.11", "21.13", "21.17", "21.18"), "it calls no function of the standard library"),
    **dict.fromkeys(("Dir 4.13", *(f"22.{at}" for at in range(1, 11))), "it uses no stream, no memory of the heap and no errno"),
}  # fmt: skip
"""Guidelines about what the C does not use, with the reason; where the text bears it out."""
_USES = re.compile(r"\b(?:asm|__asm__|malloc|calloc|realloc|free|fopen|fclose|errno)\b|#\s*define\s+\w+\(")


class Compliance(StrEnum):
    """The compliance with a guideline."""

    COMPLIANT = "compliant"
    DEVIATION = "deviation"
    VIOLATION = "violation"
    NOT_APPLICABLE = "not applicable"
    NOT_CHECKED = "not checked"


@dataclass(frozen=True, slots=True)
class ComplianceFinding:
    """A finding, and the deviation that it is; None for a violation."""

    finding: Finding
    deviation: Deviation | None

    @property
    def guideline(self) -> str:
        """The number of the guideline; that of the deviation where the checker names another."""
        return self.finding.rule if self.deviation is None else self.deviation.guideline

    @property
    def where(self) -> str:
        """The file and line."""
        return f"{self.finding.file}:{self.finding.line}"

    @property
    def what(self) -> str:
        """The finding as text: the add-on gives only a rule's number, and `RULES` the rest."""
        return RULES.get(self.guideline, "") if self.finding.of_addon else self.finding.text


@dataclass(frozen=True, slots=True)
class Summary:
    """The compliance of some files.

    Attributes:
        places: Every finding with its reason.
    """

    checked: Checked
    places: tuple[ComplianceFinding, ...]
    plain: bool

    @property
    def unexplained(self) -> tuple[ComplianceFinding, ...]:
        """The findings without a reason; for a mandatory guideline no reason counts."""
        mandatory = {one.number for one in guidelines() if one.category is Category.MANDATORY}
        return tuple(one for one in self.places if one.deviation is None or one.guideline in mandatory)

    def of(self, guideline: Guideline) -> tuple[Compliance, str]:
        """Return the compliance with a guideline, and how it was checked."""
        number, looks = guideline.number, self.checked.rules.get(guideline.number, "")
        own = [place for place in self.places if place.guideline == number]
        how = looks or SEARCHED.get(number, "") or ("a search of the text" if own else "")
        if any(place in self.unexplained for place in own):
            return Compliance.VIOLATION, how
        if own:
            return Compliance.DEVIATION, how
        if number in UNUSED and self.plain:
            return Compliance.NOT_APPLICABLE, UNUSED[number]
        if how:
            return Compliance.COMPLIANT, how
        return Compliance.NOT_CHECKED, f"not here: {ELSEWHERE[number]}" if number in ELSEWHERE else "nobody"


def summary(files: Mapping[str, str]) -> Summary:
    """Check C and headers, and explain the findings by their places."""
    checked = check(files)
    findings = (*checked.findings, *own_findings(files), *_unguarded(files))
    return Summary(
        checked, tuple(ComplianceFinding(one, explained(one, files)) for one in findings), _plain(files)
    )


def _unguarded(files: Mapping[str, str]) -> Iterator[Finding]:
    for path, text in files.items():
        if path.endswith(".h") and not _GUARD.search(text):
            yield Finding(
                path.rpartition("/")[2], 1, UNGUARDED, "a header without a guard against including it twice"
            )


def _plain(files: Mapping[str, str]) -> bool:
    """Return whether the C uses nothing of the standard library but its types."""
    texts = [text for path, text in files.items() if path.endswith((".c", ".h"))]
    included = {name for text in texts for name in re.findall(r"#include <([^>]+)>", text)}
    return included <= set(_ONLY) and not any(_USES.search(text) for text in texts)


# --- as evidence -----------------------------------------------------------------------------


def evidence_of(files: Mapping[str, str]) -> Evidence:
    """Make the compliance table of C and its headers."""
    if not installed():
        return Evidence((), missing=MISSING)
    made = summary(files)
    if made.checked.failure:
        return Evidence((), missing=made.checked.failure)
    counts = Counter(made.of(one)[0] for one in guidelines())
    words = ", ".join(f"{counts[kind]} {kind}" for kind in Compliance)
    figure = f"MISRA C:2012, {sum(counts.values())} guidelines: {words}; by {made.checked.tool}"
    tables = {
        "compliance.csv": _table(made),
        "places.csv": _places(made),
        "suppressions.txt": _suppressions(made),
    }
    return Evidence((figure,), tables, tuple(_shortfalls(made)))


KIND = Kind(
    "compliance with MISRA C:2012, guideline by guideline, each deviation with its place",
    lambda subject: evidence_of(subject.files),
    lambda: {"cppcheck": engine() or ABSENT},
)


def _shortfalls(made: Summary) -> Iterator[Shortfall]:
    for place in made.unexplained:
        yield Shortfall(
            place.where, f"violates {place.guideline or 'no guideline'}: {place.what} [{place.finding.check}]"
        )


def _table(made: Summary) -> str:
    """Return one row for each guideline: number, category, compliance, how it was checked, deviations and their reasons."""
    rows = [("guideline", "category", "compliance", "checked by", "places", "reasons")]
    for one in guidelines():
        compliance, how = made.of(one)
        own = [place for place in made.places if place.guideline == one.number]
        reasons = dict.fromkeys(place.deviation.reason for place in own if place.deviation is not None)
        rows.append((one.number, one.category, compliance, how, str(len(own) or ""), "; ".join(reasons)))
    return csv_text(rows)


def _places(made: Summary) -> str:
    rows = [("guideline", "file", "line", "check", "finding", "reason")]
    for place in sorted(made.places, key=lambda one: (one.guideline, one.finding.file, one.finding.line)):
        reason = place.deviation.reason if place.deviation is not None else "VIOLATION"
        found = place.finding
        rows.append((place.guideline, found.file, str(found.line), found.check, place.what, reason))
    return csv_text(rows)


def _suppressions(made: Summary) -> str:
    """Return the same for cppcheck's `--suppressions-list`, place by place, to run it again; own searches are left out."""
    lines = [
        f"// {place.guideline}: {place.deviation.reason}\n{place.finding.check}:{place.finding.file}:{place.finding.line}"
        for place in made.places
        if place.deviation is not None and place.finding.check not in OWN
    ]
    return "\n".join([*dict.fromkeys(lines), ""])


def main(folder: str) -> int:
    """Check a folder of generated C; print the findings without a reason."""
    paths = sorted(path for path in Path(folder).iterdir() if path.suffix in {".c", ".h"})
    made = summary({path.name: read.text(path) for path in paths})
    for place in made.unexplained:
        sys.stdout.write(f"{place.where}: {place.guideline}: {place.what} [{place.finding.check}]\n")
    sys.stdout.write(
        f"{len(made.places)} findings, {len(made.unexplained)} without a reason. {made.checked.failure}\n"
    )
    return 1 if made.unexplained or made.checked.failure else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
