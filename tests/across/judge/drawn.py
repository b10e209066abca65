"""Draws tiny systems: two and three levels of truth values, members of small enumerations and small numbers, and what is required of them.

In: a seed. Out: `Drawn`, files. A system has plain buffers, one of several readers, a level twice, orders and reports, longer periods, late
buffers, restarts, inputs that are refused or moved to the edge, and assumptions, or not: every two of these meet.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import SimpleNamespace

from tests.judge.drawn import _filled, _says

REQUIRED = 2
"""Requirements of a system."""
_TYPES = {"bool": ("true", "false"), "int 0 .. 2": ("0", "1", "2"), "kind": ("p", "q", "r")}
"""Types, with their values."""
_OFTEN = (*_TYPES, "bool", "bool", "bool")
_WORDS = """\
enum kind { p, q, r }
enum motion { pause, go }
enum status { done, executing, failed }
link motions {
  command : motion rest pause
  status : status done done failed failed executing executing
}
"""
_BOSS = """\
use words
commands hand : motions
enum stage { home, out, lost }
input wish : WISH
state at : stage restart RESTART
output busy : bool safe false
table lead {
  | line | at   | OVER  | hand.resting | hand.status || at    | hand  | busy  |
  |------|------|-------|--------------|-------------||-------|-------|-------|
  | go   | home | true  | true         |             || out   | go    | true  |
  | wait | home | true  | false        |             || home  | pause | BUSY  |
  | calm | home | false |              |             || home  | pause | false |
  | busy | out  |       |              | executing   || out   |       | true  |
  | back | out  |       |              | done        || BACK  | pause | BUSY  |
  | fail | out  |       |              | failed      || FAIL  | pause | false |
  | lost | lost | false |              |             || lost  | pause | false |
  | more | lost | true  |              |             || MORE  | pause | BUSY  |
}
level boss { period PERIOD [ms] table lead }
"""
_HAND = """\
use words
serves boss : motions
enum phase { still, going, stuck }
input there : THERE
state now : phase restart stuck
output on : bool safe false
table act {
  | line  | new_command | now   | OVER  || now   | on    | status_out |
  |-------|-------------|-------|-------||-------|-------|------------|
  | start | true        |       |       || going | ON    | executing  |
  | more  | false       | going | false || going | true  | executing  |
  | there | false       | going | true  || THEN  | false | SAID       |
  | idle  | false       | still |       || still | false | done       |
  | bad   | false       | stuck |       || stuck | ON    | failed     |
}
table rest {
  | line | when || now   | on    | status_out |
  |------|------||-------|-------|------------|
  | stop | true || still | ON    | done       |
}
level hand { period PERIOD [ms] table by boss.input_command { pause : rest go : act } }
"""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A drawn system.

    Attributes:
        levels: The program of each level.
        wires: The readers of each buffer.
        late: How many ticks late buffers may be.
        texts: The text of each file but the description.
        parts: The kinds of its parts.
    """

    levels: Mapping[str, str]
    wires: Mapping[str, list[str]]
    late: int
    texts: Mapping[str, str]
    parts: frozenset[str] = frozenset()

    @property
    def files(self) -> dict[str, str]:
        """The text of each file by its name."""
        text = 'name = "drawn"\ngenerated = "generated"\ntick_ms = 10\nrequirements = "requirements.rcs"\n'
        text += f"late_ticks = {self.late}\n" if self.late else ""
        for name, program in self.levels.items():
            text += f'[[level]]\nname = "{name}"\n' + (f'tables = "{program}"\n' if program != name else "")
        text += "[buffers]\n"
        for source, readers in self.wires.items():
            ends = ", ".join(f'"{end}"' for end in readers)
            text += f'"{source}" = {f"[{ends}]" if len(readers) > 1 else ends}\n' if readers else ""
        return {**self.texts, "system.toml": text}


@dataclass
class _Drawing:
    """A system in the making.

    Attributes:
        outputs: The outputs of plain levels, as `LEVEL.NAME`, with their types; `inputs`, those that levels give.
        wires: Each buffer with its readers.
        conditions: What requirements may be about; `outside`, assumptions.
        programs: The text of each program; `levels`, the program of each level.
    """

    random: Random
    parts: set[str] = field(default_factory=set)
    outputs: dict[str, str] = field(default_factory=dict)
    wires: dict[str, list[str]] = field(default_factory=dict)
    conditions: list[str] = field(default_factory=list)
    outside: list[str] = field(default_factory=list)
    programs: dict[str, str] = field(default_factory=dict)
    levels: dict[str, str] = field(default_factory=dict)

    def has(self, part: str, chance: float) -> bool:
        """Draw whether it has a part."""
        there = self.random.random() < chance
        self.parts |= {part} if there else set()
        return there

    def period(self) -> int:
        """Draw a period."""
        return self.random.choice((20, 30)) if self.has("a longer period", 0.2) else 10

    def compared(self, name: str, kind: str) -> Iterator[str]:
        """Yield conditions on a variable."""
        values = _TYPES[kind]
        if kind == "bool":
            yield from (name, name, f"not {name}")
        elif kind == "kind":
            yield from (f"{name} = {value}" for value in values)
        else:
            yield from (f"{name} = 1", f"{name} > 0", f"{name} < 2")
        yield f"was {name}" if kind == "bool" else f"{name} /= was {name}"


def drawn(seed: int) -> Drawn:
    """Draw a system."""
    it = _Drawing(Random(seed))  # noqa: S311  # repeatable on purpose
    if it.has("orders", 0.12):
        _with_orders(it)
    else:
        _plain(it)
    late = it.random.choice((1, 1, 2)) if it.has("late buffers", 0.2) else 0
    stated = [*_assumed(it), *_required(it)]
    files = {
        "rcsc.toml": 'name = "drawn"\n',
        "words.rcs": _WORDS,
        "requirements.rcs": "\n".join(stated) + "\n",
    }
    files |= {f"{name}.rcs": text for name, text in it.programs.items()}
    return Drawn(it.levels, it.wires, late, files, frozenset(it.parts))


def written(made: Drawn, folder: Path) -> Path:
    """Write the files of a system; return its description."""
    for name, text in made.files.items():
        (folder / name).write_text(text)
    return folder / "system.toml"


# --- levels -----------------------------------------------------------------------------------


def _plain(it: _Drawing) -> None:
    random = it.random
    names = "abc"[: random.choice((2, 2, 2, 3))]
    twice = len(names) == 3 and it.has("a level twice", 0.4)
    programs = names[:2] if twice else names
    types = {name: random.choice(_OFTEN) for name in programs}
    also = {name: random.choice(("", "", "", *_TYPES)) for name in programs}
    it.levels = {name: "b" if twice and name == "c" else name for name in names}
    for name, program in it.levels.items():
        it.outputs[f"{name}.o"] = types[program]
        if also[program]:
            it.outputs[f"{name}.v"] = also[program]
    common = random.choice(_OFTEN) if it.has("one output outside to several readers", 0.25) else ""
    reads = dict[str, str]()
    for name in names:
        program = it.levels[name]
        others = {one: kind for one, kind in it.outputs.items() if not one.startswith(f"{name}.")}
        if program in reads:
            others = {one: kind for one, kind in others.items() if kind == reads[program]}
        if not others:
            continue
        source = random.choice(sorted(others))
        reads[program] = others[source]
        it.wires.setdefault(source, []).append(f"{name}.x")
        it.conditions += it.compared(f"{name}.x", reads[program])
    outside = {name: common or random.choice(("", "", *_OFTEN)) for name in programs}
    for name, program in it.levels.items():
        if outside[program]:
            source = "plant.y" if common else f"plant.y_{name}"
            it.wires.setdefault(source, []).append(f"{name}.y")
            it.outside += it.compared(source, outside[program])
            it.conditions += it.compared(source, outside[program])
            it.conditions += it.compared(f"{name}.y", outside[program])
    it.parts |= (
        {"one output to several readers"}
        if any(len(readers) > 1 and not source.startswith("plant") for source, readers in it.wires.items())
        else set()
    )
    for program in programs:
        it.programs[program] = _level(
            it,
            program,
            {"x": reads.get(program, ""), "y": outside[program]},
            {"o": types[program], "v": also[program]},
        )
    for output, kind in it.outputs.items():
        it.conditions += it.compared(output, kind)


def _level(it: _Drawing, name: str, inputs: Mapping[str, str], outputs: Mapping[str, str]) -> str:
    random = it.random
    lines, columns = ["use words"], list[tuple[str, tuple[str, ...]]]()
    for one, kind in inputs.items():
        if kind:
            edge = " clamp" if one == "y" and kind.startswith("int") and it.has("clamped", 0.3) else ""
            it.parts |= {"refused"} if one == "y" and kind != "bool" and not edge else set()
            lines.append(f"input {one} : {kind}{edge}")
            if one == "x" or random.random() < 0.7:
                columns.append(_column(it, one, kind))
    most = random.choice((0, 0, 1, 1, 2)) if columns else 2
    state = random.choice(("n", "n", "m")) if most else ""
    kind = "bool" if state == "m" else f"int 0 .. {most}"
    values = _TYPES["bool"] if state == "m" else tuple(map(str, range(most + 1)))
    if state:
        begins = f" = {random.choice(values)}" if random.random() < 0.3 else ""
        restarts = f" restart {random.choice(values)}" if it.has("restart", 0.3) else ""
        lines.append(f"state {state} : {kind}{begins}{restarts}")
        columns.append((state, values))
        for level, program in it.levels.items():
            if program == name:
                it.conditions += (
                    [f"{level}.{state}"] if state == "m" else [f"{level}.n = {v}" for v in values]
                )
    gives = {one: kind for one, kind in outputs.items() if kind}
    for one, of in gives.items():
        safe = f" safe {random.choice(_TYPES[of])}" if of == "bool" or it.has("safe", 0.4) else ""
        lines.append(f"output {one} : {of}{safe}")
    results = {**({state: values} if state else {}), **{one: _TYPES[of] for one, of in gives.items()}}
    rows = [""]
    for _, cells in columns:
        rows = [f"{row} {cell} |" for row in rows for cell in cells]
    head = "".join(f" {column} |" for column, _ in columns)
    table = [f"  | line |{head}|" + "".join(f" {one} |" for one in results)]
    table += ["  |---|" + "---|" * len(columns) + "|" + "---|" * len(results)]
    copied = [one for one, of in inputs.items() if of]
    for at, row in enumerate(rows):
        then = ""
        for one, choices in results.items():
            same = [
                leaf for leaf in copied if inputs[leaf] == (gives.get(one) or ("bool" if one == "m" else ""))
            ]
            then += f" {random.choice((*choices, *choices, *same, *([one] if one == state else [])))} |"
        table.append(f"  | r{at} |{row}|{then}")
    text = [
        *lines,
        f"table of_{name} {{",
        *table,
        "}",
        f"level {name} {{ period {it.period()} [ms] table of_{name} }}",
    ]
    return "\n".join(text) + "\n"


def _column(it: _Drawing, name: str, kind: str) -> tuple[str, tuple[str, ...]]:
    """Draw a column, and its cells, which cover all cases."""
    if kind == "bool":
        return name, ("true", "false")
    if kind == "kind":
        return it.random.choice(
            ((name, ("p", "q", "r")), (name, ("in {p, r}", "q")), (f"{name} = q", ("true", "false")))
        )
    return it.random.choice(
        ((name, ("0", "1", "2")), (name, ("< 2", "2")), (f"{name} = 1", ("true", "false")))
    )


def _with_orders(it: _Drawing) -> None:
    random = it.random
    it.levels = {"boss": "boss", "hand": "hand"}
    for name, variable, text in (("boss", "wish", _BOSS), ("hand", "there", _HAND)):
        kind = random.choice(_OFTEN)
        it.parts |= {"refused"} if kind != "bool" else set()
        over = {"bool": variable, "kind": f"{variable} = q", "int 0 .. 2": f"{variable} > 0"}[kind]
        for word, choices in {
            "WISH": (kind,), "THERE": (kind,), "OVER": (over,), "PERIOD": (str(it.period()),), "RESTART": ("lost", "lost", "home"),
            "BUSY": ("true", "false"), "BACK": ("home", "lost"), "FAIL": ("home", "lost"), "MORE": ("home", "lost"),
            "ON": ("true", "false"),
        }.items():  # fmt: skip
            while word in text:
                text = text.replace(word, random.choice(choices), 1)  # noqa: PLW2901  # filled in word by word
        ends = random.choice((("still", "done"), ("still", "done"), ("stuck", "failed")))
        it.programs[name] = text.replace("THEN ", ends[0]).replace("SAID ", ends[1])
        it.wires[f"plant.{variable}"] = [f"{name}.{variable}"]
        it.outside += it.compared(f"plant.{variable}", kind)
        it.conditions += it.compared(f"plant.{variable}", kind)
    it.conditions += [
        "boss.busy", "boss.busy", "hand.on", "hand.on", "not hand.on", "hand.new_command", "boss.at = lost", "hand.now = stuck",
        "hand.now = going", "boss.to_hand.input_command = go", "hand.to_boss.status_report = done", "boss.hand.resting",
        "hand.boss.input_command = go", "boss.from_hand.status_report = failed", "not boss.busy", "was hand.on",
    ]  # fmt: skip


# --- what is said -----------------------------------------------------------------------------


def _condition(it: _Drawing, of: list[str]) -> str:
    """Draw a condition on one variable, or on two."""
    first, second = it.random.choice(of), it.random.choice(of)
    return it.random.choice((first, first, first, f"{first} or {second}", f"{first} and {second}"))


def _required(it: _Drawing) -> Iterator[str]:
    drawing = SimpleNamespace(random=it.random)
    for at in range(REQUIRED):
        if it.random.random() < 0.25:
            said = it.random.choice(("{} implies {}", "{} or {} or {}", "not ({} and {})"))
            yield f"property r{at} : {_filled(drawing, said, lambda: it.random.choice(it.conditions))}"  # type: ignore[arg-type]  # draws alone
            continue
        yield f"requirement r{at} : {_filled(drawing, _says(it.random), lambda: _condition(it, it.conditions))}"  # type: ignore[arg-type]  # likewise


def _assumed(it: _Drawing) -> Iterator[str]:
    if it.outside and it.has("assumed", 0.15):
        said = it.random.choice(
            (
                "never ({})",
                "at least {t} apart, {}",
                "when {}, for {t}, {}",
                "always ({} or {})",
                "whenever was {}, at once not {}",
            )
        )
        drawing = SimpleNamespace(random=it.random)
        yield f"assume e assumed : {_filled(drawing, said, lambda: it.random.choice(it.outside))}"  # type: ignore[arg-type]  # likewise
