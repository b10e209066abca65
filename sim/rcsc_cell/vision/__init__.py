"""The vision system's pictures and what is made of them (section 5): FLOOD-FLASH and LINE-FLASH.

`camera` makes pictures of the MuJoCo cell and alone knows MuJoCo; `flood` and `line` see nothing but a picture and the
`optics`; `formulas` makes the same errors by formulas, without pictures. Camera axes: x right, y up, z back toward the
camera; a range is counted from the camera along its axis. Lengths are millimetres.
"""
