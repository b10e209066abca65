"""The cell's database: one SQLite file, made of a readable data file, asked by the levels through their feeds.

A *feed* of `system.toml` fills an input with the answer to a *query* by keys (a place, a route, a point, how fingers
take a part), before each cycle. So where things are is data: when a station moves, nothing is compiled again.

>>> from rcsc_cell.database.pose import nine, pose_of, Pose, about_z
>>> plate = Pose(about_z(90.0), (560.0, 0.0, 560.0))
>>> [round(one, 9) for one in nine(pose_of(nine(plate)))] == [round(one, 9) for one in nine(plate)]
True

Building resolves every reference and holds every number against the range of the leaf that it will fill, or makes
nothing and tells every fault with its line. The same question has the same answer for as long as a run lasts, as
`rcsc prove` assumes of it.

Nothing here is trusted for a proof: the levels are proved for any answer within the declared ranges. What it costs:
it is read once; a question is a look into memory.

Modules, in the order the data flows: `pose` (rotations, points, the robot's nine numbers), `build` (data file to
database), `ask` (the levels' questions), `readable` (a table, for people).

Source: Haynes et al. 1984, sections 3 to 7. Lengths in millimetres, angles in degrees.
"""
