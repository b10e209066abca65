"""The exact engines of a level, each held against every state that the interpreter reaches."""
