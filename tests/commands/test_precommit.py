"""The hooks other repositories use: their manifest is valid, and every entry is a command that exists.

`.ci/run` runs them by `pre-commit try-repo` in a scratch repository.
"""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from rcsc.front.commands.group import imported

REPO = Path(__file__).parents[2]


def entries(file: str) -> list[str]:
    text = (REPO / file).read_text(encoding="utf-8")
    return re.findall(r"entry: (rcsc .*)$", text, re.MULTILINE)


@pytest.mark.parametrize(
    ("command", "file"),
    [("validate-manifest", ".pre-commit-hooks.yaml"), ("validate-config", ".pre-commit-config.yaml")],
)
def test_pre_commit_accepts_the_file(command: str, file: str) -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "pre_commit", command, str(REPO / file)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ran.returncode, ran.stdout + ran.stderr) == (0, "")


@pytest.mark.parametrize("entry", entries(".pre-commit-hooks.yaml") + entries(".pre-commit-config.yaml"))
def test_every_entry_is_a_command_with_options_that_it_has(entry: str) -> None:
    _, name, *rest = shlex.split(entry)
    command = imported(name)
    with click.Context(command, info_name=name) as context:
        command.parse_args(context, rest)


def test_the_three_hooks_are_there() -> None:
    manifest = (REPO / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
    assert re.findall(r"^- id: (.*)$", manifest, re.MULTILINE) == ["rcsc-check", "rcsc-fmt", "rcsc-compile"]
