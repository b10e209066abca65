"""Two carts on rails, and one switch."""

from typing import Annotated

from rcsc.run.plant import Fault, Range


class Base:
    left_speed: Annotated[int, Range(-1000, 1000)] = 0
    right_speed: Annotated[int, Range(-1000, 1000)] = 0
    left_mm: Annotated[float, Range(0, 1.0, "m")] = 0.0
    right_mm: Annotated[float, Range(0, 1.0, "m")] = 0.0
    estop: bool = False
    pressed: Fault = False

    def step(self, seconds: float) -> None:
        self.left_mm = min(max(self.left_mm + self.left_speed / 1000 * seconds, 0.0), 1.0)
        self.right_mm = min(max(self.right_mm + self.right_speed / 1000 * seconds, 0.0), 1.0)
        self.estop = bool(self.pressed)
