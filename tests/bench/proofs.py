"""Proof times by size, beside other ways to decide the same tables: `python -m tests.bench.proofs [--large] [--limit S]`.

Times are of the proof alone, from the resolved table; `resolve` is from text to table, `certify` the checker's. Every answer is
compared with how the table was made.
"""

import argparse
import multiprocessing
import resource
import time
from collections.abc import Callable

from rcsc.base.diagnostics.source import Source
from rcsc.lang.model import Program
from rcsc.lang.resolve import compile_text
from rcsc.lang.syntax.parse import parse
from rcsc.proof.certify import check_certificate
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.certificate import program_certificate
from rcsc.proof.table.decide import prove_table
from tests.bench.made import families
from tests.bench.made.families import Fault
from tests.bench.made.peers import PEERS

SIZES = ((16, 7), (64, 7), (256, 7), (256, 20), (1024, 20), (1024, 50), (4096, 20))
LARGE = ((16384, 20), (16384, 50))
LINEAR = ((16, 4), (64, 4), (256, 6), (1024, 6))


def compiled(text: str) -> Program:
    """The program of a generated text."""
    program = compile_text(text)
    assert isinstance(program, Program), program[:3]
    return program


def ours(family: str, lines: int, variables: int, fault: Fault, solver: str) -> str:
    """One row of the first table."""
    text = getattr(families, family)(lines, variables, lines + variables, fault)
    parse(Source("", ""))
    begun = time.perf_counter()
    program = compiled(text)
    read = time.perf_counter() - begun
    [table] = program.tables
    options = Options(solver="both" if solver == "both" else "boxes")
    begun = time.perf_counter()
    verdict = prove_table(program, table, options)
    proved = time.perf_counter() - begun
    wrong = bool(verdict.findings)
    assert wrong == (fault != "ok"), (family, lines, variables, fault, verdict.findings[:2])
    checked = "-"
    if verdict.certificate is not None:
        certificate = program_certificate(program, [verdict.certificate])
        begun = time.perf_counter()
        assert not check_certificate(program, certificate)
        checked = f"{time.perf_counter() - begun:.3f}"
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    return f"{family:7}{lines:7}{variables:5}  {fault:8}{read:9.3f}{proved:9.4f}{checked:>9}{peak:8}  {verdict.backing.method}"


def _apart(answer: "multiprocessing.Queue[str]", work: Callable[..., str], *args: object) -> None:
    answer.put(work(*args))


def limited(seconds: float, work: Callable[..., str], *args: object) -> str:
    """The work's text from a process of its own; `-` where it does not end in time."""
    context = multiprocessing.get_context("fork")
    answer: multiprocessing.Queue[str] = context.Queue()
    process = context.Process(target=_apart, args=(answer, work, *args))
    process.start()
    process.join(seconds)
    if process.is_alive():
        process.kill()
        process.join()
        return "-"
    return answer.get(timeout=5) if process.exitcode == 0 else "failed"


def peer_time(number: int, family: str, lines: int, variables: int) -> str:
    program = compiled(getattr(families, family)(lines, variables, lines + variables))
    peer = PEERS[number]
    begun = time.perf_counter()
    right = peer.decide(program, program.tables[0])
    spent = time.perf_counter() - begun
    return f"{spent:.3f}" if right else "WRONG"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--large", action="store_true", help="16,384 lines too")
    arguments.add_argument("--limit", type=float, default=20.0, help="seconds for each peer and table")
    arguments.add_argument("--no-peers", action="store_true")
    given = arguments.parse_args()
    print("family   lines vars  made     resolve    proof  certify  MB      by")
    for lines, variables in (*SIZES, *(LARGE if given.large else ())):
        for fault in ("ok", "overlap", "gap"):
            print(limited(600, ours, "box", lines, variables, fault, "boxes"), flush=True)
    for lines, variables in LINEAR:
        for fault in ("ok", "overlap", "gap"):
            print(limited(600, ours, "linear", lines, variables, fault, "boxes"), flush=True)
    if given.no_peers:
        return
    print(
        "\nproof times in s; - is over the limit\n"
        f"{'family':7}{'lines':>7}{'vars':>5}" + "".join(f"{p.name:>20}" for p in PEERS)
    )
    for family, sizes in (("box", SIZES), ("linear", LINEAR)):
        for lines, variables in sizes:
            cells = [
                limited(given.limit, peer_time, at, family, lines, variables)
                if peer.relational or family == "box"
                else ""
                for at, peer in enumerate(PEERS)
            ]
            print(f"{family:7}{lines:7}{variables:5}" + "".join(f"{cell:>20}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
