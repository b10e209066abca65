"""Keep a finding in its log: what the run breaks, and what of it no level's state holds.

In: a `LoggedFinding`. Out: its text, a metadata record of the log; and back. The log of a run in the cell has none.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rcsc.base.host.files.read import json_of
from rcsc.run.signature import Value

FINDING = "rcsc.finding"
"""Name of the metadata record."""


@dataclass(frozen=True, slots=True)
class LoggedCycle:
    """One cycle of one level.

    Attributes:
        matched: Every line that matched, DEFAULT left out; a state tells one at the most.
        wrong: What went wrong in it; empty for nothing.
        answers: What each call of an extern procedure gave.
    """

    matched: tuple[str, ...]
    wrong: str
    answers: tuple[tuple[str, tuple[Value, ...]], ...] = ()


@dataclass(frozen=True, slots=True)
class LoggedFinding:
    """A run that breaks something.

    Attributes:
        level: Whose obligation it is.
        table: What it is about; empty for the whole level.
        obligation: In words.
        broken_at: The tick in which it is broken.
        restarted: Whether it begins where a restart does, and not with the initial values.
        legal: Whether the levels around do only what neighbours can that began with it.
        altered: Whether its tables were read by another rule than the language's.
        cycles: By tick and level.
    """

    level: str
    table: str
    obligation: str
    broken_at: int
    restarted: bool
    legal: bool
    altered: bool
    cycles: Mapping[tuple[int, str], LoggedCycle]


def finding_facts(finding: LoggedFinding) -> dict[str, str]:
    """As a metadata record: texts by name."""
    cycles = [
        [
            tick,
            level,
            list(logged_cycle.matched),
            logged_cycle.wrong,
            [[name, _numbers(given)] for name, given in logged_cycle.answers],
        ]
        for (tick, level), logged_cycle in sorted(finding.cycles.items())
    ]
    return {
        "level": finding.level,
        "table": finding.table,
        "goal": finding.obligation,
        "broken_at": str(finding.broken_at),
        "restarted": json.dumps(finding.restarted),
        "legal": json.dumps(finding.legal),
        "altered": json.dumps(finding.altered),
        "cycles": json.dumps(cycles, separators=(",", ":"), ensure_ascii=False),
    }


def _numbers(given: Sequence[Value]) -> list[Value | str]:
    """Return them for JSON: infinities and NaN as words."""
    return [str(value) if isinstance(value, float) and not math.isfinite(value) else value for value in given]


def _answer(entry: Sequence[Any]) -> tuple[str, tuple[Value, ...]]:
    name, given = entry
    if not all(isinstance(value, bool | int | float | str) for value in given):
        raise ValueError(entry)
    return str(name), tuple(float(value) if isinstance(value, str) else value for value in given)


def _flag(text: str) -> bool:
    """Raises KeyError where it is none."""
    return {"true": True, "false": False}[text]


def finding_of(facts: Mapping[str, str]) -> LoggedFinding:
    """Return the finding of `finding_facts`.

    Raises:
        KeyError, TypeError, ValueError: The facts are none.
    """
    cycles = {
        (int(tick), str(level)): LoggedCycle(
            tuple(map(str, matched)),
            str(wrong),
            tuple(_answer(entry) for entries in answers for entry in entries),
        )
        for tick, level, matched, wrong, *answers in json_of(facts["cycles"])
    }
    restarted, legal, altered = (_flag(facts[name]) for name in ("restarted", "legal", "altered"))
    return LoggedFinding(
        facts["level"],
        facts["table"],
        facts["goal"],
        int(facts["broken_at"]),
        restarted,
        legal,
        altered,
        cycles,
    )
