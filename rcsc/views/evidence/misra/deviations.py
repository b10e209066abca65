"""Why the emitted C deviates from a guideline at a place: a reason for each, and where it holds; nothing is let pass everywhere."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rcsc.views.evidence.misra.cppcheck import BASIC_TYPE, ENUMERATOR, HELD, Finding

_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_BASIC = re.compile(r"\b(char|short|int|long|float|double|signed|unsigned)\b")
_ENUMERATOR = re.compile(r"^\s*([A-Z][A-Z0-9_]*)\s*=\s*-?\d+", re.MULTILINE)
_HELD = re.compile(r"^static .*\b\w+_(?:atleast|atmost|within)_\w+\(", re.ASCII)
_COMPARED = re.compile(r"(?:==|!=|<=|>=|<|>)\s*([A-Z][A-Z0-9_]*)\b")


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
            if _HELD.search(line):
                yield Finding(file, at, HELD, "a function that changes no value that was proved")


def _bare(text: str) -> str:
    """Return the text with comments made blank."""
    return _COMMENT.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
