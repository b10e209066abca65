"""Which files belong together: paths to parsed files, with what they use.

In: paths as the user gave them. Out: `Loaded`; what cannot be read or found is a diagnostic in it.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files.read import MOST_TOML_BYTES, Malformed, NotToml, TooLarge, content, toml_of

if TYPE_CHECKING:  # who only looks for the folder of a project, as a running level does, needs no syntax
    from rcsc.lang.syntax import tree

PROJECT_FILE = "rcsc.toml"
SYSTEM_FILE = "system.toml"
MOST_BYTES = 16 * 1024 * 1024
_SETTINGS = ("name", "exclude", "published", "prefix", "starts_at_zero")
"""Keys of a project's file."""
PREFIX = re.compile(r"(?:[A-Za-z][A-Za-z0-9_]{0,7})?")
"""Prefixes that the C names of a project may have."""


@dataclass(frozen=True, slots=True)
class InstanceParameter:
    """A declared constant that an instance sets: a bool, a number, or a member's name. `span`: where it is set."""

    name: str
    value: bool | int | float | str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Instance:
    """One of several programs of a root file.

    Attributes:
        file: The root file.
        name: Of the program, and of its level, whatever the file calls it.
        parameters: Constants with other values than those that the files declare.
        span: Where somebody asks for it, for what is wrong with the whole.
    """

    file: str
    name: str
    parameters: tuple[InstanceParameter, ...]
    span: Span = field(compare=False, repr=False)

    @property
    def root(self) -> str:
        """What the program is called where programs are told apart by their root files."""
        return f"{self.file} ({self.name})"

    @property
    def shown(self) -> str:
        """Its parameters in words: `limit_mm = 1500, fast = true`."""
        return ", ".join(
            f"{one.name} = {str(one.value).lower() if isinstance(one.value, bool) else one.value}"
            for one in self.parameters
        )


@dataclass(frozen=True, slots=True)
class Loaded:
    """Parsed files.

    Attributes:
        given: Files that the paths mean, in order.
        roots: Those to check: of a folder those that no other of its files uses.
        files: Every file, used ones too, by name as reached from the paths given.
        uses: For each file the files that it uses.
        sources: Every text.
        diagnostics: What could not be read, found or parsed.
        instances: Roots that are no files, each an instance of one.
    """

    given: tuple[str, ...]
    roots: tuple[str, ...]
    files: "Mapping[str, tree.File]"
    uses: Mapping[str, tuple[str, ...]]
    sources: Mapping[str, Source]
    diagnostics: tuple[Diagnostic, ...]
    instances: Mapping[str, Instance] = field(default_factory=dict)

    def file_of(self, root: str) -> str:
        """Return the file of a root: itself, or the one that it is an instance of."""
        return self.instances[root].file if root in self.instances else root


def load(
    paths: Sequence[str],
    stdin: str | bytes | None = None,
    stdin_name: str = "-",
    overlay: Mapping[str, str] | None = None,
    instances: Mapping[str, Instance] | None = None,
) -> Loaded:
    """Read and parse files, folders and (`-`) the text `stdin`, and all that they use.

    Args:
        paths: As the user gave them.
        stdin: The text for `-`.
        stdin_name: Its name in messages.
        overlay: Texts that stand for what is on disk, by real path: an editor's, saved or not.
        instances: What paths mean that are no files.
    """
    loader = _Loader(stdin, stdin_name, overlay or {}, instances or {})
    roots = tuple(dict.fromkeys(file for path in paths for file in loader.roots(path)))
    for file in roots:
        loader.reach(loader.made[file].file if file in loader.made else file)
    diagnostics = tuple(sorted(set(loader.diagnostics), key=sort_key))
    uses = {file: tuple(used) for file, used in loader.uses.items()}
    heads = _heads(roots, {path for path in paths if not os.path.isdir(path)}, uses)
    return Loaded(roots, heads, loader.files, uses, loader.sources, diagnostics, loader.made)


def again(program_file: str, instance: Instance | None, overlay: Mapping[str, str] | None = None) -> Loaded:
    """Read the files of a program once more: of an instance, with its constants."""
    if instance is None:
        return load([program_file], overlay=overlay)
    return load([instance.root], overlay=overlay, instances={instance.root: instance})


def _heads(roots: tuple[str, ...], named: set[str], uses: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Leave out a folder's files that another of its files uses: they are checked as parts of that one."""
    explicit = {os.path.realpath(path) for path in named}
    used = {part for file in roots for part in uses.get(file, ()) if part != file}
    waiting = list(used)
    while waiting:
        for part in uses.get(waiting.pop(), ()):
            if part not in used:
                used.add(part)
                waiting.append(part)
    heads = tuple(root for root in roots if root not in used or os.path.realpath(root) in explicit)
    return heads or roots


def listed(paths: Sequence[str]) -> tuple[str, ...]:
    """Return the files that the paths mean, unread, as `load` takes them for roots."""
    loader = _Loader(None, "-")
    return tuple(dict.fromkeys(file for path in paths for file in loader.roots(path)))


def places(loaded: Loaded) -> list[str]:
    """Return the files read, and the places where a used file or a project file was looked for."""
    from rcsc.lang.syntax.tree import Use

    names = set(loaded.sources)
    for file, parsed in loaded.files.items():
        folder = os.path.dirname(file)
        here = Path(folder or ".").resolve()
        names.update(str(above / PROJECT_FILE) for above in (here, *here.parents))
        bases = (folder, project_root(os.path.join(folder, "_")))
        used = (each.path for each in parsed.declarations if isinstance(each, Use))
        names.update(os.path.normpath(os.path.join(base, f"{path}.rcs")) for path in used for base in bases)
    return sorted(names)


def project_root(file: str) -> str:
    """Return the nearest folder upward with an `rcsc.toml`; else the file's own folder."""
    folder = os.path.dirname(file) or "."
    here = Path(folder).resolve()
    for up, above in enumerate((here, *here.parents)):
        if (above / PROJECT_FILE).is_file():
            root = os.path.normpath(os.path.join(folder, *[".."] * up))
            same = os.path.realpath(root) == str(above)
            return root if same else str(above)  # a linked folder's parents are not its name's
    return folder


def systems_above(file: str) -> list[Path]:
    """Return the system descriptions beside the file and above it, up to the project's folder, or one up without a project."""
    here = Path(os.path.dirname(file) or ".").resolve()
    folders = [here, *here.parents]
    root = next((at for at, path in enumerate(folders) if (path / PROJECT_FILE).is_file()), 1)
    return [folder / SYSTEM_FILE for folder in folders[: root + 1] if (folder / SYSTEM_FILE).is_file()]


def used_elsewhere(file: str) -> bool:
    """Return whether another file of its project may use a file, by the last word of a `use` in its text.

    A file without a project is looked for beside itself only: what lies below its folder may be all that a user has.
    """
    stem, real = os.path.basename(file).removesuffix(".rcs"), os.path.realpath(file)
    root = project_root(file)
    inside = Path(root, PROJECT_FILE).is_file()
    others = listed((root,)) if inside else tuple(map(str, sorted(Path(root or ".").glob("*.rcs"))))
    for other in others[:_MOST_FILES]:
        raw = b"" if os.path.realpath(other) == real else _bytes(other)
        text = raw.decode("utf-8-sig", "replace") if isinstance(raw, bytes) else ""
        words = _WORD.finditer(_ASIDE.sub("", text))
        if any((word["path"] or "").rpartition("/")[2] == stem for word in words):
            return True
    return False


def usable(file: str) -> dict[str, str]:
    """Return the files that a file may `use`, by what it writes: those beside it, and those of its project, whose file says which."""
    found: dict[str, str] = {}
    for base in dict.fromkeys((os.path.dirname(file), project_root(file))):
        files = [str(path) for path in sorted(Path(base or ".").glob("*.rcs"))]
        if os.path.isfile(os.path.join(base, PROJECT_FILE)):
            files += listed((base or ".",))
        for other in files[:_MOST_FILES]:
            path = os.path.relpath(other, base or ".").removesuffix(".rcs").replace(os.sep, "/")
            if _USED.fullmatch(path) and os.path.realpath(other) != os.path.realpath(file):
                found.setdefault(path, other)
    return found


def prefix(root: str) -> str:
    """Return the prefix of a project's C names from its file; "" where it has none, or no valid one.

    Args:
        root: The project's folder.
    """
    try:
        said = toml_of(content(Path(root, PROJECT_FILE), MOST_TOML_BYTES)).get("prefix", "")
    except (OSError, ValueError, Malformed):
        return ""
    return said if isinstance(said, str) and PREFIX.fullmatch(said) else ""


def is_published(file: str) -> bool:
    """Return whether the project of a file says that it is kept as somebody published it, with its findings."""
    root = project_root(file)
    try:
        said = toml_of(content(Path(root, PROJECT_FILE), MOST_TOML_BYTES))
    except (OSError, ValueError, Malformed):
        return False
    relative = os.path.relpath(file, root).replace(os.sep, "/")
    return any(fnmatch(relative, pattern) for pattern in _patterns(said, "published") or ())


def _patterns(settings: Mapping[str, object], key: str) -> tuple[str, ...] | None:
    """Return the patterns of files under a key; None where it has something else."""
    said = settings.get(key, [])
    texts = [each for each in said if isinstance(each, str)] if isinstance(said, list) else []
    return tuple(texts) if isinstance(said, list) and len(texts) == len(said) else None


def starts_at_zero(root: str) -> bool:
    """Return whether the project file in `root` declares that its tables were written after start values became 0."""
    try:
        return toml_of(content(Path(root, PROJECT_FILE), MOST_TOML_BYTES)).get("starts_at_zero") is True
    except (OSError, ValueError, Malformed):
        return False


@dataclass(frozen=True, slots=True)
class _Unread:
    """The reason why a file was not read; reported again at every `use` of it."""

    code: Code
    message: str
    helps: tuple[str, ...] = ()


@dataclass(slots=True)
class _Loader:
    """Reads each file once.

    Attributes:
        named: The name of each file by its real path: the one it was first reached by.
        instances: Roots that are instances of a file, as they were asked for; `made`, with the file by its name here.
        unread: Files that could not be read.
        excluded: The patterns of each project, by its root.
        root_of: The project root of each folder.
    """

    stdin: str | bytes | None
    stdin_name: str
    overlay: Mapping[str, str] = field(default_factory=dict)
    instances: Mapping[str, Instance] = field(default_factory=dict)
    made: dict[str, Instance] = field(default_factory=dict)
    files: "dict[str, tree.File]" = field(default_factory=dict)
    uses: dict[str, list[str]] = field(default_factory=dict)
    sources: dict[str, Source] = field(default_factory=dict)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    named: dict[str, str] = field(default_factory=dict)
    unread: dict[str, _Unread] = field(default_factory=dict)
    excluded: dict[str, tuple[str, ...]] = field(default_factory=dict)
    root_of: dict[str, str] = field(default_factory=dict)

    def report(self, code: Code, message: str, span: Span, *helps: str) -> None:
        """Add an error."""
        self.diagnostics.append(Diagnostic(code, message, Label(span), help=helps))

    # --- which files ---

    def roots(self, path: str) -> Iterator[str]:
        """Yield the files that a path of the user's means."""
        if path in self.instances:
            for file in self.roots(self.instances[path].file):
                self.made[path] = replace(self.instances[path], file=file)
                yield path
        elif path == "-":
            yield self.stdin_name
        elif os.path.isdir(path):
            inside = list(self._inside(path))
            if not inside:
                helps = f"give a folder with `*.rcs` files; `{PROJECT_FILE}` may exclude some"
                self.report(Code.NO_TABLES, "there is no `.rcs` file here to check", Span(path, 0, 0), helps)
            yield from inside
        elif self._stands(path):
            self._exclude(self._root(os.path.dirname(path)))
            yield self._name(path)
        else:
            self.report(Code.UNREADABLE, "there is no such file or folder", Span(path, 0, 0))

    def _stands(self, path: str) -> bool:
        """Return whether a file or folder is at a place, on disk or in the overlay."""
        return os.path.lexists(path) or os.path.realpath(path) in self.overlay

    def _unsaved(self, folder: str) -> dict[str, list[str]]:
        """Return the names of files below a folder that only the overlay has, by the real path of their folder."""
        real = os.path.join(os.path.realpath(folder), "")
        found: dict[str, list[str]] = {}
        for path in self.overlay:
            if path.startswith(real) and not os.path.lexists(path):
                here, name = os.path.split(path)
                found.setdefault(here, []).append(name)
        return found

    def _inside(self, folder: str) -> Iterator[str]:
        """Yield the files of a folder and the folders in it, each folder once whatever links lead to it."""
        seen: set[str] = set()
        unsaved = self._unsaved(folder)
        for here, folders, names in os.walk(folder, followlinks=True):
            real = os.path.realpath(here)
            if real in seen:
                folders.clear()
                continue
            seen.add(real)
            folders[:] = sorted(name for name in folders if not name.startswith("."))
            root = self._root(here)
            exclude = self._exclude(root)
            for name in sorted((*names, *unsaved.get(real, ()))):
                path = os.path.normpath(os.path.join(here, name))
                relative = os.path.relpath(path, root).replace(os.sep, "/")
                if name.endswith(".rcs") and not any(fnmatch(relative, pattern) for pattern in exclude):
                    yield self._name(path)

    def _name(self, path: str) -> str:
        """Return the name of the file in messages: the path by which it was first reached."""
        return self.named.setdefault(os.path.realpath(path), os.path.normpath(path))

    def _root(self, folder: str) -> str:
        if folder not in self.root_of:
            self.root_of[folder] = project_root(os.path.join(folder, "_"))
        return self.root_of[folder]

    def _exclude(self, root: str) -> tuple[str, ...]:
        """Return the exclude globs of a project; report errors in its file once."""
        path = os.path.join(root, PROJECT_FILE)
        if root not in self.excluded:
            self.excluded[root] = self._settings(path) if os.path.isfile(path) else ()
        return self.excluded[root]

    def _settings(self, path: str) -> tuple[str, ...]:
        text = self._text(path)
        if isinstance(text, _Unread):
            self.report(Code.PROJECT_FILE, text.message, Span(path, 0, 0), *text.helps)
            return ()
        self.sources[path] = Source(path, text)
        try:
            settings = toml_of(text)
        except Malformed as error:
            where, helps = (error.at, error.helps) if isinstance(error, NotToml) else (0, ())
            message = f"the project file {str(error).partition(' (at ')[0]}"
            self.report(Code.PROJECT_FILE, message, Span(path, where, where), *helps)
            return ()
        unknown = sorted(settings.keys() - set(_SETTINGS))
        wrong = f"`{unknown[0]}` is not a setting" if unknown else ""
        if not isinstance(settings.get("name", ""), str):
            wrong = "`name` is a text"
        for key in ("exclude", "published"):
            if _patterns(settings, key) is None:
                wrong = f"`{key}` is a list of patterns"
        begins = settings.get("prefix", "")
        if not isinstance(begins, str) or not PREFIX.fullmatch(begins):
            wrong = "`prefix` is a letter, and at most seven letters, digits and `_` after it"
        if not isinstance(settings.get("starts_at_zero", True), bool):
            wrong = "`starts_at_zero` is true or false"
        if wrong:
            near = _nearest(unknown[0], _SETTINGS) if unknown else ()
            *most, last = _SETTINGS
            known = f"the settings are {', '.join(f'`{key}`' for key in most)} and `{last}`"
            self.report(Code.PROJECT_FILE, wrong, Span(path, 0, 0), *near, known)
            return ()
        return _patterns(settings, "exclude") or ()

    # --- reading ---

    def reach(self, root: str) -> None:
        """Read a file and all that it uses; report a circle where it closes."""
        path = {root: self._used_by(root)} if self._read(root, Span(root, 0, 0)) else {}
        while path:
            file = next(reversed(path))
            use = next(path[file], None)
            if use is None:
                del path[file]
                continue
            target = self._target(file, use)
            if target is None:
                continue
            self.uses[file].append(target)
            if target in path:
                names = list(path)
                cycle = " -> ".join((*names[names.index(target) :], target))
                self.report(Code.FILE_CYCLE, f"files use each other in a circle: {cycle}", use.span)
            elif self._read(target, use.span):
                path[target] = self._used_by(target)

    def _used_by(self, file: str) -> "Iterator[tree.Use]":
        from rcsc.lang.syntax.tree import Use

        return iter(
            [declaration for declaration in self.files[file].declarations if isinstance(declaration, Use)]
        )

    def _read(self, file: str, asked: Span) -> bool:
        """Read and parse the file; return True if this succeeded and is the first time."""
        from rcsc.lang.syntax.parse import parse
        from rcsc.lang.syntax.tree import File

        if file in self.sources:
            return False
        text = self.unread.get(file) or self._text(file)
        if isinstance(text, _Unread):
            self.unread[file] = text
            self.report(text.code, text.message, asked, *text.helps)
            return False
        self.sources[file] = Source(file, text)
        parsed = parse(self.sources[file])
        if not isinstance(parsed, File):
            self.diagnostics.extend(parsed)
            return False
        self.files[file] = parsed
        self.uses[file] = []
        return True

    def _target(self, file: str, use: "tree.Use") -> str | None:
        folder = os.path.dirname(file)
        bases = (folder, self._root(folder))
        tried = dict.fromkeys(os.path.normpath(os.path.join(base, use.path + ".rcs")) for base in bases)
        for place in tried:
            if self._stands(place):
                return self._name(place)
        places = " and ".join(f"`{place}`" for place in tried)
        message = f"no file `{use.path}.rcs` is found"
        near = _nearest(use.path, sorted(usable(file)))
        self.report(Code.FILE_NOT_FOUND, message, use.span, *near, f"looked for {places}")
        return None

    def _text(self, file: str) -> str | _Unread:
        raw: str | bytes | _Unread | None
        piped = file == self.stdin_name and self.stdin is not None
        raw = (
            (self.stdin or "")
            if piped
            else self.overlay.get(os.path.realpath(file))
            if self.overlay
            else None
        )
        if raw is None:
            raw = _bytes(file)
        if isinstance(raw, str | _Unread):
            return raw
        if len(raw) > MOST_BYTES:
            return _too_large(file)
        try:
            return raw.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            return _Unread(
                Code.BAD_ENCODING,
                f"`{file}` is not UTF-8 at byte {error.start}",
                ("save it as UTF-8",),
            )


def _nearest(name: str, known: Sequence[str]) -> tuple[str, ...]:
    from rcsc.base.host.described import nearest  # keep lazy: a check of what is in order asks for nothing

    return nearest(name, known)


def _bytes(file: str) -> bytes | _Unread:
    """Return the content of a regular file of bounded size; a pipe or a device might never end."""
    try:
        return content(Path(file), MOST_BYTES)
    except OSError as error:
        return _Unread(Code.UNREADABLE, f"`{file}` cannot be read: {error.strerror}")
    except TooLarge:
        return _too_large(file)
    except Malformed as error:
        return _Unread(Code.UNREADABLE, f"`{file}` {error}", ("pipe the text to `-`",))


def _too_large(file: str) -> _Unread:
    helps = ("split it, and let one file `use` the other",)
    return _Unread(Code.TOO_LARGE, f"`{file}` has more than {MOST_BYTES // 1024**2} MiB", helps)


# --- who serves and commands whom ---

_ASIDE = re.compile(r"^[ \t]*\|.*|#.*", re.MULTILINE)
"""Rows of tables, and comments."""
_WORD = re.compile(
    r"(?P<before>[:=.,(]?)\s*\b(?:(?P<role>serves|commands)\s+(?P<peer>\w+)\s*:\s*(?P<link>\w+)|use\s+(?P<path>\w+(?:/\w+)*))"
)
_USED = re.compile(r"\w+(?:/\w+)*", re.ASCII)
"""What `use` may name."""
_MOST_FILES = 1000


@dataclass(slots=True)
class Neighbours:
    """The declared neighbours of a level: the link to each, by its name."""

    serves: dict[str, str] = field(default_factory=dict)
    commands: dict[str, str] = field(default_factory=dict)


def neighbours(root: Path) -> Neighbours:
    """Find the neighbours that a program serves and commands, in its root file and in those that it uses, sound or not.

    It searches the text, a hundred times faster than the parser: nothing may rest on it that is not held against the program
    later.
    """
    declared, seen, waiting = Neighbours(), set[Path](), [root]
    while waiting and len(seen) < _MOST_FILES:
        file = waiting.pop()
        if file in seen or not file.is_file():
            continue
        seen.add(file)
        raw = _bytes(str(file))
        text = raw.decode("utf-8-sig", "replace") if isinstance(raw, bytes) else ""
        bases: tuple[Path, ...] = ()
        for word in _WORD.finditer(_ASIDE.sub("", text)):
            if word["before"]:
                continue
            if word["role"]:
                getattr(declared, word["role"]).setdefault(word["peer"], word["link"])
            else:
                bases = bases or (file.parent, Path(project_root(str(file))))
                places = (base / f"{word['path']}.rcs" for base in bases)
                waiting += [place for place in places if place.is_file()][:1]
    return declared
