"""Small systems in a folder: two levels that keep to the protocol, and one level by itself.

`tests/data/composed` holds the two levels: `upper` gives orders to `lower`, whose table `go` waits for its input `there`.
A test that wants another `upper`, `lower` or `words` says which text stands there instead: one with edits (`small_text`),
or a lower level whose table `go` has other lines (`lower_level`).
"""

import re
import shutil
from functools import cache
from pathlib import Path

from rcsc.compose.contract.environment import Links
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import LevelProof, prove_level
from rcsc.compose.proof.system import SystemProof, prove_transition_systems, transition_systems
from rcsc.lang.model import Kind
from tests.support.programs.stages import program_of
from tests.support.programs.texts import edited, system, table, without_row

SMALL = Path(__file__).parents[2] / "data" / "composed"
SYSTEM = SMALL / "system.toml"
LITTLE = Effort(walks=6, cycles=40)
"""Enough to find the invariants of levels as small as these."""


@cache
def small_proofs() -> tuple[dict[str, TransitionSystem], SystemProof]:
    """Prove the small system as it is, once for all tests of a process."""
    made = transition_systems(SYSTEM)
    return made, prove_transition_systems(made, LITTLE, 1, tuple(made))


def small_proof(name: str) -> tuple[TransitionSystem, LevelProof]:
    """Return a level of the small system as it is, and its proof."""
    made, proof = small_proofs()
    return made[name], next(level for level in proof.levels if level.level == name)


def small_text(name: str, *edits: tuple[str, str]) -> str:
    """Return the text of a file of the small system, with these edits (`edited`)."""
    return edited((SMALL / f"{name}.rcs").read_text(encoding="utf-8"), *edits)


def small_system(folder: Path, **texts: str) -> Path:
    """Copy the small system to a folder, with other texts in some files; return the path of its description."""
    shutil.copytree(SMALL, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".rcsc-cache"))
    for name, text in texts.items():
        assert text != small_text(name), f"the text of {name} is as before"
        (folder / f"{name}.rcs").write_text(text, encoding="utf-8")
    return folder / SYSTEM.name


def small_level(folder: Path, name: str, **texts: str) -> TransitionSystem:
    """Return a level of the small system with other texts in some files."""
    return transition_systems(small_system(folder, **texts))[name]


def proved_level(folder: Path, name: str, **texts: str) -> tuple[TransitionSystem, LevelProof]:
    """Prove a level of the small system with other texts in some files."""
    ts = small_level(folder, name, **texts)
    return ts, prove_level(ts, LITTLE)


ORDER_AFTER_ORDER = (
    (
        "nextstate(d_state)      | pause       | done       |",
        "nextstate(d_state)      | pause       | executing  |",
    ),
    (
        "| d_state   ||                         | pause       | done       |",
        "| d_state   || nextstate(going)        | go          | executing  |",
    ),
)
"""Edits of the upper level: when the lower one is done it rests, and then gives the order again, for ever."""
_HOPED = (
    "table work assuming in_step",
    "assume never_failed monitored : status_in /= failed\ntable work assuming in_step, never_failed",
)
HOPED = without_row(small_text("upper", _HOPED), "4")
"""An upper level that assumes of the lower one that it never fails, which nobody proves."""


# --- lower levels -------------------------------------------------------------------------------


def going(line: str, *, there: str = "", on: str = "", does: str = "", status: str = "executing") -> str:
    """Return a line of table `go` for a command that is under way: its tests, its procedures, its status."""
    return f"{line} | false | going | {there} | {on} || {does} | {status}"


def lower_level(
    *lines: str,
    declared: str = "",
    seen: str = "on := false",
    begin: str = "",
    work: str = "",
    idle: str = "4 | false | d_state | | || | done",
    parts: str = "",
    after: str = "answer",
) -> str:
    """Return a lower level with these lines of table `go`, besides one that takes a command, one that rests (`idle`), and one that failed.

    Its lines test `on`, which the preprocess sets by the statements `seen`; `begin` and `work` are the statements of the
    procedures that take a command and that lines may call. `declared` are more variables, all read by the preprocess, and
    `parts` more procedures and modules; `after` is what the postprocess runs.
    """
    names = re.findall(r"^(?:state|input) (\w+)", declared, re.MULTILINE)
    failed = "f | false | f_state | | || | failed"
    rows = ("1 | true | | | || state(going); begin | executing", idle, failed, *lines)
    return LOWER.format(
        declared=declared,
        parts=parts,
        reads="".join(f", {name}" for name in names),
        writes="".join(f", {name}" for name in names if f"{name} :=" in seen),
        seen=seen,
        begin=begin,
        work=work,
        go=table("go", "line | new_command | cur_state | there | on || procedures | status_out", *rows),
        after=after,
    )


LOWER = """\
use words
input command : lower_order
input there : bool
state new_command : bool
state inc_command_seen : number
state on : bool
{declared}
state cur_state : stage
state status_report : level_status
output report : lower_report
{parts}
module receive reads command, inc_command_seen, there, on{reads} writes new_command, inc_command_seen, on{writes} {{
  new_command := command.inc_command /= inc_command_seen
  inc_command_seen := command.inc_command
  {seen}
}}
module answer reads command, inc_command_seen, status_report writes report {{
  report.inc_command_echo := inc_command_seen
  report.ref_command_echo := command.input_command
  report.status_report := status_report
}}
procedure state(value : stage) {{ cur_state := value }}
procedure executing {{ status_report := executing }}
procedure done {{ status_report := done }}
procedure failed {{ status_report := failed }}
procedure begin {{
  {begin}
}}
procedure work {{
  {work}
}}
{go}
table pause {{
  | line | when || procedures     | status_out |
  | 1    | true || state(d_state) | done       |
}}
level lower {{
  period 40 [ms]
  preprocess receive
  table by command.input_command {{ pause : pause  go : go }}
  postprocess {after}
}}
"""
WAY = (going("2", on="false", does="work"), going("3", on="true", does="state(d_state)", status="done"))
"""Lines that work until `on` is seen, and then end."""
TURNS = (going("2", on="true"), going("3", on="false"))
"""Lines of which each waits for what the other one is for."""
TICK = {"declared": "state tick : bool", "seen": "tick := not tick\n  on := tick"}
"""`on` is true in every other cycle."""


def counting(most: int) -> str:
    """Return a lower level that ends when its counter `c` has come from 0 to `most`, by one in a cycle."""
    return lower_level(
        *WAY,
        declared=f"state c : int 0 .. {most}",
        seen=f"on := c >= {most}",
        begin="c := 0",
        work=f"c := min(c + 1, {most})",
    )


# --- one level by itself ------------------------------------------------------------------------


def solo_system(folder: Path, text: str) -> Path:
    """Write a system of one level `solo` without neighbours, a project of its own; return the path of its description."""
    (folder / "rcsc.toml").write_text('name = "one"\nexclude = []\n', encoding="utf-8")
    alone = system(["solo"], name="one", generated='".rcsc-cache/g"', data='"system.toml"')
    (folder / "system.toml").write_text(alone, encoding="utf-8")
    (folder / "solo.rcs").write_text(text, encoding="utf-8")
    return folder / "system.toml"


def alone(text: str) -> TransitionSystem:
    """Return the one level of a text, whose inputs may have any value at any moment."""
    program = program_of(text)
    [level] = program.levels
    free = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT)
    return TransitionSystem(program, level, Links(level.name, None, (), (), free))
