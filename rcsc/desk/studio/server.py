"""The studio's server: on the loopback interface, in the thread that calls it; pages, their parts, and a socket for each.

In: concerns. Out: one address, with a token that nobody can guess; `rcsc.base.host.guard` keeps every other page out. A page gets files of
the folder `page` and nothing else, and talks over one socket: questions and answers with numbers, and events.
"""

import asyncio
import contextlib
import hashlib
import os
import secrets
import signal
import sys
import threading
import traceback
from collections.abc import Awaitable, Callable, Sequence
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from aiohttp import WSMsgType, web

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.read import MIB, Malformed, json_of
from rcsc.base.host.guard import HEADERS, Entrance, policy, refusal, silent
from rcsc.desk.studio.hub import DEEPEST_MESSAGE, Client, Concern, Hub

ADDRESS = "127.0.0.1"
MOST_BYTES = 4 * MIB
"""Of a message from a page: the text of a file and what stands around it."""
FIRST_PORT, LAST_PORT = 61_000, 65_535
MOST_PAGES = 16
"""Pages at once."""
HEARTBEAT_S = 20.0
"""After which a page that does not answer is given up."""
GOODBYE_S = 0.4
"""A page that does not answer is waited for no longer when the studio ends."""
LAST_S = 3.0
"""What is being done in a lane when the studio ends is waited for no longer."""
TYPES = {
    ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".json": "application/json", ".svg": "image/svg+xml",
}  # fmt: skip
"""What files of a page there are."""

_Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class NoPort(CodedError):  # noqa: N818  # what happened, not an error of ours
    """The port that was named cannot be listened at."""

    code = Code.STUDIO
    helps = ("name another one with --port, or none: then a free one is taken",)


def page_files() -> dict[str, Traversable]:
    """Return every file of the page by its path in the page's folder, `` for the first; with the colours that all pages have."""
    found = {"palette.css": files("rcsc.views.pages").joinpath("palette.css")}
    waiting = [("", files("rcsc.desk.studio").joinpath("page"))]
    while waiting:
        prefix, folder = waiting.pop()
        for one in folder.iterdir():
            if one.is_dir():
                waiting.append((f"{prefix}{one.name}/", one))
            elif "." + one.name.rpartition(".")[2] in TYPES:
                found[prefix + one.name] = one
    return found | {"": found["index.html"]}


def usual_port(project: Path) -> int:
    """Return the port at which a project's studio listens where it can: what a browser keeps of a page, it keeps by its port.

    It is one of those that nobody registers (RFC 6335, section 6), and past those that Linux gives to connections.
    """
    digest = hashlib.sha256(os.fsencode(project.resolve())).digest()
    return FIRST_PORT + int.from_bytes(digest[:4], "big") % (LAST_PORT - FIRST_PORT + 1)


class Server:
    """Serves one studio.

    Attributes:
        hub: Where questions go.
        address: Of the page, once the server listens.
    """

    def __init__(self, port: int = 0, token: str = "", usual: int = 0) -> None:
        """Args: port: To listen on; 0 for the usual one, or a free one; token: Of the address; usual: See `usual_port`."""
        self.hub = Hub(self._soon)
        self.address = ""
        self._wanted, self._usual, self._port = port, usual, 0
        self._token = token or secrets.token_urlsafe(24)
        self._files = page_files()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._over: asyncio.Event | None = None
        self._entrance: Entrance | None = None
        self._talks: set[asyncio.Task[None]] = set()

    def serve(self, concerns: Sequence[Concern], opened: Callable[[str], None]) -> None:
        """Serve until `stop`, an interrupt, or, in the main thread, a signal that asks to end.

        Args:
            concerns: Who answers.
            opened: Called with the address when the server listens.

        Raises:
            NoPort: The port is taken, or may not be used.
        """
        asyncio.run(self._serve(concerns, opened))

    def stop(self) -> None:
        """Stop serving; from any thread."""
        if self._over is not None:
            self._soon(self._over.set)

    def again(self) -> "Server":
        """Return a server for the same address, to be served once this one has ended."""
        return Server(self._port, self._token)

    def _soon(self, work: Callable[[], None]) -> None:
        """Queue work in the server's thread; after the end, drop it."""
        loop = self._loop
        if loop is None or loop.is_closed():
            return
        try:
            loop.call_soon_threadsafe(work)
        except RuntimeError:  # it closed just now
            return

    async def _serve(self, concerns: Sequence[Concern], opened: Callable[[str], None]) -> None:
        self._loop, self._over = asyncio.get_running_loop(), asyncio.Event()
        _end_in_order(self._loop, self._over)
        self.hub.add(concerns)
        app = web.Application(middlewares=[self._guarded])
        app.on_response_prepare.append(self._headed)
        app.router.add_get("/{token}/socket", self._socket)
        app.router.add_get("/{token}/{name:.*}", self._file)
        runner = web.AppRunner(
            app, access_log=None, logger=silent("rcsc.desk.studio.server"), shutdown_timeout=GOODBYE_S
        )
        await runner.setup()
        assert runner.server is not None
        self._entrance, listens = Entrance(runner.server), None
        try:
            listens = await self._listens()
            self._port = listens.sockets[0].getsockname()[1]
            self.address = f"http://{ADDRESS}:{self._port}/{self._token}/"
            opened(self.address)
            self.hub.begin()
            await self._over.wait()
        finally:
            self.hub.close()
            for talk in self._talks:
                talk.cancel()
            if listens is not None:
                listens.close()
            await runner.cleanup()
            await asyncio.to_thread(
                self.hub.ended, LAST_S
            )  # who ends while a process begins leaves that without a parent

    async def _listens(self) -> asyncio.Server:
        """Listen at the port; raise `NoPort` where that fails."""
        assert self._entrance is not None
        if not self._wanted and self._usual:
            with contextlib.suppress(OSError):  # another studio of the project, or somebody else, has it
                return await self._entrance.listen(ADDRESS, self._usual)
        try:
            return await self._entrance.listen(ADDRESS, self._wanted)
        except OSError as error:
            why = os.strerror(error.errno) if error.errno else str(error)
            raise NoPort(f"port {self._wanted} cannot be listened at: {why}") from error

    # --- requests ---

    @web.middleware
    async def _guarded(self, request: web.Request, handler: _Handler) -> web.StreamResponse:
        reason = refusal(request.headers, request.path, self._port, self._token)
        if reason:
            answer = web.Response(status=403, text=f"{reason}\n")
            answer.force_close()
            return answer
        assert self._entrance is not None
        self._entrance.knows(request.transport)
        try:
            return await handler(request)
        except (web.HTTPException, ConnectionError):  # a refusal, or who asked has gone
            raise
        except Exception as error:  # noqa: BLE001  # told here, without the address and its token
            traceback.print_exception(error, file=sys.stderr)
            return web.Response(status=500, text=f"a bug in rcsc: {type(error).__name__}\n")

    async def _headed(self, _: web.Request, response: web.StreamResponse) -> None:
        """Add the headers to every answer, refusals included."""
        response.headers.update({**HEADERS, "Content-Security-Policy": policy(self._port)})

    async def _file(self, request: web.Request) -> web.Response:
        file = self._files.get(request.match_info["name"])
        if file is None:
            raise web.HTTPNotFound
        kind = TYPES["." + file.name.rpartition(".")[2]]
        return web.Response(body=file.read_bytes(), content_type=kind, charset="utf-8")

    # --- sockets ---

    async def _socket(self, request: web.Request) -> web.WebSocketResponse:
        # What is compressed is sent in a task that nobody waits for: where the page has gone, its exception would be printed
        socket = web.WebSocketResponse(max_msg_size=MOST_BYTES, heartbeat=HEARTBEAT_S, compress=False)
        if len(self._talks) >= MOST_PAGES:
            raise web.HTTPServiceUnavailable(text=f"{MOST_PAGES} pages are open\n")
        await socket.prepare(request)
        woken = asyncio.Event()
        client = Client(woken.set)
        sender = asyncio.create_task(_send(socket, client, woken))
        self._talks.add(sender)
        try:
            self.hub.enter(client)
            await self._listen(socket, client)
        finally:
            self.hub.leave(client)
            self._talks.discard(sender)
            sender.cancel()
            await asyncio.wait([sender])
            await socket.close()
        return socket

    async def _listen(self, socket: web.WebSocketResponse, client: Client) -> None:
        """Take the page's messages until it goes; a malformed message ends the talk."""
        async for said in socket:
            if said.type != WSMsgType.TEXT:
                return
            try:
                self.hub.ask(client, json_of(said.data, DEEPEST_MESSAGE, plain=False))
            except Malformed:
                return


def _end_in_order(loop: asyncio.AbstractEventLoop, over: asyncio.Event) -> None:
    """Let a signal that asks the process to end set an event. Signals are heard in the main thread alone, and not on every system."""
    if threading.current_thread() is not threading.main_thread():
        return
    for name in ("SIGTERM", "SIGHUP"):
        with contextlib.suppress(AttributeError, NotImplementedError):
            loop.add_signal_handler(getattr(signal, name), over.set)


async def _send(socket: web.WebSocketResponse, client: Client, woken: asyncio.Event) -> None:
    """Send waiting messages, as fast as the page takes them."""
    try:
        while True:
            await woken.wait()
            woken.clear()
            while (text := client.next()) is not None:
                await socket.send_str(text)
    except ConnectionError:
        return  # the page was closed while it was told
