"""Folders to try commands on, and the commands of each."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree, ignore_patterns

from rcsc.front.commands import group

ROOT = Path(__file__).parents[2]
_LEFT_OUT = ignore_patterns(".rcsc-cache", "__pycache__", "generated", "kept")
COMMANDS = tuple(name.rpartition(".")[2] for name in group.COMMANDS)
"""Every command."""
FORMATS = ("line", "json", "sarif", "github")
LEVELS = ("task", "emove", "primitive", "vision", "gripper")


@dataclass(frozen=True, slots=True)
class Step:
    """A command.

    Attributes:
        name: What it is called among those of its subject.
        args: Of `rcsc`.
        files: Patterns of files that it writes, from the subject's folder, which are compared.
    """

    name: str
    args: tuple[str, ...]
    files: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Subject:
    """A folder, and the commands that run in it, one after the other.

    Attributes:
        make: Makes the folder, which is not there.
        at: Where in it they run.
    """

    name: str
    make: Callable[[Path], None]
    steps: tuple[Step, ...]
    at: str = ""


def subjects() -> Iterator[Subject]:
    """Yield every subject, the longest first."""
    yield Subject("tables", _copied("tables", "tables"), tuple(_of_tables()), "tables")
    yield Subject("dock", _dock, tuple(_of_dock()))
    for folder in sorted(each for each in (ROOT / "tables/gallery").iterdir() if each.is_dir()):
        at = f"tables/gallery/{folder.name}"
        yield Subject(f"gallery-{folder.name}", _copied("tables", "tables"), tuple(_of_entry(folder, at)), at)
    for template in ("level", "system", "mujoco"):
        yield Subject(f"new-{template}", Path.mkdir, tuple(_of_template(template)))
    yield Subject("words", Path.mkdir, tuple(_of_words()))


def _copied(folder: str, into: str = "") -> Callable[[Path], None]:
    def make(place: Path) -> None:
        copytree(ROOT / folder, place / into, ignore=_LEFT_OUT)

    return make


def _dock(place: Path) -> None:
    _copied("tests/data/dock")(place)
    (place / "by_hand.txt").write_text("help\nstep 3\nundo\nshow\n", encoding="utf-8")


def _of_tables() -> Iterator[Step]:
    yield Step("check", ("check", "."))
    yield from (Step(f"check-{form}", ("check", ".", "--format", form)) for form in FORMATS)
    yield Step("fmt-check", ("fmt", "--check", "."))
    yield from (Step(f"fmt-{level}", ("fmt", "--expanded", level)) for level in LEVELS)
    yield Step("compile", ("compile", "system.toml", "examples/approach.rcs"), ("generated/**/*",))
    yield Step("prove", ("prove",))
    yield Step("prove-json", ("prove", "--json"))
    for level in LEVELS:
        yield Step(f"certify-{level}", ("certify", f"{level}/{level}.rcs", "--write", f"{level}.json"))
        yield Step(
            f"graph-{level}",
            ("graph", f"{level}/{level}.rcs", "--form", "dot", "-o", level),
            (f"tables/{level}/*.dot", f"tables/{level}"),
        )
    for form in ("svg", "mermaid", "scxml"):
        yield Step(f"graph-{form}", ("graph", "task/acquire.rcs", "--form", form))
    yield Step(
        "graph-dot",
        ("graph", "task/acquire.rcs", "--form", "dot", "-o", "acquire.dot"),
        ("tables/acquire.dot",),
    )
    yield Step("graph-lines", ("graph", "--lines", "task/acquire.rcs"))
    yield Step("table", ("table", "acquire.dot", "--against", "task/acquire.rcs"))
    for form in ("text", "json", "markdown"):
        versions = ("examples/acquire_published.rcs", "task/acquire.rcs")
        yield Step(f"diff-{form}", ("diff", *versions, "--format", form))
    yield Step("trace", ("trace", "task/acquire.rcs", "--out", "trace", "--no-vectors"), ("tables/trace/*",))
    yield Step("trace-find", ("trace", "task/acquire.rcs", "--find", "acquire 1"))
    yield Step("names", ("names",))
    yield Step("names-files", ("names", "-o", "names.html"), ("tables/names.html",))
    yield Step("db-check", ("db", "check"))
    yield Step("db-build", ("db", "build", "-o", "cell.db"))
    yield Step("db-show", ("db", "show", "--database", "cell.db"))
    yield Step("run", ("run", "scripts/make_boxt.csv", "--log", "run.mcap"), ("tables/run.mcap",))
    yield Step("log", ("log", "run.mcap"))
    yield Step("log-csv", ("log", "run.mcap", "--csv", "run.csv"), ("tables/run.csv",))
    yield Step("log-json", ("log", "run.mcap", "--json", "run.json"), ("tables/run.json",))
    yield Step("replay", ("replay", "run.mcap"))
    yield Step("replay-at", ("replay", "run.mcap", "--at", "100", "--show", "task"))


def _of_dock() -> Iterator[Step]:
    yield Step("check", ("check", "."))
    yield Step("prove", ("prove",))
    yield Step("prove-strict", ("prove", "--strict", "--invariants"))
    yield Step("compile", ("compile", "."), ("generated/**/*",))
    yield Step("compile-check", ("compile", ".", "--check"))
    yield from (Step(f"run-{one}", ("run", "dock.csv", "--executor", one)) for one in ("c", "python"))
    yield Step("run-log", ("run", "dock.csv", "--log", "dock.mcap"))
    yield Step("log", ("log", "dock.mcap"))
    yield Step("replay", ("replay", "dock.mcap"))
    yield Step("campaign", ("campaign", ".", "--episodes", "6", "--workers", "1"))
    yield Step("test", ("test", "drive.rcs", "--no-cortex", "--mutants", "4"))
    yield Step("shell", ("shell", ".", "--script", "by_hand.txt"))
    yield Step("diff", ("diff", "drive.rcs", "drive.rcs"))


def _of_entry(folder: Path, at: str) -> Iterator[Step]:
    yield Step("check", ("check", "."))
    yield Step("check-line", ("check", ".", "--format", "line"))
    yield Step("fmt", ("fmt", "--check", "."))
    if (folder / "system.toml").exists():
        yield Step("prove", ("prove",))
    for table in sorted(folder.glob("*.rcs")):
        drawn = f"drawn-{table.stem}"
        yield Step(
            f"graph-{table.stem}",
            ("graph", table.name, "--form", "dot", "-o", drawn),
            (f"{at}/{drawn}/**/*", f"{at}/{drawn}"),
        )


def _of_template(template: str) -> Iterator[Step]:
    yield Step("new", ("new", "robot", "--template", template), ("robot/**/*",))
    yield Step("check", ("check", "robot"))
    yield Step("compile", ("compile", "robot"), ("generated/**/*", "robot/generated/**/*"))
    if template != "level":
        yield Step("prove", ("prove", "robot"))
        yield Step("run", ("run", "robot"))


def _of_words() -> Iterator[Step]:
    yield Step("help", ("--help",))
    for command in COMMANDS:
        yield Step(f"help-{command}", (command, "--help"))
    yield Step("explain", ("explain",))
    yield from (Step(f"completion-{one}", ("completion", one)) for one in ("bash", "zsh", "fish"))
