"""`rcsc new` in an empty folder: every template is proved, formatted, compiled and tested, runs, and passes its own tests.

`level` is in the guides, whose commands `test_readme.py` runs.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import rcsc
from rcsc.front.commands import run
from rcsc.front.commands.new import NEXT
from rcsc.run.description import description

REPO = Path(__file__).parents[2]
SYSTEMS = ["system", "mujoco"]
pytestmark = pytest.mark.usefixtures("kept_proofs")


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Path:
    """A project made of the template that the test is about, in which the test stands."""
    kind = request.param
    option = "--example" if kind == "nbs" else "--template"
    monkeypatch.chdir(tmp_path)
    assert run(["new", "my-robot", option, kind]) == 0
    monkeypatch.chdir("my-robot")
    return tmp_path / "my-robot"


@pytest.mark.parametrize("project", SYSTEMS, indirect=True)
def test_a_template_is_proved_formatted_compiled_and_tested_and_keeps_its_properties(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for args in (
        ["fmt", "--check"],
        ["compile"],
        ["test", "--examples", "2", "--mutants", "1", "--no-cortex"],
        ["campaign", "--no-compile", "--episodes", "2", "--workers", "1"],
    ):
        assert run(args) == 0, (args, capsys.readouterr().out)
    shown = capsys.readouterr()
    assert "error" not in shown.err
    assert "2 episodes, " in shown.out
    assert (project / "generated" / "c").is_dir()
    assert not (project / "campaign").exists()


@pytest.mark.parametrize("project", SYSTEMS, indirect=True)
def test_a_system_is_wholly_proved_and_passes_its_own_tests(project: Path) -> None:
    proof = rcsc.prove(project / "system.toml", cycles=0)
    assert proof.whole
    assert not proof.unproved
    assert not proof.not_looked_at
    assert len(proof.does_not_apply) == 2, "tables that rest whatever the command"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(REPO), str(REPO / "sim")])}
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        cwd=project, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout
    assert int(ran.stdout.split(" passed")[0].split()[-1]) >= 3


@pytest.mark.parametrize("project", ["level", *SYSTEMS, "nbs"], indirect=True)
def test_names_are_the_project_s_and_hidden_files_are_hidden(project: Path) -> None:
    texts = {path: path.read_text(encoding="utf-8") for path in project.rglob("*") if path.is_file()}
    assert not any("ROBOT_NAME" in text for text in texts.values())
    assert not any(path.name.startswith("dot_") for path in texts)
    assert project / ".gitignore" in texts
    assert 'name = "my_robot"' in texts.get(project / "rcsc.toml", 'name = "my_robot"')
    assert texts[project / "README.md"].startswith("# my_robot\n")


@pytest.mark.parametrize("project", ["nbs"], indirect=True)
def test_the_paper_s_system_is_the_one_here(project: Path) -> None:
    """Every file but the guides and the gallery, byte for byte; it is looked for where the commands look, and checks."""
    here = {
        path.relative_to(REPO).as_posix(): path.read_bytes()
        for path in (REPO / "tables").rglob("*")
        if path.is_file() and not {".rcsc-cache", "gallery"} & {*path.parts} and path.suffix != ".md"
    }
    made = {path: (project / path).read_bytes() for path in here}
    assert made == here
    tables = {path for path in project.rglob("*") if path.is_file() and "tables" in path.parts}
    assert {path.relative_to(project).as_posix() for path in tables} == here.keys()
    assert run(["check", "--quiet", "tables/gripper"]) == 0
    system = description(project / "tables" / "system.toml")
    assert system.generated.resolve() == (project / "generated").resolve()


def test_a_template_and_an_example_do_not_go_together_and_the_next_step_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["new", "a", "--template", "level", "--example", "nbs"]) == 2
    assert run(["new", "a", "--template", "nothing"]) == 2
    assert not (tmp_path / "a").exists()
    for kind, following in NEXT.items():
        option = "--example" if kind == "nbs" else "--template"
        assert run(["new", kind, option, kind]) == 0
        assert capsys.readouterr().out.endswith(f"now: cd {kind} && {following}\n")
        for step in following.split(" && "):
            assert step.split()[1] in {"check", "prove", "run"}
