"""Forms of a state graph that are written and read back.

A `state_graph` has states and edges with guards and effects, in no form. Writing and reading are inverse, but for
what the form cannot say; the header, as a comment or an attribute, keeps what the drawing has no room for (the
table's name, its columns, the order of its lines).

>>> from rcsc.views.graph.formats import dot, mermaid, scxml
>>> from rcsc.views.graph.formats.state_graph import Edge, StateGraph
>>> graph = StateGraph("grip", "now", (Edge("1", "idle", "closing", "order(close)", "hand(close)"),), states=("idle", "closing"))
>>> [form.read(form.write(graph)).edges[0].guard for form in (dot, mermaid, scxml)]
['order(close)', 'order(close)', 'order(close)']

Files may come from anybody: what cannot be read is a diagnostic with its place, never an exception. Nothing here is
trusted: what is read back is proved to be the table by `round_trip`. Everything is linear in the text.

Modules: `state_graph`; `dot`, `mermaid` and `scxml` write and read one form each, `reading` has what reading shares,
`choice` finds the form by its name or by the text.
"""
