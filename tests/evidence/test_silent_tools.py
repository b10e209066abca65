"""A tool that fails, says nothing, or says something else is told, and never taken for one that finds nothing."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.base.host.tools import BuildFailed
from rcsc.code.testing.boards import BOARDS
from rcsc.views.evidence import analysers, coverage, llvm, resources, runtime
from rcsc.views.evidence.kind import Evidence
from rcsc.views.evidence.misra import compliance, cppcheck
from tests.evidence.subjects import EVERYTHING, subject_of

WAYS = {
    "silent": "exit 0",
    "failing": "exit 1",
    "chatting": "echo hello\necho world >&2",
    "crashing": "kill -SEGV $$",
}
Fake = Callable[[str, str], str]


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fake:
    """Makes a tool that goes wrong in one of the ways, and puts it before every other."""
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")

    def make(tool: str, way: str) -> str:
        path = tmp_path / tool
        path.write_text(f"#!/bin/sh\n{WAYS[way]}\n", "utf-8")
        path.chmod(0o755)
        return str(path)

    return make


def said(evidence: Evidence) -> str:
    """What is told as lacking."""
    assert all(short.what for short in evidence.shortfalls)
    return "\n".join([evidence.missing, *(f"{short.where}: {short.what}" for short in evidence.shortfalls)])


@pytest.mark.needs("clang-19", "llvm-cov-19")
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("tool", ["clang", "profdata", "cov"])
def test_nothing_is_measured_by_a_broken_part_of_llvm(tool: str, way: str, fake: Fake) -> None:
    real = llvm.tools()
    assert isinstance(real, llvm.Tools)
    named = {"clang": real.clang, "profdata": real.profdata, "cov": real.cov}
    broken = llvm.Tools(real.version, **{**named, tool: fake(tool, way)})
    main = '#include <stdio.h>\nint main(void) { return puts("1 vectors, 0 wrong") < 0; }\n'
    one = {"c/one.c": "int one(int a) { return (a > 0) ? 1 : 0; }\n"}
    assert isinstance(llvm.measured(llvm.Tools(real.version, **named), one, "one.c", main), llvm.Measured)
    failed = llvm.measured(broken, one, "one.c", main)
    assert isinstance(failed, BuildFailed)
    assert failed.text


@pytest.mark.needs("clang-19", "llvm-cov-19")
def test_vectors_that_were_not_all_played_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "input a : bool\noutput o : bool\ntable t {\n  | line | a || o |\n  | all | DEFAULT || a |\n}\n"
    monkeypatch.setattr(coverage, "vectors_c", lambda *_: "int main(void) { return 0; }\n")
    assert "the program that plays the vectors stopped" in said(coverage.collect(subject_of(text)))


@pytest.mark.parametrize("way", WAYS)
def test_analysers_that_tell_of_no_planted_fault_show_nothing(way: str, fake: Fake) -> None:
    for tool in analysers.TELLS:
        fake(tool, way)
    told = said(analysers.collect(subject_of(EVERYTHING)))
    for run in (
        "gcc -fanalyzer",
        "clang -Weverything",
        "clang-tidy",
        "sanitizers of gcc",
        "sanitizers of clang-19",
    ):
        assert f"{run}: " in told


def test_a_program_without_its_sanitizer_shows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analysers, "SANITIZERS", {"gcc": ("-fsanitize=undefined",)})
    monkeypatch.setattr(analysers, "_static", lambda _: iter(()))
    told = said(analysers.collect(subject_of(EVERYTHING)))
    assert "sanitizers of gcc: it tells nothing of a planted fault" in told


@pytest.mark.parametrize("way", WAYS)
def test_frama_c_without_a_report_shows_nothing(way: str, fake: Fake) -> None:
    fake("frama-c", way)
    runtime.version.cache_clear()
    told = said(runtime.collect(subject_of(EVERYTHING)))
    runtime.version.cache_clear()
    assert "any bytes: ended with status" in told


@pytest.mark.needs("arm-none-eabi-gcc", "qemu-system-arm")
@pytest.mark.parametrize("tool", ["objdump", "nm", "size"])
def test_an_image_that_its_tools_do_not_tell_of_has_no_figures(
    tool: str, fake: Fake, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resources, "BOARDS", [board for board in BOARDS if board.name == "Cortex-M3"])
    monkeypatch.setattr(resources, "COMBINATIONS", 1)
    fake(f"arm-none-eabi-{tool}", "silent")
    assert tool in said(resources.collect(subject_of(EVERYTHING)))


@pytest.mark.parametrize("left", ["addon", "everything"])
def test_a_checker_without_its_add_on_shows_nothing(left: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if left == "addon":
        monkeypatch.setattr(cppcheck, "_OPTIONS", [x for x in cppcheck._OPTIONS if "addon" not in x])
    else:
        monkeypatch.setattr(cppcheck, "_RUN", "")
    evidence = compliance.KIND.collect(subject_of(EVERYTHING))
    assert "planted" in evidence.missing
    assert not evidence.files
