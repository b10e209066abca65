"""The manual's examples: each compiles and proves, or reports exactly what its comments say."""

import re
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from rcsc.base.diagnostics import report
from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.base.diagnostics.source import Source
from rcsc.compose.contract import claims
from rcsc.compose.proof.standing import KnownVerdict
from rcsc.proof.solvers.options import Options
from tests.support.programs.stages import reported

REPO = Path(__file__).parents[2]
CASE = re.compile(r"^```rcs\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
EXPECTED = re.compile(r"# error: \[(\w+)\]")


def _cases(folder: Path) -> list[ParameterSet]:
    found = []
    for path in sorted(folder.glob("*.md")):
        page = path.read_text(encoding="utf-8")
        for case in CASE.finditer(page):
            line = page.count("\n", 0, case.start()) + 1
            found.append(pytest.param(case["text"], id=f"{path.stem}:{line}"))
    return found


@pytest.mark.parametrize("text", _cases(REPO / "grammar") + _cases(REPO / "tests" / "tables"))
def test_reports_exactly_what_the_comments_say(text: str) -> None:
    expected = {
        (number, code)
        for number, line in enumerate(text.splitlines(), start=1)
        for code in EXPECTED.findall(line)
    }
    source = Source("case.rcs", text)
    found = {
        (source.position(d.primary.span.start).line, d.code.value)
        for d in reported(text, Options())
        if d.severity is Severity.ERROR
    }
    assert found == expected


def test_the_manual_has_examples_of_both_kinds() -> None:
    page = (REPO / "grammar" / "manual.md").read_text(encoding="utf-8")
    texts = [case["text"] for case in CASE.finditer(page)]
    wrong = [text for text in texts if EXPECTED.search(text)]
    assert len(wrong) >= 6
    assert len(texts) - len(wrong) >= 12


def test_the_manual_says_what_every_verdict_means() -> None:
    """Of a claim, of a system, and of a table."""
    page = (REPO / "grammar" / "manual.md").read_text(encoding="utf-8")
    section = page.partition("## What a verdict says\n")[2].partition("\n## ")[0]
    meant = {word for row in section.splitlines() for word in re.findall(r"\*([^*]+)\*", row.split(" | ")[0])}
    printed = {one.value for kind in (claims.Verdict, KnownVerdict, report.Verdict) for one in kind}
    assert printed <= meant
    assert {"rests on", "proved, trusting"} <= meant
