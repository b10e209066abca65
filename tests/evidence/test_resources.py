"""What functions need on small processors: what the shipped levels take, with a margin, and that a bound is one."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from rcsc.code.emit import emitted
from rcsc.code.emit.lower import lower_by_force
from rcsc.code.testing import boards
from rcsc.code.testing.boards import BOARDS, Board
from rcsc.lang.model import Program
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.views.evidence import resources
from rcsc.views.evidence.assembly import Bounds, UnboundedError, of_compiler, of_disassembly
from rcsc.views.evidence.resources import Need, measure
from tests.evidence.subjects import EVERYTHING, subject_of

ALL = {board.name: board for board in BOARDS}
BUDGETS: Mapping[tuple[str, str], tuple[int, int, int]] = {
    ("task", "Cortex-M0+"): (88, 427, 5260),
    ("task", "Cortex-M3"): (62, 259, 4720),
    ("task", "RV32IMAC"): (119, 372, 6250),
    ("vision", "Cortex-M4F"): (172, 5560, 4950),
    ("gripper", "Cortex-M4F"): (128, 3400, 4550),
    ("emove", "Cortex-M4F"): (260, 4650, 8800),
    ("primitive", "Cortex-M4F"): (250, 23100, 10800),
}
"""Of the cycle of a level on a board: bytes of stack, instructions and bytes of its image, a tenth above what was measured."""
FRAMES = {"task": 32, "emove": 152, "primitive": 224, "vision": 112, "gripper": 56}
"""Bytes of the largest frame on a Cortex-M4."""
PROCESSORS = ("arm-none-eabi-gcc", "qemu-system-arm", "riscv64-unknown-elf-gcc", "qemu-system-riscv32")


def needs_of(name: str, board: str) -> dict[str, Need]:
    """What the functions of a shipped level need."""
    loaded = load([f"tables/{name}/{name}.rcs"])
    program = resolve(loaded.roots[0], loaded)
    assert isinstance(program, Program)
    plan = lower_by_force(program)
    measured = measure(ALL[board], plan, emitted(plan, ("c",)))
    assert isinstance(measured, list), measured
    return {need.function: need for need in measured}


@pytest.mark.needs(*PROCESSORS)
@pytest.mark.parametrize(("level", "board"), list(BUDGETS))
def test_a_shipped_level_keeps_its_budget(level: str, board: str) -> None:
    """And has a bound near what was measured where it has no reals; reals are done by a library."""
    needs = needs_of(level, board)
    cycle = needs[f"{level}_{level}_cycle"]
    taken = cycle.deepest or 0, cycle.observed or 0, cycle.alone or 0
    budget = BUDGETS[level, board]
    assert all(0.8 * may <= has <= may for has, may in zip(taken, budget, strict=True)), (taken, budget)
    assert all(need.observed <= need.bound for need in needs.values() if need.observed and need.bound)
    assert max(need.frame for need in needs.values()) <= FRAMES[level] or board == "RV32IMAC"
    if level == "task":
        has_bounds_near_runs([need for need in needs.values() if need.calls])
        carries_no_other(needs["task_acquire_step"], cycle)
    if level == "gripper":
        assert cycle.bound is None
        assert "__aeabi_d" in cycle.unbounded


def has_bounds_near_runs(entries: Sequence[Need]) -> None:
    assert len(entries) == 15
    for need in entries:
        assert need.observed is not None
        assert need.bound is not None, need.unbounded
        assert need.observed <= need.bound <= 1.5 * need.observed


def carries_no_other(step: Need, every: Need) -> None:
    """The image of one table has no other."""
    assert step.alone is not None
    assert every.alone is not None
    assert step.alone < every.alone / 3


@pytest.mark.needs(*PROCESSORS)
def test_evidence_is_a_table_a_page_and_figures() -> None:
    evidence = resources.collect(subject_of(EVERYTHING))
    assert not evidence.shortfalls
    assert not evidence.missing
    rows = list(csv.DictReader(io.StringIO(evidence.files["resources.csv"])))
    assert {row["board"] for row in rows} == ALL.keys()
    assert all(name in evidence.files["resources.md"] for name in ALL)
    assert len(evidence.figures) == len(BOARDS)
    for board in ALL:  # the clamp is a path of the admission that draws do not always take
        [cycle] = [row for row in rows if (row["board"], row["function"]) == (board, "probe_l_cycle")]
        assert int(cycle["observed_instructions"]) > 0


def test_a_tool_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    gone = [
        Board(board.name, ("no-such-gcc",), "no-such-", board.emulator, board.origins) for board in BOARDS
    ]
    monkeypatch.setattr(resources, "BOARDS", gone)
    evidence = resources.collect(subject_of(EVERYTHING))
    assert "gcc-arm-none-eabi" in evidence.missing
    assert not evidence.files


@pytest.mark.needs("arm-none-eabi-gcc", "qemu-system-arm")
def test_one_board_is_enough_and_the_others_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    riscv = ALL["RV32IMAC"]
    gone = Board(riscv.name, ("no-such-gcc",), riscv.tools, riscv.emulator, riscv.origins)
    monkeypatch.setattr(resources, "BOARDS", (ALL["Cortex-M3"], gone))
    evidence = resources.collect(subject_of(EVERYTHING))
    assert [short.where for short in evidence.shortfalls] == ["RV32IMAC"]
    assert "no-such-gcc not installed" in evidence.shortfalls[0].what
    assert evidence.files


# --- paths ---

HEAD = "\t.type\tf, %function\nf:\n"
CHOICE = (
    HEAD
    + """
\tcmp\tr0, #0
\tbeq\t.L1
\tadds\tr0, r0, #1
\tadds\tr0, r0, #1
\tb\t.L2
.L1:
\tmovs\tr0, #7
.L2:
\tbx\tlr
"""
)
LOOP = (
    HEAD
    + """
\t.loc 1 10 3
\tmovs\tr3, #0
.L1:
\t.loc 1 11 3
\tadds\tr3, r3, #1
\tcmp\tr3, #9
\tbne\t.L1
\tbx\tlr
"""
)
TABLE = (
    HEAD
    + """
\ttbb\t[pc, r0]
.L4:
\t.byte\t(.L1-.L4)/2
\t.byte\t(.L2-.L4)/2
\t.p2align 1
.L1:
\tbx\tlr
.L2:
\tmovs\tr0, #1
\tmovs\tr1, #1
\tbx\tlr
"""
)
CALLS = (
    HEAD
    + """
\tpush\t{r4, lr}
\tbl\tg
\tpop\t{r4, lr}
\tb\tg
\t.type\tg, %function
g:
\tmovs\tr0, #1
\tbx\tlr
"""
)
NESTED = (
    HEAD
    + """
.L1:
\t.loc 1 10 3
\tmovs\tr2, #0
.L2:
\t.loc 1 11 3
\tadds\tr2, r2, #1
\tcmp\tr2, #3
\tbne\t.L2
\t.loc 1 10 3
\tadds\tr3, r3, #1
\tcmp\tr3, #5
\tbne\t.L1
\tbx\tlr
"""
)
CONDITIONAL = (
    HEAD
    + """
\tcmp\tr0, #0
\tit\teq
\tbxeq\tlr
\tmovs\tr0, #1
\tbx\tlr
"""
)
RISCV = (
    HEAD.replace("%", "@")
    + """
\tli\ta5,70000
\tbeq\ta0,a5,.L1
\tcall\tg
.L1:
\tret
\t.type\tg, @function
g:
\tlui\ta5,%hi(.L9)
\tjr\ta5
\t.section\t.rodata
.L9:
\t.word\t.L5
\t.text
.L5:
\tret
"""
)


def bound(text: str, loops: Mapping[int, int] | None = None) -> int:
    return Bounds(of_compiler(text), of_disassembly("", ""), loops or {}).of("f")


@pytest.mark.parametrize(
    ("text", "loops", "longest"),
    [
        (CHOICE, {}, 6),
        (LOOP, {11: 9}, 1 + 10 * 3 + 1),
        (TABLE, {}, 4),
        (CALLS, {}, 4 + 2 + 2),
        (NESTED, {10: 5, 11: 3}, 6 * (1 + 4 * 3 + 3) + 1),
        (CONDITIONAL, {}, 5),
        (RISCV, {}, 2 + 1 + 2 + 3 + 1),
    ],
)
def test_the_longest_path_is_counted(text: str, loops: Mapping[int, int], longest: int) -> None:
    assert bound(text, loops) == longest


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (LOOP, "nothing says how often"),
        (CALLS.replace("movs\tr0, #1", "bl\tf"), "calls itself"),
        (CALLS.replace("bl\tg", "blx\tr3"), "goes where"),
        (CALLS.replace("bl\tg", "bl\tmemcpy"), "for how many bytes"),
        (CALLS.replace("bl\tg", "bl\t__aeabi_dadd"), "not in the image"),
        (TABLE.replace(".byte", ".asciz"), "cannot be read"),
        (CHOICE.replace("bx\tlr", "movs\tr0, #1"), "goes on"),
        (LOOP.replace("movs\tr3, #0", "cbz\tr0, .L3").replace("\tcmp", ".L3:\n\tcmp"), "several entries"),
    ],
)
def test_where_no_bound_can_be_told_the_reason_is(text: str, why: str) -> None:
    with pytest.raises(UnboundedError, match=why):
        bound(text)


KNOWN = """
__attribute__((naked)) static void five(void *s)
{
    __asm volatile("nop\\n\\tnop\\n\\tnop\\n\\tnop\\n\\t" RETURN);
}
__attribute__((naked)) static void deep(void *s)
{
    __asm volatile(PUSH "\\n\\t" POP "\\n\\t" RETURN);
}
int main(void)
{
    static seen_t none, first, second;
    measure(nothing, 0, &none);
    for (int i = 0; i < 100; i++) { measure(five, 0, &first); measure(deep, 0, &second); }
    tell("five", &first, &none); tell("deep", &second, &none);
    return 0;
}
"""
WORDS = {
    "Cortex-M3": {"RETURN": "bx lr", "PUSH": "push {r1-r6}", "POP": "pop {r1-r6}"},
    "RV32IMAC": {"RETURN": "ret", "PUSH": "addi sp, sp, -32\\n\\tsw a0, 8(sp)", "POP": "addi sp, sp, 32"},
}


@pytest.mark.needs(*PROCESSORS)
@pytest.mark.parametrize(("board", "deep"), [("Cortex-M3", (3, 24)), ("RV32IMAC", (4, 24))])
def test_what_is_known_is_counted_exactly(board: str, deep: tuple[int, int], tmp_path: Path) -> None:
    words = "".join(f'#define {name} "{text}"\n' for name, text in WORDS[board].items())
    said = boards.run_image(ALL[board], tmp_path, {}, boards.HARNESS + words + KNOWN)
    assert said == f"rcsc five 100 5 0\nrcsc deep 100 {deep[0]} {deep[1]}\n"
