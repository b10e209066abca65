"""`rcsc studio` as a user starts it: one address, a page behind it, and an end at Ctrl-C."""

import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from rcsc.commands import run

DOCK = Path(__file__).parents[1] / "data" / "dock"
COMMAND = (sys.executable, "-c", "from rcsc.commands import main; main()", "studio")


def test_it_says_one_address_and_ends_at_an_interrupt(tmp_path: Path) -> None:
    shutil.copytree(DOCK, tmp_path / "dock", ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    with subprocess.Popen(
        [*COMMAND, str(tmp_path / "dock")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    ) as studio:
        assert studio.stdout is not None
        said = studio.stdout.readline()
        found = re.fullmatch(r"the studio is at (http://127\.0\.0\.1:\d+/)([\w-]{32}/)\n", said)
        assert found, said
        with urlopen(found[1] + found[2], timeout=60) as answer:  # noqa: S310  # the address was matched
            assert b"rcsc studio" in answer.read()
        with pytest.raises(HTTPError, match="403"):
            urlopen(found[1], timeout=60)  # noqa: S310
        studio.send_signal(signal.SIGINT)  # while the tables are being compiled
        rest, errors = studio.communicate(timeout=120)
    assert (studio.returncode, rest, errors) == (0, "the studio is closed\n", "")


def test_what_is_not_in_order_is_not_served(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["studio"]) != 0
    assert "no system.toml" in capfd.readouterr().err
    assert run(["studio", "nothing"]) == 2
    (tmp_path / "system.toml").write_text("name = 3\n")
    assert run(["studio"]) == 1
    assert "the studio is at" not in capfd.readouterr().out
