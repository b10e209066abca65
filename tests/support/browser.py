"""A browser without a window, told what to do over a pipe: Chromium's DevTools protocol, and no package for it.

In: addresses and expressions of the page's own language. Out: what they are. The pipe is Chromium's `--remote-debugging-pipe`: file
descriptors 3 and 4, JSON messages that end with a zero byte; no port is opened.
"""

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
PATIENCE_S = 120.0
"""After that something is broken; a machine under load needs some seconds."""
OPTIONS = (
    "--headless", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-extensions", "--disable-sync",
    "--remote-debugging-pipe",
)  # fmt: skip
FLAT = ("--disable-gpu",)
IN_SPACE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL, drawn by the processor: the same picture on every machine."""


class Browser:
    """One browser with one page; a context manager."""

    def __init__(self, width: int = 1400, height: int = 1300, *, in_space: bool = False) -> None:
        """Args: width, height: Of the page in pixels; in_space: With WebGL, which is slow here."""
        found = next((path for name in NAMES if (path := shutil.which(name))), None)
        assert found, "Chromium is needed (Debian's package `chromium`)"
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        orders, self._orders = (_high(end) for end in os.pipe())
        self._answers, answers = (_high(end) for end in os.pipe())
        self._process = subprocess.Popen(
            [
                "bash", "-c", f'exec "$@" 3<&{orders} 4>&{answers}', "browser",
                found, *OPTIONS, *(IN_SPACE if in_space else FLAT), f"--window-size={width},{height}",
                f"--user-data-dir={self._profile.name}", "about:blank",
            ],
            pass_fds=(orders, answers), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        os.close(orders)
        os.close(answers)
        self._held, self._number, self._loads = b"", 0, 0
        self._held_back = False
        self.said: list[str] = []
        targets = self._tell("Target.getTargets")["targetInfos"]
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        self._session = self._tell("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._tell(f"{domain}.enable")
        self._tell(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._orders)  # the browser ends when its pipe does
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._answers)
        self._profile.cleanup()

    def open(self, address: str, *, dark: bool = False) -> None:
        """Goes to an address; `said` is what the new page complains of."""
        colours = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self._tell("Emulation.setEmulatedMedia", features=colours)
        self.said.clear()
        assert not self._tell("Page.navigate", url=address).get("errorText")
        self.wait("document.readyState === 'complete'")

    def begin_with(self, script: str) -> None:
        """Runs a script in every page from now on, before any of the page's own."""
        self._tell("Page.addScriptToEvaluateOnNewDocument", source=script)

    def hold_back(self, pattern: str) -> None:
        """Has what is asked of addresses like this wait for `let_go`, as on a slow machine."""
        self._tell("Fetch.enable", patterns=[{"urlPattern": pattern}])

    def let_go(self) -> None:
        """Lets through what was held back, once something was, and all that comes."""
        until = time.monotonic() + PATIENCE_S
        while not self._held_back:
            assert time.monotonic() < until, "nothing was held back"
            self.value("0")  # what the browser tells meanwhile is heard
        self._tell("Fetch.disable")
        self._held_back = False

    def reload(self) -> None:
        """Loads the page anew, as who presses F5; a question whether to leave it is answered with yes."""
        loads = self._loads
        self._tell("Page.reload")
        until = time.monotonic() + PATIENCE_S
        while self._loads == loads:
            assert time.monotonic() < until, "the page is not loaded anew"
            self._note(self._answer())

    def value(self, expression: str) -> Any:
        """What an expression is; a promise is waited for."""
        found = self._tell("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, expression: str) -> None:
        """Waits until an expression is true, also while another page comes."""
        until = time.monotonic() + PATIENCE_S
        while not self._is(expression):
            assert time.monotonic() < until, f"never: {expression}; the page said {self.said}"
            time.sleep(0.03)

    def _is(self, expression: str) -> bool:
        try:
            return bool(self.value(f"!!({expression})"))
        except AssertionError as error:
            if "Inspected target navigated" not in str(error):
                raise
            return False

    def type(self, text: str) -> None:
        """Types into what has the focus, and presses Enter."""
        self._tell("Input.insertText", text=text)
        enter = {"key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13, "text": "\r"}
        for kind in ("keyDown", "keyUp"):
            self._tell("Input.dispatchKeyEvent", type=kind, **enter)

    def screenshot(self, path: Path) -> None:
        """Writes what is seen, as PNG."""
        path.write_bytes(base64.b64decode(self._tell("Page.captureScreenshot")["data"]))

    def _order(self, method: str, **parameters: Any) -> int:
        """Says what is to be done; by which number the answer will go."""
        self._number += 1
        order: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if hasattr(self, "_session"):
            order["sessionId"] = self._session
        os.write(self._orders, json.dumps(order).encode() + b"\0")
        return self._number

    def _tell(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = self._order(method, **parameters)
        while True:
            answer = self._answer()
            if answer.get("id") == number:
                assert "error" not in answer, f"{method}: {answer['error']}"
                result: dict[str, Any] = answer["result"]
                return result
            self._note(answer)

    def _note(self, event: dict[str, Any]) -> None:
        if event.get("method") == "Page.javascriptDialogOpening":
            self._order("Page.handleJavaScriptDialog", accept=True)
        if event.get("method") == "Fetch.requestPaused":
            self._held_back = True
        if event.get("method") == "Page.loadEventFired":
            self._loads += 1
        if event.get("method") == "Runtime.exceptionThrown":
            self.said.append(str(event["params"]["exceptionDetails"]))
        if event.get("method") == "Log.entryAdded":
            entry = event["params"]["entry"]
            # What the page's text or scripts do has a line. The browser's own editing, of a tabulator typed into a text, has none;
            # and how it draws in space, where this machine has no graphics card, is its own affair.
            own = entry["text"].startswith(("[.WebGL-", "[]Automatic fallback to software WebGL"))
            if not own and ("lineNumber" in entry or not entry["text"].startswith("Applying inline style")):
                self.said.append(f"{entry['text']} ({entry.get('url', '')}:{entry.get('lineNumber', '')})")

    def _answer(self) -> dict[str, Any]:
        while b"\0" not in self._held:
            ready, _, _ = select.select([self._answers], [], [], PATIENCE_S)
            read = os.read(self._answers, 1 << 16) if ready else b""
            assert read, f"the browser says nothing; it ended with {self._process.poll()}"
            self._held += read
        message, self._held = self._held.split(b"\0", 1)
        answer: dict[str, Any] = json.loads(message)
        return answer


def _high(end: int) -> int:
    """The same pipe under a number above those that the browser wants."""
    moved = fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 16)
    os.close(end)
    return moved
