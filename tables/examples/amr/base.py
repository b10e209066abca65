"""The AMR's base, lift, shelves, battery and charger, in one lane."""

from typing import Annotated, Literal

from rcsc.run.plant import Fault, Property, Range

SHELF = 2000


class Base:
    """Attributes are the ends of `[buffers]` that begin with `base`."""

    speed: Annotated[int, Range(-1000, 1000)] = 0
    motor: Literal["hold", "raise", "lower"] = "hold"

    position: Annotated[float, Range(0, 20, "m")] = 0.0
    path_blocked: bool = False
    bumper: bool = False
    localised: bool = True
    estop: bool = False
    reset: bool = False
    top: bool = False
    bottom: bool = True
    load: Annotated[int, Range(0, 1000)] = 0
    shelf: bool = False
    battery: Annotated[float, Range(0, 100)] = 80.0
    contact: bool = False

    person_in_lane: Fault = False
    lift_jams: Fault = False
    heavy_shelf: Fault = False
    estop_pressed: Fault = False
    lost: Fault = False
    battery_dying: Fault = False

    def __init__(self) -> None:
        self.height = 0.0
        self.carried = False
        self.moved_together = False
        self.shelf_at = 3.5  # shelf 1

    def step(self, seconds: float) -> None:
        """One tick."""
        moves = self.speed != 0
        lifts = self.motor != "hold"
        if moves and lifts:
            self.moved_together = True
        self.position = min(max(self.position + self.speed / 1000 * seconds, 0.0), 20.0)
        if not self.lift_jams:
            if self.motor == "raise":
                self.height = min(self.height + 0.4 * seconds, 1.0)
            elif self.motor == "lower":
                self.height = max(self.height - 0.4 * seconds, 0.0)
        self.top, self.bottom = self.height >= 0.999, self.height <= 0.001
        under = abs(self.position - self.shelf_at) < 0.05
        if self.height > 0.5 and under:
            self.carried = True
        if self.height < 0.2:
            self.carried = False
        if self.carried:
            self.shelf_at = self.position
        self.shelf = self.carried
        self.load = (600 if self.heavy_shelf else 300) if self.carried else 0
        self.contact = abs(self.position - 0.5) < 0.05
        drain = 2.0 if self.battery_dying else 0.02 + (0.05 if moves else 0.0)
        self.battery = min(
            max(self.battery + (5.0 if self.contact and not moves else -drain) * seconds, 0.0), 100.0
        )
        self.path_blocked = bool(self.person_in_lane)
        self.estop = bool(self.estop_pressed)
        self.reset = not self.estop_pressed
        self.localised = not self.lost

    def p1_never_together(self) -> Property:
        """P1, across both siblings."""
        return not (self.speed != 0 and self.motor != "hold")
