"""The vision system's pictures and what is made of them (section 5): FLOOD-FLASH and LINE-FLASH.

FLOOD-FLASH lights the whole scene: a part is a bright patch, whose moments give its middle and its direction and
whose size gives its range. LINE-FLASH casts two planes of light: each bright point lies where its ray meets the
plane, so a column of the picture is a range by *triangulation*:

    z = baseline / (u / f + tan(angle))    for a point u right of the middle, f the focal length in pixels

`flood` and `line` see nothing but a picture and the `optics`; that no pose of a part reaches them is tested in the
code and in runs (`tests/cell/test_honest.py`). Camera axes: x right, y up, z back toward the camera; a range is
counted from the camera along its axis. Lengths are millimetres.

>>> from rcsc_cell.vision.optics import STANDARD
>>> STANDARD.width_px > 0
True

Nothing here is trusted for a proof: the levels are proved for any report of the camera. What it costs: rays for a
picture; `formulas` gives the same errors without pictures (`tests/cell/test_vision.py` holds both against the
truth).

Modules, in the order the data flows: `optics`; `camera` makes pictures of the MuJoCo cell and alone knows MuJoCo;
`blobs` finds bright patches; `flood` and `line` measure; `formulas`.
"""
