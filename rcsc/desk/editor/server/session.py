"""What a client has open, and when it is checked.

In: texts as they change. Out: answers, given to who asks and to who listens. All but the two workers runs in one thread, that of
the messages.
"""

import asyncio
import contextlib
import os
import time
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import wraps
from typing import ParamSpec, TypeVar

from pygls.exceptions import JsonRpcContentModified

from rcsc.desk.editor.memo import OutdatedError
from rcsc.desk.editor.names.find import Names
from rcsc.desk.editor.places import Lines, Units
from rcsc.desk.editor.server.convert import NO_VERSION, Converter, path_of
from rcsc.desk.editor.values import Answer
from rcsc.desk.editor.workspace import Workspace
from rcsc.proof.solvers.options import Options

RESTS_S = 0.08
"""How long keys rest before anything is looked at that may take longer than a moment, in seconds."""
P = ParamSpec("P")
T = TypeVar("T")


def current(ask: Callable[P, Awaitable[T]]) -> Callable[P, Awaitable[T]]:
    """Tell the client that an answer is outdated, if it is."""

    @wraps(ask)
    async def asked(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return await ask(*args, **kwargs)
        except OutdatedError as outdated:
            raise JsonRpcContentModified("the text has changed meanwhile") from outdated

    return asked


async def _in(worker: ThreadPoolExecutor, ask: Callable[[], T]) -> T:
    """Run a question in a worker, and raise what it raises; `StopIteration` becomes `RuntimeError`, as no future can carry it."""

    def asked() -> T:
        try:
            return ask()
        except StopIteration as bug:
            raise RuntimeError("something that should be there is not") from bug

    return await asyncio.get_running_loop().run_in_executor(worker, asked)


@dataclass(slots=True)
class Session:
    """Open documents of one client.

    Attributes:
        listens: Told each new answer to a file that is open.
        units: What the client's columns count.
        folders: Its folders.
        uris: What it calls each open file.
        versions: The version of each open file, as it counts them; none of a file that it does not count.
        shows: Whether it wants texts of lenses shown; one that shows them itself does not.
        turn: Rises with every change; an answer of an earlier turn is outdated.
        rests: Called when all is answered, where proofs are made: for what would keep a key waiting.
    """

    listens: Callable[[Answer], Awaitable[None]]
    options: Options = field(default_factory=Options)
    units: Units = Units.UTF_16
    folders: list[str] = field(default_factory=list)
    uris: dict[str, str] = field(default_factory=dict)
    versions: dict[str, int] = field(default_factory=dict)
    turn: int = 0
    shows: bool = True
    rests: Callable[[], None] = lambda: None
    workspace: Workspace = field(init=False)
    _told: dict[str, tuple[Answer, int | None]] = field(default_factory=dict)
    _results: dict[str, tuple[Answer, int]] = field(default_factory=dict)
    _proves: ThreadPoolExecutor = field(init=False)
    _reads: ThreadPoolExecutor = field(init=False)
    _waiting: "asyncio.Task[None] | None" = None
    _looked: bool = True

    def __post_init__(self) -> None:
        self.workspace = Workspace(self.options)
        self._proves = ThreadPoolExecutor(1, "proves")
        self._reads = ThreadPoolExecutor(1, "reads")

    # --- texts ---

    def path(self, uri: str) -> str:
        """Return the path of a document."""
        return path_of(uri, self.folders[0] if self.folders else os.getcwd())

    def open(self, uri: str, text: str, version: int) -> None:
        """Take a text as it is now, and queue its check."""
        path = self.path(uri)
        self.uris[path] = uri
        self.versions.pop(path, None)
        if version != NO_VERSION:
            self.versions[path] = version
        self.workspace.open(path, text)
        self.changed(path)

    def close(self, uri: str) -> None:
        """Return to the text on disk."""
        path = self.path(uri)
        self.uris.pop(path, None)
        self.versions.pop(path, None)
        self._told.pop(path, None)
        self.workspace.close(path)
        self.changed(path)

    def changed(self, path: str) -> None:
        """Queue a check of the open files; this file is looked at at once, or when keys rest that come faster than they are looked at."""
        self.turn += 1
        if self._waiting is not None:
            self._waiting.cancel()
        order = sorted(self.uris, key=lambda each: each != path)
        check = self._check(order, 0.0 if self._looked else RESTS_S)
        self._looked = False
        self._waiting = asyncio.get_running_loop().create_task(check)

    async def _check(self, order: list[str], rests_s: float) -> None:
        await asyncio.sleep(rests_s)
        for path in order[:1]:
            await self._tell(self.answer(path))
        self._looked = True
        await asyncio.sleep(RESTS_S - rests_s)
        for path in order[1:]:
            await self._tell(self.answer(path))
        for path in order:
            await self._tell(self.final(path))
        with contextlib.suppress(OutdatedError):
            await self.proving(self.rests)

    async def _tell(self, asked: Awaitable[Answer]) -> None:
        with contextlib.suppress(OutdatedError):
            await self.listens(await asked)

    # --- answers ---

    async def answer(self, path: str) -> Answer:
        """Return the answer to a file as it is now, as far as it is found in a moment.

        Raises:
            OutdatedError: A text has changed meanwhile.
        """
        since_s = time.monotonic()
        return await self._asked(lambda file, go_on: self.workspace.glance(file, go_on, since_s), path)

    async def final(self, path: str) -> Answer:
        """Return the answer to a file as it is now, with everything that takes longer.

        Raises:
            OutdatedError: A text has changed meanwhile.
        """
        return await self._asked(self.workspace.check, path)

    async def _asked(self, ask: Callable[[str, Callable[[], bool]], Answer], path: str) -> Answer:
        """Ask for an answer; a bug on the way becomes an answer, so that whoever waits hears of it, and the next file is asked for."""
        turn = self.turn
        try:
            return await self.proving(ask, path, lambda: self.turn == turn)
        except OutdatedError:
            raise
        except Exception as error:  # it is told, and the next text is looked at all the same
            if self.turn != turn:
                raise OutdatedError from error
            return self.workspace.given_up(path, error)

    async def proving(self, ask: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run a question that may need a proof; one after another.

        Raises:
            OutdatedError: A text has changed meanwhile.
        """
        return await self._of_one_text(self._proves, lambda: ask(*args, **kwargs))

    async def reading(self, ask: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run a question that needs no proof, and that does no harm where a text has changed meanwhile."""
        return await _in(self._reads, lambda: ask(*args, **kwargs))

    async def editing(self, ask: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run a question for edits that needs no proof.

        Raises:
            OutdatedError: A text has changed meanwhile: they are of another one.
        """
        return await self._of_one_text(self._reads, lambda: ask(*args, **kwargs))

    async def _of_one_text(self, worker: ThreadPoolExecutor, ask: Callable[[], T]) -> T:
        turn = self.turn
        answer = await _in(worker, ask)
        if self.turn != turn:  # after the worker has looked a last time, too
            raise OutdatedError
        return answer

    def is_told(self, answer: Answer) -> bool:
        """Tell whether the client has this answer already, for this version, and note that it has it now."""
        new = (answer, self.versions.get(answer.file))
        before = self._told.get(answer.file)
        self._told[answer.file] = new
        return before is not None and before[0] is answer and before[1] == new[1]

    def result_of(self, answer: Answer) -> str:
        """Return the name of an answer, so that a client need not be given the same again."""
        known = self._results.get(answer.file)
        if known is None or known[0] is not answer:
            self._results[answer.file] = known = (answer, 0 if known is None else known[1] + 1)
        return str(known[1])

    def converter(self, texts: Mapping[str, str]) -> Converter:
        """Return a converter of places in these texts to the client's units."""
        return Converter({path: Lines(text) for path, text in texts.items()}, self.units, self.uris)

    def names(self, path: str) -> Names:
        """Return the names of a file and of all that it uses."""
        return self.workspace.reading(path).names

    def stop(self) -> None:
        """Stop the proof under way, as soon as possible."""
        self.turn += 1
        for worker in (self._proves, self._reads):
            worker.shutdown(wait=False, cancel_futures=True)
