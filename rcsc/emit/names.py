"""Every spelling in the generated files, in C and in Python; reserved words and collisions.

In: a program. Out: `Names`. A name of a table can never become code: names are ASCII words, all generated ones carry the program's
name in front, and texts that go into comments are cleaned here.
"""

import builtins
import keyword
import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from rcsc.meaning import checked
from rcsc.model import Program

C_WORDS = frozenset(
    """auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    _Alignas _Alignof _Atomic _Bool _Complex _Generic _Imaginary _Noreturn _Static_assert _Thread_local asm alignas
    alignof and and_eq bitand bitor bool catch char8_t char16_t char32_t class compl concept consteval constexpr
    constinit const_cast co_await co_return co_yield decltype delete dynamic_cast explicit export false friend mutable
    namespace new noexcept not not_eq nullptr operator or or_eq private protected public reinterpret_cast requires
    static_assert static_cast template this thread_local throw true try typeid typename using virtual wchar_t xor
    xor_eq NULL errno linux unix i386 I complex imaginary typeof typeof_unqual fortran near far interrupt huge main
    line fault fault_at assumptions_failed int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t""".split()
)
PYTHON_WORDS = frozenset(keyword.kwlist) | frozenset(keyword.softkwlist) | frozenset(dir(builtins))
LONGEST = 100
MOST_SAID = 400
FAILED_BITS = 64


def short(name: str) -> str:
    """`name`; a long one is cut, with a digest of the whole."""
    if len(name) <= LONGEST:
        return name
    import hashlib

    return f"{name[:LONGEST]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def c_word(name: str) -> str:
    """`name`, short, where C and C++ leave it free."""
    name = short(name)
    return f"{name}_" if name in C_WORDS or name.startswith("_") else name


def python_word(name: str) -> str:
    """`name` where Python leaves it free."""
    if name.startswith("_"):
        name = f"x{name}"
    return f"{name}_" if name in PYTHON_WORDS or name in ("line", "fault", "fault_at", "failed") else name


def comment(text: str) -> str:
    """A text that can stand in a comment of either language and end neither; a very long one is cut."""
    text = text if len(text) <= MOST_SAID else f"{text[:MOST_SAID]}..."
    clean = "".join(c if c.isprintable() and c.isascii() else "?" for c in text)
    return re.sub(
        r"\?\?|\\",
        "?",
        clean.replace("*/", "* /").replace("/*", "/ *").replace("//", "/ /").replace('"', "'"),
    )


@dataclass(slots=True)
class Taken:
    """Names in use; `fresh` gives one that is not."""

    names: set[str] = field(default_factory=set)

    def fresh(self, name: str) -> str:
        """`name`, or the first of `name_2`, `name_3` that is free."""
        unique, number = name, 1
        while unique in self.names:
            number += 1
            unique = f"{name}_{number}"
        self.names.add(unique)
        return unique


@dataclass(frozen=True, slots=True)
class Names:
    """The names of one program's executors.

    Attributes:
        program: In front of all C names, and the files' name.
        attributes: Of each leaf, in Python.
        paths: Of each leaf, in the C struct.
        failed: Words of the trace for the monitored assumptions that failed.
    """

    program: str
    attributes: dict[str, str]
    paths: dict[str, str]
    tables: dict[str, str]
    levels: dict[str, str]
    procedures: dict[str, str]
    failed: tuple[str, ...]


def failed_words(monitored: int) -> tuple[str, ...]:
    """Members of the trace that hold one bit for each monitored assumption, 64 in each; there is at least one."""
    more = range(2, (monitored + FAILED_BITS - 1) // FAILED_BITS + 1)
    return ("assumptions_failed", *(f"assumptions_failed_{number}" for number in more))


def names_of(program: Program) -> Names:
    """All names, made unique in declared order."""
    own = re.sub(r"\W", "_", program.name, flags=re.ASCII) or "program"
    own = own if own[0].isalpha() else f"p{own}"
    taken = Taken()
    attributes = {v.name: taken.fresh(python_word(_flat(v.name))) for v in program.variables}
    tables = _unique((t.name for t in program.tables), Taken())
    used = Taken(set(tables.values()))
    return Names(
        c_word(own),
        {str(k): v for k, v in attributes.items()},
        _paths(program),
        tables,
        _unique((level.name for level in program.levels), used),
        _unique((p.name for p in program.procedures), Taken()),
        failed_words(len(checked(program))),
    )


def _unique(names: Iterable[str], taken: Taken) -> dict[str, str]:
    return {str(name): taken.fresh(c_word(name)) for name in names}


def _flat(name: str) -> str:
    joined = re.sub(r"[.\[\]]+", "_", name)
    return joined.rstrip("_") or joined


def _paths(program: Program) -> dict[str, str]:
    """Place of each leaf in the struct; the pending leaf of `x` is `x_next`."""
    taken = Taken()
    roots = {d.name: taken.fresh(c_word(d.name)) for d in program.declared}
    paths: dict[str, str] = {}
    for variable in program.variables:
        name = str(variable.name)
        if name.endswith(".next") and name.removesuffix(".next") in paths:
            paths[name] = taken.fresh(f"{paths[name.removesuffix('.next')]}_next")
            continue
        root = re.match(r"[A-Za-z0-9_]+", name)
        assert root is not None
        rest = re.sub(r"\.([A-Za-z0-9_]+)", lambda m: "." + c_word(m[1]), name[root.end() :])
        paths[name] = roots[root[0]] + rest
    return paths
