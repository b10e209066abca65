"""A run that stopped, kept in a file from which another process goes on: levels, buffers, the workstation, and what stands outside.

In: a run whose script was stopped. Out: `.rcsc-cache/SYSTEM.stopped.json` beside the data; and back. The file is believed only if it is
whole, of the script that is run, and of the executors and locations that are there now: the levels' states mean nothing to others.
"""

import contextlib
import hashlib
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

from rcsc.diagnostics.coded import CodedError
from rcsc.diagnostics.codes import Code
from rcsc.host.files import write_atomically
from rcsc.host.files.names import shown
from rcsc.host.files.plain import read
from rcsc.host.files.read import content, json_of
from rcsc.run.description import Description
from rcsc.run.levels import BadState, RunningLevel
from rcsc.run.signature import generated_files
from rcsc.run.system import Outside
from rcsc_cell.workstation.orders import BETWEEN, KINDS
from rcsc_cell.workstation.prepared import ScriptDraft
from rcsc_cell.workstation.script import ScriptRow
from rcsc_cell.workstation.station import Workstation

FORM = 1
"""Of the file; another is not read."""
LATEST_TICK = 2**40
"""Ticks count up from where the stopped run was; a log has 64 bits for nanoseconds."""


class NotResumed(CodedError):  # noqa: N818  # what happened, not an error of ours
    """There is nothing to go on from; says why. Nothing has moved."""

    helps = ("`--from-row N` begins anew at row N",)

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code


@runtime_checkable
class Restorable(Protocol):
    """Something outside that can be put back; a real plant cannot, and is where it is."""

    def state(self) -> dict[str, Any]:
        """Its state in plain values: what JSON keeps exactly."""
        ...

    def restore(self, state: Mapping[str, Any]) -> None:
        """Takes a state.

        Raises:
            ValueError: It is no state of its kind.
        """
        ...


def stopped_path(system: Description) -> Path:
    """Where a stopped run of the system is kept."""
    return system.database.parent / ".rcsc-cache" / f"{system.name}.stopped.json"


def keep(run: ScriptDraft, script: str) -> Path:
    """Save where the run stands.

    Args:
        run: Its script was stopped, and TASK has paused.
        script: What the user calls it.

    Raises:
        OSError: It could not be written.
    """
    system = run.system
    stopped: dict[str, Any] = {
        "form": FORM,
        "script": script,
        "rows": rows_digest(run.station.rows),
        "tables": tables_digest(system.description),
        "locations": dict(run.database.locations),
        "tick": system.tick,
        "station": run.station.state(),
        "levels": {level.name: list(level.values) for level in system.levels},
        "buffers": {
            name: list(held) for name in _buffers(run) if (held := system.buffers.latest(name)) is not None
        },
        "outside": {name: restorable.state() for name, restorable in _restorable(system.outside)},
    }
    path = stopped_path(system.description)
    path.parent.mkdir(parents=True, exist_ok=True)
    body = _text(stopped)
    write_atomically(path, json.dumps({"digest": _digest(body), "stopped": stopped}, indent=1).encode())
    return path


def forget(system: Description) -> None:
    """Remove what was kept: the cell has moved on. Where nothing can be removed, nothing was kept, either."""
    with contextlib.suppress(OSError):
        stopped_path(system).unlink(missing_ok=True)


def go_on(run: ScriptDraft) -> None:
    """Put a run that has not begun where the stopped one stood; try its row again.

    Raises:
        NotResumed: There is nothing to go on from, or it is of another script, other tables or another cell.
    """
    stopped = _read(stopped_path(run.system.description))
    _same(run, stopped)
    try:
        _put(run, stopped)
    except (ValueError, struct.error) as error:
        raise NotResumed(Code.BAD_SYSTEM, f"the stopped run is of another cell: {error}") from error


def rows_digest(rows: Sequence[ScriptRow]) -> str:
    """Return a digest of what a script says, not of how it is spelled."""
    return _digest(_text([asdict(row) for row in rows]))


def tables_digest(system: Description) -> str:
    """Return a digest of the generated executors and the wiring."""
    hashed = hashlib.sha256(repr((system.tick_ms, system.levels, system.wires)).encode())
    for program in sorted({level.program for level in system.levels}):
        for path in generated_files(system.generated, program):
            hashed.update(hashlib.sha256(content(path)).digest())
    return hashed.hexdigest()


@dataclass(frozen=True, slots=True)
class _Stopped:
    """What the file holds."""

    form: Literal[1]
    script: str
    rows: str
    tables: str
    locations: Mapping[str, int]
    tick: int
    station: Mapping[str, Any]
    levels: Mapping[str, list[bool | int | float]]
    buffers: Mapping[str, list[bool | int | float]]
    outside: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, slots=True)
class _Whole:
    digest: str
    stopped: Any


def _held(text: bytes) -> _Stopped:
    """Raises: ValueError: The file is not whole, or is no stopped run."""
    whole: _Whole = read(_Whole, json_of(text))
    stopped: _Stopped = read(_Stopped, whole.stopped)
    if whole.digest != _digest(_text(whole.stopped)):
        raise ValueError("its digest is another")
    if not 0 <= stopped.tick < LATEST_TICK:
        raise ValueError("its tick is none")
    return stopped


def _read(path: Path) -> _Stopped:
    try:
        return _held(content(path))
    except FileNotFoundError as error:
        raise NotResumed(
            Code.NOT_RESUMED, "there is nothing to resume: the last run was not stopped"
        ) from error
    except OSError as error:
        raise NotResumed(Code.NOT_RESUMED, f"the stopped run cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise NotResumed(
            Code.NOT_RESUMED,
            f"the stopped run in {path.name} is damaged, or of another version of rcsc: {error}",
        ) from error


def _same(run: ScriptDraft, stopped: _Stopped) -> None:
    """Refuse another script, other executors or another cell."""
    if stopped.rows != rows_digest(run.station.rows):
        raise NotResumed(
            Code.NOT_RESUMED,
            f"script `{stopped.script}` was stopped, and this is another, or it has changed since",
        )
    if stopped.tables != tables_digest(run.system.description):
        raise NotResumed(
            Code.BAD_SYSTEM,
            "the tables have changed since the script was stopped: its levels' states mean nothing to them",
        )
    if stopped.locations != dict(run.database.locations):
        raise NotResumed(
            Code.BAD_DATA,
            "locations have come or gone since the script was stopped: levels point to the old ones",
        )


def _put(run: ScriptDraft, stopped: _Stopped) -> None:
    """Raises: ValueError, struct.error: Something in it is no state of this cell; NotResumed: a level cannot go on from its own."""
    system, outside = run.system, dict(_restorable(run.system.outside))
    if stopped.levels.keys() != {level.name for level in system.levels}:
        raise ValueError("it has other levels")
    for name, state in stopped.outside.items():
        if name not in outside:
            raise ValueError(f"nothing outside is a {shown(name)}")
        outside[name].restore(state)
    for level in system.levels:
        try:
            level.restore(_values(level, stopped.levels[level.name]))
        except BadState as error:
            raise NotResumed(Code.NOT_RESUMED, str(error)) from error
    forms = system.forms
    for name, values in stopped.buffers.items():
        if name in BETWEEN:
            read(KINDS[name], values)
        elif name in forms:
            struct.pack(forms[name], *values)
        else:
            raise ValueError(f"there is no buffer {shown(name)}")
        system.buffers.publish(name, tuple(values))
    run.station.restore(stopped.station)
    system.tick = stopped.tick


def _values(level: RunningLevel, values: Sequence[Any]) -> tuple[Any, ...]:
    if len(values) != len(level.values):
        raise ValueError(f"level `{level.name}` has {len(level.values)} values, not {len(values)}")
    return tuple(values)


def _buffers(run: ScriptDraft) -> Iterator[str]:
    """Names of all buffers that something may have been published in."""
    yield from dict.fromkeys(wire.source for wire in run.system.description.wires)
    yield from BETWEEN


def _restorable(outside: Sequence[Outside]) -> Iterator[tuple[str, Restorable]]:
    """Yield what stands outside and can be put back, by kind; a second of a kind is numbered. The workstation is apart."""
    seen: dict[str, int] = {}
    for part in outside:
        if isinstance(part, Restorable) and not isinstance(part, Workstation):
            kind = type(part).__name__
            seen[kind] = seen.get(kind, 0) + 1
            yield (kind if seen[kind] == 1 else f"{kind} {seen[kind]}"), part


def _text(value: object) -> bytes:
    return json.dumps(value, sort_keys=True, separators=(",", ":")).encode()


def _digest(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()
