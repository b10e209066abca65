"""Whether two levels that speak to each other declare the link between them alike, part by part.

In: a description, the programs of its levels. Out: nothing, or an error that shows both declarations where they differ. Types are held
against each other by their values, whatever they are called and whatever file declares them. Where one of two levels writes the protocol
by hand there is nothing to compare: that both ends of a buffer have the same fields is checked of every buffer (`system`, `compose`).
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.files import read
from rcsc.lang.model import Link, LinkPart, Program
from rcsc.run.description import BadDescription, Description


def check_links(system: Description, programs: Mapping[str, Program]) -> None:
    """Check every pair of levels that both declare their link.

    Raises:
        BadDescription: Two declarations of one link differ.
    """
    found = [each for pair in _pairs(system, programs) for each in _differences(*pair)]
    if found:
        spans = [label.span for each in found for label in (each.primary, *each.related)]
        files = dict.fromkeys(span.file for span in spans)
        raise BadDescription("", found, {file: Source(file, read.text(Path(file))) for file in files})


def _pairs(
    system: Description, programs: Mapping[str, Program]
) -> Iterator[tuple[tuple[str, Link], tuple[str, Link]]]:
    """Yield each superior and its subordinate, with the link as each declares it."""
    targets = {source: targets[0] for source, targets in system.readers().items()}  # an order has one reader
    for upper, program in programs.items():
        for role in program.roles.subordinates if program.roles is not None else ():
            lower, _, record = targets.get(f"{upper}.{role.order}", "").partition(".")
            roles = programs[lower].roles if lower in programs else None
            above = None if roles is None else roles.superior
            if (
                above is not None
                and above.order == record
                and role.link is not None
                and above.link is not None
            ):
                yield (upper, role.link), (lower, above.link)


def _differences(upper: tuple[str, Link], lower: tuple[str, Link]) -> Iterator[Diagnostic]:
    """Yield the first difference of two declarations, at the subordinate's: later ones may follow from it."""
    (superior, theirs), (subordinate, mine) = upper, lower
    their = {part.what: part for part in theirs.parts}
    own = {part.what: part for part in mine.parts}
    for what in [*own, *(what for what in their if what not in own)]:
        here, there = own.get(what), their.get(what)
        if (here and here.says) != (there and there.says):
            yield Diagnostic(
                Code.LINKS_DIFFER,
                f"`{subordinate}` declares the link to `{superior}` otherwise than `{superior}` does: {_said(what, here, there)}",
                Label((here or mine).span, f"`{subordinate}`: {here.says if here else 'none'}"),
                (Label((there or theirs).span, f"`{superior}`: {there.says if there else 'none'}"),),
                help=("declare the link once, in a file that both `use`",),
            )
            return


def _said(what: str, here: LinkPart | None, there: LinkPart | None) -> str:
    one, other = (f"`{part.says}`" if part else "none" for part in (here, there))
    return f"{what}: {one} against {other}"
