"""New tables for a level that runs.

`sources` keeps what the running tables say, `reload` proves and compiles new ones, `gate` decides whether the level may take them where
it stands, `composed` says what is known of them with their neighbours; a `refusal` is why a command was not done.
"""
