"""The commands about systems of levels: each takes a description, or what a run of a system left.

Each module of a command has it under the name `command`. Without a description `system.toml` is meant, here or in
`tables/`:

>>> from rcsc.front.commands.systems.prove import command
>>> command.params[0].name
'system'

Nothing here is trusted for a verdict. What it costs: what moves a model imports MuJoCo, and what reads or writes logs
their package; each says which extra brings it.

Modules: `prove` says again what is known of the levels together, else `proving` proves them, `explained` says what it
does not prove, `covering` what requirements speak of and `across` how those across levels stand; `run` runs a system
with its plant, `campaign` many episodes of it, `shell` puts a system under somebody's hands; `log` says what a
recorded run did and `replay` runs it again; `db` is about the cell's database.
"""
