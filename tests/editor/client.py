"""A client of the language server: a process, its messages, and what it sends unasked."""

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

PATIENCE_S = 120.0
"""A busy machine takes ten times as long."""
WHOLE: dict[str, Any] = {
    "textDocument": {"diagnostic": {}, "publishDiagnostics": {"relatedInformation": True}},
    "workspace": {"codeLens": {"refreshSupport": True}},
}
"""Capabilities of a client that asks for findings."""
PUSHED: dict[str, Any] = {"textDocument": {"publishDiagnostics": {}}}


class RefusedError(Exception):
    """The server answered with an error: its code and message."""


class Client:
    """Speaks with one server.

    Attributes:
        told: Notifications by method, in order.
    """

    def __init__(self, folder: Path, capabilities: Mapping[str, Any] | None = None, **options: Any) -> None:
        self.folder = folder
        self.told: dict[str, list[Any]] = {}
        self._answers: dict[int, queue.Queue[Any]] = {}
        self._arrived = threading.Condition()
        self._next = 0
        self._versions: dict[str, int] = {}
        code = "from rcsc.front.commands import main; main()"
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, "lsp", "--stdio"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=folder,
        )
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self.server = self.ask(
            "initialize",
            {
                "processId": None,
                "rootUri": folder.as_uri(),
                "workspaceFolders": [{"uri": folder.as_uri(), "name": folder.name}],
                "capabilities": dict(PUSHED if capabilities is None else capabilities),
                "initializationOptions": options,
            },
        )["capabilities"]
        self.tell("initialized", {})

    def _listen(self) -> None:
        assert self.process.stdout is not None
        while header := self.process.stdout.readline():
            length = 0
            while header.strip():
                name, _, value = header.decode().partition(":")
                length = int(value) if name.lower() == "content-length" else length
                header = self.process.stdout.readline()
            self._take(json.loads(self.process.stdout.read(length)))

    def _take(self, message: dict[str, Any]) -> None:
        if "method" in message and "id" in message:
            self._send({"id": message["id"], "result": None})
        elif "method" in message:
            with self._arrived:
                self.told.setdefault(message["method"], []).append(message["params"])
                self._arrived.notify_all()
        else:
            self._answers.setdefault(message["id"], queue.Queue()).put(message)

    def _send(self, message: dict[str, Any]) -> None:
        assert self.process.stdin is not None
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
        self.process.stdin.flush()

    def tell(self, method: str, params: Any) -> None:
        self._send({"method": method, "params": params})

    def send(self, method: str, params: Any) -> int:
        """Send a request; return its number."""
        self._next += 1
        self._answers.setdefault(self._next, queue.Queue())
        self._send({"id": self._next, "method": method, "params": params})
        return self._next

    def answer(self, number: int) -> Any:
        """The answer to a request.

        Raises:
            RefusedError: It is an error.
        """
        message = self._answers[number].get(timeout=PATIENCE_S)
        if "error" in message:
            raise RefusedError(message["error"]["code"], message["error"]["message"])
        return message["result"]

    def ask(self, method: str, params: Any) -> Any:
        """Ask, and wait for the answer."""
        return self.answer(self.send(method, params))

    def heard(self, method: str, count: int = 1) -> Any:
        """The last notification of a kind, once there are so many."""
        with self._arrived:
            assert self._arrived.wait_for(lambda: len(self.told.get(method, ())) >= count, PATIENCE_S), method
            return self.told[method][-1]

    def heard_that(self, method: str, is_so: Callable[[Any], bool]) -> Any:
        """The last notification of a kind, once it is so."""
        with self._arrived:
            arrived = self._arrived.wait_for(
                lambda: self.told.get(method) and is_so(self.told[method][-1]), PATIENCE_S
            )
            assert arrived, self.told.get(method)
            return self.told[method][-1]

    def heard_ever(self, method: str, is_so: Callable[[Any], bool]) -> None:
        """Wait for a notification of a kind that is so, whatever comes after it."""
        with self._arrived:
            arrived = self._arrived.wait_for(lambda: any(map(is_so, self.told.get(method, ()))), PATIENCE_S)
            assert arrived, self.told.get(method)

    # --- documents ---

    def uri(self, name: str) -> str:
        return name if ":" in name else (self.folder / name).as_uri()

    def open(self, name: str, text: str) -> dict[str, str]:
        """Open a document; return how requests name it."""
        uri = self.uri(name)
        self._versions[uri] = 1
        item = {"uri": uri, "languageId": "rcs", "version": 1, "text": text}
        self.tell("textDocument/didOpen", {"textDocument": item})
        return {"uri": uri}

    def change(self, name: str, text: str) -> None:
        uri = self.uri(name)
        self._versions[uri] += 1
        document = {"uri": uri, "version": self._versions[uri]}
        self.tell("textDocument/didChange", {"textDocument": document, "contentChanges": [{"text": text}]})

    def findings(self, name: str) -> list[dict[str, Any]]:
        """Ask for the findings of a document, again where the server gives up an outdated answer."""
        while True:
            try:
                report = self.ask("textDocument/diagnostic", {"textDocument": {"uri": self.uri(name)}})
            except RefusedError as refused:
                if refused.args[0] != -32802:
                    raise
            else:
                found: list[dict[str, Any]] = report["items"]
                return found

    def at(self, name: str, line: int, character: int) -> dict[str, Any]:
        """A place in a document, as requests name it."""
        return {"textDocument": {"uri": self.uri(name)}, "position": {"line": line, "character": character}}

    def run(self, command: str, *args: Any) -> Any:
        """Have the server run a command."""
        return self.ask("workspace/executeCommand", {"command": command, "arguments": list(args)})

    def stop(self) -> int:
        """End the server; return its exit status."""
        self.ask("shutdown", None)
        self.tell("exit", None)
        status = self.process.wait(PATIENCE_S)
        self._listener.join(PATIENCE_S)
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()
        return status


def applied(text: str, edits: list[dict[str, Any]]) -> str:
    """A text with edits made that count as a client does that has said nothing: in UTF-16."""
    from rcsc.desk.editor.places import Lines, Place, Units

    lines = Lines(text)

    def offset(position: dict[str, int]) -> int:
        return lines.offset(Place(position["line"], position["character"]), Units.UTF_16)

    splices = [
        (offset(each["range"]["start"]), offset(each["range"]["end"]), each["newText"]) for each in edits
    ]
    for start, end, new in sorted(splices, reverse=True):
        text = text[:start] + new + text[end:]
    return text
