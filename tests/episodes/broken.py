"""Executors that are broken on purpose, and the episodes that find them: `python -m tests.episodes.broken`.

Each is one known edit of the emitted C, of the emitted Python, or of both. Where one of the two is broken, they differ on the same inputs;
where both are, only properties can tell, those of the tables, of the cell, and what was proved.
"""

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from rcsc.base.host.cache import open_cache
from rcsc.driver.watched import claims_of
from rcsc.run.campaign.rig import Rig
from rcsc.run.campaign.search import search, smallest
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc.run.system import Kind
from rcsc_cell.episodes.episode import SYSTEM, Episode
from rcsc_cell.episodes.kind import CELL
from tests.support.programs.texts import edit_file

MOST = 50
"""Examples within which each is to be found."""


@dataclass(frozen=True)
class Break:
    """An edit: what stands in the C and in the Python of a level, and what is to stand there."""

    level: str
    c: tuple[str, str]
    python: tuple[str, str]


BROKEN: Mapping[str, Break] = {
    "a force of 2 N": Break(
        "gripper",
        ("s->to_hand.force_n = s->primitive.force_n + 0.0;", "s->to_hand.force_n = 2.0;"),
        ("s.to_hand_force_n = s.primitive_force_n + 0.0", "s.to_hand_force_n = 2.0"),
    ),
    "a count of 2": Break(
        "primitive",
        ("s->to_gripper.inc_command + 1u", "s->to_gripper.inc_command + 2u"),
        ("s.to_gripper_inc_command + 1)", "s.to_gripper_inc_command + 2)"),
    ),
    "a lost guard": Break(
        "primitive",
        ("if (s->answered && s->echoed) {", "if (s->answered) {"),
        ("if (s.answered and s.echoed):", "if s.answered:"),
    ),
    "a swapped member": Break(
        "gripper",
        (
            "do_done(gripper_t *s)\n{\n    s->to_primitive.status_report = VOCABULARY_LEVEL_STATUS_DONE;",
            "do_done(gripper_t *s)\n{\n    s->to_primitive.status_report = VOCABULARY_LEVEL_STATUS_FAILED;",
        ),
        ("s.to_primitive_status_report = 0\n", "s.to_primitive_status_report = 2\n"),
    ),
}


def broken_rig(
    name: str, where: Collection[Kind], plant: str, folder: Path, claims: Claims = NOTHING
) -> Rig[Episode]:
    """The cell with broken executors: its generated files, copied and edited.

    Args:
        name: Of the break.
        where: In the C, in the Python, or in both.
        plant: The cell's.
        folder: Where the files go.
        claims: What is watched of what was proved.
    """
    generated = folder / "generated"
    shutil.copytree(SYSTEM.parents[1] / "generated", generated)
    broken = BROKEN[name]
    if "c" in where:
        edit_file(generated / "c" / f"{broken.level}.c", broken.c)
    if "python" in where:
        edit_file(generated / "python" / f"{broken.level}.py", broken.python)
    return Rig(CELL, SYSTEM, plant, "both", claims=claims, generated=generated)


def main(arguments: list[str] | None = None) -> int:
    """Print for each break after how many examples it is found, what finds it, and the smallest episode that does."""
    parser = argparse.ArgumentParser(prog="python -m tests.episodes.broken", description=__doc__)
    parser.add_argument("--plant", default="mujoco")
    parser.add_argument("--examples", type=int, default=MOST)
    parser.add_argument(
        "--in", dest="where", nargs="+", choices=("c", "python"), default=["c"], help="what is broken"
    )
    parser.add_argument("--only", nargs="+", choices=tuple(BROKEN), default=list(BROKEN))
    parser.add_argument("--claims", action="store_true", help="also watch what is proved of the levels")
    asked = parser.parse_args(arguments)
    claims = claims_of(SYSTEM, open_cache(SYSTEM.parent)) if asked.claims else NOTHING
    missed = 0
    for name in asked.only:
        with tempfile.TemporaryDirectory(prefix="rcsc-broken-") as folder:
            begun = time.process_time()
            rig = broken_rig(name, asked.where, asked.plant, Path(folder), claims)
            searched = search(rig, asked.examples)
            seconds = time.process_time() - begun
            where = " and ".join(asked.where)
            if searched.falsified is None:
                missed += 1
                sys.stdout.write(
                    f"{name}, in {where}: NOT FOUND in {searched.episodes} examples, {seconds:.0f} s\n"
                )
                continue
            sys.stdout.write(
                f"{name}, in {where}: found by example {searched.episodes}, {seconds:.1f} s of the processor\n"
            )
            sys.stdout.flush()
            least, finding = smallest(rig, *searched.falsified)
            sys.stdout.write(
                f"  cycle {finding.tick}: `{finding.property}` does not hold: {finding.message}\n"
            )
            sys.stdout.writelines(f"  = note: {line}\n" for line in rig.kind.told(least))
            sys.stdout.write(f"  made small in {time.process_time() - begun - seconds:.1f} s\n")
            sys.stdout.flush()
    return missed


if __name__ == "__main__":
    sys.exit(main())
