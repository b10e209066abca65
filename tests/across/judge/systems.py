"""Systems of two and three small levels drawn at random, all of one shape, and the same systems on Python executors.

In: a seed. Out: files; a system that steps. Systems of many shapes are drawn by `drawn`, and all of their runs are in `truth`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

from rcsc.compose.counterexample.rerun import make
from rcsc.compose.proof.system import read_systems
from rcsc.compose.together.words import stated_across
from rcsc.lang.model import Program
from rcsc.run.buffers import CommonMemory
from rcsc.run.description import Description, description
from rcsc.run.levels import running_level
from rcsc.run.system import System, executors, signatures


@dataclass(frozen=True, slots=True)
class Drawn:
    """A drawn system; `periods`, in ticks of 10 ms."""

    levels: tuple[str, ...]
    files: Mapping[str, str]


class LateMemory(CommonMemory):
    """Common memory of which readers see each buffer as late as is said.

    Attributes:
        past: What each buffer held after each of the last ticks, the newest last; None where nothing was there.
        by: How late each is seen.
        most: How late one is seen at most.
    """

    def __init__(self, most: int) -> None:
        super().__init__()
        self.most = most
        self.past: dict[str, tuple[Any, ...]] = {}
        self.by: dict[str, int] = {}

    def latest(self, name: str) -> Any:
        """Return what the buffer held then; what it holds where none is late."""
        if not self.most:
            return super().latest(name)
        past = self.past.get(name, ())
        by = self.by.get(name, 0)
        return past[-1 - by] if by < len(past) else None

    def written(self) -> CommonMemory:
        """Return the memory as its writers left it."""
        memory = CommonMemory()
        for name, values in self._held.items():
            memory.publish(name, values)
        return memory

    def holds(self, names: Any) -> None:
        """Note what these buffers hold from now on, for a tick."""
        for name in names:
            self.past[name] = (*self.past.get(name, ()), self._held.get(name))[-1 - self.most :]


def drawn(seed: int, late: int = 0) -> Drawn:
    """Draw a system whose levels are `a`, `b` and perhaps `c`, each with inputs `x` and `y`, a state `n` and an output `o`.

    Args:
        seed: Of what is drawn.
        late: How many ticks late its buffers may be.
    """
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    names = tuple("abc"[: random.choice((2, 2, 3))])
    files = {"rcsc.toml": 'name = "drawn"\n'}
    wires = list[str]()
    for name in names:
        files[f"{name}.rcs"] = _level(random, name)
        others = [other for other in names if other != name]
        wires.append(f'"{random.choice(others)}.o" = "{name}.x"')
    wires = list({wire.partition(" ")[0]: wire for wire in wires}.values())  # an output feeds one input here
    for name in names:
        wires.append(f'"plant.y_{name}" = "{name}.y"')
    tick = 'name = "drawn"\ngenerated = "generated"\ntick_ms = 10\nrequirements = "requirements.rcs"\n'
    tick += f"late_ticks = {late}\n" if late else ""
    levels = "".join(f'[[level]]\nname = "{name}"\n' for name in names)
    files["system.toml"] = tick + levels + "[buffers]\n" + "\n".join(wires) + "\n"
    files["requirements.rcs"] = (
        "\n".join(
            _requirements(
                random,
                names,
                {name: files[f"{name}.rcs"].partition("input y")[2].partition("state")[0] for name in names},
            )
        )
        + "\n"
    )
    return Drawn(names, files)


def _level(random: Random, name: str) -> str:
    kind = random.choice(("bool", "int 0 .. 2"))
    rows = [
        f"  | r{at} | {x} | {y} | {n} || {random.choice(('n', '0', '1', '2', n))} | {random.choice(('true', 'false'))} |"
        for at, (x, y, n) in enumerate(product(("true", "false"), ("true", "false"), "012"))
    ]
    over = "y" if kind == "bool" else "y > 0"
    restart = random.choice(("", " restart 2"))
    return "\n".join(
        [
            "input x : bool",
            f"input y : {kind}",
            f"state n : int 0 .. 2{restart}",
            f"output o : bool safe {random.choice(('true', 'false'))}",
            f"table of_{name} {{",
            f"  | line | x | {over} | n || n | o |",
            "  |------|---|---|---||---|---|",
            *(row.replace("| n |", "| n |") for row in rows),
            "}",
            f"level {name} {{ period {random.choice((10, 10, 20, 30))} [ms] table of_{name} }}",
        ]
    )


def _requirements(random: Random, names: tuple[str, ...], files: Mapping[str, str]) -> Iterator[str]:
    def atom() -> str:
        name = random.choice(names)
        party = f"plant.y_{name}"
        return random.choice(
            (f"{name}.o", f"{name}.n = {random.randrange(3)}", f"{name}.x", f"{name}.n > {random.randrange(2)}", f"not {name}.o",
             f"was {name}.o", party if "bool" in files[name] else f"{name}.o")
        )  # fmt: skip

    for at in range(4):
        p, q, r = atom(), atom(), atom()
        cycles = random.randrange(1, 4)
        said = random.choice(
            (f"always ({p} implies {q})", f"always ({p} or {q} or {r})", f"never ({p} and {q} and {r})",
             f"when {p}, within {cycles} cycles, {q}",
             f"whenever {p} and {q}, next ({r})", f"when {p}, for {cycles} cycles, {q}", f"after {p}, always ({q} or {r})",
             f"always ({p} implies once ({q}))", f"while {p}, when {q}, within {cycles} cycles, {r}", f"only after {p}, {q}")
        )  # fmt: skip
        yield f"requirement r{at} : {said}"


# --- as it runs --------------------------------------------------------------------------------


@dataclass(slots=True)
class Running:
    """A drawn system on Python executors."""

    path: Path
    system: System = field(init=False)
    memory: LateMemory = field(init=False)
    described: Description = field(init=False)
    program: Program = field(init=False)
    inputs: dict[str, tuple[Any, ...]] = field(init=False)

    def __post_init__(self) -> None:
        systems, _ = read_systems(self.path)
        programs = {name: ts.program for name, ts in systems.items()}
        self.described = description(self.path)
        make(programs.values(), self.described.generated, altered=False)
        signs = signatures(self.described)
        by_level = executors(self.described, signs, "python")
        levels = tuple(
            running_level(spec, self.described, signs[spec.name], by_level[spec.name], {})
            for spec in self.described.levels
        )
        self.memory = LateMemory(self.described.late_ticks)
        self.system = System(self.described, levels, (), self.memory)
        stated = stated_across(self.described, programs)
        assert stated is not None
        self.program = stated[0]
        self.inputs = {
            name: (False, True) if "bool" in str(ts.kinds["y"]).lower() else (0, 1, 2, 3)  # 3 is refused
            for name, ts in systems.items()
        }

    def inputs_of(self, name: str) -> tuple[Any, ...]:
        level = self.system.level(name)
        return level.value("x"), level.value("y")


def written(made: Drawn, folder: Path) -> Path:
    """Write the files of a system; return its description."""
    for name, text in made.files.items():
        (folder / name).write_text(text)
    return folder / "system.toml"
