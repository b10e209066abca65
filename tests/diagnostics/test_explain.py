"""`rcsc explain`: every code has a page; every example is reported with its code and no other."""

import pytest
from click.testing import CliRunner

from rcsc.commands.group import commands
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Severity
from rcsc.diagnostics.explanations import explain, explanations
from rcsc.lang.model import Program
from rcsc.lang.resolve import compile_text
from rcsc.solvers.options import Options
from rcsc.table.program import prove_program

NOTES = {Code.DEFAULT_COVERS, Code.PROPERTY_ELSEWHERE}
"""Codes whose right form is the wrong one's, or that are said of what is right."""


def reported(text: str) -> set[Code]:
    program = compile_text(text)
    found = prove_program(program, Options()).findings if isinstance(program, Program) else program
    return {one.code for one in found if one.severity is not Severity.NOTE or one.code in NOTES}


@pytest.mark.parametrize("code", [code for code in Code if explain(code).wrong])
def test_the_wrong_example_is_reported_with_its_code_and_no_other(code: Code) -> None:
    assert reported(explain(code).wrong) == {code}


@pytest.mark.parametrize("code", [code for code in Code if explain(code).right])
def test_the_right_example_is_not_reported(code: Code) -> None:
    assert reported(explain(code).right) - NOTES == set()


def test_every_code_is_explained_and_most_by_example() -> None:
    assert list(explanations()) == list(Code)
    for found in explanations().values():
        assert not found.title[0].isupper() or found.title.split()[0].isupper()
        assert not found.title.endswith(".")
        assert len(found.text) > 30
    without = {code for code, found in explanations().items() if not found.wrong}
    runs = {
        code for code in without if code.value[3] in "79"
    }  # no text of a table shows a recorded run, or a bug in rcsc
    assert len(without - runs) <= 21
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
