"""What was proved of a system, watched while it runs.

In: `Claims`, which `rcsc campaign` takes from the proof of the levels together. Out: a property that holds as long as each claim does.
A claim is about every run that its trusts allow: so each cycle of an episode, with everything that goes wrong in it, is a test of the
proof. Nothing of the proof is used here: conditions are written anew, on the values of generated executors.

Example. Of a level it was proved that *line `late` of table `go` is never reached*, trusting that no input of the level is refused. In
every cycle it is asked whether `late` ran. Once an input of that level was refused, the claim says nothing any more; before that, a
cycle in which `late` runs breaks it, and is a finding `LEVEL: proved: ...` like any other: it is made small and kept.

A claim says nothing of a run in which something was broken that it takes for granted; nor does a level that was given older values
again. What no episode can look at is told, with why. It costs some 0.2 ms a cycle and level.

Modules, in the order the data flows: `claims` (values), `cycles` (what a claim sees), `checks` (a cycle), `watch` (with what is
taken for granted, and commands that go round).
"""
