"""Garbage is not searched for while a table is read and proved, and is again afterwards."""

import gc
from pathlib import Path

import pytest

from rcsc.base.host.memory import last_work, uncollected
from rcsc.driver.pipeline import proved
from rcsc.driver.settings import Settings
from rcsc.proof.table.decide import prove_table
from tests.bench.made import families
from tests.support.programs.stages import BOXES, program_of


@pytest.mark.parametrize("on", [True, False])
def test_collection_is_as_it_was_after_any_end(on: bool) -> None:
    was_on = gc.isenabled()
    (gc.enable if on else gc.disable)()
    try:
        with uncollected(), uncollected():
            assert not gc.isenabled()
        assert gc.isenabled() is on
        with pytest.raises(KeyError), uncollected():
            raise KeyError
        assert gc.isenabled() is on
    finally:
        (gc.enable if was_on else gc.disable)()


def test_nothing_is_collected_while_a_table_is_read_and_proved(tmp_path: Path) -> None:
    """With 64 lines there would be dozens of collections."""
    text = families.linear(64, 4, 1)
    (tmp_path / "planes.rcs").write_text(text, "utf-8")
    program = program_of(text)
    seen: list[object] = []
    gc.callbacks.append(collected := lambda *phase: seen.append(phase))
    gc.enable()
    try:
        prove_table(program, program.tables[0], BOXES)
        proved(Settings((str(tmp_path),), BOXES))
    finally:
        gc.callbacks.remove(collected)
    assert len(seen) <= 2 * 6, "on the way in and out, twice told each"


def test_what_is_left_of_the_last_work_is_not_looked_at_again() -> None:
    was_on, before = gc.isenabled(), gc.get_freeze_count()
    gc.enable()
    try:
        with last_work():
            made = [[at] for at in range(1000)]
            assert not gc.isenabled()
        assert gc.isenabled()
        assert gc.get_freeze_count() - before >= len(made)
        seen: list[int] = []
        gc.callbacks.append(collected := lambda phase, _told: seen.append(len(phase)))
        try:
            again = [[at] for at in range(10)]
        finally:
            gc.callbacks.remove(collected)
        assert (seen, len(again)) == ([], 10)
    finally:
        gc.unfreeze()
        (gc.enable if was_on else gc.disable)()
