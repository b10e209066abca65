"""`python -m tests.golden`.

`--step WORD` asks alone the commands whose name has the word: what one of them reads of an earlier one is then not there.
"""

import argparse
import difflib
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from tests.golden.said import said
from tests.golden.subjects import Subject, subjects

KEPT = Path(__file__).parent / "kept"
MOST_SHOWN = 60
"""Lines of a difference."""


def of(subject: Subject) -> dict[str, str]:
    """What the commands of a subject say, by the file that keeps it."""
    with tempfile.TemporaryDirectory(prefix="rcsc-golden-") as folder:
        return {f"{subject.name}/{step}.txt": text for step, text in said(subject, Path(folder)).items()}


def differences(now: dict[str, str], subject: Subject, asked_for: str = "") -> list[str]:
    """What differs from what is kept of the commands that were asked, as a text each."""
    kept = {
        f"{subject.name}/{path.name}": path.read_text(encoding="utf-8")
        for path in (KEPT / subject.name).glob("*.txt")
        if asked_for in path.stem
    }
    found = []
    for name in sorted({*kept, *now}):
        before, after = kept.get(name, ""), now.get(name, "")
        if before != after:
            lines = difflib.unified_diff(
                before.splitlines(), after.splitlines(), f"kept/{name}", "now", lineterm=""
            )
            found.append("\n".join(list(lines)[:MOST_SHOWN]))
    return found


def write(now: dict[str, str], subject: Subject, asked_for: str = "") -> None:
    """Keeps what is said now, and nothing else of the subject's commands that were asked."""
    for path in (KEPT / subject.name).glob("*.txt"):
        if asked_for in path.stem:
            path.unlink()
    for name, text in now.items():
        (KEPT / name).parent.mkdir(parents=True, exist_ok=True)
        (KEPT / name).write_text(text, encoding="utf-8")


def main() -> int:
    """The command; 1 where something differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.golden", description=__doc__)
    parser.add_argument("--write", action="store_true", help="keep what is said now")
    parser.add_argument("--only", default="", metavar="WORD", help="subjects whose name has it")
    parser.add_argument(
        "--step", default="", metavar="WORD", help="commands whose name has it, and no others"
    )
    parser.add_argument("--list", action="store_true", help="name them, and no more")
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    chosen = [
        replace(each, steps=tuple(step for step in each.steps if asked.step in step.name))
        for each in subjects()
        if asked.only in each.name
    ]
    chosen = [each for each in chosen if each.steps]
    if not chosen:
        parser.error(
            f"no subject's name has {asked.only!r} and a command {asked.step!r}: {', '.join(each.name for each in subjects())}"
        )
    if asked.list:
        print(*(f"{each.name}: {len(each.steps)} commands" for each in chosen), sep="\n")
        return 0
    found = 0
    with ThreadPoolExecutor(asked.jobs) as pool:  # each command is a process of its own
        for subject, now in zip(chosen, pool.map(of, chosen), strict=True):
            if asked.write:
                write(now, subject, asked.step)
                continue
            apart = differences(now, subject, asked.step)
            found += len(apart)
            print(*apart, f"{subject.name}: {len(apart)} of {len(now)} differ", sep="\n", flush=True)
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
