"""The guideline compliance summary of a program's C, after MISRA Compliance:2020, made from what the checkers say.

In: emitted files. Out: for each guideline its category, its compliance, how it was checked, and each deviation with its place and
reason. What nobody checks is said so. A violation that no reason explains is a shortfall: a reason is for a place, and nothing is let
pass everywhere.
"""

import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from rcsc.base.host.files import csv_text, read
from rcsc.views.evidence.kind import ABSENT, Evidence, Kind, Missed, Shortfall
from rcsc.views.evidence.misra.cppcheck import (
    BASIC_TYPE,
    ENUMERATOR,
    EXTENSION,
    HELD,
    MISSING,
    NEVER_CHANGES,
    NEVER_RUN,
    OWN,
    SIZED,
    UNGUARDED,
    ZERO,
    Checked,
    Finding,
    check,
    engine,
    installed,
)
from rcsc.views.evidence.misra.guidelines import RULES, Category, Guideline, guidelines
from rcsc.views.pages.dossier_page import AcceptedPoint

ELSEWHERE: Mapping[str, str] = {
    "Dir 2.1": "`rcsc evidence --only analysers` compiles it with every warning", "1.1": "`rcsc evidence --only analysers`",
    "Dir 3.1": "`rcsc trace` leads from each line of code to a line or declaration of a table, and to its requirements",
    "Dir 4.1": "`rcsc evidence --only runtime` shows each operation defined",
    "Dir 4.14": "`rcsc evidence --only runtime`: what the user gives is admitted or refused before it is used",
}  # fmt: skip
"""Guidelines that are not looked at here, and what looks at them."""
SEARCHED: Mapping[str, str] = {
    "Dir 4.6": "a search of the text for basic types", "Dir 4.10": "a search of the headers for their guards",
    "12.5": "a search of the text: sizeof is of types alone",
}  # fmt: skip
"""Guidelines that are looked at here, beside cppcheck."""
PARTLY: Mapping[str, str] = {
    "2.1": "statements that no input reaches are listed by the kind `coverage`, which was not made with this one",
    "2.2": "nobody looks for every operation without effect, such as a value that is written over before it is read",
    "14.3": "conditions that no input changes are listed by the kind `coverage`, which was not made with this one",
}
"""Guidelines of which cppcheck sees a part, and who knows the rest: that cppcheck finds nothing is no compliance."""
MEASURED = "the kind `coverage`: what no vector reaches, and why nothing can"
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_BASIC = re.compile(r"\b(char|short|int|long|float|double|signed|unsigned)\b")
_ENUMERATOR = re.compile(r"^\s*([A-Z][A-Z0-9_]*)\s*=\s*-?\d+", re.MULTILINE)
_HELD = re.compile(r"^static .*\b\w+_(?:atleast|atmost|within)_\w+\(", re.ASCII)
_ZERO = re.compile(r" \+ 0\.0f?;")
_EXTENSION = re.compile(r"__attribute__|#\s*pragma (?!STDC)")
_SIZED = re.compile(r"\bsizeof\b(?!\s*\(\s*\w+_t\s*\))")
_COMPARED = re.compile(r"(?:==|!=|<=|>=|<|>)\s*([A-Z][A-Z0-9_]*)\b")
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


@dataclass(frozen=True, slots=True)
class Deviation:
    """A place where a guideline is not kept, on purpose.

    Attributes:
        guideline: Its guideline, also where the checker names another.
        code: A pattern that the line must match for the reason to hold there.
        files: The required end of the file's name.
    """

    check: str
    guideline: str
    code: str
    reason: str
    files: str = ""


DEVIATIONS = (
    Deviation(
        "misra-c2012-17.3", "1.2", r"\b__builtin_ctz(?:ll)?\(",
        "bit counting is an extension of GCC and Clang, which declare it themselves, and is used only where they compile; others get "
        "plain C. It is no implicit declaration: -Werror=implicit-function-declaration is silent",
    ),
    Deviation(
        "misra-c2012-8.7", "8.7", r"^[a-z]\w*(?: \w+)* \**\w+\(",
        "a function of the header: the user's own file calls it", ".c",
    ),
    Deviation("misra-c2012-2.3", "2.3", r"typedef|^\}", "a type of the header, for the user's own file; headers of types are shared", ".h"),
    Deviation("misra-c2012-2.4", "2.4", r"enum|struct|^\}", "a type of the header, for the user's own file", ".h"),
    Deviation("misra-c2012-2.5", "2.5", r"#\s*define", "a name of the header, for the user's own file", ".h"),
    Deviation(
        "misra-c2012-7.3", "7.3", r"^(?!.*\b(?:0[xX][0-9a-fA-F]+|[0-9][0-9.]*)[uU]*l).*\b[a-fA-FpP][0-9a-fA-FpP]*l+\b",
        "no violation: the checker takes a name of the letters of hexadecimal digits that ends in l for a number",
    ),
    Deviation(
        "knownConditionTrueFalse", "14.3", r"_exact\(\)",
        "no violation: cppcheck computes reals otherwise than the target, whose arithmetic this tests when it runs",
    ),
    Deviation(
        "knownConditionTrueFalse", "14.3", r"\bseveral\b|m & \(m - ",
        "a table of one line: that no two lines match is tested all the same, as of every table",
    ),
    *(
        Deviation(
            check, "2.2", r"^\s+(?:const )?(?:\w+ )?v_\w+ = ",
            "a local has a value from its declaration on, so that none is read before it has one (9.1); or the table's own text sets "
            "what it does not read",
        )
        for check in ("redundantAssignment", "redundantInitialization", "unreadVariable")
    ),
    Deviation(
        HELD, "2.2", r"\(",
        "defensive code: it changes no value that was proved, and says what was, so that an analyser of ranges follows",
    ),
    Deviation(
        ZERO, "2.2", _ZERO.pattern,
        "it takes -0.0 to 0.0, so that a state has one zero; of every other value it changes nothing",
    ),
    Deviation(
        EXTENSION, "1.2", _EXTENSION.pattern,
        "of GNU C, and only where the compiler says that it is that: so that no call is made, and each operation is rounded by itself; "
        "others get plain C",
    ),
    Deviation(
        BASIC_TYPE, "Dir 4.6", r"\bdouble\b",
        "reals are IEEE binary64 as they were proved; the program tests when it runs that double is that",
    ),
    Deviation(
        BASIC_TYPE, "Dir 4.6", r"\bfloat\b",
        "reals declared single are IEEE binary32 as they were proved; the program tests when it runs that float is that",
    ),
    Deviation(BASIC_TYPE, "Dir 4.6", r"typedef char \w+\[", "no value has this type: it does not compile where a size is not as stated"),
    Deviation(
        ENUMERATOR, "10.4", r"[A-Z]",
        "an enumerator, which is an int, is compared with an object of a fixed width: it is not negative, and both promote to the same "
        "value. An object of an enumeration's own type would have another size by compiler option",
    ),
)  # fmt: skip


def explained(finding: Finding, files: Mapping[str, str]) -> Deviation | None:
    """Return the deviation that explains a finding, by the text at its place; None where nothing does."""
    text = next((text for path, text in files.items() if path.rpartition("/")[2] == finding.file), "")
    lines = text.splitlines()
    line = lines[finding.line - 1] if 0 < finding.line <= len(lines) else ""
    for one in DEVIATIONS:
        if one.check == finding.check and finding.file.endswith(one.files) and re.search(one.code, line):
            if one.guideline == "8.7" and not _declared(line, files):
                continue
            return one
    return None


def _declared(line: str, files: Mapping[str, str]) -> bool:
    """Return whether a header declares the function that this line defines."""
    name = line.partition("(")[0].split()[-1].lstrip("*")
    return any(f"{name}(" in text for path, text in files.items() if path.endswith(".h"))


SEARCHES: Mapping[str, str] = {
    HELD: "a function that changes no value that was proved", ZERO: "an addition of 0.0",
    EXTENSION: "an extension of a compiler", SIZED: "sizeof of what may be no type",
}  # fmt: skip
"""What is found at a place, in words."""


def _uncovered(missed: Sequence[Missed], files: Mapping[str, str]) -> Iterator["ComplianceFinding"]:
    """Yield what was not covered as statements that are never run (2.1), and conditions that never change (14.3)."""
    texts = [(path.rpartition("/")[2], text) for path, text in files.items() if path.endswith(".c")]
    for each in missed:
        if each.what.startswith("condition "):  # of a decision, which changes all the same
            continue
        file = next(
            (
                name
                for name, text in texts
                if re.search(rf"^[^\n;]*\b{each.function}\([^;]*$", text, re.MULTILINE)
            ),
            "",
        )
        check = (
            NEVER_CHANGES
            if each.what.startswith("`") and not each.what.startswith(("`case ", "`default"))
            else NEVER_RUN
        )
        reason = f"defensive code: it answers what was shown not to come; {each.reason}"
        deviation = Deviation(check, OWN[check], "", reason) if each.reason else None
        yield ComplianceFinding(Finding(file, each.line, check, f"not covered: {each.what}"), deviation)


def own_findings(files: Mapping[str, str]) -> Iterator[Finding]:
    """Yield places that cppcheck does not look for: basic types, enumerators compared with objects, functions without effect."""
    bare = {
        path.rpartition("/")[2]: _bare(text) for path, text in files.items() if path.endswith((".c", ".h"))
    }
    enumerators = {name for text in bare.values() for name in _ENUMERATOR.findall(text)}
    for file, text in bare.items():
        for at, line in enumerate(text.splitlines(), 1):
            if found := _BASIC.search(line):
                yield Finding(file, at, BASIC_TYPE, f"basic type {found[1]}")
            if any(name in enumerators for name in _COMPARED.findall(line)):
                yield Finding(file, at, ENUMERATOR, "an enumerator compared with an object")
            searched = ((HELD, _HELD), (ZERO, _ZERO), (EXTENSION, _EXTENSION), (SIZED, _SIZED))
            yield from (
                Finding(file, at, check, SEARCHES[check]) for check, what in searched if what.search(line)
            )


def _bare(text: str) -> str:
    """Return the text with comments made blank."""
    return _COMMENT.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


# --- the table -------------------------------------------------------------------------------


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
        measured: Whether what was not covered is among them.
    """

    checked: Checked
    places: tuple[ComplianceFinding, ...]
    plain: bool
    measured: bool = False

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
        known = self.measured and number in (OWN[NEVER_RUN], OWN[NEVER_CHANGES])
        how = f"{how}; {MEASURED if known else PARTLY[number]}" if number in PARTLY else how
        if any(place in self.unexplained for place in own):
            return Compliance.VIOLATION, how
        if own:
            return Compliance.DEVIATION, how
        if number in UNUSED and self.plain:
            return Compliance.NOT_APPLICABLE, UNUSED[number]
        if how:
            return Compliance.NOT_CHECKED if number in PARTLY and not known else Compliance.COMPLIANT, how
        return Compliance.NOT_CHECKED, f"not here: {ELSEWHERE[number]}" if number in ELSEWHERE else "nobody"


def summary(files: Mapping[str, str], missed: Sequence[Missed] | None = None) -> Summary:
    """Check C and headers, and explain the findings by their places.

    Args:
        files: Texts by path.
        missed: What was not covered of the C; None where that was not measured.
    """
    checked = check(files)
    findings = (*checked.findings, *own_findings(files), *_unguarded(files))
    places = [ComplianceFinding(one, explained(one, files)) for one in findings]
    places += _uncovered(missed or (), files)
    return Summary(checked, tuple(places), _plain(files), missed is not None)


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


def evidence_of(files: Mapping[str, str], missed: Sequence[Missed] | None = None) -> Evidence:
    """Make the compliance table of C and its headers; `missed` as of `summary`."""
    if not installed():
        return Evidence((), missing=MISSING)
    made = summary(files, missed)
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
    accepted = tuple(
        AcceptedPoint(place.guideline, place.where, place.deviation.reason)
        for place in made.places
        if place.deviation is not None and place not in made.unexplained
    )
    return Evidence((figure,), tables, tuple(_shortfalls(made)), accepted=accepted)


KIND = Kind(
    "compliance with MISRA C:2012, guideline by guideline, each deviation with its place",
    lambda subject: evidence_of(subject.files, subject.missed),
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
