"""Proofs that take long: the tables compiled before anything runs, and the levels proved together.

In: questions of kind `build.*`. Out: what was proved, and findings as runs to look at. Each proof has a process of its own, which is
killed when its question is cancelled, and never holds up the levels.
"""

import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import TimeoutError as NotYet
from pathlib import Path
from typing import Any, TypeVar

from rcsc.base.diagnostics.coded import CodedError, Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.jsonform import report_to_json
from rcsc.base.host.cache import open_cache
from rcsc.base.host.children import WorkerEndedError, answer, executor, kill
from rcsc.base.host.children import run as run_program
from rcsc.base.host.trust import Agreement
from rcsc.desk.shell.reload.composed import prove_levels
from rcsc.desk.studio.hub import LATER, TOLD_S, Ask, CancelledError, Concern, Hub, Json
from rcsc.desk.studio.runs.live import LANE as RUN
from rcsc.desk.studio.runs.live import Live
from rcsc.driver.compile import compile_system

LANE = "prove"
NO_SYSTEM = "its tables belong to no system: a `system.toml` beside them says which levels run, and what lies between them"
ASKS = "nobody agreed that the code of this folder runs: its plant, its extern procedures, the executors that are generated of its tables"
FOUND = Path(".rcsc-cache") / "found"
"""Where findings are kept as logs, beside the system."""
_COMMAND = "from rcsc.front.commands import main; main()"
MOST_TEXT = 200_000
"""Characters of what a proof says."""
T = TypeVar("T")


class Build(Concern):
    """Compiles the system's tables when the studio begins and whenever a page asks; proves the levels together."""

    name, lane = "build", LANE

    def __init__(
        self, path: Path, hub: Hub, live: Live, agreement: Agreement, *, proves: bool = False
    ) -> None:
        """Take what it works on.

        Args:
            path: Of the description.
            hub: Of the studio.
            live: What runs what was compiled.
            agreement: Whether it may run.
            proves: Whether the levels are proved together at once.
        """
        self._path, self._hub, self._live, self._agreement = path, hub, live, agreement
        self._said: Json = {"doing": "", "asks": "", "system": path.is_file()}
        self._proves, self._over = proves, threading.Event()
        self._stop: Callable[[], None] = lambda: None

    def prove_first(self, ask: Ask, then: Callable[[], Json]) -> Json:
        """Prove the levels together, beside them; then call `then` in the lane `run`, and answer with its result. From any lane."""

        def proved() -> Json:
            self._waited(ask, "proving the levels together", proved_together, self._path)
            self._hub.do(RUN, lambda: ask.done(then))
            return LATER

        self._hub.do(LANE, lambda: ask.done(proved))
        return LATER

    def greeting(self) -> Json:
        """Return the work under way and the findings of the last compilation."""
        return self._said

    def begin(self) -> None:
        """Compile and open the system; report why not where there are only tables, or where nobody agreed to its code."""
        self._hub.watch(self._live.lane, self._live.held)
        if not self._path.is_file():
            self._hub.do(RUN, lambda: self._live.close_because(NO_SYSTEM))
            return
        if not self._agreement.given:
            self._said = {**self._said, "asks": str(self._agreement.folder)}
            self._hub.tell("build.state", self._said)
            self._hub.do(RUN, lambda: self._live.close_because(ASKS))
            return
        try:
            if self._compile(None)["ok"] and self._proves:
                self._prove(None)
        except CancelledError:
            return  # the studio ends
        except BaseException as error:
            why = f"its tables were not proved: {str(error) or type(error).__name__}"
            self._hub.do(RUN, lambda: self._live.close_because(why))
            raise

    def close(self) -> None:
        """Kill the process of the proof under way."""
        self._over.set()
        self._stop()

    def _told(self, text: str) -> None:
        self._said = {**self._said, "doing": text}
        self._hub.tell("build.state", self._said)

    def _on_open(self, ask: Ask) -> Json:
        """Compile whatever changed, and open the system anew."""
        if not self._path.is_file():
            raise Refused(Code.STUDIO, NO_SYSTEM)
        if not self._agreement.given:
            raise Refused(Code.STUDIO, ASKS, "agree to it in the page, or start the studio with `--trust`")
        return self._compile(ask)

    def _on_trust(self, ask: Ask) -> Json:
        """Let the folder's code run, now and whenever it is opened; then compile and open the system."""
        self._agreement.give()
        return self._on_open(ask)

    def _waited(self, ask: Ask | None, what: str, function: Callable[..., T], *arguments: Any) -> T:
        """Run some work in a process of its own, and report regularly, also to who asked, what it is and how long it has taken.

        Raises:
            CancelledError: The question was cancelled, or the studio ends; the process is gone.
            WorkerEndedError: The process ended without an answer.
        """
        processes, begun_s = executor(1), time.monotonic()
        self._stop = lambda: kill(processes)
        if ask is not None:
            ask.on_cancel(self._stop)
        try:
            future = processes.submit(function, *arguments)
            while not self._over.is_set():
                text = f"{what}, {time.monotonic() - begun_s:.0f} s"
                self._told(text)
                if ask is not None:
                    ask.progress(text)
                try:
                    future.exception(TOLD_S)
                except NotYet:
                    continue
                return answer(future)
            raise CancelledError
        except WorkerEndedError:
            if self._over.is_set():
                raise CancelledError from None
            if ask is not None:
                ask.check()
            raise
        finally:
            kill(processes)
            processes.shutdown(wait=False, cancel_futures=True)
            self._told("")

    def _compile(self, ask: Ask | None) -> Json:
        self._said = {**self._said, "ok": None}  # of what is proved now nothing is known
        report = self._waited(ask, "proving and compiling the tables", compiled, self._path)
        errors = [one for one in report["diagnostics"] if one["severity"] == "error"]
        self._said = {
            "doing": "",
            "asks": "",
            "system": True,
            "ok": report["ok"],
            "findings": report["diagnostics"],
            "tables": report["tables"],
        }
        self._hub.tell("build.state", self._said)
        if report["ok"]:
            self._hub.do(RUN, self._live.open)
        else:
            first = errors[0]["message"] if errors else report.get("why", "")
            more = f", and {len(errors) - 1} more" if len(errors) > 1 else ""
            why = f"its tables were not proved and compiled: {first}{more}"
            self._hub.do(RUN, lambda: self._live.close_because(why))
        return {"ok": report["ok"], "findings": report["diagnostics"]}

    def _on_prove(self, ask: Ask) -> Json:
        """Prove the levels together, and keep counterexamples as logs."""
        if not self._path.is_file():
            raise Refused(Code.STUDIO, NO_SYSTEM)
        return self._prove(ask)

    def _prove(self, ask: Ask | None) -> Json:
        folder = self._path.parent / FOUND
        before = _logs(folder)
        arguments = ("prove", str(self._path), "--log", str(folder))
        status, text = self._waited(ask, "proving the levels together", commanded, arguments)
        new = sorted(name for name, changed in _logs(folder).items() if before.get(name) != changed)
        return {"status": status, "text": text[:MOST_TEXT], "logs": new}


def compiled(path: Path) -> dict[str, Any]:
    """Prove and compile a system's tables; return the report as JSON. An invalid description is reported in it, too."""
    try:
        return report_to_json(compile_system(path).report, "compile")
    except CodedError as error:
        return {"ok": False, "diagnostics": [], "tables": [], "why": error.shown}


def proved_together(path: Path) -> None:
    """Prove a system's levels together, and keep the result in the cache, where the next proof looks for it.

    Raises:
        Refused: The description is not in order.
    """
    cache = open_cache(path.parent)
    if cache is not None:
        prove_levels(path, cache)


def commanded(arguments: tuple[str, ...]) -> tuple[int | None, str]:
    """Run `rcsc` with arguments; return its status and its output."""
    ran = run_program([sys.executable, "-c", _COMMAND, *arguments])
    return ran.status, ran.out + ran.err


def _logs(folder: Path) -> dict[str, float]:
    return {str(path): path.stat().st_mtime for path in folder.glob("*.mcap")} if folder.is_dir() else {}
