r"""Text to tree, and back.

A *tree* says what was written, with a span for each node and nothing resolved. Laying a tree out and reading it again
gives the same tree:

>>> from rcsc.base.diagnostics.source import Source
>>> from rcsc.lang.syntax.format import format_file
>>> from rcsc.lang.syntax.parse import parse
>>> tree = parse(Source("a.rcs", "const   most = 3\n\n\nconst least =  1 \n"))
>>> text = format_file(tree)
>>> print(text.strip())
const most = 3
const least = 1
>>> parse(Source("a.rcs", text)) == tree
True

A text that is wrong is diagnostics, never an exception, and reading goes on after the declaration that is wrong:

>>> [diagnostic.code.value for diagnostic in parse(Source("a.rcs", "const = 3\nconst = 4\n"))]
['RCS101', 'RCS101']

Trusted: the grammar and `build`, for what a text says. Lark parses; what it makes of the grammar is kept (`saved`), and held by tests to
what it makes anew. Reading takes time linear in the text.

Modules, in the order the data flows: `screen` refuses what is no text of the language, `rows` cuts tables into parts, lines and cells,
`parse` reads (with Lark, `saved`) and says by `expected` what it expected, `build` makes the `tree`, `comments` puts
comments to their nodes; `turned` makes lines of tables that are printed the other way round; `format` lays a tree out
again, `layout` its tables, `spell` its expressions.
"""
