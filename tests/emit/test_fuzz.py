"""Short runs of the fuzzers; the long ones are `python -m tests.fuzz` and `python -m tests.differential`."""

import os
import re
import signal
from collections import Counter
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import pytest

from rcsc.lang.model import Program
from rcsc.lang.resolve import compile_text
from tests import differential
from tests.fuzz import campaign, links_campaign, names_campaign, strictly


def test_mutated_tables_and_garbage_give_only_coded_errors() -> None:
    count, _ = campaign(runs=300, seed=20261127)
    assert count["proved"] > 10, "the mutations are too wild to test anything past the parser"
    assert sum(number for code, number in count.items() if code.startswith("RCS2")) > 12
    # one in a hundred, give or take: which ones changes with every shipped table
    assert sum(number for code, number in count.items() if code.startswith("RCS4")) > 2


def test_cycles_of_drawn_programs_are_the_same_to_all() -> None:
    told = differential.campaign(count=40, seed=20261123)
    assert told["programs"] > 32
    assert all(told[f"fault {number}"] > 5 for number in (0, 1, 2, 3, 5))


def test_drawn_programs_have_all_that_the_evaluator_knows() -> None:
    texts = ["\n".join(differential.Maker(Random(f"kinds {number}")).draw().text) for number in range(60)]  # noqa: S311  # repeatable
    wanted = (
        r"\(was v", r"\bwas \(", "@T", "@F", "@C", r"\) when \(", r" for \d+ \[ms\]", " above l", " above all", " same ", r"^set ",
        r"not in set", r"in \{set", r"^const", r" safe ", "clamp", r"table \w+  table", "table by", r"^\| 1 ", "= 0b", r"\)\[\d\.\.",
        r"\| [01x]{4} [01x]{4}", r"single\(", "deferred until", r"(local|\(|for) ?c\d+ (:|in)",
    )  # fmt: skip
    assert not [kind for kind in wanted if not any(re.search(kind, text, re.MULTILINE) for text in texts)]


def test_a_program_whose_c_does_not_end_is_told_and_the_others_are_compared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compare, told = differential.compare, Counter[str]()

    def misled(built: differential.Built, *rest: Any) -> None:
        while built.program.name == "p2":
            pass
        if built.program.name == "p4":
            os.kill(os.getpid(), signal.SIGKILL)
        compare(built, *rest)

    monkeypatch.setattr(differential, "compare", misled)
    monkeypatch.setattr(differential, "LONGEST_CPU_S", 0.5)
    texts = [*differential.compared(0, 7, 4, told)]
    assert [text.split(",")[0] for text in texts] == ["program 2 of seed 4", "program 4 of seed 4"]
    assert sum(many for word, many in told.items() if word.startswith("fault ")) == 5 * differential.CYCLES


@pytest.mark.parametrize("cc", ["gcc", pytest.param("clang", marks=pytest.mark.needs("clang"))])
def test_programs_of_adversarial_names_compile_load_and_agree(cc: str) -> None:
    told = names_campaign(runs=12, seed=20261122 + len(cc), compilers=[cc])
    assert told["programs"] > 8
    assert told["fault 0"] > 20
    assert links_campaign(runs=8, seed=20261122 + len(cc), compilers=[cc])["programs with links"] > 2


def test_a_bound_beyond_all_doubles_is_no_bug() -> None:
    text = "input a : int 0 .. 18446744073709551615\noutput r : real 0.0 .. 1e300\n"
    power = " * ".join(["a"] * 40)
    assert isinstance(compile_text(f"{text}procedure p {{ r := real({power}) }}\n"), Program)


IDLE = """
input a : bool
input n : int 0 .. 9
input one : array[1] of int 0 .. 3
output b : bool
output m : int 0 .. 9
procedure p {
  local never_read : int 0 .. 9 := n
  never_read := 4
  local kept : int 0 .. 9 := n
  kept := kept
  b := b
  m := m
  if b = a { m := 1 } else { m := 2 }
  if b = b { m := 3 }
  if m = 3 { m := kept }
  case n { 1 { case m { 2 { m := 1 } else { m := 2 } } } else { } }
  if one[abs(n) mod 1] = one[0] { }
}
procedure none { b := b }
table t {
  | line | a || procedures |
  | x    |   || p; none    |
}
level l { period 10 [ms] table t }
"""


@pytest.mark.parametrize("cc", ["gcc", pytest.param("clang", marks=pytest.mark.needs("clang"))])
def test_what_does_nothing_compiles_without_a_warning(cc: str, tmp_path: Path) -> None:
    one = differential.built(differential.Drawn(text=IDLE.splitlines()), "idle")
    assert isinstance(one, differential.Built)
    strictly(one, tmp_path, cc)


ENDS = ("0 .. 255", "0 .. 256", "1 .. 254", "-5 .. 5", "-129 .. 0", "0 .. 65535", "0 .. 65536", "-70000 .. 3", "0 .. 4294967295",
        "0 .. 4294967296", "5 .. 9223372036854775807", "0 .. 9223372036854775808", "0 .. 18446744073709551615",
        "18446744073709551610 .. 18446744073709551614", "-9223372036854775807 .. 0", "-1 .. 9223372036854775806")  # fmt: skip


def test_what_an_input_s_type_can_hold_is_admitted_alike(tmp_path: Path) -> None:
    drawn = differential.Drawn()
    for at, (text, clamp) in enumerate(product(ENDS, (False, True))):
        low, high = map(int, text.split(" .. "))
        name, kind = f"v{at}", differential.Kind("int", f"int {text}", low, high)
        drawn.text.append(f"input {name} : {kind.text}{' clamp' if clamp else ''}")
        drawn.declared.append(differential.Declared(name, "input", (differential.Leaf(name, kind),), clamp))
    drawn.text += ["table t {", "| line | v0 ||", "| l | ||", "}", "level top { period 10 [ms] table t }"]
    drawn.tables.append(differential.Table("t", (differential.Line((), ()),), None, (), ()))
    drawn.stages.append((None, (0,)))
    one = differential.built(drawn, "ends")
    assert isinstance(one, differential.Built)
    in_c, python = differential.InC(one, differential.library([one], tmp_path)), differential.InPython(one)
    whole = differential.begun(drawn)
    start = {leaf.name: whole[leaf.name] for leaf in drawn.leaves()}
    for leaf in one.symbols["leaves"]:
        least, most = differential.HELD[leaf["c_type"]]
        ends = {
            least,
            most,
            *(end + by for end in (leaf["low"], leaf["high"]) for by in (-1, 0, 1)),
            0,
            2**63,
            2**63 - 1,
        }
        for value in (one for one in sorted(ends) if least <= one <= most):
            inputs = {**start, leaf["name"]: value}
            right, _ = differential.evaluated(drawn, {**whole, **inputs})
            assert differential.interpreted(one.drawn, one.program, inputs)[0] == right
            assert (in_c.run(inputs), python.run(inputs)) == (right, right), (leaf["name"], value)
