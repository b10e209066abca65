"""What stands outside the levels, to be looked at: in space by shapes and poses, and as a drawing.

In: questions of kind `cell.*`. Out: shapes once, the poses that bodies had after a tick, and a drawing of a tick. Poses are kept while the
system runs, for no log has them: of a log that is opened only what the levels' buffers say can be drawn.
"""

from array import array
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.session import Session
from rcsc.desk.studio.hub import Ask, Concern, Json
from rcsc.desk.studio.runs.live import LANE
from rcsc.desk.studio.runs.timeline import TimeLine
from rcsc.run.levels import RunningLevel, StateTableError
from rcsc.run.log.read import Log
from rcsc.run.plant.space import Space, space_of
from rcsc.run.system import System
from rcsc.views.pages.data import Drawing

MOST_KEPT = 50_000
"""Ticks whose poses are kept, half an hour at 40 ms; after them the older half is let go."""
MOST_TRACED = 1500
NO_SPACE = "what stands outside says nothing of how it looks in space: a plant has a method `space`, or is a model for MuJoCo"
NO_POSES = "a log holds no poses: only what buffers say is drawn"


class Drawer(Protocol):
    """Draws a tick of a log."""

    def __call__(self, log: Log, tick: int, *, projected: bool) -> Drawing:
        """Draw a tick: in perspective alone, or with three projections beside it.

        Raises:
            CodedError: It cannot be drawn, with the reason.
        """
        ...


@dataclass(slots=True)
class Poses:
    """The poses of bodies, by tick."""

    ticks: "array[int]"
    packed: list[bytes]

    def keep(self, tick: int, poses: bytes) -> None:
        """Keep the poses of a tick, in place of all from it on; poses equal to the last ones are not kept twice."""
        place = bisect_right(self.ticks, tick - 1)
        del self.ticks[place:], self.packed[place:]
        if not self.packed or self.packed[-1] != poses:
            self.ticks.append(tick)
            self.packed.append(poses)
        if len(self.ticks) > MOST_KEPT:
            del self.ticks[: MOST_KEPT // 2], self.packed[: MOST_KEPT // 2]

    def at(self, tick: int) -> bytes | None:
        """Return the latest poses up to a tick; None where they are kept no more."""
        place = bisect_right(self.ticks, tick) - 1
        return self.packed[place] if place >= 0 else None


class Scene(Concern):
    """Answers how it looks outside the levels; in the lane of the run."""

    name, lane = "cell", LANE

    def __init__(
        self, time: TimeLine, tell: Callable[[str, Json], None], drawer: Drawer | None = None
    ) -> None:
        """Args: time: Which run everybody looks at; tell: As `Hub.tell`; drawer: Draws ticks, where somebody can."""
        self._time, self._tell, self._drawer = time, tell, drawer
        self._poses = Poses(array("q"), [])
        self._space: Space | None = None
        self._pictured, self._why = False, NO_SPACE
        time.live.opened.append(self._opened)

    def greeting(self) -> Json:
        """Return whether there is a scene, with the reason if there is none, and whether drawings can be made."""
        return {
            "space": self._space is not None,
            "why": "" if self._space else self._why,
            "drawn": self._drawer is not None or self._pictured,
        }

    # --- the run ---

    def _opened(self, session: Session) -> None:
        self._poses = Poses(array("q"), [])
        try:
            self._space, self._why = space_of(session.system.outside), NO_SPACE
        except StateTableError as error:  # a method of the user's that is called so and does something else
            self._space, self._why = None, str(error)
        self._pictured = bool(_pictures(session.system))
        if self._space is not None:
            self._keep(session.system, ())
            session.system.watch.append(self._keep)
        self._tell("cell.state", self.greeting())

    def _keep(self, system: System, _: tuple[RunningLevel, ...]) -> None:
        space = space_of(system.outside)  # `undo` puts another object there
        if space is not None:
            self._poses.keep(system.tick, array("f", space.poses()).tobytes())

    # --- questions ---

    def _on_space(self, _: Ask) -> Json:
        if self._space is None:
            raise Refused(Code.STUDIO, self._why)
        return {"bodies": list(self._space.bodies), "shapes": [asdict(shape) for shape in self._space.shapes]}

    def _on_poses(self, ask: Ask) -> Json:
        tick = ask.body.whole("tick", 0, 2**53)
        if self._time.source.log is not None:
            raise Refused(Code.STUDIO, NO_POSES)
        held = self._poses.at(tick)
        if held is None:
            raise Refused(Code.STUDIO, f"the poses of tick {tick} are not kept any more")
        return {"tick": tick, "poses": [round(number, 5) for number in array("f", held)]}

    def _on_trace(self, ask: Ask) -> Json:
        """Return the path of a body up to a tick: points of three numbers, at most `MOST_TRACED` of them, at even distances."""
        tick, body = ask.body.whole("tick", 0, 2**53), ask.body.whole("body", 0, 100_000)
        if self._time.source.log is not None:
            raise Refused(Code.STUDIO, NO_POSES)
        held = self._poses.packed[: bisect_right(self._poses.ticks, tick)]
        apart = 1 + len(held) // MOST_TRACED
        shown = (array("f", poses)[7 * body : 7 * body + 3] for poses in held[::-apart])
        return {
            "tick": tick,
            "points": [[round(number, 5) for number in point] for point in shown if len(point) == 3],
        }

    def _on_drawing(self, ask: Ask) -> Json:
        history = self._time.history()
        tick = ask.body.whole("tick", history.first, history.last)
        return {"tick": tick, **self.drawing(tick, projected=ask.body.flag("projected"))}

    def kept(self) -> tuple[Space, Poses]:
        """Return what stands outside, and a copy of its poses that are kept.

        Raises:
            Refused: There is none, with the reason.
        """
        if self._space is None or self._time.source.log is not None:
            raise Refused(Code.STUDIO, NO_POSES if self._space else self._why)
        return self._space, Poses(self._poses.ticks[:], self._poses.packed[:])

    def drawing(self, tick: int, *, projected: bool) -> dict[str, Any]:
        """Draw a tick of the run that everybody looks at: `svg`, and `caption`, a sentence each.

        Raises:
            CodedError: It cannot be drawn, with the reason.
        """
        history = self._time.history()
        if self._drawer is None:
            return {"svg": self._picture(tick), "caption": []}
        drawing = self._drawer(history.stood_at(tick), tick, projected=projected)
        return {"svg": drawing.svg, "caption": list(drawing.caption)}

    def _picture(self, tick: int) -> str:
        """Return the plant's own picture, which exists for the present tick alone."""
        if not self._pictured or self._time.source.log is not None:
            raise Refused(Code.STUDIO, "nothing here could be drawn of a log")
        system = self._time.live.session().system
        if tick != system.tick:
            raise Refused(Code.STUDIO, f"the plant's picture is of now, cycle {system.tick}")
        return next(iter(_pictures(system).values()))()


def _pictures(system: System) -> Mapping[str, Callable[[], str]]:
    """Return the functions that draw the plants, by kind of picture."""
    return {kind: draw for part in system.outside for kind, draw in getattr(part, "pictures", {}).items()}
