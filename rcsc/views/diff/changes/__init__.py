"""One program in two versions: each change, proved or refuted.

Leaves of both versions are aligned by name and kind: an enumeration that gained a member has its values matched by
their names, and a range that grew is compared over what both have; what only one version has is a change of its own.
Then every question is one over shared leaves:

- a table: at which inputs do the versions take another line, or the same line with another effect, or none or
  several?
- what is no table (a procedure, a level's surroundings, a condition with a name, a period): is its effect the same?
- over two cycles: which line can newly follow which, and which steps did the state graph gain or lose?

A region is given as cells, so that it can be read beside the table; for `width_mm <= 40` against `< 40` it is
`width_mm = 40`, one key. The least input of a region is its witness, and the number of keys says how much of the
input space changed.

Trusted for *same meaning*: `align` (that the same leaf means the same), `symbolic`, and Z3. What it costs: one
question a line pair whose regions meet; parts whose digests agree are not asked.

Modules, in the order the data flows: `align` puts both over one set of variables, `versions` under one solver.
`tables` compares tables, `parts` what is none, `cycles` the state graph, and which line follows which; `contrast` says
where two effects differ, `value_text` gives values in the language's words. What is found is a `difference`.
"""
