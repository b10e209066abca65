"""A studio that is served in a thread, and pages that are no browsers."""

import asyncio
import contextlib
import itertools
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Self

import aiohttp

from rcsc.base.host.trust import Agreement
from rcsc.desk.shell.opening import Opening
from rcsc.desk.studio.hub import Concern
from rcsc.desk.studio.project import concerns
from rcsc.desk.studio.runs.live import Pace
from rcsc.desk.studio.scene import Drawer
from rcsc.desk.studio.server import Server
from rcsc.lang.project import project_root

PATIENCE_S = 120.0
"""After that something is broken; a machine under load needs some seconds."""


@contextlib.contextmanager
def serving(
    opening: Opening | None = None,
    others: Sequence[Concern] = (),
    logs: Sequence[Path] = (),
    drawer: Drawer | None = None,
    first: Path | None = None,
    agreement: Agreement | None = None,
) -> Iterator[Server]:
    """A server with the studio's concerns for a system, whose code may run, or with others alone."""
    server, opened = Server(), threading.Event()
    given = (
        [*others]
        if opening is None
        else [
            *concerns(opening, server.hub, agreement or _agreed(opening), logs, Pace(None), drawer, first),
            *others,
        ]
    )
    thread = threading.Thread(target=server.serve, args=(given, lambda _: opened.set()), daemon=True)
    thread.start()
    assert opened.wait(PATIENCE_S)
    try:
        yield server
    finally:
        server.stop()
        thread.join(PATIENCE_S)
        assert not thread.is_alive()
        assert server.hub.ended(PATIENCE_S), (
            "a thread that still proves would ask the solver beside the next test"
        )


def _agreed(opening: Opening) -> Agreement:
    return Agreement(Path(project_root(str(opening.path))), given=True)


async def until(holds: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not holds():  # noqa: ASYNC110  # what it looks at is another thread's
            await asyncio.sleep(0.01)


class Refused(Exception):  # noqa: N818  # what the studio said
    def __init__(self, said: dict[str, Any]) -> None:
        super().__init__(said["text"])
        self.code, self.helps = said["code"], said["helps"]


class Page:
    """A page: asks, and keeps the latest event of each kind."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket, self.events = socket, dict[str, Any]()
        self.progress: list[Any] = []
        self._numbers, self._answers = itertools.count(1), dict[int, asyncio.Future[Any]]()
        self._news = asyncio.Event()
        self._reader = asyncio.create_task(self._read())

    async def _read(self) -> None:
        async for said in self.socket:
            one = said.json()
            if "event" in one:
                self.events[one["event"]] = one["body"]
                self._news.set()
            elif "progress" in one:
                self.progress.append(one["progress"])
                self._news.set()
            else:
                self._answers[one["id"]].set_result(one)

    async def send(self, kind: str, **body: Any) -> int:
        number = next(self._numbers)
        self._answers[number] = asyncio.get_running_loop().create_future()
        await self.socket.send_json({"id": number, "kind": kind, "body": body})
        return number

    async def answer(self, number: int) -> Any:
        said = await asyncio.wait_for(self._answers[number], PATIENCE_S)
        if "refused" in said:
            raise Refused(said["refused"])
        return said.get("answer", said)

    async def ask(self, kind: str, **body: Any) -> Any:
        return await self.answer(await self.send(kind, **body))

    async def heard(self, kind: str, **wanted: Any) -> Any:
        """The latest event of a kind, once it says what is wanted."""
        async with asyncio.timeout(PATIENCE_S):
            while kind not in self.events or any(
                self.events[kind].get(key) != value for key, value in wanted.items()
            ):
                self._news.clear()
                await self._news.wait()
        return self.events[kind]

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        self._reader.cancel()
        await self.socket.close()


def page(server: Server) -> contextlib.AbstractAsyncContextManager[Page]:
    return page_at(server.address)


@contextlib.asynccontextmanager
async def page_at(address: str, **options: Any) -> AsyncIterator[Page]:
    """One page of the studio at an address; with options of its socket."""
    origin = address.rpartition("/")[0].rpartition("/")[0]
    async with (
        aiohttp.ClientSession(headers={"Origin": origin}) as session,
        session.ws_connect(f"{address}socket", max_msg_size=0, **options) as socket,
        Page(socket) as one,
    ):
        yield one
