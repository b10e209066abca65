"""Systems of two and three small levels drawn at random, and the same systems as they run, for every state that they reach.

In: a seed. Out: files; of a requirement the shortest run that breaks it, or none. The judge steps `run.system.System` on Python executors,
restarts levels as `run.adopt` does, publishes what stands outside, and steps monitors by themselves: it shares nothing with the product.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

from rcsc.compose.counterexample.rerun import make
from rcsc.compose.proof.system import read_systems
from rcsc.compose.together.words import stated_across
from rcsc.lang.model import Program, Property, earlier
from rcsc.lang.over_time.past import negation
from rcsc.lang.over_time.run import Watch
from rcsc.run.buffers import CommonMemory
from rcsc.run.description import Description, description
from rcsc.run.levels import StateTableError, running_level
from rcsc.run.system import System, executors, signatures

MOST_TICKS, MOST_LISTED = 5_000, 15_000
"""Ticks that are run for one requirement: what is longer stays open; and where all states are listed."""


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
    begins: tuple[Any, ...] = field(init=False)

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
        values = tuple(level.values for level in levels)
        admitted = {level.name: self._inputs(level.name) for level in levels}
        self.begins = values, ({}, {}, {}), admitted, {}, 0

    def shortest(
        self, stated: Property, most: int, *, refuses: bool, restarts: bool, late: bool = False
    ) -> int | None:
        """Return the number of ticks of the shortest run that breaks a requirement; 0 if none does, None if that is not known.

        Args:
            stated: The requirement.
            most: No longer run is looked for.
            refuses: Whether inputs may be refused; `restarts`, whether levels may begin anew.
            restarts: Whether levels may begin anew.
            late: Whether buffers may be seen late.
        """
        names = [level.name for level in self.system.levels]
        watch = Watch(stated) if stated.monitor is not None else None
        values, held, admitted, _, tick = self.begins
        begins = (None, (values, held, admitted, {} if watch is None else dict(watch.state), tick))
        seen, here, ran = {begins[0]}, [begins], 0
        given = list(product(*(self._given(name, refuses=refuses) for name in names)))
        again = list(product((False, True), repeat=len(names))) if restarts else [(False,) * len(names)]
        for tick in range(most):
            after = []
            for _, kept in here:
                due = [kept[-1] * 10 % level.level.period_ms == 0 for level in self.system.levels]
                for values, anew, by in product(given, again, self._ages(kept, late=late)):
                    if any(begins and not runs for begins, runs in zip(anew, due, strict=True)):
                        continue  # it begins anew before a cycle of it
                    ran += 1
                    if ran > MOST_TICKS:
                        return None
                    found = self._step(
                        kept,
                        dict(zip(names, values, strict=True)),
                        dict(zip(names, anew, strict=True)),
                        watch,
                        stated,
                        by,
                    )
                    if found is None:
                        return tick + 1
                    if found[0] not in seen:
                        seen.add(found[0])
                        after.append(found)
            if not after:
                return 0
            here = after
        return None

    def waits_for_ever(self, stated: Property) -> bool | None:
        """Return whether some run breaks it, or waits in each tick from some tick on, all of them calm; None if that is not known."""
        assert stated.monitor is not None
        watch, names = Watch(stated), [level.name for level in self.system.levels]
        waits = Watch(replace(stated, condition=negation(stated.monitor.waits)))
        values, held, admitted, _, tick = self.begins
        begins: Any = (None, (values, held, admitted, dict(watch.state), tick))
        seen, here, onward, ran = {begins[0]}, [begins], dict[Any, set[Any]](), 0
        given = list(product(*(self.inputs[name] for name in names)))
        while here:
            key, kept = here.pop()
            due = [kept[-1] * 10 % level.level.period_ms == 0 for level in self.system.levels]
            for of, anew in product(given, product((False, True), repeat=len(names))):
                if any(begins and not runs for begins, runs in zip(anew, due, strict=True)):
                    continue
                ran += 1
                if ran > MOST_LISTED:
                    return None
                told = dict(zip(names, of, strict=True)), dict(zip(names, anew, strict=True))
                found = self._step(kept, *told, watch, stated, {})
                if found is None:
                    return True
                calm = not any(anew) and not any(v == 3 and d for v, d in zip(of, due, strict=True))
                if calm and self._step(kept, *told, waits, waits.stated, {}) is None:
                    onward.setdefault(key, set()).add(found[0])
                if found[0] not in seen:
                    seen.add(found[0])
                    here.append(found)
        while gone := [key for key, targets in onward.items() if not targets & onward.keys()]:
            for key in gone:
                del onward[key]
        return bool(onward)

    def walk(
        self, stated: Property, seed: int, ticks: int, *, refuses: bool, restarts: bool, late: bool
    ) -> int:
        """Run so many ticks with whatever comes; return the tick that breaks the requirement, 0 if none does."""
        random = Random(seed)  # noqa: S311  # repeatable on purpose
        watch = Watch(stated) if stated.monitor is not None else None
        values, held, admitted, _, tick = self.begins
        kept: Any = (values, held, admitted, {} if watch is None else dict(watch.state), tick)
        for number in range(1, ticks + 1):
            levels = self._at(kept).levels
            given = {level.name: random.choice(self._given(level.name, refuses=refuses)) for level in levels}
            anew = {
                level.name: restarts
                and random.random() < 0.1
                and self.system.tick * 10 % level.level.period_ms == 0
                for level in levels
            }
            found = self._step(
                kept, given, anew, watch, stated, random.choice(tuple(self._ages(kept, late=late)))
            )
            if found is None:
                return number
            kept = found[1]
        return 0

    def _ages(self, kept: Any, *, late: bool) -> Iterator[dict[str, int]]:
        """Yield how late each buffer may be seen in the next tick."""
        before = kept[1][2]
        names = [wire.source for wire in self.described.wires]
        every = [
            range(min(self.memory.most, before.get(name, 0) + 1) + 1) if late else (0,) for name in names
        ]
        for ages in product(*every):
            yield dict(zip(names, ages, strict=True))

    def _given(self, name: str, *, refuses: bool) -> tuple[Any, ...]:
        return tuple(value for value in self.inputs[name] if refuses or value != 3)

    def _inputs(self, name: str) -> tuple[Any, ...]:
        level = self.system.level(name)
        return level.value("x"), level.value("y")

    def _state(self, admitted: dict[str, tuple[Any, ...]], watch: Watch | None, tick: int) -> tuple[Any, Any]:
        values = tuple(level.values for level in self.system.levels)
        memory = self.memory
        held = dict(memory._held), dict(memory.past), dict(memory.by)
        states = {} if watch is None else dict(watch.state)
        key = (
            values,
            tuple(tuple(sorted(of.items())) for of in held),
            tuple(sorted(admitted.items())),
            tuple(states.items()),
            tick % 6,
        )
        return key, (values, held, dict(admitted), states, tick)

    def _at(self, kept: Any) -> System:
        values, held, _, _, tick = kept
        for level, of in zip(self.system.levels, values, strict=True):
            level.put_back(of)
        self.memory._held, self.memory.past, self.memory.by = map(dict, held)
        self.system.tick = tick
        return self.system

    def _seen(self, admitted: Mapping[str, tuple[Any, ...]], given: Mapping[str, Any]) -> dict[str, Any]:
        seen = dict[str, Any]()
        for level in self.system.levels:
            x, y = admitted[level.name]
            of = {"x": x, "y": y, "n": level.value("n"), "o": level.value("o")}
            seen |= {f"{level.name}.{leaf}": value for leaf, value in of.items()}
            seen[f"plant.y_{level.name}"] = given[level.name]
        return seen

    def _step(
        self,
        kept: Any,
        given: dict[str, Any],
        anew: dict[str, bool],
        watch: Watch | None,
        stated: Property,
        late: dict[str, int],
    ) -> tuple[Any, Any] | None:
        system, (_, (held, *_), admitted, states, tick) = self._at(kept), kept
        before = self._seen(admitted, {name: held.get(f"plant.y_{name}", (0,))[0] for name in given})
        for name, value in given.items():
            system.buffers.publish(f"plant.y_{name}", (value,))
        self.memory.holds(f"plant.y_{name}" for name in given)
        self.memory.by = late
        for name, begins in anew.items():
            if begins:
                system.restart(name, written=self.memory.written())
        with suppress(StateTableError):  # a level was refused an input
            system.step()
        self.memory.holds(f"{name}.o" for name in given)
        system.tick = tick + 1
        now = dict(admitted)
        for level in system.levels:
            if tick * 10 % level.level.period_ms == 0 and not level.fault:
                now[level.name] = self._inputs(level.name)
        after = self._seen(now, given)
        if watch is not None:
            watch.state = dict(states)
            if not watch.keeps(before, after):
                return None
        else:
            from rcsc.lang.interpret import holds

            looked = {str(earlier(name)): value for name, value in before.items()}
            if not holds(stated.condition, {**after, **looked}):
                return None
        return self._state(now, watch, tick + 1)


def written(made: Drawn, folder: Path) -> Path:
    """Write the files of a system; return its description."""
    for name, text in made.files.items():
        (folder / name).write_text(text)
    return folder / "system.toml"
