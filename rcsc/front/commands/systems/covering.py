"""What `rcsc prove --coverage` says: what each requirement needs, what none speaks of, and which slips nothing notices."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import click

from rcsc.base.diagnostics.report import named
from rcsc.base.diagnostics.source import Sources
from rcsc.code.testing.figures import counted
from rcsc.compose.contract.claims import Key
from rcsc.compose.coverage.cores import Core
from rcsc.compose.coverage.covered import Coverage
from rcsc.compose.coverage.parts import Part, Use
from rcsc.compose.coverage.slips import Fate, Judged

MOST = 40
"""Places that are listed under one heading; the rest are counted, and stand in the JSON."""


def lines_of(coverage: Coverage, sources: Sources) -> Iterator[str]:
    """Yield what is to be printed of the coverage of a level."""
    title = click.style(f"coverage of level {coverage.level}", bold=True)
    if not coverage.requirements and not coverage.across:
        own = (
            "stated of it"
            if coverage.across is not None
            else "its own; those across levels were not looked at"
        )
        yield f"{title}  no property and no requirement is {own}: none speaks of any line"
        return
    across = f", and {len(coverage.across)} across levels" if coverage.across else ""
    yield f"{title}  {counted(coverage.requirements, 'requirement')}{across}"
    for key in coverage.unproved:
        yield f"  {_word(key)} is not proved: what it needs is not known"
    for key in coverage.again:
        yield f"  {_word(key)}: Z3 did not show it once more within its steps: what it needs is not known"
    for core in coverage.cores:
        yield from _core(core, sources)
    for name, uses in coverage.across or ():
        yield from _of_across(name, uses, sources)
    if coverage.cores or any(uses is not None for _, uses in coverage.across or ()):
        who = "no requirement" if coverage.complete else "none of these requirements"
        yield from _told(f"{who} speaks of", _places(coverage.silent, sources))
        yield from _told(
            "assumptions that no requirement needs", (f"`{one}`" for one in coverage.assumptions)
        )
    yield from _slips(coverage, sources)


def _word(key: Key) -> str:
    return f"{key[0]} `{key[2]}`"


def _core(core: Core, sources: Sources) -> Iterator[str]:
    few = ", no fewer" if core.minimal else "; whether fewer suffice is not known"
    yield f"  {_word(core.key)} needs {_counted(core.uses)}{few}"
    yield from _uses(core.uses, sources)
    if core.assumptions:
        yield f"    assuming {named([f'`{name}`' for name in core.assumptions])}"


def _of_across(name: str, uses: Sequence[Use] | None, sources: Sources) -> Iterator[str]:
    """Yield what a requirement across levels needs of one."""
    if uses is None:
        yield f"  requirement `{name}` across levels: what it needs is not known"
        return
    few = "; whether fewer suffice is not known" if uses else ""
    yield f"  requirement `{name}` across levels needs {_counted(uses) if uses else 'no assignment'} of it{few}"
    yield from _uses(uses, sources)


def _counted(uses: Sequence[Use]) -> str:
    return counted(len({use.part for use in uses}), "assignment")


def _uses(every: Sequence[Use], sources: Sources) -> Iterator[str]:
    """Yield the lines in which uses are, and what procedures write there."""
    inside = dict[str, list[Use]]()
    for use in every:
        inside.setdefault(use.table, []).append(use)
    for table, uses in inside.items():
        names = dict.fromkeys(use.line for use in uses)
        what = f"table {table}" if table else "in every cycle"
        yield f"    {what}: {', '.join(names)}"
    if written := dict.fromkeys(use.part for use in every if use.part.procedure):
        texts = dict.fromkeys(f"{part.procedure}: {_text(part, sources)}" for part in written)
        yield f"    of procedures {'; '.join(texts)}"


def _told(heading: str, every: Iterable[str]) -> Iterator[str]:
    rows = list(every)
    if rows:
        yield f"  {heading}"
        yield from (f"    {row}" for row in rows[:MOST])
        if len(rows) > MOST:
            yield f"    and {len(rows) - MOST} more: all with --json"


def _places(uses: Iterable[Use], sources: Sources) -> Iterator[str]:
    """Yield a row for each part, with the lines that use it."""
    parts = dict[Part, list[Use]]()
    for use in uses:
        parts.setdefault(use.part, []).append(use)
    for part, used in parts.items():
        yield f"{_place(part, sources)}: {_stands(used, sources)}"


def _stands(uses: Sequence[Use], sources: Sources) -> str:
    """Return an assignment in words: what, and where it is run."""
    part = uses[0].part
    lines = named([f"`{use.line}` of `{use.table}`" for use in uses if use.table])
    text = _text(part, sources)
    if part.procedure:
        run_by = f", run by {'lines' if len(uses) > 1 else 'line'} {lines}" if lines else ""
        return f"`{text}` of procedure `{part.procedure}`{run_by}"
    return f"`{text}` in line {lines}{'' if len(part.leaves) > 1 else f', of `{part.leaves[0]}`'}"


def _text(part: Part, sources: Sources) -> str:
    """Return what is written there, in one line."""
    source = sources.get(part.span.file)
    written = "" if source is None else " ".join(source.slice(part.span).split())
    return written or ", ".join(part.leaves)


def _place(part: Part, sources: Sources) -> str:
    source = sources.get(part.span.file)
    return part.span.file if source is None else f"{part.span.file}:{source.position(part.span.start).line}"


def _slips(coverage: Coverage, sources: Sources) -> Iterator[str]:
    offered = {each.slip: each.text for each in coverage.offers}
    surviving = [(at, one) for at, one in enumerate(coverage.slips) if one.fate is Fate.SURVIVES]
    if surviving:
        yield "  what can be left out, and everything that is proved of the level still holds"
    for at, one in surviving[:MOST]:
        yield f"    {_slip(one, sources)}"
        if at in offered:
            yield f"      would be noticed by  {offered[at]}"
    if len(surviving) > MOST:
        yield f"    and {len(surviving) - MOST} more: all with --json"
    left_open = (_slip(one, sources) for one in coverage.slips if one.fate is Fate.OPEN)
    yield from _told("not known whether it is noticed if left out", left_open)
    fates = [one.fate for one in coverage.slips]
    if fates:
        yield (
            f"  {counted(len(fates), 'slip')} tried: {fates.count(Fate.NOTICED)} noticed, {fates.count(Fate.SURVIVES)} not,"
            f" {fates.count(Fate.CHANGES_NOTHING)} without effect, {fates.count(Fate.OPEN)} open"
        )


def _slip(one: Judged, sources: Sources) -> str:
    first = next((use for use in one.slip.uses if not use.part.procedure), one.slip.uses[0])
    if one.slip.whole_line:
        return f"{_place(first.part, sources)}: all that line `{first.line}` of `{first.table}` does"
    return f"{_place(first.part, sources)}: {_stands(one.slip.uses, sources)}"


# --- as JSON ---------------------------------------------------------------------------------


def coverage_as_json(coverage: Coverage, sources: Sources) -> dict[str, Any]:
    """Return the coverage of a level as JSON has it."""
    offered = {each.slip: each.text for each in coverage.offers}
    return {
        "requirements": coverage.requirements,
        "not_proved": [_word(key) for key in coverage.unproved],
        "not_shown_again": [_word(key) for key in coverage.again],
        "needs": [
            {
                "what": core.key[0],
                "name": core.key[2],
                "assignments": [_use_as_json(use, sources) for use in core.uses],
                "assumptions": list(core.assumptions),
                "minimal": core.minimal,
            }
            for core in coverage.cores
        ],
        "across_levels": [
            {
                "name": name,
                "assignments": None if uses is None else [_use_as_json(use, sources) for use in uses],
            }
            for name, uses in coverage.across or ()
        ],
        "no_requirement_speaks_of": [_use_as_json(use, sources) for use in coverage.silent],
        "assumptions_not_needed": list(coverage.assumptions),
        "slips": [
            {
                "whole_line": one.slip.whole_line,
                "left_out": [_use_as_json(use, sources) for use in one.slip.uses],
                "fate": one.fate.value,
                "noticed_by": [{"what": sort, "table": table, "name": name} for sort, table, name in one.by],
                "offer": offered.get(at),
            }
            for at, one in enumerate(coverage.slips)
        ],
    }


def _use_as_json(use: Use, sources: Sources) -> dict[str, Any]:
    return {
        "place": _place(use.part, sources),
        "text": _text(use.part, sources),
        "procedure": use.part.procedure or (use.line if not use.table else ""),
        "table": use.table,
        "line": use.line if use.table else "",
        "writes": list(use.part.leaves),
    }
