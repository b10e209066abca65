"""Connections of who knows no token, to a server that a user has a page of."""

import contextlib
import http.client
import socket

STRANGERS = (
    b"", b"GET", b"GET / HTTP/1.1\r\nHost: ", b"\x16\x03\x01",
    b"GET /guessed/ HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 50,
)  # fmt: skip
"""What they say: nothing, half a request line, half a header, another protocol, questions whose answers they do not take."""
MANY = 300


def held_beside(address: str, port: int, path: str, said: bytes, many: int = MANY) -> int:
    """Have strangers come, say this and stay; return how many are held when the user has been answered, before and after them."""
    with contextlib.ExitStack() as held:
        user = http.client.HTTPConnection(address, port, timeout=60)
        held.callback(user.close)
        _answered(user, path)
        strangers = []
        for at in range(many):
            one = held.enter_context(socket.create_connection((address, port), timeout=60))
            with contextlib.suppress(ConnectionError):
                one.sendall(said)
            strangers.append(one)
            if at % 100 == 0:
                _answered(user, path)
        _answered(user, path)
        other = http.client.HTTPConnection(address, port, timeout=60)
        held.callback(other.close)
        _answered(other, path)
        return sum(map(_is_held, strangers))


def _answered(user: http.client.HTTPConnection, path: str) -> None:
    user.request("GET", path)
    answer = user.getresponse()
    answer.read()
    assert answer.status == 200
    assert user.sock is not None, "the user's connection was ended"


def _is_held(one: socket.socket) -> bool:
    """Whether the server still holds the connection; what it answered is 4xx or 503."""
    one.setblocking(False)
    said = b""
    try:
        while more := one.recv(65_536):
            said += more
    except BlockingIOError:
        return True
    except ConnectionError:
        pass
    assert not said or said.split()[1] in {b"400", b"403", b"408", b"503"}, said
    return False
