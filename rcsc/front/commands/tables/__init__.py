"""The commands about tables: each takes files or folders, and needs no system of levels.

Each module has its click command under the name `command`: options, one call of the driver or of a stage, the report.

>>> from rcsc.front.commands.tables.fmt import command
>>> sorted(name for param in command.params for name in param.opts if name in {"--check", "--diff"})
['--check', '--diff']

Nothing here is trusted for a verdict. What it costs: the stages that a command calls; an unchanged project is checked
without its parser.

Modules: `check` proves every table, `compile` writes the executors of proved ones, `test` runs these against the
tables, `certify` has a proof checked again, `fmt` lays files out, `diff` compares two versions, `graph` draws a
table's state graph and `table` makes a table of one.
"""
