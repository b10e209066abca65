r"""Programs and systems for tests, each made in one place.

A test that needs a program writes its text, or names one of `examples`, and takes it as far as it needs:

>>> from tests.support.programs.stages import emitted, program_of, verdict_of
>>> text = "input a : int 0 .. 9\ntable t {\n| line | a ||\n| low | < 5 ||\n| high | >= 5 ||\n}\n"
>>> program_of(text).tables[0].lines[1].name
'high'
>>> verdict_of(text).findings
()
>>> sorted(emitted(program_of(text)))
['c/case.json', 'c/case_.c', 'c/case_.cmake', 'c/case_.h', 'c/case_.pc', 'python/case_.py']

`stages`: the program of a text or of a file, what is reported of it, its verdict, its generated files.
`examples`: programs that several rooms use.
`texts`: parts of a text (a table, a level, the description of a system), and edits that are sure to be made.
`systems`: a system of two levels, with other texts in some of its files, and one of a single level.
`turned`: a drawn table that is printed the other way round, and the same in ordinary lines.
`arbitrary`: any program at all, as trees.
"""
