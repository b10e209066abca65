"""ACQUIRE as it is generated beside a switch by hand, on an emulated Cortex-M3: `python -m tests.bench.acquire`.

Both are compiled by one compiler with one set of flags (`OPTIMIZED`: -Os). They are given the same states: what the table tests
and what its lines use is drawn over all that it can be, a new command in one state of three, a refused input in one of forty.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from rcsc.base.host.tools import BuildFailed, run_command
from rcsc.code.testing.boards import BOARDS, HARNESS, Board, link, run_image

REPO = Path(__file__).parents[2]
CASES = 3000
GENERATED, BY_HAND = "task_acquire_step", "switch_acquire_step"
DRAWN = """
static uint32_t seed = 1u;
static uint32_t any(uint32_t n)
{
    seed = (seed * 1664525u) + 1013904223u;
    return (seed >> 8) % n;
}
static void draw(task_t *s)
{
    task_init(s);
    s->workstation.obj = any(8u);
    s->workstation.grasp = any(10u);
    s->workstation.input_command = VOCABULARY_TASK_COMMAND_ACQUIRE;
    s->workstation.sector = (any(40u) == 0u) ? 100u : any(100u);
    s->from_emove.inc_command_echo = any(2u);
    s->to_emove.inc_command = any(2u);
    s->new_command = any(3u) == 0u;
    s->emove.command = any(6u);
    s->emove.status = any(3u);
    s->emove.resting = any(2u) != 0u;
    s->emove.failure = any(18u);
    s->cur_state = any(9u);
    s->cur_state_next = any(9u);
    s->loc_of_obj = any(2u);
    s->source_spec = any(2u) != 0u;
    s->obj_acquired = any(2u) != 0u;
    s->source_buffer = any(2u) != 0u;
    s->source_loc = any(256u);
    s->source_vupos = any(256u);
    s->source_sector = any(100u);
    s->last_emove.input_command = any(6u);
    s->tbuffer_boxt = any(3u);
    s->bbuffer_boxb = any(3u);
    s->fbuffer_flag = 97u + any(3u);
    s->hbuffer_hous = any(100u);
}
"""
MAIN = """
#include "task.h"
int32_t switch_acquire_step(task_t *s);
%s
int main(void)
{
    static seen_t none;
    static task_t a, b;
    measure(nothing, &a, &none);
    for (uint32_t n = 0u; n < %du; n++) {
        seen_t first = {0}, second = {0};
        draw(&a);
        b = a;
        measure((call_t)task_acquire_step, &a, &first);
        measure((call_t)switch_acquire_step, &b, &second);
        say("case "); say_number((uint32_t)(a.line + 1)); say(" "); say_number((first.most - none.most) + 1u); say(" ");
        say_number((second.most - none.most) + 1u); say(" ");
        bool same = true;
        for (uint32_t i = 0u; i < sizeof a; i++) { same = same && (((uint8_t *)&a)[i] == ((uint8_t *)&b)[i]); }
        say_number(same ? 1u : 0u); say("\\n");
    }
    return 0;
}
"""


@dataclass(frozen=True, slots=True)
class Compared:
    """What both took.

    Attributes:
        cases: For each state the line that ran (-1: refused), the instructions as generated and by hand, and whether both left
            the same.
        sizes: Bytes of code and constants of an image with each alone.
    """

    cases: tuple[tuple[int, int, int, bool], ...]
    sizes: tuple[int, int]

    @property
    def medians(self) -> tuple[float, float]:
        """The median of the instructions of each, over all states."""
        return median(case[1] for case in self.cases), median(case[2] for case in self.cases)

    def medians_of_lines(self) -> dict[int, tuple[float, float]]:
        """The same, line by line."""
        lines = sorted({case[0] for case in self.cases})
        by_line = {line: [case for case in self.cases if case[0] == line] for line in lines}
        return {
            line: (median(case[1] for case in cases), median(case[2] for case in cases))
            for line, cases in by_line.items()
        }


def compared(board: Board, place: Path) -> Compared:
    """Build both in a folder and run them."""
    files = {path.name: path.read_text("utf-8") for path in (REPO / "generated/c").glob("*.h")}
    files["task.c"] = (REPO / "generated/c/task.c").read_text("utf-8")
    files["switch.c"] = (REPO / "tests/bench/acquire_switch.c").read_text("utf-8")
    said = run_image(board, place, files, HARNESS + MAIN % (DRAWN, CASES))
    assert isinstance(said, str), said
    rows = re.findall(r"case (\d+) (\d+) (\d+) ([01])", said)
    cases = tuple((int(line) - 1, int(a), int(b), same == "1") for line, a, b, same in rows)
    return Compared(
        cases, (_alone(board, place, "task.o", GENERATED), _alone(board, place, "switch.o", BY_HAND))
    )


def _alone(board: Board, place: Path, part: str, entry: str) -> int:
    made = link(board, place, [part], "alone.elf", "-Wl,--gc-sections", f"-Wl,-e,{entry}")
    assert not isinstance(made, BuildFailed), made
    return int(run_command([f"{board.tools}size", "alone.elf"], place, 60.0).out.splitlines()[1].split()[0])


def main() -> None:
    """Prints the table."""
    [board] = [board for board in BOARDS if board.name == "Cortex-M3"]
    with TemporaryDirectory() as folder:
        both = compared(board, Path(folder))
    print(f"{board.name}, {len(both.cases)} states{'generated':>14}{'by hand':>10}")
    rows = {
        f"line {line}" if line >= 0 else "refused": pair for line, pair in both.medians_of_lines().items()
    }
    for name, (ours, theirs) in {**rows, "all, median": both.medians, "bytes": both.sizes}.items():
        print(f"{name:<24}{ours:>14}{theirs:>10}{ours / theirs:>8.2f}")


if __name__ == "__main__":
    main()
