"""What the machine gives: files, processes, tools, a cache.

Nothing here knows the language. Four promises: a file is written whole or not at all; what is read from outside is
bounded in size and nesting before it is parsed; a process that rcsc began does not outlive it; and what an earlier
run kept is believed only under the user's own secret.

>>> from rcsc.base.host.files.names import BadName, identifier
>>> identifier("to_hand")
'to_hand'
>>> try:
...     identifier("../etc")
... except BadName as error:
...     print(error)
`../etc` is no name: letters, digits and `_`, no digit first

Trusted: `cache`, for verdicts that it gives back. An entry is named by a digest of all that it depends on, the tool's
own files by their content included, and sealed with a key that only this user can read; anything in doubt is proved
again.

Modules: `files` reads within bounds and writes whole files, `described` reads TOML descriptions and names every fault
with its line; `children` begins every process, `keeper` clears away what a killed one left; `tools` finds programs
outside Python; `cache` keeps what earlier runs proved; `memory` suspends the collection of garbage; `guard` says who may see a page
that is served to this machine, `trust` whether the code of a folder may run.
"""
