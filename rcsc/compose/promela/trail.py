"""A trail in the tables' words, and run again.

In: the lines that a trail prints. Out: a `Run`: for each cycle the level, the table, the line and what the outside said. What can be made
concrete is given to the reference interpreter, which has to take the same lines; what stands for a computed real cannot, and where the
interpreter goes another way the run is shown as Spin's alone.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.compose.contract.environment import ECHO, NUMBER, leaves_under
from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.contract.transition import NUMBERS, SEEN, TransitionSystem
from rcsc.compose.counterexample.trace import broken, one_cycle
from rcsc.compose.promela.assemble import BROKEN, NONE, RESTARTED, TAKEN, TOLD, Model
from rcsc.compose.promela.cycle.aims import CONTRACT, Aim
from rcsc.compose.promela.lazy_copy import LazyCopy
from rcsc.lang.interpret import Fault, Outcome, cycle, evaluate, initial
from rcsc.lang.leaves import read_by
from rcsc.lang.model import BEFORE, Enum, Kind, Read, Table, Value, spell
from rcsc.run.adopt import ECHOES, FAILED, ORDER


@dataclass(frozen=True, slots=True)
class Explanation:
    """What a trail prints: a cycle, or that a level reads, or begins anew.

    Attributes:
        values: Of a cycle: what each told name is, but for those without a value.
    """

    word: str
    level: str
    table: int = 0
    line: int = 0
    values: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Run:
    """A run that breaks a check.

    Attributes:
        lines: A paragraph a cycle.
        cycles: How many there are.
        ran: The interpreter takes the same lines, and breaks the same.
        reason: Why not, in words.
    """

    aim: Aim
    lines: tuple[str, ...]
    cycles: int
    ran: bool
    reason: str


def told(model: Model, trail: Sequence[str]) -> tuple[Explanation, ...]:
    """The lines of a trail, read."""
    found = []
    for line in trail:
        word, *rest = line.split()
        if word == TOLD:
            level, table, at, *values = rest
            names = model.told[level]
            known = tuple((name, int(v)) for name, v in zip(names, values, strict=True) if int(v) != NONE)
            found.append(Explanation(word, level, int(table), int(at), known))
        elif word in {TAKEN, RESTARTED}:
            found.append(Explanation(word, rest[0]))
    return tuple(found)


def run_of(model: Model, system: Mapping[str, TransitionSystem], trail: Sequence[str]) -> Run:
    """The trail in words, and what the interpreter makes of it."""
    aim = model.aims[int(next(line for line in reversed(trail) if line.startswith(BROKEN)).split()[1])]
    events = told(model, trail)
    lines = list(_words(model, system, events))
    reason = rerun(model, system, events, aim)
    return Run(aim, tuple(lines), sum(one.word == TOLD for one in events), not reason, reason)


# --- words ----------------------------------------------------------------------------


def _words(
    model: Model, system: Mapping[str, TransitionSystem], events: Sequence[Explanation]
) -> Iterator[str]:
    number, last = 0, len(events) - 1
    before: dict[str, int] = {}
    for at, event in enumerate(events):
        if event.word != TOLD:
            yield f"level `{event.level}` {'begins anew' if event.word == RESTARTED else 'reads what the others say'}"
            continue
        number += 1
        table = system[event.level].program.tables[event.table]
        yield f"cycle {number}: level `{event.level}`, table `{table.name}`, {_line(table, event.line, ended=at < last)}"
        said = [
            f"{name.partition(':')[2]} = {_value(model, name, code)}"
            for name, code in event.values
            if before.get(_leaf(name)) != code and (name == _leaf(name) or not model.domains[name].size)
        ]
        before |= dict(event.values)
        if said:
            yield f"  with {', '.join(said)}"


def _line(table: Table, line: int, *, ended: bool) -> str:
    """The line that ran; where the check is broken before one does, that it ends there."""
    if line:
        return f"line `{table.lines[line - 1].name}`"
    if not ended:
        return "and no further"
    return "no line" if table.default is None else f"line `{table.default.name}`"


def _value(model: Model, name: str, code: int) -> str:
    """A value; of numbers, how far it is from the one that the others are counted from."""
    domain = model.domains[name]
    if domain.size:
        return "the same number" if code == 0 else f"{code} after it, of {domain.size}"
    return spell(domain.kind, domain.decoded(code))


# --- the interpreter ------------------------------------------------------------------


def rerun(
    model: Model,
    system: Mapping[str, TransitionSystem],
    events: Sequence[Explanation],
    aim: Aim | None = None,
) -> str:
    """Empty where the interpreter takes the same lines, and breaks the same in the last cycle; else in which it does not.

    Args:
        model: That the events are of.
        system: Every level's transition system.
        events: A run from the beginning.
        aim: What the last cycle breaks; none where it breaks nothing.
    """
    states = {name: dict(initial(system[name].program)) for name in model.levels}
    behind = {name: dict(state) for name, state in states.items()}
    drawn = _later(model, events)
    remembered = _remembered(model, events)
    split = any(event.word == TAKEN for event in events)
    number = 0
    outcome: Outcome | None = None
    before: Mapping[str, Value] = {}
    for at, event in enumerate(events):
        ts, now = system[event.level], states[event.level]
        if event.word == RESTARTED:
            _restart(ts, now)
            now |= {
                name.partition(":")[2]: model.domains[name].decoded(code)
                for name, code in remembered[at].items()
            }
            behind[event.level] = dict(now)
            continue
        if event.word == TAKEN or not split:
            _copy(model, system, states, event.level)
        if event.word == TAKEN:
            continue
        number += 1
        now |= _inputs(model, ts, now, {**drawn[at], **remembered[at], **dict(event.values)})
        outcome = cycle(ts.program, ts.level, now)
        before, behind[event.level] = behind[event.level], dict(outcome.snapshot)
        states[event.level] = outcome.snapshot
        if (at < len(events) - 1 or aim is None) and not _same(ts, event, outcome):
            return f"the interpreter goes another way in cycle {number}: {_did(ts, outcome)}"
    if aim is not None and (outcome is None or not _breaks(system[aim.level], aim, before, outcome)):
        return "the interpreter does not break it in the last cycle"
    return ""


def _remembered(model: Model, events: Sequence[Explanation]) -> list[dict[str, int]]:
    """For each event what a property says in the level's next cycle that was then: a value may be asked for so late."""
    after: dict[str, dict[str, int]] = {}
    found: list[dict[str, int]] = []
    for event in reversed(events):
        found.append(after.get(event.level, {}))
        if event.word == TOLD:
            after[event.level] = {
                _leaf(name): code
                for name, code in event.values
                if name != _leaf(name) and not model.domains[name].size
            }
    return found[::-1]


def _leaf(name: str) -> str:
    """The leaf itself, of a name of what it was."""
    level, _, leaf = name.partition(":")
    return f"{level}:{leaf.removeprefix(BEFORE)}"


def _later(model: Model, events: Sequence[Explanation]) -> list[dict[str, int]]:
    """For each event the next value of each copy: what was copied is known when it is first looked at."""
    copies = {one.name for one in model.copies}
    after: dict[str, int] = {}
    found: list[dict[str, int]] = []
    for event in reversed(events):
        after = {**after, **{name: code for name, code in event.values if name in copies}}
        found.append(dict(after))
    return found[::-1]


def _inputs(
    model: Model, ts: TransitionSystem, now: Mapping[str, Value], codes: Mapping[str, int]
) -> dict[str, Value]:
    """The inputs that the outside gives in a cycle."""
    level = ts.level.name
    inputs = {str(v.name) for v in ts.program.variables if v.kind is Kind.INPUT}
    given: dict[str, Value] = {}
    for name, code in codes.items():
        leaf = name.removeprefix(f"{level}:")
        if leaf in inputs and not model.domains[name].size:
            given[leaf] = model.domains[name].decoded(code)
    for one in model.copies:
        if one.name in codes:
            given |= {k: v for k, v in _copied(model, one, codes[one.name]).items() if k in inputs}
    return given | _numbers(model, ts, now, codes)


def _copied(model: Model, copy: LazyCopy, code: int) -> dict[str, Value]:
    """What was copied, by its leaf; of a truth value, something that makes it so."""
    (name, *others) = dict.fromkeys(map(str, read_by(copy.value)))
    leaf = name.partition(":")[2]
    if others:
        return {}
    if isinstance(copy.value, Read):
        return {leaf: model.domains[copy.name].decoded(code)}
    for value in map(model.domains[name].decoded, model.domains[name].drawn):
        if bool(evaluate(copy.value, {name: value})) == bool(code):
            return {leaf: value}
    return {}


def _numbers(
    model: Model, ts: TransitionSystem, now: Mapping[str, Value], codes: Mapping[str, int]
) -> dict[str, Value]:
    """Numbers as they are, of what the trail says of them."""
    level, found = ts.level.name, dict[str, Value]()
    above = ts.links.above
    if above is not None and above.name not in model.levels:
        leaf = f"{above.order}.{NUMBER}"
        found[leaf] = (int(now[leaf]) + codes.get(f"{level}:another order", 0)) % NUMBERS
    for below in ts.links.below:
        if below.name not in model.levels:
            sent = int(now[f"{below.order}.{NUMBER}"])
            found[f"{below.report}.{ECHO}"] = (sent - codes.get(f"{level}:{below.name} is late", 0)) % NUMBERS
            late = codes.get(f"{level}:{below.name} is late", 0)
            if not late:
                found[f"{below.report}.ref_command_echo"] = now[f"{below.order}.input_command"]
    for name, code in codes.items():
        leaf = name.removeprefix(f"{level}:")
        lead = model.leading.get(name, name).removeprefix(f"{level}:")
        if model.domains[name].size and leaf not in found and lead != leaf and lead in now:
            size = model.domains[name].size
            found[leaf] = (int(now[lead]) + (code - size if code else 0)) % NUMBERS
    return found


def _copy(
    model: Model, system: Mapping[str, TransitionSystem], states: Mapping[str, dict[str, Value]], level: str
) -> None:
    """The buffers of the other levels of the model, whole."""
    ts, now = system[level], states[level]
    pairs = []
    above = ts.links.above
    if above is not None and above.name in model.levels:
        upper = next(one for one in system[above.name].links.below if one.name == level)
        pairs.append((above.order, above.name, upper.order))
    for below in ts.links.below:
        lower = system[below.name].links.above if below.name in model.levels else None
        if lower is not None:
            pairs.append((below.report, below.name, lower.report))
    for record, other, source in pairs:
        for leaf in leaves_under(ts.program, record):
            now[leaf] = states[other][source + leaf.removeprefix(record)]


def _restart(ts: TransitionSystem, now: dict[str, Value]) -> None:
    """As `run.adopt` begins, with every buffer as it is initially."""
    kinds = {str(v.name): v.type for v in ts.program.variables}
    for leaf, member in FAILED.items():
        kind = kinds.get(leaf)
        if isinstance(kind, Enum) and member in kind.members:
            now[leaf] = kind.members.index(member)
    above = ts.links.above
    if above is not None and SEEN in now:
        now[SEEN] = now[f"{above.order}.{NUMBER}"]
    for variable in ts.program.variables:
        record, _, part = variable.name.partition(".")
        echo = f"{record.removeprefix(ORDER)}.{ECHOES.get(part, '')}"
        if variable.kind is Kind.OUTPUT and record.startswith(ORDER) and echo in now:
            now[variable.name] = (int(now[echo]) + 1) % NUMBERS


def _ran(ts: TransitionSystem, outcome: Outcome) -> str:
    """The table that ran."""
    tables = ts.level.tables
    selector = getattr(tables, "selector", None)
    if selector is None:
        return str(getattr(tables, "table", ""))
    return str(dict(getattr(tables, "tables", ()))[evaluate(selector, outcome.snapshot)])


def _same(ts: TransitionSystem, event: Explanation, outcome: Outcome) -> bool:
    table = ts.program.tables[event.table]
    expected = event.line - 1 if event.line else len(table.lines)
    return outcome.fault is Fault.OK and _ran(ts, outcome) == table.name and outcome.line_index == expected


def _did(ts: TransitionSystem, outcome: Outcome) -> str:
    what = (
        f"line `{outcome.line}`" if outcome.line is not None else outcome.fault.name.lower().replace("_", " ")
    )
    return f"table `{_ran(ts, outcome)}`, {what}"


def _breaks(ts: TransitionSystem, aim: Aim, before: Mapping[str, Value], outcome: Outcome) -> bool:
    """Whether the last cycle does; of the contract between levels, which is no obligation of one, whether it ran to its end."""
    if aim.table and aim.table != _ran(ts, outcome):
        return False
    match aim.what:
        case Sort.ASSUMPTION:
            condition = next(one.condition for one in ts.program.assumptions if one.name == aim.name)
            return aim.name in outcome.failed_assumptions or not evaluate(condition, outcome.snapshot)
        case Sort.SOME_LINE:
            return outcome.fault is Fault.NO_LINE
        case Sort.ONE_LINE:
            return outcome.fault is Fault.SEVERAL_LINES
        case Sort.NO_DEFAULT:
            table = next(one for one in ts.program.tables if one.name == aim.table)
            return table.default is not None and outcome.line == table.default.name
        case _ if aim.what in CONTRACT:
            return outcome.fault is Fault.OK
        case _:
            return outcome.fault is Fault.OK and _broken(ts, aim, before, outcome)


def _broken(ts: TransitionSystem, aim: Aim, before: Mapping[str, Value], outcome: Outcome) -> bool:
    """Whether the cycle that the interpreter ran breaks the obligation as `compose.contract.obligations` says it."""
    inputs = {str(v.name) for v in ts.program.variables if v.kind is Kind.INPUT}
    step = one_cycle(ts, before, {name: outcome.snapshot[name] for name in inputs})
    every = obligations(ts, ts.cycle(ts.havoc()))
    found = [one for one in every if (one.sort, one.table, one.name) == (aim.what, aim.table, aim.name)]
    return any(broken(ts, one, step) for one in found)
