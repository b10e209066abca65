"""Levels that write the protocol themselves, as section 9 of Haynes et al. (1984) has it."""

from collections.abc import Sequence
from random import Random

from tests.small_hierarchies.made import RIGHT, WRONG
from tests.whole_systems.link import Plan
from tests.whole_systems.texts import fact_text, properties_text, sign_modules, sign_text, slip_in, table_text

STATES = """state new_command : bool
state inc_command_seen : number
state status_report : status
state reason : why restart begun_anew
"""


def _said(names: Sequence[str], random: Random, slips: list[str], owner: str) -> dict[str, str]:
    """Pieces of the modules, one of them wrong now and then."""
    said = {name: RIGHT[name] for name in names}
    if random.random() < 0.2:
        name = random.choice(sorted(said))
        said[name] = random.choice(WRONG[name])
        slips.append(f"{owner}: {name}: `{said[name]}`")
    return said


def _answers(said: dict[str, str], rest: str) -> str:
    lines = [said[one].replace("pause", rest) for one in ("echo", "echoed", "status") if said[one]]
    lines.append("report.why := reason")
    body = "\n".join(f"  {one}" for one in lines)
    return (
        "module answer reads command, inc_command_seen, new_command, status_report, reason, report writes report {\n"
        + body
        + "\n}\n"
        "procedure done { status_report := done }\nprocedure executing { status_report := executing }\n"
        "procedure failed { status_report := failed }\n"
    )


def bottom_by_hand(plan: Plan, random: Random, slips: list[str]) -> str:
    link = plan.link
    assert link is not None
    said = _said(("seen", "echo", "echoed", "status", "taken"), random, slips, plan.name)
    text = f"input command : o{link.at}\noutput report : b{link.at}\n"
    text += STATES + "module receive reads command, inc_command_seen, new_command, status_report, reason "
    text += "writes new_command, inc_command_seen, reason {\n"
    text += f"  new_command := {said['taken']}\n  if new_command {{\n    reason := none\n  }}\n"
    text += f"  {said['seen']}\n}}\n" if said["seen"] else "}\n"
    return text + _answers(said, link.rest)


def upper_by_hand(plan: Plan, random: Random, slips: list[str]) -> str:  # noqa: PLR0915  # one text, from top to bottom
    """A level with one subordinate or two that writes the protocol itself; the second gets what the first gets."""
    link = plan.link
    assert link is not None
    plan.parts.add("deferred")
    said = _said(tuple(RIGHT), random, slips, plan.name)
    order = "command"
    restart = random.choice(("bad", "bad", "idle"))
    below = [name for name, _ in plan.below]
    text = f"use words\ninput command : o{link.at}\noutput report : b{link.at}\n"
    text += STATES + "state begun : bool\n"
    for name, one in plan.below:
        text += f"input {name} : b{one.at}\noutput to_{name} : o{one.at}\nstate ref_{name} : c{one.at}\n"
        text += f"state st_{name} : status\nstate old_{name} : c{one.at}\n"
        text += "".join(f"state old{f}_{name} : bool\n" for f in one.fields)
    echoed = _of_both(below, "ECHO = SENT")
    until = (
        said["deferred"]
        if said["deferred"] == RIGHT["deferred"]
        else said["deferred"].replace("status_in", f"st_{below[0]}")
    )
    until = echoed if until == "ECHO = SENT" else _of_both(below, until)
    text += f"state now : phase = idle restart {restart} deferred until {until}\nprocedure ph(value : phase) {{ next now := value }}\n"
    reads = ", ".join([*below, *(f"to_{name}" for name in below)])
    writes = ", ".join(f"{one}_{name}" for name in below for one in ("ref", "st"))
    released = said["released"]
    released = (
        released
        if "ECHO" not in released
        else f"begun and {echoed}"
        if released == RIGHT["released"]
        else _of_both(below, released)
    )
    text += (
        f"module receive reads command, {reads}, inc_command_seen, begun, new_command, status_report, reason, {writes} "
        f"writes new_command, begun, inc_command_seen, reason, {writes} {{\n  if {said['taken']} {{\n"
        f"    {said['seen']}\n    {said['raised']}\n    {said['begun_off']}\n    reason := none\n"
        f"  }} else if {released} {{\n    new_command := false\n  }}\n"
    )
    for name in below:
        text += f"  if {_meant(said['sampled'], name)} {{\n    ref_{name} := {name}.ref_command_echo\n"
        text += f"    st_{name} := {name}.status_report\n  }}\n"
    text += "}\n"
    olds = ", ".join(
        [
            *(f"old_{name}" for name in below),
            *(f"old{f}_{name}" for name, one in plan.below for f in one.fields),
        ]
    )
    text += f"module send reads {reads}, {olds}, begun, new_command writes {', '.join(f'to_{name}' for name in below)}, {olds} {{\n"
    for name, one in plan.below:
        meant = _meant(said["numbered"], name).replace("old_command", f"old_{name}")
        also = ""
        if one.fields:
            if random.random() < 0.85:
                also = "".join(f" or to_{name}.{f} /= old{f}_{name}" for f in one.fields)
            else:
                slips.append(f"{plan.name}: a field changes beside the number")
        old = _meant(said["old"], name).replace("old_command", f"old_{name}")
        text += f"  if {meant}{also} {{\n    to_{name}.inc_command := {_meant(said['next'], name)}\n  }}\n  {old}\n"
        text += "".join(f"  old{f}_{name} := to_{name}.{f}\n" for f in one.fields)
    text += (
        "}\n"
        + _answers(said, link.rest)
        + "procedure begin { begun := true }\nprocedure why { reason := begun_anew }\n"
    )
    text += sign_text(plan, random)
    tells = []
    for name, one in plan.below:
        fields = "".join(f"\n  to_{name}.{f} := {random.choice(('true', 'false'))}" for f in one.fields)
        tells.append(f"  to_{name}.input_command := {one.commands[1]}{fields}")
    text += "procedure tell {\n" + "\n".join(tells) + "\n}\n"
    text += (
        "procedure halt {\n"
        + "\n".join(f"  to_{name}.input_command := {one.rest}" for name, one in plan.below)
        + "\n}\n"
    )
    columns = [
        "new_command",
        "now",
        *(f"ref_{name}" for name in below),
        " and ".join(f"st_{name} = done" for name in below),
        " or ".join(f"st_{name} = failed" for name in below),
    ]
    blank = [""] * len(below)
    ours = [one.commands[1] for _, one in plan.below]
    rows = [
        ["new", "true", "", *blank, "", "", "begin; tell; ph(works)", "executing"],
        ["w", "false", "works", *ours, "false", "false", "", "executing"],
        ["dd", "false", "works", *ours, "true", "", "halt; ph(idle)", "done"],
        ["f", "false", "works", *ours, "false", "true", "why; halt; ph(bad)", "failed"],
        ["i", "false", "idle", *blank, "", "", "halt", "done"],
        ["b", "false", "bad", *blank, "", "", "halt", "failed"],
    ]
    if random.random() < 0.4:
        rows.append(["z", "DEFAULT unreachable", *("" for _ in columns[1:]), "", "failed"])
        plan.parts.add("default")
    elif random.random() < 0.4:
        rows = [
            [
                *row[:3],
                *(blank if row[0] in {"w", "dd", "f"} else row[3 : 3 + len(below)]),
                *row[3 + len(below) :],
            ]
            for row in rows
        ]
    known = {"now": ("idle", "works", "bad"), "new_command": ("false", "true")}
    slip_in([row for row in rows if row[0] != "z"], columns, known, random, slips, 0)
    assumes: list[str] = []
    domains = (
        dict(known)
        | {f"st_{name}": ("done", "executing", "failed") for name in below}
        | {"status_report": ("done", "executing", "failed")}
    )
    domains |= {f"to_{name}.input_command": one.commands for name, one in plan.below} | (
        {"sign": ("false", "true")} if plan.takes else {}
    )
    text += fact_text(plan, random, assumes, [f"{name}.flow" for name, one in plan.below if one.flow])
    text += "" if plan.calm else properties_text(domains, random, plan.parts)
    text += table_text("go", assumes, columns, ["status_out"], rows)
    calm = "begin; halt; ph(idle)" if random.random() < 0.85 else "begin; halt"
    rests = [["r", "true", calm, "done"]]
    text += table_text("rest", [], ["when"], ["status_out"], rests)
    chosen = f"{link.rest} : rest  {link.commands[1]} : go"
    signs = "".join(f", {one}" for one in sign_modules(plan))
    return text + (
        f"level {plan.name} {{\n  period 40 [ms]\n  preprocess receive{signs}\n"
        f"  table by {order}.input_command {{ {chosen} }}\n  postprocess send, answer\n}}\n"
    )


def _of_both(below: Sequence[str], text: str) -> str:
    return " and ".join(f"({_meant(text, name)})" for name in below)


def _meant(text: str, below: str) -> str:
    for word, leaf in (
        ("ECHO", f"{below}.inc_command_echo"),
        ("SENT", f"to_{below}.inc_command"),
        ("COMMAND", f"to_{below}.input_command"),
    ):
        text = text.replace(word, leaf)
    return text.replace("old_command", f"old_{below}").replace("status_in", f"st_{below}")
