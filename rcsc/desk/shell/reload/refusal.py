"""Why a command was not done."""

from rcsc.base.diagnostics.codes import Code


class Refused(Exception):  # noqa: N818  # what happened, not an error of ours
    """A command of the shell failed; says why, with a code.

    Attributes:
        helps: How to go on.
    """

    def __init__(self, code: Code, message: str, *helps: str) -> None:
        super().__init__(message)
        self.code, self.helps = code, helps

    def __reduce__(self) -> tuple[object, ...]:
        """Come whole out of another process."""
        return Refused, (self.code, str(self), *self.helps)
