"""The package: the wheel is whole and works where no checkout is; README and CI say the same."""

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

REPO = Path(__file__).parents[2]
README = (REPO / "README.md").read_text(encoding="utf-8")

HIDDEN = """
import os, sys
def refuse(event, args):
    if event == "open" and isinstance(args[0], str) and os.path.realpath(args[0]).startswith({hidden!r}):
        raise PermissionError(f"the checkout is hidden: {{args[0]}}")
sys.addaudithook(refuse)
sys.path[:] = [entry for entry in sys.path if os.path.realpath(entry or ".") != {repo!r}]
sys.path.insert(0, {site!r})
import rcsc, rcsc.commands
assert rcsc.__file__.startswith({site!r}), rcsc.__file__
sys.exit(rcsc.commands.run(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    made = subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(REPO)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stdout + made.stderr
    [path] = folder.glob("*.whl")
    return path


def test_the_wheel_has_the_grammar_the_types_and_all_data(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        metadata = archive.read(next(name for name in names if name.endswith("METADATA"))).decode()
    assert "rcsc/_data/grammar/rcs.lark" in names
    assert {"rcsc/py.typed", "rcsc/diagnostics/explanations.md"} <= names
    assert "rcsc/diagnostics/schema/report.schema.json" in names
    templates = {path.name for path in (REPO / "rcsc" / "emit" / "templates").iterdir()}
    assert {name.rsplit("/", 1)[1] for name in names if name.startswith("rcsc/emit/templates/")} == templates
    tops = {name.partition("/")[0] for name in names if ".dist-info/" not in name}
    assert tops == {"rcsc", "rcsc_cell"}, "nothing called `sim`, and no tests or tables"
    assert "License-Expression: MIT" in metadata
    assert "Requires-Python: >=3.11" in metadata


def test_the_wheel_works_with_the_checkout_hidden(wheel: Path, tmp_path: Path) -> None:
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    hidden = tuple(str(REPO / name) + os.sep for name in ("rcsc", "sim", "grammar", "tables"))
    script = HIDDEN.format(hidden=hidden, repo=str(REPO), site=str(site))
    environment = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}

    def rcsc(*args: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", script, *args],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip

    for args in (["new", "robot"], ["check", "robot"], ["compile", "robot"], ["fmt", "--check", "robot"]):
        ran = rcsc(*args)
        assert ran.returncode == 0, ran.stdout + ran.stderr
    assert (tmp_path / "generated" / "c" / "gripper.c").is_file()
    assert rcsc("explain", "RCS402").stdout.startswith("RCS402: ")


def command(marker: str) -> str:
    found = re.search(rf"^<!-- {marker} -->\n```sh\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def test_ci_takes_the_test_command_from_the_readme() -> None:
    assert "pytest" in command("test-command")
    assert "rcsc check" in command("main-command")
    script = (REPO / ".ci" / "run").read_text(encoding="utf-8")
    assert "readme_command test-command" in script
    assert "pytest" not in script
    body = re.search(r"^readme_command\(\).*?\n(.*?)^}", script, re.MULTILINE | re.DOTALL)
    assert body is not None
    program = f"readme_command() {{\n{body[1]}}}\nreadme_command test-command"
    shown = subprocess.run(["bash", "-c", program], cwd=REPO, capture_output=True, text=True, check=True)
    assert shown.stdout == command("test-command")


def test_every_dependency_has_a_tested_range() -> None:
    project = tomllib.loads((REPO / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for requirement in project["dependencies"]:
        # python-sat has never had but releases named so
        assert re.fullmatch(r"[a-z0-9-]+>=[\d.]+(dev\d+)?,<\d+", requirement), requirement
    assert project["requires-python"] == ">=3.11"
    named = {re.split("[>=<]", requirement)[0] for requirement in project["dependencies"]}
    assert {"z3-solver", "lark", "mujoco-core", "numpy", "hypothesis", "jinja2"} <= named
