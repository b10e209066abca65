"""`rcsc fmt --upgrade`: what is rewritten changes no program; what could not be is said."""

import shutil
from pathlib import Path

import pytest

from rcsc.front.commands import run
from rcsc.front.commands.tables.fmt import Formatted, reformat
from rcsc.lang.model import Program, Value
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.lang.restart import After, Fixed, SameAs, Stands
from tests.support.programs.stages import program_of, shipped
from tests.support.programs.texts import edited

REPO = Path(__file__).parents[2]
WORDS = """
enum order { rest, go }
enum status { done, executing, failed }
enum why { none, restart }
"""
BY_HAND = (
    WORDS
    + """
enum phase { d_state, f_state }
record order_of { inc_command : int 0 .. 65535  input_command : order  far : int 0 .. 9 }
record report_of { inc_command_echo : int 0 .. 65535  ref_command_echo : order  status_report : status  failure : why }
input command : order_of
output report : report_of
state new_command : bool
state inc_command_seen : int 0 .. 65535
# The phase.
state cur_state : phase
state failure : why
state other : phase
module receive reads command, inc_command_seen writes new_command, inc_command_seen {
  new_command := command.inc_command /= inc_command_seen
  inc_command_seen := command.inc_command
}
table t {
  | line | when ||
  |------|------||
  | only | true ||
}
level hand {
  period 40 [ms]
  preprocess receive
  table t
}
"""
)
DECLARED = (
    WORDS
    + """
link below {
  command : order rest rest
  status : status done done failed failed executing executing
  report { reason why : why restart restart }
}
link above {
  command : order rest rest
  status : status done done failed failed executing executing
  report { reason why : why restart restart }
}
serves boss : above
commands arm : below
enum phase { home, away }
state phase : phase deferred until from_arm.inc_command_echo = to_arm.inc_command
procedure phase(value : phase) { next phase := value }
procedure executing { to_boss.status_report := executing }
# Not as the protocol makes it.
procedure done { to_boss.status_report := done  to_boss.why := none }
## Why: a doc line would be lost.
procedure failed { to_boss.status_report := failed }
table t {
  | line | new_command | arm.resting | arm.status || procedures  | arm  | status_out |
  |------|-------------|-------------|------------||-------------|------|------------|
  | wait | true        | false       |            || settle      |      |            |
  | go   | true        | true        |            || phase(away) | go   | executing  |
  | on   | false       |             | executing  ||             |      | executing  |
  | end  | false       |             | done       || phase(home) | rest | done       |
  | bad  | false       |             | failed     || phase(home) | rest | failed     |
}
level arm_user {
  period 40 [ms]
  table by boss.input_command { rest : t  go : t }
}
"""
)


def upgraded(folder: Path, text: str) -> tuple[Formatted, str]:
    """What became of a file of its own project, and its text then."""
    path = folder / "a.rcs"
    path.write_text(text, encoding="utf-8")
    (folder / "rcsc.toml").write_text("", encoding="utf-8")
    formatted = reformat((str(path),), None, write=True, older=True)
    return formatted, path.read_text(encoding="utf-8")


def test_what_a_restart_gives_by_name_is_written_out(tmp_path: Path) -> None:
    formatted, text = upgraded(tmp_path, BY_HAND)
    assert "# The phase.\nstate cur_state : phase restart f_state\n" in text
    assert "state failure : why restart restart\nstate other : phase\n" in text
    assert program_of(text).adopted == program_of(BY_HAND).adopted
    assert [words.partition(": ")[2] for words in formatted.upgraded[:2]] == [
        "`cur_state` says `restart f_state`",
        "`failure` says `restart restart`",
    ]
    again, same = upgraded(tmp_path, text)
    assert same == text
    assert again.changed == 0


def test_what_a_level_could_declare_is_written_out(tmp_path: Path) -> None:
    *_, draft = upgraded(tmp_path, BY_HAND)[0].upgraded
    assert draft.splitlines()[2:] == [
        "  link superior_link {",
        "    command : order rest rest",
        "    status : status done done failed failed executing executing",
        "    order {",
        "      far : int 0 .. 9",
        "    }",
        "    report {",
        "      reason failure : why restart restart",
        "    }",
        "  }",
        "  serves superior : superior_link",
        "",
        "in place of what `receive` do by hand. A link stands once, in a file that both its levels use",
    ]
    links = "\n".join(draft.splitlines()[2:13])
    assert program_of(f"{WORDS}{links}").roles is not None, "a draft is text of the language"


def test_what_the_protocol_makes_is_left_out(tmp_path: Path) -> None:
    formatted, text = upgraded(tmp_path, DECLARED)
    assert "state phase : phase deferred\n" in text
    assert "procedure executing" not in text
    assert "procedure done" in text
    assert "procedure failed" in text
    assert len(formatted.upgraded) == 2, formatted.upgraded
    before, after = program_of(DECLARED), program_of(text)
    assert after.variables == before.variables
    assert after.tables == before.tables


@pytest.mark.parametrize(
    "edit",
    [
        ("= to_arm.inc_command", "= to_arm.inc_command and phase = home"),
        ("deferred until from_arm.inc_command_echo = to_arm.inc_command", "deferred until phase = away"),
    ],
)
def test_another_condition_of_deferral_stays(tmp_path: Path, edit: tuple[str, str]) -> None:
    _, text = upgraded(tmp_path, edited(DECLARED, edit))
    assert "deferred until" in text


def test_a_file_that_another_program_reads_otherwise_is_left(tmp_path: Path) -> None:
    """One by hand and one that declares its superior use the file: its names mean something only to the first."""
    common = "enum phase { d_state, f_state }\nstate cur_state : phase\n"
    (tmp_path / "hand.rcs").write_text("use a\ninput b : bool\n", encoding="utf-8")
    assert "restart f_state" in upgraded(tmp_path, common)[1]
    roles = WORDS + DECLARED[DECLARED.index("link above") : DECLARED.index("commands arm")]
    (tmp_path / "roles.rcs").write_text(f"use a\n{roles}", encoding="utf-8")
    assert "restart" not in upgraded(tmp_path, common)[1]


def test_a_check_says_how_it_is_mended(tmp_path: Path) -> None:
    path = tmp_path / "a.rcs"
    path.write_text(BY_HAND, encoding="utf-8")
    for older, command in ((False, "rcsc fmt"), (True, "rcsc fmt --upgrade")):
        [finding] = reformat((str(path),), None, write=False, older=older).report.diagnostics
        assert finding.help == (f"run `{command}` on it",)
    assert path.read_text(encoding="utf-8") == BY_HAND


def test_a_program_with_errors_changes_nothing(tmp_path: Path) -> None:
    (tmp_path / "user.rcs").write_text("use a\nstate x : nowhere\n", encoding="utf-8")
    formatted, text = upgraded(tmp_path, BY_HAND)
    assert "restart f_state" not in text
    assert [diagnostic.code.value for diagnostic in formatted.report.diagnostics] == ["RCS201"]


def test_the_other_names_go_on_meaning_what_they_do(tmp_path: Path) -> None:
    """One `restart` in a level by hand takes nothing from the others; it wins over its own name."""
    adopted = program_of(
        edited(BY_HAND, ("state cur_state : phase", "state cur_state : phase restart d_state"))
    ).adopted
    assert adopted == {
        "cur_state": Fixed(0),
        "failure": Fixed(1),
        "report.status_report": Fixed(2),
        "report.failure": Fixed(1),
        "inc_command_seen": SameAs("command.inc_command"),
        **dict.fromkeys(("report.inc_command_echo", "report.ref_command_echo"), Stands()),
    }
    shutil.copytree(REPO / "tables", tmp_path / "tables")
    before = shipped("task/task.rcs", tmp_path / "tables").adopted
    assert run(["fmt", "--quiet", "--upgrade", str(tmp_path / "tables/task")]) == 0
    after = shipped("task/task.rcs", tmp_path / "tables")
    assert after.adopted == before
    assert any(isinstance(value, After) for value in before.values()) or after.roles is not None


STARTS = """
enum light { red, green }
record place { x : real -500.0 .. 500.0  near : array[2] of int -9 .. 9  gain : real 0.5 .. 2.0  fine : int 0 .. 9 = 3 }
link below {
  command : order rest rest
  status : status done done failed failed executing executing
  order { depth : int -7 .. 7  stream heat : single -20.5 .. 90.0 }
  report { reason why : why restart restart }
}
commands arm : below
input seen : place
input width : int 5 .. 9 [mm] clamp
output speed : int -400 .. 400 [mm/s] safe 0
output shown : light safe green
output lamp : bool safe true
output set : int -4 .. 4 = 1 safe 2
state at : array[3] of array[2] of int -3 .. 3
state least : int -9223372036854775808 .. 9223372036854775807
state held : int -6 .. 6 deferred
state plain : int 0 .. 9
table t {
  | line | when ||
  |------|------||
  | only | true ||
}
level own {
  period 40 [ms]
  table t
}
"""
WRITTEN = (
    "  x : real -500.0 .. 500.0 = -500.0\n  near : array[2] of int -9 .. 9 = -9\n  gain : real 0.5 .. 2.0 = 0.5\n  fine : int 0 .. 9 = 3\n",
    "    depth : int -7 .. 7 = -7\n    stream heat : single -20.5 .. 90.0 = -20.5\n",
    "input seen : place\n",
    "input width : int 5 .. 9 [mm] = 5 clamp\n",
    "output speed : int -400 .. 400 [mm/s] = -400 safe 0\n",
    "output shown : light = red safe green\n",
    "output lamp : bool = false safe true\n",
    "output set : int -4 .. 4 = 1 safe 2\n",
    "state at : array[3] of array[2] of int -3 .. 3 = -3\n",
    "state least : int -9223372036854775808 .. 9223372036854775807 = -9223372036854775808\n",
    "state held : int -6 .. 6 = -6 deferred\n",
    "state plain : int 0 .. 9\n",
)


def starts(text: str, *, least_first: bool = False) -> dict[str, Value]:
    """With what the leaves of a text's program start."""
    loaded = load(["-"], stdin=text, stdin_name="a.rcs")
    program = resolve("a.rcs", loaded, least_first=least_first)
    assert isinstance(program, Program), program
    return {str(variable.name): variable.initial for variable in program.variables}


def test_what_started_with_the_least_of_its_type_still_does(tmp_path: Path) -> None:
    formatted, text = upgraded(tmp_path, WORDS + STARTS)
    assert [line for line in WRITTEN if line not in text] == []
    assert starts(text) == starts(WORDS + STARTS, least_first=True)
    assert any("`seen.x`" in words for words in formatted.upgraded) is False  # the record says it, once
    assert "`place.x` says `= -500.0`, with which it started" in "\n".join(formatted.upgraded)
    again, same = upgraded(tmp_path, text)
    assert (same, again.changed) == (text, 0)


def test_a_start_is_written_as_its_number_stands_in_the_text(tmp_path: Path) -> None:
    """Two numbers of a text that are one double, or one single, are an error: none is written beside one that is there."""
    text = """const least = 0.10000000149011612
const lowest = -1.50000000000000001
input greatest : single -3.4028234663852886e38 .. 3.0e38
input near : real 0.10000000000000000555 .. 1.0
input named : single least .. 1.0
input at : real lowest .. 1.0
state far : array[2] of real -1e300 .. 2.0
state ready : bool
"""
    assert starts(upgraded(tmp_path, text)[1]) == starts(text, least_first=True)


def test_a_project_written_since_keeps_its_starts(tmp_path: Path) -> None:
    path = tmp_path / "a.rcs"
    path.write_text("output speed : int -400 .. 400 safe 0\n", encoding="utf-8")
    (tmp_path / "rcsc.toml").write_text("starts_at_zero = true\n", encoding="utf-8")
    reformat((str(path),), None, write=True, older=True)
    assert path.read_text(encoding="utf-8") == "output speed : int -400 .. 400 safe 0\n"


def test_what_another_file_declares_is_told(tmp_path: Path) -> None:
    (tmp_path / "rcsc.toml").write_text("", encoding="utf-8")
    (tmp_path / "words.rcs").write_text("record place { x : int -5 .. 5 }\n", encoding="utf-8")
    (tmp_path / "a.rcs").write_text("use words\nstate here : place\n", encoding="utf-8")
    formatted = reformat((str(tmp_path / "a.rcs"),), None, write=True, older=True)
    assert [words.partition(": ")[2] for words in formatted.upgraded] == [
        "`here.x` starts at 0, and not at -5 as before"
    ]
    both = reformat((str(tmp_path),), None, write=True, older=True)
    assert [words.partition(": ")[2] for words in both.upgraded] == [
        "`place.x` says `= -5`, with which it started"
    ]
