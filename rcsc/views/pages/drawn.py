"""What stands outside, drawn of a log: what a page asks of who can draw it."""

from typing import Protocol


class Drawing(Protocol):
    """A picture of a tick."""

    @property
    def svg(self) -> str:
        """The picture as an SVG document."""
        ...

    @property
    def caption(self) -> tuple[str, ...]:
        """Notes on it, a sentence each."""
        ...


class DrawnCell(Protocol):
    """The world outside the levels of a log."""

    @property
    def data(self) -> str:
        """The name of the file with the places of things."""
        ...

    def drawn(self, tick: int, *, projected: bool = False) -> Drawing:
        """Draw a tick: in perspective alone, or in three projections with it."""
        ...
