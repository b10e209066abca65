"""The text of what the protocol makes: records, buffers, state, and what runs before and after the tables."""

from collections.abc import Iterator, Sequence

from rcsc.lang.protocol.roles import STANDARD, Parties, Party
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr, spell_field

BEFORE, AFTER = "take_orders", "give_orders"
"""The modules that every level of the program runs first and last."""

NUMBER = "int 0 .. 65535"
"""Command numbers have 16 bits and wrap."""


# --- records and variables ---


def records(link: tree.LinkDecl) -> Iterator[str]:
    """Yield the records of a link: its order and its report."""
    name, command, status = link.name.text, link.command.text, link.status.text
    yield f"record {name}_order {{\n  inc_command : {NUMBER}\n  input_command : {command}"
    yield from _fields(link.order)
    yield f"}}\nrecord {name}_report {{\n  inc_command_echo : {NUMBER}\n  ref_command_echo : {command}\n  status_report : {status}"
    yield from _fields(link.report)
    yield "}"


def _fields(fields: Sequence[tree.LinkField]) -> Iterator[str]:
    for part in fields:
        yield from (f"  ## {line}" for line in part.doc)
        yield f"  {spell_field(part)}"


def superior(party: Party) -> Iterator[str]:
    """Yield the buffers to and from the superior, and the state that the level keeps about its order."""
    name, link = party.name, party.link.name.text
    yield f"## Orders of {name}.\ninput {name} : {link}_order"
    yield f"## Reports to {name}.\noutput {party.told} : {link}_report"
    yield "## True until this level's own answer to a new command is echoed (sections 8.3 and 9).\nstate new_command : bool"
    yield "## A line has answered the new command.\nstate answered : bool"
    yield "## The line of this cycle lets the levels below rest first, and answers nothing.\nstate settling : bool"
    yield f"## Number of the order that was taken last.\nstate inc_command_seen : {NUMBER}"


def subordinate(party: Party) -> Iterator[str]:
    """Yield the buffers to and from a subordinate, its held report, and the order that was numbered last."""
    name, link = party.name, party.link
    yield f"record {name}_held {{\n  command : {link.command.text}\n  status : {link.status.text}\n  resting : bool"
    if party.bounded:
        what = "echoed" if party.answered is None else "answered"
        yield f"  ## The last order was not {what} in time; what is said of it from now on is no answer.\n  late : bool"
    yield from _fields(party.held)
    yield f"}}\nrecord {name}_last {{\n  input_command : {link.command.text}"
    yield from _fields([part for part in link.order if part.word != "stream"])
    yield f"}}\n## Reports of {name}, as they come.\ninput {party.raw} : {link.name.text}_report"
    yield f"## Orders to {name}.\noutput {party.told} : {link.name.text}_order"
    yield f"## What {name} says of the last orders, held until they are echoed.\nstate {name} : {name}_held"
    yield f"## The order to {name} that was numbered last.\nstate {party.last} : {name}_last"
    if party.again:
        yield f"## The same order is given to {name} once more.\nstate {party.once_more} : bool"
    cycles = party.answered or party.within
    if cycles is not None:
        what = "echoed" if party.answered is None else "answered"
        yield f"## Cycles for which {name} has not {what} the last order.\nstate {name}_waited : int 0 .. {spell_expr(cycles)}"


ECHOED = "## Every last order is echoed, or too late.\nstate echoed : bool"


def all_echoed(parties: Parties) -> str:
    """Return the condition, as a cycle begins, that every last order is echoed, or becomes late in this cycle."""
    return " and ".join(map(_echoed_at_first, parties.subordinates)) or "true"


def _echoed_at_first(party: Party) -> str:
    echoed = _echoes(party)
    if not party.bounded:
        return echoed
    waited = f"{party.name}_waited"
    if party.answered is None:
        return f"({echoed} or {waited} = {_cycles(party)})"
    return f"({echoed} or {waited} >= {_cycles(party)})"


def _echoes(party: Party) -> str:
    return f"{party.raw}.inc_command_echo = {party.told}.inc_command"


def _cycles(party: Party) -> str:
    """Return the number of cycles after which an order without an echo is late."""
    cycles = party.within or party.answered
    assert cycles is not None
    return spell_expr(cycles)


# --- procedures ---


def settle(parties: Parties) -> Iterator[str]:
    """Yield the procedure by which a new command first lets the levels below rest."""
    yield "## A new command finds a level below at work: let it rest first.\nprocedure settle {"
    if parties.superior is not None:
        yield "  settling := true"
    yield from (f"  {party.told}.input_command := {party.link.rest.text}" for party in parties.subordinates)
    yield "}"


def status_is(party: Party, member: str) -> str:
    """Return the procedure that reports a status."""
    return f"procedure {member} {{\n  {party.told}.status_report := {member}\n}}"


def order_is(party: Party, member: str) -> str:
    """Return the procedure that orders a command."""
    return f"procedure {member} {{\n  {party.told}.input_command := {member}\n}}"


# --- what runs before the tables ---


def taken(parties: Parties) -> Iterator[str]:
    """Yield the module that runs before everything else of a level."""
    above, below = parties.superior, parties.subordinates
    reads = [part for party in below for part in (party.raw, party.told, party.name)]
    writes = [party.name for party in below] + (["echoed"] if below else [])
    timed = [f"{party.name}_waited" for party in below if party.bounded]
    if above is not None:
        own = ["inc_command_seen", "new_command", "answered"]
        reads += [above.name, *own]
        writes += [*own, "settling", f"{above.told}.status_report"]
        writes += [f"{above.told}.{above.reason}"] if above.reason is not None else []
    reads += ["echoed"] if below else []
    yield from (f"## {line}" for line in _told_taken(parties))
    yield f"module {BEFORE} reads {', '.join([*reads, *timed])} writes {', '.join([*writes, *timed])} {{"
    for party in below:
        yield from _too_late(party)
    if below:
        yield f"  echoed := {' and '.join(map(_echoed, below))}"
    if above is not None:
        yield from _order_taken(above, "echoed" if below else "true")
    if below:
        yield "  if echoed {"
        for party in below:
            yield from _held(party)
        yield "  }"
        yield from (_resting(party, above is not None) for party in below)
    yield "}"


def _told_taken(parties: Parties) -> Iterator[str]:
    """Yield the doc lines of the module that runs before everything else."""
    yield "Made of the declared roles (manual, Protocol)."
    if parties.superior is not None:
        yield "An order is new if its number differs from the last, until it is answered and the answer's own orders are echoed."
    if parties.subordinates:
        yield "A report counts once it echoes the number of the last order. A subordinate rests where it has reported *done* to"
        yield "the order to rest, and the new order is answered or every order echoed."


def _too_late(party: Party) -> Iterator[str]:
    if not party.bounded:
        return
    if party.answered is not None:
        yield from _answered_too_late(party, spell_expr(party.answered))
        return
    name, cycles = party.name, _cycles(party)
    yield f"  if {_echoes(party)} and (not {name}.late or {_rests(party)}) {{"
    yield f"    {name}_waited := 0\n    {name}.late := false"
    yield f"  }} else if {name}_waited < {cycles} {{\n    {name}_waited := {name}_waited + 1"
    yield f"  }} else {{\n    {name}.late := true\n  }}"


def _answered_too_late(party: Party, most: str) -> Iterator[str]:
    """Count the cycles for which an order is not answered; an order to rest is answered by *done* alone, even when it is late.

    They are counted in all, so that an order is answered for good or late for good, whatever the subordinate reports.
    """
    name, link = party.name, party.link
    status = f"{party.raw}.status_report"
    answers = f"({status} = {link.done.text} or {status} = {link.failed.text} and not {_rests(party)})"
    waits = f"{name}_waited < {most}"
    if party.within is not None:
        waits = f"{name}_waited < {_cycles(party)} or {_echoes(party)} and {waits}"
    yield f"  if not {name}.late or {_rests(party)} {{\n    if {_echoes(party)} and {answers} {{"
    yield f"      if {_rests(party)} {{\n        {name}_waited := 0\n        {name}.late := false\n      }}"
    yield f"    }} else if {waits} {{"
    yield f"      {name}_waited := {name}_waited + 1\n      {name}.late := false"
    yield f"    }} else {{\n      {name}.late := true\n    }}\n  }}"


def _rests(party: Party) -> str:
    return f"{party.told}.input_command = {party.link.rest.text}"


def _echoed(party: Party) -> str:
    return f"({_echoes(party)} or {party.name}.late)" if party.bounded else _echoes(party)


def _order_taken(above: Party, echoed: str) -> Iterator[str]:
    yield f"  if {above.name}.inc_command /= inc_command_seen {{"
    yield f"    inc_command_seen := {above.name}.inc_command"
    yield "    new_command := true\n    answered := false"
    yield f"    {above.told}.status_report := {above.link.executing.text}"
    if above.reason is not None:
        yield f"    {above.told}.{above.reason} := {above.none}"
    yield f"  }} else if answered and {echoed} {{\n    new_command := false\n  }}\n  settling := false"


def _held(party: Party) -> Iterator[str]:
    name, raw = party.name, party.raw
    plain = [f"{name}.command := {raw}.ref_command_echo", f"{name}.status := {raw}.status_report"]
    plain += [f"{name}.{part.name.text} := {raw}.{part.name.text}" for part in party.held]
    if not party.bounded:
        yield from (f"    {line}" for line in plain)
        return
    yield f"    if {name}.late {{"
    yield f"      {name}.command := {party.told}.input_command\n      {name}.status := {party.link.failed.text}"
    yield from (f"      {line}" for line in _why_late(party))
    yield "    } else {"
    yield from (f"      {line}" for line in plain)
    yield "    }"


def _why_late(party: Party) -> Iterator[str]:
    """Yield the assignments of the reason why an order is late: it was not answered, or not even echoed."""
    silent, slow = (
        None if reason is None else f"{party.name}.{party.reason} := {reason}"
        for reason in (party.late, party.unanswered)
    )
    if party.answered is None or party.within is None:
        yield from filter(None, (silent, slow))
        return
    if slow is not None:
        yield f"if {party.name}_waited = {spell_expr(party.answered)} {{\n  {slow}\n}}"
    if silent is not None:
        yield f"if {party.name}_waited < {spell_expr(party.answered)} {{\n  {silent}\n}}"


def _resting(party: Party, served: bool) -> str:  # whether there is a superior
    at_rest = (
        f"{party.name}.command = {party.link.rest.text} and {party.name}.status = {party.link.done.text}"
    )
    return f"  {party.name}.resting := {at_rest} and {'(answered or echoed)' if served else 'echoed'}"


# --- what runs after the tables ---


def given(parties: Parties) -> Iterator[str]:
    """Yield the module that runs after everything else of a level."""
    above, below = parties.superior, parties.subordinates
    reads = [part for party in below for part in (party.told, party.last)]
    writes = [part for party in below for part in (party.last, f"{party.told}.inc_command")]
    for party in below:
        writes += [f"{party.name}_waited", f"{party.name}.late"] if party.bounded else []
        reads += [party.once_more] if party.again else []
        writes += [party.once_more] if party.again else []
    reads += ["echoed"] if any(party.again for party in below) else []
    if above is not None:
        reads += ["new_command", "settling", "inc_command_seen", f"{above.name}.input_command"]
        writes += ["answered", f"{above.told}.inc_command_echo", f"{above.told}.ref_command_echo"]
    yield "## Made of the declared roles (manual, Protocol)."
    if above is not None:
        yield "## A new order is answered by the first cycle that is not settling; its number and name are echoed."
    if below:
        yield "## An order gets a new number where its command or a field differs from the last; fields of a stream do not count."
    yield f"module {AFTER} reads {', '.join(reads)} writes {', '.join(writes)} {{"
    if above is not None:
        yield "  if new_command and not settling {\n    answered := true\n  }"
        yield f"  {above.told}.inc_command_echo := inc_command_seen"
        yield f"  {above.told}.ref_command_echo := {above.name}.input_command"
    for party in below:
        yield from _numbered(party)
    yield "}"


def _numbered(party: Party) -> Iterator[str]:
    told, last = party.told, party.last
    differs = " or ".join(f"{told}.{part} /= {last}.{part}" for part in party.numbered)
    yield f"  if {differs}{f' or {party.once_more} and echoed' if party.again else ''} {{"
    yield f"    {told}.inc_command := ({told}.inc_command + 1) mod 65536"
    if party.bounded:
        yield f"    {party.name}_waited := 0\n    {party.name}.late := false"
    yield "  }"
    if party.again:
        yield f"  {party.once_more} := false"
    yield f"  {last}.input_command := {told}.input_command"
    yield from (
        f"  {last}.{part.name.text} := {told}.{part.name.text}"
        for part in party.link.order
        if part.word != "stream"
    )


# --- standard properties ---


def properties(parties: Parties, own: set[str]) -> Iterator[str]:
    """Yield the properties of the protocol, except those switched off or declared by the program under the same name."""
    for party in parties.subordinates:
        if party.answered is not None and (name := f"{party.name}_late_stays") not in own:
            failed = f"{party.name}.late and {party.name}.status = {party.link.failed.text}"
            number = f"{party.told}.inc_command"
            yield f"## What comes late of {party.name} is no answer: the order has failed."
            yield f"property {name} : {failed} and not {_rests(party)} then {failed} or {number} /= was {number}"
    above = parties.superior
    if above is None:
        return
    told, rest = above.told, above.link.rest.text
    said = {
        member: f"{told}.status_report = {member} and {above.name}.input_command /= {rest} until new_command"
        for member in (above.link.done.text, above.link.failed.text)
    }
    texts = {"done_stays": said[above.link.done.text], "failed_stays": said[above.link.failed.text]}
    if above.reason is not None:
        done = f"{told}.status_report = {above.link.done.text} and {above.name}.input_command /= {rest}"
        texts["done_without_reason"] = f"{done} implies {told}.{above.reason} = {above.none}"
    if parties.subordinates:
        resting = " and ".join(f"{p.told}.input_command = {p.link.rest.text}" for p in parties.subordinates)
        texts["rests_when_told"] = f"{above.name}.input_command = {rest} implies {resting}"
    for name in STANDARD:
        if name in texts and name not in own and name not in above.without:
            yield f"## {_SAID[name]}\nproperty {name} : {texts[name]}"


_SAID = {
    "done_stays": "Done stays done until the next command.",
    "failed_stays": "Failed stays failed until the next command.",
    "done_without_reason": "What is done has not failed.",
    "rests_when_told": "While this level is to rest, so are those below it.",
}
