"""What a command says and writes, without what differs from one machine, or one run, to another."""

import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.golden.subjects import Step, Subject

MOST = 30_000
"""Characters that are kept of a text; its digest stands for the rest."""
LIMIT_S = 600
_FIGURES = (
    (re.compile(r"\b\d[\d.,]* ms\b"), "# ms"),
    (re.compile(r"(?m)(^(?:level|in) .*?|^)\b\d+\.\d+ s\b(?= in all|$)"), r"\1# s"),
    (re.compile(r"\d+\.\d s, by an earlier run"), "# s, by an earlier run"),
    (re.compile(r"played now in .*"), "played now in #"),
    (re.compile(r"-[0-9a-f]{16}\.jsonl"), "-#.jsonl"),  # a digest of rcsc's own sources, too
    (re.compile(r"in \d[\d.]* s: \d+ times as fast"), "in # s: # times as fast"),
    (re.compile(r'("[a-z_]*(?:_s|_ms|seconds|milliseconds|took|time)": )[\d.]+'), r"\1#"),
)


def said(subject: Subject, folder: Path) -> dict[str, str]:
    """What each command of the subject says, in turn, by its name."""
    place = folder / subject.name
    subject.make(place)
    return {step.name: _said(step, place, place / subject.at) for step in subject.steps}


def _said(step: Step, place: Path, here: Path) -> str:
    kept = {"NO_COLOR": "1", "COLUMNS": "100", "XDG_STATE_HOME": str(place / ".state"), "PYTHONHASHSEED": "0"}
    ran = subprocess.run(
        [str(Path(sys.executable).with_name("rcsc")), *step.args],
        cwd=here, env={**os.environ, **kept}, stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT_S, check=False,
    )  # fmt: skip
    printed = (("printed", ran.stdout), ("told", ran.stderr))
    parts = [f"$ rcsc {' '.join(step.args)}", f"status {ran.returncode}"]
    parts += [
        f"--- {what}\n{_short(text.decode('utf-8', 'replace'), place)}" for what, text in printed if text
    ]
    return "\n".join([*parts, *_written(step, place), ""])


def _short(text: str, place: Path) -> str:
    text = text.replace(str(place), "PLACE").rstrip("\n")
    for figure, instead in _FIGURES:
        text = figure.sub(instead, text)
    if len(text) <= MOST:
        return text
    return f"{text[:MOST]}\n... {len(text)} characters, {hashlib.sha256(text.encode()).hexdigest()}"


def _written(step: Step, place: Path) -> Iterator[str]:
    for pattern in step.files:
        for path in sorted(each for each in place.glob(pattern) if each.is_file()):
            data = path.read_bytes()
            yield f"{path.relative_to(place)}: {len(data)} bytes, {hashlib.sha256(data).hexdigest()}"
