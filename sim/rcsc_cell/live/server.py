"""The page's server: on the loopback interface, in a thread beside the run.

In: what the run publishes. Out: one page, and a WebSocket by which it is told what is new, ten times a second at most,
and by which it says which variables it draws. The page can ask; nothing that it sends reaches the run.
"""

import asyncio
import json
import math
import secrets
import threading
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any, Self

from aiohttp import WSMsgType, web

from rcsc.host.files.read import Malformed, json_of
from rcsc.host.guard import HEADERS, Entrance, policy, refusal, silent
from rcsc_cell.live.board import Board, Latest, Moment, Value, problems

ADDRESS = "127.0.0.1"
PUSH_S = 0.1
"""The page is told what is new so often."""
GOODBYE_S = 0.4
"""A page that does not answer is waited for no longer when the run ends."""
MOST_PAGES = 16
"""Pages at once."""
MOST_WATCHED = 256
DEEPEST_MESSAGE = 4
"""Variables that one page may ask for."""
MOST_BYTES = 65_536
"""Of a message from the page."""
_FILES = {
    "": ("page.html", "text/html"),
    "page.js": ("page.js", "text/javascript"),
    "page.css": ("page.css", "text/css"),
}

_Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


@dataclass(slots=True)
class _Told:
    """What a page has been told already.

    Attributes:
        watched: The variables that it draws.
        fresh: Those of which it has nothing yet.
    """

    watched: tuple[str, ...] = ()
    fresh: set[str] = field(default_factory=set)
    tick: int = -2
    moment: int = -1
    era: int = 0
    changed: int = -1
    display: object = ""
    frames: dict[str, int] = field(default_factory=dict)


class Live:
    """The live page of one run.

    Publishing copies and returns: it never waits for a browser. `port` 0 takes a free one.

    Attributes:
        address: Where it listens, host and port, once it has begun.
    """

    def __init__(
        self,
        names: Sequence[str],
        displays: Mapping[str, Sequence[str]],
        port: int = 0,
        *,
        tick_ms: int = 40,
        title: str = "rcsc",
    ) -> None:
        """Prepare the page; open nothing yet.

        Args:
            names: All variables that `publish` will give.
            displays: Sets of variables by the member of a `display` variable that asks for them; `a over b` is a graph of both.
            port: To listen on.
            tick_ms: Of the system.
            title: Of the page.

        Raises:
            ValueError: A display has a variable that is not among the names; ask `board.problems` first.
        """
        if wrong := problems(names, displays):
            raise ValueError("; ".join(wrong))
        self.address = ("", 0)
        self._hello = {
            "hello": {
                "title": title,
                "tick_s": tick_ms / 1000,
                "names": list(names),
                "displays": {name: list(graphs) for name, graphs in displays.items()},
            }
        }
        self._names, self._port = frozenset(names), port
        self._board = Board(names, displays)
        self._token = secrets.token_urlsafe(24)
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._over = asyncio.Event()
        self._entrance: Entrance | None = None
        self._talks: set[asyncio.Future[None]] = set()
        self._drawn: dict[str, float] = {}

    # --- for the run ---

    def start(self) -> str:
        """Opens the page; returns its address, which is all that a user needs and nobody else may have.

        Raises:
            OSError: The port is taken.
            RuntimeError: It was opened before.
        """
        if self._thread is not None:
            raise RuntimeError("the page was opened before")
        ready: Future[int] = Future()
        self._thread = threading.Thread(target=self._serve, args=(ready,), name="live page", daemon=True)
        self._thread.start()
        return f"http://{ADDRESS}:{ready.result()}/{self._token}/"

    def publish(self, tick: int, values: Mapping[str, Value]) -> None:
        """The values after a tick; a tick that is not after the last takes the run back."""
        self._board.publish(tick, values)

    def frame_due(self, kind: str) -> bool:
        """Whether a picture of a kind would be looked at: a page is open, and the last picture is old enough."""
        return bool(self._talks) and time.monotonic() - self._drawn.get(kind, -math.inf) >= PUSH_S

    def frame(self, kind: str, svg: str) -> None:
        """A picture, by `rcsc_cell.pictures`; `kind` is `stick`, `solid`, or what else stands below it."""
        self._drawn[kind] = time.monotonic()
        self._board.frame(kind, svg)

    def row(self, number: int, text: str, state: str) -> None:
        """What has become of a row of the script."""
        self._board.row(number, text, state)

    def stop(self) -> None:
        """Tells the pages that the run is over, and closes; a page that is open keeps what it shows."""
        if self._thread is not None and self._loop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._over.set)
            self._thread.join()

    def __enter__(self) -> Self:
        """Opens the page."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Closes it."""
        self.stop()

    # --- the server's thread ---

    def _serve(self, ready: "Future[int]") -> None:
        try:
            asyncio.run(self._open(ready))
        except BaseException as error:  # noqa: BLE001  # `start` raises it
            if not ready.done():
                ready.set_exception(error)

    async def _open(self, ready: "Future[int]") -> None:
        self._loop = asyncio.get_running_loop()
        app = web.Application(middlewares=[self._guarded])
        app.on_response_prepare.append(self._headed)
        app.router.add_get("/{token}/socket", self._socket)
        app.router.add_get("/{token}/{name:[a-z.]*}", self._file)
        runner = web.AppRunner(
            app, access_log=None, logger=silent("rcsc_cell.live"), shutdown_timeout=GOODBYE_S
        )
        await runner.setup()
        assert runner.server is not None
        self._entrance, listens = Entrance(runner.server), None
        try:
            listens = await self._entrance.listen(ADDRESS, self._port)
            self.address = listens.sockets[0].getsockname()[:2]
            ready.set_result(self.address[1])
            await self._over.wait()
            if self._talks:  # what is being cleaned up no longer hears a page say good-bye
                await asyncio.wait(self._talks, timeout=GOODBYE_S)
        finally:
            if listens is not None:
                listens.close()
            await runner.cleanup()

    @web.middleware
    async def _guarded(self, request: web.Request, handler: _Handler) -> web.StreamResponse:
        reason = refusal(request.headers, request.path, self.address[1], self._token)
        if reason:
            answer = web.Response(status=403, text=f"{reason}\n")
            answer.force_close()
            return answer
        assert self._entrance is not None
        self._entrance.knows(request.transport)
        return await handler(request)

    async def _headed(self, _: web.Request, response: web.StreamResponse) -> None:
        """Every answer has the headers, a refusal, too."""
        response.headers.update({**HEADERS, "Content-Security-Policy": policy(self.address[1])})

    async def _file(self, request: web.Request) -> web.Response:
        file = _FILES.get(request.match_info["name"])
        if file is None:
            raise web.HTTPNotFound
        name, kind = file
        text = files("rcsc_cell.live").joinpath(name).read_text(encoding="utf-8")
        return web.Response(text=text, content_type=kind)

    async def _socket(self, request: web.Request) -> web.WebSocketResponse:
        if len(self._talks) >= MOST_PAGES:
            raise web.HTTPServiceUnavailable(text=f"{MOST_PAGES} pages are open\n")
        socket = web.WebSocketResponse(max_msg_size=MOST_BYTES, heartbeat=30.0, compress=False)
        await socket.prepare(request)
        told, talk = _Told(), asyncio.get_running_loop().create_future()
        self._talks.add(talk)
        reader = asyncio.create_task(self._listen(socket, told))
        try:
            await socket.send_str(_json(self._hello))
            while not socket.closed and not reader.done():
                over = await self._pause()
                news = self._news(told) | ({"over": True} if over else {})
                if news:
                    await socket.send_str(_json(news))
                if over:
                    break
        except ConnectionError:
            pass  # the page was closed while it was told
        finally:
            reader.cancel()
            try:
                await asyncio.wait([reader])  # who closes must be the only one who listens
                await socket.close()
            finally:
                self._talks.discard(talk)
                talk.set_result(None)
        return socket

    async def _pause(self) -> bool:
        """Whether the run ended."""
        try:
            await asyncio.wait_for(self._over.wait(), PUSH_S)
        except TimeoutError:
            return False
        return True

    async def _listen(self, socket: web.WebSocketResponse, told: _Told) -> None:
        """What the page says: the variables that it draws. Anything else ends the talk."""
        async for message in socket:
            wanted = watched(message.data, self._names) if message.type == WSMsgType.TEXT else None
            if wanted is None:
                return
            told.fresh = (told.fresh | (set(wanted) - set(told.watched))) & set(wanted)
            told.watched, told.tick = wanted, -2

    def _news(self, told: _Told) -> dict[str, Any]:
        """Return what is new to the page, and note that it was told."""
        latest = self._board.latest()
        news = self._shown(latest, told)
        if latest.tick != told.tick or latest.era != told.era:
            told.tick = latest.tick
            news |= {"tick": latest.tick, "values": _picked(latest.values, told.watched)}
            news["series"] = self._series(latest, told)
        return news

    def _shown(self, latest: Latest, told: _Told) -> dict[str, Any]:
        news: dict[str, Any] = {}
        frames = {
            kind: svg for kind, (number, svg) in latest.frames.items() if told.frames.get(kind) != number
        }
        if frames:
            told.frames = {kind: number for kind, (number, _) in latest.frames.items()}
            news["frames"] = frames
        if latest.changed != told.changed:
            told.changed = latest.changed
            news["rows"] = [[number, *row] for number, row in sorted(latest.rows.items())]
        if latest.display != told.display:
            told.display = latest.display
            news["display"] = latest.display and {"by": latest.display.by, "value": latest.display.value}
        return news

    def _series(self, latest: Latest, told: _Told) -> dict[str, Any]:
        """Return points by variable: all of a variable new to the page or void, else what came since."""
        if latest.era != told.era:
            told.era, told.fresh = latest.era, set(told.watched)
        since = self._board.since(told.moment)
        whole = self._board.since(-1) if told.fresh else []
        series = {
            name: {
                "whole": name in told.fresh,
                "points": _points(whole if name in told.fresh else since, name),
            }
            for name in told.watched
        }
        told.moment = max((moments[-1][0] for moments in (since, whole) if moments), default=told.moment)
        told.fresh = set()
        return series


def watched(text: str, names: frozenset[str]) -> tuple[str, ...] | None:
    """Return the variables that a message from the page asks for; None for any other message."""
    try:
        message = json_of(text, DEEPEST_MESSAGE)
    except Malformed:
        return None
    wanted = message.get("watch") if isinstance(message, dict) else None
    if not isinstance(wanted, list) or len(wanted) > MOST_WATCHED:
        return None
    if not all(isinstance(name, str) and name in names for name in wanted):
        return None
    return tuple(dict.fromkeys(wanted))


def _picked(values: Mapping[str, Value], names: Sequence[str]) -> dict[str, Value | None]:
    return {name: _plain(values.get(name)) for name in names}


def _points(moments: Sequence[Moment], name: str) -> list[list[Any]]:
    return [[tick, _plain(values.get(name))] for tick, values in moments]


def _plain(value: Value | None) -> Value | None:
    """Return what JSON can hold: None for a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _json(message: Mapping[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
