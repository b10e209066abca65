"""A run that stopped, kept in a file from which another process goes on: levels, buffers, who gives orders, and what stands outside.

In: a run whose script was stopped. Out: `.rcsc-cache/SYSTEM.stopped.json` beside the system; and back. The file is believed only if it is
whole, of the script that is run, and of the executors and places that are there now: the levels' states mean nothing to others.
"""

import contextlib
import hashlib
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol, cast, runtime_checkable

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.names import shown
from rcsc.base.host.files.plain import read
from rcsc.base.host.files.read import content, json_of
from rcsc.run.description import Description
from rcsc.run.levels import BadState, RunningLevel
from rcsc.run.orders.operator import ScriptedRun, ScriptRow
from rcsc.run.signature import generated_files

FORM = 2
"""Of the file; another is not read."""
LATEST_TICK = 2**40
"""Ticks count up from where the stopped run was; a log has 64 bits for nanoseconds."""


class NotResumed(CodedError):  # noqa: N818  # what happened, not an error of ours
    """A stopped run that cannot be continued, with the reason. Nothing has moved."""

    helps = ("`--from-row N` begins anew at row N",)

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code


@runtime_checkable
class Restorable(Protocol):
    """A part outside that can be put back; a real plant cannot, and is where it is."""

    def state(self) -> dict[str, Any]:
        """Return its state in plain values, which JSON keeps exactly."""
        ...

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state.

        Raises:
            ValueError: It is no state of its kind.
        """
        ...


class NotKept(Exception):  # noqa: N818  # likewise
    """A part outside with a value that no file holds; names it."""


@runtime_checkable
class RestorableOperator(Restorable, Protocol):
    """An operator that can be put back."""

    @property
    def rows(self) -> Sequence[ScriptRow]:
        """All rows of the script."""
        ...


def stopped_path(system: Description) -> Path:
    """Return the path where a stopped run of the system is kept."""
    return system.database.parent / ".rcsc-cache" / f"{system.name}.stopped.json"


@dataclass(frozen=True, slots=True)
class StoppedRuns:
    """Keeps a stopped run of a system, and continues it.

    Attributes:
        places: What numbers in the levels' states stand for outside, by name: where they have changed nothing goes on.
        between: The types of the buffers that no level has.
    """

    system: Description
    places: Mapping[str, int] = field(default_factory=dict)
    between: Mapping[str, Any] = field(default_factory=dict)

    def keep(self, run: ScriptedRun, script: str) -> Path:
        """Save the state of a stopped run.

        Args:
            run: Its script was stopped, and its level rests.
            script: What the user calls it.

        Raises:
            OSError: It could not be written.
            NotKept: A part outside has a value that no file holds.
        """
        operator, system = _operator(run), run.system
        stopped: dict[str, Any] = {
            "form": FORM,
            "script": script,
            "rows": rows_digest(operator.rows),
            "tables": tables_digest(self.system),
            "places": dict(self.places),
            "tick": system.tick,
            "operator": operator.state(),
            "levels": {level.name: list(level.values) for level in system.levels},
            "buffers": {
                name: list(held)
                for name in self._buffers()
                if (held := system.buffers.latest(name)) is not None
            },
            "outside": {name: restorable.state() for name, restorable in _restorable(run)},
        }
        path = stopped_path(self.system)
        path.parent.mkdir(parents=True, exist_ok=True)
        body = _text(stopped)
        write_atomically(path, json.dumps({"digest": _digest(body), "stopped": stopped}, indent=1).encode())
        return path

    def forget(self) -> None:
        """Remove the kept run: the system has moved on. Where nothing can be removed, nothing was kept, either."""
        with contextlib.suppress(OSError):
            stopped_path(self.system).unlink(missing_ok=True)

    def go_on(self, run: ScriptedRun) -> None:
        """Put a run that has not begun into the state of the stopped one; its row is tried again.

        Raises:
            NotResumed: No run was kept, or it is of another script, other tables or another plant.
        """
        stopped = _read(stopped_path(self.system))
        self._same(run, stopped)
        try:
            self._put(run, stopped)
        except (ValueError, struct.error) as error:
            raise NotResumed(Code.BAD_SYSTEM, f"the stopped run is of another plant: {error}") from error

    def _same(self, run: ScriptedRun, stopped: "_Stopped") -> None:
        """Refuse another script, other executors or other places."""
        if stopped.rows != rows_digest(_operator(run).rows):
            raise NotResumed(
                Code.NOT_RESUMED,
                f"script `{stopped.script}` was stopped, and this is another, or it has changed since",
            )
        if stopped.tables != tables_digest(self.system):
            raise NotResumed(
                Code.BAD_SYSTEM,
                "the tables have changed since the script was stopped: its levels' states mean nothing to them",
            )
        if stopped.places != dict(self.places):
            raise NotResumed(
                Code.BAD_DATA,
                "locations have come or gone since the script was stopped: levels point to the old ones",
            )

    def _put(self, run: ScriptedRun, stopped: "_Stopped") -> None:
        """Raises: ValueError, struct.error: Something in it is no state of this system; NotResumed: a level cannot go on from its own."""
        system, outside = run.system, dict(_restorable(run))
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
            if name in self.between:
                read(self.between[name], values)
            elif name in forms:
                struct.pack(forms[name], *values)
            else:
                raise ValueError(f"there is no buffer {shown(name)}")
            system.buffers.publish(name, tuple(values))
        _operator(run).restore(stopped.operator)
        system.tick = stopped.tick

    def _buffers(self) -> Iterator[str]:
        """Yield the names of all buffers that may hold a published value."""
        yield from self.system.readers()
        yield from self.between


def rows_digest(rows: Sequence[ScriptRow]) -> str:
    """Return a digest of what a script says, not of how it is spelled."""
    return _digest(_text([asdict(cast(Any, row)) for row in rows]))


def tables_digest(system: Description) -> str:
    """Return a digest of the generated executors and the wiring."""
    hashed = hashlib.sha256(repr((system.tick_ms, system.levels, system.wires)).encode())
    for program in sorted({level.program for level in system.levels}):
        for path in generated_files(system.generated, program):
            hashed.update(hashlib.sha256(content(path)).digest())
    return hashed.hexdigest()


@dataclass(frozen=True, slots=True)
class _Stopped:
    """The content of the file."""

    form: Literal[2]
    script: str
    rows: str
    tables: str
    places: Mapping[str, int]
    tick: int
    operator: Mapping[str, Any]
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


def _values(level: RunningLevel, values: Sequence[Any]) -> tuple[Any, ...]:
    if len(values) != len(level.values):
        raise ValueError(f"level `{level.name}` has {len(level.values)} values, not {len(values)}")
    return tuple(values)


def _operator(run: ScriptedRun) -> RestorableOperator:
    """Return the operator, if it can be put back.

    Raises:
        NotResumed: There is no operator, or it cannot be put back.
    """
    operator: object = run.operator
    if isinstance(operator, RestorableOperator):
        return operator
    raise NotResumed(Code.NOT_RESUMED, "there is no script that could be gone on with")


def _restorable(run: ScriptedRun) -> Iterator[tuple[str, Restorable]]:
    """Yield the parts outside that can be put back, by kind; a second of a kind is numbered. The operator is left out."""
    seen: dict[str, int] = {}
    operator: object = run.operator
    for part in run.system.outside:
        if isinstance(part, Restorable) and part is not operator:
            kind = type(part).__name__
            seen[kind] = seen.get(kind, 0) + 1
            yield (kind if seen[kind] == 1 else f"{kind} {seen[kind]}"), part


def _text(value: object) -> bytes:
    return json.dumps(value, sort_keys=True, separators=(",", ":")).encode()


def _digest(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()
