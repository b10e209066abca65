"""What stands outside, drawn of a log: what a page asks of who can draw it."""

from typing import Protocol


class Drawing(Protocol):
    """A picture of a tick."""

    @property
    def svg(self) -> str:
        """The document."""
        ...

    @property
    def caption(self) -> tuple[str, ...]:
        """Notes on it, a sentence each."""
        ...


class Cell(Protocol):
    """What stands outside the levels of a log."""

    @property
    def data(self) -> str:
        """What the file is called that says where things are."""
        ...

    def drawn(self, tick: int, *, projected: bool = False) -> Drawing:
        """Draw a tick: in perspective alone, or in three projections with it."""
        ...
