"""The package: the wheel is whole, and the core is enough for what it is said to be; README and CI say the same.

That the wheel works where no checkout is, `.ci/run` shows in an environment of its own.
"""

import json
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from itertools import chain
from pathlib import Path

import pytest
from click.testing import CliRunner

from rcsc.front.commands import run
from rcsc.front.commands.group import commands
from rcsc.front.commands.shared.extras import EXTRAS

REPO = Path(__file__).parents[2]
TEMPLATES = REPO / "rcsc" / "front" / "commands" / "templates"
README = (REPO / "README.md").read_text(encoding="utf-8")


def test_the_wheel_has_the_grammar_the_types_and_all_data(tmp_path: Path) -> None:
    made = subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(REPO)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stdout + made.stderr
    [wheel] = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        metadata = archive.read(next(name for name in names if name.endswith("METADATA"))).decode()
    assert {"rcsc/_data/grammar/rcs.lark", "rcsc/_data/grammar/rcs.parser.json"} <= set(names)
    assert {"rcsc/py.typed", "rcsc/base/diagnostics/schema/report.schema.json"} <= names
    templates = {path.name for path in (REPO / "rcsc" / "code" / "emit" / "templates").iterdir()}
    assert {
        name.rsplit("/", 1)[1] for name in names if name.startswith("rcsc/code/emit/templates/")
    } == templates
    templates_ = {
        path.relative_to(REPO).as_posix()
        for path in TEMPLATES.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert len(templates_) > 25
    assert templates_ <= names
    assert "rcsc/_data/tables/task/acquire.rcs" in names
    assert not [name for name in names if ".rcsc-cache" in name]
    tops = {name.partition("/")[0] for name in names if ".dist-info/" not in name}
    assert tops == {"rcsc", "rcsc_cell"}, "nothing called `sim`, and no tests or tables"
    assert "License-Expression: MIT" in metadata
    assert "Requires-Python: >=3.11" in metadata


def command(marker: str) -> str:
    found = re.search(rf"^<!-- {marker} -->\n```sh\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def test_ci_takes_the_test_command_from_the_readme() -> None:
    assert "pytest" in command("test-command")
    assert "rcsc run" in command("main-command")
    script = (REPO / ".ci" / "run").read_text(encoding="utf-8")
    assert "readme_command test-command" in script
    assert "pytest" not in script
    body = re.search(r"^readme_command\(\).*?\n(.*?)^}", script, re.MULTILINE | re.DOTALL)
    assert body is not None
    program = f"readme_command() {{\n{body[1]}}}\nreadme_command test-command"
    shown = subprocess.run(["bash", "-c", program], cwd=REPO, capture_output=True, text=True, check=True)
    assert shown.stdout == command("test-command")


PROJECT = tomllib.loads((REPO / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FIXED = {"z3-solver", "lark", "mujoco", "numpy", "hypothesis", "jinja2"}


def test_every_dependency_has_a_tested_range() -> None:
    extras = PROJECT["optional-dependencies"]
    for requirement in (*PROJECT["dependencies"], *chain(*extras.values())):
        if requirement.startswith("rcsc["):
            continue
        # python-sat has never had but releases named so
        assert re.fullmatch(r"[\w-]+(>=[\d.]+(dev\d+)?(,<[\d.]+)?|==[\d.]+)", requirement), requirement
    core = {re.split("[>=<]", requirement)[0] for requirement in PROJECT["dependencies"]}
    assert core == {"click", "jinja2", "lark", "numpy", "python-sat", "rich", "z3-solver"}
    named = core | {re.split("[>=<]", one)[0] for one in chain(*extras.values())}
    assert named >= FIXED
    assert PROJECT["requires-python"] == ">=3.11"


def test_the_table_of_extras_is_that_of_the_project() -> None:
    extras = PROJECT["optional-dependencies"]
    imported = {name: wheels for name, wheels in packages_distributions().items() if not name.startswith("_")}

    def brought(extra: str) -> set[str]:
        found = set()
        for requirement in extras[extra]:
            name = re.split("[>=<]", requirement)[0]
            more = re.fullmatch(r"rcsc\[(\w+)\]", name)
            found |= brought(more[1]) if more else {one for one, wheels in imported.items() if name in wheels}
        return found

    for extra, packages in EXTRAS.items():
        assert set(packages) <= brought(extra), extra
        nested = any(requirement.startswith("rcsc[") for requirement in extras[extra])
        assert len(packages) == len(extras[extra]) or nested, extra
    assert set(extras) - set(EXTRAS) == {"graph", "shell", "test"}


WITHOUT = """
import json, sys
for package in {missing!r}:
    sys.modules[package] = None
import rcsc.front.commands
statuses = [rcsc.front.commands.run(args) for args in {commands!r}]
print(json.dumps([statuses, sorted(name for name in sys.modules if sys.modules[name])]))
"""


def without_extras(*commands: list[str], folder: Path) -> tuple[list[int], set[str], str]:
    """Statuses of commands where only the core is installed, what they imported, and what they said of errors."""
    missing = sorted({"hypothesis", "prompt_toolkit", *chain(*EXTRAS.values())})
    script = WITHOUT.format(missing=missing, commands=commands)
    ran = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    statuses, names = json.loads(ran.stdout.splitlines()[-1])
    return statuses, set(names), ran.stderr


def test_checking_compiling_and_the_hooks_import_the_core_alone_and_no_numpy(tmp_path: Path) -> None:
    table = str(REPO / "tables" / "examples" / "approach.rcs")
    statuses, imported, said = without_extras(
        ["check", "--quiet", "--no-cache", table],
        ["fmt", "--quiet", "--check", table],
        ["compile", "--quiet", "--no-cache", table],
        ["compile", "--quiet", "--check", table],
        ["explain", "RCS705"],
        folder=tmp_path,
    )
    assert (statuses, said) == ([0] * 5, "")
    assert imported & {"z3", "lark", "jinja2"} == {"z3", "lark", "jinja2"}
    assert not imported & {"numpy", "mujoco", "hypothesis", "mcap", "rcsc_cell"}


def test_the_core_proves_levels_certifies_and_says_what_the_rest_needs(tmp_path: Path) -> None:
    system = str(REPO / "tests" / "data" / "composed" / "system.toml")
    later = str(REPO / "tables" / "examples" / "later" / "last_echo.toml")
    table = str(REPO / "tables" / "examples" / "approach.rcs")
    cell = ["--system", str(REPO / "tables" / "system.toml"), "--no-compile"]
    (tmp_path / "any.mcap").touch()
    statuses, imported, said = without_extras(
        ["prove", "--no-cache", system],
        ["prove", "--no-cache", later],  # with a finding, which executors of both kinds have to show
        ["certify", "--no-cache", table],
        ["prove", "--log", "found", system],
        ["prove", "--certify", system],
        ["certify", "--certify", table],
        ["run", "make_boxt", *cell],
        ["campaign", "--episodes", "1", *cell],
        ["campaign", "--episodes", "1", "--no-compile", str(REPO / "tests" / "data" / "dock")],
        ["log", "any.mcap"],
        ["replay", "any.mcap"],
        folder=tmp_path,
    )
    assert statuses == [0, 1, 0, *[1] * 8]
    errors = re.findall(
        r"^error\[RCS705\]: `\w+` is not installed\n  = help: pip install 'rcsc\[(\w+)\]'$",
        said,
        re.MULTILINE,
    )
    assert errors == ["log", "certify", "certify", "cell", "cell", "log", "log", "log"]
    assert said.count("error[RCS705]") == len(errors)
    assert not imported & {"mujoco", "hypothesis", "mcap"}


def test_live_is_refused_before_anything_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    monkeypatch.setattr("rcsc.front.commands.systems.run.made", lambda *_, **__: pytest.fail("it compiled"))
    ran = CliRunner().invoke(
        commands, ["run", "make_boxt", "--live", "--system", str(REPO / "tables/system.toml")]
    )
    assert (ran.exit_code, "pip install 'rcsc[studio]'" in ran.output) == (1, True)


def test_a_package_that_no_extra_brings_is_a_bug(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> None:
        raise ModuleNotFoundError("No module named 'elsewhere'", name="elsewhere")

    monkeypatch.setattr("rcsc.front.commands.tables.check.check", broken)
    assert run(["check", str(REPO / "tables" / "examples" / "approach.rcs")]) == 3
    assert "error[RCS902]" in capsys.readouterr().err
