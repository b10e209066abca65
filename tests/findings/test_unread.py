"""What a file declares and nobody reads is told by `rcsc check`, and nothing that anybody reads is."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.front.commands.group import commands
from tests.support.programs.stages import unread_in

WORKS = """
input go : bool
output lamp : bool
table t {
  | line | go    || procedures | lamp  |
  | on   | true  || CALLED     | true  |
  | off  | false ||            | false |
}
"""

ENUM = "enum step { rest, work, broken } "


def told(text: str, called: str = "") -> list[str]:
    found = unread_in(text + WORKS.replace("CALLED", called))
    assert all(each.severity is Severity.WARNING for each in found)
    return [each.message for each in found]


@pytest.mark.parametrize(
    ("text", "called", "messages"),
    [
        ("state n : int 0 .. 9", "", ["nothing reads state `n`"]),
        ("input n : int 0 .. 9", "", ["nothing reads input `n`"]),
        ("state n : int 0 .. 9 procedure p { n := 3 }", "p", ["nothing reads state `n`"]),
        (
            "state n : int 0 .. 9 procedure p { n := min(n + 1, 9) }",
            "p",
            ["nothing reads state `n` but assignments to itself"],
        ),
        (
            "record r { a : int 0 .. 9  b : int 0 .. 9 } state s : r procedure p { s.a := s.b }",
            "p",
            ["nothing reads state `s` but assignments to itself"],
        ),
        (
            "state n : int 0 .. 9 deferred until go procedure p { next n := 3 }",
            "p",
            ["nothing reads state `n`"],
        ),
        ("const n = 3", "", ["nothing uses constant `n`"]),
        (
            ENUM + "state s : step invariant i : s /= work",
            "",
            ["nothing gives or asks for member `broken` of `step`"],
        ),
        (
            ENUM + "state s : array[2] of step assume a : s[0] in {rest, work}",
            "",
            ["nothing gives or asks for member `broken` of `step`"],
        ),
        (  # a line's name, a local and a comment are no mention
            "enum step { rest, off, lit } state s : step assume a : s = rest procedure p { local lit : bool := true } # lit",
            "p",
            [f"nothing gives or asks for member `{name}` of `step`" for name in ("off", "lit")],
        ),
    ],
)
def test_what_nobody_reads_is_told(text: str, called: str, messages: list[str]) -> None:
    assert told(text, called) == messages


@pytest.mark.parametrize(
    ("text", "called"),
    [
        ("output n : int 0 .. 9", ""),
        ("state n : int 0 .. 9 output m : int 0 .. 9 procedure p { m := n }", "p"),
        ("state n : array[3] of bool procedure p { if n[1] { n[1] := false } }", "p"),
        ("state n : int 0 .. 2 state a : array[3] of bool = true property q : a[0] procedure p { a[n] := true }", "p"),
        ("state n : int 0 .. 9 procedure q(k : int 0 .. 9) { } procedure p { q(n) }", "p"),
        ("state n : int 0 .. 9 procedure p { case n { 1 { } else { } } }", "p"),
        ("input n : int 0 .. 9 assume a : n < 9", ""),
        ("input n : int 0 .. 9 property a : n >= was n", ""),
        ("state n : int 0 .. 9 invariant a : n < 9", ""),
        ("input done : bool state n : bool deferred until done property a : n", ""),
        ('input n : bool state m : bool extern procedure p reads n writes m python "a:b" c "b" invariant i : m or not m', ""),
        (ENUM + 'state m : step extern procedure p writes m python "a:b" c "b" invariant i : m /= rest or m = rest', ""),
        ("enum s { done, failed } state status_report : s invariant i : status_report /= done or status_report = done", ""),
        ("const n = 3 const m = n + 1 type k = int 0 .. m state s : k assume a : s < 2", ""),
        ("const n = 2 input a : array[n] of bool assume b : a[0]", ""),
        ("const n = 2 set few : int 0 .. 9 = {1, n} input a : int 0 .. 9 assume b : a in few", ""),
        (ENUM + "input s : step assume a : s /= work", ""),
        (ENUM + "output s : step property a : s /= work", ""),
        (ENUM + "record r { s : array[2] of step } input i : r assume a : i.s[0] /= work", ""),
        (ENUM + "state s : step = broken assume a : s /= work", ""),
        (ENUM + "state s : step restart broken assume a : s /= work", ""),
        (ENUM + "set bad : step = {work, broken} state s : step assume a : s in bad", ""),
        (ENUM + "state s : step assume a : s = step.broken or s = work", ""),
        (ENUM + "const end = broken state s : step procedure p { s := end } assume a : s /= work", "p"),
    ],
)  # fmt: skip
def test_what_is_read_is_not_told(text: str, called: str) -> None:
    assert told(text, called) == []


def test_a_file_of_words_is_not_judged() -> None:
    assert unread_in("const n = 3 enum step { rest, work } input n_ : bool state m : bool") == ()


def test_what_another_file_or_the_system_may_read_is_not_told(tmp_path: Path) -> None:
    (tmp_path / "rcsc.toml").write_text("", encoding="utf-8")
    part = tmp_path / "part.rcs"
    part.write_text("state n : bool" + WORKS.replace("CALLED", ""), encoding="utf-8")

    def check() -> str:
        return CliRunner().invoke(commands, ["check", str(part)]).output

    assert "nothing reads state `n`" in check()
    assert "nothing reads state `n`" in check()  # from the cache
    system = tmp_path / "system.toml"
    system.write_text('[displays]\nall = ["l.n"]\n', encoding="utf-8")
    assert "nothing reads" not in check()
    system.unlink()
    (tmp_path / "whole.rcs").write_text("use part\ninvariant i : n or not n\n", encoding="utf-8")
    assert "nothing reads" not in check()


READINGS = """record order {{ inc_command : int 0 .. 65535  go : bool }}
record motor {{ on : bool{on}  note : bool }}
input order : order
{reading}
output to_motor : motor
output shown : bool
output told : order
table t {{
  | line | order.go || to_motor.on | shown | told.go |
  | on   | true     || true        | true  | true    |
  | off  | false    || false       | false | true    |
}}
level l {{ period 40 [ms] table t }}
"""
DRIVES = """name = "robot"
generated = "generated"
tick_ms = 40
outside = ["driver"]
[[level]]
name = "l"
[buffers]
"l.to_motor" = "driver.order"
"""
STAYS = "output `to_motor` stays as it was while a reading of `force_n` is refused"


@pytest.mark.parametrize(
    ("reading", "on", "system", "stays"),
    [
        ("input force_n : real 0.0 .. 9.0", "", DRIVES, True),
        ("input force_n : real 0.0 .. 9.0 clamp", "", DRIVES, True),
        ("input force_n : int 0 .. 9 reject", "", DRIVES, True),
        ("input force_n : int 0 .. 9 clamp", "", DRIVES, False),
        ("input force_n : bool", "", DRIVES, False),
        ("", "", DRIVES, False),
        ("input force_n : real 0.0 .. 9.0", " safe false", DRIVES, False),
        ("input force_n : real 0.0 .. 9.0", "", DRIVES.replace("l.to_motor", "l.told"), False),
        ("input force_n : real 0.0 .. 9.0", "", "", False),
        ("input force_n : real 0.0 .. 9.0", "", "name = 3", False),
    ],
)
def test_an_output_to_a_motor_is_told_that_stays_while_a_reading_is_refused(
    reading: str, on: str, system: str, *, stays: bool, tmp_path: Path
) -> None:
    """Not what is shown to nobody, not an order, which has a number, and not where nothing can be refused."""
    (tmp_path / "rcsc.toml").write_text("", encoding="utf-8")
    if system:
        (tmp_path / "system.toml").write_text(system, encoding="utf-8")
    level = tmp_path / "l.rcs"
    level.write_text(READINGS.format(reading=reading, on=on), encoding="utf-8")
    for _ in range(2):  # the second time from the cache
        output = CliRunner().invoke(commands, ["check", str(level)]).output
        assert "error" not in output.replace("0 errors", "")
        assert [line.partition("]: ")[2] for line in output.splitlines() if "RCS322" in line] == [
            STAYS
        ] * stays


def test_a_file_without_a_project_is_looked_for_beside_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    part, below = tmp_path / "part.rcs", tmp_path / "below"
    part.write_text("state n : bool" + WORKS.replace("CALLED", ""), encoding="utf-8")
    below.mkdir()
    (below / "whole.rcs").write_text("use part\ninvariant i : n or not n\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for named in (str(part), "part.rcs"):
        assert (
            "nothing reads state `n`" in CliRunner().invoke(commands, ["check", "--no-cache", named]).output
        )
    (below / "whole.rcs").rename(tmp_path / "whole.rcs")
    for named in (str(part), "part.rcs"):
        assert "nothing reads" not in CliRunner().invoke(commands, ["check", "--no-cache", named]).output
