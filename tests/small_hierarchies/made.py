"""Small hierarchies by seed: the shape of the shipped levels, and some slip of the hand in about half of them.

A hierarchy is a chain of one to three levels. Every level has a PAUSE table and a table for each other command; the levels above the
lowest number their orders, wait for the echo and defer their next state, as section 9 of Haynes et al. (1984) has it. What
a level may have besides: a second stage, a field that goes down with the command, a counter, tables cut at random, DEFAULT, assumptions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from random import Random

STATUSES = ("done", "executing", "failed")
FOURTH = "lost"
"""A status that answers no command."""
SPOTS = ("p", "q")
MOST_WAITED = 2


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a table: its cells by variable, and what it does."""

    name: str
    cells: tuple[tuple[str, str], ...]
    calls: tuple[str, ...]
    command: str
    status: str

    def cell(self, variable: str) -> str:
        """The text of a cell; blank where the line does not care."""
        return dict(self.cells).get(variable, "")

    def with_cell(self, variable: str, text: str) -> "Line":
        """The line with one cell changed; a blank one goes."""
        cells = {**dict(self.cells), variable: text}
        return replace(self, cells=tuple((name, said) for name, said in cells.items() if said))


@dataclass(frozen=True, slots=True)
class MadeTable:
    """A table for one command; `default` is blank, `DEFAULT` or `DEFAULT unreachable`."""

    name: str
    lines: tuple[Line, ...]
    default: str = ""
    assumed: bool = False
    assuming: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class MadeLevel:
    """A level as it is to be written.

    Attributes:
        below: The subordinate's name; blank at the bottom.
        commands: What it can be told, PAUSE first; `orders`, what it tells its subordinate.
        said: Pieces of its modules, by what they do (`RIGHT`).
        assumption: A condition, or blank.
        waits: Whether it has a counter; `field`, whether its order names a spot; `passes`, whether the subordinate's does.
        more: What else it has (`hierarchies_more`).
        states: What else it states: assumptions, invariants and properties, as declared.
        statuses: What reports can say.
        asks: Whom it asks where: extern procedures before and after its table, by the place in the list that they take.
    """

    name: str
    below: str
    commands: tuple[str, ...]
    orders: tuple[str, ...]
    tables: tuple[MadeTable, ...]
    said: tuple[tuple[str, str], ...]
    assumption: str = ""
    waits: bool = False
    field: bool = False
    passes: bool = False
    more: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    statuses: tuple[str, ...] = STATUSES
    asks: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Hierarchy:
    """Levels from the top down, and the slips in them, in words."""

    levels: tuple[MadeLevel, ...]
    slips: tuple[str, ...] = field(default=(), compare=False)

    @property
    def lines(self) -> tuple[int, ...]:
        """How many lines the tables of each level have."""
        return tuple(sum(len(table.lines) for table in level.tables) for level in self.levels)

    @property
    def outside(self) -> str:
        """Who stands below the lowest level; blank where nobody does."""
        return self.levels[-1].below


RIGHT = {
    "taken": "command.inc_command /= inc_command_seen",
    "seen": "inc_command_seen := command.inc_command",
    "raised": "new_command := true",
    "begun_off": "begun := false",
    "released": "begun and ECHO = SENT",
    "sampled": "ECHO = SENT",
    "deferred": "ECHO = SENT",
    "numbered": "COMMAND /= old_command",
    "next": "(SENT + 1) mod 65536",
    "old": "old_command := COMMAND",
    "echo": "report.inc_command_echo := inc_command_seen",
    "echoed": "report.ref_command_echo := command.input_command",
    "status": "report.status_report := status_report",
}
WRONG = {
    "taken": ("command.inc_command /= inc_command_seen or status_report = failed", "status_report = done"),
    "seen": ("", "if new_command { inc_command_seen := command.inc_command }"),
    "raised": ("", "new_command := not new_command"),
    "begun_off": ("", "begun := true"),
    "released": ("ECHO = SENT", "begun", "begun or ECHO = SENT", "begun and ECHO /= SENT"),
    "sampled": ("SENT = SENT", "ECHO /= SENT", "not new_command"),
    "deferred": ("SENT = SENT", "begun", "new_command", "ECHO = SENT or status_in = done"),
    "numbered": ("COMMAND /= COMMAND", "COMMAND /= old_command and begun", "COMMAND = old_command", "new_command"),
    "next": ("(SENT + 2) mod 65536", "(ECHO + 1) mod 65536", "SENT"),
    "old": ("", "if begun { old_command := COMMAND }"),
    "echo": ("", "if not new_command { report.inc_command_echo := inc_command_seen }"),
    "echoed": ("", "report.ref_command_echo := pause", "if status_report = done { report.ref_command_echo := command.input_command }"),
    "status": ("", "report.status_report := done"),
}  # fmt: skip
"""Slips in the modules of preprocess and postprocess."""
BOTTOM = ("seen", "echo", "echoed", "status", "taken")
"""Which of them the lowest level has."""
ODD = ("(SENT + 2) mod 65536", "(ECHO + 1) mod 65536")
"""What makes numbers other than one after the other."""


# --- what is right ------------------------------------------------------------------------------


def hierarchy(seed: int, skipped: frozenset[int] = frozenset()) -> Hierarchy:
    """The hierarchy of this seed; slips may be left out by their numbers, to see which of them matter."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    many = random.choices((1, 2, 3), (55, 38, 7))[0]
    outside = random.random() < 0.4 if many == 1 else random.random() < 0.1
    levels: list[MadeLevel] = []
    for at in reversed(range(many)):
        lowest = at == many - 1 and not outside
        under = levels[0] if levels else None
        levels.insert(0, _bottom(at, random) if lowest else _middle(at, under, random))
    made = Hierarchy(tuple(levels))
    for number in range(random.choices((0, 1, 2, 3), (25, 35, 25, 15))[0]):
        if number not in skipped:
            made = slipped(made, Random(f"{seed} {number}"))  # noqa: S311  # likewise
    return made


def _bottom(at: int, random: Random) -> MadeLevel:
    commands = ("pause", "go", "stay")[: random.choice((2, 2, 3))]
    waits = random.random() < 0.3
    tables = [MadeTable("rest", (Line("1", (("when", "true"),), ("state(d_state)",), "", "done"),))]
    for command in commands[1:]:
        if random.random() < 0.35:
            tables.append(cut(f"{command}_table", domains_of(waits=waits), (), random))
        else:
            tables.append(_going(f"{command}_table", waits=waits))
    said = tuple((name, RIGHT[name]) for name in BOTTOM)
    field_ = random.random() < 0.2
    return MadeLevel(f"l{at}", "", commands, (), tuple(tables), said, waits=waits, field=field_)


def _going(name: str, *, waits: bool) -> MadeTable:
    """Begins with a new command, and is done when the input says so, or fails when it has waited."""
    new, old = ("new_command", "true"), ("new_command", "false")
    lines = [Line("1", (new,), ("state(s1)",), "", "executing")]
    if waits:
        less, most = ("waited", f"< {MOST_WAITED}"), ("waited", f"{MOST_WAITED}")
        lines.append(
            Line("2", (old, ("cur_state", "s1"), ("there", "false"), less), ("wait",), "", "executing")
        )
        lines.append(
            Line(
                "2a", (old, ("cur_state", "s1"), ("there", "false"), most), ("state(f_state)",), "", "failed"
            )
        )
    else:
        lines.append(Line("2", (old, ("cur_state", "s1"), ("there", "false")), (), "", "executing"))
    lines.append(Line("3", (old, ("cur_state", "s1"), ("there", "true")), ("state(d_state)",), "", "done"))
    lines.append(Line("4", (old, ("cur_state", "d_state")), (), "", "done"))
    lines.append(Line("5", (old, ("cur_state", "f_state")), (), "", "failed"))
    return MadeTable(name, tuple(lines))


def _middle(at: int, under: MadeLevel | None, random: Random) -> MadeLevel:
    orders = under.commands if under else ("pause", "go")
    commands = ("pause", "work", "toil")[: random.choice((2, 2, 2, 3))]
    rest = random.choice(("next", "next", "direct"))
    calm = Line("1", (("when", "true"),), ("begin", "nextstate(d_state)"), "pause", "done")
    tables = [MadeTable("rest", (calm,) if rest == "next" else (replace(calm, calls=("begin",)),))]
    assumption = ""
    for command in commands[1:]:
        name = f"{command}_table"
        if random.random() < 0.25:
            tables.append(cut(name, domains_of(orders), orders, random))
        else:
            plan = tuple(random.choice(orders[1:]) for _ in range(random.choice((1, 1, 2))))
            tables.append(_working(name, plan, random))
            assumption = assumption or _in_step(plan)
    if random.random() < 0.5 and assumption:
        tables = [replace(table, assumed=table.name != "rest") for table in tables]
    else:
        assumption = ""
    passes = under is not None and under.field
    field_ = passes or random.random() < 0.1
    said = tuple(RIGHT.items())
    below = under.name if under else "plant"
    return MadeLevel(
        f"l{at}", below, commands, orders, tuple(tables), said, assumption, field=field_, passes=passes
    )


def _in_step(plan: Sequence[str]) -> str:
    """What each state of a plan says of the order that is answered; never while a new command waits."""
    at_rest = "cur_state in {d_state, f_state} and ref_command_in = pause"
    ways = [f"cur_state = s{at} and ref_command_in = {order}" for at, order in enumerate(plan, 1)]
    return "not new_command implies " + " or ".join([at_rest, *ways])


def _working(name: str, plan: Sequence[str], random: Random) -> MadeTable:
    """One order after the other, each until it is done."""
    old = ("new_command", "false")
    lines = [Line("0", (("new_command", "true"),), ("begin", "nextstate(s1)"), plan[0], "executing")]
    for at, order in enumerate(plan, 1):
        here = (old, ("ref_command_in", order), ("cur_state", f"s{at}"))
        last = at == len(plan)
        lines += [
            Line(f"{at}a", (*here, ("status_in", "executing")), (), "", "executing"),
            Line(f"{at}b", (*here, ("status_in", "failed")), ("nextstate(f_state)",), "pause", "failed"),
            Line(
                f"{at}c",
                (*here, ("status_in", "done")),
                ("nextstate(d_state)" if last else f"nextstate(s{at + 1})",),
                "pause" if last else plan[at],
                "done" if last else "executing",
            ),
        ]
    lines.append(Line("8", (old, ("cur_state", "d_state")), (), "pause", "done"))
    lines.append(Line("9", (old, ("cur_state", "f_state")), (), "pause", "failed"))
    return MadeTable(
        name, tuple(lines), random.choice(("", "DEFAULT", "DEFAULT unreachable", "DEFAULT unreachable"))
    )


Domains = dict[str, tuple[str, ...]]


def domains_of(orders: tuple[str, ...] = (), *, waits: bool = False) -> Domains:
    """The test variables of a level and their values."""
    found: Domains = {"new_command": ("false", "true"), "cur_state": ("d_state", "f_state", "s1")}
    if orders:
        found |= {"ref_command_in": orders, "status_in": STATUSES}
    else:
        found["there"] = ("false", "true")
    if waits:
        found["waited"] = tuple(map(str, range(MOST_WAITED + 1)))
    return found


def cut(name: str, domains: Domains, orders: tuple[str, ...], random: Random) -> MadeTable:
    """A table of boxes cut at random, so that exactly one line matches; what the lines do is random, too."""
    whole, boxes = domains, [domains]
    for _ in range(random.randint(1, 4)):
        box, variable = random.choice(_wide(boxes))
        boxes.remove(box)
        at = random.randint(1, len(box[variable]) - 1)
        boxes += [{**box, variable: box[variable][:at]}, {**box, variable: box[variable][at:]}]
    lines = [_does(f"{at}", _cells(box, whole), orders, random) for at, box in enumerate(boxes, 1)]
    return MadeTable(name, tuple(lines))


def _wide(boxes: Sequence[Domains]) -> list[tuple[Domains, str]]:
    return [(box, variable) for box in boxes for variable, values in box.items() if len(values) > 1]


def _cells(box: Domains, whole: Domains) -> tuple[tuple[str, str], ...]:
    cells = [(name, _cell(values)) for name, values in box.items() if values != whole[name]]
    return tuple(cells) or (("when", "true"),)


def _cell(values: tuple[str, ...]) -> str:
    if len(values) == 1:
        return values[0]
    if values[0].isdigit():
        return f"{values[0]} .. {values[-1]}"
    return "in {" + ", ".join(values) + "}"


def _does(name: str, cells: tuple[tuple[str, str], ...], orders: tuple[str, ...], random: Random) -> Line:
    state = random.choice(("d_state", "f_state", "s1"))
    calls: list[str] = []
    if orders and random.random() < 0.5:
        calls.append("begin")
    if random.random() < 0.6:
        calls.append(f"nextstate({state})" if orders else f"state({state})")
    command = random.choice(("", *orders)) if orders else ""
    return Line(name, cells, tuple(calls), command, random.choice(("", *STATUSES)))


# --- what is wrong ------------------------------------------------------------------------------


def slipped(made: Hierarchy, random: Random) -> Hierarchy:
    """The hierarchy with one slip more."""
    at = random.randrange(len(made.levels))
    level = made.levels[at]
    way = random.choice((_in_module, _in_module, _in_table, _in_table, _in_assumption))
    other, words = way(level, random)
    levels = (*made.levels[:at], other, *made.levels[at + 1 :])
    return Hierarchy(levels, (*made.slips, f"{level.name}: {words}"))


def _in_module(level: MadeLevel, random: Random) -> tuple[MadeLevel, str]:
    name, _ = random.choice(level.said)
    wrong = random.choice(WRONG[name])
    said = tuple((one, wrong if one == name else text) for one, text in level.said)
    return replace(level, said=said), f"{name}: `{wrong}`"


def _in_assumption(level: MadeLevel, random: Random) -> tuple[MadeLevel, str]:
    if not level.below:
        return _in_table(level, random)
    state, order = random.choice(("d_state", "f_state", "s1")), random.choice(level.orders)
    condition = random.choice(
        (
            f"cur_state = {state} implies ref_command_in = {order}",
            f"not new_command and cur_state = {state} implies status_in /= failed",
            f"begun implies ref_command_in = {order}",
            f"new_command implies not begun or cur_state /= {state}",
        )
    )
    tables = tuple(replace(table, assumed=True) for table in level.tables)
    return replace(level, assumption=condition, tables=tables), f"assumes `{condition}`"


def _in_table(level: MadeLevel, random: Random) -> tuple[MadeLevel, str]:
    at = random.randrange(len(level.tables))
    table = level.tables[at]
    row = random.randrange(len(table.lines))
    line = table.lines[row]
    lines, words = random.choice(LINE_SLIPS)(line, level, random)
    other = replace(table, lines=(*table.lines[:row], *lines, *table.lines[row + 1 :]))
    if not other.lines:
        return level, "nothing"
    tables = (*level.tables[:at], other, *level.tables[at + 1 :])
    return replace(level, tables=tables), f"line {line.name} of {table.name} {words}"


Slip = Callable[[Line, MadeLevel, Random], tuple[tuple[Line, ...], str]]


def _dropped(_line: Line, _level: MadeLevel, _random: Random) -> tuple[tuple[Line, ...], str]:
    return (), "is dropped"


def _widened(line: Line, _level: MadeLevel, random: Random) -> tuple[tuple[Line, ...], str]:
    variable, _ = random.choice(line.cells)
    wider = line.with_cell(variable, "")
    if not wider.cells:
        wider = line.with_cell(variable, "").with_cell("when", "true")
    return (wider,), f"does not look at {variable}"


def _other_cell(line: Line, level: MadeLevel, random: Random) -> tuple[tuple[Line, ...], str]:
    domains = domains_of(level.orders, waits=level.waits)
    known = [variable for variable, _ in line.cells if variable in domains]
    if not known:
        return _dropped(line, level, random)
    variable = random.choice(known)
    value = random.choice(domains[variable])
    return (line.with_cell(variable, value),), f"has {variable} = {value}"


def _other_state(line: Line, level: MadeLevel, random: Random) -> tuple[tuple[Line, ...], str]:
    setter = random.choice(("state", "nextstate")) if level.below else "state"
    call = f"{setter}({random.choice(('d_state', 'f_state', 's1', 's2'))})"
    calls = tuple(one for one in line.calls if "(" not in one)
    if random.random() < 0.3:
        return (replace(line, calls=calls),), "sets no state"
    return (replace(line, calls=(*calls, call)),), f"sets {call}"


def _other_command(line: Line, level: MadeLevel, random: Random) -> tuple[tuple[Line, ...], str]:
    if not level.below:
        return _other_status(line, level, random)
    command = random.choice(("", *level.orders))
    return (replace(line, command=command),), f"orders {command or 'nothing'}"


def _other_status(line: Line, _level: MadeLevel, random: Random) -> tuple[tuple[Line, ...], str]:
    status = random.choice(("", *STATUSES))
    return (replace(line, status=status),), f"says {status or 'nothing'}"


def _not_begun(line: Line, level: MadeLevel, random: Random) -> tuple[tuple[Line, ...], str]:
    if "begin" not in line.calls:
        return _other_state(line, level, random)
    return (replace(line, calls=tuple(call for call in line.calls if call != "begin")),), "does not begin"


LINE_SLIPS: tuple[Slip, ...] = (
    _dropped, _widened, _other_cell, _other_state, _other_command, _other_status, _not_begun,
)  # fmt: skip
