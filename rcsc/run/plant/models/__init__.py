"""A model for MuJoCo as a plant, bound to the buffers by data alone.

`[plant.NAME]` of a description names a model, and says which sensor fills which field from outside and which actuator a
field drives; there is nothing to program:

    [plant.mujoco]
    model = "robot.xml"

    [plant.mujoco.sensors]
    "base.travelled" = { sensor = "odometer", unit = "m" }
    "base.contact" = { sensor = "pad", over = 0.5 }

    [plant.mujoco.actuators]
    "base.speed" = { actuator = "wheels", scale = 0.001 }

Units are those of SI where nothing is said: what a sensor measures is known by its type. They are held against the
variable's unit and converted exactly. In each tick controls are set, the model makes as many steps as a tick has, and the
sensors are read; a tick must be a whole number of steps.

>>> from rcsc.run.plant.models.bindings import SENSED
>>> SENSED["mjSENS_TOUCH"], SENSED["mjSENS_VELOCIMETER"]
('N', 'm/s')

Nothing here is trusted for a proof. What it costs: the steps, and one more evaluation a tick, so that readings are of
now.

Modules, in the order the data flows: `bindings` (names, units and ranges checked), `space` (how a model looks, for the
studio), `camera` (photographs any space), `solid` (the faces of its shapes from far to near, as SVG), `model_plant` (what moves).
"""
