"""Control a system by hand: cycles, single levels, parts of levels, variables, breakpoints and undo.

In: a system ready for its first tick. Out: a `Session`; each of its methods does one thing and returns what it did. Nothing is read or
printed here.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.described import nearest
from rcsc.desk.shell import history, typed_names
from rcsc.desk.shell.part_runs import run_part
from rcsc.desk.shell.reload.composed import held_by, together
from rcsc.desk.shell.reload.gate import Judged, Running, judge
from rcsc.desk.shell.reload.reload import Origin, Reloaded, program_of, reload
from rcsc.desk.shell.stops import StateQuery, Stops, question, reached, stands
from rcsc.desk.shell.typed_names import NamedLine
from rcsc.lang.model import Program
from rcsc.proof.solvers.smt import spent
from rcsc.run.adopt import Begun, Restarted
from rcsc.run.description import BadDescription, Description, LevelSpec
from rcsc.run.faults import BadStrength, UnknownFault, switch
from rcsc.run.levels import Fill, Query, RunningLevel
from rcsc.run.log.schema import fingerprints
from rcsc.run.log.states import begun_in_words
from rcsc.run.orders.operator import line_to
from rcsc.run.orders.roles import Served, served
from rcsc.run.processes.attach import AttachedSystem
from rcsc.run.signature import Signature, Value, Values
from rcsc.run.system import StateTableError, System

if TYPE_CHECKING:
    from rcsc.desk.shell.reload.reload import KeptSources
    from rcsc.run.log.recorder import Recorder

MOST_CYCLES = 100_000
"""After which `run` gives up: more than an hour of control time."""


class Session:
    """A system and what is done with it.

    Attributes:
        chosen: Name of the level whose parts and variables are meant where none is named.
        stops: Breakpoints.
        interrupted: Set, and cleared again, from outside: cycles end after the present one.
        faults: Of the plants, that are on by hand.
        changes: How often something was done that `undo` takes back, and was not taken back.
        between: Called between two cycles of `run`: what is typed while it runs is done there.
        attached: The same system where it runs in other processes; None where it runs here.
    """

    def __init__(self, system: System, plant: Origin) -> None:
        self.system, self.plant = system, plant
        self.attached = system if isinstance(system, AttachedSystem) else None
        buffers = {name: system.buffers.latest(name) for name in system.description.readers()}
        self.memory = history.Memory({name: held for name, held in buffers.items() if held is not None})
        system.buffers = self.memory
        self.chosen = system.levels[0].name
        self.stops = Stops()
        self.interrupted = False
        self.faults = frozenset[str]() if self.attached is None else self.attached.switches.on
        self.changes = 0
        self.between: Callable[[], None] = lambda: None
        self._log: Recorder | None = None
        self._past: deque[history.KeptMoment] = deque(maxlen=history.MOST)
        self._answers: dict[tuple[object, ...], Values] = {}
        # By identity, as after a reload another level has the name; the level is kept, so that its number stays its own.
        self._programs: dict[int, tuple[RunningLevel, Program]] = {}
        # What runs is known by its executors' digest, and what it means by its sources, from before anybody edits them.
        digests = fingerprints(system.description)
        self._builds: dict[int, tuple[RunningLevel, str, KeptSources | None]] = {
            id(level): (level, digests[spec.program], held_by(self.plant, spec))
            for level in system.levels
            for spec in (self.spec(level.name),)
        }
        for level in system.levels:
            self._answer_by_hand(level)

    # --- names ---

    @property
    def levels(self) -> tuple[RunningLevel, ...]:
        """From the top down."""
        return self.system.levels

    @property
    def plants(self) -> tuple[object, ...]:
        """What has faults to be switched: what stands outside, or the switches of it."""
        return self.system.outside if self.attached is None else (self.attached.switches,)

    @property
    def level(self) -> RunningLevel:
        """The level chosen."""
        return self.system.level(self.chosen)

    def spec(self, name: str) -> LevelSpec:
        """Return the level's part of the description."""
        return next(level for level in self.system.description.levels if level.name == name)

    def question(self, text: str) -> StateQuery:
        """Return the query of a condition.

        Raises:
            Refused: It is none.
        """
        return question(text, self.levels, self.level)

    def program(self, level: RunningLevel) -> Program:
        """Return the program of a level's tables.

        Raises:
            Refused: The sources are not those of the executors.
        """
        key = id(level)
        if key not in self._programs:
            self._programs[key] = level, program_of(self.plant, self.spec(level.name), self._builds[key][2])
        return self._programs[key][1]

    def digest(self, level: RunningLevel) -> str:
        """The digest of the executors that a level runs, as logs keep it."""
        return self._builds[id(level)][1]

    # --- cycles ---

    def cycle(self) -> None:
        """One cycle of everything.

        Raises:
            Refused: A level was refused an input, or no line or several matched.
        """
        for level in self.levels:
            _fit(level)
        self._keep()
        try:
            self.system.step()
        except StateTableError as error:
            raise Refused(Code.STATE_TABLE_ERROR, str(error), "`undo` takes the cycle back") from error

    def _here(self, what: str, instead: str = "`rcsc shell SYSTEM` does it, in one process") -> None:
        """Raises: Refused: The system runs in other processes, where nobody does that."""
        if self.attached is not None:
            message = f"what runs in processes of its own is not {what} from here"
            raise Refused(Code.SHELL_COMMAND, message, instead)

    def hold(self, name: str, *, on: bool) -> str:
        """Have a level skip its cycles while the rest of an attached system goes on, or no more.

        Raises:
            Refused: The system runs here.
        """
        if self.attached is None:
            message = "a level is held in a system that runs in processes"
            raise Refused(
                Code.SHELL_COMMAND, message, "`rcsc run --processes`, and attach to it; here `step LEVEL`"
            )
        self.attached.hold(name, on=on)
        return (
            f"level `{name}` {'skips its cycles' if on else 'goes on'} from cycle {self.system.tick + 1} on"
        )

    def cycle_alone(self, level: RunningLevel) -> None:
        """One cycle of one level: it takes its buffers as they are, runs, and gives.

        Raises:
            Refused: It was refused an input, no line or several matched, or an extern procedure failed.
        """
        if self.attached is not None:
            if not self.attached.held(level.name):
                message = f"level `{level.name}` runs with the others"
                raise Refused(
                    Code.SHELL_COMMAND,
                    message,
                    f"`hold {level.name}` first, then it runs the cycles that you step",
                )
            self.attached.allow(level.name)
            self.cycle()
            return
        _fit(level)
        self._keep()
        try:
            level.take(self.memory)
            fault = level.run()
        except StateTableError as error:
            raise Refused(Code.STATE_TABLE_ERROR, str(error), "`undo` takes the cycle back") from error
        level.give(self.memory)
        self._by_hand(level)
        if fault:
            raise Refused(Code.STATE_TABLE_ERROR, _fault(level), "`undo` takes the cycle back")

    def part(self, level: RunningLevel, name: str, args: Sequence[str]) -> list[str]:
        """Run a part of a level on its present values; return what it did.

        Raises:
            Refused: There is none of that name, or it met what cannot be.
        """
        ran = run_part(level, self.program(level), name, args)
        self._keep()
        level.executor.put(0, ran.values[: len(level.sign.leaves)])
        level.values = _spoken(level, ran.values)
        self._by_hand(level)
        return [f"{level.name}: {ran.text}", *self.changed()]

    def run(self, most: int, until: StateQuery | NamedLine | None = None) -> str:
        """Run cycles until the condition holds, a breakpoint is met, or `most` are done; return why it ended.

        Raises:
            Refused: As `cycle`.
        """
        if until is not None and self.holds(until):
            return f"cycle {self.system.tick}: {reached(until)}"
        for why in islice(self.cycles(until), most):
            if why:
                return why
            self.between()
        return self.not_met(most, until)

    def cycles(self, until: StateQuery | NamedLine | None = None) -> Iterator[str]:
        """Run cycle after cycle; say after each why a run is to end there, and nothing where it is not.

        Raises:
            Refused: As `cycle`.
        """
        self.stops.look(self._stands)
        while True:
            self.cycle()
            yield self._ended(until)

    def cycles_alone(self, level: RunningLevel) -> Iterator[str]:
        """Run cycle after cycle of one level; nothing ends it but an interrupt.

        Raises:
            Refused: As `cycle_alone`.
        """
        while True:
            self.cycle_alone(level)
            yield "interrupted" if self.interrupted else ""

    def _ended(self, until: StateQuery | NamedLine | None) -> str:
        """Say why a run ends after this cycle; empty where it does not."""
        if until is not None and self._stands(until):
            return f"cycle {self.system.tick}: {reached(until)}"
        met = self.stops.met(self._stands)
        if met is not None:
            return f"cycle {self.system.tick}: breakpoint {met.number}, {reached(met.what)}"
        return f"cycle {self.system.tick}: interrupted" if self.interrupted else ""

    def not_met(self, most: int, until: StateQuery | NamedLine | None) -> str:
        """Say that so many cycles are done.

        Raises:
            Refused: They were to come to something, and did not.
        """
        if until is None:
            return f"cycle {self.system.tick}"
        raise Refused(Code.SHELL_COMMAND, f"{most} cycles did not come to it")

    def restart(self, name: str, *, anew: bool) -> str:
        """Start a level again, as if its process had been killed: from what its last cycle left, or anew.

        Raises:
            Refused: Its tables are not proved for that state.
        """
        self._here(
            "started again", "a level whose process is killed, or stands still, is started again by itself"
        )
        level = self.system.level(name)
        checkpoint = None if anew else level.values
        self._keep()
        try:
            self.system.restart(name, checkpoint)
        except StateTableError as error:
            self._forget()
            raise Refused(Code.STATE_TABLE_ERROR, str(error)) from error
        return f"level `{name}` is started again, {begun_in_words(self.system.restarts[-1].begun)}"

    def fault(self, name: str, *, on: bool) -> str:
        """Switch a fault of a plant on or off; `NAME=STRENGTH` on with that strength.

        Raises:
            Refused: No plant has it, or not that strength.
        """
        try:
            switch(self.plants, name, on=on)
        except (BadStrength, UnknownFault) as error:
            raise Refused(Code.SHELL_COMMAND, str(error), *error.helps) from error
        plain = name.partition("=")[0]
        self.faults = self.faults | {plain} if on else self.faults - {plain}
        return f"{name} is {'on' if on else 'off'}"

    def freeze(self, buffer: str, *, on: bool) -> str:
        """Have what is written to a buffer get lost, or no more: readers go on seeing what it holds.

        Raises:
            Refused: There is no such buffer.
        """
        self._here("frozen, buffer by buffer,")
        known = list(self.system.description.readers())
        if buffer not in known:
            raise Refused(Code.SHELL_NAME, f"there is no buffer `{buffer}`", *nearest(buffer, known))
        self._keep()
        self.memory.frozen = self.memory.frozen | {buffer} if on else self.memory.frozen - {buffer}
        return f"what is written to {buffer} {'is lost from now on' if on else 'arrives again'}"

    def undo(self, count: int) -> None:
        """Goes back to before the last cycles.

        Raises:
            Refused: So many are not kept.
        """
        self._not_logged("undone")
        self._here("undone")
        if count > len(self._past):
            raise Refused(Code.SHELL_COMMAND, f"only {len(self._past)} cycles can be undone")
        moment = self._past[-count]
        for _ in range(count):
            self._forget()
        reloaded = moment.levels != self.system.levels
        history.put_back(moment, self.system, self.memory)
        self._answers, self.faults = dict(moment.answers), moment.faults
        if reloaded:
            self.stops.ask_again(self.levels)

    @property
    def kept(self) -> int:
        """How often `undo` can go back."""
        return len(self._past)

    def holds(self, what: StateQuery | NamedLine) -> bool:
        """Return whether `run until` would have nothing to do: the condition holds already."""
        return isinstance(what, StateQuery) and self._stands(what)

    def _stands(self, what: StateQuery | NamedLine) -> bool:
        """Return whether a run is to stop there: not for what is still reported of an order before the last."""
        return stands(what, self.levels) and not (
            isinstance(what, StateQuery) and self._of_order_before(what)
        )

    def _of_order_before(self, what: StateQuery) -> bool:
        """Return whether a condition reads a report whose number is not the last order's, and does not look at that itself."""
        for to in served(self.system.description, {level.name: level.sign for level in self.levels}):
            level, order = self.system.level(to.level), self.memory.latest(to.order)
            places = [level.sign.index[leaf.name] for leaf in to.report_leaves]
            echo, read = places[to.echo], {at for name, at in what.leaves if name == to.level}
            late = order is not None and order[to.number] != level.values[echo]
            if late and echo not in read and not read.isdisjoint(places):
                return True
        return False

    def changed(self) -> list[str]:
        """Variables that the last cycle left with another value: `task.cur_state: d_state -> state_2`."""
        if not self._past:
            return []
        changes = []
        for level in self.levels:
            old, values = self._past[-1].of(level.name)
            alike = old.sign is level.sign
            for at, leaf in enumerate(level.sign.leaves):
                if alike and values[at] == level.values[at]:
                    continue
                before = old.sign.index.get(leaf.name)
                shown = "" if before is None else old.sign.leaves[before].shown(values[before])
                if shown != leaf.shown(level.values[at]):
                    changes.append(
                        f"{level.name}.{leaf.name}: {shown or 'nothing'} -> {leaf.shown(level.values[at])}"
                    )
        return changes

    # --- variables ---

    def set(self, name: str, text: str) -> str:
        """Sets a variable; in the buffer that carries it, too.

        Raises:
            Refused: There is none, or the text is no value of it.
        """
        level, at = typed_names.one_leaf(name, self.levels, self.level)
        return self._set(level, at, typed_names.value_of(level.sign.leaves[at], text))

    def _set(self, level: RunningLevel, at: int, value: Value) -> str:
        level.executor.put(at, (value,))
        level.values = _spoken(level, _with(level.values, at, value))
        for buffer, first, end in _carriers(level):
            if first <= at < end:
                held = self.memory.latest(buffer)
                record = level.values[first:end] if held is None else _with(held, at - first, value)
                self.memory.publish(buffer, record)
        self._answer(level, at)
        self._by_hand(level)
        return typed_names.shown(level, at)

    def _by_hand(self, level: RunningLevel) -> None:
        """Have whoever watches the next cycle know from what it begins: a level goes on from what was set."""
        self._forget_hand(level.name)
        self.system.restarts.append(Restarted(level.name, Begun.HAND, level.values[: len(level.sign.leaves)]))

    def _forget_hand(self, name: str) -> None:
        restarts = self.system.restarts
        restarts[:] = [one for one in restarts if (one.level, one.begun) != (name, Begun.HAND)]

    def order(self, to: Served, given: Mapping[str, str]) -> int:
        """Orders a level from outside, with the next number; fields that are not given are as at first.

        Raises:
            Refused: The order has no such field, or a text is no value of one; nothing was set.
        """
        fields = to.fields
        for name in given:
            if name not in fields:
                helps = nearest(name, list(fields))
                raise Refused(Code.SHELL_NAME, f"an order of `{to.level}` has no field `{name}`", *helps)
        line = line_to(to)
        standing = self.memory.latest(to.order)
        level = next(level for level in self.levels if level.name == to.level)
        last = level.value(to.order_leaves[to.number].name) if standing is None else standing[to.number]
        line.number = int(last)
        line.send(
            to.order_with({name: typed_names.value_of(fields[name], text) for name, text in given.items()})
        )
        for leaf, value in zip(to.order_leaves, line.sent, strict=True):
            self._set(level, level.sign.index[leaf.name], value)
        return line.number

    def _answer(self, level: RunningLevel, at: int) -> None:
        """Keep a value set by hand as the database's answer to the same question from now on."""
        for feed, fill in zip(self.spec(level.name).feeds, level.fills, strict=True):
            run = level.sign.record(feed.into)
            if at in run:
                keys = tuple(level.values[key] for key in fill.keys)
                self._answers[level.name, fill.first, keys] = level.values[run.start : run.stop]

    def _answer_by_hand(self, level: RunningLevel) -> None:
        level.fills = tuple(
            Fill(self._query(level.name, fill), fill.first, fill.keys, fill.form) for fill in level.fills
        )

    def _query(self, level: str, fill: Fill) -> Query:
        def query(*keys: Value) -> Values:
            answer = self._answers.get((level, fill.first, keys))
            return fill.query(*keys) if answer is None else answer

        return query

    # --- the log ---

    def log(self, path: Path) -> str:
        """Write every cycle from the next one on to a file, with what is set by hand before it.

        Raises:
            Refused: A log is being written, or this one cannot be.
        """
        if self._log is not None:
            raise Refused(Code.SHELL_COMMAND, "a log is being written", "`log off` ends it")
        try:
            from rcsc.run.log.recorder import Recorder  # of an extra

            path.parent.mkdir(parents=True, exist_ok=True)
            self._log = Recorder(self.system, path)
        except OSError as error:
            raise Refused(Code.SHELL_COMMAND, f"`{path}` cannot be written: {error.strerror}") from error
        except ModuleNotFoundError as error:
            message = f"`{error.name}` is not installed"
            raise Refused(Code.EXTRA_MISSING, message, "pip install 'rcsc[log]'") from error
        self.system.watch.append(self._record)
        return f"every cycle from {self.system.tick + 1} on is written to {path}"

    def end_log(self) -> bool:
        """End the log; say whether one was written.

        Raises:
            Refused: Its end could not be written.
        """
        log, self._log = self._log, None
        if log is None:
            return False
        self.system.watch.remove(self._record)
        try:
            log.close()
        except OSError as error:
            raise Refused(Code.SHELL_COMMAND, f"the log ends here: {error.strerror}") from error
        return True

    def leave(self) -> None:
        """Let a system that runs in other processes go on without this one."""
        if self.attached is not None:
            self.attached.leave()

    def _record(self, system: System, ran: tuple[RunningLevel, ...]) -> None:
        """Raises: Refused: The cycle cannot be written; it was done, and no more is written."""
        assert self._log is not None  # only while one is written
        try:
            self._log(system, ran)
        except OSError as error:
            self._log = None
            system.watch[:] = [watch for watch in system.watch if watch != self._record]
            system.restarts.clear()
            raise Refused(Code.SHELL_COMMAND, f"the log ends here: {error.strerror}") from error

    def _not_logged(self, what: str) -> None:
        if self._log is not None:
            raise Refused(Code.SHELL_COMMAND, f"what a log holds cannot be {what}", "`log off` ends it")

    # --- other tables ---

    def reload(self, name: str, *, anyway: bool = False, prove: bool = False) -> list[str]:
        """Take a level's tables as they are now, between two cycles; return what they do otherwise.

        Args:
            name: The level's.
            anyway: Whether they are taken although the next cycle does, or may do, otherwise.
            prove: Whether they are taken only if they are proved together with their neighbours; which is tried first.

        Raises:
            Refused: They are not taken; the old ones run on.
        """
        self._not_logged("changed")
        self._here("given other tables")
        old, reloaded, judged = self._try_reload(name, prove=prove)
        if judged is None:
            return [f"level `{name}` runs these very tables: nothing changed"]
        if judged.doubts and not anyway:
            why = "\n".join((*judged.doubts, *judged.notes))
            message = f"level `{name}` keeps its tables: {why}"
            raise Refused(Code.SHELL_OTHERWISE, message, f"`reload {name} anyway` takes them")
        self._keep()
        self._forget_hand(name)
        self._programs[id(reloaded.level)] = reloaded.level, reloaded.program
        self._builds[id(reloaded.level)] = reloaded.level, reloaded.digest, reloaded.sources
        self.system.levels = tuple(reloaded.level if level is old else level for level in self.levels)
        gone = self.stops.ask_again(self.levels)
        taken = f"level `{name}` runs its new tables from cycle {self.system.tick + 1} on: {reloaded.carried}"
        return [*judged.notes, *judged.doubts, taken, *gone]

    def difference(self, name: str) -> list[str]:
        """Return what `reload` would take, and whether it would.

        Raises:
            Refused: It would not take it, not even with `anyway`.
        """
        _, reloaded, judged = self._try_reload(name)
        if judged is None:
            return [f"level `{name}` runs these very tables: nothing changed"]
        would = f"`reload {name}{' anyway' if judged.doubts else ''}` takes it: {reloaded.carried}"
        return [*judged.notes, *judged.doubts, would]

    def _try_reload(self, name: str, *, prove: bool = False) -> tuple[RunningLevel, Reloaded, Judged | None]:
        """Return the running level, its reload, and the verdict on that; None where they are the same."""
        old = self.system.level(name)
        reloaded = reload(self.plant, self.spec(name), old, lambda: self._meaning(old))
        if self._builds[id(old)][1:] == (reloaded.digest, reloaded.sources):
            return old, reloaded, None
        self._answer_by_hand(reloaded.level)
        running = Running(old, self._meaning(old))
        judged = judge(running, reloaded.level, reloaded.program, self.memory)
        runs = {
            level.name: reloaded.sources if level is old else self._builds[id(level)][2]
            for level in self.levels
        }
        known = together(
            self.plant,
            name,
            runs,
            lambda name: self._meaning(self.system.level(name)) is not None,
            prove=prove,
        )
        if spent():
            raise Refused(Code.SHELL_RELOAD, f"level `{name}` keeps its tables: their proof was given up")
        return old, reloaded, replace(judged, notes=(*judged.notes, known))

    def _meaning(self, level: RunningLevel) -> Program | None:
        """Return the program of a level's tables; None where its executors are not made of the sources that are known."""
        try:
            return self.program(level)
        except Refused:
            return None

    def _forget(self) -> None:
        self._past.pop()
        self.changes -= 1

    def _keep(self) -> None:
        self.changes += 1
        self._past.append(history.kept(self.system, self.memory, self._answers, self.faults))


def _with(values: Values, at: int, value: Value) -> Values:
    return (*values[:at], value, *values[at + 1 :])


def _spoken(level: RunningLevel, values: Values) -> Values:
    """Return the values, without the line where they now select another table."""
    line = len(level.sign.leaves)
    same = level.sign.table_of(level.level, values) == level.table or values[line] != level.values[line]
    return values if same else _with(values, line, -1)


def _carriers(level: RunningLevel) -> list[tuple[str, int, int]]:
    """Buffers that the level takes or gives, and which leaves they carry."""
    taken = [(take.buffer, take.first, take.first + take.count) for take in level.takes]
    return taken + [(give.buffer, give.first, give.end) for give in level.gives]


def _fit(level: RunningLevel) -> None:
    """Refuse a cycle from a state that was set by hand and that the proof does not cover.

    Raises:
        Refused: It is.
    """
    at = level.executor.check()
    if at >= 0:
        wrong = level.sign.unfit(at, level.values)
        message = f"level `{level.name}` cannot go on from this state: {wrong}"
        raise Refused(Code.STATE_TABLE_ERROR, message, "`set` what it is about, or `undo`")


def _fault(level: RunningLevel) -> str:
    return f"level `{level.name}`, table `{level.table}`: {level.fault_text}"


def silent_queries(system: Description, signs: Mapping[str, Signature]) -> dict[str, Query]:
    """Return the queries of an empty database: every answer is the record's initial value.

    Raises:
        BadDescription: A feed fills what its program does not have.
    """
    queries = {}
    for spec in system.levels:
        for feed in spec.feeds:
            try:
                run = signs[spec.name].record(feed.into)
            except KeyError as error:
                raise BadDescription(f"level `{spec.name}` has no variable `{feed.into}` to fill") from error
            answer = tuple(signs[spec.name].leaves[at].initial for at in run)
            queries[feed.query] = lambda *_, answer=answer: answer
    return queries
