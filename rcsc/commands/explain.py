"""`rcsc explain`: what a code means."""

from textwrap import fill

import click

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.explanations import Explanation, explain, explanations


@click.command(
    "explain",
    epilog="\b\nExamples:\n  rcsc explain           list the codes\n  rcsc explain RCS402",
)
@click.argument("code", required=False)
def command(code: str | None) -> int:
    """Say what a finding's CODE means, with an example; without CODE list them all."""
    if code is None:
        click.echo(_listing(), nl=False)
        return 0
    wanted = code.upper() if code.upper().startswith("RCS") else f"RCS{code}"
    if wanted not in {one.value for one in Code}:
        raise click.BadParameter(f"there is no {wanted}; `rcsc explain` lists the codes", param_hint="CODE")
    click.echo(_page(Code(wanted)), nl=False)
    return 0


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


def _page(code: Code) -> str:
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


def _listing() -> str:
    """Every code with its title, by stage."""
    lines: list[str] = []
    stage = ""
    for code, found in explanations().items():
        if code.value[3] != stage:
            stage = code.value[3]
            lines.append(f"{'' if not lines else chr(10)}{stage}xx {_STAGES[stage]}")
        lines.append(f"  {code.value}  {found.title}")
    return "\n".join(lines) + "\n\n`rcsc explain CODE` says more.\n"
