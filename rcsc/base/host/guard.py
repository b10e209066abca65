"""Who may see the page: the user's own browser on this machine, and no other page in it.

In: what a request says of itself. Out: why it is refused, or nothing. A server on the loopback interface is reached by every page
that the user has open; these rules keep them out:

- `Host`, `Origin` and `Sec-Fetch-Site` are there once at most, so that nobody reads another one than is judged here;
- `Host` names this server by its loopback address: a foreign name that was made to resolve to 127.0.0.1 does not (DNS rebinding);
- `Origin`, which a browser sends with what other pages start, is the page's own, and a WebSocket must have one;
- `Sec-Fetch-Site` says that the page itself or the user asked; or else the page is gone to in a window of its own, by who knows the token:
  the user's own file (`door`);
- the path begins with a token that cannot be guessed; it stands in the address that the user is given, in no command line, which every
  user of the machine reads, and no referrer tells it.
"""

import asyncio
import hmac
import logging
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.base.host.files import write_atomically

HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Of every answer, beside the content security policy."""
_ONCE = ("host", "origin", "sec-fetch-site", "sec-fetch-mode", "sec-fetch-dest")
_DOOR = """<!doctype html>
<meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}">
<title>rcsc</title><a href="{address}">to the page</a>
"""


MOST_CONNECTIONS = 64
"""At once, whoever makes them: a page and its parts need some ten."""
MOST_ACCEPTED = 8
"""Between two looks at what the others say: the user has shown the token long before `MOST_CONNECTIONS` more have come."""

MOST_WAITING = 128
"""Until they are accepted."""


class Entrance:
    """Has `MOST_CONNECTIONS` at once answered: strangers, who have not shown the token, give way to who comes, the oldest first.

    Who says nothing, or half a request, or a header a minute, therefore takes nobody's place.
    """

    def __init__(self, make: Callable[[], asyncio.Protocol]) -> None:
        """Args: make: Answers a connection."""
        self._make = make
        self._strangers: dict[asyncio.Transport, None] = {}
        self._users: dict[asyncio.Transport, None] = {}

    async def listen(self, address: str, port: int) -> asyncio.Server:
        """Let connections come.

        Raises:
            OSError: The port cannot be listened at.
        """
        place = socket.create_server((address, port))
        try:
            loop = asyncio.get_running_loop()
            server = await loop.create_server(lambda: _Arrival(self), sock=place, backlog=MOST_ACCEPTED)
        except BaseException:
            place.close()
            raise
        place.listen(MOST_WAITING)  # the loop would have no more wait than it accepts
        return server

    def knows(self, transport: asyncio.BaseTransport | None) -> None:
        """Note that whoever is at the other end has shown the token."""
        if isinstance(transport, asyncio.Transport):
            self._strangers.pop(transport, None)
            self._users[transport] = None

    def arrived(self, transport: asyncio.Transport) -> None:
        """Have a new connection answered, in the place of a stranger's where there are too many; or refuse it."""
        for there in (self._strangers, self._users):
            for gone in [one for one in there if one.is_closing()]:
                del there[gone]
        if len(self._strangers) + len(self._users) >= MOST_CONNECTIONS:
            if not self._strangers:
                _dismiss(transport, "503 Service Unavailable")
                return
            _dismiss(first := next(iter(self._strangers)), "408 Request Timeout")
            del self._strangers[first]
        self._strangers[transport] = None
        protocol = self._make()
        transport.set_protocol(protocol)
        protocol.connection_made(transport)


class _Arrival(asyncio.Protocol):
    """A connection of which nothing is known."""

    def __init__(self, entrance: Entrance) -> None:
        self._entrance = entrance

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._entrance.arrived(transport)


def _dismiss(transport: asyncio.Transport, why: str) -> None:
    """End a connection with a plain answer; at once where the other end takes none."""
    transport.write(f"HTTP/1.1 {why}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n".encode())
    if transport.get_write_buffer_size():
        transport.abort()
    else:
        transport.close()


def silent(name: str) -> logging.Logger:
    """Return a log that nobody sees: what anybody on this machine sends that is no request is nothing to the user."""
    log = logging.getLogger(name)
    log.propagate = False
    log.addHandler(logging.NullHandler())
    return log


@contextmanager
def door(address: str) -> Iterator[Path]:
    """Give a file that sends a browser to an address, in a folder of the user's own, for as long as the block takes.

    Whoever opens it in a browser names the file, and not the address with its token.

    Raises:
        OSError: It cannot be written.
    """
    with scratch("page") as folder:
        path = folder / "open.html"
        write_atomically(path, _DOOR.format(address=address).encode(), 0o600, durable=False)
        yield path


def policy(port: int) -> str:
    """Return the content security policy: the page's own script and style, its own socket, and nothing else."""
    sockets = f"ws://127.0.0.1:{port} ws://localhost:{port}"
    return (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
        f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


def refusal(headers: Mapping[str, str], path: str, port: int, token: str) -> str:
    """Why a request is refused; empty where it is not.

    Args:
        headers: Of the request; names in any case, as the mapping has them.
        path: Of the request, from its first slash.
        port: Where the server listens.
        token: That the path must begin with.
    """
    said = [name.lower() for name, _ in headers.items()]  # the names alone are told once each
    if any(said.count(name) > 1 for name in _ONCE):
        return "a header is there twice"
    host = headers.get("Host", "")
    if host not in {f"127.0.0.1:{port}", f"localhost:{port}"}:
        return "this is no name of the page's server"
    origin = headers.get("Origin")
    if origin is None and headers.get("Upgrade"):
        return "a socket is for the page alone"
    if origin is not None and origin != f"http://{host}":
        return "another page asked"
    if headers.get("Sec-Fetch-Site", "none") not in {"none", "same-origin"} and not _is_gone_to(headers):
        return "another page asked"
    if not hmac.compare_digest(path.split("/")[1].encode(), token.encode()):
        return "the address lacks its token"
    return ""


def _is_gone_to(headers: Mapping[str, str]) -> bool:
    """Return whether a window goes to the page: whoever had it do so sees nothing of it, and is no page that frames or fetches it."""
    return headers.get("Sec-Fetch-Mode") == "navigate" and headers.get("Sec-Fetch-Dest") == "document"
