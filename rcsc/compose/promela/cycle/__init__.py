"""A level's cycle as one list of statements, translated by code of its own.

`statements` flattens: calls inlined, loops unrolled, elements named. `environment` adds what stands around the level, `aims`, `checks`,
`again` and `stated` what is to hold, `flows` says which names hold the same data; `level_cycle` puts a cycle together.
"""
