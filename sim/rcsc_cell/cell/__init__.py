"""Robot, hand, fixtures and mechanism: a plant, by physics or by kinematics.

`arm` is the arm's geometry, `reach` whether it gets where the data says; `robot` and `fixture` are controllers, `plant` joins them over a
mechanism, which is `physical` (MuJoCo, of the `mujoco_model`) or `kinematic`; `faults` are switches; `ready`
makes a plant for the first cycle.
"""
