"""What else the lowest level of a random hierarchy may have: what no level of the usual shape would show to be translated wrongly.

In: a seed. Out: its hierarchy, the lowest level perhaps with more (`MORE`): a flag that each cycle toggles, a product
that either branch of a choice computes of another range, a real that goes on by sums, counters that lines set back, tables that take
turns whatever the command, or one table for all commands. All of it has few states, so that they can be listed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from random import Random

from tests.hierarchies_made import Hierarchy, Line, MadeLevel, MadeTable, cut, domains_of, hierarchy


@dataclass(frozen=True, slots=True)
class Piece:
    """One thing more.

    Attributes:
        variable: What tables look at; blank for nothing.
        states: With their types; `code`, what the preprocess does to them.
        calls: Procedures for lines, by name.
    """

    variable: str = ""
    states: tuple[tuple[str, str], ...] = ()
    code: str = ""
    calls: tuple[tuple[str, str], ...] = ()


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


def furnished(seed: int, skipped: frozenset[int] = frozenset()) -> Hierarchy:
    """The hierarchy of this seed, its lowest level perhaps with more; slips may be left out by their numbers."""
    made, random = hierarchy(seed, skipped), Random(f"more {seed}")  # noqa: S311  # repeatable on purpose
    lowest = made.levels[-1]
    if lowest.below or random.random() < 0.6:
        return made
    return replace(made, levels=(*made.levels[:-1], _with(lowest, random)))


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


# --- as text ---------------------------------------------------------------------------------


def states_of(level: MadeLevel) -> list[str]:
    """Its declarations."""
    return [
        f"{name} : {kind or f'{level.name}_command'}" for one in level.more for name, kind in MORE[one].states
    ]


def columns_of(level: MadeLevel) -> list[str]:
    """What its tables look at besides."""
    return [MORE[one].variable for one in level.more if MORE[one].variable]


def module_of(level: MadeLevel) -> str:
    """The module `notice`; blank where there is nothing to notice."""
    code = [MORE[one].code for one in level.more if MORE[one].code]
    if not code:
        return ""
    names = ", ".join(name for one in level.more for name, _ in MORE[one].states)
    return f"module notice reads {names} writes {names} {{\n" + "".join(f"  {one}\n" for one in code) + "}\n"


def procedures_of(level: MadeLevel) -> list[str]:
    """What its lines call."""
    calls = [call for one in level.more for call in MORE[one].calls]
    calls += [("set_back", "waited := 0")] * (level.waits and bool(level.more))
    return [f"procedure {name} {{\n  {does}\n}}" for name, does in calls]


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
