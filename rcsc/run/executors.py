"""Generated executors behind one interface: Python modules, and C built into one shared library.

In: the generated folder and signatures. Out: executors that hold one state each. Values go in and out as tuples in declared
order; both kinds give the same values, bit for bit: `Twins` runs both on the same inputs and keeps where they do not. Those that were
made by force of tables that do not prove, to run a finding, bear a mark (`host.files.write.UNPROVED`), and are refused.
"""

import ctypes
import hashlib
import importlib.machinery
import importlib.util
import shutil
import struct
import sys
from collections.abc import Sequence
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from types import CodeType, ModuleType
from typing import Protocol

from rcsc.base.diagnostics.coded import USERS_FAILURES, CodedError, raised
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host import children
from rcsc.base.host.files.names import BadName
from rcsc.base.host.files.read import Malformed, content
from rcsc.base.host.files.write import UNPROVED
from rcsc.run.description import BadDescription, Description
from rcsc.run.signature import FORMATS, LevelSign, Signature, Value, Values, generated_files, sources_of

TYPES = "_types.h"
"""What the name of a header of types ends with, which programs share."""
FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared")
"""A cycle takes microseconds; more optimization would only be waited for at each start."""


class NotBuilt(CodedError):  # noqa: N818  # what happened, not an error of ours
    """The C executors could not be built here; says why."""


class Executor(Protocol):
    """One level's executor with its state."""

    def cycle(self) -> int:
        """Run one cycle; return the fault, 0 for none."""
        ...

    def values(self) -> Values:
        """Return all leaves, then the trace."""
        ...

    def put(self, first: int, values: Sequence[Value]) -> None:
        """Set the leaves from position `first` on."""
        ...

    def check(self) -> int:
        """Return -1 where a cycle may begin with the state, else the number of the error (`Signature.unfit`)."""
        ...


class _Source(importlib.machinery.SourceFileLoader):
    """Runs a module's text itself, and nothing that lies beside it as that text compiled."""

    def get_code(self, fullname: str) -> CodeType:  # noqa: ARG002  # as it is called
        return self.source_to_code(content(Path(self.path)), self.path)


def _module(name: str, path: Path) -> ModuleType:
    """Import the module of a generated file. Raises NotBuilt: it cannot be read."""
    loader = _Source(name, str(path))
    module = importlib.util.module_from_spec(importlib.machinery.ModuleSpec(name, loader, origin=str(path)))
    try:
        loader.exec_module(module)
    except Malformed as error:
        raise NotBuilt(f"`{path}` {error}") from error
    except USERS_FAILURES as error:  # modules of extern procedures are the user's
        raise NotBuilt(f"`{path}` cannot be imported: {raised(error)}") from error
    return module


class PythonExecutor:
    """A generated Python module with a state."""

    def __init__(self, generated: Path, sign: Signature, level: LevelSign) -> None:
        name = f"rcsc_generated_{sign.program}"
        *_, path = _files(generated, sign)
        module = _module(name, path)
        self._state = module.State()
        self._cycle = getattr(module, level.cycle.removeprefix(f"{sign.program}_"))
        self._check = module.check
        self._names = [leaf.attribute for leaf in sign.leaves]
        self._get = attrgetter(*self._names, *sign.trace)

    def cycle(self) -> int:
        """Run one cycle; return the fault, 0 for none."""
        fault: int = self._cycle(self._state)
        return fault

    def check(self) -> int:
        """Return -1 where a cycle may begin with the state, else the number of the error."""
        at: int = self._check(self._state)
        return at

    def values(self) -> Values:
        """Return all leaves, then the trace."""
        values: Values = self._get(self._state)
        return values

    def put(self, first: int, values: Sequence[Value]) -> None:
        """Set the leaves from position `first` on."""
        for at, value in enumerate(values, first):
            setattr(self._state, self._names[at], value)


_BUILT: dict[bytes, ctypes.CDLL] = {}
"""What this process has built already, by the text it was built from."""


def build(generated: Path, signs: Sequence[Signature]) -> ctypes.CDLL:
    """Compile the generated C, once for the same text.

    Raises:
        NotBuilt: There is no compiler, or it refused.
    """
    layout = "\n".join(_layout(sign) for sign in signs)
    try:
        texts = [content(path) for sign in signs for path in _files(generated, sign)[:2]]
        texts += map(content, sorted((generated / "c").glob(f"*{TYPES}")))
    except OSError as error:
        raise NotBuilt(f"{error.filename} cannot be read: {error.strerror}") from error
    except Malformed as error:
        raise NotBuilt(f"a generated file {error}") from error
    key = hashlib.sha256(b"\0".join([layout.encode(), *texts])).digest()
    if key not in _BUILT:
        _BUILT[key] = _built(generated, signs, layout)
    return _BUILT[key]


def compiled(library: Path, *args: str) -> None:
    """Make a library of C.

    Raises:
        NotBuilt: There is no compiler, or it refused.
    """
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise NotBuilt("there is no C compiler here")
    ran = children.run([compiler, *FLAGS, "-o", str(library), *args])
    if ran.status != 0:
        raise NotBuilt(ran.err.strip().splitlines()[0] if ran.err.strip() else "the compiler failed")


def _files(generated: Path, sign: Signature) -> tuple[Path, Path, Path]:
    """Return the program's files, all in the generated folder: nothing else is compiled or loaded.

    Raises:
        NotBuilt: A name or a link leads elsewhere.
    """
    try:
        return sources_of(generated, sign.program)
    except BadName as error:
        raise NotBuilt(str(error)) from error


def _built(generated: Path, signs: Sequence[Signature], layout: str) -> ctypes.CDLL:
    with children.scratch("executors") as folder:
        shim = folder / "layout.c"
        shim.write_text(layout, encoding="utf-8")
        library = folder / "executors.so"
        sources = [str(_files(generated, sign)[0]) for sign in signs]
        compiled(library, f"-iquote{generated / 'c'}", str(shim), *sources)
        return _loaded(library)


def _loaded(library: Path) -> ctypes.CDLL:
    """Load the library; it stays mapped when its folder is gone.

    Raises:
        NotBuilt: It calls a function that is not defined.
    """
    try:
        return ctypes.CDLL(str(library))
    except OSError as error:
        called = str(error).partition("undefined symbol: ")[2] or str(error)
        refusal = NotBuilt(f"the C executors call `{called}`, which is a function of yours and not linked")
        refusal.helps = ("`--executor python` calls extern procedures in Python",)
        raise refusal from error


def _layout(sign: Signature) -> str:
    """Return C that makes the compiler report the place of each leaf in the program's struct."""
    p, kind = sign.program, sign.struct_name
    places = [
        f"(unsigned)offsetof({kind}, {place})"
        for place in (*(leaf.place for leaf in sign.leaves), *sign.trace)
    ]
    return (
        f'#include <stddef.h>\n#include "{p}.h"\n'
        f"const unsigned rcsc_{p}_places[] = {{{', '.join(places)}, (unsigned)sizeof({kind})}};\n"
    )


class CExecutor:
    """A generated C executor with a state of its own."""

    def __init__(self, library: ctypes.CDLL, sign: Signature, level: LevelSign) -> None:
        self._library = library  # keeps the file that is mapped
        count = len(sign.leaves) + len(sign.trace)
        places = list((ctypes.c_uint * (count + 1)).in_dll(library, f"rcsc_{sign.program}_places"))
        self._memory = ctypes.create_string_buffer(places[-1])
        self._address = ctypes.byref(self._memory)
        self._cycle = getattr(library, level.cycle)
        self._cycle.restype = ctypes.c_int32
        self._check = getattr(library, sign.check)
        self._check.restype = ctypes.c_int32
        getattr(library, sign.init)(self._address)
        formats = [*(FORMATS[leaf.c_type] for leaf in sign.leaves), *sign.trace_format_in_c]
        self._places, self._formats = places, formats
        order = sorted(range(count), key=places.__getitem__)
        self._whole = _padded([(places[at], formats[at]) for at in order], places[-1])
        back = sorted(range(count), key=order.__getitem__)
        self._order = None if order == list(range(count)) else back
        self._parts: dict[tuple[int, int], struct.Struct] = {}

    def cycle(self) -> int:
        """Run one cycle; return the fault, 0 for none."""
        fault: int = self._cycle(self._address)
        return fault

    def check(self) -> int:
        """Return -1 where a cycle may begin with the state, else the number of the error."""
        at: int = self._check(self._address)
        return at

    def write(self, name: str, value: ctypes.Array[ctypes.c_uint64] | ctypes.c_uint32) -> None:
        """Set a variable of the library, where it has one of that name."""
        try:
            there = type(value).in_dll(self._library, name)
        except ValueError:
            return
        ctypes.memmove(ctypes.byref(there), ctypes.byref(value), ctypes.sizeof(value))

    def values(self) -> Values:
        """Return all leaves, then the trace."""
        values = self._whole.unpack(self._memory)
        return values if self._order is None else tuple(values[at] for at in self._order)

    def put(self, first: int, values: Sequence[Value]) -> None:
        """Set the leaves from position `first` on."""
        base = self._places[first]
        key = first, len(values)
        part = self._parts.get(key)
        if part is None:
            run = range(first, first + len(values))
            places = [self._places[at] - base for at in run]
            if any(b < a for a, b in pairwise(places)):
                for at, value in enumerate(values, first):
                    self.put(at, (value,))
                return
            end = places[-1] + struct.calcsize(self._formats[run[-1]])
            part = self._parts[key] = _padded(
                [(place, self._formats[at]) for place, at in zip(places, run, strict=True)], end
            )
        part.pack_into(self._memory, base, *values)


class Twins:
    """The C and the Python executor of a level, given the same: what the C does counts, and the Python is held against it.

    Attributes:
        difference: The first, in words; empty for none.
    """

    def __init__(self, sign: Signature, c: CExecutor, python: PythonExecutor) -> None:
        self._sign, self._c, self._python = sign, c, python
        self.difference = ""
        self._compare()

    def cycle(self) -> int:
        """Run one cycle of both; return the fault of the C, 0 for none."""
        fault = self._c.cycle()
        if not self.difference:
            try:
                self._python.cycle()
            except USERS_FAILURES as error:  # no generated Python raises; one that was edited may
                self.difference = f"the Python executor raises {raised(error)}"
            else:
                self._compare()
        return fault

    def check(self) -> int:
        """Return what the C says of the state."""
        c, python = self._c.check(), self._python.check()
        if c != python and not self.difference:
            self.difference = f"of a state, `check` says {c} in C and {python} in Python"
        return c

    def values(self) -> Values:
        """Return all leaves, then the trace, of the C."""
        return self._c.values()

    def put(self, first: int, values: Sequence[Value]) -> None:
        """Set the leaves of both from position `first` on."""
        self._c.put(first, values)
        self._python.put(first, values)

    def _compare(self) -> None:
        c, python = self._c.values(), self._python.values()
        if self._bytes(c) == self._bytes(python):
            return
        leaves = self._sign.leaves
        for at, (a, b) in enumerate(zip(c, python, strict=True)):
            if repr(a) != repr(b):
                leaf = leaves[at] if at < len(leaves) else None
                name, words = (
                    (self._sign.trace[at - len(leaves)], repr) if leaf is None else (leaf.name, leaf.shown)
                )
                self.difference = f"`{name}` is {words(a)} in C and {words(b)} in Python"
                return

    def _bytes(self, values: Values) -> bytes | None:
        try:
            return self._sign.packed.pack(*values)
        except struct.error:  # what edited Python may give
            return None


def _padded(fields: Sequence[tuple[int, str]], size: int) -> struct.Struct:
    """Return a format with the compiler's padding between ascending places."""
    text, at = "<" if sys.byteorder == "little" else ">", 0
    for place, form in fields:
        text += "x" * (place - at) + form
        at = place + struct.calcsize(form)
    return struct.Struct(text + "x" * (size - at))


# --- of tables that are not proved ---


class UnprovedExecutors(BadDescription):
    """Generated files that bear the mark of unproved tables; lists them."""

    code = Code.EXECUTORS_NOT_PROVED
    helps = ("mend the tables, then `rcsc compile`",)


def marked(system: Description) -> tuple[Path, ...]:
    """Return the generated files of the system's programs that bear the mark, wherever in their text."""
    mark = UNPROVED.encode()
    programs = dict.fromkeys(spec.program for spec in system.levels)
    files = (path for name in programs for path in generated_files(system.generated, name))
    return tuple(path for path in files if path.is_file() and mark in content(path))


def refuse_unproved(system: Description) -> None:
    """Refuse unproved executors before anything moves.

    Raises:
        UnprovedExecutors: A generated file bears the mark.
    """
    if paths := marked(system):
        raise UnprovedExecutors(f"`{paths[0]}` is made of tables that are not proved, to run a finding")
