"""The generated step of ACQUIRE beside a switch that a person wrote: as good in what it does, near in what it takes."""

from pathlib import Path
from statistics import median

import pytest

from rcsc.code.testing.boards import BOARDS
from tests.bench.acquire import CASES, compared

FACTOR = 1.5

[CORTEX_M3] = [board for board in BOARDS if board.name == "Cortex-M3"]


@pytest.mark.needs("arm-none-eabi-gcc", "qemu-system-arm")
def test_acquire_takes_at_most_half_as_much_again_as_by_hand(tmp_path: Path) -> None:
    both = compared(CORTEX_M3, tmp_path)
    assert len(both.cases) == CASES
    assert all(same for _, _, _, same in both.cases)
    lines = both.medians_of_lines()
    assert lines.keys() == {-1, *range(17)}  # refused, and each line
    ours, theirs = both.medians
    assert ours <= FACTOR * theirs
    ran = [pair for line, pair in lines.items() if line >= 0]
    assert median(ours for ours, _ in ran) <= FACTOR * median(theirs for _, theirs in ran)
    assert both.sizes[0] <= FACTOR * both.sizes[1]
