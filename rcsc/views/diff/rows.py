"""A difference as rows of text and as Markdown for a review comment.

In: a `Difference`. Out: the same things said in each form (JSON: `jsonform`); the same difference gives the same text on every machine.
"""

from collections.abc import Iterator, Sequence

from rcsc.base.diagnostics.printable import escape
from rcsc.base.diagnostics.render import Row, Style, TextPiece
from rcsc.views.diff.changes.align import Declaration
from rcsc.views.diff.changes.difference import (
    Basis,
    Change,
    ComparedPart,
    Difference,
    Follows,
    PartSort,
    ProgramDifference,
    Traces,
    Transition,
    Value,
    Where,
)

MOST_TRANSITIONS = 6
"""Steps of one level that are shown in full; JSON has all."""
_EVERYWHERE = "every input"


# --- in words ----------------------------------------------------------------------------


def headline(difference: Difference) -> str:
    """Return one line: how many tables and other parts changed."""
    parts = [part for _, part in difference.parts()]
    tables = [part for part in parts if part.what == "table"]
    changed = [part for part in tables if part.changed]
    same = len(tables) - len(changed)
    if difference.undecided:
        lead = "not decided"
    elif not difference.changed:
        lead = "same meaning"
    else:
        lead = f"{_count(len(changed), 'table')} changed"
    others = [part for part in parts if part.what != "table" and part.changed]
    clauses = [lead, f"{same} as before, proved" if tables and not difference.undecided else ""]
    clauses += [f"{_count(len(others), 'other part')} changed" if others else ""]
    moved = sum(len(part.moved) for part in parts)
    clauses.append(f"{_count(moved, 'region')} with another line to the same effect" if moved else "")
    declared = sum(len(program.declarations) for program in difference.programs)
    clauses.append(f"{_count(declared, 'declaration')} changed" if declared else "")
    return "; ".join(clause for clause in clauses if clause)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _boxes(where: Where) -> list[str]:
    """Return each box as one text."""
    return [", ".join(words) or _EVERYWHERE for words in where.words]


def _inputs(where: Where) -> str:
    if where.inputs is None or where.inputs[1] == 1:
        return ""
    return f"{where.inputs[0]} of {where.inputs[1]} inputs"


def _besides(where: Where) -> str:
    """Return the rest of a region that its boxes alone do not state."""
    if where.also:
        return (
            f"and there: {where.also}" if where.exact else f"part of the region, which is where: {where.also}"
        )
    return "" if where.exact else f"{len(where.boxes)} boxes of more"


def _input(change: Change) -> str:
    return ", ".join(f"{name} = {value}" for name, value in change.witness)


def _title(part: ComparedPart, change: Change) -> str:
    if change.sort is PartSort.CONDITION:
        return f"was {change.before}, is {change.after}"
    if part.what != "table":
        return "another effect"
    if change.before == change.after:
        return f"{change.before}: another effect"
    effect = {PartSort.EFFECT: ": another effect", PartSort.LINE: ": the same effect"}.get(change.sort, "")
    return f"{change.before} -> {change.after}{effect}"


def _left(value: Value) -> str:
    """`x: 1 -> 2`, in general or else at the least input."""
    general = f"{value.before} -> {value.after}" if value.before and value.after else ""
    at = f"{value.at[0]} -> {value.at[1]}" if all(value.at) else ""
    if not general and value.at[0] == value.at[1] and at:
        return f"differs elsewhere in the region (there {value.at[0]} in both)"
    if general and at and general != at and "unchanged" not in (value.before, value.after):
        return f"{general} (there {at})"
    return general or at or "is left otherwise"


def proof(part: ComparedPart) -> str:
    """Return the grounds on which nothing else changed."""
    if part.basis is Basis.DIGEST:
        return "the same, by digest"
    if part.basis is Basis.SOLVER:
        what = "nothing else changed" if part.changes or part.moved else "nothing changed"
        return f"proved: {what} ({_count(part.queries, 'question')} to Z3)"
    return "not compared"


def _shown(part: ComparedPart) -> bool:
    return part.changed or bool(part.moved) or part.basis is Basis.SOLVER


def _steps(steps: Sequence[Transition]) -> tuple[list[Transition], int]:
    """Return the steps that a trace from the first state leads to, and how many others there are."""
    reached = [step for step in steps if step.trace]
    return reached[:MOST_TRANSITIONS], len(steps) - min(len(reached), MOST_TRANSITIONS)


def _trace(step: Transition) -> str:
    return " ".join(f"{state} -{line}->" if line else state for state, line in step.trace)


# --- text --------------------------------------------------------------------------------


def rows(difference: Difference, *, quiet: bool = False) -> Iterator[Row]:
    """Yield the difference as text in styled pieces."""
    if not quiet:
        yield (TextPiece(f"{escape(difference.before)} -> {escape(difference.after)}", Style.STRONG),)
    for note in difference.notes:
        yield (TextPiece(f"  {escape(note)}", Style.WARNING),)
    for program in difference.programs:
        if _told(program):
            yield from _program(program)
    if not quiet:
        style = Style.ERROR if difference.undecided else Style.WARNING if difference.changed else Style.HELP
        yield (TextPiece(escape(headline(difference)), style),)


def _told(program: ProgramDifference) -> bool:
    """Return whether there is anything to report of a program."""
    shown = any(_shown(part) for part in program.parts)
    return bool(program.changed or program.undecided or program.requirements or shown)


def _program(program: ProgramDifference) -> Iterator[Row]:
    yield (TextPiece(escape(program.name), Style.STRONG),)
    for declaration in program.declarations:
        yield (TextPiece(f"  {declaration.what}: {_declared(declaration)}", Style.WARNING),)
    for part in program.parts:
        if _shown(part):
            yield from _part(part)
    for traces in program.traces:
        yield from _traced(traces)
    for follows in program.follows:
        yield from _followed(follows)
    for place in program.requirements:
        yield (TextPiece(f"  requirements of {escape(place)}", Style.WARNING),)
    for what in program.undecided:
        yield (TextPiece(f"  not decided: {what}", Style.ERROR),)


def _declared(declaration: Declaration) -> str:
    if not declaration.before or not declaration.after:
        return f"{'new' if declaration.after else 'gone'}: {declaration.after or declaration.before}"
    return f"{declaration.before} -> {declaration.after}"


def _part(part: ComparedPart) -> Iterator[Row]:
    title = TextPiece(f"  {part.what} `{part.name}`", Style.STRONG)
    if not part.changed and not part.moved:
        yield (title, TextPiece(f"  {proof(part)}", Style.HELP))
        return
    yield (title, TextPiece(f"  {', '.join(part.notes)}", Style.WARNING))
    for change in (*part.changes, *part.moved):
        yield from _change(part, change)
    if part.basis is not None and not (part.notes and not part.changes):
        yield (TextPiece(f"    {proof(part)}", Style.HELP),)


def _change(part: ComparedPart, change: Change) -> Iterator[Row]:
    style = Style.NOTE if change.sort is PartSort.LINE else Style.WARNING
    about = ", ".join(
        remark
        for remark in (_inputs(change.where), "" if change.relied_on else "outside the assumptions")
        if remark
    )
    yield (TextPiece(f"    {_title(part, change)}", style), TextPiece(f"  ({about})" if about else ""))
    for box in _boxes(change.where):
        yield (TextPiece("      where  "), TextPiece(box, Style.WITNESS))
    if _besides(change.where):
        yield (TextPiece(f"      {_besides(change.where)}", Style.WITNESS),)
    if change.witness and change.sort is not PartSort.LINE:
        yield (TextPiece(f"      {'least' if change.least else 'input'}  {_input(change)}"),)
    for value in change.values:
        heading = f"  [{', '.join(value.headings)}]" if value.headings else ""
        yield (TextPiece(f"      {value.leaf or 'the run'}: {_left(value)}{heading}"),)


def _followed(follows: Follows) -> Iterator[Row]:
    where = f"  level `{follows.level}`, table `{follows.table}`"
    if not follows.decided:
        yield (TextPiece(f"{where}: which line can follow which was not decided", Style.NOTE),)
    for word, pairs, style in (
        ("newly possible", follows.new, Style.WARNING),
        ("no longer possible", follows.gone, Style.NOTE),
    ):
        if pairs:
            yield (TextPiece(f"{where}: {_count(len(pairs), 'step')} from line to line {word}", style),)
            for line, then in _by_line(pairs).items():
                yield (TextPiece(f"    {line} -> {', '.join(then)}"),)


def _by_line(pairs: Sequence[tuple[str, str]]) -> dict[str, list[str]]:
    """Return the lines that can follow each."""
    following: dict[str, list[str]] = {}
    for line, then in pairs:
        following.setdefault(line, []).append(then)
    return following


def _traced(traces: Traces) -> Iterator[Row]:
    for word, steps, style in (("new", traces.new, Style.WARNING), ("gone", traces.gone, Style.NOTE)):
        if not steps:
            continue
        yield (
            TextPiece(
                f"  level `{traces.level}`: {_count(len(steps), 'step')} {word} in its state graph", style
            ),
        )
        shown, more = _steps(steps)
        for step in shown:
            yield (
                TextPiece(f"    {step.variable}: {step.before} -> {step.after}", style),
                TextPiece(f"  by {', '.join(step.by)}"),
            )
            yield (TextPiece(f"      trace  {_trace(step)}"),)
        if more:
            yield (TextPiece(f"    and {more} more, most from states that no trace of the table reaches"),)


# --- Markdown ------------------------------------------------------------------------------


def markdown(difference: Difference) -> str:
    """Return the difference as a review comment: a summary, a table for each table that changed, and details to open."""
    lines = [
        f"### rcsc diff: {_cell(headline(difference))}",
        "",
        f"{_code(difference.before)} → {_code(difference.after)}",
        "",
    ]
    lines += [f"- {_cell(note)}" for note in difference.notes] + ([""] if difference.notes else [])
    for program in difference.programs:
        if _told(program):
            lines += _program_marked(program)
    return "\n".join(lines).rstrip() + "\n"


def _program_marked(program: ProgramDifference) -> Iterator[str]:
    yield from (f"#### {_code(program.name)}", "")
    if program.undecided:
        yield from (f"**Not decided: {_cell(', '.join(program.undecided))}. Nothing is proved of it.**", "")
    if program.declarations:
        yield from ("| declared | before | after |", "|---|---|---|")
        yield from (
            f"| {_cell(declaration.what)} | {_cell(declaration.before)} | {_cell(declaration.after)} |"
            for declaration in program.declarations
        )
        yield ""
    for part in program.parts:
        if _shown(part):
            yield from _part_marked(part)
    for traces in program.traces:
        yield from _traces_marked(traces)
    for follows in program.follows:
        yield from _follows_marked(follows)
    yield from (f"- requirements of {_cell(place)}" for place in program.requirements)
    yield from [""] if program.requirements else []


def _part_marked(part: ComparedPart) -> Iterator[str]:
    notes = f": {_cell(', '.join(part.notes))}" if part.notes else ""
    yield from (f"**{_cell(part.what)} {_code(part.name)}**{notes}", "")
    if part.changes:
        yield from ("| before → after | where | what is left otherwise | inputs |", "|---|---|---|---|")
        for change in part.changes:
            yield _row(part, change)
        yield ""
    if part.basis is not None and not (part.notes and not part.changes):
        yield from (f"{_cell(proof(part)[0].upper() + proof(part)[1:])}.", "")
    details = [line for change in (*part.changes, *part.moved) for line in _details(part, change)]
    if details:
        moved = (
            f", {_count(len(part.moved), 'region')} with another line to the same effect"
            if part.moved
            else ""
        )
        yield from (
            "<details>",
            f"<summary>Inputs at which it differs{moved}</summary>",
            "",
            *details,
            "",
            "</details>",
            "",
        )


def _row(part: ComparedPart, change: Change) -> str:
    where = "<br>".join(_cell(box) for box in _boxes(change.where))
    besides = _besides(change.where)
    left = "<br>".join(f"{_code(value.leaf or 'the run')}: {_cell(_left(value))}" for value in change.values)
    note = "" if change.relied_on else " (outside the assumptions)"
    cells = (
        _cell(_title(part, change)),
        where + (f"<br>{_cell(besides)}" if besides else ""),
        left,
        _inputs(change.where) + note,
    )
    return f"| {' | '.join(cells)} |"


def _details(part: ComparedPart, change: Change) -> Iterator[str]:
    title = _cell(_title(part, change))
    if change.sort is PartSort.LINE:
        text = f"{'; '.join(_boxes(change.where))} {_besides(change.where)}"
        yield f"- {title}: {_cell(text)}".rstrip()
    elif change.witness:
        yield f"- {title}: {_cell(_input(change))}"
    yield from (
        f"  - {_code(value.leaf)}: {_cell(str(value.at[0]))} → {_cell(str(value.at[1]))}"
        for value in change.values
        if value.leaf and all(value.at)
    )


def _traces_marked(traces: Traces) -> Iterator[str]:
    for word, steps in (("newly possible", traces.new), ("no longer possible", traces.gone)):
        if not steps:
            continue
        shown, more = _steps(steps)
        yield from (f"**level {_code(traces.level)}**: {_count(len(steps), 'step')} {word}", "")
        yield from ("| step | by | shortest trace |", "|---|---|---|")
        for step in shown:
            change = f"{step.variable}: {step.before} → {step.after}"
            yield f"| {_cell(change)} | {_cell(', '.join(step.by))} | {_cell(_trace(step))} |"
        if more:
            yield f"| and {more} more | | |"
        yield ""


def _follows_marked(follows: Follows) -> Iterator[str]:
    where = f"**table {_code(follows.table)}** of level {_code(follows.level)}"
    if not follows.decided:
        yield from (f"{where}: which line can follow which was not decided", "")
    for word, pairs in (("newly possible", follows.new), ("no longer possible", follows.gone)):
        if pairs:
            yield f"{where}: {_count(len(pairs), 'step')} from line to line {word}"
            yield from (
                "",
                *(f"- {_cell(line)} → {_cell(', '.join(then))}" for line, then in _by_line(pairs).items()),
                "",
            )


_MARKS = (("\\", "\\\\"), ("&", "&amp;"), ("<", "&lt;"), ("|", "\\|"), ("](", "]\\("))


def _cell(text: str) -> str:
    """Return text that ends no cell, marks nothing up, leads nowhere and shows all that it holds; names in backticks stay set apart."""
    plain = escape(text.replace("\n", " "))
    for mark, replacement in _MARKS:
        plain = plain.replace(mark, replacement)
    return plain if plain.count("`") % 2 == 0 else plain.replace("`", "'")


def _code(name: str) -> str:
    """Return a name set apart, which cannot end that itself."""
    plain = escape(name).replace("`", "'").replace("|", "/")
    return f"`{plain}`"
