"""`rcsc explain`: what a code means."""

from textwrap import fill, indent

import click

from rcsc.base.diagnostics.codes import FAMILIES, Code, CodeText


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
    if wanted not in {known.value for known in Code}:
        raise click.BadParameter(f"there is no {wanted}; `rcsc explain` lists the codes", param_hint="CODE")
    click.echo(_page(Code(wanted)), nl=False)
    return 0


def _page(code: Code) -> str:
    """Return the page of one code."""
    explanation = code.explanation
    blocks = explanation.text.split("\n\n")
    paragraphs = [block if block.startswith(" ") else fill(block, 90) for block in blocks]
    return "\n\n".join([f"{code.value}: {explanation.title}", *paragraphs, *_examples(explanation)]) + "\n"


def _examples(explanation: CodeText) -> list[str]:
    shown: list[str] = []
    if explanation.wrong:
        shown += ["This is reported:", _indented(explanation.wrong), fill(explanation.report, 90)]
    if explanation.right:
        shown += ["This is not:", _indented(explanation.right)]
    return shown


def _indented(text: str) -> str:
    return indent(text.rstrip("\n"), "    ")


def _listing() -> str:
    """Return every code with its title, by family."""
    families = [
        "\n".join(
            [f"{digit}xx {about}"]
            + [f"  {code.value}  {code.explanation.title}" for code in Code if code.value[3] == digit]
        )
        for digit, about in FAMILIES.items()
    ]
    return "\n\n".join([*families, "`rcsc explain CODE` says more.\n"])
