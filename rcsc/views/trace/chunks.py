"""A text of C cut into what stands at file scope, each with the comment above it: read as a reviewer reads it.

In: the text of a generated file. Out: chunks, which leave out only blank lines. Nothing here knows how the text was made, so that
what is said of it does not rest on the emitter's own word.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_NAME_OF_FUNCTION = re.compile(r"(\w+)\s*\(")
_NAME_OF_TYPE = re.compile(r"(\w+)(?:\[[^\]]*\])*\s*;\s*$")


@dataclass(frozen=True, slots=True)
class Chunk:
    """Something at file scope.

    Attributes:
        first: Number of its first line, from 1, comment included; `last` of its last.
        comment: The words of the comment directly above it.
        code: Its lines without their comments, beginning with the first that has code; as long as the lines that they stand in.
        begin: Number of the line where `code` begins.
    """

    first: int
    last: int
    comment: str
    code: tuple[str, ...]
    begin: int

    @property
    def text(self) -> str:
        """Its code in one line."""
        return " ".join(line.strip() for line in self.code if line.strip())

    @property
    def is_directive(self) -> bool:
        """Whether it is for the preprocessor."""
        return self.text.startswith("#")

    @property
    def function(self) -> str:
        """The name of the function that it defines or declares; empty where it is none."""
        head = self.text.partition("{")[0]
        found = _NAME_OF_FUNCTION.search(head)
        return (
            found[1]
            if found and not head.startswith(("typedef", "enum", "#", "struct")) and "=" not in head
            else ""
        )

    @property
    def declared(self) -> str:
        """The name of the type or constant that it declares; empty where it is none."""
        if self.text.startswith("typedef"):
            found = _NAME_OF_TYPE.search(self.text)
            return found[1] if found else ""
        found = re.search(r"(\w+)(?:\s*\[[^\]]*\])*\s*=", self.text)
        return found[1] if found and self.text.startswith(("static", "const")) else ""


def chunks(text: str) -> Iterator[Chunk]:
    r"""Give what stands at file scope, in order.

    >>> [(c.first, c.last, c.function or c.text) for c in chunks("/* f */\nint f(void)\n{\n}\n\n#endif\n")]
    [(1, 4, 'f'), (6, 6, '#endif')]
    """
    whole, bare = text.splitlines(), _without_comments(text)
    first, begin, depth = 0, 0, 0
    for at, code in enumerate(bare, 1):
        if not begin:
            if not whole[at - 1].strip():
                if first:  # a comment that stands alone
                    yield _chunk(whole, bare, first, at - 1, at)
                first = 0
                continue
            first = first or at
            if not code.strip():
                continue
            begin = at
        if not code.lstrip().startswith("#"):
            depth += code.count("{") - code.count("}")
        if _ends(code, depth, begin == at, bare, at):
            yield _chunk(whole, bare, first, at, begin)
            first, begin, depth = 0, 0, 0
    if first:
        yield _chunk(whole, bare, first, len(whole), begin or len(whole) + 1)


def _ends(code: str, depth: int, alone: bool, bare: list[str], at: int) -> bool:
    """Whether what is begun ends with this line."""
    text = code.strip()
    if alone and (text.startswith("#") or text in {'extern "C" {', "}"}):
        return not text.endswith("\\")
    if bare[at - 1].strip().startswith("#") or depth > 0:
        return False
    return text.endswith((";", "}"))


def _chunk(whole: list[str], bare: list[str], first: int, last: int, begin: int) -> Chunk:
    said = " ".join(line.strip() for line in whole[first - 1 : min(begin, last + 1) - 1])
    words = " ".join(said.replace("/*", " ").replace("*/", " ").split())
    return Chunk(first, last, words, tuple(bare[begin - 1 : last]), begin)


def _without_comments(text: str) -> list[str]:
    """The lines with every comment made blank."""
    return _COMMENT.sub(lambda comment: re.sub(r"[^\n]", " ", comment[0]), text).splitlines()
