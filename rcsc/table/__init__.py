"""One table: exactly one line matches every input, or a least input at which that fails.

`decide` chooses: `boxes` decides tables whose tests look at one leaf each, by masks and counting; `relational` the others, by trees of
`regions`. `confirm` asks Z3 the same. The `verdict` is data, with a `certificate` that `rcsc.certify` checks anew; `cover` says where a
condition holds; `spell` gives sets of keys as cells, `repair` proves what would mend a table, `diagnose` makes diagnostics. `program`
proves a whole program: its tables, and what its procedures owe.
"""
