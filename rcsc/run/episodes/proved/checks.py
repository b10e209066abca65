"""How each kind of claim is looked at in a cycle of its level.

In: a claim, and how its level's leaves are read. Out: a `Check`, which gives what is wrong in a cycle, or why no episode can look at it.
Every condition is that of the obligation of the same name in `rcsc.compose.contract.obligations`, on values instead of nodes, written
anew: what the proof and the executors do not share is what this is to find.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from rcsc.lang.interpret import UNDEFINED, holds
from rcsc.lang.leaves import read_by, spoken_of
from rcsc.lang.model import Value, pending
from rcsc.lang.over_time import Watch
from rcsc.lang.restart import NUMBERS
from rcsc.run.episodes.proved.claims import Claim, ProvedLevel, WatchedNeighbour
from rcsc.run.episodes.proved.cycles import EXTERN, FLAG, Now, Reader, told
from rcsc.run.signature import FAULTS, STOPPED, Values

Check = Callable[[Now], str]
"""What is wrong in a cycle; empty for nothing."""
_NONE, _SEVERAL = FAULTS.index("no line matches"), FAULTS.index("several lines match")
_DONE = (0, EXTERN, STOPPED)
"""Faults of a cycle that took its inputs and that no proof excludes."""


class CannotWatch(Exception):  # noqa: N818  # an answer, not an error of ours
    """No episode can look at the claim; says why."""


def check_of(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    """How a claim is looked at.

    Raises:
        CannotWatch: Nothing here can.
    """
    if claim.kind == "KEPT":
        raise CannotWatch("it is about what could come, too")
    maker = _MAKERS.get(claim.kind)
    if maker is None:
        raise CannotWatch("it is about no cycle that runs")
    return maker(claim, reader, level)


# --- tables ------------------------------------------------------------------------------------


def _matches(claim: Claim, _: Reader, __: ProvedLevel, fault: int) -> Check:
    def check(now: Now) -> str:
        wrong = now.fault == fault and now.level.table == claim.table
        return now.level.fault_text if wrong else ""

    return check


def _no_default(claim: Claim, reader: Reader, _: ProvedLevel) -> Check:
    default = reader.table(claim.table).default
    assert default is not None
    return partial(_never, (claim.table, str(default.name)))


def _unreached(claim: Claim, _: Reader, __: ProvedLevel) -> Check:
    return partial(_never, (claim.table, claim.name))


def _never(line: tuple[str, str], now: Now) -> str:
    return f"line `{line[1]}` of table `{line[0]}` runs" if line in now.lines else ""


def _assumption(claim: Claim, reader: Reader, _: ProvedLevel) -> Check:
    if claim.name not in reader.sign.monitored:
        raise CannotWatch("no executor checks it")

    def check(now: Now) -> str:
        ran = claim.table in {table for table, _ in now.lines}
        failed = ran and now.fault in _DONE and claim.name in now.level.sign.failures(now.level.values)
        return f"assumption `{claim.name}` fails in table `{claim.table}`" if failed else ""

    return check


def _safe(_: Claim, reader: Reader, __: ProvedLevel) -> Check:
    bounds: list[tuple[int, float, float]] = []
    for at, leaf in enumerate(reader.sign.leaves):
        low, high = (0, len(leaf.members) - 1) if leaf.members else (leaf.low, leaf.high)
        if leaf.kind != "input" and low is not None and high is not None:
            bounds.append((at, low, high))

    def check(now: Now) -> str:
        for at, low, high in bounds:
            if not low <= now.values[at] <= high:
                return reader.shown(reader.sign.leaves[at].name, now.values)
        return ""

    return check


# --- what the program states -------------------------------------------------------------------


def _invariant(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    stated = next(stated.condition for stated in reader.program.invariants if stated.name == claim.name)
    return _owed(replace(claim, stated=stated), reader, level)


def _owed(claim: Claim, reader: Reader, _: ProvedLevel) -> Check:
    stated = claim.stated
    assert stated is not None
    reads = tuple(dict.fromkeys(map(str, read_by(stated))))

    def check(now: Now) -> str:
        good = reader.true(stated, now.values, now.before)
        return "" if good else told(reader, iter(reads), now.values, now.before)

    return check


def _property(claim: Claim, reader: Reader, _: ProvedLevel) -> Check:
    stated = next(stated for stated in reader.program.properties if stated.name == claim.name)
    reads = tuple(map(str, spoken_of(stated)))
    watch = None if stated.monitor is None else Watch(stated)

    def check(now: Now) -> str:
        if watch is not None:
            if now.begins:
                watch.begin()
            kept = watch.keeps(reader.snapshot(now.before), reader.snapshot(now.values))
            return (
                ""
                if kept
                else f"`{stated.text}` is broken: {told(reader, iter(reads), now.values, now.before)}"
            )
        if reader.true(stated.condition, now.values, now.before):
            return ""
        return f"`{stated.text}` is false: {told(reader, iter(reads), now.values, now.before)}"

    return check


# --- orders and reports ------------------------------------------------------------------------


def _echoes(_: Claim, reader: Reader, level: ProvedLevel) -> Check:
    above = level.above
    assert above is not None
    report = reader.record(above.report)
    number, command, echo, echoed = map(reader.at, (above.number, above.command, above.echo, above.echoed))

    def check(now: Now) -> str:
        values = now.values
        late = now.fault and values[report.start : report.stop] == now.before[report.start : report.stop]
        if late or (now.took and (values[echo], values[echoed]) == (values[number], values[command])):
            return ""
        taken = f"{reader.shown(above.number, values)}, {reader.shown(above.command, values)}"
        return f"{taken}, but {reader.shown(above.echo, values)}, {reader.shown(above.echoed, values)}"

    return check


def _numbered(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    below = next(one for one in level.below if claim.name.startswith(f"{one.order}."))
    number, leaf = reader.at(below.number), reader.at(claim.name)

    def check(now: Now) -> str:
        changed = now.before[number] == now.values[number] and now.before[leaf] != now.values[leaf]
        was = reader.shown(claim.name, now.before)
        return f"was {was}, and is {reader.shown(claim.name, now.values)}" if changed else ""

    return check


def _next_number(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    number = reader.at(_below(claim, level).number)

    def check(now: Now) -> str:
        step = (int(now.values[number]) - int(now.before[number])) % NUMBERS
        return f"the number goes on by {step}" if step > 1 else ""

    return check


def _below(claim: Claim, level: ProvedLevel) -> WatchedNeighbour:
    return next(one for one in level.below if one.order == claim.name)


def _stays(above: WatchedNeighbour, reader: Reader) -> Callable[[Now], bool]:
    """Whether a level takes the same order as in the last cycle that took one."""
    number = reader.at(above.number)
    return lambda now: now.stood[number] == now.values[number]


def _waits(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    below, above = _below(claim, level), level.above
    assert above is not None
    stays, command = _stays(above, reader), reader.at(below.command)
    echo, number = reader.at(below.echo), reader.at(below.number)
    if below.late:  # as the table saw it: an order that takes a number is late no more where the cycle ends
        _replayed(reader)

    def check(now: Now) -> str:
        waiting = now.took and stays(now) and now.values[echo] != now.stood[number]
        if not waiting or now.values[command] == now.stood[command]:
            return ""
        if below.late and reader.prepared(now)[below.late]:
            return ""
        return (
            f"was {reader.shown(below.command, now.stood)}, and is {reader.shown(below.command, now.values)}"
        )

    return check


def _pauses(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    below, above = _below(claim, level), level.above
    assert above is not None
    stays, ordered, passed = _stays(above, reader), reader.at(above.command), reader.at(below.command)

    def check(now: Now) -> str:
        new = now.took and now.fault in _DONE and not stays(now)
        wrong = new and now.values[ordered] == 0 and now.values[passed] != 0
        return reader.shown(below.command, now.values) if wrong else ""

    return check


def _once(_: Claim, reader: Reader, level: ProvedLevel) -> Check:
    assert level.above is not None
    stays, flag = _stays(level.above, reader), reader.at(FLAG)

    def check(now: Now) -> str:
        rises = now.took and now.values[flag] and not now.stood[flag]
        return f"`{FLAG}` rises again" if rises and stays(now) else ""

    return check


def _deferred(claim: Claim, reader: Reader, _: ProvedLevel) -> Check:
    _replayed(reader)
    leaf, waits = reader.at(claim.name), reader.at(str(pending(claim.name)))

    def check(now: Now) -> str:
        value = now.values[leaf]
        if now.fault not in _DONE or value == now.values[waits] or value == now.stood[leaf]:
            return ""
        good = value == reader.prepared(now)[claim.name]
        return "" if good else f"{reader.shown(claim.name, now.values)} was written directly"

    return check


def _answered(claim: Claim, reader: Reader, _: ProvedLevel) -> Check:
    """A line that matches with the flag up and down leaves it up: seen once more, the command is still new."""
    _replayed(reader)
    if reader.level.stages:
        raise CannotWatch("what its last table sees is computed by those before it")
    table = reader.table(claim.table)

    def blind(line: str, seen: Mapping[str, Value]) -> bool:
        down = {**seen, FLAG: False}
        found = next((one for one in table.lines if one.name == line), None)
        if found is None:  # DEFAULT, which reads no flag
            return table.default is not None and not table.default.unreachable
        if any(test is not None and [*map(str, read_by(test.condition))] == [FLAG] for test in found.tests):
            return False
        return all(test is None or holds(test, down) for test in found.tests)

    def check(now: Now) -> str:
        ran = next((line for name, line in now.lines if name == claim.table), None)
        if ran is None or now.fault not in _DONE or not (seen := reader.prepared(now))[FLAG]:
            return ""
        try:
            if ran and not blind(ran, seen):
                return ""
            again = reader.begun(reader.snapshot(now.values))
        except UNDEFINED:
            return ""
        return "" if again[FLAG] else f"line `{ran}` takes no notice of a new command, and it is new no more"

    return check


def _replayed(reader: Reader) -> None:
    """Raises: CannotWatch: No cycle of the program can be run again."""
    if reader.asks:
        raise CannotWatch("results of extern procedures are kept nowhere")


# --- what neighbours say -----------------------------------------------------------------------


def contract(record: str, reader: Reader, level: ProvedLevel) -> Check:
    """What a level assumes of what it takes in a record of orders or reports.

    Raises:
        CannotWatch: It is neither.
    """
    if level.above is not None and level.above.order == record:
        return _same_order(level.above, reader)
    below = next((one for one in level.below if one.report == record), None)
    if below is None:
        raise CannotWatch("it is neither an order nor a report")
    return _fits(below, reader)


def _same_order(above: WatchedNeighbour, reader: Reader) -> Check:
    stays, leaves = _stays(above, reader), [(name, reader.at(name)) for name in above.numbered]

    def check(now: Now) -> str:
        if not now.took or not stays(now):
            return ""
        other = next((name for name, at in leaves if now.stood[at] != now.values[at]), None)
        return (
            "" if other is None else f"another order under the same number: {reader.shown(other, now.values)}"
        )

    return check


def _fits(below: WatchedNeighbour, reader: Reader) -> Check:
    number, command, echo, echoed = map(reader.at, (below.number, below.command, below.echo, below.echoed))

    def check(now: Now) -> str:
        sent, last, said = (int(value) for value in (now.stood[number], now.stood[echo], now.values[echo]))
        wrong = ""
        if not now.took:
            pass
        elif said == sent:
            wrong = "" if now.values[echoed] == now.stood[command] else "is about another command"
        elif said == (sent + 1) % NUMBERS:
            wrong = "is about an order that was not given yet"
        elif last == sent:
            wrong = "is about an older order again"
        return f"{reader.shown(below.echo, now.values)} {wrong}" if wrong else ""

    return check


def _given(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    """What is declared of a buffer that another level writes holds of what is taken."""
    stated = next(fact.condition for fact in reader.program.assumptions if fact.name == claim.name)
    holds_ = _owed(replace(claim, stated=stated), reader, level)
    return lambda now: holds_(now) if now.took else ""


def _stands(_: Claim, reader: Reader, level: ProvedLevel) -> Check:
    """A report that answers a command stays as it is while it is about that command; what it begins with answers nothing."""
    above = level.above
    assert above is not None
    report = reader.record(above.report)
    number, command, echo, echoed = map(reader.at, (above.number, above.command, above.echo, above.echoed))
    status = reader.at(above.status)

    def check(now: Now) -> str:
        was, is_ = now.before, now.values
        said = reader.sign.leaves[status].shown(was[status])
        ended = not now.anew and (said == above.done or (said == above.failed and was[echoed] != 0))
        about = was[echo] == is_[echo] == now.stood[number] and was[echoed] == now.stood[command]
        same = was[report.start : report.stop] == is_[report.start : report.stop]
        return "" if same or not (ended and about) else f"`{above.report}` changes once it has said {said}"

    return check


def _answer_stays(_: Claim, reader: Reader, level: ProvedLevel, *, failed: bool) -> Check:
    """What was answered of the order taken last stays, but of the command that rests; what stands at a restart has failed."""
    above = level.above
    assert above is not None
    number, command, echo, status = map(reader.at, (above.number, above.command, above.echo, above.status))
    word, shown = above.failed if failed else above.done, reader.sign.leaves[status].shown

    def check(now: Now) -> str:
        was, order = now.before, now.stood[number]
        answered = failed if now.restarted else was[echo] == order and shown(was[status]) == word
        same = not now.took or now.values[command] == now.stood[command]
        asked = answered and same and now.values[echo] == order and now.stood[command] != 0
        said = shown(now.values[status])
        return f"order {order} was {word}, and is {said}" if asked and said != word else ""

    return check


def _again(claim: Claim, reader: Reader, level: ProvedLevel) -> Check:
    """A line that gave an order and matches again on the same inputs changes nothing, and gives no other."""
    if reader.asks:
        raise CannotWatch("results of extern procedures are kept nowhere")
    numbers = [reader.at(one.number) for one in level.below]
    leaves = [(name, reader.at(name)) for name in claim.about]
    last: list[tuple[tuple[tuple[str, str], ...], Values]] = []

    def check(now: Now) -> str:
        wrong, inputs = "", tuple(now.values[at] for at in reader.inputs)
        same = bool(last) and not now.anew and now.fault == 0 and last[0] == (now.lines, inputs)
        gives = now.fault == 0 and any(now.values[at] != now.before[at] for at in numbers)
        if same:
            changed = next((name for name, at in leaves if now.values[at] != now.before[at]), "")
            wrong = (
                f"{reader.shown(changed, now.before)} becomes {reader.shown(changed, now.values)}"
                if changed
                else ""
            )
        last[:] = [(now.lines, inputs)] if gives else []
        return wrong

    return check


_MAKERS: Mapping[str, Callable[[Claim, Reader, ProvedLevel], Check]] = {
    "SOME_LINE": partial(_matches, fault=_NONE),
    "ONE_LINE": partial(_matches, fault=_SEVERAL),
    "NO_DEFAULT": _no_default,
    "UNREACHED": _unreached,
    "ASSUMPTION": _assumption,
    "SAFE": _safe,
    "INVARIANT": _invariant,
    "PROPERTY": _property,
    "REQUIREMENT": _property,
    "OWED": _owed,
    "ECHOES": _echoes,
    "NUMBERED": _numbered,
    "NEXT_NUMBER": _next_number,
    "WAITS": _waits,
    "PAUSES": _pauses,
    "ONCE": _once,
    "DEFERRED": _deferred,
    "ANSWERED": _answered,
    "CONTRACT": lambda claim, reader, level: contract(claim.name, reader, level),
    "GIVEN": _given,
    "STANDS": _stands,
    "DONE_STAYS": partial(_answer_stays, failed=False),
    "FAILED_STAYS": partial(_answer_stays, failed=True),
    "AGAIN": _again,
}
WATCHED = frozenset({*_MAKERS, "ENDS"})
"""Kinds of claims that an episode can look at."""
