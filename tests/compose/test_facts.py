"""What is shown from facts about how inputs change, and only with them; and what needs that no input is refused says so."""

from pathlib import Path

import pytest

import rcsc
from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.assume_guarantee import promises
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.compose.proof.system import SystemProof, transition_systems
from rcsc.front.commands import run
from rcsc.lang.interpret import evaluate
from tests.support.programs.systems import LITTLE, alone, small_level, small_system, small_text, solo_system
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


def wide_system(folder: Path, first: str) -> Path:
    """A level that owes another one a number from 4, which begins as `first` says."""
    given = "input there : bool", f"input there : bool\ninput wide : int 0 .. 9{first}"
    table = "table go {", "assume fact assumed : wide >= 4\ntable go assuming fact {"
    upper = small_text("upper", ("input lower", "output wide : int 4 .. 9\ninput lower"))
    path = small_system(folder, upper=upper, lower=small_text("lower", given, table))
    path.write_text(f'{path.read_text(encoding="utf-8")}"upper.wide" = "lower.wide"\n', encoding="utf-8")
    return path


@pytest.mark.parametrize(("first", "begins"), [("", False), (" = 4", True)])
def test_a_fact_holds_of_what_the_reader_begins_with(first: str, begins: bool, tmp_path: Path) -> None:
    """Before anything is published the reader sees its own first value."""
    whole = prove_system(wide_system(tmp_path, first), LITTLE)
    assert whole.of("upper", (Sort.OWED, "", "lower.fact")).verdict is Verdict.PROVED
    assert whole.of("lower", (Sort.ASSUMPTION, "go", "fact")).proved == begins
    assert whole.proved == begins


@pytest.mark.parametrize(("first", "begins"), [("", False), (" = 4", True)])
def test_a_fact_about_one_buffer_is_an_obligation_of_its_writer_and_a_promise_to_its_reader(
    first: str, begins: bool, tmp_path: Path
) -> None:
    systems = transition_systems(wide_system(tmp_path, first))
    upper = systems["upper"]
    owed = [each.key for each in obligations(upper, upper.cycle(upper.havoc())) if each.sort is Sort.OWED]
    assert owed == [(Sort.OWED, "", "lower.fact")]
    [promise] = [each for each in promises(systems) if each.fact == "fact"]
    assert (promise.level, promise.begins) == ("lower", begins)


def test_a_fact_holds_of_what_stands_in_the_buffer_at_a_restart(tmp_path: Path) -> None:
    """What is never published, and is not what the reader begins with, does not stand there either."""
    given = "input there : bool", "input there : bool\ninput wide : int 0 .. 9"
    table = (
        "table go {",
        "assume fact assumed : wide <= 4\nproperty stood : was wide <= 4\nproperty less : was wide <= 3\ntable go assuming fact {",
    )
    upper = small_text("upper", ("input lower", "output wide : int 0 .. 4\ninput lower"))
    path = small_system(tmp_path, upper=upper, lower=small_text("lower", given, table))
    path.write_text(f'{path.read_text(encoding="utf-8")}"upper.wide" = "lower.wide"\n', encoding="utf-8")
    whole = prove_system(path, LITTLE)
    assert whole.of("lower", (Sort.PROPERTY, "", "stood")).verdict is Verdict.PROVED
    assert whole.of("lower", (Sort.PROPERTY, "", "less")).verdict is Verdict.NOT_PROVED


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


# --- what needs that nothing is refused ----------------------------------------------------------

SAFE_VALUE = """input x : int 0 .. 9
output o : int 0 .. 3 = 0 safe 3
assume no_three monitored : o /= 3
table t assuming no_three {
  | line | o   | x   || o |
  |------|-----|-----||---|
  | up   | 0   | 0   || 1 |
  | on   | 1   |     || 2 |
  | back | 2   |     || 0 |
  | stay | 0   | > 0 || 0 |
}
level solo { period 40 [ms] table t }
"""
GUARDED = """input guard : bool
input level : int 0 .. 100
output speed : int 0 .. 9
property only_guarded : speed > 0 implies guard
property bounded : speed <= 5
table t {
  | line | guard | level || speed |
  |------|-------|-------||-------|
  | go   | true  | < 50  || 5     |
  | high | true  | >= 50 || 0     |
  | no   | false |       || 0     |
}
level solo { period 40 [ms] table t }
"""


def trusts(whole: SystemProof, sort: Sort, table: str, name: str = "") -> tuple[str, ...]:
    found = whole.of("solo", (sort, table, name))
    assert found.proved
    return found.trusts


@pytest.mark.parametrize("more", ["", " clamp"])
def test_a_line_that_a_safe_value_takes_away_trusts_that_nothing_is_refused(
    more: str, tmp_path: Path
) -> None:
    path = solo_system(tmp_path, SAFE_VALUE.replace("0 .. 9", f"0 .. 9{more}"))
    whole = prove_system(path, LITTLE)
    words = () if more else ("`x` of level `solo` is never refused",)
    assert trusts(whole, Sort.SOME_LINE, "t") == words
    assert trusts(whole, Sort.ASSUMPTION, "t", "no_three") == words
    assert whole.admitting == words
    assert run(["prove", str(path), "--no-cache"]) == 0
    assert run(["prove", str(path), "--no-cache", "--strict"]) == (0 if more else 1)


@pytest.mark.parametrize(
    ("kind", "trusted"),
    [
        ("int 0 .. 2 clamp", True),
        ("int 0 .. 255 clamp", False),
        ("int -9 .. 65535 clamp", True),
        ("bool", False),
    ],
)
def test_a_property_that_looks_back_at_what_is_clamped_trusts_what_stands_at_a_restart(
    kind: str, trusted: bool, tmp_path: Path
) -> None:
    """Where the level begins anew its inputs stand as they came; the first cycle moves them to the edge."""
    text = f"""input x : {kind}
output o : bool
property back : was x in {{{"true, false" if kind == "bool" else kind.removeprefix("int ").removesuffix(" clamp")}}}
property here : x in {{{"true, false" if kind == "bool" else kind.removeprefix("int ").removesuffix(" clamp")}}}
property aside : o or not o
table t {{
  | line | o     || o     |
  |------|-------||-------|
  | on   | false || true  |
  | off  | true  || false |
}}
level solo {{ period 40 [ms] table t }}
"""
    path = solo_system(tmp_path, text)
    whole = prove_system(path, LITTLE)
    words = ("`x` of level `solo` is in range where it begins anew",) if trusted else ()
    assert trusts(whole, Sort.PROPERTY, "", "back") == words
    assert trusts(whole, Sort.PROPERTY, "", "here") == trusts(whole, Sort.PROPERTY, "", "aside") == ()
    assert run(["prove", str(path), "--no-cache", "--strict"]) == (1 if trusted else 0)


def test_a_property_about_an_input_trusts_that_no_other_is_refused(tmp_path: Path) -> None:
    """One that does not look at inputs trusts nothing: a refused cycle changes no output without a safe value."""
    path = solo_system(tmp_path, GUARDED)
    whole = prove_system(path, LITTLE)
    words = ("`level` of level `solo` is never refused",)
    assert trusts(whole, Sort.PROPERTY, "", "only_guarded") == words
    [claim] = [each for each in rcsc.prove(path, cycles=0).claims if each.name == "only_guarded"]
    assert (claim.proved, claim.trusts) == (True, words)
    assert trusts(whole, Sort.PROPERTY, "", "bounded") == ()
    assert trusts(whole, Sort.SOME_LINE, "t") == ()


@pytest.mark.parametrize(
    ("claim", "kept"), [("r / 4.0 > 0.4", True), ("r / 4.0 > 0.5", False), ("r / 2.0 < 1.0", True)]
)
def test_what_the_outside_can_keep_is_tried_with_doubles(claim: str, kept: bool) -> None:
    """What it gives is what is promised of it, wherever the assumption stands."""
    ts = alone(
        f"input r : real 1.5 .. 2.0\nassume part assumed : {claim}\n"
        "table t assuming part {\n| line | r ||\n| any | ||\n}\nlevel solo { period 40 [ms] table t }\n"
    )
    [assumption] = ts.program.assumptions
    found = ts._kept_by(assumption, {"r"}, {}, ())
    assert (found is not None) == kept
    assert found is None or evaluate(assumption.condition, found) is True


def test_lines_that_were_looked_at_with_refusals_are_not_looked_at_without() -> None:
    """Of a level of which something is proved only without."""
    proof = prove_level(alone(GUARDED), Effort(walks=1, cycles=10))
    assert [part.context is None for part in proof.parts] == [False, True]
    assert (proof.context, proof.looked_admitting) == (proof.parts[0].context, False)


def test_with_a_safe_value_the_property_holds_in_a_refused_cycle_too(tmp_path: Path) -> None:
    text = GUARDED.replace("speed : int 0 .. 9", "speed : int 0 .. 9 safe 0")
    whole = prove_system(solo_system(tmp_path, text), LITTLE)
    assert trusts(whole, Sort.PROPERTY, "", "only_guarded") == ()


def test_a_bool_is_never_refused(tmp_path: Path) -> None:
    text = GUARDED.replace("input level : int 0 .. 100", "input level : bool")
    text = text.replace("< 50 ", "false").replace(">= 50", "true ")
    path = solo_system(tmp_path, text)
    assert transition_systems(path)["solo"].refusable == ()
    assert prove_system(path, LITTLE).admitting == ()


def test_where_nothing_is_refused_nothing_stands_outside_its_range(tmp_path: Path) -> None:
    text = (
        "input y : int 0 .. 100 clamp\nstate s : bool\nproperty near : s or y - was y <= 100\n"
        "table t {\n  | line | y        || s     |\n  |---|---||---|\n  | l    | 0 .. 100 || true  |\n}\nlevel solo { table t }\n"
    )
    ts = transition_systems(solo_system(tmp_path, text))["solo"]
    assert ts.clamped == ("y",)
    assert ts.admitting().cycle(ts.havoc()).strange == frozenset()
