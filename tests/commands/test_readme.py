"""What the README shows is what its commands print."""

import contextlib
import re
from pathlib import Path

from tests.picture import PICTURE, drawn, masked, said


def blocks(repo: Path, language: str) -> list[str]:
    """The README's fenced texts of a language."""
    return re.findall(
        rf"```{language}\n(.*?)```", (repo / "README.md").read_text(encoding="utf-8"), re.DOTALL
    )


def words(text: str) -> str:
    """The text with spaces as one."""
    return " ".join(text.split())


def test_the_picture_is_fresh(repo: Path) -> None:
    with contextlib.chdir(repo):
        assert masked(PICTURE.read_text(encoding="utf-8")) == masked(drawn()), "run `python -m tests.picture`"


def test_the_first_table_is_the_example(repo: Path) -> None:
    [shown, *_] = blocks(repo, "rcs")
    example = (repo / "tables/examples/grip.rcs").read_text(encoding="utf-8")
    for line in shown.strip().splitlines():
        assert words(line) in words(example), line


def test_what_the_first_command_prints_is_shown_as_it_is(repo: Path) -> None:
    [shown, *_] = blocks(repo, "text")
    with contextlib.chdir(repo):
        printed = said(("run", "make_boxt"))
        printed += said(("check", "tables/examples/acquire_published.rcs"))
    plain = masked(words(re.sub(r"\x1b\[[0-9;]*m", "", printed)))
    for line in filter(None, shown.splitlines()):
        assert line == "..." or masked(words(line)) in plain, line


def lines_of(path: Path) -> int:
    """Lines of a file, or of all files in a folder but compiled ones."""
    files = [path] if path.is_file() else [one for one in path.rglob("*") if one.is_file()]
    return sum(len(one.read_bytes().splitlines()) for one in files if one.suffix != ".pyc")


def test_what_is_trusted_is_about_as_long_as_it_says(repo: Path) -> None:
    section = (
        (repo / "README.md").read_text(encoding="utf-8").split("## What is trusted")[1].split("\n## ")[0]
    )
    rows = re.findall(r"^\| (`.*?) \| ([\d,]+) \|", section, re.MULTILINE)
    assert len(rows) == 4
    assert any("rcsc/certify" in paths for paths, _ in rows)
    for paths, written in rows:
        count = sum(lines_of(repo / path) for path in re.findall(r"`([^`]+)`", paths))
        assert abs(int(written.replace(",", "")) - count) <= count * 0.15, f"{paths}: {count:,} lines"
