"""Relations between lines: which follows which, and whether two tables do the same.

`steps` gives which line leads from which state to which, `follow` which line can match in the cycle after which, `same` whether two
tables over the same declarations do the same for every input.
"""
