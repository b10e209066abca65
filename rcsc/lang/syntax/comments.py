"""Comments of one text, handed to the nodes they stand with.

A comment goes with the node that begins next, or, after a node on its line, with that node.
Each is handed out once; what nobody takes is the file's.
"""

import re

from rcsc.base.diagnostics.source import Source

_TOKEN = re.compile(r'"[^"\\\n]*"|#[^\r\n]*')


class Comments:
    """The comments of `source`, in order; each stays until it is taken."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._waiting: list[tuple[int, str]] = []
        for match in _TOKEN.finditer(source.text):
            if match.group().startswith("#"):
                self._waiting.append((match.start(), match.group().rstrip()))

    def _line(self, offset: int) -> int:
        return self._source.position(offset).line

    def take(self, start: int) -> tuple[str, ...]:
        """Take comments before offset `start`, or after it on the same line."""
        if not self._waiting:
            return ()
        line = self._line(start)
        count = 0
        while count < len(self._waiting):
            offset = self._waiting[count][0]
            if offset > start and self._line(offset) != line:
                break
            count += 1
        taken = self._waiting[:count]
        del self._waiting[:count]
        return tuple(text for _, text in taken)

    def rest(self) -> tuple[str, ...]:
        """Take the comments that are left."""
        return self.take(1 << 62)


def words(comment: str) -> str:
    """Return the text of a comment, without its marks and the space after them."""
    return comment.lstrip("#").removeprefix(" ").rstrip()


def split(comments: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the plain comments and the texts of doc lines (`##`), from the comments before a declaration."""
    plain = tuple(words(text) for text in comments if not text.startswith("##"))
    doc = tuple(words(text) for text in comments if text.startswith("##"))
    return plain, doc
