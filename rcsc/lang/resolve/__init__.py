"""Syntax tree to model: every name found, every expression typed, every cell a test.

In: the files of one root. Out: a `Program`, or every diagnostic of its names, kinds, units and ranges. Records and
arrays become leaves, each output has one writer, and procedures cannot call themselves:

>>> from rcsc.lang.resolve import compile_text
>>> program = compile_text('''
... record order { number : int 0 .. 9  stop : bool }
... output to_hand : order''')
>>> [variable.name for variable in program.variables]
['to_hand.number', 'to_hand.stop']
>>> [diagnostic.code.value for diagnostic in compile_text("output a : nowhere")]
['RCS201']

Trusted: all of it, for what a program is; nothing later looks at the text again. Cost: linear in the files, and an
array's elements count.

Modules, in the order the data flows: `program` takes the files of a root through the others: `declarations` (units,
enumerations, constants, variables), `statements`, `procedures` and owners, `tables` (with `precedence`, where lines go before others),
`levels` (with the order of their tables), `properties` (and requirements over time), `roles`; it has assumptions and invariants itself.
`instance`: one of several programs of a root, with other constants. `across`: a file of requirements across levels.
"""

from rcsc.lang.resolve.instance import noted
from rcsc.lang.resolve.program import closure, compile_text, resolve

__all__ = ["closure", "compile_text", "noted", "resolve"]
