"""What the executors are run on.

`snapshot` finds an input in which conditions hold or fail, `vectors` makes MC/DC vectors of them (`spell` words their conditions, `export`
writes them for users), `sampling` draws inputs by seed, leaning on edges.
"""
