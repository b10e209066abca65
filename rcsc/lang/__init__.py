"""The language: what a program is, and what it means.

A *program* is typed, flattened, and has every name found (`model`); `interpret` is its one meaning, which the provers and both executors
are held against. Modules, in the order the data flows: `operator_table` (every operator: its word, how tightly it binds, its meaning),
`syntax` (text to tree), `project` (which files belong together), `expressions` and `resolve` (tree to model); of a model: `leaves` (what
is read and written), `interval_sets` (sets of keys), `meaning` and `digest` (names and digests of what a proof depends on), `questions`
(a region's question as conditions), `reserved` (words of C and Python).
"""
