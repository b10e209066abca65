"""Expressions of the tree to typed expressions of the model.

`scope` has the names of a program and collects what is wrong with their use. `literals` reads numbers, `types` type expressions;
`typed` finds the names in an expression and types it, by `operators`, which bound results by `intervals` and compute constants by
`folding`. `conditions` makes a table's cells tests, `placing` gives what stands in a cell its place in the file.
"""
