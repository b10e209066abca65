"""Vectors that cover the whole C: its statements, its branches, and MC/DC of its decisions.

In: a proved program and the plan of its C. Out: vectors, each a complete state with its inputs, a function, and what it
must give by the interpreter; and what no vector reaches, with the reason. The C has the decisions of the language one
by one, so that they are counted in the language, and a compiler confirms it:

>>> from rcsc.code.testing.coverage.marks import marked
>>> from rcsc.lang.resolve import compile_text
>>> whole = marked(compile_text('''
... input ready : bool
... input parts : int 0 .. 9
... state  done : bool
... procedure count { done := ready and parts > 3 }
... table grip {
...   | line | ready   || procedures |
...   |------|---------||------------|
...   | all  | DEFAULT || count      |
... }'''))
>>> [(str(decision.place), decision.conditions) for decision in whole.decisions]
[('procedure count', ('ready', 'parts > 3'))]

Vectors are first what every program has (each input refused beyond each end of its range, each bad state) and what its
tables say; then drawn sessions, of which the cycles are kept that reach something new; then a solver is asked for the
rest, and what it shows impossible is listed as that. Last, what can be spared is dropped.

Coverage alone lets slips pass. So vectors also turn on each bit of each mask that a line's place turns on, have each variable at
each end of its range, each comparison of numbers that are equal or one apart, and each line change each state that it can
change. And at each place of the procedures something else could stand: the next constant, another variable of the type, another
comparison, nothing at all. A vector is kept for each such slip that it notices, in what the function gives or leaves behind; where
drawn cases notice none, cases beside those that meet the place are tried, with both sides of the key at which a comparison of reals
turns. What is left is listed: most of it changes nothing, and nothing is claimed of it. A vector needs nothing of the C but the
function that it calls: where that must write first, there is rubbish.

Trusted: nothing for a verdict. That nothing more can be reached rests on the symbolic run and Z3, as proofs do. What it
costs: seconds a program, up to a minute for a large one.

Modules, in the order the data flows: `marks` counts decisions, `case` is one vector and what it must give, `goals` what
vectors reach and what is open, `matters` what slips they notice, `candidates` are tried, `choose` keeps them, and says which lines
each takes; `directed` asks for the rest, `nearby` looks beside them for slips; `document` writes JSON and CSV, `harness` a C file that
plays them on its own; `vector_set` is all of it for one program.
"""
