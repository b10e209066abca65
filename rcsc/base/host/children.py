"""The one place through which processes begin: programs, worker pools, and the processes of a running system.

In: a command, or a function for another process. Out: what it did; nothing that was begun here outlives this process.

Three layers see to that, since a process can end without a chance to clear up (SIGKILL, SIGTERM, a crash):
1. Each child asks the kernel to be killed when the thread that began it ends (`prctl(2)`, PR_SET_PDEATHSIG). Therefore begin a pool
   in a thread that lives as long as the pool.
2. That does not reach a grandchild, such as the compiler proper below its driver. Each program leads a process group of its own, and
   `rcsc.base.host.keeper`, a small process that notices the end of this one by the end of its input, kills the groups and removes the paths
   that are still held. It kills processes of this program, too: one that is still starting has not yet asked the kernel.
3. Where even the keeper is killed, paths are locked for as long as their maker lives, and the next `scratch` or `lock` of that kind
   sweeps those that nobody locks.
"""

import atexit
import contextlib
import ctypes
import fcntl
import os
import resource
import shutil
import signal
import subprocess  # the place where rcsc runs programs: lists of arguments, never a shell's line
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess

T = TypeVar("T")

_KEEPER = Path(__file__).with_name("keeper.py")
_PR_SET_PDEATHSIG = 1


class WorkerEndedError(Exception):
    """A worker process ended without an answer: it was killed, ran out of memory, or crashed."""


@dataclass(frozen=True, slots=True)
class Ran:
    """What a program did.

    Attributes:
        status: Exit status, negative for a signal; None where it ran past its time limit.
        raw: Its standard output, as bytes.
        err: Its standard error stream, as text.
    """

    status: int | None
    raw: bytes
    err: str

    @property
    def out(self) -> str:
        """Its standard output as text."""
        return self.raw.decode(errors="replace")


# --- what is still held when this process ends ---


class _Keeper:
    """The keeper's process, begun with the first thing that is held; and what it holds."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._held: dict[str, None] = {}
        self._process: subprocess.Popen[bytes] | None = None
        self._maker = 0

    def hold(self, what: str) -> None:
        """Clear `what` away if this process ends before it is let go."""
        with self._lock:
            self._own()
            self._held[what] = None
            self._tell(f"+{what}")

    def pipe(self) -> int:
        """Return the pipe by which a forked child names itself before it runs a program."""
        with self._lock:
            self._own()
            self._tell("")
            assert self._process is not None
            assert self._process.stdin is not None
            return self._process.stdin.fileno()

    def let_go(self, what: str) -> None:
        """Forget `what`: it has been cleared away."""
        with self._lock:
            if self._held.pop(what, self) is None:
                self._tell(f"-{what}")

    def held(self) -> tuple[str, ...]:
        """Return the processes that are held now."""
        with self._lock:
            return tuple(self._held)

    def _own(self) -> None:
        """Forget the keeper in a copy of the process that began it: the copy begins its own."""
        if self._maker != os.getpid():
            self._held, self._process, self._maker = {}, None, os.getpid()

    def _tell(self, line: str) -> None:
        if self._process is not None and self._process.poll() is None:
            with contextlib.suppress(BrokenPipeError):
                self._write([line])
                return
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", str(_KEEPER)], stdin=subprocess.PIPE, bufsize=0, cwd="/",
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        self._held = {what: None for what in self._held if _still(what)}
        self._write([f"+{what}" for what in self._held])

    def _write(self, lines: Sequence[str]) -> None:
        assert self._process is not None
        assert self._process.stdin is not None
        self._process.stdin.write(b"".join(os.fsencode(line) + b"\n" for line in lines))

    def end(self) -> None:
        """End the keeper, which clears away whatever is still held."""
        if self._process is not None and self._maker == os.getpid():
            assert self._process.stdin is not None
            self._process.stdin.close()
            self._process.wait()
            self._process = None


def _still(what: str) -> bool:
    """Return whether a number still means the process that was held: one that has ended and was waited for may have left it to another."""
    kind, _, name = what.partition(" ")
    if kind != "process":
        return True
    try:
        os.waitid(os.P_PID, int(name), os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    return True


_keeper = _Keeper()
atexit.register(_keeper.end)


def leave(status: int) -> NoReturn:
    """End this process without the interpreter's clearing up, which takes long where much is held; for who has nothing more to do.

    What is still held is cleared away first.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):
            stream.flush()
    _keeper.end()
    os._exit(status)


def hold(path: Path) -> None:
    """Remove `path`, a file or a folder, when this process ends in any way before it is let go."""
    _keeper.hold(f"path {path}")


def let_go(path: Path) -> None:
    """Forget `path`: its maker has removed it."""
    _keeper.let_go(f"path {path}")


def lock(path: Path) -> int | None:
    """Lock what was just made at `path` for as long as this process lives; a descriptor, or None where a sweep was first."""
    try:
        opened = os.open(path, os.O_RDONLY)
    except FileNotFoundError:
        return None
    fcntl.flock(opened, fcntl.LOCK_EX)
    with contextlib.suppress(FileNotFoundError):
        if os.path.samestat(os.stat(path), os.fstat(opened)):
            return opened
    os.close(opened)
    return None


def sweep(folder: Path, prefix: str) -> None:
    """Remove what begins with `prefix` in `folder`, belongs to this user, and is locked by nobody: its maker was killed."""
    for path in folder.glob(f"{prefix}*"):
        with contextlib.suppress(OSError):
            if path.lstat().st_uid == os.getuid() and not path.is_symlink():
                _remove_unlocked(path)


def _remove_unlocked(path: Path) -> None:
    opened = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
    finally:
        os.close(opened)


def _scratch(kind: str) -> tuple[Path, int]:
    """Return a temporary folder that goes when this process ends, and its lock."""
    prefix, parent = f"rcsc-{kind}-", Path(tempfile.gettempdir())
    sweep(parent, prefix)
    held = None
    while held is None:
        path = Path(tempfile.mkdtemp(prefix=prefix))
        held = lock(path)
    hold(path)
    return path, held


@contextlib.contextmanager
def scratch(kind: str) -> Iterator[Path]:
    """Return a temporary folder for work of this kind; it is gone after any end of this process."""
    path, held = _scratch(kind)
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        let_go(path)
        os.close(held)


# --- programs ---

_folders: dict[int, tuple[Path, int]] = {}
"""Of this process, by its number: where the programs that it runs put what is temporary, and its lock."""


def _programs_folder() -> Path:
    """Return the folder for files that programs leave when they are killed; the keeper removes it when this process ends."""
    if os.getpid() not in _folders:
        _folders[os.getpid()] = _scratch("programs")
    return _folders[os.getpid()][0]


def run(
    command: Sequence[str],
    folder: Path | None = None,
    *,
    timeout_s: float | None = None,
    memory_mb: int | None = None,
    stdin: bytes = b"",
) -> Ran:
    """Run a program to its end; at the time limit, and when this is interrupted, its whole process group is killed.

    Args:
        command: The program and its arguments.
        folder: Where it runs.
        timeout_s: Its time limit, by the clock.
        memory_mb: Its limit of address space.
        stdin: What it reads.

    Raises:
        OSError: It cannot be begun.
    """
    with interrupts_held():  # else Ctrl-C could come when the program runs and nobody knows it
        child = subprocess.Popen(
            list(command), cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            preexec_fn=_prepared(memory_mb), start_new_session=True,  # noqa: PLW1509  # it takes no lock and imports nothing
            env={**os.environ, "TMPDIR": str(_programs_folder())},
        )  # fmt: skip
        group = f"group {child.pid}"
        _keeper.hold(group)
    try:
        out, err = child.communicate(stdin, timeout_s)
        return Ran(child.returncode, out, err.decode(errors="replace"))
    except subprocess.TimeoutExpired:
        _kill_group(child.pid)
        out, err = child.communicate()
        return Ran(None, out, err.decode(errors="replace"))
    except BaseException:
        _kill_group(child.pid)
        child.wait()
        raise
    finally:
        for stream in (child.stdin, child.stdout, child.stderr):
            if stream is not None:
                stream.close()
        _keeper.let_go(group)


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Have Ctrl-C come only after the block; what begins in it has to take it anew."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _kill_group(group: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)


def _prepared(memory_mb: int | None) -> Callable[[], None]:
    """Prepare a child between fork and exec."""
    parent, keeper = os.getpid(), _keeper.pipe()

    def prepare() -> None:
        die_with(parent)
        os.write(keeper, b"+group %d\n" % os.getpid())  # its session's leader, and so its group's
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        if memory_mb is not None:
            resource.setrlimit(resource.RLIMIT_AS, (memory_mb << 20, memory_mb << 20))

    return prepare


def _prctl() -> Callable[..., int] | None:
    return ctypes.CDLL(None, use_errno=True).prctl if sys.platform == "linux" else None


_PRCTL = _prctl()  # looked up before any fork


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Have Ctrl-C end this process at once, in a library that does not come back to Python before it is done."""
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def die_with(parent: int) -> None:
    """Have the kernel kill this process when the thread that began it ends; now, where `parent` has ended already."""
    if _PRCTL is not None:
        _PRCTL(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


# --- processes of this program ---


def _begin(parent: int, then: Callable[[], None] | None) -> None:
    """First of all in a worker: it dies with its parent, and leaves Ctrl-C to it."""
    die_with(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if then is not None:
        then()


def executor(workers: int, then: Callable[[], None] | None = None) -> "ProcessPoolExecutor":
    """Workers that begin anew, not as copies, and die with this process; each calls `then` first."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    class Held(ProcessPoolExecutor):
        """One that names each worker to the keeper as soon as it has begun."""

        def _spawn_process(self) -> None:
            known = set(self._processes)
            super()._spawn_process()  # type: ignore[misc]  # what the library calls for each worker
            for worker in self._processes.keys() - known:
                _keeper.hold(f"process {worker}")

    return Held(workers, mp_context=get_context("spawn"), initializer=_begin, initargs=(os.getpid(), then))


@contextlib.contextmanager
def pool(workers: int) -> "Iterator[ProcessPoolExecutor]":
    """Return an `executor` whose workers are killed when the block is left by an exception or an interrupt."""
    processes = executor(workers)
    try:
        yield processes
    except BaseException:
        kill(processes)
        raise
    finally:
        processes.shutdown(wait=True, cancel_futures=True)


def kill(executor: Executor) -> None:
    """Kill every worker, whatever it is doing."""
    for worker in list((getattr(executor, "_processes", None) or {}).values()):
        worker.kill()


def answer(future: Future[T]) -> T:
    """Return what a worker returned.

    Raises:
        WorkerEndedError: It ended without an answer. Whatever it raised is raised here.
    """
    try:
        return future.result()
    except BrokenExecutor as error:
        raise WorkerEndedError("a worker process ended without an answer") from error


def process(name: str, target: Callable[..., None], *args: Any) -> "SpawnProcess":
    """Return a process of this program, for `start` to begin; it dies with this one."""
    from multiprocessing import get_context

    return get_context("spawn").Process(
        target=_as_child, args=(os.getpid(), target, args), name=name, daemon=True
    )


def pipe() -> "tuple[Connection, Connection]":
    """Return a pipe: the end that reads, and the one that a process is given to write to."""
    from multiprocessing import Pipe

    return Pipe(duplex=False)


def start(child: "SpawnProcess") -> None:
    """Begin a process that `process` made."""
    with interrupts_held():
        child.start()
        _keeper.hold(f"process {child.pid}")


def _as_child(parent: int, target: Callable[..., None], args: tuple[Any, ...]) -> None:
    die_with(parent)
    try:
        target(*args)
    except SystemExit as ended:
        leave(ended.code if isinstance(ended.code, int) else 1)
    leave(0)
