"""Scripts as data: one row a command, as Fig. 7 prints them.

In: a CSV file with the columns command, part, source, dest, end_at and, where rows meet faults of the cell, fault. Out: rows, or what is
wrong with them, by row.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from rcsc.base.host.files.read import MIB, Malformed, rows_of, text
from rcsc.run.orders.script import FAULT, BadScript, faults_in

COLUMNS = ("command", "part", "source", "dest", "end_at")
ROBOT = ("acquire", "move", "release", "transfer", "clear", "pause")
MACHINE = ("ENGRAVE PART", "MACHINE DOVETAIL")
PARTS = {"BOXT": "tbox", "BOXB": "bbox", "FLAG": "flag", "HOUS": "hous", "CLOSE-GRIP": "close_grip"}
"""Parts as Fig. 7 calls them, and as the tables do."""


@dataclass(frozen=True, slots=True)
class ScriptRow:
    """One command.

    Attributes:
        number: As the file counts, from 1.
        robot: TASK's command; empty for the vise and the machine.
        vise: What each jaw is to do: `right` and `left`, True to open.
        machine: What the machine is to do.
        faults: The cell's faults that are on while it is under way.
    """

    number: int
    text: str
    robot: str = ""
    vise: Mapping[str, bool] = field(default_factory=dict)
    machine: str = ""
    part: str = ""
    grasp: int = 0
    source: str = ""
    dest: str = ""
    end_at: str = ""
    sector: int = 0
    faults: tuple[str, ...] = ()


def read_script(path: Path, faults: Sequence[str] = ()) -> tuple[ScriptRow, ...]:
    """Read the rows of a script.

    Args:
        path: The CSV file.
        faults: The names of the cell's faults.

    Raises:
        BadScript: The file cannot be read, or a row says nothing that a workstation can do.
    """
    try:
        return script_rows(text(path, MIB), f"{path}", faults)
    except OSError as error:
        raise BadScript(f"{path} cannot be read: {error.strerror}") from error
    except Malformed as error:
        raise BadScript(f"{path}: {error}") from error


def script_rows(said: str, where: str, faults: Sequence[str] = ()) -> tuple[ScriptRow, ...]:
    """The rows of a script's text; `where` names it in what is said of it.

    Raises:
        BadScript: A row says nothing that a workstation can do.
        Malformed: It has other columns.
    """
    lines = rows_of(said, COLUMNS, (FAULT,))
    rows, wrong = [], []
    for number, line in enumerate(lines, 1):
        try:
            row = _row(number, {key: value.strip() for key, value in line.items()})
            rows.append(replace(row, faults=faults_in(line.get(FAULT, ""), faults)))
        except ValueError as error:
            wrong.append(f"{where}, row {number}: {error}")
    if wrong:
        raise BadScript("\n".join(wrong))
    return tuple(rows)


def _row(number: int, line: Mapping[str, str]) -> ScriptRow:
    text = " ".join(line[key] for key in COLUMNS if line[key])
    command = line["command"]
    if command.startswith("VISE-"):
        return ScriptRow(number, text, vise=_jaws(command.removeprefix("VISE-")))
    if command in MACHINE:
        return ScriptRow(number, text, machine=command)
    if command.lower() not in ROBOT:
        raise ValueError(f"`{command}` is no command of the workstation")
    part, grasp = _part(line["part"])
    (source, a), (dest, b), (end_at, c) = (_place(line[key]) for key in ("source", "dest", "end_at"))
    return ScriptRow(number, text, command.lower(), {}, "", part, grasp, source, dest, end_at, max(a, b, c))


def _jaws(text: str) -> dict[str, bool]:
    """Read `OPEN RIGHT, CLOSE LEFT` and the like."""
    jaws = {}
    for jaw in text.split(","):
        words = jaw.split()
        if len(words) != 2 or words[0] not in ("OPEN", "CLOSE") or words[1] not in ("LEFT", "RIGHT"):
            raise ValueError(f"`VISE-{text}` says nothing that a vise can do")
        jaws[words[1].lower()] = words[0] == "OPEN"
    return jaws


def _part(text: str) -> tuple[str, int]:
    """Read `BOXT (2)`: a part, and the pair of faces that the fingers take."""
    if not text:
        return "", 0
    match = re.fullmatch(r"([A-Z-]+)(?: \((\d)\))?", text)
    if match is None or match[1] not in PARTS:
        raise ValueError(f"`{text}` is no part; known are {', '.join(PARTS)}")
    return PARTS[match[1]], int(match[2] or 0)


def _place(text: str) -> tuple[str, int]:
    """Read `STATION(3)`: a location, and its sector."""
    match = re.fullmatch(r"([A-Z0-9-]*)(?:\((\d+)\))?", text)
    if match is None:
        raise ValueError(f"`{text}` is no location")
    return match[1], int(match[2] or 0)
