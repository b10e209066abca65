"""The page on requirements over time: its drawings are run, its examples proved, refuted, or shown never to ask."""

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.contract.walk import Walk
from rcsc.compose.contract.watched import monitors
from rcsc.compose.counterexample.lasso import Lasso, waiting_lasso
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.lang.interpret import holds
from rcsc.lang.over_time import Timing, Watch
from tests.support.programs.stages import program_of
from tests.support.programs.systems import alone

PAGE = (Path(__file__).parents[2] / "grammar" / "requirements.md").read_text(encoding="utf-8")
DRAWING = re.compile(r"^```cycles\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
MOST_STATES = 40
"""What comes again and again is run more often than a monitor of a drawing has states."""
NAMES = ("mode", "asked", "stop", "given")
PROGRAM = (
    "".join(f"input {name} : bool\n" for name in NAMES)
    + """\
requirement r : {}
output o : bool
table t {{
  | line | mode  || o     |
  |------|-------||-------|
  | yes  | true  || true  |
  | no   | false || false |
}}
level l {{ period 10 [ms] table t }}
"""
)


def drawings() -> Iterator[tuple[str, dict[str, str], str]]:
    """Yield what each line of each drawing says, the cycles drawn above it, and how it ends."""
    for drawing in DRAWING.finditer(PAGE):
        rows: dict[str, str] = {}
        for line in drawing["text"].splitlines():
            row = re.fullmatch(r"(\w+) +([.#]( [.#])*)", line)
            if row is not None:
                rows[row[1]] = row[2].replace(" ", "")
            else:
                said = re.fullmatch(r"(.+?) +(kept|broken in cycle \d+|waits for ever)", line)
                assert said is not None, line
                yield said[1].strip(), dict(rows), said[2]


@pytest.mark.parametrize(("says", "rows", "ends"), list(drawings()))
def test_each_drawing_ends_as_it_says(says: str, rows: dict[str, str], ends: str) -> None:
    [stated] = program_of(PROGRAM.format(says)).properties
    assert len({len(row) for row in rows.values()}) == 1
    cycles = [
        {name: rows.get(name, "........")[at] == "#" for name in NAMES}
        for at in range(len(next(iter(rows.values()))))
    ]
    again = cycles[rows["again"].index("#") :] if "again" in rows else []
    cycles += again * MOST_STATES
    watch, waits = Watch(stated), list[bool]()
    good = []
    for before, after in pairwise([dict.fromkeys(NAMES, False), *cycles]):
        good.append(watch.keeps(before, after))
        assert stated.monitor is not None
        waits.append(holds(stated.monitor.waits, watch.state))
    for_ever = again and all(waits[-len(again) :])
    kept = "waits for ever" if for_ever else "kept"
    assert ends == (kept if all(good) else f"broken in cycle {good.index(False) + 1}")


def test_every_timing_and_scope_is_drawn() -> None:
    said = " ".join(says for says, _, _ in drawings())
    words = {str(timing) for timing in Timing} | {
        "while",
        "unless",
        "before",
        "after",
        "only while",
        "only before",
        "only after",
    }
    words |= {"between", "from", "when", "whenever", "once", "since", "was", "apart", "on for", "off for"}
    assert {word for word in words if word not in said} == set()


EXAMPLES = [
    text for text in re.findall(r"^```rcs\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL) if "# vacuous" in text
]
SAYS = re.compile(
    r"^requirement (\w+) : .*?# (proved|vacuous|refuted in cycle \d+|refuted, for ever from cycle \d+ on)$",
    re.MULTILINE,
)


@pytest.mark.parametrize("text", EXAMPLES, ids=["requirements", "assumptions"])
def test_each_example_is_proved_refuted_or_vacuous_as_it_says(text: str) -> None:
    said = dict(SAYS.findall(text))
    for_ever = {name: int(one.split()[-2]) for name, one in said.items() if one.endswith("on")}
    ts = alone(text)
    assert {one.name for one in ts.program.properties} == said.keys()
    assert {one.split()[0].strip(",") for one in said.values()} == {"proved", "refuted", "vacuous"}
    proof = prove_level(ts, Effort(walks=6, cycles=40))
    proved = {
        owed.name
        for owed, verdict in proof.verdicts
        if owed.sort is Sort.REQUIREMENT and verdict is Verdict.PROVED
    }
    assert proved == {name for name, said in said.items() if not said.startswith("refuted")}
    kept = {
        owed.name for owed, verdict in proof.verdicts if owed.sort is Sort.KEPT and verdict is Verdict.PROVED
    }
    assert kept == {one.name for one in ts.program.environment}
    wanted = [owed for owed in obligations(ts, ts.cycle(ts.havoc())) if owed.name in said]
    found = traces(ts, wanted, TraceSearch(8))
    cycles = {key[2]: len(trace.steps) for key, trace in found.items() if isinstance(trace, Trace)}
    assert cycles == {
        name: int(one.split()[-1]) for name, one in said.items() if one.startswith("refuted in")
    }
    lassos = {name: waiting_lasso(ts, name, [TraceSearch(8)]) for name in for_ever}
    first = {name: lasso.first for name, lasso in lassos.items() if isinstance(lasso, Lasso)}
    assert first == for_ever
    assert proof.context is not None
    assert proof.context.vacuous == tuple(name for name, said in said.items() if said == "vacuous")


@pytest.mark.parametrize("text", EXAMPLES, ids=["requirements", "assumptions"])
def test_what_is_vacuous_never_asks_and_all_else_does(text: str) -> None:
    """On long walks: what asks there is not vacuous, whatever a proof says."""
    ts = alone(text)
    asks = set[str]()
    for seed in range(6):
        for state in Walk(ts, Random(seed)).states(80):  # noqa: S311  # the same walks each time
            asks |= {stated.name for stated, monitor in monitors(ts.program) if holds(monitor.asks, state)}
    said = dict(SAYS.findall(text))
    assert asks - {one.name for one in ts.program.environment} == {
        name for name in said if said[name] != "vacuous"
    }
