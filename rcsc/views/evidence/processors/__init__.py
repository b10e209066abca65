r"""What code needs on small processors: counted on an emulator, and bounded from the assembly.

In: C, and C that calls it; the text of a cross compiler. Out: the instructions and the stack of each call, exactly; the
instructions of a function's longest path, or why there is no bound.

>>> from rcsc.views.evidence.processors.assembly import Bounds, of_compiler, of_disassembly
>>> text = "\t.type\tf, %function\nf:\n\tcbz\tr0, .L1\n\tmovs\tr0, #1\n.L1:\n\tbx\tlr\n"
>>> Bounds(of_compiler(text), of_disassembly("", ""), {}).of("f")
3

A count is of instructions, never a time: an emulator knows no pipeline, no wait states and no caches.

Trusted: the cross compilers, QEMU's counting, and for a bound the comment at each loop of the C. What it costs: seconds.

Modules: `assembly` (paths). The processors and their emulators are those of `rcsc.code.testing.boards`.
"""
