"""The paper's cell: what stands outside the control levels when no robot does.

Rooms, in the order the data flows: `database` (places, routes, parts), `workstation` (scripts, interlocks), `vision` (pictures and what is
made of them), `cell` (arm, fixtures, mechanism), `properties` (what is to hold), `episodes` (one run with whatever goes wrong in it),
`campaign` (many), `pictures` and `live` (what people look at).
"""
