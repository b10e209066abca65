"""Errors of users, files and machines, not of rcsc: each knows its code, so that one place shows them."""

from rcsc.diagnostics.codes import Code


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
