"""Mutants of the prover itself: whether the tests notice a fault in the modules that a verdict rests on.

`python -m tests.prover_mutants --count 1000` draws mutants by seed from `MODULES`, runs those of `TESTS` on each that reach the mutated
function, and prints for each module how many were caught. Every survivor is shown as a diff with its reason from
`tests/data/prover_mutants.toml`: *equivalent* (no program can tell), *search* (only how long it takes, or what is found first), *shown*
(a text that people read). Exit status 1 where under 98 % of those that are not equivalent are caught, or a survivor has no reason.

mutmut makes the mutants. A test runs once by itself, in a fork, to learn which functions it enters and what it costs. Then each mutant
takes the place of its function in a fork of its own, in which everything is imported and collected, and its tests run until the first
that fails: first those that caught most of their like for their cost. A test that takes ten times as long has noticed, too. `--seconds`
is what a mutant may cost before it counts as a survivor. `--only PATTERN` draws by name (`rcsc.proof.table.boxes.*`), `--tests PATTERN`
takes some of the test files, `--ordinary` leaves out what is thorough, `--covering FILE` keeps what is learnt of the tests from run to run.
"""

import argparse
import contextlib
import difflib
import gc
import importlib
import json
import os
import resource
import signal
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from random import Random
from types import CodeType, FrameType
from typing import Any, TypeVar, cast

import libcst
import pytest
from mutmut.mutation.file_mutation import create_mutations, deep_replace

from rcsc.lang.resolve import compile_text

REPO = Path(__file__).parents[1]
REASONS = REPO / "tests" / "data" / "prover_mutants.toml"
ENOUGH = 0.98
MODULES = tuple(
    f"rcsc/{room}{name}.py"
    for room, names in {
        "lang/": "interpret interval_sets operator_table",
        "lang/over_time/": "past monitor run",
        "proof/certify/": "__init__ known owed execution settle table values",
        "proof/table/regions/": "atoms ends holes linear partition points region splitting",
        "proof/table/": "boxes confirm program relational decide",
        "proof/procedures/": "discharge invariants obligations",
        "proof/relation/": "effect",
        "proof/symbolic/": "encode evaluation execution trial values keyed measured",
        "proof/solvers/": "search smt",
        "compose/proof/": "assume_guarantee context termination level ranking system",
        "compose/contract/": "claims environment obligations properties transition watched",
        "compose/exact/": "circuit shifted",
        "compose/invariant/": "confirm",
        "compose/together/": "product proof left_open eventually played kept",
    }.items()
    for name in names.split()
)
TESTS = tuple(
    f"tests/{name}.py"
    for name in """
    table/test_checker_figures diagnostics/test_told lang/test_nodes compose/test_figures
    table/test_boxes lang/test_operators lang/test_bounds table/test_regions table/test_obligations table/test_invariants
    lang/test_interpret table/test_proofs table/test_certify table/test_verdicts table/test_stops compose/test_properties_language
    compose/test_composed_sound compose/test_composed_search compose/test_endings compose/test_standing compose/test_hierarchies
    compose/test_compose diff/test_diff
    stages/test_cycle stages/test_proof together/test_precedence together/test_same table/test_word_bits lang/test_looking_back
    compose/test_facts compose/test_protocol whole_systems/test_whole_systems
    over_time/test_templates over_time/test_past over_time/test_requirements over_time/test_assumed over_time/test_eventually
    over_time/test_published exact/test_circuit exact/test_exact exact/test_eventual
    across/test_verdicts across/test_judged across/test_left_open across/test_conforms across/test_across
    across/test_eventually across/test_needed
    """.split()
)
Key = TypeVar("Key")
Given = TypeVar("Given")
LONGEST = 6.0
"""CPU seconds for which a test is watched; one that takes longer is taken to enter what it has entered until then."""
SLOWER = 10
"""Times the usual CPU time of a test after which it has noticed the mutant."""
AGAIN = 0.6
"""How much less likely a test catches what it did not catch with other parameters."""
CAUGHT, SURVIVED, UNTESTED = "caught", "survived", "no test"
Tell = Callable[[Mapping[str, Any]], None]
"""Hands what is known so far from a fork to its parent."""
Function = str
"""A function by module and qualified name, `rcsc.proof.table.regions.partition:Gaps.grown`."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """A function with one change.

    Attributes:
        name: The function with the number of the change.
        text: The changed function, in its class if it is a method.
        gone: The lines that it changes, and `new`, into what; without indentation.
    """

    name: str
    function: Function
    text: str
    gone: tuple[str, ...]
    new: tuple[str, ...]

    @property
    def change(self) -> tuple[Function, tuple[str, ...], tuple[str, ...]]:
        """What it is known by from run to run."""
        return self.function, self.gone, self.new

    @property
    def module(self) -> str:
        return self.function.partition(":")[0]

    def put(self) -> None:
        """Changes the function where it stands, whoever holds it."""
        module = importlib.import_module(self.module)
        made: dict[str, Any] = dict(vars(module))
        future = __import__("__future__").annotations.compiler_flag  # names in annotations may be gone
        exec(compile(self.text, str(module.__file__), "exec", future), made)  # noqa: S102  # it is what is run
        old, new = (_found(names, self.function) for names in (vars(module), made))
        old.__code__, old.__defaults__, old.__kwdefaults__ = (
            new.__code__,
            new.__defaults__,
            new.__kwdefaults__,
        )


def _found(names: Mapping[str, Any], function: Function) -> Any:
    first, *rest = function.partition(":")[2].split(".")
    found = names[first]
    for name in rest:
        found = vars(found)[name]
    return getattr(found, "__func__", found)


@dataclass(frozen=True, slots=True)
class Cost:
    """What is known of a test: its CPU seconds and the functions that it enters."""

    seconds: float
    functions: frozenset[Function]


@dataclass
class Campaign:
    """Runs mutants where pytest would run tests.

    Attributes:
        draw: Gives the mutants.
        told: By mutant what became of it: `CAUGHT`, `SURVIVED` or `UNTESTED`.
        caught: How many mutants a test caught, and `tried`, how many it met, by test and function or module.
    """

    draw: Callable[[], list[Mutant]]
    jobs: int
    seconds: float
    covering: Path | None
    told: dict[Mutant, str] = field(default_factory=dict)
    caught: Counter[tuple[str, str]] = field(default_factory=Counter)
    tried: Counter[tuple[str, str]] = field(default_factory=Counter)
    failed: str = ""

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Learns what the tests cost and reach, then runs the mutants."""
        # What the forks would print of each test, and "no tests ran", is not said of this repository's tests.
        session.config.pluginmanager.unregister(name="terminalreporter")
        compile_text("input a : bool\n", "warm.rcs")  # makes the parser
        gc.freeze()
        mutants, begun = self.draw(), _spent()
        costs = self._learnt(session.items)
        items = {item.nodeid: item for item in session.items}
        print(f"{len(costs)} of {len(items)} tests learnt in {_spent() - begun:.0f} CPU seconds", flush=True)
        begun = _spent()
        runs = _forked(
            self.jobs,
            mutants,
            lambda mutant: self._order(mutant, costs),
            lambda mutant, tests, tell: self._try(
                mutant, [(items[name], costs[name]) for name in tests], tell
            ),
        )
        known = _reasons()
        for number, (mutant, tests, reply) in enumerate(runs, 1):
            self._note(mutant, tests, reply)
            if self.told[mutant] != CAUGHT:
                _show(mutant, self.told[mutant], known.get(mutant.change, ""))
            if number % 20 == 0:
                share = Counter(self.told.values())
                print(f"{number}: {dict(share)}, {(_spent() - begun) / number:.2f} CPU s each", flush=True)
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Notes that a test failed, and with what."""
        if report.failed and not self.failed:
            self.failed = report.longreprtext.strip().splitlines()[-1] or "failed"

    def _learnt(self, items: Sequence[pytest.Item]) -> dict[str, Cost]:
        """Cost and functions of each test that passes in time and enters any of the modules."""
        if self.covering and self.covering.exists():
            kept = json.loads(self.covering.read_text(encoding="utf-8"))
            return {name: Cost(seconds, frozenset(reached)) for name, (seconds, reached) in kept.items()}
        found: dict[str, Cost] = {}
        for item, _, reply in _forked(self.jobs, items, lambda _: None, self._trace):
            if reply is None or reply["failed"]:
                why = reply["failed"] if reply else "it ended the process"
                print(f"not used: {item.nodeid}: {why}", flush=True)
            elif reply["functions"]:
                found[item.nodeid] = Cost(reply["seconds"], frozenset(reply["functions"]))
        if self.covering:
            kept = {name: (cost.seconds, sorted(cost.functions)) for name, cost in found.items()}
            self.covering.write_text(json.dumps(kept), encoding="utf-8")
        return found

    def _trace(self, item: pytest.Item, _: None, tell: Tell) -> None:
        """In a fork: one test, with the functions that it enters."""
        codes: set[CodeType] = set()

        def entered(frame: FrameType, _event: str, _arg: object) -> None:
            codes.add(frame.f_code)

        modules = {str(REPO / path): _module(path) for path in MODULES}

        def told(*_: object) -> None:
            sys.settrace(None)
            places = {(modules.get(code.co_filename), code.co_qualname) for code in codes}
            reached = sorted(f"{module}:{name}" for module, name in places if module)
            tell({"failed": self.failed, "seconds": time.process_time(), "functions": reached})

        def late(*_: object) -> None:
            told()
            os._exit(0)

        signal.signal(signal.SIGPROF, late)
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        sys.settrace(entered)
        self._run(item)
        told()

    def _order(self, mutant: Mutant, costs: Mapping[str, Cost]) -> list[str]:
        """Tests that enter the function: first what catches most for its cost, and each test once before its other parameters."""
        ranks: Counter[str] = Counter()
        worth: dict[str, float] = {}
        for name in sorted(costs, key=lambda name: costs[name].seconds):
            if mutant.function in costs[name].functions:
                test = _test(name)
                caught = self.caught[test, mutant.function] + self.caught[test, mutant.module] / 4
                tried = self.tried[test, mutant.function] + self.tried[test, mutant.module] / 4
                likely = (caught + 0.3) / (tried + 1) * AGAIN ** ranks[test]
                worth[name] = likely / (costs[name].seconds + 0.1)
                ranks[test] += 1
        return sorted(worth, key=lambda name: -worth[name])

    def _try(self, mutant: Mutant, tests: Sequence[tuple[pytest.Item, Cost]], tell: Tell) -> None:
        """In a fork: the tests of a mutant until one fails."""
        mutant.put()
        for number, (item, cost) in enumerate(tests):
            tell({"reached": number, "failed": "no end"})  # what holds where the test never returns
            signal.setitimer(signal.ITIMER_PROF, SLOWER * (cost.seconds + 1))
            self._run(item)
            if self.failed:
                tell({"reached": number, "failed": self.failed})
                return
            tell({"reached": number, "failed": ""})
            if time.process_time() > self.seconds:
                return

    def _run(self, item: pytest.Item) -> None:
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)

    def _note(self, mutant: Mutant, tests: Sequence[str], reply: Mapping[str, Any] | None) -> None:
        """What became of a mutant, and what that tells of its tests."""
        if not tests or reply is None:
            self.told[mutant] = UNTESTED if not tests else CAUGHT
            return
        self.told[mutant] = CAUGHT if reply["failed"] else SURVIVED
        for number, name in enumerate(tests[: reply["reached"] + 1]):
            for place in (mutant.function, mutant.module):
                self.tried[_test(name), place] += 1
                self.caught[_test(name), place] += bool(reply["failed"] and number == reply["reached"])


def _test(name: str) -> str:
    return name.partition("[")[0]


def _forked(
    jobs: int,
    keys: Iterable[Key],
    prepare: Callable[[Key], Given],
    run: Callable[[Key, Given, Tell], None],
) -> Iterator[tuple[Key, Given, Mapping[str, Any] | None]]:
    """Runs each key in a fork, `jobs` at a time; what each told last, None where it told nothing."""
    waiting, running = iter(keys), dict[int, tuple[Key, Given, Path]]()
    with tempfile.TemporaryDirectory(
        prefix="prover-mutants-"
    ) as place:  # rcsc sweeps what is left of its own names
        for number in range(sys.maxsize):
            key = next(waiting, None) if len(running) < jobs else None
            if key is not None:
                given, path = prepare(key), Path(place) / f"{number}.json"
                running[_fork(partial(run, key, given, _writer(path)))] = key, given, path
                continue
            if not running:
                return
            pid, _ = os.wait()
            with contextlib.suppress(ProcessLookupError):
                os.killpg(pid, signal.SIGKILL)  # what it began
            key, given, path = running.pop(pid)
            if not path.parent.is_dir():
                message = f"somebody removed {place}: what was run last told nothing"
                raise FileNotFoundError(message)
            yield key, given, json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def _writer(path: Path) -> Tell:
    def tell(known: Mapping[str, Any]) -> None:
        path.with_suffix(".new").write_text(json.dumps(known), encoding="utf-8")
        path.with_suffix(".new").rename(path)

    return tell


def _fork(run: Callable[[], None]) -> int:
    """Begins a silent process that runs this and ends; its id."""
    sys.stdout.flush()
    pid = os.fork()
    if pid:
        return pid
    try:
        os.setsid()
        nowhere = os.open(os.devnull, os.O_RDWR)
        for number in range(3):
            os.dup2(nowhere, number)
        run()
    finally:
        os._exit(0)


def _spent() -> float:
    """CPU seconds of this process and of all that it waited for."""
    parts = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(part.ru_utime + part.ru_stime for part in parts)


# --- mutants ---


def _drawn(count: int, seed: int, only: str) -> list[Mutant]:
    """Mutants drawn from the modules whose names are like `only`, without those of code that types show never to run."""
    paths = [path for path in MODULES if fnmatch(_module(path), only.partition(":")[0])]
    every = [made for path in paths for made in _changes(path) if fnmatch(made[0], only)]
    drawn = Random(seed).sample(every, min(count, len(every)))
    print(f"{len(every)} mutants, {len(drawn)} drawn by seed {seed}", flush=True)
    mutants = [_mutant(*change) for change in drawn]
    return [mutant for mutant in mutants if not _unreachable(mutant)]


def _unreachable(mutant: Mutant) -> bool:
    """Whether the lines that it takes away are those that mypy keeps from being reached."""
    return any("assert_never(" in line for line in mutant.gone) and all(
        line == "case _:" or "assert_never(" in line for line in mutant.gone
    )


def _module(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _changes(path: str) -> Iterator[tuple[str, Any, str, Any]]:
    """Each change of a module: its name, what it changes, the class of the changed function."""
    text = (REPO / path).read_text(encoding="utf-8")
    module, changes, _, _ = create_mutations(path, text)
    owners = {
        id(inner): owner.name.value
        for owner in module.body
        if isinstance(owner, libcst.ClassDef)
        for inner in owner.body.body
    }
    numbers: Counter[str] = Counter()
    for change in changes:
        function = change.contained_by_top_level_function
        if isinstance(function, libcst.FunctionDef):
            owner = owners.get(id(function), "")
            name = f"{_module(path)}:{owner}{'.' * bool(owner)}{function.name.value}"
            numbers[name] += 1
            yield f"{name}:{numbers[name]}", change, owner, module


def _mutant(name: str, change: Any, owner: str, module: libcst.Module) -> Mutant:
    function = change.contained_by_top_level_function
    changed = cast("libcst.FunctionDef", deep_replace(function, change.original_node, change.mutated_node))
    before, after = (module.code_for_node(one).strip().splitlines() for one in (function, changed))
    told = list(difflib.ndiff(before, after))
    gone, new = (tuple(line[2:].strip() for line in told if line.startswith(sign)) for sign in ("- ", "+ "))
    whole: Any = changed
    if owner:
        whole = libcst.ClassDef(libcst.Name(owner), libcst.IndentedBlock([changed]))
    return Mutant(name, name.rpartition(":")[0], module.with_changes(body=[whole]).code, gone, new)


# --- what is told ---


def _reasons() -> dict[tuple[Function, tuple[str, ...], tuple[str, ...]], str]:
    """Why each known survivor is right, by function and change."""
    kept = tomllib.loads(REASONS.read_text(encoding="utf-8"))["survivor"]
    return {(one["function"], tuple(one["gone"]), tuple(one["new"])): one["reason"] for one in kept}


def _show(mutant: Mutant, state: str, reason: str) -> None:
    """A mutant that no test noticed."""
    print(f"\n{state}: {mutant.name}: {reason or 'NO REASON IS GIVEN'}")
    print("\n".join([*(f"  - {line}" for line in mutant.gone), *(f"  + {line}" for line in mutant.new)]))


def _tell(told: Mapping[Mutant, str]) -> int:
    """The table; the exit status."""
    by_module = Counter((mutant.module, state) for mutant, state in told.items())
    for module in sorted({module for module, _ in by_module}):
        row = "".join(f"{by_module[module, state]:9}" for state in (CAUGHT, SURVIVED, UNTESTED))
        print(f"{module:34}{row}")
    known = _reasons()
    reasons = [known.get(mutant.change, "") for mutant, state in told.items() if state != CAUGHT]
    equal, unsaid = sum(reason.startswith("equivalent") for reason in reasons), reasons.count("")
    caught = len(told) - len(reasons)
    share = caught / max(1, len(told) - equal)
    print(
        f"\n{len(told)} mutants, {caught} caught, {equal} equivalent: {share:.1%}; {unsaid} survivors without a reason"
    )
    return 0 if share >= ENOUGH and not unsaid else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--only", default="*", metavar="PATTERN")
    parser.add_argument("--tests", default="*", metavar="PATTERN")
    parser.add_argument("--ordinary", action="store_true")
    parser.add_argument("--covering", type=Path, default=None, metavar="FILE")
    return parser.parse_args()


def main() -> int:
    """Draws, runs, and says what was not noticed."""
    asked = _arguments()
    tests = [str(REPO / name) for name in TESTS if fnmatch(name, asked.tests)]
    campaign = Campaign(
        lambda: _drawn(asked.count, asked.seed, asked.only), asked.jobs, asked.seconds, asked.covering
    )
    options = ["-q", "--no-header", "--no-summary", "-p", "no:cacheprovider", "-p", "no:unraisableexception"]
    if asked.ordinary:
        options += ["-m", "not thorough"]
    status = pytest.main([*options, f"--rootdir={REPO}", *tests], plugins=[campaign])
    if not campaign.told:
        print(f"nothing was run: no mutant is like {asked.only}, or no test (pytest ends with {status})")
        return 2
    return _tell(campaign.told)


if __name__ == "__main__":
    sys.exit(main())
