"""Seeded bugs and the properties that catch them: `python -m tests.cell.matrix` prints which catches which.

A bug is a change to the text of a table. Where the changed table still proves, it is compiled as ever; where it does not, its executors
are made all the same, which only tests can: rcsc has no option that skips a proof.
"""

import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.code.emit import TARGETS
from rcsc.code.emit.generated import write
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.lang.model import Program
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.proof.solvers.options import Options
from rcsc.run.episodes.episode import Restart
from rcsc.run.episodes.outcome import EpisodeFinding
from rcsc_cell.episodes.episode import Episode, Interruption, SwitchTo
from rcsc_cell.episodes.loop import Loop
from tests.support import loops
from tests.support.programs.stages import emitted
from tests.support.programs.texts import one_row_a_line

REPO = Path(__file__).parents[2]
ACQUIRE = replace(loops.ACQUIRE, executor="python")
FAR = Episode(executor="python", rows=("MOVE,,,BUFFER-SAFE,",))
MOST_TICKS = 1600


@dataclass(frozen=True, slots=True)
class Bug:
    """A change, the property that is to catch it, and the episode in which it shows."""

    name: str
    property: str
    file: str
    old: str
    new: str
    episode: Episode


BUGS = (
    Bug(
        "GRASP has no line for having failed",
        "no state-table error",
        "tables/gripper/gripper.rcs",
        "  | 6    | false       | f_state   |        |               ||                              | hold        | failed     |\n",
        "",
        replace(
            ACQUIRE,
            rows=(),
            interruptions=(Interruption(1, "ACQUIRE,BOXT (2),FIX-MAC5,,"),),
            faults=(SwitchTo("hand_weak", 60, 999),),
        ),
    ),
    Bug(
        "TASK does not wait for the echo",
        "task: assumption acquire_in_step",
        "tables/task/common.rcs",
        "  next cur_state := value\n",
        "  cur_state := value\n",
        ACQUIRE,
    ),
    Bug(
        "PAUSE says done only to itself",
        "task: every command ends",
        "tables/emove/pause.rcs",
        "| pause       | done       |",
        "| pause       | executing  |",
        replace(FAR, rows=("PAUSE,,,,",)),
    ),
    Bug(
        "ACQUIRE forgets that it has failed",
        "task: failed stays failed",
        "tables/task/acquire.rcs",
        "| pause           | failed     |\n  | 15 ",
        "| pause           | executing  |\n  | 15 ",
        replace(ACQUIRE, rows=(), interruptions=(Interruption(1, "ACQUIRE,BOXT (2),,,"),)),
    ),
    Bug(
        "IMMED-GRASP is done with anything between the fingers",
        "DONE is true",
        "tables/primitive/immed_grasp.rcs",
        "|| misfit_failure; nextstate(f_state) | pause       | failed     |",
        "|| nextstate(d_state)                 |             | done       |",
        replace(ACQUIRE, rows=(), interruptions=(Interruption(1, "ACQUIRE,BOXT (2),FIX-MAC5,,"),)),
    ),
    Bug(
        "PICKUP is counted until it is echoed",
        "buffer counts",
        "tables/task/common.rcs",
        "if source_buffer and last_emove.input_command /= pickup {",
        "if source_buffer {",
        ACQUIRE,
    ),
    Bug(
        "LOC=>FAILURE says pic",
        "right reason",
        "tables/task/common.rcs",
        "  to_workstation.failure := loc\n",
        "  to_workstation.failure := pic\n",
        replace(ACQUIRE, faults=(SwitchTo("blind", 0, 99_999),)),
    ),
    Bug(
        "E-MOVE does not pass PAUSE on",
        "still after FAIL",
        "tables/emove/pause.rcs",
        "|| settle; nextstate(d_state) | pause ",
        "|| nextstate(d_state)         |       ",
        replace(FAR, restarts=(Restart(12, "task"),)),
    ),
    Bug(
        "LOCATE goes too low",
        "only allowed contact",
        "tables/emove/common.rcs",
        "object_data.grip_range_mm - from_vision.range_mm",
        "object_data.grip_range_mm - from_vision.range_mm - 30.0",
        replace(ACQUIRE, backend="mujoco", step_s=0.004),
    ),
    Bug(
        "GRASP is told too great a force",
        "grip force",
        "tables/primitive/common.rcs",
        "  to_gripper.opening_mm := 0.0\n  to_gripper.force_n := fingers.force_n\n",
        "  to_gripper.opening_mm := 0.0\n  to_gripper.force_n := min(1000.0, fingers.force_n * 1.5)\n",
        ACQUIRE,
    ),
    Bug(
        "GOTO knows no greatest speed",
        "joints within limits",
        "tables/primitive/common.rcs",
        "min(goal.speed_mm_s, speed_mm_s",
        "min(2000.0, speed_mm_s",
        FAR,
    ),
)


def project(folder: Path) -> Path:
    """A copy of tables and executors; the path of its description."""
    shutil.copytree(REPO / "tables", folder / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
    shutil.copytree(REPO / "generated", folder / "generated", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(REPO / "tables" / "rcsc.toml", folder / "tables" / "rcsc.toml")
    return folder / "tables" / "system.toml"


def seed(bug: Bug, folder: Path) -> bool:
    """Changes a project; whether its tables still prove.

    Raises:
        ValueError: The text to be changed is not there once.
    """
    path = folder / bug.file
    text = one_row_a_line(path)
    if text.count(bug.old) != 1:
        raise ValueError(f"{bug.name}: {bug.file} has the text {text.count(bug.old)} times")
    path.write_text(text.replace(bug.old, bug.new), encoding="utf-8")
    name = bug.file.split("/")[1]
    root = str(folder / "tables" / name / f"{name}.rcs")
    generated = folder / "generated"
    made = compile_(Settings((root,), Options(solver="boxes")), generated, TARGETS, only_check=False)
    if made.report.failed:
        loaded = load([root])
        program = resolve(loaded.roots[0], loaded)
        assert isinstance(program, Program), program
        write(emitted(program), str(generated))
    return not made.report.failed


def findings(bug: Bug, folder: Path) -> tuple[bool, tuple[EpisodeFinding, ...]]:
    """Whether the bug passes the proofs, and what the properties say of it until its own speaks."""
    system = project(folder)
    proved = seed(bug, folder)
    loop = Loop(bug.episode, system)
    while (
        not loop.over
        and loop.system.tick < MOST_TICKS
        and all(finding.property != bug.property for finding in loop.findings)
    ):
        loop.step()
    return proved, loop.findings


def rows() -> Iterator[tuple[Bug, bool, dict[str, EpisodeFinding]]]:
    """Each bug with what caught it."""
    for bug in BUGS:
        with tempfile.TemporaryDirectory(prefix="rcsc-matrix-") as folder:
            proved, found = findings(bug, Path(folder))
        yield bug, proved, {finding.property: finding for finding in found}


def main() -> int:
    """Prints the matrix; 1 where a bug was not caught."""
    names = [bug.property for bug in BUGS]
    for at, name in enumerate(names):
        sys.stdout.write(f"{'ABCDEFGHIJKLMNOP'[at]} {name}\n")
    missed = 0
    sys.stdout.write(f"\n{'seeded bug':54} proves  {' '.join('ABCDEFGHIJKLMNOP'[: len(names)])}\n")
    for bug, proved, found in rows():
        marks = (
            "#" if name == bug.property and name in found else "x" if name in found else "." for name in names
        )
        missed += bug.property not in found
        said = found[bug.property].message if bug.property in found else "NOT CAUGHT"
        sys.stdout.write(f"{bug.name:54} {'yes' if proved else 'no':6}  {' '.join(marks)}  {said}\n")
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main())
