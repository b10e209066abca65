"""State graphs, both ways: tables to graphs in SVG, DOT, Mermaid and SCXML, and such graphs to tables.

Source: Haynes et al. 1984, section 8.2 and Fig. 10. Nodes are the values of the table's state variable, edges are its lines.
"""
