"""Robot, hand, fixtures and mechanism: a plant, by physics or by kinematics.

A *plant* takes the latest orders and gives the latest reports, once a cycle. The robot is told nine numbers, the
wrist plate's place and orientation, and turns them into six joint angles in closed form; both ways agree:

>>> from rcsc_cell.cell.arm import plate, solve
>>> joints = (0.1, 2.2, -1.2, 0.2, 0.7, -0.3)
>>> again = solve(plate(joints), near=joints)
>>> max(abs(one - other) for one, other in zip(plate(joints).point((0, 0, 0)), plate(again).point((0, 0, 0)))) < 1e-6
True

With physics MuJoCo moves arm, fingers, jaws and parts; nobody writes a part's pose, and pads do not stick. With
kinematics a part moves with the fingers that hold it. Both are made of the same data, have the same controllers and
the same faults, and tests hold one to the other's results.

Nothing here is trusted for a proof. What it costs: the mechanism is nearly all of a run with physics (`python -m
tests.bench.loop`).

Modules, in the order the data flows: `arm` is the arm's geometry, `reach` whether it gets where the data says;
`robot` and `fixture` are controllers, `faults` are switches, `plant` joins them over a mechanism, which is `physical`
(MuJoCo, of the `mujoco_model`) or `kinematic`; `ready` makes a plant for the first cycle, `space` says how one looks.

Source: Corke and Armstrong-Helouvry, "A search for consensus among model parameters reported for the PUMA 560 robot",
ICRA 1994.
"""
