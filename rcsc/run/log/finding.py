"""What a log says of the finding that it keeps: what the run breaks, and what no level's state holds of it.

In: a `LoggedFinding`. Out: its text, a metadata record of the log; and back. The log of a run in the cell has none.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rcsc.host.files.read import json_of
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
        table: That it is about; empty where it is about the whole level.
        obligation: Which, in words.
        broken_at: The tick in which it is broken.
        restarted: Whether it begins where a restart does, and not with the initial values.
        legal: Whether the levels around do only what neighbours can that began with it.
        altered: Whether its tables were looked at under another rule than the language's.
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
    """As JSON has them: what is no number in words."""
    return [str(one) if isinstance(one, float) and not math.isfinite(one) else one for one in given]


def _answer(said: Sequence[Any]) -> tuple[str, tuple[Value, ...]]:
    name, given = said
    if not all(isinstance(one, bool | int | float | str) for one in given):
        raise ValueError(said)
    return str(name), tuple(float(one) if isinstance(one, str) else one for one in given)


def _flag(text: str) -> bool:
    """Raises KeyError where it is none."""
    return {"true": True, "false": False}[text]


def finding_of(facts: Mapping[str, str]) -> LoggedFinding:
    """What `finding_facts` was made of.

    Raises:
        KeyError, TypeError, ValueError: The facts are none.
    """
    cycles = {
        (int(tick), str(level)): LoggedCycle(
            tuple(map(str, matched)), str(wrong), tuple(_answer(one) for each in answers for one in each)
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
