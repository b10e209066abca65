"""A plan to C99: one header and one source file a program, which a reviewer reads beside the tables.

In: a `Plan`. Out: files by path below the generated folder. What is written is C99 with `<stdint.h>` and
`<stdbool.h>` alone: no heap, no recursion, no loop that an input can lengthen, no cast but where C needs one. Every
number that a table knows by a name has that name here.

>>> from rcsc.code.emit.c.ctext import c_type
>>> from rcsc.lang.model import Int
>>> [c_type(Int(0, 110)), c_type(Int(-1, 40_000))]
['uint8_t', 'int32_t']

Trusted: all of it, for what the C does; `rcsc test` compares it with the interpreter, and with `--deep` has it proved.

Modules: `ctext` spells expressions and statements; `layout` says how the state lies in memory, and which tables it is of.
`cprogram` holds what the others make a program of; of it are made `helpers` (one operator or conversion), `declarations` (types,
constants, the state), `admission` (inputs, results, the check), `procedures`, `matching` (the line of a table) and `cycle` (steps,
levels). `c99` lays them out in files, with `symbols`, the file that tells other programs where everything is.
"""
