"""Requirements that NASA published with FRET, as the language says them: against the formulas that were published with them.

The formulas are judged by an evaluator that shares nothing with rcsc (`formulas`), their comparisons of numbers by Python. What FRET's
`preBool(false, ...)` says of the first cycle, the values say here with which the level begins: those of which the condition is false.
"""

import re
from collections.abc import Iterator
from random import Random
from typing import TypeAlias

import pytest

from rcsc.lang.model import Property
from rcsc.lang.over_time import Watch
from rcsc.lang.over_time.past import FALSE
from tests.over_time.formulas.finite import parsed
from tests.over_time.test_templates import rows
from tests.support.programs.stages import program_of

ROWS = {row["id"]: row for row in rows("fret_published.tsv")}
TYPES = {
    "boolean": "bool",
    "double": "real -1000.0 .. 1000.0",
    "integer": "int 0 .. 9",
    "int32": "int 0 .. 9",
}
EACH = 24
"""Traces of each length."""
LENGTHS = (1, 2, 4, 12)
"""In cycles; what has a time is also judged a cycle longer than that."""
Trace: TypeAlias = list[dict[str, bool | float]]
_ORDER = re.compile(r"<=|>=|=|<|>")
_LOGIC = re.compile(r"->|[&|!]|\b(?:H|O|Y|Z|S|xor)\b")


def kinds(row: dict[str, str]) -> dict[str, str]:
    """The type of each variable."""
    return dict(variable.split(":") for variable in row["variables"].split())


def property_of(row: dict[str, str]) -> Property:
    """The requirement, of a program that declares its variables and nothing else."""
    declared = "".join(f"input {name} : {TYPES[kind]}\n" for name, kind in kinds(row).items())
    [stated] = program_of(f"{declared}requirement published : {row['requirement']}\n").properties
    return stated


def without_numbers(formula: str) -> tuple[str, dict[str, str]]:
    """The formula with a name for each comparison of numbers, and what the names say in Python."""
    result, names, at = "", dict[str, str](), 0
    while at < len(formula):
        inside = _bracket(formula, at) if formula[at] == "(" else ""
        if _ORDER.search(inside) and not _LOGIC.search(inside):
            name = f"compares_{len(names)}"
            names[name] = re.sub(r"(?<![<>])=", "==", inside)
            result, at = result + name, at + len(inside) + 2
        else:
            result, at = result + formula[at], at + 1
    return result, names


def _bracket(text: str, at: int) -> str:
    """What stands between the bracket there and the one that closes it."""
    depth = 0
    for place in range(at, len(text)):
        depth += (text[place] == "(") - (text[place] == ")")
        if not depth:
            return text[at + 1 : place]
    raise AssertionError(text)


def drawn(row: dict[str, str], random: Random, length: int) -> Trace:
    """Draw a trace: truths that change now and then, or often; numbers that the formula names, and some beside them."""
    named = {float(number) for number in re.findall(r"(?<![\w,\[])-?\d+(?:\.\d+)?", row["formula"])}
    near = sorted(named | {number + step for number in named for step in (-0.5, 1.0)} | {0.0, 1.0})
    stays, alike = random.choice((0.0, 0.6, 0.9, 0.99)), random.choice((None, None, *near))
    now: dict[str, bool | float] = {}
    trace = []
    for _ in range(length):
        for name, kind in kinds(row).items():
            if name in now and random.random() < stays:
                continue
            if kind == "boolean":
                now[name] = random.random() < 0.6
            elif kind == "double":
                now[name] = alike if alike is not None and random.random() < 0.8 else random.choice(near)
            else:
                now[name] = random.randrange(5)
        trace.append(dict(now))
    return trace


def published(row: dict[str, str], traces: list[Trace]) -> list[list[bool]]:
    """What the published formula says of each trace, after each cycle."""
    text, compared = without_numbers(row["formula"])
    formula, full = parsed(text), (1 << len(traces)) - 1
    judged = {name: compile(said, name, "eval") for name, said in compared.items()}

    def bits(name: str, cycle: int) -> int:
        each = [
            eval(judged[name], {"absReal": abs}, trace[cycle]) if name in judged else trace[cycle][name]  # noqa: S307  # of our own data
            for trace in traces
        ]
        return sum(bool(truth) << at for at, truth in enumerate(each))

    names = [*compared, *(name for name, kind in kinds(row).items() if kind == "boolean")]
    cycles = range(len(traces[0]))
    truths = formula({name: [bits(name, cycle) for cycle in cycles] for name in names}, full)
    return [[bool(truth >> at & 1) for truth in truths] for at in range(len(traces))]


def watched(stated: Property, trace: Trace, *, begins: bool) -> Iterator[bool]:
    """What the monitor says after each cycle, of a level that begins with these truths: in its first cycle `was` finds them."""
    watch, kept, before = (
        Watch(stated),
        True,
        {name: begins if isinstance(value, bool) else 0.0 for name, value in trace[0].items()},
    )
    for cycle in trace:
        kept = watch.keeps(before, cycle) and kept
        before = cycle
        yield kept


def divides_by_zero(row: dict[str, str], trace: Trace) -> bool:
    """Whether a comparison has no value in some cycle: there nobody says what is right."""
    for said in without_numbers(row["formula"])[1].values():
        for cycle in trace:
            try:
                eval(said, {"absReal": abs}, cycle)  # noqa: S307  # of our own data
            except ZeroDivisionError:
                return True
    return False


@pytest.mark.parametrize("name", ROWS)
def test_a_published_requirement_means_what_its_formula_says(name: str) -> None:
    row = ROWS[name]
    stated = property_of(row)
    assert stated.monitor is not None
    assert stated.monitor.owes == FALSE
    random = Random(name)  # noqa: S311  # the same traces each time
    time = re.search(r"(\d+) cycles", row["requirement"])
    verdicts = set()
    for length in (*LENGTHS, *([int(time[1]) + 2] if time else [])):
        many = 2 * EACH if length < 20 else EACH // 4
        traces = [drawn(row, random, length) for _ in range(many)]
        traces = [trace for trace in traces if not divides_by_zero(row, trace)]
        for trace, says in zip(traces, published(row, traces), strict=True):
            assert [*watched(stated, trace, begins=name.endswith("STAY_OFF"))] == says, trace
            verdicts.add(says[-1])
    assert verdicts == {True, False}, "the traces exercise it"
