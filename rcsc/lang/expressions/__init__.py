"""Expressions of the tree to typed expressions of the model.

Every typed expression has a type with bounds. Bounds of integers are computed from those of the operands, so that a
proof knows where a sum lies before it asks a solver, and a constant is folded by the same rule that the interpreter
follows:

>>> from rcsc.lang.resolve import compile_text
>>> program = compile_text('''
... const half = 7 / 2
... input n : int 0 .. 10
... state sum : int 0 .. 40 = half * 2
... procedure add { sum := n * 3 + half }''')
>>> [variable.initial for variable in program.variables if variable.name == "sum"]
[6]
>>> program.procedures[0].body[0].value.type
Int(low=3, high=33, unit=())

A number past 64 bits, a unit that does not fit, two numbers of the text that are one double: each is a diagnostic
with its place. Trusted: all of it, for what an expression means and for its bounds; tests hold the bounds against
brute force on pairs of edge values. Everything takes one pass over the expression.

Modules, in the order the data flows: `scope` has the names of a program and collects what is wrong with their use;
`literals` reads numbers, `types` type expressions; `typed` finds the names in an expression and types it, by
`operators`, which bound results by `intervals` and know of `units` what one comes to in another, and by `words`, which
make what is said of bits arithmetic, and by `previous`, which makes a state of each leaf that something looks back at;
`conditions` makes a table's cells tests, `placing` gives what stands in a cell its place in the file.
"""
