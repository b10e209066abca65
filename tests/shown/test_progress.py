"""Who waits for a proof sees what is being done, which of how many it is, and how long it took last time."""

import re
from pathlib import Path

import pytest

from rcsc.front.commands import run
from rcsc.front.commands.shared import show, took


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard error is a terminal, and nothing is too short to be told."""
    monkeypatch.setattr(show, "_is_terminal", lambda stream: stream == 2)
    monkeypatch.setattr(took, "LEAST_S", 0.0)


@pytest.fixture
def cart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """Two levels with three requirements across them."""
    assert run(["new", str(tmp_path / "cart"), "--template", "system"]) == 0
    capsys.readouterr()
    return tmp_path / "cart"


@pytest.mark.usefixtures("terminal")
def test_levels_and_requirements_are_named_with_what_they_took_last_time(
    cart: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["prove", str(cart)]) == 0
    first = capsys.readouterr().err
    assert "proving supervisor, axis" in first
    assert "answering requirement " in first
    assert "last time" not in first
    assert run(["prove", "--steps", "79", str(cart)]) == 0  # other budgets: all is asked anew
    second = capsys.readouterr().err
    assert "proving supervisor (" in second
    assert " s last time), axis (" in second
    assert second.count("answering requirement") == first.count("answering requirement") >= 2
    assert "1 of " in second


def test_elsewhere_than_on_a_terminal_what_is_done_is_told_where_that_is_wanted(
    cart: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["prove", str(cart)]) == 0
    assert not capsys.readouterr().err
    assert run(["prove", "--progress", "--steps", "78", str(cart)]) == 0
    told = capsys.readouterr().err.splitlines()
    assert [line.split(":")[0] for line in told][:2] == ["level supervisor", "level axis"]
    assert [line for line in told if line.startswith("requirement ")]
    assert all("last time" not in line for line in told)


@pytest.mark.usefixtures("terminal")
def test_a_campaign_names_what_it_does_before_and_after_its_episodes(
    cart: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A requirement is added that is false, so that there is a finding to be made small."""
    with (cart / "requirements.rcs").open("a", encoding="utf-8") as file:
        file.write("\nrequirement stays monitored : never axis.speed_mm_s /= 0 [mm/s]\n")
    campaign = ["campaign", str(cart), "--episodes", "2", "--workers", "1", "--save", str(cart / "kept")]
    assert run(campaign) == 1
    first = capsys.readouterr().err
    assert "proving and compiling the tables\r" in first
    assert "proving what is watched of the levels\r" in first
    assert "making finding 1 of 1 as small as it gets" in first
    run([*campaign, "--seed", "5"])  # whatever it finds
    assert re.search(r"proving and compiling the tables \(\d+ s last time\)", capsys.readouterr().err)
