"""Every spelling in the generated files, in C and in Python; words that are reserved, and collisions.

In: a program. Out: `Names`. A name of a table can never become code: names are ASCII words, all generated ones carry the program's
name in front, and texts that go into comments are cleaned here.

Each namespace is a `NameScope`: it begins with what is reserved in it (`rcsc.lang.reserved`) and takes every name given in it, whatever it
names. A name that is free stays as it was written; the others get what makes them different. A table, level or procedure has one
*stem* in both languages: it is chosen so that all names made of it are free in both.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from rcsc.lang import reserved
from rcsc.lang.meaning import checked
from rcsc.lang.model import Array, Program, Record, Type, pending

TRACE = ("line", "fault", "fault_at")
"""Members of the state that tell about the last cycle; the words of failed assumptions come after them."""
C_WORDS = reserved.C_KEYWORDS | reserved.C_MACROS | reserved.C_COMPOSED | frozenset(TRACE)
PYTHON_WORDS = reserved.PYTHON_KEYWORDS | reserved.PYTHON_BUILTINS
_FILES = (
    reserved.C_HEADERS
    | reserved.C_LIBRARIES
    | reserved.CMAKE_TARGETS
    | reserved.PYTHON_MODULES
    | reserved.PYTHON_KEYWORDS
)
_MODULE = frozenset(
    """IntEnum State _Refused _bisect _reduce _product _and _div _mod _min _max _refused _line_of _one_of _joined _lines_of
    _nan _whole _real _exactly _admit _settle _safe _begin check""".split()
)
"""What the Python module calls its own."""
OWN = ("t", "init", "check", "begin", "admit", "settle", "safe")
"""Ends of the C names that every program may have."""
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
    """`name`, short, where C, C++ and their libraries leave it free; a word in capitals may be a macro."""
    name = short(name)
    capitals = len(name) > 1 and name.isupper()
    return f"{name}_" if capitals or name in C_WORDS or name.startswith("_") else name


def parameter_word(name: str) -> str:
    """A leaf or a parameter as the parameter of a C prototype."""
    return c_word(re.sub(r"\W+", "_", name).strip("_") or "p")


def python_word(name: str) -> str:
    """`name` where Python leaves it free."""
    if name.startswith("_"):
        name = f"x{name}"
    return f"{name}_" if name in PYTHON_WORDS else name


def comment(text: str) -> str:
    """A text that can stand in a comment of either language and end neither; a very long one is cut.

    Nothing in it means anything to a compiler, a build tool or an analyser: no end or begin of a comment, no continued line, no
    trigraph (ISO C99, 5.2.1.1), no declared encoding (PEP 263), no expansion, no suppression.
    """
    text = text if len(text) <= MOST_SAID else f"{text[:MOST_SAID]}..."
    clean = "".join(c if c.isprintable() and c.isascii() else "?" for c in text)
    clean = re.sub(r"[?\\]*[\\][?\\]*|\?{2,}", "?", clean)
    for mark in ("*/", "/*", "//", "${", "-suppress", "coding:", "coding=", "NOLINT"):
        clean = clean.replace(mark, f"{mark[:-1]} {mark[-1]}")
    return clean.replace('"', "'")


@dataclass(slots=True)
class NameScope:
    """A namespace: the names in it, reserved ones first."""

    names: set[str] = field(default_factory=set)

    def fresh(self, name: str) -> str:
        """`name`, or the first of `name_2`, `name_3` that is free; it is then taken."""
        free = next(variant for variant in _variants(name) if variant not in self.names)
        self.names.add(free)
        return free

    def all(self, wanted: Iterable[tuple[str, str]], claims: "Claims | None" = None) -> dict[str, str]:
        """A spelling for each name, in order.

        Args:
            wanted: Each name, and the word that is wanted for it. Those that are the name itself are given first.
            claims: Names that a spelling makes in other scopes, which must be free and are then taken, too.
        """
        pairs = list(wanted)
        given: dict[str, str] = {}
        for name, word in sorted(pairs, key=lambda pair: pair[0] != pair[1]):
            given[name] = self._claimed(word, claims)
        return {name: given[name] for name, _ in pairs}

    def _claimed(self, word: str, claims: "Claims | None") -> str:
        for variant in _variants(word):
            claimed = [(self, variant), *(claims(variant) if claims else ())]
            if all(name not in scope.names for scope, name in claimed):
                for scope, name in claimed:
                    scope.names.add(name)
                return variant
        raise AssertionError(word)


Claims = Callable[[str], Iterable[tuple[NameScope, str]]]


def _variants(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        yield f"{name}_{number}"
        number += 1


@dataclass(frozen=True, slots=True)
class Names:
    """The names of one program's executors.

    Attributes:
        file: Stem of the symbol file: the program's name as it is.
        program: Prefix of all C names, and stem of the other files.
        attributes: Python attribute of each leaf.
        paths: Path of each leaf in the C struct, member by member and index by index.
        roots: Member of the C struct for each declared variable.
        members: For each record, what its struct calls each field.
        tables, levels, procedures, records, enums: The stem of each.
        constants: For each enumeration, the C constant of each member.
        classes: Python class of each enumeration.
        class_members: For each enumeration, what its Python class calls each member.
        failed: Words of the trace for the monitored assumptions that failed.
        c: What stands at file scope in C; `module` in the Python module.
    """

    file: str
    program: str
    attributes: dict[str, str]
    paths: dict[str, tuple[str, ...]]
    roots: dict[str, str]
    members: dict[str, dict[str, str]]
    tables: dict[str, str]
    levels: dict[str, str]
    procedures: dict[str, str]
    records: dict[str, str]
    enums: dict[str, str]
    constants: dict[str, tuple[str, ...]]
    classes: dict[str, str]
    class_members: dict[str, tuple[str, ...]]
    failed: tuple[str, ...]
    c: NameScope
    module: NameScope


def failed_words(monitored: int) -> tuple[str, ...]:
    """Members of the trace that hold one bit for each monitored assumption, 64 in each; there is at least one."""
    more = range(2, (monitored + FAILED_BITS - 1) // FAILED_BITS + 1)
    return ("assumptions_failed", *(f"assumptions_failed_{number}" for number in more))


def names_of(program: Program) -> Names:
    """All names, made unique in declared order."""
    file, p = _program_words(program)
    failed = failed_words(len(checked(program)))
    c, module = _file_scope(program, p), NameScope(set(_MODULE))
    stems = _Stems(p, c, module)
    members = {r.name: NameScope().all((f.name, c_word(f.name)) for f in r.fields) for r in program.records}
    roots, paths = _paths(program, members, failed)
    tables = stems.of(
        (t.name for t in program.tables), ("{p}_{x}_line", "{p}_{x}_lines", "{p}_{x}_step", "{p}_run_{x}"),
        ("{x}_line", "{x}_lines", "{x}_step", "_run_{x}"),
    )  # fmt: skip
    levels = stems.of((level.name for level in program.levels), ("{p}_{x}_cycle",), ("{x}_cycle",))
    procedures = stems.of((procedure.name for procedure in program.procedures), ("{p}_do_{x}",), ("_do_{x}",))
    records = stems.of((record.name for record in program.records), ("{p}_{x}_t",), ())
    enums = stems.of((enum.name for enum in program.enums), ("{p}_{x}_t",), ())
    classes = module.all((enum.name, python_word(enum.name)) for enum in program.enums)
    return Names(
        file, p, _attributes(program, failed), paths, roots, members, tables, levels, procedures, records, enums,
        _constants(program, p, c), classes, _class_members(program), failed, c, module,
    )  # fmt: skip


def _program_words(program: Program) -> tuple[str, str]:
    """The program's own word, and its word in C names and files, which no library or tool reserves."""
    own = re.sub(r"\W", "_", program.name, flags=re.ASCII) or "program"
    own = short(own if own[0].isalpha() else f"p{own}")
    kept = own.lower() in _FILES | C_WORDS
    composed = any(f"{own}_{end}" in reserved.C_COMPOSED for end in OWN)
    return own, f"{own}_" if kept or composed else own


def capitals(p: str) -> str:
    """A program's word in capitals; as it is where it has some, which may be all that tells it from another's."""
    return p.upper() if p.islower() else p


def guard(p: str) -> str:
    """The include guard of a program's header."""
    return f"{capitals(p)}_H"


def _file_scope(program: Program, p: str) -> NameScope:
    externs = {procedure.extern.c for procedure in program.procedures if procedure.extern is not None}
    own = {f"{p}_{end}" for end in (*OWN, "exact", "bit32", "bit64")}
    return NameScope(set(reserved.C_COMPOSED | C_WORDS) | externs | own | {guard(p)})


@dataclass(frozen=True, slots=True)
class _Stems:
    """Stems of one program: each makes names in both languages."""

    program: str
    c: NameScope
    module: NameScope

    def of(self, names: Iterable[str], in_c: tuple[str, ...], in_python: tuple[str, ...]) -> dict[str, str]:
        """A stem for each name.

        Args:
            names: Of one kind, in declared order.
            in_c: Forms of the C names that a stem `x` of program `p` makes.
            in_python: Forms of the Python names.
        """

        def claims(stem: str) -> Iterator[tuple[NameScope, str]]:
            for scope, forms in ((self.c, in_c), (self.module, in_python)):
                yield from ((scope, form.format(p=self.program, x=stem)) for form in forms)

        return NameScope().all(((str(name), _stem(name)) for name in names), claims)


def _stem(name: str) -> str:
    """A stem stands between other words: only what no word may be is changed."""
    name = short(name)
    return f"{name}_" if name in reserved.C_KEYWORDS or name.startswith("_") else name


def _attributes(program: Program, failed: tuple[str, ...]) -> dict[str, str]:
    taken = NameScope({*TRACE, *failed, "copy_in", "copy_out"})
    flat = ((str(v.name), _flat(str(v.name))) for v in program.variables)
    return taken.all((name, _unlike(python_word(word), taken)) for name, word in flat)


def _unlike(word: str, scope: NameScope) -> str:
    """The word, told apart from what the scope reserves as a keyword would be."""
    return f"{word}_" if word in scope.names else word


def _flat(name: str) -> str:
    return re.sub(r"[.\[]", "_", name.replace("]", ""))


def _constants(program: Program, p: str, scope: NameScope) -> dict[str, tuple[str, ...]]:
    """`PROGRAM_ENUM_MEMBER`, with `_` after it where macros of a library begin like that."""
    tail = "_" if p.upper().split("_")[0] in reserved.C_FAMILIES else ""
    return {
        enum.name: tuple(
            scope.fresh(f"{capitals(p)}_{f'{short(enum.name)}_{short(member)}{tail}'.upper()}")
            for member in enum.members
        )
        for enum in program.enums
    }


def _class_members(program: Program) -> dict[str, tuple[str, ...]]:
    members = {}
    for enum in program.enums:
        words = ((m, _unlike(python_word(m), NameScope(set(reserved.PYTHON_MEMBERS)))) for m in enum.members)
        members[enum.name] = tuple(NameScope(set(reserved.PYTHON_MEMBERS)).all(words).values())
    return members


def _paths(
    program: Program, members: dict[str, dict[str, str]], failed: tuple[str, ...]
) -> tuple[dict[str, str], dict[str, tuple[str, ...]]]:
    """What the struct calls each declared variable, and the place of each leaf; the pending leaf of `x` is `x_next`."""
    taken = NameScope({*TRACE, *failed})
    roots = taken.all((d.name, _unlike(c_word(d.name), taken)) for d in program.declared)
    variables = {str(v.name) for v in program.variables}
    paths: dict[str, tuple[str, ...]] = {}
    for declared in program.declared:
        paths.update(
            zip(
                map(str, declared.leaves),
                _places((roots[declared.name],), declared.type, members),
                strict=True,
            )
        )
        for leaf in declared.leaves:
            if pending(leaf) in variables:
                paths[pending(leaf)] = (taken.fresh(f"{''.join(paths[leaf])}_next"),)
    return roots, {str(v.name): paths[v.name] for v in program.variables}


def _places(
    path: tuple[str, ...], kind: Type, members: dict[str, dict[str, str]]
) -> Iterator[tuple[str, ...]]:
    match kind:
        case Array(length, element):
            for at in range(length):
                yield from _places((*path, f"[{at}]"), element, members)
        case Record(name=record, fields=fields):
            for part in fields:
                yield from _places((*path, f".{members[record][part.name]}"), part.type, members)
        case _:
            yield path
