"""Pieces of the text of levels: tables cut at random, properties, facts, plain buffers, slips of the hand."""

from collections.abc import Sequence
from random import Random

from tests.whole_systems.link import Plan


def cut_boxes(domains: dict[str, tuple[str, ...]], random: Random) -> list[dict[str, tuple[str, ...]]]:
    boxes = [dict(domains)]
    for _ in range(random.randint(2, 5)):
        wide = [(box, name) for box in boxes for name, values in box.items() if len(values) > 1]
        box, name = random.choice(wide)
        boxes.remove(box)
        at = random.randint(1, len(box[name]) - 1)
        boxes += [{**box, name: box[name][:at]}, {**box, name: box[name][at:]}]
    return boxes


def cell_text(values: Sequence[str], whole: Sequence[str]) -> str:
    if tuple(values) == tuple(whole):
        return ""
    return (
        values[0]
        if len(values) == 1
        else f"{values[0]} .. {values[-1]}"
        if values[0].isdigit()
        else ", ".join(values)
    )


def table_text(
    name: str,
    assumes: Sequence[str],
    columns: Sequence[str],
    does: Sequence[str],
    rows: Sequence[Sequence[str]],
) -> str:
    assuming = f" assuming {', '.join(assumes)}" if assumes else ""
    kept, lines = list(columns), [list(row) for row in rows]
    blank = [at for at, _ in enumerate(kept) if not any(row[at + 1] for row in lines)]
    if len(blank) == len(kept):
        kept, lines, blank = ["when"], [[row[0], "true", *row[len(kept) + 1 :]] for row in lines], []
    for at in reversed(blank):
        kept.pop(at)
        for row in lines:
            row.pop(at + 1)
    many = len(kept) + 1
    text = f"table {name}{assuming} {{\n  | {' | '.join(['line', *kept])} || {' | '.join(['procedures', *does])} |\n"
    text += "  |" + "---|" * many + "|" + "---|" * (len(does) + 1) + "\n"
    for row in lines:
        text += f"  | {' | '.join(row[:many])} || {' | '.join(row[many:])} |\n"
    return text + "}\n"


def _atom(domains: dict[str, tuple[str, ...]], random: Random, *, was: bool = True) -> str:
    name = random.choice(sorted(domains))
    value = random.choice(domains[name]).partition(" ")[0]
    word = f"was {name}" if was and random.random() < 0.3 else name
    if domains[name] == ("false", "true"):
        return word if value == "true" else f"not {word}"
    return f"{word} {random.choice(('=', '/='))} {value}"


def properties_text(domains: dict[str, tuple[str, ...]], random: Random, kinds: set[str]) -> str:
    text = ""
    for at in range(random.choice((0, 1, 1, 2, 3))):
        kinds.add("property")
        form = random.choice(
            (
                "{0} or {1} or {2}",
                "{0} and {1} implies {2}",
                "{0} implies {1}",
                "{0} then {1}",
                "{0} and {1} implies {2}",
                "{0} or {1}",
                "{0} until {1}",
            )
        )
        was = "then" not in form and "until" not in form
        text += f"property p{at} : {form.format(*(_atom(domains, random, was=was) for _ in range(3)))}\n"
    return text


def system_text(names: Sequence[str], wires: Sequence[str]) -> str:
    levels = "".join(f'[[level]]\nname = "{name}"\n' for name in names)
    return f'name = "whole"\ngenerated = "generated"\ntick_ms = 40\n{levels}[buffers]\n' + "".join(
        f"{one}\n" for one in wires
    )


def sign_text(plan: Plan, random: Random) -> str:
    """A plain output, and what gives it; a plain input."""
    text = ""
    if plan.takes:
        text += "input sign : bool\n"
    if plan.gives:
        safe = ""
        if random.random() < 0.3:
            safe = f" safe {random.choice(('true', 'false'))}"
            plan.parts.add("safe")
        text += f"output sign : bool{safe}\n"
        status = f"to_{plan.peer}.status_report" if plan.declared else "status_report"
        how = random.choice(("not sign", "true", "false", "false", f"{status} = failed"))
        reads = "sign" if how == "not sign" else status.partition(".")[0] if " = " in how else "sign"
        text += f"module signs reads {reads} writes sign {{ sign := {how} }}\n"
    return text


def sign_modules(plan: Plan) -> list[str]:
    return ["signs"] if plan.gives else []


def fact_text(plan: Plan, random: Random, assumes: list[str], fields: Sequence[str]) -> str:
    """A fact about what another level writes."""
    every = [*fields, *(["sign"] if plan.takes else [])]
    if plan.calm or not every or random.random() > 0.25:
        return ""
    plan.parts.add("fact of another level")
    word = random.choice(every)
    if "=" not in word:
        word = random.choice((word, f"not {word}"))
    assumes.append("told")
    return f"assume told {random.choice(('assumed', 'assumed', 'monitored'))} : {word}\n"


def slip_in(
    rows: list[list[str]],
    columns: Sequence[str],
    known: dict[str, tuple[str, ...]],
    random: Random,
    slips: list[str],
    many: int,
) -> None:
    """Some slip in a table: a line dropped, a cell forgotten or another, another state, status or order."""
    if random.random() < 0.8:
        return
    row = random.choice(rows)
    way = random.choice(("dropped", "forgotten", "cell", "state", "status", "order"))
    if way == "dropped" and len(rows) > 2:
        rows.remove(row)
    elif way == "forgotten":
        at = random.choice([at for at, cell in enumerate(row[1 : len(columns) + 1], 1) if cell] or [1])
        row[at] = ""
    elif way == "cell":
        name = random.choice([name for name in known if name in columns])
        row[1 + columns.index(name)] = random.choice(known[name])
    elif way == "state":
        row[len(columns) + 1] = random.choice(("", "ph(idle)", "ph(works)", "ph(bad)"))
    elif way == "status":
        row[-1] = random.choice(("done", "executing", "failed", ""))
    elif way == "order" and many:
        row[-2] = random.choice([other[-2] for other in rows])
    slips.append(f"line {row[0]}: {way}")
