"""The commands about systems of levels: each takes a description, or what a run of a system left.

Each module has its click command under the name `command`. Without a description `system.toml` is meant, here or in
`tables/`:

>>> from rcsc.commands.systems.prove import command
>>> command.params[0].name
'system'

Nothing here is trusted for a verdict. What it costs: the cell's commands import MuJoCo, and those about logs the
package that reads them; each says which extra brings it.

Modules: `prove` proves the levels together, and `explained` says what it does not prove; `run` runs a script in the
cell, `campaign` many episodes of it, `shell` puts a system under somebody's hands; `log` says what a recorded run did
and `replay` runs it again; `db` is about the cell's database.
"""
