"""What the machine gives: files, processes, tools, a cache.

Nothing here knows the language. `files` reads within bounds and writes whole files, `described` reads TOML descriptions; `children` begins
every process, `keeper` clears away what a killed one left; `tools` finds programs outside Python; `cache` keeps what earlier runs proved.
"""
