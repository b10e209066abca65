"""What is found that a level keeps of its plain outputs: enough for who reads them, and nothing that a run of it breaks."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.counterexample.rerun import make
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.system import SystemProof, prove_transition_systems, read_systems
from rcsc.compose.together.plain import with_what_is_kept
from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.levels import running_level
from rcsc.run.system import System, executors, signatures
from tests.across.judge.systems import LateMemory

_WORDS = "record pair { p : bool q : bool k : int 0 .. 9 = 2 }\n"
_UP = """\
use words
input go : bool
state n : int 0 .. 3
output o : pair
table t_up {
  | line | go    | n || n | o.p   | o.q   | o.k |
  |------|-------|---||---|-------|-------|-----|
ROWS}
level up { period 10 [ms] table t_up }
"""
_LOW = """\
use words
input o : pair
output x : bool safe false
table t_low {
  | line | o.p   || x     |
  |------|-------||-------|
  | yes  | true  || true  |
  | no   | false || false |
}
level low { period 10 [ms] table t_low }
"""
_SYSTEM = """\
name = "plain"
generated = "generated"
tick_ms = 10
late_ticks = 2
[[level]]
name = "up"
[[level]]
name = "low"
[buffers]
"w.go" = "up.go"
"up.o" = "low.o"
"low.x" = "w.x"
"""
_PROPERTIES = {
    "not_both": "not (o.p and o.q)",
    "p_or_q": "o.p or o.q or o.k = 2",
    "few": "o.k <= 5",
    "some": "o.k >= 2",
    "p_only": "o.p implies not o.q",
}


def _rows(random: Random) -> str:
    """Draw the lines of a writer, which give few values together."""
    ways = "false | false", "true  | false", "false | true ", "true  | true "
    pairs, numbers = random.sample(ways, 2), [random.randrange(2, 8) for _ in range(2)]

    def then(n: int) -> int:
        return random.choice((n, n, 3 if n == 2 else n + 1 if n < 3 else 0))

    return "".join(
        f"  | r{at} | {go} | {n} || {then(n)} | {random.choice(pairs)} | {random.choice(numbers)} |\n"
        for at, (go, n) in enumerate(product(("true", "false"), range(4)))
    )


def _proved(folder: Path, rows: str, files: Mapping[str, str] = {}) -> tuple[SystemProof, SystemProof]:
    """Return what is proved of the levels, without and with what is found."""
    stated = "".join(f"property {name} : {said}\n" for name, said in _PROPERTIES.items())
    texts = {
        "rcsc.toml": 'name = "plain"\n',
        "words.rcs": _WORDS,
        "up.rcs": _UP.replace("ROWS", rows),
        "low.rcs": _LOW + stated,
        "system.toml": _SYSTEM,
        **files,
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    systems, _ = read_systems(folder / "system.toml")
    whole = prove_transition_systems(systems, None, 1, tuple(systems))
    return whole, with_what_is_kept(systems, whole, Effort())[1]


def _is(whole: SystemProof) -> dict[str, bool]:
    return {name: whole.of("low", (Sort.PROPERTY, "", name)).proved for name in _PROPERTIES}


_GIVES = """\
  | a    | true  |   || 0 | true  | false | 5   |
  | b    | false |   || 0 | false | true  | 2   |
"""


def test_what_one_buffer_holds_together_and_ends_of_its_numbers_are_known(tmp_path: Path) -> None:
    alone, found = _proved(tmp_path, _GIVES)
    assert not any(_is(alone).values())
    assert [name for name, proved in _is(found).items() if not proved] == [
        "p_or_q"
    ]  # it joins a number to others
    assert found.of("low", (Sort.PROPERTY, "", "few")).trusts == ()


def test_what_comes_too_seldom_for_a_walk_is_no_fact(tmp_path: Path) -> None:
    counts = ""
    for n in range(4):
        last = "true" if n == 3 else "false"
        counts += f"  | r{n} | true | {n} || {min(n + 1, 3)} | {last} | {last} | {2 + n // 3} |\n"
    counts += "  | off | false | || 0 | false | false | 2 |\n"
    found = _is(_proved(tmp_path, counts)[1])
    assert (found["not_both"], found["few"]) == (False, True)


def test_what_the_reader_begins_with_is_no_fact_of_the_writer(tmp_path: Path) -> None:
    own = "record own { p : bool = true q : bool = true k : int 0 .. 9 = 9 }\n"
    begins = own + _LOW.replace("use words\n", "").replace("input o : pair", "input o : own")
    stated = "".join(f"property {name} : {said}\n" for name, said in _PROPERTIES.items())
    found = _is(_proved(tmp_path, _GIVES, {"low.rcs": begins + stated})[1])
    assert (found["not_both"], found["few"], found["some"]) == (False, False, True)


def test_prove_says_what_it_found(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _proved(tmp_path, _GIVES)
    assert run(["prove", str(tmp_path / "system.toml"), "--no-cache"]) == 0
    out = capfd.readouterr().out
    assert "low assumes that what `up` writes is as `" in out
    assert "few                      proved\n" in out


# --- drawn writers -----------------------------------------------------------------------------

FEW, MOST, TICKS = 3, 60, 300


def judged(seed: int, folder: Path) -> list[str]:
    """Judge what is found of a drawn writer by runs with restarts, refused inputs and late buffers."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    _, found = _proved(folder, _rows(random))
    systems, _ = read_systems(folder / "system.toml")
    system = description(folder / "system.toml")
    make((ts.program for ts in systems.values()), system.generated, altered=False)
    signs = signatures(system)
    by_level = executors(system, signs, "python")
    levels = tuple(
        running_level(spec, system, signs[spec.name], by_level[spec.name], {}) for spec in system.levels
    )
    memory = LateMemory(2)
    running, late = System(system, levels, (), memory), 0
    seen = {name: True for name, proved in _is(found).items() if proved}
    for _ in range(TICKS):
        memory.publish("w.go", (random.choice((True, False)),))
        memory.holds(("w.go",))
        late = random.randint(0, min(2, late + 1))
        memory.by = {"up.o": late}
        for level in levels:
            if random.random() < 0.05:
                running.restart(level.name, written=memory.written())
        running.step()
        memory.holds(("up.o", "low.x"))
        p, q, k = (levels[1].value(f"o.{leaf}") for leaf in "pqk")
        told = {
            "not_both": not (p and q),
            "p_or_q": p or q or k == 2,
            "few": k <= 5,
            "some": k >= 2,
            "p_only": not p or not q,
        }
        assert all(told[name] for name in seen), (seed, p, q, k, seen)
    return ["proved" if proved else "open" for proved in _is(found).values()]


@pytest.mark.parametrize("seed", range(FEW))
def test_what_is_found_of_drawn_writers_holds_as_they_run(seed: int, tmp_path: Path) -> None:
    assert judged(seed, tmp_path)


@pytest.mark.thorough
def test_what_is_found_of_many_drawn_writers_holds_as_they_run(tmp_path: Path) -> None:
    verdicts = list[str]()
    for seed in range(4000, 4000 + MOST):
        folder = tmp_path / str(seed)
        folder.mkdir()
        verdicts += judged(seed, folder)
    assert {"proved", "open"} <= set(verdicts)
