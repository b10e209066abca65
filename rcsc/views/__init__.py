"""What is proved, shown to people: differences, state graphs, pages, and what a safety case asks for.

In: programs, their proofs, code and runs. Out: text, SVG, pages and files. Nothing here decides a verdict.

>>> from rcsc.views.graph.formats import mermaid
>>> from rcsc.views.graph.formats.state_graph import Edge, StateGraph
>>> graph = StateGraph("grip", "now", (Edge("start", "idle", "closing", guard="order(close)"),))
>>> mermaid.read(mermaid.write(graph)).edges[0].target
'closing'

Trusted: `diff`, where `reload` lets a changed table run because the difference is proved to be none that matters.

Rooms, in the order in which they may use each other: `pages` frames a page of one file; `diff` says what changed in meaning; `graph`
makes graphs of tables and tables of graphs; `evidence` collects what is asked of the C, and `trace` leads from requirements to lines,
code, tests and proofs, and back.
"""
