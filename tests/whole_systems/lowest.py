"""The lowest level: declared, or by hand."""

from random import Random

from tests.whole_systems.by_hand import bottom_by_hand
from tests.whole_systems.link import Plan
from tests.whole_systems.texts import fact_text, properties_text, sign_modules, sign_text, slip_in, table_text


def lower(plan: Plan, random: Random, slips: list[str]) -> str:  # noqa: C901, PLR0912, PLR0915  # one text, from top to bottom
    """The lowest level: by hand it has the same lines."""
    link, parts = plan.link, plan.parts
    assert link is not None
    order = plan.peer if plan.declared else "command"
    report = f"to_{plan.peer}" if plan.declared else "report"
    text = "use words\n"
    if plan.declared:
        text += link.text(link.differs) if link.twice else ""
        text += f"serves {plan.peer} : {link.name}\n"
    else:
        text += bottom_by_hand(plan, random, slips)
    restart = random.choice(("bad", "bad", "bad", "idle", "works"))
    text += f"state now : phase = idle restart {restart}\nprocedure ph(value : phase) {{ now := value }}\n"
    text += sign_text(plan, random)
    pre: list[str] = []
    domains = {"now": ("idle", "works", "bad"), "new_command": ("false", "true")}
    looks: list[str] = []
    if random.random() < 0.5:
        text += "input x : int 0 .. 2\n"
        parts.add("refusable")
        looks.append("x")
        domains["x"] = ("0 .. 1", "2")
    if random.random() < 0.15:
        text += (
            'state heard : bool\nextern procedure ask reads now writes heard python "nowhere:ask" c "ask"\n'
        )
        parts.add("extern")
        looks.append("heard")
        domains["heard"] = ("false", "true")
        pre.append("ask")
    if link.stream and random.random() < 0.6:
        looks.append(f"{order}.sp")
        domains[f"{order}.sp"] = ("false", "true")
        parts.add("tied to a stream")
    if link.field_ and random.random() < 0.6:
        looks.append(f"{order}.k")
        domains[f"{order}.k"] = ("false", "true")
    if plan.takes and random.random() < 0.7:
        looks.append("sign")
        domains["sign"] = ("false", "true")
    fast = random.random() < 0.4
    if fast:
        safe = random.choice(("", " safe false", " safe true"))
        text += f"output fast : bool{safe}\n"
        parts |= {"safe"} if safe else set()
        if random.random() < 0.3:
            text += f"adopt fast := {random.choice(('true', 'false'))}\n"
            parts.add("adopt")
        domains["fast"] = ("false", "true")
    if link.flow:
        text += f"module flows reads now writes {report} {{ {report}.flow := now = {random.choice(('idle', 'works'))} }}\n"
    waits = random.random() < 0.3
    if waits:
        text += "state n : int 0 .. 2\nprocedure up { n := min(n + 1, 2) }\nprocedure zero { n := 0 }\n"
        domains["n"] = ("0", "1", "2")
    look = random.choice(looks) if looks else ""
    cells = domains[look] if look else ("",)
    columns = ["new_command", "now", *([look] if look else []), *(["n"] if waits else [])]
    on, off = (["true"], ["false"]) if fast else ([], [])
    nothing, less, any_ = [""] * waits, ["< 2"] * waits, [""] * bool(look)
    calls = "ph(works); zero" if waits else "ph(works)"
    if "ask" in pre and random.random() < 0.5:
        pre.remove("ask")
        calls = f"ask; {calls}"
        parts.add("extern refused in a line")
    rows = [["new", "true", "", *any_, *nothing, calls, *on, "executing"]]
    if look:
        rows += [
            [
                "w",
                "false",
                "works",
                cells[0],
                *less,
                "up" if waits else "",
                *on,
                "executing",
            ],
            ["e", "false", "works", cells[1], *less, "ph(idle)", *off, "done"],
        ]
    else:
        rows += [
            [
                "e",
                "false",
                "works",
                *less,
                "up" if waits else "ph(idle)",
                *off,
                "executing" if waits else "done",
            ]
        ]
    if waits:
        rows.append(
            [
                "late",
                "false",
                "works",
                *any_,
                "2",
                "ph(bad)" if random.random() < 0.5 else "ph(idle)",
                *off,
                "",
            ]
        )
        rows[-1][-1] = "failed" if "bad" in rows[-1][-2 - len(off)] else "done"
    rows += [
        ["i", "false", "idle", *any_, *nothing, "", *off, "done"],
        ["bad", "false", "bad", *any_, *nothing, "", *off, "failed"],
    ]
    slip_in(rows, columns, {"now": domains["now"], "new_command": domains["new_command"]}, random, slips, 0)
    assumes: list[str] = []
    fields = [*([f"{order}.k"] if link.field_ else []), *([f"{order}.sp"] if link.stream else [])]
    text += fact_text(plan, random, assumes, fields)
    text += (
        ""
        if plan.calm
        else properties_text(
            domains | {f"{report}.status_report": ("done", "executing", "failed")}, random, parts
        )
    )
    if random.random() < 0.12 and not plan.calm:
        stated = [
            "now /= bad",
            "n /= 2" if waits else "now /= works",
            *["now /= works implies not fast"] * fast,
        ]
        text += f"invariant low : {random.choice(stated)}\n"
        parts.add("invariant")
    does = [*(["fast"] if fast else []), "status_out"]
    text += table_text("go", assumes, columns, does, rows)
    text += table_text("rest", [], ["when"], does, [["r", "true", "ph(idle)", *off, "done"]])
    chosen = f"{link.rest} : rest  {link.commands[1]} : go"
    pre += sign_modules(plan)
    post = ["flows"] if link.flow else []
    if not plan.declared:
        pre.insert(0, "receive")
        post.append("answer")
    before = f"  preprocess {', '.join(pre)}\n" if pre else ""
    after = f"  postprocess {', '.join(post)}\n" if post else ""
    return (
        text
        + f"level {plan.name} {{\n  period 40 [ms]\n{before}  table by {order}.input_command {{ {chosen} }}\n{after}}}\n"
    )
