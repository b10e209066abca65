"""Logs of runs: written as they happen, read, replayed, exported and plotted.

In: a `System` that runs. Out: an MCAP file with the whole state of every level in every cycle, and what is made of it.
"""
