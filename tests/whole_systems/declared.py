"""A level that declares whom it serves and commands."""

from random import Random

from tests.whole_systems.link import Link, Plan
from tests.whole_systems.texts import fact_text, properties_text, sign_modules, sign_text, slip_in, table_text


def _order(link: Link, random: Random) -> str:
    """An order to go, with its fields."""
    named = [*(["k"] if link.field_ else []), *(["sp"] if link.stream and random.random() < 0.6 else [])]
    return ", ".join(f"{name} := {random.choice(('true', 'false'))}" for name in named)


def upper(plan: Plan, random: Random, slips: list[str]) -> str:  # noqa: PLR0915  # one text, from top to bottom
    """A level that declares whom it serves and commands."""
    link, parts = plan.link, plan.parts
    assert link is not None
    subs = [name for name, _ in plan.below]
    text = "use words\n"
    text += "".join(one.text() for _, one in plan.below if one.twice)
    text += link.text(link.differs) if link.twice else ""
    gone = random.choice(("", "", "", " without failed_stays", " without done_without_reason"))
    parts |= {"dismissed"} if gone else set()
    text += f"serves {plan.peer} : {link.name}{gone}\n" + "".join(
        f"commands {name} : {one.name}\n" for name, one in plan.below
    )
    restart = random.choice(("bad", "bad", "bad", "idle"))
    text += f"state now : phase = idle restart {restart} deferred\nprocedure ph(value : phase) {{ next now := value }}\n"
    reasons = " else ".join(
        f"if {name}.status = failed {{ to_{plan.peer}.why := {name}.why }}" for name in subs
    )
    reasons = reasons.replace(" else if", " else { if", len(subs) - 1) + " }" * (len(subs) - 1)
    text += (
        f"procedure why {{ {reasons} }}\n"
        if random.random() < 0.7
        else f"procedure why {{ to_{plan.peer}.why := begun_anew }}\n"
    )
    if random.random() < 0.1 and any(one.stream for _, one in plan.below):
        name = next(name for name, one in plan.below if one.stream)
        text += f"adopt to_{name}.sp := true\n"
        parts.add("adopt")
    parts.add("deferred")
    text += sign_text(plan, random)
    pre = []
    streams = [name for name, one in plan.below if one.stream]
    if streams and random.random() < 0.6:
        name = streams[0]
        how = random.choice(
            (f"not to_{name}.sp", "now = works", f"{plan.peer}.input_command = {link.commands[1]}")
        )
        reads = f"to_{name}" if how.startswith("not") else "now" if how.startswith("now") else plan.peer
        text += f"module wobble reads {reads} writes to_{name} {{ to_{name}.sp := {how} }}\n"
        pre.append("wobble")
        parts.add("tied to a stream")
    resting = " and ".join(f"{name}.resting" for name in subs)
    done = " and ".join(f"{name}.status = done" for name in subs)
    failed = " or ".join(f"{name}.status = failed" for name in subs)
    goes = []
    for _, one in plan.below:
        fields = _order(one, random)
        again = ""
        if random.random() < 0.1:
            again = "again"
            parts.add("again")
        inside = ", ".join(filter(None, [fields, again]))
        goes.append(f"{one.commands[1]}({inside})" if inside else one.commands[1])
    rests = [one.rest for _, one in plan.below]
    blank = [""] * len(subs)
    hush = [["hush", "true", "false", "", "", "", "settle", *blank, ""]] if random.random() < 0.8 else []
    first = "true" if hush else ""
    columns = ["new_command", resting, "now", done, failed]
    stay = random.choice((True, True, False))
    rows = [
        *hush,
        ["new", "true", first, "", "", "", "ph(works)", *goes, "executing"],
        ["w", "false", "", "works", "false", "false", "", *blank, "executing"],
        ["dd", "false", "", "works", "true", "", "ph(idle)", *(rests if stay else blank), "done"],
        ["f", "false", "", "works", "false", "true", "why; ph(bad)", *rests, "failed"],
        ["i", "false", "", "idle", "", "", "", *(rests if stay else blank), "done"],
        ["b", "false", "", "bad", "", "", "", *rests, "failed"],
    ]
    domains = {
        "now": ("idle", "works", "bad"),
        "new_command": ("false", "true"),
        f"to_{plan.peer}.status_report": ("done", "executing", "failed"),
    }
    domains |= {f"{name}.status": ("done", "executing", "failed") for name in subs}
    domains |= {f"to_{name}.input_command": one.commands for name, one in plan.below}
    domains |= {f"from_{name}.status_report": ("done", "executing", "failed") for name in subs}
    domains |= {"sign": ("false", "true")} if plan.takes else {}
    slip_in(
        rows,
        columns,
        {"now": domains["now"], "new_command": domains["new_command"]},
        random,
        slips,
        len(subs),
    )
    assumes = []
    if random.random() < 0.3:
        first, one = plan.below[0]
        working = f"now = works implies new_command or to_{first}.input_command = {one.commands[1]}"
        said = random.choice(("new_command or echoed or now = bad", working, "new_command or not settling"))
        text += f"assume in_hand monitored : {said}\n"
        assumes.append("in_hand")
    text += fact_text(
        plan,
        random,
        assumes,
        [f"from_{name}.flow" for name, one in plan.below if one.flow]
        + [f"from_{name}.status_report /= failed" for name in subs[:1]],
    )
    text += "" if plan.calm else properties_text(domains, random, parts)
    text += table_text("go", assumes, columns, [*subs, "status_out"], rows)
    wait = [["w", "false", "ph(idle)", *rests, "executing"], ["r", "true", "ph(idle)", *rests, "done"]]
    if random.random() < 0.15:
        wait = [["r", "", "ph(idle)", *rests, "done"]]
        slips.append(f"{plan.name} is done with resting at once")
    text += table_text("rest", [], [resting], [*subs, "status_out"], wait)
    before = f"  preprocess {', '.join([*pre, *sign_modules(plan)])}\n" if [*pre, *sign_modules(plan)] else ""
    chosen = f"{link.rest} : rest  {link.commands[1]} : go"
    return (
        text
        + f"level {plan.name} {{\n  period 40 [ms]\n{before}  table by {plan.peer}.input_command {{ {chosen} }}\n}}\n"
    )
