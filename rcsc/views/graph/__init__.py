"""State graphs, both ways: tables to graphs in SVG, DOT, Mermaid and SCXML, and such graphs to tables.

Nodes are the values of the table's state variable, edges are its lines: from each value at which a line can match, to
each value that it can leave. The state variable is `cur_state`, or the only enumeration that the table tests;
`--state` names another. An edge has the line's other cells as its guard and its actions as its effect, in the table's
own words, so that the table can be made again:

    rcsc graph tables/task/move.rcs --form dot -o move.dot
    rcsc table move.dot

>>> from rcsc.views.graph.formats.state_graph import Edge, StateGraph
>>> from rcsc.views.graph.formats import mermaid
>>> graph = StateGraph("grip", "now", (Edge("start", "idle", "closing", guard="order(close)"),))
>>> mermaid.read(mermaid.write(graph)).edges[0].target
'closing'

A written graph is read back and proved to do what the table does (`round_trip`); what a form cannot hold is told as
lost. Trusted: Z3 and `relation` for that proof; the drawing for nothing. What it costs: a question for each line and
pair of values that the cells leave open.

Source: Haynes et al. 1984, section 8.2 and Fig. 10. Modules, in the order the data flows: `find` (the tables somebody
names), `labels` (cells on an edge), `derive` (a table's graph, of states or of lines), `formats`, `to_table`,
`round_trip`. Of a picture: `composites` (states that are drawn as one), `chart` (what is said, and where it stands, by
`layout` and `curves`), which the studio's page draws, and `drawing` as a file.
"""
