"""The interactive shell: run any module, procedure, owner, table or level by name, and look at and set any variable.

In: lines that people type, or a script. Out: what to show; a refusal, with a code, where it is not done. Names are
typed as the paper prints them or as the tables have them: `REMOVE-FROM-BUFFER-DB` is `remove_from_buffer_db`, and an
unknown name is answered with what is near it.

    $ rcsc shell --alone system.toml
    > order = close
    > gripper                 one cycle of that level alone
    > report ?
    > run until gripper.cur_state = holding
    > undo                    the whole system as it was before the last cycle
    > reload gripper          the tables as they are now, if they prove and fit the present state

>>> from rcsc.desk.shell.commands import HELP
>>> [line.split()[0] for line in HELP.splitlines() if line.startswith(("break ", "undo", "expect"))]
['break', 'undo', 'expect']

`undo` copies the state of every level before each cycle, so it is exact, and keeps the last ones only. Trusted:
nothing for a verdict; `reload` takes a table only if it proves, the present state lies in what was proved, and the
next cycle does what it did before, or `anyway` is given.

Source: Haynes et al. 1984, sections 2 and 10. Modules, in the order the data flows: `opening` puts a system together,
`commands` makes calls of lines, `typed_names` reads names; a `session` does them on a running system, with `part_runs`
(a procedure, a table, a step by itself), `stops` (conditions, breakpoints), `history` (undo) and `reload` (new tables).
"""
