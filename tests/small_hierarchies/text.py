"""Hierarchies as source text, for the parser and the resolver like any other.

In: a hierarchy. Out: the text of each file (`files`), or the files themselves (`written`).
"""

from pathlib import Path

from tests.small_hierarchies.made import MOST_WAITED, SPOTS, Hierarchy, Line, MadeLevel, MadeTable, domains_of
from tests.small_hierarchies.more import columns_of, module_of, procedures_of, states_of, tables_of


def written(made: Hierarchy, folder: Path) -> Path:
    """Writes a hierarchy's files; the path of its description."""
    for name, text in files(made).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "system.toml"


def files(made: Hierarchy) -> dict[str, str]:
    """The text of each file by its name."""
    programs = {f"{level.name}.rcs": program(level) for level in made.levels}
    return {"system.toml": _description(made), "words.rcs": _words(made), **programs}


def _description(made: Hierarchy) -> str:
    head = 'name = "made"\ngenerated = "generated"\ndata = "cell.toml"\ntick_ms = 40\n'
    levels = "".join(f'[[level]]\nname = "{level.name}"\n' for level in made.levels)
    ends = [("station", made.levels[0].name, "order", "report")]
    ends += [
        (level.name, level.below, f"to_{level.below}", level.below) for level in made.levels if level.below
    ]
    wires = []
    for above, below, order, report in ends:
        to, back = ("order", "report") if below == "plant" else ("command", "report")
        wires += [f'"{above}.{order}" = "{below}.{to}"', f'"{below}.{back}" = "{above}.{report}"']
    return head + levels + "[buffers]\n" + "\n".join(wires) + "\n"


def _words(made: Hierarchy) -> str:
    text = f"enum level_status {{ {', '.join(made.levels[0].statuses)} }}\nenum stage {{ {_stages(made)} }}\n"
    text += f"enum spot {{ {', '.join(SPOTS)} }}\ntype number = int 0 .. 65535\n"
    told = [(level.name, level.commands, level.field) for level in made.levels]
    if made.outside:
        told.append((made.outside, made.levels[-1].orders, made.levels[-1].passes))
    for name, commands, named in told:
        text += f"enum {name}_command {{ {', '.join(commands)} }}\n"
        spot = "  where : spot\n" if named else ""
        text += (
            f"record {name}_order {{\n  inc_command : number\n  input_command : {name}_command\n{spot}}}\n"
        )
        text += f"record {name}_report {{\n  inc_command_echo : number\n  ref_command_echo : {name}_command\n"
        text += "  status_report : level_status\n}\n"
    return text


def _stages(made: Hierarchy) -> str:
    """The states of all levels: the second stage where some level has one."""
    said = [
        str((line.cells, line.calls))
        for level in made.levels
        for table in level.tables
        for line in table.lines
    ]
    return "d_state, f_state, s1" + (", s2" if any("s2" in one for one in said) else "")


def program(level: MadeLevel) -> str:
    said = {name: _meant(text, level.below) for name, text in level.said}
    parts = [_declared(level, said), _modules(level, said), _procedures(level)]
    parts += [_table(table, level) for table in level.tables]
    also, asks = module_of(level), dict(level.asks)
    post = ["send", "answer"] if level.below else ["answer"]
    before = ["receive", "notice"] if also else ["receive"]
    for name, modules in (("ask", before), ("tell", post)):
        if name in asks:
            modules.insert(asks[name], name)
    period = f"level {level.name} {{\n  period 40 [ms]\n"
    runs = f"  preprocess {', '.join(before)}\n{tables_of(level)}  postprocess {', '.join(post)}\n}}\n"
    parts += [also, period + runs]
    return "\n".join(parts)


def _meant(text: str, below: str) -> str:
    for word, leaf in (
        ("ECHO", f"{below}.inc_command_echo"),
        ("SENT", f"to_{below}.inc_command"),
        ("COMMAND", f"to_{below}.input_command"),
    ):
        text = text.replace(word, leaf)
    return text


def _declared(level: MadeLevel, said: dict[str, str]) -> str:
    lines = ["use words", f"input command : {level.name}_order"]
    states = ["new_command : bool", "inc_command_seen : number", "status_report : level_status"]
    if level.below:
        lines.append(f"input {level.below} : {level.below}_report")
        states += ["begun : bool", f"ref_command_in : {level.below}_command", "status_in : level_status"]
        states += [
            f"old_command : {level.below}_command",
            f"cur_state : stage deferred until {said['deferred']}",
        ]
        if level.passes:
            states.append("old_where : spot")
        lines.append(f"output to_{level.below} : {level.below}_order")
    else:
        lines.append("input there : bool")
        states.append("cur_state : stage")
    if level.waits:
        states.append(f"waited : int 0 .. {MOST_WAITED}")
    states += states_of(level)
    lines += [f"state {state}" for state in states]
    lines.append(f"output report : {level.name}_report")
    if level.assumption:
        lines.append(f"assume in_step monitored : {level.assumption}")
    lines += level.states
    return "\n".join(lines) + "\n"


def _modules(level: MadeLevel, said: dict[str, str]) -> str:
    below, order = level.below, f"to_{level.below}"
    answer = "\n".join(f"  {said[one]}" for one in ("echo", "echoed", "status") if said[one])
    answer = (
        "module answer reads command, inc_command_seen, new_command, status_report writes report {\n"
        f"{answer}\n}}\n"
    )
    zero = "    waited := 0\n" if level.waits else ""
    waited = ", waited" if level.waits else ""
    if not below:
        return (
            "module receive reads command, inc_command_seen, new_command, status_report "
            f"writes new_command, inc_command_seen{waited} {{\n  new_command := {said['taken']}\n"
            f"  if new_command {{\n{zero}  }}\n  {said['seen']}\n}}\n{answer}"
        )
    also = f"\n    or {order}.where /= old_where" if level.passes else ""
    keeps = f"\n  old_where := {order}.where" if level.passes else ""
    olds = "old_command, old_where" if level.passes else "old_command"
    return (
        f"module receive reads command, {below}, {order}, inc_command_seen, begun, new_command, ref_command_in, status_in, status_report "
        "writes new_command, begun, inc_command_seen, ref_command_in, status_in {\n"
        f"  if {said['taken']} {{\n    {said['seen']}\n    {said['raised']}\n    {said['begun_off']}\n"
        f"  }} else if {said['released']} {{\n    new_command := false\n  }}\n"
        f"  if {said['sampled']} {{\n    ref_command_in := {below}.ref_command_echo\n"
        f"    status_in := {below}.status_report\n  }}\n}}\n"
        f"module send reads {order}, {below}, {olds}, begun, new_command writes {order}, {olds} {{\n"
        f"  if {said['numbered']}{also} {{\n    {order}.inc_command := {said['next']}\n  }}\n"
        f"  {said['old']}{keeps}\n}}\n{answer}"
    )


def _procedures(level: MadeLevel) -> str:
    one = ["procedure state(value : stage) {\n  cur_state := value\n}"]
    one += [f"procedure {status} {{\n  status_report := {status}\n}}" for status in level.statuses]
    if level.below:
        one.append("procedure begin {\n  begun := true\n}")
        one.append("procedure nextstate(value : stage) {\n  next cur_state := value\n}")
        spot = f"\n  to_{level.below}.where := command.where" if level.passes else ""
        one += [
            f"procedure order_{order} {{\n  to_{level.below}.input_command := {order}{spot}\n}}"
            for order in level.orders
        ]
    if level.waits:
        one.append(f"procedure wait {{\n  if waited < {MOST_WAITED} {{\n    waited := waited + 1\n  }}\n}}")
    return "\n".join([*one, *procedures_of(level)]) + "\n"


def _table(table: MadeTable, level: MadeLevel) -> str:
    """A table; its columns are the variables that some line looks at."""
    known = ["when", *domains_of(level.orders, waits=level.waits), *columns_of(level)]
    columns = [name for name in known if any(line.cell(name) for line in table.lines)]
    head = ["line", *columns]
    rows = [[line.name, *(line.cell(name) for name in columns)] for line in table.lines]
    ends = [_actions(line, level) for line in table.lines]
    if table.default:
        rows.append(["99", table.default, *("" for _ in columns[1:])])
        ends.append(("", "", "failed"))
    order = "|| procedures | command_out | status_out |" if level.below else "|| procedures | status_out |"
    names = (*(["in_step"] if table.assumed and level.assumption else []), *table.assuming)
    text = f"table {table.name}" + (f" assuming {', '.join(names)}" if names else "") + " {\n"
    text += "  | " + " | ".join(head) + " " + order + "\n"
    text += (
        "  |"
        + "---|" * len(head)
        + order.replace("|| procedures", "|---")
        .replace(" command_out ", "---")
        .replace(" status_out ", "---")
        + "\n"
    )
    for row, (calls, command, status) in zip(rows, ends, strict=True):
        last = [calls, command, status] if level.below else [calls, status]
        text += "  | " + " | ".join(row) + " || " + " | ".join(last) + " |\n"
    return text + "}\n"


def _actions(line: Line, level: MadeLevel) -> tuple[str, str, str]:
    command = f"order_{line.command}" if line.command and level.below else ""
    return "; ".join(line.calls), command, line.status
