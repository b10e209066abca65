"""A system run by a script of drawn outside values, restarts and refused inputs: by the Python system and by its C.

The C is seen from outside: places of leaves are what the compiler says of the members that the header documents
(`in.PARTY.NAME`, `out.PARTY.NAME`, `between.LEVEL_NAME`, `LEVEL.MEMBER`).
"""

import ctypes
import re
import struct
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

from rcsc.run.description import Description
from rcsc.run.levels import BadState, Query, StateTableError
from rcsc.run.link.drawn_script import Published, Tick
from rcsc.run.signature import FORMATS, Signature, Values
from rcsc.run.system import System, assemble

Seen: TypeAlias = tuple[object, ...]
"""What is compared of a tick: who faulted, what each restart gave, every leaf of every level, every buffer."""


# --- in Python -----------------------------------------------------------------------------


@dataclass
class Told:
    """What stands outside, and publishes what a test says."""

    publishes: Published = field(default_factory=dict)

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:  # noqa: ARG002  # what all outside have
        return self.publishes


def by_python(
    system: Description, ticks: Sequence[Tick], queries: Mapping[str, Query] | None = None
) -> list[Seen]:
    told = Told()
    running = assemble(system, "python", queries or {}, [told])
    history: list[dict[str, Values]] = []
    states = tuple(level.sign.packed.pack(*level.values) for level in running.levels)
    seen: list[Seen] = [("", (True,), states, _begun(running))]
    for tick in ticks:
        results = []
        for name, since, spoilt in tick.begins:
            values = None if since is None else history[since][name]
            if values is not None and spoilt is not None:
                values = (*values[: spoilt[0]], spoilt[1], *values[spoilt[0] + 1 :])
            try:
                running.restart(name, values)
                results.append(True)
            except BadState:
                results.append(False)
        told.publishes = tick.publishes
        try:
            running.step()
            faulty = ""
        except StateTableError as error:
            faulty = re.findall(r"level `(\w+)`", str(error))[0]
        history.append({level.name: level.executor.values() for level in running.levels})
        seen.append(seen_of(running, faulty, tuple(results)))
    return seen


def seen_of(running: System, faulty: str, results: tuple[bool, ...]) -> Seen:
    """What is compared, after a tick."""
    states = tuple(level.sign.packed.pack(*level.executor.values()) for level in running.levels)
    return faulty, results, states, _buffers(running)


def _begun(running: System) -> tuple[bytes, ...]:
    """What a buffer holds in C from the beginning: what its reader begins with, or its giver where nobody in the system reads it."""
    signs = {level.name: level.sign for level in running.levels}
    found = []
    for wire in running.description.wires:
        ends = (end.partition(".")[::2] for end in (wire.target, wire.source))
        level, variable = next((level, variable) for level, variable in ends if level in signs)
        initial = [signs[level].leaves[at].initial for at in signs[level].record(variable)]
        found.append(struct.pack(running.forms[wire.source], *initial))
    return tuple(found)


def _buffers(running: System) -> tuple[bytes | None, ...]:
    latest = ((wire.source, running.buffers.latest(wire.source)) for wire in running.description.wires)
    return tuple(
        None if values is None else struct.pack(running.forms[name], *values) for name, values in latest
    )


# --- in C ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Slots:
    """Some leaves in the system's struct: the offset and the format of each."""

    offsets: tuple[int, ...]
    formats: tuple[str, ...]

    def read(self, memory: bytes) -> Values:
        return tuple(
            struct.unpack_from(f"={form}", memory, at)[0]
            for at, form in zip(self.offsets, self.formats, strict=True)
        )


FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-Wall", "-Werror")


class CSystem:
    """The C of a system in a library.

    Attributes:
        word: What its names begin with.
    """

    def __init__(
        self,
        system: Description,
        signs: Mapping[str, Signature],
        folder: Path,
        queries: Mapping[str, Query] | None = None,
        word: str = "",
    ) -> None:
        self.system, self.signs, self.folder, self.word = system, signs, folder, word or system.name
        self.queries = queries or {}
        self._callbacks: list[object] = []
        self._members = [self._level_members(level.name) for level in system.levels]
        self._members += [self._buffer_members(wire.source, wire.target) for wire in system.wires]
        self._objects = self._built()

    def _level_members(self, level: str) -> list[tuple[str, str]]:
        sign = self.signs[level]
        leaves = [(f"{level}.{leaf.place}", FORMATS[leaf.c_type]) for leaf in sign.leaves]
        return leaves + [
            (f"{level}.{name}", form) for name, form in zip(sign.trace, sign.trace_format_in_c, strict=True)
        ]

    def _buffer_members(self, source: str, target: str) -> list[tuple[str, str]]:
        ends = [end.partition(".")[::2] for end in (source, target)]
        (giver, given), (taker, taken) = ends
        if taker not in self.signs:
            level, variable, place = giver, given, f"out.{taker}.{_flat(taken)}"
        else:
            level, variable = taker, taken
            place = f"in.{giver}.{_flat(given)}" if giver not in self.signs else f"between.{_flat(source)}"
        sign = self.signs[level]
        leaves = [sign.leaves[at] for at in sign.record(variable)]
        return [(f"{place}{leaf.place.removeprefix(variable)}", FORMATS[leaf.c_type]) for leaf in leaves]

    def _built(self) -> list[str]:
        """The objects of what no mutant changes."""
        word = self.word
        members = ", ".join(f"offsetof({word}_t, {name})" for run in self._members for name, _ in run)
        answers = "".join(self._answer(at, *ask) for at, ask in enumerate(self._asked()))
        (self.folder / "seen.c").write_text(
            f'#include <stddef.h>\n#include "{word}.h"\nconst size_t seen_places[] = {{{members}, sizeof({word}_t)}};\n'
            "void (*seen_ask)(int which, const double *keys, double *answer);\n" + answers
        )
        include = f"-I{self.system.generated / 'c'}"
        programs = sorted({sign.program for sign in self.signs.values()})
        sources = [str(self.system.generated / f"c/{program}.c") for program in programs]
        subprocess.run(["cc", *FLAGS, include, "-c", "seen.c", *sources], cwd=self.folder, check=True)
        return ["seen.o", *(f"{program}.o" for program in programs)]

    def _asked(self) -> list[tuple[str, str, str]]:
        """Each function of the user's: its query, its prototype, a feed that it fills."""
        header = (self.system.generated / f"c/{self.word}.h").read_text(encoding="utf-8")
        found = re.findall(
            rf"/\* yours: (\S+) of [^*]*\*/\nextern (void {self.word}_(\w+)\([^)]*\));", header
        )
        return [(query, head, fills) for fills, head, query in found]

    def _answer(self, at: int, query: str, head: str, fills: str) -> str:
        """A function of the user's that asks Python."""
        assert query in self.queries
        level, _, into = fills.partition(".")
        sign = self.signs[level]
        leaves = [sign.leaves[one] for one in sign.record(into)]
        keys = ", ".join(f"(double){key}" for key in re.findall(r"key_\d+", head))
        sets = "".join(
            f"answer->{leaf.place.removeprefix(f'{into}.')} = ({leaf.c_type})got[{number}]; "
            for number, leaf in enumerate(leaves)
        )
        return f"{head} {{ double got[{len(leaves)}]; const double keys[] = {{{keys}}}; seen_ask({at}, keys, got); {sets}}}\n"

    def play(self, ticks: Sequence[Tick]) -> list[Seen]:
        return self._played(self._linked(self.text, FLAGS), ticks, self.word)

    @property
    def text(self) -> str:
        return (self.system.generated / f"c/{self.word}.c").read_text(encoding="utf-8")

    def play_mutants(
        self, ticks: Sequence[Tick], texts: Sequence[str], expected: Sequence[Seen]
    ) -> Iterator[list[Seen]]:
        """What each mutant of the source does, up to where it does something else; they are built together, under other names."""
        include, _, _ = self.text.partition('.h"\n')
        own = re.compile(
            rf"\b{self.word}_(?=(init|step|restart|resume|take_\w+|give_\w+|restart_\w+|resume_\w+)\()"
        )
        bodies = (own.sub(f"mutant{at}_", text.partition('.h"\n')[2]) for at, text in enumerate(texts))
        library = self._linked(f'{include}.h"\n{"".join(bodies)}', ("-std=c99", "-O0", "-fPIC"))
        for at, _ in enumerate(texts):
            yield self._played(library, ticks, f"mutant{at}", expected)

    def _linked(self, text: str, flags: Sequence[str]) -> ctypes.CDLL:
        (self.folder / "system.c").write_text(text)
        library = self.folder / f"system{len(list(self.folder.glob('*.so')))}.so"
        command = ["cc", *flags, f"-I{self.system.generated / 'c'}", "-shared", "system.c", *self._objects]
        subprocess.run([*command, "-o", library.name], cwd=self.folder, check=True)
        return ctypes.CDLL(str(library))

    def _played(
        self, library: ctypes.CDLL, ticks: Sequence[Tick], word: str, expected: Sequence[Seen] = ()
    ) -> list[Seen]:
        count = sum(map(len, self._members)) + 1
        *places, size = list((ctypes.c_size_t * count).in_dll(library, "seen_places"))
        runs = [0]
        for members in self._members:
            runs.append(runs[-1] + len(members))
        slots = [
            Slots(tuple(places[first:end]), tuple(form for _, form in members))
            for (first, end), members in zip(pairwise(runs), self._members, strict=True)
        ]
        self._hear(library)
        return _Playing(self, library, slots, ctypes.create_string_buffer(b"\xaa" * size, size)).all(
            ticks, word, expected
        )

    def _hear(self, library: ctypes.CDLL) -> None:
        asked = self._asked()
        kind = ctypes.CFUNCTYPE(
            None, ctypes.c_int, ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_double)
        )

        def answer(
            which: int, keys: "ctypes._Pointer[ctypes.c_double]", got: "ctypes._Pointer[ctypes.c_double]"
        ) -> None:
            query, head, _ = asked[which]
            given = [int(keys[at]) for at, _ in enumerate(re.findall(r"key_\d+", head))]
            for at, value in enumerate(self.queries[query](*given)):
                got[at] = float(value)

        if asked:
            self._callbacks.append(kind(answer))
            ctypes.memmove(
                ctypes.addressof(ctypes.c_void_p.in_dll(library, "seen_ask")),
                ctypes.byref(ctypes.cast(self._callbacks[-1], ctypes.c_void_p)),  # type: ignore[arg-type]  # a callback is a pointer
                ctypes.sizeof(ctypes.c_void_p),
            )


def _flat(text: str) -> str:
    return re.sub(r"\W+", "_", text).strip("_")


@dataclass
class _Playing:
    """One run of a library."""

    system: CSystem
    library: ctypes.CDLL
    slots: list[Slots]
    memory: "ctypes.Array[ctypes.c_char]"
    given: set[str] = field(default_factory=set)

    def all(self, ticks: Sequence[Tick], word: str, expected: Sequence[Seen]) -> list[Seen]:
        init, step, restart, resume = (
            getattr(self.library, f"{word}_{name}") for name in ("init", "step", "restart", "resume")
        )
        step.restype = ctypes.c_uint16 if len(self.system.system.levels) > 255 else ctypes.c_uint8
        restart.restype = resume.restype = ctypes.c_int32
        names = ["", *(level.name for level in self.system.system.levels)]
        init(self.memory)
        refused = [
            restart(self.memory, level) == -2 == resume(self.memory, level, self.memory)
            for level in (0, len(names))
        ]
        history: list[bytes] = []
        seen: list[Seen] = [("", (all(refused),), self._states(), self._buffers(begun=True))]
        for tick in ticks:
            results = []
            for name, since, spoilt in tick.begins:
                level = names.index(name)
                if since is None:
                    results.append(restart(self.memory, level) == -1)
                else:
                    before = ctypes.create_string_buffer(history[since], len(history[since]))
                    if spoilt is not None:
                        slots = self.slots[level - 1]
                        struct.pack_into(
                            f"={slots.formats[spoilt[0]]}", before, slots.offsets[spoilt[0]], spoilt[1]
                        )
                    results.append(resume(self.memory, level, before) == -1)
            faulty = names[step(self.memory)]
            for wire, slots in zip(self.system.system.wires, self._of_buffers(), strict=True):
                if wire.source in tick.publishes:
                    self._put(slots, tick.publishes[wire.source])
                    self.given.add(wire.source)
            history.append(self.memory.raw)
            seen.append((faulty, tuple(results), self._states(), self._buffers()))
            if expected and seen[-1] != expected[len(seen) - 1]:
                break
        return seen

    def _of_buffers(self) -> list[Slots]:
        return self.slots[len(self.system.system.levels) :]

    def _put(self, slots: Slots, values: Values) -> None:
        for at, form, value in zip(slots.offsets, slots.formats, values, strict=True):
            struct.pack_into(f"={form}", self.memory, at, value)

    def _states(self) -> tuple[bytes, ...]:
        return tuple(
            self.system.signs[level.name].packed.pack(*slots.read(self.memory.raw))
            for level, slots in zip(self.system.system.levels, self.slots, strict=False)
        )

    def _buffers(self, *, begun: bool = False) -> tuple[bytes | None, ...]:
        found = []
        for wire, slots in zip(self.system.system.wires, self._of_buffers(), strict=True):
            there = begun or wire.source in self.given or wire.source.partition(".")[0] in self.system.signs
            form = "<" + "".join("B" if one == "?" else one for one in slots.formats)
            found.append(struct.pack(form, *slots.read(self.memory.raw)) if there else None)
        return tuple(found)


def first_difference(one: Sequence[Seen], other: Sequence[Seen]) -> str:
    """Where two runs part; empty where they do not."""
    words = ("fault", "restarts", "levels", "buffers")
    for tick, (first, second) in enumerate(zip(one, other, strict=False), start=-1):
        for word, a, b in zip(words, first, second, strict=True):
            if a != b:
                return f"tick {tick}, {word}: {a!r} and {b!r}"
    return "" if len(one) == len(other) else f"{len(one)} and {len(other)} ticks"
