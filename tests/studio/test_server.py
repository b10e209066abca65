"""The studio's server: who is let in, what is refused, and that no page holds up another, or the levels."""

import asyncio
import contextlib
import gc
import http.client
import json
import secrets
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any
from urllib.parse import urlsplit

import aiohttp
import pytest

from rcsc.base.diagnostics.coded import Refused as Refusal
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.guard import MOST_CONNECTIONS, door
from rcsc.desk.studio.hub import MOST_OPEN, Ask, Client, Concern, Hub, message
from rcsc.desk.studio.server import MOST_BYTES, MOST_PAGES, Server, page_files
from rcsc.front.commands import run as rcsc
from tests.studio.driven import DOCK, Seat
from tests.studio.served import PATIENCE_S, Page, Refused, page, page_at, serving, until
from tests.studio.strangers import STRANGERS, held_beside


class Echo(Concern):
    """A concern of the tests' own."""

    name, lane = "echo", "echo"

    def __init__(self) -> None:
        self.held, self.told = threading.Event(), threading.Event()
        self.asks: list[Ask] = []
        self.begun = self.closed = False

    @property
    def handlers(self) -> Mapping[str, Callable[[Ask], Any]]:
        return {
            "echo.say": self._say,
            "echo.hold": self._hold,
            "echo.bug": self._bug,
            "echo.refuse": self._refuse,
        }

    def greeting(self) -> Any:
        return {"warm": True}

    def begin(self) -> None:
        self.begun = True

    def close(self) -> None:
        self.closed = True

    def _say(self, ask: Ask) -> Any:
        return ask.body.text("text")

    def _hold(self, ask: Ask) -> Any:
        self.asks.append(ask)
        ask.on_cancel(self.told.set)
        for at in range(10**9):
            ask.progress("waits", at, 10**9)
            if self.held.wait(0.01):
                return at
        return None

    def _bug(self, _: Ask) -> Any:
        raise ZeroDivisionError

    def _refuse(self, _: Ask) -> Any:
        raise Refusal(Code.SHELL_NAME, "there is no such thing", "try another")


def status(
    server: Server, path: str, method: str = "GET", **headers: str
) -> tuple[int, Mapping[str, str], bytes]:
    """What a request gets; `path` after the address, or whole where it begins with a slash."""
    at = urlsplit(server.address)
    connection = http.client.HTTPConnection("127.0.0.1", at.port, timeout=PATIENCE_S)
    connection.request(method, path if path.startswith("/") else at.path + path, headers=headers)
    answer = connection.getresponse()
    try:
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        connection.close()


OUTSIDE = (
    *("../server.py", "%2e%2e/server.py", "..%2fserver.py", "vendor/../../server.py", "\\..\\server.py"),
    *("vendor", "vendor/", "x.js", "//etc/passwd"),
)


def test_only_its_own_page_is_let_in_and_nothing_leads_out_of_its_folder() -> None:
    with serving(others=[Echo()]) as server:
        port = urlsplit(server.address).port
        code, headers, body = status(server, "")
        assert (code, b"<title>rcsc studio" in body) == (200, True)
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["X-Content-Type-Options"] == "nosniff"
        for wrong in (
            {"Host": "attacker.example"}, {"Host": f"attacker.example:{port}"}, {"Origin": "http://attacker.example"}, {"Origin": "null"},
            {"Sec-Fetch-Site": "cross-site"}, {"Sec-Fetch-Site": "same-site"},
        ):  # fmt: skip
            assert status(server, "", **wrong)[0] == 403, wrong
            assert status(server, "socket", **wrong)[0] == 403, wrong
        gone_to = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
        assert status(server, "", **gone_to)[0] == 200
        for wrong in ({"Sec-Fetch-Dest": "iframe"}, {"Sec-Fetch-Mode": "cors"}, {"Origin": "null"}):
            assert status(server, "", **(gone_to | wrong))[0] == 403, wrong
        for path in ("/", "/socket", "/x" * 20, f"/{'x' * 32}/"):
            assert status(server, path)[0] == 403, path
            assert status(server, path, **gone_to)[0] == 403, path
        for path in OUTSIDE:
            assert status(server, path)[0] in {400, 403, 404}, path
        assert status(server, "", "POST")[0] == 405
        assert status(server, "socket")[0] in {400, 403}  # without an upgrade it is no socket


@pytest.mark.parametrize("name", ["Host", "Origin", "Sec-Fetch-Site", "HOST"])
def test_what_says_who_asks_is_there_once(name: str) -> None:
    """Of two, others may believe the second."""
    with serving(others=[Echo()]) as server:
        at = urlsplit(server.address)
        own = {"Host": at.netloc, "Origin": f"http://{at.netloc}", "Sec-Fetch-Site": "same-origin"}
        once = "".join(f"{key}: {value}\r\n" for key, value in own.items())
        for more, codes in (("", {b"200"}), (f"{name}: {own[name.title()]}\r\n", {b"400", b"403"})):
            answer = raw(server, f"GET {at.path} HTTP/1.1\r\n{once}{more}Connection: close\r\n\r\n".encode())
            assert answer.split()[1] in codes, (more, answer)


def raw(server: Server, said: bytes) -> bytes:
    """All that comes back of some bytes, until the server ends it."""
    port = urlsplit(server.address).port
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as one:
        one.sendall(said)
        return b"".join(iter(lambda: one.recv(65_536), b""))


def test_a_bug_in_an_answer_is_told_without_the_address(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with serving(others=[Echo()]) as server:
        monkeypatch.setitem(server._files, "main.js", object())
        code, headers, body = status(server, "main.js")
        assert (code, body) == (500, b"a bug in rcsc: AttributeError\n")
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert headers["X-Content-Type-Options"] == "nosniff"
        said = capfd.readouterr().err
        assert "AttributeError" in said
        assert urlsplit(server.address).path.strip("/") not in said


def test_a_port_that_is_taken_is_said(capfd: pytest.CaptureFixture[str]) -> None:
    with serving(others=[Echo()]) as server:
        port = urlsplit(server.address).port
        assert rcsc(["studio", str(DOCK / "system.toml"), "--alone", "--port", str(port)]) == 1
        assert f"port {port} cannot be listened at: Address already in use" in capfd.readouterr().err
        assert status(server, "")[0] == 200


def test_every_file_of_the_page_is_served_with_its_type() -> None:
    with serving(others=[Echo()]) as server:
        for name, file in page_files().items():
            code, headers, body = status(server, name)
            assert (code, body) == (200, file.read_bytes()), name
            assert headers["Content-Type"].partition(";")[0] in {
                "text/html",
                "text/javascript",
                "text/css",
                "application/json",
            }
    assert {"", "main.js", "bus.js", "views.js", "style.css", "vendor/three/three.module.js"} <= set(
        page_files()
    )


def run(work: Callable[[Server, Page], Any], *, echo: Echo | None = None) -> None:
    async def inside(server: Server) -> None:
        async with page(server) as one:
            await work(server, one)

    with serving(others=[echo or Echo()]) as server:
        asyncio.run(inside(server))


REFUSED: tuple[tuple[str, dict[str, Any], Code, str], ...] = (
    ("echo.say", {}, Code.STUDIO, "text"),
    ("echo.say", {"text": 3}, Code.STUDIO, "no text"),
    ("echo.nothing", {}, Code.STUDIO, "no part"),
    ("echo.refuse", {}, Code.SHELL_NAME, "no such thing"),
    ("echo.bug", {}, Code.INTERNAL, "ZeroDivisionError"),
)


def test_questions_are_answered_and_refused_by_number() -> None:
    async def work(_: Server, one: Page) -> None:
        assert await one.heard("echo.state", warm=True)
        numbers = [await one.send("echo.say", text=str(at)) for at in range(5)]
        assert [await one.answer(number) for number in reversed(numbers)] == ["4", "3", "2", "1", "0"]
        for kind, body, code, word in REFUSED:
            with pytest.raises(Refused, match=word) as refused:
                await one.ask(kind, **body)
            assert refused.value.code == code.value
        assert await one.ask("echo.say", text="\x07 still here") == "\x07 still here"

    run(work)


MALFORMED: tuple[str | bytes, ...] = (
    *("", "{", "[]", "3", "null", '{"id": 1}', '{"kind": "echo.say"}', '{"id": "1", "kind": "echo.say"}'),
    *(
        f'{{"id": {number}, "kind": "echo.say"}}'
        for number in ("-1", "0", "1.5", "true", "null", "9" * 30, "{}")
    ),
    *(
        '{"id": 1, "kind": 7}',
        '{"id": 1, "kind": "echo.say", "body": []}',
        '{"id": 1, "kind": "echo.say", "body": null}',
    ),
    '{"id": 1, "kind": "echo.say", "body": ' + "[" * 50 + "]" * 50 + "}",
    *("[" * 100_000, "1" * 100_000, "x" * (MOST_BYTES + 1), b"{}"),
)


@pytest.mark.parametrize("said", MALFORMED, ids=lambda said: str(said)[:40])
def test_what_is_no_question_ends_the_talk_and_nothing_else(said: str | bytes) -> None:
    async def work(server: Server, one: Page) -> None:
        async with page(server) as other:
            with contextlib.suppress(ConnectionError):  # it may be shut out while it still sends
                await (one.socket.send_str(said) if isinstance(said, str) else one.socket.send_bytes(said))
            await until(lambda: one.socket.closed)
            assert await other.ask("echo.say", text="x") == "x"

    run(work)


@pytest.mark.parametrize("raised", [ZeroDivisionError, KeyboardInterrupt, SystemExit, RecursionError])
@pytest.mark.parametrize("where", ["begin", "greeting", "later", "handler"])
def test_whatever_is_raised_is_told_to_every_page_and_ends_no_lane(
    where: str, raised: type[BaseException]
) -> None:
    """Where none had asked, pages that come later are told, too."""

    class Fails(Echo):
        def begin(self) -> None:
            if where == "begin":
                raise raised

        def greeting(self) -> Any:
            if where == "greeting":
                raise raised
            return {"warm": True}

        def _bug(self, _: Ask) -> Any:
            raise raised

    async def inside() -> None:
        async with page(server) as one:
            if where == "later":
                server.hub.do("echo", raise_it)
            if where == "handler":
                with pytest.raises(Refused, match=f"a bug in rcsc: {raised.__name__}"):
                    await one.ask("echo.bug")
            else:
                said = await one.heard("said", wrong=True)
                assert said["text"] == f"a bug in rcsc: {raised.__name__}"
                async with page(server) as other:
                    assert (await other.heard("said"))["text"] == said["text"]
            assert await one.ask("echo.say", text="still here") == "still here"

    def raise_it() -> None:
        raise raised

    with serving(others=[Fails()]) as server:
        asyncio.run(inside())


def test_a_question_is_cancelled_by_its_page_and_when_the_page_goes() -> None:
    echo = Echo()

    async def work(server: Server, one: Page) -> None:
        number = await one.send("echo.hold")
        await until(lambda: one.progress)
        assert one.progress[0]["text"] == "waits"
        await one.socket.send_json({"id": number, "cancel": True})
        assert await one.answer(number) == {"id": number, "cancelled": True}
        assert echo.told.is_set()
        async with page(server) as other:
            await other.send("echo.hold")
            await until(lambda: other.progress)
        await until(lambda: echo.asks[1].cancelled)
        assert await one.ask("echo.say", text="free") == "free"  # its lane, too

    run(work, echo=echo)
    assert echo.begun
    assert echo.closed


def test_no_page_has_more_open_than_allowed() -> None:
    echo = Echo()

    async def work(_: Server, one: Page) -> None:
        held = await one.send("echo.hold")
        several = [await one.send("echo.say", text="x") for _ in range(MOST_OPEN - 1)]
        with pytest.raises(Refused, match="at once"):
            await one.ask("echo.say", text="one more")
        echo.held.set()
        assert isinstance(await one.answer(held), int)
        assert [await one.answer(number) for number in several] == ["x"] * (MOST_OPEN - 1)

    run(work, echo=echo)


@contextlib.contextmanager
def hung(server: Server) -> Iterator[None]:
    """A page that opens its socket and then reads nothing."""
    at = urlsplit(server.address)
    head = (
        f"GET {at.path}socket HTTP/1.1", f"Host: {at.netloc}", f"Origin: http://{at.netloc}", "Connection: Upgrade", "Upgrade: websocket",
        "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "", "",
    )  # fmt: skip
    with socket.create_connection(("127.0.0.1", at.port or 0), PATIENCE_S) as one:
        one.sendall("\r\n".join(head).encode())
        assert one.recv(12) == b"HTTP/1.1 101"
        yield


def test_a_page_that_hangs_keeps_the_latest_only_and_holds_up_nobody() -> None:
    """Of all events to a page that reads nothing one a kind is kept; the other page hears every one."""

    async def work(server: Server, one: Page) -> None:
        with hung(server):
            for at in range(200):  # twenty megabytes, more than the system holds for a socket
                server.hub.tell("echo.news", {"at": at, "much": "x" * 100_000})
                assert (await one.heard("echo.news", at=at))["at"] == at
            waiting = [client._events for client in server.hub._clients]
            assert sorted(map(len, waiting)) == [0, 1]

    run(work)


def test_a_page_that_goes_while_it_is_told_leaves_no_complaint(caplog: pytest.LogCaptureFixture) -> None:
    """A browser offers to have messages compressed; what is compressed was sent in a task that nobody waited for."""
    much = secrets.token_hex(2_000_000)  # which takes a while to compress

    async def inside(server: Server) -> None:
        for _ in range(12):
            async with page_at(server.address, compress=15) as one:
                await one.heard("echo.state", warm=True)
                for at in range(4):
                    server.hub.tell(f"echo.news/{at}", much)
                await asyncio.sleep(0.02)
                one.socket._response.close()  # without a word, as a tab that is closed
                await asyncio.sleep(0.1)

    with serving(others=[Echo()]) as server:
        asyncio.run(inside(server))
    gc.collect()
    assert not caplog.messages


def test_pages_are_counted() -> None:
    async def work(server: Server, _: Page) -> None:
        async with Pages(server, MOST_PAGES - 1):
            with pytest.raises(aiohttp.WSServerHandshakeError):
                async with page(server):
                    pass

    run(work)


class Pages:
    """Several at once."""

    def __init__(self, server: Server, count: int) -> None:
        self._open = [page(server) for _ in range(count)]

    async def __aenter__(self) -> list[Page]:
        return [await one.__aenter__() for one in self._open]

    async def __aexit__(self, *_: object) -> None:
        for one in self._open:
            await one.__aexit__(None, None, None)


@pytest.mark.parametrize("said", STRANGERS)
def test_strangers_take_nobodys_place(said: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    """Who says nothing, or never all of it: the user is answered, and few of them are held."""
    with serving(others=[Echo()]) as server:
        parts = urlsplit(server.address)
        assert parts.hostname is not None
        assert parts.port is not None
        assert held_beside(parts.hostname, parts.port, parts.path, said) <= MOST_CONNECTIONS
    assert capfd.readouterr().err == ""


def test_two_concerns_do_not_answer_one_kind() -> None:
    hub = Hub(lambda work: work())
    hub.add([Echo()])
    with pytest.raises(ValueError, match="second"):
        hub.add([Echo()])


def test_the_latest_event_of_a_kind_takes_the_place_of_those_before() -> None:
    client = Client(lambda: None)
    for at in range(3):
        client.event("a", f"a{at}")
        client.event("b", f"b{at}")
        client.answer(f"answer {at}")
    said = []
    while (text := client.next()) is not None:
        said.append(text)
    assert said == ["a2", "b2", "answer 0", "answer 1", "answer 2"]


def test_what_is_not_finite_is_sent_as_text() -> None:
    said = json.loads(message(answer={"x": float("nan"), "y": [float("inf"), 1.5, {"z": -float("inf")}]}))
    assert said == {"answer": {"x": "nan", "y": ["inf", 1.5, {"z": "-inf"}]}}


@pytest.mark.needs("chromium")
def test_a_browser_that_opens_the_file_comes_to_the_page() -> None:
    with serving(others=[Echo()]) as server, door(server.address) as path, Seat() as seat:
        seat.open(path.as_uri())
        seat.wait("document.title === 'rcsc studio'")
        assert seat.value("location.href") == server.address
