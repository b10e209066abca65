"""Turn what people type into calls on a session.

In: a line. Out: what to show; a refusal where it is not done.
"""

import re
from collections.abc import Callable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from pathlib import Path

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.names import BadName, within
from rcsc.desk.shell import typed_names
from rcsc.desk.shell.part_runs import call_of, part_names
from rcsc.desk.shell.session import MOST_CYCLES, Session
from rcsc.desk.shell.stops import StateQuery, asked
from rcsc.desk.shell.typed_names import NamedLine
from rcsc.lang.restart import COMMAND
from rcsc.run.faults import faults_of
from rcsc.run.levels import RunningLevel
from rcsc.run.log.queries import NAME, known_name, normal
from rcsc.run.orders.roles import served
from rcsc.views.trace.names import named, names_text

Output = list[str]
_SHOW = re.compile(rf"(?P<name>{NAME})\s*\?$")
_SET = re.compile(rf"(?P<name>{NAME})\s*=(?![=>])\s*(?P<value>.*)$")
_IN_BRACKETS = re.compile(r"<(.*)>$")
"""As the paper prints what is typed: `<TASK-LEVEL>`."""
HELP = """\
NAME                    run the module, procedure, owner or table of that name on the level chosen
NAME(VALUE, ...)        the same, with arguments
PREPROCESS, STATE-TABLE, POSTPROCESS
                        run that part of the level chosen
TASK-LEVEL              run one cycle of level `task` alone
NAME ?                  show a variable of the level chosen; LEVEL.NAME ? of another, and LEVEL-level.NAME ? where the level
                        chosen has a buffer that is called like it
NAME = VALUE            set it, in the buffer that carries it too
level [LEVEL]           choose a level
levels                  all levels
lines                   the line that each level ran last
show [LEVEL]            what the last cycle changed, and what was set since; all variables of a level
names [WORD]            the data dictionary: what each variable of the level chosen is, who writes it and who reads it; those in
                        whose name, meaning or type WORD stands, or those of the level WORD
buffers [NAME]          the latest value of each buffer
step [N]                N cycles of all levels
step LEVEL [N]          N cycles of one level alone: its neighbours are what its buffers say
run [N]                 N cycles, or until a breakpoint; on a terminal, while it runs, whatever is typed is done between two
                        cycles, as `NAME ?` and `NAME = VALUE`, and Ctrl-C ends it
run until CONDITION     until it holds; what a level still reports of an order before the last from outside does not count
run to [LEVEL.]TABLE.LINE
                        until the level runs that line
run to cycle N          until N cycles are done
break CONDITION         stop `run` where it comes to hold; a line, too: break task.acquire.5
breaks, delete N        the breakpoints; one less
order [LEVEL] COMMAND [FIELD=VALUE ...]
                        order a level from outside, with the next number; other fields are as at first
faults                  the plant's faults, and which somebody switched on
fault NAME [off]        switch one on, or off; NAME=STRENGTH where it has strengths: fault late_ticks=120
restart LEVEL [anew]    start a level again, as if its process had been killed: as its last cycle left it, or anew
hold LEVEL, release LEVEL
                        of a system in processes: the level skips its cycles but for those of `step LEVEL`, the rest goes on;
                        it takes part again
freeze BUFFER, thaw BUFFER
                        what is written to a buffer gets lost, or arrives again
undo [N]                go back to before the last cycle, or the last N
log FILE.mcap, log off  write every cycle from here on, with what is set by hand, for `rcsc log` and `rcsc replay`; end it
reload [LEVEL] [anyway] prove and take a level's tables as they are now, with what they do otherwise; `anyway` even
                        where the present state is one in which the next cycle does otherwise
reload [LEVEL] proved   the same, but first prove the levels together, which may take minutes, and take it only then
diff [LEVEL]            the same, but take nothing
expect CONDITION        fail unless it holds
clear                   clear the screen; a module that is called so runs as CLEAR or LEVEL.clear
help, quit
Of a system in processes (`rcsc shell --attach`) all of this but `undo`, `reload`, `restart`, `freeze` and `thaw`: those are of one
process. It goes on when you quit, at its own rate, and a fault that is on stays on. A level whose process is killed, or stands still,
is started again by itself, from what its last cycle left, or anew where that is lost.
A CONDITION compares variables: task.cur_state = state_3 and not (new_command or primitive.travelled_mm > 40).
Everything from # on is a comment."""


def said(line: str) -> str:
    """Return what a line says, without its comment, and without the brackets in which the paper prints it."""
    return _IN_BRACKETS.sub(r"\1", line.partition("#")[0].strip()).strip()


@dataclass(frozen=True, slots=True)
class RunOrder:
    """Cycles to be run.

    Attributes:
        most: So many at most.
        until: What ends them; None where nothing but breakpoints does.
        steps: Whether not even breakpoints do.
        alone: The level that runs alone; empty for all.
    """

    most: int
    until: StateQuery | NamedLine | None = None
    steps: bool = False
    alone: str = ""


@dataclass(slots=True)
class Commands:
    """The commands of a session.

    Attributes:
        over: Whether `quit` was typed.
        heard: Whether somebody may type while cycles run, and end them.
        folder: In which alone logs are written, where who types is no user of this machine; None for anywhere.
        clear: Clears the screen, where there is one.
    """

    session: Session
    over: bool = False
    heard: bool = False
    folder: Path | None = None
    clear: Callable[[], None] = field(default=lambda: None, repr=False)

    def do(self, line: str) -> Output:
        """Run a line and return what to show.

        Raises:
            Refused: It was not done.
        """
        text = said(line)
        if not text:
            return []
        if text == "clear":  # as in every terminal; in capitals, as the paper types names, it is a module
            self.clear()
            return []
        shown, set_ = _SHOW.match(text), _SET.match(text)
        if shown:
            return self._show_variable(shown["name"])
        if set_:
            return [self.session.set(set_["name"], set_["value"].strip())]
        word, _, rest = text.partition(" ")
        command = self._words.get(word.casefold())
        return self._by_name(text) if command is None else command(rest.strip())

    @property
    def _words(self) -> dict[str, Callable[[str], Output]]:
        return {
            "break": self._break, "breaks": self._breaks, "buffers": self._buffers, "delete": self._delete,
            "diff": self._diff,
            "expect": self._expect, "fault": self._fault, "faults": self._faults,
            "freeze": self._freeze, "help": self._help, "hold": self._hold,
            "release": self._release, "level": self._level, "levels": self._levels, "order": self._order,
            "lines": self._lines, "log": self._log, "quit": self._quit, "reload": self._reload, "restart": self._restart, "run": self._run,
            "names": self._names,
            "show": self._show, "step": self._step, "thaw": self._thaw, "undo": self._undo,
        }  # fmt: skip

    def completions(self) -> Iterator[str]:
        """Every word that may be typed."""
        yield from ("clear", *self._words)
        for level in self.session.levels:
            yield from (level.name, f"{level.name}-level")
            yield from (f"{level.name}.{leaf.name}" for leaf in level.sign.leaves)
            for table in level.level.every_table:
                yield from (f"{level.name}.{table}.{line}" for line in level.sign.tables[table])
        yield from (leaf.name for leaf in self.session.level.sign.leaves)
        yield from self._parts(self.session.level)

    def _faults(self, _rest: str) -> Output:
        on = self.session.faults
        every = faults_of(self.session.plants)
        return [f"{name} is on" if name in on else name for name in every] or ["no plant has any"]

    def _fault(self, rest: str) -> Output:
        name, _, to = rest.partition(" ")
        if to.strip() not in {"", "on", "off"}:
            raise Refused(Code.SHELL_COMMAND, f"`{to.strip()}` is neither `on` nor `off`")
        return [self.session.fault(name, on=to.strip() != "off")]

    def _order(self, rest: str) -> Output:
        system = self.session.system.description
        levels = served(system, {level.name: level.sign for level in self.session.levels})
        words = rest.split()
        to = next((level for level in levels if words and level.level == words[0]), None)
        if to is not None:
            words = words[1:]
        if not levels:
            raise Refused(Code.SHELL_COMMAND, "no level is ordered from outside")
        to = to or levels[0]
        if not words or not all("=" in word for word in words[1:]):
            raise Refused(Code.SHELL_COMMAND, "write `order COMMAND`, and perhaps `FIELD=VALUE` after it")
        given = {COMMAND: words[0], **dict(word.split("=", 1) for word in words[1:])}
        number = self.session.order(to, given)
        return [f"{to.level} is ordered {rest}: number {number}"]

    # --- by name ---

    def _by_name(self, text: str) -> Output:
        call = call_of(text)
        if call is None:
            raise Refused(Code.SHELL_COMMAND, f"`{text}` is no command", "`help` lists the commands")
        name, args = call
        cycled = self._cycled(name)
        if cycled is not None:
            part = (
                None
                if normal(name).endswith(typed_names.LEVEL)
                else known_name(name, self._parts(self.session.level))
            )
            if part is not None:
                raise typed_names.ambiguous(name, (f"{cycled.name}-level", f"{self.session.chosen}.{part}"))
            return self._alone(cycled, _number(args[0]) if args else 1)
        level, rest = typed_names.addressed(name, self.session.levels) or (self.session.level, name)
        if known_name(rest, part_names(self.session.program(level))) is None:
            raise self._unknown(name)
        return self.session.part(level, rest, args)

    def _cycled(self, name: str) -> RunningLevel | None:
        """The level that `task-level`, or `task`, cycles."""
        wanted = normal(name)
        every = {normal(level.name): level for level in self.session.levels}
        return every.get(wanted.removesuffix(typed_names.LEVEL)) or every.get(wanted)

    def _unknown(self, name: str) -> Refused:
        level, rest = typed_names.split(name, self.session.levels, self.session.level)
        if typed_names.positions(level.sign, rest):
            return Refused(
                Code.SHELL_COMMAND, f"`{name}` is a variable", f"`{name} ?` shows it, `{name} = ...` sets it"
            )
        return typed_names.unknown(
            name, "command, module, procedure, owner, table or level", self.completions()
        )

    def _parts(self, level: RunningLevel) -> tuple[str, ...]:
        try:
            return tuple(part_names(self.session.program(level)))
        except Refused:
            return ()

    # --- variables ---

    def _show_variable(self, name: str) -> Output:
        level, places = typed_names.variable(name, self.session.levels, self.session.level)
        return [typed_names.shown(level, at) for at in places]

    def _show(self, rest: str) -> Output:
        if not rest:
            return self.session.changed() or ["the last cycle changed nothing"]
        level = typed_names.level_of(rest, self.session.levels)
        return [typed_names.shown(level, at) for at in range(len(level.sign.leaves))]

    def _names(self, rest: str) -> Output:
        other = next((level for level in self.session.levels if level.name == rest), None)
        level, word = (self.session.level, rest) if other is None else (other, "")
        every = named(self.session.program(level), {}, self.session.system.description)
        found = [one for one in every if one.speaks_of(word)]
        if not found:
            raise Refused(
                Code.SHELL_NAME,
                f"no variable of level `{level.name}` has `{word}` in its name, meaning or type",
                "`level LEVEL` chooses another level",
            )
        return names_text(found).splitlines()

    def _buffers(self, rest: str) -> Output:
        readers = self.session.system.description.readers()
        every = {source: ends for source, ends in readers.items() if rest in " ".join((source, *ends))}
        if not every:
            raise typed_names.unknown(rest, "buffer", list(readers))
        frozen = self.session.memory.frozen
        return [
            f"{source} = {', '.join(ends)}: {self._held(source, *ends)}{', frozen' * (source in frozen)}"
            for source, ends in every.items()
        ]

    def _held(self, *ends: str) -> str:
        """A buffer's latest value, in the words of the first level among its ends, the one that fills it before its readers."""
        latest = self.session.memory.latest(ends[0])
        if latest is None:
            return "nothing yet"
        for end in ends:
            name, _, variable = end.partition(".")
            level = typed_names.by_name(self.session.levels).get(name)
            if level is not None:
                leaves = [level.sign.leaves[at] for at in level.sign.record(variable)]
                return ", ".join(
                    f"{leaf.name.removeprefix(f'{variable}.')} {leaf.shown(value)}"
                    for leaf, value in zip(leaves, latest, strict=True)
                )
        return str(latest)

    # --- levels ---

    def _level(self, rest: str) -> Output:
        if rest:
            self.session.chosen = typed_names.level_of(rest, self.session.levels).name
        return [f"level `{self.session.chosen}`"]

    def _levels(self, rest: str) -> Output:
        _nothing("levels", rest)
        return [
            f"{'*' if level.name == self.session.chosen else ' '} {level.name:14} every {level.level.period_ms} ms: "
            f"{', '.join(level.level.every_table)}"
            for level in self.session.levels
        ]

    def _lines(self, rest: str) -> Output:
        _nothing("lines", rest)
        return [f"{level.name:14} {_at(level)}" for level in self.session.levels]

    # --- cycles ---

    def _step(self, rest: str) -> Output:
        words = rest.split()
        if words and not _is_number(words[0]):
            level = typed_names.level_of(words[0], self.session.levels)
            return self._alone(level, _number(" ".join(words[1:]) or "1"))
        for _ in range(_number(rest or "1")):
            self.session.cycle()
            if self.session.interrupted:
                break
        return self.stepped()

    def _alone(self, level: RunningLevel, count: int) -> Output:
        for _ in range(count):
            self.session.cycle_alone(level)
        return self.stepped(level.name)

    def _run(self, rest: str) -> Output:
        order = self._run_order(rest)
        return [self.session.run(order.most, order.until)]

    def run_order(self, line: str) -> RunOrder | None:
        """What a line has run in cycles that somebody may want to see, or to stop; None for any other line.

        Raises:
            Refused: It would be refused.
        """
        word, _, rest = said(line).partition(" ")
        rest = rest.strip()
        if word.casefold() == "run":
            return self._run_order(rest)
        if word.casefold() == "step" and (not rest or _is_number(rest)):
            return RunOrder(_number(rest or "1"), steps=True)
        if word.casefold() == "step":
            name, _, count = rest.partition(" ")
            level = typed_names.level_of(name, self.session.levels)
            return RunOrder(_number(count.strip() or "1"), steps=True, alone=level.name)
        return None

    def proves(self, line: str) -> bool:
        """Return whether a line proves or compiles: it takes or compares tables, or runs a part by name."""
        text = said(line)
        word = text.partition(" ")[0].casefold()
        return word in {"diff", "reload"} or not (
            word in self._words or _SHOW.match(text) or _SET.match(text)
        )

    def proves_together(self, line: str) -> bool:
        """Return whether a line first has the levels proved together, which may take minutes."""
        word, _, rest = said(line).partition(" ")
        return word.casefold() == "reload" and "proved" in _flags(rest)[1]

    def stepped(self, alone: str = "") -> Output:
        """Return the text of `step`, or of `step LEVEL`."""
        if alone:
            return [f"{alone} alone: {_at(self.session.system.level(alone))}"]
        return [f"cycle {self.session.system.tick}: {', '.join(_at(level) for level in self.session.levels)}"]

    def _run_order(self, rest: str) -> RunOrder:
        word, _, more = rest.partition(" ")
        if word == "until":
            return RunOrder(MOST_CYCLES, self.session.question(more))
        if word == "to":
            return self._run_to(more.strip())
        if not (rest or self.heard or self.session.stops.every):
            raise Refused(
                Code.SHELL_COMMAND,
                "nothing would stop it",
                "`run N`, `run until CONDITION`, or `break` first",
            )
        return RunOrder(_number(rest) if rest else MOST_CYCLES)

    def _run_to(self, place: str) -> RunOrder:
        word, _, number = place.partition(" ")
        if word != "cycle":
            return RunOrder(MOST_CYCLES, self._line(place))
        left = _number(number) - self.session.system.tick
        if left < 0:
            raise Refused(
                Code.SHELL_COMMAND, f"it is cycle {self.session.system.tick} already", "`undo` goes back"
            )
        return RunOrder(left)

    def _line(self, place: str) -> NamedLine:
        line = typed_names.line_of(place, self.session.levels, self.session.level)
        if line is None:
            raise typed_names.unknown(place, "line", self.completions())
        return line

    def _log(self, rest: str) -> Output:
        if rest == "off":
            if not self.session.end_log():
                raise Refused(Code.SHELL_COMMAND, "no log is being written", "`log FILE.mcap` begins one")
            return [f"the log ends with cycle {self.session.system.tick}"]
        if not rest.endswith(".mcap"):
            raise Refused(
                Code.SHELL_COMMAND, f"`{rest}` is no name of a log", "write `log FILE.mcap`, or `log off`"
            )
        try:
            path = (
                Path(rest) if self.folder is None else within(self.folder, self.folder, rest, "path of a log")
            )
        except BadName as error:
            raise Refused(Code.SHELL_COMMAND, str(error)) from error
        return [self.session.log(path)]

    def _undo(self, rest: str) -> Output:
        self.session.undo(_number(rest or "1"))
        return self.stepped()

    def _restart(self, rest: str) -> Output:
        name, _, how = rest.partition(" ")
        if how.strip() not in {"", "anew"}:
            raise Refused(Code.SHELL_COMMAND, f"`{how.strip()}` is not `anew`")
        return [self.session.restart(self._named(name), anew=bool(how.strip()))]

    def _hold(self, rest: str) -> Output:
        return [self.session.hold(self._named(rest), on=True)]

    def _release(self, rest: str) -> Output:
        return [self.session.hold(self._named(rest), on=False)]

    def _freeze(self, rest: str) -> Output:
        return [self.session.freeze(rest, on=True)]

    def _thaw(self, rest: str) -> Output:
        return [self.session.freeze(rest, on=False)]

    def _reload(self, rest: str) -> Output:
        place, flags = _flags(rest)
        name = self._named(place)
        return self.session.reload(name, anyway="anyway" in flags, prove="proved" in flags)

    def _diff(self, rest: str) -> Output:
        return self.session.difference(self._named(rest))

    def _named(self, rest: str) -> str:
        return typed_names.level_of(rest or self.session.chosen, self.session.levels).name

    # --- conditions ---

    def _break(self, rest: str) -> Output:
        what: StateQuery | NamedLine | None = typed_names.line_of(
            rest, self.session.levels, self.session.level
        )
        stop = self.session.stops.add(what or self.session.question(rest))
        return [f"breakpoint {stop.number}: {stop.text}"]

    def _breaks(self, rest: str) -> Output:
        _nothing("breaks", rest)
        return [f"{stop.number}: {stop.text}" for stop in self.session.stops.every] or ["no breakpoints"]

    def _delete(self, rest: str) -> Output:
        number = _number(rest)
        stop = next((stop for stop in self.session.stops.every if stop.number == number), None)
        if stop is None:
            raise Refused(Code.SHELL_NAME, f"there is no breakpoint {number}", "`breaks` lists them")
        self.session.stops.every.remove(stop)
        return []

    def _expect(self, rest: str) -> Output:
        condition = self.session.question(rest)
        if not asked(condition, self.session.levels):
            now = condition.now(typed_names.by_name(self.session.levels))
            raise Refused(Code.SHELL_EXPECTED, f"`{condition.text}` does not hold{f': {now}' if now else ''}")
        return []

    def _help(self, rest: str) -> Output:
        _nothing("help", rest)
        return HELP.splitlines()

    def _quit(self, rest: str) -> Output:
        _nothing("quit", rest)
        self.over = True
        return []


def _flags(rest: str) -> tuple[str, AbstractSet[str]]:
    """The level that `reload` is of, and how."""
    words, flags = rest.split(), set[str]()
    while words and words[-1].casefold() in {"anyway", "proved"}:
        flags.add(words.pop().casefold())
    return " ".join(words), flags


def _at(level: RunningLevel) -> str:
    """`task.acquire.5`; a hyphen for no line; of several tables each."""
    return " ".join(f"{level.name}.{table}.{line or '-'}" for table, line in level.lines)


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdecimal()


def _number(text: str) -> int:
    if not _is_number(text) or len(text) > 9 or int(text) > MOST_CYCLES:
        raise Refused(Code.SHELL_COMMAND, f"`{text}` is no number of cycles up to {MOST_CYCLES}")
    return int(text)


def _nothing(word: str, rest: str) -> None:
    if rest:
        raise Refused(Code.SHELL_COMMAND, f"`{word}` takes nothing after it, not `{rest}`")
