"""Forms of a state graph that are written and read back.

A `state_graph` has states and edges with guards and effects, in no form. `dot`, `mermaid` and `scxml` write and read one form each,
`reading` has what reading shares, `choice` finds the form by its name.
"""
