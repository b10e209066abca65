"""Counterexamples: runs, done by the interpreter and both executors, that break an obligation.

Definitions. A *trace* is a run of one level, from its beginning, whose last cycle breaks an obligation. A *lasso* is a run that ends as it
was some cycles before, so that it may go on for ever: no command ends there, or a requirement waits. A *pair* is a run of two levels with
the buffers between them. A *finding* is any of these, ready to be shown; its *consequences* are runs that begin as badly and go on until
the superior is told something; a *frozen case* is a finding in JSON that is run again on later tables.

Example. For "no two lines match" of a table, cycles are unrolled one after the other from the initial values, and a SAT solver is asked
whether the last can break it. In the third it can. The inputs of the model are replaced by the simplest that will do, one by one; the
interpreter runs them; only if two lines match there, too, is it a trace. Then the Python and the C executors run it, and have to leave the
same in every cycle.

Trusted: only the interpreter. A run that it does not reproduce is reported as a fault of rcsc, and never shown.

Cost: a SAT question for each obligation and cycle (at most `--trace` cycles), more for the simplest inputs, and a build of the executors
for each level that has a finding.

Modules, in the order the data flows: `simplest` (bounded runs, simplest models), `cycle_run` (one cycle by the interpreter, and what it
breaks), `trace`, `lasso`, `pair`, `finding` (time lines), `consequence`, `rerun` (executors, log), `frozen`, `applied` (a repair, proved
of the text that it makes), `repair` (of the table, tried in runs of that text), `explain` (all that is open).
"""
