"""Pages that a reader follows from an empty folder: their files, edits, commands with their statuses, and what they show of the output."""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from rcsc.front.commands import run

GUIDE = Path(__file__).parents[2] / "tables" / "guide"
PAGES = ("tutorial", "firmware", "ros2", "safety")
FENCE = re.compile(r"^```(?P<kind>\w+)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced text.

    Attributes:
        file: The file that the sentence before it names.
        line: Where it begins in the page.
    """

    kind: str
    text: str
    file: str
    line: int


def blocks(page: str) -> Iterator[Block]:
    """The fenced texts of the page, in order."""
    begun = 0
    for fence in FENCE.finditer(page):
        files = re.findall(r"(?:Save this as|In) `([\w./-]+)`", page[begun : fence.start()])
        yield Block(
            fence["kind"], fence["text"], files[-1] if files else "", page.count("\n", 0, fence.start()) + 1
        )
        begun = fence.end()


def edited(text: str, diff: str) -> str:
    """The text with the hunks of a diff, which `...` parts, made one after the other; each has one place."""
    for hunk in re.split(r"^\.\.\.\n", diff, flags=re.MULTILINE):
        lines = hunk.splitlines(keepends=True)
        old = "".join(line[1:] or line for line in lines if line[0] in " -")
        new = "".join(line[1:] or line for line in lines if line[0] in " +")
        assert text.count(old) == 1, f"{text.count(old)} places: {old}"
        text = text.replace(old, new)
    return text


def plain(text: str) -> str:
    """The text with blanks as one, so that columns may have any width."""
    return " ".join(text.split())


class Reader:
    """Somebody who follows the page in a folder.

    Attributes:
        said: What the commands since the last text said.
    """

    def __init__(self, capfd: pytest.CaptureFixture[str]) -> None:
        self.capfd, self.said = capfd, ""

    def follow(self, block: Block) -> None:
        if block.kind == "sh":
            self.said = ""
            for line in block.text.splitlines():
                self._command(line)
        elif block.kind == "text":
            self._compare(block)
        elif block.kind == "diff":
            path = Path(block.file)
            path.write_text(edited(path.read_text(encoding="utf-8"), block.text), encoding="utf-8")
        elif block.file:  # else it is only shown
            assert not Path(block.file).exists(), block.file
            Path(block.file).parent.mkdir(parents=True, exist_ok=True)
            Path(block.file).write_text(block.text, encoding="utf-8")

    def _command(self, line: str) -> None:
        command, _, comment = line.partition("#")
        stated = re.search(r"status (\d)", comment)
        words = shlex.split(command)
        words += ["--trace", "4"] if words[:2] == ["rcsc", "prove"] else []  # no run on the page is longer
        self.capfd.readouterr()
        status = run(words[1:]) if words[0] == "rcsc" else subprocess.run(words, check=False).returncode
        out, err = self.capfd.readouterr()
        self.said += out + err
        assert status == (int(stated[1]) if stated else 0), f"{line}\n{self.said}"

    def _compare(self, block: Block) -> None:
        """Every line is said, in this order."""
        rest = plain(self.said)
        for line in filter(None, map(plain, block.text.splitlines())):
            before, found, rest = rest.partition(line)
            assert found, f"line {block.line}: not said: {line}\n{before[-3000:]}"


@pytest.mark.parametrize("page", PAGES)
def test_whoever_follows_a_page_sees_what_it_shows(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    text = (GUIDE / f"{page}.md").read_text(encoding="utf-8")
    [name] = re.findall(r"in an empty\s+folder called `(\w+)`", text)
    folder = tmp_path / name
    folder.mkdir()
    monkeypatch.chdir(folder)
    steps = list(blocks(text))
    assert sum(block.kind == "text" for block in steps) >= 5
    reader = Reader(capfd)
    for block in steps:
        reader.follow(block)
    if page == "tutorial":
        short_and_tested(steps)


def short_and_tested(steps: list[Block]) -> None:
    """The tutorial's C is short, and the robot's own test passes."""
    [program] = [block.text for block in steps if block.kind == "c"]
    assert len(program.splitlines()) <= 20
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_dock.py"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout
