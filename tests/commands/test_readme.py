"""What the README and the guides show is so: their commands run, their pictures are fresh, their figures are right."""

import importlib
import io
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.front.commands import run
from rcsc.front.commands.group import commands
from tests.picture import CHECK, PICTURE_OF, PICTURES, RUN, masked, printed

REPO = Path(__file__).parents[2]
GUIDES = (
    "README.md", "rcsc/README.md", "tables/README.md", "tables/guide/README.md", "tables/guide/vectors.md",
    "tables/guide/system.md", "tables/guide/studio.md", "sim/README.md",
)  # fmt: skip
GALLERY_PAGES = sorted(path.relative_to(REPO) for path in (REPO / "tables/gallery").rglob("README.md"))
TINY = {
    "rcsc run make_boxt --executor python": "rcsc run --help",
    "rcsc run make_boxt --plant kinematic --log": "rcsc run --no-compile make_boxt --plant kinematic --log",
    "rcsc run make_boxt --plant kinematic": "rcsc run --help",
    "rcsc run make_boxt": "rcsc run --no-compile --plant kinematic make_boxt",
    "rcsc run tests/data/dock --": "rcsc run --no-compile tests/data/dock --",
    "--processes": "--processes --help",
    "--live": "--live --help",
    "rcsc studio": "rcsc studio --help",
    "rcsc campaign --episodes 1000": "rcsc campaign --no-compile --workers 1 --episodes 1",
    "rcsc campaign --plant mujoco --episodes 100": "rcsc campaign --help",
    "rcsc campaign tests/data/dock --episodes 1000": "rcsc campaign tests/data/dock --workers 1 --episodes 1",
    "rcsc test --examples 50": "rcsc test --help",
    "--vectors vectors.c": "--help",
    "rcsc test --examples 5": "rcsc test --examples 1",
    "rcsc evidence": "rcsc evidence --help",
    "--script in --seed 7": "--no-compile --workers 1 --script in --episodes 1",
    "--plant mujoco --episodes 50": "--no-compile --workers 1 --plant mujoco --episodes 1 --seed 2",
    "rcsc campaign --again": "rcsc campaign --help --again",
    "rcsc test my_robot": "rcsc test --examples 2 --mutants 1 --no-cortex my_robot",
    "rcsc prove tables/system.toml": "rcsc prove --level gripper tables/system.toml",
    "published/system.toml": "published/system.toml --trace 0 --steps 1",
    "--level task --without-deferral tables/system.toml": "--without-deferral --trace 0 tests/data/composed/system.toml",
    "python -m tests.slips": "python -m tests.slips --help",
    "tests.differential --count 100000": "tests.differential --count 2",
    "--count 10000": "--count 1",
    "tests.claims --count 1000": "tests.claims --count 1",
    "tests.applied --count 1000": "tests.applied --count 2",
    "--runs 10000": "--runs 3",
    "tests.editor.random_edits --count 1000": "tests.editor.random_edits --count 3",
    "tests.prover_mutants --count 1000": "tests.prover_mutants --help",
    "tests.faults --each 50": "tests.faults --help",
}
"""The same commands with less to do; .ci/run and other tests run what only shows its help here."""


def text_of(guide: str) -> str:
    return (REPO / guide).read_text(encoding="utf-8")


def blocks(guide: str, language: str) -> list[str]:
    """A guide's fenced texts of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text_of(guide), re.DOTALL | re.MULTILINE)


def command_lines(guide: str) -> Iterator[tuple[str, int]]:
    """The commands of a guide, and the status each says that it ends with.

    Not the two that set up, nor what a later guide, or a page of the gallery, has of shipped files: it is run there.
    """
    pages = (*GUIDES[GUIDES.index(guide) + 1 :], *(str(page) for page in GALLERY_PAGES))
    later = {line.partition("#")[0].strip() for page in pages for line in text_of(page).splitlines()}
    text = re.sub(r"<!-- (first|main|test)-command -->\n```sh\n.*?```", "", text_of(guide), flags=re.DOTALL)
    for before, block in re.findall(
        r"([^\n]*\n(?:[^\n]*\n){0,3}?)```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE
    ):
        of_block = 1 if re.search(r"(?:these|them) ends? with status 1", before) else 0
        for line in block.splitlines():
            command, _, comment = line.partition("#")
            command = command.strip()
            if command not in later or "compile" in command or "my_robot" in command:
                stated = re.search(r"status (\d)", comment)
                yield command, int(stated[1]) if stated else of_block


@pytest.fixture
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which the guides' commands find what they name."""
    for name in ("tables", "tests/data", "tests/regress", "generated"):
        shutil.copytree(REPO / name, tmp_path / name, ignore=shutil.ignore_patterns(".rcsc-cache"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ends_with(command: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """The status of a command of a guide, made small."""
    for written, tiny in TINY.items():
        command = command.replace(written, tiny)
    fed, _, piped = command.rpartition(" | ")
    words = shlex.split(piped)
    if words[0] == "rcsc":
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stdin", io.StringIO("\n".join(shlex.split(fed)[1:])))
            return run(words[1:])
    assert words[:2] == ["python", "-m"], command
    with monkeypatch.context() as patch:
        patch.setattr(sys, "argv", words[2:])
        for name in (words[2], f"{words[2]}.__main__"):  # another test may have imported it
            patch.delitem(sys.modules, name, raising=False)
        try:
            runpy.run_module(words[2], run_name="__main__", alter_sys=True)
        except SystemExit as ended:
            return int(ended.code or 0)
    return 0


@pytest.mark.usefixtures("kept_proofs")
@pytest.mark.parametrize("guide", GUIDES)
def test_the_commands_of_a_guide_end_as_it_says(
    guide: str, scratch: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    wanted = dict(command_lines(guide))
    assert len(wanted) >= 2
    found = {}
    for line, status in wanted.items():
        for command in line.split(" && "):
            if "system.toml" in command and "my_robot" in command:
                (scratch / "my_robot/system.toml").write_text(blocks(guide, "toml")[0], encoding="utf-8")
                (scratch / "steps.txt").write_text(blocks(guide, "text")[0], encoding="utf-8")
            found[line] = ends_with(command, monkeypatch)
            assert found[line] == status, f"{command}\n{''.join(capfd.readouterr())[-2000:]}"
    assert found == wanted


def test_the_programs_of_the_guide_print_what_it_says(
    scratch: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    said = re.search(r"Both print `(.*?)`", text_of("tables/guide/README.md"))
    assert said is not None
    assert run(["new", "my_robot"]) == 0
    assert run(["compile", "--quiet", "my_robot", "--out", "generated"]) == 0
    capfd.readouterr()
    source = blocks("tables/guide/README.md", "c")[0]
    (scratch / "main.c").write_text(source, encoding="utf-8")
    build = "cc -std=c99 -Wall -Wextra -Werror -Igenerated/c main.c generated/c/gripper.c -o robot"
    subprocess.run(build.split(), check=True)
    [program] = blocks("tables/guide/README.md", "python")
    for command in (["./robot"], [sys.executable, "-c", program]):
        env = os.environ | {"PYTHONPATH": "generated/python"}
        ran = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
        assert ran.stdout == f"{said[1]}\n"


def test_the_guides_name_every_command_and_benchmark() -> None:
    named = set(
        re.findall(
            r"`rcsc (\w+)", "".join(re.findall(r"^\| .*? \|", text_of("rcsc/README.md"), re.MULTILINE))
        )
    )
    assert named == set(commands.commands) - {"completion"}
    for name in re.findall(r"tests\.bench\.\w+", text_of("rcsc/README.md")):
        assert callable(importlib.import_module(name).main)
    for guide in GUIDES:
        for path in re.findall(r"\]\(([^)#]+)\)", text_of(guide)):
            assert ((REPO / guide).parent / path).exists(), f"{guide}: {path}"
    assert len(text_of("README.md").splitlines()) <= 200


def words(text: str) -> str:
    """The text with spaces as one."""
    return " ".join(text.split())


def test_the_picture_of_a_finding_is_fresh() -> None:
    drawn = (PICTURES / "first_minute.svg").read_text(encoding="utf-8")
    assert masked(drawn) == masked(PICTURE_OF["first_minute.svg"]()), "run `python -m tests.picture`"


@pytest.mark.usefixtures("kept_proofs")
def test_the_picture_of_the_robot_is_fresh_but_for_what_hangs_on_the_machine() -> None:
    """The same things in the same colours, nowhere more than a hundredth of a picture away."""
    kept, drawn = (PICTURES / "make_boxt.svg").read_text(encoding="utf-8"), PICTURE_OF["make_boxt.svg"]()
    captions = re.findall(r"<text[^>]*>\d.*?</text>", kept)
    assert len(captions) == 3
    assert captions == re.findall(r"<text[^>]*>\d.*?</text>", drawn), "run `python -m tests.picture`"
    for colour in sorted(set(re.findall(r'fill="(#\w+)"', kept + drawn))):
        at = [
            sorted(
                tuple(float(word) for word in points.replace(",", " ").split())
                for points in re.findall(rf'<polygon[^>]*points="([^"]*)"[^>]*fill="{colour}"', svg)
            )
            for svg in (kept, drawn)
        ]
        assert [len(one) for one in at[0]] == [len(one) for one in at[1]], colour
        for left, right in zip(*at, strict=True):
            assert max(abs(a - b) for a, b in zip(left, right, strict=True)) < 7


def test_the_first_command_sets_up_the_core_and_finds_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    [command] = re.findall(r"^<!-- first-command -->\n```sh\n(.*?)#", text_of("README.md"), re.MULTILINE)
    venv, install, check = command.split(" && ")
    assert (venv, install) == ("python3 -m venv .venv", ".venv/bin/pip install -q -e .")
    monkeypatch.chdir(REPO)
    assert run(shlex.split(check)[1:]) == 1


def test_the_first_table_is_the_example() -> None:
    [shown, *_] = blocks("README.md", "rcs")
    example = (REPO / "tables/examples/grip.rcs").read_text(encoding="utf-8")
    for line in shown.strip().splitlines():
        assert words(line) in words(example), line


@pytest.mark.usefixtures("kept_proofs")
def test_what_the_commands_print_is_shown_as_it_is() -> None:
    shown = blocks("README.md", "text")
    commands_ = ((*CHECK[:-1], "tables/examples/acquire_published.rcs"), RUN)
    for block, command in zip(shown, commands_, strict=True):
        plain = masked(words(re.sub(r"\x1b\[[0-9;]*m", "", printed(command)[0])))
        for line in filter(None, block.splitlines()):
            assert line == "..." or masked(words(line)) in plain, line


def lines_of(path: Path) -> int:
    """Lines of a file, or of all files in a folder but compiled ones and guides."""
    files = [path] if path.is_file() else [one for one in path.rglob("*") if one.is_file()]
    return sum(len(file.read_bytes().splitlines()) for file in files if file.suffix not in {".pyc", ".md"})


def test_what_is_trusted_is_about_as_long_as_it_says() -> None:
    rows = re.findall(r"^\| (`.*?) \| ([\d,]+) \|", text_of("README.md").split("## Trust")[1], re.MULTILINE)
    assert len(rows) == 4
    assert any("rcsc/proof/certify" in paths for paths, _ in rows)
    for paths, written in rows:
        count = sum(lines_of(REPO / path) for path in re.findall(r"`([^`]+)`", paths))
        assert abs(int(written.replace(",", "")) - count) <= count * 0.15, f"{paths}: {count:,} lines"
