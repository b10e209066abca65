"""`rcsc explain`: every code has a page; every example is reported as its entry shows, and with no other code."""

import pytest
from click.testing import CliRunner

from rcsc.base.diagnostics.codes import FAMILIES, Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.front.commands.group import commands
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.findings.unread import TOLD
from tests.support.programs.stages import reported, unread_in

NOTES = {Code.DEFAULT_COVERS, Code.GIVES_WAY, Code.PROPERTY_ELSEWHERE}
"""Codes whose right form is the wrong one's, or that are said of what is right."""


def told(code: Code, text: str) -> list[Diagnostic]:
    found = [*reported(text, Options()), *(unread_in(text) if code in TOLD else ())]
    return [each for each in found if each.severity is not Severity.NOTE or each.code in NOTES]


@pytest.mark.parametrize("code", [code for code in Code if code.explanation.wrong])
def test_the_wrong_example_is_reported_as_the_entry_shows(code: Code) -> None:
    diagnostics = [
        each for each in told(code, code.explanation.wrong) if each.code is code or each.code not in NOTES
    ]
    assert {diagnostic.code for diagnostic in diagnostics} == {code}
    assert f"{diagnostics[0].severity.value}: {diagnostics[0].message}" == code.explanation.report


@pytest.mark.parametrize("code", [code for code in Code if code.explanation.right])
def test_the_right_example_is_not_reported(code: Code) -> None:
    assert {diagnostic.code for diagnostic in told(code, code.explanation.right)} <= NOTES


def test_every_code_is_explained_and_most_by_example() -> None:
    assert {code.value[3] for code in Code} == set(FAMILIES)
    assert [code.value for code in Code] == sorted({code.value for code in Code})
    for code in Code:
        explanation = code.explanation
        assert not explanation.title[0].isupper() or explanation.title.split()[0].isupper()
        assert not explanation.title.endswith(".")
        assert len(explanation.text) > 30
        assert bool(explanation.wrong) == bool(explanation.report)
    without = {code for code in Code if not code.explanation.wrong}
    runs = {
        code for code in without if code.value[3] in "679"
    }  # no text of a table shows its tests, a recorded run, or a bug in rcsc
    assert len(without - runs) <= 18
    assert {code.value[3] for code in without} >= {"9"}


def test_the_command_prints_a_page_or_the_list() -> None:
    run = CliRunner().invoke
    page = run(commands, ["explain", "rcs402"], standalone_mode=False)
    assert page.return_value == 0
    assert page.output.startswith("RCS402: ")
    assert "This is reported:" in page.output
    listed = run(commands, ["explain"], standalone_mode=False)
    assert all(code.value in listed.output for code in Code)
    assert run(commands, ["explain", "RCS999"]).exit_code == 2
