"""The studio in a real browser: a folder to be worked in, and a page that a user's hands are on."""

import contextlib
import json
import random
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rcsc.desk.shell.opening import Opening
from tests.studio.served import serving
from tests.support.browser import PATIENCE_S, Browser

DOCK = Path(__file__).parents[1] / "data" / "dock"
WIDE, HIGH = 1280, 800

MODIFIERS = {"alt": 1, "ctrl": 2, "meta": 4, "shift": 8}
KEYS = {
    "enter": ("Enter", 13, "\r"), "tab": ("Tab", 9, ""), "escape": ("Escape", 27, ""), "space": (" ", 32, " "),
    "left": ("ArrowLeft", 37, ""), "up": ("ArrowUp", 38, ""), "right": ("ArrowRight", 39, ""), "down": ("ArrowDown", 40, ""),
    "home": ("Home", 36, ""), "end": ("End", 35, ""), "f2": ("F2", 113, ""), "f8": ("F8", 119, ""), "f12": ("F12", 123, ""),
    "delete": ("Delete", 46, ""),
    "pageup": ("PageUp", 33, ""), "pagedown": ("PageDown", 34, ""),
}  # fmt: skip
"""Keys with names: what the page calls one, its number, and what it types."""

_AIM = """((one) => {
  if (!one) return null;
  one.scrollIntoView({ block: 'nearest', inline: 'nearest' });
  let hit = null; // not known before the press
  const kinds = ['pointerdown', 'mousedown', 'pointerup', 'mouseup', 'click'];
  const guard = (event) => {
    hit ??= event.composedPath().includes(FOUND);
    if (hit) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  for (const kind of kinds) addEventListener(kind, guard, true);
  window.aimed = () => {
    for (const kind of kinds) removeEventListener(kind, guard, true);
    return hit ?? true; // a press that leads to another page is not told here
  };
  const { left, top, width, height } = one.getBoundingClientRect();
  return [left + width / 2, top + height / 2];
})(FOUND)"""
"""Where an element is to be pressed; until `aimed` is asked, a press on anything else is not felt by it."""


def dock(folder: Path, *edits: tuple[str, str]) -> Path:
    """The robot that docks, where nobody else writes; with edits of its drive's tables."""
    shutil.copytree(DOCK, folder, ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    drive = folder / "drive.rcs"
    text = drive.read_text(encoding="utf-8")
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    drive.write_text(text, encoding="utf-8")
    return folder / "system.toml"


class Seat(Browser):
    """A browser with a studio in it."""

    def enter(self, address: str, *, dark: bool = False) -> None:
        """Open the studio, and wait until the page is there."""
        self.open(address, dark=dark)
        self.wait("document.documentElement?.dataset.ready === 'yes'")

    def reads(self, selector: str) -> str:
        """The text of an element as it is read; empty where there is none."""
        return str(self.value(f"document.querySelector({json.dumps(selector)})?.innerText ?? ''"))

    def until(self, selector: str, text: str) -> None:
        """Wait until an element says something."""
        self.wait(
            f"[...document.querySelectorAll({json.dumps(selector)})].some((one) => one.innerText.includes({json.dumps(text)}))"
        )

    def button(self, text: str, within: str = "body") -> str:
        """A button that is seen and begins with a text, as an expression."""
        every = f"document.querySelectorAll({json.dumps(f'{within} button, {within} [role=tab]')})"
        return f"([...{every}].find((one) => one.checkVisibility() && one.innerText.trim().startsWith({json.dumps(text)})))"

    def press(self, *several: str) -> None:
        """Presses keys one after another: `a`, `tab`, `ctrl+s`."""
        for keys in several:
            *held, name = keys.split("+") if keys != "+" else ["+"]
            key, number, text = KEYS.get(name, (name, ord(name[0].upper()), name))
            modifiers = sum(MODIFIERS[one] for one in held)
            how = {"key": key, "windowsVirtualKeyCode": number, "modifiers": modifiers}
            typed = {"text": text} if text and not modifiers & ~MODIFIERS["shift"] else {}
            self._tell("Input.dispatchKeyEvent", type="keyDown" if typed else "rawKeyDown", **how, **typed)
            self._tell("Input.dispatchKeyEvent", type="keyUp", **how)

    def write(self, text: str) -> None:
        """Types into what has the focus."""
        self._tell("Input.insertText", text=text)

    def click(self, element: str) -> None:
        """Clicks, as a mouse does, the middle of the first element that an expression or a selector names; waits for it to be seen.

        What moves away before it is pressed is aimed at again, as a user would; a press on it counts, whatever becomes of it.
        """
        found = element if element.startswith("(") else f"document.querySelector({json.dumps(element)})"
        until = time.monotonic() + PATIENCE_S
        while not self._clicked(found):
            assert time.monotonic() < until, f"something else is where {element} is"

    def _clicked(self, found: str) -> bool:
        """Clicks where an element is; False where the press came to something else, which has not felt it."""
        self.wait(f"{found}?.checkVisibility()")
        aim = self.value(_AIM.replace("FOUND", found))
        if aim is None:
            return False
        x, y = aim
        self.mouse("mouseMoved", x, y, 0)
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)
        return bool(self.value("window.aimed?.() ?? true"))

    def mouse(self, kind: str, x: float, y: float, buttons: int = 1, held: str = "") -> None:
        """Moves the mouse, or presses or releases its left button, while a key is held."""
        button = "left" if buttons else "none"
        self._tell(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button=button,
            buttons=buttons,
            clickCount=1,
            modifiers=MODIFIERS.get(held, 0),
        )

    def heap(self) -> int:
        """Bytes that the page's objects take, after what nobody needs is thrown away."""
        self._tell("HeapProfiler.collectGarbage")
        return int(self._tell("Runtime.getHeapUsage")["usedSize"])

    def choose(self, selector: str, begins: str) -> None:
        """Choose what begins with a text, once it is there, as who opens a list and takes it."""
        found = f"document.querySelector({json.dumps(selector)})"
        self.wait(f"[...{found}?.options ?? []].some(({{ text }}) => text.startsWith({json.dumps(begins)}))")
        self.value(
            f"((one) => {{ one.value = [...one.options].find(({{ text }}) => text.startsWith({json.dumps(begins)})).value;"
            f" one.dispatchEvent(new Event('change', {{ bubbles: true }})); }})({found})"
        )

    def go_to(self, text: str, kind: str = "BUTTON", most: int = 120) -> None:
        """Press Tab until something of a kind has the focus that is called so."""
        seen = []
        for _ in range(most):
            self.press("tab")
            seen.append(self.focused())
            if seen[-1].startswith(kind) and text in seen[-1]:
                return
        raise AssertionError(f"Tab never came to {text}: {dict.fromkeys(seen)}")

    def focused(self) -> str:
        """What has the focus, in a few words."""
        return str(
            self.value(
                "((one) => `${one.tagName} ${one.className} ${one.ariaLabel ?? ''} ${one.innerText ?? ''}`)(document.activeElement)"
            )
        )

    def settled(self, expression: str) -> Any:
        """What an expression is once the page has stopped changing."""
        still = """new Promise((done) => {
          let waiting = setTimeout(done, 400);
          const seen = new MutationObserver(() => { clearTimeout(waiting); waiting = setTimeout(done, 400); });
          seen.observe(document.body, { subtree: true, childList: true, characterData: true });
          setTimeout(done, 4000);
        })"""
        return self.value(f"{still}.then(() => {expression})")

    def click_time(self, along: float) -> None:
        """Click the time line: at 0 its beginning, at 1 its end."""
        left, top, width = self.value(
            "(({ left, top, width }) => [left, top, width])(document.querySelector('#time [role=slider]').getBoundingClientRect())"
        )
        self.mouse("mousePressed", left + along * width, top + 8)
        self.mouse("mouseReleased", left + along * width, top + 8, 0)

    def tick(self) -> int:
        """The tick that the time line shows."""
        return int(
            self.value("Number(document.querySelector('#time [role=slider]').getAttribute('aria-valuenow'))")
        )


HAD = """try {
  for (const [name, value] of [['pane0', 'run'], ['pane1', 'tables'], ['about', 'gone']]) localStorage['studio.' + name] ??= value;
} catch {}"""
"""What a browser kept of who has used the studio."""


@contextlib.contextmanager
def seated(
    opening: Opening,
    *,
    dark: bool = False,
    in_space: bool = False,
    logs: tuple[Path, ...] = (),
    first_time: bool = False,
) -> Iterator[Seat]:
    """A studio with a browser before it, at the size that it must be readable at; of who comes again, and had levels beside tables."""
    with serving(opening, logs=logs) as server, Seat(WIDE, HIGH, in_space=in_space) as seat:
        if not first_time:
            seat.begin_with(HAD)
        seat.enter(server.address, dark=dark)
        yield seat
        wrong = [said for said in seat.said if "favicon" not in said]
        assert not wrong, f"the page complains: {wrong}"


SHOWN = """new Promise((done) => {
  const now = document.querySelector("#time [role=slider]"), view = document.querySelector(".view-run");
  let frames = 0;
  const look = () => {
    frames += 1;
    if (window.wanted !== undefined && now.ariaValueNow === view.dataset.tick && performance.now() >= window.wanted)
      return done([Number(view.dataset.tick), performance.now() - window.wanted, frames]);
    return requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})"""
"""Waits until levels and time line show one tick: which, after how many milliseconds, in how many frames."""


def scrubbed(
    seat: Seat, many: int, places: random.Random, wait_every: int = 1
) -> Iterator[tuple[int, tuple[float, int]]]:
    """Drag along the time line; after every so many moves yield the tick that is shown, how long that took, and the frames.

    Raises:
        AssertionError: Another tick is shown than the mouse stands on.
    """
    left, top, width, first, last = seat.value("""(() => {
      const one = document.querySelector("#time [role=slider]"), { left, top, width } = one.getBoundingClientRect();
      one.addEventListener("pointermove", () => { window.wanted = performance.now(); });
      return [left, top, width, Number(one.ariaValueMin), Number(one.ariaValueMax)];
    })()""")
    seat.press("0")
    seat.mouse("mousePressed", left + 5, top + 8)
    for move in range(1, many + 1):
        at = places.uniform(0.01, 0.99)
        seat.mouse("mouseMoved", left + at * width, top + 8)
        if move % wait_every == 0:
            tick, after_ms, frames = seat.value(SHOWN)
            assert abs(tick - (first + at * (last - first))) <= 1 + 2 * (last - first) / width
            yield tick, (after_ms, frames)
    seat.mouse("mouseReleased", left + 5, top + 8, 0)
