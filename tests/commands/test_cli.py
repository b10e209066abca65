"""The command line as a user meets it: exit statuses, forms, files, pipes, and what a second run costs."""

import io
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote_to_bytes

import jsonschema
import pytest

from rcsc.driver import together
from rcsc.front import commands
from rcsc.front.commands import run
from rcsc.run.description import Description, description
from tests.support.programs.texts import edited

REPO = Path(__file__).parents[2]
GAP = """\
input width_mm : int 0 .. 110
output held : bool
table grip {
  | line | width_mm || held  |
  |------|----------||-------|
  | held | 20 .. 40 || true  |
  | wide | > 40     || false |
}
"""
RIGHT = edited(GAP, ("| 20 .. 40 |", "| <= 40    |"))


@dataclass(frozen=True)
class Ran:
    status: int
    out: str
    err: str


Rcsc = Callable[..., Ran]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own, a cache of its own, and no colour from outside."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    for name in ("RCSC_CACHE_DIR", "RCSC_CACHE_KEY", "RCSC_DEBUG", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    return work


@pytest.fixture
def rcsc(capfd: pytest.CaptureFixture[str]) -> Rcsc:
    def run_it(*args: str) -> Ran:
        capfd.readouterr()
        status = run(args)
        shown = capfd.readouterr()
        return Ran(status, shown.out, shown.err)

    return run_it


def process(*args: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from rcsc.front.commands import main; main()", *args],
        capture_output=True, text=True, check=False, env={**os.environ, **environment},
    )  # fmt: skip


def write(name: str, text: str = RIGHT) -> None:
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


# --- exit statuses -------------------------------------------------------------------


def test_0_proved_and_the_report_says_what_backs_it(rcsc: Rcsc) -> None:
    write("grip.rcs")
    ran = rcsc("check")
    assert (ran.status, ran.err) == (0, "")
    assert ran.out.startswith("grip.rcs\n  grip  proved     2 lines, decided by counting, confirmed by Z3, ")
    assert ran.out.endswith("1 table: 1 proved, 0 refuted, 0 undecided; 0 errors, 0 warnings, 0 notes\n")


@pytest.mark.parametrize("cached", [(), ("--no-cache",)])
def test_a_table_whose_line_can_go_wrong_is_not_called_proved(rcsc: Rcsc, cached: tuple[str, ...]) -> None:
    over = "input x : int 0 .. 9\noutput n : int 0 .. 9\nprocedure p { n := n + x }\n"
    write(
        "over.rcs",
        over
        + "table t {\n| line | x || procedures |\n| a | || p |\n}\ntable u {\n| line | x ||\n| a | ||\n}\n",
    )
    for _ in range(2):
        form = json.loads(rcsc("check", "--json", *cached).out)
        assert [one["code"] for one in form["diagnostics"]] == ["RCS413"]
        assert {one["table"]: one["verdict"] for one in form["tables"]} == {"t": "conditional", "u": "proved"}


@pytest.mark.parametrize("args", [["check", "--frob"], ["frob"], ["check", "--steps", "0"], ["explain", "1"]])
def test_2_usage(rcsc: Rcsc, args: list[str]) -> None:
    ran = rcsc(*args)
    assert ran.status == 2
    assert ran.out == ""
    assert "Error:" in ran.err


def test_3_a_bug_is_reported_short_and_with_a_trace_on_request(
    rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_settings: object) -> None:
        raise ValueError("bad \x1b[31m things")

    monkeypatch.setattr("rcsc.front.commands.tables.check.check", broken)
    ran = rcsc("check")
    assert ran.status == 3
    assert ran.err.startswith("error[RCS902]: a bug in rcsc")
    assert "\x1b" not in ran.err
    assert "report it" in ran.err
    assert "Traceback" not in ran.err
    monkeypatch.setenv("RCSC_DEBUG", "1")
    assert "Traceback" in rcsc("check").err


def test_ctrl_c_ends_a_long_run_and_leaves_nothing(folder: Path) -> None:
    write("slow.rcs")
    script = (
        "import time, rcsc.driver.pipeline as d, rcsc.front.commands as c, sys\n"
        "def slow(*a, **k):\n    print('ready', flush=True); time.sleep(60)\n"
        "d.read = slow\nsys.exit(c.run(['compile', 'slow.rcs']))"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    child.send_signal(signal.SIGINT)
    _, err = child.communicate()
    assert child.returncode == 130
    assert "interrupted" in err
    assert [path.name for path in folder.iterdir()] == ["slow.rcs"]


@pytest.mark.usefixtures("folder")
def test_who_is_interrupted_does_not_wait_for_the_interpreter() -> None:
    script = (
        "import atexit, rcsc.driver.pipeline as d, rcsc.front.commands as c, sys\n"
        "atexit.register(print, 'cleared up')\n"
        "def interrupted(*a, **k):\n    print('begun'); raise KeyboardInterrupt\n"
        "d.read = interrupted\nsys.argv[1:] = ['compile', 'slow.rcs']\nc.main()"
    )
    write("slow.rcs")
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (130, "begun\n")
    assert "interrupted" in ran.stderr


BAD_INPUTS = [
    ("RCS101", b"table { }"),
    ("RCS105", b"# caf\xe9\n"),
    ("RCS106", b"input a : bool\x00\n"),
    ("RCS103", b"const a = " + b"(" * 400 + b"1" + b")" * 400),
    ("RCS104", b"#" * (16 * 1024 * 1024 + 1)),
    ("RCS205", b"use nothing\n"),
    ("RCS102", edited(GAP, ("| held | 20 .. 40 || true  |", "| held | 20 .. 40 ||")).encode()),
]


@pytest.mark.parametrize(("code", "content"), BAD_INPUTS)
def test_bad_input_is_a_coded_error(rcsc: Rcsc, code: str, content: bytes) -> None:
    Path("bad.rcs").write_bytes(content)
    for command in ("check", "compile", "fmt"):
        ran = rcsc(command, "bad.rcs")
        if command == "fmt" and code == "RCS205":
            continue  # what a file uses is no matter of its layout
        assert ran.status == 1, ran
        assert f"error[{code}]" in ran.out
    assert not Path("generated").exists()
    assert Path("bad.rcs").read_bytes() == content


def test_a_path_that_is_not_there_is_a_usage_error_in_every_command_that_takes_one(rcsc: Rcsc) -> None:
    write("there.rcs")
    of_tables = ["check", "compile", "fmt", "test", "certify", "graph"]
    for args in [[name, "no/such.rcs"] for name in of_tables] + [
        ["check", "there.rcs", "no/such.rcs"],
        ["graph", "no/such.rcs:grip"],
        ["diff", "there.rcs", "no/such.rcs"],
        ["prove", "no/such.toml"],
        ["prove", "--case", "no/such.json"],
        ["shell", "no/such.toml"],
        ["log", "no/such.mcap"],
        ["replay", "no/such.mcap"],
    ]:
        ran = rcsc(*args)
        assert ran.status == 2, args
        assert "no/such" in ran.err + ran.out
    assert not Path("generated").exists()


def test_quiet_leaves_out_the_notes_that_every_check_repeats(rcsc: Rcsc) -> None:
    """Not errors, not warnings; and forms for programs have everything."""
    held = edited(RIGHT, ("| wide | > 40     |", "| wide | DEFAULT  |"))
    write("grip.rcs", held + "property kept : held then held\n")
    noted = {"RCS407", "RCS420"}
    for form in ((), ("--format", "line")):
        told = rcsc("check", *form).out
        assert all(f"note[{code}]" in told for code in noted)
        assert rcsc("check", "--quiet", *form).out == ""
    form_ = json.loads(rcsc("check", "--quiet", "--json").out)
    assert {one["code"] for one in form_["diagnostics"]} == noted
    write("grip.rcs", held + "input unused : bool\ninvariant never : held and not held\n")
    assert "error[" in rcsc("check", "--quiet").out


def test_a_folder_with_nothing_to_check_does_not_pass(rcsc: Rcsc) -> None:
    ran = rcsc("check")
    assert ran.status == 1
    assert "error[RCS111]" in ran.out


# --- forms ---------------------------------------------------------------------------


def test_forms(rcsc: Rcsc) -> None:
    write("grip.rcs", GAP)
    form = json.loads(rcsc("check", "--json").out)
    schema = json.loads((REPO / "rcsc/base/diagnostics/schema/report.schema.json").read_text())
    jsonschema.validate(form, schema, jsonschema.Draft202012Validator)
    assert [one["code"] for one in form["diagnostics"]] == ["RCS401"]
    assert form["tables"][0]["verdict"] == "refuted"
    log = json.loads(rcsc("check", "--sarif").out)
    official = json.loads((REPO / "tests/data/sarif-schema-2.1.0.json").read_text())
    jsonschema.validate(log, official)
    assert log["runs"][0]["results"][0]["ruleId"] == "RCS401"
    assert rcsc("check", "--github").out.startswith("::error file=grip.rcs,line=3,endLine=3,col=7,")
    assert rcsc("check", "--format", "line").out.startswith("grip.rcs:3:7: error[RCS401]: ")
    assert "1 table:" not in rcsc("check", "-q").out


@pytest.mark.parametrize(
    "name", ["w\udcff.rcs", "a,b=c%0A.rcs", "a\n::error::b.rcs", "\u202eevil.rcs", 'q"\\.rcs']
)
def test_a_report_in_any_form_stands_whatever_the_file_is_called(rcsc: Rcsc, name: str) -> None:
    write(name, GAP)
    assert json.loads(rcsc("check", "--json").out)["tables"][0]["file"] == name
    [place] = json.loads(rcsc("check", "--sarif").out)["runs"][0]["results"][0]["locations"]
    assert os.fsencode(unquote_to_bytes(place["physicalLocation"]["artifactLocation"]["uri"])) == os.fsencode(
        name
    )
    line, *more = rcsc("check", "--github").out.splitlines()
    assert more == []
    assert line.startswith("::error file=")
    assert line.partition(",")[2].startswith("line=3,endLine=3,col=7,")
    assert json.loads(rcsc("diff", "--json", name, name).out)["programs"][0]["program"] == name


def test_output_goes_to_a_file_whole(rcsc: Rcsc) -> None:
    write("grip.rcs", GAP)
    ran = rcsc("check", "--json", "-o", "report.json")
    assert (ran.status, ran.out) == (1, "")
    assert json.loads(Path("report.json").read_text())["ok"] is False
    ran = rcsc("check", "--json", "-o", "no/such/folder.json")
    assert ran.status == 1
    assert ran.err.startswith("error[RCS502]: no/such/folder.json cannot be written: No such file")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full here")
def test_a_full_disk_is_a_coded_error(rcsc: Rcsc) -> None:
    write("grip.rcs")
    assert rcsc("check", "-o", "/dev/full").err.startswith(
        "error[RCS502]: /dev/full cannot be written: No space"
    )
    with open("/dev/full", "w", encoding="utf-8") as full:
        ran = subprocess.run(
            [sys.executable, "-c", "from rcsc.front.commands import main; main()", "check"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert ran.returncode == 1
    assert ran.stderr.startswith("error[RCS502]: standard output cannot be written: No space")


def test_colour_when_asked_for_and_not_else(rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch) -> None:
    write("grip.rcs", GAP)
    assert "\x1b" not in rcsc("check").out
    painted = rcsc("check", "--no-cache", "--quiet", "--color", "always").out
    assert "\x1b[1;31merror" in painted
    monkeypatch.setenv("NO_COLOR", "1")
    assert rcsc("check", "--no-cache", "--quiet", "--color", "always").out == painted


def test_a_reader_that_goes_away_is_no_bug() -> None:
    write("grip.rcs", GAP)
    command = f"{sys.executable} -c 'from rcsc.front.commands import main; main()' check --no-cache"
    script = f"{command} | true; echo ${{PIPESTATUS[0]}}"
    ran = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)
    assert ran.stdout in {"1\n", "141\n"}
    assert ran.stderr == ""


def test_standard_input(rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch) -> None:
    for text, status in ((GAP, 1), (RIGHT, 0)):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
        assert rcsc("check", "-").status == status
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"\xff")))
    assert "error[RCS105]" in rcsc("check", "-").out


# --- the second run ------------------------------------------------------------------

HEAVY = {
    "lark", "z3", "jinja2", "numpy", "rich", "hypothesis", "cvc5", "pysat", "pytest", "subprocess",
    "rcsc.lang.model", "rcsc.lang.syntax.tree",
}  # fmt: skip
LOADED = "import sys\nfrom rcsc.front.commands import run\nstatus = run(sys.argv[1:])\nprint(status, *sorted(sys.modules))"


def loaded(*args: str) -> tuple[str, set[str]]:
    ran = subprocess.run([sys.executable, "-c", LOADED, *args], capture_output=True, text=True, check=True)
    status, *names = ran.stdout.splitlines()[-1].split()
    return status, set(names)


def test_a_second_check_imports_nothing_heavy() -> None:
    shutil.copytree(REPO / "tables", "tables")
    status, first = loaded("check", "tables/gripper")
    assert {"lark", "rcsc.lang.model", "rcsc.lang.syntax.tree"} <= first
    again, second = loaded("check", "tables/gripper")
    assert again == status
    assert not second & HEAVY
    assert len([name for name in second if name.startswith("rcsc.")]) <= 50
    _, asked_for_help = loaded("--help")
    assert not asked_for_help & HEAVY
    write("alone/grip.rcs", RIGHT)
    loaded("check", "alone")
    _, of_no_system = loaded("check", "alone")
    assert not of_no_system & {*HEAVY, "rcsc.driver.together", "rcsc.base.host.described", "rcsc.compose"}


def test_a_system_is_read_once_for_all_its_tables(rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(REPO / "tables", "tables")
    read: list[Path] = []

    def counted(system: Path) -> Description:
        read.append(system)
        return description(system)

    monkeypatch.setattr(together, "description", counted)
    assert rcsc("check", "tables/vision", "tables/gripper", "tables/emove").status == 0
    assert [path.name for path in read] == ["system.toml"]


def same(first: Ran, second: Ran) -> bool:
    return first.status == second.status and second.out.replace(" (earlier run)", "") == first.out


def test_a_second_check_says_the_same(rcsc: Rcsc) -> None:
    write("sub/types.rcs", "\ufeffenum status { done, failed }\r\n")
    write("sub/grip.rcs", GAP.replace("output", "use types\ninput s : status\noutput", 1))
    first, second = rcsc("check"), rcsc("check")
    assert "(earlier run)" in second.out
    assert same(first, second)


def test_any_change_is_noticed(rcsc: Rcsc) -> None:
    write("grip.rcs", "use types\n" + RIGHT)
    write("types.rcs", "enum status { done }\n")
    assert rcsc("check").status == 0

    def changed(change: Callable[[], object]) -> Ran:
        assert "(earlier run)" in rcsc("check").out
        change()
        return rcsc("check")

    ran = changed(lambda: write("types.rcs", "enum status { done, done }\n"))
    assert "error[RCS202]" in ran.out
    write("types.rcs", "enum status { done }\n")
    assert rcsc("check").status == 0
    ran = changed(lambda: write("another.rcs", GAP))
    assert "error[RCS401]" in ran.out
    Path("another.rcs").unlink()
    assert rcsc("check").status == 0
    ran = changed(lambda: write("rcsc.toml", 'nmae = "x"\n'))
    assert "error[RCS110]" in ran.out


def test_a_used_file_that_comes_to_stand_nearer_is_noticed(rcsc: Rcsc) -> None:
    write("rcsc.toml", 'name = "x"\n')
    write("types.rcs", "const limit = 40\n")
    write("sub/grip.rcs", "use types\n" + edited(RIGHT, ("<= 40   ", "<= limit")))
    assert rcsc("check", "sub/grip.rcs").status == 0
    assert "(earlier run)" in rcsc("check", "sub/grip.rcs").out
    write("sub/types.rcs", "const limit = 30\n")
    assert rcsc("check", "sub/grip.rcs").status == 1


def test_other_options_are_another_check(rcsc: Rcsc) -> None:
    write("grip.rcs")
    rcsc("check")
    assert "(earlier run)" not in rcsc("check", "--solver", "boxes").out
    assert "(earlier run)" not in rcsc("check", "--no-cache").out


def test_a_forged_cache_is_not_believed(rcsc: Rcsc, tmp_path: Path) -> None:
    write("grip.rcs", GAP)
    assert rcsc("check").status == 1
    for entry in Path(".rcsc-cache").glob("??/*.json"):
        entry.write_bytes(entry.read_bytes().replace(b"refuted", b"proved ").replace(b"RCS401", b"RCS407"))
    assert rcsc("check").status == 1
    shutil.rmtree(tmp_path / "home")  # another user's secret
    assert "(earlier run)" not in rcsc("check").out


def test_an_unchanged_table_is_not_proved_again_when_its_neighbour_changes(rcsc: Rcsc) -> None:
    write("one.rcs")
    write("two.rcs", edited(RIGHT, ("grip", "other")))
    assert rcsc("check").status == 0
    write("two.rcs", "\n# moved down\n" + edited(RIGHT, ("grip", "other")).replace("40", "41"))
    shown = rcsc("check").out
    assert "(earlier run)" in shown.split("two.rcs")[0]
    assert "(earlier run)" not in shown.split("two.rcs")[1]


PARTED = """
input width : int 0 .. 110
state worst : int 0 .. 110
output wide : bool
procedure keep { worst := max(worst, width) }
table grip {
  | line | width   ||
  |------|---------||
  | low  | < 40    ||
  | rest | DEFAULT ||

  | line || procedures | wide  |
  |------||------------|-------|
  | low  || keep       | false |
  | rest || keep       | true  |
}
"""


def test_a_table_in_parts_is_kept_with_what_is_said_of_it(rcsc: Rcsc) -> None:
    write("grip.rcs", PARTED)
    first = rcsc("check")
    assert (first.status, "note[RCS4" in first.out) == (0, True)
    write("grip.rcs", f"# moved\n{PARTED}")
    again = rcsc("check").out
    assert "(earlier run)" in again
    assert "grip.rcs:11:" in again
    write("grip.rcs", edited(PARTED, ("keep       | false", "keep       | true ")))
    assert "(earlier run)" not in rcsc("check").out


# --- compile, fmt, certify, new ------------------------------------------------------


def tree() -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in sorted(Path("generated").rglob("*")) if p.is_file()}


def test_compile_writes_and_checks_freshness(rcsc: Rcsc) -> None:
    write("grip.rcs")
    ran = rcsc("compile", "grip.rcs", "--check")
    assert ran.status == 1
    assert "error[RCS501]" in ran.out
    assert rcsc("compile", "grip.rcs").status == 0
    made = tree()
    assert {"generated/python/grip.py", "generated/c/grip.c", "generated/c/grip.h"} <= made.keys()
    assert rcsc("compile", "grip.rcs", "--check").status == 0
    write("grip.rcs", edited(RIGHT, ("true ", "false")))
    assert rcsc("compile", "grip.rcs", "--check").status == 1
    assert tree() == made


def test_the_bytes_do_not_hang_on_where_one_stands(
    rcsc: Rcsc, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write("rcsc.toml", "")
    write("sub/grip.rcs")
    assert rcsc("compile").status == 0
    made = tree()
    assert rcsc("compile", str(folder / "sub" / "grip.rcs"), "--check").status == 0
    monkeypatch.chdir("sub")
    assert rcsc("compile", "grip.rcs", "--check", "--out", "../generated").status == 0
    text = made["generated/c/grip.c"].decode()
    assert "generated by rcsc from sub/grip.rcs" in text
    assert str(folder) not in text


def test_nothing_is_compiled_that_is_not_proved(rcsc: Rcsc) -> None:
    write("grip.rcs", GAP)
    write("other.rcs", RIGHT)
    ran = rcsc("compile")
    assert ran.status == 1
    assert "nothing was written" in ran.out
    assert not Path("generated").exists()


def test_compile_one_target_to_another_folder(rcsc: Rcsc) -> None:
    write("grip.rcs")
    assert rcsc("compile", "grip.rcs", "--target", "python", "--out", "build").status == 0
    assert Path("build/python/grip.py").is_file()
    assert not Path("build/c").exists()
    assert rcsc("compile", "grip.rcs", "--target", "cobol").status == 2


def test_an_output_folder_that_cannot_be_written_is_a_coded_error(rcsc: Rcsc) -> None:
    write("grip.rcs")
    Path("generated").write_text("in the way")
    ran = rcsc("compile", "grip.rcs")
    assert ran.status == 1
    assert "error[RCS502]" in ran.out
    assert Path("generated").read_text() == "in the way"


def test_two_programs_of_one_name_are_refused(rcsc: Rcsc) -> None:
    write("a/grip.rcs")
    write("b/Grip.rcs")
    ran = rcsc("compile")
    assert ran.status == 1
    assert "error[RCS503]" in ran.out


def told(table: str = "t", more: str = "", calls: str = "") -> str:
    """A program with a table of this name."""
    return f"input x : int 0 .. 9\nstate n : int 0 .. 9\n{more}table {table} {{\n| line | x || procedures |\n| a | || {calls} |\n}}\n"


F = 'extern procedure f reads x {} python "m:f" c "m_f"\n'
TOGETHER = {
    "a table": ("a", told("b_c"), "a_b", told("c"), "a_b_c_line"),
    "an enumeration and a program": ("a", told(more="enum b { p }\n"), "a_b", told(), "a_b_t"),
    "a record and an enumeration": ("a", told(more="record b_c { f : bool }\n"), "a_b", told(more="enum c { p }\n"), "a_b_c_t"),
    "members": ("a", told(more="enum b_c { p }\n"), "a_b", told(more="enum c { p }\n"), "a_b_c_t"),
    "a guard": ("a", told(more="enum b { h }\n"), "a_b", told(), "A_B_H"),
    "files": ("a-b", told("one"), "a_b", told("two"), "a_b.py"),
    "files of a library's name": ("time", told("one"), "time_", told("two"), "time_.py"),
    "an extern and a step": ("a", told("b"), "c", told(more=F.format("").replace("m_f", "a_b_step"), calls="f"), "a_b_step"),
    "externs of other types": ("a", told(more=F.format(""), calls="f"), "b", told(more=F.format("writes n"), calls="f"), "m_f"),
    "externs of one program": (
        "a", told(more=F.format("") + F.format("writes n").replace(" f ", " g "), calls="f; g"), "b", told(), "m_f"
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", list(TOGETHER))
def test_what_could_not_be_linked_together_is_refused(what: str, rcsc: Rcsc) -> None:
    first, one, second, two, name = TOGETHER[what]
    write(f"{first}.rcs", one)
    write(f"{second}.rcs", two)
    ran = rcsc("compile")
    assert (ran.status, Path("generated").exists()) == (1, False)
    assert "error[RCS503]: " in ran.out
    assert name in ran.out


def test_a_file_is_overwritten_only_by_a_program_of_its_name(rcsc: Rcsc) -> None:
    """Each kind of file; a program that was moved, or whose table has changed, is the same one."""
    write("a-b.rcs")
    assert rcsc("compile", "a-b.rcs").status == 0
    made = sorted(path for path in Path("generated").rglob("*.*") if path.is_file())
    assert {path.suffix for path in made} == {".c", ".h", ".json", ".pc", ".cmake", ".py"}
    write("moved/a-b.rcs", Path("a-b.rcs").read_text(encoding="utf-8") + "\n# changed\n")
    for source in ("moved/a-b.rcs", "a-b.rcs"):
        assert rcsc("compile", source).status == 0
    before = {path: path.read_bytes() for path in made}
    for path in made:
        other = OTHER.get(path.suffix, "mine\n")
        path.write_text(other, encoding="utf-8")
        ran = rcsc("compile", "a-b.rcs")
        assert ran.status == 1
        assert f"error[RCS503]: `{path}` was" in ran.out
        assert path.read_text(encoding="utf-8") == other
        path.write_bytes(b"")
        assert rcsc("compile", "a-b.rcs").status == 0, "what is empty is nobody's"
        assert {each: each.read_bytes() for each in made} == before
    write("a_b.rcs")
    ran = rcsc("compile", "a_b.rcs")
    assert ran.status == 1
    assert "was compiled from program `a-b`, and would be overwritten by program `a_b`" in ran.out
    assert rcsc("compile", "a_b.rcs", "--out", "beside").status == 0


OTHER = {
    ".json": '{\n "program": "other",\n "leaves": []}',
    ".c": "/* generated by rcsc from sub/other.rcs, do not edit */\n",
    ".py": "# generated by rcsc from other.rcs, do not edit\n",
}


def test_what_is_compiled_together_can_be_linked_together(rcsc: Rcsc) -> None:
    same = F.format("writes n")
    more = "enum k { p, q }\nrecord r { f : bool }\n"
    write("a.rcs", told("b", more + same, "f"))
    write(
        "a_c.rcs", told("b_c", f"{more}{same}{same.replace(' f ', ' g ')}procedure both {{ f; g }}\n", "both")
    )
    write("b_c.rcs", told("a", more))
    assert rcsc("compile").status == 0
    everything = "".join(f'#include "{path.name}"\n' for path in sorted(Path("generated/c").glob("*.h")))
    Path("generated/c/all.c").write_text(
        everything + "void m_f(uint8_t x, uint8_t *n) { *n = x; }\nint main(void) { return 0; }\n"
    )
    made = subprocess.run(
        ["cc", "-Wall", "-Wextra", "-Werror", *map(str, Path("generated/c").glob("*.c")), "-o", "all"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (made.returncode, made.stderr) == (0, "")


def test_fmt(rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch) -> None:
    ragged = edited(RIGHT, ("| <= 40    ||", "|<= 40||"))
    write("grip.rcs", ragged)
    ran = rcsc("fmt", "--check")
    assert ran.status == 1
    assert "error[RCS112]" in ran.out
    ran = rcsc("fmt", "--diff")
    assert ran.status == 1
    assert ran.out.startswith("--- grip.rcs\n+++ grip.rcs\n")
    assert Path("grip.rcs").read_text() == ragged
    assert rcsc("fmt").status == 0
    formatted = Path("grip.rcs").read_text()
    assert "|<= 40||" not in formatted
    for command in (["fmt", "--check"], ["fmt", "--diff"], ["fmt"]):
        assert rcsc(*command).status == 0
    assert Path("grip.rcs").read_text() == formatted
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(ragged.encode())))
    ran = rcsc("fmt", "-")
    assert (ran.status, ran.out) == (0, formatted)


def test_certify(rcsc: Rcsc) -> None:
    write("grip.rcs")
    ran = rcsc("certify", "grip.rcs", "--write", "grip.json")
    assert ran.status == 0, ran
    assert "certified" in ran.out
    assert rcsc("certify", "grip.rcs", "--against", "grip.json").status == 0
    write("grip.rcs", RIGHT.replace("40", "50"))
    ran = rcsc("certify", "grip.rcs", "--against", "grip.json")
    assert ran.status == 1
    assert "error[RCS418]" in ran.out
    for damage in (b"[]", b"{", b"{}", b"\xff"):
        Path("grip.json").write_bytes(damage)
        ran = rcsc("certify", "grip.rcs", "--against", "grip.json")
        assert ran.status == 1
        assert "error[RCS418]" in ran.out
    write("grip.rcs", GAP)
    assert rcsc("certify", "grip.rcs").status == 1


HARD = """
input n : int 0 .. 1000000
input m : int 0 .. 1000000
state s : int 0 .. 1000000
assume small proved : n <= 1000000
procedure p { if m <= n { s := n - m } }
table t assuming small {
  | line | n    ||
  |------|------||
  | one  | < 4  ||
  | two  | >= 4 ||
}
"""


@pytest.mark.usefixtures("folder")
def test_certify_of_a_system_drops_no_option(rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch) -> None:
    from rcsc.front.commands.systems.prove import command as prove

    given: dict[str, object] = {}

    def proved(**said: object) -> int:
        given.update(said)
        return 0

    monkeypatch.setattr(prove, "callback", proved)
    Path("system.toml").touch()
    for options, strict, no_cache in (
        ((), False, False),
        (("--strict",), True, False),
        (("--certify", "--no-cache"), False, True),
    ):
        assert rcsc("certify", "system.toml", *options).status == 0
        assert (given["confirms"], given["strict"], given["no_cache"]) == (True, strict, no_cache)
    for more in (
        ("--steps", "5"),
        ("--memory", "100"),
        ("--write", "a.json"),
        ("--solver", "both"),
        ("-j", "2"),
    ):
        ran = rcsc("certify", "system.toml", *more)
        assert ran.status == 2
        assert "rcsc prove" in ran.err


def test_certify_names_what_it_did_not_check(rcsc: Rcsc) -> None:
    write("hard.rcs", HARD)
    ran = rcsc("certify", "hard.rcs", "--write", "a.json", "--questions", "left")
    assert ran.status == 0
    assert "note[RCS421]: not checked: procedure `p`: `s` stays in 0 .. 1000000" in ran.out
    assert "not wholly certified: checked 4 of 5 obligations" in ran.out
    assert "(proved)" not in ran.out
    [question] = Path("left").iterdir()
    assert question.read_text().startswith("; procedure `p`: `s` stays in 0 .. 1000000\n")
    for more in (["--strict"], ["--against", "a.json"]):
        ran = rcsc("certify", "hard.rcs", *more)
        assert ran.status == 1
        assert "error[RCS421]" in ran.out
    for more in (["--strict"], ["--against", "a.json"]):
        ran = rcsc("certify", "hard.rcs", "--certify", *more)
        assert ran.status == 0
        assert "certified: checked all 5 obligations" in ran.out
    write("hard.rcs", edited(HARD, ("m <= n", "m <= n + 1")))
    ran = rcsc("certify", "hard.rcs", "--against", "a.json", "--certify")
    assert ran.status == 1
    assert "of another program" in ran.out


@pytest.mark.parametrize("name", ["two words", "-x", "$(touch made)", "it's", "a;b"])
def test_what_new_says_to_run_next_can_be_pasted(
    name: str, rcsc: Rcsc, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = rcsc("new", "--", name)
    there = said.err.partition("now: ")[2] or said.out.partition("now: ")[2]
    shown = subprocess.run(
        ["sh", "-c", there.replace("rcsc check", "pwd -P")], capture_output=True, text=True, check=True
    )
    assert shown.stdout.strip() == str((tmp_path / name).resolve())
    assert not (tmp_path / "made").exists()


def test_new_begins_in_a_fresh_repository(
    rcsc: Rcsc, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "cart"
    (here / ".git").mkdir(parents=True)
    (here / "README.md").write_text("a cart\n", encoding="utf-8")
    (here / "LICENSE").touch()
    monkeypatch.chdir(here)
    ran = rcsc("new", ".", "--template", "system")
    assert (ran.status, (here / "README.md").read_text(encoding="utf-8")) == (0, "a cart\n")
    assert "in ., and kept README.md; now: rcsc check && " in ran.out + ran.err
    assert rcsc("check").status == 0
    again = rcsc("new", ".")
    assert (again.status, "not empty, it has `axis.rcs`" in again.out) == (1, True)


def test_help_teaches(rcsc: Rcsc) -> None:
    assert "Exit status: 0 proved, 1 findings, 2 usage, 3 a bug in rcsc." in rcsc("--help").out
    for name in commands.group.commands.commands:
        ran = rcsc(name, "--help")
        assert ran.status == 0
        assert "Example" in ran.out


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell: str, rcsc: Rcsc) -> None:
    script = rcsc("completion", shell)
    assert script.status == 0
    assert "_RCSC_COMPLETE" in script.out
    words = {"COMP_WORDS": "rcsc com", "COMP_CWORD": "1" if shell != "fish" else "com"}
    completed = process(_RCSC_COMPLETE=f"{shell}_complete", **words)
    assert "compile" in completed.stdout
    assert "completion" in completed.stdout
