"""What `rcsc explain` prints."""

from textwrap import fill

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.explanations import Explanation, explain, explanations

_STAGES = {
    "1": "syntax and files",
    "2": "names and writers",
    "3": "kinds, units and ranges",
    "4": "proof",
    "5": "generated files",
    "6": "tests of what is generated",
    "7": "running systems and recorded runs",
    "9": "bugs in rcsc",
}


def explanation(code: Code) -> str:
    """One code's page."""
    found = explain(code)
    paragraphs = "\n\n".join(fill(one, 90) for one in found.text.split("\n\n"))
    parts = [f"{code.value}: {found.title}\n", paragraphs + "\n", *_examples(found)]
    return "\n".join(parts)


def _examples(found: Explanation) -> list[str]:
    heads = (("This is reported:", found.wrong), ("This is not:", found.right))
    return [f"{head}\n\n{_indented(text)}" for head, text in heads if text]


def _indented(text: str) -> str:
    return "".join(f"    {line}\n" if line else "\n" for line in text.splitlines())


def listing() -> str:
    """Every code with its title, by stage."""
    lines: list[str] = []
    stage = ""
    for code, found in explanations().items():
        if code.value[3] != stage:
            stage = code.value[3]
            lines.append(f"{'' if not lines else chr(10)}{stage}xx {_STAGES[stage]}")
        lines.append(f"  {code.value}  {found.title}")
    return "\n".join(lines) + "\n\n`rcsc explain CODE` says more.\n"
