"""What a user of the studio waits for: `python -m tests.bench.studio [--scrubs 1000] [--minutes 0]`, in Chromium, on the paper's cell.

From a key to the finding in the grid of ACQUIRE, from the mouse to the levels of that tick while MAKE BOXT's log is scrubbed, frames
meanwhile, and memory of the page and of the server, at first and after so many minutes in which the system runs. Seconds hold on one
machine only; the frame that does nothing, measured in the same run, is what to hold them against.
"""

import argparse
import random
import resource
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from rcsc.desk.shell.opening import Opening
from rcsc.front.commands import run as rcsc
from tests.studio.driven import Seat, scrubbed, seated

SYSTEM = Path(__file__).parents[2] / "tables" / "system.toml"
IDLE_FRAMES = """new Promise((done) => {
  const seen = [];
  const look = (now) => {
    seen.push(now);
    if (seen.length > 120) done(seen.slice(1).map((one, at) => one - seen[at]));
    else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})"""
FINDINGS = "performance.getEntriesByName('studio.key to finding').map(({ duration }) => duration)"


def said(what: str, found_ms: Sequence[float]) -> None:
    """Prints a median and what 95 of 100 stay below."""
    ordered = sorted(found_ms)
    late = ordered[min(len(ordered) - 1, int(len(ordered) * 0.95))]
    print(
        f"{what:<44} median {statistics.median(ordered):7.1f} ms   95 % below {late:7.1f} ms   of {len(ordered)}"
    )


def scrub(log: Path, many: int) -> None:
    """Scrubs a log: every time the tick that is wanted is waited for; then without waiting, for frames."""
    with seated(Opening(SYSTEM, plant="kinematic", script="make_boxt"), logs=(log,)) as seat:
        seat.until(".view-run .ended", log.name)
        places = random.Random(1984)  # the same places each time
        said("a frame in which nothing is asked", seat.value(IDLE_FRAMES))
        before = seat.heap()
        waited = [how for _, how in scrubbed(seat, many, places)]
        said("mouse to levels of that tick", [after_ms for after_ms, _ in waited])
        said("  frames until then", [frames for _, frames in waited])
        began = time.perf_counter()
        list(scrubbed(seat, many, places, wait_every=many))
        seconds = time.perf_counter() - began
        print(f"{'as fast as the mouse moves':<44} {many / seconds:.0f} moves a second, the last one shown")
        print(f"{'page, before and after':<44} {before / 1e6:.1f} MB, {seat.heap() / 1e6:.1f} MB")


def edit(seat: Seat, many: int) -> None:
    """Writes into a cell of ACQUIRE and takes it back, and waits for what is found."""
    seat.press("2")
    seat.wait("document.querySelector('.table-choice')?.options.length")
    seat.choose(".table-choice", "acquire ")
    seat.until(".standing", "rests on an assumption")
    for at in range(many):
        wanted = "failed" if at % 2 == 0 else "rests on an assumption"
        seat.click('.sheet [data-line="5"][data-column="0"]')
        seat.press("f2", "ctrl+a")
        seat.write("true" if at % 2 == 0 else "false")
        seat.press("enter")
        seat.until(".standing", wanted)
    said("key to finding in the grid", seat.value(FINDINGS))


def main() -> None:
    """Prints what was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scrubs", type=int, default=1000)
    parser.add_argument("--edits", type=int, default=40)
    parser.add_argument("--minutes", type=float, default=0.0, help="how long the system runs")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "boxt.mcap")
        rcsc(["run", "make_boxt", "--plant", "kinematic", "--log", str(log)])
        scrub(log, given.scrubs)
    with seated(Opening(SYSTEM, plant="kinematic", script="make_boxt")) as seat:
        seat.until("#state", "paused at cycle 0")
        edit(seat, given.edits)
        seat.press("escape", "1", "space")
        before, until = seat.heap(), time.monotonic() + 60 * given.minutes
        while time.monotonic() < until:
            time.sleep(min(5.0, max(0.0, until - time.monotonic())))
            if "runs" not in seat.reads("#state"):
                seat.press("escape", "c")
                seat.write("run 100000")
                seat.press("enter", "escape")
        print(
            f"{'page, before and after running':<44} {before / 1e6:.1f} MB, {seat.heap() / 1e6:.1f} MB ({seat.reads('#state')})"
        )
    print(f"{'server, at most':<44} {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB")


if __name__ == "__main__":
    main()
