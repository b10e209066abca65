"""The robot control system at run time: generated executors, the buffers between them, and the cycle.

In: generated files and the description of the system. Out: levels that run, one control tick at a time.
"""
