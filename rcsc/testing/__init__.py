"""The generated-code test suite behind `rcsc test`.

In: a program and the code generated from it. Out: figures and diagnostics. Nothing here is imported
by the other commands, and no solver at all.
"""
