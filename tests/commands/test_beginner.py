"""What a beginner's mistakes are told: in the projects that `rcsc new` makes, changed by a word."""

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import click
import pytest

from tests.commands.test_cli import Rcsc, folder, rcsc

__all__ = ["folder", "rcsc"]  # fixtures

REPO = Path(__file__).parents[2]


@pytest.fixture
def level(rcsc: Rcsc) -> Rcsc:
    assert rcsc("new", "one").status == 0
    os.chdir("one")
    return rcsc


@pytest.fixture
def system(rcsc: Rcsc) -> Rcsc:
    assert rcsc("new", "two", "--template", "system").status == 0
    os.chdir("two")
    return rcsc


def change(name: str, old: str, new: str) -> None:
    path = Path(name)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def errors(told: Rcsc, *args: str) -> list[dict[str, object]]:
    """The errors of a check: message, notes and help."""
    form = json.loads(told("check", "--json", *args).out)
    return [
        {name: one[name] for name in ("message", "notes", "help")}
        for one in form["diagnostics"]
        if one["severity"] == "error"
    ]


# --- a missing `use` ---


def test_a_missing_use_is_one_error_with_the_line_to_write(level: Rcsc) -> None:
    change("gripper.rcs", "use vocabulary\n", "")
    assert errors(level) == [
        {
            "message": "`command` is declared in `vocabulary.rcs`, which this file does not use",
            "notes": [
                "so it is with `status`, `hold`, `done`, `open`, `close`, `executing` and `failed`, in 24 places together"
            ],
            "help": ["add `use vocabulary`: write that line above the first declaration"],
        }
    ]
    text = Path("gripper.rcs").read_text(encoding="utf-8")
    Path("gripper.rcs").write_text(f"use vocabulary\n{text}", encoding="utf-8")
    assert level("check").status == 0


@pytest.mark.parametrize("file", ["supervisor.rcs", "axis.rcs"])
def test_links_of_another_file_are_offered_with_it(system: Rcsc, file: str) -> None:
    change(file, "use words\n", "")
    [error] = errors(system)
    assert error["help"] == ["add `use words`: write that line above the first declaration"]


def test_a_file_below_the_root_is_offered_as_use_finds_it(level: Rcsc) -> None:
    Path("shared").mkdir()
    Path("vocabulary.rcs").rename("shared/vocabulary.rcs")
    change("gripper.rcs", "use vocabulary\n", "")
    [error] = errors(level)
    assert str(error["help"]).startswith("['add `use shared/vocabulary`:")


def test_what_is_wrong_besides_is_told_too(level: Rcsc) -> None:
    change("gripper.rcs", "use vocabulary\n", "")
    change("gripper.rcs", "| > 40     |", "| > fourty |")
    assert [error["message"] for error in errors(level)] == [
        "`command` is declared in `vocabulary.rcs`, which this file does not use",
        "no variable, constant or member is called `fourty`",
    ]


@pytest.mark.parametrize(
    "other",
    [
        "enum other { hold }\n",  # nothing of what is asked for first
        "enum command { hold, open, close }\nenum status { executing, done, failed }\ninput order : bool\n",  # clashes
        "enum command { hold, open, close }\nuse gripper\n",  # a circle
        "enum command { hold\n",  # not in order
        "enum command { hold, open, close }\nlevel hand { period 40 [ms] }\n",  # a level of its own
        "# command and status\n",  # speaks of them only
    ],
)
def test_no_use_is_offered_that_would_not_help(level: Rcsc, other: str) -> None:
    change("gripper.rcs", "use vocabulary\n", "")
    Path("vocabulary.rcs").write_text(other, encoding="utf-8")
    told = errors(level, "gripper.rcs")
    assert not any(
        "use vocabulary" in str(error["help"]) for error in told if "command" in str(error["message"])
    )


def test_a_name_that_nothing_declares_is_told_once_with_its_lines(level: Rcsc) -> None:
    change("vocabulary.rcs", ", failed", "")
    [error] = errors(level)
    assert error["message"] == "no variable, constant or member is called `failed`"
    assert error["notes"] == ["missed in lines 27, 29, 30, 30 and 30, too"] or "missed in line" in str(
        error["notes"]
    )


def test_what_is_declared_later_is_noticed(level: Rcsc) -> None:
    change("gripper.rcs", "use vocabulary\n", "")
    Path("vocabulary.rcs").rename("vocabulary.txt")
    assert len(errors(level)) == 8
    Path("vocabulary.txt").rename("vocabulary.rcs")
    assert len(errors(level)) == 1


# --- another level's variable ---


@pytest.mark.parametrize(
    ("file", "claim", "level_", "name"),
    [
        (
            "supervisor.rcs",
            "property p : to_person.status_report = done implies speed_mm_s = 0 [mm/s]",
            "axis",
            "speed_mm_s",
        ),
        (
            "supervisor.rcs",
            "property p : to_person.status_report = done implies axis.speed_mm_s = 0 [mm/s]",
            "axis",
            "speed_mm_s",
        ),
        (
            "axis.rcs",
            "requirement r : always supervisor.now = home implies speed_mm_s = 0 [mm/s]",
            "supervisor",
            "now",
        ),
    ],
)
def test_a_claim_about_two_levels_is_told_where_it_belongs(
    system: Rcsc, file: str, claim: str, level_: str, name: str
) -> None:
    Path(file).write_text(f"{Path(file).read_text(encoding='utf-8')}\n{claim}\n", encoding="utf-8")
    belongs = (
        f"`{name}` is a variable of level `{level_}`, and what a level's file claims is of that level alone"
    )
    there = f"there write `{level_}.{name}`, and each variable with its level"
    for names, where in (
        ("", "stands in `requirements.rcs`, which `system.toml` names"),
        (
            'requirements = "requirements.rcs"\n',
            'stands in a file that `system.toml` names: `requirements = "requirements.rcs"`',
        ),
    ):
        change("system.toml", names, "")
        told = [error for error in errors(system, file) if "level" in str(error["message"])]
        assert [(error["message"], error["help"]) for error in told] == [
            (belongs, [f"what levels do together {where}; {there}"])
        ]


def test_a_name_of_no_level_is_no_claim_about_two(system: Rcsc) -> None:
    change(
        "supervisor.rcs", "property done_at_rest :", "property nowhere : far_off = 3\nproperty done_at_rest :"
    )
    assert [error["message"] for error in errors(system)] == [
        "no variable, constant or member is called `far_off`"
    ]


# --- paths and TOML ---


@pytest.mark.parametrize(
    ("args", "meant"),
    [
        (["check", "supervisr.rcs"], "supervisor.rcs"),
        (["compile", "../tow"], "../two"),
        (["graph", "axes.rcs"], "axis.rcs"),
        (["diff", "axis.rcs", "axes.rcs"], "axis.rcs"),
        (["prove", "sytem.toml"], "system.toml"),
        (["run", "sytem.toml"], "system.toml"),
        (["run", "dey.csv"], "day"),
    ],
)
def test_a_path_that_is_nearly_there_is_named(system: Rcsc, args: list[str], meant: str) -> None:
    ran = system(*args)
    assert ran.status == 2
    assert f"did you mean `{meant}`?" in ran.out + ran.err


@pytest.mark.parametrize(
    ("old", "new", "help_"),
    [
        ('name = "axis"', "name = axis", 'a text stands in quotes: `name = "axis"`'),
        (
            '"cart.position" = "axis.position_mm"',
            'cart.position = "axis.position_mm"',
            'a key with a dot stands in quotes: `"cart.position" = ...`',
        ),
    ],
)
def test_a_system_without_quotes_is_told_where_they_stand(
    system: Rcsc, old: str, new: str, help_: str
) -> None:
    change("system.toml", old, new)
    ran = system("prove", "system.toml")
    assert ran.status == 1
    assert f"= help: {help_}\n" in ran.err + ran.out


def test_requirements_of_a_system_that_is_no_toml_are_not_taken_for_a_level(system: Rcsc) -> None:
    change("system.toml", 'name = "two"', "name = two")
    ran = system("check")
    assert ran.out.count("error[") == 1
    assert "error[RCS721]: the file is not TOML" in ran.out


# --- published files ---

OVERLAP = """input a : bool
output b : bool
table t {
  | line | a    || b     |
  |------|------||-------|
  | x    | true || true  |
  | y    |      || false |
}
"""


def test_findings_of_published_files_are_told_and_counted_apart(level: Rcsc) -> None:
    Path("published.rcs").write_text(OVERLAP, encoding="utf-8")
    Path("another.rcs").write_text(OVERLAP, encoding="utf-8")
    change("rcsc.toml", "exclude = []", 'published = ["published.rcs"]')
    ran = level("check")
    heading = "In files that are kept as published:"
    assert ran.status == 1
    assert ran.out.index("--> another.rcs:") < ran.out.index(heading) < ran.out.index("--> published.rcs:")
    assert "\npublished.rcs  kept as published\n" in ran.out
    assert ran.out.endswith(
        "; 1 error, 0 warnings, 0 notes; in 1 published file 1 error, 0 warnings, 0 notes\n"
    )
    form = json.loads(level("check", "--json").out)
    assert form["counts"] == {"errors": 2, "warnings": 0, "notes": 0}
    assert form["published"] == {
        "files": ["published.rcs"],
        "counts": {"errors": 1, "warnings": 0, "notes": 0},
    }
    Path("another.rcs").unlink()
    for _ in range(2):  # the second time as it was kept
        again = level("check")
        assert again.status == 1  # it is not proved, whoever published it
        assert again.out.endswith(
            "; 0 errors, 0 warnings, 0 notes; in 1 published file 1 error, 0 warnings, 0 notes\n"
        )
    assert heading not in level("check", "gripper.rcs").out


def test_the_shipped_tables_say_which_are_published() -> None:
    from rcsc.lang.project import is_published

    named = [
        each
        for each in (REPO / "tables").rglob("*.rcs")
        if "published" in str(each.relative_to(REPO / "tables"))
    ]
    assert len(named) > 15
    assert all(map(is_published, map(str, named)))


# --- the terminal's width ---


@pytest.mark.parametrize("columns", [80, 120])
@pytest.mark.parametrize("command", ["check", "prove"])
@pytest.mark.usefixtures("system")
def test_a_terminal_is_not_run_over(columns: int, command: str) -> None:
    change(
        "supervisor.rcs",
        "property done_at_rest :",
        "property p : axis.speed_mm_s = 0 [mm/s]\nproperty done_at_rest :",
    )
    if command == "prove":
        change("supervisor.rcs", "property p : axis.speed_mm_s = 0 [mm/s]\n", "")
    environment = {**os.environ, "COLUMNS": str(columns), "NO_COLOR": "1"}
    ours, theirs = pty.openpty()
    args = [sys.executable, "-c", "from rcsc.front.commands import main; main()", command]
    with subprocess.Popen(args, stdout=theirs, stderr=subprocess.DEVNULL, env=environment) as process:
        os.close(theirs)
        pieces = []
        while True:
            try:
                pieces.append(os.read(ours, 65536))
            except OSError:
                break
            if not pieces[-1]:
                break
        process.wait()
    os.close(ours)
    lines = click.unstyle(b"".join(pieces).decode()).replace("\r\n", "\n").splitlines()
    assert max(map(len, lines)) <= columns
    piped = subprocess.run(args, capture_output=True, env=environment, check=False).stdout.decode()
    words = "and each variable with its level" if command == "check" else "is refused"
    assert words in " ".join(piped.split())
    assert words in " ".join(" ".join(lines).split())
    assert max(map(len, piped.splitlines())) > columns
