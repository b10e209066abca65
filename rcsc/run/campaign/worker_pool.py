"""A pool of workers: any standard executor, and how to renew one that broke.

In: processes here, or the address of a scheduler. Out: a `WorkerPool`.
"""

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host import children
from rcsc.run.campaign.work import own_process

if TYPE_CHECKING:
    from distributed import Client

P = ParamSpec("P")
R = TypeVar("R")

_CONNECT_S = 10


class WorkersGone(CodedError):  # noqa: N818  # what happened, not an error of ours
    """No workers remain, or none could be reached; what is done is kept."""

    code = Code.WORKERS_GONE
    helps = ("what is done is kept: the same command goes on from there",)


class Crashed(Exception):  # noqa: N818  # likewise
    """A worker died of the one task that it had."""


@dataclass(slots=True)
class WorkerPool:
    """An executor and what a campaign must know of it.

    Attributes:
        executor: Any; only `submit` is used.
        workers: How many tasks it does at once.
        deaths: What a future raises when a worker died.
        renew: Makes another executor, where one that lost a worker is of no more use.
    """

    executor: Executor
    workers: int = 1
    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)
    renew: Callable[[], Executor] | None = None

    def submit(self, task: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        """Submit a task, for any worker.

        Raises:
            WorkersGone: The executor takes none, and cannot be made anew.
        """
        try:
            return self.executor.submit(task, *args, **kwargs)
        except BrokenExecutor as error:
            self.survive(error, self.executor)
            return self.executor.submit(task, *args, **kwargs)

    def survive(self, death: BaseException, executor: Executor) -> None:
        """Replace the executor after a worker's death, where it is broken and still in use.

        Raises:
            WorkersGone: There is no other.
        """
        if not isinstance(death, BrokenExecutor) or executor is not self.executor:
            return
        if self.renew is None:
            raise WorkersGone("a worker died, and took the executor with it") from death
        self.executor.shutdown(wait=False)
        self.executor = self.renew()

    def call(self, task: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Run a task while nothing else is under way: if a worker dies, it dies of that.

        Raises:
            Crashed: It did.
            WorkersGone: And nobody is left.
        """
        future = self.submit(task, *args, **kwargs)
        executor = self.executor
        try:
            return future.result()
        except self.deaths as death:
            self.survive(death, executor)
            raise Crashed from death


@contextlib.contextmanager
def processes(workers: int) -> Iterator[WorkerPool]:
    """Run processes on this machine, spawned rather than forked: what this process holds open stays its own.

    When it ends early, by an error or an interrupt, so do they.
    """

    def new_executor() -> Executor:
        return children.executor(workers, own_process)

    pool = WorkerPool(new_executor(), workers, renew=new_executor)
    try:
        yield pool
    except BaseException:
        children.kill(pool.executor)
        raise
    finally:
        pool.executor.shutdown(cancel_futures=True)


@contextlib.contextmanager
def cluster(address: str) -> Iterator[WorkerPool]:
    """Yield the workers of a `dask.distributed` scheduler.

    Raises:
        ModuleNotFoundError: distributed is not installed.
        WorkersGone: No scheduler answers there.
    """
    from distributed import Client

    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkersGone(f"no scheduler answers at {address}") from error
    with client:
        yield pool_of(client)


def pool_of(client: "Client") -> WorkerPool:
    """Return the workers that a client sees now."""
    from distributed.scheduler import KilledWorker

    threads: dict[str, Any] = client.nthreads()
    return WorkerPool(
        client.get_executor(pure=False), max(1, sum(threads.values())), (BrokenExecutor, KilledWorker)
    )
