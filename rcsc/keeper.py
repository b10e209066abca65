"""A small process beside rcsc that outlives it for as long as it takes to clear away what it left.

Run by path, with nothing but the standard library's smallest part. In: lines on the standard input, `+group 12`, `-group 12`,
`+path /tmp/x`, `-path /tmp/x`. The input ends when whoever wrote it has ended, however that was: then every process group still
held is killed, and every path still held is removed.
"""

import contextlib
import os
import signal
import sys


def main() -> None:
    """Hold what is named until the input ends, then clear it away."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
    held: dict[str, None] = {}
    for line in sys.stdin.buffer:
        text = os.fsdecode(line.rstrip(b"\n"))
        if text.startswith("+"):
            held[text[1:]] = None
        else:
            held.pop(text[1:], None)
    for text in held:
        kind, _, name = text.partition(" ")
        if kind == "group":
            _kill(int(name))
    for text in held:
        kind, _, name = text.partition(" ")
        if kind == "path":
            _remove(name)


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
