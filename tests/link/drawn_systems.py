"""Systems of two and three levels, drawn: periods, ranges, types, buffers to parts, to oneself and to what stands outside.

Their tables are trivial; what differs is what is carried, when, and what a restart makes of it. Numbers may be narrower than the
protocol's, and then a start anew counts none on; an invariant may forbid what a start anew sets. Orders take the greatest
number every other time, so that a restart meets it.
"""

from pathlib import Path
from random import Random

from rcsc.lang.restart import NUMBERED
from tests.support.programs.texts import system

PERIODS = (
    (10, 10), (10, 20), (30, 10), (20, 30), (10, 10, 10), (10, 20, 40), (40, 10, 20), (30, 20, 10),
    (20, 20, 50),
)  # fmt: skip
RANGES = ("int 0 .. 200", "int -3 .. 90", "int 7 .. 7", "int -70000 .. 70000", "int 0 .. 18446744073709551615",
          "real -1.5 .. 2.5", "bool", "job", "array[2] of int 0 .. 3", "array[2] of array[2] of bool", "pair")  # fmt: skip

WORDS = """
enum job {{ rest, go, stop }}
enum status {{ done, executing, failed }}
type number = int 0 .. {most}
record pair {{ a : int 0 .. 9  b : array[2] of job }}
record order {{ inc_command : number  input_command : job  goal : pair }}
record answer {{ inc_command_echo : int {least} .. {most}  ref_command_echo : job  status_report : status }}
"""
LEVEL = """
use words
record own {{ first : int 0 .. 50  second : array[2] of bool }}
{outputs}
input command : order
{inputs}
input x : {kind}{clamp}
assume calm monitored : count /= 2
state inc_command_seen : number
state status_report : status{initial}
state count : int 0 .. 6 = 2
state held : job deferred until count = 3
output report : answer
output shown : {kind}
output mine : own
{invariant}
module work reads command, inc_command_seen, count, status_report{reads} writes inc_command_seen, count, held, report, mine{writes} {{
  if inc_command_seen /= command.inc_command {{ count := 1 }}
  inc_command_seen := command.inc_command
  count := (count + 1) mod 7
  next held := command.input_command
  report.inc_command_echo := max(inc_command_seen, 5)
  report.ref_command_echo := command.input_command
  report.status_report := status_report
  mine.first := count * 2
  mine.second[1] := count = 2
{body}
}}
procedure say(s : status) {{ status_report := s }}
table t assuming calm {{
  | line | count || procedures     |
  | low  | < 4   || say(executing) |
  | high | >= 4  || say(done)      |
}}
level {name} {{
  period {period} [ms]
  table t
  postprocess work
}}
"""
BELOW = """
  to_low.input_command := command.input_command
  to_low.goal.a := command.goal.a
  if count = 2 { to_low.inc_command := MOST }
  if count = 4 { to_low.inc_command := 0 }
"""


def drawn_system(folder: Path, random: Random, *, most: int = 0) -> Path:
    """Write a system to a folder; return the path of its description.

    With the greatest number given, three levels that may each be refused their input, and that can start anew.
    """
    refusing, periods = most > 0, (20, 40, 30) if most else random.choice(PERIODS)
    most = most or random.choice((255, 65535, 9, 4294967295))
    names = ["top", "middle", "low"][-len(periods) :]
    (folder / "rcsc.toml").write_text('name = "drawn"\n', encoding="utf-8")
    (folder / "words.rcs").write_text(
        WORDS.format(most=most, least=0 if most == NUMBERED[1] else 5), encoding="utf-8"
    )
    buffers = {"out.order": f"{names[0]}.command", f"{names[0]}.report": "out.report"}
    for at, (name, period) in enumerate(zip(names, periods, strict=True)):
        last = at == len(names) - 1
        kind = RANGES[at] if refusing else random.choice(RANGES)
        text = level_text(random, name, period, kind, most, last=last)
        if refusing:
            text = text.replace(" clamp", "").replace("invariant never : mine.first <= 12", "")
        (folder / f"{name}.rcs").write_text(text, encoding="utf-8")
        if not last:
            buffers |= {
                f"{name}.to_low": f"{names[at + 1]}.command",
                f"{names[at + 1]}.report": f"{name}.low",
            }
        outer, inner = {f"plant.x{at}": f"{name}.x"}, {f"{name}.shown": f"{name}.x"}
        buffers |= outer if refusing else random.choice((outer, inner))
        buffers[f"{name}.mine"] = random.choice((f"{names[at - 1]}.theirs", f"out.parts.mine{at}"))
        if random.random() < 0.5 and f"{name}.shown" not in buffers:
            buffers[f"{name}.shown"] = f"plant.shown{at}"
        buffers[f"{name}.count"] = f"plant.count[{at}]"
        buffers[f"{name}.held"] = f"plant.held{at}"  # without its pending value
    (folder / "system.toml").write_text(
        system(names, buffers, name="drawn", generated='"generated"', tick_ms="10"), encoding="utf-8"
    )
    return folder / "system.toml"


def level_text(random: Random, name: str, period: int, kind: str, most: int, *, last: bool) -> str:
    invariant = random.choice(("", "", "invariant never : mine.first <= 12"))
    numeric = kind.startswith(("int", "real"))
    return LEVEL.format(
        name=name,
        period=period,
        kind=kind,
        clamp=random.choice((" clamp", "")) if numeric else "",
        inputs="input theirs : own" + ("" if last else "\ninput low : answer"),
        outputs="" if last else "output to_low : order",
        initial=random.choice(("", " = executing")),
        invariant=invariant,
        reads=", x" + ("" if last else ", to_low"),
        writes=", shown" + ("" if last else ", to_low"),
        body=shown(kind) + ("" if last else BELOW.replace("MOST", str(most))),
    )


def shown(kind: str) -> str:
    """Statements that give what was taken."""
    if kind == "array[2] of array[2] of bool":
        return "  shown[0][1] := x[1][0]\n  shown[1][1] := x[0][0]\n"
    if kind.startswith("array"):
        return "  shown[0] := x[1]\n  shown[1] := x[0]\n"
    if kind == "pair":
        return "  shown.a := x.a\n  shown.b[0] := x.b[1]\n"
    return "  shown := x\n"
