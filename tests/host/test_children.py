"""Processes that rcsc begins: none outlives it, and nothing that they made stays, whatever ends it.

Nothing here is timed. Whatever must end holds a FIFO open; that it has ended is read as the end of that file.
"""

import contextlib
import fcntl
import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rcsc.base.host import children
from rcsc.front import commands
from rcsc.proof.solvers import smt
from rcsc.run.processes.block import FOLDER

IN_PROCESS = {
    "Z3": """
def work(fifo):
    import z3
    tell(fifo)
    x, y, z = z3.Ints("x y z")
    solver = z3.Solver()
    solver.add(x * x * x + y * y * y + z * z * z == 33, x > 2, y < -2)
    solver.check()
""",
    "a SAT solver": """
def work(fifo):
    import itertools
    from rcsc.proof.solvers.sat import Sat
    holes = 14
    at = lambda i, j: i * holes + j + 1
    clauses = [[at(i, j) for j in range(holes)] for i in range(holes + 1)]
    clauses += [[-at(a, j), -at(b, j)] for j in range(holes) for a, b in itertools.combinations(range(holes + 1), 2)]
    tell(fifo)
    while True:
        try:
            Sat(clauses).holds(())
        except Exception:
            pass
""",
    "cvc5": """
def work(fifo):
    from rcsc.proof.solvers.smtlib import cvc5_refutes
    import cvc5
    tell(fifo)
    cubes = "(+ (* x x x) (* y y y) (* z z z))"
    names = "".join(f"(declare-const {one} Int)" for one in "xyz")
    cvc5_refutes(f"(set-logic QF_NIA){names}(assert (= {cubes} 33))(check-sat)", 10**9)
""",
    "a compiler below its driver": """
def work(fifo):
    from rcsc.base.host.children import run
    run(["sh", "-c", f"mktemp -t cc.XXXXXX; exec 9>{fifo}; echo ready >&9; sleep 100000 & sleep 100000"])
""",
}
IN_PROCESS["a worker that is still starting"] = """
def work(fifo):
    pass

if __name__ == "__mp_main__":  # before it could ask the kernel for anything
    import time
    tell(str(Path(__file__).with_name("fifo")))
    time.sleep(100000)
"""
HEAD = """
import os, sys, threading, signal
from pathlib import Path

from rcsc.base.host import children
from rcsc.run.processes.block import Block

HELD = []

def tell(fifo):
    HELD.append(os.open(fifo, os.O_WRONLY))
    os.write(HELD[-1], b"ready\\n")
"""
WAYS = {
    "itself": "work(fifo)",
    "a pool": "with children.pool(2) as pool:\n"
    "        both = [pool.submit(work, fifo) for _ in range(2)]\n        children.answer(both[0])",
    "a process": "one = children.process('one', work, fifo); children.start(one); one.join()",
}
ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)


@contextlib.contextmanager
def begun(folder: Path, body: str, way: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A program that holds a block and a folder of its own, and works; and the reading end of its FIFO."""
    fifo, program = folder / "fifo", folder / "program.py"
    os.mkfifo(fifo)
    main = (
        "if __name__ == '__main__':\n"
        f"    fifo = {str(fifo)!r}\n"
        "    block = Block.create(64)\n"
        f"    with children.scratch('tried'):\n        {way.replace(chr(10), chr(10) + '    ')}\n"
    )
    program.write_text(HEAD + body + main, encoding="utf-8")
    reading = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(reading, True)
    holding = os.open(fifo, os.O_WRONLY)  # so that reading waits for the first to begin
    ran = subprocess.Popen(
        [sys.executable, str(program)], stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "TMPDIR": str(folder)},
    )  # fmt: skip
    try:
        with contextlib.ExitStack() as stack:
            stack.callback(os.close, reading)
            for _ in range(2 if "pool" in way else 1):
                assert line(reading) == b"ready\n"
            os.close(holding)
            yield ran, reading
    finally:
        ran.kill()
        ran.wait()
        assert ran.stderr is not None
        ran.stderr.close()


def line(reading: int) -> bytes:
    found = b""
    while not found.endswith(b"\n"):
        found += os.read(reading, 1)
    return found


def gone(path: Path) -> None:
    """Returns when it is gone: what removes it outlives its maker by a moment."""
    while path.exists():
        time.sleep(0.002)


def left(folder: Path, ran: "subprocess.Popen[str]") -> list[Path]:
    return [*folder.glob("rcsc-*"), *FOLDER.glob(f"rcsc-{ran.pid}-*")]


PROGRAMS = [
    pytest.param(inside, way, how, id=f"{how.name}, {way} in {inside}")
    for inside, way, how in itertools.product(IN_PROCESS, WAYS, ENDS)
    if (
        way != "itself"
        if "starting" in inside
        else "pool" in way or inside in {"cvc5", "a compiler below its driver"}
    )
]


@pytest.mark.parametrize(("inside", "way", "how"), PROGRAMS)
def test_nothing_outlives_the_one_who_began_it(
    tmp_path: Path, inside: str, way: str, how: signal.Signals
) -> None:
    """Told only the first of them; each is in a call that does not come back by itself."""
    with begun(tmp_path, IN_PROCESS[inside], WAYS[way]) as (ran, reading):
        assert len(left(tmp_path, ran)) >= 2
        held = left(tmp_path, ran)
        ran.send_signal(how)
        assert os.read(reading, 1) == b""  # every process that held the FIFO has ended
        ran.wait()
        for path in held:
            gone(path)
        assert not list(tmp_path.glob("cc.*"))


def test_the_keeper_is_replaced_when_it_is_killed(tmp_path: Path) -> None:
    body = """
def work(fifo):
    keeper = children._keeper._process
    keeper.kill(); keeper.wait()
    with children.scratch("second"):
        tell(fifo)
        signal.pause()
"""
    with begun(tmp_path, body, WAYS["itself"]) as (ran, _):
        held = left(tmp_path, ran)
        assert len(held) == 3
        ran.kill()
        for path in held:
            gone(path)


def test_what_nobody_could_clear_away_is_swept_at_the_next_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder and a file of a maker that is gone, one that is in use, one by another name, a link."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "rcsc-k-gone/deep").mkdir(parents=True)
    (tmp_path / "rcsc-k-file").touch()
    (tmp_path / "other-k").mkdir()
    (tmp_path / "rcsc-k-link").symlink_to(tmp_path / "other-k")
    used = tmp_path / "rcsc-k-used"
    used.mkdir()
    lock = os.open(used, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    with children.scratch("k") as made:
        assert {path.name for path in tmp_path.iterdir()} == {
            made.name, "other-k", "rcsc-k-link", "rcsc-k-used"
        }  # fmt: skip
        with children.scratch("k") as second:
            assert made.is_dir()
            assert second.is_dir()
    os.close(lock)
    assert not made.exists()


def test_a_path_that_was_swept_before_it_was_locked_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    real = children.lock
    taken: list[Path] = []

    def slow(path: Path) -> int | None:
        if not taken:
            taken.append(path)
            children.sweep(tmp_path, "rcsc-k-")
            assert not path.exists()
            path.mkdir()
            opened = os.open(path, os.O_RDONLY)
            path.rmdir()
            os.close(opened)
            return None
        return real(path)

    monkeypatch.setattr(children, "lock", slow)
    with children.scratch("k") as made:
        assert made.is_dir()
        assert made != taken[0]


def test_a_lock_on_what_is_gone_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sweep holds the lock while it removes; who waited for it must not believe that the path is there."""
    path = tmp_path / "path"
    path.touch()
    sweeping = os.open(path, os.O_RDONLY)
    fcntl.flock(sweeping, fcntl.LOCK_EX)
    found: list[int | None] = []
    opened, real = threading.Event(), os.open

    def told(*given: Any) -> int:
        made = real(*given)
        opened.set()
        return made

    monkeypatch.setattr("os.open", told)
    waiter = threading.Thread(target=lambda: found.append(children.lock(path)))
    waiter.start()
    opened.wait()
    path.unlink()
    os.close(sweeping)
    waiter.join()
    assert found == [None]
    assert children.lock(path) is None, "swept before it was opened"


def test_ctrl_c_ends_a_wait_after_a_question() -> None:
    """Z3 takes Ctrl-C for itself while it is asked, and gives it back changed."""
    solver = smt.Solver()
    solver.add(smt.truth(True))
    assert solver.check() is smt.Answer.SATISFIABLE
    waiting, heeded, late = threading.Lock(), threading.Event(), list[bool]()
    waiting.acquire()

    def interrupt() -> None:
        ended = threading.main_thread().ident
        assert ended is not None
        time.sleep(0.2)  # until it waits; sent before, it would come in any case
        signal.pthread_kill(ended, signal.SIGINT)
        late.append(not heeded.wait(20))
        waiting.release()

    thread = threading.Thread(target=interrupt)
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012  # it comes while it waits
        thread.start()
        waiting.acquire()
    heeded.set()
    thread.join()
    assert late == [False]


# --- programs ---


def test_a_program_past_its_limit_is_killed_with_everything_below_it(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    ends = threading.Thread(target=lambda: found.append(fifo.read_bytes()))
    found: list[bytes] = []
    ends.start()
    ran = children.run(["sh", "-c", f"exec 9>{fifo}; sleep 100000 & sleep 100000"], timeout_s=1.0)
    ends.join()
    assert (ran.status, found) == (None, [b""])


def test_a_program_says_what_it_did() -> None:
    ran = children.run(["sh", "-c", "cat; echo bad >&2; exit 3"], stdin=b"\xff\n")
    assert (ran.status, ran.raw, ran.out, ran.err) == (3, b"\xff\n", "\ufffd\n", "bad\n")
    assert children.run(["sh", "-c", "kill -9 $$"]).status == -9
    with pytest.raises(OSError, match="no_such_program"):
        children.run(["no_such_program"])
    assert children.run([sys.executable, "-c", "bytearray(1 << 30)"], memory_mb=512).status == 1


# --- workers ---


def die(*_: object) -> None:
    assert multiprocessing.parent_process() is not None
    os._exit(0)


def end(status: int) -> None:
    if status < 0:
        signal.raise_signal(-status)
    os._exit(status)


TWO = """
input a : bool
table one {
  | line | a || procedures |
  |------|---||------------|
  | x    | true  || |
  | y    | false || |
}
table two {
  | line | a || procedures |
  |------|---||------------|
  | x    | true  || |
  | y    | false || |
}
"""


def test_a_worker_that_ends_without_an_answer_is_status_3(
    repo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(repo))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.rcs").write_text(TWO, encoding="utf-8")
    monkeypatch.setattr("rcsc.driver.proofs.WORTH_A_PROCESS", 0)
    with monkeypatch.context() as patched:
        patched.setattr("rcsc.proof.table.program._verdict", die)
        assert commands.run(["check", "--jobs", "2", "two.rcs"]) == 3
    assert "error[RCS904]: a worker process ended without an answer" in capsys.readouterr().err
    assert commands.run(["check", "--jobs", "2", "two.rcs"]) == 0
    assert "2 proved" in capsys.readouterr().out


@pytest.mark.parametrize("status", [0, 1, -9])
def test_a_worker_answers_or_is_said_to_have_ended(
    repo: Path, monkeypatch: pytest.MonkeyPatch, status: int
) -> None:
    monkeypatch.syspath_prepend(str(repo))
    with children.pool(1) as pool:
        assert children.answer(pool.submit(abs, -1)) == 1
        with pytest.raises(ZeroDivisionError):
            children.answer(pool.submit(divmod, 1, 0))
        with pytest.raises(children.WorkerEndedError):
            children.answer(pool.submit(end, status))
