"""Which files belong together: paths to parsed files, with what they use.

In: paths as the user gave them. Out: `Loaded`; what cannot be read or found is a diagnostic in it.
"""

import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.source import Source, Span
from rcsc.syntax import tree

PROJECT_FILE = "rcsc.toml"
MOST_BYTES = 16 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class Loaded:
    """Parsed files.

    Attributes:
        roots: Files to check, in order.
        files: Every file, used ones too, by name as reached from the paths given.
        uses: For each file the files that it uses.
        sources: Every text.
        found: What could not be read, found or parsed.
    """

    roots: tuple[str, ...]
    files: Mapping[str, tree.File]
    uses: Mapping[str, tuple[str, ...]]
    sources: Mapping[str, Source]
    found: tuple[Diagnostic, ...]


def load(paths: Sequence[str], stdin: str | bytes | None = None, stdin_name: str = "-") -> Loaded:
    """Reads and parses files, folders and (`-`) the text `stdin`, and all that they use."""
    loader = _Loader(stdin, stdin_name)
    roots = [file for path in paths for file in loader.roots(path)]
    for file in dict.fromkeys(roots):
        loader.reach(file, (), None)
    if not roots and not loader.found:
        loader.report(Code.NO_TABLES, "there is no `.rcs` file here", Span(paths[0] if paths else ".", 0, 0))
    found = tuple(sorted(set(loader.found), key=sort_key))
    return Loaded(tuple(dict.fromkeys(roots)), loader.files, loader.uses, loader.sources, found)


def listed(paths: Sequence[str]) -> tuple[str, ...]:
    """The files that the paths mean, unread, as `load` takes them for roots."""
    loader = _Loader(None, "-")
    return tuple(dict.fromkeys(file for path in paths for file in loader.roots(path)))


def project_root(file: str) -> str:
    """The nearest folder upward with an `rcsc.toml`; else the file's own folder."""
    folder = os.path.dirname(file) or "."
    here = Path(folder).resolve()
    for up, above in enumerate((here, *here.parents)):
        if (above / PROJECT_FILE).is_file():
            return os.path.normpath(os.path.join(folder, *[".."] * up))
    return folder


@dataclass(slots=True)
class _Loader:
    """Reads each file once."""

    stdin: str | bytes | None
    stdin_name: str
    files: dict[str, tree.File] = field(default_factory=dict)
    uses: dict[str, tuple[str, ...]] = field(default_factory=dict)
    sources: dict[str, Source] = field(default_factory=dict)
    found: list[Diagnostic] = field(default_factory=list)
    broken: set[str] = field(default_factory=set)

    def report(self, code: Code, message: str, span: Span, *helps: str) -> None:
        self.found.append(Diagnostic(code, message, Label(span), help=helps))

    # --- which files ---

    def roots(self, path: str) -> Iterator[str]:
        """The files that a path of the user's means."""
        if path == "-":
            yield self.stdin_name
        elif os.path.isdir(path):
            yield from self._inside(path)
        elif os.path.exists(path):
            yield os.path.normpath(path)
        else:
            self.report(Code.UNREADABLE, "there is no such file or folder", Span(path, 0, 0))

    def _inside(self, folder: str) -> Iterator[str]:
        exclude = self._exclude(folder)
        seen: set[str] = set()
        for here, folders, names in os.walk(folder, followlinks=True):
            real = os.path.realpath(here)
            if real in seen:
                folders.clear()
                continue
            seen.add(real)
            folders[:] = sorted(name for name in folders if not name.startswith("."))
            for name in sorted(names):
                path = os.path.normpath(os.path.join(here, name))
                relative = os.path.relpath(path, folder).replace(os.sep, "/")
                if name.endswith(".rcs") and not any(fnmatch(relative, pattern) for pattern in exclude):
                    yield path

    def _exclude(self, folder: str) -> tuple[str, ...]:
        """The globs of the folder's project file, if it has one."""
        path = os.path.join(folder, PROJECT_FILE)
        if not os.path.isfile(path):
            return ()
        try:
            settings = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            self.report(Code.PROJECT_FILE, f"the project file cannot be read: {error}", Span(path, 0, 0))
            return ()
        patterns = settings.get("exclude", [])
        unknown = sorted(settings.keys() - {"name", "exclude"})
        if unknown or not isinstance(patterns, list) or not all(isinstance(one, str) for one in patterns):
            what = f"`{unknown[0]}` is not a setting" if unknown else "`exclude` is a list of patterns"
            self.report(Code.PROJECT_FILE, what, Span(path, 0, 0), "the settings are `name` and `exclude`")
            return ()
        return tuple(patterns)

    # --- reading ---

    def reach(self, file: str, path: tuple[str, ...], asked: Span | None) -> None:
        """Reads a file and all that it uses."""
        if file in path:
            cycle = " -> ".join((*path[path.index(file) :], file))
            assert asked is not None
            self.report(Code.FILE_CYCLE, f"files use each other in a circle: {cycle}", asked)
            return
        if file in self.files or file in self.broken:
            return
        from rcsc.syntax.parse import parse

        text = self._text(file, asked)
        if text is None:
            self.broken.add(file)
            return
        self.sources[file] = Source(file, text)
        parsed = parse(self.sources[file])
        if not isinstance(parsed, tree.File):
            self.found.extend(parsed)
            self.broken.add(file)
            return
        used = []
        for one in parsed.declarations:
            if isinstance(one, tree.Use):
                target = self._used(file, one)
                if target is not None:
                    used.append(target)
                    self.reach(target, (*path, file), one.span)
        self.files[file] = parsed
        self.uses[file] = tuple(used)

    def _used(self, file: str, use: tree.Use) -> str | None:
        folder = os.path.dirname(file)
        tried = dict.fromkeys(
            os.path.normpath(os.path.join(base, use.path + ".rcs")) for base in (folder, project_root(file))
        )
        for place in tried:
            if os.path.isfile(place):
                return place
        places = " and ".join(f"`{place}`" for place in tried)
        self.report(
            Code.FILE_NOT_FOUND, f"no file `{use.path}.rcs` is found", use.span, f"looked for {places}"
        )
        return None

    def _text(self, file: str, asked: Span | None) -> str | None:
        span = asked or Span(file, 0, 0)
        if file == self.stdin_name and isinstance(self.stdin, str):
            return self.stdin
        try:
            piped = self.stdin if file == self.stdin_name and isinstance(self.stdin, bytes) else None
            if (os.path.getsize(file) if piped is None else len(piped)) > MOST_BYTES:
                self.report(Code.TOO_LARGE, f"`{file}` has more than {MOST_BYTES // 1024**2} MiB", span)
                return None
            raw = Path(file).read_bytes() if piped is None else piped
        except OSError as error:
            self.report(Code.UNREADABLE, f"`{file}` cannot be read: {error.strerror}", span)
            return None
        try:
            return raw.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            self.report(
                Code.BAD_ENCODING, f"`{file}` is not UTF-8 at byte {error.start}", span, "save it as UTF-8"
            )
            return None
