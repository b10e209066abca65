"""Mutants of the prover itself: whether the tests notice a fault in the modules that a verdict rests on.

`python -m tests.prover_mutants --count 1000` draws mutants by seed from `MODULES`, runs those of `TESTS` on each that reach the mutated
function, and prints for each module how many were caught. Every survivor is shown as a diff with its reason from
`tests/data/prover_mutants.toml`: *equivalent* (no program can tell), *search* (only how long it takes, or what is found first), *shown*
(a text that people read). Exit status 1 where under 95 % of those that are not equivalent are caught, or a survivor has no reason.

mutmut makes the mutants and runs them, in a copy of the repository. `--only PATTERN` draws from some modules, `--tests PATTERN` runs some
tests, which is less work; `--keep DIR` keeps the copy, in which `mutmut show` and `mutmut run NAME` repeat one.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from random import Random

REPO = Path(__file__).parents[1]
REASONS = REPO / "tests" / "data" / "prover_mutants.toml"
ENOUGH = 0.95
MODULES = tuple(
    """
    rcsc/interpret.py rcsc/certify.py
    rcsc/prove/atoms.py rcsc/prove/boxes.py rcsc/prove/boxleaf.py rcsc/prove/confirm.py rcsc/prove/discharge.py
    rcsc/prove/effect.py rcsc/prove/encode.py rcsc/prove/evaluation.py rcsc/prove/invariants.py rcsc/prove/linear.py
    rcsc/prove/obligations.py rcsc/prove/program.py rcsc/prove/regions.py rcsc/prove/relational.py rcsc/prove/search.py
    rcsc/prove/smt.py rcsc/prove/symbolic.py rcsc/prove/table.py rcsc/prove/trial.py rcsc/prove/values.py
    rcsc/compose/agreed.py rcsc/compose/confirm.py rcsc/compose/context.py rcsc/compose/contract.py rcsc/compose/ends.py
    rcsc/compose/goals.py rcsc/compose/keyed.py rcsc/compose/level.py rcsc/compose/measured.py rcsc/compose/properties.py
    rcsc/compose/rounds.py rcsc/compose/system.py rcsc/compose/transition.py
    """.split()
)
TESTS = tuple(
    f"tests/test_{name}.py"
    for name in """
    boxes operators bounds regions obligations invariants interpret proofs certify properties_language composed_sound
    composed_search endings standing hierarchies
    """.split()
)
COPIED = ("grammar", "tables", "generated", "sim", "README.md", ".ci", ".pre-commit-hooks.yaml", "LICENSE")
CAUGHT, SURVIVED, UNTESTED = "caught", "survived", "no test"
_STATES: Mapping[int | None, str] = {0: SURVIVED, 33: UNTESTED}
"""Of mutmut's exit codes; a test that fails, a time-out and a crash are noticed."""


@dataclass(frozen=True, slots=True)
class Survivor:
    """A mutant that no test noticed.

    Attributes:
        name: mutmut's, whose last number may change with the function.
        gone: The lines of the function that it changes, and `new`, into what; without indentation.
        reason: Why that is right; empty where nobody has said it.
    """

    name: str
    state: str
    gone: tuple[str, ...]
    new: tuple[str, ...]
    reason: str

    @property
    def function(self) -> str:
        """The mutated function, by its module."""
        return self.name.rpartition("__mutmut_")[0]


def main() -> int:
    """Draws, runs, and says what was not noticed."""
    asked = _arguments()
    modules = [name for name in MODULES if fnmatch(name, asked.only)]
    if not modules:
        print(f"no module is like {asked.only}")
        return 2
    with tempfile.TemporaryDirectory() as scratch:
        place = asked.keep or Path(scratch) / "rcsc"
        _copy(place, modules, [name for name in TESTS if fnmatch(name, asked.tests)])
        _mutmut(place, asked.jobs, ("nothing.of.this.name",))
        drawn = Random(asked.seed).sample(names := _names(place), min(asked.count, len(names)))
        print(
            f"{len(names)} mutants of {len(modules)} modules, {len(drawn)} drawn by seed {asked.seed}",
            flush=True,
        )
        _mutmut(place, asked.jobs, drawn)
        states = {
            name: _STATES.get(code, CAUGHT) for name, code in _codes(place).items() if name in set(drawn)
        }
        survivors = [_survivor(place, name, state) for name, state in states.items() if state != CAUGHT]
    return _tell(states, survivors)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="*", metavar="PATTERN")
    parser.add_argument("--tests", default="*", metavar="PATTERN")
    parser.add_argument("--keep", type=Path, default=None, metavar="DIR")
    return parser.parse_args()


def _copy(place: Path, modules: Sequence[str], tests: Sequence[str]) -> None:
    """The files that git knows, with mutmut told what to mutate."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=REPO, capture_output=True, check=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        target = place / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(REPO / name, target)
    settings = {
        "source_paths": ["rcsc"],
        "only_mutate": list(modules),
        "also_copy": list(COPIED),
        "pytest_add_cli_args_test_selection": list(tests),
        "pytest_add_cli_args": ["-p", "no:cacheprovider", "--timeout=900"],
    }
    with (place / "pyproject.toml").open("a", encoding="utf-8") as file:
        file.write("\n[tool.mutmut]\n")
        file.writelines(f"{key} = {json.dumps(value)}\n" for key, value in settings.items())


def _mutmut(place: Path, jobs: int, names: Iterable[str]) -> None:
    """Has mutmut make the mutants, where there are none yet, and run these."""
    subprocess.run(
        [sys.executable, "-m", "mutmut", "run", "--max-children", f"{jobs}", *names],
        cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False,
    )  # fmt: skip  # it fails where no name is known, which makes the mutants all the same


def _codes(place: Path) -> dict[str, int | None]:
    """By mutant mutmut's exit code; None where it was not run."""
    found: dict[str, int | None] = {}
    for kept in sorted((place / "mutants" / "rcsc").rglob("*.meta")):
        found |= json.loads(kept.read_text(encoding="utf-8"))["exit_code_by_key"]
    return found


def _names(place: Path) -> list[str]:
    return sorted(_codes(place))


def _survivor(place: Path, name: str, state: str) -> Survivor:
    shown = subprocess.run(
        [sys.executable, "-m", "mutmut", "show", name], cwd=place, capture_output=True, text=True, check=True
    )
    lines = [line for line in shown.stdout.splitlines() if not line.startswith(("---", "+++", "#", "@@"))]
    gone, new = (tuple(line[1:].strip() for line in lines if line.startswith(sign)) for sign in ("-", "+"))
    return Survivor(name, state, gone, new, _reasons().get((name.rpartition("__mutmut_")[0], gone, new), ""))


def _reasons() -> dict[tuple[str, tuple[str, ...], tuple[str, ...]], str]:
    """Why each known survivor is right, by function and change."""
    kept = tomllib.loads(REASONS.read_text(encoding="utf-8"))["survivor"]
    return {(one["function"], tuple(one["gone"]), tuple(one["new"])): one["reason"] for one in kept}


def _tell(states: Mapping[str, str], survivors: Sequence[Survivor]) -> int:
    """The table, and each survivor; the exit status."""
    by_module = Counter((name.rsplit(".x", 1)[0], state) for name, state in states.items())
    for module in sorted({module for module, _ in by_module}):
        row = "".join(f"{by_module[module, state]:9}" for state in (CAUGHT, SURVIVED, UNTESTED))
        print(f"{module:34}{row}")
    for one in survivors:
        print(f"\n{one.state}: {one.name}: {one.reason or 'NO REASON IS GIVEN'}")
        print("\n".join([*(f"  - {line}" for line in one.gone), *(f"  + {line}" for line in one.new)]))
    equal = sum(one.reason.startswith("equivalent") for one in survivors)
    caught = sum(state == CAUGHT for state in states.values())
    share = caught / max(1, len(states) - equal)
    unsaid = sum(not one.reason for one in survivors)
    print(
        f"\n{len(states)} mutants, {caught} caught, {equal} equivalent: {share:.1%}; {unsaid} survivors without a reason"
    )
    return 0 if share >= ENOUGH and not unsaid else 1


if __name__ == "__main__":
    sys.exit(main())
