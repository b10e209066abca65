"""What changed between two versions of the tables: where, in table words, and the proof that nothing else did.

`sides` finds what is to be compared (`revision` lays out an old one), `compare` gives the difference, which `changes` computes; `text` and
`jsonform` show it, `present` says what of it meets a level that runs.
"""
