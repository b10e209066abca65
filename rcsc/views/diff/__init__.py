"""What changed between two versions of the tables: where, in table words, and the proof that nothing else did.

Two versions are put over one set of variables, and each table, procedure and condition is asked for an input at which
the versions do something else. An answer is a *change*, with its region in the words of the table; no answer is a
proof that this part does the same, in whatever words it is written. So a line that was split in two or a condition
that was turned round is *same meaning*:

    rcsc diff tables/task                        the working tree against the last commit
    rcsc diff --rev main --follow tables/task    and which lines can newly follow which

Trusted: `symbolic` and Z3, as for a proof; what a solver did not decide is listed as such and is never *same*. What
it costs: about the proof of both versions; parts that are equal as text cost nothing.

Modules, in the order the data flows: `sides` finds what is to be compared (`revision` lays out an old one), `compare`
gives the difference, which `changes` computes; `rows` and `jsonform` show it, `present` says what of it a level meets
that runs.
"""
