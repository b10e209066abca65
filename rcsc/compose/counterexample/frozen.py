"""Frozen cases: findings in JSON that are run again on later tables.

In: a finding. Out: its text; and back: whether the same inputs break the same obligation now. A case names values in the tables' words,
and only those that change, so that it outlives changes that do not concern it.

A case expects `kept` if it records a fault that is to be mended (it fails until then), and `broken` if it shows a hazard that is to
stay visible: that of another rule than the language's, or of a published table.
"""

import json
import math
import os
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.names import shown
from rcsc.base.host.files.read import content, json_of
from rcsc.compose.contract.given import ExternAnswer
from rcsc.compose.contract.obligations import Obligation, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.variants import VARIANTS
from rcsc.compose.counterexample.cycle_run import CycleRun, broken, one_cycle
from rcsc.compose.counterexample.finding import Finding
from rcsc.compose.counterexample.lasso import lasso_of, waiting_lasso_of
from rcsc.compose.counterexample.pair import exchange
from rcsc.compose.proof.eventually import waiting
from rcsc.compose.proof.system import NoProgramError, transition_systems
from rcsc.lang.interpret import initial
from rcsc.lang.model import Program, Scalar, Value, spell, value_of_text
from rcsc.lang.project import project_root
from rcsc.proof.symbolic import values
from rcsc.run.description import BadDescription

FORMAT = 1


class BadCaseError(CodedError):
    """A case cannot be read, or names what the tables do not have."""

    code = Code.BAD_CASE


@dataclass(frozen=True, slots=True)
class FrozenCase:
    """A case as it is written.

    Attributes:
        system: The description's path.
        variants: The other rules that it is run under (`variants.VARIANTS`).
        level: The level that owes the obligation, given by sort, table, name and lines.
        start: For each level the leaves that do not begin with their initial values.
        ticks: For each tick, for each level that runs, the inputs that change; `answers`, the results of its extern procedures.
    """

    system: Path
    variants: tuple[str, ...]
    level: str
    obligation: Obligation
    start: Mapping[str, Mapping[str, str]]
    ticks: tuple[Mapping[str, Mapping[str, str]], ...]
    expects_broken: bool
    answers: tuple[Mapping[str, Sequence[Any]], ...] = ()


def frozen(
    finding: Finding,
    systems: Mapping[str, TransitionSystem],
    system: Path,
    case: Path,
    variants: tuple[str, ...] = (),
) -> str:
    """Write the text of the case that will stand at `case`."""
    obligation = finding.obligation
    exchanged = exchange(systems, finding.levels)
    document = {
        "format": FORMAT,
        "system": os.path.relpath(system, case.parent).replace("\\", "/"),
        "variants": list(variants),
        "expect": "broken" if variants else "kept",
        "goal": {
            "level": finding.level,
            "what": obligation.sort.name.lower(),
            "table": obligation.table,
            "name": obligation.name,
            "lines": list(obligation.lines),
        },
        "start": {
            name: begun
            for name in finding.levels
            if (begun := _not_initial(systems[name], finding.start(name)))
        },
        "ticks": [
            {name: _changed(systems[name], step, exchanged[name]) for name, step in steps.items()}
            for steps in finding.ticks
        ],
    }
    if any(step.answers for steps in finding.ticks for step in steps.values()):
        document["answers"] = [
            {
                name: [[procedure, list(map(_number, given))] for procedure, given in step.answers]
                for name, step in steps.items()
            }
            for steps in finding.ticks
        ]
    return json.dumps(document, indent=1) + "\n"


def _number(value: Value) -> Value | str:
    """Return an extern result as a JSON value; infinities and NaN in words."""
    return value if isinstance(value, bool | int) or math.isfinite(value) else str(value)


def _not_initial(ts: TransitionSystem, start: Mapping[str, Value]) -> dict[str, str]:
    begun = initial(ts.program)
    return {name: spell(ts.kinds[name], start[name]) for name in begun if begun[name] != start[name]}


def _changed(ts: TransitionSystem, step: CycleRun, exchanged: Container[str]) -> dict[str, str]:
    """Spell the inputs that change, except those that another level of the run gives."""
    return {
        name: spell(ts.kinds[name], value)
        for name, value in step.taken.items()
        if step.before[name] != value and name not in exchanged
    }


# --- back ----------------------------------------------------------------------------------


def read_case(path: Path) -> FrozenCase:
    """Read a case.

    Raises:
        BadCaseError: The file is no case.
    """
    try:
        document: dict[str, Any] = json_of(content(path))
        if document["format"] != FORMAT:
            raise BadCaseError(f"`{path}` has format {document['format']}, not {FORMAT}")
        about = document["goal"]
        level, table, name = _texts([about[key] for key in ("level", "table", "name")])
        sort, lines = Sort[about["what"].upper()], _texts(about["lines"])
        return FrozenCase(
            _system(path, document["system"]),
            _texts(document["variants"]),
            level,
            Obligation(sort, table, name, values.TRUE, lines),
            _leaves(document["start"]),
            tuple(map(_leaves, document["ticks"])),
            {"broken": True, "kept": False}[document["expect"]],
            tuple(map(_answered, document.get("answers", ()))),
        )
    except OSError as error:
        raise BadCaseError(f"`{path}` cannot be read: {error.strerror}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BadCaseError(f"`{path}` is no frozen finding: {error}") from error


def _texts(value: object) -> tuple[str, ...]:
    """Check a list of texts; raise ValueError for anything else."""
    if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
        raise ValueError("a list holds something else than texts")
    return tuple(value)


def _leaves(by_level: object) -> dict[str, dict[str, str]]:
    """Check the texts of leaves by level; raise ValueError for anything else."""
    if not isinstance(by_level, dict) or not all(isinstance(texts, dict) for texts in by_level.values()):
        raise ValueError("a tick is no table of levels")
    return {
        level: dict(zip(leaves, _texts(list(leaves.values())), strict=True))
        for level, leaves in by_level.items()
    }


def _answered(by_level: object) -> dict[str, list[tuple[str, list[Any]]]]:
    """Check the extern procedures called in a tick, by level, with their results; raise TypeError for anything else."""
    if not isinstance(by_level, dict):
        raise TypeError("the answers of a tick are no table of levels")
    answers: dict[str, list[tuple[str, list[Any]]]] = {}
    for level, several in by_level.items():
        for procedure, given in several:
            if not isinstance(procedure, str) or not isinstance(given, list):
                raise TypeError("an answer is no procedure and what it gives")
            answers.setdefault(level, []).append((procedure, given))
    return answers


def _system(case: Path, named: object) -> Path:
    """Find the description that a case is about, inside its project or the current folder.

    Raises:
        ValueError: It leads elsewhere.
    """
    if not isinstance(named, str) or os.path.isabs(named) or not named.isprintable():
        raise ValueError(f"{shown(named)} is no relative path")
    target = (case.parent / named).resolve()
    trusted = (Path.cwd(), Path(project_root(str(case))).resolve())
    if not any(target.is_relative_to(folder) for folder in trusted):
        raise ValueError(f"the system {shown(named)} is outside this project")
    return case.parent / named


def case_breaks(case: FrozenCase) -> bool:
    """Return whether a tick of the case breaks the obligation; a fault ends the run.

    Raises:
        BadCaseError: The case names what the tables do not have.
    """
    systems = _systems(case)
    now = {name: _begun(ts, case.start.get(name, {})) for name, ts in systems.items()}
    exchanged = exchange(systems, tuple(systems))
    given = {name: {leaf: now[name][leaf] for leaf in leaves} for name, leaves in exchanged.items()}
    so_far: list[CycleRun] = []
    found: dict[str, Mapping[str, Value]] = {}
    answers = (*case.answers, *({} for _ in case.ticks[len(case.answers) :]))
    for tick, answered in zip(case.ticks, answers, strict=False):
        steps = {}
        for name, changed in tick.items():
            taken = _taken(systems[name], now[name], changed) | given[name]
            results = tuple(_answer(systems[name], answer) for answer in answered.get(name, ()))
            steps[name] = one_cycle(systems[name], now[name], taken, results, found.get(name))
        found |= {name: step.left for name, step in steps.items()}
        now |= {name: dict(step.after) for name, step in steps.items()}
        for name, leaves in exchanged.items():
            given[name] |= {leaf: now[of][source] for leaf, (of, source) in leaves.items() if of in steps}
        if case.level in steps:
            so_far.append(steps[case.level])
            if _is_broken(systems, case, so_far):
                return True
        if any(step.ends_the_run for step in steps.values()):
            return False
    return False


def _answer(ts: TransitionSystem, written: Any) -> ExternAnswer:
    """Read the results of one call."""
    try:
        name, results = written
        procedure = next(each for each in ts.program.procedures if each.name == name and each.extern)
        given = tuple(float(result) if isinstance(result, str) else result for result in results)
        if len(given) == len(procedure.writes) and all(
            isinstance(value, bool | int | float) for value in given
        ):
            return str(name), given
    except (TypeError, ValueError, StopIteration):
        pass
    raise BadCaseError(f"level `{ts.level.name}` has no extern procedure that gives `{written}`")


def _systems(case: FrozenCase) -> dict[str, TransitionSystem]:
    try:
        systems = transition_systems(case.system)
        change: list[Callable[[Program], Program]] = [VARIANTS[name] for name in case.variants]
    except (BadDescription, NoProgramError) as error:
        raise BadCaseError(str(error)) from error
    except KeyError as error:
        raise BadCaseError(f"there is no rule {error}") from error
    names = {case.level, *case.start, *(name for tick in case.ticks for name in tick)}
    if unknown := sorted(names - systems.keys()):
        raise BadCaseError(f"there is no level `{unknown[0]}`")
    systems = {name: ts for name, ts in systems.items() if name in names}
    for variant in change:
        systems = {name: ts.of(variant(ts.program)) for name, ts in systems.items()}
    return systems


def _begun(ts: TransitionSystem, texts: Mapping[str, str]) -> dict[str, Value]:
    return {**initial(ts.program), **_values(ts, texts)}


def _taken(ts: TransitionSystem, now: Mapping[str, Value], texts: Mapping[str, str]) -> dict[str, Value]:
    if wrong := sorted(texts.keys() - set(ts.inputs)):
        raise BadCaseError(f"level `{ts.level.name}` has no input `{wrong[0]}`")
    return {name: now[name] for name in ts.inputs} | _values(ts, texts)


def _values(ts: TransitionSystem, texts: Mapping[str, str]) -> dict[str, Value]:
    leaves = {}
    for name, text in texts.items():
        if name not in ts.kinds:
            raise BadCaseError(f"level `{ts.level.name}` has no variable `{name}`")
        leaves[name] = _value(name, ts.kinds[name], text)
    return leaves


def _value(name: str, kind: Scalar, text: str) -> Value:
    """Read a value as `spell` writes it."""
    value = value_of_text(kind, text)
    if value is None:
        raise BadCaseError(f"`{name}` cannot be `{text}`")
    return value


def _is_broken(systems: Mapping[str, TransitionSystem], case: FrozenCase, steps: list[CycleRun]) -> bool:
    """Return whether the last of the level's cycles breaks the obligation."""
    ts, step = systems[case.level], steps[-1]
    if case.obligation.sort is Sort.ENDS:
        return lasso_of(ts, case.obligation.table, steps) is not None
    try:
        if broken(ts, case.obligation, step):
            return True
        if case.obligation.sort is not Sort.REQUIREMENT or case.obligation.name not in waiting(ts):
            return False
        return waiting_lasso_of(ts, case.obligation.name, steps) is not None
    except StopIteration as error:
        raise BadCaseError(f"level `{case.level}` has no goal `{case.obligation.shown}`") from error
