"""The paper's cell: what stands outside the control levels when no robot does.

Buffer, vise, V-block, machine and pallet around a PUMA 560 with a force gripper and a camera at its wrist, made of
the data that the levels ask for (`tables/cell.toml`). The levels run as they would on a robot: generated executors,
orders and reports through buffers, nothing else. The cell uses what was generated and never the compiler, and no
level can tell it from another cell that keeps to the same contract.

A *plant* is the controllers of robot, hand, camera and vise over a *mechanism*, which is physics (MuJoCo; parts move
by contact forces only) or kinematics (some twenty times cheaper). An *episode* is one run with everything that is odd
about it, a *campaign* many of them by seed. A *property* is what has to hold in every cycle of every run, whatever
goes wrong.

    rcsc run make_boxt --report boxt.html    one run, with pictures
    rcsc campaign --episodes 1000            many, with faults

Nothing here is trusted for a proof. A run shows what the proofs are about, and finds what stands outside them: a part
that slips, a joint at its limit, a report that is not true.

Rooms, in the order the data flows: `database` (places, routes, parts), `workstation` (scripts, interlocks), `vision`
(pictures and what is made of them), `cell` (arm, fixtures, mechanism), `properties` (what is to hold of the cell),
`pictures` (what people look at), `episodes` (one run with whatever goes wrong in it, as those of any system;
`rcsc.run.campaign` plays many).
"""
