"""What procedures owe, and its discharge: nothing overflows, divides by zero, or leaves a range.

`obligations` lists what a program owes, `discharge` puts it to Z3, `causes` gathers by cause what is not shown; `invariants` shows
that invariants hold at first and that assumptions can hold together.
"""
