"""Pictures of the cell, all SVG text.

No graphics driver, no browser and no script: the same state gives the same text on one machine, so that pictures can
be compared in tests and opened anywhere.

>>> from rcsc_cell.pictures.stick import stick
>>> stick((560, 0, 725, 560, 0, 625, 460, 0, 725), 80.0, None).startswith("<svg")
True

A *stick* figure is the arm in three projections and a perspective, as section 10 of the paper has it; it needs nine
numbers and no physics, so it can be drawn of a log. A *scene* is the cell as far as a log says it. What MuJoCo moves is
drawn by `rcsc.run.plant.models.solid`.

Nothing here is trusted for a proof. What it costs: time by the faces that are drawn.

Modules, in the order the data flows: `stick` draws the stick figure (in a `room`); `scene` finds in a log where everything is;
`data` is what the system names for its data: it makes and shows the database, and has a log drawn.
"""
