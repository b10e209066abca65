"""What a buffer costs in one process and between two: `python -m tests.bench.transport`.

A value of 64 numbers is published and read; then two processes pass it to and fro. The round trip has two processors, or it
measures the scheduler: nobody waits for anybody, so both look all the time.
"""

import multiprocessing
import time
from collections.abc import Callable

from rcsc.run.buffers import Buffers, CommonMemory
from rcsc.run.processes.memory import SharedMemoryBuffers
from tests.support.processes_outside import echo, pattern, wide

ROUNDS = 20_000
TRIPS_S = 3.0
TRACE = (0, 0, 0, 0)


def microseconds(work: Callable[[int], None]) -> float:
    """The best of five."""
    best = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        for at in range(ROUNDS // 5):
            work(at)
        best = min(best, time.perf_counter() - start)
    return best / (ROUNDS // 5) * 1e6


def through(buffers: Buffers) -> float:
    """Publish, then read."""
    values = pattern(1), pattern(2)

    def work(at: int) -> None:
        buffers.publish("far.out", values[at & 1])
        buffers.latest("far.out")

    return microseconds(work)


def committed(buffers: SharedMemoryBuffers) -> float:
    """A checkpoint of 132 values, with the output in it."""
    values = [(*pattern(at), *pattern(at + 1), *TRACE) for at in range(2)]
    return microseconds(lambda at: buffers.commit("wide", values[at & 1]))


def trips(buffers: SharedMemoryBuffers) -> list[float]:
    """Round trips to another process, each in microseconds, from the fastest."""
    other = multiprocessing.get_context("spawn").Process(target=echo, args=(buffers.block.name, 60.0))
    other.start()
    found: list[float] = []
    number, end = 1, float("inf")
    while time.monotonic() < end:
        number += 1
        start = time.perf_counter()
        buffers.publish("wide.out", pattern(number))
        while True:
            back = buffers.latest("far.out")
            if back is not None and back[0] == number:
                break
        if end == float("inf"):  # the first waits for the process to start
            end = time.monotonic() + TRIPS_S
        else:
            found.append((time.perf_counter() - start) * 1e6)
    other.kill()
    other.join()
    return sorted(found)


def main() -> None:
    buffers = SharedMemoryBuffers.create(wide())
    try:
        rows = [
            ("publish and latest, one process", through(CommonMemory())),
            ("publish and latest, shared memory", through(buffers)),
            ("commit of a checkpoint, shared memory", committed(buffers)),
        ]
        found = trips(buffers)
        rows += [
            (f"round trip, {name}", found[int(len(found) * at)])
            for name, at in (("median", 0.5), ("99 %", 0.99))
        ]
    finally:
        buffers.block.unlink()
        buffers.close()
    print(f"{'':40} {'us':>10}")
    for name, cost in rows:
        print(f"{name:40} {cost:10.2f}")


if __name__ == "__main__":
    main()
