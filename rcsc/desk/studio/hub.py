"""Questions of pages, answered by concerns in threads of their own; and what every page is told.

In: messages of pages, checked to be tables of names and values. Out: an answer or a refusal for each question, and events for all pages.
A *concern* answers the questions of its kinds (`run.step`). Concerns of one *lane* share one thread, so that none of them needs a
lock, and a question that takes long delays its own lane only.

What waits for a page is bounded: of each kind of event the latest alone, and as many answers as questions may be open. A page that
hangs therefore costs nobody anything.
"""

import heapq
import itertools
import json
import math
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeAlias

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.children import WorkerEndedError
from rcsc.base.host.files.read import CheckedFields, Malformed
from rcsc.proof.solvers.smt import until

Json: TypeAlias = Any
"""What JSON can hold."""
PROVER = threading.RLock()
"""Whoever proves in this process holds it: the solvers know one thread at a time."""
LONG_S = 1.0
"""What a lane does at one go takes long after so many seconds."""
TOLD_S = 0.5
"""A page is told so often how long a proof takes."""
MOST_OPEN = 32
"""Questions of one page that may be unanswered."""
MOST_UNREAD = 4 * MOST_OPEN
"""Answers and refusals that may wait for a page; one that asks on and takes none of them is given up."""
DEEPEST_MESSAGE = 12


class CancelledError(Exception):
    """The page that asked wants no answer any more."""


class Ask:
    """A question under way, as its handler sees it; every method may be called from any thread.

    Attributes:
        body: What was asked, checked field by field as the handler reads it.
    """

    def __init__(
        self, body: CheckedFields, told: Callable[[Json], None], finish: Callable[[Callable[[], Json]], None]
    ) -> None:
        """Args: body: What was asked; told: Takes how far it is; finish: Sends what it calls, or why that was refused."""
        self.body, self._told, self._finish = body, told, finish
        self._over = threading.Event()
        self._stops: list[Callable[[], None]] = []

    def done(self, how: Callable[[], Json]) -> None:
        """Answer a question whose handler returned `LATER`: with the result of `how`, or the reason why it raises."""
        self._finish(how)

    def progress(self, text: str, done: int = 0, of: int = 0) -> None:
        """Report progress to the page.

        Args:
            text: What is being done, in words.
            done: Of how many steps; `of` is how many there are, 0 where nobody knows.
            of: See there.

        Raises:
            CancelledError: Nobody waits for the answer.
        """
        self.check()
        self._told({"text": text, "done": done, "of": of})

    def check(self) -> None:
        """Return if the page still waits for the answer.

        Raises:
            CancelledError: Nobody waits for the answer.
        """
        if self._over.is_set():
            raise CancelledError

    @contextmanager
    def proving(self, what: str) -> Iterator[None]:
        """Give this thread the solvers, and tell the page how long it takes; once it wants no answer, ask the solvers no more.

        The solvers then answer `unknown`: the caller calls `check` before it keeps anything that rests on their answers.

        Args:
            what: In words.

        Raises:
            CancelledError: Nobody waits for the answer any more.
        """
        over, begun_s = threading.Event(), time.monotonic()

        def tell() -> None:
            while not over.wait(TOLD_S) and not self.cancelled:
                self._told({"text": f"{what}, {time.monotonic() - begun_s:.0f} s", "done": 0, "of": 0})

        teller = threading.Thread(target=tell, daemon=True)
        teller.start()
        try:
            while not PROVER.acquire(timeout=TOLD_S):
                self.check()
            try:
                with until(lambda: self.cancelled, breaks_off=True):
                    yield
            finally:
                PROVER.release()
        finally:
            over.set()
            teller.join()

    @property
    def cancelled(self) -> bool:
        """True once nobody waits for the answer."""
        return self._over.is_set()

    def on_cancel(self, stop: Callable[[], None]) -> None:
        """Call a function when the question is cancelled; at once if it already is."""
        self._stops.append(stop)
        if self._over.is_set():
            stop()

    def cancel(self) -> None:
        """Cancel the question."""
        self._over.set()
        for stop in list(self._stops):
            stop()


LATER: Any = object()
"""What a handler returns that will call `Ask.done`; until then its lane is free for others."""
Handler: TypeAlias = Callable[[Ask], Json]
"""Answers a question, or returns `LATER`.

Raises:
    CodedError, Malformed: It is refused, with the reason.
    CancelledError: Nobody waits for the answer.
"""


class Concern:
    """What answers questions of some kinds: one of kind `NAME.VERB` with its method `_on_VERB`.

    Attributes:
        name: The first part of its kinds.
        lane: The thread in which its handlers run.
    """

    name: str
    lane: str

    @property
    def handlers(self) -> Mapping[str, Handler]:
        """By kind."""
        found = (verb.removeprefix("_on_") for verb in dir(self) if verb.startswith("_on_"))
        return {f"{self.name}.{verb}": getattr(self, f"_on_{verb}") for verb in found}

    def greeting(self) -> Json:
        """What a page is told of it as it opens; called in its lane."""
        return {}

    def begin(self) -> None:
        """Do what is to be done before any page asks; called in its lane once the studio is served."""

    def close(self) -> None:
        """Let go of what it holds; called when the studio ends."""


class Lane:
    """A thread that does its work in the order of when it is due, until it is ended."""

    def __init__(self, name: str, failed: Callable[[BaseException], None]) -> None:
        """Args: name: Of the thread; failed: Takes what a piece of work raises."""
        self._failed = failed
        self._changed = threading.Condition()
        self._work: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = itertools.count()
        self._ended = False
        self._since_s: float | None = None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def do(self, work: Callable[[], None], after_s: float = 0.0) -> None:
        """Queue work after all that is due before it.

        Args:
            work: Without arguments.
            after_s: So many seconds from now at the earliest.
        """
        with self._changed:
            heapq.heappush(self._work, (time.monotonic() + after_s, next(self._numbers), work))
            self._changed.notify()

    def end(self) -> None:
        """Begin no more work; the current one goes on to its end."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def ended(self, within_s: float) -> bool:
        """Wait at most so many seconds for the current work to end; return whether it ended."""
        self._thread.join(within_s)
        return not self._thread.is_alive()

    @property
    def busy_s(self) -> float:
        """Seconds that the current work has taken so far; 0 without any."""
        since_s = self._since_s
        return 0.0 if since_s is None else time.monotonic() - since_s

    def _next(self) -> Callable[[], None] | None:
        with self._changed:
            while True:
                if self._ended:
                    return None
                wait_s = self._work[0][0] - time.monotonic() if self._work else None
                if wait_s is not None and wait_s <= 0:
                    return heapq.heappop(self._work)[2]
                self._changed.wait(wait_s)

    def _run(self) -> None:
        while (work := self._next()) is not None:
            self._since_s = time.monotonic()
            try:
                work()
            except BaseException as error:  # noqa: BLE001  # of somebody's plant, too: the next in the lane must be done
                self._failed(error)
            self._since_s = None


@dataclass(slots=True)
class Client:
    """A page, with the messages that wait to be sent to it.

    Attributes:
        wake: Called when something waits.
        open: Its questions without an answer, by number.
    """

    wake: Callable[[], None]
    open: dict[int, Ask] = field(default_factory=dict)
    _answers: deque[str] = field(default_factory=deque)
    _events: dict[str, str] = field(default_factory=dict)

    def answer(self, text: str) -> None:
        """Queue an answer to be sent."""
        self._answers.append(text)
        self.wake()

    def event(self, kind: str, text: str) -> None:
        """Queue an event, in place of an earlier one of its kind that still waits."""
        self._events[kind] = text
        self.wake()

    def next(self) -> str | None:
        """Take the next message to be sent; None where nothing waits."""
        if self._events:
            return self._events.pop(next(iter(self._events)))
        return self._answers.popleft() if self._answers else None

    @property
    def waiting(self) -> int:
        """Number of answers that wait to be sent."""
        return len(self._answers)


class Hub:
    """All concerns and all pages.

    `ask`, `enter`, `leave` are for one thread, that of the server; `tell` is for all.
    """

    def __init__(self, onto_server: Callable[[Callable[[], None]], None]) -> None:
        """Args: onto_server: Has something done in the server's thread; what it is given after the end is lost."""
        self._onto_server = onto_server
        self._concerns: list[Concern] = []
        self._handlers: dict[str, tuple[Concern, Handler]] = {}
        self._lanes: dict[str, Lane] = {}
        self._clients: list[Client] = []
        self._wrong: Json = None
        self._partings: list[str] = []

    def add(self, concerns: Sequence[Concern]) -> None:
        """Register concerns, which answer from now on.

        Raises:
            ValueError: Two answer one kind, or a kind is not called after its concern.
        """
        for concern in concerns:
            for kind, handler in concern.handlers.items():
                if kind in self._handlers or not kind.startswith(f"{concern.name}."):
                    raise ValueError(f"a second handler, or another's name: {kind}")
                self._handlers[kind] = concern, handler
            if concern.lane not in self._lanes:
                self._lanes[concern.lane] = Lane(f"studio {concern.lane}", self._failed)
            self._concerns.append(concern)

    def begin(self) -> None:
        """Start every concern."""
        for concern in self._concerns:
            self._lanes[concern.lane].do(concern.begin)

    def do(self, lane: str, work: Callable[[], None], after_s: float = 0.0) -> None:
        """Queue work in a lane, to begin so many seconds from now at the earliest; from any thread."""
        self._lanes[lane].do(work, after_s)

    def watch(self, lane: str, told: Callable[[float], None]) -> None:
        """Report long work of a lane from a thread of its own: how long it takes, and 0 once it is over.

        Args:
            lane: Which.
            told: Takes seconds.
        """
        watched = self._lanes[lane]

        def look() -> None:
            held = False
            while not watched.ended(LONG_S / 2):
                busy_s = watched.busy_s
                if busy_s >= LONG_S or held:
                    held = busy_s >= LONG_S
                    told(busy_s if held else 0.0)

        threading.Thread(target=look, name=f"studio watches {lane}", daemon=True).start()

    def tell(self, kind: str, body: Json) -> None:
        """Tell every page; from any thread. A page that was not ready for earlier events of this kind gets only the latest."""
        text = message(event=kind, body=body)
        self._onto_server(lambda: self._spread(kind, text))

    def _failed(self, error: BaseException) -> None:
        """Report to every page, and to those that open later, an error that no question raised."""
        _, text, helps = _reason(error)
        self._wrong = {"text": text, "wrong": True, "helps": list(helps)}
        self.tell("said", self._wrong)

    def _spread(self, kind: str, text: str) -> None:
        for client in self._clients:
            client.event(kind, text)

    # --- pages ---

    def enter(self, client: Client) -> None:
        """Let a page in, and tell it the state of each concern: an event `NAME.state`, as when the state changes."""
        self._clients.append(client)
        if self._wrong is not None:
            client.event("said", message(event="said", body=self._wrong))
        for concern in self._concerns:
            self._lanes[concern.lane].do(partial(self._greet, client, concern))

    def _greet(self, client: Client, concern: Concern) -> None:
        kind = f"{concern.name}.state"
        text = message(event=kind, body=concern.greeting())
        self._onto_server(lambda: client.event(kind, text))

    def leave(self, client: Client) -> None:
        """Forget a page, and cancel its questions."""
        if client in self._clients:
            self._clients.remove(client)
        for ask in list(client.open.values()):
            ask.cancel()

    def part(self, text: str) -> None:
        """Add a message that is printed where the studio was started, once it has ended."""
        self._partings.append(text)

    @property
    def partings(self) -> Sequence[str]:
        """The messages to print once the studio has ended."""
        return tuple(self._partings)

    def close(self) -> None:
        """Close every concern."""
        for client in list(self._clients):
            self.leave(client)
        for concern in self._concerns:
            concern.close()
        for lane in self._lanes.values():
            lane.end()

    def ended(self, within_s: float) -> bool:
        """Wait after `close` for the current work to end, in each lane at most so many seconds; return whether it ended."""
        return all(lane.ended(within_s) for lane in list(self._lanes.values()))

    # --- questions ---

    def ask(self, client: Client, said: object) -> None:
        """Take a message of a page: a question, or the cancelling of one.

        Raises:
            Malformed: It is neither; no page of ours sends such a message.
        """
        fields = CheckedFields(said, "the message")
        number = fields.whole("id", 1, 2**53)
        if fields.flag("cancel"):
            if number in client.open:
                client.open[number].cancel()
            return
        kind = fields.text("kind")
        if number in client.open:
            raise Malformed(f"question {number} is open already")
        if client.waiting >= MOST_UNREAD:
            raise Malformed(f"{MOST_UNREAD} answers were not taken")
        if len(client.open) + client.waiting >= MOST_OPEN:
            client.answer(_refused(number, Code.STUDIO, f"more than {MOST_OPEN} questions at once", ()))
            return
        known = self._handlers.get(kind)
        if known is None:
            client.answer(_refused(number, Code.STUDIO, "no part of the studio answers that", ()))
            return
        concern, handler = known
        body = CheckedFields(fields.value.get("body", {}), kind)
        ask = Ask(
            body, partial(self._progress, client, number), lambda how: self._finish(client, number, ask, how)
        )
        client.open[number] = ask
        self._lanes[concern.lane].do(lambda: self._finish(client, number, ask, lambda: handler(ask)))

    def _progress(self, client: Client, number: int, how: Json) -> None:
        text = message(id=number, progress=how)
        self._onto_server(lambda: client.event(f"#{number}", text))

    def _finish(self, client: Client, number: int, ask: Ask, how: Callable[[], Json]) -> None:
        """Answer a question, in the lane's thread."""
        text = _answered(number, ask, how)
        if text is not None:
            self._onto_server(lambda: _close(client, number, text))


def _close(client: Client, number: int, text: str) -> None:
    if client.open.pop(number, None) is None:
        return  # it was answered, before its handler raised
    client._events.pop(f"#{number}", None)  # noqa: SLF001  # progress after the answer would be news of nothing
    client.answer(text)


def _answered(number: int, ask: Ask, how: Callable[[], Json]) -> str | None:
    """Return the message with the answer; None where the answer comes later."""
    try:
        ask.check()
        answer = how()
        return None if answer is LATER else message(id=number, answer=answer)
    except CancelledError:
        return message(id=number, cancelled=True)
    except BaseException as error:  # noqa: BLE001  # a bug in one answer must not end the studio
        code, text, helps = _reason(error)
        return _refused(number, code, text, helps)


def _reason(error: BaseException) -> tuple[Code, str, Sequence[str]]:
    """Return an exception's code, message and helps: a refusal in its own words; a bug is printed, too."""
    match error:
        case CodedError():
            return error.code, error.shown, error.helps
        case Malformed():
            return Code.STUDIO, str(error), ()
        case WorkerEndedError():
            return Code.WORKER_ENDED, str(error), ()
        case _:
            traceback.print_exception(error, file=sys.stderr)
            helps = ("please report it, with what is printed where `rcsc studio` runs",)
            return Code.INTERNAL, f"a bug in rcsc: {type(error).__name__}", helps


def _refused(number: int, code: Code, text: str, helps: Sequence[str]) -> str:
    return message(id=number, refused={"code": code.value, "text": text, "helps": list(helps)})


def message(**parts: Json) -> str:
    """Write a message for a page; a number that is not finite becomes a text."""
    try:
        return json.dumps(parts, separators=(",", ":"), allow_nan=False)
    except ValueError:
        return json.dumps(_finite(parts), separators=(",", ":"), allow_nan=False)


def _finite(value: Json) -> Json:
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    if isinstance(value, Mapping):
        return {key: _finite(of) for key, of in value.items()}
    return [_finite(of) for of in value] if isinstance(value, list | tuple) else value
