"""Errors of users, files and machines, not of rcsc: each knows its code, so that one place shows them."""

from rcsc.base.diagnostics.codes import Code


class CodedError(Exception):
    """A mistake of a user, or a fault of a file or a machine; the text describes it.

    Attributes:
        code: The code under which `rcsc explain` describes it.
        helps: Help texts.
    """

    code: Code = Code.BAD_SYSTEM
    helps: tuple[str, ...] = ()

    @property
    def shown(self) -> str:
        """The message, which may have several lines."""
        return str(self)


class Refused(CodedError):  # noqa: N818  # what happened, not an error of ours
    """Something that was asked for, and is not done; says why."""

    def __init__(self, code: Code, message: str, *helps: str) -> None:
        super().__init__(message)
        self.code, self.helps = code, helps

    def __reduce__(self) -> tuple[object, ...]:
        """Come whole out of another process."""
        return Refused, (self.code, str(self), *self.helps)


USERS_FAILURES = (Exception, SystemExit, GeneratorExit)
"""Exceptions of the user's code that end a cycle, and not rcsc; an interrupt is the user's own."""


def raised(error: BaseException) -> str:
    """Return the class of an exception and its message."""
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
