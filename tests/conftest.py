"""What every test shares: Hypothesis profiles and the repository's root.

`ci`, the default, tries the same inputs every time, so that a red run can be had again; `long` looks for
new ones and for longer: `HYPOTHESIS_PROFILE=long pytest`.
"""

import os
import shutil
import signal
from collections.abc import Iterator
from ctypes.util import find_library
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from rcsc.front.commands import run
from tests.sets import THOROUGH, chosen, quick, whole

# A shell's `&` begins a command with SIGINT ignored, which all its children inherit; tests send it to them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "ci", derandomize=True, deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("long", derandomize=False, deadline=None, max_examples=5_000, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


@pytest.fixture(scope="session", autouse=True)
def _state(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What is kept of a user from one session to the next is the tests' own."""
    with pytest.MonkeyPatch.context() as set_:
        set_.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture
def kept_proofs(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """One cache for all tests of a run that ask for it, whichever worker runs them: what one has proved, the others recall."""
    mine = tmp_path_factory.getbasetemp()
    of_all = mine.parent if "PYTEST_XDIST_WORKER" in os.environ else mine
    monkeypatch.setenv("RCSC_CACHE_DIR", str(of_all / "kept_proofs"))


@pytest.fixture(scope="session")
def repo() -> Path:
    """The checkout's root."""
    return Path(__file__).parents[1]


@pytest.fixture(scope="session")
def small_proved(repo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the small system of two levels after `rcsc prove`; its cache holds what was proved. Only to be copied."""
    folder = tmp_path_factory.mktemp("proved") / "small"
    shutil.copytree(repo / "tests/data/composed", folder, ignore=shutil.ignore_patterns(".rcsc-cache"))
    with pytest.MonkeyPatch.context() as set_:
        set_.delenv("RCSC_CACHE_DIR", raising=False)
        assert run(["prove", str(folder / "system.toml"), "--trace", "0"]) == 0
    return folder


@pytest.fixture(scope="session")
def dock_compiled(repo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the docking robot, compiled. Only to be copied."""
    folder = tmp_path_factory.mktemp("compiled") / "dock"
    shutil.copytree(
        repo / "tests/data/dock", folder, ignore=shutil.ignore_patterns(".rcsc-cache", "__pycache__")
    )
    assert run(["compile", "-q", str(folder), "--out", str(folder / "generated")]) == 0
    return folder


@pytest.fixture
def dock(dock_compiled: Path, tmp_path: Path) -> Path:
    """The folder of a docking robot of the test's own."""
    folder = tmp_path / "dock"
    shutil.copytree(dock_compiled, folder)
    return folder


TOOLS = (
    "arm-none-eabi-gcc", "berkeley-abc", "chromium", "clang", "clang-19", "clang-tidy-19", "cmake", "egl", "frama-c", "llvm-cov-19",
    "pkg-config",
    "qemu-system-arm", "qemu-system-riscv32", "riscv64-unknown-elf-gcc",
    "valgrind",
)  # fmt: skip
"""What `needs` marks may name."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


def _missing(tool: str) -> bool:
    if tool == "egl":  # a library: what draws without a screen
        return find_library("EGL") is None
    return not any(shutil.which(name) for name in (BROWSERS if tool == "chromium" else (tool,)))


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leaves out, where quick tests alone are asked for, files that have none: most of the time would go into reading them."""
    if config.getoption("markexpr") != "quick" or not collection_path.match("test_*.py"):
        return None
    file = collection_path.relative_to(Path(__file__).parent).as_posix()
    return True if file not in {name.partition("::")[0] for name in chosen()} else None


@pytest.hookimpl(tryfirst=True)  # before `-m` is asked
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Marks what is quick or thorough (`tests.sets`) and puts what is quick first; leaves out what is thorough where nothing is asked for.

    What needs a tool that is not here is left out, too, as the run's end says. The tools are no Python packages: `.ci/run` installs them,
    and fails where it cannot; its summary names what not every release has.
    """
    quick_ones, thorough_ones = chosen(), chosen(THOROUGH)
    for item in items:
        name = item.nodeid.removeprefix("tests/")
        if quick(name.partition("[")[0], quick_ones):
            item.add_marker("quick")
        if name in thorough_ones:
            item.add_marker("thorough")
    # What most changes break shows in the first minute.
    items.sort(key=lambda item: "quick" not in item.keywords)
    of_all = whole(config)
    left_out = {
        item
        for item in items
        if (of_all and "thorough" in item.keywords)
        or any(_missing(tool) for mark in item.iter_markers("needs") for tool in mark.args)
    }
    if left_out:
        config.hook.pytest_deselected(items=[item for item in items if item in left_out])
        items[:] = [item for item in items if item not in left_out]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Says what was left out: what is thorough, and what needs tools that are not here."""
    if whole(config):
        terminalreporter.write_line("left out: what takes long; `pytest -m thorough` runs it")
    missing = sorted(tool for tool in TOOLS if _missing(tool))
    if missing:
        terminalreporter.write_line(f"NOT RUN: tests that need {', '.join(missing)} (packages of Debian's)")
