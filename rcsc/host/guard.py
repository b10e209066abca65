"""Who may see the page: the user's own browser on this machine, and no other page in it.

In: what a request says of itself. Out: why it is refused, or nothing. A server on the loopback interface is reached by every page
that the user has open; these rules keep them out:

- `Host`, `Origin` and `Sec-Fetch-Site` are there once at most, so that nobody reads another one than is judged here;
- `Host` names this server by its loopback address: a foreign name that was made to resolve to 127.0.0.1 does not (DNS rebinding);
- `Origin`, which a browser sends with what other pages start, is the page's own, and a WebSocket must have one;
- `Sec-Fetch-Site` says that the page itself or the user asked;
- the path begins with a token that cannot be guessed; it stands in the address that the user is given, and no referrer tells it.
"""

import hmac
from collections.abc import Mapping

HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Of every answer, beside the content security policy."""
_ONCE = ("host", "origin", "sec-fetch-site")


def policy(port: int) -> str:
    """The content security policy: the page's own script and style, its own socket, and nothing else."""
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
    if headers.get("Sec-Fetch-Site", "none") not in {"none", "same-origin"}:
        return "another page asked"
    if not hmac.compare_digest(path.split("/")[1].encode(), token.encode()):
        return "the address lacks its token"
    return ""
