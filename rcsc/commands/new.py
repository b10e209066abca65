"""`rcsc new`: a small project, which checks, compiles and passes its tests as it stands."""

import re
import shlex
from pathlib import Path

import click

from rcsc.commands.shared.options import showing
from rcsc.commands.shared.show import Output, finish
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.diagnostics.report import Report
from rcsc.diagnostics.source import Span
from rcsc.host.files import write_atomically


@click.command("new", epilog="\b\nExample:\n  rcsc new gripper && cd gripper && rcsc check")
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@showing
def command(folder: Path, output: Output) -> int:
    """Make a small project in DIR, new or empty, that checks, compiles and passes its tests."""
    scaffold = _scaffold(folder)
    if not isinstance(scaffold, tuple):
        return finish(Report((scaffold,)), "new", output)
    place = shlex.quote(f"./{folder}" if str(folder).startswith("-") else str(folder))
    closing = f"made {len(scaffold)} files in {folder}; now: cd {place} && rcsc check"
    return finish(Report(()), "new", output, closing)


_PROJECT = """\
# The root of a project of rcsc tables. `use NAME` looks beside the file, then here.
name = "{name}"
exclude = []
"""

_VOCABULARY = """\
# Names that the tables share.
enum command { hold, open, close }
enum status { executing, done, failed }
"""

_TABLE = """\
# A gripper. In every cycle exactly one line must match, whatever comes in; `rcsc check` proves it.
use vocabulary

## What the level above wants.
input order : command
## What the hand reports.
input reported : status
## How far the jaws are apart; a reading outside the range is clamped to it.
input width_mm : int 0 .. 110 [mm] clamp

## How many parts were gripped.
state count : int 0 .. 1000

output command_to_hand : command
output report : status

procedure count_part {
  count := min(count + 1, 1000)
}

table grip {
  | line   | order | reported  | width_mm || procedures | command_to_hand | report    |
  |--------|-------|-----------|----------||------------|-----------------|-----------|
  | rest   | hold  |           |          ||            | hold            | done      |
  | let_go | open  |           |          ||            | open            | done      |
  | wait   | close | executing |          ||            | close           | executing |
  | missed | close | done      | < 20     ||            | open            | failed    |
  | held   | close | done      | 20 .. 40 || count_part | hold            | done      |
  | wide   | close | done      | > 40     ||            | open            | failed    |
  | broken | close | failed    |          ||            | hold            | failed    |
}

level gripper {
  period 40 [ms]
  table grip
}
"""

_README = """\
# {name}

    rcsc check          # prove that exactly one line matches, or see an input for which that is false
    rcsc compile        # write the Python and C executors to generated/
    rcsc test           # interpreter = Python = C, on inputs that lean on edges
    rcsc fmt            # align the tables

Take a line out of `gripper.rcs` and check again.
"""

_FILES = {
    "rcsc.toml": _PROJECT,
    "vocabulary.rcs": _VOCABULARY,
    "gripper.rcs": _TABLE,
    "README.md": _README,
    ".gitignore": ".rcsc-cache/\n.hypothesis/\n__pycache__/\n",
}


def _scaffold(folder: Path) -> tuple[Path, ...] | Diagnostic:
    """Make the project in `folder`, new or empty; what was written, or why not."""
    name = re.sub(r"\W", "_", folder.resolve().name, flags=re.ASCII) or "robot"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            return _refused(folder, "the folder is not empty")
        written = []
        for file, text in _FILES.items():
            filled = text.format(name=name) if file in {"rcsc.toml", "README.md"} else text
            write_atomically(folder / file, filled.encode())
            written.append(folder / file)
    except OSError as error:
        return _refused(folder, error.strerror or type(error).__name__)
    return tuple(written)


def _refused(folder: Path, why: str) -> Diagnostic:
    message = f"cannot make a project in `{folder}`: {why}"
    return Diagnostic(Code.NOT_WRITTEN, message, Label(Span(str(folder), 0, 0)))
