"""Errors of users, files and machines, not of rcsc: each knows its code, so that one place shows them."""

from rcsc.base.diagnostics.codes import Code


class CodedError(Exception):
    """What a user, a file or a machine did wrong; says what.

    Attributes:
        code: What `rcsc explain` has a page about.
        helps: What would help.
    """

    code: Code = Code.BAD_SYSTEM
    helps: tuple[str, ...] = ()

    @property
    def shown(self) -> str:
        """What is wrong, a line each."""
        return str(self)


USERS_FAILURES = (Exception, SystemExit, GeneratorExit)
"""What code of the user's may raise as it is called, and that ends a cycle and not rcsc; an interrupt is the user's own."""


def raised(error: BaseException) -> str:
    """Return what was raised, in words: its class, and what it says of itself."""
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
