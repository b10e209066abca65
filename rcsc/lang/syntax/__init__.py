"""Text to tree and back.

`screen` refuses what is no text of the language, `rows` cuts tables into cells, `parse` reads with Lark and says by `expected` what it
expected, `build` makes the `tree`, `comments` puts comments to their nodes; `format` lays a tree out again, `spell` its expressions.
"""
