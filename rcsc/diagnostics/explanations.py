"""What `rcsc explain CODE` says: a title, a paragraph and, where a text can show it, an example and its mend.

In: `explanations.md` beside this file. Out: an `Explanation` a code. A test runs every example.
"""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rcsc.diagnostics.codes import Code

_SECTION = re.compile(r"^# (?P<code>RCS\d{3}): (?P<title>.+)$", re.MULTILINE)
_EXAMPLE = re.compile(r"^```rcs (?P<kind>wrong|right)\n(?P<text>.*?)^```$\n?", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Explanation:
    """One code, explained.

    Attributes:
        title: What it is, in a few words, in lower case.
        text: Why it is reported, what to do, and how it arises where there is no example.
        wrong: A whole source text that is reported with this code and no other; may be empty.
        right: The same, mended; may be empty.
    """

    code: Code
    title: str
    text: str
    wrong: str
    right: str


def explain(code: Code) -> Explanation:
    """The explanation of `code`."""
    return explanations()[code]


@cache
def explanations() -> dict[Code, Explanation]:
    """Every code's explanation, in order of codes."""
    page = Path(__file__).with_name("explanations.md").read_text(encoding="utf-8")
    heads = list(_SECTION.finditer(page))
    ends = [head.start() for head in heads[1:]] + [len(page)]
    found = {}
    for head, end in zip(heads, ends, strict=True):
        body = page[head.end() : end]
        examples = {example["kind"]: example["text"] for example in _EXAMPLE.finditer(body)}
        code = Code(head["code"])
        text = _EXAMPLE.sub("", body).strip()
        found[code] = Explanation(
            code, head["title"], text, examples.get("wrong", ""), examples.get("right", "")
        )
    return {code: found[code] for code in Code}
