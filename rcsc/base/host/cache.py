"""What earlier runs proved, kept in files that are believed only when nothing about them is in doubt.

In: a key, which is a digest of all that a result depends on, and a result, a dataclass (`host.files.plain`). Out: the same result,
or nothing. An entry carries a keyed digest (HMAC-SHA-256) over its key and its content; the secret is the user's
own, outside any project. So an entry that is damaged, cut short, moved to another key or brought along with
somebody else's project is not believed. A cache that cannot be read or written is no error: it is no cache.
"""

import hashlib
import hmac
import json
import os
import secrets
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TypeVar

from rcsc import __version__
from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.plain import plain, read
from rcsc.base.host.files.read import Malformed, content, json_of

FOLDER = ".rcsc-cache"
MOST_ENTRIES = 4096
_PROVERS = {
    "z3": "z3_solver", "lark": "lark", "numpy": "numpy", "cvc5": "cvc5", "pysat": "python_sat",
}  # fmt: skip
"""Packages that a proof goes through, and what they are called where they are installed."""
_TAG = "Signature: 8a477f597d28d172789f06886806bc55\n# Made by rcsc; see https://bford.info/cachedir/\n"

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Cache:
    """Entries in one folder, under one user's secret and for one state of rcsc itself.

    Attributes:
        folder: Where the entries are; made when the first is stored.
        secret: The user's own; see `secret_of_user`.
        tool: Digest of rcsc and of what it proves with; part of every key.
    """

    folder: Path
    secret: bytes
    tool: str

    def memo(self, kind: type[T], parts: Sequence[str], make: Callable[[], T | None]) -> T | None:
        """Return the entry of the same parts, else a new result, which is stored unless it is None."""
        result = self.load(kind, *parts)
        if result is None and (result := make()) is not None:
            self.store(result, *parts)
        return result

    def load(self, kind: type[T], *parts: str) -> T | None:
        """Return the result of this kind that was stored under the same parts; None where there is none, or none to be believed."""
        key = self._key(kind, parts)
        try:
            seal, _, kept = content(self._path(key)).partition(b"\n")
            if not hmac.compare_digest(seal, self._seal(key, kept)):
                return None
            result: T = read(kind, json_of(kept, plain=False))
        except (OSError, ValueError):
            return None
        return result

    def store(self, result: object, *parts: str) -> None:
        """Keep a result, a dataclass, under its kind and `parts`: the whole entry or nothing."""
        key = self._key(type(result), parts)
        encoded = json.dumps(plain(result), separators=(",", ":"), sort_keys=True).encode()
        path = self._path(key)
        try:
            self._prepare(path.parent)
            write_atomically(path, self._seal(key, encoded) + b"\n" + encoded, durable=False)
            self._prune()
        except OSError:
            return

    def _key(self, kind: type, parts: tuple[str, ...]) -> str:
        identity = [self.tool, kind.__module__, kind.__qualname__, *parts]
        return hashlib.sha256(json.dumps(identity).encode()).hexdigest()

    def _seal(self, key: str, kept: bytes) -> bytes:
        return hmac.new(self.secret, key.encode() + b"\n" + kept, "sha256").hexdigest().encode()

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key[2:]}.json"

    def _prepare(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in (("CACHEDIR.TAG", _TAG), (".gitignore", "*\n")):
            if not (self.folder / name).exists():
                write_atomically(self.folder / name, text.encode(), durable=False)

    def _prune(self) -> None:
        """Drop the older half of the entries when there are too many."""
        entries = list(self.folder.glob("??/*.json"))
        if len(entries) <= MOST_ENTRIES:
            return
        entries.sort(key=lambda path: path.stat().st_mtime_ns)
        for path in entries[: len(entries) // 2]:
            path.unlink(missing_ok=True)


def open_cache(root: Path) -> Cache | None:
    """Return the cache of the project at `root`, or in `RCSC_CACHE_DIR`; None where no secret can be kept."""
    secret = secret_of_user()
    return None if secret is None else Cache(_folder(root), secret, digest_of_tool())


def cache_of(root: Path, like: Cache) -> Cache:
    """Return the cache of another project, without asking again for the files of rcsc itself."""
    return replace(like, folder=_folder(root))


def _folder(root: Path) -> Path:
    named = os.environ.get("RCSC_CACHE_DIR")
    return Path(named) if named else root / FOLDER


def secret_of_user() -> bytes | None:
    """Return the user's secret, made at first use; `RCSC_CACHE_KEY` may name one that machines share."""
    shared = os.environ.get("RCSC_CACHE_KEY")
    if shared:
        return hashlib.sha256(shared.encode()).digest()
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # cheaper
    path = Path(home) / "rcsc" / "secret"
    try:
        return _secret_at(path)
    except (OSError, Malformed):
        return None


def _secret_at(path: Path) -> bytes | None:
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, secrets.token_bytes(32), mode=0o600)
    kept = content(path, 1024)
    return kept if len(kept) == 32 else None  # as written above


def digest_of_tool() -> str:
    """Digest of rcsc's files, of Python and of each prover that is installed; by content, whatever the times of files."""
    hashed = hashlib.sha256(f"{__version__} {sys.version}".encode())
    package = Path(__file__).parents[2]
    above = len(str(package.parent)) + 1
    for path in sorted(_parts(package)):
        with open(
            path, "rb", buffering=0
        ) as file:  # hundreds of files of our own: nothing about them is in doubt
            body = file.read()
        hashed.update(f"{path[above:]} {len(body)}\n".encode() + body)
    for name, body in _provers():
        hashed.update(f"{name} {len(body)}\n".encode() + body)
    return hashed.hexdigest()


def _parts(package: Path) -> Iterator[str]:
    """Yield every file of rcsc itself."""
    folders = (package, package.parent / "grammar")
    for folder in folders:
        if folder.is_dir():
            yield from _files_below(str(folder))


def _files_below(folder: str) -> Iterator[str]:
    """Yield the files in a folder and in those below it; `os.scandir` asks once for a folder where `Path.rglob` asks for each file."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith((".py", ".lark", ".jinja", ".md")):
                yield entry.path
            elif entry.name != "__pycache__" and entry.is_dir():
                yield from _files_below(entry.path)


def _provers() -> Iterator[tuple[str, bytes]]:
    """Yield the identity of each installed prover: its record, with the digest of each of its files; without one, its first module."""
    for prover, project in _PROVERS.items():
        spec = find_spec(prover)
        if spec is None or spec.origin is None:
            continue
        first = Path(spec.origin)
        records = sorted(first.parent.parent.glob(f"{project}-*.dist-info/RECORD"))
        for path in records or [first]:
            yield f"{prover} {path.parent.name}", content(path)
