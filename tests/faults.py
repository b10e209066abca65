"""Seeded faults and who catches them: the proof of each table, the proof of the levels together, and short episodes of the cell.

`python -m tests.faults` prints, for each kind of fault, how many are caught by which and by whom alone; `--list` names each. What was found
of a fault is kept in a folder by content, so that a run which is stopped goes on, and one after a change to a table asks only what is new.

- *check*: `rcsc check` of the level's program fails.
- *compose*: an obligation of the level in its environment is not proved (`prove_level`) which is proved of the shipped one, or which that
has not;
  or a command is not shown to end, or a line never reached, of which the shipped one has the contrary; or one of a level below that may
  assume less than before.
- *campaign*: in three kinematic episodes, with an interruption, a weak hand and a restart among them, a property does not hold. The
  executors are made by force, since most faults do not prove.
"""

import argparse
import hashlib
import json
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice
from multiprocessing import get_context
from pathlib import Path

from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.code.emit.generated import write
from rcsc.compose.contract.obligations import Obligation, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import LevelProof, prove_level
from rcsc.compose.proof.system import NoProgramError, transition_systems
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.lang.model import Program
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.proof.solvers.options import Options
from rcsc.run.episodes.episode import Restart
from rcsc_cell.episodes.episode import Episode, Interruption, SwitchTo
from rcsc_cell.episodes.loop import Loop
from tests.cell.matrix import ACQUIRE, project
from tests.support.faults_made import LEVELS, Fault, sample
from tests.support.programs.stages import emitted

REPO = Path(__file__).parents[1]
CACHE = REPO / "tables" / ".rcsc-cache" / "faults"
EFFORT = Effort()
MOST_TICKS = 1600
EPISODES: tuple[Episode, ...] = (
    ACQUIRE,
    replace(
        ACQUIRE,
        rows=("ACQUIRE,BOXT (2),BUFFER,,", "MOVE,,,BUFFER-SAFE,"),
        interruptions=(Interruption(40, "PAUSE,,,,"), Interruption(43, "ACQUIRE,BOXT (2),BUFFER,,")),
        restarts=(Restart(110, "emove"), Restart(150, "primitive")),
    ),
    replace(
        ACQUIRE,
        rows=(),
        interruptions=(Interruption(1, "ACQUIRE,BOXT (2),FIX-MAC5,,"),),
        faults=(SwitchTo("hand_weak", 60, 999),),
    ),
)
"""A part is fetched; the same, interrupted, and with levels that begin anew; and none is there to be gripped."""
PROVER = ("rcsc/proof/solvers", "rcsc/proof/symbolic", "rcsc/proof/procedures", "rcsc/proof/table")
READ_BY: Mapping[str, tuple[str, ...]] = {
    "check": ("rcsc/lang", *PROVER, "rcsc/driver"),
    "compose": ("rcsc/lang", *PROVER, "rcsc/compose"),
    "campaign": ("rcsc/lang", "rcsc/code/emit", "rcsc/run", "rcsc/run/episodes", "sim"),
}
"""Folders of rcsc on which an answer rests, besides the tables."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Whether somebody caught a fault, and how."""

    caught: bool
    how: str = ""


@dataclass(frozen=True, slots=True)
class Judged:
    """A fault with everybody's answer."""

    fault: Fault
    answers: Mapping[str, Answer]

    @property
    def catchers(self) -> tuple[str, ...]:
        return tuple(name for name, answer in self.answers.items() if answer.caught)


# --- who catches ----------------------------------------------------------------------------------


def tables_with(fault: Fault | None, folder: Path) -> Path:
    """A copy of the tables with the fault; the path of the description."""
    shutil.copytree(REPO / "tables", folder, ignore=shutil.ignore_patterns(".rcsc-cache"), dirs_exist_ok=True)
    if fault is not None:
        (folder / fault.file).write_text(fault.text, encoding="utf-8")
    return folder / "system.toml"


def program_with(fault: Fault, folder: Path) -> Program | None:
    """The program of the level with the fault; None where it does not resolve."""
    loaded = load([str(folder / fault.level / f"{fault.level}.rcs")])
    program = resolve(loaded.roots[0], loaded)
    return program if isinstance(program, Program) and not loaded.diagnostics else None


def resolves(fault: Fault) -> bool:
    """Whether the compiler takes it for a program at all, and another one than before."""
    with tempfile.TemporaryDirectory(prefix="rcsc-fault-") as name:
        tables_with(fault, Path(name))
        return program_with(fault, Path(name)) is not None


def by_check(fault: Fault) -> Answer:
    """The single tables and procedures."""
    with tempfile.TemporaryDirectory(prefix="rcsc-fault-") as name:
        tables_with(fault, Path(name))
        root = str(Path(name) / fault.level / f"{fault.level}.rcs")
        report = check(Settings((root,), Options(solver="boxes"), use_cache=False))
        codes = Counter(
            finding.code.value for finding in report.diagnostics if finding.severity is Severity.ERROR
        )
        return Answer(report.failed, ", ".join(codes) if report.failed else "")


def by_compose(fault: Fault, sound: Mapping[str, "Standing"]) -> Answer:
    """The levels that are other than the shipped ones, in their environment."""
    with tempfile.TemporaryDirectory(prefix="rcsc-fault-") as name:
        made = transition_systems(tables_with(fault, Path(name)))
    lost = []
    for level, before in sound.items():
        if level == fault.level or repr(made[level].links) != before.links:
            now = standing(made[level], prove_level(made[level], EFFORT), before.needed)
            lost += [f"{level}: {obligation}" for obligation in sorted(now.open - before.open)]
    return Answer(bool(lost), "; ".join(lost[:3]))


def by_campaign(fault: Fault) -> Answer:
    """Episodes of the cell, watched by every property."""
    with tempfile.TemporaryDirectory(prefix="rcsc-fault-") as name:
        system = project(Path(name))
        (system.parent / fault.file).write_text(fault.text, encoding="utf-8")
        program = program_with(fault, system.parent)
        assert program is not None
        write(emitted(program), str(system.parent.parent / "generated"))
        for number, episode in enumerate(EPISODES, 1):
            loop = Loop(replace(episode, executor="python"), system)
            while not loop.over and not loop.findings and loop.system.tick < MOST_TICKS:
                loop.step()
            if loop.findings:
                return Answer(True, f"episode {number}: {loop.findings[0].property}")
    return Answer(False)


# --- what is proved of the shipped levels -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Standing:
    """What is proved of a level, in words.

    Attributes:
        open: Obligations that are not proved; of fields that are not numbered only those that a level below counts on (`needed`);
        commands that
            are not shown to end; lines that are never reached.
        links: What its environment is, to see whether it changed.
    """

    open: frozenset[str]
    links: str
    needed: frozenset[str]


def standing(ts: TransitionSystem, proof: LevelProof, needed: frozenset[str]) -> Standing:
    """What a proof leaves open."""
    left = frozenset(
        _words(obligation)
        for obligation in proof.open
        if obligation.sort is not Sort.NUMBERED or obligation.name in needed
    )
    endless = frozenset(f"{ending.table}: the command ends" for ending in proof.endings if not ending.proved)
    seen = proof.context.unreached if proof.context is not None else ()
    unreached = frozenset(f"{table}: line {line} is reached" for table, line in seen)
    return Standing(left | endless | unreached, repr(ts.links), needed)


def _words(obligation: Obligation) -> str:
    return f"{obligation.table}: {obligation.shown}" if obligation.table else obligation.shown


def shipped(levels: Iterable[str]) -> dict[str, Standing]:
    """What is proved of the shipped levels."""
    made = transition_systems(REPO / "tables" / "system.toml")
    return {
        level: standing(made[level], prove_level(made[level], EFFORT), _needed(made, level))
        for level in levels
    }


def _needed(made: Mapping[str, TransitionSystem], level: str) -> frozenset[str]:
    """The fields of the level's orders of which a level below assumes that they are numbered."""
    found = set()
    for below in made[level].links.below:
        above = None if below.outside else made[below.name].links.above
        if above is not None:
            found |= {below.order + leaf.removeprefix(above.order) for leaf in above.numbered}
    return frozenset(found)


# --- answers are kept -------------------------------------------------------------------------------


def _digest(*parts: bytes) -> str:
    found = hashlib.blake2b(digest_size=16)
    for part in parts:
        found.update(len(part).to_bytes(8, "little") + part)
    return found.hexdigest()


def ground(name: str) -> str:
    """A digest of what an answer rests on: the code that gives it, the shipped tables, and how they are asked."""
    code = sorted(path for folder in READ_BY[name] for path in (REPO / folder).rglob("*.py"))
    tables = sorted(path for level in LEVELS for path in (REPO / "tables" / level).glob("*.rcs"))
    how = {"check": "", "compose": f"open goals, {EFFORT!r}", "campaign": repr(EPISODES)}[name]
    return _digest(how.encode(), *(path.read_bytes() for path in (*code, *tables)))


@dataclass(frozen=True, slots=True)
class Kept:
    """Answers in a folder, by what they rest on."""

    folder: Path

    def answer(self, name: str, on: str, fault: Fault, ask: Callable[[], Answer]) -> Answer:
        """The kept answer, or a new one."""
        path = (
            self.folder
            / f"{_digest(name.encode(), on.encode(), fault.file.encode(), fault.text.encode())}.json"
        )
        if path.is_file():
            said = json.loads(path.read_text(encoding="utf-8"))
            return Answer(bool(said["caught"]), str(said["how"]))
        answer = ask()
        self.folder.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"caught": answer.caught, "how": answer.how}), encoding="utf-8")
        return answer


@dataclass(frozen=True, slots=True)
class Court:
    """Who is asked, and what is known before."""

    kept: Kept
    sound: Mapping[str, Standing]
    grounds: Mapping[str, str]

    def judged(self, fault: Fault) -> Judged:
        """Everybody's answer."""
        answers = {}
        for name in self.grounds:
            ask = {"check": _checked, "compose": self._composed, "campaign": _campaigned}[name]
            answers[name] = self.kept.answer(name, self.grounds[name], fault, lambda ask=ask: ask(fault))  # type: ignore[misc]
        return Judged(fault, answers)

    def _composed(self, fault: Fault) -> Answer:
        try:
            return by_compose(fault, self.sound)
        except NoProgramError as error:
            return Answer(True, f"refused: {error}")
        except Exception as error:  # noqa: BLE001  # it supposes what `rcsc check` proves: a local that is never assigned, say
            return Answer(False, f"could not be asked: {type(error).__name__}: {error}")


def _checked(fault: Fault) -> Answer:
    return by_check(fault)


def _campaigned(fault: Fault) -> Answer:
    try:
        return by_campaign(fault)
    except Exception as error:  # noqa: BLE001  # whatever a faulty executor does to the cell, it shows
        return Answer(True, f"{type(error).__name__}: {error}")


# --- the command ------------------------------------------------------------------------------------


def chosen(levels: Iterable[str], seed: int, each: int) -> list[Fault]:
    """The first faults of each level's sample that resolve."""
    found = []
    for level in levels:
        made = (fault for fault in sample(REPO / "tables", level, seed) if resolves(fault))
        found += list(islice(made, each))
    return found


def matrix(judged: Iterable[Judged], names: tuple[str, ...]) -> Iterator[str]:
    """The table, a line a kind, and who alone caught what."""
    by_kind: dict[str, list[Judged]] = {}
    for verdict in judged:
        by_kind.setdefault(verdict.fault.kind, []).append(verdict)
    everything = [verdict for many in by_kind.values() for verdict in many]
    head = "".join(f"{name:>10}{'alone':>7}" for name in names)
    yield f"{'seeded fault':32}{'many':>5}{head}{'nobody':>8}"
    for kind, many in [*sorted(by_kind.items()), ("all", everything)]:
        caught = Counter(name for verdict in many for name in verdict.catchers)
        alone = Counter(verdict.catchers[0] for verdict in many if len(verdict.catchers) == 1)
        cells = "".join(f"{caught[name]:>10}{alone[name]:>7}" for name in names)
        yield f"{kind:32}{len(many):>5}{cells}{sum(not verdict.catchers for verdict in many):>8}"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("--levels", nargs="+", choices=LEVELS, default=list(LEVELS))
    parser.add_argument("--each", type=int, default=50, help="faults of each level")
    parser.add_argument("--seed", type=int, default=1984)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--ask", nargs="+", choices=tuple(READ_BY), default=list(READ_BY))
    parser.add_argument("--cache", type=Path, default=CACHE)
    parser.add_argument("--list", action="store_true", help="name each fault, and how it was caught")
    asked = parser.parse_args(arguments)
    names = tuple(asked.ask)
    sound = shipped(asked.levels) if "compose" in names else {}
    court = Court(Kept(asked.cache), sound, {name: ground(name) for name in names})
    judged = []
    for verdict in _each(court, chosen(asked.levels, asked.seed, asked.each), asked.jobs):
        judged.append(verdict)
        if asked.list:
            how = "; ".join(f"{name}: {verdict.answers[name].how}" for name in verdict.catchers) or "NOBODY"
            sys.stdout.write(f"{verdict.fault.kind}: {verdict.fault.shown}\n    {how}\n")
            sys.stdout.flush()
    sys.stdout.write("\n".join(matrix(judged, names)) + "\n")
    return 0


def _each(court: Court, faults: list[Fault], jobs: int) -> Iterator[Judged]:
    if jobs == 1:
        yield from map(court.judged, faults)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield from pool.map(court.judged, faults)


if __name__ == "__main__":
    sys.exit(main())
