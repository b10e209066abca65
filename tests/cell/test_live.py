"""The live page: what a run publishes is seen in a browser, and no other page, name or machine gets at it."""

import asyncio
import contextlib
import http.client
import json
import logging
import socket
import threading
from collections.abc import Iterator, Sequence
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from math import cos, inf, nan, radians, sin
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import aiohttp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.host.guard import MOST_CONNECTIONS, refusal
from rcsc_cell.cell.arm import plate
from rcsc_cell.database.pose import nine
from rcsc_cell.live import Live
from rcsc_cell.live.board import MOST_MOMENTS, Board, Display, History, display_names, problems
from rcsc_cell.live.server import MOST_BYTES, MOST_PAGES, MOST_WATCHED, watched
from rcsc_cell.pictures.stick import stick
from tests.support.browser import Browser
from tests.support.strangers import STRANGERS, held_beside

X, Z, OPENING = "primitive.to_robot.plate[0]", "primitive.to_robot.plate[2]", "gripper.opening_mm"
STATE, CHOOSER = "task.cur_state", "task.to_user.display"
NAMES = (X, Z, OPENING, STATE, CHOOSER)
DISPLAYS = {"moving": (Z, f"{Z} over {X}"), "gripping": (OPENING, STATE)}
JOINTS = tuple(radians(angle) for angle in (35.0, 59.0, -185.0, 0.0, -54.0, 15.0))


def values(tick: int, display: str = "moving") -> dict[str, float | str]:
    state = f"state_{tick // 20 % 5}"
    return {
        X: 100 * cos(tick / 20),
        Z: 300 + 80 * sin(tick / 20),
        OPENING: 40.0,
        STATE: state,
        CHOOSER: display,
    }


# --- what is kept ---


@given(st.lists(st.integers(1, 5), min_size=1, max_size=40), st.integers(1, 400))
def test_history_is_even_and_does_not_grow(gaps: list[int], times: int) -> None:
    history, tick, ticks = History(), 0, []
    for gap in gaps * times:
        history.add(tick, {})
        ticks.append(tick)
        tick += gap
    kept = [tick for tick, _ in history.moments]
    assert len(kept) <= MOST_MOMENTS
    stride = ticks.index(kept[1]) if len(kept) > 1 else 1
    assert kept == ticks[::stride]
    assert len(kept) > min(len(ticks), MOST_MOMENTS) // 2 - 1
    assert history.since(-1) == history.moments
    assert [tick for tick, _ in history.since(kept[-1] // 2)] == [
        tick for tick in kept if tick > kept[-1] // 2
    ]


def test_a_run_that_is_taken_back_forgets_what_has_not_happened() -> None:
    history = History()
    for tick in range(10):
        history.add(tick, {X: tick})
    history.add(4, {X: 40.0})
    assert history.moments == [*((tick, {X: tick}) for tick in range(4)), (4, {X: 40.0})]
    assert history.era == 1


def test_what_was_published_is_not_changed_by_the_run() -> None:
    board, given_values = Board(NAMES, {}), values(1)
    board.publish(1, given_values)
    given_values[X] = 9999.0
    assert board.since(0)[0][1][X] == pytest.approx(values(1)[X])


def test_the_table_that_chose_last_is_shown() -> None:
    names = ("task.display", "gripper.to_user.display", "gripper.displayed", "display")
    assert display_names(names) == ("task.display", "gripper.to_user.display", "display")
    board = Board(names, {"moving": (), "gripping": ()})

    def shown(tick: int, task: str, gripper: str) -> Display | None:
        board.publish(tick, {"task.display": task, "gripper.to_user.display": gripper})
        return board.latest().display

    assert shown(0, "none", "none") is None
    assert shown(1, "moving", "none") == Display("task.display", "moving")
    assert shown(2, "moving", "gripping") == Display("gripper.to_user.display", "gripping")
    assert shown(3, "moving", "none") == Display("task.display", "moving")  # `none` names no set
    assert shown(4, "gripping", "none") == Display("task.display", "gripping")
    assert shown(5, "none", "none") is None


def test_displays_of_what_is_not_there_are_named() -> None:
    found = problems(NAMES, {"moving": (Z, "no.such"), "graph": (f"{Z} over nothing",)})
    assert found == (
        "display `moving`: there is no variable `no.such`",
        "display `graph`: there is no variable `nothing`",
    )
    with pytest.raises(ValueError, match=r"no\.such"):
        Live(NAMES, {"moving": ("no.such",)})
    assert problems(NAMES, DISPLAYS) == ()


# --- who is let in ---


@pytest.mark.parametrize(
    ("headers", "path", "reason"),
    [
        ({"Host": "127.0.0.1:80"}, "/TOKEN/", ""),
        ({"Host": "localhost:80"}, "/TOKEN/page.js", ""),
        (
            {"Host": "127.0.0.1:80", "Origin": "http://127.0.0.1:80", "Upgrade": "websocket"},
            "/TOKEN/socket",
            "",
        ),
        ({"Host": "127.0.0.1:80", "Sec-Fetch-Site": "none"}, "/TOKEN/", ""),
        ({"Host": "127.0.0.1:80", "Sec-Fetch-Site": "same-origin"}, "/TOKEN/", ""),
        ({}, "/TOKEN/", "name"),
        ({"Host": "attacker.example:80"}, "/TOKEN/", "name"),
        ({"Host": "127.0.0.1.attacker.example:80"}, "/TOKEN/", "name"),
        ({"Host": "127.0.0.1"}, "/TOKEN/", "name"),
        ({"Host": "127.0.0.1:81"}, "/TOKEN/", "name"),
        ({"Host": "127.0.0.1:80", "Upgrade": "websocket"}, "/TOKEN/socket", "page alone"),
        ({"Host": "127.0.0.1:80", "Origin": "http://localhost:80"}, "/TOKEN/", "another page"),
        ({"Host": "127.0.0.1:80", "Origin": "https://127.0.0.1:80"}, "/TOKEN/", "another page"),
        ({"Host": "127.0.0.1:80", "Origin": "http://127.0.0.1:81"}, "/TOKEN/", "another page"),
        ({"Host": "127.0.0.1:80", "Origin": "null"}, "/TOKEN/", "another page"),
        ({"Host": "127.0.0.1:80", "Sec-Fetch-Site": "cross-site"}, "/TOKEN/", "another page"),
        ({"Host": "127.0.0.1:80", "Sec-Fetch-Site": "same-site"}, "/TOKEN/", "another page"),
        ({"Host": "127.0.0.1:80"}, "/", "token"),
        ({"Host": "127.0.0.1:80"}, "/TOKE/", "token"),
        ({"Host": "127.0.0.1:80"}, "/TOKENS/", "token"),
        ({"Host": "127.0.0.1:80"}, "/x/TOKEN/", "token"),
        ({"Host": "127.0.0.1:80"}, "/\N{LATIN SMALL LETTER E WITH ACUTE}/", "token"),
    ],
)
def test_requests(headers: dict[str, str], path: str, reason: str) -> None:
    found = refusal(headers, path, 80, "TOKEN")
    assert (reason in found) if reason else found == ""


@pytest.fixture
def live() -> Iterator[Live]:
    with Live(NAMES, DISPLAYS, title="a <run>") as running:
        for tick in range(100):
            running.publish(tick, values(tick))
        yield running


def url(running: Live) -> str:
    return f"http://127.0.0.1:{running.address[1]}/{running._token}/"


def ask(running: Live, path: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], str]:
    """Status, headers and body of a request; `token` in the path stands for the right one."""
    connection = http.client.HTTPConnection("127.0.0.1", running.address[1], timeout=30)
    sent = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path.replace("token", running._token), headers=sent)
    answer = connection.getresponse()
    status, body = answer.status, "" if answer.status == 101 else answer.read().decode()
    connection.close()
    return status, dict(answer.getheaders()), body


UPGRADE = {
    "Connection": "Upgrade", "Upgrade": "websocket",
    "Sec_WebSocket_Version": "13", "Sec_WebSocket_Key": "AAAAAAAAAAAAAAAAAAAAAA==",
}  # fmt: skip


def test_the_page_is_served_under_strict_headers(live: Live) -> None:
    for path in ("/token/", "/token/page.js", "/token/page.css"):
        status, headers, body = ask(live, path)
        assert status == 200
        assert body
        policy = dict(part.strip().split(" ", 1) for part in headers["Content-Security-Policy"].split(";"))
        assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == "'none'"
        assert policy["script-src"] == policy["style-src"] == "'self'"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert not [name for name in headers if name.lower().startswith("access-control")]


@pytest.mark.parametrize(
    "path", ["/", "/wrong/", "/wrong/page.js", "/wrong/socket", "//", "/page.html", "/%2e%2e/"]
)
def test_without_the_token_nothing_is_served(live: Live, path: str) -> None:
    own = f"http://127.0.0.1:{live.address[1]}"
    for headers in ({}, {**UPGRADE, "Origin": own}):
        status, answered, body = ask(live, path, **headers)
        assert status == 403
        assert live._token not in body + str(answered)
        assert "rcsc" not in body


def test_a_foreign_host_or_origin_is_refused_though_it_knows_the_token(live: Live) -> None:
    port = live.address[1]
    own, foreign = f"http://127.0.0.1:{port}", "https://attacker.example"
    assert ask(live, "/token/", Host=f"attacker.example:{port}")[0] == 403
    assert ask(live, "/token/page.js", Origin=foreign)[0] == 403
    assert ask(live, "/token/socket", **UPGRADE, Origin=own)[0] == 101
    assert ask(live, "/token/socket", **UPGRADE, Origin=own, Host=f"attacker.example:{port}")[0] == 403
    assert ask(live, "/token/socket", **UPGRADE, Origin=foreign)[0] == 403
    assert ask(live, "/token/socket", **UPGRADE)[0] == 403


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "PATCH"])
def test_nothing_can_be_sent(live: Live, method: str) -> None:
    status, headers, _ = ask(live, "/token/", method, Origin=f"http://127.0.0.1:{live.address[1]}")
    assert status == 405
    assert not [name for name in headers if name.lower().startswith("access-control")]


@pytest.mark.parametrize(
    "path", ["/token/server.py", "/token/page.html", "/token/..", "/token/%2e%2e%2fguard.py"]
)
def test_only_the_three_files_are_served(live: Live, path: str) -> None:
    assert ask(live, path)[0] in {403, 404}


def test_it_listens_on_the_loopback_interface_alone(live: Live) -> None:
    assert live.address[0] == "127.0.0.1"
    for other in ("127.0.0.2", socket.gethostbyname(socket.gethostname())):
        if other != "127.0.0.1":
            with socket.socket() as knock:
                knock.settimeout(10)
                assert knock.connect_ex((other, live.address[1])) != 0


JUNK = (
    b"\x16\x03\x01\x02\x00", b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"\0" * 100, b"GET /" + b"a" * 20_000,
    b"GET / HTTP/1.1\r\nHost : x\r\n\r\n", b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\nContent-Length: 3\r\n\r\nzz",
)  # fmt: skip


def answered(live: Live, said: bytes) -> bytes:
    with socket.create_connection(live.address, timeout=60) as one:
        one.sendall(said)
        return one.recv(65_536)


def test_junk_is_answered_plainly_and_printed_nowhere(
    live: Live, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    for said in JUNK:
        assert answered(live, said).split()[1] == b"400"
    assert capfd.readouterr().err == ""
    assert {record.name for record in caplog.records} <= {
        "rcsc_cell.live"
    }  # pytest sees what is told to nobody
    assert not logging.getLogger("rcsc_cell.live").propagate


@pytest.mark.parametrize("said", STRANGERS)
def test_strangers_take_nobodys_place(live: Live, said: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    """Who says nothing, or never all of it: the user is answered, and few of them are held."""
    where, port, path = live.address[0], live.address[1], urlsplit(url(live)).path
    assert held_beside(where, port, path, said) <= MOST_CONNECTIONS
    assert capfd.readouterr().err == ""


def test_connections_are_bounded(live: Live) -> None:
    """Those of whoever knows the token, too; those that go make room."""
    with contextlib.ExitStack() as held:
        for _ in range(MOST_CONNECTIONS):
            one = held.enter_context(socket.create_connection(live.address, timeout=60))
            one.sendall(
                f"GET {urlsplit(url(live)).path} HTTP/1.1\r\nHost: 127.0.0.1:{live.address[1]}\r\n\r\n".encode()
            )
            assert one.recv(65_536).split()[1] == b"200"
        assert answered(live, b"").split()[1] == b"503"
    for _ in range(1000):
        with contextlib.suppress(http.client.HTTPException, ConnectionError):
            if ask(live, "/token/")[0] == 200:
                return
    pytest.fail("no room was made")


def test_pages_are_bounded(live: Live) -> None:
    async def inside() -> list[int]:
        own = f"http://127.0.0.1:{live.address[1]}"
        async with contextlib.AsyncExitStack() as held:
            session = await held.enter_async_context(aiohttp.ClientSession())
            for _ in range(MOST_PAGES):
                await held.enter_async_context(session.ws_connect(f"{url(live)}socket", origin=own))
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await session.ws_connect(f"{url(live)}socket", origin=own)
            return [refused.value.status]

    assert asyncio.run(inside()) == [503]


def test_two_pages_have_two_tokens() -> None:
    tokens = {Live(NAMES, {})._token for _ in range(20)}
    assert len(tokens) == 20
    assert min(map(len, tokens)) >= 32


def test_it_begins_once_and_ends() -> None:
    live = Live(NAMES, {})
    live.stop()  # nothing was begun
    address = urlsplit(live.start())
    with pytest.raises(RuntimeError):
        live.start()
    with pytest.raises(OSError, match="in use"):
        Live(NAMES, {}, port=live.address[1]).start()
    live.stop()
    live.stop()
    live.publish(0, values(0))  # nobody sees it
    assert "live page" not in [thread.name for thread in threading.enumerate()]
    with socket.socket() as knock:
        assert knock.connect_ex(("127.0.0.1", address.port or 0)) != 0


# --- what is said over the socket ---


@given(
    st.text()
    | st.recursive(
        st.none() | st.integers() | st.text(), lambda x: st.lists(x) | st.dictionaries(st.text(), x)
    ).map(json.dumps)
)
def test_what_is_no_message_asks_for_nothing(text: str) -> None:
    assert watched(text, frozenset(NAMES)) in (None, ())


def test_messages() -> None:
    known = frozenset(NAMES)
    assert watched(json.dumps({"watch": [Z, X, Z]}), known) == (Z, X)
    assert watched(json.dumps({"watch": [Z, "no.such"]}), known) is None
    assert watched(json.dumps({"watch": [Z] * (MOST_WATCHED + 1)}), known) is None
    assert watched("[" * 100_000, known) is None


async def _talk(live: Live, said: Sequence[str], until: str) -> list[dict[str, Any]]:
    """What the server says after these messages, to the first that has a key, or to the end."""
    origin = f"http://127.0.0.1:{live.address[1]}"
    heard: list[dict[str, Any]] = []
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{url(live)}socket", origin=origin) as talk,
    ):
        for text in said:
            await talk.send_str(text)
        async for message in talk:
            heard.append(json.loads(message.data))
            if until in heard[-1] and (until != "series" or heard[-1]["series"]):
                break
    return heard


def talk(live: Live, said: Sequence[str], until: str) -> list[dict[str, Any]]:
    return asyncio.run(asyncio.wait_for(_talk(live, said, until), 30))


def test_a_page_is_told_what_it_asks_for_and_no_more(live: Live) -> None:
    live.row(1, "MOVE BOXT", "done")
    live.frame("stick", "<svg/>")
    live.publish(100, values(100) | {Z: nan, X: inf})
    heard = talk(live, [json.dumps({"watch": [Z]})], "series")
    assert heard[0]["hello"]["names"] == list(NAMES)
    assert heard[0]["hello"]["displays"] == {name: list(graphs) for name, graphs in DISPLAYS.items()}
    all_news = {key: value for news in heard for key, value in news.items()}
    assert all_news["rows"] == [[1, "MOVE BOXT", "done"]]
    assert all_news["frames"] == {"stick": "<svg/>"}
    assert all_news["display"] == {"by": CHOOSER, "value": "moving"}
    assert heard[-1]["tick"] == 100
    assert heard[-1]["values"] == {Z: None}  # what is not a number is none
    assert list(heard[-1]["series"]) == [Z]
    points = heard[-1]["series"][Z]["points"]
    assert points[:100] == [[tick, pytest.approx(values(tick)[Z])] for tick in range(100)]
    assert points[100] == [100, None]


@pytest.mark.parametrize(
    "said",
    ["", "nonsense", '{"watch": ["no.such"]}', '{"set": {"task.cur_state": 3}}', "x" * (MOST_BYTES + 1)],
)
def test_a_page_that_says_anything_else_is_left(live: Live, said: str) -> None:
    heard = talk(live, [said], "never")  # ends because the server closes
    assert "series" not in heard[-1] or heard[-1]["series"] == {}
    assert talk(live, [json.dumps({"watch": [Z]})], "series")[-1]["series"][Z]["points"]  # it serves others


def test_pictures_are_due_for_those_who_look(live: Live) -> None:
    assert not live.frame_due("stick")  # nobody looks

    async def look() -> tuple[bool, bool, bool]:
        origin = f"http://127.0.0.1:{live.address[1]}"
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f"{url(live)}socket", origin=origin) as talk,
        ):
            await talk.receive()
            first = live.frame_due("stick")
            live.frame("stick", "<svg/>")
            return first, live.frame_due("stick"), live.frame_due("solid")

    assert asyncio.run(look()) == (True, False, True)


def test_many_threads_may_publish_while_pages_come_and_go(live: Live) -> None:
    def publish(kind: str) -> None:
        for tick in range(100, 600):
            live.publish(tick, values(tick))
            live.row(tick % 7, kind, "running")
            live.frame(f"{kind} {tick % 50}", "<svg/>")

    threads = [threading.Thread(target=partial(publish, str(at))) for at in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(3):
        assert talk(live, [json.dumps({"watch": [Z]})], "series")
    for thread in threads:
        thread.join()


# --- in a browser ---


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as running:
        yield running


def plotted(name: str) -> str:
    """The page's expression for a graph's curve."""
    return f"[...document.querySelectorAll('.plot')].find(one => one.dataset.name === {json.dumps(name)})?.querySelector('.curve')"


@pytest.mark.needs("chromium")
def test_the_stick_figure_moves_as_it_is_published(live: Live, browser: Browser) -> None:
    browser.open(url(live))
    ends = []
    for turn in (0.0, 0.5):
        joints = (JOINTS[0] + turn, *JOINTS[1:])
        svg = stick(nine(plate(joints)), 80.0, joints)
        live.frame("stick", svg)
        wanted = svg.split('class="arm" points="')[1].split('"')[0]
        browser.wait(
            f"document.querySelector('figure[data-kind=stick] .arm')?.getAttribute('points') === '{wanted}'"
        )
        ends.append(
            browser.value(
                "document.querySelector('figure[data-kind=stick] .arm').getBoundingClientRect().width"
            )
        )
    assert ends[0] > 5
    assert ends[0] != ends[1]
    assert browser.said == []
    assert browser.value("document.title") == "a <run>"


@pytest.mark.needs("chromium")
def test_rows_are_shown_with_what_became_of_them(live: Live, browser: Browser) -> None:
    live.row(2, "MOVE <BOXT>", "waiting")
    live.row(1, "VISE-OPEN", "done")
    browser.open(url(live))
    shown = "[...document.querySelectorAll('#rows tr')].map(row => [...row.cells].map(cell => cell.textContent).join('|')).join()"
    browser.wait(f"{shown} === '1|VISE-OPEN|done,2|MOVE <BOXT>|waiting'")
    live.row(2, "MOVE <BOXT>", "failed")
    browser.wait(f"{shown}.endsWith('2|MOVE <BOXT>|failed')")


@pytest.mark.needs("chromium")
def test_the_list_follows_the_present_row_and_the_page_stays_where_it_is(
    live: Live, browser: Browser
) -> None:
    many = 120
    for number in range(1, many + 1):
        live.row(number, f"MOVE {number}", "")
    browser.open(url(live))
    browser.wait(f"document.querySelectorAll('#rows tr').length === {many}")
    list_, row = "document.querySelector('#rows').parentElement", "document.querySelector('#rows').rows[{}]"
    seen = f"(row => row.top >= list.top && row.bottom <= list.bottom)({row}.getBoundingClientRect())"
    for number in (70, many, 71, 3):
        live.row(number - 1, f"MOVE {number - 1}", "done")
        live.row(number, f"MOVE {number}", "running")
        for later in range(number + 1, many + 1):
            live.row(later, f"MOVE {later}", "")
        browser.wait(f"(list => {seen.format(number - 1)})({list_}.getBoundingClientRect())")
        assert browser.value("window.scrollY") == 0
    browser.value(
        f"{list_}.scrollTop = {list_}.scrollHeight"
    )  # the user looks elsewhere, while the same row is under way
    before = browser.value(f"{list_}.scrollTop")
    live.row(1, "MOVE 1", "failed")
    browser.wait(f"{row.format(0)}.textContent.endsWith('failed')")
    assert browser.value(f"{list_}.scrollTop") == before > 0


@pytest.mark.needs("chromium")
def test_the_user_types_a_name_and_it_is_plotted(live: Live, browser: Browser) -> None:
    browser.open(url(live))
    browser.wait("document.querySelectorAll('datalist option').length === 5")
    for typed in (OPENING, STATE, f"{Z}  over {X}"):
        browser.value("document.querySelector('#name').focus()")
        browser.type(typed)
    for shown in (OPENING, STATE, f"{Z} over {X}"):
        browser.wait(plotted(shown))
    circle = browser.value(
        f"(() => {{ const b = {plotted(f'{Z} over {X}')}.getBBox(); return [b.width, b.height]; }})()"
    )
    assert circle[0] > 200  # five seconds of a circle of which a turn takes five
    assert circle[1] > 50
    before = browser.value(f"{plotted(STATE)}.getAttribute('d')")
    live.publish(100, values(100) | {STATE: "failed"})
    browser.wait(f"{plotted(STATE)}.getAttribute('d') !== {json.dumps(before)}")
    assert browser.value(f"{plotted(STATE)}.closest('.plot').textContent.includes('failed')")
    browser.value(f"{plotted(OPENING)}.closest('.plot').querySelector('button').click()")
    browser.wait(f"!({plotted(OPENING)})")
    assert browser.value(f"!!({plotted(STATE)})")


@pytest.mark.needs("chromium")
def test_a_name_that_is_not_there_is_said(live: Live, browser: Browser) -> None:
    browser.open(url(live))
    browser.wait("document.querySelectorAll('datalist option').length === 5")
    browser.value("document.querySelector('#name').focus()")
    browser.type("<b>no.such")
    browser.wait("document.querySelector('#wrong').textContent === 'there is no variable <b>no.such'")
    assert browser.value("document.querySelectorAll('#plots .plot').length") == 0


@pytest.mark.needs("chromium")
def test_the_tables_choose_what_is_plotted(live: Live, browser: Browser) -> None:
    browser.open(url(live))
    shown = "[...document.querySelectorAll('#asked-plots .plot')].map(one => one.dataset.name).join()"
    browser.wait(f"{shown} === {json.dumps(','.join(DISPLAYS['moving']))}")
    browser.wait(plotted(Z))
    live.publish(100, values(100, "gripping"))
    browser.wait(f"{shown} === {json.dumps(','.join(DISPLAYS['gripping']))}")
    browser.wait(plotted(OPENING))
    assert browser.value("document.querySelector('#asker').textContent") == f"gripping ({CHOOSER})"
    live.publish(101, values(101, "none"))
    browser.wait("document.querySelector('#asked').hidden")


@pytest.mark.needs("chromium")
def test_a_run_that_is_taken_back_is_drawn_anew(live: Live, browser: Browser) -> None:
    browser.open(url(live))
    browser.wait(plotted(Z))
    marks = f"[...({plotted(Z)}).closest('svg').querySelectorAll('text')].map(one => one.textContent).join()"
    browser.wait(f"{marks}.includes(',3 s')")
    live.publish(10, values(10))
    browser.wait(f"!{marks}.includes(',3 s')")


@pytest.mark.needs("chromium")
def test_the_page_says_that_the_run_is_over(browser: Browser) -> None:
    with Live(NAMES, DISPLAYS) as live:
        live.publish(0, values(0))
        browser.open(url(live))
        browser.wait(plotted(Z))
        live.publish(1, values(1, "gripping"))  # the last is not lost
    browser.wait("document.querySelector('#state').textContent === 'the run has ended'")
    assert browser.value("document.querySelector('#asker').textContent").startswith("gripping")
    assert browser.value("document.querySelector('#clock').textContent") == "0.04 s, tick 1"


@pytest.mark.needs("chromium")
def test_a_picture_cannot_run_anything(live: Live, browser: Browser) -> None:
    browser.open(url(live))
    live.frame(
        "<img src=x onerror=hacked=1>",
        '<svg xmlns="http://www.w3.org/2000/svg" onload="window.hacked=1"><script>window.hacked=1</script><circle r="1"/></svg>',
    )
    browser.wait("document.querySelector('figure circle') !== null")
    browser.value("new Promise(done => setTimeout(done, 100))")
    assert browser.value("typeof hacked") == "undefined"
    assert browser.value("document.querySelector('figcaption').textContent").startswith("<img")


class _Foreign(BaseHTTPRequestHandler):
    """A page of somebody else's."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>foreign</title><link rel=icon href='data:,'>")

    def log_message(self, *_: object) -> None:
        """Not here."""


@pytest.fixture
def foreign() -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Foreign)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()
    thread.join()


ATTEMPTS = {
    "fetch": "fetch(URL).then(() => 'in', () => 'out')",
    "fetch that does not read": "fetch(URL, {mode: 'no-cors'}).then(() => 'in', () => 'out')",
    "post": "fetch(URL, {method: 'POST', mode: 'no-cors', body: 'x'}).then(() => 'in', () => 'out')",
    "script": """new Promise(done => { const one = document.createElement('script'); one.src = URL + 'page.js';
        one.onload = () => done('in'); one.onerror = () => done('out'); document.head.append(one); })""",
    "socket": """new Promise(done => { const one = new WebSocket(URL.replace('http', 'ws') + 'socket');
        one.onopen = () => done('in'); one.onerror = () => done('out'); })""",
    "frame": """new Promise(done => { const one = document.createElement('iframe'); one.src = URL;
        one.onload = () => { let said = 'out'; try { if (one.contentDocument?.title === 'a <run>') said = 'in'; } catch {}
        done(one.contentWindow.length ? 'in' : said); }; document.body.append(one); })""",
}  # fmt: skip


@pytest.mark.needs("chromium")
@pytest.mark.parametrize("attempt", ATTEMPTS)
def test_another_page_gets_nowhere_with_the_token(
    live: Live, browser: Browser, foreign: str, attempt: str
) -> None:
    """Of the same site even, 127.0.0.1, on another port."""
    browser.open(foreign)
    browser.wait("document.title === 'foreign'")
    script = ATTEMPTS[attempt].replace("URL", json.dumps(url(live)))
    assert browser.value(script) == "out"
    assert not live._talks


def test_the_files_of_the_page_are_in_the_package(repo: Path) -> None:
    """The page names no other machine."""
    for name in ("page.html", "page.js", "page.css"):
        text = (repo / "sim" / "rcsc_cell" / "live" / name).read_text(encoding="utf-8")
        assert "https:" not in text
        assert text.count("http:") == text.count("http://www.w3.org/2000/svg")
