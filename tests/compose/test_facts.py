"""Facts about how inputs change from one cycle to the next: what `rcsc prove` shows from them, and only with them."""

from pathlib import Path

import pytest

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.compose.proof.system import SystemProof
from tests.support.programs.systems import LITTLE, alone, small_level, small_system, small_text
from tests.support.programs.texts import edited
from tests.support.proved import prove_system

THRESHOLDS = """
input y : int 0 .. 100
state level : int 0 .. 3
state skip : bool
assume slow assumed : abs(y - was y) <= 20
property shown : not skip
table t assuming slow {
  | line | level | y        || level | skip  |
  |------|-------|----------||-------|-------|
  | a    | 0     | < 20     || 0     | false |
  | b    | 0     | 20 .. 39 || 1     | false |
  | c    | 0     | >= 40    || 2     | true  |
  | d    | 1     | < 20     || 0     | false |
  | e    | 1     | 20 .. 39 || 1     | false |
  | f    | 1     | >= 40    || 2     | false |
  | g    | >= 2  | >= 40    || 2     | false |
  | h    | >= 2  | 20 .. 39 || 1     | false |
  | i    | >= 2  | < 20     || 0     | true  |
}
level l { table t }
"""
DRIFT = """
input y : int 0 .. 100
state ticks : int 0 .. 9
state start : int 0 .. 100
assume up assumed : y - was y <= 2
assume down assumed : y - was y >= -2
property shown : ticks < 9 implies abs(y - start) <= 2 * ticks + 2
table t assuming up, down {
  | line    | ticks || ticks     | start |
  |---------|-------||-----------|-------|
  | restart | 9     || 0         | y     |
  | counts  | < 9   || ticks + 1 | start |
}
level l { table t }
"""
BETWEEN = """
input y : int 0 .. 100
input z : int 0 .. 100
state apart : int -100 .. 100 = 0
assume slow_y assumed : abs(y - was y) <= 1
assume slow_z assumed : abs(z - was z) <= 1
property apart_is : apart = y - z
property shown : abs(apart - was apart) <= 2
table t assuming slow_y, slow_z {
  | line | when || apart |
  |------|------||-------|
  | all  | true || y - z |
}
level l { table t }
"""
BOUNDED = """
input y : int 0 .. 100
state moved : int -100 .. 100 = 0
assume slow assumed : abs(y - was y) <= 2
invariant shown : moved in -2 .. 2
table t assuming slow {
  | line | when || moved     |
  |------|------||-----------|
  | all  | true || y - was y |
}
level l { table t }
"""
ONE_INPUT = """
enum mode { off, low, high }
input a : bool
input m : mode
input n : int 0 .. 9
state both : bool
assume one assumed : count(@C(a), @C(m), @C(n)) <= 1
property shown : not both
table t assuming one {
  | line | when                                        || both  |
  |------|---------------------------------------------||-------|
  | two  | @C(a) and @C(m) or @C(m) and @C(n)          || true  |
  | rest | not (@C(a) and @C(m) or @C(m) and @C(n))    || false |
}
level l { table t }
"""
STEP = """
enum mode { off, low, high }
input asked : mode
state seen : mode
state jumped : bool
assume step assumed : was asked = off implies asked /= high
property kept : seen = asked
property shown : not jumped
table t assuming step {
  | line | seen   | asked   || seen | jumped |
  |------|--------|---------||------|--------|
  | jump | off    | high    || high | true   |
  | step | off    | /= high || asked | false |
  | any  | /= off |         || asked | false |
}
level l { table t }
"""
REAL = """
input y : real 0.0 .. 100.0
state jumps : int 0 .. 9
assume slow assumed : y - was y <= 0.5
property shown : jumps = 0
table t assuming slow {
  | line | y - was y || jumps             |
  |------|-----------||-------------------|
  | slow | <= 0.5    ||                   |
  | fast | > 0.5     || min(jumps + 1, 9) |
}
level l { table t }
"""
CASES = {
    "real": (REAL, ("<= 0.5\nproperty", "<= 0.6\nproperty")),
    "thresholds": (THRESHOLDS, ("<= 20", "<= 21")),
    "drift up": (DRIFT, ("y - was y <= 2", "y - was y <= 3")),
    "drift down": (DRIFT, (">= -2", ">= -3")),
    "between two": (BETWEEN, ("abs(z - was z) <= 1", "abs(z - was z) <= 2")),
    "bounded": (BOUNDED, ("<= 2", "<= 3")),
    "one input": (ONE_INPUT, ("count(@C(a), @C(m), @C(n)) <= 1", "count(@C(a), @C(m), @C(n)) <= 2")),
    "step": (STEP, ("asked /= high\n", "asked /= low\n")),
}


def verdict(text: str) -> Verdict:
    proof = prove_level(alone(text), LITTLE)
    assert all(
        verdict is Verdict.TRUSTED
        for obligation, verdict in proof.verdicts
        if obligation.sort is Sort.ASSUMPTION
    )
    [shown] = [verdict for obligation, verdict in proof.verdicts if obligation.name == "shown"]
    return shown


@pytest.mark.parametrize(("text", "weaker"), CASES.values(), ids=CASES)
def test_what_follows_from_a_fact_is_shown_and_nothing_more(text: str, weaker: tuple[str, str]) -> None:
    assert verdict(text) is Verdict.PROVED
    assert verdict(edited(text, weaker)) is Verdict.NOT_PROVED


def test_cells_that_may_be_undefined_are_no_predicates() -> None:
    text = edited(THRESHOLDS, ("| y        ||", "| 100 / (y + 1) ||"))
    assert verdict(text) is Verdict.NOT_PROVED


# --- facts about what another level writes --------------------------------------------------------


def with_fact(folder: Path, fact: str) -> SystemProof:
    """Prove the small system, of whose lower level the table assumes a fact."""
    table = ("table go {", f"assume fact assumed : {fact}\ntable go assuming fact {{")
    return prove_system(small_system(folder, lower=small_text("lower", table)), LITTLE)


@pytest.mark.parametrize(
    ("fact", "verdict"),
    [
        ("command.input_command in {pause, go}", Verdict.PROVED),
        ("command.input_command = pause", Verdict.NOT_PROVED),  # also of the first values
        ("command.inc_command < 60000", Verdict.NOT_PROVED),
    ],
)
def test_a_fact_about_one_buffer_of_another_level_is_owed_there(
    fact: str, verdict: Verdict, tmp_path: Path
) -> None:
    whole = with_fact(tmp_path, fact)
    assert whole.of("upper", (Sort.OWED, "", "lower.fact")).verdict is verdict
    assert "as it is declared" not in str(whole.closed)
    assert whole.of("lower", (Sort.ASSUMPTION, "go", "fact")).proved == (verdict is Verdict.PROVED)
    assert whole.proved == (verdict is Verdict.PROVED)


@pytest.mark.parametrize(
    ("fact", "trusted"),
    [
        ("command.input_command = go implies cur_state = going", False),  # own state: of another time
        ("new_command implies command.input_command = go", False),
        ("command.input_command = go implies not there", True),  # `there` alone can keep it
        ("command.input_command = go or there", True),
        ("(command.input_command = go) = new_command or there and not there", False),
    ],
)
def test_a_fact_that_no_writer_can_owe_is_trusted_only_where_the_outside_can_keep_it(
    fact: str, trusted: bool, tmp_path: Path
) -> None:
    ts = small_level(
        tmp_path,
        "lower",
        lower=small_text("lower", ("table go {", f"assume fact assumed : {fact}\ntable go assuming fact {{")),
    )
    assert not ts.links.given
    assert ts.trusted == (frozenset({"fact"}) if trusted else frozenset())


@pytest.mark.parametrize(("first", "begins"), [("", False), (" = 4", True)])
def test_a_fact_holds_of_what_the_reader_begins_with(first: str, begins: bool, tmp_path: Path) -> None:
    """Before anything is published the reader sees its own first value."""
    given = "input there : bool", f"input there : bool\ninput wide : int 0 .. 9{first}"
    table = "table go {", "assume fact assumed : wide >= 4\ntable go assuming fact {"
    upper = small_text("upper", ("input lower", "output wide : int 4 .. 9\ninput lower"))
    path = small_system(tmp_path, upper=upper, lower=small_text("lower", given, table))
    path.write_text(f'{path.read_text(encoding="utf-8")}"upper.wide" = "lower.wide"\n', encoding="utf-8")
    whole = prove_system(path, LITTLE)
    assert whole.of("upper", (Sort.OWED, "", "lower.fact")).verdict is Verdict.PROVED
    assert whole.of("lower", (Sort.ASSUMPTION, "go", "fact")).proved == begins
    assert whole.proved == begins


WRITES = """
input x : int 0 .. 9
output o : int 0 .. 9
table t {
  | line | x      || o |
  |------|--------||---|
  | all  | 0 .. 9 || x |
}
level w { period 40 [ms] table t }
"""
READS = """
input o : int 0 .. 9
input e : bool
output seen : int 0 .. 9
assume one assumed : ONE
assume two assumed : TWO
property never : seen /= 3
table t assuming one, two {
  | line | o      || seen |
  |------|--------||------|
  | all  | 0 .. 9 || o    |
}
level r { period 40 [ms] table t }
"""
BOTH = """
name = "s"
generated = "generated"
tick_ms = 40
[[level]]
name = "w"
[[level]]
name = "r"
[buffers]
"out.x" = "w.x"
"w.o" = "r.o"
"out.e" = "r.e"
"""


@pytest.mark.parametrize(
    ("one", "two", "both"),
    [
        ("o = 3 implies e", "o = 3 implies e", True),
        ("o = 3 implies e", "o = 3 implies not e", False),
        ("e", "o = 3 implies not e", False),
        ("not e", "o = 3 implies not e", True),
    ],
)
def test_facts_that_no_input_keeps_together_are_not_trusted(
    one: str, two: str, both: bool, tmp_path: Path
) -> None:
    """Each alone can be kept from outside; together they would say of what another level writes that it is never 3, which it is."""
    reads = edited(READS, ("ONE", one), ("TWO", two))
    for name, text in (("w.rcs", WRITES), ("r.rcs", reads), ("system.toml", BOTH)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    whole = prove_system(tmp_path / "system.toml", LITTLE)
    assert whole.of("r", (Sort.ASSUMPTION, "t", "one")).verdict is Verdict.TRUSTED
    trusted = whole.of("r", (Sort.ASSUMPTION, "t", "two")).verdict is Verdict.TRUSTED
    assert trusted == both
    assert whole.of("r", (Sort.PROPERTY, "", "never")).verdict is Verdict.NOT_PROVED
