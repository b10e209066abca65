"""The C of a system beside the Python system: one script for both, everything compared after each tick.

In: a linked system, its description with its generated files, a script. Out: `Beside`: what was run, and the first difference.
The C is built into a library; where each leaf lies in the system's struct the compiler itself says.
"""

import ctypes
import re
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rcsc.base.host import children
from rcsc.run.description import Description
from rcsc.run.executors import compiled
from rcsc.run.levels import BadState, StateTableError
from rcsc.run.link.drawn_script import Begin, Published, Tick
from rcsc.run.link.wiring import Linked
from rcsc.run.signature import FORMATS, Value, Values
from rcsc.run.system import System, assemble


@dataclass(frozen=True, slots=True)
class Beside:
    """The outcome of a comparison.

    Attributes:
        ticks: Done in both, up to the first difference.
        restarts: Levels that started again; `refused` of them could not.
        faults: Ticks in which a level faulted.
        difference: The first, in words; empty for none.
    """

    ticks: int
    restarts: int
    refused: int
    faults: int
    difference: str


@dataclass(slots=True)
class _Told:
    """The script's part outside: it publishes the values of the script."""

    publishes: Published = field(default_factory=dict)

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:  # noqa: ARG002  # what all outside have
        return self.publishes


def run_beside(system: Linked, described: Description, script: Sequence[Tick]) -> Beside:
    """Run a script in the C of a system and in the Python system, and compare them.

    Args:
        system: What the C was made of; it asks no database and calls no function of the user's.
        described: Its description; its `generated` folder holds what was made.
        script: What happens.

    Raises:
        NotBuilt: The C could not be built.
    """
    told = _Told()
    python = assemble(described, "python", {}, [told])
    with children.scratch("beside") as folder:
        c = _InC(system, described.generated / "c", folder)
        return _Pair(python, told, c).run(script)


@dataclass(slots=True)
class _Pair:
    """Both systems, and their states after each tick.

    Attributes:
        before: After each tick, the leaves of every level in Python, and the whole of the C.
    """

    python: System
    told: _Told
    c: "_InC"
    before: list[tuple[dict[str, Values], bytes]] = field(default_factory=list)

    def run(self, script: Sequence[Tick]) -> Beside:
        """Run all ticks, or up to the first difference."""
        restarts = refused = faults = 0
        for number, tick in enumerate(script):
            for begin in tick.begins:
                in_python, in_c = self._begun(begin)
                restarts, refused = restarts + 1, refused + (not in_python)
                if in_python != in_c:
                    said = [("refused", "taken")[taken] for taken in (in_c, in_python)]
                    return self._ended(
                        number,
                        restarts,
                        refused,
                        faults,
                        f"a restart of `{begin[0]}` is {said[0]} in C and {said[1]} in Python",
                    )
            fault, difference = self._stepped(tick)
            faults += bool(fault)
            difference = difference or next(self._differences(), "")
            if difference:
                return self._ended(number, restarts, refused, faults, difference)
            self.before.append(
                ({level.name: level.executor.values() for level in self.python.levels}, self.c.memory.raw)
            )
        return Beside(len(script), restarts, refused, faults, "")

    def _ended(self, number: int, restarts: int, refused: int, faults: int, difference: str) -> Beside:
        return Beside(number, restarts, refused, faults, f"tick {number}: {difference}")

    def _begun(self, begin: Begin) -> tuple[bool, bool]:
        """Restart a level in both; return for Python and for C whether it accepted the state."""
        name, since, spoilt = begin
        values: Values | None = None
        if since is not None:
            values = self.before[since][0][name]
            if spoilt is not None:
                values = (*values[: spoilt[0]], spoilt[1], *values[spoilt[0] + 1 :])
        try:
            self.python.restart(name, values)
            taken = True
        except BadState:
            taken = False
        return taken, self.c.begin(name, None if since is None else self.before[since][1], spoilt)

    def _stepped(self, tick: Tick) -> tuple[str, str]:
        """Run one tick of each; return the level that faulted first, and the difference where they do not agree on it."""
        self.told.publishes = tick.publishes
        in_python = ""
        try:
            self.python.step()
        except StateTableError as error:
            in_python = re.findall(r"level `(\w+)`", str(error))[0]
        in_c = self.c.step()
        for source, values in tick.publishes.items():
            self.c.put(source, values)
        return in_python, "" if in_python == in_c else f"`{in_c}` faulted in C, `{in_python}` in Python"

    def _differences(self) -> Iterator[str]:
        for level in self.python.levels:
            names = [*(leaf.name for leaf in level.sign.leaves), *level.sign.trace]
            yield from _unequal(f"{level.name}.", names, self.c.values(level.name), level.executor.values())
        for wire in self.python.description.wires:
            latest = self.python.buffers.latest(wire.source)
            if latest is not None:
                in_c = self.c.values(wire.source)
                yield from _unequal(
                    f"buffer {wire.source} ", [f"[{at}]" for at, _ in enumerate(in_c)], in_c, latest
                )


def _unequal(what: str, names: Sequence[str], in_c: Values, in_python: Values) -> Iterator[str]:
    """Yield the values that differ; a NaN equals a NaN."""
    for name, one, other in zip(names, in_c, in_python, strict=True):
        if one != other and not (one != one and other != other):  # noqa: PLR0124  # a NaN is not equal to itself
            yield f"`{what}{name}` is {one!r} in C and {other!r} in Python"


class _InC:
    """The C of a system with its memory.

    Attributes:
        memory: The system's struct.
        places: Offset and format of each leaf, for each level by its name and each buffer by its source.
    """

    def __init__(self, system: Linked, sources: Path, folder: Path) -> None:
        self._names = ["", *(level.name for level in system.levels)]
        members = dict(_members(system))
        self._library = _built(system, sources, folder, members)
        count = sum(map(len, members.values())) + 1
        *offsets, size = list((ctypes.c_size_t * count).in_dll(self._library, "rcsc_places"))
        ahead = iter(offsets)
        self.places = {name: [(next(ahead), form) for _, form in leaves] for name, leaves in members.items()}
        self.memory = ctypes.create_string_buffer(b"\xaa" * size, size)
        init, self._step, self._restart, self._resume = (
            getattr(self._library, f"{system.word}_{name}") for name in ("init", "step", "restart", "resume")
        )
        self._step.restype = ctypes.c_uint8 if len(system.levels) < 256 else ctypes.c_uint16
        self._restart.restype = self._resume.restype = ctypes.c_int32
        init(self.memory)

    def step(self) -> str:
        """Run one step; return the level that faulted first, or empty for none."""
        return self._names[int(self._step(self.memory))]

    def begin(self, level: str, before: bytes | None, spoilt: tuple[int, Value] | None) -> bool:
        """Restart a level, anew or from a copy with one leaf changed; return whether it could."""
        number = self._names.index(level)
        if before is None:
            return bool(self._restart(self.memory, number) == -1)
        copy = ctypes.create_string_buffer(before, len(before))
        if spoilt is not None:
            at, form = self.places[level][spoilt[0]]
            struct.pack_into(f"={form}", copy, at, spoilt[1])
        return bool(self._resume(self.memory, number, copy) == -1)

    def put(self, source: str, values: Values) -> None:
        """Fill a buffer from outside."""
        for (at, form), value in zip(self.places[source], values, strict=True):
            struct.pack_into(f"={form}", self.memory, at, value)

    def values(self, name: str) -> Values:
        """Return leaves and trace of a level, or the leaves of a buffer."""
        return tuple(struct.unpack_from(f"={form}", self.memory, at)[0] for at, form in self.places[name])


def _members(system: Linked) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Yield each level and each buffer with the members of the struct that are its leaves, and their formats."""
    for level in system.levels:
        sign = level.program.sign
        leaves = [
            (f"{level.member}.{level.program.path(at)}", FORMATS[leaf.c_type])
            for at, leaf in enumerate(sign.leaves)
        ]
        trace = zip(sign.trace, sign.trace_format_in_c, strict=True)
        yield level.name, leaves + [(f"{level.member}.{name}", form) for name, form in trace]
    for buffer in system.buffers:
        end = buffer.end
        forms = (FORMATS[end.program.sign.leaves[at].c_type] for at in end.run)
        yield (
            buffer.wire.source,
            [(f"{buffer.place}{end.part(at)}", form) for at, form in zip(end.run, forms, strict=True)],
        )


def _built(
    system: Linked, sources: Path, folder: Path, members: Mapping[str, Sequence[tuple[str, str]]]
) -> ctypes.CDLL:
    """Build the library. Raises NotBuilt: there is no compiler, or it refused."""
    struct_name = f"{system.word}_t"
    places = ", ".join(
        f"offsetof({struct_name}, {member})" for leaves in members.values() for member, _ in leaves
    )
    (folder / "places.c").write_text(
        f'#include <stddef.h>\n#include "{system.word}.h"\nconst size_t rcsc_places[] = {{{places}, sizeof({struct_name})}};\n',
        encoding="utf-8",
    )
    files = [
        str(sources / f"{word}.c")
        for word in (system.word, *(program.names.program for program in system.programs))
    ]
    library = folder / "system.so"
    compiled(library, f"-I{sources}", str(folder / "places.c"), *files)
    return ctypes.CDLL(str(library))
