"""A small process beside rcsc that outlives it for as long as it takes to clear away what it left.

Run by path, with nothing but the standard library's smallest part. In: lines on the standard input, `+group 12`, `-group 12`,
`+process 12`, `+path /tmp/x`, `-path /tmp/x`. The input ends when whoever wrote it has ended, however that was: then every process
and every process group still held is killed, and every path still held is removed. A process is held by a descriptor, which never comes to
mean another one; it is let go when it ends.
"""

import contextlib
import os
import select
import signal
import sys


def main() -> None:
    """Hold what is named until the input ends, then clear it away."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
    held: dict[str, None] = {}
    processes: list[int] = []
    for line in sys.stdin.buffer:
        text = os.fsdecode(line.rstrip(b"\n"))
        if text.startswith("+process "):
            processes = [*_running(processes), *_opened(int(text[9:]))]
        elif text.startswith("+"):
            held[text[1:]] = None
        else:
            held.pop(text[1:], None)
    for process in processes:
        with contextlib.suppress(OSError):  # it has ended
            signal.pidfd_send_signal(process, signal.SIGKILL)
    for text in held:
        kind, _, name = text.partition(" ")
        if kind == "group":
            _kill(int(name))
    for text in held:
        kind, _, name = text.partition(" ")
        if kind == "path":
            _remove(name)


def _opened(process: int) -> list[int]:
    """Return a descriptor of the process; none where it has ended, or the system has no such descriptors."""
    with contextlib.suppress(OSError, AttributeError):
        return [os.pidfd_open(process)]
    return []


def _running(processes: list[int]) -> list[int]:
    """Return the processes that have not ended; the others are closed. A descriptor can be read when its process has ended."""
    ended = set(select.select(processes, [], [], 0)[0])
    for descriptor in ended:
        os.close(descriptor)
    return [process for process in processes if process not in ended]


def _kill(group: int) -> None:
    with contextlib.suppress(OSError):  # it has ended
        os.killpg(group, signal.SIGKILL)


def _remove(path: str) -> None:
    import shutil

    if os.path.isdir(path) and not os.path.islink(path):
        shutil.rmtree(path, ignore_errors=True)
    elif os.path.lexists(path):
        with contextlib.suppress(OSError):  # somebody else did
            os.unlink(path)


if __name__ == "__main__":
    main()
