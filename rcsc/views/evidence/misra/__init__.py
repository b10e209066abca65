"""Compliance with MISRA C:2012, guideline by guideline, of the generated C.

In: emitted files. Out: a table with every guideline, its category, whether the C complies, how that was checked, and for what it
does not keep each place with the reason. After MISRA Compliance:2020: a mandatory guideline allows no deviation, and what nobody
checks is said so. Numbers and categories stand here, none of MISRA's text.

A reason holds at a place and not for a whole rule: it says what the line there must look like. So a new finding of a rule that has
deviations elsewhere is a violation until somebody explains it.

>>> from rcsc.views.evidence.misra.guidelines import guidelines
>>> next(one.category.value for one in guidelines() if one.number == "17.3")
'mandatory'

Trusted: cppcheck and its add-on, whose own list says which rules they look at. What it costs: some ten seconds a program.

Modules: `guidelines` (numbers, categories, what the checked rules are about), `cppcheck` (the checker),
`compliance` (places and reasons, and the table).
"""
