"""Proves the levels together: for any delay, any sequence of commands, any answer of the database.

What is proved of each level, alone in its environment (`proof.level`):

- every assumption of its tables holds in every cycle in which the table runs; exactly one line matches; no DEFAULT declared unreachable
  is reached; no state is written directly while another is pending. Of several tables in a cycle each owes this where it stands;
- a command number is taken up once, and no other command replaces an order before its echo, but for a new command;
- no new command is passed over by a line that does not look for one; a PAUSE is passed on in the cycle that takes it;
- its program's invariants, its properties over a cycle and the one before (`properties`), its requirements over time;
- its guarantees for neighbours: its report echoes number and command of the order that it took in that very cycle (so no order is lost,
  and none is echoed that was not run); its orders change only together with their numbers, and numbers come one after the other;
- of a level by hand, that *done* and *failed* stay (others state it as properties): no proof of a neighbour takes it for granted.

Context: lines that are never reached or match again (`proof.context`), states that nothing leaves (`proof.stuck`). Termination: commands
are answered if subordinates answer theirs (`proof.termination`, `proof.ranking`); what has to come eventually comes (`proof.eventually`).

What a level assumes of its environment is the contract (`transition`):

- of the superior: an order that it takes under the number that it took last is the same order, as far as the superior numbers it. Nothing
  else: any command may come at any moment, whether or not the last one was echoed, done, or seen;
- of a subordinate, whose report it may see late, twice or never: (1) what is reported under the number of the last order is about the
  command of that order; (2) the number after the last one is not echoed; (3) once the last order is echoed, it stays so until another is
  given. Nothing about the status, about how long anything takes, or about reports on older orders; - of any level of which it says so in a
  declared assumption about one buffer, or of which it is found: that what is published there is so (`contract.facts`, `together.plain`);
- of the database: the same question has the same answer; of what comes from outside, what is assumed over time (`contract.watched`);
- of everything else: its declared range. What no level writes may also come as a value that is *refused*: that cycle takes nothing
  (`rcsc.lang.protocol.environment`), as often as the environment likes. Claims are proved of such an environment first. Only what is not
  proved there is proved once more as if nothing were refused, and then says so, whatever its kind (`proof.level`).

Why the contract may be assumed. Let a superior U publish orders, a subordinate D take them and publish reports, through buffers that hold
the latest value, whole (`run.buffers`; processes copy under a sequence lock, `run.processes.memory`). What D takes was published by U,
never older than what it took before; likewise back. Suppose that up to some cycle every level has kept its guarantees. U's orders are then
numbered one after the other: two orders under one number are the same, or 65536 numbers apart. D's report echoes the order that it took:
so what is reported under number *n* is about order *n* (1); no number is echoed that was not sent (2); as D takes no older order, it keeps
echoing the last one (3); and an order taken twice under one number is one order. A cycle that is refused changes neither orders nor
reports: for its neighbours the level is late by a cycle, and what it takes next is compared with what it took last. So the contract holds
up to the next cycle, in which, by the proofs of the levels, every guarantee is kept again; at first it holds because both begin with the
same order (checked, `system`). This is induction over cycles of all levels at once: a guarantee in a cycle rests on contracts about what
was published before it. So levels are proved one by one, and the cost grows with their number. What the contract leaves open of a level is
asked of it together with those that write to it, as they are scheduled, by the same induction (`together.left_open`).

Further assumptions:

- *Numbers* are of 16 bits and wrap; the proof treats them so. "65536 numbers apart" is excluded by *freshness*: no level is so late that
  all numbers go round, which takes at least 65536 cycles, 43 minutes at 40 ms. One that waits for echoes comes nowhere near it (`WAITS`).
- *Restarts.* A level may begin anew at any moment as `run.adopt` does: its order is PAUSE under the number after the order in its buffer,
  or after the echo if the buffer is empty, what it takes counts as seen, and its report echoes what it echoed, so that no echo goes back
  even if its first cycles are refused; what is adopted otherwise is refuted (`NEXT_NUMBER`, `ECHOES`). Its buffers hold what neighbours
  owe, or what it begins with, owed too. To its neighbours it is an order that is superseded, or a report that failed. If the buffer is
  empty, freshness requires more: no earlier order of it that is not echoed yet may be on its way, because its number is used again.
- *Reals* and arithmetic are followed as far as `symbolic.keyed` does, and `symbolic.measured` for termination; the rest may be anything.
- *Termination* assumes more than the contract: an order that is not replaced is eventually answered, and stays so. That is shown in turn
  of every subordinate that is a level. No level's inputs are refused for ever; after the last refusal all is as if there had been none,
  from a state within the invariant. If it is printed, the values in an input stay the same meanwhile, too.
- *Eventually* assumes the same of refusals and answers, and nothing else: no input comes by itself, and a restart ends what is waited
  for. It is shown as a bound on the cycles in a row in which its monitor waits, those not counted that are refused (`proof.eventually`).
- *Neighbours outside the levels* (workstation, robot, hand, camera) keep to the same contract by their own means, which are only listed.

Rooms, in the order the data flows: `contract` (a level, its environment, and what it owes in one cycle), `invariant` (PDR, whose clauses
Z3 confirms), `exact` (engines for what that leaves open), `proof` (of a level, and of the system), `counterexample` (runs that break what
is not proved), `coverage` (what requirements speak of), `together` (requirements across levels). Trusted are `contract.transition` and
`together.product`, `symbolic.keyed` and `symbolic.measured` (a cycle as terms), the arguments here and in `proof.termination`, Z3.
"""
