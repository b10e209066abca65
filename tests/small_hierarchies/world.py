"""What the environment of a level may do, and what is to be true of every cycle: on concrete states, in the words of `rcsc.compose`.

Nothing of `rcsc.compose.contract.transition` and `obligations` is used but the names of the sorts: this is written anew, to hold them
against it. What makes the inputs few: programs compare numbers for equality and add one (or two, in slips); so a state is the same under
another name for each number that the superior gave, and under a shift of those that go down. Of echoes it matters whether they are of the
last order; where a program computes with an echo (`Role.odd`), the ones near it are tried, too.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import chain, product

from rcsc.compose.contract.environment import Below
from rcsc.compose.contract.obligations import Sort
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Enum, OneTable, Value
from tests.small_hierarchies.compiled import Stated
from tests.small_hierarchies.level import EARLY, FLAG, UNDEFINED, Key, Ran, Role, looks, overlooking

NUMBERS = 65536
FAR = 30_000
"""An echo of no order of late, as seen from the last one."""
NEAR = (NUMBERS - 2, NUMBERS - 1, 2)
"""Echoes that a program which computes with them may make a number of."""

# --- the contract -------------------------------------------------------------------------------


def allowed(role: Role, before: Mapping[str, Value], taken: Mapping[str, Value]) -> bool:
    """Whether the environment may give these inputs after this state."""
    if role.links.above is not None and not ordered(role, before, taken):
        return False
    if not all(owed(taken) for _, owed in facts(role)):
        return False
    return all(answered(below, before, taken) for below in role.links.below)


def facts(role: Role) -> Iterator[tuple[str, Callable[[Mapping[str, Value]], bool]]]:
    """What is declared of inputs that another level writes, which owes it: the record, and whether it holds."""
    conditions = role.compiled.stated[-len(role.links.given) :] if role.links.given else ()
    for fact, condition in zip(role.links.given, conditions, strict=True):
        yield fact.record, partial(_held, condition)


def _held(condition: Stated, taken: Mapping[str, Value]) -> bool:
    return condition(taken, taken)


def ordered(role: Role, before: Mapping[str, Value], taken: Mapping[str, Value]) -> bool:
    """An order under the number that was taken last is the same order."""
    above = role.links.above
    assert above is not None
    number = f"{above.order}.inc_command"
    return taken[number] != before[number] or all(taken[leaf] == before[leaf] for leaf in above.numbered)


def answered(below: Below, before: Mapping[str, Value], taken: Mapping[str, Value]) -> bool:
    """What a subordinate reports fits the last order."""
    sent, command = before[f"{below.order}.inc_command"], before[f"{below.order}.input_command"]
    echo, echoed = taken[f"{below.report}.inc_command_echo"], taken[f"{below.report}.ref_command_echo"]
    if echo == sent:
        return echoed == command  # (1) what is reported under the last number is about the last command
    if echo == (int(sent) + 1) % NUMBERS:
        return False  # (2) the number after the last one is not echoed
    return before[f"{below.report}.inc_command_echo"] != sent  # (3) what is echoed stays echoed


def offers(role: Role, before: Mapping[str, Value]) -> list[tuple[Value, ...]]:
    """Every input that the environment may give after a state, numbers up to their names."""
    records = []
    for leaves in role.taken:
        choices = [_choices(role, leaf, before) for leaf in leaves]
        kept = (dict(zip(leaves, values, strict=True)) for values in product(*choices))
        records.append([tuple(one.values()) for one in kept if _fits(role, before, one)])
    return [tuple(chain.from_iterable(values)) for values in product(*records)]


def _fits(role: Role, before: Mapping[str, Value], taken: Mapping[str, Value]) -> bool:
    """Whether the environment may give this record, of which alone it is asked (`allowed`)."""
    record = next(iter(taken)).partition(".")[0]
    above = role.links.above
    if not all(owed(taken) for about, owed in facts(role) if about == record):
        return False
    if above is not None and record == above.order:
        return ordered(role, before, taken)
    reports = [below for below in role.links.below if below.report == record]
    return all(answered(below, before, taken) for below in reports)


def _choices(role: Role, leaf: str, before: Mapping[str, Value]) -> tuple[Value, ...]:
    above = role.links.above
    if above is not None and leaf == f"{above.order}.inc_command":
        known = dict.fromkeys(int(before[name]) for name in given_numbers(role))
        fresh = next(number for number in range(NUMBERS) if number not in known)
        return (*known, fresh)
    for below in role.links.below:
        if leaf == f"{below.report}.inc_command_echo":
            sent = int(before[f"{below.order}.inc_command"])
            steps = (0, FAR, *NEAR) if role.odd else (0, FAR)
            return tuple((sent + step) % NUMBERS for step in steps)
    return role.domains[leaf]


def given_numbers(role: Role) -> tuple[str, ...]:
    """Where numbers that the superior gave are kept."""
    above = role.links.above
    if above is None:
        return ()
    return (f"{above.order}.inc_command", "inc_command_seen", f"{above.report}.inc_command_echo")


def canonical(role: Role, state: Mapping[str, Value]) -> dict[str, Value]:
    """The same state with the first names for its numbers, and without inputs that nobody remembers."""
    found = {**state, **role.forgotten}
    names: dict[Value, int] = {}
    for leaf in given_numbers(role):
        found[leaf] = names.setdefault(found[leaf], len(names))
    for below in role.links.below:
        sent, echo = f"{below.order}.inc_command", f"{below.report}.inc_command_echo"
        found[echo] = 0 if found[echo] == found[sent] else FAR
        found[sent] = 0
    return found


# --- the obligations ---------------------------------------------------------------------------------


def wanted(role: Role) -> frozenset[Key]:
    found: set[Key] = set()
    chosen = role.level.tables
    tables = (chosen.table,) if isinstance(chosen, OneTable) else tuple(name for _, name in chosen.tables)
    for table in (role.tables[str(name)] for name in tables):
        name = str(table.name)
        found |= {(Sort.ASSUMPTION, name, str(assumption)) for assumption in table.assumptions}
        found.add((Sort.ONE_LINE, name, ""))
        if table.default is None:
            found.add((Sort.SOME_LINE, name, ""))
        elif table.default.unreachable:
            found.add((Sort.NO_DEFAULT, name, ""))
        missed = overlooking(table) or role.asks or table.stops
        if FLAG in role.leaves and role.links.above is not None and looks(table) and missed:
            found.add((Sort.ANSWERED, name, FLAG))
    if role.links.above is not None:
        found.add((Sort.ECHOES, "", role.links.above.report))
        found |= {(Sort.ONCE, "", FLAG)} if FLAG in role.leaves else set()
        found |= {(STAYS[said], "", role.links.above.report) for said in STAYS if said in _statuses(role)}
    for below, _, fields in role.numbered:
        found.add((Sort.NEXT_NUMBER, "", below.order))
        found |= {(Sort.NUMBERED, "", leaf) for leaf in fields}
        if role.links.above is not None:
            found.add((Sort.WAITS, "", below.order))
            found |= {(Sort.PAUSES, "", below.order)} if not isinstance(chosen, OneTable) else set()
    found |= {(Sort.DEFERRED, "", leaf) for leaf, _ in role.deferred}
    found |= {(Sort.INVARIANT, "", invariant.name) for invariant in role.program.invariants}
    found |= {(Sort.PROPERTY, "", stated.name) for stated in role.program.properties}
    found |= {(Sort.OWED, "", fact.name) for fact in role.links.owes}
    return frozenset(found)


STAYS = {"done": Sort.DONE_STAYS, "failed": Sort.FAILED_STAYS}
"""What a level that writes the protocol by hand may report of an order for good."""


def _statuses(role: Role) -> tuple[str, ...]:
    """What a level that writes the protocol by hand can report; nothing of one that declares it, which states what it keeps."""
    above = role.links.above
    if above is None or role.program.roles is not None:
        return ()
    kind = role.program.variable(f"{above.report}.status_report").type
    return kind.members if isinstance(kind, Enum) else ()


def broken(
    role: Role, before: Mapping[str, Value], taken: Mapping[str, Value], ran: Ran, *, anew: bool = False
) -> Iterator[Key]:
    """The obligations that a cycle breaks; one that a fault ends publishes nothing, and breaks those of its table only.

    Args:
        role: The level.
        before: Its leaves before the cycle, the order as it was taken last.
        taken: What the cycle takes.
        ran: What it did.
        anew: Whether it is the first that takes anything since the level began anew.
    """
    if ran.fault is UNDEFINED:
        return  # nobody can say what it does
    if ran.fault not in {Fault.NO_LINE, Fault.SEVERAL_LINES}:
        yield from _taken_back(role, before, taken, ran.after, anew=anew)
    if ran.fault is Fault.ADMIT:
        yield from _broken_by_refusal(role, before, ran)
        return
    table = role.tables[ran.table]
    yield from ((Sort.ASSUMPTION, ran.table, name) for name in ran.failed)
    if ran.fault is Fault.SEVERAL_LINES:
        yield Sort.ONE_LINE, ran.table, ""
    elif ran.fault is Fault.NO_LINE:
        yield Sort.SOME_LINE, ran.table, ""
    else:
        if table.default is not None and table.default.unreachable and ran.line == table.default.name:
            yield Sort.NO_DEFAULT, ran.table, ""
        if not ran.outlasts:
            yield Sort.ANSWERED, ran.table, FLAG
        yield from _broken_above(role, before, taken, ran)
        yield from _broken_below(role, before, taken, ran.after)
        for leaf, waiting in role.deferred:
            if ran.after[leaf] not in {ran.middle[leaf], ran.after[waiting]}:
                yield Sort.DEFERRED, "", leaf
        yield from _broken_stated(role, before, ran.after)


def _taken_back(
    role: Role,
    before: Mapping[str, Value],
    taken: Mapping[str, Value],
    after: Mapping[str, Value],
    *,
    anew: bool,
) -> Iterator[Key]:
    """What was said of the order taken last, and is not said any more: begun anew, that it failed; of one to rest nothing stays."""
    above, words = role.links.above, _statuses(role)
    if above is None or not words:
        return
    order, echo = before[f"{above.order}.inc_command"], f"{above.report}.inc_command_echo"
    command = f"{above.order}.input_command"
    if before[command] == 0 or taken[command] != before[command] or after[echo] != order:
        return
    was, now = (words[int(leaves[f"{above.report}.status_report"])] for leaves in (before, after))
    was = "failed" if anew else was if before[echo] == order else ""
    if was in STAYS and was in words and now != was:
        yield STAYS[was], "", above.report


def _broken_by_refusal(role: Role, before: Mapping[str, Value], ran: Ran) -> Iterator[Key]:
    """What a cycle breaks that an input ended: nothing of the order was taken, so what was published is to be as before."""
    above = role.links.above
    if above is not None and any(ran.after[leaf] != before[leaf] for leaf in role.report):
        yield Sort.ECHOES, "", above.report
    for _, number, fields in role.numbered:
        if ran.after[number] == before[number]:
            yield from ((Sort.NUMBERED, "", f) for f in fields if ran.after[f] != before[f])
    yield from _broken_stated(role, before, ran.after)


def _broken_stated(role: Role, before: Mapping[str, Value], after: Mapping[str, Value]) -> Iterator[Key]:
    """Invariants hold before the cycle and after it; properties of both."""
    stated = role.compiled.stated
    many = len(role.program.invariants)
    for invariant, condition in zip(role.program.invariants, stated[:many], strict=True):
        if not (_true(condition, before, before) and _true(condition, after, before)):
            yield Sort.INVARIANT, "", invariant.name
    for fact, condition in zip(role.links.owes, stated[many + len(role.program.properties) :], strict=False):
        if not (_true(condition, before, before) and _true(condition, after, before)):
            yield Sort.OWED, "", fact.name
    for other, condition in zip(role.program.properties, stated[many:], strict=False):
        if not _true(condition, after, before):
            yield Sort.PROPERTY, "", other.name


def _true(condition: Stated, now: Mapping[str, Value], before: Mapping[str, Value]) -> bool:
    """Whether a condition is defined, and holds."""
    try:
        return condition(now, before)
    except (ArithmeticError, IndexError, ValueError):
        return False


def _broken_above(
    role: Role, before: Mapping[str, Value], taken: Mapping[str, Value], ran: Ran
) -> Iterator[Key]:
    if (above := role.links.above) is None:
        return
    after = ran.after
    number, command = f"{above.order}.inc_command", f"{above.order}.input_command"
    said = after[f"{above.report}.inc_command_echo"], after[f"{above.report}.ref_command_echo"]
    late = ran.fault in EARLY and all(after[leaf] == before[leaf] for leaf in role.report)
    if said != (taken[number], taken[command]) and not late:
        yield Sort.ECHOES, "", above.report
    again = taken[number] == before[number]
    if again and FLAG in before and after[FLAG] and not before[FLAG]:
        yield Sort.ONCE, "", FLAG


def _broken_below(
    role: Role, before: Mapping[str, Value], taken: Mapping[str, Value], after: Mapping[str, Value]
) -> Iterator[Key]:
    above = role.links.above
    for below, number, fields in role.numbered:
        command = f"{below.order}.input_command"
        step = (int(after[number]) - int(before[number])) % NUMBERS
        if step == 0:
            yield from ((Sort.NUMBERED, "", f) for f in fields if after[f] != before[f])
        elif step != 1:
            yield Sort.NEXT_NUMBER, "", below.order
        if above is not None:
            same = taken[f"{above.order}.inc_command"] == before[f"{above.order}.inc_command"]
            open_ = taken[f"{below.report}.inc_command_echo"] != before[number]
            if same and open_ and after[command] != before[command]:
                yield Sort.WAITS, "", below.order
            if (
                not same and taken[f"{above.order}.input_command"] == 0 != after[command]
            ):  # the first is PAUSE
                yield Sort.PAUSES, "", below.order
