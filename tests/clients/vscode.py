"""VS Code itself, in a browser without a window: an overlap is underlined, the quick fix is applied, and the mark is gone.

    python -m tests.clients.vscode                    # installs code-server from the npm registry, a minute at the most
    python -m tests.clients.vscode --code DIR --pictures DIR

In: a folder with `code-server` in `node_modules`, else one is made; the extension, packaged as for users. Out: nothing, or why not.
Needs Node 20, npm and Chromium. It is no test of `pytest`, which asks no registry; `.ci/run` runs it.
"""

import argparse
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.browser import Browser

REPO = Path(__file__).parents[2]
EXTENSION = REPO / "grammar" / "editors" / "vscode"
CODE = "code-server@4.100.3"
"""VS Code 1.100.3; later ones need a newer Node."""
SERVER = Path("node_modules/code-server/lib/vscode")
STARTS_S, ANSWERS_S = 120.0, 120.0
DOOR = """\
## How a door is told to move.
enum order { stop, open, close }
enum way { still, up, down }

input wanted : order
input height_mm : int 0 .. 2000

state now : way

procedure go(to : way) {
  now := to
}

## A door.
table door {
  | line | now   | wanted | height_mm || procedures |
  |------|-------|--------|-----------||------------|
  | rest |       | stop   |           || go(still)  |
  | rise |       | open   | < 2000    || go(up)     |
  | top  |       | open   | >= 1900   || go(still)  |
  | fall | /= up | close  | > 0       || go(down)   |
  | turn | up    | close  | > 0       || go(still)  |
  | low  |       | close  | 0         || go(still)  |
}

level hall {
  period 40 [ms]
  table door
}
"""
LINE = {row.split()[1]: number for number, row in enumerate(DOOR.splitlines(), 1) if row.startswith("  | ")}
"""Where each line of the table stands."""
KEYS = {
    "Enter": ("Enter", 13), "Tab": ("Tab", 9), "Escape": ("Escape", 27), "F1": ("F1", 112), "Home": ("Home", 36), "End": ("End", 35),
    ".": ("Period", 190), "g": ("KeyG", 71), "z": ("KeyZ", 90), "ArrowDown": ("ArrowDown", 40), "Backspace": ("Backspace", 8),
}  # fmt: skip
CTRL, SHIFT = 2, 8


class Editor(Browser):
    """A browser with VS Code in it."""

    def wait(self, expression: str) -> None:
        """Waits until an expression is true, not as long as a whole suite of tests might need."""
        assert self.comes(expression, ANSWERS_S), f"never: {expression}"

    def comes(self, expression: str, within_s: float) -> bool:
        """Whether an expression becomes true in time."""
        until = time.monotonic() + within_s
        while not self.value(f"!!({expression})"):
            if time.monotonic() > until:
                return False
            time.sleep(0.05)
        return True

    def press(self, key: str, held: int = 0, text: str = "") -> None:
        """Presses a key, with others held."""
        code, number = KEYS[key]
        for kind in ("keyDown", "keyUp"):
            event = {"key": key, "code": code, "windowsVirtualKeyCode": number, "modifiers": held}
            self._tell("Input.dispatchKeyEvent", type=kind, **event, **({"text": text} if text else {}))

    def write(self, text: str) -> None:
        """Types into what has the focus."""
        self._tell("Input.insertText", text=text)

    def click(self, element: str) -> None:
        """Clicks the middle of an element, by an expression."""
        middle = f"(e => {{ const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})({element})"
        x, y = self.value(middle)
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self._tell("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def double(self, element: str) -> None:
        """Clicks an element twice."""
        self.click(element)
        self.click(element)

    def command(self, name: str) -> None:
        """Runs a command by the palette, opened anew until it lists it: a shown list takes in no later command."""
        rows = "[...document.querySelectorAll('.quick-input-list .monaco-list-row')]"
        row = f"{rows}.find(row => row.textContent.includes({json.dumps(name)}))"
        within_s, until = 5.0, time.monotonic() + ANSWERS_S
        while True:
            self.press("F1")
            if self.comes(f"{_ASKING} === document.activeElement && {_ASKED}.startsWith('>')", within_s):
                self.write(name)
                if self.comes(row, within_s):
                    self.click(row)
                    return self.wait(f"{_ASKING} !== document.activeElement")
            assert time.monotonic() < until, f"never listed: {name}"
            self.press("Escape")
            within_s *= 2

    def go(self, line: int, column: int) -> None:
        """Puts the cursor somewhere."""
        self.press("g", CTRL)
        self.wait(f"{_ASKING} === document.activeElement")
        self.write(f":{line}:{column}" if self.value(_ASKED) == "" else f"{line}:{column}")
        self.press("Enter")
        self.wait(f"{CURSOR}.includes('Ln {line}, Col {column}')")


_ASKING = "document.querySelector('.quick-input-widget input')"
_ASKED = f"{_ASKING}.value"
MARKS = "document.querySelectorAll('.monaco-editor .squiggly-error').length"
STATUS = "([...document.querySelectorAll('.statusbar-item')].map(e => e.textContent).find(t => t.startsWith('rcsc')) ?? '')"
CURSOR = "[...document.querySelectorAll('.statusbar-item')].map(e => e.textContent).join(' ')"
TEXT = (
    "[...document.querySelectorAll('.editor-instance .view-line')].sort((a, b) => parseFloat(a.style.top) - parseFloat(b.style.top))"
    ".map(e => e.textContent.replace(/\\u00a0/g, ' ').replace(/\\|\\s*<?\\s*[0-9.]+ %$/, '|')).join('\\n')"
)
ACTIONS = "[...document.querySelectorAll('.action-widget .monaco-list-row')].map(e => e.textContent)"
LENSES = "[...document.querySelectorAll('.codelens-decoration')].map(e => e.textContent).join(' ')"


def _graph(editor: Editor) -> None:
    """Asks for the table's graph, and again if none comes: what was typed a moment before may still be proved."""
    tab = "[...document.querySelectorAll('.tab')].some(e => e.textContent.includes('graph of door'))"
    for within_s in (ANSWERS_S / 4, ANSWERS_S / 2, ANSWERS_S):
        editor.go(LINE["rest"], 5)
        editor.command("Show the Graph of This Table")
        if editor.comes(tab, within_s):
            return
    raise AssertionError(f"never: {tab}")


def story(editor: Editor, address: str, picture: Callable[[str], None]) -> None:
    """What a user sees and does."""
    editor.open(address)
    editor.wait(f"{STATUS}.includes('not trusted')")  # a server is a program: none before that
    assert not editor.value(f"{MARKS} + {LENSES}.length")
    picture("not trusted")
    editor.command("Workspaces: Manage Workspace Trust")
    trust = "[...document.querySelectorAll('.workspace-trust-editor .monaco-button')].find(e => e.textContent === 'Trust')"
    editor.wait(trust)
    editor.click(trust)
    editor.wait(f"!({trust})")
    editor.command("View: Close Editor")
    editor.double(
        "[...document.querySelectorAll('.explorer-folders-view .monaco-list-row')].find(e => e.textContent.includes('door.rcs'))"
    )
    editor.wait(f"{MARKS} > 0")
    editor.wait(f"{STATUS}.includes('refuted')")
    editor.wait(f"{LENSES}.includes('refuted: lines')")
    assert editor.value(f"{LENSES}.includes('run the witness')")
    picture("underlined")
    assert "`rise` and `top`" in editor.value(LENSES)
    _shown(editor, picture)

    editor.go(LINE["top"], 5)
    editor.press(".", CTRL)
    editor.wait(f"{ACTIONS}.some(t => t.includes('proved'))")
    picture("offered")
    editor.press("Enter")
    editor.wait(f"{MARKS} === 0")
    editor.wait(f"{STATUS}.includes('proved')")
    editor.wait(f"{LENSES}.includes('proved: exactly one line matches every input')")
    assert "refuted" not in editor.value(LENSES) + editor.value(STATUS), "what is seen agrees"
    assert editor.value("document.querySelectorAll('.cgmr').length") >= 1, "a mark in the gutter"
    picture("mended")
    editor.wait(f"/\\| top .*\\| open +\\| +2000 +\\|\\|/.test({TEXT})")

    _cells(editor)
    picture("typed")
    _graph(editor)
    image = "document.querySelector('iframe.webview')?.contentDocument?.querySelector('iframe')?.contentDocument?.querySelector('img')"
    editor.wait(f"{image}?.naturalWidth > 100")
    picture("graph")


def _cells(editor: Editor) -> None:
    """Tab goes from cell to cell, a line is added, and a text that is half written makes no table proved."""
    editor.go(LINE["rest"], 5)
    before = editor.value(TEXT)
    places = []
    for _ in range(3):
        was = editor.value(CURSOR)
        editor.press("Tab")
        editor.wait(f"{CURSOR} !== {json.dumps(was)}")
        places.append(editor.value(f"/Ln [0-9]+, Col ([0-9]+)/.exec({CURSOR})[1]"))
    assert len(set(places)) == 3
    editor.press("Tab", SHIFT)
    editor.wait(f"{CURSOR}.includes('Col {places[1]}')")
    assert editor.value(TEXT) == before, "nothing was written"
    below = LINE["low"] + 1
    editor.go(below - 1, 5)
    editor.command("Add a Line to This Table")
    editor.wait(f"{CURSOR}.includes('Ln {below}')")
    editor.write("late")
    editor.wait(f"{STATUS}.match(/refuted|undecided|has errors|stale/)")
    editor.wait(f"{LENSES}.match(/refuted: |undecided: |has errors: |stale: /)")
    assert "proved" not in editor.value(f"{STATUS} + {LENSES}")
    editor.command("View: Focus Active Editor Group")
    while "late" in editor.value(TEXT):
        editor.press("z", CTRL)
        time.sleep(0.2)
    while f"Ln {below}" in editor.value(CURSOR) or len(editor.value(TEXT)) > len(before):
        editor.press("z", CTRL)
        time.sleep(0.2)
    editor.wait(f"{STATUS}.includes('proved')")


def _shown(editor: Editor, picture: Callable[[str], None]) -> None:
    """What the lenses do, from the palette too: a proof anew, the run of a witness, a graph."""
    editor.go(LINE["rest"], 5)
    editor.command("Run the Witness of This Table")
    editor.wait(f"{TEXT}.includes('2 of 6 lines match')")
    picture("witness")
    editor.command("Prove This Table Anew")
    editor.wait(f"{TEXT}.includes('decided by')")


# --- what it needs ---


def installed(folder: Path) -> Path:
    """VS Code's server, from the registry."""
    (folder / "package.json").write_text('{"private": true}', encoding="utf-8")
    quiet = ["--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
    subprocess.run(["npm", "i", *quiet, CODE], cwd=folder, check=True)
    subprocess.run(["npm", "i", *quiet], cwd=folder / SERVER, check=True)
    return folder


def extension(folder: Path) -> None:
    """Packages the extension as for users, and installs it."""
    made = folder / "rcsc.vsix"
    subprocess.run([EXTENSION / "package.sh", made], check=True, stdout=subprocess.DEVNULL)
    shutil.unpack_archive(made, folder / "unpacked", "zip")
    shutil.move(folder / "unpacked" / "extension", folder / "extensions" / "rcsc.rcsc-0.1.0")


@contextmanager
def running(code: Path, folder: Path, rcsc: str) -> Iterator[str]:
    """VS Code over a folder with a door in it; its address."""
    settings = {
        "rcsc.command": [rcsc, "lsp"], "telemetry.telemetryLevel": "off", "workbench.startupEditor": "none",
        "editor.inlayHints.enabled": "on", "security.workspace.trust.startupPrompt": "never", "extensions.autoCheckUpdates": False,
    }  # fmt: skip
    for place in ("data/Machine", "data/User"):
        (folder / place).mkdir(parents=True, exist_ok=True)
        (folder / place / "settings.json").write_text(json.dumps(settings), encoding="utf-8")
    project = folder / "project"
    project.mkdir(exist_ok=True)
    (project / "door.rcs").write_text(DOOR, encoding="utf-8")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    args: list[str | Path] = [
        "--host", "127.0.0.1", "--port", str(port), "--without-connection-token", "--accept-server-license-terms",
        "--telemetry-level", "off", "--server-data-dir", folder, "--user-data-dir", folder / "data",
        "--extensions-dir", folder / "extensions",
    ]  # fmt: skip
    command: list[str | Path] = ["node", code / SERVER / "out" / "server-main.js", *args]
    with (folder / "server.log").open("wb") as log:
        server = subprocess.Popen(
            command, stdout=log, stderr=log, stdin=subprocess.DEVNULL, start_new_session=True
        )
    try:
        base = f"http://127.0.0.1:{port}/"
        _await(base, server)
        opened = json.dumps([["openFile", f"vscode-remote://127.0.0.1:{port}{project / 'door.rcs'}"]])
        yield f"{base}?{urllib.parse.urlencode({'folder': str(project), 'payload': opened})}"
    finally:
        server.terminate()
        try:
            server.wait(10)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def _await(address: str, server: "subprocess.Popen[bytes]") -> None:
    until = time.monotonic() + STARTS_S
    while True:
        try:
            urllib.request.urlopen(address, timeout=10).close()  # noqa: S310  # of this machine
            return
        except (urllib.error.URLError, OSError):
            if server.poll() is not None or time.monotonic() > until:
                raise
            time.sleep(0.2)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--code", type=Path, help="a folder with code-server in node_modules")
    parser.add_argument("--rcsc", default=str(Path(sys.executable).with_name("rcsc")))
    parser.add_argument("--pictures", type=Path, help="where pictures go")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / "extensions").mkdir()
        begun = time.monotonic()
        code = asked.code or installed(folder)
        extension(folder)
        made = time.monotonic()

        def picture(what: str) -> None:
            if asked.pictures is not None:
                asked.pictures.mkdir(parents=True, exist_ok=True)
                editor.screenshot(asked.pictures / f"{what}.png")

        with running(code, folder, asked.rcsc) as address, Editor() as editor:
            try:
                story(editor, address, picture)
            except BaseException:
                picture("failed")
                print((folder / "server.log").read_text(encoding="utf-8")[-2000:])
                raise
    print(
        f"an overlap was underlined, mended and proved in VS Code: {made - begun:.0f} s to install, {time.monotonic() - made:.0f} s"
    )
    return 0


if __name__ == "__main__":
    os.environ.setdefault("NO_UPDATE_NOTIFIER", "1")
    sys.exit(main())
