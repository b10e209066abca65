"""What else the lowest level of a random hierarchy may have: what no level of the usual shape would show to be translated wrongly.

In: a seed. Out: its hierarchy, the lowest level perhaps with more (`MORE`): a flag that each cycle toggles, a product
that either branch of a choice computes of another range, a real that goes on by sums, counters that lines set back, tables that take
turns whatever the command, or one table for all commands. All of it has few states, so that they can be listed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from random import Random

from tests.small_hierarchies.made import (
    FOURTH,
    STATUSES,
    Domains,
    Hierarchy,
    Line,
    MadeLevel,
    MadeTable,
    cut,
    domains_of,
    hierarchy,
)


@dataclass(frozen=True, slots=True)
class Piece:
    """One thing more.

    Attributes:
        variable: What tables look at; blank for nothing.
        states: With their types; `code`, what the preprocess does to them.
        calls: Procedures for lines, by name.
        values: Of the variable.
        declared: An extern procedure, or an input.
    """

    variable: str = ""
    states: tuple[tuple[str, str], ...] = ()
    code: str = ""
    calls: tuple[tuple[str, str], ...] = ()
    values: tuple[str, ...] = ("false", "true")
    declared: str = ""


MORE: Mapping[str, Piece] = {
    "tick": Piece("tick", (("tick", "bool"),), "tick := not tick"),
    "depth": Piece(
        "near",
        (("near", "bool"), ("depth", "int 0 .. 3")),
        "if depth < 2 { near := depth * depth >= 1 } else { near := depth * depth < 9 }",
        (("deepen", "depth := min(depth + 1, 3)"), ("surface", "depth := 0")),
    ),
    "way": Piece(
        "far",
        (("far", "bool"), ("way", "real 0.0 .. 2.0")),
        "far := way * 0.5 >= 0.75",
        (("go_on", "way := min(2.0, way + 0.75)"), ("go_home", "way := 0.0")),
    ),
    "turns": Piece("", (("which", ""),), "if which = pause { which := go } else { which := pause }"),
    "one": Piece(),
}
SAID: Mapping[str, Piece] = {
    "heard": Piece(
        "heard",
        (("heard", "int 0 .. 2"),),
        values=("0", "1", "2"),
        declared='extern procedure ask reads new_command writes heard python "nowhere:ask" c "ask"',
    ),
    "told": Piece(
        "told",
        (("told", "bool"),),
        declared='extern procedure tell reads status_report writes told python "nowhere:tell" c "tell"',
    ),
    "part": Piece("", (("part", "int 0 .. 6"),), calls=(("divide", "part := 6 / heard"),)),
    "load": Piece(
        "",
        (("rate", "int 0 .. 6"),),
        calls=(("slow", "rate := 6 / load"),),
        declared="input load : int 0 .. 1",
    ),
    "share": Piece(
        "",
        (("share", "int 0 .. 1"),),
        calls=(("spread", "if cur_state = f_state {\n    share := share + 2\n  }"), ("gather", "share := 0")),
    ),
}
"""What any level may have: who is asked, and what is defined only under an assumption or an invariant."""
EVERY = {**MORE, **SAID}
SLIPS = 4
"""Numbers of what may be left out of a hierarchy: its slips, and that it states anything."""


def furnished(seed: int, skipped: frozenset[int] = frozenset()) -> Hierarchy:
    """The hierarchy of this seed, its lowest level perhaps with more; slips may be left out by their numbers."""
    made, random = hierarchy(seed, skipped), Random(f"more {seed}")  # noqa: S311  # repeatable on purpose
    lowest = made.levels[-1]
    if not lowest.below and random.random() >= 0.6:
        made = replace(made, levels=(*made.levels[:-1], _with(lowest, random)))
    if SLIPS - 1 in skipped or random.random() < 0.35:
        return made
    return stating(made, random)


def _with(level: MadeLevel, random: Random) -> MadeLevel:
    more = tuple(name for name in MORE if random.random() < 0.3) or (random.choice(tuple(MORE)),)
    domains = domains_of(waits=level.waits)
    domains |= {MORE[name].variable: ("false", "true") for name in more if MORE[name].variable}
    calls = [call for name in more for call, _ in MORE[name].calls] + ["set_back"] * level.waits
    rest, *others = level.tables
    tables = [rest]
    for table in others:
        if random.random() < 0.2:
            tables.append(table)
            continue
        made = cut(table.name, domains, (), random)
        tables.append(replace(made, lines=tuple(_line(line, calls, random) for line in made.lines)))
    if "turns" in more and random.random() < 0.5:
        tables[0] = replace(rest, lines=tuple(replace(line, status="executing") for line in rest.lines))
    return replace(level, tables=tuple(tables), more=more)


def _line(line: Line, calls: list[str], random: Random) -> Line:
    """The line with a call more, and executing more often than not."""
    said = (*line.calls, random.choice(calls)) if calls and random.random() < 0.6 else line.calls
    return replace(line, calls=said, status="executing" if random.random() < 0.6 else line.status)


# --- what is stated, and asked ---------------------------------------------------------------


def stating(made: Hierarchy, random: Random) -> Hierarchy:
    """The hierarchy with more in any of its levels: a fourth status, extern procedures, and what is stated, true or not."""
    fourth = random.random() < 0.3
    return replace(made, levels=tuple(_stating(level, random, fourth=fourth) for level in made.levels))


def _stating(level: MadeLevel, random: Random, *, fourth: bool) -> MadeLevel:
    if fourth:
        tables = tuple(_with_fourth(table, random) for table in level.tables)
        level = replace(level, tables=tables, statuses=(*STATUSES, FOURTH))
    if random.random() < 0.3:
        return level
    if level.below and random.random() < 0.1 and "one" not in level.more:
        level = replace(level, more=(*level.more, "one"))
    often = {"heard": 0.35, "told": 0.2, "share": 0.2, "load": 0.25}
    more = [name for name, many in often.items() if random.random() < many]
    if "heard" in more:
        more = [name for name in more if name != "load"] + ["part"] * random.randint(0, 1)
    asks = [("ask", random.randint(0, 1))] if "heard" in more else []
    calls = [call for name in more for call, _ in SAID[name].calls]
    if "told" in more:
        if random.random() < 0.5:
            asks.append(("tell", random.randint(0, 1 + bool(level.below))))
        else:
            calls.append("tell")
    level = replace(level, more=(*level.more, *more), asks=tuple(asks))
    cell = "heard" if "heard" in more else ""
    tables = tuple(_told_apart(table, calls, random, cell) for table in level.tables[1:])
    tables = (
        _calling_each(tables[0], [call for call in calls if call not in {"gather", "tell"}]),
        *tables[1:],
    )
    level = replace(level, tables=(level.tables[0], *tables))
    return _declaring(level, random)


def _with_fourth(table: MadeTable, random: Random) -> MadeTable:
    """The table, whose lines take the fourth status as *executing*, most of the time, and now and then say it."""
    lines = []
    for line in table.lines:
        cell = line.cell("status_in")
        if "executing" in cell and random.random() < 0.9:
            inside = cell.removeprefix("in {").removesuffix("}")
            line = line.with_cell("status_in", f"in {{{inside}, {FOURTH}}}")  # noqa: PLW2901
        if line.status in {"executing", "done"} and random.random() < 0.15:
            line = replace(line, status=FOURTH)  # noqa: PLW2901
        lines.append(line)
    return replace(table, lines=tuple(lines))


def _told_apart(table: MadeTable, calls: list[str], random: Random, heard: str) -> MadeTable:
    """The table with calls in its lines, some of them cut in two by what was heard, if anything was."""
    lines: list[Line] = []
    for line in table.lines:
        if heard and random.random() < 0.25 and not line.cell("when"):
            low = random.choice(("0", "0 .. 1"))
            high = "1 .. 2" if low == "0" else "2"
            lines += [
                replace(_calling(line.with_cell(heard, cell), calls, random), name=f"{line.name}{at}")
                for cell, at in ((low, "x"), (high, "y"))
            ]
        else:
            lines.append(_calling(line, calls, random))
    return replace(table, lines=tuple(lines))


def _calling_each(table: MadeTable, calls: list[str]) -> MadeTable:
    """The table, which calls what no line may leave alone: what nothing calls has to be safe whatever the state."""
    first, *others = table.lines
    return replace(table, lines=(replace(first, calls=(*calls, *first.calls)), *others))


def _calling(line: Line, calls: list[str], random: Random) -> Line:
    if not calls or random.random() < 0.6:
        return line
    return replace(line, calls=(random.choice(calls), *line.calls))


def _declaring(level: MadeLevel, random: Random) -> MadeLevel:
    """The level with assumptions, invariants and properties."""
    said: list[str] = []
    if "share" in level.more:
        said.append("invariant never_failed : cur_state /= f_state")
    names: list[str] = []
    if "heard" in level.more and ("part" in level.more or random.random() < 0.4):
        names.append("heard_some")
        said.append(f"assume heard_some {_standing(random)} : heard /= 0")
    if "load" in level.more:
        names.append("loaded")
        said.append(f"assume loaded {_standing(random)} : load /= 0")
    for at in range(random.choice((0, 0, 1, 1, 2))):
        names.append(f"believed{at}")
        said.append(
            f"assume believed{at} {_standing(random)} : {_clause(_atoms(level, inputs=True), random)}"
        )
    inner = _atoms(level, inputs=False)
    said += [f"invariant kept{at} : {_clause(inner, random)}" for at in range(random.choice((0, 0, 1, 1, 2)))]
    for at in range(random.choice((0, 1, 1, 2))):
        every = _atoms(level, inputs=True)
        words = f"{_clause(every, random)} {random.choice(('then', 'until'))} {_clause(every, random)}"
        if random.random() < 0.6:
            more = {**every, **{f"was {name}": values for name, values in every.items()}}
            words = _clause(more, random, 3)
        said.append(f"property stays{at} : {words}")
    if random.random() < 0.3:
        said.append(
            "property fresh : new_command and not was new_command implies inc_command_seen /= was inc_command_seen"
        )
    tables = tuple(
        replace(
            table,
            assuming=tuple(
                name for name in names if random.random() < 0.8 or name in {"heard_some", "loaded"}
            ),
        )
        for table in level.tables
    )
    return replace(level, states=tuple(said), tables=(replace(tables[0], assuming=()), *tables[1:]))


def _standing(random: Random) -> str:
    return random.choice(("monitored", "monitored", "assumed"))


def _atoms(level: MadeLevel, *, inputs: bool) -> Domains:
    """What conditions of a level may speak of, with the values."""
    found: Domains = {
        "cur_state": ("d_state", "f_state", "s1"),
        "new_command": ("false", "true"),
        "status_report": level.statuses,
    }
    if level.below:
        found |= {"begun": ("false", "true"), "status_in": level.statuses, "ref_command_in": level.orders}
        found[f"to_{level.below}.input_command"] = level.orders
    if level.waits:
        found["waited"] = ("0", "1", "2")
    for one in level.more:
        if EVERY[one].variable:
            found[EVERY[one].variable] = EVERY[one].values
    if inputs:
        found["command.input_command"] = level.commands
        if level.below:
            found[f"{level.below}.status_report"] = level.statuses
        else:
            found["there"] = ("false", "true")
    return found


def _clause(atoms: Domains, random: Random, most: int = 2) -> str:
    """A few conditions of which one is to hold; in most cases some values allow it."""
    parts = []
    for name in random.sample(sorted(atoms), random.randint(1, most)):
        value = random.choice(atoms[name])
        if atoms[name] == ("false", "true"):
            parts.append(name if value == "true" else f"not {name}")
        else:
            parts.append(f"{name} {random.choice(('=', '/=', '/='))} {value}")
    if len(parts) > 1 and random.random() < 0.5:
        return f"{' and '.join(parts[:-1])} implies {parts[-1]}"
    return " or ".join(parts)


# --- as text ---------------------------------------------------------------------------------


def states_of(level: MadeLevel) -> list[str]:
    """Its declarations."""
    return [
        f"{name} : {kind or f'{level.name}_command'}"
        for one in level.more
        for name, kind in EVERY[one].states
    ]


def columns_of(level: MadeLevel) -> list[str]:
    """What its tables look at besides."""
    return [EVERY[one].variable for one in level.more if EVERY[one].variable]


def module_of(level: MadeLevel) -> str:
    """The module `notice`; blank where there is nothing to notice."""
    code = [EVERY[one].code for one in level.more if EVERY[one].code]
    if not code:
        return ""
    names = ", ".join(name for one in level.more for name, _ in EVERY[one].states if EVERY[one].code)
    return f"module notice reads {names} writes {names} {{\n" + "".join(f"  {one}\n" for one in code) + "}\n"


def procedures_of(level: MadeLevel) -> list[str]:
    """What its lines call."""
    calls = [call for one in level.more for call in EVERY[one].calls]
    calls += [("set_back", "waited := 0")] * (level.waits and bool(set(level.more) & MORE.keys()))
    declared = [EVERY[one].declared for one in level.more if EVERY[one].declared]
    return [*declared, *(f"procedure {name} {{\n  {does}\n}}" for name, does in calls)]


def tables_of(level: MadeLevel) -> str:
    """How the level chooses its table."""
    if "one" in level.more:
        return f"  table {_first(level).name}\n"
    choices = "".join(
        f"    {command} : {table.name}\n" for command, table in zip(level.commands, level.tables, strict=True)
    )
    by = "which" if "turns" in level.more else "command.input_command"
    return f"  table by {by} {{\n{choices}  }}\n"


def _first(level: MadeLevel) -> MadeTable:
    """The table of the first command that is no PAUSE."""
    return level.tables[1]
